/* Convex polygons of a mesh's vertices joined into larger ones: a wall of a hundred elements is one
 * rectangle. */
#ifndef LAMBERT_SCENE_FACET_POLYGON_JOIN_H
#define LAMBERT_SCENE_FACET_POLYGON_JOIN_H

#include "solver/scene/mesh.h"

/* Corners of a union at most. */
enum { JOINED_CORNERS = 8 };

/* A convex polygon, counter-clockwise seen from the front. */
typedef struct joined_polygon {
    uint32_t corner[JOINED_CORNERS], n;
    uint32_t label; /* MESH_NO_VERTEX: of several labels */
    uint32_t first; /* one of the polygons that it is made of */
} joined_polygon;

/* The polygons that are joined, and how they are. */
typedef struct polygon_join_options {
    size_t n;
    const uint32_t (*polygons)[4]; /* [n], as elements of the mesh */
    const uint32_t *label;         /* [n] */
    bool within_labels;            /* only polygons of one label are joined */
    const uint32_t *kinds; /* [labels]: only polygons whose labels are of one kind are joined; NULL: all
                              are of one */
    bool split;            /* a polygon of four corners that is not plane and convex is two triangles */
    uint32_t corners;      /* of a union at most: 4, or JOINED_CORNERS */
    double slack;          /* metres: what deviates less from a line or a plane lies in it */
    uint32_t *label_sets;  /* [labels], initially i: labels of one union become one set (union_find.h). NULL:
                              not wanted */
    uint32_t *joined; /* [n], filled: the union that each became a part of; MESH_NO_VERTEX: none. NULL, as
                         with split: not wanted */
} polygon_join_options;

/* Joins two polygons at a time that face the same way, lie in one plane, share a whole edge and make a convex
 * polygon, until there are no more of these: first triangles, then the rows of a grid, then rows with each
 * other, and at last unions of more than four corners. Vertices at the same place are one; polygons without
 * an area are left out. *out [*count] is freed by the caller. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status polygons_join(const mesh *m, const polygon_join_options *options, joined_polygon **out,
                         size_t *count, lam_error *error);

#endif
