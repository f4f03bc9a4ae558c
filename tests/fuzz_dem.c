/* Fuzzes the elevation files of the examples. The first bytes choose the name, the format and the
   crop, all others are the file. See tests/fuzz.h; libpng's and libtiff's own faults are theirs. */
#include "fuzz.h"

#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "examples/host/dem.c"
#include "examples/host/dem_png.c"
#include "examples/host/dem_text.c"
#include "examples/host/dem_tiff.c"

static void check_loaded(dem *d)
{
    terrimp_heightfield field = dem_heightfield(d);
    const char *trouble = NULL;
    terrimp_result result;
    FUZZ_CHECK(d->width >= 2 && d->width <= TERRIMP_MAX_DIM);
    FUZZ_CHECK(d->depth >= 2 && d->depth <= TERRIMP_MAX_DIM);
    result = terrimp_heightfield_validate(&field, NULL, NULL);
    FUZZ_CHECK(result == TERRIMP_OK || (result == TERRIMP_E_VOID && d->has_voids));
    dem_fill_voids(d, &trouble);
    if (trouble == NULL) {
        field = dem_heightfield(d);
        FUZZ_CHECK(terrimp_heightfield_validate(&field, NULL, NULL) == TERRIMP_OK);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    static const char *const names[] = { "N42E001.hgt", "s89w180.hgt", ".hgt", "a.pgm", "raw", "",
                                         "n42x25_w106x50.HGT", "a.raw", "a.r16", "a.f32" };
    const char *name;
    dem_desc desc;
    dem d;
    uint8_t *file;
    uint32_t crop;
    fuzz_bytes = bytes;
    fuzz_left = size;
    memset(&desc, 0, sizeof desc);
    name = names[fuzz_below(sizeof names / sizeof *names)];
    desc.raw_format = (int)fuzz_below(TERRIMP_FORMAT_COUNT + 1);
    desc.raw_width = fuzz_size(40);
    desc.raw_depth = fuzz_size(40);
    crop = fuzz_u8();
    if (crop & 1u) {
        desc.crop_x = fuzz_size(10);
        desc.crop_z = fuzz_size(10);
    }
    if (crop & 2u) {
        desc.crop_width = fuzz_size(20);
        desc.crop_depth = fuzz_size(20);
    }
    if (crop & 4u) {
        desc.skip_bytes = fuzz_size(10);
        desc.stride_bytes = fuzz_size(200);
    }
    desc.big_endian = (crop & 8u) != 0;
    desc.has_no_data = (crop & 16u) != 0;
    desc.no_data = desc.has_no_data ? fuzz_float(255.0f) : 0.0f;
    file = (uint8_t *)malloc(fuzz_left > 0 ? fuzz_left : 1); /* so that its end is guarded */
    if (file == NULL)
        return 0;
    memcpy(file, fuzz_bytes, fuzz_left);
    if (dem_parse(&d, name, file, fuzz_left, &desc))
        check_loaded(&d);
    else
        FUZZ_CHECK(d.samples == NULL && d.error[0] != 0 && strchr(d.error, '\n') == NULL);
    dem_free(&d);
    return 0;
}
