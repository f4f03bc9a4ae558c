/* Sorted: painter's order against a depth buffer, cracks, blending, pages, the pace. */
#ifndef UNIT_SORTED_H
#define UNIT_SORTED_H

#include "check.h"
#include "unit_terrain.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static float not_a_number(void)
{
    volatile float zero = 0.0f;
    return zero / zero;
}

/* ---- terrains and frames ---- */

enum { SORTED_SIDE = 513, SORTED_MOST = 40000 };
#ifdef TERRIMP_FIXED /* see tests/compile/fixed.c */
typedef int16_t sorted_sample;
enum { SORTED_STEPS = 256, SORTED_FORMAT = TERRIMP_FORMAT_S16 };
#else
typedef float sorted_sample;
enum { SORTED_STEPS = 1, SORTED_FORMAT = TERRIMP_FORMAT_F32 };
#endif
static sorted_sample sorted_heights[SORTED_SIDE * SORTED_SIDE];
static terrimp_sorted_square sorted_squares[SORTED_MOST];
static uint32_t sorted_count; /* of the squares of the frame that was made last */

/* Hills of many sizes that repeat every 512 samples: first and last column and row are equal. */
static void sorted_make_hills(float height)
{
    static float shape[SORTED_SIDE][SORTED_SIDE]; /* all zero: not made yet */
    int x, z, k, made = shape[1][1] != 0.0f;
    for (z = 0; z < SORTED_SIDE; z++)
        for (x = 0; x < SORTED_SIDE; x++) {
            for (k = 1; k <= 128 && !made; k *= 2) {
                float a = (float)(x % 512 * k) * (6.2831853f / 512.0f);
                float b = (float)(z % 512 * (k * 2 + 1) % 512) * (6.2831853f / 512.0f);
                shape[z][x] +=
                    sinf(a + 1.3f * (float)k + sinf(b)) * sinf(b + 0.7f * (float)k) / (float)k;
            }
            sorted_heights[z * SORTED_SIDE + x] =
                (sorted_sample)(height * shape[z][x] * SORTED_STEPS);
        }
}

static terrimp_sorted_desc sorted_hills(void)
{
    terrimp_sorted_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.field.samples = sorted_heights;
    desc.field.format = SORTED_FORMAT;
    desc.field.height_scale = 1.0f / SORTED_STEPS;
    desc.field.width = desc.field.depth = SORTED_SIDE;
    desc.field.wrap = 1;
    return desc;
}

/* A field of any size cut from the hills, of spacings of its own. */
static terrimp_sorted_desc sorted_piece(void)
{
    terrimp_sorted_desc desc = sorted_hills();
    desc.field.wrap = 0;
    desc.field.row_bytes = SORTED_SIDE * sizeof(sorted_sample);
    desc.field.width = random_range(2, 300);
    desc.field.depth = random_range(2, 300);
    desc.field.spacing_x = random_float(0.5f, 2.0f);
    desc.field.spacing_z = random_float(0.5f, 2.0f);
    desc.field.origin_x = random_float(-300.0f, 300.0f);
    desc.field.origin_z = random_float(-300.0f, 300.0f);
    desc.page_quads = 4u << random_range(0, 5);
    return desc;
}

/* Anywhere above or among the heights, looking anywhere; one in four straight along an axis. */
static terrimp_camera sorted_camera(const terrimp_sorted_desc *desc)
{
    const terrimp_heightfield *f = &desc->field;
    float sx = f->spacing_x > 0.0f ? f->spacing_x : 1.0f;
    float sz = f->spacing_z > 0.0f ? f->spacing_z : 1.0f;
    terrimp_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.eye[0] = f->origin_x + random_float(-0.2f, 1.2f) * sx * (float)f->width;
    camera.eye[1] = random_float(-5.0f, 60.0f);
    camera.eye[2] = f->origin_z + random_float(-0.2f, 1.2f) * sz * (float)f->depth;
    camera.forward[0] = random_float(-1.0f, 1.0f);
    camera.forward[1] = random_float(-0.7f, 0.3f);
    camera.forward[2] = random_float(-1.0f, 1.0f);
    if (random_range(0, 3) == 0)
        camera.forward[random_range(0, 1) * 2] = 0.0f;
    camera.fov_y_rad = random_float(0.3f, 1.6f);
    camera.width_px = 64;
    camera.height_px = 48;
    camera.z_near = 0.05f;
    camera.z_far = random_float(50.0f, 600.0f);
    return camera;
}

/* Makes a frame, in pieces of odd sizes. */
static void sorted_frame(terrimp_sorted *s, const terrimp_camera *camera)
{
    uint32_t got, capacity;
    sorted_count = 0;
    CHECK(terrimp_sorted_begin(s, camera) == TERRIMP_OK);
    do {
        capacity = random_range(1, 50);
        got = terrimp_sorted_next(s, sorted_squares + sorted_count, capacity);
        sorted_count += got;
    } while (got == capacity && sorted_count + 50 < SORTED_MOST);
    CHECK(got < capacity);
}

/* ---- order ---- */

enum { ORDER_WIDE = 64, ORDER_HIGH = 48 };
static double order_nearest[ORDER_WIDE * ORDER_HIGH]; /* 1 / depth: with a depth buffer */
static double order_shown[ORDER_WIDE * ORDER_HIGH];   /* and of what was drawn last */

/* One side of a clipped triangle's plane before the eye. */
static int order_clip(double in[3][3], double out[4][3], double z_near)
{
    int i, k, count = 0;
    for (i = 0; i < 3; i++) {
        const double *a = in[i], *b = in[(i + 1) % 3];
        if (a[2] >= z_near)
            memcpy(out[count++], a, sizeof out[0]);
        if ((a[2] >= z_near) != (b[2] >= z_near)) {
            double t = (z_near - a[2]) / (b[2] - a[2]);
            for (k = 0; k < 3; k++)
                out[count][k] = a[k] + (b[k] - a[k]) * t;
            count++;
        }
    }
    return count;
}

/* Fills the pixels of a triangle of x / depth, y / depth, 1 / depth; either side shows. */
static void order_fill(const double a[3], const double b[3], const double c[3], int reversed)
{
    double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    double left = fmin(a[0], fmin(b[0], c[0])), right = fmax(a[0], fmax(b[0], c[0]));
    double top = fmin(a[1], fmin(b[1], c[1])), end = fmax(a[1], fmax(b[1], c[1]));
    int x, y;
    if (!(fabs(area) > 1e-12) || right < 0 || left > ORDER_WIDE || end < 0 || top > ORDER_HIGH)
        return;
    for (y = (int)fmax(top, 0); y < ORDER_HIGH && y <= end; y++)
        for (x = (int)fmax(left, 0); x < ORDER_WIDE && x <= right; x++) {
            double px = x + 0.5, py = y + 0.5, depth;
            double u = ((px - a[0]) * (c[1] - a[1]) - (py - a[1]) * (c[0] - a[0])) / area;
            double v = ((b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])) / area;
            if (u < 0 || v < 0 || u + v > 1)
                continue;
            depth = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]);
            if (depth > order_nearest[y * ORDER_WIDE + x])
                order_nearest[y * ORDER_WIDE + x] = depth;
            if (!reversed || order_shown[y * ORDER_WIDE + x] == 0.0)
                order_shown[y * ORDER_WIDE + x] = depth;
        }
}

/* What is drawn, and from where. */
typedef struct order_picture {
    float view[16], projection[16], eye[3];
    int reversed, hides_back; /* front to back; only counter-clockwise triangles show */
} order_picture;

static void order_begin(void)
{
    int k;
    for (k = 0; k < ORDER_WIDE * ORDER_HIGH; k++)
        order_nearest[k] = order_shown[k] = 0.0;
}

static void order_triangle(const order_picture *p, const float *corners[3])
{
    double eyes[3][3], cut[4][3];
    int n, j, k;
    for (k = 0; k < 3; k++) {
        double d[3];
        for (j = 0; j < 3; j++)
            d[j] = (double)corners[k][j] - (double)p->eye[j];
        for (j = 0; j < 3; j++)
            eyes[k][j] = (double)p->view[j] * d[0] + (double)p->view[4 + j] * d[1] +
                         (double)p->view[8 + j] * d[2];
        eyes[k][2] = -eyes[k][2];
    }
    n = order_clip(eyes, cut, 0.05);
    for (k = 0; k < n; k++) {
        double w = cut[k][2];
        cut[k][0] = ORDER_WIDE / 2 *
                    (1.0 + (double)p->projection[0] * cut[k][0] / w - (double)p->projection[8]);
        cut[k][1] = ORDER_HIGH / 2 *
                    (1.0 - (double)p->projection[5] * cut[k][1] / w + (double)p->projection[9]);
        cut[k][2] = 1.0 / w;
    }
    if (n > 2 && p->hides_back &&
        (cut[1][0] - cut[0][0]) * (cut[2][1] - cut[0][1]) >=
            (cut[1][1] - cut[0][1]) * (cut[2][0] - cut[0][0]))
        return;
    for (k = 2; k < n; k++)
        order_fill(cut[0], cut[k - 1], cut[k], p->reversed);
}

/* Returns the pixels that show what is not nearest. */
static int order_end(int *seen)
{
    int k, faults = 0;
    for (k = 0; k < ORDER_WIDE * ORDER_HIGH; k++) {
        faults += order_shown[k] < order_nearest[k] * (1.0 - 1e-7);
        *seen += order_shown[k] > 0.0;
    }
    return faults;
}

/* Draws the frame that was made and returns its faults. */
static int order_faults(const terrimp_sorted *s, const terrimp_camera *camera, int *seen)
{
    order_picture p;
    uint32_t i;
    int t, k;
    memset(&p, 0, sizeof p);
    CHECK(terrimp_camera_matrices(camera, p.view, p.projection) == TERRIMP_OK);
    memcpy(p.eye, camera->eye, sizeof p.eye);
    p.reversed = s->desc.front_to_back;
    order_begin();
    for (i = 0; i < sorted_count; i++)
        for (t = 0; t < sorted_squares[i].triangle_count; t++) {
            float at[3][3];
            const float *corners[3];
            for (k = 0; k < 3; k++) {
                terrimp_sorted_position(s, &sorted_squares[i].vertices
                                               [sorted_squares[i].indices[3 * t + k]], at[k]);
                corners[k] = at[k];
            }
            order_triangle(&p, corners);
        }
    return order_end(seen);
}

static void sorted_needs_no_depth_buffer(void)
{
    int i, faults = 0, seen = 0;
    sorted_make_hills(8.0f);
    for (i = 0; i < 1000; i++) {
        terrimp_sorted_desc desc = i % 2 ? sorted_hills() : sorted_piece();
        terrimp_sorted s;
        terrimp_camera camera;
        desc.front_to_back = i % 3 == 0;
        desc.scale = random_float(2.0f, 12.0f);
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        camera = sorted_camera(&s.desc);
        sorted_frame(&s, &camera);
        faults += order_faults(&s, &camera, &seen);
    }
    CHECK(faults == 0);
    CHECK(seen > 1000 * ORDER_WIDE * ORDER_HIGH / 10);
}

enum { TILE = 1153 }; /* 18 pages of 64 quads */
static int16_t tile_samples[TILE * TILE];

/* The first samples of a tile of elevation, the last column and row once more the first ones: with
   a cliff at the seam it can repeat. Returns 0 when it is not at hand. */
static int sorted_read_tile(const char *name)
{
    const char *folder = getenv("TERRIMP_DATA");
    char path[512];
    uint8_t bytes[2];
    FILE *file;
    long x, z, side = 1201;
    snprintf(path, sizeof path, "%s/%s", folder ? folder : "../shared/data", name);
    file = fopen(path, "rb");
    if (!file) {
        SKIP(path);
        return 0;
    }
    fseek(file, 0, SEEK_END);
    side = ftell(file) > 2 * 3601 * 3600 ? 3601 : side;
    for (z = 0; z < TILE; z++) {
        fseek(file, 2 * side * (z % (TILE - 1)), SEEK_SET);
        for (x = 0; x < TILE - 1; x++) {
            int16_t *sample = &tile_samples[z * TILE + x];
            int value = fread(bytes, 1, 2, file) == 2 ? bytes[0] << 8 | bytes[1] : 0x8000;
            *sample = (int16_t)(value > 32767 ? value - 65536 : value);
            if (value == 0x8000)
                *sample = x ? sample[-1] : 0;
        }
        tile_samples[z * TILE + x] = tile_samples[z * TILE];
    }
    fclose(file);
    return 1;
}

static terrimp_camera sorted_tile_camera(const terrimp_heightfield *field)
{
    terrimp_sorted_desc place;
    terrimp_camera camera;
    float ground = 0.0f;
    memset(&place, 0, sizeof place);
    place.field = *field;
    camera = sorted_camera(&place);
    (void)terrimp_heightfield_height(field, camera.eye[0], camera.eye[2], &ground);
    camera.eye[1] = ground + random_float(2.0f, 400.0f);
    camera.z_near = 1.0f, camera.z_far = 30000.0f;
    return camera;
}

/* The same over real elevation, where that is at hand: 16-bit samples, rows of any length; half of
   the frames without end, over seams. */
static void sorted_needs_no_depth_buffer_over_tile(const char *name)
{
    terrimp_sorted_desc desc;
    terrimp_sorted s;
    int i, faults = 0, seen = 0;
    if (!sorted_read_tile(name))
        return;
    memset(&desc, 0, sizeof desc);
    desc.field.samples = tile_samples;
    desc.field.width = desc.field.depth = TILE;
    desc.field.format = TERRIMP_FORMAT_S16;
    desc.field.spacing_x = 68.3f, desc.field.spacing_z = 92.6f;
    for (i = 0; i < 1000; i++) {
        terrimp_camera camera;
        desc.field.wrap = i >= 500;
        desc.field.width = TILE - (i < 500 ? 37u : 0u);
        desc.field.row_bytes = sizeof *tile_samples * TILE;
        if (i % 500 == 0)
            CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        camera = sorted_tile_camera(&s.desc.field);
        s.desc.scale = random_float(2.0f, 8.0f);
        s.desc.front_to_back = i & 1;
        sorted_frame(&s, &camera);
        faults += order_faults(&s, &camera, &seen);
    }
    CHECK(faults == 0);
    CHECK(seen > 1000 * ORDER_WIDE * ORDER_HIGH / 10);
}

static void sorted_needs_no_depth_buffer_over_mountains(void)
{
    sorted_needs_no_depth_buffer_over_tile("N42E001.hgt");
}

/* TERRIMP_LONG: over the other tiles, too. */
static void sorted_needs_no_depth_buffer_over_hills(void)
{
    sorted_needs_no_depth_buffer_over_tile("N49E011.hgt");
    if (getenv("TERRIMP_LONG")) {
        sorted_needs_no_depth_buffer_over_tile("N41E001.hgt");
        sorted_needs_no_depth_buffer_over_tile("N48W125.hgt");
    }
}

/* ---- the order of views ---- */

/* A host without a depth buffer. */
typedef struct order_host {
    const land *l;
    uint32_t hash;        /* of all commands, but for where the repetition of the eye is */
    int32_t periods;      /* where that is, for the hash */
    int captures_now, impostors_now;
    int8_t levels[160][160]; /* 1 + level of the chunks of a terrain that wraps, from -40 on */
    uint8_t patterns[160][160];
    order_picture screen, capture;
    const order_picture *target; /* NULL: of a capture that is not looked at */
    int commands_only;    /* no picture is looked at, nor what vertices are filled with */
    float xyz[3 * 129 * 129];
    terrimp_geomip_vertex morph[129 * 129];
    uint16_t indices[6 * 129 * 129], scratch[4096];
    int captures, looked_at;
    int seen, faults, capture_seen, capture_faults;
    uint32_t circles, meshes;
} order_host;

/* Adds the offset of a command to vertices; returns the eye without it. */
static const float *order_move(const order_host *h, const float offset[2], float *xyz,
                               uint32_t vertices)
{
    static float eye[3];
    uint32_t i;
    memcpy(eye, h->target->eye, sizeof eye);
    eye[0] -= offset[0];
    eye[2] -= offset[1];
    for (i = 0; i < vertices && (offset[0] != 0.0f || offset[1] != 0.0f); i++) {
        xyz[3u * i] += offset[0];
        xyz[3u * i + 2u] += offset[1];
    }
    return eye;
}

/* Takes a part of a command into the hash: words, and places less the periods. */
static void order_hash(order_host *h, const void *words, size_t bytes)
{
    size_t i;
    for (i = 0; i + 4u <= bytes; i += 4u) {
        uint32_t word;
        memcpy(&word, (const unsigned char *)words + i, 4);
        h->hash = (h->hash ^ word) * 0x9e3779b1u;
        h->hash ^= h->hash >> 15;
    }
}

static void order_hash_offset(order_host *h, const float offset[2])
{
    const terrimp_heightfield *f = &h->l->desc.field;
    float tiles[2];
    tiles[0] = offset[0] / ((float)(f->width - 1u) * f->spacing_x) - (float)h->periods;
    tiles[1] = offset[1] / ((float)(f->depth - 1u) * f->spacing_z) - (float)h->periods;
    order_hash(h, tiles, sizeof tiles);
}

static void order_draw(order_host *h, const float *xyz, uint32_t count)
{
    uint32_t i, k;
    for (i = 0; h->target && !h->commands_only && i < count; i += 3u) {
        const float *corners[3];
        for (k = 0; k < 3u; k++)
            corners[k] = xyz + 3u * h->indices[i + k];
        order_triangle(h->target, corners);
    }
}

/* Notes the level and pattern of the chunks that a ground node covers. */
static void order_note_chunks(order_host *h, const terrimp_ground_command *c)
{
    const terrimp_heightfield *f = &h->l->desc.field;
    land_node n = land_place(h->l, c->node);
    int i, j, k, side = 1 << n.level, quads = (int)h->l->info.chunk_quads;
    int x = (int)n.x * side + (int)floorf(c->offset[0] / f->spacing_x / (float)quads + 0.5f) + 40;
    int z = (int)n.z * side + (int)floorf(c->offset[1] / f->spacing_z / (float)quads + 0.5f) + 40;
    uint32_t pattern = 0;
    for (k = 0; k < (int)TERRIMP_PATTERN_COUNT; k++) {
        terrimp_pattern p;
        CHECK(terrimp_pattern_find((uint32_t)quads, TERRIMP_FORM_LIST, (uint32_t)k, &p) ==
              TERRIMP_OK);
        pattern = p.first_index == c->first_index ? (uint32_t)k : pattern;
    }
    for (j = z; j < z + side; j++)
        for (i = x; i < x + side; i++)
            if (i >= 0 && j >= 0 && i < 160 && j < 160) {
                h->levels[j][i] = (int8_t)(n.level + 1u);
                h->patterns[j][i] = (uint8_t)pattern;
            }
}

/* Sides at which a chunk's node does not join that of the next chunk. */
static int order_misfits(const order_host *h)
{
    static const int way[4][2] = {{0, -1}, {0, 1}, {-1, 0}, {1, 0}};
    int x, z, k, count = 0;
    for (z = 1; z < 159; z++)
        for (x = 1; x < 159; x++)
            for (k = 0; k < 4 && h->levels[z][x]; k++) {
                int own = h->levels[z][x], other = h->levels[z + way[k][1]][x + way[k][0]];
                int side = 1 << (own - 1), at = (k < 2 ? z : x) - 40 + 1024;
                int border = k % 2 ? (at + 1) % side == 0 : at % side == 0;
                if (other && border)
                    count += other > own + 1 || (h->patterns[z][x] >> k & 1) != (other > own);
            }
    return count;
}

static void order_fill_ground(order_host *h, uint32_t node)
{
    uint32_t count = h->l->info.ground_vertex_count;
    CHECK(terrimp_terrain_fill_ground(h->l->terrain, node, h->xyz, 3u * count) == TERRIMP_OK);
    CHECK(terrimp_terrain_fill_morph(h->l->terrain, node, h->morph, count) == TERRIMP_OK);
}

static void order_draw_ground(void *user, const terrimp_ground_command *c)
{
    order_host *h = (order_host *)user;
    uint32_t count = 0, vertices = h->l->info.ground_vertex_count;
    terrimp_geomip_draw draw;
    const float *eye;
    order_hash(h, c, offsetof(terrimp_ground_command, offset));
    order_hash_offset(h, c->offset);
    if (!h->target)
        return;
    if (h->target == &h->screen)
        order_note_chunks(h, c);
    memset(&draw, 0, sizeof draw);
    draw.morph = c->morph;
    memcpy(draw.side, c->side, sizeof draw.side);
    memcpy(draw.side_coarse, c->side_coarse, sizeof draw.side_coarse);
    if (!h->commands_only)
        order_fill_ground(h, c->node);
    CHECK(terrimp_geomip_morph(h->l->info.chunk_quads, &draw, h->morph, h->xyz + 1, 3) ==
          TERRIMP_OK);
    eye = order_move(h, c->offset, h->xyz, vertices);
    CHECK(terrimp_sorted_ground(h->l->terrain, c, eye, h->indices, c->index_count, &count) ==
          TERRIMP_OK);
    order_draw(h, h->xyz, count);
}

/* One picture in ten is looked at, which is drawn with nothing else. */
static void order_begin_capture(void *user, const terrimp_capture_command *c)
{
    order_host *h = (order_host *)user;
    order_hash(h, c, offsetof(terrimp_capture_command, view));
    order_hash(h, c->projection, sizeof c->projection);
    h->captures_now++;
    h->looked_at = h->captures++ % 10 == 0 && c->clear && c->complete;
    h->target = NULL;
    if (!h->looked_at)
        return;
    h->target = &h->capture;
    memcpy(h->capture.view, c->view, sizeof c->view);
    memcpy(h->capture.projection, c->projection, sizeof c->projection);
    memcpy(h->capture.eye, c->eye, sizeof c->eye);
    order_begin();
}

static void order_end_capture(void *user, const terrimp_capture_command *c)
{
    order_host *h = (order_host *)user;
    (void)c;
    if (h->looked_at)
        h->capture_faults += order_end(&h->capture_seen);
    h->target = &h->screen;
    order_begin();
}

static void order_draw_impostor(void *user, const terrimp_impostor_command *c)
{
    order_host *h = (order_host *)user;
    uint32_t circles = 0;
    terrimp_mesh_info mesh;
    const float *eye;
    order_hash(h, c, offsetof(terrimp_impostor_command, eye));
    order_hash(h, c->texture_matrix, sizeof c->texture_matrix);
    order_hash(h, c->place_matrix, sizeof c->place_matrix);
    order_hash_offset(h, c->offset);
    h->impostors_now++;
    if (c->alpha < 1.0f)
        return; /* its ground is drawn, too */
    CHECK(terrimp_terrain_get_mesh(h->l->terrain, c->node, &mesh) == TERRIMP_OK);
    memcpy(h->indices, h->l->indices + c->first_index, c->index_count * sizeof *h->indices);
    memcpy(h->xyz, h->l->xyz + 3u * c->base_vertex, mesh.vertex_count * 3u * sizeof(float));
    eye = order_move(h, c->offset, h->xyz, mesh.vertex_count);
    CHECK(terrimp_sorted_mesh(h->xyz, mesh.vertex_count, h->target->eye, h->indices,
                              c->index_count, h->scratch, &circles) == TERRIMP_OK);
    (void)eye;
    h->circles += circles;
    h->meshes++;
    order_draw(h, h->xyz, c->index_count);
}

/* Flies at random and compares each frame with and without a depth buffer. */
static void order_fly(order_host *h, const terrimp_view_desc *desc, int frames)
{
    terrimp_callbacks draw;
    terrimp_view *view = NULL;
    int i, k;
    memset(&draw, 0, sizeof draw);
    draw.user = h;
    draw.begin_capture = order_begin_capture, draw.end_capture = order_end_capture;
    draw.draw_ground = order_draw_ground, draw.draw_impostor = order_draw_impostor;
    CHECK(terrimp_view_create(h->l->terrain, desc, NULL, &view) == TERRIMP_OK);
    for (i = 0; i < frames; i++) {
        terrimp_sorted_desc place;
        terrimp_camera camera;
        memset(&place, 0, sizeof place);
        place.field = h->l->desc.field;
        camera = sorted_camera(&place);
        camera.eye[1] = random_float(h->l->info.box.min[1], 2.0f * h->l->info.box.max[1]);
        camera.z_far = 3000.0f;
        if (i % 8) /* close to the one before: pictures are used again */
            for (k = 0; k < 3; k++)
                camera.eye[k] = h->screen.eye[k] + random_float(-1.0f, 1.0f);
        memcpy(h->screen.eye, camera.eye, sizeof camera.eye);
        CHECK(terrimp_camera_matrices(&camera, h->screen.view, h->screen.projection) == TERRIMP_OK);
        CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
        h->target = &h->screen;
        order_begin();
        CHECK(terrimp_view_render(view, &draw) == TERRIMP_OK);
        h->faults += order_end(&h->seen);
    }
    terrimp_view_destroy(view);
}

static void order_land(land *l, int turn)
{
    static const uint32_t quads[] = {4, 6, 8, 16};
    land_prepare(l, random_range(20, 150), random_range(20, 150), TERRIMP_FORMAT_F32,
                 turn % 2 ? LAND_NOISE : LAND_HILLS);
    l->desc.field.spacing_x = random_float(0.5f, 3.0f);
    l->desc.field.spacing_z = random_float(0.5f, 3.0f);
    l->desc.field.origin_x = random_float(-300.0f, 300.0f);
    l->desc.field.height_scale = random_float(0.02f, 0.2f);
    l->desc.chunk_quads = quads[turn % 4];
}

static void views_in_painters_order_need_no_depth_buffer(void)
{
    static order_host h;
    static land l;
    int turn;
    memset(&h, 0, sizeof h);
    for (turn = 0; turn < (int)check_rounds(8, 12); turn++) {
        terrimp_view_desc d;
        order_land(&l, turn);
        if (!land_build(&l))
            return;
        h.l = &l;
        memset(&d, 0, sizeof d);
        d.sorted = 1;
        d.mode = TERRIMP_MODE_FULL;
        order_fly(&h, &d, 15);
        d.mode = TERRIMP_MODE_GEOMIP;
        d.tolerance_px = random_float(0.3f, 4.0f);
        d.morph_ratio = turn % 3 ? 1.0f : 2.0f;
        order_fly(&h, &d, 30);
        land_free(&l);
    }
    CHECK(h.faults == 0);
    CHECK(h.seen > 50 * ORDER_WIDE * ORDER_HIGH);
}

/* Views of real elevation, where that is at hand, half of them without end: TERRIMP_LONG makes them
   1,000 eyes on each tile in each mode, and counts what AUTO shows wrongly, too. */
static void views_of_tiles_need_no_depth_buffer(void)
{
    static const char *const tiles[4] = {"N42E001.hgt", "N49E011.hgt", "N41E001.hgt",
                                         "N48W125.hgt"};
    enum { CROP = 129 };
    static order_host h;
    static land l;
    int is_long = getenv("TERRIMP_LONG") != NULL, frames = is_long ? 125 : 2, i, k, mode, wrap;
    for (i = 0; i < (is_long ? 4 : 1); i++)
        for (k = 0; k < (is_long ? 4 : 2) && sorted_read_tile(tiles[i]); k++) { /* its crops */
            int first_x = k % 2 * 700, first_z = k / 2 * 700, x, z;
            for (wrap = 0; wrap < 2; wrap++) {
                land_prepare(&l, CROP, CROP, TERRIMP_FORMAT_F32, LAND_FLAT);
                for (z = 0; z < CROP; z++)
                    for (x = 0; x < CROP; x++)
                        l.samples[z * CROP + x] =
                            tile_samples[(first_z + z % (CROP - wrap)) * TILE + first_x +
                                         x % (CROP - wrap)];
                l.desc.field.spacing_x = 0.74f; /* in units of 92.6 m */
                l.desc.field.height_scale = 1.0f / 92.6f;
                l.desc.field.wrap = wrap;
                l.desc.chunk_quads = 16;
                if (!land_build(&l))
                    return;
                for (mode = TERRIMP_MODE_FULL; mode <= TERRIMP_MODE_AUTO; mode++) {
                    terrimp_view_desc d;
                    memset(&d, 0, sizeof d);
                    d.sorted = 1;
                    d.endless = terrimp_view_endless();
                    d.mode = mode;
                    if (mode == TERRIMP_MODE_AUTO) { /* many pictures */
                        d.ground_tolerance_px = 0.05f;
                        d.tolerance_px = 3.0f;
                        d.costs.capture = d.costs.draw = 1.0f;
                    }
                    memset(&h, 0, sizeof h);
                    h.l = &l;
                    if (mode == TERRIMP_MODE_IMPOSTOR || (mode == TERRIMP_MODE_AUTO && !is_long))
                        continue;
                    order_fly(&h, &d, frames);
                    if (is_long)
                        printf("  %s crop %d%s mode %d: %d of %d wrong, %d impostors\n",
                               tiles[i], k, wrap ? " without end" : "", mode, h.faults, h.seen,
                               h.impostors_now);
                    CHECK(h.faults == 0 || mode == TERRIMP_MODE_AUTO);
                    CHECK(h.faults <= h.seen / 10000);
                }
                land_free(&l);
            }
        }
}

static void pictures_are_made_in_painters_order(void)
{
    static order_host h;
    static land l;
    int turn;
    memset(&h, 0, sizeof h);
    h.screen.hides_back = 1;
    for (turn = 0; turn < (int)check_rounds(12, 16); turn++) {
        terrimp_view_desc d;
        order_land(&l, turn);
        l.desc.chunk_quads = turn % 2 ? 8 : 16;
        l.desc.triangle_budget = turn % 3 ? 32 : 85;
        if (!land_build(&l))
            return;
        h.l = &l;
        memset(&d, 0, sizeof d);
        d.sorted = 1;
        d.ground_tolerance_px = 0.1f;
        d.costs.capture = 20.0f;
        d.costs.triangle = 4.0f;
        d.costs.ground_px = d.costs.impostor_px = 0.08f;
        order_fly(&h, &d, 60);
        land_free(&l);
    }
    CHECK(h.capture_faults == 0 && h.capture_seen > 10000);
    CHECK(h.faults == 0);
    CHECK(h.circles == 0 && h.meshes > 1000u);
}

/* A picture that is made in pieces: what has been drawn of it so far, in quads of its ground. */
typedef struct piece_host {
    const land *l;
    uint8_t drawn[128][128]; /* how many times */
    terrimp_rect rects[1024];
    float eye[3];            /* of the picture */
    uint32_t count, level, pictures, pieces, parts, faults;
    int capturing;
} piece_host;

static void piece_begin(void *user, const terrimp_capture_command *c)
{
    piece_host *h = (piece_host *)user;
    h->capturing = 1;
    h->pieces += !c->complete;
    memcpy(h->eye, c->eye, sizeof h->eye);
    if (c->clear) {
        memset(h->drawn, 0, sizeof h->drawn);
        h->count = 0;
    }
}

/* Whether b is not behind a as seen from the eye: in plan, in quads. */
static int piece_before(const terrimp_rect *a, const terrimp_rect *b, float x, float z)
{
    return (a->x + a->width <= b->x && x >= (float)(a->x + a->width)) ||
           (b->x + b->width <= a->x && x <= (float)a->x) ||
           (a->y + a->height <= b->y && z >= (float)(a->y + a->height)) ||
           (b->y + b->height <= a->y && z <= (float)a->y);
}

static void piece_ground(void *user, const terrimp_ground_command *c)
{
    static uint16_t own[6 * 16 * 16];
    piece_host *h = (piece_host *)user;
    terrimp_rect r = {128, 128, 0, 0};
    float quad = (float)(1u << c->level);
    uint32_t i, x, z, count = 0;
    if (!h->capturing)
        return;
    h->level = c->level;
    CHECK(terrimp_sorted_ground(h->l->terrain, c, h->eye, own, 6 * 16 * 16, &count) == TERRIMP_OK);
    for (i = 0; i < c->index_count; i++) { /* the host's own, among which are some of no area */
        uint16_t v = h->l->patterns[c->first_index + i];
        x = c->x * 16u + v % 17u, z = c->z * 16u + v / 17u;
        r.x = x < r.x ? x : r.x, r.y = z < r.y ? z : r.y;
        r.width = x > r.width ? x : r.width, r.height = z > r.height ? z : r.height;
    }
    r.width -= r.x, r.height -= r.y;
    h->parts += c->first_index > 0 && c->first_index < 6u * 16u * 16u; /* rows of a node */
    h->faults += count != 6u * r.width * r.height;
    for (z = r.y; z < r.y + r.height; z++)
        for (x = r.x; x < r.x + r.width; x++)
            h->faults += h->drawn[z][x]++;
    for (i = 0; i < h->count; i++)
        h->faults += !piece_before(&h->rects[i], &r, h->eye[0] / quad, h->eye[2] / quad);
    if (h->count < 1024)
        h->rects[h->count++] = r;
}

static void piece_end(void *user, const terrimp_capture_command *c)
{
    piece_host *h = (piece_host *)user;
    uint32_t side = 16u << (c->level - h->level), x, z;
    h->capturing = 0;
    if (!c->complete)
        return;
    for (z = c->z * side; z < (c->z + 1u) * side; z++)
        for (x = c->x * side; x < (c->x + 1u) * side; x++)
            h->faults += h->drawn[z][x] != 1;
    h->pictures++;
}

static void pace_impostor(void *user, const terrimp_impostor_command *c) { (void)user, (void)c; }

/* With max_cost a node's rows may be spread over frames: each is drawn once, and none that could
   hide one that comes after it. */
static void pieces_of_pictures_are_in_painters_order(void)
{
    static piece_host h;
    static land l;
    terrimp_view_desc d;
    terrimp_callbacks draw;
    terrimp_view *view = NULL;
    int i;
    land_prepare(&l, 129, 129, TERRIMP_FORMAT_F32, LAND_HILLS);
    l.desc.field.height_scale = 0.125f;
    l.desc.chunk_quads = 16;
    if (!land_build(&l))
        return;
    memset(&d, 0, sizeof d), memset(&h, 0, sizeof h), memset(&draw, 0, sizeof draw);
    h.l = &l;
    d.ground_tolerance_px = 0.25f, d.max_cost = 9000.0f, d.cost_limit = terrimp_view_cost_limit();
    d.no_splits = 1; /* these are not cut */
    d.costs.capture = 100.0f, d.costs.ground_px = d.costs.impostor_px = 0.02f;
    draw.user = &h, draw.begin_capture = piece_begin, draw.end_capture = piece_end;
    draw.draw_ground = piece_ground, draw.draw_impostor = pace_impostor;
    CHECK(terrimp_view_create(l.terrain, &d, NULL, &view) == TERRIMP_OK);
    for (i = 0; i < 300; i++) {
        float t = 0.02f * (float)i;
        terrimp_camera camera;
        memset(&camera, 0, sizeof camera);
        camera.eye[0] = 64.0f + 50.0f * cosf(t), camera.eye[2] = 64.0f + 50.0f * sinf(t);
        camera.eye[1] = l.info.box.max[1] + 4.0f;
        camera.forward[0] = -cosf(3.0f * t), camera.forward[2] = -sinf(3.0f * t);
        camera.forward[1] = -0.3f;
        camera.width_px = 640, camera.height_px = 480;
        camera.z_near = 0.5f, camera.z_far = 900.0f;
        CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
        CHECK(terrimp_view_render(view, &draw) == TERRIMP_OK);
    }
    CHECK(h.faults == 0 && h.pictures > 15 && h.pieces > 30 && h.parts > 50);
    terrimp_view_destroy(view);
    land_free(&l);
}

/* ---- terrains without end ---- */

/* A terrain that wraps; and nine of it beside each other, the wrapping one in the middle. */
static void order_tile(land *one, land *nine, int turn)
{
    uint32_t quads = turn % 2 ? 4 : 8, chunks = turn % 3 ? 4 : 6;
    uint32_t side = quads * chunks, x, z;
    land_prepare(one, side + 1u, side + 1u, TERRIMP_FORMAT_F32, LAND_HILLS);
    land_prepare(nine, 3u * side + 1u, 3u * side + 1u, TERRIMP_FORMAT_F32, LAND_FLAT);
    one->desc.chunk_quads = nine->desc.chunk_quads = quads;
    one->desc.field.wrap = 1;
    one->desc.field.height_scale = nine->desc.field.height_scale = 0.125f;
    one->desc.field.spacing_x = nine->desc.field.spacing_x = 2.0f;
    one->desc.field.spacing_z = nine->desc.field.spacing_z = 1.0f;
    nine->desc.field.origin_x = -2.0f * (float)side;
    nine->desc.field.origin_z = -(float)side;
    for (x = 0; x <= side; x++)
        one->samples[side * (side + 1u) + x] = one->samples[x];
    for (z = 0; z <= side; z++)
        one->samples[z * (side + 1u) + side] = one->samples[z * (side + 1u)];
    for (z = 0; z <= 3u * side; z++)
        for (x = 0; x <= 3u * side; x++)
            nine->samples[z * (3u * side + 1u) + x] =
                one->samples[z % side * (side + 1u) + x % side];
}

static void order_camera(order_host *h, terrimp_camera *camera)
{
    memcpy(h->screen.eye, camera->eye, sizeof camera->eye);
    h->target = &h->screen;
    h->captures_now = h->impostors_now = 0;
    memset(h->levels, 0, sizeof h->levels);
    CHECK(terrimp_camera_matrices(camera, h->screen.view, h->screen.projection) == TERRIMP_OK);
    order_begin();
}

static terrimp_callbacks order_callbacks(order_host *h)
{
    terrimp_callbacks draw;
    memset(&draw, 0, sizeof draw);
    draw.user = h;
    draw.begin_capture = order_begin_capture, draw.end_capture = order_end_capture;
    draw.draw_ground = order_draw_ground, draw.draw_impostor = order_draw_impostor;
    return draw;
}

/* The eye is over the tile in the middle, and sees as far as one more. */
static void views_that_wrap_show_what_nine_terrains_show(void)
{
    static order_host h, plain;
    static land one, nine;
    static double wanted[ORDER_WIDE * ORDER_HIGH];
    int turn, i, k, other = 0, seen = 0, faults = 0, misfits = 0, offsets = 0;
    for (turn = 0; turn < 6; turn++) {
        terrimp_view *view = NULL, *yardstick = NULL;
        terrimp_view_desc d;
        terrimp_callbacks draw = order_callbacks(&h), draw_plain = order_callbacks(&plain);
        order_tile(&one, &nine, turn);
        if (!land_build(&one) || !land_build(&nine))
            return;
        h.l = &one, plain.l = &nine;
        memset(&d, 0, sizeof d);
        d.sorted = 1;
        d.endless = terrimp_view_endless();
        d.mode = TERRIMP_MODE_FULL;
        CHECK(terrimp_view_create(nine.terrain, &d, NULL, &yardstick) == TERRIMP_OK);
        d.mode = turn % 2 ? TERRIMP_MODE_FULL : TERRIMP_MODE_GEOMIP;
        d.tolerance_px = 0.05f;
        CHECK(terrimp_view_create(one.terrain, &d, NULL, &view) == TERRIMP_OK);
        for (i = 0; i < 40; i++) {
            terrimp_sorted_desc place;
            terrimp_camera camera;
            memset(&place, 0, sizeof place);
            place.field = one.desc.field;
            camera = sorted_camera(&place);
            camera.eye[1] = random_float(one.info.box.min[1], 2.0f * one.info.box.max[1]);
            camera.z_far = 24.0f;
            order_camera(&plain, &camera);
            CHECK(terrimp_view_update(yardstick, &camera) == TERRIMP_OK);
            CHECK(terrimp_view_render(yardstick, &draw_plain) == TERRIMP_OK);
            memcpy(wanted, order_shown, sizeof wanted);
            order_camera(&h, &camera);
            CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
            CHECK(terrimp_view_render(view, &draw) == TERRIMP_OK);
            for (k = 0; k < ORDER_WIDE * ORDER_HIGH; k++)
                if (wanted[k] * 23.0 > 1.0) /* beyond it either may be cut off */
                    other += fabs(wanted[k] - order_shown[k]) > 0.02 * wanted[k];
            faults += order_end(&seen);
            misfits += order_misfits(&h);
            offsets += h.screen.eye[0] < 0.0f;
        }
        terrimp_view_destroy(view), terrimp_view_destroy(yardstick);
        land_free(&one), land_free(&nine);
    }
    CHECK(faults == 0 && misfits == 0 && offsets > 10);
    CHECK(other * 1000 <= seen && seen > 100000);
}

/* A flight from the field on and the same some periods away: the same commands. Pictures live on
   where it crosses the seam. */
static void views_that_wrap_repeat_after_a_period(void)
{
    static order_host h[2];
    static land one, nine;
    int turn, i, k, at_seam = 0, seams = 0, impostors = 0;
    for (turn = 0; turn < 6; turn++) {
        terrimp_view *views[2] = {NULL, NULL};
        terrimp_view_desc d;
        order_tile(&one, &nine, turn);
        if (!land_build(&one))
            return;
        memset(&d, 0, sizeof d);
        d.sorted = 1;
        d.endless = terrimp_view_endless();
        d.wrap_tiles = 5;
        d.exact_depth = turn % 2 ? terrimp_view_exact_depth() : NULL;
        d.ground_tolerance_px = 0.1f;
        d.costs.capture = 5.0f;
        d.costs.triangle = 4.0f;
        d.costs.ground_px = d.costs.impostor_px = 0.02f;
        d.mode = turn % 3 ? TERRIMP_MODE_AUTO : TERRIMP_MODE_GEOMIP;
        for (k = 0; k < 2; k++) {
            CHECK(terrimp_view_create(one.terrain, &d, NULL, &views[k]) == TERRIMP_OK);
            h[k].l = &one;
            h[k].hash = 1u;
            h[k].periods = 5 * k;
            h[k].commands_only = 1;
            for (i = 0; i < (int)one.info.node_count; i++)
                order_fill_ground(&h[k], (uint32_t)i);
        }
        for (i = 0; i < 120; i++) {
            for (k = 0; k < 2; k++) {
                const terrimp_heightfield *f = &one.desc.field;
                terrimp_callbacks draw = order_callbacks(&h[k]);
                terrimp_camera camera;
                float period[2];
                memset(&camera, 0, sizeof camera);
                period[0] = (float)(f->width - 1u) * f->spacing_x;
                period[1] = (float)(f->depth - 1u) * f->spacing_z;
                camera.eye[0] = 8.0f + 0.25f * (float)i + (float)h[k].periods * period[0];
                camera.eye[2] = 3.0f - 0.5f * (float)i + (float)h[k].periods * period[1];
                camera.eye[1] = 40.0f;
                camera.forward[0] = turn % 2 ? 1.0f : -1.0f, camera.forward[1] = -0.5f;
                camera.forward[2] = 1.0f;
                camera.width_px = 640, camera.height_px = 480;
                camera.z_near = 0.05f, camera.z_far = 200.0f;
                order_camera(&h[k], &camera);
                CHECK(terrimp_view_update(views[k], &camera) == TERRIMP_OK);
                CHECK(terrimp_view_render(views[k], &draw) == TERRIMP_OK);
                if (k == 0 && i > 20 && turn % 3 &&
                    floorf(camera.eye[2] / period[1]) !=
                        floorf((camera.eye[2] + 0.5f) / period[1])) {
                    seams++;
                    at_seam += h[k].captures_now;
                }
                impostors += h[k].impostors_now;
            }
            CHECK(h[0].hash == h[1].hash);
        }
        terrimp_view_destroy(views[0]), terrimp_view_destroy(views[1]);
        land_free(&one), free(nine.samples);
    }
    CHECK(seams > 3 && impostors > 1000 && at_seam * 5 < seams * impostors / (2 * 4 * 120));
}

/* ---- the pace of views ---- */

static void pace_capture(void *user, const terrimp_capture_command *c) { (void)user, (void)c; }
static void pace_ground(void *user, const terrimp_ground_command *c) { (void)user, (void)c; }

static int pace_compare(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

/* What the frames of a flight that looks round cost, and how far the tolerance goes in a frame;
   then the eye rests. turns: it looks up at the sky now and then. Returns 99 % over median. */
static float pace_fly(const land *l, terrimp_view_desc *d, int turns, float *median, float *mean,
                      float *most, int *rests)
{
    enum { FRAMES = 400 };
    static float costs[FRAMES];
    terrimp_view *view = NULL;
    int i;
    float tolerance = 0.0f;
    CHECK(terrimp_view_create(l->terrain, d, NULL, &view) == TERRIMP_OK);
    *rests = 1;
    for (i = 0; i < 40 + FRAMES + 200; i++) {
        float t = i < 40 + FRAMES ? 0.01f * (float)i : 0.01f * (float)(40 + FRAMES);
        terrimp_camera camera;
        terrimp_callbacks draw;
        terrimp_stats stats;
        memset(&draw, 0, sizeof draw);
        draw.begin_capture = draw.end_capture = pace_capture;
        draw.draw_ground = pace_ground, draw.draw_impostor = pace_impostor;
        memset(&camera, 0, sizeof camera);
        camera.eye[0] = l->info.box.min[0] + 20.0f + 25.0f * t;
        camera.eye[2] = l->info.box.min[2] + 60.0f + 12.0f * sinf(t);
        camera.eye[1] = l->info.box.max[1] + 6.0f + 4.0f * sinf(3.0f * t);
        camera.forward[0] = 1.0f + cosf(2.0f * t), camera.forward[2] = sinf(2.0f * t);
        camera.forward[1] = turns && i / 8 % 2 ? 9.0f : -0.3f - 0.2f * cosf(1.3f * t);
        camera.width_px = 640, camera.height_px = 480;
        camera.z_near = 0.5f, camera.z_far = 900.0f;
        CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
        CHECK(terrimp_view_get_stats(view, &stats) == TERRIMP_OK);
        CHECK(terrimp_view_render(view, &draw) == TERRIMP_OK);
        if (i >= 40 && i < 40 + FRAMES)
            costs[i - 40] = stats.cost;
        if (i > 40 + FRAMES + 150)
            *rests &= fabsf(stats.ground_tolerance_px - tolerance) <= 0.0f;
        tolerance = stats.ground_tolerance_px;
    }
    terrimp_view_destroy(view);
    qsort(costs, FRAMES, sizeof *costs, pace_compare);
    *median = costs[FRAMES / 2];
    for (i = 0, *mean = 0.0f; i < FRAMES; i++)
        *mean += costs[i] / (float)FRAMES;
    *most = costs[FRAMES - 1];
    return costs[FRAMES * 99 / 100] / *median;
}

static void views_keep_to_their_cost(void)
{
    static land l;
    int mode, turn;
    for (turn = 0; turn < 2; turn++) {
        land_prepare(&l, 257, 193, TERRIMP_FORMAT_F32, LAND_HILLS);
        l.desc.field.height_scale = 0.125f;
        l.desc.triangle_budget = 40;
        l.desc.chunk_quads = turn ? 8 : 16;
        if (!land_build(&l))
            return;
        for (mode = TERRIMP_MODE_GEOMIP; mode <= TERRIMP_MODE_AUTO; mode += 2) {
            terrimp_view_desc d;
            float median, mean, most, least, limited, free_ratio, ratio;
            int rests;
            memset(&d, 0, sizeof d);
            d.endless = terrimp_view_endless();
            d.mode = mode;
            d.ground_tolerance_px = 0.25f;
            d.costs.capture = 100.0f;
            d.cost_limit = terrimp_view_cost_limit();
            free_ratio = pace_fly(&l, &d, 0, &median, &mean, &most, &rests);
            d.max_cost = 0.9f * mean;
            ratio = pace_fly(&l, &d, 0, &least, &limited, &most, &rests);
            CHECK(ratio <= 1.2f && free_ratio > 1.5f && limited < 0.95f * d.max_cost);
            CHECK(most <= 1.05f * d.max_cost);
            CHECK(rests || mode == TERRIMP_MODE_AUTO);
            CHECK(median > d.max_cost * 0.5f && least > 0.8f * d.max_cost);
            d.max_cost *= 0.6f;
            pace_fly(&l, &d, 1, &least, &limited, &most, &rests);
            CHECK(most <= 1.05f * d.max_cost);
        }
        land_free(&l);
    }
}

static void views_without_end_or_of_a_cost_refuse_bad_input(void)
{
    static const uint32_t tiles[] = {1, 2, 4, 16, 17};
    static land one, nine;
    terrimp_hider hider;
    terrimp_view_desc d, out;
    terrimp_view *view = NULL;
    uint32_t i;
    order_tile(&one, &nine, 1);
    if (!land_build(&one))
        return;
    memset(&d, 0, sizeof d);
    d.endless = terrimp_view_endless();
    CHECK(terrimp_view_desc_resolve(one.terrain, &d, &out) == TERRIMP_OK && out.wrap_tiles == 3);
    d.endless = NULL;
    CHECK(terrimp_view_desc_resolve(one.terrain, &d, &out) == TERRIMP_E_RANGE);
    CHECK(strcmp(terrimp_view_desc_trouble(one.terrain, &d), "endless") == 0);
    d.endless = terrimp_view_endless();
    CHECK(out.max_ground == 9u * land_chunks(&one) && !(out.max_cost > 0.0f));
    CHECK(terrimp_view_create(one.terrain, &d, NULL, &view) == TERRIMP_OK);
    d.wrap_tiles = 5;
    CHECK(terrimp_view_set(view, &d) == TERRIMP_E_RANGE);
    terrimp_view_destroy(view);
    for (i = 0; i < 5u; i++) {
        d.wrap_tiles = tiles[i];
        CHECK(terrimp_view_desc_resolve(one.terrain, &d, &out) == TERRIMP_E_RANGE);
        CHECK(terrimp_view_bytes(one.terrain, &d) == 0);
        CHECK(strcmp(terrimp_view_desc_trouble(one.terrain, &d), "wrap_tiles") == 0);
    }
    memset(&d, 0, sizeof d);
    d.endless = terrimp_view_endless();
    memset(&hider, 0, sizeof hider);
    d.hider = &hider;
    CHECK(terrimp_view_desc_resolve(one.terrain, &d, &out) == TERRIMP_E_RANGE);
    d.hider = NULL;
    d.max_cost = 1.0f; /* without its cost_limit */
    CHECK(terrimp_view_desc_resolve(one.terrain, &d, &out) == TERRIMP_E_RANGE);
    CHECK(strcmp(terrimp_view_desc_trouble(one.terrain, &d), "max_cost") == 0);
    d.cost_limit = terrimp_view_cost_limit();
    CHECK(terrimp_view_desc_resolve(one.terrain, &d, &out) == TERRIMP_OK);
    d.max_cost = -1.0f;
    CHECK(terrimp_view_desc_resolve(one.terrain, &d, &out) == TERRIMP_E_RANGE);
    d.max_cost = not_a_number();
    CHECK(terrimp_view_desc_resolve(one.terrain, &d, &out) == TERRIMP_E_NOT_FINITE);
    land_free(&one), land_free(&nine);
    order_tile(&one, &nine, 1);
    one.desc.field.width -= 2u; /* no multiple of a chunk */
    if (!land_build(&one))
        return;
    memset(&d, 0, sizeof d);
    d.endless = terrimp_view_endless();
    CHECK(terrimp_view_desc_resolve(one.terrain, &d, &out) == TERRIMP_E_RANGE);
    land_free(&one), land_free(&nine);
    CHECK(terrimp_view_pace(100.0f, 10.0f, 10.2f) <= 100.0f);
    CHECK(terrimp_view_pace(100.0f, 20.0f, 10.0f) <= 95.1f);
    CHECK(terrimp_view_pace(100.0f, 5.0f, 10.0f) >= 101.9f);
    CHECK(terrimp_view_pace(100.0f, 0.0f, 10.0f) >= 100.0f);
    CHECK(terrimp_view_pace(100.0f, not_a_number(), 10.0f) >= 100.0f);
    CHECK(terrimp_view_pace(-3.0f, 5.0f, 10.0f) <= -3.0f);
}

static int order_compare(const void *a, const void *b)
{
    return memcmp(a, b, 3u * sizeof(uint16_t));
}

/* Brings triangles into one order, each with its smallest corner first and without those of no
   area. Returns how many there are. */
static uint32_t order_tidy(uint16_t *t, uint32_t index_count)
{
    uint32_t i, count = 0;
    for (i = 0; i < index_count; i += 3u) {
        uint16_t a = t[i], b = t[i + 1u], c = t[i + 2u];
        int first = a < b && a < c ? 0 : b < c ? 1 : 2;
        if (a == b || b == c || c == a)
            continue;
        t[3u * count] = first == 0 ? a : first == 1 ? b : c;
        t[3u * count + 1u] = first == 0 ? b : first == 1 ? c : a;
        t[3u * count++ + 2u] = first == 0 ? c : first == 1 ? a : b;
    }
    qsort(t, count, 3u * sizeof *t, order_compare);
    return count;
}

static void painters_order_has_the_triangles_of_the_pattern(void)
{
    static uint16_t own[6 * 129 * 129], plain[6 * 129 * 129];
    static land l;
    uint32_t turn, first, count = 0, i, checked = 0;
    for (turn = 0; turn < 3; turn++) {
        order_land(&l, (int)turn);
        if (!land_build(&l))
            return;
        for (first = 0; first < l.info.ground_index_count; first += 3u) {
            terrimp_ground_command c;
            uint32_t wanted = 0;
            float eye[3];
            terrimp_result result;
            for (i = 0; i < 3u; i++)
                eye[i] = random_float(l.info.box.min[i] - 50.0f, l.info.box.max[i] + 50.0f);
            count = 0;
            memset(&c, 0, sizeof c);
            c.node = random_range(0, l.info.node_count - 1u);
            c.first_index = first;
            result = terrimp_sorted_ground(l.terrain, &c, eye, own, sizeof own / 2u, &count);
            CHECK(result == TERRIMP_OK || result == TERRIMP_E_RANGE);
            if (result != TERRIMP_OK)
                continue;
            CHECK(terrimp_sorted_ground(l.terrain, &c, eye, own, count - 1u, &i) ==
                  TERRIMP_E_CAPACITY);
            for (i = 0; i < TERRIMP_PATTERN_COUNT; i++) {
                terrimp_pattern p;
                CHECK(terrimp_pattern_find(l.info.chunk_quads, TERRIMP_FORM_LIST, i, &p) ==
                      TERRIMP_OK);
                wanted = p.first_index == first ? p.index_count : wanted;
            }
            wanted = wanted ? wanted : count; /* strips have no triangles of no area */
            memcpy(plain, l.patterns + first, wanted * sizeof *plain);
            CHECK(order_tidy(own, count) == count / 3u);
            CHECK(order_tidy(plain, wanted) == count / 3u);
            CHECK(memcmp(own, plain, count * sizeof *own) == 0);
            checked++;
        }
        land_free(&l);
    }
    CHECK(checked >= 3u * 16u);
}

/* Around the eye's triangle lies a ring of six, each of which hides a part of the next one. */
static void a_circle_of_a_mesh_is_told_and_the_rest_is_in_order(void)
{
    static const float xyz[18] = {1.0f, 0, 0, -0.5f, 0, -0.866f, -0.5f, 0, 0.866f, 3.94f, 0, 0.695f,
                                  -1.368f, 0, -3.759f, -2.571f, 0, 3.064f};
    static const uint16_t ring[21] = {0, 1, 2, 1, 0, 3, 2, 1, 4, 0, 2, 5,
                                      3, 4, 1, 4, 5, 2, 5, 3, 0};
    static const float eye[3] = {0, 9, 0};
    uint16_t indices[21], scratch[6 + 3 * 21];
    uint32_t circles, first, i, k, found;
    for (first = 0; first < 7u; first++) { /* whichever triangle is first in the mesh */
        for (i = 0; i < 21u; i++)
            indices[i] = ring[(i + 3u * first) % 21u];
        CHECK(terrimp_sorted_mesh(xyz, 6, eye, indices, 21, scratch, &circles) == TERRIMP_OK);
        CHECK(circles == 1u);
        CHECK(memcmp(indices + 18, ring, 3u * sizeof *ring) == 0);
        for (i = found = 0; i < 7u; i++)
            for (k = 0; k < 7u; k++)
                found += memcmp(indices + 3u * i, ring + 3u * k, 3u * sizeof *ring) == 0;
        CHECK(found == 7u);
    }
    for (i = 0; i < 12u; i++) /* half of the ring is none */
        indices[i] = ring[i];
    CHECK(terrimp_sorted_mesh(xyz, 6, eye, indices, 12, scratch, &circles) == TERRIMP_OK);
    CHECK(circles == 0 && memcmp(indices + 9, ring, 3u * sizeof *ring) == 0);
}

static void painters_order_refuses_bad_input(void)
{
    static land l;
    terrimp_ground_command c;
    uint16_t indices[3] = {0, 1, 2}, scratch[32], *ground;
    uint32_t count = 7;
    float xyz[9] = {0, 0, 0, 0, 0, 1, 1, 0, 1}, eye[3] = {0, 9, 0};
    order_land(&l, 1);
    if (!land_build(&l))
        return;
    ground = (uint16_t *)malloc(l.info.ground_index_count * sizeof *ground);
    memset(&c, 0, sizeof c);
#define ORDER_GROUND(t, c, e, out, room, n) terrimp_sorted_ground(t, c, e, out, room, n)
    CHECK(ORDER_GROUND(NULL, &c, eye, ground, 99999, &count) == TERRIMP_E_NULL);
    CHECK(ORDER_GROUND(l.terrain, NULL, eye, ground, 99999, &count) == TERRIMP_E_NULL);
    CHECK(ORDER_GROUND(l.terrain, &c, NULL, ground, 99999, &count) == TERRIMP_E_NULL);
    CHECK(ORDER_GROUND(l.terrain, &c, eye, NULL, 99999, &count) == TERRIMP_E_NULL);
    CHECK(ORDER_GROUND(l.terrain, &c, eye, ground, 99999, NULL) == TERRIMP_E_NULL);
    CHECK(ORDER_GROUND(l.terrain, &c, eye, ground, 3, &count) == TERRIMP_E_CAPACITY);
    c.first_index = 1;
    CHECK(ORDER_GROUND(l.terrain, &c, eye, ground, 99999, &count) == TERRIMP_E_RANGE);
    c.first_index = 0;
    c.node = l.info.node_count;
    CHECK(ORDER_GROUND(l.terrain, &c, eye, ground, 99999, &count) == TERRIMP_E_RANGE);
    c.node = 0;
    CHECK(terrimp_sorted_mesh(NULL, 3, eye, indices, 3, scratch, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_mesh(xyz, 3, NULL, indices, 3, scratch, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_mesh(xyz, 3, eye, NULL, 3, scratch, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_mesh(xyz, 3, eye, indices, 3, NULL, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_mesh(xyz, 3, eye, indices, 2, scratch, NULL) == TERRIMP_E_RANGE);
    CHECK(terrimp_sorted_mesh(xyz, 2, eye, indices, 3, scratch, NULL) == TERRIMP_E_RANGE);
    eye[2] = not_a_number();
    CHECK(ORDER_GROUND(l.terrain, &c, eye, ground, 99999, &count) == TERRIMP_E_NOT_FINITE);
    CHECK(terrimp_sorted_mesh(xyz, 3, eye, indices, 3, scratch, NULL) == TERRIMP_E_NOT_FINITE);
#undef ORDER_GROUND
    CHECK(count == 7);
    free(ground);
    land_free(&l);
}

/* ---- cracks ---- */

/* An edge of a triangle in plan, and the heights of its ends; key: its place whatever its way. */
typedef struct sorted_edge {
    int32_t x0, z0, x1, z1;
    terrimp_sorted_height h0, h1;
    int way;
} sorted_edge;

static sorted_edge sorted_edges[SORTED_MOST * 6];

static int sorted_compare_edges(const void *a, const void *b)
{
    const sorted_edge *p = (const sorted_edge *)a, *q = (const sorted_edge *)b;
    return p->x0 != q->x0 ? (p->x0 < q->x0 ? -1 : 1) : p->z0 != q->z0 ? (p->z0 < q->z0 ? -1 : 1)
         : p->x1 != q->x1 ? (p->x1 < q->x1 ? -1 : 1) : p->z1 != q->z1 ? (p->z1 < q->z1 ? -1 : 1)
         : p->way - q->way;
}

static void sorted_note_edge(size_t *count, const terrimp_sorted_vertex *a,
                             const terrimp_sorted_vertex *b)
{
    sorted_edge *e = &sorted_edges[*count];
    int swap = a->x > b->x || (a->x == b->x && a->z > b->z);
    const terrimp_sorted_vertex *p = swap ? b : a, *q = swap ? a : b;
    if (a->x == b->x && a->z == b->z)
        return;
    e->x0 = p->x, e->z0 = p->z, e->h0 = p->height;
    e->x1 = q->x, e->z1 = q->z, e->h1 = q->height;
    e->way = swap;
    ++*count;
}

/* Whether a place, in half samples, lies in a square of the frame. */
static int sorted_drawn_at(int32_t x2, int32_t z2)
{
    uint32_t i;
    for (i = 0; i < sorted_count; i++) {
        const terrimp_sorted_vertex *v = sorted_squares[i].vertices;
        if (x2 > 2 * v[0].x && x2 < 2 * v[3].x && z2 > 2 * v[0].z && z2 < 2 * v[3].z)
            return 1;
    }
    return 0;
}

/* Edges that have no partner of the same heights on their other side though something is drawn
   there, or that have more than one. Twice the area of all triangles is added up. */
static int sorted_count_cracks(double *area)
{
    size_t count = 0, i;
    uint32_t k;
    int t, cracks = 0;
    for (k = 0; k < sorted_count; k++)
        for (t = 0; t < sorted_squares[k].triangle_count; t++) {
            const terrimp_sorted_square *q = &sorted_squares[k];
            const terrimp_sorted_vertex *a = &q->vertices[q->indices[3 * t]];
            const terrimp_sorted_vertex *b = &q->vertices[q->indices[3 * t + 1]];
            const terrimp_sorted_vertex *c = &q->vertices[q->indices[3 * t + 2]];
            double turn = (double)(b->z - a->z) * (c->x - a->x) -
                          (double)(b->x - a->x) * (c->z - a->z);
            CHECK(turn >= 0.0); /* counter-clockwise from above */
            *area += turn;
            if (turn == 0.0) /* beyond the last column or row */
                continue;
            sorted_note_edge(&count, a, b);
            sorted_note_edge(&count, b, c);
            sorted_note_edge(&count, c, a);
        }
    qsort(sorted_edges, count, sizeof sorted_edges[0], sorted_compare_edges);
    for (i = 0; i < count; i++) {
        const sorted_edge *e = &sorted_edges[i];
        int32_t x = e->x0 + e->x1, z = e->z0 + e->z1, side = e->way ? -1 : 1;
        int has = i + 1 < count && e[1].x0 == e->x0 && e[1].z0 == e->z0 && e[1].x1 == e->x1 &&
                  e[1].z1 == e->z1;
        if (has) {
            cracks += e->way == e[1].way || e->h0 != e[1].h0 || e->h1 != e[1].h1;
            i++;
        } else {
            /* Its triangle lies to the left of its way, seen from above; the other side is where
               nothing may be. */
            int32_t dx = e->x1 - e->x0, dz = e->z1 - e->z0;
            int32_t out_x = -side * (dz > 0 ? 1 : dz < 0 ? -1 : 0);
            int32_t out_z = side * (dx > 0 ? 1 : dx < 0 ? -1 : 0);
            cracks += sorted_drawn_at(x + (dz ? out_x : 0), z + (dx ? out_z : 0));
        }
    }
    return cracks;
}

static void sorted_squares_meet_without_cracks(void)
{
    int i, cracks = 0;
    uint32_t k, middles = 0;
    sorted_make_hills(8.0f);
    for (i = 0; i < 400; i++) {
        terrimp_sorted_desc desc = i % 2 ? sorted_hills() : sorted_piece();
        terrimp_sorted s;
        terrimp_camera camera;
        double area = 0.0, squares = 0.0;
        desc.scale = random_float(2.0f, 8.0f);
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        camera = sorted_camera(&s.desc);
        sorted_frame(&s, &camera);
        cracks += sorted_count_cracks(&area);
        for (k = 0; k < sorted_count; k++) {
            const terrimp_sorted_vertex *v = sorted_squares[k].vertices;
            squares += 2.0 * (double)(v[3].x - v[0].x) * (double)(v[3].z - v[0].z);
            middles += (uint32_t)sorted_squares[k].vertex_count - 4u;
        }
        CHECK(area == squares);
    }
    CHECK(cracks == 0);
    CHECK(middles > 1000);
}

/* All patterns of split sides, of which there is one along each axis at most, in both orders, from
   eyes all around: the triangles of a square cover it, and of two the later one has its part of the
   plan on the eye's side. */
static void sorted_patterns_are_ordered(void)
{
    static const uint8_t sides[4] = { 1, 9, 4, 6 };
    int pattern, i, k, m, t;
    for (pattern = 0; pattern < 12; pattern++)
        for (i = 0; i < 500 && (pattern & 3) != 3; i++) {
            uint8_t places[6] = { 0, 2, 8, 10, 0, 0 };
            terrimp_sorted s;
            terrimp_sorted_square q;
            int middle[4], area = 0, first;
            memset(&s, 0, sizeof s);
            memset(&q, 0, sizeof q);
            s.eye[0] = (terrimp_sorted_int)random_range(0, 64 * 24) - 64 * 8;
            s.eye[1] = (terrimp_sorted_int)random_range(0, 64 * 24) - 64 * 8;
            s.desc.front_to_back = i & 1;
            for (k = 0; k < 6; k++)
                s.cells[0].away[k & 1][k >> 1] = (k >> 1) * 4 * 64 - s.eye[k & 1];
            q.vertex_count = 4;
            for (k = 0; k < 4; k++) {
                middle[k] = pattern >> k & 1 ? q.vertex_count++ : 0;
                if (middle[k])
                    places[middle[k]] = sides[k];
            }
            for (k = 0; k < q.vertex_count; k++) {
                q.vertices[k].x = (places[k] & 3) * 4;
                q.vertices[k].z = (places[k] >> 2) * 4;
            }
            terrimpi_sorted_triangles(&s, &q, places, middle);
            CHECK(q.triangle_count == 2 + q.vertex_count - 4);
            for (t = 0; t < q.triangle_count; t++) {
                const terrimp_sorted_vertex *v[3];
                for (k = 0; k < 3; k++)
                    v[k] = &q.vertices[q.indices[3 * t + k]];
                area += (v[1]->z - v[0]->z) * (v[2]->x - v[0]->x) -
                        (v[1]->x - v[0]->x) * (v[2]->z - v[0]->z);
                /* A ray from the eye in plan through a triangle meets no earlier one on its way. */
                for (m = 0; m < 10; m++) {
                    float a = random_float(0.01f, 0.98f), b = random_float(0.01f, 0.99f - a);
                    float x = (float)v[0]->x + a * (float)(v[1]->x - v[0]->x) +
                              b * (float)(v[2]->x - v[0]->x);
                    float z = (float)v[0]->z + a * (float)(v[1]->z - v[0]->z) +
                              b * (float)(v[2]->z - v[0]->z);
                    float part = random_float(0.0f, 1.0f);
                    float ex = (float)s.eye[0] / 64.0f, ez = (float)s.eye[1] / 64.0f;
                    x = ex + (x - ex) * part; /* in front of the triangle: only later ones */
                    z = ez + (z - ez) * part;
                    for (first = 0; first < q.triangle_count; first++) {
                        const terrimp_sorted_vertex *p[3];
                        int inside = 1;
                        for (k = 0; k < 3; k++)
                            p[k] = &q.vertices[q.indices[3 * first + k]];
                        for (k = 0; k < 3; k++) {
                            const terrimp_sorted_vertex *c = p[k], *d = p[(k + 1) % 3];
                            inside &= (float)(d->z - c->z) * (x - (float)c->x) -
                                      (float)(d->x - c->x) * (z - (float)c->z) > 1e-3f;
                        }
                        CHECK(!inside || (i & 1 ? first <= t : first >= t));
                    }
                }
            }
            CHECK(area == 128);
        }
}

/* ---- the footprint ---- */

/* Every sample that projects on to the screen lies in a square that is drawn. */
static void sorted_draws_all_that_is_seen(void)
{
    int i, k, seen = 0, missed = 0;
    sorted_make_hills(8.0f);
    for (i = 0; i < 150; i++) {
        terrimp_sorted_desc desc = i % 2 ? sorted_hills() : sorted_piece();
        terrimp_sorted s;
        terrimp_camera camera;
        terrimp_frustum frustum;
        desc.scale = 2.0f;
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        camera = sorted_camera(&s.desc);
        sorted_frame(&s, &camera);
        CHECK(terrimp_camera_frustum(&camera, &frustum) == TERRIMP_OK);
        for (k = 0; k < 300; k++) {
            terrimp_sorted_vertex v;
            terrimp_box box;
            v.x = (int32_t)random_range(0, s.desc.field.width - 2);
            v.z = (int32_t)random_range(0, s.desc.field.depth - 2);
            v.height = sorted_heights[v.z * SORTED_SIDE + v.x];
            if (desc.field.wrap) {
                v.x += 512 * ((int32_t)random_range(0, 2) - 1);
                v.z += 512 * ((int32_t)random_range(0, 2) - 1);
            }
            terrimp_sorted_position(&s, &v, box.min);
            memcpy(box.max, box.min, sizeof box.max);
            if (terrimp_frustum_test(&frustum, &box, TERRIMP_PLANES_ALL) != 0)
                continue;
            seen++;
            missed += !sorted_drawn_at(2 * v.x + 1, 2 * v.z + 1);
        }
    }
    CHECK(missed == 0);
    CHECK(seen > 1000);
}

/* Fields that end within a page: there, too, of the two triangles of a square the one on the eye's
   side of their edge is the later one. */
static void sorted_squares_at_the_end_are_ordered(void)
{
    uint32_t i, k, cut = 0;
    sorted_make_hills(8.0f);
    for (i = 0; i < 300; i++) {
        terrimp_sorted_desc desc = sorted_piece();
        terrimp_sorted s;
        terrimp_camera camera;
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        camera = sorted_camera(&s.desc);
        sorted_frame(&s, &camera);
        for (k = 0; k < sorted_count; k++) {
            const terrimp_sorted_square *q = &sorted_squares[k];
            const terrimp_sorted_vertex *a = &q->vertices[0], *b = &q->vertices[3];
            const terrimp_heightfield *f = &s.desc.field;
            double x, z, side;
            int last_has_1;
            if (q->vertex_count > 4 ||
                (b->x - a->x == 1 << q->level && b->z - a->z == 1 << q->level))
                continue;
            x = ((double)camera.eye[0] - (double)f->origin_x) / (double)f->spacing_x - a->x;
            z = ((double)camera.eye[2] - (double)f->origin_z) / (double)f->spacing_z - a->z;
            side = x * (b->z - a->z) - z * (b->x - a->x); /* above 0: where vertex 1 is */
            last_has_1 = q->indices[3] == 1 || q->indices[4] == 1 || q->indices[5] == 1;
            if (fabs(side) > 2.0)
                CHECK((side > 0.0) == last_has_1);
            cut++;
        }
    }
    CHECK(cut > 1000);
}

/* An eye among the heights that looks straight ahead: nothing is drawn that lies wholly beyond a
   side of what it can see, but for a few samples. */
static void sorted_draws_little_that_is_not_seen(void)
{
    uint32_t i, k, m, n;
    sorted_make_hills(20.0f);
    for (i = 0; i < 100; i++) {
        terrimp_sorted_desc desc = sorted_hills();
        terrimp_sorted s;
        terrimp_camera camera = sorted_camera(&desc);
        double way[3][3], tan_x, ahead[2];
        camera.eye[1] = 0.0f;
        camera.forward[0] = cosf((float)i), camera.forward[1] = 0.0f;
        camera.forward[2] = sinf((float)i);
        tan_x = tan(0.5 * (double)camera.fov_y_rad) * camera.width_px / camera.height_px;
        ahead[0] = (double)camera.forward[0], ahead[1] = (double)camera.forward[2];
        way[0][0] = -ahead[0], way[0][1] = -ahead[1];
        way[0][2] = (double)camera.z_far; /* and the two sides, inwards */
        for (k = 1; k < 3; k++) {
            double turn = k == 1 ? 1.0 : -1.0, size = sqrt(1.0 + tan_x * tan_x);
            way[k][0] = (tan_x * ahead[0] - turn * ahead[1]) / size;
            way[k][1] = (tan_x * ahead[1] + turn * ahead[0]) / size;
            way[k][2] = 0.0;
        }
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        sorted_frame(&s, &camera);
        CHECK(sorted_count > 0);
        for (k = 0; k < sorted_count; k++)
            for (m = 0; m < 3; m++) {
                int in = 0;
                for (n = 0; n < 4; n++)
                    in |= way[m][0] * (sorted_squares[k].vertices[n].x - (double)camera.eye[0]) +
                          way[m][1] * (sorted_squares[k].vertices[n].z - (double)camera.eye[2]) +
                          way[m][2] > -4.0;
                CHECK(in);
            }
    }
}

/* The cost of a frame rises with its triangles and no faster, few or many, by what is counted: less
   than one quarter or page is looked at for each triangle, and less than one height made, but for
   the four of each page. */
static void sorted_frames_cost_what_their_triangles_do(void)
{
    static const float scales[4] = { 2.0f, 5.0f, 12.0f, 40.0f };
    int i, k;
    sorted_make_hills(30.0f);
    for (k = 0; k < 4; k++) {
        uint32_t looks = 0, pages = 0, splits = 0, squares = 0, sides = 0;
        for (i = 0; i < 12; i++) {
            terrimp_sorted_desc desc = sorted_hills();
            terrimp_sorted s;
            terrimp_camera camera = sorted_camera(&desc);
            int found = 0, is_page, is_split;
            desc.scale = scales[k];
            CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
            CHECK(terrimp_sorted_begin(&s, &camera) == TERRIMP_OK);
            for (; found >= 0; looks++) {
                found = terrimpi_sorted_look(&s, 0);
                is_split = found == 0 && s.level < s.top && s.cells[s.level + 1].child == 0;
                is_page = s.level + (is_split ? 1u : 0u) == s.top;
                pages += is_page && (found > 0 || is_split);
                splits += is_split;
                squares += found > 0;
                sides += found > 0 ? terrimpi_mip_coarse_sides(terrimpi_sorted_pattern(&s)) : 0;
            }
        }
        CHECK(squares > 500);
        CHECK(looks < 2 * squares + sides);
        CHECK(5 * splits + sides < 2 * squares + sides && pages < squares);
    }
}

/* ---- blending ---- */

/* The height of what is drawn at a place, in samples; 0 when nothing is. */
static int sorted_height_at(float x, float z, float *height)
{
    uint32_t i;
    int t;
    for (i = 0; i < sorted_count; i++) {
        const terrimp_sorted_square *q = &sorted_squares[i];
        if (x < (float)q->vertices[0].x || x > (float)q->vertices[3].x ||
            z < (float)q->vertices[0].z || z > (float)q->vertices[3].z)
            continue;
        for (t = 0; t < q->triangle_count; t++) {
            const terrimp_sorted_vertex *a = &q->vertices[q->indices[3 * t]];
            const terrimp_sorted_vertex *b = &q->vertices[q->indices[3 * t + 1]];
            const terrimp_sorted_vertex *c = &q->vertices[q->indices[3 * t + 2]];
            float bx = (float)(b->x - a->x), bz = (float)(b->z - a->z);
            float cx = (float)(c->x - a->x), cz = (float)(c->z - a->z);
            float area = bx * cz - bz * cx, px = x - (float)a->x, pz = z - (float)a->z;
            float u = (px * cz - pz * cx) / area, v = (bx * pz - bz * px) / area;
            if (area == 0.0f || u < -1e-5f || v < -1e-5f || u + v > 1.00001f)
                continue;
            *height = a->height + u * (b->height - a->height) + v * (c->height - a->height);
            return 1;
        }
    }
    return 0;
}

enum { BLEND_PLACES = 400 };

/* The largest change of a drawn height while the eye moves by a step, over many eyes. */
static float sorted_largest_step(terrimp_sorted *s, float step)
{
    static float place[BLEND_PLACES][2], before[BLEND_PLACES];
    float largest = 0.0f;
    int i, k;
    for (i = 0; i < 40; i++) {
        terrimp_camera camera = sorted_camera(&s->desc);
        camera.eye[1] = 40.0f;
        camera.forward[1] = -0.5f;
        camera.z_far = 300.0f;
        sorted_frame(s, &camera);
        for (k = 0; k < BLEND_PLACES; k++) {
            place[k][0] = camera.eye[0] + random_float(-120.0f, 120.0f);
            place[k][1] = camera.eye[2] + random_float(-120.0f, 120.0f);
            if (!sorted_height_at(place[k][0], place[k][1], &before[k]))
                before[k] = 1e9f;
        }
        camera.eye[0] += step;
        camera.eye[2] += step;
        sorted_frame(s, &camera);
        for (k = 0; k < BLEND_PLACES; k++) {
            float after;
            if (before[k] < 1e8f && sorted_height_at(place[k][0], place[k][1], &after))
                largest = fmaxf(largest, fabsf(after - before[k]));
        }
    }
    return largest;
}

static void sorted_levels_change_without_a_pop(void)
{
    static const float scales[3] = { 2.5f, 4.0f, 9.0f };
    int i;
    sorted_make_hills(8.0f);
    for (i = 0; i < 3; i++) {
        terrimp_sorted_desc desc = sorted_hills();
        terrimp_sorted s;
        float steps[3];
        desc.scale = scales[i];
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        steps[0] = sorted_largest_step(&s, 1.0f);
        steps[1] = sorted_largest_step(&s, 1.0f / 8.0f);
        steps[2] = sorted_largest_step(&s, 1.0f / 64.0f);
        CHECK(steps[0] > 0.05f);
        CHECK(steps[1] < steps[0] / 3.0f && steps[2] < steps[1] / 3.0f);
    }
}

/* ---- endless ---- */

static void sorted_repeats_after_a_period(void)
{
    static terrimp_sorted_square before[SORTED_MOST];
    terrimp_sorted_desc desc = sorted_hills();
    terrimp_sorted s;
    int i;
    uint32_t k, count;
    sorted_make_hills(8.0f);
    desc.scale = 4.0f;
    CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
    for (i = 0; i < 50; i++) {
        terrimp_camera camera = sorted_camera(&s.desc);
        int32_t away_x = 8 * ((int32_t)random_range(0, 6) - 3);
        int32_t away_z = 8 * ((int32_t)random_range(0, 6) - 3);
        camera.eye[0] = floorf(camera.eye[0] * 64.0f) / 64.0f; /* so that no float is rounded */
        camera.eye[2] = floorf(camera.eye[2] * 64.0f) / 64.0f;
        memset(sorted_squares, 0, sizeof sorted_squares);
        sorted_frame(&s, &camera);
        memcpy(before, sorted_squares, sizeof before);
        count = sorted_count;
        camera.eye[0] += (float)(away_x * 64);
        camera.eye[2] += (float)(away_z * 64);
        memset(sorted_squares, 0, sizeof sorted_squares);
        sorted_frame(&s, &camera);
        CHECK(count == sorted_count);
        for (k = 0; k < sorted_count; k++) {
            int v;
            sorted_squares[k].page_x -= away_x;
            sorted_squares[k].page_z -= away_z;
            for (v = 0; v < sorted_squares[k].vertex_count; v++) {
                sorted_squares[k].vertices[v].x -= away_x * 64;
                sorted_squares[k].vertices[v].z -= away_z * 64;
            }
        }
        CHECK(memcmp(before, sorted_squares, sizeof before) == 0);
    }
}

/* Heights, normals and rays of a field that wraps are those of one that is laid out nine times. */
static void field_that_wraps_is_endless(void)
{
    static float tile[6 * 9], tiled[16 * 25];
    terrimp_heightfield one, nine;
    int i, x, z, hits = 0;
    memset(&one, 0, sizeof one);
    for (z = 0; z < 6; z++)
        for (x = 0; x < 9; x++)
            tile[z * 9 + x] = random_float(0.0f, 3.0f);
    for (z = 0; z < 6; z++)
        tile[z * 9 + 8] = tile[z * 9];
    memcpy(tile + 5 * 9, tile, 9 * sizeof tile[0]);
    for (z = 0; z < 16; z++)
        for (x = 0; x < 25; x++)
            tiled[z * 25 + x] = tile[z % 5 * 9 + x % 8];
    one.samples = tile;
    one.width = 9, one.depth = 6;
    one.spacing_x = 0.5f, one.spacing_z = 2.0f;
    one.origin_x = 4.0f, one.origin_z = 10.0f;
    one.wrap = 1;
    nine = one;
    nine.samples = tiled;
    nine.width = 25, nine.depth = 16;
    nine.origin_x = 0.0f, nine.origin_z = 0.0f;
    nine.wrap = 0;
    for (i = 0; i < 3000; i++) {
        float from[3], way[3], a, b, length = random_float(0.1f, 6.0f);
        terrimp_ray_hit p, q;
        terrimp_result got;
        from[0] = floorf(random_float(0.0f, 12.0f) * 64.0f) / 64.0f;
        from[1] = random_float(-1.0f, 4.0f);
        from[2] = floorf(random_float(0.0f, 30.0f) * 64.0f) / 64.0f;
        CHECK(terrimp_heightfield_height(&one, from[0], from[2], &a) == TERRIMP_OK);
        CHECK(terrimp_heightfield_height(&nine, from[0], from[2], &b) == TERRIMP_OK);
        CHECK(same_float(a, b));
        CHECK(terrimp_heightfield_normal(&one, from[0], from[2], p.normal) == TERRIMP_OK);
        CHECK(terrimp_heightfield_normal(&nine, from[0], from[2], q.normal) == TERRIMP_OK);
        CHECK(memcmp(p.normal, q.normal, sizeof p.normal) == 0);
        from[0] = random_float(6.1f, 6.9f);
        from[2] = random_float(8.0f, 22.0f);
        way[0] = random_float(-1.0f, 1.0f);
        way[1] = random_float(-1.0f, 0.3f);
        way[2] = random_float(-1.0f, 1.0f);
        got = terrimp_heightfield_raycast(&one, from, way, length, &p);
        CHECK(terrimp_heightfield_raycast(&nine, from, way, length, &q) == got);
        if (got != TERRIMP_OK)
            continue;
        hits++;
        CHECK(fabsf(p.distance - q.distance) < 1e-3f);
        CHECK(fabsf(p.position[0] - q.position[0]) < 1e-3f);
        CHECK(fabsf(p.position[2] - q.position[2]) < 1e-3f);
        CHECK(p.x == q.x % 8 && p.z == q.z % 5);
    }
    CHECK(hits > 1000);
}

/* A ray along an endless plain ends; one straight down from anywhere hits. */
static void rays_over_a_field_that_wraps_end(void)
{
    static float flat[4];
    terrimp_heightfield f;
    terrimp_ray_hit hit;
    float from[3] = { 0.3f, 1.0f, 0.6f }, way[3] = { 1.0f, 0.0f, 0.37f };
    memset(&f, 0, sizeof f);
    f.samples = flat;
    f.width = f.depth = 2;
    f.wrap = 1;
    CHECK(terrimp_heightfield_raycast(&f, from, way, 1048576.0f, &hit) == TERRIMP_E_MISS);
    CHECK(terrimp_heightfield_raycast(&f, from, way, 1048580.0f, &hit) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_raycast(&f, from, way, FLT_MAX, &hit) == TERRIMP_E_RANGE);
    way[1] = -0.01f;
    CHECK(terrimp_heightfield_raycast(&f, from, way, 1000.0f, &hit) == TERRIMP_OK);
    CHECK(fabsf(hit.position[0] - 100.3f) < 0.01f && fabsf(hit.position[2] - 37.6f) < 0.01f);
    from[0] = -12345.5f;
    way[0] = way[2] = 0.0f, way[1] = -1.0f;
    CHECK(terrimp_heightfield_raycast(&f, from, way, 5.0f, &hit) == TERRIMP_OK);
    CHECK(hit.position[0] == -12345.5f && hit.distance == 1.0f);
}

/* ---- pages ---- */

/* A host that has only some levels of some pages of the endless hills, by chance but always the
   same ones; it packs what is asked for. */
typedef struct sorted_host {
    uint32_t seed, coarsest, asked, drawn;
    int none; /* some pages are not here at all */
    float samples[65 * 65];
} sorted_host;

static uint32_t sorted_level_here(const sorted_host *host, int32_t x, int32_t z)
{
    uint32_t bits = ((uint32_t)x * 73856093u ^ (uint32_t)z * 19349663u ^ host->seed) * 2654435761u;
    if (host->none && (bits >> 24) % 7u == 0)
        return TERRIMP_SORTED_ABSENT;
    return (bits >> 16) % (host->coarsest + 1u);
}

static void sorted_give_page(void *user, terrimp_sorted_page *page)
{
    sorted_host *host = (sorted_host *)user;
    int x, z, side, step;
    CHECK(page->level == 0);
    page->level = sorted_level_here(host, page->x, page->z);
    host->asked += !page->only_level;
    if (page->level == TERRIMP_SORTED_ABSENT || page->only_level)
        return;
    host->drawn++;
    step = 1 << page->level;
    side = 64 / step + 1;
    for (z = 0; z < side; z++)
        for (x = 0; x < side; x++)
            host->samples[z * side + x] =
                sorted_heights[((page->z & 7) * 64 + z * step) * SORTED_SIDE +
                               (page->x & 7) * 64 + x * step];
    page->samples = host->samples;
    page->row_bytes = (size_t)side * sizeof(float);
}

static terrimp_sorted_desc sorted_hosted(sorted_host *host)
{
    terrimp_sorted_desc desc = sorted_hills();
    memset(host, 0, sizeof *host);
    desc.field.samples = NULL;
    desc.field.width = desc.field.depth = 0;
    desc.low = -40.0f;
    desc.high = 40.0f;
    desc.user = host;
    desc.page = sorted_give_page;
    return desc;
}

static void sorted_pages_come_from_the_host(void)
{
    static terrimp_sorted_square before[SORTED_MOST];
    static sorted_host host;
    terrimp_sorted_desc desc = sorted_hosted(&host), field = sorted_hills();
    terrimp_sorted s;
    terrimp_camera camera;
    int i;
    uint32_t count;
    sorted_make_hills(8.0f);
    field.low = desc.low, field.high = desc.high;
    for (i = 0; i < 20; i++) {
        CHECK(terrimp_sorted_init(&field, &s) == TERRIMP_OK);
        camera = sorted_camera(&s.desc);
        memset(sorted_squares, 0, sizeof sorted_squares);
        sorted_frame(&s, &camera);
        count = sorted_count;
        memcpy(before, sorted_squares, sizeof before);
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        memset(sorted_squares, 0, sizeof sorted_squares);
        sorted_frame(&s, &camera);
        CHECK(sorted_count == count && memcmp(before, sorted_squares, sizeof before) == 0);
    }
    CHECK(host.asked > 100);
}

/* With levels missing here and there: no cracks, no wrong order; heights that are here are right,
   others between those that are. */
static void sorted_pages_may_be_coarse_or_absent(void)
{
    static sorted_host host;
    terrimp_sorted_desc desc = sorted_hosted(&host);
    int i, cracks = 0, faults = 0, seen = 0, absent = 0, own = 0, k;
    uint32_t q;
    sorted_make_hills(8.0f);
    for (i = 0; i < 60; i++) {
        terrimp_sorted s;
        terrimp_camera camera;
        double area = 0.0;
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        host.seed = random_bits();
        host.coarsest = random_range(1, 6);
        host.none = i & 1;
        camera = sorted_camera(&s.desc);
        host.asked = host.drawn = 0;
        sorted_frame(&s, &camera);
        absent += (int)(host.asked - host.drawn);
        cracks += sorted_count_cracks(&area);
        faults += order_faults(&s, &camera, &seen);
        for (q = 0; q < sorted_count; q++)
            for (k = 0; k < sorted_squares[q].vertex_count; k++) {
                const terrimp_sorted_vertex *v = &sorted_squares[q].vertices[k];
                uint32_t here = sorted_level_here(&host, sorted_squares[q].page_x,
                                                  sorted_squares[q].page_z);
                CHECK(here != TERRIMP_SORTED_ABSENT);
                if (((v->x | v->z) & 63) == 0) { /* of all pages that meet here */
                    CHECK(v->height ==
                          sorted_heights[(v->z & 511) * SORTED_SIDE + (v->x & 511)]);
                    own++;
                }
            }
    }
    CHECK(cracks == 0 && faults == 0);
    CHECK(absent > 10 && own > 1000);
}

/* The level of a page's texture: its texels cover 1 to 2 pixels at the page's closest point, give
   or take the tenth that keeps it from flickering; and an eye that trembles changes nothing. */
static void sorted_texture_levels_fit_the_screen(void)
{
    static uint8_t levels[64 * 64];
    terrimp_sorted_desc desc = sorted_hills();
    terrimp_sorted s;
    int i, t, changes = 0, seen[16] = { 0 };
    uint32_t k;
    sorted_make_hills(8.0f);
    desc.texture_level_count = 6;
    desc.page_texels = 128;
    desc.texture_levels = levels;
    desc.texture_window = 64;
    CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
    for (i = 0; i < 60; i++) {
        terrimp_camera camera = sorted_camera(&s.desc);
        float factor = 0.0f, x = camera.eye[0];
        uint8_t first[64 * 64];
        camera.z_far = 900.0f;
        CHECK(terrimp_camera_pixel_factor(&camera, &factor) == TERRIMP_OK);
        memset(levels, 255, sizeof levels);
        for (t = 0; t < 8; t++) {
            camera.eye[0] = x + (t & 1 ? 0.5f : -0.5f); /* 1 % and less of most distances */
            sorted_frame(&s, &camera);
            if (t == 0)
                memcpy(first, levels, sizeof first);
        }
        for (k = 0; k < sizeof levels; k++)
            changes += first[k] != 255 && levels[k] != first[k];
        for (k = 0; k < sorted_count; k++) {
            const terrimp_sorted_square *q = &sorted_squares[k];
            float dx = fmaxf(fmaxf((float)q->page_x * 64.0f - camera.eye[0],
                                   camera.eye[0] - (float)(q->page_x + 1) * 64.0f), 0.0f);
            float dz = fmaxf(fmaxf((float)q->page_z * 64.0f - camera.eye[2],
                                   camera.eye[2] - (float)(q->page_z + 1) * 64.0f), 0.0f);
            float dy = fmaxf(fmaxf(s.desc.low - camera.eye[1], camera.eye[1] - s.desc.high), 0.0f);
            float away = sqrtf(dx * dx + dy * dy + dz * dz);
            float pixels = 0.5f * (float)(1 << q->texture_level) * factor / away;
            CHECK(q->texture_level == 0 || pixels < 1.12f);
            CHECK(q->texture_level == 5 || pixels > 0.44f);
            seen[q->texture_level]++;
        }
    }
    CHECK(changes < 60); /* those first seen late, and the closest pages */
    CHECK(seen[0] > 0 && seen[1] > 0 && seen[2] > 0);
}

/* Halving agrees with its definition, and pages that share a border keep on sharing it. */
static void sorted_halving_keeps_borders(void)
{
    static uint8_t map[65 * 65 * 3], page[2][33 * 65 * 3], half[33 * 33 * 3], part[2][17 * 33 * 3];
    int x, y, c, i, wrap;
    for (i = 0; i < (int)sizeof map; i++)
        map[i] = (uint8_t)random_bits();
    for (i = 0; i < 2; i++)
        for (y = 0; y < 65; y++)
            memcpy(page[i] + y * 33 * 3, map + (y * 65 + i * 32) * 3, 33 * 3);
    for (i = 0; i < 2; i++)
        CHECK(terrimp_sorted_halve(page[i], 33, 65, 3, 0, part[i]) == TERRIMP_OK);
    for (y = 0; y < 33; y++)
        CHECK(memcmp(part[0] + (y * 17 + 16) * 3, part[1] + y * 17 * 3, 3) == 0);
    for (y = 0; y < 65; y++) /* a map that repeats */
        memcpy(map + (y * 65 + 64) * 3, map + y * 65 * 3, 3);
    memcpy(map + 64 * 65 * 3, map, 65 * 3);
    for (wrap = 0; wrap < 2; wrap++) {
        CHECK(terrimp_sorted_halve(map, 65, 65, 3, wrap, half) == TERRIMP_OK);
        for (y = 0; y < 33; y++)
            for (x = 0; x < 33; x++)
                for (c = 0; c < 3; c++) {
                    int dx, dz, sum = 0, weight = 0;
                    for (dz = -1; dz <= 1; dz++)
                        for (dx = -1; dx <= 1; dx++) {
                            int u = (2 * x + dx + 64) % 64, v = (2 * y + dz + 64) % 64;
                            int w = (2 - abs(dx)) * (2 - abs(dz));
                            if (!wrap && ((dx && x % 32 == 0) || (dz && y % 32 == 0)))
                                continue;
                            sum += w * map[(v * 65 + u) * 3 + c];
                            weight += w;
                        }
                    CHECK(half[(y * 33 + x) * 3 + c] == (2 * sum + weight) / (2 * weight));
                }
    }
    CHECK(terrimp_sorted_halve(NULL, 65, 65, 3, 0, half) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_halve(map, 65, 65, 3, 0, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_halve(map, 64, 65, 3, 0, half) == TERRIMP_E_RANGE);
    CHECK(terrimp_sorted_halve(map, 65, 1, 3, 0, half) == TERRIMP_E_RANGE);
    CHECK(terrimp_sorted_halve(map, 65, 65, 5, 0, half) == TERRIMP_E_RANGE);
    CHECK(terrimp_sorted_halve(map, 65, 65, 0, 0, half) == TERRIMP_E_RANGE);
}

/* ---- pace ---- */

/* Over flights: triangles stay within 3 % of what was asked for, and hardly change between frames;
   where even the smallest scale needs more, that is used. */
static void sorted_keeps_to_its_triangles(void)
{
    static const uint32_t most[4] = { 400, 1000, 2500, 6000 };
    int i, k, frame, outside = 0, jumps = 0, fields = 0;
    sorted_make_hills(8.0f);
    for (i = 0; i < 8; i++)
        for (k = 0; k < 4; k++) {
            terrimp_sorted_desc desc = sorted_hills();
            terrimp_sorted s;
            terrimp_camera camera;
            float turn = random_float(0.0f, 6.28f), rate = random_float(-0.05f, 0.05f);
            uint32_t before = 0;
            desc.max_triangles = most[k];
            CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
            camera = sorted_camera(&s.desc);
            camera.eye[1] = random_float(5.0f, 40.0f);
            camera.forward[1] = random_float(-0.4f, 0.0f);
            camera.fov_y_rad = 1.0f;
            camera.z_far = 400.0f;
            for (frame = 0; frame < 40; frame++) {
                camera.forward[0] = cosf(turn + rate * (float)frame);
                camera.forward[2] = sinf(turn + rate * (float)frame);
                camera.eye[0] += camera.forward[0];
                camera.eye[2] += camera.forward[2];
                sorted_frame(&s, &camera);
                if (s.scale <= 2.0f) {
                    before = 0;
                    continue;
                }
                fields++;
                outside += (float)s.triangle_count < 0.97f * (float)most[k] ||
                           s.triangle_count > most[k];
                jumps += before && fabsf((float)s.triangle_count - (float)before) >
                                       0.05f * (float)before;
                before = s.triangle_count;
            }
        }
    CHECK(fields > 600);
    CHECK(outside * 200 <= fields); /* one split can be more than that of 400 */
    CHECK(jumps * 200 <= fields);
}

/* Time rises with triangles by some law; the pace finds the allowance whatever it starts from, from
   one side, and stays there. */
static void sorted_pace_comes_to_rest(void)
{
    int i, frame;
    for (i = 0; i < 300; i++) {
        float fixed = random_float(0.0f, 8.0f), each = powf(10.0f, random_float(-4.0f, -2.0f));
        float target = fixed + random_float(4.0f, 30.0f), ms = 0.0f;
        float triangles = (float)(1u << random_range(0, 17)), before;
        int side = 0, turns = 0;
        for (frame = 0; frame < 800; frame++) {
            int now;
            ms = fixed + each * floorf(triangles);
            before = triangles;
            triangles = terrimp_view_pace(triangles, ms, target);
            CHECK(triangles >= 0.949f * before && triangles <= 1.021f * before);
            now = triangles > before ? 1 : triangles < before ? -1 : 0;
            turns += side && now && now != side;
            side = now ? now : side;
        }
        CHECK(turns == 0);
        CHECK(ms >= 0.97f * target && ms <= 1.03f * target);
    }
    CHECK(fabsf(terrimp_view_pace(1000.0f, 4e4f, 16.0f) - 950.0f) < 0.01f);
    CHECK(terrimp_view_pace(1000.0f, not_a_number(), 16.0f) == 1000.0f);
    CHECK(terrimp_view_pace(1000.0f, 0.0f, 16.0f) == 1000.0f);
    CHECK(terrimp_view_pace(1000.0f, 30.0f, 0.0f) == 1000.0f);
    CHECK(terrimp_view_pace(0.0f, 1.0f, 16.0f) == 0.0f);
}

/* The farthest corner of a square that the frame has. */
static float sorted_reach(const terrimp_camera *camera)
{
    float reach = 0.0f;
    uint32_t i;
    for (i = 0; i < sorted_count; i++) {
        const terrimp_sorted_vertex *v = sorted_squares[i].vertices;
        reach = fmaxf(reach, hypotf((float)v->x - camera->eye[0], (float)v->z - camera->eye[2]));
    }
    return reach;
}

/* An eye that sinks sees less far, step by step, and as far as it can at the height given. */
static void sorted_horizon_comes_in(void)
{
    terrimp_sorted_desc desc = sorted_hills();
    terrimp_sorted s;
    terrimp_camera camera;
    float before = 0.0f, all, reach;
    int i;
    sorted_make_hills(1.0f);
    CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
    camera = sorted_camera(&s.desc);
    camera.eye[0] = camera.eye[2] = 0.0f;
    camera.forward[1] = -0.1f;
    camera.fov_y_rad = 1.0f;
    camera.z_far = 1000.0f;
    desc.low_far = 100.0f;
    desc.low_height = 20.0f;
    for (i = 0; i <= 20; i += 4) {
        camera.eye[1] = sorted_heights[0] + (float)i;
        desc.low_far = 0.0f;
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        sorted_frame(&s, &camera);
        all = sorted_reach(&camera);
        desc.low_far = 100.0f;
        CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
        sorted_frame(&s, &camera);
        reach = sorted_reach(&camera);
        CHECK(i < 20 ? reach < all && reach > before : reach == all);
        before = reach;
    }
}

/* ---- bad input ---- */

static void sorted_refuses_bad_input(void)
{
    static const float flat_table[7] = { 0, 2, 4, 4, 16, 32, 64 };
    static const float steep_table[7] = { 0, 1, 2, 4, 8, 16, 32 };
    static float no_height[4];
    terrimp_sorted_desc good = sorted_hills(), bad, out;
    terrimp_sorted s, untouched;
    terrimp_sorted_square square;
    terrimp_camera camera;
    int i;
    sorted_make_hills(8.0f);
    CHECK(sizeof s <= 2048);
    CHECK(terrimp_sorted_desc_resolve(NULL, &out) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_desc_resolve(&good, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_init(&good, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_begin(NULL, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_sorted_next(NULL, &square, 1) == 0);
    memset(&s, 1, sizeof s);
    untouched = s;
    for (i = 0; i < 25; i++) {
        terrimp_result wanted = TERRIMP_E_RANGE;
        bad = good;
        switch (i) {
        case 0: bad.page_quads = 1; break;
        case 1: bad.page_quads = 48; break;
        case 2: bad.page_quads = 2048; break;
        case 3: bad.scale = 1.99f; break;
        case 4: bad.scale = -1.0f; break;
        case 5: bad.table = flat_table; break;
        case 6: bad.table = steep_table, bad.scale = 3.0f; break;
        case 7: bad.low = 1.0f; break;
        case 8: bad.low_far = -1.0f; break;
        case 9: bad.low_height = -1.0f; break;
        case 10: bad.page_texels = 100; break;
        case 11: bad.texture_level_count = 17; break;
        case 12: bad.texels_per_px = -1.0f; break;
        case 13: bad.texture_window = 33; break;
        case 14: bad.field.width = 512; break;
        case 15: bad.page_quads = 1024; break; /* the field wraps within a page */
        case 16: bad.scale = not_a_number(), wanted = TERRIMP_E_NOT_FINITE; break;
        case 17: bad.high = not_a_number(), wanted = TERRIMP_E_NOT_FINITE; break;
        case 18: bad.low_far = not_a_number(), wanted = TERRIMP_E_NOT_FINITE; break;
        case 19: bad.low_height = not_a_number(), wanted = TERRIMP_E_NOT_FINITE; break;
        case 20: bad.texels_per_px = not_a_number(), wanted = TERRIMP_E_NOT_FINITE; break;
        case 21: bad.field.samples = NULL, wanted = TERRIMP_E_NULL; break;
        case 22: bad.field.origin_x = not_a_number(), wanted = TERRIMP_E_NOT_FINITE; break;
        case 23: bad.field.no_data = (float)sorted_heights[1000], bad.field.has_no_data = 1;
                 wanted = TERRIMP_E_VOID;
                 break;
        default: bad.field.wrap = 0, bad.field.width = bad.field.depth = 2;
                 bad.field.samples = no_height, no_height[3] = not_a_number();
                 wanted = TERRIMP_E_NOT_FINITE;
        }
        CHECK(terrimp_sorted_init(&bad, &s) == wanted);
        CHECK(memcmp(&s, &untouched, sizeof s) == 0);
    }
    good.table = steep_table;
    good.scale = 4.0f;
    CHECK(terrimp_sorted_init(&good, &s) == TERRIMP_OK);
    for (i = 0; i < 8; i++) {
        terrimp_result wanted = TERRIMP_E_RANGE;
        camera = sorted_camera(&s.desc);
        CHECK(terrimp_sorted_begin(&s, &camera) == TERRIMP_OK);
        switch (i) {
        case 0: camera.z_far = 1e9f; break;
        case 1: camera.z_far = FLT_MAX; break;
        case 2: camera.eye[0] = 1e9f; break;
        case 3: camera.eye[2] = -FLT_MAX; break;
        case 4: camera.z_near = 0.0f; break;
        case 5: camera.eye[0] = not_a_number(), wanted = TERRIMP_E_NOT_FINITE; break;
        case 6: camera.eye[1] = not_a_number(), wanted = TERRIMP_E_NOT_FINITE; break;
        default: camera.forward[1] = not_a_number(), wanted = TERRIMP_E_NOT_FINITE;
        }
        camera.forward[1] = i < 2 ? -0.1f : camera.forward[1];
        CHECK(terrimp_sorted_begin(&s, &camera) == wanted);
        CHECK(terrimp_sorted_next(&s, &square, 1) == 0); /* no frame, rather than the old one */
    }
    CHECK(terrimp_sorted_begin(&s, NULL) == TERRIMP_E_NULL);
}

/* Cameras that see everything, nothing or a line: no crash, no endless frame. */
static void sorted_bears_odd_cameras(void)
{
    terrimp_sorted_desc desc = sorted_hills();
    terrimp_sorted s;
    int i;
    sorted_make_hills(8.0f);
    CHECK(terrimp_sorted_init(&desc, &s) == TERRIMP_OK);
    for (i = 0; i < 60; i++) {
        terrimp_camera camera = sorted_camera(&s.desc);
        switch (i % 6) {
        case 0: camera.fov_y_rad = 3.1f; camera.z_far = 60.0f; break;
        case 1: camera.fov_y_rad = 0.001f; break;
        case 2: camera.forward[0] = camera.forward[2] = 0.0f, camera.forward[1] = -1.0f; break;
        case 3: camera.forward[0] = camera.forward[2] = 0.0f, camera.forward[1] = 1.0f;
                camera.eye[1] = 100.0f; break;
        case 4: camera.eye[1] = 1e18f; break;
        default: camera.eye[1] = -1e9f, camera.z_far = 1e7f;
        }
        sorted_frame(&s, &camera);
        CHECK(i % 6 < 3 || sorted_count == 0);
    }
}

static inline void sorted_tests(void)
{
    RUN(sorted_needs_no_depth_buffer);
    RUN(views_in_painters_order_need_no_depth_buffer);
    RUN(views_of_tiles_need_no_depth_buffer);
    RUN(pictures_are_made_in_painters_order);
    RUN(pieces_of_pictures_are_in_painters_order);
    RUN(views_keep_to_their_cost);
    RUN(views_without_end_or_of_a_cost_refuse_bad_input);
    RUN(views_that_wrap_show_what_nine_terrains_show);
    RUN(views_that_wrap_repeat_after_a_period);
    RUN(painters_order_has_the_triangles_of_the_pattern);
    RUN(a_circle_of_a_mesh_is_told_and_the_rest_is_in_order);
    RUN(painters_order_refuses_bad_input);
    RUN(sorted_needs_no_depth_buffer_over_mountains);
    RUN(sorted_needs_no_depth_buffer_over_hills);
    RUN(sorted_squares_meet_without_cracks);
    RUN(sorted_patterns_are_ordered);
    RUN(sorted_squares_at_the_end_are_ordered);
    RUN(sorted_draws_little_that_is_not_seen);
    RUN(sorted_frames_cost_what_their_triangles_do);
    RUN(sorted_draws_all_that_is_seen);
    RUN(sorted_levels_change_without_a_pop);
    RUN(sorted_repeats_after_a_period);
    RUN(field_that_wraps_is_endless);
    RUN(rays_over_a_field_that_wraps_end);
    RUN(sorted_pages_come_from_the_host);
    RUN(sorted_pages_may_be_coarse_or_absent);
    RUN(sorted_texture_levels_fit_the_screen);
    RUN(sorted_halving_keeps_borders);
    RUN(sorted_keeps_to_its_triangles);
    RUN(sorted_pace_comes_to_rest);
    RUN(sorted_horizon_comes_in);
    RUN(sorted_refuses_bad_input);
    RUN(sorted_bears_odd_cameras);
}

#endif
