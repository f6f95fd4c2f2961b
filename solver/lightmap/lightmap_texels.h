/* The texels that elements cover, and the point of each at which its light is gathered. Knows no light. */
#ifndef LAMBERT_LIGHTMAP_TEXELS_H
#define LAMBERT_LIGHTMAP_TEXELS_H

#include "solver/lightmap/lightmap_charts.h"

/* at: the centre of a texel where an element covers it, else the centroid of the largest part that one
 * element covers, so that texels on a slanting rim and of slivers have light too. */
typedef struct lightmap_texel {
    uint32_t pixel, element; /* row * width + column of the map */
    double at[3];
    double area; /* m^2, that elements cover */
} lightmap_texel;

typedef struct lightmap_texels {
    size_t n;
    lightmap_texel *texels; /* [n], ascending by pixel */
} lightmap_texels;

/* Finds those of all elements but buried ones, which see nothing. The areas of a group sum to that of its
 * elements.
 * The caller frees texels. Cost: O(texels and elements). Errors: LAM_ERR_MEMORY. */
lam_status lightmap_texels_find(const mesh *m, const lightmap_charts *c, lightmap_texels *out,
                                lam_error *error);

#endif
