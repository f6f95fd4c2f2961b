#include "solver/render/visible_view.h"

#include "store/status.h"

#include <stdlib.h>
#include <string.h>

lam_status visible_view_counts(store *s, size_t n, float **values, double *mean, double *most,
                               lam_error *error) {
    lam_status status = LAM_OK;
    void *ends = NULL, *columns = NULL;
    char *storage = NULL;
    float *counts = NULL;
    size_t dims[STORE_MAX_RANK] = {n + 1}, entries[STORE_MAX_RANK] = {SIZE_MAX};
    if (!store_has(s, "/form_factors"))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: keeps no form factors; precompute it with --keep-form-factors",
             store_path(s));
    TRY(store_get_text(s, "/form_factors", "storage", &storage, error));
    if (strcmp(storage, "compressed") == 0)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: its form factors are compressed, which does not say who sees whom; precompute it with "
             "--keep-form-factors alone",
             store_path(s));
    TRY(store_read(s, "/form_factors/indptr", STORE_U64, 1, dims, &ends, error));
    TRY(store_read(s, "/form_factors/indices", STORE_U32, 1, entries, &columns, error));
    counts = memory_allocate(n, sizeof *counts, "counts", error);
    if (counts == NULL) TRY(LAM_ERR_MEMORY);
    const uint64_t *row = ends;
    const uint32_t *column = columns;
    const bool upper = strcmp(storage, "upper") == 0; /* each pair once, and both see */
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = row[i]; e < row[i + 1]; e++) {
            if (row[i + 1] > entries[0] || column[e] >= n)
                FAIL(error, LAM_ERR_FORMAT, "%s: /form_factors: row %zu goes beyond what is there",
                     store_path(s), i);
            counts[i]++;
            if (upper) counts[column[e]]++;
        }
    *mean = *most = 0;
    for (size_t i = 0; i < n; i++) {
        *mean += (double)counts[i] / (double)n;
        *most = (double)counts[i] > *most ? (double)counts[i] : *most;
    }
    *values = counts;
    counts = NULL;
done:
    free(ends);
    free(columns);
    free(storage);
    free(counts);
    return status;
}
