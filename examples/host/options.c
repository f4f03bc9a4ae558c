#include "options.h"

#include <stdlib.h>
#include <string.h>

/* ---- Values ------------------------------------------------------------- */

/* Each reads one value from the start of text and returns what follows it, or null. */

static const char *read_unsigned(const char *text, uint32_t *value)
{
    unsigned long number;
    char *end;
    if (!text || *text < '0' || *text > '9')
        return NULL;
    number = strtoul(text, &end, 10);
    if (number > 1000000000ul)
        return NULL;
    *value = (uint32_t)number;
    return end;
}

static const char *read_float(const char *text, float *value)
{
    char *end;
    if (!text)
        return NULL;
    *value = strtof(text, &end);
    return end != text && *value - *value == 0.0f ? end : NULL;
}

static const char *read_mark(const char *text, char mark)
{
    return text && *text == mark ? text + 1 : NULL;
}

static int at_end(const char *text)
{
    return text && *text == 0;
}

/* ---- What each option takes --------------------------------------------- */

static int take_size(const char *text, uint32_t *width, uint32_t *height)
{
    text = read_mark(read_unsigned(text, width), 'x');
    return at_end(read_unsigned(text, height)) && *width > 0 && *height > 0;
}

static int take_unsigned(const char *text, uint32_t *value)
{
    return at_end(read_unsigned(text, value));
}

static int take_number(const char *text, float low, float high, float *value)
{
    return at_end(read_float(text, value)) && *value >= low && *value <= high;
}

static int take_positive(const char *text, float *value)
{
    return at_end(read_float(text, value)) && *value > 0.0f;
}

/* One number for both, or two with a comma. */
static int take_spacing(const char *text, float spacing[2])
{
    text = read_float(text, &spacing[0]);
    spacing[1] = spacing[0];
    if (text && *text == ',')
        text = read_float(text + 1, &spacing[1]);
    return at_end(text) && spacing[0] > 0.0f && spacing[1] > 0.0f;
}

static int take_origin(const char *text, float origin[2])
{
    text = read_mark(read_float(text, &origin[0]), ',');
    return at_end(read_float(text, &origin[1]));
}

/* Also nan and infinities, which some files mean by it. */
static int take_no_data(const char *text, dem_desc *file)
{
    char *end;
    file->has_no_data = 1;
    file->no_data = strtof(text, &end);
    return end != text && *end == 0;
}

static int take_fade(const char *text, float fade[2])
{
    text = read_mark(read_float(text, &fade[0]), ',');
    return at_end(read_float(text, &fade[1])) && fade[0] >= 0.0f && fade[1] > fade[0];
}

static int take_crop(const char *text, dem_desc *file)
{
    text = read_mark(read_unsigned(text, &file->crop_x), ',');
    text = read_mark(read_unsigned(text, &file->crop_z), ',');
    return text && take_size(text, &file->crop_width, &file->crop_depth);
}

static int take_format(const char *text, int *format)
{
    static const char *const names[] = { "u8", "u16", "s16", "f32" };
    int i;
    for (i = 0; i < 4; i++)
        if (strcmp(text, names[i]) == 0)
            *format = TERRIMP_FORMAT_U8 + i;
    return *format != 0;
}

static int take_mode(options *o, const char *text)
{
    static const char *const names[] = { "full", "geomip", "impostor", "auto" };
    int i;
    o->mode = text;
    for (i = 0; i < 4; i++)
        if (strcmp(text, names[i]) == 0) {
            o->terrimp_mode = TERRIMP_MODE_FULL + i;
            return 1;
        }
    return 0;
}

static int take_rule(const char *text, int *rule)
{
    static const char *const names[] = { "picture", "bound", "distance" };
    int i;
    for (i = 0; i < 3; i++)
        if (strcmp(text, names[i]) == 0)
            *rule = TERRIMP_GEOMIP_PICTURE + i;
    return *rule != 0;
}

static int take_frame_list(options *o, const char *text)
{
    do {
        if (o->save_frame_count == OPTIONS_MAX_SAVED)
            return 0;
        text = read_unsigned(text, &o->save_frames[o->save_frame_count++]);
    } while (text && *text++ == ',');
    return text && text[-1] == 0;
}

static int take_colour(const char *text, uint8_t colour[3])
{
    unsigned long number;
    char *end;
    if (strlen(text) != 6 || strspn(text, "0123456789abcdefABCDEF") != 6)
        return 0;
    number = strtoul(text, &end, 16);
    colour[0] = (uint8_t)(number >> 16);
    colour[1] = (uint8_t)(number >> 8 & 255);
    colour[2] = (uint8_t)(number & 255);
    return 1;
}

/* ---- The table ---------------------------------------------------------- */

typedef enum option_id {
    DEM, FORMAT, RAW_SIZE, BIG_ENDIAN, SKIP, STRIDE, NO_DATA, CROP, TERRAIN_SIZE, SEED, SPACING,
    HEIGHT_SCALE, ORIGIN, MODE, SIZE, FOV, SKY,
    FRAMES, SPEED, FPS, ABOVE, PATH, CHUNK, FADE, MAX_ANGLE, TOLERANCE, GROUND_TOLERANCE, TEXELS,
    IMPOSTOR_PX, ATLAS, ATLAS_COUNT, MAX_CAPTURES, MAX_CAPTURE_TEXELS, MAX_CAPTURE_TRIANGLES,
    NO_LOOKAHEAD, NO_SPLITS, NO_SPREADING, EXACT_DEPTH, HIDE, RULE, MORPH, OUT, SAVE_EVERY,
    SAVE_FRAMES, STATS,
    WIREFRAME, SHOW_ATLAS, COMPARE, HELP, OPTION_COUNT
} option_id;

typedef struct option {
    option_id id;
    const char *name, *value, *help; /* value: what follows the name, or null */
} option;

static const option table[OPTION_COUNT] = {
    { DEM, "--dem", "FILE", "elevation: .hgt, PGM, PNG, GeoTIFF, ESRI grid, raw samples" },
    { FORMAT, "--format", "u8|u16|s16|f32", "the file is raw, of such samples [by its name]" },
    { RAW_SIZE, "--raw-size", "WxD", "samples of a raw file along x and z [a square]" },
    { BIG_ENDIAN, "--big-endian", NULL, "samples of a raw file are" },
    { SKIP, "--skip", "BYTES", "before the first sample of a raw file [0]" },
    { STRIDE, "--stride", "BYTES", "from row to row of a raw file [no gaps]" },
    { NO_DATA, "--no-data", "V", "samples of this value are voids [the file's own]" },
    { CROP, "--crop", "X,Z,WxD", "keep only these samples" },
    { TERRAIN_SIZE, "--terrain-size", "N", "without --dem: procedural terrain, N x N [2049]" },
    { SEED, "--seed", "N", "of the procedural terrain [1]" },
    { SPACING, "--spacing", "X[,Z]", "units between samples [the file's, or 1]" },
    { HEIGHT_SCALE, "--height-scale", "S", "units for a step of a sample [1; of a map: to fit]" },
    { ORIGIN, "--origin", "X,Z", "of the first sample [0,0]" },
    { MODE, "--mode", "full|geomip|impostor|auto", "how to draw [auto]" },
    { SIZE, "--size", "WxH", "of the picture in pixels [1280x1024]" },
    { FOV, "--fov", "DEG", "vertical field of view [60]" },
    { SKY, "--sky", "RRGGBB", "colour behind the terrain [a8c8e8]" },
    { FRAMES, "--frames", "N", "how many [600, or all of --path]" },
    { SPEED, "--speed", "UNITS_PER_S", "of the eye [80 spacings a second]" },
    { FPS, "--fps", "N", "simulated frames a second [60]" },
    { ABOVE, "--above", "UNITS", "over the ground below; a smaller circle [the highest ground]" },
    { PATH, "--path", "FILE", "lines of eye_x eye_y eye_z target_x target_y target_z [a circle]" },
    { CHUNK, "--chunk", "QUADS", "along the side of a chunk [64]" },
    { FADE, "--fade", "START,END", "distances between which ground gives way to impostors" },
    { MAX_ANGLE, "--max-angle", "DEG", "view angle that outdates a picture [5; auto: follows]" },
    { TOLERANCE, "--tolerance", "PIXELS", "error that outdates a picture; auto: rules all [1]" },
    { GROUND_TOLERANCE, "--ground-tolerance", "PIXELS", "error of ground [half of that]" },
    { TEXELS, "--texels", "N", "texels for a pixel in a new picture [2; auto: follows]" },
    { IMPOSTOR_PX, "--impostor-px", "PIXELS", "side of an impostor before it is split [320]" },
    { ATLAS, "--atlas", "N", "texels along the side of an atlas [4096]" },
    { ATLAS_COUNT, "--atlas-count", "N", "atlases [1]" },
    { MAX_CAPTURES, "--max-captures", "N", "pictures begun in one frame [64]" },
    { MAX_CAPTURE_TEXELS, "--max-capture-texels", "N", "their texels [no limit]" },
    { MAX_CAPTURE_TRIANGLES, "--max-capture-triangles", "N", "their triangles [no limit]" },
    { NO_LOOKAHEAD, "--no-lookahead", NULL, "pictures are made from where the eye is" },
    { NO_SPLITS, "--no-splits", NULL, "no picture in two parts" },
    { NO_SPREADING, "--no-spreading", NULL, "pictures are renewed when they are due" },
    { EXACT_DEPTH, "--exact-depth", NULL, "impostors have the depth of the terrain" },
    { HIDE, "--hide", NULL, "leave out what ridges hide" },
    { RULE, "--rule", "picture|bound|distance", "of ground: what is tolerated [picture]" },
    { MORPH, "--morph", "RATIO", "of ground: of the distances where nodes morph [1: not]" },
    { OUT, "--out", "DIR", "directory for the pictures; made if it is missing" },
    { SAVE_EVERY, "--save-every", "N", "save every Nth frame" },
    { SAVE_FRAMES, "--save-frames", "LIST", "save these frames: 0,10,20" },
    { STATS, "--stats", "FILE", "a line of figures for each frame, tab-separated" },
    { WIREFRAME, "--wireframe", NULL, "draw the triangles' outlines over the saved pictures" },
    { SHOW_ATLAS, "--show-atlas", NULL, "save the atlases with the pictures" },
    { COMPARE, "--compare", NULL, "also draw each frame in full; print PSNR and speed-up" },
    { HELP, "--help", NULL, "this" }
};

static const option *find_option(const char *name)
{
    size_t i;
    for (i = 0; i < OPTION_COUNT; i++)
        if (strcmp(table[i].name, name) == 0)
            return &table[i];
    return NULL;
}

static int take_text(const char *text, const char **out)
{
    *out = text;
    return *text != 0;
}

static int take_flag(int *flag)
{
    *flag = 1;
    return 1;
}

static int take(options *o, option_id id, const char *text)
{
    switch (id) {
    case DEM: return take_text(text, &o->dem);
    case FORMAT: return take_format(text, &o->file.raw_format);
    case RAW_SIZE: return take_size(text, &o->file.raw_width, &o->file.raw_depth);
    case BIG_ENDIAN: return take_flag(&o->file.big_endian);
    case SKIP: return take_unsigned(text, &o->file.skip_bytes);
    case STRIDE: return take_unsigned(text, &o->file.stride_bytes) && o->file.stride_bytes > 0;
    case NO_DATA: return take_no_data(text, &o->file);
    case CROP: return take_crop(text, &o->file);
    case TERRAIN_SIZE: return take_unsigned(text, &o->terrain_size) && o->terrain_size >= 2
                              && o->terrain_size <= 32768;
    case SEED: return take_unsigned(text, &o->seed);
    case SPACING: return take_spacing(text, o->spacing);
    case HEIGHT_SCALE: return take_positive(text, &o->height_scale);
    case ORIGIN: return take_origin(text, o->origin);
    case MODE: return take_mode(o, text);
    case SIZE: return take_size(text, &o->width, &o->height) && o->width <= 16384
                      && o->height <= 16384;
    case FOV: return take_number(text, 0.1f, 170.0f, &o->fov_degrees);
    case SKY: return take_colour(text, o->sky);
    case FRAMES: return take_unsigned(text, &o->frames) && o->frames > 0;
    case SPEED: return take_positive(text, &o->speed);
    case FPS: return take_positive(text, &o->fps);
    case ABOVE: return take_positive(text, &o->above);
    case PATH: return take_text(text, &o->path);
    case CHUNK: return take_unsigned(text, &o->chunk) && o->chunk >= 4 && o->chunk <= 128
                       && o->chunk % 2 == 0;
    case FADE: return take_fade(text, o->fade);
    case MAX_ANGLE: return take_number(text, 0.06f, 85.0f, &o->max_angle_degrees);
    case TOLERANCE: return take_number(text, 0.05f, 100.0f, &o->tolerance);
    case TEXELS: return take_number(text, 0.1f, 8.0f, &o->texels);
    case ATLAS: return take_unsigned(text, &o->atlas) && o->atlas >= 64 && o->atlas <= 32768;
    case GROUND_TOLERANCE: return take_number(text, 0.05f, 100.0f, &o->ground_tolerance);
    case IMPOSTOR_PX: return take_number(text, 8.0f, 4096.0f, &o->impostor_px);
    case ATLAS_COUNT: return take_unsigned(text, &o->atlas_count) && o->atlas_count <= 16;
    case MAX_CAPTURES: return take_unsigned(text, &o->max_captures) && o->max_captures <= 1024;
    case MAX_CAPTURE_TEXELS: return take_unsigned(text, &o->max_capture_texels);
    case MAX_CAPTURE_TRIANGLES: return take_unsigned(text, &o->max_capture_triangles);
    case NO_LOOKAHEAD: return take_flag(&o->no_lookahead);
    case NO_SPLITS: return take_flag(&o->no_splits);
    case NO_SPREADING: return take_flag(&o->no_spreading);
    case EXACT_DEPTH: return take_flag(&o->exact_depth);
    case HIDE: return take_flag(&o->hide);
    case RULE: return take_rule(text, &o->rule);
    case MORPH: return take_number(text, 1.0f, 4.0f, &o->morph);
    case OUT: return take_text(text, &o->out);
    case SAVE_EVERY: return take_unsigned(text, &o->save_every) && o->save_every > 0;
    case SAVE_FRAMES: return take_frame_list(o, text);
    case STATS: return take_text(text, &o->stats);
    case WIREFRAME: return take_flag(&o->wireframe);
    case SHOW_ATLAS: return take_flag(&o->show_atlas);
    case COMPARE: return take_flag(&o->compare);
    case HELP: return take_flag(&o->help);
    case OPTION_COUNT: break;
    }
    return 0;
}

static void set_defaults(options *o)
{
    static const uint8_t light_blue[3] = { 0xa8, 0xc8, 0xe8 };
    memset(o, 0, sizeof *o);
    o->mode = "auto";
    o->terrimp_mode = TERRIMP_MODE_AUTO;
    o->terrain_size = 2049;
    o->seed = 1;
    o->width = 1280;
    o->height = 1024;
    o->fov_degrees = 60.0f;
    o->fps = 60.0f;
    memcpy(o->sky, light_blue, sizeof o->sky);
}

int options_parse(options *o, int argc, char **argv)
{
    int i;
    set_defaults(o);
    for (i = 1; i < argc; i++) {
        const option *found = find_option(argv[i]);
        const char *value = NULL;
        if (!found) {
            snprintf(o->error, sizeof o->error, "unknown option %s (see --help)", argv[i]);
            return 0;
        }
        if (found->value && ++i < argc)
            value = argv[i];
        if (found->value && !value) {
            snprintf(o->error, sizeof o->error, "%s needs %s", found->name, found->value);
            return 0;
        }
        if (!take(o, found->id, value)) {
            snprintf(o->error, sizeof o->error, "%s takes %s, not %s", found->name, found->value,
                     value);
            return 0;
        }
        o->given |= (uint64_t)1 << found->id;
    }
    return 1;
}

static int is_given(const options *o, option_id id)
{
    return (int)(o->given >> id & 1u);
}

static void print_ignored(const options *o, option_id id, const char *why, FILE *file)
{
    if (is_given(o, id))
        fprintf(file, "flyover: %s is ignored: %s\n", table[id].name, why);
}

void options_print_ignored(const options *o, int raw, FILE *file)
{
    static const option_id of_raw[] = { FORMAT, RAW_SIZE, BIG_ENDIAN, SKIP, STRIDE };
    static const option_id of_file[] = { NO_DATA, CROP }, of_none[] = { TERRAIN_SIZE, SEED };
    static const option_id of_out[] = { SAVE_EVERY, SAVE_FRAMES, WIREFRAME, SHOW_ATLAS };
    size_t i;
    for (i = 0; i < 5; i++)
        if (!raw)
            print_ignored(o, of_raw[i], o->dem ? "the file is not raw" : "there is no --dem", file);
    for (i = 0; i < 2; i++)
        print_ignored(o, o->dem ? of_none[i] : of_file[i],
                      o->dem ? "the terrain is that of --dem" : "there is no --dem", file);
    for (i = 0; i < 4; i++)
        if (!o->out)
            print_ignored(o, of_out[i], "there is no --out", file);
    if (o->path) {
        print_ignored(o, SPEED, "--path says where the eye is", file);
        print_ignored(o, FPS, "--path says where the eye is", file);
        print_ignored(o, ABOVE, "--path says where the eye is", file);
    }
}

void options_print_help(FILE *file)
{
    size_t i;
    fprintf(file, "usage: flyover [options]\n");
    for (i = 0; i < OPTION_COUNT; i++) {
        char left[48];
        snprintf(left, sizeof left, "%s %s", table[i].name, table[i].value ? table[i].value : "");
        fprintf(file, "  %-26s %s\n", left, table[i].help);
    }
}

int options_saves(const options *o, uint32_t frame)
{
    uint32_t i;
    if (o->save_every && frame % o->save_every == 0)
        return 1;
    for (i = 0; i < o->save_frame_count; i++)
        if (o->save_frames[i] == frame)
            return 1;
    return 0;
}
