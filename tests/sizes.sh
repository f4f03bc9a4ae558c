#!/bin/sh
# Prints the size of the library's code and tables at -Os, without libc and libm, for Cortex-M4,
# Cortex-M0 and the machine it runs on. The run-time part is TERRIMP_NO_BUILD: terrains come from
# bakes. What a host does not call is left out by its linker: two hosts are shown, one that only
# opens, updates and renders, and one that fills its buffers and asks for statistics too. The first
# is shown again without the options that a small machine may leave out, and judged.
# Fails when the run-time part needs double or divides 64 bits on a machine that has neither.

cd "$(dirname "$0")/.." || exit 1
work=build/test/sizes
mkdir -p $work
flags="-std=c99 -Os -DNDEBUG -DTERRIMP_NO_MALLOC -ffunction-sections -fdata-sections -I."
leave_out="-DTERRIMP_NO_SPLIT -DTERRIMP_NO_MORPH"
aim=24576
draws="terrimp_terrain_open_bytes terrimp_terrain_open terrimp_view_bytes terrimp_view_init
       terrimp_view_update terrimp_view_render"
fills="$draws terrimp_terrain_get_info terrimp_terrain_fill_indices terrimp_terrain_fill_ground
       terrimp_terrain_fill_meshes terrimp_view_get_stats terrimp_view_invalidate"
# What compilers for ARM call for them, by their own names and by those of other machines.
heavy='^(__aeabi_(u?ldivmod|d[a-z0-9]+|[a-z]+2d)|__(u?div|u?mod)di3|__[a-z]*df[a-z0-9]*)$'
failed=0

row() # name, what, object, "judged" or ""
{
    "$size" -B "$3" | awk -v name="$1" -v what="$2" -v aim=$aim -v judged="$4" 'NR == 2 {
        printf "%-11s %-50s %7d bytes of code and tables, %d of data%s\n", name, what, $1, $2 + $3,
               judged ? ($1 <= aim ? "  (within the aim)" : "  (over the aim)") : "" }'
}

linked() # prefix, object, functions...: what is left of it in a host that calls these
{
    prefix=$1
    object=$2
    shift 2
    roots=
    for name in "$@"; do
        roots="$roots -u $name"
    done
    "${prefix}ld" -r --gc-sections -e $1 $roots "$object" -o $work/part.o
}

machine() # name, prefix, flags, "judged" or ""
{
    compiler=$2gcc
    size=$2size
    if ! command -v "$compiler" > /dev/null; then
        echo "$1: $compiler is not installed"
        return
    fi
    object=$work/$1.o
    compile="$compiler $3 $flags -DTERRIMP_IMPLEMENTATION -x c -c terrimp.h"
    $compile -o "$object" || exit 1
    row "$1" "everything" "$object"
    $compile -DTERRIMP_NO_BUILD -o "$object" || exit 1
    row "$1" "run time, every function of it" "$object"
    linked "$2" "$object" $fills || exit 1
    row "$1" "run time, a host that also fills buffers" $work/part.o
    linked "$2" "$object" $draws || exit 1
    row "$1" "run time, a host that opens, updates, renders" $work/part.o "$4"
    largest "$2" $work/part.o
    has_none_of "$1" "$2" $work/part.o pages '^terrimpi_page_'
    has_none_of "$1" "$2" $work/part.o "terrain without end" '^terrimpi_tiled_'
    has_none_of "$1" "$2" $work/part.o "exact depth" '^terrimpi_impostor_place_'
    has_none_of "$1" "$2" $work/part.o "pieces of nodes" '^terrimpi_capture_draw_rows'
    has_none_of "$1" "$2" $work/part.o "the rule BOUND" '^terrimpi_mip_bound_'
    $compile -DTERRIMP_NO_BUILD $leave_out -o $work/small.o || exit 1
    linked "$2" $work/small.o $draws || exit 1
    row "$1" "without splits, morphing" $work/part.o "$4"
    [ -z "$2" ] || needs_nothing_heavy "$1" "$2" "$object"
    $compile -DTERRIMP_NO_BUILD -DTERRIMP_FIXED -o $work/fixed.o || exit 1
    linked "$2" $work/fixed.o terrimp_sorted_begin terrimp_sorted_init terrimp_sorted_next || exit 1
    row "$1" "Sorted alone, with TERRIMP_FIXED" $work/part.o
    linked "$2" $work/fixed.o terrimp_sorted_next || exit 1
    row "$1" "of that what runs for each triangle" $work/part.o
    [ -z "$2" ] || needs_no_float "$1" "$2" $work/part.o
}

# What a host does not ask for it has no code of; of pages that which finds out that there are none.
has_none_of() # name, prefix, object, what, the functions of it
{
    found=$("$2nm" "$3" | awk -v of="$5" '$3 ~ of && $3 != "terrimpi_page_of" { print $3 }')
    [ -n "$found" ] || { echo "    has no code for $4"; return; }
    echo "    FAILED: the host has code for $4:" $found
    failed=1
}

# With TERRIMP_FIXED what runs for each triangle has no floats, in software or in registers.
needs_no_float() # name, prefix, object
{
    calls=$("$2objdump" -dr "$3" | grep -E 'R_ARM.*__aeabi_[df]|[[:space:]]v[a-z]+[.].*f32')
    [ -n "$calls" ] || { echo "    uses no floats"; return; }
    echo "    FAILED: what runs for each triangle uses floats:" $calls
    failed=1
}

# Every function of the run-time part, not only those that a host calls.
needs_nothing_heavy() # name, prefix, object
{
    calls=$("$2nm" -u "$3" | awk '{ print $2 }' | grep -E "$heavy")
    [ -n "$calls" ] || { echo "    calls neither double nor 64-bit division"; return; }
    echo "    FAILED: the run-time part calls" $calls
    failed=1
}

largest() # prefix, object
{
    $1nm -S --size-sort "$2" | grep -i ' t ' | tail -n 5 | while read -r address bytes type name; do
        echo "$((0x$bytes)) $name"
    done | sort -n -r | awk '{ printf "%s%s %d", NR == 1 ? "    largest: " : ", ", $2, $1 }
                              END { print "" }'
}

echo "Aim for the run-time part on Cortex-M4: at most $aim bytes."
machine cortex-m4 arm-none-eabi- "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16" judged
machine cortex-m0 arm-none-eabi- "-mcpu=cortex-m0 -mthumb -mfloat-abi=soft"
machine "$(uname -m)" "" ""
exit $failed
