/* What the fuzzers share: they read their choices from the input's bytes, and each is a libFuzzer
   target as well as a program that replays files. To add one: copy the last lines of
   tests/fuzz_dem.c, name it tests/fuzz_NAME.c, and let tests/corpus/make.sh make seeds for it.

   Build as a program: cc -std=c99 -g -fsanitize=address,undefined -I. tests/fuzz_NAME.c -lm
   Build as a fuzzer:  clang -DFUZZER -fsanitize=fuzzer,address,undefined -I. tests/fuzz_NAME.c */
#ifndef FUZZ_H
#define FUZZ_H

#include <float.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A broken promise ends the program, so that the fuzzer keeps the input. */
#define FUZZ_CHECK(condition)                                                     \
    do {                                                                          \
        if (!(condition)) {                                                       \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);       \
            abort();                                                              \
        }                                                                         \
    } while (0)

/* The input; an exhausted one goes on with zeros. */
static const uint8_t *fuzz_bytes;
static size_t fuzz_left;

static uint32_t fuzz_u8(void)
{
    if (fuzz_left == 0)
        return 0;
    fuzz_left--;
    return *fuzz_bytes++;
}

static uint32_t fuzz_u32(void)
{
    uint32_t low = fuzz_u8() | fuzz_u8() << 8;
    return low | (fuzz_u8() | fuzz_u8() << 8) << 16;
}

/* 0..count - 1, count <= 256 */
static uint32_t fuzz_below(uint32_t count)
{
    return fuzz_u8() % count;
}

/* Mostly of an ordinary size, sometimes an end of the type. */
static uint32_t fuzz_size(uint32_t ordinary)
{
    static const uint32_t ends[] = { 0, 1, 2, 65535, 65536, 65537, 65538, 0x7fffffff, 0x80000000u,
                                     0xffffffffu };
    uint32_t kind = fuzz_u8();
    return kind < 10 ? ends[kind] : kind % (ordinary + 1);
}

static float fuzz_from_bits(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Mostly between 0 and scale, sometimes negative, extreme, or no number at all. */
static float fuzz_float(float scale)
{
    static const float ends[] = { 0.0f, 1.0f, -1.0f, FLT_MAX, -FLT_MAX, FLT_MIN, FLT_EPSILON,
                                  1e-20f, 1e20f };
    uint32_t kind = fuzz_u8();
    if (kind < 9)
        return ends[kind];
    if (kind == 9)
        return fuzz_from_bits(0x7fc00000u | fuzz_u8());
    if (kind == 10)
        return fuzz_from_bits(0x7f800000u | (fuzz_u8() & 1u) << 31);
    if (kind < 20)
        return fuzz_from_bits(fuzz_u32());
    return scale * (float)(kind - 20) / 235.0f * (kind < 60 ? -1.0f : 1.0f);
}

/* Never bad: lets most calls get past the checks of their arguments. */
static float fuzz_good(float low, float high)
{
    return low + (high - low) * (float)(fuzz_u8() | fuzz_u8() << 8) / 65535.0f;
}

static int fuzz_finite(const float *values, size_t count)
{
    while (count-- > 0)
        if (!(values[count] - values[count] == 0.0f))
            return 0;
    return 1;
}

static void *fuzz_take(size_t bytes)
{
    void *memory = malloc(bytes > 0 ? bytes : 1);
    FUZZ_CHECK(memory != NULL);
    return memory;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

#ifndef FUZZER
/* Replays files; ends as the tests do. */
int main(int count, char **files)
{
    int i, passed = 0, failed = 0;
    for (i = 1; i < count; i++) {
        FILE *file = fopen(files[i], "rb");
        static uint8_t bytes[1 << 20];
        if (file == NULL) {
            fprintf(stderr, "%s: cannot be read\n", files[i]);
            failed++;
            continue;
        }
        {
            size_t size = fread(bytes, 1, sizeof bytes, file);
            uint8_t *exact = (uint8_t *)fuzz_take(size); /* so that its end is guarded */
            fclose(file);
            if (size > 0)
                memcpy(exact, bytes, size);
            if (getenv("FUZZ_VERBOSE"))
                fprintf(stderr, "%s\n", files[i]);
            LLVMFuzzerTestOneInput(exact, size);
            free(exact);
            passed++;
        }
    }
    printf("%d passed, %d failed\n", passed, failed);
    return failed != 0;
}
#endif

#endif
