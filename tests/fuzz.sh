#!/bin/sh
# Fuzzers. Without arguments: replays the corpus under sanitizers, as a test. With a number of
# seconds: lets clang's libFuzzer look for new input, so long for each of tests/fuzz_*.c (or those
# named after the number, like `terrain`); what it keeps goes to build/fuzz/NAME/, what breaks the
# library to build/fuzz/NAME.crash-*, to be copied to tests/corpus/NAME/ once it is understood.
# SEED=n begins with other random numbers.

cd "$(dirname "$0")/.." || exit 1
. tests/check.sh
seconds=${1:-0}
[ $# -eq 0 ] || shift
names=${*:-$(ls tests/fuzz_*.c | sed 's/.*fuzz_//; s/[.]c$//')}
work=build/fuzz
mkdir -p $work
# Private to its one file, the library is compiled only where the fuzzer reaches it.
flags="-std=c99 -g -Wall -Wextra -Wno-unused-function -DTERRIMP_STATIC -I."
sanitize="-fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all"
CC=${CC:-cc}

sanitizers_work()
{
    echo 'int main(void) { return 0; }' > $work/probe.c
    $CC $sanitize $work/probe.c -o $work/probe > /dev/null 2>&1 && $work/probe > /dev/null 2>&1
}

# Files of its own, because a replay may run at the same time.
has_fuzzer()
{
    echo 'int LLVMFuzzerTestOneInput(void) { return 0; }' > $work/probe_fuzzer.c
    clang -fsanitize=fuzzer $work/probe_fuzzer.c -o $work/probe_fuzzer > /dev/null 2>&1
}

has_header()
{
    $CC -E -include $1 -x c /dev/null > /dev/null 2>&1
}

# What a fuzzer uses beside libm, as far as it is here.
libraries() # name
{
    [ $1 = dem ] || return
    has_header png.h && echo -lpng || echo -DHOST_NO_PNG
    has_header tiffio.h && echo -DHOST_TIFF -ltiff
}

replays() # name
{
    $CC -O0 $flags $sanitize tests/fuzz_$1.c $(libraries $1) -lm -o $work/replay_$1 &&
        $work/replay_$1 tests/corpus/$1/* > $work/replay_$1.txt 2>&1 && return
    # Once more, to say which file it was.
    FUZZ_VERBOSE=1 $work/replay_$1 tests/corpus/$1/* 2>&1 | tail -n 30
    false
}

# The last line says how many inputs it tried and how much of the code they reached.
fuzz() # name
{
    mkdir -p $work/$1
    clang -O2 $flags -DFUZZER -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
        tests/fuzz_$1.c $(libraries $1) -lm -o $work/fuzz_$1 || return
    $work/fuzz_$1 -max_total_time=$seconds -max_len=2048 -len_control=20 -timeout=30 \
        -seed=${SEED:-1} -rss_limit_mb=4096 -print_final_stats=1 -artifact_prefix=$work/$1. \
        $work/$1 tests/corpus/$1 > $work/fuzz_$1.txt 2>&1
    code=$?
    [ $code -eq 0 ] || grep -vE '^#[0-9]|NEW_FUNC' $work/fuzz_$1.txt | tail -n 40
    echo "$1: $(sed -n 's/^stat::number_of_executed_units: //p' $work/fuzz_$1.txt) executions," \
        "$(grep -oE 'cov: [0-9]+ ft: [0-9]+ corp: [^ ]+' $work/fuzz_$1.txt | tail -n 1)"
    return $code
}

for name in $names; do
    if [ "$seconds" -eq 0 ]; then
        sanitizers_work || {
            sanitize=
            echo "($CC has no sanitizers: the files are replayed bare)"
        }
        check "fuzz_$name: the corpus breaks no promise" replays "$name"
    elif has_fuzzer; then
        check "fuzz_$name: nothing found in $seconds s" fuzz "$name"
    else
        skip "fuzz_$name: clang's libFuzzer is not here; make deps-portable installs it"
    fi
done
check_report
