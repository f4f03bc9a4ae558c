/* Shows light that moves: a village by a lake from morning to evening. Pictures of the terrain keep
   colours without light and normals, and are lit when they are drawn, so that none is made anew for
   the sun's sake.
   Build:  make day
   Expect: build/day_morning.png, day_noon.png, day_evening.png; and how many pictures were made:
           all of them in the first frames. Exit code 1 if the sun made more necessary. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "host/context.h"
#include "host/gl_terrain.h"
#include "host/image.h"
#include "host/lightmap.h"
#include "host/procedural.h"
#include "host/props.h"
#include "host/sea.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 1025, WIDTH = 560, HEIGHT = 350, FRAMES = 90, VILLAGE = 56, ATLAS_SIZE = 2048 };

static void need(const char *trouble)
{
    if (trouble) {
        fprintf(stderr, "day: %s\n", trouble);
        exit(2);
    }
}

static void need_ok(terrimp_result result)
{
    need(result == TERRIMP_OK ? NULL : terrimp_result_text((int)result));
}

/* ---- The place ---------------------------------------------------------- */

/* Samples of a square that are under water. */
static uint32_t count_wet(const terrimp_heightfield *f, uint32_t x, uint32_t z, uint32_t side,
                          float lake)
{
    const uint16_t *samples = (const uint16_t *)f->samples;
    uint32_t i, wet = 0;
    for (i = 0; i < side * side; i++)
        wet += (float)samples[(z + i / side) * f->width + x + i % side] * f->height_scale < lake;
    return wet;
}

/* A square at a shore: half dry, with water to the south of it and dry land to the north. */
static void find_village(const terrimp_heightfield *f, float lake, uint32_t *x, uint32_t *z)
{
    uint32_t u, v, all = VILLAGE * VILLAGE, best = 0;
    for (v = VILLAGE; v + 3 * VILLAGE < f->depth / 2; v += 8)
        for (u = f->width / 4; u + VILLAGE < 3 * f->width / 4; u += 8) {
            uint32_t here = count_wet(f, u, v, VILLAGE, lake), even = here < all / 2 ? here
                                                                                     : all - here;
            uint32_t south = count_wet(f, u, v + VILLAGE, VILLAGE, lake);
            uint32_t north = all - count_wet(f, u, v - VILLAGE, VILLAGE, lake);
            if (2 * even + south + north > best) {
                best = 2 * even + south + north;
                *x = u;
                *z = v;
            }
        }
}

/* ---- The sun ------------------------------------------------------------ */

/* 0 in the morning, 1 in the evening: where the sun is, its colour, that of the sky's light, and
   that of the sky. */
static void set_time(float day, float light[3][3], uint8_t sky[3])
{
    static const float low[3][3] = { { 1.00f, 0.55f, 0.28f }, { 0.16f, 0.17f, 0.26f },
                                     { 0.93f, 0.66f, 0.50f } };
    static const float high[3][3] = { { 0.80f, 0.77f, 0.70f }, { 0.36f, 0.38f, 0.42f },
                                      { 0.66f, 0.78f, 0.91f } };
    float turn = 3.14159265f * (0.05f + 0.90f * day), up = sinf(turn), k;
    int i;
    k = up > 0.6f ? 1.0f : up / 0.6f;
    light[0][0] = cosf(turn);
    light[0][1] = 0.8f * up;
    light[0][2] = 0.6f * up;
    for (i = 0; i < 3; i++) {
        light[1][i] = low[0][i] + k * (high[0][i] - low[0][i]);
        light[2][i] = low[1][i] + k * (high[1][i] - low[1][i]);
        sky[i] = (uint8_t)(255.0f * (low[2][i] + k * (high[2][i] - low[2][i])));
    }
}

/* ---- The day ------------------------------------------------------------ */

typedef struct place {
    context context;
    gl_terrain gl;
    props houses;
    sea lake;
    terrimp_view *view;
    terrimp_camera camera;
} place;

/* What stands beside the terrain is lit as level ground is. */
static void set_light(GLuint program, const float light[3][3])
{
    float level[3];
    int i;
    for (i = 0; i < 3; i++)
        level[i] = light[2][i] + light[0][1] * light[1][i];
    glUseProgram(program);
    glUniform3fv(glGetUniformLocation(program, "light"), 1, level);
}

static uint32_t draw(place *p, float day, uint8_t *rgb)
{
    terrimp_callbacks callbacks = gl_terrain_callbacks(&p->gl);
    terrimp_stats stats;
    float light[3][3];
    uint8_t sky[3];
    memset(&stats, 0, sizeof stats);
    set_time(day, light, sky);
    gl_terrain_light(&p->gl, (const float(*)[3])light);
    set_light(p->houses.program.id, (const float(*)[3])light);
    set_light(p->lake.program.id, (const float(*)[3])light);
    need_ok(terrimp_view_update(p->view, &p->camera));
    need_ok(terrimp_view_get_stats(p->view, &stats));
    need_ok(gl_terrain_begin(&p->gl, &p->camera, sky));
    need_ok(terrimp_view_render(p->view, &callbacks));
    gl_terrain_send(&p->gl);
    props_draw_houses(&p->houses, &p->gl);
    sea_draw(&p->lake, &p->gl);
    context_read(&p->context, rgb);
    return stats.captures;
}

int main(int argc, char **argv)
{
    static const char *const names[3] = { "day_morning.png", "day_noon.png", "day_evening.png" };
    terrimp_terrain_desc desc;
    terrimp_heightfield village;
    terrimp_terrain_info info;
    terrimp_terrain *terrain;
    terrimp_view_desc settings;
    gl_terrain_desc gl;
    place p;
    uint16_t *samples = procedural_terrain(SIDE, SIDE, 3);
    uint8_t *rgb = (uint8_t *)malloc((size_t)WIDTH * HEIGHT * 3), *normals = NULL, *colours = NULL;
    uint32_t x = 0, z = 0, first = 0, later = 0;
    float low, high, lake;
    int i;
    (void)argc;
    memset(&p, 0, sizeof p);
    memset(&desc, 0, sizeof desc);
    memset(&settings, 0, sizeof settings);
    memset(&gl, 0, sizeof gl);
    desc.field.samples = samples;
    desc.field.width = desc.field.depth = SIDE;
    desc.field.format = TERRIMP_FORMAT_U16;
    desc.field.height_scale = 0.5f * PROCEDURAL_HEIGHT_SCALE;
    desc.chunk_quads = 32;
    if (samples)
        colours = lightmap_bake_unlit(&desc.field, &normals);
    need(rgb && colours ? NULL : "out of memory");
    need_ok(terrimp_heightfield_resolve(&desc.field, &desc.field));
    need_ok(terrimp_heightfield_bounds(&desc.field, 0, 0, SIDE, SIDE, &low, &high));
    lake = low + 0.14f * (high - low);
    find_village(&desc.field, lake, &x, &z);
    village = desc.field;
    village.samples = samples + (size_t)z * SIDE + x;
    village.width = village.depth = VILLAGE;
    village.row_bytes = SIDE * sizeof *samples;
    village.origin_x = (float)x;
    village.origin_z = (float)z;

    need_ok(terrimp_terrain_create(&desc, NULL, &terrain));
    need_ok(terrimp_terrain_get_info(terrain, &info));
    settings.atlas_size = ATLAS_SIZE;
    settings.exact_depth = terrimp_view_exact_depth();
    need_ok(terrimp_view_create(terrain, &settings, NULL, &p.view));
    need(context_open(&p.context, WIDTH, HEIGHT));
    gl.frame = &p.context;
    gl.terrain = terrain;
    gl.field = &desc.field;
    gl.lightmap = colours;
    gl.normals = normals;
    gl.relit = gl.exact_depth = 1;
    gl.atlas_size = ATLAS_SIZE;
    need(gl_terrain_open(&p.gl, &gl));
    need(props_open(&p.houses, &village, 40, 2.6f, lake + 0.4f));
    need(sea_open(&p.lake, &info.box, lake));
    p.camera.eye[0] = (float)x + 0.5f * VILLAGE;
    p.camera.eye[1] = lake + 13.0f;
    p.camera.eye[2] = (float)z + 1.8f * VILLAGE;
    p.camera.forward[1] = -0.08f;
    p.camera.forward[2] = -1.0f;
    p.camera.fov_y_rad = 0.9f;
    p.camera.width_px = WIDTH;
    p.camera.height_px = HEIGHT;
    p.camera.z_near = 0.5f;
    p.camera.z_far = 1e4f;
    for (i = 0; i < 60; i++)
        first += draw(&p, 0.0f, rgb);
    for (i = 0; i <= FRAMES; i++) {
        later += draw(&p, 0.06f + 0.88f * (float)i / FRAMES, rgb);
        if (i % (FRAMES / 2) == 0)
            need(image_write_beside(argv[0], names[i / (FRAMES / 2)], rgb, WIDTH, HEIGHT));
    }
    printf("%u pictures made at first, %u in the day that followed\n", first, later);
    need(glGetError() == GL_NO_ERROR ? NULL : "OpenGL reports an error");
    gl_terrain_close(&p.gl);
    props_close(&p.houses);
    sea_close(&p.lake);
    context_close(&p.context);
    terrimp_view_destroy(p.view);
    terrimp_terrain_destroy(terrain);
    free(samples);
    free(colours);
    free(normals);
    free(rgb);
    return later > 0;
}
