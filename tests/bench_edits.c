/* Edits at the pace of play: craters of 16 x 16 samples in square terrains, all within a terrain's
   own range of heights. Time of the processor for taking note of one, for the chunks under it as
   they are refined, and for all that is left, up to the root.

   Build:  make bench_edits
   Use:    build/bench_edits [SIDE...]     [1025 2049 4097]
   Leaves: build/bench/edits.md (what it prints), edits.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_say.h"

#include "examples/host/procedural.h"

enum { CRATERS = 64, CRATER = 16 };

/* A bowl that is deepest in its middle. */
static void dig(uint16_t *samples, uint32_t side, const terrimp_rect *at)
{
    uint32_t x, z;
    for (z = 0; z < CRATER; z++)
        for (x = 0; x < CRATER; x++) {
            uint16_t *sample = samples + (size_t)(at->y + z) * side + at->x + x;
            float u = ((float)x - 7.5f) / 8.0f, v = ((float)z - 7.5f) / 8.0f;
            float depth = 1.0f - u * u - v * v;
            if (depth > 0.0f)
                *sample = (uint16_t)((float)*sample * (1.0f - 0.5f * depth));
        }
}

static void bench_side(uint32_t side)
{
    uint16_t *samples = procedural_terrain(side, side, 1);
    terrimp_terrain_desc desc = { 0 };
    terrimp_terrain *t;
    terrimp_rect at = { 0, 0, CRATER, CRATER };
    double edit = 0.0, worst = 0.0, chunks = 0.0, rest, start;
    uint32_t i, done, chunk_count = 0, rest_count = 0, random = 1;
    size_t scratch_bytes;
    void *scratch;
    if (!samples)
        bench_stop("terrain", "there is no memory");
    desc.field.samples = samples;
    desc.field.format = TERRIMP_FORMAT_U16;
    desc.field.width = desc.field.depth = side;
    desc.field.height_scale = PROCEDURAL_HEIGHT_SCALE;
    desc.height_high = 65535.0f * PROCEDURAL_HEIGHT_SCALE;
    need(terrimp_terrain_create(&desc, NULL, &t));
    scratch_bytes = terrimp_terrain_scratch_bytes(&desc);
    scratch = need_memory(scratch_bytes);
    for (i = 0; i < CRATERS; i++) {
        uint32_t node;
        random = random * 1664525u + 1013904223u;
        at.x = (random >> 8) % (side - CRATER);
        random = random * 1664525u + 1013904223u;
        at.y = (random >> 8) % (side - CRATER);
        dig(samples, side, &at);
        start = clock_cpu_ms();
        need(terrimp_terrain_edit(t, &at));
        start = clock_cpu_ms() - start;
        edit += start;
        worst = start > worst ? start : worst;
        for (;;) { /* the finest come first */
            start = clock_cpu_ms();
            need(terrimp_terrain_refine(t, &node, 1, &done, scratch, scratch_bytes));
            if (done == 0 || node >= t->tree.level_first[1])
                break;
            chunks += clock_cpu_ms() - start;
            chunk_count++;
        }
    }
    start = clock_cpu_ms();
    do {
        need(terrimp_terrain_refine(t, NULL, 64, &done, scratch, scratch_bytes));
        rest_count += done;
    } while (done > 0);
    rest = clock_cpu_ms() - start;
    say("| %u | %.2f | %.2f | %.2f | %u | %.0f |\n", (unsigned)side, edit / CRATERS, worst,
        chunk_count ? chunks / chunk_count : 0.0, (unsigned)rest_count, rest);
    terrimp_terrain_destroy(t);
    free(scratch);
    free(samples);
}

int main(int argc, char **argv)
{
    static const uint32_t sides[] = { 1025, 2049, 4097 };
    int i;
    say_open("edits", 1);
    say_machine(NULL);
    say("\n%d craters of %d x %d samples [ms]\n\n", CRATERS, CRATER, CRATER);
    say("| samples a side | an edit | the dearest | a chunk refined | nodes left | all of them |\n"
        "|--:|--:|--:|--:|--:|--:|\n");
    for (i = 1; i < argc; i++)
        bench_side((uint32_t)strtoul(argv[i], NULL, 10));
    for (i = 0; argc < 2 && i < 3; i++)
        bench_side(sides[i]);
    say_close();
    return 0;
}
