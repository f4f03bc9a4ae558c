/* A scene of the frame benchmark: a terrain, its light, a flight over it, and the OpenGL that all
   ways of drawing it share. */
#ifndef BENCH_SCENE_H
#define BENCH_SCENE_H

#include "bench_say.h"

#include "examples/host/context.h"
#include "examples/host/gl_terrain.h"
#include "examples/host/lightmap.h"
#include "examples/host/tour.h"

#include <math.h>

enum { SCENE_WIDTH = 1280, SCENE_HEIGHT = 1024, SCENE_PIXELS = SCENE_WIDTH * SCENE_HEIGHT };
#define SCENE_FOV_RAD 1.0471976f /* 60 degrees */
#define SCENE_FPS 60.0f /* as tour_desc has it */

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
} scene_desc;

enum { SCENE_CHUNKS = 2 };
static const uint32_t scene_chunk_quads[SCENE_CHUNKS] = { 64, 128 };

typedef struct scene {
    const scene_desc *desc;
    tour tour;
    terrimp_box box;
    uint8_t *lightmap;
    const char *shading;       /* of gl_terrain_desc */
    const context *context;
    terrimp_terrain *terrain[SCENE_CHUNKS]; /* by chunk size; null until it is used */
    gl_terrain gl[SCENE_CHUNKS];            /* of ways that keep no pictures */
    int is_open[SCENE_CHUNKS];
} scene;

/* A name with a slash stands for itself. */
static void scene_data_path(const char *name, char *path, size_t size)
{
    if (strncmp(name, "build/", 6) == 0)
        snprintf(path, size, "%s", name);
    else
        snprintf(path, size, "%s/%s", bench_data(), name);
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

/* ---- The scene ---------------------------------------------------------- */

static void scene_open(scene *s, const scene_desc *desc, const context *frame, size_t frames)
{
    char file[1024], path[1024];
    tour_desc what;
    memset(s, 0, sizeof *s);
    memset(&what, 0, sizeof what);
    s->desc = desc;
    s->context = frame;
    if (desc->file) {
        scene_data_path(desc->file, file, sizeof file);
        what.dem = file;
    }
    if (desc->path) {
        scene_data_path(desc->path, path, sizeof path);
        what.path = path;
    }
    what.file.crop_width = what.file.crop_depth = desc->crop;
    what.size = desc->size;
    what.seed = 1;
    what.spacing[0] = what.spacing[1] = desc->spacing;
    what.height_scale = desc->height_scale;
    what.frames = frames;
    what.fov_y_rad = SCENE_FOV_RAD;
    what.width = SCENE_WIDTH;
    what.height = SCENE_HEIGHT;
    if (!tour_load(&s->tour, &what) || !tour_plan(&s->tour))
        bench_stop(desc->name, s->tour.error);
    s->lightmap = lightmap_bake(&s->tour.field);
    if (!s->lightmap)
        bench_stop(desc->name, "no memory for the lightmap");
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
    desc.field = s->tour.field;
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
    desc.field = &s->tour.field;
    desc.lightmap = s->lightmap;
    desc.atlas_size = atlas_size;
    desc.shading = s->shading;
    trouble = gl_terrain_open(gl, &desc);
    if (trouble)
        bench_stop(s->desc->name, trouble);
}

/* The OpenGL side for ways that keep no pictures: its atlases are as small as may be. */
static gl_terrain *scene_shared_gl(scene *s, int terrain)
{
    if (!s->is_open[terrain])
        scene_open_gl(s, terrain, 64, &s->gl[terrain]);
    s->is_open[terrain] = 1;
    return &s->gl[terrain];
}

static void scene_close(scene *s)
{
    int i;
    for (i = 0; i < SCENE_CHUNKS; i++) {
        if (s->is_open[i])
            gl_terrain_close(&s->gl[i]);
        terrimp_terrain_destroy(s->terrain[i]);
    }
    free(s->lightmap);
    tour_close(&s->tour);
}

#endif
