#include "solver/linalg/csr_parts.h"

#include "solver/base/union_find.h"

void csr_parts(const csr *A, uint32_t *part, size_t *count) {
    size_t left = A->n;
    for (size_t i = 0; i < A->n; i++) part[i] = (uint32_t)i;
    for (size_t i = 0; i < A->n; i++)
        for (uint64_t e = A->indptr[i]; left > 1 && e < A->indptr[i + 1]; e++)
            if (A->data[e] > 0) left -= union_find_join(part, (uint32_t)i, A->indices[e]);
    *count = union_find_number(part, A->n);
}
