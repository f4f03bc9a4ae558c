#include "gl_costs.h"

#include "gl_terrain.h"
#include "stats.h"

#include <stdlib.h>
#include <string.h>

enum { RUNS = 8, GRID = 64, ATLAS = 1024, SLOT = 128 };

typedef struct bench {
    const context *frame;
    gl_program ground, impostor;
    GLuint array, vertices, indices, texture;
    GLuint atlas, atlas_frame, atlas_depth;
} bench;

/* What a run draws: after each capture, and at least once, some draws to the frame. */
typedef struct load {
    int captures, draws, impostors;
    int first_triangle, triangles; /* of each draw; beyond ALL lie two as large as the grid */
    float scale;                   /* part of the frame's width and height that the grid covers */
} load;

enum { ALL = 2 * GRID * GRID };
enum { FEW, DRAWS, TRIANGLES, GROUND, IMPOSTORS, CAPTURES, LOADS };
#define SMALL 0.1f
static const load loads[LOADS] = {
    { 0, 2, 0, 0, 2, SMALL }, { 0, 258, 0, 0, 2, SMALL }, { 0, 2, 0, 0, ALL, SMALL },
    { 0, 2, 0, ALL, 2, 1.0f }, { 0, 0, 2, ALL, 2, 1.0f }, { 8, 2, 0, 0, 2, SMALL },
};

static const char vertex[] =
    "#version 330 core\n"
    "in vec3 position;\n"
    "uniform mat4 matrix, texture_matrix;\n"
    "out vec3 stq;\n"
    "void main() {\n"
    "    stq = (texture_matrix * vec4(position, 1.0)).xyw;\n"
    "    gl_Position = matrix * vec4(position, 1.0);\n"
    "}\n";
static const char ground_fragment[] =
    "#version 330 core\n"
    "uniform sampler2D lightmap;\n"
    "in vec3 stq;\n"
    "out vec4 colour;\n"
    "void main() { colour = vec4(texture(lightmap, stq.xy).rgb, 1.0); }\n";
static const char impostor_fragment[] =
    "#version 330 core\n"
    "uniform sampler2D atlas;\n"
    "in vec3 stq;\n"
    "out vec4 colour;\n"
    "void main() {\n"
    "    vec4 c = textureProj(atlas, stq);\n"
    "    if (c.a < 0.5) discard;\n"
    "    colour = vec4(c.rgb / c.a, 1.0);\n"
    "}\n";

/* From -1..1 to 0..1, a little projective, as pictures are. */
static const float projective[16] = { 0.5f, 0, 0, 0.05f, 0, 0.5f, 0, 0.05f, 0, 0, 1, 0,
                                      0.5f, 0.5f, 0, 1 };

/* ---- One run ------------------------------------------------------------ */

/* Takes a program whose grid covers a part of the target's width and height. */
static void use(const gl_program *p, float scale)
{
    float matrix[16] = { 0 };
    matrix[0] = matrix[5] = scale;
    matrix[10] = matrix[15] = 1.0f;
    glUseProgram(p->id);
    glUniformMatrix4fv(p->matrix, 1, GL_FALSE, matrix);
}

static void capture(const bench *b)
{
    glBindFramebuffer(GL_FRAMEBUFFER, b->atlas_frame);
    glViewport(0, 0, SLOT, SLOT);
    glEnable(GL_SCISSOR_TEST);
    glScissor(0, 0, SLOT, SLOT);
    glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    use(&b->ground, 0.1f);
    glDrawElements(GL_TRIANGLES, 6, GL_UNSIGNED_SHORT, NULL);
    glDisable(GL_SCISSOR_TEST);
}

/* Each draw has a matrix of its own and other indices, as those of a terrain have: a driver that is
   given the same again does nothing. Small draws walk over the grid. */
static void draw(const bench *b, const gl_program *p, GLuint texture, const load *l, int i)
{
    float matrix[16];
    int first = l->first_triangle + (l->triangles == 2 && l->first_triangle == 0 ? i * 2 : 0);
    memcpy(matrix, projective, sizeof matrix);
    matrix[12] += (float)i * 1e-4f;
    use(p, l->scale);
    glUniformMatrix4fv(p->texture_matrix, 1, GL_FALSE, matrix);
    glBindTexture(GL_TEXTURE_2D, texture);
    glBindVertexArray(b->array);
    glDrawElements(GL_TRIANGLES, l->triangles * 3, GL_UNSIGNED_SHORT,
                   (const void *)((size_t)first * 3 * sizeof(uint16_t)));
}

/* Microseconds of a load. */
static double run(const bench *b, const load *l)
{
    double start;
    int turn, i;
    context_bind(b->frame);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glFinish();
    start = clock_ms();
    for (turn = 0; turn == 0 || turn < l->captures; turn++) {
        if (l->captures)
            capture(b);
        context_bind(b->frame);
        for (i = 0; i < l->draws; i++)
            draw(b, &b->ground, b->texture, l, i);
        for (i = 0; i < l->impostors; i++)
            draw(b, &b->impostor, b->atlas, l, i);
    }
    glFinish();
    return (clock_ms() - start) * 1000.0;
}

/* The loads take turns, so that a busy spell of the machine hits them alike. In the first round a
   driver may compile: it does not count. */
static void run_all(const bench *b, double fastest[LOADS])
{
    int round, i;
    for (round = 0; round <= RUNS; round++)
        for (i = 0; i < LOADS; i++) {
            double time = run(b, &loads[i]);
            if (round < 2 || time < fastest[i])
                fastest[i] = time;
        }
}

/* Noise may make a difference negative; and 0 would mean the default. */
static float cost(double microseconds)
{
    return microseconds > 1e-5 ? (float)microseconds : 1e-5f;
}

/* Differences between loads that are alike but for one thing. What a small triangle's pixels cost
   more than a large one's counts as the triangle's. */
static void measure(const bench *b, terrimp_costs *costs)
{
    double t[LOADS], one_draw, pixels = (double)b->frame->width * b->frame->height;
    run_all(b, t);
    one_draw = (t[DRAWS] - t[FEW]) / (loads[DRAWS].draws - loads[FEW].draws);
    costs->draw = cost(one_draw);
    costs->ground_px = cost((t[GROUND] - t[FEW]) / (2.0 * pixels));
    costs->impostor_px = cost((t[IMPOSTORS] - t[FEW]) / (2.0 * pixels));
    costs->triangle = cost(((t[TRIANGLES] - t[FEW]) / 2.0
                            - (double)(costs->ground_px * SMALL * SMALL) * pixels) / (ALL - 2));
    costs->capture = cost((t[CAPTURES] - t[FEW]) / loads[CAPTURES].captures - 2.0 * one_draw);
}

/* ---- What is drawn ------------------------------------------------------ */

static void make_grid(bench *b)
{
    static float xyz[(GRID + 1) * (GRID + 1)][3];
    static uint16_t list[GRID * GRID + 1][6]; /* the last one: the whole */
    const int opposite = (GRID + 1) * (GRID + 1) - 1;
    const int whole[6] = { 0, GRID, opposite - GRID, opposite - GRID, GRID, opposite };
    int x, z, k, i = 0;
    for (z = 0; z <= GRID; z++)
        for (x = 0; x <= GRID; x++) {
            xyz[z * (GRID + 1) + x][0] = (float)x * (2.0f / GRID) - 1.0f;
            xyz[z * (GRID + 1) + x][1] = (float)z * (2.0f / GRID) - 1.0f;
        }
    for (z = 0; z < GRID; z++)
        for (x = 0; x < GRID; x++, i++) {
            int corner = z * (GRID + 1) + x, above = corner + GRID + 1;
            const int quad[6] = { corner, corner + 1, above, above, corner + 1, above + 1 };
            for (k = 0; k < 6; k++)
                list[i][k] = (uint16_t)quad[k];
        }
    for (k = 0; k < 6; k++)
        list[i][k] = (uint16_t)whole[k];
    b->array = gl_array_make(&b->vertices, xyz, sizeof xyz);
    glGenBuffers(1, &b->indices);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, b->indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof list, list, GL_STATIC_DRAW);
    gl_point(0, 3, GL_FLOAT, 0, 0);
}

static GLuint make_texture(const uint8_t *rgba, GLint smaller)
{
    GLuint texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, smaller);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, ATLAS, ATLAS, 0, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
    glGenerateMipmap(GL_TEXTURE_2D);
    return texture;
}

static const char *open_bench(bench *b)
{
    uint8_t *texels = malloc((size_t)ATLAS * ATLAS * 4);
    if (!texels)
        return "no memory for a texture";
    memset(texels, 0xff, (size_t)ATLAS * ATLAS * 4); /* opaque: every pixel is drawn */
    b->texture = make_texture(texels, GL_LINEAR_MIPMAP_LINEAR);
    b->atlas = make_texture(texels, GL_LINEAR);
    free(texels);
    glGenRenderbuffers(1, &b->atlas_depth);
    glBindRenderbuffer(GL_RENDERBUFFER, b->atlas_depth);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, ATLAS, ATLAS);
    glGenFramebuffers(1, &b->atlas_frame);
    glBindFramebuffer(GL_FRAMEBUFFER, b->atlas_frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, b->atlas, 0);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                              b->atlas_depth);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return "the atlas cannot be rendered to";
    b->ground = gl_program_make(vertex, ground_fragment);
    b->impostor = gl_program_make(vertex, impostor_fragment);
    if (!b->ground.id || !b->impostor.id)
        return "a shader does not compile";
    make_grid(b);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glDisable(GL_BLEND);
    return glGetError() == GL_NO_ERROR ? NULL : "OpenGL has no memory for the measurement";
}

static void close_bench(bench *b)
{
    glDeleteVertexArrays(1, &b->array);
    glDeleteBuffers(1, &b->vertices);
    glDeleteBuffers(1, &b->indices);
    glDeleteTextures(1, &b->texture);
    glDeleteTextures(1, &b->atlas);
    glDeleteFramebuffers(1, &b->atlas_frame);
    glDeleteRenderbuffers(1, &b->atlas_depth);
    glDeleteProgram(b->ground.id);
    glDeleteProgram(b->impostor.id);
}

const char *gl_costs_measure(const context *frame, terrimp_costs *costs)
{
    const char *trouble;
    bench b;
    memset(&b, 0, sizeof b);
    b.frame = frame;
    trouble = open_bench(&b);
    if (!trouble)
        measure(&b, costs);
    close_bench(&b);
    glDisable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glUseProgram(0);
    context_bind(frame);
    return trouble;
}
