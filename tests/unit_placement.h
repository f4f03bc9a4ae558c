/* Laws of the placement: budgets, memory against the exact answer, what is shown where. */
#ifndef UNIT_PLACEMENT_H
#define UNIT_PLACEMENT_H

#include "unit_bad_input.h"

enum { PLACE_VIEWS = 12, PLACE_CANDIDATES = 14, PLACE_GAINS = PLACE_VIEWS * PLACE_CANDIDATES,
       PLACE_CLUSTERS = 7 };

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

/* The most that a set takes off a view: each cluster by one picture, or by its parts. */
static float exact_saving(const placing *p, uint32_t set, uint32_t view)
{
    float best[PLACE_CLUSTERS] = {0, 0, 0, 0, 0, 0, 0};
    uint32_t i, k;
    for (i = 0; i < p->desc.candidate_count; i++)
        for (k = 0; (set >> i & 1u) && k < p->candidates[i].gain_count; k++) {
            const terrimp_place_gain *g = &p->gains[p->candidates[i].first_gain + k];
            if (g->view == view && g->saved > best[p->candidates[i].cluster])
                best[p->candidates[i].cluster] = g->saved;
        }
    return fmaxf(best[6], fmaxf(best[4], best[0] + best[1]) + fmaxf(best[5], best[2] + best[3]));
}

/* Against all sets of candidates: as many views are solved, with nearly as little memory. */
static void placements_take_little_more_memory_than_the_exact_answer(void)
{
    placing *p = &place_room;
    double sum = 0.0;
    int n, count = 0, close = 0;
    for (n = 0; n < 80; n++) {
        terrimp_placement out;
        float least = 1e30f;
        uint32_t set, v, i, fewest = 99;
        random_placing(p);
        CHECK(run_placing(p, &out) == TERRIMP_OK);
        for (set = 0; set < 1u << p->desc.candidate_count; set++) {
            float memory = 0.0f;
            uint32_t over = 0;
            for (i = 0; i < p->desc.candidate_count; i++)
                memory += set >> i & 1u ? p->candidates[i].memory : 0.0f;
            if (fewest == 0 && memory >= least)
                continue;
            for (v = 0; v < p->desc.view_count; v++)
                over += p->costs[v] - exact_saving(p, set, v) > p->desc.budget * 1.00001f;
            if (over < fewest || (over == fewest && memory < least)) {
                fewest = over;
                least = memory;
            }
        }
        CHECK(out.unsolved == fewest);
        if (fewest || !(least > 0.0f))
            continue;
        CHECK(out.memory >= least * 0.9999f && out.memory < least * 1.3f);
        sum += (double)(out.memory / least);
        close += out.memory <= least * 1.05f;
        count++;
    }
    CHECK(count > 20 && sum < 1.01 * count && close >= count * 95 / 100);
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

static void placement_tests(void)
{
    RUN(placements_are_what_they_say);
    RUN(placements_take_little_more_memory_than_the_exact_answer);
    RUN(placement_refuses);
}

#endif
