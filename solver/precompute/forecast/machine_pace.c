#include "solver/precompute/forecast/machine_pace.h"

#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/linalg/csr.h"

#include <stdlib.h>

enum { ROWS = 4096, ROW_ENTRIES = 32, VECTORS = 8, TURNS_MOST = 1000 };
static const double trial_seconds = .02;

/* Processor seconds of one entry with one vector: an AMD EPYC with AVX-512 and other work beside it, 2026, as
 * when the constants of stages were measured. */
static const double entry_seconds = 2e-10;

static lam_status make_matrix(csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    uint64_t seed = 1;
    csr a = {.n = ROWS, .indptr = memory_allocate(ROWS + 1, sizeof *a.indptr, "a trial", error)};
    if (a.indptr == NULL) TRY(LAM_ERR_MEMORY);
    TRY(csr_reserve(&a, (size_t)ROWS * ROW_ENTRIES, error));
    for (size_t i = 0; i <= ROWS; i++) a.indptr[i] = i * ROW_ENTRIES;
    for (size_t e = 0; e < (size_t)ROWS * ROW_ENTRIES; e++) {
        a.indices[e] = (uint32_t)(random_unit(&seed) * ROWS);
        a.data[e] = 1.f / ROW_ENTRIES;
    }
    *out = a;
    a = (csr){.n = 0};
done:
    csr_free(&a);
    return status;
}

lam_status machine_slowness_measure(double *slowness, lam_error *error) {
    lam_status status = LAM_OK;
    csr a = {.n = 0};
    double *X = memory_allocate(ROWS * VECTORS, sizeof *X, "a trial", error);
    double *Y = memory_allocate(ROWS * VECTORS, sizeof *Y, "a trial", error);
    if (X == NULL || Y == NULL) TRY(LAM_ERR_MEMORY);
    TRY(make_matrix(&a, error));
    double started = 0, seconds = 0;
    int turns = -1; /* the first one fills caches */
    while (turns < TURNS_MOST && seconds < trial_seconds) {
        if (turns <= 0) started = clock_thread_seconds();
        csr_multiply_rows(&a, 0, ROWS, VECTORS, X, Y);
        seconds = ++turns > 0 ? clock_thread_seconds() - started : 0;
    }
    *slowness = seconds / ((double)turns * ROWS * ROW_ENTRIES * VECTORS * entry_seconds);
done:
    free(X);
    free(Y);
    csr_free(&a);
    return status;
}
