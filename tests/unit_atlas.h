/* Laws of the atlas room: shelves, first-fit decreasing height, the pair of atlases. */
#ifndef UNIT_ATLAS_H
#define UNIT_ATLAS_H

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

static void random_items(terrimp_pack_item *items, uint32_t count, uint32_t width, uint32_t height)
{
    uint32_t i;
    memset(items, UNTOUCHED, count * sizeof *items);
    for (i = 0; i < count; i++) {
        items[i].rect.width = random_range(1, width);
        items[i].rect.height = random_range(1, height);
    }
}

static void packed_rectangles_keep_apart_and_inside(void)
{
    static terrimp_pack_item items[ATLAS_ITEMS];
    static terrimp_shelf rows[ATLAS_ITEMS];
    static uint32_t order[ATLAS_ITEMS];
    int i, some_left = 0, all_fit = 0;
    for (i = 0; i < 300; i++) {
        terrimp_shelves shelves;
        uint32_t width = random_range(1, 700), height = random_range(1, 700);
        uint32_t padding = random_range(0, 4), count = random_range(0, ATLAS_ITEMS), k, j;
        uint32_t placed = 12345, flagged = 0;
        terrimp_result result;
        random_items(items, count, random_range(1, width), random_range(1, height));
        CHECK(terrimp_shelves_init(&shelves, width, height, padding, rows, ATLAS_ITEMS) ==
              TERRIMP_OK);
        result = terrimp_pack_ffdh(&shelves, items, count, order, &placed);
        for (k = 0; k < count; k++) {
            if (!(items[k].flags & TERRIMP_PACK_PLACED))
                continue;
            flagged++;
            CHECK(rect_within(&items[k].rect, width, height));
            for (j = 0; j < k; j++)
                CHECK(!(items[j].flags & TERRIMP_PACK_PLACED) ||
                      !rects_overlap(&items[k].rect, &items[j].rect, padding));
        }
        CHECK(placed == flagged);
        CHECK(result == (placed == count ? TERRIMP_OK : TERRIMP_E_CAPACITY));
        CHECK(terrimp_pack_ffdh(&shelves, items, 0, NULL, NULL) == TERRIMP_OK);
        some_left += placed < count;
        all_fit += placed == count;
    }
    CHECK(some_left > 30 && all_fit > 30);
}

/* A rectangle that is larger than the atlas is reduced to fit it, with its shape, and said so. */
static void oversize_rectangles_are_scaled_with_their_shape(void)
{
    int i;
    for (i = 0; i < 3000; i++) {
        terrimp_shelf row;
        terrimp_shelves shelves;
        terrimp_pack_item item;
        uint32_t order, placed, width = random_range(1, 2000), height = random_range(1, 2000);
        uint32_t w = random_range(1, 5000), h = random_range(1, 5000);
        double scale = fmin(1.0, fmin((double)width / (double)w, (double)height / (double)h));
        if (i % 50 == 0)
            w = 0xffffffffu - random_range(0, 3);
        if (i % 50 == 1)
            h = 0xffffffffu;
        scale = fmin(1.0, fmin((double)width / (double)w, (double)height / (double)h));
        item.rect.width = w;
        item.rect.height = h;
        CHECK(terrimp_shelves_init(&shelves, width, height, 0, &row, 1) == TERRIMP_OK);
        CHECK(terrimp_pack_ffdh(&shelves, &item, 1, &order, &placed) == TERRIMP_OK);
        CHECK(placed == 1 && (item.flags & TERRIMP_PACK_PLACED));
        CHECK(((item.flags & TERRIMP_PACK_SCALED) != 0) == (scale < 1.0));
        CHECK(rect_within(&item.rect, width, height));
        CHECK(fabs((double)item.rect.width - (double)w * scale) <= 1.001);
        CHECK(fabs((double)item.rect.height - (double)h * scale) <= 1.001);
        CHECK(scale < 1.0 || (item.rect.width == w && item.rect.height == h));
    }
}

/* The algorithm as its paper words it, one rectangle at a time: what the library has to match. */
static void packing_is_first_fit_from_the_tallest(void)
{
    static terrimp_pack_item items[ATLAS_ITEMS];
    static terrimp_shelf rows[ATLAS_ITEMS];
    static uint32_t order[ATLAS_ITEMS];
    int i;
    for (i = 0; i < 200; i++) {
        terrimp_shelves shelves;
        uint32_t y[ATLAS_ITEMS], high[ATLAS_ITEMS], used[ATLAS_ITEMS], count, k, s;
        uint32_t shelf_count = 0, top = 0, width = random_range(20, 300);
        unsigned char seen[ATLAS_ITEMS] = {0};
        count = random_range(1, ATLAS_ITEMS);
        random_items(items, count, width, i % 2 ? 5 : 200); /* few heights: many ties */
        CHECK(terrimp_shelves_init(&shelves, width, 1000, 1, rows, ATLAS_ITEMS) == TERRIMP_OK);
        (void)terrimp_pack_ffdh(&shelves, items, count, order, NULL);
        for (k = 0; k < count; k++) {
            const terrimp_rect *r;
            CHECK(order[k] < count && !seen[order[k]]);
            seen[order[k]] = 1;
            r = &items[order[k]].rect;
            if (k > 0) {
                const terrimp_rect *before = &items[order[k - 1u]].rect;
                CHECK(before->height > r->height ||
                      (before->height == r->height &&
                       (before->width > r->width ||
                        (before->width == r->width && order[k - 1u] < order[k]))));
            }
            for (s = 0; s < shelf_count; s++)
                if (r->height <= high[s] && used[s] + r->width <= width)
                    break;
            if (s == shelf_count && top + r->height <= 1000u) {
                y[s] = top;
                high[s] = r->height;
                used[s] = 0;
                top += r->height + 1u;
                shelf_count++;
            }
            CHECK(((items[order[k]].flags & TERRIMP_PACK_PLACED) != 0) == (s < shelf_count));
            if (s == shelf_count)
                continue;
            CHECK(r->x == used[s] && r->y == y[s]);
            used[s] += r->width + 1u;
        }
    }
}

static void packing_is_deterministic(void)
{
    static terrimp_pack_item items[ATLAS_ITEMS], again[ATLAS_ITEMS];
    static terrimp_shelf rows[ATLAS_ITEMS];
    static uint32_t order[ATLAS_ITEMS];
    int i;
    for (i = 0; i < 50; i++) {
        terrimp_shelves shelves;
        random_items(items, ATLAS_ITEMS, 40, 6);
        memcpy(again, items, sizeof items);
        memset(rows, i, sizeof rows);
        (void)terrimp_shelves_init(&shelves, 300, 300, 0, rows, ATLAS_ITEMS);
        (void)terrimp_pack_ffdh(&shelves, items, ATLAS_ITEMS, order, NULL);
        memset(order, i, sizeof order);
        memset(rows, ~i, sizeof rows);
        (void)terrimp_shelves_init(&shelves, 300, 300, 0, rows, ATLAS_ITEMS);
        (void)terrimp_pack_ffdh(&shelves, again, ATLAS_ITEMS, order, NULL);
        CHECK(memcmp(items, again, sizeof items) == 0);
    }
}

/* Cuts a rectangle at random into pieces of `items`, so that the best packing is known. */
static void cut(const terrimp_rect *whole, terrimp_pack_item *items, uint32_t *count, int depth)
{
    terrimp_rect a = *whole, b = *whole;
    int across = whole->height < 2u || (whole->width >= 2u && random_range(0, 1));
    if (depth == 0 || *count >= ATLAS_ITEMS - 16u || (whole->width < 2u && whole->height < 2u)) {
        items[(*count)++].rect = *whole;
        return;
    }
    if (across) {
        a.width = random_range(1, whole->width - 1u);
        b.width = whole->width - a.width;
    } else {
        a.height = random_range(1, whole->height - 1u);
        b.height = whole->height - a.height;
    }
    cut(&a, items, count, depth - 1);
    cut(&b, items, count, depth - 1);
}

/* Coffman, Garey, Johnson and Tarjan 1980: at most 1.7 OPT + the tallest. OPT is known where the
   pieces come from one rectangle; for any pieces, twice their area bounds the height instead. */
static void packing_height_keeps_its_bound(void)
{
    static terrimp_pack_item items[ATLAS_ITEMS];
    static terrimp_shelf rows[ATLAS_ITEMS];
    static uint32_t order[ATLAS_ITEMS];
    int i;
    for (i = 0; i < 400; i++) {
        terrimp_shelves shelves;
        terrimp_rect whole;
        uint32_t count = 0, k, tallest = 0;
        double area = 0.0, bound;
        memset(&whole, 0, sizeof whole);
        whole.width = random_range(10, 500);
        whole.height = random_range(10, 500);
        if (i % 2)
            cut(&whole, items, &count, (int)random_range(1, 7));
        else
            random_items(items, count = ATLAS_ITEMS, whole.width, whole.height);
        for (k = 0; k < count; k++) {
            tallest = items[k].rect.height > tallest ? items[k].rect.height : tallest;
            area += (double)items[k].rect.width * (double)items[k].rect.height;
        }
        CHECK(terrimp_shelves_init(&shelves, whole.width, 65536, 0, rows, ATLAS_ITEMS) ==
              TERRIMP_OK);
        if (terrimp_pack_ffdh(&shelves, items, count, order, NULL) != TERRIMP_OK)
            continue; /* random ones can be too many */
        bound = (i % 2 ? 1.7 : 2.0) * area / (double)whole.width + (double)tallest;
        CHECK((double)shelves.top <= bound);
    }
}

static void shelves_take_rectangles_one_by_one(void)
{
    static terrimp_shelf rows[64];
    static terrimp_rect taken[2000];
    int i;
    for (i = 0; i < 60; i++) {
        terrimp_shelves shelves, before;
        uint32_t width = random_range(10, 300), height = random_range(10, 300), count = 0, k;
        uint32_t padding = random_range(0, 3), tries;
        memset(&shelves, 0, sizeof shelves); /* compared as bytes below, gaps included */
        CHECK(terrimp_shelves_init(&shelves, width, height, padding, rows, 64) == TERRIMP_OK);
        CHECK(shelves.count == 0 && shelves.top == 0);
        for (tries = 0; tries < 200; tries++) {
            terrimp_rect rect;
            terrimp_result result;
            rect.x = rect.y = 777;
            rect.width = random_range(1, width / 3u + 2u);
            rect.height = random_range(1, height / 4u + 2u);
            before = shelves;
            result = terrimp_shelves_insert(&shelves, &rect);
            if (result != TERRIMP_OK) {
                CHECK(result == TERRIMP_E_CAPACITY);
                CHECK(rect.x == 777 && rect.y == 777);
                CHECK(memcmp(&before, &shelves, sizeof shelves) == 0);
                continue;
            }
            CHECK(rect_within(&rect, width, height));
            for (k = 0; k < count; k++)
                CHECK(!rects_overlap(&rect, &taken[k], padding));
            taken[count++] = rect;
        }
        CHECK(count > 5);
    }
}

/* ---- the pair of atlases ---- */

enum { PAIR_SIDE = 96, PAIR_SLOTS = 24 };

/* What the texels of both atlases show: the number of the picture painted there last. */
typedef struct painted_pair {
    terrimp_atlas_pair pair;
    terrimp_shelf rows[2 * PAIR_SLOTS];
    terrimp_pair_slot slots[PAIR_SLOTS];
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
    CHECK(terrimp_pair_fill(&p->pair, &p->slots[slot]) == TERRIMP_OK);
    CHECK(terrimp_pair_picture(&p->pair, &p->slots[slot]) == (int)atlas);
    CHECK(!p->slots[slot].assigned[1u - atlas]); /* it has moved */
    CHECK(!p->slots[slot].filled[1u - atlas]);
}

/* Every picture that the pair says is there still has all its texels. */
static void check_pictures(const painted_pair *p)
{
    uint32_t slot, x, y;
    for (slot = 0; slot < PAIR_SLOTS; slot++) {
        int atlas = terrimp_pair_picture(&p->pair, &p->slots[slot]);
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
    terrimp_pack_item items[PAIR_SLOTS];
    uint32_t order[PAIR_SLOTS], slot, outdated = 1u - p->pair.newest, repacks = p->pair.repacks;
    uint32_t wanted[PAIR_SLOTS][2];
    for (slot = 0; slot < PAIR_SLOTS; slot++) {
        wanted[slot][0] = items[slot].rect.width = random_range(0, most);
        wanted[slot][1] = items[slot].rect.height = random_range(0, most);
    }
    CHECK(terrimp_pair_repack(&p->pair, p->slots, items, PAIR_SLOTS, order, scale) == TERRIMP_OK);
    CHECK(p->pair.newest == outdated && p->pair.repacks == repacks + 1u);
    for (slot = 0; slot < PAIR_SLOTS; slot++) {
        const terrimp_pair_slot *s = &p->slots[slot];
        int empty = wanted[slot][0] == 0 || wanted[slot][1] == 0;
        CHECK(s->assigned[p->pair.newest] == !empty);
        CHECK(!s->filled[p->pair.newest]);
        if (empty)
            continue;
        CHECK(memcmp(&s->rect[p->pair.newest], &items[slot].rect, sizeof(terrimp_rect)) == 0);
        CHECK(fabs((double)items[slot].rect.width -
                   fmax(1.0, (double)wanted[slot][0] * (double)*scale)) <= 1.001);
        CHECK(fabs((double)items[slot].rect.height -
                   fmax(1.0, (double)wanted[slot][1] * (double)*scale)) <= 1.001);
        CHECK(*scale < 1.0f || (items[slot].rect.width == wanted[slot][0] &&
                                items[slot].rect.height == wanted[slot][1]));
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
        CHECK(terrimp_pair_init(&p.pair, PAIR_SIDE, PAIR_SIDE, p.rows, PAIR_SLOTS) == TERRIMP_OK);
        for (frame = 0; frame < 120; frame++) {
            uint32_t n, slot;
            int complete = 1;
            float scale = 0.0f;
            for (slot = 0; slot < PAIR_SLOTS; slot++)
                complete = complete && terrimp_pair_picture(&p.pair, &p.slots[slot]) !=
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
                    if (terrimp_pair_assign(&p.pair, &p.slots[slot], width, height) == TERRIMP_OK)
                        CHECK(!p.slots[slot].filled[p.pair.newest]); /* a new place is empty */
                }
                if (!p.slots[slot].assigned[p.pair.newest]) {
                    CHECK(terrimp_pair_fill(&p.pair, &p.slots[slot]) == TERRIMP_E_STATE);
                    continue;
                }
                if (random_range(0, 9) == 0)
                    continue; /* a host that drops a frame */
                paint(&p, slot);
                moves++;
                check_pictures(&p);
            }
        }
    }
    CHECK(moves > 2000 && repacks > 100);
}

/* Sizes that do not fit are reduced, all alike, and by no more than a step too much. First fit has
   its anomalies: now and then larger rectangles fit where smaller ones do not. */
static void pair_reduces_what_does_not_fit(void)
{
    int i, reduced = 0, anomalies = 0;
    for (i = 0; i < 200; i++) {
        static painted_pair p;
        terrimp_pack_item items[PAIR_SLOTS], larger[PAIR_SLOTS];
        uint32_t order[PAIR_SLOTS], k, j, most = random_range(5, 90), placed;
        float scale = 0.0f;
        terrimp_shelves shelves;
        terrimp_shelf rows[PAIR_SLOTS];
        memset(&p, 0, sizeof p);
        CHECK(terrimp_pair_init(&p.pair, PAIR_SIDE, PAIR_SIDE, p.rows, PAIR_SLOTS) == TERRIMP_OK);
        random_items(items, PAIR_SLOTS, most, most);
        memcpy(larger, items, sizeof items);
        CHECK(terrimp_pair_repack(&p.pair, p.slots, items, PAIR_SLOTS, order, &scale) ==
              TERRIMP_OK);
        for (k = 0; k < PAIR_SLOTS; k++)
            for (j = 0; j < k; j++)
                CHECK(!rects_overlap(&items[k].rect, &items[j].rect, 0));
        CHECK(scale > 0.0f && scale <= 1.0f);
        if (scale < 1.0f) {
            reduced++;
            for (k = 0; k < PAIR_SLOTS; k++) {
                uint32_t w = (uint32_t)((float)larger[k].rect.width * scale * 1.07f) + 1u;
                uint32_t h = (uint32_t)((float)larger[k].rect.height * scale * 1.07f) + 1u;
                larger[k].rect.width = w;
                larger[k].rect.height = h;
                CHECK(items[k].flags & TERRIMP_PACK_SCALED);
            }
            (void)terrimp_shelves_init(&shelves, PAIR_SIDE, PAIR_SIDE, 0, rows, PAIR_SLOTS);
            anomalies += terrimp_pack_ffdh(&shelves, larger, PAIR_SLOTS, order, &placed) ==
                         TERRIMP_OK;
        }
    }
    CHECK(reduced > 50 && anomalies * 10 < reduced);
}

/* Where not even a texel each fits, slots are left without a place, the other atlas as it was. */
static void pair_reports_when_nothing_fits(void)
{
    terrimp_atlas_pair pair;
    terrimp_pair_slot slots[5];
    terrimp_pack_item items[5];
    terrimp_shelf rows[10];
    uint32_t order[5], k;
    memset(slots, 0, sizeof slots);
    CHECK(terrimp_pair_init(&pair, 2, 2, rows, 5) == TERRIMP_OK);
    CHECK(terrimp_pair_assign(&pair, &slots[0], 2, 2) == TERRIMP_OK);
    CHECK(terrimp_pair_fill(&pair, &slots[0]) == TERRIMP_OK);
    for (k = 0; k < 5; k++)
        items[k].rect.width = items[k].rect.height = 1;
    CHECK(terrimp_pair_repack(&pair, slots, items, 5, order, NULL) == TERRIMP_E_CAPACITY);
    for (k = 0; k < 5; k++)
        CHECK(!slots[k].assigned[pair.newest]);
    CHECK(terrimp_pair_picture(&pair, &slots[0]) == 1 - (int)pair.newest);
    CHECK(terrimp_pair_repack(&pair, slots, items, 4, order, NULL) == TERRIMP_OK);
}

static void atlas_tests(void)
{
    RUN(packed_rectangles_keep_apart_and_inside);
    RUN(oversize_rectangles_are_scaled_with_their_shape);
    RUN(packing_is_first_fit_from_the_tallest);
    RUN(packing_is_deterministic);
    RUN(packing_height_keeps_its_bound);
    RUN(shelves_take_rectangles_one_by_one);
    RUN(pair_never_overwrites_a_picture_in_use);
    RUN(pair_reduces_what_does_not_fit);
    RUN(pair_reports_when_nothing_fits);
}

#endif
