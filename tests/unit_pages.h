/* Laws of terrain in pages: they say what a terrain in memory says, in whatever order they are made
   and come; and nothing that is damaged, late or another's is taken. */
#ifndef UNIT_PAGES_H
#define UNIT_PAGES_H

#include "unit_bad_input.h"

/* The terrain that views look at. -DPAGED_SIDE=4097u -DPAGED_CHUNK=64u takes a minute. */
#ifndef PAGED_SIDE
#define PAGED_SIDE 513u
#define PAGED_CHUNK 16u
#endif
#define PAGED_CHUNKS (((PAGED_SIDE - 1u) / PAGED_CHUNK) * ((PAGED_SIDE - 1u) / PAGED_CHUNK))
#define PAGED_ALL (PAGED_CHUNKS / 3u * 4u + 100u) /* nodes of it, or more */

/* A land, its pages as a file in memory, and the terrain that is opened from them. */
typedef struct paged_land {
    land l; /* its terrain in memory is built (land_build) where pages are compared with it */
    terrimp_pages_desc desc;
    terrimp_pages_info info;
    uint32_t block_count;
    unsigned char *file;
    size_t bytes;
    uint64_t from, to;     /* what stores may touch */
    uint32_t stores, last; /* stores so far; the last one that is carried out */
    void *scratch;
    size_t scratch_bytes;
    void *memory;
    terrimp_terrain *opened;
} paged_land;

static int paged_read(void *user, uint32_t x, uint32_t z, uint32_t cols, uint32_t rows,
                      void *samples, size_t row_bytes)
{
    const terrimp_heightfield *f = &((const paged_land *)user)->l.desc.field;
    size_t size = f->format == TERRIMP_FORMAT_U8 ? 1u : f->format == TERRIMP_FORMAT_F32 ? 4u : 2u;
    uint32_t r;
    if (x + cols > f->width || z + rows > f->depth) {
        CHECK(!"a block reads beyond the terrain");
        return 0;
    }
    for (r = 0; r < rows; r++)
        memcpy((char *)samples + r * row_bytes,
               (const char *)f->samples + ((size_t)(z + r) * f->width + x) * size, cols * size);
    return 1;
}

static int paged_load(void *user, uint64_t offset, void *bytes, size_t count)
{
    const paged_land *p = (const paged_land *)user;
    if (offset + count > p->bytes)
        return 0;
    memcpy(bytes, p->file + offset, count);
    return 1;
}

static int paged_store(void *user, uint64_t offset, const void *bytes, size_t count)
{
    paged_land *p = (paged_land *)user;
    CHECK(offset >= p->from && offset + count <= p->to);
    if (offset + count > p->bytes || p->stores++ >= p->last)
        return 0;
    memcpy(p->file + offset, bytes, count);
    return 1;
}

/* Builds a block; what it stores has to lie in its part of the file. */
static terrimp_result paged_build_block(paged_land *p, uint32_t block)
{
    uint64_t bytes;
    CHECK(terrimp_pages_place(&p->desc, block, 1, &p->from, &bytes) == TERRIMP_OK);
    p->to = p->from + bytes;
    p->stores = 0;
    return terrimp_pages_build_block(&p->desc, block, p->scratch, p->scratch_bytes);
}

static terrimp_result paged_build_end(paged_land *p)
{
    uint64_t bytes;
    p->from = 0;
    CHECK(terrimp_pages_place(&p->desc, 0, 0, &p->to, &bytes) == TERRIMP_OK && bytes == 0);
    p->stores = 0;
    return terrimp_pages_build_end(&p->desc, p->scratch, p->scratch_bytes);
}

/* A land's samples, and room for its pages. */
static void paged_prepare(paged_land *p, uint32_t width, uint32_t depth, int format,
                         land_shape shape, uint32_t chunk_quads, uint32_t block_level)
{
    terrimp_pages_desc resolved;
    uint64_t from, bytes;
    memset(p, 0, sizeof *p);
    land_prepare(&p->l, width, depth, format, shape);
    p->l.desc.chunk_quads = chunk_quads;
    p->l.desc.triangle_budget = 40; /* smaller ones still: many nodes are built twice */
    p->l.desc.height_low = -126.0f;
    p->l.desc.height_high = 257.0f;
    p->last = UINT32_MAX;
    p->desc.terrain = p->l.desc;
    p->desc.terrain.field.samples = NULL;
    p->desc.block_level = block_level;
    p->desc.stamp = 7;
    p->desc.user = p;
    p->desc.read = paged_read;
    p->desc.load = paged_load;
    p->desc.store = paged_store;
    CHECK(terrimp_pages_desc_resolve(&p->desc, &resolved, &p->block_count) == TERRIMP_OK);
    CHECK(terrimp_pages_place(&p->desc, 0, p->block_count, &from, &bytes) == TERRIMP_OK);
    p->bytes = (size_t)(from + bytes);
    p->file = (unsigned char *)calloc(1, p->bytes);
    p->scratch_bytes = terrimp_pages_scratch_bytes(&p->desc);
    CHECK(p->scratch_bytes > 0);
    p->scratch = malloc(p->scratch_bytes);
}

static int paged_build(paged_land *p)
{
    uint32_t block;
    for (block = 0; block < p->block_count; block++)
        CHECK(paged_build_block(p, block) == TERRIMP_OK);
    CHECK(paged_build_end(p) == TERRIMP_OK);
    CHECK(terrimp_pages_check(p->file, p->bytes, &p->info) == TERRIMP_OK);
    CHECK(p->info.bytes == p->bytes);
    CHECK(!p->l.terrain || p->info.node_count == p->l.info.node_count);
    p->l.info.node_count = p->info.node_count;
    return check_bad == 0;
}

static int paged_open(paged_land *p, uint32_t slots)
{
    size_t bytes = terrimp_pages_bytes(p->file, p->bytes, slots);
    p->memory = malloc(bytes);
    CHECK(bytes > 0 && terrimp_pages_open(&p->l.desc.field, p->file, p->bytes, slots, p->memory,
                                          bytes, &p->opened) == TERRIMP_OK);
    return check_bad == 0;
}

/* Reads a page as a host would. */
static terrimp_result paged_fetch(paged_land *p, uint32_t node)
{
    terrimp_page_info info;
    void *page;
    terrimp_result result = terrimp_page_begin(p->opened, node, &page);
    if (result != TERRIMP_OK)
        return result;
    CHECK(terrimp_page_get_info(p->opened, node, &info) == TERRIMP_OK);
    CHECK(info.state == TERRIMP_PAGE_COMING && info.offset + info.bytes <= p->bytes);
    memcpy(page, p->file + info.offset, info.bytes);
    return terrimp_page_put(p->opened, node);
}

static int paged_state(const paged_land *p, uint32_t node)
{
    terrimp_page_info info;
    CHECK(terrimp_page_get_info(p->opened, node, &info) == TERRIMP_OK);
    return info.state;
}

static int paged_is_here(const paged_land *p, uint32_t node)
{
    return paged_state(p, node) == TERRIMP_PAGE_HERE;
}

/* The parent of a node; of the root, the root. */
static uint32_t paged_above(const paged_land *p, uint32_t node)
{
    const terrimp_quadtree *tree = &p->opened->tree;
    return node + 1u < tree->node_count ? terrimpi_tree_parent_number(tree, node) : node;
}

/* Gives a page; one that comes before its parent's has to wait. Returns whether it was taken. */
static int paged_put(paged_land *p, uint32_t node)
{
    int waits = paged_above(p, node) != node && !paged_is_here(p, paged_above(p, node));
    CHECK(terrimp_page_put(p->opened, node) == (waits ? TERRIMP_E_PAGE : TERRIMP_OK));
    return !waits;
}

static void paged_free(paged_land *p)
{
    land_free(&p->l);
    free(p->file);
    free(p->scratch);
    free(p->memory);
}

/* All pages, from the root down. */
static void paged_fetch_all(paged_land *p)
{
    uint32_t node = p->l.info.node_count;
    while (node-- > 0)
        CHECK(paged_fetch(p, node) == TERRIMP_OK);
}

/* Ground, boxes, meshes and the floor of pages against those of memory: the same bits up to a
   level; above it ground is the same, and no error smaller. */
static void check_pages_say_the_same(const paged_land *p, uint32_t same_to)
{
    const land *l = &p->l;
    uint32_t node, vertices = l->info.ground_vertex_count, stride = l->info.mesh_vertex_stride;
    float *xyz[2];
    uint16_t *indices[2];
    terrimp_terrain_info info;
    int i;
    CHECK(terrimp_terrain_get_info(p->opened, &info) == TERRIMP_OK);
    CHECK(info.floor_vertex_count == terrimpi_floor_of(l->terrain).skirt_vertex); /* no skirts */
    CHECK(info.floor_index_count == terrimpi_floor_of(l->terrain).skirt_index);
    for (i = 0; i < 2; i++) {
        size_t most = vertices + stride + l->info.floor_vertex_count;
        xyz[i] = (float *)malloc(most * 3u * sizeof(float));
        indices[i] = (uint16_t *)malloc((l->info.floor_index_count + info.mesh_index_stride) *
                                        sizeof(uint16_t));
    }
    for (node = 0; node < l->info.node_count; node++) {
        const terrimp_terrain *terrain[2];
        terrimp_mesh_info mesh[2];
        terrimp_box box[2], ground_box[2];
        uint32_t level = land_place(l, node).level;
        terrain[0] = l->terrain;
        terrain[1] = p->opened;
        for (i = 0; i < 2; i++) {
            const terrimp_quadtree *tree = terrimp_terrain_tree(terrain[i]);
            CHECK(terrimp_terrain_get_box(terrain[i], node, &box[i]) == TERRIMP_OK);
            CHECK(terrimp_geomip_box(tree, node, &ground_box[i]) == TERRIMP_OK);
            CHECK(terrimp_terrain_get_mesh(terrain[i], node, &mesh[i]) == TERRIMP_OK);
            CHECK(terrimp_terrain_fill_ground(terrain[i], node, xyz[i], vertices * 3u) ==
                  TERRIMP_OK);
        }
        CHECK(memcmp(xyz[0], xyz[1], vertices * 3u * sizeof(float)) == 0);
        if (level > same_to) {
            const terrimp_geomip_node *kept[2];
            for (i = 0; i < 2; i++)
                kept[i] = terrimpi_tree_kept(terrimp_terrain_tree(terrain[i]), node);
            CHECK(kept[1]->error >= kept[0]->error * 0.99999f);
            CHECK(mesh[1].error > 0.0f || mesh[0].error == 0.0f);
            continue;
        }
        CHECK(memcmp(&ground_box[0], &ground_box[1], sizeof box[0]) == 0);
        CHECK(memcmp(&box[0], &box[1], sizeof box[0]) == 0);
        CHECK(mesh[0].error == mesh[1].error && mesh[0].error_rms == mesh[1].error_rms);
        CHECK(mesh[0].vertex_count == mesh[1].vertex_count);
        CHECK(mesh[0].index_count == mesh[1].index_count);
        for (i = 0; i < 2; i++)
            CHECK(terrimp_terrain_fill_mesh(terrain[i], node, xyz[i], stride * 3u, indices[i],
                                            info.mesh_index_stride) == TERRIMP_OK);
        CHECK(memcmp(xyz[0], xyz[1], stride * 3u * sizeof(float)) == 0);
        CHECK(memcmp(indices[0], indices[1], info.mesh_index_stride * sizeof(uint16_t)) == 0);
    }
    for (i = 0; i < 2; i++)
        CHECK(terrimp_terrain_fill_mesh(i ? p->opened : l->terrain, l->info.node_count, xyz[i],
                                        l->info.floor_vertex_count * 3u, indices[i],
                                        l->info.floor_index_count) == TERRIMP_OK);
    CHECK(memcmp(indices[0], indices[1], info.floor_index_count * sizeof(uint16_t)) == 0);
    for (node = 0; node < info.floor_vertex_count; node++) /* bottoms of walls: the root's lowest */
        CHECK(same_to < UINT32_MAX || xyz[0][3u * node + 1u] == xyz[1][3u * node + 1u]);
    for (i = 0; i < 2; i++) {
        free(xyz[i]);
        free(indices[i]);
    }
}

static void pages_say_what_memory_does(void)
{
    static const int formats[] = {TERRIMP_FORMAT_U8, TERRIMP_FORMAT_U16, TERRIMP_FORMAT_S16,
                                  TERRIMP_FORMAT_F32};
    uint32_t turn;
    for (turn = 0; turn < 12u; turn++) {
        paged_land p;
        uint32_t width = random_range(2, 130), depth = random_range(2, 90);
        uint32_t block_level = turn % 3u, chunk = turn % 2u ? 16u : 8u;
        if (turn % 4u == 1u)
            width = depth = 129u;
        if (turn == 7u) /* above the blocks the last column and row are closer: triangles turn */
            width = 111u, depth = 20u;
        paged_prepare(&p, width, depth, formats[turn % 4u], turn % 5u ? LAND_HILLS : LAND_NOISE,
                      chunk, block_level);
        if (land_build(&p.l) && paged_build(&p)) {
            if (paged_open(&p, p.l.info.node_count + 8u)) {
                paged_fetch_all(&p);
                check_pages_say_the_same(&p, block_level ? block_level : UINT32_MAX);
            }
        }
        paged_free(&p);
    }
}

/* Makes ground even between the samples of a level. */
static void paged_smooth(land *l, const terrimp_quadtree *tree, uint32_t level)
{
    terrimpi_mip_ground ground = terrimpi_mip_ground_of(tree);
    uint32_t x, z;
    for (z = 0; z < l->desc.field.depth; z++)
        for (x = 0; x < l->desc.field.width; x++)
            l->samples[z * l->desc.field.width + x] = terrimpi_mip_height(&ground, level, x, z);
}

/* Errors above the blocks hold for each sample, as drawn up to borders too: ground that is even
   between the samples that these levels are made of leaves them what memory finds; quads that are
   cut off at the far edge, a peak beside a border and one of a sample alone, no less. */
static void pages_above_blocks_miss_no_sample(void)
{
    uint32_t turn, node;
    for (turn = 0; turn < 12u && check_bad == 0; turn++) {
        paged_land p;
        terrimp_quadtree tree;
        int cut = turn < 4u && turn / 2u % 2u;
        uint32_t level = turn < 4u ? 1u + turn % 2u : 1u, side = 65u - (cut ? 1u << level : 0u);
        uint32_t along = 2u + 4u * random_range(0, 11), beside = turn / 2u % 2u ? 30u : 34u;
        paged_prepare(&p, side, side, TERRIMP_FORMAT_F32, LAND_NOISE, 8, level);
        CHECK(terrimp_quadtree_init(&p.l.desc.field, 8, &tree) == TERRIMP_OK);
        if (turn >= 4u)
            memset(p.l.samples, 0, side * side * sizeof(float));
        if (turn >= 8u)
            along++, beside++;
        if (turn >= 4u) /* or the same, rows for columns */
            p.l.samples[turn % 2u ? along * side + beside : beside * side + along] = 250.0f;
        if (cut)
            paged_smooth(&p.l, &tree, level + 1u);
        if (turn < 8u)
            paged_smooth(&p.l, &tree, level);
        if (land_build(&p.l) && paged_build(&p) && paged_open(&p, p.info.node_count + 8u)) {
            paged_fetch_all(&p);
            for (node = tree.level_first[level + 1u]; node < tree.node_count; node++) {
                float own = terrimpi_tree_kept(&p.opened->tree, node)->error;
                float memory = terrimpi_tree_kept(&p.l.terrain->tree, node)->error;
                CHECK(own >= memory * 0.9999f);
                CHECK(own <= memory * 1.0001f || cut || turn >= 8u);
            }
        }
        paged_free(&p);
    }
}

/* Blocks in any order, some twice, some stopped halfway, each in its own part of the file: the same
   bytes. What has not been built is told from what has. */
static void pages_are_built_in_any_order(void)
{
    uint32_t turn;
    for (turn = 0; turn < 4u; turn++) {
        paged_land p;
        unsigned char *file;
        uint32_t i, block, left;
        paged_prepare(&p, 8u * random_range(5, 14), random_range(35, 100), TERRIMP_FORMAT_S16,
                      LAND_HILLS, 8, 2);
        if (!paged_build(&p)) {
            paged_free(&p);
            continue;
        }
        file = p.file;
        p.file = (unsigned char *)calloc(1, p.bytes);
        memset(p.scratch, 0x5a, p.scratch_bytes);
        for (left = p.block_count; left > 0;) {
            block = random_range(0, p.block_count - 1u);
            i = terrimp_pages_check_block(&p.desc, block, p.scratch, p.scratch_bytes) == TERRIMP_OK;
            if (i && random_range(0, 3))
                continue;
            p.last = random_range(0, 1) ? UINT32_MAX : random_range(0, 20);
            CHECK(paged_build_block(&p, block) ==
                  (p.stores > p.last ? TERRIMP_E_PAGE : TERRIMP_OK));
            left -= !i && p.stores <= p.last;
        }
        p.last = UINT32_MAX;
        CHECK(terrimp_pages_check(p.file, p.bytes, NULL) == TERRIMP_E_BAKE); /* no header yet */
        CHECK(paged_build_end(&p) == TERRIMP_OK);
        CHECK(memcmp(file, p.file, p.bytes) == 0);
        p.file[p.from + p.bytes / 2u] ^= 1u;
        free(file);
        paged_free(&p);
    }
}

/* After an edit: blocks that reach to it are built anew, others are as they were; pages that it
   reaches are read anew, no others, and those that do not fit when the host tells of another place;
   old ones are refused, and what there is says what memory does. */
static void pages_are_edited(void)
{
    uint32_t turn;
    for (turn = 0; turn < 3u; turn++) {
        paged_land p;
        unsigned char header[TERRIMP_PAGES_HEADER_BYTES], *old;
        size_t scratch_bytes;
        void *scratch;
        uint16_t *samples;
        uint32_t i, x, z, width = 8u * random_range(10, 15), depth = random_range(70, 110), block;
        uint32_t root, rebuilt = 0, touched = 0, same = 0, kept = 0;
        terrimp_rect edit, elsewhere = {0, 0, 1, 1};
        terrimp_page_info info;
        void *page;
        paged_prepare(&p, width, depth, TERRIMP_FORMAT_U16, LAND_HILLS, 8, 2);
        if (!land_build(&p.l) || !paged_build(&p) || !paged_open(&p, p.l.info.node_count + 8u))
            return;
        paged_fetch_all(&p);
        old = (unsigned char *)malloc(p.bytes);
        memcpy(old, p.file, p.bytes);
        edit.x = random_range(0, width - 9u), edit.y = random_range(0, depth - 9u);
        edit.width = edit.height = 8u;
        samples = (uint16_t *)(void *)(uintptr_t)p.l.desc.field.samples;
        for (z = edit.y; z < edit.y + 8u; z++)
            for (x = edit.x; x < edit.x + 8u; x++)
                samples[z * width + x] = (uint16_t)(samples[z * width + x] / 2u);
        for (block = 0; block < p.block_count; block++) { /* of 32 x 32 quads, and some more */
            uint32_t across = (width - 2u) / 32u + 1u;
            x = block % across * 32u, z = block / across * 32u;
            if (edit.x + 8u + 8u < x || edit.x > x + 32u + 8u || edit.y + 8u + 8u < z ||
                edit.y > z + 32u + 8u)
                continue;
            CHECK(paged_build_block(&p, block) == TERRIMP_OK);
            rebuilt++;
        }
        CHECK(rebuilt > 0 && rebuilt < p.block_count && paged_build_end(&p) == TERRIMP_OK);
        scratch_bytes = terrimp_terrain_scratch_bytes(&p.l.desc);
        scratch = malloc(scratch_bytes);
        CHECK(terrimp_terrain_rebuild(p.l.terrain, &edit, scratch, scratch_bytes) ==
              TERRIMP_OK);
        memcpy(header, p.file, sizeof header);
        header[100] ^= 1u;
        CHECK(terrimp_pages_renew(p.opened, header, sizeof header, &edit) == TERRIMP_E_BAKE);
        root = p.l.info.node_count - 1u;
        CHECK(terrimp_terrain_touched(p.opened, &edit, 0, NULL, 0, &touched) == TERRIMP_OK);
        for (i = 0; i <= root; i++) { /* pages that the edit does not reach are the same */
            CHECK(terrimp_page_get_info(p.opened, i, &info) == TERRIMP_OK);
            same += memcmp(old + info.offset, p.file + info.offset, info.bytes) == 0;
        }
        CHECK(same + touched > root);
        CHECK(terrimp_pages_renew(p.opened, p.file, p.bytes, turn == 0   ? NULL
                                                             : turn == 1u ? &edit
                                                                          : &elsewhere) ==
              TERRIMP_OK);
        for (i = 0; i <= root; i++)
            kept += (uint32_t)paged_is_here(&p, i);
        CHECK(kept == (turn ? root + 1u - touched : 0u) || turn == 2u);
        CHECK(touched * 3u < root);
        CHECK(!paged_is_here(&p, root));
        CHECK(terrimp_page_begin(p.opened, root, &page) == TERRIMP_OK);
        CHECK(terrimp_pages_renew(p.opened, p.file, p.bytes, &edit) == TERRIMP_E_STATE);
        CHECK(terrimp_page_get_info(p.opened, root, &info) == TERRIMP_OK);
        memcpy(page, old + info.offset, info.bytes);
        CHECK(terrimp_page_put(p.opened, root) ==
              (memcmp(page, p.file + info.offset, info.bytes) ? TERRIMP_E_BAKE : TERRIMP_OK));
        for (i = root + 1u; i-- > 0;)
            CHECK(paged_is_here(&p, i) || paged_fetch(&p, i) == TERRIMP_OK);
        check_pages_say_the_same(&p, 2);
        free(scratch);
        free(old);
        paged_free(&p);
    }
}

/* Everything that can be wrong with a page that comes, or with when it comes. */
static void pages_that_are_no_good_are_refused(void)
{
    paged_land p, other;
    uint32_t turn, node, root, child, count;
    void *page;
    terrimp_page_info info;
    paged_prepare(&p, 90, 70, TERRIMP_FORMAT_U16, LAND_HILLS, 8, 2);
    if (!paged_build(&p) || !paged_open(&p, 40))
        return;
    paged_prepare(&other, 90, 70, TERRIMP_FORMAT_U16, LAND_NOISE, 8, 2);
    other.desc.stamp = 8;
    paged_build(&other);
    root = p.l.info.node_count - 1u;
    node = root - 1u;
    CHECK(terrimp_page_begin(p.opened, node, &page) == TERRIMP_E_STATE); /* before its parent */
    CHECK(terrimp_page_put(p.opened, root) == TERRIMP_E_STATE);          /* not begun */
    CHECK(terrimp_page_fail(p.opened, root) == TERRIMP_E_STATE);
    CHECK(terrimp_page_begin(p.opened, root + 1u, &page) == TERRIMP_E_RANGE);
    CHECK(paged_fetch(&p, root) == TERRIMP_OK);
    CHECK(paged_fetch(&p, root) == TERRIMP_E_STATE);            /* twice */
    CHECK(terrimp_page_put(p.opened, root) == TERRIMP_E_STATE); /* the same */
    for (turn = 0; turn < 400u; turn++) {
        int fault = (int)(turn % 5u);
        CHECK(terrimp_page_begin(p.opened, node, &page) == TERRIMP_OK);
        CHECK(terrimp_page_get_info(p.opened, node, &info) == TERRIMP_OK);
        memcpy(page, p.file + info.offset, info.bytes);
        if (fault == 0) /* a bit turned */
            ((unsigned char *)page)[random_range(0, info.bytes - 1u)] ^=
                (unsigned char)(1u << random_range(0, 7));
        else if (fault == 1) /* cut short */
            memset((unsigned char *)page + random_range(0, info.bytes - 300u), 0, 300);
        else if (fault == 2) /* of another node */
            memcpy(page, p.file + info.offset - info.bytes, info.bytes);
        else if (fault == 3) /* of another file */
            memcpy(page, other.file + info.offset, info.bytes);
        else /* of other heights, with the right stamp and a checksum */
            ((uint32_t *)page)[1] = p.info.stamp;
        if (fault == 4) {
            uint32_t at, hash = 2166136261u, *words = (uint32_t *)page;
            words[random_range(3, info.bytes / 4u - 1u)] = turn % 2u ? 0x7fc00000u : random_bits();
            for (at = 1; at < info.bytes / 4u; at++)
                hash = terrimpi_bake_hash_word(hash, words[at]);
            words[0] = hash;
        }
        if (terrimp_page_put(p.opened, node) != TERRIMP_E_BAKE) {
            /* what a page says that nothing else can tell is false, or a byte that stands for
               nothing: it must be good to use */
            CHECK(fault == 4 || (fault == 1 && paged_is_here(&p, node)));
            CHECK(paged_is_here(&p, node));
            terrimp_pages_next_frame(p.opened);
            terrimp_pages_next_frame(p.opened);
            terrimp_pages_next_frame(p.opened);
            terrimpi_page_clear(&p.opened->tree, terrimpi_page_slot_of(p.opened->tree.pages, node));
        } else {
            CHECK(!paged_is_here(&p, node));
        }
    }
    CHECK(terrimp_page_begin(p.opened, node, &page) == TERRIMP_OK);
    CHECK(terrimp_page_fail(p.opened, node) == TERRIMP_OK);
    CHECK(terrimp_page_put(p.opened, node) == TERRIMP_E_STATE); /* late */
    child = p.opened->tree.level_first[p.opened->tree.level_count - 2u] - 1u;
    node = terrimpi_tree_parent_number(&p.opened->tree, child);
    CHECK(terrimp_page_begin(p.opened, node, &page) == TERRIMP_OK);
    memset(page, 0, p.info.page_bytes);
    CHECK(paged_fetch(&p, child) == TERRIMP_E_PAGE); /* before its parent's: it waits, */
    CHECK(paged_state(&p, child) == TERRIMP_PAGE_COMING);
    CHECK(terrimp_pages_withdrawn(p.opened, &turn, 1, &count) == TERRIMP_OK && count == 0);
    CHECK(terrimp_page_put(p.opened, node) == TERRIMP_E_BAKE);
    CHECK(terrimp_pages_withdrawn(p.opened, &turn, 1, &count) == TERRIMP_OK && count == 1u);
    CHECK(turn == child && terrimp_page_put(p.opened, child) == TERRIMP_E_PAGE);
    CHECK(paged_fetch(&p, node) == TERRIMP_OK); /* ... and is taken after it */
    CHECK(terrimp_pages_withdrawn(p.opened, &turn, 1, &count) == TERRIMP_OK && count == 0);
    CHECK(terrimp_page_put(p.opened, child) == TERRIMP_OK);
    for (turn = 0; turn < 200u; turn++) { /* headers */
        unsigned char header[TERRIMP_PAGES_HEADER_BYTES];
        memcpy(header, p.file, sizeof header);
        header[random_range(0, sizeof header - 1u)] ^= (unsigned char)(1u << random_range(0, 7));
        CHECK(terrimp_pages_check(header, sizeof header, NULL) == TERRIMP_E_BAKE);
    }
    CHECK(terrimp_pages_check(p.file, TERRIMP_PAGES_HEADER_BYTES - 1u, NULL) == TERRIMP_E_BAKE);
    paged_free(&p);
    paged_free(&other);
}

/* What was known of a node before a call: where its page stood, and when it was last asked for. */
typedef struct paged_past {
    int state;
    uint32_t used;
} paged_past;

static void remember_pages(const paged_land *p, paged_past *past)
{
    uint32_t node;
    for (node = 0; node < p->l.info.node_count; node++) {
        terrimp_page_info info;
        CHECK(terrimp_page_get_info(p->opened, node, &info) == TERRIMP_OK);
        past[node].state = info.state;
    }
}

/* Whether a page could be given up for that of another node: it is here, no page is below it, it is
   neither the root's nor of the other's parent, and it has rested for a whole frame. */
static int may_be_given_up(const paged_land *p, const paged_past *past, uint32_t frame,
                           uint32_t node, uint32_t other)
{
    const terrimp_quadtree *tree = &p->opened->tree;
    uint32_t below, root = tree->node_count - 1u;
    if (past[node].state != TERRIMP_PAGE_HERE || node == root || past[node].used + 1u >= frame ||
        (other != root && terrimpi_tree_parent_number(tree, other) == node))
        return 0;
    for (below = 0; below < node; below++)
        if (past[below].state != TERRIMP_PAGE_ABSENT &&
            terrimpi_tree_parent_number(tree, below) == node)
            return 0;
    return 1;
}

/* After a call for a node: one page is given up at most, only for one that was begun, only when no
   slot is free, and of those that may be, one that has rested for longest. All slots are in use
   only when none may be. Returns how many were given up. */
static uint32_t check_given_up(const paged_land *p, paged_past *past, uint32_t slots,
                               uint32_t frame, uint32_t asked, terrimp_result result)
{
    uint32_t node, longest = UINT32_MAX, full = 0, gone = 0, was = 0;
    terrimp_page_info info;
    int begun;
    for (node = 0; node < p->l.info.node_count; node++) {
        full += past[node].state != TERRIMP_PAGE_ABSENT;
        if (past[node].used < longest && may_be_given_up(p, past, frame, node, asked))
            longest = past[node].used;
        CHECK(terrimp_page_get_info(p->opened, node, &info) == TERRIMP_OK);
        if (node != asked && past[node].state != info.state) {
            CHECK(info.state == TERRIMP_PAGE_ABSENT);
            was = node;
            gone++;
        }
    }
    CHECK(terrimp_page_get_info(p->opened, asked, &info) == TERRIMP_OK);
    begun = past[asked].state == TERRIMP_PAGE_ABSENT && info.state != TERRIMP_PAGE_ABSENT;
    CHECK(gone == (begun && full == slots ? 1u : 0u));
    if (gone > 0)
        CHECK(may_be_given_up(p, past, frame, was, asked) && past[was].used == longest);
    if (result == TERRIMP_E_CAPACITY)
        CHECK(full == slots && longest == UINT32_MAX);
    if (begun)
        past[asked].used = frame;
    return gone;
}

/* Slots: the parent of what is here is here, a frame's pages stay, and there are never more. */
static void pages_are_closed_upwards(void)
{
    paged_land p;
    uint32_t turn, node, count, state[4] = {0, 0, 0, 0}, coming[64], full = 0, frame = 0, given = 0;
    paged_past *past;
    void *page;
    paged_prepare(&p, 120, 80, TERRIMP_FORMAT_S16, LAND_HILLS, 8, 0);
    if (!paged_build(&p) || !paged_open(&p, 24))
        return;
    past = (paged_past *)calloc(p.l.info.node_count, sizeof *past);
    for (turn = 0; turn < 3000u; turn++) {
        terrimp_result result;
        uint32_t asked;
        node = random_range(0, p.l.info.node_count - 1u);
        node = p.l.info.node_count - 1u - random_range(0, node);
        asked = node;
        switch (turn % (turn < 2000u ? 10u : 400u) ? random_range(0, 2) : 3u) {
        case 0: result = paged_fetch(&p, node); break;
        case 1: result = terrimp_page_begin(p.opened, node, &page); break;
        case 2: result = terrimp_page_fail(p.opened, node); break;
        default: result = terrimp_pages_next_frame(p.opened); break;
        }
        CHECK(result == TERRIMP_OK || result == TERRIMP_E_STATE || result == TERRIMP_E_CAPACITY ||
              result == TERRIMP_E_PAGE);
        full += result == TERRIMP_E_CAPACITY;
        frame += turn % (turn < 2000u ? 10u : 400u) == 0;
        given += check_given_up(&p, past, 24, frame, asked, result);
        CHECK(terrimp_pages_withdrawn(p.opened, coming, 64, &count) == TERRIMP_OK);
        while (count > 0 && turn % 16u == 0)
            CHECK(terrimp_page_fail(p.opened, coming[--count]) == TERRIMP_OK);
        remember_pages(&p, past);
        memset(state, 0, sizeof state);
        for (node = 0; node < p.l.info.node_count; node++) {
            terrimp_page_info info;
            state[past[node].state]++;
            if (past[node].state == TERRIMP_PAGE_ABSENT || node + 1u == p.l.info.node_count)
                continue;
            CHECK(past[node].state == TERRIMP_PAGE_COMING ||
                  past[terrimpi_tree_parent_number(&p.opened->tree, node)].state ==
                      TERRIMP_PAGE_HERE);
            CHECK(terrimp_page_get_info(p.opened, node, &info) == TERRIMP_OK && info.slot < 24u);
        }
        CHECK(state[TERRIMP_PAGE_HERE] + state[TERRIMP_PAGE_COMING] <= 24u);
    }
    CHECK(full > 0 && given > 10u);
    free(past);
    free(p.memory);
    paged_open(&p, 9); /* what is coming stays, however long nobody has asked for it */
    CHECK(paged_fetch(&p, node = p.l.info.node_count - 1u) == TERRIMP_OK);
    for (count = 0; count < 4u; count++)
        CHECK(paged_fetch(&p, --node) == TERRIMP_OK);
    for (; count < 8u; count++) /* a row, below two of the four */
        CHECK(terrimp_page_begin(p.opened, --node, &page) == TERRIMP_OK);
    for (turn = 0; turn < 4u; turn++)
        terrimp_pages_next_frame(p.opened);
    CHECK(terrimp_pages_withdrawn(p.opened, coming, 64, &count) == TERRIMP_OK && count == 4u);
    CHECK(terrimp_page_begin(p.opened, node - 1u, &page) == TERRIMP_OK); /* for the fourth */
    CHECK(terrimp_page_begin(p.opened, node - 2u, &page) == TERRIMP_E_CAPACITY);
    paged_free(&p);
}

/* Heights, normals and rays: exact where the finest page is here; else "not here", or of the finest
   that is. */
static void pages_answer_heights_and_rays(void)
{
    paged_land p;
    uint32_t turn, level;
    paged_prepare(&p, 201, 161, TERRIMP_FORMAT_U16, LAND_HILLS, 8, 0);
    if (!paged_build(&p) || !paged_open(&p, 2000))
        return;
    for (turn = 0; turn < 4000u; turn++) {
        float x = random_float(0.0f, 200.0f), z = random_float(0.0f, 160.0f), h, exact;
        float origin[3], way[3], n[3], m[3];
        terrimp_ray_hit hit, truth;
        terrimp_result result, true_result;
        if (turn % 3u == 0 && turn < 3000u)
            paged_fetch(&p, random_range(0, p.l.info.node_count - 1u));
        if (turn == 3000u) {
            for (level = p.l.info.node_count; level-- > 0;)
                paged_fetch(&p, level);
        }
        CHECK(terrimp_heightfield_height(&p.l.desc.field, x, z, &exact) == TERRIMP_OK);
        result = terrimp_terrain_height(p.opened, x, z, &h, n, &level);
        CHECK(result == (paged_is_here(&p, p.l.info.node_count - 1u) ? TERRIMP_OK
                                                                     : TERRIMP_E_PAGE));
        if (result == TERRIMP_OK && level == 0) {
            CHECK(fabsf(h - exact) < 1e-3f);
            terrimp_heightfield_normal(&p.l.desc.field, x, z, m);
            CHECK(fabsf(n[1] - m[1]) < 2e-3f);
        } else if (result == TERRIMP_OK) {
            CHECK(turn < 3000u);
            CHECK(terrimp_terrain_height(p.opened, x, z, &h, NULL, NULL) == TERRIMP_E_PAGE);
        }
        origin[0] = random_float(-50.0f, 250.0f);
        origin[1] = random_float(100.0f, 400.0f);
        origin[2] = random_float(-50.0f, 210.0f);
        way[0] = x - origin[0], way[1] = exact - origin[1], way[2] = z - origin[2];
        result = terrimp_terrain_raycast(p.opened, origin, way, 1e6f, &hit, &level);
        if (result == TERRIMP_E_PAGE)
            continue;
        true_result = terrimp_heightfield_raycast(&p.l.desc.field, origin, way, 1e6f, &truth);
        if (turn >= 3000u) {
            CHECK(result == true_result && level == 0);
            if (result == TERRIMP_OK) {
                CHECK(fabsf(hit.distance - truth.distance) < 1e-3f * truth.distance);
                CHECK(hit.x + 1u >= truth.x && hit.x <= truth.x + 1u);
            }
        } else if (result == TERRIMP_OK && true_result == TERRIMP_OK && level == 0) {
            CHECK(fabsf(hit.distance - truth.distance) < 1e-3f * truth.distance);
        } else if (level == 0) {
            CHECK(result == true_result);
        }
    }
    paged_free(&p);
}

/* What needs a page that is not here says so; what needs all samples at once does too. */
static void bad_pages(void)
{
    paged_land p;
    terrimp_box box;
    terrimp_mesh_info mesh;
    terrimp_rect all = {0, 0, 20, 20};
    terrimp_terrain *terrain;
    terrimp_pages_info info;
    float xyz[3 * 81];
    uint16_t index;
    uint32_t level;
    size_t bytes;
    paged_prepare(&p, 60, 50, TERRIMP_FORMAT_U8, LAND_HILLS, 8, 0);
    if (!land_build(&p.l) || !paged_build(&p) || !paged_open(&p, 8))
        return;
    bytes = terrimp_pages_bytes(p.file, p.bytes, 8);
    REFUSES(TERRIMP_E_PAGE, box, terrimp_terrain_get_box(p.opened, 0, &box));
    REFUSES(TERRIMP_E_PAGE, mesh, terrimp_terrain_get_mesh(p.opened, 0, &mesh));
    REFUSES(TERRIMP_E_PAGE, xyz, terrimp_terrain_fill_ground(p.opened, 0, xyz, 3 * 81));
    REFUSES(TERRIMP_E_PAGE, xyz, terrimp_terrain_fill_mesh(p.opened, 0, xyz, 243, &index, 1));
    REFUSES(TERRIMP_E_PAGE, xyz, terrimp_terrain_fill_meshes(p.opened, xyz, 243, &index, 1));
    REFUSES(TERRIMP_E_PAGE, xyz[0],
            terrimp_terrain_height(p.opened, 1.0f, 1.0f, xyz, NULL, &level));
    REFUSES(TERRIMP_E_MISS, xyz[0],
            terrimp_terrain_height(p.opened, -1.0f, 1.0f, xyz, NULL, &level));
    GIVES(TERRIMP_E_STATE, terrimp_terrain_rebuild(p.opened, &all, p.scratch, p.scratch_bytes));
    GIVES(TERRIMP_E_STATE, terrimp_terrain_build_begin(p.opened));
    GIVES(TERRIMP_E_STATE, terrimp_terrain_build_finish(p.opened));
    GIVES(TERRIMP_E_STATE, terrimp_pages_next_frame(p.l.terrain));
    CHECK(terrimp_bake_bytes(p.opened) == 0);
    REFUSES(TERRIMP_E_NULL, info, terrimp_pages_check(NULL, 9000, &info));
    REFUSES(TERRIMP_E_BAKE, info, terrimp_pages_check(p.file, 100, &info));
    REFUSES(TERRIMP_E_RANGE, terrain,
            terrimp_pages_open(NULL, p.file, p.bytes, 7, p.memory, bytes, &terrain));
    REFUSES(TERRIMP_E_MEMORY, terrain,
            terrimp_pages_open(NULL, p.file, p.bytes, 8, p.memory, bytes - 1u, &terrain));
    REFUSES(TERRIMP_E_ALIGN, terrain,
            terrimp_pages_open(NULL, p.file, p.bytes, 8, (char *)p.memory + 1, bytes, &terrain));
    CHECK(terrimp_pages_bytes(p.file, p.bytes, 65535) == 0);
    GIVES(TERRIMP_E_RANGE,
          terrimp_pages_build_block(&p.desc, p.block_count, p.scratch, p.scratch_bytes));
    GIVES(TERRIMP_E_MEMORY, terrimp_pages_build_block(&p.desc, 0, p.scratch, 100));
    p.desc.terrain.height_low = 200.0f; /* above most samples */
    GIVES(TERRIMP_E_RANGE, terrimp_pages_build_block(&p.desc, 0, p.scratch, p.scratch_bytes));
    p.desc.terrain.height_low = p.desc.terrain.height_high;
    GIVES(TERRIMP_E_RANGE, terrimp_pages_build_block(&p.desc, 0, p.scratch, p.scratch_bytes));
    p.desc.read = NULL;
    GIVES(TERRIMP_E_NULL, terrimp_pages_build_end(&p.desc, p.scratch, p.scratch_bytes));
    paged_free(&p);
}

/* ---- views ---- */

/* What a frame draws: where slots lie, and what follows from it, hangs on the order of captures. */
typedef struct paged_frame {
    terrimp_ground_command ground[PAGED_ALL];
    terrimp_impostor_command impostors[PAGED_ALL];
    uint32_t ground_count, impostor_count, captures, captured;
    paged_land *p; /* NULL: all is in memory */
    int in_capture;
} paged_frame;

static void paged_begin_capture(void *user, const terrimp_capture_command *c)
{
    paged_frame *f = (paged_frame *)user;
    CHECK(!f->p || paged_is_here(f->p, c->node));
    f->captures++;
    f->in_capture = 1;
}

static void paged_end_capture(void *user, const terrimp_capture_command *c)
{
    (void)c;
    ((paged_frame *)user)->in_capture = 0;
}

static void paged_ground(void *user, const terrimp_ground_command *c)
{
    paged_frame *f = (paged_frame *)user;
    CHECK(!f->p || paged_is_here(f->p, c->node)); /* the host would fill its buffers now */
    f->captured += f->in_capture ? 1u : 0u;
    if (!f->in_capture && f->ground_count < PAGED_ALL)
        f->ground[f->ground_count++] = *c;
}

static void paged_impostor(void *user, const terrimp_impostor_command *c)
{
    paged_frame *f = (paged_frame *)user;
    terrimp_impostor_command *own = &f->impostors[f->impostor_count];
    CHECK(!f->p || paged_is_here(f->p, c->node));
    if (f->impostor_count == PAGED_ALL)
        return;
    f->impostor_count++;
    *own = *c;
    own->atlas = own->base_vertex = own->first_index = 0;
    memset(own->texture_matrix, 0, sizeof own->texture_matrix);
}

static terrimp_result paged_render(terrimp_view *view, paged_frame *frame, paged_land *p)
{
    terrimp_callbacks callbacks;
    memset(frame, 0, sizeof *frame);
    memset(&callbacks, 0, sizeof callbacks);
    frame->p = p;
    callbacks.user = frame;
    callbacks.begin_capture = paged_begin_capture;
    callbacks.end_capture = paged_end_capture;
    callbacks.draw_ground = paged_ground;
    callbacks.draw_impostor = paged_impostor;
    return terrimp_view_render(view, &callbacks);
}

/* A host whose pages come late, in any order, and sometimes not at all. */
typedef struct paged_host {
    paged_land *p;
    uint32_t coming[64], count;
    uint32_t reads;
    uint32_t *times;       /* [node_count] each page has been read, */
    uint32_t *at_rest;     /* ... and since the eye rests; NULL: it does not matter */
    uint32_t pace;         /* percent of those coming that come in a frame */
} paged_host;

/* Returns whether anything is wanted or coming. */
static int paged_serve(paged_host *h)
{
    terrimp_want wants[64];
    uint32_t count, i, gone[64], gone_count;
    int busy;
    CHECK(terrimp_pages_wants(h->p->opened, wants, 64, &count) == TERRIMP_OK);
    busy = count > 0;
    for (i = 0; i < count; i++) {
        terrimp_page_info info;
        void *page;
        terrimp_result result;
        CHECK(i == 0 || wants[i].urgency <= wants[i - 1u].urgency);
        CHECK(terrimp_page_get_info(h->p->opened, wants[i].node, &info) == TERRIMP_OK);
        CHECK(info.state == TERRIMP_PAGE_ABSENT && info.level == wants[i].level);
        if (h->count == 64u || random_range(1, 100) > h->pace)
            continue;
        result = terrimp_page_begin(h->p->opened, wants[i].node, &page);
        CHECK(result == TERRIMP_OK || /* its parent's has been left out */
              (result == TERRIMP_E_STATE && paged_state(h->p, paged_above(h->p, wants[i].node)) ==
                                                TERRIMP_PAGE_ABSENT));
        if (result != TERRIMP_OK)
            continue;
        memcpy(page, h->p->file + info.offset, info.bytes);
        h->reads++;
        h->times[wants[i].node]++;
        if (h->at_rest)
            h->at_rest[wants[i].node]++;
        h->coming[h->count++] = wants[i].node;
    }
    busy |= h->count > 0;
    CHECK(terrimp_pages_withdrawn(h->p->opened, gone, 64, &gone_count) == TERRIMP_OK);
    for (i = 0; i < h->count;) {
        uint32_t node = h->coming[i], k, is_gone = 0;
        for (k = 0; k < gone_count; k++)
            is_gone |= gone[k] == node;
        if (is_gone || random_range(1, 200) == 1u) {
            CHECK(terrimp_page_fail(h->p->opened, node) == TERRIMP_OK);
            h->reads--;
            h->times[node]--;
            if (h->at_rest && h->at_rest[node] > 0)
                h->at_rest[node]--;
        } else if (random_range(1, 100) > h->pace || !paged_put(h->p, node)) {
            i++;
            continue;
        }
        h->coming[i] = h->coming[--h->count];
    }
    return busy;
}

/* All of the terrain in sight is drawn, by ground or a picture, and ground meets ground: neighbours
   differ by one level at most, and both know of it. */
static void check_paged_frame(const land *l, const paged_frame *frame, const terrimp_camera *camera,
                              int hides)
{
    const terrimp_quadtree *tree = terrimp_terrain_tree(l->terrain);
    uint8_t *drawn = (uint8_t *)calloc(1, l->info.node_count); /* 1 ground, 2 impostor */
    terrimp_frustum frustum;
    uint32_t i, holes = 0, cracks = 0;
    int side;
    CHECK(terrimp_camera_frustum(camera, &frustum) == TERRIMP_OK);
    for (i = 0; i < frame->ground_count; i++)
        drawn[frame->ground[i].node] |= 1u;
    for (i = 0; i < frame->impostor_count; i++)
        drawn[frame->impostors[i].node] |= 2u;
    for (i = 0; i < l->info.chunks_x * l->info.chunks_z; i++) {
        terrimp_node n = terrimpi_tree_node(tree, i);
        terrimp_box box;
        int shown = drawn[i];
        CHECK(terrimp_geomip_box(tree, i, &box) == TERRIMP_OK);
        if (terrimp_frustum_test(&frustum, &box, TERRIMP_PLANES_ALL) == TERRIMP_PLANES_OUTSIDE)
            continue;
        while (!shown && n.level + 1u < tree->level_count) {
            n = terrimpi_tree_parent(tree, &n);
            shown = drawn[n.number];
        }
        holes += !shown;
    }
    for (i = 0; i < frame->ground_count; i++) {
        terrimp_node n = terrimpi_tree_node(tree, frame->ground[i].node), beyond;
        terrimp_pattern pattern;
        uint32_t k = 0;
        for (;; k++) {
            CHECK(k < TERRIMP_PATTERN_COUNT && terrimp_pattern_find(l->info.chunk_quads,
                  TERRIMP_FORM_LIST, k, &pattern) == TERRIMP_OK);
            if (k >= TERRIMP_PATTERN_COUNT || pattern.first_index == frame->ground[i].first_index)
                break;
        }
        for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++) {
            uint32_t up = 0;
            if (!terrimpi_tree_beyond(tree, &n, side, &beyond))
                continue;
            while (!(drawn[beyond.number] & 1u) && beyond.level + 1u < tree->level_count) {
                beyond = terrimpi_tree_parent(tree, &beyond);
                up++;
            }
            if (drawn[beyond.number] & 1u) /* else finer ground, pictures or nothing is there */
                cracks += up > 1u || (up == 1u) != (k >> side & 1u);
        }
    }
    CHECK(holes == 0 || hides);
    CHECK(cracks == 0);
    free(drawn);
}

static terrimp_camera paged_camera(const land *l, uint32_t turn)
{
    terrimp_camera c;
    float wide = (float)(l->desc.field.width - 1u), angle = random_float(0.0f, 6.28f);
    memset(&c, 0, sizeof c);
    c.eye[0] = random_float(0.05f, 0.95f) * wide;
    c.eye[2] = random_float(0.05f, 0.95f) * wide;
    c.eye[1] = turn % 3u == 0 ? random_float(300.0f, 900.0f) : random_float(200.0f, 260.0f);
    c.forward[0] = cosf(angle);
    c.forward[1] = turn % 3u == 0 ? -1.0f : -0.2f;
    c.forward[2] = sinf(angle);
    c.width_px = 640;
    c.height_px = 480;
    c.z_near = 1.0f;
    c.z_far = 1e5f;
    return c;
}

/* A wide terrain and its pages, which two tests share; what they draw at random does not depend on
   which of them built it. */
static paged_land *paged_wide(void)
{
    static paged_land p;
    if (!p.file) {
        paged_prepare(&p, PAGED_SIDE, PAGED_SIDE, TERRIMP_FORMAT_U16, LAND_HILLS, PAGED_CHUNK, 0);
        CHECK(land_build(&p.l) && paged_build(&p));
    }
    check_state = CHECK_SEED;
    return &p;
}

static terrimp_view *paged_view(const terrimp_terrain *terrain, int mode, float morph_ratio,
                                terrimp_hider *hider)
{
    terrimp_view_desc desc;
    terrimp_view *view = NULL;
    memset(&desc, 0, sizeof desc);
    desc.mode = mode;
    desc.morph_ratio = morph_ratio;
    desc.tolerance_px = 2.0f;
    desc.atlas_size = 4096;
    desc.max_impostors = 4000;
    desc.hider = hider;
    CHECK(terrimp_view_create(terrain, &desc, NULL, &view) == TERRIMP_OK);
    return view;
}

/* Whether any chunk of a node is in sight, not only its skirts or the air between chunks. */
static int paged_shows(const land *l, const terrimp_frustum *frustum, uint32_t node)
{
    const terrimp_quadtree *tree = terrimp_terrain_tree(l->terrain);
    terrimp_node n = terrimpi_tree_node(tree, node), child;
    terrimp_box box;
    uint32_t i;
    int shows = 0;
    CHECK(terrimp_geomip_box(tree, node, &box) == TERRIMP_OK);
    if (terrimp_frustum_test(frustum, &box, TERRIMP_PLANES_ALL) == TERRIMP_PLANES_OUTSIDE)
        return 0;
    for (i = 0; i < 4u; i++)
        if (terrimpi_tree_quarter(tree, &n, i, &child))
            shows |= paged_shows(l, frustum, child.number);
    return n.level == 0 || shows;
}

/* Leaves out what is not in sight by that: FULL and IMPOSTOR draw more of it in memory, or less. */
static void paged_show(const land *l, const terrimp_camera *camera, paged_frame *frame)
{
    terrimp_frustum frustum;
    uint32_t i, count = frame->ground_count;
    CHECK(terrimp_camera_frustum(camera, &frustum) == TERRIMP_OK);
    for (i = frame->ground_count = 0; i < count; i++)
        if (paged_shows(l, &frustum, frame->ground[i].node))
            frame->ground[frame->ground_count++] = frame->ground[i];
    count = frame->impostor_count;
    for (i = frame->impostor_count = 0; i < count; i++)
        if (paged_shows(l, &frustum, frame->impostors[i].node))
            frame->impostors[frame->impostor_count++] = frame->impostors[i];
}

/* A low camera from where a hider hides something; NULL: sets, after their cell there is built.
   With wide cells all may be seen from anywhere. */
static terrimp_camera paged_low_camera(const land *l, terrimp_hider *hider, terrimp_sets *sets,
                                       const float *walls)
{
    terrimp_camera camera;
    terrimp_stats stats;
    uint32_t tries = 0;
    do {
        terrimp_view *view;
        terrimp_node below;
        camera = paged_camera(l, 1);
        CHECK(terrimp_heightfield_height(&l->desc.field, camera.eye[0], camera.eye[2],
                                         &camera.eye[1]) == TERRIMP_OK);
        camera.eye[1] += hider ? 8.0f : 1.0f;
        camera.z_near = 0.01f;
        CHECK(terrimp_quadtree_find(&l->terrain->tree, 0, camera.eye[0], camera.eye[2], &below) ==
              TERRIMP_OK);
        CHECK(terrimp_sets_build_cell(sets, walls, below.number, NULL) == TERRIMP_OK);
        view = paged_view(l->terrain, TERRIMP_MODE_GEOMIP, 0.0f, hider ? hider : &sets->hider);
        CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
        CHECK(terrimp_view_get_stats(view, &stats) == TERRIMP_OK);
        terrimp_view_destroy(view);
    } while (stats.hidden == 0 && ++tries < 20u);
    return camera;
}

/* Whatever the order in which pages come: in the end the eye sees what it sees of memory, in all
   modes; with a horizon, that and what would be hidden by ground that is not here; with visible
   sets, which are built of memory, that alone. */
static void pages_settle_to_what_memory_shows(void)
{
    static paged_frame frames[2];
    static terrimp_horizon horizons[2];
    terrimp_sets sets[2];
    paged_land *p = paged_wide();
    uint32_t turn, hidden[2] = {0, 0};
    float *walls = (float *)malloc(terrimp_walls_bytes(&p->l.terrain->tree));
    CHECK(terrimp_walls_build(&p->l.terrain->tree, NULL, walls) == TERRIMP_OK);
    memset(sets, 0, sizeof sets);
    sets[0].error = 0.1f;
    sets[0].codes = (uint8_t *)calloc(1, terrimp_sets_bytes(&p->l.terrain->tree, &sets[0]));
    sets[1] = sets[0];
    CHECK(terrimp_sets_init(&sets[0], &p->l.terrain->tree) == TERRIMP_OK);
    for (turn = 0; turn < 12u && check_bad == 0; turn++) {
        static const int modes[] = {TERRIMP_MODE_AUTO, TERRIMP_MODE_FULL, TERRIMP_MODE_GEOMIP,
                                    TERRIMP_MODE_IMPOSTOR};
        int mode = modes[turn % 4u], hides = turn % 3u > 0;
        terrimp_view *views[2];
        terrimp_camera camera = paged_camera(&p->l, turn);
        terrimp_stats stats[2] = {{0}, {0}};
        paged_host host;
        uint32_t frame, quiet = 0, i, k;
        if (hides) {
            CHECK(terrimp_horizon_init(&horizons[0], &p->l.terrain->tree, walls) == TERRIMP_OK);
            CHECK(terrimp_sets_init(&sets[0], &p->l.terrain->tree) == TERRIMP_OK);
            camera = paged_low_camera(&p->l, turn % 3u == 1u ? NULL : &horizons[0].hider, &sets[0],
                                      walls);
        }
        memset(&host, 0, sizeof host);
        free(p->memory);
        paged_open(p, PAGED_ALL);
        host.p = p;
        host.pace = turn % 3u == 0 ? 10u : 60u;
        host.times = (uint32_t *)calloc(p->l.info.node_count, sizeof *host.times);
        for (frame = 0; frame < 2u; frame++) {
            const terrimp_terrain *t = frame ? p->opened : p->l.terrain;
            CHECK(terrimp_horizon_init(&horizons[frame], &t->tree, walls) == TERRIMP_OK);
            CHECK(terrimp_sets_init(&sets[frame], &t->tree) == TERRIMP_OK);
            views[frame] = paged_view(t, mode, 0.0f, !hides           ? NULL
                                                     : turn % 3u == 1u ? &sets[frame].hider
                                                                       : &horizons[frame].hider);
        }
        for (frame = 0; frame < 2000u && quiet < 8u; frame++) {
            terrimp_result result;
            CHECK(terrimp_pages_next_frame(p->opened) == TERRIMP_OK);
            result = terrimp_view_update(views[1], &camera);
            CHECK(result == (paged_is_here(p, p->info.node_count - 1u) ? TERRIMP_OK
                                                                       : TERRIMP_E_PAGE));
            if (paged_serve(&host) || result != TERRIMP_OK)
                quiet = 0;
            if (result != TERRIMP_OK)
                continue;
            CHECK(paged_render(views[1], &frames[1], p) == TERRIMP_OK);
            if (frame % 8u == 0)
                check_paged_frame(&p->l, &frames[1], &camera, hides);
            quiet = frames[1].captures ? 0 : quiet + 1u;
        }
        CHECK(quiet == 8u);
        for (frame = 0, quiet = 0; frame < 500u && quiet < 8u; frame++) {
            CHECK(terrimp_view_update(views[0], &camera) == TERRIMP_OK);
            CHECK(paged_render(views[0], &frames[0], NULL) == TERRIMP_OK);
            quiet = frames[0].captures ? 0 : quiet + 1u;
        }
        CHECK(terrimp_view_get_stats(views[0], &stats[0]) == TERRIMP_OK);
        CHECK(terrimp_view_get_stats(views[1], &stats[1]) == TERRIMP_OK);
        CHECK(stats[1].late == 0 && stats[0].late == 0);
        for (frame = 0; frame < 2u && mode % 2 == 1; frame++)
            paged_show(&p->l, &camera, &frames[frame]);
        hidden[turn % 3u / 2u] += stats[1].hidden;
        if (turn % 3u < 2u) { /* else a sample that would hide may not be here */
            CHECK(stats[1].hidden == stats[0].hidden);
            CHECK(frames[0].ground_count == frames[1].ground_count);
            CHECK(frames[0].impostor_count == frames[1].impostor_count);
            CHECK(mode % 2 == 1 || stats[0].triangles == stats[1].triangles);
        }
        for (i = k = 0; i < frames[0].ground_count; i++, k++) {
            while (k < frames[1].ground_count && memcmp(&frames[0].ground[i], &frames[1].ground[k],
                                                        sizeof frames[0].ground[0]) != 0)
                k++;
            CHECK(k < frames[1].ground_count);
        }
        for (i = k = 0; i < frames[0].impostor_count; i++, k++) {
            while (k < frames[1].impostor_count &&
                   memcmp(&frames[0].impostors[i], &frames[1].impostors[k],
                          sizeof frames[0].impostors[0]) != 0)
                k++;
            CHECK(k < frames[1].impostor_count);
        }
        terrimp_view_destroy(views[0]);
        terrimp_view_destroy(views[1]);
        free(host.times);
    }
    CHECK(hidden[0] > 0 || PAGED_CHUNK > 16u); /* from somewhere in a wide cell all is seen */
    CHECK(hidden[1] > 0);
    free(sets[0].codes);
    free(walls);
    free(p->memory);
    p->memory = NULL;
}

/* Level ground is drawn as one node, exact from anywhere: nothing finer is asked for, nor are
   smaller impostors than that node, which is too large for one. */
static void pages_that_nothing_needs_are_not_wanted(void)
{
    paged_land p;
    terrimp_view *view;
    terrimp_camera camera;
    terrimp_want wants[8];
    uint32_t frame, count;
    paged_prepare(&p, 513, 513, TERRIMP_FORMAT_U16, LAND_FLAT, 32, 0);
    if (!paged_build(&p) || !paged_open(&p, 40))
        return;
    CHECK(paged_fetch(&p, p.info.node_count - 1u) == TERRIMP_OK);
    camera = paged_camera(&p.l, 0);
    camera.eye[1] = 900.0f;
    view = paged_view(p.opened, TERRIMP_MODE_AUTO, 0.0f, NULL);
    for (frame = 0; frame < 4u; frame++) {
        CHECK(terrimp_pages_next_frame(p.opened) == TERRIMP_OK);
        CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
        CHECK(terrimp_pages_wants(p.opened, wants, 8, &count) == TERRIMP_OK);
        CHECK(count == 0);
    }
    terrimp_view_destroy(view);
    paged_free(&p);
}

/* Morphing: vertices move as those of memory do, to the far edges of any size; and from pages that
   are made for it, as many nodes morph as far. */
static void pages_morph_as_memory_does(void)
{
    static paged_frame frames[2];
    uint32_t turn, morphs = 0;
    for (turn = 0; turn < 4u && check_bad == 0; turn++) {
        paged_land p;
        terrimp_view *views[2];
        terrimp_geomip_vertex *vertices[2];
        terrimp_view_desc desc;
        uint32_t node, count, i;
        float ratio = turn == 1u ? 2.0f : random_float(turn ? 1.1f : 1.5f, 2.0f);
        paged_prepare(&p, turn ? random_range(60, 110) : 257u,
                      turn ? random_range(60, 110) : 257u, TERRIMP_FORMAT_U16,
                      turn == 1u ? LAND_NOISE : LAND_HILLS, 8, turn < 2u ? 0u : 2u);
        p.desc.morph_ratio = ratio;
        if (!land_build(&p.l) || !paged_build(&p) || !paged_open(&p, p.l.info.node_count + 8u))
            return;
        CHECK(fabsf(p.info.morph_ratio - ratio) < 1e-6f);
        memset(&desc, 0, sizeof desc);
        desc.morph_ratio = ratio + 0.1f;
        CHECK(terrimp_view_desc_resolve(p.opened, &desc, &desc) == TERRIMP_E_RANGE);
        desc.morph_ratio = ratio;
        desc.ground_rule = TERRIMP_GEOMIP_DISTANCE;
        CHECK(terrimp_view_desc_resolve(p.opened, &desc, &desc) == TERRIMP_E_RANGE);
        paged_fetch_all(&p);
        count = p.l.info.ground_vertex_count;
        for (i = 0; i < 2u; i++) {
            vertices[i] = (terrimp_geomip_vertex *)calloc(count, sizeof *vertices[0]);
            views[i] = paged_view(i ? p.opened : p.l.terrain, TERRIMP_MODE_GEOMIP, ratio, NULL);
        }
        for (node = 0; node < p.l.info.node_count; node++) {
            for (i = 0; i < 2u; i++)
                CHECK(terrimp_terrain_fill_morph(i ? p.opened : p.l.terrain, node, vertices[i],
                                                 count) == TERRIMP_OK);
            CHECK(memcmp(vertices[0], vertices[1], count * sizeof *vertices[0]) == 0);
            if (node + 1u < p.l.info.node_count) /* a parent measures ratio^2 times as much */
                CHECK(terrimpi_page_held(&p.opened->tree,
                                         terrimpi_tree_parent_number(&p.opened->tree, node)) >=
                      0.4999f * ratio * ratio * terrimpi_page_held(&p.opened->tree, node));
        }
        for (i = 0; i < 40u && turn < 2u; i++) { /* above blocks errors are others */
            terrimp_camera camera = paged_camera(&p.l, i);
            CHECK(terrimp_pages_next_frame(p.opened) == TERRIMP_OK);
            CHECK(terrimp_view_update(views[0], &camera) == TERRIMP_OK);
            CHECK(terrimp_view_update(views[1], &camera) == TERRIMP_OK);
            CHECK(paged_render(views[0], &frames[0], NULL) == TERRIMP_OK);
            CHECK(paged_render(views[1], &frames[1], &p) == TERRIMP_OK);
            CHECK(frames[0].ground_count == frames[1].ground_count);
            for (node = 0; node < frames[0].ground_count; node++) {
                const terrimp_ground_command *a = &frames[0].ground[node];
                const terrimp_ground_command *b = &frames[1].ground[node];
                CHECK(a->node == b->node && a->first_index == b->first_index);
                CHECK(fabsf(a->morph - b->morph) < 1e-3f);
                morphs += a->morph > 0.01f && a->morph < 0.99f;
            }
        }
        CHECK(morphs > 0 || turn < 1u);
        for (i = 0; i < 2u; i++) {
            free(vertices[i]);
            terrimp_view_destroy(views[i]);
        }
        paged_free(&p);
    }
}

/* A flight with far too few slots: no holes, no cracks. While the eye rests, no page is read twice
   that fits: of ground, which needs all of its pages at once, none at all; of pictures, which are
   made one after the other, none when there are enough slots, else one in ten. With enough slots
   nothing is read twice in the whole flight, but for what failed to come. */
static void pages_fly_without_holes(void)
{
    static paged_frame frame;
    paged_land *p = paged_wide();
    uint32_t turn, ever = 0;
    for (turn = 0; turn < 8u && check_bad == 0; turn++) {
        static const uint32_t slots[] = {40, 100, PAGED_ALL, 200};
        int mode = turn / 4u ? TERRIMP_MODE_GEOMIP : TERRIMP_MODE_AUTO;
        terrimp_camera camera = paged_camera(&p->l, turn);
        terrimp_view *view;
        paged_host host;
        uint32_t i, k, once = 0, rested = 0, again = 0;
        memset(&host, 0, sizeof host);
        free(p->memory);
        paged_open(p, slots[turn % 4u]);
        host.p = p;
        host.pace = 50;
        host.times = (uint32_t *)calloc(2u * p->l.info.node_count, sizeof *host.times);
        view = paged_view(p->opened, mode, 0.0f, NULL);
        for (i = 0; i < 300u; i++) {
            terrimp_result result;
            int rests = i % 100u >= 50u;
            if (!rests) {
                camera.eye[0] += camera.forward[0] * 2.0f;
                camera.eye[2] += camera.forward[2] * 2.0f;
                if (camera.eye[0] < 25.0f || camera.eye[0] > (float)PAGED_SIDE - 26.0f ||
                    camera.eye[2] < 25.0f || camera.eye[2] > (float)PAGED_SIDE - 26.0f)
                    camera.forward[0] = -camera.forward[0], camera.forward[2] = -camera.forward[2];
            }
            if (i == 150u)
                camera = paged_camera(&p->l, turn);
            CHECK(terrimp_pages_next_frame(p->opened) == TERRIMP_OK);
            result = terrimp_view_update(view, &camera);
            CHECK(result == (paged_is_here(p, p->info.node_count - 1u) ? TERRIMP_OK
                                                                       : TERRIMP_E_PAGE));
            host.at_rest = rests ? host.times + p->l.info.node_count : NULL;
            paged_serve(&host);
            for (k = 0; k < p->l.info.node_count && i % 100u == 99u; k++) {
                uint32_t *times = &host.at_rest[k];
                rested += *times;
                again += *times > 1u ? *times - 1u : 0u;
                *times = 0;
            }
            if (result != TERRIMP_OK)
                continue;
            CHECK(paged_render(view, &frame, p) == TERRIMP_OK);
            if (i % 3u == 0)
                check_paged_frame(&p->l, &frame, &camera, 0);
        }
        for (k = 0; k < p->l.info.node_count; k++)
            once += host.times[k] > 0;
        CHECK(again * 10u <= rested);
        ever += rested;
        CHECK(again == 0 || (mode == TERRIMP_MODE_AUTO && slots[turn % 4u] < PAGED_ALL));
        if (slots[turn % 4u] == PAGED_ALL)
            CHECK(host.reads * 10u <= once * 11u);
        terrimp_view_destroy(view);
        free(host.times);
    }
    CHECK(ever > 0);
    free(p->memory);
    p->memory = NULL;
}

/* One of four quarters is missing, so the whole is one draw; the pages of the others are of use all
   the same, down to the finest, or they would be given up and asked for again. */
static void pages_asked_for_are_in_use(void)
{
    paged_land *p = paged_wide();
    const terrimp_quadtree *tree = terrimp_terrain_tree(p->l.terrain);
    terrimp_camera camera = paged_camera(&p->l, 1);
    terrimp_view *view;
    terrimp_stats stats;
    uint32_t node, used = 0;
    free(p->memory);
    paged_open(p, PAGED_ALL);
    for (node = tree->node_count; node-- > 0;) {
        terrimp_node n = terrimpi_tree_node(tree, node);
        uint32_t up = tree->level_count - 2u - n.level;
        if (n.level + 1u == tree->level_count || !(n.x >> up & n.z >> up & 1u))
            CHECK(paged_fetch(p, node) == TERRIMP_OK);
    }
    camera.eye[0] = camera.eye[2] = 0.3f * (float)PAGED_SIDE;
    camera.forward[0] = camera.forward[2] = 1.0f;
    view = paged_view(p->opened, TERRIMP_MODE_GEOMIP, 0.0f, NULL);
    for (node = 0; node < 3u; node++)
        CHECK(terrimp_pages_next_frame(p->opened) == TERRIMP_OK);
    CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
    CHECK(terrimp_view_get_stats(view, &stats) == TERRIMP_OK && stats.ground == 1u);
    for (node = 0; node < tree->level_first[1]; node++) {
        const terrimpi_page_slot *slot = terrimpi_page_slot_of(p->opened->tree.pages, node);
        used += slot && slot->used == p->opened->tree.pages->frame;
    }
    CHECK(used > 4u);
    terrimp_view_destroy(view);
    free(p->memory);
    p->memory = NULL;
}

/* Of the pages that are here, which have been asked for from one place, when little was known: all
   that are in sight are `needed`, but for the children of such ones, since a guess is too fine by
   one level at most: in the last frame, or with pictures in any, since what these are made of is
   not used again; and of ground, which is all that a frame uses unless it makes pictures, none is
   out of sight by the root's heights. Returns how many are in use. */
static uint32_t paged_check_reads(const paged_land *p, const terrimp_camera *camera, int mode,
                                  const unsigned char *needed)
{
    const struct terrimp_pages *pages = p->opened->tree.pages;
    const terrimp_quadtree *tree = &p->opened->tree;
    uint32_t i, used = 0;
    terrimp_frustum frustum;
    terrimp_box box, root;
    CHECK(terrimp_camera_frustum(camera, &frustum) == TERRIMP_OK);
    CHECK(terrimp_terrain_get_box(p->opened, tree->node_count - 1u, &root) == TERRIMP_OK);
    for (i = 0; i < pages->slot_count; i++) {
        uint32_t node = pages->slots[i].node;
        if (node == tree->node_count)
            continue;
        CHECK(terrimp_geomip_box(tree, node, &box) == TERRIMP_OK);
        if (terrimp_frustum_test(&frustum, &box, TERRIMP_PLANES_ALL) != TERRIMP_PLANES_OUTSIDE)
            CHECK(needed[node] || needed[terrimpi_tree_parent_number(tree, node)]);
        box.min[1] = root.min[1];
        box.max[1] = root.max[1];
        CHECK(pages->slots[i].used == pages->frame || mode != TERRIMP_MODE_GEOMIP ||
              terrimp_frustum_test(&frustum, &box, TERRIMP_PLANES_ALL) != TERRIMP_PLANES_OUTSIDE);
        used += pages->slots[i].used == pages->frame;
    }
    return used;
}

/* A far jump, and a start with nothing here, not even the root: what the eye needs is asked for at
   once and not one level after the other, so all of it is here after half as many rounds, and one
   for each list that is full; and of all jumps together little else has come. */
static void pages_of_a_jump_come_at_once(void)
{
    paged_land *p = paged_wide();
    uint32_t turn, all_reads = 0, all_used = 0;
    for (turn = 0; turn < 12u && check_bad == 0; turn++) {
        static terrimp_want wants[512];
        terrimp_view *view;
        terrimp_camera camera = paged_camera(&p->l, turn < 8u ? turn / 2u : turn);
        uint32_t count = 1, rounds = 0, reads = 0, i;
        int mode = turn % 2u || turn >= 8u ? TERRIMP_MODE_GEOMIP : TERRIMP_MODE_AUTO;
        unsigned char *needed = (unsigned char *)calloc(p->l.info.node_count, 1);
        if (turn >= 8u) { /* few pixels: ground will do that is far above the finest */
            camera.width_px /= 8u;
            camera.height_px /= 8u;
        }
        free(p->memory);
        paged_open(p, PAGED_ALL);
        view = paged_view(p->opened, mode, 0.0f, NULL);
        while (count > 0 && rounds < 20u) {
            const struct terrimp_pages *pages = p->opened->tree.pages;
            CHECK(terrimp_pages_next_frame(p->opened) == TERRIMP_OK);
            CHECK(terrimp_view_update(view, &camera) == (rounds ? TERRIMP_OK : TERRIMP_E_PAGE));
            for (i = 0; i < p->l.info.node_count; i++) {
                const terrimpi_page_slot *slot = terrimpi_page_slot_of(pages, i);
                needed[i] = (needed[i] && mode == TERRIMP_MODE_AUTO) ||
                            (slot && slot->used == pages->frame);
            }
            CHECK(terrimp_pages_wants(p->opened, wants, 512, &count) == TERRIMP_OK);
            for (i = 0; i < count; i++)
                CHECK(paged_fetch(p, wants[i].node) == TERRIMP_OK); /* parents come first */
            reads += count;
            rounds += count > 0;
        }
        CHECK(rounds <= p->opened->tree.level_count / 2u + reads / TERRIMPI_PAGE_WANTS);
        all_reads += reads;
        all_used += paged_check_reads(p, &camera, mode, needed);
        free(needed);
        terrimp_view_destroy(view);
    }
    CHECK(all_reads * 2u <= all_used * 3u);
    free(p->memory);
    p->memory = NULL;
}

/* What nobody knows is guessed from the last pages of each level, which may be of other places:
   whatever these say, a guess is less sure from level to level, by half of its square. So it ends
   soon, where all that is in sight could be asked for; and rougher children than parents count as
   if both were alike. */
static void guesses_of_pages_fall_from_level_to_level(void)
{
    paged_land *p = paged_wide();
    uint32_t turn, guesses = 0, i, k;
    for (turn = 0; turn < 9u && check_bad == 0; turn++) {
        static terrimp_want wants[2][512];
        terrimp_camera camera = paged_camera(&p->l, turn);
        uint32_t count[2];
        camera.eye[1] += 100.0f; /* above all: nothing is asked for just since it is below */
        free(p->memory);
        paged_open(p, PAGED_ALL);
        CHECK(paged_fetch(p, p->l.info.node_count - 1u) == TERRIMP_OK);
        for (k = 0; k < 2u; k++) {
            terrimp_view *view = paged_view(p->opened, TERRIMP_MODE_GEOMIP, 0.0f, NULL);
            for (i = 1; i < p->info.level_count && turn % 3u > 0; i++)
                p->opened->tree.pages->held[i] = turn % 3u == 2u ? 1.0f + (float)(i % 2u) * 1000.0f
                                                 : k             ? 1.0f
                                                                 : (float)(1u << (20u - i % 20u));
            CHECK(terrimp_pages_next_frame(p->opened) == TERRIMP_OK);
            CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
            CHECK(terrimp_pages_wants(p->opened, wants[k], 512, &count[k]) == TERRIMP_OK);
            terrimp_view_destroy(view);
        }
        CHECK(count[0] == count[1] && memcmp(wants[0], wants[1], count[0] * sizeof *wants[0]) == 0);
        for (i = 0; i < count[0]; i++)
            for (k = 0; k < i && wants[0][i].level + 4u <= p->info.level_count; k++)
                if (wants[0][k].node == paged_above(p, wants[0][i].node)) {
                    float above = wants[0][k].urgency * wants[0][k].urgency;
                    CHECK(wants[0][i].urgency * wants[0][i].urgency <= 0.5001f * above);
                    guesses++;
                }
    }
    CHECK(guesses > 0);
    free(p->memory);
    p->memory = NULL;
}

/* Two views of one terrain: the list is what either alone would ask for, at the greater urgency,
   as long as it has room for all. */
static void pages_are_wanted_by_all_views(void)
{
    paged_land *p = paged_wide();
    uint32_t turn, i, k, whole = 0, both = 0;
    for (turn = 0; turn < 6u && check_bad == 0; turn++) {
        static terrimp_want wants[3][600];
        terrimp_view *views[2];
        uint32_t count[3], shared = 0;
        free(p->memory);
        paged_open(p, PAGED_ALL);
        for (i = p->l.info.node_count; i-- > 0;)
            if (i >= p->opened->tree.level_first[1] || i % 4u)
                paged_fetch(p, i);
        for (i = 0; i < 2u; i++)
            views[i] = paged_view(p->opened, i ? TERRIMP_MODE_GEOMIP : TERRIMP_MODE_AUTO, 0.0f,
                                  NULL);
        for (k = 0; k < 3u; k++) { /* the first, the second, both */
            check_state = CHECK_SEED + turn;
            CHECK(terrimp_pages_next_frame(p->opened) == TERRIMP_OK);
            for (i = 0; i < 2u; i++) {
                terrimp_camera camera = paged_camera(&p->l, turn + i);
                if (k == 2u || k == i)
                    CHECK(terrimp_view_update(views[i], &camera) == TERRIMP_OK);
            }
            CHECK(terrimp_pages_wants(p->opened, wants[k], 600, &count[k]) == TERRIMP_OK);
        }
        whole += count[2] < TERRIMPI_PAGE_WANTS;
        for (k = 0; k < 2u && count[2] < TERRIMPI_PAGE_WANTS; k++)
            for (i = 0; i < count[k]; i++) {
                const terrimp_want *w = &wants[k][i];
                uint32_t at = 0;
                while (at < count[2] && wants[2][at].node != w->node)
                    at++;
                CHECK(at < count[2] && wants[2][at].urgency >= w->urgency);
                shared += k == 1u && at < count[2];
                for (at = 0; k == 1u && at < count[0]; at++)
                    shared -= wants[0][at].node == w->node;
            }
        both += count[0] > 0 && count[1] > 0; /* from some places hardly anything is in sight */
        CHECK(count[2] == TERRIMPI_PAGE_WANTS || count[2] == count[0] + shared);
        for (i = 0; i < 2u; i++)
            terrimp_view_destroy(views[i]);
    }
    CHECK(whole > 1u && both > 0);
    free(p->memory);
    p->memory = NULL;
}

/* Pictures that stand for smaller ones. An eye comes closer when the finest two levels have been
   given up: what is too large for an impostor by then stays one, and is drawn while its picture is
   good. It is not made anew, but asks for the nodes that it stands for, before all that is only a
   little coarse. When they have come nothing stands for others any more. With chunks of 64,
   impostors are smaller than the nodes of ground that will do: pictures alone ask for pages. */
static void pictures_stand_for(uint32_t side, uint32_t chunk, float ground_px, float from,
                               float step, uint32_t *drawn)
{
    static paged_frame frame;
    static terrimp_want wants[512];
    paged_land p;
    terrimp_camera camera;
    terrimp_view_desc desc;
    terrimp_view *view = NULL;
    uint32_t turn, i, k, at, count, node, stood = 0, asked = 0;
    paged_prepare(&p, side, side, TERRIMP_FORMAT_U16, LAND_HILLS, chunk, 0);
    p.l.desc.field.height_scale = p.desc.terrain.field.height_scale = 2e-4f; /* meshes do */
    if (!land_build(&p.l) || !paged_build(&p) || !paged_open(&p, p.info.node_count + 8u))
        return;
    paged_fetch_all(&p);
    camera = paged_camera(&p.l, 1);
    camera.eye[0] = from;
    camera.eye[1] = 14.0f + 2.0f * (float)chunk;
    camera.eye[2] = 0.5f * (float)side;
    camera.forward[0] = 1.0f;
    camera.forward[1] = -0.3f;
    camera.forward[2] = 0.0f;
    memset(&desc, 0, sizeof desc);
    desc.tolerance_px = 8.0f; /* pictures last, and cost little */
    desc.ground_tolerance_px = ground_px;
    desc.costs.capture = 1.0f;
    CHECK(terrimp_view_create(p.opened, &desc, NULL, &view) == TERRIMP_OK);
    for (turn = 0; turn < 200u; turn++) {
        int held_back = turn >= 60u && turn < 160u;
        if (turn < 160u)
            camera.eye[0] += step;
        for (node = 0; node < p.opened->tree.level_first[2] && turn == 60u; node++)
            terrimpi_page_clear(&p.opened->tree, terrimpi_page_slot_of(p.opened->tree.pages, node));
        CHECK(terrimp_pages_next_frame(p.opened) == TERRIMP_OK);
        CHECK(terrimp_view_update(view, &camera) == TERRIMP_OK);
        CHECK(terrimp_pages_wants(p.opened, wants, 512, &count) == TERRIMP_OK);
        for (k = 0; k < view->regions.count; k++) {
            const terrimpi_region *r = &view->regions.items[k];
            const terrimpi_candidate *c = r->candidates;
            const terrimpi_cache_picture *picture;
            terrimp_node child;
            if (r->kind != TERRIMPI_VIEW_KIND_IMPOSTOR || r->candidate_count != 1u || !c->is_short)
                continue;
            CHECK(turn >= 60u && turn < 165u);
            for (i = 0; i < view->jobs.count; i++)
                CHECK(view->jobs.items[i].plan.node.number != c->node.number);
            picture = terrimpi_cache_find(&view->cache, c->node.number);
            CHECK(!terrimpi_candidate_ready(c) || picture->listed == view->frame.number);
            *drawn += terrimpi_candidate_ready(c) ? 1u : 0u;
            stood++;
            for (i = 0; i < 4u; i++) {
                terrimp_box box;
                CHECK(terrimpi_tree_quarter(&p.opened->tree, &c->node, i, &child));
                terrimpi_page_box(p.opened, &child, &box);
                if (paged_is_here(&p, child.number) ||
                    terrimp_frustum_test(&view->frame.frustum, &box, TERRIMP_PLANES_ALL) ==
                        TERRIMP_PLANES_OUTSIDE)
                    continue;
                for (at = 0; at < count && wants[at].node != child.number; at++) {}
                CHECK(at < count && wants[at].urgency >= 2.0f);
                asked++;
            }
        }
        CHECK(paged_render(view, &frame, &p) == TERRIMP_OK);
        check_paged_frame(&p.l, &frame, &camera, 0);
        for (i = 0; i < count && !held_back; i++)
            CHECK(paged_fetch(&p, wants[i].node) == TERRIMP_OK);
    }
    CHECK(stood > *drawn && asked > 0);
    CHECK(view->late == 0 && frame.impostor_count > 0);
    terrimp_view_destroy(view);
    paged_free(&p);
}

static void pictures_stand_for_pages_on_the_way(void)
{
    uint32_t drawn = 0;
    pictures_stand_for(1025, 64, 20.0f, 265.0f, 0.5f, &drawn);
    drawn = 0;
    pictures_stand_for(257, 8, 0.25f, 20.0f, 0.25f, &drawn);
    CHECK(drawn > 0);
}

/* What a picture costs that pages are missing for: while the eye moves several times as much as
   with them, when it is past in a few frames, and hardly more when the picture lasts. An eye at
   rest sees what memory shows, so there the cost is the same. */
static void pages_are_not_worth_fleeting_pictures(void)
{
    uint32_t turn;
    for (turn = 0; turn < 8u; turn++) {
        static const float lives[] = {6.0f, 500.0f};
        int moves = turn & 1u, lasts = turn >> 1 & 1u;
        terrimp_view_desc desc;
        terrimpi_frame f;
        terrimpi_candidate c;
        terrimpi_region region;
        terrimpi_region_offer whole, short_of;
        memset(&desc, 0, sizeof desc);
        memset(&f, 0, sizeof f);
        memset(&c, 0, sizeof c);
        memset(&region, 0, sizeof region);
        f.desc = &desc;
        f.motion.away[0][turn >> 2 ? 0 : 2] = moves ? -300.0f : 0.0f;
        c.capture_cost = random_float(1e3f, 1e5f);
        c.draw_cost = 168.0f;
        c.life = lives[lasts];
        region.candidates = &c;
        region.candidate_count = region.fits = 1;
        CHECK(terrimpi_view_impostor_estimate(&f, &region, &whole));
        c.is_short = 1;
        CHECK(terrimpi_view_impostor_estimate(&f, &region, &short_of));
        CHECK(short_of.draw == whole.draw);
        if (!moves)
            CHECK(short_of.upkeep == whole.upkeep);
        else if (lasts)
            CHECK(short_of.upkeep < 1.1f * whole.upkeep);
        else
            CHECK(short_of.upkeep > 4.0f * whole.upkeep);
    }
}

static inline void pages_tests(void)
{
    RUN(bad_pages);
    RUN(pages_that_are_no_good_are_refused);
    RUN(pages_are_not_worth_fleeting_pictures);
}

/* What flies: of the program flights.c. */
static inline void pages_flights(void)
{
    RUN(pages_say_what_memory_does);
    RUN(pages_above_blocks_miss_no_sample);
    RUN(pages_are_built_in_any_order);
    RUN(pages_are_edited);
    RUN(pages_are_closed_upwards);
    RUN(pages_answer_heights_and_rays);
    RUN(pages_settle_to_what_memory_shows);
    RUN(pages_that_nothing_needs_are_not_wanted);
    RUN(pages_morph_as_memory_does);
    RUN(pages_fly_without_holes);
    RUN(pages_asked_for_are_in_use);
    RUN(pages_of_a_jump_come_at_once);
    RUN(guesses_of_pages_fall_from_level_to_level);
    RUN(pages_are_wanted_by_all_views);
    RUN(pictures_stand_for_pages_on_the_way);
}

#endif
