/* A baked lightmap: what the ground looks like under the sun, one texel a sample, so that every way
   of drawing the terrain is shaded alike. */
#ifndef HOST_LIGHTMAP_H
#define HOST_LIGHTMAP_H

#include "terrimp.h"

#include <stdint.h>

/* Bakes rgb[depth][width][3], to be freed: grass, rock, snow and sea by height and slope, times the
   light of the sun with soft shadows. Null when memory runs out or the field has
   voids. */
uint8_t *lightmap_bake(const terrimp_heightfield *field);

/* The same under another sun: the unit vector towards it. [Limits: y > 0, z < 0] */
uint8_t *lightmap_bake_under(const terrimp_heightfield *field, const float sun[3]);

/* The same without light, for ground that is lit when it is drawn: colours as they are; and
   *normals[depth][width][2], to be freed too, the codes of terrimp_normal_encode. */
uint8_t *lightmap_bake_unlit(const terrimp_heightfield *field, uint8_t **normals);

#endif
