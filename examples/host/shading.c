#include "shading.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DETAIL = 256 }; /* texels of a repeated texture */

#define MATERIAL_REPEAT 24.0f /* samples that a material covers once */
#define CLOUD_REPEAT 1200.0f
#define CLOUD_SPEED 0.02f     /* repeats a second */

/* repeats: of materials, of clouds, drift along x and z */
const char shading_source[] =
    "uniform sampler2D material_a, material_b, material_c, cover_b, cover_c, clouds;\n"
    "uniform vec4 repeats;\n"
    "vec3 shade(vec2 uv, vec3 position) {\n"
    "    vec2 t = position.xz * repeats.x;\n"
    "    vec3 light_a = texture(lightmap, uv).rgb;\n"
    "    vec4 light_b = texture(cover_b, uv), light_c = texture(cover_c, uv);\n"
    "    vec3 c = light_a * texture(material_a, t).rgb;\n"
    "    c = mix(c, light_b.rgb * texture(material_b, t * 1.7).rgb, light_b.a);\n"
    "    c = mix(c, light_c.rgb * texture(material_c, t * 0.6).rgb, light_c.a);\n"
    "    return 2.0 * c;\n"
    "}\n"
    "vec3 shadow(vec3 c, vec3 position) {\n"
    "    return c * (1.0 - texture(clouds, position.xz * repeats.y + repeats.zw).r);\n"
    "}\n";

/* ---- Textures ----------------------------------------------------------- */

/* Uniform in 0..1 from a lattice point. */
static float lattice(uint32_t x, uint32_t z, uint32_t seed)
{
    uint32_t h = x * 0x9e3779b1u ^ z * 0x85ebca77u ^ seed * 0xc2b2ae3du;
    h = (h ^ h >> 15) * 0x27d4eb2fu;
    h = (h ^ h >> 13) * 0x165667b1u;
    return (float)((h ^ h >> 16) >> 8) * (1.0f / 16777216.0f);
}

/* Value noise over DETAIL texels with so many cells along a side; it repeats without a seam. */
static float noise(uint32_t x, uint32_t z, uint32_t cells, uint32_t seed)
{
    float u = (float)(x * cells % DETAIL) / DETAIL, v = (float)(z * cells % DETAIL) / DETAIL;
    uint32_t i = x * cells / DETAIL, j = z * cells / DETAIL;
    uint32_t right = (i + 1) % cells, below = (j + 1) % cells;
    float a, b;
    u = u * u * (3.0f - 2.0f * u);
    v = v * v * (3.0f - 2.0f * v);
    a = lattice(i, j, seed) * (1.0f - u) + lattice(right, j, seed) * u;
    b = lattice(i, below, seed) * (1.0f - u) + lattice(right, below, seed) * u;
    return a * (1.0f - v) + b * v;
}

/* Octaves from so many cells up, each half as strong; 0..1 about 0.5. */
static float fractal(uint32_t x, uint32_t z, uint32_t cells, uint32_t seed)
{
    float sum = 0.0f, strength = 0.5f;
    for (; cells < DETAIL; cells *= 2) {
        sum += strength * noise(x, z, cells, seed + cells);
        strength *= 0.5f;
    }
    return sum;
}

static GLuint make_texture(GLint wrap)
{
    GLuint texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, wrap);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, wrap);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    return texture;
}

/* Grey noise, tinted; half bright on average, since the shader doubles it. */
static GLuint make_material(uint32_t index, uint8_t *texels)
{
    static const float tints[SHADING_MATERIALS][3] = { { 0.98f, 1.04f, 0.94f },
                                                       { 1.03f, 1.00f, 0.97f },
                                                       { 0.97f, 0.99f, 1.05f } };
    GLuint texture = make_texture(GL_REPEAT);
    uint32_t i, channel;
    for (i = 0; i < DETAIL * DETAIL; i++) {
        float grey = 0.25f + 0.5f * fractal(i % DETAIL, i / DETAIL, 4u << index, 7 * index);
        for (channel = 0; channel < 3; channel++)
            texels[i * 3 + channel] = (uint8_t)(grey * tints[index][channel] * 255.0f + 0.5f);
    }
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, DETAIL, DETAIL, 0, GL_RGB, GL_UNSIGNED_BYTE, texels);
    glGenerateMipmap(GL_TEXTURE_2D);
    return texture;
}

/* How much of the sun's light clouds take: 0 in the open, at most 0.55. They are soft, and a texel
   is wider than a pixel but far away: without mipmaps they look the same, and an impostor, of whose
   two reads this is one, is spared to choose between them. */
static GLuint make_clouds(uint8_t *texels)
{
    GLuint texture = make_texture(GL_REPEAT);
    uint32_t i;
    for (i = 0; i < DETAIL * DETAIL; i++) {
        float shade = (fractal(i % DETAIL, i / DETAIL, 4, 99) - 0.45f) * 5.0f;
        shade = shade < 0.0f ? 0.0f : shade > 1.0f ? 1.0f : shade;
        texels[i] = (uint8_t)(shade * 0.55f * 255.0f + 0.5f);
    }
    glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, DETAIL, DETAIL, 0, GL_RED, GL_UNSIGNED_BYTE, texels);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    return texture;
}

/* Where a material lies: the second on steep ground, the third in patches. */
static float cover_of(const terrimp_heightfield *field, int which, uint32_t x, uint32_t z)
{
    float normal[3] = { 0.0f, 1.0f, 0.0f }, patches;
    if (which == 0) {
        terrimp_heightfield_normal(field, field->origin_x + (float)x * field->spacing_x,
                                   field->origin_z + (float)z * field->spacing_z, normal);
        return (0.9f - normal[1]) * 4.0f;
    }
    patches = fractal(x % DETAIL, z % DETAIL, 4, 55);
    return (patches - 0.5f) * 6.0f;
}

static GLuint make_cover(const terrimp_heightfield *field, const uint8_t *lightmap, int which,
                         uint8_t *texels)
{
    GLuint texture = make_texture(GL_CLAMP_TO_EDGE);
    uint32_t x, z;
    uint8_t *out = texels;
    for (z = 0; z < field->depth; z++)
        for (x = 0; x < field->width; x++, out += 4, lightmap += 3) {
            float cover = cover_of(field, which, x, z);
            memcpy(out, lightmap, 3);
            out[3] = (uint8_t)(cover < 0.0f ? 0.0f : cover > 1.0f ? 255.0f : cover * 255.0f);
        }
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, (GLsizei)field->width, (GLsizei)field->depth, 0,
                 GL_RGBA, GL_UNSIGNED_BYTE, texels);
    glGenerateMipmap(GL_TEXTURE_2D);
    return texture;
}

const char *shading_open(shading *s, const terrimp_heightfield *field, const uint8_t *lightmap)
{
    terrimp_heightfield resolved;
    size_t largest;
    uint8_t *texels;
    uint32_t i;
    memset(s, 0, sizeof *s);
    if (terrimp_heightfield_resolve(field, &resolved) != TERRIMP_OK)
        return "the heightfield is wrong";
    largest = (size_t)field->width * field->depth * 4;
    texels = malloc(largest > DETAIL * DETAIL * 3 ? largest : DETAIL * DETAIL * 3);
    if (!texels)
        return "no memory for the materials";
    for (i = 0; i < SHADING_MATERIALS; i++)
        s->materials[i] = make_material(i, texels);
    for (i = 0; i + 1 < SHADING_MATERIALS; i++)
        s->covers[i] = make_cover(&resolved, lightmap, (int)i, texels);
    s->clouds = make_clouds(texels);
    s->spacing = resolved.spacing_x;
    free(texels);
    return NULL;
}

void shading_close(shading *s)
{
    glDeleteTextures(SHADING_MATERIALS, s->materials);
    glDeleteTextures(SHADING_MATERIALS - 1, s->covers);
    glDeleteTextures(1, &s->clouds);
    memset(s, 0, sizeof *s);
}

/* ---- A frame ------------------------------------------------------------ */

static void set_uniforms(const shading *s, const gl_program *program)
{
    static const char *const samplers[6] = { "material_a", "material_b", "material_c", "cover_b",
                                             "cover_c", "clouds" };
    int i;
    glUseProgram(program->id);
    for (i = 0; i < 6; i++)
        glUniform1i(glGetUniformLocation(program->id, samplers[i]), i + 1);
    glUniform4f(glGetUniformLocation(program->id, "repeats"),
                1.0f / (MATERIAL_REPEAT * s->spacing), 1.0f / (CLOUD_REPEAT * s->spacing),
                s->drift[0], s->drift[1]);
}

void shading_begin(shading *s, const gl_terrain *g, float seconds)
{
    GLuint textures[6];
    GLenum i;
    memcpy(textures, s->materials, sizeof s->materials);
    memcpy(textures + SHADING_MATERIALS, s->covers, sizeof s->covers);
    textures[5] = s->clouds;
    for (i = 0; i < 6; i++) {
        glActiveTexture(GL_TEXTURE1 + i);
        glBindTexture(GL_TEXTURE_2D, textures[i]);
    }
    glActiveTexture(GL_TEXTURE0);
    s->drift[0] = fmodf(seconds * CLOUD_SPEED, 1.0f);
    s->drift[1] = fmodf(seconds * CLOUD_SPEED * 0.6f, 1.0f);
    set_uniforms(s, &g->ground);
    set_uniforms(s, &g->impostor);
    if (g->deep.id)
        set_uniforms(s, &g->deep);
    if (g->morphing.id)
        set_uniforms(s, &g->morphing);
}
