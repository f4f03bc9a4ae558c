/* Times the Geomipmap room alone, without graphics: building, then selection with
   culling and the list of draws, over a flight. Terrains of 4097 x 4097 samples: the procedural one
   (peaks and valleys) and a rough one (noise of all wavelengths); 1280 x 1024 pixels, 60 degrees.
   Times are of the processor; a frame's is the median over the flight, the least of three rounds.
   Build:  make bench_geomip
   Leaves: build/bench/geomip.md (what it prints), geomip.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_say.h"

#include "examples/host/procedural.h"

#include <math.h>

enum { SIDE = 4097, FRAMES = 200, ROUNDS = 3 };

static void *allocate(size_t count, size_t size)
{
    return memset(need_memory(count * size), 0, count * size);
}

/* Midpoint displacement: each halving of the step adds two thirds as much. */
static uint16_t *rough_terrain(void)
{
    float *heights = allocate((size_t)SIDE * SIDE, sizeof *heights), amplitude = 1.0f;
    uint16_t *samples = allocate((size_t)SIDE * SIDE, sizeof *samples);
    uint32_t state = 1u, step, x, z;
    size_t i;
    for (step = SIDE - 1; step > 0; step /= 2, amplitude *= 0.66f)
        for (z = 0; z < SIDE; z += step)
            for (x = 0; x < SIDE; x += step) {
                uint32_t odd_x = x / step % 2u * step, odd_z = z / step % 2u * step;
                float *at = &heights[(size_t)z * SIDE + x];
                state = state * 1664525u + 1013904223u;
                if (step < SIDE - 1 && (odd_x || odd_z))
                    *at = 0.5f * (heights[(size_t)(z - odd_z) * SIDE + (x - odd_x)] +
                                  heights[(size_t)(z + odd_z) * SIDE + (x + odd_x)]) +
                          amplitude * ((float)(state >> 8) / 8388608.0f - 1.0f);
            }
    for (i = 0; i < (size_t)SIDE * SIDE; i++)
        samples[i] = (uint16_t)fminf(fmaxf(32768.0f + 12000.0f * heights[i], 0.0f), 65535.0f);
    free(heights);
    return samples;
}

/* A circle over the middle of the terrain, 60 units above the highest ground below, looking ahead
   and somewhat down. */
static terrimp_camera camera_at(const terrimp_quadtree *tree, int frame)
{
    terrimp_camera c;
    float turn = 6.2831853f * (float)frame / FRAMES, height = 0.0f;
    memset(&c, 0, sizeof c);
    c.eye[0] = 2048.0f + 1400.0f * cosf(turn);
    c.eye[2] = 2048.0f + 1400.0f * sinf(turn);
    terrimp_heightfield_height(&tree->field, c.eye[0], c.eye[2], &height);
    c.eye[1] = height + 60.0f;
    c.forward[0] = -sinf(turn);
    c.forward[1] = -0.25f;
    c.forward[2] = cosf(turn);
    c.fov_y_rad = 1.0471976f;
    c.width_px = 1280;
    c.height_px = 1024;
    c.z_near = 1.0f;
    c.z_far = 8192.0f;
    return c;
}

static void bench_rule(const terrimp_quadtree *tree, terrimp_geomip_view *view, const char *name)
{
    double median = 1e9, draws = 0.0, triangles = 0.0;
    uint32_t most = 0;
    int round, frame;
    for (round = 0; round < ROUNDS; round++) {
        stats ms = { NULL, 0, 0 };
        draws = triangles = 0.0;
        for (frame = 0; frame < FRAMES; frame++) {
            terrimp_camera camera = camera_at(tree, frame);
            double start = clock_cpu_ms();
            terrimp_result result = terrimp_geomip_select(tree, view, &camera);
            stats_add(&ms, clock_cpu_ms() - start);
            if (result != TERRIMP_OK)
                exit(2);
            draws += view->draw_count;
            triangles += view->triangle_count;
            most = view->draw_count > most ? view->draw_count : most;
        }
        median = fmin(median, stats_summarise(&ms).median);
        stats_free(&ms);
    }
    say("| %s, %g px | %.4f | %.0f | %u | %.0f |\n", name, (double)view->tolerance_px, median,
           draws / FRAMES, (unsigned)most, triangles / FRAMES);
}

static void bench_terrain(const char *name, uint16_t *samples, float scale, uint32_t quads)
{
    static const char *const rules[] = {"", "picture", "bound", "distance"};
    static const float tolerances[] = {1.0f, 4.0f};
    terrimp_heightfield field;
    terrimp_quadtree tree;
    terrimp_geomip_view view;
    float *scratch;
    double start;
    int rule, i;
    memset(&field, 0, sizeof field);
    memset(&view, 0, sizeof view);
    field.samples = samples;
    field.width = field.depth = SIDE;
    field.format = TERRIMP_FORMAT_U16;
    field.height_scale = scale;
    if (terrimp_quadtree_init(&field, quads, &tree) != TERRIMP_OK)
        exit(2);
    tree.nodes = allocate(tree.node_count, sizeof *tree.nodes);
    scratch = allocate(SIDE + 2u * quads + 2u, sizeof *scratch);
    view.distances = allocate(tree.node_count, sizeof *view.distances);
    view.marks = allocate(tree.node_count, sizeof *view.marks);
    view.draw_capacity = tree.level_first[1];
    view.draws = allocate(view.draw_capacity, sizeof *view.draws);
    start = clock_cpu_ms();
    if (terrimp_geomip_build(&tree, scratch) != TERRIMP_OK)
        exit(2);
    say("\n%s, chunks of %u: all of the tree %.0f ms\n", name, (unsigned)quads,
        clock_cpu_ms() - start);
    say("| rule | select ms | draws | most | triangles |\n|---|--:|--:|--:|--:|\n");
    for (rule = TERRIMP_GEOMIP_PICTURE; rule < (int)TERRIMP_GEOMIP_RULE_COUNT; rule++)
        for (i = 0; i < 2; i++) {
            view.rule = rule;
            view.tolerance_px = tolerances[i];
            bench_rule(&tree, &view, rules[rule]);
        }
    free(tree.nodes);
    free(scratch);
    free(view.distances);
    free(view.marks);
    free(view.draws);
}

int main(void)
{
    uint16_t *procedural = procedural_terrain(SIDE, SIDE, 1), *rough = rough_terrain();
    uint32_t quads;
    say_open("geomip", 1);
    say_machine(NULL);
    if (!procedural)
        bench_stop("memory", "there is none");
    for (quads = 64; quads >= 32; quads /= 2) {
        bench_terrain("procedural", procedural, PROCEDURAL_HEIGHT_SCALE, quads);
        bench_terrain("rough", rough, 1.0f / 64.0f, quads);
    }
    free(procedural);
    free(rough);
    say_close();
    return 0;
}
