#include "props.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CORNERS = 10, HOUSE_INDICES = 48, FLOATS = 6, SEA_VERTICES = 6 };

static const char prop_vertex[] =
    "#version 330 core\n"
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec3 tone;\n"
    "uniform mat4 matrix;\n"
    "uniform vec3 eye;\n"
    "out vec3 shade;\n"
    "void main() {\n"
    "    shade = tone;\n"
    "    gl_Position = matrix * vec4(position - eye, 1.0);\n"
    "}\n";

static const char prop_fragment[] =
    "#version 330 core\n"
    "uniform vec3 light = vec3(1.0);\n"
    "in vec3 shade;\n"
    "out vec4 colour;\n"
    "void main() { colour = vec4(shade * light, 1.0); }\n";

/* A house in units of its side: four walls from below the ground up, and a roof with two gables. */
static const float corners[CORNERS][3] = {
    { -0.5f, -0.3f, -0.5f }, { 0.5f, -0.3f, -0.5f }, { 0.5f, -0.3f, 0.5f }, { -0.5f, -0.3f, 0.5f },
    { -0.5f, 0.6f, -0.5f },  { 0.5f, 0.6f, -0.5f },  { 0.5f, 0.6f, 0.5f },  { -0.5f, 0.6f, 0.5f },
    { 0.0f, 1.0f, -0.5f },   { 0.0f, 1.0f, 0.5f },
};

/* Triangles, counter-clockwise from outside: walls, gables, roof. */
static const uint8_t faces[HOUSE_INDICES] = {
    0, 4, 1, 1, 4, 5, 1, 5, 2, 2, 5, 6, 2, 6, 3, 3, 6, 7, 3, 7, 0, 0, 7, 4,
    4, 8, 5, 6, 9, 7, 4, 7, 8, 8, 7, 9, 5, 8, 6, 6, 8, 9, 0, 1, 2, 0, 2, 3,
};

static uint32_t next(uint32_t *seed)
{
    *seed ^= *seed << 13;
    *seed ^= *seed >> 17;
    *seed ^= *seed << 5;
    return *seed;
}

static float chance(uint32_t *seed)
{
    return (float)(next(seed) >> 8) * (1.0f / 16777216.0f);
}

static float *add_house(float *out, const float place[3], float side, float turn)
{
    float c = cosf(turn), s = sinf(turn);
    int i;
    for (i = 0; i < HOUSE_INDICES; i++, out += FLOATS) {
        const float *k = corners[faces[i]];
        float tone = i >= 30 ? 0.45f : 0.6f + 0.12f * (float)(i / 6 % 4);
        out[0] = place[0] + side * (c * k[0] - s * k[2]);
        out[1] = place[1] + side * k[1];
        out[2] = place[2] + side * (s * k[0] + c * k[2]);
        out[3] = tone;
        out[4] = 0.2f * tone;
        out[5] = 0.15f * tone;
    }
    return out;
}

static float *add_sea(float *out, const terrimp_heightfield *field)
{
    static const float at[SEA_VERTICES][2] = { { -1, -1 }, { -1, 1 }, { 1, -1 },
                                               { 1, -1 },  { -1, 1 }, { 1, 1 } };
    float width = (float)(field->width - 1) * field->spacing_x;
    float depth = (float)(field->depth - 1) * field->spacing_z;
    int i;
    for (i = 0; i < SEA_VERTICES; i++, out += FLOATS) {
        out[0] = field->origin_x + width * (0.5f + 2.0f * at[i][0]);
        out[1] = 0.0f;
        out[2] = field->origin_z + depth * (0.5f + 2.0f * at[i][1]);
        out[3] = 0.12f;
        out[4] = 0.25f;
        out[5] = 0.4f;
    }
    return out;
}

const char *props_open(props *p, const terrimp_heightfield *field, uint32_t houses, float side,
                       float sea_height)
{
    uint32_t seed = 2463534242u, tries;
    size_t floats = ((size_t)houses * HOUSE_INDICES + SEA_VERTICES) * FLOATS;
    float *vertices = malloc(floats * sizeof *vertices), *out = vertices;
    memset(p, 0, sizeof *p);
    if (!vertices)
        return "no memory for houses";
    for (tries = 20 * houses; tries > 0 && p->count < (GLsizei)(houses * HOUSE_INDICES); tries--) {
        float place[3], u = chance(&seed), v = chance(&seed), turn = 6.28f * chance(&seed);
        place[0] = field->origin_x + u * (float)(field->width - 1) * field->spacing_x;
        place[2] = field->origin_z + v * (float)(field->depth - 1) * field->spacing_z;
        if (terrimp_heightfield_height(field, place[0], place[2], &place[1]) != TERRIMP_OK
            || place[1] < sea_height)
            continue;
        out = add_house(out, place, side, turn);
        p->count += HOUSE_INDICES;
    }
    out = add_sea(out, field);
    p->program = gl_program_make(prop_vertex, prop_fragment);
    p->array = gl_array_make(&p->vertices, vertices, (size_t)((char *)out - (char *)vertices));
    gl_point(0, 3, GL_FLOAT, FLOATS * sizeof(float), 0);
    gl_point(1, 3, GL_FLOAT, FLOATS * sizeof(float), 3 * sizeof(float));
    free(vertices);
    return p->program.id ? NULL : "the shader of houses does not compile";
}

void props_close(props *p)
{
    glDeleteVertexArrays(1, &p->array);
    glDeleteBuffers(1, &p->vertices);
    glDeleteProgram(p->program.id);
    memset(p, 0, sizeof *p);
}

void props_draw_houses(const props *p, const gl_terrain *g)
{
    gl_program_use(&p->program, g->camera_matrix, g->camera_eye, 1);
    glBindVertexArray(p->array);
    glDrawArrays(GL_TRIANGLES, 0, p->count);
}

/* The quad lies at height 0: the eye is moved instead. */
void props_draw_sea(const props *p, const gl_terrain *g, float sea_height)
{
    float eye[3];
    memcpy(eye, g->camera_eye, sizeof eye);
    eye[1] -= sea_height;
    gl_program_use(&p->program, g->camera_matrix, eye, 1);
    glBindVertexArray(p->array);
    glDisable(GL_CULL_FACE);
    glDrawArrays(GL_TRIANGLES, p->count, SEA_VERTICES);
    glEnable(GL_CULL_FACE);
}
