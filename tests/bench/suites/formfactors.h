/* The parts of the suite formfactors and what they share. */
#ifndef LAMBERT_BENCH_FORMFACTORS_H
#define LAMBERT_BENCH_FORMFACTORS_H

#include "solver/formfactor/formfactor.h"
#include "tests/bench/suites/bench.h"

recipe formfactors_rays(size_t rays, uint64_t seed);
recipe formfactors_hemicube(size_t resolution);
recipe formfactors_pairs(double accuracy, uint64_t seed);

/* form_factors_make with its progress shown as stage; seconds is what it took. */
lam_status formfactors_make_timed(const bench_run *run, const mesh *m, const uint32_t *order,
                                  const recipe *how, const char *stage, form_factors *out, double *seconds,
                                  lam_error *error);

/* F[i][j], by search in the row. */
double formfactors_entry(const csr *F, size_t i, size_t j);

/* |A - B| / |A| in the Frobenius norm. */
double formfactors_distance(const csr *A, const csr *B);

/* The Z-order of a mesh as a fresh array. */
lam_status formfactors_order(const mesh *m, uint32_t **order, lam_error *error);

/* The scene of --scene, or houses without it; name is for the tables. */
lam_status formfactors_open_scene(const bench_run *run, size_t lots, mesh *out, char name[64],
                                  lam_error *error);

/* Closed forms: estimate, truth, error bar, and how often that covers the truth. */
lam_status formfactors_closed_forms(const bench_run *run, lam_error *error);

/* Enclosures whose factors are known between whole surfaces, and the radiosity of one. */
lam_status formfactors_of_enclosures(const bench_run *run, lam_error *error);

/* Error of the radiosity against seconds of the form factors, in Cornell boxes. */
lam_status formfactors_error(const bench_run *run, lam_error *error);

/* Rays a second beside a bare loop over the same rays. */
lam_status formfactors_throughput(const bench_run *run, lam_error *error);

/* The thesis' table 4.6: hemicubes of falling resolution against the finest. */
lam_status formfactors_resolution(const bench_run *run, lam_error *error);

#endif
