/* Threads: nodes and blocks of pages are built by several at once, and one terrain is drawn by
   several views at once.
   Meant for ThreadSanitizer, which tells of races that do not show in the results.
   Build: cc -std=c99 -g -O1 -fsanitize=thread -I. tests/threads.c -lm -lpthread */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "check.h"
#include <pthread.h>

enum { THREADS = 3, SIDE = 113, FRAMES = 25 };

static uint16_t samples[SIDE * SIDE];

static terrimp_terrain_desc describe(void)
{
    terrimp_terrain_desc desc;
    uint32_t i, steep = random_range(200, 400);
    float rough = random_float(100.0f, 200.0f);
    for (i = 0; i < SIDE * SIDE; i++)
        samples[i] = (uint16_t)((i % SIDE) * (i / SIDE) * steep / 1000u +
                                (uint32_t)random_float(0.0f, rough));
    memset(&desc, 0, sizeof desc);
    desc.field.samples = samples;
    desc.field.width = desc.field.depth = SIDE;
    desc.field.format = TERRIMP_FORMAT_U16;
    desc.field.height_scale = 0.01f;
    desc.chunk_quads = 16;
    return desc;
}

/* ---- building ---- */

typedef struct part {
    pthread_t thread;
    terrimp_terrain *terrain;
    size_t scratch_bytes;
    uint32_t first, end; /* nodes, every THREADS-th one */
    int failed;
} part;

static void *build_part(void *user)
{
    part *p = (part *)user;
    void *scratch = malloc(p->scratch_bytes);
    uint32_t node;
    for (node = p->first; node < p->end; node += THREADS)
        if (terrimp_terrain_build_node(p->terrain, node, scratch, p->scratch_bytes) != TERRIMP_OK)
            p->failed = 1;
    free(scratch);
    return NULL;
}

static void build_in_threads(const terrimp_terrain_desc *desc, terrimp_terrain *terrain)
{
    part parts[THREADS];
    terrimp_quadtree tree;
    uint32_t i;
    CHECK(terrimp_quadtree_init(&desc->field, desc->chunk_quads, &tree) == TERRIMP_OK);
    CHECK(terrimp_terrain_build_begin(terrain) == TERRIMP_OK);
    for (i = 0; i < THREADS; i++) {
        parts[i].terrain = terrain;
        parts[i].scratch_bytes = terrimp_terrain_scratch_bytes(desc);
        parts[i].first = i;
        parts[i].end = tree.node_count;
        parts[i].failed = 0;
        CHECK(pthread_create(&parts[i].thread, NULL, build_part, &parts[i]) == 0);
    }
    for (i = 0; i < THREADS; i++) {
        CHECK(pthread_join(parts[i].thread, NULL) == 0);
        CHECK(!parts[i].failed);
    }
    CHECK(terrimp_terrain_build_finish(terrain) == TERRIMP_OK);
}

static void *bake_of(const terrimp_terrain *terrain, size_t *bytes)
{
    void *block;
    *bytes = terrimp_bake_bytes(terrain);
    block = malloc(*bytes);
    CHECK(terrimp_bake_write(terrain, block, *bytes, 0) == TERRIMP_OK);
    return block;
}

static void nodes_built_at_once_are_those_built_in_turn(void)
{
    terrimp_terrain_desc desc = describe();
    terrimp_terrain *alone, *together;
    size_t bytes = terrimp_terrain_bytes(&desc), counts[2];
    void *memory = malloc(bytes), *blocks[2];
    CHECK(terrimp_terrain_create(&desc, NULL, &alone) == TERRIMP_OK);
    CHECK(terrimp_terrain_init(&desc, memory, bytes, &together) == TERRIMP_OK);
    build_in_threads(&desc, together);
    blocks[0] = bake_of(alone, &counts[0]);
    blocks[1] = bake_of(together, &counts[1]);
    CHECK(counts[0] == counts[1] && memcmp(blocks[0], blocks[1], counts[0]) == 0);
    free(blocks[0]);
    free(blocks[1]);
    free(memory);
    terrimp_terrain_destroy(alone);
}

/* ---- building pages ---- */

enum { FILE_BYTES = 1 << 20 };

typedef struct pages_part {
    pthread_t thread;
    terrimp_pages_desc desc;
    uint32_t first, end; /* blocks, every step-th one */
    uint32_t step;
    int failed;
} pages_part;

static int read_samples(void *user, uint32_t x, uint32_t z, uint32_t cols, uint32_t rows, void *out,
                        size_t row_bytes)
{
    uint32_t j;
    (void)user;
    for (j = 0; j < rows; j++)
        memcpy((char *)out + j * row_bytes, samples + (z + j) * SIDE + x, cols * sizeof *samples);
    return 1;
}

static int load(void *user, uint64_t offset, void *bytes, size_t count)
{
    memcpy(bytes, (const char *)user + offset, count);
    return offset + count <= FILE_BYTES;
}

static int store(void *user, uint64_t offset, const void *bytes, size_t count)
{
    memcpy((char *)user + offset, bytes, count);
    return offset + count <= FILE_BYTES;
}

static void *build_blocks(void *user)
{
    pages_part *p = (pages_part *)user;
    size_t bytes = terrimp_pages_scratch_bytes(&p->desc);
    void *scratch = malloc(bytes);
    uint32_t block;
    for (block = p->first; block < p->end; block += p->step)
        p->failed |= terrimp_pages_build_block(&p->desc, block, scratch, bytes) != TERRIMP_OK;
    free(scratch);
    return NULL;
}

static void blocks_built_at_once_are_those_built_in_turn(void)
{
    pages_part parts[THREADS + 1]; /* the last one builds alone */
    char *files[2];
    uint32_t i;
    memset(parts, 0, sizeof parts);
    files[0] = (char *)calloc(1, FILE_BYTES);
    files[1] = (char *)calloc(1, FILE_BYTES);
    parts[0].desc.terrain = describe();
    parts[0].desc.terrain.height_high = 1000.0f;
    parts[0].desc.block_level = 1;
    parts[0].desc.read = read_samples;
    parts[0].desc.load = load;
    parts[0].desc.store = store;
    for (i = 0; i <= THREADS; i++) {
        parts[i] = parts[0];
        parts[i].desc.user = files[i == THREADS];
        parts[i].first = i % THREADS;
        parts[i].step = i < THREADS ? THREADS : 1u;
        CHECK(terrimp_pages_desc_resolve(&parts[i].desc, &parts[i].desc, &parts[i].end) ==
              TERRIMP_OK);
    }
    for (i = 0; i < THREADS; i++)
        CHECK(pthread_create(&parts[i].thread, NULL, build_blocks, &parts[i]) == 0);
    for (i = 0; i < THREADS; i++)
        CHECK(pthread_join(parts[i].thread, NULL) == 0 && !parts[i].failed);
    build_blocks(&parts[THREADS]);
    CHECK(!parts[THREADS].failed && parts[THREADS].end > 3u * THREADS);
    CHECK(memcmp(files[0], files[1], FILE_BYTES) == 0);
    free(files[0]);
    free(files[1]);
}

/* ---- drawing ---- */

typedef struct flight {
    pthread_t thread;
    const terrimp_terrain *terrain;
    float shift;   /* where it begins */
    uint32_t hash; /* of its commands */
    int failed;
} flight;

static uint32_t add(uint32_t hash, uint32_t word)
{
    return (hash ^ word) * 16777619u;
}

static void on_capture(void *user, const terrimp_capture_command *c)
{
    flight *f = (flight *)user;
    f->hash = add(add(add(f->hash, c->node), c->slot.x), c->slot.width);
}

static void on_ground(void *user, const terrimp_ground_command *c)
{
    flight *f = (flight *)user;
    f->hash = add(add(f->hash, c->node), c->first_index);
}

static void on_impostor(void *user, const terrimp_impostor_command *c)
{
    flight *f = (flight *)user;
    f->hash = add(add(f->hash, c->node), c->base_vertex);
}

static void *fly(void *user)
{
    flight *f = (flight *)user;
    terrimp_view_desc desc;
    terrimp_view *view;
    terrimp_camera camera;
    terrimp_callbacks callbacks;
    int frame;
    memset(&desc, 0, sizeof desc);
    memset(&camera, 0, sizeof camera);
    memset(&callbacks, 0, sizeof callbacks);
    desc.max_impostors = 64;
    callbacks.user = f;
    callbacks.begin_capture = callbacks.end_capture = on_capture;
    callbacks.draw_ground = on_ground;
    callbacks.draw_impostor = on_impostor;
    camera.forward[0] = camera.forward[2] = 1.0f;
    camera.forward[1] = -0.3f;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.z_near = 1.0f;
    camera.z_far = 1000.0f;
    f->hash = 2166136261u;
    f->failed = terrimp_view_create(f->terrain, &desc, NULL, &view) != TERRIMP_OK;
    for (frame = 0; frame < FRAMES && !f->failed; frame++) {
        camera.eye[0] = camera.eye[2] = f->shift + (float)frame;
        camera.eye[1] = 40.0f;
        f->failed = terrimp_view_update(view, &camera) != TERRIMP_OK ||
                    terrimp_view_render(view, &callbacks) != TERRIMP_OK;
    }
    if (!f->failed)
        terrimp_view_destroy(view);
    return NULL;
}

static void views_on_several_threads_draw_as_alone(void)
{
    terrimp_terrain_desc desc = describe();
    terrimp_terrain *terrain;
    flight flights[THREADS], alone;
    int i;
    CHECK(terrimp_terrain_create(&desc, NULL, &terrain) == TERRIMP_OK);
    for (i = 0; i < THREADS; i++) {
        flights[i].terrain = terrain;
        flights[i].shift = -20.0f * (float)(i / 2); /* two of them fly the same way */
        CHECK(pthread_create(&flights[i].thread, NULL, fly, &flights[i]) == 0);
    }
    for (i = 0; i < THREADS; i++)
        CHECK(pthread_join(flights[i].thread, NULL) == 0);
    for (i = 0; i < THREADS; i++) {
        alone = flights[i];
        fly(&alone);
        CHECK(!flights[i].failed && !alone.failed && flights[i].hash == alone.hash);
    }
    CHECK(flights[0].hash == flights[1].hash && flights[0].hash != flights[THREADS - 1].hash);
    terrimp_terrain_destroy(terrain);
}

int main(void)
{
    RUN(nodes_built_at_once_are_those_built_in_turn);
    RUN(blocks_built_at_once_are_those_built_in_turn);
    RUN(views_on_several_threads_draw_as_alone);
    return check_report();
}
