#include "gl_layers.h"

#include <stdlib.h>
#include <string.h>

/* What a picture shows stands up to a layer's thickness before the layer: so for the depth test. */
static const char layer_vertex[] = "#version 330 core\n"
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec2 st;\n"
    "layout(location = 2) in vec3 front;\n"
    "uniform mat4 matrix;\n"
    "out vec2 uv;\n"
    "void main() {\n"
    "    vec4 f = matrix * vec4(front, 1.0);\n"
    "    uv = st;\n"
    "    gl_Position = matrix * vec4(position, 1.0);\n"
    "    gl_Position.z = f.z / f.w * gl_Position.w;\n"
    "}\n";
static const char layer_fragment[] = "#version 330 core\n"
    "uniform sampler2D atlas;\n"
    "in vec2 uv;\n"
    "out vec4 colour;\n"
    "void main() { colour = texture(atlas, uv); if (colour.a < 0.5) discard; }\n";

const char *gl_layers_open(gl_layers *g, uint32_t side, uint32_t quad_cost)
{
    const char *wrong;
    memset(g, 0, sizeof *g);
    g->quad_cost = quad_cost, g->last = &g->parts;
    g->frame.width = g->frame.height = (int)side;
    wrong = context_make_frame(&g->frame);
    g->program = gl_program_make(layer_vertex, layer_fragment);
    return wrong || g->program.id ? wrong : "a shader does not compile";
}

static void need(gl_layers *g, terrimp_result result)
{
    if (g->result == TERRIMP_OK)
        g->result = result;
}

/* ---- Recording ---------------------------------------------------------- */

typedef struct recording {
    const gl_layers_picture *picture;
    uint32_t width, height, row, words;             /* of a mask: words of a row, and of all */
    uint32_t *texels, *opaque, *visible, *state;    /* texels and masks of all layers */
} recording;

/* Draws what lies between the borders of each layer, reads it back, closes what lines leave open
   between it and the layer before, and finds the texels that can be seen. */
static void read_layers(gl_layers *g, recording *r, gl_layers_scenery draw, void *user)
{
    const terrimp_layers *layers = &r->picture->layers;
    terrimp_capture slab = r->picture->capture;
    uint32_t k, x, y, i, n = r->width * r->height, *wanted = r->state + 4 * r->words;
    glViewport(0, 0, (GLsizei)r->width, (GLsizei)r->height);
    glClearColor(0, 0, 0, 0);
    glEnable(GL_DEPTH_TEST);
    for (k = 0; k < layers->count; k++) {
        uint32_t *texels = r->texels + (size_t)n * k, *mask = r->opaque + (size_t)r->words * k;
        slab.z_near = terrimp_layer_border(layers, k);
        slab.z_far = terrimp_layer_border(layers, k + 1);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw(user, &slab);
        glPolygonMode(GL_FRONT_AND_BACK, GL_LINE); /* all texels that it touches */
        draw(user, &slab);
        glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
        glReadPixels(0, 0, (GLsizei)r->width, (GLsizei)r->height, GL_RGBA, GL_UNSIGNED_BYTE,
                     texels);
        for (i = 0; i < n; i++)
            if (((uint8_t *)&texels[i])[3])
                mask[i / r->width * r->row + i % r->width / 32] |= 1u << i % r->width % 32;
        if (k > 0)
            need(g, terrimp_layer_repair(mask - r->words, mask, r->width, r->height, wanted));
        for (y = 0; y < r->height; y++)
            for (x = 0; x < r->width; x++)
                if (wanted[y * r->row + x / 32] >> x % 32 & 1u)
                    texels[y * r->width + x] = (texels - n)[y * r->width + x];
        for (i = 0; i < r->words; i++)
            mask[i] |= wanted[i];
        need(g, terrimp_layer_cull(mask, r->width, r->height, 0, r->state,
                                   r->visible + (size_t)r->words * k));
    }
}

/* ---- Quads and meshes --------------------------------------------------- */

/* Keeps a rectangle of the picture with its triangles. Its texels are of one layer, or each of the
   layer that is named. For the depth test it is closer to the eye, by a factor. */
static void keep(gl_layers *g, const recording *r, const terrimp_rect *rect, uint32_t layer,
                 const uint16_t *layers, const terrimp_depth_vertex *corners,
                 const uint32_t *indices, uint32_t count, float closer)
{
    const terrimp_capture *c = &r->picture->capture;
    size_t n = (size_t)rect->width * rect->height, floats = (size_t)8 * count;
    gl_layers_part *part = calloc(1, sizeof *part + 4 * (floats + n));
    uint32_t x, y, i, k;
    if (!part) {
        need(g, TERRIMP_E_MEMORY);
        return;
    }
    part->quad.texels = *rect, part->quad.layer = layer, part->count = count;
    part->vertices = (float *)(part + 1), part->texels = (uint32_t *)(part->vertices + floats);
    for (y = 0; y < rect->height; y++)
        for (x = 0; x < rect->width; x++) {
            uint32_t from = layers ? layers[y * rect->width + x] : layer;
            if (from != TERRIMP_DEPTH_NONE)
                part->texels[y * rect->width + x] =
                    r->texels[((size_t)from * r->height + rect->y + y) * r->width + rect->x + x];
        }
    for (i = 0; i < count; i++) {
        const terrimp_depth_vertex *v = &corners[indices[i]];
        float *out = part->vertices + (size_t)8 * i;
        need(g, terrimp_depth_points(&r->picture->layers, c, v, 1, out));
        out[3] = v->u, out[4] = v->v;
        for (k = 0; k < 3; k++)
            out[5 + k] = c->eye[k] + closer * (out[k] - c->eye[k]);
    }
    *g->last = part, g->last = &part->next;
    g->part_count++, g->vertex_count += count, g->texel_count += n;
}

static void cover(gl_layers *g, const recording *r)
{
    enum { MOST = 4096 };
    static const uint32_t order[6] = { 0, 1, 2, 0, 2, 3 };
    const terrimp_layers *layers = &r->picture->layers;
    terrimp_rect rects[MOST];
    terrimp_cover_desc d = { 0 };
    uint32_t k, i, n, count = 0;
    size_t bytes;
    void *scratch;
    d.width = r->width, d.height = r->height, d.quad_cost = g->quad_cost;
    bytes = terrimp_cover_scratch_bytes(&d, MOST);
    scratch = malloc(bytes);
    need(g, scratch ? TERRIMP_OK : TERRIMP_E_MEMORY);
    for (k = 0; k < layers->count && g->result == TERRIMP_OK; k++) {
        float closer = terrimp_layer_border(layers, k) / terrimp_layer_depth(layers, k);
        d.mask = r->visible + (size_t)r->words * k;
        need(g, terrimp_cover(&d, scratch, bytes, rects, MOST, &count));
        for (i = 0; i < count && g->result == TERRIMP_OK; i++) {
            terrimp_depth_vertex corners[4];
            for (n = 0; n < 4; n++) {
                corners[n].u = (float)(rects[i].x + (n == 1 || n == 2 ? rects[i].width : 0));
                corners[n].v = (float)(rects[i].y + (n >= 2 ? rects[i].height : 0));
                corners[n].layer = (float)k;
            }
            keep(g, r, &rects[i], k, NULL, corners, order, 6, closer);
        }
    }
    free(scratch);
}

/* A mesh instead, with its sheets as rectangles of the atlas. */
static void mesh(gl_layers *g, const recording *r)
{
    enum { MOST = 200000, TEXELS = 8000000 };
    terrimp_depth_mesh_desc d = { 0 };
    terrimp_depth_mesh m = { 0 };
    const terrimp_depth_sheet *s;
    size_t bytes;
    void *scratch;
    d.opaque = r->opaque, d.visible = r->visible;
    d.width = r->width, d.height = r->height, d.layers = r->picture->layers.count;
    m.vertex_capacity = m.index_capacity = m.sheet_capacity = MOST, m.texel_capacity = TEXELS;
    m.vertices = malloc(MOST * sizeof *m.vertices);
    m.indices = malloc(MOST * sizeof *m.indices);
    m.sheets = malloc(MOST * sizeof *m.sheets);
    m.texel_layers = malloc(TEXELS * sizeof *m.texel_layers);
    bytes = terrimp_depth_mesh_scratch_bytes(&d);
    scratch = malloc(bytes);
    need(g, m.vertices && m.indices && m.sheets && m.texel_layers && scratch
                ? terrimp_depth_mesh_make(&d, scratch, bytes, &m) : TERRIMP_E_MEMORY);
    for (s = m.sheets; g->result == TERRIMP_OK && s < m.sheets + m.sheet_count; s++)
        keep(g, r, &s->texels, 0, m.texel_layers + s->first_texel, m.vertices,
             m.indices + s->first_index, s->index_count, 0.995f);
    free(scratch), free(m.vertices), free(m.indices), free(m.sheets), free(m.texel_layers);
}

terrimp_result gl_layers_record(gl_layers *g, gl_layers_picture *p, gl_layers_scenery draw,
                                void *user)
{
    const terrimp_capture *c = &p->capture;
    size_t count = p->layers.count;
    recording r;
    r.picture = p;
    r.width = (uint32_t)((c->tan_right - c->tan_left) / p->layers.texel + 0.5f);
    r.height = (uint32_t)((c->tan_up - c->tan_down) / p->layers.texel + 0.5f);
    r.row = TERRIMP_MASK_WORDS(r.width), r.words = r.row * r.height;
    r.opaque = calloc((2 * count + 5) * r.words, sizeof *r.opaque);
    r.texels = malloc(count * r.width * r.height * sizeof *r.texels);
    need(g, r.opaque && r.texels ? TERRIMP_OK : TERRIMP_E_MEMORY);
    p->first = (GLint)g->vertex_count;
    if (g->result == TERRIMP_OK) {
        r.visible = r.opaque + count * r.words, r.state = r.visible + count * r.words;
        glBindFramebuffer(GL_FRAMEBUFFER, g->frame.framebuffer);
        read_layers(g, &r, draw, user);
        (p->as_mesh ? mesh : cover)(g, &r);
    }
    p->count = (GLsizei)g->vertex_count - p->first;
    free(r.opaque), free(r.texels);
    return g->result;
}

/* ---- The atlas ---------------------------------------------------------- */

static void free_parts(gl_layers *g)
{
    while (g->parts) {
        gl_layers_part *part = g->parts;
        g->parts = part->next, free(part);
    }
}

terrimp_result gl_layers_pack(gl_layers *g, uint32_t side)
{
    size_t count = (size_t)g->part_count + 1;
    terrimp_layer_quad *quads = malloc(count * sizeof *quads), *q = quads;
    terrimp_rect *rects = malloc(count * sizeof *rects);
    uint32_t *order = malloc(2 * count * sizeof *order), size[2], i;
    float *vertices = malloc(((size_t)g->vertex_count + 1) * 8 * sizeof *vertices), *out = vertices;
    const gl_layers_part *part;
    size[0] = size[1] = side;
    need(g, quads && rects && order && vertices ? TERRIMP_OK : TERRIMP_E_MEMORY);
    for (part = g->parts; g->result == TERRIMP_OK && part; part = part->next)
        *q++ = part->quad;
    if (g->result == TERRIMP_OK)
        need(g, terrimp_layer_pack(size, quads, g->part_count, 0, rects, order));
    if (g->result == TERRIMP_OK) {
        glGenTextures(1, &g->atlas);
        glBindTexture(GL_TEXTURE_2D, g->atlas);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, (GLsizei)side, (GLsizei)side, 0, GL_RGBA,
                     GL_UNSIGNED_BYTE, NULL);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        for (part = g->parts, q = quads; part; part = part->next, q++) {
            glTexSubImage2D(GL_TEXTURE_2D, 0, (GLint)q->x, (GLint)q->y, (GLsizei)q->texels.width,
                            (GLsizei)q->texels.height, GL_RGBA, GL_UNSIGNED_BYTE, part->texels);
            memcpy(out, part->vertices, (size_t)part->count * 8 * sizeof *out);
            for (i = 0; i < part->count; i++, out += 8) {
                out[3] = ((float)q->x + out[3] - (float)q->texels.x) / (float)side;
                out[4] = ((float)q->y + out[4] - (float)q->texels.y) / (float)side;
            }
        }
        g->array = gl_array_make(&g->vertices, vertices, (size_t)(out - vertices) * sizeof *out);
        gl_point(0, 3, GL_FLOAT, 32, 0), gl_point(1, 2, GL_FLOAT, 32, 12);
        gl_point(2, 3, GL_FLOAT, 32, 20);
        free_parts(g);
    }
    free(quads), free(rects), free(order), free(vertices);
    return g->result;
}

void gl_layers_draw(const gl_layers *g, const gl_layers_picture *p)
{
    glBindTexture(GL_TEXTURE_2D, g->atlas);
    glBindVertexArray(g->array);
    glDrawArrays(GL_TRIANGLES, p->first, p->count);
}

void gl_layers_close(gl_layers *g)
{
    free_parts(g);
    glDeleteProgram(g->program.id), glDeleteTextures(1, &g->atlas);
    glDeleteVertexArrays(1, &g->array), glDeleteBuffers(1, &g->vertices);
    context_close(&g->frame);
}
