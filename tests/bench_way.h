/* A way of drawing the terrain, what it needs for that, and what it was measured to cost. */
#ifndef BENCH_WAY_H
#define BENCH_WAY_H

#include "bench_hess.h"
#include "bench_look.h"
#include "bench_scene.h"

#include "examples/host/quality.h"

/* How to draw. Numbers that are 0 are left to the library. */
typedef struct way {
    const char *name;           /* in the tables */
    const char *family;         /* its series in the plots */
    int mode;                   /* terrimp_mode */
    int rule;                   /* terrimp_geomip_rule, of ground */
    float tolerance_px;         /* of impostors; in GEOMIP of ground */
    float morph_ratio;
    uint32_t chunk_quads;       /* 64 or 128; 0: 64 */
    float foreground;           /* [wu] where ground has ended; it fades over the last quarter */
    float texels_per_px;
    int hiding;                 /* what ridges hide is left out */
    int hess;                   /* as in the thesis: by bench_hess.h, not by a view */
} way;

/* Pictures of one moment are only kept while they are compared. */
typedef struct contender {
    const way *way;
    look *look;                 /* not its own */
    terrimp_view *view;
    hess *hess;                 /* instead of the view */
    terrimp_horizon horizon;    /* of a way that hides */
    gl_terrain *gl, own_gl;     /* own: when the way keeps pictures */
    terrimp_stats now;          /* of the newest frame */
    stats start_ms;             /* of the start of the flight, when its pictures are new */
    stats ms, cpu_ms;           /* of all frames after it, like all that follows */
    stats ratio;                /* the same: ms over the newest that the full mesh took */
    double frames, triangles, draws, captures, captured_texels, waiting; /* sums */
    stats psnr, psnr_terrain, ssim;       /* against the full mesh [dB, dB, 1] */
    stats fine_psnr, fine_ssim;           /* over terrain, against the full mesh supersampled */
    stats shimmer, pop_pixel, pop_block;  /* quality_change */
    double holes, low_pixels;             /* worst and mean of quality_holes */
    uint8_t *before, *picture, *worst, *worst_truth;
    size_t picture_frame, worst_frame, pop_frame;
    quality_change pop;                   /* the worst one */
    uint8_t *pop_crops[4];                /* around it: the full mesh before and now, the way */
    uint8_t *hole_crops[2];               /* around the first hole: the full mesh, the way */
    size_t hole_frame;
} contender;

/* Whether a frame depends on those before: then every frame of the flight must be drawn. */
static int way_has_memory(const way *w)
{
    return w->mode != TERRIMP_MODE_FULL && w->mode != TERRIMP_MODE_GEOMIP;
}

static terrimp_view_desc way_describe(const way *w)
{
    terrimp_view_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.mode = w->mode;
    desc.tolerance_px = w->tolerance_px;
    if (w->mode == TERRIMP_MODE_GEOMIP)
        desc.ground_tolerance_px = w->tolerance_px;
    desc.ground_rule = w->rule;
    desc.bound = terrimp_geomip_bound();
    desc.morph_ratio = w->morph_ratio;
    desc.fade_start = w->foreground * 0.75f;
    desc.fade_end = w->foreground;
    desc.texels_per_px = w->texels_per_px;
    return desc;
}

/* A way has OpenGL's side for itself when it keeps pictures, or morphs. */
static void contender_open(contender *c, const way *w, scene *s, look *l)
{
    int terrain = scene_terrain(s, w->chunk_quads ? w->chunk_quads : 64);
    terrimp_view_desc desc = way_describe(w);
    memset(c, 0, sizeof *c);
    c->way = w;
    c->look = l;
    c->picture = need_memory((size_t)SCENE_PIXELS * 3);
    c->before = need_memory((size_t)SCENE_PIXELS * 3);
    c->picture_frame = c->worst_frame = c->pop_frame = SIZE_MAX;
    c->pop.block = -255.0;
    if (w->hiding) {
        scene_open_horizon(s, terrain, &c->horizon);
        desc.hider = &c->horizon.hider;
    }
    need(terrimp_view_desc_resolve(s->terrain[terrain], &desc, &desc));
    if (w->hess) {
        c->hess = need_memory(sizeof *c->hess);
        hess_open(c->hess, s->terrain[terrain], &desc);
    } else {
        need(terrimp_view_create(s->terrain[terrain], &desc, NULL, &c->view));
    }
    if ((!way_has_memory(w) || s->shared_atlas == desc.atlas_size) && w->morph_ratio <= 1.0f) {
        c->gl = scene_shared_gl(s, terrain);
        return;
    }
    c->gl = &c->own_gl;
    scene_open_gl(s, terrain, c->hess ? c->hess->atlas_size : desc.atlas_size, c->gl);
    if (w->morph_ratio > 1.0f)
        look_need(gl_terrain_use_morphing(c->gl));
}

static void contender_note(contender *c, double ms, double cpu_ms)
{
    stats_add(&c->ms, ms);
    stats_add(&c->cpu_ms, cpu_ms);
    c->frames += 1.0;
    c->triangles += c->now.triangles;
    c->draws += c->now.draws;
    c->waiting += c->now.waiting;
    c->captures += c->now.captures;
    c->captured_texels += c->now.captured_texels;
}

static void contender_update(contender *c, const terrimp_camera *camera)
{
    if (c->hess) {
        hess_update(c->hess, camera);
        c->now = c->hess->stats;
    } else {
        need(terrimp_view_update(c->view, camera));
        need(terrimp_view_get_stats(c->view, &c->now));
    }
}

/* Draws a frame; what is timed is all that a host would do for it. */
static void contender_draw(contender *c, terrimp_camera camera, int at_start)
{
    double start = clock_ms(), cpu_start = clock_cpu_ms();
    terrimp_callbacks callbacks;
    contender_update(c, &camera);
    tour_tighten(&camera, &c->now);
    need(gl_terrain_begin(c->gl, &camera, scene_sky));
    callbacks = look_begin(c->look, c->gl);
    if (c->hess)
        hess_render(c->hess, &callbacks);
    else
        need(terrimp_view_render(c->view, &callbacks));
    look_end(c->look);
    gl_terrain_end(c->gl);
    if (at_start)
        stats_add(&c->start_ms, clock_ms() - start);
    else
        contender_note(c, clock_ms() - start, clock_cpu_ms() - cpu_start);
}

/* Reads the frame just drawn; the one before stays. */
static void contender_read(contender *c, const context *frame_buffer, size_t frame)
{
    uint8_t *swap = c->before;
    c->before = c->picture;
    c->picture = swap;
    c->picture_frame = frame;
    context_read(frame_buffer, c->picture);
}

static void contender_close(contender *c)
{
    stats *lists[12];
    int i;
    lists[0] = &c->ms;
    lists[1] = &c->cpu_ms;
    lists[2] = &c->psnr;
    lists[3] = &c->psnr_terrain;
    lists[4] = &c->ssim;
    lists[5] = &c->fine_psnr;
    lists[6] = &c->fine_ssim;
    lists[7] = &c->shimmer;
    lists[8] = &c->pop_pixel;
    lists[9] = &c->pop_block;
    lists[10] = &c->start_ms;
    lists[11] = &c->ratio;
    for (i = 0; i < 12; i++)
        stats_free(lists[i]);
    if (c->hess)
        hess_close(c->hess);
    free(c->hess);
    terrimp_view_destroy(c->view);
    if (c->gl == &c->own_gl)
        gl_terrain_close(&c->own_gl);
    free(c->before);
    free(c->picture);
    free(c->worst);
    free(c->worst_truth);
    for (i = 0; i < 4; i++)
        free(c->pop_crops[i]);
    for (i = 0; i < 2; i++)
        free(c->hole_crops[i]);
}

#endif
