/* RGB pictures: PNG files, and how far two of them are apart. All are rgb[height][width][3],
   8 bits a channel, top row first. */
#ifndef HOST_IMAGE_H
#define HOST_IMAGE_H

#include <stddef.h>
#include <stdint.h>

/* Writes a PNG file. Returns null, or one line that says what went wrong. */
const char *image_write_png(const char *path, const uint8_t *rgb, int width, int height);

/* The same for a file that is to lie beside the running program, argv[0] being its name. */
const char *image_write_beside(const char *program, const char *name, const uint8_t *rgb,
                               int width, int height);

/* Reads a PNG file of any kind as RGB; free(*rgb) when done. Returns null, or what went wrong;
   then the outputs are untouched. */
const char *image_read_png(const char *path, uint8_t **rgb, int *width, int *height);

/* Mean of the squared channel differences of two pictures, 0 to 65025. With a sky colour (three
   bytes, or null) only the pixels count where either picture shows something else. */
double image_mean_square(const uint8_t *a, const uint8_t *b, size_t pixel_count,
                         const uint8_t *sky);

/* How many pixels are not of the sky's colour. */
size_t image_not_sky(const uint8_t *rgb, size_t pixel_count, const uint8_t *sky);

/* Peak signal to noise ratio of a mean square, [dB]; 99 for equal pictures. */
double image_psnr(double mean_square);

/* Pixels of a picture that are sky although terrain lies there and all round it in the full mesh's
   picture of the same frame. */
size_t image_holes(const uint8_t *rgb, const uint8_t *full, int width, int height,
                   const uint8_t *sky);

/* Difference picture: white where a and b are equal, darker by factor times the difference.
   out may be a or b. */
void image_difference(const uint8_t *a, const uint8_t *b, size_t pixel_count, int factor,
                      uint8_t *out);

#endif
