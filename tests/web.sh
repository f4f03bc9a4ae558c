#!/bin/sh
# Opens the page of the viewer in a headless browser, uses it, and compares its picture with
# flyover's. `make deps-web` installs what it needs; without it the tests are skipped.

cd "$(dirname "$0")/.." || exit 1
. tests/check.sh
work=build/test/web
mkdir -p $work
browser=${CHROMIUM:-chromium}

for tool in emcc node $browser; do
    command -v $tool > /dev/null && continue
    skip "the page: $tool is not here; make deps-web installs it"
    check_report
    exit
done

# Where the page begins, twenty times, so that all pictures are made.
makes_the_yardstick()
{
    for i in 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19; do
        echo "40 190 470 260 40 180"
    done > $work/start.path
    build/flyover --terrain-size 513 --size 640x480 --path $work/start.path --save-frames 19 \
        --atlas 2048 --out $work > $work/flyover.txt && mv $work/00019_auto.png $work/flyover.png
}

runs()
{
    limit=
    command -v timeout > /dev/null && limit="timeout 240"
    CHROMIUM=$browser $limit node tests/web.js $work > $work/log.txt 2>&1
    code=$?
    cat $work/log.txt | grep -vE '^[0-9]+ passed, 0 failed'
    return $code
}

is_like_flyover()
{
    psnr=$(build/compare_pictures $work/web.png $work/flyover.png) || return
    echo "the page and flyover: $psnr dB"
    awk -v psnr="$psnr" 'BEGIN { exit !(psnr >= 40) }'
}

# Compressed, of what the browser loads.
is_small()
{
    bytes=$(cat build/web/viewer.js build/web/viewer.wasm build/web/index.html | gzip -9 | wc -c)
    echo "the page: $bytes bytes compressed"
    [ "$bytes" -le 600000 ]
}

{ printf 'P5 120 90 255\n'; head -c 10800 terrimp.h; } > $work/small.pgm
check "the page builds" make -s web flyover compare_pictures
check "the page is at most 600 KB" is_small
check "flyover draws what the page begins with" makes_the_yardstick
check "the page does what its buttons say" runs
check "the page's picture is that of flyover" is_like_flyover
check_report
