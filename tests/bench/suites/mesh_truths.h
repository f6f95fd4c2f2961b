/* The light that a mesh leaves out: what is true inside elements, by unbiased walks at points and by a mesh
 * 16 times finer, and the errors of answers that are constant on elements. */
#ifndef LAMBERT_BENCH_MESH_TRUTHS_H
#define LAMBERT_BENCH_MESH_TRUTHS_H

#include "tests/bench/suites/lowrank.h"

/* The lights of the suite: the lamps of the scene, and 1 from every element. */
enum { MESH_LIGHTS = 2, MESH_FINER = 16 };

/* The emissions [MESH_LIGHTS][C][n], freed with free(); *first is 1 where the scene has no lamps. Errors:
 * LAM_ERR_MEMORY. */
lam_status mesh_lights(const mesh *m, float **E, size_t *first, lam_error *error);

/* Points of a scene, the centres of tiny pieces of its faces, in equal strata of its area. */
typedef struct mesh_points {
    size_t n, n_channels;
    double (*place)[3];
    float (*normal)[3];
    double *truth, *spread; /* [MESH_LIGHTS][C][n]: B - E by walks, and its standard error */
} mesh_points;

void mesh_points_free(mesh_points *p);

/* n points of the faces of a mesh, which it divides into tiny pieces, with walks that gather. Cost: that of
 * all walks. Errors: those of mesh_refine and walk_gather. */
lam_status mesh_points_walk(const bench_run *run, mesh *pieces, size_t n, size_t walks, mesh_points *out,
                            lam_error *error);

/* element[k]: the element of m at point k, of the same scene. Cost: O(n of both). Errors: LAM_ERR_MEMORY, and
 * LAM_ERR_INTERNAL where there is none. */
lam_status mesh_points_locate(const mesh_points *p, const mesh *m, uint32_t *element, lam_error *error);

/* A copy of a mesh with each element divided into MESH_FINER. Freed by mesh_free. Errors: LAM_ERR_MEMORY. */
lam_status mesh_divide(const mesh *m, mesh *out, lam_error *error);

/* Errors of B - E [C][n], constant on elements, as shares of |B - E|. */
typedef struct mesh_errors {
    double means;    /* of the means over elements, by the finer mesh; NaN: there is none */
    double constant; /* at every place, by the finer mesh; NaN likewise */
    double points;   /* at the points, less the noise of their walks */
    double bar;      /* standard error of points */
} mesh_errors;

/* fine: B - E [C][16 n] of the finer mesh, or NULL. */
mesh_errors mesh_compare(const mesh *m, const double *x, const mesh *finer, const double *fine,
                         const mesh_points *points, const uint32_t *element, size_t light);

/* B - E [MESH_LIGHTS][C][n] of the converged solution of F, in double, freed with free(). */
lam_status mesh_converged(const bench_run *run, const lowrank_scene *s, const float *E, double **out,
                          lam_error *error);

#endif
