/* Where the camera is in each frame: a path from a file, or a circle over the terrain. */
#ifndef HOST_FLIGHT_H
#define HOST_FLIGHT_H

#include "terrimp.h"

#include <stddef.h>

typedef struct flight_pose {
    float eye[3], target[3]; /* [wu] */
} flight_pose;

typedef struct flight {
    flight_pose *poses;
    size_t count;
    char error[512]; /* one line, after a failure */
} flight;

/* Reads a text file of lines `eye_x eye_y eye_z target_x target_y target_z`. Empty lines and lines
   that begin with # are skipped. Returns 1, or 0 with f->error and nothing to free. */
int flight_load(flight *f, const char *path);

/* The thesis' flight: a circle over nearly the whole width of the terrain, at a fixed height over
   the highest ground below it, at `step` world units a frame, looking ahead and somewhat down. With
   `above` it is a smaller one, always so many world units above the ground, looking level ahead.
   Returns 1, or 0 with f->error and nothing to free. */
int flight_circle(flight *f, const terrimp_heightfield *field, size_t count, float step,
                  float above);

void flight_free(flight *f);

#endif
