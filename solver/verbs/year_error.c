#include "solver/verbs/year_error.h"

#include <stdlib.h>

lam_status year_error_take(const stated_errors *stated, const error_scene *scene, const lit_store *lit,
                           const emission *mean, const sun_way *way, double scale, size_t n_selected,
                           const uint32_t *selected, solution *out, name_error **names, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t all = scene->n * scene->n_channels;
    const float *sums = out->values;
    lit_store of_mean = *lit; /* a view */
    float *values = memory_allocate(all, sizeof *values, "the mean of a year", error);
    if (values == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < all; i++) values[i] = (float)((double)sums[i] / scale);
    of_mean.light = *mean;
    out->values = values;
    status = own_error_take(stated, scene, &of_mean, n_selected, selected, out, names, error);
    out->values = sums;
    TRY(status);
    const size_t together = out->n_reductions == 0 ? 1 : n_selected;
    if (out->head.known)
        out->head.parts.sun = sun_way_error(way, out->m, out->quantity, sums, scale, together);
done:
    free(values);
    return status;
}
