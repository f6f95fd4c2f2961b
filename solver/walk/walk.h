/* Random walks: unbiased estimates of the solution of B = E + R F B without a single form factor between
 * elements. A walk leaves a uniform point of element i along a cosine-weighted ray, so that it comes to j
 * with the probability F_ij. It goes on from a uniform point of j with the probability rho_j, and ends where
 * its ray leaves the scene or hits a back face (Sbert 1997; Castro et al., section 2.2). Must not know how
 * form factors are found or kept. */
#ifndef LAMBERT_WALK_WALK_H
#define LAMBERT_WALK_WALK_H

#include "lambert/lambert.h"
#include "solver/formfactor/leaving.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/scene/mesh.h"

/* The walks of an estimate are cut into this many batches, whose means give its standard error. */
enum { WALK_BATCHES = 32 };

/* An element that is in no target. */
#define WALK_NO_TARGET 0xFFFFFFFFu

/* Rays as they were cast, the first that come: a measurement casts them again. */
typedef struct walk_log {
    size_t count, capacity; /* packets */
    ray_packet *packets;    /* [capacity], the caller's */
} walk_log;

/* A mesh made ready for walks; immutable, so that any number of threads may use it. */
typedef struct walk_scene walk_scene;

/* The mesh must outlive it; freed by walk_scene_free. As for form factors (leaving.h), a scene is closed
 * where rays leave through nothing but cracks, or where closure says so, and its fronts are all that is seen
 * where rays hit backs through nothing but cracks: a walk whose ray slips through a crack then leaves its
 * element by another ray. Casts 2^18 rays at most to find that out. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_INTERNAL. */
lam_status walk_scene_create(const mesh *m, scene_closure closure, walk_scene **out, lam_error *error);
void walk_scene_free(walk_scene *s);

/* The processor seconds of all threads that Embree alone takes for the packets of a log. Errors:
 * LAM_ERR_MEMORY. */
lam_status walk_log_bare_seconds(const walk_scene *s, const walk_log *log, double *seconds, lam_error *error);

/* The estimates asked for: the area mean of a quantity over each target, a set of elements. An element is in
 * one target at most. Light that comes from outside (a sky, the sun) is emission too: E + rho H0, and H0 has
 * to be added to the irradiance. */
typedef struct walk_problem {
    size_t n_rhs;
    const float *E; /* [n_rhs][C][n], at least 0 */
    lam_quantity quantity;
    size_t n_targets;
    const uint32_t *target; /* [n], below n_targets or WALK_NO_TARGET */
    size_t walks;           /* rounded up to a multiple of WALK_BATCHES */
    uint64_t seed;          /* of all walks: the bits of an estimate depend on it, not on threads */
    const progress *progress;
    const char *stage; /* its name in the progress line */
} walk_problem;

/* Estimates in the unit of E; all 0 for a target without elements. Freed by walk_estimates_free. */
typedef struct walk_estimates {
    size_t n_rhs, n_channels, n_targets;
    size_t walks;     /* as rounded up */
    double *mean;     /* [n_rhs][C][n_targets] */
    double *error;    /* the same shape: the standard error of the mean, from the means of batches */
    double *largest;  /* the same shape: bounds walks times that by which one visit may raise the mean */
    uint64_t *visits; /* [n_rhs][n_targets]: visits that raised the mean */
} walk_estimates;

void walk_estimates_free(walk_estimates *e);

/* Gathers: `walks` walks from every target (an element by its area), which collect the emission of the
 * elements that they come to; all emissions at once. For targets smaller than the lights. Starts are of low
 * discrepancy, shifted at random in each batch, which leaves a mean unbiased.
 * Cost: n_targets * walks walks of about 1/(1 - rho) rays; 256 bytes for each target, emission and channel.
 * Errors: LAM_ERR_ARGUMENT (an emission below 0 or not finite, a target out of range, no walks),
 * LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status walk_gather(const walk_scene *s, const walk_problem *problem, walk_estimates *out,
                       lam_error *error);

/* Shoots: `walks` walks for every emission from the elements that emit, by their power, each of which gives
 * its power to the elements that it comes to; all targets at once. For lights smaller than the targets.
 * Cost: n_rhs * walks walks; 256 bytes for each target and channel. Starts and errors as walk_gather. */
lam_status walk_shoot(const walk_scene *s, const walk_problem *problem, walk_estimates *out,
                      lam_error *error);

/* The number of standard errors by which a value is above estimate k of mean. The standard error is never
 * less than one visit. An estimate of few visits does not know its own error: there it is at least that of
 * visits whose mean is the value. value_error, the error of the value itself, counts too. */
double walk_score(const walk_estimates *e, size_t k, double value, double value_error);

/* The chance that the largest |score| of so many comparisons, each with Student's distribution of
 * WALK_BATCHES - 1 degrees of freedom, is at least this one: exact for independent comparisons, an upper
 * bound for dependent ones (Sidak 1967). */
double walk_chance(double score, size_t comparisons);

#endif
