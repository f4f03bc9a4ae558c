/* What the readers of elevation files share. Each leaves its samples in a dem_file. */
#ifndef HOST_DEM_PARTS_H
#define HOST_DEM_PARTS_H

#include "dem.h"

enum { DEM_LITTLE_ENDIAN, DEM_BIG_ENDIAN, DEM_NATIVE };

/* A block, at first the file itself, and where in it which samples lie. */
typedef struct dem_file {
    const char *path;
    uint8_t *bytes;          /* malloc'ed */
    size_t size;
    size_t offset;           /* of the first sample [bytes] */
    size_t row_bytes;        /* from row to row; 0: without gaps */
    uint64_t width, depth;
    int format, order;
    double spacing_x, spacing_z; /* 0: the file does not say */
    int has_no_data;
    double no_data;
} dem_file;

/* Keeps a line that says what is wrong; returns 0. */
int dem_fail(dem *d, const char *format, ...);

size_t dem_sample_bytes(int format);

/* Whether the sides are within the limits; if not, that has been said. */
int dem_check_sides(dem *d, const dem_file *f);

/* Makes room for what is decoded of the file, f's size and format known; null if there is none,
   and that has been said. */
void *dem_make_room(dem *d, const dem_file *f);

/* Puts the decoded samples in the place of the file. */
void dem_take_room(dem_file *f, void *samples);

/* Turns spacings in degrees to metres, at a latitude [degrees]. */
void dem_degrees_to_metres(dem_file *f, double latitude);

/* Reads a number of at most nine digits, so that it cannot overflow, behind white space and
   comments; where it ends, or 0 when there is none. */
size_t dem_pgm_number(const uint8_t *bytes, size_t size, size_t at, uint64_t *number);

/* The readers that decode. Each returns 1, or 0 when it has said what is wrong. */
int dem_read_plain_pgm(dem *d, dem_file *f, size_t at, uint64_t largest);
int dem_read_esri(dem *d, dem_file *f);
int dem_read_png(dem *d, dem_file *f);
int dem_read_tiff(dem *d, dem_file *f);

#endif
