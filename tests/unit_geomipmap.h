/* Laws of the geomipmap room: patterns, errors, selection, morphing. */
#ifndef UNIT_GEOMIPMAP_H
#define UNIT_GEOMIPMAP_H

#include "unit_camera.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- patterns ---- */

static const uint32_t mip_quads[] = {4, 6, 8, 16, 32, 64};

/* Twice the area of a triangle in quads; above 0 when it is counter-clockwise seen from +y. */
static int32_t mip_area2(uint32_t quads, const uint32_t v[3])
{
    int32_t row = (int32_t)quads + 1, x[3], z[3], k;
    for (k = 0; k < 3; k++) {
        x[k] = (int32_t)v[k] % row;
        z[k] = (int32_t)v[k] / row;
    }
    return (z[1] - z[0]) * (x[2] - x[0]) - (x[1] - x[0]) * (z[2] - z[0]);
}

/* Visits the triangles of a pattern; those that name a vertex twice are left out. */
typedef void (*mip_visit)(void *user, uint32_t quads, const uint32_t triangle[3]);

static void mip_triangles(const uint16_t *indices, uint32_t quads, int form, uint32_t pattern,
                          mip_visit visit, void *user)
{
    terrimp_pattern p;
    uint32_t k, step = form == TERRIMP_FORM_STRIP ? 1u : 3u, count = 0;
    CHECK(terrimp_pattern_find(quads, form, pattern, &p) == TERRIMP_OK);
    for (k = 0; k + 3u <= p.index_count; k += step) {
        const uint16_t *t = indices + p.first_index + k;
        uint32_t flip = form == TERRIMP_FORM_STRIP ? k & 1u : 0, v[3];
        v[0] = t[flip];
        v[1] = t[1u - flip];
        v[2] = t[2];
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
            continue;
        count += mip_area2(quads, v) != 0;
        if (visit)
            visit(user, quads, v);
    }
    CHECK(count == p.triangle_count);
}

static uint16_t *mip_filled(uint32_t quads, int form)
{
    uint32_t count = terrimp_pattern_index_count(quads, form);
    uint16_t *indices = (uint16_t *)malloc(count * sizeof *indices);
    CHECK(terrimp_pattern_fill(quads, form, indices, count) == TERRIMP_OK);
    return indices;
}

/* What a square is covered with: for each quad its four parts (between the middle and a side) and
   directed edges of the triangles. */
typedef struct mip_cover {
    uint8_t parts[64 * 64][4];
    int32_t area2;
    uint8_t used[65 * 65];
} mip_cover;

static void mip_cover_triangle(void *user, uint32_t quads, const uint32_t v[3])
{
    mip_cover *cover = (mip_cover *)user;
    int32_t row = (int32_t)quads + 1, x[3], z[3], k, i, j, part;
    int32_t low_x, high_x, low_z, high_z;
    CHECK(mip_area2(quads, v) >= 0);
    cover->area2 += mip_area2(quads, v);
    for (k = 0; k < 3; k++) {
        x[k] = (int32_t)v[k] % row * 8;
        z[k] = (int32_t)v[k] / row * 8;
        cover->used[v[k]] = 1;
    }
    low_x = x[0] < x[1] ? x[0] : x[1], low_x = low_x < x[2] ? low_x : x[2];
    low_z = z[0] < z[1] ? z[0] : z[1], low_z = low_z < z[2] ? low_z : z[2];
    high_x = x[0] > x[1] ? x[0] : x[1], high_x = high_x > x[2] ? high_x : x[2];
    high_z = z[0] > z[1] ? z[0] : z[1], high_z = high_z > z[2] ? high_z : z[2];
    for (j = low_z / 8; j < high_z / 8; j++)
        for (i = low_x / 8; i < high_x / 8; i++)
            for (part = 0; part < 4; part++) { /* a point off every edge that can occur */
                static const int32_t at_x[4] = {3, 5, 1, 7}, at_z[4] = {1, 7, 4, 4};
                int32_t px = i * 8 + at_x[part], pz = j * 8 + at_z[part], inside = 1;
                for (k = 0; k < 3; k++) {
                    int32_t n = (k + 1) % 3;
                    inside &= (z[n] - z[k]) * (px - x[k]) - (x[n] - x[k]) * (pz - z[k]) > 0;
                }
                cover->parts[j * (int32_t)quads + i][part] += (uint8_t)inside;
            }
}

static void every_pattern_covers_its_square_once(void)
{
    mip_cover *cover = (mip_cover *)malloc(sizeof *cover);
    uint32_t k, pattern, i, part;
    int form;
    for (form = 0; form < (int)TERRIMP_FORM_COUNT; form++)
        for (k = 0; k < sizeof mip_quads / sizeof mip_quads[0]; k++) {
            uint32_t quads = mip_quads[k];
            uint16_t *indices = mip_filled(quads, form);
            for (pattern = 0; pattern < TERRIMP_PATTERN_COUNT; pattern++) {
                memset(cover, 0, sizeof *cover);
                mip_triangles(indices, quads, form, pattern, mip_cover_triangle, cover);
                CHECK(cover->area2 == (int32_t)(2u * quads * quads));
                for (i = 0; i < quads * quads; i++)
                    for (part = 0; part < 4u; part++)
                        CHECK(cover->parts[i][part] == 1);
                for (i = 0; i < (quads + 1u) * (quads + 1u); i++) {
                    uint32_t x = i % (quads + 1u), z = i / (quads + 1u);
                    uint32_t out = ((pattern & 1u) && z == 0) || ((pattern & 2u) && z == quads)
                                       ? x & 1u : 0;
                    if (((pattern & 4u) && x == 0) || ((pattern & 8u) && x == quads))
                        out |= z & 1u;
                    CHECK(cover->used[i] == !out);
                }
            }
            free(indices);
        }
    free(cover);
}

/* Counts the edges along the borders: count[side][length - 1][i], of those that begin at the i-th
   vertex of the side; an edge in the other direction takes one away. */
typedef struct mip_edges {
    int count[TERRIMP_SIDE_COUNT][2][65];
} mip_edges;

static void mip_note_edge(mip_edges *edges, int side, uint32_t from, uint32_t to)
{
    uint32_t low = from < to ? from : to, length = from < to ? to - from : from - to;
    int fits = length == 1u || length == 2u;
    CHECK(fits);
    if (fits)
        edges->count[side][length - 1u][low] += from < to ? 1 : -1;
}

static void mip_border_edges(void *user, uint32_t quads, const uint32_t v[3])
{
    mip_edges *edges = (mip_edges *)user;
    uint32_t k, row = quads + 1u;
    for (k = 0; k < 3u; k++) {
        uint32_t a = v[k], b = v[(k + 1u) % 3u];
        if (a < row && b < row)
            mip_note_edge(edges, TERRIMP_SIDE_Z0, b, a);
        if (a / row == quads && b / row == quads)
            mip_note_edge(edges, TERRIMP_SIDE_Z1, a % row, b % row);
        if (a % row == 0 && b % row == 0)
            mip_note_edge(edges, TERRIMP_SIDE_X0, a / row, b / row);
        if (a % row == quads && b % row == quads)
            mip_note_edge(edges, TERRIMP_SIDE_X1, b / row, a / row);
    }
}

static void patterns_share_every_border_vertex_with_neighbours_of_both_levels(void)
{
    mip_edges edges;
    uint32_t k, pattern, side, i;
    int form;
    for (form = 0; form < (int)TERRIMP_FORM_COUNT; form++)
        for (k = 0; k < sizeof mip_quads / sizeof mip_quads[0]; k++) {
            uint32_t quads = mip_quads[k];
            uint16_t *indices = mip_filled(quads, form);
            for (pattern = 0; pattern < TERRIMP_PATTERN_COUNT; pattern++) {
                memset(&edges, 0, sizeof edges);
                mip_triangles(indices, quads, form, pattern, mip_border_edges, &edges);
                for (side = 0; side < (uint32_t)TERRIMP_SIDE_COUNT; side++) {
                    uint32_t step = 1u + (pattern >> side & 1u); /* of the neighbour's vertices */
                    for (i = 0; i < quads; i++) {
                        CHECK(edges.count[side][0][i] == (step == 1u));
                        CHECK(edges.count[side][1][i] == (step == 2u && i % 2u == 0));
                    }
                }
            }
            free(indices);
        }
}

/* Vertices that a FIFO cache has to transform for each triangle. */
static float mip_acmr(const uint16_t *indices, uint32_t count, uint32_t triangles, uint32_t entries)
{
    static uint32_t loaded[130 * 130];
    uint32_t k, misses = 0;
    memset(loaded, 0, sizeof loaded);
    for (k = 0; k < count; k++)
        if (loaded[indices[k]] == 0 || misses + 1u - loaded[indices[k]] > entries) {
            misses++;
            loaded[indices[k]] = misses + 0u;
        }
    return (float)misses / (float)triangles;
}

static void vertex_caches_of_16_and_32_are_used_well(void)
{
    static const char *const names[] = {"list", "strip"};
    static const uint32_t sizes[] = {16, 64};
    uint32_t k, entries, pattern;
    int form;
    for (form = 0; form < (int)TERRIMP_FORM_COUNT; form++)
        for (k = 0; k < 2u; k++) {
            uint16_t *indices = mip_filled(sizes[k], form);
            for (entries = 16; entries <= 32u; entries += 16u) {
                float worst = 0.0f, plain = 0.0f;
                for (pattern = 0; pattern < TERRIMP_PATTERN_COUNT; pattern++) {
                    terrimp_pattern p;
                    float acmr;
                    terrimp_pattern_find(sizes[k], form, pattern, &p);
                    acmr = mip_acmr(indices + p.first_index, p.index_count, p.triangle_count,
                                    entries);
                    if (pattern == 0)
                        plain = acmr;
                    worst = acmr > worst ? acmr : worst;
                }
                printf("ACMR of %u quads, %s, FIFO of %u: %.4f, worst pattern %.4f\n", sizes[k],
                       names[form], entries, (double)plain, (double)worst);
                CHECK(plain <= (sizes[k] == 16 ? 0.60f : 0.55f));
                CHECK(worst <= (sizes[k] == 16 ? 0.63f : 0.57f));
            }
            free(indices);
        }
}

static void patterns_refuse_bad_sizes(void)
{
    static const uint32_t bad[] = {0, 1, 2, 3, 5, 63, 65, 130, 0xffffffffu};
    terrimp_pattern p;
    uint16_t few[8];
    uint32_t k;
    for (k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        CHECK(terrimp_pattern_find(bad[k], 0, 0, &p) == TERRIMP_E_RANGE);
        CHECK(terrimp_pattern_index_count(bad[k], 0) == 0);
        CHECK(terrimp_pattern_fill(bad[k], 0, few, 8) == TERRIMP_E_RANGE);
    }
    CHECK(terrimp_pattern_find(64, 0, 16, &p) == TERRIMP_E_RANGE);
    CHECK(terrimp_pattern_find(64, -1, 0, &p) == TERRIMP_E_RANGE);
    CHECK(terrimp_pattern_find(64, TERRIMP_FORM_COUNT, 0, &p) == TERRIMP_E_RANGE);
    CHECK(terrimp_pattern_find(64, 0, 0, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_pattern_fill(64, 0, NULL, 8) == TERRIMP_E_NULL);
    CHECK(terrimp_pattern_fill(64, 0, few, 8) == TERRIMP_E_CAPACITY);
}

/* ---- errors ---- */

/* A random terrain with its tree, and a view of it. */
typedef struct mip_scene {
    float *heights, *scratch;
    terrimp_quadtree tree;
    terrimp_geomip_view view;
} mip_scene;

static float mip_hills(uint32_t x, uint32_t z, float phase)
{
    float u = (float)x, v = (float)z;
    return 20.0f * sinf(u * 0.037f + phase) * sinf(v * 0.051f) + 4.0f * sinf(u * 0.31f + v * 0.2f) +
           random_float(-1.0f, 1.0f);
}

static void mip_make(mip_scene *s, uint32_t width, uint32_t depth, uint32_t quads)
{
    terrimp_heightfield field;
    uint32_t x, z;
    float phase = random_float(0.0f, 6.0f);
    memset(&field, 0, sizeof field);
    memset(s, 0, sizeof *s);
    s->heights = (float *)malloc((size_t)width * depth * sizeof *s->heights);
    for (z = 0; z < depth; z++)
        for (x = 0; x < width; x++)
            s->heights[z * width + x] = mip_hills(x, z, phase);
    field.samples = s->heights;
    field.width = width;
    field.depth = depth;
    field.spacing_x = 1.5f;
    field.spacing_z = 1.25f;
    field.origin_x = -31.0f;
    CHECK(terrimp_quadtree_init(&field, quads, &s->tree) == TERRIMP_OK);
    s->tree.nodes = (terrimp_geomip_node *)malloc(s->tree.node_count * sizeof *s->tree.nodes);
    s->scratch = (float *)malloc((width + 2u * quads + 2u) * sizeof(float));
    CHECK(terrimp_geomip_build(&s->tree, s->scratch) == TERRIMP_OK);
    s->view.distances = (float *)malloc(s->tree.node_count * sizeof(float));
    s->view.marks = (terrimp_geomip_mark *)calloc(s->tree.node_count, sizeof *s->view.marks);
    s->view.draw_capacity = s->tree.level_first[1];
    s->view.draws =
        (terrimp_geomip_draw *)malloc(s->view.draw_capacity * sizeof *s->view.draws);
}

static void mip_free(mip_scene *s)
{
    free(s->heights);
    free(s->scratch);
    free(s->tree.nodes);
    free(s->view.distances);
    free(s->view.marks);
    free(s->view.draws);
}

static float mip_sample(const mip_scene *s, uint32_t x, uint32_t z)
{
    return s->heights[z * s->tree.field.width + x];
}

/* Column and row of a node's vertex. */
static void mip_vertex(const mip_scene *s, const terrimp_geomip_draw *draw, uint32_t i, uint32_t j,
                       uint32_t at[2])
{
    uint64_t x = ((uint64_t)draw->node.x * s->tree.chunk_quads + i) << draw->node.level;
    uint64_t z = ((uint64_t)draw->node.z * s->tree.chunk_quads + j) << draw->node.level;
    at[0] = x < s->tree.field.width ? (uint32_t)x : s->tree.field.width - 1u;
    at[1] = z < s->tree.field.depth ? (uint32_t)z : s->tree.field.depth - 1u;
}

/* Calls `sample` for each sample under each triangle of a draw, with the height drawn there. */
typedef struct mip_drawn {
    const mip_scene *scene;
    const terrimp_geomip_draw *draw;
    const float *heights; /* of the vertices */
    uint32_t border;      /* bit i: only triangles between side i and the row next to it */
    void (*sample)(struct mip_drawn *drawn, uint32_t x, uint32_t z, float height);
    const terrimp_camera *camera;
    float matrix[16], worst;
    float *surface; /* [depth][width] */
    uint32_t seen;
} mip_drawn;

static void mip_draw_triangle(void *user, uint32_t quads, const uint32_t v[3])
{
    mip_drawn *d = (mip_drawn *)user;
    uint32_t at[3][2], k, low_x = 0xffffffffu, low_z = low_x, high_x = 0, high_z = 0, x, z;
    float h[3];
    for (k = 0; k < 3u; k++) {
        uint32_t i = v[k] % (quads + 1u), j = v[k] / (quads + 1u);
        if (((d->border & 1u) && j > 1u) || ((d->border & 2u) && j + 1u < quads) ||
            ((d->border & 4u) && i > 1u) || ((d->border & 8u) && i + 1u < quads))
            return;
        mip_vertex(d->scene, d->draw, i, j, at[k]);
        h[k] = d->heights[v[k]];
        low_x = at[k][0] < low_x ? at[k][0] : low_x;
        low_z = at[k][1] < low_z ? at[k][1] : low_z;
        high_x = at[k][0] > high_x ? at[k][0] : high_x;
        high_z = at[k][1] > high_z ? at[k][1] : high_z;
    }
    for (z = low_z; z <= high_z; z++)
        for (x = low_x; x <= high_x; x++) {
            double part[3], all = 0.0;
            for (k = 0; k < 3u; k++) {
                const uint32_t *a = at[(k + 1u) % 3u], *b = at[(k + 2u) % 3u];
                part[k] = ((double)b[1] - a[1]) * ((double)x - a[0]) -
                          ((double)b[0] - a[0]) * ((double)z - a[1]);
                all += part[k];
            }
            if (all <= 0.0 || part[0] < 0.0 || part[1] < 0.0 || part[2] < 0.0)
                continue;
            d->sample(d, x, z, (float)((part[0] * (double)h[0] + part[1] * (double)h[1] +
                                        part[2] * (double)h[2]) / all));
        }
}

static void mip_miss(mip_drawn *d, uint32_t x, uint32_t z, float height)
{
    float miss = fabsf(mip_sample(d->scene, x, z) - height);
    d->worst = miss > d->worst ? miss : d->worst;
    d->seen++;
}

static terrimp_geomip_draw mip_draw_of(const terrimp_quadtree *tree, uint32_t node)
{
    terrimp_geomip_draw draw;
    memset(&draw, 0, sizeof draw);
    draw.node.number = node;
    while (node >= tree->level_first[draw.node.level + 1u])
        draw.node.level++;
    draw.node.x = (node - tree->level_first[draw.node.level]) % tree->level_x[draw.node.level];
    draw.node.z = (node - tree->level_first[draw.node.level]) / tree->level_x[draw.node.level];
    return draw;
}

/* Heights that a draw's vertices stand at. */
static void mip_heights(const mip_scene *s, const terrimp_geomip_draw *draw, float *heights)
{
    static terrimp_geomip_vertex vertices[65 * 65];
    CHECK(terrimp_geomip_fill_vertices(&s->tree, draw->node.number, NULL, vertices) == TERRIMP_OK);
    CHECK(terrimp_geomip_morph(s->tree.chunk_quads, draw, vertices, heights, 1) == TERRIMP_OK);
}

/* The largest miss of a node's triangles in a pattern, or of those along some borders. */
static float mip_largest_miss(const mip_scene *s, uint32_t node, uint32_t pattern, uint32_t border,
                              const uint16_t *indices)
{
    static float heights[65 * 65];
    terrimp_geomip_draw draw = mip_draw_of(&s->tree, node);
    mip_drawn d;
    memset(&d, 0, sizeof d);
    d.scene = s;
    d.draw = &draw;
    d.heights = heights;
    d.border = border;
    d.sample = mip_miss;
    mip_heights(s, &draw, heights);
    mip_triangles(indices, s->tree.chunk_quads, TERRIMP_FORM_LIST, pattern, mip_draw_triangle, &d);
    return d.worst;
}

/* The largest miss of what finer neighbours draw up to a side. */
static float mip_miss_beyond(const mip_scene *s, const terrimp_geomip_draw *draw, uint32_t side,
                             const uint16_t *indices)
{
    const terrimp_quadtree *t = &s->tree;
    uint32_t along, fine = draw->node.level - 1u;
    float worst = 0.0f, miss;
    for (along = 0; along < 2u; along++) {
        uint32_t x = draw->node.x * 2u, z = draw->node.z * 2u;
        x += side == TERRIMP_SIDE_X0 ? (uint32_t)-1 : side == TERRIMP_SIDE_X1 ? 2u : along;
        z += side == TERRIMP_SIDE_Z0 ? (uint32_t)-1 : side == TERRIMP_SIDE_Z1 ? 2u : along;
        if (x >= t->level_x[fine] || z >= t->level_z[fine])
            continue;
        miss = mip_largest_miss(s, t->level_first[fine] + z * t->level_x[fine] + x,
                                1u << (side ^ 1u), 1u << (side ^ 1u), indices);
        worst = miss > worst ? miss : worst;
    }
    return worst;
}

/* Largest error of the children; each is at most the parent's, and lies in its range of heights. */
static float mip_error_of_children(const mip_scene *s, const terrimp_geomip_draw *draw)
{
    const terrimp_quadtree *t = &s->tree;
    const terrimp_geomip_node *parent = &t->nodes[draw->node.number];
    uint32_t k, fine = draw->node.level - 1u;
    float worst = 0.0f;
    for (k = 0; k < 4u; k++) {
        uint32_t x = draw->node.x * 2u + (k & 1u), z = draw->node.z * 2u + (k >> 1);
        const terrimp_geomip_node *child =
            &t->nodes[t->level_first[fine] + z * t->level_x[fine] + x];
        if (x >= t->level_x[fine] || z >= t->level_z[fine])
            continue;
        CHECK(parent->error >= child->error);
        CHECK(parent->low <= child->low && parent->high >= child->high);
        worst = child->error > worst ? child->error : worst;
    }
    return worst;
}

static void mip_check_errors(const mip_scene *s, const uint16_t *indices)
{
    uint32_t node, side;
    for (node = s->tree.level_first[1]; node < s->tree.node_count; node++) {
        terrimp_geomip_draw draw = mip_draw_of(&s->tree, node);
        float found = s->tree.nodes[node].error, miss, worst = mip_error_of_children(s, &draw);
        miss = mip_largest_miss(s, node, 0, 0, indices);
        worst = miss > worst ? miss : worst;
        for (side = 0; side < (uint32_t)TERRIMP_SIDE_COUNT; side++) {
            miss = mip_miss_beyond(s, &draw, side, indices);
            worst = miss > worst ? miss : worst;
        }
        CHECK(fabsf(found - worst) <= 1e-5f * (1.0f + worst));
        CHECK(s->tree.nodes[node].rms <= found && s->tree.nodes[node].rms >= 0.0f);
    }
}

static void a_node_knows_its_largest_error_and_that_of_finer_neighbours_beside_it(void)
{
    static const uint32_t sizes[][3] = {{65, 65, 8},    {70, 51, 8}, {33, 129, 4},
                                        {100, 90, 16}, {2, 9, 4},   {70, 51, 4}};
    uint32_t k, i;
    for (k = 0; k < 6u; k++) {
        const uint32_t *size = sizes[k];
        mip_scene s;
        uint16_t *indices = mip_filled(size[2], TERRIMP_FORM_LIST);
        mip_make(&s, size[0], size[1], size[2]);
        if (k == 5u) { /* noise: some children are worse than their parents */
            for (i = 0; i < size[0] * size[1]; i++)
                s.heights[i] = random_float(0.0f, 1.0f) * random_float(0.0f, 1.0f);
            CHECK(terrimp_geomip_build(&s.tree, s.scratch) == TERRIMP_OK);
        }
        mip_check_errors(&s, indices);
        mip_free(&s);
        free(indices);
    }
}

/* ---- selection ---- */

static void mip_random_camera(const mip_scene *s, terrimp_camera *camera)
{
    const terrimp_heightfield *f = &s->tree.field;
    float wide = (float)f->width * f->spacing_x, deep = (float)f->depth * f->spacing_z;
    memset(camera, 0, sizeof *camera);
    camera->eye[0] = f->origin_x + random_float(-0.3f, 1.3f) * wide;
    camera->eye[1] = random_range(0, 2) ? random_float(0.0f, 60.0f) : random_float(-300.0f, 900.0f);
    camera->eye[2] = f->origin_z + random_float(-0.3f, 1.3f) * deep;
    camera->forward[0] = random_float(-1.0f, 1.0f);
    camera->forward[1] = random_range(0, 3) ? random_float(-0.7f, 0.3f) : random_float(-9.0f, 9.0f);
    camera->forward[2] = random_float(-1.0f, 1.0f);
    if (random_range(0, 2) == 0) {
        camera->up[0] = random_float(-1.0f, 1.0f);
        camera->up[1] = random_float(-1.0f, 1.0f);
        camera->up[2] = random_float(-1.0f, 1.0f);
    }
    camera->fov_y_rad = random_float(0.3f, 2.0f);
    camera->width_px = random_range(200, 2000);
    camera->height_px = random_range(200, 2000);
    camera->z_near = random_float(0.1f, 3.0f);
    camera->z_far = 5000.0f;
}

/* The same, but orthographic, off-centre, or the middle of eyes that are some way apart. */
static void mip_any_camera(const mip_scene *s, terrimp_camera *camera)
{
    mip_random_camera(s, camera);
    camera_become(camera, (int)random_range(0, CAMERA_KINDS - 1), 200.0f, 100.0f);
}

static void mip_random_settings(mip_scene *s)
{
    s->view.rule = (int)random_range(0, TERRIMP_GEOMIP_RULE_COUNT - 1);
    s->view.tolerance_px = random_float(0.0f, 1.0f) < 0.5f ? random_float(0.2f, 3.0f)
                                                           : random_float(1.0f, 60.0f);
    s->view.morph_ratio = random_range(0, 1) ? 0.0f : random_float(1.0f, 2.5f);
    s->view.hysteresis = random_range(0, 1) ? 0.0f : random_float(0.0f, 0.5f);
}

/* Level that each finest chunk is drawn at; 255 where it is not. */
static uint8_t *mip_levels(const mip_scene *s)
{
    const terrimp_quadtree *t = &s->tree;
    uint8_t *levels = (uint8_t *)malloc(t->level_first[1]);
    uint32_t k, x, z;
    memset(levels, 255, t->level_first[1]);
    for (k = 0; k < s->view.draw_count; k++) {
        const terrimp_node *n = &s->view.draws[k].node;
        uint32_t end_x = (n->x + 1u) << n->level, end_z = (n->z + 1u) << n->level;
        CHECK(n->number == t->level_first[n->level] + n->z * t->level_x[n->level] + n->x);
        for (z = n->z << n->level; z < end_z && z < t->level_z[0]; z++)
            for (x = n->x << n->level; x < end_x && x < t->level_x[0]; x++) {
                CHECK(levels[z * t->level_x[0] + x] == 255); /* nothing is drawn twice */
                levels[z * t->level_x[0] + x] = (uint8_t)n->level;
            }
    }
    return levels;
}

/* Checks levels and patterns along one border of a draw. */
static void mip_check_border(const mip_scene *s, const uint8_t *levels,
                             const terrimp_geomip_draw *d, int side)
{
    const terrimp_quadtree *t = &s->tree;
    uint32_t along, count = 1u << d->node.level, coarse = d->pattern >> side & 1u;
    for (along = 0; along < count; along++) {
        uint32_t x = d->node.x << d->node.level, z = d->node.z << d->node.level;
        uint8_t level;
        x += side == TERRIMP_SIDE_X0 ? (uint32_t)-1 : side == TERRIMP_SIDE_X1 ? count : along;
        z += side == TERRIMP_SIDE_Z0 ? (uint32_t)-1 : side == TERRIMP_SIDE_Z1 ? count : along;
        if (x >= t->level_x[0] || z >= t->level_z[0]) {
            if (along == 0)
                CHECK(!coarse);
            continue;
        }
        level = levels[z * t->level_x[0] + x];
        if (level == 255)
            continue;
        CHECK(level <= d->node.level + 1u && level + 1u >= d->node.level);
        CHECK(coarse == (level > d->node.level));
    }
}

static void selections_tile_the_view_and_neighbours_fit(void)
{
    static const uint32_t sizes[][3] = {
        {513, 513, 8}, {300, 457, 8}, {1025, 257, 16}, {90, 80, 4}, {2, 2, 8}};
    uint32_t k, frame, i;
    int side;
    for (k = 0; k < 5u; k++) {
        mip_scene s;
        mip_make(&s, sizes[k][0], sizes[k][1], sizes[k][2]);
        for (frame = 0; frame < 60u; frame++) {
            terrimp_camera camera;
            terrimp_frustum frustum;
            uint8_t *levels;
            uint32_t triangles = 0;
            mip_random_settings(&s);
            if (frame % 2u)
                mip_any_camera(&s, &camera);
            else
                mip_random_camera(&s, &camera);
            CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_OK);
            CHECK(s.view.draws_needed == s.view.draw_count);
            levels = mip_levels(&s);
            terrimp_camera_frustum(&camera, &frustum);
            for (i = 0; i < s.tree.level_first[1]; i++) {
                terrimp_box box;
                terrimp_geomip_box(&s.tree, i, &box);
                if (terrimp_frustum_test(&frustum, &box, TERRIMP_PLANES_ALL) >= 0)
                    CHECK(levels[i] != 255);
            }
            for (i = 0; i < s.view.draw_count; i++) {
                terrimp_pattern p = {0, 0, 0};
                for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++)
                    mip_check_border(&s, levels, &s.view.draws[i], side);
                terrimp_pattern_find(s.tree.chunk_quads, 0, s.view.draws[i].pattern, &p);
                triangles += p.triangle_count;
                CHECK(s.view.draws[i].error_px <= s.view.tolerance_px);
            }
            CHECK(triangles == s.view.triangle_count);
            free(levels);
        }
        mip_free(&s);
    }
}

/* Pixels between a sample in view and where it is drawn. */
static void mip_miss_on_screen(mip_drawn *d, uint32_t x, uint32_t z, float height)
{
    const terrimp_heightfield *f = &d->scene->tree.field;
    double p[2][2], w = 0.0;
    int k, r;
    for (k = 0; k < 2; k++) {
        double at[3], clip[4];
        at[0] = (double)f->origin_x + (double)x * (double)f->spacing_x;
        at[1] = k ? (double)height : (double)mip_sample(d->scene, x, z);
        at[2] = (double)f->origin_z + (double)z * (double)f->spacing_z;
        for (r = 0; r < 4; r++)
            clip[r] = (double)d->matrix[r] * at[0] + (double)d->matrix[4 + r] * at[1] +
                      (double)d->matrix[8 + r] * at[2] + (double)d->matrix[12 + r];
        w = clip[3];
        if (k == 0 && (clip[2] < -w || fabs(clip[0]) > w || fabs(clip[1]) > w))
            return; /* not in view */
        p[k][0] = clip[0] / w * 0.5 * (double)d->camera->width_px;
        p[k][1] = clip[1] / w * 0.5 * (double)d->camera->height_px;
        if (k && w <= 0.0) {
            d->worst = 1e9f;
            return;
        }
    }
    w = sqrt((p[0][0] - p[1][0]) * (p[0][0] - p[1][0]) + (p[0][1] - p[1][1]) * (p[0][1] - p[1][1]));
    d->worst = (float)w > d->worst ? (float)w : d->worst;
    d->seen++;
}

static void mip_multiply(const float a[16], const float b[16], float out[16])
{
    int c, r, k;
    for (c = 0; c < 4; c++)
        for (r = 0; r < 4; r++) {
            out[c * 4 + r] = 0.0f;
            for (k = 0; k < 4; k++)
                out[c * 4 + r] += a[k * 4 + r] * b[c * 4 + k];
        }
}

/* The largest error on the screen of what a view has selected; *closest: largest share of the bound
   that was used up. */
static void mip_measure_screen(mip_scene *s, const terrimp_camera *camera, const uint16_t *indices,
                               float *worst, float *share)
{
    static float heights[65 * 65];
    float view[16], projection[16];
    uint32_t i;
    terrimp_camera_matrices(camera, view, projection);
    *worst = *share = 0.0f;
    for (i = 0; i < s->view.draw_count; i++) {
        const terrimp_geomip_draw *draw = &s->view.draws[i];
        mip_drawn d;
        memset(&d, 0, sizeof d);
        mip_multiply(projection, view, d.matrix);
        d.scene = s;
        d.draw = draw;
        d.camera = camera;
        d.heights = heights;
        d.sample = mip_miss_on_screen;
        mip_heights(s, draw, heights);
        mip_triangles(indices, s->tree.chunk_quads, TERRIMP_FORM_LIST, draw->pattern,
                      mip_draw_triangle, &d);
        *worst = d.worst > *worst ? d.worst : *worst;
        if (draw->node.level > 0 && draw->pattern == 0 && draw->morph == 0.0f && d.worst > 0.01f &&
            camera->reach == 0.0f) {
            CHECK(d.worst <= draw->error_px * 1.001f + 0.01f);
            *share = d.worst / draw->error_px > *share ? d.worst / draw->error_px : *share;
        }
    }
}

/* Moves a camera's eye by less than its reach; what is predicted for all eyes within reach is no
   less for any node that both draw than what is predicted for that eye alone. */
static void mip_move_within_reach(mip_scene *s, terrimp_camera *camera)
{
    float *alone = (float *)calloc(s->tree.node_count, sizeof *alone), apart[3];
    terrimp_camera moved = *camera;
    uint32_t i;
    random_vector(0.0f, camera->reach, apart);
    for (i = 0; i < 3u; i++)
        moved.eye[i] += 0.999f * apart[i];
    moved.reach = 0.0f;
    CHECK(terrimp_geomip_select(&s->tree, &s->view, &moved) == TERRIMP_OK);
    for (i = 0; i < s->view.draw_count; i++)
        alone[s->view.draws[i].node.number] = s->view.draws[i].error_px;
    CHECK(terrimp_geomip_select(&s->tree, &s->view, camera) == TERRIMP_OK);
    for (i = 0; i < s->view.draw_count; i++)
        CHECK(s->view.draws[i].error_px >= 0.9999f * alone[s->view.draws[i].node.number]);
    memcpy(camera->eye, moved.eye, sizeof moved.eye);
    free(alone);
}

/* The node of a position holds it; beside the field there is none. */
static void the_node_of_a_position_holds_it(void)
{
    mip_scene s;
    int i;
    mip_make(&s, 193, 161, 8);
    for (i = 0; i < 3000; i++) {
        const terrimp_heightfield *f = &s.tree.field;
        uint32_t level = random_range(0, s.tree.level_count - 1u);
        float end_x = f->origin_x + (float)(f->width - 1u) * f->spacing_x;
        float end_z = f->origin_z + (float)(f->depth - 1u) * f->spacing_z;
        float x = random_range(0, 9) ? random_float(f->origin_x, end_x) : end_x;
        float z = random_range(0, 9) ? random_float(f->origin_z, end_z) : end_z;
        terrimp_node node = {0, 0, 0, 0};
        terrimp_box box;
        CHECK(terrimp_quadtree_find(&s.tree, level, x, z, &node) == TERRIMP_OK);
        CHECK(node.level == level && node.number == s.tree.level_first[level] +
                                                        node.z * s.tree.level_x[level] + node.x);
        CHECK(terrimp_geomip_box(&s.tree, node.number, &box) == TERRIMP_OK);
        CHECK(x >= box.min[0] && x <= box.max[0] && z >= box.min[2] && z <= box.max[2]);
        CHECK(terrimp_quadtree_find(&s.tree, level, end_x + 1.0f, z, &node) == TERRIMP_E_MISS);
        CHECK(terrimp_quadtree_find(&s.tree, s.tree.level_count, x, z, &node) == TERRIMP_E_RANGE);
    }
    mip_free(&s);
}

static void no_sample_in_view_is_further_off_than_predicted(void)
{
    uint32_t frame, close = 0;
    mip_scene s;
    uint16_t *indices = mip_filled(8, TERRIMP_FORM_LIST);
    mip_make(&s, 193, 161, 8);
    for (frame = 0; frame < check_rounds(240, 400); frame++) {
        terrimp_camera camera;
        float worst, share;
        mip_random_settings(&s);
        if (frame % 2u)
            mip_any_camera(&s, &camera);
        else
            mip_random_camera(&s, &camera);
        s.view.rule = frame % 3u ? TERRIMP_GEOMIP_BOUND : TERRIMP_GEOMIP_DISTANCE;
        s.view.morph_ratio = 0.0f;
        mip_move_within_reach(&s, &camera);
        mip_measure_screen(&s, &camera, indices, &worst, &share);
        CHECK(worst <= s.view.tolerance_px * 1.001f + 0.01f);
        close += share > 0.5f;
    }
    mip_free(&s);
    free(indices);
    CHECK(close > 5u); /* the bound is worth something */
}

/* The real tile, voids levelled with the sample before them; 0 when there is no file. */
static int mip_load_tile(mip_scene *s, uint32_t quads)
{
    enum { SIDE = 1201 };
    const char *folder = getenv("TERRIMP_DATA");
    char path[1024];
    unsigned char *raw = (unsigned char *)malloc(2u * SIDE * SIDE);
    FILE *file;
    int all;
    uint32_t i;
    snprintf(path, sizeof path, "%s/N42E001.hgt", folder ? folder : "../shared/data");
    file = fopen(path, "rb");
    all = file && fread(raw, 2, (size_t)SIDE * SIDE, file) == (size_t)SIDE * SIDE;
    if (file)
        fclose(file);
    if (all) {
        mip_make(s, SIDE, SIDE, quads);
        for (i = 0; i < (uint32_t)SIDE * SIDE; i++) {
            int32_t height = raw[2u * i] * 256 + raw[2u * i + 1u];
            height -= height >= 32768 ? 65536 : 0;
            s->heights[i] = height == -32768 ? i ? s->heights[i - 1u] : 0.0f : (float)height;
        }
        s->tree.field.spacing_x = 68.0f; /* metres at 42.5 degrees north */
        s->tree.field.spacing_z = 92.6f;
        s->tree.field.origin_x = 0.0f;
        CHECK(terrimp_geomip_build(&s->tree, s->scratch) == TERRIMP_OK);
    }
    free(raw);
    return all;
}

/* TERRIMP_LONG=1: a proof of some minutes, over every sample in view of 1000 poses. */
static void a_real_tile_keeps_within_a_pixel(void)
{
    mip_scene s;
    uint16_t *indices;
    uint32_t pose, poses = 1000;
    float worst = 0.0f;
    double mean = 0.0;
    if (!getenv("TERRIMP_LONG") || !mip_load_tile(&s, 32)) {
        SKIP("TERRIMP_LONG is not set, or there is no N42E001.hgt");
        return;
    }
    indices = mip_filled(32, TERRIMP_FORM_LIST);
    s.view.rule = TERRIMP_GEOMIP_BOUND;
    for (pose = 0; pose < poses; pose++) {
        terrimp_camera camera;
        float height = 0.0f, found, share;
        memset(&camera, 0, sizeof camera);
        camera.eye[0] = random_float(0.0f, 1200.0f * 68.0f);
        camera.eye[2] = random_float(0.0f, 1200.0f * 92.6f);
        terrimp_heightfield_height(&s.tree.field, camera.eye[0], camera.eye[2], &height);
        camera.eye[1] = height + powf(10.0f, random_float(0.5f, 4.0f));
        camera.forward[0] = random_float(-1.0f, 1.0f);
        camera.forward[1] = random_float(-0.8f, 0.2f);
        camera.forward[2] = random_float(-1.0f, 1.0f);
        camera.fov_y_rad = 1.0471976f;
        camera.width_px = 1280;
        camera.height_px = 1024;
        camera.z_near = 1.0f;
        camera.z_far = 200000.0f;
        CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_OK);
        mip_measure_screen(&s, &camera, indices, &found, &share);
        CHECK(found <= 1.0f);
        worst = found > worst ? found : worst;
        mean += (double)found / poses;
    }
    printf("  %u poses on N42E001 at 1 px: the worst sample is %.4f px off, %.3f a pose\n", poses,
           (double)worst, mean);
    mip_free(&s);
    free(indices);
}

/* Chunks that two frames draw at different levels. */
static uint32_t mip_changes(const mip_scene *s, const uint8_t *before, const uint8_t *after)
{
    uint32_t i, count = 0;
    for (i = 0; i < s->tree.level_first[1]; i++)
        count += before[i] != after[i] && before[i] != 255 && after[i] != 255;
    return count;
}

static void a_jittering_camera_does_not_flicker(void)
{
    mip_scene s;
    uint32_t place, frame, changes[2] = {0, 0}, steady; /* without hysteresis, and with it */
    mip_make(&s, 513, 513, 8);
    for (steady = 0; steady < 2u; steady++)
        for (place = 0; place < 60u; place++) {
            terrimp_camera still, camera;
            uint8_t *before = NULL;
            mip_random_camera(&s, &still);
            s.view.rule = (int)(place % TERRIMP_GEOMIP_RULE_COUNT);
            s.view.tolerance_px = random_float(0.5f, 4.0f);
            s.view.hysteresis = steady ? 0.1f : 0.0f;
            for (frame = 0; frame < 20u; frame++) {
                uint8_t *levels;
                camera = still;
                camera.eye[0] += frame % 2u ? 0.1f : -0.1f;
                camera.eye[1] += frame / 2u % 2u ? 0.1f : -0.1f;
                CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_OK);
                levels = mip_levels(&s);
                if (before && frame > 4u) /* it may settle in the first round */
                    changes[steady] += mip_changes(&s, before, levels);
                free(before);
                before = levels;
            }
            free(before);
        }
    CHECK(changes[1] == 0);
    mip_free(&s);
}

static void the_same_frame_is_selected_twice_alike(void)
{
    mip_scene s;
    terrimp_camera camera;
    terrimp_geomip_draw *first;
    uint32_t count, i;
    mip_make(&s, 257, 257, 8);
    s.view.morph_ratio = 1.5f;
    memset(&camera, 0, sizeof camera);
    camera.eye[1] = 40.0f;
    camera.forward[0] = camera.forward[2] = 1.0f;
    camera.width_px = camera.height_px = 500;
    camera.z_near = 1.0f;
    camera.z_far = 1000.0f;
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_OK);
    count = s.view.draw_count;
    first = (terrimp_geomip_draw *)malloc(count * sizeof *first);
    memcpy(first, s.view.draws, count * sizeof *first);
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_OK);
    CHECK(count == s.view.draw_count && memcmp(first, s.view.draws, count * sizeof *first) == 0);
    for (i = 1; i < count; i++) { /* an earlier node does not lie behind a later one */
        const terrimp_node *a = &s.view.draws[i - 1u].node, *b = &s.view.draws[i].node;
        uint32_t ax = (a->x + 1u) << a->level, az = (a->z + 1u) << a->level;
        CHECK(ax <= b->x << b->level || az <= b->z << b->level || a->level > b->level ||
              (b->x + 1u) << b->level > a->x << a->level);
    }
    free(first);
    mip_free(&s);
}

static void nodes_cost_few_bytes(void)
{
    size_t node = sizeof(terrimp_geomip_node) + sizeof(terrimp_geomip_mark) + sizeof(float);
    mip_scene s;
    mip_make(&s, 513, 513, 8);
    CHECK(s.tree.node_count * node <= 200u * s.tree.level_first[1]);
    CHECK(sizeof(terrimp_geomip_vertex) == 16u && sizeof(terrimp_geomip_weights) == 16u);
    mip_free(&s);
}

static void bad_geomip_input_is_refused(void)
{
    mip_scene s;
    terrimp_camera camera, good;
    terrimp_quadtree tree;
    terrimp_geomip_view kept;
    float xyz[3] = {0, 0, 0};
    mip_make(&s, 65, 65, 8);
    mip_random_camera(&s, &good);
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &good) == TERRIMP_OK);
    kept = s.view;
    camera = good;
    camera.eye[1] = sqrtf(-1.0f);
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_E_NOT_FINITE);
    camera = good;
    camera.forward[2] = (float)HUGE_VAL;
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_E_NOT_FINITE);
    camera.width_px = 0;
    camera.forward[2] = 1.0f;
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_E_RANGE);
    CHECK(memcmp(&kept, &s.view, sizeof kept) == 0);
    s.view.tolerance_px = sqrtf(-1.0f);
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &good) == TERRIMP_E_NOT_FINITE);
    s.view.tolerance_px = -1.0f;
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &good) == TERRIMP_E_RANGE);
    s.view.tolerance_px = 0.0f;
    s.view.rule = TERRIMP_GEOMIP_RULE_COUNT;
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &good) == TERRIMP_E_RANGE);
    s.view.rule = 0;
    s.view.hysteresis = 2.0f;
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &good) == TERRIMP_E_RANGE);
    s.view.hysteresis = 0.0f;
    s.view.morph_ratio = 0.5f;
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &good) == TERRIMP_E_RANGE);
    s.view.morph_ratio = 0.0f;
    s.view.draw_capacity = 0;
    camera = good; /* from above everything is in view */
    camera.eye[0] = camera.eye[2] = 40.0f;
    camera.eye[1] = 500.0f;
    camera.forward[0] = camera.forward[2] = 0.0f;
    camera.forward[1] = -1.0f;
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_E_CAPACITY);
    CHECK(s.view.draw_count == 0 && s.view.draws_needed > 0);
    s.view.draws = NULL;
    CHECK(terrimp_geomip_select(&s.tree, &s.view, &good) == TERRIMP_E_NULL);
    s.view.draws = kept.draws;
    CHECK(terrimp_geomip_select(NULL, &s.view, &good) == TERRIMP_E_NULL);
    CHECK(terrimp_geomip_select(&s.tree, NULL, &good) == TERRIMP_E_NULL);
    CHECK(terrimp_geomip_select(&s.tree, &s.view, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_quadtree_init(&s.tree.field, 7, &tree) == TERRIMP_E_RANGE);
    CHECK(terrimp_quadtree_init(&s.tree.field, 2, &tree) == TERRIMP_E_RANGE);
    CHECK(terrimp_quadtree_init(NULL, 8, &tree) == TERRIMP_E_NULL);
    CHECK(terrimp_quadtree_init(&s.tree.field, 8, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_quadtree_init(&s.tree.field, 8, &tree) == TERRIMP_OK && tree.nodes == NULL);
    CHECK(terrimp_geomip_build(&tree, s.scratch) == TERRIMP_E_NULL);
    CHECK(terrimp_geomip_fill_vertices(&s.tree, s.tree.node_count, xyz, NULL) == TERRIMP_E_RANGE);
    CHECK(terrimp_geomip_fill_vertices(&s.tree, 0, NULL, NULL) == TERRIMP_E_NULL);
    s.heights[70] = sqrtf(-1.0f);
    CHECK(terrimp_geomip_build(&s.tree, s.scratch) == TERRIMP_E_NOT_FINITE);
    mip_free(&s);
}

/* ---- morphing ---- */

static void mip_note_used(void *user, uint32_t quads, const uint32_t v[3])
{
    uint8_t *used = (uint8_t *)user;
    (void)quads;
    used[v[0]] = used[v[1]] = used[v[2]] = 1;
}

static void nodes_meet_exactly_at_any_fraction(void)
{
    static const uint32_t sizes[][3] = {{257, 257, 8}, {129, 129, 4}, {129, 129, 6}, {200, 143, 8}};
    static float heights[65 * 65];
    static uint8_t used[65 * 65];
    uint32_t k, frame, i, v, side, shared = 0, between = 0;
    for (k = 0; k < 8u; k++) {
        mip_scene s;
        const uint32_t *size = sizes[k / 2u];
        uint32_t quads = size[2];
        uint16_t *indices = mip_filled(quads, TERRIMP_FORM_LIST);
        float *met;
        mip_make(&s, size[0], size[1], quads);
        side = (quads << (s.tree.level_count - 1u)) + 1u;
        met = (float *)malloc(side * side * sizeof *met);
        for (frame = 0; frame < 25u; frame++) {
            terrimp_camera camera;
            mip_random_settings(&s);
            mip_random_camera(&s, &camera);
            s.view.morph_ratio = frame % 4u ? random_float(1.05f, 3.0f) : 1.0f;
            CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_OK);
            memset(met, 255, side * side * sizeof *met); /* NaN: nobody was here */
            for (i = 0; i < s.view.draw_count; i++) {
                const terrimp_geomip_draw *draw = &s.view.draws[i];
                mip_heights(&s, draw, heights);
                memset(used, 0, sizeof used);
                mip_triangles(indices, quads, TERRIMP_FORM_LIST, draw->pattern, mip_note_used,
                              used);
                between += draw->morph > 0.0f && draw->morph < 1.0f;
                for (v = 0; v < (quads + 1u) * (quads + 1u); v++) {
                    uint32_t x = (draw->node.x * quads + v % (quads + 1u)) << draw->node.level;
                    uint32_t z = (draw->node.z * quads + v / (quads + 1u)) << draw->node.level;
                    float *height = &met[z * side + x]; /* of the lattice, that has no far edge */
                    if (!used[v])
                        continue;
                    if (*height == *height) {
                        shared++;
                        CHECK(*height == heights[v]);
                    }
                    *height = heights[v];
                }
            }
        }
        free(met);
        mip_free(&s);
        free(indices);
    }
    CHECK(shared > 3000 && between > 300);
}

static void mip_store(mip_drawn *d, uint32_t x, uint32_t z, float height)
{
    d->surface[z * d->scene->tree.field.width + x] = height;
}

/* Children that have morphed wholly have the shape of their parent, its borders moving or not. */
static void children_begin_in_the_shape_of_their_parent(void)
{
    static float drawn[65 * 65], heights[65 * 65], of_parent[65 * 65];
    uint16_t *indices = mip_filled(8, TERRIMP_FORM_LIST);
    mip_scene s;
    uint32_t node, v;
    int side;
    mip_make(&s, 65, 65, 8);
    for (node = 0; node + 1u < s.tree.node_count; node++) {
        terrimp_geomip_draw child = mip_draw_of(&s.tree, node), parent;
        mip_drawn d;
        parent = mip_draw_of(&s.tree, terrimpi_tree_parent(&s.tree, &child.node).number);
        child.morph = 1.0f;
        for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++) {
            uint32_t at = side < 2 ? child.node.z : child.node.x;
            child.side[side] = 1.0f;
            parent.side[side] = random_float(0.0f, 1.0f);
            if ((at & 1u) == ((uint32_t)side & 1u)) /* an outer side: the parent's too */
                child.side_coarse[side] = parent.side[side];
        }
        memset(&d, 0, sizeof d);
        d.scene = &s;
        d.draw = &parent;
        d.heights = of_parent;
        d.sample = mip_store;
        d.surface = drawn;
        mip_heights(&s, &parent, of_parent);
        mip_triangles(indices, 8, TERRIMP_FORM_LIST, 0, mip_draw_triangle, &d);
        mip_heights(&s, &child, heights);
        for (v = 0; v < 81u; v++) {
            uint32_t at[2];
            mip_vertex(&s, &child, v % 9u, v / 9u, at);
            CHECK(fabsf(heights[v] - drawn[at[1] * 65u + at[0]]) < 1e-4f);
        }
    }
    mip_free(&s);
    free(indices);
}

static void nodes_have_ceased_to_morph_when_they_split(void)
{
    mip_scene s;
    uint32_t frame, node, split = 0;
    mip_make(&s, 257, 257, 8);
    for (node = 0; node < 257u * 257u; node++) /* a rough patch: the flat round it is forced */
        if (node % 257u < 130u || node % 257u > 150u || node / 257u < 130u || node / 257u > 150u)
            s.heights[node] = 0.0f;
    CHECK(terrimp_geomip_build(&s.tree, s.scratch) == TERRIMP_OK);
    for (frame = 0; frame < 40u; frame++) {
        terrimp_camera camera;
        float ratio2;
        mip_random_settings(&s);
        mip_random_camera(&s, &camera);
        s.view.morph_ratio = random_float(1.05f, 3.0f);
        ratio2 = s.view.morph_ratio * s.view.morph_ratio;
        CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_OK);
        for (node = 0; node + 1u < s.tree.node_count; node++) {
            terrimp_geomip_draw n = mip_draw_of(&s.tree, node);
            uint32_t above = s.tree.level_first[n.node.level + 1u] +
                             n.node.z / 2u * s.tree.level_x[n.node.level + 1u] + n.node.x / 2u;
            CHECK(s.view.distances[above] >= s.view.distances[node] * ratio2 * 0.9999f);
            if (s.view.marks[node].frame != s.view.frame || s.view.marks[node].measure < 1.0f)
                continue;
            split++;
            CHECK(s.view.marks[above].frame == s.view.frame);
            CHECK(s.view.marks[above].measure >= ratio2 * 0.9999f);
        }
    }
    CHECK(split > 500);
    mip_free(&s);
}

/* The drawn surface at every sample; NaN where nothing is drawn. `whole`: with the vertices that
   coarse borders leave out, which stand on the neighbour's edge. */
static void mip_surface(mip_scene *s, int whole, const uint16_t *indices, float *surface)
{
    static float heights[65 * 65];
    uint32_t i;
    memset(surface, 255, s->tree.field.width * s->tree.field.depth * sizeof *surface);
    for (i = 0; i < s->view.draw_count; i++) {
        mip_drawn d;
        memset(&d, 0, sizeof d);
        d.scene = s;
        d.draw = &s->view.draws[i];
        d.heights = heights;
        d.sample = mip_store;
        d.surface = surface;
        mip_heights(s, d.draw, heights);
        mip_triangles(indices, s->tree.chunk_quads, TERRIMP_FORM_LIST, whole ? 0 : d.draw->pattern,
                      mip_draw_triangle, &d);
    }
}

/* The largest change of a height from frame to frame on a way of `steps` steps. */
static float mip_largest_step(mip_scene *s, int whole, const terrimp_camera *from,
                              const float way[3], uint32_t steps, const uint16_t *indices)
{
    uint32_t samples = s->tree.field.width * s->tree.field.depth, frame, i;
    float *before = (float *)malloc(samples * sizeof *before), largest = 0.0f;
    float *after = (float *)malloc(samples * sizeof *after), *swap;
    for (frame = 0; frame <= steps; frame++) {
        terrimp_camera camera = *from;
        for (i = 0; i < 3u; i++)
            camera.eye[i] += way[i] * (float)frame / (float)steps;
        CHECK(terrimp_geomip_select(&s->tree, &s->view, &camera) == TERRIMP_OK);
        mip_surface(s, whole, indices, after);
        for (i = 0; frame > 0 && i < samples; i++)
            if (fabsf(after[i] - before[i]) > largest) /* never for NaN */
                largest = fabsf(after[i] - before[i]);
        swap = before;
        before = after;
        after = swap;
    }
    free(before);
    free(after);
    return largest;
}

/* The largest change of a height in a frame, on some random ways in so many steps. */
static void mip_step_changes(int whole, float morph_ratio, uint32_t steps, uint32_t ways,
                             float changes[8])
{
    uint16_t *indices = mip_filled(4, TERRIMP_FORM_LIST);
    uint32_t way;
    for (way = 0; way < ways; way++) {
        mip_scene s;
        terrimp_camera camera;
        float along[3];
        mip_make(&s, 65, 65, 4);
        mip_random_camera(&s, &camera);
        camera.eye[1] = random_float(5.0f, 80.0f);
        camera.forward[1] -= 0.5f;
        camera.fov_y_rad = 2.0f;
        s.view.rule = (int)(way % TERRIMP_GEOMIP_RULE_COUNT);
        s.view.tolerance_px = random_float(4.0f, 12.0f);
        s.view.morph_ratio = morph_ratio;
        along[0] = random_float(-40.0f, 40.0f);
        along[1] = random_float(-3.0f, 3.0f);
        along[2] = random_float(-40.0f, 40.0f);
        changes[way] = mip_largest_step(&s, whole, &camera, along, steps, indices);
        mip_free(&s);
    }
    free(indices);
}

static void heights_change_with_the_camera_s_step(void)
{
    float coarse[8], fine[8];
    uint32_t way, ways = check_rounds(3, 8), same = check_state;
    mip_step_changes(1, 1.5f, 16, ways, coarse);
    check_state = same;
    mip_step_changes(1, 1.5f, 256, ways, fine);
    for (way = 0; way < ways; way++)
        CHECK(fine[way] <= coarse[way] / 8.0f + 1e-4f);
}

/* Where a border vertex is left out, the diagonal beside it turns: what remains of popping. */
static void borders_pop_less_than_nodes_that_do_not_morph(void)
{
    float changes[8], morphed = 0.0f, popped = 0.0f;
    uint32_t round, way, rounds = check_rounds(1, 4), ways = check_rounds(5, 8);
    for (round = 0; round < rounds; round++) {
        uint32_t same = check_state;
        mip_step_changes(0, 1.5f, 128, ways, changes);
        for (way = 0; way < ways; way++)
            morphed += changes[way];
        check_state = same;
        mip_step_changes(0, 1.0f, 128, ways, changes);
        for (way = 0; way < ways; way++)
            popped += changes[way];
    }
    printf("  largest step of a height in a frame, mean of %u ways: %.3f morphing, %.3f not\n",
           (unsigned)(ways * rounds), (double)morphed / (ways * rounds),
           (double)popped / (ways * rounds));
    CHECK(morphed < 0.5f * popped);
}

/* A host with shaders takes the weights, one without lets the library morph: the same heights. */
static void weights_say_what_morphing_does(void)
{
    uint32_t i, k, side;
    for (i = 0; i < 30u; i++) {
        uint32_t quads = 4u + 2u * (i % 7u), count = (quads + 1u) * (quads + 1u);
        terrimp_geomip_weights *w = (terrimp_geomip_weights *)malloc(count * sizeof *w);
        terrimp_geomip_vertex *v = (terrimp_geomip_vertex *)malloc(count * sizeof *v);
        float *heights = (float *)malloc(3u * count * sizeof *heights);
        terrimp_geomip_draw draw;
        memset(&draw, 0, sizeof draw);
        draw.morph = random_float(0.0f, 1.0f);
        for (side = 0; side < TERRIMP_SIDE_COUNT; side++) {
            draw.side[side] = random_float(0.0f, 1.0f);
            draw.side_coarse[side] = random_float(0.0f, 1.0f);
        }
        for (k = 0; k < count; k++) {
            v[k].height = random_float(-9.0f, 9.0f);
            v[k].move = random_float(-9.0f, 9.0f);
            v[k].beside[0] = random_float(-9.0f, 9.0f);
            v[k].beside[1] = random_float(-9.0f, 9.0f);
        }
        CHECK(terrimp_geomip_fill_weights(quads, w) == TERRIMP_OK);
        CHECK(terrimp_geomip_morph(quads, &draw, v, heights + 1, 3) == TERRIMP_OK);
        for (k = 0; k < count; k++) {
            const float *coarse = draw.side_coarse;
            double factor = (double)w[k].self * (double)draw.morph, move = (double)v[k].move;
            for (side = 0; side < TERRIMP_SIDE_COUNT; side++) {
                int along = side == TERRIMP_SIDE_Z0 || side == TERRIMP_SIDE_Z1 ? 0 : 1;
                factor += (double)w[k].odd[side] * (double)draw.side[side] +
                          (double)w[k].even[side] * (double)coarse[side];
                move += (double)w[k].beside[side] * (double)coarse[side] *
                        (double)v[k].beside[along];
            }
            CHECK(fabs((double)v[k].height + factor * move - (double)heights[3u * k + 1u]) < 1e-4);
        }
        free(w);
        free(v);
        free(heights);
    }
}

/* D of a node is what the rule says of its own error, or the ratio times the largest D of its
   children. */
static void distances_follow_from_errors(void)
{
    uint32_t i, node, level;
    for (i = 0; i < 8u; i++) {
        mip_scene s;
        terrimp_camera camera;
        float factor;
        double *d2;
        mip_make(&s, 65, 49, 8);
        mip_random_settings(&s);
        mip_random_camera(&s, &camera);
        s.view.rule = i % 2u ? TERRIMP_GEOMIP_BOUND : TERRIMP_GEOMIP_PICTURE;
        s.view.morph_ratio = random_float(1.0f, 4.0f);
        d2 = (double *)calloc(s.tree.node_count, sizeof *d2);
        CHECK(terrimp_geomip_select(&s.tree, &s.view, &camera) == TERRIMP_OK);
        CHECK(terrimp_camera_pixel_factor(&camera, &factor) == TERRIMP_OK);
        for (level = node = 0; node < s.tree.node_count; node++) {
            double k = (double)factor / (double)s.view.tolerance_px, own = 0.0, ratio;
            double error = (double)s.tree.nodes[node].error, rms = (double)s.tree.nodes[node].rms;
            terrimp_node n = mip_draw_of(&s.tree, node).node;
            level = n.level;
            if (level > 0 && i % 2u)
                own = error * k * error * k;
            else if (level > 0) /* rms alone where quads are 4 px wide */
                own = rms * k * 1.375 * (1u << level) * (double)factor / 4.0;
            d2[node] = fmax(d2[node], own);
            CHECK(fabs((double)s.view.distances[node] - d2[node]) <= 1e-4 * d2[node]);
            ratio = (double)s.view.morph_ratio;
            if (node + 1u < s.tree.node_count) {
                double *above = &d2[terrimpi_tree_parent_number(&s.tree, node)];
                *above = fmax(*above, d2[node] * ratio * ratio);
            }
        }
        free(d2);
        mip_free(&s);
    }
}

static inline void geomipmap_tests(void)
{
    RUN(weights_say_what_morphing_does);
    RUN(distances_follow_from_errors);
    RUN(every_pattern_covers_its_square_once);
    RUN(patterns_share_every_border_vertex_with_neighbours_of_both_levels);
    RUN(vertex_caches_of_16_and_32_are_used_well);
    RUN(patterns_refuse_bad_sizes);
    RUN(a_node_knows_its_largest_error_and_that_of_finer_neighbours_beside_it);
    RUN(selections_tile_the_view_and_neighbours_fit);
    RUN(the_node_of_a_position_holds_it);
    RUN(the_same_frame_is_selected_twice_alike);
    RUN(nodes_meet_exactly_at_any_fraction);
    RUN(children_begin_in_the_shape_of_their_parent);
    RUN(nodes_have_ceased_to_morph_when_they_split);
    RUN(nodes_cost_few_bytes);
    RUN(bad_geomip_input_is_refused);
}

/* What flies: of the program flights.c. */
static inline void geomipmap_flights(void)
{
    RUN(no_sample_in_view_is_further_off_than_predicted);
    RUN(a_real_tile_keeps_within_a_pixel);
    RUN(a_jittering_camera_does_not_flicker);
    RUN(heights_change_with_the_camera_s_step);
    RUN(borders_pop_less_than_nodes_that_do_not_morph);
}

#endif
