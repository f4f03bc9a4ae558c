#ifndef BAKE_MAKER_H
#define BAKE_MAKER_H

#ifdef __cplusplus
extern "C" {
#endif
/* Bakes a terrain of the field; returns the bytes, 0 when that fails. */
extern size_t make_bake(const terrimp_heightfield *field, void *block, size_t bytes);
#ifdef __cplusplus
}
#endif

#endif
