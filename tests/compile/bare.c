/* A machine without an operating system: no malloc, no assert.h, all memory in static arrays. A
   terrain of 65 x 65 u8 samples is built, and two frames of it are drawn.
   Compiled for such a machine it is linked without startup files, and its entry tells a debugger
   or emulator by semihosting how it ended and how much stack it took; everywhere else it is a
   program like any other. */
#include <stdint.h>

static int broken_asserts;

#define TERRIMP_NO_MALLOC
#define TERRIMP_ASSERT(condition) ((void)((condition) ? 0 : broken_asserts++))
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#define SIDE 65

static uint8_t samples[SIDE][SIDE];
static uint64_t terrain_memory[32768 / 8], view_memory[65536 / 8], scratch[131072 / 8];
static uint32_t captures, impostors, grounds;

#if defined(__arm__) && !defined(__linux__)
#define BARE_METAL

/* What lies below the stack is painted, and later looked at for how far down the paint is gone:
   nothing else writes there on a machine without interrupts. */
#define PAINT 0xa5a5a5a5u
#define PAINTED_WORDS 4096

static volatile uint32_t *painted;

static void paint_stack(void)
{
    uint32_t *top, i;
    __asm__ volatile("mov %0, sp" : "=r"(top));
    painted = top - PAINTED_WORDS;
    for (i = 0; i < PAINTED_WORDS; i++)
        painted[i] = PAINT;
}

/* Bytes of stack used since it was painted. */
static uint32_t stack_used(void)
{
    uint32_t i = 0;
    while (i < PAINTED_WORDS && painted[i] == PAINT)
        i++;
    return (PAINTED_WORDS - i) * 4u;
}

/* Semihosting's call 4 writes a string. */
static void print(const char *text)
{
    __asm__ volatile("movs r0, #4\n mov r1, %0\n bkpt 0xab" : : "r"(text) : "r0", "r1", "memory");
}

static void print_bytes(const char *name, uint32_t value)
{
    char text[12];
    uint32_t at = sizeof text;
    text[--at] = 0;
    do
        text[--at] = (char)('0' + value % 10u);
    while ((value /= 10u) > 0);
    print(name);
    print(text + at);
    print(" bytes\n");
}
#else
static void paint_stack(void) { }
static uint32_t stack_used(void) { return 0; }
static void print_bytes(const char *name, uint32_t value) { (void)name, (void)value; }
#endif

static void on_capture(void *user, const terrimp_capture_command *command)
{
    (void)user, (void)command;
    captures++;
}

static void on_impostor(void *user, const terrimp_impostor_command *command)
{
    (void)user, (void)command;
    impostors++;
}

static void on_ground(void *user, const terrimp_ground_command *command)
{
    (void)user, (void)command;
    grounds++;
}

static terrimp_terrain *make_terrain(void)
{
    terrimp_terrain_desc desc;
    terrimp_terrain *terrain = NULL;
    uint32_t x, z;
    for (z = 0; z < SIDE; z++)
        for (x = 0; x < SIDE; x++)
            samples[z][x] = (uint8_t)((x * (SIDE - 1 - x) / 16 + z) ^ (x * z / 97 & 15));
    memset(&desc, 0, sizeof desc);
    desc.field.samples = samples;
    desc.field.width = desc.field.depth = SIDE;
    desc.field.format = TERRIMP_FORMAT_U8;
    desc.field.height_scale = 0.1f;
    desc.chunk_quads = 16;
    desc.triangle_budget = 48;
    if (terrimp_terrain_init(&desc, terrain_memory, sizeof terrain_memory, &terrain) != TERRIMP_OK
        || terrimp_terrain_build(terrain, scratch, sizeof scratch) != TERRIMP_OK)
        return NULL;
    return terrain;
}

static int draw_frames(terrimp_view *view)
{
    terrimp_camera camera;
    terrimp_callbacks callbacks;
    int frame;
    memset(&camera, 0, sizeof camera);
    camera.eye[0] = 32.0f, camera.eye[1] = 15.0f;
    camera.forward[1] = -0.2f, camera.forward[2] = 1.0f;
    camera.width_px = 320, camera.height_px = 240;
    camera.z_near = 1.0f, camera.z_far = 300.0f;
    memset(&callbacks, 0, sizeof callbacks);
    callbacks.begin_capture = callbacks.end_capture = on_capture;
    callbacks.draw_impostor = on_impostor;
    callbacks.draw_ground = on_ground;
    for (frame = 0; frame < 2; frame++, camera.eye[2] += 1.0f)
        if (terrimp_view_update(view, &camera) != TERRIMP_OK
            || terrimp_view_render(view, &callbacks) != TERRIMP_OK)
            return 0;
    return 1;
}

/* 0, or the number of the step that failed. */
static int draw_in_mode(terrimp_terrain *terrain, int mode)
{
    terrimp_view *view = NULL;
    terrimp_view_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.mode = mode;
    desc.atlas_size = 256;
    desc.max_impostors = 16;
    if (terrimp_view_init(terrain, &desc, view_memory, sizeof view_memory, &view) != TERRIMP_OK)
        return 2;
    return draw_frames(view) ? 0 : 3;
}

int main(void)
{
    terrimp_terrain *terrain;
    uint32_t building, drawing;
    int failure;
    paint_stack();
    terrain = make_terrain();
    building = stack_used();
    if (terrain == NULL)
        return 1;
    paint_stack();
    failure = draw_in_mode(terrain, TERRIMP_MODE_AUTO);
    if (!failure)
        failure = draw_in_mode(terrain, TERRIMP_MODE_IMPOSTOR);
    drawing = stack_used();
    if (failure)
        return failure;
    if (grounds == 0 || impostors == 0 || captures == 0)
        return 4;
    print_bytes("     stack for building: ", building);
    print_bytes("     stack for a frame:  ", drawing);
    if (building > 8192 || drawing > 4096)
        return 5;
    return broken_asserts == 0 ? 0 : 6;
}

#ifdef BARE_METAL
/* Where the machine starts. Semihosting's call 0x18 ends the emulator; 0x20026: all went well. */
void bare_entry(void);
void bare_entry(void)
{
    uint32_t reason;
#ifdef __ARM_FP
    *(volatile uint32_t *)0xe000ed88u |= 0xfu << 20; /* CPACR: the floating-point unit is on */
    __asm__ volatile("dsb\n isb" : : : "memory");
#endif
    reason = main() == 0 ? 0x20026u : 0x20023u;
    __asm__ volatile("movs r0, #0x18\n mov r1, %0\n bkpt 0xab" : : "r"(reason)
                     : "r0", "r1", "memory");
    for (;;)
        ;
}
#endif
