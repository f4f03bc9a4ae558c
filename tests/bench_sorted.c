/* Repeats the measurement of Finch and Bishop: 8 x 8 pages of 65 x 65 samples repeat without end,
   an eye flies a circle at a constant height above the ground, 1000 frames, and the scale of the
   levels is raised until triangles go from 400 to 6000 a frame. What is timed is what makes them,
   without drawing: medians over the frames, less what the clock takes itself. Cycles are those of a
   chain of additions and shifts on the same machine. Then views in painter's order over the same
   pages, and what max_cost makes of flights over other terrain.

   Build:  make bench_sorted
   Use:    build/bench_sorted   (BENCH_FRAMES is the number of frames of a flight [1000])
   Leaves: build/bench/sorted.md (what it prints), sorted.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_pace.h"
#include "bench_say.h"

#include "examples/host/raster.h"

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

enum { QUADS = 64, GRID = QUADS * QUADS * 6, WIDE = 640, HIGH = 480, LOG2_ATLAS = 11 };
enum { ATLAS = 1 << LOG2_ATLAS, FLIGHTS = 3 };

/* A host without a depth buffer. */
typedef struct order_host {
    const terrimp_terrain *terrain;
    terrimp_terrain_info info;
    uint16_t screen[WIDE * HIGH], atlas[ATLAS * ATLAS], texels[512 * 512 * 4 / 3];
    raster_texture land, pictures;
    raster r;
    float view[16], projection[16], eye[3];
    float *meshes, xyz[(QUADS + 1) * (QUADS + 1) * 3];
    uint16_t *mesh_indices, indices[GRID], scratch[8192];
    uint32_t filled; /* the node whose ground is in xyz */
    double ground_seconds, ground_triangles, mesh_seconds, mesh_triangles;
    size_t draws, captures;
    int capturing, on_screen;
} order_host;

static void view_begin(void *user, const terrimp_capture_command *c)
{
    order_host *h = (order_host *)user;
    raster_begin(&h->r, h->atlas + c->slot.y * ATLAS + c->slot.x, NULL, ATLAS, (int)c->slot.width,
                 (int)c->slot.height, 0, c->view, c->projection, c->eye);
    if (c->clear)
        raster_clear(&h->r, RASTER_KEY);
    h->capturing = 1;
    h->on_screen = 0;
    h->captures++;
}

static void view_end(void *user, const terrimp_capture_command *c)
{
    ((order_host *)user)->capturing = 0;
    (void)c;
}

/* Stands for a repetition: its vertices stay, and the eye moves the other way. */
static void view_stand(order_host *h, const float offset[2], float eye[3])
{
    if (!h->capturing && !h->on_screen) {
        h->on_screen = 1;
        raster_begin(&h->r, h->screen, NULL, WIDE, WIDE, HIGH, 1, h->view, h->projection, h->eye);
        raster_clear(&h->r, 0xae9d);
    }
    memcpy(eye, h->r.eye, sizeof h->r.eye);
    h->r.eye[0] -= offset[0], h->r.eye[2] -= offset[1];
}

static void view_ground(void *user, const terrimp_ground_command *c)
{
    static const float lit[16] = { 1.0f / 512.0f, 0, 0, 0, 0, 0, 0, 0, 0, 1.0f / 512.0f, 0, 0,
                                   0.5f / 512.0f, 0.5f / 512.0f, 0, 1.0f };
    order_host *h = (order_host *)user;
    raster_style style = { 0 };
    double start;
    uint32_t count = 0;
    float eye[3];
    view_stand(h, c->offset, eye);
    start = seconds();
    need(terrimp_sorted_ground(h->terrain, c, h->r.eye, h->indices, GRID, &count));
    if (!h->capturing) {
        h->ground_seconds += seconds() - start;
        h->ground_triangles += count / 3;
        h->draws++;
    }
    if (c->node != h->filled)
        need(terrimp_terrain_fill_ground(h->terrain, c->node, h->xyz,
                                         sizeof h->xyz / sizeof *h->xyz));
    h->filled = c->node;
    style.texture = &h->land, style.texture_matrix = lit, style.share = RASTER_ALL;
    raster_draw(&h->r, &style, h->xyz, h->indices, count);
    memcpy(h->r.eye, eye, sizeof eye);
}

static void view_impostor(void *user, const terrimp_impostor_command *c)
{
    order_host *h = (order_host *)user;
    terrimp_mesh_info mesh;
    raster_style style = { 0 };
    double start;
    float eye[3];
    view_stand(h, c->offset, eye);
    need(terrimp_terrain_get_mesh(h->terrain, c->node, &mesh));
    memcpy(h->indices, h->mesh_indices + c->first_index, c->index_count * sizeof *h->indices);
    start = seconds();
    need(terrimp_sorted_mesh(h->meshes + 3 * c->base_vertex, mesh.vertex_count, h->r.eye,
                             h->indices, c->index_count, h->scratch, NULL));
    h->mesh_seconds += seconds() - start;
    h->mesh_triangles += c->index_count / 3;
    h->draws++;
    style.texture = &h->pictures, style.texture_matrix = c->texture_matrix;
    memcpy(style.picture_eye, c->eye, sizeof style.picture_eye);
    style.picture_eye[0] -= c->offset[0], style.picture_eye[2] -= c->offset[1];
    style.share = (int)(c->alpha * RASTER_ALL + 0.5f);
    style.within_depth = c->part_count > 1;
    raster_draw(&h->r, &style, h->meshes + 3 * c->base_vertex, h->indices, c->index_count);
    memcpy(h->r.eye, eye, sizeof eye);
}

/* Flies a third of the circle, and again: what a frame takes is the least of its times. Says a row.
   Returns the median of what a frame is predicted to cost. */
static float fly_view(order_host *h, const char *name, int mode, float max_cost, size_t frames,
                      double rate)
{
    terrimp_view_desc d;
    terrimp_callbacks draw;
    double *costs = (double *)need_memory(2 * frames * sizeof *costs), *took = costs + frames;
    double update = 0.0, median, took_median;
    size_t i, k, count = frames / 3, first = count / 20; /* until the pictures are there */
    memset(&d, 0, sizeof d);
    memset(&draw, 0, sizeof draw);
    d.mode = mode, d.sorted = 1, d.max_cost = max_cost, d.atlas_size = ATLAS;
    d.endless = terrimp_view_endless(), d.cost_limit = terrimp_view_cost_limit();
    d.costs.ground_px = d.costs.impostor_px = 0.5f; /* of this host, a triangle's 40 ns being 1 */
    draw.user = h;
    draw.begin_capture = view_begin, draw.end_capture = view_end;
    draw.draw_ground = view_ground, draw.draw_impostor = view_impostor;
    for (k = 0; k < FLIGHTS; k++) {
        terrimp_view *view = NULL;
        need(terrimp_view_create(h->terrain, &d, NULL, &view));
        h->ground_seconds = h->ground_triangles = h->mesh_seconds = h->mesh_triangles = 0.0;
        h->draws = h->captures = 0;
        for (i = 0; i < count; i++) {
            terrimp_stats of_frame;
            terrimp_heightfield field;
            terrimp_camera camera;
            double start, middle, end;
            memset(&field, 0, sizeof field);
            field.samples = heights, field.width = field.depth = SIDE, field.wrap = 1;
            camera = on_circle(&field, i, frames);
            memcpy(h->eye, camera.eye, sizeof h->eye);
            need(terrimp_camera_matrices(&camera, h->view, h->projection));
            h->on_screen = 0;
            start = seconds();
            need(terrimp_view_update(view, &camera));
            middle = seconds();
            need(terrimp_view_get_stats(view, &of_frame));
            need(terrimp_view_render(view, &draw));
            end = seconds();
            update += middle - start;
            took[i] = k == 0 || end - start < took[i] ? end - start : took[i];
            costs[i] = (double)of_frame.cost;
        }
        terrimp_view_destroy(view);
    }
    median = median_of(costs + first, count - first);
    took_median = median_of(took + first, count - first);
    say("| %s | %.1f | %.2f | %.0f | %.0f | %.0f | %.2f | %.2f | %.2f | %.0f | %.0f |\n", name,
        (double)h->draws / (double)count, (double)h->captures / (double)count,
        (h->ground_triangles + h->mesh_triangles) / (double)count,
        1e6 * update / (double)(FLIGHTS * count), median,
        costs[first + (count - first) * 99 / 100] / median, 1e3 * took_median,
        took[first + (count - first) * 99 / 100] / took_median,
        h->ground_triangles > 0.0 ? rate * h->ground_seconds / h->ground_triangles : 0.0,
        h->mesh_triangles > 0.0 ? rate * h->mesh_seconds / h->mesh_triangles : 0.0);
    free(costs);
    return (float)median;
}

static void draw_land(order_host *h)
{
    uint8_t *rgb = (uint8_t *)need_memory(512 * 512 * 3);
    int x, z, k;
    for (z = 0; z < 512; z++)
        for (x = 0; x < 512; x++)
            for (k = 0; k < 3; k++)
                rgb[3 * (z * 512 + x) + k] =
                    (uint8_t)(128.0f + 24.0f * (heights[z * SIDE + x + 1] - heights[z * SIDE + x]));
    raster_make_texture(&h->land, h->texels, rgb, 9);
    h->pictures.levels[0] = h->atlas, h->pictures.level_count = 1;
    h->pictures.log2_side = LOG2_ATLAS;
    free(rgb);
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
    h.filled = 0xffffffffu;
    need(terrimp_terrain_get_info(terrain, &h.info));
    h.meshes = (float *)calloc(3 * h.info.mesh_vertex_count, sizeof *h.meshes);
    h.mesh_indices = (uint16_t *)calloc(h.info.mesh_index_count, sizeof *h.mesh_indices);
    draw_land(&h);
    need(terrimp_terrain_fill_meshes(terrain, h.meshes, 3 * h.info.mesh_vertex_count,
                                     h.mesh_indices, h.info.mesh_index_count));
    say("\nViews of the same pages, repeated without end, and painter's order of all that they "
        "draw; costs as predicted,\nin the unit of `terrimp_costs`, captures and all; processor "
        "time of all of the frame, drawn by\n`examples/host/raster.c` at %d x %d without a depth "
        "buffer: a third of the circle from its 16th frame on, the least\nof %d flights\n\n"
        "| mode | draws | captures | triangles | update us | median cost | 99 %% / median | median "
        "ms | 99 %% / median | cycles a triangle of ground | of meshes |\n"
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n", WIDE, HIGH, FLIGHTS);
    median = fly_view(&h, "GEOMIP", TERRIMP_MODE_GEOMIP, 0.0f, frames, rate);
    fly_view(&h, "GEOMIP, max_cost 0.8 of that", TERRIMP_MODE_GEOMIP, 0.8f * median, frames, rate);
    median = fly_view(&h, "AUTO", TERRIMP_MODE_AUTO, 0.0f, frames, rate);
    fly_view(&h, "AUTO, max_cost 1.2 of that", TERRIMP_MODE_AUTO, 1.2f * median, frames, rate);
    terrimp_terrain_destroy(terrain);
    free(h.meshes), free(h.mesh_indices);
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
    pace_flights();
    say_close();
    return 0;
}
