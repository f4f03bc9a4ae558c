/* Repeats the measurement of Finch and Bishop: 8 x 8 pages of 65 x 65 samples repeat without end,
   an eye flies a circle at a constant height above the ground, 1000 frames, and the scale of the
   levels is raised until triangles go from 400 to 6000 a frame. What is timed is what makes them,
   without drawing: medians over the frames, less what the clock takes itself. Cycles are those of a
   chain of additions and shifts on the same machine.

   Build:  make bench_sorted
   Use:    build/bench_sorted   (BENCH_FRAMES is the number of frames of a flight [1000])
   Leaves: build/bench/sorted.md (what it prints), sorted.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_say.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SIDE = 513 };
static float heights[SIDE * SIDE];

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* The same by the wall: without a call of the system, after which what is timed finds its caches
   cold. */
static double wall_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double median_of(double *values, size_t count)
{
    qsort(values, count, sizeof *values, compare_doubles);
    return values[count / 2];
}

/* What asking for the time takes. */
static double clock_seconds(void)
{
    double took[101];
    int i;
    for (i = 0; i < 101; i++) {
        double start = wall_seconds();
        took[i] = wall_seconds() - start;
    }
    return median_of(took, 101);
}

/* Six operations that wait for each other take six cycles. */
static double cycles_a_second(void)
{
    double best = 0.0;
    int i, k;
    for (k = 0; k < 5; k++) {
        uint32_t x = 1;
        double start = seconds(), rate;
        for (i = 0; i < 4000000; i++)
            x ^= x << 13, x ^= x >> 17, x ^= x << 5;
        rate = 6.0 * 4000000.0 / (seconds() - start);
        best = rate > best && x ? rate : best;
    }
    return best;
}

static void make_hills(void)
{
    int x, z, k;
    for (z = 0; z < SIDE; z++)
        for (x = 0; x < SIDE; x++)
            for (k = 1; k <= 64; k *= 2) {
                float a = (float)(x * k % 512) * 0.01227185f;
                float b = (float)(z * k % 512) * 0.01227185f;
                heights[z * SIDE + x] += 12.0f / (float)k * sinf(a + sinf(b)) * sinf(b + (float)k);
            }
}

static terrimp_camera on_circle(const terrimp_heightfield *field, size_t frame, size_t frames)
{
    terrimp_camera camera;
    float turn = 6.2831853f * (float)frame / (float)frames, ground = 0.0f;
    memset(&camera, 0, sizeof camera);
    camera.eye[0] = 256.0f + 150.0f * cosf(turn);
    camera.eye[2] = 256.0f + 150.0f * sinf(turn);
    need(terrimp_heightfield_height(field, camera.eye[0], camera.eye[2], &ground));
    camera.eye[1] = ground + 4.0f;
    camera.forward[0] = -sinf(turn);
    camera.forward[1] = -0.1f;
    camera.forward[2] = cosf(turn);
    camera.fov_y_rad = 0.8f;
    camera.width_px = 640, camera.height_px = 480;
    camera.z_near = 1.0f, camera.z_far = 400.0f;
    return camera;
}

/* The means of a flight. */
typedef struct flight_row {
    double triangles, pages, cycles;
} flight_row;

/* Flies once and says a row. */
static flight_row fly(float scale, uint32_t max_triangles, size_t frames, double rate)
{
    flight_row row;
    static terrimp_sorted_square squares[64];
    terrimp_sorted_desc desc;
    terrimp_sorted s;
    double *begin = (double *)need_memory(frames * sizeof *begin), clock_took = clock_seconds();
    double *next = (double *)need_memory(frames * sizeof *next), median;
    double triangles = 0.0, pages = 0.0, start, least = 1e9, most = 0.0;
    size_t i;
    uint32_t got, k;
    memset(&desc, 0, sizeof desc);
    desc.field.samples = heights;
    desc.field.width = desc.field.depth = SIDE;
    desc.field.wrap = 1;
    desc.scale = scale;
    desc.max_triangles = max_triangles;
    need(terrimp_sorted_init(&desc, &s));
    for (i = 0; i < frames; i++) {
        terrimp_camera camera = on_circle(&s.desc.field, i, frames);
        int32_t page_x = 1 << 30, page_z = 0;
        start = wall_seconds();
        need(terrimp_sorted_begin(&s, &camera));
        begin[i] = wall_seconds() - start - clock_took;
        start = wall_seconds();
        while (terrimp_sorted_next(&s, squares, 64) == 64)
            ;
        next[i] = (wall_seconds() - start - clock_took) / s.triangle_count;
        triangles += s.triangle_count;
        least = s.triangle_count < least ? s.triangle_count : least;
        most = s.triangle_count > most ? s.triangle_count : most;
        need(terrimp_sorted_begin(&s, &camera)); /* once more, to count its pages */
        do {
            got = terrimp_sorted_next(&s, squares, 64);
            for (k = 0; k < got; k++) {
                pages += squares[k].page_x != page_x || squares[k].page_z != page_z;
                page_x = squares[k].page_x, page_z = squares[k].page_z;
            }
        } while (got == 64);
    }
    median = median_of(next, frames);
    say("| %s %g | %.0f | %.0f to %.0f | %.0f | %.1f | %.0f | %.1f |\n",
        max_triangles ? "max_triangles" : "scale",
        max_triangles ? (double)max_triangles : (double)scale, triangles / (double)frames, least,
        most, pages / (double)frames, 1e9 * median, rate * median,
        1e6 * median_of(begin, frames));
    free(begin), free(next);
    row.triangles = triangles / (double)frames, row.pages = pages / (double)frames;
    row.cycles = rate * median;
    return row;
}

/* ---- views over the same pages ---- */

enum { QUADS = 64, GRID = QUADS * QUADS * 6 };

typedef struct order_host {
    const terrimp_terrain *terrain;
    terrimp_terrain_info info;
    float eye[3];
    float *xyz; /* of all meshes */
    uint16_t *mesh_indices, indices[GRID], scratch[8192];
    double ground_seconds, ground_triangles, mesh_seconds, mesh_triangles;
    size_t draws, captures;
    int capturing;
} order_host;

static void view_capture(void *user, const terrimp_capture_command *c)
{
    order_host *h = (order_host *)user;
    h->capturing = !h->capturing;
    h->captures += (size_t)h->capturing;
    (void)c;
}

static void view_ground(void *user, const terrimp_ground_command *c)
{
    order_host *h = (order_host *)user;
    double start = seconds();
    uint32_t count = 0;
    float eye[3];
    if (h->capturing)
        return;
    memcpy(eye, h->eye, sizeof eye);
    eye[0] -= c->offset[0], eye[2] -= c->offset[1];
    need(terrimp_sorted_ground(h->terrain, c, eye, h->indices, GRID, &count));
    h->ground_seconds += seconds() - start;
    h->ground_triangles += count / 3;
    h->draws++;
}

static void view_impostor(void *user, const terrimp_impostor_command *c)
{
    order_host *h = (order_host *)user;
    terrimp_mesh_info mesh;
    double start;
    float eye[3];
    memcpy(eye, h->eye, sizeof eye);
    eye[0] -= c->offset[0], eye[2] -= c->offset[1];
    need(terrimp_terrain_get_mesh(h->terrain, c->node, &mesh));
    memcpy(h->indices, h->mesh_indices + c->first_index, c->index_count * sizeof *h->indices);
    start = seconds();
    need(terrimp_sorted_mesh(h->xyz + 3 * c->base_vertex, mesh.vertex_count, eye, h->indices,
                             c->index_count, h->scratch, NULL));
    h->mesh_seconds += seconds() - start;
    h->mesh_triangles += c->index_count / 3;
    h->draws++;
}

/* Flies once and says a row. Returns the median of what a frame costs. */
static float fly_view(order_host *h, const char *name, int mode, float max_cost, size_t frames,
                      double rate)
{
    terrimp_view_desc d;
    terrimp_view *view = NULL;
    terrimp_callbacks draw;
    double *costs = (double *)need_memory(frames * sizeof *costs), median;
    double update = 0.0;
    size_t i, first = frames / 20; /* until the pictures are there */
    memset(&d, 0, sizeof d);
    memset(&draw, 0, sizeof draw);
    d.mode = mode, d.sorted = 1, d.max_cost = max_cost;
    need(terrimp_view_create(h->terrain, &d, NULL, &view));
    draw.user = h;
    draw.begin_capture = draw.end_capture = view_capture;
    draw.draw_ground = view_ground, draw.draw_impostor = view_impostor;
    h->ground_seconds = h->ground_triangles = h->mesh_seconds = h->mesh_triangles = 0.0;
    h->draws = h->captures = 0;
    for (i = 0; i < frames; i++) {
        terrimp_stats of_frame;
        terrimp_heightfield field;
        terrimp_camera camera;
        double start;
        memset(&field, 0, sizeof field);
        field.samples = heights, field.width = field.depth = SIDE, field.wrap = 1;
        camera = on_circle(&field, i, frames);
        memcpy(h->eye, camera.eye, sizeof h->eye);
        start = seconds();
        need(terrimp_view_update(view, &camera));
        update += seconds() - start;
        need(terrimp_view_get_stats(view, &of_frame));
        need(terrimp_view_render(view, &draw));
        costs[i] = (double)of_frame.cost;
    }
    frames -= first;
    median = median_of(costs + first, frames);
    say("| %s | %.1f | %.2f | %.0f | %.0f | %.0f | %.2f | %.0f | %.0f |\n", name,
        (double)h->draws / (double)frames, (double)h->captures / (double)frames,
        (h->ground_triangles + h->mesh_triangles) / (double)frames, 1e6 * update / (double)frames,
        median, costs[first + frames * 99 / 100] / median,
        h->ground_triangles > 0.0 ? rate * h->ground_seconds / h->ground_triangles : 0.0,
        h->mesh_triangles > 0.0 ? rate * h->mesh_seconds / h->mesh_triangles : 0.0);
    terrimp_view_destroy(view);
    free(costs);
    return (float)median;
}

static void fly_views(size_t frames, double rate)
{
    static order_host h;
    terrimp_terrain_desc desc;
    terrimp_terrain *terrain = NULL;
    float median;
    memset(&desc, 0, sizeof desc);
    desc.field.samples = heights;
    desc.field.width = desc.field.depth = SIDE;
    desc.field.wrap = 1;
    desc.chunk_quads = QUADS;
    need(terrimp_terrain_create(&desc, NULL, &terrain));
    h.terrain = terrain;
    need(terrimp_terrain_get_info(terrain, &h.info));
    h.xyz = (float *)calloc(3 * h.info.mesh_vertex_count, sizeof *h.xyz);
    h.mesh_indices = (uint16_t *)calloc(h.info.mesh_index_count, sizeof *h.mesh_indices);
    need(terrimp_terrain_fill_meshes(terrain, h.xyz, 3 * h.info.mesh_vertex_count, h.mesh_indices,
                                     h.info.mesh_index_count));
    say("\nViews of the same pages, repeated without end, and painter's order of all that they "
        "draw; costs as predicted,\nin the unit of `terrimp_costs`, captures and all, "
        "from the 50th frame on\n\n"
        "| mode | draws | captures | triangles | update us | median cost | 99 %% / median | cycles "
        "a triangle of ground | of meshes |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    median = fly_view(&h, "GEOMIP", TERRIMP_MODE_GEOMIP, 0.0f, frames, rate);
    fly_view(&h, "GEOMIP, max_cost 0.8 of that", TERRIMP_MODE_GEOMIP, 0.8f * median, frames, rate);
    median = fly_view(&h, "AUTO", TERRIMP_MODE_AUTO, 0.0f, frames, rate);
    fly_view(&h, "AUTO, max_cost 1.2 of that", TERRIMP_MODE_AUTO, 1.2f * median, frames, rate);
    terrimp_terrain_destroy(terrain);
    free(h.xyz), free(h.mesh_indices);
}

int main(void)
{
    static const float scales[] = { 2.0f, 3.0f, 5.0f, 8.0f, 12.0f, 17.0f, 18.5f };
    static const uint32_t most[] = { 400, 1000, 2000, 6000 };
    flight_row first = { 0.0, 0.0, 0.0 }, last = first;
    size_t frames = bench_frames(1000), i;
    double rate = cycles_a_second();
    make_hills();
    say_open("sorted", 1);
    say_machine(NULL);
    say("\nTriangles in painter's order from 8 x 8 pages of 65 x 65 samples without end, %u frames "
        "of a circle,\n%.2f GHz, a state of %u bytes\n\n", (unsigned)frames, 1e-9 * rate,
        (unsigned)sizeof(terrimp_sorted));
    say("| levels | triangles a frame | least to most | pages | ns a triangle | cycles a triangle "
        "| begin us |\n|---|--:|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < sizeof scales / sizeof scales[0]; i++) {
        last = fly(scales[i], 0, frames, rate);
        first = i == 0 ? last : first;
    }
    for (i = 0; i < sizeof most / sizeof most[0]; i++)
        fly(12.0f, most[i], frames, rate);
    say("\n| | Finch and Bishop 1998 | here |\n|---|--:|--:|\n"
        "| machine | Pentium, 133 MHz | %.2f GHz |\n"
        "| pages in the footprint | 35 | %.0f |\n"
        "| triangles of these at full detail | 286720 | %.0f |\n"
        "| triangles that are made, a frame | 400 to 6000 | %.0f to %.0f |\n"
        "| the fewest for each page | under 12 | %.1f |\n"
        "| cycles a triangle | 5540 | %.0f to %.0f |\n"
        "| microseconds a triangle | 41.7 | %.3f to %.3f |\n"
        "| frames a second at 400 triangles | 60 | %.0f |\n\n"
        "The paper gives 60 frames a second at 400 triangles, and that cost is linear; its other "
        "figures follow from these.\n", 1e-9 * rate, first.pages, first.pages * 8192.0,
        first.triangles, last.triangles, first.triangles / first.pages, first.cycles, last.cycles,
        1e6 * first.cycles / rate, 1e6 * last.cycles / rate, rate / (400.0 * first.cycles));
    fly_views(frames, rate);
    say_close();
    return 0;
}
