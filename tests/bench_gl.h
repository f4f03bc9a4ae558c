/* Two things that the frame benchmark draws itself: the floor under all frame times, one textured
   quad over the whole screen; and the full mesh with 4 x 4 samples a pixel. */
#ifndef BENCH_GL_H
#define BENCH_GL_H

#include "bench_look.h"

#include "examples/host/quality.h"

/* ---- The quad ----------------------------------------------------------- */

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

/* ---- The full mesh, supersampled ---------------------------------------- */

enum { FINE = 4 };

typedef struct fine {
    context frame;     /* FINE times as wide and high, of the same OpenGL context */
    uint8_t *large, *picture;
} fine;

static void fine_open(fine *f, const context *frame)
{
    memset(f, 0, sizeof *f);
    f->frame.width = frame->width * FINE;
    f->frame.height = frame->height * FINE;
    f->frame.reading = need_memory((size_t)f->frame.width * (size_t)f->frame.height * 4);
    f->large = need_memory((size_t)f->frame.width * (size_t)f->frame.height * 3);
    f->picture = need_memory((size_t)SCENE_PIXELS * 3);
    glGenFramebuffers(1, &f->frame.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, f->frame.framebuffer);
    glGenRenderbuffers(1, &f->frame.colour);
    glBindRenderbuffer(GL_RENDERBUFFER, f->frame.colour);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, f->frame.width, f->frame.height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                              f->frame.colour);
    glGenRenderbuffers(1, &f->frame.depth);
    glBindRenderbuffer(GL_RENDERBUFFER, f->frame.depth);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, f->frame.width, f->frame.height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, f->frame.depth);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        bench_stop("the supersampled reference", "its framebuffer is not complete");
}

/* Leaves the supersampled picture of what a view of the full mesh has decided last. */
static void fine_draw(fine *f, look *l, gl_terrain *gl, terrimp_view *full,
                      terrimp_camera camera)
{
    const context *frame = gl->frame;
    terrimp_callbacks callbacks;
    terrimp_stats now;
    need(terrimp_view_get_stats(full, &now));
    tour_tighten(&camera, &now);
    camera.width_px *= FINE;
    camera.height_px *= FINE;
    gl->frame = &f->frame;
    need(gl_terrain_begin(gl, &camera, scene_sky));
    callbacks = look_begin(l, gl);
    need(terrimp_view_render(full, &callbacks));
    look_end(l);
    gl_terrain_end(gl);
    gl->frame = frame;
    context_read(&f->frame, f->large);
    quality_shrink(f->large, f->frame.width, f->frame.height, FINE, f->picture);
}

static void fine_close(fine *f)
{
    glDeleteFramebuffers(1, &f->frame.framebuffer);
    glDeleteRenderbuffers(1, &f->frame.colour);
    glDeleteRenderbuffers(1, &f->frame.depth);
    free(f->frame.reading);
    free(f->large);
    free(f->picture);
}

#endif
