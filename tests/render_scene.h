/* A scene around the terrain: houses on it and a sea through it, drawn with the ordinary depth test
   after terrain that is full, or impostors. What is hidden is hidden in both. */
#ifndef RENDER_SCENE_H
#define RENDER_SCENE_H

#include "examples/host/props.h"

enum { SCENE_ROUND = 8, SCENE_FRAMES = 6, SCENE_HOUSES = 400 };

typedef struct scene_count {
    size_t houses;          /* pixels of them in front of the full mesh */
    size_t through, sunk;   /* pixels that only impostors, only the full mesh leaves to a house */
    double worst, worst_sea; /* PSNR of whole pictures, without and with a sea */
    size_t holes;           /* pixels of sky where the full mesh has none nearby */
} scene_count;

/* Terrain, houses and, unless it is NULL, a sea. */
static void draw_scene(scene *s, terrimp_view *view, const flight_pose *pose, const props *p,
                       const float *sea_height, const uint8_t sky[3], uint8_t *rgb)
{
    terrimp_callbacks callbacks = gl_terrain_callbacks(&s->gl);
    terrimp_stats stats;
    terrimp_camera camera = aim(s, view, pose, &stats);
    camera.z_far = 5.0f * (s->info.box.max[0] - s->info.box.min[0]); /* the sea's end */
    need_ok(gl_terrain_begin(&s->gl, &camera, sky));
    need_ok(terrimp_view_render(view, &callbacks));
    gl_terrain_end(&s->gl);
    props_draw_houses(p, &s->gl);
    if (sea_height)
        props_draw_sea(p, &s->gl, *sea_height);
    glFinish();
    context_read(&s->context, rgb);
}

/* Of whole pictures, sky and all: the sea covers what terrain there is. */
static double whole_psnr(const scene *s, const uint8_t *a, const uint8_t *b)
{
    return image_psnr(image_mean_square(a, b, s->pixels, NULL));
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

/* How a scene is looked at, in each of eight directions; the last frame is judged. */
typedef struct scene_look {
    const char *name;
    int still;        /* from one place, as a host once did who found all of this; else a glide */
    float fov, side;  /* [degrees], and of the houses in samples */
    /* What is asked, of 10,000 pixels of houses, without and with exact depth, ... */
    unsigned through[2], sunk[2];
    double worst[2], worst_sea[2]; /* ... and [dB] */
} scene_look;

static flight_pose scene_pose(const scene *s, const scene_look *look, int direction, int frame)
{
    static const float heights[3] = { 0.03f, 0.15f, 0.4f };
    float heading = 45.0f * (float)direction + 10.0f, turn = heading * DEGREE;
    float way = look->still ? 0.0f : (float)frame / (float)(s->field.width - 1);
    return pose_at(s, 0.5f + way * cosf(turn), 0.5f + way * sinf(turn),
                   s->height_range * (look->still ? 0.24f : heights[direction % 3]), heading,
                   look->still ? 1.7f : 3.0f);
}

static void count_scene(scene *s, const terrimp_view_desc *settings, const scene_look *look,
                        scene_count *c)
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
    need(props_open(&p, &s->field, SCENE_HOUSES, look->side * s->field.spacing_x,
                    low + 0.05f * (high - low)));
    s->fov = look->fov * DEGREE;
    for (i = 0; i < SCENE_ROUND; i++) {
        flight_pose pose;
        for (k = 0; k < SCENE_FRAMES; k++) {
            pose = scene_pose(s, look, i, k);
            draw_scene(s, view, &pose, &p, NULL, magenta, ours);
        }
        draw_scene(s, full, &pose, &p, NULL, magenta, truth);
        count_houses(s, ours, truth, c);
        c->holes += stray_sky(s, ours, truth, STRAY);
        draw_scene(s, view, &pose, &p, NULL, light_blue, ours);
        draw_scene(s, full, &pose, &p, NULL, light_blue, truth);
        c->worst = fmin(c->worst, whole_psnr(s, ours, truth));
        for (sea = 1; sea <= 3; sea++) {
            float height = low + (high - low) * 0.04f * (float)(sea * sea);
            if (height >= pose.eye[1])
                continue;
            draw_scene(s, view, &pose, &p, &height, light_blue, ours);
            draw_scene(s, full, &pose, &p, &height, light_blue, truth);
            c->worst_sea = fmin(c->worst_sea, whole_psnr(s, ours, truth));
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
    static const scene_look looks[2] = {
        { "from one place", 1, 34.4f, 2.5f, { 50, 100 }, { 400, 50 }, { 34.0, 40.0 },
          { 34.0, 42.0 } },
        /* mode GEOMIP, whose ground is within half a pixel, has 13 of 901 over N41E001 */
        { "gliding", 0, 50.0f, 1.5f, { 50, 150 }, { 800, 300 }, { 34.0, 37.5 }, { 37.0, 39.5 } },
    };
    terrimp_view_desc settings = settings_of(TERRIMP_MODE_AUTO);
    int exact, i;
    for (exact = 0; exact < 2; exact++) {
        gl_terrain_close(&s->gl);
        s->exact_depth = exact;
        settings.exact_depth = exact ? terrimp_view_exact_depth() : NULL;
        scene_fill(s, ATLAS);
        for (i = 0; i < 2; i++) {
            const scene_look *look = &looks[i];
            scene_count c;
            count_scene(s, &settings, look, &c);
            printf("  %s, %s%s: of %u pixels of houses %u shine through, %u are sunk; at least "
                   "%.1f dB, with a sea %.1f; %u pixels of sky\n", s->name, look->name,
                   exact ? ", exact depth" : "", (unsigned)c.houses, (unsigned)c.through,
                   (unsigned)c.sunk, c.worst, c.worst_sea, (unsigned)c.holes);
            CHECK(c.houses > 500);
            CHECK(c.through * 10000 <= c.houses * look->through[exact]);
            CHECK(c.sunk * 10000 <= c.houses * look->sunk[exact]);
            CHECK(c.worst > look->worst[exact] && c.worst_sea > look->worst_sea[exact]);
            CHECK(c.holes == 0);
        }
    }
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
