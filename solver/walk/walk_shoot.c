/* Walks that carry power: W_i = A_i E_i leaves element i, and what comes to a target, divided by its area, is
 * its irradiance. */
#include "solver/walk/walk_steps.h"

#include <stdlib.h>

/* One batch of one emission. */
typedef struct shooting {
    const mesh *m;
    const walk_problem *problem;
    const float *E;       /* [C][n] */
    const double *before; /* [n + 1]: walk_accumulate of the power of all channels */
    walk_starts starts;
    double *sum;      /* [n_targets][C], power */
    uint64_t *visits; /* [n_targets] */
} shooting;

/* Every walk starts with all power, since the mean over walks is taken: each channel with its part of that of
 * the element. */
static size_t start(void *context, size_t n, walker *w) {
    shooting *s = context;
    const mesh *m = s->m;
    size_t k = 0, started = 0;
    for (; started < n && walk_starts_next(&s->starts, s->before, m->n, &w[started], &k); started++) {
        double emitted = 0;
        w[started].at = (uint32_t)k;
        for (size_t c = 0; c < m->n_channels; c++) emitted += (double)s->E[c * m->n + k];
        for (size_t c = 0; c < m->n_channels; c++)
            w[started].weight[c] = s->before[m->n] * (double)s->E[c * m->n + k] / emitted;
    }
    return started;
}

static void arrive_one(shooting *s, const walk_stream *w, size_t i, uint32_t element) {
    const uint32_t t = s->problem->target[element];
    bool raised = false;
    if (t == WALK_NO_TARGET) return;
    for (size_t c = 0; c < s->m->n_channels; c++) {
        const double rho = (double)s->m->reflectance[c * s->m->n + element];
        const double value = s->problem->quantity == LAM_IRRADIANCE ? w->weight[c][i] : rho * w->weight[c][i];
        s->sum[t * s->m->n_channels + c] += value;
        raised = raised || value > 0;
    }
    s->visits[t] += raised;
}

static void arrive(void *context, size_t n, const walk_stream *w, const uint32_t *element) {
    for (size_t i = 0; i < n; i++)
        if (element[i] != VISIBILITY_NOTHING) arrive_one(context, w, i, element[i]);
}

/* The memory of one emission at a time. */
typedef struct shots {
    double *power, *before; /* [n], [n + 1] */
    double *area;           /* [n_targets] */
    double *sums;           /* [WALK_BATCHES][n_targets][C] */
    uint64_t *visits;       /* [WALK_BATCHES][n_targets] */
} shots;

static void shots_free(shots *s) {
    free(s->power);
    free(s->before);
    free(s->area);
    free(s->sums);
    free(s->visits);
}

static lam_status shots_create(const mesh *m, const walk_problem *p, shots *s, lam_error *error) {
    s->power = memory_allocate(m->n, sizeof *s->power, "walks", error);
    s->before = memory_allocate(m->n + 1, sizeof *s->before, "walks", error);
    s->area = memory_allocate(p->n_targets, sizeof *s->area, "walks", error);
    s->sums = memory_allocate(p->n_targets, WALK_BATCHES * m->n_channels * sizeof *s->sums, "walks", error);
    s->visits = memory_allocate(p->n_targets, WALK_BATCHES * sizeof *s->visits, "walks", error);
    if (s->power == NULL || s->before == NULL || s->area == NULL || s->sums == NULL || s->visits == NULL)
        return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++)
        if (p->target[i] != WALK_NO_TARGET) s->area[p->target[i]] += m->area[i];
    return LAM_OK;
}

/* The estimates of emission r. */
static void shoot(const walk_scene *scene, const walk_problem *p, size_t r, walk_run *run, shots *s,
                  walk_estimates *e) {
    const mesh *m = scene->m;
    const size_t targets = p->n_targets, channels = m->n_channels, each = targets * channels,
                 of_batch = e->walks / WALK_BATCHES;
    const float *E = p->E + r * channels * m->n;
    for (size_t i = 0; i < m->n; i++) {
        s->power[i] = 0;
        for (size_t c = 0; c < channels; c++) s->power[i] += m->area[i] * (double)E[c * m->n + i];
    }
    const double all = walk_accumulate(m->n, s->power, s->before);
    for (size_t k = 0; k < WALK_BATCHES * each; k++) s->sums[k] = 0;
    for (size_t k = 0; k < WALK_BATCHES * targets; k++) s->visits[k] = 0;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t b = 0; b < WALK_BATCHES; b++) {
        shooting one = {.m = m,
                        .problem = p,
                        .E = E,
                        .before = s->before,
                        .sum = s->sums + b * each,
                        .visits = s->visits + b * targets};
        const walk_batch batch = {
            .scene = scene, .run = run, .start = start, .arrive = arrive, .context = &one};
        walk_starts_init(&one.starts, p->seed, 2 * (r * WALK_BATCHES + b) + 1, all > 0 ? of_batch : 0);
        walk_batch_go(&batch);
    }
    for (size_t t = 0; t < targets; t++) {
        for (size_t c = 0; c < channels && s->area[t] > 0; c++) {
            const size_t k = (r * channels + c) * targets + t;
            const double per_walk = 1 / (s->area[t] * (double)of_batch);
            walk_batches_join(s->sums + t * channels + c, each, &e->mean[k], &e->error[k]);
            e->mean[k] *= per_walk;
            e->error[k] *= per_walk;
            e->largest[k] = all / s->area[t] * walk_heaviest(m);
        }
        for (size_t b = 0; b < WALK_BATCHES; b++) e->visits[r * targets + t] += s->visits[b * targets + t];
    }
}

lam_status walk_shoot(const walk_scene *s, const walk_problem *problem, walk_estimates *out,
                      lam_error *error) {
    lam_status status = LAM_OK;
    walk_estimates e = {.n_rhs = 0};
    shots memory = {.power = NULL};
    TRY(walk_estimates_create(s, problem, &e, error));
    TRY(shots_create(s->m, problem, &memory, error));
    walk_run run = {.progress = problem->progress,
                    .stage = problem->stage,
                    .all = (double)e.walks * (double)problem->n_rhs};
    for (size_t r = 0; r < problem->n_rhs && !run.stop; r++) shoot(s, problem, r, &run, &memory, &e);
    TRY(walk_run_end(&run, error));
    walk_add_emission(s->m, problem, &e);
    *out = e;
    e = (walk_estimates){.n_rhs = 0};
done:
    walk_estimates_free(&e);
    shots_free(&memory);
    return status;
}
