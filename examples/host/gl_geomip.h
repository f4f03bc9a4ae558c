/* The OpenGL side of geometrical mipmapping: one index buffer for all nodes, the vertices of a node
   when it is first drawn, and morphing in the vertex shader. Shading, frame and camera are those of
   gl_terrain, so that its full mesh may be compared with. */
#ifndef HOST_GL_GEOMIP_H
#define HOST_GL_GEOMIP_H

#include "gl_terrain.h"

typedef struct gl_geomip {
    gl_terrain *gl;                  /* not its own */
    terrimp_quadtree tree;
    terrimp_geomip_view view;
    terrimp_pattern patterns[TERRIMP_PATTERN_COUNT];
    GLuint *arrays, *vertices;       /* [node_count] 0 until the node is drawn */
    uint32_t resident;               /* nodes that have vertices */
    GLuint indices, weights;
    gl_program ground, line;
    float *xyz;                      /* of the node that is being made */
    terrimp_geomip_vertex *moves;
} gl_geomip;

/* Builds the tree over the field that gl shows. Of the settings rule, tolerance_px, morph_ratio and
   hysteresis are taken; a chunk_quads of 0 is 32. gl and the field's samples outlive g.
   Returns null, or one line that says what is wrong; then there is nothing to close. */
const char *gl_geomip_open(gl_geomip *g, gl_terrain *gl, const terrimp_heightfield *field,
                           uint32_t chunk_quads, const terrimp_geomip_view *settings);

/* Selects for a camera. Of the figures triangles, draws, visible and the clip distances are filled
   in, the others are 0. */
terrimp_result gl_geomip_update(gl_geomip *g, const terrimp_camera *camera, terrimp_stats *stats);

/* Draws what was selected, between gl_terrain_begin and gl_terrain_end. */
terrimp_result gl_geomip_draw(gl_geomip *g);

/* Draws the triangles as lines over the frame, coloured by level. */
terrimp_result gl_geomip_wireframe(gl_geomip *g);

void gl_geomip_close(gl_geomip *g);

#endif
