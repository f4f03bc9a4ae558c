/* Procedural terrain with distinct peaks and valleys: Voronoi cells joined with fractal noise,
   perturbed, then eroded. After J. Olsen, Realtime procedural terrain generation, 2004, the
   source of Hess 4.1. */
#ifndef HOST_PROCEDURAL_H
#define HOST_PROCEDURAL_H

#include <stdint.h>

/* [wu] for one step of a sample, meant for a spacing of 1: heights are 0 to 256. */
#define PROCEDURAL_HEIGHT_SCALE (1.0f / 256.0f)

/* Makes width x depth samples, to be freed; null when memory runs out. The size of the features
   does not depend on the size of the terrain: a larger one shows more of them. The same arguments
   give the same terrain. */
uint16_t *procedural_terrain(uint32_t width, uint32_t depth, uint32_t seed);

#endif
