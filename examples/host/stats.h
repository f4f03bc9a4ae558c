/* Frame times: clocks, a growing list, the figures that sum it up, and what it costs to reach a
   quality. */
#ifndef HOST_STATS_H
#define HOST_STATS_H

#include <stddef.h>
#include <stdio.h>

/* Milliseconds since some moment; never goes back. */
double clock_ms(void);

/* Milliseconds that all threads of this process have worked. */
double clock_cpu_ms(void);

/* A list of values; all zero is an empty one. */
typedef struct stats {
    double *values;
    size_t count, capacity;
} stats;

typedef struct stats_summary {
    size_t count;
    double median, mean, deviation; /* deviation: of the sample, n - 1 below */
    double p95, p99, worst;         /* percentiles by nearest rank; worst = largest */
    double least;
} stats_summary;

/* Appends a value; when memory runs out the value is dropped and 0 returned, else 1. */
int stats_add(stats *s, double value);

/* All zero for an empty list. A median of an even count is the mean of the middle two. */
stats_summary stats_summarise(const stats *s);

/* Prints one `key value` line a figure; each key starts with prefix ("frame_ms" gives
   "frame_ms_median 16.7"). */
void stats_print(FILE *file, const char *prefix, stats_summary summary);

void stats_free(stats *s);

/* A way to draw: what it costs, and how good it is. */
typedef struct stats_point {
    double cost;    /* > 0 */
    double quality; /* more is better */
} stats_point;

/* The least cost at which a set of ways reaches a quality. Points that are no better than a cheaper
   one do not count; between neighbours of the others the logarithm of the cost is linear in
   quality. A quality below all of them costs what the cheapest does. Returns 1, or 0 when none is
   that good, or memory runs out; then *cost is untouched. */
int stats_cost_at(const stats_point *points, size_t count, double quality, double *cost);

#endif
