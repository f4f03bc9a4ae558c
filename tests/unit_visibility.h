/* Laws of the rooms Visibility and Visible sets: nothing is hidden of which something shows. */
#ifndef UNIT_VISIBILITY_H
#define UNIT_VISIBILITY_H

#include "unit_oracle.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A terrain with walls. */
typedef struct visible_scene {
    terrimp_quadtree tree;
    float *samples, *scratch;
    void *walls;
} visible_scene;

/* Waves, ridges, a cliff and noise, thin walls that coarse ground lacks, or flat ground. */
static float visible_height(uint32_t kind, float x, float z)
{
    float y = 3.0f * sinf(x * 0.19f + 1.0f) * cosf(z * 0.23f);
    y += 9.0f * sinf(x * 0.043f + z * 0.031f);
    if (kind == 0)
        return 0.0f;
    if (kind == 4)
        return fmodf(x * 7.0f, 11.0f) == 3.0f || fmodf(z, 13.0f) == 7.0f ? 3.0f : y * 0.02f;
    if (kind == 1)
        y += fabsf(sinf(x * 0.07f - z * 0.05f)) * 14.0f;
    if (kind == 2)
        y = y * 0.2f + random_float(0.0f, 2.0f) + (x > 40.0f && x < 43.0f ? 25.0f : 0.0f);
    return y;
}

static void visible_make(visible_scene *s, uint32_t width, uint32_t depth, uint32_t quads)
{
    terrimp_heightfield field;
    uint32_t i, kind = random_range(0, 15) == 0 ? 0 : random_range(1, 4);
    memset(&field, 0, sizeof field);
    s->samples = (float *)malloc((size_t)width * depth * sizeof *s->samples);
    for (i = 0; i < width * depth; i++)
        s->samples[i] = visible_height(kind, (float)(i % width), (float)(i / width));
    field.samples = s->samples;
    field.width = width;
    field.depth = depth;
    if (random_range(0, 1)) {
        field.spacing_x = random_float(0.5f, 2.0f);
        field.spacing_z = random_float(0.5f, 2.0f);
        field.origin_x = random_float(-3000.0f, 3000.0f);
        field.origin_z = random_float(-3000.0f, 3000.0f);
        field.height_offset = random_float(-100.0f, 100.0f);
    }
    CHECK(terrimp_quadtree_init(&field, quads, &s->tree) == TERRIMP_OK);
    s->tree.nodes =
        (terrimp_geomip_node *)malloc(s->tree.node_count * sizeof *s->tree.nodes);
    s->scratch = (float *)malloc((width + 2u * quads + 2u) * sizeof(float));
    CHECK(terrimp_geomip_build(&s->tree, s->scratch) == TERRIMP_OK);
    s->walls = malloc(terrimp_walls_bytes(&s->tree));
    CHECK(terrimp_walls_build(&s->tree, NULL, s->walls) == TERRIMP_OK);
}

static void visible_free(visible_scene *s)
{
    free(s->samples);
    free(s->scratch);
    free(s->tree.nodes);
    free(s->walls);
}

static void visible_make_any(visible_scene *s)
{
    static const uint32_t quads[] = {4, 6, 8, 16, 32, 64};
    uint32_t q = quads[random_range(0, 5)];
    visible_make(s, random_range(2, 4) * 33u + random_range(0, 1), random_range(40, 150), q);
}

/* A camera over the terrain, seldom beside or below it, at all heights and angles. */
static terrimp_camera visible_camera(const visible_scene *s)
{
    const terrimp_heightfield *f = &s->tree.field;
    terrimp_camera c;
    float height = 0.0f, over = random_range(0, 15) == 0 ? 0.3f : 0.0f;
    memset(&c, 0, sizeof c);
    c.eye[0] = random_float(-over, 1.0f + over) * (float)(f->width - 1u) * f->spacing_x;
    c.eye[2] = random_float(-over, 1.0f + over) * (float)(f->depth - 1u) * f->spacing_z;
    c.eye[0] += f->origin_x;
    c.eye[2] += f->origin_z;
    if (random_range(0, 3) == 0) { /* just over a sample, where rounding bites */
        c.eye[0] = terrimpi_field_line(f->origin_x, f->spacing_x, random_range(0, f->width - 1u));
        c.eye[2] = terrimpi_field_line(f->origin_z, f->spacing_z, random_range(0, f->depth - 1u));
    }
    (void)terrimp_heightfield_height(f, c.eye[0], c.eye[2], &height);
    c.eye[1] = height + random_magnitude(0.05f, 30.0f) - (random_range(0, 15) == 0 ? 6.0f : 0.0f);
    random_vector(1.0f, 1.0f, c.forward);
    c.forward[1] *= random_range(0, 3) == 0 ? 1.0f : 0.2f;
    if (random_range(0, 7) == 0)
        random_vector(1.0f, 1.0f, c.up);
    c.fov_y_rad = random_float(0.2f, 2.0f);
    c.width_px = random_range(100, 900);
    c.height_px = random_range(100, 900);
    c.z_near = random_magnitude(0.01f, 3.0f);
    c.z_far = 1e5f;
    CHECK(terrimp_camera_resolve(&c, &c) == TERRIMP_OK);
    return c;
}

/* The part of the way from the eye to a point after which it is in front of z_near; 2 when the
   camera does not see it. */
static double visible_start(const terrimp_camera *c, const double point[3])
{
    double to[3], eye[3], forward[3], up[3], right[3], ahead;
    double tan_y = tan(0.5 * (double)c->fov_y_rad);
    double tan_x = tan_y * (double)c->width_px / (double)c->height_px;
    oracle_widen(c->eye, eye);
    oracle_widen(c->forward, forward);
    oracle_widen(c->up, up);
    oracle_cross(forward, up, right);
    oracle_between(eye, point, to);
    ahead = oracle_dot(to, forward);
    if (ahead <= (double)c->z_near || fabs(oracle_dot(to, right)) > tan_x * ahead ||
        fabs(oracle_dot(to, up)) > tan_y * ahead)
        return 2.0;
    return (double)c->z_near / ahead;
}

/* How far a point of a line of samples lies above the ground (along 0: line `line` is a column). */
static double visible_over(const terrimp_heightfield *f, uint32_t along, uint32_t line, double at,
                           double y)
{
    float origin = along == 0 ? f->origin_z : f->origin_x;
    float spacing = along == 0 ? f->spacing_z : f->spacing_x;
    uint32_t last = (along == 0 ? f->depth : f->width) - 2u, k;
    double quad = (at - (double)origin) / (double)spacing, a, b, t;
    k = quad <= 0.0 ? 0 : quad >= (double)last ? last : (uint32_t)quad;
    while (k > 0 && at < (double)terrimpi_field_line(origin, spacing, k))
        k--;
    while (k < last && at > (double)terrimpi_field_line(origin, spacing, k + 1u))
        k++;
    a = (double)terrimpi_field_line(origin, spacing, k);
    b = (double)terrimpi_field_line(origin, spacing, k + 1u);
    t = (at - a) / (b - a);
    a = (double)(along == 0 ? terrimpi_field_sample(f, line, k) :
                 terrimpi_field_sample(f, k, line));
    b = (double)(along == 0 ? terrimpi_field_sample(f, line, k + 1u) :
                 terrimpi_field_sample(f, k + 1u, line));
    return y - (a + (b - a) * t);
}

/* Whether the way from the eye to a point, from a part of it on, is once below the ground where it
   crosses the columns and rows of the terrain, but not at its beginning. */
static int visible_blocked(const terrimp_heightfield *f, const float eye[3], const double point[3],
                           double start)
{
    uint32_t along, line;
    float from[3], ground;
    for (along = 0; along < 3u; along++)
        from[along] = (float)((double)eye[along] + start * (point[along] - (double)eye[along]));
    if (terrimp_heightfield_height(f, from[0], from[2], &ground) != TERRIMP_OK ||
        ground > from[1] + 1e-3f)
        return 0;
    for (along = 0; along < 2u; along++) {
        uint32_t k = along == 0 ? 0u : 2u, count = along == 0 ? f->width : f->depth;
        for (line = 0; line < count; line++) {
            double at = (double)(along == 0 ? terrimpi_field_line(f->origin_x, f->spacing_x, line)
                                            : terrimpi_field_line(f->origin_z, f->spacing_z, line));
            double t = (at - (double)eye[k]) / (point[k] - (double)eye[k]), over;
            if (!(t > start && t < 1.0 - 1e-9))
                continue;
            over = visible_over(f, along, line,
                                (double)eye[2u - k] + t * (point[2u - k] - (double)eye[2u - k]),
                                (double)eye[1] + t * (point[1] - (double)eye[1]));
            if (over < 0.0)
                return 1;
        }
    }
    return 0;
}

/* A point of the surface over a node: a sample, or one between samples. */
static void visible_point(const visible_scene *s, const terrimp_node *n, double point[3])
{
    const terrimp_heightfield *f = &s->tree.field;
    uint32_t quads = s->tree.chunk_quads << n->level;
    uint32_t x = n->x * quads + random_range(0, quads), z = n->z * quads + random_range(0, quads);
    float u = random_range(0, 1) ? random_float(0.0f, 1.0f) : 0.0f, y, px, pz;
    float v = random_range(0, 1) ? random_float(0.0f, 1.0f) : 0.0f;
    x = x > f->width - 1u ? f->width - 1u : x;
    z = z > f->depth - 1u ? f->depth - 1u : z;
    px = terrimpi_field_line(f->origin_x, f->spacing_x, x);
    pz = terrimpi_field_line(f->origin_z, f->spacing_z, z);
    if (x + 1u < f->width && x + 1u <= (n->x + 1u) * quads)
        px += u * (terrimpi_field_line(f->origin_x, f->spacing_x, x + 1u) - px);
    if (z + 1u < f->depth && z + 1u <= (n->z + 1u) * quads)
        pz += v * (terrimpi_field_line(f->origin_z, f->spacing_z, z + 1u) - pz);
    y = terrimpi_field_sample(f, x, z);
    CHECK(terrimp_heightfield_height(f, px, pz, &y) == TERRIMP_OK);
    point[0] = (double)px;
    point[1] = (double)y;
    point[2] = (double)pz;
}

/* The law of the room: no point of a hidden node is seen, whatever terrain, eye and direction. */
static void visibility_hides_nothing_that_shows(void)
{
    static terrimp_horizon h;
    uint32_t round, rounds = check_rounds(60, 1500), hidden = 0;
    for (round = 0; round < rounds; round++) {
        visible_scene s;
        uint32_t eye, n, k;
        visible_make_any(&s);
        CHECK(terrimp_horizon_init(&h, &s.tree, s.walls) == TERRIMP_OK);
        for (eye = 0; eye < 8; eye++) {
            terrimp_camera c = visible_camera(&s);
            CHECK(terrimp_horizon_begin(&h, &c, 0.0f, 0.0f) == TERRIMP_OK);
            for (n = 0; n < s.tree.node_count; n++) {
                uint32_t number = eye % 2u ? n : s.tree.node_count - 1u - n;
                terrimp_node node = terrimpi_tree_node(&s.tree, number);
                if (!terrimp_horizon_hides(&h, number, 0.0f))
                    continue;
                for (k = 0; k < 12; k++) {
                    double point[3], start;
                    visible_point(&s, &node, point);
                    start = visible_start(&c, point);
                    hidden += start < 1.0;
                    CHECK(start > 1.0 || visible_blocked(&s.tree.field, c.eye, point, start));
                }
            }
        }
        visible_free(&s);
    }
    CHECK(hidden > 100u * rounds); /* and it does find something */
}

/* ---- visible sets ---- */

/* Sets of at most so many bytes, of random levels. */
static void visible_sets(const visible_scene *s, terrimp_sets *sets, float error, float low,
                         size_t most)
{
    uint32_t cell = 0;
    size_t bytes;
    memset(sets, 0, sizeof *sets);
    sets->error = error;
    sets->low = low;
    while ((bytes = terrimp_sets_bytes(&s->tree, sets)) > most) {
        if (random_range(0, 1))
            sets->cell_level++;
        else
            sets->node_level++;
    }
    sets->codes = (uint8_t *)calloc(bytes, 1);
    CHECK(bytes > 0 && terrimp_sets_init(sets, &s->tree) == TERRIMP_OK);
    while (terrimp_sets_build_cell(sets, s->walls, cell, NULL) == TERRIMP_OK)
        cell++;
    CHECK(cell == terrimpi_sets_level_nodes(&s->tree, sets->cell_level));
}

/* Whether sets are right about a camera; returns points of hidden nodes that were looked at. */
static uint32_t visible_sets_hide(const visible_scene *s, terrimp_sets *sets,
                                  const terrimp_camera *c)
{
    uint32_t n, k, hidden = 0;
    if (!sets->hider.begin(&sets->hider, c, 0.0f, 0.0f))
        return 0;
    for (n = 0; n < s->tree.node_count; n++) {
        terrimp_node node = terrimpi_tree_node(&s->tree, n);
        if (!sets->hider.hides(&sets->hider, &node))
            continue;
        for (k = 0; k < 6; k++) {
            double point[3], start;
            visible_point(s, &node, point);
            start = visible_start(c, point);
            hidden += start < 1.0;
            CHECK(start > 1.0 || visible_blocked(&s->tree.field, c->eye, point, start));
        }
    }
    return hidden;
}

/* A hill, a hole, or noise in a rectangle of samples. */
static terrimp_rect visible_edit(const visible_scene *s)
{
    terrimp_rect r;
    uint32_t x, z;
    float by = random_float(-30.0f, 10.0f), noise = random_range(0, 1) ? 8.0f : 0.0f;
    r.x = random_range(0, s->tree.field.width - 1u);
    r.y = random_range(0, s->tree.field.depth - 1u);
    r.width = random_range(1, 60);
    r.height = random_range(1, 30);
    for (z = r.y; z < r.y + r.height && z < s->tree.field.depth; z++)
        for (x = r.x; x < r.x + r.width && x < s->tree.field.width; x++)
            s->samples[z * s->tree.field.width + x] += by + random_float(-noise, noise);
    CHECK(terrimp_geomip_build(&s->tree, s->scratch) == TERRIMP_OK);
    CHECK(terrimp_walls_build(&s->tree, &r, s->walls) == TERRIMP_OK);
    return r;
}

/* The law of visible sets, whatever terrain, levels, eye and direction; also right after an edit,
   and after its cells have been built anew. */
static void visible_sets_hide_nothing_that_shows(void)
{
    uint32_t round, rounds = check_rounds(24, 400), hidden[3] = {0, 0, 0}, step, eye, cell;
    for (round = 0; round < rounds; round++) {
        visible_scene s;
        terrimp_sets sets;
        terrimp_rect edit;
        visible_make_any(&s);
        visible_sets(&s, &sets, round % 4u ? 0.0f : 0.01f, round % 4u ? 0.0f : 0.1f, 8000);
        for (step = 0; step < 3; step++) {
            if (step == 1) {
                edit = visible_edit(&s);
                CHECK(terrimp_sets_touch(&sets, &edit) == TERRIMP_OK);
            }
            for (cell = 0; step == 2; cell++)
                if (terrimp_sets_build_cell(&sets, s.walls, cell, &edit) != TERRIMP_OK)
                    break;
            for (eye = 0; eye < 50; eye++) {
                terrimp_camera c = visible_camera(&s);
                hidden[step] += visible_sets_hide(&s, &sets, &c);
            }
        }
        free(sets.codes);
        visible_free(&s);
    }
    CHECK(hidden[0] > 50u * rounds); /* and they do find something */
    CHECK(hidden[1] > 20u * rounds && hidden[2] > 40u * rounds);
}

/* What an edit cannot change, it does not; and where it can, building anew finds what building all
   does. */
static void visible_sets_are_rebuilt_where_samples_change(void)
{
    uint32_t round, kept = 0, cell, k, count;
    for (round = 0; round < 20; round++) {
        visible_scene s;
        terrimp_sets sets, old;
        terrimp_rect edit;
        size_t bytes;
        visible_make_any(&s);
        visible_sets(&s, &sets, 0.0f, 0.0f, 2000);
        bytes = terrimp_sets_bytes(&s.tree, &sets);
        old = sets;
        old.codes = (uint8_t *)malloc(bytes);
        memcpy(old.codes, sets.codes, bytes);
        edit = visible_edit(&s);
        CHECK(terrimp_sets_touch(&old, &edit) == TERRIMP_OK);
        count = terrimpi_sets_level_nodes(&s.tree, sets.node_level);
        for (k = 0; k < bytes; k++)
            kept += old.codes[k] > 0;
        for (cell = 0; cell < bytes / count; cell++)
            CHECK(terrimp_sets_build_cell(&old, s.walls, cell, &edit) == TERRIMP_OK &&
                  terrimp_sets_build_cell(&sets, s.walls, cell, NULL) == TERRIMP_OK);
        for (k = 0; k < bytes; k++) {
            terrimp_node c = terrimpi_tree_node(&s.tree, s.tree.level_first[sets.cell_level] +
                                                             k / count);
            terrimp_node n = terrimpi_tree_node(&s.tree, s.tree.level_first[sets.node_level] +
                                                             k % count);
            terrimpi_sets_rect a = terrimpi_sets_place(&s.tree, &c);
            terrimpi_sets_rect b = terrimpi_sets_place(&s.tree, &n);
            CHECK(!terrimpi_sets_meets(&a, &b, &edit) || old.codes[k] == sets.codes[k]);
        }
        free(old.codes);
        free(sets.codes);
        visible_free(&s);
    }
    CHECK(kept > 1000);
}

/* ---- what is drawn ---- */

/* The triangles of a draw, as positions. */
typedef struct visible_mesh {
    uint32_t quads, count;
    uint16_t *indices;
    terrimp_geomip_vertex *vertices;
    float *xyz;
} visible_mesh;

static void visible_mesh_fill(visible_mesh *m, const terrimp_quadtree *tree,
                              const terrimp_geomip_draw *draw)
{
    CHECK(terrimp_geomip_fill_vertices(tree, draw->node.number, m->xyz, m->vertices) == TERRIMP_OK);
    CHECK(terrimp_geomip_morph(m->quads, draw, m->vertices, m->xyz + 1, 3) == TERRIMP_OK);
}

/* Where a sight line goes through a triangle from above: the part of the way, or 2. */
static double visible_through(const double eye[3], const double to[3], const float *a,
                              const float *b, const float *c)
{
    double p[3][3], edge[2][3], from[3], cross[3], across[3], det, u, v;
    oracle_widen(a, p[0]);
    oracle_widen(b, p[1]);
    oracle_widen(c, p[2]);
    oracle_between(p[0], p[1], edge[0]);
    oracle_between(p[0], p[2], edge[1]);
    oracle_between(p[0], eye, from);
    oracle_cross(to, edge[1], cross);
    det = oracle_dot(edge[0], cross);
    if (det <= 1e-12) /* from below, or along it */
        return 2.0;
    u = oracle_dot(from, cross) / det;
    oracle_cross(from, edge[0], across);
    v = oracle_dot(to, across) / det;
    if (u < -1e-9 || v < -1e-9 || u + v > 1.0 + 1e-9)
        return 2.0;
    return oracle_dot(edge[1], across) / det;
}

/* Whether one of some draws is in front of a point. */
static int visible_covered(visible_mesh *m, const terrimp_quadtree *tree,
                           const terrimp_geomip_view *view, const terrimp_camera *c,
                           const double point[3], double start)
{
    double eye[3], to[3], t;
    uint32_t i, k;
    oracle_widen(c->eye, eye);
    oracle_between(eye, point, to);
    for (i = 0; i < view->draw_count; i++) {
        terrimp_pattern p;
        visible_mesh_fill(m, tree, &view->draws[i]);
        CHECK(terrimp_pattern_find(m->quads, TERRIMP_FORM_LIST, view->draws[i].pattern, &p) ==
              TERRIMP_OK);
        for (k = p.first_index; k < p.first_index + p.index_count; k += 3) {
            const uint16_t *v = m->indices + k;
            t = visible_through(eye, to, m->xyz + 3 * v[0], m->xyz + 3 * v[1], m->xyz + 3 * v[2]);
            if (t > start && t < 1.0 - 1e-7)
                return 1;
        }
    }
    return 0;
}

/* Coarse ground hides less than the samples do, and stands out more: what cull takes out is behind
   what is left, by any rule, with morphing and without. */
static void culled_draws_are_behind_those_that_are_left(void)
{
    static terrimp_horizon h;
    uint32_t round, rounds = check_rounds(24, 600), culled = 0;
    for (round = 0; round < rounds; round++) {
        visible_scene s;
        visible_mesh m;
        terrimp_geomip_view v;
        terrimp_geomip_draw *all;
        terrimp_camera c;
        uint32_t i, k, count, triangles;
        m.quads = random_range(0, 1) ? 4 : 8;
        visible_make(&s, random_range(60, 120), random_range(60, 120), m.quads);
        count = terrimp_pattern_index_count(m.quads, TERRIMP_FORM_LIST);
        m.count = (m.quads + 1u) * (m.quads + 1u);
        m.indices = (uint16_t *)malloc(count * sizeof *m.indices);
        m.vertices = (terrimp_geomip_vertex *)malloc(m.count * sizeof *m.vertices);
        m.xyz = (float *)malloc(3u * m.count * sizeof *m.xyz);
        CHECK(terrimp_pattern_fill(m.quads, TERRIMP_FORM_LIST, m.indices, count) == TERRIMP_OK);
        memset(&v, 0, sizeof v);
        v.draw_capacity = s.tree.node_count;
        v.distances = (float *)malloc(s.tree.node_count * sizeof *v.distances);
        v.marks = (terrimp_geomip_mark *)calloc(s.tree.node_count, sizeof *v.marks);
        v.draws = (terrimp_geomip_draw *)malloc(s.tree.node_count * sizeof *v.draws);
        all = (terrimp_geomip_draw *)malloc(s.tree.node_count * sizeof *all);
        CHECK(terrimp_horizon_init(&h, &s.tree, s.walls) == TERRIMP_OK);
        for (i = 0; i < 6; i++) {
            c = visible_camera(&s);
            v.rule = (int)random_range(1, 3);
            v.tolerance_px = random_magnitude(0.3f, 300.0f);
            v.morph_ratio = random_range(0, 1) ? 1.0f : 1.6f;
            CHECK(terrimp_geomip_select(&s.tree, &v, &c) == TERRIMP_OK);
            memcpy(all, v.draws, v.draw_count * sizeof *all);
            count = v.draw_count;
            triangles = v.triangle_count;
            CHECK(terrimp_horizon_cull(&h, &c, &v) == TERRIMP_OK);
            culled += count - v.draw_count;
            for (k = 0; k < count; k++) {
                uint32_t left, j;
                for (left = 0; left < v.draw_count; left++)
                    if (memcmp(&v.draws[left], &all[k], sizeof *all) == 0)
                        break;
                if (left < v.draw_count)
                    continue;
                triangles -= terrimpi_mip_triangles(m.quads, all[k].pattern);
                for (j = 0; j < 5; j++) { /* its vertices, and points of its edges */
                    const float *a, *b;
                    double point[3], t = random_range(0, 1) ? 0.0 : 0.5, start;
                    uint32_t axis, vertex = random_range(0, (m.quads + 1u) * (m.quads + 1u) - 1u);
                    visible_mesh_fill(&m, &s.tree, &all[k]);
                    a = m.xyz + 3u * vertex;
                    b = vertex % (m.quads + 1u) == m.quads ? a : a + 3;
                    if (all[k].pattern != 0)
                        b = a;
                    for (axis = 0; axis < 3; axis++)
                        point[axis] = (double)a[axis] + t * ((double)b[axis] - (double)a[axis]);
                    start = visible_start(&c, point);
                    CHECK(start > 1.0 || visible_covered(&m, &s.tree, &v, &c, point, start));
                }
            }
            CHECK(triangles == v.triangle_count);
        }
        free(m.indices);
        free(m.vertices);
        free(m.xyz);
        free(v.distances);
        free(v.marks);
        free(v.draws);
        free(all);
        visible_free(&s);
    }
    CHECK(culled > rounds);
}

/* ---- walls ---- */

/* After an edit, rebuilding what it touches gives what building everything does, bit for bit; and
   nodes of a level may be built in any order. */
static void walls_are_rebuilt_where_samples_change(void)
{
    uint32_t round;
    for (round = 0; round < 40; round++) {
        visible_scene s;
        terrimp_rect rect;
        void *again;
        uint32_t x, z, level, k;
        size_t bytes;
        visible_make_any(&s);
        bytes = terrimp_walls_bytes(&s.tree);
        again = malloc(bytes);
        rect.x = random_range(0, s.tree.field.width - 1u);
        rect.y = random_range(0, s.tree.field.depth - 1u);
        rect.width = random_range(1, 20);
        rect.height = random_range(1, 200);
        for (z = rect.y; z < rect.y + rect.height && z < s.tree.field.depth; z++)
            for (x = rect.x; x < rect.x + rect.width && x < s.tree.field.width; x++)
                s.samples[z * s.tree.field.width + x] += random_float(-20.0f, 20.0f);
        CHECK(terrimp_walls_build(&s.tree, &rect, s.walls) == TERRIMP_OK);
        for (level = 0; level < s.tree.level_count; level++)
            for (k = s.tree.level_first[level + 1u]; k-- > s.tree.level_first[level];)
                CHECK(terrimp_walls_build_node(&s.tree, k, again) == TERRIMP_OK);
        CHECK(memcmp(s.walls, again, bytes) == 0);
        free(again);
        visible_free(&s);
    }
}

/* ---- where there is no horizon ---- */

/* A long wall across the terrain hides all behind it from an eye at its foot, and nothing from one
   that is over it, below the ground, or beside the terrain. */
static void visibility_of_a_wall(void)
{
    static terrimp_horizon h;
    static float samples[129 * 129];
    static terrimp_geomip_node nodes[400];
    static float scratch[200];
    terrimp_heightfield field;
    terrimp_quadtree tree;
    terrimp_camera c;
    void *walls;
    uint32_t k, hidden;
    int eye;
    for (k = 0; k < 129 * 129; k++)
        samples[k] = k / 129 == 40 ? 10.0f : 0.0f;
    memset(&field, 0, sizeof field);
    field.samples = samples;
    field.width = field.depth = 129;
    CHECK(terrimp_quadtree_init(&field, 8, &tree) == TERRIMP_OK);
    CHECK(tree.node_count <= 400);
    tree.nodes = nodes;
    CHECK(terrimp_geomip_build(&tree, scratch) == TERRIMP_OK);
    walls = malloc(terrimp_walls_bytes(&tree));
    CHECK(terrimp_walls_build(&tree, NULL, walls) == TERRIMP_OK);
    CHECK(terrimp_horizon_init(&h, &tree, walls) == TERRIMP_OK);
    for (eye = 0; eye < 5; eye++) {
        memset(&c, 0, sizeof c);
        c.eye[0] = 64.5f;
        c.eye[1] = eye == 1 ? 30.0f : eye == 2 ? -1.0f : 2.0f;
        c.eye[2] = eye == 3 ? -5.0f : 20.5f;
        c.forward[eye == 4 ? 1 : 2] = eye == 4 ? -1.0f : 1.0f; /* straight down: all round */
        c.width_px = c.height_px = 500;
        c.z_near = 0.5f;
        c.z_far = 1000.0f;
        CHECK(terrimp_horizon_begin(&h, &c, 0.0f, 0.0f) == TERRIMP_OK);
        for (k = hidden = 0; k < 256; k++) {
            int hides = terrimp_horizon_hides(&h, k, 0.0f) != 0;
            hidden += (uint32_t)hides;
            if (k / 16u == 10u && k % 16u > 5u && k % 16u < 10u) /* in view, behind the wall */
                CHECK(hides == (eye == 0 || eye == 4));
            CHECK(!hides || eye < 2 || (eye == 4 && k / 16u > 4u));
        }
        CHECK(hidden > 100u || eye != 4);
    }
    free(walls);
}

/* Who walks over steep ground in large quads has a horizon: only what z_near may really clip, which
   is closer than that, can take it away. */
static void walkers_on_steep_ground_have_a_horizon(void)
{
    static terrimp_horizon h;
    uint32_t round, eye, k, blind = 0;
    for (round = 0; round < 20; round++) {
        visible_scene s;
        visible_make(&s, 70, 60, 8);
        s.tree.field.spacing_x = s.tree.field.spacing_z = 20.0f;
        CHECK(terrimp_horizon_init(&h, &s.tree, s.walls) == TERRIMP_OK);
        for (eye = 0; eye < 50; eye++) {
            terrimp_camera c = visible_camera(&s);
            float ground = 0.0f, over;
            int clear = terrimp_heightfield_height(&s.tree.field, c.eye[0], c.eye[2], &ground) ==
                        TERRIMP_OK;
            c.eye[1] = ground + 2.0f;
            c.fov_y_rad = 1.0f;
            c.width_px = c.height_px = 500;
            c.z_near = 0.1f;
            CHECK(terrimp_horizon_begin(&h, &c, 0.0f, 0.0f) == TERRIMP_OK);
            for (k = 0; k < 9; k++) /* within 0.4 it is flat or far enough below */
                clear = clear && terrimp_heightfield_height(
                                     &s.tree.field, c.eye[0] + 0.4f * ((float)(k % 3u) - 1.0f),
                                     c.eye[2] + 0.4f * ((float)(k / 3u) - 1.0f), &over) ==
                                     TERRIMP_OK && over < c.eye[1];
            CHECK(!clear || !h.blind);
            blind += !clear;
        }
        visible_free(&s);
    }
    CHECK(blind < 300);
}

/* ---- in a view ---- */

/* The ground nodes that a view draws. */
typedef struct visible_drawn {
    uint32_t nodes[600], count;
} visible_drawn;

static void visible_note(void *user, const terrimp_ground_command *command)
{
    visible_drawn *d = (visible_drawn *)user;
    if (d->count < 600)
        d->nodes[d->count++] = command->node;
}

static void visible_draw(terrimp_view *view, const terrimp_camera *c, visible_drawn *drawn,
                         terrimp_stats *stats)
{
    terrimp_callbacks draw;
    memset(&draw, 0, sizeof draw);
    draw.user = drawn;
    draw.draw_ground = visible_note;
    drawn->count = 0;
    CHECK(terrimp_view_update(view, c) == TERRIMP_OK);
    CHECK(terrimp_view_get_stats(view, stats) == TERRIMP_OK);
    CHECK(terrimp_view_render(view, &draw) == TERRIMP_OK);
}

/* With walls a view at full resolution leaves out ground of which nothing shows, and no other; and
   the commands that are left are those of before, in their order, also at the tolerance. */
static void views_leave_out_what_is_hidden(void)
{
    static visible_drawn with, without;
    static terrimp_horizon h;
    uint32_t round, hidden = 0;
    visible_scene s;
    terrimp_terrain *terrain = NULL;
    for (round = 0; round < 30; round++) { /* two over each terrain, in both modes */
        terrimp_terrain_desc desc;
        terrimp_view_desc settings;
        terrimp_view *views[2];
        terrimp_sets sets;
        terrimp_stats stats;
        uint32_t i, j, k, eye;
        memset(&desc, 0, sizeof desc);
        memset(&settings, 0, sizeof settings);
        if (round % 2u == 0) {
            visible_make(&s, 129, 129, 8);
            desc.field = s.tree.field;
            desc.chunk_quads = 8;
            desc.triangle_budget = 128; /* no mesh is drawn */
            CHECK(terrimp_terrain_create(&desc, NULL, &terrain) == TERRIMP_OK);
            CHECK(terrimp_walls_build(terrimp_terrain_tree(terrain), NULL, s.walls) == TERRIMP_OK);
        }
        settings.mode = round % 2u ? TERRIMP_MODE_FULL : TERRIMP_MODE_GEOMIP;
        settings.ground_tolerance_px = 4.0f;
        settings.atlas_size = 64;
        settings.max_impostors = 4;
        CHECK(terrimp_view_create(terrain, &settings, NULL, &views[0]) == TERRIMP_OK);
        memset(&sets, 0, sizeof sets);
        if (round % 3u == 0)
            visible_sets(&s, &sets, round % 2u ? 0.0f : 0.1f, 0.0f, 8000);
        CHECK(terrimp_horizon_init(&h, terrimp_terrain_tree(terrain), s.walls) == TERRIMP_OK);
        sets.hider.tree = terrimp_terrain_tree(terrain);
        settings.hider = round % 3u == 0 ? &sets.hider : &h.hider;
        sets.hider.next = round % 6u == 0 ? &h.hider : NULL;
        CHECK(terrimp_view_create(terrain, &settings, NULL, &views[1]) == TERRIMP_OK);
        for (eye = 0; eye < 6; eye++) {
            terrimp_camera c = visible_camera(&s);
            visible_draw(views[0], &c, &without, &stats);
            CHECK(stats.hidden == 0);
            visible_draw(views[1], &c, &with, &stats);
            CHECK(with.count <= without.count);
            CHECK(with.count == without.count || stats.hidden > 0);
            for (i = j = 0; i < without.count; i++) {
                terrimp_node node = terrimpi_tree_node(&s.tree, without.nodes[i]);
                if (j < with.count && with.nodes[j] == without.nodes[i]) {
                    j++;
                    continue;
                }
                hidden++;
                for (k = 0; k < 10 && settings.mode == TERRIMP_MODE_FULL; k++) {
                    double point[3], start;
                    visible_point(&s, &node, point);
                    start = visible_start(&c, point);
                    CHECK(start > 1.0 || visible_blocked(&s.tree.field, c.eye, point, start));
                }
            }
            CHECK(j == with.count);
        }
        terrimp_view_destroy(views[0]);
        terrimp_view_destroy(views[1]);
        free(sets.codes);
        if (round % 2u == 0)
            continue;
        terrimp_terrain_destroy(terrain);
        visible_free(&s);
    }
    CHECK(hidden > 1000);
}

/* ---- materials ---- */

/* The weight that a bilinear read finds at a place in quads. */
static double material_weight(const terrimp_heightfield *f, const terrimp_weights *w, double x,
                              double z)
{
    double at[2], weight = 0.0;
    uint32_t size[2], quads[2], k;
    size[0] = w->width;
    size[1] = w->depth;
    quads[0] = f->width - 1u;
    quads[1] = f->depth - 1u;
    for (k = 0; k < 2; k++) {
        double part = (k == 0 ? x : z) / (double)quads[k];
        at[k] = w->centred ? part * (double)(size[k] - 1u) : part * (double)size[k] - 0.5;
    }
    for (k = 0; k < 4; k++) {
        double u = floor(at[0]) + (double)(k % 2u), v = floor(at[1]) + (double)(k / 2u);
        double share = (1.0 - fabs(at[0] - u)) * (1.0 - fabs(at[1] - v));
        size_t i = u < 0.0 ? 0u : u > (double)(size[0] - 1u) ? size[0] - 1u : (size_t)u;
        size_t j = v < 0.0 ? 0u : v > (double)(size[1] - 1u) ? size[1] - 1u : (size_t)v;
        weight += share * (double)w->texels[j * w->row_bytes + i * w->texel_bytes];
    }
    return weight;
}

/* No place on a node has a weight whose bit is missing; and a bit has a weight on the node or, by
   the rounding that is allowed for, right beside it. Parents have the bits of their children. */
static void masks_have_the_materials_that_lie_on_a_node(void)
{
    uint32_t round, set = 0, clear = 0;
    for (round = 0; round < 60; round++) {
        visible_scene s;
        terrimp_weights w[3];
        uint8_t texels[3][40 * 40];
        uint32_t k, n, i, *masks;
        visible_make_any(&s);
        masks = (uint32_t *)malloc(s.tree.node_count * sizeof *masks);
        memset(texels, 0, sizeof texels);
        memset(w, 0, sizeof w);
        for (k = 0; k < 3; k++) {
            w[k].texels = texels[k];
            w[k].texel_bytes = random_range(1, 2);
            w[k].width = random_range(1, 20);
            w[k].depth = random_range(1, 40);
            w[k].row_bytes = 40;
            w[k].centred = (int)random_range(0, 1);
            for (i = random_range(0, 5); i > 0; i--)
                texels[k][random_range(0, w[k].depth - 1u) * 40u +
                          random_range(0, w[k].width - 1u) * w[k].texel_bytes] = 255;
        }
        CHECK(terrimp_material_masks(&s.tree, w, 3, 1.0f, masks) == TERRIMP_OK);
        for (n = 0; n < s.tree.node_count; n++) {
            terrimp_node node = terrimpi_tree_node(&s.tree, n);
            double quads = (double)(s.tree.chunk_quads << node.level);
            double last_x = (double)(s.tree.field.width - 1u);
            double last_z = (double)(s.tree.field.depth - 1u);
            if (n + 1u < s.tree.node_count)
                CHECK((masks[n] & ~masks[terrimpi_tree_parent_number(&s.tree, n)]) == 0);
            for (k = 0; k < 3; k++) {
                double near_by = 0.02 * last_x / (double)w[k].width +
                                 0.02 * last_z / (double)w[k].depth, found = 0.0;
                for (i = 0; i < 81; i++) { /* from side to side, and a little beyond */
                    double x = ((double)node.x + (double)(i % 9u) / 8.0) * quads;
                    double z = ((double)node.z + (double)(i / 9u) / 8.0) * quads;
                    x = x > last_x ? last_x : x;
                    z = z > last_z ? last_z : z;
                    if (!(masks[n] >> k & 1u))
                        CHECK(material_weight(&s.tree.field, &w[k], x, z) == 0.0);
                    x += (double)((int)(i % 9u) - 4) * near_by;
                    z += (double)((int)(i / 9u) - 4) * near_by;
                    x = x < 0.0 ? 0.0 : x > last_x ? last_x : x;
                    z = z < 0.0 ? 0.0 : z > last_z ? last_z : z;
                    found += material_weight(&s.tree.field, &w[k], x, z);
                }
                if (quads * (double)w[k].width < 4.0 * last_x &&
                    quads * (double)w[k].depth < 4.0 * last_z)
                    CHECK(!(masks[n] >> k & 1u) || found > 0.0);
                set += masks[n] >> k & 1u;
                clear += !(masks[n] >> k & 1u);
            }
        }
        CHECK(terrimp_material_masks(&s.tree, w, 33, 1.0f, masks) == TERRIMP_E_RANGE);
        CHECK(terrimp_material_masks(&s.tree, w, 3, 0.5f, masks) == TERRIMP_E_RANGE);
        CHECK(terrimp_material_masks(&s.tree, w, 3, NAN, masks) == TERRIMP_E_NOT_FINITE);
        CHECK(terrimp_material_masks(&s.tree, w, 3, 1.0f, NULL) == TERRIMP_E_NULL);
        w[2].texels = NULL;
        CHECK(terrimp_material_masks(&s.tree, w, 3, 1.0f, masks) == TERRIMP_E_NULL);
        free(masks);
        visible_free(&s);
    }
    CHECK(set > 1000 && clear > 1000);
}

static void visibility_refuses_what_makes_no_sense(void)
{
    static terrimp_horizon h;
    visible_scene s;
    terrimp_camera c, bad;
    terrimp_geomip_view v;
    terrimp_rect rect;
    terrimp_sets sets;
    static uint8_t codes[25 * 25];
    visible_make(&s, 40, 40, 8);
    c = visible_camera(&s);
    memset(&v, 0, sizeof v);
    CHECK(terrimp_walls_bytes(NULL) == 0);
    CHECK(terrimp_horizon_init(NULL, &s.tree, s.walls) == TERRIMP_E_NULL);
    CHECK(terrimp_horizon_init(&h, NULL, s.walls) == TERRIMP_E_NULL);
    CHECK(terrimp_horizon_init(&h, &s.tree, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_horizon_init(&h, &s.tree, (char *)s.walls + 1) == TERRIMP_E_ALIGN);
    CHECK(terrimp_horizon_init(&h, &s.tree, s.walls) == TERRIMP_OK);
    CHECK(terrimp_horizon_begin(NULL, &c, 0, 0) == TERRIMP_E_NULL);
    CHECK(terrimp_horizon_begin(&h, NULL, 0, 0) == TERRIMP_E_NULL);
    CHECK(terrimp_horizon_begin(&h, &c, 0.6f, 0) == TERRIMP_E_RANGE);
    CHECK(terrimp_horizon_begin(&h, &c, -0.1f, 0) == TERRIMP_E_RANGE);
    CHECK(terrimp_horizon_begin(&h, &c, 0, -1.0f) == TERRIMP_E_RANGE);
    CHECK(terrimp_horizon_begin(&h, &c, 0, NAN) == TERRIMP_E_NOT_FINITE);
    bad = c;
    bad.z_near = 0.0f;
    CHECK(terrimp_horizon_begin(&h, &bad, 0, 0) == TERRIMP_E_RANGE);
    CHECK(terrimp_horizon_cull(&h, &c, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_horizon_cull(&h, &c, &v) == TERRIMP_E_NULL);
    CHECK(terrimp_horizon_begin(&h, &c, 0, 0) == TERRIMP_OK);
    CHECK(!terrimp_horizon_hides(NULL, 0, 0));
    CHECK(!terrimp_horizon_hides(&h, s.tree.node_count, 0));
    CHECK(!terrimp_horizon_hides(&h, 0, NAN));
    CHECK(terrimp_walls_build_node(&s.tree, s.tree.node_count, s.walls) == TERRIMP_E_RANGE);
    CHECK(terrimp_walls_build_node(&s.tree, 0, NULL) == TERRIMP_E_NULL);
    rect.x = rect.y = 0;
    rect.width = 1;
    rect.height = 0;
    CHECK(terrimp_walls_build(&s.tree, &rect, s.walls) == TERRIMP_E_RANGE);
    rect.height = 1;
    rect.x = 40;
    CHECK(terrimp_walls_build(&s.tree, &rect, s.walls) == TERRIMP_E_RANGE);
    CHECK(terrimp_walls_build(NULL, NULL, s.walls) == TERRIMP_E_NULL);
    memset(&sets, 0, sizeof sets);
    CHECK(terrimp_sets_bytes(NULL, &sets) == 0 && terrimp_sets_bytes(&s.tree, NULL) == 0);
    CHECK(terrimp_sets_init(&sets, &s.tree) == TERRIMP_E_NULL);
    CHECK(terrimp_sets_build_cell(&sets, s.walls, 0, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sets_touch(&sets, &rect) == TERRIMP_E_NULL);
    sets.codes = codes;
    sets.cell_level = s.tree.level_count;
    CHECK(terrimp_sets_init(&sets, &s.tree) == TERRIMP_E_RANGE);
    sets.cell_level = 0;
    sets.low = NAN;
    CHECK(terrimp_sets_init(&sets, &s.tree) == TERRIMP_E_NOT_FINITE);
    sets.low = -1.0f;
    CHECK(terrimp_sets_init(&sets, &s.tree) == TERRIMP_E_RANGE);
    sets.low = 0.0f;
    CHECK(terrimp_sets_bytes(&s.tree, &sets) == sizeof codes);
    CHECK(terrimp_sets_init(&sets, &s.tree) == TERRIMP_OK);
    CHECK(terrimp_sets_build_cell(&sets, s.walls, 25, NULL) == TERRIMP_E_RANGE);
    CHECK(terrimp_sets_build_cell(&sets, s.walls, 0, &rect) == TERRIMP_E_RANGE);
    CHECK(terrimp_sets_build_cell(&sets, NULL, 0, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sets_touch(&sets, &rect) == TERRIMP_E_RANGE);
    CHECK(!sets.hider.begin(&sets.hider, &c, 0.01f, 0.0f)); /* drawn farther off than told */
    visible_free(&s);
}

static inline void visibility_tests(void)
{
    RUN(visibility_hides_nothing_that_shows);
    RUN(visible_sets_hide_nothing_that_shows);
    RUN(visible_sets_are_rebuilt_where_samples_change);
    RUN(culled_draws_are_behind_those_that_are_left);
    RUN(walls_are_rebuilt_where_samples_change);
    RUN(visibility_of_a_wall);
    RUN(walkers_on_steep_ground_have_a_horizon);
    RUN(views_leave_out_what_is_hidden);
    RUN(masks_have_the_materials_that_lie_on_a_node);
    RUN(visibility_refuses_what_makes_no_sense);
}

#endif
