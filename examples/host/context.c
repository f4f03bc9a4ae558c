#include "context.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The windowless system: system_open makes a context current and stores what system_close
   needs; both are written once for OSMesa and once for EGL. A context of the old kind has a frame
   buffer of its own, width x height pixels with alpha and depth; the other draws into none. */

#if defined(HOST_OSMESA)

#include <GL/osmesa.h>

#define SYSTEM_NAME "OSMesa"

/* OSMesa insists on a buffer of its own; a context of the new kind never draws into it. */
typedef struct osmesa_system {
    OSMesaContext context;
    uint8_t *frame;
} osmesa_system;

static void system_close(void *system)
{
    osmesa_system *s = system;
    OSMesaDestroyContext(s->context);
    free(s->frame);
    free(s);
}

context_function context_find(const char *name)
{
    return (context_function)OSMesaGetProcAddress(name);
}

static const char *system_open(void **system, int width, int height, int old)
{
    static const int attributes[] = { OSMESA_FORMAT, OSMESA_RGBA,
                                      OSMESA_DEPTH_BITS, 24,
                                      OSMESA_PROFILE, OSMESA_CORE_PROFILE,
                                      OSMESA_CONTEXT_MAJOR_VERSION, 3,
                                      OSMESA_CONTEXT_MINOR_VERSION, 3, 0 };
    osmesa_system *s = calloc(1, sizeof *s);
    if (s)
        s->frame = malloc((size_t)width * (size_t)height * 4u);
    if (!s || !s->frame) {
        free(s);
        return "out of memory";
    }
    s->context = old ? OSMesaCreateContextExt(OSMESA_RGBA, 24, 0, 0, NULL)
                     : OSMesaCreateContextAttribs(attributes, NULL);
    if (!s->context) {
        free(s->frame);
        free(s);
        return old ? "OSMesa gives no OpenGL context" : "OSMesa gives no OpenGL 3.3 context";
    }
    if (!OSMesaMakeCurrent(s->context, s->frame, GL_UNSIGNED_BYTE, width, height)) {
        system_close(s);
        return "OSMesa does not make its context current";
    }
    *system = s;
    return NULL;
}

#elif defined(HOST_EGL)

#include <EGL/egl.h>
#include <EGL/eglext.h>

#define SYSTEM_NAME "EGL"

typedef struct egl_system {
    EGLDisplay display;
    EGLContext context;
    EGLSurface surface;
} egl_system;

static void system_close(void *system)
{
    egl_system *s = system;
    eglMakeCurrent(s->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (s->context != EGL_NO_CONTEXT)
        eglDestroyContext(s->display, s->context);
    if (s->surface != EGL_NO_SURFACE)
        eglDestroySurface(s->display, s->surface);
    eglTerminate(s->display);
    free(s);
}

context_function context_find(const char *name)
{
    return (context_function)eglGetProcAddress(name);
}

/* Mesa's surfaceless platform needs neither a display server nor a graphics card. */
static EGLDisplay surfaceless_display(void)
{
    PFNEGLGETPLATFORMDISPLAYEXTPROC get_platform_display =
        (PFNEGLGETPLATFORMDISPLAYEXTPROC)eglGetProcAddress("eglGetPlatformDisplayEXT");
    EGLDisplay display = EGL_NO_DISPLAY;
    if (get_platform_display)
        display = get_platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    return display != EGL_NO_DISPLAY ? display : eglGetDisplay(EGL_DEFAULT_DISPLAY);
}

static const char *make_egl_context(egl_system *s, int width, int height, int old)
{
    static const EGLint config_attributes[] = { EGL_SURFACE_TYPE, EGL_PBUFFER_BIT,
                                                EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                                EGL_RED_SIZE, 8, EGL_GREEN_SIZE, 8,
                                                EGL_BLUE_SIZE, 8, EGL_ALPHA_SIZE, 8,
                                                EGL_DEPTH_SIZE, 24, EGL_NONE };
    static const EGLint no_attributes[] = { EGL_NONE };
    const EGLint sides[] = { EGL_WIDTH, width, EGL_HEIGHT, height, EGL_NONE };
    static const EGLint attributes[] = { EGL_CONTEXT_MAJOR_VERSION, 3,
                                         EGL_CONTEXT_MINOR_VERSION, 3,
                                         EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                         EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE };
    EGLConfig config;
    EGLint configs = 0;
    if (!eglBindAPI(EGL_OPENGL_API))
        return "EGL has no desktop OpenGL";
    if (!eglChooseConfig(s->display, config_attributes, &config, 1, &configs) || configs < 1)
        return "EGL has no configuration for OpenGL";
    s->context = eglCreateContext(s->display, config, EGL_NO_CONTEXT,
                                  old ? no_attributes : attributes);
    if (s->context == EGL_NO_CONTEXT)
        return old ? "EGL gives no OpenGL context" : "EGL gives no OpenGL 3.3 context";
    if (old)
        s->surface = eglCreatePbufferSurface(s->display, config, sides);
    if (old && s->surface == EGL_NO_SURFACE)
        return "EGL gives no frame buffer of that size";
    if (!eglMakeCurrent(s->display, s->surface, s->surface, s->context))
        return "EGL cannot make its context current";
    return NULL;
}

static const char *system_open(void **system, int width, int height, int old)
{
    const char *trouble;
    egl_system *s = calloc(1, sizeof *s);
    if (!s)
        return "out of memory";
    s->context = EGL_NO_CONTEXT;
    s->surface = EGL_NO_SURFACE;
    s->display = surfaceless_display();
    if (s->display == EGL_NO_DISPLAY || !eglInitialize(s->display, NULL, NULL)) {
        free(s);
        return "EGL has no display without a window";
    }
    trouble = make_egl_context(s, width, height, old);
    if (trouble) {
        system_close(s);
        return trouble;
    }
    *system = s;
    return NULL;
}

#else
#error "say -DHOST_OSMESA or -DHOST_EGL"
#endif

static GLuint attach_renderbuffer(GLenum attachment, GLenum format, int width, int height)
{
    GLuint buffer;
    glGenRenderbuffers(1, &buffer);
    glBindRenderbuffer(GL_RENDERBUFFER, buffer);
    glRenderbufferStorage(GL_RENDERBUFFER, format, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer);
    return buffer;
}

const char *context_make_frame(context *c)
{
    GLint limit = 0;
    glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &limit);
    if (c->width > limit || c->height > limit)
        return "the frame is larger than OpenGL's limit";
    glGenFramebuffers(1, &c->framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, c->framebuffer);
    c->colour = attach_renderbuffer(GL_COLOR_ATTACHMENT0, GL_RGBA8, c->width, c->height);
    c->depth = attach_renderbuffer(GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT24, c->width, c->height);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return "the frame's framebuffer is not complete";
    return NULL;
}

static const char *open_context(context *c, int width, int height, int old)
{
    const char *trouble;
    memset(c, 0, sizeof *c);
    c->width = width;
    c->height = height;
    if (width < 1 || height < 1)
        return "the frame needs at least one pixel";
    trouble = system_open(&c->system, old ? width : 4, old ? height : 4, old);
    if (!trouble && !old)
        trouble = context_make_frame(c);
    if (!trouble)
        c->reading = malloc((size_t)width * (size_t)height * 4u);
    if (!trouble && !c->reading)
        trouble = "out of memory";
    if (trouble)
        context_close(c);
    else
        context_bind(c);
    return trouble;
}

const char *context_open(context *c, int width, int height)
{
    return open_context(c, width, height, 0);
}

const char *context_open_old(context *c, int width, int height)
{
    return open_context(c, width, height, 1);
}

const char *context_renderer(void)
{
    static char name[160];
    snprintf(name, sizeof name, "%s: %s", SYSTEM_NAME, (const char *)glGetString(GL_RENDERER));
    return name;
}

void context_close(context *c)
{
    if (c->framebuffer) {
        glDeleteFramebuffers(1, &c->framebuffer);
        glDeleteRenderbuffers(1, &c->colour);
        glDeleteRenderbuffers(1, &c->depth);
    }
    if (c->system)
        system_close(c->system);
    free(c->reading);
    memset(c, 0, sizeof *c);
}
