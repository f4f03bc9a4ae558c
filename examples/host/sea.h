/* A flat sea through the terrain: it meets the shore by depth. */
#ifndef HOST_SEA_H
#define HOST_SEA_H

#include "gl_terrain.h"

typedef struct sea {
    gl_program program;
    GLuint array, vertices;
} sea;

/* At a height, over the box of the terrain and eight times as far around it. Returns null, or what
   is wrong. */
const char *sea_open(sea *s, const terrimp_box *box, float height);

/* After terrimp_view_render and gl_terrain_send. */
void sea_draw(const sea *s, const gl_terrain *g);

void sea_close(sea *s);

#endif
