#!/bin/sh
# What a header must not do to the program that includes it, and the rules of form that a script
# can check. The compiler's object of the whole implementation is looked at, and the text.

cd "$(dirname "$0")/.." || exit 1
. tests/check.sh
CC=${CC:-cc}
work=build/test/hygiene
mkdir -p $work
object=$work/terrimp.o

# ---- the object

exported_names()
{
    nm -g --defined-only $object | awk '{ print $3 }' | grep -v '^terrimp_'
}

# Names with a dot are the compiler's: static tables within functions, parts of functions.
private_names()
{
    nm --defined-only $work/plain.o | awk '$2 ~ /[a-z]/ { print $3 }' | grep -v '[.]' |
        grep -vE '^terrimpi?_'
}

foreign_names()
{
    nm -u $object | awk '{ print $2 }' | grep -vxE \
        'mem(cpy|move|set|cmp|chr)|malloc|free|__assert_fail|__stack_chk_fail' |
        grep -vxE '(sqrt|sin|cos|tan|asin|acos|atan2|floor|ceil|fabs)f'
}

mutable_data()
{
    objdump -t $object | grep -E ' [.](data|bss|tdata|tbss)[^ ]*[[:space:]]' | grep ' O '
}

foreign_names_without_malloc()
{
    nm -u $work/no_malloc.o | grep -wE 'malloc|free'
}

big_stacks()
{
    awk '$2 > 4096 || $3 == "dynamic"' $work/terrimp.su
}

# ---- macros: what the header defines beyond the system headers that it includes

macros() # flags...
{
    $CC -std=c99 -E -dM -x c "$@" /dev/null | awk '{ sub(/[(].*/, "", $2); print $2 }' | sort -u
}

system_headers="-include stddef.h -include stdint.h -include math.h -include string.h
                -include assert.h -include stdlib.h"

leaked_macros()
{
    macros $system_headers > $work/system
    macros $system_headers -DTERRIMP_IMPLEMENTATION -include ./terrimp.h | comm -13 $work/system - |
        grep -vE '^TERRIMPI?_'
}

# Includes of the declarations alone: no more than <stddef.h> and <stdint.h>.
leaked_macros_of_declarations()
{
    macros -include stddef.h -include stdint.h > $work/system
    macros -include ./terrimp.h | comm -13 $work/system - | grep -v '^TERRIMP_'
}

# ---- the text

# The header without its comments and without what stands between quotes; lines keep their numbers.
code()
{
    awk '{
        line = $0 "\n"
        out = ""
        while (line != "") {
            two = substr(line, 1, 2)
            one = substr(line, 1, 1)
            step = 1
            if (comment) {
                if (two == "*/") { comment = 0; step = 2 }
            } else if (quote != "") {
                if (one == "\\") step = 2
                else if (one == quote) { quote = ""; out = out one }
            } else if (two == "/*") {
                comment = 1; step = 2
            } else {
                if (one == "\"" || one == "\047") quote = one
                out = out one
            }
            line = substr(line, step + 1)
        }
        if (comment || quote != "") out = out "\n"
        printf "%s", out
    }' terrimp.h
}

in_code() # extended regular expression
{
    grep -nE "$1" $work/code
}

our_sources()
{
    find terrimp.h examples tests -name '*.[ch]' -o -name '*.cpp' -o -name '*.sh'
}

long_lines()
{
    our_sources | xargs awk 'length > 100 { print FILENAME ":" FNR ": " length " columns" }'
}

tabs_and_trailing_blanks()
{
    our_sources | xargs grep -nE "$(printf '\t')|[[:space:]]\$"
}

code > $work/code
check "the implementation compiles" \
    $CC -std=c99 -O2 -fno-pic -fstack-usage -DTERRIMP_IMPLEMENTATION -x c -c terrimp.h -o $object
check "the implementation compiles without malloc" $CC -std=c99 -O0 -DTERRIMP_IMPLEMENTATION \
    -DTERRIMP_NO_MALLOC -x c -c terrimp.h -o $work/no_malloc.o
check "the implementation compiles without optimisation" \
    $CC -std=c99 -O0 -DTERRIMP_IMPLEMENTATION -x c -c terrimp.h -o $work/plain.o

check "every exported name begins with terrimp_" prints_nothing exported_names
check "every private name begins with terrimpi_" prints_nothing private_names
check "only libc and libm are used, and floats only" prints_nothing foreign_names
check "without malloc there is no malloc" prints_nothing foreign_names_without_malloc
check "no variable can change" prints_nothing mutable_data
if [ -s $work/terrimp.su ]; then
    check "no function uses more than 4 KiB of stack" prints_nothing big_stacks
    sort -t "$(printf '\t')" -k 2 -n -r $work/terrimp.su | head -n 1 |
        awk '{ sub(/.*:/, "", $1); print "largest stack: " $2 " bytes in " $1 }'
else
    skip "stack of functions: $CC does not report it"
fi

check "no macro is left behind but TERRIMP..." prints_nothing leaked_macros
check "the declarations define no macro but TERRIMP_..." \
    prints_nothing leaked_macros_of_declarations

check "no double in the code" \
    prints_nothing in_code '\<(double|sqrt|sin|cos|tan|fabs|floor)\>'
number='(^|[^0-9A-Za-z_.])(([0-9]+[.][0-9]*|[.][0-9]+)(e[-+]?[0-9]+)?|[0-9]+e[-+]?[0-9]+)'
check "no number is a double" prints_nothing in_code "$number([^0-9.fe]|\$)"
check "no name near, far, min( or max(" prints_nothing in_code '\<(near|far)\>|\<(min|max) *[(]'
check "no // comments in the header" prints_nothing in_code '//'
check "no line is wider than 100 columns" prints_nothing long_lines
check "no tabs, no blanks at the end of a line" prints_nothing tabs_and_trailing_blanks
check_report
