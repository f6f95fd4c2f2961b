/* Computes single rows of a sparse inverse; a thread has one working area. Private to sparse_*.c. */
#ifndef LAMBERT_METHOD_SPARSE_SPARSE_ROWS_H
#define LAMBERT_METHOD_SPARSE_SPARSE_ROWS_H

#include "solver/base/bitset.h"
#include "solver/method/method.h"
#include "solver/method/sparse/sparse_inverse.h"

/* R F without its entries below the threshold, rows and columns by position, and the sum dropped from each
 * row. */
typedef struct reflected {
    size_t n;
    uint64_t *indptr;
    uint32_t *indices;
    float *data;
    double *lost; /* [n] */
} reflected;

/* Shared by all threads. */
typedef struct rows_job {
    const build_problem *problem;
    const float *rho;
    uint32_t *position; /* [n], element -> position */
    double threshold;
    bool whole_black; /* rows of rho = 0 keep all of their first bounce */
    reflected RF;
} rows_job;

/* job is owned by the caller (rows_job_end), also after an error. Errors: LAM_ERR_MEMORY. */
lam_status rows_job_begin(const build_problem *problem, const float *rho, const sparse_limits *limits,
                          rows_job *job, lam_error *error);
void rows_job_end(rows_job *job);

/* A dense row, most entries of which are 0, with the set of the others. */
typedef struct sparse_row {
    double *value; /* [n] */
    bitset there;
} sparse_row;

/* The working area of one thread. */
typedef struct row_work {
    size_t n;
    sparse_row sum, next; /* sum of all T, and T R F */
    uint32_t *at;         /* [n], columns where T is not 0, ascending */
    double *T;            /* [n], the values there */
    size_t n_T;
    /* Rows that are done, one after the other. */
    uint32_t *indices;
    float *data;
    size_t used, capacity;
} row_work;

lam_status row_work_make(size_t n, row_work *d, lam_error *error);
void row_work_free(row_work *d);

/* Light that is above the threshold after so many bounces: where all reflect more than .995. Every bounce of
 * a row may cost n^2. */
enum { ROW_BOUNCES = 2000 };

/* Sums the row of M~ - I at a position up in d->sum. The first bounce is the whole row of R F, with 1 in
 * place of rho = 0. Above ROW_BOUNCES *bounces, it was given up. */
void row_work_compute(const rows_job *job, size_t row, row_work *d, double *discarded, size_t *bounces);

/* Appends d->sum to the rows that are done and clears it; false if memory is short. */
bool row_work_store(row_work *d, uint64_t *entries);

#endif
