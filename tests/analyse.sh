#!/bin/sh
# Static analysis of the header, and its unit tests under tools that watch memory. What is not
# installed is skipped with a word; `make deps-portable` installs it, on Debian. Takes minutes.
# Configured by .clang-tidy and .cppcheck, which say what is left out and why.

cd "$(dirname "$0")/.." || exit 1
check_every=1
. tests/check.sh
work=build/analyse
mkdir -p $work
printf '#define TERRIMP_IMPLEMENTATION\n#include "terrimp.h"\n' > $work/terrimp.c

have()
{
    command -v "$1" > /dev/null
}

finds_nothing() # name, command...: shows what the command finds
{
    log=$work/$1.txt
    shift
    "$@" > "$log" 2>&1 && ! grep -qE '(warning|error|style|performance|portability):' "$log" &&
        return
    grep -E -A 4 '(warning|error|style|performance|portability):' "$log" | head -n 40
    tail -n 3 "$log"
    false
}

tests_pass() # command...
{
    "$@" > $work/unit.txt 2>&1 && return
    grep -v '^ACMR' $work/unit.txt | tail -n 30
    false
}

if have cppcheck; then
    check "cppcheck" finds_nothing cppcheck cppcheck --std=c99 --language=c -q -I. \
        --enable=warning,style,performance,portability --suppressions-list=.cppcheck \
        $work/terrimp.c
else
    skip "cppcheck: it is not installed"
fi
if have clang-tidy; then
    check "clang-tidy" finds_nothing clang-tidy clang-tidy --quiet $work/terrimp.c -- -std=c99 -I.
else
    skip "clang-tidy: it is not installed"
fi
if have gcc; then
    check "gcc -fanalyzer" finds_nothing analyzer gcc -std=c99 -O1 -fanalyzer -I. \
        -c $work/terrimp.c -o $work/terrimp.o
else
    skip "gcc -fanalyzer: gcc is not installed"
fi

for program in unit flights; do
    flags="-std=c99 -g -I. tests/$program.c -lm"
    if have clang && clang -O1 -fsanitize=memory $flags -o $work/$program-msan > /dev/null 2>&1
    then
        check "$program, MemorySanitizer" tests_pass $work/$program-msan
    else
        skip "$program, MemorySanitizer: clang has none here"
    fi
    if have valgrind; then
        ${CC:-cc} -O2 $flags -o $work/$program-valgrind
        check "$program, valgrind" tests_pass \
            valgrind -q --error-exitcode=9 --leak-check=full $work/$program-valgrind
    else
        skip "$program, valgrind: it is not installed"
    fi
done
check_report
