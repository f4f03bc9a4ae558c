/* Shows how a host tells a view what drawing costs on its machine: measured once, at the start, by
   host/gl_costs.c. A view that knows it chooses between ground and impostors accordingly.
   Build:  make costs
   Expect: five costs in microseconds and in triangles, beside the defaults; on a busy machine they
           vary. Then what the same frame consists of with the defaults and with these. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "host/context.h"
#include "host/gl_costs.h"
#include "host/scene.h"

#include <stdio.h>

static void print_cost(const char *name, float cost, float triangle, float usual)
{
    printf("%-11s %9.4f us %9.3f triangles, by default %g\n", name, (double)cost,
           (double)(cost / triangle), (double)usual);
}

static void capture(void *user, const terrimp_capture_command *c) { (void)user, (void)c; }
static void impostor(void *user, const terrimp_impostor_command *c) { (void)user, (void)c; }
static void ground(void *user, const terrimp_ground_command *c) { (void)user, (void)c; }

/* Flies, with no one who draws, and prints what the last frame would be. */
static int fly(const terrimp_terrain *terrain, const terrimp_costs *costs, const char *name)
{
    terrimp_view_desc settings = { 0 };
    terrimp_callbacks nothing = { 0 };
    terrimp_view *view = NULL;
    terrimp_stats stats;
    int i, ok;
    nothing.begin_capture = nothing.end_capture = capture;
    nothing.draw_impostor = impostor, nothing.draw_ground = ground;
    if (costs)
        settings.costs = *costs;
    ok = terrimp_view_create(terrain, &settings, NULL, &view) == TERRIMP_OK;
    for (i = 0; ok && i < SCENE_FRAMES; i++) {
        terrimp_camera camera = scene_camera(i, 1280, 1024);
        ok = terrimp_view_update(view, &camera) == TERRIMP_OK
             && terrimp_view_render(view, &nothing) == TERRIMP_OK;
    }
    ok = ok && terrimp_view_get_stats(view, &stats) == TERRIMP_OK;
    if (ok)
        printf("with %s costs: %u impostors, %u nodes of ground, %u triangles\n", name,
               stats.impostors, stats.ground, stats.triangles);
    terrimp_view_destroy(view);
    return ok;
}

int main(void)
{
    scene s;
    context frame;
    terrimp_view_desc settings = { 0 };
    terrimp_terrain *terrain = NULL;
    terrimp_costs measured, usual;
    const char *trouble = context_open(&frame, 1280, 1024);
    int ok;
    if (!trouble) {
        trouble = gl_costs_measure(&frame, &measured);
        if (!trouble)
            printf("%s\n", context_renderer());
        context_close(&frame);
    }
    if (!trouble)
        trouble = scene_open(&s);
    if (trouble)
        return fprintf(stderr, "costs: %s\n", trouble), 2;
    ok = terrimp_terrain_create(&s.desc, NULL, &terrain) == TERRIMP_OK
         && terrimp_view_desc_resolve(terrain, &settings, &settings) == TERRIMP_OK;
    if (ok) {
        usual = settings.costs;
        print_cost("draw", measured.draw, measured.triangle, usual.draw);
        print_cost("triangle", measured.triangle, measured.triangle, usual.triangle);
        print_cost("ground_px", measured.ground_px, measured.triangle, usual.ground_px);
        print_cost("impostor_px", measured.impostor_px, measured.triangle, usual.impostor_px);
        print_cost("capture", measured.capture, measured.triangle, usual.capture);
        ok = fly(terrain, NULL, "default") && fly(terrain, &measured, "measured");
    }
    terrimp_terrain_destroy(terrain);
    scene_close(&s);
    return !ok;
}
