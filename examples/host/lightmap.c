#include "lightmap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The way to the sun, unless it is given. It stands in the north, so that a sweep from the first
   row to the last meets whatever casts a shadow before what it falls on. */
static const float north_west[3] = { -0.485f, 0.640f, -0.596f };

#define AMBIENT 0.42f
#define DIFFUSE 0.78f
#define SHADOW_DEPTH 0.75f /* of the sun's light that a full shadow takes */

/* Three rows of heights around the row that is baked, and the edge of the shadow over it. */
typedef struct sweep {
    const terrimp_heightfield *field;
    const float *sun;              /* NULL: no light, but normals */
    uint8_t *normals;              /* of the next texel */
    float low, high;               /* of all heights [wu] */
    const float *north, *here, *south; /* heights of rows z - 1, z, z + 1 */
    float *shadow, *next_shadow;   /* height of the shadow's edge over rows z and z + 1 */
    float softness;                /* [wu] below the edge where the shadow is full */
    float *memory;                 /* three rows of heights, two of shadow */
} sweep;

/* ---- Colour ------------------------------------------------------------- */

/* 0 below a, 1 above b, a smooth step between. */
static float ramp(float a, float b, float value)
{
    float t = (value - a) / (b - a);
    t = t < 0.0f ? 0.0f : t > 1.0f ? 1.0f : t;
    return t * t * (3.0f - 2.0f * t);
}

static void blend(float colour[3], const float other[3], float amount)
{
    int i;
    for (i = 0; i < 3; i++)
        colour[i] += amount * (other[i] - colour[i]);
}

/* The material's colour; height relative, 0..1, and the upward part of the normal. */
static void material(float height, float upward, float colour[3])
{
    static const float meadow[3] = { 0.38f, 0.47f, 0.22f };
    static const float heath[3] = { 0.53f, 0.49f, 0.30f };
    static const float rock[3] = { 0.48f, 0.44f, 0.41f };
    static const float snow[3] = { 0.95f, 0.96f, 0.99f };
    static const float water[3] = { 0.20f, 0.34f, 0.50f };
    memcpy(colour, meadow, sizeof meadow);
    blend(colour, heath, ramp(0.15f, 0.55f, height));
    blend(colour, rock, ramp(0.84f, 0.64f, upward));
    blend(colour, snow, ramp(0.60f, 0.72f, height) * ramp(0.50f, 0.75f, upward));
    if (height < 0.03f && upward > 0.999999f) /* low and perfectly level: only a sea is */
        memcpy(colour, water, sizeof water);
}

static uint8_t to_byte(float value)
{
    return (uint8_t)(value < 0.0f ? 0.0f : value > 1.0f ? 255.0f : value * 255.0f + 0.5f);
}

/* ---- Light -------------------------------------------------------------- */

/* Slope along x and z by central differences, one-sided at the rims. */
static void slopes(const sweep *s, uint32_t x, float *along_x, float *along_z)
{
    uint32_t left = x ? x - 1 : 0, right = x + 1 < s->field->width ? x + 1 : x;
    int rows = (s->north != s->here) + (s->south != s->here);
    *along_x = (s->here[right] - s->here[left]) / ((float)(right - left) * s->field->spacing_x);
    *along_z = (s->south[x] - s->north[x]) / ((float)rows * s->field->spacing_z);
}

static void bake_texel(sweep *s, uint32_t x, uint8_t *rgb)
{
    float along_x, along_z, upward, facing, shade, light, colour[3];
    float height = (s->here[x] - s->low) / (s->high - s->low);
    int i;
    slopes(s, x, &along_x, &along_z);
    upward = 1.0f / sqrtf(1.0f + along_x * along_x + along_z * along_z);
    material(height, upward, colour);
    if (s->sun) {
        facing = (s->sun[1] - along_x * s->sun[0] - along_z * s->sun[2]) * upward;
        shade = ramp(0.0f, s->softness, s->shadow[x] - s->here[x]);
        light = AMBIENT + DIFFUSE * (facing > 0.0f ? facing : 0.0f) * (1.0f - SHADOW_DEPTH * shade);
    } else {
        float normal[3];
        normal[0] = -along_x;
        normal[1] = 1.0f;
        normal[2] = -along_z;
        terrimp_normal_encode(normal, s->normals);
        s->normals += 2;
        light = 1.0f;
    }
    for (i = 0; i < 3; i++)
        rgb[i] = to_byte(colour[i] * light);
}

/* The edge of the shadow that the present row and all before it throw over the next one: it moves
   along x and sinks as the light does. */
static void sweep_shadow(sweep *s)
{
    const terrimp_heightfield *field = s->field;
    float shift = field->spacing_z / field->spacing_x * s->sun[0] / s->sun[2];
    float sink = field->spacing_z * s->sun[1] / -s->sun[2], way = fabsf(shift);
    uint32_t x, whole = (uint32_t)way, last = field->width - 1;
    float part = way - (float)whole, *swap;
    for (x = 0; x < field->width; x++)
        if (s->shadow[x] < s->here[x])
            s->shadow[x] = s->here[x];
    for (x = 0; x < field->width; x++) {
        uint32_t a = x > whole ? x - whole : 0, b = a ? a - 1 : 0;
        if (shift < 0.0f) {
            a = last - x > whole ? x + whole : last;
            b = a < last ? a + 1 : last;
        }
        s->next_shadow[x] = s->shadow[a] + part * (s->shadow[b] - s->shadow[a]) - sink;
    }
    swap = s->shadow;
    s->shadow = s->next_shadow;
    s->next_shadow = swap;
}

/* ---- Row after row ------------------------------------------------------ */

static int read_row(const sweep *s, uint32_t z, float *row)
{
    return terrimp_heightfield_read(s->field, 0, z, s->field->width, 1, 1, row) == TERRIMP_OK;
}

/* Where row z is kept: three rows take turns. */
static float *row_of(const sweep *s, uint32_t z)
{
    return s->memory + (size_t)(z % 3) * s->field->width;
}

static int bake_rows(sweep *s, uint8_t *rgb)
{
    uint32_t width = s->field->width, depth = s->field->depth, x, z;
    if (!read_row(s, 0, row_of(s, 0)))
        return 0;
    for (z = 0; z < depth; z++) {
        if (z + 1 < depth && !read_row(s, z + 1, row_of(s, z + 1)))
            return 0;
        s->north = row_of(s, z ? z - 1 : 0);
        s->here = row_of(s, z);
        s->south = row_of(s, z + 1 < depth ? z + 1 : z);
        for (x = 0; x < width; x++, rgb += 3)
            bake_texel(s, x, rgb);
        if (s->sun)
            sweep_shadow(s);
    }
    return 1;
}

static int sweep_begin(sweep *s, const terrimp_heightfield *field)
{
    size_t width = field->width, x;
    s->field = field;
    if (terrimp_heightfield_bounds(field, 0, 0, field->width, field->depth, &s->low, &s->high)
        != TERRIMP_OK)
        return 0;
    if (s->high <= s->low)
        s->high = s->low + 1.0f; /* all flat */
    s->softness = 2.0f * field->spacing_z;
    s->memory = malloc(5 * width * sizeof *s->memory);
    if (!s->memory)
        return 0;
    s->shadow = s->memory + 3 * width;
    s->next_shadow = s->memory + 4 * width;
    for (x = 0; x < width; x++)
        s->shadow[x] = s->low;
    return 1;
}

static uint8_t *bake(const terrimp_heightfield *field, const float *sun, uint8_t *normals)
{
    terrimp_heightfield resolved;
    uint8_t *rgb;
    sweep s;
    s.sun = sun;
    s.normals = normals;
    if (terrimp_heightfield_resolve(field, &resolved) != TERRIMP_OK || !sweep_begin(&s, &resolved))
        return NULL;
    rgb = malloc((size_t)field->width * field->depth * 3);
    if (rgb && !bake_rows(&s, rgb)) {
        free(rgb);
        rgb = NULL;
    }
    free(s.memory);
    return rgb;
}

uint8_t *lightmap_bake(const terrimp_heightfield *field)
{
    return bake(field, north_west, NULL);
}

uint8_t *lightmap_bake_under(const terrimp_heightfield *field, const float sun[3])
{
    return bake(field, sun, NULL);
}

uint8_t *lightmap_bake_unlit(const terrimp_heightfield *field, uint8_t **normals)
{
    uint8_t *rgb = NULL;
    *normals = malloc((size_t)field->width * field->depth * 2);
    if (*normals)
        rgb = bake(field, NULL, *normals);
    if (!rgb) {
        free(*normals);
        *normals = NULL;
    }
    return rgb;
}
