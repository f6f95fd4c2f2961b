/* Upright prisms and cones for columns on a square foot and for trunks. Private to solver/scene/generate. */
#ifndef LAMBERT_SCENE_GENERATE_COLUMN_H
#define LAMBERT_SCENE_GENERATE_COLUMN_H

#include "solver/scene/generate/patches.h"

typedef struct column {
    double middle[2];
    size_t sides; /* a multiple of 8, so that corners of a square can be joined to corners of it */
    uint32_t group;
} column;

enum { COLUMN_SIDES_MOST = 16 };

/* The level square from low to high around the middle, minus the section of a column of this radius that
 * stands on it (or, facing down, carries it). */
lam_status column_square(const column *c, const double low[2], const double high[2], double z, double radius,
                         bool down, patch_list *out, lam_error *error);

/* The sides from one height and radius to another; a radius of 0 above is a tip. */
lam_status column_band(const column *c, double z0, double radius0, double z1, double radius1, patch_list *out,
                       lam_error *error);

#endif
