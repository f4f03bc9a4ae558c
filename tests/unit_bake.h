/* Laws of the bake room: round trips without a copy, byte orders, and blocks that are damaged or
   made to do harm. */
#ifndef UNIT_BAKE_H
#define UNIT_BAKE_H

#include "unit_view.h"

/* A land and its bake, in blocks of exactly the right size: a sanitizer sees each byte beyond. */
typedef struct baked_land {
    land l;
    size_t bytes;
    unsigned char *block;
    void *memory;
    terrimp_terrain *opened;
} baked_land;

static int bake_land(baked_land *b, uint32_t width, uint32_t depth, int format, land_shape shape,
                     uint32_t chunk_quads, uint32_t budget)
{
    int kind = (int)(width + depth);
    memset(b, 0, sizeof *b);
    land_prepare(&b->l, width, depth, format, shape);
    b->l.desc.chunk_quads = chunk_quads;
    b->l.desc.triangle_budget = budget;
    b->l.desc.not_proud = kind % 3 == 0;
    b->l.desc.no_lower_skirts = kind % 4 == 1;
    if (!land_build(&b->l))
        return 0;
    b->bytes = terrimp_bake_bytes(b->l.terrain);
    CHECK(b->bytes > 0);
    b->block = (unsigned char *)malloc(b->bytes);
    b->memory = malloc(terrimp_terrain_open_bytes());
    CHECK(terrimp_bake_write(b->l.terrain, b->block, b->bytes, 0) == TERRIMP_OK);
    return 1;
}

static terrimp_result baked_open(baked_land *b)
{
    return terrimp_terrain_open(&b->l.desc.field, b->block, b->bytes, b->memory,
                                terrimp_terrain_open_bytes(), &b->opened);
}

static void baked_free(baked_land *b)
{
    land_free(&b->l);
    free(b->block);
    free(b->memory);
}

/* Two terrains fill the same buffers and have the same boxes. */
static void check_same_terrain(const land *l, const terrimp_terrain *other)
{
    terrimp_terrain_info info;
    uint32_t node;
    size_t vertices = l->info.ground_vertex_count;
    float *xyz = (float *)malloc(l->info.mesh_vertex_count * 3u * sizeof(float));
    uint16_t *indices = (uint16_t *)malloc(l->info.mesh_index_count * sizeof(uint16_t));
    uint16_t *patterns = (uint16_t *)malloc(l->info.ground_index_count * sizeof(uint16_t));
    float *ground[2];
    terrimp_geomip_vertex *morph[2];
    int i;
    CHECK(terrimp_terrain_get_info(other, &info) == TERRIMP_OK);
    CHECK(memcmp(&info, &l->info, sizeof info) == 0);
    CHECK(terrimp_terrain_fill_meshes(other, xyz, l->info.mesh_vertex_count * 3u, indices,
                                      l->info.mesh_index_count) == TERRIMP_OK);
    CHECK(memcmp(xyz, l->xyz, l->info.mesh_vertex_count * 3u * sizeof(float)) == 0);
    CHECK(memcmp(indices, l->indices, l->info.mesh_index_count * sizeof(uint16_t)) == 0);
    CHECK(terrimp_terrain_fill_indices(other, patterns, l->info.ground_index_count) == TERRIMP_OK);
    CHECK(memcmp(patterns, l->patterns, l->info.ground_index_count * sizeof(uint16_t)) == 0);
    for (i = 0; i < 2; i++) {
        ground[i] = (float *)malloc(vertices * 3u * sizeof(float));
        morph[i] = (terrimp_geomip_vertex *)malloc(vertices * sizeof *morph[i]);
    }
    for (node = 0; node < l->info.node_count; node++) {
        const terrimp_terrain *terrain[2];
        terrimp_box box[2];
        terrimp_mesh_info mesh[2];
        terrain[0] = l->terrain;
        terrain[1] = other;
        for (i = 0; i < 2; i++) {
            CHECK(terrimp_terrain_get_box(terrain[i], node, &box[i]) == TERRIMP_OK);
            CHECK(terrimp_terrain_get_mesh(terrain[i], node, &mesh[i]) == TERRIMP_OK);
            CHECK(terrimp_terrain_fill_ground(terrain[i], node, ground[i], vertices * 3u) ==
                  TERRIMP_OK);
            CHECK(terrimp_terrain_fill_morph(terrain[i], node, morph[i], vertices) == TERRIMP_OK);
        }
        CHECK(memcmp(&box[0], &box[1], sizeof box[0]) == 0);
        CHECK(memcmp(&mesh[0], &mesh[1], sizeof mesh[0]) == 0);
        CHECK(memcmp(ground[0], ground[1], vertices * 3u * sizeof(float)) == 0);
        CHECK(memcmp(morph[0], morph[1], vertices * sizeof *morph[0]) == 0);
        CHECK(memcmp(&l->terrain->tree.nodes[node], &other->tree.nodes[node],
                     sizeof *other->tree.nodes) == 0);
    }
    for (i = 0; i < 2; i++) {
        free(ground[i]);
        free(morph[i]);
    }
    free(xyz);
    free(indices);
    free(patterns);
}

static const uint32_t bake_sizes[][5] = {/* width, depth, chunk quads, budget, format */
    {2, 2, 0, 0, TERRIMP_FORMAT_F32},   {3, 200, 8, 32, TERRIMP_FORMAT_U8},
    {70, 41, 8, 40, TERRIMP_FORMAT_S16}, {65, 66, 16, 85, TERRIMP_FORMAT_U16},
    {130, 97, 32, 400, TERRIMP_FORMAT_F32}, {33, 9, 4, 33, TERRIMP_FORMAT_U8}};

static int bake_sized(baked_land *b, size_t i)
{
    return bake_land(b, bake_sizes[i][0], bake_sizes[i][1], (int)bake_sizes[i][4],
                     i % 2 ? LAND_NOISE : LAND_HILLS, bake_sizes[i][2], bake_sizes[i][3]);
}

/* A terrain that uses a bake where it lies is the terrain that was baked, and leaves the bake as it
   is, wherever it lies. */
static void opened_bakes_are_the_terrain_that_was_baked(void)
{
    size_t i;
    for (i = 0; i < sizeof bake_sizes / sizeof bake_sizes[0]; i++) {
        baked_land b;
        if (bake_sized(&b, i)) {
            terrimp_bake_info info;
            unsigned char *copy = (unsigned char *)malloc(b.bytes);
            memcpy(copy, b.block, b.bytes);
            CHECK(terrimp_bake_check(b.block, b.bytes, &b.l.desc.field, &info) == TERRIMP_OK);
            CHECK(info.bytes == b.bytes && info.node_count == b.l.info.node_count);
            CHECK(info.width == b.l.desc.field.width && info.depth == b.l.desc.field.depth);
            CHECK(info.format == b.l.desc.field.format && info.level_count == b.l.info.level_count);
            CHECK(info.chunk_quads == b.l.info.chunk_quads);
            CHECK(info.triangle_budget == b.l.desc.triangle_budget);
            CHECK(baked_open(&b) == TERRIMP_OK);
            check_same_terrain(&b.l, b.opened);
            CHECK(memcmp(copy, b.block, b.bytes) == 0);
            CHECK(terrimp_bake_write(b.l.terrain, copy, b.bytes, 0) == TERRIMP_OK);
            CHECK(memcmp(copy, b.block, b.bytes) == 0); /* the same bytes each time */
            CHECK(terrimp_bake_write(b.l.terrain, copy, b.bytes - 1u, 0) == TERRIMP_E_CAPACITY);
            free(copy);
        }
        baked_free(&b);
    }
}

static void views_of_opened_bakes_give_the_same_commands(void)
{
    baked_land b;
    check_state = 77u;
    if (bake_land(&b, 97, 81, TERRIMP_FORMAT_F32, LAND_HILLS, 8, 32)) {
        terrimp_view_desc desc;
        uint32_t hash;
        land other = b.l;
        memset(&desc, 0, sizeof desc);
        check_state = 5u;
        hash = fly_and_check(&b.l, &desc, 40, &flight_room);
        CHECK(baked_open(&b) == TERRIMP_OK);
        other.terrain = b.opened;
        check_state = 5u;
        CHECK(fly_and_check(&other, &desc, 40, &flight_room) == hash);
    }
    baked_free(&b);
}

/* At the default budget a node takes 640 bytes or less on average. */
static void bakes_are_small(void)
{
    baked_land b;
    if (bake_land(&b, 300, 300, TERRIMP_FORMAT_U8, LAND_HILLS, 0, 0)) {
        CHECK(b.bytes <= 640u * b.l.info.node_count);
        CHECK(terrimp_terrain_open_bytes() <= 1024u);
    }
    baked_free(&b);
}

/* The place and spacing of a field are the host's; its size, format and heights are the bake's. */
static void bakes_open_on_their_own_field_alone(void)
{
    baked_land b;
    if (bake_sized(&b, 2)) {
        terrimp_heightfield good = b.l.desc.field, *f = &b.l.desc.field;
        terrimp_box box, moved;
        int16_t *sample = (int16_t *)(void *)b.l.samples + 41;
        CHECK(baked_open(&b) == TERRIMP_OK);
        CHECK(terrimp_terrain_get_box(b.opened, 3, &box) == TERRIMP_OK);
        f->origin_x = 1000.0f;
        f->spacing_z = 2.0f;
        CHECK(baked_open(&b) == TERRIMP_OK);
        CHECK(terrimp_terrain_get_box(b.opened, 3, &moved) == TERRIMP_OK);
        CHECK(moved.min[0] == box.min[0] + 1000.0f && moved.max[2] == box.max[2] * 2.0f);
        CHECK(moved.min[1] == box.min[1]);
        *f = good;
        f->width--;
        CHECK(baked_open(&b) == TERRIMP_E_BAKE);
        *f = good;
        f->depth--;
        CHECK(baked_open(&b) == TERRIMP_E_BAKE);
        *f = good;
        f->format = TERRIMP_FORMAT_U16;
        CHECK(baked_open(&b) == TERRIMP_E_BAKE);
        *f = good;
        f->height_scale *= 1.5f;
        CHECK(baked_open(&b) == TERRIMP_E_BAKE);
        *f = good;
        f->height_offset += 1.0f;
        CHECK(baked_open(&b) == TERRIMP_E_BAKE);
        *f = good;
        *sample = (int16_t)(*sample + 1);
        CHECK(baked_open(&b) == TERRIMP_OK);
        CHECK(terrimp_bake_check(b.block, b.bytes, f, NULL) == TERRIMP_E_BAKE);
    }
    baked_free(&b);
}

/* Whether each word of one block is that of the other in reverse. */
static int is_swapped(const unsigned char *a, const unsigned char *b, size_t bytes)
{
    size_t i;
    for (i = 0; i < bytes; i++)
        if (a[i] != b[i ^ 3u])
            return 0;
    return bytes % 4u == 0;
}

/* What is written for the other byte order is refused here, and right when it is swapped back. */
static void bakes_are_written_for_the_other_byte_order(void)
{
    size_t i, k;
    for (i = 0; i < sizeof bake_sizes / sizeof bake_sizes[0]; i++) {
        baked_land b;
        if (bake_sized(&b, i)) {
            unsigned char *copy = (unsigned char *)malloc(b.bytes);
            terrimp_bake_info info;
            memset(&info, UNTOUCHED, sizeof info);
            CHECK(terrimp_bake_write(b.l.terrain, copy, b.bytes, 1) == TERRIMP_OK);
            CHECK(is_swapped(b.block, copy, b.bytes));
            CHECK(terrimp_bake_check(copy, b.bytes, NULL, &info) == TERRIMP_E_ORDER);
            CHECK(is_untouched(&info, sizeof info));
            for (k = 0; k < b.bytes; k++)
                b.block[k] = copy[k];
            CHECK(baked_open(&b) == TERRIMP_E_ORDER && b.opened == NULL);
            for (k = 0; k < b.bytes; k++)
                b.block[k] = copy[k ^ 3u];
            CHECK(baked_open(&b) == TERRIMP_OK);
            check_same_terrain(&b.l, b.opened);
            free(copy);
        }
        baked_free(&b);
    }
}

/* Pulls all that a host would pull of a terrain; a sanitizer sees what goes wrong. */
static void use_opened(const terrimp_terrain *terrain)
{
    terrimp_terrain_info info;
    float *xyz;
    uint16_t *indices;
    uint32_t node, i;
    CHECK(terrimp_terrain_get_info(terrain, &info) == TERRIMP_OK);
    xyz = (float *)malloc(info.mesh_vertex_count * 3u * sizeof(float));
    indices = (uint16_t *)malloc(info.mesh_index_count * sizeof(uint16_t));
    CHECK(terrimp_terrain_fill_meshes(terrain, xyz, info.mesh_vertex_count * 3u, indices,
                                      info.mesh_index_count) == TERRIMP_OK);
    for (i = 0; i < info.mesh_vertex_count * 3u; i++)
        CHECK(xyz[i] - xyz[i] == 0.0f); /* finite */
    for (node = 0; node < info.node_count; node++) {
        terrimp_mesh_info mesh;
        terrimp_box box;
        CHECK(terrimp_terrain_get_mesh(terrain, node, &mesh) == TERRIMP_OK);
        CHECK(terrimp_terrain_get_box(terrain, node, &box) == TERRIMP_OK);
        CHECK(mesh.vertex_count <= info.mesh_vertex_stride);
        CHECK(mesh.index_count <= info.mesh_index_stride);
        CHECK(mesh.error >= 0.0f && box.min[1] <= box.max[1]);
        for (i = 0; i < mesh.index_count; i++)
            CHECK(indices[mesh.first_index + i] < mesh.vertex_count);
    }
    free(xyz);
    free(indices);
}

/* Makes the checksum right again, as somebody would who wants a false block to pass. */
static void forge_checksum(unsigned char *block)
{
    terrimpi_bake bake;
    terrimp_terrain t;
    memcpy(&bake, block, sizeof bake);
    if (!terrimpi_bake_header(&bake, TERRIMP_BAKE_VERSION, &t) ||
        !terrimpi_bake_bytes_fit(&bake, bake.bytes, &t))
        return;
    bake.checksum = terrimpi_bake_hash(block);
    memcpy(block, &bake, sizeof bake);
}

/* Changed bytes are seen, but between the arrays, where nothing stands; with a forged checksum too
   no block is opened that would lead astray. */
static void damaged_bakes_do_no_harm(void)
{
    size_t i;
    for (i = 0; i < sizeof bake_sizes / sizeof bake_sizes[0]; i++) {
        baked_land b;
        if (bake_sized(&b, i)) {
            unsigned char *good = (unsigned char *)malloc(b.bytes);
            uint32_t round, opened = 0, refused = 0;
            memcpy(good, b.block, b.bytes);
            for (round = 0; round < 400; round++) {
                uint32_t flips = random_range(1, 3), k, at = 0;
                int forged = round % 4u != 0;
                terrimp_result result;
                memcpy(b.block, good, b.bytes);
                for (k = 0; k < flips; k++) {
                    /* half of them in the header */
                    at = random_range(0, random_bits() & 1u ? (uint32_t)sizeof(terrimpi_bake) - 1u
                                                            : (uint32_t)b.bytes - 1u);
                    b.block[at] ^= (unsigned char)(1u << random_range(0, 7));
                }
                if (memcmp(b.block, good, b.bytes) == 0)
                    continue;
                if (forged && memcmp(b.block + 8, good + 8, 4) == 0)
                    forge_checksum(b.block);
                b.opened = NULL;
                result = baked_open(&b);
                CHECK(result == TERRIMP_OK || result == TERRIMP_E_BAKE);
                CHECK((result == TERRIMP_OK) == (b.opened != NULL));
                if (result == TERRIMP_OK) {
                    use_opened(b.opened);
                    opened++;
                    CHECK(forged || memcmp(b.block, good, sizeof(terrimpi_bake)) == 0);
                } else {
                    refused++;
                }
                if (result == TERRIMP_OK && !forged)
                    check_same_terrain(&b.l, b.opened);
            }
            CHECK(refused > opened);
            free(good);
        }
        baked_free(&b);
    }
}

/* Every number of a node is looked at: each is made false in turn, with a forged checksum. */
static void every_false_number_of_a_bake_is_refused(void)
{
    static const float bad[] = {-1.0f, FLT_MAX, 0.0f};
    baked_land b;
    uint32_t kind;
    int baked = bake_sized(&b, 2);
    unsigned char *sound = (unsigned char *)malloc(b.bytes + 1u);
    memcpy(sound, b.block, b.bytes);
    CHECK(baked);
    for (kind = 0; baked && kind < 30; kind++) {
        terrimpi_bake *bake = (terrimpi_bake *)(void *)b.block;
        terrimp_terrain t;
        uint32_t node = random_range(0, b.l.info.node_count - 1u);
        terrimp_geomip_node *ground;
        terrimpi_mesh *mesh;
        uint32_t *points, *corners, vertices;
        const uint32_t nan_bits = 0x7fc00000u;
        float nan;
        memcpy(&nan, &nan_bits, sizeof nan);
        CHECK(terrimpi_bake_header(bake, TERRIMP_BAKE_VERSION, &t));
        terrimpi_bake_arrays_at(&t, b.block);
        ground = &t.tree.nodes[node];
        mesh = &t.meshes[node];
        points = t.points + (size_t)node * t.vertex_limit;
        corners = t.corners + (size_t)node * (t.index_limit / 4u);
        vertices = terrimpi_mesh_vertices(mesh);
        switch (kind) {
        case 0: ground->low = nan; break;
        case 1: ground->low = ground->high + 1.0f; break;
        case 2: ground->high = bad[1]; break;
        case 3: ground->error = bad[0]; break;
        case 4: ground->error = nan; break;
        case 5: ground->rms = bad[0]; break;
        case 6: ground->rms = nan; break;
        case 7: mesh->error = bad[0]; break;
        case 8: mesh->error = nan; break;
        case 9: mesh->error_rms = nan; break;
        case 10: mesh->error_rms = bad[0]; break;
        case 11: mesh->base = nan; break;
        case 12: mesh->base = bad[1]; break;
        case 13: mesh->low = nan; break;
        case 14: mesh->high = mesh->low; break;
        case 15: mesh->counts = (mesh->counts & ~0x1ffu) | 401u; break;
        case 16: mesh->counts = (mesh->counts & ~0x1ffu) | 1u; break;
        case 17: mesh->counts = (mesh->counts & ~0xfe00u) | 3u << 9; break;
        case 18: mesh->counts |= 255u << 16; break;
        case 19: mesh->counts &= ~(255u << 16); break;
        case 20: corners[0] = (corners[0] & ~0xff00u) | vertices << 8; break;
        case 21: corners[0] = (corners[0] & ~0xffu) | (corners[0] >> 8 & 0xffu); break;
        case 22: points[1] ^= 0x300u; break; /* another side */
        case 23: points[vertices - 1u] |= 17u << 8; break;
        case 24: points[0] |= 1u; break;
        case 25: points[0] |= 0xfffffc00u; break;
        case 26: mesh->counts |= 0x7fu << 25; break; /* steps of infinite height */
        case 27: corners[0] = corners[0] >> 24 | corners[1] << 8; break; /* a hole */
        case 28: points[0] |= 1u << 7; break;
        default: mesh->counts += 1u << 9; break;
        }
        forge_checksum(b.block);
        if (baked_open(&b) != TERRIMP_E_BAKE)
            fprintf(stderr, "kind %u\n", (unsigned)kind);
        CHECK(baked_open(&b) == TERRIMP_E_BAKE);
        memcpy(b.block, sound, b.bytes);
    }
    CHECK(!baked || baked_open(&b) == TERRIMP_OK);
    free(sound);
    baked_free(&b);
}

/* A surface of the right area that covers one half twice and the other not at all. */
static void surfaces_with_holes_are_refused(void)
{
    baked_land b;
    if (bake_sized(&b, 0)) {
        terrimp_terrain t;
        CHECK(terrimpi_bake_header((terrimpi_bake *)(void *)b.block, TERRIMP_BAKE_VERSION,
                                   &t));
        terrimpi_bake_arrays_at(&t, b.block);
        CHECK(terrimpi_mesh_triangles(&t.meshes[0]) == 2);
        t.corners[0] = t.corners[0] >> 24 | t.corners[1] << 8;
        forge_checksum(b.block);
        CHECK(baked_open(&b) == TERRIMP_E_BAKE);
    }
    baked_free(&b);
}

static void truncated_bakes_are_refused(void)
{
    baked_land b;
    if (bake_sized(&b, 1)) {
        size_t bytes, step = b.bytes / 300u + 1u;
        for (bytes = 0; bytes < b.bytes; bytes += bytes < 200u ? 1u : step) {
            uint64_t *cut = (uint64_t *)malloc(bytes + 1u);
            memcpy(cut, b.block, bytes);
            CHECK(terrimp_bake_check(cut, bytes, NULL, NULL) == TERRIMP_E_BAKE);
            free(cut);
        }
    }
    baked_free(&b);
}

/* What follows a bake, as in a file of several, is left alone. */
static void bakes_may_have_company(void)
{
    baked_land b;
    if (bake_sized(&b, 0)) {
        unsigned char *more = (unsigned char *)malloc(b.bytes + 100u);
        terrimp_bake_info info;
        memcpy(more, b.block, b.bytes);
        memset(more + b.bytes, UNTOUCHED, 100);
        CHECK(terrimp_bake_check(more, b.bytes + 100u, NULL, &info) == TERRIMP_OK);
        CHECK(info.bytes == b.bytes);
        CHECK(terrimp_bake_write(b.l.terrain, more, b.bytes + 100u, 1) == TERRIMP_OK);
        CHECK(is_untouched(more + b.bytes, 100));
        free(more);
    }
    baked_free(&b);
}

/* ---- edits ---- */

/* All that a host holds of one node. */
static size_t node_floats(const land *l)
{
    return 3u * (l->info.ground_vertex_count + l->info.mesh_vertex_stride);
}

typedef struct host_copy {
    float *floats;
    uint16_t *indices;
    terrimp_geomip_vertex *morph;
} host_copy;

static host_copy copy_host(const land *l, const terrimp_terrain *terrain)
{
    host_copy c;
    uint32_t node, count = l->info.node_count, vertices = l->info.ground_vertex_count;
    c.floats = (float *)malloc(count * node_floats(l) * sizeof(float));
    c.indices = (uint16_t *)malloc((size_t)count * l->info.mesh_index_stride * sizeof(uint16_t));
    c.morph = (terrimp_geomip_vertex *)malloc((size_t)count * vertices * sizeof *c.morph);
    for (node = 0; node < count; node++) {
        float *at = c.floats + node * node_floats(l);
        CHECK(terrimp_terrain_fill_ground(terrain, node, at, 3u * vertices) == TERRIMP_OK);
        CHECK(terrimp_terrain_fill_morph(terrain, node, c.morph + (size_t)node * vertices,
                                         vertices) == TERRIMP_OK);
        CHECK(terrimp_terrain_fill_mesh(terrain, node, at + 3u * vertices,
                                        3u * l->info.mesh_vertex_stride,
                                        c.indices + (size_t)node * l->info.mesh_index_stride,
                                        l->info.mesh_index_stride) == TERRIMP_OK);
    }
    return c;
}

static void free_host(host_copy *c)
{
    free(c->floats);
    free(c->indices);
    free(c->morph);
}

static int listed(const uint32_t *nodes, uint32_t count, uint32_t node)
{
    while (count-- > 0)
        if (nodes[count] == node)
            return 1;
    return 0;
}

/* What touched does not list is as it was. */
static void check_touched(const land *l, const terrimp_rect *rect, const host_copy *before,
                          const host_copy *after)
{
    uint32_t *nodes[2], count[2] = {0, 0}, node, i;
    size_t floats = node_floats(l), morphs = l->info.ground_vertex_count;
    int morph;
    for (morph = 0; morph < 2; morph++) {
        CHECK(terrimp_terrain_touched(l->terrain, rect, morph, NULL, 0, &count[morph]) ==
              TERRIMP_OK);
        nodes[morph] = (uint32_t *)malloc((count[morph] + 1u) * sizeof(uint32_t));
        CHECK(terrimp_terrain_touched(l->terrain, rect, morph, nodes[morph], count[morph] - 1u,
                                      &count[morph]) == TERRIMP_E_CAPACITY);
        CHECK(terrimp_terrain_touched(l->terrain, rect, morph, nodes[morph], count[morph],
                                      &count[morph]) == TERRIMP_OK);
        for (i = 0; i < count[morph]; i++)
            CHECK(nodes[morph][i] < l->info.node_count &&
                  (i == 0 || nodes[morph][i] > nodes[morph][i - 1u]));
        CHECK(listed(nodes[morph], count[morph], l->info.node_count - 1u)); /* the root */
    }
    CHECK(count[0] <= count[1]);
    for (node = 0; node < l->info.node_count; node++) {
        if (!listed(nodes[0], count[0], node)) {
            CHECK(memcmp(before->floats + node * floats, after->floats + node * floats,
                         floats * sizeof(float)) == 0);
            CHECK(memcmp(before->indices + node * l->info.mesh_index_stride,
                         after->indices + node * l->info.mesh_index_stride,
                         l->info.mesh_index_stride * sizeof(uint16_t)) == 0);
        }
        if (!listed(nodes[1], count[1], node))
            CHECK(memcmp(before->morph + node * morphs, after->morph + node * morphs,
                         morphs * sizeof *before->morph) == 0);
    }
    free(nodes[0]);
    free(nodes[1]);
}

/* A terrain of width, depth and chunk whose heights may be edited within a named range. */
static int land_to_edit(land *l, const uint32_t size[3])
{
    land_prepare(l, size[0], size[1], TERRIMP_FORMAT_F32, LAND_HILLS);
    l->desc.chunk_quads = size[2];
    l->desc.height_low = -10.0f;
    l->desc.height_high = 300.0f;
    return land_build(l);
}

/* After edits a terrain is, byte for byte, the one that is built of the new samples. */
static void rebuilt_terrains_equal_those_built_anew(void)
{
    static const uint32_t sizes[][3] = {{70, 59, 8}, {131, 40, 6}, {2, 90, 4}, {33, 33, 32}};
    size_t i;
    for (i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        land l;
        int edit;
        void *scratch;
        size_t scratch_bytes, bytes;
        if (!land_to_edit(&l, sizes[i])) {
            land_free(&l);
            continue;
        }
        scratch_bytes = terrimp_terrain_scratch_bytes(&l.desc);
        scratch = malloc(scratch_bytes);
        bytes = terrimp_bake_bytes(l.terrain);
        for (edit = 0; edit < (int)check_rounds(4, 20); edit++) {
            terrimp_terrain *anew = NULL;
            terrimp_rect rect;
            uint32_t x, z;
            host_copy before = copy_host(&l, l.terrain), after;
            unsigned char *block[2];
            rect.x = random_range(0, sizes[i][0] - 1u);
            rect.y = random_range(0, sizes[i][1] - 1u);
            rect.width = edit == 0 ? UINT32_MAX : random_range(1, 9);
            rect.height = edit == 0 ? UINT32_MAX : random_range(1, 9);
            for (z = rect.y; z < sizes[i][1] && z - rect.y < rect.height; z++)
                for (x = rect.x; x < sizes[i][0] && x - rect.x < rect.width; x++)
                    l.samples[(size_t)z * sizes[i][0] + x] = random_float(-10.0f, 300.0f);
            CHECK(terrimp_terrain_rebuild(l.terrain, &rect, scratch, scratch_bytes) == TERRIMP_OK);
            CHECK(terrimp_terrain_create(&l.desc, NULL, &anew) == TERRIMP_OK);
            block[0] = (unsigned char *)malloc(bytes);
            block[1] = (unsigned char *)malloc(bytes);
            CHECK(terrimp_bake_write(l.terrain, block[0], bytes, 0) == TERRIMP_OK);
            CHECK(terrimp_bake_write(anew, block[1], bytes, 0) == TERRIMP_OK);
            CHECK(memcmp(block[0], block[1], bytes) == 0);
            after = copy_host(&l, l.terrain);
            check_touched(&l, &rect, &before, &after);
            free_host(&before);
            free_host(&after);
            free(block[0]);
            free(block[1]);
            terrimp_terrain_destroy(anew);
        }
        free(scratch);
        land_free(&l);
    }
}

static void bake_change_samples(land *l, const terrimp_rect *rect)
{
    uint32_t x, z, width = l->desc.field.width;
    float low = random_float(-10.0f, 250.0f), high = low + random_magnitude(0.5f, 50.0f);
    for (z = rect->y; z < l->desc.field.depth && z - rect->y < rect->height; z++)
        for (x = rect->x; x < width && x - rect->x < rect->width; x++)
            l->samples[(size_t)z * width + x] = random_float(low, high);
}

/* Boxes and errors of a terrain hold all that is known of one that has been built anew, and the
   errors of its meshes are no less than those of the meshes as they are. */
static void check_edit_bounds(land *l, const terrimp_terrain *anew)
{
    const terrimp_quadtree *tree = terrimp_terrain_tree(l->terrain);
    const terrimp_quadtree *exact = terrimp_terrain_tree(anew);
    uint32_t node, i;
    CHECK(terrimp_terrain_get_info(l->terrain, &l->info) == TERRIMP_OK);
    CHECK(terrimp_terrain_fill_meshes(l->terrain, l->xyz, l->info.mesh_vertex_count * 3u,
                                      l->indices, l->info.mesh_index_count) == TERRIMP_OK);
    for (node = 0; node < l->info.node_count; node++) {
        const terrimp_geomip_node *has = &tree->nodes[node], *is = &exact->nodes[node];
        uint32_t first[2], last[2], cols;
        float *heights = mesh_heights(l, node);
        double worst = 0.0, squares = 0.0, count;
        terrimp_mesh_info mesh;
        CHECK(has->low <= is->low && has->high >= is->high && has->error >= is->error);
        CHECK(has->rms >= is->rms * (1.0f - 1e-5f));
        CHECK(terrimp_terrain_get_mesh(l->terrain, node, &mesh) == TERRIMP_OK);
        check_chunk_box(l, node);
        land_span(l, node, first, last);
        cols = last[0] - first[0] + 1u;
        count = (double)cols * (last[1] - first[1] + 1u);
        for (i = 0; i < (uint32_t)count; i++) {
            double miss = fabs((double)heights[i] -
                               (double)land_sample(l, first[0] + i % cols, first[1] + i / cols));
            worst = fmax(worst, miss);
            squares += miss * miss;
        }
        CHECK(worst <= (double)mesh.error * (1.0 + 1e-4) + 3e-3);
        CHECK(sqrt(squares / count) <= (double)mesh.error_rms * (1.0 + 1e-4) + 3e-3);
        free(heights);
    }
    check_hierarchy(l);
}

/* Between edits and slices of the rest all bounds hold; after the last slice the terrain is, byte
   for byte, one that is built anew. */
static void edits_in_slices_end_as_what_is_built_anew(void)
{
    static const uint32_t sizes[][3] = {{67, 52, 8}, {38, 31, 4}, {129, 40, 16}, {3, 46, 4}};
    size_t i;
    for (i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        land l;
        void *scratch;
        size_t scratch_bytes, bytes;
        uint32_t slice, done = 0, nodes[7], most = 0;
        unsigned char *block[2];
        terrimp_terrain *anew = NULL;
        if (!land_to_edit(&l, sizes[i])) {
            land_free(&l);
            continue;
        }
        scratch_bytes = terrimp_terrain_scratch_bytes(&l.desc);
        scratch = malloc(scratch_bytes);
        bytes = terrimp_bake_bytes(l.terrain);
        block[0] = (unsigned char *)malloc(bytes);
        block[1] = (unsigned char *)malloc(bytes);
        for (slice = 0; slice < check_rounds(14u, 60u) || done == most; slice++) {
            if (slice < 10u && random_range(0, 2)) {
                terrimp_rect rect;
                rect.x = random_range(0, sizes[i][0] - 1u);
                rect.y = random_range(0, sizes[i][1] - 1u);
                rect.width = random_range(1, 17);
                rect.height = random_range(1, 17);
                bake_change_samples(&l, &rect);
                CHECK(terrimp_terrain_edit(l.terrain, &rect) == TERRIMP_OK);
                CHECK(terrimp_bake_write(l.terrain, block[0], bytes, 0) == TERRIMP_E_STATE);
                terrimp_terrain_destroy(anew);
                CHECK(terrimp_terrain_create(&l.desc, NULL, &anew) == TERRIMP_OK);
            } else {
                most = random_range(1, 7);
                CHECK(terrimp_terrain_refine(l.terrain, nodes, most, &done, scratch,
                                             scratch_bytes) == TERRIMP_OK);
                CHECK(done <= most && (done < 2u || nodes[0] < nodes[done - 1u]));
            }
            if (anew)
                check_edit_bounds(&l, anew);
        }
        CHECK(terrimp_bake_write(l.terrain, block[0], bytes, 0) == TERRIMP_OK);
        CHECK(terrimp_bake_write(anew, block[1], bytes, 0) == TERRIMP_OK);
        CHECK(memcmp(block[0], block[1], bytes) == 0);
        free(block[0]);
        free(block[1]);
        free(scratch);
        terrimp_terrain_destroy(anew);
        land_free(&l);
    }
}

/* What cannot be rebuilt is refused, and the terrain stays as it was. */
static void bad_edits_change_nothing(void)
{
    baked_land b;
    if (bake_land(&b, 40, 30, TERRIMP_FORMAT_F32, LAND_HILLS, 8, 0)) {
        size_t scratch_bytes = terrimp_terrain_scratch_bytes(&b.l.desc);
        uint64_t *scratch = (uint64_t *)malloc(scratch_bytes + 1u);
        terrimp_rect rect = {7, 7, 1, 1}, bad;
        float *sample = b.l.samples + 7 * 40 + 7, old = *sample;
        unsigned char *block = (unsigned char *)malloc(b.bytes);
        terrimp_terrain *t = b.l.terrain;
        uint32_t count = 77;
        CHECK(baked_open(&b) == TERRIMP_OK);
        CHECK(terrimp_terrain_rebuild(b.opened, &rect, scratch, scratch_bytes) == TERRIMP_E_STATE);
        *sample = 10000.0f;
        CHECK(terrimp_terrain_rebuild(t, &rect, scratch, scratch_bytes) == TERRIMP_E_RANGE);
        *sample = -10000.0f;
        CHECK(terrimp_terrain_rebuild(t, &rect, scratch, scratch_bytes) == TERRIMP_E_RANGE);
        *sample = (float)NAN;
        CHECK(terrimp_terrain_rebuild(t, &rect, scratch, scratch_bytes) == TERRIMP_E_NOT_FINITE);
        *sample = old;
        CHECK(terrimp_terrain_edit(b.opened, &rect) == TERRIMP_E_STATE);
        CHECK(terrimp_terrain_edit(NULL, &rect) == TERRIMP_E_NULL);
        CHECK(terrimp_terrain_refine(b.opened, NULL, 1, &count, scratch, scratch_bytes) ==
              TERRIMP_E_STATE);
        CHECK(terrimp_terrain_refine(t, NULL, 1, NULL, scratch, scratch_bytes) == TERRIMP_E_NULL);
        CHECK(terrimp_terrain_refine(t, NULL, 1, &count, scratch, 8) == TERRIMP_E_MEMORY);
        CHECK(terrimp_terrain_rebuild(NULL, &rect, scratch, scratch_bytes) == TERRIMP_E_NULL);
        CHECK(terrimp_terrain_rebuild(t, NULL, scratch, scratch_bytes) == TERRIMP_E_NULL);
        CHECK(terrimp_terrain_rebuild(t, &rect, NULL, scratch_bytes) == TERRIMP_E_NULL);
        CHECK(terrimp_terrain_rebuild(t, &rect, scratch, scratch_bytes - 1u) == TERRIMP_E_MEMORY);
        CHECK(terrimp_terrain_rebuild(t, &rect, (char *)scratch + 1, scratch_bytes) ==
              TERRIMP_E_ALIGN);
        bad = rect;
        bad.x = 40;
        CHECK(terrimp_terrain_rebuild(t, &bad, scratch, scratch_bytes) == TERRIMP_E_RANGE);
        CHECK(terrimp_terrain_touched(t, &bad, 0, NULL, 0, &count) == TERRIMP_E_RANGE);
        bad = rect;
        bad.y = 0xffffffffu;
        CHECK(terrimp_terrain_rebuild(t, &bad, scratch, scratch_bytes) == TERRIMP_E_RANGE);
        bad = rect;
        bad.height = 0;
        CHECK(terrimp_terrain_rebuild(t, &bad, scratch, scratch_bytes) == TERRIMP_E_RANGE);
        CHECK(terrimp_terrain_touched(NULL, &rect, 0, NULL, 0, &count) == TERRIMP_E_NULL);
        CHECK(terrimp_terrain_touched(t, NULL, 0, NULL, 0, &count) == TERRIMP_E_NULL);
        CHECK(count == 77);
        CHECK(terrimp_terrain_touched(t, &rect, 0, NULL, 0, NULL) == TERRIMP_E_NULL);
        CHECK(terrimp_bake_write(t, block, b.bytes, 0) == TERRIMP_OK);
        CHECK(memcmp(block, b.block, b.bytes) == 0);
        free(block);
        free(scratch);
    }
    baked_free(&b);
}

/* Heights of any size: what is built can be baked and opened, and what cannot is refused. */
static void terrains_of_any_scale_are_refused_or_open(void)
{
    int i, built = 0, refused = 0;
    for (i = 0; i < 60; i++) {
        land l;
        terrimp_result result;
        land_prepare(&l, 9 + (uint32_t)i % 5u, 8, TERRIMP_FORMAT_U16, LAND_NOISE);
        l.desc.chunk_quads = 4;
        l.desc.triangle_budget = 32;
        l.desc.field.height_scale = random_magnitude(1e-10f, 1e27f);
        l.desc.field.height_offset = random_range(0, 1) ? random_magnitude(1e-3f, 1e34f) : 0.0f;
        result = terrimp_terrain_create(&l.desc, NULL, &l.terrain);
        CHECK(result == TERRIMP_OK || result == TERRIMP_E_RANGE);
        if (result == TERRIMP_OK) {
            size_t bytes = terrimp_bake_bytes(l.terrain);
            void *block = malloc(bytes);
            CHECK(terrimp_bake_write(l.terrain, block, bytes, 0) == TERRIMP_OK);
            CHECK(terrimp_bake_check(block, bytes, &l.desc.field, NULL) == TERRIMP_OK);
            free(block);
            built++;
        } else {
            refused++;
        }
        land_free(&l);
    }
    CHECK(built > 20 && refused > 5);
}

static inline void bake_tests(void)
{
    RUN(opened_bakes_are_the_terrain_that_was_baked);
    RUN(bakes_are_small);
    RUN(bakes_open_on_their_own_field_alone);
    RUN(bakes_are_written_for_the_other_byte_order);
    RUN(damaged_bakes_do_no_harm);
    RUN(every_false_number_of_a_bake_is_refused);
    RUN(surfaces_with_holes_are_refused);
    RUN(truncated_bakes_are_refused);
    RUN(bakes_may_have_company);
    RUN(terrains_of_any_scale_are_refused_or_open);
    RUN(rebuilt_terrains_equal_those_built_anew);
    RUN(edits_in_slices_end_as_what_is_built_anew);
    RUN(bad_edits_change_nothing);
}

/* What flies: of the program flights.c. */
static inline void bake_flights(void)
{
    RUN(views_of_opened_bakes_give_the_same_commands);
}

#endif
