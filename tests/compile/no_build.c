/* Without building, and without malloc: the simplifier and all that builds is gone; a terrain comes
   from a bake, and is drawn. */
#define TERRIMP_NO_BUILD
#define TERRIMP_NO_MALLOC
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bake_maker.h"
#include "use.h"

static double block[1 << 12], memory[1 << 8];

/* What has been left out is refused, all else is not. */
static int refuses_what_is_left_out(const terrimp_terrain *terrain)
{
    terrimp_result morph = TERRIMP_OK;
    terrimp_view_desc desc, out;
#ifdef TERRIMP_NO_MORPH
    morph = TERRIMP_E_RANGE;
#endif
    memset(&desc, 0, sizeof desc);
    desc.ground_rule = TERRIMP_GEOMIP_DISTANCE;
    if (terrimp_view_desc_resolve(terrain, &desc, &out) != TERRIMP_OK)
        return 0;
    desc.morph_ratio = 1.5f;
    return terrimp_view_desc_resolve(terrain, &desc, &out) == morph;
}

int main(void)
{
    static uint8_t heights[19 * 11];
    terrimp_heightfield field;
    terrimp_terrain *terrain;
    terrimp_terrain_info info;
    size_t bytes, i;
    for (i = 0; i < sizeof heights; i++)
        heights[i] = (uint8_t)(i * 37u % 101u);
    memset(&field, 0, sizeof field);
    field.samples = heights;
    field.width = 19;
    field.depth = 11;
    field.format = TERRIMP_FORMAT_U8;
    bytes = make_bake(&field, block, sizeof block);
    if (bytes == 0 || terrimp_terrain_open_bytes() > sizeof memory)
        return 1;
    if (terrimp_terrain_open(&field, block, bytes, memory, sizeof memory, &terrain))
        return 2;
    if (terrimp_terrain_get_info(terrain, &info) || info.chunks_x != 5 || info.chunks_z != 3)
        return 3;
    if (!refuses_what_is_left_out(terrain))
        return 4;
    return use_terrimp();
}
