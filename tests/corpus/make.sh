#!/bin/sh
# Makes the seeds of the fuzzers anew: tests/corpus/NAME/seed-* for tests/fuzz_NAME.c. Files in
# there of other names are inputs that fuzzers found; they stay. The same seeds come out on every
# machine, but for bakes on one of the other byte order.

cd "$(dirname "$0")" || exit 1
rm -f ./*/seed-*

# n bytes from a generator of random numbers (Lehmer's), as escapes for printf
noise() # seed, n
{
    awk -v x="$1" -v n="$2" 'BEGIN {
        for (x = x * 7919 + 1; n > 0; n--) {
            x = x * 16807 % 2147483647
            printf "\\%03o", int(x / 65536) % 256
        }
    }'
}

seed() # directory, name, escapes
{
    mkdir -p "$1"
    printf "$3" > "$1/seed-$2"
}

# Calls and descriptors read their choices from the bytes: most bytes mean something ordinary.
for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24; do
    seed functions $i "$(noise $i 400)"
    seed terrain $i "$(noise $((100 + i)) 240)"
done
for i in 1 2 3 4 5 6 7 8; do
    seed pages $i "$(noise $((700 + i)) $((200 * i)))"
done
# Each call of tests/fuzz_functions.c again and again, after a field, a camera and a box.
call=0
while [ $call -lt 17 ]; do
    one=$(printf '\\%03o' $call)
    seed functions call-$call "$(noise $((200 + call)) 45)\003$(noise $call 30)\004$(noise \
        $((300 + call)) 12)$one$(noise $((400 + call)) 60)$one$(noise $((500 + call)) 60)"
    call=$((call + 1))
done

# What was found once: a pair of atlases is asked for a picture of 2^32 - 1 texels.
field='\000\000\000\001\000'
seed functions pair-huge \
    "$field\017\002\310\310\001\000\024\024\001\011\024\001\024\024"

# Elevation files behind six bytes: name (0 .hgt, 3 .pgm, 4 raw), raw format, width, depth, crop.
hgt='\000\000\000\000\000'
pgm='\003\000\000\000\000'
seed dem hgt-3 "$hgt$(noise 1 18)"
seed dem hgt-5-voids "$hgt$(noise 2 20)\200\000\200\000$(noise 3 26)"
seed dem hgt-odd "$hgt$(noise 4 17)"
seed dem hgt-empty "$hgt"
seed dem hgt-crop "\001\000\000\000\003\014\014\014\014$(noise 5 128)"
seed dem pgm-u8 "${pgm}P5 4 3 255\\n$(noise 6 12)"
seed dem pgm-u16 "${pgm}P5\\n# a comment\\n3 3\\n65535\\n$(noise 7 18)"
seed dem pgm-short "${pgm}P5 40 30 255\\n$(noise 8 12)"
seed dem pgm-huge "${pgm}P5 4294967297 4294967297 255\\n$(noise 9 12)"
seed dem pgm-zero "${pgm}P5 0 3 255\\n"
seed dem pgm-depth "${pgm}P5 2 2 70000\\n$(noise 10 8)"
seed dem pgm-cut "${pgm}P5 4"
plain='\005\000\000\000\000'
seed dem pgm-plain "${plain}P2 # c\n3 2 255\n1 2 3\n4 5 255\n"
seed dem pgm-plain-16 "${plain}P2\n2 2\n65535\n1 65535 300 4"
seed dem pgm-comment-end "${pgm}P5 2 2 255# c\nabcd"
seed dem pgm-crlf "${pgm}P5\r\n2 2\r\n65535\r\nabcdefgh"
seed dem esri "${plain}ncols 3\nnrows 2\nxllcorner 1\nyllcorner 42.0\ncellsize 0.01\n"\
"NODATA_value -9999\n1 2.5 -9999\n4 5e1 6\n"
seed dem png-8 "$plain\211PNG\r\n\032\n\000\000\000\015IHDR\000\000\000\003\000\000\000\002"\
"\010\000\000\000\000$(noise 31 40)"
seed dem tiff "${plain}II*\000\010\000\000\000\007\000$(noise 32 100)"
seed dem raw-square "\010\000\000\000\000$(noise 33 32)"
seed dem raw-stride "\004\002\014\014\014\012\022$(noise 34 40)"
for format in 1 2 3 4; do
    seed dem raw-$format "\004\00$format\017\017\000$(noise $format 900)"
done

# Bakes: a first byte (1 mends the checksum, 2 builds here, 4 turns, 8 another field), and behind
# the bake the bytes that choose the flight; the last four are built by the fuzzer itself.
make -s -C ../.. bake || exit 1
bake() # name, first byte, PGM, flight, options of build/bake...
{
    name=$1
    first=$2
    flight=$4
    printf "$3" > bake.pgm
    shift 4
    ../../build/bake bake.pgm bake.out "$@" > /dev/null || exit 1
    seed bake "$name" "$first"
    cat bake.out >> "bake/seed-$name"
    printf "$flight" >> "bake/seed-$name"
    rm -f bake.pgm bake.out
}
flat='\100\100\100\100\100\100\100\100\100'
bake flat '\000' "P5 3 3 255\n$flat" "$(noise 20 150)" --chunk 4 --triangles 32
bake mended '\001' "P5 3 3 255\n$(noise 11 9)" "$(noise 21 150)" --chunk 4 --triangles 40
bake levels '\001' "P5 8 6 255\n$(noise 12 48)" "$(noise 22 150)" --chunk 4 --triangles 32
bake large '\000' "P5 9 9 65535\n$(noise 13 162)" "$(noise 23 150)" --chunk 8
bake turned '\000' "P5 3 2 255\n$(noise 14 6)" "" --chunk 4 --triangles 32 --turn
bake other '\010' "P5 3 3 255\n$(noise 15 9)" "" --chunk 4 --triangles 32
for i in 2 3 6 7; do
    seed bake built-$i "\00$i$(noise $((600 + i)) 120)"
done

nan='\000\000\300\177'
seed dem raw-nan "\004\004\014\014\000$nan$nan\000\000\200\077\000\000\000\000"
