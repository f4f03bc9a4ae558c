#!/bin/sh
# Installs what `make check-portable`, `make sizes`, `make fuzz`, `make coverage` and `make analyse`
# use, on Debian: compilers for other machines, their emulators, fuzzer, analysers. The ordinary
# test needs none of it. What a release of Debian lacks is left out with a word.

packages="
    gcc g++ clang llvm libclang-rt-dev tcc
    gcc-i686-linux-gnu libc6-dev-i386-cross
    gcc-arm-linux-gnueabihf libc6-dev-armhf-cross
    gcc-aarch64-linux-gnu libc6-dev-arm64-cross
    gcc-mipsel-linux-gnu libc6-dev-mipsel-cross
    gcc-powerpc-linux-gnu libc6-dev-powerpc-cross
    gcc-riscv64-linux-gnu libc6-dev-riscv64-cross
    gcc-sh4-linux-gnu libc6-dev-sh4-cross
    gcc-arm-none-eabi libnewlib-arm-none-eabi
    qemu-user qemu-system-arm
    cppcheck clang-tidy valgrind"

say()
{
    echo "deps-portable: $*"
}

if ! command -v apt-get > /dev/null; then
    say "there is no apt-get here; these are the names of Debian's packages:" $packages
    exit 1
fi
as_root=
[ "$(id -u)" -eq 0 ] || as_root=sudo
$as_root apt-get update -qq || say "the lists of packages could not be updated; going on"

# The sanitizers' run-time library is named after clang's version in some releases.
version=$(apt-cache depends clang | sed -n 's/.*Depends: clang-\([0-9][0-9]*\)$/\1/p' | head -n 1)
here=
for package in $packages; do
    for name in "$package" "$(echo "$package" | sed "s/-rt-dev/-rt-$version-dev/")" ""; do
        if [ -z "$name" ]; then
            say "this system has no package $package; going on without it"
        elif apt-cache show "$name" > /dev/null 2>&1; then
            here="$here $name"
            break
        fi
    done
done
$as_root env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends $here > /dev/null || {
    say "the installation failed"
    exit 1
}
say "everything that there is, is here now"
