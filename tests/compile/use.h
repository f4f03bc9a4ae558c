/* The same small use of the library for every program of this directory: 0 when it works. */
#ifndef USE_H
#define USE_H

static int use_terrimp(void)
{
    static const float heights[3 * 3] = { 0, 1, 2, 1, 2, 3, 2, 3, 4 };
    terrimp_heightfield field;
    float height = 0.0f;
    field.samples = heights;
    field.width = field.depth = 3;
    field.format = TERRIMP_FORMAT_F32;
    field.row_bytes = 0;
    field.spacing_x = field.spacing_z = 0.0f;
    field.height_scale = field.height_offset = 0.0f;
    field.origin_x = field.origin_z = 0.0f;
    field.no_data = 0.0f;
    field.has_no_data = 0;
    if (terrimp_heightfield_height(&field, 0.5f, 1.5f, &height) != TERRIMP_OK)
        return 1;
    return !(height > 1.99f && height < 2.01f);
}

#endif
