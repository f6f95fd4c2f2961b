#include "solver/operator/stated/luminaire_law.h"

#include "solver/operator/luminaire_light.h"

lit_luminaires lit_luminaires_of(const lam_luminaires *luminaires, const float *dimmers) {
    if (luminaires == NULL || dimmers == NULL) return (lit_luminaires){.k = 0};
    return (lit_luminaires){.k = lam_luminaires_count(luminaires),
                            .dimmers = dimmers,
                            .factors = luminaires_factors(luminaires),
                            .elements_off = luminaires_elements_off(luminaires),
                            .means_off = luminaires_means_off(luminaires),
                            .lumens = luminaires_lumens(luminaires)};
}

double lit_luminaires_number(const lit_luminaires *lit, size_t n_channels) {
    double sum = 0, squares = 0;
    for (size_t k = 0; k < lit->k; k++) {
        double P = 0;
        for (size_t c = 0; c < n_channels; c++) P += (double)lit->dimmers[c * lit->k + k] * lit->lumens[k];
        sum += P;
        squares += P * P;
    }
    return squares > 0 ? sum * sum / squares : 0;
}

bool luminaires_know_errors(const lam_luminaires *luminaires, size_t n_groups) {
    return luminaires_error_groups(luminaires) == n_groups;
}

double luminaire_law(const lit_luminaires *lit, const double *off, size_t n_channels, size_t n_groups,
                     size_t group, const double *reflectance) {
    double sum = 0;
    for (size_t c = 0; c < n_channels; c++) {
        const double rho = reflectance != NULL ? reflectance[c * n_groups + group] : 1;
        double of_channel = 0;
        for (size_t k = 0; k < lit->k; k++) {
            const double weight = (double)lit->dimmers[c * lit->k + k] * lit->factors[c * lit->k + k];
            of_channel += weight * weight * off[k * n_groups + group];
        }
        sum += rho * rho * of_channel;
    }
    return sum;
}
