/* Laws of the terrain room: nodes, meshes, patterns. */
#ifndef UNIT_TERRAIN_H
#define UNIT_TERRAIN_H

#include "unit_impostor.h"
#include "unit_atlas.h"

/* ---- lands: heightfields of many shapes with a terrain built from them ---- */

typedef enum land_shape { LAND_HILLS, LAND_FLAT, LAND_SPIKE, LAND_RAMP, LAND_NOISE } land_shape;

typedef struct land {
    terrimp_terrain_desc desc; /* resolved */
    terrimp_terrain *terrain;
    terrimp_terrain_info info;
    float *samples; /* room for any format */
    float *xyz;     /* of fill_meshes */
    uint16_t *indices;
    uint16_t *patterns; /* of fill_indices */
    int often;          /* of many tests: built once, for the rest what was built is opened */
    void *memory;       /* of an opened terrain */
} land;

/* A height of 0..250. */
static float land_height(land_shape shape, uint32_t x, uint32_t z, uint32_t width, uint32_t depth)
{
    float fx = (float)x, fz = (float)z;
    switch (shape) {
    case LAND_HILLS:
        return 120.0f + 60.0f * sinf(fx * 0.11f) * cosf(fz * 0.07f) +
               30.0f * sinf(fx * 0.31f + fz * 0.23f) + random_float(0.0f, 8.0f);
    case LAND_SPIKE: return x == width / 2u && z == depth / 2u ? 250.0f : 5.0f;
    case LAND_RAMP: return 250.0f * (fx + fz) / (float)(width + depth);
    case LAND_NOISE: return random_float(0.0f, 250.0f);
    default: return 42.0f;
    }
}

static void land_write(land *l, size_t at, float height)
{
    switch (l->desc.field.format) {
    case TERRIMP_FORMAT_U8: ((uint8_t *)(void *)l->samples)[at] = (uint8_t)height; break;
    case TERRIMP_FORMAT_U16:
        ((uint16_t *)(void *)l->samples)[at] = (uint16_t)(height * 256.0f);
        break;
    case TERRIMP_FORMAT_S16:
        ((int16_t *)(void *)l->samples)[at] = (int16_t)((height - 125.0f) * 256.0f);
        break;
    default: l->samples[at] = height; break;
    }
}

/* Fills in the samples and a descriptor; nothing is built yet. */
static void land_prepare(land *l, uint32_t width, uint32_t depth, int format, land_shape shape)
{
    uint32_t x, z;
    memset(l, 0, sizeof *l);
    l->samples = (float *)malloc((size_t)width * depth * sizeof(float));
    l->desc.field.samples = l->samples;
    l->desc.field.width = width;
    l->desc.field.depth = depth;
    l->desc.field.format = format;
    l->desc.triangle_budget = 48; /* smaller meshes than by default are built in half the time */
    if (format == TERRIMP_FORMAT_U16 || format == TERRIMP_FORMAT_S16)
        l->desc.field.height_scale = 1.0f / 256.0f;
    for (z = 0; z < depth; z++)
        for (x = 0; x < width; x++)
            land_write(l, (size_t)z * width + x, land_height(shape, x, z, width, depth));
}

/* Opens the bake of the terrain that was built last for this, if it was of the same settings and
   samples; else builds one. What is opened cannot be edited. */
static terrimp_result land_open(land *l)
{
    static terrimp_terrain_desc kept;
    static unsigned char *samples, *bake;
    static size_t bytes;
    const size_t size = (size_t)l->desc.field.width * l->desc.field.depth * sizeof(float);
    terrimp_terrain_desc desc = l->desc;
    desc.field.samples = NULL;
    if (!bake || memcmp(&desc, &kept, sizeof desc) != 0 || memcmp(samples, l->samples, size) != 0) {
        CHECK(terrimp_terrain_create(&l->desc, NULL, &l->terrain) == TERRIMP_OK);
        kept = desc;
        bytes = terrimp_bake_bytes(l->terrain);
        samples = (unsigned char *)realloc(samples, size);
        bake = (unsigned char *)realloc(bake, bytes);
        memcpy(samples, l->samples, size);
        CHECK(terrimp_bake_write(l->terrain, bake, bytes, 0) == TERRIMP_OK);
        terrimp_terrain_destroy(l->terrain);
    }
    l->memory = malloc(terrimp_terrain_open_bytes());
    return terrimp_terrain_open(&l->desc.field, bake, bytes, l->memory,
                                terrimp_terrain_open_bytes(), &l->terrain);
}

/* Builds the terrain of l->desc and reads everything that a host would; returns whether it did. */
static int land_build(land *l)
{
    terrimp_result result = l->often ? land_open(l)
                                     : terrimp_terrain_create(&l->desc, NULL, &l->terrain);
    CHECK(result == TERRIMP_OK);
    if (result != TERRIMP_OK)
        return 0;
    CHECK(terrimp_terrain_desc_resolve(&l->desc, &l->desc) == TERRIMP_OK);
    CHECK(terrimp_terrain_get_info(l->terrain, &l->info) == TERRIMP_OK);
    l->xyz = (float *)malloc(l->info.mesh_vertex_count * 3u * sizeof(float));
    l->indices = (uint16_t *)malloc(l->info.mesh_index_count * sizeof(uint16_t));
    l->patterns = (uint16_t *)malloc(l->info.ground_index_count * sizeof(uint16_t));
    CHECK(terrimp_terrain_fill_meshes(l->terrain, l->xyz, l->info.mesh_vertex_count * 3u,
                                      l->indices, l->info.mesh_index_count) == TERRIMP_OK);
    CHECK(terrimp_terrain_fill_indices(l->terrain, l->patterns, l->info.ground_index_count) ==
          TERRIMP_OK);
    return 1;
}

static void land_free(land *l)
{
    terrimp_terrain_destroy(l->terrain);
    free(l->memory);
    free(l->samples);
    free(l->xyz);
    free(l->indices);
    free(l->patterns);
}

/* A node by its place in the quadtree. */
typedef struct land_node {
    uint32_t level, x, z;       /* place among the nodes of its level */
    uint32_t wide, deep, first; /* of that level */
} land_node;

static land_node land_place(const land *l, uint32_t node)
{
    land_node n;
    n.level = n.first = 0;
    n.wide = l->info.chunks_x;
    n.deep = l->info.chunks_z;
    while (node - n.first >= n.wide * n.deep) {
        n.first += n.wide * n.deep;
        n.wide = (n.wide + 1u) / 2u;
        n.deep = (n.deep + 1u) / 2u;
        n.level++;
    }
    n.x = (node - n.first) % n.wide;
    n.z = (node - n.first) / n.wide;
    return n;
}

/* First sample of a node, and the last one, which its neighbour has too. */
static void land_span(const land *l, uint32_t node, uint32_t first[2], uint32_t last[2])
{
    land_node n = land_place(l, node);
    uint32_t quads = l->info.chunk_quads << n.level;
    first[0] = n.x * quads;
    first[1] = n.z * quads;
    last[0] = first[0] + quads < l->desc.field.width ? first[0] + quads : l->desc.field.width - 1u;
    last[1] = first[1] + quads < l->desc.field.depth ? first[1] + quads : l->desc.field.depth - 1u;
}

static float land_sample(const land *l, uint32_t x, uint32_t z)
{
    const terrimp_heightfield *f = &l->desc.field;
    float raw = terrimpi_field_raw(f, x, z), height = terrimpi_field_world_height(f, raw);
    CHECK(x < f->width && z < f->depth && f->row_bytes > 0); /* resolved */
    CHECK(!terrimpi_field_is_void(f, raw) && terrimpi_finite(height));
    return height;
}

static float land_x(const land *l, uint32_t column)
{
    return l->desc.field.origin_x + (float)column * l->desc.field.spacing_x;
}

static float land_z(const land *l, uint32_t row)
{
    return l->desc.field.origin_z + (float)row * l->desc.field.spacing_z;
}

/* The column or row that a vertex stands on, or UINT32_MAX when it stands on none. */
static uint32_t land_line(float origin, float spacing, uint32_t count, float at)
{
    uint32_t i = (uint32_t)floor(((double)at - (double)origin) / (double)spacing + 0.5);
    return i < count && origin + (float)i * spacing == at ? i : UINT32_MAX;
}

static uint32_t land_chunks(const land *l)
{
    return l->info.chunks_x * l->info.chunks_z;
}

/* ---- laws of one land ---- */

static int box_holds(const terrimp_box *outer, const terrimp_box *inner)
{
    int k;
    for (k = 0; k < 3; k++)
        if (outer->min[k] > inner->min[k] || outer->max[k] < inner->max[k])
            return 0;
    return 1;
}

/* Chunk boxes hold every sample and vertex and end on the chunk's own lines. */
static void check_chunk_box(const land *l, uint32_t node)
{
    uint32_t first[2], last[2], x, z, i;
    terrimp_box box;
    terrimp_mesh_info mesh;
    CHECK(terrimp_terrain_get_box(l->terrain, node, &box) == TERRIMP_OK);
    CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
    land_span(l, node, first, last);
    CHECK(box.min[0] == land_x(l, first[0]) && box.max[0] == land_x(l, last[0]));
    CHECK(box.min[2] == land_z(l, first[1]) && box.max[2] == land_z(l, last[1]));
    for (z = first[1]; z <= last[1]; z++)
        for (x = first[0]; x <= last[0]; x++) {
            float height = land_sample(l, x, z);
            CHECK(height >= box.min[1] && height <= box.max[1]);
        }
    for (i = 0; i < mesh.vertex_count; i++) {
        const float *p = l->xyz + (size_t)(mesh.base_vertex + i) * 3u;
        CHECK(p[0] >= box.min[0] && p[0] <= box.max[0]);
        CHECK(p[1] >= box.min[1] && p[1] <= box.max[1]);
        CHECK(p[2] >= box.min[2] && p[2] <= box.max[2]);
    }
}

/* Every parent holds its up to four children; the root is the box of the terrain. */
static void check_hierarchy(const land *l)
{
    uint32_t wide = l->info.chunks_x, deep = l->info.chunks_z, first = 0, level, x, z;
    terrimp_box child, parent;
    for (level = 1; level < l->info.level_count; level++) {
        uint32_t above = first + wide * deep, up = (wide + 1u) / 2u;
        for (z = 0; z < deep; z++)
            for (x = 0; x < wide; x++) {
                CHECK(terrimp_terrain_get_box(l->terrain, first + z * wide + x, &child) ==
                      TERRIMP_OK);
                CHECK(terrimp_terrain_get_box(l->terrain, above + z / 2u * up + x / 2u, &parent) ==
                      TERRIMP_OK);
                CHECK(box_holds(&parent, &child));
            }
        first = above;
        wide = up;
        deep = (deep + 1u) / 2u;
    }
    CHECK(wide == 1 && deep == 1 && first + 1u == l->info.node_count);
    CHECK(terrimp_terrain_get_box(l->terrain, first, &parent) == TERRIMP_OK);
    CHECK(memcmp(&parent, &l->info.box, sizeof parent) == 0);
}

/* Ground vertices are the samples; beyond the far edge the last ones are repeated, none is lost. */
static void check_ground(const land *l, uint32_t node)
{
    uint32_t side = l->info.chunk_quads + 1u, first[2], last[2], i, level;
    float *xyz = (float *)malloc((size_t)side * side * 3u * sizeof(float));
    land_span(l, node, first, last);
    level = land_place(l, node).level;
    CHECK(l->info.ground_vertex_count == side * side);
    CHECK(terrimp_terrain_fill_ground(l->terrain, node, xyz, (size_t)side * side * 3u) ==
          TERRIMP_OK);
    CHECK(terrimp_terrain_fill_ground(l->terrain, node, xyz, (size_t)side * side * 3u - 1u) ==
          TERRIMP_E_CAPACITY);
    for (i = 0; i < side * side; i++) {
        uint32_t x = first[0] + (i % side << level), z = first[1] + (i / side << level);
        x = x < last[0] ? x : last[0];
        z = z < last[1] ? z : last[1];
        CHECK(xyz[i * 3u] == land_x(l, x) && xyz[i * 3u + 2u] == land_z(l, z));
        CHECK(xyz[i * 3u + 1u] == land_sample(l, x, z));
    }
    free(xyz);
}

/* Twice the area of a triangle of the grid, > 0 when it faces up: y of its normal, that is
   (z1 - z0)(x2 - x0) - (x1 - x0)(z2 - z0). */
static int64_t twice_area(int64_t p[3][2])
{
    return (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]) - (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]);
}

/* The grid place of a mesh vertex. */
static void vertex_place(const land *l, const terrimp_mesh_info *mesh, uint32_t index, int64_t p[2])
{
    const float *v = l->xyz + (size_t)(mesh->base_vertex + index) * 3u;
    const terrimp_heightfield *f = &l->desc.field;
    p[0] = (int64_t)land_line(f->origin_x, f->spacing_x, f->width, v[0]);
    p[1] = (int64_t)land_line(f->origin_z, f->spacing_z, f->depth, v[2]);
}

/* A coarse surface covers its square exactly once: all triangles face up, each inner edge has one
   triangle on either side, the others lie on the outline, and the areas add up in integers. Returns
   the number of border edges, as pairs of vertices. */
static uint32_t check_cover(const land *l, uint32_t node, uint16_t border[][2])
{
    terrimp_mesh_info mesh;
    uint32_t first[2], last[2], t, k, n, border_count = 0;
    int64_t area = 0;
    const uint16_t *index;
    CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
    CHECK(mesh.triangle_count >= 2u && mesh.triangle_count <= l->desc.triangle_budget);
    CHECK(mesh.first_index + mesh.index_count <= l->info.mesh_index_count);
    CHECK(mesh.base_vertex + mesh.vertex_count <= l->info.mesh_vertex_count);
    land_span(l, node, first, last);
    index = l->indices + mesh.first_index;
    for (t = 0; t < mesh.triangle_count; t++) {
        int64_t p[3][2], twice;
        for (k = 0; k < 3; k++) {
            CHECK(index[t * 3u + k] < mesh.vertex_count);
            vertex_place(l, &mesh, index[t * 3u + k], p[k]);
            CHECK(p[k][0] >= (int64_t)first[0] && p[k][0] <= (int64_t)last[0]);
            CHECK(p[k][1] >= (int64_t)first[1] && p[k][1] <= (int64_t)last[1]);
        }
        twice = twice_area(p);
        CHECK(twice > 0);
        area += twice;
    }
    CHECK(area == 2 * (int64_t)(last[0] - first[0]) * (int64_t)(last[1] - first[1]));
    for (t = 0; t < mesh.triangle_count * 3u; t++) {
        uint16_t a = index[t], b = index[t % 3u == 2u ? t - 2u : t + 1u];
        uint32_t same = 0, opposite = 0;
        int64_t p[2][2];
        int on_outline;
        for (n = 0; n < mesh.triangle_count * 3u; n++) {
            uint16_t c = index[n], d = index[n % 3u == 2u ? n - 2u : n + 1u];
            same += c == a && d == b;
            opposite += c == b && d == a;
        }
        CHECK(same == 1 && opposite <= 1);
        if (opposite)
            continue;
        vertex_place(l, &mesh, a, p[0]);
        vertex_place(l, &mesh, b, p[1]);
        for (k = 0, on_outline = 0; k < 2u; k++)
            on_outline |= p[0][k] == p[1][k] &&
                          (p[0][k] == (int64_t)first[k] || p[0][k] == (int64_t)last[k]);
        CHECK(on_outline);
        border[border_count][0] = a;
        border[border_count++][1] = b;
    }
    CHECK(border_count >= 4);
    return border_count;
}

/* How far a node's lower skirt hangs down, where the node's lowest point is not above that. */
static float skirt_depth(const land *l, uint32_t node)
{
    terrimp_mesh_info mesh;
    uint32_t first[2], last[2], x, z;
    float low = FLT_MAX, high = -FLT_MAX;
    CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
    land_span(l, node, first, last);
    for (z = first[1]; z <= last[1]; z++)
        for (x = first[0]; x <= last[0]; x++) {
            low = fminf(low, land_sample(l, x, z));
            high = fmaxf(high, land_sample(l, x, z));
        }
    return fmaxf(2.0f * mesh.error, 0.25f * (high - low));
}

static int same_place(const land *l, const terrimp_mesh_info *mesh, uint32_t a, uint32_t b)
{
    int64_t p[2], q[2];
    vertex_place(l, mesh, a, p);
    vertex_place(l, mesh, b, q);
    return p[0] == q[0] && p[1] == q[1];
}

static uint32_t hangs(const land *l, const terrimp_mesh_info *mesh, uint32_t border, uint32_t foot,
                 float low, float deep)
{
    float from = l->xyz[(size_t)(mesh->base_vertex + border) * 3u + 1u];
    float to = l->xyz[(size_t)(mesh->base_vertex + foot) * 3u + 1u];
    return to <= fmaxf(low, from - deep * 0.9999f);
}

/* Skirts hang from every border edge, stand upright, and the lower one reaches a quarter of the
   node's heights down, or the lowest point. */
static void check_skirts(const land *l, uint32_t node, uint16_t border[][2], uint32_t border_count)
{
    terrimp_mesh_info mesh;
    uint32_t first[2], last[2], x, z, e, t, skirts;
    const uint16_t *index;
    float low = FLT_MAX, deep;
    CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
    land_span(l, node, first, last);
    for (z = first[1]; z <= last[1]; z++)
        for (x = first[0]; x <= last[0]; x++)
            low = fminf(low, land_sample(l, x, z));
    deep = skirt_depth(l, node);
    CHECK((mesh.index_count / 3u - mesh.triangle_count) % (2u * border_count) == 0);
    skirts = (mesh.index_count / 3u - mesh.triangle_count) / (2u * border_count);
    CHECK(skirts == (l->desc.no_lower_skirts ? 0u : 1u));
    index = l->indices + mesh.first_index;
    for (t = mesh.triangle_count; t < mesh.index_count / 3u; t++) {
        int64_t p[3][2];
        uint32_t k;
        for (k = 0; k < 3; k++) {
            CHECK(index[t * 3u + k] < mesh.vertex_count);
            vertex_place(l, &mesh, index[t * 3u + k], p[k]);
        }
        CHECK(twice_area(p) == 0);
    }
    for (e = 0; e < border_count; e++) {
        uint32_t found = 0, lower = 0;
        for (t = mesh.triangle_count; t < mesh.index_count / 3u; t++) {
            uint32_t k;
            for (k = 0; k < 3; k++) {
                uint16_t a = index[t * 3u + k], b = index[t * 3u + (k + 1u) % 3u];
                uint16_t c = index[t * 3u + (k + 2u) % 3u];
                if (a != border[e][1] || b != border[e][0])
                    continue; /* the surface has a -> b, so its neighbour has b -> a */
                found++;
                lower += hangs(l, &mesh, same_place(l, &mesh, a, c) ? a : b, c, low, deep);
            }
        }
        CHECK(found == skirts);
        CHECK(l->desc.no_lower_skirts || lower >= 1);
    }
}

/* The points of a chunk's mesh on one side of its square, in order: place and height. */
static uint32_t border_points(const land *l, uint32_t node, int axis, uint32_t line, float out[][2])
{
    terrimp_mesh_info mesh;
    uint32_t i, count = 0, surface = 0, k;
    CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
    for (i = 0; i < mesh.triangle_count * 3u; i++) {
        uint32_t end = l->indices[mesh.first_index + i] + 1u;
        surface = end > surface ? end : surface;
    }
    for (i = 0; i < surface; i++) {
        const float *p = l->xyz + (size_t)(mesh.base_vertex + i) * 3u;
        float wanted = axis == 0 ? land_x(l, line) : land_z(l, line);
        if (p[axis] != wanted)
            continue;
        for (k = count++; k > 0 && out[k - 1u][0] > p[2 - axis]; k--)
            memcpy(out[k], out[k - 1u], sizeof out[k]);
        out[k][0] = p[2 - axis];
        out[k][1] = p[1];
    }
    return count;
}

static float height_along(float (*points)[2], uint32_t count, float at)
{
    uint32_t i = 1;
    float w;
    while (i + 1u < count && points[i][0] < at)
        i++;
    w = (at - points[i - 1u][0]) / (points[i][0] - points[i - 1u][0]);
    return points[i - 1u][1] + w * (points[i][1] - points[i - 1u][1]);
}

/* Neighbours of a level have the same border polyline, bit for bit, but for the corners, which each
   lifts as far as its own borders need. */
static void check_borders(const land *l, uint32_t node)
{
    static float own[1024][2], other[1024][2];
    uint32_t first[2], last[2], n;
    land_node place = land_place(l, node);
    land_span(l, node, first, last);
    if (place.x + 1u < place.wide) {
        n = border_points(l, node, 0, last[0], own);
        CHECK(n >= 2 && border_points(l, node + 1u, 0, last[0], other) == n);
        CHECK(memcmp(own[1], other[1], (n - 2u) * sizeof own[0]) == 0);
    }
    if (place.z + 1u < place.deep) {
        n = border_points(l, node, 2, last[1], own);
        CHECK(n >= 2 && border_points(l, node + place.wide, 2, last[1], other) == n);
        CHECK(memcmp(own[1], other[1], (n - 2u) * sizeof own[0]) == 0);
    }
}

/* The lower ends of a node's skirt on one side of its square, as border_points gives the upper. */
static uint32_t skirt_points(const land *l, uint32_t node, int axis, uint32_t line, float out[][2])
{
    terrimp_mesh_info mesh;
    uint32_t i, k, count = 0, n = terrimpi_mesh_border(&l->terrain->meshes[node]);
    CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
    for (i = 0; i < n; i++) {
        const float *p = l->xyz + (size_t)(mesh.base_vertex + i +
                                           terrimpi_mesh_vertices(&l->terrain->meshes[node])) * 3u;
        if (p[axis] != (axis == 0 ? land_x(l, line) : land_z(l, line)))
            continue;
        for (k = count++; k > 0 && out[k - 1u][0] > p[2 - axis]; k--)
            memcpy(out[k], out[k - 1u], sizeof out[k]);
        out[k][0] = p[2 - axis];
        out[k][1] = p[1];
    }
    return count;
}

/* The highest that ground of levels up to that of quads so long is drawn at place i of a border,
   along x or z. */
static float ground_top(const land *l, uint32_t along_x, uint32_t line, uint32_t first,
                        uint32_t last, uint32_t longest, uint32_t i)
{
    float top = along_x ? land_sample(l, i, line) : land_sample(l, line, i);
    uint32_t step;
    for (step = 2; step <= longest; step *= 2u) {
        uint32_t a = i - (i - first) % step, b = a + step < last ? a + step : last;
        float from = along_x ? land_sample(l, a, line) : land_sample(l, line, a);
        float to = along_x ? land_sample(l, b, line) : land_sample(l, line, b);
        if (b > a)
            top = fmaxf(top, from + (to - from) * (float)(i - a) / (float)(b - a));
    }
    return top;
}

/* Nothing can be seen between a mesh and what is drawn beside it: all ground along a border,
   coarser by one level, or with chunks of 64 by two, is 0.0001 of the node's side below the
   mesh, if such heights can be stored; its skirt ends as much below each sample. Where ground
   is flat, a pixel between the two might have neither. */
static void check_seams(const land *l, uint32_t node)
{
    static float above[1024][2], below[1024][2];
    float slack = 1e-5f * (fabsf(l->info.box.min[1]) + fabsf(l->info.box.max[1]) + 1.0f);
    float under = 0.0001f * (float)(l->info.chunk_quads << land_place(l, node).level) *
                  fminf(l->terrain->desc.field.spacing_x, l->terrain->desc.field.spacing_z);
    float most = terrimpi_terrain_border_height(l->terrain, TERRIMPI_MESH_BORDER_STEPS);
    uint32_t first[2], last[2], side, i, n, m;
    land_span(l, node, first, last);
    for (side = 0; side < 4; side++) {
        uint32_t k = side & 1u, line = side & 2u ? last[k] : first[k];
        n = border_points(l, node, (int)k * 2, line, above);
        m = l->desc.no_lower_skirts ? 0 : skirt_points(l, node, (int)k * 2, line, below);
        CHECK(n >= 2 && (m == n || l->desc.no_lower_skirts));
        for (i = first[1u - k]; i <= last[1u - k]; i++) {
            float at = k ? land_x(l, i) : land_z(l, i);
            float sample = k ? land_sample(l, i, line) : land_sample(l, line, i);
            float top = ground_top(l, k, line, first[1u - k], last[1u - k],
                                   (l->info.chunk_quads >= 64u ? 4u : 2u)
                                       << land_place(l, node).level, i);
            CHECK(l->terrain->desc.proud == 0.0f ||
                  height_along(above, n, at) >= fminf(top + under, most) - slack);
            CHECK(m == 0 || height_along(below, m, at) <= sample - under + slack);
        }
    }
}

/* Counts the sides of a node where a coarser neighbour can be, and those of them where its border,
   which is that of the node's own parent, is too far below or above for the skirt of the higher
   one. */
static void count_reach(const land *l, uint32_t node, uint32_t *sides, uint32_t *out_of_reach)
{
    static float own[1024][2], other[1024][2];
    land_node place = land_place(l, node);
    uint32_t first[2], last[2], whole_first[2], whole_last[2], parent, side, i, n, m;
    float fine, coarse;
    parent = place.first + place.wide * place.deep + place.z / 2u * ((place.wide + 1u) / 2u) +
             place.x / 2u;
    fine = skirt_depth(l, node);
    coarse = skirt_depth(l, parent);
    land_span(l, node, first, last);
    land_span(l, parent, whole_first, whole_last);
    for (side = 0; side < 4; side++) {
        uint32_t k = side & 1u, line = side & 2u ? last[k] : first[k];
        float most = 0.0f, least = 0.0f; /* of this border over the other one */
        if (line != (side & 2u ? whole_last[k] : whole_first[k]))
            continue;
        n = border_points(l, node, (int)k * 2, line, own);
        m = border_points(l, parent, (int)k * 2, line, other);
        for (i = 0; i < n + m; i++) {
            float at = i < n ? own[i][0] : other[i - n][0], over;
            if (at < own[0][0] || at > own[n - 1u][0])
                continue;
            over = height_along(own, n, at) - height_along(other, m, at);
            most = fmaxf(most, over);
            least = fminf(least, over);
        }
        *sides += 1u;
        *out_of_reach += most > fine || -least > coarse ? 1u : 0u;
    }
}

/* Height of a chunk's coarse surface at every sample of it. Returns the room, to be freed. */
static float *mesh_heights(const land *l, uint32_t node)
{
    terrimp_mesh_info mesh;
    uint32_t first[2], last[2], t, cols;
    float *heights;
    CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
    land_span(l, node, first, last);
    cols = last[0] - first[0] + 1u;
    heights = (float *)calloc((size_t)cols * (last[1] - first[1] + 1u), sizeof(float));
    for (t = 0; t < mesh.triangle_count; t++) {
        int64_t p[3][2], least[2], most[2], x, z, area;
        double y[3];
        int k;
        for (k = 0; k < 3; k++) {
            uint16_t index = l->indices[mesh.first_index + t * 3u + (uint32_t)k];
            vertex_place(l, &mesh, index, p[k]);
            y[k] = (double)l->xyz[(size_t)(mesh.base_vertex + index) * 3u + 1u];
        }
        for (k = 0; k < 2; k++) {
            least[k] = p[0][k] < p[1][k] ? p[0][k] : p[1][k];
            least[k] = p[2][k] < least[k] ? p[2][k] : least[k];
            most[k] = p[0][k] > p[1][k] ? p[0][k] : p[1][k];
            most[k] = p[2][k] > most[k] ? p[2][k] : most[k];
        }
        area = twice_area(p);
        for (z = least[1]; z <= most[1]; z++)
            for (x = least[0]; x <= most[0]; x++) {
                int64_t w[3];
                for (k = 0; k < 3; k++) {
                    const int64_t *a = p[(k + 1) % 3], *b = p[(k + 2) % 3];
                    w[k] = (a[1] - z) * (b[0] - x) - (a[0] - x) * (b[1] - z);
                }
                if (w[0] < 0 || w[1] < 0 || w[2] < 0)
                    continue;
                heights[(size_t)(z - first[1]) * cols + (size_t)(x - first[0])] =
                    (float)(((double)w[0] * y[0] + (double)w[1] * y[1] + (double)w[2] * y[2]) /
                            (double)area);
            }
    }
    return heights;
}

/* The error of a mesh is the largest vertical distance to a sample, neither less nor more, and the
   rms that of all samples, at every level. */
static void check_error(const land *l, uint32_t node)
{
    terrimp_mesh_info mesh;
    uint32_t first[2], last[2], x, z;
    float *heights = mesh_heights(l, node);
    double worst = 0.0, squares = 0.0, size;
    CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
    land_span(l, node, first, last);
    for (z = first[1]; z <= last[1]; z++)
        for (x = first[0]; x <= last[0]; x++) {
            size_t at = (size_t)(z - first[1]) * (last[0] - first[0] + 1u) + x - first[0];
            double miss = fabs((double)heights[at] - (double)land_sample(l, x, z));
            worst = fmax(worst, miss);
            squares += miss * miss;
        }
    squares = sqrt(squares / ((double)(last[0] - first[0] + 1u) * (last[1] - first[1] + 1u)));
    size = 1e-5 * (fabs((double)l->info.box.min[1]) + fabs((double)l->info.box.max[1]));
    CHECK(fabs((double)mesh.error - worst) <= 1e-4 * worst + size);
    CHECK(fabs((double)mesh.error_rms - squares) <= 1e-4 * worst + size);
    free(heights);
}

/* A triangle of the floor's walls stands on the outer border and is nowhere over its samples; seen
   from within, it is counter-clockwise. */
static void check_wall(const land *l, int64_t p[3][2], const double y[3])
{
    const terrimp_heightfield *f = &l->desc.field;
    double size = 1e-5 * (fabs((double)l->info.box.min[1]) + 1.0), turn;
    int k, axis = p[0][0] == p[1][0] && p[1][0] == p[2][0] ? 0 : 1; /* that is the same for all */
    int64_t line = p[0][axis], end = axis ? f->depth - 1u : f->width - 1u;
    int64_t from, to, at;
    CHECK(p[1][axis] == line && p[2][axis] == line && (line == 0 || line == end));
    turn = (double)(p[1][1 - axis] - p[0][1 - axis]) * (y[2] - y[0]) -
           (double)(p[2][1 - axis] - p[0][1 - axis]) * (y[1] - y[0]);
    CHECK((line == 0) == (axis == 0) ? turn <= 0.0 : turn >= 0.0);
    for (k = 0; k < 3; k++) {
        int next = (k + 1) % 3;
        from = p[k][1 - axis];
        to = p[next][1 - axis];
        for (at = from; from < to ? at <= to : at >= to; at += from < to ? 1 : -1) {
            double w = from == to ? 0.0 : (double)(at - from) / (double)(to - from);
            double sample = (double)(axis ? land_sample(l, (uint32_t)at, (uint32_t)line)
                                          : land_sample(l, (uint32_t)line, (uint32_t)at));
            CHECK(y[k] + w * (y[next] - y[k]) <= sample + size);
        }
    }
}

/* The floor stands in the buffers behind all meshes: it covers the terrain once, faces up, and lies
   below every sample. */
static void check_floor(const land *l, uint32_t base_vertex, uint32_t first_index)
{
    const terrimp_heightfield *f = &l->desc.field;
    uint32_t i, walls = 0, vertex_count = terrimpi_floor_of(l->terrain).skirt_vertex;
    uint32_t end = first_index + terrimpi_floor_of(l->terrain).skirt_index;
    int64_t area = 0;
    CHECK(vertex_count >= 4 && (end - first_index) % 3u == 0 && end <= l->info.mesh_index_count);
    for (i = first_index; i + 2u < end; i += 3u) {
        int64_t p[3][2], twice, least[2], most[2], x, z;
        double y[3], size = 1e-5 * (fabs((double)l->info.box.min[1]) + 1.0);
        int k;
        for (k = 0; k < 3; k++) {
            uint16_t index = l->indices[i + (uint32_t)k];
            const float *v = l->xyz + (size_t)(base_vertex + index) * 3u;
            CHECK(index < vertex_count);
            p[k][0] = (int64_t)land_line(f->origin_x, f->spacing_x, f->width, v[0]);
            p[k][1] = (int64_t)land_line(f->origin_z, f->spacing_z, f->depth, v[2]);
            y[k] = (double)v[1];
        }
        for (k = 0; k < 2; k++) {
            least[k] = p[0][k] < p[1][k] ? p[0][k] : p[1][k];
            least[k] = p[2][k] < least[k] ? p[2][k] : least[k];
            most[k] = p[0][k] > p[1][k] ? p[0][k] : p[1][k];
            most[k] = p[2][k] > most[k] ? p[2][k] : most[k];
        }
        CHECK(least[0] >= 0 && most[0] < (int64_t)f->width);
        CHECK(least[1] >= 0 && most[1] < (int64_t)f->depth);
        twice = twice_area(p);
        CHECK(twice >= 0);
        area += twice;
        if (twice == 0) {
            walls++;
            check_wall(l, p, y);
        }
        for (z = least[1]; twice > 0 && z <= most[1]; z++)
            for (x = least[0]; x <= most[0]; x++) {
                int64_t w[3];
                for (k = 0; k < 3; k++) {
                    const int64_t *a = p[(k + 1) % 3], *b = p[(k + 2) % 3];
                    w[k] = (a[1] - z) * (b[0] - x) - (a[0] - x) * (b[1] - z);
                }
                if (w[0] < 0 || w[1] < 0 || w[2] < 0)
                    continue;
                CHECK(((double)w[0] * y[0] + (double)w[1] * y[1] + (double)w[2] * y[2]) /
                          (double)twice <=
                      (double)land_sample(l, (uint32_t)x, (uint32_t)z) + size);
            }
    }
    CHECK(area == 2 * (int64_t)(f->width - 1u) * (int64_t)(f->depth - 1u));
    CHECK(walls >= 8);
}

static void check_land(const land *l)
{
    static uint16_t border[4096][2];
    uint32_t node, border_count, triangles = 0, vertices, indices;
    check_hierarchy(l);
    for (node = 0; node < l->info.node_count; node++) {
        terrimp_mesh_info mesh;
        CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
        triangles += mesh.triangle_count;
        CHECK(mesh.base_vertex == node * l->info.mesh_vertex_stride);
        CHECK(mesh.first_index == node * l->info.mesh_index_stride);
        CHECK(mesh.vertex_count <= l->info.mesh_vertex_stride);
        CHECK(mesh.index_count <= l->info.mesh_index_stride);
        check_chunk_box(l, node);
        check_ground(l, node);
        border_count = check_cover(l, node, border);
        check_skirts(l, node, border, border_count);
        check_borders(l, node);
        check_seams(l, node);
        check_error(l, node);
    }
    CHECK(triangles == l->info.mesh_triangle_count);
    vertices = l->info.node_count * l->info.mesh_vertex_stride;
    indices = l->info.node_count * l->info.mesh_index_stride;
    CHECK(vertices < l->info.mesh_vertex_count && indices < l->info.mesh_index_count);
    check_floor(l, vertices, indices);
}

static void terrain_defaults_are_those_of_the_table(void)
{
    float samples[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    terrimp_terrain_desc desc, out;
    memset(&desc, 0, sizeof desc);
    desc.field.samples = samples;
    desc.field.width = desc.field.depth = 2;
    CHECK(terrimp_terrain_desc_resolve(&desc, &out) == TERRIMP_OK);
    CHECK(out.chunk_quads == 64 && out.triangle_budget == 85 && out.proud == 1.0f);
    CHECK(out.field.format == TERRIMP_FORMAT_F32 && out.field.row_bytes == 8);
    CHECK(out.field.spacing_x == 1.0f && out.field.spacing_z == 1.0f);
    CHECK(!out.not_proud && !out.no_lower_skirts);
    desc.proud = 0.5f;
    desc.not_proud = 1;
    CHECK(terrimp_terrain_desc_resolve(&desc, &desc) == TERRIMP_OK && desc.proud == 0.0f);
}

static void terrains_of_every_size_build_and_keep_their_laws(void)
{
    static const uint32_t sizes[][3] = {/* width, depth, chunk quads */
        {2, 2, 0}, {2, 2, 4}, {3, 2, 4}, {2, 700, 8}, {700, 2, 16}, {38, 75, 36}, {65, 65, 64},
        {66, 65, 64}, {40, 33, 16}, {17, 50, 6}, {130, 67, 128}, {10, 9, 4}, {31, 31, 4},
        {3, 200, 8}, {59, 94, 8}};
    size_t i;
    for (i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        land l;
        land_prepare(&l, sizes[i][0], sizes[i][1], TERRIMP_FORMAT_F32, LAND_HILLS);
        l.desc.chunk_quads = sizes[i][2];
        if (land_build(&l))
            check_land(&l);
        land_free(&l);
    }
}

static void skirts_reach_neighbours_of_the_next_level(void)
{
    uint32_t chunk_quads, node, sides = 0, out_of_reach = 0;
    for (chunk_quads = 16; chunk_quads <= 64; chunk_quads *= 2) {
        land l;
        land_prepare(&l, 257, 257, TERRIMP_FORMAT_F32, LAND_HILLS);
        l.desc.chunk_quads = chunk_quads;
        if (land_build(&l))
            for (node = 0; node + 1u < l.info.node_count; node++)
                count_reach(&l, node, &sides, &out_of_reach);
        land_free(&l);
    }
    printf("  skirts fall short on %u of %u sides\n", (unsigned)out_of_reach, (unsigned)sides);
    CHECK(sides > 500 && out_of_reach == 0);
}

/* Hess would not fly over 2 x 5000 samples, but hosts do have rivers and roads. */
static void terrain_of_two_columns_builds(void)
{
    land l;
    land_prepare(&l, 2, 5000, TERRIMP_FORMAT_S16, LAND_NOISE);
    if (land_build(&l)) {
        CHECK(l.info.chunks_x == 1 && l.info.chunks_z == 79 && l.info.level_count == 8);
        check_land(&l);
    }
    land_free(&l);
}

static void terrains_of_every_format_and_shape_keep_their_laws(void)
{
    int format, shape;
    for (format = TERRIMP_FORMAT_DEFAULT; format < TERRIMP_FORMAT_COUNT; format++)
        for (shape = LAND_HILLS; shape <= LAND_NOISE; shape++) {
            land l;
            land_prepare(&l, 21, 28, format, (land_shape)shape);
            l.desc.chunk_quads = 16;
            l.desc.field.origin_x = -1000.0f;
            l.desc.field.origin_z = 333.25f;
            l.desc.field.spacing_x = 2.5f;
            l.desc.field.spacing_z = 0.75f;
            l.desc.field.height_offset = -50.0f;
            l.desc.triangle_budget = 40;
            l.desc.not_proud = format & 1;
            l.desc.no_lower_skirts = shape == LAND_RAMP;
            if (land_build(&l))
                check_land(&l);
            land_free(&l);
        }
}

static void terrains_of_every_budget_build(void)
{
    uint32_t budget;
    for (budget = 32; budget <= 400; budget += budget < 128 ? 7 : 64) {
        land l;
        land_prepare(&l, 40, 21, TERRIMP_FORMAT_F32, LAND_NOISE);
        l.desc.chunk_quads = 32;
        l.desc.triangle_budget = budget;
        if (land_build(&l))
            check_land(&l);
        land_free(&l);
    }
}

/* The part of all samples that stand out of their coarse meshes by more than rounding. */
static double samples_standing_out(const land *l)
{
    uint32_t node, above = 0, count = 0;
    for (node = 0; node < l->info.node_count; node++) {
        float *heights = mesh_heights(l, node);
        uint32_t first[2], last[2], x, z;
        land_span(l, node, first, last);
        for (z = first[1]; z <= last[1]; z++)
            for (x = first[0]; x <= last[0]; x++) {
                size_t at = (size_t)(z - first[1]) * (last[0] - first[0] + 1u) + x - first[0];
                above += land_sample(l, x, z) > heights[at] + 1e-3f;
                count++;
            }
        free(heights);
    }
    return (double)above / (double)count;
}

/* Raised meshes keep terrain below them, so that silhouettes are not cut, but beside the corners of
   chunks; what is not raised runs through the middle of the terrain. */
static void proud_meshes_stand_above_the_terrain(void)
{
    int proud;
    for (proud = 0; proud < 2; proud++) {
        land l;
        land_prepare(&l, 97, 97, TERRIMP_FORMAT_F32, LAND_HILLS);
        l.desc.chunk_quads = 32;
        l.desc.not_proud = !proud;
        if (land_build(&l)) {
            double part = samples_standing_out(&l);
            CHECK(proud ? part < 0.02 : part > 0.3 && part < 0.7);
        }
        land_free(&l);
    }
}

/* The corners of every node are its samples but for the step of heights that they are rounded to;
   where meshes stand proud they are not below them, and over them where a border needs it. */
static void corners_stand_on_their_samples(void)
{
    int proud;
    for (proud = 0; proud < 2; proud++) {
        land l;
        uint32_t node, i;
        land_prepare(&l, 70, 59, TERRIMP_FORMAT_F32, LAND_NOISE);
        l.desc.chunk_quads = 8;
        l.desc.not_proud = !proud;
        if (!land_build(&l))
            l.info.node_count = 0;
        for (node = 0; node < l.info.node_count; node++) {
            uint32_t first[2], last[2], corners = 0;
            terrimp_mesh_info mesh;
            float step = 3.0f * 250.0f / 4194303.0f, rounding = 5e-5f;
            CHECK(terrimp_terrain_get_mesh(l.terrain, node, &mesh) == TERRIMP_OK);
            land_span(&l, node, first, last);
            for (i = 0; i < terrimpi_mesh_border(&l.terrain->meshes[node]); i++) {
                const float *p = l.xyz + (size_t)(mesh.base_vertex + i) * 3u;
                uint32_t x = (uint32_t)p[0], z = (uint32_t)p[2];
                float over;
                if ((x != first[0] && x != last[0]) || (z != first[1] && z != last[1]))
                    continue;
                corners++;
                over = p[1] - land_sample(&l, x, z);
                CHECK(over >= (proud ? -1e-4f : -0.51f * step - rounding));
                CHECK(proud || over <= 0.51f * step + rounding);
            }
            CHECK(corners == 4);
        }
        land_free(&l);
    }
}

/* Chunks may be built in any order; the blocks hold exactly what they are said to hold. */
static void build_order_and_memory_make_no_difference(void)
{
    enum { GUARD = 64 };
    land l;
    terrimp_terrain *terrain = NULL, *early = NULL;
    terrimp_terrain_desc desc;
    size_t bytes, scratch_bytes;
    uint64_t *block, *scratch;
    uint32_t node;
    float *xyz;
    uint16_t *indices;
    land_prepare(&l, 50, 39, TERRIMP_FORMAT_U8, LAND_HILLS);
    l.desc.chunk_quads = 8;
    desc = l.desc;
    if (!land_build(&l)) {
        land_free(&l);
        return;
    }
    bytes = terrimp_terrain_bytes(&desc);
    scratch_bytes = terrimp_terrain_scratch_bytes(&desc);
    CHECK(bytes > 0 && scratch_bytes > 0);
    block = (uint64_t *)malloc(bytes + GUARD + 8u);
    scratch = (uint64_t *)malloc(scratch_bytes + GUARD + 8u);
    memset(block, UNTOUCHED, bytes + GUARD + 8u);
    memset(scratch, UNTOUCHED, scratch_bytes + GUARD + 8u);
    CHECK(terrimp_terrain_init(&desc, block, bytes - 1u, &terrain) == TERRIMP_E_MEMORY);
    CHECK(terrimp_terrain_init(&desc, (char *)block + 1, bytes, &terrain) == TERRIMP_E_ALIGN);
    CHECK(terrain == NULL && is_untouched(block, bytes));
    CHECK(terrimp_terrain_init(&desc, block, bytes, &terrain) == TERRIMP_OK);
    early = terrain;
    CHECK(terrimp_terrain_build_finish(early) == TERRIMP_E_STATE);
    CHECK(terrimp_terrain_build_node(terrain, 0, scratch, scratch_bytes - 1u) == TERRIMP_E_MEMORY);
    CHECK(terrimp_terrain_build_node(terrain, 0, (char *)scratch + 1, scratch_bytes) ==
          TERRIMP_E_ALIGN);
    CHECK(terrimp_terrain_build_node(terrain, 0, scratch, scratch_bytes) == TERRIMP_E_STATE);
    CHECK(terrimp_terrain_build_begin(terrain) == TERRIMP_OK);
    for (node = l.info.node_count; node-- > 0;) {
        CHECK(terrimp_terrain_build_finish(terrain) == TERRIMP_E_STATE);
        CHECK(terrimp_terrain_build_node(terrain, node, scratch, scratch_bytes) == TERRIMP_OK);
        memset(scratch, (int)node, scratch_bytes); /* nothing is kept there */
    }
    CHECK(terrimp_terrain_build_finish(terrain) == TERRIMP_OK);
    xyz = (float *)malloc(l.info.mesh_vertex_count * 3u * sizeof(float));
    indices = (uint16_t *)malloc(l.info.mesh_index_count * sizeof(uint16_t));
    CHECK(terrimp_terrain_fill_meshes(terrain, xyz, l.info.mesh_vertex_count * 3u, indices,
                                      l.info.mesh_index_count) == TERRIMP_OK);
    CHECK(memcmp(xyz, l.xyz, l.info.mesh_vertex_count * 3u * sizeof(float)) == 0);
    CHECK(memcmp(indices, l.indices, l.info.mesh_index_count * sizeof(uint16_t)) == 0);
    CHECK(is_untouched((char *)block + bytes, GUARD));
    CHECK(is_untouched((char *)scratch + scratch_bytes, GUARD));
    terrimp_terrain_destroy(terrain); /* not made by create: nothing happens */
    free(xyz);
    free(indices);
    free(block);
    free(scratch);
    land_free(&l);
}

/* ---- patterns ---- */

/* Counts how often a range of the shared indices covers each quad; all triangles must face up and
   follow the diagonal of the house. */
static void count_quads(const land *l, uint32_t first, uint32_t count, unsigned char *covered)
{
    uint32_t quads = l->info.chunk_quads, side = quads + 1u, i;
    CHECK(count % 6u == 0 && first + count <= l->info.ground_index_count);
    memset(covered, 0, (size_t)quads * quads);
    for (i = first; i + 2u < first + count; i += 3u) {
        int64_t p[3][2], twice, least_x, least_z;
        int k;
        for (k = 0; k < 3; k++) {
            CHECK(l->patterns[i + (uint32_t)k] < side * side);
            p[k][0] = l->patterns[i + (uint32_t)k] % side;
            p[k][1] = l->patterns[i + (uint32_t)k] / side;
        }
        twice = twice_area(p);
        CHECK(twice == 1); /* half a quad, upwards */
        least_x = p[0][0] < p[1][0] ? p[0][0] : p[1][0];
        least_x = p[2][0] < least_x ? p[2][0] : least_x;
        least_z = p[0][1] < p[1][1] ? p[0][1] : p[1][1];
        least_z = p[2][1] < least_z ? p[2][1] : least_z;
        for (k = 0; k < 3; k++)
            CHECK(p[k][0] - least_x <= 1 && p[k][1] - least_z <= 1);
        /* The corner off the diagonal tells the two triangles apart. */
        for (k = 0; k < 3; k++)
            if (p[k][0] - least_x != p[k][1] - least_z)
                covered[least_z * (int64_t)quads + least_x] ^= p[k][0] > least_x ? 1 : 16;
    }
}

/* The shared buffer begins with all geomip patterns. */
static void patterns_are_those_of_the_geomipmap(void)
{
    static const uint32_t quads[] = {4, 6, 16, 34, 64, 128};
    size_t i;
    for (i = 0; i < sizeof quads / sizeof quads[0]; i++) {
        land l;
        uint32_t count = terrimp_pattern_index_count(quads[i], TERRIMP_FORM_LIST);
        uint16_t *wanted = (uint16_t *)malloc(count * sizeof *wanted);
        terrimpi_terrain_pattern whole = terrimpi_terrain_pattern_of(quads[i], 0);
        terrimp_pattern first = {0, 0, 0};
        land_prepare(&l, 3, 3, TERRIMP_FORMAT_U8, LAND_FLAT);
        l.desc.chunk_quads = quads[i];
        CHECK(terrimp_pattern_fill(quads[i], TERRIMP_FORM_LIST, wanted, count) == TERRIMP_OK);
        if (land_build(&l))
            CHECK(memcmp(wanted, l.patterns, count * sizeof *wanted) == 0);
        CHECK(terrimp_pattern_find(quads[i], TERRIMP_FORM_LIST, 0, &first) == TERRIMP_OK);
        CHECK(whole.first_index == first.first_index && whole.index_count == first.index_count);
        CHECK(whole.triangle_count == first.triangle_count);
        free(wanted);
        land_free(&l);
    }
}

/* Strips follow the geomip patterns: eight a width, a 16th of the node, then twice as wide. Each is
   the rectangle next to the node in its direction, covered once. */
static void strips_cover_exactly_their_quads(void)
{
    static const uint32_t quads[] = {4, 6, 16, 34, 64, 128};
    static const int way[8][2] = {{-1, -1}, {0, -1}, {1, -1}, {-1, 0},
                                  {1, 0},   {-1, 1}, {0, 1},  {1, 1}};
    size_t i;
    for (i = 0; i < sizeof quads / sizeof quads[0]; i++) {
        land l;
        uint32_t n = quads[i], first = terrimp_pattern_index_count(n, TERRIMP_FORM_LIST), strip, d;
        uint32_t x, z, pattern = 1;
        unsigned char *covered = (unsigned char *)malloc((size_t)n * n);
        land_prepare(&l, 3, 3, TERRIMP_FORMAT_U8, LAND_FLAT);
        l.desc.chunk_quads = n;
        if (!land_build(&l)) {
            free(covered);
            land_free(&l);
            continue;
        }
        for (strip = n < 16u ? 1u : n / 16u; strip < n; strip *= 2u)
            for (d = 0; d < 8u; d++) {
                uint32_t from[2], to[2], k, count;
                for (k = 0; k < 2u; k++) {
                    from[k] = way[d][k] < 0 ? n - strip : 0;
                    to[k] = way[d][k] > 0 ? strip : n;
                }
                count = (to[0] - from[0]) * (to[1] - from[1]) * 6u;
                CHECK(terrimpi_terrain_pattern_of(n, pattern).first_index == first);
                CHECK(terrimpi_terrain_pattern_of(n, pattern++).index_count == count);
                count_quads(&l, first, count, covered);
                for (z = 0; z < n; z++)
                    for (x = 0; x < n; x++)
                        CHECK(covered[z * n + x] == (x >= from[0] && x < to[0] && z >= from[1] &&
                                                             z < to[1]
                                                         ? 17
                                                         : 0));
                first += count;
            }
        CHECK(first == l.info.ground_index_count);
        free(covered);
        land_free(&l);
    }
}

/* ---- parallax on real meshes ---- */

/* P is a sample, Q the foot on the capture's ray of P's vertical projection to the coarse mesh:
   |PQ| <= the mesh's error, and the bound holds for every sample and random eyes. */
static void parallax_bound_holds_for_every_sample_of_a_mesh(void)
{
    land l;
    uint32_t node;
    int i, k, compared = 0;
    land_prepare(&l, 65, 65, TERRIMP_FORMAT_F32, LAND_HILLS);
    l.desc.chunk_quads = 32;
    if (!land_build(&l)) {
        land_free(&l);
        return;
    }
    for (node = 0; node < land_chunks(&l); node++) {
        terrimp_mesh_info mesh;
        terrimp_box box;
        uint32_t first[2], last[2], x, z;
        float *heights = mesh_heights(&l, node);
        CHECK(terrimp_terrain_get_mesh(l.terrain, node, &mesh) == TERRIMP_OK);
        CHECK(terrimp_terrain_get_box(l.terrain, node, &box) == TERRIMP_OK);
        land_span(&l, node, first, last);
        for (i = 0; i < 12; i++) {
            float from[3], to[3], move[3], predicted = 0.0f;
            double a[3], b[3];
            random_vector(100.0f, 600.0f, from);
            for (k = 0; k < 3; k++)
                from[k] += 0.5f * (box.min[k] + box.max[k]);
            random_vector(1.0f, 0.4f * terrimp_box_distance(&box, from) + 2.0f, move);
            for (k = 0; k < 3; k++)
                to[k] = from[k] + move[k];
            CHECK(terrimp_parallax_error(&box, mesh.error, from, to, 1000.0f, &predicted) ==
                  TERRIMP_OK);
            oracle_widen(from, a);
            oracle_widen(to, b);
            for (z = first[1]; z <= last[1]; z++)
                for (x = first[0]; x <= last[0]; x++) {
                    size_t at = (size_t)(z - first[1]) * (last[0] - first[0] + 1u) + x - first[0];
                    double p[3], q[3], ray[3], length, along;
                    p[0] = (double)land_x(&l, x);
                    p[1] = (double)land_sample(&l, x, z);
                    p[2] = (double)land_z(&l, z);
                    oracle_between(a, p, ray);
                    length = oracle_length(ray);
                    along = ((double)heights[at] - p[1]) * ray[1] / length;
                    for (k = 0; k < 3; k++)
                        q[k] = p[k] + along * ray[k] / length;
                    oracle_between(b, p, p);
                    oracle_between(b, q, q);
                    CHECK(1000.0 * tan(oracle_angle(p, q)) <= (double)predicted * 1.0001 + 1e-4);
                    compared++;
                }
        }
        free(heights);
    }
    CHECK(compared > 10000);
    land_free(&l);
}

/* A host that fills its buffers node by node has the same as one that fills them at once. */
static void parts_of_buffers_are_those_of_the_whole(void)
{
    land l;
    land_prepare(&l, 50, 70, TERRIMP_FORMAT_F32, LAND_HILLS);
    l.desc.chunk_quads = 8;
    if (land_build(&l)) {
        uint32_t node;
        size_t mesh = 3u * (size_t)l.info.mesh_vertex_stride, stride = l.info.mesh_index_stride;
        size_t floor = 3u * (size_t)l.info.mesh_vertex_count - mesh * l.info.node_count;
        size_t floor_indices = l.info.mesh_index_count - stride * l.info.node_count;
        float *xyz = (float *)malloc((mesh + floor) * sizeof *xyz);
        uint16_t *indices = (uint16_t *)malloc((stride + floor_indices) * sizeof *indices);
        for (node = 0; node <= l.info.node_count; node++) {
            size_t floats = node < l.info.node_count ? mesh : floor;
            size_t corners = node < l.info.node_count ? stride : floor_indices;
            CHECK(terrimp_terrain_fill_mesh(l.terrain, node, xyz, floats, indices, corners) ==
                  TERRIMP_OK);
            CHECK(memcmp(xyz, l.xyz + node * mesh, floats * sizeof *xyz) == 0);
            CHECK(memcmp(indices, l.indices + node * stride, corners * sizeof *indices) == 0);
            CHECK(terrimp_terrain_fill_mesh(l.terrain, node, xyz, floats - 1u, indices, corners) ==
                  TERRIMP_E_CAPACITY);
            CHECK(terrimp_terrain_fill_mesh(l.terrain, node, xyz, floats, indices, corners - 1u) ==
                  TERRIMP_E_CAPACITY);
        }
        CHECK(terrimp_terrain_fill_mesh(l.terrain, node, xyz, mesh, indices, stride) ==
              TERRIMP_E_RANGE);
        free(xyz);
        free(indices);
    }
    land_free(&l);
}

/* Whether a node has a sample, its border included. */
static int node_has(const land *l, uint32_t node, uint32_t x, uint32_t z)
{
    uint32_t first[2], last[2];
    land_span(l, node, first, last);
    return x >= first[0] && x <= last[0] && z >= first[1] && z <= last[1];
}

/* One sample of an extreme value, such as a void that nobody marked, spoils the meshes of the nodes
   that hold it and no other: these are as good as without it, but for the steps of borders, and for
   what neighbours draw beside it. */
static void one_wild_sample_spoils_only_its_own_nodes(void)
{
    static const float wild[] = {-999999.0f, -32768.0f, 1e6f};
    int i;
    for (i = 0; i < 3; i++) {
        land tame, spoilt;
        uint32_t node, others = 0, x = random_range(1, 95), z = random_range(1, 79), seed;
        float step = 3.0f * (fabsf(wild[i]) + 250.0f) / 4194303.0f;
        seed = check_state;
        land_prepare(&tame, 97, 81, TERRIMP_FORMAT_F32, LAND_HILLS);
        check_state = seed;
        land_prepare(&spoilt, 97, 81, TERRIMP_FORMAT_F32, LAND_HILLS);
        tame.desc.chunk_quads = spoilt.desc.chunk_quads = 8;
        spoilt.samples[z * 97u + x] = wild[i];
        if (land_build(&tame) && land_build(&spoilt))
            for (node = 0; node < tame.info.node_count; node++) {
                terrimp_mesh_info a, b;
                uint32_t first[2], last[2], reach;
                land_span(&tame, node, first, last);
                reach = 8u * (last[0] - first[0]); /* borders stand over coarser ground beside */
                if (node_has(&tame, node, x, z) ||
                    (x + reach >= first[0] && x <= last[0] + reach &&
                     (z == first[1] || z == last[1])) ||
                    (z + reach >= first[1] && z <= last[1] + reach &&
                     (x == first[0] || x == last[0])))
                    continue;
                CHECK(terrimp_terrain_get_mesh(tame.terrain, node, &a) == TERRIMP_OK);
                CHECK(terrimp_terrain_get_mesh(spoilt.terrain, node, &b) == TERRIMP_OK);
                CHECK(b.error <= a.error + 2.0f * step + 1e-3f);
                CHECK(b.error_rms <= a.error_rms + 2.0f * step + 1e-3f);
                others++;
            }
        CHECK(others > 100);
        land_free(&tame);
        land_free(&spoilt);
    }
}

static inline void terrain_tests(void)
{
    RUN(parts_of_buffers_are_those_of_the_whole);
    RUN(terrain_defaults_are_those_of_the_table);
    RUN(terrains_of_every_size_build_and_keep_their_laws);
    RUN(skirts_reach_neighbours_of_the_next_level);
    RUN(terrain_of_two_columns_builds);
    RUN(terrains_of_every_format_and_shape_keep_their_laws);
    RUN(terrains_of_every_budget_build);
    RUN(proud_meshes_stand_above_the_terrain);
    RUN(corners_stand_on_their_samples);
    RUN(build_order_and_memory_make_no_difference);
    RUN(patterns_are_those_of_the_geomipmap);
    RUN(strips_cover_exactly_their_quads);
    RUN(parallax_bound_holds_for_every_sample_of_a_mesh);
    RUN(one_wild_sample_spoils_only_its_own_nodes);
}

#endif
