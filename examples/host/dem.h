/* Elevation files: .hgt tiles, PGM, PNG, ESRI ASCII grids, GeoTIFF, raw samples. The samples keep
   their own size; only text with fractions, and integers of 32 bits, become float. */
#ifndef HOST_DEM_H
#define HOST_DEM_H

#include "terrimp.h"

#include <stddef.h>
#include <stdint.h>

/* What to read of a file, and what it cannot say about itself. All zero: everything. */
typedef struct dem_desc {
    int raw_format;                /* terrimp_format: the file is raw, whatever it looks like */
    uint32_t raw_width, raw_depth; /* samples of a raw file [Default 0 -> it is square] */
    uint32_t crop_x, crop_z;       /* first sample that is kept */
    uint32_t crop_width, crop_depth; /* samples that are kept [Default 0 -> all that follow] */
    int big_endian;                /* of a raw file */
    uint32_t skip_bytes;           /* before the first sample of a raw file */
    uint32_t stride_bytes;         /* from row to row of it [Default 0 -> no gaps] */
    int has_no_data;               /* samples of the value no_data are voids */
    float no_data;
} dem_desc;

typedef struct dem {
    void *samples;         /* malloc'ed, rows without gaps, native byte order */
    uint32_t width, depth; /* 2..TERRIMP_MAX_DIM each */
    int format;            /* terrimp_format */
    float spacing_x, spacing_z; /* [wu] metres, or 1 where the file says nothing */
    int has_units;         /* heights and spacings are of one unit, by the file */
    int is_raw;            /* raw_format and its like have been used */
    int has_voids;         /* some sample means no data: no_data, or a NaN of F32 */
    float no_data;         /* -32768 of S16 */
    char error[512];       /* one line, after a failure */
    const char *remark;    /* null, or one line that the user should know */
} dem;

/* Loads a file of one of these kinds; the first row is the northern one.
     PNG       by its first bytes; grey, 8 or 16 bits
     GeoTIFF   likewise, where libtiff was there to be built with; integers and floats
     .hgt      by its name; big-endian S16, square or with rows thinned as in the far north; metres
               from the latitude in its name
     raw       by desc's format, or named .raw, .r16, .u16, .s16, .r8, .u8, .r32 or .f32
     PGM       by its first bytes: P5 and P2; U8, or U16 when its largest value passes 255
     ESRI      ASCII grid, by its first word; F32
   Returns 1, or 0 with d->error and nothing to free. */
int dem_load(dem *d, const char *path, const dem_desc *desc);

/* The same from a malloc'ed block that holds the file; d takes it over, also on failure. */
int dem_parse(dem *d, const char *path, uint8_t *bytes, size_t size, const dem_desc *desc);

/* A view of the samples; voids are marked if there are any. */
terrimp_heightfield dem_heightfield(const dem *d);

/* Fills the voids in place; returns how many there were. *trouble: null, or what went wrong. */
size_t dem_fill_voids(dem *d, const char **trouble);

/* Frees the samples; fine after a failed load, and twice. */
void dem_free(dem *d);

#endif
