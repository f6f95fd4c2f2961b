/* Weights of directions of receivers, which stores name by these numbers (/sensors/receiver), for both
 * programs. Their formulas are those of solver/sensor/receiver.h. */
#ifndef LAMBERT_BASE_RECEIVER_WEIGHT_H
#define LAMBERT_BASE_RECEIVER_WEIGHT_H

/* A receiver at a place, in the scene's axes. */
typedef struct placed_receiver {
    unsigned kind;  /* 0 plane, 1 cylinder, 2 semi-cylinder, 3 sphere, 4 to 12 harmonics of a probe */
    double at[3];   /* m */
    double axis[3]; /* unit: the normal of a plane, the axis of cylinders; 0 of a sphere */
    double look[3]; /* unit and across the axis: the way that a semi-cylinder looks; 0 of others */
} placed_receiver;

/* weight / pi in a direction, a unit vector: a density of directions, whose integral is 1; of harmonics,
 * which have either sign, Y / pi. */
double receiver_weight_density(unsigned kind, const double axis[3], const double look[3],
                               const double direction[3]);

/* The place of a kind among the nine harmonics of a probe, which follow each other; 0 of others. */
unsigned receiver_weight_order(unsigned kind);

/* The integral of that density over the directions below the horizon of `up`, a unit vector: the share of the
 * ground, of which nothing is hidden. */
double receiver_weight_below(const placed_receiver *r, const double up[3]);

#endif
