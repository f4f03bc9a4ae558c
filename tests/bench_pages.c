/* Terrain in pages: what building costs against building in memory, what a frame does, and how much
   memory a flight over 16385 and 65537 samples a side takes, under a limit that ends the process.
   The large terrains repeat one block of 1024 x 1024 samples, so that the file needs no 13 GB: what
   is read is that block's pages with the node's number put in. A FILE of examples/pages.c is flown
   over as it is.
   Build:  make bench_pages
   Use:    build/bench_pages [SIDE | FILE], or build/bench_pages SIDE pictures [geomip]
   Expect: lines for tests/results/pages.md. */
#define _XOPEN_SOURCE 700
#define _DEFAULT_SOURCE
#define TERRIMP_IMPLEMENTATION
#include "bench_pages_draw.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { DELAY = 7, AT_ONCE = 256 }; /* frames that a slow read takes, and how many are under way */
enum { BLOCK = 1024, BLOCK_LEVEL = 4, BLOCK_PAGES = 341, FRAMES = 400 };

typedef struct world {
    terrimp_pages_desc desc;
    FILE *file;           /* header, upper pages, the pages of one block */
    uint64_t block_at;    /* where blocks begin in the whole file, and that one in ours */
    uint64_t block_bytes;
    uint32_t across;      /* blocks */
    uint32_t first[BLOCK_LEVEL + 1]; /* number of a level's first node */
    int16_t *samples;     /* [BLOCK][BLOCK] */
} world;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static float grain(uint32_t x, uint32_t z)
{
    uint32_t h = x * 374761393u + z * 668265263u;
    h = (h ^ (h >> 13)) * 1274126177u;
    return (float)((h ^ (h >> 16)) >> 8) * (1.0f / 16777216.0f);
}

/* Hills of all sizes that repeat after BLOCK samples. */
static void make_samples(world *w)
{
    uint32_t x, z, shift;
    w->samples = malloc(BLOCK * BLOCK * sizeof *w->samples);
    for (z = 0; z < BLOCK; z++)
        for (x = 0; x < BLOCK; x++) {
            float height = 0.0f, size = 12.0f;
            for (shift = 2; shift < 9u; shift++, size *= 2.0f) {
                uint32_t cells = (BLOCK >> shift) - 1u, i = x >> shift, j = z >> shift;
                float u = (float)(x & ((1u << shift) - 1u)) / (float)(1u << shift);
                float v = (float)(z & ((1u << shift) - 1u)) / (float)(1u << shift);
                float a = grain(i, j), b = grain((i + 1u) & cells, j);
                float c = grain(i, (j + 1u) & cells), d = grain((i + 1u) & cells, (j + 1u) & cells);
                u = u * u * (3.0f - 2.0f * u);
                v = v * v * (3.0f - 2.0f * v);
                a += (b - a) * u;
                c += (d - c) * u;
                height += size * (a + (c - a) * v);
            }
            w->samples[z * BLOCK + x] = (int16_t)height;
        }
}

static int read_samples(void *user, uint32_t x, uint32_t z, uint32_t cols, uint32_t rows,
                        void *samples, size_t row_bytes)
{
    const world *w = user;
    uint32_t i, j;
    for (j = 0; j < rows; j++) {
        int16_t *row = (int16_t *)(void *)((char *)samples + j * row_bytes);
        for (i = 0; i < cols; i++)
            row[i] = w->samples[(z + j) % BLOCK * BLOCK + (x + i) % BLOCK];
    }
    return 1;
}

static int move(world *w, uint64_t offset, void *to, const void *from, size_t count)
{
    return fseek(w->file, (long)offset, SEEK_SET) == 0 &&
           (to ? fread(to, 1, count, w->file) : fwrite(from, 1, count, w->file)) == count;
}

static int store(void *user, uint64_t offset, const void *bytes, size_t count)
{
    world *w = user;
    if (offset >= w->block_at)
        offset = w->block_at + (offset - w->block_at) % w->block_bytes;
    return move(w, offset, NULL, bytes, count);
}

/* Reads the page of a node, from the one block that there is. */
static int load_node(world *w, uint64_t offset, uint32_t node, void *bytes, size_t count)
{
    uint32_t hash = 2166136261u, *words = bytes, i;
    if (offset < w->block_at)
        return move(w, offset, bytes, NULL, count);
    if (!move(w, w->block_at + (offset - w->block_at) % w->block_bytes, bytes, NULL, count))
        return 0;
    words[2] = node;
    for (i = 1; i < count / 4u; i++)
        hash = (hash ^ words[i]) * 16777619u;
    words[0] = hash;
    return 1;
}

/* The node is told by the place of its page: block, level and the bits of column and row. */
static int load(void *user, uint64_t offset, void *bytes, size_t count)
{
    world *w = user;
    uint64_t from = offset < w->block_at ? 0 : offset - w->block_at;
    uint32_t block = (uint32_t)(from / w->block_bytes), x = block % w->across;
    uint32_t z = block / w->across, up = 0, bit;
    uint32_t at = (uint32_t)(from % w->block_bytes / (w->block_bytes / BLOCK_PAGES));
    for (; at >= 1u << 2u * up; up++)
        at -= 1u << 2u * up;
    for (bit = up; bit-- > 0;) {
        x = 2u * x + (at >> 2u * bit & 1u);
        z = 2u * z + (at >> (2u * bit + 1u) & 1u);
    }
    return load_node(w, offset, w->first[BLOCK_LEVEL - up] + z * (w->across << up) + x, bytes,
                     count);
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static terrimp_camera camera_of(const terrimp_pages_info *info)
{
    terrimp_camera c;
    memset(&c, 0, sizeof c);
    c.eye[0] = 0.3f * 30.0f * (float)info->width;
    c.eye[1] = 4000.0f;
    c.eye[2] = 0.5f * 30.0f * (float)info->depth;
    c.forward[0] = 1.0f;
    c.forward[1] = -0.2f;
    c.forward[2] = 0.3f;
    c.width_px = 1280;
    c.height_px = 1024;
    c.z_near = 10.0f;
    c.z_far = 4e6f;
    return c;
}

static void capture(void *user, const terrimp_capture_command *c) { (void)user, (void)c; }
static void ground(void *user, const terrimp_ground_command *c) { (void)user, (void)c; }
static void impostor(void *user, const terrimp_impostor_command *c) { (void)user, (void)c; }

/* Draws nothing. */
static void render(terrimp_view *view)
{
    terrimp_callbacks draw;
    memset(&draw, 0, sizeof draw);
    draw.begin_capture = draw.end_capture = capture;
    draw.draw_ground = ground;
    draw.draw_impostor = impostor;
    terrimp_view_render(view, &draw);
}

/* Flies; reads at once what is wanted. */
static int fly(world *w, const unsigned char *header, const terrimp_pages_info *info,
               uint32_t slots, float speed, size_t limit)
{
    struct rlimit most;
    terrimp_heightfield field;
    terrimp_terrain *terrain;
    terrimp_view *view;
    terrimp_view_desc settings;
    terrimp_camera camera = camera_of(info);
    terrimp_stats stats;
    struct rusage usage;
    size_t bytes = terrimp_pages_bytes(header, TERRIMP_PAGES_HEADER_BYTES, slots);
    void *memory;
    unsigned char *seen;
    uint32_t frame, reads = 0, once = 0, late = 0, i, cruise = 0;
    most.rlim_cur = most.rlim_max = limit;
    setrlimit(RLIMIT_AS, &most);
    memory = malloc(bytes);
    seen = calloc(1, info->node_count / 8u + 1u);
    memset(&field, 0, sizeof field);
    memset(&settings, 0, sizeof settings);
    field.spacing_x = field.spacing_z = 30.0f;
    if (!memory || !seen || terrimp_pages_open(&field, header, TERRIMP_PAGES_HEADER_BYTES, slots,
                                               memory, bytes, &terrain) != TERRIMP_OK ||
        terrimp_view_create(terrain, &settings, NULL, &view) != TERRIMP_OK) {
        printf("| %u | not enough memory |\n", (unsigned)info->width);
        return 1;
    }
    for (frame = 0; frame < FRAMES; frame++) {
        terrimp_want wants[256];
        uint32_t count;
        terrimp_result result;
        camera.eye[0] += speed;
        terrimp_pages_next_frame(terrain);
        result = terrimp_view_update(view, &camera);
        terrimp_pages_wants(terrain, wants, 256, &count);
        for (i = 0; i < count; i++) {
            terrimp_page_info page;
            void *to;
            terrimp_page_get_info(terrain, wants[i].node, &page);
            if (terrimp_page_begin(terrain, wants[i].node, &to) != TERRIMP_OK)
                continue;
            if (!load_node(w, page.offset, wants[i].node, to, page.bytes) ||
                terrimp_page_put(terrain, wants[i].node) != TERRIMP_OK)
                return 1;
            reads++;
            cruise += frame >= FRAMES / 2u;
            once += !(seen[wants[i].node / 8u] >> wants[i].node % 8u & 1u);
            seen[wants[i].node / 8u] |= (unsigned char)(1u << wants[i].node % 8u);
        }
        if (result == TERRIMP_OK) {
            render(view);
            terrimp_view_get_stats(view, &stats);
            late += stats.late > 0;
        }
    }
    getrusage(RUSAGE_SELF, &usage);
    printf("| %u | %.0f | %u | %.1f | %.1f | %.3f | %u of %u | %.2f |\n", (unsigned)info->width,
           (double)speed, (unsigned)slots, (double)limit / 1048576.0,
           (double)usage.ru_maxrss / 1024.0, (double)reads / (double)(once ? once : 1u),
           (unsigned)late, FRAMES,
           (double)cruise * (double)info->page_bytes * 1e-6 * 60.0 / (FRAMES / 2.0));
    return 0;
}

/* A terrain of a side, its pages but for all blocks but one. */
static int make_world(world *w, uint32_t side)
{
    size_t bytes;
    void *scratch;
    uint32_t blocks, level;
    uint64_t none;
    terrimp_result result;
    memset(w, 0, sizeof *w);
    make_samples(w);
    w->file = tmpfile();
    w->desc.terrain.field.width = w->desc.terrain.field.depth = side;
    w->desc.terrain.field.format = TERRIMP_FORMAT_S16;
    w->desc.terrain.height_high = 3000.0f;
    w->desc.block_level = BLOCK_LEVEL;
    w->desc.user = w;
    w->desc.read = read_samples;
    w->desc.load = load;
    w->desc.store = store;
    if (terrimp_pages_desc_resolve(&w->desc, &w->desc, &blocks) != TERRIMP_OK ||
        terrimp_pages_place(&w->desc, 0, 1, &w->block_at, &w->block_bytes) != TERRIMP_OK ||
        terrimp_pages_place(&w->desc, 0, 0, &w->block_at, &none) != TERRIMP_OK)
        return 0;
    w->across = (side - 1u) / BLOCK;
    for (level = 0; level < BLOCK_LEVEL; level++)
        w->first[level + 1u] = w->first[level] +
                               (w->across << (BLOCK_LEVEL - level)) *
                                   (w->across << (BLOCK_LEVEL - level));
    bytes = terrimp_pages_scratch_bytes(&w->desc);
    scratch = malloc(bytes);
    result = terrimp_pages_build_block(&w->desc, w->across > 1u ? w->across + 1u : 0u, scratch,
                                       bytes);
    if (result == TERRIMP_OK)
        result = terrimp_pages_build_end(&w->desc, scratch, bytes);
    free(scratch);
    free(w->samples);
    return result == TERRIMP_OK;
}

static void bench_flights(uint32_t side, const char *path)
{
    world w;
    unsigned char header[TERRIMP_PAGES_HEADER_BYTES];
    terrimp_pages_info info;
    int turn;
    memset(&w, 0, sizeof w);
    w.file = path ? fopen(path, "rb") : NULL;
    w.block_at = UINT64_MAX;
    if (!(path ? w.file != NULL : make_world(&w, side)) ||
        !move(&w, 0, header, NULL, sizeof header) ||
        terrimp_pages_check(header, sizeof header, &info) != TERRIMP_OK) {
        printf("| %u | could not be made |\n", (unsigned)side);
        return;
    }
    for (turn = 0; turn < 3; turn++) {
        fflush(stdout);
        fflush(w.file);
        if (fork() == 0) {
            static const float speeds[] = {10.0f, 100.0f, 300.0f};
            int bad = fly(&w, header, &info, 900, speeds[turn],
                          (info.width > 20000u ? 96u : 64u) * (size_t)1048576u);
            fflush(stdout);
            _exit(bad);
        }
        wait(NULL);
    }
    fclose(w.file);
}

/* Whole, in memory and in pages: what building costs, and what an update does. */
static void bench_whole(void)
{
    enum { SIDE = 1025 };
    world w;
    terrimp_terrain *in_memory, *paged;
    terrimp_view *views[2];
    terrimp_view_desc settings;
    terrimp_terrain_desc desc;
    terrimp_pages_info info;
    terrimp_camera camera;
    unsigned char header[TERRIMP_PAGES_HEADER_BYTES];
    int16_t *samples = malloc(SIDE * SIDE * sizeof *samples);
    double start = now(), times[2][FRAMES], built[2];
    uint32_t node, frame, i;
    size_t bytes;
    void *memory;
    if (!make_world(&w, SIDE)) /* one block */
        return;
    built[1] = now() - start;
    start = now();
    make_samples(&w);
    built[1] -= now() - start; /* it has made them, too */
    read_samples(&w, 0, 0, SIDE, SIDE, samples, SIDE * sizeof *samples);
    desc = w.desc.terrain;
    desc.field.samples = samples;
    desc.field.row_bytes = 0;
    desc.field.spacing_x = desc.field.spacing_z = 30.0f;
    start = now();
    if (terrimp_terrain_create(&desc, NULL, &in_memory) != TERRIMP_OK)
        return;
    built[0] = now() - start;
    move(&w, 0, header, NULL, sizeof header);
    terrimp_pages_check(header, sizeof header, &info);
    bytes = terrimp_pages_bytes(header, sizeof header, info.node_count);
    memory = malloc(bytes);
    if (terrimp_pages_open(&desc.field, header, sizeof header, info.node_count, memory, bytes,
                           &paged) != TERRIMP_OK)
        return;
    for (node = info.node_count; node-- > 0;) {
        terrimp_page_info page;
        void *to;
        terrimp_page_get_info(paged, node, &page);
        if (terrimp_page_begin(paged, node, &to) != TERRIMP_OK ||
            !load_node(&w, page.offset, node, to, page.bytes) ||
            terrimp_page_put(paged, node) != TERRIMP_OK)
            return;
    }
    memset(&settings, 0, sizeof settings);
    for (i = 0; i < 2u; i++)
        if (terrimp_view_create(i ? paged : in_memory, &settings, NULL, &views[i]) != TERRIMP_OK)
            return;
    camera = camera_of(&info);
    for (frame = 0; frame < FRAMES; frame++) {
        camera.eye[0] += 10.0f;
        for (node = 0; node < 2u; node++) {
            i = (node + frame) % 2u; /* neither always comes to a warm cache */
            start = now();
            if (i == 1u)
                terrimp_pages_next_frame(paged);
            terrimp_view_update(views[i], &camera);
            render(views[i]);
            times[i][frame] = now() - start;
        }
    }
    for (i = 0; i < 2u; i++)
        qsort(times[i], FRAMES, sizeof times[i][0], compare);
    printf("%u x %u: pages built in %.2f times the time in memory (%u nodes); the median update "
           "and render take %.2f times as long with all pages here (%.1f us)\n", SIDE, SIDE,
           built[1] / built[0], (unsigned)info.node_count,
           times[1][FRAMES / 2] / times[0][FRAMES / 2], times[1][FRAMES / 2] * 1e6);
}

/* ---- pictures ---- */

/* Light from the north-west on the terrain, repeated over a texture. */
static raster_texture make_colour(const world *w, uint32_t side)
{
    enum { SIDE = 1 << LOG2_COLOUR };
    uint32_t step = (side - 1u) / SIDE ? (side - 1u) / SIDE : 1u, x, z;
    uint8_t *rgb = malloc(3u * SIDE * SIDE);
    raster_texture colour;
    for (z = 0; z < SIDE; z++)
        for (x = 0; x < SIDE; x++) {
            uint32_t i = x * step % BLOCK, j = z * step % BLOCK;
            float here = w->samples[j * BLOCK + i];
            float right = w->samples[j * BLOCK + (i + step) % BLOCK] - here;
            float down = w->samples[(j + step) % BLOCK * BLOCK + i] - here;
            float light = 0.6f + 0.4f * (right + down) / (1.0f + fabsf(right) + fabsf(down));
            uint8_t *to = rgb + 3u * (z * SIDE + x);
            to[0] = (uint8_t)(light * (90.0f + 0.12f * here));
            to[1] = (uint8_t)(light * (140.0f + 0.05f * here));
            to[2] = (uint8_t)(light * 70.0f);
        }
    raster_make_texture(&colour, malloc(sizeof(uint16_t) * SIDE * SIDE / 3u * 4u + 64u), rgb,
                        LOG2_COLOUR);
    free(rgb);
    return colour;
}

/* A terrain in pages with the reads that are under way. */
typedef struct stream {
    world *w;
    terrimp_terrain *terrain;
    painter *p;
    uint32_t nodes[AT_ONCE], due[AT_ONCE], count, reads, once;
    void *to[AT_ONCE];
    unsigned char *seen;
    double sum, worst, alike_sum;
    uint32_t holes, frames;
    uint32_t alike; /* frames with as much ground and as many impostors as memory's */
} stream;

static int stream_open(stream *s, world *w, const unsigned char *header, uint32_t slots,
                       int mode, const raster_texture *colour)
{
    size_t bytes = terrimp_pages_bytes(header, TERRIMP_PAGES_HEADER_BYTES, slots);
    terrimp_heightfield field;
    memset(s, 0, sizeof *s);
    memset(&field, 0, sizeof field);
    field.spacing_x = field.spacing_z = 30.0f;
    s->w = w;
    s->worst = 99.0;
    if (terrimp_pages_open(&field, header, TERRIMP_PAGES_HEADER_BYTES, slots, malloc(bytes), bytes,
                           &s->terrain) != TERRIMP_OK)
        return 0;
    s->seen = calloc(1, terrimp_terrain_tree(s->terrain)->node_count);
    s->p = painter_open(s->terrain, mode, 0.0f,
                        30.0f * (float)(w->desc.terrain.field.width - 1u), colour);
    return s->p != NULL;
}

/* Forgets a read: it has come, or is not wanted any more. */
static void stream_end(stream *s, uint32_t i)
{
    for (s->count--; i < s->count; i++) { /* parents stay before their children */
        s->nodes[i] = s->nodes[i + 1u];
        s->due[i] = s->due[i + 1u];
        s->to[i] = s->to[i + 1u];
    }
}

/* A frame: takes what is due, draws, gives up what is not wanted, begins the rest. What is read at
   once is there for the next frame. */
static terrimp_result stream_frame(stream *s, const terrimp_camera *camera, uint32_t frame,
                                   uint32_t delay)
{
    terrimp_want wants[AT_ONCE];
    terrimp_page_info page;
    terrimp_result result;
    uint32_t gone[AT_ONCE], count, i, k;
    for (i = 0; i < s->count;) {
        if (s->due[i] > frame) {
            i++;
            continue;
        }
        terrimp_page_get_info(s->terrain, s->nodes[i], &page);
        if (!load_node(s->w, page.offset, s->nodes[i], s->to[i], page.bytes))
            exit(1);
        result = terrimp_page_put(s->terrain, s->nodes[i]);
        if (result != TERRIMP_OK && result != TERRIMP_E_PAGE)
            exit(1);
        if (result == TERRIMP_OK)
            stream_end(s, i);
        else
            i++; /* its parent's has not come yet */
    }
    terrimp_pages_next_frame(s->terrain);
    result = painter_draw(s->p, *camera);
    terrimp_pages_withdrawn(s->terrain, gone, AT_ONCE, &count);
    for (i = 0; i < count; i++)
        for (k = 0; k < s->count; k++)
            if (s->nodes[k] == gone[i]) {
                terrimp_page_fail(s->terrain, gone[i]);
                stream_end(s, k);
                break;
            }
    terrimp_pages_wants(s->terrain, wants, AT_ONCE, &count);
    for (i = 0; i < count && s->count < AT_ONCE; i++)
        if (terrimp_page_begin(s->terrain, wants[i].node, &s->to[s->count]) == TERRIMP_OK) {
            s->nodes[s->count] = wants[i].node;
            s->due[s->count++] = frame + delay;
            s->reads++;
            s->once += !s->seen[wants[i].node];
            s->seen[wants[i].node] = 1;
        }
    return result;
}

/* Flies and jumps, with all in memory, with pages that are read at once, and from a slow disk. */
static void bench_pictures(uint32_t side, int mode)
{
    enum { LEG = 150, LEGS = 4 };
    world w;
    stream s[2];
    unsigned char header[TERRIMP_PAGES_HEADER_BYTES];
    terrimp_pages_info info;
    terrimp_terrain_desc desc;
    terrimp_terrain *in_memory;
    terrimp_camera camera;
    terrimp_stats stats;
    raster_texture colour;
    painter *memory, *truth;
    uint32_t frame, i, leg, holes = 0, back[LEGS] = {0}, here[LEGS] = {0};
    uint32_t behind = 0; /* frames of flight, when all that a jump needs has come */
    double sum = 0.0, least = 99.0;
    int16_t *samples = malloc((size_t)side * side * sizeof *samples);
    if (!samples || !make_world(&w, side))
        return;
    make_samples(&w);
    colour = make_colour(&w, side);
    read_samples(&w, 0, 0, side, side, samples, side * sizeof *samples);
    desc = w.desc.terrain;
    desc.field.samples = samples;
    desc.field.row_bytes = 0;
    desc.field.spacing_x = desc.field.spacing_z = 30.0f;
    move(&w, 0, header, NULL, sizeof header);
    if (terrimp_pages_check(header, sizeof header, &info) != TERRIMP_OK ||
        terrimp_terrain_create(&desc, NULL, &in_memory) != TERRIMP_OK ||
        !stream_open(&s[0], &w, header, 900, mode, &colour) ||
        !stream_open(&s[1], &w, header, 900, mode, &colour))
        return;
    memory = painter_open(in_memory, mode, 0.0f, 30.0f * (float)(side - 1u), &colour);
    truth = painter_open(in_memory, TERRIMP_MODE_GEOMIP, 0.25f, 30.0f * (float)(side - 1u),
                         &colour);
    camera = camera_of(&info);
    camera.width_px = WIDTH;
    camera.height_px = HEIGHT;
    for (frame = 0; frame < LEG * LEGS; frame++) {
        double own, psnr[2];
        leg = frame / LEG;
        if (frame % LEG == 0 && leg > 0) { /* a jump */
            camera.eye[0] = 30.0f * (float)side * (0.2f + 0.5f * grain(leg, 3));
            camera.eye[2] = 30.0f * (float)side * (0.2f + 0.6f * grain(leg, 5));
        }
        camera.eye[0] += leg % 2u ? 10.0f : 60.0f;
        if (painter_draw(memory, camera) != TERRIMP_OK || painter_draw(truth, camera) != TERRIMP_OK)
            return;
        own = painter_psnr(memory, truth, &holes);
        sum += own;
        least = fmin(least, own);
        terrimp_view_get_stats(memory->view, &stats);
        for (i = 0; i < 2u; i++) {
            terrimp_stats paged;
            psnr[i] = 0.0;
            if (stream_frame(&s[i], &camera, frame, i ? DELAY : 0u) != TERRIMP_OK ||
                terrimp_view_get_stats(s[i].p->view, &paged) != TERRIMP_OK)
                continue; /* nothing is here yet */
            psnr[i] = painter_psnr(s[i].p, truth, &s[i].holes);
            if (i == 1u && psnr[1] < psnr[0] - 0.5) {
                if (here[leg] == 0)
                    back[leg] = frame % LEG + 1u;
                else
                    behind++;
            }
            if (i == 1u && here[leg] == 0 && paged.late == 0)
                here[leg] = frame % LEG + 1u;
            if (i == 0 && frame % LEG < 2u * info.level_count)
                continue; /* a level comes in each frame */
            s[i].sum += own - psnr[i];
            s[i].worst = fmin(s[i].worst, psnr[i]);
            s[i].frames++;
            if (paged.ground == stats.ground && paged.impostors == stats.impostors) {
                s[i].alike_sum += own - psnr[i];
                s[i].alike++;
            }
        }
    }
    printf("%u x %u, %u frames of %d x %d with %d jumps, PSNR against ground at 0.25 px: in memory "
           "%.2f dB (worst %.2f), %u pixels of sky that is not\n", (unsigned)side, (unsigned)side,
           LEG * LEGS, WIDTH, HEIGHT, LEGS - 1, sum / (LEG * LEGS), least, (unsigned)holes);
    for (i = 0; i < 2u; i++)
        printf("%s: %.3f dB less in the mean of %u frames, %.3f in the %u that draw as much ground "
               "and as many impostors, worst %.2f dB, %u pixels of sky, %u reads, %.3f over "
               "pages\n", i ? "117 ms a read, 256 under way" : "read at once",
               s[i].sum / s[i].frames, (unsigned)s[i].frames, s[i].alike_sum / s[i].alike,
               (unsigned)s[i].alike, s[i].worst, (unsigned)s[i].holes,
               (unsigned)s[i].reads, (double)s[i].reads / s[i].once);
    printf("of each start and jump, frames until no page is missing:");
    for (leg = 0; leg < LEGS; leg++)
        printf(" %u", (unsigned)here[leg]);
    printf("; and until then the last one that is 0.5 dB behind what is read at once:");
    for (leg = 0; leg < LEGS; leg++)
        printf(" %u", (unsigned)back[leg]);
    printf("; %u frames of flight after that are as far behind\n", (unsigned)behind);
    painter_close(memory), painter_close(truth), painter_close(s[0].p), painter_close(s[1].p);
    terrimp_terrain_destroy(in_memory);
    fclose(w.file);
}

int main(int argc, char **argv)
{
    uint32_t side = argc > 1 ? (uint32_t)atoi(argv[1]) : 0u;
    if (argc > 2) {
        bench_pictures(side, argc > 3 ? TERRIMP_MODE_GEOMIP : TERRIMP_MODE_AUTO);
        return 0;
    }
    if (side != 0 || argc < 2)
        bench_whole();
    printf("| side | wu a frame | slots | limit, MiB | resident at most, MiB | reads over pages | "
           "frames that lacked some | MB a second, second half |\n|--:|--:|--:|--:|--:|--:|--:|"
           "--:|\n");
    if (argc > 1 && side == 0) {
        bench_flights(0, argv[1]);
        return 0;
    }
    if (side == 0 || side == 16385u)
        bench_flights(16385, NULL);
    if (side == 0 || side == 65537u)
        bench_flights(65537, NULL);
    return 0;
}
