#include "solver/formfactor/blocks/joined_kernel.h"

#include "solver/formfactor/visibility/sample.h"

#include <math.h>

/* Elements whose centroids are apart by this many times the root of the sum of their areas have the kernel of
 * their centroids, but for some per cent: no point of them need be drawn. */
static const double far_apart = 4 * 4;

/* cos cos' / (pi r^2) from x to y */
static double kernel(const float *normal_x, const float *normal_y, const double *x, const double *y) {
    double r2 = 0, leaving = 0, arriving = 0;
    for (int d = 0; d < 3; d++) {
        const double r = y[d] - x[d];
        r2 += r * r;
        leaving += r * (double)normal_x[d];
        arriving -= r * (double)normal_y[d];
    }
    return leaving > 0 && arriving > 0 ? leaving * arriving / (M_PI * r2 * r2) : 0;
}

/* The kernel at sample k: between points, or between the centroids of the elements that they lie in. */
static double kernel_at(const flat_clusters *f, const pair_sampler *sampler, uint32_t k, uint32_t a,
                        uint32_t b, bool centroids) {
    double at[4], x[3], y[3], place[2];
    pair_sampler_place(sampler, k, at);
    const uint32_t i = flat_cluster_sample(f, a, at[0], at[1], place, x);
    const uint32_t j = flat_cluster_sample(f, b, at[2], at[3], place, y);
    double u[3], v[3], apart = 0;
    mesh_centroid(f->m, i, u);
    mesh_centroid(f->m, j, v);
    for (int d = 0; d < 3; d++) apart += (u[d] - v[d]) * (u[d] - v[d]);
    const double areas = f->m->area[i] + f->m->area[j];
    if (centroids || apart > far_apart * areas) return kernel(f->m->normal[i], f->m->normal[j], u, v);
    return kernel(f->m->normal[i], f->m->normal[j], x, y);
}

double joined_kernel_spread(const flat_clusters *f, uint64_t seed, uint32_t a, uint32_t b) {
    double sum = 0, squares = 0;
    pair_sampler sampler;
    pair_sampler_init(&sampler, seed, a, b);
    for (uint32_t k = 0; k < JOINED_SAMPLES; k++) {
        const double here = kernel_at(f, &sampler, k, a, b, true);
        sum += here;
        squares += here * here;
    }
    const double mean = sum / JOINED_SAMPLES;
    return mean > 0 ? sqrt(fmax(squares / JOINED_SAMPLES - mean * mean, 0)) / mean : INFINITY;
}

double joined_kernel_mean(const flat_clusters *f, uint64_t seed, uint32_t a, uint32_t b) {
    double sum = 0;
    pair_sampler sampler;
    pair_sampler_init(&sampler, seed, a, b);
    for (uint32_t k = JOINED_SAMPLES; k < 2 * JOINED_SAMPLES; k++)
        sum += kernel_at(f, &sampler, k, a, b, false);
    return sum / JOINED_SAMPLES;
}
