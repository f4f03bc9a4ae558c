/* How good a picture is beside a reference, at one moment and from frame to frame. Pictures are
   rgb[height][width][3], 8 bits a channel, as in image.h, where the mean square and PSNR are. */
#ifndef HOST_QUALITY_H
#define HOST_QUALITY_H

#include <stddef.h>
#include <stdint.h>

/* Mean structural similarity of two pictures' luma, -1 to 1, 1 for equal ones: Gaussian window of
   11 x 11 pixels with deviation 1.5 that lies wholly within the picture, constants 0.01 and 0.03.
   With a sky colour (three bytes, or null) only windows count in whose centre either picture shows
   something else; 1 when none does. Returns -2 when memory runs out or the picture is smaller than
   the window.
   Source: Wang, Bovik, Sheikh, Simoncelli, Image quality assessment, 2004, equation 13. */
double quality_ssim(const uint8_t *a, const uint8_t *b, int width, int height,
                    const uint8_t *sky);

/* How much more a picture changes from one frame to the next than the reference does, in steps of
   8 bits. The change of a pixel is that of the channel that changes most. */
typedef struct quality_change {
    double mean;          /* over all pixels: above 0 it shimmers, below it is too calm */
    double largest;       /* of any pixel */
    double block;         /* largest mean over a block of QUALITY_BLOCK squared pixels: a pop */
    int block_x, block_y; /* that block's first pixel */
} quality_change;
enum { QUALITY_BLOCK = 16 }; /* pixels; blocks lie side by side, what is left over has none */

quality_change quality_compare_change(const uint8_t *before, const uint8_t *now,
                                      const uint8_t *reference_before,
                                      const uint8_t *reference_now, int width, int height);

/* Pixels of the sky's colour that have no way to the sky of the reference: holes in the terrain.
   A way goes over pixels of the sky's colour that touch, at a corner too; where a silhouette is too
   low there is one. *low receives the number of those pixels, which are sky here, terrain in the
   reference, but no holes; *first that of the first hole, y * width + x, if there is one. Returns
   SIZE_MAX when memory runs out. */
size_t quality_holes(const uint8_t *rgb, const uint8_t *reference, int width, int height,
                     const uint8_t sky[3], size_t *low, size_t *first);

/* A picture of width / factor times height / factor pixels, each the rounded mean of a square of
   factor^2; what is left over at the right and below is dropped. out may be rgb. */
void quality_shrink(const uint8_t *rgb, int width, int height, int factor, uint8_t *out);

#endif
