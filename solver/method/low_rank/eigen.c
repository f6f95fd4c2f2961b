#include "solver/method/low_rank/eigen.h"

#include "store/status.h"

#include <lapacke.h>

#include <limits.h>
#include <stdlib.h>

/* LAPACKE_ssyevd asks LAPACK for the size of the work area, which comes back rounded to single precision: too
 * small from about 2,900 columns on. The sizes here are those of the manual of ssyevd. LAPACK is
 * column-major: our upper triangle is its lower one. */
int eigen_single(size_t m, bool vectors, float *G, float *values) {
    const size_t n_work = vectors ? 1 + 6 * m + 2 * m * m : 1 + 2 * m, n_integers = vectors ? 3 + 5 * m : 1;
    if (m == 0) return 0;
    if (n_work > INT_MAX) return LAPACK_WORK_MEMORY_ERROR;
    float *work = memory_allocate(n_work, sizeof *work, "factorization", NULL);
    lapack_int *integers = memory_allocate(n_integers, sizeof *integers, "factorization", NULL);
    lapack_int info = LAPACK_WORK_MEMORY_ERROR;
    if (work != NULL && integers != NULL)
        info =
            LAPACKE_ssyevd_work(LAPACK_COL_MAJOR, vectors ? 'V' : 'N', 'L', (lapack_int)m, G, (lapack_int)m,
                                values, work, (lapack_int)n_work, integers, (lapack_int)n_integers);
    free(work);
    free(integers);
    return (int)info;
}
