/* Frame times: a clock, a growing list, and the figures that sum it up. */
#ifndef HOST_STATS_H
#define HOST_STATS_H

#include <stddef.h>
#include <stdio.h>

/* Milliseconds since some moment; never goes back. */
double clock_ms(void);

/* A list of values; all zero is an empty one. */
typedef struct stats {
    double *values;
    size_t count, capacity;
} stats;

typedef struct stats_summary {
    size_t count;
    double median, mean, deviation; /* deviation: of the sample, n - 1 below */
    double p95, p99, worst;         /* percentiles by nearest rank; worst = largest */
} stats_summary;

/* Appends a value; when memory runs out the value is dropped and 0 returned, else 1. */
int stats_add(stats *s, double value);

/* All zero for an empty list. A median of an even count is the mean of the middle two. */
stats_summary stats_summarise(const stats *s);

/* Prints one `key value` line a figure; each key starts with prefix ("frame_ms" gives
   "frame_ms_median 16.7"). */
void stats_print(FILE *file, const char *prefix, stats_summary summary);

void stats_free(stats *s);

#endif
