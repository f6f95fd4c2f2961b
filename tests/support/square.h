/* Small one-sided rows made at random, packed and plain, and comparisons bit by bit. */
#ifndef LAMBERT_TESTS_SQUARE_H
#define LAMBERT_TESTS_SQUARE_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/rows/row_code.h"
#include "support/suite.h"

#include <stdlib.h>

/* A square of counts or weights, and the same packed. */
typedef struct square {
    size_t n;
    float *values; /* [n][n] */
    double *area;
    uint8_t *bytes;
    packed_rows found;
} square;

square square_make(size_t n, row_kind kind, uint64_t seed);

void square_free(square *s);

void same_rows(const csr *a, const csr *b);

void same_form_factors(const form_factors *a, const form_factors *b);

#endif
