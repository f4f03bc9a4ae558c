/* The heightfield room: random small fields in every format, against the plainest possible oracles.
   Oracles may use double; the library does not. */

#include <float.h>
#include <math.h>

enum { HF_CELLS = 24 * 24 };

/* A random field and its memory: rows lie apart by a random gap, spacing and origin are random. */
typedef struct hf_field {
    terrimp_heightfield view;
    union {
        uint8_t u8[HF_CELLS * 8];
        uint16_t u16[HF_CELLS * 4];
        int16_t s16[HF_CELLS * 4];
        float f32[HF_CELLS * 2];
    } memory;
    uint32_t stride; /* samples from row to row */
} hf_field;

static float hf_get(const hf_field *f, uint32_t x, uint32_t z)
{
    size_t i = (size_t)z * f->stride + x;
    switch (f->view.format) {
    case TERRIMP_FORMAT_U8: return (float)f->memory.u8[i];
    case TERRIMP_FORMAT_U16: return (float)f->memory.u16[i];
    case TERRIMP_FORMAT_S16: return (float)f->memory.s16[i];
    default: return f->memory.f32[i];
    }
}

static void hf_set(hf_field *f, uint32_t x, uint32_t z, float value)
{
    size_t i = (size_t)z * f->stride + x;
    switch (f->view.format) {
    case TERRIMP_FORMAT_U8: f->memory.u8[i] = (uint8_t)value; break;
    case TERRIMP_FORMAT_U16: f->memory.u16[i] = (uint16_t)value; break;
    case TERRIMP_FORMAT_S16: f->memory.s16[i] = (int16_t)value; break;
    default: f->memory.f32[i] = value; break;
    }
}

static void hf_random(hf_field *f, uint32_t width, uint32_t depth)
{
    static const uint32_t size[] = {0, 1, 2, 2, 4};
    uint32_t x, z;

    memset(f, 0, sizeof *f);
    f->stride = width + random_range(0, 5);
    f->view.samples = &f->memory;
    f->view.width = width;
    f->view.depth = depth;
    f->view.format = (int)random_range(TERRIMP_FORMAT_U8, TERRIMP_FORMAT_F32);
    f->view.row_bytes = (size_t)f->stride * size[f->view.format];
    f->view.spacing_x = random_float(0.25f, 4.0f);
    f->view.spacing_z = random_float(0.25f, 4.0f);
    f->view.height_scale = random_float(0.01f, 0.1f);
    f->view.height_offset = random_float(-50.0f, 50.0f);
    f->view.origin_x = random_float(-100.0f, 100.0f);
    f->view.origin_z = random_float(-100.0f, 100.0f);
    for (z = 0; z < depth; ++z)
        for (x = 0; x < width; ++x)
            hf_set(f, x, z, f->view.format == TERRIMP_FORMAT_S16 ? random_float(-100.0f, 100.0f)
                                                                 : random_float(0.0f, 250.0f));
}

static float hf_height(const hf_field *f, uint32_t x, uint32_t z)
{
    return terrimpi_float(f->view.height_offset + f->view.height_scale * hf_get(f, x, z));
}

static float hf_nan(void)
{
    float zero = 0.0f;
    return zero / zero;
}

/* ---- the descriptor ---- */

static void hf_resolve_fills_the_documented_defaults(void)
{
    float samples[6] = {0};
    terrimp_heightfield in;

    memset(&in, 0, sizeof in);
    in.samples = samples;
    in.width = 3;
    in.depth = 2;
    CHECK(terrimp_heightfield_resolve(&in, &in) == TERRIMP_OK); /* out may be in */
    CHECK(in.format == TERRIMP_FORMAT_F32);
    CHECK(in.row_bytes == 3 * sizeof(float));
    CHECK(in.spacing_x == 1.0f && in.spacing_z == 1.0f && in.height_scale == 1.0f);
    CHECK(in.height_offset == 0.0f && in.origin_x == 0.0f && in.origin_z == 0.0f);
}

/* Resolves the good field with one float member replaced. */
static int hf_resolve_with(const hf_field *f, size_t member, float value)
{
    terrimp_heightfield in = f->view, out;
    int result;

    memcpy((char *)&in + member, &value, sizeof value);
    memset(&out, 77, sizeof out);
    result = (int)terrimp_heightfield_resolve(&in, &out);
    CHECK(result == TERRIMP_OK || out.width == 0x4d4d4d4du); /* untouched on errors */
    return result;
}

static void hf_resolve_refuses_bad_numbers(void)
{
    static const size_t member[] = {
        offsetof(terrimp_heightfield, spacing_x),    offsetof(terrimp_heightfield, spacing_z),
        offsetof(terrimp_heightfield, height_scale), offsetof(terrimp_heightfield, height_offset),
        offsetof(terrimp_heightfield, origin_x),     offsetof(terrimp_heightfield, origin_z)};
    hf_field f;
    size_t i;

    hf_random(&f, 5, 4);
    f.view.format = TERRIMP_FORMAT_U8;
    for (i = 0; i < 6; ++i) {
        CHECK(hf_resolve_with(&f, member[i], hf_nan()) == TERRIMP_E_NOT_FINITE);
        CHECK(hf_resolve_with(&f, member[i], (float)HUGE_VAL) == TERRIMP_E_NOT_FINITE);
        CHECK(hf_resolve_with(&f, member[i], -(float)HUGE_VAL) == TERRIMP_E_NOT_FINITE);
        if (i != 3)
            CHECK(hf_resolve_with(&f, member[i], FLT_MAX) == TERRIMP_E_RANGE);
        if (i < 3)
            CHECK(hf_resolve_with(&f, member[i], -1.0f) == TERRIMP_E_RANGE);
    }
}

static void hf_resolve_refuses_bad_sizes_and_memory(void)
{
    static const uint32_t bad[] = {0, 1, TERRIMP_MAX_DIM + 1u, 0xffffffffu};
    hf_field f;
    terrimp_heightfield in, out;
    size_t i;

    hf_random(&f, 5, 4);
    f.view.format = TERRIMP_FORMAT_S16;
    f.view.row_bytes = 0;
    CHECK(terrimp_heightfield_resolve(NULL, &out) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_resolve(&f.view, NULL) == TERRIMP_E_NULL);
    in = f.view;
    in.samples = NULL;
    CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_E_NULL);
    for (i = 0; i < 4; ++i) {
        in = f.view;
        in.width = bad[i];
        CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_E_RANGE);
        in = f.view;
        in.depth = bad[i];
        CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_E_RANGE);
    }
    in = f.view;
    in.format = TERRIMP_FORMAT_COUNT;
    CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_E_RANGE);
    in.format = -1;
    CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_E_RANGE);
    in = f.view;
    in.row_bytes = 8; /* five samples need ten */
    CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_E_RANGE);
    in.row_bytes = 11;
    CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_E_RANGE);
    in.row_bytes = (size_t)-2;
    CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_E_OVERFLOW);
    in = f.view;
    in.samples = (const char *)f.view.samples + 1;
    CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_E_ALIGN);
    in.format = TERRIMP_FORMAT_U8;
    CHECK(terrimp_heightfield_resolve(&in, &out) == TERRIMP_OK);
}

/* ---- reading ---- */

static void hf_validate_finds_the_first_void(void)
{
    int round;

    for (round = 0; round < 200; ++round) {
        hf_field f;
        uint32_t x = 99, z = 99, first, second, cells;
        hf_random(&f, random_range(2, 20), random_range(2, 20));
        f.view.has_no_data = 1;
        f.view.no_data = 253.0f; /* the random samples stay below */
        CHECK(terrimp_heightfield_validate(&f.view, &x, &z) == TERRIMP_OK && x == 99 && z == 99);
        cells = f.view.width * f.view.depth;
        first = random_range(0, cells - 1);
        second = random_range(first, cells - 1);
        hf_set(&f, first % f.view.width, first / f.view.width, 253.0f);
        hf_set(&f, second % f.view.width, second / f.view.width, 253.0f);
        CHECK(terrimp_heightfield_validate(&f.view, &x, &z) == TERRIMP_E_VOID);
        CHECK(x == first % f.view.width && z == first / f.view.width);
        CHECK(terrimp_heightfield_validate(&f.view, NULL, NULL) == TERRIMP_E_VOID);
        f.view.has_no_data = 0;
        CHECK(terrimp_heightfield_validate(&f.view, &x, &z) == TERRIMP_OK);
    }
}

static void hf_nan_is_a_void_only_with_has_no_data(void)
{
    float samples[600] = {0}, height = 5.0f, low = 3.0f, high = 4.0f;
    terrimp_heightfield field;
    uint32_t x = 0, z = 0;

    memset(&field, 0, sizeof field);
    field.samples = samples;
    field.width = 300;
    field.depth = 2;
    samples[571] = hf_nan();
    field.no_data = -9999.0f;
    CHECK(terrimp_heightfield_validate(&field, &x, &z) == TERRIMP_E_NOT_FINITE);
    CHECK(x == 271 && z == 1);
    CHECK(terrimp_heightfield_read(&field, 271, 1, 1, 1, 1, &height) == TERRIMP_E_NOT_FINITE);
    CHECK(terrimp_heightfield_bounds(&field, 0, 0, 300, 2, &low, &high) == TERRIMP_E_NOT_FINITE);
    CHECK(terrimp_heightfield_height(&field, 270.5f, 0.5f, &height) == TERRIMP_E_NOT_FINITE);
    CHECK(height == 5.0f && low == 3.0f && high == 4.0f);
    field.has_no_data = 1;
    CHECK(terrimp_heightfield_validate(&field, &x, &z) == TERRIMP_E_VOID);
    CHECK(terrimp_heightfield_read(&field, 271, 1, 1, 1, 1, &height) == TERRIMP_E_VOID);
    CHECK(terrimp_heightfield_bounds(&field, 0, 0, 300, 2, &low, &high) == TERRIMP_OK);
    CHECK(low == 0.0f && high == 0.0f);
    x = z = 0;
    samples[1] = 1.0f;
    samples[571] = field.no_data = 0.5f; /* a void need not be beyond the other samples */
    CHECK(terrimp_heightfield_validate(&field, &x, &z) == TERRIMP_E_VOID && x == 271 && z == 1);
    CHECK(terrimp_heightfield_bounds(&field, 0, 0, 300, 2, &low, &high) == TERRIMP_OK);
    CHECK(low == 0.0f && high == 1.0f);
    samples[571] = FLT_MAX; /* a sample may be finite and its height not */
    field.height_scale = 2.0f;
    CHECK(terrimp_heightfield_validate(&field, &x, &z) == TERRIMP_E_NOT_FINITE);
}

static void hf_samples_and_tiles_are_offset_plus_scale_times_sample(void)
{
    int round;

    for (round = 0; round < 300; ++round) {
        hf_field f;
        float tile[145], height = 0.0f;
        uint32_t x, z, cols = random_range(1, 12), rows = random_range(1, 12), r, c;
        uint32_t stride = round % 9 == 0 ? 0xfffffff0u : random_range(1, 9);
        hf_random(&f, random_range(2, 24), random_range(2, 24));
        x = random_range(0, f.view.width - 1);
        z = random_range(0, f.view.depth - 1);
        CHECK(terrimp_heightfield_read(&f.view, x, z, 1, 1, 1, &height) == TERRIMP_OK);
        CHECK(height == hf_height(&f, x, z));
        tile[rows * cols] = 12345.0f; /* one past the end */
        CHECK(terrimp_heightfield_read(&f.view, x, z, cols, rows, stride, tile) == TERRIMP_OK);
        CHECK(tile[rows * cols] == 12345.0f);
        for (r = 0; r < rows; ++r)
            for (c = 0; c < cols; ++c) {
                uint64_t at_x = x + (uint64_t)c * stride, at_z = z + (uint64_t)r * stride;
                if (at_x > f.view.width - 1u)
                    at_x = f.view.width - 1u;
                if (at_z > f.view.depth - 1u)
                    at_z = f.view.depth - 1u;
                CHECK(tile[r * cols + c] == hf_height(&f, (uint32_t)at_x, (uint32_t)at_z));
            }
        CHECK(terrimp_heightfield_read(&f.view, f.view.width, z, 1, 1, 1, &height) ==
              TERRIMP_E_RANGE);
        CHECK(terrimp_heightfield_read(&f.view, x, f.view.depth, 1, 1, 1, &height) ==
              TERRIMP_E_RANGE);
    }
}

/* A tile fails exactly when it reads the void, and then writes nothing. */
static void hf_read_refuses_a_tile_with_a_void(void)
{
    int round;

    for (round = 0; round < 300; ++round) {
        hf_field f;
        float tile[16];
        uint32_t vx, vz, r, c, stride = random_range(1, 7);
        int reads = 0, result;
        hf_random(&f, random_range(2, 16), random_range(2, 16));
        vx = random_range(0, f.view.width - 1);
        vz = random_range(0, f.view.depth - 1);
        f.view.has_no_data = 1;
        f.view.no_data = 253.0f;
        hf_set(&f, vx, vz, 253.0f);
        for (r = 0; r < 4; ++r)
            for (c = 0; c < 4; ++c) {
                uint32_t x = c * stride, z = r * stride;
                x = x < f.view.width ? x : f.view.width - 1;
                z = z < f.view.depth ? z : f.view.depth - 1;
                reads |= x == vx && z == vz;
            }
        tile[0] = 12345.0f;
        result = (int)terrimp_heightfield_read(&f.view, 0, 0, 4, 4, stride, tile);
        CHECK(result == (reads ? TERRIMP_E_VOID : TERRIMP_OK));
        CHECK((tile[0] == 12345.0f) == reads);
    }
}

static void hf_bounds_are_exact_and_skip_voids(void)
{
    int round;

    for (round = 0; round < 600; ++round) {
        hf_field f;
        float low, high, least = FLT_MAX, most = -FLT_MAX;
        uint32_t x, z, cols = random_range(1, 30), rows = random_range(1, 30), i, j;
        hf_random(&f, random_range(2, 24), random_range(2, 24));
        f.view.has_no_data = round % 2; /* else what stands for a void is a height */
        f.view.no_data = 253.0f;
        for (i = 0; i < 40; ++i)
            hf_set(&f, random_range(0, f.view.width - 1), random_range(0, f.view.depth - 1),
                   253.0f);
        x = random_range(0, f.view.width - 1);
        z = random_range(0, f.view.depth - 1);
        for (j = z; j < f.view.depth && j < z + rows; ++j)
            for (i = x; i < f.view.width && i < x + cols; ++i)
                if (!f.view.has_no_data || hf_get(&f, i, j) != 253.0f) {
                    least = fminf(least, hf_height(&f, i, j));
                    most = fmaxf(most, hf_height(&f, i, j));
                }
        if (least > most) {
            CHECK(terrimp_heightfield_bounds(&f.view, x, z, cols, rows, &low, &high) ==
                  TERRIMP_E_VOID);
            continue;
        }
        CHECK(terrimp_heightfield_bounds(&f.view, x, z, cols, rows, &low, &high) == TERRIMP_OK);
        CHECK(low == least && high == most);
    }
}

static void hf_read_and_bounds_refuse_bad_arguments(void)
{
    hf_field f;
    float out[4], low, high;

    hf_random(&f, 5, 4);
    CHECK(terrimp_heightfield_validate(NULL, NULL, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_read(NULL, 0, 0, 1, 1, 1, out) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_read(&f.view, 0, 0, 1, 1, 1, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_read(NULL, 0, 0, 1, 1, 1, out) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_read(&f.view, 0, 0, 1, 1, 1, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_read(&f.view, 5, 0, 1, 1, 1, out) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_read(&f.view, 0, 4, 1, 1, 1, out) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_read(&f.view, 0, 0, 0, 1, 1, out) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_read(&f.view, 0, 0, 1, 0, 1, out) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_read(&f.view, 0, 0, 1, 1, 0, out) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_read(&f.view, 0, 0, 0xffffffffu, 0xffffffffu, 1, out) ==
          TERRIMP_E_OVERFLOW);
    CHECK(terrimp_heightfield_bounds(NULL, 0, 0, 1, 1, &low, &high) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_bounds(&f.view, 0, 0, 1, 1, NULL, &high) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_bounds(&f.view, 0, 0, 1, 1, &low, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_bounds(&f.view, 5, 0, 1, 1, &low, &high) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_bounds(&f.view, 0, 4, 1, 1, &low, &high) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_bounds(&f.view, 0, 0, 0, 1, &low, &high) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_bounds(&f.view, 0, 0, 0xffffffffu, 0xffffffffu, &low, &high) ==
          TERRIMP_OK); /* what reaches over the edges is cut */
}

/* ---- voids ---- */

/* Fills a field in scratch of exactly the promised size, so that a sanitizer sees any overrun. */
static int hf_fill(terrimp_heightfield *view, void *samples, size_t *count)
{
    size_t bytes = terrimp_heightfield_fill_voids_scratch_bytes(view->width, view->depth);
    void *scratch = malloc(bytes);
    int result;

    memset(scratch, 0x7f, bytes); /* what lies in the scratch must not matter */
    result = (int)terrimp_heightfield_fill_voids(view, samples, scratch, bytes, count);
    CHECK((int)terrimp_heightfield_fill_voids(view, samples, scratch, bytes - 1, NULL) ==
          TERRIMP_E_MEMORY);
    free(scratch);
    return result;
}

/* In every format, with the no-data value amid the valid ones: all voids and only voids change, the
   range of the valid samples is kept, and no filled sample is a void again. */
static void hf_filling_keeps_valid_samples_and_their_range(void)
{
    int round;

    for (round = 0; round < 300; ++round) {
        static hf_field f, before;
        float low = FLT_MAX, high = -FLT_MAX;
        uint32_t x, z, i, holes = random_range(1, 300), voids = 0;
        size_t count = 77;
        int result;
        hf_random(&f, random_range(2, 24), random_range(2, 24));
        f.view.has_no_data = 1;
        f.view.no_data = 60.0f;
        for (i = 0; i < holes; ++i)
            hf_set(&f, random_range(0, f.view.width - 1), random_range(0, f.view.depth - 1),
                   f.view.format == TERRIMP_FORMAT_F32 && (i & 1u) ? hf_nan() : 60.0f);
        memcpy(&before, &f, sizeof f);
        for (z = 0; z < f.view.depth; ++z)
            for (x = 0; x < f.view.width; ++x) {
                float v = hf_get(&f, x, z);
                if (v == 60.0f || v != v) {
                    ++voids;
                    continue;
                }
                low = fminf(low, v);
                high = fmaxf(high, v);
            }
        result = hf_fill(&f.view, &f.memory, &count);
        if (voids == f.view.width * f.view.depth) {
            CHECK(result == TERRIMP_E_VOID && count == 77);
            CHECK(memcmp(&before.memory, &f.memory, sizeof f.memory) == 0);
            continue;
        }
        CHECK(result == TERRIMP_OK && count == voids);
        for (z = 0; z < f.view.depth; ++z)
            for (x = 0; x < f.stride; ++x) {
                float was = hf_get(&before, x, z), is = hf_get(&f, x, z);
                if (x < f.view.width && (was == 60.0f || was != was))
                    CHECK(is >= low && is <= high && is != 60.0f);
                else
                    CHECK(was == is || was != was); /* and so does the gap between the rows */
            }
    }
}

/* A plane is its own membrane where a void lies within it; here the void is a ring. */
static void hf_filling_a_hole_in_a_plane_restores_the_plane(void)
{
    static float samples[100 * 90];
    terrimp_heightfield field;
    int x, z;
    size_t count, holes = 0;
    float error = 0.0f, bend = 0.0f; /* largest, also of a sample against its neighbours' mean */

    memset(&field, 0, sizeof field);
    field.samples = samples;
    field.width = 100;
    field.depth = 90;
    field.no_data = -9999.0f;
    field.has_no_data = 1;
    for (z = 0; z < 90; ++z)
        for (x = 0; x < 100; ++x) {
            int from_centre = (x - 47) * (x - 47) + (z - 44) * (z - 44);
            int hole = from_centre > 6 * 6 && from_centre < 38 * 38;
            samples[z * 100 + x] = hole ? -9999.0f : 3.0f * (float)x - 2.0f * (float)z;
            holes += (size_t)hole;
        }
    CHECK(hf_fill(&field, samples, &count) == TERRIMP_OK && count == holes);
    for (z = 1; z < 89; ++z)
        for (x = 1; x < 99; ++x) {
            const float *at = &samples[z * 100 + x];
            error = fmaxf(error, fabsf(at[0] - (3.0f * (float)x - 2.0f * (float)z)));
            bend = fmaxf(bend, fabsf(0.25f * (at[-1] + at[1] + at[-100] + at[100]) - at[0]));
        }
    CHECK(error < 4.0f && bend < 0.5f);
}

/* A third has no exact mean in float, yet a flat field stays flat to the bit. */
static void hf_filling_a_flat_field_keeps_it_flat(void)
{
    int round;

    for (round = 0; round < 50; ++round) {
        float samples[15 * 11], value = random_float(-1.0f, 1.0f) / 3.0f;
        terrimp_heightfield field;
        int i;
        memset(&field, 0, sizeof field);
        field.samples = samples;
        field.width = 15;
        field.depth = 11;
        field.no_data = -9999.0f;
        field.has_no_data = 1;
        for (i = 0; i < 15 * 11; ++i)
            samples[i] = i == 7 || random_range(0, 2) == 0 ? value : -9999.0f;
        CHECK(hf_fill(&field, samples, NULL) == TERRIMP_OK);
        for (i = 0; i < 15 * 11; ++i)
            CHECK(samples[i] == value);
    }
}

/* Half of the field void, ending in a jagged rim: steps to and between filled samples are no larger
   than the steps of the terrain. */
static void hf_filling_makes_no_spikes_and_no_steps(void)
{
    enum { SIDE = 150 };
    static float samples[SIDE * SIDE];
    static int hole[SIDE * SIDE];
    terrimp_heightfield field;
    float steepest = 0.0f, step = 0.0f;
    int x, z;

    memset(&field, 0, sizeof field);
    field.samples = samples;
    field.width = SIDE;
    field.depth = SIDE;
    field.no_data = -9999.0f;
    field.has_no_data = 1;
    for (z = 0; z < SIDE; ++z)
        for (x = 0; x < SIDE; ++x) {
            float *at = &samples[z * SIDE + x];
            *at = 30.0f * sinf((float)x * 0.13f) * cosf((float)z * 0.11f);
            if (x > 0)
                steepest = fmaxf(steepest, fabsf(at[0] - at[-1]));
        }
    for (z = 0; z < SIDE; ++z)
        for (x = 0; x < SIDE; ++x)
            if ((hole[z * SIDE + x] = z + x / 7 % 5 < SIDE / 2) != 0)
                samples[z * SIDE + x] = hf_nan();
    CHECK(hf_fill(&field, samples, NULL) == TERRIMP_OK);
    for (z = 1; z < SIDE; ++z)
        for (x = 1; x < SIDE; ++x) {
            const float *at = &samples[z * SIDE + x];
            if (hole[z * SIDE + x])
                step = fmaxf(step, fabsf(at[0] - at[-1]));
            if (hole[z * SIDE + x] || hole[(z - 1) * SIDE + x])
                step = fmaxf(step, fabsf(at[0] - at[-SIDE]));
        }
    CHECK(step <= 1.1f * steepest);
}

static void hf_filling_refuses_bad_arguments(void)
{
    static hf_field f;
    static float scratch[4096];
    size_t count = 77;

    hf_random(&f, 8, 8);
    CHECK(terrimp_heightfield_fill_voids_scratch_bytes(1, 8) == 0);
    CHECK(terrimp_heightfield_fill_voids_scratch_bytes(8, TERRIMP_MAX_DIM + 1u) == 0);
    CHECK(terrimp_heightfield_fill_voids_scratch_bytes(3601, 3601) < (size_t)3601 * 3601 * 17 / 10);
    CHECK(terrimp_heightfield_fill_voids(NULL, &f.memory, scratch, sizeof scratch, &count) ==
          TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_fill_voids(&f.view, NULL, scratch, sizeof scratch, &count) ==
          TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_fill_voids(&f.view, &f.memory, NULL, 9999, &count) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_fill_voids(&f.view, scratch, scratch, sizeof scratch, &count) ==
          TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_fill_voids(&f.view, &f.memory, (char *)scratch + 1, 9999, &count) ==
          TERRIMP_E_ALIGN);
    CHECK(terrimp_heightfield_fill_voids(&f.view, &f.memory, scratch, 10, &count) ==
          TERRIMP_E_MEMORY);
    CHECK(count == 77);
    CHECK(terrimp_heightfield_fill_voids(&f.view, &f.memory, scratch, sizeof scratch, &count) ==
          TERRIMP_OK);
    CHECK(count == 0);
    f.view.format = TERRIMP_FORMAT_F32;
    f.view.row_bytes = 0;
    f.view.has_no_data = 1;
    memset(&f.memory, 0, sizeof f.memory);
    f.memory.f32[9] = (float)HUGE_VAL;
    CHECK(terrimp_heightfield_fill_voids(&f.view, &f.memory, scratch, sizeof scratch, &count) ==
          TERRIMP_E_NOT_FINITE);
}

/* ---- queries on the surface ---- */

/* The corners of triangle 0 or 1 of a quad, as the header's conventions say, in double. */
static void hf_triangle(const hf_field *f, uint32_t x, uint32_t z, int which, double corner[3][3])
{
    static const uint32_t at[2][3][2] = {{{0, 0}, {0, 1}, {1, 1}}, {{0, 0}, {1, 1}, {1, 0}}};
    int i;

    for (i = 0; i < 3; ++i) {
        uint32_t cx = x + at[which][i][0], cz = z + at[which][i][1];
        corner[i][0] = (double)terrimpi_float(f->view.origin_x + (float)cx * f->view.spacing_x);
        corner[i][1] = (double)hf_height(f, cx, cz);
        corner[i][2] = (double)terrimpi_float(f->view.origin_z + (float)cz * f->view.spacing_z);
    }
}

/* The normal, not yet of unit length, by the winding of the conventions. */
static void hf_normal(double c[3][3], double n[3])
{
    double a[3], b[3];
    int i;

    for (i = 0; i < 3; ++i) {
        a[i] = c[1][i] - c[0][i];
        b[i] = c[2][i] - c[0][i];
    }
    n[0] = a[1] * b[2] - a[2] * b[1];
    n[1] = a[2] * b[0] - a[0] * b[2];
    n[2] = a[0] * b[1] - a[1] * b[0];
}

static double hf_plane_height(double c[3][3], double x, double z)
{
    double n[3];
    hf_normal(c, n);
    return c[0][1] - (n[0] * (x - c[0][0]) + n[2] * (z - c[0][2])) / n[1];
}

/* At a random point of a random triangle, kept off its edges: that triangle's height and normal. */
static void hf_height_and_normal_agree_with_the_triangles(void)
{
    int round;

    for (round = 0; round < 4000; ++round) {
        static hf_field f;
        double c[3][3], n[3], length;
        float a = random_float(0.01f, 1.0f), b = random_float(0.01f, 1.0f), k =
            random_float(0.01f, 1.0f), sum = a + b + k, x, z, height = 0.0f, normal[3];
        uint32_t i, j;
        if (round % 20 == 0)
            hf_random(&f, random_range(2, 24), random_range(2, 24));
        i = random_range(0, f.view.width - 2);
        j = random_range(0, f.view.depth - 2);
        hf_triangle(&f, i, j, round & 1, c);
        x = (float)((double)(a / sum) * c[0][0] + (double)(b / sum) * c[1][0] +
                    (double)(k / sum) * c[2][0]);
        z = (float)((double)(a / sum) * c[0][2] + (double)(b / sum) * c[1][2] +
                    (double)(k / sum) * c[2][2]);
        CHECK(terrimp_heightfield_height(&f.view, x, z, &height) == TERRIMP_OK);
        CHECK(fabs((double)height - hf_plane_height(c, (double)x, (double)z)) < 2e-5 * 75.0);
        CHECK(terrimp_heightfield_normal(&f.view, x, z, normal) == TERRIMP_OK);
        hf_normal(c, n);
        CHECK(n[1] > 0.0); /* the winding of the conventions faces up */
        length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        CHECK(fabs((double)normal[0] - n[0] / length) < 1e-4 &&
              fabs((double)normal[1] - n[1] / length) < 1e-4 &&
              fabs((double)normal[2] - n[2] / length) < 1e-4);
    }
}

/* To the last bit, where an origin far from the position makes the quotient a guess. */
static void hf_a_position_lies_between_the_lines_of_its_quad(void)
{
    int round;

    for (round = 0; round < 100000; ++round) {
        uint32_t count = random_range(2, 5000), quad = 0, at = random_range(0, count - 2);
        float spacing = random_float(0.5f, 3.0f);
        float origin = -spacing * (float)at + random_float(-1.0f, 1.0f);
        float x = random_float(terrimpi_field_line(origin, spacing, at),
                               terrimpi_field_line(origin, spacing, at + 1u));
        if (round & 1)
            x = terrimpi_field_line(origin, spacing, at);
        if (!terrimpi_field_locate_along(origin, spacing, count, x, &quad)) {
            CHECK(0);
            continue;
        }
        CHECK(quad <= count - 2 && terrimpi_field_line(origin, spacing, quad) <= x);
        CHECK(x < terrimpi_field_line(origin, spacing, quad + 1u) ||
              (quad == count - 2 && x == terrimpi_field_line(origin, spacing, count - 1u)));
    }
}

/* Where a quad is a few steps of a float: the rounded columns and rows are what counts. */
static void hf_height_is_right_at_distant_origins(void)
{
    int round;

    for (round = 0; round < 3000; ++round) {
        static hf_field f;
        double c[3][3], u, v;
        float x, z, height = 0.0f;
        uint32_t i = 0, j = 0;
        if (round % 20 == 0) {
            hf_random(&f, random_range(2, 24), random_range(2, 24));
            f.view.origin_x = terrimpi_float(random_float(-1.0f, 1.0f) * 4.0e6f);
            f.view.origin_z = terrimpi_float(random_float(-1.0f, 1.0f) * 4.0e6f);
            f.view.spacing_x = terrimpi_float(random_float(0.6f, 3.0f));
            f.view.spacing_z = terrimpi_float(random_float(0.6f, 3.0f));
        }
        x = terrimpi_float(f.view.origin_x +
                           random_float(0.0f, (float)(f.view.width - 1)) * f.view.spacing_x);
        z = terrimpi_float(f.view.origin_z +
                           random_float(0.0f, (float)(f.view.depth - 1)) * f.view.spacing_z);
        while (i + 2 < f.view.width
               && terrimpi_float(f.view.origin_x + (float)(i + 1) * f.view.spacing_x) < x)
            ++i;
        while (j + 2 < f.view.depth
               && terrimpi_float(f.view.origin_z + (float)(j + 1) * f.view.spacing_z) < z)
            ++j;
        hf_triangle(&f, i, j, 0, c);
        u = ((double)x - c[0][0]) / (c[2][0] - c[0][0]);
        v = ((double)z - c[0][2]) / (c[2][2] - c[0][2]);
        hf_triangle(&f, i, j, v >= u ? 0 : 1, c);
        CHECK(terrimp_heightfield_height(&f.view, x, z, &height) == TERRIMP_OK);
        CHECK(fabs((double)height - hf_plane_height(c, (double)x, (double)z)) < 1e-4);
    }
}

static void hf_height_at_a_sample_is_the_sample(void)
{
    int round;

    for (round = 0; round < 50; ++round) {
        static hf_field f;
        uint32_t x, z;
        float height = 0.0f;
        hf_random(&f, random_range(2, 24), random_range(2, 24));
        if (round & 1) { /* far out, where a quad is a few steps of a float */
            f.view.origin_x = 4.0e6f;
            f.view.origin_z = -3.0e6f;
            f.view.spacing_x = f.view.spacing_z = 1.3f;
        }
        for (z = 0; z < f.view.depth; ++z)
            for (x = 0; x < f.view.width; ++x) {
                CHECK(terrimp_heightfield_height(
                          &f.view, f.view.origin_x + (float)x * f.view.spacing_x,
                          f.view.origin_z + (float)z * f.view.spacing_z, &height) == TERRIMP_OK);
                CHECK(height == hf_height(&f, x, z));
            }
    }
}

static void hf_queries_outside_miss_and_in_holes_are_void(void)
{
    hf_field f;
    float height = 5.0f, normal[3], last;

    hf_random(&f, 5, 4);
    f.view.spacing_x = f.view.spacing_z = 2.0f;
    f.view.origin_x = f.view.origin_z = 10.0f;
    last = 10.0f + 4.0f * 2.0f;
    CHECK(terrimp_heightfield_height(&f.view, last, 16.0f, &height) == TERRIMP_OK);
    height = 5.0f;
    CHECK(terrimp_heightfield_height(&f.view, last + 0.001f, 12.0f, &height) == TERRIMP_E_MISS);
    CHECK(terrimp_heightfield_height(&f.view, 9.999f, 12.0f, &height) == TERRIMP_E_MISS);
    CHECK(terrimp_heightfield_height(&f.view, 12.0f, 16.01f, &height) == TERRIMP_E_MISS);
    CHECK(terrimp_heightfield_height(&f.view, 12.0f, 9.99f, &height) == TERRIMP_E_MISS);
    CHECK(terrimp_heightfield_height(&f.view, FLT_MAX, -FLT_MAX, &height) == TERRIMP_E_MISS);
    CHECK(terrimp_heightfield_height(&f.view, hf_nan(), 12.0f, &height) == TERRIMP_E_NOT_FINITE);
    CHECK(terrimp_heightfield_height(&f.view, 12.0f, hf_nan(), &height) == TERRIMP_E_NOT_FINITE);
    CHECK(terrimp_heightfield_height(NULL, 12.0f, 12.0f, &height) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_height(&f.view, 12.0f, 12.0f, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_normal(&f.view, 12.0f, 12.0f, NULL) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_normal(&f.view, 9.0f, 12.0f, normal) == TERRIMP_E_MISS);
    f.view.has_no_data = 1;
    f.view.no_data = 253.0f;
    hf_set(&f, 1, 1, 253.0f);
    CHECK(terrimp_heightfield_height(&f.view, 10.1f, 11.9f, &height) == TERRIMP_E_VOID);
    CHECK(terrimp_heightfield_normal(&f.view, 13.9f, 13.9f, normal) == TERRIMP_E_VOID);
    CHECK(height == 5.0f);
    CHECK(terrimp_heightfield_height(&f.view, 14.1f, 12.0f, &height) == TERRIMP_OK);
}

/* ---- rays ---- */

/* Where a ray meets a triangle grown by margin (of its barycentric weights); negative: nowhere. */
static double hf_meet(double c[3][3], const float o[3], const double way[3], double margin)
{
    double n[3], down, t, px, pz, area, w0, w1, w2;

    hf_normal(c, n);
    down = n[0] * way[0] + n[1] * way[1] + n[2] * way[2];
    if (fabs(down) < 1e-12)
        return -1.0;
    t = (n[0] * (c[0][0] - (double)o[0]) + n[1] * (c[0][1] - (double)o[1]) +
         n[2] * (c[0][2] - (double)o[2])) / down;
    px = (double)o[0] + t * way[0];
    pz = (double)o[2] + t * way[2];
    area = (c[1][0] - c[0][0]) * (c[2][2] - c[0][2]) - (c[2][0] - c[0][0]) * (c[1][2] - c[0][2]);
    w1 = ((px - c[0][0]) * (c[2][2] - c[0][2]) - (c[2][0] - c[0][0]) * (pz - c[0][2])) / area;
    w2 = ((c[1][0] - c[0][0]) * (pz - c[0][2]) - (px - c[0][0]) * (c[1][2] - c[0][2])) / area;
    w0 = 1.0 - w1 - w2;
    return w0 >= -margin && w1 >= -margin && w2 >= -margin ? t : -1.0;
}

/* The first meeting with any triangle of quads without voids; DBL_MAX: none. */
static double hf_first_meeting(const hf_field *f, const float o[3], const double way[3],
                               double margin)
{
    double best = DBL_MAX, c[3][3], t;
    uint32_t x, z;
    int which;

    for (z = 0; z + 1 < f->view.depth; ++z)
        for (x = 0; x + 1 < f->view.width; ++x) {
            if (f->view.has_no_data &&
                (hf_get(f, x, z) == f->view.no_data || hf_get(f, x + 1, z) == f->view.no_data ||
                 hf_get(f, x, z + 1) == f->view.no_data ||
                 hf_get(f, x + 1, z + 1) == f->view.no_data))
                continue;
            for (which = 0; which < 2; ++which) {
                hf_triangle(f, x, z, which, c);
                t = hf_meet(c, o, way, margin);
                if (t >= 0.0 && t < best)
                    best = t;
            }
        }
    return best;
}

/* A point in or round the box of the field. */
static void hf_random_point(const hf_field *f, float reach, float p[3])
{
    float extent_x = (float)(f->view.width - 1) * f->view.spacing_x;
    float extent_z = (float)(f->view.depth - 1) * f->view.spacing_z;
    p[0] = f->view.origin_x + extent_x * random_float(-reach, 1.0f + reach);
    p[1] = f->view.height_offset + random_float(-10.0f, 25.0f);
    p[2] = f->view.origin_z + extent_z * random_float(-reach, 1.0f + reach);
}

/* Against all triangles, grown and shrunk a little: the hit lies between the two first meetings. */
static void hf_raycast_agrees_with_all_triangles(void)
{
    int round, hits = 0;

    for (round = 0; round < 6000; ++round) {
        static hf_field f;
        terrimp_ray_hit hit;
        float o[3], target[3], d[3], limit = FLT_MAX;
        double way[3], length = 0.0, steep = 0.0, blur, soonest, latest;
        int i, result;
        if (round % 10 == 0) {
            hf_random(&f, random_range(2, 12), random_range(2, 12));
            if (round % 30 == 0) {
                f.view.has_no_data = 1;
                f.view.no_data = 253.0f;
                for (i = 0; i < 6; ++i)
                    hf_set(&f, random_range(0, f.view.width - 1),
                           random_range(0, f.view.depth - 1), 253.0f);
            }
        }
        hf_random_point(&f, round % 3 == 0 ? 2.0f : 0.0f, o);
        hf_random_point(&f, 0.1f, target);
        for (i = 0; i < 3; ++i) {
            d[i] = target[i] - o[i];
            if (round % 7 == i) /* along the axes too: planes, and at times lines */
                d[i] = 0.0f;
            if (round % 11 == i)
                d[i] = 0.0f;
        }
        if (d[0] == 0.0f && d[1] == 0.0f && d[2] == 0.0f)
            continue;
        for (i = 0; i < 3; ++i)
            length += (double)d[i] * (double)d[i];
        for (i = 0; i < 3; ++i)
            way[i] = (double)d[i] / sqrt(length);
        if (round % 5 == 0)
            limit = random_float(0.1f, 20.0f);
        result = (int)terrimp_heightfield_raycast(&f.view, o, d, limit, &hit);
        soonest = hf_first_meeting(&f, o, way, 1e-3);
        latest = hf_first_meeting(&f, o, way, -1e-3);
        if (result == TERRIMP_E_MISS) {
            CHECK(latest > (double)limit * 0.9999);
            continue;
        }
        ++hits;
        CHECK(result == TERRIMP_OK);
        for (i = 0; i < 3; ++i)
            steep += (double)hit.normal[i] * way[i];
        blur = 1e-3 + 1e-5 / (fabs(steep) + 1e-6); /* the flatter the ray meets the surface */
        CHECK((double)hit.distance >= soonest - blur && (double)hit.distance <= latest + blur);
        CHECK(hit.distance <= limit);
        for (i = 0; i < 3; i += 2)
            CHECK(fabs((double)hit.position[i] -
                       ((double)o[i] + (double)hit.distance * way[i])) < 2e-4);
        if (hit.distance > 0.02f && fabs(steep) > 2e-3) {
            /* An end just short of the hit, and one just beyond. */
            limit = hit.distance;
            CHECK(terrimp_heightfield_raycast(&f.view, o, d, limit - 0.01f, NULL) ==
                  TERRIMP_E_MISS);
            CHECK(terrimp_heightfield_raycast(&f.view, o, d, limit + 0.01f, NULL) == TERRIMP_OK);
        }
        CHECK(hit.x + 1 < f.view.width && hit.z + 1 < f.view.depth && hit.normal[1] > 0.0f);
    }
    CHECK(hits > 1500);
}

/* The hit is on the surface, as height and normal see it. */
static void hf_raycast_hits_lie_on_the_surface(void)
{
    int round;

    for (round = 0; round < 3000; ++round) {
        static hf_field f;
        terrimp_ray_hit hit;
        float o[3], d[3], height, normal[3];
        int i;
        if (round % 10 == 0)
            hf_random(&f, random_range(2, 24), random_range(2, 24));
        hf_random_point(&f, 0.0f, o);
        hf_random_point(&f, 0.0f, d);
        o[1] += 30.0f;
        for (i = 0; i < 3; ++i)
            d[i] -= o[i];
        if (terrimp_heightfield_raycast(&f.view, o, d, FLT_MAX, &hit) != TERRIMP_OK)
            continue;
        CHECK(terrimp_heightfield_height(&f.view, hit.position[0], hit.position[2], &height) ==
              TERRIMP_OK);
        CHECK(fabsf(height - hit.position[1]) < 2e-3f);
        CHECK(fabsf(o[1] + hit.distance * d[1] /
                    sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - height) < 5e-3f);
        CHECK(terrimp_heightfield_normal(&f.view, hit.position[0], hit.position[2], normal) ==
              TERRIMP_OK);
        CHECK(fabsf(hit.normal[0] * hit.normal[0] + hit.normal[1] * hit.normal[1] +
                    hit.normal[2] * hit.normal[2] - 1.0f) < 1e-5f);
    }
}

/* From above the highest to below the lowest sample, both within the outline: there is no way
   through, not along a column, a row or a diagonal, nor through a corner. */
static void hf_no_ray_leaks_through_the_surface(void)
{
    int round;

    for (round = 0; round < 20000; ++round) {
        static hf_field f;
        static float low, high;
        float a[3], b[3], d[3];
        uint32_t ax, az, bx, bz;
        int i, on_samples = round & 1, diagonal = round % 4 == 1;
        if (round % 50 == 0) {
            hf_random(&f, random_range(2, 24), random_range(2, 24));
            if (round % 100 == 0) /* numbers without rounding: corners are met exactly */
                f.view.spacing_x = f.view.spacing_z = 1.0f, f.view.origin_x = f.view.origin_z = 0;
            terrimp_heightfield_bounds(&f.view, 0, 0, f.view.width, f.view.depth, &low, &high);
        }
        hf_random_point(&f, -0.01f, a);
        hf_random_point(&f, -0.01f, b);
        if (on_samples) {
            ax = random_range(0, f.view.width - 1);
            az = random_range(0, f.view.depth - 1);
            bx = random_range(0, f.view.width - 1);
            bz = random_range(0, f.view.depth - 1);
            if (diagonal && ax + bz >= bx && ax + bz - bx < f.view.depth)
                az = ax + bz - bx;
            a[0] = f.view.origin_x + (float)ax * f.view.spacing_x;
            a[2] = f.view.origin_z + (float)az * f.view.spacing_z;
            b[0] = f.view.origin_x + (float)bx * f.view.spacing_x;
            b[2] = f.view.origin_z + (float)bz * f.view.spacing_z;
        }
        a[1] = high + random_float(0.1f, 5.0f);
        b[1] = low - random_float(0.1f, 5.0f);
        for (i = 0; i < 3; ++i)
            d[i] = b[i] - a[i];
        CHECK(terrimp_heightfield_raycast(&f.view, a, d, FLT_MAX, NULL) == TERRIMP_OK);
        for (i = 0; i < 3; ++i)
            d[i] = -d[i];
        CHECK(terrimp_heightfield_raycast(&f.view, b, d, FLT_MAX, NULL) == TERRIMP_OK);
    }
}

/* Aimed at points of edges and diagonals, where two triangles meet. */
static void hf_no_ray_leaks_between_two_triangles(void)
{
    int round, shots = 0;

    for (round = 0; round < 60000; ++round) {
        static hf_field f;
        static float low, high;
        float a[3], b[3], d[3], at[3], k;
        uint32_t x, z;
        int i, kind = (int)random_range(0, 2);
        if (round % 50 == 0) {
            uint32_t width = random_range(4, 24), depth = random_range(4, 24);
            hf_random(&f, width, depth);
            f.view.origin_x *= round % 100 == 0 ? 1.0f : 300.0f; /* some with coarse rounding */
            f.view.origin_z *= round % 100 == 0 ? 1.0f : 300.0f;
            terrimp_heightfield_bounds(&f.view, 0, 0, f.view.width, f.view.depth, &low, &high);
        }
        x = random_range(1, f.view.width - 3); /* not the rim: a ray may leave as it hits */
        z = random_range(1, f.view.depth - 3);
        k = random_float(0.0f, 1.0f);
        at[0] = f.view.origin_x + ((float)x + (kind == 1 ? 0.0f : k)) * f.view.spacing_x;
        at[2] = f.view.origin_z + ((float)z + (kind == 0 ? 0.0f : k)) * f.view.spacing_z;
        if (terrimp_heightfield_height(&f.view, at[0], at[2], &at[1]) != TERRIMP_OK)
            continue;
        hf_random_point(&f, 0.0f, a);
        a[1] = high + 1.0f;
        k = (a[1] - low + 1.0f) / (a[1] - at[1]);
        for (i = 0; i < 3; ++i) {
            d[i] = at[i] - a[i];
            b[i] = a[i] + d[i] * k;
        }
        if (terrimp_heightfield_height(&f.view, b[0], b[2], &k) != TERRIMP_OK)
            continue; /* it would leave through the side */
        ++shots;
        CHECK(terrimp_heightfield_raycast(&f.view, a, d, FLT_MAX, NULL) == TERRIMP_OK);
    }
    CHECK(shots > 5000);
}

/* Down from above, up from below to the underside; away from the surface there is nothing. */
static void hf_vertical_rays_measure_the_height(void)
{
    int round;

    for (round = 0; round < 2000; ++round) {
        static hf_field f;
        terrimp_ray_hit hit;
        float o[3], d[3] = {0.0f, -1.0f, 0.0f}, height;
        if (round % 10 == 0)
            hf_random(&f, random_range(2, 12), random_range(2, 12));
        hf_random_point(&f, 0.0f, o);
        if (terrimp_heightfield_height(&f.view, o[0], o[2], &height) != TERRIMP_OK)
            continue;
        d[1] = o[1] < height ? random_float(0.01f, 9.0f) : -random_float(0.01f, 9.0f);
        CHECK(terrimp_heightfield_raycast(&f.view, o, d, FLT_MAX, &hit) == TERRIMP_OK);
        CHECK(fabsf(hit.distance - fabsf(o[1] - height)) < 1e-4f);
        CHECK(hit.position[0] == o[0] && hit.position[1] == height && hit.position[2] == o[2]);
        d[1] = -d[1];
        CHECK(o[1] == height ||
              terrimp_heightfield_raycast(&f.view, o, d, FLT_MAX, &hit) == TERRIMP_E_MISS);
    }
}

static void hf_raycast_stands_extreme_numbers(void)
{
    static const float extreme[] = {0.0f,    1.0f,    -1.0f,  1e-38f, -1e-38f, 1e-44f,
                                    1e20f, -1e20f, FLT_MAX, -FLT_MAX, 1e-7f,  4096.5f};
    static hf_field f;
    int round, i;

    for (round = 0; round < 20000; ++round) {
        terrimp_ray_hit hit;
        float o[3], d[3];
        int result;
        if (round % 50 == 0)
            hf_random(&f, random_range(2, 12), random_range(2, 12));
        hf_random_point(&f, 0.5f, o);
        hf_random_point(&f, 0.5f, d);
        for (i = 0; i < 3; ++i) {
            if (random_range(0, 2) == 0)
                o[i] = extreme[random_range(0, 11)];
            if (random_range(0, 1) == 0)
                d[i] = extreme[random_range(0, 11)];
        }
        memset(&hit, 0, sizeof hit);
        result = (int)terrimp_heightfield_raycast(&f.view, o, d, FLT_MAX, &hit);
        CHECK(result == TERRIMP_OK || result == TERRIMP_E_MISS || result == TERRIMP_E_RANGE);
        CHECK(hit.distance >= 0.0f && hit.distance <= FLT_MAX);
        CHECK(hit.position[1] - hit.position[1] == 0.0f);
    }
}

static void hf_raycast_refuses_bad_arguments(void)
{
    hf_field f;
    terrimp_ray_hit hit;
    float o[3] = {0, 100, 0}, d[3] = {1, -1, 1}, zero[3] = {0, 0, 0}, bad[3] = {0, 0, 0};
    int i;

    hf_random(&f, 5, 4);
    memset(&hit, 0, sizeof hit);
    CHECK(terrimp_heightfield_raycast(NULL, o, d, 1.0f, &hit) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_raycast(&f.view, NULL, d, 1.0f, &hit) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_raycast(&f.view, o, NULL, 1.0f, &hit) == TERRIMP_E_NULL);
    CHECK(terrimp_heightfield_raycast(&f.view, o, zero, 1.0f, &hit) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_raycast(&f.view, o, d, 0.0f, &hit) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_raycast(&f.view, o, d, -1.0f, &hit) == TERRIMP_E_RANGE);
    CHECK(terrimp_heightfield_raycast(&f.view, o, d, hf_nan(), &hit) == TERRIMP_E_NOT_FINITE);
    CHECK(terrimp_heightfield_raycast(&f.view, o, d, (float)HUGE_VAL, &hit) ==
          TERRIMP_E_NOT_FINITE);
    for (i = 0; i < 3; ++i) {
        bad[i] = i == 1 ? hf_nan() : (float)HUGE_VAL;
        CHECK(terrimp_heightfield_raycast(&f.view, bad, d, 1.0f, &hit) == TERRIMP_E_NOT_FINITE);
        CHECK(terrimp_heightfield_raycast(&f.view, o, bad, 1.0f, &hit) == TERRIMP_E_NOT_FINITE);
        bad[i] = 0.0f;
    }
    CHECK(hit.distance == 0.0f && hit.normal[1] == 0.0f);
}

static inline void heightfield_tests(void)
{
    RUN(hf_resolve_fills_the_documented_defaults);
    RUN(hf_resolve_refuses_bad_numbers);
    RUN(hf_resolve_refuses_bad_sizes_and_memory);
    RUN(hf_validate_finds_the_first_void);
    RUN(hf_nan_is_a_void_only_with_has_no_data);
    RUN(hf_samples_and_tiles_are_offset_plus_scale_times_sample);
    RUN(hf_read_refuses_a_tile_with_a_void);
    RUN(hf_bounds_are_exact_and_skip_voids);
    RUN(hf_read_and_bounds_refuse_bad_arguments);
    RUN(hf_filling_keeps_valid_samples_and_their_range);
    RUN(hf_filling_a_hole_in_a_plane_restores_the_plane);
    RUN(hf_filling_a_flat_field_keeps_it_flat);
    RUN(hf_filling_makes_no_spikes_and_no_steps);
    RUN(hf_filling_refuses_bad_arguments);
    RUN(hf_height_and_normal_agree_with_the_triangles);
    RUN(hf_a_position_lies_between_the_lines_of_its_quad);
    RUN(hf_height_is_right_at_distant_origins);
    RUN(hf_height_at_a_sample_is_the_sample);
    RUN(hf_queries_outside_miss_and_in_holes_are_void);
    RUN(hf_raycast_agrees_with_all_triangles);
    RUN(hf_raycast_hits_lie_on_the_surface);
    RUN(hf_no_ray_leaks_through_the_surface);
    RUN(hf_no_ray_leaks_between_two_triangles);
    RUN(hf_vertical_rays_measure_the_height);
    RUN(hf_raycast_stands_extreme_numbers);
    RUN(hf_raycast_refuses_bad_arguments);
}
