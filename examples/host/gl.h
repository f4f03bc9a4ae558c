/* OpenGL with the prototypes of 3.3: the one place that names the system's headers. */
#ifndef HOST_GL_H
#define HOST_GL_H

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#endif
