#include "solver/linalg/scaled.h"

#include "solver/base/parallel.h"
#include "store/status.h"

#include <cblas.h>

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* Rows that a thread reads from the source at a time; the same for BLAS, enough to pay for its packing;
 * floats of the dense copy that BLAS gets; rows of a piece of a block. */
enum { ROWS = 64, ROWS_OF_BLAS = 512, SPREAD_MOST = 1 << 24, ROWS_OF_PIECE = 128 };
/* Above this density a product copies rows into dense ones and calls BLAS. */
static const double dense_above = .08;
/* Terms that are added in single precision before they join the sum of their row. */
enum { TERMS = 256 };

lam_status scaled_init(scaled_matrix *S, row_source *rows, const double *area, const uint32_t *order,
                       lam_error *error) {
    const size_t n = rows->n;
    *S = (scaled_matrix){.n = n, .rows = rows, .order = order};
    S->root_area = memory_allocate(n, sizeof *S->root_area, "scaled form factors", error);
    S->position = memory_allocate(n, sizeof *S->position, "scaled form factors", error);
    if (S->root_area == NULL || S->position == NULL) {
        scaled_free(S);
        return LAM_ERR_MEMORY;
    }
    for (size_t i = 0; i < n; i++) {
        S->root_area[i] = sqrt(area[i]);
        S->position[order[i]] = (uint32_t)i;
    }
    return LAM_OK;
}

void scaled_free(scaled_matrix *S) {
    free(S->root_area);
    free(S->position);
    *S = (scaled_matrix){0};
}

void sparse_block_free(sparse_block *block) {
    free(block->indptr);
    free(block->columns);
    free(block->data);
    *block = (sparse_block){0};
}

/* Rows first ... last-1 on the curve, in pieces that threads read at once: a source that computes its rows
 * needs them all, and holds no more than a piece for each of them beside what it returns. */
typedef struct pieces_job {
    const scaled_matrix *S;
    size_t first, last;
    row_block *pieces;
    lam_status *status; /* of the first failure, and its text */
    lam_error *error;
} pieces_job;

static void read_piece(const void *context, size_t piece) {
    const pieces_job *j = context;
    const size_t first = j->first + piece * ROWS_OF_PIECE;
    const size_t m = j->last - first < ROWS_OF_PIECE ? j->last - first : ROWS_OF_PIECE;
    lam_error why = {0};
    const lam_status status = row_source_get(j->S->rows, j->S->order + first, m, &j->pieces[piece], &why);
    if (status == LAM_OK) return;
#pragma omp critical(scaled_failure)
    if (*j->status == LAM_OK) {
        *j->status = status;
        if (j->error != NULL) *j->error = why;
    }
}

/* Column c of a block, the rows of which begin at next[0 ... n-1]. */
static void put_column(const scaled_matrix *S, const row_block *rows, size_t k, size_t first, size_t c,
                       sparse_block *b, uint64_t *next) {
    const double root_e = S->root_area[S->order[first + c]];
    for (size_t p = 0; p < rows->length[k]; p++) {
        /* S_je = S_ej = A_e^1/2 F_ej A_j^-1/2 */
        const uint32_t j = rows->indices[k][p];
        const uint64_t at = next[S->position[j]]++;
        b->columns[at] = (uint32_t)c;
        b->data[at] = (float)(root_e * (double)rows->data[k][p] / S->root_area[j]);
    }
}

lam_status scaled_block(const scaled_matrix *S, size_t first, size_t last, sparse_block *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n, m = last - first, count = (m + ROWS_OF_PIECE - 1) / ROWS_OF_PIECE;
    row_block *pieces = NULL;
    sparse_block b = {.n = n, .m = m};
    uint64_t *next = memory_allocate(n, sizeof *next, "columns of form factors", error);
    b.indptr = memory_allocate(n + 1, sizeof *b.indptr, "columns of form factors", error);
    pieces = memory_allocate(count, sizeof *pieces, "columns of form factors", error);
    if (next == NULL || b.indptr == NULL || pieces == NULL) TRY(LAM_ERR_MEMORY);
    const pieces_job job = {S, first, last, pieces, &status, error};
    parallel_for(read_piece, &job, count);
    TRY(status);
    for (size_t piece = 0; piece < count; piece++)
        for (size_t k = 0; k < pieces[piece].m; k++)
            for (size_t p = 0; p < pieces[piece].length[k]; p++)
                b.indptr[S->position[pieces[piece].indices[k][p]] + 1]++;
    for (size_t i = 0; i < n; i++) {
        b.indptr[i + 1] += b.indptr[i];
        next[i] = b.indptr[i];
    }
    b.columns = memory_allocate(b.indptr[n], sizeof *b.columns, "columns of form factors", error);
    b.data = memory_allocate(b.indptr[n], sizeof *b.data, "columns of form factors", error);
    if (b.columns == NULL || b.data == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t piece = 0; piece < count; piece++) {
        for (size_t k = 0; k < pieces[piece].m; k++)
            put_column(S, &pieces[piece], k, first, piece * ROWS_OF_PIECE + k, &b, next);
        row_block_free(&pieces[piece]);
    }
    *out = b;
    b = (sparse_block){0};
done:
    for (size_t piece = 0; pieces != NULL && piece < count; piece++) row_block_free(&pieces[piece]);
    free(pieces);
    free(next);
    sparse_block_free(&b);
    return status;
}

/* y = sum_j F_ej x_j over one row, x_j [w] at X + position(j) w. */
static void multiply_row(const scaled_matrix *S, size_t length, const uint32_t *indices, const float *data,
                         size_t w, const float *X, float *y, float *part) {
    memset(y, 0, w * sizeof *y);
    for (size_t first = 0; first < length; first += TERMS) {
        const size_t last = length - first < TERMS ? length : first + TERMS;
        memset(part, 0, w * sizeof *part);
        for (size_t p = first; p < last; p++) {
            const float f = data[p], *x = X + (size_t)S->position[indices[p]] * w;
#pragma omp simd
            for (size_t v = 0; v < w; v++) part[v] += f * x[v];
        }
#pragma omp simd
        for (size_t v = 0; v < w; v++) y[v] += part[v];
    }
}

/* The rows of a block by BLAS, copied into dense [m][n]. */
static void multiply_dense(const scaled_matrix *S, const row_block *rows, size_t w, const float *X, float *Y,
                           float *dense) {
    const size_t n = S->n;
    for (size_t k = 0; k < rows->m; k++) {
        float *row = dense + k * n;
        memset(row, 0, n * sizeof *row);
        for (size_t p = 0; p < rows->length[k]; p++) row[S->position[rows->indices[k][p]]] = rows->data[k][p];
    }
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)rows->m, (int)w, (int)n, 1, dense, (int)n, X,
                (int)w, 0, Y, (int)w);
}

/* Rows first ... first + m of a product, of X already divided by A^1/2. */
static lam_status multiply_rows(const scaled_matrix *S, size_t first, size_t m, size_t w, const float *X,
                                float *Y, bool by_blas, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n;
    row_block rows = {0};
    float *work = memory_allocate(by_blas ? m * n : w, sizeof *work, "a product", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    TRY(row_source_get(S->rows, S->order + first, m, &rows, error));
    if (by_blas)
        multiply_dense(S, &rows, w, X, Y + first * w, work);
    else
        for (size_t k = 0; k < m; k++)
            multiply_row(S, rows.length[k], rows.indices[k], rows.data[k], w, X, Y + (first + k) * w, work);
    for (size_t k = 0; k < m; k++) {
        const float root = (float)S->root_area[S->order[first + k]];
        for (size_t v = 0; v < w; v++) Y[(first + k) * w + v] *= root;
    }
done:
    row_block_free(&rows);
    free(work);
    return status;
}

lam_status scaled_multiply(const scaled_matrix *S, size_t w, const float *X, float *Y, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n;
    const bool by_blas = S->rows->density > dense_above && w >= 16;
    size_t at_once = ROWS;
    while (by_blas && at_once < ROWS_OF_BLAS && 2 * at_once * n <= SPREAD_MOST) at_once *= 2;
    float *lit = memory_allocate(n, w * sizeof *lit, "a product", error);
    if (lit == NULL) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < n; i++) {
        const float share = (float)(1 / S->root_area[S->order[i]]);
        for (size_t v = 0; v < w; v++) lit[i * w + v] = X[i * w + v] * share;
    }
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t first = 0; first < n; first += at_once) {
        const size_t m = n - first < at_once ? n - first : at_once;
        lam_error why = {0};
        const lam_status one = multiply_rows(S, first, m, w, lit, Y, by_blas, &why);
        if (one == LAM_OK) continue;
#pragma omp critical(scaled_failure)
        if (status == LAM_OK) {
            status = one;
            if (error != NULL) *error = why;
        }
    }
    free(lit);
    return status;
}

lam_status scaled_multiply_double(const scaled_matrix *S, const double *x, double *y, lam_error *error) {
    lam_status status = LAM_OK;
    double *lit = memory_allocate(S->n, sizeof *lit, "a product", error); /* A^-1/2 x, by element */
    if (lit == NULL) return LAM_ERR_MEMORY;
    for (size_t j = 0; j < S->n; j++) lit[j] = x[S->position[j]] / S->root_area[j];
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t first = 0; first < S->n; first += ROWS) {
        const size_t m = S->n - first < ROWS ? S->n - first : ROWS;
        row_block rows = {0};
        lam_error why = {0};
        const lam_status one = row_source_get(S->rows, S->order + first, m, &rows, &why);
        for (size_t k = 0; one == LAM_OK && k < m; k++) {
            double sum = 0;
            for (size_t p = 0; p < rows.length[k]; p++)
                sum += (double)rows.data[k][p] * lit[rows.indices[k][p]];
            y[first + k] = S->root_area[S->order[first + k]] * sum;
        }
        row_block_free(&rows);
        if (one == LAM_OK) continue;
#pragma omp critical(scaled_failure)
        if (status == LAM_OK) {
            status = one;
            if (error != NULL) *error = why;
        }
    }
    free(lit);
    return status;
}

lam_status scaled_dense(const scaled_matrix *S, float *dense, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n;
    row_block rows = {0};
    memset(dense, 0, n * n * sizeof *dense);
    for (size_t first = 0; first < n; first += ROWS) {
        const size_t m = n - first < ROWS ? n - first : ROWS;
        TRY(row_source_get(S->rows, S->order + first, m, &rows, error));
        for (size_t k = 0; k < m; k++) {
            const double root = S->root_area[S->order[first + k]];
            for (size_t p = 0; p < rows.length[k]; p++) {
                const uint32_t j = rows.indices[k][p];
                dense[(first + k) * n + S->position[j]] =
                    (float)(root * (double)rows.data[k][p] / S->root_area[j]);
            }
        }
        row_block_free(&rows);
    }
done:
    row_block_free(&rows);
    return status;
}
