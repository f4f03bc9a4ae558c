/* Shows that any convention of a renderer will do: rows of render targets from the top (as in
   Direct3D, Metal, WebGPU), clip depth 0..1, reversed depth, no far plane, row vectors, z up. The
   same flight in each; all that a host does differently stands under "What differs".
   Build:  make conventions
   Expect: for each its likeness to the full mesh in plain OpenGL, all within 0.1 dB of that of
           plain OpenGL. Exit code 1 when one is not. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "host/context.h"
#include "host/gl_terrain.h"
#include "host/image.h"
#include "host/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 640, HEIGHT = 480, ATLAS_SIZE = 2048 };

typedef struct convention {
    const char *name;
    int rows_from_top, zero_to_one, reversed, endless, row_vectors, z_up;
} convention;

static const convention conventions[] = {
    { "OpenGL", 0, 0, 0, 0, 0, 0 },          { "Vulkan", 0, 1, 0, 0, 0, 0 },
    { "Direct3D", 1, 1, 0, 0, 0, 0 },        { "reversed depth", 0, 1, 1, 0, 0, 0 },
    { "no far plane", 0, 0, 0, 1, 0, 0 },    { "row vectors", 0, 0, 0, 0, 1, 0 },
    { "z up", 0, 0, 0, 0, 0, 1 },            { "all of these", 1, 1, 1, 1, 1, 1 },
};

/* TIMES(m, v): matrix times vector. PLACE(p): a vertex of the terrain in the host's world. */
static const char vertex_head[] = "#version 330 core\n"
                                  "#define TIMES(m, v) (%s)\n"
                                  "#define PLACE(p) %s\n";
static const char vertex_body[] =
    "layout(location = 0) in vec3 position;\n"
    "uniform mat4 matrix, texture_matrix;\n"
    "uniform vec3 eye, picture_eye;\n"
    "out vec4 strq;\n"
    "void main() {\n"
    "    strq = TIMES(texture_matrix, vec4(position - picture_eye, 1.0));\n"
    "    gl_Position = TIMES(matrix, vec4(PLACE(position) - eye, 1.0));\n"
    "}\n";

static const char fragment[] =
    "#version 330 core\n"
    "uniform sampler2D picture;\n"
    "uniform float alpha;\n"
    "uniform bool part;\n"
    "in vec4 strq;\n"
    "out vec4 colour;\n" GL_THRESHOLD
    "void main() {\n"
    "    if (threshold() >= alpha) discard;\n"
    "    if (part && (strq.z < 0.0 || strq.z > strq.w)) discard;\n"
    "    vec4 c = textureProj(picture, strq.xyw);\n"
    "    if (c.a < 0.5) discard;\n"
    "    colour = vec4(c.rgb / c.a, 1.0);\n"
    "}\n";

typedef struct host {
    convention c;
    context context;
    scene scene;
    terrimp_terrain *terrain;
    terrimp_terrain_info info;
    terrimp_camera camera; /* of the frame */
    GLuint program, ground, meshes, lightmap, atlas, atlas_frame;
    GLint matrix, eye, texture_matrix, picture_eye, alpha, part;
    PFNGLCLIPCONTROLPROC clip_control;
    int capturing, on_screen;
} host;

static void need(const char *trouble)
{
    if (trouble) {
        fprintf(stderr, "conventions: %s\n", trouble);
        exit(2);
    }
}

static void need_ok(terrimp_result result)
{
    need(result == TERRIMP_OK ? NULL : terrimp_result_text((int)result));
}

static void *allocate(size_t bytes)
{
    void *memory = malloc(bytes);
    need(memory ? NULL : "out of memory");
    return memory;
}

/* ---- What differs ------------------------------------------------------- */

/* A place or direction of the terrain in the host's world: z up is a turn about x. */
static void to_host(const convention *c, const float v[3], float out[3])
{
    out[0] = v[0];
    out[1] = c->z_up ? -v[2] : v[1];
    out[2] = c->z_up ? v[1] : v[2];
}

/* What takes places relative to the eye to clip space. */
static void host_matrix(const convention *c, const float view[16], const float projection[16],
                        float out[16])
{
    float turned[16], reversed[16];
    int i, k;
    memcpy(turned, view, sizeof turned);
    for (i = 0; c->z_up && i < 3; i++) { /* the columns are where the three axes go */
        turned[4 + i] = -view[8 + i];
        turned[8 + i] = view[4 + i];
    }
    memcpy(reversed, projection, sizeof reversed);
    for (k = 0; c->reversed && k < 4; k++) /* 1 - depth */
        reversed[4 * k + 2] = projection[4 * k + 3] - projection[4 * k + 2];
    gl_relative_matrix(turned, reversed, out);
}

static void set_camera(host *h, const float view[16], const float projection[16],
                       const float eye[3])
{
    float matrix[16], place[3];
    host_matrix(&h->c, view, projection, matrix);
    to_host(&h->c, eye, place);
    glUniformMatrix4fv(h->matrix, 1, (GLboolean)h->c.row_vectors, matrix);
    glUniform3fv(h->eye, 1, place);
}

/* Before any frame: how clip space meets the render targets. */
static void turn_to(host *h, const convention *c)
{
    char vertex[1024];
    h->c = *c;
    snprintf(vertex, sizeof vertex, vertex_head, c->row_vectors ? "(v) * (m)" : "(m) * (v)",
             c->z_up ? "vec3((p).x, -(p).z, (p).y)" : "(p)");
    strcat(vertex, vertex_body);
    h->program = gl_program_make(vertex, fragment).id;
    need(h->program ? NULL : "the shaders do not compile");
    glUseProgram(h->program);
    h->matrix = glGetUniformLocation(h->program, "matrix");
    h->eye = glGetUniformLocation(h->program, "eye");
    h->texture_matrix = glGetUniformLocation(h->program, "texture_matrix");
    h->picture_eye = glGetUniformLocation(h->program, "picture_eye");
    h->alpha = glGetUniformLocation(h->program, "alpha");
    h->part = glGetUniformLocation(h->program, "part");
    h->clip_control(c->rows_from_top ? GL_UPPER_LEFT : GL_LOWER_LEFT,
                    c->zero_to_one ? GL_ZERO_TO_ONE : GL_NEGATIVE_ONE_TO_ONE);
    glDepthFunc(c->reversed ? GL_GEQUAL : GL_LEQUAL);
    glClearDepth(c->reversed ? 0.0 : 1.0);
    glEnable(GL_DEPTH_TEST);
    glEnable(GL_CULL_FACE);
    glEnable(GL_SCISSOR_TEST);
}

/* ---- The callbacks ------------------------------------------------------ */

static void begin_capture(void *user, const terrimp_capture_command *command)
{
    host *h = (host *)user;
    const terrimp_rect *s = &command->slot;
    h->capturing = 1;
    glBindFramebuffer(GL_FRAMEBUFFER, h->atlas_frame);
    glViewport((GLint)s->x, (GLint)s->y, (GLsizei)s->width, (GLsizei)s->height);
    glScissor((GLint)s->x, (GLint)s->y, (GLsizei)s->width, (GLsizei)s->height);
    glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    glClear((command->clear ? GL_COLOR_BUFFER_BIT : 0u) | GL_DEPTH_BUFFER_BIT);
    set_camera(h, command->view, command->projection, command->eye);
    h->on_screen = 0;
}

static void end_capture(void *user, const terrimp_capture_command *command)
{
    (void)command;
    ((host *)user)->capturing = 0;
}

static void turn_to_screen(host *h)
{
    float view[16], projection[16];
    if (h->on_screen || h->capturing)
        return;
    h->on_screen = 1;
    need_ok(terrimp_camera_matrices(&h->camera, view, projection));
    context_bind(&h->context);
    glScissor(0, 0, WIDTH, HEIGHT);
    glClearColor((float)scene_sky[0] / 255.0f, (float)scene_sky[1] / 255.0f,
                 (float)scene_sky[2] / 255.0f, 1.0f);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    set_camera(h, view, projection, h->camera.eye);
}

static void draw(host *h, GLuint array, uint32_t base_vertex, uint32_t first_index,
                 uint32_t index_count, const terrimp_impostor_command *c)
{
    static const float origin[3] = { 0.0f, 0.0f, 0.0f };
    turn_to_screen(h);
    glBindVertexArray(array);
    glBindTexture(GL_TEXTURE_2D, c ? h->atlas : h->lightmap);
    glUniformMatrix4fv(h->texture_matrix, 1, (GLboolean)h->c.row_vectors,
                       c ? c->texture_matrix : h->scene.lightmap_matrix);
    glUniform3fv(h->picture_eye, 1, c ? c->eye : origin);
    glUniform1f(h->alpha, c ? c->alpha : 1.0f);
    glUniform1i(h->part, c && c->part_count > 1);
    glDrawElementsBaseVertex(GL_TRIANGLES, (GLsizei)index_count, GL_UNSIGNED_SHORT,
                             (const char *)0 + (size_t)first_index * 2, (GLint)base_vertex);
}

static void draw_ground(void *user, const terrimp_ground_command *c)
{
    host *h = (host *)user;
    draw(h, h->ground, c->node * h->info.ground_vertex_count, c->first_index, c->index_count, NULL);
}

static void draw_impostor(void *user, const terrimp_impostor_command *c)
{
    host *h = (host *)user;
    draw(h, h->meshes, c->base_vertex, c->first_index, c->index_count, c);
}

static void draw_floor(void *user, const terrimp_floor_command *c)
{
    host *h = (host *)user;
    draw(h, h->meshes, c->base_vertex, c->first_index, c->index_count, NULL);
}

/* ---- Buffers ------------------------------------------------------------ */

static GLuint make_array(const float *xyz, size_t floats, const uint16_t *indices, size_t count)
{
    GLuint array, buffers[2];
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glGenBuffers(2, buffers);
    glBindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(floats * sizeof *xyz), xyz, GL_STATIC_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[1]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(count * 2), indices, GL_STATIC_DRAW);
    gl_point(0, 3, GL_FLOAT, 0, 0);
    return array;
}

/* The ground of all nodes in one buffer, all coarse meshes in another. */
static void fill_buffers(host *h)
{
    const terrimp_terrain_info *info = &h->info;
    size_t node_floats = (size_t)info->ground_vertex_count * 3, node;
    float *xyz = (float *)allocate(node_floats * info->node_count * sizeof *xyz);
    uint16_t *indices = (uint16_t *)allocate(info->ground_index_count * sizeof *indices);
    for (node = 0; node < info->node_count; node++)
        need_ok(terrimp_terrain_fill_ground(h->terrain, (uint32_t)node, xyz + node * node_floats,
                                            node_floats));
    need_ok(terrimp_terrain_fill_indices(h->terrain, indices, info->ground_index_count));
    h->ground = make_array(xyz, node_floats * info->node_count, indices, info->ground_index_count);
    free(xyz);
    free(indices);
    xyz = (float *)allocate((size_t)info->mesh_vertex_count * 3 * sizeof *xyz);
    indices = (uint16_t *)allocate(info->mesh_index_count * sizeof *indices);
    need_ok(terrimp_terrain_fill_meshes(h->terrain, xyz, (size_t)info->mesh_vertex_count * 3,
                                        indices, info->mesh_index_count));
    h->meshes = make_array(xyz, (size_t)info->mesh_vertex_count * 3, indices,
                           info->mesh_index_count);
    free(xyz);
    free(indices);
}

static GLuint make_texture(GLsizei size, GLenum format, const uint8_t *texels, GLint smaller)
{
    GLuint texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, smaller);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, size, size, 0, format, GL_UNSIGNED_BYTE, texels);
    return texture;
}

static void host_open(host *h)
{
    GLuint depth;
    memset(h, 0, sizeof *h);
    need(context_open(&h->context, WIDTH, HEIGHT));
    h->clip_control = (PFNGLCLIPCONTROLPROC)context_find("glClipControl");
    need(h->clip_control ? NULL : "there is no glClipControl");
    need(scene_open(&h->scene));
    need_ok(terrimp_terrain_create(&h->scene.desc, NULL, &h->terrain));
    need_ok(terrimp_terrain_get_info(h->terrain, &h->info));
    fill_buffers(h);
    h->lightmap = make_texture(SCENE_SIDE, GL_RGB, h->scene.lightmap, GL_LINEAR_MIPMAP_LINEAR);
    glGenerateMipmap(GL_TEXTURE_2D);
    h->atlas = make_texture(ATLAS_SIZE, GL_RGBA, NULL, GL_LINEAR);
    glGenRenderbuffers(1, &depth);
    glBindRenderbuffer(GL_RENDERBUFFER, depth);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, ATLAS_SIZE, ATLAS_SIZE);
    glGenFramebuffers(1, &h->atlas_frame);
    glBindFramebuffer(GL_FRAMEBUFFER, h->atlas_frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, h->atlas, 0);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
}

/* ---- Flights ------------------------------------------------------------ */

static terrimp_stats draw_frame(host *h, terrimp_view *view, int frame, uint8_t *rgb)
{
    terrimp_callbacks callbacks;
    terrimp_stats stats;
    int y;
    memset(&callbacks, 0, sizeof callbacks);
    callbacks.user = h;
    callbacks.begin_capture = begin_capture;
    callbacks.end_capture = end_capture;
    callbacks.draw_ground = draw_ground;
    callbacks.draw_impostor = draw_impostor;
    callbacks.draw_floor = draw_floor;
    h->camera = scene_camera(frame, WIDTH, HEIGHT);
    h->camera.depth_zero_to_one = h->c.zero_to_one;
    h->camera.rows_from_top = h->c.rows_from_top;
    if (h->c.endless)
        h->camera.z_far = 1e18f;
    h->on_screen = 0;
    need_ok(terrimp_view_update(view, &h->camera));
    need_ok(terrimp_view_get_stats(view, &stats));
    need_ok(terrimp_view_render(view, &callbacks));
    turn_to_screen(h);
    context_read(&h->context, rgb);
    for (y = 0; h->c.rows_from_top && y < HEIGHT / 2; y++) { /* as a screen of that kind shows it */
        uint8_t row[WIDTH * 3], *a = rgb + (size_t)y * sizeof row;
        uint8_t *b = rgb + (size_t)(HEIGHT - 1 - y) * sizeof row;
        memcpy(row, a, sizeof row);
        memcpy(a, b, sizeof row);
        memcpy(b, row, sizeof row);
    }
    return stats;
}

/* Flies with a convention; returns the mean likeness of the frames that are judged [dB]. */
static double fly(host *h, const convention *c, int mode, uint8_t *const *truth, uint8_t *rgb)
{
    terrimp_view_desc desc;
    terrimp_view *view;
    double sum = 0.0;
    int frame, judged = 0, pictures = 0;
    turn_to(h, c);
    memset(&desc, 0, sizeof desc);
    desc.mode = mode;
    desc.atlas_size = ATLAS_SIZE;
    need_ok(terrimp_view_create(h->terrain, &desc, NULL, &view));
    for (frame = 0; frame < SCENE_FRAMES; frame++) {
        int full = mode == TERRIMP_MODE_FULL;
        terrimp_stats stats = draw_frame(h, view, frame, full && scene_judges(frame)
                                                             ? truth[judged] : rgb);
        pictures += (int)stats.impostors;
        if (!scene_judges(frame))
            continue;
        if (!full)
            sum += image_psnr(image_mean_square(rgb, truth[judged], (size_t)WIDTH * HEIGHT,
                                                scene_sky));
        judged++;
    }
    need(mode == TERRIMP_MODE_FULL || pictures > 100 ? NULL : "there are no pictures to judge");
    terrimp_view_destroy(view);
    glDeleteProgram(h->program);
    return sum / judged;
}

int main(void)
{
    enum { JUDGED = SCENE_FRAMES / 10 };
    static host h;
    uint8_t *truth[JUDGED], *rgb = (uint8_t *)allocate((size_t)WIDTH * HEIGHT * 3);
    double plain = 0.0;
    size_t i;
    int bad = 0;
    for (i = 0; i < JUDGED; i++)
        truth[i] = (uint8_t *)allocate((size_t)WIDTH * HEIGHT * 3);
    host_open(&h);
    (void)fly(&h, &conventions[0], TERRIMP_MODE_FULL, truth, rgb);
    for (i = 0; i < sizeof conventions / sizeof *conventions; i++) {
        double likeness = fly(&h, &conventions[i], TERRIMP_MODE_DEFAULT, truth, rgb);
        if (i == 0)
            plain = likeness;
        printf("%-16s %.2f dB\n", conventions[i].name, likeness);
        bad += fabs(likeness - plain) > 0.1;
    }
    need(glGetError() == GL_NO_ERROR ? NULL : "OpenGL reports an error");
    terrimp_terrain_destroy(h.terrain);
    scene_close(&h.scene);
    context_close(&h.context);
    for (i = 0; i < JUDGED; i++)
        free(truth[i]);
    free(rgb);
    printf(bad ? "%d are not like OpenGL\n" : "all are like OpenGL\n", bad);
    return bad != 0;
}
