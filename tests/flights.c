/* The unit tests that fly: what views, sets, pages and painter's order show from many eyes, frame
   after frame. Header only, no graphics; all else is in unit.c.
   Build: cc -std=c99 -O1 -I. tests/flights.c -lm -o flights && ./flights [part of a test's name]
   Expect: a last line `N passed, 0 failed`, in about half a minute; without -O1, in two.
   With TERRIMP_LONG in the environment some tests repeat more often. */
#include "unit_library.h"

#include "check.h"
#include "unit_geomipmap.h"
#include "unit_visibility.h"
#include "unit_view.h"
#include "unit_numbers.h"
#include "unit_sorted.h"
#include "unit_bake.h"
#include "unit_pages.h"
#include "unit_placement.h"
#include "unit_golden.h"

int main(int argc, char **argv)
{
    check_only = argc > 1 ? argv[1] : NULL;
    if (check_only && strcmp(check_only, "golden") == 0) {
        golden_print();
        return check_bad != 0;
    }
    geomipmap_flights();
    visibility_tests();
    view_tests();
    numbers_tests();
    sorted_tests();
    bake_flights();
    pages_flights();
    placement_flights();
    golden_tests();
    return check_report();
}
