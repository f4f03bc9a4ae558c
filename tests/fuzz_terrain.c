/* Fuzzes a whole terrain: descriptors of any kind, blocks of memory of exactly the bytes asked for,
   then frames from cameras anywhere, with callbacks that check every command against what
   terrimp_terrain_get_info promises. Public functions only. See tests/fuzz.h. */
#define TERRIMP_ASSERT(condition) FUZZ_CHECK(condition)
#include "fuzz.h"

#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#define SIDE 48 /* largest terrain, in samples */
#define GREATEST_BLOCK ((size_t)1 << 27) /* more memory is not worth a fuzzer's time */

static uint16_t samples[SIDE * SIDE];
static terrimp_terrain_info info;
static terrimp_view_desc settings; /* as resolved */
static float *vertices;            /* of all coarse meshes, as get_info sizes them */
static uint16_t *indices, *patterns;
static int open_capture, impostors, captures;

/* ---- what is checked of a command ---- */

static void begin_capture(void *user, const terrimp_capture_command *c)
{
    FUZZ_CHECK(user == &info && !open_capture && impostors == 0);
    open_capture = 1;
    captures++;
    FUZZ_CHECK(c->node < info.node_count);
    FUZZ_CHECK(c->slot.width > 0 && c->slot.height > 0);
    FUZZ_CHECK(c->slot.x <= settings.atlas_size && c->slot.y <= settings.atlas_size);
    FUZZ_CHECK(c->slot.width <= settings.atlas_size - c->slot.x);
    FUZZ_CHECK(c->slot.height <= settings.atlas_size - c->slot.y);
    FUZZ_CHECK(fuzz_finite(c->view, 16) && fuzz_finite(c->projection, 16));
    FUZZ_CHECK(fuzz_finite(c->eye, 3));
    FUZZ_CHECK(c->clip_min[0] <= c->clip_max[0] && c->clip_min[1] <= c->clip_max[1]);
}

static void end_capture(void *user, const terrimp_capture_command *c)
{
    (void)c;
    FUZZ_CHECK(user == &info && open_capture);
    open_capture = 0;
}

static void draw_ground(void *user, const terrimp_ground_command *c)
{
    FUZZ_CHECK(user == &info && c->node < info.node_count);
    FUZZ_CHECK(c->index_count % 3u == 0 && c->first_index <= info.ground_index_count);
    FUZZ_CHECK(c->index_count <= info.ground_index_count - c->first_index);
    FUZZ_CHECK(fuzz_finite(&c->depth_bias, 1) && c->depth_bias >= 0.0f);
}

/* A range of the coarse meshes' indices, and the vertices that it leads to. */
static void check_mesh_range(uint32_t base, uint32_t first, uint32_t count)
{
    uint32_t i;
    FUZZ_CHECK(count % 3u == 0 && first <= info.mesh_index_count);
    FUZZ_CHECK(count <= info.mesh_index_count - first && base < info.mesh_vertex_count);
    for (i = first; i < first + count; i++)
        FUZZ_CHECK(indices[i] < info.mesh_vertex_count - base);
}

static void draw_impostor(void *user, const terrimp_impostor_command *c)
{
    FUZZ_CHECK(user == &info && !open_capture && c->node < info.node_count);
    impostors++;
    check_mesh_range(c->base_vertex, c->first_index, c->index_count);
    FUZZ_CHECK(fuzz_finite(c->texture_matrix, 16));
    FUZZ_CHECK(fuzz_finite(&c->depth_bias, 1) && c->depth_bias >= 0.0f);
}

static void draw_floor(void *user, const terrimp_floor_command *c)
{
    FUZZ_CHECK(user == &info && !open_capture);
    check_mesh_range(c->base_vertex, c->first_index, c->index_count);
}

/* ---- descriptors ---- */

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
    desc->chunk_quads = fuzz_u8() & 15u ? 2u + fuzz_below(20) : fuzz_size(200);
    desc->triangle_budget = fuzz_u8() & 15u ? 32u + fuzz_below(100) : fuzz_size(600);
    desc->proud = fuzz_u8() & 7u ? 0.0f : fuzz_float(1.0f);
    desc->not_proud = (int)(fuzz_u8() & 1u);
    desc->no_lower_skirts = fuzz_u8() == 1;
    desc->no_upper_skirts = fuzz_u8() == 1;
}

static void describe_view(terrimp_view_desc *desc)
{
    memset(desc, 0, sizeof *desc);
    desc->mode = (int)fuzz_below(TERRIMP_MODE_COUNT + 1);
    desc->fade_start = fuzz_u8() & 3u ? fuzz_good(0.0f, 80.0f) : fuzz_float(100.0f);
    desc->fade_end = fuzz_u8() & 3u ? 0.0f : fuzz_float(200.0f);
    desc->max_angle_rad = fuzz_u8() & 3u ? 0.0f : fuzz_float(1.0f);
    desc->tolerance_px = fuzz_u8() & 3u ? 0.0f : fuzz_float(9.0f);
    desc->texels_per_px = fuzz_u8() & 3u ? 0.0f : fuzz_float(4.0f);
    desc->atlas_size = fuzz_u8() & 3u ? 64u + 4u * fuzz_u8() : fuzz_size(250);
    desc->max_impostors = fuzz_u8() & 3u ? 1u + fuzz_below(60) : fuzz_size(250);
    desc->max_captures = fuzz_below(5);
}

static void aim(terrimp_camera *camera)
{
    int i;
    memset(camera, 0, sizeof *camera);
    for (i = 0; i < 3; i++) {
        camera->eye[i] = fuzz_u8() & 31u ? fuzz_good(-100.0f, 300.0f) : fuzz_float(1e6f);
        camera->forward[i] = fuzz_u8() & 31u ? fuzz_good(-1.0f, 1.0f) : fuzz_float(1.0f);
    }
    if (fuzz_u8() == 1)
        for (i = 0; i < 3; i++)
            camera->up[i] = fuzz_float(1.0f);
    camera->fov_y_rad = fuzz_u8() & 7u ? 0.0f : fuzz_float(3.0f);
    camera->width_px = fuzz_u8() & 31u ? 1280 : fuzz_size(4000);
    camera->height_px = fuzz_u8() & 31u ? 1024 : fuzz_size(4000);
    camera->z_near = fuzz_u8() & 31u ? 1.0f : fuzz_float(1.0f);
    camera->z_far = fuzz_u8() & 31u ? 1e4f : fuzz_float(1e6f);
    camera->depth_zero_to_one = (int)(fuzz_u8() & 1u);
}

/* ---- frames ---- */

static void pull_buffers(const terrimp_terrain *terrain)
{
    size_t floats = 3u * (size_t)info.mesh_vertex_count;
    size_t ground_floats = 3u * (size_t)info.ground_vertex_count;
    float *ground = (float *)fuzz_take(ground_floats * sizeof *ground);
    uint32_t i;
    vertices = (float *)fuzz_take(floats * sizeof *vertices);
    indices = (uint16_t *)fuzz_take(info.mesh_index_count * sizeof *indices);
    patterns = (uint16_t *)fuzz_take(info.ground_index_count * sizeof *patterns);
    FUZZ_CHECK(terrimp_terrain_fill_meshes(terrain, vertices, floats, indices,
                                           info.mesh_index_count) == TERRIMP_OK);
    FUZZ_CHECK(terrimp_terrain_fill_indices(terrain, patterns, info.ground_index_count)
               == TERRIMP_OK);
    for (i = 0; i < info.ground_index_count; i++)
        FUZZ_CHECK(patterns[i] < info.ground_vertex_count);
    FUZZ_CHECK(terrimp_terrain_fill_ground(terrain, fuzz_u8() % (info.chunks_x * info.chunks_z),
                                           ground, ground_floats) == TERRIMP_OK);
    FUZZ_CHECK(fuzz_finite(vertices, floats) && fuzz_finite(ground, ground_floats));
    free(ground);
}

static void draw_frame(terrimp_view *view)
{
    terrimp_callbacks callbacks;
    terrimp_stats stats;
    memset(&callbacks, 0, sizeof callbacks);
    callbacks.user = &info;
    callbacks.begin_capture = begin_capture;
    callbacks.end_capture = end_capture;
    callbacks.draw_impostor = draw_impostor;
    callbacks.draw_ground = draw_ground;
    callbacks.draw_floor = fuzz_u8() & 7u ? draw_floor : NULL;
    open_capture = impostors = captures = 0;
    FUZZ_CHECK(terrimp_view_render(view, &callbacks) == TERRIMP_OK);
    FUZZ_CHECK(!open_capture);
    FUZZ_CHECK(terrimp_view_get_stats(view, &stats) == TERRIMP_OK);
    FUZZ_CHECK(stats.impostors == (uint32_t)impostors && stats.captures == (uint32_t)captures);
    FUZZ_CHECK(fuzz_finite(&stats.z_near, 1) && fuzz_finite(&stats.z_far, 1));
}

static void fly(const terrimp_terrain *terrain)
{
    terrimp_view_desc desc;
    terrimp_view *view = NULL;
    terrimp_camera camera;
    size_t bytes;
    void *memory;
    int frames;
    describe_view(&desc);
    bytes = terrimp_view_bytes(terrain, &desc);
    FUZZ_CHECK((terrimp_view_desc_resolve(terrain, &desc, &settings) == TERRIMP_OK) == (bytes > 0));
    if (bytes == 0 || bytes > GREATEST_BLOCK)
        return;
    memory = fuzz_take(bytes);
    FUZZ_CHECK(terrimp_view_init(terrain, &desc, memory, bytes - 1u, &view) == TERRIMP_E_MEMORY);
    FUZZ_CHECK(terrimp_view_init(terrain, &desc, memory, bytes, &view) == TERRIMP_OK);
    aim(&camera);
    for (frames = 0; frames < 16 && fuzz_left > 0; frames++) {
        uint32_t move = fuzz_u8();
        if (move % 4u == 0) /* a step, or a jump */
            aim(&camera);
        else
            camera.eye[move % 3u] += (float)(move % 16u) - 8.0f;
        if (move == 255)
            FUZZ_CHECK(terrimp_view_invalidate(view) == TERRIMP_OK);
        if (terrimp_view_update(view, &camera) == TERRIMP_OK)
            draw_frame(view);
    }
    free(memory);
}

static void build(const terrimp_terrain_desc *desc, size_t bytes)
{
    size_t scratch_bytes = terrimp_terrain_scratch_bytes(desc);
    void *memory = fuzz_take(bytes), *scratch = fuzz_take(scratch_bytes);
    terrimp_terrain *terrain = NULL;
    FUZZ_CHECK(terrimp_terrain_init(desc, memory, bytes - 1u, &terrain) == TERRIMP_E_MEMORY);
    FUZZ_CHECK(terrimp_terrain_init(desc, memory, bytes, &terrain) == TERRIMP_OK);
    if (terrimp_terrain_build(terrain, scratch, scratch_bytes) == TERRIMP_OK) {
        FUZZ_CHECK(terrimp_terrain_get_info(terrain, &info) == TERRIMP_OK);
        pull_buffers(terrain);
        fly(terrain);
        free(vertices);
        free(indices);
        free(patterns);
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
