/* Convex polygons in the plane: subtraction, union and splitting. Private to solver/scene/generate. */
#ifndef LAMBERT_SCENE_GENERATE_CONVEX_H
#define LAMBERT_SCENE_GENERATE_CONVEX_H

#include <stdbool.h>
#include <stddef.h>

#define CONVEX_MOST 12

/* Counter-clockwise. */
typedef struct convex {
    size_t n;
    double p[CONVEX_MOST][2];
} convex;

double convex_area(const convex *a);

/* a minus b as convex pieces; pieces has room for b->n of them; returns how many. Pieces of an area below
 * tiny are dropped. */
size_t convex_subtract(const convex *a, const convex *b, double tiny, convex *pieces);

/* The union of two that share an edge, when it is convex and has at most 4 corners. */
bool convex_merge(const convex *a, const convex *b, double near, convex *merged);

/* Cuts one into quads and triangles of good shape; returns how many (at most CONVEX_MOST). */
size_t convex_split(const convex *a, convex *pieces);

#endif
