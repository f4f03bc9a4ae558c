/* Tests of the viewer: its own callbacks get keys, mouse, wheel and files, frame by frame, and its
   pictures are compared with each other and with one of flyover's.
   Build:  make test_viewer
   Use:    test_viewer FOLDER, where tests/viewer.sh has left start.path, flyover.png and small.pgm;
           it needs a display with OpenGL 3.3. */
#define VIEWER_AS_PART
#include "examples/viewer.c"

#include "check.h"

enum { WIDTH = 640, HEIGHT = 480 };

static viewer v;
static const char *folder;

static const char *in_folder(const char *name)
{
    static char paths[4][1024];
    static int turn_of;
    char *path = paths[turn_of++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static void frames(int count)
{
    while (count-- > 0) {
        glfwPollEvents();
        draw_frame(&v);
        glfwSwapBuffers(v.window);
    }
    CHECK(glGetError() == GL_NO_ERROR);
}

/* Until nothing is built any more. */
static void settle(void)
{
    float last = 0.0f;
    do {
        float done = 0.0f;
        if (v.building)
            job_poll(v.building, &done);
        CHECK(done >= last || !v.building);
        last = done;
        frames(1);
    } while (v.building);
}

/* The frame as it is drawn now, to be freed; it also goes to a file of that name. */
static uint8_t *shot(const char *name)
{
    size_t pixels = (size_t)v.frame.width * (size_t)v.frame.height;
    uint8_t *rgb = malloc(pixels * 3);
    v.frame.reading = malloc(pixels * 4);
    draw_frame(&v);
    context_read(&v.frame, rgb);
    free(v.frame.reading);
    v.frame.reading = NULL;
    if (name)
        CHECK(image_write_png(in_folder(name), rgb, v.frame.width, v.frame.height) == NULL);
    return rgb;
}

/* [dB] */
static double likeness(const uint8_t *a, const uint8_t *b)
{
    return image_psnr(image_mean_square(a, b, (size_t)v.frame.width * (size_t)v.frame.height,
                                        NULL));
}

static void tap(int key)
{
    on_key(v.window, key, 0, GLFW_PRESS, 0);
    on_key(v.window, key, 0, GLFW_RELEASE, 0);
}

static void a_terrain_is_built_while_frames_are_drawn(void)
{
    CHECK(v.building);
    settle();
    CHECK(v.scene.view && v.frame.width == WIDTH && v.frame.height == HEIGHT);
    CHECK(v.message_frames == 0);
}

static void its_picture_is_that_of_flyover(void)
{
    uint8_t *mine, *other = NULL;
    int width = 0, height = 0;
    double psnr;
    tap(GLFW_KEY_TAB);
    frames(30);
    mine = shot("viewer.png");
    CHECK(image_read_png(in_folder("flyover.png"), &other, &width, &height) == NULL);
    CHECK(width == WIDTH && height == HEIGHT);
    psnr = other ? likeness(mine, other) : 0.0;
    printf("viewer and flyover: %.1f dB\n", psnr);
    CHECK(psnr >= 40.0);
    free(mine);
    free(other);
}

/* Each changes the picture, and pressed again gives it back. */
static void switches_show_and_go(void)
{
    static const struct { int key; const char *name; } switches[] = {
        { GLFW_KEY_X, "wireframe.png" }, { GLFW_KEY_L, "levels.png" }, { GLFW_KEY_M, "atlas.png" },
        { GLFW_KEY_V, "split.png" }, { GLFW_KEY_Z, "sea.png" }, { GLFW_KEY_H, "houses.png" },
        { GLFW_KEY_T, "trees.png" }, { GLFW_KEY_TAB, "figures.png" }, { GLFW_KEY_F1, "help.png" }
    };
    size_t i;
    for (i = 0; i < sizeof switches / sizeof *switches; i++) {
        uint8_t *before = shot(NULL), *with, *after;
        tap(switches[i].key);
        frames(20);
        with = shot(switches[i].name);
        tap(switches[i].key);
        frames(20);
        after = shot(NULL);
        if (!(likeness(before, with) < 60.0) || !(likeness(before, after) >= 38.0))
            printf("%s: %.1f dB with, %.1f dB after\n", switches[i].name, likeness(before, with),
                   likeness(before, after));
        CHECK(likeness(before, with) < 60.0);
        CHECK(likeness(before, after) >= 38.0);
        free(before);
        free(with);
        free(after);
    }
}

static void the_modes_draw_the_same_terrain(void)
{
    uint8_t *full, *other;
    int mode;
    tap(GLFW_KEY_1);
    frames(2);
    full = shot("full.png");
    for (mode = 1; mode < 4; mode++) {
        tap(GLFW_KEY_1 + mode);
        frames(20);
        CHECK(v.mode == TERRIMP_MODE_FULL + mode && v.scene.desc.mode == v.mode);
        other = shot(NULL);
        CHECK(likeness(full, other) >= 30.0);
        free(other);
    }
    free(full);
}

static void the_right_of_the_divider_is_the_full_mesh(void)
{
    uint8_t *full, *split, *moved;
    size_t row = WIDTH * 3, z, same = 0;
    tap(GLFW_KEY_1);
    frames(2);
    full = shot(NULL);
    tap(GLFW_KEY_4);
    tap(GLFW_KEY_V);
    frames(20);
    split = shot(NULL);
    for (z = 0; z < HEIGHT; z++)
        same += memcmp(full + z * row + row / 2 + 6, split + z * row + row / 2 + 6,
                       row / 2 - 6) == 0;
    CHECK(same == HEIGHT);
    on_mouse(v.window, 0.5 * WIDTH, 100.0);
    on_button(v.window, GLFW_MOUSE_BUTTON_LEFT, GLFW_PRESS, 0);
    on_mouse(v.window, 0.25 * WIDTH, 100.0);
    on_button(v.window, GLFW_MOUSE_BUTTON_LEFT, GLFW_RELEASE, 0);
    CHECK(fabsf(v.divider - 0.25f) < 0.01f && !v.looking);
    tap(GLFW_KEY_RIGHT);
    tap(GLFW_KEY_LEFT);
    frames(1);
    moved = shot(NULL);
    for (same = z = 0; z < HEIGHT; z++)
        same += memcmp(full + z * row + row / 4 + 6, moved + z * row + row / 4 + 6,
                       row * 3 / 4 - 6) == 0;
    CHECK(same == HEIGHT);
    tap(GLFW_KEY_V);
    v.divider = 0.5f;
    free(full);
    free(split);
    free(moved);
}

static void keys_move_the_eye(void)
{
    float from[3], forward[3], along = 0.0f;
    int i;
    memcpy(from, v.walker.eye, sizeof from);
    walker_forward(&v.walker, forward);
    v.walker.eye[1] += 100.0f;
    from[1] = v.walker.eye[1];
    on_wheel(v.window, 0.0, 1.0);
    on_wheel(v.window, 0.0, -1.0);
    on_key(v.window, GLFW_KEY_W, 0, GLFW_PRESS, 0);
    frames(10);
    on_key(v.window, GLFW_KEY_W, 0, GLFW_RELEASE, 0);
    frames(2);
    for (i = 0; i < 3; i++)
        along += (v.walker.eye[i] - from[i]) * forward[i];
    CHECK(fabsf(along - v.walker.speed * v.fixed_seconds * 10.0f) < 0.01f * along);
    on_key(v.window, GLFW_KEY_A, 0, GLFW_PRESS, 0);
    on_focus(v.window, 0); /* the release goes elsewhere */
    memcpy(from, v.walker.eye, sizeof from);
    frames(2);
    CHECK(memcmp(from, v.walker.eye, sizeof from) == 0);
    on_button(v.window, GLFW_MOUSE_BUTTON_LEFT, GLFW_PRESS, 0);
    CHECK(v.looking);
    along = v.walker.yaw;
    on_mouse(v.window, v.mouse_x + 100.0, v.mouse_y);
    CHECK(fabsf(v.walker.yaw - along - 0.3f) < 1e-4f);
    on_mouse(v.window, v.mouse_x - 100.0, v.mouse_y);
    tap(GLFW_KEY_ESCAPE);
    CHECK(!v.looking && !glfwWindowShouldClose(v.window));
}

static float over_ground(void)
{
    return v.walker.eye[1] - walker_ground(&v.walker, &v.scene.field);
}

static void walking_stays_on_the_ground(void)
{
    uint8_t *picture;
    int i, jumped = 0;
    tap(GLFW_KEY_F);
    for (i = 0; i < 600 && !v.walker.standing; i++) {
        move(&v);
    }
    CHECK(v.walker.standing && fabsf(over_ground() - WALKER_HEIGHT) < 1e-3f);
    v.held[GLFW_KEY_W] = 1;
    for (i = 0; i < 100; i++) {
        move(&v);
        CHECK(over_ground() >= WALKER_HEIGHT - 1e-3f);
    }
    memset(v.held, 0, sizeof v.held);
    v.held[GLFW_KEY_SPACE] = 1;
    for (i = 0; i < 20; i++) {
        move(&v);
        jumped += over_ground() > WALKER_HEIGHT + 0.3f;
    }
    memset(v.held, 0, sizeof v.held);
    CHECK(jumped > 0);
    frames(40);
    picture = shot("walking.png");
    CHECK(image_not_sky(picture, WIDTH * HEIGHT, v.options.sky) > WIDTH * HEIGHT / 10);
    free(picture);
    tap(GLFW_KEY_F);
}

static void what_is_held_stays(void)
{
    terrimp_stats before;
    frames(5);
    tap(GLFW_KEY_P);
    before = v.scene.stats;
    v.walker.eye[0] += 50.0f;
    v.walker.eye[1] += 50.0f;
    frames(3);
    CHECK(before.draws == v.scene.stats.draws && before.triangles == v.scene.stats.triangles);
    free(shot("held.png"));
    tap(GLFW_KEY_P);
    frames(2);
}

static void tolerance_and_sun_follow_their_keys(void)
{
    uint8_t *before, *after;
    tap(GLFW_KEY_EQUAL);
    tap(GLFW_KEY_EQUAL);
    CHECK(fabsf(v.tolerance - 2.0f) < 1e-3f && fabsf(v.scene.desc.tolerance_px - 2.0f) < 1e-3f);
    tap(GLFW_KEY_MINUS);
    tap(GLFW_KEY_MINUS);
    frames(20);
    before = shot(NULL);
    tap(GLFW_KEY_K);
    tap(GLFW_KEY_K);
    tap(GLFW_KEY_K);
    frames(20);
    after = shot("sun.png");
    CHECK(likeness(before, after) < 35.0);
    free(before);
    free(after);
    tap(GLFW_KEY_J);
}

static void any_size_of_window_will_do(void)
{
    static const int sizes[][2] = { { 800, 300 }, { 33, 470 }, { WIDTH, HEIGHT } };
    size_t i;
    for (i = 0; i < 3; i++) {
        int wait = 0;
        glfwSetWindowSize(v.window, sizes[i][0], sizes[i][1]);
        for (; wait < 200 && v.frame.width != sizes[i][0]; wait++)
            frames(1);
        CHECK(v.frame.width == sizes[i][0] && v.frame.height == sizes[i][1]);
        free(shot(NULL));
    }
    glfwIconifyWindow(v.window);
    frames(2);
    glfwRestoreWindow(v.window);
    frames(2);
}

static void a_dropped_file_is_shown_and_a_bad_one_is_named(void)
{
    const char *good = in_folder("small.pgm"), *bad = in_folder("start.path");
    on_drop(v.window, 1, &bad);
    settle();
    CHECK(v.message_frames > 0 && strstr(v.message, "start.path"));
    CHECK(v.scene.field.width == 513 && v.scene.view);
    on_drop(v.window, 1, &good);
    settle();
    CHECK(v.scene.field.width == 120 && v.scene.field.depth == 90 && v.scene.view);
    frames(10);
    free(shot("dropped.png"));
}

static void a_screenshot_is_a_file(void)
{
    uint8_t *rgb = NULL;
    int width = 0, height = 0;
    v.shots = 900;
    tap(GLFW_KEY_F12);
    CHECK(image_read_png("viewer-900.png", &rgb, &width, &height) == NULL);
    CHECK(width == WIDTH && height == HEIGHT);
    remove("viewer-900.png");
    free(rgb);
}

static void it_can_be_left_while_it_builds(void)
{
    v.options.terrain_size = 2049;
    start_building(&v, NULL);
    frames(2);
    CHECK(v.building);
    tap(GLFW_KEY_ESCAPE);
    CHECK(glfwWindowShouldClose(v.window));
}

int main(int argc, char **argv)
{
    char path[1024];
    char *words[] = { argv[0], (char *)(uintptr_t)"--size", (char *)(uintptr_t)"640x480",
                      (char *)(uintptr_t)"--terrain-size", (char *)(uintptr_t)"513",
                      (char *)(uintptr_t)"--path", path };
    const char *trouble;
    if (argc != 2 || random_range(0, 0) || random_float(0.0f, 0.0f) > 0.0f)
        return 2; /* the random numbers that tests share have no use here */
    folder = argv[1];
    snprintf(path, sizeof path, "%s/start.path", folder);
    v.fixed_seconds = 1.0f / 60.0f;
    trouble = open_viewer(&v, 7, words);
    if (trouble) {
        fprintf(stderr, "%s\n", trouble);
        return 2;
    }
    glfwSwapInterval(0);
    printf("renderer %s\n", (const char *)glGetString(GL_RENDERER));
    RUN(a_terrain_is_built_while_frames_are_drawn);
    RUN(its_picture_is_that_of_flyover);
    RUN(switches_show_and_go);
    RUN(the_modes_draw_the_same_terrain);
    RUN(the_right_of_the_divider_is_the_full_mesh);
    RUN(keys_move_the_eye);
    RUN(walking_stays_on_the_ground);
    RUN(what_is_held_stays);
    RUN(tolerance_and_sun_follow_their_keys);
    RUN(any_size_of_window_will_do);
    RUN(a_dropped_file_is_shown_and_a_bad_one_is_named);
    RUN(a_screenshot_is_a_file);
    RUN(it_can_be_left_while_it_builds);
    close_viewer(&v);
    return check_report();
}
