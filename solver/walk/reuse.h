/* Reuse of shooting paths (Castro et al.): the light of all positions of a moving light from
 * walks that serve every one of them. A path of position i whose first hit is y carries for position j the
 * power
 *     Phi F(x_j, y) / sum_l N_l F(x_l, y)                                             (eq. 2.8)
 * with x_l the same point of the light as pose l carries it, N_l the paths of position l, and
 * F(x, y) = cos cos V / (pi r^2). Must not know form factors between elements. */
#ifndef LAMBERT_WALK_REUSE_H
#define LAMBERT_WALK_REUSE_H

#include "solver/walk/moving_light.h"
#include "solver/walk/walk.h"

/* REUSE_NONE: every position by its own paths (approach A). REUSE_EXACT: V by a ray each (B). REUSE_MAPS: V
 * by maps of the hemisphere about the light's centre that hold the nearest facet and its distance (C, fig.
 * 4). REUSE_CUBES: by hemicubes that hold facets alone (D, fig. 6), with F from the centre of the light. A
 * large parallelogram is divided into parts, each of which has a map and a centre of its own.
 * REUSE_ELEMENTS (E, ours): the direct light of every position by segments, and walks for all of them from
 * the elements that it lights. */
typedef enum reuse_way { REUSE_NONE, REUSE_EXACT, REUSE_MAPS, REUSE_CUBES, REUSE_ELEMENTS } reuse_way;

typedef struct reuse_problem {
    const moving_light *light; /* its positions are its poses */
    reuse_way way;
    size_t paths; /* of each position, rounded up to a multiple of WALK_BATCHES */
    bool even;    /* as many paths in all, but those of positions by a pilot that evens out their errors */
    size_t resolution; /* of maps: cells along the side of a map, pixels along the top of a hemicube; of all
                        * those of a position together */
    uint64_t seed;     /* the bits of estimates depend on it, not on threads */
    const progress *progress;
    const char *stage;
    walk_log *log; /* for measurements, or NULL */
} reuse_problem;

typedef struct reuse_estimates {
    size_t n, n_channels, n_positions; /* elements, C, s */
    size_t paths;                      /* as rounded up: of each position, or their mean */
    size_t *count;                     /* [s]: of each */
    float *H, *error; /* [C][s][n] W/m2: the mean irradiance of an element, and its standard error from
                         batches */
    float *direct;    /* [s][n]: the part of H that comes straight from the light, of the emission 1 W/m2 */
    /* [s][s] W2/m2: the sum over channels and elements of area rho^2 Cov(H_j, H_l) for the positions j and l,
     * from batches; rho is 1 where nothing in the scene reflects. The radiosity of a mix of the positions
     * with weights w has the standard error sqrt(w' K w) in the norm |B|^2 = sum over channels and elements
     * of area B^2. */
    double *covariance;
    double *of_groups; /* [groups][s][s]: the same of each group of the mesh, which add up to it; and of the
                          mean radiosity of a group, summed over channels. In a group that reflects nothing
                          rho is 1, and it adds nothing to the sum of all. NULL: there are too many groups */
    double *of_means;
    double rays;                                       /* of a path, mean, the first one included */
    double maps_seconds, trace_seconds, reuse_seconds; /* processor time of all threads */
} reuse_estimates;

void reuse_estimates_free(reuse_estimates *e);

/* With even the counts N_l of paths come from first hits of a pilot, of a twentieth of the paths at most,
 * whose own light is not used, so that nothing is biased; REUSE_NONE and REUSE_ELEMENTS leave them equal.
 * These two and REUSE_EXACT are unbiased; the bias of the others goes with the size of the light and of the
 * cells. Cost: s
 * * paths walks, for REUSE_EXACT s - 1 more rays for each; memory 8 ((T + 2) C + T + 1) n s bytes for T
 * threads. Errors: LAM_ERR_ARGUMENT names a position that reaches nothing, LAM_ERR_MEMORY, LAM_ERR_CANCELLED.
 */
lam_status walk_reuse(const walk_scene *s, const reuse_problem *problem, reuse_estimates *out,
                      lam_error *error);

#endif
