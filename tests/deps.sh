#!/bin/sh
# Installs what the examples and tests need and this Debian lacks: compilers, libc's headers,
# libpng, and OpenGL without a window from OSMesa and from EGL, of which one is enough.
# Each need is tested by building (and running) the smallest program that has it.

CC=${CC:-cc}
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT

# builds "includes and the body of main" libraries...
builds()
{
    code=$1
    shift
    rm -f "$work/probe"
    printf '%s\n' "$code" > "$work/probe.c"
    $CC -o "$work/probe" "$work/probe.c" "$@" > /dev/null 2>&1
}

has_compiler()
{
    command -v "${CC%% *}" > /dev/null
}

has_cxx_compiler()
{
    cxx=${CXX:-c++}
    command -v "${cxx%% *}" > /dev/null
}

has_libc()
{
    builds '#include <math.h>
            #include <stdlib.h>
            int main(int count, char **words) { return sqrtf((float)count) > 9.0f && !words; }' -lm
}

has_png()
{
    builds '#include <png.h>
            int main(void) { return !png_access_version_number(); }' -lpng
}

has_osmesa()
{
    builds '#include <GL/osmesa.h>
            #include <GL/glext.h>
            int main(void) { return !OSMesaCreateContext(OSMESA_RGBA, 0); }' -lOSMesa &&
        "$work/probe" > /dev/null 2>&1
}

# The program runs, because EGL's library is there long before a driver is.
has_egl()
{
    builds '#include <EGL/egl.h>
            #include <EGL/eglext.h>
            #include <GL/gl.h>
            #include <GL/glext.h>
            int main(void) {
                PFNEGLGETPLATFORMDISPLAYEXTPROC get = (PFNEGLGETPLATFORMDISPLAYEXTPROC)
                    eglGetProcAddress("eglGetPlatformDisplayEXT");
                glGetError();
                return !get || !eglInitialize(get(EGL_PLATFORM_SURFACELESS_MESA,
                                                  EGL_DEFAULT_DISPLAY, 0), 0, 0); }' \
        -lEGL -lOpenGL && "$work/probe" > /dev/null 2>&1
}

osmesa_packages="libosmesa6-dev"
egl_packages="libegl-dev libopengl-dev libegl-mesa0 libgl1-mesa-dri"

# Prints the packages of all needs that are not met.
missing()
{
    has_compiler || echo gcc
    has_cxx_compiler || echo g++
    has_libc     || echo libc6-dev
    has_png      || echo libpng-dev
    has_osmesa   || echo "$osmesa_packages"
    has_egl      || echo "$egl_packages"
}

# The needs themselves, once nothing more can be installed: OSMesa or EGL is enough, and C++ is for
# one example.
enough()
{
    has_compiler && has_libc && has_png && { has_osmesa || has_egl; }
}

say()
{
    echo "deps: $*"
}

packages=$(missing | tr '\n' ' ')
if [ -z "$packages" ]; then
    say "nothing is missing"
    exit 0
fi

if ! command -v apt-get > /dev/null; then
    say "missing, by the names of Debian's packages: $packages"
    enough && say "what is here is enough to go on" && exit 0
    say "there is no apt-get here: please install them, and run this again"
    exit 1
fi

if [ "$(id -u)" -eq 0 ]; then
    as_root=
elif command -v sudo > /dev/null; then
    as_root=sudo
else
    say "missing: $packages"
    enough && say "what is here is enough to go on" && exit 0
    say "please run this as root"
    exit 1
fi

say "installing $packages(this may take some minutes)"
$as_root apt-get update -qq || say "the lists of packages could not be updated; going on"
for package in $packages; do # newer releases of Debian may be without OSMesa
    if ! apt-cache show "$package" > /dev/null 2>&1; then
        say "this system has no package $package; going on without it"
        packages=$(echo "$packages" | sed "s/$package//")
    fi
done
[ -z "$(echo "$packages" | tr -d ' ')" ] ||
    $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends $packages > /dev/null ||
    say "the installation failed"

packages=$(missing | tr '\n' ' ')
[ -z "$packages" ] && say "everything is here now" && exit 0
say "still missing: $packages"
enough && say "what is here is enough to go on" && exit 0
exit 1
