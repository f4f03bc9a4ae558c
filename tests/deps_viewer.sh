#!/bin/sh
# Installs what the viewer and its tests use, on Debian: GLFW, a virtual screen, and
# libtiff for GeoTIFF. With the word web: what the page and its tests use.

cd "$(dirname "$0")/.." || exit 1
packages="gcc make libc6-dev libpng-dev libtiff-dev
    libglfw3-dev libgl-dev libgl1-mesa-dri xvfb xauth"
[ "$1" != web ] || packages="emscripten node-acorn nodejs chromium"
as_root=
[ "$(id -u)" -eq 0 ] || as_root=sudo

missing()
{
    for package in $packages; do
        dpkg -s "$package" > /dev/null 2>&1 || echo "$package"
    done
}

needed=$(missing | tr '\n' ' ')
[ -n "$needed" ] || { echo "deps: nothing is missing"; exit 0; }
command -v apt-get > /dev/null || { echo "deps: missing, by Debian's names: $needed"; exit 1; }
echo "deps: installing $needed(this may take some minutes)"
$as_root apt-get update -qq
$as_root env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends $needed > /dev/null
[ -z "$(missing)" ] || { echo "deps: still missing: $(missing | tr '\n' ' ')"; exit 1; }
