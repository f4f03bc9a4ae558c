/* Laws of the placement: budgets, memory against the exact answer, what is shown where. */
#ifndef UNIT_PLACEMENT_H
#define UNIT_PLACEMENT_H

#include "unit_bad_input.h"

enum { PLACE_VIEWS = 12, PLACE_CANDIDATES = 14, PLACE_GAINS = PLACE_VIEWS * PLACE_CANDIDATES,
       PLACE_CLUSTERS = 7 };

#ifndef PLACE_SETS
#define PLACE_SETS 800 /* -DPLACE_SETS=n compares so many with the exact answer */
#endif

/* Four leaves in two groups under one root. */
static const uint32_t place_parents[PLACE_CLUSTERS] = {4, 4, 5, 5, 6, 6, 6};

typedef struct placing {
    terrimp_place_desc desc;
    terrimp_place_candidate candidates[PLACE_CANDIDATES];
    terrimp_place_gain gains[PLACE_GAINS];
    float costs[PLACE_VIEWS], left[PLACE_VIEWS];
    uint8_t shown[PLACE_GAINS];
    uint64_t scratch[4000];
} placing;

static placing place_room;

static void random_placing(placing *p)
{
    float leaf[PLACE_VIEWS][PLACE_CLUSTERS];
    uint32_t v, i;
    memset(p, 0, sizeof *p);
    p->desc.candidates = p->candidates;
    p->desc.gains = p->gains;
    p->desc.parents = place_parents;
    p->desc.costs = p->costs;
    p->desc.cluster_count = PLACE_CLUSTERS;
    p->desc.view_count = random_range(2, PLACE_VIEWS);
    p->desc.candidate_count = random_range(4, PLACE_CANDIDATES);
    p->desc.budget = random_float(8.0f, 16.0f);
    for (v = 0; v < p->desc.view_count; v++) {
        for (i = 0; i < 4; i++)
            leaf[v][i] = random_range(0, 4) ? random_float(1.0f, 10.0f) : 0.0f;
        leaf[v][4] = leaf[v][0] + leaf[v][1];
        leaf[v][5] = leaf[v][2] + leaf[v][3];
        leaf[v][6] = leaf[v][4] + leaf[v][5];
        p->costs[v] = leaf[v][6] + 2.0f;
    }
    for (i = 0; i < p->desc.candidate_count; i++) {
        terrimp_place_candidate *c = &p->candidates[i];
        uint32_t end;
        v = random_range(0, p->desc.view_count - 1);
        end = random_range(v, p->desc.view_count - 1);
        c->cluster = random_range(0, PLACE_CLUSTERS - 1);
        c->first_gain = p->desc.gain_count;
        c->gain_count = end - v + 1u;
        c->memory = random_float(0.3f, 1.3f) * (c->cluster > 3 ? 2.0f : 1.0f) *
                    (1.0f + 0.3f * (float)c->gain_count);
        for (; v <= end; v++) {
            terrimp_place_gain *g = &p->gains[p->desc.gain_count++];
            g->view = v;
            g->saved = leaf[v][c->cluster] - random_float(0.3f, 0.8f);
        }
    }
}

static terrimp_result run_placing(placing *p, terrimp_placement *out)
{
    CHECK(terrimp_place_scratch_bytes(&p->desc) <= sizeof p->scratch);
    return terrimp_place(&p->desc, p->scratch, sizeof p->scratch, p->shown, p->left, out);
}

static int place_inside(uint32_t cluster, uint32_t other)
{
    while (cluster != other && place_parents[cluster] != cluster)
        cluster = place_parents[cluster];
    return cluster == other;
}

/* What is shown is worth what is said, and shows no cluster twice. */
static void placements_are_what_they_say(void)
{
    placing *p = &place_room;
    int n;
    long unsolved = 0, chosen = 0;
    for (n = 0; n < 300; n++) {
        terrimp_placement out;
        uint32_t v, i, k, a, b, over = 0, problems = 0, count = 0;
        float memory = 0.0f;
        random_placing(p);
        CHECK(run_placing(p, &out) == TERRIMP_OK);
        for (v = 0; v < p->desc.view_count; v++) {
            float cost = p->costs[v];
            for (i = 0; i < p->desc.candidate_count; i++)
                for (a = 0; a < p->candidates[i].gain_count; a++) {
                    uint32_t g = p->candidates[i].first_gain + a;
                    if (!p->shown[g] || p->gains[g].view != v)
                        continue;
                    cost -= p->gains[g].saved;
                    for (k = 0; k < i; k++)
                        for (b = 0; b < p->candidates[k].gain_count; b++) {
                            uint32_t h = p->candidates[k].first_gain + b;
                            if (p->shown[h] && p->gains[h].view == v)
                                CHECK(!place_inside(p->candidates[i].cluster,
                                                    p->candidates[k].cluster) &&
                                      !place_inside(p->candidates[k].cluster,
                                                    p->candidates[i].cluster));
                        }
                }
            CHECK(fabsf(cost - p->left[v]) < 1e-3f);
            problems += p->costs[v] > p->desc.budget * 1.00001f;
            over += p->left[v] > p->desc.budget * 1.00001f;
        }
        for (i = 0; i < p->desc.candidate_count; i++) {
            const terrimp_place_candidate *c = &p->candidates[i];
            int made = memchr(p->shown + c->first_gain, 1, c->gain_count) != NULL;
            memory += made ? c->memory : 0.0f;
            count += (uint32_t)made;
        }
        CHECK(out.unsolved == over && out.problems == problems && out.chosen == count);
        CHECK(fabsf(out.memory - memory) < 1e-4f);
        unsolved += over > 0;
        chosen += (long)count;
    }
    CHECK(unsolved > 10 && unsolved < 250 && chosen > 300);
}

/* How many views a set of candidates leaves unsolved, with the most that it can take off each:
   every cluster by one picture, or by its parts. */
static uint32_t exact_unsolved(const placing *p, float saved[PLACE_VIEWS][PLACE_CANDIDATES],
                               uint32_t set)
{
    uint32_t v, i, over = 0;
    for (v = 0; v < p->desc.view_count; v++) {
        float best[PLACE_CLUSTERS] = {0, 0, 0, 0, 0, 0, 0}, halves;
        for (i = 0; i < p->desc.candidate_count; i++)
            if ((set >> i & 1u) && saved[v][i] > best[p->candidates[i].cluster])
                best[p->candidates[i].cluster] = saved[v][i];
        halves = fmaxf(best[4], best[0] + best[1]) + fmaxf(best[5], best[2] + best[3]);
        over += p->costs[v] - fmaxf(best[6], halves) > p->desc.budget * 1.00001f;
    }
    return over;
}

/* The least memory of all sets that leave as few views unsolved as all candidates together. */
static float exact_placing(const placing *p, uint32_t *unsolved)
{
    static float memory[1u << PLACE_CANDIDATES];
    float saved[PLACE_VIEWS][PLACE_CANDIDATES] = {{0}}, least = 1e30f;
    uint32_t set, i, k, all = (1u << p->desc.candidate_count) - 1u;
    for (i = 0; i < p->desc.candidate_count; i++)
        for (k = 0; k < p->candidates[i].gain_count; k++) {
            const terrimp_place_gain *g = &p->gains[p->candidates[i].first_gain + k];
            saved[g->view][i] = g->saved;
        }
    *unsolved = exact_unsolved(p, saved, all);
    for (set = 0; set <= all; set++) {
        for (i = 0; set && !(set >> i & 1u); i++) {}
        memory[set] = set ? memory[set & (set - 1u)] + p->candidates[i].memory : 0.0f;
        if (memory[set] < least && exact_unsolved(p, saved, set) == *unsolved)
            least = memory[set];
    }
    return least;
}

/* Against all sets of candidates: as many views are solved, with nearly as little memory. At last
   three that take 9 to 14 % more unless pairs of candidates are tried, found among 20,000. */
static void placements_take_little_more_memory_than_the_exact_answer(void)
{
    static const uint32_t hard[] = {1173298187u, 869780051u, 287242002u};
    placing *p = &place_room;
    float worst = 0.0f;
    int n, count = 0, more = 0;
    for (n = 0; n < PLACE_SETS + 3; n++) {
        terrimp_placement out;
        uint32_t fewest;
        float least;
        if (n >= PLACE_SETS)
            check_state = hard[n - PLACE_SETS];
        random_placing(p);
        CHECK(run_placing(p, &out) == TERRIMP_OK);
        least = exact_placing(p, &fewest);
        more += out.unsolved != fewest;
        if (fewest || !(least > 0.0f))
            continue; /* views above the budget are lowered as far as pictures can */
        CHECK(out.memory >= least * 0.9999f);
        worst = fmaxf(worst, out.memory / least);
        count++;
    }
    CHECK(count > PLACE_SETS / 4 && more == 0 && worst <= 1.05f);
    CHECK_NOTE("random sets", PLACE_SETS);
    CHECK_NOTE("that leave more views unsolved than the exact answer", more);
    CHECK_NOTE("most memory, of the exact answer's, where that solves all", (double)worst);
}

/* A better picture of what is shown already takes the place of the other one: the first of two
   views is solved by a small picture that is not good enough for the second. So many of these that
   attempts to do better would not find it. */
static void better_pictures_take_the_place_of_others(void)
{
    enum { COPIES = 10000 };
    static terrimp_place_candidate candidates[2 * COPIES];
    static terrimp_place_gain gains[3 * COPIES];
    static float costs[2 * COPIES], left[2 * COPIES];
    static uint8_t shown[3 * COPIES];
    terrimp_place_desc d;
    terrimp_placement out;
    uint32_t i, bad = 0;
    void *scratch;
    memset(&d, 0, sizeof d);
    d.candidates = candidates;
    d.gains = gains;
    d.parents = place_parents;
    d.costs = costs;
    d.cluster_count = PLACE_CLUSTERS;
    d.candidate_count = d.view_count = 2 * COPIES;
    d.gain_count = 3 * COPIES;
    d.budget = 10.0f;
    for (i = 0; i < 2 * COPIES; i++) {
        costs[i] = 15.0f;
        candidates[i].first_gain = i / 2 * 3 + i % 2 * 2;
        candidates[i].gain_count = 2 - i % 2;
        candidates[i].memory = i % 2 ? 3.0f : 1.0f;
    }
    for (i = 0; i < 3 * COPIES; i++) {
        gains[i].view = i / 3 * 2 + (i % 3 > 0);
        gains[i].saved = i % 3 == 1 ? 4.9f : 5.0f;
    }
    scratch = malloc(terrimp_place_scratch_bytes(&d));
    CHECK(scratch && terrimp_place(&d, scratch, terrimp_place_scratch_bytes(&d), shown, left,
                                   &out) == TERRIMP_OK);
    free(scratch);
    for (i = 0; i < 3 * COPIES; i++)
        bad += shown[i] != (i % 3 != 1);
    CHECK(bad == 0 && out.unsolved == 0);
}

static void placement_refuses(void)
{
    placing *p = &place_room;
    terrimp_placement out;
    uint32_t loop[PLACE_CLUSTERS] = {4, 0, 5, 5, 6, 6, 6};
    int i;
    CHECK(terrimp_place_scratch_bytes(NULL) == 0);
    random_placing(p);
    GIVES(TERRIMP_E_NULL, terrimp_place(NULL, p->scratch, sizeof p->scratch, p->shown, p->left,
                                        &out));
    GIVES(TERRIMP_E_NULL, terrimp_place(&p->desc, NULL, sizeof p->scratch, p->shown, p->left,
                                        &out));
    GIVES(TERRIMP_E_NULL, terrimp_place(&p->desc, p->scratch, 9, NULL, p->left, &out));
    GIVES(TERRIMP_E_NULL, terrimp_place(&p->desc, p->scratch, 9, p->shown, NULL, &out));
    GIVES(TERRIMP_E_NULL, terrimp_place(&p->desc, p->scratch, 9, p->shown, p->left, NULL));
    REFUSES(TERRIMP_E_MEMORY, out, terrimp_place(&p->desc, p->scratch, 9, p->shown, p->left, &out));
    REFUSES(TERRIMP_E_ALIGN, out, terrimp_place(&p->desc, (char *)p->scratch + 4, 9, p->shown,
                                                p->left, &out));
    for (i = 0; i < 14; i++) {
        terrimp_result wanted = i < 4 ? TERRIMP_E_NULL : i < 8 ? TERRIMP_E_NOT_FINITE
                                                               : TERRIMP_E_RANGE;
        random_placing(p);
        switch (i) {
        case 0: p->desc.candidates = NULL; break;
        case 1: p->desc.gains = NULL; break;
        case 2: p->desc.parents = NULL; break;
        case 3: p->desc.costs = NULL; break;
        case 4: p->desc.budget = not_finite(0); break;
        case 5: p->costs[1] = not_finite(1); break;
        case 6: p->gains[0].saved = not_finite(2); break;
        case 7: p->candidates[0].memory = not_finite(0); break;
        case 8: p->candidates[0].memory = 0.0f; break;
        case 9: p->gains[0].view = p->desc.view_count; break;
        case 10: p->candidates[1].cluster = PLACE_CLUSTERS; break;
        case 11: p->candidates[1].gain_count = p->desc.gain_count; break;
        case 12: p->candidates[1].first_gain = p->candidates[0].first_gain; break;
        default: p->desc.parents = loop; break;
        }
        REFUSES(wanted, out, terrimp_place(&p->desc, p->scratch, sizeof p->scratch, p->shown,
                                           p->left, &out));
    }
    random_placing(p);
    p->desc.candidate_count = p->desc.gain_count = 0;
    CHECK(run_placing(p, &out) == TERRIMP_OK && out.chosen == 0 && out.unsolved == out.problems);
}

/* ---- a prepared set for a terrain ---- */

#ifndef PREPARE_EYES
#define PREPARE_EYES 1000 /* -DPREPARE_EYES=n: so many random views, */
#define PREPARE_SIDE 129u /* ... of so many samples, over 5120 wu */
#endif

enum { PREPARE_CANDIDATES = 100000, PREPARE_GAINS = 2000000, PREPARE_VIEWS = 4096,
       PREPARE_NODES = 400 };

static terrimp_place_candidate prepare_candidates[PREPARE_CANDIDATES];
static terrimp_place_picture prepare_pictures[PREPARE_CANDIDATES];
static terrimp_place_gain prepare_gains[PREPARE_GAINS];
static uint32_t prepare_parents[PREPARE_NODES];
static float prepare_costs[PREPARE_VIEWS], prepare_left[PREPARE_VIEWS];
static uint8_t prepare_shown[PREPARE_GAINS];

/* Hills of 8 x 8 chunks or more, and eyes over the middle of them. */
static void prepare_begin(land *l, terrimp_place_terrain_desc *d, terrimp_place_set *s)
{
    land_prepare(l, PREPARE_SIDE, PREPARE_SIDE, TERRIMP_FORMAT_F32, LAND_HILLS);
    l->desc.chunk_quads = 16;
    l->desc.field.spacing_x = l->desc.field.spacing_z = 5120.0f / (PREPARE_SIDE - 1u);
    land_build(l);
    memset(d, 0, sizeof *d);
    d->terrain = l->terrain;
    d->eyes.min[0] = d->eyes.min[2] = 2400.0f;
    d->eyes.max[0] = d->eyes.max[2] = 2720.0f;
    d->eyes.min[1] = 250.0f;
    d->eyes.max[1] = 260.0f;
    d->cell_levels = 3;
    d->directions = 12;
    d->fov_rad = 1.0f;
    d->pixel_factor = 300.0f;
    d->max_angle_rad = 0.2f;
    d->tolerance_px = 2.0f;
    memset(s, 0, sizeof *s);
    s->candidates = prepare_candidates;
    s->pictures = prepare_pictures;
    s->gains = prepare_gains;
    s->parents = prepare_parents;
    s->costs = prepare_costs;
    s->candidate_capacity = PREPARE_CANDIDATES;
    s->gain_capacity = PREPARE_GAINS;
    s->cluster_capacity = PREPARE_NODES;
    s->view_capacity = PREPARE_VIEWS;
}

static void prepare_run(const terrimp_place_terrain_desc *d, terrimp_place_set *s)
{
    size_t bytes = terrimp_place_terrain_scratch_bytes(d);
    void *scratch = malloc(bytes);
    CHECK(bytes > 0 && scratch);
    CHECK(terrimp_place_terrain(d, scratch, bytes, s) == TERRIMP_OK);
    free(scratch);
}

static void prepare_place(const terrimp_place_set *s, float budget, terrimp_placement *out)
{
    terrimp_place_desc p;
    size_t bytes;
    void *scratch;
    memset(&p, 0, sizeof p);
    p.candidates = s->candidates;
    p.candidate_count = s->candidate_count;
    p.gains = s->gains;
    p.gain_count = s->gain_count;
    p.parents = s->parents;
    p.cluster_count = s->cluster_count;
    p.costs = s->costs;
    p.view_count = s->view_count;
    p.budget = budget;
    bytes = terrimp_place_scratch_bytes(&p);
    scratch = malloc(bytes);
    CHECK(scratch != NULL);
    CHECK(terrimp_place(&p, scratch, bytes, prepare_shown, prepare_left, out) == TERRIMP_OK);
    free(scratch);
}

/* Whether an eye sees one of 8 x 8 points of a box that is as wide as a direction's view allows. */
static int prepare_eye_sees(const float eye[3], float direction, float fov, const terrimp_box *box)
{
    int i;
    for (i = 0; i < 64; i++) {
        float x = box->min[0] + (box->max[0] - box->min[0]) * (float)(i % 8) / 7.0f - eye[0];
        float z = box->min[2] + (box->max[2] - box->min[2]) * (float)(i / 8) / 7.0f - eye[2];
        if (fabsf(remainderf(atan2f(z, x) - direction, 6.2831853f)) <= 0.5f * fov)
            return 1;
    }
    return 0;
}

/* What a frame costs: pictures that are shown in the view, ground as its cell draws it. */
static float prepare_frame(const terrimp_place_terrain_desc *d, const uint8_t *shown,
                           const uint8_t *whole, uint32_t node, const float eye[3], float direction)
{
    const terrimp_quadtree *tree = &d->terrain->tree;
    terrimp_node n = terrimpi_tree_node(tree, node), children[4];
    terrimp_mesh_info mesh;
    terrimp_box box;
    float cost = 0.0f;
    uint32_t count;
    CHECK(terrimp_terrain_get_box(d->terrain, node, &box) == TERRIMP_OK);
    CHECK(terrimp_terrain_get_mesh(d->terrain, node, &mesh) == TERRIMP_OK);
    if (!prepare_eye_sees(eye, direction, d->fov_rad, &box))
        return 0.0f;
    if (shown[node])
        return 40.0f + (float)(mesh.index_count / 3);
    if (whole[node])
        return 40.0f + 2.0f * 16.0f * 16.0f;
    for (count = terrimpi_tree_children(tree, &n, eye, children); count > 0; count--)
        cost += prepare_frame(d, shown, whole, children[count - 1].number, eye, direction);
    return cost;
}

/* Pictures serve their squares, and shafts behind them: what they show turns by no more than
   allowed, is off by no more pixels, and is seen from no closer by. */
static void check_prepared(const terrimp_place_terrain_desc *d, const terrimp_place_set *s)
{
    uint32_t i, k, behind = 0;
    float size = (d->eyes.max[0] - d->eyes.min[0]) / 8.0f;
    CHECK(s->view_count == 64 * 12 && s->cluster_count == (PREPARE_SIDE == 129u ? 85u : 341u));
    for (i = 0; i < s->candidate_count; i += 7) {
        const terrimp_place_picture *p = &s->pictures[i];
        const terrimp_place_candidate *c = &s->candidates[i];
        uint32_t side = 1u << p->level;
        terrimp_box box, square = d->eyes;
        terrimp_mesh_info mesh;
        CHECK(c->cluster == p->node && same_float(c->memory, (float)p->width * (float)p->height));
        CHECK(terrimp_terrain_get_box(d->terrain, p->node, &box) == TERRIMP_OK);
        CHECK(terrimp_terrain_get_mesh(d->terrain, p->node, &mesh) == TERRIMP_OK);
        square.min[0] += size * (float)(side * p->x);
        square.min[2] += size * (float)(side * p->z);
        square.max[0] = square.min[0] + size * (float)side;
        square.max[2] = square.min[2] + size * (float)side;
        for (k = 0; k < c->gain_count; k += random_range(1, 12)) {
            const terrimp_place_gain *g = &s->gains[c->first_gain + k];
            uint32_t cell = g->view / 12, corner = random_range(0, 3);
            int within = cell % 8 / side == p->x && cell / 8 / side == p->z;
            float eye[3], angle, far_off;
            CHECK(g->saved > 0.0f && g->view < s->view_count && (within || d->shafts));
            behind += !within;
            eye[0] = d->eyes.min[0] + size * (float)(cell % 8 + (corner & 1u));
            eye[1] = random_float(d->eyes.min[1], d->eyes.max[1]);
            eye[2] = d->eyes.min[2] + size * (float)(cell / 8 + (corner >> 1));
            far_off = terrimp_box_distance(&box, eye);
            CHECK(terrimp_view_angle(&box, p->eye, eye, &angle) == TERRIMP_OK);
            CHECK(angle <= 0.2014f);
            CHECK(d->pixel_factor * mesh.error * sinf(angle) <= d->tolerance_px * far_off * 1.01f);
            CHECK(far_off >= terrimpi_prepare_distance(&square, &box) * 0.9999f);
        }
    }
    CHECK(!d->shafts == !behind);
}

/* How many random eyes see more than a view's budget, though it is said to be within. */
static uint32_t prepared_over(const terrimp_place_terrain_desc *d, const terrimp_place_set *s,
                              float budget, uint32_t eyes)
{
    terrimpi_prepare p;
    static uint8_t whole[PREPARE_NODES], below[PREPARE_NODES], shown[64 * 12][PREPARE_NODES];
    uint32_t i, k, n, solved = 0, drawn = 0, over = 0;
    memset(&p, 0, sizeof p);
    p.desc = *d;
    p.cells = 8;
    p.nodes = s->cluster_count;
    p.whole = whole;
    p.below = below;
    memset(shown, 0, sizeof shown);
    for (i = 0; i < s->candidate_count; i++)
        for (k = 0; k < s->candidates[i].gain_count; k++) {
            uint32_t gain = s->candidates[i].first_gain + k;
            shown[s->gains[gain].view][s->candidates[i].cluster] |= prepare_shown[gain];
        }
    for (n = 0; n < eyes; n++) {
        float eye[3], direction = random_float(0.0f, 6.2831f), cost;
        uint32_t x, z, view;
        terrimp_place_picture square;
        terrimp_box cell;
        for (i = 0; i < 3; i++)
            eye[i] = random_float(d->eyes.min[i], d->eyes.max[i]);
        x = (uint32_t)((eye[0] - 2400.0f) / 40.0f);
        z = (uint32_t)((eye[2] - 2400.0f) / 40.0f);
        view = (z * 8 + x) * 12 + (uint32_t)(direction / 6.2831853f * 12.0f);
        terrimpi_prepare_square(&p, z * 8 + x, &square, &cell);
        terrimpi_prepare_ground(&p, &cell);
        cost = prepare_frame(d, shown[view], whole, s->cluster_count - 1, eye, direction);
        CHECK(cost <= prepare_left[view] + 1.0f);
        over += cost > budget + 1.0f && !(prepare_left[view] > budget);
        solved += prepare_left[view] <= budget * 1.0001f;
        drawn += cost > 0.5f * prepare_left[view];
    }
    CHECK(solved > eyes * 9 / 10 && drawn > eyes / 2);
    CHECK_NOTE("random views", eyes);
    CHECK_NOTE("over the budget, where their set says within", over);
    CHECK_NOTE("of cells that are reported as unsolved", eyes - solved);
    return over;
}

static void prepared_views_keep_within_their_budget(void)
{
    land l;
    terrimp_place_terrain_desc d;
    terrimp_place_set s;
    terrimp_placement shared, shafts, single;
    float highest = 0.0f, budget;
    uint32_t i, n;
    prepare_begin(&l, &d, &s);
    d.shafts = 1;
    prepare_run(&d, &s);
    check_prepared(&d, &s);
    for (i = 0; i < s.view_count; i++)
        highest = fmaxf(highest, s.costs[i]);
    budget = 0.6f * highest;
    prepare_place(&s, budget, &shafts);
    CHECK(prepared_over(&d, &s, budget, PREPARE_EYES / 2) == 0);
    d.shafts = 0;
    prepare_run(&d, &s);
    check_prepared(&d, &s);
    prepare_place(&s, budget, &shared);
    CHECK(shared.problems > 100 && shared.unsolved < shared.problems / 10 && shared.chosen > 10);
    CHECK(prepared_over(&d, &s, budget, PREPARE_EYES / 2) == 0);
    for (i = 0, n = 0; i < s.candidate_count; i++) /* a set for each cell needs more */
        if (s.pictures[i].level == 0)
            s.candidates[n++] = s.candidates[i];
    s.candidate_count = n;
    prepare_place(&s, budget, &single);
    CHECK(shared.memory < 0.25f * single.memory);
    /* More to choose from saves memory on the small terrain; a greedy choice may miss that by its
       own slack, as it does by 1.5 % on the larger one of the benchmark. */
    CHECK(shafts.memory < (PREPARE_SIDE == 129u ? 1.0f : 1.05f) * shared.memory &&
          shafts.unsolved <= shared.unsolved);
    CHECK_NOTE("memory, of a set for each cell", (double)(shared.memory / single.memory));
    CHECK_NOTE("memory with shafts, of that with boxes", (double)(shafts.memory / shared.memory));
    land_free(&l);
}

static void prepared_sets_refuse(void)
{
    land l;
    terrimp_place_terrain_desc good, bad;
    terrimp_place_set s, full;
    size_t bytes;
    void *scratch;
    int i;
    prepare_begin(&l, &good, &full);
    good.cell_levels = 1;
    bytes = terrimp_place_terrain_scratch_bytes(&good);
    scratch = malloc(bytes);
    CHECK(bytes > 0 && scratch);
    CHECK(terrimp_place_terrain_scratch_bytes(NULL) == 0);
    GIVES(TERRIMP_E_NULL, terrimp_place_terrain(NULL, scratch, bytes, &full));
    GIVES(TERRIMP_E_NULL, terrimp_place_terrain(&good, NULL, bytes, &full));
    GIVES(TERRIMP_E_NULL, terrimp_place_terrain(&good, scratch, bytes, NULL));
    GIVES(TERRIMP_E_MEMORY, terrimp_place_terrain(&good, scratch, bytes - 1, &full));
    GIVES(TERRIMP_E_ALIGN, terrimp_place_terrain(&good, (char *)scratch + 4, bytes, &full));
    GIVES(TERRIMP_OK, terrimp_place_terrain(&good, scratch, bytes, &full));
    for (i = 0; i < 5; i++) {
        s = full;
        if (i == 0)
            s.candidates = NULL;
        else if (i == 1)
            s.pictures = NULL;
        else if (i == 2)
            s.gains = NULL;
        else if (i == 3)
            s.parents = NULL;
        else
            s.costs = NULL;
        GIVES(TERRIMP_E_NULL, terrimp_place_terrain(&good, scratch, bytes, &s));
    }
    for (i = 0; i < 4; i++) {
        s = full;
        *(i == 0   ? &s.candidate_capacity
          : i == 1 ? &s.gain_capacity
          : i == 2 ? &s.cluster_capacity
                   : &s.view_capacity) = 1;
        GIVES(TERRIMP_E_CAPACITY, terrimp_place_terrain(&good, scratch, bytes, &s));
        CHECK(s.candidate_count == full.candidate_count && s.gain_count == full.gain_count);
    }
    for (i = 0; i < 15; i++) {
        terrimp_result wanted = i == 0 ? TERRIMP_E_NULL
                                : i < 7 ? TERRIMP_E_NOT_FINITE
                                        : TERRIMP_E_RANGE;
        bad = good;
        switch (i) {
        case 0: bad.terrain = NULL; break;
        case 1: bad.eyes.min[1] = not_finite(0); break;
        case 2: bad.fov_rad = not_finite(1); break;
        case 3: bad.pixel_factor = not_finite(0); break;
        case 4: bad.tolerance_px = not_finite(0); break;
        case 5: bad.texels_per_px = not_finite(2); break;
        case 6: bad.draw_cost = not_finite(0); break;
        case 7: bad.eyes.min[0] = bad.eyes.max[0] + 1.0f; break;
        case 8: bad.cell_levels = 7; break;
        case 9: bad.directions = 65; break;
        case 10: bad.fov_rad = 0.0f; break;
        case 11: bad.pixel_factor = 0.0f; break;
        case 12: bad.tolerance_px = -1.0f; break;
        case 13: bad.max_angle_rad = -1.0f; break;
        default: bad.triangle_cost = -1.0f; break;
        }
        CHECK(terrimp_place_terrain_scratch_bytes(&bad) == 0);
        GIVES(wanted, terrimp_place_terrain(&bad, scratch, bytes, &full));
    }
    free(scratch);
    land_free(&l);
}

static inline void placement_tests(void)
{
    RUN(placements_are_what_they_say);
    RUN(placements_take_little_more_memory_than_the_exact_answer);
    RUN(better_pictures_take_the_place_of_others);
    RUN(placement_refuses);
    RUN(prepared_sets_refuse);
}

/* What flies: of the program flights.c. */
static inline void placement_flights(void)
{
    RUN(prepared_views_keep_within_their_budget);
}

#endif
