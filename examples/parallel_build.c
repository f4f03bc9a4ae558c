/* Shows how to build a terrain with several threads: nodes in any order, each thread with a scratch
   block of its own, and the same bytes as one thread makes.
   Build:  cc -O2 -std=c99 -I. examples/parallel_build.c -lm -lpthread -o parallel_build
   Use:    parallel_build [THREADS [SIDE]]
   Expect: how much faster 2 threads are, nearly twice on two idle cores: the best of three times
           each, by turns; `the same bytes`. */
#define _POSIX_C_SOURCE 200809L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_THREADS = 64, TURNS = 3 };

/* What the threads share. Each takes the next node: the largest ones, which are the last, first. */
typedef struct work {
    terrimp_terrain *terrain;
    size_t scratch_bytes;
    pthread_mutex_t lock;
    uint32_t left;
    terrimp_result result;
} work;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *build_nodes(void *shared)
{
    work *w = shared;
    void *scratch = malloc(w->scratch_bytes);
    terrimp_result result = scratch ? TERRIMP_OK : TERRIMP_E_MEMORY;
    for (;;) {
        uint32_t node = UINT32_MAX;
        pthread_mutex_lock(&w->lock);
        if (result != TERRIMP_OK)
            w->result = result;
        if (w->result == TERRIMP_OK && w->left > 0)
            node = --w->left;
        pthread_mutex_unlock(&w->lock);
        if (node == UINT32_MAX)
            break;
        result = terrimp_terrain_build_node(w->terrain, node, scratch, w->scratch_bytes);
    }
    free(scratch);
    return NULL;
}

/* Builds in `memory`; returns the seconds that it took, or ends the program. */
static double build(const terrimp_terrain_desc *desc, void *memory, int threads,
                    terrimp_terrain **terrain)
{
    pthread_t thread[MOST_THREADS];
    terrimp_result result;
    double start = now();
    terrimp_quadtree tree;
    work w;
    int i, started;
    memset(&w, 0, sizeof w);
    memset(&tree, 0, sizeof tree);
    result = terrimp_terrain_init(desc, memory, terrimp_terrain_bytes(desc), &w.terrain);
    if (result == TERRIMP_OK)
        result = terrimp_terrain_build_begin(w.terrain);
    if (result == TERRIMP_OK) /* how many nodes there are */
        result = terrimp_quadtree_init(&desc->field, desc->chunk_quads, &tree);
    w.left = tree.node_count;
    w.scratch_bytes = terrimp_terrain_scratch_bytes(desc);
    w.result = result;
    pthread_mutex_init(&w.lock, NULL);
    for (started = 0; started < threads; started++)
        if (pthread_create(&thread[started], NULL, build_nodes, &w) != 0)
            break;
    for (i = 0; i < started; i++)
        pthread_join(thread[i], NULL);
    pthread_mutex_destroy(&w.lock);
    if (started == 0)
        w.result = TERRIMP_E_MEMORY;
    if (w.result == TERRIMP_OK)
        w.result = terrimp_terrain_build_finish(w.terrain);
    if (w.result != TERRIMP_OK) {
        fprintf(stderr, "parallel_build: %s\n", terrimp_result_text(w.result));
        exit(1);
    }
    *terrain = w.terrain;
    return now() - start;
}

/* The bake of a terrain: all that was built, without pointers. */
static void *bake(const terrimp_terrain *terrain, size_t *bytes)
{
    void *block;
    *bytes = terrimp_bake_bytes(terrain);
    block = malloc(*bytes ? *bytes : 1);
    if (!block || terrimp_bake_write(terrain, block, *bytes, 0) != TERRIMP_OK)
        exit(1);
    return block;
}

static uint16_t *make_hills(uint32_t side)
{
    uint16_t *samples = malloc((size_t)side * side * sizeof *samples);
    uint32_t x, z, k, noise = 1;
    for (z = 0; samples && z < side; z++)
        for (x = 0; x < side; x++) {
            uint32_t height = 0;
            for (k = 4; k < 10; k++) { /* folds of ever larger size */
                uint32_t at = (x * 3u + z * k) % (2u << k);
                height += at < 1u << k ? at : (2u << k) - at;
            }
            noise = noise * 1664525u + 1013904223u;
            samples[(size_t)z * side + x] = (uint16_t)(height * 8u + (noise >> 26));
        }
    return samples;
}

/* Builds with one thread and with several, by turns; keeps the best times. Returns whether all came
   to the same bytes, or -1 without memory. */
static int race(const terrimp_terrain_desc *desc, int threads, double seconds[2])
{
    void *memory = malloc(terrimp_terrain_bytes(desc)), *first = NULL;
    int same = 1, turn;
    if (!memory)
        return -1;
    for (turn = 0; turn < 2 * TURNS; turn++) {
        terrimp_terrain *terrain;
        double taken = build(desc, memory, turn % 2 ? threads : 1, &terrain);
        size_t bytes;
        void *block = bake(terrain, &bytes);
        if (turn < 2 || taken < seconds[turn % 2])
            seconds[turn % 2] = taken;
        if (turn == 0) {
            first = block;
        } else {
            same = same && memcmp(first, block, bytes) == 0;
            free(block);
        }
    }
    free(first);
    free(memory);
    return same;
}

int main(int argc, char **argv)
{
    int threads = argc > 1 ? atoi(argv[1]) : 2, same;
    uint32_t side = argc > 2 ? (uint32_t)atoi(argv[2]) : 1025u;
    uint16_t *samples;
    terrimp_terrain_desc desc;
    double seconds[2] = {0, 0};
    if (threads < 1 || threads > MOST_THREADS || side < 2 || side > 16385)
        return fprintf(stderr, "parallel_build [THREADS [SIDE]]\n"), 2;
    samples = make_hills(side);
    if (!samples)
        return 1;
    memset(&desc, 0, sizeof desc);
    desc.chunk_quads = 64;
    desc.field.width = desc.field.depth = side;
    desc.field.format = TERRIMP_FORMAT_U16;
    desc.field.samples = samples;
    same = race(&desc, threads, seconds);
    free(samples);
    if (same < 0)
        return 1;
    printf("%u x %u samples: 1 thread %.2f s, %d threads %.2f s, %.2f times as fast; %s\n",
           (unsigned)side, (unsigned)side, seconds[0], threads, seconds[1],
           seconds[0] / seconds[1], same ? "the same bytes" : "OTHER BYTES");
    return !same;
}
