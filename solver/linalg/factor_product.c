#include "solver/linalg/factor_product.h"

/* Rows that a thread takes at a time. */
enum { ROWS_AT_ONCE = 64 };

static lam_status multiply_rows(const void *context, size_t m, const double *x, double *y, lam_error *error) {
    const csr *rows = context;
    const size_t n = rows->n;
    (void)error;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t first = 0; first < n; first += ROWS_AT_ONCE)
        csr_multiply_rows(rows, first, first + ROWS_AT_ONCE < n ? first + ROWS_AT_ONCE : n, m, x, y);
    return LAM_OK;
}

factor_product factor_product_of_rows(const csr *rows) {
    return (factor_product){.n = rows->n, .rows = rows, .multiply = multiply_rows, .context = rows};
}
