#!/bin/sh
# Runs the examples as their reader would, and looks at what they say.

cd "$(dirname "$0")/.." || exit 1
. tests/check.sh
CC=${CC:-cc}
work=build/test/examples
rm -rf $work
mkdir -p $work/pictures

# ---- minimal: no graphics, one command

build_line() # source: the command in its first comment
{
    sed -n 's/^ *Build: *cc //p' "$1" | head -n 1 | sed "s|-o |-o $work/|"
}

minimal_runs()
{
    $CC $(build_line examples/minimal.c) && $work/minimal > $work/minimal.txt
}

# Its lines: "frame N", a line for each capture, "N impostors, N chunks of ground".
captures_in_frames() # first last
{
    awk -v first="$1" -v last="$2" '$1 == "frame" { frame = $2 }
        $1 == "capture" && frame >= first && frame <= last { n++ }
        END { print n + 0 }' $work/minimal.txt
}

# Pictures are made at once, and the last frame draws some of them.
minimal_captures()
{
    early=$(captures_in_frames 0 0)
    late=$(captures_in_frames 1 7)
    echo "minimal: $early captures in frame 0, $late in the 7 frames after it"
    [ "$early" -gt 0 ] && [ "$(awk '$2 == "impostors," { n = $1 } END { print n }' \
        $work/minimal.txt)" -gt 0 ]
}

# Each frame draws something, and no impostor more often than the 64 chunks that there are.
minimal_draws_all()
{
    awk '$2 == "impostors," { frames++; bad += $1 + $3 < 1 || $1 > 64 }
        END { exit bad || frames != 8 }' $work/minimal.txt
}

minimal_repeats()
{
    $work/minimal | cmp - $work/minimal.txt
}

check "minimal builds with the command in its first comment, and runs" minimal_runs
check "minimal captures, and draws its pictures" minimal_captures
check "minimal draws something in each of its 8 frames" minimal_draws_all
check "minimal prints the same again" minimal_repeats

# ---- parallel_build: the same bytes with any number of threads

parallel_repeats() # threads
{
    build/parallel_build "$1" 300 > $work/parallel.txt && cat $work/parallel.txt &&
        grep -q "the same bytes" $work/parallel.txt
}

# ---- pages and stream: parts side by side are the whole, which is flown over from a slow disk

pages_in_parts()
{
    rm -f $work/whole.pages $work/parts.pages
    build/pages $work/whole.pages --made 500 --block 2 --threads 2 | grep -a ": ok, 500 x 500" &&
        build/pages $work/parts.pages --made 500 --block 2 --part 1,2 > /dev/null &&
        build/pages $work/parts.pages --made 500 --block 2 --part 0,2 > /dev/null &&
        build/pages $work/parts.pages --made 500 --block 2 > /dev/null &&
        cmp $work/whole.pages $work/parts.pages
}

pages_go_on()
{
    rm -f $work/stopped.pages
    build/pages $work/stopped.pages --made 500 --block 2 > /dev/null &
    builder=$!
    while kill -0 $builder && ! [ "$(wc -c < $work/stopped.pages)" -gt 300000 ]; do :; done
    kill -9 $builder
    wait $builder || ! cmp -s $work/whole.pages $work/stopped.pages &&
        build/pages $work/stopped.pages --made 500 --block 2 > /dev/null &&
        cmp $work/whole.pages $work/stopped.pages
}

# A folder with a tile that has voids.
pages_of_tiles()
{
    mkdir -p $work/tiles
    { head -c 1000000 /dev/zero; printf '\200\000\200\000\001\000\200\000'
      head -c $((1201 * 1201 * 2 - 1000008)) /dev/zero; } > $work/tiles/N42E001.hgt
    build/pages $work/tiles.pages $work/tiles | grep -a ": ok, 1201 x 1201"
}

stream_flies()
{
    build/stream $work/whole.pages --frames 60 --latency 5 --slots 60 > $work/stream.txt &&
        grep "frames lacked a page" $work/stream.txt &&
        awk '/slots full/ { n = $7 } END { exit !(n > 4) }' $work/stream.txt
}

# ---- bake: a picture file as a DEM, to a file and to C source that holds the same bytes

bakes()
{
    { printf 'P5 150 90 255\n'; head -c 13500 terrimp.h; } > $work/small.pgm
    build/bake $work/small.pgm $work/small.bake --chunk 16 | grep "it opens" &&
        build/bake $work/small.pgm $work/small.h --chunk 16 --c small > /dev/null
}

bake_source_holds_the_bake()
{
    printf '%s\n' '#include <stdio.h>' '#include "small.h"' 'int main(void) {' \
        'return fwrite(small, sizeof small, 1, stdout) != 1; }' > $work/small.c
    $CC $work/small.c -o $work/small && $work/small > $work/small.out &&
        head -c "$(wc -c < $work/small.bake)" $work/small.out | cmp - $work/small.bake
}

bake_refuses()
{
    : > $work/empty.pgm
    build/bake $work/empty.pgm $work/none 2> $work/err.txt
    [ $? -eq 2 ] && [ "$(wc -l < $work/err.txt)" -eq 1 ] && [ ! -e $work/none ]
}

# ---- geomip: runs, and leaves a picture

geomip_runs()
{
    rm -f build/geomip.png
    build/geomip > $work/geomip.txt && [ -s build/geomip.png ]
}

# ---- hosts of other kinds: each compares its pictures with its own full mesh

# Leaves its picture beside itself, and nothing where it is called.
host_runs() # name
{
    rm -f build/$1.png
    build/$1 > $work/$1.txt && [ -s build/$1.png ] && [ ! -e $1.png ] ||
        { cat $work/$1.txt; false; }
}

costs_are_above_0()
{
    build/costs > $work/costs.txt || { cat $work/costs.txt; return 1; }
    awk '$3 == "us" { costs += $2 > 0 && $2 < 1e6 && $4 > 0 } $3 == "costs:" { frames++ }
        END { exit costs != 5 || frames != 2 }' $work/costs.txt
}

# OpenGL functions that fixed_function calls and OpenGL 1.1 lacks. Whoever needs another old one
# adds it to the list.
newer_than_opengl_1_1()
{
    nm -u build/fixed_function.o | awk '$2 ~ /^gl/ { print $2 }' | grep -vxE \
        'gl(AlphaFunc|BindTexture|BlendFunc|Clear|ClearColor|Color4f|CopyTexSubImage2D)|'\
'gl(DepthFunc|DepthMask|Disable|DrawElements|Enable|EnableClientState|GenTextures|GetError)|'\
'gl(LoadIdentity|LoadMatrixf|MatrixMode|MultMatrixf|PixelStorei|PopMatrix|PushMatrix|Scalef)|'\
'gl(Scissor|ShadeModel|TexCoordPointer|TexEnvi|TexImage2D|TexParameteri|Translatef)|'\
'gl(ClipPlane|VertexPointer|Viewport|ColorMask|Begin|End|TexCoord2f|Vertex2f|PolygonStipple)'
}

# ---- flyover: the pictures are looked at by tests/render.c, here it is its manners

fly()
{
    build/flyover "$@" > $work/out.txt 2> $work/err.txt
}

# Bad input: one line that says why, and exit code 2.
refuses() # options...
{
    fly --frames 1 --size 64x48 --terrain-size 129 "$@"
    code=$?
    [ $code -eq 2 ] && [ "$(wc -l < $work/err.txt)" -eq 1 ] && return
    echo "flyover $*: code $code"
    head -n 3 $work/err.txt
    false
}

flies_quietly()
{
    fly --frames 3 --size 160x120 --terrain-size 257 --save-every 1 --out $work/pictures \
        --stats $work/statistics.tsv || { cat $work/err.txt; return 1; }
    [ ! -s $work/err.txt ] || { echo "on standard error:"; head -n 3 $work/err.txt; }
}

# A line a frame (and at most one of column names), each with the same number of columns, >= 8.
statistics_are_a_table()
{
    awk -F '\t' 'NR == 1 { columns = NF } NF != columns || NF < 8 { exit 1 }
        $1 ~ /^[0-9]+$/ { frames++ } END { exit frames != 3 || NR > 4 }' $work/statistics.tsv
}

pictures_are_png()
{
    count=0
    for picture in $work/pictures/*.png; do
        [ "$(head -c 4 "$picture" | tail -c 3)" = PNG ] || return 1
        count=$((count + 1))
    done
    [ $count -ge 3 ]
}

says_key_value_lines()
{
    grep -qE '^ms_median [0-9.]+' $work/out.txt || { cat $work/out.txt; false; }
}

# Options whose file is missing: they do nothing, and that is said in one line.
says_what_is_ignored()
{
    fly --frames 1 --size 64x48 --terrain-size 129 --big-endian &&
        [ "$(wc -l < $work/err.txt)" -eq 1 ] &&
        grep -q -e "--big-endian is ignored" $work/err.txt
}

# An eye that looks away from the terrain: that is said, and nothing is compared.
says_that_nothing_is_in_sight()
{
    echo "0 5000 0 0 9000 1" > $work/up.path
    fly --size 64x48 --terrain-size 129 --compare --path $work/up.path &&
        grep -q "in sight in no frame" $work/err.txt && ! grep -q psnr $work/out.txt
}

# Options that README.md speaks of and flyover does not know.
unknown_options()
{
    { build/flyover --help; cat examples/pages.c examples/stream.c; } |
        grep -oE -e '--[a-z][a-z-]+' | sort -u > $work/options
    grep -oE -e '(^|[^-a-z])--[a-z][a-z-]+' README.md | sed 's/^[^-]//' | sort -u |
        comm -23 - $work/options
}

check "make builds every example" make -s all
check "parallel_build makes the same bytes with 2 threads" parallel_repeats 2
check "parallel_build makes the same bytes with 5 threads" parallel_repeats 5
check "pages makes the same file in parts as at once" pages_in_parts
check "pages goes on where it was killed" pages_go_on
check "pages fills the voids of a tile of a folder" pages_of_tiles
check "stream flies over it with few slots and a slow disk" stream_flies
check "bake makes a bake that opens, and C source" bakes
check "bake writes C source that holds the bake" bake_source_holds_the_bake
check "bake refuses an empty file, in one line" bake_refuses
if [ -x build/geomip ]; then
    check "geomip draws its frames and leaves a picture" geomip_runs
fi
check "software draws its frames without a GPU, close to the full mesh" host_runs software
check "sorted draws the same frames without and with a depth buffer" host_runs sorted
check "prepared draws pictures from memory, close to the full mesh" host_runs prepared
if [ -x build/town ]; then
    check "town keeps to its budget of triangles and shows no hole" host_runs town
fi
if [ -x build/fixed_function ]; then
    check "fixed_function draws its frames, close to the full mesh" host_runs fixed_function
    check "fixed_function calls nothing newer than OpenGL 1.1" \
        prints_nothing newer_than_opengl_1_1
fi
if [ -x build/costs ]; then
    check "costs measures five costs above 0, and views take them" costs_are_above_0
fi
check "conventions: every one draws what plain OpenGL draws" build/conventions
check "day: a day of light makes no picture necessary" build/day

if [ -x build/cpp_host ]; then
    check "cpp_host draws its frames, close to the full mesh" host_runs cpp_host
else
    skip "cpp_host: there is no C++ compiler"
fi
if [ -x build/flyover ]; then
    check "flyover flies over its own terrain" prints_nothing flies_quietly
    check "flyover writes a line of statistics a frame" statistics_are_a_table
    check "flyover saves the pictures that were asked for" pictures_are_png
    check "flyover ends with a summary" says_key_value_lines
    head -c 100 Makefile > $work/short.hgt
    : > $work/empty.pgm
    check "README.md names options that the programs have" prints_nothing unknown_options
    check "flyover says which options do nothing" says_what_is_ignored
    check "flyover says when there is nothing to see" says_that_nothing_is_in_sight
    printf 'ncols 2\nnrows 2\n1 2 3' > $work/short.asc
    printf '\211PNG\r\n\032\nhello' > $work/bad.png
    printf 'II*\000hello' > $work/bad.tif
    printf 'abc' > $work/odd.r16
    check "flyover refuses a grid that is cut short" refuses --dem $work/short.asc
    check "flyover refuses a PNG that is none" refuses --dem $work/bad.png
    check "flyover refuses a TIFF that is none" refuses --dem $work/bad.tif
    check "flyover refuses raw samples of an odd length" refuses --dem $work/odd.r16
    check "flyover refuses an unknown option" refuses --no-such-option
    check "flyover refuses a missing file" refuses --dem $work/missing.hgt
    check "flyover refuses a .hgt of a wrong length" refuses --dem $work/short.hgt
    check "flyover refuses an empty file" refuses --dem $work/empty.pgm
    check "flyover refuses a size of nothing" refuses --size 0x0
    check "flyover refuses a number that is none" refuses --fov wide
    check "flyover refuses an option without its value" refuses --frames
    check "flyover refuses a mode that it lacks" refuses --mode best
else
    check "there is a flyover" false
fi
check_report
