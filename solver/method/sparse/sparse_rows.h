/* One row of a sparse inverse after the other, by as many threads as there are desks. Private to
 * solver/method/sparse/sparse_*.c. */
#ifndef LAMBERT_METHOD_SPARSE_SPARSE_ROWS_H
#define LAMBERT_METHOD_SPARSE_SPARSE_ROWS_H

#include "solver/base/bitset.h"
#include "solver/method/method.h"

/* Entries of R F that reach the threshold, rows and columns by position, and what each row lacks. */
typedef struct reflected {
    size_t n;
    uint64_t *indptr;
    uint32_t *indices;
    float *data;
    double *lost; /* [n] */
} reflected;

/* All that the threads share. */
typedef struct rows_job {
    const build_problem *problem;
    const float *rho;
    uint32_t *position; /* [n], element -> position */
    double threshold;
    reflected RF;
} rows_job;

/* job is owned by the caller (rows_job_end), also after an error. Errors: LAM_ERR_MEMORY. */
lam_status rows_job_begin(const build_problem *problem, const float *rho, double threshold, rows_job *job,
                          lam_error *error);
void rows_job_end(rows_job *job);

/* A row with most entries 0: where others are is marked, so that looking for them is no look at all. */
typedef struct sparse_row {
    double *value; /* [n] */
    marks there;
} sparse_row;

/* What a thread works with. */
typedef struct desk {
    size_t n;
    sparse_row sum, next; /* of T so far, and T R F */
    uint32_t *at;         /* [n], where T is not 0, ascending */
    double *T;            /* [n], there */
    size_t n_T;
    /* Rows that are done, one after the other. */
    uint32_t *indices;
    float *data;
    size_t used, capacity;
} desk;

lam_status desk_make(size_t n, desk *d, lam_error *error);
void desk_free(desk *d);

/* Makes the row at a position of M~ - I in the desk's sum: the first bounce is the whole row of F, with 1
 * where nothing reflects. */
void desk_make_row(const rows_job *job, size_t row, desk *d, double *discarded, size_t *bounces);

/* Puts the sum behind the rows that are done, and clears it; false where memory is out. */
bool desk_put_sum(desk *d, uint64_t *entries);

#endif
