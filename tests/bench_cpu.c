/* Measures what the library itself costs, without graphics: building, memory, and deciding frames
   with callbacks that do nothing, against the size of the terrain.

   Build:  make bench_cpu
   Use:    build/bench_cpu
   Leaves: build/bench/cpu.md (what it prints), cpu.tsv, cpu_frame.svg, cpu_memory.svg

   BENCH_FRAMES=n  frames of a flight [72]; the first sixth is its start, when pictures are new
   BENCH_ALL=1     sizes up to 16385, not only 4097: some minutes, and 0.7 GiB of memory
   Times are those of the processor, so that other programs on the machine matter little. */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_plot.h"
#include "bench_say.h"

#include "examples/host/procedural.h"
#include "examples/host/tour.h"

#include <pthread.h>
#include <sys/resource.h>

enum { BASE = 1025, THREADED_UP_TO = 2049 };

/* A mode of the view, or the geomip room alone. */
typedef struct way {
    const char *name;
    int mode; /* terrimp_mode; 0: the geomip room */
    float tolerance_px;
} way;

static const way ways[] = {
    { "full", TERRIMP_MODE_FULL, 0.0f },
    { "geomip 1 px", TERRIMP_MODE_GEOMIP, 1.0f },
    { "impostor 1 px", TERRIMP_MODE_IMPOSTOR, 1.0f },
    { "auto 1 px", TERRIMP_MODE_AUTO, 1.0f },
    { "geomip room, bound 2 px", 0, 2.0f }
};
enum { WAY_COUNT = sizeof ways / sizeof *ways };

static const uint32_t sizes[] = { 513, 1025, 2049, 4097, 8193, 16385 };
enum { SIZE_COUNT = sizeof sizes / sizeof *sizes, DEFAULT_SIZE_COUNT = 4 };

static FILE *table;
static plot frame_plot = { .title = "Deciding and issuing a frame, without graphics",
                           .x_label = "samples along a side", .y_label = "processor time [ms]",
                           .log_x = 1, .log_y = 1 };
static plot memory_plot = { .title = "Memory of the library", .x_label = "samples along a side",
                            .y_label = "MiB", .log_x = 1, .log_y = 1 };

/* ---- The terrain -------------------------------------------------------- */

/* Where a coordinate of the large terrain lies in the base, of which it is made by mirroring. */
static uint32_t fold(uint32_t i)
{
    uint32_t period = 2 * (BASE - 1), rest = i % period;
    return rest < BASE ? rest : period - rest;
}

static uint16_t *make_samples(uint32_t size)
{
    uint16_t *base = procedural_terrain(BASE, BASE, 1);
    uint16_t *samples = need_memory((size_t)size * size * sizeof *samples), *out = samples;
    uint32_t x, z;
    if (!base)
        bench_stop("memory", "there is none");
    for (z = 0; z < size; z++)
        for (x = 0; x < size; x++)
            *out++ = base[(size_t)fold(z) * BASE + fold(x)];
    free(base);
    return samples;
}

static terrimp_terrain_desc describe(const uint16_t *samples, uint32_t size)
{
    terrimp_terrain_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.field.samples = samples;
    desc.field.width = desc.field.depth = size;
    desc.field.format = TERRIMP_FORMAT_U16;
    desc.field.height_scale = PROCEDURAL_HEIGHT_SCALE;
    return desc;
}

/* ---- Building ----------------------------------------------------------- */

typedef struct worker {
    terrimp_terrain *terrain;
    uint32_t first, step, count; /* of nodes */
    size_t scratch_bytes;
    terrimp_result result;
} worker;

static void *build_some(void *user)
{
    worker *w = user;
    void *scratch = need_memory(w->scratch_bytes);
    uint32_t node;
    for (node = w->first; node < w->count && w->result == TERRIMP_OK; node += w->step)
        w->result = terrimp_terrain_build_node(w->terrain, node, scratch, w->scratch_bytes);
    free(scratch);
    return NULL;
}

/* Builds with so many threads, 1 or 2; returns milliseconds of the clock. */
static double build(const terrimp_terrain_desc *desc, void *memory, size_t bytes, uint32_t threads,
                    uint32_t nodes, terrimp_terrain **terrain)
{
    worker w[2];
    pthread_t thread;
    double start = clock_ms();
    uint32_t i;
    need(terrimp_terrain_init(desc, memory, bytes, terrain));
    need(terrimp_terrain_build_begin(*terrain));
    for (i = 0; i < threads; i++) {
        w[i].terrain = *terrain;
        w[i].first = i;
        w[i].step = threads;
        w[i].count = nodes;
        w[i].scratch_bytes = terrimp_terrain_scratch_bytes(desc);
        w[i].result = TERRIMP_OK;
    }
    if (threads == 2 && pthread_create(&thread, NULL, build_some, &w[1]) != 0)
        bench_stop("threads", "there is no second one");
    build_some(&w[0]);
    if (threads == 2)
        pthread_join(thread, NULL);
    for (i = 0; i < threads; i++)
        need(w[i].result);
    need(terrimp_terrain_build_finish(*terrain));
    return clock_ms() - start;
}

/* ---- Frames ------------------------------------------------------------- */

/* Counts the commands, so that no compiler leaves the calls out. */
static void take_capture(void *user, const terrimp_capture_command *command)
{
    (void)command;
    ++*(uint64_t *)user;
}

static void take_impostor(void *user, const terrimp_impostor_command *command)
{
    (void)command;
    ++*(uint64_t *)user;
}

static void take_ground(void *user, const terrimp_ground_command *command)
{
    (void)command;
    ++*(uint64_t *)user;
}

static void take_floor(void *user, const terrimp_floor_command *command)
{
    (void)command;
    ++*(uint64_t *)user;
}

/* What a flight costs after its start, and how much memory the way keeps for it. */
typedef struct cost {
    stats update, render; /* processor [ms] */
    double start;         /* update and render of the worst frame of the start [ms] */
    double draws, triangles, captures;
    size_t bytes;
} cost;

/* Returns whether that was all, since the frame is of the start. */
static int note_cost(cost *c, int at_start, double update_ms, double render_ms)
{
    if (!at_start) {
        stats_add(&c->update, update_ms);
        stats_add(&c->render, render_ms);
    } else if (update_ms + render_ms > c->start) {
        c->start = update_ms + render_ms;
    }
    return at_start;
}

static void fly_view(const terrimp_terrain *terrain, const way *w, const tour *t,
                     const terrimp_box *box, cost *c)
{
    uint64_t commands = 0;
    const terrimp_callbacks callbacks = { &commands, take_capture, take_capture, take_impostor,
                                          take_ground, take_floor };
    terrimp_view_desc desc;
    terrimp_view *view;
    terrimp_stats now;
    void *memory;
    size_t i;
    memset(&desc, 0, sizeof desc);
    desc.mode = w->mode;
    desc.tolerance_px = w->tolerance_px;
    if (w->mode == TERRIMP_MODE_GEOMIP)
        desc.ground_tolerance_px = w->tolerance_px;
    c->bytes = terrimp_view_bytes(terrain, &desc);
    memory = need_memory(c->bytes);
    need(terrimp_view_init(terrain, &desc, memory, c->bytes, &view));
    for (i = 0; i < t->flight.count; i++) {
        terrimp_camera camera = tour_camera(t, box, i);
        double start = clock_cpu_ms(), middle;
        need(terrimp_view_update(view, &camera));
        middle = clock_cpu_ms();
        need(terrimp_view_render(view, &callbacks));
        need(terrimp_view_get_stats(view, &now));
        if (note_cost(c, i < t->flight.count / 6, middle - start, clock_cpu_ms() - middle))
            continue;
        c->draws += now.draws;
        c->triangles += now.triangles;
        c->captures += now.captures;
    }
    free(memory);
}

/* The tree is built anew: its time is the geomip room's own. Returns that time [ms]. */
static double fly_geomip(const terrimp_heightfield *field, const way *w, const tour *t,
                         const terrimp_box *box, cost *c)
{
    terrimp_quadtree tree;
    terrimp_geomip_view view;
    double build_ms = clock_cpu_ms();
    float *scratch;
    size_t i;
    need(terrimp_quadtree_init(field, 0, &tree));
    tree.nodes = need_memory(tree.node_count * sizeof *tree.nodes);
    scratch = need_memory((tree.field.width + 2u * tree.chunk_quads + 2u) * sizeof *scratch);
    need(terrimp_geomip_build(&tree, scratch));
    build_ms = clock_cpu_ms() - build_ms;
    memset(&view, 0, sizeof view);
    view.rule = TERRIMP_GEOMIP_BOUND;
    view.tolerance_px = w->tolerance_px;
    view.draw_capacity = tree.level_x[0] * tree.level_z[0];
    view.draws = need_memory(view.draw_capacity * sizeof *view.draws);
    view.distances = need_memory(tree.node_count * sizeof *view.distances);
    view.marks = need_memory(tree.node_count * sizeof *view.marks);
    memset(view.marks, 0, tree.node_count * sizeof *view.marks);
    c->bytes = view.draw_capacity * sizeof *view.draws
               + tree.node_count * (sizeof *tree.nodes + sizeof *view.distances
                                    + sizeof *view.marks);
    for (i = 0; i < t->flight.count; i++) {
        terrimp_camera camera = tour_camera(t, box, i);
        double start = clock_cpu_ms();
        need(terrimp_geomip_select(&tree, &view, &camera));
        if (note_cost(c, i < t->flight.count / 6, clock_cpu_ms() - start, 0.0))
            continue;
        c->draws += view.draw_count;
        c->triangles += view.triangle_count;
    }
    free(scratch);
    free(tree.nodes);
    free(view.draws);
    free(view.distances);
    free(view.marks);
    return build_ms;
}

/* ---- One size ----------------------------------------------------------- */

static void say_way(uint32_t size, const way *w, const cost *c)
{
    stats_summary update = stats_summarise(&c->update), render = stats_summarise(&c->render);
    double n = (double)update.count;
    say("| %u | %s | %.3f | %.3f | %.3f | %.3f | %.2f | %.0f | %.0f | %.2f | %.0f |\n",
        (unsigned)size, w->name, update.median, update.p99, render.median, render.p99, c->start,
        c->draws / n, c->triangles / n, c->captures / n, (double)c->bytes / 1024.0);
    fprintf(table, "%u\t%s\t%.4f\t%.4f\t%.4f\t%.4f\t%.3f\t%.1f\t%.0f\t%.3f\t%zu\n",
            (unsigned)size, w->name, update.median, update.p99, render.median, render.p99,
            c->start, c->draws / n, c->triangles / n, c->captures / n, c->bytes);
    plot_add(&frame_plot, w->name, size, update.mean + render.mean);
    plot_add(&memory_plot, w->name, size, (double)c->bytes / 1048576.0);
}

typedef struct built {
    double one_thread_ms, two_threads_ms; /* of the clock */
    double one_thread_cpu_ms, geomip_cpu_ms;
    uint32_t nodes;
    size_t terrain_bytes, scratch_bytes;
} built;

/* Of a square quadtree with so many chunks along a side. */
static uint32_t count_nodes(uint32_t chunks)
{
    uint32_t count = chunks * chunks;
    while (chunks > 1) {
        chunks = (chunks + 1) / 2;
        count += chunks * chunks;
    }
    return count;
}

static built measure(uint32_t size)
{
    uint16_t *samples = make_samples(size);
    terrimp_terrain_desc desc = describe(samples, size);
    terrimp_terrain_info info;
    terrimp_terrain *terrain;
    tour t;
    built b;
    void *memory;
    size_t i;
    memset(&b, 0, sizeof b);
    b.terrain_bytes = terrimp_terrain_bytes(&desc);
    b.scratch_bytes = terrimp_terrain_scratch_bytes(&desc);
    b.nodes = count_nodes((size - 2) / 64 + 1);
    memory = need_memory(b.terrain_bytes);
    if (size <= THREADED_UP_TO)
        b.two_threads_ms = build(&desc, memory, b.terrain_bytes, 2, b.nodes, &terrain);
    b.one_thread_cpu_ms = clock_cpu_ms();
    b.one_thread_ms = build(&desc, memory, b.terrain_bytes, 1, b.nodes, &terrain);
    b.one_thread_cpu_ms = clock_cpu_ms() - b.one_thread_cpu_ms;
    need(terrimp_terrain_get_info(terrain, &info));
    memset(&t, 0, sizeof t);
    t.field = desc.field;
    t.desc.frames = bench_frames(72);
    t.desc.width = 1280;
    t.desc.height = 1024;
    if (!tour_plan(&t))
        bench_stop("the flight", t.error);
    for (i = 0; i < WAY_COUNT; i++) {
        cost c;
        memset(&c, 0, sizeof c);
        if (ways[i].mode)
            fly_view(terrain, &ways[i], &t, &info.box, &c);
        else
            b.geomip_cpu_ms = fly_geomip(&desc.field, &ways[i], &t, &info.box, &c);
        say_way(size, &ways[i], &c);
        stats_free(&c.update);
        stats_free(&c.render);
    }
    tour_close(&t);
    free(memory);
    free(samples);
    plot_add(&memory_plot, "terrain", size, (double)b.terrain_bytes / 1048576.0);
    return b;
}

static void say_built(const built *all, size_t count)
{
    size_t i;
    say("\nBuilding; seconds of the clock, where a busy machine shows, and of the processor:\n\n"
        "| size | nodes | one thread | two threads | processor | ms a node | geomip room | "
        "terrain MiB | bytes a node | bytes a sample | scratch KiB |\n"
        "|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < count; i++) {
        const built *b = &all[i];
        double nodes = (double)b->nodes, bytes = (double)b->terrain_bytes;
        say("| %u | %u | %.2f | ", (unsigned)sizes[i], (unsigned)b->nodes,
            b->one_thread_ms * 1e-3);
        if (b->two_threads_ms > 0.0)
            say("%.2f | ", b->two_threads_ms * 1e-3);
        else
            say("| ");
        say("%.2f | %.2f | %.2f | %.2f | %.0f | %.3f | %.0f |\n", b->one_thread_cpu_ms * 1e-3,
            b->one_thread_cpu_ms / nodes, b->geomip_cpu_ms * 1e-3, bytes / 1048576.0,
            bytes / nodes, bytes / ((double)sizes[i] * sizes[i]),
            (double)b->scratch_bytes / 1024.0);
    }
}

int main(void)
{
    built all[SIZE_COUNT];
    size_t count = bench_all() ? SIZE_COUNT : DEFAULT_SIZE_COUNT, i;
    struct rusage usage;
    say_open("cpu", 0);
    say_machine(NULL);
    table = bench_output("cpu", ".tsv");
    fprintf(table, "size\tway\tupdate_median_ms\tupdate_p99_ms\trender_median_ms\trender_p99_ms\t"
            "start_worst_ms\tdraws\ttriangles\tcaptures\tbytes\n");
    say("\nA frame without graphics, %zu frames of the thesis' circle; processor times, ms:\n\n"
        "| size | way | update | 99 %% | render | 99 %% | start | draws | triangles | captures | "
        "KiB |\n|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n", bench_frames(72));
    for (i = 0; i < count; i++)
        all[i] = measure(sizes[i]);
    say_built(all, count);
    if (!plot_write(&frame_plot, "build/bench/cpu_frame.svg")
        || !plot_write(&memory_plot, "build/bench/cpu_memory.svg"))
        bench_stop("a plot", "it cannot be written");
    getrusage(RUSAGE_SELF, &usage);
    say("\nMost memory that the process ever had: %.0f MiB. Plots: build/bench/cpu_frame.svg, "
        "cpu_memory.svg\n", (double)usage.ru_maxrss / 1024.0);
    fclose(table);
    say_close();
    return 0;
}
