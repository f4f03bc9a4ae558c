/* A dearer shading than one lightmap, to see what an impostor saves when the ground is shaded well:
   three materials, each with a lightmap of its own whose alpha is where it lies, under the shadows
   of moving clouds; seven texture reads a pixel. The clouds are left out of captures and cast on
   impostors when they are drawn: a picture keeps what does not move, and costs two reads.
   After D. Wagner, Terrain Geomorphing in the Vertex Shader, ShaderX2, 2003, "Materials". */
#ifndef HOST_SHADING_H
#define HOST_SHADING_H

#include "gl_terrain.h"

enum { SHADING_MATERIALS = 3 };

typedef struct shading {
    GLuint materials[SHADING_MATERIALS]; /* detail, repeated over the ground */
    GLuint covers[SHADING_MATERIALS - 1]; /* lightmaps with cover; the first is gl_terrain's own */
    GLuint clouds;
    float spacing;           /* [wu] between samples: what the repeats are measured in */
    float drift[2];          /* of the clouds, in repeats */
} shading;

/* For gl_terrain_desc. */
extern const char shading_source[];

/* Makes the textures; field and lightmap as for gl_terrain_open. Returns null, or what is wrong. */
const char *shading_open(shading *s, const terrimp_heightfield *field, const uint8_t *lightmap);

/* Before a frame: binds the textures, to units 1 and up, and sets where the clouds are. */
void shading_begin(shading *s, const gl_terrain *g, float seconds);

void shading_close(shading *s);

#endif
