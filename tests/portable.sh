#!/bin/sh
# Where the library compiles and runs, a line a check that says PASS, FAIL or SKIP: all compilers
# and standards, other machines under an emulator, machines without an operating system. What is not
# installed is skipped; `make deps-portable` installs it, on Debian.
# Arguments: which parts [all]: compilers, bare, or a machine's name as below; CHECK_FLAGS, more
# options for the unit tests on other machines, such as -DCHECK_SEED=7.

cd "$(dirname "$0")/.." || exit 1
check_every=1
. tests/check.sh
work=build/test/portable
mkdir -p $work
parts=" ${*:-all} "

strict="-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wdouble-promotion
        -Wcast-qual -Wundef -Wvla -Wstrict-prototypes -Wmissing-prototypes -Wc++-compat -Werror"

have()
{
    command -v "$1" > /dev/null
}

wanted() # part
{
    case $parts in
    *" all "* | *" $1 "*) ;;
    *) false ;;
    esac
}

# ---- compilers: tests/compile/run.sh prints the lines, its closing line is added up here

compilers()
{
    sh tests/compile/run.sh all > $work/compilers 2>&1
    grep -v ' passed, ' $work/compilers
    line=$(grep ' passed, ' $work/compilers | tail -n 1)
    set -- $(echo "${line:-0 passed, 1 failed}" | tr -cs '0-9' ' ')
    check_passed=$((check_passed + $1))
    check_failed=$((check_failed + $2))
    check_skipped=$((check_skipped + ${3:-0}))
}

# ---- machines with Linux, under qemu's user mode

builds_and_runs() # emulator, compiler and flags...
{
    emulator=$1
    shift
    "$@" -I. -lm -o $work/program && $emulator $work/program
}

# The unit tests' own closing line goes to the screen. On most machines this takes some minutes.
unit_tests_pass() # emulator, compiler and flags...
{
    emulator=$1
    shift
    "$@" $CHECK_FLAGS -I. -lm -o $work/unit || return
    timeout 1800 $emulator $work/unit > $work/unit.txt 2>&1
    code=$?
    [ $code -eq 0 ] || { grep -v '^ACMR' $work/unit.txt | tail -n 20; echo "code $code"; }
    echo "     $(tail -n 1 $work/unit.txt)"
    return $code
}

# Every machine makes a bake, and opens those of all others when they are made.
makes_bake() # name, emulator, compiler and flags...
{
    program=$work/abroad-$1
    bake=$work/$1.bake
    emulator=$2
    shift 2
    "$@" -I. tests/compile/bake_abroad.c -lm -o $program && $emulator $program make $bake &&
        echo "$emulator $program" >> $work/openers && echo $bake >> $work/bakes
}

bakes_travel()
{
    while read -r opener; do
        check "$(wc -l < $work/bakes) machines' bakes on ${opener##*abroad-}" \
            $opener open $(cat $work/bakes) < /dev/null
    done < $work/openers
}

# Nothing where the kernel runs 32-bit programs of this machine itself, else what runs them.
by_32_bits()
{
    ! have i686-linux-gnu-gcc && return
    echo 'int main(void) { return 0; }' | i686-linux-gnu-gcc -static -x c - -o $work/small
    $work/small 2> /dev/null || echo qemu-i386
}

# machine name "what it shows" "compiler and flags" "emulator, or none" ["more sources"]
# Programs are linked statically, so that nothing of the machine need be installed but the compiler.
machine()
{
    wanted "$1" || return
    compiler=${3%% *}
    emulator=${4%% *}
    if ! have "$compiler" || { [ -n "$emulator" ] && ! have "$emulator"; }; then
        skip "$1, $2: $compiler${emulator:+ or $emulator} is not installed"
        return
    fi
    check "$1: compiles without a warning, and runs" \
        builds_and_runs "$4" $3 -std=c99 -static $strict tests/compile/plain.c
    check "$1: all memory in static arrays" \
        builds_and_runs "$4" $3 -std=c99 -static tests/compile/bare.c
    check "$1: makes a bake" makes_bake "$1" "$4" $3 -std=c99 -static
    check "$1: unit tests, $2" unit_tests_pass "$4" $3 -static tests/unit.c $5
    check "$1: flights, $2" unit_tests_pass "$4" $3 -static tests/flights.c $5
}

# Sizes and indices that fit 64 bits may not fit 32: the fuzzers' corpus, undefined behaviour ends
# the program.
corpus_in_32_bits()
{
    compiler="i686-linux-gnu-gcc -O2 -std=gnu99 -static -Wno-unused-function
              -fsanitize=undefined -fsanitize-undefined-trap-on-error"
    if ! have "${compiler%% *}"; then
        skip "x87, the fuzzers' corpus: ${compiler%% *} is not installed"
        return
    fi
    for corpus in tests/corpus/*/; do
        corpus=${corpus%/}
        fuzzer=fuzz_${corpus##*/}
        check "x87: the corpus of $fuzzer" replays $fuzzer $corpus
    done
}

replays() # fuzzer, corpus
{
    $compiler -DTERRIMP_STATIC -I. "tests/$1.c" -lm -o $work/fuzzer && $x87 $work/fuzzer "$2"/*
}

machines()
{
    x87=$(by_32_bits)
    machine x87 "80-bit registers, as C99 has them" "i686-linux-gnu-gcc -O2 -std=c99" "$x87"
    ! wanted x87 || corpus_in_32_bits
    machine x87-gnu "80-bit registers, rounded at the compiler's whim" \
        "i686-linux-gnu-gcc -O2 -std=gnu99" "$x87"
    machine arm "32 bits, hard float" "arm-linux-gnueabihf-gcc -O2 -std=c99" qemu-arm
    machine aarch64 "products fused with sums" "aarch64-linux-gnu-gcc -O2 -std=gnu99" qemu-aarch64
    machine mipsel "32 bits" "mipsel-linux-gnu-gcc -O2 -std=c99" qemu-mipsel
    machine powerpc "32 bits, big-endian, products fused with sums" \
        "powerpc-linux-gnu-gcc -O2 -std=gnu99" qemu-ppc tests/compile/powerpc_mffs.c
    machine riscv64 "64 bits" "riscv64-linux-gnu-gcc -O2 -std=c99" qemu-riscv64
    machine sh4 "32 bits" "sh4-linux-gnu-gcc -O2 -std=c99" qemu-sh4
}

# ---- machines without an operating system, under qemu's system mode

bare() # name, "flags", board
{
    elf=$work/bare-$1.elf
    if ! have arm-none-eabi-gcc; then
        skip "$1: arm-none-eabi-gcc is not installed"
        return
    fi
    check "$1: links without an operating system" arm-none-eabi-gcc $2 -mthumb -std=c99 -Os \
        -ffreestanding $strict -I. tests/compile/bare.c -nostartfiles -T tests/compile/bare.ld \
        -lm -lc -lgcc -o "$elf"
    if have qemu-system-arm; then
        check "$1: runs" timeout 300 qemu-system-arm -M "$3" -semihosting -nographic \
            -monitor none -serial none -kernel "$elf"
    else
        skip "$1: qemu-system-arm is not installed"
    fi
}

! wanted compilers || compilers
if wanted bare; then
    bare cortex-m0 "-mcpu=cortex-m0 -mfloat-abi=soft" mps2-an385
    bare cortex-m4 "-mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16" mps2-an386
    check "Cortex-M0 and M4: the run-time part needs no double and no 64-bit division" \
        sh tests/sizes.sh
fi
rm -f $work/openers $work/bakes
check "$(uname -m): makes a bake" makes_bake "$(uname -m)" "" "${CC:-cc}" -std=c99
machines
bakes_travel
check_report
