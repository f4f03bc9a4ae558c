/* All unit tests: header only, no graphics.
   Build: cc -std=c99 -I. tests/unit.c -lm -o unit && ./unit [part of a test's name]
   Expect: a last line `N passed, 0 failed`, in about 25 s when optimised. */
#include <stdlib.h>

/* Every allocation of the library is counted: what says it allocates nothing is held to it. */
static size_t unit_allocations;

static void *unit_malloc(size_t bytes)
{
    unit_allocations++;
    return malloc(bytes);
}

#define TERRIMP_MALLOC(bytes) unit_malloc(bytes)
#define TERRIMP_FREE(pointer) free(pointer)
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "check.h"
#include "unit_heightfield.h"
#include "unit_quadtree.h"
#include "unit_geomipmap.h"
#include "unit_simplifier.h"
#include "unit_camera.h"
#include "unit_impostor.h"
#include "unit_atlas.h"
#include "unit_terrain.h"
#include "unit_visibility.h"
#include "unit_view.h"
#include "unit_numbers.h"
#include "unit_sorted.h"
#include "unit_bake.h"
#include "unit_bad_input.h"
#include "unit_pages.h"
#include "unit_layers.h"
#include "unit_placement.h"
#include "unit_golden.h"

int main(int argc, char **argv)
{
    check_only = argc > 1 ? argv[1] : NULL;
    if (check_only && strcmp(check_only, "golden") == 0) {
        golden_print();
        return check_bad != 0;
    }
    heightfield_tests();
    quadtree_tests();
    geomipmap_tests();
    simplifier_tests();
    camera_tests();
    impostor_tests();
    atlas_tests();
    terrain_tests();
    numbers_tests();
    bake_tests();
    visibility_tests();
    view_tests();
    sorted_tests();
    pages_tests();
    bad_input_tests();
    layers_tests();
    placement_tests();
    golden_tests();
    return check_report();
}
