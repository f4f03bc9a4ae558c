/* The check macro, the random numbers and the counters that all tests share. */
#ifndef CHECK_H
#define CHECK_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int check_passed, check_failed, check_skipped;
static int check_bad; /* failed checks within the running test */
static const char *check_only; /* only tests run whose names have this in them; NULL: all */

#ifndef CHECK_SEED
#define CHECK_SEED 2463534242u /* -DCHECK_SEED=n tests with other numbers */
#endif
static uint32_t check_state = CHECK_SEED;

/* Notes a failed condition and goes on; at most three lines a test. It is a function, and tests are
   called through a pointer, since thousands of copies of either would take longer to compile. */
static void check_failure(const char *file, int line, const char *test, const char *condition)
{
    if (check_bad++ < 3)
        fprintf(stderr, "%s:%d: %s: %s\n", file, line, test, condition);
}

#define CHECK(condition) \
    ((condition) ? (void)0 : check_failure(__FILE__, __LINE__, __func__, #condition))

/* A figure that a test has measured, for benchmarks that report it. */
#ifndef CHECK_NOTE
#define CHECK_NOTE(what, value) ((void)(value))
#endif

/* Runs one test function; its name says the behaviour. Each starts with the same random numbers,
   whatever ran before it. */
static inline void check_run(void (*test)(void), const char *name)
{
    if (check_only && !strstr(name, check_only))
        return;
    check_bad = 0;
    check_state = CHECK_SEED;
    test();
    if (check_bad)
        fprintf(stderr, "FAILED %s (%d)\n", name, check_bad);
    check_failed += check_bad != 0;
    check_passed += check_bad == 0;
}

#define RUN(test) check_run(test, #test)

/* A test that cannot run here says why and counts as skipped. */
#define SKIP(why) (printf("skipped %s: %s\n", __func__, why), check_skipped++, check_passed--)


/* Uniform 32-bit numbers (Marsaglia's xorshift), the same on every machine. */
static uint32_t random_bits(void)
{
    check_state ^= check_state << 13;
    check_state ^= check_state >> 17;
    check_state ^= check_state << 5;
    return check_state;
}

/* Uniform in [low, high). */
static float random_float(float low, float high)
{
    return low + (high - low) * (float)(random_bits() >> 8) * (1.0f / 16777216.0f);
}

/* Uniform in [low, high]. */
static uint32_t random_range(uint32_t low, uint32_t high)
{
    return low + random_bits() % (high - low + 1u);
}

/* Prints the closing line; returns the exit code. */
static inline int check_report(void)
{
    printf("%d passed, %d failed", check_passed, check_failed);
    if (check_skipped)
        printf(", %d skipped", check_skipped);
    printf("\n");
    return check_failed != 0;
}

#endif
