/* Fuzzes a whole terrain: descriptors of any kind, blocks of memory of exactly the bytes asked for,
   then frames from cameras anywhere, and edits of samples. Public functions only. See tests/fuzz.h
   and tests/fuzz_frames.h. */
#define TERRIMP_ASSERT(condition) FUZZ_CHECK(condition)
#include "fuzz.h"

#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "fuzz_frames.h"

#define SIDE 48 /* largest terrain, in samples */

static uint16_t samples[SIDE * SIDE];
static terrimp_heightfield field; /* of the built terrain, resolved */
static void *scratch;
static size_t scratch_bytes;

static void describe_terrain(terrimp_terrain_desc *desc)
{
    uint32_t i, step = fuzz_u8(), rough = fuzz_u8();
    memset(desc, 0, sizeof *desc);
    for (i = 0; i < SIDE * SIDE; i++)
        samples[i] = (uint16_t)(i % SIDE * step + (i * 2654435761u >> 20) * rough / 16u);
    desc->field.samples = samples;
    desc->field.format = 1 + (int)fuzz_below(3);
    desc->field.width = fuzz_u8() & 15u ? 2u + fuzz_below(SIDE - 1) : fuzz_below(2);
    desc->field.depth = fuzz_u8() & 15u ? 2u + fuzz_below(SIDE - 1) : fuzz_below(2);
    desc->field.has_no_data = fuzz_u8() == 1;
    desc->field.height_scale = fuzz_u8() & 7u ? fuzz_good(0.001f, 0.1f) : fuzz_float(1.0f);
    desc->field.height_offset = fuzz_u8() & 7u ? 0.0f : fuzz_float(1e4f);
    desc->field.spacing_x = fuzz_u8() & 7u ? fuzz_good(0.1f, 9.0f) : fuzz_float(1.0f);
    desc->field.spacing_z = fuzz_u8() & 7u ? fuzz_good(0.1f, 9.0f) : fuzz_float(1.0f);
    desc->field.origin_x = fuzz_u8() & 7u ? 0.0f : fuzz_float(1e5f);
    desc->field.origin_z = fuzz_u8() & 7u ? 0.0f : fuzz_float(1e5f);
    desc->chunk_quads = fuzz_u8() & 15u ? 4u + 2u * fuzz_below(9) : fuzz_size(200);
    desc->triangle_budget = fuzz_u8() & 15u ? 32u + fuzz_below(100) : fuzz_size(600);
    desc->proud = fuzz_u8() & 7u ? 0.0f : fuzz_float(1.0f);
    desc->not_proud = (int)(fuzz_u8() & 1u);
    desc->no_lower_skirts = fuzz_u8() == 1;
    if (fuzz_u8() == 1) { /* a range that edits keep to, or not */
        desc->height_low = fuzz_good(-7000.0f, 0.0f);
        desc->height_high = fuzz_good(0.0f, 7000.0f);
    }
}

/* Changes samples; those that may not be are put back, and nothing has changed then. */
static void edit(terrimp_terrain *terrain, const terrimp_rect *rect)
{
    static const uint32_t size_of[] = { 4, 1, 2, 2, 4 };
    static uint16_t before[SIDE * SIDE];
    uint32_t size = size_of[field.format], step = fuzz_u8(), x, z, i;
    memcpy(before, samples, sizeof samples);
    for (z = rect->y; z < field.depth && z - rect->y < rect->height; z++)
        for (x = rect->x; x < field.width && x - rect->x < rect->width; x++)
            for (i = 0; i < size; i++) {
                unsigned char *byte = (unsigned char *)samples + (z * field.width + x) * size + i;
                *byte = (unsigned char)(*byte + step * (x + i));
            }
    if (terrimp_terrain_rebuild(terrain, rect, scratch, scratch_bytes) != TERRIMP_OK) {
        memcpy(samples, before, sizeof samples);
        return;
    }
    FUZZ_CHECK(terrimp_terrain_get_info(terrain, &info) == TERRIMP_OK);
    release_buffers();
    pull_buffers(terrain);
}

static void build(const terrimp_terrain_desc *desc, size_t bytes)
{
    void *memory = fuzz_take(bytes);
    terrimp_terrain *terrain = NULL;
    scratch_bytes = terrimp_terrain_scratch_bytes(desc);
    scratch = fuzz_take(scratch_bytes);
    field = desc->field;
    FUZZ_CHECK(terrimp_terrain_init(desc, memory, bytes - 1u, &terrain) == TERRIMP_E_MEMORY);
    FUZZ_CHECK(terrimp_terrain_init(desc, memory, bytes, &terrain) == TERRIMP_OK);
    if (terrimp_terrain_build(terrain, scratch, scratch_bytes) == TERRIMP_OK) {
        FUZZ_CHECK(terrimp_terrain_get_info(terrain, &info) == TERRIMP_OK);
        pull_buffers(terrain);
        fly(terrain, edit);
        release_buffers();
    }
    free(scratch);
    free(memory);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    terrimp_terrain_desc desc, resolved;
    size_t need;
    fuzz_bytes = bytes;
    fuzz_left = size;
    describe_terrain(&desc);
    need = terrimp_terrain_bytes(&desc);
    FUZZ_CHECK((terrimp_terrain_desc_resolve(&desc, &resolved) == TERRIMP_OK) == (need > 0));
    if (need > 0 && need <= GREATEST_BLOCK)
        build(&desc, need);
    return 0;
}
