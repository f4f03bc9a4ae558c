/* What lies behind ridges and is not drawn would not have shown: ground at full resolution and
   mipmapped ground give the same pixels with a horizon or visible sets and without. */
#ifndef RENDER_HIDDEN_H
#define RENDER_HIDDEN_H

enum { HIDDEN_FRAMES = 14 };

typedef struct hidden_count {
    uint32_t hidden;    /* nodes left out, in all */
    size_t different;   /* pixels */
    double likeness[2]; /* to the full mesh, without a horizon and with one, mean dB */
} hidden_count;

/* Low flights across the terrain, each frame somewhere else but the second of two. */
static flight_pose hidden_pose(const scene *s, int frame)
{
    float t = (float)(frame / 2), along = (float)(frame % 2) / (float)(s->field.width - 1u);
    float up = s->height_range * (frame % 6 < 2 ? 0.01f : frame % 6 < 4 ? 0.05f : 0.2f);
    return pose_at(s, 0.5f + 0.35f * cosf(1.7f * t) + along, 0.5f + 0.35f * sinf(2.3f * t), up,
                   77.0f * t, 4.0f);
}

static hidden_count count_hidden(scene *s, int mode, terrimp_hider *hider)
{
    terrimp_view_desc settings = settings_of(mode), horizon = settings;
    terrimp_view *views[2], *full = open_full_view(s);
    uint8_t *plain = open_picture(s), *culled = open_picture(s), *truth = open_picture(s);
    hidden_count c = { 0, 0, { 0.0, 0.0 } };
    int i;
    horizon.hider = hider;
    views[0] = open_view(s, &settings);
    views[1] = open_view(s, &horizon);
    for (i = 0; i < HIDDEN_FRAMES; i++) {
        flight_pose pose = hidden_pose(s, i);
        draw_pose(s, views[0], &pose, light_blue, plain);
        c.hidden += draw_pose(s, views[1], &pose, light_blue, culled).hidden;
        c.different += count_different(plain, culled, s->pixels);
        draw_pose(s, full, &pose, light_blue, truth);
        c.likeness[0] += psnr(s, plain, truth) / HIDDEN_FRAMES;
        c.likeness[1] += psnr(s, culled, truth) / HIDDEN_FRAMES;
    }
    free(plain);
    free(culled);
    free(truth);
    for (i = 0; i < 2; i++)
        terrimp_view_destroy(views[i]);
    terrimp_view_destroy(full);
    return c;
}

static void check_hidden(scene *s)
{
    static const int modes[3] = { TERRIMP_MODE_FULL, TERRIMP_MODE_GEOMIP, TERRIMP_MODE_AUTO };
    const terrimp_quadtree *tree = terrimp_terrain_tree(s->terrain);
    void *walls = allocate(terrimp_walls_bytes(tree));
    static terrimp_horizon horizon;
    terrimp_sets sets;
    uint32_t k;
    int i;
    need_ok(terrimp_walls_build(tree, NULL, walls));
    need_ok(terrimp_horizon_init(&horizon, tree, walls));
    memset(&sets, 0, sizeof sets);
    sets.codes = (uint8_t *)allocate(terrimp_sets_bytes(tree, &sets));
    for (i = 0; i < 6; i++) {
        hidden_count c;
        sets.error = i < 2 ? 0.0f : 0.05f;
        need_ok(terrimp_sets_init(&sets, tree));
        for (k = 0; i < 4 && i % 2 && k < tree->level_first[1]; k++) /* for the modes that follow */
            need_ok(terrimp_sets_build_cell(&sets, walls, k, NULL));
        c = count_hidden(s, modes[i / 2], i % 2 ? &sets.hider : &horizon.hider);
        printf("  %s, %s, mode %d: %u nodes hidden, %u pixels differ; %.2f dB without, %.2f with\n",
               s->name, i % 2 ? "sets" : "horizon", modes[i / 2], (unsigned)c.hidden,
               (unsigned)c.different, c.likeness[0], c.likeness[1]);
        CHECK(c.hidden > (i % 2 ? 0 : 20)); /* coarse ground hides less for certain */
        /* AUTO makes its pictures in other frames then, from other places; from 60 dB on that is
           rounding, and a node that shows and is not drawn costs far more */
        CHECK(modes[i / 2] == TERRIMP_MODE_AUTO
                  ? c.likeness[1] > fmin(c.likeness[0] - 1.0, 60.0) : c.different == 0);
    }
    free(sets.codes);
    free(walls);
}

static void what_ridges_hide_shows_no_pixel(void)
{
    static const dem_desc whole = { 0 };
    scene s;
    open_hills(&s, 480, 384, 60.0f);
    check_hidden(&s);
    scene_close(&s);
    if (!open_tile(&s, "N42E001.hgt", &whole)) {
        SKIP("there is no N42E001.hgt");
        return;
    }
    scene_show(&s, 480, 384, 60.0f, ATLAS);
    check_hidden(&s);
    scene_close(&s);
}

#endif
