/* Laws of numbers: units, and eyes at the ends of the world. */

typedef struct numbers_seen {
    uint32_t hash, captures, impostors, infinite;
} numbers_seen;

static void numbers_mix(numbers_seen *seen, uint32_t value)
{
    seen->hash = (seen->hash ^ value) * 16777619u;
}

static void numbers_check(numbers_seen *seen, const float *values, int count)
{
    int i;
    for (i = 0; i < count; i++)
        seen->infinite += !(values[i] >= -FLT_MAX && values[i] <= FLT_MAX);
}

static void numbers_begin(void *user, const terrimp_capture_command *c)
{
    numbers_seen *seen = (numbers_seen *)user;
    seen->captures++;
    numbers_mix(seen, c->node);
    numbers_mix(seen, c->slot.x);
    numbers_mix(seen, c->slot.width);
    numbers_mix(seen, c->slot.height);
    numbers_check(seen, c->view, 16);
    numbers_check(seen, c->projection, 16);
}

static void numbers_end(void *user, const terrimp_capture_command *c)
{
    numbers_mix((numbers_seen *)user, c->part);
}

static void numbers_impostor(void *user, const terrimp_impostor_command *c)
{
    numbers_seen *seen = (numbers_seen *)user;
    numbers_mix(seen, c->node);
    numbers_mix(seen, c->part);
    numbers_mix(seen, (uint32_t)(c->alpha * 65536.0f));
    numbers_check(seen, c->texture_matrix, 16);
    numbers_check(seen, c->place_matrix, 16);
    seen->impostors++;
}

static void numbers_ground(void *user, const terrimp_ground_command *c)
{
    numbers_mix((numbers_seen *)user, c->node);
    numbers_mix((numbers_seen *)user, c->first_index);
}

static terrimp_callbacks numbers_callbacks(numbers_seen *seen)
{
    terrimp_callbacks all;
    memset(&all, 0, sizeof all);
    memset(seen, 0, sizeof *seen);
    all.user = seen;
    all.begin_capture = numbers_begin;
    all.end_capture = numbers_end;
    all.draw_impostor = numbers_impostor;
    all.draw_ground = numbers_ground;
    return all;
}

enum { NUMBERS_SIDE = 97 };

static terrimp_terrain *numbers_terrain(const uint16_t *samples, float unit)
{
    terrimp_terrain_desc d;
    terrimp_terrain *t = NULL;
    memset(&d, 0, sizeof d);
    d.field.samples = samples;
    d.field.width = d.field.depth = NUMBERS_SIDE;
    d.field.format = TERRIMP_FORMAT_U16;
    d.field.spacing_x = d.field.spacing_z = unit;
    d.field.height_scale = 0.01f * unit;
    d.chunk_quads = 8;
    CHECK(terrimp_terrain_create(&d, NULL, &t) == TERRIMP_OK);
    return t;
}

static uint16_t *numbers_samples(void)
{
    uint16_t *samples = (uint16_t *)malloc(NUMBERS_SIDE * NUMBERS_SIDE * sizeof *samples);
    int x, z;
    for (z = 0; z < NUMBERS_SIDE; z++)
        for (x = 0; x < NUMBERS_SIDE; x++)
            samples[z * NUMBERS_SIDE + x] =
                (uint16_t)(2000.0f + 1200.0f * sinf((float)x * 0.05f) * cosf((float)z * 0.043f) +
                           (float)random_range(0, 300));
    return samples;
}

/* A flight over a terrain whose samples are `unit` apart. Adds to what is made and drawn. */
static uint32_t numbers_flight(const terrimp_terrain *t, int mode, float unit, uint32_t *captures,
                               uint32_t *impostors)
{
    terrimp_view_desc d;
    terrimp_view *view;
    numbers_seen seen;
    terrimp_callbacks all = numbers_callbacks(&seen);
    int frame;
    memset(&d, 0, sizeof d);
    d.mode = mode;
    d.costs.capture = 100.0f;
    d.exact_depth = terrimp_view_exact_depth();
    CHECK(terrimp_view_create(t, &d, NULL, &view) == TERRIMP_OK);
    for (frame = 0; frame < 20; frame++) {
        terrimp_camera c;
        memset(&c, 0, sizeof c);
        c.eye[0] = (float)(frame - 20) * unit;
        c.eye[1] = 60.0f * unit;
        c.eye[2] = 0.5f * (float)frame * unit;
        c.forward[0] = 1.0f;
        c.forward[1] = -0.3f;
        c.forward[2] = 0.8f;
        c.width_px = 1280;
        c.height_px = 1024;
        c.z_near = 0.5f * unit;
        c.z_far = 2000.0f * unit;
        CHECK(terrimp_view_update(view, &c) == TERRIMP_OK);
        CHECK(terrimp_view_render(view, &all) == TERRIMP_OK);
    }
    CHECK(seen.infinite == 0 && (mode == TERRIMP_MODE_GEOMIP || seen.captures > 0));
    *captures += seen.captures;
    *impostors += seen.impostors;
    terrimp_view_destroy(view);
    return seen.hash;
}

static void decisions_do_not_depend_on_the_unit_of_length(void)
{
    uint16_t *samples = numbers_samples();
    uint32_t wanted[TERRIMP_MODE_COUNT];
    int mode, k;
    for (k = -60; k <= 40; k += 15) { /* first in units of 1 */
        float unit = k == -60 ? 1.0f : ldexpf(1.0f, k);
        uint32_t captures = 0, impostors = 0;
        terrimp_terrain *t = numbers_terrain(samples, unit);
        for (mode = TERRIMP_MODE_GEOMIP; mode <= (int)TERRIMP_MODE_AUTO; mode++) {
            uint32_t hash = numbers_flight(t, mode, unit, &captures, &impostors);
            if (k == -60)
                wanted[mode] = hash;
            CHECK(hash == wanted[mode]);
        }
        CHECK(captures > 20 && impostors > 100);
        terrimp_terrain_destroy(t);
    }
    free(samples);
}

/* From however far an eye may look, matrices are finite; farther eyes are refused. */
static void eyes_at_the_end_of_the_world_get_finite_matrices(void)
{
    uint16_t *samples = numbers_samples();
    terrimp_terrain *t = numbers_terrain(samples, 1.0f);
    terrimp_view_desc d;
    uint32_t captures = 0;
    float at;
    memset(&d, 0, sizeof d);
    d.mode = TERRIMP_MODE_IMPOSTOR;
    d.exact_depth = terrimp_view_exact_depth();
    for (at = 1e3f; at < 1e38f; at *= 10.0f) {
        numbers_seen seen;
        terrimp_callbacks all = numbers_callbacks(&seen);
        terrimp_view *view;
        terrimp_camera c;
        memset(&c, 0, sizeof c);
        c.eye[0] = -at;
        c.eye[1] = 0.3f * at;
        c.forward[0] = 1.0f;
        c.forward[1] = -0.3f;
        c.fov_y_rad = 0.01f;
        c.width_px = 640;
        c.height_px = 480;
        c.z_near = 1.0f;
        c.z_far = fminf(2.0f * at, 1e18f);
        CHECK(terrimp_view_create(t, &d, NULL, &view) == TERRIMP_OK);
        CHECK(terrimp_view_update(view, &c) == (at <= 1e18f ? TERRIMP_OK : TERRIMP_E_RANGE));
        if (at <= 1e18f)
            CHECK(terrimp_view_render(view, &all) == TERRIMP_OK);
        CHECK(seen.infinite == 0);
        captures += seen.captures;
        terrimp_view_destroy(view);
    }
    CHECK(captures > 0);
    terrimp_terrain_destroy(t);
    free(samples);
}

static inline void numbers_tests(void)
{
    RUN(decisions_do_not_depend_on_the_unit_of_length);
    RUN(eyes_at_the_end_of_the_world_get_finite_matrices);
}
