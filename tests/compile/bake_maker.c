/* Builds a small terrain and bakes it: for a program that cannot build. */
#define TERRIMP_STATIC
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bake_maker.h"

size_t make_bake(const terrimp_heightfield *field, void *block, size_t bytes)
{
    static double memory[1 << 13], scratch[1 << 16];
    terrimp_terrain_desc desc;
    terrimp_terrain *terrain;
    memset(&desc, 0, sizeof desc);
    desc.field = *field;
    desc.chunk_quads = 4;
    if (terrimp_terrain_init(&desc, memory, sizeof memory, &terrain) ||
        terrimp_terrain_build(terrain, scratch, sizeof scratch) ||
        terrimp_bake_write(terrain, block, bytes, 0))
        return 0;
    return terrimp_bake_bytes(terrain);
}
