#include "solver/linalg/row_source.h"

#include "store/status.h"

#include <stdlib.h>

void row_block_free(row_block *block) {
    for (size_t k = 0; k < sizeof block->owned / sizeof *block->owned; k++) free(block->owned[k]);
    *block = (row_block){0};
}

static lam_status rows_of_csr(void *context, const uint32_t *elements, size_t m, row_block *out,
                              lam_error *error) {
    const csr *F = context;
    const uint32_t **indices = memory_allocate(m, sizeof *indices, "rows of form factors", error);
    const float **data = memory_allocate(m, sizeof *data, "rows of form factors", error);
    size_t *length = memory_allocate(m, sizeof *length, "rows of form factors", error);
    *out = (row_block){
        .m = m, .indices = indices, .data = data, .length = length, .owned = {indices, data, length}};
    if (indices == NULL || data == NULL || length == NULL) {
        row_block_free(out);
        return LAM_ERR_MEMORY;
    }
    for (size_t k = 0; k < m; k++) {
        const uint64_t first = F->indptr[elements[k]];
        length[k] = (size_t)(F->indptr[elements[k] + 1] - first);
        indices[k] = length[k] > 0 ? F->indices + first : NULL;
        data[k] = length[k] > 0 ? F->data + first : NULL;
    }
    return LAM_OK;
}

void row_source_of_csr(row_source *source, const csr *F) {
    const double all = (double)F->n * (double)F->n;
    *source = (row_source){.n = F->n,
                           .density = all > 0 ? (double)F->indptr[F->n] / all : 0,
                           .rows = rows_of_csr,
                           /* Only read, by rows_of_csr. */
                           .context = (void *)(uintptr_t)F};
}

lam_status row_source_get(row_source *source, const uint32_t *elements, size_t m, row_block *out,
                          lam_error *error) {
    const lam_status status = source->rows(source->context, elements, m, out, error);
    if (status == LAM_OK) __atomic_fetch_add(&source->rows_given, m, __ATOMIC_RELAXED);
    return status;
}

double row_source_passes(const row_source *source) {
    return source->n > 0 ? (double)source->rows_given / (double)source->n : 0;
}
