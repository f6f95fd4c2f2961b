/* Counts of paths that even out the errors of positions: a convex problem, solved by multiplicative steps. */
#include "solver/walk/reuse_counts.h"

#include <math.h>
#include <stdlib.h>

enum { STEPS = 30 };

/* No position starts fewer paths than this part of an equal share. */
static const double least = .05;

/* J_j for the parts as they are. */
static void variances(size_t n, size_t s, const float *weight, const double *part, double *J) {
    for (size_t j = 0; j < s; j++) J[j] = 0;
    for (size_t k = 0; k < n; k++) {
        const float *const w = weight + k * s;
        double sum = 0;
        for (size_t l = 0; l < s; l++) sum += part[l] * (double)w[l];
        for (size_t j = 0; j < s && sum > 0; j++) J[j] += (double)w[j] * (double)w[j] / sum;
    }
}

/* g_l = sum_j 2 J_j sum_k w_kj^2 w_kl / (sum_i r_i w_ki)^2, the gradient with its sign turned. */
static void gradient(size_t n, size_t s, const float *weight, const double *part, const double *J,
                     double *g) {
    for (size_t l = 0; l < s; l++) g[l] = 0;
    for (size_t k = 0; k < n; k++) {
        const float *const w = weight + k * s;
        double sum = 0, pull = 0;
        for (size_t l = 0; l < s; l++) {
            sum += part[l] * (double)w[l];
            pull += 2 * J[l] * (double)w[l] * (double)w[l];
        }
        for (size_t l = 0; l < s && sum > 0; l++) g[l] += pull * (double)w[l] / (sum * sum);
    }
}

static void scale_to_sum(size_t s, double *part) {
    double sum = 0;
    for (size_t l = 0; l < s; l++) sum += part[l];
    for (size_t l = 0; l < s; l++) part[l] *= (double)s / sum;
}

lam_status reuse_counts(size_t n, size_t s, const float *weight, double *part, lam_error *error) {
    double *J = memory_allocate(s, sizeof *J, "paths", error);
    double *g = memory_allocate(s, sizeof *g, "paths", error);
    for (size_t l = 0; l < s; l++) part[l] = 1;
    for (int step = 0; step < STEPS && J != NULL && g != NULL; step++) {
        variances(n, s, weight, part, J);
        gradient(n, s, weight, part, J, g);
        for (size_t l = 0; l < s; l++) part[l] *= sqrt(g[l]);
        scale_to_sum(s, part);
        for (size_t l = 0; l < s; l++) part[l] = fmax(part[l], least);
        scale_to_sum(s, part);
    }
    const bool ready = J != NULL && g != NULL;
    free(J);
    free(g);
    return ready ? LAM_OK : LAM_ERR_MEMORY;
}
