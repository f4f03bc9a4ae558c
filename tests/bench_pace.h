/* What max_cost makes of flights over real and rough terrain: nothing is drawn, all costs are
   those that the view predicts. */
#ifndef BENCH_PACE_H
#define BENCH_PACE_H

#include "bench_say.h"

#include "examples/host/dem.h"

#include <math.h>

enum { PACE_SIDE = 1025, PACE_FRAMES = 400, PACE_FIRST = 40, PACE_WAYS = 3 };

static void pace_capture(void *user, const terrimp_capture_command *c) { (void)user, (void)c; }
static void pace_ground(void *user, const terrimp_ground_command *c) { (void)user, (void)c; }
static void pace_impostor(void *user, const terrimp_impostor_command *c) { (void)user, (void)c; }

/* Straight on, a circle, or slowly on while the eye looks round. */
static terrimp_camera pace_camera(const terrimp_heightfield *field, int way, int frame)
{
    float side = field->spacing_x * (float)(PACE_SIDE - 1), t = (float)frame / (float)PACE_FRAMES;
    float turn = 6.2831853f * t * (way == 2 ? 3.0f : 1.0f), ground = 0.0f;
    terrimp_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.eye[0] = way == 0 ? 0.1f + 0.73f * t : way == 1 ? 0.5f + 0.35f * cosf(turn)
                                                           : 0.3f + 0.2f * t;
    camera.eye[2] = way == 0 ? 0.45f : way == 1 ? 0.5f + 0.35f * sinf(turn) : 0.4f;
    camera.eye[0] *= side, camera.eye[2] *= side;
    camera.forward[0] = way == 0 ? 1.0f : way == 1 ? -sinf(turn) : cosf(turn);
    camera.forward[2] = way == 0 ? 0.1f : way == 1 ? cosf(turn) : sinf(turn);
    camera.forward[1] = way == 0 ? -0.15f : way == 1 ? -0.1f : -0.2f;
    need(terrimp_heightfield_height(field, camera.eye[0], camera.eye[2], &ground));
    camera.eye[1] = ground + 0.02f * side;
    camera.width_px = 640, camera.height_px = 480, camera.fov_y_rad = 0.8f;
    camera.z_near = 0.0005f * side, camera.z_far = 1.5f * side;
    return camera;
}

/* What a flight's frames cost. */
static stats_summary pace_fly(const terrimp_terrain *terrain, const terrimp_heightfield *field,
                              int way, int mode, float max_cost)
{
    stats costs = { NULL, 0, 0 };
    stats_summary of;
    terrimp_view_desc d;
    terrimp_view *view = NULL;
    terrimp_callbacks draw;
    int i;
    memset(&d, 0, sizeof d);
    memset(&draw, 0, sizeof draw);
    d.mode = mode, d.max_cost = max_cost, d.cost_limit = terrimp_view_cost_limit();
    draw.begin_capture = draw.end_capture = pace_capture;
    draw.draw_ground = pace_ground, draw.draw_impostor = pace_impostor;
    need(terrimp_view_create(terrain, &d, NULL, &view));
    for (i = 0; i < PACE_FIRST + PACE_FRAMES; i++) {
        terrimp_camera camera = pace_camera(field, way, i);
        terrimp_stats of_frame;
        need(terrimp_view_update(view, &camera));
        need(terrimp_view_get_stats(view, &of_frame));
        need(terrimp_view_render(view, &draw));
        if (i >= PACE_FIRST && !stats_add(&costs, (double)of_frame.cost))
            bench_stop("memory", "there is none");
    }
    terrimp_view_destroy(view);
    of = stats_summarise(&costs);
    stats_free(&costs);
    return of;
}

/* Says a row: of three flights, freely and with the free median as max_cost. */
static void pace_row(const char *name, const terrimp_terrain_desc *desc, int mode)
{
    terrimp_terrain *terrain = NULL;
    int way;
    need(terrimp_terrain_create(desc, NULL, &terrain));
    say("| %s | %u | %s |", name, (unsigned)desc->chunk_quads,
        mode == TERRIMP_MODE_AUTO ? "AUTO" : "GEOMIP");
    for (way = 0; way < PACE_WAYS; way++) {
        stats_summary free_of = pace_fly(terrain, &desc->field, way, mode, 0.0f);
        stats_summary of = pace_fly(terrain, &desc->field, way, mode, (float)free_of.median);
        say(" %.2f | %.2f | %.2f |", free_of.p99 / free_of.median, of.p99 / of.median,
            of.worst / free_of.median);
    }
    say("\n");
    terrimp_terrain_destroy(terrain);
}

/* Over the terrains that are at hand. */
static void pace_flights(void)
{
    static const char *const names[] = { "N42E001.hgt", "N49E011.hgt", "rough" };
    int i;
    say("\nFlights of %d frames over %d x %d samples, straight on, in a circle, and while the eye "
        "looks round: 99 %% over the\nmedian of what frames are predicted to cost, freely and with "
        "the free median as `max_cost`, and the dearest frame\nover it\n\n"
        "| terrain | chunk | mode | straight, free | limited | dearest | circle, free | limited | "
        "dearest | looking round, free | limited | dearest |\n"
        "|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n", PACE_FRAMES, PACE_SIDE, PACE_SIDE);
    for (i = 0; i < 3; i++) {
        terrimp_terrain_desc desc;
        dem_desc part;
        dem file;
        const char *trouble;
        char path[512];
        uint32_t chunk;
        snprintf(path, sizeof path, "%s/%s", i < 2 ? bench_data() : bench_folder,
                 i < 2 ? names[i] : "rough.hgt");
        memset(&part, 0, sizeof part);
        memset(&desc, 0, sizeof desc);
        part.crop_width = part.crop_depth = PACE_SIDE;
        if (!dem_load(&file, path, &part)) {
            say("\n%s: %s: left out\n", path, file.error);
            continue;
        }
        dem_fill_voids(&file, &trouble);
        desc.field = dem_heightfield(&file);
        desc.field.spacing_x = desc.field.spacing_z = i < 2 ? 80.0f : 1.0f;
        desc.field.height_scale = i < 2 ? 1.0f : 0.05f;
        for (chunk = 16; chunk <= 64; chunk *= 2) {
            desc.chunk_quads = chunk;
            pace_row(names[i], &desc, TERRIMP_MODE_GEOMIP);
            pace_row(names[i], &desc, TERRIMP_MODE_AUTO);
        }
        dem_free(&file);
    }
}

#endif
