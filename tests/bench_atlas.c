/* Compares the live atlas with the thesis' pair of atlases, and with a pair that stb_rect_pack
   packs where its header is installed.

   Flights   Impostors as the thesis has them (every chunk) or as a quadtree has them (each node at
             most 256 pixels wide), seen from a circle over a made-up terrain. A picture is renewed
             when its view angle passes 5 degrees or its sharpness no longer suits, and its slot
             follows. All schemes have the same texture memory. For each the sharpness (texels per
             pixel) is raised until it can no longer hold every visible picture at full size in
             every frame; the table is of the last sharpness that it could hold throughout.
   Churn     Slots of random sizes are allocated; when one does not fit, others are freed until it
             does. How full the atlas is then, and the time of one allocation or freeing.

   Build:  make bench_atlas
   Use:    build/bench_atlas   (BENCH_FRAMES is the number of frames of a flight [900])
   Leaves: build/bench/atlas.md (what it prints), atlas.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "atlas_pair.h"
#include "bench_say.h"

#include "examples/host/tour.h"

#include <math.h>

#ifdef __has_include
#if __has_include(<stb/stb_rect_pack.h>)
#define STBRP_STATIC
#define STB_RECT_PACK_IMPLEMENTATION
#include <stb/stb_rect_pack.h>
#define HAVE_STB
#endif
#endif

enum { SIDE = 2049, CHUNK = 64, CHUNKS = (SIDE - 1) / CHUNK, LEVELS = 6 };
enum { MAX_NODES = CHUNKS * CHUNKS * 4 / 3 + 1, PAIR_SIDE = 2048, MARGIN = 2, LARGEST = 1020 };
#define FOREGROUND 400.0f /* [wu] closer terrain is no impostor */
#define MAX_ANGLE 0.0873f
#define NODE_PX 256.0f

static double now_us(void)
{
    return clock_cpu_ms() * 1e3;
}

/* ---- what a flight sees ---- */

typedef struct frame {
    float eye[3];
    uint32_t *nodes; /* visible impostors */
    uint32_t count;
} frame;

typedef struct recording {
    terrimp_box boxes[MAX_NODES];
    uint32_t level_first[LEVELS], node_count;
    float pixel_factor;
    frame *frames;
    uint32_t frame_count;
} recording;

static void *allocate(size_t bytes)
{
    return memset(need_memory(bytes), 0, bytes);
}

static void box_nodes(recording *r, const terrimp_heightfield *field)
{
    uint32_t level, x, z, node = 0;
    for (level = 0; level < LEVELS; level++) {
        uint32_t width = (uint32_t)CHUNK << level, side = (uint32_t)CHUNKS >> level;
        r->level_first[level] = node;
        for (z = 0; z < side; z++)
            for (x = 0; x < side; x++) {
                terrimp_box *box = &r->boxes[node++];
                terrimp_heightfield_bounds(field, x * width, z * width, width + 1u, width + 1u,
                                           &box->min[1], &box->max[1]);
                box->min[0] = (float)(x * width);
                box->min[2] = (float)(z * width);
                box->max[0] = box->min[0] + (float)width;
                box->max[2] = box->min[2] + (float)width;
            }
    }
    r->node_count = node;
}

/* Lists the impostors below one node: itself where it is small enough on the screen. */
static void see(const recording *r, frame *f, const terrimp_frustum *frustum, uint32_t level,
                uint32_t x, uint32_t z, uint32_t top_level)
{
    uint32_t side = (uint32_t)CHUNKS >> level, node = r->level_first[level] + z * side + x, k;
    const terrimp_box *box = &r->boxes[node];
    float distance = terrimp_box_distance(box, f->eye);
    if (terrimp_frustum_test(frustum, box, TERRIMP_PLANES_ALL) == TERRIMP_PLANES_OUTSIDE)
        return;
    if (level <= top_level && distance >= FOREGROUND &&
        (level == 0 || r->pixel_factor * (float)(CHUNK << level) / distance <= NODE_PX)) {
        f->nodes[f->count++] = node;
        return;
    }
    for (k = 0; level > 0 && k < 4; k++)
        see(r, f, frustum, level - 1u, 2u * x + k % 2u, 2u * z + k / 2u, top_level);
}

static void fly(recording *r, uint32_t top_level, uint32_t frame_count)
{
    const terrimp_box anywhere = {{0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, 1.0f}};
    tour_desc desc;
    tour path;
    uint32_t i;
    int k;
    memset(&desc, 0, sizeof desc);
    desc.size = SIDE;
    desc.seed = 1;
    desc.frames = frame_count;
    desc.width = 1280;
    desc.height = 1024;
    if (!tour_load(&path, &desc) || !tour_plan(&path))
        bench_stop("the flight", path.error);
    box_nodes(r, &path.field);
    r->frames = (frame *)allocate(frame_count * sizeof *r->frames);
    r->frame_count = frame_count;
    for (i = 0; i < frame_count; i++) {
        frame *f = &r->frames[i];
        terrimp_camera camera = tour_camera(&path, &anywhere, i);
        terrimp_frustum frustum;
        for (k = 0; k < 3; k++)
            f->eye[k] = camera.eye[k];
        camera.z_near = 1.0f;
        camera.z_far = 1e5f;
        terrimp_camera_pixel_factor(&camera, &r->pixel_factor);
        terrimp_camera_frustum(&camera, &frustum);
        f->nodes = (uint32_t *)allocate(MAX_NODES * sizeof *f->nodes);
        see(r, f, &frustum, LEVELS - 1, 0, 0, top_level);
        f->nodes = (uint32_t *)realloc(f->nodes, (f->count + 1u) * sizeof *f->nodes);
    }
    tour_close(&path);
}

static void forget(recording *r)
{
    uint32_t i;
    for (i = 0; i < r->frame_count; i++)
        free(r->frames[i].nodes);
    free(r->frames);
}

/* ---- pictures, whatever keeps them ---- */

typedef struct picture {
    uint32_t size[2];    /* of its slot; width 0: there is none */
    float eye[3];        /* where it was captured from */
    float sharpness;     /* texels for a unit at distance 1, when it was captured */
    uint32_t seen, made; /* frames */
    int queued;          /* for renewal, in this frame */
    uint32_t slot;       /* of the live atlas */
} picture;

typedef struct figures {
    double texels;  /* of all pictures, mean of the frames */
    double visible; /* of the visible ones */
    double most;    /* of these, in the fullest frame */
    double captures;
    uint32_t lacking; /* pictures that could not be held as they should be */
} figures;

typedef struct replay {
    const recording *flown;
    const frame *now;
    uint32_t number;       /* of the frame */
    float texels_per_px;
    picture *pictures;     /* [node_count] */
    uint32_t *queue;       /* nodes whose picture has to be renewed */
    uint32_t queue_count;
    figures sum;
} replay;

static void size_of(const replay *p, uint32_t node, uint32_t size[2])
{
    terrimp_capture capture;
    size[0] = size[1] = 0;
    if (terrimp_capture_fit(&p->flown->boxes[node], p->now->eye, &capture) != TERRIMP_OK ||
        terrimp_impostor_size(&capture, p->flown->pixel_factor, p->texels_per_px, 8, LARGEST, size,
                              NULL) != TERRIMP_OK)
        bench_stop("the flight", "an impostor has no size");
    size[0] += 2u * MARGIN;
    size[1] += 2u * MARGIN;
}

static float sharpness_of(const replay *p, uint32_t node)
{
    return p->texels_per_px / terrimp_box_distance(&p->flown->boxes[node], p->now->eye);
}

/* Whether a node needs a new picture: the criteria of terrimp's view, without the parallax. */
static int expired(const replay *p, uint32_t node)
{
    const picture *is = &p->pictures[node];
    float angle, wanted = sharpness_of(p, node);
    if (is->size[0] == 0)
        return 1;
    terrimp_view_angle(&p->flown->boxes[node], is->eye, p->now->eye, &angle);
    return angle > MAX_ANGLE || wanted > 1.25f * is->sharpness || is->sharpness > 2.5f * wanted;
}

static void enqueue(replay *p, uint32_t node)
{
    if (p->pictures[node].queued)
        return;
    p->pictures[node].queued = 1;
    p->queue[p->queue_count++] = node;
}

static void enqueue_expired(replay *p)
{
    uint32_t i;
    p->queue_count = 0;
    for (i = 0; i < p->now->count; i++) {
        p->pictures[p->now->nodes[i]].seen = p->number;
        p->pictures[p->now->nodes[i]].queued = 0;
    }
    for (i = 0; i < p->now->count; i++)
        if (expired(p, p->now->nodes[i]))
            enqueue(p, p->now->nodes[i]);
}

static void capture(replay *p, uint32_t node, const uint32_t size[2])
{
    picture *to = &p->pictures[node];
    to->size[0] = size[0];
    to->size[1] = size[1];
    memcpy(to->eye, p->now->eye, sizeof to->eye);
    to->sharpness = sharpness_of(p, node);
    to->made = p->number;
    p->sum.captures += 1.0;
}

/* Whether a slot can take a picture of a size: 90 % of it in either side, and not far too large. */
static int suits(const uint32_t slot[2], const uint32_t size[2], uint32_t most_percent)
{
    int k;
    for (k = 0; k < 2; k++)
        if (slot[k] * 10u < size[k] * 9u || slot[k] * 100u > size[k] * most_percent)
            return 0;
    return slot[0] > 0;
}

/* ---- the live atlas ---- */

typedef struct live_scheme {
    terrimp_live_atlas atlas;
    void *memory;
    float *costs;      /* [max_slots] */
    uint32_t *owners;  /* [max_slots] nodes */
} live_scheme;

static void open_live(live_scheme *s, uint32_t width, uint32_t height, uint32_t max_slots)
{
    terrimp_live_atlas_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.width = width;
    desc.height = height;
    desc.max_slots = max_slots;
    s->memory = allocate(terrimp_live_atlas_bytes(&desc));
    s->costs = (float *)allocate(max_slots * sizeof *s->costs);
    s->owners = (uint32_t *)allocate(max_slots * sizeof *s->owners);
    terrimp_live_atlas_init(&s->atlas, &desc, s->memory, terrimp_live_atlas_bytes(&desc));
}

static void close_live(live_scheme *s)
{
    free(s->memory);
    free(s->costs);
    free(s->owners);
}

/* What a picture is worth: nothing when it has not been seen for long; when it is visible, the
   texels to be made again, the fewer the sooner it expires anyway. One made in this frame stays. */
static float worth(const replay *p, uint32_t node)
{
    const picture *is = &p->pictures[node];
    float texels = (float)is->size[0] * (float)is->size[1], angle;
    if (is->made == p->number)
        return -1.0f;
    if (is->seen < p->number)
        return 0.1f * texels / (float)(p->number - is->seen);
    terrimp_view_angle(&p->flown->boxes[node], is->eye, p->now->eye, &angle);
    return texels * (1.1f - terrimpi_min(angle / MAX_ANGLE, 1.0f));
}

/* Frees the slot that costs least; returns it, or max_slots when none may go. */
static uint32_t free_cheapest(live_scheme *s)
{
    uint32_t i, slot = s->atlas.desc.max_slots;
    for (i = 0; i < s->atlas.slot_end; i++)
        if (s->atlas.slots[i].width > 0 && s->costs[i] >= 0.0f &&
            (slot == s->atlas.desc.max_slots || s->costs[i] < s->costs[slot]))
            slot = i;
    if (slot < s->atlas.desc.max_slots)
        terrimp_live_atlas_free(&s->atlas, slot);
    return slot;
}

/* Allocates; makes room first by freeing what is cheapest, as views free the oldest. Visible
   pictures that have to go join the queue. */
static int alloc_live(replay *p, live_scheme *s, const uint32_t size[2], uint32_t *slot)
{
    uint32_t i, freed;
    if (terrimp_live_atlas_alloc(&s->atlas, size[0], size[1], slot) == TERRIMP_OK)
        return 1;
    for (i = 0; i < s->atlas.slot_end; i++)
        s->costs[i] = worth(p, s->owners[i]);
    do {
        freed = free_cheapest(s);
        if (freed == s->atlas.desc.max_slots)
            return 0;
        p->pictures[s->owners[freed]].size[0] = 0;
        if (p->pictures[s->owners[freed]].seen == p->number)
            enqueue(p, s->owners[freed]);
    } while (terrimp_live_atlas_alloc(&s->atlas, size[0], size[1], slot) != TERRIMP_OK);
    return 1;
}

/* Brings the largest picture of the queue, from `first` on, to its place. */
static void largest_first(replay *p, uint32_t first, uint32_t size[2])
{
    uint32_t i, best = first, next[2], swap = p->queue[first];
    size_of(p, swap, size);
    for (i = first + 1u; i < p->queue_count; i++) {
        size_of(p, p->queue[i], next);
        if (next[0] * next[1] > size[0] * size[1]) {
            best = i;
            memcpy(size, next, sizeof next);
        }
    }
    p->queue[first] = p->queue[best];
    p->queue[best] = swap;
}

static void renew_live(replay *p, void *scheme)
{
    live_scheme *s = (live_scheme *)scheme;
    uint32_t i, size[2];
    for (i = 0; i < p->queue_count; i++) {
        picture *to;
        largest_first(p, i, size);
        to = &p->pictures[p->queue[i]];
        if (suits(to->size, size, 110)) {
            capture(p, p->queue[i], to->size);
            continue;
        }
        if (to->size[0] > 0)
            terrimp_live_atlas_free(&s->atlas, to->slot);
        to->size[0] = 0;
        if (!alloc_live(p, s, size, &to->slot)) {
            p->sum.lacking++;
            continue;
        }
        s->owners[to->slot] = p->queue[i];
        capture(p, p->queue[i], size);
    }
}

/* ---- the pair: as the thesis uses it, packed by its own FFDH or by stb_rect_pack ---- */

typedef struct pair_scheme {
    atlas_pair pair;
    pair_shelf *shelves;
    pair_slot *slots; /* [node_count] */
    terrimp_rect *sizes;
    uint32_t *order;  /* [2 * node_count] */
    float scale;
    int use_stb;
#ifdef HAVE_STB
    stbrp_context context[2];
    stbrp_node *columns[2];
    stbrp_rect *rects;
#endif
} pair_scheme;

static void open_pair(pair_scheme *s, uint32_t count, int use_stb)
{
    memset(s, 0, sizeof *s);
    s->shelves = (pair_shelf *)allocate(2u * count * sizeof *s->shelves);
    s->slots = (pair_slot *)allocate(count * sizeof *s->slots);
    s->sizes = (terrimp_rect *)allocate(count * sizeof *s->sizes);
    s->order = (uint32_t *)allocate(2u * count * sizeof *s->order);
    s->scale = 1.0f;
    s->use_stb = use_stb;
    pair_init(&s->pair, PAIR_SIDE, PAIR_SIDE, s->shelves, count);
#ifdef HAVE_STB
    s->columns[0] = (stbrp_node *)allocate(PAIR_SIDE * sizeof(stbrp_node));
    s->columns[1] = (stbrp_node *)allocate(PAIR_SIDE * sizeof(stbrp_node));
    s->rects = (stbrp_rect *)allocate(count * sizeof *s->rects);
    stbrp_init_target(&s->context[0], PAIR_SIDE, PAIR_SIDE, s->columns[0], PAIR_SIDE);
    stbrp_init_target(&s->context[1], PAIR_SIDE, PAIR_SIDE, s->columns[1], PAIR_SIDE);
#endif
}

static void close_pair(pair_scheme *s)
{
    free(s->shelves);
    free(s->slots);
    free(s->sizes);
    free(s->order);
#ifdef HAVE_STB
    free(s->columns[0]);
    free(s->columns[1]);
    free(s->rects);
#endif
}

#ifdef HAVE_STB
static terrimp_rect from_stb(const stbrp_rect *in)
{
    terrimp_rect rect;
    rect.x = (uint32_t)in->x;
    rect.y = (uint32_t)in->y;
    rect.width = (uint32_t)in->w;
    rect.height = (uint32_t)in->h;
    return rect;
}

/* What pair_repack does, by stb_rect_pack. */
static void repack_stb(pair_scheme *s, uint32_t count)
{
    uint32_t i, n, outdated = 1u - s->pair.newest;
    s->scale = 1.0f;
    for (;;) {
        for (i = n = 0; i < count; i++) {
            s->slots[i].assigned[outdated] = s->slots[i].filled[outdated] = 0;
            if (s->sizes[i].width == 0)
                continue;
            s->rects[n].id = (int)i;
            s->rects[n].w = (stbrp_coord)((float)s->sizes[i].width * s->scale);
            s->rects[n++].h = (stbrp_coord)((float)s->sizes[i].height * s->scale);
        }
        stbrp_init_target(&s->context[outdated], PAIR_SIDE, PAIR_SIDE, s->columns[outdated],
                          PAIR_SIDE);
        if (stbrp_pack_rects(&s->context[outdated], s->rects, (int)n))
            break;
        s->scale *= 0.94f;
    }
    for (i = 0; i < n; i++) {
        pair_slot *slot = &s->slots[s->rects[i].id];
        slot->rect[outdated] = from_stb(&s->rects[i]);
        slot->assigned[outdated] = 1;
    }
    s->pair.newest = outdated;
}

static int assign_stb(pair_scheme *s, pair_slot *slot, const uint32_t size[2])
{
    stbrp_rect rect;
    memset(&rect, 0, sizeof rect);
    rect.w = (stbrp_coord)size[0];
    rect.h = (stbrp_coord)size[1];
    if (!stbrp_pack_rects(&s->context[s->pair.newest], &rect, 1))
        return 0;
    slot->rect[s->pair.newest] = from_stb(&rect);
    slot->assigned[s->pair.newest] = 1;
    slot->filled[s->pair.newest] = 0;
    return 1;
}
#endif

/* Packs the outdated atlas for what is visible; pictures that only it held are lost. */
static void repack_pair(replay *p, pair_scheme *s)
{
    uint32_t i, count = p->flown->node_count;
    for (i = 0; i < count; i++) {
        uint32_t size[2] = {0, 0};
        if (p->pictures[i].seen == p->number)
            size_of(p, i, size);
        s->sizes[i].width = size[0];
        s->sizes[i].height = size[1];
    }
#ifdef HAVE_STB
    if (s->use_stb)
        repack_stb(s, count);
    else
#endif
        (void)pair_repack(&s->pair, s->slots, s->sizes, count, s->order, &s->scale);
    for (i = 0; i < count; i++)
        if (pair_picture(&s->pair, &s->slots[i]) < 0)
            p->pictures[i].size[0] = 0;
    enqueue_expired(p);
}

static int assign_pair(replay *p, pair_scheme *s)
{
    uint32_t i, k;
    for (i = 0; i < p->queue_count; i++) {
        pair_slot *slot = &s->slots[p->queue[i]];
        uint32_t size[2], has[2];
        size_of(p, p->queue[i], size);
        for (k = 0; k < 2; k++)
            size[k] = (uint32_t)((float)size[k] * s->scale);
        has[0] = slot->rect[s->pair.newest].width;
        has[1] = slot->rect[s->pair.newest].height;
        if (slot->assigned[s->pair.newest] && suits(has, size, 200))
            continue;
#ifdef HAVE_STB
        if (s->use_stb) {
            if (!assign_stb(s, slot, size))
                return 0;
            continue;
        }
#endif
        if (!pair_assign(&s->pair, slot, size[0], size[1]))
            return 0;
    }
    return 1;
}

static void renew_pair(replay *p, void *scheme)
{
    pair_scheme *s = (pair_scheme *)scheme;
    uint32_t i;
    int complete = 1, fits;
    for (i = 0; i < p->now->count; i++)
        if (pair_picture(&s->pair, &s->slots[p->now->nodes[i]]) == 1 - (int)s->pair.newest)
            complete = 0;
    if (p->queue_count == 0)
        return;
    if (complete)
        repack_pair(p, s);
    fits = assign_pair(p, s);
    if (!fits) {
        repack_pair(p, s);
        fits = assign_pair(p, s);
    }
    p->sum.lacking += fits ? s->scale < 1.0f : p->queue_count;
    for (i = 0; fits && i < p->queue_count; i++) {
        pair_slot *slot = &s->slots[p->queue[i]];
        uint32_t size[2];
        pair_fill(&s->pair, slot);
        size[0] = slot->rect[s->pair.newest].width;
        size[1] = slot->rect[s->pair.newest].height;
        capture(p, p->queue[i], size);
    }
}

/* ---- replays ---- */

typedef void (*renew_function)(replay *p, void *scheme);

/* Flies once and returns what was held; stops where something is lacking. */
static figures run(const recording *flown, float texels_per_px, renew_function renew, void *scheme)
{
    replay p;
    uint32_t i, k;
    double frames = (double)flown->frame_count;
    memset(&p, 0, sizeof p);
    p.flown = flown;
    p.texels_per_px = texels_per_px;
    p.pictures = (picture *)allocate(flown->node_count * sizeof *p.pictures);
    p.queue = (uint32_t *)allocate(flown->node_count * sizeof *p.queue);
    for (i = 0; i < flown->frame_count && p.sum.lacking == 0; i++) {
        double visible = 0.0;
        p.now = &flown->frames[i];
        p.number = i + 1u;
        enqueue_expired(&p);
        renew(&p, scheme);
        for (k = 0; k < flown->node_count; k++) {
            double texels = (double)p.pictures[k].size[0] * (double)p.pictures[k].size[1];
            p.sum.texels += texels;
            visible += p.pictures[k].seen == p.number ? texels : 0.0;
        }
        p.sum.visible += visible;
        p.sum.most = visible > p.sum.most ? visible : p.sum.most;
    }
    free(p.pictures);
    free(p.queue);
    p.sum.texels /= frames;
    p.sum.visible /= frames;
    p.sum.captures /= frames;
    return p.sum;
}

enum { LIVE, PAIR, PAIR_STB };

static figures run_scheme(const recording *flown, float texels_per_px, int scheme)
{
    figures result;
    if (scheme == LIVE) {
        live_scheme live;
        open_live(&live, 2 * PAIR_SIDE, PAIR_SIDE, flown->node_count);
        result = run(flown, texels_per_px, renew_live, &live);
        close_live(&live);
    } else {
        pair_scheme pair;
        open_pair(&pair, flown->node_count, scheme == PAIR_STB);
        result = run(flown, texels_per_px, renew_pair, &pair);
        close_pair(&pair);
    }
    return result;
}

/* The last sharpness, within 2 %, at which a flight lacks nothing. */
static figures sharpest(const recording *flown, int scheme, float *texels_per_px)
{
    figures best;
    float low = 0.1f, high = 8.0f;
    memset(&best, 0, sizeof best);
    *texels_per_px = low;
    while (high > 1.02f * low) {
        float middle = sqrtf(low * high);
        figures next = run_scheme(flown, middle, scheme);
        if (next.lacking) {
            high = middle;
        } else {
            low = *texels_per_px = middle;
            best = next;
        }
    }
    return best;
}

static void print_flight(const char *name, float texels_per_px, const figures *f, double thesis)
{
    const double percent = 100.0 / (2.0 * PAIR_SIDE * PAIR_SIDE);
    say("| %s | %.2f | %.1f %% | %.1f %% | %.1f %% | %.2f | %.2f |\n", name,
           (double)texels_per_px, percent * f->visible, percent * f->most, percent * f->texels,
           f->captures, f->visible / thesis);
}

static void compare_on_flight(const char *name, const recording *flown)
{
    double visible = 0.0;
    float sharpness, thesis_sharpness;
    figures thesis, f;
    uint32_t i;
    for (i = 0; i < flown->frame_count; i++)
        visible += (double)flown->frames[i].count / (double)flown->frame_count;
    say("\n%s: %u frames, %.0f visible impostors in the mean, %u x %u texels\n\n", name,
           flown->frame_count, visible, 2u * PAIR_SIDE, (unsigned)PAIR_SIDE);
    say("| atlas | texels per px | visible texels, mean | most | all texels, mean | captures a "
           "frame | against the thesis |\n|---|--:|--:|--:|--:|--:|--:|\n");
    thesis = sharpest(flown, PAIR, &thesis_sharpness);
    print_flight("two in turn, FFDH (thesis)", thesis_sharpness, &thesis, thesis.visible);
#ifdef HAVE_STB
    f = sharpest(flown, PAIR_STB, &sharpness);
    print_flight("two in turn, stb_rect_pack", sharpness, &f, thesis.visible);
#endif
    f = run_scheme(flown, thesis_sharpness, LIVE);
    print_flight("live, as sharp as the thesis'", thesis_sharpness, &f, thesis.visible);
    f = sharpest(flown, LIVE, &sharpness);
    print_flight("live", sharpness, &f, thesis.visible);
}

/* ---- packing at once ---- */

typedef struct packing {
    double full, us; /* sums over frames: texels over area used, time */
    uint32_t frames;
} packing;

static void add_packing(packing *p, double texels, double top, double us)
{
    p->full += texels / (PAIR_SIDE * top);
    p->us += us;
    p->frames++;
}

static void print_packing(const char *name, const packing *p)
{
    say("| %s | %.1f %% | %.0f |\n", name, 100.0 * p->full / (double)p->frames,
           p->us / (double)p->frames);
}

/* The slots of all that is visible, into an empty atlas as high as they need, in every tenth frame.
   (The live atlas does not keep low: it has no part in this.) */
static void compare_packing(const recording *flown)
{
    static terrimp_rect rects[MAX_NODES];
    static uint32_t order[2 * MAX_NODES];
    packing ffdh;
#ifdef HAVE_STB
    packing stb;
    static stbrp_rect stb_rects[MAX_NODES];
    static stbrp_node columns[PAIR_SIDE];
    memset(&stb, 0, sizeof stb);
#endif
    uint32_t i, k;
    replay p;
    memset(&ffdh, 0, sizeof ffdh);
    memset(&p, 0, sizeof p);
    p.flown = flown;
    p.texels_per_px = 1.5f;
    for (i = 0; i < flown->frame_count; i += 10) {
        uint32_t count = flown->frames[i].count, top = 0;
        double texels = 0.0, start;
        p.now = &flown->frames[i];
        for (k = 0; k < count; k++) {
            uint32_t size[2];
            size_of(&p, p.now->nodes[k], size);
            rects[k].width = size[0];
            rects[k].height = size[1];
            texels += (double)size[0] * (double)size[1];
        }
        start = now_us();
        terrimp_pack_ffdh(PAIR_SIDE, 65536, rects, count, order, NULL);
        start = now_us() - start;
        for (k = 0; k < count; k++)
            top = rects[k].y + rects[k].height > top ? rects[k].y + rects[k].height : top;
        add_packing(&ffdh, texels, (double)top, start);
#ifdef HAVE_STB
        {
            stbrp_context context;
            top = 0;
            for (k = 0; k < count; k++) {
                stb_rects[k].id = (int)k;
                stb_rects[k].w = (stbrp_coord)rects[k].width;
                stb_rects[k].h = (stbrp_coord)rects[k].height;
            }
            start = now_us();
            stbrp_init_target(&context, PAIR_SIDE, 65536, columns, PAIR_SIDE);
            stbrp_pack_rects(&context, stb_rects, (int)count);
            start = now_us() - start;
            for (k = 0; k < count; k++)
            {
                uint32_t end = (uint32_t)(stb_rects[k].y + stb_rects[k].h);
                top = end > top ? end : top;
            }
            add_packing(&stb, texels, (double)top, start);
        }
#endif
    }
    say("\nPacking at once what a frame of this flight shows\n\n");
    say("| packer | full | us |\n|---|--:|--:|\n");
    print_packing("FFDH", &ffdh);
#ifdef HAVE_STB
    print_packing("stb_rect_pack", &stb);
#endif
}

/* ---- churn ---- */

static uint32_t random_state;

/* Uniform in [0, 1): the same numbers on every machine (Marsaglia's xorshift). */
static float random_unit(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return (float)(random_state >> 8) * (1.0f / 16777216.0f);
}

typedef struct churn {
    live_scheme live;
    uint32_t smallest, largest;
    uint32_t *held; /* handles */
    uint32_t held_count;
    double alloc_us, free_us, evict_us;
    uint32_t allocs, frees, evicts, failures;
} churn;

/* As many small slots as large ones, on a logarithmic scale; heights 0.4 to 1 of the widths. */
static int churn_alloc(churn *c)
{
    float ratio = (float)c->largest / (float)c->smallest;
    uint32_t width = (uint32_t)((float)c->smallest * powf(ratio, random_unit())), slot, i, k;
    uint32_t height = (uint32_t)((float)width * (0.4f + 0.6f * random_unit()));
    double start = now_us();
    int fits = terrimp_live_atlas_alloc(&c->live.atlas, width, height, &slot) == TERRIMP_OK;
    c->alloc_us += now_us() - start;
    c->allocs++;
    c->failures += !fits;
    if (!fits && c->live.costs) {
        start = now_us();
        do {
            (void)free_cheapest(&c->live);
        } while (terrimp_live_atlas_alloc(&c->live.atlas, width, height, &slot) != TERRIMP_OK);
        c->evict_us += now_us() - start;
        c->evicts++;
        for (i = k = 0; i < c->held_count; i++)
            if (c->held[i] != slot && c->live.atlas.slots[c->held[i]].width > 0)
                c->held[k++] = c->held[i];
        c->held_count = k;
        fits = 1;
    }
    if (fits) {
        c->held[c->held_count++] = slot;
        if (c->live.costs)
            c->live.costs[slot] = (float)(width * height) * (0.5f + 0.5f * random_unit());
    }
    return fits;
}

static void churn_free(churn *c)
{
    uint32_t i = (uint32_t)(random_unit() * (float)c->held_count);
    double start = now_us();
    terrimp_live_atlas_free(&c->live.atlas, c->held[i]);
    c->free_us += now_us() - start;
    c->frees++;
    c->held[i] = c->held[--c->held_count];
}

/* Slots come until the load is reached, then go in random order; with a load of 0 the
   cheapest go instead. */
static void churn_at(uint32_t smallest, uint32_t largest, float load)
{
    const double area = (double)PAIR_SIDE * PAIR_SIDE;
    enum { SLOTS = 8192, STEPS = 6000 };
    double full = 0.0, slots = 0.0;
    uint32_t i;
    churn c;
    memset(&c, 0, sizeof c);
    open_live(&c.live, PAIR_SIDE, PAIR_SIDE, SLOTS);
    c.smallest = smallest;
    c.largest = largest;
    c.held = (uint32_t *)allocate(SLOTS * sizeof *c.held);
    if (load > 0.0f) {
        free(c.live.costs);
        c.live.costs = NULL;
    }
    random_state = 2463534242u;
    for (i = 0; i < STEPS; i++) {
        double used = (double)c.live.atlas.texels_used / area;
        if (load > 0.0f && used >= (double)load)
            churn_free(&c);
        else if (!churn_alloc(&c) && c.held_count > 0)
            churn_free(&c);
        if (i == STEPS / 3) {
            c.alloc_us = c.free_us = c.evict_us = 0.0;
            c.allocs = c.frees = c.evicts = c.failures = 0;
        }
        if (i >= STEPS / 3) {
            full += (double)c.live.atlas.texels_used / area / (STEPS - STEPS / 3);
            slots += (double)c.live.atlas.slot_count / (STEPS - STEPS / 3);
        }
    }
    say("| %u to %u | ", smallest, largest);
    if (load > 0.0f)
        say("%.0f %% | %.1f %% | ", 100.0 * (double)load, 100.0 * full);
    else
        say("cheapest | %.1f %% | ", 100.0 * full);
    say("%.0f | %.1f %% | %.1f | %.1f | ", slots, 100.0 * c.failures / (double)c.allocs,
           c.alloc_us / (double)c.allocs, c.free_us / (double)(c.frees ? c.frees : 1u));
    if (c.evicts)
        say("%.0f |\n", c.evict_us / (double)c.evicts);
    else
        say("- |\n");
    free(c.held);
    close_live(&c.live);
}

static void compare_churn(void)
{
    static const uint32_t smallest[] = {20, 20, 100}, largest[] = {100, 300, 500};
    static const float loads[] = {0.6f, 0.7f, 0.8f, 0.9f, 0.0f};
    uint32_t i, k;
    say("\nSlots of random sizes in an atlas of %u x %u texels, freed at random above the "
           "load;\n'cheapest': where one does not fit, what is cheapest goes until it does\n\n",
           (unsigned)PAIR_SIDE, (unsigned)PAIR_SIDE);
    say("| widths | load | full, mean | slots | fit nowhere | alloc us | free us | make room us |\n"
           "|---|--:|--:|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < 3; i++)
        for (k = 0; k < 5; k++)
            churn_at(smallest[i], largest[i], loads[k]);
}

int main(void)
{
    static recording flown;
    uint32_t frames = (uint32_t)bench_frames(900);
    say_open("atlas", 1);
    say_machine(NULL);
    fly(&flown, 0, frames);
    compare_on_flight("Impostors of one chunk each, as in the thesis", &flown);
    compare_packing(&flown);
    forget(&flown);
    fly(&flown, LEVELS - 1, frames);
    compare_on_flight("Impostors of a quadtree", &flown);
    forget(&flown);
    compare_churn();
    say_close();
    return 0;
}
