#include "dem_parts.h"

#include <ctype.h>
#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define VOID_S16 (-32768)
#define METRES_PER_DEGREE 111133.0

int dem_fail(dem *d, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(d->error, sizeof d->error, format, arguments);
    va_end(arguments);
    return 0;
}

size_t dem_sample_bytes(int format)
{
    switch (format) {
    case TERRIMP_FORMAT_U8: return 1;
    case TERRIMP_FORMAT_U16:
    case TERRIMP_FORMAT_S16: return 2;
    default: return 4;
    }
}

int dem_check_sides(dem *d, const dem_file *f)
{
    if (f->width >= 2 && f->width <= TERRIMP_MAX_DIM && f->depth >= 2
        && f->depth <= TERRIMP_MAX_DIM)
        return 1;
    return dem_fail(d, "%s: %.0fx%.0f samples: each side must be 2 to %u", f->path,
                    (double)f->width, (double)f->depth, (unsigned)TERRIMP_MAX_DIM);
}

void *dem_make_room(dem *d, const dem_file *f)
{
    uint64_t need = f->width * f->depth * dem_sample_bytes(f->format); /* < 2^35 */
    void *room = need <= (size_t)-1 ? malloc((size_t)need) : NULL;
    if (!room)
        dem_fail(d, "%s: no memory for %.0fx%.0f samples", f->path, (double)f->width,
                 (double)f->depth);
    return room;
}

void dem_take_room(dem_file *f, void *samples)
{
    free(f->bytes);
    f->bytes = samples;
    f->size = (size_t)(f->width * f->depth) * dem_sample_bytes(f->format);
    f->offset = f->row_bytes = 0;
    f->order = DEM_NATIVE;
}

void dem_degrees_to_metres(dem_file *f, double latitude)
{
    f->spacing_x *= METRES_PER_DEGREE * cos(latitude * 0.017453292519943295);
    f->spacing_z *= METRES_PER_DEGREE;
}

/* Without regard to case; the name ends in a dot and this. */
static int has_suffix(const char *path, const char *suffix)
{
    const char *dot = strrchr(path, '.');
    if (!dot || strlen(dot + 1) != strlen(suffix))
        return 0;
    for (dot++; *dot; dot++, suffix++)
        if (tolower((unsigned char)*dot) != *suffix)
            return 0;
    return 1;
}

/* The side of a square of so many samples, or 0 when they are none. */
static uint64_t side_of_square(uint64_t count)
{
    uint64_t side = 0, bit;
    for (bit = (uint64_t)1 << 20; bit; bit >>= 1) /* the largest side that fits, bit by bit */
        if ((side + bit) * (side + bit) <= count)
            side += bit;
    return side * side == count ? side : 0;
}

/* ---- .hgt --------------------------------------------------------------- */

/* Where a tile lies and how much of the globe it spans [degrees]. */
typedef struct hgt_place {
    double latitude, span;
} hgt_place;

/* Digits, and behind x or a dot two or three more of a fraction; what follows, or null. */
static const char *read_degrees(const char *text, int digits, double *degrees, double *fraction)
{
    double unit = 0.1;
    for (*degrees = 0.0; digits > 0; digits--, text++) {
        if (!isdigit((unsigned char)*text))
            return NULL;
        *degrees = *degrees * 10.0 + (*text - '0');
    }
    if ((*text != 'x' && *text != '.') || !isdigit((unsigned char)text[1])
        || !isdigit((unsigned char)text[2]))
        return text;
    for (*fraction = 0.0, text++; isdigit((unsigned char)*text); text++, unit *= 0.1)
        *fraction += (*text - '0') * unit;
    return text;
}

static int is_multiple(double value, double of)
{
    return fabs(value / of - floor(value / of + 0.5)) < 0.05;
}

/* N42E001, n42_e001, or n42x25_w106x50: whole degrees name the south-west corner of a degree,
   ninths that of a ninth, quarters the north-west corner of a quarter. */
static int read_place(const char *name, hgt_place *place)
{
    double degrees, longitude, north = -1.0, east = -1.0;
    const char *rest;
    int south = tolower((unsigned char)name[0]) == 's';
    if (!south && tolower((unsigned char)name[0]) != 'n')
        return 0;
    rest = read_degrees(name + 1, 2, &degrees, &north);
    if (!rest || degrees > 90.0)
        return 0;
    rest += *rest == '_';
    if (tolower((unsigned char)*rest) != 'e' && tolower((unsigned char)*rest) != 'w')
        return 0;
    if (!read_degrees(rest + 1, 3, &longitude, &east))
        return 0;
    place->span = 1.0;
    if (north >= 0.0 && east >= 0.0)
        place->span = is_multiple(north, 0.25) && is_multiple(east, 0.25) ? 0.25 : 1.0 / 9.0;
    degrees += north > 0.0 ? north : 0.0;
    degrees = south ? -degrees : degrees;
    place->latitude = degrees + (place->span == 0.25 ? -0.5 : 0.5) * place->span;
    return 1;
}

/* From anywhere in the file's name; without a place the tile lies at the equator. */
static hgt_place find_place(const char *path)
{
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    hgt_place place = { 0.0, 1.0 };
    for (; *name; name++)
        if (read_place(name, &place))
            break;
    return place;
}

/* Rows of tiles in the far north are thinned: by two thirds, a half, a third, a fifth, a tenth. */
static int thinned_sides(uint64_t count, dem_file *f)
{
    static const unsigned depths[] = { 1201, 3601, 6001, 10801 };
    static const unsigned parts[][2] = { { 2, 3 }, { 1, 2 }, { 1, 3 }, { 1, 5 }, { 1, 10 } };
    size_t i, k;
    for (i = 0; i < sizeof depths / sizeof *depths; i++)
        for (k = 0; k < sizeof parts / sizeof *parts; k++) {
            f->depth = depths[i];
            f->width = (f->depth - 1) * parts[k][0] / parts[k][1] + 1;
            if (f->width * f->depth == count)
                return 1;
        }
    return 0;
}

static int hgt_layout(dem *d, dem_file *f)
{
    hgt_place place = find_place(f->path);
    f->width = f->depth = side_of_square(f->size / 2);
    if (f->size % 2 || ((f->width < 2) && !thinned_sides(f->size / 2, f)))
        return dem_fail(d, "%s: %zu bytes are no square of 16-bit samples", f->path, f->size);
    f->format = TERRIMP_FORMAT_S16;
    f->order = DEM_BIG_ENDIAN;
    f->spacing_x = place.span / (double)(f->width - 1);
    f->spacing_z = place.span / (double)(f->depth - 1);
    dem_degrees_to_metres(f, place.latitude);
    return 1;
}

/* ---- PGM ---------------------------------------------------------------- */

static int is_space(const uint8_t *bytes, size_t size, size_t at)
{
    return at < size && bytes[at] != 0 && strchr(" \t\r\n\v\f", bytes[at]) != NULL;
}

static size_t skip_comment(const uint8_t *bytes, size_t size, size_t at)
{
    while (at < size && bytes[at] != '\n' && bytes[at] != '\r')
        at++;
    return at;
}

size_t dem_pgm_number(const uint8_t *bytes, size_t size, size_t at, uint64_t *number)
{
    size_t start;
    for (;;) {
        if (is_space(bytes, size, at))
            at++;
        else if (at < size && bytes[at] == '#')
            at = skip_comment(bytes, size, at);
        else
            break;
    }
    *number = 0;
    for (start = at; at < size && isdigit(bytes[at]) && at - start < 9; at++)
        *number = *number * 10 + (uint64_t)(bytes[at] - '0');
    return at > start ? at : 0;
}

/* Behind the white space at `at`; CR LF is one end of a line. */
static size_t skip_line_end(const dem_file *f, size_t at)
{
    int pair = f->bytes[at] == '\r' && at + 1 < f->size && f->bytes[at + 1] == '\n';
    return at + 1 + (size_t)pair;
}

/* Where the samples begin, `at` being the end of the header's last number. One byte of white space
   is the rule; some write two, CR LF, or a comment. Of places that could be meant the one counts
   from which the samples fill the file. 0: none is there. */
static size_t pgm_samples_at(const dem_file *f, size_t at)
{
    size_t exact = f->size - (size_t)(f->width * f->depth) * dem_sample_bytes(f->format);
    size_t end = at, line = 0, places[4] = { 0, 0, 0, 0 }, i;
    while (end < f->size && (f->bytes[end] == ' ' || f->bytes[end] == '\t'))
        end++;
    if (end < f->size && f->bytes[end] == '#')
        end = skip_comment(f->bytes, f->size, end);
    if (is_space(f->bytes, f->size, end)) {
        places[0] = end + 1;
        places[1] = line = skip_line_end(f, end);
    }
    if (is_space(f->bytes, f->size, at)) {
        places[2] = at + 1;
        places[3] = line = skip_line_end(f, at);
    }
    for (i = 0; i < 4; i++)
        if (places[i] == exact && exact)
            return exact;
    return line;
}

static int pgm_layout(dem *d, dem_file *f)
{
    uint64_t numbers[3] = { 0, 0, 0 }; /* width, depth, largest value */
    size_t at = 2;
    int i;
    for (i = 0; i < 3; i++) {
        at = dem_pgm_number(f->bytes, f->size, at, &numbers[i]);
        if (!at)
            return dem_fail(d, "%s: malformed PGM header", f->path);
    }
    if (numbers[2] < 1 || numbers[2] > 65535)
        return dem_fail(d, "%s: the largest value of a PGM must be 1 to 65535", f->path);
    f->width = numbers[0];
    f->depth = numbers[1];
    f->format = numbers[2] > 255 ? TERRIMP_FORMAT_U16 : TERRIMP_FORMAT_U8;
    f->order = DEM_BIG_ENDIAN;
    if (!dem_check_sides(d, f))
        return 0;
    if (f->bytes[1] == '2')
        return dem_read_plain_pgm(d, f, at, numbers[2]);
    f->offset = pgm_samples_at(f, at);
    return f->offset ? 1 : dem_fail(d, "%s: malformed PGM header", f->path);
}

/* ---- Raw samples -------------------------------------------------------- */

/* What names promise; of .raw nothing is known but that most hold U16. */
static int format_by_name(const dem_file *f)
{
    static const struct { const char *suffix; int format; } names[] = {
        { "r16", TERRIMP_FORMAT_U16 }, { "u16", TERRIMP_FORMAT_U16 },
        { "s16", TERRIMP_FORMAT_S16 }, { "r8", TERRIMP_FORMAT_U8 }, { "u8", TERRIMP_FORMAT_U8 },
        { "r32", TERRIMP_FORMAT_F32 }, { "f32", TERRIMP_FORMAT_F32 }
    };
    size_t i;
    for (i = 0; i < sizeof names / sizeof *names; i++)
        if (has_suffix(f->path, names[i].suffix))
            return names[i].format;
    return has_suffix(f->path, "raw") ? TERRIMP_FORMAT_COUNT : 0;
}

static int format_by_size(const dem_desc *desc, size_t size)
{
    uint64_t count = (uint64_t)desc->raw_width * desc->raw_depth;
    if (desc->raw_width ? count * 2 == size : size % 2 == 0 && side_of_square(size / 2))
        return TERRIMP_FORMAT_U16;
    if (desc->raw_width && count * 4 == size)
        return TERRIMP_FORMAT_F32;
    return TERRIMP_FORMAT_U8;
}

static int raw_layout(dem *d, dem_file *f, const dem_desc *desc)
{
    size_t size = f->size - desc->skip_bytes, sample;
    uint64_t row, need;
    f->format = desc->raw_format ? desc->raw_format : format_by_name(f);
    if (f->format <= 0 || f->format > TERRIMP_FORMAT_COUNT)
        return dem_fail(d, "%s: of no known kind: a raw file needs its format", f->path);
    if (desc->skip_bytes > f->size)
        return dem_fail(d, "%s: has only %zu bytes", f->path, f->size);
    if (f->format == TERRIMP_FORMAT_COUNT)
        f->format = format_by_size(desc, size);
    sample = dem_sample_bytes(f->format);
    f->width = desc->raw_width;
    f->depth = desc->raw_depth;
    if (!f->width && desc->stride_bytes) {
        f->width = desc->stride_bytes / sample;
        f->depth = size / desc->stride_bytes;
    } else if (!f->width) {
        f->width = f->depth = size % sample ? 0 : side_of_square(size / sample);
        if (!f->width)
            return dem_fail(d, "%s: %zu bytes are no square: a raw file needs its size", f->path,
                            size);
    }
    if (!dem_check_sides(d, f))
        return 0;
    row = desc->stride_bytes ? desc->stride_bytes : f->width * sample;
    need = row * (f->depth - 1) + f->width * sample;
    if (row < f->width * sample || (size != need && size != row * f->depth))
        return dem_fail(d, "%s: %zu bytes are not %.0fx%.0f samples of %zu bytes, %.0f a row",
                        f->path, size, (double)f->width, (double)f->depth, sample, (double)row);
    f->offset = desc->skip_bytes;
    f->row_bytes = (size_t)row;
    f->order = desc->big_endian ? DEM_BIG_ENDIAN : DEM_LITTLE_ENDIAN;
    d->is_raw = 1;
    return 1;
}

/* ---- Which kind it is --------------------------------------------------- */

static int starts_with(const dem_file *f, const char *bytes, size_t count)
{
    return f->size >= count && memcmp(f->bytes, bytes, count) == 0;
}

/* A TIFF of either byte order, small or big. */
static int is_tiff(const dem_file *f)
{
    return starts_with(f, "II*\0", 4) || starts_with(f, "MM\0*", 4)
           || starts_with(f, "II+\0", 4) || starts_with(f, "MM\0+", 4);
}

static int is_esri(const dem_file *f)
{
    char word[6] = { 0 };
    size_t at = 0, i;
    while (is_space(f->bytes, f->size, at))
        at++;
    for (i = 0; i < 5 && at + i < f->size; i++)
        word[i] = (char)tolower(f->bytes[at + i]);
    return strcmp(word, "ncols") == 0 || strcmp(word, "nrows") == 0;
}

static int find_samples(dem *d, dem_file *f, const dem_desc *desc)
{
    if (desc->raw_format)
        return raw_layout(d, f, desc);
    if (starts_with(f, "\x89PNG\r\n\x1a\n", 8))
        return dem_read_png(d, f);
    if (is_tiff(f))
        return dem_read_tiff(d, f);
    if (has_suffix(f->path, "hgt"))
        return hgt_layout(d, f);
    if (format_by_name(f))
        return raw_layout(d, f, desc);
    if (starts_with(f, "P5", 2) || starts_with(f, "P2", 2))
        return pgm_layout(d, f);
    if (is_esri(f))
        return dem_read_esri(d, f);
    return raw_layout(d, f, desc);
}

static int find_layout(dem *d, dem_file *f, const dem_desc *desc)
{
    uint64_t need;
    if (!find_samples(d, f, desc) || !dem_check_sides(d, f))
        return 0;
    if (!f->row_bytes)
        f->row_bytes = (size_t)f->width * dem_sample_bytes(f->format);
    need = f->row_bytes * (f->depth - 1) + f->width * dem_sample_bytes(f->format);
    if (f->size - f->offset < need)
        return dem_fail(d, "%s: %zu bytes of samples where %.0f are needed", f->path,
                        f->size - f->offset, (double)need);
    return 1;
}

/* ---- Making samples of the bytes ---------------------------------------- */

static int resolve_crop(dem *d, const dem_desc *desc, const dem_file *f)
{
    uint64_t x = desc->crop_x, z = desc->crop_z;
    uint64_t width = desc->crop_width, depth = desc->crop_depth;
    if (!width && x < f->width)
        width = f->width - x;
    if (!depth && z < f->depth)
        depth = f->depth - z;
    if (width < 2 || depth < 2 || x + width > f->width || z + depth > f->depth)
        return dem_fail(d, "%s: the crop %.0f,%.0f,%.0fx%.0f does not lie in %.0fx%.0f samples",
                        f->path, (double)x, (double)z, (double)width, (double)depth,
                        (double)f->width, (double)f->depth);
    d->width = (uint32_t)width;
    d->depth = (uint32_t)depth;
    return 1;
}

/* Moves the kept rows to the front of the file's own block: a tile needs no second copy. */
static void gather_rows(const dem *d, const dem_desc *desc, const dem_file *f)
{
    size_t sample = dem_sample_bytes(f->format), row = d->width * sample;
    size_t from = f->offset + desc->crop_z * f->row_bytes + desc->crop_x * sample;
    size_t z;
    for (z = 0; z < d->depth; z++)
        memmove(f->bytes + z * row, f->bytes + from + z * f->row_bytes, row);
}

static void make_native_16(uint8_t *bytes, size_t count, int order)
{
    size_t i, high = order == DEM_BIG_ENDIAN ? 0 : 1;
    for (i = 0; i < count; i++, bytes += 2) {
        uint16_t value = (uint16_t)(bytes[high] << 8 | bytes[1 - high]);
        memcpy(bytes, &value, 2);
    }
}

static void make_native_32(uint8_t *bytes, size_t count, int order)
{
    size_t i, k;
    for (i = 0; i < count; i++, bytes += 4) {
        uint32_t value = 0;
        for (k = 0; k < 4; k++)
            value = value << 8 | bytes[order == DEM_BIG_ENDIAN ? k : 3 - k];
        memcpy(bytes, &value, 4);
    }
}

/* Terrain is smooth: with its bytes swapped it is not. */
static const char *remark_on_order(const dem *d)
{
    const uint16_t *samples = d->samples;
    uint64_t as_read = 0, swapped = 0;
    size_t count = (size_t)d->width * d->depth, i;
    for (i = 1; i < count; i++) {
        unsigned a = samples[i - 1], b = samples[i];
        unsigned c = (a << 8 | a >> 8) & 0xffffu, e = (b << 8 | b >> 8) & 0xffffu;
        as_read += a < b ? b - a : a - b;
        swapped += c < e ? e - c : c - e;
    }
    return swapped < as_read / 4 ? "the samples look as if their bytes were in the other order"
                                 : NULL;
}

/* What is no data becomes the one void of its format. */
static void mark_voids(dem *d, float no_data)
{
    size_t count = (size_t)d->width * d->depth, i;
    for (i = 0; i < count; i++) {
        if (d->format == TERRIMP_FORMAT_U8)
            d->has_voids |= ((const uint8_t *)d->samples)[i] == no_data;
        else if (d->format == TERRIMP_FORMAT_U16)
            d->has_voids |= ((const uint16_t *)d->samples)[i] == no_data;
        else if (d->format == TERRIMP_FORMAT_S16 && ((int16_t *)d->samples)[i] == no_data)
            ((int16_t *)d->samples)[i] = VOID_S16;
        else if (d->format == TERRIMP_FORMAT_F32 && ((float *)d->samples)[i] == no_data)
            ((float *)d->samples)[i] = NAN;
    }
    if (d->format == TERRIMP_FORMAT_U8 || d->format == TERRIMP_FORMAT_U16)
        d->no_data = no_data;
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
                return dem_fail(d, "%s: sample %zu,%zu is infinite", path, i % d->width,
                                i / d->width);
        }
    }
    return 1;
}

static int parse(dem *d, dem_file *f, const dem_desc *desc)
{
    size_t count;
    if (!find_layout(d, f, desc) || !resolve_crop(d, desc, f))
        return 0;
    d->format = f->format;
    d->no_data = VOID_S16;
    d->has_units = f->spacing_x > 0.0 && f->spacing_z > 0.0;
    d->spacing_x = d->has_units ? (float)f->spacing_x : 1.0f;
    d->spacing_z = d->has_units ? (float)f->spacing_z : 1.0f;
    gather_rows(d, desc, f);
    d->samples = f->bytes;
    count = (size_t)d->width * d->depth;
    if (dem_sample_bytes(d->format) == 2 && f->order != DEM_NATIVE)
        make_native_16(f->bytes, count, f->order);
    else if (d->format == TERRIMP_FORMAT_F32 && f->order != DEM_NATIVE)
        make_native_32(f->bytes, count, f->order);
    if (d->is_raw && d->format == TERRIMP_FORMAT_U16)
        d->remark = remark_on_order(d);
    if (desc->has_no_data)
        mark_voids(d, desc->no_data);
    else if (f->has_no_data && (isinf(f->no_data) || fabs(f->no_data) <= (double)FLT_MAX))
        mark_voids(d, (float)f->no_data);
    return scan_samples(d, f->path);
}

int dem_parse(dem *d, const char *path, uint8_t *bytes, size_t size, const dem_desc *desc)
{
    dem_file f;
    void *shrunk;
    memset(d, 0, sizeof *d);
    memset(&f, 0, sizeof f);
    f.path = path;
    f.bytes = bytes;
    f.size = size;
    if (!parse(d, &f, desc)) {
        free(f.bytes);
        d->samples = NULL;
        return 0;
    }
    shrunk = realloc(d->samples, (size_t)d->width * d->depth * dem_sample_bytes(d->format));
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
    /* The largest terrain, as text: nothing longer is one. */
    const uint64_t limit = (uint64_t)TERRIMP_MAX_DIM * TERRIMP_MAX_DIM * 32u;
    long length = file_length(file);
    uint8_t *bytes;
    if (length < 0 || (uint64_t)length > limit || (uint64_t)length > (size_t)-1) {
        dem_fail(d, "%s: not a file, or too large for a terrain", path);
        return NULL;
    }
    *size = (size_t)length;
    bytes = malloc(*size + 1);
    if (!bytes) {
        dem_fail(d, "%s: no memory for %zu bytes", path, *size);
    } else if (fread(bytes, 1, *size, file) != *size) {
        free(bytes);
        bytes = NULL;
        dem_fail(d, "%s: cannot be read to its end", path);
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
        return dem_fail(d, "%s: %s", path, strerror(errno));
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
    field.no_data = d->no_data;
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
