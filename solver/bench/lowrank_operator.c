/* One operator: built, timed and judged. */
#include "solver/base/clock.h"
#include "solver/bench/lowrank.h"
#include "solver/bench/stats.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

build_problem lowrank_problem(const lowrank_scene *s) {
    return (build_problem){.n = s->m.n,
                           .n_channels = s->m.n_channels,
                           .area = s->m.area,
                           .reflectance = s->m.reflectance,
                           .F = &s->f.F,
                           .order = s->z_order,
                           .noise = recipe_noise(&s->f.recipe),
                           .centre = (const double(*)[3])s->centre,
                           .normal = (const float(*)[3])s->m.normal,
                           .surface = s->surface};
}

/* The kind that answers for its own emitters alone takes their weights W in place of E. */
static lam_status answer(const lam_operator *op, const float *E, float *B, void *work, size_t bytes,
                         lam_error *error) {
    if (lam_operator_emitters(op) > 0)
        return lam_operator_apply_emitters(op, 1, LAM_RADIOSITY, E, 0, NULL, B, work, bytes, error);
    return lam_operator_apply(op, 1, LAM_RADIOSITY, E, B, work, bytes, error);
}

lam_status lowrank_time_answer(const lam_operator *op, size_t solves, double *median, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = lam_operator_elements(op) * lam_operator_channels(op);
    double seconds[LOWRANK_SOLVES_MOST];
    float *E = NULL, *B = NULL;
    void *work = NULL;
    const size_t bytes = lam_operator_work_bytes(op, 1);
    E = memory_allocate(n, sizeof *E, "an answer", error);
    B = memory_allocate(n, sizeof *B, "an answer", error);
    work = memory_allocate(1, bytes, "an answer", error);
    if (E == NULL || B == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) E[i] = (float)(i % 7);
    for (size_t k = 0; k < solves; k++) {
        const double started = clock_seconds();
        TRY(answer(op, E, B, work, bytes, error));
        seconds[k] = clock_seconds() - started;
    }
    *median = stats_median(seconds, solves);
done:
    free(E);
    free(B);
    free(work);
    return status;
}

lam_status lowrank_stored_bytes(const lam_operator *op, double *bytes, lam_error *error) {
    lam_status status = LAM_OK;
    const char *parent = getenv("TMPDIR");
    char path[4096];
    struct stat about;
    store *s = NULL;
    if (parent == NULL || parent[0] == '\0') parent = "/tmp";
    snprintf(path, sizeof path, "%s/lambert-bench-%ld.h5", parent, (long)getpid());
    TRY(store_create(path, &s, error));
    TRY(operator_save(op, s, error));
    store *const sealing = s;
    s = NULL;
    TRY(store_seal(sealing, error));
    if (stat(path, &about) != 0) FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
    *bytes = (double)about.st_size;
done:
    store_close(s);
    unlink(path);
    return status;
}

lam_status lowrank_judge(const bench_run *run, const lowrank_scene *s, const lowrank_case *of,
                         lowrank_verdict *out, lam_error *error) {
    lam_status status = LAM_OK;
    build_problem problem = lowrank_problem(s);
    const build_options how = {.method = of->method,
                               .factorizer = of->factorizer,
                               .epsilon = of->epsilon,
                               .rank = of->rank,
                               .budget = {.rule = BUDGET_SQUARES, .alpha = .5},
                               .levels = -1,
                               .threshold = of->threshold,
                               .correction = of->correction,
                               .seed = run->seed,
                               .progress = run->progress};
    const judge_input input = {.problem = &problem,
                               .row_sums = s->f.row_sums,
                               .emission = s->m.emission,
                               .independent = of->independent,
                               .first_light = of->first != NULL ? first_light_for_judge : NULL,
                               .first_light_context = of->first,
                               .probes = s->m.n < of->probes ? s->m.n : of->probes,
                               .seed = run->seed,
                               .progress = run->progress};
    lowrank_verdict verdict = {.bytes = 0};
    lam_operator *op = NULL;
    problem.emitters = of->emitters;
    TRY(bench_check(run, error));
    TRY(build_operator(&problem, &how, &op, &verdict.built, error));
    TRY(lowrank_time_answer(op, LOWRANK_SOLVES_MOST, &verdict.answer_seconds, error));
    TRY(judge_operator(op, &input, &verdict.judged, error));
    verdict.bytes = (double)lam_operator_bytes(op);
    if (of->weighed) TRY(lowrank_stored_bytes(op, &verdict.stored, error));
    *out = verdict;
done:
    lam_operator_close(op);
    return status;
}
