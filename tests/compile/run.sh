#!/bin/sh
# Compiles the header as every host may, with warnings as errors, and runs what comes out:
# each compiler that is here, each standard, each way to include and configure the library.
# With the argument "all": every standard with and without optimisation, and a line a check.

cd "$(dirname "$0")/../.." || exit 1
[ "$1" = all ] && check_every=1
. tests/check.sh
here=tests/compile
work=build/test/compile
mkdir -p $work

c_strict="-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wdouble-promotion
          -Wcast-qual -Wundef -Wvla -Wstrict-prototypes -Wmissing-prototypes -Wc++-compat -Werror"
cpp_strict="-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror"

# builds_and_runs "compiler and flags" sources...
builds_and_runs()
{
    command=$1
    shift
    for source in "$@"; do
        set -- "$@" $here/$source
        shift
    done
    $command -I. "$@" -o $work/program -lm && $work/program
}

# ways "name" "compiler and flags": every way to include and configure the library.
ways()
{
    freestanding=-ffreestanding
    case $1 in
    clang++*) freestanding= ;; # it would mangle the name of main
    esac
    check "$1: included several times"      builds_and_runs "$2" twice.c
    check "$1: inside extern C"             builds_and_runs "$2" extern_c.c
    check "$1: after macros like windows.h" builds_and_runs "$2" windows.c
    check "$1: without malloc"              builds_and_runs "$2" no_malloc.c
    check "$1: as without a system"         builds_and_runs "$2 $freestanding" bare.c
    check "$1: without building, from a bake" builds_and_runs "$2" no_build.c bake_maker.c
    check "$1: the same without options for small machines" \
        builds_and_runs "$2 -DTERRIMP_NO_SPLIT -DTERRIMP_NO_MORPH" \
        no_build.c bake_maker.c
    check "$1: in two files"                builds_and_runs "$2" unit_a.c unit_b.c
    check "$1: private to each of two files" builds_and_runs "$2" static_a.c static_b.c
    check "$1: every macro replaced" builds_and_runs "$2 -Wno-unused-function" custom.c
}

# standards "compiler and flags" "optimisation" standards...
standards()
{
    compiler=$1
    level=$2
    shift 2
    for standard in "$@"; do
        check "${compiler%% *} $standard $level" \
            builds_and_runs "$compiler $level -std=$standard" plain.c
    done
}

compilers() # C compiler, C++ compiler
{
    if ! command -v "$1" > /dev/null; then
        skip "$1: it is not installed"
        return
    fi
    standards "$1 $c_strict" -O0 c99 c11 c17
    standards "$1 $c_strict" -O2 c99 ${check_every:+c11 c17}
    standards "$1 $c_strict" -O3 c99
    standards "$1 $c_strict" -Os c99
    ways "$1 c99" "$1 -O0 -std=c99 $c_strict"

    if ! command -v "$2" > /dev/null; then
        skip "$2: it is not installed"
        return
    fi
    standards "$2 -x c++ $cpp_strict" -O0 c++98 c++11 c++17 c++20
    standards "$2 -x c++ $cpp_strict" -O2 c++98 ${check_every:+c++11 c++17 c++20}
    ways "$2 c++98" "$2 -x c++ -O0 -std=c++98 $cpp_strict"
    [ -z "$check_every" ] || ways "$2 c++17" "$2 -x c++ -O2 -std=c++17 $cpp_strict"
}

compilers gcc g++
compilers clang clang++

for compiler in gcc clang; do
    if command -v $compiler > /dev/null; then
        check "$compiler: Sorted without floats keeps its laws" \
            builds_and_runs "$compiler -O1 -std=c99 -Wno-unused-function" fixed.c
        check "$compiler -ffast-math: NaN and infinity are found" \
            builds_and_runs "$compiler -O2 -ffast-math" fast_math.c
    fi
done

if command -v tcc > /dev/null; then
    check "tcc" builds_and_runs "tcc -Wall -Werror" plain.c
    check "tcc: in two files" builds_and_runs "tcc -Wall -Werror" unit_a.c unit_b.c
else
    skip "tcc: it is not installed"
fi

echo 'int main(void) { return 0; }' > $work/probe.c
if gcc -m32 $work/probe.c -o $work/probe > /dev/null 2>&1; then
    check "gcc -m32" builds_and_runs "gcc -m32 -O2 -std=c99 $c_strict" plain.c
else
    skip "32 bits: gcc has no libraries for it"
fi
check_report
