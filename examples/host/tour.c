#include "tour.h"

#include "procedural.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int fail(tour *t, const char *trouble)
{
    snprintf(t->error, sizeof t->error, "%s", trouble);
    return 0;
}

static int load_file(tour *t)
{
    const char *trouble;
    if (!dem_load(&t->dem, t->desc.dem, &t->desc.file))
        return fail(t, t->dem.error);
    t->voids_filled = dem_fill_voids(&t->dem, &trouble);
    if (trouble)
        return fail(t, trouble);
    t->field = dem_heightfield(&t->dem);
    return 1;
}

static int make_up(tour *t)
{
    uint32_t size = t->desc.size;
    t->dem.samples = procedural_terrain(size, size, t->desc.seed);
    if (!t->dem.samples)
        return fail(t, "no memory for the terrain");
    t->dem.width = t->dem.depth = size;
    t->dem.format = TERRIMP_FORMAT_U16;
    t->dem.spacing_x = t->dem.spacing_z = 1.0f;
    t->field = dem_heightfield(&t->dem);
    t->field.height_scale = PROCEDURAL_HEIGHT_SCALE;
    return 1;
}

/* Maps use the whole range of their samples, whatever heights they mean. */
static float fitting_scale(const terrimp_heightfield *field)
{
    float width = (float)(field->width - 1) * field->spacing_x, low, high;
    float depth = (float)(field->depth - 1) * field->spacing_z;
    float side = width > depth ? width : depth;
    if (terrimp_heightfield_bounds(field, 0, 0, field->width, field->depth, &low, &high)
        != TERRIMP_OK || !(high - low > 0.5f * side))
        return 1.0f;
    return 0.125f * side / (high - low);
}

int tour_load(tour *t, const tour_desc *desc)
{
    memset(t, 0, sizeof *t);
    t->desc = *desc;
    if (!(desc->dem ? load_file(t) : make_up(t)))
        return 0;
    if (desc->spacing[0] > 0.0f) {
        t->field.spacing_x = desc->spacing[0];
        t->field.spacing_z = desc->spacing[1];
    }
    t->field.origin_x = desc->origin[0];
    t->field.origin_z = desc->origin[1];
    if (desc->height_scale > 0.0f)
        t->field.height_scale = desc->height_scale;
    else if (desc->dem && !t->dem.has_units)
        t->field.height_scale = fitting_scale(&t->field);
    return 1;
}

int tour_plan(tour *t)
{
    const tour_desc *d = &t->desc;
    terrimp_heightfield field;
    float speed = d->speed, fps = d->fps > 0.0f ? d->fps : 60.0f;
    int ok;
    if (terrimp_heightfield_resolve(&t->field, &field) != TERRIMP_OK)
        return fail(t, "the heightfield is wrong");
    if (!(speed > 0.0f))
        speed = 80.0f * field.spacing_x;
    if (d->path)
        ok = flight_load(&t->flight, d->path);
    else
        ok = flight_circle(&t->flight, &field, d->frames ? d->frames : 600, speed / fps,
                           d->above);
    if (!ok)
        return fail(t, t->flight.error);
    if (d->frames && d->frames < t->flight.count)
        t->flight.count = d->frames;
    return 1;
}

terrimp_camera tour_camera_at(const flight_pose *pose, const terrimp_box *box, float fov_y_rad,
                              uint32_t width, uint32_t height)
{
    terrimp_camera camera;
    int i;
    memset(&camera, 0, sizeof camera);
    for (i = 0; i < 3; i++) {
        camera.eye[i] = pose->eye[i];
        camera.forward[i] = pose->target[i] - pose->eye[i];
    }
    camera.fov_y_rad = fov_y_rad;
    camera.width_px = width;
    camera.height_px = height;
    camera.z_far = terrimp_box_farthest(box, camera.eye) * 1.2f;
    camera.z_near = camera.z_far * (1.0f / 8192.0f);
    return camera;
}

terrimp_camera tour_camera(const tour *t, const terrimp_box *box, size_t frame)
{
    terrimp_camera camera = tour_camera_at(&t->flight.poses[frame], box, t->desc.fov_y_rad,
                                           t->desc.width, t->desc.height);
    if (t->desc.above > 0.0f && camera.z_near > 0.2f * t->desc.above)
        camera.z_near = 0.2f * t->desc.above; /* no ground is cut off, which then hides nothing */
    return camera;
}

void tour_tighten(terrimp_camera *camera, const terrimp_stats *now)
{
    if (now->z_near > camera->z_near)
        camera->z_near = now->z_near;
    if (now->z_far > camera->z_near)
        camera->z_far = now->z_far * 1.01f;
}

void tour_close(tour *t)
{
    flight_free(&t->flight);
    dem_free(&t->dem);
}
