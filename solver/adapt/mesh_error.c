#include "solver/adapt/mesh_error.h"

#include "solver/base/random.h"

#include <math.h>
#include <stdlib.h>

enum { QUARTERS = GATHER_QUARTERS };

/* out [n_lights] = the variance of rho H over element i, summed over channels: from one point in each quarter
 * q and two independent halves 0 and 1 of each estimate,
 *     var(rho H) = 16/15 rho^2 (1/4) sum_q (H_q0 - mean of H_0) (H_q1 - mean of H_1).
 * direct [QUARTERS][values] is the same in both; NULL: there is none. */
static void look(const gather *g, const mesh *m, uint32_t i, uint64_t key, const double *direct,
                 double *out) {
    const size_t values = gather_values(g);
    double points[QUARTERS][3], H[QUARTERS * GATHER_HALVES * GATHER_VALUES_MOST];
    gather_quarters(g, i, key, points);
    gather_at(g, i, key, QUARTERS, (const double(*)[3])points, H);
    for (size_t k = 0; direct != NULL && k < QUARTERS * GATHER_HALVES; k++)
        for (size_t v = 0; v < values; v++) H[k * values + v] += direct[k / GATHER_HALVES * values + v];
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
        out[v / m->n_channels] += GATHER_QUARTERS_LACK * rho * rho * sum / QUARTERS;
    }
}

/* The error e of each light, by the groups that were looked at,
 *     e^2 = sum_g sum A var(rho H) / sum_g sum A (B - E)^2,
 * where variances and squares are summed over channels. */
static void sum_groups(const mesh *m, size_t n_lights, const look_plan *l, const double *seen,
                       double *error_of_light, const mesh_error_groups *groups) {
    const size_t G = m->n_groups;
    for (size_t light = 0; light < n_lights; light++) {
        double off = 0, all = 0;
        for (size_t g = 0; g < G; g++) {
            const look_sum v = look_plan_sum(l, n_lights, seen, light, g);
            const double light2 = l->light2[light * G + g], area = l->group_area[g];
            if (l->first[g + 1] == l->first[g]) continue;
            off += v.sum;
            all += light2;
            if (groups == NULL) continue;
            groups->variance[light * G + g] = v.sum / area;
            groups->noise[light * G + g] = v.noise / area;
            groups->light2[light * G + g] = light2 / area;
        }
        error_of_light[light] = all > 0 ? sqrt(fmax(off, 0) / all) : 0;
    }
}

static uint64_t key_of(uint64_t seed, size_t look) {
    return random_hash(random_hash(seed) ^ random_hash(look + 1));
}

/* The direct light at the points of all looks, [looks][QUARTERS][values], freed with free(). */
static lam_status find_direct(const gather *g, const mesh_direct *direct, const look_plan *l, size_t looks,
                              uint64_t seed, double **out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = looks * QUARTERS;
    double *H = memory_allocate(n, gather_values(g) * sizeof *H, "error of the mesh", error);
    double(*points)[3] = memory_allocate(n, sizeof *points, "error of the mesh", error);
    uint32_t *elements = memory_allocate(n, sizeof *elements, "error of the mesh", error);
    if (H == NULL || points == NULL || elements == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < looks; k++) {
        gather_quarters(g, l->chosen[k], key_of(seed, k), points + k * QUARTERS);
        for (size_t q = 0; q < QUARTERS; q++) elements[k * QUARTERS + q] = l->chosen[k];
    }
    TRY(direct->at(direct->context, n, (const double(*)[3])points, elements, H, error));
    *out = H;
    H = NULL;
done:
    free(H);
    free(points);
    free(elements);
    return status;
}

lam_status mesh_error(const mesh *m, size_t n_lights, const float *E, const float *B, bool lamps,
                      const gather_sky *sky, const mesh_direct *direct, uint64_t seed, const progress *p,
                      double *error_of_light, const mesh_error_groups *groups, lam_error *error) {
    lam_status status = LAM_OK;
    gather *g = NULL;
    look_plan l = {.start = NULL};
    double *seen = NULL, *H = NULL;
    TRY(look_plan_make(m, n_lights, E, B, groups != NULL ? groups->fewer : 0, &l, error));
    const size_t looks = l.first[m->n_groups];
    seen = memory_allocate(looks, n_lights * sizeof *seen, "error of the mesh", error);
    if (seen == NULL) TRY(LAM_ERR_MEMORY);
    TRY(gather_create(m, n_lights, B, lamps ? E : NULL, sky, NULL, &g, error));
    if (direct != NULL) TRY(find_direct(g, direct, &l, looks, seed, &H, error));
    const size_t each = QUARTERS * gather_values(g);
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t k = 0; k < looks; k++)
        if (!progress_cancelled(p))
            look(g, m, l.chosen[k], key_of(seed, k), H != NULL ? H + k * each : NULL, seen + k * n_lights);
    if (progress_cancelled(p)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    sum_groups(m, n_lights, &l, seen, error_of_light, groups);
done:
    gather_free(g);
    look_plan_free(&l);
    free(seen);
    free(H);
    return status;
}
