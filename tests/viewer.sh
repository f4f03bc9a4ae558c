#!/bin/sh
# Drives the viewer in a window of a virtual screen, and compares its pictures with flyover's.
# `make deps-viewer` installs what it needs; without it the tests are skipped.

cd "$(dirname "$0")/.." || exit 1
. tests/check.sh
CC=${CC:-cc}
work=build/test/viewer
mkdir -p $work

has_glfw()
{
    echo 'int main(void) { return 0; }' > $work/probe.c
    $CC -include GLFW/glfw3.h $work/probe.c -o $work/probe -lglfw -lGL > /dev/null 2>&1 &&
        command -v Xvfb > /dev/null && command -v xvfb-run > /dev/null
}

# The eye of the viewer's first frame, thirty times, so that all pictures are made.
makes_the_yardstick()
{
    for i in 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19; do
        echo "40 190 470 260 40 180"
    done > $work/start.path
    build/flyover --terrain-size 513 --size 640x480 --path $work/start.path --save-frames 19 \
        --out $work > $work/flyover.txt && mv $work/00019_auto.png $work/flyover.png
}

runs()
{
    LIBGL_ALWAYS_SOFTWARE=1 xvfb-run -a -s "-screen 0 1024x768x24" build/test_viewer $work \
        > $work/log.txt 2>&1
    code=$?
    grep -vE '^[0-9]+ passed' $work/log.txt
    return $code
}

# One line that says why, and code 2.
refuses_a_bad_file()
{
    LIBGL_ALWAYS_SOFTWARE=1 xvfb-run -a build/viewer $work/start.path > $work/out.txt 2>&1
    [ $? -eq 2 ] && [ "$(grep -c start.path $work/out.txt)" -eq 1 ]
}

if ! has_glfw; then
    skip "viewer: GLFW or Xvfb is not here; make deps-viewer installs them"
    check_report
    exit
fi
{ printf 'P5 120 90 255\n'; head -c 10800 terrimp.h; } > $work/small.pgm
check "the viewer builds" make -s viewer test_viewer flyover
check "flyover draws what the viewer begins with" makes_the_yardstick
check "the viewer does what its keys say" runs
check "the viewer refuses a file that is none" refuses_a_bad_file
check_report
