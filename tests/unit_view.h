/* Laws of the view room: what is drawn, how, in which order, from which pictures; checked by brute
   force along flights that do all that a host might do. */
#ifndef UNIT_VIEW_H
#define UNIT_VIEW_H

#include "unit_terrain.h"

/* ---- places: where the nodes of all levels stand ---- */

typedef struct flight_place {
    uint32_t level;
    uint32_t first[2], last[2];   /* samples, both included */
    uint32_t chunk[2], beyond[2]; /* chunks, the last ones not included */
    terrimp_box box;
} flight_place;

static uint32_t smaller_u32(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static flight_place flight_place_of(const land *l, uint32_t node)
{
    flight_place p;
    uint32_t wide = l->info.chunks_x, deep = l->info.chunks_z, at = node;
    memset(&p, 0, sizeof p);
    for (; at >= wide * deep; p.level++) {
        at -= wide * deep;
        wide = (wide + 1u) / 2u;
        deep = (deep + 1u) / 2u;
    }
    p.chunk[0] = (at % wide) << p.level;
    p.chunk[1] = (at / wide) << p.level;
    p.beyond[0] = smaller_u32(p.chunk[0] + (1u << p.level), l->info.chunks_x);
    p.beyond[1] = smaller_u32(p.chunk[1] + (1u << p.level), l->info.chunks_z);
    p.first[0] = p.chunk[0] * l->info.chunk_quads;
    p.first[1] = p.chunk[1] * l->info.chunk_quads;
    p.last[0] = smaller_u32(p.beyond[0] * l->info.chunk_quads, l->desc.field.width - 1u);
    p.last[1] = smaller_u32(p.beyond[1] * l->info.chunk_quads, l->desc.field.depth - 1u);
    CHECK(terrimp_terrain_get_box(l->terrain, node, &p.box) == TERRIMP_OK);
    return p;
}

/* Whether a node lies where a command says. */
static int flight_place_is(const flight_place *p, uint32_t level, uint32_t x, uint32_t z)
{
    return p->level == level && p->chunk[0] == x << level && p->chunk[1] == z << level;
}

/* Whether b has to be drawn before a in an order from front to back. */
static int stands_in_front(const terrimp_box *b, const terrimp_box *a, const float eye[3])
{
    return oracle_cannot_hide(a, b, eye) && !oracle_cannot_hide(b, a, eye);
}

/* ---- a flight: what a host sees of one view ---- */

enum { FLIGHT_CELLS = 10 * 10 }; /* ground nodes that one picture is made of, at most */

enum { FLIGHT_PARTS = 2 };

/* A picture in an atlas, or one part of one in two parts. */
typedef struct flight_picture {
    int alive;           /* begun, and neither overwritten nor forgotten since */
    int complete;
    uint32_t begun;      /* frame */
    uint32_t made;       /* frame of the last piece */
    float light[3];      /* when its first piece was made */
    terrimp_capture_command capture; /* its first piece */
    double area;         /* of ground drawn into it so far [wu^2] */
    uint32_t cells[FLIGHT_CELLS], cell_count;
} flight_picture;

/* What a chunk is drawn as. */
enum { COVER_GROUND = 1, COVER_IMPOSTOR = 2, COVER_FADING = 4 }; /* fading: not all pixels */

typedef struct flight_item {
    uint32_t node;
    int is_impostor;
    terrimp_ground_command ground;
    terrimp_impostor_command impostor;
} flight_item;

/* Everything a host would see of one view, and what the laws need to know. */
typedef struct flight {
    const land *l;
    terrimp_view *view;
    terrimp_view_desc desc; /* resolved */
    terrimp_camera camera;  /* resolved, of this frame; an eye within its reach, which is then 0 */
    float middle[3];        /* the eye of the update */
    int apart;              /* it has another one than the camera */
    float pixel_factor;
    flight_place *places;                /* [node_count] */
    flight_picture *latest, *opened;     /* [node_count][part] complete, and those in pieces */
    uint32_t frame;
    int dropped;            /* the frame before was not rendered */
    uint32_t fails;         /* of so many captures one fails; 0: none */
    float light[3];
    uint32_t hash;
    /* This frame: */
    unsigned char *cover;                /* [chunks] */
    flight_item *items;                  /* [item_capacity] on the screen, as they came */
    uint32_t item_capacity, item_count, ground_count, impostor_count;
    uint32_t capture_count, begun_count, captured_cells, captured_triangles, captured_texels;
    uint32_t triangles, part_count, wanted_parts;
    int in_capture, screen_started, floor_drawn;
    int stage; /* of the screen: ground, impostors, floor, skirts */
    flight_picture *capturing; /* while in_capture */
    terrimp_rect *slots;                 /* [node_count][part] captured in this frame */
    uint32_t *slot_atlas;
    terrimp_stats stats;
    /* All frames: */
    uint32_t total_captures, total_impostors, total_ground, total_waiting, total_pieces;
    uint32_t total_fading, total_high, total_splits, most_captures, total_lost;
    uint32_t total_floor_beside; /* quads */
    uint32_t skirt_triangles;    /* of this frame's screen */
} flight;

static void *flight_array(size_t count, size_t bytes)
{
    void *memory = calloc(count, bytes);
    if (!memory)
        exit(2);
    return memory;
}

/* Rooms for a land's nodes; the view comes later. */
static void flight_prepare(flight *f, const land *l)
{
    uint32_t nodes = l->info.node_count, node;
    memset(f, 0, sizeof *f);
    f->l = l;
    f->hash = 2166136261u;
    f->item_capacity = 3u * nodes;
    f->places = (flight_place *)flight_array(nodes, sizeof *f->places);
    f->latest = (flight_picture *)flight_array(nodes, FLIGHT_PARTS * sizeof *f->latest);
    f->opened = (flight_picture *)flight_array(nodes, FLIGHT_PARTS * sizeof *f->opened);
    f->cover = (unsigned char *)flight_array(nodes, 1);
    f->items = (flight_item *)flight_array(f->item_capacity, sizeof *f->items);
    f->slots = (terrimp_rect *)flight_array(nodes, FLIGHT_PARTS * sizeof *f->slots);
    f->slot_atlas = (uint32_t *)flight_array(nodes, FLIGHT_PARTS * sizeof *f->slot_atlas);
    for (node = 0; node < nodes; node++)
        f->places[node] = flight_place_of(l, node);
}

static void flight_close(flight *f)
{
    terrimp_view_destroy(f->view);
    free(f->places);
    free(f->latest);
    free(f->opened);
    free(f->cover);
    free(f->items);
    free(f->slots);
    free(f->slot_atlas);
}

/* Returns 0, with nothing left to close, when there is no view. */
static int flight_open(flight *f, const land *l, const terrimp_view_desc *desc)
{
    flight_prepare(f, l);
    CHECK(terrimp_view_desc_resolve(l->terrain, desc, &f->desc) == TERRIMP_OK);
    CHECK(terrimp_view_create(l->terrain, desc, NULL, &f->view) == TERRIMP_OK);
    if (!f->view)
        flight_close(f);
    return f->view != NULL;
}

/* No memory of pictures: after the view was told to forget them. */
static void flight_forget(flight *f)
{
    memset(f->latest, 0, f->l->info.node_count * FLIGHT_PARTS * sizeof *f->latest);
    memset(f->opened, 0, f->l->info.node_count * FLIGHT_PARTS * sizeof *f->opened);
}

/* No memory of the frame before. */
static void flight_clear(flight *f)
{
    memset(f->cover, 0, f->l->info.node_count);
    f->item_count = f->ground_count = f->impostor_count = f->triangles = 0;
    f->capture_count = f->begun_count = f->captured_cells = 0;
    f->captured_triangles = f->captured_texels = f->part_count = f->wanted_parts = 0;
    f->in_capture = f->screen_started = f->floor_drawn = f->stage = 0;
    f->skirt_triangles = 0;
}

/* ---- what the callbacks check by themselves: captures ---- */

/* Whatever lay in a slot is gone. */
static void overwrite(const flight *f, flight_picture *pictures, const terrimp_capture_command *c)
{
    uint32_t i;
    for (i = 0; i < f->l->info.node_count * FLIGHT_PARTS; i++)
        if (pictures[i].alive && pictures[i].capture.atlas == c->atlas &&
            rects_overlap(&pictures[i].capture.slot, &c->slot, 0))
            pictures[i].alive = 0;
}

/* Two pieces of one picture differ in nothing but their place among the others. */
static int same_picture(const terrimp_capture_command *a, const terrimp_capture_command *b)
{
    terrimp_capture_command x = *a, y = *b;
    x.clear = y.clear = x.complete = y.complete = 0;
    return memcmp(&x, &y, sizeof x) == 0;
}

/* An eye, or what stands for one that looks along a direction: far away. */
static void flight_stand(const flight *f, const float eye[3], const float forward[3],
                         float stand[3])
{
    const terrimp_box *box = &f->l->info.box;
    int i;
    for (i = 0; i < 3; i++)
        stand[i] = f->camera.orthographic
                       ? 0.5f * (box->min[i] + box->max[i]) - 1e6f * forward[i]
                       : eye[i];
}

/* Whether an eye stands over the ground. */
static int flight_over(const flight *f, const float eye[3])
{
    float ground;
    return terrimp_heightfield_height(&f->l->desc.field, eye[0], eye[2], &ground) == TERRIMP_OK &&
           eye[1] >= ground;
}

static void begin_picture(flight *f, flight_picture *picture,
                          const terrimp_capture_command *command)
{
    uint32_t i;
    overwrite(f, f->latest, command);
    overwrite(f, f->opened, command);
    for (i = 0; i < f->l->info.node_count * FLIGHT_PARTS && !command->complete; i++)
        f->opened[i].alive = 0; /* one picture at a time is made in pieces */
    memset(picture, 0, sizeof *picture);
    picture->alive = 1;
    picture->begun = f->frame;
    memcpy(picture->light, f->light, sizeof picture->light);
    f->begun_count += command->part == 0;
    CHECK(!f->desc.no_lookahead || f->dropped || f->camera.orthographic || f->apart ||
          memcmp(command->eye, f->camera.eye, sizeof command->eye) == 0);
    /* from over the ground none is made from below: it would lack what is seen from behind */
    CHECK(f->camera.orthographic || f->apart || !flight_over(f, f->camera.eye) ||
          flight_over(f, command->eye));
}

/* What a node or all nodes had is gone. */
static void flight_lose(flight *f, uint32_t node)
{
    uint32_t i, first = node == TERRIMP_EVERY_NODE ? 0 : node * FLIGHT_PARTS;
    uint32_t end = node == TERRIMP_EVERY_NODE ? f->l->info.node_count * FLIGHT_PARTS
                                              : first + FLIGHT_PARTS;
    CHECK(terrimp_view_drop(f->view, node) == TERRIMP_OK);
    for (i = first; i < end; i++)
        f->latest[i].alive = f->latest[i].complete = f->opened[i].alive = 0;
    f->total_lost++;
}

/* A host whose captures fail now and then, and sometimes others with them. */
static void flight_fail(flight *f, uint32_t node)
{
    if (f->fails == 0 || random_range(0, f->fails - 1u) > 0)
        return;
    flight_lose(f, node);
    if (random_range(0, 9) == 0)
        flight_lose(f, random_range(0, f->l->info.node_count - 1u));
    if (random_range(0, 29) == 0)
        flight_lose(f, TERRIMP_EVERY_NODE);
}

static void flight_begin_capture(void *user, const terrimp_capture_command *command)
{
    flight *f = (flight *)user;
    flight_picture *picture = &f->opened[command->node * FLIGHT_PARTS + command->part];
    uint32_t i;
    CHECK(!f->in_capture && !f->screen_started);
    CHECK(command->node < f->l->info.node_count && command->atlas < f->desc.atlas_count);
    CHECK(flight_place_is(&f->places[command->node], command->level, command->x, command->z));
    CHECK(command->part < FLIGHT_PARTS);
    CHECK(command->part == 0 || (!f->desc.no_splits && f->desc.mode == TERRIMP_MODE_AUTO));
    CHECK(rect_within(&command->slot, f->desc.atlas_size, f->desc.atlas_size));
    CHECK(command->slot.width > 0 && command->slot.width <= f->desc.max_slot);
    CHECK(command->slot.height > 0 && command->slot.height <= f->desc.max_slot);
    for (i = 0; i < f->capture_count; i++)
        CHECK(f->slot_atlas[i] != command->atlas ||
              !rects_overlap(&f->slots[i], &command->slot, 0));
    f->slots[f->capture_count] = command->slot;
    f->slot_atlas[f->capture_count++] = command->atlas;
    f->captured_texels += command->slot.width * command->slot.height;
    if (command->projection[15] == 0.0f && command->clear) { /* no want of room makes it coarser
                                                                than 0.7 of what is asked for */
        float least = 0.6f * f->desc.texels_per_px * f->pixel_factor;
        CHECK((float)command->slot.width * command->projection[0] > 2.0f * least);
        CHECK((float)command->slot.height * command->projection[5] > 2.0f * least);
    }
    if (command->clear) {
        begin_picture(f, picture, command);
    } else {
        CHECK(picture->alive && same_picture(&picture->capture, command));
        f->total_pieces++;
    }
    f->in_capture = 1;
    f->capturing = picture;
    picture->capture = *command;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
    flight_fail(f, command->node);
}

static void flight_end_capture(void *user, const terrimp_capture_command *command)
{
    flight *f = (flight *)user;
    flight_picture *picture = f->capturing;
    uint32_t at = command->node * FLIGHT_PARTS + command->part;
    CHECK(f->in_capture && memcmp(command, &picture->capture, sizeof *command) == 0);
    f->in_capture = 0;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
    flight_fail(f, command->node);
    if (!command->complete || !picture->alive)
        return;
    picture->complete = 1;
    picture->made = f->frame;
    f->latest[at] = *picture;
    memset(picture, 0, sizeof *picture);
    if (command->part == 0) /* what was split is whole now, until its second part comes */
        memset(&f->latest[at + 1u], 0, sizeof *f->latest);
}

/* Corner i of a range of the shared indices as column and row of the field, for a node. */
static void ground_corner(const flight *f, const flight_place *p, uint32_t i, int64_t corner[2])
{
    uint32_t side = f->l->info.chunk_quads + 1u, index = f->l->patterns[i];
    corner[0] = (int64_t)smaller_u32(p->first[0] + (index % side << p->level), p->last[0]);
    corner[1] = (int64_t)smaller_u32(p->first[1] + (index / side << p->level), p->last[1]);
}

/* Triangles of a range of ground that have an area in the pattern. */
static uint32_t count_pattern(const flight *f, uint32_t first, uint32_t count)
{
    uint32_t i, triangles = 0;
    CHECK(count % 3u == 0 && first + count <= f->l->info.ground_index_count);
    for (i = first; i < first + count; i += 3u) {
        const uint16_t *t = f->l->patterns + i;
        triangles += t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    }
    return triangles;
}

/* Adds the area of a piece of captured ground, and sees that it keeps to the clip rectangle. */
static void add_captured_ground(const flight *f, flight_picture *picture,
                                const terrimp_ground_command *command)
{
    const flight_place *p = &f->places[command->node];
    const terrimp_heightfield *field = &f->l->desc.field;
    const terrimp_capture_command *c = &picture->capture;
    double slack = 1e-5 * (fabs((double)c->clip_min[0]) + fabs((double)c->clip_max[1])) + 1e-4;
    int64_t twice = 0;
    uint32_t i, k;
    for (i = command->first_index; i < command->first_index + command->index_count; i += 3u) {
        int64_t corners[3][2], area;
        for (k = 0; k < 3u; k++) {
            ground_corner(f, p, i + k, corners[k]);
            CHECK((double)land_x(f->l, (uint32_t)corners[k][0]) >= (double)c->clip_min[0] - slack);
            CHECK((double)land_x(f->l, (uint32_t)corners[k][0]) <= (double)c->clip_max[0] + slack);
            CHECK((double)land_z(f->l, (uint32_t)corners[k][1]) >= (double)c->clip_min[1] - slack);
            CHECK((double)land_z(f->l, (uint32_t)corners[k][1]) <= (double)c->clip_max[1] + slack);
        }
        area = twice_area(corners);
        CHECK(area >= 0);
        twice += area;
    }
    picture->area += 0.5 * (double)twice * (double)field->spacing_x * (double)field->spacing_z;
}

/* Ground in a capture: each node once, all of one level, from back to front, as it is. */
static void capture_ground(flight *f, flight_picture *picture,
                           const terrimp_ground_command *command)
{
    float forward[3], eye[3];
    uint32_t i;
    for (i = 0; i < 3u; i++)
        forward[i] = -picture->capture.view[4u * i + 2u];
    flight_stand(f, picture->capture.eye, forward, eye);
    CHECK(command->morph == 0.0f);
    CHECK(command->level <= picture->capture.level);
    CHECK(picture->cell_count < FLIGHT_CELLS);
    for (i = 0; i < picture->cell_count; i++) {
        const flight_place *before = &f->places[picture->cells[i]];
        CHECK(picture->cells[i] != command->node && before->level == command->level);
        CHECK(!stands_in_front(&before->box, &f->places[command->node].box, eye));
    }
    if (picture->cell_count < FLIGHT_CELLS)
        picture->cells[picture->cell_count++] = command->node;
    add_captured_ground(f, picture, command);
    f->captured_triangles += count_pattern(f, command->first_index, command->index_count);
    f->captured_cells++;
}

/* A complete picture has in it all of the terrain within the clip rectangle. */
static void check_captured_area(const flight *f, const flight_picture *picture)
{
    const terrimp_capture_command *c = &picture->capture;
    const terrimp_box *node = &f->places[c->node].box, *all = &f->l->info.box;
    double side[2];
    int k;
    for (k = 0; k < 2; k++) {
        CHECK(c->clip_min[k] <= node->min[2 * k] && c->clip_max[k] >= node->max[2 * k]);
        side[k] = fmin((double)c->clip_max[k], (double)all->max[2 * k]) -
                  fmax((double)c->clip_min[k], (double)all->min[2 * k]);
    }
    CHECK(fabs(picture->area - side[0] * side[1]) < 2e-3 * side[0] * side[1]);
}

/* Whether a node that a picture is made of holds a sample. */
static int picture_has(const flight *f, const flight_picture *picture, uint32_t x, uint32_t z)
{
    uint32_t i;
    for (i = 0; i < picture->cell_count; i++) {
        const flight_place *p = &f->places[picture->cells[i]];
        if (x >= p->first[0] && x <= p->last[0] && z >= p->first[1] && z <= p->last[1])
            return 1;
    }
    return 0;
}

/* A part of a picture has in it all samples of the node within its clip distances, and every sample
   is in one of the parts. */
static void check_captured_parts(const flight *f, const flight_picture parts[FLIGHT_PARTS])
{
    const flight_place *place = &f->places[parts[0].capture.node];
    uint32_t x, z, part;
    for (z = place->first[1]; z <= place->last[1]; z++)
        for (x = place->first[0]; x <= place->last[0]; x++) {
            int shown = 0;
            for (part = 0; part < FLIGHT_PARTS; part++) {
                double p[3], seen[4], clip[4], nearest;
                p[0] = (double)land_x(f->l, x);
                p[1] = (double)land_sample(f->l, x, z);
                p[2] = (double)land_z(f->l, z);
                oracle_transform(parts[part].capture.view, p, seen);
                oracle_transform4(parts[part].capture.projection, seen, clip);
                nearest = f->camera.depth_zero_to_one ? 0.0 : -clip[3];
                if (clip[2] <= nearest || clip[2] >= clip[3])
                    continue;
                shown = 1;
                CHECK(picture_has(f, &parts[part], x, z));
            }
            CHECK(shown);
        }
}

/* What has been made in this frame is whole. */
static void check_captures(const flight *f)
{
    uint32_t node;
    for (node = 0; node < f->l->info.node_count; node++) {
        const flight_picture *parts = &f->latest[node * FLIGHT_PARTS];
        if (!parts[0].complete || parts[0].made != f->frame)
            continue;
        if (!parts[1].complete) {
            check_captured_area(f, parts);
            continue;
        }
        CHECK(parts[1].made == f->frame && parts[1].begun == parts[0].begun);
        CHECK(memcmp(parts[0].capture.eye, parts[1].capture.eye, sizeof parts[0].capture.eye) == 0);
        check_captured_parts(f, parts);
    }
}

/* ---- what the callbacks check by themselves: the screen ---- */

static flight_item *add_item(flight *f, uint32_t node)
{
    flight_item *item = &f->items[f->item_count];
    CHECK(f->item_count < f->item_capacity);
    if (f->item_count + 1u < f->item_capacity)
        f->item_count++;
    memset(item, 0, sizeof *item);
    item->node = node;
    return item;
}

/* Marks the chunks that a node holds. Returns what was marked there before. */
static int cover_chunks(flight *f, uint32_t node, int mark)
{
    const flight_place *p = &f->places[node];
    uint32_t x, z;
    int before = 0;
    for (z = p->chunk[1]; z < p->beyond[1]; z++)
        for (x = p->chunk[0]; x < p->beyond[0]; x++) {
            unsigned char *cover = &f->cover[z * f->l->info.chunks_x + x];
            before |= *cover;
            *cover = (unsigned char)(*cover | mark);
        }
    return before;
}

static void flight_draw_ground(void *user, const terrimp_ground_command *command)
{
    flight *f = (flight *)user;
    flight_item *item;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
    CHECK(command->node < f->l->info.node_count);
    CHECK(flight_place_is(&f->places[command->node], command->level, command->x, command->z));
    if (f->in_capture) {
        capture_ground(f, f->capturing, command);
        return;
    }
    f->screen_started = 1;
    CHECK(f->stage == 0);
    CHECK(command->morph >= 0.0f && command->morph <= 1.0f);
    item = add_item(f, command->node);
    item->ground = *command;
    /* Ground nodes do not overlap. */
    CHECK(!(cover_chunks(f, command->node, COVER_GROUND) & COVER_GROUND));
    f->triangles += count_pattern(f, command->first_index, command->index_count);
    f->ground_count++;
}

/* The texels by which float rounding can move what a row of a texture matrix gives for a point: the
   closer that is to the plane of the eye, the more. */
static double texture_rounding(const float m[16], const double p[3], int row, double size)
{
    double q = fabs((double)m[3] * p[0] + (double)m[7] * p[1] + (double)m[11] * p[2] +
                    (double)m[15]);
    double sums[2], out = fabs((double)m[row] * p[0] + (double)m[row + 4] * p[1] +
                               (double)m[row + 8] * p[2] + (double)m[row + 12]) / q;
    int i;
    for (i = 0; i < 2; i++) {
        int k = i ? 3 : row;
        sums[i] = fabs((double)m[k] * p[0]) + fabs((double)m[k + 4] * p[1]) +
                  fabs((double)m[k + 8] * p[2]) + fabs((double)m[k + 12]);
    }
    return 1.2e-7 * (sums[0] + out * sums[1]) / q * size;
}

/* The texture matrix leads the vertices of the mesh to where the capture put them, in its slot. The
   parts of a picture show all of them. */
static void check_texture(const flight *f, const terrimp_impostor_command *command)
{
    const flight_picture *parts = &f->latest[command->node * FLIGHT_PARTS];
    const terrimp_capture_command *capture = &parts[command->part].capture;
    double size = (double)f->desc.atlas_size;
    float view[16]; /* of positions relative to the eye */
    terrimp_mesh_info mesh;
    uint32_t i, step, part;
    memcpy(view, capture->view, sizeof view);
    view[12] = view[13] = view[14] = 0.0f;
    CHECK(memcmp(command->eye, capture->eye, sizeof command->eye) == 0);
    CHECK(terrimp_terrain_get_mesh(f->l->terrain, command->node, &mesh) == TERRIMP_OK);
    step = mesh.vertex_count / 5u + 1u;
    for (i = 0; i < mesh.vertex_count; i += step) {
        double p[3], seen[4], clip[4], out[4], x, y, depth;
        double rim = 0.01 + 4e-5 * (double)(capture->slot.width + capture->slot.height), rim_y;
        int shown = 0, k;
        oracle_widen(f->l->xyz + (size_t)(command->base_vertex + i) * 3u, p);
        for (k = 0; k < 3; k++)
            p[k] -= (double)command->eye[k];
        oracle_transform(view, p, seen);
        oracle_transform4(capture->projection, seen, clip);
        depth = clip[2] / clip[3]; /* as the picture has it */
        if (!f->camera.depth_zero_to_one)
            depth = 0.5 * depth + 0.5;
        oracle_transform(command->texture_matrix, p, out);
        x = out[0] / out[3] * size - (double)capture->slot.x;
        y = out[1] / out[3] * size - (double)capture->slot.y;
        rim_y = rim + texture_rounding(command->texture_matrix, p, 1, size);
        rim += texture_rounding(command->texture_matrix, p, 0, size);
        CHECK(fabs(x - (clip[0] / clip[3] * 0.5 + 0.5) * (double)capture->slot.width) < rim);
        if (f->camera.rows_from_top)
            clip[1] = -clip[1];
        CHECK(fabs(y - (clip[1] / clip[3] * 0.5 + 0.5) * (double)capture->slot.height) < rim_y);
        if (f->desc.exact_depth) { /* and back */
            double in_atlas[3], place[4];
            in_atlas[0] = out[0] / out[3];
            in_atlas[1] = out[1] / out[3];
            in_atlas[2] = depth;
            oracle_transform(command->place_matrix, in_atlas, place);
            for (k = 0; k < 3; k++)
                CHECK(fabs(place[k] / place[3] + (double)f->middle[k] -
                           (double)command->eye[k] - p[k]) < 2e-3 * out[3] + 1e-4);
        }
        CHECK(x > -rim && x < (double)capture->slot.width + rim);
        CHECK(y > -rim_y && y < (double)capture->slot.height + rim_y);
        for (part = 0; part < command->part_count; part++) {
            oracle_transform4(parts[part].capture.projection, seen, clip);
            shown |= clip[2] < clip[3] &&
                     clip[2] > (f->camera.depth_zero_to_one ? 0.0 : -clip[3]);
        }
        CHECK(shown);
    }
}

static void flight_draw_impostor(void *user, const terrimp_impostor_command *command)
{
    flight *f = (flight *)user;
    terrimp_mesh_info mesh;
    const flight_picture *parts = &f->latest[command->node * FLIGHT_PARTS];
    flight_item *item;
    uint32_t i;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
    f->screen_started = 1;
    CHECK(!f->in_capture && f->stage <= 1);
    f->stage = 1;
    CHECK(command->node < f->l->info.node_count && command->atlas < f->desc.atlas_count);
    CHECK(flight_place_is(&f->places[command->node], command->level, command->x, command->z));
    CHECK(terrimp_terrain_get_mesh(f->l->terrain, command->node, &mesh) == TERRIMP_OK);
    CHECK(command->base_vertex == mesh.base_vertex && command->first_index == mesh.first_index);
    CHECK(command->index_count == mesh.index_count);
    CHECK(command->alpha >= 0.0f && command->alpha <= 1.0f);
    CHECK(command->part < command->part_count && command->part_count <= FLIGHT_PARTS);
    CHECK(command->part_count == 1u + (uint32_t)parts[1].complete);
    f->triangles += command->index_count / 3u;
    f->part_count++;
    /* The picture is the latest of the node, complete, and still whole. */
    CHECK(parts[command->part].alive && parts[command->part].complete &&
          parts[command->part].capture.atlas == command->atlas);
    if (parts[command->part].alive)
        check_texture(f, command);
    if (command->part > 0) { /* it follows the first part */
        CHECK(f->item_count > 0 && f->items[f->item_count - 1u].node == command->node &&
              f->items[f->item_count - 1u].is_impostor);
        return;
    }
    for (i = 0; i < f->item_count; i++)
        CHECK(!f->items[i].is_impostor || f->items[i].node != command->node);
    item = add_item(f, command->node);
    item->is_impostor = 1;
    item->impostor = *command;
    f->wanted_parts += command->part_count;
    cover_chunks(f, command->node, command->alpha < 1.0f ? COVER_FADING : COVER_IMPOSTOR);
    f->total_fading += command->alpha < 1.0f;
    f->impostor_count++;
    f->total_high += command->level > 0;
}

/* Whether the eye is beside the terrain. */
static int flight_beside(const flight *f)
{
    const terrimp_box *box = &f->l->info.box;
    const float *eye = f->camera.eye;
    return eye[0] < box->min[0] || eye[0] > box->max[0] || eye[2] < box->min[2] ||
           eye[2] > box->max[2];
}

/* Where a line from an eye beside the terrain to a place within it comes in, it is over ground. */
static void check_floor_is_behind_ground(const flight *f, const float place[3])
{
    const terrimp_box *box = &f->l->info.box;
    const float *eye = f->camera.eye;
    float in = 0.0f, at[3], ground = 0.0f;
    int k;
    for (k = 0; k < 3; k += 2)
        if (eye[k] < box->min[k] || eye[k] > box->max[k]) {
            float border = eye[k] < box->min[k] ? box->min[k] : box->max[k];
            float way = (border - eye[k]) / (place[k] - eye[k]);
            in = way > in ? way : in;
        }
    for (k = 0; k < 3; k++) {
        at[k] = eye[k] + in * (place[k] - eye[k]);
        if (k != 1)
            at[k] = at[k] < box->min[k] ? box->min[k] : at[k] > box->max[k] ? box->max[k] : at[k];
    }
    CHECK(terrimp_heightfield_height(&f->l->desc.field, at[0], at[2], &ground) == TERRIMP_OK);
    CHECK(at[1] >= ground - 1e-4f * (fabsf(eye[1]) + fabsf(ground)));
}

/* The floor comes once, after all else; or when the eye is beside the terrain parts of it, that are
   nowhere seen below its borders, and then skirts of ground. */
static void flight_draw_floor(void *user, const terrimp_floor_command *command)
{
    flight *f = (flight *)user;
    const land *l = f->l;
    uint32_t base = l->info.node_count * l->info.mesh_vertex_stride, i, k;
    uint32_t end = command->first_index + command->index_count;
    uint32_t skirts = l->info.mesh_index_count - l->info.floor_index_count +
                      terrimpi_floor_of(l->terrain).skirt_index;
    int beside = flight_beside(f) && !f->camera.orthographic;
    int floor_beside = beside && !f->desc.joined && !f->apart;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
    CHECK(!f->in_capture && command->base_vertex == base);
    if (command->first_index >= skirts) {
        CHECK(beside && end <= l->info.mesh_index_count);
        f->stage = 3;
        f->floor_drawn++;
        f->triangles += command->index_count / 3u;
        f->skirt_triangles += command->index_count / 3u;
        return;
    }
    CHECK(f->stage == (f->floor_drawn ? 2 : 1));
    f->stage = 2;
    CHECK(f->impostor_count > 0);
    CHECK(command->first_index >= l->info.mesh_index_count - l->info.floor_index_count);
    CHECK(end <= skirts);
    CHECK(floor_beside || (f->floor_drawn == 0 &&
                           command->index_count == terrimpi_floor_of(l->terrain).skirt_index));
    for (i = command->first_index; floor_beside && l->xyz && i < end; i += 3u) {
        float place[3], share[3];
        for (k = 0; k < 3u; k++)
            share[k] = (float)((i / 3u + k * 5u) % 7u % 4u);
        for (k = 0; k < 3u; k++)
            place[k] = (share[0] * l->xyz[3u * (base + l->indices[i]) + k] +
                        share[1] * l->xyz[3u * (base + l->indices[i + 1u]) + k] +
                        share[2] * l->xyz[3u * (base + l->indices[i + 2u]) + k]) /
                       (share[0] + share[1] + share[2]);
        check_floor_is_behind_ground(f, place);
    }
    f->floor_drawn++;
    f->total_floor_beside += floor_beside ? command->index_count / 6u : 0u;
    f->triangles += command->index_count / 3u;
}

static terrimp_callbacks flight_callbacks(flight *f)
{
    terrimp_callbacks callbacks;
    memset(&callbacks, 0, sizeof callbacks);
    callbacks.user = f;
    callbacks.begin_capture = flight_begin_capture;
    callbacks.end_capture = flight_end_capture;
    callbacks.draw_impostor = flight_draw_impostor;
    callbacks.draw_ground = flight_draw_ground;
    callbacks.draw_floor = flight_draw_floor;
    return callbacks;
}

/* ---- laws of a whole frame ---- */

static int has_impostors(const flight *f)
{
    return f->desc.mode == TERRIMP_MODE_IMPOSTOR || f->desc.mode == TERRIMP_MODE_AUTO;
}

/* Whether a sample lies within the frustum and not on its rim. */
static int in_sight(const flight *f, const terrimp_frustum *frustum, const double p[3],
                    double distance)
{
    double eye[3], slack;
    int k;
    oracle_widen(f->camera.eye, eye);
    slack = 1e-5 * (distance + oracle_length(eye)) + 1e-6;
    for (k = 0; k < 6; k++)
        if (plane_value(frustum, k, p) <= slack)
            return 0;
    return 1;
}

/* A sample in sight is drawn in every chunk that it belongs to: those beside a line have it too. */
static void check_sample(const flight *f, uint32_t x, uint32_t z, double distance)
{
    uint32_t quads = f->l->info.chunk_quads, dx, dz;
    for (dz = 0; dz < 2u; dz++)
        for (dx = 0; dx < 2u; dx++) {
            uint32_t cx, cz;
            int cover;
            if ((dx && x % quads) || (dz && z % quads) || x < dx || z < dz)
                continue;
            cx = (x - dx) / quads;
            cz = (z - dz) / quads;
            if (cx >= f->l->info.chunks_x || cz >= f->l->info.chunks_z)
                continue;
            cover = f->cover[cz * f->l->info.chunks_x + cx];
            CHECK(cover & (COVER_GROUND | COVER_IMPOSTOR));
            CHECK((cover & COVER_GROUND) || f->camera.orthographic ||
                  distance > (double)f->desc.fade_start * (1.0 - 1e-5));
            CHECK(has_impostors(f) || (cover & COVER_GROUND));
        }
}

/* Every sample in sight is drawn, by ground or by an impostor that has all pixels; up to
   fade_start by ground; and the clip distances cut none. */
static void check_nothing_in_sight_is_missing(const flight *f, uint32_t step)
{
    terrimp_frustum frustum;
    uint32_t x, z;
    double eye[3], forward[3];
    CHECK(terrimp_camera_frustum(&f->camera, &frustum) == TERRIMP_OK);
    oracle_widen(f->camera.eye, eye);
    oracle_widen(f->camera.forward, forward);
    for (z = 0; z < f->l->desc.field.depth; z += step)
        for (x = 0; x < f->l->desc.field.width; x += step) {
            double p[3], way[3], distance, depth;
            p[0] = (double)land_x(f->l, x);
            p[1] = (double)land_sample(f->l, x, z);
            p[2] = (double)land_z(f->l, z);
            oracle_between(eye, p, way);
            distance = oracle_length(way);
            if (!in_sight(f, &frustum, p, distance))
                continue;
            check_sample(f, x, z, distance);
            depth = oracle_dot(way, forward);
            CHECK(depth >= (double)f->stats.z_near - 1e-4 * fabs(depth) - 1e-3);
            CHECK(depth <= (double)f->stats.z_far + 1e-4 * fabs(depth) + 1e-3);
        }
}

/* Whether one node is the other, or a part of it, or holds it. */
static int shares_ground(const flight_place *a, const flight_place *b)
{
    return a->chunk[0] < b->beyond[0] && b->chunk[0] < a->beyond[0] &&
           a->chunk[1] < b->beyond[1] && b->chunk[1] < a->beyond[1];
}

/* Impostors are nowhere closer than fade_start. They fade in with the distance of their unit, which
   is no farther away than the node and is the node in mode IMPOSTOR. */
static void check_fades(const flight *f)
{
    float band = f->desc.fade_end - f->desc.fade_start;
    uint32_t i;
    for (i = 0; i < f->item_count; i++) {
        const flight_item *item = &f->items[i];
        const flight_place *place = &f->places[item->node];
        float closest = terrimp_box_distance(&place->box, f->camera.eye), wanted;
        if (!item->is_impostor)
            continue;
        if (f->camera.orthographic) { /* nothing is close */
            CHECK(has_impostors(f) && !(item->impostor.alpha < 1.0f));
            continue;
        }
        wanted = (closest - f->desc.fade_start) / band;
        CHECK(has_impostors(f) && closest >= f->desc.fade_start * 0.9999f);
        CHECK(item->impostor.alpha <= 1.0f && (f->stats.waiting > 0 ||
                                               item->impostor.alpha <= wanted + 1e-4f));
        CHECK(f->desc.mode != TERRIMP_MODE_IMPOSTOR || wanted > 1.0f || f->apart ||
              item->impostor.alpha >= wanted - 1e-4f);
    }
}

/* Nothing is drawn twice, but by ground that fades and the impostors under it, unless something
   waits for its picture and is drawn from those of others. */
static void check_nothing_is_drawn_twice(const flight *f)
{
    uint32_t i, k, chunk;
    if (f->stats.waiting > 0)
        return;
    for (chunk = 0; chunk < f->l->info.chunks_x * f->l->info.chunks_z; chunk++)
        CHECK((f->cover[chunk] & (COVER_GROUND | COVER_IMPOSTOR)) !=
              (COVER_GROUND | COVER_IMPOSTOR));
    for (i = 0; i < f->item_count; i++)
        for (k = i + 1u; k < f->item_count && f->items[i].is_impostor; k++) {
            const flight_place *a = &f->places[f->items[i].node];
            const flight_place *b = &f->places[f->items[k].node];
            if (f->items[k].is_impostor)
                CHECK(!shares_ground(a, b));
        }
}

/* Whether two nodes that share no ground share a part of a side. */
static int shares_side(const flight_place *a, const flight_place *b)
{
    int along_x = a->chunk[0] < b->beyond[0] && b->chunk[0] < a->beyond[0];
    int along_z = a->chunk[1] < b->beyond[1] && b->chunk[1] < a->beyond[1];
    return (along_x && (a->beyond[1] == b->chunk[1] || b->beyond[1] == a->chunk[1])) ||
           (along_z && (a->beyond[0] == b->chunk[0] || b->beyond[0] == a->chunk[0]));
}

/* Ground beside a mesh is not coarser than its border is lifted for: by one level. */
static void check_ground_beside_meshes(const flight *f)
{
    uint32_t i, k;
    for (i = 0; i < f->item_count && f->stats.waiting == 0; i++)
        for (k = 0; k < f->item_count && f->items[i].is_impostor; k++) {
            const flight_place *a = &f->places[f->items[i].node];
            const flight_place *b = &f->places[f->items[k].node];
            if (!f->items[k].is_impostor && shares_side(a, b))
                CHECK(b->level <= a->level + 1u);
        }
}

/* Ground comes from front to back, and so do impostors. */
static void check_front_to_back(const flight *f)
{
    float eye[3];
    uint32_t i, k;
    flight_stand(f, f->middle, f->camera.forward, eye);
    for (i = 0; i < f->item_count; i++)
        for (k = i + 1u; k < f->item_count; k++)
            CHECK(f->items[i].is_impostor != f->items[k].is_impostor ||
                  !stands_in_front(&f->places[f->items[k].node].box,
                                   &f->places[f->items[i].node].box, eye));
}

/* The angle and the parallax of a picture from the present eye, over their limits. */
static double picture_error(const flight *f, uint32_t node, double *angle, double *parallax)
{
    const flight_picture *picture = &f->latest[node * FLIGHT_PARTS];
    const terrimp_box *box = &f->places[node].box;
    terrimp_mesh_info mesh;
    float px = 0.0f;
    CHECK(terrimp_terrain_get_mesh(f->l->terrain, node, &mesh) == TERRIMP_OK);
    if (f->desc.ground_rule == TERRIMP_GEOMIP_PICTURE)
        mesh.error = fminf(mesh.error, 2.0f * mesh.error_rms);
    if (f->camera.orthographic) { /* the same everywhere: |PQ| sin(angle) K */
        double captured[3], forward[3], across[3];
        int k;
        oracle_widen(f->camera.forward, forward);
        for (k = 0; k < 3; k++)
            captured[k] = -(double)picture->capture.view[4 * k + 2];
        oracle_cross(captured, forward, across);
        *angle = asin(fmin(1.0, oracle_length(across)));
        *parallax = oracle_length(across) * (double)mesh.error * (double)f->pixel_factor;
    } else {
        CHECK(terrimp_parallax_error(box, mesh.error, picture->capture.eye, f->camera.eye,
                                     f->pixel_factor, &px) == TERRIMP_OK);
        *angle = oracle_view_angle(box, picture->capture.eye, f->camera.eye);
        *parallax = (double)px;
    }
    return fmax(*angle / (double)f->desc.max_angle_rad,
                *parallax / (double)f->desc.tolerance_px);
}

/* How many pictures are being made in pieces. */
static uint32_t count_opened(const flight *f)
{
    uint32_t node, opened = 0;
    for (node = 0; node < f->l->info.node_count; node++)
        opened += f->opened[node * FLIGHT_PARTS].alive ? 1u : 0u;
    return opened;
}

/* Pictures that are drawn keep to the limits; if some had to be put off, to twice the limits; and
   if they are drawn in place of others that do not exist yet, to four times. */
static void check_pictures_are_good(const flight *f)
{
    double worst_angle = 0.0, worst_parallax = 0.0, most = 1.0;
    uint32_t i;
    if (f->stats.shortfall > 0.0f || count_opened(f) > 0)
        most = 2.0;
    if (f->stats.waiting > 0)
        most = 4.0;
    for (i = 0; i < f->item_count; i++) {
        double angle, parallax, error, limit = most;
        const flight_picture *picture = &f->latest[f->items[i].node * FLIGHT_PARTS];
        if (!f->items[i].is_impostor)
            continue;
        if (picture->begun != picture->made || f->dropped) /* the eye has moved meanwhile */
            limit = fmax(most, 2.0);
        else if (picture->begun == f->frame)
            limit = 1.0;
        error = picture_error(f, f->items[i].node, &angle, &parallax);
        CHECK(error <= limit * 1.002 + 1e-5);
        worst_angle = fmax(worst_angle, angle);
        worst_parallax = fmax(worst_parallax, parallax);
    }
    CHECK((double)f->stats.worst_angle_rad >= worst_angle * (1.0 - 2e-3) - 1e-5);
    CHECK((double)f->stats.worst_parallax_px >= worst_parallax * (1.0 - 2e-3) - 1e-5);
    if (f->apart)
        return;
    CHECK((double)f->stats.worst_angle_rad <= worst_angle * (1.0 + 2e-3) + 5e-5);
    CHECK((double)f->stats.worst_parallax_px <= worst_parallax * (1.0 + 2e-3) + 1e-5 +
              (f->camera.orthographic ? 1e-3 * (double)f->desc.tolerance_px : 0.0));
}

/* A frame keeps to its limits; but one picture, or one piece of a single node, may be larger. */
static void check_limits(const flight *f)
{
    const terrimp_view_desc *d = &f->desc;
    CHECK(f->begun_count <= d->max_captures);
    CHECK(d->max_capture_texels == 0 || f->captured_texels <= d->max_capture_texels ||
          f->begun_count <= 1u);
    CHECK(d->max_capture_triangles == 0 || f->captured_triangles <= d->max_capture_triangles ||
          f->captured_cells <= 1u);
    CHECK(f->ground_count <= d->max_ground && f->impostor_count <= d->max_impostors);
}

/* Where nothing is made, the slots in use are those of pictures that the host has: none is lost. */
static void check_no_slot_is_lost(const flight *f)
{
    double known = 0.0;
    uint32_t i;
    if (f->capture_count > 0 || f->dropped)
        return;
    for (i = 0; i < f->l->info.node_count * FLIGHT_PARTS; i++) {
        const flight_picture *pictures[2];
        int k;
        pictures[0] = &f->latest[i];
        pictures[1] = &f->opened[i];
        for (k = 0; k < 2; k++)
            if (pictures[k]->alive)
                known += (double)pictures[k]->capture.slot.width *
                         (double)pictures[k]->capture.slot.height;
    }
    CHECK((double)f->stats.texels_used <= known);
}

/* The statistics are what the callbacks have seen. */
static void check_stats(flight *f)
{
    const terrimp_stats *s = &f->stats;
    uint32_t by_level[TERRIMP_QUADTREE_LEVELS] = {0}, i;
    double slots = 0.0, all = (double)f->desc.atlas_size * (double)f->desc.atlas_size;
    for (i = 0; i < f->item_count; i++)
        if (f->items[i].is_impostor) {
            const terrimp_rect *slot =
                &f->latest[f->items[i].node * FLIGHT_PARTS].capture.slot;
            by_level[f->items[i].impostor.level]++;
            slots += (double)slot->width * (double)slot->height;
        }
    CHECK(memcmp(by_level, s->impostors_by_level, sizeof by_level) == 0);
    CHECK((s->visible > 0) == (f->item_count > 0));
    CHECK(s->ground == f->ground_count && s->impostors == f->impostor_count);
    CHECK(s->draws == f->ground_count + f->part_count + (uint32_t)f->floor_drawn);
    CHECK(f->part_count == f->wanted_parts);
    CHECK(s->splits <= s->captures);
    CHECK(s->triangles == f->triangles);
    CHECK(s->captures == f->capture_count && s->captured_texels == f->captured_texels);
    CHECK(s->captured_triangles == f->captured_triangles);
    CHECK(s->shortfall >= 0.0f && s->shortfall <= 1.0f && s->reuse >= 0.0f);
    CHECK(s->waiting == 0 || has_impostors(f));
    CHECK((double)s->texels_used >= slots);
    CHECK((double)s->texels_used + (double)s->texels_free == all * (double)f->desc.atlas_count);
    CHECK((s->z_near >= 0.0f || f->camera.orthographic) && s->z_near <= s->z_far);
    CHECK(has_impostors(f) || (s->captures == 0 && s->captures_due == 0 && s->texels_used == 0));
    f->total_captures += f->begun_count;
    f->total_impostors += s->impostors;
    f->total_ground += s->ground;
    f->total_waiting += s->waiting;
    f->total_splits += s->splits;
    f->most_captures = f->begun_count > f->most_captures ? f->begun_count : f->most_captures;
}

/* Draws what the last update decided, and checks all that holds for every frame. */
static void flight_render(flight *f)
{
    terrimp_callbacks callbacks = flight_callbacks(f);
    flight_clear(f);
    memset(&f->stats, 0, sizeof f->stats);
    CHECK(terrimp_view_render(f->view, &callbacks) == TERRIMP_OK);
    CHECK(terrimp_view_get_stats(f->view, &f->stats) == TERRIMP_OK);
    CHECK(!f->in_capture);
    check_captures(f);
    check_stats(f);
    check_no_slot_is_lost(f);
    check_limits(f);
    check_nothing_in_sight_is_missing(f, 3);
    check_fades(f);
    check_nothing_is_drawn_twice(f);
    check_ground_beside_meshes(f);
    check_front_to_back(f);
    check_pictures_are_good(f);
}

static void flight_update(flight *f, const terrimp_camera *camera)
{
    CHECK(terrimp_camera_resolve(camera, &f->camera) == TERRIMP_OK);
    CHECK(terrimp_camera_pixel_factor(&f->camera, &f->pixel_factor) == TERRIMP_OK);
    CHECK(terrimp_view_update(f->view, camera) == TERRIMP_OK);
    memcpy(f->middle, f->camera.eye, sizeof f->middle);
    f->apart = f->camera.reach > 0.0f;
    if (f->apart) {
        float apart[3];
        int k;
        random_vector(0.0f, f->camera.reach, apart);
        for (k = 0; k < 3; k++)
            f->camera.eye[k] += 0.999f * apart[k];
        f->camera.reach = 0.0f;
    }
    f->frame++;
}

/* ---- how to fly ---- */

typedef struct pilot {
    terrimp_camera camera;
    float velocity[3];
    int frame;
    int kind; /* of the camera: 0, or 1 + one of CAMERA_KINDS */
} pilot;

/* Looks at a place of the terrain, or one time in four anywhere. */
static void pilot_turn(pilot *p, const terrimp_box *box)
{
    int k;
    if (random_range(0, 3) == 0)
        random_vector(1.0f, 1.0f, p->camera.forward);
    else
        for (k = 0; k < 3; k++)
            p->camera.forward[k] = random_float(box->min[k], box->max[k]) - p->camera.eye[k];
}

static void pilot_teleport(pilot *p, const terrimp_box *box)
{
    int k;
    for (k = 0; k < 3; k++)
        p->camera.eye[k] = random_float(box->min[k], box->max[k]);
    p->camera.eye[1] += random_float(-20.0f, 150.0f);
    pilot_turn(p, box);
}

/* The camera of the next frame of a flight that does everything a host might do. */
static const terrimp_camera *pilot_next(pilot *p, const land *l)
{
    const terrimp_box *box = &l->info.box;
    float size = fmaxf(box->max[0] - box->min[0], box->max[2] - box->min[2]);
    uint32_t what = random_range(0, 15);
    int k;
    if (p->frame == 0 || what == 0) {
        pilot_teleport(p, box);
    } else if (what == 1) { /* straight down */
        p->camera.forward[0] = p->camera.forward[2] = 0.0f;
        p->camera.forward[1] = -1.0f;
    } else if (what == 2) { /* turn */
        pilot_turn(p, box);
    } else if (what == 3 && random_range(0, 1) == 0) { /* far away, looking back */
        random_vector(3.0f * size, 30.0f * size, p->camera.eye);
        for (k = 0; k < 3; k++)
            p->camera.forward[k] = 0.5f * (box->min[k] + box->max[k]) - p->camera.eye[k];
    } else if (what == 4 && random_range(0, 1) == 0) { /* below the ground */
        p->camera.eye[1] = box->min[1] - random_float(0.0f, 50.0f);
        pilot_turn(p, box);
    } else if (what == 5) { /* stop */
        memset(p->velocity, 0, sizeof p->velocity);
    } else if (what == 6) { /* another way */
        random_vector(0.0f, 0.02f * size, p->velocity);
    } else {
        for (k = 0; k < 3; k++)
            p->camera.eye[k] += p->velocity[k];
    }
    p->camera.width_px = 640;
    p->camera.height_px = 400;
    p->camera.fov_y_rad = p->frame % 16 < 12 ? 0.0f : 0.3f;
    p->camera.z_near = 0.1f;
    p->camera.z_far = 60.0f * size;
    if (p->kind && p->frame % 8 == 0) /* it keeps its sides for some frames */
        camera_become(&p->camera, p->kind - 1, size, 4.0f);
    if (p->kind == 1 + CAMERA_ORTHOGRAPHIC) {
        p->camera.z_near = -2.0f * size;
        if (what > 6 && p->frame % 32 < 16) /* the light moves */
            p->camera.forward[0] += 0.002f * p->camera.forward[2];
    }
    p->frame++;
    return &p->camera;
}

/* An eye beside a land, from where all of it is in sight. */
static terrimp_camera camera_beside(const land *l)
{
    const terrimp_box *box = &l->info.box;
    terrimp_camera camera;
    int k;
    memset(&camera, 0, sizeof camera);
    camera.eye[0] = box->min[0] - 10.0f;
    camera.eye[1] = box->max[1] + 20.0f;
    camera.eye[2] = box->min[2] - 10.0f;
    for (k = 0; k < 3; k++)
        camera.forward[k] = 0.5f * (box->min[k] + box->max[k]) - camera.eye[k];
    camera.width_px = 640;
    camera.height_px = 400;
    camera.z_near = 0.1f;
    camera.z_far = 1e4f;
    return camera;
}

/* A host that edits samples: what shows them is forgotten. */
static void flight_touch(flight *f, uint32_t x, uint32_t z, uint32_t cols, uint32_t rows)
{
    uint32_t node, pass, x1, z1;
    CHECK(terrimp_view_touch(f->view, x, z, cols, rows) == TERRIMP_OK);
    x1 = smaller_u32(x + cols, f->l->desc.field.width) - 1u;
    z1 = smaller_u32(z + rows, f->l->desc.field.depth) - 1u;
    for (pass = 0; pass < 2u; pass++)
        for (node = 0; node < f->l->info.node_count * FLIGHT_PARTS; node++) {
            flight_picture *picture = pass ? &f->opened[node] : &f->latest[node];
            const terrimp_capture_command *c = &picture->capture;
            if (c->clip_min[0] <= land_x(f->l, x1) && c->clip_max[0] >= land_x(f->l, x) &&
                c->clip_min[1] <= land_z(f->l, z1) && c->clip_max[1] >= land_z(f->l, z))
                picture->alive = 0;
        }
}

/* Flies over a land and checks every law in every frame; returns the hash of all commands. The
   flight is closed, but its counts may be read. */
static uint32_t fly_any_and_check(const land *l, const terrimp_view_desc *desc, int frames,
                                  int kind, uint32_t fails, flight *f)
{
    pilot p;
    size_t allocations;
    memset(&p, 0, sizeof p);
    p.kind = kind;
    if (!flight_open(f, l, desc))
        return 0;
    p.camera.depth_zero_to_one = frames & 1;
    p.camera.rows_from_top = frames >> 1 & 1;
    f->fails = fails;
    allocations = unit_allocations;
    while (p.frame < frames) {
        const terrimp_camera *camera = pilot_next(&p, l);
        if (fails && random_range(0, 30) == 0)
            flight_lose(f, random_range(0, l->info.node_count - 1u));
        if (random_range(0, 40) == 0) {
            CHECK(terrimp_view_invalidate(f->view) == TERRIMP_OK);
            flight_forget(f);
        }
        if (random_range(0, 20) == 0)
            flight_touch(f, random_range(0, l->desc.field.width - 1u),
                         random_range(0, l->desc.field.depth - 1u), random_range(1, 9),
                         random_range(1, 9));
        flight_update(f, camera);
        f->dropped = 0;
        if (random_range(0, 15) != 0) /* else a host that drops a frame */
            flight_render(f);
        else
            f->dropped = 1;
    }
    CHECK(unit_allocations == allocations); /* update and render allocate nothing */
    flight_close(f);
    return f->hash;
}

static uint32_t fly_and_check(const land *l, const terrimp_view_desc *desc, int frames, flight *f)
{
    return fly_any_and_check(l, desc, frames, 0, 0, f);
}

/* ---- lands and settings to fly with ---- */

static flight flight_room; /* too large for the stack of a test */

/* The land of most flights. The seed makes a flight independent of the tests before it. */
static void make_hills(land *l)
{
    check_state = 20100611u;
    land_prepare(l, 97, 81, TERRIMP_FORMAT_F32, LAND_HILLS);
    l->desc.chunk_quads = 8;
    l->desc.triangle_budget = 32;
    l->often = 1;
}

static void random_land(land *l)
{
    static const uint32_t sizes[][3] = {/* width, depth, chunk quads */
        {2, 2, 8},  {2, 300, 8},  {50, 3, 4},    {33, 18, 8},  {97, 81, 4},
        {70, 70, 4}, {65, 64, 16}, {130, 67, 10}, {41, 113, 6}, {90, 90, 8}};
    const uint32_t *size = sizes[random_range(0, 9)];
    land_prepare(l, size[0], size[1], TERRIMP_FORMAT_F32, (land_shape)random_range(0, 4));
    l->desc.chunk_quads = size[2];
    l->desc.triangle_budget = random_range(32, 60);
    if (random_range(0, 1)) {
        l->desc.field.origin_x = random_float(-1000.0f, 1000.0f);
        l->desc.field.origin_z = random_float(-1000.0f, 1000.0f);
        l->desc.field.spacing_x = random_float(0.5f, 3.0f);
        l->desc.field.spacing_z = random_float(0.5f, 3.0f);
    }
}

/* Settings with which AUTO draws many impostors of small nodes: pictures are cheap. */
static terrimp_view_desc eager_settings(void)
{
    terrimp_view_desc d;
    memset(&d, 0, sizeof d);
    d.mode = TERRIMP_MODE_AUTO;
    d.ground_tolerance_px = 0.1f;
    d.costs.capture = 20.0f;
    d.costs.draw = 40.0f;
    d.costs.triangle = 4.0f;
    d.costs.ground_px = d.costs.impostor_px = 0.08f;
    return d;
}

/* One setting of two, of random size, is not the default. */
static float maybe(float low, float high)
{
    return random_range(0, 1) ? random_magnitude(low, high) : 0.0f;
}

static uint32_t maybe_u32(uint32_t low, uint32_t high)
{
    return random_range(0, 1) ? random_range(low, high) : 0;
}

static terrimp_view_desc random_settings(int mode)
{
    terrimp_view_desc d;
    memset(&d, 0, sizeof d);
    d.mode = mode;
    d.tolerance_px = maybe(0.1f, 8.0f);
    d.ground_tolerance_px = maybe(0.1f, 8.0f);
    d.ground_rule = (int)random_range(0, TERRIMP_GEOMIP_RULE_COUNT - 1u);
    d.bound = terrimp_geomip_bound();
    d.morph_ratio = random_range(0, 3) ? 0.0f : random_float(1.0f, 3.0f);
    d.fade_start = maybe(2.0f, 100.0f);
    d.fade_end = random_range(0, 1) && d.fade_start > 0.0f
                     ? d.fade_start * random_float(1.01f, 4.0f)
                     : 0.0f;
    d.max_angle_rad = maybe(0.01f, 0.5f);
    d.texels_per_px = maybe(0.2f, 3.0f);
    d.impostor_px = maybe(30.0f, 1000.0f);
    d.atlas_size = random_range(0, 2) ? 0 : random_range(64, 512);
    d.atlas_count = maybe_u32(1, 3);
    d.max_slot = random_range(0, 3) ? 0 : random_range(12, d.atlas_size ? 64 : 256);
    d.max_impostors = random_range(0, 2) ? 0 : random_range(1, 30);
    d.max_captures = maybe_u32(1, 10);
    d.max_capture_texels = maybe_u32(100, 60000);
    d.max_capture_triangles = maybe_u32(50, 3000);
    d.no_lookahead = (int)random_range(0, 1);
    d.no_splits = (int)random_range(0, 1);
    d.no_spreading = (int)random_range(0, 1);
    d.exact_depth = d.no_spreading ? terrimp_view_exact_depth() : NULL;
    d.costs.capture = random_magnitude(0.1f, 1e4f);
    d.costs.draw = maybe(1.0f, 1000.0f);
    d.costs.triangle = maybe(0.5f, 20.0f);
    return d;
}

/* ---- flights ---- */

/* de Boer's demonstration: 257 x 257 samples of a byte in blocks of 17 x 17, and all that changes
   at run time within 32 KiB. Heights and what was built may lie in read-only memory. */
static void the_state_of_a_small_terrain_takes_32_kib(void)
{
    land l;
    terrimp_view_desc d;
    land_prepare(&l, 257, 257, TERRIMP_FORMAT_U8, LAND_HILLS);
    l.desc.chunk_quads = 16;
    memset(&d, 0, sizeof d);
    d.max_impostors = 24;
    d.max_ground = 64;
    d.max_captures = 2;
    d.atlas_size = 256;
    if (land_build(&l)) {
        size_t bytes = terrimp_view_bytes(l.terrain, &d);
        CHECK(bytes > 0 && bytes + terrimp_terrain_open_bytes() <= 32768u);
    }
    land_free(&l);
}

static void view_defaults_are_those_of_the_table(void)
{
    land l;
    terrimp_view_desc d, out;
    land_prepare(&l, 70, 10, TERRIMP_FORMAT_F32, LAND_FLAT);
    l.desc.field.spacing_x = 3.0f;
    l.desc.field.spacing_z = 5.0f;
    memset(&d, 0, sizeof d);
    if (land_build(&l)) {
        CHECK(terrimp_view_desc_resolve(l.terrain, &d, &out) == TERRIMP_OK);
        CHECK(out.mode == TERRIMP_MODE_AUTO && out.ground_rule == TERRIMP_GEOMIP_PICTURE);
        CHECK(out.tolerance_px == 1.0f && out.ground_tolerance_px == 0.5f);
        CHECK(out.morph_ratio == 1.0f && out.impostor_px == 320.0f);
        CHECK(out.fade_start == 2.0f * 64.0f * 5.0f);
        CHECK(same_float(out.fade_end, 1.1f * out.fade_start));
        CHECK(same_float(out.max_angle_rad, 0.0873f) && out.texels_per_px == 2.0f);
        CHECK(out.atlas_size == 4096 && out.atlas_count == 1 && out.max_impostors == 1024);
        CHECK(out.max_ground == 2 && out.max_captures == 64);
        CHECK(out.max_capture_texels == 0 && out.max_capture_triangles == 0);
        CHECK(!out.no_lookahead && !out.no_spreading && !out.no_splits);
        CHECK(out.costs.draw == 40.0f && out.costs.triangle == 1.0f);
        CHECK(out.costs.ground_px == 0.25f && out.costs.impostor_px == 0.25f);
        CHECK(out.costs.capture == 1400.0f);
        d.fade_start = 10.0f;
        d.tolerance_px = 0.06f;
        CHECK(terrimp_view_desc_resolve(l.terrain, &d, &d) == TERRIMP_OK);
        CHECK(d.fade_end == 11.0f && same_float(d.ground_tolerance_px, 0.05f));
    }
    land_free(&l);
}

/* In AUTO the tolerance alone makes pictures coarser: fewer texels, longer lives, closer to the
   eye; what is set stays. Other modes keep Hess' settings. */
static void the_tolerance_rules_the_pictures_of_auto(void)
{
    static const struct {
        float tolerance, sides, texels, angle;
    } rows[] = {{0.1f, 2.0f, 2.0f, 1.0f},        {1.0f, 2.0f, 2.0f, 1.0f},
                {1.6f, 1.25f, 1.581f, 1.265f},   {2.0f, 1.0f, 1.414f, 1.414f},
                {4.0f, 1.0f, 1.0f, 2.0f},        {9.0f, 1.0f, 0.667f, 3.0f},
                {100.0f, 1.0f, 0.667f, 3.0f}};
    land l;
    uint32_t i, mode;
    land_prepare(&l, 70, 70, TERRIMP_FORMAT_F32, LAND_FLAT);
    if (land_build(&l))
        for (mode = 0; mode < TERRIMP_MODE_COUNT; mode++)
            for (i = 0; i < sizeof rows / sizeof *rows; i++) {
                int follows = mode == TERRIMP_MODE_DEFAULT || mode == TERRIMP_MODE_AUTO;
                float side = 64.0f * l.desc.field.spacing_x;
                terrimp_view_desc d, again;
                memset(&d, 0, sizeof d);
                d.mode = (int)mode;
                d.tolerance_px = rows[i].tolerance;
                CHECK(terrimp_view_desc_resolve(l.terrain, &d, &d) == TERRIMP_OK);
                CHECK(fabsf(d.fade_start / side - (follows ? rows[i].sides : 2.0f)) < 1e-3f);
                CHECK(fabsf(d.texels_per_px - (follows ? rows[i].texels : 2.0f)) < 1e-3f);
                CHECK(fabsf(d.max_angle_rad / 0.0873f - (follows ? rows[i].angle : 1.0f)) <
                      1e-3f);
                CHECK(terrimp_view_desc_resolve(l.terrain, &d, &again) == TERRIMP_OK);
                CHECK(memcmp(&d, &again, sizeof d) == 0);
            }
    land_free(&l);
}

/* More chunks than 4096: only GEOMIP and AUTO do with fewer ground nodes. */
static void ground_is_limited_only_where_it_can_be_coarse(void)
{
    land l;
    terrimp_view_desc d, out;
    int mode;
    land_prepare(&l, 4 * 65 + 1, 4 * 65 + 1, TERRIMP_FORMAT_U8, LAND_FLAT);
    l.desc.chunk_quads = 4;
    memset(&d, 0, sizeof d);
    if (land_build(&l))
        for (mode = 0; mode < TERRIMP_MODE_COUNT; mode++) {
            d.mode = mode;
            CHECK(terrimp_view_desc_resolve(l.terrain, &d, &out) == TERRIMP_OK);
            CHECK(out.max_ground ==
                  (mode == TERRIMP_MODE_FULL || mode == TERRIMP_MODE_IMPOSTOR ? 4225u : 4096u));
        }
    land_free(&l);
}

/* As it comes, in every mode, over hills. */
static void flights_keep_every_law(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d;
    land l;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    if (land_build(&l)) {
        (void)fly_and_check(&l, &d, 100, f);
        CHECK(f->total_captures > 20 && f->total_impostors > 40 && f->total_ground > 200);
        d = eager_settings();
        (void)fly_and_check(&l, &d, 101, f);
        CHECK(f->total_captures > 50 && f->total_impostors > 100 && f->total_high > 20);
        memset(&d, 0, sizeof d);
        d.mode = TERRIMP_MODE_IMPOSTOR;
        (void)fly_and_check(&l, &d, 101, f);
        CHECK(f->total_captures > 100 && f->total_impostors > 1000 && f->total_high == 0);
        CHECK(f->total_ground > 200 && f->total_fading > 20);
        d.fade_start = 30.0f;
        d.fade_end = 31.0f;
        d.atlas_size = 512;
        d.max_angle_rad = 0.02f;
        d.tolerance_px = 0.5f;
        (void)fly_and_check(&l, &d, 61, f);
        d.mode = TERRIMP_MODE_FULL;
        (void)fly_and_check(&l, &d, 20, f);
        CHECK(f->total_captures == 0 && f->total_impostors == 0 && f->total_ground > 0);
        d.mode = TERRIMP_MODE_GEOMIP;
        (void)fly_and_check(&l, &d, 40, f);
        CHECK(f->total_captures == 0 && f->total_impostors == 0 && f->total_ground > 0);
    }
    land_free(&l);
}

/* A fade band so short that the eye stands in boxes that want impostors. */
static void flights_with_the_band_inside_boxes_keep_every_law(void)
{
    land l;
    terrimp_view_desc d;
    land_prepare(&l, 65, 65, TERRIMP_FORMAT_F32, LAND_SPIKE);
    l.desc.chunk_quads = 16;
    l.desc.field.spacing_x = 3.0f;
    memset(&d, 0, sizeof d);
    d.fade_start = 2.0f;
    d.fade_end = 3.0f;
    if (land_build(&l)) {
        (void)fly_and_check(&l, &d, 100, &flight_room);
        d.mode = TERRIMP_MODE_IMPOSTOR;
        (void)fly_and_check(&l, &d, 100, &flight_room);
    }
    land_free(&l);
}

/* Every mode over every kind of terrain, with settings of every kind. */
static void flights_with_random_settings_keep_every_law(void)
{
    uint32_t pieces = 0, high = 0, waiting = 0, run;
    for (run = 0; run < check_rounds(32, 96); run++) {
        terrimp_view_desc d;
        land l;
        random_land(&l);
        d = random_settings(run % 4u == 0 ? (int)run / 4 % 2 + TERRIMP_MODE_FULL
                                          : (int)(run % 2u) + TERRIMP_MODE_IMPOSTOR);
        if (land_build(&l))
            (void)fly_and_check(&l, &d, 40, &flight_room);
        pieces += flight_room.total_pieces;
        high += flight_room.total_high;
        waiting += flight_room.total_waiting;
        land_free(&l);
    }
    CHECK(pieces > 3 && high > 50 && waiting > 50);
}

/* Pictures of many nodes, a few triangles a frame: they arrive in pieces. */
static void flights_with_pictures_in_pieces_keep_every_law(void)
{
    static const uint32_t limits[4] = {1, 200, 700, 3000};
    uint32_t pieces = 0, made = 0;
    int run;
    land l;
    terrimp_view_desc d;
    make_hills(&l);
    d = eager_settings();
    if (land_build(&l))
        for (run = 0; run < 8; run++) {
            d.max_capture_triangles = limits[run / 2];
            d.mode = run % 2 ? TERRIMP_MODE_AUTO : TERRIMP_MODE_IMPOSTOR;
            (void)fly_and_check(&l, &d, 50, &flight_room);
            pieces += flight_room.total_pieces;
            made += flight_room.total_captures;
        }
    CHECK(pieces > 100 && made > 100);
    land_free(&l);
}

/* Steep ridges hide what is behind them: pictures in two parts. */
static void flights_with_split_pictures_keep_every_law(void)
{
    land l;
    terrimp_view_desc d;
    uint32_t x, z;
    check_state = 20100611u;
    land_prepare(&l, 129, 129, TERRIMP_FORMAT_F32, LAND_FLAT);
    for (z = 0; z < 129u; z++) /* a plain with ridges along x that meshes can follow */
        for (x = 0; x < 129u; x++)
            l.samples[z * 129u + x] = fmaxf(0.0f, 16.0f - 2.0f * fabsf((float)(z % 32u) - 10.0f)) +
                                      0.1f * (float)(x % 2u); /* ground that is fine */
    l.desc.chunk_quads = 8;
    l.desc.triangle_budget = 100;
    d = eager_settings();
    d.max_angle_rad = 0.5f;
    d.costs.capture = d.costs.impostor_px = 1e-3f;
    d.costs.ground_px = 10.0f;
    d.exact_depth = terrimp_view_exact_depth();
    if (land_build(&l)) {
        (void)fly_and_check(&l, &d, 150, &flight_room);
        CHECK(flight_room.total_splits > 2);
        d.no_splits = 1;
        (void)fly_and_check(&l, &d, 50, &flight_room);
        CHECK(flight_room.total_splits == 0);
    }
    land_free(&l);
}

static void flights_with_few_captures_a_frame_keep_every_law(void)
{
    land l;
    terrimp_view_desc d;
    int mode;
    make_hills(&l);
    d = eager_settings();
    if (land_build(&l))
        for (mode = TERRIMP_MODE_IMPOSTOR; mode <= TERRIMP_MODE_AUTO; mode++) {
            d.mode = mode;
            d.max_capture_texels = 0;
            d.max_captures = 1;
            (void)fly_and_check(&l, &d, 60, &flight_room);
            CHECK(flight_room.total_waiting > 20);
            d.max_captures = 7;
            (void)fly_and_check(&l, &d, 60, &flight_room);
            CHECK(flight_room.total_waiting > 20);
            d.max_captures = 0;
            d.max_capture_texels = 2000;
            (void)fly_and_check(&l, &d, 60, &flight_room);
            CHECK(flight_room.total_waiting > 20);
        }
    land_free(&l);
}

static void flights_with_little_room_keep_every_law(void)
{
    static const uint32_t rooms[][3] = {/* records, atlas size, atlases */
        {0, 64, 1}, {0, 100, 3}, {1, 0, 0}, {11, 0, 0}};
    land l;
    terrimp_view_desc d;
    uint32_t run;
    make_hills(&l);
    d = eager_settings();
    if (land_build(&l))
        for (run = 0; run < 8; run++) {
            d.mode = run / 4u ? TERRIMP_MODE_AUTO : TERRIMP_MODE_IMPOSTOR;
            d.max_impostors = rooms[run % 4u][0];
            d.atlas_size = rooms[run % 4u][1];
            d.atlas_count = rooms[run % 4u][2];
            d.texels_per_px = run % 4u > 1u ? 0.0f : 0.4f; /* so small atlases have room for some */
            (void)fly_and_check(&l, &d, 50, &flight_room);
            CHECK(flight_room.total_captures > 3 && flight_room.total_impostors > 3);
        }
    land_free(&l);
}

/* ---- at rest ---- */

enum { REST_FRAMES = 200 };

/* Rests until a frame captures nothing; returns how many frames that took. */
static int rest(flight *f, const terrimp_camera *camera)
{
    int frames = 0;
    do {
        flight_update(f, camera);
        flight_render(f);
    } while (f->capture_count > 0 && ++frames < REST_FRAMES);
    return frames;
}

/* An eye that rests soon needs no new picture, and nothing waits: not when nothing was updated in
   between, nor when captures are limited. With too few records or too small an atlas all that fits
   is drawn, and no picture is made only to be thrown away. */
static void a_resting_eye_captures_nothing(void)
{
    static const uint32_t limits[][4] = {/* records, atlas size, captures, triangles */
        {0, 0, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 300}, {11, 0, 0, 0}, {0, 64, 0, 0}};
    flight *f = &flight_room;
    terrimp_view_desc d;
    terrimp_camera camera;
    land l;
    int run, frame;
    make_hills(&l);
    d = eager_settings();
    for (run = 0; run < 10 && (l.terrain || land_build(&l)); run++) {
        uint32_t hash = 0;
        d.mode = run < 5 ? TERRIMP_MODE_IMPOSTOR : TERRIMP_MODE_AUTO;
        d.max_impostors = limits[run % 5][0];
        d.atlas_size = limits[run % 5][1];
        d.texels_per_px = limits[run % 5][1] ? 0.1f : 0.0f; /* so that it has room for some */
        d.max_captures = limits[run % 5][2];
        d.max_capture_triangles = limits[run % 5][3];
        camera = camera_beside(&l);
        if (!flight_open(f, &l, &d))
            break;
        CHECK(rest(f, &camera) < REST_FRAMES);
        CHECK(f->impostor_count > 3);
        CHECK(run % 5 > 2 || f->stats.waiting == 0);
        for (frame = 0; frame < 40; frame++) {
            if (frame != 20)
                flight_update(f, &camera);
            f->hash = 1;
            flight_render(f);
            CHECK(f->capture_count == 0);
            CHECK(frame == 0 || hash == f->hash);
            hash = f->hash;
        }
        flight_close(f);
    }
    CHECK(run == 10);
    land_free(&l);
}

/* After every kind of jump and turn the next frame is complete (as all frames are), and after some
   frames of rest nothing waits and all pictures are within the limits. */
static void nothing_waits_after_some_frames_of_rest(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d;
    land l;
    pilot p;
    int run, move;
    make_hills(&l);
    d = eager_settings();
    memset(&p, 0, sizeof p);
    for (run = 0; run < 4 && (l.terrain || land_build(&l)); run++) {
        d.mode = run % 2 ? TERRIMP_MODE_AUTO : TERRIMP_MODE_IMPOSTOR;
        d.max_captures = run / 2 ? 3 : 0;
        if (!flight_open(f, &l, &d))
            break;
        for (move = 0; move < 25; move++) {
            const terrimp_camera *camera = pilot_next(&p, &l);
            CHECK(rest(f, camera) < REST_FRAMES);
            CHECK(f->stats.waiting == 0 && f->stats.captures_due == 0);
        }
        flight_close(f);
    }
    CHECK(run == 4);
    land_free(&l);
}

/* ---- edits ---- */

/* How many samples lie between a node and a rectangle along the axis where they are farthest
   apart. */
static uint32_t samples_between(const flight_place *p, const uint32_t first[2],
                                const uint32_t last[2])
{
    uint32_t most = 0, k;
    for (k = 0; k < 2u; k++) {
        if (first[k] > p->last[k] && first[k] - p->last[k] > most)
            most = first[k] - p->last[k];
        if (p->first[k] > last[k] && p->first[k] - last[k] > most)
            most = p->first[k] - last[k];
    }
    return most;
}

/* At rest, only what was touched is made anew: every picture that shows a touched sample, and none
   that is farther away than its own side. (That what is forgotten is not drawn is checked in every
   frame.) */
static void touch_forgets_what_shows_the_samples_and_little_else(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d;
    terrimp_camera camera;
    land l;
    int i;
    uint32_t node, made = 0, kept = 0;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    d.mode = TERRIMP_MODE_IMPOSTOR;
    if (land_build(&l) && flight_open(f, &l, &d)) {
        camera = camera_beside(&l);
        CHECK(rest(f, &camera) < REST_FRAMES);
        for (i = 0; i < 60; i++) {
            uint32_t first[2], last[2], cols = random_range(1, 12), rows = random_range(1, 12);
            uint32_t before = f->frame;
            first[0] = random_range(0, 96);
            first[1] = random_range(0, 80);
            last[0] = smaller_u32(first[0] + cols, 97) - 1u;
            last[1] = smaller_u32(first[1] + rows, 81) - 1u;
            flight_touch(f, first[0], first[1], cols, rows);
            CHECK(rest(f, &camera) < REST_FRAMES && f->stats.waiting == 0);
            for (node = 0; node < l.info.node_count; node++) {
                const flight_picture *picture = &f->latest[node * FLIGHT_PARTS];
                if (!picture->complete)
                    continue;
                CHECK(picture->alive);
                made += picture->made > before;
                kept += picture->made <= before;
                CHECK(picture->made <= before ||
                      samples_between(&f->places[node], first, last) <= 8u);
            }
        }
        CHECK(made > 60 && kept > 5u * made);
        flight_close(f);
    }
    land_free(&l);
}

/* New settings are those of the next frame; pictures that are good by them stay. */
static void settings_change_without_a_loss(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d, wrong;
    terrimp_horizon horizon;
    terrimp_camera camera;
    uint32_t i;
    land l;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    d.texels_per_px = 2.0f;
    d.fade_start = 16.0f;
    if (land_build(&l) && flight_open(f, &l, &d)) {
        camera = camera_beside(&l);
        CHECK(rest(f, &camera) < REST_FRAMES && f->impostor_count > 0);
        d.tolerance_px = 1.5f; /* all pictures do for a larger one */
        CHECK(terrimp_view_set(f->view, &d) == TERRIMP_OK);
        for (i = 0; i < 3u; i++) {
            CHECK(terrimp_view_update(f->view, &camera) == TERRIMP_OK);
            CHECK(terrimp_view_get_stats(f->view, &f->stats) == TERRIMP_OK);
            CHECK(f->stats.captures == 0 && f->stats.impostors > 0);
        }
        d.mode = TERRIMP_MODE_GEOMIP;
        CHECK(terrimp_view_set(f->view, &d) == TERRIMP_OK);
        wrong = d;
        wrong.atlas_size = 512;
        CHECK(terrimp_view_set(f->view, &wrong) == TERRIMP_E_RANGE);
        wrong = d;
        wrong.mode = TERRIMP_MODE_IMPOSTOR;
        wrong.tolerance_px = -1.0f;
        CHECK(terrimp_view_set(f->view, &wrong) == TERRIMP_E_RANGE);
        wrong = d; /* what the view has no memory for */
        wrong.exact_depth = terrimp_view_exact_depth();
        CHECK(terrimp_view_set(f->view, &wrong) == TERRIMP_E_RANGE);
        wrong = d;
        memset(&horizon, 0, sizeof horizon); /* of no terrain */
        wrong.hider = &horizon.hider;
        CHECK(terrimp_view_set(f->view, &wrong) == TERRIMP_E_RANGE);
        CHECK(terrimp_view_set(f->view, NULL) == TERRIMP_E_NULL);
        CHECK(terrimp_view_set(NULL, &d) == TERRIMP_E_NULL);
        CHECK(terrimp_view_update(f->view, &camera) == TERRIMP_OK);
        CHECK(terrimp_view_get_stats(f->view, &f->stats) == TERRIMP_OK);
        CHECK(f->stats.impostors == 0 && f->stats.ground > 0);
        flight_close(f);
    }
    land_free(&l);
}

static void invalidate_forgets_every_picture(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d;
    terrimp_camera camera;
    land l;
    make_hills(&l);
    d = eager_settings();
    for (d.mode = TERRIMP_MODE_IMPOSTOR; d.mode <= TERRIMP_MODE_AUTO; d.mode++)
        if ((l.terrain || land_build(&l)) && flight_open(f, &l, &d)) {
            camera = camera_beside(&l);
            CHECK(rest(f, &camera) < REST_FRAMES);
            CHECK(f->impostor_count > 3);
            CHECK(terrimp_view_invalidate(f->view) == TERRIMP_OK);
            flight_forget(f);
            flight_update(f, &camera);
            flight_render(f);
            CHECK(f->begun_count > 0);
            CHECK(rest(f, &camera) < REST_FRAMES);
            CHECK(f->impostor_count > 3 && f->stats.waiting == 0);
            flight_close(f);
        }
    land_free(&l);
}

/* What a frame would draw is gone: the host is told to update first, nothing is drawn wrongly. */
static void what_was_forgotten_since_the_update_is_not_drawn(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d;
    terrimp_camera camera;
    terrimp_callbacks callbacks = flight_callbacks(f);
    land l;
    int run;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    d.mode = TERRIMP_MODE_IMPOSTOR;
    d.max_captures = 5;
    for (run = 0; run < 4; run++)
        if ((l.terrain || land_build(&l)) && flight_open(f, &l, &d)) {
            camera = camera_beside(&l);
            if (run & 1)
                CHECK(rest(f, &camera) < REST_FRAMES);
            flight_update(f, &camera);
            if (run & 2)
                flight_touch(f, 0, 0, 97, 81);
            else
                CHECK(terrimp_view_invalidate(f->view) == TERRIMP_OK);
            flight_forget(f);
            flight_clear(f);
            CHECK(terrimp_view_render(f->view, &callbacks) == TERRIMP_E_STATE);
            CHECK(terrimp_view_get_stats(f->view, &f->stats) == TERRIMP_E_STATE);
            CHECK(f->item_count == 0 && f->capture_count == 0);
            CHECK(rest(f, &camera) < REST_FRAMES);
            CHECK(f->impostor_count > 3);
            flight_close(f);
        }
    land_free(&l);
}

/* ---- captures that fail ---- */

/* Captures fail at random, alone or with others: what they should have shown is drawn from others
   or as ground in the same frame, and no picture is worn that was not made; every law holds. */
static void flights_with_failing_captures_keep_every_law(void)
{
    uint32_t lost = 0, drawn = 0, run;
    for (run = 0; run < check_rounds(24, 72); run++) {
        terrimp_view_desc d;
        land l;
        random_land(&l);
        d = run % 3u ? random_settings((int)(run % 2u) + TERRIMP_MODE_IMPOSTOR) : eager_settings();
        if (land_build(&l))
            (void)fly_any_and_check(&l, &d, 40, 0, 1u << run % 4u, &flight_room);
        lost += flight_room.total_lost;
        drawn += flight_room.total_impostors;
        land_free(&l);
    }
    CHECK(lost > 200 && drawn > 200);
}

/* A host whose captures all fail draws ground, and when they succeed again, the same as one whose
   captures never failed: even if what failed was a device that took all pictures along. */
static void a_lost_capture_is_made_again(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d = eager_settings();
    terrimp_camera camera;
    uint32_t impostors, i;
    land l;
    make_hills(&l);
    if (land_build(&l) && flight_open(f, &l, &d)) {
        camera = camera_beside(&l);
        CHECK(rest(f, &camera) < REST_FRAMES);
        impostors = f->impostor_count;
        flight_lose(f, TERRIMP_EVERY_NODE);
        f->fails = 1;
        for (i = 0; i < 5u; i++) {
            flight_update(f, &camera);
            flight_render(f);
            CHECK(f->impostor_count == 0 && f->ground_count > 0 && f->capture_count > 0);
        }
        f->fails = 0;
        CHECK(rest(f, &camera) < REST_FRAMES);
        CHECK(impostors > 3 && f->impostor_count == impostors && f->stats.waiting == 0);
        flight_close(f);
    }
    land_free(&l);
}

/* ---- light that changes ---- */

/* The angle between the light of a picture and that of the frame. */
static double light_angle(const flight *f, uint32_t node)
{
    double a[3], b[3];
    oracle_widen(f->latest[node * FLIGHT_PARTS].light, a);
    oracle_widen(f->light, b);
    return acos(fmin(oracle_dot(a, b) / (oracle_length(a) * oracle_length(b)), 1.0));
}

/* The largest such angle among what is drawn. */
static double worst_light(const flight *f)
{
    double worst = 0.0;
    uint32_t i;
    for (i = 0; i < f->item_count; i++)
        if (f->items[i].is_impostor)
            worst = fmax(worst, light_angle(f, f->items[i].node));
    return worst;
}

/* The sun of a day of so many frames. */
static void set_sun(flight *f, uint32_t frames_a_day, float tolerance)
{
    float turn = 6.2831853f * (float)(f->frame + 1u) / (float)frames_a_day;
    f->light[0] = 3.0f * cosf(turn);
    f->light[1] = 3.0f * sinf(turn);
    f->light[2] = 1.0f;
    CHECK(terrimp_view_light(f->view, f->light, tolerance) == TERRIMP_OK);
}

/* Whatever the sun does, where the schedule has room for it no picture is drawn whose light came
   from farther round than the tolerance. */
static void no_picture_is_older_than_the_light_allows(void)
{
    flight *f = &flight_room;
    uint32_t run, drawn = 0, renewed = 0;
    for (run = 0; run < check_rounds(32, 96); run++) {
        terrimp_view_desc d = eager_settings();
        float tolerance = random_magnitude(0.003f, 0.3f);
        uint32_t day = random_range(100, 5000);
        pilot p;
        land l;
        random_land(&l);
        d.no_spreading = run % 2u;
        d.max_captures = 1024; /* and no other limits */
        d.costs.capture = 0.01f;
        memset(&p, 0, sizeof p);
        if (!land_build(&l) || !flight_open(f, &l, &d))
            break;
        while (p.frame < 80) {
            if (p.frame % 8 == 0)
                (void)pilot_next(&p, &l);
            else
                p.frame++;
            set_sun(f, day, tolerance);
            flight_update(f, &p.camera);
            flight_render(f);
            if (f->stats.shortfall > 0.0f || f->stats.waiting > 0 || count_opened(f) > 0)
                continue;
            CHECK(worst_light(f) <= (double)tolerance * 1.001 + 1e-4);
            drawn += f->impostor_count;
            renewed += f->begun_count;
        }
        flight_close(f);
        land_free(&l);
    }
    CHECK(run == check_rounds(32, 96) && drawn > 500 && renewed > 100);
}

/* A day of 24 minutes at 60 frames a second, eye at rest: few captures, none of them in a crowd,
   and what is worn keeps to the tolerance. */
static void a_day_costs_less_than_half_a_capture_a_frame(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d = eager_settings();
    terrimp_camera camera;
    uint32_t before, frames = 2000, most = 0;
    double worst = 0.0;
    land l;
    make_hills(&l);
    d.fade_start = 8.0f;
    d.impostor_px = 60.0f;
    if (land_build(&l) && flight_open(f, &l, &d)) {
        camera = camera_beside(&l);
        set_sun(f, 86400, 0.0f);
        CHECK(rest(f, &camera) < REST_FRAMES);
        before = f->total_captures;
        while (f->frame < frames) {
            set_sun(f, 86400, 0.0f);
            flight_update(f, &camera);
            flight_render(f);
            worst = fmax(worst, worst_light(f));
            most = f->begun_count > most ? f->begun_count : most;
        }
        printf("  a day of 24 minutes: %u pictures, %.3f captures a frame, at most %u; %.4f of "
               "0.0157 radians\n", (unsigned)f->impostor_count,
               (double)(f->total_captures - before) / frames, (unsigned)most, worst);
        CHECK(f->impostor_count > 20 && f->total_captures - before > frames / 50u);
        CHECK((f->total_captures - before) * 2u < frames && worst < 0.0157 * 1.03);
        CHECK(most * 3u < f->impostor_count);
        flight_close(f);
    }
    land_free(&l);
}

/* Expired pictures are worn until they have been renewed, a few a frame; then none is old. */
static void expired_pictures_are_worn_until_they_are_renewed(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d = eager_settings();
    terrimp_camera camera;
    uint32_t run, i, impostors, since, node;
    land l;
    make_hills(&l);
    d.max_captures = 2;
    d.max_capture_triangles = 700;
    for (run = 0; run < 3u && (l.terrain || land_build(&l)); run++) {
        if (!flight_open(f, &l, &d))
            break;
        camera = camera_beside(&l);
        CHECK(rest(f, &camera) < REST_FRAMES);
        impostors = f->impostor_count;
        for (i = 0; i < run; i++) { /* also while pictures are being made in pieces */
            CHECK(terrimp_view_expire(f->view, TERRIMP_EVERY_NODE) == TERRIMP_OK);
            flight_update(f, &camera);
            flight_render(f);
        }
        since = f->frame;
        node = f->items[f->item_count - 1u].node;
        CHECK(terrimp_view_expire(f->view, run ? TERRIMP_EVERY_NODE : node) == TERRIMP_OK);
        CHECK(terrimp_view_render(f->view, NULL) == TERRIMP_E_NULL); /* but not E_STATE */
        for (i = 0; i < REST_FRAMES; i++) {
            flight_update(f, &camera);
            flight_render(f);
            CHECK(f->impostor_count == impostors && f->stats.waiting == 0);
        }
        for (i = 0; i < f->item_count; i++)
            if (f->items[i].is_impostor)
                CHECK((f->latest[f->items[i].node * FLIGHT_PARTS].begun > since) ==
                      (run > 0 || f->items[i].node == node));
        flight_close(f);
    }
    CHECK(run == 3);
    land_free(&l);
}

/* ---- the cost model ---- */

static void cheap_impostors_are_drawn_wherever_they_may_be(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d;
    terrimp_camera camera;
    land l;
    uint32_t node;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    d.ground_tolerance_px = 0.05f; /* ground nodes are small: each can be an impostor */
    d.costs.draw = d.costs.triangle = d.costs.impostor_px = d.costs.capture = 1e-6f;
    d.costs.ground_px = 1.0f;
    if (land_build(&l) && flight_open(f, &l, &d)) {
        camera = camera_beside(&l);
        CHECK(rest(f, &camera) < REST_FRAMES);
        for (node = 0; node < land_chunks(&l); node++)
            CHECK(terrimp_box_distance(&f->places[node].box, f->camera.eye) < f->desc.fade_end ||
                  f->cover[node] != COVER_GROUND);
        CHECK(f->impostor_count > 3 && f->total_high > 3);
        flight_close(f);
    }
    land_free(&l);
}

static int compare_ground(const void *a, const void *b)
{
    uint32_t x = ((const terrimp_ground_command *)a)->node;
    uint32_t y = ((const terrimp_ground_command *)b)->node;
    return x < y ? -1 : x > y;
}

/* The ground of a frame, sorted by node; to be freed. */
static terrimp_ground_command *sorted_ground(const flight *f)
{
    terrimp_ground_command *ground;
    uint32_t i, count = 0;
    ground = (terrimp_ground_command *)flight_array(f->item_count + 1u, sizeof *ground);
    for (i = 0; i < f->item_count; i++)
        if (!f->items[i].is_impostor)
            ground[count++] = f->items[i].ground;
    qsort(ground, count, sizeof *ground, compare_ground);
    return ground;
}

/* Where captures never pay, AUTO draws what GEOMIP draws, and makes no picture. */
static void dear_captures_leave_only_ground(void)
{
    static flight other;
    terrimp_view_desc d;
    land l;
    pilot p;
    int run, i;
    make_hills(&l);
    for (run = 0; run < 3 && (l.terrain || land_build(&l)); run++) {
        memset(&d, 0, sizeof d);
        memset(&p, 0, sizeof p);
        d.morph_ratio = run == 1 ? 1.5f : 0.0f;
        if (run == 2) /* ground that costs nothing leaves no work to impostors either */
            d.costs.triangle = d.costs.ground_px = d.costs.draw = 1e-6f;
        else
            d.costs.capture = 1e30f;
        CHECK(flight_open(&flight_room, &l, &d));
        d.mode = TERRIMP_MODE_GEOMIP;
        CHECK(flight_open(&other, &l, &d));
        for (i = 0; i < 40; i++) {
            const terrimp_camera *camera = pilot_next(&p, &l);
            terrimp_ground_command *a, *b;
            flight_update(&flight_room, camera);
            flight_render(&flight_room);
            flight_update(&other, camera);
            flight_render(&other);
            a = sorted_ground(&flight_room);
            b = sorted_ground(&other);
            CHECK(flight_room.capture_count == 0 && flight_room.impostor_count == 0);
            CHECK(flight_room.ground_count == other.ground_count);
            CHECK(memcmp(a, b, other.ground_count * sizeof *a) == 0);
            free(a);
            free(b);
        }
        flight_close(&flight_room);
        flight_close(&other);
    }
    CHECK(run == 3);
    land_free(&l);
}

/* With its default costs AUTO is not much dearer than the cheaper one of ground alone and
   impostors alone, by its own currency, over flights that rest now and then. The eye moves by
   `step`, or with a step below 0 jumps; after each `lose` frames all pictures are lost. What is
   learnt at the start, in the first `begin` frames, does not count. */
static double flight_cost(const land *l, int mode, float step, int lose, int begin, int frames,
                          flight *f)
{
    terrimp_view_desc d;
    terrimp_camera camera = camera_beside(l);
    float side = l->info.box.max[0] - l->info.box.min[0], start = camera.eye[0];
    double cost = 0.0;
    int i;
    memset(&d, 0, sizeof d);
    d.mode = mode;
    d.ground_tolerance_px = 0.3f;
    if (!flight_open(f, l, &d))
        return 0.0;
    check_state = 77u;
    for (i = 0; i < begin + frames; i++) {
        camera.eye[0] = step < 0.0f ? start + random_float(0.0f, side)
                                    : start + fmodf((float)(i + 1) * step, side);
        if (lose && i % lose == 0)
            CHECK(terrimp_view_invalidate(f->view) == TERRIMP_OK);
        flight_update(f, &camera);
        flight_render(f);
        if (i < begin)
            continue;
        cost += (double)f->stats.draws * 40.0 + (double)f->stats.triangles;
        cost += (double)f->stats.captures * 1400.0 + (double)f->stats.captured_triangles +
                0.25 * (double)f->stats.captured_texels;
    }
    flight_close(f);
    return cost;
}

static void auto_is_not_dearer_than_ground_or_impostors_alone(void)
{
    land l;
    make_hills(&l);
    if (land_build(&l)) {
        double ground = flight_cost(&l, TERRIMP_MODE_GEOMIP, 0.05f, 0, 0, 120, &flight_room);
        double impostors = flight_cost(&l, TERRIMP_MODE_IMPOSTOR, 0.05f, 0, 0, 120, &flight_room);
        double both = flight_cost(&l, TERRIMP_MODE_AUTO, 0.05f, 0, 0, 120, &flight_room);
        CHECK(both < 1.1 * fmin(ground, impostors));
        CHECK(flight_room.total_impostors > 100);
    }
    land_free(&l);
}

/* Nor is it when pictures do not last: at any speed, with jumps, and however often all are lost. */
static void auto_is_not_dearer_than_ground_where_pictures_do_not_last(void)
{
    static const float steps[] = {0.0f, 0.5f, 3.0f, 9.0f, 17.0f, 30.0f, -1.0f};
    static const int losses[] = {0, 1, 3, 20};
    uint32_t i, k;
    land l;
    make_hills(&l);
    if (land_build(&l))
        for (i = 0; i < sizeof steps / sizeof *steps; i++) {
            double ground = flight_cost(&l, TERRIMP_MODE_GEOMIP, steps[i], 0, 60, 60, &flight_room);
            for (k = 0; k < 4u; k++)
                CHECK(flight_cost(&l, TERRIMP_MODE_AUTO, steps[i], losses[k], 60, 60,
                                  &flight_room) <= 1.1 * ground);
        }
    land_free(&l);
}

/* The one knob over its range: over low hills that are seen at a grazing angle a frame of a larger
   tolerance costs no more, and a picture that may be farther off does not draw more ground: its
   border is for what comes into sight while it lasts, which the angle limits, too. */
static void a_larger_tolerance_is_never_dearer(void)
{
    static const float tolerances[] = {0.25f, 0.5f, 1.0f, 2.0f, 4.0f, 8.0f, 16.0f};
    double last = 1e30, finest = 0.0;
    uint32_t i, x, z;
    int k;
    land l;
    land_prepare(&l, 257, 257, TERRIMP_FORMAT_F32, LAND_FLAT);
    l.desc.chunk_quads = 16;
    for (z = 0; z < 257u; z++)
        for (x = 0; x < 257u; x++)
            l.samples[z * 257u + x] =
                2.0f * sinf((float)x * 0.075f) * cosf((float)z * 0.055f) +
                sinf((float)(x + 2u * z) * 0.025f);
    for (i = 0; (l.terrain || land_build(&l)) && i < sizeof tolerances / sizeof *tolerances; i++) {
        terrimp_camera camera = camera_beside(&l);
        double cost = 0.0, triangles = 0.0, captures = 0.0;
        terrimp_view_desc d;
        memset(&d, 0, sizeof d);
        d.tolerance_px = tolerances[i];
        if (!flight_open(&flight_room, &l, &d))
            break;
        camera.eye[1] = l.info.box.max[1] + 0.5f;
        camera.forward[1] = 0.0f;
        for (k = 0; k < 120; k++) {
            camera.eye[0] = camera.eye[2] = 10.0f + 0.6f * (float)k;
            flight_update(&flight_room, &camera);
            flight_render(&flight_room);
            triangles += (double)flight_room.stats.captured_triangles;
            captures += (double)flight_room.stats.captures;
            cost += (double)flight_room.stats.cost;
        }
        flight_close(&flight_room);
        CHECK(captures > 0.0 && cost < last);
        last = cost;
        finest = i == 0 ? triangles / captures : finest;
        CHECK(triangles < 2.0 * finest * captures);
    }
    CHECK(i == sizeof tolerances / sizeof *tolerances);
    land_free(&l);
}

/* Speed counts over the way that a picture lasts for. An eye that only moves to and fro within that
   way lets it last; a steady one has its own speed; a jump is none. */
static void an_eye_that_bobs_is_not_fast(void)
{
    uint32_t run, i;
    for (run = 0; run < 200u; run++) {
        float reach = random_magnitude(0.1f, 100.0f), swing = reach * random_float(0.01f, 0.45f);
        float often = random_float(0.1f, 1.5f), steady = reach * random_magnitude(0.002f, 0.5f);
        float at = 0.0f, step[3] = {0.0f, 0.0f, 0.0f};
        terrimpi_motion bob, cruise;
        terrimpi_motion_begin(&bob);
        terrimpi_motion_begin(&cruise);
        for (i = 0; i < 1500u; i++) {
            float next = swing * sinf((float)i * often);
            step[0] = next - at;
            terrimpi_motion_step(&bob, step, 1e3f * reach);
            CHECK(i < 300u || terrimpi_motion_speed(&bob, reach) * 100.0f < reach);
            at = next;
            step[0] = i == 200u ? 2e3f * reach : steady;
            terrimpi_motion_step(&cruise, step, 1e3f * reach);
            CHECK(i < 1u || (i >= 200u && i < 1400u) ||
                  fabsf(terrimpi_motion_speed(&cruise, reach) - steady) < 0.02f * steady);
        }
    }
}

/* ---- the ground ---- */

/* GEOMIP draws what terrimp_geomip_select chooses. */
static void geomip_draws_the_selection(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d;
    terrimp_quadtree tree;
    terrimp_geomip_view view;
    float *scratch;
    land l;
    pilot p;
    uint32_t frame, i;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    memset(&p, 0, sizeof p);
    memset(&view, 0, sizeof view);
    d.mode = TERRIMP_MODE_GEOMIP;
    d.ground_tolerance_px = view.tolerance_px = 2.0f;
    d.ground_rule = view.rule = TERRIMP_GEOMIP_BOUND;
    d.bound = terrimp_geomip_bound();
    d.morph_ratio = view.morph_ratio = 1.4f;
    CHECK(terrimp_quadtree_init(&l.desc.field, l.desc.chunk_quads, &tree) == TERRIMP_OK);
    tree.nodes = (terrimp_geomip_node *)flight_array(tree.node_count, sizeof *tree.nodes);
    scratch = (float *)flight_array(tree.field.width + 2u * tree.chunk_quads + 2u, sizeof *scratch);
    CHECK(terrimp_geomip_build(&tree, scratch) == TERRIMP_OK);
    view.distances = (float *)flight_array(tree.node_count, sizeof *view.distances);
    view.marks = (terrimp_geomip_mark *)flight_array(tree.node_count, sizeof *view.marks);
    view.draws = (terrimp_geomip_draw *)flight_array(tree.node_count, sizeof *view.draws);
    view.draw_capacity = tree.node_count;
    if (land_build(&l) && flight_open(f, &l, &d)) {
        for (frame = 0; frame < 40; frame++) {
            const terrimp_camera *camera = pilot_next(&p, &l);
            flight_update(f, camera);
            flight_render(f);
            CHECK(terrimp_geomip_select(&tree, &view, camera) == TERRIMP_OK);
            CHECK(f->item_count == view.draw_count);
            CHECK(f->stats.triangles == view.triangle_count + f->skirt_triangles);
            for (i = 0; i < f->item_count && i < view.draw_count; i++) {
                const terrimp_ground_command *c = &f->items[i].ground;
                terrimp_pattern pattern;
                CHECK(terrimp_pattern_find(tree.chunk_quads, TERRIMP_FORM_LIST,
                                           view.draws[i].pattern, &pattern) == TERRIMP_OK);
                CHECK(c->node == view.draws[i].node.number && c->level == view.draws[i].node.level);
                CHECK(c->first_index == pattern.first_index);
                CHECK(c->index_count == pattern.index_count);
                CHECK(c->morph == view.draws[i].morph);
                CHECK(memcmp(c->side, view.draws[i].side, sizeof c->side) == 0);
                CHECK(memcmp(c->side_coarse, view.draws[i].side_coarse, sizeof c->side) == 0);
            }
        }
        flight_close(f);
    }
    free(tree.nodes);
    free(scratch);
    free(view.distances);
    free(view.marks);
    free(view.draws);
    land_free(&l);
}

/* With few ground nodes allowed the ground becomes coarser, and fine again where they suffice. */
static void scarce_ground_is_coarser_ground(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d;
    terrimp_camera camera;
    land l;
    int i;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    d.max_ground = 30;
    d.ground_tolerance_px = 0.1f;
    for (d.mode = TERRIMP_MODE_GEOMIP; d.mode <= TERRIMP_MODE_AUTO; d.mode++) {
        if (d.mode == TERRIMP_MODE_IMPOSTOR || (!l.terrain && !land_build(&l)) ||
            !flight_open(f, &l, &d))
            continue;
        camera = camera_beside(&l);
        for (i = 0; i < 10; i++) {
            flight_update(f, &camera);
            flight_render(f);
            CHECK(f->stats.ground_tolerance_px > 0.1f && f->stats.ground_tolerance_px <= 1000.0f);
        }
        camera.eye[0] += 5000.0f; /* nothing is in sight */
        for (i = 0; i < 200; i++) {
            flight_update(f, &camera);
            flight_render(f);
        }
        CHECK(same_float(f->stats.ground_tolerance_px, 0.1f));
        flight_close(f);
    }
    land_free(&l);
}

/* FULL and IMPOSTOR need all chunks in sight; where they are too many the frame before stays. */
static void the_frame_before_stays_when_there_are_too_many_chunks(void)
{
    flight *f = &flight_room;
    terrimp_view_desc d;
    terrimp_camera camera, away;
    land l;
    uint32_t first, second, ground;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    d.max_ground = 70;
    for (d.mode = TERRIMP_MODE_FULL; d.mode <= TERRIMP_MODE_IMPOSTOR; d.mode++) {
        if (d.mode == TERRIMP_MODE_GEOMIP || (!l.terrain && !land_build(&l)) ||
            !flight_open(f, &l, &d))
            continue;
        camera = camera_beside(&l);
        CHECK(terrimp_view_update(f->view, &camera) == TERRIMP_E_CAPACITY);
        away = camera;
        away.fov_y_rad = 0.05f;
        (void)rest(f, &away);
        f->hash = 1;
        flight_render(f);
        first = f->hash;
        ground = f->item_count;
        CHECK(ground > 5);
        CHECK(terrimp_view_update(f->view, &camera) == TERRIMP_E_CAPACITY);
        f->hash = 1;
        flight_render(f);
        second = f->hash;
        CHECK(first == second && f->item_count == ground);
        flight_update(f, &away);
        flight_render(f);
        flight_close(f);
    }
    land_free(&l);
}

/* ---- the schedule ---- */

/* An eye that flies straight on over hills. Returns how many pictures that took for each impostor
   drawn, without the first frames. */
static double captures_straight_on(const land *l, const terrimp_view_desc *d, int start,
                                   flight *f)
{
    terrimp_camera camera = camera_beside(l);
    int i;
    if (!flight_open(f, l, d))
        return 0;
    camera.eye[1] = 160.0f;
    camera.forward[1] = -0.2f;
    for (i = 0; i < 300; i++) {
        camera.eye[0] += 0.07f;
        camera.eye[2] += 0.04f;
        flight_update(f, &camera);
        flight_render(f);
        if (i == start)
            f->total_captures = f->most_captures = f->total_impostors = 0;
    }
    flight_close(f);
    return (double)f->total_captures / ((double)f->total_impostors + 1.0);
}

/* Pictures made from ahead of the eye last longer. */
static void lookahead_saves_captures(void)
{
    land l;
    terrimp_view_desc d;
    double with, without;
    int mode;
    make_hills(&l);
    d = eager_settings();
    if (land_build(&l))
        for (mode = TERRIMP_MODE_IMPOSTOR; mode <= TERRIMP_MODE_AUTO; mode++) {
            d.mode = mode;
            d.no_lookahead = 0;
            with = captures_straight_on(&l, &d, 50, &flight_room);
            d.no_lookahead = 1;
            without = captures_straight_on(&l, &d, 50, &flight_room);
            CHECK(with > 0.0 && with < (mode == TERRIMP_MODE_IMPOSTOR ? 0.8 : 1.0) * without);
        }
    land_free(&l);
}

/* Spread captures do not come in bursts, where all pictures are missing neither. */
static void spreading_evens_the_load(void)
{
    land l;
    terrimp_view_desc d;
    uint32_t spread;
    int mode;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    if (land_build(&l))
        for (mode = TERRIMP_MODE_IMPOSTOR; mode <= TERRIMP_MODE_AUTO; mode++) {
            d = eager_settings();
            d.mode = mode;
            d.costs.capture = 1000.0f;
            d.costs.triangle = 20.0f;
            d.max_captures = 1000;
            (void)captures_straight_on(&l, &d, -1, &flight_room);
            spread = flight_room.most_captures;
            d.no_spreading = 1;
            (void)captures_straight_on(&l, &d, -1, &flight_room);
            CHECK(spread > 0 && spread * 3u <= flight_room.most_captures * 2u);
        }
    land_free(&l);
}

/* ---- memory ---- */

/* Same input, same commands: bit for bit. */
static void two_views_give_the_same_commands(void)
{
    land l;
    terrimp_view_desc d;
    uint32_t state, first, second;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    d.atlas_size = 256;
    if (land_build(&l))
        for (d.mode = TERRIMP_MODE_FULL; d.mode < TERRIMP_MODE_COUNT; d.mode++) {
            state = check_state;
            first = fly_and_check(&l, &d, 20, &flight_room);
            check_state = state;
            second = fly_and_check(&l, &d, 20, &flight_room);
            CHECK(first == second && first != 0);
        }
    land_free(&l);
}

enum { VIEW_GUARD = 64 };

/* A view in a block of the exact size that is full of some byte. Returns the block. */
static char *flight_open_in_block(flight *f, const land *l, const terrimp_view_desc *d, int rubbish)
{
    size_t bytes = terrimp_view_bytes(l->terrain, d);
    char *block = (char *)malloc(bytes + VIEW_GUARD + 1u);
    CHECK(block && bytes > 0);
    if (!block)
        exit(2);
    flight_prepare(f, l);
    memset(block, rubbish, bytes);
    memset(block + bytes, UNTOUCHED, VIEW_GUARD);
    CHECK(terrimp_view_init(l->terrain, d, block, bytes - 1u, &f->view) == TERRIMP_E_MEMORY);
    CHECK(terrimp_view_init(l->terrain, d, block + 1, bytes, &f->view) == TERRIMP_E_ALIGN);
    CHECK(f->view == NULL && (rubbish != UNTOUCHED || is_untouched(block, bytes)));
    CHECK(terrimp_view_init(l->terrain, d, block, bytes, &f->view) == TERRIMP_OK);
    CHECK(terrimp_view_desc_resolve(l->terrain, d, &f->desc) == TERRIMP_OK);
    return block;
}

/* Views in blocks of the exact size, full of different rubbish, on one terrain and by turns. */
static void views_keep_to_their_blocks_and_apart(void)
{
    static flight other_room;
    flight *f[2];
    char *block[2];
    land l;
    terrimp_view_desc d;
    int i;
    f[0] = &flight_room;
    f[1] = &other_room;
    make_hills(&l);
    memset(&d, 0, sizeof d);
    d.max_impostors = 77;
    d.atlas_size = 301;
    d.atlas_count = 3;
    if (land_build(&l))
        for (d.mode = TERRIMP_MODE_FULL; d.mode < TERRIMP_MODE_COUNT; d.mode++) {
            pilot p;
            memset(&p, 0, sizeof p);
            for (i = 0; i < 2; i++)
                block[i] = flight_open_in_block(f[i], &l, &d, i ? 0 : UNTOUCHED);
            while (p.frame < 20) {
                const terrimp_camera *camera = pilot_next(&p, &l);
                for (i = 0; i < 2; i++)
                    flight_update(f[i], camera);
                for (i = 0; i < 2; i++)
                    flight_render(f[i]);
                CHECK(f[0]->hash == f[1]->hash);
            }
            for (i = 0; i < 2; i++) {
                CHECK(is_untouched(block[i] + terrimp_view_bytes(l.terrain, &d), VIEW_GUARD));
                flight_close(f[i]); /* the view was not made by create: it is not freed */
                free(block[i]);
            }
        }
    land_free(&l);
}

/* ---- the allocator ---- */

/* An allocator that fails at one call, and knows what is out. */
typedef struct counting_allocator {
    int calls, fail_at, alive;
    size_t bytes;
} counting_allocator;

static void *counting_allocate(void *user, size_t bytes)
{
    counting_allocator *a = (counting_allocator *)user;
    if (++a->calls == a->fail_at)
        return NULL;
    a->alive++;
    a->bytes += bytes;
    return malloc(bytes);
}

static void counting_release(void *user, void *pointer, size_t bytes)
{
    counting_allocator *a = (counting_allocator *)user;
    a->alive--;
    a->bytes -= bytes;
    free(pointer);
}

/* Every allocation fails once: the result says so, nothing leaks, the output is untouched. */
static void create_survives_every_failed_allocation(void)
{
    counting_allocator counter = {0, 0, 0, 0};
    terrimp_allocator allocator;
    terrimp_terrain *terrain = NULL;
    terrimp_view *view = NULL;
    terrimp_view_desc view_desc;
    terrimp_result result = TERRIMP_E_MEMORY;
    land l;
    int failed = 0;
    allocator.user = &counter;
    allocator.allocate = counting_allocate;
    allocator.release = counting_release;
    land_prepare(&l, 20, 20, TERRIMP_FORMAT_F32, LAND_HILLS);
    memset(&view_desc, 0, sizeof view_desc);
    while (result == TERRIMP_E_MEMORY && counter.fail_at < 20) {
        counter.fail_at++;
        counter.calls = 0;
        result = terrimp_terrain_create(&l.desc, &allocator, &terrain);
        CHECK(result == TERRIMP_OK || (result == TERRIMP_E_MEMORY && counter.alive == 0));
        CHECK((result == TERRIMP_OK) == (terrain != NULL));
        failed += result == TERRIMP_E_MEMORY;
    }
    CHECK(result == TERRIMP_OK && failed >= 1 && counter.alive == 1); /* scratch is gone */
    counter.calls = 0;
    counter.fail_at = 1;
    CHECK(terrimp_view_create(terrain, &view_desc, &allocator, &view) == TERRIMP_E_MEMORY);
    CHECK(view == NULL && counter.alive == 1);
    counter.fail_at = 0;
    CHECK(terrimp_view_create(terrain, &view_desc, &allocator, &view) == TERRIMP_OK);
    CHECK(counter.alive == 2);
    terrimp_view_destroy(view);
    terrimp_terrain_destroy(terrain);
    CHECK(counter.alive == 0 && counter.bytes == 0);
    terrimp_view_destroy(NULL);
    terrimp_terrain_destroy(NULL);
    /* A build that fails gives its memory back too. */
    l.samples[7] = (float)NAN;
    terrain = NULL;
    CHECK(terrimp_terrain_create(&l.desc, &allocator, &terrain) == TERRIMP_E_NOT_FINITE);
    CHECK(terrain == NULL && counter.alive == 0);
    land_free(&l);
}

/* Up to 16 atlases of 2^30 texels each. */
static void texels_of_the_largest_atlases_are_counted(void)
{
    land l;
    uint32_t count;
    make_hills(&l);
    if (!land_build(&l))
        return;
    for (count = 1; count <= 16u; count += 5u) {
        terrimp_view_desc d;
        flight *f = &flight_room;
        pilot p;
        memset(&d, 0, sizeof d);
        memset(&p, 0, sizeof p);
        d.mode = TERRIMP_MODE_IMPOSTOR;
        d.atlas_size = 32768;
        d.atlas_count = count;
        if (!flight_open(f, &l, &d))
            break;
        flight_update(f, pilot_next(&p, &l));
        CHECK(terrimp_view_get_stats(f->view, &f->stats) == TERRIMP_OK);
        CHECK(f->stats.texels_used + f->stats.texels_free == (uint64_t)count << 30);
        flight_close(f);
    }
    land_free(&l);
}

/* Orthographic and off-centre cameras, and eyes within reach of one that decides, in every mode. */
static void flights_of_any_camera_keep_every_law(void)
{
    uint32_t impostors[CAMERA_KINDS] = {0}, captures[CAMERA_KINDS] = {0};
    int i;
    for (i = 0; i < 30; i++) {
        land l;
        terrimp_view_desc d = random_settings(i % (TERRIMP_MODE_COUNT - 1) + 1);
        if (i % 4 == 0) {
            make_hills(&l);
            d = eager_settings();
            d.exact_depth = i % 8 / 4 ? terrimp_view_exact_depth() : NULL;
        } else {
            random_land(&l);
        }
        if (land_build(&l)) {
            (void)fly_any_and_check(&l, &d, 40, 1 + i % CAMERA_KINDS, 0, &flight_room);
            impostors[i % CAMERA_KINDS] += flight_room.total_impostors;
            captures[i % CAMERA_KINDS] += flight_room.total_captures;
        }
        land_free(&l);
    }
    for (i = 0; i < CAMERA_KINDS; i++)
        CHECK(impostors[i] > 100u && captures[i] > 20u);
}

/* A light that stands still needs no picture twice, wherever its camera goes. */
static void an_orthographic_camera_that_only_moves_captures_nothing(void)
{
    land l;
    flight *f = &flight_room;
    terrimp_view_desc d = eager_settings();
    terrimp_camera camera;
    int i;
    make_hills(&l);
    if (land_build(&l) && flight_open(f, &l, &d)) {
        camera = camera_beside(&l);
        camera.orthographic = 1;
        camera.z_near = -500.0f;
        camera.sides[1] = camera.sides[3] = 100.0f;
        camera.sides[0] = camera.sides[2] = -100.0f;
        CHECK(rest(f, &camera) < REST_FRAMES && f->impostor_count > 0);
        for (i = 0; i < 20; i++) {
            camera.eye[0] += 3.0f;
            camera.eye[1] -= 2.0f;
            camera.sides[0] += 1.0f;
            camera.sides[1] += 1.0f;
            flight_update(f, &camera);
            flight_render(f);
            CHECK(f->impostor_count > 0 && f->stats.captures_due == 0);
        }
        flight_close(f);
    }
    land_free(&l);
}

/* After an edit and a touch ground is as fine as a new view would have it, at once and after all
   slices; and what the edit does not touch keeps its picture. */
static void edits_reach_the_ground_of_views(void)
{
    land l;
    flight *f = &flight_room;
    terrimp_view_desc d = eager_settings();
    terrimp_camera camera;
    terrimp_rect rect = {20, 24, 9, 9};
    size_t scratch_bytes;
    void *scratch;
    uint32_t x, z, before, done, mode, node, kept;
    make_hills(&l);
    l.often = 0; /* what is opened cannot be edited */
    l.desc.height_low = -100.0f;
    l.desc.height_high = 400.0f;
    if (!land_build(&l)) {
        land_free(&l);
        return;
    }
    scratch_bytes = terrimp_terrain_scratch_bytes(&l.desc);
    scratch = malloc(scratch_bytes);
    camera = camera_beside(&l);
    for (mode = TERRIMP_MODE_GEOMIP; mode <= TERRIMP_MODE_AUTO; mode += 2u) {
        d.mode = (int)mode;
        d.ground_tolerance_px = mode == TERRIMP_MODE_GEOMIP ? 60.0f : 0.1f;
        d.no_spreading = 1; /* else some are renewed early */
        if (!flight_open(f, &l, &d))
            break;
        CHECK(rest(f, &camera) < REST_FRAMES);
        before = f->ground_count;
        for (z = 0; z < 9u; z++)
            for (x = 0; x < 9u; x++)
                l.samples[(24u + z) * 97u + 20u + x] += (x + z) % 2u ? 3.0f : -3.0f;
        CHECK(terrimp_terrain_edit(l.terrain, &rect) == TERRIMP_OK);
        flight_touch(f, rect.x, rect.y, rect.width, rect.height);
        flight_update(f, &camera);
        flight_render(f);
        CHECK(f->ground_count > before);
        for (node = kept = 0; node < l.info.node_count; node++)
            kept += f->latest[node * FLIGHT_PARTS].alive ? 1u : 0u;
        CHECK(kept > 3u || mode == TERRIMP_MODE_GEOMIP);
        CHECK(terrimp_terrain_refine(l.terrain, NULL, l.info.node_count, &done, scratch,
                                     scratch_bytes) == TERRIMP_OK);
        CHECK(done > 2u);
        CHECK(terrimp_terrain_fill_meshes(l.terrain, l.xyz, l.info.mesh_vertex_count * 3u,
                                          l.indices, l.info.mesh_index_count) == TERRIMP_OK);
        before = f->frame;
        CHECK(rest(f, &camera) < REST_FRAMES);
        for (node = 0; node < l.info.node_count; node++) {
            const flight_picture *p = &f->latest[node * FLIGHT_PARTS];
            kept -= p->alive && p->begun <= before ? 1u : 0u;
        }
        CHECK(kept == 0);
        flight_close(f);
    }
    free(scratch);
    land_free(&l);
}

/* Whatever single field of a descriptor is wrong is the one that is named. */
static void the_field_that_is_wrong_is_named(void)
{
    land l;
    const terrimp_view_desc none = {0};
    terrimp_terrain_desc t;
    terrimp_view_desc d;
    terrimp_camera camera;
    make_hills(&l);
    if (!land_build(&l)) {
        land_free(&l);
        return;
    }
#define NAMED(desc, good, field, value, call) \
    desc = good, desc.field = value; \
    CHECK((call) != NULL && strcmp(call, #field) == 0)
    CHECK(terrimp_view_desc_trouble(l.terrain, &none) == NULL);
    NAMED(d, none, tolerance_px, -1.0f, terrimp_view_desc_trouble(l.terrain, &d));
    NAMED(d, none, mode, 99, terrimp_view_desc_trouble(l.terrain, &d));
    NAMED(d, none, max_slot, 8000, terrimp_view_desc_trouble(l.terrain, &d));
    NAMED(d, none, joined, 16, terrimp_view_desc_trouble(l.terrain, &d));
    NAMED(d, none, fade_end, 1e-9f, terrimp_view_desc_trouble(l.terrain, &d));
    NAMED(d, none, max_captures, 4000, terrimp_view_desc_trouble(l.terrain, &d));
    NAMED(d, none, atlas_size, 3, terrimp_view_desc_trouble(l.terrain, &d));
    d = none, d.costs.draw = -1.0f;
    CHECK(strcmp(terrimp_view_desc_trouble(l.terrain, &d), "costs") == 0);
    CHECK(terrimp_terrain_desc_trouble(&l.desc) == NULL);
    NAMED(t, l.desc, chunk_quads, 7, terrimp_terrain_desc_trouble(&t));
    NAMED(t, l.desc, triangle_budget, 7, terrimp_terrain_desc_trouble(&t));
    NAMED(t, l.desc, proud, 7.0f, terrimp_terrain_desc_trouble(&t));
    NAMED(t, l.desc, height_low, 1e30f, terrimp_terrain_desc_trouble(&t));
    t = l.desc, t.field.width = 1;
    CHECK(strcmp(terrimp_terrain_desc_trouble(&t), "width") == 0);
    t = l.desc, t.field.spacing_z = -2.0f;
    CHECK(strcmp(terrimp_terrain_desc_trouble(&t), "spacing_z") == 0);
    t = l.desc, t.field.samples = NULL;
    CHECK(strcmp(terrimp_terrain_desc_trouble(&t), "samples") == 0);
    CHECK(terrimp_camera_trouble(NULL) != NULL);
    camera = camera_beside(&l);
    CHECK(terrimp_camera_trouble(&camera) == NULL);
    camera.height_px = 0;
    CHECK(strcmp(terrimp_camera_trouble(&camera), "height_px") == 0);
    camera = camera_beside(&l), camera.z_far = 0.05f;
    CHECK(strcmp(terrimp_camera_trouble(&camera), "z_far") == 0);
    camera = camera_beside(&l), camera.reach = -1.0f;
    CHECK(strcmp(terrimp_camera_trouble(&camera), "reach") == 0);
#undef NAMED
    land_free(&l);
}

/* Eyes beside the terrain, close and far, low and high: what is drawn of the floor is checked where
   it comes. From over the highest ground nearly all of it is. */
static void the_floor_is_seen_from_beside_behind_ground_alone(void)
{
    flight *f = &flight_room;
    static land l;
    int round, frame, k;
    for (round = 0; round < 4; round++) {
        terrimp_view_desc d;
        uint32_t quads = 0, high_frames = 0;
        land_prepare(&l, random_range(70, 150), random_range(70, 150), TERRIMP_FORMAT_F32,
                     round % 2 ? LAND_NOISE : LAND_HILLS);
        l.desc.chunk_quads = 8u << random_range(0, 1);
        l.desc.field.height_scale = random_float(0.2f, 1.0f);
        memset(&d, 0, sizeof d);
        d.mode = TERRIMP_MODE_IMPOSTOR;
        d.fade_start = 1.0f;
        d.max_angle_rad = 0.2f;
        if (!land_build(&l) || !flight_open(f, &l, &d))
            return;
        for (frame = 0; frame < 60; frame++) {
            const terrimp_box *box = &l.info.box;
            int high = frame % 3 == 0, axis = random_range(0, 1) ? 0 : 2;
            float side = box->max[axis] - box->min[axis], rise = box->max[1] - box->min[1];
            terrimp_camera camera = camera_beside(&l);
            for (k = 0; k < 3; k++)
                camera.eye[k] = random_float(box->min[k] - side, box->max[k] + side);
            camera.eye[axis] = random_range(0, 1)
                                   ? box->min[axis] - random_float(0.01f, 1.0f) * side
                                   : box->max[axis] + random_float(0.01f, 1.0f) * side;
            camera.eye[1] = high ? box->max[1] + 4.0f * (side + rise)
                                 : box->min[1] + random_float(-0.2f, 1.5f) * rise;
            for (k = 0; k < 3; k++)
                camera.forward[k] = 0.5f * (box->min[k] + box->max[k]) - camera.eye[k];
            camera.forward[0] += 0.01f; /* not straight down */
            flight_update(f, &camera);
            flight_render(f);
            high_frames += high && f->impostor_count > 0;
            quads += high ? f->total_floor_beside : 0u;
            f->total_floor_beside = 0;
        }
        CHECK(high_frames > 10);
        CHECK(12u * quads > high_frames * terrimpi_floor_of(l.terrain).skirt_index);
        flight_close(f);
        land_free(&l);
    }
}

static float land_border_sample(const land *l, int side, uint32_t along, uint32_t across)
{
    return terrimpi_field_sample(&l->desc.field, side < 2 ? along : across,
                                 side < 2 ? across : along);
}

/* What is drawn of the border of ground, and of its skirts. */
typedef struct border_frame {
    const land *l;
    terrimp_ground_command ground[2048];
    uint32_t skirts[4096]; /* first indices of triangles */
    uint32_t ground_count, skirt_count;
} border_frame;

static void border_frame_ground(void *user, const terrimp_ground_command *command)
{
    border_frame *b = (border_frame *)user;
    b->ground[b->ground_count++ % 2048u] = *command;
}

static void border_frame_skirts(void *user, const terrimp_floor_command *command)
{
    border_frame *b = (border_frame *)user;
    uint32_t i;
    for (i = 0; i < command->index_count; i += 3u)
        b->skirts[b->skirt_count++ % 4096u] = command->first_index + i;
}

/* How many of the skirts' triangles a ray along an axis, from outside of a side, meets from their
   front: at sample `along` of the outer border, `height` up. */
static uint32_t border_frame_meets(const border_frame *b, int side, uint32_t along, float height)
{
    const land *l = b->l;
    const float *xyz = l->xyz + 3u * l->info.node_count * l->info.mesh_vertex_stride;
    int axis = side < 2 ? 0 : 2, k;
    float border = side & 1 ? l->info.box.max[2 - axis] : l->info.box.min[2 - axis];
    float place = axis ? l->desc.field.origin_z + l->desc.field.spacing_z * (float)along
                       : l->desc.field.origin_x + l->desc.field.spacing_x * (float)along;
    double front = (side < 2) == (side & 1) ? 1.0 : -1.0;
    uint32_t i, met = 0;
    for (i = 0; i < b->skirt_count; i++) {
        double p[3][2], area[3];
        for (k = 0; k < 3; k++) {
            const float *corner = xyz + 3u * l->indices[b->skirts[i] + (uint32_t)k];
            if (fabsf(corner[2 - axis] - border) > 1e-3f)
                break;
            p[k][0] = front * ((double)corner[axis] - (double)place);
            p[k][1] = (double)corner[1] - (double)height;
        }
        if (k < 3)
            continue;
        for (k = 0; k < 3; k++)
            area[k] = p[k][0] * p[(k + 1) % 3][1] - p[(k + 1) % 3][0] * p[k][1];
        met += area[0] >= 0.0 && area[1] >= 0.0 && area[2] >= 0.0 &&
               area[0] + area[1] + area[2] > 0.0;
    }
    return met;
}

/* Whether an eye is over ground of this level behind a segment of an outer border. */
static int border_seen_from(const land *l, int side, uint32_t from, uint32_t to, uint32_t step,
                            const terrimp_camera *camera)
{
    const terrimp_heightfield *f = &l->desc.field;
    uint32_t end = (side < 2 ? f->depth : f->width) - 1u, k;
    double p[4][3], up[3], eye[3];
    for (k = 0; k < 4u; k++) {
        uint32_t along = k & 1u ? to : from, across = k < 2u ? 0u : step < end ? step : end;
        across = side & 1 ? end - across : across;
        p[k][0] = (double)f->origin_x + (double)f->spacing_x * (side < 2 ? along : across);
        p[k][2] = (double)f->origin_z + (double)f->spacing_z * (side < 2 ? across : along);
        p[k][1] = (double)land_border_sample(l, side, along, across);
    }
    for (k = 0; k < 3u; k++)
        eye[k] = (double)camera->eye[k] - p[0][k];
    for (k = 2; k < 4u; k++) {
        double a[3], b[3];
        int c;
        for (c = 0; c < 3; c++) {
            a[c] = p[1][c] - p[0][c];
            b[c] = p[k][c] - p[k & 1u][c];
        }
        for (c = 0; c < 3; c++)
            up[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
        if ((eye[0] * up[0] + eye[1] * up[1] + eye[2] * up[2]) * up[1] > 1e-3 * up[1] * up[1])
            return 1;
    }
    return 0;
}

/* Eyes beside the terrain: wherever coarse ground at an outer border lies over a sample, and the
   eye is over it, a skirt stands between the two; and nowhere else. */
static void skirts_close_the_borders_of_coarse_ground(void)
{
    static border_frame b;
    int round, frame, k;
    uint32_t looked = 0, seen = 0, drawn = 0, i, s;
    for (round = 0; round < 4; round++) {
        static land l;
        terrimp_view_desc d;
        terrimp_view *view;
        terrimp_callbacks draw;
        land_prepare(&l, random_range(70, 150), random_range(70, 150), TERRIMP_FORMAT_F32,
                     round % 2 ? LAND_NOISE : LAND_HILLS);
        l.desc.chunk_quads = 8u << random_range(0, 1);
        l.desc.field.height_scale = random_float(0.05f, 0.3f);
        memset(&d, 0, sizeof d);
        d.mode = TERRIMP_MODE_GEOMIP;
        d.tolerance_px = random_float(2.0f, 16.0f);
        if (!land_build(&l) || terrimp_view_create(l.terrain, &d, NULL, &view) != TERRIMP_OK)
            return;
        memset(&draw, 0, sizeof draw);
        draw.user = &b;
        draw.draw_ground = border_frame_ground;
        draw.draw_floor = border_frame_skirts;
        for (frame = 0; frame < 40; frame++) {
            const terrimp_box *box = &l.info.box;
            terrimp_camera camera = camera_beside(&l);
            int side = (int)random_range(0, 3), axis = side < 2 ? 2 : 0;
            float wide = box->max[axis] - box->min[axis];
            for (k = 0; k < 3; k++)
                camera.eye[k] = random_float(box->min[k], box->max[k]);
            camera.eye[axis] = side & 1 ? box->max[axis] + random_float(0.01f, 3.0f) * wide
                                        : box->min[axis] - random_float(0.01f, 3.0f) * wide;
            for (k = 0; k < 3; k++)
                camera.forward[k] = 0.5f * (box->min[k] + box->max[k]) - camera.eye[k];
            b.l = &l;
            b.ground_count = b.skirt_count = 0;
            CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
            CHECK(terrimp_view_render(view, &draw) == TERRIMP_OK);
            CHECK(b.ground_count <= 2048u && b.skirt_count <= 4096u);
            drawn += b.skirt_count / 2u;
            for (i = 0; i < b.ground_count; i++) {
                const terrimp_ground_command *c = &b.ground[i];
                uint32_t last = (side < 2 ? l.desc.field.width : l.desc.field.depth) - 1u;
                uint32_t across = (side < 2 ? l.desc.field.depth : l.desc.field.width) - 1u;
                uint32_t n = side < 2 ? c->x : c->z, row = side < 2 ? c->z : c->x;
                uint32_t quads = l.desc.chunk_quads << c->level, step = 1u << c->level, to, gap;
                uint32_t end = (n + 1u) * quads < last ? (n + 1u) * quads : last;
                if (side & 1 ? (row + 1u) * quads < across : row > 0u)
                    continue;
                across = side & 1 ? across : 0u;
                for (s = n * quads, gap = 8; s < end && c->level > 0; s += step) {
                    to = s + step < last ? s + step : last;
                    gap = border_seen_from(&l, side, s, to, step, &camera) ? 0u : gap + 1u;
                    seen += gap < 8u;
                }
                for (s = n * quads; s <= end; s++) {
                    uint32_t from = s / step * step;
                    float a = land_border_sample(&l, side, from, across);
                    float at = land_border_sample(&l, side, s, across), chord;
                    to = from + step < last ? from + step : last;
                    chord = a + (land_border_sample(&l, side, to, across) - a) *
                            (float)(s - from) / (float)(to > from ? to - from : 1u);
                    if (chord - at < 1e-4f || !border_seen_from(&l, side, from, to, step, &camera))
                        continue;
                    looked++;
                    CHECK(border_frame_meets(&b, side, s,
                                             at + random_float(0.01f, 0.99f) * (chord - at)));
                }
            }
        }
        terrimp_view_destroy(view);
        land_free(&l);
    }
    CHECK(looked > 500u);
    CHECK(drawn <= seen + seen / 100u && drawn >= seen - seen / 100u);
}

static inline void view_tests(void)
{
    RUN(the_state_of_a_small_terrain_takes_32_kib);
    RUN(view_defaults_are_those_of_the_table);
    RUN(the_tolerance_rules_the_pictures_of_auto);
    RUN(ground_is_limited_only_where_it_can_be_coarse);
    RUN(flights_keep_every_law);
    RUN(flights_with_the_band_inside_boxes_keep_every_law);
    RUN(flights_with_random_settings_keep_every_law);
    RUN(flights_with_pictures_in_pieces_keep_every_law);
    RUN(flights_with_split_pictures_keep_every_law);
    RUN(flights_with_few_captures_a_frame_keep_every_law);
    RUN(flights_with_little_room_keep_every_law);
    RUN(flights_of_any_camera_keep_every_law);
    RUN(an_orthographic_camera_that_only_moves_captures_nothing);
    RUN(the_floor_is_seen_from_beside_behind_ground_alone);
    RUN(skirts_close_the_borders_of_coarse_ground);
    RUN(a_resting_eye_captures_nothing);
    RUN(nothing_waits_after_some_frames_of_rest);
    RUN(touch_forgets_what_shows_the_samples_and_little_else);
    RUN(settings_change_without_a_loss);
    RUN(edits_reach_the_ground_of_views);
    RUN(the_field_that_is_wrong_is_named);
    RUN(invalidate_forgets_every_picture);
    RUN(what_was_forgotten_since_the_update_is_not_drawn);
    RUN(flights_with_failing_captures_keep_every_law);
    RUN(a_lost_capture_is_made_again);
    RUN(no_picture_is_older_than_the_light_allows);
    RUN(a_day_costs_less_than_half_a_capture_a_frame);
    RUN(expired_pictures_are_worn_until_they_are_renewed);
    RUN(cheap_impostors_are_drawn_wherever_they_may_be);
    RUN(dear_captures_leave_only_ground);
    RUN(auto_is_not_dearer_than_ground_or_impostors_alone);
    RUN(auto_is_not_dearer_than_ground_where_pictures_do_not_last);
    RUN(a_larger_tolerance_is_never_dearer);
    RUN(an_eye_that_bobs_is_not_fast);
    RUN(geomip_draws_the_selection);
    RUN(scarce_ground_is_coarser_ground);
    RUN(the_frame_before_stays_when_there_are_too_many_chunks);
    RUN(lookahead_saves_captures);
    RUN(spreading_evens_the_load);
    RUN(two_views_give_the_same_commands);
    RUN(views_keep_to_their_blocks_and_apart);
    RUN(create_survives_every_failed_allocation);
    RUN(texels_of_the_largest_atlases_are_counted);
}

#endif
