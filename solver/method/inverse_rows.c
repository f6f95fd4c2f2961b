#include "solver/method/inverse_rows.h"

#include "solver/method/many_lights.h"

#include <math.h>
#include <stdlib.h>

enum { COMPARED = 32 };

void inverse_rows_free(inverse_rows *r) {
    free(r->rows);
    *r = (inverse_rows){.rows = NULL};
}

/* Column i of M - I, T [n] = (M - I)_ji, to its row i: with H_ji = T_j / rho'_j, (M - I)_ij = rho'_i H_ji A_j
 * / A_i, where rho' is rho, or 1 in place of 0. */
static void column_to_row(const build_problem *p, const float *rho, size_t i, const float *T, float *row) {
    const double own = rho[i] > 0 ? (double)rho[i] : 1;
    for (size_t position = 0; position < p->n; position++) {
        const size_t j = p->order[position];
        const double H = (double)T[j] / (rho[j] > 0 ? (double)rho[j] : 1);
        row[position] = (float)(own * H * p->area[j] / p->area[i]);
    }
}

lam_status inverse_rows_find(const build_problem *problem, const float *rho, const progress *p,
                             inverse_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, count = n < COMPARED ? n : COMPARED;
    many_lights_report report;
    inverse_rows found = {.n = n, .count = count};
    float *E = memory_allocate(count, n * sizeof *E, "rows of an inverse", error);
    float *T = memory_allocate(count, n * sizeof *T, "rows of an inverse", error);
    found.rows = memory_allocate(count, n * sizeof *found.rows, "rows of an inverse", error);
    if (E == NULL || T == NULL || found.rows == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) E[k * n + problem->order[k * n / count]] = 1;
    const many_lights_input unit = {.n = n,
                                    .F = problem->F,
                                    .area = problem->area,
                                    .rho = rho,
                                    .m = count,
                                    .E = E,
                                    .progress = p,
                                    .stage = "sample the inverse"};
    TRY(many_lights_solve(&unit, 1e-5, T, &report, error));
    for (size_t k = 0; k < count; k++)
        column_to_row(problem, rho, problem->order[k * n / count], T + k * n, found.rows + k * n);
    for (size_t k = 0; k < count * n; k++) {
        found.square += (double)found.rows[k] * (double)found.rows[k];
        found.sum += (double)found.rows[k];
    }
    *out = found;
    found.rows = NULL;
done:
    free(E);
    free(T);
    inverse_rows_free(&found);
    return status;
}

double inverse_rows_factor(const inverse_rows *r, const build_problem *problem, const float *rho, size_t k,
                           size_t position) {
    const size_t i = problem->order[k * r->n / r->count], j = problem->order[position];
    const double own = rho[i] > 0 ? (double)rho[i] : 1, other = rho[j] > 0 ? (double)rho[j] : 1;
    return other * problem->area[i] / (own * problem->area[j]);
}

lam_status sampled_groups_find(const build_problem *problem, sampled_groups *g, lam_error *error) {
    *g = (sampled_groups){.count = 0};
    if (problem->group == NULL) return LAM_OK;
    double *area = memory_allocate(problem->n_groups, sizeof *area, "areas of groups", error);
    if (area == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < problem->n; i++) area[problem->group[i]] += problem->area[i];
    while (g->count < SAMPLED_GROUPS && g->count < problem->n_groups) {
        size_t largest = 0;
        for (size_t k = 1; k < problem->n_groups; k++)
            if (area[k] > area[largest]) largest = k;
        if (!(area[largest] > 0)) break;
        g->group[g->count++] = (uint32_t)largest;
        area[largest] = 0;
    }
    free(area);
    return LAM_OK;
}

void sampled_groups_sum(const sampled_groups *g, const build_problem *problem, const float *row,
                        double sums[SAMPLED_GROUPS]) {
    for (size_t k = 0; k < g->count; k++) sums[k] = 0;
    for (size_t position = 0; position < problem->n && g->count > 0; position++)
        for (size_t k = 0; k < g->count; k++)
            if (problem->group[problem->order[position]] == g->group[k]) sums[k] += (double)row[position];
}

void sampled_groups_add(sampled_groups *g, double area, const double *missing, const double *light) {
    for (size_t k = 0; k < g->count; k++) {
        g->missing[k] += area * missing[k] * missing[k];
        g->light[k] += area * light[k] * light[k];
    }
}

double sampled_groups_mean(const sampled_groups *g) {
    double sum = 0;
    size_t lit = 0;
    for (size_t k = 0; k < g->count; k++) {
        if (!(g->light[k] > 0)) continue;
        sum += sqrt(g->missing[k] / g->light[k]);
        lit++;
    }
    return lit > 0 ? sum / (double)lit : 0;
}

/* rho' H of elements and groups that emit alone, by the operator: [count + groups][n], in mesh order. */
static lam_status answer_all(const build_problem *problem, const lam_operator *op, size_t count,
                             const sampled_groups *g, float *H, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels, bytes = lam_operator_work_bytes(op, 1);
    const float *rho = problem->reflectance;
    float *E = memory_allocate(C, n * sizeof *E, "lights of a sample", error);
    float *out = memory_allocate(C, n * sizeof *out, "lights of a sample", error);
    void *work = memory_allocate(1, bytes, "lights of a sample", error);
    if (E == NULL || out == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < count + g->count; v++) {
        const size_t bright = v < count ? problem->order[v * n / count] : n;
        for (size_t i = 0; i < n; i++)
            E[i] = v < count ? (i == bright) : (problem->group[i] == g->group[v - count]);
        TRY(lam_operator_apply(op, 1, LAM_IRRADIANCE, E, out, work, bytes, error));
        for (size_t i = 0; i < n; i++) H[v * n + i] = (rho[i] > 0 ? rho[i] : 1) * out[i];
    }
done:
    free(E);
    free(out);
    free(work);
    return status;
}

lam_status operator_sampled_errors(const build_problem *problem, const lam_operator *op,
                                   const inverse_rows *truth, sampled_errors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, count = truth->count;
    sampled_groups g;
    double sum = 0;
    float *H = memory_allocate(count + SAMPLED_GROUPS, n * sizeof *H, "lights of a sample", error);
    if (H == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sampled_groups_find(problem, &g, error));
    TRY(answer_all(problem, op, count, &g, H, error));
    for (size_t k = 0; k < count; k++) {
        const size_t i = problem->order[k * n / count];
        double missing[SAMPLED_GROUPS], light[SAMPLED_GROUPS], square = 0, whole = 0;
        for (size_t position = 0; position < n; position++) {
            const size_t j = problem->order[position];
            const double x = inverse_rows_factor(truth, problem, problem->reflectance, k, position) *
                             (double)truth->rows[k * n + position],
                         d = x - (double)H[k * n + j];
            square += problem->area[j] * d * d;
            whole += problem->area[j] * x * x;
        }
        if (whole > 0) sum += sqrt(square / whole);
        sampled_groups_sum(&g, problem, truth->rows + k * n, light);
        for (size_t v = 0; v < g.count; v++) missing[v] = light[v] - (double)H[(count + v) * n + i];
        sampled_groups_add(&g, problem->area[i], missing, light);
    }
    *out = (sampled_errors){.single = sum / (double)count, .groups = sampled_groups_mean(&g)};
done:
    free(H);
    return status;
}
