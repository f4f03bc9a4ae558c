/* Tests of the Simplifier room: laws over random tiles, checked by brute force. */
#ifndef UNIT_SIMPLIFIER_H
#define UNIT_SIMPLIFIER_H

#include <math.h>
#include <string.h>

enum { SIMP_MAX = TERRIMP_MAX_TILE_DIM, SIMP_SAMPLES = SIMP_MAX * SIMP_MAX };

/* A tile with its borders and its coarse mesh, all owned here. */
typedef struct simp_case {
    uint32_t cols, rows, budget;
    float heights[SIMP_SAMPLES];
    terrimp_border_point points[4][SIMP_MAX];
    terrimp_simplify_desc desc;
    terrimp_mesh mesh;
} simp_case;

/* Fills a tile with one of several kinds of ground. */
static void simp_fill(simp_case *t, uint32_t cols, uint32_t rows, uint32_t kind)
{
    uint32_t x, z;
    float a = random_float(0.02f, 0.2f), b = random_float(0.02f, 0.2f), c = random_float(-9, 9);
    memset(t, 0, sizeof *t);
    t->cols = cols;
    t->rows = rows;
    for (z = 0; z < rows; z++)
        for (x = 0; x < cols; x++) {
            float h = 100.0f * sinf(a * (float)x + c) * cosf(b * (float)z);
            if (kind == 1)
                h = random_float(-50.0f, 50.0f); /* noise */
            if (kind == 2)
                h = floorf(h / 40.0f) * 40.0f; /* terraces: many equal costs */
            if (kind == 3)
                h = c; /* flat */
            if (kind == 4)
                h = x == cols / 2 && z == rows / 2 ? 1000.0f : c; /* one spike */
            if (kind == 5)
                h = c + a * (float)x - b * (float)z; /* a slope */
            if (kind == 6)
                h += random_float(-10.0f, 10.0f);
            t->heights[z * cols + x] = h;
        }
}

enum { SIMP_KINDS = 7 };

/* Sample i of a border, in the order of the polylines. */
static float simp_border_sample(const simp_case *t, int border, uint32_t i)
{
    uint32_t x = border == TERRIMP_SIDE_X0 ? 0 : border == TERRIMP_SIDE_X1 ? t->cols - 1 : i;
    uint32_t z = border == TERRIMP_SIDE_Z0 ? 0 : border == TERRIMP_SIDE_Z1 ? t->rows - 1 : i;
    return t->heights[z * t->cols + x];
}

static void simp_make_borders(simp_case *t, uint32_t inner_limit)
{
    float line[SIMP_MAX];
    int k;
    for (k = 0; k < TERRIMP_SIDE_COUNT; k++) {
        uint32_t i, n = k == TERRIMP_SIDE_Z0 || k == TERRIMP_SIDE_Z1 ? t->cols : t->rows;
        for (i = 0; i < n; i++)
            line[i] = simp_border_sample(t, k, i);
        CHECK(terrimp_border_simplify(line, n, inner_limit, t->points[k], SIMP_MAX,
                                      &t->desc.borders[k].point_count) == TERRIMP_OK);
        t->desc.borders[k].points = t->points[k];
    }
}

/* Simplifies with exactly as much memory as the size functions ask for. */
static terrimp_result simp_run(simp_case *t, uint32_t budget)
{
    size_t bytes = terrimp_simplify_scratch_bytes(t->cols, t->rows, budget);
    void *scratch = malloc(bytes);
    terrimp_result result;
    t->desc.heights = t->heights;
    t->desc.cols = t->cols;
    t->desc.rows = t->rows;
    t->desc.triangle_budget = budget;
    t->budget = budget ? budget : TERRIMP_TRIANGLE_BUDGET;
    CHECK(terrimp_mesh_capacity(budget, &t->mesh.vertex_capacity, &t->mesh.index_capacity) ==
          TERRIMP_OK);
    t->mesh.vertices = (terrimp_mesh_vertex *)malloc(t->mesh.vertex_capacity *
                                                     sizeof *t->mesh.vertices);
    t->mesh.indices = (uint16_t *)malloc(t->mesh.index_capacity * sizeof *t->mesh.indices);
    result = terrimp_simplify(&t->desc, scratch, bytes, &t->mesh);
    free(scratch);
    return result;
}

static void simp_free(simp_case *t)
{
    free(t->mesh.vertices);
    free(t->mesh.indices);
}

/* Twice the area of a surface triangle in the grid, positive when it faces up. */
static int simp_area(const terrimp_mesh *m, uint32_t t)
{
    const terrimp_mesh_vertex *a = m->vertices + m->indices[t];
    const terrimp_mesh_vertex *b = m->vertices + m->indices[t + 1];
    const terrimp_mesh_vertex *c = m->vertices + m->indices[t + 2];
    return (b->z - a->z) * (c->x - a->x) - (b->x - a->x) * (c->z - a->z);
}

/* Is the cover one to one? All triangles face up, their areas add up to the rectangle, every edge
   is used once in each direction but for the loop, whose edges are used once. */
static int simp_covers(const simp_case *t)
{
    const terrimp_mesh *m = &t->mesh;
    uint32_t i, j, n = m->surface_index_count, open = 0;
    int area = 0;
    for (i = 0; i < n; i += 3) {
        if (simp_area(m, i) <= 0)
            return 0;
        area += simp_area(m, i);
    }
    if (area != 2 * (int)((t->cols - 1) * (t->rows - 1)))
        return 0;
    for (i = 0; i < n; i++) {
        uint16_t a = m->indices[i], b = m->indices[i % 3 == 2 ? i - 2 : i + 1];
        uint32_t same = 0, opposite = 0;
        for (j = 0; j < n; j++) {
            uint16_t c = m->indices[j], d = m->indices[j % 3 == 2 ? j - 2 : j + 1];
            same += a == c && b == d;
            opposite += a == d && b == c;
        }
        if (same != 1 || opposite > 1)
            return 0;
        if (!opposite) {
            open++;
            if (b != (a + 1) % m->border_vertex_count || a >= m->border_vertex_count)
                return 0;
        }
    }
    return open == m->border_vertex_count;
}

/* Errors of all samples, each against any triangle that holds it, in double precision. */
static void simp_brute_errors(const simp_case *t, double *above, double *below, double *rms)
{
    const terrimp_mesh *m = &t->mesh;
    uint32_t x, z, i;
    double squares = 0.0;
    *above = *below = 0.0;
    for (z = 0; z < t->rows; z++)
        for (x = 0; x < t->cols; x++) {
            int found = 0;
            for (i = 0; i < m->surface_index_count && !found; i += 3) {
                const terrimp_mesh_vertex *a = m->vertices + m->indices[i];
                const terrimp_mesh_vertex *b = m->vertices + m->indices[i + 1];
                const terrimp_mesh_vertex *c = m->vertices + m->indices[i + 2];
                int px = (int)x - a->x, pz = (int)z - a->z, d = simp_area(m, i);
                int u = pz * (c->x - a->x) - px * (c->z - a->z);
                int v = (b->z - a->z) * px - (b->x - a->x) * pz;
                if (u >= 0 && v >= 0 && u + v <= d) {
                    double base = (double)a->height;
                    double h = base + ((double)u * ((double)b->height - base) +
                                       (double)v * ((double)c->height - base)) / d;
                    double e = (double)t->heights[z * t->cols + x] - h;
                    found = 1;
                    *above = e > *above ? e : *above;
                    *below = -e > *below ? -e : *below;
                    squares += e * e;
                }
            }
            CHECK(found);
        }
    *rms = sqrt(squares / (double)(t->cols * t->rows));
}

static simp_case simp_a, simp_b;

static double simp_above(const simp_case *t)
{
    double above, below, rms;
    simp_brute_errors(t, &above, &below, &rms);
    return above;
}

static double simp_rms(const simp_case *t)
{
    double above, below, rms;
    simp_brute_errors(t, &above, &below, &rms);
    return rms;
}

static void coarse_mesh_covers_the_tile_one_to_one_within_budget(void)
{
    int round;
    for (round = 0; round < 60; round++) {
        uint32_t cols = random_range(2, 40), rows = random_range(2, 40), most, border;
        simp_case *t = &simp_a;
        simp_fill(t, cols, rows, (uint32_t)round % SIMP_KINDS);
        simp_make_borders(t, random_range(1, 6));
        most = 2 * (cols - 1) * (rows - 1);
        CHECK(simp_run(t, random_range(26, 120)) == TERRIMP_OK);
        CHECK(simp_covers(t));
        border = t->mesh.border_vertex_count;
        CHECK(t->mesh.surface_index_count <= 3 * t->budget);
        CHECK(t->mesh.surface_index_count == 3 * (2 * t->mesh.vertex_count - border - 2));
        if (most > 2 * t->budget && cols > 16 && rows > 16 && round % SIMP_KINDS < 3)
            CHECK(t->mesh.surface_index_count / 3 + 1 >= t->budget);
        simp_free(t);
    }
}

static void tightest_budget_leaves_no_inner_vertex(void)
{
    int round;
    for (round = 0; round < 60; round++) {
        simp_case *t = &simp_a;
        int k;
        uint32_t border = 0;
        simp_fill(t, random_range(3, 30), random_range(3, 30), (uint32_t)round % SIMP_KINDS);
        simp_make_borders(t, random_range(1, 30));
        for (k = 0; k < 4; k++)
            border += t->desc.borders[k].point_count - 1;
        CHECK(simp_run(t, border - 2) == TERRIMP_OK);
        CHECK(simp_covers(t));
        CHECK(t->mesh.vertex_count == border && t->mesh.surface_index_count == 3 * (border - 2));
        simp_free(t);
        if (border > 4)
            CHECK(simp_run(t, border - 3 > 1 ? border - 3 : 2) == TERRIMP_E_RANGE);
        simp_free(t);
    }
}

static void tiles_of_all_shapes_simplify(void)
{
    static const uint32_t size[][2] = {{2, 2}, {2, 65}, {65, 2}, {3, 3}, {3, 257}, {257, 3},
                                       {49, 65}, {257, 257}, {2, 257}, {4, 100}};
    size_t i;
    for (i = 0; i < sizeof size / sizeof *size; i++) {
        simp_case *t = &simp_a;
        simp_fill(t, size[i][0], size[i][1], (uint32_t)i % SIMP_KINDS);
        simp_make_borders(t, 0);
        CHECK(simp_run(t, 0) == TERRIMP_OK);
        CHECK(simp_covers(t));
        simp_free(t);
    }
}

static void small_tile_returns_every_sample(void)
{
    int round;
    for (round = 0; round < 12; round++) {
        simp_case *t = &simp_a;
        uint32_t i;
        simp_fill(t, random_range(2, 7), random_range(2, 7), 1);
        simp_make_borders(t, 8);
        CHECK(simp_run(t, 85) == TERRIMP_OK);
        CHECK(t->mesh.vertex_count == t->cols * t->rows);
        CHECK(simp_covers(t));
        CHECK(simp_rms(t) < 1e-5);
        for (i = 0; i < t->mesh.vertex_count; i++) {
            const terrimp_mesh_vertex *v = t->mesh.vertices + i;
            CHECK(memcmp(&v->height, &t->heights[v->z * t->cols + v->x], sizeof(float)) == 0);
        }
        simp_free(t);
    }
}

static void flat_and_sloping_ground_has_no_error(void)
{
    uint32_t kind;
    for (kind = 3; kind <= 5; kind += 2) {
        simp_case *t = &simp_a;
        simp_fill(t, 65, 65, kind);
        simp_make_borders(t, 0);
        CHECK(simp_run(t, 0) == TERRIMP_OK);
        CHECK(simp_covers(t));
        CHECK(simp_rms(t) < 0.01);
        simp_free(t);
    }
}

/* The quality of every stage together, on ground that is the same on all machines. */
static void rough_ground_is_met_closely(void)
{
    double rms = 0.0;
    int round;
    for (round = 0; round < 6; round++) {
        simp_case *t = &simp_a;
        uint32_t x, z;
        simp_fill(t, 65, 65, 3);
        for (z = 0; z < 65; z++)
            for (x = 0; x < 65; x++) {
                float u = (float)x - 7.0f * (float)round, v = (float)z + 3.0f * (float)round;
                float ridge = fabsf(sinf(0.09f * u + 0.05f * v) + 0.4f * cosf(0.21f * v));
                t->heights[z * 65 + x] = 60.0f * ridge + 20.0f * sinf(0.3f * u) * cosf(0.17f * v);
            }
        simp_make_borders(t, 0);
        CHECK(simp_run(t, 0) == TERRIMP_OK);
        rms += simp_rms(t) / 6.0;
        simp_free(t);
    }
    CHECK(rms < 4.05); /* 3.88; without flips 4.15, without moves 4.7 */
}

static void lone_spike_survives(void)
{
    simp_case *t = &simp_a;
    simp_fill(t, 65, 65, 4);
    simp_make_borders(t, 0);
    CHECK(simp_run(t, 0) == TERRIMP_OK);
    CHECK(simp_covers(t));
    CHECK(simp_above(t) < 500.0);
    simp_free(t);
}

static void neighbours_share_their_border_bit_for_bit(void)
{
    int round;
    for (round = 0; round < 8; round++) {
        simp_case *p = &simp_a, *q = &simp_b;
        uint32_t z, i, shared = 0;
        simp_fill(p, 33, 33, 6);
        simp_fill(q, 33, 33, 6);
        for (z = 0; z < 33; z++)
            q->heights[z * 33] = p->heights[z * 33 + 32];
        simp_make_borders(p, 0);
        simp_make_borders(q, 0);
        CHECK(simp_run(p, 0) == TERRIMP_OK && simp_run(q, 0) == TERRIMP_OK);
        for (i = 0; i < p->mesh.border_vertex_count; i++) {
            const terrimp_mesh_vertex *v = p->mesh.vertices + i;
            for (z = 0; v->x == 32 && z < q->mesh.border_vertex_count; z++) {
                const terrimp_mesh_vertex *w = q->mesh.vertices + z;
                if (w->x == 0 && w->z == v->z)
                    shared += memcmp(&w->height, &v->height, sizeof v->height) == 0;
            }
        }
        CHECK(shared == p->desc.borders[TERRIMP_SIDE_X1].point_count);
        CHECK(shared == q->desc.borders[TERRIMP_SIDE_X0].point_count);
        simp_free(p);
        simp_free(q);
    }
}

static void same_input_gives_the_same_mesh(void)
{
    simp_case *p = &simp_a, *q = &simp_b;
    simp_fill(p, 65, 49, 6);
    simp_make_borders(p, 0);
    *q = *p;
    simp_make_borders(q, 0);
    CHECK(simp_run(p, 0) == TERRIMP_OK && simp_run(q, 0) == TERRIMP_OK);
    CHECK(p->mesh.index_count == q->mesh.index_count);
    CHECK(memcmp(p->mesh.indices, q->mesh.indices, 2 * p->mesh.index_count) == 0);
    CHECK(memcmp(p->mesh.vertices, q->mesh.vertices, 8 * p->mesh.vertex_count) == 0);
    simp_free(p);
    simp_free(q);
}

static void border_keeps_its_ends_rises_and_beats_straight_lines(void)
{
    int round;
    for (round = 0; round < 200; round++) {
        float h[SIMP_MAX];
        terrimp_border_point p[SIMP_MAX];
        uint32_t n = random_range(2, 90), limit = random_range(1, 8), count = 0, i, k;
        double error = 0.0, straight = 0.0;
        float a = random_float(0.05f, 0.3f);
        for (i = 0; i < n; i++)
            h[i] = 30.0f * sinf(a * (float)i) + random_float(-3.0f, 3.0f);
        CHECK(terrimp_border_simplify(h, n, limit, p, SIMP_MAX, &count) == TERRIMP_OK);
        CHECK(count == (n < limit + 2 ? n : limit + 2));
        CHECK(p[0].at == 0 && p[count - 1].at == n - 1);
        CHECK(memcmp(&p[0].height, h, 4) == 0 && memcmp(&p[count - 1].height, h + n - 1, 4) == 0);
        for (i = 0; i + 1 < count; i++) {
            CHECK(p[i].at < p[i + 1].at);
            for (k = p[i].at; k < p[i + 1].at; k++) {
                float s = (float)(k - p[i].at) / (float)(p[i + 1].at - p[i].at);
                float e = h[k] - p[i].height - s * (p[i + 1].height - p[i].height);
                error += (double)e * (double)e;
            }
        }
        for (k = 0; k < n; k++) {
            float e = h[k] - h[0] - (float)k / (float)(n - 1) * (h[n - 1] - h[0]);
            straight += (double)e * (double)e;
        }
        CHECK(error <= straight * 1.0001 + 1e-3);
    }
}

static void skirts_are_closed_walls_that_face_the_right_way(void)
{
    simp_case *t = &simp_a;
    terrimp_mesh *m = &t->mesh;
    uint32_t n, i, first;
    simp_fill(t, 33, 21, 6);
    simp_make_borders(t, 0);
    CHECK(simp_run(t, 0) == TERRIMP_OK);
    n = m->border_vertex_count;
    CHECK(terrimp_mesh_add_skirt(m, 0, -500.0f) == TERRIMP_OK);
    CHECK(terrimp_mesh_add_skirt(m, 1, 7.0f) == TERRIMP_OK);
    CHECK(m->vertex_count == m->surface_vertex_count + 2 * n);
    CHECK(m->index_count == m->surface_index_count + 2 * 6 * n);
    first = m->surface_index_count;
    for (i = first; i < m->index_count; i += 3) {
        const terrimp_mesh_vertex *a = m->vertices + m->indices[i];
        const terrimp_mesh_vertex *b = m->vertices + m->indices[i + 1];
        const terrimp_mesh_vertex *c = m->vertices + m->indices[i + 2];
        float ux = (float)(b->x - a->x), uy = b->height - a->height, uz = (float)(b->z - a->z);
        float vx = (float)(c->x - a->x), vy = c->height - a->height, vz = (float)(c->z - a->z);
        float nx = uy * vz - uz * vy, nz = ux * vy - uy * vx;
        float out = nx * ((float)a->x - 16.0f) + nz * ((float)a->z - 10.0f);
        CHECK(i < first + 6 * n ? out > 0.0f : out < 0.0f);
    }
    for (i = 0; i < n; i++) {
        const terrimp_mesh_vertex *low = m->vertices + m->surface_vertex_count + i;
        CHECK(low->x == m->vertices[i].x && low->z == m->vertices[i].z && low->height == -500.0f);
        CHECK(low[n].height == terrimpi_float(m->vertices[i].height + 7.0f));
    }
    m->vertex_capacity = m->vertex_count + n - 1;
    CHECK(terrimp_mesh_add_skirt(m, 1, 7.0f) == TERRIMP_E_CAPACITY);
    simp_free(t);
}

/* Raises the mesh of a case as those of terrains are; work has the raise of each vertex then. */
static void simp_raise(simp_case *t, float amount, float *work)
{
    terrimp_heightfield field;
    terrimpi_terrain_tile p;
    terrimpi_build build;
    uint32_t budget = t->mesh.surface_index_count / 3u;
    size_t bytes = terrimpi_build_layout_tile(t->cols, t->rows, TERRIMP_MAX_TILE_DIM, budget, NULL,
                                              &build);
    void *scratch = malloc(bytes);
    terrimpi_build_layout_tile(t->cols, t->rows, TERRIMP_MAX_TILE_DIM, budget, scratch, &build);
    memset(&field, 0, sizeof field);
    field.samples = t->heights;
    field.width = t->cols;
    field.depth = t->rows;
    CHECK(terrimp_heightfield_resolve(&field, &field) == TERRIMP_OK);
    memset(&p, 0, sizeof p);
    p.cols = t->cols;
    p.rows = t->rows;
    p.span_x = p.cols - 1u;
    p.span_z = p.rows - 1u;
    terrimpi_build_raise(&field, &p, amount, &t->mesh, &build);
    memcpy(work, build.work, t->mesh.surface_vertex_count * sizeof *work);
    free(scratch);
}

/* Is every sample under the raised surface, but for those whose weight hangs by more than half on
   border vertices? Samples of the border have no such excuse but beside corners. */
static int simp_hidden(const simp_case *t)
{
    const terrimp_mesh *m = &t->mesh;
    uint32_t x, z, i;
    for (z = 0; z < t->rows; z++)
        for (x = 0; x < t->cols; x++)
            for (i = 0; i < m->surface_index_count; i += 3) {
                int on_border = x == 0 || z == 0 || x == t->cols - 1 || z == t->rows - 1, k;
                const terrimp_mesh_vertex *a = m->vertices + m->indices[i];
                const terrimp_mesh_vertex *b = m->vertices + m->indices[i + 1];
                const terrimp_mesh_vertex *c = m->vertices + m->indices[i + 2];
                int px = (int)x - a->x, pz = (int)z - a->z, d = simp_area(m, i);
                int u = pz * (c->x - a->x) - px * (c->z - a->z);
                int v = (b->z - a->z) * px - (b->x - a->x) * pz;
                float w[3], hold = 0.0f, h;
                if (u < 0 || v < 0 || u + v > d)
                    continue;
                w[1] = (float)u / (float)d;
                w[2] = (float)v / (float)d;
                w[0] = 1.0f - w[1] - w[2];
                for (k = 0; k < 3; k++) {
                    uint32_t at = m->indices[i + (uint32_t)k];
                    const terrimp_mesh_vertex *p = m->vertices + at;
                    int corner = (p->x == 0 || p->x == t->cols - 1) &&
                                 (p->z == 0 || p->z == t->rows - 1);
                    hold += (on_border ? !corner : at >= m->border_vertex_count) ? w[k] : 0.0f;
                }
                h = w[0] * a->height + w[1] * b->height + w[2] * c->height;
                if (hold > 0.501f && t->heights[z * t->cols + x] > h + 2e-3f)
                    return 0;
            }
    return 1;
}

static void raised_mesh_hides_the_terrain(void)
{
    static float work[2 * 1000];
    int round;
    for (round = 0; round < 12; round++) {
        simp_case *t = &simp_a;
        double before;
        float height0;
        simp_fill(t, random_range(12, 65), random_range(12, 65), (uint32_t)round % SIMP_KINDS);
        simp_make_borders(t, 0);
        CHECK(simp_run(t, 0) == TERRIMP_OK);
        before = simp_above(t);
        height0 = t->mesh.vertices[t->mesh.vertex_count - 1].height;
        simp_raise(t, 0.0f, work);
        CHECK(simp_above(t) == before);
        CHECK(t->mesh.vertices[t->mesh.vertex_count - 1].height == height0);
        simp_raise(t, 1.0f, work);
        CHECK(simp_above(t) <= before + 4e-3); /* two last places of such heights */
        CHECK(simp_hidden(t));
        CHECK(simp_covers(t));
        simp_free(t);
    }
}

static void raised_neighbours_still_meet(void)
{
    static float work[2 * 1000];
    int round;
    for (round = 0; round < 6; round++) {
        simp_case *p = &simp_a, *q = &simp_b;
        uint32_t x, i, k, shared = 0;
        simp_fill(p, 65, 33, 6);
        simp_fill(q, 65, 49, 6);
        for (x = 0; x < 65; x++)
            q->heights[x] = p->heights[32 * 65 + x];
        simp_make_borders(p, 0);
        simp_make_borders(q, 0);
        CHECK(simp_run(p, 0) == TERRIMP_OK && simp_run(q, 0) == TERRIMP_OK);
        simp_raise(p, 0.7f, work);
        simp_raise(q, 0.7f, work);
        for (i = 0; i < p->mesh.border_vertex_count; i++)
            for (k = 0; k < q->mesh.border_vertex_count; k++) {
                const terrimp_mesh_vertex *v = p->mesh.vertices + i, *w = q->mesh.vertices + k;
                if (v->z == 32 && w->z == 0 && v->x == w->x)
                    shared += memcmp(&v->height, &w->height, sizeof v->height) == 0;
            }
        CHECK(shared == p->desc.borders[TERRIMP_SIDE_Z1].point_count);
        simp_free(p);
        simp_free(q);
    }
}

static void simplifier_refuses_bad_input(void)
{
    simp_case *t = &simp_a;
    static int64_t scratch[200000];
    terrimp_mesh untouched;
    terrimp_simplify_desc d;
    terrimp_border_point p[8];
    float h[4] = {0.0f, 1.0f, NAN, 2.0f};
    uint32_t count = 77, v = 5, i = 5;
    simp_fill(t, 17, 17, 6);
    simp_make_borders(t, 0);
    CHECK(simp_run(t, 0) == TERRIMP_OK);
    memcpy(&untouched, &t->mesh, sizeof untouched);
    CHECK(terrimp_simplify(NULL, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_NULL);
    CHECK(terrimp_simplify(&t->desc, NULL, sizeof scratch, &t->mesh) == TERRIMP_E_NULL);
    CHECK(terrimp_simplify(&t->desc, scratch, sizeof scratch, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_simplify(&t->desc, scratch, 100, &t->mesh) == TERRIMP_E_MEMORY);
    CHECK(terrimp_simplify(&t->desc, (char *)scratch + 4, sizeof scratch - 4, &t->mesh) ==
          TERRIMP_E_ALIGN);
    d = t->desc, d.cols = 1;
    CHECK(terrimp_simplify(&d, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_RANGE);
    d = t->desc, d.rows = 100000;
    CHECK(terrimp_simplify(&d, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_RANGE);
    d = t->desc, d.triangle_budget = 1000000;
    CHECK(terrimp_simplify(&d, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_RANGE);
    d = t->desc, d.triangle_budget = 3;
    CHECK(terrimp_simplify(&d, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_RANGE);
    d = t->desc, d.heights = NULL;
    CHECK(terrimp_simplify(&d, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_NULL);
    d = t->desc, d.borders[2].points = NULL;
    CHECK(terrimp_simplify(&d, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_NULL);
    d = t->desc, d.borders[2].point_count--;
    CHECK(terrimp_simplify(&d, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_RANGE);
    t->points[0][0].height += 1.0f;
    CHECK(terrimp_simplify(&t->desc, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_RANGE);
    t->points[0][0].height = NAN;
    CHECK(terrimp_simplify(&t->desc, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_NOT_FINITE);
    t->points[0][0].height = t->heights[0];
    t->heights[40] = NAN;
    CHECK(terrimp_simplify(&t->desc, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_NOT_FINITE);
    t->heights[40] = INFINITY;
    CHECK(terrimp_simplify(&t->desc, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_NOT_FINITE);
    t->heights[40] = 0.0f;
    t->mesh.vertex_capacity = 20;
    CHECK(terrimp_simplify(&t->desc, scratch, sizeof scratch, &t->mesh) == TERRIMP_E_CAPACITY);
    t->mesh.vertex_capacity = untouched.vertex_capacity;
    CHECK(memcmp(&untouched, &t->mesh, sizeof untouched) == 0);

    CHECK(terrimp_simplify_scratch_bytes(1, 5, 0) == 0);
    CHECK(terrimp_simplify_scratch_bytes(5, 0xffffffffu, 0) == 0);
    CHECK(terrimp_simplify_scratch_bytes(5, 5, 0xffffffffu) == 0);
    CHECK(terrimp_mesh_capacity(0, NULL, &i) == TERRIMP_E_NULL);
    CHECK(terrimp_mesh_capacity(0xffffffffu, &v, &i) == TERRIMP_E_RANGE && v == 5 && i == 5);
    CHECK(terrimp_border_simplify(NULL, 4, 0, p, 8, &count) == TERRIMP_E_NULL);
    CHECK(terrimp_border_simplify(h, 4, 0, p, 8, &count) == TERRIMP_E_NOT_FINITE);
    CHECK(terrimp_border_simplify(h, 1, 0, p, 8, &count) == TERRIMP_E_RANGE);
    CHECK(terrimp_border_simplify(h, 2, 0, p, 1, &count) == TERRIMP_E_CAPACITY && count == 77);
    {
        terrimp_mesh none;
        memset(&none, 0, sizeof none);
        CHECK(terrimp_mesh_add_skirt(NULL, 0, 0.0f) == TERRIMP_E_NULL);
        CHECK(terrimp_mesh_add_skirt(&none, 0, 0.0f) == TERRIMP_E_NULL);
        CHECK(terrimp_mesh_add_skirt(&t->mesh, 0, NAN) == TERRIMP_E_NOT_FINITE);
        CHECK(terrimp_mesh_add_skirt(&t->mesh, 1, -1.0f) == TERRIMP_E_RANGE);
        none.vertices = t->mesh.vertices;
        none.indices = t->mesh.indices;
        CHECK(terrimp_mesh_add_skirt(&none, 1, 1.0f) == TERRIMP_E_STATE);
    }
    simp_free(t);
}

/* One call gives what the steps give: neighbours meet, the error is that of brute force and keeps
   to the one that is asked for with fewer triangles than the budget, and voids are refused. */
static void a_rectangle_of_a_field_simplifies_by_one_call(void)
{
    static simp_case t, whole;
    int i;
    for (i = 0; i < 24; i++) {
        terrimp_heightfield field;
        terrimp_rect rect[2];
        uint32_t budget = i % 4 == 0 ? 0 : random_range(40, 700), side, k, spent = 0;
        float found = -1.0f, loose, edge[2][200];
        memset(edge, 0, sizeof edge);
        simp_fill(&whole, random_range(70, 120), random_range(20, 60), (uint32_t)i % 3u * 3u);
        memset(&field, 0, sizeof field);
        field.samples = whole.heights;
        field.width = whole.cols;
        field.depth = whole.rows;
        rect[0].x = rect[0].y = rect[1].y = 0;
        rect[0].width = rect[1].x = random_range(20, 50);
        rect[0].width++; /* they share a column */
        rect[1].width = random_range(2, whole.cols - rect[1].x);
        rect[0].height = rect[1].height = random_range(4, whole.rows);
        for (side = 0; side < 2u; side++) {
            size_t bytes = terrimp_simplify_field_scratch_bytes(rect[side].width,
                                                                rect[side].height, budget);
            void *scratch = malloc(bytes);
            double above, below, rms;
            memset(&t, 0, sizeof t);
            t.cols = rect[side].width;
            t.rows = rect[side].height;
            CHECK(terrimp_heightfield_read(&field, rect[side].x, 0, t.cols, t.rows, 1,
                                           t.heights) == TERRIMP_OK);
            CHECK(terrimp_mesh_capacity(budget, &t.mesh.vertex_capacity,
                                        &t.mesh.index_capacity) == TERRIMP_OK);
            t.mesh.vertices = (terrimp_mesh_vertex *)malloc(t.mesh.vertex_capacity *
                                                            sizeof *t.mesh.vertices);
            t.mesh.indices = (uint16_t *)malloc(t.mesh.index_capacity * sizeof *t.mesh.indices);
            CHECK(terrimp_simplify_field(&field, &rect[side], budget, 0.0f, scratch, bytes,
                                         &t.mesh, &found) == TERRIMP_OK);
            simp_brute_errors(&t, &above, &below, &rms);
            CHECK(fabs((double)found - fmax(above, below)) <= 1e-4 * (double)found + 1e-4);
            CHECK(simp_covers(&t));
            spent = t.mesh.surface_index_count;
            for (k = 0; k < t.mesh.border_vertex_count; k++) {
                const terrimp_mesh_vertex *v = &t.mesh.vertices[k];
                if (v->x == (side ? 0 : t.cols - 1u))
                    edge[side][v->z] = v->height;
            }
            loose = 2.0f * found + 0.5f;
            CHECK(terrimp_simplify_field(&field, &rect[side], budget, loose, scratch, bytes,
                                         &t.mesh, &found) == TERRIMP_OK);
            CHECK(found <= loose && t.mesh.surface_index_count <= spent);
            simp_brute_errors(&t, &above, &below, &rms);
            CHECK(fmax(above, below) <= (double)loose * 1.0001 + 1e-4);
            field.has_no_data = 1;
            field.no_data = t.heights[t.cols + 1u];
            CHECK(terrimp_simplify_field(&field, &rect[side], budget, 0.0f, scratch, bytes,
                                         &t.mesh, NULL) == TERRIMP_E_VOID);
            field.has_no_data = 0;
            CHECK(terrimp_simplify_field(&field, &rect[side], 5, 0.0f, scratch, bytes, &t.mesh,
                                         NULL) == TERRIMP_E_RANGE);
            CHECK(terrimp_simplify_field(&field, &rect[side], budget, 0.0f, scratch, bytes - 1u,
                                         &t.mesh, NULL) == TERRIMP_E_MEMORY);
            free(scratch);
            simp_free(&t);
        }
        CHECK(memcmp(edge[0], edge[1], sizeof edge[0]) == 0);
        rect[1].width = whole.cols + 1u;
        CHECK(terrimp_simplify_field(&field, &rect[1], budget, 0.0f, edge, sizeof edge, &t.mesh,
                                     NULL) == TERRIMP_E_RANGE);
    }
}

static inline void simplifier_tests(void)
{
    RUN(a_rectangle_of_a_field_simplifies_by_one_call);
    RUN(border_keeps_its_ends_rises_and_beats_straight_lines);
    RUN(coarse_mesh_covers_the_tile_one_to_one_within_budget);
    RUN(tightest_budget_leaves_no_inner_vertex);
    RUN(tiles_of_all_shapes_simplify);
    RUN(small_tile_returns_every_sample);
    RUN(flat_and_sloping_ground_has_no_error);
    RUN(rough_ground_is_met_closely);
    RUN(lone_spike_survives);
    RUN(neighbours_share_their_border_bit_for_bit);
    RUN(same_input_gives_the_same_mesh);
    RUN(skirts_are_closed_walls_that_face_the_right_way);
    RUN(raised_mesh_hides_the_terrain);
    RUN(raised_neighbours_still_meet);
    RUN(simplifier_refuses_bad_input);
}

#endif
