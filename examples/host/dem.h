/* Elevation files: .hgt tiles, binary PGM, raw samples. The samples keep their own size; nothing
   becomes float. */
#ifndef HOST_DEM_H
#define HOST_DEM_H

#include "terrimp.h"

#include <stddef.h>
#include <stdint.h>

/* What to read of a file, and what a raw file cannot say about itself. All zero: everything. */
typedef struct dem_desc {
    int raw_format;                /* terrimp_format of a raw file, or 0 */
    uint32_t raw_width, raw_depth; /* samples of a raw file, or 0 */
    uint32_t crop_x, crop_z;       /* first sample that is kept */
    uint32_t crop_width, crop_depth; /* samples that are kept [Default 0 -> all that follow] */
} dem_desc;

typedef struct dem {
    void *samples;         /* malloc'ed, rows without gaps, native byte order */
    uint32_t width, depth; /* 2..TERRIMP_MAX_DIM each */
    int format;            /* terrimp_format */
    float spacing_x, spacing_z; /* [wu] 1, or metres for a .hgt, from the latitude in its name */
    int has_voids;         /* some sample means no data: -32768 of S16, or a NaN of F32 */
    char error[512];       /* one line, after a failure */
} dem;

/* Loads a file: .hgt by its name (square, big-endian S16, the side follows from the length), PGM
   by its first bytes (P5; U8, or U16 when its largest value passes 255), or raw little-endian
   samples of desc's format and size. Returns 1, or 0 with d->error and nothing to free. */
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
