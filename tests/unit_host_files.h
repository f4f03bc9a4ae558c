/* Tests of the elevation files of the examples, of every kind: random samples, written in all the
   ways in which others write them, come back. Included by unit_host.c. */
#include "examples/host/tour.h"

#include <png.h>
#include <stdarg.h>

/* A grid of random samples, and a file of them that is being written. */
enum { GRID = 24, FILE_BYTES = 1 << 16 };
typedef struct grid {
    uint32_t width, depth;
    long values[GRID * GRID];
    uint8_t bytes[FILE_BYTES];
    size_t size;
} grid;

static void make_grid(grid *g, long low, long high)
{
    uint32_t i;
    g->width = random_range(2, GRID);
    g->depth = random_range(2, GRID);
    g->size = 0;
    for (i = 0; i < g->width * g->depth; i++)
        g->values[i] = low + (long)(random_bits() % (unsigned long)(high - low + 1));
}

static void put(grid *g, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    g->size += (size_t)vsnprintf((char *)g->bytes + g->size, FILE_BYTES - g->size, format,
                                 arguments);
    va_end(arguments);
}

static void put_sample(grid *g, uint32_t value, int bytes, int big_endian)
{
    int i;
    for (i = 0; i < bytes; i++)
        g->bytes[g->size++] = (uint8_t)(value >> 8 * (big_endian ? bytes - 1 - i : i));
}

static double sample_of(const dem *d, size_t i)
{
    switch (d->format) {
    case TERRIMP_FORMAT_U8: return ((const uint8_t *)d->samples)[i];
    case TERRIMP_FORMAT_U16: return ((const uint16_t *)d->samples)[i];
    case TERRIMP_FORMAT_S16: return ((const int16_t *)d->samples)[i];
    default: return (double)((const float *)d->samples)[i];
    }
}

static int holds_grid(const dem *d, const grid *g, int format)
{
    size_t i;
    if (d->width != g->width || d->depth != g->depth || d->format != format || d->has_voids)
        return 0;
    for (i = 0; i < (size_t)g->width * g->depth; i++)
        if (sample_of(d, i) != (double)g->values[i])
            return 0;
    return 1;
}

static int reads_back(grid *g, const char *name, int format, const dem_desc *desc)
{
    dem d;
    int ok = load(&d, name, g->bytes, g->size, desc) && holds_grid(&d, g, format);
    if (!ok)
        fprintf(stderr, "%s, %ux%u: %s\n", name, g->width, g->depth, d.error);
    dem_free(&d);
    return ok;
}

/* ---- PGM ---------------------------------------------------------------- */

/* What may stand between two numbers of a header, and what may end it. */
static const char *random_gap(void)
{
    static const char *const gaps[] = { " ", "\n", "\t", "\r\n", "  ", "# c\n", " # c d\r\n",
                                        "\n#a\n#b\n" };
    return gaps[random_range(0, 7)];
}

static const char *random_end(void)
{
    static const char *const ends[] = { "\n", " ", "\r\n", "\t", "# feep\n", " # feep\n",
                                        "#\r\n", "\r" };
    return ends[random_range(0, 7)];
}

static void a_binary_pgm_reads_whatever_ends_its_lines(void)
{
    static grid g;
    int round;
    for (round = 0; round < 2000; round++) {
        int wide = round % 2;
        uint32_t i;
        make_grid(&g, 0, wide ? 65535 : 255);
        put(&g, "P5%s%u%s%u%s%d%s", random_gap(), g.width, random_gap(), g.depth, random_gap(),
            wide ? 65535 : 255, random_end());
        for (i = 0; i < g.width * g.depth; i++)
            put_sample(&g, (uint32_t)g.values[i], wide ? 2 : 1, 1);
        CHECK(reads_back(&g, "a.pgm", wide ? TERRIMP_FORMAT_U16 : TERRIMP_FORMAT_U8, &whole));
    }
}

/* Samples may begin with bytes that look like the end of a line or a comment. */
static void a_pgm_may_be_followed_by_more(void)
{
    static const char crlf[] = "P5\r\n2 2\r\n65535\r\n\1\2\3\4\5\6\7\10\n";
    static const char hash[] = "P5 3 2 255 #bcdef\n";
    static const char lf[] = "P5 3 2 255\n\nbcdef";
    static const char cr[] = "P5 2 2 65535\r\n\1\2\3\4\5\6\7";
    dem d;
    CHECK(load(&d, "a.pgm", crlf, sizeof crlf - 1, &whole) && sample_of(&d, 0) == 0x102);
    dem_free(&d);
    CHECK(load(&d, "a.pgm", hash, sizeof hash - 1, &whole) && sample_of(&d, 0) == '#');
    dem_free(&d);
    CHECK(load(&d, "a.pgm", lf, sizeof lf - 1, &whole) && sample_of(&d, 0) == '\n');
    dem_free(&d);
    CHECK(load(&d, "a.pgm", cr, sizeof cr - 1, &whole) && sample_of(&d, 0) == 0xa01);
    dem_free(&d);
}

static void a_plain_pgm_reads_as_written(void)
{
    static grid g;
    int round;
    for (round = 0; round < 500; round++) {
        int wide = round % 2;
        uint32_t i;
        make_grid(&g, 0, wide ? 1000 : 255);
        put(&g, "P2%s%u%s%u%s%d", random_gap(), g.width, random_gap(), g.depth, random_gap(),
            wide ? 1000 : 255);
        for (i = 0; i < g.width * g.depth; i++)
            put(&g, "%s%ld", random_gap(), g.values[i]);
        if (round % 3)
            put(&g, "%s", random_gap());
        CHECK(reads_back(&g, "a.pgm", wide ? TERRIMP_FORMAT_U16 : TERRIMP_FORMAT_U8, &whole));
    }
}

/* ---- Raw samples -------------------------------------------------------- */

static void raw_samples_read_in_either_order_with_gaps(void)
{
    static grid g;
    int round;
    for (round = 0; round < 2000; round++) {
        static const long lows[] = { 0, 0, -32767 }, highs[] = { 255, 65535, 32767 };
        int format = TERRIMP_FORMAT_U8 + round % 3, bytes = format == TERRIMP_FORMAT_U8 ? 1 : 2;
        uint32_t gap = random_range(0, 9), x, z, i;
        dem_desc desc = whole;
        make_grid(&g, lows[round % 3], highs[round % 3]);
        desc.raw_format = format;
        desc.raw_width = g.width;
        desc.raw_depth = g.depth;
        desc.big_endian = round / 3 % 2;
        desc.skip_bytes = random_range(0, 20);
        desc.stride_bytes = gap ? g.width * (uint32_t)bytes + gap : 0;
        for (i = 0; i < desc.skip_bytes; i++)
            put_sample(&g, random_bits(), 1, 0);
        for (z = 0; z < g.depth; z++) {
            for (x = 0; x < g.width; x++)
                put_sample(&g, (uint32_t)g.values[z * g.width + x], bytes, desc.big_endian);
            for (i = 0; i < gap && (z + 1 < g.depth || round % 4); i++)
                put_sample(&g, random_bits(), 1, 0);
        }
        CHECK(reads_back(&g, "a.bin", format, &desc));
        g.size--;
        if (!gap) {
            desc.stride_bytes = g.width * (uint32_t)bytes - 1;
            CHECK(refused("a.bin", g.bytes, g.size, &desc));
        }
    }
}

static void a_square_raw_file_needs_only_its_name(void)
{
    static const struct { const char *name; int format, bytes; } kinds[] = {
        { "a.r16", TERRIMP_FORMAT_U16, 2 }, { "a.RAW", TERRIMP_FORMAT_U16, 2 },
        { "a.s16", TERRIMP_FORMAT_S16, 2 }, { "a.r8", TERRIMP_FORMAT_U8, 1 },
        { "a.raw", TERRIMP_FORMAT_U8, 1 }
    };
    static grid g;
    size_t kind;
    uint32_t i;
    for (kind = 0; kind < sizeof kinds / sizeof *kinds; kind++) {
        make_grid(&g, 0, 255);
        g.width = g.depth = 13;
        for (i = 0; i < 13 * 13; i++)
            put_sample(&g, (uint32_t)g.values[i], kinds[kind].bytes, 0);
        CHECK(reads_back(&g, kinds[kind].name, kinds[kind].format, &whole));
        CHECK(refused(kinds[kind].name, g.bytes, g.size - 1, &whole));
        CHECK(refused("a.unknown", g.bytes, g.size, &whole));
    }
}

/* A slope, in the wrong order of bytes, is a saw. */
static void swapped_bytes_are_remarked(void)
{
    uint8_t bytes[20 * 20 * 2];
    dem_desc desc = whole;
    dem d;
    int i;
    for (i = 0; i < 400; i++) {
        bytes[2 * i] = (uint8_t)((1000 + 7 * (i % 20)) >> 8);
        bytes[2 * i + 1] = (uint8_t)((1000 + 7 * (i % 20)) & 255);
    }
    CHECK(load(&d, "a.r16", bytes, sizeof bytes, &whole) && d.remark && !strchr(d.remark, '\n'));
    dem_free(&d);
    desc.big_endian = 1;
    CHECK(load(&d, "a.r16", bytes, sizeof bytes, &desc) && !d.remark);
    dem_free(&d);
}

/* ---- No data ------------------------------------------------------------ */

static void no_data_of_every_format_is_filled(void)
{
    static grid g;
    int format;
    for (format = TERRIMP_FORMAT_U8; format <= TERRIMP_FORMAT_F32; format++) {
        int bytes = format == TERRIMP_FORMAT_U8 ? 1 : format == TERRIMP_FORMAT_F32 ? 4 : 2;
        dem_desc desc = whole;
        const char *trouble;
        uint32_t i, voids = 0;
        size_t k;
        dem d;
        make_grid(&g, 1, 3);
        g.values[0] = 1; /* one void and one sample at least */
        g.values[1] = 3;
        for (i = 0; i < g.width * g.depth; i++) {
            float value = (float)g.values[i];
            uint32_t bits = (uint32_t)g.values[i];
            voids += g.values[i] == 3;
            if (format == TERRIMP_FORMAT_F32)
                memcpy(&bits, &value, 4);
            put_sample(&g, bits, bytes, 0);
        }
        desc.raw_format = format;
        desc.raw_width = g.width;
        desc.raw_depth = g.depth;
        desc.has_no_data = 1;
        desc.no_data = 3.0f;
        CHECK(load(&d, "a.raw", g.bytes, g.size, &desc) && d.has_voids);
        CHECK(dem_fill_voids(&d, &trouble) == voids && !trouble);
        for (k = 0; k < (size_t)g.width * g.depth; k++)
            CHECK(sample_of(&d, k) >= 1.0 && sample_of(&d, k) < 3.0);
        dem_free(&d);
        desc.no_data = 7.0f;
        CHECK(load(&d, "a.raw", g.bytes, g.size, &desc) && !d.has_voids);
        dem_free(&d);
    }
}

/* ---- Spacing ------------------------------------------------------------ */

static int has_spacing(const char *name, uint32_t width, uint32_t depth, double x, double z)
{
    size_t size = (size_t)width * depth * 2;
    uint8_t *bytes = calloc(size, 1);
    dem d;
    int ok;
    memset(&d, 0, sizeof d);
    ok = bytes && dem_parse(&d, name, bytes, size, &whole) && d.width == width
         && d.depth == depth && d.has_units && fabs((double)d.spacing_x - x) < 0.002 * x
         && fabs((double)d.spacing_z - z) < 0.002 * z;
    if (!ok)
        fprintf(stderr, "%s: %g %g instead of %g %g %s\n", name, (double)d.spacing_x,
                (double)d.spacing_z, x, z, d.error);
    dem_free(&d);
    return ok;
}

static void an_hgt_has_the_spacing_of_its_latitude(void)
{
    const double second = 111133.0 / 3600.0, at_42 = cos(42.5 * 0.017453292519943295);
    const double at_61 = cos(61.5 * 0.017453292519943295);
    static const char *const names[] = { "N42E001.hgt", "n42e001.hgt", "a/b.c/N42E001.HGT",
        "n42_e001_1arc_v3.hgt", "N42E001.SRTMGL1.hgt", "srtm_N42W101.Hgt", "S43E001.hgt",
        "s43w001 (1).hgt", "NASADEM_HGT_n42e001.hgt" };
    size_t i;
    for (i = 0; i < sizeof names / sizeof *names; i++)
        CHECK(has_spacing(names[i], 1201, 1201, 3.0 * second * at_42, 3.0 * second));
    CHECK(has_spacing("N42E001.hgt", 3601, 3601, second * at_42, second));
    CHECK(has_spacing("N42E001.hgt", 6001, 6001, 0.6 * second * at_42, 0.6 * second));
    CHECK(has_spacing("N61E001.hgt", 1801, 3601, 2.0 * second * at_61, second));
    CHECK(has_spacing("N61E001.hgt", 601, 1201, 6.0 * second * at_61, 3.0 * second));
    CHECK(has_spacing("n42x50_w106x25.hgt", 901, 901, second * 0.7378, second));
    CHECK(has_spacing("N42.11E001.22.hgt", 401, 401, second * 0.7415, second));
    CHECK(has_spacing("nowhere.hgt", 1201, 1201, 3.0 * second, 3.0 * second));
}

/* ---- ESRI grids --------------------------------------------------------- */

static void an_esri_grid_reads_as_written(void)
{
    static grid g;
    int round;
    for (round = 0; round < 500; round++) {
        int upper = round % 2, geographic = round / 2 % 2, voids = round / 4 % 2;
        double cell = geographic ? 0.001 : 25.0, north;
        uint32_t i;
        dem d;
        make_grid(&g, -500, 4000);
        put(&g, "%s %u\r\n%s %u\n", upper ? "NCOLS" : "ncols", g.width,
            upper ? "NROWS" : "nrows", g.depth);
        put(&g, "xllcorner %g\nyllcenter %g\n", geographic ? 1.5 : 4e5, geographic ? 42.0 : 5e6);
        if (round % 3)
            put(&g, "cellsize    %g\n", cell);
        else
            put(&g, "dx %g\ndy %g\n", cell, cell);
        if (voids)
            put(&g, "NODATA_value -9999\n");
        for (i = 0; i < g.width * g.depth; i++)
            put(&g, i % 3 ? "%ld.0%s" : "%ld%s", voids && i == 1 ? -9999 : g.values[i],
                (i + 1) % g.width ? " " : "\n");
        CHECK(load(&d, "a.asc", g.bytes, g.size, &whole) && d.has_voids == voids && d.has_units);
        north = 42.0 + 0.5 * cell * g.depth;
        CHECK(fabs((double)d.spacing_z - (geographic ? 111.133 : 25.0)) < 0.01);
        CHECK(fabs((double)d.spacing_x - (geographic ? 111.133 * cos(north / 57.29578) : 25.0))
              < 0.01);
        if (voids)
            ((float *)d.samples)[1] = (float)g.values[1], d.has_voids = 0;
        CHECK(holds_grid(&d, &g, TERRIMP_FORMAT_F32));
        dem_free(&d);
    }
}

static void a_malformed_esri_grid_is_refused(void)
{
    static const char *const wrong[] = {
        "ncols 2", "ncols 2\nnrows 2\n1 2 3", "ncols 2\nnrows 2\n1 2 3 4 5",
        "ncols 2\nnrows 2\n1 2 3 x", "ncols 2\nnrows 2\nwhat 3\n1 2 3 4",
        "ncols -2\nnrows 2\n1 2 3 4", "ncols 1\nnrows 4\n1 2 3 4", "ncols nan\nnrows 2\n1 2",
        "ncols 60000\nnrows 60000\n1 2 3 4", "ncols 2\nnrows 2\n1 2 3 inf",
        "ncols 2\nnrows 2\n1 2 3 1e39", "nrows 2\nncols 99999999999\n1 2 3 4", "ncols", "ncols 2x",
        "ncols 2\nnrows 2\nnan nan nan 0x7"
    };
    size_t i;
    for (i = 0; i < sizeof wrong / sizeof *wrong; i++)
        CHECK(refused("a.asc", wrong[i], strlen(wrong[i]), &whole));
}

/* ---- PNG ---------------------------------------------------------------- */

static void take_png_bytes(png_structp png, png_bytep bytes, size_t count)
{
    grid *g = png_get_io_ptr(png);
    memcpy(g->bytes + g->size, bytes, count);
    g->size += count;
}

static void write_png(grid *g, int bits, int colour, int interlaced)
{
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    int channels = colour == PNG_COLOR_TYPE_GRAY ? 1 : colour == PNG_COLOR_TYPE_GRAY_ALPHA ? 2 : 3;
    static uint8_t pixels[GRID * GRID * 6];
    png_bytep rows[GRID];
    uint32_t i;
    int c;
    for (i = 0; i < g->width * g->depth; i++)
        for (c = 0; c < channels; c++) {
            uint8_t *to = pixels + (i * (uint32_t)channels + (uint32_t)c) * ((uint32_t)bits / 8);
            to[0] = (uint8_t)(bits == 16 ? g->values[i] >> 8 : g->values[i]);
            if (bits == 16)
                to[1] = (uint8_t)(g->values[i] & 255);
        }
    for (i = 0; i < g->depth; i++)
        rows[i] = pixels + i * g->width * (uint32_t)(channels * bits / 8);
    png_set_write_fn(png, g, take_png_bytes, NULL);
    png_set_IHDR(png, info, g->width, g->depth, bits, colour,
                 interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    png_write_image(png, rows);
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
}

static void a_png_of_any_kind_of_grey_reads_as_written(void)
{
    static const int colours[] = { PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA,
                                   PNG_COLOR_TYPE_RGB };
    static grid g;
    int round;
    for (round = 0; round < 300; round++) {
        int wide = round % 2;
        size_t cut;
        make_grid(&g, 0, wide ? 65535 : 255);
        write_png(&g, wide ? 16 : 8, colours[round % 3], round / 6 % 2);
        CHECK(reads_back(&g, "any.name", wide ? TERRIMP_FORMAT_U16 : TERRIMP_FORMAT_U8, &whole));
        cut = random_range(8, (uint32_t)g.size - 13); /* 12 bytes say that it ends */
        CHECK(refused("a.png", g.bytes, cut, &whole));
    }
}

/* ---- TIFF --------------------------------------------------------------- */

#ifdef HOST_TIFF
#include <tiffio.h>

static void add_test_tags(TIFF *tiff)
{
    static char scale[] = "scale", tie[] = "tie", keys[] = "keys", none[] = "none";
    static const TIFFFieldInfo tags[] = {
        { 33550, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, scale },
        { 33922, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, tie },
        { 34735, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, keys },
        { 42113, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, none }
    };
    TIFFMergeFieldInfo(tiff, tags, 4);
}

typedef struct tiff_kind {
    int bits, kind, bands, planes, compression, tiled;
    const char *mode;
} tiff_kind;

static void put_tiff_sample(uint8_t *to, long value, const tiff_kind *k)
{
    union { uint8_t u8; uint16_t u16; uint32_t u32; float f32; double f64; } sample;
    if (k->kind == SAMPLEFORMAT_IEEEFP && k->bits == 64)
        sample.f64 = (double)value;
    else if (k->kind == SAMPLEFORMAT_IEEEFP)
        sample.f32 = (float)value;
    else if (k->bits == 8)
        sample.u8 = (uint8_t)value;
    else if (k->bits == 16)
        sample.u16 = (uint16_t)value;
    else
        sample.u32 = (uint32_t)value;
    memcpy(to, &sample, (size_t)k->bits / 8);
}

/* Of further bands no sample must show. */
static void write_tiff(const grid *g, const tiff_kind *k, double scale, int geographic)
{
    const uint16_t keys[] = { 1, 1, 0, 1, 1024, 0, 1, (uint16_t)(geographic ? 2 : 1) };
    const double scales[3] = { scale, scale, 0.0 };
    const double tie[6] = { 0, 0, 0, geographic ? 1.0 : 4e5, geographic ? 43.0 : 5e6, 0 };
    static uint8_t block[GRID * GRID * 8 * 3];
    uint32_t pixel = (uint32_t)(k->bits / 8) * (uint32_t)(k->planes == 1 ? k->bands : 1), x, z;
    TIFF *tiff;
    TIFFSetTagExtender(add_test_tags);
    tiff = TIFFOpen(scratch_file, k->mode);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, g->width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, g->depth);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, k->bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, k->kind);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, k->bands);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, k->planes);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, k->compression);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    if (k->tiled) {
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
    } else {
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, random_range(1, GRID));
    }
    TIFFSetField(tiff, 33550, 3, scales);
    TIFFSetField(tiff, 33922, 6, tie);
    TIFFSetField(tiff, 34735, 8, keys);
    TIFFSetField(tiff, 42113, "-9999");
    memset(block, 0xaa, sizeof block);
    for (z = 0; !k->tiled && z < g->depth; z++) {
        for (x = 0; x < g->width; x++)
            put_tiff_sample(block + x * pixel, g->values[z * g->width + x], k);
        TIFFWriteScanline(tiff, block, z, 0);
    }
    for (z = 0; k->tiled && z < g->depth; z += 16)
        for (x = 0; x < g->width; x += 16) {
            uint32_t i;
            for (i = 0; i < 256; i++)
                if (x + i % 16 < g->width && z + i / 16 < g->depth)
                    put_tiff_sample(block + i * pixel,
                                    g->values[(z + i / 16) * g->width + x + i % 16], k);
            TIFFWriteTile(tiff, block, x, z, 0, 0);
        }
    for (z = 0; k->planes == 2 && k->bands == 2 && !k->tiled && z < g->depth; z++)
        TIFFWriteScanline(tiff, block, z, 1);
    TIFFClose(tiff);
}

static void a_geotiff_of_any_kind_reads_as_written(void)
{
    static const int kinds[][3] = {
        { 8, SAMPLEFORMAT_UINT, TERRIMP_FORMAT_U8 }, { 16, SAMPLEFORMAT_UINT, TERRIMP_FORMAT_U16 },
        { 16, SAMPLEFORMAT_INT, TERRIMP_FORMAT_S16 },
        { 32, SAMPLEFORMAT_IEEEFP, TERRIMP_FORMAT_F32 },
        { 64, SAMPLEFORMAT_IEEEFP, TERRIMP_FORMAT_F32 },
        { 32, SAMPLEFORMAT_INT, TERRIMP_FORMAT_F32 }, { 32, SAMPLEFORMAT_UINT, TERRIMP_FORMAT_F32 }
    };
    static const int packings[] = { COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_PACKBITS };
    static const char *const modes[] = { "wl", "wb", "w8" };
    static grid g;
    int round;
    for (round = 0; round < 400; round++) {
        const int *kind = kinds[round % 7];
        int geographic = round % 2, has_sign = kind[1] != SAMPLEFORMAT_UINT;
        tiff_kind k = { kind[0], kind[1], 1 + round / 3 % 2, 1 + round / 5 % 2,
                        packings[round / 7 % 3], round / 2 % 2, modes[round / 11 % 3] };
        double x = geographic ? 111.133 * cos(42.988 * 0.0174533) : 12.5;
        dem d;
        make_grid(&g, has_sign ? -500 : 0, kind[0] == 8 ? 255 : 30000);
        write_tiff(&g, &k, geographic ? 0.001 : 12.5, geographic);
        CHECK(dem_load(&d, scratch_file, &whole) && holds_grid(&d, &g, kind[2]));
        CHECK(d.has_units && fabs((double)d.spacing_x - x) < 0.03);
        CHECK(fabs((double)d.spacing_z - (geographic ? 111.133 : 12.5)) < 0.001);
        dem_free(&d);
        if (has_sign) {
            g.values[1] = -9999;
            write_tiff(&g, &k, 1.0, 0);
            CHECK(dem_load(&d, scratch_file, &whole) && d.has_voids);
            dem_free(&d);
        }
    }
}

/* Cut and damaged files: any result will do, but the sanitizers must stay silent. */
static void a_damaged_tiff_does_no_harm(void)
{
    static uint8_t bytes[1 << 16];
    static grid g;
    int round;
    for (round = 0; round < 1000; round++) {
        tiff_kind k = { 16, SAMPLEFORMAT_INT, 1, 1, COMPRESSION_LZW, round % 2, "wl" };
        size_t size, i;
        FILE *file;
        dem d;
        make_grid(&g, 0, 100);
        write_tiff(&g, &k, 1.0, 0);
        file = fopen(scratch_file, "rb");
        size = file ? fread(bytes, 1, sizeof bytes, file) : 0;
        if (file)
            fclose(file);
        for (i = random_range(1, 4); i-- > 0;)
            bytes[random_range(8, (uint32_t)size - 1)] = (uint8_t)random_bits();
        if (round % 3 == 0)
            size = random_range(4, (uint32_t)size);
        load(&d, "a.tif", bytes, size, &whole);
        dem_free(&d);
    }
}
#endif

/* ---- Units -------------------------------------------------------------- */

/* Whether a ray in the middle or the lower half of the picture meets the ground. */
static int looks_at_ground(const terrimp_heightfield *field, const flight_pose *pose)
{
    float forward[3], length = 0.0f;
    int k;
    for (k = 0; k < 3; k++) {
        forward[k] = pose->target[k] - pose->eye[k];
        length += forward[k] * forward[k];
    }
    for (k = 0; k < 2; k++) {
        if (terrimp_heightfield_raycast(field, pose->eye, forward, 1e9f, NULL) == TERRIMP_OK)
            return 1;
        forward[1] -= 0.3f * sqrtf(length); /* 17 degrees lower */
    }
    return 0;
}

/* Whatever the units of a map, its terrain is a terrain and lies before the eye. */
static void a_map_of_the_full_range_is_flown_over(void)
{
    static uint8_t pgm[40 + 256 * 256 * 2];
    static const char head[] = "P5\n256 256\n65535\n";
    static const float scales[] = { 0.0f, 1e-6f, 1e-3f, 1.0f, 1e3f };
    size_t round;
    for (round = 0; round < sizeof scales / sizeof *scales; round++) {
        float scale = scales[round];
        size_t at = sizeof head - 1, i;
        tour_desc desc;
        tour t;
        memcpy(pgm, head, at);
        for (i = 0; i < 65536; i++) {
            double h = 0.5 + 0.5 * sin((double)(i % 256) * 0.05) * cos((double)(i / 256) * 0.04);
            unsigned sample = (unsigned)(65535.0 * h);
            pgm[at++] = (uint8_t)(sample >> 8);
            pgm[at++] = (uint8_t)(sample & 255);
        }
        write_scratch(pgm, at);
        memset(&desc, 0, sizeof desc);
        desc.dem = scratch_file;
        desc.height_scale = scale;
        desc.frames = 10;
        CHECK(tour_load(&t, &desc) && tour_plan(&t));
        CHECK(scale > 0.0f || fabsf(t.field.height_scale * 65535.0f - 0.125f * 255.0f) < 1.0f);
        for (i = 0; i < t.flight.count; i++)
            CHECK(looks_at_ground(&t.field, &t.flight.poses[i]));
        tour_close(&t);
    }
}

static void run_file_tests(void)
{
    RUN(a_binary_pgm_reads_whatever_ends_its_lines);
    RUN(a_pgm_may_be_followed_by_more);
    RUN(a_plain_pgm_reads_as_written);
    RUN(raw_samples_read_in_either_order_with_gaps);
    RUN(a_square_raw_file_needs_only_its_name);
    RUN(swapped_bytes_are_remarked);
    RUN(no_data_of_every_format_is_filled);
    RUN(an_hgt_has_the_spacing_of_its_latitude);
    RUN(an_esri_grid_reads_as_written);
    RUN(a_malformed_esri_grid_is_refused);
    RUN(a_png_of_any_kind_of_grey_reads_as_written);
#ifdef HOST_TIFF
    RUN(a_geotiff_of_any_kind_reads_as_written);
    RUN(a_damaged_tiff_does_no_harm);
#endif
    RUN(a_map_of_the_full_range_is_flown_over);
}
