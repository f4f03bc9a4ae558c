/* Tests of what the benchmarks measure with: picture quality against brute force, and the cost of
   a quality. Part of unit_host.c. */
#ifndef UNIT_HOST_QUALITY_H
#define UNIT_HOST_QUALITY_H

#include "bench_plot.h"
#include "check.h"
#include "examples/host/quality.h"
#include "examples/host/stats.h"

#include <math.h>
#include <string.h>

enum { QUALITY_W = 40, QUALITY_H = 34, QUALITY_BYTES = QUALITY_W * QUALITY_H * 3 };

static const uint8_t quality_sky[3] = { 168, 200, 232 };

/* Smooth patches with noise over them: some structure for the figures to see. */
static void make_picture(uint8_t *rgb, int noise)
{
    int i;
    for (i = 0; i < QUALITY_BYTES; i++)
        rgb[i] = (uint8_t)(60 + (i / 3 % QUALITY_W) * 3 + (i / (QUALITY_W * 24)) * 5
                           + (int)random_range(0, (uint32_t)noise));
}

static void copy_with_noise(const uint8_t *from, int noise, uint8_t *to)
{
    int i;
    for (i = 0; i < QUALITY_BYTES; i++) {
        int value = from[i] + (int)random_range(0, (uint32_t)(2 * noise)) - noise;
        to[i] = (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
    }
}

static void paint(uint8_t *rgb, int x, int y, const uint8_t colour[3])
{
    memcpy(rgb + (y * QUALITY_W + x) * 3, colour, 3);
}

static int has_colour(const uint8_t *rgb, int x, int y, const uint8_t colour[3])
{
    return memcmp(rgb + (y * QUALITY_W + x) * 3, colour, 3) == 0;
}

/* ---- Structural similarity ---------------------------------------------- */

/* The similarity of the windows around one pixel, straight from the definition. */
static double slow_similarity(const uint8_t *a, const uint8_t *b, int centre_x, int centre_y)
{
    double sum = 0.0, p = 0.0, q = 0.0, pp = 0.0, qq = 0.0, pq = 0.0;
    const double c1 = 6.5025, c2 = 58.5225;
    int x, y, pass;
    for (pass = 0; pass < 3; pass++) /* the weights' sum, the means, the variances */
        for (y = -5; y <= 5; y++)
            for (x = -5; x <= 5; x++) {
                int i = ((centre_y + y) * QUALITY_W + centre_x + x) * 3;
                double w = exp(-(double)(x * x + y * y) / 4.5) / (pass ? sum : 1.0);
                double u = 0.299 * a[i] + 0.587 * a[i + 1] + 0.114 * a[i + 2];
                double v = 0.299 * b[i] + 0.587 * b[i + 1] + 0.114 * b[i + 2];
                if (pass == 0) {
                    sum += w;
                } else if (pass == 1) {
                    p += w * u;
                    q += w * v;
                } else {
                    pp += w * (u - p) * (u - p);
                    qq += w * (v - q) * (v - q);
                    pq += w * (u - p) * (v - q);
                }
            }
    return (2.0 * p * q + c1) * (2.0 * pq + c2) / ((p * p + q * q + c1) * (pp + qq + c2));
}

static double slow_ssim(const uint8_t *a, const uint8_t *b, const uint8_t *sky)
{
    double sum = 0.0;
    int x, y, count = 0;
    for (y = 5; y < QUALITY_H - 5; y++)
        for (x = 5; x < QUALITY_W - 5; x++)
            if (!sky || !has_colour(a, x, y, sky) || !has_colour(b, x, y, sky)) {
                sum += slow_similarity(a, b, x, y);
                count++;
            }
    return count ? sum / count : 1.0;
}

static void similarity_agrees_with_its_definition(void)
{
    uint8_t a[QUALITY_BYTES], b[QUALITY_BYTES];
    int round, x, y;
    for (round = 0; round < 12; round++) {
        make_picture(a, 1 + round * 5);
        copy_with_noise(a, 2 + round * 4, b);
        for (y = 0; y < round * 2; y++)
            for (x = 0; x < QUALITY_W; x++) {
                paint(a, x, y, quality_sky);
                if ((x + y) % 7)
                    paint(b, x, y, quality_sky);
            }
        CHECK(fabs(quality_ssim(a, b, QUALITY_W, QUALITY_H, NULL) - slow_ssim(a, b, NULL)) < 1e-4);
        CHECK(fabs(quality_ssim(a, b, QUALITY_W, QUALITY_H, quality_sky)
                   - slow_ssim(a, b, quality_sky)) < 1e-4);
    }
}

static void similarity_is_one_for_equals_and_falls_with_noise(void)
{
    uint8_t a[QUALITY_BYTES], b[QUALITY_BYTES];
    double before = 1.0, now;
    int noise;
    make_picture(a, 20);
    CHECK(fabs(quality_ssim(a, a, QUALITY_W, QUALITY_H, NULL) - 1.0) < 1e-6);
    for (noise = 4; noise < 100; noise *= 2) {
        copy_with_noise(a, noise, b);
        now = quality_ssim(a, b, QUALITY_W, QUALITY_H, NULL);
        CHECK(now < before);
        before = now;
    }
    CHECK(quality_ssim(a, b, 10, QUALITY_H, NULL) == -2.0);
}

/* ---- From frame to frame ------------------------------------------------ */

static int slow_change(const uint8_t *a, const uint8_t *b)
{
    int channel, most = 0;
    for (channel = 0; channel < 3; channel++)
        if (abs(a[channel] - b[channel]) > most)
            most = abs(a[channel] - b[channel]);
    return most;
}

/* Sum over a rectangle of how much more a picture changes than the reference. */
static double slow_excess(uint8_t *const four[4], int x0, int y0, int w, int h, double *largest)
{
    double sum = 0.0;
    int x, y;
    for (y = y0; y < y0 + h; y++)
        for (x = x0; x < x0 + w; x++) {
            int i = (y * QUALITY_W + x) * 3;
            double more = slow_change(four[0] + i, four[1] + i)
                          - slow_change(four[2] + i, four[3] + i);
            sum += more;
            if (more > *largest)
                *largest = more;
        }
    return sum;
}

static void change_agrees_with_brute_force(void)
{
    static uint8_t before[QUALITY_BYTES], now[QUALITY_BYTES], was[QUALITY_BYTES],
        is[QUALITY_BYTES];
    uint8_t *const four[4] = { before, now, was, is };
    int round, x, y;
    for (round = 0; round < 20; round++) {
        quality_change change;
        double largest = -255.0, block = -255.0, ignored = 0.0, mean;
        make_picture(before, 30);
        copy_with_noise(before, 1 + round, now);
        make_picture(was, 10);
        copy_with_noise(was, 12, is);
        mean = slow_excess(four, 0, 0, QUALITY_W, QUALITY_H, &largest)
               / (QUALITY_W * QUALITY_H);
        for (y = 0; y + 16 <= QUALITY_H; y += 16)
            for (x = 0; x + 16 <= QUALITY_W; x += 16)
                block = fmax(block, slow_excess(four, x, y, 16, 16, &ignored) / 256.0);
        change = quality_compare_change(before, now, was, is, QUALITY_W, QUALITY_H);
        CHECK(fabs(change.mean - mean) < 1e-9 && change.largest == largest);
        CHECK(fabs(change.block - block) < 1e-9);
        CHECK(fabs(slow_excess(four, change.block_x, change.block_y, 16, 16, &ignored) / 256.0
                   - block) < 1e-9);
    }
}

static void what_changes_like_the_reference_does_not_pop(void)
{
    uint8_t before[QUALITY_BYTES], now[QUALITY_BYTES];
    quality_change change;
    make_picture(before, 90);
    make_picture(now, 90);
    change = quality_compare_change(before, now, before, now, QUALITY_W, QUALITY_H);
    CHECK(change.mean == 0.0 && change.largest == 0.0 && change.block == 0.0);
}

/* ---- Holes -------------------------------------------------------------- */

/* Spreads from the common sky until nothing changes. */
static size_t slow_holes(const uint8_t *rgb, const uint8_t *reference, size_t *low)
{
    static int open[QUALITY_H][QUALITY_W];
    size_t holes = 0, unsure = 0;
    int x, y, i, j, changed = 1;
    for (y = 0; y < QUALITY_H; y++)
        for (x = 0; x < QUALITY_W; x++)
            open[y][x] = has_colour(rgb, x, y, quality_sky)
                         && has_colour(reference, x, y, quality_sky);
    while (changed)
        for (changed = 0, y = 0; y < QUALITY_H; y++)
            for (x = 0; x < QUALITY_W; x++)
                for (j = y - 1; j <= y + 1; j++)
                    for (i = x - 1; i <= x + 1; i++)
                        if (!open[y][x] && has_colour(rgb, x, y, quality_sky) && i >= 0 && j >= 0
                            && i < QUALITY_W && j < QUALITY_H && open[j][i])
                            open[y][x] = changed = 1;
    for (y = 0; y < QUALITY_H; y++)
        for (x = 0; x < QUALITY_W; x++)
            if (has_colour(rgb, x, y, quality_sky) && !has_colour(reference, x, y, quality_sky)) {
                unsure++;
                holes += !open[y][x];
            }
    *low = unsure - holes;
    return holes;
}

static void holes_agree_with_brute_force(void)
{
    uint8_t a[QUALITY_BYTES], b[QUALITY_BYTES];
    int round, i;
    for (round = 0; round < 60; round++) {
        size_t low, slow_low, holes, slow, first = 0;
        make_picture(a, 20);
        make_picture(b, 20);
        for (i = 0; i < QUALITY_W * QUALITY_H; i++) {
            if (random_range(0, 99) < (uint32_t)round)
                memcpy(a + i * 3, quality_sky, 3);
            if (random_range(0, 99) < 5)
                memcpy(b + i * 3, quality_sky, 3);
        }
        slow = slow_holes(a, b, &slow_low);
        holes = quality_holes(a, b, QUALITY_W, QUALITY_H, quality_sky, &low, &first);
        CHECK(holes == slow && low == slow_low);
        CHECK(!holes || (memcmp(a + first * 3, quality_sky, 3) == 0
                         && memcmp(b + first * 3, quality_sky, 3) != 0));
    }
}

static void a_low_silhouette_is_no_hole(void)
{
    uint8_t truth[QUALITY_BYTES], lower[QUALITY_BYTES];
    size_t low, first = 0;
    int x, y;
    make_picture(truth, 10);
    make_picture(lower, 10);
    for (y = 0; y < 9; y++)
        for (x = 0; x < QUALITY_W; x++) {
            if (y < 5)
                paint(truth, x, y, quality_sky);
            paint(lower, x, y, quality_sky);
        }
    paint(lower, 20, 20, quality_sky);
    paint(lower, 21, 21, quality_sky);
    CHECK(quality_holes(lower, truth, QUALITY_W, QUALITY_H, quality_sky, &low, &first) == 2);
    CHECK(low == 4 * QUALITY_W && first == 20 * QUALITY_W + 20);
}

static void a_smaller_picture_is_the_mean_of_its_squares(void)
{
    uint8_t from[QUALITY_BYTES], to[QUALITY_BYTES];
    int factor, x, y, i, j;
    for (factor = 1; factor <= 5; factor++) {
        make_picture(from, 99);
        quality_shrink(from, QUALITY_W, QUALITY_H, factor, to);
        for (y = 0; y < QUALITY_H / factor; y++)
            for (x = 0; x < QUALITY_W / factor * 3; x++) {
                double sum = 0.0;
                for (j = 0; j < factor; j++)
                    for (i = 0; i < factor; i++)
                        sum += from[((y * factor + j) * QUALITY_W + x / 3 * factor + i) * 3
                                    + x % 3];
                CHECK(fabs(to[y * (QUALITY_W / factor) * 3 + x] - sum / (factor * factor)) <= 0.5);
            }
    }
}

/* ---- Cost of a quality -------------------------------------------------- */

/* Whether no other point is at least as good and costs no more; of equals the first stands. */
static int is_on_front(const stats_point *points, int count, int i)
{
    int j;
    for (j = 0; j < count; j++) {
        int no_worse = points[j].cost <= points[i].cost && points[j].quality >= points[i].quality;
        int equal = points[j].cost == points[i].cost && points[j].quality == points[i].quality;
        if (j != i && no_worse && (!equal || j < i))
            return 0;
    }
    return 1;
}

/* The closest points of the front on both sides, and the line between them. */
static int slow_cost_at(const stats_point *points, int count, double quality, double *cost)
{
    const stats_point *below = NULL, *above = NULL;
    int i;
    for (i = 0; i < count; i++)
        if (is_on_front(points, count, i)) {
            const stats_point *p = &points[i];
            if (p->quality >= quality && (!above || p->quality < above->quality))
                above = p;
            if (p->quality < quality && (!below || p->quality > below->quality))
                below = p;
        }
    if (!above)
        return 0;
    *cost = above->cost;
    if (below)
        *cost = exp(log(below->cost) + (log(above->cost) - log(below->cost))
                    * (quality - below->quality) / (above->quality - below->quality));
    return 1;
}

static void the_cost_of_a_quality_agrees_with_brute_force(void)
{
    int round, count, i;
    for (round = 0; round < 400; round++) {
        stats_point points[20];
        double cost = -1.0, slow = -1.0, quality = (double)random_range(18, 62);
        count = (int)random_range(1, 20);
        for (i = 0; i < count; i++) { /* with ties in both */
            points[i].cost = 0.1 * (double)random_range(1, 30);
            points[i].quality = (double)random_range(20, 60);
        }
        CHECK(stats_cost_at(points, (size_t)count, quality, &cost)
              == slow_cost_at(points, count, quality, &slow));
        CHECK(fabs(cost - slow) < 1e-9);
    }
}

static void the_cost_of_a_quality_is_that_of_the_ways_that_have_it(void)
{
    const stats_point ways[4] = { { 0.4, 40.0 }, { 0.1, 30.0 }, { 0.5, 35.0 }, { 0.9, 50.0 } };
    double cost = 7.0;
    CHECK(stats_cost_at(ways, 4, 40.0, &cost) && cost == 0.4);
    CHECK(stats_cost_at(ways, 4, 20.0, &cost) && cost == 0.1);
    CHECK(stats_cost_at(ways, 4, 35.0, &cost) && fabs(cost - 0.2) < 1e-9); /* 0.5 is dearer */
    CHECK(!stats_cost_at(ways, 4, 51.0, &cost) && fabs(cost - 0.2) < 1e-9);
    CHECK(!stats_cost_at(ways, 0, 1.0, &cost));
}

/* ---- Plots -------------------------------------------------------------- */

static int count_text(const char *path, const char *text)
{
    char line[4096];
    FILE *file = fopen(path, "r");
    int count = 0;
    while (file && fgets(line, sizeof line, file)) {
        const char *at = line;
        while ((at = strstr(at, text)) != NULL) {
            at += strlen(text);
            count++;
        }
    }
    if (file)
        fclose(file);
    return count;
}

static void a_plot_holds_every_point_in_its_frame(void)
{
    static plot p;
    int round;
    for (round = 0; round < 20; round++) {
        int count = (int)random_range(1, 40), i;
        plot_axis x, y;
        memset(&p, 0, sizeof p);
        p.title = p.x_label = p.y_label = "";
        p.log_x = round % 2;
        p.log_y = round / 2 % 2;
        for (i = 0; i < count; i++)
            plot_add(&p, i % 3 ? "one" : "other", (double)random_float(0.01f, 20.0f),
                     (double)random_float(1.0f, 1.5f));
        x = plot_fit(&p, 0);
        y = plot_fit(&p, 1);
        for (i = 0; i < (int)p.series[0].count; i++) {
            double at_x = plot_place(&x, p.series[0].x[i]), at_y = plot_place(&y, p.series[0].y[i]);
            CHECK(at_x > PLOT_LEFT && at_x < PLOT_LEFT + PLOT_WIDTH);
            CHECK(at_y > PLOT_TOP && at_y < PLOT_TOP + PLOT_HEIGHT);
        }
        CHECK(plot_place(&x, 2.0) < plot_place(&x, 3.0)); /* more is right, and up */
        CHECK(plot_place(&y, 2.0) > plot_place(&y, 3.0));
        CHECK(plot_write(&p, "unit_host.svg"));
        CHECK(count_text("unit_host.svg", "<circle") == count + (int)p.count); /* and the legend */
        remove("unit_host.svg");
    }
}

static void run_quality_tests(void)
{
    RUN(a_plot_holds_every_point_in_its_frame);
    RUN(similarity_agrees_with_its_definition);
    RUN(similarity_is_one_for_equals_and_falls_with_noise);
    RUN(change_agrees_with_brute_force);
    RUN(what_changes_like_the_reference_does_not_pop);
    RUN(holes_agree_with_brute_force);
    RUN(a_low_silhouette_is_no_hole);
    RUN(a_smaller_picture_is_the_mean_of_its_squares);
    RUN(the_cost_of_a_quality_agrees_with_brute_force);
    RUN(the_cost_of_a_quality_is_that_of_the_ways_that_have_it);
}

#endif
