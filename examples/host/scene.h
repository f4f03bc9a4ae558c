/* What the hosts of several kinds show, so that each is only about its kind: a small terrain, a
   flight over it, and a judge who compares pictures with those of the full mesh. */
#ifndef HOST_SCENE_H
#define HOST_SCENE_H

#include "terrimp.h"

enum { SCENE_SIDE = 512, SCENE_QUADS = 32, SCENE_FRAMES = 40 };

extern const uint8_t scene_sky[3]; /* has an RGB565 of its own, 0xae9d */

typedef struct scene {
    terrimp_terrain_desc desc; /* SCENE_SIDE x SCENE_SIDE samples, chunks of SCENE_QUADS quads */
    uint16_t *samples;
    uint8_t *lightmap;         /* rgb[SCENE_SIDE][SCENE_SIDE][3] */
    float lightmap_matrix[16]; /* world (x, y, z, 1) to (s, t, r, q): texel centres on samples */
    double worst_psnr;         /* [dB] over terrain, of the pictures judged so far */
    size_t holes;              /* their pixels of sky within terrain */
} scene;

/* Returns null, or one line that says what is wrong; then there is nothing to close. */
const char *scene_open(scene *s);
void scene_close(scene *s);

/* Where the eye is. */
terrimp_camera scene_camera(int frame, int width, int height);

/* Whether a frame is one of those that are compared: every tenth. */
int scene_judges(int frame);

/* Compares two pictures rgb[height][width][3] of a frame and prints a line. */
void scene_judge(scene *s, int frame, const terrimp_stats *stats, const uint8_t *rgb,
                 const uint8_t *full, int width, int height);

/* Prints the verdict and returns whether there were no holes and at least that PSNR. */
int scene_accepts(const scene *s, double least_psnr);

#endif
