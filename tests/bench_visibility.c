/* What hiding is worth where people are: a walk 2 m above the ground, a flight through a valley at
   100 m, one over a pass at 400 m, over real tiles and a rough one: nodes drawn, captures and the
   processor's time of an update without anything that hides, with a horizon, with visible sets, and
   with both. And how much of what is hidden they find: of the nodes in the frustum those are hidden
   that none of 81 rays from the eye to points on them reaches.

   Build:  make bench_visibility
   Use:    build/bench_visibility [FILE.hgt...]    (none: two real tiles, and build/bench/rough.hgt)
   Leaves: build/bench/visibility.md (what it prints), visibility.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_say.h"

#include "examples/host/tour.h"

#include <math.h>

enum { NONE, HORIZON, SETS, BOTH, WAYS };
static const char *const way_names[WAYS] = {"nothing", "horizon", "sets", "both"};

typedef struct place {
    const terrimp_quadtree *tree;
    terrimp_terrain *terrain;
    void *walls;
    terrimp_horizon horizon;
    terrimp_sets sets;
    flight way; /* so far over the ground: */
    float up;
} place;

/* Flies once round in so many frames, `up` over the ground. */
static void fly(place *p, size_t frames, float up)
{
    const terrimp_heightfield *f = &p->tree->field;
    float wide = (float)(f->width - 1u) * f->spacing_x;
    float deep = (float)(f->depth - 1u) * f->spacing_z;
    float round = 6.2831853f * 0.35f * (wide < deep ? wide : deep);
    flight_free(&p->way);
    p->up = up;
    if (!flight_circle(&p->way, f, frames, round / (float)frames, up))
        bench_stop("a flight", p->way.error);
}

static terrimp_camera camera_at(const place *p, size_t frame)
{
    terrimp_box box;
    terrimp_camera camera;
    need(terrimp_terrain_get_box(p->terrain, terrimpi_tree_root(p->tree).number, &box));
    camera = tour_camera_at(&p->way.poses[frame], &box, 1.0472f, 1280, 1024);
    camera.z_near = 0.2f * p->up; /* what is cut off hides nothing */
    return camera;
}

/* Makes what `way` says of it the hider of a view. */
static terrimp_hider *hider_of(place *p, int way)
{
    p->sets.hider.next = way == BOTH ? &p->horizon.hider : NULL;
    return way == NONE ? NULL : way == HORIZON ? &p->horizon.hider : &p->sets.hider;
}

static void build_sets(place *p, float error)
{
    uint32_t cell;
    p->sets.error = error;
    need(terrimp_sets_init(&p->sets, p->tree));
    for (cell = 0; cell < p->tree->level_first[1]; cell++)
        need(terrimp_sets_build_cell(&p->sets, p->walls, cell, NULL));
}

/* Whether one of 81 rays reaches a node of level 0. */
static int seen(const place *p, const terrimp_camera *c, const terrimp_node *n)
{
    const terrimp_heightfield *f = &p->tree->field;
    uint32_t k, i;
    for (k = 0; k < 81; k++) {
        uint32_t x = n->x * p->tree->chunk_quads + k % 9u * p->tree->chunk_quads / 8u;
        uint32_t z = n->z * p->tree->chunk_quads + k / 9u * p->tree->chunk_quads / 8u;
        float to[3], far_off = 0.0f;
        x = x < f->width ? x : f->width - 1u;
        z = z < f->depth ? z : f->depth - 1u;
        to[0] = f->origin_x + (float)x * f->spacing_x - c->eye[0];
        to[1] = terrimpi_field_sample(f, x, z);
        to[1] -= c->eye[1];
        to[2] = f->origin_z + (float)z * f->spacing_z - c->eye[2];
        for (i = 0; i < 3; i++)
            far_off += to[i] * to[i];
        if (terrimp_heightfield_raycast(f, c->eye, to, 0.999f * sqrtf(far_off), NULL) != TERRIMP_OK)
            return 1;
    }
    return 0;
}

static void bench_found(place *p, float up, size_t frames)
{
    size_t frame;
    uint32_t n, hidden = 0, all = 0, found[WAYS] = {0};
    fly(p, frames, up);
    for (frame = 0; frame < frames; frame += 4) {
        terrimp_camera c = camera_at(p, frame);
        terrimp_frustum frustum;
        need(terrimp_camera_resolve(&c, &c));
        need(terrimp_camera_frustum(&c, &frustum));
        if (!p->horizon.hider.begin(&p->horizon.hider, &c, 0.0f, 0.0f) ||
            !p->sets.hider.begin(&p->sets.hider, &c, 0.0f, 0.0f))
            continue;
        for (n = 0; n < p->tree->level_first[1]; n++) {
            terrimp_node node = terrimpi_tree_node(p->tree, n);
            terrimp_box box;
            need(terrimp_terrain_get_box(p->terrain, n, &box));
            if (terrimp_frustum_test(&frustum, &box, TERRIMP_PLANES_ALL) == TERRIMP_PLANES_OUTSIDE)
                continue;
            all++;
            if (seen(p, &c, &node))
                continue;
            hidden++;
            found[HORIZON] += p->horizon.hider.hides(&p->horizon.hider, &node) != 0;
            found[SETS] += p->sets.hider.hides(&p->sets.hider, &node) != 0;
        }
    }
    say("Hidden %.1f %% of the nodes in the frustum; the horizon finds %.1f %% of these, sets "
        "%.1f %%\n\n", 100.0 * hidden / all, 100.0 * found[HORIZON] / hidden,
        100.0 * found[SETS] / hidden);
}

/* Pictures count as made when they have been given out. */
static void on_capture(void *user, const terrimp_capture_command *command)
{
    (void)user, (void)command;
}

static void on_ground(void *user, const terrimp_ground_command *command)
{
    (void)user, (void)command;
}

static void on_impostor(void *user, const terrimp_impostor_command *command)
{
    (void)user, (void)command;
}

static void bench_mode(place *p, const char *name, int mode, float up, size_t frames)
{
    static const char *const modes[] = {"", "full", "geomip", "impostor", "auto"};
    terrimp_callbacks draw = {NULL, on_capture, on_capture, on_impostor, on_ground, NULL};
    terrimp_view *views[WAYS];
    double nodes[WAYS] = {0}, captures[WAYS] = {0};
    stats ms[WAYS];
    size_t frame, i;
    int way;
    for (way = 0; way < WAYS; way++) {
        terrimp_view_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.mode = mode;
        desc.hider = hider_of(p, way);
        need(terrimp_view_create(p->terrain, &desc, NULL, &views[way]));
        memset(&ms[way], 0, sizeof ms[way]);
    }
    fly(p, 20u * frames, up);
    for (frame = 0; frame < frames; frame++)
        for (i = 0; i < WAYS; i++) { /* in turns, each first as often */
            terrimp_camera c = camera_at(p, frame);
            terrimp_stats s;
            double start;
            way = (int)((frame + i) % WAYS);
            (void)hider_of(p, way);
            start = clock_cpu_ms();
            need(terrimp_view_update(views[way], &c));
            stats_add(&ms[way], clock_cpu_ms() - start);
            need(terrimp_view_get_stats(views[way], &s));
            need(terrimp_view_render(views[way], &draw));
            nodes[way] += (double)(s.ground + s.impostors) / (double)frames;
            if (frame >= frames / 4) /* at first all pictures are missing */
                captures[way] += (double)s.captures / (0.75 * (double)frames);
        }
    for (way = 0; way < WAYS; way++) {
        say("| %s, %g | %s | %s | %.1f | %.2f | %.0f |\n", name, (double)up, modes[mode],
            way_names[way], nodes[way], captures[way], 1e3 * stats_summarise(&ms[way]).median);
        terrimp_view_destroy(views[way]);
        stats_free(&ms[way]);
    }
}

static void bench_file(const char *path)
{
    const char *name = strrchr(path, '/') ? strrchr(path, '/') + 1 : path;
    int rough = strncmp(name, "rough", 5) == 0, i;
    static const float heights[3] = {2.0f, 100.0f, 400.0f}, low[3] = {2.0f, 20.0f, 60.0f};
    size_t frames = bench_frames(120);
    terrimp_terrain_desc desc;
    tour_desc from;
    double start;
    place p;
    tour t;
    memset(&desc, 0, sizeof desc);
    memset(&from, 0, sizeof from);
    memset(&p, 0, sizeof p);
    from.dem = path;
    if (!tour_load(&t, &from))
        bench_stop(path, t.error);
    desc.field = t.field;
    need(terrimp_terrain_create(&desc, NULL, &p.terrain));
    p.tree = terrimp_terrain_tree(p.terrain);
    p.walls = need_memory(terrimp_walls_bytes(p.tree));
    need(terrimp_walls_build(p.tree, NULL, p.walls));
    need(terrimp_horizon_init(&p.horizon, p.tree, p.walls));
    p.sets.codes = need_memory(terrimp_sets_bytes(p.tree, &p.sets));
    start = clock_cpu_ms();
    build_sets(&p, 0.0f);
    say("\n%s: %u x %u samples, %u nodes. Walls %.3f bytes a sample; sets %.1f KiB, %.1f ms a "
        "cell\n\n", name, (unsigned)t.field.width, (unsigned)t.field.depth,
        (unsigned)p.tree->level_first[1],
        (double)terrimp_walls_bytes(p.tree) / ((double)t.field.width * t.field.depth),
        (double)terrimp_sets_bytes(p.tree, &p.sets) / 1024.0,
        (clock_cpu_ms() - start) / p.tree->level_first[1]);
    for (i = 0; i < 3; i++) {
        say("%g over the ground. ", (double)(rough ? low : heights)[i]);
        bench_found(&p, (rough ? low : heights)[i], 160);
    }
    say("\n| place, height | mode | hidden by | nodes drawn | captures a frame | update us |\n"
        "|:--|:--|:--|--:|--:|--:|\n");
    for (i = 0; i < 3; i++)
        bench_mode(&p, name, TERRIMP_MODE_FULL, (rough ? low : heights)[i], frames);
    build_sets(&p, 0.02f); /* as coarse ground and pictures need */
    for (i = 0; i < 3; i++) {
        bench_mode(&p, name, TERRIMP_MODE_GEOMIP, (rough ? low : heights)[i], frames);
        bench_mode(&p, name, TERRIMP_MODE_AUTO, (rough ? low : heights)[i], frames);
    }
    flight_free(&p.way);
    free(p.sets.codes);
    free(p.walls);
    terrimp_terrain_destroy(p.terrain);
    tour_close(&t);
}

int main(int argc, char **argv)
{
    static const char *const tiles[] = {"N42E001.hgt", "N49E011.hgt"};
    FILE *file;
    int i;
    say_open("visibility", 1);
    say_machine(NULL);
    for (i = 1; i < argc; i++)
        bench_file(argv[i]);
    for (i = 0; argc < 2 && i < 3; i++) {
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", i < 2 ? bench_data() : bench_folder,
                 i < 2 ? tiles[i] : "rough.hgt");
        file = fopen(path, "rb");
        if (!file) {
            say("\n%s is not there\n", path);
            continue;
        }
        fclose(file);
        bench_file(path);
    }
    say_close();
    return 0;
}
