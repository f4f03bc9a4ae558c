#!/bin/sh
# Measures frames: flies over each scene with impostors (then with geometrical mipmapping alone) and
# in full, in turn, and prints Markdown tables. BENCH_FRAMES is the number of frames of a scene
# [120], BUILD where flyover is [build].
# Real tiles and flight paths are looked for in ../shared/data, or in the directory TERRIMP_DATA.

cd "$(dirname "$0")/.." || exit 1
frames=${BENCH_FRAMES:-120}
flyover=${BUILD:-build}/flyover
data=${TERRIMP_DATA:-../shared/data}
rough_source=../shared/tools/rough.c
work=build/bench
mkdir -p $work

# The value of a `key value` line of the last flight.
value() # key
{
    sed -n "s/^$1 //p" $work/figures
}

# fly frames options...: the figures of a flight go to $work/figures.
fly()
{
    count=$1
    shift
    "$flyover" --compare --frames "$count" "$@" > $work/figures
}

heading() # first column
{
    echo
    echo "| $1 | full ms | impostor ms | ratio | mean ratio | PSNR mean | worst |" \
         "triangles | draws | captures |"
    echo "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
}

row() # name
{
    {
        echo "full $(value full_ms_median)"
        echo "impostor $(value ms_median)"
        echo "full_mean $(value full_ms_mean)"
        echo "impostor_mean $(value ms_mean)"
        echo "psnr $(value psnr_terrain_mean)"
        echo "psnr_worst $(value psnr_terrain_worst)"
        echo "triangles $(value triangles_mean)"
        echo "draws $(value draws_mean)"
        echo "captures $(value captures_mean)"
    } | awk -v name="$1" '{ is[$1] = $2 }
        END { printf "| %s | %.1f | %.1f | %.2f | %.2f | %.2f | %.2f | %d | %.0f | %.2f |\n", name,
              is["full"], is["impostor"], is["impostor"] / is["full"],
              is["impostor_mean"] / is["full_mean"], is["psnr"], is["psnr_worst"],
              is["triangles"], is["draws"], is["captures"] }'
}

measure() # name options...
{
    name=$1
    shift
    if fly "$frames" "$@"; then
        row "$name"
    else
        echo "| $name | failed |"
        failed=1
    fi
}

heading_geomip()
{
    echo
    echo "| $1 | full ms | ms | ratio | PSNR mean | worst | triangles | draws |"
    echo "|---|--:|--:|--:|--:|--:|--:|--:|"
}

measure_geomip() # name options...
{
    name=$1
    shift
    fly 15 --mode geomip "$@" || { echo "| $name | failed |"; failed=1; return; }
    echo "| $name | $(value full_ms_median) | $(value ms_median) |" \
         "$(awk "BEGIN { printf \"%.2f\", $(value ms_median) / $(value full_ms_median) }") |" \
         "$(value psnr_terrain_mean) | $(value psnr_terrain_worst) |" \
         "$(value triangles_mean) | $(value draws_mean) |"
}

# All tolerances by the default rule, then by the bound, then one that morphs.
measure_tolerances() # scene options...
{
    scene=$1
    shift
    for tolerance in 0.5 1 2 4 8 16; do
        measure_geomip "$scene, $tolerance px" "$@" --tolerance $tolerance
    done
    for tolerance in 0.5 1 2 4 8 16; do
        measure_geomip "$scene, bound $tolerance px" "$@" --tolerance $tolerance --rule bound
    done
    measure_geomip "$scene, 1 px, morphing 1.5" "$@" --morph 1.5
}

# What others reached on the same two flights, all 120 frames, measured once on one machine with
# the same rasteriser: quoted, not measured here.
quote() # scene, and lines of name, ratio, PSNR, triangles, draws
{
    while read -r name ratio psnr triangles draws; do
        echo "| $1, quoted: $name | | | $ratio | $psnr | | $triangles | $draws |" | tr _ ' '
    done
}

# The two scenes with a path; "" when their files are missing.
find_path_scenes()
{
    pyrenees=
    rough=
    if [ -f "$data/N42E001.hgt" ] && [ -f "$data/paths/pyrenees.path" ]; then
        pyrenees="--dem $data/N42E001.hgt --crop 0,0,1025x1025 --spacing 79.6
            --path $data/paths/pyrenees.path"
    fi
    if [ -f $rough_source ] && [ -f "$data/paths/rough.path" ] &&
            ${CC:-cc} -O2 $rough_source -o $work/rough -lm && $work/rough 2049 $work/rough.hgt; then
        rough="--dem $work/rough.hgt --spacing 1 --height-scale 0.05
            --path $data/paths/rough.path"
    fi
}

failed=0
find_path_scenes
fly 1 --terrain-size 129
echo "Machine: $(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2> /dev/null | head -n 1)," \
     "$(getconf _NPROCESSORS_ONLN) processors"
echo "Renderer: $(value renderer)"
echo "Frames: $frames of 1280x1024 for each scene, drawn with impostors and in full in turn."
echo "Times are medians; the mean ratio has the first frame and all captures in it. PSNR [dB] is"
echo "over terrain pixels, against full; triangles, draws and captures are means of a frame."

heading "scene"
measure "procedural 2049 x 2049, circle at 80 units/s, as Hess" --speed 80
for tile in N42E001 N49E011; do
    if [ -f "$data/$tile.hgt" ]; then
        measure "$tile, circle" --dem "$data/$tile.hgt"
    else
        echo "| $tile: not here |"
    fi
done
# Options are words without blanks, so that they may be split.
[ -z "$pyrenees" ] || measure "pyrenees.path" $pyrenees
[ -z "$rough" ] || measure "rough.path" $rough

frames=$(((frames + 3) / 4))
echo
echo "Texels for a pixel, the first $frames frames:"
heading "scene"
for texels in 1 1.5 2 3; do
    [ -z "$pyrenees" ] || measure "pyrenees.path, $texels" $pyrenees --texels $texels
done
for texels in 1 1.5 2 3; do
    [ -z "$rough" ] || measure "rough.path, $texels" $rough --texels $texels
done

echo
echo "Geometrical mipmapping alone, the first 15 frames of each path:"
heading_geomip "scene, tolerance"
if [ -n "$pyrenees" ]; then
    measure_tolerances "pyrenees.path" $pyrenees
    quote "pyrenees.path" <<END
OGRE_Terrain,_1_px 0.84 47.7 1014000 152
OGRE_Terrain,_3_px 0.54 38.2 437000 101
OGRE_Terrain,_8_px 0.31 31.4 154000 40
Irrlicht,_128/256/512_cells 0.24 33.0 84000 1
Irrlicht,_defaults 0.13 27.0 24000 1
Irrlicht,_patch_65 0.20 29.8 63000 1
END
fi
if [ -n "$rough" ]; then
    measure_tolerances "rough.path" $rough
    quote "rough.path" <<END
OGRE_Terrain,_1_px 0.51 34.5 1411000 397
OGRE_Terrain,_3_px 0.145 26.9 197000 82
OGRE_Terrain,_8_px 0.063 22.3 41000 17
Irrlicht,_128/256/512_cells 0.090 26.1 96000 1
Irrlicht,_defaults 0.081 24.8 80000 1
Irrlicht,_patch_65 0.035 20.6 12000 1
END
fi
exit $failed
