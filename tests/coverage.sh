#!/bin/sh
# Prints how much of terrimp.h the unit tests reach, in lines and branches, and what they do not,
# with the reasons from tests/coverage_reasons.txt.
# Asserts count for nothing: their other branch is a mistake of the library. The whole annotated
# header stands in build/coverage/terrimp.h.gcov afterwards.
# Argument: "all" also lists the branches that are never taken [only lines].

cd "$(dirname "$0")/.." || exit 1
work=build/coverage
rm -rf $work
mkdir -p $work
CC=${COVERAGE_CC:-gcc}
gcov=${GCOV:-gcov}
line_aim=98
branch_aim=90

for tool in "$CC" "$gcov"; do
    command -v "$tool" > /dev/null || { echo "coverage: $tool is not installed"; exit 1; }
done

# Both programs as one, so that lines count which either of them reaches; it adds up their tests.
cat > $work/unit.c << 'END'
#define main unit_main
#include "tests/unit.c"
#undef main
#define main flights_main
#include "tests/flights.c"
#undef main
int main(int argc, char **argv)
{
    return unit_main(argc, argv) | flights_main(argc, argv);
}
END
$CC -std=c99 -O0 --coverage '-DTERRIMP_ASSERT(condition)=((void)0)' -I"$PWD" -c $work/unit.c \
    -o $work/unit.o && $CC --coverage $work/unit.o -lm -o $work/unit || exit 1
$work/unit > $work/unit.txt 2>&1
tail -n 1 $work/unit.txt
(cd $work && $gcov -b -c unit.o > gcov.txt 2>&1)
[ -s $work/terrimp.h.gcov ] || { cat $work/gcov.txt; exit 1; }

# A function's lines follow its line "function NAME called ..."; branches follow their line.
awk -v all="$1" -v line_aim=$line_aim -v branch_aim=$branch_aim '
    function shown(text) { gsub(/^ +/, "", text); return substr(text, 1, 76) }
    FNR == NR {
        if (!/^#/ && NF > 1) {
            reason[$1] = $0
            sub(/^[^ ]+ +/, "", reason[$1])
        }
        next
    }
    /^function / { name = $2; next }
    /^call / { next }
    /^branch / {
        branches++
        if (/never executed/ || / taken 0( |$)/) {
            if (!dead) branch_list = branch_list sprintf("  %5d %-38s %s\n", at, name, shown(code))
            branches_missed++
            dead = 1
        }
        next
    }
    {
        split($0, part, ":")
        count = part[1]
        gsub(/ /, "", count)
        at = part[2] + 0
        code = substr($0, length(part[1]) + length(part[2]) + 3)
        dead = 0
        if (count == "-" || at == 0) next
        lines++
        if (count ~ /^[#=]/) {
            lines_missed++
            if (name != listed)
                line_list = line_list sprintf("  %s: %s\n", name,
                                              name in reason ? reason[name] : "UNEXPLAINED")
            listed = name
            line_list = line_list sprintf("  %5d     %s\n", at, shown(code))
            dead = 1
        }
    }
    END {
        if (lines_missed) printf "Lines that no unit test reaches:\n%s", line_list
        if (all == "all") printf "Branches that are not taken both ways:\n%s", branch_list
        line_part = 100 * (lines - lines_missed) / lines
        branch_part = 100 * (branches - branches_missed) / branches
        printf "lines    %6.2f %% of %5d (aim: %d %%)\n", line_part, lines, line_aim
        printf "branches %6.2f %% of %5d (aim: %d %%)\n", branch_part, branches, branch_aim
        exit line_part < line_aim || branch_part < branch_aim
    }' tests/coverage_reasons.txt $work/terrimp.h.gcov
