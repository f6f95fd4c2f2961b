/* Places around a rectangular court whose middle is at (0, 0): what is built at one of its four sides is
 * built at all. Private. */
#ifndef LAMBERT_SCENE_GENERATE_COURT_H
#define LAMBERT_SCENE_GENERATE_COURT_H

#include "solver/scene/generate/blocks.h"

typedef struct court {
    double half[2]; /* along x and y, metres */
} court;

enum { COURT_SIDES = 4 }; /* +x, +y, -x, -y */

/* How far the side goes to both sides of its middle. */
double court_half(const court *c, int side);

/* A point so far out from a side of the court, and so far along it from its middle. Out, along and up are
 * right-handed. How far out is taken to the millimetre, as blocks are. */
void court_point(const court *c, int side, double out, double along, double z, double point[3]);

/* A box between two such places. */
typedef struct court_box {
    double out[2], along[2], z[2];
} court_box;

lam_status court_add(const court *c, int side, int fill, const court_box *box, blocks *all, lam_error *error);

/* The court and what is around it so far out. */
lam_status court_add_square(const court *c, int fill, double out, double z0, double z1, blocks *all,
                            lam_error *error);

#endif
