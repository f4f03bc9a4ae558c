/* Laws of the layers and of their builder: where layers stand, what is culled, what covers. */
#ifndef UNIT_LAYERS_H
#define UNIT_LAYERS_H

#include "unit_bad_input.h"

/* ---- where layers stand ---- */

static float log_random(float low, float high)
{
    return low * powf(high / low, random_float(0.0f, 1.0f));
}

/* A cell, a box or a shaft, and scenery of any shape before it. */
static void random_layers_desc(terrimp_layers_desc *d)
{
    int k;
    memset(d, 0, sizeof *d);
    d->distance = log_random(5.0f, 2000.0f);
    d->depth = d->distance * log_random(0.01f, 5.0f);
    d->cell_depth = log_random(0.5f, 200.0f);
    d->even = random_range(0, 2) == 0;
    for (k = 0; k < 2; k++) {
        d->cell_size[k] = random_range(0, 9) ? log_random(0.5f, 200.0f) : 0.0f;
        d->cell_tan[k] = random_range(0, 2) ? 0.0f : random_float(0.0f, 1.0f);
        d->view_tan[k] = log_random(0.02f, 1.5f);
    }
    if (random_range(0, 5) == 0 && !d->even)
        d->cell_depth = HUGE_VALF;
    d->texel = log_random(5e-4f, 5e-3f);
    if (random_range(0, 1))
        d->tolerance_rad = d->texel * random_float(0.3f, 3.0f);
}

/* An eye of the cell; a third of them in its corners. Depths count forward from the near side. */
static void random_layers_eye(const terrimp_layers_desc *d, double eye[3])
{
    int corner = random_range(0, 2) == 0, k;
    double back = d->cell_depth < 1e30f ? (double)d->cell_depth
                                        : (double)log_random(0.1f, 30.0f * d->distance);
    eye[2] = -(corner && random_range(0, 1) ? (random_range(0, 1) ? back : 0.0)
                                            : back * (double)random_float(0.0f, 1.0f));
    for (k = 0; k < 2; k++) {
        double half = 0.5 * (double)d->cell_size[k] - eye[2] * (double)d->cell_tan[k];
        eye[k] = half * (corner ? (random_range(0, 1) ? 1.0 : -1.0)
                                : (double)random_float(-1.0f, 1.0f));
    }
}

static void random_layers_point(const terrimp_layers_desc *d, double depth, double point[3])
{
    int k;
    for (k = 0; k < 2; k++)
        point[k] = depth * (double)d->view_tan[k] *
                   (random_range(0, 3) ? (double)random_float(-1.0f, 1.0f)
                                       : random_range(0, 1) ? 1.0 : -1.0);
    point[2] = depth;
}

/* How many texels a line of sight to a point passes a layer at depth t beside the point, in the
   direction where that is more; 0 where the layer's picture does not reach. */
static double texels_between(const terrimp_layers_desc *d, const double eye[3],
                             const double point[3], double t)
{
    double most = 0.0;
    int k;
    for (k = 0; k < 2; k++) {
        double at = (eye[k] + (point[k] - eye[k]) * (t - eye[2]) / (point[2] - eye[2])) / t;
        if (fabs(at) > (double)d->view_tan[k])
            return 0.0;
        most = fmax(most, fabs(at - point[k] / point[2]) / (double)d->texel);
    }
    return most;
}

static void no_eye_of_the_cell_sees_behind_a_texel(void)
{
    double worst = 0.0;
    int i, n;
    for (i = 0; i < 3000; i++) {
        terrimp_layers_desc d;
        terrimp_layers l;
        random_layers_desc(&d);
        if (terrimp_layers_plan(&d, &l) || l.count < 2)
            continue;
        for (n = 0; n < 40; n++) {
            uint32_t layer = n ? random_range(0, l.count - 2) : l.count - 2;
            double t = (double)terrimp_layer_depth(&l, layer), eye[3], point[3];
            double u = (double)terrimp_layer_depth(&l, layer + 1);
            CHECK(u > t);
            random_layers_eye(&d, eye);
            random_layers_point(&d, u, point);
            worst = fmax(worst, texels_between(&d, eye, point, t));
            /* depths are floats: with a thousand layers a texel is some thousand roundings */
            CHECK(texels_between(&d, eye, point, t) <= 1.0002 + 1e-6 * (double)l.count);
        }
    }
    CHECK(worst > 0.99); /* no layer to spare */
}

static void nothing_appears_farther_off_than_allowed(void)
{
    double worst = 0.0;
    int i, n;
    for (i = 0; i < 3000; i++) {
        terrimp_layers_desc d;
        terrimp_layers l;
        random_layers_desc(&d);
        if (terrimp_layers_plan(&d, &l))
            continue;
        CHECK(same_float(terrimp_layer_border(&l, 0), d.distance));
        CHECK(same_float(terrimp_layer_border(&l, l.count), d.distance + d.depth));
        for (n = 0; n < 40; n++) {
            double allowed = (double)(d.tolerance_rad > 0.0f ? d.tolerance_rad : d.texel);
            uint32_t layer = n < 2 ? (n ? l.count - 1u : 0u) : random_range(0, l.count - 1u);
            double low = (double)terrimp_layer_border(&l, layer);
            double high = (double)terrimp_layer_border(&l, layer + 1u), eye[3], point[3], seen[3];
            double depth = (double)terrimp_layer_depth(&l, layer), to_point[3], to_seen[3], angle;
            int k, end = (int)random_range(0, 2);
            CHECK(low <= depth * 1.000001 && depth <= high * 1.000001 && low < high);
            random_layers_eye(&d, eye);
            random_layers_point(&d, end == 0 ? low : end == 1 ? high
                                    : low + (high - low) * (double)random_float(0.0f, 1.0f), point);
            for (k = 0; k < 3; k++)
                seen[k] = point[k] * depth / point[2];
            oracle_between(eye, point, to_point);
            oracle_between(eye, seen, to_seen);
            angle = oracle_angle(to_point, to_seen) / allowed;
            worst = angle > worst ? angle : worst;
            CHECK(angle <= 1.001);
        }
    }
    CHECK(worst > 0.98);
}

/* The count from the closed form against steps that are added up one by one, in double. */
static void layers_are_as_many_as_adding_up_says(void)
{
    int i;
    for (i = 0; i < 3000; i++) {
        terrimp_layers_desc s;
        terrimp_layers l;
        double d, end, size[2], sum[2], tolerance, texel;
        uint32_t count = 1, k;
        random_layers_desc(&s);
        if (s.cell_depth > 1e30f || s.even || terrimp_layers_plan(&s, &l))
            continue;
        tolerance = (double)(s.tolerance_rad > 0.0f ? s.tolerance_rad : s.texel);
        texel = 0.9998 * fmin((double)s.texel, sqrt(2.0) * tolerance);
        for (k = 0; k < 2; k++) {
            size[k] = 0.5 * (double)s.cell_size[k];
            sum[k] = size[k] + (double)s.cell_depth * ((double)s.cell_tan[k] +
                                                       (double)s.view_tan[k]);
        }
        d = (double)l.first;
        end = (double)l.last;
        while (d > end * (1.0 + 1e-6) && count < 70000) {
            double far_side = fmax(sum[0], sum[1]) / (1.0 + d * (double)s.cell_depth);
            d -= texel / fmax(fmax(size[0], size[1]), far_side);
            count++;
        }
        CHECK(l.count >= count - 1u && l.count <= count + 1u + count / 500u);
    }
}

/* Table 4.1 of the dissertation: a house of 20 x 20 m, seen from a cell of 100 m. How deep it is he
   does not say: 44 m fits best. */
static void the_dissertations_counts_come_out(void)
{
    static const float distance[] = {90, 110, 140, 180, 250, 500, 1000};
    static const float counted[] = {110, 81, 56, 34, 19, 5, 1};
    int i;
    for (i = 0; i < 7; i++) {
        terrimp_layers_desc d;
        terrimp_layers l;
        memset(&d, 0, sizeof d);
        d.distance = distance[i];
        d.depth = 44.0f;
        d.cell_size[0] = d.cell_size[1] = d.cell_depth = 100.0f;
        d.view_tan[0] = d.view_tan[1] = 10.0f / d.distance;
        d.texel = 2.0f * tanf(0.39269908f) / 512.0f;
        CHECK(terrimp_layers_plan(&d, &l) == TERRIMP_OK);
        CHECK(fabsf((float)l.count - counted[i]) <= 0.06f * counted[i]);
    }
}

/* Scenery beyond a distance is one layer, however deep; and a cell that is a point needs one. */
static void one_layer_is_enough_from_far_away(void)
{
    terrimp_layers_desc d;
    terrimp_layers l;
    memset(&d, 0, sizeof d);
    d.texel = 0.001f;
    d.view_tan[0] = d.view_tan[1] = 0.5f;
    d.distance = 10.0f;
    d.depth = HUGE_VALF;
    CHECK(terrimp_layers_plan(&d, &l) == TERRIMP_OK && l.count == 1);
    d.cell_size[0] = 8.0f;
    d.distance = 4.0f / (2.0f * d.texel) * 1.01f;
    CHECK(terrimp_layers_plan(&d, &l) == TERRIMP_OK && l.count == 1);
    CHECK(terrimp_layer_depth(&l, 0) > d.distance && l.end > 1e30f);
    d.distance *= 0.9f;
    CHECK(terrimp_layers_plan(&d, &l) == TERRIMP_OK && l.count == 2);
    d.depth = 0.0f;
    CHECK(terrimp_layers_plan(&d, &l) == TERRIMP_OK && l.count == 1);
    CHECK(fabsf(terrimp_layer_depth(&l, 0) / d.distance - 1.0f) < 1e-6f);
}

static void each_depth_belongs_to_the_layer_between_whose_borders_it_lies(void)
{
    int i, n;
    for (i = 0; i < 500; i++) {
        terrimp_layers_desc d;
        terrimp_layers l;
        random_layers_desc(&d);
        if (terrimp_layers_plan(&d, &l))
            continue;
        CHECK(terrimp_layer_of(&l, 0.0f) == 0);
        CHECK(terrimp_layer_of(&l, d.distance + 2.0f * d.depth) == l.count - 1u);
        for (n = 0; n < 20; n++) {
            float depth = d.distance + d.depth * random_float(0.0f, 1.0f);
            uint32_t layer = terrimp_layer_of(&l, depth);
            CHECK(layer < l.count);
            CHECK(layer == 0 || terrimp_layer_border(&l, layer) <= depth);
            CHECK(layer + 1u == l.count || depth < terrimp_layer_border(&l, layer + 1u));
        }
    }
}

/* Whatever its layer, a quad fills its place in the picture, and its texels are the atlas's. */
static void quads_stand_where_their_texels_were_seen(void)
{
    static const uint32_t atlas[2] = {512, 256};
    terrimp_layers_desc d;
    terrimp_layers l;
    terrimp_capture picture;
    terrimp_box box = {{-30, -10, 100}, {40, 25, 160}};
    float eye[3] = {0, 0, 0}, matrix[16];
    terrimp_rect whole = {0, 0, 300, 150};
    int i, k;
    CHECK(terrimp_capture_fit(&box, eye, &picture) == TERRIMP_OK);
    memset(&d, 0, sizeof d);
    d.distance = 90.0f;
    d.depth = 80.0f;
    d.cell_size[0] = 20.0f;
    d.view_tan[0] = d.view_tan[1] = 0.5f;
    d.texel = (picture.tan_right - picture.tan_left) / 300.0f;
    picture.tan_up = picture.tan_down + 150.0f * d.texel;
    CHECK(terrimp_layers_plan(&d, &l) == TERRIMP_OK && l.count > 3);
    CHECK(terrimp_texture_matrix(&picture, &whole, 300, 150, matrix) == TERRIMP_OK);
    for (i = 0; i < 50; i++) {
        terrimp_layer_quad quad;
        float xyz[12], st[8], stq[12];
        quad.layer = random_range(0, l.count - 1u);
        quad.texels.x = random_range(0, 200);
        quad.texels.y = random_range(0, 100);
        quad.texels.width = random_range(1, 99);
        quad.texels.height = random_range(1, 49);
        quad.x = random_range(0, 400);
        quad.y = random_range(0, 200);
        CHECK(terrimp_layer_corners(&l, &picture, &quad, atlas, xyz, st) == TERRIMP_OK);
        CHECK(terrimp_texture_coordinates(matrix, eye, xyz, 4, stq) == TERRIMP_OK);
        for (k = 0; k < 4; k++) {
            uint32_t dx = k == 1 || k == 2 ? quad.texels.width : 0;
            uint32_t dy = k >= 2 ? quad.texels.height : 0;
            float to[3], depth;
            terrimpi_sub(xyz + 3 * k, picture.eye, to);
            depth = terrimpi_dot(to, picture.forward);
            CHECK(fabsf(depth / terrimp_layer_depth(&l, quad.layer) - 1.0f) < 1e-5f);
            depth = stq[3 * k + 2];
            CHECK(fabsf(stq[3 * k] / depth * 300.0f - (float)(quad.texels.x + dx)) < 0.01f);
            CHECK(fabsf(stq[3 * k + 1] / depth * 150.0f - (float)(quad.texels.y + dy)) < 0.01f);
            CHECK(same_float(st[2 * k], (float)(quad.x + dx) / 512.0f));
            CHECK(same_float(st[2 * k + 1], (float)(quad.y + dy) / 256.0f));
        }
    }
}

/* ---- culling ---- */

enum { CULL_SIDE_X = 70, CULL_SIDE_Y = 45, CULL_LAYERS = 10,
       CULL_WORDS = TERRIMP_MASK_WORDS(CULL_SIDE_X) };

static uint32_t cull_opaque[CULL_LAYERS][CULL_SIDE_Y * CULL_WORDS];
static uint32_t cull_visible[CULL_LAYERS][CULL_SIDE_Y * CULL_WORDS];

static int mask_at(const uint32_t *mask, uint32_t width, int x, int y)
{
    const uint32_t *row = mask + (uint32_t)y * TERRIMP_MASK_WORDS(width);
    return (int)(row[x / 32] >> (x & 31) & 1u);
}

/* Blobs of noise, larger ones for larger `size`; garbage beyond the width. */
static void random_mask(uint32_t *mask, uint32_t width, uint32_t height, int size, float fill)
{
    static float grid[64][64];
    uint32_t x, y, words = TERRIMP_MASK_WORDS(width);
    for (y = 0; y < 64; y++)
        for (x = 0; x < 64; x++)
            grid[y][x] = random_float(0.0f, 1.0f);
    for (y = 0; y < height; y++)
        for (x = 0; x < words * 32u; x++) {
            float u = (float)x / (float)size, v = (float)y / (float)size, value;
            uint32_t i = (uint32_t)u % 63u, j = (uint32_t)v % 63u;
            uint32_t *word = &mask[y * words + x / 32u];
            u -= floorf(u);
            v -= floorf(v);
            value = (grid[j][i] * (1 - u) + grid[j][i + 1] * u) * (1 - v) +
                    (grid[j + 1][i] * (1 - u) + grid[j + 1][i + 1] * u) * v;
            if (x >= width)
                value = random_float(0.0f, 2.0f * fill);
            *word = value < fill ? *word | 1u << x % 32u : *word & ~(1u << x % 32u);
        }
}

static void cull_all(int rule)
{
    static uint32_t state[4][CULL_SIDE_Y * CULL_WORDS];
    int k;
    memset(state, 0, sizeof state);
    for (k = 0; k < CULL_LAYERS; k++)
        CHECK(terrimp_layer_cull(cull_opaque[k], CULL_SIDE_X, CULL_SIDE_Y, rule, state[0],
                                 cull_visible[k]) == TERRIMP_OK);
}

/* Whether a closer layer hides a point of layer k, given in texels, from an eye that is so far to
   the side that layers shift by (fx, fy) texels each. */
static int cull_hidden(int k, float x, float y, float fx, float fy)
{
    int j;
    for (j = 0; j < k; j++) {
        int i = (int)floorf(x + (float)(k - j) * fx), h = (int)floorf(y + (float)(k - j) * fy);
        if (i >= 0 && h >= 0 && i < CULL_SIDE_X && h < CULL_SIDE_Y &&
            mask_at(cull_opaque[j], CULL_SIDE_X, i, h))
            return 1;
    }
    return 0;
}

/* The same from all of 9 x 9 eyes, for 3 x 3 points of a texel. */
static int cull_truly_hidden(int k, int x, int y)
{
    int e, p;
    for (e = 0; e < 81; e++)
        for (p = 0; p < 9; p++)
            if (!cull_hidden(k, (float)x + ((float)(p % 3) + 0.5f) / 3.0f,
                             (float)y + ((float)(p / 3) + 0.5f) / 3.0f,
                             (float)(e % 9) / 4.0f - 1.0f, (float)(e / 9) / 4.0f - 1.0f))
                return 0;
    return 1;
}

static void culling_takes_nothing_that_an_eye_sees(void)
{
    int turn, rule, k, x, y;
    long truly = 0, found[TERRIMP_CULL_COUNT] = {0, 0, 0};
    for (turn = 0; turn < 6; turn++) {
        for (k = 0; k < CULL_LAYERS; k++)
            random_mask(cull_opaque[k], CULL_SIDE_X, CULL_SIDE_Y, 4 + 3 * turn, 0.55f);
        for (rule = TERRIMP_CULL_BLOCK; rule < TERRIMP_CULL_COUNT; rule++) {
            cull_all(rule);
            for (k = 0; k < CULL_LAYERS; k++)
                for (y = 0; y < CULL_SIDE_Y; y++)
                    for (x = 0; x < CULL_SIDE_X; x++) {
                        int opaque = mask_at(cull_opaque[k], CULL_SIDE_X, x, y), hidden;
                        int shown = mask_at(cull_visible[k], CULL_SIDE_X, x, y);
                        CHECK(opaque || !shown);
                        if (!opaque || (shown && rule == TERRIMP_CULL_BLOCK))
                            continue;
                        hidden = cull_truly_hidden(k, x, y);
                        truly += hidden && rule == TERRIMP_CULL_CORNERS;
                        found[rule] += !shown;
                        CHECK(shown || hidden);
                        CHECK(shown || cull_hidden(k, (float)x + random_float(0.0f, 1.0f),
                                                   (float)y + random_float(0.0f, 1.0f),
                                                   random_float(-1.0f, 1.0f),
                                                   random_float(-1.0f, 1.0f)));
                    }
        }
    }
    CHECK(truly > 1000);
    CHECK((double)found[TERRIMP_CULL_CORNERS] >= 0.93 * (double)truly);
    CHECK(found[TERRIMP_CULL_BLOCK] > 0 &&
          found[TERRIMP_CULL_BLOCK] < found[TERRIMP_CULL_CORNERS]);
}

static void culling_may_write_over_its_input(void)
{
    static uint32_t state[4][CULL_SIDE_Y * CULL_WORDS], layer[CULL_SIDE_Y * CULL_WORDS];
    int rule, k, x, y;
    for (rule = 0; rule < TERRIMP_CULL_COUNT; rule++) {
        for (k = 0; k < CULL_LAYERS; k++)
            random_mask(cull_opaque[k], CULL_SIDE_X, CULL_SIDE_Y, 9, 0.6f);
        cull_all(rule);
        memset(state, 0, sizeof state);
        for (k = 0; k < CULL_LAYERS; k++) {
            memcpy(layer, cull_opaque[k], sizeof layer);
            CHECK(terrimp_layer_cull(layer, CULL_SIDE_X, CULL_SIDE_Y, rule, state[0], layer) ==
                  TERRIMP_OK);
            for (y = 0; y < CULL_SIDE_Y; y++)
                for (x = 0; x < CULL_SIDE_X; x++)
                    CHECK(mask_at(layer, CULL_SIDE_X, x, y) ==
                          mask_at(cull_visible[k], CULL_SIDE_X, x, y));
        }
    }
}

/* ---- covering ---- */

enum { COVER_SIDE = 150, COVER_QUADS = 4000 };

static uint32_t cover_mask[COVER_SIDE * TERRIMP_MASK_WORDS(COVER_SIDE)];
static terrimp_rect cover_rects[COVER_QUADS];

/* Checks that rectangles hold all opaque texels; returns texels + cost * rectangles. */
static double cover_judge(const terrimp_cover_desc *d, uint32_t count, int apart)
{
    static unsigned char held[COVER_SIDE][COVER_SIDE];
    double cost = 0.0;
    uint32_t i, x, y;
    memset(held, 0, sizeof held);
    for (i = 0; i < count; i++) {
        const terrimp_rect *r = &cover_rects[i];
        CHECK(rect_within(r, d->width, d->height) && r->width && r->height);
        cost += (double)(r->width + 2 * d->gutter) * (double)(r->height + 2 * d->gutter) +
                (double)d->quad_cost;
        for (y = r->y; y < r->y + r->height; y++)
            for (x = r->x; x < r->x + r->width; x++) {
                CHECK(!apart || !held[y][x]);
                held[y][x] = 1;
            }
    }
    for (y = 0; y < d->height; y++)
        for (x = 0; x < d->width; x++)
            CHECK(held[y][x] || !mask_at(d->mask, d->width, (int)x, (int)y));
    return cost;
}

static void covers_hold_all_that_is_opaque_and_cost_less_than_greedy_ones(void)
{
    int i, k;
    double sums[2] = {0, 0};
    for (i = 0; i < 60; i++) {
        terrimp_cover_desc d;
        size_t bytes;
        void *scratch;
        uint32_t count = 77;
        double ours, greedy = 1e30;
        memset(&d, 0, sizeof d);
        d.mask = cover_mask;
        d.width = random_range(i < 20 ? 1 : 100, COVER_SIDE);
        d.height = random_range(i < 20 ? 1 : 100, COVER_SIDE);
        d.quad_cost = random_range(1, 60);
        d.gutter = random_range(0, 2);
        random_mask(cover_mask, d.width, d.height, (int)random_range(3, 40),
                    random_float(0.1f, 0.7f));
        bytes = terrimp_cover_scratch_bytes(&d, COVER_QUADS);
        scratch = malloc(bytes);
        CHECK(bytes && scratch);
        for (k = 0; k < 8; k++) {
            CHECK(terrimp_cover_grow(&d, 1u << k, 0.8f, scratch, bytes, cover_rects, COVER_QUADS,
                                     &count) == TERRIMP_OK);
            greedy = fmin(greedy, cover_judge(&d, count, 0));
        }
        memset(cover_rects, UNTOUCHED, sizeof cover_rects);
        CHECK(terrimp_cover(&d, scratch, bytes, cover_rects, COVER_QUADS, &count) == TERRIMP_OK);
        ours = cover_judge(&d, count, 1);
        sums[0] += ours;
        sums[1] += greedy;
        CHECK(ours <= greedy * 1.05);
        free(scratch);
    }
    CHECK(sums[0] < 0.97 * sums[1]); /* against the best of eight sizes of cell */
}

static void simple_shapes_are_covered_exactly(void)
{
    terrimp_cover_desc d;
    static uint32_t mask[64 * 2];
    static unsigned char scratch_bytes[200000];
    void *scratch = scratch_bytes + (8 - (uintptr_t)scratch_bytes % 8) % 8;
    uint32_t count = 9, y;
    memset(&d, 0, sizeof d);
    d.mask = mask;
    d.width = d.height = 64;
    memset(mask, 0, sizeof mask);
    CHECK(terrimp_cover(&d, scratch, 199992, cover_rects, 16, &count) == TERRIMP_OK && !count);
    for (y = 5; y < 30; y++)
        mask[2 * y] = 0x0ffffff0u;
    CHECK(terrimp_cover(&d, scratch, 199992, cover_rects, 16, &count) == TERRIMP_OK && count == 1);
    CHECK(cover_rects[0].x == 4 && cover_rects[0].y == 5 && cover_rects[0].width == 24 &&
          cover_rects[0].height == 25);
    for (y = 20; y < 60; y++)
        mask[2 * y + 1] = 0xffff0000u;
    CHECK(terrimp_cover(&d, scratch, 199992, cover_rects, 16, &count) == TERRIMP_OK && count == 2);
    CHECK(cover_rects[0].x == 4 && cover_rects[1].x == 48 && cover_rects[1].height == 40);
    d.quad_cost = 100000;
    CHECK(terrimp_cover(&d, scratch, 199992, cover_rects, 16, &count) == TERRIMP_OK && count == 1);
    CHECK(cover_rects[0].width == 60 && cover_rects[0].height == 55);
}

static void quads_are_packed_with_their_gutters(void)
{
    static terrimp_layer_quad quads[200];
    static terrimp_pack_item items[200];
    static terrimp_shelf rows[200];
    static uint32_t order[200];
    terrimp_shelves shelves;
    uint32_t i, k, gutter;
    for (gutter = 0; gutter < 4; gutter++) {
        for (i = 0; i < 200; i++) {
            quads[i].texels.width = random_range(1, 40);
            quads[i].texels.height = random_range(1, 30);
        }
        CHECK(terrimp_shelves_init(&shelves, 512, 1024, 0, rows, 200) == TERRIMP_OK);
        CHECK(terrimp_layer_pack(&shelves, quads, 200, gutter, items, order) == TERRIMP_OK);
        for (i = 0; i < 200; i++) {
            terrimp_rect a = quads[i].texels;
            a.x = quads[i].x;
            a.y = quads[i].y;
            CHECK(a.x >= gutter && a.y >= gutter && a.x + a.width + gutter <= 512);
            CHECK(a.y + a.height + gutter <= shelves.top);
            for (k = 0; k < i; k++) {
                terrimp_rect b = quads[k].texels;
                b.x = quads[k].x;
                b.y = quads[k].y;
                CHECK(!rects_overlap(&a, &b, 2 * gutter));
            }
        }
        quads[7].texels.width = 513 - 2 * gutter;
        CHECK(terrimp_layer_pack(&shelves, quads, 200, gutter, items, order) ==
              TERRIMP_E_CAPACITY);
    }
}

/* ---- bad input ---- */

static void layers_refuse(void)
{
    terrimp_layers_desc good, bad;
    terrimp_layers l;
    int i, k;
    memset(&good, 0, sizeof good);
    good.distance = 50;
    good.depth = 20;
    good.cell_size[0] = good.cell_size[1] = good.cell_depth = 10;
    good.view_tan[0] = good.view_tan[1] = 0.3f;
    good.texel = 0.001f;
    REFUSES(TERRIMP_E_NULL, l, terrimp_layers_plan(NULL, &l));
    GIVES(TERRIMP_E_NULL, terrimp_layers_plan(&good, NULL));
    GIVES(TERRIMP_OK, terrimp_layers_plan(&good, &l));
    for (i = 0; i < 10; i++)
        for (k = 0; k < 3; k++) {
            float *fields[10];
            int may_be_infinite;
            bad = good;
            fields[0] = &bad.distance;
            fields[1] = &bad.view_tan[0];
            fields[2] = &bad.view_tan[1];
            fields[3] = &bad.texel;
            fields[4] = &bad.depth;
            fields[5] = &bad.cell_size[0];
            fields[6] = &bad.cell_size[1];
            fields[7] = &bad.cell_depth;
            fields[8] = &bad.cell_tan[k & 1];
            fields[9] = &bad.tolerance_rad;
            may_be_infinite = i == 4 || i == 7;
            *fields[i] = not_finite(k);
            if (!may_be_infinite || k == 0)
                REFUSES(TERRIMP_E_NOT_FINITE, l, terrimp_layers_plan(&bad, &l));
            *fields[i] = k == 0 && i < 4 ? 0.0f : k == 1 ? -1.0f : -HUGE_VALF;
            if (k < 2 && (k == 1 || i < 4))
                REFUSES(TERRIMP_E_RANGE, l, terrimp_layers_plan(&bad, &l));
        }
    bad = good;
    bad.depth = bad.cell_depth = HUGE_VALF;
    REFUSES(TERRIMP_E_RANGE, l, terrimp_layers_plan(&bad, &l));
    bad = good;
    bad.texel = 1e-7f;
    REFUSES(TERRIMP_E_RANGE, l, terrimp_layers_plan(&bad, &l));
}

static void layer_masks_refuse(void)
{
    static uint32_t mask[2 * 40], state[4][2 * 40], visible[2 * 40];
    static unsigned char memory[40000];
    void *scratch = memory + (8 - (uintptr_t)memory % 8) % 8;
    terrimp_rect rects[4];
    terrimp_cover_desc d;
    uint32_t count, i;
    size_t bytes;
    REFUSES(TERRIMP_E_NULL, visible, terrimp_layer_cull(NULL, 40, 40, 0, state[0], visible));
    REFUSES(TERRIMP_E_NULL, visible, terrimp_layer_cull(mask, 40, 40, 0, NULL, visible));
    GIVES(TERRIMP_E_NULL, terrimp_layer_cull(mask, 40, 40, 0, state[0], NULL));
    REFUSES(TERRIMP_E_RANGE, visible, terrimp_layer_cull(mask, 0, 40, 0, state[0], visible));
    REFUSES(TERRIMP_E_RANGE, visible, terrimp_layer_cull(mask, 40, 0, 0, state[0], visible));
    REFUSES(TERRIMP_E_RANGE, visible, terrimp_layer_cull(mask, 40, 40, 3, state[0], visible));
    REFUSES(TERRIMP_E_RANGE, visible, terrimp_layer_cull(mask, 40, 40, -1, state[0], visible));
    memset(&d, 0, sizeof d);
    for (i = 0; i < 40; i++)
        mask[2 * i] = i % 8 ? 0u : 0x10101010u;
    d.width = d.height = 40;
    CHECK(terrimp_cover_scratch_bytes(NULL, 4) == 0 && terrimp_cover_scratch_bytes(&d, 0) == 0);
    bytes = terrimp_cover_scratch_bytes(&d, 4);
    CHECK(bytes && bytes < sizeof memory - 8);
    REFUSES(TERRIMP_E_NULL, count, terrimp_cover(NULL, scratch, bytes, rects, 4, &count));
    REFUSES(TERRIMP_E_NULL, count, terrimp_cover(&d, scratch, bytes, rects, 4, &count));
    d.mask = mask;
    REFUSES(TERRIMP_E_NULL, count, terrimp_cover(&d, NULL, bytes, rects, 4, &count));
    REFUSES(TERRIMP_E_NULL, count, terrimp_cover(&d, scratch, bytes, NULL, 4, &count));
    GIVES(TERRIMP_E_NULL, terrimp_cover(&d, scratch, bytes, rects, 4, NULL));
    REFUSES(TERRIMP_E_ALIGN, count,
            terrimp_cover(&d, (char *)scratch + 4, bytes, rects, 4, &count));
    REFUSES(TERRIMP_E_MEMORY, count, terrimp_cover(&d, scratch, bytes - 1, rects, 4, &count));
    REFUSES(TERRIMP_E_RANGE, count, terrimp_cover(&d, scratch, bytes, rects, 0, &count));
    REFUSES(TERRIMP_E_RANGE, count,
            terrimp_cover_grow(&d, 0, 0.8f, scratch, bytes, rects, 4, &count));
    REFUSES(TERRIMP_E_RANGE, count,
            terrimp_cover_grow(&d, 1, not_finite(0), scratch, bytes, rects, 4, &count));
    REFUSES(TERRIMP_E_CAPACITY, count,
            terrimp_cover_grow(&d, 1, 1.0f, scratch, bytes, rects, 4, &count));
    d.quad_cost = 1;
    REFUSES(TERRIMP_E_CAPACITY, count, terrimp_cover(&d, scratch, bytes, rects, 4, &count));
    for (i = 0; i < 4; i++) {
        terrimp_cover_desc bad = d;
        if (i == 0)
            bad.width = 0;
        else if (i == 1)
            bad.height = 16385;
        else if (i == 2)
            bad.gutter = 65;
        else
            bad.quad_cost = (1u << 24) + 1u;
        CHECK(terrimp_cover_scratch_bytes(&bad, 4) == 0);
        REFUSES(TERRIMP_E_RANGE, count, terrimp_cover(&bad, scratch, bytes, rects, 4, &count));
    }
}

static void layer_quads_refuse(void)
{
    static const uint32_t atlas[2] = {64, 64}, none[2] = {64, 0};
    terrimp_layer_quad quad;
    terrimp_layers l;
    terrimp_capture picture;
    terrimp_shelves shelves;
    terrimp_shelf row[2];
    terrimp_pack_item item;
    uint32_t order;
    float xyz[12];
    memset(&quad, 0, sizeof quad);
    memset(&l, 0, sizeof l);
    memset(&picture, 0, sizeof picture);
    l.count = 1;
    l.first = l.last = 1;
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_layer_corners(NULL, &picture, &quad, atlas, xyz, NULL));
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_layer_corners(&l, NULL, &quad, atlas, xyz, NULL));
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_layer_corners(&l, &picture, NULL, atlas, xyz, NULL));
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_layer_corners(&l, &picture, &quad, NULL, xyz, NULL));
    GIVES(TERRIMP_E_NULL, terrimp_layer_corners(&l, &picture, &quad, atlas, NULL, NULL));
    REFUSES(TERRIMP_E_RANGE, xyz, terrimp_layer_corners(&l, &picture, &quad, none, xyz, NULL));
    quad.layer = 1;
    REFUSES(TERRIMP_E_RANGE, xyz, terrimp_layer_corners(&l, &picture, &quad, atlas, xyz, NULL));
    CHECK(terrimp_shelves_init(&shelves, 64, 64, 0, row, 2) == TERRIMP_OK);
    GIVES(TERRIMP_E_RANGE, terrimp_layer_pack(&shelves, &quad, 1, 1, &item, &order));
    quad.texels.width = quad.texels.height = 5;
    GIVES(TERRIMP_E_RANGE, terrimp_layer_pack(&shelves, &quad, 1, 65, &item, &order));
    GIVES(TERRIMP_E_NULL, terrimp_layer_pack(NULL, &quad, 1, 1, &item, &order));
    GIVES(TERRIMP_E_NULL, terrimp_layer_pack(&shelves, NULL, 1, 1, &item, &order));
    GIVES(TERRIMP_E_NULL, terrimp_layer_pack(&shelves, &quad, 1, 1, NULL, &order));
    GIVES(TERRIMP_E_NULL, terrimp_layer_pack(&shelves, &quad, 1, 1, &item, NULL));
}

static void layers_tests(void)
{
    RUN(no_eye_of_the_cell_sees_behind_a_texel);
    RUN(nothing_appears_farther_off_than_allowed);
    RUN(layers_are_as_many_as_adding_up_says);
    RUN(the_dissertations_counts_come_out);
    RUN(one_layer_is_enough_from_far_away);
    RUN(each_depth_belongs_to_the_layer_between_whose_borders_it_lies);
    RUN(quads_stand_where_their_texels_were_seen);
    RUN(culling_takes_nothing_that_an_eye_sees);
    RUN(culling_may_write_over_its_input);
    RUN(covers_hold_all_that_is_opaque_and_cost_less_than_greedy_ones);
    RUN(simple_shapes_are_covered_exactly);
    RUN(quads_are_packed_with_their_gutters);
    RUN(layers_refuse);
    RUN(layer_masks_refuse);
    RUN(layer_quads_refuse);
}

#endif
