/* Means over the batches of reused paths and what they scatter by, private to reuse*.c. */
#ifndef LAMBERT_WALK_REUSE_SUMS_H
#define LAMBERT_WALK_REUSE_SUMS_H

#include "solver/scene/mesh.h"
#include "solver/walk/reuse.h"
#include "solver/walk/walk_steps.h"

/* The groups of a mesh that reflect nothing: errors there are those of the irradiance. */
typedef struct black_groups {
    bool *of; /* [n_groups] */
    bool all; /* nothing reflects */
} black_groups;

/* of is freed with free(). Cost: O(C n). Errors: LAM_ERR_MEMORY. */
lam_status black_groups_find(const mesh *m, black_groups *out, lam_error *error);

/* rho of an element, and 1 in a black group that is kept apart, or where nothing reflects. */
static inline double reuse_reflectance(const mesh *m, const black_groups *black, bool apart, size_t c,
                                       size_t i) {
    if (black->all || (apart && black->of[m->group[i]])) return 1;
    return (double)m->reflectance[c * m->n + i];
}

/* Batches that were added, of all elements, channels and positions: n C s numbers each, [n][C][s] where
 * positions share paths, else [s][n][C], so that a path meets neighbouring numbers. After b batches x_1 ...
 * x_b the mean and sum_k (x_k - mean) (x_k - mean)', which a batch with d = x_(b+1) - mean raises by b/(b +
 * 1) d d' (Welford 1962). Nothing is lost to cancellation, and the covariance stays positive semidefinite. */
typedef struct reuse_sums {
    const mesh *m;
    const moving_light *light;
    size_t s, batches;
    bool shared;  /* positions share paths: without that no two of them are correlated */
    double *gain; /* [n][C] power of the light over the area of the element */
    double *norm; /* [n][C] area rho^2, with reuse_reflectance as rho */
    black_groups black;
    double *mean;       /* [n][C][s] or [s][n][C] W/m2 */
    double *square;     /* the same: the diagonal */
    double *direct;     /* [n][s] or [s][n]: sum over batches */
    size_t groups;      /* of the mesh, or 1 where they are too many to be kept apart */
    double *covariance; /* [groups][s][s]: sum over channels and elements with norm, upper triangle */
    double *means; /* [groups][s][s] of the mean radiosity of a group, summed over channels; NULL with 1 */
    double *group_area;   /* [groups] */
    double *deviation;    /* [groups][C][s]: of a batch, sum A rho d */
    double *left, *right; /* [SUMS_ROWS][s]: rows of d that wait for the covariance, left with its factor */
} reuse_sums;

lam_status reuse_sums_create(const mesh *m, const moving_light *light, bool shared, reuse_sums *out,
                             lam_error *error);
void reuse_sums_free(reuse_sums *t);

/* Adds a batch: power over that of the light which comes to elements straight from it, first [n][s], and by
 * reflection, later [n][C][s]; where paths are not shared, first [s][n][1 + C] has both and later is NULL.
 * Cost: n C s^2 / 2 multiplications where paths are shared. */
void reuse_sums_add(reuse_sums *t, const double *first, const double *later);

/* Adds the power of n walks that serve all s positions to `later` [n][C][s] of the elements that they come
 * to, VISIBILITY_NOTHING where one does not: in the parts weight [paths][s]. */
void reuse_deposit(size_t n, size_t s, size_t C, const walk_stream *w, const uint32_t *element,
                   const float *weight, double *later);

/* Numbers of the covariances of the groups of a mesh; 0 where they are not kept apart. */
size_t reuse_sums_groups(const mesh *m, size_t s);

/* Writes H, error, direct and covariances of the estimates, which the caller has allocated. */
void reuse_sums_end(const reuse_sums *t, reuse_estimates *e);

#endif
