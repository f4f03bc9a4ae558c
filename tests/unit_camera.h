/* Laws of the camera room: cameras, frustums, boxes and fitted frustums. */
#ifndef UNIT_CAMERA_H
#define UNIT_CAMERA_H

#include "unit_oracle.h"

/* A camera at a random place with a random view. */
static void random_camera(float reach, terrimp_camera *camera)
{
    memset(camera, 0, sizeof *camera);
    random_vector(0.0f, reach, camera->eye);
    random_vector(0.5f, 2.0f, camera->forward);
    if (random_range(0, 1))
        random_vector(0.5f, 2.0f, camera->up);
    camera->fov_y_rad = random_float(0.2f, 2.4f);
    camera->width_px = random_range(1, 2000);
    camera->height_px = random_range(1, 2000);
    camera->z_near = random_float(0.01f, 2.0f);
    camera->z_far = camera->z_near + random_float(1.0f, 500.0f);
    camera->depth_zero_to_one = (int)random_range(0, 1);
}

enum { CAMERA_OFF_CENTRE, CAMERA_ORTHOGRAPHIC, CAMERA_REACH, CAMERA_KINDS };

/* Makes a camera one of another kind, which sees about as much: for an orthographic one `size` is
   that of what it looks at, and `reach` how far eyes may be apart. */
static void camera_become(terrimp_camera *camera, int kind, float size, float reach)
{
    float wide = kind == CAMERA_ORTHOGRAPHIC ? size * random_magnitude(0.02f, 1.0f)
                                             : random_magnitude(0.02f, 2.0f);
    float high = wide * random_float(0.9f, 1.1f) * (float)camera->height_px /
                 (float)camera->width_px;
    camera->orthographic = kind == CAMERA_ORTHOGRAPHIC;
    camera->reach = random_range(0, 1) || kind == CAMERA_REACH ? random_float(0.0f, reach) : 0.0f;
    memset(camera->sides, 0, sizeof camera->sides);
    if (kind == CAMERA_REACH)
        return;
    camera->sides[0] = wide * random_float(-1.0f, 0.5f);
    camera->sides[1] = camera->sides[0] + wide;
    camera->sides[2] = high * random_float(-1.0f, 0.5f);
    camera->sides[3] = camera->sides[2] + high;
    if (kind == CAMERA_ORTHOGRAPHIC) {
        camera->z_near = random_float(-2.0f, -1.0f) * size;
        camera->z_far = 4.0f * size;
    } else if (random_range(0, 1)) {
        camera->z_far = random_range(0, 1) ? 0.0f : 3e38f;
    }
}

/* A point at shares of the way between the sides, at a depth, is that far across the screen; and
   it is in the frustum, for all eyes within reach of the one that is asked. */
static void cameras_of_every_kind_place_known_points(void)
{
    int i, k;
    for (i = 0; i < 3000; i++) {
        terrimp_camera camera, c;
        terrimp_frustum frustum;
        terrimp_box point;
        float view[16], projection[16], factor, larger;
        double p[3], seen[4], clip[4], right[3], forward[3], up[3], x, y, depth, across, high, end;
        random_camera(10.0f, &camera);
        camera_become(&camera, i & 1, 100.0f, 3.0f);
        CHECK(terrimp_camera_resolve(&camera, &c) == TERRIMP_OK);
        CHECK(terrimp_camera_resolve(&c, &camera) == TERRIMP_OK);
        CHECK(memcmp(&camera, &c, sizeof c) == 0);
        CHECK(terrimp_camera_matrices(&camera, view, projection) == TERRIMP_OK);
        CHECK(terrimp_camera_pixel_factor(&c, &factor) == TERRIMP_OK);
        larger = fmaxf((float)c.width_px / (c.sides[1] - c.sides[0]),
                       (float)c.height_px / (c.sides[3] - c.sides[2]));
        CHECK(fabsf(factor - larger) < 1e-5f * larger);
        oracle_widen(c.forward, forward);
        oracle_widen(c.up, up);
        oracle_cross(forward, up, right);
        x = (double)random_float(-1.0f, 1.0f);
        y = (double)random_float(-1.0f, 1.0f);
        end = (double)(c.z_far < 1e18f ? c.z_far : 1000.0f * c.z_near);
        depth = (double)c.z_near + (end - (double)c.z_near) * (double)random_float(0.01f, 0.99f);
        across = (double)c.sides[0] + 0.5 * (x + 1.0) * (double)(c.sides[1] - c.sides[0]);
        high = (double)c.sides[2] + 0.5 * (y + 1.0) * (double)(c.sides[3] - c.sides[2]);
        for (k = 0; k < 3; k++)
            p[k] = (double)c.eye[k] + depth * forward[k] +
                   (c.orthographic ? 1.0 : depth) * (across * right[k] + high * up[k]);
        oracle_transform(view, p, seen);
        oracle_transform4(projection, seen, clip);
        CHECK(fabs(clip[0] / clip[3] - x) < 1e-2 && fabs(clip[1] / clip[3] - y) < 1e-2);
        CHECK(clip[2] <= clip[3] && clip[2] >= (c.depth_zero_to_one ? 0.0 : -clip[3]));
        if (fabs(x) > 0.99 || fabs(y) > 0.99)
            continue;
        for (k = 0; k < 3; k++)
            point.min[k] = point.max[k] = (float)p[k];
        CHECK(terrimp_camera_frustum(&c, &frustum) == TERRIMP_OK);
        CHECK(terrimp_frustum_test(&frustum, &point, TERRIMP_PLANES_ALL) == 0);
        random_vector(0.0f, c.reach, c.eye); /* the same seen from an eye within reach */
        for (k = 0; k < 3; k++)
            c.eye[k] = camera.eye[k] + c.eye[k] * 0.999f;
        CHECK(terrimp_camera_frustum(&c, &frustum) == TERRIMP_OK);
        CHECK(terrimp_frustum_test(&frustum, &point, TERRIMP_PLANES_ALL) !=
              TERRIMP_PLANES_OUTSIDE);
    }
}

static void camera_defaults_are_those_of_the_table(void)
{
    terrimp_camera camera, out;
    memset(&camera, 0, sizeof camera);
    camera.eye[0] = 7.0f;
    camera.forward[2] = -3.0f;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.z_near = 0.5f;
    camera.z_far = 900.0f;
    camera.depth_zero_to_one = 1;
    CHECK(terrimp_camera_resolve(&camera, &out) == TERRIMP_OK);
    CHECK(out.eye[0] == 7.0f && out.eye[1] == 0.0f && out.eye[2] == 0.0f);
    CHECK(out.forward[0] == 0.0f && out.forward[1] == 0.0f && out.forward[2] == -1.0f);
    CHECK(out.up[0] == 0.0f && out.up[1] == 1.0f && out.up[2] == 0.0f);
    CHECK(fabs((double)out.fov_y_rad - oracle_pi / 3.0) < 1e-7);
    CHECK(out.width_px == 640 && out.height_px == 480);
    CHECK(out.z_near == 0.5f && out.z_far == 900.0f && out.depth_zero_to_one == 1);
    CHECK(terrimp_camera_resolve(&camera, &camera) == TERRIMP_OK); /* in place */
    CHECK(memcmp(&camera, &out, sizeof out) == 0);
    CHECK(terrimp_camera_resolve(&out, &camera) == TERRIMP_OK); /* resolved stays resolved */
    CHECK(memcmp(&camera, &out, sizeof out) == 0);
}

static void camera_limits_are_accepted_at_their_ends(void)
{
    terrimp_camera camera, out;
    random_camera(1.0f, &camera);
    camera.fov_y_rad = 0.001f;
    CHECK(terrimp_camera_resolve(&camera, &out) == TERRIMP_OK);
    camera.fov_y_rad = 3.1f;
    camera.width_px = 1;
    camera.height_px = 65536;
    CHECK(terrimp_camera_resolve(&camera, &out) == TERRIMP_OK);
    camera.width_px = 65536;
    camera.height_px = 1;
    CHECK(terrimp_camera_resolve(&camera, &out) == TERRIMP_OK);
}

static void camera_axes_are_orthonormal(void)
{
    int i, k;
    for (i = 0; i < 2000; i++) {
        terrimp_camera camera, out, again;
        double wanted[3], forward[3], up[3];
        random_camera(1.0f, &camera);
        for (k = 0; k < 3; k++)
            camera.forward[k] *= i % 3 == 1 ? 1e-30f : i % 3 == 2 ? 1e30f : 1.0f;
        if (i % 5 == 0)
            memcpy(camera.up, camera.forward, sizeof camera.up);
        if (i % 7 == 0) {
            camera.forward[0] = camera.forward[2] = 0.0f; /* straight up or down, up the default */
            camera.forward[1] = i % 2 ? 1.0f : -1.0f;
            camera.up[0] = camera.up[1] = camera.up[2] = 0.0f;
        }
        CHECK(terrimp_camera_resolve(&camera, &out) == TERRIMP_OK);
        CHECK(terrimp_camera_resolve(&out, &again) == TERRIMP_OK); /* resolved stays resolved */
        CHECK(memcmp(&again, &out, sizeof out) == 0);
        oracle_widen(camera.forward, wanted);
        oracle_widen(out.forward, forward);
        oracle_widen(out.up, up);
        CHECK(oracle_angle(wanted, forward) < 1e-6);
        CHECK(fabs(oracle_length(forward) - 1.0) < 1e-6);
        CHECK(fabs(oracle_length(up) - 1.0) < 1e-6);
        CHECK(fabs(oracle_dot(forward, up)) < 1e-6);
    }
}

/* The up that is used lies in the plane of forward and the one that was asked for, on its side. */
static void camera_up_leans_towards_the_wanted_one(void)
{
    int i;
    for (i = 0; i < 2000; i++) {
        terrimp_camera camera, out;
        double forward[3], wanted[3], up[3], side[3];
        random_camera(1.0f, &camera);
        random_vector(0.5f, 2.0f, camera.up);
        CHECK(terrimp_camera_resolve(&camera, &out) == TERRIMP_OK);
        oracle_widen(out.forward, forward);
        oracle_widen(camera.up, wanted);
        oracle_widen(out.up, up);
        oracle_cross(forward, wanted, side);
        if (oracle_length(side) < 0.05)
            continue;
        CHECK(oracle_dot(up, wanted) > 0.0);
        CHECK(fabs(oracle_dot(up, side)) < 1e-5 * oracle_length(side) / 0.05);
    }
}

static void camera_matrices_place_known_points(void)
{
    int i, k, corner;
    for (i = 0; i < 1000; i++) {
        terrimp_camera camera, c;
        float view[16], projection[16];
        double eye[3], forward[3], up[3], right[3], tan_y, tan_x;
        random_camera(10.0f, &camera);
        camera.z_far = camera.z_near * random_float(1.5f, 1000.0f);
        CHECK(terrimp_camera_resolve(&camera, &c) == TERRIMP_OK);
        CHECK(terrimp_camera_matrices(&camera, view, projection) == TERRIMP_OK);
        oracle_widen(c.eye, eye);
        oracle_widen(c.forward, forward);
        oracle_widen(c.up, up);
        oracle_cross(forward, up, right); /* right-handed */
        tan_y = tan((double)c.fov_y_rad * 0.5);
        tan_x = tan_y * (double)c.width_px / (double)c.height_px;
        for (corner = 0; corner < 8; corner++) {
            double depth = (double)((corner & 4) ? c.z_far : c.z_near);
            double x = (corner & 1) ? 1.0 : -1.0, y = (corner & 2) ? 1.0 : -1.0;
            double least = c.depth_zero_to_one ? 0.0 : -1.0, p[3], seen[4], clip[4];
            double reach = (20.0 + depth) / depth * (1.0 + 1.0 / tan_y + 1.0 / tan_x);
            double slack = 1e-5 * (1.0 + reach);
            for (k = 0; k < 3; k++)
                p[k] = eye[k] + depth * (forward[k] + x * tan_x * right[k] + y * tan_y * up[k]);
            oracle_transform(view, p, seen);
            oracle_transform4(projection, seen, clip);
            CHECK(fabs(seen[2] + depth) <= slack * depth);
            CHECK(fabs(clip[3] - depth) <= slack * depth);
            CHECK(fabs(clip[0] / clip[3] - x) <= slack);
            CHECK(fabs(clip[1] / clip[3] - y) <= slack);
            CHECK(fabs(clip[2] / clip[3] - ((corner & 4) ? 1.0 : least)) <= slack * 2.0);
        }
    }
}

/* The view matrix turns and moves, nothing else: it keeps lengths and handedness. */
static void camera_view_matrix_is_rigid(void)
{
    int i, a, b;
    for (i = 0; i < 1000; i++) {
        terrimp_camera camera;
        float view[16], projection[16];
        double axis[3][3], across[3], eye[3], seen[4];
        random_camera(100.0f, &camera);
        CHECK(terrimp_camera_matrices(&camera, view, projection) == TERRIMP_OK);
        for (a = 0; a < 3; a++)
            oracle_widen(view + a * 4, axis[a]);
        for (a = 0; a < 3; a++)
            for (b = 0; b < 3; b++)
                CHECK(fabs(oracle_dot(axis[a], axis[b]) - (a == b ? 1.0 : 0.0)) < 2e-6);
        oracle_cross(axis[0], axis[1], across);
        CHECK(oracle_dot(across, axis[2]) > 0.99);
        CHECK(view[3] == 0.0f && view[7] == 0.0f && view[11] == 0.0f && view[15] == 1.0f);
        oracle_widen(camera.eye, eye);
        oracle_transform(view, eye, seen);
        CHECK(oracle_length(seen) < 1e-4);
    }
}

static void camera_pixel_factor_is_pixels_at_distance_one(void)
{
    int i;
    for (i = 0; i < 1000; i++) {
        terrimp_camera camera;
        float factor = 0.0f;
        double wanted;
        random_camera(1.0f, &camera);
        CHECK(terrimp_camera_pixel_factor(&camera, &factor) == TERRIMP_OK);
        wanted = (double)camera.height_px / (2.0 * tan((double)camera.fov_y_rad / 2.0));
        CHECK(fabs((double)factor - wanted) < 1e-5 * wanted);
    }
}

/* Value of plane i of a frustum at a point, in double. */
static double plane_value(const terrimp_frustum *frustum, int i, const double p[3])
{
    double sum = (double)frustum->plane[i][3];
    int k;
    for (k = 0; k < 3; k++)
        sum += (double)frustum->plane[i][k] * (p[k] - (double)frustum->eye[k]);
    return sum;
}

/* Each plane agrees with the clip condition of its side: left, right, down, up, near, far. */
static void frustum_planes_agree_with_the_matrices(void)
{
    int i, k, n, sure = 0, inside = 0;
    for (i = 0; i < 400; i++) {
        terrimp_camera camera;
        terrimp_frustum frustum;
        float view[16], projection[16];
        random_camera(50.0f, &camera);
        CHECK(terrimp_camera_matrices(&camera, view, projection) == TERRIMP_OK);
        CHECK(terrimp_camera_frustum(&camera, &frustum) == TERRIMP_OK);
        for (n = 0; n < 50; n++) {
            double p[3], seen[4], clip[4], side[6], scale;
            float offset[3];
            int all = 1;
            random_vector(0.0f, n % 2 ? 10.0f : 600.0f, offset);
            for (k = 0; k < 3; k++)
                p[k] = (double)camera.eye[k] + (double)offset[k];
            oracle_transform(view, p, seen);
            oracle_transform4(projection, seen, clip);
            for (k = 0; k < 2; k++) {
                side[2 * k] = clip[k] + clip[3];
                side[2 * k + 1] = clip[3] - clip[k];
            }
            side[4] = camera.depth_zero_to_one ? clip[2] : clip[2] + clip[3];
            side[5] = clip[3] - clip[2];
            scale = fabs(clip[0]) + fabs(clip[1]) + fabs(clip[2]) + fabs(clip[3]) + 1.0;
            for (k = 0; k < 6; k++) {
                double value = plane_value(&frustum, k, p);
                all = all && value > 0.0;
                if (fabs(side[k]) < 1e-3 * scale)
                    continue;
                sure++;
                CHECK((side[k] > 0.0) == (value > 0.0));
            }
            inside += all;
        }
    }
    CHECK(sure > 60000);
    CHECK(inside > 500); /* the points were not all on one side */
}

/* A random box that has a fair chance to be in sight. */
static void random_box_for(const terrimp_camera *camera, terrimp_box *box)
{
    float place[3], offset[3];
    int k;
    random_vector(0.0f, random_magnitude(1.0f, 700.0f), offset);
    for (k = 0; k < 3; k++)
        place[k] = camera->eye[k] + offset[k];
    random_box(place, random_magnitude(0.1f, 400.0f), box);
}

static void frustum_test_never_culls_what_can_be_seen(void)
{
    int i, k, n, seen_boxes = 0, culled = 0, whole = 0;
    for (i = 0; i < 6000; i++) {
        terrimp_camera camera;
        terrimp_frustum frustum;
        terrimp_box box;
        int mask, outside_of[6] = {0, 0, 0, 0, 0, 0}, seen = 0;
        random_camera(i % 2 ? 50.0f : 50000.0f, &camera);
        random_box_for(&camera, &box);
        CHECK(terrimp_camera_frustum(&camera, &frustum) == TERRIMP_OK);
        mask = terrimp_frustum_test(&frustum, &box, TERRIMP_PLANES_ALL);
        CHECK(mask == TERRIMP_PLANES_OUTSIDE || (mask & ~TERRIMP_PLANES_ALL) == 0);
        for (n = 0; n < 40; n++) {
            double p[3];
            int visible = 1;
            if (n < 8)
                oracle_corner(&box, n, p);
            else
                oracle_point_in(&box, p);
            for (k = 0; k < 6; k++) {
                double value = plane_value(&frustum, k, p);
                visible = visible && value > 1e-3;
                outside_of[k] += value < -1e-3;
            }
            seen += visible;
        }
        seen_boxes += seen > 0;
        culled += mask == TERRIMP_PLANES_OUTSIDE;
        whole += mask == 0;
        CHECK(!(seen && mask == TERRIMP_PLANES_OUTSIDE));
        if (mask == TERRIMP_PLANES_OUTSIDE)
            continue;
        for (k = 0; k < 6; k++) /* a plane that was struck off has nothing behind it */
            CHECK(((mask >> k) & 1) || outside_of[k] == 0);
    }
    CHECK(seen_boxes > 300 && culled > 300 && whole > 20);
}

/* A box that lies outside of a single plane is culled: its corners say so exactly. */
static void frustum_test_culls_what_one_plane_cuts_off(void)
{
    int i, k, n, cut = 0;
    for (i = 0; i < 3000; i++) {
        terrimp_camera camera;
        terrimp_frustum frustum;
        terrimp_box box;
        int off = 0;
        random_camera(50.0f, &camera);
        random_box_for(&camera, &box);
        CHECK(terrimp_camera_frustum(&camera, &frustum) == TERRIMP_OK);
        for (k = 0; k < 6; k++) {
            int behind = 0;
            for (n = 0; n < 8; n++) {
                double p[3];
                oracle_corner(&box, n, p);
                behind += plane_value(&frustum, k, p) < -1e-2;
            }
            off = off || behind == 8;
        }
        cut += off;
        CHECK(!off ||
              terrimp_frustum_test(&frustum, &box, TERRIMP_PLANES_ALL) == TERRIMP_PLANES_OUTSIDE);
    }
    CHECK(cut > 300);
}

/* Down a hierarchy the mask of the parent gives a child the same answer as all six planes. */
static void frustum_masks_give_children_the_full_answer(void)
{
    int i, k;
    for (i = 0; i < 6000; i++) {
        terrimp_camera camera;
        terrimp_frustum frustum;
        terrimp_box parent, child;
        int mask;
        random_camera(50.0f, &camera);
        random_box_for(&camera, &parent);
        for (k = 0; k < 3; k++) {
            float middle = 0.5f * (parent.min[k] + parent.max[k]);
            int upper = (int)random_range(0, 1);
            child.min[k] = upper ? middle : parent.min[k];
            child.max[k] = upper ? parent.max[k] : middle;
        }
        CHECK(terrimp_camera_frustum(&camera, &frustum) == TERRIMP_OK);
        mask = terrimp_frustum_test(&frustum, &parent, TERRIMP_PLANES_ALL);
        if (mask == TERRIMP_PLANES_OUTSIDE)
            CHECK(terrimp_frustum_test(&frustum, &child, TERRIMP_PLANES_ALL) ==
                  TERRIMP_PLANES_OUTSIDE);
        else
            CHECK(terrimp_frustum_test(&frustum, &child, mask) ==
                  terrimp_frustum_test(&frustum, &child, TERRIMP_PLANES_ALL));
        CHECK(terrimp_frustum_test(&frustum, &parent, 0) == 0); /* nothing left to test */
    }
}

static void box_distances_agree_with_brute_force(void)
{
    int i, k, n;
    for (i = 0; i < 3000; i++) {
        static const float middle[3] = {0.0f, 0.0f, 0.0f};
        terrimp_box box;
        float point[3];
        double at[3], gap[3], closest, farthest = 0.0, corner[3], way[3];
        random_box(middle, 20.0f, &box);
        random_vector(0.0f, 25.0f, point);
        oracle_widen(point, at);
        for (k = 0; k < 3; k++) {
            double clamped = fmin(fmax(at[k], (double)box.min[k]), (double)box.max[k]);
            gap[k] = clamped - at[k];
        }
        for (n = 0; n < 8; n++) {
            oracle_corner(&box, n, corner);
            oracle_between(at, corner, way);
            farthest = fmax(farthest, oracle_length(way));
        }
        closest = (double)terrimp_box_distance(&box, point);
        CHECK(fabs(closest - oracle_length(gap)) < 1e-5);
        CHECK((closest == 0.0) == (oracle_length(gap) == 0.0));
        CHECK(fabs((double)terrimp_box_farthest(&box, point) - farthest) < 1e-5 * farthest);
        for (n = 0; n < 20; n++) {
            oracle_point_in(&box, corner);
            oracle_between(at, corner, way);
            CHECK(oracle_length(way) >= closest - 1e-5);
            CHECK(oracle_length(way) <= farthest + 1e-5);
        }
    }
}

/* ---- fitted frustums ---- */

/* A box and an eye: kind 0 anywhere, 1 straight above, 2 straight below, 3 beside, 4 grazing,
   5 far away, 6 at a huge offset from the origin, 7 close to the box. */
static void random_sight(int kind, terrimp_box *box, float eye[3])
{
    float place[3] = {0.0f, 0.0f, 0.0f}, side = random_magnitude(0.1f, 1000.0f), offset[3];
    int k;
    if (kind == 6) {
        random_vector(1e5f, 1e6f, place);
        side = random_float(100.0f, 1000.0f);
    }
    random_box(place, side, box);
    random_vector(0.6f * side, (kind == 5 ? 1000.0f : 8.0f) * side, offset);
    if (kind == 1 || kind == 2) {
        offset[1] = (kind == 1 ? 1.0f : -1.0f) * random_float(0.6f, 5.0f) * side;
        offset[0] = offset[2] = 0.0f;
    }
    if (kind == 3)
        offset[1] = 0.0f;
    if (kind == 4)
        offset[1] *= 0.01f;
    for (k = 0; k < 3; k++)
        eye[k] = kind == 7 ? random_float(1.4f * box->min[k], 1.4f * box->max[k])
                           : 0.5f * (box->min[k] + box->max[k]) + offset[k];
}

/* Where a point lies in a capture's frustum: tangents along right and up, distance forward. */
static void capture_coordinates(const terrimp_capture *capture, const double p[3], double out[3])
{
    double eye[3], axis[3], way[3];
    oracle_widen(capture->eye, eye);
    oracle_between(eye, p, way);
    oracle_widen(capture->forward, axis);
    out[2] = oracle_dot(way, axis);
    oracle_widen(capture->right, axis);
    out[0] = oracle_dot(way, axis) / out[2];
    oracle_widen(capture->up, axis);
    out[1] = oracle_dot(way, axis) / out[2];
}

/* What capture_fit has to answer, by the directions to the corners; -1: too close to call. */
static int expected_fit(const terrimp_box *box, const float eye[3])
{
    double from[3], middle[3], corner[3], forward[3], way[3];
    int k, n, inside = 1, result = TERRIMP_OK;
    for (k = 0; k < 3; k++)
        inside = inside && eye[k] >= box->min[k] && eye[k] <= box->max[k];
    if (inside)
        return TERRIMP_E_INSIDE;
    oracle_widen(eye, from);
    for (k = 0; k < 3; k++)
        middle[k] = 0.5 * ((double)box->min[k] + (double)box->max[k]);
    oracle_between(from, middle, forward);
    for (n = 0; n < 8; n++) {
        double cosine;
        oracle_corner(box, n, corner);
        oracle_between(from, corner, way);
        cosine = oracle_dot(way, forward) / (oracle_length(way) * oracle_length(forward));
        if (cosine < 0.0)
            return cosine > -1e-5 ? -1 : TERRIMP_E_BEHIND;
        if (cosine < 0.002)
            result = -1; /* so steep that a perspective picture is of no use */
    }
    return result;
}

static void capture_fit_holds_every_corner_and_touches_every_side(void)
{
    int i, k, n, fitted = 0;
    for (i = 0; i < 40000; i++) {
        terrimp_box box;
        terrimp_capture c;
        float eye[3];
        double least[3] = {0, 0, 0}, most[3] = {0, 0, 0}, corner[3], at[3];
        double wide, high, slope = 1.0;
        random_sight(i % 8, &box, eye);
        if (terrimp_capture_fit(&box, eye, &c) != TERRIMP_OK)
            continue;
        fitted++;
        for (n = 0; n < 8; n++) {
            oracle_corner(&box, n, corner);
            capture_coordinates(&c, corner, at);
            slope = fmax(slope, sqrt(1.0 + at[0] * at[0] + at[1] * at[1]));
            for (k = 0; k < 3; k++) {
                least[k] = n == 0 || at[k] < least[k] ? at[k] : least[k];
                most[k] = n == 0 || at[k] > most[k] ? at[k] : most[k];
            }
        }
        /* Inside, strictly ... */
        CHECK(least[0] >= (double)c.tan_left && most[0] <= (double)c.tan_right);
        CHECK(least[1] >= (double)c.tan_down && most[1] <= (double)c.tan_up);
        CHECK(least[2] >= (double)c.z_near && most[2] <= (double)c.z_far);
        CHECK(c.z_near > 0.0f && c.z_far > c.z_near);
        CHECK(c.tan_right > c.tan_left && c.tan_up > c.tan_down);
        /* ... and no side farther from the closest corner than a few millionths of the picture's
           reach, times the slope of the steepest ray: floats know it no better. */
        wide = slope * 4e-6 * (fmax(fabs(least[0]), fabs(most[0])) + 0.2);
        high = slope * 4e-6 * (fmax(fabs(least[1]), fabs(most[1])) + 0.2);
        CHECK(least[0] - (double)c.tan_left < wide && (double)c.tan_right - most[0] < wide);
        CHECK(least[1] - (double)c.tan_down < high && (double)c.tan_up - most[1] < high);
        CHECK(least[2] - (double)c.z_near < slope * 4e-6 * least[2]);
        CHECK((double)c.z_far - most[2] < slope * 4e-6 * most[2]);
    }
    CHECK(fitted > 25000);
}

static void capture_tighten_touches_the_points_and_keeps_the_rest(void)
{
    int i, k, n, fitted = 0;
    for (i = 0; i < 20000; i++) {
        terrimp_box box;
        terrimp_capture c, before;
        float eye[3], points[12][3];
        double least[2] = {0, 0}, most[2] = {0, 0}, point[3], at[3], slope = 1.0, slack[2];
        int count = (int)random_range(1, 12);
        random_sight(i % 8, &box, eye);
        if (terrimp_capture_fit(&box, eye, &c) != TERRIMP_OK)
            continue;
        fitted++;
        before = c;
        for (n = 0; n < count; n++) {
            oracle_point_in(&box, point);
            for (k = 0; k < 3; k++)
                points[n][k] = terrimpi_clamp((float)point[k], box.min[k], box.max[k]);
            oracle_widen(points[n], point);
            capture_coordinates(&c, point, at);
            slope = fmax(slope, sqrt(1.0 + at[0] * at[0] + at[1] * at[1]));
            for (k = 0; k < 2; k++) {
                least[k] = n == 0 || at[k] < least[k] ? at[k] : least[k];
                most[k] = n == 0 || at[k] > most[k] ? at[k] : most[k];
            }
        }
        CHECK(terrimpi_camera_tighten(&c, points[0], (uint32_t)count));
        CHECK(least[0] >= (double)c.tan_left && most[0] <= (double)c.tan_right);
        CHECK(least[1] >= (double)c.tan_down && most[1] <= (double)c.tan_up);
        CHECK(c.tan_right > c.tan_left && c.tan_up > c.tan_down);
        for (k = 0; k < 2; k++)
            slack[k] = slope * 4e-6 * (fmax(fabs(least[k]), fabs(most[k])) + 0.2);
        CHECK(least[0] - (double)c.tan_left < slack[0] && (double)c.tan_right - most[0] < slack[0]);
        CHECK(least[1] - (double)c.tan_down < slack[1] && (double)c.tan_up - most[1] < slack[1]);
        c.tan_left = before.tan_left;
        c.tan_right = before.tan_right;
        c.tan_down = before.tan_down;
        c.tan_up = before.tan_up;
        CHECK(memcmp(&c, &before, sizeof c) == 0);
    }
    CHECK(fitted > 12000);
}

static void capture_axes_are_orthonormal_and_aim_at_the_middle(void)
{
    int i, k;
    for (i = 0; i < 3500; i++) {
        terrimp_box box;
        terrimp_capture c;
        float eye[3];
        double from[3], middle[3], way[3], forward[3], up[3], right[3], across[3];
        random_sight(i % 7, &box, eye);
        if (terrimp_capture_fit(&box, eye, &c) != TERRIMP_OK)
            continue;
        CHECK(memcmp(c.eye, eye, sizeof eye) == 0);
        oracle_widen(eye, from);
        for (k = 0; k < 3; k++)
            middle[k] = 0.5 * ((double)box.min[k] + (double)box.max[k]);
        oracle_between(from, middle, way);
        oracle_widen(c.forward, forward);
        oracle_widen(c.up, up);
        oracle_widen(c.right, right);
        CHECK(oracle_angle(way, forward) < 1e-6);
        oracle_cross(right, up, across); /* right-handed: looks along -(right x up) */
        CHECK(fabs(oracle_dot(across, forward) + 1.0) < 1e-5);
        CHECK(fabs(oracle_length(right) - 1.0) < 1e-6 && fabs(oracle_length(up) - 1.0) < 1e-6);
        CHECK(fabs(oracle_dot(right, up)) < 1e-5 && fabs(oracle_dot(up, forward)) < 1e-5);
        if (fabs(forward[1]) < 0.9999) /* upright, unless it looks along the y axis */
            CHECK(c.up[1] >= -1e-6f);
        if (i % 7 == 1 || i % 7 == 2)
            CHECK(up[2] < -0.99); /* there -z is up */
    }
}

/* The matrices put every corner into the clip volume, in both conventions of depth. */
static void capture_matrices_clip_no_corner(void)
{
    int i, k, n;
    for (i = 0; i < 4000; i++) {
        terrimp_box box;
        terrimp_capture c;
        float eye[3], view[16], projection[16];
        int zero_to_one = i & 1;
        random_sight(i % 6, &box, eye); /* not at huge offsets, where a world matrix is coarse */
        if (terrimp_capture_fit(&box, eye, &c) != TERRIMP_OK)
            continue;
        CHECK(terrimp_capture_matrices(&c, zero_to_one, view, projection) == TERRIMP_OK);
        for (n = 0; n < 8; n++) {
            double corner[3], at[3], seen[4], clip[4], slack;
            oracle_corner(&box, n, corner);
            capture_coordinates(&c, corner, at);
            oracle_transform(view, corner, seen);
            oracle_transform4(projection, seen, clip);
            CHECK(fabs(clip[3] - at[2]) < 1e-5 * ((double)c.z_far + at[2]));
            for (k = 0; k < 2; k++) {
                double size = (double)(k ? c.tan_up - c.tan_down : c.tan_right - c.tan_left);
                slack = 2e-6 * (1.0 + fabs(at[k])) * (double)c.z_far / at[2] / size + 1e-5;
                CHECK(fabs(clip[k] / clip[3]) <= 1.0 + slack);
            }
            slack = 1e-5 * (double)c.z_far / (double)(c.z_far - c.z_near) + 1e-5;
            slack *= (double)c.z_far / at[2];
            CHECK(clip[2] / clip[3] <= 1.0 + slack);
            CHECK(clip[2] / clip[3] >= (zero_to_one ? 0.0 : -1.0) - slack);
        }
    }
}

static void capture_fit_tells_inside_from_spanning(void)
{
    int i, k, counts[3] = {0, 0, 0};
    for (i = 0; i < 12000; i++) {
        static const float middle[3] = {0.0f, 0.0f, 0.0f};
        terrimp_box box;
        terrimp_capture c, before;
        float eye[3];
        int wanted;
        terrimp_result result;
        random_box(middle, 10.0f, &box);
        for (k = 0; k < 3; k++)
            eye[k] = random_float(1.6f * box.min[k] - 0.1f, 1.6f * box.max[k] + 0.1f);
        if (i % 10 == 0)
            for (k = 0; k < 3; k++) /* on the rim is inside */
                eye[k] = random_range(0, 1) ? box.min[k] : 0.5f * (box.min[k] + box.max[k]);
        wanted = expected_fit(&box, eye);
        memset(&c, UNTOUCHED, sizeof c);
        before = c;
        result = terrimp_capture_fit(&box, eye, &c);
        CHECK(wanted < 0 || result == (terrimp_result)wanted);
        CHECK(result == TERRIMP_OK || memcmp(&c, &before, sizeof c) == 0);
        counts[0] += result == TERRIMP_OK;
        counts[1] += result == TERRIMP_E_INSIDE;
        counts[2] += result == TERRIMP_E_BEHIND;
    }
    CHECK(counts[0] > 500 && counts[1] > 500 && counts[2] > 500);
}

static void capture_fit_takes_flat_boxes_and_points(void)
{
    int i, k, flat;
    for (i = 0; i < 2000; i++) {
        static const float middle[3] = {5.0f, -3.0f, 2.0f};
        terrimp_box box;
        terrimp_capture c;
        float eye[3];
        double corner[3], at[3];
        random_box(middle, 4.0f, &box);
        flat = 1 + i % 7; /* which axes have no extent; 7: a point */
        for (k = 0; k < 3; k++)
            if ((flat >> k) & 1)
                box.max[k] = box.min[k];
        random_vector(8.0f, 50.0f, eye);
        for (k = 0; k < 3; k++)
            eye[k] += middle[k];
        if (flat == 2 && fabsf(eye[0] - middle[0]) > 6.0f)
            eye[1] = box.min[1]; /* in the plane of a flat box: it is seen as a line */
        CHECK(terrimp_capture_fit(&box, eye, &c) == TERRIMP_OK);
        CHECK(c.tan_right > c.tan_left && c.tan_up > c.tan_down && c.z_far > c.z_near);
        oracle_corner(&box, i % 8, corner);
        capture_coordinates(&c, corner, at);
        CHECK(at[0] >= (double)c.tan_left && at[0] <= (double)c.tan_right);
        CHECK(at[1] >= (double)c.tan_down && at[1] <= (double)c.tan_up);
        CHECK(at[2] >= (double)c.z_near && at[2] <= (double)c.z_far);
    }
}

static inline void camera_tests(void)
{
    RUN(camera_defaults_are_those_of_the_table);
    RUN(cameras_of_every_kind_place_known_points);
    RUN(camera_limits_are_accepted_at_their_ends);
    RUN(camera_axes_are_orthonormal);
    RUN(camera_up_leans_towards_the_wanted_one);
    RUN(camera_matrices_place_known_points);
    RUN(camera_view_matrix_is_rigid);
    RUN(camera_pixel_factor_is_pixels_at_distance_one);
    RUN(frustum_planes_agree_with_the_matrices);
    RUN(frustum_test_never_culls_what_can_be_seen);
    RUN(frustum_test_culls_what_one_plane_cuts_off);
    RUN(frustum_masks_give_children_the_full_answer);
    RUN(box_distances_agree_with_brute_force);
    RUN(capture_fit_holds_every_corner_and_touches_every_side);
    RUN(capture_tighten_touches_the_points_and_keeps_the_rest);
    RUN(capture_axes_are_orthonormal_and_aim_at_the_middle);
    RUN(capture_matrices_clip_no_corner);
    RUN(capture_fit_tells_inside_from_spanning);
    RUN(capture_fit_takes_flat_boxes_and_points);
}

#endif
