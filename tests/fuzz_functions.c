/* Fuzzes the plain functions: each input is a list of calls, of every room up to the atlas, of
   layers and of placement, over one heightfield, one box and one camera that calls may change. See
   tests/fuzz.h. */
#define TERRIMP_ASSERT(condition) FUZZ_CHECK(condition)
#include "fuzz.h"

#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

static terrimp_heightfield field;
static void *samples; /* of the field, to the last byte and no more */
static terrimp_camera camera;
static terrimp_box box;

/* ---- what calls work on ---- */

/* The field is as large as it says, or is refused by a size no array has. */
static void change_field(void)
{
    static const size_t sizes[] = { 4, 1, 2, 2, 4 };
    uint32_t width = 2 + fuzz_below(40), depth = 2 + fuzz_below(40), kind = fuzz_u8(), i;
    uint32_t format = fuzz_below(TERRIMP_FORMAT_COUNT);
    size_t size = sizes[format], row = width * size + (kind & 1u) * size * fuzz_below(4);
    size_t bytes = (depth - 1u) * row + width * size;
    free(samples);
    samples = fuzz_take(bytes);
    for (i = 0; i < bytes / size; i++) {
        uint32_t bits = (i * 2654435761u >> 24) * (kind >> 1) + (i % 61 == 0 ? fuzz_u8() : 0);
        if (size == 1)
            ((uint8_t *)samples)[i] = (uint8_t)bits;
        else if (size == 2)
            ((uint16_t *)samples)[i] = (uint16_t)bits;
        else
            ((float *)samples)[i] = i % 131 == 130 ? fuzz_float(1e4f) : (float)bits * 0.1f;
    }
    memset(&field, 0, sizeof field);
    field.samples = samples;
    field.width = width;
    field.depth = depth;
    field.format = (int)format;
    field.row_bytes = row;
    field.has_no_data = kind >> 6 == 3;
    field.no_data = field.has_no_data ? fuzz_float(255.0f) : 0.0f;
}

static void change_place_of_field(void)
{
    field.spacing_x = fuzz_float(10.0f);
    field.spacing_z = fuzz_good(0.1f, 10.0f);
    field.height_scale = fuzz_float(2.0f);
    field.height_offset = fuzz_float(100.0f);
    field.origin_x = fuzz_float(1e4f);
    field.origin_z = fuzz_float(1e4f);
}

/* Each must be refused; then the field is as before. */
static void refuse_field(void)
{
    terrimp_heightfield bad = field, out;
    switch (fuzz_below(6)) {
    case 0: bad.width = fuzz_below(2); break;
    case 1: bad.depth = TERRIMP_MAX_DIM + 1u + fuzz_u32() / 2u; break;
    case 2: bad.row_bytes = 1; break;
    case 3: bad.depth = 3; bad.row_bytes = (size_t)-1 / 8u * 8u; break;
    case 4: bad.format = fuzz_u8() & 1u ? TERRIMP_FORMAT_COUNT : -1; break;
    default: bad.samples = NULL; break;
    }
    FUZZ_CHECK(terrimp_heightfield_resolve(&bad, &out) != TERRIMP_OK);
    FUZZ_CHECK(terrimp_heightfield_validate(&bad, NULL, NULL) != TERRIMP_OK);
}

static void point(float scale, float out[3])
{
    int i;
    for (i = 0; i < 3; i++)
        out[i] = fuzz_u8() & 7u ? fuzz_good(-scale, scale) : fuzz_float(scale);
}

static void change_camera(void)
{
    memset(&camera, 0, sizeof camera);
    point(200.0f, camera.eye);
    point(1.0f, camera.forward);
    if (fuzz_u8() & 1u)
        point(1.0f, camera.up);
    camera.fov_y_rad = fuzz_float(3.0f);
    camera.width_px = fuzz_size(2000);
    camera.height_px = fuzz_size(2000);
    camera.z_near = fuzz_u8() & 7u ? 1.0f : fuzz_float(1.0f);
    camera.z_far = fuzz_u8() & 7u ? 1000.0f : fuzz_float(1e4f);
    camera.depth_zero_to_one = (int)fuzz_below(2);
}

static void change_box(void)
{
    int i;
    point(200.0f, box.min);
    for (i = 0; i < 3; i++)
        box.max[i] = box.min[i] + (fuzz_u8() & 7u ? fuzz_good(0.0f, 60.0f) : fuzz_float(60.0f));
}

/* ---- heightfield ---- */

static void query_field(void)
{
    float x = fuzz_float(100.0f), z = fuzz_float(100.0f), height, normal[3], low, high;
    uint32_t at_x = 0, at_z = 0;
    terrimp_result sound = terrimp_heightfield_validate(&field, &at_x, &at_z);
    if (terrimp_heightfield_read(&field, fuzz_size(40), fuzz_size(40), 1, 1, 1, &height)
        == TERRIMP_OK)
        FUZZ_CHECK(fuzz_finite(&height, 1));
    if (terrimp_heightfield_height(&field, x, z, &height) == TERRIMP_OK) {
        FUZZ_CHECK(fuzz_finite(&height, 1));
        if (sound == TERRIMP_OK
            && terrimp_heightfield_bounds(&field, 0, 0, field.width, field.depth, &low, &high)
                   == TERRIMP_OK) {
            float slack = 1e-5f * (high - low + (high < 0 ? -high : high) + (low < 0 ? -low : low));
            FUZZ_CHECK(height >= low - slack && height <= high + slack);
        }
    }
    if (terrimp_heightfield_normal(&field, x, z, normal) == TERRIMP_OK)
        FUZZ_CHECK(fuzz_finite(normal, 3) && normal[1] > 0.0f);
}

static void read_field(void)
{
    uint32_t x = fuzz_size(40), z = fuzz_size(40), cols = fuzz_below(20), rows = fuzz_below(20);
    uint32_t stride = fuzz_size(8), wide = fuzz_size(50), deep = fuzz_size(50);
    float *tile = (float *)fuzz_take(cols * rows * sizeof *tile), low, high;
    if (terrimp_heightfield_read(&field, x, z, cols, rows, stride, tile) == TERRIMP_OK)
        FUZZ_CHECK(fuzz_finite(tile, cols * rows));
    free(tile);
    if (terrimp_heightfield_bounds(&field, x, z, wide, deep, &low, &high) == TERRIMP_OK)
        FUZZ_CHECK(fuzz_finite(&low, 1) && fuzz_finite(&high, 1) && low <= high);
}

static void fill_field(void)
{
    size_t bytes = terrimp_heightfield_fill_voids_scratch_bytes(field.width, field.depth);
    size_t count = 0, given = fuzz_u8() & 15u ? bytes : bytes / 2u;
    void *scratch = fuzz_take(given);
    uint32_t width = fuzz_size(40), depth = fuzz_size(40);
    FUZZ_CHECK(bytes > 0);
    (void)terrimp_heightfield_fill_voids_scratch_bytes(width, depth);
    if (terrimp_heightfield_fill_voids(&field, samples, scratch, given, &count) == TERRIMP_OK)
        FUZZ_CHECK(terrimp_heightfield_validate(&field, NULL, NULL) == TERRIMP_OK);
    free(scratch);
}

static void cast_ray(void)
{
    float origin[3], direction[3];
    terrimp_ray_hit hit;
    point(100.0f, origin);
    point(1.0f, direction);
    if (terrimp_heightfield_raycast(&field, origin, direction,
                                    fuzz_u8() & 3u ? FLT_MAX : fuzz_float(100.0f), &hit)
        == TERRIMP_OK) {
        FUZZ_CHECK(fuzz_finite(&hit.distance, 1) && hit.distance >= 0.0f);
        FUZZ_CHECK(fuzz_finite(hit.position, 3) && fuzz_finite(hit.normal, 3));
        FUZZ_CHECK(hit.x < field.width - 1u && hit.z < field.depth - 1u);
    }
}

/* ---- camera, impostor ---- */

static void use_camera(void)
{
    terrimp_camera out;
    terrimp_frustum frustum;
    float view[16], projection[16], factor, eye[3];
    point(300.0f, eye);
    if (terrimp_camera_resolve(&camera, &out) == TERRIMP_OK) {
        FUZZ_CHECK(fuzz_finite(out.forward, 3) && fuzz_finite(out.up, 3));
        FUZZ_CHECK(terrimp_camera_resolve(&out, &out) == TERRIMP_OK);
    }
    if (terrimp_camera_matrices(&camera, view, projection) == TERRIMP_OK)
        FUZZ_CHECK(fuzz_finite(view, 12)); /* a distant eye may give infinite translations */
    if (terrimp_camera_pixel_factor(&camera, &factor) == TERRIMP_OK)
        FUZZ_CHECK(fuzz_finite(&factor, 1) && factor > 0.0f);
    if (terrimp_camera_frustum(&camera, &frustum) == TERRIMP_OK) {
        int left = terrimp_frustum_test(&frustum, &box, (int)fuzz_below(64));
        FUZZ_CHECK(left >= -1 && left < 64);
    }
    (void)terrimp_box_distance(&box, eye);
    (void)terrimp_box_farthest(&box, eye);
}

static void use_capture(void)
{
    terrimp_capture capture;
    terrimp_rect slot;
    uint32_t size[2], smallest = fuzz_size(16), largest = fuzz_size(500), margin = fuzz_size(4);
    uint32_t atlas[2];
    float eye[3], view[16], matrix[16], scale, stq[2][3];
    const float xyz[2][3] = { { 1.0f, 2.0f, 3.0f }, { -1.0f, FLT_MAX, 0.0f } };
    point(300.0f, eye);
    if (terrimp_capture_fit(&box, eye, &capture) != TERRIMP_OK)
        return;
    FUZZ_CHECK(fuzz_finite(&capture.tan_left, 1) && fuzz_finite(&capture.tan_up, 1));
    FUZZ_CHECK(capture.z_near >= 0.0f && capture.z_far >= capture.z_near);
    FUZZ_CHECK(terrimp_capture_matrices(&capture, (int)fuzz_below(2), view, matrix) == TERRIMP_OK);
    if (terrimp_impostor_size(&capture, fuzz_float(1000.0f), fuzz_float(4.0f), smallest, largest,
                              size, &scale) != TERRIMP_OK)
        return;
    FUZZ_CHECK(size[0] >= smallest && size[1] >= smallest);
    FUZZ_CHECK(size[0] <= largest && size[1] <= largest);
    (void)terrimp_capture_pad(&capture, size, margin);
    slot.x = fuzz_size(100);
    slot.y = fuzz_size(100);
    slot.width = size[0];
    slot.height = size[1];
    atlas[0] = fuzz_size(2000);
    atlas[1] = fuzz_size(2000);
    if (terrimp_texture_matrix(&capture, &slot, atlas[0], atlas[1], matrix) == TERRIMP_OK)
        (void)terrimp_texture_coordinates(matrix, capture.eye, xyz[0], 2, stq[0]);
}

static void judge_picture(void)
{
    float captured[3], eye[3], angle, pixels, seconds;
    point(300.0f, captured);
    point(300.0f, eye);
    if (terrimp_view_angle(&box, captured, eye, &angle) == TERRIMP_OK)
        FUZZ_CHECK(angle >= 0.0f && angle < 3.1416f);
    if (terrimp_parallax_error(&box, fuzz_float(20.0f), captured, eye, fuzz_float(1000.0f), &pixels)
        == TERRIMP_OK)
        FUZZ_CHECK(pixels >= 0.0f);
    if (terrimp_impostor_lifetime(fuzz_float(100.0f), fuzz_float(3.0f), fuzz_float(50.0f), &seconds)
        == TERRIMP_OK)
        FUZZ_CHECK(seconds >= 0.0f);
}

/* ---- geomipmap ---- */

static void use_patterns(void)
{
    uint32_t quads = fuzz_u8() & 7u ? 4u + 2u * fuzz_below(7) : fuzz_size(200), i, count;
    int form = (int)fuzz_below(5) - (fuzz_u8() == 0);
    terrimp_pattern found;
    (void)terrimp_pattern_find(quads, form, fuzz_size(16), &found);
    count = terrimp_pattern_index_count(quads, form);
    if (count > 0 && quads <= 16) {
        uint16_t *indices = (uint16_t *)fuzz_take(count * sizeof *indices);
        FUZZ_CHECK(terrimp_pattern_fill(quads, form, indices, count - 1u) == TERRIMP_E_CAPACITY);
        FUZZ_CHECK(terrimp_pattern_fill(quads, form, indices, count) == TERRIMP_OK);
        for (i = 0; i < count; i++)
            FUZZ_CHECK(indices[i] < (quads + 1u) * (quads + 1u));
        free(indices);
    }
}

static void draw_node(const terrimp_quadtree *tree, const terrimp_geomip_draw *draw)
{
    size_t count = (size_t)(tree->chunk_quads + 1u) * (tree->chunk_quads + 1u);
    terrimp_geomip_vertex *vertices = (terrimp_geomip_vertex *)fuzz_take(count * sizeof *vertices);
    float *xyz = (float *)fuzz_take(count * 3u * sizeof *xyz);
    FUZZ_CHECK(terrimp_geomip_fill_vertices(tree, draw->node.number, xyz, vertices) == TERRIMP_OK);
    FUZZ_CHECK(terrimp_geomip_morph(tree->chunk_quads, draw, vertices, xyz + 1, 3) == TERRIMP_OK);
    FUZZ_CHECK(fuzz_finite(xyz, count * 3u));
    free(xyz);
    free(vertices);
}

static void select_nodes(const terrimp_quadtree *tree)
{
    terrimp_geomip_view view;
    terrimp_box node;
    uint32_t frame, i;
    memset(&view, 0, sizeof view);
    view.rule = (int)fuzz_below(TERRIMP_GEOMIP_RULE_COUNT + 1);
    view.tolerance_px = fuzz_float(10.0f);
    view.morph_ratio = fuzz_u8() & 1u ? 0.0f : fuzz_float(4.0f);
    view.hysteresis = fuzz_u8() & 1u ? 0.0f : fuzz_float(1.0f);
    view.distances = (float *)fuzz_take(tree->node_count * sizeof *view.distances);
    view.marks = (terrimp_geomip_mark *)fuzz_take(tree->node_count * sizeof *view.marks);
    memset(view.marks, 0, tree->node_count * sizeof *view.marks);
    view.draw_capacity = fuzz_u8() & 7u ? tree->node_count : fuzz_below(4);
    view.draws = (terrimp_geomip_draw *)fuzz_take(view.draw_capacity * sizeof *view.draws);
    for (frame = fuzz_below(4) + 1u; frame-- > 0; change_camera())
        if (terrimp_geomip_select(tree, &view, &camera) == TERRIMP_OK) {
            FUZZ_CHECK(view.draw_count <= view.draw_capacity);
            for (i = 0; i < view.draw_count; i++) {
                uint32_t number = view.draws[i].node.number;
                FUZZ_CHECK(number < tree->node_count &&
                           view.draws[i].pattern < TERRIMP_PATTERN_COUNT &&
                           terrimp_geomip_box(tree, number, &node) == TERRIMP_OK);
            }
            if (view.draw_count > 0)
                draw_node(tree, view.draws + fuzz_u8() % view.draw_count);
        }
    free(view.draws);
    free(view.marks);
    free(view.distances);
}

static void use_geomip(void)
{
    terrimp_quadtree tree;
    terrimp_geomip_weights *weights;
    float *scratch;
    uint32_t quads = fuzz_u8() & 15u ? 4u + 2u * fuzz_below(8) : fuzz_size(130);
    if (terrimp_quadtree_init(&field, quads, &tree) != TERRIMP_OK)
        return;
    tree.nodes = (terrimp_geomip_node *)fuzz_take(tree.node_count * sizeof *tree.nodes);
    scratch = (float *)fuzz_take((tree.field.width + 2u * tree.chunk_quads + 2u) * sizeof *scratch);
    if (terrimp_geomip_build(&tree, scratch) == TERRIMP_OK)
        select_nodes(&tree);
    free(scratch);
    free(tree.nodes);
    weights = (terrimp_geomip_weights *)fuzz_take((size_t)(tree.chunk_quads + 1u)
                                                  * (tree.chunk_quads + 1u) * sizeof *weights);
    FUZZ_CHECK(terrimp_geomip_fill_weights(tree.chunk_quads, weights) == TERRIMP_OK);
    free(weights);
}

/* ---- simplifier ---- */

/* The samples of one border of a tile, in their order. */
static uint32_t border_samples(const float *tile, uint32_t cols, uint32_t rows, int side,
                               float *out)
{
    uint32_t count = side == TERRIMP_SIDE_Z0 || side == TERRIMP_SIDE_Z1 ? cols : rows, i;
    for (i = 0; i < count; i++)
        out[i] = side == TERRIMP_SIDE_Z0   ? tile[i]
                 : side == TERRIMP_SIDE_Z1 ? tile[(rows - 1u) * cols + i]
                 : side == TERRIMP_SIDE_X0 ? tile[i * cols]
                                             : tile[i * cols + cols - 1u];
    return count;
}

static void check_mesh(const terrimp_mesh *mesh, uint32_t cols, uint32_t rows)
{
    uint32_t i;
    FUZZ_CHECK(mesh->vertex_count <= mesh->vertex_capacity);
    FUZZ_CHECK(mesh->index_count <= mesh->index_capacity && mesh->index_count % 3u == 0);
    for (i = 0; i < mesh->vertex_count; i++)
        FUZZ_CHECK(mesh->vertices[i].x < cols && mesh->vertices[i].z < rows);
    for (i = 0; i < mesh->index_count; i++)
        FUZZ_CHECK(mesh->indices[i] < mesh->vertex_count);
}

/* Adds skirts to a mesh; any of it may be refused. */
static void finish_mesh(uint32_t cols, uint32_t rows, terrimp_mesh *mesh)
{
    (void)terrimp_mesh_add_skirt(mesh, 0, fuzz_float(-100.0f));
    (void)terrimp_mesh_add_skirt(mesh, 1, fuzz_float(10.0f));
    check_mesh(mesh, cols, rows);
}

static void simplify_tile(const float *tile, uint32_t cols, uint32_t rows)
{
    static terrimp_border_point points[4][64];
    terrimp_simplify_desc desc;
    terrimp_mesh mesh;
    float line[64];
    uint32_t count, limit = fuzz_below(12), i;
    size_t bytes;
    void *scratch;
    memset(&desc, 0, sizeof desc);
    memset(&mesh, 0, sizeof mesh);
    desc.heights = tile;
    desc.cols = cols;
    desc.rows = rows;
    desc.triangle_budget = fuzz_u8() & 7u ? fuzz_u8() * 2u : fuzz_size(10000);
    for (i = 0; i < 4; i++) {
        count = border_samples(tile, cols, rows, (int)i, line);
        if (terrimp_border_simplify(line, count, limit, points[i], fuzz_u8() & 15u ? 64 : 3,
                                    &desc.borders[i].point_count) != TERRIMP_OK)
            return;
        desc.borders[i].points = points[i];
    }
    if (fuzz_u8() == 1) /* a damaged polyline */
        points[fuzz_below(4)][fuzz_below(4)].at = (uint16_t)fuzz_u32();
    if (fuzz_u8() == 1)
        points[fuzz_below(4)][fuzz_below(4)].height = fuzz_float(10.0f);
    bytes = terrimp_simplify_scratch_bytes(cols, rows, desc.triangle_budget);
    if (bytes == 0 || terrimp_mesh_capacity(desc.triangle_budget, &mesh.vertex_capacity,
                                            &mesh.index_capacity) != TERRIMP_OK)
        return;
    mesh.vertices = (terrimp_mesh_vertex *)fuzz_take(mesh.vertex_capacity * sizeof *mesh.vertices);
    mesh.indices = (uint16_t *)fuzz_take(mesh.index_capacity * sizeof *mesh.indices);
    scratch = fuzz_take(bytes);
    if (terrimp_simplify(&desc, scratch, bytes, &mesh) == TERRIMP_OK) {
        check_mesh(&mesh, cols, rows);
        finish_mesh(cols, rows, &mesh);
    }
    free(scratch);
    free(mesh.indices);
    free(mesh.vertices);
}

static void use_simplifier(void)
{
    uint32_t cols = 2u + fuzz_below(32), rows = 2u + fuzz_below(32);
    uint32_t x = fuzz_below(8), z = fuzz_below(8);
    float *tile = (float *)fuzz_take(cols * rows * sizeof *tile);
    if (terrimp_heightfield_read(&field, x, z, cols, rows, 1, tile) == TERRIMP_OK)
        simplify_tile(tile, cols, rows);
    free(tile);
}

/* ---- atlas ---- */

#define RECTS 32

static int apart(const terrimp_rect *a, const terrimp_rect *b)
{
    return a->x + a->width <= b->x || b->x + b->width <= a->x || a->y + a->height <= b->y ||
           b->y + b->height <= a->y;
}

static void use_packer(void)
{
    terrimp_rect rects[RECTS];
    uint32_t *order, count = fuzz_below(RECTS), i, k;
    uint32_t width = fuzz_size(250), height = fuzz_size(250);
    float scale = 0.0f;
    order = (uint32_t *)fuzz_take(2u * count * sizeof *order);
    memset(rects, 0, sizeof rects);
    for (i = 0; i < count; i++) {
        rects[i].width = fuzz_u8() & 15u ? fuzz_size(80) : 0;
        rects[i].height = fuzz_size(80);
    }
    if (terrimp_pack_ffdh(width, height, rects, count, order, &scale) == TERRIMP_OK) {
        FUZZ_CHECK(scale > 0.0f && scale <= 1.0f);
        for (i = 0; i < count; i++) {
            const terrimp_rect *r = &rects[i];
            if (r->width == 0 || r->height == 0)
                continue;
            FUZZ_CHECK(r->x <= width && r->width <= width - r->x);
            FUZZ_CHECK(r->y <= height && r->height <= height - r->y);
            for (k = 0; k < i; k++)
                FUZZ_CHECK(rects[k].width == 0 || rects[k].height == 0 || apart(r, &rects[k]));
        }
    }
    free(order);
}

/* ---- the calls ---- */

/* All that is opaque is covered, and nothing twice. */
static void cover_layer(const uint32_t *mask, uint32_t width, uint32_t height)
{
    static uint8_t held[20][70];
    terrimp_rect rects[40];
    terrimp_cover_desc d;
    uint32_t i, x, y, count;
    size_t bytes;
    void *scratch;
    memset(&d, 0, sizeof d), memset(held, 0, sizeof held);
    d.mask = mask, d.width = width, d.height = height;
    d.quad_cost = fuzz_below(100), d.gutter = fuzz_below(3);
    bytes = terrimp_cover_scratch_bytes(&d, 40);
    scratch = fuzz_take(bytes);
    if (terrimp_cover(&d, scratch, bytes, rects, 40, &count) == TERRIMP_OK) {
        for (i = 0; i < count; i++)
            for (y = rects[i].y; y < rects[i].y + rects[i].height; y++)
                for (x = rects[i].x; x < rects[i].x + rects[i].width; x++)
                    FUZZ_CHECK(x < width && y < height && !held[y][x]++);
        for (y = 0; y < height; y++)
            for (x = 0; x < width; x++)
                FUZZ_CHECK(held[y][x] ||
                           !(mask[y * TERRIMP_MASK_WORDS(width) + x / 32u] >> x % 32u & 1u));
    }
    free(scratch);
}

static void mesh_layers(const uint32_t *opaque, const uint32_t *visible,
                        const terrimp_layer_record *r)
{
    enum { MOST = 3000 };
    static terrimp_depth_vertex vertices[MOST];
    static uint32_t indices[3 * MOST];
    static terrimp_depth_sheet sheets[MOST];
    static uint16_t texels[20 * MOST];
    static float xyz[3 * MOST];
    terrimp_depth_mesh_desc d;
    terrimp_depth_mesh m;
    uint32_t i;
    size_t bytes;
    void *scratch;
    memset(&d, 0, sizeof d), memset(&m, 0, sizeof m);
    d.opaque = opaque, d.visible = visible, d.width = r->width, d.height = r->height;
    d.layers = r->layers->count, d.tolerance = fuzz_good(0.75f, 3.0f);
    m.vertices = vertices, m.indices = indices, m.sheets = sheets, m.texel_layers = texels;
    m.vertex_capacity = m.sheet_capacity = MOST, m.index_capacity = 3 * MOST;
    m.texel_capacity = 20 * MOST;
    bytes = terrimp_depth_mesh_scratch_bytes(&d);
    scratch = fuzz_take(bytes);
    if (bytes && terrimp_depth_mesh_make(&d, scratch, bytes, &m) == TERRIMP_OK) {
        for (i = 0; i < m.index_count; i++)
            FUZZ_CHECK(m.indices[i] < m.vertex_count);
        FUZZ_CHECK(m.index_count % 3u == 0);
        FUZZ_CHECK(terrimp_depth_points(r->layers, r->picture, vertices, m.vertex_count, xyz) ==
                   TERRIMP_OK);
    }
    free(scratch);
}

/* Layers of some triangles, wherever they stand: what can be seen of them, what covers that, and
   their mesh. */
static void use_layers(void)
{
    enum { MOST = 64 };
    terrimp_layers_desc d;
    terrimp_layers layers;
    terrimp_capture capture;
    terrimp_layer_record r;
    uint32_t words, i, k, count, *visible, *state;
    memset(&d, 0, sizeof d), memset(&r, 0, sizeof r), memset(&capture, 0, sizeof capture);
    d.distance = fuzz_good(20.0f, 90.0f), d.depth = fuzz_good(0.0f, 60.0f);
    d.cell_size[0] = fuzz_good(0.0f, 10.0f), d.cell_size[1] = fuzz_good(0.0f, 10.0f);
    d.cell_depth = fuzz_good(0.0f, 10.0f), d.texel = fuzz_good(0.005f, 0.05f);
    d.view_tan[0] = d.view_tan[1] = fuzz_good(0.05f, 1.0f), d.even = (int)fuzz_below(2);
    switch (fuzz_below(8)) { /* half of the time as it is */
    case 0: d.distance = fuzz_float(100.0f); break;
    case 1: d.depth = fuzz_float(100.0f), d.cell_depth = fuzz_float(20.0f); break;
    case 2: d.cell_tan[0] = fuzz_float(1.0f), d.view_tan[1] = fuzz_float(1.0f); break;
    case 3: d.texel = fuzz_float(0.05f), d.tolerance_rad = fuzz_float(0.1f); break;
    default: break;
    }
    if (terrimp_layers_plan(&d, &layers) != TERRIMP_OK)
        return;
    for (i = 1; i < 30; i++) {
        k = i * (layers.count / 30u + 1u);
        FUZZ_CHECK(k >= layers.count || terrimp_layer_depth(&layers, k) >=
                                            terrimp_layer_depth(&layers, k - 1u));
    }
    if (layers.count > MOST)
        return;
    capture.right[0] = -1.0f, capture.up[1] = capture.forward[2] = 1.0f;
    r.width = 1 + fuzz_below(70), r.height = 1 + fuzz_below(20);
    capture.tan_left = -0.5f * layers.texel * (float)r.width;
    capture.tan_down = -0.5f * layers.texel * (float)r.height;
    words = TERRIMP_MASK_WORDS(r.width) * r.height;
    r.layers = &layers, r.picture = &capture, r.no_outline = (int)fuzz_below(2);
    r.masks = fuzz_take((size_t)layers.count * words * 4);
    visible = fuzz_take((size_t)layers.count * words * 4);
    state = fuzz_take((size_t)words * 16);
    memset(r.masks, 0, (size_t)layers.count * words * 4), memset(state, 0, (size_t)words * 16);
    for (count = fuzz_below(12); count > 0; count--) {
        float xyz[9];
        for (i = 0; i < 9; i++)
            xyz[i] = i % 3 == 2 ? fuzz_good(20.0f, 150.0f) : fuzz_good(-60.0f, 60.0f);
        if (fuzz_below(8) == 0)
            xyz[fuzz_below(9)] = fuzz_float(100.0f);
        terrimp_layer_triangle(&r, xyz);
    }
    for (k = 0; k < layers.count; k++)
        FUZZ_CHECK(terrimp_layer_cull(r.masks + (size_t)k * words, r.width, r.height, 0, state,
                                      visible + (size_t)k * words) == TERRIMP_OK);
    cover_layer(visible, r.width, r.height);
    mesh_layers(r.masks, visible, &r);
    free(r.masks), free(visible), free(state);
}

/* Candidates for random views of seven clusters; numbers may point anywhere. */
static void use_placement(void)
{
    static const uint32_t parents[7] = { 4, 4, 5, 5, 6, 6, 6 };
    terrimp_place_candidate candidates[16];
    terrimp_place_gain gains[64];
    float costs[8], left[8], sum = 0.0f;
    uint8_t shown[64];
    terrimp_place_desc d;
    terrimp_placement placed;
    uint32_t i;
    void *scratch;
    memset(&d, 0, sizeof d);
    d.candidates = candidates, d.gains = gains, d.parents = parents, d.costs = costs;
    d.cluster_count = 7, d.view_count = 1 + fuzz_below(8), d.budget = fuzz_float(10.0f);
    for (i = 0; i < d.view_count; i++)
        costs[i] = fuzz_good(0.0f, 30.0f);
    for (i = fuzz_below(17); i > 0; i--) {
        terrimp_place_candidate *c = &candidates[d.candidate_count++];
        c->cluster = fuzz_u8() < 250 ? fuzz_below(7) : 7;
        c->memory = fuzz_good(0.1f, 3.0f), c->first_gain = d.gain_count;
        for (c->gain_count = 0; c->gain_count < 4 && c->gain_count < d.view_count; d.gain_count++) {
            gains[d.gain_count].view = fuzz_u8() < 250 ? c->gain_count : fuzz_u8();
            gains[d.gain_count].saved = fuzz_good(-2.0f, 10.0f), c->gain_count++;
        }
    }
    scratch = fuzz_take(terrimp_place_scratch_bytes(&d));
    if (terrimp_place(&d, scratch, terrimp_place_scratch_bytes(&d), shown, left, &placed) ==
        TERRIMP_OK) {
        for (i = 0; i < d.candidate_count; i++)
            if (candidates[i].gain_count &&
                memchr(shown + candidates[i].first_gain, 1, candidates[i].gain_count))
                sum += candidates[i].memory;
        FUZZ_CHECK(placed.unsolved <= placed.problems && placed.chosen <= d.candidate_count);
        FUZZ_CHECK(!(placed.memory < sum * 0.999f) && !(placed.memory > sum * 1.001f));
    }
    free(scratch);
}

static void (*const calls[])(void) = {
    change_field, change_place_of_field, refuse_field, change_camera, change_box,   query_field,
    read_field,   fill_field,            cast_ray,     use_camera,    use_capture,  judge_picture,
    use_patterns, use_geomip,            use_packer,   use_simplifier,
    use_layers, use_placement,
};

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    int steps;
    fuzz_bytes = bytes;
    fuzz_left = size;
    memset(&camera, 0, sizeof camera);
    memset(&box, 0, sizeof box);
    change_field();
    for (steps = 0; steps < 16 && fuzz_left > 0; steps++)
        calls[fuzz_below(sizeof calls / sizeof *calls)]();
    free(samples);
    samples = NULL;
    return 0;
}
