/* Luminaires that a test places in a scene, and boxes to place them in. */
#ifndef LAMBERT_TESTS_PLACED_LIST_H
#define LAMBERT_TESTS_PLACED_LIST_H

#include "solver/luminaire/placed.h"
#include "support/obj_text.h"

/* The luminaires of the entries, a text as printf makes it: {"name": "a", "file": "made/isym3.ldt", ...}.
 * Paths are those of tests/fixtures/luminaires, and these files: "panel.ies" (1000 cos gamma cd below, of 1.2
 * x .3 m: the longer side along x), "ball.ies" (100 cd everywhere, a sphere of .4 m), "box.ies" (a body of
 * one radiance, 1000 cd / m2, .6 x .3 x .2 m: the longer side along x), "cone.ies" (1000 cd below 60 degrees,
 * which end with a step, of a point). */
placed_luminaires placed_list(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Adds n x n squares of a group from a corner along two edges, whose cross product is the normal. */
void obj_text_squares(obj_text *o, const char *group, const double corner[3], const double u[3],
                      const double v[3], int n);

/* Adds the six faces of a box, each of n x n squares, that look inwards: floor, ceiling, south, north, west,
 * east; or outwards: of one group. */
void obj_text_room(obj_text *o, const double low[3], const double high[3], int n);
void obj_text_block(obj_text *o, const char *group, const double low[3], const double high[3], int n);

#endif
