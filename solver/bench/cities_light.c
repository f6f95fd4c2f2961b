/* Cities under each tile of their sky alone, and how far a sparse inverse is off there. */
#include "solver/bench/cities.h"
#include "solver/method/reference.h"

#include <math.h>
#include <stdlib.h>

void city_light_free(city_light *d) {
    free(d->E);
    free(d->B);
    *d = (city_light){0};
}

lam_status city_light_make(const bench_run *run, const city *c, city_light *d, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n, m = c->f.sky.tiling.n_tiles;
    reference *r = NULL;
    double *E = memory_allocate(m, n * sizeof *E, "skies", error);
    *d = (city_light){.m = m,
                      .E = memory_allocate(m, n * sizeof *d->E, "skies", error),
                      .B = memory_allocate(m, n * sizeof *d->B, "skies", error)};
    if (E == NULL || d->E == NULL || d->B == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < m * n; k++) {
        d->E[k] = c->m.reflectance[k % n] * c->f.sky.first_bounce[k];
        E[k] = d->B[k] = (double)d->E[k];
    }
    TRY(reference_create(&c->f.F, c->m.area, c->m.reflectance, REFERENCE_ITERATED, &r, error));
    TRY(reference_solve(r, m, E, d->B, 1e-10, run->progress, error));
done:
    reference_destroy(r);
    free(E);
    return status;
}

lam_status city_sparse(const bench_run *run, const city *c, double threshold, sparse_correction correction,
                       lam_operator **op, build_report *report, lam_error *error) {
    const build_options options = {.method = "sparse",
                                   .factorizer = "auto",
                                   .epsilon = .05,
                                   .budget = {.rule = BUDGET_SQUARES, .alpha = .5},
                                   .threshold = threshold,
                                   .correction = correction,
                                   .seed = run->seed,
                                   .progress = run->progress};
    return build_operator(&c->problem, &options, op, report, error);
}

lam_status city_light_answer(const city_light *d, const lam_operator *op, float *B, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t bytes = lam_operator_work_bytes(op, d->m);
    void *work = memory_allocate(bytes, 1, "work area", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    TRY(lam_operator_apply(op, d->m, LAM_RADIOSITY, d->E, B, work, bytes, error));
done:
    free(work);
    return status;
}

lam_status city_light_errors(const city *c, const city_light *d, const lam_operator *op, double *relative,
                             double *indirect, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n;
    float *B = memory_allocate(d->m, n * sizeof *B, "answers", error);
    if (B == NULL) return LAM_ERR_MEMORY;
    TRY(city_light_answer(d, op, B, error));
    for (size_t t = 0; t < d->m; t++) {
        double off = 0, all = 0, bounced = 0;
        for (size_t i = 0; i < n; i++) {
            const double b = d->B[t * n + i], e = (double)B[t * n + i] - b, a = c->m.area[i];
            const double more = b - (double)d->E[t * n + i];
            off += a * e * e;
            all += a * b * b;
            bounced += a * more * more;
        }
        relative[t] = sqrt(off / all);
        indirect[t] = sqrt(off / bounced);
    }
done:
    free(B);
    return status;
}
