#define _POSIX_C_SOURCE 200809L /* sysconf */
#include "job.h"

#include "lightmap.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef HOST_NO_THREADS
#include <unistd.h>

static void lock(job *j) { pthread_mutex_lock(&j->lock); }
static void unlock(job *j) { pthread_mutex_unlock(&j->lock); }
#else
#include "stats.h"

static void lock(job *j) { (void)j; }
static void unlock(job *j) { (void)j; }
#endif

static job_stage fail(job *j, const char *trouble)
{
    lock(j);
    if (!j->error[0])
        snprintf(j->error, sizeof j->error, "%s", trouble);
    unlock(j);
    return JOB_FAILED;
}

static job_stage check(job *j, terrimp_result result, job_stage next)
{
    return result == TERRIMP_OK ? next : fail(j, terrimp_result_text((int)result));
}

static job_stage begin(job *j)
{
    size_t bytes;
    terrimp_quadtree tree;
    terrimp_result result;
    memset(&j->desc, 0, sizeof j->desc);
    j->desc.field = j->tour.field;
    j->desc.chunk_quads = j->chunk_quads;
    result = terrimp_terrain_desc_resolve(&j->desc, &j->desc);
    if (result == TERRIMP_OK)
        result = terrimp_quadtree_init(&j->desc.field, j->desc.chunk_quads, &tree);
    if (result != TERRIMP_OK)
        return check(j, result, JOB_FAILED);
    bytes = terrimp_terrain_bytes(&j->desc);
    j->memory = malloc(bytes);
    if (!bytes || !j->memory)
        return fail(j, "no memory for the terrain");
    j->node_count = j->left = tree.node_count;
    result = terrimp_terrain_init(&j->desc, j->memory, bytes, &j->terrain);
    if (result == TERRIMP_OK)
        result = terrimp_terrain_build_begin(j->terrain);
    return check(j, result, JOB_NODES);
}

/* Builds the next node, the largest first. Returns 0 when none is left. */
static int build_node(job *j, void *scratch)
{
    size_t bytes = terrimp_terrain_scratch_bytes(&j->desc);
    terrimp_result result;
    uint32_t node = UINT32_MAX;
    lock(j);
    if (j->left > 0 && !j->leave && !j->error[0])
        node = --j->left;
    unlock(j);
    if (node == UINT32_MAX)
        return 0;
    result = terrimp_terrain_build_node(j->terrain, node, scratch, bytes);
    if (result != TERRIMP_OK)
        fail(j, terrimp_result_text((int)result));
    return result == TERRIMP_OK;
}

static void *build_nodes(void *shared)
{
    job *j = shared;
    void *scratch = malloc(terrimp_terrain_scratch_bytes(&j->desc));
    if (!scratch)
        fail(j, "no memory for building");
    while (scratch && build_node(j, scratch)) {
    }
    free(scratch);
    return NULL;
}

/* Finds what ridges hide. */
static job_stage build_walls(job *j)
{
    const terrimp_quadtree *tree = terrimp_terrain_tree(j->terrain);
    j->walls = malloc(terrimp_walls_bytes(tree));
    if (!j->walls)
        return fail(j, "no memory for what ridges hide");
    terrimp_horizon_init(&j->horizon, tree, j->walls);
    return check(j, terrimp_walls_build(tree, NULL, j->walls), JOB_LIGHT);
}

/* Does what a stage is for, but for its nodes; returns the next. */
static job_stage step(job *j)
{
    switch (j->stage) {
    case JOB_LOAD: return tour_load(&j->tour, &j->what) ? JOB_BEGIN : fail(j, j->tour.error);
    case JOB_BEGIN: return begin(j);
    case JOB_NODES: return j->error[0] ? JOB_FAILED : JOB_FINISH;
    case JOB_FINISH: return check(j, terrimp_terrain_build_finish(j->terrain), JOB_WALLS);
    case JOB_WALLS: return build_walls(j);
    case JOB_LIGHT:
        j->lightmap = lightmap_bake(&j->tour.field);
        return j->lightmap ? JOB_DONE : fail(j, "no memory for the lightmap");
    default: return j->stage;
    }
}

#ifndef HOST_NO_THREADS

static void build_on_all_cores(job *j)
{
    pthread_t threads[JOB_THREADS];
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    int started = 0;
    while (started + 1 < cores && started < JOB_THREADS
           && pthread_create(&threads[started], NULL, build_nodes, j) == 0)
        started++;
    build_nodes(j);
    while (started > 0)
        pthread_join(threads[--started], NULL);
}

static void *run(void *shared)
{
    job *j = shared;
    int leave = 0;
    while (j->stage != JOB_DONE && j->stage != JOB_FAILED && !leave) {
        job_stage next;
        if (j->stage == JOB_NODES)
            build_on_all_cores(j);
        lock(j);
        leave = j->leave;
        unlock(j);
        next = leave ? JOB_FAILED : step(j);
        lock(j);
        j->stage = next;
        unlock(j);
    }
    return NULL;
}

void job_start(job *j, const tour_desc *what, uint32_t chunk_quads)
{
    memset(j, 0, sizeof *j);
    j->what = *what;
    j->chunk_quads = chunk_quads;
    j->stage = JOB_LOAD;
    pthread_mutex_init(&j->lock, NULL);
    if (pthread_create(&j->boss, NULL, run, j) != 0) {
        pthread_mutex_destroy(&j->lock);
        memset(j, 0, sizeof *j);
    }
}

static void stop(job *j)
{
    lock(j);
    j->leave = 1;
    unlock(j);
    pthread_join(j->boss, NULL);
    pthread_mutex_destroy(&j->lock);
}

#else

void job_start(job *j, const tour_desc *what, uint32_t chunk_quads)
{
    memset(j, 0, sizeof *j);
    j->what = *what;
    j->chunk_quads = chunk_quads;
    j->stage = JOB_LOAD;
}

/* So long that work weighs more than the frame around it, so short that the page stays alive. */
static void work_a_little(job *j)
{
    double start = clock_ms();
    if (j->stage == JOB_NODES && !j->scratch)
        j->scratch = malloc(terrimp_terrain_scratch_bytes(&j->desc));
    if (j->stage == JOB_NODES && !j->scratch)
        fail(j, "no memory for building");
    while (j->stage == JOB_NODES && clock_ms() - start < 40.0 && build_node(j, j->scratch)) {
    }
    if (j->stage != JOB_NODES || j->left == 0 || j->error[0])
        j->stage = step(j);
}

static void stop(job *j)
{
    free(j->scratch);
}

#endif

job_stage job_poll(job *j, float *done)
{
    job_stage stage;
#ifdef HOST_NO_THREADS
    work_a_little(j);
#endif
    lock(j);
    stage = j->stage;
    *done = stage == JOB_NODES
        ? 0.1f + 0.8f * (1.0f - (float)j->left / (float)(j->node_count ? j->node_count : 1))
        : stage < JOB_NODES ? 0.05f : stage < JOB_DONE ? 0.95f : 1.0f;
    unlock(j);
    return stage;
}

void job_close(job *j)
{
    if (j->stage == JOB_NONE)
        return;
    stop(j);
    tour_close(&j->tour);
    free(j->memory);
    free(j->walls);
    free(j->lightmap);
    memset(j, 0, sizeof *j);
}
