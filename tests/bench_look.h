/* How a scene of the frame benchmark looks: under one lightmap, under dearer shading, or with
   trees; the same in every way of drawing the terrain. */
#ifndef BENCH_LOOK_H
#define BENCH_LOOK_H

#include "bench_scene.h"

#include "examples/host/shading.h"
#include "examples/host/trees.h"

enum { LOOK_LIGHTMAP, LOOK_MATERIALS, LOOK_TREES };
enum { LOOK_TREE_COUNT = 6000 };

typedef struct look {
    int kind;
    shading shading;
    trees trees;
    int chunks;       /* the scene's terrain that the trees are sorted by */
    float seconds;    /* of the frame that is drawn */
} look;

static void look_need(const char *trouble)
{
    if (trouble)
        bench_stop("the looks of the scene", trouble);
}

static void look_open(look *l, int kind, scene *s)
{
    memset(l, 0, sizeof *l);
    l->kind = kind;
    if (kind == LOOK_MATERIALS)
        look_need(shading_open(&l->shading, &s->tour.field, s->lightmap));
    s->shading = kind == LOOK_MATERIALS ? shading_source : NULL;
    if (kind == LOOK_TREES) {
        l->chunks = scene_terrain(s, scene_chunk_quads[0]);
        look_need(trees_open(&l->trees, s->terrain[l->chunks], &s->tour.field, LOOK_TREE_COUNT, 0));
    }
}

/* The callbacks for a frame, between gl_terrain_begin and gl_terrain_end. */
static terrimp_callbacks look_begin(look *l, gl_terrain *gl)
{
    terrimp_callbacks callbacks = gl_terrain_callbacks(gl);
    if (l->kind == LOOK_MATERIALS)
        shading_begin(&l->shading, gl, l->seconds);
    if (l->kind == LOOK_TREES)
        callbacks = trees_callbacks(&l->trees, gl, callbacks);
    return callbacks;
}

static void look_end(look *l)
{
    if (l->kind == LOOK_TREES)
        trees_end(&l->trees);
}

static void look_close(look *l)
{
    if (l->kind == LOOK_MATERIALS)
        shading_close(&l->shading);
    if (l->kind == LOOK_TREES)
        trees_close(&l->trees);
}

#endif
