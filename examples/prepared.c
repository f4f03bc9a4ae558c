/* Shows pictures that are prepared: terrimp_place_terrain offers them, terrimp_place chooses which
   keep every view from a box of eyes within a budget, each is drawn once, and what a console keeps
   in read-only memory is that atlas. In flight nothing is captured, and there is no GPU.
   Build:  make prepared
   Expect: 40 frames of a flight, some of them compared with the full mesh; the last one in
           build/prepared.png. Exit code 1 when one has holes or is too far from the full mesh. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "host/image.h"
#include "host/raster.h"
#include "host/scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 320, HEIGHT = 240, ATLAS = 1024, LOG2_ATLAS = 10, LOG2_SIDE = 9, SKY = 0xae9d };
enum { GRID = (SCENE_QUADS + 1) * (SCENE_QUADS + 1), NODES = 400, CANDIDATES = 20000 };
enum { GAINS = 400000, VIEWS = 1024, CELL_LEVELS = 2, DIRECTIONS = 16 };

typedef struct host {
    const terrimp_terrain *terrain;
    uint16_t rom[ATLAS * ATLAS], screen[WIDTH * HEIGHT], depth[ATLAS * ATLAS];
    uint16_t *indices, *mesh_indices, lightmap_texels[SCENE_SIDE * SCENE_SIDE * 4 / 3];
    float *mesh_xyz, ground_xyz[GRID * 3];
    uint32_t mesh_floats, mesh_index_count, triangles;
    raster_texture lightmap, pictures;
    raster_style ground;
    raster r;
    terrimp_ground_command draws[NODES]; /* of the frame */
    uint32_t draw_count;
} host;

static host h;
static scene s;
static terrimp_place_candidate candidates[CANDIDATES];
static terrimp_place_picture offered[CANDIDATES];
static terrimp_place_gain gains[GAINS];
static uint32_t parents[NODES], slot_of[CANDIDATES], order[2 * CANDIDATES];
static float costs[VIEWS], left[VIEWS], matrices[CANDIDATES][16];
static uint8_t shown[GAINS], ours[WIDTH * HEIGHT * 3], full[WIDTH * HEIGHT * 3];
static terrimp_rect slots[CANDIDATES];
static terrimp_place_set set;
static terrimp_place_terrain_desc wish;

static void need(int result)
{
    if (result)
        fprintf(stderr, "%s\n", terrimp_result_text(result)), exit(2);
}

static int within(uint32_t node, uint32_t other)
{
    while (node < other && parents[node] != node)
        node = parents[node];
    return node == other;
}

static void draw_ground(const terrimp_ground_command *c)
{
    need(terrimp_terrain_fill_ground(h.terrain, c->node, h.ground_xyz, GRID * 3));
    raster_draw(&h.r, &h.ground, h.ground_xyz, h.indices + c->first_index, c->index_count);
    h.triangles += c->index_count / 3;
}

/* ---- Before the flight -------------------------------------------------- */

/* Offers and chooses; returns how many are chosen. */
static uint32_t choose(float share)
{
    terrimp_place_desc d = { 0 };
    terrimp_placement placed;
    size_t bytes = terrimp_place_terrain_scratch_bytes(&wish);
    void *scratch = malloc(bytes);
    float most = 0;
    uint32_t i, count = 0;
    set.candidates = candidates, set.pictures = offered, set.gains = gains;
    set.parents = parents, set.costs = costs;
    set.candidate_capacity = CANDIDATES, set.gain_capacity = GAINS;
    set.cluster_capacity = NODES, set.view_capacity = VIEWS;
    need(scratch ? (int)terrimp_place_terrain(&wish, scratch, bytes, &set) : (int)TERRIMP_E_MEMORY);
    free(scratch);
    for (i = 0; i < set.view_count; i++)
        most = costs[i] > most ? costs[i] : most;
    d.candidates = candidates, d.gains = gains, d.parents = parents, d.costs = costs;
    d.candidate_count = set.candidate_count, d.gain_count = set.gain_count;
    d.cluster_count = set.cluster_count, d.view_count = set.view_count;
    d.budget = share * most;
    bytes = terrimp_place_scratch_bytes(&d);
    scratch = malloc(bytes);
    need(scratch ? (int)terrimp_place(&d, scratch, bytes, shown, left, &placed)
                 : (int)TERRIMP_E_MEMORY);
    free(scratch);
    for (i = 0; i < set.candidate_count; i++)
        if (memchr(shown + candidates[i].first_gain, 1, candidates[i].gain_count))
            slot_of[i] = ++count;
    printf("%u views cost %.0f at most; %u of %u pictures for a budget of %.0f, %u views above "
           "it\n", set.view_count, (double)most, count, set.candidate_count, (double)d.budget,
           placed.unsolved);
    return count;
}

/* Draws the ground of a node, and of those beside it that its borders show, into its slot. */
static void prepare(uint32_t i, const terrimp_rect *slot, const terrimp_pattern *pattern)
{
    terrimp_capture c;
    terrimp_box box, other;
    float view[16], projection[16];
    uint32_t size[2], n;
    size[0] = slot->width, size[1] = slot->height;
    need(terrimp_terrain_get_box(h.terrain, offered[i].node, &box));
    need(terrimp_capture_fit(&box, offered[i].eye, &c));
    need(terrimp_capture_pad(&c, size, 1));
    need(terrimp_capture_matrices(&c, 0, view, projection));
    need(terrimp_texture_matrix(&c, slot, ATLAS, ATLAS, matrices[i]));
    raster_begin(&h.r, h.rom + slot->y * ATLAS + slot->x, h.depth, ATLAS, (int)slot->width,
                 (int)slot->height, 0, view, projection, c.eye);
    raster_clear(&h.r, RASTER_KEY);
    raster_clear_depth(&h.r);
    for (n = 0; n < (SCENE_SIDE / SCENE_QUADS) * (SCENE_SIDE / SCENE_QUADS); n++) {
        terrimp_ground_command all;
        need(terrimp_terrain_get_box(h.terrain, n, &other));
        if (other.max[0] < box.min[0] || other.min[0] > box.max[0] || other.max[2] < box.min[2]
            || other.min[2] > box.max[2])
            continue;
        all.node = n, all.first_index = pattern->first_index;
        all.index_count = pattern->index_count;
        draw_ground(&all);
    }
}

/* Texels beside the picture take its colours: so that no seam shows between meshes. */
static void widen(const terrimp_rect *slot)
{
    uint16_t *texel = h.rom + slot->y * ATLAS + slot->x;
    int w = (int)slot->width, n = w * (int)slot->height, turn, i, k;
    for (turn = 0; turn < 2; turn++)
        for (i = 0; i < n; i++) {
            int at = turn ? n - 1 - i : i, x = at % w, y = at / w, step = turn ? -1 : 1;
            uint16_t *to = texel + y * ATLAS + x;
            for (k = 0; k < 2 && *to == RASTER_KEY; k++)
                if (k ? y + step >= 0 && y + step < n / w : x + step >= 0 && x + step < w)
                    *to = to[k ? step * ATLAS : step];
        }
}

static void prepare_all(uint32_t count)
{
    terrimp_pattern pattern;
    uint32_t i, texels = 0;
    float scale;
    for (i = 0; i < set.candidate_count; i++)
        if (slot_of[i]) {
            slots[slot_of[i] - 1].width = offered[i].width + 2;
            slots[slot_of[i] - 1].height = offered[i].height + 2;
            texels += (offered[i].width + 2) * (offered[i].height + 2);
        }
    need(terrimp_pack_ffdh(ATLAS, ATLAS, slots, count, order, &scale));
    need(scale < 1.0f ? (int)TERRIMP_E_CAPACITY : 0);
    need(terrimp_pattern_find(SCENE_QUADS, TERRIMP_FORM_LIST, 0, &pattern));
    for (i = 0; i < set.candidate_count; i++)
        if (slot_of[i])
            prepare(i, &slots[slot_of[i] - 1], &pattern), widen(&slots[slot_of[i] - 1]);
    printf("%u KiB of texels in read-only memory\n", texels / 512);
}

/* ---- In flight ---------------------------------------------------------- */

static void keep_ground(void *user, const terrimp_ground_command *c)
{
    (void)user;
    if (h.draw_count < NODES)
        h.draws[h.draw_count++] = *c;
}

static void ignore(void *user, const terrimp_capture_command *c) { (void)user, (void)c; }
static void no_impostor(void *user, const terrimp_impostor_command *c) { (void)user, (void)c; }

/* The view of the placement that an eye belongs to. */
static uint32_t view_of(const terrimp_camera *camera)
{
    const terrimp_box *b = &wish.eyes;
    uint32_t cells = 1u << CELL_LEVELS;
    uint32_t x = (uint32_t)((camera->eye[0] - b->min[0]) / (b->max[0] - b->min[0]) * (float)cells);
    uint32_t z = (uint32_t)((camera->eye[2] - b->min[2]) / (b->max[2] - b->min[2]) * (float)cells);
    return (z * cells + x) * DIRECTIONS + DIRECTIONS / 8; /* the flight looks along +x +z */
}

/* Draws a frame; with_pictures: ground where no picture of it is shown, and those pictures. */
static uint32_t draw_frame(terrimp_view *view, int frame, int with_pictures, uint8_t *rgb)
{
    terrimp_callbacks callbacks = { 0 };
    terrimp_camera camera = scene_camera(frame, WIDTH, HEIGHT);
    float turn[16], projection[16];
    uint32_t i, k, g, v = view_of(&camera), pictures = 0;
    uint8_t hidden[NODES] = { 0 };
    callbacks.draw_ground = keep_ground, callbacks.draw_impostor = no_impostor;
    callbacks.begin_capture = callbacks.end_capture = ignore;
    h.draw_count = h.triangles = 0;
    need(terrimp_camera_matrices(&camera, turn, projection));
    need(terrimp_view_update(view, &camera));
    need(terrimp_view_render(view, &callbacks));
    raster_begin(&h.r, h.screen, h.depth, WIDTH, WIDTH, HEIGHT, 1, turn, projection, camera.eye);
    raster_clear(&h.r, SKY);
    raster_clear_depth(&h.r);
    for (i = 0; with_pictures && i < set.candidate_count; i++)
        for (g = 0; g < candidates[i].gain_count; g++) {
            const terrimp_place_gain *gain = &gains[candidates[i].first_gain + g];
            terrimp_mesh_info info;
            raster_style style = { 0 };
            int used = 0;
            if (gain->view != v || !shown[candidates[i].first_gain + g])
                continue;
            for (k = 0; k < h.draw_count; k++)
                if (within(h.draws[k].node, offered[i].node))
                    used = hidden[k] = 1;
            if (!used)
                continue; /* out of sight, or part of coarser ground */
            style.texture = &h.pictures, style.texture_matrix = matrices[i];
            style.share = RASTER_ALL;
            memcpy(style.picture_eye, offered[i].eye, sizeof style.picture_eye);
            need(terrimp_terrain_get_mesh(h.terrain, offered[i].node, &info));
            need(terrimp_terrain_fill_mesh(h.terrain, offered[i].node, h.mesh_xyz, h.mesh_floats,
                                           h.mesh_indices, h.mesh_index_count));
            raster_draw(&h.r, &style, h.mesh_xyz, h.mesh_indices, info.index_count);
            h.triangles += info.index_count / 3;
            pictures++;
        }
    for (k = 0; k < h.draw_count; k++)
        if (!hidden[k])
            draw_ground(&h.draws[k]);
    raster_read(&h.r, rgb);
    return pictures;
}

int main(int argc, char **argv)
{
    terrimp_view_desc settings = { 0 };
    terrimp_terrain *terrain;
    terrimp_terrain_info info;
    terrimp_view *view, *full_view;
    terrimp_stats stats = { 0 };
    int i, ok;
    (void)argc;
    if (scene_open(&s))
        return 2;
    need(terrimp_terrain_create(&s.desc, NULL, &terrain));
    need(terrimp_terrain_get_info(terrain, &info));
    settings.mode = TERRIMP_MODE_GEOMIP;
    need(terrimp_view_create(terrain, &settings, NULL, &view));
    settings.mode = TERRIMP_MODE_FULL;
    need(terrimp_view_create(terrain, &settings, NULL, &full_view));
    h.terrain = terrain;
    h.mesh_floats = 3 * info.mesh_vertex_stride, h.mesh_index_count = info.mesh_index_stride;
    h.indices = malloc(info.ground_index_count * sizeof *h.indices);
    h.mesh_indices = malloc(h.mesh_index_count * sizeof *h.mesh_indices);
    h.mesh_xyz = malloc(h.mesh_floats * sizeof *h.mesh_xyz);
    need(h.indices && h.mesh_indices && h.mesh_xyz ? 0 : (int)TERRIMP_E_MEMORY);
    need(terrimp_terrain_fill_indices(terrain, h.indices, info.ground_index_count));
    raster_make_texture(&h.lightmap, h.lightmap_texels, s.lightmap, LOG2_SIDE);
    h.ground.texture = &h.lightmap, h.ground.texture_matrix = s.lightmap_matrix;
    h.ground.share = RASTER_ALL;
    h.pictures.levels[0] = h.rom, h.pictures.level_count = 1, h.pictures.log2_side = LOG2_ATLAS;

    wish.terrain = terrain;
    wish.eyes.min[0] = wish.eyes.min[2] = 60, wish.eyes.max[0] = wish.eyes.max[2] = 100;
    wish.eyes.min[1] = wish.eyes.max[1] = 75;
    wish.cell_levels = CELL_LEVELS, wish.directions = DIRECTIONS, wish.fov_rad = 1.35f;
    wish.max_angle_rad = 0.08f, wish.shafts = 1;
    {
        terrimp_camera camera = scene_camera(0, WIDTH, HEIGHT);
        need(terrimp_camera_pixel_factor(&camera, &wish.pixel_factor));
    }
    prepare_all(choose(argc > 1 ? (float)atof(argv[1]) : 0.6f));
    for (i = 0; i < SCENE_FRAMES; i++) {
        stats.impostors = draw_frame(view, i, 1, ours);
        stats.triangles = h.triangles;
        if (!scene_judges(i))
            continue;
        draw_frame(full_view, i, 0, full);
        scene_judge(&s, i, &stats, ours, full, WIDTH, HEIGHT);
    }
    ok = scene_accepts(&s, 28.0)
         && !image_write_beside(argv[0], "prepared.png", ours, WIDTH, HEIGHT);
    terrimp_view_destroy(full_view), terrimp_view_destroy(view), terrimp_terrain_destroy(terrain);
    free(h.indices), free(h.mesh_indices), free(h.mesh_xyz), scene_close(&s);
    return !ok;
}
