/* Triangles of elements with corners inside their edges. Private to solver/codec/gltf. */
#ifndef LAMBERT_CODEC_GLTF_POLYGON_H
#define LAMBERT_CODEC_GLTF_POLYGON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* triangles [count - 2][3]: places of a convex polygon of 3 or 4 corners and any number of places inside its
 * edges, counter-clockwise, of which the first is a corner. Each triangle has an area, and each place is a
 * corner of one. next [count] is lost. O(count). */
void gltf_polygon(size_t count, const bool *inside, uint32_t *next, uint32_t (*triangles)[3]);

#endif
