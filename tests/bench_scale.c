/* Measures what a frame costs, drawing included, against the size of the terrain: the thesis'
   circle over made-up terrains of 513 to 16385 samples a side, in full, with geometrical
   mipmapping, and with everything.

   Build:  make bench_scale
   Use:    build/bench_scale       (in the project's directory)
   Leaves: build/bench/scale.md (what it prints), scale.tsv, scale.svg

   BENCH_FRAMES=n   frames of a flight [72]; the first sixth, 20 at most, is its start, when
                    pictures are new: no figure has it in
   BENCH_ALL=1      8193 and 16385 too: minutes for building them, once; their bakes are kept
   BENCH_ONLY=n     this size alone

   Every size is measured in a process of its own, so that the memory of each can be told. The full
   mesh is drawn in every sixth frame, up to 4097 samples; above that it would take seconds, and
   more memory than the 1 GiB that all must fit into. In those frames all pictures are read, too:
   beyond the end of a small terrain is sky, and the less terrain there is to see, the less of it is
   drawn, which growth with the size has to be told from. */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_plot.h"
#include "bench_quad.h"
#include "bench_way.h"

#include "examples/host/image.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

enum { FULL_UP_TO = 4097, DEFAULT_UP_TO = 4097, FULL_EVERY = 6, WAYS = 3, SIZES = 6 };

static const way scale_ways[WAYS] = {
    { .name = "full", .family = "full", .mode = TERRIMP_MODE_FULL },
    { .name = "geomip 1 px", .family = "geomip", .mode = TERRIMP_MODE_GEOMIP,
      .tolerance_px = 1.0f },
    { .name = "auto 1 px", .family = "auto", .mode = TERRIMP_MODE_AUTO, .tolerance_px = 1.0f }
};

static const scene_desc scale_scenes[SIZES] = {
    { .name = "513 x 513", .key = "513", .size = 513 },
    { .name = "1025 x 1025", .key = "1025", .size = 1025 },
    { .name = "2049 x 2049", .key = "2049", .size = 2049 },
    { .name = "4097 x 4097", .key = "4097", .size = 4097 },
    { .name = "8193 x 8193", .key = "8193", .size = 8193 },
    { .name = "16385 x 16385", .key = "16385", .size = 16385 }
};

/* What is kept of a size; medians, 0 where the way was not drawn. */
typedef struct outcome {
    double ms[WAYS], cpu_ms[WAYS];
    double terrain[WAYS]; /* share of the pictures, mean */
    double quad_ms, make_s, build_s, samples_mib, terrain_mib, peak_mib;
} outcome;

static outcome outcomes[SIZES];
static plot times = { .title = "A frame against the size of the terrain, circle as Hess",
                      .x_label = "samples along a side", .y_label = "median frame time [ms]",
                      .log_x = 1, .log_y = 1 };

static double peak_mib(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return (double)usage.ru_maxrss / 1024.0;
}

static double terrain_share(const uint8_t *rgb)
{
    size_t i, terrain = 0;
    for (i = 0; i < SCENE_PIXELS; i++)
        terrain += memcmp(rgb + i * 3, scene_sky, 3) != 0;
    return (double)terrain / SCENE_PIXELS;
}

/* The first contender is the full mesh; a size without it has a null view there. */
static void fly(scene *s, contender *ways, stats *shares, look *l, quad *q)
{
    size_t count = s->tour.flight.count, start = count / 6 < 20 ? count / 6 : 20, frame;
    int i;
    for (frame = 0; frame < count; frame++) {
        terrimp_camera camera = tour_camera(&s->tour, &s->box, frame);
        int is_read = frame >= start && (frame - start) % FULL_EVERY == 0;
        int with_full = is_read && ways[0].view;
        l->seconds = (float)frame / SCENE_FPS;
        for (i = with_full ? 0 : 1; i < WAYS; i++) {
            contender *c = &ways[i];
            contender_draw(c, camera, frame < start);
            if (!is_read)
                continue;
            contender_read(c, s->context, frame);
            stats_add(&shares[i], terrain_share(c->picture));
            if (with_full)
                stats_add(&c->psnr_terrain,
                          image_psnr(image_mean_square(c->picture, ways[0].picture, SCENE_PIXELS,
                                                       scene_sky)));
        }
        if (frame >= start)
            quad_draw(q, s->context, ways[1].gl->lightmap);
    }
}

static void say_way(const scene_desc *desc, const contender *c, double share, double quad_ms)
{
    stats_summary ms = stats_summarise(&c->ms), cpu = stats_summarise(&c->cpu_ms);
    double n = c->frames;
    say("| %u | %s | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | ",
        (unsigned)desc->size, c->way->name, ms.median, ms.mean, ms.deviation, ms.p95, ms.p99,
        ms.worst, cpu.median, ms.median / quad_ms, share * 100.0);
    if (c->psnr_terrain.count && c->way->mode != TERRIMP_MODE_FULL)
        say("%.2f", mean(&c->psnr_terrain));
    say(" | %.0f | %.0f | %.2f | %.0f |\n", c->triangles / n, c->draws / n, c->captures / n,
        c->captured_texels / n / 1e3);
}

/* OpenGL has its own: of a very large terrain 21 MiB. */
static void free_light(scene *s)
{
    free(s->lightmap);
    free(s->light_samples);
    s->lightmap = NULL;
    s->light_samples = NULL;
}

static void measure(const scene_desc *desc, const context *frame, outcome *out)
{
    static contender ways[WAYS];
    static stats shares[WAYS];
    double start = clock_ms();
    scene s;
    look l;
    quad q;
    int i;
    memset(ways, 0, sizeof ways);
    memset(shares, 0, sizeof shares);
    scene_open(&s, desc, frame, bench_frames(72));
    out->make_s = (clock_ms() - start) * 1e-3;
    s.vertex_bytes = (size_t)(desc->size <= FULL_UP_TO ? 64 : 32) << 20; /* a frame, and more */
    s.shared_atlas = 4096; /* the view's default: of three ways one keeps pictures */
    look_open(&l, LOOK_LIGHTMAP, &s);
    quad_open(&q);
    for (i = desc->size <= FULL_UP_TO ? 0 : 1; i < WAYS; i++)
        contender_open(&ways[i], &scale_ways[i], &s, &l);
    free_light(&s);
    out->build_s = s.build_s[0];
    out->samples_mib = (double)desc->size * desc->size * 2.0 / 1048576.0;
    out->terrain_mib = (double)terrimp_bake_bytes(s.terrain[0]) / 1048576.0;
    fly(&s, ways, shares, &l, &q);
    out->quad_ms = stats_summarise(&q.ms).median;
    for (i = 0; i < WAYS; i++) {
        if (!ways[i].view)
            continue;
        out->ms[i] = stats_summarise(&ways[i].ms).median;
        out->cpu_ms[i] = stats_summarise(&ways[i].cpu_ms).median;
        out->terrain[i] = mean(&shares[i]);
        say_way(desc, &ways[i], out->terrain[i], out->quad_ms);
        stats_free(&shares[i]);
        contender_close(&ways[i]);
    }
    out->peak_mib = peak_mib();
    quad_close(&q);
    look_close(&l);
    scene_close(&s);
}

static void say_headings(void)
{
    say_machine(context_renderer());
    say("Pictures of %d x %d; %zu frames of the thesis' circle, 80 units a second; ms of the "
        "clock, quads: over that of a textured\nquad over the whole picture; terrain: percentage "
        "of the picture that is not sky; PSNR [dB] against the\nfull mesh, over terrain.\n\n"
        "| samples | way | median | mean | sd | 95 %% | 99 %% | worst | CPU | quads | terrain "
        "| PSNR | triangles | draws | captures | ktexels |\n"
        "|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n", SCENE_WIDTH,
        SCENE_HEIGHT, bench_frames(72));
}

/* Measures a size in a process of its own; what was said stands in the same files. */
static void measure_apart(const scene_desc *desc, int is_first, outcome *out)
{
    int ends[2], status = 1, i;
    ssize_t got = 0;
    pid_t child;
    fflush(NULL);
    if (pipe(ends) != 0)
        bench_stop("a pipe", "there is none");
    child = fork();
    if (child < 0)
        bench_stop("a process", "there is none");
    if (child == 0) {
        context frame;
        const char *trouble = context_open(&frame, SCENE_WIDTH, SCENE_HEIGHT);
        if (trouble)
            bench_stop("OpenGL", trouble);
        if (is_first)
            say_headings();
        measure(desc, &frame, out);
        got = write(ends[1], out, sizeof *out);
        fflush(NULL);
        _exit(got != (ssize_t)sizeof *out);
    }
    close(ends[1]);
    got = read(ends[0], out, sizeof *out);
    close(ends[0]);
    if (waitpid(child, &status, 0) != child || status != 0 || got != (ssize_t)sizeof *out)
        bench_stop(desc->name, "it was not measured to its end");
    for (i = 0; i < WAYS; i++)
        if (out->ms[i] > 0.0)
            plot_add(&times, scale_ways[i].name, desc->size, out->ms[i]);
    plot_add(&times, "a textured quad", desc->size, out->quad_ms);
}

static void say_sizes(void)
{
    size_t i;
    say("\n| samples | made in s | built in s | samples MiB | terrain MiB | most memory MiB |\n"
        "|--:|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < SIZES; i++) {
        const outcome *o = &outcomes[i];
        if (o->quad_ms <= 0.0)
            continue;
        say("| %u | %.1f | ", (unsigned)scale_scenes[i].size, o->make_s);
        if (o->build_s > 0.0)
            say("%.1f | ", o->build_s);
        else
            say("read from its bake | ");
        say("%.0f | %.1f | %.0f |\n", o->samples_mib, o->terrain_mib, o->peak_mib);
    }
}

/* Processor time for what of the picture is terrain. */
static double cpu_per_terrain(const outcome *o, int w)
{
    return o->cpu_ms[w] / o->terrain[w];
}

static void say_growth_of(const scene_desc *desc, const outcome *o, const outcome *one)
{
    int w;
    say("| %u |", (unsigned)desc->size);
    for (w = 1; w < WAYS; w++)
        say(" %.2f |", o->ms[w] / one->ms[w]);
    for (w = 1; w < WAYS; w++)
        say(" %.2f |", o->cpu_ms[w] / one->cpu_ms[w]);
    say(" %.2f |", o->terrain[WAYS - 1] / one->terrain[WAYS - 1]);
    for (w = 1; w < WAYS; w++)
        say(" %.2f |", cpu_per_terrain(o, w) / cpu_per_terrain(one, w));
    if (o->ms[0] > 0.0)
        say(" %.2f |\n", o->ms[0] / one->ms[0]);
    else
        say(" |\n");
}

/* Each size's figures over those of 1025 samples. */
static void say_growth(void)
{
    const outcome *one = &outcomes[1];
    size_t i;
    if (one->quad_ms <= 0.0)
        return;
    say("\nGrowth of the median from 1025 samples a side on; CPU: of the processor's time; "
        "terrain: of its share of the picture;\nCPU a terrain pixel: of the processor's time over "
        "that share:\n\n"
        "| samples | geomip | auto | geomip, CPU | auto, CPU | terrain "
        "| geomip, CPU a terrain pixel | auto, CPU a terrain pixel | full |\n"
        "|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (i = 1; i < SIZES; i++)
        if (outcomes[i].quad_ms > 0.0)
            say_growth_of(&scale_scenes[i], &outcomes[i], one);
}

static int is_wanted(const scene_desc *desc)
{
    const char *only = getenv("BENCH_ONLY");
    if (only && *only)
        return strcmp(desc->key, only) == 0;
    return bench_all() || desc->size <= DEFAULT_UP_TO;
}

int main(void)
{
    char path[256];
    int said = 0;
    size_t i;
    say_open("scale", 1);
    for (i = 0; i < SIZES; i++)
        if (is_wanted(&scale_scenes[i]))
            measure_apart(&scale_scenes[i], !said++, &outcomes[i]);
    say_sizes();
    say_growth();
    snprintf(path, sizeof path, "%s/scale.svg", bench_folder);
    if (times.count > 0) {
        if (!plot_write(&times, path))
            bench_stop(path, "cannot be written");
        say("\nPlot: %s\n", path);
    }
    say_close();
    return 0;
}
