/* Trees on the terrain: instances of one mesh, sorted by chunk. Where a chunk is ground they are
   drawn with it; in a capture they are drawn into the picture, cut to its clip rectangle, and cost
   nothing more until the next one (Hess 6.3). */
#ifndef HOST_TREES_H
#define HOST_TREES_H

#include "gl_terrain.h"

/* Ground on the screen, as its command said. */
typedef struct trees_draw {
    uint32_t node, level;
} trees_draw;

typedef struct trees {
    uint32_t chunks_x, chunks_z;
    uint32_t *first;         /* [chunks + 1] where a chunk's instances begin */
    GLuint array, vertices, instances;
    gl_program program;
    GLint clip, house;       /* its uniforms */
    GLsizei vertex_count;    /* of one */
    int houses;
    gl_terrain *gl;          /* for the callbacks, with what they go round */
    terrimp_callbacks inner;
    trees_draw *draws;       /* [chunks] of the frame, in the order of the ground commands */
    uint32_t draw_count;
    const terrimp_capture_command *capture; /* within one */
} trees;

/* Plants up to count trees, the same ones for the same terrain, where it is not too steep; or
   builds houses. Field: that of the terrain. Returns null, or what is wrong; then there is nothing
   to close. */
const char *trees_open(trees *t, const terrimp_terrain *terrain, const terrimp_heightfield *field,
                       uint32_t count, int houses);

/* Callbacks around gl_terrain's, or around others that are around those: each capture gets its
   trees, and the ground on the screen is taken down for trees_end. */
terrimp_callbacks trees_callbacks(trees *t, gl_terrain *g, terrimp_callbacks inner);

/* After terrimp_view_render, before gl_terrain_end: the trees of all ground on the screen. */
void trees_end(trees *t);

void trees_close(trees *t);

#endif
