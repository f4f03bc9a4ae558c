/* Elevation as text: plain PGM and ESRI ASCII grids. */
#include "dem_parts.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of so many bytes, each number but the last takes two at least. */
static int check_length(dem *d, const dem_file *f, size_t at)
{
    if ((f->size - at) / 2 + 1 >= f->width * f->depth)
        return 1;
    return dem_fail(d, "%s: is too short for %.0fx%.0f numbers", f->path, (double)f->width,
                    (double)f->depth);
}

int dem_read_plain_pgm(dem *d, dem_file *f, size_t at, uint64_t largest)
{
    size_t count = (size_t)(f->width * f->depth), i;
    uint8_t *samples;
    if (!check_length(d, f, at))
        return 0;
    samples = dem_make_room(d, f);
    for (i = 0; samples && i < count; i++) {
        uint64_t value;
        at = dem_pgm_number(f->bytes, f->size, at, &value);
        if (!at || value > largest) {
            free(samples);
            return dem_fail(d, "%s: sample %zu is missing or larger than %.0f", f->path, i,
                            (double)largest);
        }
        if (f->format == TERRIMP_FORMAT_U8)
            samples[i] = (uint8_t)value;
        else
            ((uint16_t *)(void *)samples)[i] = (uint16_t)value;
    }
    if (samples)
        dem_take_room(f, samples);
    return samples != NULL;
}

/* ---- ESRI ASCII grids --------------------------------------------------- */

enum { WORD = 64 };

typedef struct esri_header {
    double columns, rows, left, bottom, cell_x, cell_z;
} esri_header;

/* The next word, at most WORD - 1 bytes of it; where it ends, or 0 when there is none. */
static size_t read_word(const dem_file *f, size_t at, char word[WORD])
{
    size_t length = 0;
    while (at < f->size && isspace(f->bytes[at]))
        at++;
    for (; at < f->size && !isspace(f->bytes[at]); at++)
        if (length + 1 < WORD)
            word[length++] = (char)tolower(f->bytes[at]);
    word[length] = 0;
    return length ? at : 0;
}

static size_t read_number(const dem_file *f, size_t at, double *number)
{
    char word[WORD], *end;
    at = read_word(f, at, word);
    if (!at || strpbrk(word, "xp")) /* hexadecimal is C's idea, not a grid's */
        return 0;
    *number = strtod(word, &end);
    return *end ? 0 : at;
}

/* Takes a line `key value` of the header. Returns where it ends, or 0. */
static size_t take_key(dem_file *f, const char *key, size_t at, esri_header *h)
{
    static const char *const keys[] = { "ncols", "nrows", "xllcorner", "xllcenter", "yllcorner",
                                        "yllcenter", "cellsize", "dx", "dy", "nodata_value" };
    double *const fields[] = { &h->columns, &h->rows, &h->left, &h->left, &h->bottom, &h->bottom,
                               &h->cell_x, &h->cell_x, &h->cell_z, &f->no_data };
    size_t i;
    for (i = 0; i < sizeof keys / sizeof *keys; i++)
        if (strcmp(key, keys[i]) == 0) {
            at = read_number(f, at, fields[i]);
            if (i == 6)
                h->cell_z = h->cell_x;
            if (fields[i] == &f->no_data)
                f->has_no_data = 1;
            return at;
        }
    return 0;
}

/* Leaves `at` at the first sample; 0 for a header that is wrong. */
static int read_header(dem_file *f, size_t *at, esri_header *h)
{
    char word[WORD];
    size_t next = 0;
    memset(h, 0, sizeof *h);
    for (;;) {
        next = read_word(f, *at, word);
        if (!next || !isalpha((unsigned char)word[0]) || strcmp(word, "nan") == 0)
            return next != 0;
        *at = take_key(f, word, next, h);
        if (!*at)
            return 0;
    }
}

/* Cells so small, on a globe: degrees. */
static int is_geographic(const esri_header *h)
{
    return fabs(h->left) <= 361.0 && fabs(h->bottom) <= 91.0 && h->cell_x < 0.05
           && h->cell_x * h->columns <= 361.0 && h->cell_z * h->rows <= 181.0;
}

static int take_header(dem *d, dem_file *f, const esri_header *h)
{
    if (!(h->columns >= 0.0 && h->columns < 1e9 && h->rows >= 0.0 && h->rows < 1e9))
        return dem_fail(d, "%s: malformed header of an ESRI grid", f->path);
    f->width = (uint64_t)h->columns;
    f->depth = (uint64_t)h->rows;
    f->format = TERRIMP_FORMAT_F32;
    if (h->cell_x > 0.0 && h->cell_x < 1e9 && h->cell_z > 0.0 && h->cell_z < 1e9) {
        f->spacing_x = h->cell_x;
        f->spacing_z = h->cell_z;
        if (is_geographic(h))
            dem_degrees_to_metres(f, h->bottom + 0.5 * h->cell_z * h->rows);
    }
    return dem_check_sides(d, f);
}

int dem_read_esri(dem *d, dem_file *f)
{
    esri_header header;
    size_t at = 0, count, i;
    char word[WORD];
    float *samples;
    if (!read_header(f, &at, &header))
        return dem_fail(d, "%s: malformed header of an ESRI grid", f->path);
    if (!take_header(d, f, &header) || !check_length(d, f, at))
        return 0;
    samples = dem_make_room(d, f);
    count = (size_t)(f->width * f->depth);
    for (i = 0; samples && i < count; i++) {
        double value;
        at = read_number(f, at, &value);
        if (!at || fabs(value) > 3.4e38) {
            free(samples);
            return dem_fail(d, "%s: number %zu of %zu is missing or none", f->path, i, count);
        }
        samples[i] = (float)value;
    }
    if (samples && read_word(f, at, word)) {
        free(samples);
        return dem_fail(d, "%s: holds more than %zu numbers", f->path, count);
    }
    if (samples)
        dem_take_room(f, samples);
    return samples != NULL;
}
