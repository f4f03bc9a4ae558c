/* Unit tests, room by room: header only, no graphics. What flies is in flights.c.
   Build: cc -std=c99 -I. tests/unit.c -lm -o unit && ./unit [part of a test's name]
   Expect: a last line `N passed, 0 failed`, in about 10 s when optimised. */
#include "unit_library.h"

#include "check.h"
#include "unit_heightfield.h"
#include "unit_quadtree.h"
#include "unit_geomipmap.h"
#include "unit_simplifier.h"
#include "unit_camera.h"
#include "unit_impostor.h"
#include "unit_atlas.h"
#include "unit_terrain.h"
#include "unit_bake.h"
#include "unit_pages.h"
#include "unit_bad_input.h"
#include "unit_layers.h"
#include "unit_placement.h"

int main(int argc, char **argv)
{
    check_only = argc > 1 ? argv[1] : NULL;
    heightfield_tests();
    quadtree_tests();
    geomipmap_tests();
    simplifier_tests();
    camera_tests();
    impostor_tests();
    atlas_tests();
    terrain_tests();
    bake_tests();
    pages_tests();
    bad_input_tests();
    layers_tests();
    placement_tests();
    return check_report();
}
