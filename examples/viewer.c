/* A window to fly in: terrain impostors beside the full mesh, as you go.
   Build:  make deps-viewer viewer        (GLFW; the page: make deps-web web)
   Use:    viewer [options of flyover] [elevation file]; drop other files on the window
   Expect: W A S D and the mouse as in any game; F1 lists the keys. */
#define _POSIX_C_SOURCE 200809L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "host/gl_terrain.h"
#include "host/hud.h"
#include "host/image.h"
#include "host/job.h"
#include "host/lightmap.h"
#include "host/options.h"
#include "host/sea.h"
#include "host/stats.h"
#include "host/trees.h"
#include "host/walker.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#ifdef __EMSCRIPTEN__
#include <emscripten.h>
#endif

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE 0.017453293f

enum { TREE_COUNT = 6000, HOUSE_COUNT = 400, MESSAGE_FRAMES = 240 };

/* All that belongs to one terrain; the next one is built while this one is shown. */
typedef struct scene {
    job *job;                       /* owns samples, terrain and lightmap */
    terrimp_terrain_info info;
    terrimp_heightfield field;      /* resolved */
    gl_terrain gl;
    terrimp_view *view, *full;      /* full: from when it is first wanted */
    terrimp_view_desc desc;         /* of view, resolved */
    trees trees, houses;            /* likewise */
    sea sea;
    terrimp_stats stats;
} scene;

typedef struct viewer {
    options options;
    GLFWwindow *window;
    context frame;                  /* the window's own */
    hud hud;
    scene scene;
    job *building;                  /* null: nothing is */
    char path[1024], message[600];
    int message_frames;
    walker walker;                  /* the eye */
    float seconds;                  /* of the newest frame; a test sets fixed_seconds */
    float fixed_seconds;
    double last_ms, ms;
    uint8_t held[GLFW_KEY_LAST + 1];
    int looking, sliding;           /* the mouse turns the eye; it moves the divider */
    double mouse_x, mouse_y;
    float divider, sun_degrees, tolerance;
    int mode;
    int lines, levels, atlas, split, paused, with_sea, with_houses, with_trees, figures, help;
    int shots, exit_code;
    int broken;                     /* nothing can be drawn but what is written */
} viewer;

static void say(viewer *v, const char *text)
{
    snprintf(v->message, sizeof v->message, "%s", text);
    v->message_frames = MESSAGE_FRAMES;
}

/* ---- A terrain ---------------------------------------------------------- */

static void close_scene(scene *s)
{
    if (!s->job)
        return;
    sea_close(&s->sea);
    trees_close(&s->trees);
    trees_close(&s->houses);
    gl_terrain_close(&s->gl);
    terrimp_view_destroy(s->view);
    terrimp_view_destroy(s->full);
    job_close(s->job);
    free(s->job);
    memset(s, 0, sizeof *s);
}

static terrimp_view_desc settings_of(const viewer *v, int mode)
{
    terrimp_view_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.mode = mode;
    desc.tolerance_px = v->tolerance;
    desc.atlas_size = v->options.atlas;
    desc.texels_per_px = v->options.texels;
    desc.hider = v->scene.job ? &v->scene.job->horizon.hider : NULL;
    return desc;
}

/* Makes a view with the present settings; null, and that is said, when it cannot be made. */
static terrimp_view *make_view(viewer *v, scene *s, int mode, terrimp_view_desc *resolved)
{
    terrimp_view_desc desc = settings_of(v, mode);
    terrimp_view *view = NULL;
    terrimp_result result = terrimp_view_desc_resolve(s->job->terrain, &desc, resolved);
    if (result == TERRIMP_OK)
        result = terrimp_view_create(s->job->terrain, &desc, NULL, &view);
    if (result != TERRIMP_OK)
        say(v, terrimp_result_text((int)result));
    return view;
}

/* Gives the view the present settings: it keeps the pictures that are good enough by them. A mode
   that wants more ground nodes than it has room for makes it anew. */
static void renew_view(viewer *v)
{
    scene *s = &v->scene;
    terrimp_view_desc desc = settings_of(v, v->mode);
    terrimp_view *view;
    if (!s->job)
        return;
    if (terrimp_view_set(s->view, &desc) == TERRIMP_OK) {
        terrimp_view_desc_resolve(s->job->terrain, &desc, &s->desc);
        return;
    }
    view = make_view(v, s, v->mode, &s->desc);
    if (!view)
        return;
    terrimp_view_destroy(s->view);
    s->view = view;
}

static const char *open_graphics(viewer *v, scene *s)
{
    gl_terrain_desc desc;
    float low = 0.0f, high = 0.0f;
    const char *trouble;
    terrimp_heightfield_bounds(&s->field, 0, 0, s->field.width, s->field.depth, &low, &high);
    memset(&desc, 0, sizeof desc);
    desc.frame = &v->frame;
    desc.terrain = s->job->terrain;
    desc.field = &s->field;
    desc.lightmap = s->job->lightmap;
    desc.atlas_size = s->desc.atlas_size;
    trouble = gl_terrain_open(&s->gl, &desc);
    if (!trouble)
        trouble = sea_open(&s->sea, &s->info.box, low + 0.25f * (high - low));
    if (!trouble)
        trouble = trees_open(&s->trees, s->job->terrain, &s->field, TREE_COUNT, 0);
    if (!trouble)
        trouble = trees_open(&s->houses, s->job->terrain, &s->field, HOUSE_COUNT, 1);
    return trouble;
}

/* Shows what has been built, in place of what was shown. */
static const char *show_built(viewer *v)
{
    scene *s = &v->scene;
    tour *t = &v->building->tour;
    const char *trouble;
    close_scene(s);
    s->job = v->building;
    v->building = NULL;
    terrimp_terrain_get_info(s->job->terrain, &s->info);
    terrimp_heightfield_resolve(&t->field, &s->field);
    if (!tour_plan(t)) {
        say(v, t->error);
        t->desc.path = NULL;
        if (!tour_plan(t))
            return "no memory for the flight";
    }
    walker_place(&v->walker, t->flight.poses);
    v->walker.speed = 80.0f * s->field.spacing_x;
    s->view = make_view(v, s, v->mode, &s->desc);
    trouble = s->view ? open_graphics(v, s) : v->message;
    v->sun_degrees = -39.0f; /* that of the first lightmap */
    if (t->dem.remark)
        say(v, t->dem.remark);
    return trouble;
}

/* A file, or null for terrain that is made up. */
static void start_building(viewer *v, const char *path)
{
    tour_desc what;
    memset(&what, 0, sizeof what);
    if (v->building) {
        job_close(v->building);
        free(v->building);
    }
    if (path)
        snprintf(v->path, sizeof v->path, "%s", path);
    what.dem = path ? v->path : NULL;
    what.file = v->options.file;
    what.size = v->options.terrain_size;
    what.seed = v->options.seed;
    memcpy(what.spacing, v->options.spacing, sizeof what.spacing);
    memcpy(what.origin, v->options.origin, sizeof what.origin);
    what.height_scale = v->options.height_scale;
    what.path = v->options.path;
    what.frames = 1;
    v->building = calloc(1, sizeof *v->building);
    if (v->building)
        job_start(v->building, &what, v->options.chunk);
}

/* Returns how much is built, 0 to 1; a new terrain may be shown afterwards. */
static float go_on_building(viewer *v)
{
    float done = 0.0f;
    job_stage stage = v->building ? job_poll(v->building, &done) : JOB_NONE;
    if (stage == JOB_DONE) {
        const char *trouble = show_built(v);
        v->broken = trouble != NULL;
        if (trouble)
            say(v, trouble);
    } else if (stage == JOB_FAILED) {
        say(v, v->building->error);
        if (!v->scene.job) { /* the first one, which the command line asked for */
            fprintf(stderr, "viewer: %s\n", v->building->error);
            v->exit_code = 2;
            glfwSetWindowShouldClose(v->window, 1);
        }
        job_close(v->building);
        free(v->building);
        v->building = NULL;
    }
    return done;
}

/* The sun goes along an arc from west to east, always in the north. */
static void move_sun(viewer *v, float degrees)
{
    scene *s = &v->scene;
    float a, sun[3];
    uint8_t *lightmap;
    v->sun_degrees += degrees;
    v->sun_degrees = v->sun_degrees < -75.0f ? -75.0f : v->sun_degrees > 75.0f ? 75.0f
                                                                               : v->sun_degrees;
    a = v->sun_degrees * DEGREE;
    sun[0] = sinf(a) * 0.768f;
    sun[1] = 0.640f;
    sun[2] = -cosf(a) * 0.768f;
    lightmap = s->job ? lightmap_bake_under(&s->field, sun) : NULL;
    if (lightmap && gl_terrain_relight(&s->gl, &s->field, lightmap))
        terrimp_view_invalidate(s->view);
    free(lightmap);
}

/* ---- Keys and mouse ----------------------------------------------------- */

static const struct { int key; const char *name, *help; } keys[] = {
    { GLFW_KEY_1, "1", "FULL MESH" }, { GLFW_KEY_2, "2", "GEOMIPMAPPING" },
    { GLFW_KEY_3, "3", "IMPOSTORS" }, { GLFW_KEY_4, "4", "AUTO: WHAT COSTS LESS" },
    { GLFW_KEY_EQUAL, "+", "MORE TOLERANCE" }, { GLFW_KEY_MINUS, "-", "LESS" },
    { GLFW_KEY_X, "X", "WIREFRAME" }, { GLFW_KEY_L, "L", "LEVELS IN COLOURS" },
    { GLFW_KEY_M, "M", "THE ATLAS" }, { GLFW_KEY_V, "V", "FULL MESH ON THE RIGHT" },
    { GLFW_KEY_LEFT, "<", "DIVIDER TO THE LEFT" }, { GLFW_KEY_RIGHT, ">", "TO THE RIGHT" },
    { GLFW_KEY_P, "P", "HOLD WHAT IS DRAWN, FLY ON" }, { GLFW_KEY_F, "F", "WALK OR FLY" },
    { GLFW_KEY_Z, "Z", "SEA" }, { GLFW_KEY_H, "H", "HOUSES" }, { GLFW_KEY_T, "T", "TREES" },
    { GLFW_KEY_J, "J", "SUN TO THE WEST" }, { GLFW_KEY_K, "K", "TO THE EAST" },
    { GLFW_KEY_TAB, "TAB", "FIGURES" }, { GLFW_KEY_F12, "F12", "SCREENSHOT" },
    { GLFW_KEY_F1, "F1", "THESE KEYS" }
};

static void look_freely(viewer *v, int looking)
{
    v->looking = looking;
    glfwSetInputMode(v->window, GLFW_CURSOR, looking ? GLFW_CURSOR_DISABLED : GLFW_CURSOR_NORMAL);
    glfwGetCursorPos(v->window, &v->mouse_x, &v->mouse_y);
}

static void take_screenshot(viewer *v)
{
    size_t bytes = (size_t)v->frame.width * (size_t)v->frame.height;
    uint8_t *rgb = malloc(bytes * 3);
    char name[64];
    const char *trouble = "out of memory";
    v->frame.reading = malloc(bytes * 4);
    snprintf(name, sizeof name, "viewer-%03d.png", v->shots++);
    if (rgb && v->frame.reading) {
        context_read(&v->frame, rgb);
        trouble = image_write_png(name, rgb, v->frame.width, v->frame.height);
    }
    say(v, trouble ? trouble : name);
    free(v->frame.reading);
    v->frame.reading = NULL;
    free(rgb);
}

static void set_tolerance(viewer *v, float factor)
{
    float tolerance = v->tolerance * factor;
    v->tolerance = tolerance < 0.25f ? 0.25f : tolerance > 16.0f ? 16.0f : tolerance;
    renew_view(v);
}

static void move_divider(viewer *v, float to)
{
    v->divider = to < 0.02f ? 0.02f : to > 0.98f ? 0.98f : to;
}

static void press(viewer *v, int key)
{
    switch (key) {
    case GLFW_KEY_1: case GLFW_KEY_2: case GLFW_KEY_3: case GLFW_KEY_4:
        v->mode = TERRIMP_MODE_FULL + (key - GLFW_KEY_1);
        renew_view(v);
        break;
    case GLFW_KEY_EQUAL: case GLFW_KEY_KP_ADD: set_tolerance(v, 1.4142136f); break;
    case GLFW_KEY_MINUS: case GLFW_KEY_KP_SUBTRACT: set_tolerance(v, 0.7071068f); break;
    case GLFW_KEY_X: v->lines = !v->lines; break;
    case GLFW_KEY_L: v->levels = !v->levels; break;
    case GLFW_KEY_M: v->atlas = !v->atlas; break;
    case GLFW_KEY_V: v->split = !v->split; break;
    case GLFW_KEY_LEFT: move_divider(v, v->divider - 0.05f); break;
    case GLFW_KEY_RIGHT: move_divider(v, v->divider + 0.05f); break;
    case GLFW_KEY_P: v->paused = !v->paused; break;
    case GLFW_KEY_F: v->walker.walking = !v->walker.walking; break;
    case GLFW_KEY_Z: v->with_sea = !v->with_sea; break;
    case GLFW_KEY_H: v->with_houses = !v->with_houses; break;
    case GLFW_KEY_T: v->with_trees = !v->with_trees; break;
    case GLFW_KEY_J: move_sun(v, -15.0f); break;
    case GLFW_KEY_K: move_sun(v, 15.0f); break;
    case GLFW_KEY_TAB: v->figures = !v->figures; break;
    case GLFW_KEY_F12: take_screenshot(v); break;
    case GLFW_KEY_F1: v->help = !v->help; break;
    case GLFW_KEY_ESCAPE:
        if (v->looking)
            look_freely(v, 0);
        else
            glfwSetWindowShouldClose(v->window, 1);
        break;
    default: break;
    }
    if ((key == GLFW_KEY_H || key == GLFW_KEY_T) && v->scene.view)
        terrimp_view_invalidate(v->scene.view); /* they stand in the pictures */
}

static void on_key(GLFWwindow *window, int key, int code, int action, int mods)
{
    viewer *v = glfwGetWindowUserPointer(window);
    (void)code;
    (void)mods;
    if (key < 0 || key > GLFW_KEY_LAST)
        return;
    v->held[key] = action != GLFW_RELEASE;
    if (action == GLFW_PRESS)
        press(v, key);
}

/* Places of the mouse are in units of the window, which may be larger than pixels. */
static void on_mouse(GLFWwindow *window, double x, double y)
{
    viewer *v = glfwGetWindowUserPointer(window);
    int width = 1, height = 1;
    glfwGetWindowSize(window, &width, &height);
    if (v->sliding && width > 0)
        move_divider(v, (float)(x / width));
    else if (v->looking)
        walker_turn(&v->walker, (float)(x - v->mouse_x) * 0.003f,
                    (float)(v->mouse_y - y) * 0.003f);
    v->mouse_x = x;
    v->mouse_y = y;
}

static void on_button(GLFWwindow *window, int button, int action, int mods)
{
    viewer *v = glfwGetWindowUserPointer(window);
    int width = 1, height = 1;
    (void)mods;
    if (button != GLFW_MOUSE_BUTTON_LEFT)
        return;
    glfwGetWindowSize(window, &width, &height);
    v->sliding = action == GLFW_PRESS && v->split && !v->looking
                 && fabs(v->mouse_x - (double)v->divider * width) < 12.0;
    if (action == GLFW_PRESS && !v->sliding)
        look_freely(v, 1);
}

static void on_wheel(GLFWwindow *window, double x, double y)
{
    viewer *v = glfwGetWindowUserPointer(window);
    (void)x;
    v->walker.speed *= powf(1.2f, (float)(y < -10.0 ? -10.0 : y > 10.0 ? 10.0 : y));
}

static void on_drop(GLFWwindow *window, int count, const char **paths)
{
    viewer *v = glfwGetWindowUserPointer(window);
    if (count > 0)
        start_building(v, paths[0]);
}

/* What was held would stay held: its release goes to another window. */
static void on_focus(GLFWwindow *window, int focused)
{
    viewer *v = glfwGetWindowUserPointer(window);
    memset(v->held, 0, sizeof v->held);
    v->sliding = 0;
    if (!focused && v->looking)
        look_freely(v, 0);
}

/* ---- The eye ------------------------------------------------------------ */

static void move(viewer *v)
{
    const uint8_t *held = v->held;
    walker_wish wish;
    wish.ahead = held[GLFW_KEY_W] - held[GLFW_KEY_S];
    wish.aside = held[GLFW_KEY_D] - held[GLFW_KEY_A];
    wish.up = held[GLFW_KEY_SPACE] - held[GLFW_KEY_C];
    wish.fast = held[GLFW_KEY_LEFT_SHIFT] || held[GLFW_KEY_RIGHT_SHIFT];
    walker_move(&v->walker, &v->scene.field, &wish, v->seconds);
}

static terrimp_camera find_camera(const viewer *v)
{
    flight_pose pose;
    float forward[3];
    int i;
    walker_forward(&v->walker, forward);
    for (i = 0; i < 3; i++) {
        pose.eye[i] = v->walker.eye[i];
        pose.target[i] = v->walker.eye[i] + forward[i];
    }
    return tour_camera_at(&pose, &v->scene.info.box, v->options.fov_degrees * DEGREE,
                          (uint32_t)v->frame.width, (uint32_t)v->frame.height);
}

/* Clip distances for drawing: as close as what is drawn allows, and further for a sea. */
static void tighten(const viewer *v, terrimp_camera *camera, const terrimp_stats *now)
{
    float ground = walker_ground(&v->walker, &v->scene.field);
    float all = camera->z_far, above = 0.5f * (v->walker.eye[1] - ground);
    if (!v->paused)
        tour_tighten(camera, now);
    if (camera->z_near > above)
        camera->z_near = above > 0.2f ? above : 0.2f;
    if (v->with_sea)
        camera->z_far = 10.0f * all;
}

/* ---- A frame ------------------------------------------------------------ */

static void check(viewer *v, terrimp_result result)
{
    if (result != TERRIMP_OK)
        say(v, terrimp_result_text((int)result));
}

/* Draws a view to the frame, or to the columns that are its clip. */
static void draw_view(viewer *v, terrimp_view *view, terrimp_stats *now)
{
    scene *s = &v->scene;
    terrimp_camera camera = find_camera(v);
    terrimp_callbacks callbacks = gl_terrain_callbacks(&s->gl);
    if (!v->paused)
        check(v, terrimp_view_update(view, &camera));
    terrimp_view_get_stats(view, now);
    tighten(v, &camera, now);
    check(v, gl_terrain_begin(&s->gl, &camera, v->options.sky));
    if (v->with_trees)
        callbacks = trees_callbacks(&s->trees, &s->gl, callbacks);
    if (v->with_houses)
        callbacks = trees_callbacks(&s->houses, &s->gl, callbacks);
    check(v, terrimp_view_render(view, &callbacks));
    if (v->with_trees)
        trees_end(&s->trees);
    if (v->with_houses)
        trees_end(&s->houses);
    gl_terrain_send(&s->gl);
    if (v->levels)
        check(v, gl_terrain_draw_over(&s->gl, view, GL_OVER_LEVELS));
    if (v->lines)
        check(v, gl_terrain_draw_over(&s->gl, view, GL_OVER_LINES));
    if (v->with_sea)
        sea_draw(&s->sea, &s->gl);
}

/* The chosen way on the left of the divider, every triangle on the right. */
static void draw_scene(viewer *v)
{
    scene *s = &v->scene;
    terrimp_view_desc unused;
    terrimp_stats full;
    int edge = (int)(v->divider * (float)v->frame.width);
    if (v->split && !s->full)
        s->full = make_view(v, s, TERRIMP_MODE_FULL, &unused);
    v->frame.clip_x = 0;
    v->frame.clip_width = v->split && s->full ? edge : 0;
    draw_view(v, s->view, &s->stats);
    if (v->split && s->full) {
        v->frame.clip_x = edge;
        v->frame.clip_width = v->frame.width - edge;
        draw_view(v, s->full, &full);
    }
    v->frame.clip_width = 0;
}

static void write_figures(viewer *v)
{
    static const char *const modes[] = { "?", "FULL", "GEOMIP", "IMPOSTOR", "AUTO" };
    const scene *s = &v->scene;
    const terrimp_stats *now = &s->stats;
    size_t bytes = terrimp_terrain_bytes(&s->job->desc) + terrimp_view_bytes(s->job->terrain,
                                                                             &s->desc);
    char line[256];
    hud_bar(&v->hud, 0.0f, 0.0f, (float)v->frame.width, 38.0f, 0x00000090u);
    snprintf(line, sizeof line, "%s %.2f PX  %.1f MS A FRAME  %s%s",
             modes[v->mode - TERRIMP_MODE_FULL + 1], (double)v->tolerance, v->ms,
             v->walker.walking ? "WALKING" : "FLYING", v->paused ? ", HELD" : "");
    hud_text(&v->hud, 8.0f, 6.0f, 2.0f, 0xffffffffu, line);
    snprintf(line, sizeof line,
             "%u DRAWS  %uK TRIANGLES  %u IMPOSTORS  %u CAPTURES  %u HIDDEN  %.1f MB", now->draws,
             now->triangles / 1000, now->impostors, now->captures, now->hidden,
             (double)bytes / 1e6);
    hud_text(&v->hud, 8.0f, 22.0f, 2.0f, 0xffffffffu, line);
}

static void write_help(viewer *v)
{
    size_t i, count = sizeof keys / sizeof *keys;
    hud_bar(&v->hud, 8.0f, 46.0f, 370.0f, 18.0f * (float)count + 28.0f, 0x000000b0u);
    for (i = 0; i < count; i++) {
        float y = 54.0f + 18.0f * (float)i;
        hud_text(&v->hud, 18.0f, y, 2.0f, 0xffd060ffu, keys[i].name);
        hud_text(&v->hud, 58.0f, y, 2.0f, 0xffffffffu, keys[i].help);
    }
    hud_text(&v->hud, 18.0f, 54.0f + 18.0f * (float)count, 2.0f, 0xa0c0ffffu,
             "W A S D SPACE C SHIFT, MOUSE, WHEEL: SPEED");
}

static void draw_hud(viewer *v, float done)
{
    float width = (float)v->frame.width, height = (float)v->frame.height;
    hud_begin(&v->hud, &v->frame);
    if (v->split && v->scene.full)
        hud_bar(&v->hud, v->divider * width - 1.0f, 0.0f, 2.0f, height, 0xffffffffu);
    if (v->atlas && v->scene.job) {
        float side = 0.5f * height, x = width - side - 8.0f;
        hud_bar(&v->hud, x, 46.0f, side, side, 0x20252ab0u);
        hud_texture(&v->hud, x, 46.0f, side, v->scene.gl.atlas[0]);
    }
    if (v->figures && v->scene.job)
        write_figures(v);
    if (v->help)
        write_help(v);
    if (v->building) {
        hud_bar(&v->hud, 0.25f * width, height - 40.0f, 0.5f * width, 12.0f, 0x00000090u);
        hud_bar(&v->hud, 0.25f * width, height - 40.0f, 0.5f * width * done, 12.0f, 0xffd060ffu);
        hud_text(&v->hud, 0.25f * width, height - 56.0f, 2.0f, 0xffffffffu, "BUILDING");
    }
    if (v->message_frames > 0) {
        v->message_frames--;
        hud_bar(&v->hud, 0.0f, height - 24.0f, width, 24.0f, 0x000000b0u);
        hud_text(&v->hud, 8.0f, height - 17.0f, 2.0f, 0xffd060ffu, v->message);
    }
    hud_end(&v->hud);
}

static void draw_frame(viewer *v)
{
    double now = clock_ms();
    float done;
    v->ms = now - v->last_ms;
    v->seconds = (float)(v->ms < 100.0 ? v->ms : 100.0) * 0.001f;
    if (v->fixed_seconds > 0.0f)
        v->seconds = v->fixed_seconds;
    v->last_ms = now;
    done = go_on_building(v);
    glfwGetFramebufferSize(v->window, &v->frame.width, &v->frame.height);
    if (v->frame.width < 1 || v->frame.height < 1)
        return; /* minimised */
    context_bind(&v->frame);
    glDisable(GL_SCISSOR_TEST);
    if (v->scene.view && !v->broken) {
        move(v);
        draw_scene(v);
    } else {
        glClearColor(0.1f, 0.12f, 0.15f, 1.0f);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    }
    draw_hud(v, done);
}

/* ---- All of it ---------------------------------------------------------- */

static const char *open_window(viewer *v)
{
    const char *trouble;
    if (!glfwInit())
        return "there is no display";
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
#ifdef __EMSCRIPTEN__
    glfwWindowHint(GLFW_ALPHA_BITS, 0); /* or the page would show through */
#else
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, 1);
#endif
    v->window = glfwCreateWindow((int)v->options.width, (int)v->options.height, "terrimp", NULL,
                                 NULL);
    if (!v->window)
        return "there is no window with OpenGL 3.3";
    glfwMakeContextCurrent(v->window);
    glfwSwapInterval(1);
    glfwSetWindowUserPointer(v->window, v);
    glfwSetKeyCallback(v->window, on_key);
    glfwSetCursorPosCallback(v->window, on_mouse);
    glfwSetMouseButtonCallback(v->window, on_button);
    glfwSetScrollCallback(v->window, on_wheel);
    glfwSetDropCallback(v->window, on_drop);
    glfwSetWindowFocusCallback(v->window, on_focus);
    glfwGetFramebufferSize(v->window, &v->frame.width, &v->frame.height);
    trouble = hud_open(&v->hud);
    v->last_ms = clock_ms();
    return trouble;
}

/* What is not an option is the file. */
static const char *open_viewer(viewer *v, int argc, char **argv)
{
    const char *file = argc > 1 && argv[argc - 1][0] != '-'
                       && (argc == 2 || argv[argc - 2][0] != '-') ? argv[--argc] : NULL;
    if (!options_parse(&v->options, argc, argv))
        return v->options.error;
    if (!file)
        file = v->options.dem;
    v->mode = v->options.terrimp_mode;
    v->tolerance = v->options.tolerance > 0.0f ? v->options.tolerance : 1.0f;
    v->divider = 0.5f;
    v->figures = 1;
    start_building(v, file);
    return open_window(v);
}

static void close_viewer(viewer *v)
{
    if (v->building) {
        job_close(v->building);
        free(v->building);
    }
    close_scene(&v->scene);
    if (v->window)
        hud_close(&v->hud);
    glfwTerminate();
}

#ifndef VIEWER_AS_PART /* of a test, which has a main of its own */

static viewer the_viewer; /* all zero; a page goes on when main has returned */

#ifdef __EMSCRIPTEN__
#include "viewer_web.h"
#endif

int main(int argc, char **argv)
{
    viewer *v = &the_viewer;
    const char *trouble = open_viewer(v, argc, argv);
    if (v->options.help) {
        options_print_help(stdout);
    } else if (trouble) {
        fprintf(stderr, "viewer: %s\n", trouble);
    } else {
#ifdef __EMSCRIPTEN__
        emscripten_set_main_loop(viewer_frame, 0, 0);
        return 0;
#endif
        while (!glfwWindowShouldClose(v->window)) {
            draw_frame(v);
            glfwSwapBuffers(v->window);
            if (v->frame.width < 1)
                glfwWaitEventsTimeout(0.1);
            else
                glfwPollEvents();
        }
    }
    close_viewer(v);
    return trouble ? 2 : v->exit_code;
}

#endif
