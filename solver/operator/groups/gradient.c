#include "solver/operator/groups/gradient.h"

void gradient_of_reflectance(lam_quantity quantity, size_t count, const float *g, const float *w,
                             const float *H, const float *H0, float *out) {
    for (size_t i = 0; i < count; i++) {
        double sum = (double)w[i] * (double)H[i];
        if (quantity == LAM_INDIRECT)
            sum += (double)g[i] * ((double)H[i] - (H0 != NULL ? (double)H0[i] : 0.0));
        out[i] = (float)sum;
    }
}

void gradient_of_direct_irradiance(lam_quantity quantity, size_t count, const float *reflectance,
                                   const float *g, const float *w, float *out) {
    for (size_t i = 0; i < count; i++) {
        double sum = (double)reflectance[i] * (double)w[i];
        if (quantity == LAM_IRRADIANCE) sum += (double)g[i];
        out[i] = (float)sum;
    }
}

void gradient_of_groups(size_t n_channels, size_t n, const group_index *groups, const float *w, float *out) {
    for (size_t c = 0; c < n_channels; c++)
        for (size_t g = 0; g < groups->n_groups; g++) {
            double sum = 0;
            for (uint32_t k = groups->start[g]; k < groups->start[g + 1]; k++)
                sum += (double)w[c * n + groups->elements[k]];
            out[c * groups->n_groups + g] = (float)sum;
        }
}
