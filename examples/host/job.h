/* A terrain that is made while the program goes on: samples read or made up, nodes built on all
   cores, a lightmap. Without threads (HOST_NO_THREADS) it is made bit by bit, in job_poll. */
#ifndef HOST_JOB_H
#define HOST_JOB_H

#include "tour.h"

#ifndef HOST_NO_THREADS
#include <pthread.h>
#endif

enum { JOB_THREADS = 64 };
typedef enum job_stage { JOB_NONE, JOB_LOAD, JOB_BEGIN, JOB_NODES, JOB_FINISH, JOB_WALLS, JOB_LIGHT,
                         JOB_DONE, JOB_FAILED } job_stage;

typedef struct job {
    tour_desc what;
    uint32_t chunk_quads;
    job_stage stage;
    int leave;                 /* stop as soon as you can */
    tour tour;                 /* samples; no flight is planned */
    terrimp_terrain_desc desc; /* resolved */
    terrimp_terrain *terrain;  /* in memory */
    void *memory, *scratch;
    uint32_t node_count, left;
    void *walls;
    terrimp_horizon horizon;   /* over these: what ridges hide */
    uint8_t *lightmap;         /* rgb[depth][width][3] */
    char error[512];           /* one line, when the stage is JOB_FAILED */
#ifndef HOST_NO_THREADS
    pthread_mutex_t lock;      /* of stage, leave and left */
    pthread_t boss;
#endif
} job;

/* The texts of what stay the caller's; chunk_quads 0: the default. */
void job_start(job *j, const tour_desc *what, uint32_t chunk_quads);

/* Where it is, and how much of it is done, 0 to 1. */
job_stage job_poll(job *j, float *done);

/* Stops it if it has not ended, and frees all that it made. Fine without a start, and twice. */
void job_close(job *j);

#endif
