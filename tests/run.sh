#!/bin/sh
# Runs every test, as many suites at once as there are cores, or JOBS=n. What each prints is shown
# whole, in the order of the list below. Each test program or script ends in a line
# "N passed, N failed[, N skipped]"; the last line here is their sum. A test that crashes, hangs or
# does not build counts as failed.
# Real elevation tiles are looked for in ../shared/data, or in the directory TERRIMP_DATA.

cd "$(dirname "$0")/.." || exit 1
CC=${CC:-cc}
jobs=${JOBS:-$(getconf _NPROCESSORS_ONLN 2> /dev/null)}
[ "$jobs" -ge 1 ] 2> /dev/null || jobs=1
suites=build/test/suites # of the n-th: n.name, n.command, n.taken, n.log and, at its end, n.code
count=0
passed=0
failed=0
skipped=0
failures=
export CC

# ---- the list of suites, and those who run it

# suite "name" "command": puts a test at the end of the list.
suite()
{
    count=$((count + 1))
    printf '%s\n' "$1" > $suites/$count.name
    printf '%s\n' "$2" > $suites/$count.command
}

# skip "what and why": something that this machine cannot test.
skip()
{
    suite "skipped: $*" "echo 0 passed, 0 failed, 1 skipped"
}

# Takes suites until all are taken: only one worker can make the n-th folder.
worker()
{
    n=0
    running=
    trap 'kill $running 2> /dev/null; exit 1' INT TERM HUP
    while [ $n -lt $count ]; do
        n=$((n + 1))
        mkdir $suites/$n.taken 2> /dev/null || continue
        $limit sh $suites/$n.command > $suites/$n.log 2>&1 &
        running=$!
        wait $running 2>> $suites/$n.log
        echo $? > $suites/$n.code
    done
}

start_workers()
{
    workers=
    trap 'kill $workers 2> /dev/null; exit 130' INT TERM HUP
    while [ "$jobs" -gt 0 ]; do
        jobs=$((jobs - 1))
        worker &
        workers="$workers $!"
    done
}

# The n-th number of the closing line $1, or 0.
number()
{
    echo "$1" | tr -cs '0-9' ' ' | cut -d ' ' -f "$2" | grep . || echo 0
}

# Shows what the n-th suite prints, once it has ended, and adds up what its closing line says.
report() # n
{
    name=$(cat $suites/$1.name)
    echo
    echo "---- $name"
    until [ -s $suites/$1.code ]; do sleep 1; done
    cat $suites/$1.log
    code=$(cat $suites/$1.code)
    line=$(grep -E "^[0-9]+ passed, [0-9]+ failed" $suites/$1.log | tail -n 1)
    bad=$(number "$line" 2)
    if [ "$bad" -eq 0 ] && { [ "$code" -ne 0 ] || [ -z "$line" ]; }; then
        echo "$name: ended with code $code and '$line'"
        bad=1
    fi
    passed=$((passed + $(number "$line" 1)))
    failed=$((failed + bad))
    skipped=$((skipped + $(number "$line" 3)))
    [ "$bad" -eq 0 ] || failures="$failures
  $name: $bad"
}

# ---- what is here

have()
{
    command -v "$1" > /dev/null
}

has_library() # header, libraries...
{
    header=$1
    shift
    echo 'int main(void) { return 0; }' > build/test/probe.c
    $CC -include "$header" build/test/probe.c -o build/test/probe "$@" > /dev/null 2>&1
}

# Where a process may not look into its own threads, as in some containers, leaks go unseen.
sanitizers_work() # compiler
{
    echo 'int main(void) { return 0; }' > build/test/probe.c
    have "${1%% *}" || return
    $1 $sanitize build/test/probe.c -o build/test/probe > /dev/null 2>&1 || return
    build/test/probe > /dev/null 2>&1 && return
    export ASAN_OPTIONS="$ASAN_OPTIONS:detect_leaks=0"
    build/test/probe > /dev/null 2>&1 && echo "(leaks cannot be detected here)"
}

# The first compiler that has one; in some containers it cannot lay out memory as it needs to.
thread_sanitizer()
{
    echo 'int main(void) { return 0; }' > build/test/probe.c
    for compiler in clang gcc; do
        have $compiler || continue
        $compiler $races build/test/probe.c -o build/test/probe > /dev/null 2>&1 &&
            build/test/probe > /dev/null 2>&1 && echo $compiler && return
    done
    false
}

# What suites share is built before they start, so that no two of them build the same file: here
# are its warnings. What does not build is tried again, and fails, in each suite that needs it.
build() # arguments of make...
{
    make -s -k -j "$jobs" "$@" 2>&1 | grep -vE '^(compile|link) '
}

# All libraries for pictures are known to the Makefile. Of flyover is seen that it builds.
graphics_tests() # OpenGL, folder, options of make
{
    build $3 render flyover unit_host
    suite "render tests, $1" "$earlier make -s $3 render flyover && $2/render"
    # Its pictures are compared with those of the tests before it.
    earlier="until [ -s $suites/$count.code ]; do sleep 1; done;"
    suite "host helpers, $1" "make -s $3 unit_host && cd $2 && ./unit_host"
}

rm -rf $suites build/test/result
mkdir -p $suites
limit=
have timeout && limit="timeout 900"
# Of debug information only line numbers: all that reports need, and quicker to compile.
sanitize="-g1 -O1 -fsanitize=address,undefined -fno-sanitize-recover=all"
races="-std=c99 -g1 -O1 -fsanitize=thread -I."

# ---- the list: slow suites first, or the last one would run alone

# unit "name" "compiler and options" program [words]: builds and runs unit.c or flights.c.
unit()
{
    name=$1
    command="$2 -std=c99 -I. tests/$3.c -lm -o build/test/$3-$count"
    run=build/test/$3-$count
    shift 3
    suite "$name" "$command && $run $*"
}

# Some tests repeat more often than elsewhere; flights are optimised, or they would take minutes.
all_rounds="TERRIMP_LONG=1; export TERRIMP_LONG;"
unit "flights, all rounds" "$all_rounds $CC -O2" flights
for compiler in gcc clang; do
    if sanitizers_work $compiler; then
        unit "flights, $compiler with sanitizers" "$compiler $sanitize" flights
        unit "unit tests, $compiler with sanitizers" "$compiler $sanitize" unit
    else
        skip "unit tests and flights, $compiler with sanitizers: it is not here, or has none"
    fi
done
unit "unit tests, built as the README says, all rounds" "$all_rounds $CC" unit
unit "golden values, without optimisation" "$CC" flights golden_values
unit "pages of 4097 x 4097 samples" "$CC -O2 -DPAGED_SIDE=4097u -DPAGED_CHUNK=64u" flights pages_
echo "(building what the suites share, then running them, $jobs at once)"
build all
earlier=
if has_library GL/osmesa.h -lOSMesa; then
    graphics_tests osmesa build # which the examples use too
else
    skip "render tests and host helpers, OSMesa: it is not installed"
fi
suite "compilers and build options" "sh tests/compile/run.sh"
suite "fuzzers, some seconds each" "sh tests/fuzz.sh 5"
suite "fuzzers, over their corpus" "sh tests/fuzz.sh"
if has_library EGL/egl.h -lEGL -lOpenGL; then
    graphics_tests egl build/egl GL=egl
else
    skip "render tests and host helpers, EGL: it is not installed"
fi
if sanitizers_work "$CC"; then
    suite "host helpers, sanitizers" \
        "make -s CONFIG=sanitize unit_host && cd build/sanitize && ./unit_host"
else
    skip "host helpers, sanitizers: $CC has none"
fi
if compiler=$(thread_sanitizer); then
    suite "threads, $compiler with ThreadSanitizer" \
        "$compiler $races tests/threads.c -lm -lpthread -o build/test/threads &&
            build/test/threads"
else
    skip "threads, ThreadSanitizer: no compiler here has one that runs"
fi
suite "the viewer" "sh tests/viewer.sh"
suite "the viewer's page" "sh tests/web.sh"
suite "documentation" "sh tests/docs.sh"
suite "hygiene" "sh tests/hygiene.sh"
suite "examples" "sh tests/examples.sh"

# ---- runs them

start_workers
n=0
while [ $n -lt $count ]; do
    n=$((n + 1))
    report $n
done

echo
[ -z "$failures" ] || echo "Failed:$failures"
result="$passed passed, $failed failed"
[ "$skipped" -eq 0 ] || result="$result, $skipped skipped"
echo "$result" | tee build/test/result
[ "$failed" -eq 0 ]
