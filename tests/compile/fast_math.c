/* Compilers that take every number for finite: NaN and infinity are refused all the same. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "use.h"

static float from_bits(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

int main(void)
{
    static float samples[17 * 17];
    const float wrong[3] = {from_bits(0x7fc00000u), from_bits(0x7f800000u), from_bits(0xff800000u)};
    terrimp_heightfield field;
    terrimp_camera camera, out;
    float origin[3] = {5, 5, 5}, down[3] = {0, -1, 0}, low, high;
    int i;
    memset(&field, 0, sizeof field);
    memset(&camera, 0, sizeof camera);
    field.samples = samples;
    field.width = field.depth = 17;
    field.no_data = -1;
    camera.forward[2] = camera.z_near = 1;
    camera.z_far = 100;
    camera.width_px = camera.height_px = 100;
    for (i = 0; i < 3; i++) {
        samples[40] = wrong[i];
        if (terrimp_heightfield_validate(&field, NULL, NULL) != TERRIMP_E_NOT_FINITE)
            return 1;
        field.has_no_data = 1; /* NaN is a void, infinity is not */
        if (terrimp_heightfield_bounds(&field, 0, 0, 17, 17, &low, &high) !=
            (i == 0 ? TERRIMP_OK : TERRIMP_E_NOT_FINITE))
            return 2;
        field.has_no_data = 0;
        samples[40] = 0;
        camera.eye[1] = wrong[i];
        if (terrimp_camera_resolve(&camera, &out) != TERRIMP_E_NOT_FINITE)
            return 3;
        camera.eye[1] = 0;
        down[0] = wrong[i];
        if (terrimp_heightfield_raycast(&field, origin, down, 100, NULL) != TERRIMP_E_NOT_FINITE)
            return 4;
        down[0] = 0;
    }
    return use_terrimp();
}
