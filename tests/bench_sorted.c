/* Repeats the measurement of Finch and Bishop: 8 x 8 pages of 65 x 65 samples repeat without end,
   an eye flies a circle at a constant height above the ground, 1000 frames, and the scale of the
   levels is raised until triangles go from 400 to 6000 a frame. What is timed is what makes them,
   without drawing. Cycles are those of a chain of additions and shifts on the same machine.

   Build:  make bench_sorted
   Use:    build/bench_sorted   (BENCH_FRAMES is the number of frames of a flight [1000])
   Leaves: build/bench/sorted.md (what it prints), sorted.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_say.h"

#include <math.h>
#include <time.h>

enum { SIDE = 513 };
static float heights[SIDE * SIDE];

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
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

/* Flies once and says a row. */
static void fly(float scale, uint32_t max_triangles, size_t frames, double rate)
{
    static terrimp_sorted_square squares[64];
    terrimp_sorted_desc desc;
    terrimp_sorted s;
    double begin = 0.0, next = 0.0, triangles = 0.0, pages = 0.0, start, least = 1e9, most = 0.0;
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
        start = seconds();
        need(terrimp_sorted_begin(&s, &camera));
        begin += seconds() - start;
        start = seconds();
        while (terrimp_sorted_next(&s, squares, 64) == 64)
            ;
        next += seconds() - start;
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
    say("| %s %g | %.0f | %.0f to %.0f | %.0f | %.1f | %.0f | %.1f |\n",
        max_triangles ? "max_triangles" : "scale",
        max_triangles ? (double)max_triangles : (double)scale, triangles / (double)frames, least,
        most, pages / (double)frames, 1e9 * next / triangles, rate * next / triangles,
        1e6 * begin / (double)frames);
}

int main(void)
{
    static const float scales[] = { 2.0f, 3.0f, 5.0f, 8.0f, 12.0f, 17.0f, 18.5f };
    static const uint32_t most[] = { 400, 1000, 2000, 6000 };
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
    for (i = 0; i < sizeof scales / sizeof scales[0]; i++)
        fly(scales[i], 0, frames, rate);
    for (i = 0; i < sizeof most / sizeof most[0]; i++)
        fly(12.0f, most[i], frames, rate);
    say("| Finch and Bishop 1998, Pentium 133 | 400 to 6000 | | 35 | 41700 | 5540 | |\n\n"
        "The paper gives 60 frames a second at 400 triangles, from which its last line is; cost "
        "was linear there too.\n");
    say_close();
    return 0;
}
