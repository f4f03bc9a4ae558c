#include "walker.h"

#include <math.h>

void walker_place(walker *w, const flight_pose *pose)
{
    float d[3];
    int i;
    for (i = 0; i < 3; i++) {
        w->eye[i] = pose->eye[i];
        d[i] = pose->target[i] - pose->eye[i];
    }
    w->yaw = atan2f(d[0], -d[2]);
    w->pitch = atan2f(d[1], sqrtf(d[0] * d[0] + d[2] * d[2]));
    w->fall = 0.0f;
}

static float clamp(float value, float low, float high)
{
    return value < low ? low : value > high ? high : value;
}

void walker_turn(walker *w, float yaw, float pitch)
{
    w->yaw += yaw;
    w->pitch = clamp(w->pitch + pitch, -1.55f, 1.55f);
}

void walker_forward(const walker *w, float forward[3])
{
    forward[0] = sinf(w->yaw) * cosf(w->pitch);
    forward[1] = sinf(w->pitch);
    forward[2] = -cosf(w->yaw) * cosf(w->pitch);
}

float walker_ground(const walker *w, const terrimp_heightfield *field)
{
    float width = (float)(field->width - 1) * field->spacing_x, height = w->eye[1] - 1e6f;
    float depth = (float)(field->depth - 1) * field->spacing_z;
    terrimp_heightfield_height(field, clamp(w->eye[0], field->origin_x, field->origin_x + width),
                               clamp(w->eye[2], field->origin_z, field->origin_z + depth),
                               &height);
    return height;
}

/* On the ground, or falling to it. */
static void stand(walker *w, const terrimp_heightfield *field, int jump, float seconds)
{
    float ground = walker_ground(w, field) + WALKER_HEIGHT;
    w->fall = w->standing && jump > 0 ? 5.0f : w->fall - 9.8f * seconds;
    w->eye[1] += w->fall * seconds;
    w->standing = w->eye[1] <= ground;
    if (w->standing) {
        w->eye[1] = ground;
        w->fall = 0.0f;
    }
}

void walker_move(walker *w, const terrimp_heightfield *field, const walker_wish *wish,
                 float seconds)
{
    float step = w->speed * seconds * (wish->fast ? 4.0f : 1.0f), forward[3], lowest;
    if (w->walking) {
        step *= 0.1f;
        forward[0] = sinf(w->yaw);
        forward[1] = 0.0f;
        forward[2] = -cosf(w->yaw);
    } else {
        walker_forward(w, forward);
        w->eye[1] += step * (forward[1] * (float)wish->ahead + (float)wish->up);
    }
    w->eye[0] += step * (forward[0] * (float)wish->ahead + cosf(w->yaw) * (float)wish->aside);
    w->eye[2] += step * (forward[2] * (float)wish->ahead + sinf(w->yaw) * (float)wish->aside);
    lowest = walker_ground(w, field) + 0.5f;
    if (w->walking)
        stand(w, field, wish->up, seconds);
    else if (w->eye[1] < lowest)
        w->eye[1] = lowest;
}
