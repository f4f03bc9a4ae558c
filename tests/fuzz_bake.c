/* Fuzzes bakes: blocks that somebody may have made to do harm are checked, opened,
   filled into buffers and flown over. The first byte chooses what is done; behind it stands a
   block, or, for a terrain to be baked here first, what it is built of and which of the bake's
   bytes are changed; behind that the flight. A wrong checksum would hide all that is checked behind
   it: half of the blocks get it mended. See tests/fuzz.h and tests/fuzz_frames.h. */
#define TERRIMP_ASSERT(condition) FUZZ_CHECK(condition)
#include "fuzz.h"

#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "fuzz_frames.h"

#define SIDE 24 /* largest terrain that is baked here, in samples */
#define GREATEST_FIELD ((size_t)1 << 20) /* bytes of samples to go with a block */

enum { MEND = 1, BUILD = 2, SWAP = 4, OTHER_FIELD = 8, LONGER = 16 }; /* bits of the first byte */

/* The only place that looks behind the public functions. */
static void mend_checksum(unsigned char *block, size_t bytes)
{
    terrimpi_bake bake;
    terrimp_terrain t;
    if (bytes < sizeof bake)
        return;
    memcpy(&bake, block, sizeof bake);
    if (bake.magic != TERRIMPI_BAKE_MAGIC ||
        !terrimpi_bake_header(&bake, TERRIMP_BAKE_VERSION, &t) ||
        !terrimpi_bake_bytes_fit(&bake, bytes, &t))
        return;
    bake.checksum = terrimpi_bake_hash(block);
    memcpy(block, &bake, sizeof bake);
}

/* ---- blocks ---- */

/* The input up to where the block says that it ends, or all of it. */
static unsigned char *read_block(size_t *bytes, uint32_t choices)
{
    unsigned char *block;
    terrimpi_bake bake;
    *bytes = fuzz_left;
    if (fuzz_left >= sizeof bake && !(choices & LONGER)) {
        memcpy(&bake, fuzz_bytes, sizeof bake);
        if (bake.magic == TERRIMPI_BAKE_MAGIC && bake.bytes < fuzz_left)
            *bytes = bake.bytes;
    }
    block = (unsigned char *)fuzz_take(*bytes);
    if (*bytes > 0)
        memcpy(block, fuzz_bytes, *bytes);
    fuzz_bytes += *bytes;
    fuzz_left -= *bytes;
    return block;
}

/* A bake of a small terrain; NULL when there is none. */
static unsigned char *build_block(size_t *bytes)
{
    static uint16_t samples[SIDE * SIDE];
    terrimp_terrain_desc desc;
    terrimp_terrain *terrain = NULL;
    unsigned char *block = NULL;
    uint32_t i, step = fuzz_u8(), rough = fuzz_u8();
    for (i = 0; i < SIDE * SIDE; i++)
        samples[i] = (uint16_t)(i % SIDE * step + (i * 2654435761u >> 20) * rough / 16u);
    memset(&desc, 0, sizeof desc);
    desc.field.samples = samples;
    desc.field.format = 1 + (int)fuzz_below(3);
    desc.field.width = 2u + fuzz_below(SIDE - 1);
    desc.field.depth = 2u + fuzz_below(SIDE - 1);
    desc.field.height_scale = fuzz_u8() & 7u ? 0.05f : fuzz_float(1.0f);
    desc.chunk_quads = 4u + 2u * fuzz_below(5);
    desc.triangle_budget = 32u + fuzz_below(100);
    desc.not_proud = fuzz_u8() == 1;
    desc.no_lower_skirts = fuzz_u8() == 1;
    if (terrimp_terrain_create(&desc, NULL, &terrain) == TERRIMP_OK) {
        *bytes = terrimp_bake_bytes(terrain);
        block = (unsigned char *)fuzz_take(*bytes);
        FUZZ_CHECK(terrimp_bake_write(terrain, block, *bytes, 0) == TERRIMP_OK);
        FUZZ_CHECK(terrimp_bake_check(block, *bytes, &desc.field, NULL) == TERRIMP_OK);
        terrimp_terrain_destroy(terrain);
    }
    return block;
}

/* Changes up to seven bytes: half of them of the header and the first nodes. */
static void damage(unsigned char *block, size_t bytes)
{
    uint32_t left = fuzz_below(8);
    for (; left > 0; left--) {
        size_t at = (fuzz_u8() | fuzz_u8() << 8) % (left & 1u ? bytes : 160u);
        block[at < bytes ? at : bytes - 1u] = (unsigned char)fuzz_u8();
    }
}

/* ---- what is done with them ---- */

/* The field that a block says it was made of, its samples up to the last byte; in the heap. */
static int make_field(const terrimp_bake_info *bake, terrimp_heightfield *field)
{
    static const size_t size_of[] = { 4, 1, 2, 2, 4 };
    size_t count = (size_t)bake->width * bake->depth, size = size_of[bake->format], i;
    unsigned char *samples;
    if (count > GREATEST_FIELD / size)
        return 0;
    samples = (unsigned char *)fuzz_take(count * size);
    for (i = 0; i < count * size; i++)
        samples[i] = bake->format == TERRIMP_FORMAT_F32 ? 0 : (unsigned char)(i * 2654435761u >> 9);
    memset(field, 0, sizeof *field);
    field->samples = samples;
    field->width = bake->width;
    field->depth = bake->depth;
    field->format = bake->format;
    field->height_scale = bake->height_scale;
    field->height_offset = bake->height_offset;
    return 1;
}

/* Whatever passes the check can be drawn without harm. */
static void use_terrain(terrimp_terrain *terrain)
{
    terrimp_rect rect;
    memset(&rect, 0, sizeof rect);
    rect.width = rect.height = 1;
    FUZZ_CHECK(terrimp_terrain_rebuild(terrain, &rect, &rect, 0) != TERRIMP_OK);
    FUZZ_CHECK(terrimp_terrain_get_info(terrain, &info) == TERRIMP_OK);
    if (info.mesh_vertex_count > 1u << 20 || info.ground_vertex_count > 1u << 20)
        return;
    pull_buffers(terrain);
    fly(terrain, NULL);
    release_buffers();
}

static void open_block(const unsigned char *block, size_t bytes, uint32_t choices)
{
    terrimp_bake_info bake;
    terrimp_heightfield field;
    terrimp_terrain *terrain = NULL;
    size_t needed = terrimp_terrain_open_bytes();
    void *memory;
    if (terrimp_bake_check(block, bytes, NULL, &bake) != TERRIMP_OK || !make_field(&bake, &field))
        return;
    FUZZ_CHECK(bake.bytes <= bytes);
    memory = fuzz_take(needed);
    (void)terrimp_bake_check(block, bytes, &field, &bake);
    if (choices & OTHER_FIELD) {
        field.width--;
        FUZZ_CHECK(terrimp_terrain_open(&field, block, bytes, memory, needed, &terrain)
                   != TERRIMP_OK);
    } else {
        FUZZ_CHECK(terrimp_terrain_open(&field, block, bytes, memory, needed - 1u, &terrain)
                   == TERRIMP_E_MEMORY);
        FUZZ_CHECK(terrimp_terrain_open(&field, block, bytes, memory, needed, &terrain)
                   == TERRIMP_OK);
        use_terrain(terrain);
    }
    free(memory);
    free((void *)(uintptr_t)field.samples);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    unsigned char *block, *before;
    uint32_t choices;
    size_t length = 0, at, k;
    fuzz_bytes = bytes;
    fuzz_left = size;
    choices = fuzz_u8();
    block = choices & BUILD ? build_block(&length) : read_block(&length, choices);
    if (block == NULL)
        return 0;
    if (choices & BUILD)
        damage(block, length);
    if (choices & MEND)
        mend_checksum(block, length);
    if (choices & SWAP)
        for (at = 0; at + 4u <= length; at += 4u) {
            unsigned char word[4];
            memcpy(word, block + at, 4);
            for (k = 0; k < 4u; k++)
                block[at + k] = word[3u - k];
        }
    before = (unsigned char *)fuzz_take(length);
    memcpy(before, block, length);
    open_block(block, length, choices);
    FUZZ_CHECK(memcmp(before, block, length) == 0); /* nothing writes into it */
    free(before);
    free(block);
    return 0;
}
