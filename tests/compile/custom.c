/* Every macro that a program may replace, replaced. */
#include <math.h>
#include <stddef.h>

static int checks;
static unsigned char pool[1 << 16];
static size_t pool_used;

static void *pool_take(size_t bytes)
{
    void *taken = pool + pool_used;
    pool_used += (bytes + 15) / 16 * 16;
    return pool_used <= sizeof pool ? taken : NULL;
}

static void pool_give(void *pointer)
{
    (void)pointer;
}

static float my_root(float x) { return sqrtf(x); }
static float my_sine(float x) { return sinf(x); }
static float my_cosine(float x) { return cosf(x); }
static float my_tangent(float x) { return tanf(x); }
static float my_arc_sine(float x) { return asinf(x); }
static float my_arc_cosine(float x) { return acosf(x); }

#define TERRIMP_API static
#define TERRIMP_ASSERT(condition) ((void)((condition) ? checks++ : (checks = -100000)))
#define TERRIMP_MALLOC(bytes) pool_take(bytes)
#define TERRIMP_FREE(pointer) pool_give(pointer)
#define TERRIMP_SQRTF(x) my_root(x)
#define TERRIMP_SINF(x) my_sine(x)
#define TERRIMP_COSF(x) my_cosine(x)
#define TERRIMP_TANF(x) my_tangent(x)
#define TERRIMP_ASINF(x) my_arc_sine(x)
#define TERRIMP_ACOSF(x) my_arc_cosine(x)
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "use.h"

int main(void)
{
    return use_terrimp() || checks < 0;
}
