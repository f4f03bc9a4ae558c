/* Builds terrains and says what each level of the quadtree costs and how good it is: time of the
   processor for a node, errors of the coarse meshes in % of the terrain's range of heights, samples
   that stand out of them by more than a millionth of it, and bytes.

   Build:  make bench_build
   Use:    build/bench_build [FILE.hgt...]     (none: two of the real tiles, if they are there)
   Leaves: build/bench/build.md (what it prints), build.tsv (its rows) */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_say.h"

#include "examples/host/dem.h"

/* The part of a node's samples that stand out of its mesh. */
static double standing_out(const terrimp_terrain *t, uint32_t node, float slack)
{
    terrimpi_terrain_tile p = terrimpi_terrain_tile_of(t, node);
    terrimpi_build build;
    terrimp_mesh mesh;
    uint32_t i, x, z, count = 0;
    size_t bytes = terrimpi_build_layout(&t->desc, NULL, &build);
    unsigned char *scratch = malloc(bytes);
    terrimpi_build_layout(&t->desc, scratch, &build);
    memset(&mesh, 0, sizeof mesh);
    mesh.vertices = build.vertices;
    mesh.indices = build.indices;
    mesh.border_vertex_count = terrimpi_mesh_border(&t->meshes[node]);
    mesh.surface_index_count = 3u * terrimpi_mesh_triangles(&t->meshes[node]);
    for (i = 0; i < terrimpi_mesh_vertices(&t->meshes[node]); i++) {
        terrimpi_mesh_point_steps point = terrimpi_mesh_point(t, &p, node, i);
        build.vertices[i].x = (uint16_t)point.x;
        build.vertices[i].z = (uint16_t)point.z;
        build.vertices[i].height = point.height;
    }
    for (i = 0; i < mesh.surface_index_count; i++)
        build.indices[i] = (uint16_t)terrimpi_mesh_corner(t, node, i);
    terrimpi_build_setup_triangles(&p, &mesh, build.facets);
    for (z = 0; z <= p.span_z; z++) {
        terrimpi_build_residual_of_row(&t->desc.field, &p, &mesh, &build, z);
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
    double start = clock_cpu_ms(), whole = start, range, *ms;
    if (!memory || !scratch || terrimp_terrain_init(desc, memory, bytes, &t) ||
        terrimp_terrain_build_begin(t))
        return 0;
    ms = calloc(t->tree.level_count, sizeof *ms);
    say("%u x %u samples, begin %.1f ms, scratch %.1f KiB\n", (unsigned)t->desc.field.width,
           (unsigned)t->desc.field.depth, clock_cpu_ms() - start, (double)scratch_bytes / 1024.0);
    for (level = 0; level < t->tree.level_count; level++) {
        start = clock_cpu_ms();
        for (node = t->tree.level_first[level]; node < t->tree.level_first[level + 1]; node++)
            if (terrimp_terrain_build_node(t, node, scratch, scratch_bytes))
                return 0;
        ms[level] = clock_cpu_ms() - start;
    }
    terrimp_terrain_build_finish(t);
    whole = clock_cpu_ms() - whole;
    terrimp_terrain_get_box(t, t->tree.node_count - 1u, &box);
    range = (double)(t->sample_high - t->sample_low);
    say("\n| level | nodes | ms a node | ms all | max %% | mean max %% | mean rms %% | "
        "above %% |\n|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (level = 0; level < t->tree.level_count; level++) {
        double most = 0, sum = 0, rms = 0, above = 0;
        uint32_t nodes = t->tree.level_first[level + 1] - t->tree.level_first[level];
        for (node = t->tree.level_first[level]; node < t->tree.level_first[level + 1]; node++) {
            const terrimpi_mesh *mesh = &t->meshes[node];
            most = (double)mesh->error > most ? (double)mesh->error : most;
            sum += (double)mesh->error;
            rms += (double)mesh->error_rms;
            above += standing_out(t, node, (float)(1e-6 * range));
        }
        say("| %u | %u | %.2f | %.0f | %.2f | %.2f | %.3f | %.3f |\n", (unsigned)level,
               (unsigned)nodes, ms[level] / nodes, ms[level], 100 * most / range,
               100 * sum / nodes / range, 100 * rms / nodes / range, 100 * above / nodes);
    }
    say("\nIn all %.0f ms, %.2f times level 0; %.1f bytes a node, %.3f a sample\n", whole,
           whole / ms[0], (double)bytes / t->tree.node_count,
           (double)bytes / ((double)t->desc.field.width * t->desc.field.depth));
    free(memory);
    free(scratch);
    free(ms);
    return 1;
}

static void bench_file(const char *path)
{
    terrimp_terrain_desc desc = {0};
    const dem_desc whole = {0};
    const char *trouble = NULL;
    dem d;
    if (!dem_load(&d, path, &whole))
        bench_stop(path, d.error);
    dem_fill_voids(&d, &trouble);
    desc.field = dem_heightfield(&d);
    say("\n%s: ", path);
    if (!bench(&desc))
        bench_stop(path, "it cannot be built");
    dem_free(&d);
}

int main(int argc, char **argv)
{
    static const char *const tiles[] = {"N42E001.hgt", "N49E011.hgt"};
    int i;
    say_open("build", 1);
    say_machine(NULL);
    for (i = 1; i < argc; i++)
        bench_file(argv[i]);
    for (i = 0; argc < 2 && i < 2; i++) {
        char path[1024];
        FILE *file;
        snprintf(path, sizeof path, "%s/%s", bench_data(), tiles[i]);
        file = fopen(path, "rb");
        if (file) {
            fclose(file);
            bench_file(path);
        } else {
            say("\n%s is not there\n", path);
        }
    }
    say_close();
    return 0;
}
