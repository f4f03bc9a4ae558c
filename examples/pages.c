/* Shows how to make a terrain in pages from samples that are larger than memory: from a folder of
   SRTM tiles, or from a formula. What has been made stays: start it again after it was stopped, or
   build parts of the file by as many processes as there are (make -j, a job array), then all.
   Build:  cc -O2 -std=c99 -I. examples/pages.c -lm -lpthread -o pages
   Use:    pages OUT FOLDER | pages OUT --made SIDE   [--threads N] [--part I,N] [--block LEVEL]
           FOLDER holds N42E001.hgt and so on; SIDE is in samples; --part 0,4 makes the first of
           four parts of the blocks, and no header
   Expect: a line of progress; the size of the file, and the memory that it took. */
#define _XOPEN_SOURCE 700
#define _FILE_OFFSET_BITS 64
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

enum { VOID = -32768, MOST_THREADS = 64 };

typedef struct source {
    const char *folder;           /* NULL: made by a formula */
    int north, west;              /* degrees: of the first tile */
    uint32_t across, down, side;  /* tiles, and samples along a side of one */
    char *voids;                  /* of each tile: 1 has some, 2 has none */
    int16_t *tile;                /* one of those with voids, filled: */
    const char *tile_of;          /* ... that of this place of voids */
    int file;
    pthread_mutex_t lock;         /* one tile at a time is filled */
    terrimp_pages_desc desc;
    size_t scratch_bytes;
    uint32_t next, end, made, all; /* blocks */
    terrimp_result result;
} source;

/* ---- samples ---- */

/* A number of 0..1 for a point of a grid. */
static float grain(uint32_t x, uint32_t z)
{
    uint32_t h = x * 374761393u + z * 668265263u;
    h = (h ^ (h >> 13)) * 1274126177u;
    return (float)((h ^ (h >> 16)) >> 8) * (1.0f / 16777216.0f);
}

/* Hills of all sizes: noise of seven grids, each twice as wide and high as the one before. */
static int16_t formula(uint32_t x, uint32_t z)
{
    float height = 0.0f, size = 12.0f;
    uint32_t shift;
    for (shift = 2; shift < 9u; shift++, size *= 2.0f) {
        float u = (float)(x & ((1u << shift) - 1u)) / (float)(1u << shift);
        float v = (float)(z & ((1u << shift) - 1u)) / (float)(1u << shift);
        uint32_t i = x >> shift, j = z >> shift;
        float a = grain(i, j), b = grain(i + 1u, j), c = grain(i, j + 1u);
        float d = grain(i + 1u, j + 1u);
        u = u * u * (3.0f - 2.0f * u);
        v = v * v * (3.0f - 2.0f * v);
        a += (b - a) * u;
        c += (d - c) * u;
        height += size * (a + (c - a) * v);
    }
    return (int16_t)height;
}

/* Opens the tile in column i, row j; returns -1 when there is none. */
static int open_tile(const source *s, uint32_t i, uint32_t j)
{
    char path[1024];
    int lat = s->north - (int)j, lon = s->west + (int)i;
    snprintf(path, sizeof path, "%s/%c%02d%c%03d.hgt", s->folder, lat < 0 ? 'S' : 'N', abs(lat),
             lon < 0 ? 'W' : 'E', abs(lon));
    return open(path, O_RDONLY);
}

static void turn_bytes(int16_t *samples, size_t count)
{
    unsigned char *b = (unsigned char *)samples;
    size_t i;
    for (i = 0; i < count; i++, b += 2)
        samples[i] = (int16_t)(b[0] << 8 | b[1]);
}

/* Fills the voids of a line between those that are known: both tiles that share it do the same. A
   corner that is void is 0. */
static void fill_line(int16_t *line, uint32_t count, size_t step)
{
    uint32_t i, k, from = 0;
    for (i = 0; i < count; i += count - 1u)
        if (line[i * step] == VOID)
            line[i * step] = 0;
    for (i = 1; i < count; i++) {
        int16_t a = line[from * step], b = line[i * step];
        if (b == VOID)
            continue;
        for (k = from + 1u; k < i; k++)
            line[k * step] = (int16_t)(a + (b - a) * (int)(k - from) / (int)(i - from));
        from = i;
    }
}

/* Reads a whole tile and fills its voids: first its sides, from themselves alone. Returns 0 when
   something fails. */
static int fill_tile(const source *s, int file, int16_t *tile, void *scratch, size_t bytes)
{
    size_t count = (size_t)s->side * s->side, last = s->side - 1u;
    terrimp_heightfield f;
    memset(&f, 0, sizeof f);
    f.samples = tile;
    f.width = f.depth = s->side;
    f.format = TERRIMP_FORMAT_S16;
    f.has_no_data = 1;
    f.no_data = VOID;
    if (pread(file, tile, count * 2u, 0) != (ssize_t)(count * 2u))
        return 0;
    turn_bytes(tile, count);
    fill_line(tile, s->side, 1);
    fill_line(tile + last * s->side, s->side, 1);
    fill_line(tile, s->side, s->side);
    fill_line(tile + last, s->side, s->side);
    return terrimp_heightfield_fill_voids(&f, tile, scratch, bytes, NULL) == TERRIMP_OK;
}

/* Copies what a rectangle has of one tile. Only tiles with voids are read as a whole. */
static int read_tile(source *s, uint32_t i, uint32_t j, const terrimp_rect *r, int16_t *out,
                     size_t row)
{
    uint32_t step = s->side - 1u, x0 = i * step, z0 = j * step, z, x1, z1, x;
    size_t bytes = terrimp_heightfield_fill_voids_scratch_bytes(s->side, s->side);
    size_t count = (size_t)s->side * s->side;
    int file = open_tile(s, i, j), ok = 1;
    int16_t *tile;
    char *voids = &s->voids[j * s->across + i];
    if (file < 0)
        return 1; /* the sea */
    x = r->x > x0 ? r->x : x0;
    x1 = r->x + r->width < x0 + s->side ? r->x + r->width : x0 + s->side;
    z1 = r->y + r->height < z0 + s->side ? r->y + r->height : z0 + s->side;
    pthread_mutex_lock(&s->lock);
    tile = s->tile;
    if (*voids != 2 && s->tile_of != voids) {
        tile = s->tile = tile ? tile : malloc(count * 2u);
        s->tile_of = NULL;
        ok = tile && pread(file, tile, count * 2u, 0) == (ssize_t)(count * 2u);
        for (z = 0; ok && *voids == 0 && z < count; z++) {
            const unsigned char *b = (const unsigned char *)(tile + z);
            *voids = b[0] == 0x80 && b[1] == 0;
        }
        if (*voids == 0) {
            *voids = 2;
        } else {
            void *scratch = malloc(bytes);
            ok = ok && scratch && fill_tile(s, file, tile, scratch, bytes);
            s->tile_of = ok ? voids : NULL;
            free(scratch);
        }
    }
    for (z = r->y > z0 ? r->y : z0; ok && z < z1; z++) {
        int16_t *to = (int16_t *)(void *)((char *)out + (z - r->y) * row) + (x - r->x);
        size_t at = (size_t)(z - z0) * s->side + (x - x0);
        if (*voids == 1) {
            memcpy(to, tile + at, (x1 - x) * 2u);
        } else {
            ok = pread(file, to, (x1 - x) * 2u, (off_t)(at * 2u)) == (ssize_t)((x1 - x) * 2u);
            turn_bytes(to, x1 - x);
        }
    }
    pthread_mutex_unlock(&s->lock);
    close(file);
    return ok;
}

static int read_samples(void *user, uint32_t x, uint32_t z, uint32_t cols, uint32_t rows,
                        void *samples, size_t row_bytes)
{
    source *s = user;
    terrimp_rect r = {x, z, cols, rows};
    uint32_t i, j, step = s->side - 1u;
    for (j = 0; j < rows; j++) {
        int16_t *row = (int16_t *)(void *)((char *)samples + j * row_bytes);
        for (i = 0; i < cols; i++)
            row[i] = s->folder ? 0 : formula(x + i, z + j);
    }
    for (j = s->folder ? 0 : s->down; j < s->down; j++)
        for (i = 0; i < s->across; i++)
            if (i * step < x + cols && x <= (i + 1u) * step && j * step < z + rows &&
                z <= (j + 1u) * step && !read_tile(s, i, j, &r, samples, row_bytes))
                return 0;
    return 1;
}

/* ---- pages ---- */

static int load_page(void *user, uint64_t offset, void *bytes, size_t count)
{
    return pread(((source *)user)->file, bytes, count, (off_t)offset) == (ssize_t)count;
}

static int store_page(void *user, uint64_t offset, const void *bytes, size_t count)
{
    return pwrite(((source *)user)->file, bytes, count, (off_t)offset) == (ssize_t)count;
}

static void *build_blocks(void *shared)
{
    source *s = shared;
    void *scratch = malloc(s->scratch_bytes);
    terrimp_result result = scratch ? TERRIMP_OK : TERRIMP_E_MEMORY;
    for (;;) {
        uint32_t block = UINT32_MAX;
        pthread_mutex_lock(&s->lock);
        if (result != TERRIMP_OK)
            s->result = result;
        if (s->result == TERRIMP_OK && s->next < s->end)
            block = s->next++;
        pthread_mutex_unlock(&s->lock);
        if (block == UINT32_MAX)
            break;
        if (terrimp_pages_check_block(&s->desc, block, scratch, s->scratch_bytes) != TERRIMP_OK)
            result = terrimp_pages_build_block(&s->desc, block, scratch, s->scratch_bytes);
        pthread_mutex_lock(&s->lock);
        printf("\rblock %u of %u", (unsigned)++s->made, (unsigned)s->all);
        fflush(stdout);
        pthread_mutex_unlock(&s->lock);
    }
    free(scratch);
    return NULL;
}

/* Finds which degrees there are tiles for, and how large they are. */
static int find_tiles(source *s)
{
    int lat, lon, south = 90, east = -181;
    source any = *s;
    s->north = -91;
    s->west = 181;
    for (lat = -90; lat < 90; lat++)
        for (lon = -180; lon < 180; lon++) {
            int file;
            any.north = lat, any.west = lon;
            file = open_tile(&any, 0, 0);
            if (file < 0)
                continue;
            s->side = lseek(file, 0, SEEK_END) == 2 * 1201 * 1201 ? 1201u : 3601u;
            close(file);
            s->north = lat > s->north ? lat : s->north;
            south = lat < south ? lat : south;
            s->west = lon < s->west ? lon : s->west;
            east = lon > east ? lon : east;
        }
    if (s->side == 0)
        return 0;
    s->across = (uint32_t)(east - s->west + 1);
    s->down = (uint32_t)(s->north - south + 1);
    s->voids = calloc(s->across, s->down);
    return s->voids != NULL;
}

int main(int argc, char **argv)
{
    static source s;
    pthread_t thread[MOST_THREADS];
    const char *out = argc > 1 ? argv[1] : NULL;
    uint32_t threads = 1, part = 0, parts = 0, side = 0;
    struct rusage usage;
    terrimp_pages_info info;
    uint64_t from, bytes = 0;
    void *scratch;
    int i;
    for (i = 2; i < argc; i++)
        if (strcmp(argv[i], "--made") == 0 && argv[i + 1])
            side = (uint32_t)atoi(argv[++i]);
        else if (strcmp(argv[i], "--threads") == 0 && argv[i + 1])
            threads = (uint32_t)atoi(argv[++i]);
        else if (strcmp(argv[i], "--block") == 0 && argv[i + 1])
            s.desc.block_level = (uint32_t)atoi(argv[++i]);
        else if (strcmp(argv[i], "--part") == 0 && argv[i + 1] &&
                 sscanf(argv[i + 1], "%u,%u", &part, &parts) == 2)
            i++;
        else
            s.folder = argv[i];
    if (!out || threads < 1u || threads > MOST_THREADS || (parts > 0 && part >= parts) ||
        (s.folder ? !find_tiles(&s) : side < 2u)) {
        fprintf(stderr, "pages: OUT FOLDER | OUT --made SIDE; see the first lines of pages.c\n");
        return 2;
    }
    pthread_mutex_init(&s.lock, NULL);
    s.desc.terrain.field.width = s.folder ? s.across * (s.side - 1u) + 1u : side;
    s.desc.terrain.field.depth = s.folder ? s.down * (s.side - 1u) + 1u : side;
    s.desc.terrain.field.format = TERRIMP_FORMAT_S16;
    s.desc.terrain.height_low = -500.0f;
    s.desc.terrain.height_high = 9000.0f;
    s.desc.user = &s;
    s.desc.read = read_samples;
    s.desc.load = load_page;
    s.desc.store = store_page;
    s.file = open(out, O_RDWR | O_CREAT, 0666);
    s.scratch_bytes = terrimp_pages_scratch_bytes(&s.desc);
    if (s.file < 0 || s.scratch_bytes == 0 ||
        terrimp_pages_desc_resolve(&s.desc, &s.desc, &s.all) != TERRIMP_OK) {
        fprintf(stderr, "pages: %s: cannot be made\n", out);
        return 2;
    }
    s.next = parts ? (uint32_t)((uint64_t)s.all * part / parts) : 0u;
    s.end = parts ? (uint32_t)((uint64_t)s.all * (part + 1u) / parts) : s.all;
    s.all = s.end - s.next;
    for (i = 0; i < (int)threads; i++)
        pthread_create(&thread[i], NULL, build_blocks, &s);
    for (i = 0; i < (int)threads; i++)
        pthread_join(thread[i], NULL);
    scratch = malloc(s.scratch_bytes);
    if (s.result == TERRIMP_OK && !parts)
        s.result = terrimp_pages_build_end(&s.desc, scratch, s.scratch_bytes);
    if (s.result == TERRIMP_OK) /* of a part: there is no header yet */
        s.result = terrimp_pages_place(&s.desc, s.end - s.all, s.all, &from, &bytes);
    memset(&info, 0, sizeof info);
    if (s.result == TERRIMP_OK && !parts && pread(s.file, scratch, 8192, 0) == 8192)
        s.result = terrimp_pages_check(scratch, 8192, &info);
    free(scratch);
    free(s.voids);
    free(s.tile);
    getrusage(RUSAGE_SELF, &usage);
    printf("\n%s: %s, %u x %u samples, %.1f MB of pages, %.1f MiB of memory\n", out,
           terrimp_result_text(s.result), (unsigned)s.desc.terrain.field.width,
           (unsigned)s.desc.terrain.field.depth, (double)(parts ? bytes : info.bytes) * 1e-6,
           (double)usage.ru_maxrss / 1024.0);
    return s.result != TERRIMP_OK;
}
