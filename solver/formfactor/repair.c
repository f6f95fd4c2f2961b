#include "solver/formfactor/repair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sweeps end when every row is this close to 1 (single precision rows cannot hold more), or when they are
 * spent: what is left over goes to the outside. */
static const double sweep_tolerance = 2e-8;
enum { MAX_SWEEPS = 200, PARALLEL_ROWS = 2048 };

/* T = C^T as rows with ascending indices. */
static lam_status transpose(const csr *C, csr *T, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = C->n, nnz = C->indptr[n];
    csr t = {.n = n};
    uint64_t *next = memory_allocate(n + 1, sizeof *next, "form factors", error);
    t.indptr = memory_allocate(n + 1, sizeof *t.indptr, "form factors", error);
    t.indices = memory_allocate(nnz, sizeof *t.indices, "form factors", error);
    t.data = memory_allocate(nnz, sizeof *t.data, "form factors", error);
    if (next == NULL || t.indptr == NULL || t.indices == NULL || t.data == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < nnz; p++) t.indptr[C->indices[p] + 1]++;
    for (size_t i = 0; i < n; i++) t.indptr[i + 1] += t.indptr[i];
    memcpy(next, t.indptr, (n + 1) * sizeof *next);
    for (size_t i = 0; i < n; i++) {
        for (uint64_t p = C->indptr[i]; p < C->indptr[i + 1]; p++) {
            const uint64_t q = next[C->indices[p]]++;
            t.indices[q] = (uint32_t)i;
            t.data[q] = C->data[p];
        }
    }
    *T = t;
    t = (csr){0};
done:
    free(next);
    csr_free(&t);
    return status;
}

/* Adds row i of two CSRs; returns how many indices either has. With indices NULL
 * it only counts. */
static size_t merge_row(const csr *C, const csr *T, size_t i, uint32_t *indices, float *sums) {
    uint64_t p = C->indptr[i], q = T->indptr[i];
    const uint64_t p_end = C->indptr[i + 1], q_end = T->indptr[i + 1];
    size_t length = 0;
    while (p < p_end || q < q_end) {
        const uint32_t a = p < p_end ? C->indices[p] : UINT32_MAX, b = q < q_end ? T->indices[q] : UINT32_MAX;
        const uint32_t j = a < b ? a : b;
        float sum = 0;
        if (a == j) sum += C->data[p++];
        if (b == j) sum += T->data[q++];
        if (indices != NULL) {
            indices[length] = j;
            sums[length] = sum;
        }
        length++;
    }
    return length;
}

lam_status repair_merge(const csr *counts, size_t rays, const double *area, csr *G, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = counts->n;
    csr T = {0}, g = {.n = n};
    TRY(transpose(counts, &T, error));
    g.indptr = memory_allocate(n + 1, sizeof *g.indptr, "form factors", error);
    if (g.indptr == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < n; i++) g.indptr[i + 1] = merge_row(counts, &T, i, NULL, NULL);
    for (size_t i = 0; i < n; i++) g.indptr[i + 1] += g.indptr[i];
    g.indices = memory_allocate(g.indptr[n], sizeof *g.indices, "form factors", error);
    g.data = memory_allocate(g.indptr[n], sizeof *g.data, "form factors", error);
    if (g.indices == NULL || g.data == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < n; i++) {
        merge_row(counts, &T, i, g.indices + g.indptr[i], g.data + g.indptr[i]);
        for (uint64_t p = g.indptr[i]; p < g.indptr[i + 1]; p++) {
            const double a = area[i], b = area[g.indices[p]];
            g.data[p] = (float)((double)g.data[p] / (double)rays * (a * b / (a + b)));
        }
    }
    *G = g;
    g = (csr){0};
done:
    csr_free(&T);
    csr_free(&g);
    return status;
}

/* r_i = d_i (A_i outside_i + sum_j g_ij d_j) */
static void scaled_row_sums(const csr *G, const double *area, const double *outside, const double *d,
                            double *r) {
#pragma omp parallel for schedule(static, 64) if (G->n >= PARALLEL_ROWS)
    for (size_t i = 0; i < G->n; i++) {
        double sum = area[i] * outside[i];
        for (uint64_t p = G->indptr[i]; p < G->indptr[i + 1]; p++)
            sum += (double)G->data[p] * d[G->indices[p]];
        r[i] = d[i] * sum;
    }
}

/* d_i <- d_i sqrt(A_i / r_i) until r_i = A_i; the root damps the sweep so that it also settles where light
 * goes to and fro between two sets (facing plates). Where no scaling meets every row, rows may still pass
 * A_i: they are scaled down, and with them the other ends of their pairs. */
static void sweep(const csr *G, const double *area, const double *outside, double *d, double *r) {
    const size_t n = G->n;
    for (int count = 0; count < MAX_SWEEPS; count++) {
        scaled_row_sums(G, area, outside, d, r);
        double worst = 0;
        for (size_t i = 0; i < n; i++) {
            if (r[i] <= 0) continue;
            worst = fmax(worst, fabs(r[i] / area[i] - 1));
            d[i] *= sqrt(area[i] / r[i]);
        }
        if (worst <= sweep_tolerance) break;
    }
    scaled_row_sums(G, area, outside, d, r);
    for (size_t i = 0; i < n; i++)
        if (r[i] > area[i]) d[i] *= area[i] / r[i];
}

lam_status repair_close(csr *G, const double *area, const double *outside, form_factors *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = G->n;
    double *before = memory_allocate(n, sizeof *before, "row sums", error);
    double *d = memory_allocate(n, sizeof *d, "row scales", error);
    double *r = memory_allocate(n, sizeof *r, "row sums", error);
    double *row_sums = memory_allocate(n, sizeof *row_sums, "row sums", error);
    if (before == NULL || d == NULL || r == NULL || row_sums == NULL) TRY(LAM_ERR_MEMORY);

    for (size_t i = 0; i < n; i++) d[i] = 1;
    scaled_row_sums(G, area, outside, d, before);
    sweep(G, area, outside, d, r);

    double reciprocity_error = 0;
#pragma omp parallel for schedule(static, 64) reduction(max : reciprocity_error)
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (uint64_t p = G->indptr[i]; p < G->indptr[i + 1]; p++) {
            const size_t j = G->indices[p];
            const double g = (double)G->data[p] * d[i] * d[j];
            const float forward = (float)fmin(g / area[i], 1), backward = (float)fmin(g / area[j], 1);
            G->data[p] = forward;
            sum += (double)forward;
            const double one = area[i] * (double)forward, other = area[j] * (double)backward;
            if (fmax(one, other) > 0)
                reciprocity_error = fmax(reciprocity_error, fabs(one - other) / fmax(one, other));
        }
        row_sums[i] = sum;
    }
    out->closure_error = out->repair_max = 0;
    double repair = 0, total_area = 0;
    for (size_t i = 0; i < n; i++) {
        const double total = row_sums[i] + d[i] * outside[i], change = fabs(1 - before[i] / area[i]);
        /* A row that sees nothing at all has nothing to close. */
        if (total > 0) out->closure_error = fmax(out->closure_error, fabs(1 - total));
        out->repair_max = fmax(out->repair_max, change);
        repair += area[i] * change;
        total_area += area[i];
    }
    out->repair_mean = repair / total_area;
    out->reciprocity_error = reciprocity_error;
    out->row_sums = row_sums;
    row_sums = NULL;
done:
    free(before);
    free(d);
    free(r);
    free(row_sums);
    return status;
}
