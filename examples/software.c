/* Shows a host without any GPU: 320 x 240 pixels of RGB565, a depth buffer and an atlas, all in
   RAM, and the span rasteriser of host/raster.c. To lift it into an engine take host/raster.[ch]
   and the four callbacks; the lines after them make the terrain and check the pictures.
   Build:  make software
   Expect: 40 frames of a flight, some of them compared with the full mesh; the last one in
           build/software.png. All of them again in painter's order, with a depth buffer and
           without. Exit code 1 when a frame has holes, is too far from the full mesh, or changes
           without the depth buffer. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "host/image.h"
#include "host/raster.h"
#include "host/scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { WIDTH = 320, HEIGHT = 240, ATLAS = 512, LOG2_ATLAS = 9 };
enum { LOG2_SIDE = 9, GRID = (SCENE_QUADS + 1) * (SCENE_QUADS + 1), SKY = 0xae9d };

typedef struct host {
    const terrimp_terrain *terrain;
    uint16_t screen[WIDTH * HEIGHT], atlas[ATLAS * ATLAS];
    uint16_t depth[WIDTH * HEIGHT], atlas_depth[ATLAS * ATLAS];
    uint32_t node_count;
    uint16_t *indices, *mesh_indices;
    uint16_t *scratch; /* painter's order instead of the depth buffer; NULL: the depth buffer */
    float *mesh_xyz, ground_xyz[GRID * 3]; /* of one node */
    uint32_t mesh_floats, mesh_index_count, floor_first_index;
    uint16_t lightmap_texels[SCENE_SIDE * SCENE_SIDE * 4 / 3];
    raster_texture lightmap, atlas_texture;
    const float *lightmap_matrix;
    raster r;
    int on_screen, capturing;
    float view[16], projection[16];
    terrimp_camera camera;
} host;

/* ---- What a host has to do ---------------------------------------------- */

static void begin_capture(void *user, const terrimp_capture_command *c)
{
    host *h = (host *)user;
    const terrimp_rect *slot = &c->slot;
    uint32_t corner = slot->y * ATLAS + slot->x;
    raster_begin(&h->r, h->atlas + corner, h->scratch ? NULL : h->atlas_depth + corner, ATLAS,
                 (int)slot->width, (int)slot->height, 0, c->view, c->projection, c->eye);
    h->r.depth_pitch = ATLAS;
    if (c->clear) {
        raster_clear(&h->r, RASTER_KEY);
        raster_clear_depth(&h->r);
    }
    h->on_screen = 0;
    h->capturing = 1;
}

static void end_capture(void *user, const terrimp_capture_command *c)
{
    (void)c;
    ((host *)user)->capturing = 0;
}

static void turn_to_screen(host *h)
{
    if (h->on_screen)
        return;
    h->on_screen = 1;
    raster_begin(&h->r, h->screen, h->depth, WIDTH, WIDTH, HEIGHT, 1, h->view, h->projection,
                 h->camera.eye);
    h->r.depth = h->scratch ? NULL : h->depth;
    raster_clear(&h->r, SKY);
    raster_clear_depth(&h->r);
}

/* Vertices are made for each draw, from the samples and from the terrain's compact meshes: no
   memory goes into vertex buffers. */
static void draw_mesh(host *h, uint32_t node, const raster_style *style, uint32_t first,
                      uint32_t index_count)
{
    turn_to_screen(h);
    if (terrimp_terrain_fill_mesh(h->terrain, node, h->mesh_xyz, h->mesh_floats, h->mesh_indices,
                                  h->mesh_index_count) != TERRIMP_OK)
        return;
    if (!h->scratch || terrimp_sorted_mesh(h->mesh_xyz, h->mesh_floats / 3, h->r.eye,
                                           h->mesh_indices + first, index_count, h->scratch,
                                           NULL) == TERRIMP_OK)
        raster_draw(&h->r, style, h->mesh_xyz, h->mesh_indices + first, index_count);
}

static void draw_impostor(void *user, const terrimp_impostor_command *c)
{
    host *h = (host *)user;
    raster_style style = { 0 };
    style.texture = &h->atlas_texture;
    style.texture_matrix = c->texture_matrix;
    memcpy(style.picture_eye, c->eye, sizeof style.picture_eye);
    style.share = (int)(c->alpha * RASTER_ALL + 0.5f);
    style.within_depth = c->part_count > 1;
    if (c->place_matrix[15] > 0.0f) { /* with exact_depth */
        style.place_matrix = c->place_matrix;
        style.texture_depth = h->atlas_depth;
    }
    draw_mesh(h, c->node, &style, 0, c->index_count);
}

/* The floor is the mesh behind those of all nodes. */
static void draw_floor(void *user, const terrimp_floor_command *c)
{
    host *h = (host *)user;
    raster_style style = { 0 };
    style.texture = &h->lightmap;
    style.texture_matrix = h->lightmap_matrix;
    style.share = RASTER_ALL;
    draw_mesh(h, h->node_count, &style, c->first_index - h->floor_first_index, c->index_count);
}

static void draw_ground(void *user, const terrimp_ground_command *c)
{
    host *h = (host *)user;
    raster_style style = { 0 };
    const uint16_t *indices = h->indices + c->first_index;
    uint32_t count = c->index_count;
    if (!h->capturing)
        turn_to_screen(h);
    if (h->scratch) {
        indices = h->scratch;
        if (terrimp_sorted_ground(h->terrain, c, h->r.eye, h->scratch, count, &count) != TERRIMP_OK)
            return;
    }
    style.texture = &h->lightmap;
    style.texture_matrix = h->lightmap_matrix;
    style.share = RASTER_ALL;
    if (terrimp_terrain_fill_ground(h->terrain, c->node, h->ground_xyz, GRID * 3) == TERRIMP_OK)
        raster_draw(&h->r, &style, h->ground_xyz, indices, count);
}

/* ---- A terrain and a flight --------------------------------------------- */

static uint8_t ours[WIDTH * HEIGHT * 3], full[WIDTH * HEIGHT * 3];

static uint32_t larger(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

static int prepare(host *h, const terrimp_terrain *terrain, const scene *s, int sorted)
{
    terrimp_terrain_info info;
    size_t most;
    if (terrimp_terrain_get_info(terrain, &info) != TERRIMP_OK)
        return 0;
    h->terrain = terrain;
    h->node_count = info.node_count;
    h->mesh_floats = 3 * larger(info.mesh_vertex_stride, info.mesh_vertex_count
                                                    - info.node_count * info.mesh_vertex_stride);
    h->mesh_index_count = larger(info.mesh_index_stride, info.mesh_index_count
                                                    - info.node_count * info.mesh_index_stride);
    h->indices = malloc(info.ground_index_count * sizeof *h->indices);
    h->floor_first_index = info.mesh_index_count - info.floor_index_count;
    h->mesh_indices = malloc(h->mesh_index_count * sizeof *h->mesh_indices);
    h->mesh_xyz = malloc(h->mesh_floats * sizeof *h->mesh_xyz);
    most = 3 * info.ground_index_count + 3 * h->mesh_index_count + h->mesh_floats / 3;
    h->scratch = sorted ? malloc(most * sizeof *h->scratch) : NULL;
    if (!h->indices || !h->mesh_indices || !h->mesh_xyz || (sorted && !h->scratch)
        || terrimp_terrain_fill_indices(terrain, h->indices, info.ground_index_count))
        return 0;
    raster_make_texture(&h->lightmap, h->lightmap_texels, s->lightmap, LOG2_SIDE);
    h->lightmap_matrix = s->lightmap_matrix;
    h->atlas_texture.levels[0] = h->atlas;
    h->atlas_texture.level_count = 1;
    h->atlas_texture.log2_side = LOG2_ATLAS;
    return 1;
}

static int draw_frame(host *h, terrimp_view *view, int frame, uint8_t *rgb)
{
    terrimp_callbacks callbacks = { 0 };
    terrimp_stats stats;
    callbacks.user = h;
    callbacks.begin_capture = begin_capture, callbacks.end_capture = end_capture;
    callbacks.draw_impostor = draw_impostor, callbacks.draw_ground = draw_ground;
    callbacks.draw_floor = draw_floor;
    h->on_screen = 0;
    h->camera = scene_camera(frame, WIDTH, HEIGHT);
    if (terrimp_view_update(view, &h->camera) != TERRIMP_OK
        || terrimp_view_get_stats(view, &stats) != TERRIMP_OK)
        return 0;
    if (h->camera.z_near < stats.z_near)
        h->camera.z_near = stats.z_near; /* 16 bits of depth go where there is terrain */
    if (terrimp_camera_matrices(&h->camera, h->view, h->projection) != TERRIMP_OK
        || terrimp_view_render(view, &callbacks) != TERRIMP_OK)
        return 0;
    turn_to_screen(h); /* also when there is nothing to draw */
    raster_read(&h->r, rgb);
    return 1;
}

/* Pixels whose distance along forward is off by 1 % and more; *seen: those of terrain. */
static int off_in_depth(const uint16_t *depth, float z_near, const host *truth, int *seen)
{
    int i, off = 0;
    for (i = 0; i < WIDTH * HEIGHT; i++) {
        float close = (float)depth[i] / z_near;
        float there = (float)truth->depth[i] / truth->camera.z_near;
        *seen += truth->depth[i] > 0;
        off += truth->depth[i] > 0 && (close > 1.01f * there || close < 0.99f * there);
    }
    return off;
}

static int opened(const terrimp_terrain *terrain, terrimp_view_desc settings, int mode, int sorted,
                  terrimp_view **view)
{
    settings.mode = mode;
    settings.sorted = sorted;
    if (!sorted) /* else depth buffer and painter's order would differ */
        settings.exact_depth = terrimp_view_exact_depth();
    return terrimp_view_create(terrain, &settings, NULL, view) == TERRIMP_OK;
}

/* A frame in painter's order, with the depth buffer and without: returns the pixels that differ, or
   -1. Adds to the time that both take. */
static int differing(host h[2], terrimp_view *views[2], int frame, clock_t clocks[2])
{
    static uint8_t rgb[2][WIDTH * HEIGHT * 3];
    int i, count = 0;
    for (i = 0; i < 2; i++) {
        clock_t start = clock();
        if (!draw_frame(&h[i], views[i], frame, rgb[i]))
            return -1;
        clocks[i] += clock() - start;
    }
    for (i = 0; i < WIDTH * HEIGHT; i++)
        count += memcmp(rgb[0] + 3 * i, rgb[1] + 3 * i, 3) != 0;
    return count;
}

int main(int argc, char **argv)
{
    static host h[3]; /* the last two: painter's order, with a depth buffer and without */
    scene s;
    terrimp_view_desc settings = { 0 };
    terrimp_terrain *terrain = NULL;
    terrimp_view *views[3] = { 0 }, *full_views[3] = { 0 };
    terrimp_stats stats;
    clock_t clocks = 0, sorted_clocks[2] = { 0 }, full_clocks = 0, first = 0;
    static uint16_t depth[WIDTH * HEIGHT];
    int i, ok = 1, other = 0, full_other = 0, off = 0, seen = 0;
    float z_near;

    (void)argc;
    settings.texels_per_px = 1.0f; /* the nearest texel is taken: more would only flicker */
    settings.atlas_size = ATLAS;
    settings.max_impostors = 128;
    if (scene_open(&s) || terrimp_terrain_create(&s.desc, NULL, &terrain) != TERRIMP_OK)
        return 2;
    for (i = 0; i < 3; i++)
        if (!opened(terrain, settings, TERRIMP_MODE_AUTO, i > 0, &views[i])
            || !opened(terrain, settings, TERRIMP_MODE_FULL, i > 0, &full_views[i])
            || !prepare(&h[i], terrain, &s, i == 2))
            return 2;
    for (i = 0; ok && i < SCENE_FRAMES; i++) {
        clock_t start = clock();
        ok = draw_frame(&h[0], views[0], i, ours)
             && terrimp_view_get_stats(views[0], &stats) == TERRIMP_OK;
        clocks += clock() - start;
        if (i == 0)
            first = clocks; /* takes most of the pictures */
        other += differing(h + 1, views + 1, i, sorted_clocks);
        if (!scene_judges(i))
            continue;
        memcpy(depth, h[0].depth, sizeof depth);
        z_near = h[0].camera.z_near;
        start = clock();
        ok = ok && draw_frame(&h[0], full_views[0], i, full);
        full_clocks += clock() - start;
        off += off_in_depth(depth, z_near, &h[0], &seen);
        full_other += differing(h + 1, full_views + 1, i, sorted_clocks);
        scene_judge(&s, i, &stats, ours, full, WIDTH, HEIGHT);
    }
    printf("%zu KiB for screen, depth, atlas and buffers, %zu for the terrain, %zu for the view\n",
           sizeof h[0] / 1024, terrimp_terrain_bytes(&s.desc) / 1024,
           terrimp_view_bytes(terrain, &settings) / 1024);
    printf("first frame %.1f ms, then %.1f ms a frame; full mesh %.1f ms\n",
           (double)first * 1000.0 / CLOCKS_PER_SEC,
           (double)(clocks - first) * 1000.0 / CLOCKS_PER_SEC / (SCENE_FRAMES - 1),
           (double)full_clocks * 1000.0 / CLOCKS_PER_SEC / (SCENE_FRAMES / 10));
    printf("in painter's order, without the depth buffer: %d of %d pixels differ, of the full mesh "
           "%d of %d; %.2f times the time\n", other, SCENE_FRAMES * WIDTH * HEIGHT, full_other,
           SCENE_FRAMES / 10 * WIDTH * HEIGHT,
           (double)sorted_clocks[1] / (double)sorted_clocks[0]);
    printf("depth off by 1 %% of the distance: %.2f %% of the pixels\n", 100.0 * off / seen);
    /* Its 16 bits tell what is farther away than some hundred units apart by chance. */
    ok = ok && scene_accepts(&s, 30.0) && off * 25.0 < seen
         && full_other >= 0 && full_other * 10000.0 <= SCENE_FRAMES / 10 * WIDTH * HEIGHT
         && other >= 0 && other * 10000.0 <= SCENE_FRAMES * WIDTH * HEIGHT
         && !image_write_beside(argv[0], "software.png", ours, WIDTH, HEIGHT);
    for (i = 0; i < 3; i++) {
        terrimp_view_destroy(full_views[i]), terrimp_view_destroy(views[i]);
        free(h[i].indices), free(h[i].mesh_indices), free(h[i].mesh_xyz), free(h[i].scratch);
    }
    terrimp_terrain_destroy(terrain), scene_close(&s);
    return !ok;
}
