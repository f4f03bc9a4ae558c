/* The full mesh with 4 x 4 samples a pixel. */
#ifndef BENCH_FINE_H
#define BENCH_FINE_H

#include "bench_look.h"

#include "examples/host/quality.h"

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
    if (context_make_frame(&f->frame))
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
    context_close(&f->frame);
    free(f->large);
    free(f->picture);
}

#endif
