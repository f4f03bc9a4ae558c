/* The net under every change that is meant to change nothing: hashes of all that a host gets, for
   fixed flights in all modes over four terrains, compared with those in golden.h. Where a change is
   meant, `make golden` writes that file anew; its diff says what has changed.
   One set of values serves every compiler and option whose arithmetic is that of float alone; where
   it is not, or the functions of libm round otherwise, the test says so and is skipped. */
#ifndef UNIT_GOLDEN_H
#define UNIT_GOLDEN_H

#include <float.h>

#include "unit_terrain.h"

typedef struct golden_value {
    const char *name;
    uint32_t hash;
} golden_value;

static const golden_value golden_values[] = {
#include "golden.h"
    {"the end", 0}
};

static int golden_printing; /* values are printed as golden.h has them, instead of compared */

/* ---- hashes: each step can be undone, so one changed bit always changes the result ---- */

static uint32_t golden_word(uint32_t hash, uint32_t word)
{
    hash = (hash ^ word) * 0x9e3779b1u;
    return hash ^ hash >> 15;
}

/* Floats and integers of 32 bits, as most structs of values consist of. */
static uint32_t golden_words(uint32_t hash, const void *words, size_t bytes)
{
    size_t i;
    for (i = 0; i + 4u <= bytes; i += 4u) {
        uint32_t word;
        memcpy(&word, (const unsigned char *)words + i, 4);
        hash = golden_word(hash, word);
    }
    return hash;
}

static uint32_t golden_shorts(uint32_t hash, const uint16_t *shorts, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++)
        hash = golden_word(hash, shorts[i]);
    return hash;
}

static void golden_check(const char *land_name, const char *part, uint32_t hash)
{
    const golden_value *value = golden_values;
    char name[96];
    sprintf(name, "%s: %s", land_name, part);
    if (golden_printing) {
        printf("    {\"%s\", 0x%08lxu},\n", name, (unsigned long)hash);
        return;
    }
    while (value->hash && strcmp(value->name, name) != 0)
        value++;
    if (value->hash != hash)
        fprintf(stderr, "not as in golden.h: %s\n", name);
    CHECK(value->hash == hash);
}

/* What the values stand on beside the header: how this machine computes. */
static uint32_t golden_arithmetic(void)
{
    volatile float a = 1.00001f, b = -1.00002f;
    float product = a * a + b; /* another one where products are fused with sums */
    uint32_t hash = golden_words((uint32_t)FLT_EVAL_METHOD + 1u, &product, sizeof product);
    int i;
    for (i = 1; i <= 4000; i++) {
        volatile float x = (float)i * (1.0f / 4001.0f);
        float y[5];
        y[0] = sinf(3.0f * x);
        y[1] = cosf(3.0f * x);
        y[2] = tanf(1.5f * x);
        y[3] = asinf(x);
        y[4] = acosf(x);
        hash = golden_words(hash, y, sizeof y);
    }
    return hash;
}

/* ---- the terrains: integer arithmetic, no function of libm ---- */

/* Noise of one lattice, 0..255. */
static int32_t golden_noise(uint32_t x, uint32_t z, uint32_t shift)
{
    int32_t corner[4], step = 1 << shift;
    int32_t fx = (int32_t)x & (step - 1), fz = (int32_t)z & (step - 1);
    uint32_t i;
    for (i = 0; i < 4u; i++) {
        uint32_t at[2];
        at[0] = (x >> shift) + (i & 1u);
        at[1] = (z >> shift) + (i >> 1);
        corner[i] = (int32_t)(golden_words(shift, at, sizeof at) >> 24);
    }
    return ((corner[0] * (step - fx) + corner[1] * fx) * (step - fz) +
            (corner[2] * (step - fx) + corner[3] * fx) * fz) / (step * step);
}

/* 0..4095: ridges and valleys with some roughness, and a plain. */
static int32_t golden_height(uint32_t x, uint32_t z)
{
    int32_t ridge = golden_noise(x, z, 4u) - 128;
    int32_t height = 8 * golden_noise(x, z, 5u) + 10 * (ridge < 0 ? -ridge : ridge) +
                     golden_noise(x, z, 2u) + golden_noise(x, z, 1u) / 4;
    return height < 900 ? 900 : height;
}

static void golden_prepare(land *l, uint32_t width, uint32_t depth, int format, uint32_t chunk)
{
    uint32_t x, z;
    land_prepare(l, width, depth, format, LAND_FLAT);
    l->desc.triangle_budget = 0;
    l->desc.chunk_quads = chunk;
    for (z = 0; z < depth; z++)
        for (x = 0; x < width; x++) {
            size_t at = (size_t)z * width + x;
            int32_t height = golden_height(x, z);
            switch (format) {
            case TERRIMP_FORMAT_U8:
                ((uint8_t *)(void *)l->samples)[at] = (uint8_t)(height / 20);
                break;
            case TERRIMP_FORMAT_U16:
                ((uint16_t *)(void *)l->samples)[at] = (uint16_t)(16 * height);
                break;
            case TERRIMP_FORMAT_S16:
                ((int16_t *)(void *)l->samples)[at] = (int16_t)(16 * height - 30000);
                break;
            default: l->samples[at] = (float)height * (1.0f / 64.0f); break;
            }
        }
    l->desc.field.height_scale = format == TERRIMP_FORMAT_F32  ? 1.0f
                                 : format == TERRIMP_FORMAT_U8 ? 0.3125f
                                                               : 1.0f / 1024.0f;
}

/* ---- what is built ---- */

static uint32_t golden_errors(const land *l)
{
    uint32_t node, hash = 1u;
    for (node = 0; node < l->info.node_count; node++) {
        terrimp_box box;
        terrimp_mesh_info mesh;
        CHECK(terrimp_terrain_get_box(l->terrain, node, &box) == TERRIMP_OK);
        CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
        hash = golden_words(golden_words(hash, &box, sizeof box), &mesh, sizeof mesh);
    }
    return hash;
}

static uint32_t golden_ground(const land *l, int morph)
{
    uint32_t node, hash = 1u, i;
    size_t count = l->info.ground_vertex_count;
    float *xyz = (float *)malloc(3u * count * sizeof(float));
    terrimp_geomip_vertex *vertices = (terrimp_geomip_vertex *)malloc(count * sizeof *vertices);
    for (node = 0; node < l->info.node_count; node++) {
        CHECK(terrimp_terrain_fill_ground(l->terrain, node, xyz, 3u * count) == TERRIMP_OK);
        CHECK(terrimp_terrain_fill_morph(l->terrain, node, vertices, count) == TERRIMP_OK);
        if (!morph)
            hash = golden_words(hash, xyz, 3u * count * sizeof(float));
        for (i = 0; i < count && morph; i++)
            hash = golden_words(hash, &vertices[i], sizeof vertices[i]);
    }
    free(xyz);
    free(vertices);
    return hash;
}

static uint32_t golden_bake(const land *l)
{
    size_t bytes = terrimp_bake_bytes(l->terrain);
    void *block = malloc(bytes);
    uint32_t hash;
    CHECK(bytes > 0 && bytes % 4u == 0);
    CHECK(terrimp_bake_write(l->terrain, block, bytes, 0) == TERRIMP_OK);
    hash = golden_words(1u, block, bytes);
    free(block);
    return hash;
}

/* ---- the flights ---- */

typedef struct golden_flight {
    uint32_t hash;
    uint32_t captures, parts, pieces, ground, faded, morphed, impostors, floors, refused;
} golden_flight;

static void golden_capture(void *user, const terrimp_capture_command *command)
{
    golden_flight *f = (golden_flight *)user;
    f->hash = golden_words(f->hash ^ 1u, command, sizeof *command);
    f->captures++;
    f->parts += command->part > 0;
    f->pieces += !command->clear;
}

static void golden_impostor(void *user, const terrimp_impostor_command *command)
{
    golden_flight *f = (golden_flight *)user;
    f->hash = golden_words(f->hash ^ 2u, command, sizeof *command);
    f->impostors++;
    f->faded += command->alpha < 1.0f;
}

static void golden_draw_ground(void *user, const terrimp_ground_command *command)
{
    golden_flight *f = (golden_flight *)user;
    f->hash = golden_words(f->hash ^ 3u, command, sizeof *command);
    f->ground++;
    f->morphed += command->morph > 0.0f && command->morph < 1.0f;
}

static void golden_floor(void *user, const terrimp_floor_command *command)
{
    golden_flight *f = (golden_flight *)user;
    f->hash = golden_words(f->hash ^ 4u, command, sizeof *command);
    f->floors++;
}

enum { GOLDEN_FRAMES = 90 };

/* Stands still, flies on and turns, sinks, then stands elsewhere and looks back. */
static void golden_pilot(terrimp_camera *camera, const land *l, int frame)
{
    const terrimp_box *box = &l->info.box;
    int turn = (frame * 3) % 256 - 128;
    float part = frame < 6 ? 0.0f : (float)(frame - 6) * (1.0f / 128.0f);
    if (frame >= 70)
        part = 0.25f;
    camera->eye[0] = box->min[0] + (box->max[0] - box->min[0]) * (0.125f + part);
    camera->eye[2] = box->min[2] + (box->max[2] - box->min[2]) * (0.25f + 0.5f * part);
    camera->eye[1] = box->max[1] + 10.0f - (float)frame * 0.25f;
    camera->forward[0] = (float)(128 - (turn < 0 ? -turn : turn));
    camera->forward[2] = (float)(frame >= 70 ? -turn : turn);
    camera->forward[1] = -10.0f - (float)frame;
}

static void golden_settings(terrimp_view_desc *d, int mode, int variant, int kind)
{
    memset(d, 0, sizeof *d);
    d->mode = mode;
    d->ground_tolerance_px = 0.25f; /* and pictures are cheap: AUTO makes many */
    d->costs.capture = 20.0f;
    d->costs.triangle = 4.0f;
    d->costs.ground_px = d->costs.impostor_px = 0.08f;
    d->no_lookahead = kind == 1;
    d->no_spreading = kind == 2;
    d->ground_rule = kind % (int)TERRIMP_GEOMIP_RULE_COUNT;
    d->bound = terrimp_geomip_bound();
    if (variant == 1) {
        d->morph_ratio = 1.5f;
        d->ground_tolerance_px = 4.0f;
        d->atlas_count = 2;
    } else if (variant == 2) {
        d->atlas_size = 128;
        d->atlas_count = 2;
        d->max_impostors = 24;
        d->max_ground = mode == TERRIMP_MODE_GEOMIP || mode == TERRIMP_MODE_AUTO ? 16 : 40;
        d->max_captures = 5;
        d->max_capture_texels = 9000;
        d->max_capture_triangles = 600;
        d->tolerance_px = 2.0f;
    }
}

static void golden_fly(golden_flight *f, const land *l, const terrimp_view_desc *desc)
{
    terrimp_view *view = NULL;
    terrimp_camera camera;
    terrimp_callbacks draw;
    uint32_t hash = f->hash;
    int frame;
    memset(&camera, 0, sizeof camera);
    memset(&draw, 0, sizeof draw);
    camera.width_px = 640;
    camera.height_px = 400;
    camera.z_near = 0.5f;
    camera.z_far = 2000.0f;
    draw.user = f;
    draw.begin_capture = draw.end_capture = golden_capture;
    draw.draw_impostor = golden_impostor;
    draw.draw_ground = golden_draw_ground;
    draw.draw_floor = golden_floor;
    CHECK(terrimp_view_create(l->terrain, desc, NULL, &view) == TERRIMP_OK);
    for (frame = 0; frame < GOLDEN_FRAMES; frame++) {
        terrimp_result result;
        golden_pilot(&camera, l, frame);
        if (frame == 30)
            CHECK(terrimp_view_touch(view, 5, 9, 7, 3) == TERRIMP_OK);
        if (frame == 80)
            CHECK(terrimp_view_invalidate(view) == TERRIMP_OK);
        result = terrimp_view_update(view, &camera);
        f->refused += result != TERRIMP_OK;
        if (frame != 40) /* a frame that is never drawn */
            result = terrimp_view_render(view, &draw);
        f->hash = golden_word(f->hash, (uint32_t)result);
    }
    CHECK(f->hash != hash);
    terrimp_view_destroy(view);
}

/* The hashes of one terrain. What all flights had in them is added up. */
static void golden_land(golden_flight *all, land *l, const char *name, int kind)
{
    static const char *const modes[] = {"", "FULL", "GEOMIP", "IMPOSTOR", "AUTO"};
    static const char *const variants[] = {"", " with morphing", " with little room"};
    int mode, variant;
    if (!land_build(l))
        return;
    golden_check(name, "meshes",
                 golden_shorts(golden_words(1u, l->xyz, l->info.mesh_vertex_count * 3u * 4u),
                               l->indices, l->info.mesh_index_count));
    golden_check(name, "errors and boxes", golden_errors(l));
    golden_check(name, "indices", golden_shorts(1u, l->patterns, l->info.ground_index_count));
    golden_check(name, "ground", golden_ground(l, 0));
    golden_check(name, "morph data", golden_ground(l, 1));
    golden_check(name, "bake", golden_bake(l));
    for (mode = 1; mode < TERRIMP_MODE_COUNT; mode++)
        for (variant = 0; variant < 3; variant++) {
            terrimp_view_desc d;
            char part[64];
            golden_settings(&d, mode, variant, kind);
            all->hash = 1u;
            golden_fly(all, l, &d);
            sprintf(part, "commands of %s%s", modes[mode], variants[variant]);
            golden_check(name, part, all->hash);
        }
}

static void golden_lands(void)
{
    static land l;
    golden_flight all;
    memset(&all, 0, sizeof all);
    golden_prepare(&l, 97, 81, TERRIMP_FORMAT_F32, 8);
    l.desc.triangle_budget = 32;
    golden_land(&all, &l, "97 x 81 of f32 in chunks of 8", 0);
    land_free(&l);

    golden_prepare(&l, 76, 53, TERRIMP_FORMAT_U8, 10); /* no multiples of a chunk */
    l.desc.field.spacing_x = 1.5f;
    l.desc.field.spacing_z = 2.0f;
    l.desc.field.origin_x = -700.0f;
    l.desc.field.origin_z = 90.0f;
    l.desc.field.height_offset = -25.0f;
    l.desc.proud = 0.5f;
    golden_land(&all, &l, "76 x 53 of u8 in chunks of 10", 1);
    land_free(&l);

    golden_prepare(&l, 130, 67, TERRIMP_FORMAT_S16, 16);
    l.desc.height_low = -50.0f;
    l.desc.height_high = 50.0f;
    golden_land(&all, &l, "130 x 67 of s16 in chunks of 16", 2);
    land_free(&l);

    golden_prepare(&l, 33, 61, TERRIMP_FORMAT_U16, 4);
    l.desc.triangle_budget = 40;
    l.desc.not_proud = l.desc.no_lower_skirts = 1;
    golden_land(&all, &l, "33 x 61 of u16 in chunks of 4", 3);
    land_free(&l);

    /* The flights have everything in them that a host may get. */
    CHECK(all.captures > 1000u && all.parts > 10u && all.pieces > 10u && all.refused > 10u);
    CHECK(all.ground > 1000u && all.faded > 100u && all.morphed > 100u);
    CHECK(all.impostors > 1000u && all.floors > 100u);
}

/* ---- the tests ---- */

static void everything_a_host_gets_is_as_in_the_golden_values(void)
{
    if (golden_arithmetic() == golden_values[0].hash)
        golden_lands();
    else
        SKIP("this machine or its libm rounds otherwise than where golden.h was made");
}

/* A hash that misses a bit of a command would be a hole in the net. */
static void no_bit_of_a_command_escapes_the_hash(void)
{
    static const size_t sizes[] = {sizeof(terrimp_capture_command), sizeof(terrimp_ground_command),
                                   sizeof(terrimp_impostor_command), sizeof(terrimp_floor_command)};
    unsigned char bytes[sizeof(terrimp_capture_command) + sizeof(terrimp_impostor_command)];
    size_t i, bit;
    for (i = 0; i < sizeof bytes; i++)
        bytes[i] = (unsigned char)random_bits();
    for (i = 0; i < 4u; i++)
        for (bit = 0; bit < 8u * sizes[i]; bit++) {
            uint32_t hash = golden_words(1u, bytes, sizes[i]);
            bytes[bit / 8u] = (unsigned char)(bytes[bit / 8u] ^ 1u << bit % 8u);
            CHECK(golden_words(1u, bytes, sizes[i]) != hash);
        }
}

static void golden_print(void)
{
    golden_printing = 1;
    printf("    {\"the arithmetic\", 0x%08lxu},\n", (unsigned long)golden_arithmetic());
    golden_lands();
}

static inline void golden_tests(void)
{
    RUN(everything_a_host_gets_is_as_in_the_golden_values);
    RUN(no_bit_of_a_command_escapes_the_hash);
}

#endif
