#include "solver/formfactor/seen.h"

#include "solver/formfactor/rays/hemicube.h"
#include "solver/formfactor/rays/rays.h"

#include <stdlib.h>

lam_status seen_count(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                      const progress *steps, const char *stage, size_t *seen, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    hemicube h = {0};
    found_rows rows = {0};
    double *outside = memory_allocate(m->n, 2 * sizeof *outside, "rows of form factors", error);
    if (outside == NULL) return LAM_ERR_MEMORY;
    const form_factor_options options = {
        .recipe = *how, .progress = steps, .stage = stage, .only_first = count};
    if (how->method != RECIPE_RAYS && how->method != RECIPE_HEMICUBE)
        FAIL(error, LAM_ERR_ARGUMENT, "elements seen: must be counted by rays or by hemicubes");
    if (count < 1 || count > m->n)
        FAIL(error, LAM_ERR_ARGUMENT, "elements seen: by %zu of %zu elements; must be by 1 to all", count,
             m->n);
    TRY(visibility_create(m, &v, error));
    if (how->method == RECIPE_HEMICUBE) {
        TRY(hemicube_create(how->resolution, &h, error));
        TRY(hemicube_trace(&h, m, v, elements, &options, &rows, outside, outside + m->n, error));
    } else {
        TRY(rays_count(m, v, elements, &options, &rows, outside, outside + m->n, error));
    }
    for (size_t k = 0; k < count; k++) seen[k] = rows.rows[elements[k]].n_entries;
done:
    free(outside);
    found_rows_free(&rows);
    hemicube_free(&h);
    visibility_destroy(v);
    return status;
}
