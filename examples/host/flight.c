#include "flight.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TURN 6.2831853f

/* ---- A file ------------------------------------------------------------- */

static int append(flight *f, size_t *capacity, const flight_pose *pose)
{
    if (f->count == *capacity) {
        size_t larger = *capacity ? *capacity * 2 : 256;
        flight_pose *poses = realloc(f->poses, larger * sizeof *poses);
        if (!poses)
            return 0;
        f->poses = poses;
        *capacity = larger;
    }
    f->poses[f->count++] = *pose;
    return 1;
}

/* Reads six finite numbers and nothing else; the eye must not be its own target. */
static int read_pose(const char *line, flight_pose *pose)
{
    float numbers[6];
    char *end;
    int i;
    for (i = 0; i < 6; i++) {
        numbers[i] = strtof(line, &end);
        if (end == line || numbers[i] - numbers[i] != 0.0f)
            return 0;
        line = end;
    }
    memcpy(pose->eye, numbers, sizeof pose->eye);
    memcpy(pose->target, numbers + 3, sizeof pose->target);
    return line[strspn(line, " \t\r\n")] == 0
           && memcmp(pose->eye, pose->target, sizeof pose->eye) != 0;
}

static int read_poses(flight *f, const char *path, FILE *file)
{
    char line[512];
    size_t capacity = 0, number = 0;
    flight_pose pose;
    while (fgets(line, sizeof line, file)) {
        number++;
        if (line[0] == '#' || line[strspn(line, " \t\r\n")] == 0)
            continue;
        if (!read_pose(line, &pose)) {
            snprintf(f->error, sizeof f->error, "%s:%zu: six numbers are wanted, of an eye and of "
                     "a target elsewhere", path, number);
            return 0;
        }
        if (!append(f, &capacity, &pose)) {
            snprintf(f->error, sizeof f->error, "%s: no memory for the path", path);
            return 0;
        }
    }
    if (!f->count)
        snprintf(f->error, sizeof f->error, "%s: holds no poses", path);
    return f->count > 0;
}

int flight_load(flight *f, const char *path)
{
    FILE *file = fopen(path, "r");
    int ok;
    memset(f, 0, sizeof *f);
    if (!file) {
        snprintf(f->error, sizeof f->error, "%s: %s", path, strerror(errno));
        return 0;
    }
    ok = read_poses(f, path, file);
    fclose(file);
    if (!ok) {
        free(f->poses);
        f->poses = NULL;
        f->count = 0;
    }
    return ok;
}

/* ---- The circle --------------------------------------------------------- */

typedef struct circle {
    float centre_x, centre_z, radius, altitude;
} circle;

static void on_circle(const circle *c, float angle, float drop, float point[3])
{
    point[0] = c->centre_x + c->radius * cosf(angle);
    point[1] = c->altitude - drop;
    point[2] = c->centre_z + c->radius * sinf(angle);
}

/* Highest ground below the circle. */
static float highest_ground(const terrimp_heightfield *field, const circle *c)
{
    float highest = -1e30f, height, point[3];
    int i;
    for (i = 0; i < 2000; i++) {
        on_circle(c, (float)i * (TURN / 2000.0f), 0.0f, point);
        if (terrimp_heightfield_height(field, point[0], point[2], &height) == TERRIMP_OK
            && height > highest)
            highest = height;
    }
    return highest;
}

static int place_circle(circle *c, const terrimp_heightfield *field, float covered)
{
    const float clearance = 0.12f; /* over the ground, as a part of the terrain's height */
    float width = (float)(field->width - 1) * field->spacing_x, low, high, over;
    float depth = (float)(field->depth - 1) * field->spacing_z;
    if (terrimp_heightfield_bounds(field, 0, 0, field->width, field->depth, &low, &high)
        != TERRIMP_OK)
        return 0;
    c->centre_x = field->origin_x + 0.5f * width;
    c->centre_z = field->origin_z + 0.5f * depth;
    c->radius = covered * (width < depth ? width : depth);
    c->altitude = 0.0f;
    over = clearance * (high - low);
    if (over > 0.25f * c->radius) /* from higher up the eye, looking ahead, would miss it all */
        over = 0.25f * c->radius;
    c->altitude = highest_ground(field, c) + over + 0.01f * c->radius;
    return 1;
}

/* Where terrain is many times as high as wide, what lies ahead lies below all pictures: there the
   eye looks down at it. */
static void look_at_ground(const terrimp_heightfield *field, const circle *c, float target[3])
{
    float height;
    if (terrimp_heightfield_height(field, target[0], target[2], &height) == TERRIMP_OK
        && height < c->altitude - 1.5f * c->radius)
        target[1] = height;
}

/* A pose close to the ground, looking along the circle. */
static void fly_above(const terrimp_heightfield *field, const circle *c, float angle, float above,
                      flight_pose *pose)
{
    on_circle(c, angle, 0.0f, pose->eye);
    (void)terrimp_heightfield_height(field, pose->eye[0], pose->eye[2], &pose->eye[1]);
    pose->eye[1] += above;
    pose->target[0] = pose->eye[0] - c->radius * sinf(angle);
    pose->target[1] = pose->eye[1];
    pose->target[2] = pose->eye[2] + c->radius * cosf(angle);
}

int flight_circle(flight *f, const terrimp_heightfield *field, size_t count, float step,
                  float above)
{
    const float ahead = 0.14f * TURN; /* the target is that far round the circle */
    const float covered = above > 0.0f ? 0.35f : 0.42f; /* radius, of the shorter side */
    terrimp_heightfield resolved;
    circle c = { 0.0f, 0.0f, 0.0f, 0.0f };
    size_t i;
    memset(f, 0, sizeof *f);
    if (terrimp_heightfield_resolve(field, &resolved) == TERRIMP_OK
        && place_circle(&c, &resolved, covered))
        f->poses = malloc(count * sizeof *f->poses);
    if (!f->poses) {
        snprintf(f->error, sizeof f->error, "no memory for the flight");
        return 0;
    }
    f->count = count;
    for (i = 0; i < count; i++) {
        float angle = fmodf((float)i * (step / c.radius), TURN);
        if (above > 0.0f) {
            fly_above(&resolved, &c, angle, above, &f->poses[i]);
            continue;
        }
        on_circle(&c, angle, 0.0f, f->poses[i].eye);
        on_circle(&c, angle + ahead, 0.2f * c.radius, f->poses[i].target);
        look_at_ground(&resolved, &c, f->poses[i].target);
    }
    return 1;
}

void flight_free(flight *f)
{
    free(f->poses);
    memset(f, 0, sizeof *f);
}
