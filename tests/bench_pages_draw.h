/* Draws views of terrain in pages or in memory with the span rasteriser, and compares pictures. */
#ifndef BENCH_PAGES_DRAW_H
#define BENCH_PAGES_DRAW_H

#include "../examples/host/raster.h"
#include "terrimp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 640, HEIGHT = 512, ATLAS = 4096, LOG2_ATLAS = 12, LOG2_COLOUR = 12, SKY = 0xae9d };
enum { PIXELS = WIDTH * HEIGHT };

typedef struct painter {
    const terrimp_terrain *terrain;
    terrimp_view *view;
    terrimp_terrain_info info;
    uint16_t screen[PIXELS], atlas[ATLAS * ATLAS], depth[ATLAS * ATLAS];
    uint16_t *indices, *mesh_indices;
    float *xyz;
    size_t floats, mesh_index_count;
    raster_texture colour, pictures;
    float colour_matrix[16];
    raster r;
    int capturing, on_screen;
    float view_matrix[16], projection[16], eye[3];
    uint8_t rgb[3 * PIXELS];
} painter;

static void painter_screen(painter *p)
{
    if (p->on_screen)
        return;
    p->on_screen = 1;
    raster_begin(&p->r, p->screen, p->depth, WIDTH, WIDTH, HEIGHT, 1, p->view_matrix,
                 p->projection, p->eye);
    p->r.depth = p->depth;
    raster_clear(&p->r, SKY);
    raster_clear_depth(&p->r);
}

static void painter_begin(void *user, const terrimp_capture_command *c)
{
    painter *p = user;
    raster_begin(&p->r, p->atlas + c->slot.y * ATLAS + c->slot.x, p->depth, ATLAS,
                 (int)c->slot.width, (int)c->slot.height, 0, c->view, c->projection, c->eye);
    p->r.depth = p->depth;
    if (c->clear)
        raster_clear(&p->r, RASTER_KEY);
    raster_clear_depth(&p->r);
    p->capturing = 1;
}

static void painter_end(void *user, const terrimp_capture_command *c)
{
    (void)c;
    ((painter *)user)->capturing = 0;
}

static void painter_ground(void *user, const terrimp_ground_command *c)
{
    painter *p = user;
    raster_style style = {0};
    if (!p->capturing)
        painter_screen(p);
    style.texture = &p->colour;
    style.texture_matrix = p->colour_matrix;
    style.share = RASTER_ALL;
    if (terrimp_terrain_fill_ground(p->terrain, c->node, p->xyz, p->floats) == TERRIMP_OK)
        raster_draw(&p->r, &style, p->xyz, p->indices + c->first_index, c->index_count);
}

static void painter_mesh(painter *p, uint32_t node, const raster_style *style, uint32_t first,
                         uint32_t count)
{
    painter_screen(p);
    if (terrimp_terrain_fill_mesh(p->terrain, node, p->xyz, p->floats, p->mesh_indices,
                                  p->mesh_index_count) == TERRIMP_OK)
        raster_draw(&p->r, style, p->xyz, p->mesh_indices + first, count);
}

static void painter_impostor(void *user, const terrimp_impostor_command *c)
{
    painter *p = user;
    raster_style style = {0};
    style.texture = &p->pictures;
    style.texture_matrix = c->texture_matrix;
    memcpy(style.picture_eye, c->eye, sizeof style.picture_eye);
    style.share = (int)(c->alpha * RASTER_ALL + 0.5f);
    style.within_depth = c->part_count > 1;
    painter_mesh(p, c->node, &style, 0, c->index_count);
}

static void painter_floor(void *user, const terrimp_floor_command *c)
{
    painter *p = user;
    raster_style style = {0};
    style.texture = &p->colour;
    style.texture_matrix = p->colour_matrix;
    style.share = RASTER_ALL;
    painter_mesh(p, p->info.node_count, &style,
                 c->first_index - (p->info.mesh_index_count - p->info.floor_index_count),
                 c->index_count);
}

/* A view of a terrain whose sides are `side` [wu], over which a texture is spread. */
static painter *painter_open(const terrimp_terrain *terrain, int mode, float tolerance_px,
                             float side, const raster_texture *colour)
{
    painter *p = calloc(1, sizeof *p);
    terrimp_view_desc settings = {0};
    settings.mode = mode;
    settings.ground_tolerance_px = tolerance_px;
    settings.atlas_size = ATLAS;
    settings.texels_per_px = 2.0f; /* the nearest is taken */
    if (!p || terrimp_terrain_get_info(terrain, &p->info) != TERRIMP_OK ||
        terrimp_view_create(terrain, &settings, NULL, &p->view) != TERRIMP_OK)
        return NULL;
    p->terrain = terrain;
    p->floats = 3u * (p->info.ground_vertex_count + p->info.floor_vertex_count +
                      p->info.mesh_vertex_stride);
    p->mesh_index_count = p->info.mesh_index_stride + p->info.floor_index_count;
    p->indices = malloc(p->info.ground_index_count * sizeof *p->indices);
    p->mesh_indices = malloc(p->mesh_index_count * sizeof *p->mesh_indices);
    p->xyz = malloc(p->floats * sizeof *p->xyz);
    terrimp_terrain_fill_indices(terrain, p->indices, p->info.ground_index_count);
    p->colour = *colour;
    p->colour_matrix[0] = p->colour_matrix[9] = 1.0f / side; /* s = x, t = z */
    p->colour_matrix[15] = 1.0f;
    p->pictures.levels[0] = p->atlas;
    p->pictures.level_count = 1;
    p->pictures.log2_side = LOG2_ATLAS;
    return p;
}

static terrimp_result painter_draw(painter *p, terrimp_camera camera)
{
    terrimp_callbacks draw = {0};
    terrimp_stats stats;
    terrimp_result result = terrimp_view_update(p->view, &camera);
    if (result != TERRIMP_OK || terrimp_view_get_stats(p->view, &stats) != TERRIMP_OK)
        return result;
    if (camera.z_near < stats.z_near) /* of views whose bounds differ a little: still the same */
        camera.z_near = exp2f(floorf(log2f(stats.z_near)));
    memcpy(p->eye, camera.eye, sizeof p->eye);
    terrimp_camera_matrices(&camera, p->view_matrix, p->projection);
    draw.user = p;
    draw.begin_capture = painter_begin, draw.end_capture = painter_end;
    draw.draw_ground = painter_ground, draw.draw_impostor = painter_impostor;
    draw.draw_floor = painter_floor;
    p->on_screen = 0;
    result = terrimp_view_render(p->view, &draw);
    painter_screen(p);
    raster_read(&p->r, p->rgb);
    return result;
}

/* PSNR of a picture against another [dB], at most 99. *holes: and pixels of sky in it alone. */
static double painter_psnr(const painter *p, const painter *truth, uint32_t *holes)
{
    double sum = 0.0;
    size_t i;
    for (i = 0; i < 3u * PIXELS; i++)
        sum += ((double)p->rgb[i] - truth->rgb[i]) * ((double)p->rgb[i] - truth->rgb[i]);
    for (i = 0; i < PIXELS; i++)
        *holes += p->screen[i] == SKY && truth->screen[i] != SKY;
    return sum > 0.0 ? fmin(10.0 * log10(255.0 * 255.0 * 3.0 * PIXELS / sum), 99.0) : 99.0;
}

static void painter_close(painter *p)
{
    terrimp_view_destroy(p->view);
    free(p->indices), free(p->mesh_indices), free(p->xyz), free(p);
}

#endif
