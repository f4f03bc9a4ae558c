/* Geometry in double that the law tests compare the library's floats against. */
#ifndef UNIT_ORACLE_H
#define UNIT_ORACLE_H

#include "check.h"
#include <float.h>
#include <math.h>
#include <string.h>

static const double oracle_pi = 3.14159265358979323846;

/* Whether two numbers are one and the same float. Where registers are wider than a float, such as
   the x87's, == alone compares digits of constants and products that no float keeps. */
static int same_float(float a, float b)
{
    return terrimpi_float(a) == terrimpi_float(b);
}

static double oracle_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void oracle_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double oracle_length(const double a[3])
{
    return sqrt(oracle_dot(a, a));
}

/* The angle between two directions, exact for small and for large ones. */
static double oracle_angle(const double a[3], const double b[3])
{
    double across[3];
    oracle_cross(a, b, across);
    return atan2(oracle_length(across), oracle_dot(a, b));
}

static void oracle_widen(const float in[3], double out[3])
{
    int k;
    for (k = 0; k < 3; k++)
        out[k] = (double)in[k];
}

/* to - from */
static void oracle_between(const double from[3], const double to[3], double out[3])
{
    int k;
    for (k = 0; k < 3; k++)
        out[k] = to[k] - from[k];
}

/* out = m * (p, 1), m column-major. */
static void oracle_transform(const float m[16], const double p[3], double out[4])
{
    int row;
    for (row = 0; row < 4; row++)
        out[row] = (double)m[row] * p[0] + (double)m[4 + row] * p[1] + (double)m[8 + row] * p[2] +
                   (double)m[12 + row];
}

/* out = m * v, m column-major. */
static void oracle_transform4(const float m[16], const double v[4], double out[4])
{
    int row;
    for (row = 0; row < 4; row++)
        out[row] = (double)m[row] * v[0] + (double)m[4 + row] * v[1] + (double)m[8 + row] * v[2] +
                   (double)m[12 + row] * v[3];
}

/* Corner i of a box; bit k of i picks the maximum along axis k. */
static void oracle_corner(const terrimp_box *box, int i, double corner[3])
{
    int k;
    for (k = 0; k < 3; k++)
        corner[k] = (double)(((i >> k) & 1) ? box->max[k] : box->min[k]);
}

/* A random point in a box; one time in four on its rim, where laws break first. */
static void oracle_point_in(const terrimp_box *box, double point[3])
{
    int k;
    for (k = 0; k < 3; k++) {
        double t = (double)random_float(0.0f, 1.0f);
        uint32_t rim = random_range(0, 7);
        if (rim < 2u)
            t = (double)rim;
        point[k] = (double)box->min[k] + t * ((double)box->max[k] - (double)box->min[k]);
    }
}

/* A random direction of a random length within [shortest, longest]. */
static void random_vector(float shortest, float longest, float out[3])
{
    float length, wanted = random_float(shortest, longest);
    int k;
    do {
        for (k = 0; k < 3; k++)
            out[k] = random_float(-1.0f, 1.0f);
        length = sqrtf(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    } while (length < 0.1f || length > 1.0f);
    for (k = 0; k < 3; k++)
        out[k] *= wanted / length;
}

/* A random number whose magnitude is spread evenly over the powers between two limits. */
static float random_magnitude(float least, float most)
{
    return least * powf(most / least, random_float(0.0f, 1.0f));
}

/* A random box around a place, of sides up to `side`; one side in eight is flat. */
static void random_box(const float place[3], float side, terrimp_box *box)
{
    int k;
    for (k = 0; k < 3; k++) {
        float extent = random_range(0, 7) == 0 ? 0.0f : random_float(0.01f, 1.0f) * side;
        box->min[k] = place[k] - 0.5f * extent;
        box->max[k] = box->min[k] + extent;
    }
}

/* How often a test that takes its time repeats: less often than it could, unless TERRIMP_LONG is in
   the environment. */
static uint32_t check_rounds(uint32_t ordinary, uint32_t all)
{
    return getenv("TERRIMP_LONG") ? all : ordinary;
}

/* Whether memory is untouched: tests fill outputs with this byte before a call that fails. */
enum { UNTOUCHED = 0xa5 };

static int is_untouched(const void *memory, size_t bytes)
{
    const unsigned char *at = (const unsigned char *)memory;
    while (bytes-- > 0)
        if (*at++ != UNTOUCHED)
            return 0;
    return 1;
}

/* Fowler, Noll and Vo's hash, to compare streams of commands bit for bit. */
static uint32_t hash_bytes(uint32_t hash, const void *memory, size_t bytes)
{
    const unsigned char *at = (const unsigned char *)memory;
    while (bytes-- > 0)
        hash = (hash ^ *at++) * 16777619u;
    return hash;
}

/* Whether, from the eye, terrain over the rectangle of box b cannot hide any over that of box a: a
   plane stands between them, and the eye is on the side of a. */
static inline int oracle_cannot_hide(const terrimp_box *b, const terrimp_box *a,
                                     const float eye[3])
{
    int k;
    for (k = 0; k < 3; k += 2)
        if ((a->max[k] <= b->min[k] && eye[k] <= b->min[k]) ||
            (a->min[k] >= b->max[k] && eye[k] >= b->max[k]))
            return 1;
    return 0;
}

#endif
