#include "gl_terrain.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Shaders ------------------------------------------------------------ */

/* All positions are taken relative to the eye first: large coordinates keep their precision. */
#define VERTEX_HEAD                            \
    GL_SHADER_HEAD "invariant gl_Position;\n"  \
    "layout(location = 0) in vec3 position;\n"

#define VERTEX_MAIN                                               \
    "uniform mat4 matrix;\n"                                      \
    "uniform vec3 eye;\n"                                         \
    "uniform vec4 field;\n"                                       \
    "out vec2 uv;\n"                                              \
    "out vec3 place;\n"                                           \
    "void main() {\n"                                             \
    "    place = vec3(position.x, height(), position.z);\n"       \
    "    uv = position.xz * field.xy + field.zw;\n"               \
    "    gl_Position = matrix * vec4(place - eye, 1.0);\n"        \
    "}\n"

const char gl_ground_vertex[] = VERTEX_HEAD
    "float height() { return position.y; }\n" VERTEX_MAIN;

/* The formula of terrimp_geomip_weights. Sides are in the order Z0, Z1, X0, X1. Vertices that two
   nodes share get the same sums, bit for bit, since all that differs is a product with 0. */
const char gl_morphing_vertex[] = VERTEX_HEAD
    "layout(location = 1) in vec3 move;\n"
    "layout(location = 2) in vec4 odd;\n"
    "layout(location = 3) in vec4 even;\n"
    "layout(location = 4) in vec4 beside;\n"
    "layout(location = 5) in float self;\n"
    "uniform float morph;\n"
    "uniform vec4 side, side_coarse;\n"
    "float height() {\n"
    "    float factor = self * morph + dot(odd, side) + dot(even, side_coarse);\n"
    "    vec4 border = beside * side_coarse;\n"
    "    vec2 along = vec2(border.x + border.y, border.z + border.w);\n"
    "    return position.y + factor * (move.x + dot(move.yz, along));\n"
    "}\n" VERTEX_MAIN;

/* Fragment shaders of terrain: GL_SHADER_HEAD, this one, the text that shades, as in
   gl_terrain_desc, a main. */
#define FRAGMENT_HEAD               \
    "uniform sampler2D lightmap;\n" \
    "uniform float on_screen;\n"    \
    "in vec2 uv;\n"                 \
    "in vec3 place;\n"              \
    "out vec4 colour;\n"

#define LIGHTMAP_ALONE                                                          \
    "vec3 shade(vec2 uv, vec3 position) { return texture(lightmap, uv).rgb; }\n" \
    "vec3 shadow(vec3 colour, vec3 position) { return colour; }\n"

#define GROUND_MAIN                                     \
    "vec3 ground() {\n"                                 \
    "    vec3 c = shade(uv, place);\n"                  \
    "    return on_screen > 0.0 ? shadow(c, place) : c;\n" \
    "}\n"                                               \
    "void main() { colour = vec4(ground(), 1.0); }\n"

/* Ground with normals: `lit` is the light on it. Pictures that are lit when they are drawn keep
   what it would be given. */
static const char lit_head[] =
    "uniform vec3 sun, sun_colour, sky_colour;\n"
    "vec3 lit(vec3 c, vec2 code) {\n"
    "    vec2 e = 2.0 * code - 1.0;\n"
    "    float y = 1.0 - max(abs(e.x), abs(e.y));\n"
    "    float facing = dot(vec3(e, y), sun) * inversesqrt(0.5 * dot(e, e) + y * y);\n"
    "    return c * (sky_colour + sun_colour * max(facing, 0.0));\n"
    "}\n";

static const char lit_main[] =
    "uniform sampler2D normals;\n"
    "#ifdef RELIT\n"
    "layout(location = 1) out vec4 code;\n"
    "#endif\n"
    "void main() {\n"
    "    vec3 c = shade(uv, place);\n"
    "    vec2 n = texture(normals, uv).rg;\n"
    "#ifdef RELIT\n"
    "    code = vec4(n, 0.0, 1.0);\n"
    "    if (on_screen == 0.0) { colour = vec4(c, 1.0); return; }\n"
    "#endif\n"
    "    c = lit(c, n);\n"
    "    colour = vec4(on_screen > 0.0 ? shadow(c, place) : c, 1.0);\n"
    "}\n";

static const char fragment_head[] = FRAGMENT_HEAD, lightmap_alone[] = LIGHTMAP_ALONE,
                  ground_main[] = GROUND_MAIN;

const char gl_ground_fragment[] = GL_SHADER_HEAD FRAGMENT_HEAD LIGHTMAP_ALONE GROUND_MAIN;

/* Of impostors that write a depth. It is never nearer than the mesh's: where a GPU is told so, it
   leaves out hidden pixels before they are shaded, as it does where none is written. */
static const char exact_head[] =
    "#ifdef GL_ARB_conservative_depth\n"
    "#extension GL_ARB_conservative_depth : enable\n"
    "layout(depth_greater) out float gl_FragDepth;\n"
    "#endif\n"
    "#define EXACT\n";

static const char impostor_vertex[] = VERTEX_HEAD
    "uniform mat4 matrix, texture_matrix;\n"
    "uniform vec3 eye, picture_eye;\n"
    "out vec2 uv;\n"
    "out vec3 place;\n"
    "out vec4 strq;\n"
    "void main() {\n"
    "    uv = vec2(0.0);\n"
    "    place = position;\n"
    "    strq = texture_matrix * vec4(position - picture_eye, 1.0);\n"
    "    gl_Position = matrix * vec4(position - eye, 1.0);\n"
    "}\n";

/* Where the picture has depth: a ray through a proud mesh may pass over the terrain, where the
   picture shows a slope far behind. Followed to that depth in the picture, by more than a texel, it
   comes out where there is nothing, or beside the slot (a step of parallax mapping, Hess 6.4). The
   cleared depth, 1, is taken out of what the filter has mixed at outlines as the black is of the
   colours. */
#define PASSING_MAIN                                                                          \
    "#ifdef PASSING\n"                                                                        \
    "uniform sampler2D atlas_depth;\n"                                                        \
    "uniform vec4 ray; /* the eye in the picture, homogeneous */\n"                           \
    "uniform vec4 picture_slot; /* least and greatest s, t */\n"                              \
    "float depth_at(vec2 st, float a) {\n"                                                    \
    "    return 1.0 - (1.0 - texture(atlas_depth, st).r) / a;\n"                              \
    "}\n"                                                                                     \
    "bool passes(vec2 st, float mesh, float d) {\n"                                           \
    "    vec3 way = ray.xyz - vec3(st, mesh) * ray.w;\n"                                      \
    "    vec2 move = way.xy * ((d - mesh) / way.z), there = st + move;\n"                     \
    "    if (d <= mesh || length(move * vec2(textureSize(atlas, 0))) <= 1.0) return false;\n" \
    "    return there != clamp(there, picture_slot.xy, picture_slot.zw)\n"                    \
    "        || texture(atlas, there).a < 0.5;\n"                                             \
    "}\n"                                                                                     \
    "#endif\n"

/* Colours in the atlas are multiplied by alpha, so that the filter does not mix in the black around
   them; the division brings them back. Of a picture in two parts each keeps to its own depths. With
   EXACT it has the depth of what it shows, which its capture left in the atlas; but where a slope
   was hidden from the capture that is the ridge before it: the mesh, which stands proud of the
   slope, is behind the ridge, and nothing is nearer than the mesh. With RELIT it is lit as the
   ground is. */
static const char impostor_main[] =
    "uniform sampler2D atlas, atlas_normals;\n"
    "uniform float alpha;\n"
    "uniform mat4 depth_matrix;\n"
    "in vec4 strq;\n" GL_THRESHOLD PASSING_MAIN
    "void main() {\n"
    "    if (alpha < 1.0 && threshold() >= alpha) discard;\n"
    "    vec2 st = strq.xy / strq.w;\n"
    "    vec4 c = texture(atlas, st);\n"
    "    if (c.a < 0.5 || strq.z < 0.0 || strq.z > strq.w) discard;\n"
    "#ifdef PASSING\n"
    "    float depth = depth_at(st, c.a);\n"
    "    if (passes(st, strq.z / strq.w, depth)) discard;\n"
    "#endif\n"
    "    c.rgb /= c.a;\n"
    "#ifdef EXACT\n"
    "    vec4 at = depth_matrix * vec4(st, depth, 1.0);\n"
    "    gl_FragDepth = max(0.5 * at.z / at.w + 0.5, gl_FragCoord.z);\n"
    "#endif\n"
    "#ifdef RELIT\n"
    "    c.rgb = lit(c.rgb, texture(atlas_normals, st).rg / c.a);\n"
    "#endif\n"
    "    colour = vec4(shadow(c.rgb, place), 1.0);\n"
    "}\n";

const char gl_line_fragment[] = GL_SHADER_HEAD
    "uniform vec3 tint;\n"
    "out vec4 colour;\n"
    "void main() { colour = vec4(tint, 1.0); }\n";

/* Compiles a text that comes in parts. */
static GLuint compile(GLenum type, const char *const *parts, GLsizei count)
{
    GLuint shader = glCreateShader(type);
    GLint ok = 0;
    glShaderSource(shader, count, parts, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        char log[512];
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        fprintf(stderr, "%s\n", log);
    }
    return shader;
}

static gl_program make_program(const char *vertex_source, const char *const *parts, GLsizei count)
{
    GLuint vertex = compile(GL_VERTEX_SHADER, &vertex_source, 1);
    GLuint fragment = compile(GL_FRAGMENT_SHADER, parts, count);
    GLint linked = 0;
    gl_program p;
    p.id = glCreateProgram();
    glAttachShader(p.id, vertex);
    glAttachShader(p.id, fragment);
    glBindAttribLocation(p.id, 0, "position");
    glLinkProgram(p.id);
    glDeleteShader(vertex);
    glDeleteShader(fragment);
    glGetProgramiv(p.id, GL_LINK_STATUS, &linked);
    if (!linked) {
        glDeleteProgram(p.id);
        p.id = 0;
    }
    p.matrix = glGetUniformLocation(p.id, "matrix");
    p.eye = glGetUniformLocation(p.id, "eye");
    p.field = glGetUniformLocation(p.id, "field");
    p.alpha = glGetUniformLocation(p.id, "alpha");
    p.morph = glGetUniformLocation(p.id, "morph");
    p.side = glGetUniformLocation(p.id, "side");
    p.side_coarse = glGetUniformLocation(p.id, "side_coarse");
    p.texture_matrix = glGetUniformLocation(p.id, "texture_matrix");
    p.depth_matrix = glGetUniformLocation(p.id, "depth_matrix");
    p.ray = glGetUniformLocation(p.id, "ray");
    p.picture_slot = glGetUniformLocation(p.id, "picture_slot");
    p.sun = glGetUniformLocation(p.id, "sun");
    p.sun_colour = glGetUniformLocation(p.id, "sun_colour");
    p.sky_colour = glGetUniformLocation(p.id, "sky_colour");
    p.picture_eye = glGetUniformLocation(p.id, "picture_eye");
    p.tint = glGetUniformLocation(p.id, "tint");
    p.on_screen = glGetUniformLocation(p.id, "on_screen");
    return p;
}

gl_program gl_program_make(const char *vertex_source, const char *fragment_source)
{
    return make_program(vertex_source, &fragment_source, 1);
}

/* A program that shades as the terrain does. */
static gl_program make_shaded(const gl_terrain *g, const char *vertex_source,
                              const char *exact, const char *main_source)
{
    const char *parts[8];
    gl_program p;
    parts[0] = GL_SHADER_HEAD;
    parts[1] = exact;
    parts[2] = fragment_head;
    parts[3] = g->shading;
    parts[4] = g->normals ? lit_head : "";
    parts[5] = g->relit ? "#define RELIT\n" : "";
    parts[6] = g->exact_depth && vertex_source == impostor_vertex ? "#define PASSING\n" : "";
    parts[7] = main_source;
    p = make_program(vertex_source, parts, 8);
    glUseProgram(p.id);
    glUniform1i(glGetUniformLocation(p.id, "atlas_depth"), GL_DEPTH_UNIT);
    glUniform1i(glGetUniformLocation(p.id, "normals"), GL_NORMAL_UNIT);
    glUniform1i(glGetUniformLocation(p.id, "atlas_normals"), GL_ATLAS_NORMAL_UNIT);
    glUniform4fv(p.field, 1, g->field);
    return p;
}

GLuint gl_array_make(GLuint *buffer, const void *data, size_t bytes)
{
    GLuint array;
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glGenBuffers(1, buffer);
    glBindBuffer(GL_ARRAY_BUFFER, *buffer);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)bytes, data, GL_STATIC_DRAW);
    return array;
}

void gl_point(GLuint location, GLint size, GLenum type, size_t stride, size_t offset)
{
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location, size, type, GL_FALSE, (GLsizei)stride,
                          (const void *)(uintptr_t)offset);
}

/* ---- Buffers and textures ----------------------------------------------- */

static void send(GLuint buffer, size_t first, size_t bytes, const void *data)
{
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferSubData(GL_ARRAY_BUFFER, (GLintptr)first, (GLsizeiptr)bytes, data);
}

/* Indices belong to a vertex array; WebGL lets them be sent in no other way. */
static void send_indices(GLuint array, size_t first, size_t bytes, const void *data)
{
    glBindVertexArray(array);
    glBufferSubData(GL_ELEMENT_ARRAY_BUFFER, (GLintptr)first, (GLsizeiptr)bytes, data);
}

/* A pool for as many nodes as fit into so many bytes, at least one and at most all. */
static int open_pool(gl_pool *p, uint32_t node_count, size_t bytes)
{
    size_t slot_bytes = p->node_vertices * 3 * sizeof(float) + p->node_indices * sizeof(uint16_t);
    size_t slots = bytes / slot_bytes;
    p->node_count = node_count;
    p->slot_count = slots < 1 ? 1 : slots < node_count ? (uint32_t)slots : node_count;
    p->slot_of = malloc(p->node_count * sizeof *p->slot_of);
    p->node_of = calloc(p->slot_count, sizeof *p->node_of);
    p->used = calloc(p->slot_count, sizeof *p->used);
    if (!p->slot_of || !p->node_of || !p->used)
        return 0;
    memset(p->slot_of, 0xff, p->node_count * sizeof *p->slot_of);
    return 1;
}

/* Its buffers; `vertices` and `indices` are those that stand behind the slots. */
static void make_buffers(gl_pool *p, size_t vertices, size_t indices)
{
    vertices += (size_t)p->slot_count * p->node_vertices;
    indices += (size_t)p->slot_count * p->node_indices;
    p->array = gl_array_make(&p->vertices, NULL, vertices * 3 * sizeof(float));
    glGenBuffers(1, &p->indices);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, p->indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(indices * sizeof(uint16_t)), NULL,
                 GL_STATIC_DRAW);
    gl_point(0, 3, GL_FLOAT, 0, 0);
}

static void close_lines(gl_lines *lines)
{
    glDeleteVertexArrays(1, &lines->array);
    glDeleteBuffers(1, &lines->indices);
}

static void close_pool(gl_pool *p)
{
    glDeleteVertexArrays(1, &p->array);
    glDeleteBuffers(1, &p->vertices);
    glDeleteBuffers(1, &p->indices);
    free(p->slot_of);
    free(p->node_of);
    free(p->used);
}

/* The slot that was drawn longest ago. */
static uint32_t oldest_slot(const gl_pool *p)
{
    uint32_t i, oldest = 0;
    for (i = 1; i < p->slot_count; i++)
        if (p->used[i] < p->used[oldest])
            oldest = i;
    return oldest;
}

static void flush(gl_terrain *g);

/* The slot of a node that is to be drawn; it is filled when the node is not there. */
static uint32_t slot_of(gl_terrain *g, gl_pool *p, uint32_t node)
{
    uint32_t slot = p->slot_of[node];
    if (slot == UINT32_MAX) {
        if (p->filled < p->slot_count) {
            slot = p->filled++;
        } else {
            slot = oldest_slot(p);
            p->slot_of[p->node_of[slot]] = UINT32_MAX;
            if (p->used[slot] == g->frame_number)
                flush(g); /* what waits may need the vertices that go */
        }
        p->slot_of[node] = slot;
        p->node_of[slot] = node;
        p->send(g, node, slot);
    }
    p->used[slot] = g->frame_number;
    return slot;
}

/* If all nodes fit they are sent now, so that no frame pays for them. */
static void fill_pool(gl_terrain *g, gl_pool *p)
{
    uint32_t node;
    for (node = 0; p->slot_count == p->node_count && node < p->node_count; node++)
        slot_of(g, p, node);
}

static terrimp_result send_ground(gl_terrain *g, uint32_t node, uint32_t slot)
{
    const gl_pool *p = &g->ground_pool;
    size_t bytes = p->node_vertices * 3 * sizeof *g->xyz;
    terrimp_result result = terrimp_terrain_fill_ground(g->terrain, node, g->xyz,
                                                        (size_t)p->node_vertices * 3);
    if (result != TERRIMP_OK)
        return result;
    send(p->vertices, slot * bytes, bytes, g->xyz);
    if (!g->moves)
        return TERRIMP_OK;
    bytes = p->node_vertices * sizeof *g->morph;
    result = terrimp_terrain_fill_morph(g->terrain, node, g->morph, p->node_vertices);
    send(g->moves, slot * bytes, bytes, g->morph);
    return result;
}

/* Sends the coarse mesh of a node, or the floor, which has its own size. */
static terrimp_result send_triangles(gl_terrain *g, uint32_t node, uint32_t slot,
                                     size_t vertex_count, size_t index_count)
{
    const gl_pool *p = &g->mesh_pool;
    size_t vertex_bytes = 3 * sizeof *g->xyz, index_bytes = sizeof *g->indices;
    terrimp_result result = terrimp_terrain_fill_mesh(g->terrain, node, g->xyz, vertex_count * 3,
                                                      g->indices, index_count);
    if (result != TERRIMP_OK)
        return result;
    send(p->vertices, slot * p->node_vertices * vertex_bytes, vertex_count * vertex_bytes, g->xyz);
    send_indices(p->array, slot * p->node_indices * index_bytes, index_count * index_bytes,
                 g->indices);
    return TERRIMP_OK;
}

static terrimp_result send_mesh(gl_terrain *g, uint32_t node, uint32_t slot)
{
    return send_triangles(g, node, slot, g->mesh_pool.node_vertices, g->mesh_pool.node_indices);
}

static terrimp_result send_floor(gl_terrain *g)
{
    return send_triangles(g, g->mesh_pool.node_count, g->mesh_pool.slot_count, g->floor_vertices,
                          g->floor_indices);
}

/* All nodes share the indices of ground: a draw names its node by the base vertex. */
static terrimp_result fill_ground(gl_terrain *g, const terrimp_terrain_info *info, size_t bytes)
{
    gl_pool *p = &g->ground_pool;
    terrimp_result result = TERRIMP_E_MEMORY;
    uint16_t *indices;
    p->send = send_ground;
    p->node_vertices = info->ground_vertex_count;
    if (!open_pool(p, info->node_count, bytes))
        return result;
    make_buffers(p, 0, info->ground_index_count);
    indices = malloc(info->ground_index_count * sizeof *indices);
    if (indices)
        result = terrimp_terrain_fill_indices(g->terrain, indices, info->ground_index_count);
    if (result == TERRIMP_OK)
        send_indices(p->array, 0, info->ground_index_count * sizeof *indices, indices);
    free(indices);
    fill_pool(g, p);
    return result;
}

static terrimp_result fill_meshes(gl_terrain *g, const terrimp_terrain_info *info, size_t bytes)
{
    gl_pool *p = &g->mesh_pool;
    p->send = send_mesh;
    p->node_vertices = info->mesh_vertex_stride;
    p->node_indices = info->mesh_index_stride;
    if (!open_pool(p, info->node_count, bytes))
        return TERRIMP_E_MEMORY;
    make_buffers(p, g->floor_vertices, g->floor_indices);
    fill_pool(g, p);
    return send_floor(g);
}

static size_t larger(size_t a, size_t b)
{
    return a > b ? a : b;
}

/* Room for what is sent of a node, or of the floor. */
static int make_room(gl_terrain *g, const terrimp_terrain_info *info)
{
    size_t vertices = larger(info->ground_vertex_count, info->mesh_vertex_stride), indices;
    g->floor_vertices = info->floor_vertex_count;
    g->floor_indices = info->floor_index_count;
    g->floor_first_index = info->mesh_index_count - info->floor_index_count;
    vertices = larger(vertices, g->floor_vertices);
    indices = larger((size_t)info->mesh_index_stride * 3, g->floor_indices); /* and its lines */
    g->xyz = malloc(vertices * 3 * sizeof *g->xyz);
    g->indices = malloc(indices * sizeof *g->indices);
    g->morph = malloc(info->ground_vertex_count * sizeof *g->morph);
    return g->xyz && g->indices && g->morph;
}

/* Weights are the same in every node. */
static void point_weight(GLuint location, GLint size, size_t offset)
{
    gl_point(location, size, GL_UNSIGNED_BYTE, sizeof(terrimp_geomip_weights), offset);
}

const char *gl_terrain_use_morphing(gl_terrain *g)
{
    const gl_pool *p = &g->ground_pool;
    terrimp_geomip_weights *weights = malloc(p->node_vertices * sizeof *weights);
    terrimp_terrain_info info;
    uint32_t i;
    if (!weights)
        return "no memory for the morph weights";
    terrimp_terrain_get_info(g->terrain, &info);
    terrimp_geomip_fill_weights(info.chunk_quads, weights);
    g->morphing = make_shaded(g, gl_morphing_vertex, "",
                              g->normals ? lit_main : ground_main);
    glGenVertexArrays(1, &g->morphing_array);
    glBindVertexArray(g->morphing_array);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, p->indices);
    glGenBuffers(1, &g->weights);
    glBindBuffer(GL_ARRAY_BUFFER, g->weights);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(p->node_vertices * sizeof *weights), weights,
                 GL_STATIC_DRAW);
    free(weights);
    point_weight(2, 4, offsetof(terrimp_geomip_weights, odd));
    point_weight(3, 4, offsetof(terrimp_geomip_weights, even));
    point_weight(4, 4, offsetof(terrimp_geomip_weights, beside));
    point_weight(5, 1, offsetof(terrimp_geomip_weights, self));
    glGenBuffers(1, &g->moves);
    glBindBuffer(GL_ARRAY_BUFFER, g->moves);
    glBufferData(GL_ARRAY_BUFFER,
                 (GLsizeiptr)((size_t)p->slot_count * p->node_vertices * sizeof *g->morph), NULL,
                 GL_STATIC_DRAW);
    for (i = 0; i < p->filled; i++)
        send_ground(g, p->node_of[i], i);
    if (!g->morphing.id)
        return "a shader does not compile";
    return glGetError() == GL_NO_ERROR ? NULL : "OpenGL has no memory for morphing";
}

static GLuint make_texture(GLint least, GLint most)
{
    GLuint texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, least);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, most);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return texture;
}

/* Texel centres lie on the samples; on some of them where OpenGL's largest texture is too small. */
static int make_lightmap(gl_terrain *g, const terrimp_heightfield *field, const uint8_t *rgb,
                         uint32_t limit)
{
    uint32_t width = field->width, depth = field->depth, step = 1, x, z;
    uint8_t *smaller = NULL;
    float step_x, step_z;
    while (width > limit || depth > limit)
        step *= 2, width = (field->width - 1) / step + 1, depth = (field->depth - 1) / step + 1;
    if (step > 1) {
        smaller = malloc((size_t)width * depth * 3);
        if (!smaller)
            return 0;
        for (z = 0; z < depth; z++)
            for (x = 0; x < width; x++)
                memcpy(smaller + ((size_t)z * width + x) * 3,
                       rgb + ((size_t)z * step * field->width + (size_t)x * step) * 3, 3);
        rgb = smaller;
    }
    step_x = 1.0f / (field->spacing_x * (float)step * (float)width);
    step_z = 1.0f / (field->spacing_z * (float)step * (float)depth);
    g->field[0] = step_x;
    g->field[1] = step_z;
    g->field[2] = 0.5f / (float)width - field->origin_x * step_x;
    g->field[3] = 0.5f / (float)depth - field->origin_z * step_z;
    g->lightmap = make_texture(GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, (GLsizei)width, (GLsizei)depth, 0, GL_RGB,
                 GL_UNSIGNED_BYTE, rgb);
    glGenerateMipmap(GL_TEXTURE_2D);
    free(smaller);
    return 1;
}

/* Depth of captures: one buffer serves all atlases, unless it is to be read when they are drawn. */
static void make_atlas_depth(gl_terrain *g, uint32_t i)
{
    if (g->exact_depth) {
        g->atlas_depths[i] = make_texture(GL_LINEAR, GL_LINEAR);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, g->atlas_size, g->atlas_size, 0,
                     GL_DEPTH_COMPONENT, GL_UNSIGNED_INT, NULL);
    } else if (!g->atlas_depth) {
        glGenRenderbuffers(1, &g->atlas_depth);
        glBindRenderbuffer(GL_RENDERBUFFER, g->atlas_depth);
        glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, g->atlas_size, g->atlas_size);
    }
}

static int make_atlas(gl_terrain *g, uint32_t i)
{
    make_atlas_depth(g, i);
    g->atlas[i] = make_texture(GL_LINEAR, GL_LINEAR);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, g->atlas_size, g->atlas_size, 0, GL_RGBA,
                 GL_UNSIGNED_BYTE, NULL);
    glGenFramebuffers(1, &g->atlas_frame[i]);
    glBindFramebuffer(GL_FRAMEBUFFER, g->atlas_frame[i]);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, g->atlas[i], 0);
    if (g->exact_depth)
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D,
                               g->atlas_depths[i], 0);
    else
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                                  g->atlas_depth);
    if (g->relit) {
        static const GLenum both[2] = { GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1 };
        g->atlas_normals[i] = make_texture(GL_LINEAR, GL_LINEAR);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RG8, g->atlas_size, g->atlas_size, 0, GL_RG,
                     GL_UNSIGNED_BYTE, NULL);
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D,
                               g->atlas_normals[i], 0);
        glDrawBuffers(2, both);
    }
    glDisable(GL_SCISSOR_TEST);
    glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

static const char *fill(gl_terrain *g, const gl_terrain_desc *desc,
                        const terrimp_heightfield *field)
{
    size_t vertex_bytes = desc->vertex_bytes ? desc->vertex_bytes : (size_t)400 << 20;
    size_t mesh_bytes = desc->mesh_bytes ? desc->mesh_bytes : (size_t)16 << 20;
    terrimp_terrain_info info;
    GLint limit = 0;
    terrimp_result result = terrimp_terrain_get_info(g->terrain, &info);
    if (result == TERRIMP_OK && !make_room(g, &info))
        result = TERRIMP_E_MEMORY;
    if (result == TERRIMP_OK)
        result = fill_ground(g, &info, vertex_bytes);
    if (result == TERRIMP_OK)
        result = fill_meshes(g, &info, mesh_bytes);
    if (result != TERRIMP_OK)
        return terrimp_result_text((int)result);
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
    if (desc->atlas_size > (uint32_t)limit)
        return "the atlas is larger than OpenGL's largest texture";
    if (!make_lightmap(g, field, desc->lightmap, (uint32_t)limit))
        return "no memory for the lightmap";
    if (desc->normals && (field->width > (uint32_t)limit || field->depth > (uint32_t)limit))
        return "the normals are more than OpenGL's largest texture holds";
    if (desc->normals) {
        g->normals = make_texture(GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RG8, (GLsizei)field->width, (GLsizei)field->depth, 0,
                     GL_RG, GL_UNSIGNED_BYTE, desc->normals);
        glGenerateMipmap(GL_TEXTURE_2D);
    }
    g->atlas_size = (GLsizei)desc->atlas_size;
    if (!make_atlas(g, 0))
        return "the atlas cannot be rendered to";
    g->ground = make_shaded(g, gl_ground_vertex, "", g->normals ? lit_main : ground_main);
    g->impostor = make_shaded(g, impostor_vertex, "", impostor_main);
    if (g->exact_depth) {
        g->deep = make_shaded(g, impostor_vertex, exact_head, impostor_main);
        g->sights = calloc((size_t)info.node_count * 2, sizeof *g->sights);
        if (!g->deep.id || !g->sights)
            return "no impostors with exact depth";
    }
    g->line = gl_program_make(gl_ground_vertex, gl_line_fragment);
    if (!g->ground.id || !g->impostor.id || !g->line.id)
        return "a shader does not compile";
    return glGetError() == GL_NO_ERROR ? NULL : "OpenGL has no memory for the terrain";
}

const char *gl_terrain_open(gl_terrain *g, const gl_terrain_desc *desc)
{
    terrimp_heightfield resolved;
    const char *trouble;
    memset(g, 0, sizeof *g);
    g->frame = desc->frame;
    g->terrain = desc->terrain;
    g->exact_depth = desc->exact_depth;
    g->relit = desc->relit && desc->normals;
    g->shading = desc->shading ? desc->shading : lightmap_alone;
    g->target = GL_TO_NOTHING;
    if (terrimp_heightfield_resolve(desc->field, &resolved) != TERRIMP_OK)
        return "the heightfield is wrong";
    trouble = fill(g, desc, &resolved);
    if (trouble)
        gl_terrain_close(g);
    return trouble;
}

void gl_terrain_close(gl_terrain *g)
{
    size_t i;
    for (i = 0; g->sights && i < (size_t)g->mesh_pool.node_count * 2; i++)
        glDeleteQueries(1, &g->sights[i].query);
    free(g->sights);
    close_pool(&g->ground_pool);
    close_pool(&g->mesh_pool);
    close_lines(&g->ground_lines);
    close_lines(&g->mesh_lines);
    glDeleteVertexArrays(1, &g->morphing_array);
    glDeleteBuffers(1, &g->moves);
    glDeleteBuffers(1, &g->weights);
    glDeleteTextures(1, &g->lightmap);
    glDeleteTextures(GL_ATLASES, g->atlas);
    glDeleteFramebuffers(GL_ATLASES, g->atlas_frame);
    glDeleteRenderbuffers(1, &g->atlas_depth);
    glDeleteTextures(GL_ATLASES, g->atlas_depths);
    glDeleteTextures(GL_ATLASES, g->atlas_normals);
    glDeleteTextures(1, &g->normals);
    glDeleteProgram(g->morphing.id);
    free(g->xyz);
    free(g->indices);
    free(g->morph);
    glDeleteProgram(g->ground.id);
    glDeleteProgram(g->impostor.id);
    glDeleteProgram(g->deep.id);
    glDeleteProgram(g->line.id);
    memset(g, 0, sizeof *g);
}

/* ---- Drawing ------------------------------------------------------------ */

/* out = a * b, column-major. */
static void multiply(const float a[16], const float b[16], float out[16])
{
    int column, row, k;
    for (column = 0; column < 4; column++)
        for (row = 0; row < 4; row++) {
            float sum = 0.0f;
            for (k = 0; k < 4; k++)
                sum += a[k * 4 + row] * b[column * 4 + k];
            out[column * 4 + row] = sum;
        }
}

void gl_relative_matrix(const float view[16], const float projection[16], float out[16])
{
    float turn[16];
    memcpy(turn, view, sizeof turn);
    turn[12] = turn[13] = turn[14] = 0.0f;
    multiply(projection, turn, out);
}

void gl_program_use(const gl_program *p, const float matrix[16], const float eye[3], int on_screen)
{
    glUseProgram(p->id);
    glUniformMatrix4fv(p->matrix, 1, GL_FALSE, matrix);
    glUniform3fv(p->eye, 1, eye);
    glUniform1f(p->on_screen, (float)on_screen);
}

/* Where an index stands in the bound index buffer, as OpenGL wants it: a number in a pointer. */
static const void *index_offset(uint32_t first_index)
{
    return (const void *)(uintptr_t)(first_index * sizeof(uint16_t));
}

/* Draws indices of a slot. OpenGL ES has no base vertex: there the attribute is pointed at it. */
static void draw_slot(GLuint array, const gl_pool *p, GLenum primitive, uint32_t slot,
                      uint32_t index_count, const void *offset)
{
    glBindVertexArray(array);
#ifdef HOST_ES
    glBindBuffer(GL_ARRAY_BUFFER, p->vertices);
    gl_point(0, 3, GL_FLOAT, 0, (size_t)slot * p->node_vertices * 3 * sizeof(float));
    glDrawElements(primitive, (GLsizei)index_count, GL_UNSIGNED_SHORT, offset);
#else
    glDrawElementsBaseVertex(primitive, (GLsizei)index_count, GL_UNSIGNED_SHORT, offset,
                             (GLint)(slot * p->node_vertices));
#endif
}

/* Sends the waiting ground draws; they all have one state. */
static void flush(gl_terrain *g)
{
    gl_batch *b = &g->batch;
    const gl_pool *p = &g->ground_pool;
    if (!b->count)
        return;
    glUseProgram(g->ground.id);
    glBindTexture(GL_TEXTURE_2D, g->lightmap);
#ifdef HOST_ES
    {
        GLsizei i;
        for (i = 0; i < b->count; i++)
            draw_slot(p->array, p, GL_TRIANGLES, (uint32_t)b->base_vertices[i] / p->node_vertices,
                      (uint32_t)b->counts[i], b->offsets[i]);
    }
#else
    glBindVertexArray(p->array);
    glMultiDrawElementsBaseVertex(GL_TRIANGLES, b->counts, GL_UNSIGNED_SHORT, b->offsets,
                                  b->count, b->base_vertices);
#endif
    b->count = 0;
}

void gl_terrain_turn_to_frame(gl_terrain *g)
{
    if (g->target == GL_TO_FRAME)
        return;
    flush(g);
    g->target = GL_TO_FRAME;
    context_bind(g->frame);
    glScissor(g->frame->clip_x, 0, g->frame->clip_width, g->frame->height);
    (g->frame->clip_width ? glEnable : glDisable)(GL_SCISSOR_TEST);
    if (!g->cleared) {
        glClearColor((float)g->sky[0] / 255.0f, (float)g->sky[1] / 255.0f,
                     (float)g->sky[2] / 255.0f, 1.0f);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        g->cleared = 1;
    }
    gl_program_use(&g->line, g->camera_matrix, g->camera_eye, 1);
    if (g->morphing.id)
        gl_program_use(&g->morphing, g->camera_matrix, g->camera_eye, 1);
    if (g->deep.id)
        gl_program_use(&g->deep, g->camera_matrix, g->camera_eye, 1);
    gl_program_use(&g->impostor, g->camera_matrix, g->camera_eye, 1);
    gl_program_use(&g->ground, g->camera_matrix, g->camera_eye, 1);
}

/* Turns to an atlas. It stays bound from capture to capture: a change of target costs a software
   rasteriser a pass over all tiles. */
static void turn_to_atlas(gl_terrain *g, int atlas)
{
    if (g->target == atlas)
        return;
    flush(g);
    if (!g->atlas[atlas])
        make_atlas(g, (uint32_t)atlas);
    g->target = atlas;
    glBindFramebuffer(GL_FRAMEBUFFER, g->atlas_frame[atlas]);
    glEnable(GL_SCISSOR_TEST);
    glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
}

static void begin_capture(void *user, const terrimp_capture_command *command)
{
    gl_terrain *g = (gl_terrain *)user;
    const terrimp_rect *slot = &command->slot;
    float matrix[16];
    g->capturing = 1;
    if (g->over)
        return;
    turn_to_atlas(g, (int)command->atlas);
    glViewport((GLint)slot->x, (GLint)slot->y, (GLsizei)slot->width, (GLsizei)slot->height);
    glScissor((GLint)slot->x, (GLint)slot->y, (GLsizei)slot->width, (GLsizei)slot->height);
    if (command->clear)
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    else if (!g->exact_depth) /* the depth of the pieces before is that of other pictures now */
        glClear(GL_DEPTH_BUFFER_BIT);
    gl_relative_matrix(command->view, command->projection, matrix);
    gl_program_use(&g->ground, matrix, command->eye, 0);
}

static void end_capture(void *user, const terrimp_capture_command *command)
{
    gl_terrain *g = (gl_terrain *)user;
    flush(g);
    g->capturing = 0;
    if (g->exact_depth && command->complete)
        g->sights[command->node * 2 + command->part].slot = command->slot;
}

/* Draws a slot of the coarse meshes; the program has its own uniforms already. */
static void draw_mesh(gl_terrain *g, GLuint texture, uint32_t slot, uint32_t first_index,
                      uint32_t index_count)
{
    const gl_pool *meshes = &g->mesh_pool;
    glBindTexture(GL_TEXTURE_2D, texture);
    draw_slot(meshes->array, meshes, GL_TRIANGLES, slot, index_count,
              index_offset(slot * meshes->node_indices + first_index));
}

static void draw_mesh_over(gl_terrain *g, const terrimp_impostor_command *c, uint32_t slot);

static void bind_to(GLenum unit, GLuint texture)
{
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D, texture);
    glActiveTexture(GL_TEXTURE0);
}

/* Begins to ask whether a pixel of an impostor is seen, and says whether it is to have the depth of
   the terrain: those that showed none in the frame before need not, and keep their early depth
   test. An answer that is not there yet is waited for in later frames. */
static int begin_sight(const gl_terrain *g, gl_sight *sight)
{
    GLuint there = 1, seen = 1;
    if (!sight->query)
        glGenQueries(1, &sight->query);
    else
        glGetQueryObjectuiv(sight->query, GL_QUERY_RESULT_AVAILABLE, &there);
    if (there && sight->frame)
        glGetQueryObjectuiv(sight->query, GL_QUERY_RESULT, &seen);
    if (there)
        sight->hidden = !seen;
    if (g->frame_number - sight->frame > 1) /* it has not been drawn of late */
        sight->hidden = 0;
    sight->frame = g->frame_number;
    sight->asked = there != 0;
    if (there)
        glBeginQuery(GL_ANY_SAMPLES_PASSED, sight->query);
    return !sight->hidden;
}

/* The depth of the picture, where it lies, and the eye as it would be there. */
static void set_passing(const gl_terrain *g, const gl_program *p,
                        const terrimp_impostor_command *c, const terrimp_rect *slot)
{
    const float *m = c->texture_matrix, texel = 1.0f / (float)g->atlas_size;
    float to[3], ray[4];
    int i;
    for (i = 0; i < 3; i++)
        to[i] = g->camera_eye[i] - c->eye[i];
    for (i = 0; i < 4; i++)
        ray[i] = m[i] * to[0] + m[4 + i] * to[1] + m[8 + i] * to[2] + m[12 + i];
    glUniform4fv(p->ray, 1, ray);
    glUniform4f(p->picture_slot, ((float)slot->x + 0.5f) * texel, ((float)slot->y + 0.5f) * texel,
                ((float)(slot->x + slot->width) - 0.5f) * texel,
                ((float)(slot->y + slot->height) - 0.5f) * texel);
    bind_to(GL_DEPTH_UNIT, g->atlas_depths[c->atlas]);
}

static void draw_impostor(void *user, const terrimp_impostor_command *c)
{
    gl_terrain *g = (gl_terrain *)user;
    gl_sight *sight = g->exact_depth ? &g->sights[c->node * 2 + c->part] : NULL;
    const gl_program *p = &g->impostor;
    uint32_t slot;
    gl_terrain_turn_to_frame(g);
    flush(g);
    slot = slot_of(g, &g->mesh_pool, c->node);
    if (g->over) {
        draw_mesh_over(g, c, slot);
        return;
    }
    if (sight && begin_sight(g, sight))
        p = &g->deep;
    glUseProgram(p->id);
    glUniform1f(p->alpha, c->alpha);
    glUniformMatrix4fv(p->texture_matrix, 1, GL_FALSE, c->texture_matrix);
    if (p == &g->deep) {
        float matrix[16];
        multiply(g->camera_matrix, c->place_matrix, matrix);
        glUniformMatrix4fv(p->depth_matrix, 1, GL_FALSE, matrix);
    }
    if (sight)
        set_passing(g, p, c, &sight->slot);
    if (g->relit)
        bind_to(GL_ATLAS_NORMAL_UNIT, g->atlas_normals[c->atlas]);
    glUniform3fv(p->picture_eye, 1, c->eye);
    glDisable(GL_CULL_FACE);
    draw_mesh(g, g->atlas[c->atlas], slot, 0, c->index_count);
    glEnable(GL_CULL_FACE);
    if (sight && sight->asked)
        glEndQuery(GL_ANY_SAMPLES_PASSED);
}

/* The floor only fills what would else be holes: its outlines would hide those that matter. */
static void draw_floor(void *user, const terrimp_floor_command *c)
{
    gl_terrain *g = (gl_terrain *)user;
    if (g->over)
        return;
    gl_terrain_turn_to_frame(g);
    flush(g);
    glUseProgram(g->ground.id);
    draw_mesh(g, g->lightmap, g->mesh_pool.slot_count, c->first_index - g->floor_first_index,
              c->index_count);
}

/* A morphing node is a draw of its own: its factors are uniforms. */
static void draw_morphing(gl_terrain *g, const terrimp_ground_command *c, uint32_t slot)
{
    const gl_pool *p = &g->ground_pool;
    size_t vertices = (size_t)slot * p->node_vertices;
    flush(g);
    glUseProgram(g->morphing.id);
    glBindTexture(GL_TEXTURE_2D, g->lightmap);
    glUniform1f(g->morphing.morph, c->morph);
    glUniform4fv(g->morphing.side, 1, c->side);
    glUniform4fv(g->morphing.side_coarse, 1, c->side_coarse);
    glBindVertexArray(g->morphing_array);
    glBindBuffer(GL_ARRAY_BUFFER, p->vertices);
    gl_point(0, 3, GL_FLOAT, 0, vertices * 3 * sizeof(float));
    glBindBuffer(GL_ARRAY_BUFFER, g->moves);
    gl_point(1, 3, GL_FLOAT, sizeof *g->morph,
             vertices * sizeof *g->morph + offsetof(terrimp_geomip_vertex, move));
    glDrawElements(GL_TRIANGLES, (GLsizei)c->index_count, GL_UNSIGNED_SHORT,
                   index_offset(c->first_index));
}

static void draw_ground_over(gl_terrain *g, const terrimp_ground_command *c, uint32_t slot);

static void draw_ground(void *user, const terrimp_ground_command *command)
{
    gl_terrain *g = (gl_terrain *)user;
    gl_batch *b = &g->batch;
    uint32_t slot;
    GLsizei i;
    if (g->capturing && g->over)
        return;
    if (!g->capturing)
        gl_terrain_turn_to_frame(g);
    slot = slot_of(g, &g->ground_pool, command->node);
    if (g->over) {
        draw_ground_over(g, command, slot);
        return;
    }
    if (g->morphing.id && !g->capturing) {
        draw_morphing(g, command, slot);
        return;
    }
    if (b->count == GL_BATCH)
        flush(g);
    i = b->count++;
    b->counts[i] = (GLsizei)command->index_count;
    b->offsets[i] = index_offset(command->first_index);
    b->base_vertices[i] = (GLint)(slot * g->ground_pool.node_vertices);
}

static terrimp_result resend(gl_terrain *g, const gl_pool *p, uint32_t node)
{
    uint32_t slot = p->slot_of[node];
    return slot == UINT32_MAX ? TERRIMP_OK : p->send(g, node, slot);
}

terrimp_result gl_terrain_refill(gl_terrain *g, uint32_t node)
{
    terrimp_result result;
    if (node == g->mesh_pool.node_count)
        return send_floor(g);
    result = resend(g, &g->ground_pool, node);
    return result == TERRIMP_OK ? resend(g, &g->mesh_pool, node) : result;
}

int gl_terrain_relight(gl_terrain *g, const terrimp_heightfield *field, const uint8_t *lightmap)
{
    terrimp_heightfield resolved;
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
    glDeleteTextures(1, &g->lightmap);
    return terrimp_heightfield_resolve(field, &resolved) == TERRIMP_OK
           && make_lightmap(g, &resolved, lightmap, (uint32_t)limit);
}

/* ---- A frame ------------------------------------------------------------ */

static void use_light(const gl_terrain *g, const gl_program *p)
{
    if (!p->id || !g->normals)
        return;
    glUseProgram(p->id);
    glUniform3f(p->sun, 0.5f * (g->light[0][0] + g->light[0][2]),
                0.5f * (g->light[0][0] - g->light[0][2]), g->light[0][1]);
    glUniform3fv(p->sun_colour, 1, g->light[1]);
    glUniform3fv(p->sky_colour, 1, g->light[2]);
}

void gl_terrain_light(gl_terrain *g, const float light[3][3])
{
    memcpy(g->light, light, sizeof g->light);
    use_light(g, &g->ground);
    use_light(g, &g->morphing);
    use_light(g, &g->impostor);
    use_light(g, &g->deep);
    bind_to(GL_NORMAL_UNIT, g->normals);
}

terrimp_result gl_terrain_begin(gl_terrain *g, const terrimp_camera *camera,
                                const uint8_t sky[3])
{
    float view[16], projection[16];
    terrimp_result result = terrimp_camera_matrices(camera, view, projection);
    if (result != TERRIMP_OK)
        return result;
    gl_relative_matrix(view, projection, g->camera_matrix);
    memcpy(g->camera_eye, camera->eye, sizeof g->camera_eye);
    memcpy(g->sky, sky, sizeof g->sky);
    g->target = GL_TO_NOTHING;
    g->cleared = 0;
    g->frame_number++;
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glEnable(GL_CULL_FACE);
    return TERRIMP_OK;
}

terrimp_callbacks gl_terrain_callbacks(gl_terrain *g)
{
    terrimp_callbacks callbacks;
    memset(&callbacks, 0, sizeof callbacks);
    callbacks.user = g;
    callbacks.begin_capture = begin_capture;
    callbacks.end_capture = end_capture;
    callbacks.draw_impostor = draw_impostor;
    callbacks.draw_ground = draw_ground;
    callbacks.draw_floor = draw_floor;
    return callbacks;
}

void gl_terrain_send(gl_terrain *g)
{
    gl_terrain_turn_to_frame(g);
    flush(g);
}

void gl_terrain_end(gl_terrain *g)
{
    gl_terrain_send(g);
    glFinish();
}

/* ---- Over the frame ----------------------------------------------------- */

const float *gl_level_colour(uint32_t level)
{
    static const float colours[6][3] = { { 0.80f, 0.10f, 0.05f }, { 0.05f, 0.20f, 0.75f },
                                         { 0.95f, 0.75f, 0.05f }, { 0.55f, 0.05f, 0.60f },
                                         { 0.05f, 0.60f, 0.65f }, { 0.05f, 0.05f, 0.05f } };
    return colours[level % 6];
}

/* Each triangle becomes three lines. OpenGL ES has no other way to draw outlines. */
static void outline(const uint16_t *triangles, size_t index_count, uint16_t *lines)
{
    size_t i;
    for (i = 0; i < index_count; i++) {
        *lines++ = triangles[i];
        *lines++ = triangles[i % 3 == 2 ? i - 2 : i + 1];
    }
}

/* A vertex array of a pool's vertices with room for so many indices of lines. */
static void make_line_array(const gl_pool *p, gl_lines *lines, size_t index_count)
{
    glGenVertexArrays(1, &lines->array);
    glBindVertexArray(lines->array);
    glBindBuffer(GL_ARRAY_BUFFER, p->vertices);
    gl_point(0, 3, GL_FLOAT, 0, 0);
    glGenBuffers(1, &lines->indices);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, lines->indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(index_count * sizeof(uint16_t)), NULL,
                 GL_DYNAMIC_DRAW);
}

/* Once, when outlines are first wanted: the lines of all ground. */
static terrimp_result make_lines(gl_terrain *g)
{
    terrimp_terrain_info info;
    terrimp_result result = terrimp_terrain_get_info(g->terrain, &info);
    size_t count = info.ground_index_count;
    uint16_t *indices = malloc(count * 3 * sizeof *indices);
    if (result == TERRIMP_OK && !indices)
        result = TERRIMP_E_MEMORY;
    if (result == TERRIMP_OK)
        result = terrimp_terrain_fill_indices(g->terrain, indices, info.ground_index_count);
    if (result == TERRIMP_OK) {
        make_line_array(&g->ground_pool, &g->ground_lines, count * 2);
        make_line_array(&g->mesh_pool, &g->mesh_lines, (size_t)g->mesh_pool.node_indices * 2);
        outline(indices, count, indices + count);
        send_indices(g->ground_lines.array, 0, count * 2 * sizeof *indices, indices + count);
    }
    free(indices);
    return result;
}

static void draw_ground_over(gl_terrain *g, const terrimp_ground_command *c, uint32_t slot)
{
    glUseProgram(g->line.id);
    if (g->over == GL_OVER_LEVELS) {
        glUniform3fv(g->line.tint, 1, gl_level_colour(c->level));
        draw_slot(g->ground_pool.array, &g->ground_pool, GL_TRIANGLES, slot, c->index_count,
                  index_offset(c->first_index));
    } else {
        glUniform3f(g->line.tint, 0.05f, 0.10f, 0.25f);
        draw_slot(g->ground_lines.array, &g->ground_pool, GL_LINES, slot, c->index_count * 2,
                  index_offset(c->first_index * 2));
    }
}

/* The lines of one mesh are sent when it is drawn: there are few, of few triangles. */
static void draw_mesh_over(gl_terrain *g, const terrimp_impostor_command *c, uint32_t slot)
{
    const gl_pool *p = &g->mesh_pool;
    uint16_t *lines = g->indices + p->node_indices;
    if (c->part > 0) /* the same mesh again */
        return;
    glUseProgram(g->line.id);
    if (g->over == GL_OVER_LEVELS) {
        glUniform3fv(g->line.tint, 1, gl_level_colour(c->level));
        draw_mesh(g, 0, slot, 0, c->index_count);
        return;
    }
    if (terrimp_terrain_fill_mesh(g->terrain, c->node, g->xyz, (size_t)p->node_vertices * 3,
                                  g->indices, p->node_indices) != TERRIMP_OK)
        return;
    outline(g->indices, c->index_count, lines);
    send_indices(g->mesh_lines.array, 0, (size_t)c->index_count * 2 * sizeof *lines, lines);
    glUniform3f(g->line.tint, 0.85f, 0.10f, 0.05f);
    draw_slot(g->mesh_lines.array, p, GL_LINES, slot, c->index_count * 2, NULL);
}

/* Lines are drawn a little nearer than they stand, or the triangles would hide half of them.
   Levels are blended over the very pixels that their triangles have drawn. */
terrimp_result gl_terrain_draw_over(gl_terrain *g, terrimp_view *view, gl_over over)
{
    terrimp_callbacks callbacks = gl_terrain_callbacks(g);
    terrimp_result result = TERRIMP_OK;
    float matrix[16];
    int i;
    if (!g->ground_lines.array)
        result = make_lines(g);
    if (result != TERRIMP_OK)
        return result;
    gl_terrain_send(g);
    for (i = 0; i < 16; i++)
        matrix[i] = g->camera_matrix[i] * (over == GL_OVER_LINES && i < 12 ? 0.998f : 1.0f);
    gl_program_use(&g->line, matrix, g->camera_eye, 1);
    if (over == GL_OVER_LEVELS) {
        glEnable(GL_BLEND);
        glBlendColor(0.0f, 0.0f, 0.0f, 0.4f);
        glBlendFunc(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA);
        glDepthFunc(GL_EQUAL);
    }
    g->over = over;
    result = terrimp_view_render(view, &callbacks);
    g->over = GL_OVER_NOTHING;
    glDisable(GL_BLEND);
    glDepthFunc(GL_LEQUAL);
    return result;
}

terrimp_result gl_terrain_wireframe(gl_terrain *g, terrimp_view *view)
{
    terrimp_result result = gl_terrain_draw_over(g, view, GL_OVER_LINES);
    glFinish();
    return result;
}

int gl_terrain_read_atlas(const gl_terrain *g, int atlas, uint8_t *rgb)
{
    size_t count = (size_t)g->atlas_size * (size_t)g->atlas_size, i;
    uint8_t *rgba = malloc(count * 4);
    if (!rgba)
        return 0;
    glBindFramebuffer(GL_FRAMEBUFFER, g->atlas_frame[atlas]);
    glReadPixels(0, 0, g->atlas_size, g->atlas_size, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
    for (i = 0; i < count * 3; i++) {
        const uint8_t *texel = rgba + i / 3 * 4;
        rgb[i] = (uint8_t)(texel[i % 3] + (255 - texel[3]) / 2);
    }
    free(rgba);
    return 1;
}
