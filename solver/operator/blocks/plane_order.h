/* The order of planes in a tree of clusters: part of the scene by part, and within one by place and normal.
 */
#ifndef LAMBERT_OPERATOR_BLOCKS_PLANE_ORDER_H
#define LAMBERT_OPERATOR_BLOCKS_PLANE_ORDER_H

#include <stddef.h>
#include <stdint.h>

/* A plane: its range of positions, its part of the scene, its mean centre and its mean normal. */
typedef struct plane_place {
    uint32_t begin, end, part;
    double at[6], value; /* value: of plane_order alone */
} plane_place;

/* Sorts planes by part, and those of each part along the coordinate of centre or normal in which they differ
 * most, then each half of them likewise. Cost: O(count log^2 count). */
void plane_order(plane_place *planes, size_t count);

#endif
