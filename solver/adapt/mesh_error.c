#include "solver/adapt/mesh_error.h"

#include "solver/base/random.h"

#include <math.h>
#include <stdlib.h>

enum { QUARTERS = 4 };

/* The mean square of n points in strata, about their own mean, lacks the variance of that mean, which for a
 * function that is linear over a square is a 16th of the whole. */
static const double lacking = 16. / 15;

/* out [n_lights] = the variance of rho H over element i, summed over channels: from one point in each quarter
 * q and two independent halves 0 and 1 of each estimate,
 *     var(rho H) = 16/15 rho^2 (1/4) sum_q (H_q0 - mean of H_0) (H_q1 - mean of H_1). */
static void look(const gather *g, const mesh *m, uint32_t i, uint64_t key, double *out) {
    const size_t values = gather_values(g);
    float uw[QUARTERS][2];
    double points[QUARTERS][3], H[QUARTERS * GATHER_HALVES * GATHER_VALUES_MOST];
    uint64_t random = key;
    for (size_t k = 0; k < QUARTERS; k++) {
        uw[k][0] = (float)((double)(k % 2) + random_unit(&random)) / 2;
        uw[k][1] = (float)((double)(k / 2) + random_unit(&random)) / 2;
        for (int d = 0; d < 2; d++) uw[k][d] = fminf(uw[k][d], 1 - 0x1p-24f);
    }
    gather_place(g, i, QUARTERS, (const float(*)[2])uw, points);
    gather_at(g, i, key, QUARTERS, (const double(*)[3])points, H);
    for (size_t v = 0; v < values; v++) {
        const double rho = (double)m->reflectance[v % m->n_channels * m->n + i];
        double mean[GATHER_HALVES] = {0}, sum = 0;
        for (size_t k = 0; k < QUARTERS; k++)
            for (size_t h = 0; h < GATHER_HALVES; h++)
                mean[h] += H[(k * GATHER_HALVES + h) * values + v] / QUARTERS;
        for (size_t k = 0; k < QUARTERS; k++)
            sum += (H[k * GATHER_HALVES * values + v] - mean[0]) *
                   (H[(k * GATHER_HALVES + 1) * values + v] - mean[1]);
        if (v % m->n_channels == 0) out[v / m->n_channels] = 0;
        out[v / m->n_channels] += lacking * rho * rho * sum / QUARTERS;
    }
}

/* chosen[k], k < n: elements at equal steps of the area. */
static void choose(const mesh *m, size_t n, uint32_t *chosen) {
    double area = 0, before = 0;
    size_t k = 0;
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    for (size_t i = 0; i < m->n; i++) {
        before += m->area[i];
        for (; k < n && (((double)k + .5) / (double)n * area < before || i + 1 == m->n); k++)
            chosen[k] = (uint32_t)i;
    }
}

/* Each of the m elements k that are looked at stands for the area sum_i A_i / m, so that the error e is
 *     e^2 = (sum_i A_i / m) sum_k var_k(rho H) / sum_i A_i (B_i - E_i)^2
 * for each light, where i runs over all elements, and variances and squares are summed over channels. */
lam_status mesh_error(const mesh *m, size_t n_lights, const float *E, const float *B, bool lamps,
                      const gather_sky *sky, uint64_t seed, const progress *p, double *error_of_light,
                      lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = m->n_channels * m->n;
    gather *g = NULL;
    size_t looks = m->n < MESH_ERROR_LOOKS_MOST ? m->n : MESH_ERROR_LOOKS_MOST;
    if (looks < MESH_ERROR_LOOKS_LEAST) looks = MESH_ERROR_LOOKS_LEAST;
    uint32_t *chosen = memory_allocate(looks, sizeof *chosen, "error of the mesh", error);
    double *seen = memory_allocate(looks, n_lights * sizeof *seen, "error of the mesh", error);
    if (chosen == NULL || seen == NULL) TRY(LAM_ERR_MEMORY);
    TRY(gather_create(m, n_lights, B, lamps ? E : NULL, sky, &g, error));
    choose(m, looks, chosen);
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t k = 0; k < looks; k++)
        if (!progress_cancelled(p))
            look(g, m, chosen[k], random_hash(random_hash(seed) ^ random_hash(k + 1)), seen + k * n_lights);
    if (progress_cancelled(p)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    for (size_t l = 0; l < n_lights; l++) {
        double area = 0, all = 0, off = 0;
        for (size_t i = 0; i < vector; i++) {
            const double x = (double)B[l * vector + i] - (double)E[l * vector + i], A = m->area[i % m->n];
            all += A * x * x;
            area += i < m->n ? A : 0;
        }
        for (size_t k = 0; k < looks; k++) off += area / (double)looks * seen[k * n_lights + l];
        error_of_light[l] = all > 0 ? sqrt(fmax(off, 0) / all) : 0;
    }
done:
    gather_free(g);
    free(chosen);
    free(seen);
    return status;
}
