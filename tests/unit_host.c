/* Tests of what the examples share and that needs no OpenGL: pictures, statistics, elevation files,
   flights, the command line, procedural terrain, the lightmap, the span rasteriser.
   Build:  make unit_host  (cc -std=c99 -I. tests/unit_host.c examples/host/{...}.c -lpng -lm) */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "check.h"
#include "unit_host_quality.h"

#include "examples/host/dem.h"
#include "examples/host/flight.h"
#include "examples/host/image.h"
#include "examples/host/lightmap.h"
#include "examples/host/options.h"
#include "examples/host/procedural.h"
#include "examples/host/raster.h"
#include "examples/host/stats.h"

#include <math.h>
#include <string.h>

static const char scratch_file[] = "unit_host.tmp";

static void write_scratch(const void *bytes, size_t size)
{
    FILE *file = fopen(scratch_file, "wb");
    CHECK(file && fwrite(bytes, 1, size, file) == size);
    if (file)
        fclose(file);
}

static void random_bytes(uint8_t *bytes, size_t size)
{
    size_t i;
    for (i = 0; i < size; i++)
        bytes[i] = (uint8_t)random_bits();
}

/* ---- Pictures ----------------------------------------------------------- */

static void a_written_picture_reads_back_alike(void)
{
    uint8_t written[7 * 5 * 3], *back = NULL;
    int width = 0, height = 0;
    random_bytes(written, sizeof written);
    CHECK(image_write_png(scratch_file, written, 7, 5) == NULL);
    CHECK(image_read_png(scratch_file, &back, &width, &height) == NULL);
    CHECK(width == 7 && height == 5);
    CHECK(back && memcmp(back, written, sizeof written) == 0);
    free(back);
}

static void a_picture_that_is_none_is_refused(void)
{
    uint8_t *rgb = NULL;
    int width = 1, height = 1;
    write_scratch("\x89PNG\r\n\x1a\nhello", 13);
    CHECK(image_read_png(scratch_file, &rgb, &width, &height) != NULL);
    CHECK(image_read_png("no/such/file.png", &rgb, &width, &height) != NULL);
    CHECK(image_write_png("no/such/file.png", (const uint8_t *)"abc", 1, 1) != NULL);
    CHECK(rgb == NULL && width == 1 && height == 1);
}

static void psnr_has_its_known_values(void)
{
    uint8_t a[4 * 3] = { 0 }, b[4 * 3] = { 0 };
    CHECK(image_mean_square(a, b, 4, NULL) == 0.0);
    CHECK(image_psnr(0.0) == 99.0);
    memset(b, 255, sizeof b);
    CHECK(fabs(image_psnr(image_mean_square(a, b, 4, NULL))) < 1e-9); /* black against white */
    memset(b, 1, sizeof b);
    CHECK(fabs(image_psnr(image_mean_square(a, b, 4, NULL)) - 48.1308) < 1e-3);
}

static void the_sky_counts_only_where_the_other_picture_has_terrain(void)
{
    const uint8_t sky[3] = { 9, 9, 9 };
    const uint8_t a[9] = { 9, 9, 9, 9, 9, 9, 50, 50, 50 };
    const uint8_t b[9] = { 9, 9, 9, 19, 19, 19, 50, 50, 50 };
    CHECK(fabs(image_mean_square(a, b, 3, sky) - 50.0) < 1e-9);  /* 100, 0: the first is sky */
    CHECK(fabs(image_mean_square(a, b, 3, NULL) - 100.0 / 3.0) < 1e-9);
    CHECK(image_mean_square(a, a, 2, sky) == 0.0);               /* nothing but sky */
}

static void a_difference_is_white_where_pictures_are_equal(void)
{
    const uint8_t a[6] = { 10, 20, 30, 0, 255, 100 }, b[6] = { 10, 25, 30, 255, 0, 90 };
    uint8_t out[6];
    image_difference(a, b, 2, 1, out);
    CHECK(out[0] == 255 && out[1] == 250 && out[2] == 255 && out[3] == 0 && out[4] == 0);
    image_difference(a, b, 2, 8, out);
    CHECK(out[1] == 215 && out[5] == 175 && out[3] == 0);
}

/* ---- Statistics --------------------------------------------------------- */

/* The smallest value that at least percent of all values do not pass, the slow way. */
static double slow_percentile(const stats *s, double percent)
{
    double best = 1e300;
    size_t i, j;
    for (i = 0; i < s->count; i++) {
        size_t not_above = 0;
        for (j = 0; j < s->count; j++)
            not_above += s->values[j] <= s->values[i];
        if ((double)not_above * 100.0 >= percent * (double)s->count && s->values[i] < best)
            best = s->values[i];
    }
    return best;
}

static void figures_agree_with_brute_force(void)
{
    int round;
    for (round = 0; round < 40; round++) {
        stats s = { NULL, 0, 0 };
        stats_summary sum;
        double total = 0.0, squares = 0.0, low, high, n;
        size_t i, count = random_range(2, 400);
        for (i = 0; i < count; i++)
            CHECK(stats_add(&s, round % 2 ? (double)random_float(1.0f, 90.0f)
                                          : (double)random_range(0, 50) * 0.5)); /* with ties */
        sum = stats_summarise(&s);
        n = (double)count;
        for (i = 0; i < count; i++)
            total += s.values[i];
        for (i = 0; i < count; i++)
            squares += pow(s.values[i] - total / n, 2.0);
        low = slow_percentile(&s, 50.0);
        high = count % 2 ? low : slow_percentile(&s, 100.0 * (n / 2.0 + 1.0) / n);
        CHECK(sum.count == count);
        CHECK(fabs(sum.median - 0.5 * (low + high)) < 1e-9);
        CHECK(fabs(sum.mean - total / n) < 1e-9);
        CHECK(fabs(sum.deviation - sqrt(squares / (n - 1.0))) < 1e-9);
        CHECK(sum.p95 == slow_percentile(&s, 95.0) && sum.p99 == slow_percentile(&s, 99.0));
        CHECK(sum.worst == slow_percentile(&s, 100.0));
        stats_free(&s);
    }
}

static void few_values_give_figures_too(void)
{
    stats s = { NULL, 0, 0 };
    stats_summary none = stats_summarise(&s), one;
    CHECK(none.count == 0 && none.median == 0.0 && none.worst == 0.0);
    CHECK(stats_add(&s, 7.0));
    one = stats_summarise(&s);
    CHECK(one.median == 7.0 && one.mean == 7.0 && one.deviation == 0.0 && one.p99 == 7.0);
    stats_free(&s);
    CHECK(s.values == NULL && s.count == 0);
}

static void the_clock_goes_forward(void)
{
    double last = clock_ms(), now;
    int i;
    for (i = 0; i < 1000; i++, last = now) {
        now = clock_ms();
        CHECK(now >= last);
    }
}

/* ---- Elevation files ---------------------------------------------------- */

static const dem_desc whole; /* all zero */

/* Loads bytes under a name; what must hold of any result is checked here. */
static int load(dem *d, const char *name, const void *bytes, size_t size, const dem_desc *desc)
{
    uint8_t *block = malloc(size + 1);
    int ok;
    memcpy(block, bytes, size);
    ok = dem_parse(d, name, block, size, desc);
    CHECK(ok == (d->samples != NULL) && ok == (d->error[0] == 0));
    CHECK(!strchr(d->error, '\n'));
    if (ok)
        CHECK(d->width >= 2 && d->depth >= 2 && d->format > 0 && d->format < TERRIMP_FORMAT_COUNT);
    return ok;
}

static int refused(const char *name, const void *bytes, size_t size, const dem_desc *desc)
{
    dem d;
    int ok = load(&d, name, bytes, size, desc);
    dem_free(&d);
    return !ok;
}

static void an_hgt_is_square_and_big_endian(void)
{
    static const uint8_t bytes[18] = { 0, 1, 1, 0, 0x80, 0, 0xff, 0xff, 0, 5,
                                       0, 6, 0, 7, 0, 8, 0, 9 };
    static const int16_t values[9] = { 1, 256, -32768, -1, 5, 6, 7, 8, 9 };
    const dem_desc all = whole;
    terrimp_heightfield field;
    dem d;
    CHECK(load(&d, "tiles/N42E001.hgt", bytes, sizeof bytes, &all));
    CHECK(d.width == 3 && d.depth == 3 && d.format == TERRIMP_FORMAT_S16 && d.has_voids);
    CHECK(memcmp(d.samples, values, sizeof values) == 0);
    CHECK(fabsf(d.spacing_z * 2.0f - 111133.0f) < 1.0f);
    CHECK(fabsf(d.spacing_x / d.spacing_z - cosf(42.5f * 0.01745329f)) < 1e-4f);
    field = dem_heightfield(&d);
    CHECK(field.has_no_data && field.no_data == -32768.0f && field.samples == d.samples);
    dem_free(&d);
    CHECK(refused("a.hgt", bytes, 16, &all) && refused("a.hgt", bytes, 17, &all));
    CHECK(refused("a.hgt", bytes, 2, &all) && refused("a.hgt", bytes, 0, &all));
}

static void a_pgm_keeps_its_sample_size(void)
{
    static const char eight[] = "P5 # a comment\n#another\n 3\t2\n255\nabcdef";
    static const char sixteen[] = "P5\n2 2 256\n\1\2\3\4\5\6\7\10";
    const dem_desc all = whole;
    dem d;
    CHECK(load(&d, "a.pgm", eight, sizeof eight - 1, &all));
    CHECK(d.width == 3 && d.depth == 2 && d.format == TERRIMP_FORMAT_U8 && !d.has_voids);
    CHECK(d.samples && memcmp(d.samples, "abcdef", 6) == 0);
    dem_free(&d);
    CHECK(load(&d, "a.pgm", sixteen, sizeof sixteen - 1, &all));
    CHECK(d.format == TERRIMP_FORMAT_U16 && ((const uint16_t *)d.samples)[3] == 0x708);
    dem_free(&d);
}

static void a_malformed_pgm_is_refused(void)
{
    static const char *const headers[] = {
        "P5", "P5 ", "P5 3", "P5 3 3", "P5 3 3 255", "P5 -3 3 255\n", "P5 3 3 0\n", "P5 x 3 255\n",
        "P5 3 3 65536\n", "P5 3 3 255#", "P5 1 9 255\nabcdefghi", "P5 4294967299 3 255\nabcdefghi",
        "P5 65538 2 255\nabc", "P5 99999999999999999999 3 255\n", "P5 3 3 255\nabcdefgh",
        "P5 65537 65537 65535\nabcdefgh", "P2 3 3 255\n1 2 3 4 5 6 7 8", "P5 # no end",
        "P6 3 3 1\n", "P2 2 2 255\n1 2 3 256", "P2 2 2 255\n1 2 3 x", "P2 9999 9999 255\n1 2 3 4"
    };
    const dem_desc all = whole;
    size_t i;
    for (i = 0; i < sizeof headers / sizeof *headers; i++)
        CHECK(refused("a.pgm", headers[i], strlen(headers[i]), &all));
}

static void raw_samples_are_little_endian_and_of_the_given_size(void)
{
    const uint8_t bytes[16] = { 1, 2, 3, 4, 0, 0, 0x80, 0x3f, 0, 0, 0x20, 0xc1, 0, 0, 0xc0, 0x7f };
    dem_desc desc = whole;
    uint8_t infinite[16];
    const float *samples;
    dem d;
    desc.raw_format = TERRIMP_FORMAT_F32;
    desc.raw_width = desc.raw_depth = 2;
    CHECK(load(&d, "a.raw", bytes, 16, &desc));
    samples = d.samples;
    CHECK(samples[1] == 1.0f && samples[2] == -10.0f && d.has_voids); /* the last one is a NaN */
    dem_free(&d);
    memcpy(infinite, bytes, 16);
    infinite[14] = 0x80;
    CHECK(refused("a.raw", infinite, 16, &desc));
    CHECK(refused("a.raw", bytes, 15, &desc) && refused("a.raw", bytes, 17 - 2, &desc));
    desc.raw_format = TERRIMP_FORMAT_U16;
    desc.raw_width = 4;
    CHECK(load(&d, "a.raw", bytes, 16, &desc));
    CHECK(((const uint16_t *)d.samples)[0] == 0x201);
    dem_free(&d);
    desc.raw_width = desc.raw_depth = 0xffffffffu;
    CHECK(refused("a.raw", bytes, 16, &desc));
}

static void a_crop_holds_the_samples_that_it_names(void)
{
    int round;
    for (round = 0; round < 200; round++) {
        uint32_t w = random_range(2, 40), h = random_range(2, 40), x, z;
        dem_desc desc = whole;
        uint16_t values[40 * 40];
        uint8_t bytes[40 * 40 * 2];
        dem d;
        for (x = 0; x < w * h; x++) {
            values[x] = (uint16_t)random_bits();
            bytes[2 * x] = (uint8_t)(values[x] & 255);
            bytes[2 * x + 1] = (uint8_t)(values[x] >> 8);
        }
        desc.raw_format = TERRIMP_FORMAT_U16;
        desc.raw_width = w;
        desc.raw_depth = h;
        desc.crop_x = random_range(0, w - 2);
        desc.crop_z = random_range(0, h - 2);
        desc.crop_width = random_range(2, w - desc.crop_x);
        desc.crop_depth = random_range(2, h - desc.crop_z);
        CHECK(load(&d, "a.raw", bytes, (size_t)w * h * 2, &desc));
        CHECK(d.width == desc.crop_width && d.depth == desc.crop_depth);
        for (z = 0; z < d.depth; z++)
            for (x = 0; x < d.width; x++)
                CHECK(((const uint16_t *)d.samples)[z * d.width + x]
                      == values[(z + desc.crop_z) * w + x + desc.crop_x]);
        dem_free(&d);
        desc.crop_width = w - desc.crop_x + 1;
        CHECK(refused("a.raw", bytes, (size_t)w * h * 2, &desc));
        desc.crop_x = 0xffffffffu;
        desc.crop_width = 3;
        CHECK(refused("a.raw", bytes, (size_t)w * h * 2, &desc));
    }
}

/* Damaged headers of every kind: any result will do, but the sanitizers must stay silent. */
static void hostile_bytes_do_no_harm(void)
{
    static const char *const names[] = { "a.hgt", "a.pgm", "a.raw", ".hgt", "" };
    int round;
    for (round = 0; round < 4000; round++) {
        uint8_t bytes[64];
        size_t size = random_range(0, sizeof bytes), i;
        dem_desc desc = whole;
        dem d;
        random_bytes(bytes, sizeof bytes);
        if (round % 2) {
            memcpy(bytes, "P5 3 3 255 ", 11);
            for (i = random_range(0, 3); i-- > 0;)
                bytes[random_range(2, 12)] = (uint8_t)"0123456789 #\n-x"[random_range(0, 14)];
        }
        if (round % 3 == 0) {
            desc.raw_format = (int)random_range(0, 6) - 1;
            desc.raw_width = random_range(0, 9);
            desc.raw_depth = random_range(0, 9);
            desc.crop_x = random_range(0, 4);
            desc.crop_depth = random_range(0, 4);
        }
        load(&d, names[random_range(0, 4)], bytes, size, &desc);
        dem_free(&d);
        dem_free(&d);
    }
}

static void a_missing_file_is_named(void)
{
    const dem_desc all = whole;
    dem d;
    CHECK(!dem_load(&d, "no/such/tile.hgt", &all));
    CHECK(strstr(d.error, "no/such/tile.hgt") && d.samples == NULL);
    CHECK(!dem_load(&d, ".", &all));
    CHECK(d.error[0] != 0);
}

static void a_file_loads_like_its_bytes(void)
{
    static const char pgm[] = "P5 2 2 255\nabcd";
    const dem_desc all = whole;
    dem d;
    write_scratch(pgm, sizeof pgm - 1);
    CHECK(dem_load(&d, scratch_file, &all));
    CHECK(d.samples && memcmp(d.samples, "abcd", 4) == 0);
    dem_free(&d);
}

#include "unit_host_files.h"

/* ---- Flights and the command line --------------------------------------- */

static void a_path_reads_as_written(void)
{
    static const char path[] = "# eye, target\n1 2 3 4 5 6\n\n-1.5 2e3 0 0 0 0 \r\n";
    flight f;
    write_scratch(path, sizeof path - 1);
    CHECK(flight_load(&f, scratch_file) && f.count == 2);
    CHECK(f.poses && f.poses[0].target[2] == 6.0f && f.poses[1].eye[1] == 2000.0f);
    flight_free(&f);
}

static void a_wrong_path_is_refused_with_its_line(void)
{
    static const char *const wrong[] = { "", "# nothing\n", "1 2 3 4 5\n", "1 2 3 4 5 6 7\n",
                                         "1 2 3 4 5 nan\n", "1 2 3 4 5 inf\n", "1 2 3 1 2 3\n",
                                         "one two\n", "1 2 3 4 5 6x\n" };
    size_t i;
    flight f;
    for (i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        write_scratch(wrong[i], strlen(wrong[i]));
        CHECK(!flight_load(&f, scratch_file) && f.error[0] && !f.poses);
    }
    CHECK(!flight_load(&f, "no/such/path"));
    write_scratch("1 2 3 4 5 6\nx\n", 14);
    CHECK(!flight_load(&f, scratch_file) && strstr(f.error, ":2:"));
}

static void circle_keeps_its_speed_and_stays_above_ground(float above)
{
    uint16_t *samples = procedural_terrain(257, 129, 3);
    terrimp_heightfield field;
    flight f;
    size_t i;
    memset(&field, 0, sizeof field);
    field.samples = samples;
    field.width = 257;
    field.depth = 129;
    field.format = TERRIMP_FORMAT_U16;
    field.height_scale = PROCEDURAL_HEIGHT_SCALE;
    CHECK(flight_circle(&f, &field, 500, 1.25f, above));
    for (i = 0; i + 1 < f.count; i++) {
        const float *a = f.poses[i].eye, *b = f.poses[i + 1].eye;
        float dx = b[0] - a[0], dz = b[2] - a[2], step = sqrtf(dx * dx + dz * dz), ground = 0.0f;
        CHECK(fabsf(step - 1.25f) < 0.01f);
        CHECK(terrimp_heightfield_height(&field, a[0], a[2], &ground) == TERRIMP_OK);
        CHECK(above > 0.0f ? fabsf(a[1] - ground - above) < 1e-3f : a[1] > ground);
    }
    flight_free(&f);
    free(samples);
}

static void circles_keep_their_speed_and_stay_above_ground(void)
{
    circle_keeps_its_speed_and_stays_above_ground(0.0f);
    circle_keeps_its_speed_and_stays_above_ground(2.0f);
}

/* Splits a line at its blanks and parses it. */
static int parse(options *o, const char *line)
{
    static char copy[256];
    char *words[32];
    int count = 1;
    words[0] = NULL;
    strcpy(copy, line);
    for (words[count] = strtok(copy, " "); words[count]; words[count] = strtok(NULL, " "))
        count++;
    return options_parse(o, count, words);
}

static void options_reach_their_fields(void)
{
    options o;
    CHECK(parse(&o, "") && o.width == 1280 && o.height == 1024 && o.terrain_size == 2049);
    CHECK(parse(&o, "--size 640x480 --crop 1,2,30x40 --fade 100,200.5 --spacing 30,20 "
                    "--sky ff00fe"));
    CHECK(o.width == 640 && o.height == 480 && o.file.crop_x == 1 && o.file.crop_z == 2);
    CHECK(o.file.crop_width == 30 && o.file.crop_depth == 40 && o.fade[1] == 200.5f);
    CHECK(o.spacing[0] == 30.0f && o.spacing[1] == 20.0f);
    CHECK(o.sky[0] == 255 && o.sky[1] == 0 && o.sky[2] == 254);
    CHECK(parse(&o, "--mode full --format f32 --raw-size 3x4 --spacing 7 --save-frames 0,5,17"));
    CHECK(o.terrimp_mode == TERRIMP_MODE_FULL && o.file.raw_format == TERRIMP_FORMAT_F32);
    CHECK(o.spacing[1] == 7.0f && o.save_frame_count == 3);
    CHECK(options_saves(&o, 5) && !options_saves(&o, 6));
    CHECK(parse(&o, "--save-every 10 --wireframe --show-atlas --compare --dem x.hgt"));
    CHECK(options_saves(&o, 20) && !options_saves(&o, 5) && o.wireframe && o.show_atlas);
    CHECK(o.compare && strcmp(o.dem, "x.hgt") == 0);
    CHECK(parse(&o, "--big-endian --skip 12 --stride 100 --no-data -9999 --origin -5,1e6"));
    CHECK(o.file.big_endian && o.file.skip_bytes == 12 && o.file.stride_bytes == 100);
    CHECK(o.file.has_no_data && o.file.no_data == -9999.0f);
    CHECK(o.origin[0] == -5.0f && o.origin[1] == 1e6f);
}

static void wrong_options_are_refused(void)
{
    static const char *const wrong[] = {
        "--nothing", "stray", "--size", "--size 640", "--size 0x5", "--size 640x480x2", "--fov nan",
        "--fov 180", "--fov -1", "--frames 0", "--frames -1", "--frames 1e3", "--fade 5,5",
        "--fade 5", "--speed inf", "--crop 1,2,3", "--crop 1,2,3x", "--format u32", "--mode fast",
        "--sky 12345", "--sky 12345g", "--spacing 0", "--spacing 1,-1", "--save-frames 1,,2",
        "--save-frames 1,", "--save-frames x", "--terrain-size 1", "--atlas 99999999999", "--dem",
        "--skip -1", "--stride 0", "--no-data x", "--no-data", "--origin 5", "--origin a,b"
    };
    options o;
    size_t i;
    for (i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        CHECK(!parse(&o, wrong[i]));
        CHECK(o.error[0] != 0);
    }
}

/* Lines of remarks about options that do nothing. */
static int ignored(const char *line, int raw)
{
    FILE *file = tmpfile();
    int lines = 0, byte;
    options o;
    CHECK(file && parse(&o, line));
    if (!file)
        return -1;
    options_print_ignored(&o, raw, file);
    rewind(file);
    while ((byte = fgetc(file)) != EOF)
        lines += byte == '\n';
    fclose(file);
    return lines;
}

static void options_without_their_file_are_said_to_be_ignored(void)
{
    CHECK(ignored("--frames 3 --mode full", 0) == 0);
    CHECK(ignored("--dem a --no-data 0 --crop 0,0,9x9 --out b --save-every 1", 0) == 0);
    CHECK(ignored("--dem a --format u8 --raw-size 9x9 --big-endian --skip 1 --stride 9", 1) == 0);
    CHECK(ignored("--dem a --format u8 --raw-size 9x9 --big-endian --skip 1 --stride 9", 0) == 5);
    CHECK(ignored("--format u8 --raw-size 9x9 --no-data 0 --crop 0,0,9x9", 0) == 4);
    CHECK(ignored("--dem a --seed 3 --terrain-size 99", 0) == 2);
    CHECK(ignored("--save-every 1 --save-frames 0 --wireframe --show-atlas", 0) == 4);
    CHECK(ignored("--path a --speed 3 --fps 9", 0) == 2);
}

/* ---- Terrain and light -------------------------------------------------- */

static void procedural_terrain_repeats_itself_only_with_its_seed(void)
{
    uint16_t *a = procedural_terrain(200, 150, 1), *b = procedural_terrain(200, 150, 1);
    uint16_t *c = procedural_terrain(200, 150, 2), *tiny = procedural_terrain(2, 2, 1);
    CHECK(a && b && c && tiny);
    CHECK(memcmp(a, b, 200 * 150 * sizeof *a) == 0);
    CHECK(memcmp(a, c, 200 * 150 * sizeof *a) != 0);
    free(a);
    free(b);
    free(c);
    free(tiny);
}

static void procedural_terrain_has_peaks_and_valleys(void)
{
    uint32_t side = 1025, i;
    uint16_t *samples = procedural_terrain(side, side, 1), low = 65535, high = 0;
    for (i = 0; i < side * side; i++) {
        low = samples[i] < low ? samples[i] : low;
        high = samples[i] > high ? samples[i] : high;
    }
    CHECK((float)(high - low) * PROCEDURAL_HEIGHT_SCALE > 120.0f);
    CHECK(low > 0 && high < 65535); /* nothing is cut off */
    free(samples);
}

static void a_wall_throws_its_shadow_away_from_the_sun(void)
{
    float samples[40 * 40] = { 0 };
    terrimp_heightfield field;
    uint8_t *rgb;
    int i;
    for (i = 0; i < 40; i++)
        samples[10 * 40 + i] = 8.0f;
    memset(&field, 0, sizeof field);
    field.samples = samples;
    field.width = field.depth = 40;
    rgb = lightmap_bake(&field);
    CHECK(rgb != NULL);
    if (rgb) {
        const uint8_t *before = rgb + (4 * 40 + 20) * 3, *behind = rgb + (14 * 40 + 20) * 3;
        const uint8_t *beyond = rgb + (30 * 40 + 20) * 3;
        CHECK(behind[1] < before[1] && beyond[1] == before[1]);
    }
    free(rgb);
}

static void any_size_of_field_is_lit(void)
{
    uint16_t samples[2 * 5] = { 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 };
    terrimp_heightfield field;
    uint8_t *rgb;
    memset(&field, 0, sizeof field);
    field.samples = samples;
    field.format = TERRIMP_FORMAT_U16;
    field.width = 2;
    field.depth = 5;
    CHECK((rgb = lightmap_bake(&field)) != NULL);
    free(rgb);
    field.width = 5;
    field.depth = 2;
    CHECK((rgb = lightmap_bake(&field)) != NULL);
    free(rgb);
    memset(samples, 0, sizeof samples); /* all flat */
    CHECK((rgb = lightmap_bake(&field)) != NULL);
    free(rgb);
    field.has_no_data = 1; /* all void */
    CHECK((rgb = lightmap_bake(&field)) == NULL);
    free(rgb);
}

/* ---- The span rasteriser ------------------------------------------------ */

enum { RASTER_WIDTH = 80, RASTER_HEIGHT = 60, RASTER_PITCH = 90, RASTER_SIDE = 64 };

typedef struct raster_scene {
    raster r;
    raster_texture texture;
    uint16_t texels[RASTER_SIDE * RASTER_SIDE]; /* each its own number, none of them the key */
    uint16_t pixels[RASTER_PITCH * (RASTER_HEIGHT + 2)];
    uint16_t depth[RASTER_WIDTH * RASTER_HEIGHT + 2];
    raster_style style;
    terrimp_camera camera;
} raster_scene;

/* World x, z of -32..32 to the whole texture. */
static const float plane_matrix[16] = { 1.0f / 64, 0, 0, 0, 0, 0, 0, 0, 0, 1.0f / 64, 0, 0,
                                        0.5f, 0.5f, 0, 1 };

static void open_raster_scene(raster_scene *s, int row_0_is_top)
{
    float view[16], projection[16];
    int i;
    memset(s, 0, sizeof *s);
    for (i = 0; i < RASTER_SIDE * RASTER_SIDE; i++)
        s->texels[i] = (uint16_t)i;
    s->texture.levels[0] = s->texels;
    s->texture.level_count = 1;
    s->texture.log2_side = 6;
    s->style.texture = &s->texture;
    s->style.texture_matrix = plane_matrix;
    s->style.share = RASTER_ALL;
    s->camera.eye[0] = random_float(-10.0f, 10.0f);
    s->camera.eye[1] = random_float(5.0f, 20.0f);
    s->camera.eye[2] = random_float(-10.0f, 10.0f);
    s->camera.forward[0] = random_float(-0.3f, 0.3f);
    s->camera.forward[1] = -1.0f;
    s->camera.forward[2] = random_float(-0.3f, 0.3f);
    s->camera.width_px = RASTER_WIDTH;
    s->camera.height_px = RASTER_HEIGHT;
    s->camera.z_near = 0.5f;
    s->camera.z_far = 100.0f;
    CHECK(terrimp_camera_matrices(&s->camera, view, projection) == TERRIMP_OK);
    raster_begin(&s->r, s->pixels + RASTER_PITCH, s->depth + 1, RASTER_PITCH, RASTER_WIDTH,
                 RASTER_HEIGHT, row_0_is_top, view, projection, s->camera.eye);
    raster_clear(&s->r, RASTER_KEY);
    raster_clear_depth(&s->r);
}

/* A plane y = 0 of random triangles, wider than what is in view. */
static void draw_plane(raster_scene *s)
{
    enum { QUADS = 12, ROW = QUADS + 1 };
    float xyz[ROW * ROW][3];
    uint16_t indices[QUADS * QUADS * 6];
    size_t count = 0;
    int x, z, k;
    for (z = 0; z < ROW; z++)
        for (x = 0; x < ROW; x++) {
            xyz[z * ROW + x][0] = ((float)x - 6.0f) * 30.0f + random_float(-9.0f, 9.0f);
            xyz[z * ROW + x][1] = 0.0f;
            xyz[z * ROW + x][2] = ((float)z - 6.0f) * 30.0f + random_float(-9.0f, 9.0f);
        }
    for (z = 0; z < QUADS; z++)
        for (x = 0; x < QUADS; x++) {
            int a = z * ROW + x;
            const int corners[6] = { a, a + ROW, a + 1, a + 1, a + ROW, a + ROW + 1 };
            for (k = 0; k < 6; k++)
                indices[count++] = (uint16_t)corners[k];
        }
    raster_draw(&s->r, &s->style, xyz[0], indices, count);
}

/* The texel coordinates where a pixel's ray meets the plane; 0 when that is off the texture. */
static int meet_plane(const raster_scene *s, int x, int y, float texel[2])
{
    float view[16], projection[16], direction[3], k;
    float right = ((float)x + 0.5f) / RASTER_WIDTH * 2.0f - 1.0f;
    float up = ((float)y + 0.5f) / RASTER_HEIGHT * 2.0f - 1.0f;
    int i;
    terrimp_camera_matrices(&s->camera, view, projection);
    if (s->r.row_0_is_top)
        up = -up;
    for (i = 0; i < 3; i++)
        direction[i] = view[i * 4] * right / projection[0]
                       + view[i * 4 + 1] * up / projection[5] - view[i * 4 + 2];
    k = -s->camera.eye[1] / direction[1];
    texel[0] = s->camera.eye[0] + k * direction[0] + 32.0f;
    texel[1] = s->camera.eye[2] + k * direction[2] + 32.0f;
    return k > 0.0f && texel[0] > 0.0f && texel[0] < 64.0f && texel[1] > 0.0f && texel[1] < 64.0f;
}

/* Within 16 pixels the texture goes straight, which here costs less than half a texel. */
static void rasterised_pixels_are_what_their_rays_meet(void)
{
    static raster_scene s;
    int round, x, y, met = 0;
    for (round = 0; round < 40; round++) {
        open_raster_scene(&s, round % 2);
        draw_plane(&s);
        for (y = 0; y < RASTER_HEIGHT; y++)
            for (x = 0; x < RASTER_WIDTH; x++) {
                uint16_t pixel = s.r.pixels[y * RASTER_PITCH + x];
                float texel[2];
                CHECK(pixel != RASTER_KEY); /* no gap between triangles */
                if (!meet_plane(&s, x, y, texel))
                    continue;
                met++;
                CHECK(fabsf((float)(pixel % RASTER_SIDE) + 0.5f - texel[0]) < 1.0f);
                CHECK(fabsf((float)(pixel / RASTER_SIDE) + 0.5f - texel[1]) < 1.0f);
            }
    }
    CHECK(met > 100000);
}

/* Triangles anywhere, behind the eye and across it too. */
static void rasterised_triangles_stay_in_their_target(void)
{
    static raster_scene s;
    int round, i, x, y;
    for (round = 0; round < 50; round++) {
        float xyz[30][3];
        uint16_t indices[60];
        open_raster_scene(&s, round % 2);
        for (i = 0; i < 90; i++)
            xyz[i / 3][i % 3] = s.camera.eye[i % 3]
                                + random_float(-1.0f, 1.0f) * (random_bits() % 4 ? 40.0f : 0.6f);
        for (i = 0; i < 60; i++)
            indices[i] = (uint16_t)(random_bits() % 30);
        raster_draw(&s.r, &s.style, xyz[0], indices, 60);
        for (y = 0; y < RASTER_HEIGHT + 2; y++)
            for (x = 0; x < RASTER_PITCH; x++)
                CHECK(s.pixels[y * RASTER_PITCH + x] == 0
                      || (y > 0 && y <= RASTER_HEIGHT && x < RASTER_WIDTH));
        CHECK(s.depth[0] == 0 && s.depth[RASTER_WIDTH * RASTER_HEIGHT + 1] == 0);
    }
}

/* Two planes, one above the other: the upper one is seen, whichever comes first; but not when it
   has the colour of nothing. */
static void the_nearer_of_two_pixels_wins(void)
{
    static raster_scene s;
    const uint16_t indices[3] = { 0, 2, 1 };
    const float low[3][3] = { { -200, 0, -200 }, { 200, 0, -200 }, { 0, 0, 200 } };
    const float high[3][3] = { { -200, 2, -200 }, { 200, 2, -200 }, { 0, 2, 200 } };
    const int middle = RASTER_HEIGHT / 2 * RASTER_PITCH + RASTER_WIDTH / 2;
    int i, order;
    for (order = 0; order < 3; order++) {
        const uint16_t colours[2] = { 0x001f, order == 2 ? RASTER_KEY : 0x07e0 };
        open_raster_scene(&s, 1);
        for (i = 0; i < 2; i++) {
            int is_high = (i + order) % 2;
            s.texture.levels[0] = &colours[is_high];
            s.texture.log2_side = 0;
            raster_draw(&s.r, &s.style, is_high ? high[0] : low[0], indices, 3);
        }
        CHECK(s.r.pixels[middle] == (order < 2 ? 0x07e0 : 0x001f));
    }
}

/* Any triangles, dithered and with holes: what covers in one order is covered in the other. */
static void covered_pixels_are_left_alone(void)
{
    enum { ROW = (RASTER_WIDTH + 31) / 32, TRIANGLES = 40, SKY = 0x1234 };
    static raster_scene s;
    static uint16_t painted[RASTER_PITCH * (RASTER_HEIGHT + 2)];
    uint32_t covered[ROW * RASTER_HEIGHT + 2];
    uint16_t indices[TRIANGLES * 3];
    float xyz[30][3];
    int round, order, i;
    for (round = 0; round < 40; round++) {
        int shares[TRIANGLES];
        open_raster_scene(&s, round % 2);
        for (i = 0; i < 500; i++)
            s.texels[random_bits() % (RASTER_SIDE * RASTER_SIDE)] = RASTER_KEY;
        for (i = 0; i < 90; i++)
            xyz[i / 3][i % 3] = s.camera.eye[i % 3] + random_float(-1.0f, 1.0f) * 30.0f;
        for (i = 0; i < TRIANGLES * 3; i++)
            indices[i] = (uint16_t)(random_bits() % 30);
        for (i = 0; i < TRIANGLES; i++)
            shares[i] = random_bits() % 2 ? RASTER_ALL : (int)(random_bits() % 32);
        s.r.depth = NULL;
        for (order = 0; order < 2; order++) {
            covered[0] = covered[ROW * RASTER_HEIGHT + 1] = 77;
            s.r.covered = order ? covered + 1 : NULL;
            raster_clear(&s.r, order ? RASTER_KEY : SKY);
            if (order)
                raster_clear_covered(&s.r);
            for (i = 0; i < TRIANGLES; i++) {
                int k = order ? i : TRIANGLES - 1 - i;
                s.style.share = shares[k];
                raster_draw(&s.r, &s.style, xyz[0], indices + 3 * k, 3);
            }
            if (!order)
                memcpy(painted, s.pixels, sizeof painted);
        }
        raster_fill_rest(&s.r, SKY);
        CHECK(memcmp(painted, s.pixels, sizeof painted) == 0);
        CHECK(covered[0] == 77 && covered[ROW * RASTER_HEIGHT + 1] == 77);
    }
}

/* Here r / q is z / 10. */
static void a_part_of_a_picture_keeps_to_its_depth(void)
{
    static raster_scene s;
    float matrix[16];
    int round, x, y, drawn = 0;
    memcpy(matrix, plane_matrix, sizeof matrix);
    matrix[10] = 0.1f;
    for (round = 0; round < 20; round++) {
        open_raster_scene(&s, round % 2);
        s.style.texture_matrix = matrix;
        s.style.within_depth = 1;
        draw_plane(&s);
        for (y = 0; y < RASTER_HEIGHT; y++)
            for (x = 0; x < RASTER_WIDTH; x++) {
                int is_drawn = s.r.pixels[y * RASTER_PITCH + x] != RASTER_KEY;
                float texel[2], z;
                if (!meet_plane(&s, x, y, texel))
                    continue;
                z = texel[1] - 32.0f;
                CHECK(fabsf(z) < 0.01f || fabsf(z - 10.0f) < 0.01f
                      || is_drawn == (z > 0.0f && z < 10.0f));
                drawn += is_drawn;
            }
    }
    CHECK(drawn > 5000);
}

/* What is drawn on a share of the pixels has that share of the picture and of any part of it, and a
   larger share has all pixels of a smaller one. */
static void a_share_of_the_pixels_is_spread_evenly(void)
{
    static raster_scene s;
    static uint8_t before[RASTER_HEIGHT][RASTER_WIDTH];
    int share, i, x, y;
    memset(before, 0, sizeof before);
    for (share = 0; share <= RASTER_ALL; share += 4) {
        int drawn = 0, all = 0;
        open_raster_scene(&s, 1);
        for (i = 0; i < RASTER_SIDE * RASTER_SIDE; i++)
            s.texels[i] = 0xffff;
        s.style.share = share;
        draw_plane(&s);
        for (y = 0; y < RASTER_HEIGHT; y++)
            for (x = 0; x < RASTER_WIDTH; x++) {
                float texel[2];
                int is_drawn = s.r.pixels[y * RASTER_PITCH + x] == 0xffff;
                if (!meet_plane(&s, x, y, texel))
                    continue;
                CHECK(is_drawn >= before[y][x]);
                before[y][x] = (uint8_t)is_drawn;
                drawn += is_drawn;
                all++;
            }
        CHECK(all > 500 && fabs((double)drawn / all - (double)share / RASTER_ALL) < 0.02);
    }
}

static void a_mipmap_is_the_mean_of_its_texels_and_never_the_key(void)
{
    static uint8_t rgb[16 * 16 * 3];
    uint16_t texels[16 * 16 * 4 / 3 + 1];
    raster_texture texture;
    int i;
    for (i = 0; i < 16 * 16 * 3; i++)
        rgb[i] = (uint8_t)(i / 3 % 2 ? 255 : i % 3 == 0 ? 255 : 0); /* white and red, in turn */
    raster_make_texture(&texture, texels, rgb, 4);
    CHECK(texture.level_count == 5 && texture.log2_side == 4);
    CHECK(texture.levels[0][0] == 0xf800 && texture.levels[0][1] == 0xffff);
    for (i = 1; i < 5; i++)
        CHECK(texture.levels[i][0] == (31 << 11 | 31 << 5 | 15));
    CHECK(texture.levels[4] - texels == 16 * 16 + 8 * 8 + 4 * 4 + 2 * 2);
    for (i = 0; i < 16 * 16 * 3; i++)
        rgb[i] = i % 3 == 1 ? 0 : 255; /* the key's own colour */
    raster_make_texture(&texture, texels, rgb, 4);
    for (i = 0; i < 16 * 16; i++)
        CHECK(texels[i] != RASTER_KEY);
}

int main(void)
{
    RUN(a_written_picture_reads_back_alike);
    RUN(a_picture_that_is_none_is_refused);
    RUN(psnr_has_its_known_values);
    RUN(the_sky_counts_only_where_the_other_picture_has_terrain);
    RUN(a_difference_is_white_where_pictures_are_equal);
    RUN(figures_agree_with_brute_force);
    RUN(few_values_give_figures_too);
    RUN(the_clock_goes_forward);
    run_quality_tests();
    RUN(an_hgt_is_square_and_big_endian);
    RUN(a_pgm_keeps_its_sample_size);
    RUN(a_malformed_pgm_is_refused);
    RUN(raw_samples_are_little_endian_and_of_the_given_size);
    RUN(a_crop_holds_the_samples_that_it_names);
    RUN(hostile_bytes_do_no_harm);
    RUN(a_missing_file_is_named);
    RUN(a_file_loads_like_its_bytes);
    run_file_tests();
    RUN(a_path_reads_as_written);
    RUN(a_wrong_path_is_refused_with_its_line);
    RUN(circles_keep_their_speed_and_stay_above_ground);
    RUN(options_reach_their_fields);
    RUN(wrong_options_are_refused);
    RUN(options_without_their_file_are_said_to_be_ignored);
    RUN(procedural_terrain_repeats_itself_only_with_its_seed);
    RUN(procedural_terrain_has_peaks_and_valleys);
    RUN(a_wall_throws_its_shadow_away_from_the_sun);
    RUN(any_size_of_field_is_lit);
    RUN(rasterised_pixels_are_what_their_rays_meet);
    RUN(rasterised_triangles_stay_in_their_target);
    RUN(the_nearer_of_two_pixels_wins);
    RUN(covered_pixels_are_left_alone);
    RUN(a_part_of_a_picture_keeps_to_its_depth);
    RUN(a_share_of_the_pixels_is_spread_evenly);
    RUN(a_mipmap_is_the_mean_of_its_texels_and_never_the_key);
    remove(scratch_file);
    return check_report();
}
