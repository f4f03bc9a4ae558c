#!/bin/sh
# Runs every test. Each test program or script ends in a line "N passed, N failed[, N skipped]";
# the last line here is their sum. A test that crashes, hangs or does not build counts as failed.
# Real elevation tiles are looked for in ../shared/data, or in the directory TERRIMP_DATA.

cd "$(dirname "$0")/.." || exit 1
CC=${CC:-cc}
log=build/test/log
passed=0
failed=0
skipped=0
failures=
export CC

# The n-th number of the closing line $1, or 0.
number()
{
    echo "$1" | tr -cs '0-9' ' ' | cut -d ' ' -f "$2" | grep . || echo 0
}

# suite "name" command...: runs one test and adds up what its closing line says.
suite()
{
    name=$1
    shift
    echo
    echo "---- $name"
    { $limit "$@" 2>&1; echo $? > build/test/code; } | tee $log
    code=$(cat build/test/code)
    line=$(grep -E "^[0-9]+ passed, [0-9]+ failed" $log | tail -n 1)
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

# skip "what and why": something that this machine cannot test.
skip()
{
    echo
    echo "---- skipped: $*"
    skipped=$((skipped + 1))
}

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

# All libraries for pictures are known to the Makefile; one make for each OpenGL that is here.
graphics_tests() # osmesa|egl
{
    suite "host helpers, $1" sh -c "make -s GL=$1 unit_host && build/$1/unit_host"
    suite "render tests, $1" sh -c "make -s GL=$1 render flyover && build/$1/render"
}

mkdir -p build/test
rm -f build/test/result
limit=
have timeout && limit="timeout 600"
sanitize="-g -O1 -fsanitize=address,undefined -fno-sanitize-recover=all"
races="-std=c99 -g -O1 -fsanitize=thread -I."
unit="-std=c99 -I. tests/unit.c -lm -o"

suite "unit tests, built as the README says" \
    sh -c "$CC $unit build/test/unit && build/test/unit"
for compiler in gcc clang; do
    if sanitizers_work $compiler; then
        suite "unit tests, $compiler with sanitizers" \
            sh -c "$compiler $sanitize $unit build/test/unit-$compiler && build/test/unit-$compiler"
    else
        skip "unit tests, $compiler with sanitizers: it is not here, or has none"
    fi
done
if compiler=$(thread_sanitizer); then
    suite "threads, $compiler with ThreadSanitizer" \
        sh -c "$compiler $races tests/threads.c -lm -lpthread -o build/test/threads &&
            build/test/threads"
else
    skip "threads, ThreadSanitizer: no compiler here has one that runs"
fi
suite "documentation" sh tests/docs.sh
suite "compilers and build options" sh tests/compile/run.sh
suite "hygiene" sh tests/hygiene.sh
suite "fuzzers, over their corpus" sh tests/fuzz.sh
suite "fuzzers, some seconds each" sh tests/fuzz.sh 5
suite "examples" sh tests/examples.sh

if has_library GL/osmesa.h -lOSMesa; then
    graphics_tests osmesa
else
    skip "host helpers and render tests, OSMesa: it is not installed"
fi
if has_library EGL/egl.h -lEGL -lOpenGL; then
    graphics_tests egl
else
    skip "host helpers and render tests, EGL: it is not installed"
fi
if sanitizers_work "$CC"; then
    suite "host helpers, sanitizers" \
        sh -c "make -s CONFIG=sanitize unit_host && build/sanitize/unit_host"
else
    skip "host helpers, sanitizers: $CC has none"
fi

echo
[ -z "$failures" ] || echo "Failed:$failures"
result="$passed passed, $failed failed"
[ "$skipped" -eq 0 ] || result="$result, $skipped skipped"
echo "$result" | tee build/test/result
[ "$failed" -eq 0 ]
