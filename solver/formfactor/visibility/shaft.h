/* The shaft between two boxes (Haines and Wallace 1991): their convex hull, cut by planes. Nothing wholly
 * outside it is between them. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_SHAFT_H
#define LAMBERT_FORMFACTOR_VISIBILITY_SHAFT_H

#include "solver/scene/mesh.h"

/* Twelve of the hull and two cuts, and room for whole vectors of SHAFT_LANES. */
enum { SHAFT_LANES = 8, SHAFT_PLANES = 2 * SHAFT_LANES };

/* A box cut by planes: a point x is inside where normal . x < level for each. normal: by component; a plane
 * beyond n_planes has level INFINITY. */
typedef struct shaft {
    double low[3], high[3];
    int n_planes;
    double normal[3][SHAFT_PLANES], level[SHAFT_PLANES];
} shaft;

typedef struct shaft_box {
    double low[3], high[3];
} shaft_box;

/* The hull of two boxes, shrunk by slack, so that a piece that only touches it is outside. */
void shaft_of_boxes(shaft *s, const shaft_box *a, const shaft_box *b, double slack);

/* Cuts off all with normal . x <= level; twice at most. */
void shaft_cut(shaft *s, const double normal[3], double level);

/* True where a box, or the hull of n points, is found to lie outside a shaft. */
bool shaft_misses_box(const shaft *s, const double low[3], const double high[3]);
bool shaft_misses_points(const shaft *s, int n, const double (*points)[3]);

/* True where an element lies wholly outside a shaft. */
bool shaft_misses_element(const shaft *s, const mesh *m, uint32_t element);

#endif
