/* Elevation in TIFF files, with GeoTIFF's scale of pixels and GDAL's no-data value. */
#include "dem_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifndef HOST_TIFF

int dem_read_tiff(dem *d, dem_file *f)
{
    return dem_fail(d, "%s: this program was built without libtiff", f->path);
}

#else

#include <tiffio.h>

enum { PIXEL_SCALE = 33550, TIE_POINT = 33922, GEO_KEYS = 34735, NO_DATA = 42113 };

/* What lies in the file: one band of samples, whole or as the first of several. */
typedef struct band {
    TIFF *tiff;
    uint16_t bits, kind, bands, planes;
    uint32_t tile_width, tile_depth; /* 0: strips */
    size_t sample, pixel;            /* bytes of one sample, and from one to the next */
} band;

/* ---- The file as libtiff sees it ---------------------------------------- */

typedef struct stream {
    const dem_file *file;
    uint64_t at;
} stream;

static tmsize_t give_bytes(thandle_t user, void *out, tmsize_t count)
{
    stream *s = (stream *)user;
    uint64_t left = s->at < s->file->size ? s->file->size - s->at : 0;
    if ((uint64_t)count > left)
        count = (tmsize_t)left;
    memcpy(out, s->file->bytes + s->at, (size_t)count);
    s->at += (uint64_t)count;
    return count;
}

static tmsize_t take_no_bytes(thandle_t user, void *bytes, tmsize_t count)
{
    (void)user;
    (void)bytes;
    (void)count;
    return -1;
}

static toff_t seek_byte(thandle_t user, toff_t offset, int whence)
{
    stream *s = (stream *)user;
    if (whence == SEEK_CUR)
        offset += s->at;
    else if (whence == SEEK_END)
        offset += s->file->size;
    return s->at = offset;
}

static int close_nothing(thandle_t user)
{
    (void)user;
    return 0;
}

static toff_t tell_size(thandle_t user)
{
    return ((stream *)user)->file->size;
}

/* The tags of GeoTIFF and GDAL that are read here. */
static void add_tags(TIFF *tiff)
{
    static char scale[] = "ModelPixelScale", tie[] = "ModelTiepoint", keys[] = "GeoKeyDirectory",
                no_data[] = "GDAL_NODATA";
    static const TIFFFieldInfo tags[] = {
        { PIXEL_SCALE, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, scale },
        { TIE_POINT, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, tie },
        { GEO_KEYS, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, keys },
        { NO_DATA, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, no_data }
    };
    TIFFMergeFieldInfo(tiff, tags, 4);
}

static TIFF *open_tiff(stream *s)
{
    TIFFSetErrorHandler(NULL);
    TIFFSetWarningHandler(NULL);
    TIFFSetTagExtender(add_tags);
    return TIFFClientOpen("elevation", "rm", (thandle_t)s, give_bytes, take_no_bytes, seek_byte,
                          close_nothing, tell_size, NULL, NULL);
}

/* ---- What kind of samples ----------------------------------------------- */

/* The format in which samples are kept; 0 for kinds that are no elevation. */
static int kept_format(const band *b)
{
    switch (b->kind << 8 | b->bits) {
    case SAMPLEFORMAT_UINT << 8 | 8: return TERRIMP_FORMAT_U8;
    case SAMPLEFORMAT_UINT << 8 | 16: return TERRIMP_FORMAT_U16;
    case SAMPLEFORMAT_INT << 8 | 16: return TERRIMP_FORMAT_S16;
    case SAMPLEFORMAT_INT << 8 | 8:
    case SAMPLEFORMAT_UINT << 8 | 32:
    case SAMPLEFORMAT_INT << 8 | 32:
    case SAMPLEFORMAT_IEEEFP << 8 | 32:
    case SAMPLEFORMAT_IEEEFP << 8 | 64: return TERRIMP_FORMAT_F32;
    default: return 0;
    }
}

static float as_float(const band *b, const uint8_t *sample)
{
    union { int8_t s8; uint32_t u32; int32_t s32; float f32; double f64; } value;
    memcpy(&value, sample, b->sample);
    switch (b->kind << 8 | b->bits) {
    case SAMPLEFORMAT_INT << 8 | 8: return value.s8;
    case SAMPLEFORMAT_UINT << 8 | 32: return (float)value.u32;
    case SAMPLEFORMAT_INT << 8 | 32: return (float)value.s32;
    case SAMPLEFORMAT_IEEEFP << 8 | 32: return value.f32;
    default: return value.f64 > 3.4e38 ? INFINITY : value.f64 < -3.4e38 ? -INFINITY
                                                                        : (float)value.f64;
    }
}

static const char *describe(band *b, dem_file *f)
{
    uint32_t width = 0, depth = 0;
    uint16_t photometric = PHOTOMETRIC_MINISBLACK;
    TIFFGetField(b->tiff, TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(b->tiff, TIFFTAG_IMAGELENGTH, &depth);
    TIFFGetFieldDefaulted(b->tiff, TIFFTAG_BITSPERSAMPLE, &b->bits);
    TIFFGetFieldDefaulted(b->tiff, TIFFTAG_SAMPLEFORMAT, &b->kind);
    TIFFGetFieldDefaulted(b->tiff, TIFFTAG_SAMPLESPERPIXEL, &b->bands);
    TIFFGetFieldDefaulted(b->tiff, TIFFTAG_PLANARCONFIG, &b->planes);
    TIFFGetField(b->tiff, TIFFTAG_PHOTOMETRIC, &photometric);
    if (TIFFIsTiled(b->tiff)) {
        TIFFGetField(b->tiff, TIFFTAG_TILEWIDTH, &b->tile_width);
        TIFFGetField(b->tiff, TIFFTAG_TILELENGTH, &b->tile_depth);
    }
    if (b->kind == SAMPLEFORMAT_VOID)
        b->kind = SAMPLEFORMAT_UINT;
    f->width = width;
    f->depth = depth;
    f->format = kept_format(b);
    b->sample = b->bits / 8u;
    b->pixel = b->planes == PLANARCONFIG_CONTIG ? b->sample * b->bands : b->sample;
    if (photometric != PHOTOMETRIC_MINISBLACK && photometric != PHOTOMETRIC_MINISWHITE)
        return "a picture in colours is no elevation";
    return f->format ? NULL : "samples of a kind that is no elevation";
}

/* ---- Samples ------------------------------------------------------------ */

/* Stores samples of one row of the file, from column x on. */
static void keep_row(const band *b, const dem_file *f, const uint8_t *from, uint64_t x, uint64_t z,
                     size_t count, uint8_t *samples)
{
    size_t kept = dem_sample_bytes(f->format), i;
    uint8_t *to = samples + (size_t)(z * f->width + x) * kept;
    for (i = 0; i < count; i++, from += b->pixel, to += kept) {
        float value;
        if (f->format != TERRIMP_FORMAT_F32) {
            memcpy(to, from, kept);
            continue;
        }
        value = as_float(b, from);
        memcpy(to, &value, kept);
    }
}

/* Strips are read row by row, for they may be as large as the file. */
static int read_strips(const band *b, const dem_file *f, uint8_t *samples)
{
    tmsize_t bytes = TIFFScanlineSize(b->tiff);
    uint8_t *row = bytes >= (tmsize_t)(f->width * b->pixel) ? malloc((size_t)bytes) : NULL;
    uint32_t z;
    int ok = row != NULL;
    for (z = 0; ok && z < f->depth; z++) {
        ok = TIFFReadScanline(b->tiff, row, z, 0) == 1;
        if (ok)
            keep_row(b, f, row, 0, z, (size_t)f->width, samples);
    }
    free(row);
    return ok;
}

static int read_tiles(const band *b, const dem_file *f, uint8_t *samples)
{
    const tmsize_t most = (tmsize_t)1 << 28;
    tmsize_t bytes = TIFFTileSize(b->tiff);
    uint64_t x, z, row;
    uint8_t *tile;
    int ok;
    if (bytes <= 0 || bytes > most
        || (uint64_t)bytes < (uint64_t)b->tile_width * b->tile_depth * b->pixel)
        return 0;
    tile = malloc((size_t)bytes);
    ok = tile != NULL;
    for (z = 0; ok && z < f->depth; z += b->tile_depth)
        for (x = 0; ok && x < f->width; x += b->tile_width) {
            uint64_t count = f->width - x < b->tile_width ? f->width - x : b->tile_width;
            ok = TIFFReadTile(b->tiff, tile, (uint32_t)x, (uint32_t)z, 0, 0) > 0;
            for (row = 0; ok && row < b->tile_depth && z + row < f->depth; row++)
                keep_row(b, f, tile + (size_t)(row * b->tile_width) * b->pixel, x, z + row,
                         (size_t)count, samples);
        }
    free(tile);
    return ok;
}

/* ---- Where it lies ------------------------------------------------------ */

/* The value of a GeoTIFF key that is a number of its own, or 0. */
static unsigned geo_key(TIFF *tiff, unsigned key)
{
    const uint16_t *keys;
    uint16_t count = 0, i;
    if (!TIFFGetField(tiff, GEO_KEYS, &count, &keys))
        return 0;
    for (i = 4; i + 3 < count; i = (uint16_t)(i + 4))
        if (keys[i] == key && keys[i + 1] == 0)
            return keys[i + 3];
    return 0;
}

static void find_spacing(TIFF *tiff, dem_file *f)
{
    enum { MODEL_TYPE = 1024, GEOGRAPHIC = 2 };
    const double *scale, *tie;
    uint16_t count = 0;
    unsigned model = geo_key(tiff, MODEL_TYPE);
    double north = 0.0;
    if (!TIFFGetField(tiff, PIXEL_SCALE, &count, &scale) || count < 2 || !(scale[0] > 0.0)
        || !(scale[1] > 0.0) || scale[0] > 1e9 || scale[1] > 1e9)
        return;
    f->spacing_x = scale[0];
    f->spacing_z = scale[1];
    if (TIFFGetField(tiff, TIE_POINT, &count, &tie) && count >= 6)
        north = tie[4] + tie[1] * f->spacing_z;
    if (model == GEOGRAPHIC || (model == 0 && f->spacing_z < 0.05 && fabs(north) <= 91.0))
        dem_degrees_to_metres(f, north - 0.5 * f->spacing_z * (double)f->depth);
}

static void find_no_data(TIFF *tiff, dem_file *f)
{
    const char *text = NULL;
    char *end;
    if (!TIFFGetField(tiff, NO_DATA, &text) || !text)
        return;
    f->no_data = strtod(text, &end);
    f->has_no_data = end != text;
}

int dem_read_tiff(dem *d, dem_file *f)
{
    stream s;
    band b;
    uint8_t *samples;
    const char *trouble;
    memset(&s, 0, sizeof s);
    memset(&b, 0, sizeof b);
    s.file = f;
    b.tiff = open_tiff(&s);
    if (!b.tiff)
        return dem_fail(d, "%s: a malformed TIFF", f->path);
    trouble = describe(&b, f);
    /* Hardly any terrain, however flat, is packed tighter than this. */
    if (!trouble && f->width * f->depth / 65536u > f->size)
        trouble = "the file is cut short";
    if (trouble || !dem_check_sides(d, f)) {
        TIFFClose(b.tiff);
        return trouble ? dem_fail(d, "%s: %s", f->path, trouble) : 0;
    }
    find_spacing(b.tiff, f);
    find_no_data(b.tiff, f);
    samples = dem_make_room(d, f);
    if (samples && !(b.tile_width ? read_tiles : read_strips)(&b, f, samples)) {
        free(samples);
        samples = NULL;
        dem_fail(d, "%s: a TIFF that is cut short, or packed in a way not known here", f->path);
    }
    TIFFClose(b.tiff);
    if (samples)
        dem_take_room(f, samples);
    return samples != NULL;
}

#endif
