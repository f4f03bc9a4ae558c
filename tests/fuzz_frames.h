/* What the fuzzers of whole terrains share: settings of views, the host's buffers, and frames from
   cameras anywhere, with callbacks that check every command against what terrimp_terrain_get_info
   promises. Public functions only. To be included behind terrimp.h. */
#ifndef FUZZ_FRAMES_H
#define FUZZ_FRAMES_H

#define GREATEST_BLOCK ((size_t)1 << 24) /* more memory is not worth a fuzzer's time */

static terrimp_terrain_info info;
static terrimp_view_desc settings; /* as resolved */
static float *vertices;            /* of all coarse meshes, as get_info sizes them */
static uint16_t *indices, *patterns;
static int open_capture, impostors, captures;

/* ---- what is checked of a command ---- */

static void begin_capture(void *user, const terrimp_capture_command *c)
{
    FUZZ_CHECK(user == &info && !open_capture && impostors == 0);
    open_capture = 1;
    captures++;
    FUZZ_CHECK(c->node < info.node_count);
    FUZZ_CHECK(c->slot.width > 0 && c->slot.height > 0);
    FUZZ_CHECK(c->slot.x <= settings.atlas_size && c->slot.y <= settings.atlas_size);
    FUZZ_CHECK(c->slot.width <= settings.atlas_size - c->slot.x);
    FUZZ_CHECK(c->slot.height <= settings.atlas_size - c->slot.y);
    FUZZ_CHECK(fuzz_finite(c->view, 16) && fuzz_finite(c->projection, 16));
    FUZZ_CHECK(fuzz_finite(c->eye, 3));
    FUZZ_CHECK(c->clip_min[0] <= c->clip_max[0] && c->clip_min[1] <= c->clip_max[1]);
}

static void end_capture(void *user, const terrimp_capture_command *c)
{
    (void)c;
    FUZZ_CHECK(user == &info && open_capture);
    open_capture = 0;
}

static void draw_ground(void *user, const terrimp_ground_command *c)
{
    FUZZ_CHECK(user == &info && c->node < info.node_count);
    FUZZ_CHECK(c->index_count % 3u == 0 && c->first_index <= info.ground_index_count);
    FUZZ_CHECK(c->index_count <= info.ground_index_count - c->first_index);
}

/* A range of the coarse meshes' indices, and the vertices that it leads to. */
static void check_mesh_range(uint32_t base, uint32_t first, uint32_t count)
{
    uint32_t i;
    FUZZ_CHECK(count % 3u == 0 && first <= info.mesh_index_count);
    FUZZ_CHECK(count <= info.mesh_index_count - first && base < info.mesh_vertex_count);
    for (i = first; i < first + count; i++)
        FUZZ_CHECK(indices[i] < info.mesh_vertex_count - base);
}

static void draw_impostor(void *user, const terrimp_impostor_command *c)
{
    FUZZ_CHECK(user == &info && !open_capture && c->node < info.node_count);
    FUZZ_CHECK(c->part_count <= 2 && c->part < c->part_count);
    impostors += c->part == 0; /* of a picture in two parts both are drawn */
    check_mesh_range(c->base_vertex, c->first_index, c->index_count);
    FUZZ_CHECK(fuzz_finite(c->texture_matrix, 16));
    FUZZ_CHECK(c->alpha >= 0.0f && c->alpha <= 1.0f);
}

static void draw_floor(void *user, const terrimp_floor_command *c)
{
    FUZZ_CHECK(user == &info && !open_capture);
    check_mesh_range(c->base_vertex, c->first_index, c->index_count);
}

/* ---- settings ---- */

static void describe_view(terrimp_view_desc *desc)
{
    uint32_t switches = fuzz_u8();
    memset(desc, 0, sizeof *desc);
    desc->mode = (int)fuzz_below(TERRIMP_MODE_COUNT + 1);
    desc->ground_rule = fuzz_u8() & 3u ? 0 : (int)fuzz_below(TERRIMP_GEOMIP_RULE_COUNT + 1);
    desc->bound = terrimp_geomip_bound();
    desc->morph_ratio = fuzz_u8() & 3u ? 0.0f : fuzz_float(4.0f);
    desc->fade_start = fuzz_u8() & 3u ? fuzz_good(0.0f, 80.0f) : fuzz_float(100.0f);
    desc->fade_end = fuzz_u8() & 3u ? 0.0f : fuzz_float(200.0f);
    desc->max_angle_rad = fuzz_u8() & 3u ? 0.0f : fuzz_float(1.0f);
    desc->tolerance_px = fuzz_u8() & 3u ? 0.0f : fuzz_float(9.0f);
    desc->ground_tolerance_px = fuzz_u8() & 3u ? 0.0f : fuzz_float(9.0f);
    desc->texels_per_px = fuzz_u8() & 3u ? 0.0f : fuzz_float(4.0f);
    desc->impostor_px = fuzz_u8() & 3u ? 0.0f : fuzz_float(600.0f);
    desc->atlas_size = fuzz_u8() & 3u ? 64u + 4u * fuzz_u8() : fuzz_size(250);
    desc->atlas_count = fuzz_u8() & 3u ? 1u + fuzz_below(3) : fuzz_size(17);
    desc->max_impostors = fuzz_u8() & 3u ? 1u + fuzz_below(60) : fuzz_size(250);
    desc->max_ground = fuzz_u8() & 3u ? 0u : fuzz_size(30);
    desc->max_captures = fuzz_below(5);
    desc->max_capture_texels = fuzz_u8() & 3u ? 0u : 16u * fuzz_u8();
    desc->max_capture_triangles = fuzz_u8() & 3u ? 0u : 4u * fuzz_u8();
    desc->no_lookahead = (int)(switches & 1u);
    desc->no_splits = (int)(switches & 2u);
    desc->no_spreading = (int)(switches & 4u);
    if (switches & 8u) {
        desc->costs.draw = fuzz_float(100.0f);
        desc->costs.triangle = fuzz_float(4.0f);
        desc->costs.capture = fuzz_float(4000.0f);
        desc->costs.ground_px = fuzz_float(9.0f);
        desc->costs.impostor_px = fuzz_float(1.0f);
    }
    desc->cost_limit = terrimp_view_cost_limit();
    desc->max_cost = switches & 16u ? 64.0f * fuzz_u8() : 0.0f;
}

static void aim(terrimp_camera *camera)
{
    int i;
    memset(camera, 0, sizeof *camera);
    for (i = 0; i < 3; i++) {
        camera->eye[i] = fuzz_u8() & 31u ? fuzz_good(-100.0f, 300.0f) : fuzz_float(1e6f);
        camera->forward[i] = fuzz_u8() & 31u ? fuzz_good(-1.0f, 1.0f) : fuzz_float(1.0f);
    }
    if (fuzz_u8() == 1)
        for (i = 0; i < 3; i++)
            camera->up[i] = fuzz_float(1.0f);
    camera->fov_y_rad = fuzz_u8() & 7u ? 0.0f : fuzz_float(3.0f);
    camera->width_px = fuzz_u8() & 31u ? 1280 : fuzz_size(4000);
    camera->height_px = fuzz_u8() & 31u ? 1024 : fuzz_size(4000);
    camera->z_near = fuzz_u8() & 31u ? 1.0f : fuzz_float(1.0f);
    camera->z_far = fuzz_u8() & 31u ? 1e4f : fuzz_float(1e6f);
    camera->depth_zero_to_one = (int)(fuzz_u8() & 1u);
}

/* ---- the host's buffers ---- */

/* Morph data of a node of any level, and the same mesh as a part of all and alone. */
static void check_node(const terrimp_terrain *terrain, uint32_t node)
{
    size_t ground_floats = 3u * (size_t)info.ground_vertex_count;
    size_t mesh_floats = 3u * (size_t)info.mesh_vertex_stride;
    float *ground = (float *)fuzz_take(ground_floats * sizeof *ground);
    float *mesh = (float *)fuzz_take(mesh_floats * sizeof *mesh);
    uint16_t *corners = (uint16_t *)fuzz_take(info.mesh_index_stride * sizeof *corners);
    terrimp_geomip_vertex *moves =
        (terrimp_geomip_vertex *)fuzz_take(info.ground_vertex_count * sizeof *moves);
    FUZZ_CHECK(terrimp_terrain_fill_ground(terrain, node, ground, ground_floats) == TERRIMP_OK);
    FUZZ_CHECK(fuzz_finite(ground, ground_floats));
    FUZZ_CHECK(terrimp_terrain_fill_morph(terrain, node, moves, info.ground_vertex_count)
               == TERRIMP_OK);
    FUZZ_CHECK(terrimp_terrain_fill_mesh(terrain, node, mesh, mesh_floats, corners,
                                         info.mesh_index_stride) == TERRIMP_OK);
    FUZZ_CHECK(memcmp(mesh, vertices + node * mesh_floats, mesh_floats * sizeof *mesh) == 0);
    FUZZ_CHECK(memcmp(corners, indices + (size_t)node * info.mesh_index_stride,
                      info.mesh_index_stride * sizeof *corners) == 0);
    free(ground);
    free(mesh);
    free(corners);
    free(moves);
}

static void check_facts(const terrimp_terrain *terrain, uint32_t node)
{
    terrimp_mesh_info mesh;
    terrimp_box part;
    int k;
    FUZZ_CHECK(terrimp_terrain_get_box(terrain, node, &part) == TERRIMP_OK);
    for (k = 0; k < 3; k++)
        FUZZ_CHECK(part.min[k] <= part.max[k] && part.min[k] >= info.box.min[k] &&
                   part.max[k] <= info.box.max[k]);
    FUZZ_CHECK(terrimp_terrain_get_mesh(terrain, node, &mesh) == TERRIMP_OK);
    check_mesh_range(mesh.base_vertex, mesh.first_index, mesh.index_count);
    FUZZ_CHECK(mesh.base_vertex + mesh.vertex_count <= info.mesh_vertex_count);
    FUZZ_CHECK(mesh.error >= 0.0f && mesh.error_rms >= 0.0f);
}

static void release_buffers(void)
{
    free(vertices);
    free(indices);
    free(patterns);
}

static void pull_buffers(const terrimp_terrain *terrain)
{
    size_t floats = 3u * (size_t)info.mesh_vertex_count;
    terrimp_geomip_weights *weights =
        (terrimp_geomip_weights *)fuzz_take(info.ground_vertex_count * sizeof *weights);
    uint32_t i;
    vertices = (float *)fuzz_take(floats * sizeof *vertices);
    indices = (uint16_t *)fuzz_take(info.mesh_index_count * sizeof *indices);
    patterns = (uint16_t *)fuzz_take(info.ground_index_count * sizeof *patterns);
    FUZZ_CHECK(terrimp_terrain_fill_meshes(terrain, vertices, floats, indices,
                                           info.mesh_index_count) == TERRIMP_OK);
    FUZZ_CHECK(fuzz_finite(vertices, floats));
    FUZZ_CHECK(terrimp_terrain_fill_indices(terrain, patterns, info.ground_index_count)
               == TERRIMP_OK);
    for (i = 0; i < info.ground_index_count; i++)
        FUZZ_CHECK(patterns[i] < info.ground_vertex_count);
    FUZZ_CHECK(terrimp_geomip_fill_weights(info.chunk_quads, weights)
               == TERRIMP_OK);
    free(weights);
    check_node(terrain, fuzz_u8() % info.node_count);
    for (i = 0; i < info.node_count; i++)
        check_facts(terrain, i);
}

/* ---- frames ---- */

static void draw_frame(terrimp_view *view)
{
    terrimp_callbacks callbacks;
    terrimp_stats stats;
    memset(&callbacks, 0, sizeof callbacks);
    callbacks.user = &info;
    callbacks.begin_capture = begin_capture;
    callbacks.end_capture = end_capture;
    callbacks.draw_impostor = draw_impostor;
    callbacks.draw_ground = draw_ground;
    callbacks.draw_floor = fuzz_u8() & 7u ? draw_floor : NULL;
    open_capture = impostors = captures = 0;
    FUZZ_CHECK(terrimp_view_render(view, &callbacks) == TERRIMP_OK);
    FUZZ_CHECK(!open_capture);
    FUZZ_CHECK(terrimp_view_get_stats(view, &stats) == TERRIMP_OK);
    FUZZ_CHECK(stats.impostors == (uint32_t)impostors && stats.captures == (uint32_t)captures);
    FUZZ_CHECK(fuzz_finite(&stats.z_near, 1) && fuzz_finite(&stats.z_far, 1));
}

/* Forgets the pictures of some samples, and says which. */
static void touch(const terrimp_terrain *terrain, terrimp_view *view, terrimp_rect *rect)
{
    uint32_t *nodes = (uint32_t *)fuzz_take(info.node_count * sizeof *nodes), count = 0;
    rect->x = fuzz_u8();
    rect->y = fuzz_u8();
    rect->width = fuzz_size(20);
    rect->height = fuzz_size(20);
    if (terrimp_terrain_touched(terrain, rect, (int)(fuzz_u8() & 1u), nodes, info.node_count,
                                &count) == TERRIMP_OK) {
        FUZZ_CHECK(count > 0 && count <= info.node_count);
        FUZZ_CHECK(nodes[count - 1u] == info.node_count - 1u); /* the root has every sample */
        FUZZ_CHECK(terrimp_view_touch(view, rect->x, rect->y, rect->width, rect->height)
                   == TERRIMP_OK);
    } else {
        rect->width = rect->height = 0;
    }
    free(nodes);
}

/* edit, when there is one, changes the samples of a rectangle. */
static void fly(terrimp_terrain *terrain,
                void (*edit)(terrimp_terrain *terrain, const terrimp_rect *rect))
{
    terrimp_view_desc desc;
    terrimp_view *view = NULL;
    terrimp_camera camera;
    terrimp_rect rect;
    size_t bytes;
    void *memory;
    int frames;
    describe_view(&desc);
    bytes = terrimp_view_bytes(terrain, &desc);
    FUZZ_CHECK(bytes == 0 || terrimp_view_desc_resolve(terrain, &desc, &settings) == TERRIMP_OK);
    if (bytes == 0 || bytes > GREATEST_BLOCK)
        return;
    memory = fuzz_take(bytes);
    FUZZ_CHECK(terrimp_view_init(terrain, &desc, memory, bytes - 1u, &view) == TERRIMP_E_MEMORY);
    FUZZ_CHECK(terrimp_view_init(terrain, &desc, memory, bytes, &view) == TERRIMP_OK);
    aim(&camera);
    for (frames = 0; frames < 16 && fuzz_left > 0; frames++) {
        uint32_t move = fuzz_u8();
        if (move % 4u == 0) /* a step, or a jump */
            aim(&camera);
        else
            camera.eye[move % 3u] += (float)(move % 16u) - 8.0f;
        if (move >= 250)
            FUZZ_CHECK(terrimp_view_invalidate(view) == TERRIMP_OK);
        if (move >= 240 && move < 250) {
            touch(terrain, view, &rect);
            if (edit && rect.width > 0)
                edit(terrain, &rect);
        }
        if (terrimp_view_update(view, &camera) == TERRIMP_OK)
            draw_frame(view);
    }
    free(memory);
}

#endif
