/* Measures frames: flies over each scene, draws every frame in several ways in turn, and prints
   what each costs, how near it comes to the full mesh, and how it changes from frame to frame.

   Build:  make bench_frames
   Use:    build/bench_frames         (in the project's directory)
   Leaves: build/bench/frames.md (what it prints), frames.tsv (all figures, a line a scene and way),
           frame_times.tsv (every frame), *.svg (plots), *.png (of each way the worst frame: full
           mesh, the way, their difference), *_pop.png (around its worst pop: the full mesh before
           and after, the way before and after), *_hole.png (around its first hole, if any)

   BENCH_FRAMES=n   frames of a flight [each scene's own, 24 to 120]; the thesis has 10000
   BENCH_ALL=1      the thesis' whole protocol, and every frame compared, not only some
   BENCH_ONLY=text  only scenes with this in their key (the names of the files)
   BENCH_WAYS=text  only ways with this in their name, and the full mesh
   TERRIMP_DATA     where real tiles and flight paths are [../shared/data]

   All ways take turns in one process, frame by frame, so that a busy machine harms all alike: trust
   the ratios. Ways that do not depend on the frames before are drawn in every few frames only. */
#define _POSIX_C_SOURCE 200112L /* mkdir */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_fine.h"
#include "bench_peers.h"
#include "bench_plot.h"
#include "bench_quad.h"
#include "bench_way.h"

#include "examples/host/image.h"

/* ---- What is measured --------------------------------------------------- */

#define FULL { .name = "full", .family = "full", .mode = TERRIMP_MODE_FULL }
#define AUTO(tolerance_)                                                                  \
    { .name = "auto " #tolerance_ " px", .family = "auto", .mode = TERRIMP_MODE_AUTO,     \
      .tolerance_px = (float)tolerance_ }
#define IMPOSTOR(tolerance_)                                                              \
    { .name = "impostor " #tolerance_ " px", .family = "impostor",                        \
      .mode = TERRIMP_MODE_IMPOSTOR, .tolerance_px = (float)tolerance_ }
#define GEOMIP(tolerance_)                                                                \
    { .name = "geomip " #tolerance_ " px", .family = "geomip", .mode = TERRIMP_MODE_GEOMIP, \
      .tolerance_px = (float)tolerance_ }
#define BOUND(tolerance_)                                                                 \
    { .name = "geomip bound " #tolerance_ " px", .family = "geomip bound",                \
      .mode = TERRIMP_MODE_GEOMIP, .rule = TERRIMP_GEOMIP_BOUND,                          \
      .tolerance_px = (float)tolerance_ }
#define MORPHING(tolerance_)                                                              \
    { .name = "geomip " #tolerance_ " px, morphing", .family = "geomip morphing",         \
      .mode = TERRIMP_MODE_GEOMIP, .tolerance_px = (float)tolerance_, .morph_ratio = 1.5f }
/* Without what ridges hide. */
#define FULL_HIDING                                                                       \
    { .name = "full, hiding", .family = "full", .mode = TERRIMP_MODE_FULL, .hiding = 1 }
#define AUTO_HIDING(tolerance_)                                                           \
    { .name = "auto " #tolerance_ " px, hiding", .family = "auto", .hiding = 1,           \
      .mode = TERRIMP_MODE_AUTO, .tolerance_px = (float)tolerance_ }
#define GEOMIP_HIDING(tolerance_)                                                         \
    { .name = "geomip " #tolerance_ " px, hiding", .family = "geomip", .hiding = 1,       \
      .mode = TERRIMP_MODE_GEOMIP, .tolerance_px = (float)tolerance_ }
/* As in the thesis; foreground and chunk width as in its tables: "200, 64". */
#define HESS(foreground_, chunk_)                                                         \
    { .name = "Hess " #foreground_ ", " #chunk_, .family = "Hess " #chunk_,               \
      .mode = TERRIMP_MODE_IMPOSTOR, .chunk_quads = chunk_, .foreground = foreground_,    \
      .hess = 1, .texels_per_px = 1.0f }

static const way path_ways[] = {
    FULL, AUTO(0.5), AUTO(1), AUTO(2), AUTO(4),
    { .name = "Hess", .family = "Hess", .mode = TERRIMP_MODE_IMPOSTOR, .hess = 1,
      .texels_per_px = 1.0f },
    { .name = "Hess, 2 texels a px", .family = "Hess", .mode = TERRIMP_MODE_IMPOSTOR, .hess = 1 },
    IMPOSTOR(1),
    GEOMIP(0.25), GEOMIP(0.5), GEOMIP(1), GEOMIP(2), GEOMIP(4), GEOMIP(8),
    BOUND(2), BOUND(4), BOUND(8), MORPHING(1),
    /* only with BENCH_ALL: */
    AUTO(8), BOUND(1)
};

static const way look_ways[] = {
    FULL, AUTO(1), AUTO(2), AUTO(4), IMPOSTOR(1),
    GEOMIP(0.5), GEOMIP(1), GEOMIP(4), BOUND(2), BOUND(4)
};

static const way tile_ways[] = {
    FULL, AUTO(0.5), AUTO(1), AUTO(2), IMPOSTOR(1),
    GEOMIP(0.5), GEOMIP(1), GEOMIP(2), GEOMIP(4), BOUND(2)
};

static const way low_ways[] = {
    FULL, FULL_HIDING, AUTO(1), GEOMIP(1),
    AUTO_HIDING(0.5), AUTO_HIDING(1), AUTO_HIDING(2), AUTO_HIDING(4), AUTO_HIDING(8),
    GEOMIP_HIDING(0.5), GEOMIP_HIDING(1), GEOMIP_HIDING(2), GEOMIP_HIDING(4), GEOMIP_HIDING(8)
};

static const way thesis_ways[] = {
    FULL, AUTO(1), GEOMIP(1), HESS(400, 64), HESS(400, 128),
    /* only with BENCH_ALL, or on the terrain of 2049: */
    HESS(200, 64), HESS(600, 64), HESS(200, 128), HESS(600, 128),
    /* only with BENCH_ALL: */
    GEOMIP(0.5), GEOMIP(2), GEOMIP(4), GEOMIP(8), IMPOSTOR(1)
};

enum { WAYS_MAX = 32 }; /* in a run */

/* One flight of one list of ways. */
typedef struct run {
    scene_desc scene;
    int look;
    const way *ways;
    size_t way_count, all_way_count; /* by default, and with BENCH_ALL */
    size_t frames;
    size_t stride;      /* one frame of so many is compared */
    int curve;          /* quality against speed: print the summary and write the plots */
    int only_all;       /* with BENCH_ALL only */
} run;

#define WAYS(list) list, sizeof list / sizeof *list, sizeof list / sizeof *list

#define PYRENEES .file = "N42E001.hgt", .crop = 1025, .spacing = 79.6f,        \
                 .path = "paths/pyrenees.path"
#define ROUGH_FIELD .file = "build/bench/rough.hgt", .spacing = 1.0f, .height_scale = 0.05f
#define ROUGH ROUGH_FIELD, .path = "paths/rough.path"
/* Where people are: a circle so far above the ground. */
#define LOW(name_, key_, file_, above_)                                                  \
    { { .name = name_, .key = key_, file_, .above = above_ }, LOOK_LIGHTMAP, WAYS(low_ways), \
      60, 8, 1, 0 }

/* Under dear shading, and with trees, the whole path is flown: the first pictures of all nodes take
   16 to 20 frames, and a flight of 30 would be one third start, though its figures say they leave
   that out. */
enum { LOOK_FRAMES = 120, LOOK_STRIDE = 25 };

static const run runs[] = {
    { { .name = "Pyrenees 1025 x 1025, straight flight", .key = "pyrenees", PYRENEES },
      LOOK_LIGHTMAP, path_ways, 18, 20, 60, 8, 1, 0 },
    { { .name = "rough 2049 x 2049, straight flight", .key = "rough", ROUGH },
      LOOK_LIGHTMAP, path_ways, 18, 20, 90, 12, 1, 0 },
    { { .name = "rough, three materials and moving clouds", .key = "materials", ROUGH },
      LOOK_MATERIALS, WAYS(look_ways), LOOK_FRAMES, LOOK_STRIDE, 1, 0 },
    { { .name = "rough, with trees", .key = "trees", ROUGH },
      LOOK_TREES, WAYS(look_ways), LOOK_FRAMES, LOOK_STRIDE, 1, 0 },
    LOW("walk-N42E001, 2 above the ground", "walk_n42e001", .file = "N42E001.hgt", 2.0f),
    LOW("valley-N42E001, 100 above the ground", "valley_n42e001", .file = "N42E001.hgt", 100.0f),
    LOW("pass-N42E001, 400 above the ground", "pass_n42e001", .file = "N42E001.hgt", 400.0f),
    LOW("walk-N49E011, 2 above the ground", "walk_n49e011", .file = "N49E011.hgt", 2.0f),
    LOW("valley-N49E011, 100 above the ground", "valley_n49e011", .file = "N49E011.hgt", 100.0f),
    LOW("pass-N49E011, 400 above the ground", "pass_n49e011", .file = "N49E011.hgt", 400.0f),
    LOW("walk-rough, 2 above the ground", "walk_rough", ROUGH_FIELD, 2.0f),
    LOW("valley-rough, 20 above the ground", "valley_rough", ROUGH_FIELD, 20.0f),
    LOW("pass-rough, 60 above the ground", "pass_rough", ROUGH_FIELD, 60.0f),
    { { .name = "N42E001 (Pyrenees), circle", .key = "n42e001", .file = "N42E001.hgt" },
      LOOK_LIGHTMAP, WAYS(tile_ways), 45, 6, 1, 0 },
    { { .name = "N49E011 (hills), circle", .key = "n49e011", .file = "N49E011.hgt" },
      LOOK_LIGHTMAP, WAYS(tile_ways), 45, 6, 1, 0 },
    { { .name = "N41E001, circle", .key = "n41e001", .file = "N41E001.hgt" },
      LOOK_LIGHTMAP, WAYS(tile_ways), 45, 6, 1, 1 },
    { { .name = "N48W125 (coast), circle", .key = "n48w125", .file = "N48W125.hgt" },
      LOOK_LIGHTMAP, WAYS(tile_ways), 45, 6, 1, 1 },
    { { .name = "procedural 1025 x 1025, circle as Hess", .key = "hess1025", .size = 1025 },
      LOOK_LIGHTMAP, thesis_ways, 5, 14, 36, 8, 0, 0 },
    { { .name = "procedural 2049 x 2049, circle as Hess", .key = "hess2049", .size = 2049 },
      LOOK_LIGHTMAP, thesis_ways, 9, 14, 36, 8, 0, 0 },
    { { .name = "procedural 3073 x 3073, circle as Hess", .key = "hess3073", .size = 3073 },
      LOOK_LIGHTMAP, thesis_ways, 5, 14, 36, 8, 0, 1 },
    { { .name = "procedural 4097 x 4097, circle as Hess", .key = "hess4097", .size = 4097 },
      LOOK_LIGHTMAP, thesis_ways, 5, 14, 36, 8, 0, 0 }
};

/* ---- Output ------------------------------------------------------------- */

static FILE *figures, *times;

static void say_protocol(void)
{
    say_machine(context_renderer());
    say("Pictures of %d x %d, 60 degrees. The columns from median to worst are ratios: a frame's "
        "time over that of the full mesh at\nabout the same moment. CPU: mean processor time over "
        "that of the full mesh. The first third of a flight, 20 frames at most,\nis its start, "
        "when pictures are new: its mean, over the full mesh's median, has a column, and no other "
        "figure has it in.\nquads: median time over that of a textured quad over the whole "
        "picture. reuse: frames that a picture is drawn.\nPSNR [dB] is over terrain unless it says "
        "picture; 4 x 4: against the full mesh with as many samples a pixel. From frame\nto frame, "
        "beyond what the full mesh changes: shimmer, the mean over all pixels; pop, the worst mean "
        "over 16 x 16 pixels;\npixel, the worst pixel. holes: in the worst frame; low: pixels of "
        "sky above a silhouette that is too low.\n", SCENE_WIDTH, SCENE_HEIGHT);
}

/* ---- Quality ------------------------------------------------------------ */

static double psnr_of(const uint8_t *a, const uint8_t *b, const uint8_t *sky)
{
    return image_psnr(image_mean_square(a, b, SCENE_PIXELS, sky));
}

static void keep_worst(contender *c, const contender *full, size_t frame)
{
    double now = c->psnr_terrain.values[c->psnr_terrain.count - 1];
    size_t i;
    for (i = 0; i + 1 < c->psnr_terrain.count; i++)
        if (c->psnr_terrain.values[i] <= now)
            return;
    if (!c->worst) {
        c->worst = need_memory((size_t)SCENE_PIXELS * 3);
        c->worst_truth = need_memory((size_t)SCENE_PIXELS * 3);
    }
    memcpy(c->worst, c->picture, (size_t)SCENE_PIXELS * 3);
    memcpy(c->worst_truth, full->picture, (size_t)SCENE_PIXELS * 3);
    c->worst_frame = frame;
}

enum { CROP = 160 }; /* pixels along a side */

/* Copies what is around a pixel, as far as the picture goes; *to is allocated when it is null. */
static void crop_around(const uint8_t *picture, int x, int y, uint8_t **to)
{
    int left = x - CROP / 2, top = y - CROP / 2, row;
    left = left < 0 ? 0 : left > SCENE_WIDTH - CROP ? SCENE_WIDTH - CROP : left;
    top = top < 0 ? 0 : top > SCENE_HEIGHT - CROP ? SCENE_HEIGHT - CROP : top;
    if (!*to)
        *to = need_memory((size_t)CROP * CROP * 3);
    for (row = 0; row < CROP; row++)
        memcpy(*to + (size_t)row * CROP * 3,
               picture + ((size_t)(top + row) * SCENE_WIDTH + (size_t)left) * 3, (size_t)CROP * 3);
}

/* Counts the holes and keeps what is around the first that the way ever has. */
static void compare_holes(contender *c, const contender *full, size_t frame)
{
    size_t low = 0, first = 0;
    size_t holes = quality_holes(c->picture, full->picture, SCENE_WIDTH, SCENE_HEIGHT, scene_sky,
                                 &low, &first);
    if (holes == SIZE_MAX)
        bench_stop("holes", "out of memory");
    if (holes > 0 && c->holes <= 0.0) {
        int x = (int)(first % SCENE_WIDTH), y = (int)(first / SCENE_WIDTH);
        crop_around(full->picture, x, y, &c->hole_crops[0]);
        crop_around(c->picture, x, y, &c->hole_crops[1]);
        c->hole_frame = frame;
    }
    if ((double)holes > c->holes)
        c->holes = (double)holes;
    c->low_pixels += (double)low;
}

static void compare(contender *c, const contender *full, size_t frame, int with_ssim)
{
    stats_add(&c->psnr, psnr_of(c->picture, full->picture, NULL));
    stats_add(&c->psnr_terrain, psnr_of(c->picture, full->picture, scene_sky));
    compare_holes(c, full, frame);
    if (with_ssim)
        stats_add(&c->ssim, quality_ssim(c->picture, full->picture, SCENE_WIDTH, SCENE_HEIGHT,
                                         scene_sky));
    keep_worst(c, full, frame);
}

static void compare_fine(contender *c, const fine *f)
{
    stats_add(&c->fine_psnr, psnr_of(c->picture, f->picture, scene_sky));
    stats_add(&c->fine_ssim, quality_ssim(c->picture, f->picture, SCENE_WIDTH, SCENE_HEIGHT,
                                          scene_sky));
}

static void compare_change(contender *c, const contender *full, size_t frame)
{
    quality_change change = quality_compare_change(c->before, c->picture, full->before,
                                                   full->picture, SCENE_WIDTH, SCENE_HEIGHT);
    stats_add(&c->shimmer, change.mean);
    stats_add(&c->pop_pixel, change.largest);
    stats_add(&c->pop_block, change.block);
    if (change.block > c->pop.block) {
        c->pop = change;
        c->pop_frame = frame;
        crop_around(full->before, change.block_x, change.block_y, &c->pop_crops[0]);
        crop_around(full->picture, change.block_x, change.block_y, &c->pop_crops[1]);
        crop_around(c->before, change.block_x, change.block_y, &c->pop_crops[2]);
        crop_around(c->picture, change.block_x, change.block_y, &c->pop_crops[3]);
    }
}

/* ---- A flight ----------------------------------------------------------- */

/* What is done with a frame. At the start only what has a memory is drawn. */
typedef struct frame_plan {
    int start;
    int look;   /* compare with the full mesh */
    int change; /* and with the frame before */
    int ssim, fine;
} frame_plan;

static size_t start_of(size_t frames)
{
    return frames / 3 < 20 ? frames / 3 : 20;
}

/* SSIM is dear: every other look has it. The supersampled reference is dearer: three looks do. */
static frame_plan plan_frame(const run *r, size_t frame, size_t frames, size_t stride)
{
    size_t start = start_of(frames), looks = (frames - start + stride - 1) / stride, index;
    frame_plan plan = { 1, 0, 0, 0, 0 };
    if (frame < start)
        return plan;
    frame -= start;
    index = frame / stride;
    plan.start = 0;
    plan.look = frame % stride == 0;
    plan.change = stride == 1 ? frame > 0 : frame % stride == 1;
    plan.ssim = plan.look && index % 2 == 0;
    plan.fine = r->curve && plan.look && index % ((looks + 2) / 3) == 0;
    return plan;
}

static void note_time(const scene *s, const contender *c, size_t frame, int at_start)
{
    const stats *ms = at_start ? &c->start_ms : &c->ms;
    fprintf(times, "%s\t%s\t%zu\t%d\t%.3f\t%u\t%u\t%u\t%u\n", s->desc->key, c->way->name, frame,
            at_start, ms->values[ms->count - 1], c->now.triangles, c->now.draws, c->now.captures,
            c->now.captured_texels);
}

static double newest_ms(const contender *c)
{
    return c->ms.values[c->ms.count - 1];
}

/* What a frame of the full mesh takes at the time: the mean of the two that it drew last. */
static double full_ms(const contender *full)
{
    size_t n = full->ms.count;
    return n > 1 ? 0.5 * (full->ms.values[n - 1] + full->ms.values[n - 2]) : newest_ms(full);
}

static void draw_frame(contender *ways, size_t count, const scene *s, size_t frame,
                       frame_plan plan)
{
    terrimp_camera camera = tour_camera(&s->tour, &s->box, frame);
    size_t i;
    for (i = 0; i < count; i++) {
        contender *c = &ways[i];
        if (!plan.look && !plan.change && !way_has_memory(c->way))
            continue;
        contender_draw(c, camera, plan.start);
        if (!plan.start)
            stats_add(&c->ratio, newest_ms(c) / full_ms(&ways[0]));
        if (plan.look || plan.change)
            contender_read(c, s->context, frame);
        note_time(s, c, frame, plan.start);
    }
}

static void fly(const run *r, contender *ways, size_t count, const scene *s, quad *q, fine *f,
                size_t stride)
{
    look *l = ways[0].look;
    size_t frame, i;
    for (frame = 0; frame < s->tour.flight.count; frame++) {
        frame_plan plan = plan_frame(r, frame, s->tour.flight.count, stride);
        l->seconds = (float)frame / SCENE_FPS;
        draw_frame(ways, count, s, frame, plan);
        if (plan.look)
            quad_draw(q, s->context, ways[0].gl->lightmap);
        if (plan.fine)
            fine_draw(f, l, ways[0].gl, ways[0].view, tour_camera(&s->tour, &s->box, frame));
        for (i = 0; i < count; i++) {
            if (plan.look)
                compare(&ways[i], &ways[0], frame, plan.ssim);
            if (plan.fine)
                compare_fine(&ways[i], f);
            if (plan.change)
                compare_change(&ways[i], &ways[0], frame);
        }
    }
}

/* ---- Tables ------------------------------------------------------------- */

/* What a way costs beside the full mesh, by means, so that the pictures that it makes now and then
   are paid for: of the clock, or of the processor. */
static double cost_of(const contender *c, const contender *full, int processor)
{
    return processor ? mean(&c->cpu_ms) / mean(&full->cpu_ms) : mean(&c->ratio);
}

static void print_times(const contender *ways, size_t count, double quad_ms)
{
    double unit = stats_summarise(&ways[0].ms).median;
    size_t i;
    say("\n| way | ms | median | mean | sd | 95 %% | 99 %% | worst | CPU | start | quads | "
        "triangles | draws | captures | ktexels | reuse |\n"
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < count; i++) {
        const contender *c = &ways[i];
        stats_summary ms = stats_summarise(&c->ms), ratio = stats_summarise(&c->ratio);
        double n = c->frames;
        say("| %s | %.1f | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %.2f | %.1f | %.0f | "
            "%.0f | %.2f | %.0f | %.0f |\n", c->way->name, ms.median, ratio.median, ratio.mean,
            ratio.deviation, ratio.p95, ratio.p99, ratio.worst, cost_of(c, &ways[0], 1),
            mean(&c->start_ms) / unit, ms.median / quad_ms, c->triangles / n, c->draws / n,
            c->captures / n, c->captured_texels / n / 1e3, (double)c->now.reuse);
    }
    say("\nA textured quad over the whole picture: %.1f ms.\n", quad_ms);
    for (i = 0; i < count; i++)
        if (ways[i].hess)
            say("%s: its atlases were packed %u times, %u of these before all pictures had moved; "
                "sides were reduced to %.2f at worst.\n", ways[i].way->name,
                (unsigned)ways[i].hess->pair.repacks, (unsigned)ways[i].hess->early_packs,
                (double)ways[i].hess->least_scale);
}

static void print_quality(const contender *ways, size_t count)
{
    size_t i;
    say("\n| way | PSNR mean | worst | picture | SSIM | PSNR, 4 x 4 | SSIM, 4 x 4 | shimmer | "
        "pop | pixel | holes | low |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < count; i++) {
        const contender *c = &ways[i];
        say("| %s | %.2f | %.2f | %.2f | %.4f | ", c->way->name, mean(&c->psnr_terrain),
            stats_summarise(&c->psnr_terrain).least, mean(&c->psnr), mean(&c->ssim));
        if (c->fine_psnr.count)
            say("%.2f | %.4f | ", mean(&c->fine_psnr), mean(&c->fine_ssim));
        else
            say("| | ");
        say("%.2f | %.1f | %.0f | %.0f | %.1f |\n", mean(&c->shimmer),
            stats_summarise(&c->pop_block).worst, stats_summarise(&c->pop_pixel).worst, c->holes,
            c->low_pixels / (double)c->psnr.count);
    }
}

static void write_figures(const run *r, const contender *ways, size_t count, double quad_ms)
{
    double unit = stats_summarise(&ways[0].ms).median;
    size_t i;
    for (i = 0; i < count; i++) {
        const contender *c = &ways[i];
        stats_summary ms = stats_summarise(&c->ms), ratio = stats_summarise(&c->ratio);
        double n = c->frames;
        fprintf(figures, "%s\t%s\t%s\t%zu\t%.3f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t"
                "%.3f\t%.2f\t", r->scene.key, c->way->name, c->way->family, ms.count, ms.median,
                ratio.median, ratio.mean, ratio.deviation, ratio.p95, ratio.p99, ratio.worst,
                cost_of(c, &ways[0], 1), mean(&c->start_ms) / unit, quad_ms, ms.median / quad_ms);
        fprintf(figures, "%.0f\t%.1f\t%.3f\t%.0f\t%.1f\t%.2f\t", c->triangles / n, c->draws / n,
                c->captures / n, c->captured_texels / n, (double)c->now.reuse, c->waiting / n);
        fprintf(figures, "%.3f\t%.3f\t%.3f\t%.5f\t%.3f\t%.5f\t%.3f\t%.2f\t%.0f\t%.0f\t%.2f\n",
                mean(&c->psnr_terrain), stats_summarise(&c->psnr_terrain).least, mean(&c->psnr),
                mean(&c->ssim), mean(&c->fine_psnr), mean(&c->fine_ssim), mean(&c->shimmer),
                stats_summarise(&c->pop_block).worst, stats_summarise(&c->pop_pixel).worst,
                c->holes, c->low_pixels / (double)c->psnr.count);
    }
}

static void write_headings(void)
{
    fprintf(figures, "scene\tway\tfamily\tframes\tms_median\tratio_median\tratio_mean\t"
            "ratio_deviation\tratio_p95\tratio_p99\tratio_worst\tcpu_ratio\tstart\tquad_ms\tquads\t"
            "triangles\tdraws\tcaptures\tcaptured_texels\t"
            "reuse\twaiting\tpsnr_terrain\tpsnr_terrain_worst\tpsnr_picture\tssim\tpsnr_4x4\t"
            "ssim_4x4\tshimmer\tpop_block\tpop_pixel\tholes\tlow_pixels\n");
    fprintf(times, "scene\tway\tframe\tstart\tms\ttriangles\tdraws\tcaptures\t"
            "captured_texels\n");
}

/* ---- Quality against speed ---------------------------------------------- */

static int begins_with(const char *text, const char *start)
{
    return strncmp(text, start, strlen(start)) == 0;
}

static double quality_of(const contender *c, int similarity)
{
    return mean(similarity ? &c->ssim : &c->psnr_terrain);
}

static size_t geomip_points(const contender *ways, size_t count, int processor, int similarity,
                            stats_point *points)
{
    size_t found = 0, i;
    for (i = 0; i < count; i++)
        if (begins_with(ways[i].way->family, "geomip")) {
            points[found].cost = cost_of(&ways[i], &ways[0], processor);
            points[found++].quality = quality_of(&ways[i], similarity);
        }
    return found;
}

static size_t peer_points(const char *key, stats_point *points)
{
    size_t found = 0, i;
    for (i = 0; i < PEER_COUNT; i++)
        if (strcmp(peers[i].scene, key) == 0) {
            points[found].cost = peers[i].ratio;
            points[found++].quality = peers[i].psnr;
        }
    return found;
}

static void say_against(const stats_point *points, size_t count, double cost, double quality)
{
    double theirs;
    if (!count)
        say(" |");
    else if (stats_cost_at(points, count, quality, &theirs))
        say(" %.2f |", theirs / cost);
    else
        say(" never as good |");
}

/* Every way with pictures against the best that does without, at the quality it has. */
static void print_speed_up(const run *r, const contender *ways, size_t count)
{
    stats_point points[WAYS_MAX + PEER_COUNT];
    size_t i, found;
    int kind;
    say("\nHow many times as fast at equal quality, interpolated; costs are mean times:\n\n"
        "| way | ratio | PSNR | than our geomip | the same, CPU | at equal SSIM | "
        "than peers, quoted | the same, CPU |\n|---|--:|--:|--:|--:|--:|--:|--:|\n");
    for (i = 1; i < count; i++) {
        if (!way_has_memory(ways[i].way) || begins_with(ways[i].way->family, "geomip"))
            continue;
        say("| %s | %.3f | %.2f |", ways[i].way->name, cost_of(&ways[i], &ways[0], 0),
            mean(&ways[i].psnr_terrain));
        for (kind = 0; kind < 3; kind++) { /* clock and PSNR, processor and PSNR, clock and SSIM */
            found = geomip_points(ways, count, kind == 1, kind == 2, points);
            say_against(points, found, cost_of(&ways[i], &ways[0], kind == 1),
                        quality_of(&ways[i], kind == 2));
        }
        found = peer_points(r->scene.key, points);
        for (kind = 0; kind < 2; kind++)
            say_against(points, found, cost_of(&ways[i], &ways[0], kind),
                        mean(&ways[i].psnr_terrain));
        say("\n");
    }
}

static void print_peers(const char *key)
{
    size_t i, found = 0;
    for (i = 0; i < PEER_COUNT; i++) {
        if (strcmp(peers[i].scene, key) != 0)
            continue;
        if (!found++)
            say("\nQuoted, measured elsewhere with the same rasteriser:\n\n"
                "| engine | ratio | PSNR | triangles | draws |\n|---|--:|--:|--:|--:|\n");
        say("| %s | %.3f | %.1f | %.0f | %.0f |\n", peers[i].name, peers[i].ratio, peers[i].psnr,
            peers[i].triangles, peers[i].draws);
    }
}

static void plot_peers(plot *p, const char *key)
{
    size_t i;
    for (i = 0; i < PEER_COUNT; i++)
        if (strcmp(peers[i].scene, key) == 0) {
            const char *name = begins_with(peers[i].name, "OGRE") ? "OGRE (quoted)"
                               : begins_with(peers[i].name, "Irrlicht") ? "Irrlicht (quoted)"
                                                                        : "OSG impostors (quoted)";
            plot_series *s = plot_find_series(p, name);
            if (s)
                s->hollow = 1;
            plot_add(p, name, peers[i].ratio, peers[i].psnr);
        }
}

static void write_plot(const plot *p, const char *key, const char *kind)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s_%s.svg", bench_folder, key, kind);
    if (!plot_write(p, path))
        bench_stop(path, "cannot be written");
    say("\nPlot: %s\n", path);
}

static void plot_curves(const run *r, const contender *ways, size_t count)
{
    static plot psnr, ssim;
    size_t i;
    psnr.title = ssim.title = r->scene.name;
    psnr.x_label = ssim.x_label = "frame time / full mesh";
    psnr.y_label = "PSNR over terrain [dB]";
    ssim.y_label = "SSIM over terrain";
    psnr.log_x = ssim.log_x = 1;
    psnr.count = ssim.count = 0;
    for (i = 1; i < count; i++) {
        double ratio = cost_of(&ways[i], &ways[0], 0);
        plot_add(&psnr, ways[i].way->family, ratio, mean(&ways[i].psnr_terrain));
        plot_add(&ssim, ways[i].way->family, ratio, mean(&ways[i].ssim));
    }
    plot_peers(&psnr, r->scene.key);
    write_plot(&psnr, r->scene.key, "psnr");
    write_plot(&ssim, r->scene.key, "ssim");
}

/* Frame time against terrain size, over all the flights of the thesis. */
static plot sizes = { .title = "Frame time against terrain size, circle as Hess",
                      .x_label = "samples along a side", .y_label = "mean frame time [ms]",
                      .log_x = 1, .log_y = 1 };

static void note_size(const run *r, const contender *ways, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++)
        plot_add(&sizes, ways[i].way->name, (double)r->scene.size, mean(&ways[i].ms));
}

/* ---- Pictures of the worst frames --------------------------------------- */

/* Writes count pictures of width x height side by side, each pixel as a square of factor^2. */
static void write_side_by_side(const run *r, const contender *c, const char *suffix,
                               const uint8_t *const *pictures, int count, int width, int height,
                               int factor)
{
    int wide = count * width * factor, high = height * factor, x, y;
    uint8_t *out = need_memory((size_t)wide * (size_t)high * 3), *to = out;
    char path[256], *letter;
    const char *trouble;
    for (y = 0; y < high; y++)
        for (x = 0; x < wide; x++, to += 3) {
            int column = x / factor;
            memcpy(to, pictures[column / width]
                       + ((size_t)(y / factor * width) + (size_t)(column % width)) * 3, 3);
        }
    snprintf(path, sizeof path, "%s/%s_%s%s.png", bench_folder, r->scene.key, c->way->name, suffix);
    for (letter = path; *letter; letter++)
        if (*letter == ' ' || *letter == ',')
            *letter = '_';
    trouble = image_write_png(path, out, wide, high);
    if (trouble)
        bench_stop(path, trouble);
    free(out);
}

static void write_pictures(const run *r, const contender *c)
{
    const uint8_t *pictures[3];
    uint8_t *difference = need_memory((size_t)SCENE_PIXELS * 3);
    const uint8_t *const pop[4] = { c->pop_crops[0], c->pop_crops[1], c->pop_crops[2],
                                    c->pop_crops[3] };
    const uint8_t *const hole[2] = { c->hole_crops[0], c->hole_crops[1] };
    image_difference(c->worst, c->worst_truth, SCENE_PIXELS, 1, difference);
    pictures[0] = c->worst_truth;
    pictures[1] = c->worst;
    pictures[2] = difference;
    write_side_by_side(r, c, "", pictures, 3, SCENE_WIDTH, SCENE_HEIGHT, 1);
    if (pop[0])
        write_side_by_side(r, c, "_pop", pop, 4, CROP, CROP, 3);
    if (hole[0]) {
        write_side_by_side(r, c, "_hole", hole, 2, CROP, CROP, 4);
        say("\n%s has its first hole in frame %zu: see the picture of it.\n", c->way->name,
            c->hole_frame);
    }
    free(difference);
}

/* ---- All of it ---------------------------------------------------------- */

/* Opens the ways that are wanted, the full mesh first; returns how many. */
static size_t open_ways(const run *r, contender *ways, scene *s, look *l)
{
    size_t offered = bench_all() ? r->all_way_count : r->way_count, count = 0, i;
    const char *wanted = getenv("BENCH_WAYS");
    for (i = 0; i < offered; i++)
        if (i == 0 || !wanted || strstr(r->ways[i].name, wanted))
            contender_open(&ways[count++], &r->ways[i], s, l);
    return count;
}

static void measure(const run *r, const context *frame)
{
    contender *ways = need_memory(WAYS_MAX * sizeof *ways);
    size_t count, i;
    double quad_ms, start = clock_ms();
    scene s;
    quad q;
    fine f;
    look l;
    scene_open(&s, &r->scene, frame, bench_frames(r->frames));
    look_open(&l, r->look, &s);
    count = open_ways(r, ways, &s, &l);
    quad_open(&q);
    fine_open(&f, frame);
    say("\n## %s, %zu frames\n", r->scene.name, s.tour.flight.count);
    fly(r, ways, count, &s, &q, &f, bench_all() ? 1 : r->stride);
    quad_ms = stats_summarise(&q.ms).median;
    print_times(ways, count, quad_ms);
    print_quality(ways, count);
    write_figures(r, ways, count, quad_ms);
    if (r->curve) {
        print_peers(r->scene.key);
        print_speed_up(r, ways, count);
        plot_curves(r, ways, count);
    }
    if (r->scene.size)
        note_size(r, ways, count);
    for (i = 1; i < count; i++)
        write_pictures(r, &ways[i]);
    say("\n(%.0f s)\n", (clock_ms() - start) * 1e-3);
    fflush(NULL); /* the figures of a scene stay, whatever becomes of the next */
    fine_close(&f);
    quad_close(&q);
    for (i = 0; i < count; i++)
        contender_close(&ways[i]);
    free(ways);
    look_close(&l);
    scene_close(&s);
}

static int file_is_there(const char *name)
{
    char path[1024];
    FILE *file;
    if (!name)
        return 1;
    scene_data_path(name, path, sizeof path);
    file = fopen(path, "rb");
    if (file)
        fclose(file);
    return file != NULL;
}

static int is_wanted(const run *r)
{
    const char *only = getenv("BENCH_ONLY");
    if (only && *only)
        return strstr(r->scene.key, only) != NULL;
    return bench_all() || !r->only_all;
}

int main(void)
{
    context frame;
    const char *trouble = context_open(&frame, SCENE_WIDTH, SCENE_HEIGHT);
    double start = clock_ms();
    size_t i;
    if (trouble)
        bench_stop("OpenGL", trouble);
    say_open("frames", 0);
    figures = bench_output("frames", ".tsv");
    times = bench_output("frame_times", ".tsv");
    say_protocol();
    write_headings();
    for (i = 0; i < sizeof runs / sizeof *runs; i++) {
        if (!is_wanted(&runs[i]))
            continue;
        if (file_is_there(runs[i].scene.file) && file_is_there(runs[i].scene.path))
            measure(&runs[i], &frame);
        else
            say("\n## %s: its files are not here\n", runs[i].scene.name);
    }
    if (sizes.count && sizes.series[0].count > 1)
        write_plot(&sizes, "frames", "sizes");
    say("\nAll of it took %.0f s.\n", (clock_ms() - start) * 1e-3);
    fclose(times);
    fclose(figures);
    say_close();
    context_close(&frame);
    return 0;
}
