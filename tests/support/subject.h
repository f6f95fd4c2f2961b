/* A box's matrix S for a factorizer, and what became of it, judged by a dense SVD in double. */
#ifndef LAMBERT_TESTS_SUBJECT_H
#define LAMBERT_TESTS_SUBJECT_H

#include "solver/method/low_rank/factorizer.h"
#include "support/box_problem.h"

#include <lapacke.h>

/* A matrix to be factorized. */
typedef struct subject {
    fixture f;
    row_source rows;
    scaled_matrix S;
} subject;

void subject_make(subject *s, const double size[3], unsigned divisions);

void subject_free(subject *s);

tall_factors factors_of(const subject *s, const char *name, const factorizer_options *options,
                        factorizer_report *report);

/* The singular values of S - Q V^T, falling, by LAPACK in double; freed by the caller. */
double *values_of_difference(const scaled_matrix *S, const tall_factors *f);

double norm_of_difference(const scaled_matrix *S, const tall_factors *f);

void check_orthonormal(const tall_factors *f);

#endif
