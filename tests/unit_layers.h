/* Laws of the layers and of their builder: where layers stand, what is culled, what covers. */
#ifndef UNIT_LAYERS_H
#define UNIT_LAYERS_H

#include "cover_greedy.h"
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
        double rounding = 0.0;
        random_layers_desc(&d);
        if (terrimp_layers_plan(&d, &l) || l.count < 2)
            continue;
        for (n = 0; n < 2; n++) /* depths are floats: of the way across, in texels */
            rounding = fmax(rounding, 3e-7 / (double)d.texel *
                                          (double)(0.5f * d.cell_size[n] / d.distance +
                                                   d.cell_tan[n] + 2.0f * d.view_tan[n]));
        for (n = 0; n < 40; n++) {
            uint32_t layer = n ? random_range(0, l.count - 2) : l.count - 2;
            double t = (double)terrimp_layer_depth(&l, layer), eye[3], point[3];
            double u = (double)terrimp_layer_depth(&l, layer + 1);
            CHECK(u > t);
            random_layers_eye(&d, eye);
            random_layers_point(&d, u, point);
            worst = fmax(worst, texels_between(&d, eye, point, t));
            CHECK(texels_between(&d, eye, point, t) <= 1.0002 + rounding);
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
    CHECK_NOTE("largest angle that something is off, of the allowed one", worst);
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
    float worst = 0.0f;
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
        worst = fmaxf(worst, fabsf((float)l.count / counted[i] - 1.0f));
    }
    CHECK_NOTE("largest difference from table 4.1's numbers of layers", (double)worst);
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

/* The same from all of 9 x 9 eyes, for 3 x 3 points of a texel. Along an axis that is 27 pairs of
   an eye's shift of e / 4 - 1 and a point at (2 p + 1) / 6 of the texel; how many texels away each
   one looks through what is some layers closer is the same for all texels. */
static int cull_truly_hidden(int k, int x, int y)
{
    static int away[27][CULL_LAYERS];
    int i, j, closer, pair;
    for (pair = 0; away[26][1] == 0 && pair < 27; pair++) /* the last one looks a texel on */
        for (closer = 0; closer < CULL_LAYERS; closer++)
            away[pair][closer] = (120 + 4 * (pair % 3) + 2 + closer * 3 * (pair / 3 - 4)) / 12 - 10;
    for (j = 0; j < 27; j++)
        for (i = 0; i < 27; i++) {
            int hidden = 0;
            for (closer = 1; closer <= k && !hidden; closer++) {
                int u = x + away[i][closer], v = y + away[j][closer];
                hidden = u >= 0 && v >= 0 && u < CULL_SIDE_X && v < CULL_SIDE_Y &&
                         mask_at(cull_opaque[k - closer], CULL_SIDE_X, u, v);
            }
            if (!hidden)
                return 0;
        }
    return 1;
}

static void culling_takes_nothing_that_an_eye_sees(void)
{
    static signed char truth[CULL_LAYERS][CULL_SIDE_Y][CULL_SIDE_X]; /* -1: not found out yet */
    int turn, rule, k, x, y;
    long truly = 0, wrongly = 0, found[TERRIMP_CULL_COUNT] = {0, 0, 0};
    for (turn = 0; turn < 6; turn++) {
        memset(truth, -1, sizeof truth);
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
                        if (truth[k][y][x] < 0)
                            truth[k][y][x] = (signed char)cull_truly_hidden(k, x, y);
                        hidden = truth[k][y][x];
                        truly += hidden && rule == TERRIMP_CULL_CORNERS;
                        found[rule] += !shown;
                        wrongly += !shown && !hidden;
                        CHECK(shown || cull_hidden(k, (float)x + random_float(0.0f, 1.0f),
                                                   (float)y + random_float(0.0f, 1.0f),
                                                   random_float(-1.0f, 1.0f),
                                                   random_float(-1.0f, 1.0f)));
                    }
        }
    }
    CHECK(truly > 1000 && wrongly == 0);
    CHECK_NOTE("culled, of what 9 x 9 eyes find hidden",
               (double)found[TERRIMP_CULL_CORNERS] / (double)truly);
    CHECK_NOTE("culled, but seen by one of them", (double)wrongly);
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
    int i, k, dearer = 0;
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
            count = cover_greedily(&d, 1u << k, 0.8f, cover_rects, COVER_QUADS);
            CHECK(count <= COVER_QUADS);
            greedy = fmin(greedy, cover_judge(&d, count, 0));
        }
        memset(cover_rects, UNTOUCHED, sizeof cover_rects);
        CHECK(terrimp_cover(&d, scratch, bytes, cover_rects, COVER_QUADS, &count) == TERRIMP_OK);
        ours = cover_judge(&d, count, 1);
        sums[0] += ours;
        sums[1] += greedy;
        CHECK(ours <= greedy * 1.10);
        dearer += ours > greedy * 1.05;
        free(scratch);
    }
    CHECK(dearer <= 3); /* one in twenty, for other random numbers than the usual ones */
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
    static terrimp_rect rects[200];
    static uint32_t order[400];
    static const uint32_t atlas[2] = {512, 700};
    uint32_t i, k, gutter;
    for (gutter = 0; gutter < 4; gutter++) {
        for (i = 0; i < 200; i++) {
            quads[i].texels.width = random_range(1, 40);
            quads[i].texels.height = random_range(1, 30);
        }
        CHECK(terrimp_layer_pack(atlas, quads, 200, gutter, rects, order) == TERRIMP_OK);
        for (i = 0; i < 200; i++) {
            terrimp_rect a = quads[i].texels;
            a.x = quads[i].x;
            a.y = quads[i].y;
            CHECK(a.x >= gutter && a.y >= gutter && a.x + a.width + gutter <= 512);
            CHECK(a.y + a.height + gutter <= atlas[1]);
            for (k = 0; k < i; k++) {
                terrimp_rect b = quads[k].texels;
                b.x = quads[k].x;
                b.y = quads[k].y;
                CHECK(!rects_overlap(&a, &b, 2 * gutter));
            }
        }
        quads[7].texels.width = 513 - 2 * gutter;
        CHECK(terrimp_layer_pack(atlas, quads, 200, gutter, rects, order) ==
              TERRIMP_E_CAPACITY);
    }
}

/* ---- recording ---- */

/* Both sides of a border, and both triangles of an edge, get the same cut, bit for bit; and the
   parts are the triangle, no more and no less. */
static void cuts_are_alike_on_both_sides_of_a_border(void)
{
    int i, k;
    for (i = 0; i < 2000; i++) {
        float tri[2][9], depths[2][3], out[2][15], cut = random_float(2.0f, 9.0f);
        double area[3] = {0, 0, 0};
        uint32_t count[2] = {99, 99}, n, m;
        for (k = 0; k < 9; k++)
            tri[0][k] = random_float(1.0f, 10.0f);
        if (i % 5 == 0)
            tri[0][5] = cut; /* a vertex in the border */
        memcpy(tri[1], tri[0] + 3, 3 * sizeof(float)); /* shares edge 0-1, the other way round */
        memcpy(tri[1] + 3, tri[0], 3 * sizeof(float));
        for (k = 6; k < 9; k++)
            tri[1][k] = random_float(1.0f, 10.0f);
        for (k = 0; k < 6; k++)
            depths[k / 3][k % 3] = tri[k / 3][3 * (k % 3) + 2];
        CHECK(terrimp_layer_clip(tri[0], 3, depths[0], 0.0f, cut, out[0], &count[0]) == TERRIMP_OK);
        CHECK(terrimp_layer_clip(tri[0], 3, depths[0], cut, 99.0f, out[1], &count[1]) ==
              TERRIMP_OK);
        CHECK(count[0] <= 5 && count[1] <= 5);
        for (k = 0; k < 2; k++)
            for (n = 0; n < count[k]; n++) {
                const float *p = out[k] + 3 * n, *q = out[k] + 3 * ((n + 1) % count[k]);
                area[k] += (double)p[0] * (double)q[1] - (double)q[0] * (double)p[1];
                if (p[2] < cut || p[2] > cut)
                    CHECK(k ? p[2] > cut * 0.999999f : p[2] < cut * 1.000001f);
            }
        for (n = 0; n < 3; n++) {
            const float *p = tri[0] + 3 * n, *q = tri[0] + 3 * ((n + 1) % 3);
            area[2] += (double)p[0] * (double)q[1] - (double)q[0] * (double)p[1];
        }
        CHECK(fabs(area[0] + area[1] - area[2]) < 1e-3);
        /* cut vertices of the front part are vertices of the back part, and of the neighbour */
        CHECK(terrimp_layer_clip(tri[1], 3, depths[1], 0.0f, cut, out[0], &count[0]) == TERRIMP_OK);
        for (n = 0; n < count[1]; n++) {
            const float *p = out[1] + 3 * n, *a = tri[0], *b = tri[0] + 3;
            int found = 0, on_edge = (a[2] < cut) != (b[2] < cut) &&
                                     fabsf((p[0] - a[0]) * (b[2] - a[2]) -
                                           (p[2] - a[2]) * (b[0] - a[0])) < 1e-4f &&
                                     fabsf((p[1] - a[1]) * (b[2] - a[2]) -
                                           (p[2] - a[2]) * (b[1] - a[1])) < 1e-4f &&
                                     fabsf(p[2] - cut) < 1e-5f;
            for (m = 0; m < count[0]; m++)
                found |= memcmp(out[0] + 3 * m, p, 3 * sizeof(float)) == 0;
            CHECK(found || !on_edge);
        }
    }
}

enum { SCENE_SIDE = 160, SCENE_LAYERS = 80, SCENE_WORDS = TERRIMP_MASK_WORDS(SCENE_SIDE) };

typedef struct layered_scene {
    terrimp_layers_desc desc;
    terrimp_layers layers;
    terrimp_capture picture;
    terrimp_layer_record record;
    uint32_t masks[SCENE_LAYERS][SCENE_SIDE * SCENE_WORDS];
    float depths[(SCENE_SIDE + 1) * (SCENE_SIDE + 1)];
} layered_scene;

static layered_scene scene;

/* Scenery of a depth of 60 behind 100, seen along +z from a cell of any size within limits. */
static void scene_begin(uint32_t layers)
{
    layered_scene *s = &scene;
    float size = 4.0f;
    memset(s, 0, sizeof *s);
    s->picture.right[0] = -1.0f;
    s->picture.up[1] = 1.0f;
    s->picture.forward[2] = 1.0f;
    s->desc.distance = 100.0f;
    s->desc.depth = 60.0f;
    s->desc.view_tan[0] = s->desc.view_tan[1] = 0.3f;
    s->desc.texel = 0.6f / (float)SCENE_SIDE;
    do {
        size *= 1.02f;
        s->desc.cell_size[0] = s->desc.cell_depth = size;
        s->desc.cell_size[1] = 0.7f * size;
        CHECK(terrimp_layers_plan(&s->desc, &s->layers) == TERRIMP_OK);
    } while (s->layers.count < layers);
    s->picture.tan_left = s->picture.tan_down = -0.3f;
    s->picture.tan_right = s->picture.tan_up = 0.3f;
    s->record.layers = &s->layers;
    s->record.picture = &s->picture;
    s->record.width = s->record.height = SCENE_SIDE;
    s->record.masks = s->masks[0];
    CHECK(s->layers.count <= SCENE_LAYERS);
}

static void scene_triangle(const float *a, const float *b, const float *c)
{
    float xyz[9];
    memcpy(xyz, a, 3 * sizeof(float));
    memcpy(xyz + 3, b, 3 * sizeof(float));
    memcpy(xyz + 6, c, 3 * sizeof(float));
    CHECK(terrimp_layer_triangle(&scene.record, xyz) == TERRIMP_OK);
}

/* A sheet of n x n quads across the whole view, wherever `depth` says. */
static void scene_sheet(int n, float (*depth)(float u, float v))
{
    float points[41][41][3];
    int x, y;
    for (y = 0; y <= n; y++)
        for (x = 0; x <= n; x++) {
            float u = ((float)x / (float)n - 0.5f) * 1.6f, v = ((float)y / (float)n - 0.5f) * 1.6f;
            points[y][x][0] = u * 100.0f;
            points[y][x][1] = v * 100.0f;
            points[y][x][2] = depth(u, v);
        }
    for (y = 0; y < n; y++)
        for (x = 0; x < n; x++) {
            scene_triangle(points[y][x], points[y][x + 1], points[y + 1][x]);
            scene_triangle(points[y + 1][x + 1], points[y + 1][x], points[y][x + 1]);
        }
}

static float depth_of_waves(float u, float v)
{
    return 130.0f + 14.0f * sinf(31.0f * u + 9.0f * v) + 14.0f * sinf(23.0f * v - 7.0f * u);
}

static float depth_of_slope(float u, float v) { return 132.0f + 20.0f * u + 25.0f * v; }
static float depth_of_wall(float u, float v) { return 158.0f + 0.5f * u * v; }

static void scene_boxes(void)
{
    static const int faces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                    {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    int i, k;
    for (i = 0; i < 40; i++) {
        float corner[8][3], at[3], size[3], turn = random_float(0.0f, 3.0f);
        for (k = 0; k < 3; k++) {
            at[k] = random_float(-30.0f, 30.0f);
            size[k] = random_float(0.02f, 9.0f);
        }
        for (k = 0; k < 8; k++) {
            float x = (k & 1 ? 0.5f : -0.5f) * size[0], z = (k & 4 ? 0.5f : -0.5f) * size[2];
            corner[k][0] = at[0] + x * cosf(turn) - z * sinf(turn);
            corner[k][1] = at[1] + (k & 2 ? 0.5f : -0.5f) * size[1];
            corner[k][2] = 130.0f + 0.7f * at[2] + x * sinf(turn) + z * cosf(turn);
        }
        for (k = 0; k < 6; k++) {
            const int *f = faces[k];
            scene_triangle(corner[f[0]], corner[f[1]], corner[f[2]]);
            scene_triangle(corner[f[0]], corner[f[2]], corner[f[3]]);
        }
    }
}

static void scene_cull(void)
{
    static uint32_t state[4][SCENE_SIDE * SCENE_WORDS];
    uint32_t k;
    memset(state, 0, sizeof state);
    for (k = 0; k < scene.layers.count; k++)
        CHECK(terrimp_layer_cull(scene.masks[k], SCENE_SIDE, SCENE_SIDE, 0, state[0],
                                 scene.masks[k]) == TERRIMP_OK);
}

/* 1: a line of sight meets an opaque texel; 0: it meets none; -1: it leaves the picture. */
static int scene_ray(const double eye[3], const double point[3])
{
    int met = 0;
    uint32_t k;
    for (k = 0; k < scene.layers.count; k++) {
        double t = (double)terrimp_layer_depth(&scene.layers, k);
        double part = (t - eye[2]) / (point[2] - eye[2]);
        double u = ((eye[0] + (point[0] - eye[0]) * part) / t + 0.3) / (double)scene.layers.texel;
        double v = ((eye[1] + (point[1] - eye[1]) * part) / t + 0.3) / (double)scene.layers.texel;
        if (!(u >= 0.0 && v >= 0.0 && u < SCENE_SIDE && v < SCENE_SIDE))
            return -1;
        met |= mask_at(scene.masks[k], SCENE_SIDE, (int)u, (int)v);
    }
    return met;
}

/* Lines of sight that see through everything, from the cell's corners and eyes anywhere in it. */
static long scene_gaps(int eyes, int rays, long *met)
{
    long gaps = 0;
    int e, r;
    for (e = 0; e < eyes; e++) {
        double eye[3], point[3];
        random_layers_eye(&scene.desc, eye);
        if (e < 8) {
            eye[0] = (e & 1 ? 0.5 : -0.5) * (double)scene.desc.cell_size[0];
            eye[1] = (e & 2 ? 0.5 : -0.5) * (double)scene.desc.cell_size[1];
            eye[2] = e & 4 ? 0.0 : -(double)scene.desc.cell_depth;
        }
        for (r = 0; r < rays; r++) {
            int hit;
            random_layers_point(&scene.desc, 130.0, point);
            hit = scene_ray(eye, point);
            gaps += hit == 0;
            *met += hit == 1;
        }
    }
    return gaps;
}

/* Three scenes without any hole: an eye of the cell sees none either, culled or not. */
static void layers_show_no_gap_to_any_eye_of_the_cell(void)
{
    long gaps = 0, rays = 0;
    int i, turn;
    for (i = 0; i < 3; i++) {
        long met = 0;
        scene_begin(i == 1 ? 70 : 25);
        if (i == 0)
            scene_sheet(40, depth_of_waves);
        else
            scene_sheet(i == 1 ? 1 : 7, i == 1 ? depth_of_slope : depth_of_wall);
        if (i == 2)
            scene_boxes();
        for (turn = 0; turn < 2; turn++) {
            gaps += scene_gaps(1008, 150, &met);
            scene_cull();
        }
        CHECK(met > 100000);
        rays += met;
    }
    CHECK(gaps == 0);
    CHECK_NOTE("gaps, from 8 corners and 1,000 eyes of three scenes, culled or not", (double)gaps);
    CHECK_NOTE("rays that met something", (double)rays);
}

static void layers_of_pictures_with_depth_show_no_gap(void)
{
    int x, y, turn;
    long met = 0;
    scene_begin(40);
    for (y = 0; y <= SCENE_SIDE; y++)
        for (x = 0; x <= SCENE_SIDE; x++)
            scene.depths[y * (SCENE_SIDE + 1) + x] = depth_of_waves((float)x / 140.0f,
                                                                    (float)y / 140.0f);
    CHECK(terrimp_layer_depths(&scene.record, scene.depths) == TERRIMP_OK);
    for (turn = 0; turn < 2; turn++) {
        CHECK(scene_gaps(1008, 100, &met) == 0);
        scene_cull();
    }
    CHECK(met > 50000);
    memset(scene.masks, 0, sizeof scene.masks);
    for (x = 0; x < (SCENE_SIDE + 1) * (SCENE_SIDE + 1); x++)
        scene.depths[x] = x == 500 ? 120.0f : x % 3 ? -1.0f : not_finite(x);
    CHECK(terrimp_layer_depths(&scene.record, scene.depths) == TERRIMP_OK);
    for (turn = 0, y = 0; turn < SCENE_LAYERS; turn++)
        for (x = 0; x < SCENE_SIDE * SCENE_WORDS; x++)
            y += (int)terrimpi_mask_bit_count(scene.masks[turn][x]);
    CHECK(y == 4); /* the texels round that corner */
}

/* Texels touched by a triangle, and those whose centres it holds, against points of the triangle
   and of the texels. */
static void triangles_set_the_texels_that_they_touch(void)
{
    int i, n, x, y, outline;
    for (i = 0; i < 60; i++) {
        float xyz[9];
        double corner[3][2];
        scene_begin(8);
        for (n = 0; n < 3; n++) {
            float depth = random_float(105.0f, 155.0f);
            corner[n][0] = (double)random_float(-20.0f, 180.0f);
            corner[n][1] = (double)random_float(-20.0f, 180.0f);
            if (i % 4 == 0 && n == 2) /* a sliver */
                corner[2][0] = corner[1][0] + 0.01;
            xyz[3 * n] = -((float)corner[n][0] * scene.layers.texel - 0.3f) * depth;
            xyz[3 * n + 1] = ((float)corner[n][1] * scene.layers.texel - 0.3f) * depth;
            xyz[3 * n + 2] = depth;
        }
        for (outline = 1; outline >= 0; outline--) {
            memset(scene.masks, 0, sizeof scene.masks);
            scene.record.no_outline = !outline;
            CHECK(terrimp_layer_triangle(&scene.record, xyz) == TERRIMP_OK);
            for (n = 0; outline && n < 3000; n++) { /* every point's texel is set in its layer */
                double a = (double)random_float(0, 1), b = (double)random_float(0, 1), p[3], t;
                uint32_t k;
                a = sqrt(a);
                t = b;
                for (k = 0; k < 3; k++)
                    p[k] = (1 - a) * (double)xyz[k] + a * (1 - t) * (double)xyz[3 + k] +
                           a * t * (double)xyz[6 + k];
                x = (int)floor((-p[0] / p[2] + 0.3) / (double)scene.layers.texel);
                y = (int)floor((p[1] / p[2] + 0.3) / (double)scene.layers.texel);
                k = terrimp_layer_of(&scene.layers, (float)p[2]);
                if (x >= 0 && y >= 0 && x < SCENE_SIDE && y < SCENE_SIDE)
                    CHECK(mask_at(scene.masks[k], SCENE_SIDE, x, y) ||
                          fabs(fmod(-p[0] / p[2] / (double)scene.layers.texel + 80.5, 1.0) - 0.5) >
                              0.499 || /* in between two texels, or two layers, by rounding */
                          fabs(p[2] / (double)terrimp_layer_border(&scene.layers, k) - 1) < 1e-5);
            }
            for (y = 0; y < SCENE_SIDE; y++)
                for (x = 0; x < SCENE_SIDE; x++) {
                    double reach = outline ? 0.7072 : 0.01, centre[2], side[3];
                    int set = 0, k, inside;
                    for (k = 0; k < (int)scene.layers.count; k++)
                        set |= mask_at(scene.masks[k], SCENE_SIDE, x, y);
                    centre[0] = x + 0.5;
                    centre[1] = y + 0.5;
                    for (k = 0; k < 3; k++) { /* signed distance from each side */
                        const double *p = corner[k], *q = corner[(k + 1) % 3];
                        double dx = q[0] - p[0], dy = q[1] - p[1];
                        side[k] = dx * (centre[1] - p[1]) - dy * (centre[0] - p[0]);
                        side[k] /= hypot(dx, dy);
                    }
                    inside = (side[0] > -reach && side[1] > -reach && side[2] > -reach) ||
                             (side[0] < reach && side[1] < reach && side[2] < reach);
                    CHECK(!set || inside);
                    inside = (side[0] > 0.01 && side[1] > 0.01 && side[2] > 0.01) ||
                             (side[0] < -0.01 && side[1] < -0.01 && side[2] < -0.01);
                    CHECK(set || !inside);
                }
        }
    }
}

/* The repair asks for exactly what the rule says, and then the gap is closed. */
static void corners_between_two_layers_are_closed(void)
{
    enum { W = 70, H = 40, N = TERRIMP_MASK_WORDS(W) * H };
    static uint32_t front[N], back[N], wanted[N];
    int i, x, y, k;
    long closed = 0;
    for (i = 0; i < 20; i++) {
        for (k = 0; k < N; k++) {
            front[k] = random_bits() | random_bits();
            back[k] = random_bits() | random_bits();
        }
        CHECK(terrimp_layer_repair(front, back, W, H, wanted) == TERRIMP_OK);
        for (y = 0; y < H; y++)
            for (x = 0; x < W; x++) {
                int wish = 0, dx, dy;
                for (dy = -1; dy <= 1; dy += 2)
                    for (dx = -1; dx <= 1; dx += 2) {
                        int u = x + dx, v = y + dy;
                        if (u < 0 || v < 0 || u >= W || v >= H)
                            continue;
                        wish |= mask_at(front, W, u, y) && mask_at(back, W, u, y) &&
                                mask_at(front, W, x, v) && mask_at(back, W, x, v) &&
                                mask_at(front, W, u, v) != mask_at(back, W, u, v) &&
                                mask_at(front, W, x, y) && !mask_at(back, W, x, y);
                    }
                closed += wish;
                CHECK(mask_at(wanted, W, x, y) == wish);
            }
    }
    CHECK(closed > 100);
}

/* ---- depth meshes ---- */

#ifndef DEPTH_RAYS
#define DEPTH_RAYS 6000 /* -DDEPTH_RAYS=n: so many lines of sight for each of three scenes */
#endif

enum { DEPTH_VERTICES = 40000, DEPTH_SHEETS = 4000, DEPTH_TEXELS = 400000 };

static terrimp_depth_vertex depth_vertices[DEPTH_VERTICES];
static uint32_t depth_indices[6 * DEPTH_VERTICES];
static terrimp_depth_sheet depth_sheets[DEPTH_SHEETS];
static uint16_t depth_texels[DEPTH_TEXELS];
static float depth_xyz[3 * DEPTH_VERTICES];
static uint32_t scene_opaque[SCENE_LAYERS][SCENE_SIDE * SCENE_WORDS];

/* The mesh of the scene, whose masks are culled then. */
static void scene_mesh(terrimp_depth_mesh_desc *d, terrimp_depth_mesh *m)
{
    size_t bytes;
    void *scratch;
    memcpy(scene_opaque, scene.masks, sizeof scene_opaque);
    scene_cull();
    d->opaque = scene_opaque[0];
    d->visible = scene.masks[0];
    d->width = d->height = SCENE_SIDE;
    d->layers = scene.layers.count;
    memset(m, 0, sizeof *m);
    m->vertices = depth_vertices;
    m->indices = depth_indices;
    m->sheets = depth_sheets;
    m->texel_layers = depth_texels;
    m->vertex_capacity = DEPTH_VERTICES;
    m->index_capacity = 6 * DEPTH_VERTICES;
    m->sheet_capacity = DEPTH_SHEETS;
    m->texel_capacity = DEPTH_TEXELS;
    bytes = terrimp_depth_mesh_scratch_bytes(d);
    scratch = malloc(bytes + 8);
    CHECK(bytes > 0 && scratch);
    memset((char *)scratch + bytes, UNTOUCHED, 8);
    CHECK(terrimp_depth_mesh_make(d, scratch, bytes, m) == TERRIMP_OK);
    CHECK(is_untouched((char *)scratch + bytes, 8));
    free(scratch);
}

static void depth_corner(const terrimp_depth_mesh *m, uint32_t index, double out[3])
{
    const terrimp_depth_vertex *v = &m->vertices[m->indices[index]];
    out[0] = (double)v->u;
    out[1] = (double)v->v;
    out[2] = (double)v->layer;
}

static double clamp01(double x) { return x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x; }

/* Distance from a point to a triangle: to its plane where the point is above it, else to a side. */
static double oracle_to_triangle(const double p[3], double t[3][3])
{
    double normal[3], along[3][3], to[3][3], side[3], best = 1e30;
    int i, k, above = 1;
    for (i = 0; i < 3; i++) {
        oracle_between(t[i], t[(i + 1) % 3], along[i]);
        oracle_between(t[i], p, to[i]);
    }
    oracle_cross(along[0], along[1], normal);
    for (i = 0; i < 3; i++) {
        double part = clamp01(oracle_dot(to[i], along[i]) / oracle_dot(along[i], along[i])), off[3];
        for (k = 0; k < 3; k++)
            off[k] = to[i][k] - part * along[i][k];
        best = fmin(best, oracle_length(off));
        oracle_cross(along[i], to[i], side);
        above &= oracle_dot(side, normal) >= 0.0;
    }
    return above ? fabs(oracle_dot(to[0], normal)) / oracle_length(normal) : best;
}

/* Both ways: each texel that can be seen has the mesh close by, and all of the mesh has texels
   close by. One texel in 29 and ten points of every triangle are looked at. */
static void check_depth_mesh(const terrimp_depth_mesh_desc *d, const terrimp_depth_mesh *m)
{
    double tolerance = d->tolerance > 0.0f ? (double)d->tolerance : 1.0;
    uint32_t i, x, y, k, n;
    long texels = 0;
    for (k = 0; k < d->layers; k++)
        for (y = 0; y < d->height; y++)
            for (x = 0; x < d->width; x++) {
                double p[3], least = 1e30;
                if (!mask_at(scene.masks[k], d->width, (int)x, (int)y) || texels++ % 29)
                    continue;
                p[0] = x + 0.5;
                p[1] = y + 0.5;
                p[2] = k;
                for (i = 0; i < m->index_count && least > tolerance; i += 3) {
                    double t[3][3], low = 1e30, high = -1e30;
                    int c;
                    for (c = 0; c < 3; c++) {
                        depth_corner(m, i + (uint32_t)c, t[c]);
                        low = fmin(low, fabs(t[c][0] - p[0]) + fabs(t[c][1] - p[1]));
                        high = fmax(high, t[c][0]);
                    }
                    if (high < p[0] - 2.0)
                        continue;
                    least = fmin(least, oracle_to_triangle(p, t));
                }
                CHECK(least <= tolerance * 1.0001);
            }
    for (i = 0; i < m->index_count; i += 3) {
        double t[3][3], area;
        for (k = 0; k < 3; k++)
            depth_corner(m, i + k, t[k]);
        area = (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]);
        CHECK(area - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]) > -1e-6);
        for (n = 0; n < 10; n++) {
            double a = sqrt((double)random_float(0, 1)), b = (double)random_float(0, 1);
            double at[3];
            int found = 0, u, v, w;
            for (k = 0; k < 3; k++)
                at[k] = t[0][k] * (1 - a) + t[1][k] * a * (1 - b) + t[2][k] * a * b;
            for (w = 0; w < (int)d->layers && !found; w++) {
                if (fabs(at[2] - w) > tolerance + 0.75)
                    continue;
                for (v = (int)at[1] - 4; v <= (int)at[1] + 4; v++)
                    for (u = (int)at[0] - 4; u <= (int)at[0] + 4; u++)
                        found |= fabs(at[0] - u - 0.5) <= tolerance + 0.75 &&
                                 fabs(at[1] - v - 0.5) <= tolerance + 0.75 && u >= 0 && v >= 0 &&
                                 u < SCENE_SIDE && v < SCENE_SIDE &&
                                 mask_at(scene_opaque[w], SCENE_SIDE, u, v);
            }
            CHECK(found);
        }
    }
}

/* A sheet's triangles lie in its rectangle, and its texels have the colours of opaque ones. */
static void check_depth_sheets(const terrimp_depth_mesh *m)
{
    uint32_t s, i, x, y, indices = 0;
    for (s = 0; s < m->sheet_count; s++) {
        const terrimp_depth_sheet *sheet = &m->sheets[s];
        const terrimp_rect *r = &sheet->texels;
        CHECK(rect_within(r, SCENE_SIDE, SCENE_SIDE) && sheet->first_index == indices);
        CHECK(sheet->first_texel + r->width * r->height <= m->texel_count);
        indices += sheet->index_count;
        for (i = sheet->first_index; i < indices; i++) {
            const terrimp_depth_vertex *v = &m->vertices[m->indices[i]];
            CHECK(m->indices[i] < m->vertex_count);
            CHECK(v->u >= (float)r->x && v->v >= (float)r->y && v->u <= (float)(r->x + r->width) &&
                  v->v <= (float)(r->y + r->height));
        }
        for (y = 0; y < r->height; y++)
            for (x = 0; x < r->width; x++) {
                uint16_t layer = m->texel_layers[sheet->first_texel + y * r->width + x];
                CHECK(layer == TERRIMP_DEPTH_NONE ||
                      (layer < scene.layers.count &&
                       mask_at(scene_opaque[layer], SCENE_SIDE, (int)(r->x + x), (int)(r->y + y))));
            }
    }
    CHECK(indices == m->index_count);
}

/* How many lines of sight of many eyes that meet a layer miss the mesh in the world. */
static long depth_mesh_gaps(const terrimp_depth_mesh *m, int rays, long *met)
{
    long gaps = 0;
    int r;
    uint32_t i;
    CHECK(terrimp_depth_points(&scene.layers, &scene.picture, m->vertices, m->vertex_count,
                               depth_xyz) == TERRIMP_OK);
    for (r = 0; r < rays; r++) {
        double eye[3], point[3], to[3];
        int hit = 0, k;
        random_layers_eye(&scene.desc, eye);
        random_layers_point(&scene.desc, 130.0, point);
        for (k = 0; k < 2; k++)
            point[k] *= 0.9; /* the border of the picture is the mesh's border */
        if (scene_ray(eye, point) != 1)
            continue;
        eye[0] = -eye[0]; /* right is -x */
        point[0] = -point[0];
        oracle_between(eye, point, to);
        for (i = 0; i < m->index_count && !hit; i += 3) {
            double c[3][3], n[3], side[3];
            for (k = 0; k < 3; k++) {
                double corner[3];
                oracle_widen(depth_xyz + 3 * m->indices[i + (uint32_t)k], corner);
                oracle_between(eye, corner, c[k]);
            }
            for (k = 0; k < 3; k++) {
                oracle_cross(c[k], c[(k + 1) % 3], n);
                side[k] = oracle_dot(n, to);
            }
            hit = (side[0] >= -1e-6 && side[1] >= -1e-6 && side[2] >= -1e-6) ||
                  (side[0] <= 1e-6 && side[1] <= 1e-6 && side[2] <= 1e-6);
        }
        gaps += !hit;
        (*met)++;
    }
    return gaps;
}

static void depth_meshes_keep_to_their_layers_and_these_to_them(void)
{
    int i;
    for (i = 0; i < 3; i++) {
        terrimp_depth_mesh_desc d;
        terrimp_depth_mesh m;
        long met = 0, gaps;
        scene_begin(i == 1 ? 60 : 20);
        scene.desc.even = 1;
        CHECK(terrimp_layers_plan(&scene.desc, &scene.layers) == TERRIMP_OK);
        if (i == 1)
            scene_sheet(1, depth_of_slope);
        else
            scene_sheet(i == 0 ? 40 : 7, i == 0 ? depth_of_waves : depth_of_wall);
        if (i == 2)
            scene_boxes();
        memset(&d, 0, sizeof d);
        d.tolerance = i == 0 ? 2.0f : i == 1 ? 0.0f : 0.75f;
        scene_mesh(&d, &m);
        check_depth_mesh(&d, &m);
        check_depth_sheets(&m);
        CHECK(m.index_count / 3 < m.first_triangle_count / (i == 1 ? 500 : 4));
        gaps = depth_mesh_gaps(&m, DEPTH_RAYS, &met);
        CHECK(met > DEPTH_RAYS / 2);
        CHECK(gaps <= (i == 0 ? met / 2500 : 0)); /* slivers where waves fold */
        CHECK_NOTE(i == 0 ? "rays that miss the waves" : i == 1 ? "slope" : "wall and boxes",
                   (double)gaps);
        CHECK_NOTE("of so many", (double)met);
    }
}

/* A surface that is seen edge-on in the first column, all layers deep, with two surfaces beside it
   that it might go on in: the closer one shares its edge, the other one reaches up to it. */
static void folds_reach_the_edge_that_they_begin_at(void)
{
    enum { ROWS = 8, DEEP = 6 };
    static uint32_t masks[DEEP][ROWS];
    static uint64_t scratch[8000];
    terrimp_depth_mesh_desc d;
    terrimp_depth_mesh m;
    uint32_t i, at[2] = {0, 0};
    for (i = 0; i < DEEP * ROWS; i++)
        masks[i / ROWS][i % ROWS] = i / ROWS % (DEEP - 1) ? 1u : 7u;
    memset(&d, 0, sizeof d);
    d.opaque = d.visible = masks[0];
    d.width = 3;
    d.height = ROWS;
    d.layers = DEEP;
    memset(&m, 0, sizeof m);
    m.vertices = depth_vertices;
    m.indices = depth_indices;
    m.sheets = depth_sheets;
    m.texel_layers = depth_texels;
    m.vertex_capacity = m.index_capacity = m.sheet_capacity = m.texel_capacity = 1000;
    CHECK(terrimp_depth_mesh_make(&d, scratch, sizeof scratch, &m) == TERRIMP_OK);
    CHECK(m.sheet_count == 2);
    for (i = 0; i < m.index_count; i++) {
        const terrimp_depth_vertex *v = &m.vertices[m.indices[i]];
        if (!same_float(v->u, 1.0f))
            continue;
        CHECK(same_float(v->layer, 0.0f));
        at[i >= m.sheets[1].first_index]++;
    }
    CHECK(at[0] > 0 && at[1] > 0);
}

/* On layers vertices stand where layers do; between them what is straight in the world is straight
   in the grid, when the layers are even. */
static void vertices_of_depth_meshes_stand_on_their_layers(void)
{
    int i, k;
    scene_begin(30);
    scene.desc.even = 1;
    CHECK(terrimp_layers_plan(&scene.desc, &scene.layers) == TERRIMP_OK);
    for (i = 0; i < 300; i++) {
        terrimp_depth_vertex v[3];
        float xyz[9];
        double a[3], b[3], off[3];
        for (k = 0; k < 2; k++) {
            v[k].u = random_float(0.0f, SCENE_SIDE);
            v[k].v = random_float(0.0f, SCENE_SIDE);
            v[k].layer = (float)random_range(0, scene.layers.count - 1);
        }
        v[2].u = 0.5f * (v[0].u + v[1].u);
        v[2].v = 0.5f * (v[0].v + v[1].v);
        v[2].layer = 0.5f * (v[0].layer + v[1].layer);
        CHECK(terrimp_depth_points(&scene.layers, &scene.picture, v, 3, xyz) == TERRIMP_OK);
        CHECK(fabsf(xyz[2] / terrimp_layer_depth(&scene.layers, (uint32_t)v[0].layer) - 1) < 1e-5f);
        for (k = 0; k < 3; k++) {
            a[k] = (double)xyz[3 + k] - (double)xyz[k];
            b[k] = (double)xyz[6 + k] - (double)xyz[k];
        }
        oracle_cross(a, b, off);
        CHECK(oracle_length(off) <= 1e-3 * oracle_length(a));
    }
}

/* ---- all round a cell, and round an object ---- */

/* Every point beyond the distance is in the picture of the side that faces it; no eye of the cube
   sees behind a texel. */
static void layers_all_round_hold_the_world_beyond(void)
{
    int i, n;
    for (i = 0; i < 300; i++) {
        terrimp_layers_desc d;
        terrimp_layers l;
        terrimp_capture pictures[6];
        float centre[3], half = log_random(1.0f, 50.0f);
        memset(&d, 0, sizeof d);
        d.distance = half * log_random(2.0f, 30.0f);
        d.depth = d.distance * log_random(0.1f, 9.0f);
        d.texel = log_random(1e-3f, 5e-3f);
        for (n = 0; n < 3; n++)
            centre[n] = random_float(-100.0f, 100.0f);
        CHECK(terrimp_layers_around(&d, centre, half, &l, pictures) == TERRIMP_OK);
        for (n = 0; n < 30; n++) {
            double way[3], eye[3], seen[2][3], at[2], depth = 0, texels[2][2];
            uint32_t side = 0, layer = l.count > 1 ? random_range(0, l.count - 2) : 0, k, j;
            const terrimp_capture *p;
            float far_depth = terrimp_layer_depth(&l, l.count > 1 ? layer + 1 : 0);
            for (k = 0; k < 3; k++) {
                way[k] = (double)random_float(-1.0f, 1.0f);
                eye[k] = (double)centre[k] + (double)half * (double)random_float(-1.0f, 1.0f);
            }
            for (k = 0; k < 3; k++)
                if (fabs(way[k]) > fabs(way[side / 2]) || k == 0)
                    side = 2 * k + (way[k] < 0.0);
            p = &pictures[side];
            for (k = 0; k < 3; k++) /* a point of the layer's cube, in the picture of its side */
                seen[0][k] = (double)centre[k] + way[k] / fabs(way[side / 2]) *
                                                     ((double)far_depth + (double)half);
            for (j = 0; j < 2; j++) {
                double offset[3], right[3], up[3], forward[3];
                oracle_widen(p->eye, offset);
                oracle_between(offset, seen[j], offset);
                oracle_widen(p->right, right);
                oracle_widen(p->up, up);
                oracle_widen(p->forward, forward);
                depth = oracle_dot(offset, forward);
                at[0] = oracle_dot(offset, right) / depth;
                at[1] = oracle_dot(offset, up) / depth;
                for (k = 0; k < 2; k++) {
                    if (j == 0)
                        CHECK(fabs(at[k]) <= (double)p->tan_right * 1.0001);
                    texels[j][k] = at[k] / (double)d.texel;
                }
                if (j == 0) { /* where its line of sight passes the layer before */
                    double to[3], wanted = (double)terrimp_layer_depth(&l, layer), part;
                    oracle_between(eye, seen[0], to);
                    part = (depth - wanted) / oracle_dot(to, forward);
                    for (k = 0; k < 3; k++)
                        seen[1][k] = seen[0][k] - part * to[k];
                }
            }
            CHECK(fabs(depth / (double)terrimp_layer_depth(&l, layer) - 1.0) < 1e-4);
            for (k = 0; k < 2; k++)
                CHECK(fabs(at[k]) > (double)p->tan_right ||
                      fabs(texels[0][k] - texels[1][k]) <= 1.001 + 1e-6 * l.count);
        }
    }
}

static void layers_of_objects_pass_each_other_by_a_texel(void)
{
    int i, k;
    for (i = 0; i < 500; i++) {
        terrimp_box box;
        uint32_t counts[3];
        float texel = log_random(0.01f, 1.0f), slope = random_float(1.0f, 2.0f);
        for (k = 0; k < 3; k++) {
            box.min[k] = random_float(-50.0f, 50.0f);
            box.max[k] = box.min[k] + (random_range(0, 5) ? log_random(0.1f, 50.0f) : 0.0f);
        }
        CHECK(terrimp_layers_object(&box, texel, slope, counts) == TERRIMP_OK);
        for (k = 0; k < 3; k++) {
            double extent = (double)box.max[k] - (double)box.min[k];
            CHECK(counts[k] >= 1);
            CHECK(extent / counts[k] * (double)slope <= (double)texel * 1.00001);
            CHECK(counts[k] == 1 ||
                  extent / (counts[k] - 1.0) * (double)slope > (double)texel * 0.99999);
        }
    }
}

static void layers_all_round_refuse(void)
{
    terrimp_layers_desc d;
    terrimp_layers l;
    terrimp_capture pictures[6];
    terrimp_box box = {{0, 0, 0}, {1, 2, 3}}, bad = {{0, 0, 0}, {1, -2, 3}};
    float centre[3] = {0, 0, 0}, wrong[3] = {0, 0, 0};
    uint32_t counts[3];
    memset(&d, 0, sizeof d);
    d.distance = 100;
    d.depth = 50;
    d.texel = 0.002f;
    wrong[1] = not_finite(0);
    REFUSES(TERRIMP_E_NULL, l, terrimp_layers_around(NULL, centre, 5, &l, pictures));
    REFUSES(TERRIMP_E_NULL, l, terrimp_layers_around(&d, NULL, 5, &l, pictures));
    GIVES(TERRIMP_E_NULL, terrimp_layers_around(&d, centre, 5, NULL, pictures));
    REFUSES(TERRIMP_E_NULL, l, terrimp_layers_around(&d, centre, 5, &l, NULL));
    REFUSES(TERRIMP_E_NOT_FINITE, l, terrimp_layers_around(&d, wrong, 5, &l, pictures));
    REFUSES(TERRIMP_E_NOT_FINITE, l,
            terrimp_layers_around(&d, centre, not_finite(1), &l, pictures));
    REFUSES(TERRIMP_E_RANGE, pictures, terrimp_layers_around(&d, centre, 0, &l, pictures));
    d.texel = 0;
    REFUSES(TERRIMP_E_RANGE, pictures, terrimp_layers_around(&d, centre, 5, &l, pictures));
    d.distance = 0;
    REFUSES(TERRIMP_E_RANGE, l, terrimp_layers_around(&d, centre, 5, &l, pictures));
    REFUSES(TERRIMP_E_NULL, counts, terrimp_layers_object(NULL, 1, 1, counts));
    GIVES(TERRIMP_E_NULL, terrimp_layers_object(&box, 1, 1, NULL));
    REFUSES(TERRIMP_E_RANGE, counts, terrimp_layers_object(&box, 0, 1, counts));
    REFUSES(TERRIMP_E_RANGE, counts, terrimp_layers_object(&box, 1, 0.5f, counts));
    REFUSES(TERRIMP_E_RANGE, counts, terrimp_layers_object(&bad, 1, 1, counts));
    REFUSES(TERRIMP_E_RANGE, counts, terrimp_layers_object(&box, 1e-6f, 1, counts));
    REFUSES(TERRIMP_E_NOT_FINITE, counts, terrimp_layers_object(&box, not_finite(2), 1, counts));
    box.max[0] = not_finite(1);
    REFUSES(TERRIMP_E_NOT_FINITE, counts, terrimp_layers_object(&box, 1, 1, counts));
}

/* ---- bad input ---- */

static void depth_meshes_refuse(void)
{
    static uint64_t scratch[4000];
    terrimp_depth_mesh_desc good, bad;
    terrimp_depth_mesh m, full;
    terrimp_depth_vertex v = {0, 0, 0};
    terrimp_layers none;
    uint32_t mask[8] = {7, 3, 0, 0, 6, 7, 0, 1}, i;
    float xyz[3];
    size_t bytes;
    memset(&good, 0, sizeof good);
    good.opaque = good.visible = mask;
    good.width = 3;
    good.height = 4;
    good.layers = 2;
    memset(&full, 0, sizeof full);
    full.vertices = depth_vertices;
    full.indices = depth_indices;
    full.sheets = depth_sheets;
    full.texel_layers = depth_texels;
    full.vertex_capacity = full.index_capacity = full.sheet_capacity = full.texel_capacity = 100;
    bytes = terrimp_depth_mesh_scratch_bytes(&good);
    CHECK(bytes > 0 && bytes <= sizeof scratch);
    CHECK(terrimp_depth_mesh_scratch_bytes(NULL) == 0);
    GIVES(TERRIMP_OK, terrimp_depth_mesh_make(&good, scratch, bytes, &full));
    GIVES(TERRIMP_E_NULL, terrimp_depth_mesh_make(NULL, scratch, bytes, &full));
    GIVES(TERRIMP_E_NULL, terrimp_depth_mesh_make(&good, NULL, bytes, &full));
    GIVES(TERRIMP_E_NULL, terrimp_depth_mesh_make(&good, scratch, bytes, NULL));
    GIVES(TERRIMP_E_ALIGN, terrimp_depth_mesh_make(&good, (char *)scratch + 4, bytes, &full));
    GIVES(TERRIMP_E_MEMORY, terrimp_depth_mesh_make(&good, scratch, bytes - 8, &full));
    for (i = 0; i < 4; i++) {
        m = full;
        if (i == 0)
            m.vertices = NULL;
        else if (i == 1)
            m.indices = NULL;
        else if (i == 2)
            m.sheets = NULL;
        else
            m.texel_layers = NULL;
        GIVES(TERRIMP_E_NULL, terrimp_depth_mesh_make(&good, scratch, bytes, &m));
        m = full;
        *(i == 0   ? &m.vertex_capacity
          : i == 1 ? &m.index_capacity
          : i == 2 ? &m.sheet_capacity
                   : &m.texel_capacity) = 0;
        GIVES(TERRIMP_E_CAPACITY, terrimp_depth_mesh_make(&good, scratch, bytes, &m));
        CHECK(m.vertex_count == full.vertex_count && m.index_count == full.index_count &&
              m.sheet_count == full.sheet_count);
    }
    for (i = 0; i < 8; i++) {
        bad = good;
        switch (i) {
        case 0: bad.opaque = NULL; break;
        case 1: bad.visible = NULL; break;
        case 2: bad.width = 0; break;
        case 3: bad.height = 16385; break;
        case 4: bad.layers = 0; break;
        case 5: bad.layers = 65536; break;
        case 6: bad.tolerance = 0.5f; break;
        default: bad.tolerance = not_finite((int)i); break;
        }
        CHECK(terrimp_depth_mesh_scratch_bytes(&bad) == 0);
        GIVES(i < 2 ? TERRIMP_E_NULL : TERRIMP_E_RANGE,
              terrimp_depth_mesh_make(&bad, scratch, bytes, &full));
    }
    memset(mask, 0, sizeof mask); /* nothing to be seen: no mesh */
    GIVES(TERRIMP_OK, terrimp_depth_mesh_make(&good, scratch, sizeof scratch, &full));
    CHECK(full.index_count == 0 && full.sheet_count == 0);
    scene_begin(5);
    none = scene.layers;
    none.count = 0;
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_depth_points(NULL, &scene.picture, &v, 1, xyz));
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_depth_points(&scene.layers, NULL, &v, 1, xyz));
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_depth_points(&scene.layers, &scene.picture, NULL, 1, xyz));
    GIVES(TERRIMP_E_NULL, terrimp_depth_points(&scene.layers, &scene.picture, &v, 1, NULL));
    REFUSES(TERRIMP_E_RANGE, xyz, terrimp_depth_points(&none, &scene.picture, &v, 1, xyz));
}

static void recording_refuses(void)
{
    float tri[9] = {0, 0, 110, 10, 0, 120, 0, 10, 130}, depths[3] = {1, 2, 3}, out[15];
    uint32_t count, word[1];
    terrimp_layer_record bad;
    int i;
    scene_begin(8);
    REFUSES(TERRIMP_E_NULL, count, terrimp_layer_clip(NULL, 3, depths, 0, 1, out, &count));
    REFUSES(TERRIMP_E_NULL, count, terrimp_layer_clip(tri, 3, NULL, 0, 1, out, &count));
    REFUSES(TERRIMP_E_NULL, count, terrimp_layer_clip(tri, 3, depths, 0, 1, NULL, &count));
    GIVES(TERRIMP_E_NULL, terrimp_layer_clip(tri, 3, depths, 0, 1, out, NULL));
    REFUSES(TERRIMP_E_RANGE, count, terrimp_layer_clip(tri, 0, depths, 0, 1, out, &count));
    REFUSES(TERRIMP_E_RANGE, count, terrimp_layer_clip(tri, 3, depths, 2, 1, out, &count));
    REFUSES(TERRIMP_E_RANGE, count, terrimp_layer_clip(tri, 3, depths, not_finite(0), 1, out,
                                                       &count));
    depths[1] = not_finite(1);
    REFUSES(TERRIMP_E_NOT_FINITE, count, terrimp_layer_clip(tri, 3, depths, 0, 1, out, &count));
    GIVES(TERRIMP_E_NULL, terrimp_layer_triangle(NULL, tri));
    GIVES(TERRIMP_E_NULL, terrimp_layer_triangle(&scene.record, NULL));
    GIVES(TERRIMP_E_NULL, terrimp_layer_depths(&scene.record, NULL));
    for (i = 0; i < 6; i++) {
        terrimp_result wanted = i < 3 ? TERRIMP_E_NULL : TERRIMP_E_RANGE;
        terrimp_layers none = scene.layers;
        none.count = 0;
        bad = scene.record;
        if (i == 0)
            bad.layers = NULL;
        else if (i == 1)
            bad.picture = NULL;
        else if (i == 2)
            bad.masks = NULL;
        else if (i == 3)
            bad.width = 0;
        else if (i == 4)
            bad.height = 16385;
        else
            bad.layers = &none;
        GIVES(wanted, terrimp_layer_triangle(&bad, tri));
        GIVES(wanted, terrimp_layer_depths(&bad, scene.depths));
    }
    tri[4] = not_finite(2);
    GIVES(TERRIMP_E_NOT_FINITE, terrimp_layer_triangle(&scene.record, tri));
    REFUSES(TERRIMP_E_NULL, word, terrimp_layer_repair(NULL, word, 1, 1, word));
    REFUSES(TERRIMP_E_NULL, word, terrimp_layer_repair(word, NULL, 1, 1, word));
    GIVES(TERRIMP_E_NULL, terrimp_layer_repair(word, word, 1, 1, NULL));
    REFUSES(TERRIMP_E_RANGE, word, terrimp_layer_repair(word, word, 0, 1, word));
    REFUSES(TERRIMP_E_RANGE, word, terrimp_layer_repair(word, word, 1, 0, word));
}

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
    terrimp_rect rect;
    uint32_t order[2];
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
    GIVES(TERRIMP_E_RANGE, terrimp_layer_pack(atlas, &quad, 1, 1, &rect, order));
    quad.texels.width = quad.texels.height = 5;
    GIVES(TERRIMP_E_RANGE, terrimp_layer_pack(atlas, &quad, 1, 65, &rect, order));
    GIVES(TERRIMP_E_NULL, terrimp_layer_pack(NULL, &quad, 1, 1, &rect, order));
    GIVES(TERRIMP_E_NULL, terrimp_layer_pack(atlas, NULL, 1, 1, &rect, order));
    GIVES(TERRIMP_E_NULL, terrimp_layer_pack(atlas, &quad, 1, 1, NULL, order));
    GIVES(TERRIMP_E_NULL, terrimp_layer_pack(atlas, &quad, 1, 1, &rect, NULL));
}

static inline void layers_tests(void)
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
    RUN(cuts_are_alike_on_both_sides_of_a_border);
    RUN(triangles_set_the_texels_that_they_touch);
    RUN(layers_show_no_gap_to_any_eye_of_the_cell);
    RUN(layers_of_pictures_with_depth_show_no_gap);
    RUN(corners_between_two_layers_are_closed);
    RUN(depth_meshes_keep_to_their_layers_and_these_to_them);
    RUN(folds_reach_the_edge_that_they_begin_at);
    RUN(vertices_of_depth_meshes_stand_on_their_layers);
    RUN(layers_all_round_hold_the_world_beyond);
    RUN(layers_of_objects_pass_each_other_by_a_texel);
    RUN(layers_all_round_refuse);
    RUN(recording_refuses);
    RUN(depth_meshes_refuse);
    RUN(layers_refuse);
    RUN(layer_masks_refuse);
    RUN(layer_quads_refuse);
}

#endif
