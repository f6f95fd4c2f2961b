#include "solver/method/low_rank/orthonormal.h"

#include <lapacke.h>

#include <stdlib.h>

lam_status orthonormal_columns(size_t n, size_t k, float *Q, lam_error *error) {
    lam_status status = LAM_OK;
    /* Rows of Q are columns to LAPACK: the QR of Q is the LQ of what it sees. */
    const lapack_int rows = (lapack_int)k, columns = (lapack_int)n;
    float *tau = memory_allocate(k, sizeof *tau, "QR", error);
    if (tau == NULL) TRY(LAM_ERR_MEMORY);
    lapack_int info = LAPACKE_sgelqf(LAPACK_COL_MAJOR, rows, columns, Q, rows, tau);
    if (info == 0) info = LAPACKE_sorglq(LAPACK_COL_MAJOR, rows, columns, rows, Q, rows, tau);
    if (info == LAPACK_WORK_MEMORY_ERROR) FAIL(error, LAM_ERR_MEMORY, "QR of %zu columns: out of memory", k);
    if (info != 0) FAIL(error, LAM_ERR_NUMERIC, "QR of %zu columns: LAPACK returned %d", k, (int)info);
done:
    free(tau);
    return status;
}
