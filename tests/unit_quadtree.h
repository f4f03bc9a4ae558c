/* Tests of the Quadtree room. */
#include "unit_oracle.h"

/* A random tree; its samples are never read. */
static void tree_make(terrimp_quadtree *tree)
{
    static const float sample[1] = {0.0f};
    terrimp_heightfield field;
    memset(&field, 0, sizeof field);
    field.samples = sample;
    field.width = random_range(2, 100);
    field.depth = random_range(2, 100);
    field.spacing_x = 1.5f;
    field.spacing_z = 0.75f;
    field.origin_x = -40.0f;
    CHECK(terrimp_quadtree_init(&field, random_range(2, 8) * 2u, tree) == TERRIMP_OK);
}

/* Numbers count the places level by level from the finest up, each row by row; a node's neighbours
   are those whose places differ by one; its parent is the one whose box holds it. */
static void nodes_are_numbered_and_related_by_their_places(void)
{
    int round;
    for (round = 0; round < 30; round++) {
        terrimp_quadtree t;
        uint32_t level, x, z, number = 0;
        tree_make(&t);
        for (level = 0; level < t.level_count; level++)
            for (z = 0; z < t.level_z[level]; z++)
                for (x = 0; x < t.level_x[level]; x++, number++) {
                    terrimp_node n = terrimpi_tree_node(&t, number), other, back;
                    terrimp_box box, around;
                    int side;
                    CHECK(n.number == number && n.level == level && n.x == x && n.z == z);
                    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++) {
                        int first = side == TERRIMP_SIDE_Z0 ? z == 0 : side == TERRIMP_SIDE_X0
                                  ? x == 0 : side == TERRIMP_SIDE_Z1 ? z + 1u == t.level_z[level]
                                  : x + 1u == t.level_x[level];
                        CHECK(terrimpi_tree_beyond(&t, &n, side, &other) == !first);
                        if (first)
                            continue;
                        CHECK(terrimpi_tree_beyond(&t, &other, side ^ 1, &back));
                        CHECK(memcmp(&back, &n, sizeof n) == 0);
                    }
                    terrimpi_tree_box(&t, &n, 1.0f, 2.0f, &box);
                    CHECK(box.min[0] < box.max[0] && box.min[2] < box.max[2]);
                    CHECK(box.min[1] == 1.0f && box.max[1] == 2.0f);
                    if (level + 1u == t.level_count)
                        continue;
                    other = terrimpi_tree_parent(&t, &n);
                    terrimpi_tree_box(&t, &other, 1.0f, 2.0f, &around);
                    CHECK(box.min[0] >= around.min[0] && box.max[0] <= around.max[0]);
                    CHECK(box.min[2] >= around.min[2] && box.max[2] <= around.max[2]);
                }
        CHECK(number == t.node_count);
    }
}

/* A walk that enters everything comes to each node once, after its parent, and no chunk that it
   comes to later hides an earlier one. */
static void a_walk_sees_all_nodes_closest_first(void)
{
    int round;
    for (round = 0; round < 40; round++) {
        terrimp_quadtree t;
        terrimpi_tree_walk walk;
        terrimpi_tree_visit v;
        terrimp_box *boxes;
        uint32_t count = 0, chunks = 0, i;
        uint8_t *seen;
        float eye[3];
        tree_make(&t);
        seen = (uint8_t *)calloc(t.node_count, 1);
        boxes = (terrimp_box *)malloc(t.level_first[1] * sizeof *boxes);
        eye[0] = random_float(-60.0f, 120.0f);
        eye[1] = random_float(-100.0f, 100.0f);
        eye[2] = random_float(-10.0f, 80.0f);
        terrimpi_tree_begin(&walk, &t, eye, 5);
        while (terrimpi_tree_next(&walk, &v)) {
            CHECK(v.planes == 5 && seen[v.node.number]++ == 0);
            if (v.node.level + 1u < t.level_count)
                CHECK(seen[terrimpi_tree_parent(&t, &v.node).number]);
            terrimpi_tree_enter(&walk, &v);
            count++;
            if (v.node.level > 0)
                continue;
            terrimpi_tree_box(&t, &v.node, 0.0f, 0.0f, &boxes[chunks]);
            for (i = 0; i < chunks; i++)
                CHECK(oracle_cannot_hide(&boxes[chunks], &boxes[i], eye));
            chunks++;
        }
        CHECK(count == t.node_count);
        free(seen);
        free(boxes);
    }
}

static inline void quadtree_tests(void)
{
    RUN(nodes_are_numbered_and_related_by_their_places);
    RUN(a_walk_sees_all_nodes_closest_first);
}
