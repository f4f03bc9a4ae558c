/* What is flown over and where: samples from a file or made up, a path from a file or the thesis'
   circle, and the camera of every frame. */
#ifndef HOST_TOUR_H
#define HOST_TOUR_H

#include "dem.h"
#include "flight.h"

typedef struct tour_desc {
    const char *dem;          /* elevation file; null: terrain is made up */
    dem_desc file;            /* what to read of it */
    uint32_t size, seed;      /* of terrain that is made up: samples along a side */
    float spacing[2];         /* [wu] [Default 0 -> the file's; 1 where it is made up] */
    float height_scale;       /* [wu] for one step of a sample [Default 0 -> 1; of a file without
                                 units that is steeper than a map of anything: an eighth as high as
                                 wide] */
    float origin[2];          /* [wu] x, z of the first sample */
    const char *path;         /* a line a frame; null: the circle */
    size_t frames;            /* [Default 0 -> all of the path, 600 of the circle] */
    float above;              /* [wu] the circle is a lower one, that far above the ground
                                 [Default 0 -> the thesis'] */
    float speed;              /* round the circle [wu/s] [Default 0 -> 80 spacings a second] */
    float fps;                /* [Default 0 -> 60] */
    float fov_y_rad;          /* [Default 0 -> 60 degrees] */
    uint32_t width, height;   /* of the picture [pixels] */
} tour_desc;

typedef struct tour {
    tour_desc desc;           /* its texts stay the caller's */
    dem dem;                  /* owns the samples */
    terrimp_heightfield field;
    size_t voids_filled;
    flight flight;
    char error[512];          /* one line, after a failure */
} tour;

/* Gets the samples; voids are filled. Returns 1, or 0 with t->error; close it then, too. */
int tour_load(tour *t, const tour_desc *desc);

/* Plans the flight over t->field, which may also have been set by hand. Returns the same. */
int tour_plan(tour *t);

/* A camera in a pose that sees all of a box. */
terrimp_camera tour_camera_at(const flight_pose *pose, const terrimp_box *box, float fov_y_rad,
                              uint32_t width, uint32_t height);

/* The camera of a frame. Its clip distances hold a box: that of all that is drawn. */
terrimp_camera tour_camera(const tour *t, const terrimp_box *box, size_t frame);

/* Brings the clip distances to what an update says is needed: the depth buffer's precision goes
   where there is something to draw. */
void tour_tighten(terrimp_camera *camera, const terrimp_stats *now);

/* Fine after a failure, and twice. */
void tour_close(tour *t);

#endif
