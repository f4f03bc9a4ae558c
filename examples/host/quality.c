#include "quality.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int is_colour(const uint8_t *pixel, const uint8_t *colour)
{
    return pixel[0] == colour[0] && pixel[1] == colour[1] && pixel[2] == colour[2];
}

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

static int larger(int a, int b)
{
    return a > b ? a : b;
}

/* ---- Structural similarity ---------------------------------------------- */

enum { TAPS = 11, MOMENTS = 5 }; /* moments: means of a, b, a * a, b * b and a * b */

static void gaussian(float weights[TAPS])
{
    float sum = 0.0f;
    int i;
    for (i = 0; i < TAPS; i++) {
        float d = (float)(i - TAPS / 2);
        weights[i] = expf(-d * d / (2.0f * 1.5f * 1.5f));
        sum += weights[i];
    }
    for (i = 0; i < TAPS; i++)
        weights[i] /= sum;
}

/* Relative to middle grey, so that the squares keep their digits. */
static float luma(const uint8_t *pixel)
{
    return 0.299f * (float)pixel[0] + 0.587f * (float)pixel[1] + 0.114f * (float)pixel[2] - 128.0f;
}

/* out[x] = sum over k of weights[k] * in[x + k * step] */
static void filter(const float *in, size_t step, const float weights[TAPS], int count, float *out)
{
    int x, k;
    for (x = 0; x < count; x++) {
        float sum = 0.0f;
        for (k = 0; k < TAPS; k++)
            sum += weights[k] * in[(size_t)x + (size_t)k * step];
        out[x] = sum;
    }
}

/* The moments of a row of pixels, filtered along the row: out[MOMENTS][width]. */
static void filter_row(const uint8_t *a, const uint8_t *b, int width, const float weights[TAPS],
                       float *scratch, float *out)
{
    int x, m;
    for (x = 0; x < width; x++) {
        float p = luma(a + x * 3), q = luma(b + x * 3);
        scratch[x] = p;
        scratch[width + x] = q;
        scratch[2 * width + x] = p * p;
        scratch[3 * width + x] = q * q;
        scratch[4 * width + x] = p * q;
    }
    for (m = 0; m < MOMENTS; m++)
        filter(scratch + m * width, 1, weights, width - TAPS + 1, out + m * width);
}

static double similarity(float mean_a, float mean_b, float aa, float bb, float ab)
{
    const double c1 = 0.01 * 255.0 * (0.01 * 255.0), c2 = 0.03 * 255.0 * (0.03 * 255.0);
    double variance_a = (double)(aa - mean_a * mean_a);
    double variance_b = (double)(bb - mean_b * mean_b);
    double covariance = (double)(ab - mean_a * mean_b);
    double p = (double)mean_a + 128.0, q = (double)mean_b + 128.0;
    return (2.0 * p * q + c1) * (2.0 * covariance + c2)
           / ((p * p + q * q + c1) * (variance_a + variance_b + c2));
}

/* rows: the filtered moments of all rows, [height][MOMENTS][width]. */
static double mean_similarity(const float *rows, const uint8_t *a, const uint8_t *b, int width,
                              int height, const uint8_t *sky, const float weights[TAPS],
                              float *scratch)
{
    size_t row = (size_t)width * MOMENTS, counted = 0;
    double sum = 0.0;
    int x, y, m, count = width - TAPS + 1;
    for (y = 0; y + TAPS <= height; y++) {
        size_t centre = ((size_t)(y + TAPS / 2) * (size_t)width + TAPS / 2) * 3;
        for (m = 0; m < MOMENTS; m++)
            filter(rows + (size_t)y * row + (size_t)(m * width), row, weights, count,
                   scratch + m * width);
        for (x = 0; x < count; x++) {
            size_t pixel = centre + (size_t)x * 3;
            if (sky && is_colour(a + pixel, sky) && is_colour(b + pixel, sky))
                continue;
            sum += similarity(scratch[x], scratch[width + x], scratch[2 * width + x],
                              scratch[3 * width + x], scratch[4 * width + x]);
            counted++;
        }
    }
    return counted ? sum / (double)counted : 1.0;
}

double quality_ssim(const uint8_t *a, const uint8_t *b, int width, int height, const uint8_t *sky)
{
    float weights[TAPS], *rows, *scratch;
    double mean;
    int y;
    if (width < TAPS || height < TAPS)
        return -2.0;
    rows = malloc((size_t)(height + 1) * (size_t)width * MOMENTS * sizeof *rows);
    if (!rows)
        return -2.0;
    scratch = rows + (size_t)height * (size_t)width * MOMENTS;
    gaussian(weights);
    for (y = 0; y < height; y++) {
        size_t row = (size_t)y * (size_t)width;
        filter_row(a + row * 3, b + row * 3, width, weights, scratch, rows + row * MOMENTS);
    }
    mean = mean_similarity(rows, a, b, width, height, sky, weights, scratch);
    free(rows);
    return mean;
}

/* ---- From frame to frame ------------------------------------------------ */

static int change_of(const uint8_t *a, const uint8_t *b)
{
    return larger(abs(a[0] - b[0]), larger(abs(a[1] - b[1]), abs(a[2] - b[2])));
}

/* Two frames of a picture and of its reference. */
typedef struct two_frames {
    const uint8_t *before, *now, *reference_before, *reference_now;
    int width, height;
} two_frames;

/* Sum of how much more a block changes than the reference does; raises *largest. */
static int block_change(const two_frames *t, int left, int top, int right, int bottom,
                        double *largest)
{
    int sum = 0, x, y;
    for (y = top; y < bottom; y++)
        for (x = left; x < right; x++) {
            size_t i = ((size_t)y * (size_t)t->width + (size_t)x) * 3;
            int more = change_of(t->before + i, t->now + i)
                       - change_of(t->reference_before + i, t->reference_now + i);
            sum += more;
            if (more > *largest)
                *largest = more;
        }
    return sum;
}

static quality_change change_of_blocks(const two_frames *t)
{
    quality_change change = { 0.0, -255.0, -255.0, 0, 0 };
    const double area = QUALITY_BLOCK * QUALITY_BLOCK;
    int left, top;
    for (top = 0; top < t->height; top += QUALITY_BLOCK)
        for (left = 0; left < t->width; left += QUALITY_BLOCK) {
            int is_whole = left + QUALITY_BLOCK <= t->width && top + QUALITY_BLOCK <= t->height;
            int right = smaller(left + QUALITY_BLOCK, t->width);
            int bottom = smaller(top + QUALITY_BLOCK, t->height);
            int sum = block_change(t, left, top, right, bottom, &change.largest);
            change.mean += sum;
            if (is_whole && sum > change.block * area) {
                change.block = sum / area;
                change.block_x = left;
                change.block_y = top;
            }
        }
    change.mean /= (double)t->width * (double)t->height;
    return change;
}

quality_change quality_compare_change(const uint8_t *before, const uint8_t *now,
                                      const uint8_t *reference_before,
                                      const uint8_t *reference_now, int width, int height)
{
    two_frames t;
    t.before = before;
    t.now = now;
    t.reference_before = reference_before;
    t.reference_now = reference_now;
    t.width = width;
    t.height = height;
    return change_of_blocks(&t);
}

/* ---- Holes -------------------------------------------------------------- */

enum { TERRAIN, UNSURE, SKY };

/* Spreads SKY over UNSURE pixels that touch it; stack holds the sky pixels whose neighbours are
   still to be looked at. */
static void spread_sky(uint8_t *marks, int width, int height, uint32_t *stack, size_t depth)
{
    while (depth) {
        uint32_t pixel = stack[--depth];
        int x = (int)(pixel % (uint32_t)width), y = (int)(pixel / (uint32_t)width), i, j;
        for (j = larger(y - 1, 0); j <= y + 1 && j < height; j++)
            for (i = larger(x - 1, 0); i <= x + 1 && i < width; i++) {
                uint32_t next = (uint32_t)j * (uint32_t)width + (uint32_t)i;
                if (marks[next] == UNSURE) {
                    marks[next] = SKY;
                    stack[depth++] = next;
                }
            }
    }
}

size_t quality_holes(const uint8_t *rgb, const uint8_t *reference, int width, int height,
                     const uint8_t sky[3], size_t *low, size_t *first)
{
    size_t count = (size_t)width * (size_t)height, unsure = 0, depth = 0, holes = 0, i;
    uint8_t *marks = malloc(count);
    uint32_t *stack = malloc(count * sizeof *stack);
    if (marks && stack) {
        for (i = 0; i < count; i++) {
            marks[i] = TERRAIN;
            if (!is_colour(rgb + i * 3, sky))
                continue;
            marks[i] = is_colour(reference + i * 3, sky) ? SKY : UNSURE;
            if (marks[i] == SKY)
                stack[depth++] = (uint32_t)i;
            else
                unsure++;
        }
        if (unsure)
            spread_sky(marks, width, height, stack, depth);
        for (i = 0; unsure && i < count; i++)
            if (marks[i] == UNSURE && holes++ == 0)
                *first = i;
        *low = unsure - holes;
    } else {
        holes = SIZE_MAX;
    }
    free(stack);
    free(marks);
    return holes;
}

/* ---- Smaller ------------------------------------------------------------ */

void quality_shrink(const uint8_t *rgb, int width, int height, int factor, uint8_t *out)
{
    int x, y, i, j, channel;
    for (y = 0; y < height / factor; y++)
        for (x = 0; x < width / factor; x++)
            for (channel = 0; channel < 3; channel++) {
                int sum = factor * factor / 2;
                for (j = 0; j < factor; j++)
                    for (i = 0; i < factor; i++)
                        sum += rgb[((size_t)(y * factor + j) * (size_t)width
                                    + (size_t)(x * factor + i)) * 3 + (size_t)channel];
                *out++ = (uint8_t)(sum / (factor * factor));
            }
}
