#include "dem.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define VOID_S16 (-32768)

/* Where the samples of a file lie, and how they are written there. */
typedef struct layout {
    size_t offset; /* of the first sample, bytes */
    uint64_t width, depth;
    int format;
    int big_endian;
} layout;

static int fail(dem *d, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(d->error, sizeof d->error, format, arguments);
    va_end(arguments);
    return 0;
}

static size_t sample_bytes(int format)
{
    switch (format) {
    case TERRIMP_FORMAT_U8: return 1;
    case TERRIMP_FORMAT_U16:
    case TERRIMP_FORMAT_S16: return 2;
    default: return 4;
    }
}

/* ---- Reading the three kinds of header ---------------------------------- */

static int ends_with_hgt(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot && (strcmp(dot, ".hgt") == 0 || strcmp(dot, ".HGT") == 0);
}

static int hgt_layout(dem *d, const char *path, size_t size, layout *out)
{
    uint64_t side = 0, bit;
    for (bit = (uint64_t)1 << 20; bit; bit >>= 1) /* the largest side that fits, bit by bit */
        if ((side + bit) * (side + bit) * 2 <= size)
            side += bit;
    if (side < 2 || side * side * 2 != size)
        return fail(d, "%s: %zu bytes are no square of 16-bit samples", path, size);
    out->offset = 0;
    out->width = out->depth = side;
    out->format = TERRIMP_FORMAT_S16;
    out->big_endian = 1;
    return 1;
}

/* A tile spans one degree each way; a name such as N42E001.hgt says at which latitude. */
static void hgt_spacing(dem *d, const char *path, uint32_t side)
{
    const float metres_per_degree = 111133.0f;
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    int latitude = 0;
    char hemisphere = 0;
    d->spacing_z = metres_per_degree / (float)(side - 1);
    d->spacing_x = d->spacing_z;
    if (sscanf(name, "%c%2d", &hemisphere, &latitude) == 2 && latitude >= 0
        && (hemisphere == 'N' || hemisphere == 'S')) {
        float middle = (float)latitude + (hemisphere == 'N' ? 0.5f : -0.5f);
        d->spacing_x *= cosf(middle * 0.01745329f);
    }
}

/* Skips white space and comments; the position of the next other byte, or size. */
static size_t pgm_skip_space(const uint8_t *bytes, size_t size, size_t at)
{
    while (at < size) {
        if (bytes[at] == '#') {
            while (at < size && bytes[at] != '\n')
                at++;
        } else if (!strchr(" \t\r\n\v\f", bytes[at]) || bytes[at] == 0) {
            break;
        } else {
            at++;
        }
    }
    return at;
}

/* Reads a number of at most nine digits, so that it cannot overflow; 0 when there is none. */
static size_t pgm_number(const uint8_t *bytes, size_t size, size_t at, uint64_t *number)
{
    size_t start, digits;
    start = at = pgm_skip_space(bytes, size, at);
    *number = 0;
    while (at < size && bytes[at] >= '0' && bytes[at] <= '9' && at - start < 9)
        *number = *number * 10 + (uint64_t)(bytes[at++] - '0');
    digits = at - start;
    return digits ? at : 0;
}

static int pgm_layout(dem *d, const char *path, const uint8_t *bytes, size_t size, layout *out)
{
    uint64_t numbers[3]; /* width, depth, largest value */
    size_t at = 2;
    int i;
    for (i = 0; i < 3; i++) {
        at = pgm_number(bytes, size, at, &numbers[i]);
        if (!at)
            return fail(d, "%s: malformed PGM header", path);
    }
    if (at >= size || !strchr(" \t\r\n\v\f", bytes[at]) || bytes[at] == 0)
        return fail(d, "%s: malformed PGM header", path);
    if (numbers[2] < 1 || numbers[2] > 65535)
        return fail(d, "%s: the largest value of a PGM must be 1 to 65535", path);
    out->offset = at + 1;
    out->width = numbers[0];
    out->depth = numbers[1];
    out->format = numbers[2] > 255 ? TERRIMP_FORMAT_U16 : TERRIMP_FORMAT_U8;
    out->big_endian = 1;
    return 1;
}

static int raw_layout(dem *d, const char *path, size_t size, const dem_desc *desc, layout *out)
{
    if (desc->raw_format <= 0 || desc->raw_format >= TERRIMP_FORMAT_COUNT
        || !desc->raw_width || !desc->raw_depth)
        return fail(d, "%s: neither .hgt nor PGM: a raw file needs its format and size", path);
    out->offset = 0;
    out->width = desc->raw_width;
    out->depth = desc->raw_depth;
    out->format = desc->raw_format;
    out->big_endian = 0;
    if (out->width <= TERRIMP_MAX_DIM && out->depth <= TERRIMP_MAX_DIM
        && size != out->width * out->depth * sample_bytes(out->format))
        return fail(d, "%s: %zu bytes are not %ux%u samples of %zu bytes", path, size,
                    desc->raw_width, desc->raw_depth, sample_bytes(out->format));
    return 1;
}

static int find_layout(dem *d, const char *path, const uint8_t *bytes, size_t size,
                       const dem_desc *desc, layout *out)
{
    uint64_t need;
    int known;
    if (ends_with_hgt(path))
        known = hgt_layout(d, path, size, out);
    else if (size >= 2 && memcmp(bytes, "P5", 2) == 0 && !desc->raw_format)
        known = pgm_layout(d, path, bytes, size, out);
    else
        known = raw_layout(d, path, size, desc, out);
    if (!known)
        return 0;
    if (out->width < 2 || out->width > TERRIMP_MAX_DIM || out->depth < 2
        || out->depth > TERRIMP_MAX_DIM)
        return fail(d, "%s: %.0fx%.0f samples: each side must be 2 to %u", path,
                    (double)out->width, (double)out->depth, (unsigned)TERRIMP_MAX_DIM);
    need = out->width * out->depth * sample_bytes(out->format); /* < 2^35: no overflow */
    if (size - out->offset < need)
        return fail(d, "%s: %zu bytes of samples where %.0f are needed", path,
                    size - out->offset, (double)need);
    return 1;
}

/* ---- Making samples of the bytes ---------------------------------------- */

static int resolve_crop(dem *d, const char *path, const dem_desc *desc, const layout *file)
{
    uint64_t x = desc->crop_x, z = desc->crop_z;
    uint64_t width = desc->crop_width, depth = desc->crop_depth;
    if (!width && x < file->width)
        width = file->width - x;
    if (!depth && z < file->depth)
        depth = file->depth - z;
    if (width < 2 || depth < 2 || x + width > file->width || z + depth > file->depth)
        return fail(d, "%s: the crop %.0f,%.0f,%.0fx%.0f does not lie in %.0fx%.0f samples", path,
                    (double)x, (double)z, (double)width, (double)depth, (double)file->width,
                    (double)file->depth);
    d->width = (uint32_t)width;
    d->depth = (uint32_t)depth;
    return 1;
}

/* Moves the kept rows to the front of the file's own block: a tile needs no second copy. */
static void gather_rows(uint8_t *bytes, const dem *d, const dem_desc *desc, const layout *file)
{
    size_t sample = sample_bytes(file->format);
    size_t file_row = (size_t)file->width * sample, row = d->width * sample;
    size_t from = file->offset + desc->crop_z * file_row + desc->crop_x * sample;
    size_t z;
    for (z = 0; z < d->depth; z++)
        memmove(bytes + z * row, bytes + from + z * file_row, row);
}

static void make_native_16(uint8_t *bytes, size_t count, int big_endian)
{
    size_t i, high = big_endian ? 0 : 1;
    for (i = 0; i < count; i++, bytes += 2) {
        uint16_t value = (uint16_t)(bytes[high] << 8 | bytes[1 - high]);
        memcpy(bytes, &value, 2);
    }
}

static void make_native_32(uint8_t *bytes, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++, bytes += 4) {
        uint32_t value = (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16
                         | (uint32_t)bytes[3] << 24;
        memcpy(bytes, &value, 4);
    }
}

/* Looks for samples without data, and refuses infinite heights. */
static int scan_samples(dem *d, const char *path)
{
    size_t count = (size_t)d->width * d->depth, i;
    if (d->format == TERRIMP_FORMAT_S16) {
        const int16_t *samples = d->samples;
        for (i = 0; i < count && !d->has_voids; i++)
            d->has_voids = samples[i] == VOID_S16;
    } else if (d->format == TERRIMP_FORMAT_F32) {
        const float *samples = d->samples;
        for (i = 0; i < count; i++) {
            if (samples[i] != samples[i])
                d->has_voids = 1;
            else if (samples[i] - samples[i] != 0.0f)
                return fail(d, "%s: sample %zu,%zu is infinite", path, i % d->width, i / d->width);
        }
    }
    return 1;
}

static int parse(dem *d, const char *path, size_t size, const dem_desc *desc)
{
    layout file = { 0, 0, 0, 0, 0 };
    size_t count;
    if (!find_layout(d, path, d->samples, size, desc, &file)
        || !resolve_crop(d, path, desc, &file))
        return 0;
    d->format = file.format;
    d->spacing_x = d->spacing_z = 1.0f;
    if (ends_with_hgt(path))
        hgt_spacing(d, path, (uint32_t)file.width);
    gather_rows(d->samples, d, desc, &file);
    count = (size_t)d->width * d->depth;
    if (sample_bytes(d->format) == 2)
        make_native_16(d->samples, count, file.big_endian);
    else if (d->format == TERRIMP_FORMAT_F32)
        make_native_32(d->samples, count);
    return scan_samples(d, path);
}

int dem_parse(dem *d, const char *path, uint8_t *bytes, size_t size, const dem_desc *desc)
{
    void *shrunk;
    memset(d, 0, sizeof *d);
    d->samples = bytes;
    if (!parse(d, path, size, desc)) {
        free(d->samples);
        d->samples = NULL;
        return 0;
    }
    shrunk = realloc(d->samples, (size_t)d->width * d->depth * sample_bytes(d->format));
    if (shrunk)
        d->samples = shrunk;
    return 1;
}

/* ---- Files -------------------------------------------------------------- */

/* The length of an open file, or -1 for what has none: a pipe, a directory. */
static long file_length(FILE *file)
{
    long length;
    if (fseek(file, 0, SEEK_END) != 0)
        return -1;
    length = ftell(file);
    rewind(file);
    return length;
}

static uint8_t *read_file(dem *d, const char *path, FILE *file, size_t *size)
{
    /* The largest terrain, 4 bytes a sample, and some header: nothing longer is a terrain. */
    const uint64_t limit = (uint64_t)TERRIMP_MAX_DIM * TERRIMP_MAX_DIM * 4u + 65536u;
    long length = file_length(file);
    uint8_t *bytes;
    if (length < 0 || (uint64_t)length > limit || (uint64_t)length > (size_t)-1) {
        fail(d, "%s: not a file, or too large for a terrain", path);
        return NULL;
    }
    *size = (size_t)length;
    bytes = malloc(*size + 1);
    if (!bytes) {
        fail(d, "%s: no memory for %zu bytes", path, *size);
    } else if (fread(bytes, 1, *size, file) != *size) {
        free(bytes);
        bytes = NULL;
        fail(d, "%s: cannot be read to its end", path);
    }
    return bytes;
}

int dem_load(dem *d, const char *path, const dem_desc *desc)
{
    FILE *file = fopen(path, "rb");
    uint8_t *bytes;
    size_t size = 0;
    memset(d, 0, sizeof *d);
    if (!file)
        return fail(d, "%s: %s", path, strerror(errno));
    bytes = read_file(d, path, file, &size);
    fclose(file);
    return bytes ? dem_parse(d, path, bytes, size, desc) : 0;
}

terrimp_heightfield dem_heightfield(const dem *d)
{
    terrimp_heightfield field;
    memset(&field, 0, sizeof field);
    field.samples = d->samples;
    field.width = d->width;
    field.depth = d->depth;
    field.format = d->format;
    field.spacing_x = d->spacing_x;
    field.spacing_z = d->spacing_z;
    field.has_no_data = d->has_voids;
    field.no_data = (float)VOID_S16;
    return field;
}

size_t dem_fill_voids(dem *d, const char **trouble)
{
    terrimp_heightfield field = dem_heightfield(d);
    size_t filled = 0;
    size_t bytes = terrimp_heightfield_fill_voids_scratch_bytes(d->width, d->depth);
    void *scratch = malloc(bytes);
    terrimp_result result = TERRIMP_E_MEMORY;
    if (scratch)
        result = terrimp_heightfield_fill_voids(&field, d->samples, scratch, bytes, &filled);
    free(scratch);
    *trouble = result == TERRIMP_OK ? NULL : terrimp_result_text((int)result);
    if (result == TERRIMP_OK)
        d->has_voids = 0;
    return filled;
}

void dem_free(dem *d)
{
    free(d->samples);
    memset(d, 0, sizeof *d);
}
