/* Sorted as machines without floats have it: what does not ask for a height of its own. */
#define TERRIMP_FIXED
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "tests/unit_sorted.h"

int main(void)
{
    RUN(sorted_needs_no_depth_buffer);
    RUN(sorted_needs_no_depth_buffer_over_mountains);
    RUN(sorted_needs_no_depth_buffer_over_hills);
    RUN(sorted_squares_meet_without_cracks);
    RUN(sorted_patterns_are_ordered);
    RUN(sorted_draws_all_that_is_seen);
    RUN(sorted_repeats_after_a_period);
    RUN(sorted_keeps_to_its_triangles);
    return check_report();
}
