/* What stands beside terrain in a scene: houses on it, and a sea through it. They are drawn with
   the frame's camera and the ordinary depth test, in no order. */
#ifndef HOST_PROPS_H
#define HOST_PROPS_H

#include "gl_terrain.h"

typedef struct props {
    gl_program program;
    GLuint array, vertices;
    GLsizei count; /* vertices of all houses; those of the sea follow */
} props;

/* Spreads houses over a heightfield, on dry land: `side` wide, as deep and as high [wu]. Every
   house is of some red. NULL, or what went wrong. */
const char *props_open(props *p, const terrimp_heightfield *field, uint32_t houses, float side,
                       float sea_height);
void props_close(props *p);

/* Draws to where the frame goes, once gl_terrain_turn_to_frame has been called. */
void props_draw_houses(const props *p, const gl_terrain *g);
void props_draw_sea(const props *p, const gl_terrain *g, float sea_height);

#endif
