#include "solver/method/low_rank/gram.h"

#include "solver/base/parallel.h"
#include "solver/linalg/dense.h"
#include "solver/method/low_rank/eigen.h"
#include "store/status.h"

#include <lapacke.h>

#include <stdlib.h>
#include <string.h>

/* A sparse row with more than this share of nonzero entries is expanded and left to BLAS, whose products are
 * that much faster. */
static const double spread_above = 1. / 5;

/* Rows expanded at a time. */
enum { PANEL = 1024 };

/* Columns of a tile of the Gram matrix that stays in the cache while sparse rows are added to it. */
enum { TILE = 256 };

lam_status gram_create(size_t m, bool single, gram *g, lam_error *error) {
    *g = (gram){.m = m};
    if (single)
        g->single = memory_allocate(m, m * sizeof *g->single, "factorization", error);
    else
        g->full = memory_allocate(m, m * sizeof *g->full, "factorization", error);
    return g->single == NULL && g->full == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

void gram_free(gram *g) {
    free(g->single);
    free(g->full);
    *g = (gram){0};
}

lam_status gram_add(gram *g, size_t n, const float *A, lam_error *error) {
    if (g->full != NULL) return dense_gram_double(n, g->m, A, g->full, error);
    dense_gram(n, g->m, A, g->single);
    return LAM_OK;
}

/* Rows with few entries, and the first entry of each tile in each of them. */
typedef struct thin_rows {
    size_t n, tiles;
    uint64_t *begin; /* [n][tiles + 1] */
} thin_rows;

typedef struct thin_job {
    gram *g;
    const sparse_block *A;
    thin_rows rows;
} thin_job;

/* g_c += a_q x and h_c += a_q y at the columns c of entries first <= q < last: two rows of the tile share
 * each load. */
static inline void add_two(const sparse_block *A, uint64_t first, uint64_t last, float x, float y,
                           float *restrict g, float *restrict h) {
    for (uint64_t q = first; q < last; q++) {
        const uint32_t c = A->columns[q];
        const float a = A->data[q];
        g[c] += a * x;
        h[c] += a * y;
    }
}

/* The products of entries p of one tile and q of another, or q >= p of the same, of one row. */
static void add_single(gram *g, const sparse_block *A, uint64_t p, uint64_t p_end, uint64_t q,
                       uint64_t q_end) {
    const bool same = p == q;
    for (; p + 2 <= p_end; p += 2) {
        const float x = A->data[p], y = A->data[p + 1];
        float *one = g->single + (size_t)A->columns[p] * g->m,
              *two = g->single + (size_t)A->columns[p + 1] * g->m;
        if (same) {
            one[A->columns[p]] += x * x;
            one[A->columns[p + 1]] += x * y;
            two[A->columns[p + 1]] += y * y;
        }
        add_two(A, same ? p + 2 : q, q_end, x, y, one, two);
    }
    if (p < p_end) {
        float *one = g->single + (size_t)A->columns[p] * g->m;
        for (q = same ? p : q; q < q_end; q++) one[A->columns[q]] += A->data[p] * A->data[q];
    }
}

static void add_double(gram *g, const sparse_block *A, uint64_t p, uint64_t p_end, uint64_t q,
                       uint64_t q_end) {
    const bool same = p == q;
    for (; p < p_end; p++) {
        double *one = g->full + (size_t)A->columns[p] * g->m;
        for (uint64_t k = same ? p : q; k < q_end; k++)
            one[A->columns[k]] += (double)A->data[p] * (double)A->data[k];
    }
}

/* Adds every row to one tile of g; piece is the number of the tile in the upper triangle. */
static void add_tile(const void *context, size_t piece) {
    const thin_job *job = context;
    const thin_rows *rows = &job->rows;
    size_t one = 0;
    while (piece >= rows->tiles - one) piece -= rows->tiles - one++;
    const size_t two = one + piece;
    for (size_t i = 0; i < rows->n; i++) {
        const uint64_t *begin = rows->begin + i * (rows->tiles + 1);
        (job->g->single != NULL ? add_single : add_double)(job->g, job->A, begin[one], begin[one + 1],
                                                           begin[two], begin[two + 1]);
    }
}

static void find_tiles(const sparse_block *A, size_t i, size_t m, size_t tiles, uint64_t *begin) {
    uint64_t p = A->indptr[i];
    for (size_t t = 0; t <= tiles; t++) {
        const size_t column = t * TILE < m ? t * TILE : m;
        while (p < A->indptr[i + 1] && A->columns[p] < column) p++;
        begin[t] = p;
    }
}

static void spread_row(const sparse_block *A, size_t i, size_t m, float *row) {
    memset(row, 0, m * sizeof *row);
    for (uint64_t p = A->indptr[i]; p < A->indptr[i + 1] && A->columns[p] < m; p++)
        row[A->columns[p]] = A->data[p];
}

lam_status gram_add_sparse(gram *g, const sparse_block *A, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t m = g->m, tiles = (m + TILE - 1) / TILE;
    size_t spread = 0;
    thin_rows thin = {.tiles = tiles};
    float *panel = memory_allocate(PANEL, m * sizeof *panel, "factorization", error);
    thin.begin = memory_allocate(A->n, (tiles + 1) * sizeof *thin.begin, "factorization", error);
    if (panel == NULL || thin.begin == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < A->n; i++) {
        const size_t length = (size_t)(A->indptr[i + 1] - A->indptr[i]);
        if (length == 0) continue;
        if ((double)length <= spread_above * (double)m) {
            find_tiles(A, i, m, tiles, thin.begin + thin.n++ * (tiles + 1));
            continue;
        }
        spread_row(A, i, m, panel + spread++ * m);
        if (spread < PANEL) continue;
        TRY(gram_add(g, spread, panel, error));
        spread = 0;
    }
    TRY(gram_add(g, spread, panel, error));
    const thin_job job = {.g = g, .A = A, .rows = thin};
    parallel_for(add_tile, &job, tiles * (tiles + 1) / 2);
done:
    free(panel);
    free(thin.begin);
    return status;
}

/* LAPACK is column-major: our upper triangle is its lower one. */
lam_status gram_eigen(gram *g, bool vectors, double *values, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t m = g->m;
    float *w = NULL;
    int info = 0;
    if (g->single != NULL) {
        w = memory_allocate(m, sizeof *w, "factorization", error);
        if (w == NULL) TRY(LAM_ERR_MEMORY);
        info = eigen_single(m, vectors, g->single, w);
        if (info == 0)
            for (size_t i = 0; i < m; i++) values[i] = (double)w[i];
    } else if (m > 0) {
        info = LAPACKE_dsyevd(LAPACK_COL_MAJOR, vectors ? 'V' : 'N', 'L', (lapack_int)m, g->full,
                              (lapack_int)m, values);
    }
    if (info == LAPACK_WORK_MEMORY_ERROR)
        FAIL(error, LAM_ERR_MEMORY,
             "eigenvectors of a block of %zu columns: out of memory; use more --levels", m);
    if (info != 0)
        FAIL(error, LAM_ERR_NUMERIC, "eigenvectors of a block of %zu columns: LAPACK syevd returned %d", m,
             info);
done:
    free(w);
    return status;
}
