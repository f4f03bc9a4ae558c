#define _POSIX_C_SOURCE 199309L /* clock_gettime */

#include "stats.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

double clock_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

int stats_add(stats *s, double value)
{
    if (s->count == s->capacity) {
        size_t capacity = s->capacity ? s->capacity * 2 : 256;
        double *values = realloc(s->values, capacity * sizeof *values);
        if (!values)
            return 0;
        s->values = values;
        s->capacity = capacity;
    }
    s->values[s->count++] = value;
    return 1;
}

static int compare_values(const void *left, const void *right)
{
    double a = *(const double *)left, b = *(const double *)right;
    return (a > b) - (a < b);
}

/* The smallest value that at least percent of the values do not pass. */
static double percentile(const double *sorted, size_t count, size_t percent)
{
    size_t rank = (count * percent + 99) / 100;
    return sorted[rank - 1];
}

static double mean_of(const double *values, size_t count)
{
    double sum = 0.0;
    size_t i;
    for (i = 0; i < count; i++)
        sum += values[i];
    return sum / (double)count;
}

static double deviation_of(const double *values, size_t count, double mean)
{
    double sum = 0.0;
    size_t i;
    for (i = 0; i < count; i++)
        sum += (values[i] - mean) * (values[i] - mean);
    return count > 1 ? sqrt(sum / (double)(count - 1)) : 0.0;
}

stats_summary stats_summarise(const stats *s)
{
    stats_summary out = { 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0 };
    size_t n = s->count;
    double *sorted = n ? malloc(n * sizeof *sorted) : NULL;
    if (!sorted)
        return out;
    memcpy(sorted, s->values, n * sizeof *sorted);
    qsort(sorted, n, sizeof *sorted, compare_values);
    out.count = n;
    out.median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
    out.mean = mean_of(sorted, n);
    out.deviation = deviation_of(sorted, n, out.mean);
    out.p95 = percentile(sorted, n, 95);
    out.p99 = percentile(sorted, n, 99);
    out.worst = sorted[n - 1];
    free(sorted);
    return out;
}

void stats_print(FILE *file, const char *prefix, stats_summary summary)
{
    fprintf(file, "%s_count %zu\n", prefix, summary.count);
    fprintf(file, "%s_median %.3f\n", prefix, summary.median);
    fprintf(file, "%s_mean %.3f\n", prefix, summary.mean);
    fprintf(file, "%s_deviation %.3f\n", prefix, summary.deviation);
    fprintf(file, "%s_p95 %.3f\n", prefix, summary.p95);
    fprintf(file, "%s_p99 %.3f\n", prefix, summary.p99);
    fprintf(file, "%s_worst %.3f\n", prefix, summary.worst);
}

void stats_free(stats *s)
{
    free(s->values);
    memset(s, 0, sizeof *s);
}
