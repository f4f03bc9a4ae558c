/* Fuzzes terrain in pages: sequences of calls on a terrain with few slots, whose pages come in any
   order, late, not at all, or with bytes that are changed, the checksum made right for half of
   them. Whatever is taken is drawn and filled into buffers; what a frame uses is here, and so are
   its parents, until there is an edit. The header may be changed too. See tests/fuzz.h. */
#define TERRIMP_ASSERT(condition) FUZZ_CHECK(condition)
#include "fuzz.h"

#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

enum { WIDE = 97, DEEP = 81, CHUNK = 8, MOST_BYTES = 1 << 20, BUFFER = 4000 };

static unsigned char file[MOST_BYTES];
static size_t file_bytes;
static uint16_t samples[WIDE * DEEP];
static int edited;

static int read_samples(void *user, uint32_t x, uint32_t z, uint32_t cols, uint32_t rows, void *out,
                        size_t row_bytes)
{
    uint32_t r;
    (void)user;
    for (r = 0; r < rows; r++)
        memcpy((char *)out + r * row_bytes, samples + (z + r) * WIDE + x, cols * 2u);
    return 1;
}

static int load(void *user, uint64_t offset, void *bytes, size_t count)
{
    (void)user;
    memcpy(bytes, file + offset, count);
    return 1;
}

static int store(void *user, uint64_t offset, const void *bytes, size_t count)
{
    (void)user;
    FUZZ_CHECK(offset + count <= MOST_BYTES);
    memcpy(file + offset, bytes, count);
    file_bytes = offset + count > file_bytes ? (size_t)offset + count : file_bytes;
    return 1;
}

/* Once: the pages that all inputs start from. */
static void build(void)
{
    terrimp_pages_desc desc;
    uint32_t i, blocks;
    size_t bytes;
    void *scratch;
    memset(&desc, 0, sizeof desc);
    for (i = 0; i < WIDE * DEEP; i++)
        samples[i] = (uint16_t)((i % WIDE * 7919u + i / WIDE * 104729u) % 97u * 4u + i / 3u);
    desc.terrain.field.width = WIDE;
    desc.terrain.field.depth = DEEP;
    desc.terrain.field.format = TERRIMP_FORMAT_U16;
    desc.terrain.field.height_scale = 0.01f;
    desc.terrain.chunk_quads = CHUNK;
    desc.terrain.height_high = 700.0f;
    desc.block_level = 2;
    desc.read = read_samples;
    desc.load = load;
    desc.store = store;
    FUZZ_CHECK(terrimp_pages_desc_resolve(&desc, &desc, &blocks) == TERRIMP_OK);
    bytes = terrimp_pages_scratch_bytes(&desc);
    scratch = fuzz_take(bytes);
    for (i = 0; i < blocks; i++)
        FUZZ_CHECK(terrimp_pages_build_block(&desc, i, scratch, bytes) == TERRIMP_OK);
    FUZZ_CHECK(terrimp_pages_build_end(&desc, scratch, bytes) == TERRIMP_OK);
    free(scratch);
}

/* Changes some bytes of a block whose checksum is its word `sum`, of the words from `first` on. */
static void damage(unsigned char *bytes, size_t count, size_t sum, size_t first)
{
    uint32_t how = fuzz_u8(), hash = 2166136261u, word, changes = how % 4u;
    size_t at;
    while (changes-- > 0)
        bytes[fuzz_u32() % count] = (unsigned char)fuzz_u8();
    if (!(how & 128u) || how % 4u == 0)
        return;
    for (at = first; at < count / 4u; at++) {
        memcpy(&word, bytes + at * 4u, 4u);
        hash = (hash ^ word) * 16777619u;
    }
    memcpy(bytes + sum * 4u, &hash, 4u);
}

/* ---- what the host would do ---- */

static void ground(void *user, const terrimp_ground_command *c)
{
    static float xyz[129 * 129 * 3];
    const terrimp_terrain *terrain = (const terrimp_terrain *)user;
    terrimp_terrain_info info;
    FUZZ_CHECK(terrimp_terrain_get_info(terrain, &info) == TERRIMP_OK);
    FUZZ_CHECK(terrimp_terrain_fill_ground(terrain, c->node, xyz, sizeof xyz / sizeof *xyz) ==
               TERRIMP_OK);
    FUZZ_CHECK(fuzz_finite(xyz, 3u * info.ground_vertex_count));
}

static void impostor(void *user, const terrimp_impostor_command *c)
{
    static float xyz[BUFFER];
    static uint16_t indices[BUFFER];
    const terrimp_terrain *terrain = (const terrimp_terrain *)user;
    terrimp_mesh_info mesh;
    FUZZ_CHECK(terrimp_terrain_get_mesh(terrain, c->node, &mesh) == TERRIMP_OK);
    FUZZ_CHECK(mesh.base_vertex == c->base_vertex && mesh.index_count == c->index_count);
    FUZZ_CHECK(terrimp_terrain_fill_mesh(terrain, c->node, xyz, BUFFER, indices, BUFFER) ==
               TERRIMP_OK);
}

static void capture(void *user, const terrimp_capture_command *c)
{
    (void)user;
    FUZZ_CHECK(fuzz_finite(c->view, 16) && fuzz_finite(c->projection, 16));
}

static void frame(terrimp_terrain *terrain, terrimp_view *view)
{
    terrimp_callbacks draw;
    terrimp_camera camera;
    terrimp_result result;
    memset(&draw, 0, sizeof draw);
    memset(&camera, 0, sizeof camera);
    draw.user = terrain;
    draw.begin_capture = draw.end_capture = capture;
    draw.draw_ground = ground;
    draw.draw_impostor = impostor;
    camera.eye[0] = fuzz_good(-20.0f, WIDE + 20.0f);
    camera.eye[1] = fuzz_good(0.0f, 150.0f);
    camera.eye[2] = fuzz_good(-20.0f, DEEP + 20.0f);
    camera.forward[0] = fuzz_good(-1.0f, 1.0f);
    camera.forward[1] = -0.3f;
    camera.forward[2] = fuzz_good(-1.0f, 1.0f);
    camera.width_px = camera.height_px = 300;
    camera.z_near = 0.5f;
    camera.z_far = 1e4f;
    result = terrimp_view_update(view, &camera);
    FUZZ_CHECK(result == TERRIMP_OK || result == TERRIMP_E_PAGE || result == TERRIMP_E_CAPACITY);
    if (result == TERRIMP_OK)
        FUZZ_CHECK(terrimp_view_render(view, &draw) == TERRIMP_OK);
}

/* One call; `node` is what the last wants began with. */
static void step(terrimp_terrain *terrain, terrimp_view *view, uint32_t *node)
{
    uint32_t nodes = terrimp_terrain_tree(terrain)->node_count, count, i;
    terrimp_want wants[16];
    terrimp_page_info info, above;
    terrimp_ray_hit hit;
    terrimp_rect edit;
    float from[3], way[3], height;
    void *page;
    switch (fuzz_below(8)) {
    case 0: terrimp_pages_next_frame(terrain); break;
    case 1: frame(terrain, view); break;
    case 2: terrimp_page_fail(terrain, *node); break;
    case 3:
        *node = fuzz_u8() * 7u;
        edit.x = fuzz_below(WIDE), edit.y = fuzz_below(DEEP);
        edit.width = edit.height = 1u + fuzz_below(20);
        edited |= *node % 4u == 0 &&
                  terrimp_pages_renew(terrain, file, file_bytes, &edit) == TERRIMP_OK;
        break;
    case 4:
        for (i = 0; i < 3u; i++)
            from[i] = fuzz_float(100.0f), way[i] = fuzz_float(1.0f);
        terrimp_terrain_raycast(terrain, from, way, fuzz_float(500.0f), &hit, &count);
        terrimp_terrain_height(terrain, from[0], from[2], &height, way, &count);
        break;
    default: /* most of the time pages come */
        FUZZ_CHECK(terrimp_pages_wants(terrain, wants, 16, &count) == TERRIMP_OK);
        for (i = 0; i <= count && i < 16u; i++) {
            *node = i < count ? wants[i].node : *node;
            if (terrimp_page_get_info(terrain, *node, &info) != TERRIMP_OK ||
                info.offset + info.bytes > file_bytes || /* of a header that was changed */
                terrimp_page_begin(terrain, *node, &page) != TERRIMP_OK)
                continue; /* parents are listed before their children */
            memcpy(page, file + info.offset, info.bytes);
            if (fuzz_u8() % 4u == 0)
                damage((unsigned char *)page, info.bytes, 0, 1);
            if (fuzz_u8() % 8u)
                terrimp_page_put(terrain, *node);
        }
        break;
    }
    for (i = 0; i + 1u < nodes && !edited; i++) {
        FUZZ_CHECK(terrimp_page_get_info(terrain, i, &info) == TERRIMP_OK);
        if (info.state != TERRIMP_PAGE_HERE)
            continue;
        terrimp_page_get_info(terrain, terrimpi_tree_parent_number(&terrain->tree, i), &above);
        FUZZ_CHECK(above.state == TERRIMP_PAGE_HERE);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    static unsigned char header[TERRIMP_PAGES_HEADER_BYTES];
    terrimp_view_desc settings;
    terrimp_terrain *terrain = NULL;
    terrimp_view *view = NULL;
    uint32_t slots, node = 0, steps;
    size_t needed;
    void *memory;
    if (file_bytes == 0)
        build();
    fuzz_bytes = bytes;
    fuzz_left = size;
    edited = 0;
    memcpy(header, file, sizeof header);
    if (fuzz_u8() % 8u == 0) /* its checksum is of the words behind it */
        damage(header, sizeof header, 3, 4);
    slots = 8u + fuzz_below(80);
    needed = terrimp_pages_bytes(header, sizeof header, slots);
    if (needed == 0 || needed > (size_t)1 << 24)
        return 0;
    memory = fuzz_take(needed);
    FUZZ_CHECK(terrimp_pages_open(NULL, header, sizeof header, slots, memory, needed, &terrain) ==
               TERRIMP_OK);
    memset(&settings, 0, sizeof settings);
    settings.mode = fuzz_u8() % 2u ? TERRIMP_MODE_GEOMIP : TERRIMP_MODE_AUTO;
    settings.tolerance_px = fuzz_good(0.3f, 8.0f);
    settings.max_impostors = 1u + fuzz_below(200);
    settings.atlas_size = 512;
    if (terrimp_view_create(terrain, &settings, NULL, &view) != TERRIMP_OK) {
        free(memory);
        return 0;
    }
    for (steps = 0; steps < 60u && fuzz_left > 0; steps++)
        step(terrain, view, &node);
    terrimp_view_destroy(view);
    free(memory);
    return 0;
}
