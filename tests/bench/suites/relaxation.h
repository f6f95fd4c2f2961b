/* Iterations that solve for one emission without an operator: error against time. */
#ifndef LAMBERT_BENCH_RELAXATION_H
#define LAMBERT_BENCH_RELAXATION_H

#include "solver/method/method.h"
#include "tests/bench/suites/bench.h"

/* A scene and one emission of a channel. */
typedef struct relaxation_case {
    const char *scene;
    const build_problem *problem; /* with F; its first channel is solved */
    const float *E;               /* [n] */
} relaxation_case;

/* An empty table of rows that relaxation_add adds. */
table relaxation_table(void);

/* Adds Jacobi, Gauss-Seidel, shooting (Southwell; Cohen et al. 1988), conjugate gradients and stochastic
 * shooting (Neumann et al. 1995), all in double by one thread: when each first errs by less than .1, .01,
 * .001, 1e-4 and 1e-6 of |B|, area-weighted, against the converged B. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_CANCELLED, those of the reference. */
lam_status relaxation_add(const bench_run *run, const relaxation_case *of, table *out, lam_error *error);

/* Adds the answer of an operator beside them: method as in --method, value of its option `option` (NULL: its
 * presets). */
lam_status relaxation_add_operator(const bench_run *run, const relaxation_case *of, const char *method,
                                   const char *option, double value, table *out, lam_error *error);

#endif
