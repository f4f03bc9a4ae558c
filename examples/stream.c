/* Shows how a host feeds a terrain that is larger than memory: flies over a file of pages
   (examples/pages.c) while a thread reads what the view wants, from a disk as slow as you like.
   Build:  cc -O2 -std=c99 -I. examples/stream.c -lm -lpthread -o stream
   Use:    stream FILE [--slots N] [--latency MS] [--rate MB] [--frames N] [--speed WU] [--compare]
           --latency, --rate: of a read, in milliseconds and MB a second; 256 are under way at once
           --compare: the same path with all pages here; needs memory for them
   Expect: each second what has been read, how much is here, and what pages were missing for; at
           last how many frames drew just what memory would have. */
#define _XOPEN_SOURCE 700
#define _FILE_OFFSET_BITS 64
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { MOST = 256 }; /* reads under way: what is slow is the way there */

/* A read: the frame's thread owns those that are free or done, the reading thread the others. */
typedef struct job {
    uint32_t node;
    terrimp_page_info info;
    void *page;
    enum { FREE, WAITING, READING, DONE, FAILED } state;
    double due; /* [s] when it has come all the way */
} job;

typedef struct reader {
    int file;
    double latency, rate; /* [s], [bytes a second] */
    pthread_mutex_t lock;
    pthread_cond_t wake;
    job jobs[MOST];
    int stop;
    uint64_t bytes;
    uint32_t reads;
} reader;

static void pause_for(double seconds)
{
    struct timespec t;
    if (seconds <= 0.0)
        return;
    t.tv_sec = (time_t)seconds;
    t.tv_nsec = (long)((seconds - (double)t.tv_sec) * 1e9);
    nanosleep(&t, NULL);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *read_pages(void *shared)
{
    reader *r = shared;
    pthread_mutex_lock(&r->lock);
    while (!r->stop) {
        job *next = NULL;
        int i, ok;
        for (i = 0; i < MOST; i++)
            if (r->jobs[i].state == WAITING && (!next || r->jobs[i].due < next->due))
                next = &r->jobs[i];
        if (!next) {
            pthread_cond_wait(&r->wake, &r->lock);
            continue;
        }
        next->state = READING;
        pthread_mutex_unlock(&r->lock);
        pause_for(next->due - now());
        ok = pread(r->file, next->page, next->info.bytes, (off_t)next->info.offset) ==
             (ssize_t)next->info.bytes;
        pthread_mutex_lock(&r->lock);
        next->state = ok ? DONE : FAILED;
        r->bytes += next->info.bytes;
        r->reads++;
    }
    pthread_mutex_unlock(&r->lock);
    return NULL;
}

/* Before an update: takes what has come, parents before their children. */
static void take(reader *r, terrimp_terrain *terrain)
{
    int i, taken;
    pthread_mutex_lock(&r->lock);
    do {
        taken = 0;
        for (i = 0; i < MOST; i++) {
            job *j = &r->jobs[i];
            if (j->state == FAILED)
                terrimp_page_fail(terrain, j->node);
            else if (j->state != DONE || terrimp_page_put(terrain, j->node) == TERRIMP_E_PAGE)
                continue;
            j->state = FREE; /* one that is damaged will be wanted again */
            taken = 1;
        }
    } while (taken);
    pthread_mutex_unlock(&r->lock);
}

/* After it: gives up what nobody wants any more, asks for the rest. */
static void ask(reader *r, terrimp_terrain *terrain)
{
    terrimp_want wants[MOST];
    uint32_t gone[MOST], gone_count = 0, count = 0, i, k;
    terrimp_pages_withdrawn(terrain, gone, MOST, &gone_count);
    terrimp_pages_wants(terrain, wants, MOST, &count);
    pthread_mutex_lock(&r->lock);
    for (i = 0; i < MOST; i++)
        for (k = 0; k < gone_count && k < MOST; k++)
            if (gone[k] == r->jobs[i].node &&
                (r->jobs[i].state == WAITING || r->jobs[i].state == DONE)) {
                terrimp_page_fail(terrain, gone[k]);
                r->jobs[i].state = FREE;
            }
    for (i = k = 0; i < count; i++) {
        while (k < MOST && r->jobs[k].state != FREE)
            k++;
        if (k == MOST)
            break;
        if (terrimp_page_get_info(terrain, wants[i].node, &r->jobs[k].info) != TERRIMP_OK ||
            terrimp_page_begin(terrain, wants[i].node, &r->jobs[k].page) != TERRIMP_OK)
            continue;
        r->jobs[k].node = wants[i].node;
        r->jobs[k].due = now() + r->latency + (double)r->jobs[k].info.bytes / r->rate;
        r->jobs[k].state = WAITING;
    }
    pthread_cond_broadcast(&r->wake);
    pthread_mutex_unlock(&r->lock);
}

/* What a frame draws, as one number. */
static void mix(uint64_t *sum, const void *bytes, size_t count)
{
    const unsigned char *b = bytes;
    while (count-- > 0)
        *sum = (*sum ^ *b++) * 1099511628211u;
}

static void draw_ground(void *user, const terrimp_ground_command *c) { mix(user, c, sizeof *c); }
static void draw_impostor(void *user, const terrimp_impostor_command *c)
{
    mix(user, &c->node, sizeof c->node);
}
static void capture(void *user, const terrimp_capture_command *c) { (void)user, (void)c; }

static uint64_t render(terrimp_view *view)
{
    terrimp_callbacks draw = {0};
    uint64_t sum = 14695981039346656037u;
    draw.user = &sum;
    draw.draw_ground = draw_ground;
    draw.draw_impostor = draw_impostor;
    draw.begin_capture = draw.end_capture = capture;
    return terrimp_view_render(view, &draw) == TERRIMP_OK ? sum : 0;
}

/* A terrain of the pages with a view; NULL when there is not enough memory. */
static terrimp_terrain *open_terrain(const void *header, uint32_t slots, terrimp_view **view)
{
    terrimp_view_desc settings = {0};
    terrimp_terrain *terrain = NULL;
    size_t bytes = terrimp_pages_bytes(header, TERRIMP_PAGES_HEADER_BYTES, slots);
    void *memory = bytes ? malloc(bytes) : NULL;
    terrimp_heightfield field = {0};
    field.spacing_x = field.spacing_z = 30.0f;
    if (!memory || terrimp_pages_open(&field, header, TERRIMP_PAGES_HEADER_BYTES, slots, memory,
                                      bytes, &terrain) != TERRIMP_OK ||
        terrimp_view_create(terrain, &settings, NULL, view) != TERRIMP_OK)
        return NULL;
    return terrain;
}

int main(int argc, char **argv)
{
    static reader r;
    unsigned char header[TERRIMP_PAGES_HEADER_BYTES];
    terrimp_pages_info info;
    terrimp_terrain *terrain, *all = NULL;
    terrimp_view *view, *all_view = NULL;
    terrimp_camera camera = {0};
    terrimp_stats stats;
    pthread_t thread;
    uint32_t slots = 900, frames = 600, frame, i, node, late = 0, same = 0, here;
    float speed = 20.0f, ground = 0.0f;
    double start, worst = 0.0;
    int k, compare = 0;
    r.rate = 1e12;
    for (k = 2; k < argc; k++) {
        double value = k + 1 < argc ? atof(argv[k + 1]) : 0.0;
        if (strcmp(argv[k], "--compare") == 0) {
            compare = 1;
            continue;
        }
        if (strcmp(argv[k], "--slots") == 0)
            slots = (uint32_t)value;
        else if (strcmp(argv[k], "--latency") == 0)
            r.latency = value * 1e-3;
        else if (strcmp(argv[k], "--rate") == 0 && value > 0.0)
            r.rate = value * 1e6;
        else if (strcmp(argv[k], "--frames") == 0)
            frames = (uint32_t)value;
        else if (strcmp(argv[k], "--speed") == 0)
            speed = (float)value;
        k++;
    }
    r.file = argc > 1 ? open(argv[1], O_RDONLY) : -1;
    if (r.file < 0 || pread(r.file, header, sizeof header, 0) != (ssize_t)sizeof header ||
        terrimp_pages_check(header, sizeof header, &info) != TERRIMP_OK ||
        !(terrain = open_terrain(header, slots, &view))) {
        fprintf(stderr, "stream: no file of pages, or not enough memory\n");
        return 2;
    }
    if (compare && info.node_count <= 65534u)
        all = open_terrain(header, info.node_count < 8u ? 8u : info.node_count, &all_view);
    for (node = all ? info.node_count : 0; node-- > 0;) {
        terrimp_page_info page;
        void *to;
        if (terrimp_page_get_info(all, node, &page) != TERRIMP_OK ||
            terrimp_page_begin(all, node, &to) != TERRIMP_OK ||
            pread(r.file, to, page.bytes, (off_t)page.offset) != (ssize_t)page.bytes ||
            terrimp_page_put(all, node) != TERRIMP_OK) {
            fprintf(stderr, "stream: page %u is damaged\n", (unsigned)node);
            return 1;
        }
    }
    pthread_mutex_init(&r.lock, NULL);
    pthread_cond_init(&r.wake, NULL);
    pthread_create(&thread, NULL, read_pages, &r);
    camera.eye[0] = 0.2f * 30.0f * (float)info.width;
    camera.eye[2] = 0.5f * 30.0f * (float)info.depth;
    camera.forward[0] = 1.0f;
    camera.forward[1] = -0.15f;
    camera.width_px = 1280;
    camera.height_px = 1024;
    camera.z_near = 10.0f;
    camera.z_far = 4e6f;
    start = now();
    for (frame = 1; frame <= frames; frame++) {
        double before = now(), took;
        uint64_t sum = 0;
        terrimp_result result;
        camera.eye[0] += speed;
        if (camera.eye[0] > 0.8f * 30.0f * (float)info.width || frame == frames / 2u)
            camera.eye[0] = 0.2f * 30.0f * (float)info.width; /* a jump */
        if (terrimp_terrain_height(terrain, camera.eye[0], camera.eye[2], &ground, NULL, &i) ==
            TERRIMP_OK)
            camera.eye[1] = ground + 1500.0f;
        before = now();
        take(&r, terrain);
        terrimp_pages_next_frame(terrain);
        result = terrimp_view_update(view, &camera);
        if (result == TERRIMP_OK)
            sum = render(view);
        took = now() - before;
        worst = took > worst ? took : worst;
        ask(&r, terrain);
        memset(&stats, 0, sizeof stats);
        terrimp_view_get_stats(view, &stats);
        late += result != TERRIMP_OK || stats.late > 0;
        if (all && terrimp_view_update(all_view, &camera) == TERRIMP_OK)
            same += render(all_view) == sum && result == TERRIMP_OK;
        if (frame % 60u == 0 || frame == frames) {
            for (here = i = 0; i < info.node_count; i++) {
                terrimp_page_info page;
                terrimp_page_get_info(terrain, i, &page);
                here += page.state == TERRIMP_PAGE_HERE;
            }
            pthread_mutex_lock(&r.lock);
            printf("frame %u: %u reads, %.2f MB; %u of %u slots full; %u ground, %u impostors; "
                   "missing for %u\n", (unsigned)frame, (unsigned)r.reads, (double)r.bytes * 1e-6,
                   (unsigned)here, (unsigned)slots, (unsigned)stats.ground,
                   (unsigned)stats.impostors, (unsigned)stats.late);
            pthread_mutex_unlock(&r.lock);
        }
        took = now() - before;
        if (took < 1.0 / 60.0)
            pause_for(1.0 / 60.0 - took);
    }
    printf("%u of %u frames lacked a page; %.2f MB a second; the longest frame took %.1f ms\n",
           (unsigned)late, (unsigned)frames, (double)r.bytes * 1e-6 / (now() - start),
           worst * 1e3);
    if (all)
        printf("%u of %u frames draw what they draw with all pages here\n", (unsigned)same,
               (unsigned)frames);
    pthread_mutex_lock(&r.lock);
    r.stop = 1;
    pthread_cond_broadcast(&r.wake);
    pthread_mutex_unlock(&r.lock);
    pthread_join(thread, NULL);
    return 0;
}
