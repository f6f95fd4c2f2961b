#include "solver/linalg/csr_parts.h"

/* The root of i in a forest whose roots point to themselves; paths are halved. */
static uint32_t root_of(uint32_t *above, uint32_t i) {
    while (above[i] != i) {
        above[i] = above[above[i]];
        i = above[i];
    }
    return i;
}

void csr_parts(const csr *A, uint32_t *part, size_t *count) {
    size_t left = A->n;
    *count = 0;
    for (size_t i = 0; i < A->n; i++) part[i] = (uint32_t)i;
    for (size_t i = 0; i < A->n; i++)
        for (uint64_t e = A->indptr[i]; left > 1 && e < A->indptr[i + 1]; e++) {
            if (!(A->data[e] > 0)) continue;
            const uint32_t a = root_of(part, (uint32_t)i), b = root_of(part, A->indices[e]);
            /* The smaller row is the root, so that all of a row's path have smaller numbers. */
            if (a < b) part[b] = a;
            if (b < a) part[a] = b;
            left -= a != b;
        }
    /* In ascending order each row's parent has its number already. */
    for (size_t i = 0; i < A->n; i++) part[i] = part[i] == i ? (uint32_t)(*count)++ : part[part[i]];
}
