/* A bake made on one machine and opened on another. "make FILE" builds a terrain and writes its
   bake, and to FILE.swapped the one for the other byte order; "open FILE..." opens each, or the
   swapped one, checks what it says against the samples, draws frames of it, and damages it to see
   it refused. Prints how many were used as they are and how many swapped. */
#include <stdio.h>

#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#define WIDTH 71
#define DEPTH 46
#define CAPACITY (1u << 20)

static uint16_t samples[DEPTH][WIDTH];
static uint64_t block[CAPACITY / 8]; /* 8: as bakes are aligned */

static terrimp_heightfield make_field(void)
{
    terrimp_heightfield field;
    uint32_t x, z;
    for (z = 0; z < DEPTH; z++)
        for (x = 0; x < WIDTH; x++)
            samples[z][x] = (uint16_t)(x * (WIDTH - x) * 9u + z * z * 7u +
                                       (x * z * 2654435761u >> 23));
    memset(&field, 0, sizeof field);
    field.samples = samples;
    field.width = WIDTH;
    field.depth = DEPTH;
    field.format = TERRIMP_FORMAT_U16;
    field.spacing_x = field.spacing_z = 10.0f;
    field.height_scale = 0.02f;
    field.height_offset = -40.0f;
    return field;
}

/* ---- make ---- */

static int write_bake(const terrimp_terrain *terrain, const char *name, int swapped)
{
    size_t bytes = terrimp_bake_bytes(terrain);
    FILE *file;
    return terrimp_bake_write(terrain, block, sizeof block, swapped) == TERRIMP_OK &&
           (file = fopen(name, "wb")) != NULL &&
           (fwrite(block, 1, bytes, file) == bytes) + (fclose(file) == 0) == 2;
}

static const char *name_of_swapped(const char *name)
{
    static char swapped[1024];
    sprintf(swapped, "%.1000s.swapped", name);
    return swapped;
}

static int make(const char *name)
{
    terrimp_terrain_desc desc;
    terrimp_terrain *terrain;
    int written;
    memset(&desc, 0, sizeof desc);
    desc.field = make_field();
    desc.chunk_quads = 8;
    if (terrimp_terrain_create(&desc, NULL, &terrain) != TERRIMP_OK)
        return 0;
    written = write_bake(terrain, name, 0) && write_bake(terrain, name_of_swapped(name), 1);
    terrimp_terrain_destroy(terrain);
    return written;
}

/* ---- open ---- */

static void on_capture(void *user, const terrimp_capture_command *command)
{
    (void)user, (void)command;
}

static void on_impostor(void *user, const terrimp_impostor_command *command)
{
    (void)command;
    ++*(uint32_t *)user;
}

static void on_ground(void *user, const terrimp_ground_command *command)
{
    (void)command;
    ++*(uint32_t *)user;
}

/* The boxes of the terrain's chunks hold the samples that lie in them. */
static int boxes_hold(const terrimp_terrain *terrain, const terrimp_heightfield *field)
{
    terrimp_terrain_info info;
    terrimp_box box;
    uint32_t x, z;
    if (terrimp_terrain_get_info(terrain, &info) != TERRIMP_OK)
        return 0;
    for (z = 0; z < DEPTH; z++)
        for (x = 0; x < WIDTH; x++) {
            uint32_t chunk_x = x / 8 < info.chunks_x ? x / 8 : info.chunks_x - 1;
            uint32_t chunk_z = z / 8 < info.chunks_z ? z / 8 : info.chunks_z - 1;
            float y = field->height_offset + field->height_scale * (float)samples[z][x];
            if (terrimp_terrain_get_box(terrain, chunk_z * info.chunks_x + chunk_x, &box) !=
                    TERRIMP_OK || !(y >= box.min[1] - 0.01f && y <= box.max[1] + 0.01f))
                return 0;
        }
    return 1;
}

/* Every frame shows something. */
static int draws(terrimp_terrain *terrain)
{
    terrimp_view_desc desc;
    terrimp_camera camera;
    terrimp_callbacks callbacks;
    terrimp_view *view;
    uint32_t frame, drawn = 1;
    memset(&desc, 0, sizeof desc);
    memset(&camera, 0, sizeof camera);
    memset(&callbacks, 0, sizeof callbacks);
    desc.atlas_size = 512;
    callbacks.user = &drawn;
    callbacks.begin_capture = callbacks.end_capture = on_capture;
    callbacks.draw_impostor = on_impostor;
    callbacks.draw_ground = on_ground;
    camera.eye[0] = 20.0f, camera.eye[1] = 300.0f, camera.eye[2] = 20.0f;
    camera.forward[0] = 1.0f, camera.forward[1] = -0.6f, camera.forward[2] = 0.7f;
    camera.width_px = 640, camera.height_px = 480;
    camera.z_near = 1.0f, camera.z_far = 3000.0f;
    if (terrimp_view_create(terrain, &desc, NULL, &view) != TERRIMP_OK)
        return 0;
    for (frame = 0; frame < 16 && drawn > 0; frame++, camera.eye[0] += 10.0f) {
        drawn = 0;
        if (terrimp_view_update(view, &camera) != TERRIMP_OK ||
            terrimp_view_render(view, &callbacks) != TERRIMP_OK)
            drawn = 0;
    }
    terrimp_view_destroy(view);
    return drawn > 0;
}

/* A byte changed anywhere is noticed; what was damaged is mended again. */
static int damage_is_refused(unsigned char *bytes, size_t count)
{
    size_t i;
    for (i = 0; i < count; i += 1 + count / 200) {
        terrimp_result result;
        bytes[i] ^= 0x10;
        result = terrimp_bake_check(block, count, NULL, NULL);
        bytes[i] ^= 0x10;
        if (result != TERRIMP_E_BAKE)
            return 0;
    }
    return terrimp_bake_check(block, count - 1, NULL, NULL) == TERRIMP_E_BAKE;
}

/* Reads a file into the block; returns its bytes, 0 for none. */
static size_t read_bake(const char *name)
{
    FILE *file = fopen(name, "rb");
    size_t bytes = file ? fread(block, 1, sizeof block, file) : 0;
    return file && fclose(file) == 0 ? bytes : 0;
}

/* 0, or what failed: 1 the file, 2 the bake. */
static int open_bake(const char *name, int *swapped)
{
    static uint64_t memory[4096 / 8];
    const terrimp_heightfield field = make_field();
    terrimp_terrain *terrain;
    terrimp_result result;
    size_t bytes = read_bake(name);
    if (bytes == 0)
        return 1;
    result = terrimp_terrain_open(&field, block, bytes, memory, sizeof memory, &terrain);
    *swapped = result == TERRIMP_E_ORDER;
    if (*swapped) {
        bytes = read_bake(name_of_swapped(name));
        result = terrimp_terrain_open(&field, block, bytes, memory, sizeof memory, &terrain);
    }
    if (result != TERRIMP_OK || terrimp_bake_check(block, bytes, &field, NULL) != TERRIMP_OK ||
        !boxes_hold(terrain, &field) || !draws(terrain) ||
        !damage_is_refused((unsigned char *)block, bytes))
        return 2;
    return 0;
}

int main(int argc, char **argv)
{
    int i, swapped, as_they_are = 0, others = 0;
    if (argc == 3 && strcmp(argv[1], "make") == 0)
        return make(argv[2]) ? 0 : 1;
    for (i = 2; i < argc; i++) {
        int failure = open_bake(argv[i], &swapped);
        if (failure) {
            printf("%s: %s\n", argv[i], failure == 1 ? "cannot be read" : "is no good here");
            return failure;
        }
        others += swapped;
        as_they_are += !swapped;
    }
    printf("     %d used as they are, %d swapped\n", as_they_are, others);
    return argc > 2 ? 0 : 1;
}
