/* Builds terrains and says what each level of the quadtree costs and how good it is: time of the
   processor for a node, errors of the coarse meshes in % of the terrain's range of heights, samples
   that stand out of them by more than a millionth of it, and bytes.

   Build and run: make bench_build && build/bench_build FILE.hgt... */
#define _POSIX_C_SOURCE 199309L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "examples/host/dem.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

/* The part of a node's samples that stand out of its mesh. */
static double standing_out(const terrimp_terrain *t, uint32_t node, float slack)
{
    terrimpi_patch p = terrimpi_patch_of(t, node);
    terrimpi_build build;
    terrimp_mesh mesh;
    uint32_t i, x, z, count = 0;
    size_t bytes = terrimpi_build_layout(&t->desc, NULL, &build);
    unsigned char *scratch = malloc(bytes);
    terrimpi_build_layout(&t->desc, scratch, &build);
    memset(&mesh, 0, sizeof mesh);
    mesh.vertices = build.vertices;
    mesh.indices = build.indices;
    mesh.border_vertex_count = t->meshes[node].border_count;
    mesh.surface_index_count = 3u * t->meshes[node].triangle_count;
    for (i = 0; i < t->meshes[node].vertex_count; i++) {
        const terrimpi_point *point = t->points + (size_t)node * t->vertex_limit + i;
        build.vertices[i].x = point->x;
        build.vertices[i].z = point->z;
        build.vertices[i].height = terrimpi_mesh_height(t, point->height);
    }
    for (i = 0; i < mesh.surface_index_count; i++)
        build.indices[i] = t->corners[(size_t)node * t->index_limit + i];
    terrimpi_make_facets(&p, &mesh, build.facets);
    for (z = 0; z <= p.span_z; z++) {
        terrimpi_survey_row(t, &p, &mesh, &build, z);
        for (x = 0; x <= p.span_x; x++)
            count += build.row[x] > slack;
    }
    free(scratch);
    return (double)count / ((double)(p.span_x + 1u) * (double)(p.span_z + 1u));
}

static int bench(const terrimp_terrain_desc *desc)
{
    size_t bytes = terrimp_terrain_bytes(desc), scratch_bytes = terrimp_terrain_scratch_bytes(desc);
    void *memory = malloc(bytes), *scratch = malloc(scratch_bytes);
    terrimp_terrain *t = NULL;
    terrimp_box box;
    uint32_t level, node;
    double start = now_ms(), whole = start, range, *ms;
    if (!memory || !scratch || terrimp_terrain_init(desc, memory, bytes, &t) ||
        terrimp_terrain_build_begin(t))
        return 0;
    ms = calloc(t->tree.level_count, sizeof *ms);
    printf("%u x %u samples, begin %.1f ms, scratch %.1f KiB\n", (unsigned)t->desc.field.width,
           (unsigned)t->desc.field.depth, now_ms() - start, (double)scratch_bytes / 1024.0);
    for (level = 0; level < t->tree.level_count; level++) {
        start = now_ms();
        for (node = t->tree.level_first[level]; node < t->tree.level_first[level + 1]; node++)
            if (terrimp_terrain_build_node(t, node, scratch, scratch_bytes))
                return 0;
        ms[level] = now_ms() - start;
    }
    terrimp_terrain_build_finish(t);
    whole = now_ms() - whole;
    terrimp_terrain_get_box(t, t->tree.node_count - 1u, &box);
    range = (double)(t->sample_high - t->sample_low);
    printf("level nodes  ms/node   ms all  max %%  mean max %%  mean rms %%  upper skirt %%  above "
           "%%  clamped\n");
    for (level = 0; level < t->tree.level_count; level++) {
        double most = 0, sum = 0, rms = 0, skirt = 0, above = 0;
        uint32_t nodes = t->tree.level_first[level + 1] - t->tree.level_first[level], clamped = 0;
        for (node = t->tree.level_first[level]; node < t->tree.level_first[level + 1]; node++) {
            const terrimpi_mesh *mesh = &t->meshes[node];
            uint32_t i;
            most = (double)mesh->error > most ? (double)mesh->error : most;
            sum += (double)mesh->error;
            rms += (double)mesh->error_rms;
            skirt += (double)mesh->upper_skirt;
            above += standing_out(t, node, (float)(1e-6 * range));
            for (i = 0; i < mesh->vertex_count; i++)
                clamped += t->points[(size_t)node * t->vertex_limit + i].height % 65535u == 0;
        }
        printf("%3u %7u %8.2f %8.0f %6.2f %8.2f %11.3f %11.2f %12.3f %6u\n", (unsigned)level,
               (unsigned)nodes, ms[level] / nodes, ms[level], 100 * most / range,
               100 * sum / nodes / range, 100 * rms / nodes / range, 100 * skirt / nodes / range,
               100 * above / nodes, (unsigned)clamped);
    }
    printf("in all %.0f ms, %.2f times level 0; %.1f bytes a node, %.3f a sample\n", whole,
           whole / ms[0], (double)bytes / t->tree.node_count,
           (double)bytes / ((double)t->desc.field.width * t->desc.field.depth));
    free(memory);
    free(scratch);
    free(ms);
    return 1;
}

int main(int argc, char **argv)
{
    int i;
    for (i = 1; i < argc; i++) {
        terrimp_terrain_desc desc = {0};
        const dem_desc whole = {0};
        const char *trouble = NULL;
        dem d;
        if (!dem_load(&d, argv[i], &whole)) {
            fprintf(stderr, "%s\n", d.error);
            return 1;
        }
        dem_fill_voids(&d, &trouble);
        desc.field = dem_heightfield(&d);
        printf("%s: ", argv[i]);
        if (!bench(&desc))
            return 1;
        dem_free(&d);
    }
    return 0;
}
