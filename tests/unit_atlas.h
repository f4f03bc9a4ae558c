/* Laws of the atlas room: first-fit decreasing height, the pair of atlases that tests and
   benchmarks make of it, the live atlas. */
#ifndef UNIT_ATLAS_H
#define UNIT_ATLAS_H

#include "atlas_pair.h"
#include "unit_oracle.h"

enum { ATLAS_ITEMS = 200 };

static int rects_overlap(const terrimp_rect *a, const terrimp_rect *b, uint32_t padding)
{
    return a->x < b->x + b->width + padding && b->x < a->x + a->width + padding &&
           a->y < b->y + b->height + padding && b->y < a->y + a->height + padding;
}

static int rect_within(const terrimp_rect *rect, uint32_t width, uint32_t height)
{
    return rect->x <= width && rect->width <= width - rect->x && rect->y <= height &&
           rect->height <= height - rect->y;
}

static void random_rects(terrimp_rect *rects, uint32_t count, uint32_t width, uint32_t height)
{
    uint32_t i;
    memset(rects, UNTOUCHED, count * sizeof *rects);
    for (i = 0; i < count; i++) {
        rects[i].width = random_range(1, width);
        rects[i].height = random_range(1, height);
    }
}

/* Rectangles keep apart and inside, and have the sizes that were asked for at one common scale. */
static void packed_rectangles_keep_apart_and_inside(void)
{
    static terrimp_rect rects[ATLAS_ITEMS], wanted[ATLAS_ITEMS];
    static uint32_t order[2 * ATLAS_ITEMS];
    int i, reduced = 0, whole = 0, empty = 0;
    for (i = 0; i < 300; i++) {
        uint32_t width = random_range(15, 700), height = random_range(15, 700);
        uint32_t count = random_range(0, ATLAS_ITEMS), k, j;
        uint32_t most = random_range(1, 8), widest = random_range(1, 2u * width / most + 1u);
        uint32_t tallest = random_range(1, height / most + 1u);
        float scale = 0.0f;
        random_rects(rects, count, widest, tallest);
        for (k = 0; k < count; k++)
            if (random_range(0, 9) == 0)
                *(random_range(0, 1) ? &rects[k].width : &rects[k].height) = 0;
        memcpy(wanted, rects, sizeof rects);
        CHECK(terrimp_pack_ffdh(width, height, rects, count, order, &scale) == TERRIMP_OK);
        CHECK(scale > 0.0f && scale <= 1.0f);
        for (k = 0; k < count; k++) {
            double w = (double)wanted[k].width * (double)scale;
            double h = (double)wanted[k].height * (double)scale;
            CHECK(fabs((double)rects[k].width - (w > 0.0 ? fmax(w, 1.0) : 0.0)) <= 1.001);
            CHECK(fabs((double)rects[k].height - (h > 0.0 ? fmax(h, 1.0) : 0.0)) <= 1.001);
            CHECK(scale < 1.0f || (rects[k].width == wanted[k].width &&
                                   rects[k].height == wanted[k].height));
            CHECK((rects[k].width > 0) == (wanted[k].width > 0));
            if (rects[k].width == 0 || rects[k].height == 0) {
                empty++;
                continue;
            }
            CHECK(rect_within(&rects[k], width, height));
            for (j = 0; j < k; j++)
                CHECK(rects[j].width == 0 || rects[j].height == 0 ||
                      !rects_overlap(&rects[k], &rects[j], 0));
        }
        reduced += scale < 1.0f;
        whole += scale == 1.0f;
    }
    CHECK(reduced > 30 && whole > 30 && empty > 1000);
    CHECK(terrimp_pack_ffdh(8, 8, NULL, 0, NULL, NULL) == TERRIMP_OK);
}

/* A rectangle that is larger than the atlas, however much, is reduced to fit it, with its shape, by
   no more than a step too much. */
static void oversize_rectangles_are_scaled_with_their_shape(void)
{
    int i;
    for (i = 0; i < 3000; i++) {
        terrimp_rect rect;
        uint32_t order[2], width = random_range(1, 2000), height = random_range(1, 2000);
        uint32_t w = random_range(1, 5000), h = random_range(1, 5000);
        double most;
        float scale = 0.0f;
        if (i % 50 == 0)
            w = 0xffffffffu - random_range(0, 3);
        if (i % 50 == 1)
            h = 0xffffffffu;
        /* a side below two texels counts as one */
        most = fmin((double)(width + (width < 2u)) / (double)w,
                    (double)(height + (height < 2u)) / (double)h);
        rect.width = w;
        rect.height = h;
        CHECK(terrimp_pack_ffdh(width, height, &rect, 1, order, &scale) == TERRIMP_OK);
        CHECK(rect_within(&rect, width, height) && rect.x == 0 && rect.y == 0);
        CHECK(fabs((double)rect.width - fmax((double)w * (double)scale, 1.0)) <= 1.001);
        CHECK(fabs((double)rect.height - fmax((double)h * (double)scale, 1.0)) <= 1.001);
        CHECK((w <= width && h <= height) == (scale == 1.0f));
        CHECK(scale == 1.0f || (double)scale >= 0.9399 * fmin(most, 1.0));
    }
}

/* The algorithm as its paper words it, one rectangle at a time: what the library has to match, at
   the scale that it chose. And it may choose a lower one only where a step less does not fit. */
static int matches_the_paper(const terrimp_rect *rects, const uint32_t *order, uint32_t count,
                             uint32_t width, uint32_t height, float scale, int places)
{
    static uint32_t y[ATLAS_ITEMS], high[ATLAS_ITEMS], used[ATLAS_ITEMS];
    uint32_t k, s, shelf_count = 0, top = 0;
    for (k = 0; k < count; k++) {
        const terrimp_rect *r = &rects[order[k]];
        uint32_t w = (uint32_t)((float)r->width * scale), h = (uint32_t)((float)r->height * scale);
        w = w < 1u ? 1u : w;
        h = h < 1u ? 1u : h;
        for (s = 0; s < shelf_count; s++)
            if (h <= high[s] && used[s] + w <= width)
                break;
        if (s == shelf_count) {
            if (top + h > height || w > width)
                return 0;
            y[s] = top;
            high[s] = h;
            used[s] = 0;
            top += h;
            shelf_count++;
        }
        if (places)
            CHECK(r->x == used[s] && r->y == y[s]);
        used[s] += w;
    }
    return 1;
}

static void packing_is_first_fit_from_the_tallest(void)
{
    static terrimp_rect rects[ATLAS_ITEMS], wanted[ATLAS_ITEMS];
    static uint32_t order[2 * ATLAS_ITEMS];
    int i, reduced = 0;
    for (i = 0; i < 200; i++) {
        uint32_t count = random_range(1, ATLAS_ITEMS), k, width = random_range(20, 300);
        unsigned char seen[ATLAS_ITEMS] = {0};
        float scale = 0.0f;
        random_rects(rects, count, width, i % 2 ? 5 : 200); /* few heights: many ties */
        memcpy(wanted, rects, sizeof rects);
        CHECK(terrimp_pack_ffdh(width, 1000, rects, count, order, &scale) == TERRIMP_OK);
        for (k = 0; k < count; k++) {
            const terrimp_rect *r, *before;
            CHECK(order[k] < count && !seen[order[k]]);
            seen[order[k]] = 1;
            r = &wanted[order[k]];
            before = &wanted[order[k > 0 ? k - 1u : 0]];
            CHECK(k == 0 || before->height > r->height ||
                  (before->height == r->height &&
                   (before->width > r->width ||
                    (before->width == r->width && order[k - 1u] < order[k]))));
        }
        CHECK(matches_the_paper(rects, order, count, width, 1000, 1.0f, 1));
        if (scale < 1.0f) {
            reduced++;
            CHECK(!matches_the_paper(wanted, order, count, width, 1000, 1.0f, 0));
            CHECK(!matches_the_paper(wanted, order, count, width, 1000, scale / 0.94f, 0));
        }
    }
    CHECK(reduced > 20);
}

static void packing_is_deterministic(void)
{
    static terrimp_rect rects[ATLAS_ITEMS], again[ATLAS_ITEMS];
    static uint32_t order[2 * ATLAS_ITEMS];
    int i;
    for (i = 0; i < 50; i++) {
        random_rects(rects, ATLAS_ITEMS, 40, 6);
        memcpy(again, rects, sizeof rects);
        (void)terrimp_pack_ffdh(300, 300, rects, ATLAS_ITEMS, order, NULL);
        memset(order, i, sizeof order);
        (void)terrimp_pack_ffdh(300, 300, again, ATLAS_ITEMS, order, NULL);
        CHECK(memcmp(rects, again, sizeof rects) == 0);
    }
}

/* Cuts a rectangle at random into pieces of `rects`, so that the best packing is known. */
static void cut(const terrimp_rect *whole, terrimp_rect *rects, uint32_t *count, int depth)
{
    terrimp_rect a = *whole, b = *whole;
    int across = whole->height < 2u || (whole->width >= 2u && random_range(0, 1));
    if (depth == 0 || *count >= ATLAS_ITEMS - 16u || (whole->width < 2u && whole->height < 2u)) {
        rects[(*count)++] = *whole;
        return;
    }
    if (across) {
        a.width = random_range(1, whole->width - 1u);
        b.width = whole->width - a.width;
    } else {
        a.height = random_range(1, whole->height - 1u);
        b.height = whole->height - a.height;
    }
    cut(&a, rects, count, depth - 1);
    cut(&b, rects, count, depth - 1);
}

/* Coffman, Garey, Johnson and Tarjan 1980: at most 1.7 OPT + the tallest. OPT is known where the
   pieces come from one rectangle; for any pieces, twice their area bounds the height instead. */
static void packing_height_keeps_its_bound(void)
{
    static terrimp_rect rects[ATLAS_ITEMS];
    static uint32_t order[2 * ATLAS_ITEMS];
    int i;
    for (i = 0; i < 400; i++) {
        terrimp_rect whole;
        uint32_t count = 0, k, tallest = 0, top = 0;
        double area = 0.0, bound;
        float scale = 0.0f;
        memset(&whole, 0, sizeof whole);
        whole.width = random_range(10, 500);
        whole.height = random_range(10, 500);
        if (i % 2)
            cut(&whole, rects, &count, (int)random_range(1, 7));
        else
            random_rects(rects, count = ATLAS_ITEMS, whole.width, whole.height);
        for (k = 0; k < count; k++) {
            tallest = rects[k].height > tallest ? rects[k].height : tallest;
            area += (double)rects[k].width * (double)rects[k].height;
        }
        CHECK(terrimp_pack_ffdh(whole.width, 65536, rects, count, order, &scale) == TERRIMP_OK);
        if (scale < 1.0f)
            continue; /* random ones can be too many */
        for (k = 0; k < count; k++)
            top = rects[k].y + rects[k].height > top ? rects[k].y + rects[k].height : top;
        bound = (i % 2 ? 1.7 : 2.0) * area / (double)whole.width + (double)tallest;
        CHECK((double)top <= bound);
    }
}

/* ---- the pair of atlases ---- */

enum { PAIR_SIDE = 96, PAIR_SLOTS = 24 };

/* What the texels of both atlases show: the number of the picture painted there last. */
typedef struct painted_pair {
    atlas_pair pair;
    pair_shelf rows[2 * PAIR_SLOTS];
    pair_slot slots[PAIR_SLOTS];
    uint32_t texel[2][PAIR_SIDE][PAIR_SIDE];
    uint32_t picture[PAIR_SLOTS]; /* number of the slot's latest picture; 0: none */
    uint32_t painted;
} painted_pair;

static void paint(painted_pair *p, uint32_t slot)
{
    uint32_t atlas = p->pair.newest, x, y;
    const terrimp_rect *rect = &p->slots[slot].rect[atlas];
    CHECK(rect_within(rect, PAIR_SIDE, PAIR_SIDE));
    p->picture[slot] = ++p->painted;
    for (y = rect->y; y < rect->y + rect->height; y++)
        for (x = rect->x; x < rect->x + rect->width; x++)
            p->texel[atlas][y][x] = p->painted;
    pair_fill(&p->pair, &p->slots[slot]);
    CHECK(pair_picture(&p->pair, &p->slots[slot]) == (int)atlas);
    CHECK(!p->slots[slot].assigned[1u - atlas]); /* it has moved */
    CHECK(!p->slots[slot].filled[1u - atlas]);
}

/* Every picture that the pair says is there still has all its texels. */
static void check_pictures(const painted_pair *p)
{
    uint32_t slot, x, y;
    for (slot = 0; slot < PAIR_SLOTS; slot++) {
        int atlas = pair_picture(&p->pair, &p->slots[slot]);
        const terrimp_rect *rect;
        int whole = 1;
        if (atlas < 0)
            continue;
        rect = &p->slots[slot].rect[atlas];
        for (y = rect->y; y < rect->y + rect->height; y++)
            for (x = rect->x; x < rect->x + rect->width; x++)
                whole = whole && p->texel[atlas][y][x] == p->picture[slot];
        CHECK(whole);
    }
}

/* Packs the outdated atlas for all slots, as the terrain does when every picture has moved. */
static void repack_all(painted_pair *p, uint32_t most, float *scale)
{
    terrimp_rect rects[PAIR_SLOTS];
    uint32_t order[2 * PAIR_SLOTS], slot, outdated = 1u - p->pair.newest;
    uint32_t repacks = p->pair.repacks;
    memset(rects, 0, sizeof rects);
    for (slot = 0; slot < PAIR_SLOTS; slot++) {
        rects[slot].width = random_range(0, most);
        rects[slot].height = random_range(0, most);
    }
    CHECK(pair_repack(&p->pair, p->slots, rects, PAIR_SLOTS, order, scale));
    CHECK(p->pair.newest == outdated && p->pair.repacks == repacks + 1u);
    for (slot = 0; slot < PAIR_SLOTS; slot++) {
        const pair_slot *s = &p->slots[slot];
        int empty = rects[slot].width == 0 || rects[slot].height == 0;
        CHECK(s->assigned[p->pair.newest] == !empty);
        CHECK(!s->filled[p->pair.newest]);
        CHECK(empty ||
              memcmp(&s->rect[p->pair.newest], &rects[slot], sizeof(terrimp_rect)) == 0);
    }
}

/* Random frames of the scheme: pictures expire, move to the newest atlas, are resized; when all
   have moved the outdated one is packed anew. */
static void pair_never_overwrites_a_picture_in_use(void)
{
    static painted_pair p;
    int run, frame, moves = 0, repacks = 0;
    for (run = 0; run < 12; run++) {
        memset(&p, 0, sizeof p);
        pair_init(&p.pair, PAIR_SIDE, PAIR_SIDE, p.rows, PAIR_SLOTS);
        for (frame = 0; frame < 120; frame++) {
            uint32_t n, slot;
            int complete = 1;
            float scale = 0.0f;
            for (slot = 0; slot < PAIR_SLOTS; slot++)
                complete = complete && pair_picture(&p.pair, &p.slots[slot]) !=
                                           1 - (int)p.pair.newest;
            if (complete || random_range(0, 20) == 0) { /* also before time, when it is full */
                repack_all(&p, run % 3 ? 18 : 60, &scale);
                repacks++;
            }
            check_pictures(&p);
            for (n = random_range(1, 6); n > 0; n--) {
                slot = random_range(0, PAIR_SLOTS - 1);
                if (!p.slots[slot].assigned[p.pair.newest] || random_range(0, 7) == 0) {
                    uint32_t width = random_range(1, 18), height = random_range(1, 18);
                    if (pair_assign(&p.pair, &p.slots[slot], width, height))
                        CHECK(!p.slots[slot].filled[p.pair.newest]); /* a new place is empty */
                }
                if (!p.slots[slot].assigned[p.pair.newest] || random_range(0, 9) == 0)
                    continue; /* full, or a host that drops a frame */
                paint(&p, slot);
                moves++;
                check_pictures(&p);
            }
        }
    }
    CHECK(moves > 2000 && repacks > 100);
}

/* Where not even a texel each fits, slots are left without a place, the other atlas as it was. */
static void pair_reports_when_nothing_fits(void)
{
    atlas_pair pair;
    pair_slot slots[5];
    terrimp_rect rects[5];
    pair_shelf rows[10];
    uint32_t order[10], k;
    float scale = 7.0f;
    memset(slots, 0, sizeof slots);
    pair_init(&pair, 2, 2, rows, 5);
    CHECK(pair_assign(&pair, &slots[0], 2, 2));
    pair_fill(&pair, &slots[0]);
    for (k = 0; k < 5; k++)
        rects[k].width = rects[k].height = 1;
    CHECK(!pair_repack(&pair, slots, rects, 5, order, &scale) && scale == 7.0f);
    for (k = 0; k < 5; k++)
        CHECK(!slots[k].assigned[pair.newest] && rects[k].width == 1 && rects[k].height == 1);
    CHECK(pair_picture(&pair, &slots[0]) == 1 - (int)pair.newest);
    CHECK(pair_repack(&pair, slots, rects, 4, order, &scale) && scale == 1.0f);
}

/* ---- the live atlas ---- */

enum { LIVE_SLOTS = 64 };

/* An atlas in a block that is exactly as large as it asks for, and what it should hold. */
typedef struct live_model {
    terrimp_live_atlas atlas;
    void *memory;
    terrimp_rect taken[LIVE_SLOTS]; /* by handle; width 0: unused */
    uint32_t count, failures;
} live_model;

static void live_open(live_model *m, uint32_t width, uint32_t height, uint32_t padding,
                      uint32_t max_slots)
{
    terrimp_live_atlas_desc desc;
    size_t bytes;
    memset(m, 0, sizeof *m);
    memset(&desc, 0, sizeof desc);
    desc.width = width;
    desc.height = height;
    desc.padding = padding;
    desc.max_slots = max_slots;
    bytes = terrimp_live_atlas_bytes(&desc);
    CHECK(bytes > 0);
    m->memory = malloc(bytes);
    memset(m->memory, UNTOUCHED, bytes);
    CHECK(terrimp_live_atlas_init(&m->atlas, &desc, m->memory, bytes) == TERRIMP_OK);
}

static void live_close(live_model *m)
{
    free(m->memory);
}

/* Whether some place of the atlas is free for a size: tries every corner that slots make. */
static int live_fits(const live_model *m, uint32_t width, uint32_t height)
{
    const terrimp_live_atlas_desc *d = &m->atlas.desc;
    uint32_t i, j, k;
    if (m->count == d->max_slots)
        return 0;
    for (i = 0; i <= d->max_slots; i++)
        for (j = 0; j <= d->max_slots; j++) {
            terrimp_rect rect;
            rect.x = i == d->max_slots ? 0 : m->taken[i].x + m->taken[i].width + d->padding;
            rect.y = j == d->max_slots ? 0 : m->taken[j].y + m->taken[j].height + d->padding;
            rect.width = width;
            rect.height = height;
            if ((i < d->max_slots && m->taken[i].width == 0) ||
                (j < d->max_slots && m->taken[j].width == 0) ||
                !rect_within(&rect, d->width, d->height))
                continue;
            for (k = 0; k < d->max_slots; k++)
                if (m->taken[k].width > 0 && rects_overlap(&rect, &m->taken[k], d->padding))
                    break;
            if (k == d->max_slots)
                return 1;
        }
    return 0;
}

/* Allocates and holds the outcome to the model. Returns the result. */
static terrimp_result live_alloc(live_model *m, uint32_t width, uint32_t height)
{
    const terrimp_live_atlas_desc *d = &m->atlas.desc;
    uint32_t slot = 0xabcdu, k;
    terrimp_rect rect;
    terrimp_result result = terrimp_live_atlas_alloc(&m->atlas, width, height, &slot);
    if (result != TERRIMP_OK) {
        CHECK(result == TERRIMP_E_CAPACITY && slot == 0xabcdu);
        m->failures++;
        return result;
    }
    CHECK(slot < d->max_slots && m->taken[slot].width == 0);
    rect = m->atlas.slots[slot];
    CHECK(rect.width == width && rect.height == height);
    CHECK(rect_within(&rect, d->width, d->height));
    for (k = 0; k < d->max_slots; k++)
        CHECK(m->taken[k].width == 0 || !rects_overlap(&rect, &m->taken[k], d->padding));
    m->taken[slot] = rect;
    m->count++;
    return TERRIMP_OK;
}

static void live_free(live_model *m, uint32_t slot)
{
    CHECK(terrimp_live_atlas_free(&m->atlas, slot) == TERRIMP_OK);
    m->taken[slot].width = 0;
    m->count--;
}

/* One in `odds` calls frees a slot at random, if there is one; the others allocate. */
static void live_churn(live_model *m, uint32_t odds, uint32_t most)
{
    uint32_t slot = random_range(0, m->atlas.desc.max_slots - 1u);
    if (random_range(1, odds) == 1) {
        if (m->taken[slot].width > 0)
            live_free(m, slot);
        return;
    }
    (void)live_alloc(m, random_range(1, most), random_range(1, most));
}

static void live_free_all(live_model *m)
{
    uint32_t k, first = random_range(0, m->atlas.desc.max_slots - 1u);
    for (k = 0; k < m->atlas.desc.max_slots; k++) {
        uint32_t slot = (first + k) % m->atlas.desc.max_slots;
        if (m->taken[slot].width > 0)
            live_free(m, slot);
    }
}

/* Slots never overlap nor leave the atlas; an allocation fails only where nothing fits; when all
   are freed, one slot may take the whole atlas again. */
static void live_slots_keep_apart_inside_and_find_all_room(void)
{
    int run, step, failed = 0;
    for (run = 0; run < 16; run++) {
        live_model m;
        uint32_t width = random_range(1, 200), height = random_range(1, 200);
        uint32_t most = random_range(1, 60), padding = run % 4 == 0 ? random_range(0, 30) : 1;
        live_open(&m, width, height, padding, random_range(1, LIVE_SLOTS));
        for (step = 0; step < 200; step++) {
            uint32_t w = random_range(1, most), h = random_range(1, most);
            int fits = live_fits(&m, w, h);
            CHECK((live_alloc(&m, w, h) == TERRIMP_OK) == fits);
            failed += !fits;
            live_churn(&m, 2, most);
        }
        live_free_all(&m);
        CHECK(m.atlas.slot_count == 0 && m.atlas.texels_used == 0);
        CHECK(live_alloc(&m, width, height) == TERRIMP_OK);
        CHECK(live_alloc(&m, 1, 1) == TERRIMP_E_CAPACITY);
        live_close(&m);
    }
    CHECK(failed > 300);
}

/* Whether a rectangle, padding included, is free and within the atlas. */
static int live_is_free(const live_model *m, const terrimp_rect *rect)
{
    uint32_t padding = m->atlas.desc.padding, k;
    if (!rect_within(rect, m->atlas.desc.width + padding, m->atlas.desc.height + padding))
        return 0;
    for (k = 0; k < m->atlas.desc.max_slots; k++) {
        terrimp_rect slot = m->taken[k];
        slot.width += padding;
        slot.height += padding;
        if (m->taken[k].width > 0 && rects_overlap(rect, &slot, 0))
            return 0;
    }
    return 1;
}

/* The holes are free, none can grow to any side, and none is there twice. */
static void live_holes_are_maximal(void)
{
    int run, step;
    for (run = 0; run < 6; run++) {
        live_model m;
        live_open(&m, random_range(20, 300), random_range(20, 300), random_range(0, 3), LIVE_SLOTS);
        for (step = 0; step < 150; step++) {
            uint32_t i, k, side;
            live_churn(&m, 2, 60);
            for (i = 0; i < m.atlas.free_count; i++) {
                const terrimp_rect *hole = &m.atlas.free_rects[i];
                CHECK(hole->width > 0 && hole->height > 0 && live_is_free(&m, hole));
                for (side = 0; side < 4; side++) {
                    terrimp_rect larger = *hole;
                    larger.x -= side == 0;
                    larger.y -= side == 1;
                    larger.width += side == 0 || side == 2;
                    larger.height += side == 1 || side == 3;
                    CHECK((side == 0 && hole->x == 0) || (side == 1 && hole->y == 0) ||
                          !live_is_free(&m, &larger));
                }
                for (k = 0; k < i; k++)
                    CHECK(memcmp(hole, &m.atlas.free_rects[k], sizeof *hole) != 0);
            }
        }
        live_close(&m);
    }
}

/* Texels beside a padded place that are not free. */
static uint32_t live_contact(const live_model *m, const terrimp_rect *place)
{
    uint32_t i, contact = 0, side;
    for (side = 0; side < 4; side++)
        for (i = 0; i < (side < 2 ? place->height : place->width); i++) {
            terrimp_rect texel = {0, 0, 1, 1};
            texel.x = place->x + (side == 0 ? 0xffffffffu : side == 1 ? place->width : i);
            texel.y = place->y + (side == 2 ? 0xffffffffu : side == 3 ? place->height : i);
            contact += !live_is_free(m, &texel);
        }
    return contact;
}

/* A slot goes into the smallest hole that takes it, to the corner where it touches most. */
static void live_slots_go_where_they_fit_best(void)
{
    int run, step, choices = 0;
    for (run = 0; run < 6; run++) {
        live_model m;
        live_open(&m, random_range(20, 200), random_range(20, 200), random_range(0, 3), LIVE_SLOTS);
        for (step = 0; step < 150; step++) {
            uint32_t padding = m.atlas.desc.padding, k, corner, slot, smallest = 0xffffffffu;
            terrimp_rect hole = {0, 0, 0, 0}, rect, place;
            uint32_t width = random_range(1, 30), height = random_range(1, 30), most = 0;
            live_model before;
            live_churn(&m, 2, 40);
            if (m.count == LIVE_SLOTS)
                live_free(&m, 0);
            for (k = 0; k < m.atlas.free_count; k++) {
                const terrimp_rect *h = &m.atlas.free_rects[k];
                if (h->width >= width + padding && h->height >= height + padding &&
                    h->width * h->height < smallest) {
                    smallest = h->width * h->height;
                    hole = *h;
                }
            }
            if (smallest == 0xffffffffu)
                continue;
            before = m;
            CHECK(terrimp_live_atlas_alloc(&m.atlas, width, height, &slot) == TERRIMP_OK);
            rect = m.atlas.slots[slot];
            m.taken[slot] = rect;
            m.count++;
            rect.width += padding;
            rect.height += padding;
            CHECK(rect.x == hole.x || rect.x + rect.width == hole.x + hole.width);
            CHECK(rect.y == hole.y || rect.y + rect.height == hole.y + hole.height);
            for (corner = 0; corner < 4; corner++) {
                place = rect;
                place.x = hole.x + (corner & 1u ? hole.width - rect.width : 0u);
                place.y = hole.y + (corner & 2u ? hole.height - rect.height : 0u);
                k = live_contact(&before, &place);
                choices += corner > 0 && k != most;
                most = k > most ? k : most;
            }
            CHECK(live_contact(&before, &rect) == most);
        }
        live_close(&m);
    }
    CHECK(choices > 200);
}

static void live_atlas_counts_what_is_there(void)
{
    int run, step;
    for (run = 0; run < 8; run++) {
        live_model m;
        live_open(&m, random_range(50, 300), random_range(50, 300), random_range(0, 2), LIVE_SLOTS);
        for (step = 0; step < 200; step++) {
            uint32_t k, texels = 0;
            live_churn(&m, 3, 50);
            for (k = 0; k < LIVE_SLOTS; k++) {
                CHECK(m.atlas.slots[k].width == m.taken[k].width);
                texels += m.taken[k].width * m.taken[k].height * (m.taken[k].width > 0);
            }
            CHECK(m.atlas.slot_count == m.count && m.atlas.texels_used == texels);
            CHECK(m.atlas.failures == m.failures);
        }
        live_close(&m);
    }
}

/* Where the memory for free rectangles is too small some room is overlooked, but slots still keep
   apart and the whole atlas comes back. */
static void live_atlas_survives_a_full_list_of_holes(void)
{
    int run, step;
    for (run = 0; run < 30; run++) {
        live_model m;
        live_open(&m, 150, 100, 1, LIVE_SLOTS);
        m.atlas.max_free = random_range(1, 12);
        memset(&m.atlas.free_rects[m.atlas.max_free], UNTOUCHED, sizeof(terrimp_rect));
        for (step = 0; step < 300; step++) {
            live_churn(&m, 2, 40);
            CHECK(m.atlas.free_count <= m.atlas.max_free);
            CHECK(is_untouched(&m.atlas.free_rects[m.atlas.max_free], sizeof(terrimp_rect)));
        }
        live_free_all(&m);
        CHECK(live_alloc(&m, 150, 100) == TERRIMP_OK);
        live_close(&m);
    }
}

/* How full the atlas stays when slots of random sizes come and, from the oldest on, go. */
static void live_atlas_stays_full(void)
{
    static const uint32_t smallest[] = {20, 20, 60, 100}, largest[] = {80, 300, 200, 500};
    static const double least[] = {0.84, 0.59, 0.63, 0.58}; /* 0.87, 0.64, 0.68, 0.62 seen */
    int run, step;
    for (run = 0; run < 4; run++) {
        enum { SLOTS = 1024, SIDE = 1024, STEPS = 1200 };
        static uint32_t since[SLOTS];
        terrimp_live_atlas_desc desc;
        terrimp_live_atlas atlas;
        double full = 0.0;
        void *memory;
        memset(&desc, 0, sizeof desc);
        desc.width = desc.height = SIDE;
        desc.max_slots = SLOTS;
        memory = malloc(terrimp_live_atlas_bytes(&desc));
        CHECK(terrimp_live_atlas_init(&atlas, &desc, memory, terrimp_live_atlas_bytes(&desc)) ==
              TERRIMP_OK);
        for (step = 0; step < STEPS; step++) {
            float ratio = (float)largest[run] / (float)smallest[run];
            uint32_t width = (uint32_t)((float)smallest[run] * powf(ratio, random_float(0, 1)));
            uint32_t height = (uint32_t)((float)width * random_float(0.4f, 1.0f)), slot = 0;
            while (terrimp_live_atlas_alloc(&atlas, width, height, &slot) != TERRIMP_OK) {
                uint32_t k, oldest = SLOTS;
                for (k = 0; k < atlas.slot_end; k++)
                    if (atlas.slots[k].width > 0 && (oldest == SLOTS || since[k] < since[oldest]))
                        oldest = k;
                CHECK(terrimp_live_atlas_free(&atlas, oldest) == TERRIMP_OK);
            }
            since[slot] = (uint32_t)step;
            full += step >= STEPS / 2 ? (double)atlas.texels_used / (SIDE * SIDE) : 0.0;
        }
        full /= STEPS / 2;
        CHECK(full > least[run]);
        free(memory);
    }
}

static void live_atlas_is_deterministic(void)
{
    int run, step;
    for (run = 0; run < 10; run++) {
        live_model a, b;
        uint32_t seed = random_bits();
        live_open(&a, 200, 150, 1, LIVE_SLOTS);
        live_open(&b, 200, 150, 1, LIVE_SLOTS);
        check_state = seed;
        for (step = 0; step < 400; step++)
            live_churn(&a, 2, 40);
        check_state = seed;
        for (step = 0; step < 400; step++)
            live_churn(&b, 2, 40);
        CHECK(memcmp(a.taken, b.taken, sizeof a.taken) == 0);
        live_close(&a);
        live_close(&b);
    }
}

/* Refused calls change nothing: neither the struct nor its memory. */
static void live_atlas_refuses_without_a_change(void)
{
    terrimp_live_atlas_desc desc, bad;
    terrimp_live_atlas atlas, before, unused;
    unsigned char *memory, *copy;
    uint32_t slot = 77u, first, k;
    size_t bytes;
    memset(&unused, 0, sizeof unused);
    memset(&desc, 0, sizeof desc);
    desc.width = 64;
    desc.height = 32;
    desc.max_slots = 5;
    bytes = terrimp_live_atlas_bytes(&desc);
    memory = (unsigned char *)calloc(bytes + 8u, 1); /* it is compared as a whole */
    copy = (unsigned char *)malloc(bytes);
    for (k = 0; k < 7; k++) {
        bad = desc;
        if (k == 0) bad.width = 0;
        if (k == 1) bad.width = 32769;
        if (k == 2) bad.height = 0;
        if (k == 3) bad.height = 0xffffffffu;
        if (k == 4) bad.padding = 1025;
        if (k == 5) bad.max_slots = 0;
        if (k == 6) bad.max_slots = 65537;
        CHECK(terrimp_live_atlas_bytes(&bad) == 0);
        memset(&atlas, UNTOUCHED, sizeof atlas);
        CHECK(terrimp_live_atlas_init(&atlas, &bad, memory, bytes) == TERRIMP_E_RANGE);
        CHECK(is_untouched(&atlas, sizeof atlas));
    }
    CHECK(terrimp_live_atlas_bytes(NULL) == 0);
    CHECK(terrimp_live_atlas_init(NULL, &desc, memory, bytes) == TERRIMP_E_NULL);
    CHECK(terrimp_live_atlas_init(&atlas, NULL, memory, bytes) == TERRIMP_E_NULL);
    CHECK(terrimp_live_atlas_init(&atlas, &desc, NULL, bytes) == TERRIMP_E_NULL);
    CHECK(terrimp_live_atlas_init(&atlas, &desc, memory + 4, bytes) == TERRIMP_E_ALIGN);
    CHECK(terrimp_live_atlas_init(&atlas, &desc, memory, bytes - 1u) == TERRIMP_E_MEMORY);
    CHECK(is_untouched(&atlas, sizeof atlas));

    CHECK(terrimp_live_atlas_init(&atlas, &desc, memory, bytes) == TERRIMP_OK);
    CHECK(terrimp_live_atlas_alloc(&atlas, 10, 10, &first) == TERRIMP_OK);
    CHECK(terrimp_live_atlas_alloc(&atlas, 10, 10, &slot) == TERRIMP_OK);
    CHECK(terrimp_live_atlas_free(&atlas, slot) == TERRIMP_OK);
    CHECK(terrimp_live_atlas_alloc(&atlas, 64, 33, &k) == TERRIMP_E_CAPACITY);
    before = atlas;
    memcpy(copy, memory, bytes);
    CHECK(terrimp_live_atlas_alloc(NULL, 1, 1, &k) == TERRIMP_E_NULL);
    CHECK(terrimp_live_atlas_alloc(&atlas, 1, 1, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_live_atlas_alloc(&atlas, 0, 1, &k) == TERRIMP_E_RANGE);
    CHECK(terrimp_live_atlas_alloc(&atlas, 1, 0, &k) == TERRIMP_E_RANGE);
    CHECK(terrimp_live_atlas_free(NULL, first) == TERRIMP_E_NULL);
    CHECK(terrimp_live_atlas_free(&atlas, slot) == TERRIMP_E_STATE); /* twice */
    CHECK(terrimp_live_atlas_free(&atlas, 4) == TERRIMP_E_STATE);    /* never in use */
    CHECK(terrimp_live_atlas_free(&atlas, 5) == TERRIMP_E_RANGE);
    CHECK(terrimp_live_atlas_free(&atlas, 0xffffffffu) == TERRIMP_E_RANGE);
    CHECK(terrimp_live_atlas_alloc(&unused, 1, 1, &k) == TERRIMP_E_STATE);
    CHECK(terrimp_live_atlas_free(&unused, 0) == TERRIMP_E_STATE);
    CHECK(memcmp(&before, &atlas, sizeof atlas) == 0 && memcmp(copy, memory, bytes) == 0);

    CHECK(terrimp_live_atlas_alloc(&atlas, 65, 1, &k) == TERRIMP_E_CAPACITY);
    CHECK(terrimp_live_atlas_alloc(&atlas, 1, 0xffffffffu, &k) == TERRIMP_E_CAPACITY);
    before.failures += 2;
    CHECK(memcmp(&before, &atlas, sizeof atlas) == 0 && memcmp(copy, memory, bytes) == 0);
    free(memory);
    free(copy);
}

static inline void atlas_tests(void)
{
    RUN(packed_rectangles_keep_apart_and_inside);
    RUN(oversize_rectangles_are_scaled_with_their_shape);
    RUN(packing_is_first_fit_from_the_tallest);
    RUN(packing_is_deterministic);
    RUN(packing_height_keeps_its_bound);
    RUN(pair_never_overwrites_a_picture_in_use);
    RUN(pair_reports_when_nothing_fits);
    RUN(live_slots_keep_apart_inside_and_find_all_room);
    RUN(live_holes_are_maximal);
    RUN(live_slots_go_where_they_fit_best);
    RUN(live_atlas_counts_what_is_there);
    RUN(live_atlas_survives_a_full_list_of_holes);
    RUN(live_atlas_stays_full);
    RUN(live_atlas_is_deterministic);
    RUN(live_atlas_refuses_without_a_change);
}

#endif
