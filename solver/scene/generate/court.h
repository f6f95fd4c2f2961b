/* Coordinates around a rectangular court with its middle at (0, 0), so that one description builds all four
 * sides. Private to solver/scene/generate. */
#ifndef LAMBERT_SCENE_GENERATE_COURT_H
#define LAMBERT_SCENE_GENERATE_COURT_H

#include "solver/scene/generate/blocks.h"

typedef struct court {
    double half[2]; /* along x and y, metres */
} court;

enum { COURT_SIDES = 4 }; /* +x, +y, -x, -y */

/* Half the length of a side. */
double court_half(const court *c, int side);

/* The point at the distance out from a side of the court and the distance along it from its middle. Out,
 * along and up are right-handed. out is rounded by block_place. */
void court_point(const court *c, int side, double out, double along, double z, double point[3]);

/* A box between two points of court_point. */
typedef struct court_box {
    double out[2], along[2], z[2];
} court_box;

lam_status court_add(const court *c, int side, int fill, const court_box *box, blocks *all, lam_error *error);

/* Adds the box over the court and its surroundings up to the distance out. */
lam_status court_add_square(const court *c, int fill, double out, double z0, double z1, blocks *all,
                            lam_error *error);

#endif
