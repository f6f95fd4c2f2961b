/* The parts of the suite hierarchical. */
#ifndef LAMBERT_BENCH_HIERARCHICAL_H
#define LAMBERT_BENCH_HIERARCHICAL_H

#include "tests/bench/suites/lowrank.h"

/* Closed Cornell boxes of growing size; time, memory and stored coefficients per element, beside an operator
 * of low rank. */
lam_status hierarchical_growth(const bench_run *run, lam_error *error);

/* The light that a mesh leaves out, with values constant on elements and smooth. */
lam_status hierarchical_smooth(const bench_run *run, lam_error *error);

/* Time against error of each way to find form factors, scene by scene. */
typedef struct hierarchical_plane {
    table points, equal;
} hierarchical_plane;

void hierarchical_plane_begin(hierarchical_plane *p);
void hierarchical_plane_free(hierarchical_plane *p);

/* Measures a scene against the converged solution of F, rows of an independent sample; first: its direct
 * light where F is of rays, or NULL. */
lam_status hierarchical_plane_add(const bench_run *run, const lowrank_scene *s, const csr *F,
                                  first_light *first, hierarchical_plane *p, lam_error *error);

/* Hands both tables on. */
lam_status hierarchical_plane_end(const bench_run *run, hierarchical_plane *p, lam_error *error);

#endif
