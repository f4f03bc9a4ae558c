/* What a program writes over its frame: text in letters of its own, bars, a texture. Positions in
   pixels from the upper left corner. */
#ifndef HOST_HUD_H
#define HOST_HUD_H

#include "context.h"

enum { HUD_CORNERS = 6 * 8192 };

typedef struct hud_corner {
    float x, y, u, v;
    uint8_t colour[4];
} hud_corner;

typedef struct hud {
    GLuint program, array, vertices;
    GLint size, textured;
    int width, height;               /* of the frame */
    hud_corner corners[HUD_CORNERS]; /* of rectangles that wait for hud_end */
    int count;
} hud;

/* Returns null, or what is wrong. */
const char *hud_open(hud *h);

/* Begins with nothing over a frame of that size. */
void hud_begin(hud *h, const context *frame);

/* A rectangle of one colour, 0xRRGGBBAA. */
void hud_bar(hud *h, float x, float y, float width, float height, uint32_t colour);

/* A line of text; capital letters, digits and .,:%/-+()=?_<>[] of 3 x 5 dots, each of so many
   pixels a side. Returns where it ends. */
float hud_text(hud *h, float x, float y, float dot, uint32_t colour, const char *text);

/* A texture, its row 0 at the lower end, its colours multiplied by its alpha already. */
void hud_texture(hud *h, float x, float y, float side, GLuint texture);

/* Draws what waits; blending and depth are then off. */
void hud_end(hud *h);

void hud_close(hud *h);

#endif
