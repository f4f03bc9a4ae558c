/* Terrain impostors as the thesis has them, driven out of the header's plain functions: what the
   view is measured against. Every chunk beyond the foreground is an impostor, none is larger than a
   chunk. Its frustum is fitted to its box (Hess 3.2), its size follows from the screen (3.3); it is
   captured anew, from where the eye is, when the view angle at a corner of its box passes the limit
   (3.5), as many in a frame as are due (5.3). Its slots stand in two atlases that are used in turn,
   packed by first-fit decreasing height (4.3). There is no floor below.

   Where the thesis leaves a choice, this is the better one for it: chunks out of sight take no
   texels; of the neighbours only strips are captured, not all eight whole; (s, t) are projective;
   the coarse meshes are the library's, which meet at their borders and are raised; what can be seen
   is drawn front to back; of the ground, what is opaque comes before the impostors. */
#ifndef BENCH_HESS_H
#define BENCH_HESS_H

#include "atlas_pair.h"
#include "bench_scene.h"

enum { HESS_MARGIN = 2, HESS_SMALLEST = 8 }; /* texels around a picture; of the least side */

typedef struct hess_chunk {
    terrimp_box box;
    float closest;            /* [wu] to the eye */
    float eye[3];             /* of its picture */
    float texture_matrix[16];
    int due;                  /* for a new picture, in this frame */
} hess_chunk;

typedef struct hess {
    const terrimp_terrain *terrain;
    terrimp_terrain_info info;
    float fade_start, fade_end, max_angle_rad, texels_per_px; /* as in terrimp_view_desc */
    uint32_t atlas_size;      /* of each of the two */
    hess_chunk *chunks;
    uint32_t *seen, seen_count; /* chunks in sight, from the closest on */
    atlas_pair pair;
    pair_shelf *shelves;
    pair_slot *slots; /* [chunks], like the next two */
    terrimp_rect *sizes;
    uint32_t *order;          /* [2 * chunks] */
    float scale;              /* what the last packing made of the sizes that were wanted */
    terrimp_camera camera;
    float pixel_factor;
    terrimp_stats stats;
    double drawn, captured;   /* impostors so far */
    uint32_t early_packs;     /* before all pictures had moved: some were lost */
    float least_scale;
} hess;

/* Like a view of those settings, resolved; its two atlases together have the texels of the view's
   one. */
static void hess_open(hess *h, const terrimp_terrain *terrain, const terrimp_view_desc *desc)
{
    uint32_t count, i;
    memset(h, 0, sizeof *h);
    h->terrain = terrain;
    need(terrimp_terrain_get_info(terrain, &h->info));
    h->fade_start = desc->fade_start;
    h->fade_end = desc->fade_end;
    h->max_angle_rad = desc->max_angle_rad;
    h->texels_per_px = desc->texels_per_px;
    h->atlas_size = (uint32_t)((float)desc->atlas_size * 0.70710678f);
    h->scale = h->least_scale = 1.0f;
    count = h->info.chunks_x * h->info.chunks_z;
    h->chunks = need_memory(count * sizeof *h->chunks);
    h->seen = need_memory(count * sizeof *h->seen);
    h->order = need_memory(2 * count * sizeof *h->order);
    h->slots = need_memory(count * sizeof *h->slots);
    h->sizes = need_memory(count * sizeof *h->sizes);
    h->shelves = need_memory(2 * count * sizeof *h->shelves);
    memset(h->chunks, 0, count * sizeof *h->chunks);
    memset(h->slots, 0, count * sizeof *h->slots);
    for (i = 0; i < count; i++)
        need(terrimp_terrain_get_box(terrain, i, &h->chunks[i].box));
    pair_init(&h->pair, h->atlas_size, h->atlas_size, h->shelves, count);
}

static void hess_close(hess *h)
{
    free(h->chunks);
    free(h->seen);
    free(h->order);
    free(h->slots);
    free(h->sizes);
    free(h->shelves);
}

/* ---- Deciding a frame --------------------------------------------------- */

static void hess_size(const hess *h, uint32_t chunk, uint32_t size[2])
{
    terrimp_capture capture;
    need(terrimp_capture_fit(&h->chunks[chunk].box, h->camera.eye, &capture));
    need(terrimp_impostor_size(&capture, h->pixel_factor, h->texels_per_px, HESS_SMALLEST,
                               h->atlas_size / 2 - 2 * HESS_MARGIN, size, NULL));
    size[0] += 2 * HESS_MARGIN;
    size[1] += 2 * HESS_MARGIN;
}

static int hess_is_impostor(const hess *h, uint32_t chunk)
{
    return h->chunks[chunk].closest > h->fade_start;
}

/* The chunks in sight, by insertion: from frame to frame their order hardly changes. */
static void hess_look(hess *h, const terrimp_frustum *frustum)
{
    uint32_t i, k, n = 0, count = h->info.chunks_x * h->info.chunks_z;
    for (i = 0; i < count; i++) {
        hess_chunk *c = &h->chunks[i];
        if (terrimp_frustum_test(frustum, &c->box, TERRIMP_PLANES_ALL) == TERRIMP_PLANES_OUTSIDE)
            continue;
        c->closest = terrimp_box_distance(&c->box, h->camera.eye);
        h->seen[n++] = i;
    }
    h->seen_count = n;
    for (i = 1; i < n; i++) {
        uint32_t chunk = h->seen[i];
        for (k = i; k > 0 && h->chunks[h->seen[k - 1]].closest > h->chunks[chunk].closest; k--)
            h->seen[k] = h->seen[k - 1];
        h->seen[k] = chunk;
    }
}

/* Marks the impostors that have no picture, or one seen from too far round; returns how many. Sets
   *complete when all the others have theirs in the newest atlas. */
static uint32_t hess_mark_due(hess *h, int *complete)
{
    uint32_t i, due = 0;
    *complete = 1;
    for (i = 0; i < h->seen_count; i++) {
        hess_chunk *c = &h->chunks[h->seen[i]];
        int atlas = pair_picture(&h->pair, &h->slots[h->seen[i]]);
        float angle = 0.0f;
        c->due = 0;
        if (!hess_is_impostor(h, h->seen[i]))
            continue;
        need(terrimp_view_angle(&c->box, c->eye, h->camera.eye, &angle));
        c->due = atlas < 0 || angle > h->max_angle_rad;
        due += (uint32_t)c->due;
        if (atlas == 1 - (int)h->pair.newest)
            *complete = 0;
    }
    return due;
}

/* Packs the outdated atlas for what is in sight. What only it held is lost. */
static void hess_repack(hess *h)
{
    uint32_t i, count = h->info.chunks_x * h->info.chunks_z;
    memset(h->sizes, 0, count * sizeof *h->sizes);
    for (i = 0; i < h->seen_count; i++)
        if (hess_is_impostor(h, h->seen[i])) {
            uint32_t size[2];
            hess_size(h, h->seen[i], size);
            h->sizes[h->seen[i]].width = size[0];
            h->sizes[h->seen[i]].height = size[1];
        }
    (void)pair_repack(&h->pair, h->slots, h->sizes, count, h->order, &h->scale);
    h->least_scale = h->scale < h->least_scale ? h->scale : h->least_scale;
}

/* Gives what is due a place in the newest atlas, if it has none there. Returns 0 when that is
   full. */
static int hess_assign(hess *h)
{
    uint32_t i, size[2];
    for (i = 0; i < h->seen_count; i++) {
        pair_slot *slot = &h->slots[h->seen[i]];
        if (!h->chunks[h->seen[i]].due || slot->assigned[h->pair.newest])
            continue;
        hess_size(h, h->seen[i], size);
        if (!pair_assign(&h->pair, slot, (uint32_t)((float)size[0] * h->scale),
                         (uint32_t)((float)size[1] * h->scale)))
            return 0;
    }
    return 1;
}

static void hess_count(hess *h)
{
    uint32_t i, quads = h->info.chunk_quads, impostors = 0;
    terrimp_stats *s = &h->stats;
    float up;
    float aspect = (float)h->camera.width_px / (float)h->camera.height_px;
    memset(s, 0, sizeof *s);
    for (i = 0; i < h->seen_count; i++) {
        const hess_chunk *c = &h->chunks[h->seen[i]];
        const terrimp_rect *slot = &h->slots[h->seen[i]].rect[h->pair.newest];
        terrimp_mesh_info mesh;
        need(terrimp_terrain_get_mesh(h->terrain, h->seen[i], &mesh));
        s->visible++;
        s->z_near = i == 0 ? c->closest : s->z_near;
        if (c->closest < h->fade_end) {
            s->ground++;
            s->triangles += 2 * quads * quads;
        }
        if (!hess_is_impostor(h, h->seen[i]))
            continue;
        impostors++;
        s->triangles += mesh.index_count / 3;
        s->captures += (uint32_t)c->due;
        s->captured_texels += c->due ? slot->width * slot->height : 0;
    }
    s->impostors = impostors;
    s->draws = s->ground + impostors;
    for (i = 0; i < h->seen_count; i++)
        s->z_far = fmaxf(s->z_far, terrimp_box_farthest(&h->chunks[h->seen[i]].box, h->camera.eye));
    /* A point at that distance in the corner of the screen has the smallest depth. */
    up = tanf(0.5f * h->camera.fov_y_rad);
    s->z_near /= sqrtf(1.0f + up * up * (1.0f + aspect * aspect));
    h->captured += s->captures;
    h->drawn += impostors;
    s->reuse = h->captured > 0.0 ? (float)(h->drawn / h->captured) : 0.0f;
}

static void hess_update(hess *h, const terrimp_camera *camera)
{
    terrimp_frustum frustum;
    int complete;
    need(terrimp_camera_resolve(camera, &h->camera));
    need(terrimp_camera_frustum(camera, &frustum));
    need(terrimp_camera_pixel_factor(camera, &h->pixel_factor));
    hess_look(h, &frustum);
    if (hess_mark_due(h, &complete) > 0) {
        if (complete)
            hess_repack(h);
        if (!hess_assign(h)) {
            h->early_packs++;
            hess_repack(h);
            hess_mark_due(h, &complete);
            if (!hess_assign(h))
                bench_stop("two atlases", "what was just packed does not fit");
        }
    }
    hess_count(h);
}

/* ---- Drawing it --------------------------------------------------------- */

/* The chunk and the strips of its neighbours: patterns that stand in the shared indices. */
static void hess_draw_block(const hess *h, uint32_t chunk, const terrimp_callbacks *callbacks)
{
    uint32_t wide = h->info.chunks_x, x = chunk % wide, z = chunk / wide, cell;
    uint32_t quads = h->info.chunk_quads;
    terrimp_ground_command ground;
    memset(&ground, 0, sizeof ground);
    for (cell = 0; cell < 9; cell++) {
        uint32_t nx = x + cell % 3 - 1, nz = z + cell / 3 - 1; /* below 0 it wraps: too large */
        uint32_t which = cell == 4 ? 0 : terrimpi_terrain_apron_pattern(quads, 0,
                                                                        cell - (cell > 4));
        terrimpi_terrain_pattern p = terrimpi_terrain_pattern_of(quads, which);
        if (nx >= wide || nz >= h->info.chunks_z)
            continue;
        ground.node = nz * wide + nx;
        ground.first_index = p.first_index;
        ground.index_count = p.index_count;
        callbacks->draw_ground(callbacks->user, &ground);
    }
}

/* The strips are a 16th of the chunk's width, the least that there are. */
static void hess_capture(hess *h, uint32_t chunk, const terrimp_callbacks *callbacks)
{
    hess_chunk *c = &h->chunks[chunk];
    pair_slot *slot = &h->slots[chunk];
    terrimp_capture capture;
    terrimp_capture_command command;
    uint32_t quads = h->info.chunk_quads, size[2], i;
    float border = (c->box.max[0] - c->box.min[0]) / (float)quads
                   * (float)terrimpi_terrain_apron_quads(quads, 0);
    memset(&command, 0, sizeof command);
    command.node = chunk;
    command.atlas = h->pair.newest;
    command.slot = slot->rect[h->pair.newest];
    command.clear = command.complete = 1;
    size[0] = command.slot.width;
    size[1] = command.slot.height;
    need(terrimp_capture_fit(&c->box, h->camera.eye, &capture));
    need(terrimp_capture_pad(&capture, size, HESS_MARGIN));
    capture.z_near = fmaxf(capture.z_near * 0.5f, capture.z_near - 1.5f * border);
    capture.z_far += 1.5f * border;
    need(terrimp_capture_matrices(&capture, 0, command.view, command.projection));
    memcpy(command.eye, capture.eye, sizeof command.eye);
    for (i = 0; i < 2; i++) {
        command.clip_min[i] = c->box.min[2 * i] - border;
        command.clip_max[i] = c->box.max[2 * i] + border;
    }
    callbacks->begin_capture(callbacks->user, &command);
    hess_draw_block(h, chunk, callbacks);
    callbacks->end_capture(callbacks->user, &command);
    pair_fill(&h->pair, slot);
    memcpy(c->eye, capture.eye, sizeof c->eye);
    need(terrimp_texture_matrix(&capture, &command.slot, h->atlas_size, h->atlas_size,
                                c->texture_matrix));
}

static void hess_draw_impostor(const hess *h, uint32_t chunk, const terrimp_callbacks *callbacks)
{
    terrimp_impostor_command command;
    terrimp_mesh_info mesh;
    memset(&command, 0, sizeof command);
    need(terrimp_terrain_get_mesh(h->terrain, chunk, &mesh));
    command.node = chunk;
    command.part_count = 1;
    command.atlas = (uint32_t)pair_picture(&h->pair, &h->slots[chunk]);
    command.base_vertex = mesh.base_vertex;
    command.first_index = mesh.first_index;
    command.index_count = mesh.index_count;
    /* Hess 4.4 blends ground over it; here it fades in over the ground. */
    command.alpha = fminf(1.0f, (h->chunks[chunk].closest - h->fade_start)
                                    / (h->fade_end - h->fade_start));
    memcpy(command.eye, h->chunks[chunk].eye, sizeof command.eye);
    memcpy(command.texture_matrix, h->chunks[chunk].texture_matrix, sizeof command.texture_matrix);
    callbacks->draw_impostor(callbacks->user, &command);
}

static void hess_draw_ground(const hess *h, const terrimp_callbacks *callbacks)
{
    terrimp_ground_command ground;
    terrimp_pattern whole;
    uint32_t i;
    memset(&ground, 0, sizeof ground);
    need(terrimp_pattern_find(h->info.chunk_quads, TERRIMP_FORM_LIST, 0, &whole));
    ground.first_index = whole.first_index;
    ground.index_count = whole.index_count;
    for (i = 0; i < h->seen_count && h->chunks[h->seen[i]].closest < h->fade_end; i++) {
        ground.node = h->seen[i];
        callbacks->draw_ground(callbacks->user, &ground);
    }
}

static void hess_render(hess *h, const terrimp_callbacks *callbacks)
{
    uint32_t i;
    for (i = 0; i < h->seen_count; i++)
        if (h->chunks[h->seen[i]].due)
            hess_capture(h, h->seen[i], callbacks);
    hess_draw_ground(h, callbacks);
    for (i = 0; i < h->seen_count; i++)
        if (hess_is_impostor(h, h->seen[i]))
            hess_draw_impostor(h, h->seen[i], callbacks);
}

#endif
