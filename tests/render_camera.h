/* Cameras of every kind look at nothing but terrain: no pixel of the sky is left, and the picture
   is like that of the full mesh. */
#ifndef RENDER_CAMERA_H
#define RENDER_CAMERA_H

enum { CAMERA_FRAMES = 16, CAMERA_WAYS = 4 };

static const char *const camera_ways[CAMERA_WAYS] = { "above", "light", "off_centre", "eyes" };

/* The camera of a frame: a map from above; a light that turns while what it shows moves; a tile of
   four of a flight's picture; the middle of two eyes that are some way apart. */
static terrimp_camera camera_of(const scene *s, int way, int frame)
{
    float t = (float)frame / (float)CAMERA_FRAMES, size = s->info.box.max[0] - s->info.box.min[0];
    flight_pose pose = pose_at(s, 0.4f + 0.2f * t, 0.5f + 0.06f * sinf(9.0f * t), 0.15f * size,
                               40.0f + 60.0f * t, 62.0f);
    terrimp_camera camera = camera_at(s, &pose);
    float wide = size * (way == 0 ? 0.1f + 0.2f * t : 0.15f);
    float tan_y = tanf(0.5f * s->fov), tan_x = tan_y * (float)s->width / (float)s->height;
    if (way == 3)
        camera.reach = 0.004f * size;
    if (way == 2) { /* turns about the four */
        camera.sides[frame & 1] = frame & 1 ? tan_x : -tan_x;
        camera.sides[2 + (frame >> 1 & 1)] = frame & 2 ? tan_y : -tan_y;
        camera.z_far = 0.0f;
    }
    if (way >= 2)
        return camera;
    camera.orthographic = 1;
    camera.sides[1] = wide;
    camera.sides[3] = wide * (float)s->height / (float)s->width;
    camera.sides[0] = -camera.sides[1];
    camera.sides[2] = -camera.sides[3];
    camera.z_near = -size;
    camera.z_far = 2.0f * size;
    camera.forward[1] = -1.0f;
    camera.forward[0] = way == 0 ? 0.0f : 0.5f - 0.2f * t;
    camera.forward[2] = way == 0 ? 0.0f : 0.3f * t;
    return camera;
}

/* An eye of a frame: the left or the right one. */
static terrimp_camera camera_eye(const terrimp_camera *camera, int right)
{
    terrimp_camera c;
    float along[3];
    int i;
    need_ok(terrimp_camera_resolve(camera, &c));
    for (i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        along[i] = c.forward[j] * c.up[k] - c.forward[k] * c.up[j];
    }
    for (i = 0; i < 3; i++)
        c.eye[i] += (right ? 0.999f : -0.999f) * c.reach * along[i];
    c.reach = 0.0f;
    return c;
}

/* Returns the impostors of the frame. */
static uint32_t check_camera_frame(scene *s, terrimp_view *view, terrimp_view *full, int way,
                                   int frame, uint8_t *rgb, uint8_t *truth, double *least)
{
    terrimp_camera camera = camera_of(s, way, frame);
    terrimp_stats stats = {0};
    uint64_t hash = 0;
    int right;
    memset(&stats, 0, sizeof stats);
    need_ok(terrimp_view_update(view, &camera));
    need_ok(terrimp_view_get_stats(view, &stats));
    for (right = 0; right < (way == 3 ? 2 : 1); right++) {
        terrimp_camera eye = camera_eye(&camera, right);
        terrimp_capture_command captures[1024];
        tap t = tap_open(s), plain = tap_open(s);
        double like;
        t.captures = captures;
        draw(s, view, &eye, &t, magenta, rgb);
        CHECK(t.capture_count == (right ? 0u : stats.captures));
        CHECK(hash == 0 || stats.captures > 0 || t.hash == hash); /* the same commands again */
        hash = t.hash;
        CHECK(count_colour(rgb, magenta, s->pixels) == 0);
        need_ok(terrimp_view_update(full, &eye));
        draw(s, full, &eye, &plain, magenta, truth);
        CHECK(count_colour(truth, magenta, s->pixels) == 0);
        like = psnr(s, rgb, truth);
        *least = like < *least ? like : *least;
        if (count_colour(rgb, magenta, s->pixels))
            keep_picture(s, camera_ways[way], (size_t)frame, rgb);
    }
    return stats.impostors;
}

static void check_cameras(scene *s, double least_like)
{
    uint8_t *rgb = open_picture(s), *truth = open_picture(s);
    manner manners[MANNERS];
    int way, i, frame;
    list_manners(manners);
    for (way = 0; way < CAMERA_WAYS; way++)
        for (i = 0; i < MANNERS; i++) {
            terrimp_view *view = open_view(s, &manners[i].settings), *full = open_full_view(s);
            double least = 1e9;
            uint32_t impostors = 0;
            for (frame = 0; frame < CAMERA_FRAMES; frame++)
                impostors += check_camera_frame(s, view, full, way, frame, rgb, truth, &least);
            printf("  %s, %s, %s: %.1f impostors a frame, %.2f dB at least\n", s->name,
                   camera_ways[way], manners[i].name, (double)impostors / CAMERA_FRAMES, least);
            CHECK(least > least_like);
            terrimp_view_destroy(view);
            terrimp_view_destroy(full);
        }
    free(rgb);
    free(truth);
}

static void no_camera_sees_a_hole(void)
{
    scene s;
    open_hills(&s, 320, 256, 40.0f);
    check_cameras(&s, 28.0);
    scene_close(&s);
    open_rough(&s, 320, 256, 40.0f);
    check_cameras(&s, 20.0);
    scene_close(&s);
}

#endif
