/* Walks that collect emission: with H = sum_j F_ij (E_j + rho_j H_j), a walk from i adds E_j times its weight
 * at every element j that it comes to. */
#include "solver/walk/walk_steps.h"

#include <stdlib.h>

/* The elements of all targets: those of target t are first[t] ... first[t + 1] - 1 of elements. */
typedef struct target_lists {
    uint32_t *elements;
    size_t *first;  /* [n_targets + 1] */
    double *before; /* [n + n_targets]: of target t, from first[t] + t: walk_accumulate of its areas */
} target_lists;

static void target_lists_free(target_lists *l) {
    free(l->elements);
    free(l->first);
    free(l->before);
}

static lam_status target_lists_create(const mesh *m, const walk_problem *p, target_lists *out,
                                      lam_error *error) {
    lam_status status = LAM_OK;
    target_lists l = {.first = memory_allocate(p->n_targets + 2, sizeof *l.first, "walks", error),
                      .elements = memory_allocate(m->n, sizeof *l.elements, "walks", error),
                      .before = memory_allocate(m->n + p->n_targets, sizeof *l.before, "walks", error)};
    if (l.first == NULL || l.elements == NULL || l.before == NULL) TRY(LAM_ERR_MEMORY);
    /* Counted two places on, so that filling the lists moves each first to its place. */
    for (size_t i = 0; i < m->n; i++)
        if (p->target[i] != WALK_NO_TARGET) l.first[p->target[i] + 2]++;
    for (size_t t = 2; t <= p->n_targets; t++) l.first[t] += l.first[t - 1];
    for (size_t i = 0; i < m->n; i++)
        if (p->target[i] != WALK_NO_TARGET) l.elements[l.first[p->target[i] + 1]++] = (uint32_t)i;
    for (size_t t = 0; t < p->n_targets; t++) {
        double *before = l.before + l.first[t] + t;
        before[0] = 0;
        for (size_t k = l.first[t]; k < l.first[t + 1]; k++, before++)
            before[1] = before[0] + m->area[l.elements[k]];
    }
    *out = l;
    l = (target_lists){.first = NULL};
done:
    target_lists_free(&l);
    return status;
}

/* One batch of one target. */
typedef struct gathering {
    const mesh *m;
    const walk_problem *problem;
    const uint32_t *elements;
    const double *before;
    size_t n_elements;
    walk_starts starts;
    double *sum;      /* [n_rhs][C] */
    uint64_t *visits; /* [n_rhs] */
} gathering;

static size_t start(void *context, size_t n, walker *w) {
    gathering *g = context;
    size_t k = 0, started = 0;
    for (; started < n && walk_starts_next(&g->starts, g->before, g->n_elements, &w[started], &k);
         started++) {
        walker *const one = &w[started];
        one->at = g->elements[k];
        for (size_t c = 0; c < g->m->n_channels; c++)
            one->weight[c] =
                g->problem->quantity == LAM_IRRADIANCE ? 1 : (double)g->m->reflectance[c * g->m->n + one->at];
    }
    return started;
}

static void arrive_one(gathering *g, const walk_stream *w, size_t i, uint32_t element) {
    const size_t n = g->m->n, channels = g->m->n_channels;
    for (size_t r = 0; r < g->problem->n_rhs; r++) {
        const float *E = g->problem->E + r * channels * n + element;
        bool raised = false;
        for (size_t c = 0; c < channels; c++) {
            const double value = w->weight[c][i] * (double)E[c * n];
            g->sum[r * channels + c] += value;
            raised = raised || value > 0;
        }
        g->visits[r] += raised;
    }
}

static void arrive(void *context, size_t n, const walk_stream *w, const uint32_t *element) {
    for (size_t i = 0; i < n; i++)
        if (element[i] != VISIBILITY_NOTHING) arrive_one(context, w, i, element[i]);
}

/* A visit adds at most the largest emission, and its weight is at most the largest at a start, 1, or behind a
 * pane. */
static void set_largest(const mesh *m, const walk_problem *p, walk_estimates *e) {
    for (size_t row = 0; row < e->n_rhs * e->n_channels; row++) {
        double largest = 0;
        for (size_t i = 0; i < m->n; i++)
            if ((double)p->E[row * m->n + i] > largest) largest = (double)p->E[row * m->n + i];
        for (size_t t = 0; t < e->n_targets; t++)
            e->largest[row * e->n_targets + t] = largest * walk_heaviest(m);
    }
}

lam_status walk_gather(const walk_scene *s, const walk_problem *problem, walk_estimates *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const size_t targets = problem->n_targets, rows = problem->n_rhs * s->m->n_channels;
    walk_estimates e = {.n_rhs = 0};
    target_lists lists = {.first = NULL};
    double *sums = NULL;     /* [targets][WALK_BATCHES][n_rhs][C] */
    uint64_t *visits = NULL; /* [targets][WALK_BATCHES][n_rhs] */
    TRY(walk_estimates_create(s, problem, &e, error));
    TRY(target_lists_create(s->m, problem, &lists, error));
    sums = memory_allocate(targets * WALK_BATCHES, rows * sizeof *sums, "walks", error);
    visits = memory_allocate(targets * WALK_BATCHES, problem->n_rhs * sizeof *visits, "walks", error);
    if (sums == NULL || visits == NULL) TRY(LAM_ERR_MEMORY);
    const size_t of_batch = e.walks / WALK_BATCHES;
    walk_run run = {
        .progress = problem->progress, .stage = problem->stage, .all = (double)e.walks * (double)targets};
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t task = 0; task < targets * WALK_BATCHES; task++) {
        const size_t t = task / WALK_BATCHES;
        gathering g = {.m = s->m,
                       .problem = problem,
                       .elements = lists.elements + lists.first[t],
                       .before = lists.before + lists.first[t] + t,
                       .n_elements = lists.first[t + 1] - lists.first[t],
                       .sum = sums + task * rows,
                       .visits = visits + task * problem->n_rhs};
        const walk_batch batch = {.scene = s, .run = &run, .start = start, .arrive = arrive, .context = &g};
        walk_starts_init(&g.starts, problem->seed, 2 * task, g.n_elements > 0 ? of_batch : 0);
        walk_batch_go(&batch);
        for (size_t row = 0; row < rows; row++) g.sum[row] /= (double)of_batch;
    }
    TRY(walk_run_end(&run, error));
    for (size_t t = 0; t < targets; t++) {
        for (size_t row = 0; row < rows; row++)
            walk_batches_join(sums + t * WALK_BATCHES * rows + row, rows, &e.mean[row * targets + t],
                              &e.error[row * targets + t]);
        for (size_t k = 0; k < WALK_BATCHES * problem->n_rhs; k++)
            e.visits[k % problem->n_rhs * targets + t] += visits[t * WALK_BATCHES * problem->n_rhs + k];
    }
    set_largest(s->m, problem, &e);
    walk_add_emission(s->m, problem, &e);
    *out = e;
    e = (walk_estimates){.n_rhs = 0};
done:
    walk_estimates_free(&e);
    target_lists_free(&lists);
    free(sums);
    free(visits);
    return status;
}
