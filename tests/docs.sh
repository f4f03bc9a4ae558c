#!/bin/sh
# Nothing that the documentation says may go stale: every piece of code in terrimp.h's comments and
# in README.md is compiled and run, tags and links lead somewhere, versions and commands agree.
#
# Code in terrimp.h follows a line that ends in "Example:" and is indented by 8 blanks; in README.md
# it stands in a fence of ```c. What has a main() is a program; what begins like a declaration
# stands at file scope; all else becomes the body of a main() with tests/docs_prelude.h before it.

cd "$(dirname "$0")/.." || exit 1
. tests/check.sh
CC=${CC:-cc}
work=build/test/docs
rm -rf $work
mkdir -p $work

# ---- snippets: each becomes a file named by its document and line

header_snippets()
{
    awk -v prefix="$work/terrimp.h." '
        /^        / && on { print substr($0, 9) > file; next }
        /^[[:space:]]*$/ && on { print "" > file; next }
        { on = 0 }
        /Example:$/ { on = 1; file = prefix FNR + 1 ".c" }' terrimp.h
}

readme_snippets()
{
    awk -v prefix="$work/README.md." '
        /^```c$/ { on = 1; file = prefix FNR + 1 ".c"; next }
        /^```/ { on = 0 }
        on { print > file }' README.md
}

# Writes the program that snippet $1 stands for.
program()
{
    if grep -q '\<main *(' "$1"; then
        cat "$1"
    elif grep -v '^[[:space:]]*$' "$1" | head -n 1 |
        grep -qE '^(static|typedef|struct|enum|void|#)'; then
        printf '#include "tests/docs_prelude.h"\n'
        cat "$1"
        printf '\nint main(void)\n{\n    docs_prepare();\n    return 0;\n}\n'
    else
        printf '#include "tests/docs_prelude.h"\nint main(void)\n{\n    docs_prepare();\n    {\n'
        cat "$1"
        printf '\n    }\n    return 0;\n}\n'
    fi
}

# Unused results and variables are fine in a fragment; in a program nothing is excused.
compiles_and_runs() # snippet
{
    program "$1" > "$1.program.c"
    excuse=
    grep -q docs_prelude.h "$1.program.c" && excuse="-Wno-unused"
    $CC -std=c99 -Wall -Wextra -Werror $excuse -I. "$1.program.c" -lm -o "$1.program" &&
        { "$1.program" > "$1.out" 2>&1 || { echo "$1: code $?"; tail "$1.out"; false; }; }
}

quick_start_is_short()
{
    first=$(ls $work/terrimp.h.*.c 2> /dev/null | sort -t . -k 3 -n | head -n 1)
    [ -n "$first" ] || { echo "the manual has no snippet"; return 1; }
    line=$(echo "$first" | sed 's/.*terrimp.h.\([0-9]*\).c/\1/')
    count=$(sed -e '/./,$!d' "$first" | sed -e :a -e '/^\n*$/{$d;N;ba' -e '}' | wc -l)
    echo "quick start: $count lines, from line $line"
    grep -q '\<main *(' "$first" && [ "$line" -le 45 ] && [ "$count" -le 30 ]
}

# ---- tags

manual_tags()
{
    sed '/\*\//q' terrimp.h | grep -o '>>[a-z][a-z0-9-]*' | sort
}

# The banners as lines "tag title", of the declarations or (impl-) of the implementation.
banners()
{
    sed -n 's/^\/\* ==== \(.*[^ =]\) =* *>>\([a-z][a-z0-9-]*\) \*\/$/\2 \1/p' terrimp.h
}

api_banners()
{
    banners | grep -v '^impl-'
}

implementation_banners()
{
    banners | sed -n 's/^impl-//p'
}

tags_differ()
{
    manual_tags > $work/manual-tags
    api_banners | sed 's/ .*//; s/^/>>/' | sort > $work/banner-tags
    diff $work/manual-tags $work/banner-tags
}

rooms_differ()
{
    api_banners > $work/api
    implementation_banners > $work/implementation
    diff $work/api $work/implementation
}

# ---- versions

# The first number like 1.2.3 in what comes in.
version()
{
    grep -oE '[0-9]+[.][0-9]+[.][0-9]+' | head -n 1
}

versions_differ()
{
    macro=$(sed -n 's/^#define TERRIMP_VERSION "\(.*\)"$/\1/p' terrimp.h)
    parts=$(sed -n 's/^#define TERRIMP_VERSION_\(MAJOR\|MINOR\|PATCH\) //p' terrimp.h |
        tr '\n' . | sed 's/[.]$//')
    title=$(head -n 1 terrimp.h | version)
    readme=$(grep -oE 'v[0-9]+[.][0-9]+[.][0-9]+' README.md | version)
    history=$(sed -n '/VERSION HISTORY/,$p' terrimp.h | version)
    for other in "parts $parts" "title $title" "README $readme" "history $history"; do
        [ "${other#* }" = "$macro" ] || echo "TERRIMP_VERSION is $macro, but $other"
    done
}

# ---- what the README promises

readme_says()
{
    grep -qF -e "$1" README.md || echo "README.md does not say: $1"
}

promises_missing()
{
    readme_says 'cc -std=c99 -I. tests/unit.c -lm -o unit'
    readme_says 'make deps demo'
    readme_says 'make deps test'
}

unknown_targets()
{
    grep -oE '(^|`)make( [a-z][a-z-]*)+' README.md | sed 's/.*make//' | tr ' ' '\n' | sort -u |
        grep . | while read -r target; do
            make -n "$target" > /dev/null 2>&1 || echo "README.md: make $target"
        done
}

dead_links()
{
    for page in README.md examples/README.md tests/results/README.md; do
        grep -oE '(\]\(|src=")[^)"#:]+[)"]' $page | sed 's/^](//; s/^src="//; s/[)"]$//' |
            while read -r path; do
                [ -e "$(dirname $page)/$path" ] || echo "$page: no $path"
            done
    done
}

# Examples say in their first comment how they are built (tests/examples.sh does what they say).
build_lines_missing()
{
    for source in examples/*.c; do
        line=$(sed -n 's/^ *Build: *//p' "$source" | head -n 1)
        [ -n "$line" ] || echo "$source: no line 'Build:' in its first comment"
    done
}

header_snippets
check "the manual begins with a quick start: a program of <= 30 lines" quick_start_is_short
check "every >>tag of the manual has one banner, and the reverse" prints_nothing tags_differ
check "declarations and implementation have the same sections" prints_nothing rooms_differ
if [ -f README.md ]; then
    readme_snippets
    check "README.md names the commands that work" prints_nothing promises_missing
    check "README.md names targets of the Makefile" prints_nothing unknown_targets
    check "pages link to what is there" prints_nothing dead_links
    check "all versions are the same" prints_nothing versions_differ
else
    check "there is a README.md" false
fi
check "every example says how it is built" prints_nothing build_lines_missing
for snippet in $work/*.md.*.c $work/*.h.*.c; do
    [ -f "$snippet" ] || continue
    name=${snippet##*/}
    check "code at $name compiles and runs" compiles_and_runs "$snippet"
done
check_report
