/* Laws of the impostor room: sizes, texture matrices, update criteria. */
#ifndef UNIT_IMPOSTOR_H
#define UNIT_IMPOSTOR_H

#include "unit_camera.h"

/* A capture of a random box; returns 0 when no frustum fits. */
static int random_capture(int kind, terrimp_box *box, terrimp_capture *capture)
{
    float eye[3];
    random_sight(kind, box, eye);
    return terrimp_capture_fit(box, eye, capture) == TERRIMP_OK;
}

/* Hess eq. 3.3 and 3.4: screen pixels * (F_right + F_left) / (2 F_near tan(fov / 2)), where the
   screen is wide enough for both axes to have the same pixels per tangent. */
static void impostor_size_is_that_of_hess(void)
{
    int i;
    for (i = 0; i < 4000; i++) {
        terrimp_box box;
        terrimp_capture c;
        terrimp_camera camera;
        uint32_t size[2];
        float factor = 0.0f, scale = 0.0f, texels = random_float(0.2f, 4.0f);
        double tan_y, tan_x, wide, high;
        if (!random_capture(i % 7, &box, &c))
            continue;
        random_camera(1.0f, &camera);
        camera.height_px += 100;
        CHECK(terrimp_camera_pixel_factor(&camera, &factor) == TERRIMP_OK);
        CHECK(terrimp_impostor_size(&c, factor, texels, 1, 65536, size, &scale) == TERRIMP_OK);
        tan_y = tan(0.5 * (double)camera.fov_y_rad);
        tan_x = tan_y * (double)camera.width_px / (double)camera.height_px;
        wide = (double)camera.width_px * ((double)c.tan_right - (double)c.tan_left) / (2.0 * tan_x);
        high = (double)camera.height_px * ((double)c.tan_up - (double)c.tan_down) / (2.0 * tan_y);
        wide *= (double)texels;
        high *= (double)texels;
        if (wide > 65000.0 || high > 65000.0)
            continue;
        CHECK(scale == 1.0f);
        CHECK((double)size[0] >= wide * 0.99999 && (double)size[0] < wide * 1.00001 + 1.0);
        CHECK((double)size[1] >= high * 0.99999 && (double)size[1] < high * 1.00001 + 1.0);
    }
}

static void impostor_size_keeps_its_limits_and_says_the_scale(void)
{
    int i, k, reduced = 0;
    for (i = 0; i < 4000; i++) {
        terrimp_box box;
        terrimp_capture c;
        uint32_t size[2], free_size[2], smallest = random_range(0, 40);
        uint32_t largest = smallest + random_range(1, 500);
        float factor = random_magnitude(10.0f, 3000.0f), scale = 0.0f, free_scale;
        if (!random_capture(i % 7, &box, &c))
            continue;
        if (terrimp_impostor_size(&c, factor, 1.0f, 0, 65536, free_size, &free_scale) !=
                TERRIMP_OK ||
            free_scale < 1.0f)
            continue;
        CHECK(terrimp_impostor_size(&c, factor, 1.0f, smallest, largest, size, &scale) ==
              TERRIMP_OK);
        CHECK(scale > 0.0f && scale <= 1.0f);
        /* Scaled by the larger side alone, so that the shape stays. */
        CHECK((scale < 1.0f) == (free_size[0] > largest || free_size[1] > largest));
        for (k = 0; k < 2; k++) {
            double wanted = (double)free_size[k] * (double)scale;
            CHECK(size[k] >= smallest && size[k] <= largest);
            CHECK((double)size[k] >= fmin(wanted - 1.01, (double)largest));
            CHECK((double)size[k] <= fmax(wanted + 1.01, (double)smallest));
        }
        if (scale < 1.0f) {
            CHECK(size[0] == largest || size[1] == largest);
            reduced++;
        }
        CHECK(terrimp_impostor_size(&c, factor, 1.0f, smallest, largest, free_size, NULL) ==
              TERRIMP_OK); /* the scale may be of no interest */
        CHECK(free_size[0] == size[0] && free_size[1] == size[1]);
    }
    CHECK(reduced > 200);
}

/* After padding, the texels inside the margin show what the capture showed before. */
static void capture_pad_adds_whole_texels_around_the_picture(void)
{
    int i;
    for (i = 0; i < 2000; i++) {
        terrimp_box box;
        terrimp_capture c, wide;
        uint32_t margin = random_range(0, 5), slot[2];
        double texel_x, texel_y, size;
        if (!random_capture(i % 7, &box, &c))
            continue;
        slot[0] = 2u * margin + random_range(1, 300);
        slot[1] = 2u * margin + random_range(1, 300);
        wide = c;
        CHECK(terrimp_capture_pad(&wide, slot, margin) == TERRIMP_OK);
        texel_x = ((double)wide.tan_right - (double)wide.tan_left) / (double)slot[0];
        texel_y = ((double)wide.tan_up - (double)wide.tan_down) / (double)slot[1];
        size = (double)(wide.tan_right - wide.tan_left + wide.tan_up - wide.tan_down) +
               fabs((double)c.tan_left) + fabs((double)c.tan_down);
        CHECK(fabs((double)wide.tan_left + texel_x * margin - (double)c.tan_left) < 1e-6 * size);
        CHECK(fabs((double)wide.tan_right - texel_x * margin - (double)c.tan_right) < 1e-6 * size);
        CHECK(fabs((double)wide.tan_down + texel_y * margin - (double)c.tan_down) < 1e-6 * size);
        CHECK(fabs((double)wide.tan_up - texel_y * margin - (double)c.tan_up) < 1e-6 * size);
        CHECK(wide.z_near == c.z_near && wide.z_far == c.z_far);
    }
}

/* A random slot of a random atlas. */
static void random_slot(uint32_t atlas[2], terrimp_rect *slot)
{
    atlas[0] = random_range(1, 4096);
    atlas[1] = random_range(1, 4096);
    slot->width = random_range(1, atlas[0]);
    slot->height = random_range(1, atlas[1]);
    slot->x = random_range(0, atlas[0] - slot->width);
    slot->y = random_range(0, atlas[1] - slot->height);
}

static void relative_to_eye(const terrimp_capture *c, double p[3])
{
    int k;
    for (k = 0; k < 3; k++)
        p[k] -= (double)c->eye[k];
}

/* (s / q, t / q) of a point in the box is where the point's picture lies in the slot. */
static void texture_matrix_leads_to_the_projected_point(void)
{
    int i, n;
    for (i = 0; i < 3000; i++) {
        terrimp_box box;
        terrimp_capture c;
        terrimp_rect slot;
        uint32_t atlas[2];
        float matrix[16];
        if (!random_capture(i % 6, &box, &c))
            continue;
        random_slot(atlas, &slot);
        CHECK(terrimp_texture_matrix(&c, &slot, atlas[0], atlas[1], matrix) == TERRIMP_OK);
        for (n = 0; n < 10; n++) {
            double p[3], at[3], out[4], s, t, slack, reach;
            if (n < 8)
                oracle_corner(&box, n, p);
            else
                oracle_point_in(&box, p);
            capture_coordinates(&c, p, at);
            relative_to_eye(&c, p);
            oracle_transform(matrix, p, out);
            s = (at[0] - (double)c.tan_left) / ((double)c.tan_right - (double)c.tan_left);
            t = (at[1] - (double)c.tan_down) / ((double)c.tan_up - (double)c.tan_down);
            s = ((double)slot.x + s * (double)slot.width) / (double)atlas[0];
            t = ((double)slot.y + t * (double)slot.height) / (double)atlas[1];
            /* What floats resolve: the smaller the picture against its slant, the less. */
            reach = 1.0 + fabs(at[0]) + fabs(at[1]);
            slack = 1e-6 + 2e-6 * reach *
                               (1.0 / (double)(c.tan_right - c.tan_left) +
                                1.0 / (double)(c.tan_up - c.tan_down));
            CHECK(fabs(out[0] / out[3] - s) < slack);
            CHECK(fabs(out[1] / out[3] - t) < slack);
            CHECK(fabs(out[3] - at[2]) < 1e-5 * (double)c.z_far);
        }
    }
}

/* From the atlas, with the depth that is there, back to the place, relative to any eye. */
static void place_matrix_leads_back(void)
{
    int i, n, k;
    for (i = 0; i < 3000; i++) {
        terrimp_box box;
        terrimp_capture c;
        terrimp_rect slot;
        uint32_t atlas[2];
        float matrix[16], eye[3];
        if (!random_capture(i % 6, &box, &c))
            continue;
        random_slot(atlas, &slot);
        random_vector(0.0f, c.z_far, eye);
        for (k = 0; k < 3; k++)
            eye[k] += c.eye[k];
        CHECK(terrimp_place_matrix(&c, &slot, atlas[0], atlas[1], eye, matrix) == TERRIMP_OK);
        for (n = 0; n < 8; n++) {
            double p[3], at[3], place[3], out[4], from[3], z_near = (double)c.z_near;
            double z_far = (double)c.z_far;
            oracle_corner(&box, n, p);
            capture_coordinates(&c, p, at);
            place[0] = (at[0] - (double)c.tan_left) / ((double)c.tan_right - (double)c.tan_left);
            place[1] = (at[1] - (double)c.tan_down) / ((double)c.tan_up - (double)c.tan_down);
            place[0] = ((double)slot.x + place[0] * (double)slot.width) / (double)atlas[0];
            place[1] = ((double)slot.y + place[1] * (double)slot.height) / (double)atlas[1];
            place[2] = (1.0 / z_near - 1.0 / at[2]) / (1.0 / z_near - 1.0 / z_far);
            if (!(z_far > z_near * 1.001) || !(c.tan_right - c.tan_left > 1e-3f) ||
                !(c.tan_up - c.tan_down > 1e-3f))
                continue; /* a sheet or a line: less than floats resolve */
            oracle_transform(matrix, place, out);
            oracle_widen(eye, from);
            for (k = 0; k < 3; k++)
                CHECK(fabs(out[k] / out[3] + from[k] - p[k]) <
                      1e-4 * z_far * z_far / z_near + 1e-6 * fabs(p[k]));
        }
    }
}

/* The corners of the box stay inside the slot, however the atlas is cut. */
static void texture_matrix_keeps_the_box_in_its_slot(void)
{
    int i, n;
    for (i = 0; i < 2000; i++) {
        terrimp_box box;
        terrimp_capture c;
        terrimp_rect slot;
        uint32_t atlas[2], size[2];
        float matrix[16];
        if (!random_capture(i % 5, &box, &c))
            continue;
        random_slot(atlas, &slot);
        if (slot.width < 9u || slot.height < 9u)
            continue;
        size[0] = slot.width;
        size[1] = slot.height;
        CHECK(terrimp_capture_pad(&c, size, 2) == TERRIMP_OK);
        if (c.tan_right - c.tan_left < 1e-3f || c.tan_up - c.tan_down < 1e-3f)
            continue; /* a line or a point: less than floats resolve */
        CHECK(terrimp_texture_matrix(&c, &slot, atlas[0], atlas[1], matrix) == TERRIMP_OK);
        for (n = 0; n < 8; n++) {
            double p[3], out[4], x, y;
            oracle_corner(&box, n, p);
            relative_to_eye(&c, p);
            oracle_transform(matrix, p, out);
            x = out[0] / out[3] * (double)atlas[0] - (double)slot.x;
            y = out[1] / out[3] * (double)atlas[1] - (double)slot.y;
            CHECK(x > 1.0 && x < (double)slot.width - 1.0);
            CHECK(y > 1.0 && y < (double)slot.height - 1.0);
            CHECK(out[2] / out[3] > -0.01 && out[2] / out[3] < 1.01);
        }
    }
}

/* However distant the world's origin is: in floats, as a shader multiplies, points that lie on the
   grid of floats there come out within a twentieth of a texel. */
static void pictures_stay_in_place_far_from_the_origin(void)
{
    int i, n, k;
    for (i = 0; i < 500; i++) {
        float far_x = (float)((i * 16777) % 8388608), unit = far_x > 4194304.0f ? 0.5f : 0.25f;
        terrimp_box box;
        terrimp_capture c;
        terrimp_rect slot;
        uint32_t size[2];
        float eye[3], matrix[16], p[3], stq[3];
        far_x = random_range(0, 1) ? far_x : -far_x;
        for (k = 0; k < 3; k++) {
            box.min[k] = (k == 1 ? 0.0f : far_x) + unit * (float)random_range(0, 64);
            box.max[k] = box.min[k] + unit * (float)random_range(64, 512);
            eye[k] = box.min[k] - unit * (float)random_range(400, 2000);
        }
        CHECK(terrimp_capture_fit(&box, eye, &c) == TERRIMP_OK);
        CHECK(terrimp_impostor_size(&c, 1000.0f, 2.0f, 8, 2044, size, NULL) == TERRIMP_OK);
        slot.x = slot.y = 100;
        slot.width = size[0];
        slot.height = size[1];
        CHECK(terrimp_texture_matrix(&c, &slot, 4096, 4096, matrix) == TERRIMP_OK);
        for (n = 0; n < 20; n++) {
            double wide[3], at[3], x, y;
            for (k = 0; k < 3; k++)
                p[k] = box.min[k] + unit * (float)random_range(0, 64);
            CHECK(terrimp_texture_coordinates(matrix, c.eye, p, 1, stq) == TERRIMP_OK);
            oracle_widen(p, wide);
            capture_coordinates(&c, wide, at);
            x = (at[0] - (double)c.tan_left) / ((double)c.tan_right - (double)c.tan_left);
            y = (at[1] - (double)c.tan_down) / ((double)c.tan_up - (double)c.tan_down);
            CHECK(fabs((double)(stq[0] / stq[2]) * 4096.0 - 100.0 - x * slot.width) < 0.05);
            CHECK(fabs((double)(stq[1] / stq[2]) * 4096.0 - 100.0 - y * slot.height) < 0.05);
        }
    }
}

static void texture_coordinates_agree_with_the_matrix(void)
{
    int i, n;
    for (i = 0; i < 300; i++) {
        float matrix[16], eye[3], xyz[20][3], stq[21][3];
        for (n = 0; n < 16; n++)
            matrix[n] = random_float(-2.0f, 2.0f);
        for (n = 0; n < 20; n++)
            random_vector(0.0f, 100.0f, xyz[n]);
        memset(stq, UNTOUCHED, sizeof stq);
        random_vector(0.0f, 100.0f, eye);
        CHECK(terrimp_texture_coordinates(matrix, eye, xyz[0], 20, stq[0]) == TERRIMP_OK);
        for (n = 0; n < 20; n++) {
            double p[3], out[4];
            int k;
            for (k = 0; k < 3; k++)
                p[k] = (double)xyz[n][k] - (double)eye[k];
            oracle_transform(matrix, p, out);
            CHECK(fabs((double)stq[n][0] - out[0]) < 1e-4);
            CHECK(fabs((double)stq[n][1] - out[1]) < 1e-4);
            CHECK(fabs((double)stq[n][2] - out[3]) < 1e-4);
        }
        CHECK(is_untouched(stq[20], sizeof stq[20]));
    }
}

/* ---- update criteria ---- */

/* The largest angle over the corners, in double. */
static double oracle_view_angle(const terrimp_box *box, const float from[3], const float to[3])
{
    double worst = 0.0, a[3], b[3], corner[3], way_a[3], way_b[3];
    int n;
    oracle_widen(from, a);
    oracle_widen(to, b);
    for (n = 0; n < 8; n++) {
        oracle_corner(box, n, corner);
        oracle_between(corner, a, way_a);
        oracle_between(corner, b, way_b);
        worst = fmax(worst, oracle_angle(way_a, way_b));
    }
    return worst;
}

/* A second eye near the first: a move between 1e-6 and 2 of the distance to the box. */
static void moved_eye(const terrimp_box *box, const float eye[3], float eye_b[3])
{
    float move[3], most = terrimp_box_distance(box, eye) + 1e-3f;
    int k;
    random_vector(1.0f, 1.0f, move);
    most *= random_magnitude(1e-6f, 2.0f);
    for (k = 0; k < 3; k++)
        eye_b[k] = eye[k] + move[k] * most;
}

static void view_angle_is_the_worst_of_the_corners(void)
{
    int i, small = 0;
    for (i = 0; i < 20000; i++) {
        terrimp_box box;
        float eye[3], other[3], angle = 0.0f;
        double wanted;
        random_sight(i % 6, &box, eye);
        moved_eye(&box, eye, other);
        CHECK(terrimp_view_angle(&box, eye, other, &angle) == TERRIMP_OK);
        wanted = oracle_view_angle(&box, eye, other);
        /* One per thousand from a thousandth of a degree on; below, what floats of eyes hold. */
        CHECK(fabs((double)angle - wanted) <= 1e-3 * wanted + 1e-6);
        small += wanted < 1e-3;
    }
    CHECK(small > 3000);
}

static void view_angle_is_zero_for_an_eye_that_rests(void)
{
    int i;
    for (i = 0; i < 700; i++) {
        terrimp_box box;
        float eye[3], angle = 1.0f;
        random_sight(i % 7, &box, eye);
        CHECK(terrimp_view_angle(&box, eye, eye, &angle) == TERRIMP_OK);
        CHECK(angle >= 0.0f && angle < 1e-6f);
    }
}

static void view_angle_reaches_pi_across_a_corner(void)
{
    terrimp_box box = {{-1.0f, -1.0f, -1.0f}, {1.0f, 1.0f, 1.0f}};
    float a[3] = {-2.0f, -2.0f, -2.0f}, b[3] = {0.0f, 0.0f, 0.0f}, angle;
    CHECK(terrimp_view_angle(&box, a, b, &angle) == TERRIMP_OK);
    CHECK(fabs((double)angle - oracle_pi) < 1e-3);
}

/* One move of the eye and the largest error that points of the box show after it. `ratio` receives
   the largest measured error over the predicted one; returns 0 when there is nothing to measure. */
static int parallax_measured(const terrimp_box *box, const float from[3], const float to[3],
                             float error, float factor, int points, double *ratio)
{
    double a[3], b[3], worst = 0.0;
    float predicted = -1.0f;
    int n, k;
    *ratio = 0.0;
    CHECK(terrimp_parallax_error(box, error, from, to, factor, &predicted) == TERRIMP_OK);
    CHECK(predicted >= 0.0f);
    if (!(predicted < HUGE_VALF))
        return 0;
    oracle_widen(from, a);
    oracle_widen(to, b);
    for (n = 0; n < points; n++) {
        double p[3], q[3], ray[3], to_p[3], to_q[3], t;
        oracle_point_in(box, p);
        oracle_between(a, p, ray);
        t = n % 3 == 0 ? 1.0 : n % 3 == 1 ? -1.0 : (double)random_float(-1.0f, 1.0f);
        t *= (double)error / oracle_length(ray);
        for (k = 0; k < 3; k++)
            q[k] = p[k] + t * ray[k];
        oracle_between(b, p, to_p);
        oracle_between(b, q, to_q);
        worst = fmax(worst, (double)factor * tan(oracle_angle(to_p, to_q)));
    }
    /* Below a ten-thousandth of a pixel both are rounding. */
    CHECK((double)predicted >= worst * (1.0 - 1e-4) - 1e-4);
    if (!(predicted > 1e-3f))
        return 0;
    *ratio = worst / (double)predicted;
    return 1;
}

static void parallax_error_bounds_what_is_measured(void)
{
    int i, finite = 0;
    for (i = 0; i < 6000; i++) {
        terrimp_box box;
        float eye[3], other[3], error;
        double ratio;
        random_sight(i % 6, &box, eye);
        moved_eye(&box, eye, other);
        error = random_magnitude(1e-4f, 0.5f) * terrimp_box_distance(&box, other) + 1e-6f;
        finite += parallax_measured(&box, eye, other, error, random_float(100.0f, 2000.0f), 40,
                                    &ratio);
    }
    CHECK(finite > 2000);
}

/* For boxes a few sides away, as impostors are, some point shows nearly all of the bound as a rule,
   and always a good part of it. */
static void parallax_error_is_not_far_too_large(void)
{
    int i, k, count = 0;
    double sum = 0.0, least = 1.0;
    for (i = 0; i < 600; i++) {
        static const float middle[3] = {0.0f, 0.0f, 0.0f};
        terrimp_box box;
        float eye[3], other[3], move[3], distance;
        double ratio;
        random_box(middle, 1.0f, &box);
        random_vector(3.0f, 20.0f, eye);
        distance = terrimp_box_distance(&box, eye);
        random_vector(0.01f * distance, 0.1f * distance, move);
        for (k = 0; k < 3; k++)
            other[k] = eye[k] + move[k];
        if (!parallax_measured(&box, eye, other, 0.02f, 1000.0f, 200, &ratio))
            continue;
        count++;
        sum += ratio;
        least = fmin(least, ratio);
    }
    CHECK(count > 400);
    CHECK(sum / (double)count > 0.9);
    CHECK(least > 0.5);
}

static void parallax_error_ends(void)
{
    terrimp_box box = {{0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, 1.0f}};
    float a[3] = {5.0f, 0.5f, 0.5f}, b[3] = {5.0f, 2.0f, 0.5f}, close[3] = {1.05f, 0.5f, 0.5f}, px;
    CHECK(terrimp_parallax_error(&box, 0.1f, a, a, 1000.0f, &px) == TERRIMP_OK && px == 0.0f);
    CHECK(terrimp_parallax_error(&box, 0.0f, a, b, 1000.0f, &px) == TERRIMP_OK && px == 0.0f);
    CHECK(terrimp_parallax_error(&box, 0.1f, a, close, 1000.0f, &px) == TERRIMP_OK);
    CHECK(px == HUGE_VALF);
    CHECK(terrimp_parallax_error(&box, 0.1f, close, close, 1000.0f, &px) == TERRIMP_OK);
    CHECK(px == 0.0f); /* it has not moved */
}

/* Hess section 3.5.1: 1000 units away, 5 degrees, 50 units a second last 1.74 s. */
static void lifetime_is_that_of_hess(void)
{
    int i;
    float seconds = 0.0f;
    CHECK(terrimp_impostor_lifetime(1000.0f, (float)(5.0 * oracle_pi / 180.0), 50.0f, &seconds) ==
          TERRIMP_OK);
    CHECK(fabs((double)seconds - 1.74) < 0.005);
    for (i = 0; i < 1000; i++) {
        float d = random_float(0.0f, 1e4f), angle = random_float(0.0f, 3.1415f);
        float speed = random_magnitude(1e-2f, 1e3f);
        double wanted = (double)d * sin(fmin((double)angle, oracle_pi / 2.0)) / (double)speed;
        CHECK(terrimp_impostor_lifetime(d, angle, speed, &seconds) == TERRIMP_OK);
        CHECK(fabs((double)seconds - wanted) <= 1e-5 * wanted);
    }
}

/* Within its lifetime no move of the eye turns the view of any corner beyond the angle. */
static void lifetime_keeps_the_view_angle(void)
{
    int i, k;
    for (i = 0; i < 5000; i++) {
        terrimp_box box;
        float eye[3], other[3], seconds = 0.0f, move[3], limit = random_float(0.01f, 1.4f);
        random_sight(i % 6, &box, eye);
        CHECK(terrimp_impostor_lifetime(terrimp_box_distance(&box, eye), limit, 1.0f, &seconds) ==
              TERRIMP_OK);
        random_vector(1.0f, 1.0f, move);
        for (k = 0; k < 3; k++)
            other[k] = eye[k] + move[k] * seconds;
        CHECK(oracle_view_angle(&box, eye, other) <= (double)limit * (1.0 + 1e-4) + 1e-5);
    }
}

enum { RIDGE_SIDE = 17 };

/* A level grid, 10 to 26 in front of the eye, with a ridge along x in its row `ridge`. */
static void make_ridge(int ridge, float height, float *xyz, uint16_t *indices)
{
    int x, z;
    for (z = 0; z < RIDGE_SIDE; z++)
        for (x = 0; x < RIDGE_SIDE; x++, xyz += 3) {
            xyz[0] = (float)(x - RIDGE_SIDE / 2);
            xyz[1] = z == ridge ? height : 0.0f;
            xyz[2] = -10.0f - (float)z;
        }
    for (z = 0; z + 1 < RIDGE_SIDE; z++)
        for (x = 0; x + 1 < RIDGE_SIDE; x++, indices += 6) {
            uint16_t a = (uint16_t)(z * RIDGE_SIDE + x), b = (uint16_t)(a + RIDGE_SIDE);
            indices[0] = a;
            indices[1] = (uint16_t)(a + 1);
            indices[2] = indices[3] = b;
            indices[4] = (uint16_t)(a + 1);
            indices[5] = (uint16_t)(b + 1);
        }
}

/* Nothing comes into sight on a plain; behind a ridge it does, and the more the eye moves the more.
   The split stands by the overlap behind the ridge; too large an overlap spares nothing. */
static void capture_split_stands_behind_what_hides(void)
{
    enum { INDICES = (RIDGE_SIDE - 1) * (RIDGE_SIDE - 1) * 6, VERTICES = RIDGE_SIDE * RIDGE_SIDE };
    static float xyz[VERTICES * 3];
    static uint16_t indices[INDICES];
    terrimp_capture capture;
    terrimp_split split, more;
    int i;
    memset(&capture, 0, sizeof capture);
    capture.right[0] = capture.up[1] = 1.0f;
    capture.forward[2] = -1.0f;
    for (i = 0; i < 20; i++) {
        int ridge = (int)random_range(2, 6);
        float height = random_float(1.5f, 2.5f), reach = random_float(1.5f, 2.5f), crest;
        capture.eye[1] = height + random_float(1.5f, 2.5f);
        crest = 10.0f + (float)ridge;
        make_ridge(ridge, 0.0f, xyz, indices);
        CHECK(terrimp_capture_split(&capture, xyz, VERTICES, indices, INDICES, reach, 0.5f, &split)
              == TERRIMP_OK);
        CHECK(split.distance == 0.0f && split.gap == 0.0f && split.gap_left == 0.0f);
        make_ridge(ridge, height, xyz, indices);
        CHECK(terrimp_capture_split(&capture, xyz, VERTICES, indices, INDICES, reach, 0.5f, &split)
              == TERRIMP_OK);
        CHECK(split.gap > 0.0f && split.gap_left < 0.2f * split.gap);
        CHECK(split.distance > crest - 0.5f);
        CHECK(split.distance < crest * capture.eye[1] / (capture.eye[1] - height));
        CHECK(terrimp_capture_split(&capture, xyz, VERTICES, indices, INDICES, reach * 0.2f, 0.5f,
                                    &more) == TERRIMP_OK);
        CHECK(more.gap < split.gap);
        CHECK(terrimp_capture_split(&capture, xyz, VERTICES, indices, INDICES, 1e-3f, 0.5f, &more)
              == TERRIMP_OK);
        CHECK(more.gap < 0.1f * split.gap); /* what stays hidden does not count */
        CHECK(terrimp_capture_split(&capture, xyz, VERTICES, indices, INDICES, reach, 20.0f, &more)
              == TERRIMP_OK);
        CHECK(more.gap == split.gap && more.gap_left == more.gap);
    }
    more = split;
    CHECK(terrimp_capture_split(&capture, xyz, VERTICES, indices, INDICES, 0.0f, 0.5f, &split)
          == TERRIMP_E_RANGE);
    CHECK(terrimp_capture_split(&capture, xyz, VERTICES, indices, INDICES, 1.0f, -1.0f, &split)
          == TERRIMP_E_RANGE);
    CHECK(terrimp_capture_split(&capture, xyz, VERTICES - 1, indices, INDICES, 1.0f, 0.5f, &split)
          == TERRIMP_E_RANGE);
    CHECK(terrimp_capture_split(NULL, xyz, VERTICES, indices, INDICES, 1.0f, 0.5f, &split)
          == TERRIMP_E_NULL);
    CHECK(memcmp(&more, &split, sizeof split) == 0);
}

/* Every code is that of its normal, and no normal is farther from that of its code than is said. */
static void normals_fit_into_two_bytes(void)
{
    double worst = 0.0;
    float normal[3], back[3];
    uint32_t i, k;
    uint8_t code[2], again[2];
    for (i = 0; i < 65536u; i++) {
        double wide[3];
        code[0] = (uint8_t)(i & 255u);
        code[1] = (uint8_t)(i >> 8);
        terrimp_normal_decode(code, back);
        oracle_widen(back, wide);
        CHECK(back[1] >= 0.0f && fabs(oracle_dot(wide, wide) - 1.0) < 1e-6);
        CHECK(terrimp_normal_encode(back, again) == TERRIMP_OK);
        CHECK(again[0] == code[0] && again[1] == code[1]);
    }
    for (i = 0; i < check_rounds(300000, 3000000); i++) {
        double a[3], b[3], sum = 0.0;
        do
            for (k = 0, sum = 0.0; k < 3u; k++) {
                normal[k] = random_float(k == 1u ? 0.0f : -1.0f, 1.0f);
                sum += (double)normal[k] * (double)normal[k];
            }
        while (sum > 1.0 || sum < 0.01);
        CHECK(terrimp_normal_encode(normal, code) == TERRIMP_OK);
        terrimp_normal_decode(code, back);
        oracle_widen(normal, a);
        oracle_widen(back, b);
        worst = fmax(worst, acos(fmin(oracle_dot(a, b) / sqrt(sum) / oracle_length(b), 1.0)));
    }
    worst *= 57.29577951308232;
    printf("  a normal in two bytes is at most %.3f degrees off\n", worst);
    CHECK(worst > 0.4 && worst < 0.55);
}

static inline void impostor_tests(void)
{
    RUN(normals_fit_into_two_bytes);
    RUN(impostor_size_is_that_of_hess);
    RUN(impostor_size_keeps_its_limits_and_says_the_scale);
    RUN(capture_pad_adds_whole_texels_around_the_picture);
    RUN(texture_matrix_leads_to_the_projected_point);
    RUN(place_matrix_leads_back);
    RUN(texture_matrix_keeps_the_box_in_its_slot);
    RUN(pictures_stay_in_place_far_from_the_origin);
    RUN(texture_coordinates_agree_with_the_matrix);
    RUN(view_angle_is_the_worst_of_the_corners);
    RUN(view_angle_is_zero_for_an_eye_that_rests);
    RUN(view_angle_reaches_pi_across_a_corner);
    RUN(parallax_error_bounds_what_is_measured);
    RUN(parallax_error_is_not_far_too_large);
    RUN(parallax_error_ends);
    RUN(lifetime_is_that_of_hess);
    RUN(lifetime_keeps_the_view_angle);
    RUN(capture_split_stands_behind_what_hides);
}

#endif
