#include "procedural.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The land is raised and eroded on a grid of one point every COARSE samples, where a river is
   little work, and gets its rocks only when that grid is spread to all samples. */
#define COARSE 4
#define HEIGHT 250.0f   /* [wu] about the highest peak */
#define CELL 340.0f     /* [wu] mean distance between two peaks */
#define WARP 150.0f     /* [wu] how far the perturbation moves a point */
#define RAINS 24        /* passes of erosion */
#define CARVING 0.045f  /* how fast a river cuts; grows with the root of the land it drains */
#define TALUS 0.9f      /* steepest slope that does not crumble */

/* Heights on a grid, rows without gaps. */
typedef struct grid {
    float *heights;
    uint32_t width, depth;
} grid;

/* Uniform in 0..1 from a lattice point. */
static float lattice(uint32_t x, uint32_t z, uint32_t seed)
{
    uint32_t h = x * 0x8da6b343u ^ z * 0xd8163841u ^ seed * 0xcb1ab31fu;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return (float)((h ^ h >> 15) >> 8) * (1.0f / 16777216.0f);
}

static float smooth(float t)
{
    return t * t * (3.0f - 2.0f * t);
}

static uint16_t to_sample(float height)
{
    float steps = height / PROCEDURAL_HEIGHT_SCALE;
    return (uint16_t)(steps < 0.0f ? 0.0f : steps > 65535.0f ? 65535.0f : steps);
}

/* ---- Noise, a row at a time --------------------------------------------- */

/* Adds amplitude times value noise of one wavelength to a row. The lattice is blended once along z,
   so that a sample costs one blend along x. */
static void add_octave(float *row, uint32_t width, uint32_t z, uint32_t wavelength,
                       float amplitude, uint32_t seed)
{
    float step = 1.0f / (float)wavelength;
    uint32_t cell_z = z / wavelength, x0, i;
    float v = smooth((float)(z % wavelength) * step), left, right;
    right = lattice(0, cell_z, seed) * (1.0f - v) + lattice(0, cell_z + 1, seed) * v;
    for (x0 = 0; x0 < width; x0 += wavelength) {
        uint32_t cell_x = x0 / wavelength + 1;
        uint32_t end = width - x0 < wavelength ? width - x0 : wavelength;
        left = right;
        right = lattice(cell_x, cell_z, seed) * (1.0f - v) + lattice(cell_x, cell_z + 1, seed) * v;
        for (i = 0; i < end; i++)
            row[x0 + i] += amplitude * (left + (right - left) * smooth((float)i * step) - 0.5f);
    }
}

/* Fractal noise about 0: each octave has half the wavelength and `gain` times the amplitude. */
static void noise_row(float *row, uint32_t width, uint32_t z, uint32_t longest, uint32_t shortest,
                      float gain, uint32_t seed)
{
    float amplitude = 1.0f;
    uint32_t wavelength, x;
    for (x = 0; x < width; x++)
        row[x] = 0.0f;
    for (wavelength = longest; wavelength >= shortest; wavelength /= 2) {
        add_octave(row, width, z, wavelength, amplitude, seed++);
        amplitude *= gain;
    }
}

/* ---- Voronoi cells ------------------------------------------------------ */

typedef struct peak {
    float x, z, height;
} peak;

/* The peaks around one square, kept while the points that are asked for stay inside it. */
typedef struct peaks {
    int32_t i, j;
    peak items[9];
} peaks;

/* One peak in each square of side CELL, away from the square's rim. */
static peak peak_of_square(int32_t i, int32_t j, uint32_t seed)
{
    uint32_t x = (uint32_t)i, z = (uint32_t)j;
    peak p;
    p.x = ((float)i + 0.1f + 0.8f * lattice(x, z, seed)) * CELL;
    p.z = ((float)j + 0.1f + 0.8f * lattice(x, z, seed + 1)) * CELL;
    p.height = 0.35f + 0.65f * lattice(x, z, seed + 2);
    return p;
}

static void find_peaks(peaks *around, int32_t i, int32_t j, uint32_t seed)
{
    int32_t k;
    around->i = i;
    around->j = j;
    for (k = 0; k < 9; k++)
        around->items[k] = peak_of_square(i + k % 3 - 1, j + k / 3 - 1, seed);
}

/* 0 on the border between two cells, rising to the height of the cell's peak: Olsen's d2 - d1. */
static float mountain(peaks *around, float x, float z, uint32_t seed)
{
    int32_t i = (int32_t)floorf(x / CELL), j = (int32_t)floorf(z / CELL), k;
    float first = 1e30f, second = 1e30f, height = 0.0f;
    if (i != around->i || j != around->j)
        find_peaks(around, i, j, seed);
    for (k = 0; k < 9; k++) {
        const peak *p = &around->items[k];
        float dx = p->x - x, dz = p->z - z, d = dx * dx + dz * dz;
        if (d < first) {
            second = first;
            first = d;
            height = p->height;
        } else if (d < second) {
            second = d;
        }
    }
    return height * (sqrtf(second) - sqrtf(first)) / CELL;
}

/* ---- The raw land, on the coarse grid ----------------------------------- */

/* One row of the grid; scratch: 3 rows. Wavelengths are in points of the grid. */
static void raise_row(const grid *land, uint32_t z, uint32_t seed, float *scratch)
{
    uint32_t width = land->width, x;
    float *row = land->heights + (size_t)z * width;
    float *warp_x = scratch, *warp_z = scratch + width, *detail = scratch + 2 * (size_t)width;
    peaks around;
    find_peaks(&around, 0, 0, seed);
    noise_row(warp_x, width, z, 64, 4, 0.5f, seed + 100);
    noise_row(warp_z, width, z, 64, 4, 0.5f, seed + 200);
    noise_row(detail, width, z, 128, 2, 0.55f, seed + 300);
    for (x = 0; x < width; x++) {
        float m = mountain(&around, (float)(x * COARSE) + WARP * warp_x[x],
                           (float)(z * COARSE) + WARP * warp_z[x], seed);
        row[x] = HEIGHT * (0.2f + 0.85f * m + (0.2f + 0.3f * m) * detail[x]);
    }
}

/* ---- Erosion by water and by gravity ------------------------------------ */

/* Working memory of the erosion, an item a point. */
typedef struct rain {
    uint32_t *order;  /* the points from the lowest to the highest */
    uint32_t *target; /* where a point's water goes; itself in a pit */
    float *area;      /* how much land drains through it, in points */
} rain;

/* Counting sort by height, in steps of 1/256 wu. */
static void sort_by_height(const grid *land, uint32_t *order, uint32_t *starts)
{
    size_t count = (size_t)land->width * land->depth, i;
    uint32_t sum = 0, level;
    memset(starts, 0, 65536 * sizeof *starts);
    for (i = 0; i < count; i++)
        starts[to_sample(land->heights[i])]++;
    for (level = 0; level < 65536; level++) {
        uint32_t here = starts[level];
        starts[level] = sum;
        sum += here;
    }
    for (i = 0; i < count; i++)
        order[starts[to_sample(land->heights[i])]++] = (uint32_t)i;
}

/* The neighbour that water runs to, or the point itself if none is lower or it lies on the rim. The
   steepest of eight directions would draw straight rills on every slope: chance bends them. */
static uint32_t downhill(const grid *land, uint32_t point)
{
    uint32_t width = land->width, x = point % width, z = point / width, best = point, k;
    float steepest = 0.0f;
    if (x == 0 || z == 0 || x + 1 == width || z + 1 == land->depth)
        return point;
    for (k = 0; k < 9; k++) {
        uint32_t other = point + k % 3 - 1 + (k / 3) * width - width;
        float drop = land->heights[point] - land->heights[other];
        if (drop > 0.0f) {
            drop *= (k % 2 ? 1.0f : 0.7071f) * (0.4f + lattice(x, z, k)); /* odd k: straight */
            if (drop > steepest) {
                steepest = drop;
                best = other;
            }
        }
    }
    return best;
}

/* Lets the water run down, from the highest point to the lowest. */
static void collect_water(const grid *land, rain *r)
{
    size_t count = (size_t)land->width * land->depth, i;
    for (i = 0; i < count; i++)
        r->area[i] = 1.0f;
    for (i = count; i-- > 0;) {
        uint32_t point = r->order[i], target = downhill(land, point);
        r->target[point] = target;
        if (target != point)
            r->area[target] += r->area[point];
    }
}

/* Rivers cut towards the point that they run to: an implicit step from the lowest point upwards,
   so that no river ever cuts below its mouth. */
static void carve(const grid *land, const rain *r)
{
    size_t count = (size_t)land->width * land->depth, i;
    for (i = 0; i < count; i++) {
        uint32_t point = r->order[i];
        float power = CARVING * sqrtf(r->area[point]);
        float *h = land->heights + point;
        *h = (*h + power * land->heights[r->target[point]]) / (1.0f + power);
    }
}

/* Moves material from a sample to the lowest of four neighbours where the slope is too steep. */
static void crumble_sample(float *h, size_t width, float steepest)
{
    float *lowest = h - 1, drop;
    if (h[1] < *lowest)
        lowest = h + 1;
    if (*(h - width) < *lowest)
        lowest = h - width;
    if (h[width] < *lowest)
        lowest = h + width;
    drop = *h - *lowest - steepest;
    if (drop > 0.0f) {
        *h -= 0.5f * drop;
        *lowest += 0.5f * drop;
    }
}

static void crumble(const grid *land, float steepest)
{
    size_t x, z;
    for (z = 1; z + 1 < land->depth; z++)
        for (x = 1; x + 1 < land->width; x++)
            crumble_sample(land->heights + z * land->width + x, land->width, steepest);
}

static int erode(const grid *land)
{
    size_t count = (size_t)land->width * land->depth;
    uint32_t *starts = malloc(65536 * sizeof *starts);
    rain r;
    int pass, ok;
    r.order = malloc(count * sizeof *r.order);
    r.target = malloc(count * sizeof *r.target);
    r.area = malloc(count * sizeof *r.area);
    ok = starts && r.order && r.target && r.area;
    for (pass = 0; ok && pass < RAINS; pass++) {
        sort_by_height(land, r.order, starts);
        collect_water(land, &r);
        carve(land, &r);
        crumble(land, TALUS * COARSE);
    }
    free(r.area);
    free(r.target);
    free(r.order);
    free(starts);
    return ok;
}

/* ---- From the coarse grid to the samples -------------------------------- */

/* Weights of four neighbours for a point at t between the middle two: a cubic B-spline, smooth
   enough that the coarse grid does not show. */
static void spline_weights(float t, float weights[4])
{
    float s = 1.0f - t;
    weights[0] = s * s * s / 6.0f;
    weights[1] = 2.0f / 3.0f - 0.5f * t * t * (2.0f - t);
    weights[2] = 2.0f / 3.0f - 0.5f * s * s * (2.0f - s);
    weights[3] = t * t * t / 6.0f;
}

/* Blends four rows of the coarse grid into one. The grid has a margin of one point on all sides. */
static void blend_rows(const grid *land, uint32_t z, float *blended)
{
    const float *first = land->heights + (size_t)(z / COARSE) * land->width;
    float w[4];
    uint32_t x;
    spline_weights((float)(z % COARSE) / COARSE, w);
    for (x = 0; x < land->width; x++, first++)
        blended[x] = w[0] * first[0] + w[1] * first[land->width]
                     + w[2] * first[2 * (size_t)land->width]
                     + w[3] * first[3 * (size_t)land->width];
}

/* One row of samples: the land, and rocks where it is high. scratch: 2 rows. */
static void sample_row(const grid *land, uint16_t *row, uint32_t width, uint32_t z, uint32_t seed,
                       float *scratch)
{
    float *blended = scratch, *rocks = scratch + width + 2 * COARSE;
    float w[COARSE][4];
    uint32_t x;
    for (x = 0; x < COARSE; x++)
        spline_weights((float)x / COARSE, w[x]);
    blend_rows(land, z, blended);
    noise_row(rocks, width, z, 16, 2, 0.6f, seed + 400);
    for (x = 0; x < width; x++) {
        const float *b = blended + x / COARSE, *k = w[x % COARSE];
        float h = k[0] * b[0] + k[1] * b[1] + k[2] * b[2] + k[3] * b[3];
        float slope = fabsf(b[2] - b[1]) * (1.0f / COARSE);
        row[x] = to_sample(h + rocks[x] * (0.5f + 0.02f * h + 3.0f * slope));
    }
}

static uint16_t *spread(const grid *land, uint32_t width, uint32_t depth, uint32_t seed)
{
    uint16_t *samples = malloc((size_t)width * depth * sizeof *samples);
    float *scratch = malloc(((size_t)width + 2 * COARSE) * 2 * sizeof *scratch);
    uint32_t z;
    if (samples && scratch) {
        for (z = 0; z < depth; z++)
            sample_row(land, samples + (size_t)z * width, width, z, seed, scratch);
    } else {
        free(samples);
        samples = NULL;
    }
    free(scratch);
    return samples;
}

uint16_t *procedural_terrain(uint32_t width, uint32_t depth, uint32_t seed)
{
    uint16_t *samples = NULL;
    float *scratch;
    grid land;
    uint32_t z;
    seed *= 1000; /* room for the seeds of the octaves */
    land.width = width / COARSE + 4;
    land.depth = depth / COARSE + 4;
    land.heights = malloc((size_t)land.width * land.depth * sizeof *land.heights);
    scratch = malloc((size_t)land.width * 3 * sizeof *scratch);
    if (land.heights && scratch) {
        for (z = 0; z < land.depth; z++)
            raise_row(&land, z, seed, scratch);
        if (erode(&land))
            samples = spread(&land, width, depth, seed);
    }
    free(scratch);
    free(land.heights);
    return samples;
}
