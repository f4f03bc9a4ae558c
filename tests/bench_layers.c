/* Layers, covers, depth meshes and placement beside the figures of Jeschke's dissertation (2004,
   tables 3.1, 4.1 and 5.1). His models are not to be had: the house and the figure are made up to
   the sizes that he gives, so that numbers of layers can be compared, and ratios; not counts of
   triangles as such. His times are of a Pentium 4 with 3.2 GHz.

   Build:  make bench_layers town prepared
   Use:    build/bench_layers [tile.hgt]   (else N42E001.hgt of TERRIMP_DATA or ../shared/data)
   Leaves: build/bench/layers.md (what it prints), layers.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
/* The unit tests' laws are run too, over more numbers, and say what they find. */
#define CHECK_NOTE(what, value) note(__func__, what, (double)(value))
#define PLACE_SETS 20000
#define PREPARE_EYES 10000
#define PREPARE_SIDE 257u
#define DEPTH_RAYS 40000
static void note(const char *test, const char *what, double value);
int unit_main(int argc, char **argv);
#define main unit_main
#include "unit.c"
#undef main

#include "bench_say.h"
#include "cover_greedy.h"

#include <math.h>
#include <time.h>

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static float random_unit(void) { return random_float(0.0f, 1.0f); }

static uint32_t bits_set(const uint32_t *mask, size_t words)
{
    uint32_t sum = 0;
    size_t i;
    for (i = 0; i < words; i++)
        sum += terrimpi_mask_bit_count(mask[i]);
    return sum;
}

/* ---- Table 4.1: a house ------------------------------------------------- */

static void put(const terrimp_layer_record *r, const float *a, const float *b, const float *c)
{
    float xyz[9];
    memcpy(xyz, a, 12);
    memcpy(xyz + 3, b, 12);
    memcpy(xyz + 6, c, 12);
    need(terrimp_layer_triangle(r, xyz));
}

static void put_box(const terrimp_layer_record *r, float x0, float y0, float z0, float x1, float y1,
                    float z1)
{
    static const int faces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                    {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    float corner[8][3];
    int i;
    for (i = 0; i < 8; i++) {
        corner[i][0] = i & 1 ? x1 : x0;
        corner[i][1] = i & 2 ? y1 : y0;
        corner[i][2] = i & 4 ? z1 : z0;
    }
    for (i = 0; i < 6; i++) {
        const int *f = faces[i];
        put(r, corner[f[0]], corner[f[1]], corner[f[2]]);
        put(r, corner[f[0]], corner[f[2]], corner[f[3]]);
    }
}

/* 20 x 20 x 44 m from depth z on: walls, a roof, windows, a porch, a wing, a chimney. */
static void put_house(const terrimp_layer_record *r, float z)
{
    float gable[6][3] = {{-10, 3, 2},  {10, 3, 2},  {0, 10, 2},
                         {-10, 3, 44}, {10, 3, 44}, {0, 10, 44}};
    int i, k;
    for (i = 0; i < 6; i++)
        gable[i][2] += z;
    put_box(r, -10, -10, z + 2, 10, 3, z + 44);
    put(r, gable[0], gable[1], gable[2]);
    put(r, gable[3], gable[4], gable[5]);
    for (i = 0; i < 2; i++) {
        put(r, gable[i], gable[2], gable[5]);
        put(r, gable[i], gable[5], gable[i + 3]);
    }
    for (i = 0; i < 5; i++)
        for (k = 0; k < 2; k++)
            put_box(r, -9.0f + 4.0f * (float)i, -6.0f + 5.0f * (float)k, z + 1.6f,
                    -7.0f + 4.0f * (float)i, -3.0f + 5.0f * (float)k, z + 2.2f);
    put_box(r, -2, -10, z, 2, -6, z + 2);
    put_box(r, -10, -10, z + 0.5f, -6, -7, z + 2);
    put_box(r, 4, 5, z + 10, 6, 9.5f, z + 12);
}

typedef struct house_row {
    int distance, layers, polygons, polygons_layered, mesh_kb10, layered_kb10;
    double mesh_s, layered_s;
} house_row;

static const house_row his_house[] = {
    {90, 110, 418, 1176, 1542, 3290, 89.2, 0.57},  {110, 81, 203, 700, 897, 1980, 62, 0.356},
    {140, 56, 65, 372, 497, 1070, 24.5, 0.2},      {180, 34, 35, 178, 264, 574, 7.9, 0.11},
    {250, 19, 17, 82, 123, 255, 3.2, 0.06},        {500, 5, 8, 16, 35, 45, 0.67, 0.02},
    {1000, 1, 3, 2, 6, 7, 0.101, 0.01},
};

typedef struct house {
    terrimp_layers layers;
    terrimp_capture picture;
    uint32_t side, *opaque, *visible;
    size_t words; /* of a layer */
} house;

static void house_record(house *h, float distance)
{
    terrimp_layers_desc d;
    terrimp_layer_record r;
    uint32_t k, *state;
    memset(&d, 0, sizeof d);
    memset(h, 0, sizeof *h);
    d.distance = distance;
    d.depth = 44.0f;
    d.cell_size[0] = d.cell_size[1] = d.cell_depth = 100.0f;
    d.view_tan[0] = d.view_tan[1] = 10.2f / distance;
    d.texel = 2.0f * tanf(0.39269908f) / 512.0f;
    d.even = 1;
    need(terrimp_layers_plan(&d, &h->layers));
    h->side = (uint32_t)(2.0f * d.view_tan[0] / d.texel) + 1u;
    h->words = (size_t)h->side * TERRIMP_MASK_WORDS(h->side);
    h->picture.right[0] = -1.0f;
    h->picture.up[1] = h->picture.forward[2] = 1.0f;
    h->picture.tan_left = h->picture.tan_down = -0.5f * (float)h->side * d.texel;
    h->opaque = (uint32_t *)calloc(h->layers.count * h->words, 4);
    h->visible = (uint32_t *)calloc(h->layers.count * h->words, 4);
    state = (uint32_t *)calloc(4u * h->words, 4);
    if (!h->opaque || !h->visible || !state)
        bench_stop("memory", "there is none");
    memset(&r, 0, sizeof r);
    r.layers = &h->layers;
    r.picture = &h->picture;
    r.width = r.height = h->side;
    r.masks = h->opaque;
    put_house(&r, distance);
    for (k = 0; k < h->layers.count; k++)
        need(terrimp_layer_cull(h->opaque + k * h->words, h->side, h->side, 0, state,
                                h->visible + k * h->words));
    free(state);
}

static void house_cover(const house *h, uint32_t *quads, uint32_t *texels)
{
    static terrimp_rect rects[20000];
    terrimp_cover_desc d;
    uint32_t k, i, count;
    size_t bytes;
    void *scratch;
    memset(&d, 0, sizeof d);
    d.width = d.height = h->side;
    bytes = terrimp_cover_scratch_bytes(&d, 20000);
    scratch = need_memory(bytes);
    *quads = *texels = 0;
    for (k = 0; k < h->layers.count; k++) {
        d.mask = h->visible + k * h->words;
        need(terrimp_cover(&d, scratch, bytes, rects, 20000, &count));
        *quads += count;
        for (i = 0; i < count; i++)
            *texels += rects[i].width * rects[i].height;
    }
    free(scratch);
}

static void house_mesh(const house *h, float tolerance, terrimp_depth_mesh *m)
{
    static terrimp_depth_vertex vertices[100000];
    static uint32_t indices[300000];
    static terrimp_depth_sheet sheets[20000];
    static uint16_t texels[2000000];
    terrimp_depth_mesh_desc d;
    size_t bytes;
    void *scratch;
    memset(&d, 0, sizeof d);
    memset(m, 0, sizeof *m);
    d.opaque = h->opaque;
    d.visible = h->visible;
    d.width = d.height = h->side;
    d.layers = h->layers.count;
    d.tolerance = tolerance;
    m->vertices = vertices;
    m->indices = indices;
    m->sheets = sheets;
    m->texel_layers = texels;
    m->vertex_capacity = 100000;
    m->index_capacity = 300000;
    m->sheet_capacity = 20000;
    m->texel_capacity = 2000000;
    bytes = terrimp_depth_mesh_scratch_bytes(&d);
    scratch = need_memory(bytes);
    need(terrimp_depth_mesh_make(&d, scratch, bytes, m));
    free(scratch);
}

/* The point of a triangle that is closest to p: its foot, or the closest point of a side. */
static void closest_point(const float p[3], float t[3][3], float out[3])
{
    float best = TERRIMPI_FLOAT_MAX, n[3], ab[3], ac[3], ap[3], side[3], along[3];
    int i, k, inside = 1;
    terrimpi_sub(t[1], t[0], ab);
    terrimpi_sub(t[2], t[0], ac);
    terrimpi_sub(p, t[0], ap);
    terrimpi_cross(ab, ac, n);
    for (i = 0; i < 3; i++) {
        float to[3], at[3], part, square;
        terrimpi_sub(t[(i + 1) % 3], t[i], along);
        terrimpi_sub(p, t[i], to);
        terrimpi_cross(along, to, side);
        inside &= terrimpi_dot(side, n) >= 0.0f;
        part = terrimpi_dot(to, along) / fmaxf(terrimpi_dot(along, along), 1e-12f);
        part = fminf(fmaxf(part, 0.0f), 1.0f);
        for (k = 0; k < 3; k++)
            at[k] = t[i][k] + part * along[k];
        terrimpi_sub(at, p, to);
        square = terrimpi_dot(to, to);
        if (square < best) {
            best = square;
            memcpy(out, at, sizeof at);
        }
    }
    if (inside && terrimpi_dot(n, n) > 0.0f)
        for (k = 0; k < 3; k++)
            out[k] = p[k] - terrimpi_dot(ap, n) / terrimpi_dot(n, n) * n[k];
}

/* How far off texels of layers appear on a mesh to the cell's worst corner [texels, to each side]:
   at the closest point of it, where a layer more or less is a texel. */
static float house_error(const house *h, const terrimp_depth_mesh *m)
{
    float worst = 0.0f;
    uint32_t x, y, k, i, c;
    for (k = 0; k < h->layers.count; k++)
        for (y = 0; y < h->side; y++)
            for (x = 0; x < h->side; x++) {
                float p[3], best = TERRIMPI_FLOAT_MAX, off[3] = {0, 0, 0};
                if (!mask_at(h->visible + k * h->words, h->side, (int)x, (int)y))
                    continue;
                p[0] = (float)x + 0.5f;
                p[1] = (float)y + 0.5f;
                p[2] = (float)k;
                for (i = 0; i < m->index_count; i += 3) {
                    float t[3][3], to[3], square, aside = 0.0f;
                    for (c = 0; c < 3; c++)
                        memcpy(t[c], &m->vertices[m->indices[i + c]], sizeof t[c]);
                    for (c = 0; c < 3; c++) {
                        float low = fminf(t[0][c], fminf(t[1][c], t[2][c])) - p[c];
                        float high = fmaxf(t[0][c], fmaxf(t[1][c], t[2][c])) - p[c];
                        aside = fmaxf(aside, fmaxf(low, -high));
                    }
                    if (aside * aside >= best)
                        continue;
                    closest_point(p, t, to);
                    terrimpi_sub(to, p, to);
                    square = terrimpi_dot(to, to);
                    if (square < best) {
                        best = square;
                        memcpy(off, to, sizeof off);
                    }
                }
                worst = fmaxf(worst, fmaxf(fabsf(off[0]), fabsf(off[1])) + fabsf(off[2]));
            }
    return worst;
}

/* The mesh with the most tolerance that is off by no more than so many pixels. */
static float house_mesh_within(const house *h, float allowed, terrimp_depth_mesh *m)
{
    float tolerance, error, found = 0.75f;
    for (tolerance = allowed / 1.5f; tolerance < allowed; tolerance *= 1.06f) {
        house_mesh(h, fmaxf(tolerance, 0.75f), m);
        error = house_error(h, m);
        if (error > allowed)
            break;
        found = fmaxf(tolerance, 0.75f);
    }
    house_mesh(h, found, m);
    return house_error(h, m);
}

static void table_house(void)
{
    int i;
    say("\nTable 4.1: a house of 20 x 20 x 44 m (that depth is fitted, it is not given), cell of "
        "100 m,\n512 pixels over 45 degrees. Texels of 4 bytes, 20 bytes a vertex. In brackets "
        "his. His meshes are off by\n1.5 to 2 pixels at most, so he says, to the worst corner of "
        "the cell: ours with as much, measured for\neach texel that can be seen. Last but one: "
        "triangles of layers for each of the mesh of 2 pixels\n\n");
    say("| distance m | layers | quads of layers | kB | s | mesh of 1.5 px | px | of 2 px | px | "
        "kB | s | layers / mesh | voxels |\n"
        "|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < 7; i++) {
        const house_row *his = &his_house[i];
        terrimp_depth_mesh m;
        uint32_t quads, texels;
        double start = now_ms(), layered;
        float error;
        house h;
        house_record(&h, (float)his->distance);
        house_cover(&h, &quads, &texels);
        layered = now_ms() - start;
        say("| %d | %u (%d) | %u (%d) | %.1f (%.1f) | %.4f (%.2f) | ", his->distance,
            h.layers.count, his->layers, quads, his->polygons_layered / 2,
            (4.0 * texels + 80.0 * quads) / 1024.0, his->layered_kb10 / 10.0, layered / 1e3,
            his->layered_s);
        error = house_mesh_within(&h, 1.5f, &m);
        say("%u | %.2f | ", m.index_count / 3u, (double)error);
        error = house_mesh_within(&h, 2.0f, &m);
        start = now_ms();
        house_mesh(&h, 1.4142f, &m);
        start = now_ms() - start;
        house_mesh_within(&h, 2.0f, &m);
        say("%u (%d) | %.2f | %.1f (%.1f) | %.3f (%.1f) | %.1f (%.1f) | %u |\n",
            m.index_count / 3u, his->polygons, (double)error,
            (4.0 * m.texel_count + 20.0 * m.vertex_count + 2.0 * m.index_count) / 1024.0,
            his->mesh_kb10 / 10.0, start / 1e3, his->mesh_s,
            2.0 * quads / (m.index_count / 3.0),
            (double)his->polygons_layered / his->polygons,
            bits_set(h.visible, h.layers.count * h.words));
        free(h.opaque);
        free(h.visible);
    }
}

/* ---- Table 3.1: covering ------------------------------------------------ */

enum { FIGURE_WIDTH = 397, FIGURE_HEIGHT = 677, FIGURE_LAYERS = 6, FIGURE_QUADS = 20000,
       FIGURE_WORDS = FIGURE_HEIGHT * TERRIMP_MASK_WORDS(FIGURE_WIDTH) };

static float hashed(int x, int y, uint32_t seed)
{
    uint32_t h = (uint32_t)x * 374761393u + (uint32_t)y * 668265263u + seed * 2246822519u;
    h = (h ^ h >> 13) * 1274126177u;
    return (float)((h ^ h >> 16) & 0xffffu) / 65535.0f;
}

static float noise(float x, float y, uint32_t seed)
{
    float sum = 0.0f, size = 0.5f;
    int octave;
    for (octave = 0; octave < 5; octave++, x *= 2.0f, y *= 2.0f, size *= 0.5f) {
        int i = (int)floorf(x), k = (int)floorf(y);
        float u = x - (float)i, v = y - (float)k;
        uint32_t s = seed + (uint32_t)octave;
        u = u * u * (3.0f - 2.0f * u);
        v = v * v * (3.0f - 2.0f * v);
        sum += size * ((hashed(i, k, s) * (1 - u) + hashed(i + 1, k, s) * u) * (1 - v) +
                       (hashed(i, k + 1, s) * (1 - u) + hashed(i + 1, k + 1, s) * u) * v);
    }
    return sum;
}

static void make_figure(uint32_t masks[FIGURE_LAYERS][FIGURE_WORDS], uint32_t seed)
{
    uint32_t x, y;
    memset(masks, 0, FIGURE_LAYERS * sizeof masks[0]);
    for (y = 0; y < FIGURE_HEIGHT; y++)
        for (x = 0; x < FIGURE_WIDTH; x++) {
            float dx = 2.0f * (float)x / FIGURE_WIDTH - 1.0f;
            float dy = 2.0f * (float)y / FIGURE_HEIGHT - 1.0f, depth;
            int layer;
            if (noise((float)x / 90.0f, (float)y / 90.0f, seed) <
                0.25f + 0.35f * (dx * dx + dy * dy))
                continue;
            depth = noise((float)x / 120.0f, (float)y / 120.0f, seed + 50u) * 9.6f - 1.2f;
            layer = depth < 0.0f ? 0 : depth >= 6.0f ? 5 : (int)depth;
            masks[layer][y * TERRIMP_MASK_WORDS(FIGURE_WIDTH) + x / 32u] |= 1u << x % 32u;
            if (layer && depth - (float)layer < 0.05f) /* borders are in both */
                masks[layer - 1][y * TERRIMP_MASK_WORDS(FIGURE_WIDTH) + x / 32u] |= 1u << x % 32u;
        }
}

/* All layers with one setting: cell 0 for terrimp_cover with a cost of quads. */
static void cover_figure(uint32_t masks[FIGURE_LAYERS][FIGURE_WORDS], uint32_t cell, uint32_t cost,
                         uint32_t *quads, uint32_t *texels, double *ms)
{
    static terrimp_rect rects[FIGURE_QUADS];
    terrimp_cover_desc d;
    uint32_t k, i, count;
    size_t bytes;
    void *scratch;
    memset(&d, 0, sizeof d);
    d.width = FIGURE_WIDTH;
    d.height = FIGURE_HEIGHT;
    d.quad_cost = cost;
    bytes = terrimp_cover_scratch_bytes(&d, FIGURE_QUADS);
    scratch = need_memory(bytes);
    *quads = *texels = 0;
    *ms = now_ms();
    for (k = 0; k < FIGURE_LAYERS; k++) {
        d.mask = masks[k];
        if (cell)
            count = cover_greedily(&d, cell, 0.8f, rects, FIGURE_QUADS);
        else
            need(terrimp_cover(&d, scratch, bytes, rects, FIGURE_QUADS, &count));
        *quads += count;
        for (i = 0; i < count; i++)
            *texels += rects[i].width * rects[i].height;
    }
    *ms = (now_ms() - *ms) / FIGURE_LAYERS;
    free(scratch);
}

static void table_cover(void)
{
    static uint32_t masks[FIGURE_LAYERS][FIGURE_WORDS];
    static const uint32_t cells[] = {1, 2, 4, 8, 16, 32, 64, 128, 256, 700};
    static const int his_quads[] = {539, 340, 207, 114, 71, 39, 25, 11, 11, 6};
    static const int his_kb[] = {414, 423, 447, 490, 555, 719, 996, 1697, 1833, 2131};
    double ratios[10] = {0};
    uint32_t seed, i, quads, texels, low, high, our_quads = 0, our_texels = 0;
    double ms, our_ms = 0.0, mean_ratio = 0.0;
    say("\nTable 3.1: six layers of 397 x 677 texels. His greedy cover with each of his cells, "
        "and\nterrimp_cover with the cost of a quad at which it makes at most as many. The first "
        "of six made-up\nfigures; last column: mean of the six\n\n"
        "| cell | his dragon: quads, kB | greedy: quads | kB | ms a layer | ours: quads | kB | "
        "ms | texels of greedy | of six |\n|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (seed = 6; seed >= 1; seed--) {
        make_figure(masks, 100u * seed);
        for (i = 0; i < 10; i++) {
            cover_figure(masks, cells[i], 20, &quads, &texels, &ms);
            for (low = 1, high = 1u << 20; low < high;) {
                uint32_t middle = (low + high) / 2u, some;
                cover_figure(masks, 0, middle, &some, &our_texels, &our_ms);
                if (some <= quads)
                    high = middle;
                else
                    low = middle + 1u;
            }
            cover_figure(masks, 0, high, &our_quads, &our_texels, &our_ms);
            ratios[i] += (double)our_texels / texels / 6.0;
            mean_ratio += (double)our_texels / texels / 60.0;
            if (seed == 1)
                say("| %u | %d, %d | %u | %.0f | %.2f | %u | %.0f | %.2f | %.3f | %.3f |\n",
                    cells[i], his_quads[i], his_kb[i], quads, texels * 4.0 / 1024.0, ms, our_quads,
                    our_texels * 4.0 / 1024.0, our_ms, (double)our_texels / texels, ratios[i]);
        }
    }
    say("\nOver all settings %.3f of the texels. Where a quad a layer is all there may be (the "
        "last rows),\nthere is nothing to win\n",
        mean_ratio);
}

/* ---- Culling ------------------------------------------------------------ */

static void table_cull(void)
{
    enum { SIDE = 512, WORDS = SIDE * TERRIMP_MASK_WORDS(SIDE), TURNS = 500 };
    static uint32_t opaque[WORDS], state[4 * WORDS], visible[WORDS];
    int rule, i;
    for (i = 0; i < WORDS; i++)
        opaque[i] = (uint32_t)(random_unit() * 4294967040.0f) | (uint32_t)(random_unit() * 4e9f);
    say("\nCulling a layer of 512 x 512 texels (he: 3 to 12 ms between 256 and 1024 texels, with "
        "covering)\n\n| rule | ms |\n|---|--:|\n");
    for (rule = TERRIMP_CULL_BLOCK; rule < TERRIMP_CULL_COUNT; rule++) {
        double start = now_ms();
        for (i = 0; i < TURNS; i++)
            need(terrimp_layer_cull(opaque, SIDE, SIDE, rule, state, visible));
        say("| %s | %.4f |\n", rule == TERRIMP_CULL_BLOCK ? "3 x 3" : "four corners",
            (now_ms() - start) / TURNS);
    }
}

/* ---- Placement ---------------------------------------------------------- */

enum { MANY_SIDE = 32, MANY_CLUSTERS = 1365, MANY_VIEWS = 4096, MANY_CANDIDATES = 300000 };

static void table_place(void)
{
    static uint32_t parents[MANY_CLUSTERS];
    static float costs[MANY_VIEWS], left[MANY_VIEWS];
    terrimp_place_candidate *candidates =
        (terrimp_place_candidate *)need_memory(MANY_CANDIDATES * sizeof *candidates);
    terrimp_place_gain *gains =
        (terrimp_place_gain *)need_memory((size_t)MANY_CANDIDATES * 32u * sizeof *gains);
    terrimp_place_desc d;
    terrimp_placement placed;
    uint32_t base = 0, side, x, y, i, k;
    uint8_t *shown;
    void *scratch;
    size_t bytes;
    double start;
    memset(&d, 0, sizeof d);
    for (side = MANY_SIDE; side > 1; base += side * side, side /= 2)
        for (y = 0; y < side; y++)
            for (x = 0; x < side; x++)
                parents[base + y * side + x] = base + side * side + y / 2 * (side / 2) + x / 2;
    parents[MANY_CLUSTERS - 1] = MANY_CLUSTERS - 1;
    for (i = 0; i < MANY_VIEWS; i++)
        costs[i] = 50.0f + 100.0f * random_unit();
    for (i = 0; i < MANY_CANDIDATES; i++) {
        terrimp_place_candidate *c = &candidates[i];
        uint32_t count = 1u << (int)(random_unit() * 5.99f);
        uint32_t first = (uint32_t)(random_unit() * (float)(MANY_VIEWS - count));
        c->cluster = (uint32_t)(random_unit() * (MANY_CLUSTERS - 1));
        c->memory = 0.5f + random_unit() + 0.1f * (float)count;
        c->first_gain = d.gain_count;
        for (k = 0; k < count; k++) {
            gains[d.gain_count].view = first + k;
            gains[d.gain_count].saved = 1.0f + random_unit();
            gains[d.gain_count++].saved *= c->cluster < 1024 ? 1.0f : 2.0f;
        }
        c->gain_count = count;
    }
    d.candidates = candidates;
    d.gains = gains;
    d.parents = parents;
    d.costs = costs;
    d.candidate_count = MANY_CANDIDATES;
    d.cluster_count = MANY_CLUSTERS;
    d.view_count = MANY_VIEWS;
    d.budget = 60.0f;
    bytes = terrimp_place_scratch_bytes(&d);
    scratch = need_memory(bytes);
    shown = (uint8_t *)need_memory(d.gain_count);
    start = now_ms();
    need(terrimp_place(&d, scratch, bytes, shown, left, &placed));
    say("\nPlacement: random candidates over 1365 clusters of a quadtree (his: 314,659 candidates, "
        "9078 views)\n\n| candidates | gains | views | problems | chosen | unsolved | s | scratch "
        "MB |\n|--:|--:|--:|--:|--:|--:|--:|--:|\n| %d | %u | %d | %u | %u | %u | %.2f | %.1f |\n",
        (int)MANY_CANDIDATES, d.gain_count, (int)MANY_VIEWS, placed.problems, placed.chosen,
        placed.unsolved, (now_ms() - start) / 1e3, (double)bytes / 1048576.0);
    free(shown);
    free(scratch);
    free(gains);
    free(candidates);
}

/* ---- A terrain's node as a depth mesh ----------------------------------- */

enum { NODE_QUADS = 64, NODE_TEXELS = 128, NODE_BUDGET = 85 };

typedef struct triangles {
    float (*corner)[3][3];
    uint32_t count;
} triangles;

/* Where a ray first meets triangles; 0 when it does not. */
static int first_hit(const triangles *t, const float eye[3], const float way[3], double hit[3])
{
    double best = 1e30;
    uint32_t i;
    int k;
    for (i = 0; i < t->count; i++) {
        float ab[3], ac[3], ae[3], p[3], q[3];
        double scale, u, v, at;
        terrimpi_sub(t->corner[i][1], t->corner[i][0], ab);
        terrimpi_sub(t->corner[i][2], t->corner[i][0], ac);
        terrimpi_sub(eye, t->corner[i][0], ae);
        terrimpi_cross(way, ac, p);
        terrimpi_cross(ae, ab, q);
        scale = (double)terrimpi_dot(ab, p);
        if (fabs(scale) < 1e-12)
            continue;
        u = (double)terrimpi_dot(ae, p) / scale;
        v = (double)terrimpi_dot(way, q) / scale;
        at = (double)terrimpi_dot(ac, q) / scale;
        if (u >= -1e-5 && v >= -1e-5 && u + v <= 1.00001 && at > 0.0 && at < best)
            best = at;
    }
    for (k = 0; k < 3; k++)
        hit[k] = (double)eye[k] + best * (double)way[k];
    return best < 1e29;
}

/* Worst and mean angle by which what the capture saw is off, on triangles, when the eye has turned
   by 5 degrees round a sample to one of eight sides; samples that they do not hold count apart. */
static void judge_node(const terrimp_heightfield *f, uint32_t x0, uint32_t z0, const float eye[3],
                       const triangles *t, double *worst, double *mean, double *missed)
{
    double sum = 0.0, count = 0.0;
    uint32_t x, z, e;
    *worst = *missed = 0.0;
    for (z = 0; z <= NODE_QUADS; z += 2)
        for (x = 0; x <= NODE_QUADS; x += 2) {
            float point[3], way[3], side[3], up[3] = {0, 1, 0}, forward[3], length;
            terrimp_ray_hit seen;
            double at[3];
            int k;
            point[0] = f->origin_x + (float)(x0 + x) * f->spacing_x;
            point[2] = f->origin_z + (float)(z0 + z) * f->spacing_z;
            need(terrimp_heightfield_height(f, point[0], point[2], &point[1]));
            terrimpi_sub(point, eye, way);
            length = terrimpi_length(way);
            if (terrimp_heightfield_raycast(f, eye, way, 2.0f * length, &seen) == TERRIMP_OK &&
                seen.distance < length * 0.999f)
                continue; /* behind a ridge */
            if (!first_hit(t, eye, way, at)) {
                *missed += 1.0;
                continue;
            }
            memcpy(forward, way, sizeof forward);
            terrimpi_normalize(forward);
            terrimpi_basis(forward, up, side);
            for (e = 0; e < 8; e++) {
                double a[3], b[3], cross[3], turn = 0.0872665 * (double)length, angle;
                for (k = 0; k < 3; k++) {
                    double moved = (double)eye[k] +
                                   turn * (cos(e * 0.7853982) * (double)side[k] +
                                           sin(e * 0.7853982) * (double)up[k]);
                    a[k] = (double)point[k] - moved;
                    b[k] = at[k] - moved;
                }
                cross[0] = a[1] * b[2] - a[2] * b[1];
                cross[1] = a[2] * b[0] - a[0] * b[2];
                cross[2] = a[0] * b[1] - a[1] * b[0];
                angle = sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]) /
                        sqrt((a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) *
                             (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]));
                *worst = angle > *worst ? angle : *worst;
                sum += angle;
                count += 1.0;
            }
        }
    *mean = sum / (count > 0.0 ? count : 1.0);
}

/* The node's depth mesh with at most so many triangles: at the least tolerance that comes to it. */
static int node_depth_mesh(const terrimp_heightfield *f, const terrimp_box *box, const float eye[3],
                           triangles *out, float *tolerance)
{
    static float depths[(NODE_TEXELS + 1) * (NODE_TEXELS + 1)];
    static float xyz[30000];
    terrimp_capture c;
    house h;
    terrimp_layers_desc d;
    terrimp_layer_record r;
    terrimp_depth_mesh m;
    uint32_t x, y, k, i, *state;
    float distance = terrimp_box_distance(box, eye);
    need(terrimp_capture_fit(box, eye, &c));
    memset(&h, 0, sizeof h);
    memset(&d, 0, sizeof d);
    memset(&r, 0, sizeof r);
    d.distance = c.z_near;
    d.depth = c.z_far - c.z_near;
    d.cell_size[0] = d.cell_size[1] = 2.0f * 0.0872665f * distance;
    d.view_tan[0] = c.tan_right;
    d.view_tan[1] = c.tan_up > -c.tan_down ? c.tan_up : -c.tan_down;
    d.texel = (c.tan_right - c.tan_left) / NODE_TEXELS;
    d.even = 1;
    need(terrimp_layers_plan(&d, &h.layers));
    h.picture = c;
    h.side = NODE_TEXELS;
    h.words = NODE_TEXELS * TERRIMP_MASK_WORDS(NODE_TEXELS);
    for (y = 0; y <= NODE_TEXELS; y++)
        for (x = 0; x <= NODE_TEXELS; x++) {
            float way[3];
            terrimp_ray_hit hit;
            terrimpi_layer_point(&c, d.texel, (float)x, (float)y, 1.0f, way);
            terrimpi_sub(way, eye, way);
            depths[y * (NODE_TEXELS + 1) + x] = -1.0f;
            if (terrimp_heightfield_raycast(f, eye, way, 1e9f, &hit) != TERRIMP_OK ||
                hit.position[0] < box->min[0] || hit.position[0] > box->max[0] ||
                hit.position[2] < box->min[2] || hit.position[2] > box->max[2])
                continue;
            terrimpi_sub(hit.position, eye, way);
            depths[y * (NODE_TEXELS + 1) + x] = terrimpi_dot(way, c.forward);
        }
    h.opaque = (uint32_t *)calloc(h.layers.count * h.words, 4);
    h.visible = (uint32_t *)calloc(h.layers.count * h.words, 4);
    state = (uint32_t *)calloc(4u * h.words, 4);
    r.layers = &h.layers;
    r.picture = &c;
    r.width = r.height = NODE_TEXELS;
    r.masks = h.opaque;
    need(terrimp_layer_depths(&r, depths));
    for (k = 0; k < h.layers.count; k++)
        need(terrimp_layer_cull(h.opaque + k * h.words, NODE_TEXELS, NODE_TEXELS, 0, state,
                                h.visible + k * h.words));
    for (*tolerance = 0.75f; *tolerance < 64.0f; *tolerance *= 1.1f) {
        house_mesh(&h, *tolerance, &m);
        if (m.index_count <= 3u * NODE_BUDGET)
            break;
    }
    need(terrimp_depth_points(&h.layers, &c, m.vertices, m.vertex_count, xyz));
    out->count = m.index_count / 3u;
    for (i = 0; i < m.index_count; i++)
        memcpy(out->corner[i / 3u][i % 3u], xyz + 3u * m.indices[i], 12);
    free(state);
    free(h.opaque);
    free(h.visible);
    return out->count <= NODE_BUDGET;
}

static void table_node(int argc, char **argv)
{
    enum { SIDE = 1201 };
    static unsigned char raw[SIDE * SIDE * 2];
    static float heights[SIDE * SIDE], corner[20000][3][3];
    terrimp_heightfield f;
    char path[1024];
    FILE *file;
    uint32_t i, x, z, turn;
    double sums[2][3] = {{0}}, nodes = 0.0, better = 0.0, tolerances = 0.0;
    snprintf(path, sizeof path, "%s/N42E001.hgt", bench_data());
    file = fopen(argc > 1 ? argv[1] : path, "rb");
    if (!file || fread(raw, 1, sizeof raw, file) != sizeof raw) {
        say("\n(no tile: a terrain's node is not measured)\n");
        return;
    }
    fclose(file);
    for (i = 0; i < SIDE * SIDE; i++) {
        int v = raw[2 * i] << 8 | raw[2 * i + 1];
        heights[i] = v >= 0x8000 ? (i ? heights[i - 1] : 0.0f) : (float)v;
    }
    memset(&f, 0, sizeof f);
    f.samples = heights;
    f.width = f.depth = SIDE;
    f.spacing_x = 68.0f;
    f.spacing_z = 92.6f;
    need(terrimp_heightfield_resolve(&f, &f));
    for (z = 128; z + 2 * NODE_QUADS < SIDE; z += 256)
        for (x = 128; x + 2 * NODE_QUADS < SIDE; x += 256)
            for (turn = 0; turn < 2; turn++) {
                terrimp_heightfield part = f;
                terrimp_terrain_desc td;
                terrimp_terrain *terrain;
                terrimp_terrain_info info;
                terrimp_mesh_info mi;
                terrimp_box box;
                triangles t;
                float eye[3], *xyz, tolerance;
                uint16_t *indices;
                double result[2][3];
                int way;
                part.samples = heights + z * SIDE + x;
                part.row_bytes = SIDE * sizeof(float);
                part.width = part.depth = NODE_QUADS + 1;
                part.origin_x = (float)x * f.spacing_x;
                part.origin_z = (float)z * f.spacing_z;
                memset(&td, 0, sizeof td);
                td.field = part;
                need(terrimp_terrain_create(&td, NULL, &terrain));
                need(terrimp_terrain_get_info(terrain, &info));
                need(terrimp_terrain_get_box(terrain, 0, &box));
                need(terrimp_terrain_get_mesh(terrain, 0, &mi));
                xyz = (float *)need_memory(info.mesh_vertex_stride * 12u);
                indices = (uint16_t *)need_memory(info.mesh_index_stride * 2u);
                need(terrimp_terrain_fill_mesh(terrain, 0, xyz, info.mesh_vertex_stride * 3u,
                                               indices, info.mesh_index_stride));
                eye[0] = 0.5f * (box.min[0] + box.max[0]) + (turn ? 12000.0f : -4000.0f);
                eye[2] = 0.5f * (box.min[2] + box.max[2]) + (turn ? 6000.0f : -13000.0f);
                eye[1] = box.max[1] + 1500.0f;
                t.corner = corner;
                t.count = mi.index_count / 3u;
                for (i = 0; i < mi.index_count; i++)
                    memcpy(corner[i / 3u][i % 3u], xyz + 3u * indices[i], 12);
                judge_node(&part, 0, 0, eye, &t, &result[0][0], &result[0][1], &result[0][2]);
                if (node_depth_mesh(&part, &box, eye, &t, &tolerance)) {
                    judge_node(&part, 0, 0, eye, &t, &result[1][0], &result[1][1], &result[1][2]);
                    for (way = 0; way < 2; way++)
                        for (i = 0; i < 3; i++)
                            sums[way][i] += result[way][i];
                    nodes += 1.0;
                    better += result[1][0] <= 0.8 * result[0][0];
                    tolerances += (double)tolerance;
                }
                free(xyz);
                free(indices);
                terrimp_terrain_destroy(terrain);
            }
    say("\nA node of 64 x 64 quads of a real tile, seen from 13 to 14 km, after the eye has turned "
        "by 5 degrees:\nhow far off what the capture saw is on 85 triangles (milliradians; samples "
        "that are not on them).\nThe depth mesh is made from the capture's depth, %d texels across "
        "(mean tolerance %.1f)\n\n| mesh | worst, mean of %d nodes | mean | missed samples |\n"
        "|---|--:|--:|--:|\n", (int)NODE_TEXELS, tolerances / nodes, (int)nodes);
    say("| terrimp_simplify, raised | %.3f | %.4f | %.1f |\n", 1e3 * sums[0][0] / nodes,
        1e3 * sums[0][1] / nodes, sums[0][2] / nodes);
    say("| depth mesh | %.3f | %.4f | %.1f |\n", 1e3 * sums[1][0] / nodes,
        1e3 * sums[1][1] / nodes, sums[1][2] / nodes);
    say("\nThe depth mesh's worst is at least 20 %% lower in %d nodes\n", (int)better);
}

/* ---- The laws ----------------------------------------------------------- */

static void note(const char *test, const char *what, double value)
{
    say("| %s | %.6g | %s |\n", what, value, test);
}

static void table_laws(void)
{
    say("\nWhat the laws of the unit tests measure (tests/unit_layers.h, unit_placement.h), over "
        "more numbers than\nthere\n\n| what | measured | test |\n|---|--:|---|\n");
    RUN(the_dissertations_counts_come_out);
    RUN(nothing_appears_farther_off_than_allowed);
    RUN(layers_show_no_gap_to_any_eye_of_the_cell);
    RUN(culling_takes_nothing_that_an_eye_sees);
    RUN(depth_meshes_keep_to_their_layers_and_these_to_them);
    RUN(placements_take_little_more_memory_than_the_exact_answer);
    RUN(prepared_views_keep_within_their_budget);
}

/* ---- The examples ------------------------------------------------------- */

/* What an example beside this program says, but for its frames. */
static void example(const char *self, const char *name, const char *arguments)
{
    char line[1024];
    const char *slash = strrchr(self, '/');
    FILE *said;
    snprintf(line, sizeof line, "%.*s%s %s", slash ? (int)(slash + 1 - self) : 0, self, name,
             arguments);
    said = popen(line, "r");
    if (!said)
        bench_stop(name, "does not run");
    say("\n%s %s\n\n", name, arguments);
    while (fgets(line, sizeof line, said))
        if (strncmp(line, "frame", 5) != 0)
            say("    %s", line);
    if (pclose(said) != 0)
        bench_stop(name, "fails, or is not built");
}

static void table_flights(const char *self)
{
    say("\nThe examples: a town and a wood, and with BENCH_ALL a wood of 60,000 trees of 200 "
        "triangles (in his place:\nVienna, 10.4 million polygons in sight, 81 after it); pictures "
        "of a terrain that are drawn from read-only\nmemory. Drawn by a processor\n");
    example(self, "town", "");
    if (bench_all())
        example(self, "town", "1200000 1250");
    example(self, "prepared", "");
}

int main(int argc, char **argv)
{
    say_open("layers", 1);
    say_machine(NULL);
    table_house();
    table_cover();
    table_cull();
    table_place();
    table_node(argc, argv);
    table_laws();
    table_flights(argv[0]);
    say_close();
    return check_failed;
}
