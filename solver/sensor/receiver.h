/* Receivers: places at which light is gathered, each with a weight of directions. Its value is
 *     integral of L(w) weight(w) dw    over all directions w,
 * and all weights here have the integral pi, so that a radiance of 1 from everywhere gives pi:
 *     plane          cos, above the plane
 *     cylinder       sin(e) / pi, e the angle with the axis
 *     semi-cylinder  sin(e) (1 + cos a) / pi, a the azimuth about the axis from the way that it looks
 *     sphere         1/4
 * (EN 12464-1 annex, CIE 191). But the weights of a probe are the nine spherical harmonics of harmonics.h,
 * which are negative in some directions: the value of one is a coefficient of the radiance at its place. The
 * nine of a probe follow each other. Must not know what hides light from them. */
#ifndef LAMBERT_SENSOR_RECEIVER_H
#define LAMBERT_SENSOR_RECEIVER_H

#include "solver/base/harmonics.h"
#include "solver/formfactor/exchange/polygon.h"

typedef enum receiver_kind {
    RECEIVER_PLANE,
    RECEIVER_CYLINDER,
    RECEIVER_SEMICYLINDER,
    RECEIVER_SPHERE,
    RECEIVER_DENSITIES,                     /* kinds before it have weights that are nowhere negative */
    RECEIVER_HARMONIC = RECEIVER_DENSITIES, /* the first one of a probe */
    RECEIVER_KINDS = RECEIVER_HARMONIC + HARMONICS
} receiver_kind;

typedef struct receiver {
    receiver_kind kind;
    double at[3];   /* m */
    double axis[3]; /* unit: the normal of a plane, the axis of cylinders, z of a probe; 0 of a sphere */
    double look[3]; /* unit and across the axis: the way that a semi-cylinder looks, x of a probe; else 0 */
} receiver;

/* True for the harmonics of a probe but the first: they are found with it. */
static inline bool receiver_follows(const receiver *r) {
    return r->kind > RECEIVER_HARMONIC;
}

/* weight / pi in a direction, a unit vector: of all but harmonics a density of directions. */
double receiver_density(const receiver *r, const double direction[3]);

/* The nine of the probe of a harmonic. */
void receiver_densities(const receiver *harmonic, const double direction[3], double out[HARMONICS]);

/* The largest value of a density. */
double receiver_density_most(receiver_kind kind);

/* The direction at (x, y) of the unit square, which has that density. */
void receiver_direction(const receiver *r, double x, double y, double direction[3]);

/* The integral of the density over the directions of a convex polygon, of which nothing is hidden; 0 where
 * its back is towards the receiver. p.normal and p.centre must be set. Planes have a closed form (Lambert's
 * sum over edges), and so have spheres (the solid angle) and harmonics; others take a quadrature, to about
 * 1e-5 of it. Cost: .2 us by closed form, else .5 us and more where it is near. */
double receiver_factor(const receiver *r, const polygon *p);

/* The nine of the probe of a harmonic. */
void receiver_factors(const receiver *harmonic, const polygon *p, double out[HARMONICS]);

#endif
