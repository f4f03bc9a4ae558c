/* A scene of the frame benchmark: a terrain, its light, a flight over it, and the OpenGL that all
   ways of drawing it share. */
#ifndef BENCH_SCENE_H
#define BENCH_SCENE_H

#include "examples/host/context.h"
#include "examples/host/dem.h"
#include "examples/host/flight.h"
#include "examples/host/gl_terrain.h"
#include "examples/host/lightmap.h"
#include "examples/host/procedural.h"
#include "examples/host/stats.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SCENE_WIDTH = 1280, SCENE_HEIGHT = 1024, SCENE_PIXELS = SCENE_WIDTH * SCENE_HEIGHT };
#define SCENE_FOV_RAD 1.0471976f /* 60 degrees */
#define SCENE_FPS 60.0f

static const uint8_t scene_sky[3] = { 168, 200, 232 };

/* What a scene is made of. */
typedef struct scene_desc {
    const char *name;      /* in the tables */
    const char *key;       /* in file names */
    uint32_t size;         /* of a procedural terrain; 0: from a file */
    const char *file;      /* in the directory of the data, or where it says */
    uint32_t crop;         /* samples along a side that are kept; 0: all */
    float spacing, height_scale; /* 0: as the file has it */
    const char *path;      /* in the directory of the data; null: the thesis' circle */
    float speed;           /* along the circle [wu/s]; 0: 80 spacings a second */
} scene_desc;

enum { SCENE_CHUNKS = 2 };
static const uint32_t scene_chunk_quads[SCENE_CHUNKS] = { 64, 128 };

typedef struct scene {
    const scene_desc *desc;
    dem dem;
    terrimp_heightfield field;
    terrimp_box box;
    uint8_t *lightmap;
    const char *shading;       /* of gl_terrain_desc */
    flight flight;
    const context *context;
    terrimp_terrain *terrain[SCENE_CHUNKS]; /* by chunk size; null until it is used */
    gl_terrain gl[SCENE_CHUNKS];            /* of ways that keep no pictures */
    int is_open[SCENE_CHUNKS];
} scene;

static void scene_stop(const char *what, const char *trouble)
{
    fprintf(stderr, "bench: %s: %s\n", what, trouble);
    exit(2);
}

static void need(terrimp_result result)
{
    if (result != TERRIMP_OK)
        scene_stop("terrimp", terrimp_result_text((int)result));
}

static void *need_memory(size_t bytes)
{
    void *memory = malloc(bytes);
    if (!memory)
        scene_stop("memory", "there is none");
    return memory;
}

/* Where the real tiles and the flight paths are. */
static const char *scene_data_directory(void)
{
    const char *directory = getenv("TERRIMP_DATA");
    return directory ? directory : "../shared/data";
}

/* A name with a slash stands for itself. */
static void scene_data_path(const char *name, char *path, size_t size)
{
    if (strncmp(name, "build/", 6) == 0)
        snprintf(path, size, "%s", name);
    else
        snprintf(path, size, "%s/%s", scene_data_directory(), name);
}

static int scene_file_is_there(const char *name)
{
    char path[1024];
    FILE *file;
    if (!name)
        return 1;
    scene_data_path(name, path, sizeof path);
    file = fopen(path, "rb");
    if (file)
        fclose(file);
    return file != NULL;
}

/* ---- Samples ------------------------------------------------------------ */

static void scene_make_samples(scene *s)
{
    uint32_t size = s->desc->size;
    s->dem.samples = procedural_terrain(size, size, 1);
    if (!s->dem.samples)
        scene_stop(s->desc->name, "no memory for the terrain");
    s->dem.width = s->dem.depth = size;
    s->dem.format = TERRIMP_FORMAT_U16;
    s->dem.spacing_x = s->dem.spacing_z = 1.0f;
    s->field = dem_heightfield(&s->dem);
    s->field.height_scale = PROCEDURAL_HEIGHT_SCALE;
}

static void scene_load_samples(scene *s)
{
    char path[1024];
    const char *trouble;
    dem_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.crop_width = desc.crop_depth = s->desc->crop;
    scene_data_path(s->desc->file, path, sizeof path);
    if (!dem_load(&s->dem, path, &desc))
        scene_stop(s->desc->name, s->dem.error);
    dem_fill_voids(&s->dem, &trouble);
    if (trouble)
        scene_stop(s->desc->name, trouble);
    s->field = dem_heightfield(&s->dem);
    if (s->desc->spacing > 0.0f)
        s->field.spacing_x = s->field.spacing_z = s->desc->spacing;
    if (s->desc->height_scale > 0.0f)
        s->field.height_scale = s->desc->height_scale;
}

static void scene_plan_flight(scene *s, size_t frames)
{
    float speed = s->desc->speed > 0.0f ? s->desc->speed : 80.0f * s->field.spacing_x;
    int ok;
    if (s->desc->path) {
        char path[1024];
        scene_data_path(s->desc->path, path, sizeof path);
        ok = flight_load(&s->flight, path);
    } else {
        ok = flight_circle(&s->flight, &s->field, frames, speed / SCENE_FPS);
    }
    if (!ok)
        scene_stop(s->desc->name, s->flight.error);
    if (frames < s->flight.count)
        s->flight.count = frames;
}

/* ---- The scene ---------------------------------------------------------- */

static void scene_open(scene *s, const scene_desc *desc, const context *frame, size_t frames)
{
    memset(s, 0, sizeof *s);
    s->desc = desc;
    s->context = frame;
    if (desc->size)
        scene_make_samples(s);
    else
        scene_load_samples(s);
    s->lightmap = lightmap_bake(&s->field);
    if (!s->lightmap)
        scene_stop(desc->name, "no memory for the lightmap");
    scene_plan_flight(s, frames);
}

/* The terrain with chunks of that many quads, built when it is first asked for. */
static int scene_terrain(scene *s, uint32_t chunk_quads)
{
    terrimp_terrain_desc desc;
    terrimp_terrain_info info;
    int i = 0;
    while (i + 1 < SCENE_CHUNKS && scene_chunk_quads[i] != chunk_quads)
        i++;
    if (s->terrain[i])
        return i;
    memset(&desc, 0, sizeof desc);
    desc.field = s->field;
    desc.chunk_quads = scene_chunk_quads[i];
    need(terrimp_terrain_create(&desc, NULL, &s->terrain[i]));
    need(terrimp_terrain_get_info(s->terrain[i], &info));
    s->box = info.box;
    return i;
}

static void scene_open_gl(scene *s, int terrain, uint32_t atlas_size, gl_terrain *gl)
{
    gl_terrain_desc desc;
    const char *trouble;
    memset(&desc, 0, sizeof desc);
    desc.frame = s->context;
    desc.terrain = s->terrain[terrain];
    desc.field = &s->field;
    desc.lightmap = s->lightmap;
    desc.atlas_size = atlas_size;
    desc.shading = s->shading;
    trouble = gl_terrain_open(gl, &desc);
    if (trouble)
        scene_stop(s->desc->name, trouble);
}

/* The OpenGL side for ways that keep no pictures: its atlases are as small as may be. */
static gl_terrain *scene_shared_gl(scene *s, int terrain)
{
    if (!s->is_open[terrain])
        scene_open_gl(s, terrain, 64, &s->gl[terrain]);
    s->is_open[terrain] = 1;
    return &s->gl[terrain];
}

/* The camera of a frame; its clip distances hold the whole terrain. */
static terrimp_camera scene_camera(const scene *s, size_t frame)
{
    const flight_pose *pose = &s->flight.poses[frame];
    terrimp_camera camera;
    int i;
    memset(&camera, 0, sizeof camera);
    for (i = 0; i < 3; i++) {
        camera.eye[i] = pose->eye[i];
        camera.forward[i] = pose->target[i] - pose->eye[i];
    }
    camera.fov_y_rad = SCENE_FOV_RAD;
    camera.width_px = SCENE_WIDTH;
    camera.height_px = SCENE_HEIGHT;
    camera.z_far = terrimp_box_farthest(&s->box, camera.eye) * 1.2f;
    camera.z_near = camera.z_far * (1.0f / 8192.0f);
    return camera;
}

/* Brings the clip distances to what an update says is needed. */
static void scene_tighten(terrimp_camera *camera, const terrimp_stats *now)
{
    float up = tanf(0.5f * camera->fov_y_rad);
    float right = up * (float)camera->width_px / (float)camera->height_px;
    float corner = 1.0f / sqrtf(1.0f + up * up + right * right); /* depth of a ray of length 1 */
    if (now->z_near * corner > camera->z_near)
        camera->z_near = now->z_near * corner;
    if (now->z_far > camera->z_near)
        camera->z_far = now->z_far * 1.01f;
}

static void scene_close(scene *s)
{
    int i;
    for (i = 0; i < SCENE_CHUNKS; i++) {
        if (s->is_open[i])
            gl_terrain_close(&s->gl[i]);
        terrimp_terrain_destroy(s->terrain[i]);
    }
    flight_free(&s->flight);
    free(s->lightmap);
    dem_free(&s->dem);
}

#endif
