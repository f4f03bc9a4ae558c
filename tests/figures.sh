#!/bin/sh
# Takes the figures of the last `make bench` over: keeps its tables and plots in tests/results and
# renews the tables of README.md and of tests/results/README.md, which stand between
# `<!-- figures NAME -->` and `<!-- end -->`.
# Use: make figures

cd "$(dirname "$0")/.." || exit 1
bench=build/bench
results=tests/results
new=$bench/figures
mkdir -p $results $new

# ---- the tables of both pages, each from the TSV that it names

# Rows of frames.tsv: of a scene, the ways in the order of the list, one a line on standard input.
ways() # scene columns
{
    awk -F '\t' -v scene="$1" -v wanted="$2" '
        FNR == 1 && NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; n = split(wanted, column, " ") }
        FILENAME != "-" { if ($1 == scene) row[$2] = $0; next }
        $0 in row {
            split(row[$0], cell, "\t")
            line = "| " ($0 ~ /^auto/ ? "**" $0 "**" : $0 == "full" ? "full mesh" : $0) " |"
            for (i = 1; i <= n; i++) {
                split(column[i], what, ":")
                value = sprintf(what[2], cell[at[what[1]]])
                # what makes no pictures has none to be compared or counted
                if ($0 == "full" && what[1] ~ /^(psnr_terrain|ssim|pop_block)$/) value = ""
                if (($0 == "full" || $0 ~ /^geomip/) && what[1] == "captures") value = ""
                line = line " " value " |"
            }
            print line
        }' $bench/frames.tsv -
}

# The same of other engines; empty cells so many before triangles and draws, and behind.
peers() # scene before behind
{
    number='\([0-9.]*\)'
    fields='"\(.*\)", '"$number, $number, $number, $number"
    sed -n 's/^ *{ "'"$1"'", '"$fields"' }.*/\1;\2;\3;\4;\5/p' tests/bench_peers.h |
        awk -F ';' -v before="$2" -v behind="$3" '{
            printf "| %s (quoted) | %s | %s |", $1, $2, $3
            for (i = 0; i < before; i++) printf " |"
            printf " %s | %s |", $4, $5
            for (i = 0; i < behind; i++) printf " |"
            print "" }'
}

columns="cpu_ratio:%.3f psnr_terrain:%.1f ssim:%.3f psnr_4x4:%.1f pop_block:%.1f holes:%d
         triangles:%d draws:%d captures:%.2f"
heading="cost | PSNR | SSIM | PSNR to 4 x 4 samples | worst pop | holes | triangles | draws |\
 captures |
|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"

rough()
{
    echo "| rough 2049 x 2049 | $heading"
    printf '%s\n' full 'auto 0.5 px' 'auto 1 px' 'auto 2 px' 'impostor 1 px' Hess \
        'Hess, 2 texels a px' 'geomip 0.25 px' 'geomip 0.5 px' 'geomip 1 px' 'geomip bound 2 px' |
        ways rough "$columns"
    peers rough 4 1
}

pyrenees()
{
    echo "| Pyrenees 1025 x 1025 | $heading"
    printf '%s\n' full 'auto 0.5 px' 'auto 1 px' 'auto 2 px' 'impostor 1 px' Hess \
        'Hess, 2 texels a px' 'geomip 0.25 px' 'geomip 0.5 px' 'geomip 4 px' 'geomip bound 2 px' |
        ways pyrenees "$columns"
    peers pyrenees 4 1
}

# What auto and impostor gain at equal quality: the last table of each scene in frames.md.
faster()
{
    echo "| | cost by the clock | PSNR | than our geomip | by processor time | at equal SSIM |" \
        "than peers (quoted) | by processor time |"
    echo "|---|--:|--:|--:|--:|--:|--:|--:|"
    awk '/^## / { scene = $2; sub(/,.*/, "", scene); if (/materials/) scene = "materials"
                  if (/trees/) scene = "trees" }
         /^How many times/ { on = 1 } /^Plot/ { on = 0 }
         on && /^\| (auto|impostor|Hess)/ { sub(/^\| /, "| " scene ": "); print }' $bench/frames.md
}

# The short table of README.md: of each scene the two settings that most hosts want.
summary()
{
    echo "| scene | cost, full mesh 1 | PSNR | times as fast as our geomip, as good |" \
        "at equal SSIM | as quoted engines |"
    echo "|---|--:|--:|--:|--:|--:|"
    faster | awk -F '|' '!/(walk|valley|pass)-/ && /: auto [12] px / {
        printf "|%s|%s|%s|%s|%s|%s|\n", $2, $3, $4, $5, $7, $8 }'
}

# Flights close to the ground, of which most is hidden behind ridges.
low()
{
    echo "| flight | way | cost | quads | PSNR | worst pop | holes | triangles | draws | captures |"
    echo "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"
    for scene in walk valley pass; do
        for terrain in n42e001 n49e011 rough; do
            printf '%s\n' full 'full, hiding' 'geomip 1 px' 'geomip 1 px, hiding' 'auto 1 px' \
                'auto 1 px, hiding' 'auto 2 px, hiding' |
                ways ${scene}_$terrain "cpu_ratio:%.3f quads:%.1f psnr_terrain:%.1f pop_block:%.1f
                    holes:%d triangles:%d draws:%d captures:%.2f" |
                sed "s/^/| $scene $terrain /"
        done
    done
}

circle()
{
    echo "| circle, 2049 x 2049 | cost | median | 95 % | worst | PSNR | captures | holes |"
    echo "|---|--:|--:|--:|--:|--:|--:|--:|"
    printf '%s\n' 'auto 1 px' 'geomip 1 px' 'Hess 200, 64' 'Hess 400, 64' 'Hess 600, 64' \
        'Hess 200, 128' 'Hess 400, 128' 'Hess 600, 128' |
        ways hess2049 "cpu_ratio:%.2f ratio_median:%.2f ratio_p95:%.2f ratio_worst:%.2f
                       psnr_terrain:%.1f captures:%.2f holes:%d"
}

materials()
{
    echo "| materials and clouds | cost | PSNR | SSIM | worst pop | captures |"
    echo "|---|--:|--:|--:|--:|--:|"
    printf '%s\n' 'auto 1 px' 'impostor 1 px' 'geomip 0.5 px' |
        ways materials "cpu_ratio:%.3f psnr_terrain:%.1f ssim:%.3f pop_block:%.1f captures:%.2f"
}

trees()
{
    materials_heading=$(materials | head -2 | sed 's/materials and clouds/6000 trees/')
    echo "$materials_heading"
    printf '%s\n' 'auto 1 px' 'impostor 1 px' 'geomip 0.5 px' |
        ways trees "cpu_ratio:%.3f psnr_terrain:%.1f ssim:%.3f pop_block:%.1f captures:%.2f"
}

# A file of rows as it is.
rows() # file.tsv
{
    awk -F '\t' '{ printf "|"; for (i = 1; i <= NF; i++) printf " %s |", $i; print "" }
                 NR == 1 { printf "|"; for (i = 1; i <= NF; i++) printf i == 1 ? "---|" : "--:|"
                           print "" }' "$1"
}

scale()
{
    awk -F '\t' '$1 == "samples" { table++ } table == 1' $results/scale.tsv |
        cut -f 1-3,7,9-15 > $new/scale.tsv
    rows $new/scale.tsv
}

growth()
{
    awk -F '\t' '$1 == "samples" { table++ } table == 3' $results/scale.tsv > $new/growth.tsv
    rows $new/growth.tsv
}

cpu()
{
    echo "| terrain | way | update, median ms | 99 % | render, median ms | worst of the start |" \
        "view KiB |"
    echo "|--:|---|--:|--:|--:|--:|--:|"
    awk -F '\t' 'NR > 1 && $1 >= 1025 && $2 !~ /room/ {
        printf "| %s | %s | %.2f | %.2f | %.3f | %.1f | %d |\n", $1, $2, $3, $4, $5, $7, $11 / 1024
    }' $bench/cpu.tsv
}

building()
{
    awk '/^Building/ { on = 1 } on && /^\|/' $bench/cpu.md
}

simplifier() { rows $bench/simplifier.tsv; }

atlas()
{
    awk -F '\t' '$1 == "packer" { exit } { print }' $bench/atlas.tsv > $new/atlas.tsv
    rows $new/atlas.tsv
}

# ---- taking over

# The sizes that only BENCH_ALL measures are not lost to a run without it.
kept=none
if grep -q '^16385' $results/scale.tsv && ! grep -q '^16385' $bench/scale.tsv; then
    echo "figures: scale: without 16385 x 16385, what there was stays"
    kept="$bench/scale.*"
fi 2> /dev/null
for file in $bench/*.md $bench/*.tsv $bench/*.svg; do
    case $file in */frame_times.tsv | *'*'* | $kept) continue ;; esac
    cp "$file" $results/ || exit 1
done
for plot in $results/*.svg; do # shown where the text names it
    name=$(basename "$plot")
    sed -i "s|^Plot: $bench/$name\$|![$name]($name)|" $results/*.md
done

# A table of which nothing was measured stays as it is: two lines are its headings.
for page in README.md $results/README.md; do
    for name in $(sed -n 's/^<!-- figures \([a-z]*\) -->$/\1/p' $page); do
        $name > $new/$name.md 2> /dev/null
        if [ "$(wc -l < $new/$name.md)" -lt 3 ]; then
            echo "figures: $name: not measured, its table stays"
            rm -f $new/$name.md
        fi
    done
    awk -v new=$new '
        /^<!-- figures / {
            print
            file = new "/" $3 ".md"
            while ((getline line < file) > 0) { print line; skip = 1 }
            close(file)
            next
        }
        /^<!-- end -->/ { skip = 0 }
        !skip' $page > $new/page.md && cp $new/page.md $page
done
