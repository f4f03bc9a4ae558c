/* Shows the whole of terrimp without any graphics: a small terrain, a camera that flies over it,
   and callbacks that print what a renderer would have to draw.
   Build:  cc -std=c99 -I. examples/minimal.c -lm -o minimal
   Expect: 64 chunks; captures in the first frame, hardly any in the next ones. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include <stdio.h>

#define SIDE 257

static uint16_t samples[SIDE][SIDE];
static int capturing, impostors, chunks_of_ground;

/* In an engine: bind the atlas, viewport and scissor to the slot, clear it, set the matrices. */
static void begin_capture(void *user, const terrimp_capture_command *c)
{
    (void)user;
    capturing = 1;
    printf("  capture   chunk %2u -> atlas %u, %u x %u texels at (%u, %u)\n", c->node, c->atlas,
           c->slot.width, c->slot.height, c->slot.x, c->slot.y);
}

/* In an engine: bind the frame buffer and the camera's matrices again. */
static void end_capture(void *user, const terrimp_capture_command *c)
{
    (void)user, (void)c;
    capturing = 0;
}

/* In an engine: draw the indices over the chunk's coarse mesh, textured with the atlas. */
static void draw_impostor(void *user, const terrimp_impostor_command *c)
{
    (void)user, (void)c;
    impostors++;
}

/* In an engine: draw the indices over the chunk's vertices, with the ground's own shading. */
static void draw_ground(void *user, const terrimp_ground_command *c)
{
    (void)user, (void)c;
    chunks_of_ground += !capturing;
}

int main(void)
{
    terrimp_terrain_desc desc = {0};
    terrimp_view_desc settings = {0};
    terrimp_camera camera = {0};
    terrimp_callbacks callbacks = {0};
    terrimp_terrain *terrain = NULL;
    terrimp_view *view = NULL;
    int x, z, frame;

    for (z = 0; z < SIDE; z++)
        for (x = 0; x < SIDE; x++)
            samples[z][x] = (uint16_t)((x * (SIDE - 1 - x) / 64 + z * 3) ^ (x * z / 97 & 31));
    desc.field.samples = samples;
    desc.field.width = desc.field.depth = SIDE;
    desc.field.format = TERRIMP_FORMAT_U16;
    desc.field.height_scale = 0.1f;
    desc.chunk_quads = 32;
    if (terrimp_terrain_create(&desc, NULL, &terrain) != TERRIMP_OK ||
        terrimp_view_create(terrain, &settings, NULL, &view) != TERRIMP_OK)
        return 1;

    callbacks.begin_capture = begin_capture, callbacks.end_capture = end_capture;
    callbacks.draw_impostor = draw_impostor, callbacks.draw_ground = draw_ground;
    camera.eye[0] = 128.0f, camera.eye[1] = 60.0f;
    camera.forward[1] = -0.3f, camera.forward[2] = 1.0f;
    camera.width_px = 640, camera.height_px = 480;
    camera.z_near = 1.0f, camera.z_far = 1000.0f;
    for (frame = 0; frame < 8; frame++, camera.eye[2] += 1.0f) {
        impostors = chunks_of_ground = 0;
        printf("frame %d\n", frame);
        if (terrimp_view_update(view, &camera) != TERRIMP_OK ||
            terrimp_view_render(view, &callbacks) != TERRIMP_OK)
            return 1;
        printf("  %d impostors, %d chunks of ground\n", impostors, chunks_of_ground);
    }
    terrimp_view_destroy(view);
    terrimp_terrain_destroy(terrain);
    return 0;
}
