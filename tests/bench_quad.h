/* The floor under all frame times: one textured quad over the whole screen. */
#ifndef BENCH_QUAD_H
#define BENCH_QUAD_H

#include "bench_scene.h"

static const char quad_vertex[] =
    "#version 330 core\n"
    "out vec2 uv;\n"
    "out vec3 place;\n"
    "void main() {\n"
    "    place = vec3(0.0);\n"
    "    uv = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));\n"
    "    gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);\n"
    "}\n";

typedef struct quad {
    gl_program program;
    GLuint array;
    stats ms;
} quad;

static void quad_open(quad *q)
{
    memset(q, 0, sizeof *q);
    q->program = gl_program_make(quad_vertex, gl_ground_fragment);
    if (!q->program.id)
        bench_stop("the quad", "a shader does not compile");
    glGenVertexArrays(1, &q->array);
}

/* Draws and times it, textured with the scene's lightmap. */
static void quad_draw(quad *q, const context *frame, GLuint texture)
{
    double start = clock_ms();
    context_bind(frame);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(q->program.id);
    glBindVertexArray(q->array);
    glBindTexture(GL_TEXTURE_2D, texture);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    glFinish();
    stats_add(&q->ms, clock_ms() - start);
}

static void quad_close(quad *q)
{
    glDeleteProgram(q->program.id);
    glDeleteVertexArrays(1, &q->array);
    stats_free(&q->ms);
}

#endif
