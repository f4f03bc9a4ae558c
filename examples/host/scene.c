#include "scene.h"

#include "image.h"
#include "lightmap.h"
#include "procedural.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const uint8_t scene_sky[3] = { 173, 211, 239 };

const char *scene_open(scene *s)
{
    memset(s, 0, sizeof *s);
    s->samples = procedural_terrain(SCENE_SIDE, SCENE_SIDE, 3);
    s->desc.field.samples = s->samples;
    s->desc.field.width = s->desc.field.depth = SCENE_SIDE;
    s->desc.field.format = TERRIMP_FORMAT_U16;
    s->desc.field.height_scale = 0.4f * PROCEDURAL_HEIGHT_SCALE;
    s->desc.chunk_quads = SCENE_QUADS;
    if (s->samples)
        s->lightmap = lightmap_bake(&s->desc.field);
    if (!s->lightmap) {
        scene_close(s);
        return "no memory for the terrain";
    }
    s->lightmap_matrix[0] = s->lightmap_matrix[9] = 1.0f / SCENE_SIDE;
    s->lightmap_matrix[12] = s->lightmap_matrix[13] = 0.5f / SCENE_SIDE;
    s->lightmap_matrix[15] = 1.0f;
    s->worst_psnr = 99.0;
    return NULL;
}

void scene_close(scene *s)
{
    free(s->samples);
    free(s->lightmap);
    memset(s, 0, sizeof *s);
}

terrimp_camera scene_camera(int frame, int width, int height)
{
    terrimp_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.eye[0] = camera.eye[2] = 60.0f + (float)frame;
    camera.eye[1] = 75.0f;
    camera.forward[0] = camera.forward[2] = 1.0f;
    camera.forward[1] = -0.4f;
    camera.width_px = (uint32_t)width;
    camera.height_px = (uint32_t)height;
    camera.z_near = 0.5f;
    camera.z_far = 1000.0f;
    return camera;
}

int scene_judges(int frame)
{
    return frame % 10 == 9;
}

void scene_judge(scene *s, int frame, const terrimp_stats *stats, const uint8_t *rgb,
                 const uint8_t *full, int width, int height)
{
    size_t count = (size_t)width * (size_t)height;
    double psnr = image_psnr(image_mean_square(rgb, full, count, scene_sky));
    if (psnr < s->worst_psnr)
        s->worst_psnr = psnr;
    s->holes += image_holes(rgb, full, width, height, scene_sky);
    printf("frame %2d: %3u impostors, %5u triangles, %2u captures; %.1f dB\n", frame,
           stats->impostors, stats->triangles, stats->captures, psnr);
}

int scene_accepts(const scene *s, double least_psnr)
{
    printf("%zu holes, at worst %.1f dB\n", s->holes, s->worst_psnr);
    return s->holes == 0 && s->worst_psnr >= least_psnr;
}
