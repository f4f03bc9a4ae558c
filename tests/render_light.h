/* Light that changes: pictures that are lit when they are drawn look like pictures made anew in
   that light, and pictures that are lit when they are made are renewed without a pop. */
#ifndef RENDER_LIGHT_H
#define RENDER_LIGHT_H

#include "examples/host/quality.h"

enum { LIGHT_SUNS = 12, LIGHT_FRAMES = 120 };

/* The sun at a time of the day, 0..1 from rise to set, and the sky. */
static void light_at(float day, float light[3][3])
{
    float turn = 3.14159265f * (0.06f + 0.88f * day);
    int i;
    light[0][0] = cosf(turn);
    light[0][1] = 0.8f * sinf(turn);
    light[0][2] = -0.6f * sinf(turn);
    for (i = 0; i < 3; i++) {
        light[1][i] = 0.78f;
        light[2][i] = 0.30f;
    }
}

/* OpenGL anew, with ground that is lit by normals; pictures when they are drawn, or made. */
static void scene_light(scene *s, int relit)
{
    gl_terrain_close(&s->gl);
    free(s->lightmap);
    free(s->normals);
    s->lightmap = lightmap_bake_unlit(&s->field, &s->normals);
    need(s->lightmap ? NULL : "no lightmap");
    s->relit = relit;
    scene_fill(s, ATLAS);
}

/* Frame i of a day, in which the eye glides so many cells a frame. Returns how many impostors. */
static uint32_t draw_of_day(scene *s, terrimp_view *view, float step, int i, uint8_t *picture)
{
    float along = step * (float)i / (float)(s->field.width - 1u);
    flight_pose pose = pose_at(s, 0.1f + along, 0.1f + along, 0.8f * s->height_range, 45.0f, 16.0f);
    return draw_pose(s, view, &pose, light_blue, picture).impostors;
}

static void turn_sun(scene *s, int i)
{
    float light[3][3];
    light_at((float)i / (LIGHT_SUNS - 1), light);
    gl_terrain_light(&s->gl, (const float(*)[3])light);
}

/* A whole day. anew: no picture is older than the frame. */
static void fly_day(scene *s, const terrimp_view_desc *settings, float step, int anew,
                    uint8_t *pictures)
{
    terrimp_view *view = open_view(s, settings);
    uint32_t drawn = 0;
    int i;
    for (i = 0; i < LIGHT_SUNS; i++) {
        turn_sun(s, i);
        if (anew)
            need_ok(terrimp_view_invalidate(view));
        drawn += draw_of_day(s, view, step, i, pictures + (size_t)i * s->pixels * 3);
    }
    CHECK(settings->mode == TERRIMP_MODE_FULL || drawn > 150 * LIGHT_SUNS);
    terrimp_view_destroy(view);
}

/* Every fourth frame with pictures as old as on that day, but made in the light that it is drawn
   in: what is left is what light costs. */
static void fly_suns(scene *s, const terrimp_view_desc *settings, float step, uint8_t *pictures)
{
    int i, k;
    for (i = 3; i < LIGHT_SUNS; i += 4) {
        terrimp_view *view = open_view(s, settings);
        turn_sun(s, i);
        for (k = 0; k <= i; k++)
            draw_of_day(s, view, step, k, pictures + (size_t)i * s->pixels * 3);
        terrimp_view_destroy(view);
    }
}

static void check_relit(scene *s, float step, double least)
{
    terrimp_view_desc settings = settings_of(TERRIMP_MODE_IMPOSTOR), full = settings;
    size_t bytes = s->pixels * 3, i;
    uint8_t *relit = (uint8_t *)allocate(bytes * LIGHT_SUNS);
    uint8_t *anew = (uint8_t *)allocate(bytes * LIGHT_SUNS);
    uint8_t *truth = (uint8_t *)allocate(bytes * LIGHT_SUNS);
    uint8_t *alike = (uint8_t *)allocate(bytes * LIGHT_SUNS);
    double worst = 99.0, worst_alike = 99.0, mean[3] = { 0.0, 0.0, 0.0 };
    settings.no_spreading = 1; /* all are pictures, in each frame: most would be ground */
    settings.max_captures = 1024;
    full.mode = TERRIMP_MODE_FULL;
    full.max_ground = 0;
    scene_light(s, 1);
    fly_day(s, &settings, step, 0, relit);
    scene_light(s, 0);
    fly_day(s, &settings, step, 1, anew);
    fly_suns(s, &settings, step, alike);
    fly_day(s, &full, step, 0, truth);
    for (i = 0; i < LIGHT_SUNS; i++) {
        double likeness = psnr(s, relit + i * bytes, anew + i * bytes);
        worst = fmin(worst, likeness);
        if (i % 4 == 3)
            worst_alike = fmin(worst_alike, psnr(s, relit + i * bytes, alike + i * bytes));
        mean[0] += likeness / LIGHT_SUNS;
        mean[1] += psnr(s, relit + i * bytes, truth + i * bytes) / LIGHT_SUNS;
        mean[2] += psnr(s, anew + i * bytes, truth + i * bytes) / LIGHT_SUNS;
        if (likeness < least) {
            keep_picture(s, "relit", i, relit + i * bytes);
            keep_picture(s, "anew", i, anew + i * bytes);
        }
    }
    printf("  %s, %.0f cells a frame: lit when drawn against pictures made anew: %.2f dB, worst "
           "%.2f; against the full mesh %.2f and %.2f; against pictures as old: at least %.2f dB\n",
           s->name, (double)step, mean[0], worst, mean[1], mean[2], worst_alike);
    CHECK(worst >= least);
    CHECK(worst_alike >= 51.0);
    CHECK(mean[1] >= mean[2] - 0.25);
    free(relit);
    free(anew);
    free(truth);
    free(alike);
}

static void pictures_lit_when_drawn_are_like_new_ones(void)
{
    static const dem_desc whole = { 0 };
    scene s;
    open_hills(&s, 640, 512, 50.0f);
    check_relit(&s, 0.0f, 39.5);
    check_relit(&s, 1.0f, 36.0);
    scene_close(&s);
    if (!open_tile(&s, "N42E001.hgt", &whole)) {
        SKIP("there is no N42E001.hgt");
        return;
    }
    scene_show(&s, 640, 512, 50.0f, ATLAS);
    check_relit(&s, 0.0f, 39.5);
    check_relit(&s, 1.0f, 36.0);
    scene_close(&s);
}

/* The eye rests while the sun moves four times as fast as in a day of 24 minutes. */
static void renewed_light_does_not_pop(void)
{
    terrimp_view_desc settings = settings_of(TERRIMP_MODE_AUTO);
    terrimp_view *view, *full;
    uint8_t *ours[2], *truth[2];
    float light[3][3];
    double worst = 0.0;
    uint32_t captures = 0, impostors = 0, i;
    scene s;
    open_hills(&s, 320, 256, 50.0f);
    scene_light(&s, 0);
    view = open_view(&s, &settings);
    full = open_full_view(&s);
    for (i = 0; i < 2; i++) {
        ours[i] = open_picture(&s);
        truth[i] = open_picture(&s);
    }
    for (i = 0; i < LIGHT_FRAMES; i++) {
        flight_pose pose = pose_at(&s, 0.2f, 0.25f, 0.3f * s.height_range, 45.0f, 12.0f);
        terrimp_stats stats;
        quality_change c;
        light_at(0.2f + 2.91e-4f / (0.88f * 3.14159265f) * (float)i, light);
        gl_terrain_light(&s.gl, (const float(*)[3])light);
        need_ok(terrimp_view_light(view, light[0], 0.0f));
        stats = draw_pose(&s, view, &pose, light_blue, ours[i % 2]);
        impostors = stats.impostors;
        draw_pose(&s, full, &pose, light_blue, truth[i % 2]);
        if (i < 2)
            continue;
        captures += stats.captures;
        c = quality_compare_change(ours[(i + 1) % 2], ours[i % 2], truth[(i + 1) % 2], truth[i % 2],
                                   s.width, s.height);
        worst = fmax(worst, c.block);
    }
    printf("  %u pictures, %.2f captures a frame; the worst pop %.2f grey levels\n",
           (unsigned)impostors, (double)captures / (LIGHT_FRAMES - 2), worst);
    CHECK(impostors > 5 && captures > 5 && captures <= 2 * LIGHT_FRAMES && worst <= 5.0);
    terrimp_view_destroy(view);
    terrimp_view_destroy(full);
    for (i = 0; i < 2; i++) {
        free(ours[i]);
        free(truth[i]);
    }
    scene_close(&s);
}

#endif
