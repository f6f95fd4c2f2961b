/* Products with form factors, whether these are rows or anything else that can be multiplied with. */
#ifndef LAMBERT_LINALG_FACTOR_PRODUCT_H
#define LAMBERT_LINALG_FACTOR_PRODUCT_H

#include "solver/linalg/csr.h"

typedef struct factor_product {
    size_t n;
    const csr *rows; /* NULL: they are no rows */
    /* y = F x for m vectors, both [n][m] in mesh order, x != y. It may use threads of its own. */
    lam_status (*multiply)(const void *context, size_t m, const double *x, double *y, lam_error *error);
    const void *context;
} factor_product;

/* Makes a product with rows, which must outlive it. */
factor_product factor_product_of_rows(const csr *rows);

#endif
