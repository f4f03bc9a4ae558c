#include "gl_geomip.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static int is_morphing(const gl_geomip *g)
{
    return g->view.morph_ratio > 1.0f;
}

static gl_program make_program(const gl_geomip *g, const char *fragment)
{
    return gl_program_make(is_morphing(g) ? gl_morphing_vertex : gl_ground_vertex, fragment);
}

/* ---- Opening ------------------------------------------------------------ */

enum { FORM = TERRIMP_FORM_LIST };

static size_t vertex_count(const gl_geomip *g)
{
    return (size_t)(g->tree.chunk_quads + 1u) * (g->tree.chunk_quads + 1u);
}

/* What the tree and its view keep; close frees it. */
static int allocate(gl_geomip *g)
{
    const terrimp_quadtree *t = &g->tree;
    size_t nodes = t->node_count, vertices = vertex_count(g);
    g->tree.nodes = malloc(nodes * sizeof *t->nodes);
    g->view.distances = malloc(nodes * sizeof *g->view.distances);
    g->view.marks = calloc(nodes, sizeof *g->view.marks);
    g->view.draw_capacity = t->level_x[0] * t->level_z[0]; /* a tiling has no more */
    g->view.draws = malloc(g->view.draw_capacity * sizeof *g->view.draws);
    g->arrays = calloc(nodes, sizeof *g->arrays);
    g->vertices = calloc(nodes, sizeof *g->vertices);
    g->xyz = malloc(vertices * 3 * sizeof *g->xyz);
    g->moves = malloc(vertices * sizeof *g->moves);
    return t->nodes && g->view.distances && g->view.marks && g->view.draws && g->arrays &&
           g->vertices && g->xyz && g->moves;
}

static terrimp_result build(gl_geomip *g)
{
    size_t count = g->tree.field.width + 2u * g->tree.chunk_quads + 2u;
    float *scratch = malloc(count * sizeof *scratch);
    terrimp_result result = TERRIMP_E_MEMORY;
    if (scratch)
        result = terrimp_geomip_build(&g->tree, scratch);
    free(scratch);
    return result;
}

static terrimp_result fill_indices(gl_geomip *g)
{
    uint32_t quads = g->tree.chunk_quads, i;
    uint32_t count = terrimp_pattern_index_count(quads, FORM);
    uint16_t *indices = malloc(count * sizeof *indices);
    terrimp_result result = TERRIMP_E_MEMORY;
    if (indices)
        result = terrimp_pattern_fill(quads, FORM, indices, count);
    for (i = 0; i < TERRIMP_PATTERN_COUNT && result == TERRIMP_OK; i++)
        result = terrimp_pattern_find(quads, FORM, i, &g->patterns[i]);
    if (result == TERRIMP_OK) {
        glBindVertexArray(0);
        glGenBuffers(1, &g->indices);
        glBindBuffer(GL_ARRAY_BUFFER, g->indices);
        glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(count * sizeof *indices), indices,
                     GL_STATIC_DRAW);
    }
    free(indices);
    return result;
}

static terrimp_result fill_weights(gl_geomip *g)
{
    size_t count = vertex_count(g);
    terrimp_geomip_weights *weights = malloc(count * sizeof *weights);
    terrimp_result result = TERRIMP_E_MEMORY;
    if (weights)
        result = terrimp_geomip_fill_weights(g->tree.chunk_quads, weights);
    if (result == TERRIMP_OK) {
        glGenBuffers(1, &g->weights);
        glBindBuffer(GL_ARRAY_BUFFER, g->weights);
        glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(count * sizeof *weights), weights,
                     GL_STATIC_DRAW);
    }
    free(weights);
    return result;
}

static const char *fill(gl_geomip *g, const terrimp_heightfield *field, uint32_t chunk_quads)
{
    terrimp_result result =
        terrimp_quadtree_init(field, chunk_quads ? chunk_quads : 32, &g->tree);
    if (result == TERRIMP_OK && !allocate(g))
        result = TERRIMP_E_MEMORY;
    if (result == TERRIMP_OK)
        result = build(g);
    if (result == TERRIMP_OK)
        result = fill_indices(g);
    if (result == TERRIMP_OK && is_morphing(g))
        result = fill_weights(g);
    if (result != TERRIMP_OK)
        return terrimp_result_text((int)result);
    g->ground = make_program(g, gl_ground_fragment);
    g->line = make_program(g, gl_line_fragment);
    if (!g->ground.id || !g->line.id)
        return "a shader does not compile";
    return glGetError() == GL_NO_ERROR ? NULL : "OpenGL has no memory for the indices";
}

const char *gl_geomip_open(gl_geomip *g, gl_terrain *gl, const terrimp_heightfield *field,
                           uint32_t chunk_quads, const terrimp_geomip_view *settings)
{
    const char *trouble;
    memset(g, 0, sizeof *g);
    g->gl = gl;
    g->view.rule = settings->rule;
    g->view.tolerance_px = settings->tolerance_px;
    g->view.morph_ratio = settings->morph_ratio;
    g->view.hysteresis = settings->hysteresis;
    trouble = fill(g, field, chunk_quads);
    if (trouble)
        gl_geomip_close(g);
    return trouble;
}

void gl_geomip_close(gl_geomip *g)
{
    uint32_t i;
    for (i = 0; g->arrays && g->vertices && i < g->tree.node_count; i++)
        if (g->arrays[i]) {
            glDeleteVertexArrays(1, &g->arrays[i]);
            glDeleteBuffers(1, &g->vertices[i]);
        }
    glDeleteBuffers(1, &g->indices);
    glDeleteBuffers(1, &g->weights);
    glDeleteProgram(g->ground.id);
    glDeleteProgram(g->line.id);
    free(g->tree.nodes);
    free(g->view.distances);
    free(g->view.marks);
    free(g->view.draws);
    free(g->arrays);
    free(g->vertices);
    free(g->xyz);
    free(g->moves);
    memset(g, 0, sizeof *g);
}

/* ---- A node's vertices -------------------------------------------------- */

/* Morphing vertices are six floats: position, then what they move by; others only the position. */
static void send_vertices(const gl_geomip *g)
{
    size_t floats = is_morphing(g) ? 6 : 3, count = vertex_count(g), i;
    float *out;
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(count * floats * sizeof *out), NULL, GL_STATIC_DRAW);
    out = glMapBuffer(GL_ARRAY_BUFFER, GL_WRITE_ONLY);
    for (i = 0; out && i < count; i++, out += floats) {
        memcpy(out, g->xyz + i * 3, 3 * sizeof *out);
        if (is_morphing(g)) {
            out[3] = g->moves[i].move;
            out[4] = g->moves[i].beside[0];
            out[5] = g->moves[i].beside[1];
        }
    }
    glUnmapBuffer(GL_ARRAY_BUFFER);
}

static void point_to_weights(const gl_geomip *g)
{
    size_t stride = sizeof(terrimp_geomip_weights);
    glBindBuffer(GL_ARRAY_BUFFER, g->weights);
    gl_point(2, 4, GL_UNSIGNED_BYTE, stride, offsetof(terrimp_geomip_weights, odd));
    gl_point(3, 4, GL_UNSIGNED_BYTE, stride, offsetof(terrimp_geomip_weights, even));
    gl_point(4, 4, GL_UNSIGNED_BYTE, stride, offsetof(terrimp_geomip_weights, beside));
    gl_point(5, 1, GL_UNSIGNED_BYTE, stride, offsetof(terrimp_geomip_weights, self));
}

/* Makes what a node lacks; from then on it is resident. */
static terrimp_result make_node(gl_geomip *g, uint32_t node)
{
    size_t stride = (is_morphing(g) ? 6 : 3) * sizeof(float);
    terrimp_result result = terrimp_geomip_fill_vertices(&g->tree, node, g->xyz,
                                                         is_morphing(g) ? g->moves : NULL);
    if (result != TERRIMP_OK)
        return result;
    glGenVertexArrays(1, &g->arrays[node]);
    glBindVertexArray(g->arrays[node]);
    glGenBuffers(1, &g->vertices[node]);
    glBindBuffer(GL_ARRAY_BUFFER, g->vertices[node]);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, g->indices);
    send_vertices(g);
    gl_point(0, 3, GL_FLOAT, stride, 0);
    if (is_morphing(g)) {
        gl_point(1, 3, GL_FLOAT, stride, 3 * sizeof(float));
        point_to_weights(g);
    }
    g->resident++;
    return TERRIMP_OK;
}

/* ---- A frame ------------------------------------------------------------ */

terrimp_result gl_geomip_update(gl_geomip *g, const terrimp_camera *camera, terrimp_stats *stats)
{
    terrimp_result result = terrimp_geomip_select(&g->tree, &g->view, camera);
    float closest = 1e30f, farthest = 0.0f;
    uint32_t i;
    memset(stats, 0, sizeof *stats);
    for (i = 0; i < g->view.draw_count && result == TERRIMP_OK; i++) {
        terrimp_box box;
        float distance;
        result = terrimp_geomip_box(&g->tree, g->view.draws[i].node.number, &box);
        distance = terrimp_box_distance(&box, camera->eye);
        closest = distance < closest ? distance : closest;
        distance = terrimp_box_farthest(&box, camera->eye);
        farthest = distance > farthest ? distance : farthest;
    }
    if (result != TERRIMP_OK || i == 0)
        return result;
    stats->visible = stats->draws = g->view.draw_count;
    stats->triangles = g->view.triangle_count;
    stats->z_near = closest;
    stats->z_far = farthest;
    return result;
}

static void draw_node(const gl_geomip *g, const gl_program *p, const terrimp_geomip_draw *draw)
{
    const terrimp_pattern *pattern = &g->patterns[draw->pattern];
    if (p == &g->line)
        glUniform3fv(p->tint, 1, gl_level_colour(draw->node.level));
    if (is_morphing(g)) {
        glUniform1f(p->morph, draw->morph);
        glUniform4fv(p->side, 1, draw->side);
        glUniform4fv(p->side_coarse, 1, draw->side_coarse);
    }
    glBindVertexArray(g->arrays[draw->node.number]);
    glDrawElements(GL_TRIANGLES, (GLsizei)pattern->index_count, GL_UNSIGNED_SHORT,
                   (const void *)(uintptr_t)(pattern->first_index * sizeof(uint16_t)));
}

static terrimp_result draw_all(gl_geomip *g, const gl_program *p)
{
    terrimp_result result = TERRIMP_OK;
    uint32_t i;
    gl_terrain_turn_to_frame(g->gl);
    glUseProgram(p->id);
    glUniformMatrix4fv(p->matrix, 1, GL_FALSE, g->gl->camera_matrix);
    glUniform3fv(p->eye, 1, g->gl->camera_eye);
    glUniform4fv(p->field, 1, g->gl->field);
    glBindTexture(GL_TEXTURE_2D, g->gl->lightmap);
    for (i = 0; i < g->view.draw_count && result == TERRIMP_OK; i++) {
        const terrimp_geomip_draw *draw = &g->view.draws[i];
        if (!g->arrays[draw->node.number])
            result = make_node(g, draw->node.number);
        if (result == TERRIMP_OK)
            draw_node(g, p, draw);
    }
    return result;
}

terrimp_result gl_geomip_draw(gl_geomip *g)
{
    return draw_all(g, &g->ground);
}

terrimp_result gl_geomip_wireframe(gl_geomip *g)
{
    terrimp_result result;
    glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    glEnable(GL_POLYGON_OFFSET_LINE);
    glPolygonOffset(-1.0f, -8.0f);
    result = draw_all(g, &g->line);
    glDisable(GL_POLYGON_OFFSET_LINE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    gl_terrain_end(g->gl);
    return result;
}

