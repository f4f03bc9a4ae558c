/* An OpenGL context without a window, 3.3 or an old one, and one framebuffer to draw frames into.
   OSMesa (-DHOST_OSMESA) or EGL without a surface (-DHOST_EGL): only context.c knows which. A
   program with a window fills in a context of its own, and uses context_bind and context_read. */
#ifndef HOST_CONTEXT_H
#define HOST_CONTEXT_H

#include "gl.h"

#include <stdint.h>

typedef struct context {
    int width, height;     /* of the frame, pixels */
    GLuint framebuffer;    /* RGBA8 colour with 24-bit depth, own making: alike on both systems */
    GLuint colour, depth;  /* its renderbuffers */
    int clip_x, clip_width; /* gl_terrain draws only these columns; width 0: all */
    uint8_t *reading;      /* [height][width][4] on its way to context_read */
    void *system;          /* what the windowless system keeps */
} context;

/* Makes a context current and binds its framebuffer, width x height pixels.
   Returns null, or one line that says what is missing. */
const char *context_open(context *c, int width, int height);

/* The same for programs that use nothing newer than OpenGL 1.1: a context of the old kind, with
   matrix stacks and client arrays. The frame is the system's own frame buffer, framebuffer 0, with
   8 bits of alpha and 24 of depth. */
const char *context_open_old(context *c, int width, int height);

/* Makes and binds the framebuffer of a frame whose width and height are set, beside that of
   context_open and in its context. Returns null, or one line that says what is wrong. */
const char *context_make_frame(context *c);

/* Draw calls go to the frame again (after a capture); the viewport is all of it. */
void context_bind(const context *c);

/* Waits for the frame and copies it to rgb[height][width][3], top row first. */
void context_read(const context *c, uint8_t *rgb);

/* The renderer's own name, and the system under it, e.g. "OSMesa: llvmpipe (...)". */
const char *context_renderer(void);

/* A function of OpenGL that came after 3.3; cast it to its type. It may be null, or of no use where
   the version or extension is missing. */
typedef void (*context_function)(void);
context_function context_find(const char *name);

/* Frees everything; fine after a failed open, and twice. */
void context_close(context *c);

#endif
