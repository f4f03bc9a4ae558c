/* Compares terrimp's simplifier with meshoptimizer on real tiles, chunk by chunk in one run. Errors
   are means in % of a chunk's own height range, over the 65 x 65 chunks without voids and with at
   least 50 m of relief; times are of the processor, in ms a chunk. A border serves two chunks, so
   half of the time for the four borders counts.

   Build:  make bench_simplifier    (with meshoptimizer where that is installed)
   Use:    build/bench_simplifier [directory of .hgt tiles]   (or TERRIMP_DATA; else ../shared/data)
   Leaves: build/bench/simplifier.md (what it prints), simplifier.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_say.h"

#include <math.h>

#ifdef TERRIMP_HAVE_MESHOPT
#include <meshoptimizer.h>
#endif

enum { SIDE = 65, SAMPLES = SIDE * SIDE, BUDGET = 85 };
#define LEAST_RELIEF 50.0f

typedef struct tile {
    float *heights; /* [side][side] */
    int side;
    float spacing_x, spacing_z;
} tile;

/* What one method did over all chunks. */
typedef struct tally {
    double max_percent, rms_percent, ms, triangles;
    int chunks, folded, not_square;
} tally;

static const char *const tile_names[] = {"N42E001.hgt", "N41E001.hgt", "N49E011.hgt",
                                         "N48W125.hgt"};

/* Reads a square tile of big-endian 16-bit metres; voids become NaN. */
static int tile_read(const char *folder, const char *name, tile *out)
{
    char path[1024];
    unsigned char *raw;
    long bytes;
    int i, side;
    FILE *file;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    file = fopen(path, "rb");
    if (!file)
        return 0;
    fseek(file, 0, SEEK_END);
    bytes = ftell(file);
    rewind(file);
    side = (int)(sqrt((double)bytes / 2.0) + 0.5);
    raw = (unsigned char *)malloc((size_t)bytes);
    out->heights = (float *)malloc((size_t)side * (size_t)side * sizeof(float));
    if (!raw || !out->heights || fread(raw, 1, (size_t)bytes, file) != (size_t)bytes) {
        fclose(file);
        free(raw);
        free(out->heights);
        return 0;
    }
    fclose(file);
    for (i = 0; i < side * side; i++) {
        int v = raw[2 * i] << 8 | raw[2 * i + 1];
        out->heights[i] = v == 0x8000 ? NAN : (float)(v > 0x7fff ? v - 0x10000 : v);
    }
    free(raw);
    out->side = side;
    out->spacing_z = 111120.0f / (float)(side - 1);
    out->spacing_x = out->spacing_z * cosf(((float)atoi(name + 1) + 0.5f) * 0.0174532925f);
    return 1;
}

/* Errors and cover of any triangles over the chunk, triangle by triangle and sample by sample:
   knows nothing of how the mesh was made. Where triangles overlap, the worst one counts. */
static void judge(const float *chunk, float relief, const float *xyz, const unsigned *indices,
                  size_t index_count, double ms, tally *sum)
{
    static float error[SAMPLES];
    double squares = 0.0, area = 0.0;
    float worst = 0.0f;
    size_t i;
    int k, folded = 0, seen = 0;
    for (k = 0; k < SAMPLES; k++)
        error[k] = -1.0f;
    for (i = 0; i + 2 < index_count; i += 3) {
        const float *a = xyz + 3 * indices[i], *b = xyz + 3 * indices[i + 1];
        const float *c = xyz + 3 * indices[i + 2];
        float bx = b[0] - a[0], bz = b[2] - a[2], cx = c[0] - a[0], cz = c[2] - a[2];
        float d = bz * cx - bx * cz;
        int x0 = (int)fminf(a[0], fminf(b[0], c[0])), x1 = (int)fmaxf(a[0], fmaxf(b[0], c[0]));
        int z0 = (int)fminf(a[2], fminf(b[2], c[2])), z1 = (int)fmaxf(a[2], fmaxf(b[2], c[2]));
        int x, z;
        area += 0.5 * (double)fabsf(d);
        folded |= d < 0.0f;
        if (d == 0.0f)
            continue;
        for (z = z0; z <= z1; z++)
            for (x = x0; x <= x1; x++) {
                float dx = (float)x - a[0], dz = (float)z - a[2];
                float u = (cx * dz - cz * dx) / d, v = (bz * dx - bx * dz) / d;
                if (u >= -1e-6f && v >= -1e-6f && u + v <= 1.00001f) {
                    float h = a[1] + u * (b[1] - a[1]) + v * (c[1] - a[1]);
                    float e = fabsf(chunk[z * SIDE + x] - h);
                    if (e > error[z * SIDE + x])
                        error[z * SIDE + x] = e;
                }
            }
    }
    for (k = 0; k < SAMPLES; k++)
        if (error[k] >= 0.0f) {
            seen++;
            squares += (double)error[k] * (double)error[k];
            worst = fmaxf(worst, error[k]);
        }
    sum->chunks++;
    sum->folded += folded;
    sum->not_square += seen < SAMPLES || fabs(area - 4096.0) > 0.01;
    sum->max_percent += 100.0 * (double)worst / (double)relief;
    sum->rms_percent += 100.0 * sqrt(squares / seen) / (double)relief;
    sum->triangles += (double)(index_count / 3);
    sum->ms += ms;
}

/* Highest minus lowest sample, or NaN when one is a void. */
static float chunk_relief(const float *chunk)
{
    float low = chunk[0], high = chunk[0];
    int i;
    for (i = 0; i < SAMPLES; i++) {
        if (chunk[i] != chunk[i])
            return NAN;
        low = fminf(low, chunk[i]);
        high = fmaxf(high, chunk[i]);
    }
    return high - low;
}

static float chunk_at(const float *chunk, int x, int z) { return chunk[z * SIDE + x]; }

/* Half of the time for the borders and all of the time for the mesh. */
static void run_terrimp(const float *chunk, float relief, tally *sum)
{
    static int64_t scratch[1 << 17];
    static terrimp_mesh_vertex vertices[1000];
    static uint16_t indices[3000];
    static float xyz[3000];
    static unsigned wide[3000];
    terrimp_border_point points[4][SIDE];
    terrimp_simplify_desc desc;
    terrimp_mesh mesh;
    float line[4][SIDE];
    double start, ms;
    uint32_t i;
    int k;
    memset(&desc, 0, sizeof desc);
    memset(&mesh, 0, sizeof mesh);
    for (k = 0; k < SIDE; k++) {
        line[0][k] = chunk_at(chunk, k, 0);
        line[1][k] = chunk_at(chunk, k, SIDE - 1);
        line[2][k] = chunk_at(chunk, 0, k);
        line[3][k] = chunk_at(chunk, SIDE - 1, k);
    }
    start = clock_cpu_ms();
    desc.heights = chunk;
    desc.cols = desc.rows = SIDE;
    desc.triangle_budget = BUDGET;
    for (k = 0; k < 4; k++) {
        terrimp_border_simplify(line[k], SIDE, 0, points[k], SIDE,
                                &desc.borders[k].point_count);
        desc.borders[k].points = points[k];
    }
    mesh.vertices = vertices;
    mesh.vertex_capacity = 1000;
    mesh.indices = indices;
    mesh.index_capacity = 3000;
    ms = clock_cpu_ms() - start;
    start += 0.5 * ms; /* each border serves two chunks */
    if (terrimp_simplify(&desc, scratch, sizeof scratch, &mesh) != TERRIMP_OK)
        exit(1);
    ms = clock_cpu_ms() - start;
    for (i = 0; i < mesh.vertex_count; i++) {
        xyz[3 * i] = vertices[i].x;
        xyz[3 * i + 1] = vertices[i].height;
        xyz[3 * i + 2] = vertices[i].z;
    }
    for (i = 0; i < mesh.surface_index_count; i++)
        wide[i] = indices[i];
    judge(chunk, relief, xyz, wide, mesh.surface_index_count, ms, sum);
}

#ifdef TERRIMP_HAVE_MESHOPT
static void run_meshopt(const tile *t, const float *chunk, float relief, tally *sum)
{
    static float xyz[3 * SAMPLES], grid[3 * SAMPLES];
    static unsigned indices[6 * 64 * 64], out[6 * 64 * 64];
    size_t n = 0, left;
    double start, ms;
    int x, z;
    for (z = 0; z < SIDE; z++)
        for (x = 0; x < SIDE; x++) {
            float *p = xyz + 3 * (z * SIDE + x), *g = grid + 3 * (z * SIDE + x);
            g[0] = (float)x;
            g[2] = (float)z;
            p[1] = g[1] = chunk_at(chunk, x, z);
            p[0] = g[0] * t->spacing_x;
            p[2] = g[2] * t->spacing_z;
        }
    for (z = 0; z < SIDE - 1; z++)
        for (x = 0; x < SIDE - 1; x++) {
            unsigned a = (unsigned)(z * SIDE + x), b = a + SIDE;
            indices[n++] = a, indices[n++] = b, indices[n++] = b + 1;
            indices[n++] = a, indices[n++] = b + 1, indices[n++] = a + 1;
        }
    start = clock_cpu_ms();
    left = meshopt_simplify(out, indices, n, xyz, SAMPLES, 12, 3 * BUDGET, 1e9f, 0, NULL);
    ms = clock_cpu_ms() - start;
    judge(chunk, relief, grid, out, left, ms, sum);
}
#endif

static void print_tally(const char *name, const tally *sum)
{
    double n = sum->chunks > 0 ? sum->chunks : 1;
    say("| %s | %.2f | %.3f | %d | %d | %.3f | %.1f | %d |\n", name, sum->max_percent / n,
           sum->rms_percent / n, sum->folded, sum->not_square, sum->ms / n, sum->triangles / n,
           sum->chunks);
}

int main(int argc, char **argv)
{
    const char *folder = argc > 1 ? argv[1] : bench_data();
    tally ours, theirs;
    float chunk[SAMPLES];
    size_t i;
    int found = 0;
    say_open("simplifier", 1);
    say_machine(NULL);
    memset(&ours, 0, sizeof ours);
    memset(&theirs, 0, sizeof theirs);
    for (i = 0; i < sizeof tile_names / sizeof *tile_names; i++) {
        tile t;
        int cx, cz, z;
        if (!tile_read(folder, tile_names[i], &t))
            continue;
        found++;
        for (cz = 0; cz + SIDE <= t.side; cz += SIDE - 1)
            for (cx = 0; cx + SIDE <= t.side; cx += SIDE - 1) {
                float relief;
                for (z = 0; z < SIDE; z++)
                    memcpy(chunk + z * SIDE, t.heights + (cz + z) * t.side + cx,
                           SIDE * sizeof(float));
                relief = chunk_relief(chunk);
                if (!(relief >= LEAST_RELIEF))
                    continue;
                run_terrimp(chunk, relief, &ours);
#ifdef TERRIMP_HAVE_MESHOPT
                run_meshopt(&t, chunk, relief, &theirs);
#endif
            }
        free(t.heights);
    }
    if (!found) {
        say("No tiles at %s: skipped\n", folder);
        say_close();
        return 0;
    }
    say("\n| method | max %% | rms %% | folded | not square | ms | triangles | chunks |\n"
        "|---|--:|--:|--:|--:|--:|--:|--:|\n");
    print_tally("terrimp_simplify", &ours);
    if (theirs.chunks) {
        print_tally("meshoptimizer", &theirs);
        say("\nTime in terms of meshoptimizer's: %.3f\n", ours.ms / theirs.ms);
    }
    say_close();
    return 0;
}
