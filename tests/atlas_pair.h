/* Two atlases in turn, after Hess 2010, section 4.3, on top of terrimp_pack_ffdh: pictures move
   from the outdated atlas to the newest one as they are renewed; when all have moved, the outdated
   one is emptied, packed anew and becomes the newest. What the live atlas is measured against. */
#ifndef ATLAS_PAIR_H
#define ATLAS_PAIR_H

#include "terrimp.h"

/* A row of rectangles side by side. */
typedef struct pair_shelf {
    uint32_t y, height; /* fixed by the first rectangle on the shelf */
    uint32_t used;      /* from x = 0 */
} pair_shelf;

typedef struct pair_atlas {
    pair_shelf *shelves; /* one for each rectangle always suffices */
    uint32_t capacity, count;
    uint32_t top;        /* first row above the shelves */
} pair_atlas;

/* Where one impostor stands in the two atlases. */
typedef struct pair_slot {
    terrimp_rect rect[2];      /* its rectangle in each atlas, where assigned */
    unsigned char assigned[2];
    unsigned char filled[2];   /* a picture is there */
} pair_slot;

typedef struct atlas_pair {
    pair_atlas atlas[2];
    uint32_t width, height; /* of each */
    uint32_t newest;        /* 0 or 1 */
    uint32_t repacks;       /* so far */
} atlas_pair;

/* shelves [2 * capacity] */
static void pair_init(atlas_pair *pair, uint32_t width, uint32_t height, pair_shelf *shelves,
                      uint32_t capacity)
{
    uint32_t i;
    pair->width = width;
    pair->height = height;
    pair->newest = pair->repacks = 0;
    for (i = 0; i < 2u; i++) {
        pair->atlas[i].shelves = shelves + i * capacity;
        pair->atlas[i].capacity = capacity;
        pair->atlas[i].count = pair->atlas[i].top = 0;
    }
}

/* First fit: the lowest shelf with room for a rectangle, or a new one. Returns whether it fits. */
static int pair_insert(const atlas_pair *pair, pair_atlas *atlas, terrimp_rect *rect)
{
    pair_shelf *shelf = atlas->shelves, *end = shelf + atlas->count;
    if (rect->width < 1u || rect->height < 1u || rect->width > pair->width ||
        rect->height > pair->height)
        return 0;
    while (shelf < end && (rect->height > shelf->height || shelf->used > pair->width - rect->width))
        shelf++;
    if (shelf == end) {
        if (atlas->count == atlas->capacity || atlas->top > pair->height - rect->height)
            return 0;
        atlas->count++;
        shelf->y = atlas->top;
        shelf->height = rect->height;
        shelf->used = 0;
        atlas->top += rect->height;
    }
    rect->x = shelf->used;
    rect->y = shelf->y;
    shelf->used += rect->width;
    return 1;
}

/* Empties the outdated atlas, packs a set of sizes into it, all reduced alike if they do not fit,
   and makes it the newest. Every slot loses what it had in that atlas; what it has in the other one
   stays. Returns whether they fitted.

   rects      [count] in: sizes, in the order of slots, an empty one for a slot that needs none;
              out: rectangles
   order      [2 * count] scratch
   scale      out, factor by which all sides were reduced */
static int pair_repack(atlas_pair *pair, pair_slot *slots, terrimp_rect *rects, uint32_t count,
                       uint32_t *order, float *scale)
{
    uint32_t i, outdated = 1u - pair->newest;
    pair_atlas *atlas = &pair->atlas[outdated];
    int fits = terrimp_pack_ffdh(pair->width, pair->height, rects, count, order, scale) ==
               TERRIMP_OK;
    pair->newest = outdated;
    pair->repacks++;
    atlas->count = atlas->top = 0;
    for (i = 0; i < count; i++)
        slots[i].assigned[outdated] = slots[i].filled[outdated] = 0;
    for (i = 0; fits && i < count; i++) {
        terrimp_rect rect = rects[order[i]];
        if (rect.width == 0 || rect.height == 0)
            continue;
        (void)pair_insert(pair, atlas, &rect); /* to where it has been packed: the same shelves */
        slots[order[i]].rect[outdated] = rect;
        slots[order[i]].assigned[outdated] = 1;
    }
    return fits;
}

/* Gives a slot a rectangle of the wanted size in the newest atlas. Returns whether it fitted. */
static int pair_assign(atlas_pair *pair, pair_slot *slot, uint32_t width, uint32_t height)
{
    terrimp_rect rect;
    rect.x = rect.y = 0;
    rect.width = width;
    rect.height = height;
    if (!pair_insert(pair, &pair->atlas[pair->newest], &rect))
        return 0;
    slot->rect[pair->newest] = rect;
    slot->assigned[pair->newest] = 1;
    slot->filled[pair->newest] = 0;
    return 1;
}

/* Notes that the picture has been rendered into the slot of the newest atlas: it has moved. */
static void pair_fill(const atlas_pair *pair, pair_slot *slot)
{
    slot->filled[pair->newest] = 1;
    slot->assigned[1u - pair->newest] = slot->filled[1u - pair->newest] = 0;
}

/* The atlas that holds the slot's latest picture, 0 or 1, or -1 when it has none. */
static int pair_picture(const atlas_pair *pair, const pair_slot *slot)
{
    if (slot->filled[pair->newest])
        return (int)pair->newest;
    return slot->filled[1u - pair->newest] ? (int)(1u - pair->newest) : -1;
}

#endif
