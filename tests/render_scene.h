/* A scene around the terrain: houses on it and a sea through it, drawn with the ordinary depth test
   after terrain that is full, or impostors. What is hidden is hidden in both. */
#ifndef RENDER_SCENE_H
#define RENDER_SCENE_H

#include "examples/host/props.h"

enum { SCENE_ROUND = 8, SCENE_GLIDE = 6, SCENE_HOUSES = 400 };

typedef struct scene_count {
    size_t houses;          /* pixels of them in front of the full mesh */
    size_t through, sunk;   /* pixels that only impostors, only the full mesh leaves to a house */
    double worst, worst_sea; /* PSNR of whole pictures, without and with a sea */
    size_t holes;           /* pixels of sky where the full mesh has none nearby */
} scene_count;

/* Terrain, houses and, unless it is NULL, a sea. */
static void draw_scene(scene *s, terrimp_view *view, const flight_pose *pose, const props *p,
                       const float *sea_height, uint8_t *rgb)
{
    terrimp_callbacks callbacks = gl_terrain_callbacks(&s->gl);
    terrimp_stats stats;
    terrimp_camera camera = aim(s, view, pose, &stats);
    camera.z_far = 5.0f * (s->info.box.max[0] - s->info.box.min[0]); /* the sea's end */
    need_ok(gl_terrain_begin(&s->gl, &camera, magenta));
    need_ok(terrimp_view_render(view, &callbacks));
    gl_terrain_end(&s->gl);
    props_draw_houses(p, &s->gl);
    if (sea_height)
        props_draw_sea(p, &s->gl, *sea_height);
    glFinish();
    context_read(&s->context, rgb);
}

static int is_house(const uint8_t *rgb)
{
    return rgb[0] > 90 && rgb[1] * 3 < rgb[0] && rgb[2] * 3 < rgb[0];
}

static void count_houses(const scene *s, const uint8_t *ours, const uint8_t *full, scene_count *c)
{
    size_t i;
    for (i = 0; i < s->pixels; i++) {
        int here = is_house(ours + i * 3), there = is_house(full + i * 3);
        c->houses += (size_t)there;
        c->through += here && !there;
        c->sunk += there && !here;
    }
}

/* A glide in each of eight directions, at three heights; its last frame is judged, with a sea at
   three heights too. */
static void count_scene(scene *s, const terrimp_view_desc *settings, scene_count *c)
{
    terrimp_view *view = open_view(s, settings), *full = open_full_view(s);
    uint8_t *ours = open_picture(s), *truth = open_picture(s);
    float low, high;
    props p;
    int i, k, sea;
    memset(c, 0, sizeof *c);
    c->worst = c->worst_sea = 99.0;
    need_ok(terrimp_heightfield_bounds(&s->field, 0, 0, s->field.width, s->field.depth, &low,
                                       &high));
    need(props_open(&p, &s->field, SCENE_HOUSES, 1.5f * s->field.spacing_x,
                    low + 0.05f * (high - low)));
    for (i = 0; i < SCENE_ROUND; i++) {
        float up = s->height_range * (i % 3 == 0 ? 0.03f : i % 3 == 1 ? 0.15f : 0.4f);
        float heading = 45.0f * (float)i + 10.0f, cells = (float)(s->field.width - 1);
        flight_pose pose;
        for (k = 0; k < SCENE_GLIDE; k++) {
            float along = (float)k / cells;
            pose = pose_at(s, 0.5f + along * cosf(heading * DEGREE),
                           0.5f + along * sinf(heading * DEGREE), up, heading, 3.0f);
            draw_scene(s, view, &pose, &p, NULL, ours);
        }
        draw_scene(s, full, &pose, &p, NULL, truth);
        count_houses(s, ours, truth, c);
        c->holes += stray_sky(s, ours, truth, STRAY);
        c->worst = fmin(c->worst, psnr(s, ours, truth));
        for (sea = 1; sea <= 3; sea++) {
            float height = low + (high - low) * 0.04f * (float)(sea * sea);
            if (height >= pose.eye[1])
                continue;
            draw_scene(s, view, &pose, &p, &height, ours);
            draw_scene(s, full, &pose, &p, &height, truth);
            c->worst_sea = fmin(c->worst_sea, psnr(s, ours, truth));
        }
    }
    props_close(&p);
    free(ours);
    free(truth);
    terrimp_view_destroy(view);
    terrimp_view_destroy(full);
}

/* With the depth of coarse meshes houses sink into them; with that of the pictures they do not. */
static void check_scene(scene *s)
{
    terrimp_view_desc settings = settings_of(TERRIMP_MODE_AUTO);
    scene_count c[2];
    int exact;
    for (exact = 0; exact < 2; exact++) {
        gl_terrain_close(&s->gl);
        s->exact_depth = settings.exact_depth = exact;
        scene_fill(s, ATLAS);
        count_scene(s, &settings, &c[exact]);
        printf("  %s%s: of %u pixels of houses %u shine through, %u are sunk; at least %.1f dB, "
               "with a sea %.1f; %u pixels of sky\n", s->name, exact ? ", exact depth" : "",
               (unsigned)c[exact].houses, (unsigned)c[exact].through, (unsigned)c[exact].sunk,
               c[exact].worst, c[exact].worst_sea, (unsigned)c[exact].holes);
        CHECK(c[exact].houses > 500);
        CHECK(c[exact].through * 100 <= c[exact].houses * (exact ? 2 : 1));
        CHECK(c[exact].worst > 30.0 && c[exact].worst_sea > 35.0);
    }
    CHECK(c[0].sunk * 100 <= c[0].houses * 15);
    CHECK(c[1].sunk * 100 <= c[1].houses * 5);
}

static void houses_and_seas_meet_the_terrain(void)
{
    static const dem_desc whole = { 0 };
    static const char *const tiles[2] = { "N41E001.hgt", "N42E001.hgt" };
    scene s;
    int i;
    open_hills(&s, 640, 512, 50.0f);
    check_scene(&s);
    scene_close(&s);
    for (i = 0; i < 2; i++) {
        if (!open_tile(&s, tiles[i], &whole)) {
            SKIP("there is no real tile");
            continue;
        }
        scene_show(&s, 640, 512, 50.0f, ATLAS);
        check_scene(&s);
        scene_close(&s);
    }
}

#endif
