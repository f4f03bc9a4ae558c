/* Looks for holes in random flights of every mode: see holes.h for what a hole is.

   Build:  make bench_holes
   Use:    build/bench_holes [scenes [seed]]    so many scenes, from a seed on [20, 1]
           build/bench_holes seed.path.pose     one pose again, with those before it: a picture
                                                goes to build/bench/
   Leaves: build/bench/holes.md (what it prints)

   A scene is 6 paths of 12 poses, each drawn in 4 ways and in full: 288 frames, in 4 to 12 s. */
#define _POSIX_C_SOURCE 200112L
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "bench_say.h"
#include "holes.h"

typedef struct hunt {
    holes_sum sums[HOLES_PLACES][HOLES_WAYS];
    unsigned told; /* frames that break the law */
} hunt;

enum { TELL = 4000 };

static void look(void *user, const holes_scene *s, const holes_path *p, const holes_frame *f)
{
    hunt *h = (hunt *)user;
    (void)p;
    holes_add(&h->sums[f->place][f->way], f);
    if ((f->holes || f->torn || f->slits) && h->told++ < TELL)
        say("%u.%d.%d %s, %s, %s: %u px of holes, %u torn, first at %u, %u; %u px of slits; %u "
            "added\n",
            (unsigned)f->seed, f->path, f->pose, s->name, holes_places[f->place],
            holes_ways[f->way], (unsigned)f->holes, (unsigned)f->torn,
            (unsigned)(f->first % (size_t)f->width), (unsigned)(f->first / (size_t)f->width),
            (unsigned)f->slits, (unsigned)f->added);
}

static void tell_sums(const hunt *h)
{
    int place, way;
    say("\n| eye | way | frames | with holes | px | torn | px | with slits | px | shreds px "
        "| with added terrain | px | dB |\n");
    say("|-----|-----|-----|-----|-----|-----|-----|-----|-----|-----|-----|-----|-----|\n");
    for (place = 0; place < HOLES_PLACES; place++)
        for (way = 0; way < HOLES_WAYS; way++) {
            const holes_sum *sum = &h->sums[place][way];
            say("| %s | %s | %u | %u | %u | %u | %u | %u | %u | %u | %u | %u | %.2f |\n",
                holes_places[place], holes_ways[way], sum->frames, sum->frames_with_holes,
                (unsigned)sum->holes, sum->frames_with_torn, (unsigned)sum->torn,
                sum->frames_with_slits, (unsigned)sum->slits, (unsigned)sum->shreds,
                sum->frames_with_added, (unsigned)sum->added,
                image_psnr(sum->squares / (sum->frames ? sum->frames : 1u)));
        }
}

/* The pose to be drawn again, and its picture: the full mesh and all ways, side by side. */
typedef struct wanted {
    int pose;
    uint8_t *strip;
} wanted;

enum { TIMES = 3 }; /* enlarged */

static void paste(uint8_t *strip, int column, const uint8_t *rgb, int width, int height)
{
    int x, y;
    for (y = 0; y < height * TIMES; y++)
        for (x = 0; x < width * TIMES; x++)
            memcpy(strip + 3 * ((size_t)y * (size_t)(width * TIMES * (HOLES_WAYS + 1))
                                + (size_t)(column * width * TIMES + x)),
                   rgb + 3 * (y / TIMES * width + x / TIMES), 3);
}

static void say_vector(const char *name, const float v[3])
{
    say(", %s %.7g %.7g %.7g", name, (double)v[0], (double)v[1], (double)v[2]);
}

static void keep(void *user, const holes_scene *s, const holes_path *p, const holes_frame *f)
{
    wanted *w = (wanted *)user;
    char path[128];
    if (f->pose != w->pose)
        return;
    if (f->way == 0) {
        w->strip = (uint8_t *)need_memory((size_t)f->width * (size_t)f->height * 3
                                          * TIMES * TIMES * (HOLES_WAYS + 1));
        paste(w->strip, 0, f->full, f->width, f->height);
        say("%s, atlas %u, %s, fov %.7g", s->name, (unsigned)s->gl.atlas_size,
            holes_places[f->place], (double)p->fov);
        say_vector("eye", p->poses[f->pose].eye);
        say_vector("target", p->poses[f->pose].target);
        say_vector("up", p->up);
        say("\n");
    }
    paste(w->strip, f->way + 1, f->rgb, f->width, f->height);
    say("%s: %u px of holes, first at %u, %u; %u px added; %.2f dB; %u ground, %u impostors, %u "
        "waited for\n", holes_ways[f->way], (unsigned)f->holes,
        (unsigned)(f->first % (size_t)f->width), (unsigned)(f->first / (size_t)f->width),
        (unsigned)f->added, image_psnr(f->mean_square), f->stats.ground, f->stats.impostors,
        f->stats.waiting);
    if (f->way + 1 < HOLES_WAYS)
        return;
    snprintf(path, sizeof path, "%s/holes_%u_%d_%d.png", bench_folder, (unsigned)f->seed, f->path,
             f->pose);
    holes_need(image_write_png(path, w->strip, f->width * TIMES * (HOLES_WAYS + 1),
                               f->height * TIMES));
    say("%s: the full mesh, then these\n", path);
    free(w->strip);
}

int main(int argc, char **argv)
{
    static holes_scene s;
    static hunt h;
    unsigned scenes = 20, seed = 1, i;
    int path;
    wanted w = { 0, NULL };
    (void)check_only; /* of the tests */
    if (argc > 1 && sscanf(argv[1], "%u.%d.%d", &seed, &path, &w.pose) == 3) {
        say_open("holes_frame", 0);
        holes_open(&s, seed);
        holes_fly(&s, path, keep, &w);
        holes_close(&s);
        say_close();
        return 0;
    }
    if (argc > 1)
        scenes = (unsigned)strtoul(argv[1], NULL, 10);
    seed = argc > 2 ? (unsigned)strtoul(argv[2], NULL, 10) : 1u;
    say_open("holes", 0);
    for (i = 0; i < scenes; i++) {
        holes_open(&s, seed + i);
        if (i == 0)
            say_machine(context_renderer());
        for (path = 0; path < HOLES_PATHS; path++)
            holes_fly(&s, path, look, &h);
        holes_close(&s);
    }
    say("\nSeeds %u to %u.\n", seed, seed + scenes - 1u);
    tell_sums(&h);
    CHECK(h.told == 0);
    say("\n%s\n", check_bad ? "There are holes." : "No hole.");
    say_close();
    return 0;
}
