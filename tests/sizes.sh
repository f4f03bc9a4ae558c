#!/bin/sh
# Prints the size of the library's code and tables at -Os, without libc and libm, for Cortex-M4,
# Cortex-M0 and the machine it runs on. The run-time part is what a host links that updates and
# renders a view: everything else is left out by the linker, or by TERRIMP_NO_BUILD.

cd "$(dirname "$0")/.." || exit 1
work=build/test/sizes
mkdir -p $work
flags="-std=c99 -Os -DNDEBUG -DTERRIMP_NO_MALLOC -ffunction-sections -fdata-sections -I."
aim=24576
run_time="terrimp_view_desc_resolve terrimp_view_bytes terrimp_view_init terrimp_view_update
          terrimp_view_render terrimp_view_get_stats terrimp_view_invalidate
          terrimp_terrain_get_info terrimp_terrain_get_box terrimp_terrain_get_mesh
          terrimp_terrain_fill_indices terrimp_terrain_fill_ground terrimp_terrain_fill_meshes"
if grep -q TERRIMP_NO_BUILD terrimp.h; then
    no_build=1
fi

row() # name, what, object
{
    "$size" -B "$3" | awk -v name="$1" -v what="$2" -v aim=$aim 'NR == 2 {
        judged = what ~ /run time/ && name == "cortex-m4"
        printf "%-11s %-48s %7d bytes of code and tables, %d of data%s\n", name, what, $1, $2 + $3,
               judged ? ($1 <= aim ? "  (within the aim)" : "  (over the aim)") : "" }'
}

machine() # name, prefix, flags
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
    # A name that the library does not have, or no longer, is no root.
    roots=
    for name in $run_time; do
        ! $2nm "$object" | grep -q " T $name\$" || roots="$roots -u $name"
    done
    $2ld -r --gc-sections -e terrimp_view_update $roots "$object" -o $work/part.o || exit 1
    row "$1" "run time: what a view uses, by the linker" $work/part.o
    if [ -n "$no_build" ]; then
        $compile -DTERRIMP_NO_BUILD -o "$object" || exit 1
        row "$1" "run time: TERRIMP_NO_BUILD, every function of it" "$object"
        $2ld -r --gc-sections -e terrimp_view_update $roots "$object" -o $work/part.o || exit 1
        row "$1" "run time: both" $work/part.o
    fi
    largest "$2" $work/part.o
}

largest() # prefix, object
{
    $1nm -S --size-sort "$2" | grep -i ' t ' | tail -n 5 | while read -r address bytes type name; do
        echo "$((0x$bytes)) $name"
    done | sort -n -r | awk '{ printf "%s%s %d", NR == 1 ? "    largest: " : ", ", $2, $1 }
                              END { print "" }'
}

echo "Aim for the run-time part on Cortex-M4: at most $aim bytes."
machine cortex-m4 arm-none-eabi- "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16"
machine cortex-m0 arm-none-eabi- "-mcpu=cortex-m0 -mthumb -mfloat-abi=soft"
machine "$(uname -m)" "" ""
[ -n "$no_build" ] || echo "(The library has no TERRIMP_NO_BUILD.)"
