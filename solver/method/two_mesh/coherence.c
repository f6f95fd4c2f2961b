#include "solver/method/two_mesh/coherence.h"

#include <math.h>
#include <stdlib.h>

/* Views that differ by less are equal: what single precision leaves of equal ones. */
static const double indistinct = 1e-12;

lam_status views_create(const build_problem *problem, const uint32_t *group, size_t n_groups, views *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    const csr *F = problem->F;
    double area[VIEWS_MOST] = {0};
    float *v = memory_allocate(problem->n, n_groups * sizeof *v, "views", error);
    if (v == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < problem->n; i++) area[group[i]] += problem->area[i];
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t e = 0; e < problem->n; e++) {
        double F_e[VIEWS_MOST] = {0};
        for (uint64_t p = F->indptr[e]; p < F->indptr[e + 1]; p++)
            F_e[group[F->indices[p]]] += (double)F->data[p];
        for (size_t g = 0; g < n_groups; g++)
            v[e * n_groups + g] = area[g] > 0 ? (float)(F_e[g] / sqrt(area[g])) : 0;
    }
    *out = (views){.n_groups = n_groups, .v = v};
done:
    return status;
}

void views_free(views *v) {
    free(v->v);
    *v = (views){0};
}

view_figures views_measure(const views *v, const double *area, const uint32_t *elements, size_t count) {
    double sum[VIEWS_MOST] = {0}, squares = 0, total = 0, resultant = 0;
    for (size_t i = 0; i < count; i++) {
        const double A = area[elements[i]];
        const float *v_e = v->v + elements[i] * v->n_groups;
        double square = 0;
        for (size_t g = 0; g < v->n_groups; g++) {
            const double x = (double)v_e[g];
            sum[g] += A * x;
            square += x * x;
        }
        squares += A * square;
        total += A;
    }
    for (size_t g = 0; g < v->n_groups; g++) resultant += sum[g] * sum[g];
    /* sum A |v_e - v|^2 = sum A |v_e|^2 - |sum A v_e|^2 / sum A */
    const double loss = squares - resultant / total;
    if (!(loss > indistinct * squares)) return (view_figures){total, 0, 1};
    return (view_figures){total, loss, fmax(0, 1 - loss / squares)};
}
