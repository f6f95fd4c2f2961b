#include "solver/formfactor/rows/row_merge.h"

#include "store/status.h"

/* u A + w B, or B where it has an entry and else A. */
typedef struct combination {
    const csr *A, *B;
    float u, w;
    bool replace;
} combination;

/* Row i; returns how many entries it has. With indices NULL it only counts. */
static size_t combine_row(const combination *c, size_t i, uint32_t *indices, float *data) {
    const csr *A = c->A, *B = c->B;
    uint64_t p = A->indptr[i], q = B->indptr[i];
    size_t length = 0;
    while (p < A->indptr[i + 1] || q < B->indptr[i + 1]) {
        const uint32_t a = p < A->indptr[i + 1] ? A->indices[p] : UINT32_MAX;
        const uint32_t b = q < B->indptr[i + 1] ? B->indices[q] : UINT32_MAX;
        const uint32_t j = a < b ? a : b;
        float sum = 0;
        if (a == j) sum += c->u * A->data[p++];
        if (b == j) sum = (c->replace ? 0 : sum) + c->w * B->data[q++];
        if (sum == 0) continue;
        if (indices != NULL) {
            indices[length] = j;
            data[length] = sum;
        }
        length++;
    }
    return length;
}

static lam_status combine(const combination *c, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->A->n;
    csr sum = {.n = n, .place = c->A->place};
    if (c->B->n != n)
        FAIL(error, LAM_ERR_ARGUMENT, "rows of %zu and %zu elements cannot be combined", n, c->B->n);
    sum.indptr = memory_allocate(n + 1, sizeof *sum.indptr, "form factors", error);
    if (sum.indptr == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < n; i++) sum.indptr[i + 1] = combine_row(c, i, NULL, NULL);
    for (size_t i = 0; i < n; i++) sum.indptr[i + 1] += sum.indptr[i];
    TRY(csr_reserve(&sum, sum.indptr[n], error));
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < n; i++) combine_row(c, i, sum.indices + sum.indptr[i], sum.data + sum.indptr[i]);
    *out = sum;
    sum = (csr){0};
done:
    csr_free(&sum);
    return status;
}

lam_status rows_combine(const csr *A, float u, const csr *B, float w, csr *out, lam_error *error) {
    const combination c = {.A = A, .B = B, .u = u, .w = w};
    return combine(&c, out, error);
}

lam_status rows_replace(const csr *A, const csr *B, csr *out, lam_error *error) {
    const combination c = {.A = A, .B = B, .u = 1, .w = 1, .replace = true};
    return combine(&c, out, error);
}
