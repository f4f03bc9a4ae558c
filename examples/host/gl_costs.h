/* What things cost on the running OpenGL: the unit costs by which a view chooses between ground and
   impostors. Ratios are what matters, so the figures hold for a machine and its driver, whatever
   terrain is drawn. */
#ifndef HOST_GL_COSTS_H
#define HOST_GL_COSTS_H

#include "context.h"
#include "terrimp.h"

/* Measures terrimp_costs in microseconds, with shaders like those of gl_terrain, an atlas of its
   own and a frame of the context's size; takes less than a second. Of several runs the fastest
   counts, since other programs only make them slower. OpenGL's bindings are as they are after context_open then.
   Returns null, or one line that says what is wrong. */
const char *gl_costs_measure(const context *frame, terrimp_costs *costs);

#endif
