/* The command line of flyover. */
#ifndef HOST_OPTIONS_H
#define HOST_OPTIONS_H

#include "dem.h"

#include <stdint.h>
#include <stdio.h>

enum { OPTIONS_MAX_SAVED = 256 };

/* Numbers that were not given are 0, texts are null: the program or the library has a default. */
typedef struct options {
    const char *mode;                  /* as written; default "auto" */
    int terrimp_mode;                  /* what it means to the library */
    const char *dem, *path, *out, *stats;
    dem_desc file;                     /* --format, --raw-size, --crop and what else it takes */
    uint32_t terrain_size, seed;
    uint32_t width, height;            /* of the picture, pixels */
    float fov_degrees;
    uint32_t frames;
    float speed, fps, above;
    float spacing[2], height_scale;
    float origin[2];                   /* x, z of the first sample */
    uint32_t chunk, atlas, atlas_count;
    uint32_t max_captures, max_capture_texels, max_capture_triangles;
    float fade[2], max_angle_degrees, tolerance, ground_tolerance, texels, impostor_px;
    int no_lookahead, no_splits, no_spreading, exact_depth, hide;
    int rule;                          /* terrimp_geomip_rule */
    float morph;
    uint32_t save_every;
    uint32_t save_frames[OPTIONS_MAX_SAVED], save_frame_count;
    uint8_t sky[3];
    int wireframe, show_atlas, compare, help;
    uint64_t given;                    /* which options were, a bit each */
    char error[256];                   /* one line, after a failure */
} options;

/* Reads the command line. Returns 1, or 0 with o->error. */
int options_parse(options *o, int argc, char **argv);

/* Prints a line for each option that was given but does nothing beside the others; raw: whether the
   file was one of raw samples. */
void options_print_ignored(const options *o, int raw, FILE *file);

/* Prints every option with its default. */
void options_print_help(FILE *file);

/* Whether a frame's picture is to be saved. */
int options_saves(const options *o, uint32_t frame);

#endif
