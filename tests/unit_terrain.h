/* Laws of the terrain room: chunks, meshes, patterns, and the commands of views in flight. */
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
    if (format == TERRIMP_FORMAT_U16 || format == TERRIMP_FORMAT_S16)
        l->desc.field.height_scale = 1.0f / 256.0f;
    for (z = 0; z < depth; z++)
        for (x = 0; x < width; x++)
            land_write(l, (size_t)z * width + x, land_height(shape, x, z, width, depth));
}

/* Builds the terrain of l->desc and reads everything that a host would; returns whether it did. */
static int land_build(land *l)
{
    terrimp_result result = terrimp_terrain_create(&l->desc, NULL, &l->terrain);
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
    float height = -1e30f;
    CHECK(terrimp_heightfield_sample(&l->desc.field, x, z, &height) == TERRIMP_OK);
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

/* Skirts hang from every border edge, stand upright, and the lower one reaches the lowest point. */
static void check_skirts(const land *l, uint32_t node, uint16_t border[][2], uint32_t border_count)
{
    terrimp_mesh_info mesh;
    uint32_t first[2], last[2], x, z, e, t, skirts;
    const uint16_t *index;
    float low = FLT_MAX;
    CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
    land_span(l, node, first, last);
    for (z = first[1]; z <= last[1]; z++)
        for (x = first[0]; x <= last[0]; x++)
            low = fminf(low, land_sample(l, x, z));
    CHECK((mesh.index_count / 3u - mesh.triangle_count) % (2u * border_count) == 0);
    skirts = (mesh.index_count / 3u - mesh.triangle_count) / (2u * border_count);
    CHECK(skirts >= (l->desc.no_lower_skirts ? 0u : 1u));
    CHECK(skirts <= (l->desc.no_lower_skirts ? 0u : 1u) + (l->desc.no_upper_skirts ? 0u : 1u));
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
                lower += l->xyz[(size_t)(mesh.base_vertex + c) * 3u + 1u] <= low;
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

/* Neighbours have the same border polyline, bit for bit: no gap, no T-junction. */
static void check_borders(const land *l, uint32_t node)
{
    static float own[1024][2], other[1024][2];
    uint32_t first[2], last[2], n;
    land_node place = land_place(l, node);
    land_span(l, node, first, last);
    if (place.x + 1u < place.wide) {
        n = border_points(l, node, 0, last[0], own);
        CHECK(n >= 2 && border_points(l, node + 1u, 0, last[0], other) == n);
        CHECK(memcmp(own, other, n * sizeof own[0]) == 0);
    }
    if (place.z + 1u < place.deep) {
        n = border_points(l, node, 2, last[1], own);
        CHECK(n >= 2 && border_points(l, node + place.wide, 2, last[1], other) == n);
        CHECK(memcmp(own, other, n * sizeof own[0]) == 0);
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

/* The floor stands in the buffers behind all meshes: it covers the terrain once, faces up, and lies
   below every sample. */
static void check_floor(const land *l, uint32_t base_vertex, uint32_t first_index)
{
    const terrimp_heightfield *f = &l->desc.field;
    uint32_t i, vertex_count = l->info.mesh_vertex_count - base_vertex;
    int64_t area = 0;
    CHECK(vertex_count >= 4 && (l->info.mesh_index_count - first_index) % 3u == 0);
    for (i = first_index; i + 2u < l->info.mesh_index_count; i += 3u) {
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
        CHECK(twice > 0);
        area += twice;
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
    CHECK(!out.not_proud && !out.no_lower_skirts && !out.no_upper_skirts);
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
            l.desc.no_upper_skirts = shape == LAND_NOISE || shape == LAND_RAMP;
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

/* The corners of every node are its samples but for the step of heights that they are rounded to,
   up where meshes stand proud: so four nodes of a level agree on them. */
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
            float step = 3.0f * 250.0f / 65535.0f * 1.01f;
            CHECK(terrimp_terrain_get_mesh(l.terrain, node, &mesh) == TERRIMP_OK);
            land_span(&l, node, first, last);
            for (i = 0; i < l.terrain->meshes[node].border_count; i++) {
                const float *p = l.xyz + (size_t)(mesh.base_vertex + i) * 3u;
                uint32_t x = (uint32_t)p[0], z = (uint32_t)p[2];
                float over;
                if ((x != first[0] && x != last[0]) || (z != first[1] && z != last[1]))
                    continue;
                corners++;
                over = p[1] - land_sample(&l, x, z);
                CHECK(over >= (proud ? -1e-4f : -0.51f * step));
                CHECK(over <= (proud ? step : 0.51f * step));
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
        terrimpi_pattern whole = terrimpi_find_pattern(quads[i], 0);
        terrimp_pattern first;
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
                CHECK(terrimpi_find_pattern(n, pattern).first_index == first);
                CHECK(terrimpi_find_pattern(n, pattern++).index_count == count);
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
            float from[3], to[3], move[3], predicted;
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

/* ---- views in flight ---- */

enum { FLIGHT_CHUNKS = 400 };

/* The last picture of a chunk in one atlas. */
typedef struct flight_picture {
    int alive; /* captured, and not overwritten since */
    terrimp_capture_command capture;
} flight_picture;

/* Everything a host would see of one view, and what the laws need to know. */
typedef struct flight {
    const land *l;
    terrimp_view *view;
    terrimp_view_desc desc; /* resolved */
    terrimp_camera camera;  /* resolved, of this frame */
    flight_picture pictures[FLIGHT_CHUNKS][2];
    int latest[FLIGHT_CHUNKS]; /* atlas of a chunk's latest picture, -1: none */
    /* This frame: */
    int has_ground[FLIGHT_CHUNKS], has_impostor[FLIGHT_CHUNKS];
    terrimp_ground_command ground[FLIGHT_CHUNKS];
    terrimp_impostor_command impostor[FLIGHT_CHUNKS];
    uint32_t ground_order[FLIGHT_CHUNKS], impostor_order[FLIGHT_CHUNKS];
    uint32_t ground_count, impostor_count, capture_count, captured_triangles, captured_texels;
    uint32_t triangles;
    int in_capture, screen_started, floor_drawn, close_ground_started;
    terrimp_capture_command open; /* while in_capture */
    double open_area;             /* of ground drawn into it, in quads */
    uint32_t hash;
    uint32_t total_captures, total_impostors, total_ground, total_waiting;
} flight;

static float node_distance(const flight *f, uint32_t node)
{
    terrimp_box box;
    CHECK(terrimp_terrain_get_box(f->l->terrain, node, &box) == TERRIMP_OK);
    return terrimp_box_distance(&box, f->camera.eye);
}

static void flight_begin_capture(void *user, const terrimp_capture_command *command)
{
    flight *f = (flight *)user;
    uint32_t node;
    CHECK(!f->in_capture && !f->screen_started);
    CHECK(command->node < land_chunks(f->l) && command->atlas < 2);
    CHECK(rect_within(&command->slot, f->desc.atlas_size, f->desc.atlas_size));
    CHECK(command->slot.width > 0 && command->slot.height > 0);
    CHECK(memcmp(command->eye, f->camera.eye, sizeof command->eye) == 0);
    /* What lay there is gone. */
    for (node = 0; node < land_chunks(f->l); node++) {
        flight_picture *other = &f->pictures[node][command->atlas];
        if (other->alive && rects_overlap(&other->capture.slot, &command->slot, 0))
            other->alive = 0;
    }
    f->in_capture = 1;
    f->open = *command;
    f->open_area = 0.0;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
    f->captured_texels += command->slot.width * command->slot.height;
}

static void flight_end_capture(void *user, const terrimp_capture_command *command)
{
    flight *f = (flight *)user;
    flight_picture *picture = &f->pictures[command->node][command->atlas];
    const terrimp_heightfield *field = &f->l->desc.field;
    double x0, x1, z0, z1;
    CHECK(f->in_capture && memcmp(command, &f->open, sizeof *command) == 0);
    f->in_capture = 0;
    /* The ground that was drawn is all of the terrain within the clip rectangle, and no more. */
    x0 = fmax((double)command->clip_min[0], (double)land_x(f->l, 0));
    x1 = fmin((double)command->clip_max[0], (double)land_x(f->l, field->width - 1u));
    z0 = fmax((double)command->clip_min[1], (double)land_z(f->l, 0));
    z1 = fmin((double)command->clip_max[1], (double)land_z(f->l, field->depth - 1u));
    x1 = (x1 - x0) / (double)field->spacing_x;
    z1 = (z1 - z0) / (double)field->spacing_z;
    CHECK(fabs(f->open_area - x1 * z1) < 1e-3 * x1 * z1);
    picture->alive = 1;
    picture->capture = *command;
    f->latest[command->node] = (int)command->atlas;
    f->capture_count++;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
}

/* Adds the area of a range of ground, in quads of the field, and checks that it keeps to the clip
   rectangle. */
static void flight_captured_ground(flight *f, const terrimp_ground_command *command)
{
    uint32_t first[2], last[2], i, side = f->l->info.chunk_quads + 1u;
    float slack = 1e-3f;
    land_span(f->l, command->node, first, last);
    for (i = 0; i < command->index_count; i += 3u) {
        const uint16_t *index = f->l->patterns + command->first_index + i;
        uint32_t at = index[0] < index[1] ? index[0] : index[1], x, z;
        at = index[2] < at ? index[2] : at;
        x = first[0] + at % side;
        z = first[1] + at / side;
        if (index[0] == index[1] || index[1] == index[2] || index[0] == index[2])
            continue;
        f->captured_triangles++;
        if (x >= last[0] || z >= last[1])
            continue; /* beyond the far edge: no area */
        f->open_area += 0.5;
        CHECK(land_x(f->l, x) >= f->open.clip_min[0] - slack);
        CHECK(land_x(f->l, x + 1u) <= f->open.clip_max[0] + slack);
        CHECK(land_z(f->l, z) >= f->open.clip_min[1] - slack);
        CHECK(land_z(f->l, z + 1u) <= f->open.clip_max[1] + slack);
    }
}

static void flight_draw_ground(void *user, const terrimp_ground_command *command)
{
    flight *f = (flight *)user;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
    CHECK(command->node < land_chunks(f->l));
    CHECK(command->first_index + command->index_count <= f->l->info.ground_index_count);
    if (f->in_capture) {
        CHECK(command->fade_start == 0.0f && command->fade_end == 0.0f);
        CHECK(command->depth_bias == 0.0f);
        CHECK(f->open_area > 0.0 || command->node == f->open.node); /* itself first */
        flight_captured_ground(f, command);
        return;
    }
    f->screen_started = 1;
    CHECK(!f->has_ground[command->node]);
    CHECK(command->first_index == 0);
    CHECK(command->index_count == terrimpi_find_pattern(f->l->info.chunk_quads, 0).index_count);
    f->close_ground_started |= node_distance(f, command->node) < f->desc.fade_end;
    f->has_ground[command->node] = 1;
    f->ground[command->node] = *command;
    f->ground_order[f->ground_count++] = command->node;
    f->triangles += 2u * f->l->info.chunk_quads * f->l->info.chunk_quads;
}

/* The texture matrix leads the vertices of the mesh to where the capture put them, in its slot. */
static void check_texture(const flight *f, const terrimp_impostor_command *command,
                          const terrimp_capture_command *capture)
{
    terrimp_mesh_info mesh;
    uint32_t i, step;
    CHECK(terrimp_terrain_get_mesh(f->l->terrain, command->node, &mesh) == TERRIMP_OK);
    step = mesh.vertex_count / 5u + 1u;
    for (i = 0; i < mesh.vertex_count; i += step) {
        double p[3], seen[4], clip[4], out[4], x, y, rim = 0.02;
        oracle_widen(f->l->xyz + (size_t)(command->base_vertex + i) * 3u, p);
        oracle_transform(capture->view, p, seen);
        oracle_transform4(capture->projection, seen, clip);
        oracle_transform(command->texture_matrix, p, out);
        x = out[0] / out[3] * (double)f->desc.atlas_size - (double)capture->slot.x;
        y = out[1] / out[3] * (double)f->desc.atlas_size - (double)capture->slot.y;
        CHECK(fabs(x - (clip[0] / clip[3] * 0.5 + 0.5) * (double)capture->slot.width) < rim);
        CHECK(fabs(y - (clip[1] / clip[3] * 0.5 + 0.5) * (double)capture->slot.height) < rim);
        CHECK(x > -rim && x < (double)capture->slot.width + rim);
        CHECK(y > -rim && y < (double)capture->slot.height + rim);
        CHECK(clip[2] < clip[3]);
        CHECK(clip[2] > (f->camera.depth_zero_to_one ? 0.0 : -clip[3]));
    }
}

static void flight_draw_impostor(void *user, const terrimp_impostor_command *command)
{
    flight *f = (flight *)user;
    terrimp_mesh_info mesh;
    const flight_picture *picture;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
    f->screen_started = 1;
    CHECK(!f->in_capture && !f->floor_drawn && !f->close_ground_started);
    CHECK(command->node < land_chunks(f->l) && command->atlas < 2);
    CHECK(!f->has_impostor[command->node]);
    CHECK(terrimp_terrain_get_mesh(f->l->terrain, command->node, &mesh) == TERRIMP_OK);
    CHECK(command->base_vertex == mesh.base_vertex && command->first_index == mesh.first_index);
    CHECK(command->index_count == mesh.index_count);
    CHECK(command->depth_bias >= 0.0f && command->depth_bias < 8.0f);
    /* The picture is the latest of the chunk, and still whole. */
    picture = &f->pictures[command->node][command->atlas];
    CHECK(f->latest[command->node] == (int)command->atlas);
    CHECK(picture->alive);
    if (picture->alive)
        check_texture(f, command, &picture->capture);
    f->has_impostor[command->node] = 1;
    f->impostor[command->node] = *command;
    f->impostor_order[f->impostor_count++] = command->node;
    f->triangles += command->index_count / 3u;
}

/* The floor comes once, after all that is distant and before all that is close. */
static void flight_draw_floor(void *user, const terrimp_floor_command *command)
{
    flight *f = (flight *)user;
    f->hash = hash_bytes(f->hash, command, sizeof *command);
    CHECK(!f->in_capture && !f->floor_drawn && !f->close_ground_started);
    CHECK(f->impostor_count > 0);
    CHECK(command->base_vertex < f->l->info.mesh_vertex_count);
    CHECK(command->first_index + command->index_count == f->l->info.mesh_index_count);
    CHECK(command->depth_bias >= 0.0f);
    f->floor_drawn = 1;
    f->triangles += command->index_count / 3u;
}

static terrimp_callbacks flight_callbacks(flight *f)
{
    terrimp_callbacks callbacks;
    memset(&callbacks, 0, sizeof callbacks);
    callbacks.user = f;
    callbacks.begin_capture = flight_begin_capture;
    callbacks.end_capture = flight_end_capture;
    callbacks.draw_impostor = flight_draw_impostor;
    callbacks.draw_ground = flight_draw_ground;
    callbacks.draw_floor = flight_draw_floor;
    return callbacks;
}

/* Forgets the frame before. */
static void flight_clear(flight *f)
{
    memset(f->has_ground, 0, sizeof f->has_ground);
    memset(f->has_impostor, 0, sizeof f->has_impostor);
    f->ground_count = f->impostor_count = f->capture_count = 0;
    f->captured_triangles = f->captured_texels = f->triangles = 0;
    f->in_capture = f->screen_started = f->floor_drawn = f->close_ground_started = 0;
}

/* No memory of pictures: at the start, and after the view was told to forget them. */
static void flight_forget(flight *f)
{
    int node;
    memset(f->pictures, 0, sizeof f->pictures);
    for (node = 0; node < FLIGHT_CHUNKS; node++)
        f->latest[node] = -1;
}

/* Whether a command's ground is opaque at a distance. */
static int opaque_at(const terrimp_ground_command *command, double distance)
{
    return command->fade_end == 0.0f || distance <= (double)command->fade_start;
}

/* Every sample in sight is drawn: by ground that is opaque there, or by an impostor under it; up to
   fade_start by opaque ground. Brute force, point by point. */
static void check_nothing_in_sight_is_missing(const flight *f, uint32_t step)
{
    terrimp_frustum frustum;
    uint32_t x, z, quads = f->l->info.chunk_quads, dx, dz;
    double eye[3];
    CHECK(terrimp_camera_frustum(&f->camera, &frustum) == TERRIMP_OK);
    oracle_widen(f->camera.eye, eye);
    for (z = 0; z < f->l->desc.field.depth; z += step)
        for (x = 0; x < f->l->desc.field.width; x += step) {
            double p[3], way[3], distance, slack;
            int k, seen = 1;
            p[0] = (double)land_x(f->l, x);
            p[1] = (double)land_sample(f->l, x, z);
            p[2] = (double)land_z(f->l, z);
            oracle_between(eye, p, way);
            distance = oracle_length(way);
            slack = 1e-5 * (distance + oracle_length(eye)) + 1e-6;
            for (k = 0; k < 6 && seen; k++)
                seen = plane_value(&frustum, k, p) > slack;
            if (!seen)
                continue;
            /* On a line between chunks it belongs to all of them. */
            for (dz = 0; dz < 2u; dz++)
                for (dx = 0; dx < 2u; dx++) {
                    uint32_t cx, cz, node;
                    if ((dx && x % quads) || (dz && z % quads) || x < dx || z < dz)
                        continue;
                    cx = (x - dx) / quads;
                    cz = (z - dz) / quads;
                    if (cx >= f->l->info.chunks_x || cz >= f->l->info.chunks_z)
                        continue;
                    node = cz * f->l->info.chunks_x + cx;
                    if (f->has_ground[node] && opaque_at(&f->ground[node], distance))
                        continue;
                    CHECK(f->has_impostor[node]);
                    CHECK(distance > (double)f->desc.fade_start * (1.0 - 1e-5));
                }
        }
}

/* What a chunk is drawn as follows from its distances and whether it has a picture. */
static void check_fades(const flight *f)
{
    uint32_t node;
    for (node = 0; node < land_chunks(f->l); node++) {
        terrimp_box box;
        float closest, farthest;
        const terrimp_ground_command *ground = &f->ground[node];
        if (!f->has_ground[node] && !f->has_impostor[node])
            continue;
        CHECK(terrimp_terrain_get_box(f->l->terrain, node, &box) == TERRIMP_OK);
        closest = terrimp_box_distance(&box, f->camera.eye);
        farthest = terrimp_box_farthest(&box, f->camera.eye);
        if (f->desc.mode == TERRIMP_MODE_FULL || farthest <= f->desc.fade_start)
            CHECK(f->has_ground[node] && !f->has_impostor[node]);
        if (f->has_ground[node]) {
            int opaque = ground->fade_start == 0.0f && ground->fade_end == 0.0f;
            CHECK(opaque || (ground->fade_start == f->desc.fade_start &&
                             ground->fade_end == f->desc.fade_end));
            CHECK(opaque == !f->has_impostor[node]); /* it fades over its own impostor only */
            CHECK(ground->depth_bias >= 0.0f);
            CHECK(closest >= f->desc.fade_end || ground->depth_bias == 0.0f);
        }
        if (f->has_impostor[node]) {
            float bias = f->impostor[node].depth_bias;
            CHECK(f->has_ground[node] == (closest < f->desc.fade_end));
            /* Behind all of the fade band, or eight times as deep. */
            CHECK(closest * (1.0f + bias) >= f->desc.fade_end * 0.9999f || bias > 6.99f);
        }
    }
}

/* A picture that is drawn is within the limits of the view, however far the eye has come. */
static void check_pictures_are_fresh(const flight *f)
{
    float factor;
    uint32_t i;
    CHECK(terrimp_camera_pixel_factor(&f->camera, &factor) == TERRIMP_OK);
    for (i = 0; i < f->impostor_count; i++) {
        uint32_t node = f->impostor_order[i];
        const flight_picture *picture = &f->pictures[node][f->impostor[node].atlas];
        terrimp_mesh_info mesh;
        terrimp_box box;
        float px = 0.0f;
        CHECK(terrimp_terrain_get_box(f->l->terrain, node, &box) == TERRIMP_OK);
        CHECK(terrimp_terrain_get_mesh(f->l->terrain, node, &mesh) == TERRIMP_OK);
        CHECK(oracle_view_angle(&box, picture->capture.eye, f->camera.eye) <=
              (double)f->desc.max_angle_rad * 1.001 + 1e-6);
        CHECK(terrimp_parallax_error(&box, mesh.error, picture->capture.eye, f->camera.eye, factor,
                                     &px) == TERRIMP_OK);
        CHECK(px <= f->desc.tolerance_px * 1.0001f);
    }
}

/* Of two chunks in one quarter around the eye, the closer one along both axes comes first. */
static void check_front_to_back(const flight *f, const uint32_t *order, uint32_t count)
{
    uint32_t i, k, wide = f->l->info.chunks_x, quads = f->l->info.chunk_quads;
    int64_t at[2];
    int axis;
    for (axis = 0; axis < 2; axis++) {
        float origin = axis ? f->l->desc.field.origin_z : f->l->desc.field.origin_x;
        float spacing = axis ? f->l->desc.field.spacing_z : f->l->desc.field.spacing_x;
        double place = ((double)f->camera.eye[2 * axis] - (double)origin) /
                       ((double)spacing * (double)quads);
        at[axis] = (int64_t)floor(fmin(fmax(place, -1e6), 1e6));
    }
    for (i = 0; i < count; i++)
        for (k = i + 1u; k < count; k++) {
            int64_t a[2], b[2];
            int behind = 1;
            a[0] = (int64_t)(order[i] % wide) - at[0];
            a[1] = (int64_t)(order[i] / wide) - at[1];
            b[0] = (int64_t)(order[k] % wide) - at[0];
            b[1] = (int64_t)(order[k] / wide) - at[1];
            for (axis = 0; axis < 2; axis++)
                behind = behind && (b[axis] == 0 || (a[axis] > 0) == (b[axis] > 0)) &&
                         llabs(b[axis]) <= llabs(a[axis]);
            CHECK(!behind); /* a was drawn first, though b stands in front of it */
        }
}

static void check_stats(flight *f)
{
    terrimp_stats s = {0};
    uint32_t node, seen = 0, waiting = 0;
    CHECK(terrimp_view_get_stats(f->view, &s) == TERRIMP_OK);
    for (node = 0; node < land_chunks(f->l); node++) {
        terrimp_box box;
        CHECK(terrimp_terrain_get_box(f->l->terrain, node, &box) == TERRIMP_OK);
        seen += f->has_ground[node] || f->has_impostor[node];
        waiting += f->desc.mode != TERRIMP_MODE_FULL && f->has_ground[node] &&
                   !f->has_impostor[node] &&
                   terrimp_box_farthest(&box, f->camera.eye) > f->desc.fade_start;
    }
    CHECK(s.visible == seen && s.waiting == waiting);
    CHECK(s.ground == f->ground_count && s.impostors == f->impostor_count);
    CHECK(s.draws == f->ground_count + f->impostor_count + (uint32_t)f->floor_drawn);
    CHECK(s.triangles == f->triangles);
    CHECK(s.captures == f->capture_count && s.captured_texels == f->captured_texels);
    CHECK(s.captured_triangles == f->captured_triangles);
    CHECK(s.texel_scale >= 0.0f && s.texel_scale <= 1.0f);
    CHECK(s.atlas_used >= 0.0f && s.atlas_used <= 1.0001f);
    CHECK(f->desc.max_captures == 0 || s.captures <= f->desc.max_captures);
    CHECK(s.impostors <= f->desc.max_impostors);
    CHECK(s.z_near >= 0.0f && s.z_near <= s.z_far);
    if (f->desc.max_captures == 0) {
        CHECK(s.worst_angle_rad <= f->desc.max_angle_rad);
        CHECK(s.worst_parallax_px <= f->desc.tolerance_px);
    }
    f->total_captures += s.captures;
    f->total_impostors += s.impostors;
    f->total_ground += s.ground;
    f->total_waiting += s.waiting;
}

/* The camera of one frame of a flight that does everything a host might do. */
static void fly(const land *l, int frame, terrimp_camera *camera)
{
    const terrimp_box *box = &l->info.box;
    float size = box->max[0] - box->min[0], move[3];
    uint32_t what = random_range(0, 9);
    int k;
    if (frame == 0 || what == 0) { /* teleport */
        for (k = 0; k < 3; k++)
            camera->eye[k] = random_float(box->min[k], box->max[k]);
        camera->eye[1] += random_float(-20.0f, 150.0f);
        random_vector(1.0f, 1.0f, camera->forward);
        camera->forward[1] *= 0.5f;
    } else if (what == 1) { /* straight down */
        camera->forward[0] = camera->forward[2] = 0.0f;
        camera->forward[1] = -1.0f;
    } else if (what == 2) { /* turn */
        random_vector(1.0f, 1.0f, camera->forward);
    } else if (what == 3 && random_range(0, 2) == 0) { /* far away, looking back */
        random_vector(3.0f * size, 30.0f * size, camera->eye);
        for (k = 0; k < 3; k++)
            camera->forward[k] = 0.5f * (box->min[k] + box->max[k]) - camera->eye[k];
    } else if (what == 4 && random_range(0, 2) == 0) { /* below the ground */
        camera->eye[1] = box->min[1] - random_float(0.0f, 50.0f);
        random_vector(1.0f, 1.0f, camera->forward);
    } else { /* onwards */
        random_vector(0.0f, 0.02f * size, move);
        for (k = 0; k < 3; k++)
            camera->eye[k] += move[k];
    }
    camera->width_px = 640;
    camera->height_px = 400;
    camera->fov_y_rad = frame % 16 < 12 ? 0.0f : 0.3f;
    camera->z_near = 0.1f;
    camera->z_far = 60.0f * size;
}

/* Flies over a land and checks every law in every frame; returns the hash of all commands. */
static uint32_t fly_and_check(const land *l, const terrimp_view_desc *desc, int frames, flight *f)
{
    terrimp_camera camera;
    terrimp_callbacks callbacks = flight_callbacks(f);
    int frame;
    size_t allocations;
    memset(f, 0, sizeof *f);
    memset(&camera, 0, sizeof camera);
    flight_forget(f);
    f->l = l;
    f->hash = 2166136261u;
    CHECK(land_chunks(l) <= FLIGHT_CHUNKS);
    CHECK(terrimp_view_desc_resolve(l->terrain, desc, &f->desc) == TERRIMP_OK);
    CHECK(terrimp_view_create(l->terrain, desc, NULL, &f->view) == TERRIMP_OK);
    if (!f->view)
        return 0;
    allocations = unit_allocations;
    camera.depth_zero_to_one = frames & 1;
    for (frame = 0; frame < frames; frame++) {
        fly(l, frame, &camera);
        CHECK(terrimp_camera_resolve(&camera, &f->camera) == TERRIMP_OK);
        if (random_range(0, 30) == 0) {
            CHECK(terrimp_view_invalidate(f->view) == TERRIMP_OK);
            flight_forget(f);
        }
        CHECK(terrimp_view_update(f->view, &camera) == TERRIMP_OK);
        if (random_range(0, 15) == 0) /* a host that drops a frame */
            continue;
        flight_clear(f);
        CHECK(terrimp_view_render(f->view, &callbacks) == TERRIMP_OK);
        CHECK(!f->in_capture);
        check_stats(f);
        check_nothing_in_sight_is_missing(f, 3);
        check_fades(f);
        check_front_to_back(f, f->impostor_order, f->impostor_count);
        if (f->desc.max_captures == 0)
            check_pictures_are_fresh(f);
    }
    CHECK(unit_allocations == allocations); /* update and render allocate nothing */
    terrimp_view_destroy(f->view);
    return f->hash;
}

static flight flight_room; /* too large for the stack of a test */

/* The land of most flights. The seed makes a flight independent of the tests before it. */
static void make_hills(land *l)
{
    check_state = 20100611u;
    land_prepare(l, 97, 81, TERRIMP_FORMAT_F32, LAND_HILLS);
    l->desc.chunk_quads = 8;
    l->desc.triangle_budget = 32;
}

static void flights_keep_every_law(void)
{
    land l;
    terrimp_view_desc desc;
    make_hills(&l);
    if (land_build(&l)) {
        memset(&desc, 0, sizeof desc);
        (void)fly_and_check(&l, &desc, 100, &flight_room); /* as it comes */
        CHECK(flight_room.total_captures > 100 && flight_room.total_impostors > 1000);
    CHECK(flight_room.total_ground > 100);
        desc.fade_start = 30.0f;
        desc.fade_end = 31.0f;
        desc.atlas_size = 512;
        desc.max_angle_rad = 0.02f;
        desc.tolerance_px = 0.5f;
        (void)fly_and_check(&l, &desc, 61, &flight_room);
        desc.mode = TERRIMP_MODE_FULL;
        (void)fly_and_check(&l, &desc, 20, &flight_room);
        CHECK(flight_room.total_captures == 0 && flight_room.total_impostors == 0);
    }
    land_free(&l);
}

/* A fade band so short that the eye stands in boxes that want impostors. */
static void flights_with_the_band_inside_boxes_keep_every_law(void)
{
    land l;
    terrimp_view_desc desc;
    land_prepare(&l, 65, 65, TERRIMP_FORMAT_F32, LAND_SPIKE);
    l.desc.chunk_quads = 16;
    l.desc.field.spacing_x = 3.0f;
    if (land_build(&l)) {
        memset(&desc, 0, sizeof desc);
        desc.fade_start = 2.0f;
        desc.fade_end = 3.0f;
        (void)fly_and_check(&l, &desc, 200, &flight_room);
    }
    land_free(&l);
}

static void flights_with_few_captures_a_frame_keep_every_law(void)
{
    land l;
    terrimp_view_desc desc;
    make_hills(&l);
    if (land_build(&l)) {
        memset(&desc, 0, sizeof desc);
        desc.max_captures = 1;
        (void)fly_and_check(&l, &desc, 60, &flight_room);
        CHECK(flight_room.total_waiting > 100);
        desc.max_captures = 7;
        (void)fly_and_check(&l, &desc, 60, &flight_room);
    }
    land_free(&l);
}

static void flights_with_a_tiny_atlas_keep_every_law(void)
{
    land l;
    terrimp_view_desc desc;
    make_hills(&l);
    if (land_build(&l)) {
        memset(&desc, 0, sizeof desc);
        desc.atlas_size = 64;
        (void)fly_and_check(&l, &desc, 60, &flight_room);
        CHECK(flight_room.total_captures > 100); /* coarse pictures rather than none */
        desc.atlas_size = 200;
        desc.max_captures = 20;
        (void)fly_and_check(&l, &desc, 60, &flight_room);
        CHECK(flight_room.total_captures > 100);
    }
    land_free(&l);
}

static void flights_with_one_impostor_keep_every_law(void)
{
    land l;
    terrimp_view_desc desc;
    make_hills(&l);
    if (land_build(&l)) {
        memset(&desc, 0, sizeof desc);
        desc.max_impostors = 1;
        (void)fly_and_check(&l, &desc, 60, &flight_room);
        CHECK(flight_room.total_captures > 3 && flight_room.total_waiting > 100);
        desc.max_impostors = 11;
        desc.atlas_size = 128;
        (void)fly_and_check(&l, &desc, 60, &flight_room);
    }
    land_free(&l);
}

static void flights_over_odd_terrains_keep_every_law(void)
{
    static const uint32_t sizes[][2] = {{2, 2}, {2, 300}, {50, 3}, {33, 18}};
    size_t i;
    for (i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        land l;
        terrimp_view_desc desc;
        land_prepare(&l, sizes[i][0], sizes[i][1], TERRIMP_FORMAT_F32,
                     i % 2 ? LAND_SPIKE : LAND_FLAT);
        l.desc.chunk_quads = 8;
        l.desc.field.origin_x = 500.0f;
        l.desc.field.spacing_z = 2.0f;
        if (land_build(&l)) {
            memset(&desc, 0, sizeof desc);
            (void)fly_and_check(&l, &desc, 40, &flight_room);
        }
        land_free(&l);
    }
}

/* An eye that rests needs no new picture after the first frame: not when nothing was updated in
   between, nor when there are fewer records than chunks in sight or the atlas is too small. */
static void a_resting_eye_captures_nothing(void)
{
    static const uint32_t limits[3][2] = {{0, 0}, {11, 0}, {0, 64}}; /* records, atlas size */
    flight *f = &flight_room;
    terrimp_callbacks callbacks = flight_callbacks(f);
    terrimp_view_desc desc;
    land l;
    int run, frame;
    make_hills(&l);
    memset(&desc, 0, sizeof desc);
    for (run = 0; run < 3 && (l.terrain || land_build(&l)); run++) {
        terrimp_camera camera;
        uint32_t impostors = 0;
        desc.max_impostors = limits[run][0];
        desc.atlas_size = limits[run][1];
        memset(f, 0, sizeof *f);
        flight_forget(f);
        f->l = &l;
        CHECK(terrimp_view_desc_resolve(l.terrain, &desc, &f->desc) == TERRIMP_OK);
        if (terrimp_view_create(l.terrain, &desc, NULL, &f->view) != TERRIMP_OK)
            break;
        memset(&camera, 0, sizeof camera);
        fly(&l, 0, &camera);
        camera.eye[0] = camera.eye[2] = -10.0f;
        camera.eye[1] = 200.0f;
        camera.forward[0] = camera.forward[2] = 1.0f;
        camera.forward[1] = -0.5f;
        CHECK(terrimp_camera_resolve(&camera, &f->camera) == TERRIMP_OK);
        for (frame = 0; frame < 4; frame++) {
            CHECK(frame == 2 || terrimp_view_update(f->view, &camera) == TERRIMP_OK);
            flight_clear(f);
            CHECK(terrimp_view_render(f->view, &callbacks) == TERRIMP_OK);
            CHECK((f->capture_count > 0) == (frame == 0));
            impostors = frame ? impostors : f->impostor_count;
            CHECK(impostors > 10 && f->impostor_count == impostors);
        }
        terrimp_view_destroy(f->view);
    }
    CHECK(run == 3);
    land_free(&l);
}

/* Same input, same commands: bit for bit, whatever was in the memory before. */
static void two_views_give_the_same_commands(void)
{
    land l;
    terrimp_view_desc desc;
    uint32_t state, first, second;
    make_hills(&l);
    if (land_build(&l)) {
        memset(&desc, 0, sizeof desc);
        desc.atlas_size = 256;
        desc.max_captures = 9;
        state = check_state;
        first = fly_and_check(&l, &desc, 30, &flight_room);
        check_state = state;
        second = fly_and_check(&l, &desc, 30, &flight_room);
        CHECK(first == second && first != 0);
    }
    land_free(&l);
}

/* Views in blocks of the exact size, full of different rubbish, on one terrain and by turns. */
static void views_keep_to_their_blocks_and_apart(void)
{
    enum { GUARD = 64 };
    static flight other_room;
    flight *f[2];
    char *block[2];
    land l;
    terrimp_view_desc desc;
    size_t bytes;
    int i, frame;
    f[0] = &flight_room;
    f[1] = &other_room;
    make_hills(&l);
    memset(&desc, 0, sizeof desc);
    desc.max_impostors = 77;
    desc.atlas_size = 300;
    if (land_build(&l)) {
        terrimp_camera camera;
        bytes = terrimp_view_bytes(l.terrain, &desc);
        CHECK(bytes > 0);
        for (i = 0; i < 2; i++) {
            block[i] = (char *)malloc(bytes + GUARD);
            memset(block[i], i ? 0 : UNTOUCHED, bytes);
            memset(block[i] + bytes, UNTOUCHED, GUARD);
            memset(f[i], 0, sizeof *f[i]);
            flight_forget(f[i]);
            f[i]->l = &l;
            f[i]->hash = 1;
            CHECK(terrimp_view_init(l.terrain, &desc, block[i], bytes - 1u, &f[i]->view) ==
                  TERRIMP_E_MEMORY);
            CHECK(terrimp_view_init(l.terrain, &desc, block[i] + 1, bytes, &f[i]->view) ==
                  TERRIMP_E_ALIGN);
            CHECK(f[i]->view == NULL && (i || is_untouched(block[i], bytes)));
            CHECK(terrimp_view_init(l.terrain, &desc, block[i], bytes, &f[i]->view) == TERRIMP_OK);
            CHECK(terrimp_view_desc_resolve(l.terrain, &desc, &f[i]->desc) == TERRIMP_OK);
        }
        memset(&camera, 0, sizeof camera);
        for (frame = 0; frame < 20; frame++) {
            fly(&l, frame, &camera);
            for (i = 0; i < 2; i++) {
                CHECK(terrimp_camera_resolve(&camera, &f[i]->camera) == TERRIMP_OK);
                CHECK(terrimp_view_update(f[i]->view, &camera) == TERRIMP_OK);
            }
            for (i = 0; i < 2; i++) {
                terrimp_callbacks callbacks = flight_callbacks(f[i]);
                flight_clear(f[i]);
                CHECK(terrimp_view_render(f[i]->view, &callbacks) == TERRIMP_OK);
            }
            CHECK(f[0]->hash == f[1]->hash);
        }
        for (i = 0; i < 2; i++) {
            CHECK(is_untouched(block[i] + bytes, GUARD));
            terrimp_view_destroy(f[i]->view); /* not made by create: nothing happens */
            free(block[i]);
        }
    }
    land_free(&l);
}

static void view_defaults_are_those_of_the_table(void)
{
    land l;
    terrimp_view_desc desc, out;
    land_prepare(&l, 70, 10, TERRIMP_FORMAT_F32, LAND_FLAT);
    l.desc.field.spacing_x = 3.0f;
    l.desc.field.spacing_z = 5.0f;
    memset(&desc, 0, sizeof desc);
    if (land_build(&l)) {
        CHECK(terrimp_view_desc_resolve(l.terrain, &desc, &out) == TERRIMP_OK);
        CHECK(out.mode == TERRIMP_MODE_IMPOSTOR);
        CHECK(out.fade_start == 2.0f * 64.0f * 5.0f && out.fade_end == 1.5f * out.fade_start);
        CHECK(out.max_angle_rad == 0.0873f && out.tolerance_px == 1.0f);
        CHECK(out.texels_per_px == 2.0f && out.atlas_size == 4096);
        CHECK(out.max_impostors == 2048 && out.max_captures == 0);
        desc.fade_start = 10.0f;
        CHECK(terrimp_view_desc_resolve(l.terrain, &desc, &desc) == TERRIMP_OK);
        CHECK(desc.fade_end == 15.0f);
    }
    land_free(&l);
}

/* ---- the allocator ---- */

/* An allocator that fails at one call, and knows what is out. */
typedef struct counting_allocator {
    int calls, fail_at, alive;
    size_t bytes;
} counting_allocator;

static void *counting_allocate(void *user, size_t bytes)
{
    counting_allocator *a = (counting_allocator *)user;
    if (++a->calls == a->fail_at)
        return NULL;
    a->alive++;
    a->bytes += bytes;
    return malloc(bytes);
}

static void counting_release(void *user, void *pointer, size_t bytes)
{
    counting_allocator *a = (counting_allocator *)user;
    a->alive--;
    a->bytes -= bytes;
    free(pointer);
}

/* Every allocation fails once: the result says so, nothing leaks, the output is untouched. */
static void create_survives_every_failed_allocation(void)
{
    counting_allocator counter = {0, 0, 0, 0};
    terrimp_allocator allocator;
    terrimp_terrain *terrain = NULL;
    terrimp_view *view = NULL;
    terrimp_view_desc view_desc;
    terrimp_result result = TERRIMP_E_MEMORY;
    land l;
    int failed = 0;
    allocator.user = &counter;
    allocator.allocate = counting_allocate;
    allocator.release = counting_release;
    land_prepare(&l, 20, 20, TERRIMP_FORMAT_F32, LAND_HILLS);
    memset(&view_desc, 0, sizeof view_desc);
    while (result == TERRIMP_E_MEMORY && counter.fail_at < 20) {
        counter.fail_at++;
        counter.calls = 0;
        result = terrimp_terrain_create(&l.desc, &allocator, &terrain);
        CHECK(result == TERRIMP_OK || (result == TERRIMP_E_MEMORY && counter.alive == 0));
        CHECK((result == TERRIMP_OK) == (terrain != NULL));
        failed += result == TERRIMP_E_MEMORY;
    }
    CHECK(result == TERRIMP_OK && failed >= 1 && counter.alive == 1); /* scratch is gone */
    counter.calls = 0;
    counter.fail_at = 1;
    CHECK(terrimp_view_create(terrain, &view_desc, &allocator, &view) == TERRIMP_E_MEMORY);
    CHECK(view == NULL && counter.alive == 1);
    counter.fail_at = 0;
    CHECK(terrimp_view_create(terrain, &view_desc, &allocator, &view) == TERRIMP_OK);
    CHECK(counter.alive == 2);
    terrimp_view_destroy(view);
    terrimp_terrain_destroy(terrain);
    CHECK(counter.alive == 0 && counter.bytes == 0);
    terrimp_view_destroy(NULL);
    terrimp_terrain_destroy(NULL);
    /* A build that fails gives its memory back too. */
    l.samples[7] = (float)NAN;
    terrain = NULL;
    CHECK(terrimp_terrain_create(&l.desc, &allocator, &terrain) == TERRIMP_E_NOT_FINITE);
    CHECK(terrain == NULL && counter.alive == 0);
    land_free(&l);
}

static void terrain_tests(void)
{
    RUN(terrain_defaults_are_those_of_the_table);
    RUN(terrains_of_every_size_build_and_keep_their_laws);
    RUN(terrain_of_two_columns_builds);
    RUN(terrains_of_every_format_and_shape_keep_their_laws);
    RUN(terrains_of_every_budget_build);
    RUN(proud_meshes_stand_above_the_terrain);
    RUN(corners_stand_on_their_samples);
    RUN(build_order_and_memory_make_no_difference);
    RUN(patterns_are_those_of_the_geomipmap);
    RUN(strips_cover_exactly_their_quads);
    RUN(parallax_bound_holds_for_every_sample_of_a_mesh);
    RUN(view_defaults_are_those_of_the_table);
    RUN(flights_keep_every_law);
    RUN(flights_with_the_band_inside_boxes_keep_every_law);
    RUN(flights_with_few_captures_a_frame_keep_every_law);
    RUN(flights_with_a_tiny_atlas_keep_every_law);
    RUN(flights_with_one_impostor_keep_every_law);
    RUN(flights_over_odd_terrains_keep_every_law);
    RUN(a_resting_eye_captures_nothing);
    RUN(two_views_give_the_same_commands);
    RUN(views_keep_to_their_blocks_and_apart);
    RUN(create_survives_every_failed_allocation);
}

#endif
