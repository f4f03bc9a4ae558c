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
    const char *path;      /* in the directory of the data; null: the thesis' circle, */
    float above;           /* [wu] ... or one that far above the ground */
} scene_desc;

enum { SCENE_CHUNKS = 2 };
static const uint32_t scene_chunk_quads[SCENE_CHUNKS] = { 64, 128 };

typedef struct scene {
    const scene_desc *desc;
    tour tour;
    terrimp_box box;
    terrimp_heightfield light; /* what the lightmap lies over: the field, or every n-th sample */
    uint16_t *light_samples;   /* these, or null */
    uint8_t *lightmap;
    const char *shading;       /* of gl_terrain_desc */
    const context *context;
    terrimp_terrain *terrain[SCENE_CHUNKS]; /* by chunk size; null until it is used */
    void *bake[SCENE_CHUNKS];               /* that it lies in, when it was read from a file */
    void *walls[SCENE_CHUNKS];              /* for horizons over it; null until one is opened */
    double build_s[SCENE_CHUNKS];           /* what building it took; 0: it was read */
    size_t vertex_bytes;                    /* of gl_terrain_desc */
    gl_terrain gl[SCENE_CHUNKS];            /* of ways that keep no pictures, or of all */
    uint32_t shared_atlas;                  /* its atlas, when all ways share it; else 0 */
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

/* ---- The scene ---------------------------------------------------------- */

enum { SCENE_LARGEST = 4097, SCENE_LIGHT = 2049 }; /* samples along a side */

/* The lightmap of a very large terrain is a coarse one: it would not fit into a texture. */
static void scene_light(scene *s)
{
    uint32_t side = s->tour.field.width, step, x, z;
    const uint16_t *samples = s->tour.field.samples;
    s->light = s->tour.field;
    if (side > SCENE_LARGEST && s->tour.field.format == TERRIMP_FORMAT_U16) {
        uint16_t *out = s->light_samples = need_memory(sizeof *out * SCENE_LIGHT * SCENE_LIGHT);
        step = (side - 1) / (SCENE_LIGHT - 1);
        for (z = 0; z < SCENE_LIGHT; z++)
            for (x = 0; x < SCENE_LIGHT; x++)
                *out++ = samples[(size_t)z * step * side + (size_t)x * step];
        s->light.samples = s->light_samples;
        s->light.width = s->light.depth = SCENE_LIGHT;
        s->light.spacing_x *= (float)step;
        s->light.spacing_z *= (float)step;
    }
    s->lightmap = lightmap_bake(&s->light);
    if (!s->lightmap)
        bench_stop(s->desc->name, "no memory for the lightmap");
}

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
    what.above = desc->above;
    what.fov_y_rad = SCENE_FOV_RAD;
    what.width = SCENE_WIDTH;
    what.height = SCENE_HEIGHT;
    if (!tour_load(&s->tour, &what) || !tour_plan(&s->tour))
        bench_stop(desc->name, s->tour.error);
    scene_light(s);
}

/* Bakes of made-up terrains, which take long to build, are kept between runs. */
static void scene_bake_path(const scene *s, int i, char *path, size_t size)
{
    snprintf(path, size, "%s/made_%u_%u.bake", bench_folder, (unsigned)s->desc->size,
             (unsigned)scene_chunk_quads[i]);
}

/* Takes the terrain from a bake that is younger than what builds it. Returns 0 when there is none.
   (Its samples are not compared: of 16385 x 16385 that would take long.) */
static int scene_read_bake(scene *s, int i)
{
    struct stat header, bake;
    size_t bytes, need_bytes = terrimp_terrain_open_bytes();
    char path[1024];
    FILE *file;
    void *memory;
    int ok;
    scene_bake_path(s, i, path, sizeof path);
    if (!s->desc->size || stat("terrimp.h", &header) != 0 || stat(path, &bake) != 0
        || bake.st_mtime <= header.st_mtime)
        return 0;
    file = fopen(path, "rb");
    if (!file)
        return 0;
    bytes = (size_t)bake.st_size;
    memory = need_memory(need_bytes + bytes + 8);
    s->bake[i] = (char *)memory + (need_bytes + 7) / 8 * 8;
    ok = fread(s->bake[i], 1, bytes, file) == bytes
         && terrimp_terrain_open(&s->tour.field, s->bake[i], bytes, memory, need_bytes,
                                 &s->terrain[i]) == TERRIMP_OK;
    fclose(file);
    s->bake[i] = memory;
    if (!ok) {
        free(memory);
        s->bake[i] = NULL;
        s->terrain[i] = NULL;
    }
    return ok;
}

static void scene_write_bake(const scene *s, int i)
{
    size_t bytes = terrimp_bake_bytes(s->terrain[i]);
    void *block = s->desc->size ? malloc(bytes) : NULL;
    char path[1024];
    FILE *file;
    if (!block)
        return;
    need(terrimp_bake_write(s->terrain[i], block, bytes, 0));
    scene_bake_path(s, i, path, sizeof path);
    file = fopen(path, "wb");
    if (file && (fwrite(block, 1, bytes, file) != bytes) + (fclose(file) != 0) > 0)
        remove(path);
    free(block);
}

/* The terrain with chunks of that many quads, built when it is first asked for. */
static int scene_terrain(scene *s, uint32_t chunk_quads)
{
    terrimp_terrain_desc desc;
    terrimp_terrain_info info;
    double start;
    int i = 0;
    while (i + 1 < SCENE_CHUNKS && scene_chunk_quads[i] != chunk_quads)
        i++;
    if (s->terrain[i])
        return i;
    memset(&desc, 0, sizeof desc);
    desc.field = s->tour.field;
    desc.chunk_quads = scene_chunk_quads[i];
    start = clock_ms();
    if (!scene_read_bake(s, i)) {
        need(terrimp_terrain_create(&desc, NULL, &s->terrain[i]));
        s->build_s[i] = (clock_ms() - start) * 1e-3;
        scene_write_bake(s, i);
    }
    need(terrimp_terrain_get_info(s->terrain[i], &info));
    s->box = info.box;
    return i;
}

/* A horizon over a terrain, for one view. */
static void scene_open_horizon(scene *s, int i, terrimp_horizon *horizon)
{
    const terrimp_quadtree *tree = terrimp_terrain_tree(s->terrain[i]);
    if (!s->walls[i]) {
        s->walls[i] = need_memory(terrimp_walls_bytes(tree));
        need(terrimp_walls_build(tree, NULL, s->walls[i]));
    }
    need(terrimp_horizon_init(horizon, tree, s->walls[i]));
}

static void scene_open_gl(scene *s, int terrain, uint32_t atlas_size, gl_terrain *gl)
{
    gl_terrain_desc desc;
    const char *trouble;
    memset(&desc, 0, sizeof desc);
    desc.frame = s->context;
    desc.terrain = s->terrain[terrain];
    desc.field = &s->light;
    desc.vertex_bytes = s->vertex_bytes;
    desc.lightmap = s->lightmap;
    desc.atlas_size = atlas_size;
    desc.shading = s->shading;
    trouble = gl_terrain_open(gl, &desc);
    if (trouble)
        bench_stop(s->desc->name, trouble);
}

/* The OpenGL side for ways that keep no pictures: its atlases are as small as may be, unless a way
   that keeps some shares it. */
static gl_terrain *scene_shared_gl(scene *s, int terrain)
{
    if (!s->is_open[terrain])
        scene_open_gl(s, terrain, s->shared_atlas ? s->shared_atlas : 64, &s->gl[terrain]);
    s->is_open[terrain] = 1;
    return &s->gl[terrain];
}

static void scene_close(scene *s)
{
    int i;
    for (i = 0; i < SCENE_CHUNKS; i++) {
        if (s->is_open[i])
            gl_terrain_close(&s->gl[i]);
        free(s->walls[i]);
        if (s->bake[i])
            free(s->bake[i]);
        else
            terrimp_terrain_destroy(s->terrain[i]);
    }
    free(s->lightmap);
    free(s->light_samples);
    tour_close(&s->tour);
}

#endif
