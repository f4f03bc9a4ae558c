/* Shows what stands on terrain as pictures that are made once: a town and a wood round it, a
   million triangles, for a flight along one side. Which pictures, for which stretch of the flight,
   is placed for a budget of triangles a frame. Woods become layers, houses depth meshes, in one
   atlas: host/gl_layers.c makes them, after plans of this file.
   Build:  make town
   Use:    build/town [budget [trees of a plot]]   (150000 triangles and 105 trees)
   Expect: 25 frames, every sixth beside all triangles, the last ones in town.png and town_full.png.
           Exit code 1 when one costs more than the budget, or 10 pixels are holes. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "host/context.h"
#include "host/gl_layers.h"
#include "host/image.h"
#include "host/procedural.h"
#include "host/quality.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { WIDTH = 640, HEIGHT = 480, FRAMES = 25, SIDE = 193, GROUND = 2 * (SIDE - 1) * (SIDE - 1) };
enum { PLOTS = 64, CLUSTERS = 85, CELLS = 8, SQUARES = 15, HOUSES = 12 };
enum { CANDIDATES = CLUSTERS * SQUARES, GAINS = CLUSTERS * 4 * CELLS };
enum { PICTURE = 1024, ATLAS = 4096, TREE = 200, HOUSE = 136, CORNERS = 3 * (TREE + HOUSE) };

static float plot = 32.0f; /* [wu] */
static const float cell = 16.0f, path_x = 64.0f, path_z = -76.0f, deep = 8.0f;
static const uint8_t sky[3] = { 168, 199, 232 };

/* A picture that was chosen: of a cluster, for the cells of a square. */
typedef struct picture {
    uint32_t cluster, square;
    gl_layers_picture made;
} picture;

static terrimp_heightfield field;
static float places[PLOTS * 4096][5];       /* x, y, z, size, turn of each tree and house */
static uint32_t first_of[2 * PLOTS + 1];    /* houses of a plot, then its trees */
static terrimp_box boxes[CLUSTERS];
static uint32_t parents[CLUSTERS], triangles[CLUSTERS];
static picture pictures[CANDIDATES];
static terrimp_place_candidate candidates[CANDIDATES];
static terrimp_place_gain gains[GAINS];
static uint8_t shown[GAINS], ours[WIDTH * HEIGHT * 3], full[WIDTH * HEIGHT * 3];
static float costs[CELLS], left[CELLS], pixel_factor;
static terrimp_camera camera;
static gl_program things;
static gl_layers atlas;
static GLuint ground_array, things_array, models, instances;

static float chance(void)
{
    static uint32_t seed = 2463534242u;
    seed ^= seed << 13, seed ^= seed >> 17, seed ^= seed << 5;
    return (float)(seed >> 8) * (1.0f / 16777216.0f);
}

static void need(int result)
{
    if (result)
        fprintf(stderr, "%s\n", terrimp_result_text(result)), exit(2);
}

/* ---- The town ----------------------------------------------------------- */

static float *corner(float *out, float x, float y, float z, float r, float g, float b)
{
    out[0] = x, out[1] = y, out[2] = z, out[3] = r, out[4] = g, out[5] = b;
    return out + 6;
}

/* Two triangles with the corners at + u, at + v: at, u, v are points and ways. */
static float *quad(float *out, const float at[3], const float u[3], const float v[3], float tone,
                   const float rgb[3])
{
    static const int order[6][2] = { { 0, 0 }, { 1, 0 }, { 1, 1 }, { 0, 0 }, { 1, 1 }, { 0, 1 } };
    int i;
    for (i = 0; i < 6; i++) {
        float s = (float)order[i][0], t = (float)order[i][1];
        out = corner(out, at[0] + s * u[0] + t * v[0], at[1] + s * u[1] + t * v[1],
                     at[2] + s * u[2] + t * v[2], tone * rgb[0], tone * rgb[1], tone * rgb[2]);
    }
    return out;
}

/* A box of four sides, an upper and, for tone, different light on each. */
static float *box(float *out, float x0, float y0, float z0, float x1, float y1, float z1,
                  const float rgb[3])
{
    float u[3] = { x1 - x0, 0, 0 }, v[3] = { 0, y1 - y0, 0 }, w[3] = { 0, 0, z1 - z0 };
    float a[3] = { x0, y0, z0 }, b[3] = { x1, y0, z0 };
    float c[3] = { x0, y0, z1 }, d[3] = { x0, y1, z0 };
    out = quad(out, a, u, v, 0.8f, rgb);
    out = quad(out, c, u, v, 0.7f, rgb);
    out = quad(out, a, w, v, 0.6f, rgb);
    out = quad(out, b, w, v, 0.9f, rgb);
    return quad(out, d, u, w, 1.0f, rgb);
}

/* A tree of a trunk and 98 leaves, and a house with 12 windows, each about 1 high. */
static void make_models(float *out)
{
    static const float bark[3] = { 0.35f, 0.26f, 0.18f }, green[3] = { 0.32f, 0.5f, 0.2f };
    static const float wall[3] = { 0.85f, 0.78f, 0.66f }, tile[3] = { 0.7f, 0.3f, 0.2f };
    static const float glass[3] = { 0.25f, 0.3f, 0.4f };
    float *begin = out, roof[4][3] = { { -.5f, .6f, -.5f }, { .5f, 0, 0 }, { 0, .4f, .5f } };
    int i, k;
    float u[3] = { 0.04f, 0, 0 }, v[3] = { 0, 0.6f, 0 }, at[3] = { -0.02f, 0, 0 };
    out = quad(out, at, u, v, 1.0f, bark);
    at[0] = 0, at[2] = -0.02f, u[0] = 0, u[2] = 0.04f;
    out = quad(out, at, u, v, 0.7f, bark);
    for (i = 0; i < 98; i++) {
        float way[3], size = 0.09f;
        for (k = 0; k < 3; k++) {
            way[k] = chance() - 0.5f, u[k] = size * (chance() - 0.5f) * 2.0f;
            v[k] = size * (chance() - 0.5f) * 2.0f;
        }
        for (k = 0; k < 3; k++)
            at[k] = way[k] * (k == 1 ? 0.75f : 0.55f) + (k == 1 ? 0.62f : 0.0f);
        out = quad(out, at, u, v, 0.6f + 0.9f * (at[1] - 0.3f) * chance(), green);
    }
    out = box(out, -0.5f, -0.3f, -0.5f, 0.5f, 0.6f, 0.5f, wall);
    for (i = 0; i < 12; i++) {
        float x = -0.4f + 0.3f * (float)(i % 3), y = i / 6 ? 0.35f : 0.05f;
        float z = i / 3 % 2 ? 0.5f : -0.52f;
        out = box(out, x, y, z, x + 0.15f, y + 0.15f, z + 0.02f, glass);
    }
    roof[1][0] = 1;
    out = quad(out, roof[0], roof[1], roof[2], 0.9f, tile);
    roof[0][2] = 0.5f, roof[2][2] = -0.5f;
    out = quad(out, roof[0], roof[1], roof[2], 0.7f, tile);
    for (i = 0; i < 2; i++) {
        float x = i ? 0.5f : -0.5f;
        out = corner(out, x, 0.6f, -0.5f, .6f, .55f, .5f);
        out = corner(out, x, 0.6f, 0.5f, .6f, .55f, .5f);
        out = corner(out, x, 1.0f, 0.0f, .6f, .55f, .5f);
    }
    while (out < begin + 6 * CORNERS)
        *out++ = 0.0f;
}

/* What stands on a plot; houses in the middle of town. */
static void build_plot(uint32_t p, uint32_t trees, uint32_t *count)
{
    float x0 = plot * (float)(p % 8), z0 = plot * (float)(p / 8);
    int town = p % 8 > 1 && p % 8 < 6 && p / 8 > 1 && p / 8 < 6;
    uint32_t i, houses = town ? HOUSES : 0;
    trees = town ? 0 : trees;
    for (i = 0; i < houses + trees; i++) {
        float *at = places[*count];
        if (i == houses)
            first_of[2 * p + 1] = *count;
        ++*count;
        at[0] = x0 + (i < houses ? 8.0f * (float)(i % 4) + 4.0f : 1.5f + (plot - 3) * chance());
        at[2] = z0 + (i < houses ? 11.0f * (float)(i / 4) + 5.0f : 1.5f + (plot - 3) * chance());
        need(terrimp_heightfield_height(&field, at[0], at[2], &at[1]));
        at[3] = i < houses ? 5.0f : 4.0f + 4.0f * chance();
        at[4] = i < houses ? 1.5708f * floorf(4 * chance()) : 6.28f * chance();
        boxes[p].min[1] = fminf(boxes[p].min[1], at[1] - 1.5f);
        boxes[p].max[1] = fmaxf(boxes[p].max[1], at[1] + 8.3f);
    }
    if (!trees)
        first_of[2 * p + 1] = *count;
    first_of[2 * p + 2] = *count;
    triangles[p] = houses * HOUSE + trees * TREE;
    boxes[p].min[0] = x0 - 1, boxes[p].min[2] = z0 - 1;
    boxes[p].max[0] = x0 + plot + 1, boxes[p].max[2] = z0 + plot + 1;
}

static void build_town(uint32_t trees)
{
    uint32_t i, k, side, base = 0, count = 0;
    for (i = 0; i < CLUSTERS; i++)
        for (k = 0; k < 3; k++)
            boxes[i].min[k] = 1e9f, boxes[i].max[k] = -1e9f;
    for (i = 0; i < PLOTS; i++)
        build_plot(i, trees, &count);
    for (side = 8; side; base += side * side, side /= 2)
        for (i = 0; i < side * side; i++) {
            /* The root is its own parent. */
            uint32_t up = side > 1 ? base + side * side + i / side / 2 * (side / 2) + i % side / 2
                                   : base;
            parents[base + i] = up;
            for (k = 0; side > 1 && k < 3; k++) {
                boxes[up].min[k] = fminf(boxes[up].min[k], boxes[base + i].min[k]);
                boxes[up].max[k] = fmaxf(boxes[up].max[k], boxes[base + i].max[k]);
            }
            triangles[up] += side > 1 ? triangles[base + i] : 0;
        }
}

static int within(uint32_t cluster, uint32_t other)
{
    while (cluster < other && parents[cluster] != cluster)
        cluster = parents[cluster];
    return cluster == other;
}

/* ---- OpenGL ------------------------------------------------------------- */

static const char things_vertex[] = "#version 330 core\n"
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec3 tone;\n"
    "layout(location = 2) in vec4 place;\n"
    "layout(location = 3) in float turn;\n"
    "uniform mat4 matrix;\n"
    "out vec3 shade;\n"
    "void main() {\n"
    "    vec2 c = vec2(cos(turn), sin(turn));\n"
    "    vec3 p = vec3(c.x * position.x - c.y * position.z, position.y,\n"
    "                  c.y * position.x + c.x * position.z);\n"
    "    shade = tone;\n"
    "    gl_Position = matrix * vec4(place.xyz + place.w * p, 1.0);\n"
    "}\n";
static const char things_fragment[] = "#version 330 core\n"
    "in vec3 shade;\n"
    "out vec4 colour;\n"
    "void main() { colour = vec4(shade, 1.0); }\n";

static void set_matrix(const gl_program *p, const float view[16], const float projection[16])
{
    float both[16];
    int i, k;
    for (i = 0; i < 16; i++)
        for (both[i] = 0.0f, k = 0; k < 4; k++)
            both[i] += projection[i % 4 + 4 * k] * view[i / 4 * 4 + k];
    glUseProgram(p->id);
    glUniformMatrix4fv(p->matrix, 1, GL_FALSE, both);
}

static void open_graphics(void)
{
    static float ground[GROUND * 18], model[6 * CORNERS];
    float *p = ground;
    const char *wrong;
    uint32_t x, z, k;
    GLuint buffer;
    for (z = 0; z + 1 < SIDE; z++)
        for (x = 0; x + 1 < SIDE; x++)
            for (k = 0; k < 6; k++) {
                static const uint32_t dx[6] = { 0, 0, 1, 1, 0, 1 }, dz[6] = { 0, 1, 0, 0, 1, 1 };
                float wx = field.origin_x + field.spacing_x * (float)(x + dx[k]), y, up[3];
                float wz = field.origin_z + field.spacing_z * (float)(z + dz[k]), light;
                need(terrimp_heightfield_height(&field, wx, wz, &y));
                need(terrimp_heightfield_normal(&field, wx, wz, up));
                light = 0.35f + 0.4f * up[1] + 0.5f * up[0];
                p = corner(p, wx, y, wz, 0.45f * light, 0.6f * light, 0.3f * light);
            }
    make_models(model);
    ground_array = gl_array_make(&buffer, ground, sizeof ground);
    gl_point(0, 3, GL_FLOAT, 24, 0), gl_point(1, 3, GL_FLOAT, 24, 12);
    things_array = gl_array_make(&models, model, sizeof model);
    gl_point(0, 3, GL_FLOAT, 24, 0), gl_point(1, 3, GL_FLOAT, 24, 12);
    glGenBuffers(1, &instances);
    glBindBuffer(GL_ARRAY_BUFFER, instances);
    glBufferData(GL_ARRAY_BUFFER, sizeof places, places, GL_STATIC_DRAW);
    glVertexAttribDivisor(2, 1), glVertexAttribDivisor(3, 1);
    things = gl_program_make(things_vertex, things_fragment);
    wrong = gl_layers_open(&atlas, PICTURE, 400);
    if (wrong || !things.id)
        fprintf(stderr, "%s\n", wrong ? wrong : "a shader does not compile"), exit(2);
}

/* Draws houses (0) or trees (1) of a plot; returns its triangles. */
static uint32_t draw_things(uint32_t p, uint32_t kind)
{
    uint32_t first = first_of[2 * p + kind], count = first_of[2 * p + kind + 1] - first;
    size_t at = first * sizeof places[0];
    if (!count)
        return 0;
    glBindVertexArray(things_array);
    glBindBuffer(GL_ARRAY_BUFFER, instances);
    gl_point(2, 4, GL_FLOAT, sizeof places[0], at);
    gl_point(3, 1, GL_FLOAT, sizeof places[0], at + 16);
    glDrawArraysInstanced(GL_TRIANGLES, kind ? 0 : 3 * TREE, 3 * (kind ? TREE : HOUSE),
                          (GLsizei)count);
    return count * (kind ? TREE : HOUSE);
}

/* ---- Placement ---------------------------------------------------------- */

/* Square s of cells: 8 of one, 4 of two, 2 of four, 1 of all. */
static void square_of(uint32_t s, uint32_t *first, uint32_t *count)
{
    for (*count = 1; s >= CELLS / *count; *count *= 2)
        s -= CELLS / *count;
    *first = s * *count;
}

/* Whether an eye of a cell, looking within 0.15 rad of +z, may see a box. */
static int may_see(uint32_t c, const terrimp_box *b)
{
    float reach = (b->max[2] - path_z) * 0.7f, x = path_x + cell * (float)c;
    return b->max[0] > x - reach && b->min[0] < x + cell + reach;
}

static float eye_height(float x)
{
    float y;
    need(terrimp_heightfield_height(&field, x, path_z + 0.5f * deep, &y));
    return y + 12.0f;
}

/* Layers of a cluster for a square, seen from the middle of its side. */
static terrimp_result plan(uint32_t cluster, uint32_t s, int even, gl_layers_picture *out)
{
    const terrimp_box *b = &boxes[cluster];
    terrimp_layers_desc d;
    terrimp_capture *c = &out->capture;
    uint32_t first, count, i, n;
    float low = 1e9f, high = -1e9f;
    square_of(s, &first, &count);
    for (i = 0; i <= 8; i++) {
        float y = eye_height(path_x + cell * ((float)first + (float)(count * i) / 8.0f));
        low = fminf(low, y), high = fmaxf(high, y);
    }
    memset(&d, 0, sizeof d);
    memset(c, 0, sizeof *c);
    c->right[0] = -1, c->up[1] = c->forward[2] = 1;
    c->eye[0] = path_x + cell * ((float)first + 0.5f * (float)count);
    c->eye[1] = 0.5f * (low + high), c->eye[2] = path_z + deep;
    d.distance = b->min[2] - c->eye[2];
    d.depth = b->max[2] - b->min[2];
    d.cell_size[0] = cell * (float)count, d.cell_size[1] = high - low + 1, d.cell_depth = deep;
    c->tan_left = c->tan_down = 1e9f, c->tan_right = c->tan_up = -1e9f;
    for (i = 0; i < 8; i++) {
        float z = d.distance + (i & 4 ? d.depth : 0.0f);
        float x = (c->eye[0] - (i & 1 ? b->max : b->min)[0]) / z;
        float y = ((i & 2 ? b->max : b->min)[1] - c->eye[1]) / z;
        c->tan_left = fminf(c->tan_left, x), c->tan_right = fmaxf(c->tan_right, x);
        c->tan_down = fminf(c->tan_down, y), c->tan_up = fmaxf(c->tan_up, y);
    }
    d.view_tan[0] = fmaxf(fabsf(c->tan_left), fabsf(c->tan_right));
    d.view_tan[1] = fmaxf(fabsf(c->tan_down), fabsf(c->tan_up));
    d.texel = 1.0f / pixel_factor;
    d.even = even;
    n = (uint32_t)ceilf((c->tan_right - c->tan_left) / d.texel);
    c->tan_right = c->tan_left + (float)n * d.texel;
    i = (uint32_t)ceilf((c->tan_up - c->tan_down) / d.texel);
    c->tan_up = c->tan_down + (float)i * d.texel;
    if (n > PICTURE || i > PICTURE)
        return TERRIMP_E_RANGE;
    return terrimp_layers_plan(&d, &out->layers);
}

static uint32_t place(float budget, terrimp_place_desc *d, terrimp_placement *result)
{
    uint32_t cluster, s, i, first, count, v, p;
    size_t bytes;
    void *scratch;
    memset(d, 0, sizeof *d);
    for (v = 0; v < CELLS; v++)
        for (costs[v] = GROUND, p = 0; p < PLOTS; p++)
            costs[v] += may_see(v, &boxes[p]) ? (float)triangles[p] : 0.0f;
    for (cluster = 0; cluster < CLUSTERS; cluster++)
        for (s = 0; s < SQUARES; s++) {
            terrimp_place_candidate *c = &candidates[d->candidate_count];
            gl_layers_picture made = { 0 };
            float area;
            if (plan(cluster, s, 0, &made) != TERRIMP_OK)
                continue;
            square_of(s, &first, &count);
            area = (made.capture.tan_right - made.capture.tan_left) * pixel_factor
                   * (made.capture.tan_up - made.capture.tan_down) * pixel_factor;
            c->cluster = cluster;
            c->memory = 4.0f * area * (1 + 0.1f * (float)made.layers.count)
                        + 640.0f * (float)made.layers.count;
            c->first_gain = d->gain_count;
            for (v = first; v < first + count; v++) {
                float saved = -16.0f * (float)made.layers.count; /* about 8 quads a layer */
                for (i = 0; i < PLOTS; i++)
                    saved += within(i, cluster) && may_see(v, &boxes[i]) ? (float)triangles[i] : 0;
                gains[d->gain_count].view = v;
                gains[d->gain_count++].saved = saved;
            }
            c->gain_count = count;
            pictures[d->candidate_count].cluster = cluster;
            pictures[d->candidate_count++].square = s;
        }
    d->candidates = candidates, d->gains = gains, d->parents = parents, d->costs = costs;
    d->cluster_count = CLUSTERS, d->view_count = CELLS, d->budget = budget;
    bytes = terrimp_place_scratch_bytes(d);
    scratch = malloc(bytes);
    need(scratch ? (int)terrimp_place(d, scratch, bytes, shown, left, result)
                 : (int)TERRIMP_E_MEMORY);
    free(scratch);
    return d->candidate_count;
}

/* ---- Making pictures ---------------------------------------------------- */

/* What a picture shows between two depths: of that the host makes a layer. */
static void draw_slab(void *user, const terrimp_capture *slab)
{
    const picture *p = (const picture *)user;
    float view[16], projection[16];
    uint32_t i;
    need(terrimp_capture_matrices(slab, 0, view, projection));
    set_matrix(&things, view, projection);
    for (i = 0; i < PLOTS; i++)
        if (within(i, p->cluster) && boxes[i].min[2] < slab->eye[2] + slab->z_far
            && boxes[i].max[2] > slab->eye[2] + slab->z_near)
            draw_things(i, 0), draw_things(i, 1);
}

static int is_town(uint32_t cluster)
{
    uint32_t i, trees = 0;
    for (i = 0; i < PLOTS; i++)
        trees += within(i, cluster) ? first_of[2 * i + 2] - first_of[2 * i + 1] : 0;
    return !trees;
}

/* Walls stay flat in a depth mesh; woods would tear it. */
static void make_picture(picture *p)
{
    p->made.as_mesh = is_town(p->cluster);
    need(plan(p->cluster, p->square, p->made.as_mesh, &p->made));
    need(gl_layers_record(&atlas, &p->made, draw_slab, p));
}

/* ---- Frames ------------------------------------------------------------- */

/* Draws a frame, with pictures or without; returns its triangles. */
static uint32_t draw_frame(const context *frame, const terrimp_place_desc *d, int with_pictures)
{
    float view[16], projection[16];
    terrimp_frustum frustum;
    uint8_t done[PLOTS] = { 0 };
    uint32_t i, g, sum = GROUND, v = (uint32_t)((camera.eye[0] - path_x) / cell);
    need(terrimp_camera_matrices(&camera, view, projection));
    need(terrimp_camera_frustum(&camera, &frustum));
    context_bind(frame);
    glClearColor((float)sky[0] / 255, (float)sky[1] / 255, (float)sky[2] / 255, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    set_matrix(&things, view, projection);
    glBindVertexArray(ground_array);
    glVertexAttrib4f(2, 0, 0, 0, 1), glVertexAttrib1f(3, 0);
    glDrawArrays(GL_TRIANGLES, 0, 3 * GROUND);
    set_matrix(&atlas.program, view, projection);
    for (i = 0; with_pictures && i < d->candidate_count; i++)
        for (g = 0; g < candidates[i].gain_count; g++) {
            uint32_t k, gain = candidates[i].first_gain + g;
            if (!shown[gain] || gains[gain].view != v)
                continue;
            for (k = 0; k < PLOTS; k++)
                done[k] |= (uint8_t)within(k, candidates[i].cluster);
            if (terrimp_frustum_test(&frustum, &boxes[candidates[i].cluster], 63) < 0)
                continue;
            gl_layers_draw(&atlas, &pictures[i].made);
            sum += (uint32_t)pictures[i].made.count / 3;
        }
    set_matrix(&things, view, projection);
    for (i = 0; i < PLOTS; i++)
        if (!done[i] && terrimp_frustum_test(&frustum, &boxes[i], 63) != TERRIMP_PLANES_OUTSIDE)
            sum += draw_things(i, 0) + draw_things(i, 1);
    glFinish();
    return sum;
}

static double now(void) { return 1e3 * (double)clock() / CLOCKS_PER_SEC; }

int main(int argc, char **argv)
{
    float budget = argc > 1 ? (float)atof(argv[1]) : 150000.0f;
    uint32_t trees = argc > 2 ? (uint32_t)atoi(argv[2]) : 105, i, most = 0, count;
    uint16_t *samples = procedural_terrain(SIDE, SIDE, 3);
    double start, ms = 0, full_ms = 0, worst = 99, psnr;
    size_t holes = 0, low, first;
    terrimp_place_desc placing;
    terrimp_placement placed;
    context frame;
    int n, judged = 0;
    if (!samples || trees > 4000)
        return 2;
    if (trees > 105) /* fewer stand farther apart: houses and the flight take as much room */
        plot *= sqrtf((float)trees / 105.0f);
    field.samples = samples, field.width = field.depth = SIDE, field.format = TERRIMP_FORMAT_U16;
    field.height_scale = 0.15f * PROCEDURAL_HEIGHT_SCALE;
    field.spacing_x = field.spacing_z = plot / 16;
    field.origin_x = -2 * plot, field.origin_z = -fmaxf(2.5f * plot, 128);
    need(terrimp_heightfield_resolve(&field, &field));
    build_town(trees);
    camera.width_px = WIDTH, camera.height_px = HEIGHT, camera.fov_y_rad = 0.7f;
    camera.z_near = 5, camera.z_far = 20 * plot, camera.forward[2] = 1;
    need(terrimp_camera_pixel_factor(&camera, &pixel_factor));
    if (context_open(&frame, WIDTH, HEIGHT))
        return 2;
    open_graphics();
    start = now();
    count = place(budget, &placing, &placed);
    printf("%u plots of %u triangles, with the ground %.0f at most in sight; budget %.0f\n"
           "%u of %u pictures placed in %.1f ms; of %d stretches %u over budget without, %u with\n",
           PLOTS, triangles[CLUSTERS - 1], (double)costs[0], (double)budget, placed.chosen, count,
           now() - start, CELLS, placed.problems, placed.unsolved);
    start = now();
    for (i = 0; i < count; i++)
        if (memchr(shown + candidates[i].first_gain, 1, candidates[i].gain_count))
            make_picture(&pictures[i]);
    need(gl_layers_pack(&atlas, ATLAS));
    printf("made in %.1f s: %u quads, %zu triangles, %.1f MB of texels (%.1f estimated in all)\n",
           1e-3 * (now() - start), atlas.part_count, (size_t)atlas.vertex_count / 3,
           (double)atlas.texel_count * 4e-6, 1e-6 * (double)placed.memory);
    for (n = 0; n < FRAMES; n++) {
        double before, after;
        uint32_t cost, all;
        float part = (float)n / (FRAMES - 1);
        camera.eye[0] = path_x + 0.5f + (CELLS * cell - 1.0f) * part;
        camera.eye[2] = path_z + deep * (0.5f + 0.45f * sinf(9 * part));
        camera.eye[1] = eye_height(camera.eye[0]);
        camera.forward[0] = 0.14f * sinf(5 * part), camera.forward[1] = -0.06f;
        camera.forward[2] = 1;
        before = now();
        cost = draw_frame(&frame, &placing, 1);
        after = now();
        ms += (after - before) / FRAMES;
        most = cost > most ? cost : most;
        if (n % 6)
            continue;
        context_read(&frame, ours);
        before = now();
        all = draw_frame(&frame, &placing, 0);
        full_ms += now() - before;
        context_read(&frame, full);
        psnr = image_psnr(image_mean_square(ours, full, WIDTH * HEIGHT, sky));
        holes += quality_holes(ours, full, WIDTH, HEIGHT, sky, &low, &first);
        worst = psnr < worst ? psnr : worst;
        judged++;
        printf("frame %2d: %6u triangles of %7u, %.1f dB\n", n, cost, all, psnr);
    }
    printf("%.1f ms a frame, all triangles %.1f ms: %.1f times; %u triangles at most; worst %.1f "
           "dB, %zu holes\n", ms, full_ms / judged, full_ms / judged / ms, most, worst, holes);
    n = image_write_beside(argv[0], "town.png", ours, WIDTH, HEIGHT)
        || image_write_beside(argv[0], "town_full.png", full, WIDTH, HEIGHT);
    gl_layers_close(&atlas);
    context_close(&frame);
    free(samples);
    return n || holes > 10 || (float)most > budget;
}
