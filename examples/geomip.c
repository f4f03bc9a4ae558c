/* Shows geometrical mipmapping alone, without impostors: a quadtree over a small terrain, nodes
   selected for each frame, drawn with one index buffer that never changes.
   Build:  make geomip
   Expect: 8 frames of some 35 draws and 18,000 triangles, of the terrain's 524,288; the last
           one in build/geomip.png, outlined in a colour for each level. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "host/context.h"
#include "host/gl_geomip.h"
#include "host/image.h"
#include "host/lightmap.h"
#include "host/procedural.h"

#include <stdio.h>
#include <stdlib.h>

enum { SIDE = 513, QUADS = 16, GRID = (QUADS + 1) * (QUADS + 1), NODES = 1400 };
enum { WIDTH = 640, HEIGHT = 512 };

static terrimp_geomip_node nodes[NODES];
static terrimp_geomip_mark marks[NODES];
static terrimp_geomip_draw draws[NODES];
static float distances[NODES], scratch[SIDE + 2 * QUADS + 2];
static uint8_t picture[WIDTH * HEIGHT * 3];
static terrimp_pattern patterns[TERRIMP_PATTERN_COUNT];
static GLuint arrays[NODES], indices; /* a node has no array until it is drawn */

static const char vertex[] = "#version 330 core\n"
    "in vec3 position;\n"
    "uniform mat4 matrix, view;\n"
    "out vec2 uv;\n"
    "void main() {\n"
    "    uv = (position.xz + 0.5) / 513.0;\n"
    "    gl_Position = matrix * (view * vec4(position, 1.0));\n"
    "}\n";
static const char fragment[] = "#version 330 core\n"
    "uniform sampler2D lightmap;\n"
    "uniform vec4 tint;\n"
    "in vec2 uv;\n"
    "out vec4 colour;\n"
    "void main() { colour = vec4(mix(texture(lightmap, uv).rgb, tint.rgb, tint.a), 1.0); }\n";

/* All sixteen patterns in one buffer: this is what tiles the terrain without cracks. */
static void fill_indices(void)
{
    static uint16_t list[TERRIMP_PATTERN_COUNT * QUADS * QUADS * 12];
    uint32_t i;
    terrimp_pattern_fill(QUADS, TERRIMP_FORM_LIST, list, sizeof list / sizeof *list);
    for (i = 0; i < TERRIMP_PATTERN_COUNT; i++)
        terrimp_pattern_find(QUADS, TERRIMP_FORM_LIST, i, &patterns[i]);
    glGenBuffers(1, &indices);
    glBindBuffer(GL_ARRAY_BUFFER, indices);
    glBufferData(GL_ARRAY_BUFFER, sizeof list, list, GL_STATIC_DRAW);
}

static void fill_vertices(const terrimp_quadtree *tree, uint32_t node)
{
    float xyz[GRID][3];
    GLuint buffer; /* the array keeps it */
    terrimp_geomip_fill_vertices(tree, node, xyz[0], NULL);
    glGenVertexArrays(1, &arrays[node]);
    glBindVertexArray(arrays[node]);
    glGenBuffers(1, &buffer);
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferData(GL_ARRAY_BUFFER, sizeof xyz, xyz, GL_STATIC_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, NULL);
}

static void draw_nodes(const terrimp_quadtree *tree, const terrimp_geomip_view *view, GLint tint,
                       float outlined)
{
    uint32_t i;
    for (i = 0; i < view->draw_count; i++) {
        const terrimp_geomip_draw *draw = &view->draws[i];
        const terrimp_pattern *pattern = &patterns[draw->pattern];
        const float *colour = gl_level_colour(draw->node.level);
        if (!arrays[draw->node.number])
            fill_vertices(tree, draw->node.number);
        glUniform4f(tint, colour[0], colour[1], colour[2], outlined);
        glBindVertexArray(arrays[draw->node.number]);
        glDrawElements(GL_TRIANGLES, (GLsizei)pattern->index_count, GL_UNSIGNED_SHORT,
                       (const void *)(uintptr_t)(pattern->first_index * sizeof(uint16_t)));
    }
}

int main(int argc, char **argv)
{
    terrimp_heightfield field = {0};
    terrimp_quadtree tree;
    terrimp_geomip_view view = {0};
    terrimp_camera camera = {0};
    uint16_t *samples = procedural_terrain(SIDE, SIDE, 1);
    uint8_t *lightmap;
    context frame;
    gl_program program;
    int i, saved;

    (void)argc;
    field.samples = samples, field.width = field.depth = SIDE;
    field.format = TERRIMP_FORMAT_U16, field.height_scale = 0.25f * PROCEDURAL_HEIGHT_SCALE;
    if (!samples || terrimp_quadtree_init(&field, QUADS, &tree) != TERRIMP_OK ||
        tree.node_count > NODES)
        return 1;
    tree.nodes = nodes;
    view.distances = distances, view.marks = marks, view.draws = draws, view.draw_capacity = NODES;
    view.tolerance_px = 2.0f;
    lightmap = lightmap_bake(&field);
    if (terrimp_geomip_build(&tree, scratch) != TERRIMP_OK || !lightmap)
        return 1;

    if (context_open(&frame, WIDTH, HEIGHT) != NULL)
        return 2;
    fill_indices();
    program = gl_program_make(vertex, fragment);
    glUseProgram(program.id);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, SIDE, SIDE, 0, GL_RGB, GL_UNSIGNED_BYTE, lightmap);
    glGenerateMipmap(GL_TEXTURE_2D);
    glClearColor(0.66f, 0.78f, 0.91f, 1.0f);
    glEnable(GL_DEPTH_TEST), glEnable(GL_CULL_FACE);
    glPolygonOffset(1.0f, 4.0f); /* the ground makes way for its outlines */
    glEnable(GL_POLYGON_OFFSET_FILL);

    camera.width_px = WIDTH, camera.height_px = HEIGHT;
    camera.z_near = 0.5f, camera.z_far = 1000.0f;
    camera.eye[1] = 70.0f, camera.forward[1] = -0.6f;
    camera.forward[0] = camera.forward[2] = 1.0f;
    for (i = 0; i < 8; i++) {
        float turn[16], projection[16];
        camera.eye[0] = camera.eye[2] = 20.0f + 8.0f * (float)i;
        if (terrimp_geomip_select(&tree, &view, &camera) != TERRIMP_OK)
            return 1;
        terrimp_camera_matrices(&camera, turn, projection);
        printf("frame %d: %u draws, %u triangles\n", i, view.draw_count, view.triangle_count);
        glUniformMatrix4fv(program.matrix, 1, GL_FALSE, projection);
        glUniformMatrix4fv(glGetUniformLocation(program.id, "view"), 1, GL_FALSE, turn);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
        draw_nodes(&tree, &view, program.tint, 0.0f);
    }
    glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    draw_nodes(&tree, &view, program.tint, 0.6f);
    context_read(&frame, picture);
    saved = image_write_beside(argv[0], "geomip.png", picture, WIDTH, HEIGHT) == NULL;
    context_close(&frame); /* its buffers and textures go with it */
    free(lightmap), free(samples);
    return !saved;
}
