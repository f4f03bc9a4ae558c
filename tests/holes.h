/* Random flights in every mode that are held against the full mesh: no hole anywhere, no terrain
   where there is sky. A true hole is a pixel of sky where the full mesh has terrain, from where no
   way leads over pixels of sky to the real sky: a silhouette that is a little too low is none.
   Everything follows from the seed of a scene: a terrain, its settings, and some paths; along each
   path several views with settings of their own, and for each pose one picture of the full mesh. */
#ifndef HOLES_H
#define HOLES_H

#include "check.h"

#include "terrimp.h"

#include "examples/host/dem.h"
#include "examples/host/gl_terrain.h"
#include "examples/host/image.h"
#include "examples/host/lightmap.h"
#include "examples/host/procedural.h"
#include "examples/host/tour.h"

#include <math.h>
#include <string.h>

enum { HOLES_PATHS = 6, HOLES_POSES = 12, HOLES_WAYS = 4 };

/* Where the eyes of a path are. */
enum { HOLES_OVER, HOLES_LOW, HOLES_HIGH, HOLES_BESIDE, HOLES_AFAR, HOLES_UNDER, HOLES_PLACES };
static const char *const holes_places[HOLES_PLACES] = { "over", "low", "high", "beside", "afar",
                                                        "under" };
static const char *const holes_ways[HOLES_WAYS] = { "auto", "auto eager", "impostor", "geomip" };

/* What came of a frame, or of many. Pixels:
   holes   true ones, but for those that follow
   slits   true ones of which each has sky of the full mesh within two pixels: skylines that are as
           close to their places as a filter of textures keeps them, but meet where it is narrow
   shreds  true ones of which each comes from below, see holes_from_below; or at the picture's edge,
           whose sky may be outside
   torn    sky, though the full mesh has none within the tolerance and 2 pixels, with or without a
           way to the real sky, and none that comes from below: the skyline is cut off
   added   terrain, though the full mesh has none as close as that */
typedef struct holes_sum {
    unsigned frames, frames_with_holes, frames_with_slits, frames_with_torn, frames_with_added;
    size_t holes, slits, shreds, torn, added;
    double squares;      /* sum of the frames' mean squares over terrain */
} holes_sum;

/* A frame that was drawn: what a report, or someone who looks, may want of it. */
typedef struct holes_frame {
    uint32_t seed;
    int path, pose, way, place;
    int width, height;
    size_t holes, slits, shreds, torn, added;
    size_t first; /* y * width + x of the first pixel of a hole, else of what is torn */
    double mean_square;
    terrimp_stats stats;
    const uint8_t *rgb, *full;
} holes_frame;

typedef struct holes_scene {
    uint32_t seed;
    char name[80];
    dem dem;
    terrimp_heightfield field;
    terrimp_terrain *terrain;
    terrimp_terrain_info info;
    float low, high;     /* of the samples [wu] */
    uint8_t *lightmap;
    context context;
    gl_terrain gl;
    uint8_t *rgb, *full; /* one picture; [HOLES_POSES] of them */
    uint8_t *marks;      /* [height][width] */
    uint32_t *stack;     /* [height * width] */
} holes_scene;

static void holes_need(const char *trouble)
{
    if (trouble) {
        fprintf(stderr, "holes: %s\n", trouble);
        exit(2);
    }
}

static void holes_need_ok(terrimp_result result)
{
    holes_need(result == TERRIMP_OK ? NULL : terrimp_result_text((int)result));
}

static int holes_one_in(uint32_t n)
{
    return random_range(1, n) == 1;
}

/* ---- Terrains ----------------------------------------------------------- */

/* Noise with slopes of up to 45 degrees and more at every scale. */
static float *holes_rough(uint32_t width, uint32_t depth, float steepness)
{
    float *heights = (float *)calloc((size_t)width * depth, sizeof *heights);
    uint32_t step, x, z, salt = random_bits();
    holes_need(heights ? NULL : "out of memory");
    for (step = 64; step; step /= 2)
        for (z = 0; z < depth; z++)
            for (x = 0; x < width; x++) {
                float u = (float)(x % step) / (float)step, v = (float)(z % step) / (float)step;
                float corner[4];
                uint32_t i;
                for (i = 0; i < 4; i++) {
                    uint32_t h = (x / step + i % 2) * 73856093u ^ (z / step + i / 2) * 19349663u;
                    h = (h ^ salt ^ step) * 2654435761u;
                    h = (h ^ h >> 15) * 2246822519u;
                    corner[i] = (float)(h >> 8) * (1.0f / 16777216.0f);
                }
                heights[z * width + x] += steepness * (float)step
                    * ((corner[0] * (1.0f - u) + corner[1] * u) * (1.0f - v)
                       + (corner[2] * (1.0f - u) + corner[3] * u) * v);
            }
    return heights;
}

/* Large shapes that put the outer border high or low: a bowl, an island, a slope, terraces. */
static void holes_shape(float *heights, uint32_t width, uint32_t depth)
{
    int kind = (int)random_range(0, 4);
    float much = random_float(0.1f, 0.5f) * (float)width;
    uint32_t x, z;
    for (z = 0; z < depth; z++)
        for (x = 0; x < width; x++) {
            float u = 2.0f * (float)x / (float)(width - 1u) - 1.0f;
            float v = 2.0f * (float)z / (float)(depth - 1u) - 1.0f;
            float *h = heights + z * width + x;
            if (kind == 0)
                *h += much * 0.5f * (u * u + v * v);
            else if (kind == 1)
                *h -= much * 0.5f * (u * u + v * v);
            else if (kind == 2)
                *h += much * 0.5f * u;
            else if (kind == 3)
                *h = 12.0f * floorf(*h / 12.0f);
        }
}

static void holes_make_samples(holes_scene *s, int is_rough)
{
    static const uint32_t sides[] = { 129, 150, 193, 257, 257, 321 };
    uint32_t width = sides[random_range(0, 5)];
    uint32_t depth = holes_one_in(3) ? sides[random_range(0, 5)] : width;
    s->dem.width = width;
    s->dem.depth = depth;
    s->dem.spacing_x = holes_one_in(4) ? random_float(0.5f, 2.0f) : 1.0f;
    s->dem.spacing_z = holes_one_in(4) ? random_float(0.5f, 2.0f) : s->dem.spacing_x;
    if (is_rough) {
        float *heights = holes_rough(width, depth, random_float(0.1f, 0.7f));
        if (holes_one_in(2))
            holes_shape(heights, width, depth);
        s->dem.samples = heights;
        s->dem.format = TERRIMP_FORMAT_F32;
    } else {
        s->dem.samples = procedural_terrain(width, depth, s->seed);
        s->dem.format = TERRIMP_FORMAT_U16;
        holes_need(s->dem.samples ? NULL : "no memory for the terrain");
    }
    s->field = dem_heightfield(&s->dem);
    if (!is_rough)
        s->field.height_scale = PROCEDURAL_HEIGHT_SCALE * random_float(0.3f, 1.5f);
    snprintf(s->name, sizeof s->name, "%s %u x %u", is_rough ? "rough" : "procedural",
             (unsigned)width, (unsigned)depth);
}

/* A part of a real tile. Returns 0 when the tile is not there. */
static int holes_load_samples(holes_scene *s)
{
    static const char *const files[] = { "N41E001.hgt", "N42E001.hgt", "N48W125.hgt",
                                         "N49E011.hgt" };
    const char *file = files[random_range(0, 3)], *folder = getenv("TERRIMP_DATA"), *trouble;
    dem_desc part;
    char path[1024];
    FILE *probe;
    memset(&part, 0, sizeof part);
    part.crop_width = random_range(150, 400);
    part.crop_depth = random_range(150, 400);
    part.crop_x = random_range(0, 800);
    part.crop_z = random_range(0, 800);
    snprintf(path, sizeof path, "%s/%s", folder && *folder ? folder : "../shared/data", file);
    probe = fopen(path, "rb");
    if (!probe)
        return 0;
    fclose(probe);
    if (!dem_load(&s->dem, path, &part))
        holes_need(s->dem.error);
    dem_fill_voids(&s->dem, &trouble);
    if (trouble) { /* nothing but voids */
        dem_free(&s->dem);
        return 0;
    }
    s->field = dem_heightfield(&s->dem);
    snprintf(s->name, sizeof s->name, "%s %u x %u", file, (unsigned)part.crop_width,
             (unsigned)part.crop_depth);
    return 1;
}

static void holes_close(holes_scene *s)
{
    gl_terrain_close(&s->gl);
    context_close(&s->context);
    terrimp_terrain_destroy(s->terrain);
    dem_free(&s->dem);
    free(s->lightmap);
    free(s->rgb);
    free(s->full);
    free(s->marks);
    free(s->stack);
}

/* Opens pictures of a size and an atlas. */
static void holes_show(holes_scene *s, const int size[2], uint32_t atlas)
{
    size_t pixels = (size_t)size[0] * (size_t)size[1];
    gl_terrain_desc desc;
    memset(&desc, 0, sizeof desc);
    holes_need(context_open(&s->context, size[0], size[1]));
    s->lightmap = lightmap_bake(&s->field);
    s->rgb = (uint8_t *)malloc(pixels * 3);
    s->full = (uint8_t *)malloc(pixels * 3 * HOLES_POSES);
    s->marks = (uint8_t *)malloc(pixels);
    s->stack = (uint32_t *)malloc(pixels * sizeof *s->stack);
    holes_need(s->lightmap && s->rgb && s->full && s->marks && s->stack ? NULL : "out of memory");
    desc.frame = &s->context;
    desc.terrain = s->terrain;
    desc.field = &s->field;
    desc.lightmap = s->lightmap;
    desc.atlas_size = atlas;
    holes_need(gl_terrain_open(&s->gl, &desc));
}

/* Builds the terrain of samples that are there. */
static void holes_build(holes_scene *s, uint32_t chunk_quads, uint32_t triangle_budget)
{
    terrimp_terrain_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.field = s->field;
    desc.chunk_quads = chunk_quads;
    desc.triangle_budget = triangle_budget;
    holes_need_ok(terrimp_terrain_create(&desc, NULL, &s->terrain));
    holes_need_ok(terrimp_terrain_get_info(s->terrain, &s->info));
    holes_need_ok(terrimp_heightfield_bounds(&s->field, 0, 0, s->field.width, s->field.depth,
                                             &s->low, &s->high));
    snprintf(s->name + strlen(s->name), sizeof s->name - strlen(s->name), ", chunks of %u",
             (unsigned)chunk_quads);
}

/* A chunk side that makes at least two chunks. */
static uint32_t holes_chunk(const terrimp_heightfield *f)
{
    static const uint32_t sides[] = { 16, 32, 64, 64 };
    uint32_t quads = sides[random_range(0, 3)];
    return f->width / quads * (f->depth / quads) >= 4 ? quads : 16;
}

static void holes_open(holes_scene *s, uint32_t seed)
{
    static const int sizes[][2] = { { 128, 96 }, { 160, 128 }, { 200, 120 }, { 320, 256 } };
    static const uint32_t atlases[] = { 256, 512, 1024, 2048, 4096 };
    uint32_t kind, chunk_quads;
    const int *size;
    memset(s, 0, sizeof *s);
    s->seed = seed;
    check_state = seed * 2654435761u + 12345u;
    check_state = check_state ? check_state : 1u;
    for (kind = 0; kind < 8; kind++)
        random_bits();
    kind = random_range(0, 5);
    if (kind > 1 || !holes_load_samples(s))
        holes_make_samples(s, kind > 3);
    chunk_quads = holes_chunk(&s->field);
    holes_build(s, chunk_quads, holes_one_in(4) ? random_range(32, 200) : 0);
    size = sizes[random_range(0, 3)];
    holes_show(s, size, atlases[random_range(0, 4)]);
}

/* ---- Paths -------------------------------------------------------------- */

typedef struct holes_path {
    int place;
    float fov, up[3];
    flight_pose poses[HOLES_POSES];
} holes_path;

static float holes_ground(const holes_scene *s, const float eye[3])
{
    float ground;
    return terrimp_heightfield_height(&s->field, eye[0], eye[2], &ground) == TERRIMP_OK
               ? ground : s->low;
}

/* A point within the middle of the terrain, `most` of its sides away from the centre at most. */
static void holes_point(const holes_scene *s, float most, float point[3])
{
    const terrimp_box *box = &s->info.box;
    int i;
    for (i = 0; i < 3; i += 2)
        point[i] = box->min[i] + random_float(0.5f - most, 0.5f + most)
                                     * (box->max[i] - box->min[i]);
    point[1] = holes_ground(s, point);
}

/* Where a path begins: its first eye. */
static void holes_begin(const holes_scene *s, int place, float eye[3])
{
    const terrimp_box *box = &s->info.box;
    float side = box->max[0] - box->min[0], range = s->high - s->low;
    float turn = random_float(0.0f, 6.283f), out;
    holes_point(s, 0.45f, eye);
    if (place == HOLES_OVER)
        eye[1] += range * random_float(0.05f, 0.8f) + 0.01f * side;
    else if (place == HOLES_LOW)
        eye[1] += random_float(0.5f, 4.0f) * s->dem.spacing_x;
    else if (place == HOLES_HIGH)
        eye[1] = s->high + random_float(0.1f, 2.0f) * side;
    else if (place == HOLES_UNDER)
        eye[1] -= random_float(0.05f, 1.0f) * (eye[1] - s->low + 0.3f * range);
    else {
        out = place == HOLES_BESIDE ? random_float(0.72f, 1.5f) : random_float(1.5f, 6.0f);
        eye[0] = box->min[0] + side * (0.5f + out * cosf(turn));
        eye[2] = box->min[2] + (box->max[2] - box->min[2]) * (0.5f + out * sinf(turn));
        eye[1] = s->low + range * random_float(-0.5f, 2.0f);
    }
}

/* Keeps an eye over the ground, or under it, as its place says. */
static void holes_keep(const holes_scene *s, int place, float eye[3])
{
    float ground = holes_ground(s, eye), least = 0.5f * s->dem.spacing_x;
    if (place <= HOLES_HIGH && eye[1] < ground + least)
        eye[1] = ground + least;
    if (place == HOLES_UNDER && eye[1] > ground - 0.1f * least)
        eye[1] = ground - 0.1f * least;
}

static void holes_plan(const holes_scene *s, int place, holes_path *p)
{
    float eye[3], target[3], speed[3], turn[3];
    float fast = s->dem.spacing_x * (holes_one_in(4) ? 12.0f : 1.3f);
    int i, k;
    memset(p, 0, sizeof *p);
    p->place = place;
    p->fov = random_float(0.4f, 1.4f);
    if (holes_one_in(4))
        for (i = 0; i < 3; i++)
            p->up[i] = random_float(-1.0f, 1.0f);
    holes_begin(s, place, eye);
    holes_point(s, 0.4f, target);
    if (place <= HOLES_LOW && holes_one_in(2)) /* across the horizon */
        target[1] = eye[1] + random_float(-0.3f, 0.1f) * (fabsf(target[0] - eye[0])
                                                          + fabsf(target[2] - eye[2]));
    if (place == HOLES_UNDER && holes_one_in(2))
        target[1] = eye[1] + random_float(-1.0f, 1.0f) * (s->high - s->low);
    if (place == HOLES_AFAR)
        p->fov = random_float(0.1f, 0.6f);
    for (i = 0; i < 3; i++) {
        speed[i] = fast * random_float(-1.0f, 1.0f) * (i == 1 ? 0.2f : 1.0f);
        turn[i] = fast * random_float(-1.0f, 1.0f) * (i == 1 ? 0.2f : 1.0f);
    }
    for (k = 0; k < HOLES_POSES; k++) {
        holes_keep(s, place, eye);
        memcpy(p->poses[k].eye, eye, sizeof eye);
        memcpy(p->poses[k].target, target, sizeof target);
        for (i = 0; i < 3; i++) {
            eye[i] += speed[i];
            target[i] += turn[i];
        }
        if (holes_one_in(20) && place != HOLES_UNDER)
            holes_begin(s, place, eye); /* a teleport */
    }
}

/* ---- Views -------------------------------------------------------------- */

/* Settings in a mode: the defaults half of the time. */
static terrimp_view_desc holes_settings(const holes_scene *s, int way)
{
    static const int modes[HOLES_WAYS] = { TERRIMP_MODE_AUTO, TERRIMP_MODE_AUTO,
                                           TERRIMP_MODE_IMPOSTOR, TERRIMP_MODE_GEOMIP };
    float chunk = (float)s->info.chunk_quads * s->dem.spacing_x;
    terrimp_view_desc d;
    memset(&d, 0, sizeof d);
    d.mode = modes[way];
    d.atlas_size = (uint32_t)s->gl.atlas_size;
    if (way == 1) {
        d.costs.capture = 1.0f;
        d.costs.triangle = 10.0f;
        d.no_spreading = (int)random_range(0, 1);
        d.max_captures = 1024;
    }
    if (holes_one_in(2))
        return d;
    if (holes_one_in(2))
        d.tolerance_px = powf(2.0f, random_float(-1.0f, 3.0f));
    if (holes_one_in(3))
        d.ground_tolerance_px = powf(2.0f, random_float(-2.0f, 3.0f));
    if (holes_one_in(3))
        d.fade_start = chunk * powf(2.0f, random_float(-5.0f, 1.5f));
    if (holes_one_in(3))
        d.max_angle_rad = random_float(0.02f, 0.4f);
    if (holes_one_in(4))
        d.texels_per_px = random_float(0.5f, 3.0f);
    if (holes_one_in(4))
        d.max_captures = random_range(1, 5);
    if (holes_one_in(6))
        d.max_impostors = random_range(4, 40);
    if (holes_one_in(6))
        d.max_capture_triangles = random_range(4000, 20000);
    d.no_lookahead = holes_one_in(6);
    d.no_splits = holes_one_in(6);
    return d;
}

static terrimp_view *holes_view(const holes_scene *s, const terrimp_view_desc *desc)
{
    terrimp_view *view;
    holes_need_ok(terrimp_view_create(s->terrain, desc, NULL, &view));
    return view;
}

/* ---- Frames ------------------------------------------------------------- */

static const uint8_t holes_sky[3] = { 255, 0, 255 };

static void holes_draw(holes_scene *s, terrimp_view *view, const holes_path *p, int pose,
                       uint8_t *rgb, terrimp_stats *now)
{
    terrimp_camera camera = tour_camera_at(&p->poses[pose], &s->info.box, p->fov,
                                           (uint32_t)s->context.width,
                                           (uint32_t)s->context.height);
    terrimp_callbacks callbacks = gl_terrain_callbacks(&s->gl);
    memcpy(camera.up, p->up, sizeof camera.up);
    holes_need_ok(terrimp_view_update(view, &camera));
    holes_need_ok(terrimp_view_get_stats(view, now));
    tour_tighten(&camera, now);
    holes_need_ok(gl_terrain_begin(&s->gl, &camera, holes_sky));
    holes_need_ok(terrimp_view_render(view, &callbacks));
    gl_terrain_end(&s->gl);
    context_read(&s->context, rgb);
}

static int holes_is_sky(const uint8_t *rgb)
{
    return memcmp(rgb, holes_sky, 3) == 0;
}

/* Marks of pixels, and how far a skyline outside of the frame may reach into it. */
enum { HOLES_TERRAIN, HOLES_LOST, HOLES_REAL_SKY, HOLES_EDGE = 3, HOLES_SLIT = 2 };

static int holes_smaller(int a, int b)
{
    return a < b ? a : b;
}

/* Whether a pixel's ray comes from below: the first of the surface that it meets, it meets from
   behind. What the full mesh shows there are shreds, of slopes seen through slopes. */
static int holes_from_below(const holes_scene *s, const holes_path *p, const holes_frame *f,
                            size_t pixel)
{
    terrimp_camera camera = tour_camera_at(&p->poses[f->pose], &s->info.box, p->fov,
                                           (uint32_t)f->width, (uint32_t)f->height);
    float way[3], along = 0.0f, tan_up, right, up;
    terrimp_ray_hit hit;
    int i;
    memcpy(camera.up, p->up, sizeof camera.up);
    holes_need_ok(terrimp_camera_resolve(&camera, &camera));
    tan_up = tanf(0.5f * p->fov) / (0.5f * (float)f->height);
    right = tan_up * ((float)(pixel % (size_t)f->width) + 0.5f - 0.5f * (float)f->width);
    up = tan_up * (0.5f * (float)f->height - (float)(pixel / (size_t)f->width) - 0.5f);
    for (i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        way[i] = camera.forward[i] + up * camera.up[i]
                 + right * (camera.forward[j] * camera.up[k] - camera.forward[k] * camera.up[j]);
    }
    if (terrimp_heightfield_raycast(&s->field, camera.eye, way, 1e30f, &hit) != TERRIMP_OK)
        return 0;
    for (i = 0; i < 3; i++)
        along += way[i] * hit.normal[i];
    return along > 0.0f;
}

/* Whether the full mesh shows sky within r columns and rows of a pixel. */
static int holes_sky_by(const holes_frame *f, int x, int y, int r)
{
    int i, j;
    for (j = y > r ? y - r : 0; j <= y + r && j < f->height; j++)
        for (i = x > r ? x - r : 0; i <= x + r && i < f->width; i++)
            if (holes_is_sky(f->full + (j * f->width + i) * 3))
                return 1;
    return 0;
}

/* Takes the lost pixels that touch one another, from `pixel` on, marks them as terrain, and counts
   them as what they are: nothing when they touch the real sky. */
static void holes_take(const holes_scene *s, const holes_path *p, holes_frame *f, size_t pixel)
{
    int is_hole = 1, over = 0, wide = 0, at_edge = 0, deep = 0, i, j;
    size_t depth = 0, count = 0;
    s->marks[pixel] = HOLES_TERRAIN;
    s->stack[depth++] = (uint32_t)pixel;
    while (depth) {
        uint32_t at = s->stack[--depth];
        int x = (int)(at % (uint32_t)f->width), y = (int)(at / (uint32_t)f->width);
        int edge = holes_smaller(holes_smaller(x, f->width - 1 - x),
                                 holes_smaller(y, f->height - 1 - y));
        at_edge |= edge == 0;
        deep |= edge >= HOLES_EDGE;
        wide |= !holes_sky_by(f, x, y, HOLES_SLIT);
        over |= !holes_from_below(s, p, f, at);
        count++;
        for (j = y > 0 ? y - 1 : 0; j <= y + 1 && j < f->height; j++)
            for (i = x > 0 ? x - 1 : 0; i <= x + 1 && i < f->width; i++) {
                uint32_t next = (uint32_t)(j * f->width + i);
                if (s->marks[next] == HOLES_REAL_SKY)
                    is_hole = 0;
                if (s->marks[next] != HOLES_LOST)
                    continue;
                s->marks[next] = HOLES_TERRAIN;
                s->stack[depth++] = next;
            }
    }
    if (!is_hole)
        return;
    if (!over || (at_edge && !deep))
        f->shreds += count;
    else if (!wide)
        f->slits += count;
    else {
        f->first = f->holes ? f->first : pixel;
        f->holes += count;
    }
}

static void holes_count(const holes_scene *s, const holes_path *p, holes_frame *f, int reach)
{
    size_t i, count = (size_t)f->width * (size_t)f->height, torn = 0;
    f->holes = f->slits = f->shreds = f->torn = 0;
    for (i = 0; i < count; i++) {
        int x = (int)(i % (size_t)f->width), y = (int)(i / (size_t)f->width);
        s->marks[i] = !holes_is_sky(f->rgb + i * 3) ? HOLES_TERRAIN
                      : holes_is_sky(f->full + i * 3) ? HOLES_REAL_SKY : HOLES_LOST;
        if (s->marks[i] != HOLES_LOST || holes_sky_by(f, x, y, reach) || x < reach || y < reach
            || x + reach >= f->width || y + reach >= f->height || holes_from_below(s, p, f, i))
            continue;
        torn = f->torn++ ? torn : i;
    }
    f->first = torn;
    for (i = 0; i < count; i++)
        if (s->marks[i] == HOLES_LOST)
            holes_take(s, p, f, i);
}

/* Whether the full mesh has terrain within r columns and rows of a pixel, or the edge is there. */
static int holes_terrain_by(const holes_frame *f, int x, int y, int r)
{
    int i, j;
    if (x < r || y < r || x + r >= f->width || y + r >= f->height)
        return 1;
    for (j = y - r; j <= y + r; j++)
        for (i = x - r; i <= x + r; i++)
            if (!holes_is_sky(f->full + (j * f->width + i) * 3))
                return 1;
    return 0;
}

/* Counts terrain farther than r pixels from any that the full mesh has. */
static void holes_count_added(holes_frame *f, int r)
{
    int x, y;
    f->added = 0;
    for (y = 0; y < f->height; y++)
        for (x = 0; x < f->width; x++) {
            size_t at = (size_t)(y * f->width + x) * 3;
            f->added += holes_is_sky(f->full + at) && !holes_is_sky(f->rgb + at)
                        && !holes_terrain_by(f, x, y, r);
        }
}

/* Over the pixels that are terrain in both. */
static double holes_mean_square(const holes_frame *f)
{
    size_t i, k, pixels = (size_t)f->width * (size_t)f->height, count = 0;
    double sum = 0.0;
    for (i = 0; i < pixels; i++) {
        if (holes_is_sky(f->rgb + i * 3) || holes_is_sky(f->full + i * 3))
            continue;
        for (k = i * 3; k < i * 3 + 3; k++)
            sum += (f->rgb[k] - f->full[k]) * (f->rgb[k] - f->full[k]);
        count += 3;
    }
    return count ? sum / (double)count : 0.0;
}

typedef void holes_report(void *user, const holes_scene *s, const holes_path *p,
                          const holes_frame *frame);

/* Flies a path in one way. */
static void holes_fly_way(holes_scene *s, int path, const holes_path *p, int way,
                          holes_report *report, void *user)
{
    terrimp_view_desc desc = holes_settings(s, way);
    terrimp_view *view = holes_view(s, &desc);
    size_t picture = (size_t)s->context.width * (size_t)s->context.height * 3;
    int reach;
    holes_frame f;
    holes_need_ok(terrimp_view_desc_resolve(s->terrain, &desc, &desc));
    reach = 2 + (int)ceilf(fmaxf(desc.tolerance_px, desc.ground_tolerance_px));
    memset(&f, 0, sizeof f);
    f.seed = s->seed;
    f.path = path;
    f.way = way;
    f.place = p->place;
    f.width = s->context.width;
    f.height = s->context.height;
    f.rgb = s->rgb;
    for (f.pose = 0; f.pose < HOLES_POSES; f.pose++) {
        f.full = s->full + picture * (size_t)f.pose;
        holes_draw(s, view, p, f.pose, s->rgb, &f.stats);
        holes_count(s, p, &f, reach);
        holes_count_added(&f, reach);
        f.mean_square = holes_mean_square(&f);
        report(user, s, p, &f);
    }
    terrimp_view_destroy(view);
}

/* Flies one path in all ways; `report` is told of every frame. */
static void holes_fly(holes_scene *s, int path, holes_report *report, void *user)
{
    size_t picture = (size_t)s->context.width * (size_t)s->context.height * 3;
    terrimp_view_desc desc;
    terrimp_view *view;
    terrimp_stats ignored;
    holes_path p;
    int way, pose;
    check_state = s->seed * 2246822519u + (uint32_t)path * 3266489917u + 1u;
    check_state = check_state ? check_state : 1u;
    for (pose = 0; pose < 8; pose++)
        random_bits();
    holes_plan(s, path % (int)HOLES_PLACES, &p);
    memset(&desc, 0, sizeof desc);
    desc.mode = TERRIMP_MODE_FULL;
    desc.atlas_size = (uint32_t)s->gl.atlas_size;
    view = holes_view(s, &desc);
    for (pose = 0; pose < HOLES_POSES; pose++)
        holes_draw(s, view, &p, pose, s->full + picture * (size_t)pose, &ignored);
    terrimp_view_destroy(view);
    for (way = 0; way < HOLES_WAYS; way++)
        holes_fly_way(s, path, &p, way, report, user);
}

static void holes_add(holes_sum *sum, const holes_frame *f)
{
    sum->frames++;
    sum->frames_with_holes += f->holes > 0;
    sum->frames_with_slits += f->slits > 0;
    sum->frames_with_torn += f->torn > 0;
    sum->frames_with_added += f->added > 0;
    sum->holes += f->holes;
    sum->slits += f->slits;
    sum->shreds += f->shreds;
    sum->torn += f->torn;
    sum->added += f->added;
    sum->squares += f->mean_square;
}

#endif
