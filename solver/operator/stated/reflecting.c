#include "solver/operator/stated/reflecting.h"

#include <stdlib.h>

lam_status reflecting_make(size_t n, size_t n_channels, const double *area, const float *reflectance,
                           size_t n_groups, const uint32_t *group, reflecting **out, lam_error *error) {
    lam_status status = LAM_OK;
    const double C = (double)n_channels;
    double *areas = memory_allocate(n_groups, sizeof *areas, "reflectances of groups", error);
    double *sums = memory_allocate(n_groups, sizeof *sums, "reflectances of groups", error);
    reflecting *made = memory_allocate(n_groups, sizeof *made, "reflectances of groups", error);
    if (areas == NULL || sums == NULL || made == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) areas[group[i]] += area[i];
    for (size_t c = 0; c < n_channels; c++) {
        for (size_t g = 0; g < n_groups; g++) sums[g] = 0;
        for (size_t i = 0; i < n; i++) {
            const double rho = (double)reflectance[c * n + i];
            made[group[i]].square += area[i] * rho * rho / (C * areas[group[i]]);
            sums[group[i]] += area[i] * rho / areas[group[i]];
        }
        for (size_t g = 0; g < n_groups; g++) made[g].mean_square += sums[g] * sums[g] / C;
    }
    for (size_t g = 0; g < n_groups; g++)
        if (!(made[g].square > 0 && made[g].mean_square > 0))
            made[g] = (reflecting){.square = 1, .mean_square = 1, .black = true};
    *out = made;
    made = NULL;
done:
    free(areas);
    free(sums);
    free(made);
    return status;
}
