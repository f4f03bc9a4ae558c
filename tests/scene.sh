#!/bin/sh
# Measures what stands around the terrain (houses, seas, light, cameras, conventions, edits, tiles)
# and writes tests/results/scene.md: what was, what is asked, what is. Each figure comes from a
# program of the project, which also judges it.
# Use: make scene-table       in a quarter of an hour; SIDES='1025 8193' for other terrains of edits

cd "$(dirname "$0")/.." || exit 1
logs=build/bench/scene
out=tests/results/scene.md
mkdir -p $logs
${MAKE:-make} -s build/render build/conventions build/unit build/flights build/bench_edits || exit 1

measure() # name, program and its arguments
{
    name=$1
    shift
    echo "$*"
    "$@" > $logs/$name.log 2>&1 || { tail -5 $logs/$name.log; exit 1; }
}
measure houses build/render houses_and_seas
measure conventions build/conventions
measure cameras build/render no_camera_sees_a_hole
measure tiles build/render terrains_side_by_side
measure relit build/render pictures_lit_when_drawn
measure pop build/render renewed_light
measure day build/flights a_day_costs
measure origin build/unit pictures_stay_in_place
measure failing build/flights capture
measure edits build/bench_edits ${SIDES:-1025 2049 4097}

# The numbers of a log's lines: the least or the most of what follows or precedes a text.
pick() # least or most, log, sed expression that leaves the number
{
    sed -n "$3" $logs/$2.log | sort -n | { [ "$1" = most ] && tail -1 || head -1; }
}
laws() # log
{
    grep -E '^[0-9]+ passed' $logs/$1.log | sed 's/ *$//'
}
decibel='s/.* \([0-9.]*\) dB.*/\1/p'
edit() # side
{
    awk -F '|' -v side="$1" '$2 + 0 == side { print $3 + 0 " ms" }' $logs/edits.log
}
row() # what, before, asked, now, command
{
    echo "| $1 | $2 | $3 | $4 | \`$5\` |"
}

{
    cat << 'END'
# A scene around the terrain

`make scene-table` measures this anew. Before: version 0.4.1, by a host that was written from its
README alone; a dash where nothing of the kind was there.

## Houses and seas

400 houses, eight directions, 640 x 512 pixels; three heights of a sea. From one place: 34 degrees,
from a quarter of the terrain's range of heights over its middle. Gliding: 50 degrees, six steps of
a sample, so that all pictures are seen from elsewhere than they were made from. Through: pixels of
houses that a ridge of the full mesh hides; sunk: pixels of them that impostors hide; then both, of
9,637. PSNR of whole pictures; pixels of sky where the full mesh has none. Before, over N42E001 from
one place: 153 of 9,637 through, 55 sunk, 29.8 dB with a sea. Asked: 80 wrong of 9,637, 30 with
exact depth; 40 dB.

| scene | depth | pixels | through | sunk | of 9,637 | least dB | with a sea | sky |
|---|---|--:|--:|--:|--:|--:|--:|--:|
END
    houses='\([0-9]*\) pixels of houses \([0-9]*\) shine through, \([0-9]*\) are sunk'
    least='at least \([0-9.]*\) dB, with a sea \([0-9.]*\); \([0-9]*\) pixels of sky'
    sed -n "s/^  \(.*\): of $houses; $least/\1;\2;\3;\4;\5;\6;\7/p" $logs/houses.log |
        awk -F ';' '{
            exact = sub(/, exact depth/, "", $1)
            printf "| %s | %s | %d | %d | %d | %.0f | %s | %s | %d |\n", $1,
                   exact ? "exact" : "mesh", $2, $3, $4, ($3 + $4) * 9637 / $2, $5, $6, $7 }'
    cat << 'END'

## All else

| what | before | asked | now | command |
|---|--:|--:|--:|---|
END
    row "Vulkan, Direct3D, reversed depth, no far plane, row vectors, z up, all of them: PSNR" \
        "27 dB" "OpenGL's, -0.1" \
        "$(pick least conventions "$decibel") to $(pick most conventions "$decibel") dB" \
        build/conventions
    row "orthographic, off-centre, two eyes: pixels of holes" - 0 \
        "0 ($(laws cameras)), at least $(pick least cameras "$decibel") dB" \
        "build/render no_camera"
    row "pictures in UTM coordinates at 1 m, texels off" 7.2 "0.1" "at most 0.05 ($(laws origin))" \
        "build/unit pictures_stay"
    row "captures over a day of 24 minutes, a frame" "every one, anew" 0.5 \
        "$(pick most day 's/.*, \([0-9.]*\) captures a frame.*/\1/p')" "build/flights a_day"
    row "worst pop of a renewal, grey levels" "-" 5 \
        "$(pick most pop 's/.*worst pop \([0-9.]*\) grey.*/\1/p')" "build/render renewed_light"
    row "lit when drawn over a day, against pictures as old, made in that light" - "38 dB" \
        "$(pick least relit 's/.*as old: at least \([0-9.]*\) dB.*/\1/p') dB" \
        "build/render lit_when"
    row "against pictures made anew in each frame, eye at rest" - "38 dB" \
        "$(pick least relit 's/.*, 0 cells.* worst \([0-9.]*\);.*/\1/p') dB" "build/render lit_when"
    row "gliding (a light that rests: 36.1 dB)" - "38 dB" \
        "$(pick least relit 's/.*, 1 cells.* worst \([0-9.]*\);.*/\1/p') dB" "build/render lit_when"
    row "two terrains side by side, pixels of sky between them" "175 in 120 frames" 0 \
        "$(pick most tiles 's/.*, \([0-9]*\) when they are joined/\1/p')" \
        "build/render side_by_side"
    row "captures that fail, or are lost" "worn for ever" "made again" "$(laws failing)" \
        "build/flights capture"
    for side in ${SIDES:-1025 2049 4097}; do
        was=-
        case $side in 1025) was="17 ms" ;; 2049) was="48 ms" ;; 4097) was="160 ms" ;; esac
        row "an edit of 16 x 16 samples in $side x $side" "$was" "3 ms" "$(edit $side)" \
            "build/bench_edits $side"
    done
    row "... and then each chunk under it" "in that" "in slices" \
        "$(awk -F '|' '$2 + 0 > 0 && $5 + 0 > m { m = $5 + 0 } END { print m " ms" }' \
            $logs/edits.log)" build/bench_edits
} > $out.new && mv $out.new $out
cat $out
