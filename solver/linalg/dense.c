#include "solver/linalg/dense.h"

#include "solver/base/parallel.h"

#include <cblas.h>

#include <stdlib.h>
#include <string.h>

/* Rows of a tall product, columns of a tile of a Gram matrix and rows in double that one call of BLAS takes.
 */
enum { ROWS = 512, TILE = 256, PANEL = 2048 };

typedef struct multiply_job {
    size_t n, k, m;
    const float *A, *B;
    bool transposed;
    float *C;
} multiply_job;

static void multiply_piece(const void *context, size_t piece) {
    const multiply_job *j = context;
    const size_t first = piece * ROWS, rows = j->n - first < ROWS ? j->n - first : ROWS;
    cblas_sgemm(CblasRowMajor, CblasNoTrans, j->transposed ? CblasTrans : CblasNoTrans, (int)rows, (int)j->m,
                (int)j->k, 1, j->A + first * j->k, (int)j->k, j->B, (int)(j->transposed ? j->k : j->m), 0,
                j->C + first * j->m, (int)j->m);
}

void dense_multiply(size_t n, size_t k, size_t m, const float *A, const float *B, bool transposed, float *C) {
    if (n == 0 || m == 0) return;
    if (k == 0) {
        memset(C, 0, n * m * sizeof *C);
        return;
    }
    const multiply_job job = {n, k, m, A, B, transposed, C};
    parallel_for(multiply_piece, &job, (n + ROWS - 1) / ROWS);
}

/* The tile of a piece, counted along the rows of the upper triangle of tiles. */
static void tile_of(size_t piece, size_t tiles, size_t *row, size_t *column) {
    size_t r = 0;
    while (piece >= tiles - r) {
        piece -= tiles - r;
        r++;
    }
    *row = r;
    *column = r + piece;
}

typedef struct gram_job {
    size_t n, m, tiles;
    const float *A;
    const double *A_double;
    float *G;
    double *G_double;
} gram_job;

static void gram_piece(const void *context, size_t piece) {
    const gram_job *j = context;
    size_t r, c;
    tile_of(piece, j->tiles, &r, &c);
    const size_t first = r * TILE, second = c * TILE;
    const int rows = (int)(j->m - first < TILE ? j->m - first : TILE);
    const int columns = (int)(j->m - second < TILE ? j->m - second : TILE);
    const int n = (int)j->n, m = (int)j->m;
    if (j->A != NULL)
        cblas_sgemm(CblasRowMajor, CblasTrans, CblasNoTrans, rows, columns, n, 1, j->A + first, m,
                    j->A + second, m, 1, j->G + first * j->m + second, m);
    else
        cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, rows, columns, n, 1, j->A_double + first, m,
                    j->A_double + second, m, 1, j->G_double + first * j->m + second, m);
}

void dense_gram(size_t n, size_t m, const float *A, float *G) {
    if (n == 0 || m == 0) return;
    const size_t tiles = (m + TILE - 1) / TILE;
    const gram_job job = {.n = n, .m = m, .tiles = tiles, .A = A, .G = G};
    parallel_for(gram_piece, &job, tiles * (tiles + 1) / 2);
}

lam_status dense_gram_double(size_t n, size_t m, const float *A, double *G, lam_error *error) {
    if (n == 0 || m == 0) return LAM_OK;
    const size_t tiles = (m + TILE - 1) / TILE;
    double *panel = memory_allocate(PANEL * m, sizeof *panel, "factorization", error);
    if (panel == NULL) return LAM_ERR_MEMORY;
    for (size_t first = 0; first < n; first += PANEL) {
        const size_t rows = n - first < PANEL ? n - first : PANEL;
        for (size_t k = 0; k < rows * m; k++) panel[k] = (double)A[first * m + k];
        const gram_job job = {.n = rows, .m = m, .tiles = tiles, .A_double = panel, .G_double = G};
        parallel_for(gram_piece, &job, tiles * (tiles + 1) / 2);
    }
    free(panel);
    return LAM_OK;
}

void dense_vector(size_t n, size_t m, const float *A, bool columns, const float *x, float *t) {
    cblas_sgemv(columns ? CblasColMajor : CblasRowMajor, CblasTrans, (int)n, (int)m, 1, A,
                (int)(columns ? n : m), x, 1, 0, t, 1);
}

typedef struct project_job {
    size_t rows, m, w;
    const double *A, *B;
    double *C;
} project_job;

static void project_piece(const void *context, size_t piece) {
    const project_job *j = context;
    const size_t first = piece * TILE, columns = j->m - first < TILE ? j->m - first : TILE;
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)columns, (int)j->w, (int)j->rows, 1,
                j->A + first, (int)j->m, j->B, (int)j->w, 1, j->C + first * j->w, (int)j->w);
}

lam_status dense_project(size_t n, size_t m, size_t w, const float *A, const float *B, double *C,
                         lam_error *error) {
    memset(C, 0, m * w * sizeof *C);
    if (n == 0 || m == 0 || w == 0) return LAM_OK;
    double *a = memory_allocate(PANEL * m, sizeof *a, "factorization", error);
    double *b = memory_allocate(PANEL * w, sizeof *b, "factorization", error);
    if (a != NULL && b != NULL)
        for (size_t first = 0; first < n; first += PANEL) {
            const size_t rows = n - first < PANEL ? n - first : PANEL;
            for (size_t k = 0; k < rows * m; k++) a[k] = (double)A[first * m + k];
            for (size_t k = 0; k < rows * w; k++) b[k] = (double)B[first * w + k];
            const project_job job = {rows, m, w, a, b, C};
            parallel_for(project_piece, &job, (m + TILE - 1) / TILE);
        }
    const bool enough = a != NULL && b != NULL;
    free(a);
    free(b);
    return enough ? LAM_OK : LAM_ERR_MEMORY;
}
