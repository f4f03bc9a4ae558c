/* What the documentation's fragments may use without declaring it: tests/docs.sh puts each into a
   main() that begins with DOCS_PRELUDE. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include <stdio.h>
#include <stdlib.h>

#define DOCS_SIDE 257

static uint16_t samples[DOCS_SIDE * DOCS_SIDE];
static float heights[65 * 65];
static terrimp_heightfield field;
static terrimp_terrain_desc desc;
static terrimp_terrain *terrain;
static terrimp_view_desc view_desc;
static terrimp_view *view;
static terrimp_camera camera;
static terrimp_callbacks callbacks;
static terrimp_box box = { { 100.0f, 0.0f, 100.0f }, { 164.0f, 20.0f, 164.0f } };
static float eye[3] = { 10.0f, 60.0f, 10.0f };
static terrimp_result result;

static void docs_prepare(void)
{
    uint32_t i;
    for (i = 0; i < DOCS_SIDE * DOCS_SIDE; i++)
        samples[i] = (uint16_t)(i % DOCS_SIDE * (i / DOCS_SIDE) / 97 % 64);
    for (i = 0; i < 65 * 65; i++)
        heights[i] = (float)samples[i / 65 * DOCS_SIDE + i % 65];
    field.samples = samples;
    field.width = field.depth = DOCS_SIDE;
    field.format = TERRIMP_FORMAT_U16;
    desc.field = field;
    camera.eye[0] = camera.eye[2] = 128.0f;
    camera.eye[1] = 90.0f;
    camera.forward[2] = 1.0f;
    camera.forward[1] = -0.3f;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.z_near = 1.0f;
    camera.z_far = 1000.0f;
    if (terrimp_terrain_create(&desc, NULL, &terrain) != TERRIMP_OK ||
        terrimp_view_create(terrain, &view_desc, NULL, &view) != TERRIMP_OK)
        exit(2);
    (void)box, (void)eye, (void)result, (void)callbacks, (void)heights;
}
