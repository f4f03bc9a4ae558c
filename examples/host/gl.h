/* OpenGL with the prototypes of 3.3, or OpenGL ES 3, which WebGL 2 is: the one place that names the
   system's headers. HOST_ES: what ES lacks is done without. */
#ifndef HOST_GL_H
#define HOST_GL_H

#ifdef __EMSCRIPTEN__
#define HOST_ES
#endif

#ifdef HOST_ES
#include <GLES3/gl3.h>
#define GL_SHADER_HEAD "#version 300 es\nprecision highp float;\n"
#else
#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#define GL_SHADER_HEAD "#version 330 core\n"
#endif

#endif
