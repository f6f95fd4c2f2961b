/* Walls on a plane of elements: the lines along which other surfaces stand on its front or cross it. They
 * part the plane into rooms, whatever the mesh is. */
#ifndef LAMBERT_OPERATOR_BLOCKS_PLANE_WALLS_H
#define LAMBERT_OPERATOR_BLOCKS_PLANE_WALLS_H

#include "solver/operator/blocks/plane_tree.h"

/* A part of a line in coordinates x of a plane: across . x = offset, from begin to end along
 * (-across[1], across[0]). Parts of one line do not overlap. */
typedef struct plane_wall {
    uint32_t line;
    double across[2], offset, begin, end;
} plane_wall;

/* The rectangle of coordinates in a plane. */
typedef struct plane_extent {
    double low[2], high[2];
} plane_extent;

/* Finds walls on one plane after another of a tree that has its order and frames. */
typedef struct wall_finder wall_finder;

/* begins [n_frames + 1]: the first position of each plane. same: a distance that is none, in m. All must
 * outlive the finder, which the caller destroys. Errors: LAM_ERR_MEMORY. */
lam_status wall_finder_create(const plane_tree *tree, const uint32_t *begins, const element_corners *corners,
                              double same, wall_finder **out, lam_error *error);
void wall_finder_destroy(wall_finder *f);

/* walls [*count]: on a plane, within the rectangle of its corners, sorted by line and begin; they belong to
 * the finder until its next call. Cost: a box test for each 32 planes and for each plane near this one, and a
 * test for each element of planes that meet it within its rectangle. Errors: LAM_ERR_MEMORY. */
lam_status wall_finder_find(wall_finder *f, size_t plane, plane_wall **walls, size_t *count,
                            lam_error *error);

/* The part of a wall's line within a rectangle, *begin to *end; false: none. */
bool plane_wall_chord(const plane_wall *wall, const plane_extent *within, double *begin, double *end);

/* Brings the walls that have a part within a rectangle to the front, sorted; returns their number. */
size_t plane_walls_within(plane_wall *walls, size_t count, const plane_extent *within);

#endif
