/* What the page of viewer.html calls of viewer.c: frames, buttons, touches, files. */
#include <emscripten.h>

EMSCRIPTEN_KEEPALIVE void viewer_frame(void)
{
    draw_frame(&the_viewer);
}

EMSCRIPTEN_KEEPALIVE void viewer_key(int key, int down)
{
    on_key(the_viewer.window, key, 0, down ? GLFW_PRESS : GLFW_RELEASE, 0);
}

EMSCRIPTEN_KEEPALIVE void viewer_turn(float x, float y)
{
    walker_turn(&the_viewer.walker, x, y);
}

EMSCRIPTEN_KEEPALIVE void viewer_speed(float factor)
{
    the_viewer.walker.speed *= factor;
}

EMSCRIPTEN_KEEPALIVE void viewer_open(const char *path)
{
    start_building(&the_viewer, path);
}

EMSCRIPTEN_KEEPALIVE void viewer_resize(int width, int height)
{
    glfwSetWindowSize(the_viewer.window, width, height);
}

/* The browser has taken the mouse back, or the focus. */
EMSCRIPTEN_KEEPALIVE void viewer_release(void)
{
    the_viewer.looking = 0;
    memset(the_viewer.held, 0, sizeof the_viewer.held);
}

/* A lost context takes all that OpenGL held with it: what is drawn is sent again. */
EMSCRIPTEN_KEEPALIVE void viewer_context(int lost)
{
    viewer *v = &the_viewer;
    scene *s = &v->scene;
    const char *trouble;
    v->broken = lost;
    if (lost)
        return;
    hud_close(&v->hud);
    if (s->job) {
        sea_close(&s->sea);
        trees_close(&s->trees);
        trees_close(&s->houses);
        gl_terrain_close(&s->gl);
    }
    while (glGetError() != GL_NO_ERROR) {
    } /* of deleting what is lost already */
    trouble = hud_open(&v->hud);
    if (s->job) {
        trouble = trouble ? trouble : open_graphics(v, s);
        terrimp_view_invalidate(s->view);
        move_sun(v, 0.0f);
    }
    if (trouble)
        say(v, trouble);
    v->broken = trouble != NULL;
}

/* What is written below the frame. */
EMSCRIPTEN_KEEPALIVE const char *viewer_message(void)
{
    return the_viewer.message_frames > 0 ? the_viewer.message : "";
}

/* Figures, by number. */
EMSCRIPTEN_KEEPALIVE double viewer_figure(int which)
{
    const viewer *v = &the_viewer;
    switch (which) {
    case 0: return v->scene.view && !v->building && !v->broken; /* ready */
    case 1: return v->scene.stats.draws;
    case 2: return v->scene.stats.triangles;
    case 3: return v->ms;
    case 4: return v->scene.field.width;
    case 5: return v->mode;
    case 6: return (double)v->walker.eye[0];
    default: return (double)v->walker.eye[2];
    }
}
