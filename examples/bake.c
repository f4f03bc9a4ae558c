/* Shows how to build a terrain once, beforehand: makes a bake of an elevation file, for a disk or
   as C source for read-only memory, and opens it again as a game would.
   Build:  make bake
   Use:    build/bake DEM OUT [--chunk QUADS] [--triangles N] [--scale F] [--c NAME] [--turn]
           --c: OUT is C source, const uint64_t NAME[]; --turn: for the other byte order
   Expect: one line: bytes, nodes, bytes a node, and that it opens. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "host/dem.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct options {
    const char *dem, *out, *name;
    uint32_t chunk, triangles;
    float scale;                  /* of heights, as the game's heightfield has it */
    int turn;
} options;

static int fail(const char *what, const char *why)
{
    fprintf(stderr, "bake: %s: %s\n", what, why);
    return 2;
}

/* A positive number, or 0; for no text too. */
static float number(const char *text)
{
    float value = text ? strtof(text, NULL) : 0.0f;
    return value > 0.0f && value < 1e6f ? value : 0.0f;
}

static int parse(options *o, int argc, char **argv)
{
    int i;
    memset(o, 0, sizeof *o);
    for (i = 1; i < argc; i++) {
        float value = number(argv[i + 1]); /* argv ends in a null */
        if (strcmp(argv[i], "--turn") == 0)
            o->turn = 1;
        else if (strcmp(argv[i], "--c") == 0 && argv[i + 1])
            o->name = argv[++i];
        else if (strcmp(argv[i], "--chunk") == 0 && value >= 1.0f)
            o->chunk = (uint32_t)value, i++;
        else if (strcmp(argv[i], "--triangles") == 0 && value >= 1.0f)
            o->triangles = (uint32_t)value, i++;
        else if (strcmp(argv[i], "--scale") == 0 && value > 0.0f)
            o->scale = value, i++;
        else if (argv[i][0] == '-' || o->out)
            return 0;
        else if (o->dem)
            o->out = argv[i];
        else
            o->dem = argv[i];
    }
    return o->out != NULL;
}

/* As words of the target's byte order, so that the compiler puts back the bytes as they are. */
static void write_source(FILE *file, const char *name, const unsigned char *block, size_t bytes,
                         int big_endian)
{
    size_t i, k;
    fprintf(file, "/* Made by terrimp's bake, for a %s-endian machine. */\n#include <stdint.h>\n\n",
            big_endian ? "big" : "little");
    fprintf(file, "const uint64_t %s[%lu] = {", name, (unsigned long)((bytes + 7) / 8));
    for (i = 0; i < bytes; i += 8) {
        uint64_t word = 0;
        for (k = 0; k < 8; k++)
            if (i + k < bytes)
                word |= (uint64_t)block[i + k] << 8 * (big_endian ? 7 - k : k);
        fprintf(file, "%s0x%08lx%08lxu,", i % 32 ? " " : "\n    ", (unsigned long)(word >> 32),
                (unsigned long)(word & 0xffffffffu));
    }
    fprintf(file, "\n};\n");
}

static int write_out(const options *o, const unsigned char *block, size_t bytes)
{
    const uint16_t one = 1;
    int big_endian = *(const unsigned char *)&one == 0, ok = 1;
    FILE *file = fopen(o->out, "wb");
    if (!file)
        return 0;
    if (o->name)
        write_source(file, o->name, block, bytes, big_endian != o->turn);
    else
        ok = fwrite(block, 1, bytes, file) == bytes;
    return fclose(file) == 0 && ok;
}

static terrimp_result bake(const options *o, const terrimp_heightfield *field,
                           unsigned char **block, size_t *bytes, terrimp_terrain_info *info)
{
    terrimp_terrain_desc desc;
    terrimp_terrain *terrain, *opened;
    terrimp_result result;
    void *memory;
    memset(&desc, 0, sizeof desc);
    desc.field = *field;
    desc.chunk_quads = o->chunk, desc.triangle_budget = o->triangles;
    result = terrimp_terrain_create(&desc, NULL, &terrain);
    if (result != TERRIMP_OK)
        return result;
    *bytes = terrimp_bake_bytes(terrain);
    memory = malloc(terrimp_terrain_open_bytes());
    *block = malloc(*bytes ? *bytes : 1);
    result = *block && memory ? terrimp_bake_write(terrain, *block, *bytes, 0) : TERRIMP_E_MEMORY;
    if (result == TERRIMP_OK) /* what a game does, when it starts */
        result = terrimp_terrain_open(field, *block, *bytes, memory, terrimp_terrain_open_bytes(),
                                      &opened);
    if (result == TERRIMP_OK)
        result = terrimp_terrain_get_info(opened, info);
    if (result == TERRIMP_OK && o->turn)
        result = terrimp_bake_write(terrain, *block, *bytes, 1);
    terrimp_terrain_destroy(terrain);
    free(memory);
    return result;
}

int main(int argc, char **argv)
{
    const dem_desc whole = {0};
    const char *trouble = NULL;
    unsigned char *block = NULL;
    terrimp_heightfield field;
    terrimp_terrain_info info;
    terrimp_result result;
    size_t bytes = 0;
    options o;
    dem d;
    if (!parse(&o, argc, argv))
        return fail("use", "bake DEM OUT [--chunk N] [--triangles N] [--scale F] [--c NAME]");
    if (!dem_load(&d, o.dem, &whole))
        return fail("not read", d.error);
    dem_fill_voids(&d, &trouble);
    field = dem_heightfield(&d);
    field.has_no_data = 0; /* they are filled */
    field.height_scale = o.scale;
    result = trouble ? TERRIMP_E_VOID : bake(&o, &field, &block, &bytes, &info);
    dem_free(&d);
    if (result != TERRIMP_OK)
        return fail(o.dem, terrimp_result_text(result));
    if (!write_out(&o, block, bytes))
        return fail(o.out, "cannot be written");
    printf("%s: %lu bytes, %u nodes, %.1f bytes a node; it opens\n", o.out, (unsigned long)bytes,
           (unsigned)info.node_count, (double)bytes / info.node_count);
    free(block);
    return 0;
}
