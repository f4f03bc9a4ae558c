/* An eye that walks on a terrain or flies over it. */
#ifndef HOST_WALKER_H
#define HOST_WALKER_H

#include "flight.h"
#include "terrimp.h"

#define WALKER_HEIGHT 1.8f /* [wu] of the eye over the ground */

typedef struct walker {
    float eye[3], yaw, pitch; /* yaw 0 looks along -z; pitch up */
    float speed;              /* [wu/s] of flying; walking is a tenth of it */
    float fall;               /* [wu/s] upwards, when walking */
    int walking, standing;
} walker;

/* What is asked of it, each -1, 0 or 1. */
typedef struct walker_wish {
    int ahead, aside, up, fast;
} walker_wish;

/* Puts the eye where a pose has it. */
void walker_place(walker *w, const flight_pose *pose);

void walker_turn(walker *w, float yaw, float pitch);
void walker_forward(const walker *w, float forward[3]);

/* Height of the ground under the eye, also beside the terrain. */
float walker_ground(const walker *w, const terrimp_heightfield *field);

/* Moves it by what it does in so many seconds; when it walks, up is a jump. */
void walker_move(walker *w, const terrimp_heightfield *field, const walker_wish *wish,
                 float seconds);

#endif
