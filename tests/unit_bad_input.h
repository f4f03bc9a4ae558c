/* Bad input: every public function refuses null, zero, negative, NaN, infinite and huge arguments
   with the error that its comment names, and leaves its outputs alone. In the header's order. */
#ifndef UNIT_BAD_INPUT_H
#define UNIT_BAD_INPUT_H

#include "unit_bake.h"

#include <stddef.h>

static int provoked[TERRIMP_RESULT_COUNT]; /* which results the tests below have seen */

static void note_result(terrimp_result result)
{
    if (result >= 0 && result < TERRIMP_RESULT_COUNT)
        provoked[result] = 1;
}

/* The call gives the wanted error, and `out` keeps every bit it had. */
#define REFUSES(wanted, out, call)                         \
    do {                                                   \
        terrimp_result refused_;                           \
        memset(&(out), UNTOUCHED, sizeof(out));            \
        refused_ = (call);                                 \
        CHECK(refused_ == (wanted));                       \
        CHECK(is_untouched(&(out), sizeof(out)));          \
        note_result(refused_);                             \
    } while (0)

/* The same where there is no output to look at. */
#define GIVES(wanted, call)                                \
    do {                                                   \
        terrimp_result given_ = (call);                    \
        CHECK(given_ == (wanted));                         \
        note_result(given_);                               \
    } while (0)

/* NaN and both infinities, by turns; made at run time so that no compiler objects. */
static float not_finite(int i)
{
    volatile float zero = 0.0f;
    return i % 3 == 0 ? zero / zero : i % 3 == 1 ? 1.0f / zero : -1.0f / zero;
}

static void result_texts_are_all_different(void)
{
    int i, k;
    CHECK(TERRIMP_OK == 0);
    for (i = 0; i < TERRIMP_RESULT_COUNT; i++) {
        CHECK(terrimp_result_text(i) != NULL && strlen(terrimp_result_text(i)) > 1);
        CHECK(strcmp(terrimp_result_text(i), terrimp_result_text(-1)) != 0);
        for (k = 0; k < i; k++)
            CHECK(strcmp(terrimp_result_text(i), terrimp_result_text(k)) != 0);
    }
    CHECK(strcmp(terrimp_result_text(TERRIMP_RESULT_COUNT), terrimp_result_text(1 << 30)) == 0);
}

/* ---- heightfield ---- */

static float flat_samples[5 * 4];

static void good_field(terrimp_heightfield *field)
{
    int i;
    for (i = 0; i < 20; i++)
        flat_samples[i] = 7.0f;
    memset(field, 0, sizeof *field);
    field->samples = flat_samples;
    field->width = 5;
    field->depth = 4;
}

static void heightfield_resolve_refuses(void)
{
    terrimp_heightfield good, bad, out;
    int i, member;
    good_field(&good);
    REFUSES(TERRIMP_E_NULL, out, terrimp_heightfield_resolve(NULL, &out));
    GIVES(TERRIMP_E_NULL, terrimp_heightfield_resolve(&good, NULL));
    for (member = 0; member < 6; member++)
        for (i = 0; i < 3; i++) {
            float *where;
            bad = good;
            where = member == 0   ? &bad.spacing_x
                    : member == 1 ? &bad.spacing_z
                    : member == 2 ? &bad.height_scale
                    : member == 3 ? &bad.height_offset
                    : member == 4 ? &bad.origin_x
                                  : &bad.origin_z;
            *where = not_finite(i);
            REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_heightfield_resolve(&bad, &out));
            if (member < 3) {
                *where = -1.0f;
                REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_resolve(&bad, &out));
            }
        }
    bad = good;
    bad.samples = NULL;
    REFUSES(TERRIMP_E_NULL, out, terrimp_heightfield_resolve(&bad, &out));
    bad = good;
    bad.width = 1;
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_resolve(&bad, &out));
    bad.width = 0xffffffffu;
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_resolve(&bad, &out));
    bad = good;
    bad.depth = 0;
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_resolve(&bad, &out));
    bad = good;
    bad.format = TERRIMP_FORMAT_COUNT;
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_resolve(&bad, &out));
    bad.format = -1;
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_resolve(&bad, &out));
    bad = good;
    bad.row_bytes = 4;
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_resolve(&bad, &out));
    bad.row_bytes = (size_t)-1 / 8u * 4u;
    REFUSES(TERRIMP_E_OVERFLOW, out, terrimp_heightfield_resolve(&bad, &out));
    bad = good;
    bad.samples = (const char *)flat_samples + 1;
    REFUSES(TERRIMP_E_ALIGN, out, terrimp_heightfield_resolve(&bad, &out));
    bad = good;
    bad.origin_x = 1e30f;
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_resolve(&bad, &out));
}

/* Every query passes on what resolve says of the field. */
static void heightfield_queries_refuse(void)
{
    terrimp_heightfield good, bad, holes;
    float out[20], origin[3] = {1.0f, 50.0f, 1.0f}, down[3] = {0.0f, -1.0f, 0.0f};
    float none[3] = {0.0f, 0.0f, 0.0f}, wrong[3];
    struct { uint32_t x, z; } at;
    struct { float low, high; } range;
    terrimp_ray_hit hit;
    size_t count;
    static double scratch[256];
    size_t bytes = terrimp_heightfield_fill_voids_scratch_bytes(5, 4);
    int i;
    good_field(&good);
    bad = good;
    bad.width = 0;
    REFUSES(TERRIMP_E_RANGE, at, terrimp_heightfield_validate(&bad, &at.x, &at.z));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_read(&bad, 0, 0, 1, 1, 1, out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_read(&bad, 0, 0, 1, 1, 1, out));
    REFUSES(TERRIMP_E_RANGE, range,
            terrimp_heightfield_bounds(&bad, 0, 0, 1, 1, &range.low, &range.high));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_height(&bad, 0.0f, 0.0f, out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_normal(&bad, 0.0f, 0.0f, out));
    REFUSES(TERRIMP_E_RANGE, hit, terrimp_heightfield_raycast(&bad, origin, down, 99.0f, &hit));
    REFUSES(TERRIMP_E_RANGE, count,
            terrimp_heightfield_fill_voids(&bad, flat_samples, scratch, sizeof scratch, &count));
    REFUSES(TERRIMP_E_NULL, at, terrimp_heightfield_validate(NULL, &at.x, &at.z));
    REFUSES(TERRIMP_E_NULL, out, terrimp_heightfield_read(NULL, 0, 0, 1, 1, 1, out));
    GIVES(TERRIMP_E_NULL, terrimp_heightfield_read(&good, 0, 0, 1, 1, 1, NULL));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_read(&good, 5, 0, 1, 1, 1, out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_read(&good, 0, 0xffffffffu, 1, 1, 1, out));
    GIVES(TERRIMP_E_NULL, terrimp_heightfield_read(&good, 0, 0, 1, 1, 1, NULL));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_read(&good, 5, 0, 1, 1, 1, out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_read(&good, 0, 0, 0, 1, 1, out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_read(&good, 0, 0, 1, 0, 1, out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_heightfield_read(&good, 0, 0, 1, 1, 0, out));
    if (sizeof(size_t) <= 8)
        REFUSES(TERRIMP_E_OVERFLOW, out,
                terrimp_heightfield_read(&good, 0, 0, 0xffffffffu, 0xffffffffu, 1, out));
    GIVES(TERRIMP_E_NULL, terrimp_heightfield_bounds(&good, 0, 0, 1, 1, NULL, &range.high));
    REFUSES(TERRIMP_E_RANGE, range,
            terrimp_heightfield_bounds(&good, 0, 4, 1, 1, &range.low, &range.high));
    GIVES(TERRIMP_E_NULL, terrimp_heightfield_height(&good, 0.0f, 0.0f, NULL));
    GIVES(TERRIMP_E_NULL, terrimp_heightfield_normal(&good, 0.0f, 0.0f, NULL));
    REFUSES(TERRIMP_E_MISS, out, terrimp_heightfield_height(&good, -0.1f, 0.0f, out));
    REFUSES(TERRIMP_E_MISS, out, terrimp_heightfield_normal(&good, 0.0f, 3e38f, out));
    REFUSES(TERRIMP_E_NULL, hit, terrimp_heightfield_raycast(&good, NULL, down, 9.0f, &hit));
    REFUSES(TERRIMP_E_NULL, hit, terrimp_heightfield_raycast(&good, origin, NULL, 9.0f, &hit));
    REFUSES(TERRIMP_E_RANGE, hit, terrimp_heightfield_raycast(&good, origin, none, 9.0f, &hit));
    REFUSES(TERRIMP_E_RANGE, hit, terrimp_heightfield_raycast(&good, origin, down, 0.0f, &hit));
    REFUSES(TERRIMP_E_RANGE, hit, terrimp_heightfield_raycast(&good, origin, down, -1.0f, &hit));
    REFUSES(TERRIMP_E_MISS, hit, terrimp_heightfield_raycast(&good, origin, down, 9.0f, &hit));
    for (i = 0; i < 3; i++) {
        REFUSES(TERRIMP_E_NOT_FINITE, out,
                terrimp_heightfield_height(&good, not_finite(i), 0.0f, out));
        REFUSES(TERRIMP_E_NOT_FINITE, out,
                terrimp_heightfield_normal(&good, 0.0f, not_finite(i), out));
        REFUSES(TERRIMP_E_NOT_FINITE, hit,
                terrimp_heightfield_raycast(&good, origin, down, not_finite(i), &hit));
        memcpy(wrong, origin, sizeof wrong);
        wrong[i] = not_finite(i);
        REFUSES(TERRIMP_E_NOT_FINITE, hit,
                terrimp_heightfield_raycast(&good, wrong, down, 9.0f, &hit));
        REFUSES(TERRIMP_E_NOT_FINITE, hit,
                terrimp_heightfield_raycast(&good, origin, wrong, 9.0f, &hit));
    }
    CHECK(terrimp_heightfield_fill_voids_scratch_bytes(1, 4) == 0);
    CHECK(terrimp_heightfield_fill_voids_scratch_bytes(4, 0) == 0);
    CHECK(terrimp_heightfield_fill_voids_scratch_bytes(0xffffffffu, 4) == 0);
    CHECK(bytes > 0 && bytes < sizeof scratch);
    REFUSES(TERRIMP_E_NULL, count,
            terrimp_heightfield_fill_voids(&good, NULL, scratch, bytes, &count));
    REFUSES(TERRIMP_E_NULL, count,
            terrimp_heightfield_fill_voids(&good, flat_samples, NULL, bytes, &count));
    REFUSES(TERRIMP_E_RANGE, count,
            terrimp_heightfield_fill_voids(&good, flat_samples + 1, scratch, bytes, &count));
    REFUSES(TERRIMP_E_MEMORY, count,
            terrimp_heightfield_fill_voids(&good, flat_samples, scratch, bytes - 1u, &count));
    REFUSES(TERRIMP_E_ALIGN, count,
            terrimp_heightfield_fill_voids(&good, flat_samples, (char *)scratch + 1, bytes,
                                           &count));
    holes = good;
    holes.has_no_data = 1;
    holes.no_data = 7.0f;
    REFUSES(TERRIMP_E_VOID, count,
            terrimp_heightfield_fill_voids(&holes, flat_samples, scratch, bytes, &count));
    REFUSES(TERRIMP_E_VOID, out, terrimp_heightfield_read(&holes, 0, 0, 1, 1, 1, out));
    REFUSES(TERRIMP_E_VOID, out, terrimp_heightfield_height(&holes, 1.0f, 1.0f, out));
    REFUSES(TERRIMP_E_VOID, range,
            terrimp_heightfield_bounds(&holes, 0, 0, 5, 4, &range.low, &range.high));
}

/* ---- simplifier ---- */

static void simplifier_refuses(void)
{
    static terrimp_border_point points[8];
    static terrimp_mesh_vertex vertices[600];
    static uint16_t indices[3000];
    static int64_t scratch[40000];
    terrimp_border_point ends[2];
    terrimp_simplify_desc desc, bad;
    terrimp_mesh mesh, before;
    float line[5] = {1.0f, 2.0f, 3.0f, 2.0f, 1.0f};
    struct { uint32_t vertices, indices; } counts;
    uint32_t point_count;
    size_t bytes = terrimp_simplify_scratch_bytes(5, 4, 0);
    int i;

    REFUSES(TERRIMP_E_NULL, point_count,
            terrimp_border_simplify(NULL, 5, 0, points, 8, &point_count));
    REFUSES(TERRIMP_E_NULL, point_count,
            terrimp_border_simplify(line, 5, 0, NULL, 8, &point_count));
    GIVES(TERRIMP_E_NULL, terrimp_border_simplify(line, 5, 0, points, 8, NULL));
    REFUSES(TERRIMP_E_RANGE, points, terrimp_border_simplify(line, 1, 0, points, 8, &point_count));
    REFUSES(TERRIMP_E_RANGE, points,
            terrimp_border_simplify(line, TERRIMP_MAX_TILE_DIM + 1u, 0, points, 8, &point_count));
    REFUSES(TERRIMP_E_CAPACITY, points,
            terrimp_border_simplify(line, 5, 0, points, 1, &point_count));
    for (i = 0; i < 3; i++) {
        line[2] = not_finite(i);
        REFUSES(TERRIMP_E_NOT_FINITE, points,
                terrimp_border_simplify(line, 5, 0, points, 8, &point_count));
    }
    line[2] = 3.0f;
    CHECK(terrimp_simplify_scratch_bytes(1, 5, 0) == 0);
    CHECK(terrimp_simplify_scratch_bytes(5, TERRIMP_MAX_TILE_DIM + 1u, 0) == 0);
    CHECK(terrimp_simplify_scratch_bytes(5, 5, TERRIMP_MAX_TRIANGLES + 1u) == 0);
    REFUSES(TERRIMP_E_RANGE, counts,
            terrimp_mesh_capacity(TERRIMP_MAX_TRIANGLES + 1u, &counts.vertices, &counts.indices));
    GIVES(TERRIMP_E_NULL, terrimp_mesh_capacity(0, NULL, &counts.indices));
    GIVES(TERRIMP_E_NULL, terrimp_mesh_capacity(0, &counts.vertices, NULL));

    for (i = 0; i < 20; i++)
        flat_samples[i] = (float)(i % 7);
    CHECK(bytes > 0 && bytes < sizeof scratch);
    memset(&desc, 0, sizeof desc);
    desc.heights = flat_samples;
    desc.cols = 5;
    desc.rows = 4;
    desc.triangle_budget = 20;
    for (i = 0; i < TERRIMP_SIDE_COUNT; i++) {
        static terrimp_border_point kept[TERRIMP_SIDE_COUNT][8];
        float samples[5];
        uint32_t along_x = i == TERRIMP_SIDE_Z0 || i == TERRIMP_SIDE_Z1, k;
        uint32_t count = along_x ? 5u : 4u, step = along_x ? 1u : 5u;
        uint32_t first = i == TERRIMP_SIDE_Z1 ? 15u : i == TERRIMP_SIDE_X1 ? 4u : 0u;
        for (k = 0; k < count; k++)
            samples[k] = flat_samples[first + k * step];
        GIVES(TERRIMP_OK, terrimp_border_simplify(samples, count, 2, kept[i], 8, &point_count));
        desc.borders[i].points = kept[i];
        desc.borders[i].point_count = point_count;
    }
    memset(&mesh, 0, sizeof mesh);
    mesh.vertices = vertices;
    mesh.indices = indices;
    mesh.vertex_capacity = 600;
    mesh.index_capacity = 3000;
    before = mesh;
#define MESH_REFUSES(wanted, call)                             \
    do {                                                       \
        REFUSES(wanted, vertices, call);                       \
        CHECK(memcmp(&mesh, &before, sizeof mesh) == 0);       \
    } while (0)
    MESH_REFUSES(TERRIMP_E_NULL, terrimp_simplify(NULL, scratch, bytes, &mesh));
    MESH_REFUSES(TERRIMP_E_NULL, terrimp_simplify(&desc, NULL, bytes, &mesh));
    MESH_REFUSES(TERRIMP_E_NULL, terrimp_simplify(&desc, scratch, bytes, NULL));
    MESH_REFUSES(TERRIMP_E_MEMORY, terrimp_simplify(&desc, scratch, 16, &mesh));
    MESH_REFUSES(TERRIMP_E_ALIGN,
                 terrimp_simplify(&desc, (char *)scratch + 1, sizeof scratch - 8u, &mesh));
    bad = desc;
    bad.heights = NULL;
    MESH_REFUSES(TERRIMP_E_NULL, terrimp_simplify(&bad, scratch, bytes, &mesh));
    bad = desc;
    bad.borders[2].points = NULL;
    MESH_REFUSES(TERRIMP_E_NULL, terrimp_simplify(&bad, scratch, bytes, &mesh));
    bad = desc;
    bad.cols = 1;
    MESH_REFUSES(TERRIMP_E_RANGE, terrimp_simplify(&bad, scratch, bytes, &mesh));
    bad = desc;
    bad.rows = 100000;
    MESH_REFUSES(TERRIMP_E_RANGE, terrimp_simplify(&bad, scratch, bytes, &mesh));
    bad = desc;
    bad.triangle_budget = 1;
    MESH_REFUSES(TERRIMP_E_RANGE, terrimp_simplify(&bad, scratch, bytes, &mesh));
    bad.triangle_budget = TERRIMP_MAX_TRIANGLES + 1u;
    MESH_REFUSES(TERRIMP_E_RANGE, terrimp_simplify(&bad, scratch, bytes, &mesh));
    bad = desc;
    bad.borders[0].point_count = 1;
    MESH_REFUSES(TERRIMP_E_RANGE, terrimp_simplify(&bad, scratch, bytes, &mesh));
    memset(ends, 0, sizeof ends); /* both at sample 0: it does not rise to the end */
    bad.borders[0].points = ends;
    bad.borders[0].point_count = 2;
    MESH_REFUSES(TERRIMP_E_RANGE, terrimp_simplify(&bad, scratch, bytes, &mesh));
    ends[1].at = 4;
    ends[0].height = 99.0f; /* corners that disagree */
    MESH_REFUSES(TERRIMP_E_RANGE, terrimp_simplify(&bad, scratch, bytes, &mesh));
    mesh.vertex_capacity = before.vertex_capacity = 3;
    MESH_REFUSES(TERRIMP_E_CAPACITY, terrimp_simplify(&desc, scratch, bytes, &mesh));
    mesh.vertex_capacity = before.vertex_capacity = 600;
    mesh.index_capacity = before.index_capacity = 3;
    MESH_REFUSES(TERRIMP_E_CAPACITY, terrimp_simplify(&desc, scratch, bytes, &mesh));
    mesh.index_capacity = before.index_capacity = 3000;
    flat_samples[7] = not_finite(0);
    MESH_REFUSES(TERRIMP_E_NOT_FINITE, terrimp_simplify(&desc, scratch, bytes, &mesh));
    flat_samples[7] = 0.0f;

    MESH_REFUSES(TERRIMP_E_STATE, terrimp_mesh_add_skirt(&mesh, 0, 0.0f));
    MESH_REFUSES(TERRIMP_E_STATE, terrimp_mesh_add_skirt(&mesh, 1, 1.0f));
    GIVES(TERRIMP_OK, terrimp_simplify(&desc, scratch, bytes, &mesh));
    before = mesh;
    GIVES(TERRIMP_E_NULL, terrimp_mesh_add_skirt(NULL, 0, 0.0f));
    GIVES(TERRIMP_E_NULL, terrimp_mesh_add_skirt(NULL, 1, 0.0f));
    GIVES(TERRIMP_E_RANGE, terrimp_mesh_add_skirt(&mesh, 1, -1.0f));
    for (i = 0; i < 3; i++) {
        GIVES(TERRIMP_E_NOT_FINITE, terrimp_mesh_add_skirt(&mesh, 0, not_finite(i)));
        GIVES(TERRIMP_E_NOT_FINITE, terrimp_mesh_add_skirt(&mesh, 1, not_finite(i)));
    }
    mesh.index_capacity = before.index_capacity = mesh.index_count + 1u;
    GIVES(TERRIMP_E_CAPACITY, terrimp_mesh_add_skirt(&mesh, 0, 0.0f));
    GIVES(TERRIMP_E_CAPACITY, terrimp_mesh_add_skirt(&mesh, 1, 1.0f));
    CHECK(memcmp(&mesh, &before, sizeof mesh) == 0);
#undef MESH_REFUSES
}

/* ---- camera ---- */

/* All that take a camera refuse it alike. */
static void check_camera_refused(terrimp_result wanted, const terrimp_camera *camera)
{
    terrimp_camera out;
    terrimp_frustum frustum;
    float matrices[2][16], factor;
    REFUSES(wanted, out, terrimp_camera_resolve(camera, &out));
    REFUSES(wanted, matrices, terrimp_camera_matrices(camera, matrices[0], matrices[1]));
    REFUSES(wanted, factor, terrimp_camera_pixel_factor(camera, &factor));
    REFUSES(wanted, frustum, terrimp_camera_frustum(camera, &frustum));
}

static void cameras_are_refused(void)
{
    terrimp_camera good, bad;
    float matrix[16];
    int i, k;
    random_camera(1.0f, &good);
    check_camera_refused(TERRIMP_E_NULL, NULL);
    GIVES(TERRIMP_E_NULL, terrimp_camera_resolve(&good, NULL));
    GIVES(TERRIMP_E_NULL, terrimp_camera_matrices(&good, NULL, matrix));
    GIVES(TERRIMP_E_NULL, terrimp_camera_matrices(&good, matrix, NULL));
    GIVES(TERRIMP_E_NULL, terrimp_camera_pixel_factor(&good, NULL));
    GIVES(TERRIMP_E_NULL, terrimp_camera_frustum(&good, NULL));
    for (i = 0; i < 3; i++) {
        for (k = 0; k < 3; k++) {
            bad = good;
            bad.eye[k] = not_finite(i);
            check_camera_refused(TERRIMP_E_NOT_FINITE, &bad);
            bad = good;
            bad.forward[k] = not_finite(i);
            check_camera_refused(TERRIMP_E_NOT_FINITE, &bad);
            bad = good;
            bad.up[k] = not_finite(i);
            check_camera_refused(TERRIMP_E_NOT_FINITE, &bad);
        }
        bad = good;
        bad.fov_y_rad = not_finite(i);
        check_camera_refused(TERRIMP_E_NOT_FINITE, &bad);
        bad = good;
        bad.z_near = not_finite(i);
        check_camera_refused(TERRIMP_E_NOT_FINITE, &bad);
        bad = good;
        bad.z_far = not_finite(i);
        check_camera_refused(TERRIMP_E_NOT_FINITE, &bad);
        bad = good;
        bad.reach = not_finite(i);
        check_camera_refused(TERRIMP_E_NOT_FINITE, &bad);
        for (k = 0; k < 4; k++) {
            bad = good;
            bad.sides[k] = not_finite(i);
            check_camera_refused(TERRIMP_E_NOT_FINITE, &bad);
        }
    }
    for (i = 0; i < 22; i++) {
        bad = good;
        switch (i) {
        case 0: memset(bad.forward, 0, sizeof bad.forward); break;
        case 1: bad.fov_y_rad = -1.0f; break;
        case 2: bad.fov_y_rad = 0.0009f; break;
        case 3: bad.fov_y_rad = 3.11f; break;
        case 4: bad.width_px = 0; break;
        case 5: bad.width_px = 65537; break;
        case 6: bad.height_px = 0; break;
        case 7: bad.height_px = 0xffffffffu; break;
        case 8: bad.z_near = 0.0f; break;
        case 9: bad.z_near = -1.0f; break;
        case 10: bad.z_far = bad.z_near; break;
        case 11: bad.z_far = 0.5f * bad.z_near; break;
        case 12: bad.z_far = -1.0f; break;
        case 13: bad.sides[1] = 1.0f; break; /* no height */
        case 14: bad.sides[0] = 1.0f, bad.sides[1] = 1.000001f, bad.sides[3] = 1.0f; break;
        case 15: bad.sides[0] = 1.0f, bad.sides[1] = -1.0f, bad.sides[3] = 1.0f; break;
        case 16: bad.sides[1] = 1.0f, bad.sides[3] = 1.1e4f; break;
        case 17: bad.reach = -1.0f; break;
        case 18: bad.orthographic = 1; break; /* without sides */
        case 19: bad.orthographic = 1, bad.sides[1] = bad.sides[3] = 1.1e18f; break;
        case 20: bad.orthographic = 1, bad.sides[1] = bad.sides[3] = 1.0f, bad.z_far = 0.0f; break;
        default: bad.fov_y_rad = FLT_MAX; break;
        }
        check_camera_refused(TERRIMP_E_RANGE, &bad);
    }
}

/* A box, an eye and a capture that everything accepts. */
static void good_capture(terrimp_box *box, float eye[3], terrimp_capture *capture)
{
    int k;
    for (k = 0; k < 3; k++) {
        box->min[k] = -1.0f;
        box->max[k] = 1.0f;
        eye[k] = 5.0f;
    }
    CHECK(terrimp_capture_fit(box, eye, capture) == TERRIMP_OK);
}

static void captures_are_refused(void)
{
    terrimp_box box, bad;
    terrimp_capture capture, out;
    float eye[3], wrong[3], m[2][16];
    int i, k;
    good_capture(&box, eye, &capture);
    REFUSES(TERRIMP_E_NULL, out, terrimp_capture_fit(NULL, eye, &out));
    REFUSES(TERRIMP_E_NULL, out, terrimp_capture_fit(&box, NULL, &out));
    GIVES(TERRIMP_E_NULL, terrimp_capture_fit(&box, eye, NULL));
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) {
            bad = box;
            bad.min[k] = not_finite(i);
            REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_capture_fit(&bad, eye, &out));
            bad = box;
            bad.max[k] = not_finite(i);
            REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_capture_fit(&bad, eye, &out));
            memcpy(wrong, eye, sizeof wrong);
            wrong[k] = not_finite(i);
            REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_capture_fit(&box, wrong, &out));
            bad = box;
            bad.min[k] = 1.5f;
            REFUSES(TERRIMP_E_RANGE, out, terrimp_capture_fit(&bad, eye, &out));
        }
    memset(wrong, 0, sizeof wrong);
    REFUSES(TERRIMP_E_INSIDE, out, terrimp_capture_fit(&box, wrong, &out));
    wrong[0] = 1.001f;
    REFUSES(TERRIMP_E_BEHIND, out, terrimp_capture_fit(&box, wrong, &out));
    REFUSES(TERRIMP_E_NULL, m, terrimp_capture_matrices(NULL, 0, m[0], m[1]));
    REFUSES(TERRIMP_E_NULL, m, terrimp_capture_matrices(&capture, 0, NULL, m[1]));
    REFUSES(TERRIMP_E_NULL, m, terrimp_capture_matrices(&capture, 0, m[0], NULL));
}

/* ---- impostor ---- */

static void impostor_functions_refuse(void)
{
    terrimp_box box, bad_box;
    terrimp_capture capture, bad;
    float eye[3], other[3] = {5.0f, 6.0f, 5.0f}, wrong[3], out;
    float matrix[16], xyz[3] = {0, 0, 0}, stq[3];
    struct { uint32_t size[2]; float scale; } got;
    uint32_t slot[2] = {10, 10};
    terrimp_rect rect = {0, 0, 10, 10};
    int i, k;
    good_capture(&box, eye, &capture);
    REFUSES(TERRIMP_E_NULL, got, terrimp_impostor_size(NULL, 1, 1, 1, 9, got.size, &got.scale));
    REFUSES(TERRIMP_E_NULL, got, terrimp_impostor_size(&capture, 1, 1, 1, 9, NULL, &got.scale));
    for (i = 0; i < 3; i++) {
        REFUSES(TERRIMP_E_NOT_FINITE, got,
                terrimp_impostor_size(&capture, not_finite(i), 1, 1, 9, got.size, &got.scale));
        REFUSES(TERRIMP_E_NOT_FINITE, got,
                terrimp_impostor_size(&capture, 1, not_finite(i), 1, 9, got.size, &got.scale));
        bad = capture;
        bad.tan_left = not_finite(i);
        REFUSES(TERRIMP_E_NOT_FINITE, got,
                terrimp_impostor_size(&bad, 1, 1, 1, 9, got.size, &got.scale));
    }
    for (i = -1; i < 1; i++) {
        REFUSES(TERRIMP_E_RANGE, got,
                terrimp_impostor_size(&capture, (float)i, 1, 1, 9, got.size, &got.scale));
        REFUSES(TERRIMP_E_RANGE, got,
                terrimp_impostor_size(&capture, 1, (float)i, 1, 9, got.size, &got.scale));
    }
    REFUSES(TERRIMP_E_RANGE, got,
            terrimp_impostor_size(&capture, -1, -1, 1, 9, got.size, &got.scale));
    REFUSES(TERRIMP_E_RANGE, got,
            terrimp_impostor_size(&capture, 1, 1, 10, 9, got.size, &got.scale));
    REFUSES(TERRIMP_E_RANGE, got,
            terrimp_impostor_size(&capture, 1, 1, 0, 0, got.size, &got.scale));
    bad = capture;
    bad.tan_right = bad.tan_left;
    REFUSES(TERRIMP_E_RANGE, got, terrimp_impostor_size(&bad, 1, 1, 1, 9, got.size, &got.scale));

    GIVES(TERRIMP_E_NULL, terrimp_capture_pad(NULL, slot, 1));
    bad = capture;
    GIVES(TERRIMP_E_NULL, terrimp_capture_pad(&bad, NULL, 1));
    GIVES(TERRIMP_E_RANGE, terrimp_capture_pad(&bad, slot, 5));
    GIVES(TERRIMP_E_RANGE, terrimp_capture_pad(&bad, slot, 0xffffffffu));
    GIVES(TERRIMP_E_RANGE, terrimp_capture_pad(&bad, slot, 0x80000000u));
    slot[1] = 0;
    GIVES(TERRIMP_E_RANGE, terrimp_capture_pad(&bad, slot, 0));
    CHECK(memcmp(&bad, &capture, sizeof bad) == 0);

    REFUSES(TERRIMP_E_NULL, matrix, terrimp_texture_matrix(NULL, &rect, 64, 64, matrix));
    REFUSES(TERRIMP_E_NULL, matrix, terrimp_texture_matrix(&capture, NULL, 64, 64, matrix));
    GIVES(TERRIMP_E_NULL, terrimp_texture_matrix(&capture, &rect, 64, 64, NULL));
    REFUSES(TERRIMP_E_RANGE, matrix, terrimp_texture_matrix(&capture, &rect, 9, 64, matrix));
    REFUSES(TERRIMP_E_NULL, matrix, terrimp_place_matrix(NULL, &rect, 64, 64, eye, matrix));
    REFUSES(TERRIMP_E_NULL, matrix, terrimp_place_matrix(&capture, NULL, 64, 64, eye, matrix));
    REFUSES(TERRIMP_E_NULL, matrix, terrimp_place_matrix(&capture, &rect, 64, 64, NULL, matrix));
    GIVES(TERRIMP_E_NULL, terrimp_place_matrix(&capture, &rect, 64, 64, eye, NULL));
    REFUSES(TERRIMP_E_RANGE, matrix, terrimp_place_matrix(&capture, &rect, 9, 64, eye, matrix));
    REFUSES(TERRIMP_E_RANGE, matrix, terrimp_texture_matrix(&capture, &rect, 64, 9, matrix));
    REFUSES(TERRIMP_E_RANGE, matrix, terrimp_texture_matrix(&capture, &rect, 0, 64, matrix));
    rect.x = 0xffffffffu;
    REFUSES(TERRIMP_E_RANGE, matrix, terrimp_texture_matrix(&capture, &rect, 64, 64, matrix));
    rect.x = rect.width = 0;
    REFUSES(TERRIMP_E_RANGE, matrix, terrimp_texture_matrix(&capture, &rect, 64, 64, matrix));
    REFUSES(TERRIMP_E_NULL, stq, terrimp_texture_coordinates(NULL, capture.eye, xyz, 1, stq));
    REFUSES(TERRIMP_E_NULL, stq, terrimp_texture_coordinates(matrix, NULL, xyz, 1, stq));
    REFUSES(TERRIMP_E_NULL, stq, terrimp_texture_coordinates(matrix, capture.eye, NULL, 1, stq));
    GIVES(TERRIMP_E_NULL, terrimp_texture_coordinates(matrix, capture.eye, xyz, 1, NULL));
    GIVES(TERRIMP_OK, terrimp_texture_coordinates(matrix, capture.eye, NULL, 0, NULL));

    REFUSES(TERRIMP_E_NULL, out, terrimp_view_angle(NULL, eye, other, &out));
    REFUSES(TERRIMP_E_NULL, out, terrimp_view_angle(&box, NULL, other, &out));
    REFUSES(TERRIMP_E_NULL, out, terrimp_view_angle(&box, eye, NULL, &out));
    GIVES(TERRIMP_E_NULL, terrimp_view_angle(&box, eye, other, NULL));
    REFUSES(TERRIMP_E_NULL, out, terrimp_parallax_error(NULL, 1, eye, other, 9, &out));
    REFUSES(TERRIMP_E_NULL, out, terrimp_parallax_error(&box, 1, NULL, other, 9, &out));
    REFUSES(TERRIMP_E_NULL, out, terrimp_parallax_error(&box, 1, eye, NULL, 9, &out));
    GIVES(TERRIMP_E_NULL, terrimp_parallax_error(&box, 1, eye, other, 9, NULL));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_parallax_error(&box, -1, eye, other, 9, &out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_parallax_error(&box, 1, eye, other, 0, &out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_parallax_error(&box, 1, eye, other, -9, &out));
    for (i = 0; i < 3; i++) {
        for (k = 0; k < 3; k++) {
            memcpy(wrong, eye, sizeof wrong);
            wrong[k] = not_finite(i);
            bad_box = box;
            bad_box.max[k] = not_finite(i);
            REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_view_angle(&bad_box, eye, other, &out));
            REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_view_angle(&box, wrong, other, &out));
            REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_view_angle(&box, eye, wrong, &out));
            REFUSES(TERRIMP_E_NOT_FINITE, out,
                    terrimp_parallax_error(&bad_box, 1, eye, other, 9, &out));
            REFUSES(TERRIMP_E_NOT_FINITE, out,
                    terrimp_parallax_error(&box, 1, wrong, other, 9, &out));
            REFUSES(TERRIMP_E_NOT_FINITE, out,
                    terrimp_parallax_error(&box, 1, eye, wrong, 9, &out));
        }
        REFUSES(TERRIMP_E_NOT_FINITE, out,
                terrimp_parallax_error(&box, not_finite(i), eye, other, 9, &out));
        REFUSES(TERRIMP_E_NOT_FINITE, out,
                terrimp_parallax_error(&box, 1, eye, other, not_finite(i), &out));
        REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_impostor_lifetime(not_finite(i), 1, 1, &out));
        REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_impostor_lifetime(1, not_finite(i), 1, &out));
        REFUSES(TERRIMP_E_NOT_FINITE, out, terrimp_impostor_lifetime(1, 1, not_finite(i), &out));
    }
    GIVES(TERRIMP_E_NULL, terrimp_impostor_lifetime(1, 1, 1, NULL));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_impostor_lifetime(-1, 1, 1, &out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_impostor_lifetime(1, -1, 1, &out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_impostor_lifetime(1, 3.2f, 1, &out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_impostor_lifetime(1, 1, 0, &out));
    REFUSES(TERRIMP_E_RANGE, out, terrimp_impostor_lifetime(1, 1, -1, &out));
}

/* Sizes and distances close to what a float holds give an error or an answer, never undefined
   behaviour: that is for the sanitizers to see. */
static void huge_and_random_numbers_do_no_harm(void)
{
    int i, k;
    for (i = 0; i < 20000; i++) {
        terrimp_box box;
        terrimp_capture capture;
        terrimp_camera camera, resolved;
        terrimp_frustum frustum;
        float numbers[24], m[16], p[16], out;
        uint32_t size[2];
        for (k = 0; k < 24; k++) {
            uint32_t bits = random_bits();
            if (i & 1)
                memcpy(&numbers[k], &bits, sizeof bits); /* any float there is */
            else
                numbers[k] = random_float(-1, 1) * (random_range(0, 1) ? FLT_MAX : 1.0f);
        }
        for (k = 0; k < 3; k++) {
            box.min[k] = numbers[k] < numbers[k + 3] ? numbers[k] : numbers[k + 3];
            box.max[k] = numbers[k] < numbers[k + 3] ? numbers[k + 3] : numbers[k];
        }
        if (terrimp_capture_fit(&box, numbers + 6, &capture) == TERRIMP_OK) {
            note_result(terrimp_impostor_size(&capture, fabsf(numbers[9]), fabsf(numbers[10]), 1,
                                              4096, size, NULL));
            CHECK(terrimp_capture_matrices(&capture, i & 2, m, p) == TERRIMP_OK);
        }
        note_result(terrimp_view_angle(&box, numbers + 6, numbers + 9, &out));
        if (terrimp_parallax_error(&box, numbers[12], numbers + 6, numbers + 9, numbers[13],
                                   &out) == TERRIMP_OK)
            CHECK(out >= 0.0f); /* a bound, if an infinite one: not a NaN */
        if (terrimp_impostor_lifetime(numbers[14], numbers[15], numbers[16], &out) == TERRIMP_OK)
            CHECK(out >= 0.0f);
        memset(&camera, 0, sizeof camera);
        memcpy(camera.eye, numbers, sizeof camera.eye);
        memcpy(camera.forward, numbers + 3, sizeof camera.forward);
        memcpy(camera.up, numbers + 6, sizeof camera.up);
        camera.fov_y_rad = numbers[9];
        camera.width_px = random_range(0, 4000);
        camera.height_px = random_range(0, 4000);
        camera.z_near = numbers[10];
        camera.z_far = numbers[11];
        if (terrimp_camera_resolve(&camera, &resolved) == TERRIMP_OK) {
            CHECK(terrimp_camera_matrices(&camera, m, p) == TERRIMP_OK);
            CHECK(terrimp_camera_frustum(&camera, &frustum) == TERRIMP_OK);
            (void)terrimp_frustum_test(&frustum, &box, TERRIMP_PLANES_ALL);
        }
        (void)terrimp_box_distance(&box, numbers + 17);
        (void)terrimp_box_farthest(&box, numbers + 17);
    }
}

/* ---- atlas ---- */

static void atlas_functions_refuse(void)
{
    terrimp_rect rects[5], copy[5];
    uint32_t order[10], i;
    float scale;
    memset(rects, 0, sizeof rects);
    for (i = 0; i < 5u; i++)
        rects[i].width = rects[i].height = 1;
    memcpy(copy, rects, sizeof rects);
    REFUSES(TERRIMP_E_NULL, scale, terrimp_pack_ffdh(2, 2, NULL, 5, order, &scale));
    REFUSES(TERRIMP_E_NULL, scale, terrimp_pack_ffdh(2, 2, rects, 5, NULL, &scale));
    REFUSES(TERRIMP_E_RANGE, scale, terrimp_pack_ffdh(0, 2, rects, 5, order, &scale));
    REFUSES(TERRIMP_E_RANGE, scale, terrimp_pack_ffdh(2, 0, rects, 5, order, &scale));
    REFUSES(TERRIMP_E_RANGE, scale, terrimp_pack_ffdh(65537, 2, rects, 5, order, &scale));
    REFUSES(TERRIMP_E_RANGE, scale, terrimp_pack_ffdh(2, 0xffffffffu, rects, 5, order, &scale));
    CHECK(memcmp(rects, copy, sizeof rects) == 0);
    REFUSES(TERRIMP_E_CAPACITY, scale, terrimp_pack_ffdh(2, 2, rects, 5, order, &scale));
    for (i = 0; i < 5u; i++)
        CHECK(rects[i].width == 1 && rects[i].height == 1);
}

/* ---- terrain ---- */

/* All that take a terrain descriptor refuse it alike. */
static void check_terrain_refused(terrimp_result wanted, const terrimp_terrain_desc *desc)
{
    static double memory[4096];
    terrimp_terrain_desc out;
    terrimp_terrain *terrain;
    REFUSES(wanted, out, terrimp_terrain_desc_resolve(desc, &out));
    REFUSES(wanted, terrain, terrimp_terrain_init(desc, memory, sizeof memory, &terrain));
    REFUSES(wanted, terrain, terrimp_terrain_create(desc, NULL, &terrain));
    CHECK(terrimp_terrain_bytes(desc) == 0 && terrimp_terrain_scratch_bytes(desc) == 0);
}

static void terrain_descriptors_are_refused(void)
{
    terrimp_terrain_desc good, bad;
    terrimp_terrain *terrain;
    terrimp_allocator allocator;
    int i;
    memset(&good, 0, sizeof good);
    good_field(&good.field);
    check_terrain_refused(TERRIMP_E_NULL, NULL);
    GIVES(TERRIMP_E_NULL, terrimp_terrain_desc_resolve(&good, NULL));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_create(&good, NULL, NULL));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_init(&good, NULL, 0, NULL));
    REFUSES(TERRIMP_E_NULL, terrain, terrimp_terrain_init(&good, NULL, 1u << 20, &terrain));
    memset(&allocator, 0, sizeof allocator);
    REFUSES(TERRIMP_E_NULL, terrain, terrimp_terrain_create(&good, &allocator, &terrain));
    bad = good;
    bad.field.samples = NULL;
    check_terrain_refused(TERRIMP_E_NULL, &bad);
    bad = good;
    bad.field.width = 1;
    check_terrain_refused(TERRIMP_E_RANGE, &bad);
    for (i = 0; i < 3; i++) {
        bad = good;
        bad.proud = not_finite(i);
        check_terrain_refused(TERRIMP_E_NOT_FINITE, &bad);
        bad = good;
        bad.field.spacing_x = not_finite(i);
        check_terrain_refused(TERRIMP_E_NOT_FINITE, &bad);
    }
    bad = good;
    bad.proud = -0.1f;
    check_terrain_refused(TERRIMP_E_RANGE, &bad);
    bad.proud = 1.1f;
    check_terrain_refused(TERRIMP_E_RANGE, &bad);
    bad = good;
    bad.chunk_quads = 1;
    check_terrain_refused(TERRIMP_E_RANGE, &bad);
    bad.chunk_quads = 130;
    check_terrain_refused(TERRIMP_E_RANGE, &bad);
    bad = good;
    bad.triangle_budget = 15;
    check_terrain_refused(TERRIMP_E_RANGE, &bad);
    bad.triangle_budget = 401;
    check_terrain_refused(TERRIMP_E_RANGE, &bad);
    bad.triangle_budget = 0xffffffffu;
    check_terrain_refused(TERRIMP_E_RANGE, &bad);
}

/* Samples that are no heights are found before anything is built from them. */
static void terrains_of_bad_samples_are_refused(void)
{
    terrimp_terrain_desc desc;
    terrimp_terrain *terrain;
    int i;
    memset(&desc, 0, sizeof desc);
    good_field(&desc.field);
    for (i = 0; i < 3; i++) {
        flat_samples[19] = not_finite(i);
        REFUSES(TERRIMP_E_NOT_FINITE, terrain, terrimp_terrain_create(&desc, NULL, &terrain));
    }
    flat_samples[19] = -99.0f;
    desc.field.has_no_data = 1;
    desc.field.no_data = -99.0f;
    REFUSES(TERRIMP_E_VOID, terrain, terrimp_terrain_create(&desc, NULL, &terrain));
    for (i = 0; i < 20; i++)
        flat_samples[i] = i % 2 ? 3e38f : -3e38f; /* finite: built, or refused, but no harm */
    desc.field.has_no_data = 0;
    if (terrimp_terrain_create(&desc, NULL, &terrain) == TERRIMP_OK)
        terrimp_terrain_destroy(terrain);
}

static void terrains_are_not_read_before_they_are_built(void)
{
    static double memory[8192], scratch[65536];
    terrimp_terrain_desc desc;
    terrimp_terrain *terrain = NULL;
    terrimp_terrain_info info;
    terrimp_mesh_info mesh;
    terrimp_box box;
    terrimp_view *view;
    terrimp_view_desc view_desc, view_out;
    terrimp_rect rect;
    uint32_t count;
    float xyz[75]; /* enough for the ground of a node, and too little for all meshes */
    uint16_t indices[600];
    memset(&desc, 0, sizeof desc);
    memset(&view_desc, 0, sizeof view_desc);
    good_field(&desc.field);
    desc.chunk_quads = 4;
    CHECK(terrimp_terrain_bytes(&desc) <= sizeof memory);
    CHECK(terrimp_terrain_scratch_bytes(&desc) <= sizeof scratch);
    GIVES(TERRIMP_OK, terrimp_terrain_init(&desc, memory, sizeof memory, &terrain));
    REFUSES(TERRIMP_E_STATE, info, terrimp_terrain_get_info(terrain, &info));
    REFUSES(TERRIMP_E_STATE, box, terrimp_terrain_get_box(terrain, 0, &box));
    REFUSES(TERRIMP_E_STATE, mesh, terrimp_terrain_get_mesh(terrain, 0, &mesh));
    REFUSES(TERRIMP_E_STATE, indices, terrimp_terrain_fill_indices(terrain, indices, 600));
    REFUSES(TERRIMP_E_STATE, xyz, terrimp_terrain_fill_ground(terrain, 0, xyz, 75));
    REFUSES(TERRIMP_E_STATE, xyz, terrimp_terrain_fill_meshes(terrain, xyz, 75, indices, 600));
    REFUSES(TERRIMP_E_STATE, view_out, terrimp_view_desc_resolve(terrain, &view_desc, &view_out));
    REFUSES(TERRIMP_E_STATE, view, terrimp_view_create(terrain, &view_desc, NULL, &view));
    REFUSES(TERRIMP_E_STATE, view, terrimp_view_init(terrain, &view_desc, memory, 9, &view));
    CHECK(terrimp_view_bytes(terrain, &view_desc) == 0);
    REFUSES(TERRIMP_E_STATE, xyz, terrimp_terrain_fill_mesh(terrain, 0, xyz, 75, indices, 600));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_fill_mesh(terrain, 0, NULL, 75, indices, 600));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_fill_morph(terrain, 0, NULL, 25));
    memset(&rect, 0, sizeof rect);
    rect.width = rect.height = 1;
    REFUSES(TERRIMP_E_STATE, count, terrimp_terrain_touched(terrain, &rect, 0, NULL, 0, &count));
    GIVES(TERRIMP_E_STATE, terrimp_terrain_build_finish(terrain));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_build_begin(NULL));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_build_finish(NULL));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_build(NULL, scratch, sizeof scratch));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_build(terrain, NULL, sizeof scratch));
    GIVES(TERRIMP_E_MEMORY, terrimp_terrain_build(terrain, scratch, 0));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_build_node(NULL, 0, scratch, sizeof scratch));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_build_node(terrain, 0, NULL, sizeof scratch));
    GIVES(TERRIMP_E_RANGE, terrimp_terrain_build_node(terrain, 4, scratch, sizeof scratch));
    GIVES(TERRIMP_E_RANGE,
          terrimp_terrain_build_node(terrain, 0xffffffffu, scratch, sizeof scratch));
    GIVES(TERRIMP_OK, terrimp_terrain_build(terrain, scratch, sizeof scratch));

    GIVES(TERRIMP_E_NULL, terrimp_terrain_get_info(terrain, NULL));
    REFUSES(TERRIMP_E_NULL, info, terrimp_terrain_get_info(NULL, &info));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_get_box(terrain, 0, NULL));
    REFUSES(TERRIMP_E_NULL, box, terrimp_terrain_get_box(NULL, 0, &box));
    REFUSES(TERRIMP_E_RANGE, box, terrimp_terrain_get_box(terrain, 5, &box));
    REFUSES(TERRIMP_E_RANGE, box, terrimp_terrain_get_box(terrain, 0xffffffffu, &box));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_get_mesh(terrain, 0, NULL));
    REFUSES(TERRIMP_E_NULL, mesh, terrimp_terrain_get_mesh(NULL, 0, &mesh));
    REFUSES(TERRIMP_E_RANGE, mesh, terrimp_terrain_get_mesh(terrain, 4, &mesh));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_fill_indices(terrain, NULL, 600));
    REFUSES(TERRIMP_E_NULL, indices, terrimp_terrain_fill_indices(NULL, indices, 600));
    REFUSES(TERRIMP_E_CAPACITY, indices, terrimp_terrain_fill_indices(terrain, indices, 5));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_fill_ground(terrain, 0, NULL, 75));
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_terrain_fill_ground(NULL, 0, xyz, 75));
    REFUSES(TERRIMP_E_RANGE, xyz, terrimp_terrain_fill_ground(terrain, 4, xyz, 75));
    REFUSES(TERRIMP_E_CAPACITY, xyz, terrimp_terrain_fill_ground(terrain, 0, xyz, 74));
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_terrain_fill_meshes(NULL, xyz, 75, indices, 600));
    REFUSES(TERRIMP_E_NULL, indices, terrimp_terrain_fill_meshes(terrain, NULL, 75, indices, 600));
    REFUSES(TERRIMP_E_NULL, xyz, terrimp_terrain_fill_meshes(terrain, xyz, 75, NULL, 600));
    REFUSES(TERRIMP_E_CAPACITY, xyz, terrimp_terrain_fill_meshes(terrain, xyz, 74, indices, 600));
    REFUSES(TERRIMP_E_CAPACITY, xyz, terrimp_terrain_fill_meshes(terrain, xyz, 75, indices, 0));
}

static void bakes_are_refused(void)
{
    static double memory[8192], other[8192];
    unsigned char *bytes = (unsigned char *)memory, *odd = (unsigned char *)other + 1;
    terrimp_terrain_desc desc;
    terrimp_terrain *terrain = NULL, *opened;
    terrimp_bake_info info;
    terrimp_heightfield field;
    size_t size;
    memset(&desc, 0, sizeof desc);
    good_field(&desc.field);
    CHECK(terrimp_bake_bytes(NULL) == 0);
    GIVES(TERRIMP_OK, terrimp_terrain_init(&desc, memory, sizeof memory, &terrain));
    CHECK(terrimp_bake_bytes(terrain) == 0);
    GIVES(TERRIMP_E_STATE, terrimp_bake_write(terrain, other, sizeof other, 0));
    GIVES(TERRIMP_OK, terrimp_terrain_create(&desc, NULL, &terrain));
    size = terrimp_bake_bytes(terrain);
    CHECK(size > 0 && size < sizeof memory);
    GIVES(TERRIMP_E_NULL, terrimp_bake_write(NULL, other, sizeof other, 0));
    GIVES(TERRIMP_E_NULL, terrimp_bake_write(terrain, NULL, sizeof other, 0));
    REFUSES(TERRIMP_E_CAPACITY, other, terrimp_bake_write(terrain, other, size - 1u, 1));
    REFUSES(TERRIMP_E_ALIGN, other, terrimp_bake_write(terrain, odd, size, 0));
    GIVES(TERRIMP_OK, terrimp_bake_write(terrain, memory, size, 0));
    field = desc.field;
    field.samples = NULL;

    REFUSES(TERRIMP_E_NULL, info, terrimp_bake_check(NULL, size, NULL, &info));
    REFUSES(TERRIMP_E_ALIGN, info, terrimp_bake_check(bytes + 1, size, NULL, &info));
    REFUSES(TERRIMP_E_BAKE, info, terrimp_bake_check(memory, 0, NULL, &info));
    REFUSES(TERRIMP_E_BAKE, info, terrimp_bake_check(memory, size - 1u, NULL, &info));
    REFUSES(TERRIMP_E_NULL, info, terrimp_bake_check(memory, size, &field, &info));
    field = desc.field;
    field.height_offset += 1.0f;
    REFUSES(TERRIMP_E_BAKE, info, terrimp_bake_check(memory, size, &field, &info));
    REFUSES(TERRIMP_E_NULL, opened, terrimp_terrain_open(NULL, memory, size, other, 8192, &opened));
    REFUSES(TERRIMP_E_NULL, opened,
            terrimp_terrain_open(&desc.field, NULL, size, other, 8192, &opened));
    REFUSES(TERRIMP_E_NULL, opened,
            terrimp_terrain_open(&desc.field, memory, size, NULL, 8192, &opened));
    GIVES(TERRIMP_E_NULL, terrimp_terrain_open(&desc.field, memory, size, other, 8192, NULL));
    REFUSES(TERRIMP_E_ALIGN, opened,
            terrimp_terrain_open(&desc.field, memory, size, odd, 8192, &opened));
    REFUSES(TERRIMP_E_MEMORY, opened,
            terrimp_terrain_open(&desc.field, memory, size, other,
                                 terrimp_terrain_open_bytes() - 1u, &opened));
    bytes[20]++;
    REFUSES(TERRIMP_E_BAKE, opened,
            terrimp_terrain_open(&desc.field, memory, size, other, 8192, &opened));
    bytes[20]--;
    GIVES(TERRIMP_OK, terrimp_bake_write(terrain, memory, size, 1));
    REFUSES(TERRIMP_E_ORDER, opened,
            terrimp_terrain_open(&desc.field, memory, size, other, 8192, &opened));
    terrimp_terrain_destroy(terrain);
}

/* ---- views ---- */

static void count_call(void *user)
{
    ++*(int *)user;
}

static void count_capture(void *user, const terrimp_capture_command *command)
{
    (void)command;
    count_call(user);
}

static void count_impostor(void *user, const terrimp_impostor_command *command)
{
    (void)command;
    count_call(user);
}

static void count_ground(void *user, const terrimp_ground_command *command)
{
    (void)command;
    count_call(user);
}

static void check_view_refused(terrimp_result wanted, const terrimp_terrain *terrain,
                               const terrimp_view_desc *desc)
{
    static double memory[64];
    terrimp_view_desc out;
    terrimp_view *view;
    REFUSES(wanted, out, terrimp_view_desc_resolve(terrain, desc, &out));
    REFUSES(wanted, view, terrimp_view_init(terrain, desc, memory, sizeof memory, &view));
    REFUSES(wanted, view, terrimp_view_create(terrain, desc, NULL, &view));
    CHECK(terrimp_view_bytes(terrain, desc) == 0);
}

/* A number that a view's descriptor holds, with the limits that its comment names. */
typedef struct view_number {
    size_t offset;
    float low, high;
} view_number;

static float *view_float(terrimp_view_desc *d, const view_number *number)
{
    return (float *)(void *)((char *)d + number->offset);
}

/* Every number refuses what is not finite, negative or outside of its limits, and takes what is
   just inside. */
static void check_view_numbers(const land *l)
{
    static const view_number numbers[] = {
        {offsetof(terrimp_view_desc, tolerance_px), 0.05f, 100.0f},
        {offsetof(terrimp_view_desc, ground_tolerance_px), 0.05f, 100.0f},
        {offsetof(terrimp_view_desc, morph_ratio), 1.0f, 4.0f},
        {offsetof(terrimp_view_desc, fade_start), 1e-30f, 1e30f},
        {offsetof(terrimp_view_desc, fade_end), 1e3f, 1e30f},
        {offsetof(terrimp_view_desc, max_angle_rad), 0.001f, 1.5f},
        {offsetof(terrimp_view_desc, texels_per_px), 0.1f, 8.0f},
        {offsetof(terrimp_view_desc, impostor_px), 8.0f, 4096.0f},
        {offsetof(terrimp_view_desc, costs.draw), 0.0f, 1e30f},
        {offsetof(terrimp_view_desc, costs.triangle), 0.0f, 1e30f},
        {offsetof(terrimp_view_desc, costs.ground_px), 0.0f, 1e30f},
        {offsetof(terrimp_view_desc, costs.impostor_px), 0.0f, 1e30f},
        {offsetof(terrimp_view_desc, costs.capture), 0.0f, 1e30f}};
    terrimp_view_desc good, bad, out;
    size_t n;
    int i;
    memset(&good, 0, sizeof good);
    for (n = 0; n < sizeof numbers / sizeof numbers[0]; n++) {
        const view_number *number = &numbers[n];
        for (i = 0; i < 3; i++) {
            bad = good;
            *view_float(&bad, number) = not_finite(i);
            check_view_refused(TERRIMP_E_NOT_FINITE, l->terrain, &bad);
        }
        bad = good;
        *view_float(&bad, number) = -1.0f;
        check_view_refused(TERRIMP_E_RANGE, l->terrain, &bad);
        *view_float(&bad, number) = number->low * 0.999f;
        if (number->low > 1e-20f && number->low < 1e2f)
            check_view_refused(TERRIMP_E_RANGE, l->terrain, &bad);
        *view_float(&bad, number) = number->high * 1.001f;
        if (number->high < 1e20f)
            check_view_refused(TERRIMP_E_RANGE, l->terrain, &bad);
        *view_float(&bad, number) = number->low;
        GIVES(TERRIMP_OK, terrimp_view_desc_resolve(l->terrain, &bad, &out));
        *view_float(&bad, number) = number->high;
        GIVES(TERRIMP_OK, terrimp_view_desc_resolve(l->terrain, &bad, &out));
    }
}

static void view_descriptors_are_refused(void)
{
    land l;
    terrimp_view_desc good, bad;
    terrimp_allocator allocator;
    terrimp_view *view;
    int i;
    make_hills(&l);
    memset(&good, 0, sizeof good);
    memset(&allocator, 0, sizeof allocator);
    if (land_build(&l)) {
        check_view_refused(TERRIMP_E_NULL, NULL, &good);
        check_view_refused(TERRIMP_E_NULL, l.terrain, NULL);
        GIVES(TERRIMP_E_NULL, terrimp_view_desc_resolve(l.terrain, &good, NULL));
        GIVES(TERRIMP_E_NULL, terrimp_view_create(l.terrain, &good, NULL, NULL));
        GIVES(TERRIMP_E_NULL, terrimp_view_init(l.terrain, &good, NULL, 0, NULL));
        REFUSES(TERRIMP_E_NULL, view, terrimp_view_init(l.terrain, &good, NULL, 1u << 30, &view));
        REFUSES(TERRIMP_E_NULL, view, terrimp_view_create(l.terrain, &good, &allocator, &view));
        check_view_numbers(&l);
        for (i = 0; i < 14; i++) {
            bad = good;
            switch (i) {
            case 0: bad.mode = -1; break;
            case 1: bad.mode = TERRIMP_MODE_COUNT; break;
            case 2: bad.ground_rule = -1; break;
            case 3: bad.ground_rule = TERRIMP_GEOMIP_RULE_COUNT; break;
            case 4: bad.fade_start = bad.fade_end = 5.0f; break;
            case 5: bad.fade_start = 3.3e38f; break; /* the default of fade_end overflows */
            case 6: bad.atlas_size = 63; break;
            case 7: bad.atlas_size = 32769; break;
            case 8: bad.atlas_count = 17; break;
            case 9: bad.max_impostors = 65535; break;
            case 10: bad.max_impostors = 0xffffffffu; break;
            case 11: bad.max_captures = 1025; break;
            case 12: bad.ground_rule = TERRIMP_GEOMIP_BOUND; break; /* without its bound */
            default: bad.max_captures = 0xffffffffu; break;
            }
            check_view_refused(TERRIMP_E_RANGE, l.terrain, &bad);
        }
    }
    land_free(&l);
}

static terrimp_callbacks counting_callbacks(int *calls)
{
    terrimp_callbacks all;
    memset(&all, 0, sizeof all); /* the floor may be left out */
    all.user = calls;
    all.begin_capture = all.end_capture = count_capture;
    all.draw_impostor = count_impostor;
    all.draw_ground = count_ground;
    return all;
}

/* A callback that is needed is missing: nothing is called. */
static void check_missing_callbacks(terrimp_view *view, const terrimp_callbacks *all)
{
    int i;
    for (i = 0; i < 4; i++) {
        terrimp_callbacks some = *all;
        if (i == 0)
            some.begin_capture = NULL;
        if (i == 1)
            some.end_capture = NULL;
        if (i == 2)
            some.draw_impostor = NULL;
        if (i == 3)
            some.draw_ground = NULL;
        GIVES(TERRIMP_E_NULL, terrimp_view_render(view, &some));
    }
    CHECK(*(int *)all->user == 0);
}

/* No light is taken from a view that is given a wrong one. */
static void bad_light(terrimp_view *view)
{
    const float up[3] = {0.0f, 1.0f, 0.0f}, zero[3] = {0.0f, 0.0f, 0.0f};
    float wrong[3] = {0.0f, 1.0f, 0.0f};
    int i;
    GIVES(TERRIMP_E_NULL, terrimp_view_light(NULL, up, 0.0f));
    GIVES(TERRIMP_E_RANGE, terrimp_view_light(view, zero, 0.0f));
    GIVES(TERRIMP_E_RANGE, terrimp_view_light(view, up, 0.0009f));
    GIVES(TERRIMP_E_RANGE, terrimp_view_light(view, up, 3.2f));
    for (i = 0; i < 3; i++) {
        wrong[2] = not_finite(i);
        GIVES(TERRIMP_E_NOT_FINITE, terrimp_view_light(view, wrong, 0.0f));
        GIVES(TERRIMP_E_NOT_FINITE, terrimp_view_light(view, up, not_finite(i)));
    }
    GIVES(TERRIMP_OK, terrimp_view_light(view, up, 3.1f));
    GIVES(TERRIMP_OK, terrimp_view_light(view, NULL, 0.0f));
}

/* Cameras at the ends of what is allowed, and beyond. */
static void check_huge_cameras(terrimp_view *view, const terrimp_callbacks *all,
                               const terrimp_camera *camera)
{
    int i;
    for (i = 0; i < 12; i++) {
        terrimp_camera bad = *camera;
        bad.eye[i % 3] = i % 2 ? 1e18f : -1e18f;
        bad.forward[0] = i % 2 ? -1e-38f : 3e38f;
        bad.z_near = i % 4 ? 1e-30f : 1.0f;
        bad.z_far = 1e18f;
        GIVES(TERRIMP_OK, terrimp_view_update(view, &bad));
        GIVES(TERRIMP_OK, terrimp_view_render(view, all));
        bad.eye[i % 3] *= 1.001f;
        GIVES(TERRIMP_E_RANGE, terrimp_view_update(view, &bad));
        bad = *camera;
        bad.z_far = 1.001e18f; /* without a far plane */
        GIVES(TERRIMP_OK, terrimp_view_update(view, &bad));
        GIVES(TERRIMP_OK, terrimp_view_render(view, all));
    }
}

static void check_view_refuses(const land *l, terrimp_view *view, int mode)
{
    int calls = 0;
    terrimp_callbacks all = counting_callbacks(&calls);
    terrimp_camera camera = camera_beside(l), bad;
    terrimp_stats stats;
    GIVES(TERRIMP_E_STATE, terrimp_view_render(view, &all));
    REFUSES(TERRIMP_E_STATE, stats, terrimp_view_get_stats(view, &stats));
    GIVES(TERRIMP_E_NULL, terrimp_view_update(NULL, &camera));
    GIVES(TERRIMP_E_NULL, terrimp_view_update(view, NULL));
    bad = camera;
    bad.z_near = 0.0f;
    GIVES(TERRIMP_E_RANGE, terrimp_view_update(view, &bad));
    bad = camera;
    bad.eye[1] = not_finite(0);
    GIVES(TERRIMP_E_NOT_FINITE, terrimp_view_update(view, &bad));
    GIVES(TERRIMP_E_STATE, terrimp_view_render(view, &all)); /* still before the first update */
    GIVES(TERRIMP_OK, terrimp_view_update(view, &camera));
    GIVES(TERRIMP_OK, terrimp_view_get_stats(view, &stats));
    if (mode == TERRIMP_MODE_IMPOSTOR) {
        CHECK(stats.captures > 0 && stats.impostors > 0);
        check_missing_callbacks(view, &all);
    }
    GIVES(TERRIMP_E_NULL, terrimp_view_render(NULL, &all));
    GIVES(TERRIMP_E_NULL, terrimp_view_render(view, NULL));
    memset(&bad, 0, sizeof bad);
    GIVES(TERRIMP_E_RANGE, terrimp_view_update(view, &bad));
    CHECK(calls == 0);
    GIVES(TERRIMP_OK, terrimp_view_render(view, &all)); /* the frame before has stayed */
    CHECK(calls > 3);
    REFUSES(TERRIMP_E_NULL, stats, terrimp_view_get_stats(NULL, &stats));
    GIVES(TERRIMP_E_NULL, terrimp_view_get_stats(view, NULL));
    GIVES(TERRIMP_E_NULL, terrimp_view_invalidate(NULL));
    GIVES(TERRIMP_E_NULL, terrimp_view_touch(NULL, 0, 0, 1, 1));
    GIVES(TERRIMP_E_NULL, terrimp_view_drop(NULL, 0));
    GIVES(TERRIMP_E_NULL, terrimp_view_expire(NULL, 0));
    GIVES(TERRIMP_E_RANGE, terrimp_view_drop(view, l->info.node_count));
    GIVES(TERRIMP_E_RANGE, terrimp_view_expire(view, l->info.node_count));
    bad_light(view);
    GIVES(TERRIMP_E_RANGE, terrimp_view_touch(view, 97, 0, 1, 1));
    GIVES(TERRIMP_E_RANGE, terrimp_view_touch(view, 0, 81, 1, 1));
    GIVES(TERRIMP_E_RANGE, terrimp_view_touch(view, 0xffffffffu, 0xffffffffu, 2, 2));
    GIVES(TERRIMP_E_RANGE, terrimp_view_touch(view, 0, 0, 0, 1));
    GIVES(TERRIMP_E_RANGE, terrimp_view_touch(view, 0, 0, 1, 0));
    GIVES(TERRIMP_OK, terrimp_view_render(view, &all)); /* nothing has been touched */
    GIVES(TERRIMP_OK, terrimp_view_touch(view, 96, 80, 0xffffffffu, 0xffffffffu));
    check_huge_cameras(view, &all, &camera);
}

static void views_refuse(void)
{
    land l;
    terrimp_view_desc desc;
    make_hills(&l);
    memset(&desc, 0, sizeof desc);
    if (land_build(&l))
        for (desc.mode = TERRIMP_MODE_FULL; desc.mode < TERRIMP_MODE_COUNT; desc.mode++) {
            terrimp_view *view = NULL;
            GIVES(TERRIMP_OK, terrimp_view_create(l.terrain, &desc, NULL, &view));
            if (view)
                check_view_refuses(&l, view, desc.mode);
            terrimp_view_destroy(view);
        }
    land_free(&l);
}

/* ---- what the tests above leave out, in the header's order ---- */

/* A range of heights that the descriptor names holds for every sample. */
static void samples_outside_of_the_named_range_are_refused(void)
{
    int i;
    for (i = 0; i < 5; i++) {
        land l;
        terrimp_terrain *terrain = NULL;
        land_prepare(&l, 21, 13, TERRIMP_FORMAT_F32, LAND_NOISE);
        l.desc.chunk_quads = 4;
        l.desc.height_low = -1e3f;
        l.desc.height_high = 1e3f;
        GIVES(TERRIMP_OK, terrimp_terrain_create(&l.desc, NULL, &terrain));
        terrimp_terrain_destroy(terrain);
        l.samples[random_range(0, 21 * 13 - 1)] = i < 3 ? not_finite(i) : i == 3 ? 1001.0f
                                                                                 : -1001.0f;
        GIVES(i < 3 ? TERRIMP_E_NOT_FINITE : TERRIMP_E_RANGE,
              terrimp_terrain_create(&l.desc, NULL, &terrain));
        land_free(&l);
    }
}

/* Even the coarsest ground has several nodes where the eye is in the midst of a rough terrain. */
static void too_little_room_for_ground_is_an_error(void)
{
    land l;
    terrimp_view_desc desc;
    terrimp_view *view;
    terrimp_camera camera;
    land_prepare(&l, 65, 65, TERRIMP_FORMAT_F32, LAND_NOISE);
    l.desc.chunk_quads = 8;
    memset(&desc, 0, sizeof desc);
    desc.ground_rule = TERRIMP_GEOMIP_BOUND;
    desc.bound = terrimp_geomip_bound();
    desc.max_ground = 1;
    memset(&camera, 0, sizeof camera);
    camera.eye[0] = camera.eye[2] = 32.0f;
    camera.forward[0] = 1.0f;
    camera.width_px = camera.height_px = 8000;
    camera.z_near = 0.1f;
    camera.z_far = 1000.0f;
    if (land_build(&l)) {
        CHECK(terrimp_heightfield_height(&l.desc.field, 32.0f, 32.0f, &camera.eye[1]) ==
              TERRIMP_OK);
        CHECK(terrimp_view_create(l.terrain, &desc, NULL, &view) == TERRIMP_OK);
        GIVES(TERRIMP_E_CAPACITY, terrimp_view_update(view, &camera));
        camera.eye[1] += 1e5f; /* so far away that one node will do */
        camera.z_far = 1e6f;
        camera.forward[0] = 0.0f;
        camera.forward[1] = -1.0f;
        GIVES(TERRIMP_OK, terrimp_view_update(view, &camera));
        terrimp_view_destroy(view);
    }
    land_free(&l);
}

static void geomip_functions_refuse(void)
{
    terrimp_heightfield bad;
    mip_scene s;
    terrimp_quadtree out;
    terrimp_box box;
    terrimp_geomip_weights weights[25];
    terrimp_geomip_vertex vertices[25];
    terrimp_geomip_draw draw;
    terrimp_camera camera;
    float heights[25];
    int i;
    memset(&draw, 0, sizeof draw);
    memset(vertices, 0, sizeof vertices);
    mip_make(&s, 33, 33, 4);
    bad = s.tree.field;
    bad.width = 1;
    REFUSES(TERRIMP_E_RANGE, out, terrimp_quadtree_init(&bad, 4, &out));
    REFUSES(TERRIMP_E_NULL, box, terrimp_geomip_box(NULL, 0, &box));
    REFUSES(TERRIMP_E_RANGE, box, terrimp_geomip_box(&s.tree, s.tree.node_count, &box));
    GIVES(TERRIMP_E_NULL, terrimp_geomip_build(NULL, heights));
    mip_random_camera(&s, &camera);
    for (i = 0; i < 9; i++) {
        terrimp_geomip_view view = s.view;
        float *fields[3];
        fields[0] = &view.tolerance_px;
        fields[1] = &view.morph_ratio;
        fields[2] = &view.hysteresis;
        *fields[i / 3] = not_finite(i % 3);
        GIVES(TERRIMP_E_NOT_FINITE, terrimp_geomip_select(&s.tree, &view, &camera));
    }
    s.view.rule = TERRIMP_GEOMIP_RULE_COUNT;
    GIVES(TERRIMP_E_RANGE, terrimp_geomip_select(&s.tree, &s.view, &camera));
    GIVES(TERRIMP_E_NULL, terrimp_geomip_fill_weights(4, NULL));
    REFUSES(TERRIMP_E_RANGE, weights, terrimp_geomip_fill_weights(3, weights));
    GIVES(TERRIMP_E_NULL, terrimp_geomip_morph(4, &draw, vertices, NULL, 1));
    REFUSES(TERRIMP_E_NULL, heights, terrimp_geomip_morph(4, NULL, vertices, heights, 1));
    REFUSES(TERRIMP_E_RANGE, heights, terrimp_geomip_morph(4, &draw, vertices, heights, 0));
    mip_free(&s);
}

static void pictures_are_not_tightened_or_split_by_bad_numbers(void)
{
    terrimp_box box;
    terrimp_capture capture, out;
    terrimp_split split;
    float eye[3], xyz[9];
    uint16_t indices[3] = {0, 1, 2};
    int k;
    good_capture(&box, eye, &capture);
    for (k = 0; k < 9; k++) /* in front of it */
        xyz[k] = capture.eye[k % 3] + 5.0f * capture.forward[k % 3] + 0.1f * (float)(k == 4);
    out = capture;
    CHECK(terrimpi_camera_tighten(&out, xyz, 3));
    for (k = 0; k < 3; k++)
        xyz[6 + k] = capture.eye[k] - capture.forward[k];
    CHECK(!terrimpi_camera_tighten(&out, xyz, 3));
    GIVES(TERRIMP_E_NULL, terrimp_capture_split(&capture, xyz, 3, indices, 3, 1.0f, 0.0f, NULL));
    REFUSES(TERRIMP_E_NULL, split,
            terrimp_capture_split(NULL, xyz, 3, indices, 3, 1.0f, 0.0f, &split));
    REFUSES(TERRIMP_E_NULL, split,
            terrimp_capture_split(&capture, NULL, 3, indices, 3, 1.0f, 0.0f, &split));
    REFUSES(TERRIMP_E_NULL, split,
            terrimp_capture_split(&capture, xyz, 3, NULL, 3, 1.0f, 0.0f, &split));
    REFUSES(TERRIMP_E_RANGE, split,
            terrimp_capture_split(&capture, xyz, 0, indices, 3, 1.0f, 0.0f, &split));
    REFUSES(TERRIMP_E_RANGE, split,
            terrimp_capture_split(&capture, xyz, 3, indices, 2, 1.0f, 0.0f, &split));
    REFUSES(TERRIMP_E_RANGE, split,
            terrimp_capture_split(&capture, xyz, 2, indices, 3, 1.0f, 0.0f, &split));
}

/* Runs last: a code that nothing can provoke would be a promise without a meaning. */
static void every_result_has_been_provoked(void)
{
    int i;
    note_result(TERRIMP_OK);
    for (i = 0; i < TERRIMP_RESULT_COUNT; i++) {
        if (!provoked[i])
            fprintf(stderr, "never seen: %s\n", terrimp_result_text(i));
        CHECK(provoked[i]);
    }
}

static inline void bad_input_tests(void)
{
    RUN(result_texts_are_all_different);
    RUN(heightfield_resolve_refuses);
    RUN(heightfield_queries_refuse);
    RUN(simplifier_refuses);
    RUN(cameras_are_refused);
    RUN(captures_are_refused);
    RUN(impostor_functions_refuse);
    RUN(huge_and_random_numbers_do_no_harm);
    RUN(atlas_functions_refuse);
    RUN(terrain_descriptors_are_refused);
    RUN(terrains_of_bad_samples_are_refused);
    RUN(terrains_are_not_read_before_they_are_built);
    RUN(bakes_are_refused);
    RUN(view_descriptors_are_refused);
    RUN(views_refuse);
    RUN(samples_outside_of_the_named_range_are_refused);
    RUN(too_little_room_for_ground_is_an_error);
    RUN(geomip_functions_refuse);
    RUN(pictures_are_not_tightened_or_split_by_bad_numbers);
    RUN(every_result_has_been_provoked);
}

#endif
