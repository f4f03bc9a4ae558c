/* Shows a host that uses OpenGL 1.1 and nothing newer, as the consoles of homebrew offer it: no
   shaders, no buffers, no target but the frame buffer. What the commands become:
   - a capture is drawn into a corner of the frame buffer, before the frame itself, and copied into
     its slot of the atlas texture by glCopyTexSubImage2D. What it covers is told by destination
     alpha: the frame buffer has alpha bits, is cleared to alpha 0, and ground writes alpha 1;
   - (s, t, q): the positions are the texture coordinates too, and the texture matrix makes the
     rest of them. A machine without texture matrices takes terrimp_texture_coordinates: drawn too;
   - an impostor that fades in is drawn on a share of the pixels by a polygon stipple;
   - a picture in two parts is cut to r / q within 0..1 by two clip planes, rows of its matrix;
   - "nothing where alpha is below 0.5" is the alpha test. The division by alpha is not to be had:
     captures are cleared to the mean colour of ground instead of black, for the filter to mix in.
   Build:  make fixed_function
   Expect: 40 frames of a flight, some of them compared with the full mesh; the last one in
           build/fixed_function.png. Exit code 1 when one has holes or is too far from the full
           mesh. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "host/context.h"
#include "host/image.h"
#include "host/scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 640, HEIGHT = 480, PIXELS = WIDTH * HEIGHT, ATLAS = 1024 };
enum { GRID = (SCENE_QUADS + 1) * (SCENE_QUADS + 1) };

typedef struct host {
    const terrimp_terrain *terrain;
    terrimp_camera camera;
    terrimp_stats stats;
    GLuint lightmap, atlas;
    uint16_t *indices, *mesh_indices;
    float *mesh_xyz, ground_xyz[GRID * 3], stq[GRID * 3], strq[GRID * 4];
    const float *lightmap_matrix;
    float mean[3];              /* colour of the lightmap */
    float eye[3];               /* of the capture or of the frame */
    int on_screen, capturing;
    int without_texture_matrix; /* (s, t, q) by terrimp_texture_coordinates */
    int slots_too_large;        /* for the frame buffer */
} host;

/* ---- What a host has to do ---------------------------------------------- */

/* The view only turns; draw moves the vertices. */
static void set_camera(host *h, const float view[16], const float projection[16],
                       const float eye[3])
{
    float turn[16];
    memcpy(turn, view, sizeof turn);
    turn[12] = turn[13] = turn[14] = 0.0f;
    glMatrixMode(GL_PROJECTION);
    glLoadMatrixf(projection);
    glMatrixMode(GL_MODELVIEW);
    glLoadMatrixf(turn);
    memcpy(h->eye, eye, sizeof h->eye);
}

/* The pieces of the picture that are there already, texel for pixel, alpha too. */
static void draw_slot(host *h, const terrimp_rect *slot)
{
    const float x = (float)slot->x / ATLAS, width = (float)slot->width / ATLAS;
    const float y = (float)slot->y / ATLAS, height = (float)slot->height / ATLAS;
    int i;
    for (i = 0; i < 3; i++) {
        static const GLenum modes[3] = { GL_PROJECTION, GL_MODELVIEW, GL_TEXTURE };
        glMatrixMode(modes[i]);
        glLoadIdentity();
    }
    glBindTexture(GL_TEXTURE_2D, h->atlas);
    glDepthMask(GL_FALSE);
    glBegin(GL_TRIANGLE_STRIP);
    for (i = 0; i < 4; i++) {
        glTexCoord2f(x + (float)(i & 1) * width, y + (float)(i >> 1) * height);
        glVertex2f((float)(i & 1) * 2.0f - 1.0f, (float)(i >> 1) * 2.0f - 1.0f);
    }
    glEnd();
    glDepthMask(GL_TRUE);
}

static void begin_capture(void *user, const terrimp_capture_command *c)
{
    host *h = (host *)user;
    GLsizei width = (GLsizei)c->slot.width, height = (GLsizei)c->slot.height;
    h->slots_too_large += width > WIDTH || height > HEIGHT;
    h->on_screen = 0;
    h->capturing = 1;
    glViewport(0, 0, width, height);
    glScissor(0, 0, width, height);
    glClearColor(h->mean[0], h->mean[1], h->mean[2], 0.0f);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    if (!c->clear)
        draw_slot(h, &c->slot);
    set_camera(h, c->view, c->projection, c->eye);
}

static void end_capture(void *user, const terrimp_capture_command *c)
{
    host *h = (host *)user;
    h->capturing = 0;
    glBindTexture(GL_TEXTURE_2D, h->atlas);
    glCopyTexSubImage2D(GL_TEXTURE_2D, 0, (GLint)c->slot.x, (GLint)c->slot.y, 0, 0,
                        (GLsizei)c->slot.width, (GLsizei)c->slot.height);
}

/* The frame comes after all captures, which it wipes out. */
static void turn_to_screen(host *h)
{
    float view[16], projection[16];
    if (h->on_screen || h->capturing)
        return;
    h->on_screen = 1;
    glViewport(0, 0, WIDTH, HEIGHT);
    glScissor(0, 0, WIDTH, HEIGHT);
    glClearColor(scene_sky[0] / 255.0f, scene_sky[1] / 255.0f, scene_sky[2] / 255.0f, 1.0f);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    terrimp_camera_matrices(&h->camera, view, projection);
    set_camera(h, view, projection, h->camera.eye);
}

/* The world moves to the eye. */
static void push_world(const host *h)
{
    glMatrixMode(GL_MODELVIEW);
    glPushMatrix();
    glTranslatef(-h->eye[0], -h->eye[1], -h->eye[2]);
}

static const float origin[3];

/* For machines without a texture matrix. */
static void make_texture_coordinates(host *h, const float matrix[16], const float eye[3],
                                     const float *xyz, const uint16_t *indices,
                                     uint32_t index_count)
{
    uint32_t i, count = 0;
    for (i = 0; i < index_count; i++)
        count = indices[i] >= count ? indices[i] + 1u : count;
    terrimp_texture_coordinates(matrix, eye, xyz, count, h->stq);
    for (i = 0; i < count; i++) {
        h->strq[i * 4] = h->stq[i * 3];
        h->strq[i * 4 + 1] = h->stq[i * 3 + 1];
        h->strq[i * 4 + 3] = h->stq[i * 3 + 2];
    }
    glTexCoordPointer(4, GL_FLOAT, 0, h->strq);
}

/* The texture matrix takes positions relative to an eye; that of the lightmap, to the origin. */
static void draw(host *h, GLuint texture, const float matrix[16], const float eye[3],
                 const float *xyz, const uint16_t *indices, uint32_t index_count)
{
    turn_to_screen(h);
    glBindTexture(GL_TEXTURE_2D, texture);
    glVertexPointer(3, GL_FLOAT, 0, xyz);
    glTexCoordPointer(3, GL_FLOAT, 0, xyz);
    glMatrixMode(GL_TEXTURE);
    glLoadMatrixf(matrix);
    glTranslatef(-eye[0], -eye[1], -eye[2]);
    if (h->without_texture_matrix) {
        glLoadIdentity();
        make_texture_coordinates(h, matrix, eye, xyz, indices, index_count);
    }
    push_world(h);
    glDrawElements(GL_TRIANGLES, (GLsizei)index_count, GL_UNSIGNED_SHORT, indices);
    glPopMatrix();
}

/* Keeps to r / q within 0..1: r >= 0 and q - r >= 0 are planes, relative to the picture's eye.
   OpenGL takes them through the modelview matrix of that moment. */
static void clip_to_picture(const host *h, const float m[16], const float eye[3])
{
    GLdouble planes[2][4];
    int i;
    for (i = 0; i < 4; i++) {
        planes[0][i] = (GLdouble)m[i * 4 + 2];
        planes[1][i] = (GLdouble)m[i * 4 + 3] - (GLdouble)m[i * 4 + 2];
    }
    push_world(h);
    glTranslatef(eye[0], eye[1], eye[2]);
    for (i = 0; i < 2; i++) {
        glClipPlane(GL_CLIP_PLANE0 + (GLenum)i, planes[i]);
        glEnable(GL_CLIP_PLANE0 + (GLenum)i);
    }
    glPopMatrix();
}

/* Draws on a share of the pixels: those whose threshold lies below it, a fraction of 2^32 that is a
   multiple of two numbers and so spreads evenly over the plane. */
static void begin_share(float share)
{
    GLubyte pattern[32 * 4] = { 0 };
    uint32_t x, y;
    if (share >= 1.0f)
        return;
    for (y = 0; y < 32; y++)
        for (x = 0; x < 32; x++)
            if ((float)((x * 3242174889u + y * 2447445414u) >> 8) < share * 16777216.0f)
                pattern[y * 4 + x / 8] |= (GLubyte)(0x80 >> x % 8);
    glPolygonStipple(pattern);
    glEnable(GL_POLYGON_STIPPLE);
}

static void draw_impostor(void *user, const terrimp_impostor_command *c)
{
    host *h = (host *)user;
    turn_to_screen(h);
    if (c->part_count > 1)
        clip_to_picture(h, c->texture_matrix, c->eye);
    glEnable(GL_ALPHA_TEST);
    begin_share(c->alpha);
    glDisable(GL_CULL_FACE);
    draw(h, h->atlas, c->texture_matrix, c->eye, h->mesh_xyz + (size_t)c->base_vertex * 3,
         h->mesh_indices + c->first_index, c->index_count);
    glEnable(GL_CULL_FACE);
    glDisable(GL_POLYGON_STIPPLE);
    glDisable(GL_ALPHA_TEST);
    glDisable(GL_CLIP_PLANE0);
    glDisable(GL_CLIP_PLANE1);
}

static void draw_floor(void *user, const terrimp_floor_command *c)
{
    host *h = (host *)user;
    draw(h, h->lightmap, h->lightmap_matrix, origin, h->mesh_xyz + (size_t)c->base_vertex * 3,
         h->mesh_indices + c->first_index, c->index_count);
}

/* A host with more memory would keep the vertices of the nodes that it drew lately. */
static void draw_ground(void *user, const terrimp_ground_command *c)
{
    host *h = (host *)user;
    terrimp_terrain_fill_ground(h->terrain, c->node, h->ground_xyz, GRID * 3);
    draw(h, h->lightmap, h->lightmap_matrix, origin, h->ground_xyz, h->indices + c->first_index,
         c->index_count);
}

/* ---- Textures and state ------------------------------------------------- */

static GLuint make_texture(GLint smaller)
{
    GLuint texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, smaller);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP);
    return texture;
}

/* Halves a picture in place. */
static void halve(uint8_t *rgb, int side)
{
    int x, y, k, row = side * 6;
    for (y = 0; y < side; y++)
        for (x = 0; x < side; x++)
            for (k = 0; k < 3; k++) {
                const uint8_t *from = rgb + y * 2 * row + x * 6 + k;
                rgb[(y * side + x) * 3 + k] =
                    (uint8_t)((from[0] + from[3] + from[row] + from[row + 3] + 2) / 4);
            }
}

static int prepare(host *h, const terrimp_terrain *terrain, const scene *s)
{
    terrimp_terrain_info info;
    uint8_t *rgb = s->lightmap;
    int side, level, i;
    terrimp_terrain_get_info(terrain, &info);
    h->terrain = terrain;
    h->indices = malloc(info.ground_index_count * sizeof *h->indices);
    h->mesh_indices = malloc(info.mesh_index_count * sizeof *h->mesh_indices);
    h->mesh_xyz = malloc(info.mesh_vertex_count * 3 * sizeof *h->mesh_xyz);
    if (!h->indices || !h->mesh_indices || !h->mesh_xyz
        || terrimp_terrain_fill_indices(terrain, h->indices, info.ground_index_count)
        || terrimp_terrain_fill_meshes(terrain, h->mesh_xyz, info.mesh_vertex_count * 3,
                                       h->mesh_indices, info.mesh_index_count))
        return 0;
    h->lightmap = make_texture(GL_LINEAR_MIPMAP_LINEAR);
    for (side = SCENE_SIDE, level = 0; side; side /= 2, level++) {
        glTexImage2D(GL_TEXTURE_2D, level, GL_RGB8, side, side, 0, GL_RGB, GL_UNSIGNED_BYTE, rgb);
        halve(rgb, side / 2);
    }
    for (i = 0; i < 3; i++)
        h->mean[i] = (float)rgb[i] / 255.0f; /* one texel is left */
    h->lightmap_matrix = s->lightmap_matrix;
    h->atlas = make_texture(GL_LINEAR);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, ATLAS, ATLAS, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    glEnable(GL_TEXTURE_2D), glEnable(GL_DEPTH_TEST), glEnable(GL_CULL_FACE);
    glEnable(GL_SCISSOR_TEST);
    glEnableClientState(GL_VERTEX_ARRAY), glEnableClientState(GL_TEXTURE_COORD_ARRAY);
    glAlphaFunc(GL_GREATER, 0.5f);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    return 1;
}

/* ---- A terrain and a flight --------------------------------------------- */

static uint8_t ours[PIXELS * 3], full[PIXELS * 3];

static int draw_frame(host *h, terrimp_view *view, int i, const context *frame, uint8_t *rgb)
{
    terrimp_callbacks callbacks = { 0 };
    callbacks.user = h;
    callbacks.begin_capture = begin_capture, callbacks.end_capture = end_capture;
    callbacks.draw_impostor = draw_impostor, callbacks.draw_ground = draw_ground;
    callbacks.draw_floor = draw_floor;
    h->on_screen = 0;
    h->camera = scene_camera(i, WIDTH, HEIGHT);
    if (terrimp_view_update(view, &h->camera) != TERRIMP_OK
        || terrimp_view_get_stats(view, &h->stats) != TERRIMP_OK)
        return 0;
    h->camera.z_far = h->stats.z_far;
    if (terrimp_view_render(view, &callbacks) != TERRIMP_OK)
        return 0;
    turn_to_screen(h); /* also when there is nothing to draw */
    context_read(frame, rgb);
    return 1;
}

int main(int argc, char **argv)
{
    static host h;
    static context frame;
    scene s;
    terrimp_view_desc settings = { 0 }, yardstick = { 0 };
    terrimp_terrain *terrain = NULL;
    terrimp_view *view = NULL, *full_view = NULL;
    const char *trouble = context_open_old(&frame, WIDTH, HEIGHT);
    int i, ok = 1;

    (void)argc;
    if (trouble)
        return fprintf(stderr, "%s\n", trouble), 2;
    settings.texels_per_px = 1.5f;
    settings.atlas_size = ATLAS;
    settings.max_capture_triangles = 4000; /* larger pictures are made in pieces */
    yardstick.mode = TERRIMP_MODE_FULL;
    if (scene_open(&s) || terrimp_terrain_create(&s.desc, NULL, &terrain) != TERRIMP_OK
        || terrimp_view_create(terrain, &settings, NULL, &view) != TERRIMP_OK
        || terrimp_view_create(terrain, &yardstick, NULL, &full_view) != TERRIMP_OK
        || !prepare(&h, terrain, &s))
        return 2;
    for (i = 0; ok && i < SCENE_FRAMES; i++) {
        terrimp_stats stats;
        h.without_texture_matrix = i >= SCENE_FRAMES / 2;
        ok = draw_frame(&h, view, i, &frame, ours);
        if (!scene_judges(i))
            continue;
        stats = h.stats;
        ok = ok && draw_frame(&h, full_view, i, &frame, full);
        scene_judge(&s, i, &stats, ours, full, WIDTH, HEIGHT);
    }
    if (h.slots_too_large)
        printf("%d captures were larger than the frame buffer\n", h.slots_too_large);
    ok = ok && scene_accepts(&s, 37.0) && !h.slots_too_large && glGetError() == GL_NO_ERROR
         && !image_write_beside(argv[0], "fixed_function.png", ours, WIDTH, HEIGHT);
    terrimp_view_destroy(full_view), terrimp_view_destroy(view), terrimp_terrain_destroy(terrain);
    free(h.indices), free(h.mesh_indices), free(h.mesh_xyz), scene_close(&s);
    context_close(&frame);
    return !ok;
}
