#define _POSIX_C_SOURCE 199309L /* clock_gettime */

#include "stats.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double read_clock(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

double clock_ms(void)
{
    return read_clock(CLOCK_MONOTONIC);
}

double clock_cpu_ms(void)
{
    return read_clock(CLOCK_PROCESS_CPUTIME_ID);
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
    stats_summary out = { 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0 };
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
    out.least = sorted[0];
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

/* ---- Cost of a quality -------------------------------------------------- */

/* By cost; of equal costs the better one first. */
static int compare_points(const void *left, const void *right)
{
    const stats_point *a = left, *b = right;
    if (a->cost != b->cost)
        return a->cost < b->cost ? -1 : 1;
    return (a->quality < b->quality) - (a->quality > b->quality);
}

/* Keeps the points that are better than every cheaper one; both rise along what is kept. */
static size_t keep_front(stats_point *points, size_t count)
{
    size_t kept = 0, i;
    qsort(points, count, sizeof *points, compare_points);
    for (i = 0; i < count; i++)
        if (kept == 0 || points[i].quality > points[kept - 1].quality)
            points[kept++] = points[i];
    return kept;
}

int stats_cost_at(const stats_point *points, size_t count, double quality, double *cost)
{
    stats_point *front = count ? malloc(count * sizeof *front) : NULL;
    size_t kept, i = 0;
    if (!front)
        return 0;
    memcpy(front, points, count * sizeof *front);
    kept = keep_front(front, count);
    while (i < kept && front[i].quality < quality)
        i++;
    if (i > 0 && i < kept) {
        double part = (quality - front[i - 1].quality) / (front[i].quality - front[i - 1].quality);
        *cost = front[i - 1].cost * pow(front[i].cost / front[i - 1].cost, part);
    } else if (i == 0) {
        *cost = front[0].cost;
    }
    free(front);
    return i < kept;
}
