#include "image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef HOST_NO_PNG

const char *image_write_png(const char *path, const uint8_t *rgb, int width, int height)
{
    (void)path, (void)rgb, (void)width, (void)height;
    return "PNG files cannot be written here";
}

const char *image_read_png(const char *path, uint8_t **rgb, int *width, int *height)
{
    (void)path, (void)rgb, (void)width, (void)height;
    return "PNG files cannot be read here";
}

#else
#include <png.h>

/* libpng's message dies with its png_image, so the last one is kept here. */
static char png_trouble[64 + 8];

static const char *png_failed(png_image *png)
{
    memcpy(png_trouble, png->message, sizeof png->message);
    png_image_free(png);
    return png_trouble;
}

const char *image_write_png(const char *path, const uint8_t *rgb, int width, int height)
{
    png_image png;
    memset(&png, 0, sizeof png);
    png.version = PNG_IMAGE_VERSION;
    png.width = (png_uint_32)width;
    png.height = (png_uint_32)height;
    png.format = PNG_FORMAT_RGB;
    png.flags = PNG_IMAGE_FLAG_FAST;
    if (!png_image_write_to_file(&png, path, 0, rgb, 0, NULL))
        return png_failed(&png);
    return NULL;
}

const char *image_read_png(const char *path, uint8_t **rgb, int *width, int *height)
{
    png_image png;
    uint8_t *pixels;
    memset(&png, 0, sizeof png);
    png.version = PNG_IMAGE_VERSION;
    if (!png_image_begin_read_from_file(&png, path))
        return png_failed(&png);
    png.format = PNG_FORMAT_RGB;
    pixels = malloc(PNG_IMAGE_SIZE(png));
    if (!pixels) {
        png_image_free(&png);
        return "out of memory";
    }
    if (!png_image_finish_read(&png, NULL, pixels, 0, NULL)) {
        free(pixels);
        return png_failed(&png);
    }
    *rgb = pixels;
    *width = (int)png.width;
    *height = (int)png.height;
    return NULL;
}

#endif

const char *image_write_beside(const char *program, const char *name, const uint8_t *rgb,
                               int width, int height)
{
    char path[1024];
    const char *slash = strrchr(program, '/');
    size_t length = slash ? (size_t)(slash - program) + 1 : 0;
    if (length + strlen(name) >= sizeof path)
        return "the program's path is too long";
    memcpy(path, program, length);
    strcpy(path + length, name);
    return image_write_png(path, rgb, width, height);
}

static int is_colour(const uint8_t *pixel, const uint8_t *colour)
{
    return pixel[0] == colour[0] && pixel[1] == colour[1] && pixel[2] == colour[2];
}

double image_mean_square(const uint8_t *a, const uint8_t *b, size_t pixel_count,
                         const uint8_t *sky)
{
    uint64_t sum = 0, counted = 0;
    size_t i;
    for (i = 0; i < pixel_count; i++, a += 3, b += 3) {
        int red = a[0] - b[0], green = a[1] - b[1], blue = a[2] - b[2];
        if (sky && is_colour(a, sky) && is_colour(b, sky))
            continue;
        sum += (uint64_t)(red * red + green * green + blue * blue);
        counted += 3;
    }
    return counted ? (double)sum / (double)counted : 0.0;
}

size_t image_not_sky(const uint8_t *rgb, size_t pixel_count, const uint8_t *sky)
{
    size_t count = 0, i;
    for (i = 0; i < pixel_count; i++)
        count += !is_colour(rgb + i * 3, sky);
    return count;
}

double image_psnr(double mean_square)
{
    return mean_square > 0.0 ? 10.0 * log10(255.0 * 255.0 / mean_square) : 99.0;
}

void image_difference(const uint8_t *a, const uint8_t *b, size_t pixel_count, int factor,
                      uint8_t *out)
{
    size_t i;
    for (i = 0; i < pixel_count * 3; i++) {
        int ink = factor * abs(a[i] - b[i]);
        out[i] = (uint8_t)(ink < 255 ? 255 - ink : 0);
    }
}

size_t image_holes(const uint8_t *rgb, const uint8_t *full, int width, int height,
                   const uint8_t *sky)
{
    size_t holes = 0;
    int x, y, i, covered;
    for (y = 1; y + 1 < height; y++)
        for (x = 1; x + 1 < width; x++) {
            if (!is_colour(rgb + (y * width + x) * 3, sky))
                continue;
            for (i = covered = 0; i < 9; i++) {
                int neighbour = (y + i / 3 - 1) * width + x + i % 3 - 1;
                covered += !is_colour(full + neighbour * 3, sky);
            }
            holes += covered == 9;
        }
    return holes;
}
