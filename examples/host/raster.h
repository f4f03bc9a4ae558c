/* A span rasteriser for machines without a GPU: triangles with one texture, perspective-correct,
   into a frame buffer of RGB565 with a depth buffer, both in RAM. Vertices are transformed and
   edges are set up in float; a pixel costs integers only, and there is one division for 16 pixels
   of a span. Needs libc and libm; copy the two files into your engine. */
#ifndef HOST_RASTER_H
#define HOST_RASTER_H

#include <stddef.h>
#include <stdint.h>

enum {
    RASTER_KEY = 0xf81f,   /* the colour that stands for "nothing here" in textures */
    RASTER_ALL = 32,       /* thresholds of the dither pattern are 0..31 */
    RASTER_LEVELS = 12,
    RASTER_VERTICES = 4225 /* of one draw at most: 65 x 65 */
};

/* A square texture whose side is a power of two, with mipmaps or without. */
typedef struct raster_texture {
    const uint16_t *levels[RASTER_LEVELS]; /* rgb565, row by row; level i has half the side of
                                              level i - 1 */
    int level_count;                       /* 1: no mipmaps */
    int log2_side;                         /* 0..14 */
} raster_texture;

/* A vertex in clip space and its texture coordinates. */
typedef struct raster_point {
    float x, y, w, s, t, r, q;
} raster_point;

/* The same on the screen; all but x and y divided by w, so that they are linear in x and y. */
typedef struct raster_corner {
    float x, y, depth, s, t, q;
} raster_corner;

/* Where triangles go, and through which camera. */
typedef struct raster {
    uint16_t *pixels;      /* of the target's corner; what is drawn stays within width x height */
    uint16_t *depth;       /* z_near / w, larger is closer. NULL: none, what is drawn later covers
                              what was drawn before */
    uint32_t *covered;     /* instead of depth, for triangles from front to back: rows of
                              (width + 31) / 32 words, a bit for each pixel that has been drawn and
                              is left alone from then on. NULL, as after raster_begin: none */
    int pitch;             /* pixels from a row to the next */
    int depth_pitch;       /* the same of depth; as wide as the target after raster_begin */
    int width, height;
    int row_0_is_top;      /* as on a screen; else as in a texture whose row 0 is t = 0 */
    float matrix[16], eye[3], z_near, depth_scale;
    raster_point points[RASTER_VERTICES];
    raster_corner corners[RASTER_VERTICES];
    uint8_t sides[RASTER_VERTICES]; /* the planes that a vertex is outside of */
} raster;

/* What a draw looks like. */
typedef struct raster_style {
    const raster_texture *texture;
    const float *texture_matrix; /* [16] (position - picture_eye, 1) to (s, t, r, q): the texel at
                                    (s / q, t / q) in 0..1 */
    float picture_eye[3];
    int share;                   /* of RASTER_ALL: only pixels whose threshold of a dither pattern
                                    lies below it */
    int within_depth;            /* nonzero: only what lies where r / q is within 0..1 */
    const float *place_matrix;   /* [16] NULL: pixels have the depth of their triangles; else that
                                    of what the texture shows, where it is farther */
    const uint16_t *texture_depth; /* as the texture, of the target that it once was */
} raster_style;

/* Takes a target and a camera; the buffers are not cleared. view and projection are those of
   OpenGL, with clip depth -1..1. */
void raster_begin(raster *r, uint16_t *pixels, uint16_t *depth, int pitch, int width, int height,
                  int row_0_is_top, const float view[16], const float projection[16],
                  const float eye[3]);

/* Fills the target's pixels with a colour. */
void raster_clear(const raster *r, uint16_t colour);

/* Makes the target's depth farthest, if it has one. */
void raster_clear_depth(const raster *r);

/* Makes all of the target free; at the end fills what still is. For targets with covered. */
void raster_clear_covered(const raster *r);
void raster_fill_rest(const raster *r, uint16_t colour);

/* Draws the counter-clockwise ones of index_count / 3 triangles. Nearer pixels win, and of equally
   near ones the first. Indices below RASTER_VERTICES. */
void raster_draw(raster *r, const raster_style *style, const float *xyz, const uint16_t *indices,
                 size_t index_count);

/* Fills in the mipmaps of a texture of rgb[side][side][3]. texels holds 4/3 side^2. */
void raster_make_texture(raster_texture *texture, uint16_t *texels, const uint8_t *rgb,
                         int log2_side);

/* The pixels as rgb[height][width][3], for instance for a picture file. */
void raster_read(const raster *r, uint8_t *rgb);

#endif
