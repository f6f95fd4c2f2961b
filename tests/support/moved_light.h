/* Moving lights of the tests of reused paths, the scenes that they move through, and their light by one way
 * or another. */
#ifndef LAMBERT_TESTS_MOVED_LIGHT_H
#define LAMBERT_TESTS_MOVED_LIGHT_H

#include "solver/walk/reuse.h"
#include "support/suite.h"

/* The empty box of size light_box, each face in LIGHT_DIVISIONS^2 cells, and the positions of the square in
 * it.
 */
enum { LIGHT_DIVISIONS = 4, LIGHT_POSITIONS = 4 };
extern const double light_box[3];

/* A square of a quarter of a side in the plane z = 0, which looks down, and where it is carried: along a line
 * below the ceiling, and turned to look along x. Each fits cells of the box. */
moving_light light_square(void);

/* A Cornell box, whose blocks hide the light of some positions from others. */
mesh light_cornell(void);

/* The square goes down between the blocks of a mesh, turning. */
moving_light light_falling(const mesh *m);

/* The same square at 16 positions on half an ellipse, whose first and last share the fewest paths. */
moving_light light_curved(const mesh *m);

/* Estimates of a problem that has to succeed; freed by reuse_estimates_free. */
reuse_estimates reuse_solve(const mesh *m, const reuse_problem *problem);

/* The same with equal counts of paths. */
reuse_estimates reuse_by(const mesh *m, const moving_light *l, reuse_way way, size_t paths, size_t resolution,
                         uint64_t seed);

#endif
