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
        scene_stop("the looks of the scene", trouble);
}

static void look_open(look *l, int kind, scene *s)
{
    memset(l, 0, sizeof *l);
    l->kind = kind;
    if (kind == LOOK_MATERIALS)
        look_need(shading_open(&l->shading, &s->field, s->lightmap));
    if (kind == LOOK_TREES) {
        l->chunks = scene_terrain(s, scene_chunk_quads[0]);
        look_need(trees_open(&l->trees, s->terrain[l->chunks], &s->field, LOOK_TREE_COUNT));
    }
}

/* Once for each terrain of OpenGL's. */
static void look_dress(const look *l, gl_terrain *gl)
{
    if (l->kind == LOOK_MATERIALS && !shading_dress(gl))
        scene_stop("shading", "a dressed shader does not compile");
}

/* Draws a view, between gl_terrain_begin and gl_terrain_end. */
static terrimp_result look_render(look *l, gl_terrain *gl, terrimp_view *view)
{
    terrimp_callbacks callbacks = gl_terrain_callbacks(gl);
    terrimp_result result;
    if (l->kind == LOOK_MATERIALS) {
        shading_begin(&l->shading, gl, l->seconds);
        callbacks = shading_callbacks(&l->shading, gl, callbacks);
    }
    if (l->kind == LOOK_TREES)
        callbacks = trees_callbacks(&l->trees, gl, callbacks);
    result = terrimp_view_render(view, &callbacks);
    if (l->kind == LOOK_TREES)
        trees_end(&l->trees);
    return result;
}

static void look_close(look *l)
{
    if (l->kind == LOOK_MATERIALS)
        shading_close(&l->shading);
    if (l->kind == LOOK_TREES)
        trees_close(&l->trees);
}

#endif
