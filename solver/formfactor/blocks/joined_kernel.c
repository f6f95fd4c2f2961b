#include "solver/formfactor/blocks/joined_kernel.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>

/* Elements whose centroids are apart by this many times the root of the sum of their areas have the kernel of
 * their centroids, but for some per cent: no point of them need be drawn. */
static const double far_apart = 4 * 4;

void joined_elements_set(const flat_clusters *f, joined_element *out) {
    for (size_t p = 0; p < f->m->n; p++) {
        const uint32_t i = f->tree->order[p];
        mesh_centroid(f->m, i, out[p].centre);
        for (int d = 0; d < 3; d++) out[p].normal[d] = (double)f->m->normal[i][d];
        out[p].area = f->tree->area[p];
    }
}

bool joined_kernel_takes_all(const joined_kernel *k, uint32_t a, uint32_t b) {
    const block_node *x = &k->f->tree->nodes[a], *y = &k->f->tree->nodes[b];
    return (uint64_t)(x->end - x->begin) * (y->end - y->begin) <= JOINED_PAIRS;
}

/* cos cos' / (pi r^2) from x to y */
static double kernel(const double *normal_x, const double *normal_y, const double *x, const double *y) {
    double r[3];
    subtract3(y, x, r);
    const double r2 = dot3(r, r), leaving = dot3(r, normal_x), arriving = -dot3(r, normal_y);
    return leaving > 0 && arriving > 0 ? leaving * arriving / (M_PI * r2 * r2) : 0;
}

static bool is_far(const joined_element *x, const joined_element *y) {
    double r[3];
    subtract3(x->centre, y->centre, r);
    return dot3(r, r) > far_apart * (x->area + y->area);
}

/* Sums over all pairs of elements, weighted by area: of the kernel of centroids, and of its square. */
static void sum_all(const joined_kernel *k, uint32_t a, uint32_t b, double sums[3]) {
    const block_node *x = &k->f->tree->nodes[a], *y = &k->f->tree->nodes[b];
    sums[0] = sums[1] = sums[2] = 0;
    for (uint32_t p = x->begin; p < x->end; p++)
        for (uint32_t q = y->begin; q < y->end; q++) {
            const joined_element *i = &k->elements[p], *j = &k->elements[q];
            const double here = kernel(i->normal, j->normal, i->centre, j->centre), share = i->area * j->area;
            sums[0] += share;
            sums[1] += share * here;
            sums[2] += share * here * here;
        }
}

/* The kernel at sample s: between points, or between the centroids of the elements that they lie in. */
static double kernel_at(const joined_kernel *k, const pair_sampler *sampler, uint32_t s, uint32_t a,
                        uint32_t b, bool centroids) {
    double at[4], x[3], y[3], place[2];
    pair_sampler_place(sampler, s, at);
    const joined_element *i = &k->elements[flat_cluster_sample(k->f, a, at[0], at[1], place, x)];
    const joined_element *j = &k->elements[flat_cluster_sample(k->f, b, at[2], at[3], place, y)];
    if (centroids || is_far(i, j)) return kernel(i->normal, j->normal, i->centre, j->centre);
    return kernel(i->normal, j->normal, x, y);
}

double joined_kernel_spread(const joined_kernel *k, uint32_t a, uint32_t b) {
    double sums[3] = {JOINED_SAMPLES, 0, 0};
    if (joined_kernel_takes_all(k, a, b)) {
        sum_all(k, a, b, sums);
    } else {
        pair_sampler sampler;
        pair_sampler_init(&sampler, k->seed, a, b);
        for (uint32_t s = 0; s < JOINED_SAMPLES; s++) {
            const double here = kernel_at(k, &sampler, s, a, b, true);
            sums[1] += here;
            sums[2] += here * here;
        }
    }
    const double mean = sums[1] / sums[0];
    return mean > 0 ? sqrt(fmax(sums[2] / sums[0] - mean * mean, 0)) / mean : INFINITY;
}

/* A_i A_j times the mean of the kernel over two elements. */
static double exchange(const joined_kernel *k, uint32_t p, uint32_t q) {
    const joined_element *i = &k->elements[p], *j = &k->elements[q];
    polygon shapes[2];
    if (is_far(i, j)) return i->area * j->area * kernel(i->normal, j->normal, i->centre, j->centre);
    polygon_of_element(k->f->m, k->f->tree->order[p], &shapes[0]);
    polygon_of_element(k->f->m, k->f->tree->order[q], &shapes[1]);
    return pair_factor_exchange(k->rules, &shapes[0], &shapes[1], k->exact);
}

double joined_kernel_mean(const joined_kernel *k, uint32_t a, uint32_t b) {
    double sum = 0, all = 0;
    if (joined_kernel_takes_all(k, a, b)) {
        const block_node *x = &k->f->tree->nodes[a], *y = &k->f->tree->nodes[b];
        for (uint32_t p = x->begin; p < x->end; p++)
            for (uint32_t q = y->begin; q < y->end; q++) {
                sum += exchange(k, p, q);
                all += k->elements[p].area * k->elements[q].area;
            }
        return sum / all;
    }
    pair_sampler sampler;
    pair_sampler_init(&sampler, k->seed, a, b);
    for (uint32_t s = JOINED_SAMPLES; s < 2 * JOINED_SAMPLES; s++)
        sum += kernel_at(k, &sampler, s, a, b, false);
    return sum / JOINED_SAMPLES;
}
