/* The yardstick of terrimp_cover: as Jeschke covers layers (2004, section 3.5). On a grid of cells,
   boxes grow from seeds, in the order of rows, as long as enough of their cells is filled; he found
   0.8 to work well. Each is then tightened to its opaque texels. */
#ifndef COVER_GREEDY_H
#define COVER_GREEDY_H

#include "terrimp.h"

#include <stdlib.h>

/* A box of cells, ends excluded, and how many of them are filled. */
typedef struct greedy_box {
    uint32_t x0, y0, x1, y1, filled;
} greedy_box;

static uint32_t greedy_word(const terrimp_cover_desc *g, uint32_t y, uint32_t word, uint32_t x0,
                            uint32_t x1)
{
    return terrimpi_mask_word(g->mask + (size_t)y * TERRIMP_MASK_WORDS(g->width), word, x0, x1);
}

/* How many cells of a box are filled, on a grid that is a mask. */
static uint32_t greedy_filled(const terrimp_cover_desc *g, uint32_t x0, uint32_t y0,
                                     uint32_t x1, uint32_t y1)
{
    uint32_t y, word, filled = 0;
    for (y = y0; y < y1 && x0 < x1; y++)
        for (word = x0 / 32u; word <= (x1 - 1u) / 32u; word++)
            filled += terrimpi_mask_bit_count(greedy_word(g, y, word, x0, x1));
    return filled;
}

/* The box one cell larger towards a side or a corner; 0 when the grid ends there. */
static int greedy_step(const terrimp_cover_desc *g, const greedy_box *b, int dx,
                              int dy, greedy_box *out)
{
    *out = *b;
    if ((dx < 0 && b->x0 == 0) || (dx > 0 && b->x1 == g->width) || (dy < 0 && b->y0 == 0) ||
        (dy > 0 && b->y1 == g->height))
        return 0;
    out->x0 -= dx < 0;
    out->x1 += dx > 0;
    out->y0 -= dy < 0;
    out->y1 += dy > 0;
    if (dx)
        out->filled += greedy_filled(g, dx < 0 ? out->x0 : b->x1, out->y0,
                                            dx < 0 ? b->x0 : out->x1, out->y1);
    if (dy)
        out->filled += greedy_filled(g, b->x0, dy < 0 ? out->y0 : b->y1, b->x1,
                                            dy < 0 ? b->y0 : out->y1);
    return 1;
}

static float greedy_area(const greedy_box *b)
{
    return (float)(b->x1 - b->x0) * (float)(b->y1 - b->y0);
}

/* Grows a box towards where most of the new cells are filled, while it stays filled enough. */
static void greedy_grow(const terrimp_cover_desc *g, float min_fill,
                                 greedy_box *box)
{
    for (;;) {
        greedy_box best = *box, next;
        float best_ratio = 0.0f;
        int k;
        for (k = 0; k < 9; k++) {
            float ratio;
            if (k == 4 || !greedy_step(g, box, k % 3 - 1, k / 3 - 1, &next))
                continue;
            ratio = (float)(next.filled - box->filled) /
                    (greedy_area(&next) - greedy_area(box));
            if (ratio > best_ratio) {
                best_ratio = ratio;
                best = next;
            }
        }
        if (!(best_ratio > 0.0f) || (float)best.filled < min_fill * greedy_area(&best))
            return;
        *box = best;
    }
}

/* The mask of the cells that hold opaque texels. */
static terrimp_cover_desc greedy_grid(const terrimpi_cover *c, uint32_t cell, uint32_t *cells)
{
    terrimp_cover_desc g = c->desc;
    uint32_t y, word;
    g.mask = cells;
    g.width = (c->desc.width - 1u) / cell + 1u;
    g.height = (c->desc.height - 1u) / cell + 1u;
    memset(cells, 0, (size_t)g.height * TERRIMP_MASK_WORDS(g.width) * sizeof *cells);
    for (y = 0; y < c->desc.height; y++)
        for (word = 0; word < TERRIMP_MASK_WORDS(c->desc.width); word++) {
            uint32_t bits = greedy_word(&c->desc, y, word, 0, c->desc.width);
            uint32_t *row = cells + (size_t)(y / cell) * TERRIMP_MASK_WORDS(g.width);
            while (bits) {
                uint32_t x = (word * 32u + terrimpi_mask_next_bit(&bits)) / cell;
                row[x / 32u] |= 1u << x % 32u;
            }
        }
    return g;
}

/* Grows a box from a cell, empties its cells, and returns it in texels. */
static terrimp_rect greedy_take(const terrimpi_cover *c, const terrimp_cover_desc *g,
                                uint32_t *cells, uint32_t x, uint32_t y, uint32_t cell,
                                float min_fill)
{
    greedy_box b;
    b.x0 = x;
    b.y0 = y;
    b.x1 = x + 1u;
    b.y1 = y + 1u;
    b.filled = 1;
    greedy_grow(g, min_fill, &b);
    for (y = b.y0; y < b.y1; y++)
        for (x = b.x0; x < b.x1; x++)
            cells[(size_t)y * TERRIMP_MASK_WORDS(g->width) + x / 32u] &= ~(1u << x % 32u);
    return terrimpi_rect(b.x0 * cell, b.y0 * cell,
                         terrimpi_min_u32(b.x1 * cell, c->desc.width) - b.x0 * cell,
                         terrimpi_min_u32(b.y1 * cell, c->desc.height) - b.y0 * cell);
}

/* Returns how many rectangles it makes; those beyond the capacity are not written. */
static uint32_t cover_greedily(const terrimp_cover_desc *desc, uint32_t cell, float min_fill,
                               terrimp_rect *rects, uint32_t capacity)
{
    terrimpi_cover c;
    terrimp_cover_desc g;
    uint32_t made = 0, y, word;
    size_t bytes = terrimp_cover_scratch_bytes(desc, 1);
    void *scratch = malloc(bytes);
    uint32_t *cells = (uint32_t *)malloc((size_t)desc->height * TERRIMP_MASK_WORDS(desc->width) *
                                         sizeof *cells);
    if (!scratch || !cells || terrimpi_cover_begin(desc, scratch, 1, &c, &bytes) != TERRIMP_OK)
        exit(2);
    g = greedy_grid(&c, cell, cells);
    for (y = 0; y < g.height; y++)
        for (word = 0; word < TERRIMP_MASK_WORDS(g.width); word++) {
            uint32_t bits;
            while ((bits = greedy_word(&g, y, word, 0, g.width)) != 0) {
                uint32_t x = word * 32u + terrimpi_mask_next_bit(&bits);
                terrimp_rect r = greedy_take(&c, &g, cells, x, y, cell, min_fill);
                terrimpi_cover_tighten(&c, &r);
                if (made++ < capacity)
                    rects[made - 1u] = r;
            }
        }
    free(scratch);
    free(cells);
    return made;
}

#endif
