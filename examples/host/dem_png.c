/* Elevation in PNG files, grey of 8 or 16 bits, or in colours that are all grey. */
#include "dem_parts.h"

#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#ifdef HOST_NO_PNG

int dem_read_png(dem *d, dem_file *f)
{
    return dem_fail(d, "%s: PNG files cannot be read here", f->path);
}

#else

#include <png.h>

/* What libpng's callbacks need; its errors end in a jump to `back`. */
typedef struct reading {
    const dem_file *file;
    size_t at;
    png_structp png;
    png_infop info;
    png_bytep pixels;   /* all, as libpng leaves them */
    png_bytepp rows;
    jmp_buf back;
    char trouble[80];
} reading;

static void give_png_bytes(png_structp png, png_bytep out, size_t count)
{
    reading *r = png_get_io_ptr(png);
    if (count > r->file->size - r->at)
        png_error(png, "the file is cut short");
    memcpy(out, r->file->bytes + r->at, count);
    r->at += count;
}

static void note_error(png_structp png, png_const_charp text)
{
    reading *r = png_get_error_ptr(png);
    strncpy(r->trouble, text, sizeof r->trouble - 1);
    longjmp(r->back, 1);
}

static void ignore_warning(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

/* Brings all kinds to one: 8 or 16 bits in native order, 1 or 3 channels; the values stay. */
static void set_transforms(reading *r)
{
    const uint16_t one = 1;
    int colour = png_get_color_type(r->png, r->info);
    if (colour == PNG_COLOR_TYPE_PALETTE)
        png_set_palette_to_rgb(r->png);
    if (colour == PNG_COLOR_TYPE_GRAY && png_get_bit_depth(r->png, r->info) < 8)
        png_set_packing(r->png);
    png_set_strip_alpha(r->png);
    if (*(const uint8_t *)&one)
        png_set_swap(r->png);
    png_set_interlace_handling(r->png);
    png_read_update_info(r->png, r->info);
}

/* Deflate makes at most 1032 bytes of one: a file that promises more is cut or hostile. */
static void check_promise(const reading *r, uint64_t bytes)
{
    if (bytes / 1032 > r->file->size)
        png_error(r->png, "the file is cut short");
}

static void read_pixels(reading *r, dem_file *f)
{
    size_t row_bytes, z;
    png_read_info(r->png, r->info);
    f->width = png_get_image_width(r->png, r->info);
    f->depth = png_get_image_height(r->png, r->info);
    check_promise(r, f->depth * png_get_rowbytes(r->png, r->info));
    set_transforms(r);
    row_bytes = png_get_rowbytes(r->png, r->info);
    r->pixels = malloc(row_bytes * (size_t)f->depth);
    r->rows = malloc((size_t)f->depth * sizeof *r->rows);
    if (!r->pixels || !r->rows)
        png_error(r->png, "out of memory");
    for (z = 0; z < f->depth; z++)
        r->rows[z] = r->pixels + z * row_bytes;
    png_read_image(r->png, r->rows);
}

/* Of three channels the first, if all are alike: rows move to the front of their own block. */
static void keep_grey(reading *r, dem_file *f)
{
    size_t count = (size_t)(f->width * f->depth), sample, i;
    unsigned channels = png_get_channels(r->png, r->info);
    f->format = png_get_bit_depth(r->png, r->info) == 16 ? TERRIMP_FORMAT_U16
                                                         : TERRIMP_FORMAT_U8;
    sample = dem_sample_bytes(f->format);
    for (i = 0; channels == 3 && i < count; i++) {
        const uint8_t *pixel = r->pixels + i * 3 * sample;
        if (memcmp(pixel, pixel + sample, sample) != 0
            || memcmp(pixel, pixel + 2 * sample, sample) != 0)
            png_error(r->png, "a picture in colours is no elevation");
        memmove(r->pixels + i * sample, pixel, sample);
    }
}

/* Returns whether libpng got to the end. */
static int read_picture(reading *r, dem_file *f)
{
    if (setjmp(r->back))
        return 0;
    png_set_read_fn(r->png, r, give_png_bytes);
    png_set_user_limits(r->png, TERRIMP_MAX_DIM, TERRIMP_MAX_DIM);
    read_pixels(r, f);
    keep_grey(r, f);
    return 1;
}

int dem_read_png(dem *d, dem_file *f)
{
    reading r;
    int ok;
    memset(&r, 0, sizeof r);
    r.file = f;
    r.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &r, note_error, ignore_warning);
    r.info = r.png ? png_create_info_struct(r.png) : NULL;
    ok = r.info && read_picture(&r, f);
    png_destroy_read_struct(&r.png, &r.info, NULL);
    free(r.rows);
    if (ok) {
        dem_take_room(f, r.pixels);
        return 1;
    }
    free(r.pixels);
    return dem_fail(d, "%s: %s", f->path, r.trouble[0] ? r.trouble : "out of memory");
}

#endif
