#include "raster.h"

#include <math.h>
#include <string.h>

/* 1 / w is counted in steps that leave the sign bit and one more free; the upper 16 are kept. */
#define DEPTH_STEPS 1.0e9f
enum { DEPTH_SHIFT = 14, DEPTH_LARGEST = 0x3fffffff };

/* ---- The target --------------------------------------------------------- */

/* out = projection * view without its translation: positions are taken relative to the eye first,
   so that large worlds keep their precision. */
static void relative_matrix(const float view[16], const float projection[16], float out[16])
{
    int column, row, k;
    for (column = 0; column < 4; column++)
        for (row = 0; row < 4; row++) {
            float sum = column == 3 ? projection[12 + row] : 0.0f;
            for (k = 0; column < 3 && k < 3; k++)
                sum += projection[k * 4 + row] * view[column * 4 + k];
            out[column * 4 + row] = sum;
        }
}

void raster_begin(raster *r, uint16_t *pixels, uint16_t *depth, int pitch, int width, int height,
                  int row_0_is_top, const float view[16], const float projection[16],
                  const float eye[3])
{
    r->pixels = pixels;
    r->depth = depth;
    r->covered = NULL;
    r->pitch = pitch;
    r->depth_pitch = width;
    r->width = width;
    r->height = height;
    r->row_0_is_top = row_0_is_top;
    relative_matrix(view, projection, r->matrix);
    memcpy(r->eye, eye, sizeof r->eye);
    r->z_near = projection[14] / (projection[10] - 1.0f);
    r->depth_scale = r->z_near * DEPTH_STEPS;
}

void raster_clear(const raster *r, uint16_t colour)
{
    int x, y;
    for (y = 0; y < r->height; y++)
        for (x = 0; x < r->width; x++)
            r->pixels[y * r->pitch + x] = colour;
}

void raster_clear_depth(const raster *r)
{
    int y;
    for (y = 0; r->depth && y < r->height; y++)
        memset(r->depth + y * r->depth_pitch, 0, (size_t)r->width * sizeof *r->depth);
}

static uint32_t *covered_row(const raster *r, int y)
{
    return r->covered + y * ((r->width + 31) / 32);
}

void raster_clear_covered(const raster *r)
{
    memset(r->covered, 0, (size_t)r->height * (size_t)((r->width + 31) / 32) * sizeof *r->covered);
}

void raster_fill_rest(const raster *r, uint16_t colour)
{
    int x, y, i;
    for (y = 0; y < r->height; y++)
        for (x = 0; x < r->width; x += 32) {
            uint32_t free_ones = ~covered_row(r, y)[x / 32];
            uint16_t *pixels = r->pixels + y * r->pitch + x;
            for (i = 0; free_ones && x + i < r->width; i++, free_ones >>= 1)
                if (free_ones & 1u)
                    pixels[i] = colour;
        }
}

/* ---- Spans -------------------------------------------------------------- */

/* What is linear in x and y, at one place; or its change over a step. */
typedef struct gradient {
    float depth, s, t, q;
} gradient;

/* A texture level as a triangle sees it; texel coordinates have 16 bits of fraction. */
typedef struct sampler {
    const uint16_t *texels;
    int log2_side;
    float side, largest; /* largest: coordinate that is still inside, in texels */
} sampler;

/* The depth of what a texture shows: from a texel's own, e, and its place, the screen's is
   e scale / (start + u across + v upward + e aside). */
typedef struct relief {
    const uint16_t *depth; /* NULL: none */
    float scale, start, across, upward, aside;
} relief;

static int32_t to_texels(const sampler *from, float coordinate)
{
    float texel = coordinate * from->side;
    texel = texel > 0.0f ? texel : 0.0f; /* NaN: 0 */
    return (int32_t)((texel < from->largest ? texel : from->largest) * 65536.0f);
}

static int32_t to_depth(float depth)
{
    return depth > 0.0f ? depth < (float)DEPTH_LARGEST ? (int32_t)depth : DEPTH_LARGEST : 0;
}

/* One run of pixels within which the texture coordinates go straight. */
typedef struct run {
    int32_t u, v, du, dv;
    int32_t depth, step; /* of 1 / w */
} run;

/* The thresholds of its pixels start with `at`, a fraction of 2^32, and are so far apart that any
   few neighbours are spread over the whole range: multiples of the inverse of 1.3247, the root of
   x^3 = x + 1, along the rows, and of its square along the columns. */
static void fill_run(const sampler *from, const relief *own, run k, uint16_t *pixel,
                     uint16_t *depth, int count, int share, uint32_t at)
{
    for (; count > 0; count--, pixel++, depth++, at += 3242174889u) {
        uint16_t closeness = (uint16_t)(k.depth >> DEPTH_SHIFT);
        if (closeness > *depth && (int)(at >> 27) < share) {
            int32_t place = (k.v >> 16 << from->log2_side) + (k.u >> 16);
            uint16_t texel = from->texels[place];
            if (texel != RASTER_KEY && own->depth) {
                float e = (float)own->depth[place];
                float exact = e * own->scale / (own->start + own->across * (float)k.u
                                                + own->upward * (float)k.v + own->aside * e);
                if (exact > 0.0f && exact < (float)closeness)
                    closeness = (uint16_t)exact;
            }
            if (texel != RASTER_KEY && closeness > *depth) {
                *pixel = texel;
                *depth = closeness;
            }
        }
        k.u += k.du, k.v += k.dv, k.depth += k.step;
    }
}

/* The same without a depth buffer. */
static void cover_run(const sampler *from, run k, uint16_t *pixel, int count, int share,
                      uint32_t at)
{
    for (; count > 0; count--, pixel++, at += 3242174889u) {
        uint16_t texel = from->texels[(k.v >> 16 << from->log2_side) + (k.u >> 16)];
        if (texel != RASTER_KEY && (int)(at >> 27) < share)
            *pixel = texel;
        k.u += k.du, k.v += k.dv;
    }
}

/* The same from front to back: pixels that are not covered. */
static void fill_free_run(const sampler *from, run k, uint16_t *pixel, uint32_t *covered, int x,
                          int count, int share, uint32_t at)
{
    uint32_t *word = covered + x / 32, seen = *word, bit = 1u << x % 32;
    for (; count > 0; count--, pixel++, at += 3242174889u) {
        if (!(seen & bit) && (int)(at >> 27) < share) {
            uint16_t texel = from->texels[(k.v >> 16 << from->log2_side) + (k.u >> 16)];
            if (texel != RASTER_KEY) {
                *pixel = texel;
                seen |= bit;
            }
        }
        k.u += k.du, k.v += k.dv;
        bit <<= 1;
        if (!bit) {
            *word++ = seen;
            seen = count > 1 ? *word : 0;
            bit = 1;
        }
    }
    if (bit > 1)
        *word = seen;
}

/* Whether all pixels of a span are covered. */
static int is_covered(const uint32_t *covered, int x, int end)
{
    for (; x < end; x = (x | 31) + 1) {
        uint32_t wanted = 0xffffffffu << x % 32;
        if (end < (x | 31) + 1)
            wanted &= ~(0xffffffffu << end % 32);
        if (wanted & ~covered[x / 32])
            return 0;
    }
    return 1;
}

/* Divides at every 16th pixel and at the last one; between them the texture goes straight. */
static void fill_span(const raster *r, const sampler *from, const relief *own, gradient at,
                      const gradient *dx, int x, int end, int y, int share)
{
    int32_t u = to_texels(from, at.s / at.q), v = to_texels(from, at.t / at.q);
    int32_t depth = r->depth ? to_depth(at.depth) : 0;
    while (x < end) {
        int count = end - x > 16 ? 16 : end - x;
        int steps = x + count < end ? count : count - 1; /* not beyond the last pixel */
        float walked = (float)steps;
        uint32_t at_dither;
        run k;
        k.u = u, k.v = v, k.depth = depth, k.du = k.dv = k.step = 0;
        at.s += walked * dx->s, at.t += walked * dx->t, at.q += walked * dx->q;
        if (steps) {
            u = to_texels(from, at.s / at.q);
            v = to_texels(from, at.t / at.q);
            k.du = (u - k.u) / steps, k.dv = (v - k.v) / steps;
        }
        if (steps && r->depth) {
            at.depth += walked * dx->depth;
            depth = to_depth(at.depth);
            k.step = (depth - k.depth) / steps;
        }
        at_dither = (uint32_t)x * 3242174889u + (uint32_t)y * 2447445414u;
        if (r->depth)
            fill_run(from, own, k, r->pixels + y * r->pitch + x,
                     r->depth + y * r->depth_pitch + x, count, share, at_dither);
        else if (r->covered)
            fill_free_run(from, k, r->pixels + y * r->pitch + x, covered_row(r, y), x, count,
                          share, at_dither);
        else
            cover_run(from, k, r->pixels + y * r->pitch + x, count, share, at_dither);
        x += count;
    }
}

/* ---- Triangles ---------------------------------------------------------- */

/* First pixel whose centre is not before an edge, kept to 0..limit. Neighbours that share the edge
   get the same number: no gap and no pixel twice. */
static int first_pixel(float edge, int limit)
{
    return edge > 0.0f ? edge < (float)limit ? (int)(edge + 0.5f) : limit : 0;
}

/* How far an edge goes to the right from a row to the next. */
static float slope_of(const raster_corner *top, const raster_corner *bottom)
{
    return bottom->y > top->y ? (bottom->x - top->x) / (bottom->y - top->y) : 0.0f;
}

/* The mipmap whose texels are about as large as the triangle's pixels, by their areas. */
static sampler choose_level(const raster_texture *texture, const raster_corner *a,
                            const raster_corner *b, const raster_corner *c, float area)
{
    sampler from;
    int level = 0;
    if (texture->level_count > 1) {
        float side = (float)(1 << texture->log2_side);
        float as = a->s / a->q, at = a->t / a->q;
        float bs = b->s / b->q - as, bt = b->t / b->q - at;
        float cs = c->s / c->q - as, ct = c->t / c->q - at;
        float texels = fabsf(bs * ct - cs * bt) * side * side;
        for (; texels > 2.0f * area && level + 1 < texture->level_count; level++)
            texels *= 0.25f;
    }
    from.texels = texture->levels[level];
    from.log2_side = texture->log2_side - level;
    from.side = (float)(1 << from.log2_side);
    from.largest = from.side - 0.01f;
    return from;
}

static void fill_triangle(const raster *r, const raster_style *style, const relief *own,
                          const raster_corner *a, const raster_corner *b, const raster_corner *c)
{
    float bx = b->x - a->x, by = b->y - a->y, cx = c->x - a->x, cy = c->y - a->y;
    float area = bx * cy - cx * by, scale = 1.0f / area;
    float left = b->x < c->x ? b->x : c->x, right = b->x < c->x ? c->x : b->x;
    const raster_corner *top = a, *middle = b, *bottom = c, *swap;
    float slopes[3];
    gradient dx, dy;
    sampler from;
    int y, end;
    if (!((r->row_0_is_top ? -area : area) > 1e-7f)) /* turned away, or nothing */
        return;
    if (middle->y < top->y)
        swap = top, top = middle, middle = swap;
    if (bottom->y < middle->y)
        swap = middle, middle = bottom, bottom = swap;
    if (middle->y < top->y)
        swap = top, top = middle, middle = swap;
    y = first_pixel(top->y, r->height);
    end = first_pixel(bottom->y, r->height);
    left = a->x < left ? a->x : left, right = a->x > right ? a->x : right;
    if (y >= end || first_pixel(left, r->width) >= first_pixel(right, r->width))
        return; /* between the centres of pixels, as most triangles of a full mesh, or outside */
    dx.depth = dy.depth = 0.0f;
    if (r->depth) {
        dx.depth = ((b->depth - a->depth) * cy - (c->depth - a->depth) * by) * scale;
        dy.depth = ((c->depth - a->depth) * bx - (b->depth - a->depth) * cx) * scale;
    }
    dx.s = ((b->s - a->s) * cy - (c->s - a->s) * by) * scale;
    dy.s = ((c->s - a->s) * bx - (b->s - a->s) * cx) * scale;
    dx.t = ((b->t - a->t) * cy - (c->t - a->t) * by) * scale;
    dy.t = ((c->t - a->t) * bx - (b->t - a->t) * cx) * scale;
    dx.q = ((b->q - a->q) * cy - (c->q - a->q) * by) * scale;
    dy.q = ((c->q - a->q) * bx - (b->q - a->q) * cx) * scale;
    slopes[0] = slope_of(top, bottom);
    slopes[1] = slope_of(top, middle);
    slopes[2] = slope_of(middle, bottom);
    from = choose_level(style->texture, a, b, c, fabsf(area));
    for (; y < end; y++) {
        float centre = (float)y + 0.5f, one = top->x + (centre - top->y) * slopes[0];
        float other = centre < middle->y ? top->x + (centre - top->y) * slopes[1]
                                         : middle->x + (centre - middle->y) * slopes[2];
        int x = first_pixel(one < other ? one : other, r->width);
        int x_end = first_pixel(one < other ? other : one, r->width);
        float across = (float)x + 0.5f - a->x, down = centre - a->y;
        gradient at;
        if (x >= x_end || (r->covered && is_covered(covered_row(r, y), x, x_end)))
            continue;
        at.depth = a->depth + across * dx.depth + down * dy.depth;
        at.s = a->s + across * dx.s + down * dy.s;
        at.t = a->t + across * dx.t + down * dy.t;
        at.q = a->q + across * dx.q + down * dy.q;
        fill_span(r, &from, own, at, &dx, x, x_end, y, style->share);
    }
}

/* ---- Vertices ----------------------------------------------------------- */

static raster_corner project(const raster *r, const raster_point *p)
{
    float over = 1.0f / p->w, y = p->y * over;
    raster_corner c;
    c.x = (p->x * over * 0.5f + 0.5f) * (float)r->width;
    c.y = ((r->row_0_is_top ? -y : y) * 0.5f + 0.5f) * (float)r->height;
    c.depth = r->depth_scale * over;
    c.s = p->s * over;
    c.t = p->t * over;
    c.q = p->q * over;
    return c;
}

/* How far a point is inside of the plane before the eye, and of those that bound a picture's depth;
   all are linear. */
enum { PLANE_NEAR, PLANE_FRONT, PLANE_BACK, PLANES };

static float inside_by(const raster *r, const raster_point *p, int plane)
{
    return plane == PLANE_NEAR ? p->w - r->z_near : plane == PLANE_FRONT ? p->r : p->q - p->r;
}

/* Where an edge meets a plane; always counted from its inner end, so that both triangles of the
   edge get the same point. */
static raster_point cut(const raster_point *in, const raster_point *out, float part)
{
    raster_point p;
    p.x = in->x + (out->x - in->x) * part;
    p.y = in->y + (out->y - in->y) * part;
    p.w = in->w + (out->w - in->w) * part;
    p.s = in->s + (out->s - in->s) * part;
    p.t = in->t + (out->t - in->t) * part;
    p.r = in->r + (out->r - in->r) * part;
    p.q = in->q + (out->q - in->q) * part;
    return p;
}

/* Cuts a convex polygon at a plane; returns how many corners are left. */
static int clip(const raster *r, int plane, const raster_point *polygon, int count,
                raster_point *out)
{
    int i, kept = 0;
    for (i = 0; i < count; i++) {
        const raster_point *p = &polygon[i], *next = &polygon[(i + 1) % count];
        float here = inside_by(r, p, plane), there = inside_by(r, next, plane);
        if (here >= 0.0f)
            out[kept++] = *p;
        if (here >= 0.0f && there < 0.0f)
            out[kept++] = cut(p, next, here / (here - there));
        else if (here < 0.0f && there >= 0.0f)
            out[kept++] = cut(next, p, there / (there - here));
    }
    return kept;
}

static void fill_clipped_triangle(const raster *r, const raster_style *style, const relief *own,
                                  const uint16_t triangle[3])
{
    raster_point polygon[3 + PLANES], clipped[3 + PLANES];
    raster_corner fan[3 + PLANES];
    int i, plane, count = 3;
    for (i = 0; i < 3; i++)
        polygon[i] = r->points[triangle[i]];
    for (plane = 0; plane < (style->within_depth ? PLANES : 1); plane++) {
        count = clip(r, plane, polygon, count, clipped);
        memcpy(polygon, clipped, sizeof polygon);
    }
    for (i = 0; i < count; i++)
        fan[i] = project(r, &polygon[i]);
    for (i = 2; i < count; i++)
        fill_triangle(r, style, own, &fan[0], &fan[i - 1], &fan[i]);
}

static raster_point transform(const raster *r, const raster_style *style, const float p[3])
{
    float x = p[0] - r->eye[0], y = p[1] - r->eye[1], z = p[2] - r->eye[2];
    const float *c = r->matrix, *m = style->texture_matrix, *eye = style->picture_eye;
    raster_point out;
    out.x = c[0] * x + c[4] * y + c[8] * z + c[12];
    out.y = c[1] * x + c[5] * y + c[9] * z + c[13];
    out.w = c[3] * x + c[7] * y + c[11] * z + c[15];
    x = p[0] - eye[0], y = p[1] - eye[1], z = p[2] - eye[2];
    out.s = m[0] * x + m[4] * y + m[8] * z + m[12];
    out.t = m[1] * x + m[5] * y + m[9] * z + m[13];
    out.r = m[2] * x + m[6] * y + m[10] * z + m[14];
    out.q = m[3] * x + m[7] * y + m[11] * z + m[15];
    return out;
}

/* Bit i: outside of plane i. */
static int find_sides(const raster *r, const raster_style *style, const raster_point *p)
{
    int plane, sides = 0;
    for (plane = 0; plane < (style->within_depth ? PLANES : 1); plane++)
        sides |= (inside_by(r, p, plane) < 0.0f) << plane;
    return sides;
}

/* The place's clip w is linear in s, t and d, and so in a texel's depth, 1 / z times the z_near
   of the texture's own camera, in steps: the place matrix has 1 / z_near and that of d in its last
   row. */
static relief relief_of(const raster *r, const raster_style *style)
{
    const float *m = style->place_matrix, *c = r->matrix;
    float side = 65536.0f * (float)(1 << style->texture->log2_side), last = 0.0f;
    relief own = { 0 };
    int i;
    if (!m || m[11] >= 0.0f)
        return own;
    own.depth = style->texture_depth;
    own.scale = r->z_near * m[15];
    for (i = 0; i < 3; i++) {
        float row = c[4 * i + 3];
        own.across += row * m[i] / side;
        own.upward += row * m[4 + i] / side;
        last += row * m[8 + i] / m[11];
        own.start += row * m[12 + i];
    }
    own.start -= last * m[15];
    own.aside = (last + c[15]) * m[15] * (float)(1 << DEPTH_SHIFT) / DEPTH_STEPS;
    return own;
}

void raster_draw(raster *r, const raster_style *style, const float *xyz, const uint16_t *indices,
                 size_t index_count)
{
    size_t first = RASTER_VERTICES, end = 0, i;
    relief own = relief_of(r, style);
    for (i = 0; i < index_count; i++) {
        first = indices[i] < first ? indices[i] : first;
        end = indices[i] >= end ? indices[i] + 1u : end;
    }
    for (i = first; i < end; i++) {
        r->points[i] = transform(r, style, xyz + i * 3);
        r->sides[i] = (uint8_t)find_sides(r, style, &r->points[i]);
        if (!r->sides[i])
            r->corners[i] = project(r, &r->points[i]);
    }
    for (i = 0; i + 2 < index_count; i += 3) {
        const uint16_t *k = indices + i;
        if (!(r->sides[k[0]] | r->sides[k[1]] | r->sides[k[2]]))
            fill_triangle(r, style, &own, &r->corners[k[0]], &r->corners[k[1]],
                          &r->corners[k[2]]);
        else if (!(r->sides[k[0]] & r->sides[k[1]] & r->sides[k[2]]))
            fill_clipped_triangle(r, style, &own, k);
    }
}

/* ---- Pictures ----------------------------------------------------------- */

/* Never the key: its green is made one step brighter. */
static uint16_t to_565(int red, int green, int blue)
{
    int packed = red >> 3 << 11 | green >> 2 << 5 | blue >> 3;
    return (uint16_t)(packed == RASTER_KEY ? packed | 1 << 5 : packed);
}

/* The mean of a block of the finest level: each mipmap is made from the source, not from the 16-bit
   level before, whose rounding would add up. */
static uint16_t mean_of_block(const uint8_t *rgb, int side, int x, int y, int size)
{
    long sum[3] = { 0, 0, 0 };
    int i, j, k, count = size * size;
    for (j = 0; j < size; j++)
        for (i = 0; i < size; i++)
            for (k = 0; k < 3; k++)
                sum[k] += rgb[((size_t)(y + j) * (size_t)side + (size_t)(x + i)) * 3 + (size_t)k];
    return to_565((int)(sum[0] / count), (int)(sum[1] / count), (int)(sum[2] / count));
}

void raster_make_texture(raster_texture *texture, uint16_t *texels, const uint8_t *rgb,
                         int log2_side)
{
    int level, x, y, side = 1 << log2_side;
    texture->log2_side = log2_side;
    texture->level_count = log2_side + 1 < RASTER_LEVELS ? log2_side + 1 : RASTER_LEVELS;
    for (level = 0; level < texture->level_count; level++) {
        int size = 1 << level;
        texture->levels[level] = texels;
        for (y = 0; y < side; y += size)
            for (x = 0; x < side; x += size)
                *texels++ = mean_of_block(rgb, side, x, y, size);
    }
}

void raster_read(const raster *r, uint8_t *rgb)
{
    int x, y;
    for (y = 0; y < r->height; y++)
        for (x = 0; x < r->width; x++, rgb += 3) {
            int pixel = r->pixels[y * r->pitch + x];
            rgb[0] = (uint8_t)(pixel >> 11 << 3 | pixel >> 13);
            rgb[1] = (uint8_t)((pixel >> 5 & 63) << 2 | (pixel >> 9 & 3));
            rgb[2] = (uint8_t)((pixel & 31) << 3 | (pixel >> 2 & 7));
        }
}
