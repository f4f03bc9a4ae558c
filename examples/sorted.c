/* Shows terrain without a depth buffer: 320 x 240 pixels of RGB565, endless, in painter's order,
   with a texture for each page at the level that fits the screen, a constant number of triangles,
   and trees that are drawn in between. Each frame is drawn three times and compared: from back to
   front, from front to back with a bit for each pixel that is covered, and with a depth buffer.
   Build:  make sorted
   Expect: 60 frames in which no pixel differs, and what the three ways cost; the last frame in
           sorted.png. Exit code 1 when a pixel differs. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "host/image.h"
#include "host/raster.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { WIDTH = 320, HEIGHT = 240, FRAMES = 60, SKY = 0xae9d, TRIANGLES = 3000 };
enum { PAGES = 8, QUADS = 64, SIDE = PAGES * QUADS + 1 };             /* samples */
enum { TEXELS = 128, LOG2_TEXELS = 7, LEVELS = 5, MAP = PAGES * TEXELS + 1 };

static uint16_t heights[SIDE * SIDE];
static uint8_t map[MAP * MAP * 3], coarser[MAP * MAP * 3];
static uint16_t texels[LEVELS][PAGES * PAGES * TEXELS * TEXELS]; /* page by page */
enum { BACK_TO_FRONT, COVERED, WITH_DEPTH, WAYS };
static uint16_t screen[WAYS][WIDTH * HEIGHT], depth[WIDTH * HEIGHT];
static uint32_t covered[WIDTH * HEIGHT / 32];
static uint8_t texture_levels[32 * 32], rgb[WIDTH * HEIGHT * 3];
static const uint16_t leaves[1] = { 0x2a45 };

/* ---- A terrain that repeats, and its textures --------------------------- */

static float hashed(uint32_t x, uint32_t z, uint32_t seed)
{
    uint32_t bits = (x * 73856093u ^ z * 19349663u ^ seed * 83492791u) * 2654435761u;
    bits = (bits ^ bits >> 15) * 2246822519u;
    return (float)(bits >> 8) * (1.0f / 16777216.0f);
}

/* Smooth noise on a lattice that repeats with the terrain, x and z in samples. */
static float noise(float x, float z, int cell)
{
    uint32_t n = PAGES * QUADS / (uint32_t)cell, i = (uint32_t)(x / (float)cell);
    uint32_t j = (uint32_t)(z / (float)cell), k = (uint32_t)cell;
    float u = x / (float)cell - (float)i, v = z / (float)cell - (float)j;
    float a = hashed(i % n, j % n, k), b = hashed((i + 1) % n, j % n, k);
    float c = hashed(i % n, (j + 1) % n, k), d = hashed((i + 1) % n, (j + 1) % n, k);
    u = u * u * (3.0f - 2.0f * u), v = v * v * (3.0f - 2.0f * v);
    return (a + (b - a) * u) * (1.0f - v) + (c + (d - c) * u) * v;
}

static float height_of(int x, int z) /* 0..1, places in texels: ridges, rougher the higher */
{
    float u = (float)(x % (MAP - 1)) * 0.5f, v = (float)(z % (MAP - 1)) * 0.5f;
    float sum = 0.0f, part = 0.55f;
    int cell;
    for (cell = 128; cell >= 2; cell /= 2, part *= 0.5f)
        sum += part * (1.0f - fabsf(2.0f * noise(u, v, cell) - 1.0f)) * (0.3f + sum);
    return sum;
}

static void make_terrain(void)
{
    int i;
    for (i = 0; i < SIDE * SIDE; i++)
        heights[i] = (uint16_t)(60000.0f * height_of(i % SIDE * 2, i / SIDE * 2));
}

static void make_map(void)
{
    int x, z, k;
    for (z = 0; z < MAP; z++)
        for (x = 0; x < MAP; x++) {
            static const float grass[3] = { 86, 112, 52 }, rock[3] = { 128, 116, 100 };
            float h = height_of(x, z), slope = h - height_of(x + 1, z + 1);
            float high = fminf(fmaxf(h * 4.0f - 0.9f, 0.0f), 1.0f);
            float light = fminf(fmaxf(0.9f + 35.0f * slope, 0.3f), 1.25f);
            for (k = 0; k < 3; k++) {
                float colour = (grass[k] + (rock[k] - grass[k]) * high) * light;
                map[(z * MAP + x) * 3 + k] = (uint8_t)fminf(h > 0.48f ? 235.0f * light : colour,
                                                             255.0f);
            }
        }
}

/* The whole map is halved, and each level is cut into pages. */
static int cut_pages(void)
{
    int level, page, x, z;
    for (level = 0; level < LEVELS; level++) {
        int side = TEXELS >> level, width = PAGES * side + 1;
        uint16_t *out = texels[level];
        for (page = 0; page < PAGES * PAGES; page++)
            for (z = 0; z < side; z++)
                for (x = 0; x < side; x++) {
                    const uint8_t *p = map + ((page / PAGES * side + z) * width +
                                              page % PAGES * side + x) * 3;
                    *out++ = (uint16_t)(p[0] >> 3 << 11 | p[1] >> 2 << 5 | p[2] >> 3);
                }
        if (terrimp_sorted_halve(map, (uint32_t)width, (uint32_t)width, 3, 1, coarser))
            return 0;
        memcpy(map, coarser, sizeof map);
    }
    return 1;
}

/* ---- What a host has to do ---------------------------------------------- */

static void draw(raster *r, const uint16_t *pixels, int log2_side, int32_t page_x, int32_t page_z,
                 const float *xyz, const uint8_t *from, int index_count)
{
    raster_texture texture = { 0 };
    raster_style style = { 0 };
    float matrix[16] = { 0 };
    uint16_t indices[18];
    int i;
    texture.levels[0] = pixels, texture.level_count = 1, texture.log2_side = log2_side;
    matrix[0] = matrix[9] = 1.0f / QUADS; /* a page is 0..1 of its texture */
    matrix[12] = (float)-page_x, matrix[13] = (float)-page_z, matrix[15] = 1.0f;
    style.texture = &texture, style.texture_matrix = matrix, style.share = RASTER_ALL;
    for (i = 0; i < index_count; i++)
        indices[i] = from[i];
    raster_draw(r, &style, xyz, indices, (size_t)index_count);
}

static void draw_square(raster *r, const terrimp_sorted_square *q, const float *xyz)
{
    int log2_side = LOG2_TEXELS - q->texture_level;
    int page = (q->page_z & (PAGES - 1)) * PAGES + (q->page_x & (PAGES - 1));
    draw(r, texels[q->texture_level] + (page << 2 * log2_side), log2_side, q->page_x, q->page_z,
         xyz, q->indices, 3 * q->triangle_count);
}

/* The height of what is drawn of a square at a place of it. */
static float drawn_height(const terrimp_sorted_square *q, const float *xyz, float x, float z)
{
    float height = xyz[1];
    int t;
    for (t = 0; t < q->triangle_count; t++) {
        const float *a = xyz + 3 * q->indices[3 * t], *b = xyz + 3 * q->indices[3 * t + 1];
        const float *c = xyz + 3 * q->indices[3 * t + 2];
        float area = (b[0] - a[0]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[0] - a[0]);
        float u = ((x - a[0]) * (c[2] - a[2]) - (z - a[2]) * (c[0] - a[0])) / area;
        float v = ((b[0] - a[0]) * (z - a[2]) - (b[2] - a[2]) * (x - a[0])) / area;
        if (u >= 0.0f && v >= 0.0f && u + v <= 1.0f)
            height = a[1] + u * (b[1] - a[1]) + v * (c[1] - a[1]);
    }
    return height;
}

/* The tree of a square of up to 8 x 8 quads, if it has one: a kite on its tip. It stays above its
   square, so it is drawn with it. */
static void draw_tree(raster *r, const terrimp_sorted_square *q, const float *xyz,
                      const terrimp_camera *camera)
{
    static const uint8_t indices[6] = { 0, 1, 2, 0, 2, 3 };
    int32_t cell_x = q->vertices[0].x >> 3, cell_z = q->vertices[0].z >> 3;
    float x = (float)(cell_x * 8 + 3) + 0.5f, z = (float)(cell_z * 8 + 3) + 0.5f, foot;
    float turn = 0.45f / sqrtf(camera->forward[0] * camera->forward[0] +
                               camera->forward[2] * camera->forward[2]);
    float kite[12];
    int i;
    if (q->level > 3 || hashed((uint32_t)cell_x & 63, (uint32_t)cell_z & 63, 3) < 0.5f ||
        x < xyz[0] || x > xyz[9] || z < xyz[2] || z > xyz[11])
        return;
    foot = drawn_height(q, xyz, x, z);
    for (i = 0; i < 4; i++) {
        float across = i == 1 ? turn : i == 3 ? -turn : 0.0f;
        kite[3 * i] = x - camera->forward[2] * across;
        kite[3 * i + 1] = foot + (i == 0 ? 0.0f : i == 2 ? 3.2f : 2.0f);
        kite[3 * i + 2] = z + camera->forward[0] * across;
    }
    draw(r, leaves, 0, 0, 0, kite, indices, 6);
}

/* Squares from back to front, each before its tree; the other ways the other way round. */
static int draw_frame(raster *r, terrimp_sorted *s, const terrimp_camera *camera, int way)
{
    float view[16], projection[16], xyz[8 * 3];
    terrimp_sorted_square q;
    int i;
    if (terrimp_camera_matrices(camera, view, projection) || terrimp_sorted_begin(s, camera))
        return 0;
    raster_begin(r, screen[way], way == WITH_DEPTH ? depth : NULL, WIDTH, WIDTH, HEIGHT, 1, view,
                 projection, camera->eye);
    r->covered = way == COVERED ? covered : NULL;
    if (way == COVERED)
        raster_clear_covered(r);
    else
        raster_clear(r, SKY);
    raster_clear_depth(r);
    while (terrimp_sorted_next(s, &q, 1)) {
        for (i = 0; i < q.vertex_count; i++)
            terrimp_sorted_position(s, &q.vertices[i], xyz + 3 * i);
        if (way != BACK_TO_FRONT)
            draw_tree(r, &q, xyz, camera);
        draw_square(r, &q, xyz);
        if (way == BACK_TO_FRONT)
            draw_tree(r, &q, xyz, camera);
    }
    if (way == COVERED)
        raster_fill_rest(r, SKY);
    return 1;
}

/* ---- A flight ----------------------------------------------------------- */

static terrimp_camera camera_of(int frame, const terrimp_heightfield *field)
{
    terrimp_camera camera = { 0 };
    float turn = 0.6f + 0.012f * (float)frame, ground = 0.0f;
    camera.eye[0] = 100.0f + 9.0f * (float)frame; /* leaves the first repetition */
    camera.eye[2] = 60.0f + 6.0f * (float)frame;
    (void)terrimp_heightfield_height(field, camera.eye[0], camera.eye[2], &ground);
    camera.eye[1] = ground + 25.0f;
    camera.forward[0] = cosf(turn), camera.forward[1] = -0.2f, camera.forward[2] = sinf(turn);
    camera.width_px = WIDTH, camera.height_px = HEIGHT;
    camera.z_near = 0.5f, camera.z_far = 700.0f;
    return camera;
}

int main(int argc, char **argv)
{
    static raster r;
    terrimp_sorted_desc desc = { 0 };
    terrimp_sorted sorted[WAYS];
    clock_t took[WAYS] = { 0 }, start;
    long differing = 0, triangles = 0;
    int i, k, way;
    (void)argc;
    make_terrain(), make_map();
    desc.field.samples = heights;
    desc.field.width = desc.field.depth = SIDE;
    desc.field.format = TERRIMP_FORMAT_U16;
    desc.field.height_scale = 240.0f / 60000.0f;
    desc.field.wrap = 1;
    desc.max_triangles = TRIANGLES;
    desc.page_texels = TEXELS, desc.texture_level_count = LEVELS;
    desc.texture_levels = texture_levels;
    memset(texture_levels, 255, sizeof texture_levels);
    if (!cut_pages() || terrimp_sorted_init(&desc, &sorted[0]))
        return 2;
    for (way = 1; way < WAYS; way++) {
        sorted[way] = sorted[0];
        sorted[way].desc.front_to_back = 1;
    }
    for (i = 0; i < FRAMES; i++) {
        terrimp_camera camera = camera_of(i, &desc.field);
        for (way = 0; way < WAYS; way++) {
            start = clock();
            if (!draw_frame(&r, &sorted[way], &camera, way))
                return 2;
            took[way] += clock() - start;
            for (k = 0; k < WIDTH * HEIGHT; k++)
                differing += screen[0][k] != screen[way][k];
        }
        triangles += (long)sorted[0].triangle_count;
    }
    raster_read(&r, rgb);
    printf("%d frames, %ld triangles each: %ld pixels differ from those with a depth buffer\n",
           FRAMES, triangles / FRAMES, differing);
    for (way = 0; way < WAYS; way++)
        printf("%.3f ms a frame %s\n", (double)took[way] * 1000.0 / CLOCKS_PER_SEC / FRAMES,
               way == BACK_TO_FRONT ? "from back to front" : way == COVERED
               ? "from front to back, with a bit a pixel" : "with a depth buffer");
    printf("%zu bytes of state\n", sizeof sorted[0]);
    return differing != 0 || image_write_beside(argv[0], "sorted.png", rgb, WIDTH, HEIGHT);
}
