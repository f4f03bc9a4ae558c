/* Flies a camera over a large terrain and draws it with terrain impostors and geometrical
   mipmapping, or with one of them, through OpenGL without a window. Leaves pictures, a table with a
   line a frame, and a summary.
   Build:  make flyover
   Use:    flyover --dem N42E001.hgt --frames 300 --out pictures --save-every 100 --compare
   Expect: `key value` lines; with --compare, PSNR and speed-up against the full mesh. */
#define _POSIX_C_SOURCE 200112L /* isatty, mkdir */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "host/context.h"
#include "host/gl_terrain.h"
#include "host/image.h"
#include "host/lightmap.h"
#include "host/options.h"
#include "host/stats.h"
#include "host/tour.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define DEGREE 0.017453293f

/* A way of drawing the terrain, with the times it took. */
typedef struct contender {
    const char *name;
    terrimp_view *view;
    terrimp_view_desc desc; /* resolved */
    terrimp_stats now;  /* of the newest frame */
    stats ms;
    uint8_t *picture;   /* of the newest frame that was read back */
} contender;

typedef struct flyover {
    options options;
    tour tour;                    /* samples and flight */
    terrimp_terrain *terrain;
    void *walls;                  /* with --hide only, like the next */
    terrimp_horizon horizon;
    terrimp_terrain_info info;
    context context;
    gl_terrain gl;
    contender chosen, full;       /* full takes part with --compare only */
    FILE *table;
    stats psnr, psnr_terrain;     /* of each compared frame that shows terrain [dB] */
    size_t empty;                 /* frames with nothing but sky */
    int shows_terrain;            /* the newest does not */
    double captures, captured_texels, captured_triangles, triangles, draws;
    double texels_used;
    float worst_parallax_px;
} flyover;

/* Says what is wrong, in one line, and ends the program. */
static void stop(const char *trouble)
{
    fprintf(stderr, "flyover: %s\n", trouble);
    exit(2);
}

static void stop_file(const char *path, const char *trouble)
{
    fprintf(stderr, "flyover: %s: %s\n", path, trouble);
    exit(2);
}

static void need(terrimp_result result)
{
    if (result != TERRIMP_OK)
        stop(terrimp_result_text((int)result));
}

static void *allocate(size_t bytes)
{
    void *memory = malloc(bytes);
    if (!memory)
        stop("out of memory");
    return memory;
}

/* ---- The terrain -------------------------------------------------------- */

static void load_samples(flyover *f)
{
    const options *o = &f->options;
    tour_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.dem = o->dem;
    desc.file = o->file;
    desc.size = o->terrain_size;
    desc.seed = o->seed;
    memcpy(desc.spacing, o->spacing, sizeof desc.spacing);
    memcpy(desc.origin, o->origin, sizeof desc.origin);
    desc.height_scale = o->height_scale;
    desc.path = o->path;
    desc.frames = o->frames;
    desc.speed = o->speed;
    desc.above = o->above;
    desc.fps = o->fps;
    desc.fov_y_rad = o->fov_degrees * DEGREE;
    desc.width = o->width;
    desc.height = o->height;
    if (!tour_load(&f->tour, &desc))
        stop(f->tour.error);
    options_print_ignored(o, f->tour.dem.is_raw, stderr);
    if (f->tour.dem.remark)
        fprintf(stderr, "flyover: %s: %s\n", o->dem, f->tour.dem.remark);
    if (o->dem)
        printf("voids_filled %zu\nspacing %g,%g\nheight_scale %g\n", f->tour.voids_filled,
               (double)f->tour.field.spacing_x, (double)f->tour.field.spacing_z,
               (double)(f->tour.field.height_scale > 0.0f ? f->tour.field.height_scale : 1.0f));
}

static void build_terrain(flyover *f)
{
    terrimp_terrain_desc desc;
    double start;
    load_samples(f);
    memset(&desc, 0, sizeof desc);
    desc.field = f->tour.field;
    desc.chunk_quads = f->options.chunk;
    start = clock_ms();
    need(terrimp_terrain_create(&desc, NULL, &f->terrain));
    need(terrimp_terrain_get_info(f->terrain, &f->info));
    printf("samples %ux%u\nchunks %u\nbuild_ms %.1f\n", f->tour.field.width,
           f->tour.field.depth, f->info.chunks_x * f->info.chunks_z, clock_ms() - start);
}

static void open_horizon(flyover *f)
{
    const terrimp_quadtree *tree = terrimp_terrain_tree(f->terrain);
    f->walls = allocate(terrimp_walls_bytes(tree));
    need(terrimp_walls_build(tree, NULL, f->walls));
    need(terrimp_horizon_init(&f->horizon, tree, f->walls));
}

static void open_graphics(flyover *f)
{
    uint8_t *lightmap = lightmap_bake(&f->tour.field);
    gl_terrain_desc desc;
    const char *trouble;
    if (!lightmap)
        stop("no memory for the lightmap");
    memset(&desc, 0, sizeof desc);
    desc.frame = &f->context;
    desc.terrain = f->terrain;
    desc.field = &f->tour.field;
    desc.lightmap = lightmap;
    desc.atlas_size = f->chosen.desc.atlas_size;
    desc.exact_depth = f->chosen.desc.exact_depth != NULL;
    trouble = context_open(&f->context, (int)f->options.width, (int)f->options.height);
    if (!trouble)
        trouble = gl_terrain_open(&f->gl, &desc);
    if (!trouble && f->chosen.desc.morph_ratio > 1.0f)
        trouble = gl_terrain_use_morphing(&f->gl);
    if (trouble)
        stop(trouble);
    free(lightmap);
    printf("renderer %s\n", context_renderer());
}

/* ---- The views ---------------------------------------------------------- */

static void open_contender(flyover *f, contender *c, const char *name, int mode)
{
    const options *o = &f->options;
    terrimp_view_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.mode = mode;
    desc.tolerance_px = o->tolerance;
    desc.ground_tolerance_px = o->ground_tolerance;
    desc.ground_rule = o->rule;
    desc.bound = terrimp_geomip_bound();
    desc.morph_ratio = o->morph;
    desc.fade_start = o->fade[0];
    desc.fade_end = o->fade[1];
    desc.max_angle_rad = o->max_angle_degrees * DEGREE;
    desc.texels_per_px = o->texels;
    desc.impostor_px = o->impostor_px;
    desc.atlas_size = o->atlas;
    desc.atlas_count = o->atlas_count;
    desc.max_captures = o->max_captures;
    desc.max_capture_texels = o->max_capture_texels;
    desc.max_capture_triangles = o->max_capture_triangles;
    desc.no_lookahead = o->no_lookahead;
    desc.no_splits = o->no_splits;
    desc.no_spreading = o->no_spreading;
    desc.exact_depth = o->exact_depth ? terrimp_view_exact_depth() : NULL;
    desc.hider = f->walls && c == &f->chosen ? &f->horizon.hider : NULL;
    c->name = name;
    c->picture = allocate((size_t)o->width * o->height * 3);
    need(terrimp_view_desc_resolve(f->terrain, &desc, &c->desc));
    need(terrimp_view_create(f->terrain, &desc, NULL, &c->view));
}

/* ---- A frame ------------------------------------------------------------ */

/* Draws a frame; what is timed is all that a host would do for it. */
static double draw_frame(flyover *f, contender *c, terrimp_camera camera)
{
    terrimp_callbacks callbacks = gl_terrain_callbacks(&f->gl);
    double start = clock_ms(), ms;
    need(terrimp_view_update(c->view, &camera));
    need(terrimp_view_get_stats(c->view, &c->now));
    tour_tighten(&camera, &c->now);
    need(gl_terrain_begin(&f->gl, &camera, f->options.sky));
    need(terrimp_view_render(c->view, &callbacks));
    gl_terrain_end(&f->gl);
    ms = clock_ms() - start;
    stats_add(&c->ms, ms);
    return ms;
}

static void write_picture(const flyover *f, const char *name, size_t frame, const uint8_t *rgb,
                          int width, int height)
{
    char path[1024];
    const char *trouble;
    snprintf(path, sizeof path, "%s/%05zu_%s.png", f->options.out, frame, name);
    trouble = image_write_png(path, rgb, width, height);
    if (trouble)
        stop_file(path, trouble);
}

/* Saves the frame just drawn, with its outlines and atlases if they are wanted. */
static void save_frame(flyover *f, contender *c, size_t frame)
{
    int width = (int)f->options.width, height = (int)f->options.height, i;
    write_picture(f, c->name, frame, c->picture, width, height);
    if (f->options.wireframe) {
        uint8_t *lines = allocate((size_t)width * (size_t)height * 3);
        char name[64];
        need(gl_terrain_wireframe(&f->gl, c->view));
        context_read(&f->context, lines);
        snprintf(name, sizeof name, "%s_wireframe", c->name);
        write_picture(f, name, frame, lines, width, height);
        free(lines);
    }
    for (i = 0; f->options.show_atlas && c == &f->chosen && i < (int)c->desc.atlas_count; i++) {
        int side = f->gl.atlas_size;
        uint8_t *atlas = allocate((size_t)side * (size_t)side * 3);
        char name[64];
        snprintf(name, sizeof name, "atlas_%d", i);
        if (gl_terrain_read_atlas(&f->gl, i, atlas))
            write_picture(f, name, frame, atlas, side, side);
        free(atlas);
    }
}

static double run_contender(flyover *f, contender *c, const terrimp_camera *camera, size_t frame)
{
    double ms = draw_frame(f, c, *camera);
    int saved = f->options.out && options_saves(&f->options, (uint32_t)frame);
    if (saved || f->options.compare)
        context_read(&f->context, c->picture);
    if (saved)
        save_frame(f, c, frame);
    return ms;
}

/* How far the chosen mode's picture is from the full one's. */
static void compare(flyover *f, size_t frame)
{
    size_t pixels = (size_t)f->options.width * f->options.height;
    const uint8_t *a = f->chosen.picture, *b = f->full.picture;
    f->shows_terrain = image_not_sky(a, pixels, f->options.sky)
                       || image_not_sky(b, pixels, f->options.sky);
    if (!f->shows_terrain)
        return;
    stats_add(&f->psnr, image_psnr(image_mean_square(a, b, pixels, NULL)));
    stats_add(&f->psnr_terrain, image_psnr(image_mean_square(a, b, pixels, f->options.sky)));
    if (f->options.out && options_saves(&f->options, (uint32_t)frame)) {
        image_difference(a, b, pixels, 1, f->chosen.picture);
        write_picture(f, "difference", frame, f->chosen.picture, (int)f->options.width,
                      (int)f->options.height);
    }
}

/* ---- Figures ------------------------------------------------------------ */

static void open_table(flyover *f)
{
    if (!f->options.stats)
        return;
    f->table = fopen(f->options.stats, "w");
    if (!f->table)
        stop_file(f->options.stats, strerror(errno));
    fprintf(f->table, "frame\tms\ttriangles\tdraws\tcaptures\tcaptured_texels\t"
                      "captured_triangles\tvisible\tground\timpostors\twaiting\tdue\tshortfall\t"
                      "parallax_px\treuse%s\n",
            f->options.compare ? "\tfull_ms\tpsnr\tpsnr_terrain" : "");
}

static void note_frame(flyover *f, size_t frame, double ms, double full_ms)
{
    const terrimp_stats *s = &f->chosen.now;
    f->empty += !f->shows_terrain;
    f->captures += s->captures;
    f->captured_texels += s->captured_texels;
    f->captured_triangles += s->captured_triangles;
    f->triangles += s->triangles;
    f->draws += s->draws;
    f->texels_used += (double)s->texels_used;
    if (s->worst_parallax_px > f->worst_parallax_px)
        f->worst_parallax_px = s->worst_parallax_px;
    if (!f->table)
        return;
    fprintf(f->table, "%zu\t%.3f\t%u\t%u\t%u\t%u\t%u\t%u", frame, ms, s->triangles, s->draws,
            s->captures, s->captured_texels, s->captured_triangles, s->visible);
    fprintf(f->table, "\t%u\t%u\t%u\t%u\t%.3f\t%.3f\t%.1f", s->ground, s->impostors, s->waiting,
            s->captures_due, (double)s->shortfall, (double)s->worst_parallax_px,
            (double)s->reuse);
    if (f->options.compare && f->shows_terrain)
        fprintf(f->table, "\t%.3f\t%.2f\t%.2f", full_ms, f->psnr.values[f->psnr.count - 1],
                f->psnr_terrain.values[f->psnr_terrain.count - 1]);
    else if (f->options.compare)
        fprintf(f->table, "\t%.3f\tnan\tnan", full_ms);
    fprintf(f->table, "\n");
}

static void show_progress(const flyover *f, size_t frame, double ms)
{
    if (isatty(2))
        fprintf(stderr, "\rframe %zu of %zu, %.1f ms%s", frame + 1, f->tour.flight.count, ms,
                frame + 1 == f->tour.flight.count ? "        \n" : "        ");
}

static void print_summary(const flyover *f)
{
    double frames = (double)f->tour.flight.count;
    stats_summary summary = stats_summarise(&f->chosen.ms);
    printf("mode %s\nframes %.0f\n", f->options.mode, frames);
    stats_print(stdout, "ms", summary);
    printf("ms_first %.3f\n", f->chosen.ms.values[0]);
    printf("triangles_mean %.0f\ndraws_mean %.1f\n", f->triangles / frames, f->draws / frames);
    printf("captures_mean %.2f\ncaptured_texels_mean %.0f\ncaptured_triangles_mean %.0f\n",
           f->captures / frames, f->captured_texels / frames, f->captured_triangles / frames);
    printf("reuse %.1f\ntexels_used_mean %.0f\natlas_failures %u\nevictions %u\n",
           (double)f->chosen.now.reuse, f->texels_used / frames, f->chosen.now.atlas_failures,
           f->chosen.now.evictions);
    printf("worst_parallax_px %.3f\n", (double)f->worst_parallax_px);
    if (f->empty)
        printf("frames_without_terrain %zu\n", f->empty);
    if (f->options.compare) {
        stats_summary full = stats_summarise(&f->full.ms);
        stats_summary psnr = stats_summarise(&f->psnr);
        stats_summary terrain = stats_summarise(&f->psnr_terrain);
        stats_print(stdout, "full_ms", full);
        if (f->psnr.count) {
            printf("psnr_mean %.2f\npsnr_worst %.2f\n", psnr.mean, psnr.least);
            printf("psnr_terrain_mean %.2f\n", terrain.mean);
            printf("psnr_terrain_worst %.2f\n", terrain.least);
        }
        printf("speed_up %.2f\n", full.median / summary.median);
    }
}

/* ---- All of it ---------------------------------------------------------- */

static void fly(flyover *f)
{
    size_t frame;
    for (frame = 0; frame < f->tour.flight.count; frame++) {
        terrimp_camera camera = tour_camera(&f->tour, &f->info.box, frame);
        double ms = run_contender(f, &f->chosen, &camera, frame), full_ms = 0.0;
        f->shows_terrain = f->chosen.now.triangles > 0;
        if (f->options.compare) {
            full_ms = run_contender(f, &f->full, &camera, frame);
            compare(f, frame);
        }
        note_frame(f, frame, ms, full_ms);
        show_progress(f, frame, ms);
    }
}

static void close_contender(contender *c)
{
    terrimp_view_destroy(c->view);
    stats_free(&c->ms);
    free(c->picture);
}

static void close_all(flyover *f)
{
    if (f->table && fclose(f->table) != 0)
        stop("the table could not be written to its end");
    close_contender(&f->chosen);
    close_contender(&f->full);
    stats_free(&f->psnr);
    stats_free(&f->psnr_terrain);
    gl_terrain_close(&f->gl);
    context_close(&f->context);
    free(f->walls);
    terrimp_terrain_destroy(f->terrain);
    tour_close(&f->tour);
}

int main(int argc, char **argv)
{
    static flyover f; /* all zero */
    if (!options_parse(&f.options, argc, argv))
        stop(f.options.error);
    if (f.options.help) {
        options_print_help(stdout);
        return 0;
    }
    build_terrain(&f);
    if (!tour_plan(&f.tour))
        stop(f.tour.error);
    if (f.options.hide)
        open_horizon(&f);
    open_contender(&f, &f.chosen, f.options.mode, f.options.terrimp_mode);
    if (f.options.compare)
        open_contender(&f, &f.full, "full", TERRIMP_MODE_FULL);
    open_graphics(&f);
    if (f.options.out && mkdir(f.options.out, 0777) != 0 && errno != EEXIST)
        stop_file(f.options.out, strerror(errno));
    open_table(&f);
    fly(&f);
    print_summary(&f);
    if (f.empty == f.tour.flight.count)
        fprintf(stderr, "flyover: the terrain is in sight in no frame\n");
    close_all(&f);
    return 0;
}
