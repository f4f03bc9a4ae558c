#include "trees.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDES = 7, TIERS = 3, TREE_VERTICES = SIDES * TIERS * 3, TREE_FLOATS = 4 };
enum { HOUSE_VERTICES = 42 };

#define TREE_HEIGHT 7.0f /* samples */
#define TREE_RADIUS 2.0f
#define HOUSE_HEIGHT 5.0f
#define LEAST_UPWARD 0.72f /* of the normal: steeper ground has no trees */
#define LEAST_LEVEL 0.93f  /* and no houses */

/* ---- Shaders ------------------------------------------------------------ */

/* Shaded from below to above and by the side that the sun is on; cut to clip: x0, z0, x1, z1. Of
   houses the roof begins at half of the height. */
static const char tree_vertex[] =
    GL_SHADER_HEAD
    "layout(location = 0) in vec3 position;\n" /* of a tree of height 1 */
    "layout(location = 1) in vec4 instance;\n" /* foot, height */
    "uniform mat4 matrix;\n"
    "uniform vec3 eye;\n"
    "uniform float house;\n"
    "out vec3 shade;\n"
    "out vec2 place;\n"
    "void main() {\n"
    "    vec3 p = instance.xyz + position * instance.w;\n"
    "    vec2 side = position.xz / max(length(position.xz), 0.001);\n"
    "    float light = 0.45 + 0.35 * position.y - 0.25 * dot(side, vec2(0.63, 0.78));\n"
    "    vec3 wall = position.y > 0.51 ? vec3(0.75, 0.33, 0.24) : vec3(1.1, 1.05, 0.95);\n"
    "    shade = house > 0.0 ? (light + 0.15) * wall : light * vec3(0.30, 0.42, 0.18);\n"
    "    place = p.xz;\n"
    "    gl_Position = matrix * vec4(p - eye, 1.0);\n"
    "}\n";

static const char tree_fragment[] =
    GL_SHADER_HEAD
    "uniform vec4 clip;\n"
    "in vec3 shade;\n"
    "in vec2 place;\n"
    "out vec4 colour;\n"
    "void main() {\n"
    "    if (any(lessThan(place, clip.xy)) || any(greaterThan(place, clip.zw))) discard;\n"
    "    colour = vec4(shade, 1.0);\n"
    "}\n";

/* ---- Planting ----------------------------------------------------------- */

/* Uniform in 0..1: the n-th number of a tree. */
static float chance(uint32_t tree, uint32_t n)
{
    uint32_t h = tree * 0x9e3779b1u ^ n * 0x85ebca77u;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return (float)((h ^ h >> 15) >> 8) * (1.0f / 16777216.0f);
}

/* Where tree or house number i would stand; returns 0 where it cannot. */
static int plant(const trees *t, const terrimp_heightfield *field, uint32_t i,
                 float tree[TREE_FLOATS])
{
    float normal[3], x, z;
    i = t->houses ? ~i : i;
    x = chance(i, 0);
    z = chance(i, 1);
    tree[0] = field->origin_x + x * (float)(field->width - 1) * field->spacing_x;
    tree[2] = field->origin_z + z * (float)(field->depth - 1) * field->spacing_z;
    tree[3] = (t->houses ? HOUSE_HEIGHT : TREE_HEIGHT) * field->spacing_x
              * (0.7f + 0.6f * chance(i, 2));
    return terrimp_heightfield_height(field, tree[0], tree[2], &tree[1]) == TERRIMP_OK
           && terrimp_heightfield_normal(field, tree[0], tree[2], normal) == TERRIMP_OK
           && normal[1] >= (t->houses ? LEAST_LEVEL : LEAST_UPWARD);
}

static uint32_t chunk_of(const trees *t, const terrimp_heightfield *field, uint32_t chunk_quads,
                         const float tree[TREE_FLOATS])
{
    float side = (float)chunk_quads;
    uint32_t x = (uint32_t)((tree[0] - field->origin_x) / (field->spacing_x * side));
    uint32_t z = (uint32_t)((tree[2] - field->origin_z) / (field->spacing_z * side));
    x = x < t->chunks_x ? x : t->chunks_x - 1;
    z = z < t->chunks_z ? z : t->chunks_z - 1;
    return z * t->chunks_x + x;
}

/* Sorts the trees by chunk: counts them, then places each behind those before it.
   sorted: [count][TREE_FLOATS], next: [chunks] scratch */
static void plant_all(trees *t, const terrimp_heightfield *field, uint32_t chunk_quads,
                      uint32_t count, float *sorted, uint32_t *next)
{
    uint32_t chunks = t->chunks_x * t->chunks_z, i, c;
    float tree[TREE_FLOATS];
    for (i = 0; i < count; i++)
        if (plant(t, field, i, tree))
            t->first[chunk_of(t, field, chunk_quads, tree) + 1]++;
    for (c = 0; c < chunks; c++) {
        next[c] = t->first[c];
        t->first[c + 1] += t->first[c];
    }
    for (i = 0; i < count; i++)
        if (plant(t, field, i, tree)) {
            uint32_t place = next[chunk_of(t, field, chunk_quads, tree)]++;
            memcpy(sorted + (size_t)place * TREE_FLOATS, tree, sizeof tree);
        }
}

/* Three cones, one over the other; the sides that look outward are front faces. */
static void make_tree(float *xyz)
{
    int tier, side, corner;
    for (tier = 0; tier < TIERS; tier++)
        for (side = 0; side < SIDES; side++)
            for (corner = 0; corner < 3; corner++, xyz += 3) {
                float radius = TREE_RADIUS / TREE_HEIGHT * (1.0f - 0.27f * (float)tier);
                float angle = 6.2831853f / SIDES * (float)(side + (corner == 1));
                float bottom = 0.3f * (float)tier;
                xyz[0] = corner == 2 ? 0.0f : radius * sinf(angle);
                xyz[1] = corner == 2 ? bottom + 0.4f : bottom;
                xyz[2] = corner == 2 ? 0.0f : radius * cosf(angle);
            }
}

/* Walls, a roof and its gables, of triangles that look outward. */
static void make_house(float *xyz)
{
    /* Corners: x and z of either sign, the ridge along x. Walls go below the ground of a slope. */
    static const float points[10][3] = {
        { -0.6f, -0.4f, -0.45f }, { 0.6f, -0.4f, -0.45f }, { 0.6f, -0.4f, 0.45f },
        { -0.6f, -0.4f, 0.45f }, { -0.6f, 0.5f, -0.45f }, { 0.6f, 0.5f, -0.45f },
        { 0.6f, 0.5f, 0.45f }, { -0.6f, 0.5f, 0.45f }, { -0.6f, 1.0f, 0.0f }, { 0.6f, 1.0f, 0.0f }
    };
    static const uint8_t corners[HOUSE_VERTICES] = {
        3, 2, 6, 3, 6, 7, 1, 0, 4, 1, 4, 5, 0, 3, 7, 0, 7, 4, 2, 1, 5, 2, 5, 6, /* walls */
        7, 6, 9, 7, 9, 8, 5, 4, 8, 5, 8, 9, 4, 7, 8, 6, 5, 9                     /* roof, gables */
    };
    int i;
    for (i = 0; i < HOUSE_VERTICES; i++, xyz += 3) {
        memcpy(xyz, points[corners[i]], 3 * sizeof *xyz);
        if (i >= 24 && xyz[1] < 0.6f)
            xyz[1] = 0.52f; /* of the roof's colour */
    }
}

/* ---- Opening ------------------------------------------------------------ */

static void make_buffers(trees *t, const float *sorted)
{
    uint32_t count = t->first[t->chunks_x * t->chunks_z];
    float xyz[TREE_VERTICES * 3];
    t->vertex_count = t->houses ? HOUSE_VERTICES : TREE_VERTICES;
    if (t->houses)
        make_house(xyz);
    else
        make_tree(xyz);
    t->array = gl_array_make(&t->vertices, xyz, sizeof xyz);
    gl_point(0, 3, GL_FLOAT, 0, 0);
    glGenBuffers(1, &t->instances);
    glBindBuffer(GL_ARRAY_BUFFER, t->instances);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)count * TREE_FLOATS * sizeof *sorted),
                 sorted, GL_STATIC_DRAW);
    glEnableVertexAttribArray(1);
    glVertexAttribDivisor(1, 1);
}

const char *trees_open(trees *t, const terrimp_terrain *terrain, const terrimp_heightfield *field,
                       uint32_t count, int houses)
{
    terrimp_heightfield resolved;
    terrimp_terrain_info info;
    uint32_t chunks;
    uint32_t *next;
    float *sorted;
    memset(t, 0, sizeof *t);
    t->houses = houses;
    if (terrimp_heightfield_resolve(field, &resolved) != TERRIMP_OK
        || terrimp_terrain_get_info(terrain, &info) != TERRIMP_OK)
        return "the terrain is wrong";
    t->chunks_x = info.chunks_x;
    t->chunks_z = info.chunks_z;
    chunks = t->chunks_x * t->chunks_z;
    t->first = calloc((size_t)chunks + 1, sizeof *t->first);
    t->draws = malloc(chunks * sizeof *t->draws);
    next = malloc(chunks * sizeof *next);
    sorted = malloc((size_t)count * TREE_FLOATS * sizeof *sorted);
    t->program = gl_program_make(tree_vertex, tree_fragment);
    t->clip = glGetUniformLocation(t->program.id, "clip");
    t->house = glGetUniformLocation(t->program.id, "house");
    if (t->first && t->draws && next && sorted && t->program.id) {
        plant_all(t, &resolved, info.chunk_quads, count, sorted, next);
        make_buffers(t, sorted);
    }
    free(sorted);
    free(next);
    if (t->array)
        return NULL;
    trees_close(t);
    return "no memory for the trees, or their shader does not compile";
}

void trees_close(trees *t)
{
    glDeleteVertexArrays(1, &t->array);
    glDeleteBuffers(1, &t->vertices);
    glDeleteBuffers(1, &t->instances);
    glDeleteProgram(t->program.id);
    free(t->first);
    free(t->draws);
    memset(t, 0, sizeof *t);
}

/* ---- Drawing ------------------------------------------------------------ */

/* For the screen nothing is cut. */
static void use(const trees *t, const float matrix[16], const float eye[3])
{
    gl_program_use(&t->program, matrix, eye, 1);
    glBindVertexArray(t->array);
    glUniform1f(t->house, (float)t->houses);
    glUniform4f(t->clip, -1e30f, -1e30f, 1e30f, 1e30f);
}

/* OpenGL 3.3 has no first instance: the attribute is pointed at it. */
static void draw_chunk(const trees *t, uint32_t chunk)
{
    uint32_t first = t->first[chunk], count = t->first[chunk + 1] - first;
    if (!count)
        return;
    glBindBuffer(GL_ARRAY_BUFFER, t->instances);
    glVertexAttribPointer(1, TREE_FLOATS, GL_FLOAT, GL_FALSE, 0,
                          (const void *)(uintptr_t)(first * TREE_FLOATS * sizeof(float)));
    glDrawArraysInstanced(GL_TRIANGLES, 0, t->vertex_count, (GLsizei)count);
}

/* Draws the trees of all chunks under a node, and of so many more around it. Nodes are numbered
   level by level, row by row. */
static void draw_node(const trees *t, uint32_t node, uint32_t level, uint32_t around)
{
    uint32_t columns = t->chunks_x, rows = t->chunks_z, i, x, z, x0, z0;
    for (i = 0; i < level; i++) {
        node -= columns * rows;
        columns = (columns + 1) / 2;
        rows = (rows + 1) / 2;
    }
    x0 = node % columns << level;
    z0 = node / columns << level;
    for (z = z0 > around ? z0 - around : 0; z < z0 + (1u << level) + around; z++)
        for (x = x0 > around ? x0 - around : 0; x < x0 + (1u << level) + around; x++)
            if (x < t->chunks_x && z < t->chunks_z)
                draw_chunk(t, z * t->chunks_x + x);
}

/* Trees of the neighbours stand in a picture too, as far as its rectangle goes. */
static void draw_captured(trees *t, const terrimp_capture_command *c)
{
    float matrix[16];
    gl_relative_matrix(c->view, c->projection, matrix);
    use(t, matrix, c->eye);
    glUniform4f(t->clip, c->clip_min[0], c->clip_min[1], c->clip_max[0], c->clip_max[1]);
    draw_node(t, c->node, c->level, 1);
}

static void begin_capture(void *user, const terrimp_capture_command *command)
{
    trees *t = user;
    t->inner.begin_capture(t->inner.user, command);
    t->capture = command;
    if (!t->gl->over)
        draw_captured(t, command);
}

static void end_capture(void *user, const terrimp_capture_command *command)
{
    trees *t = user;
    t->inner.end_capture(t->inner.user, command);
    t->capture = NULL;
}

static void draw_impostor(void *user, const terrimp_impostor_command *command)
{
    trees *t = user;
    t->inner.draw_impostor(t->inner.user, command);
}

static void draw_ground(void *user, const terrimp_ground_command *command)
{
    trees *t = user;
    t->inner.draw_ground(t->inner.user, command);
    if (!t->capture && t->draw_count < t->chunks_x * t->chunks_z) {
        trees_draw *draw = &t->draws[t->draw_count++];
        draw->node = command->node;
        draw->level = command->level;
    }
}

static void draw_floor(void *user, const terrimp_floor_command *command)
{
    trees *t = user;
    t->inner.draw_floor(t->inner.user, command);
}

terrimp_callbacks trees_callbacks(trees *t, gl_terrain *g, terrimp_callbacks inner)
{
    terrimp_callbacks callbacks;
    t->gl = g;
    t->inner = inner;
    t->draw_count = 0;
    t->capture = NULL;
    memset(&callbacks, 0, sizeof callbacks);
    callbacks.user = t;
    callbacks.begin_capture = begin_capture;
    callbacks.end_capture = end_capture;
    callbacks.draw_impostor = draw_impostor;
    callbacks.draw_ground = draw_ground;
    callbacks.draw_floor = draw_floor;
    return callbacks;
}

void trees_end(trees *t)
{
    uint32_t i;
    gl_terrain_turn_to_frame(t->gl);
    use(t, t->gl->camera_matrix, t->gl->camera_eye);
    for (i = 0; i < t->draw_count; i++) {
        const trees_draw *draw = &t->draws[i];
        draw_node(t, draw->node, draw->level, 0);
    }
}
