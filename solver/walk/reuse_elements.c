/* Way E: walks that start where the light of all positions arrives. With the direct light known, what
 * reflects is
 *     H_l - H0_l = F (I - R F)^-1 R H0_l,
 * linear in H0_l: a walk that leaves element i with the probability p_i serves position l with the power
 *     A_i rho_i H0_li / (N p_i),
 * without a ray to any position. Unbiased, as H0 is and the walks do not know its errors. p_i is the root of
 * sum_l (A_i rho_i H0_li / Phi_l)^2, Phi_l = sum_i A_i rho_i H0_li, by which all positions have about the
 * same error. */
#include "solver/walk/reuse_elements.h"

#include "solver/base/clock.h"
#include "solver/walk/direct_light.h"
#include "solver/walk/reuse_sums.h"
#include "solver/walk/walk_steps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Segments between an element and a position of the light, a power of two: about as much time as the walks
 * take. */
enum { SAMPLES_LEAST = 32, SAMPLES_MOST = 1 << 14 };

/* All that batches share. */
typedef struct shared {
    const walk_scene *scene;
    const reuse_problem *problem;
    size_t n, C, s, of_batch; /* walks of a batch, for all positions */
    float *F, *variance;      /* [n][s] */
    double *share, *before;   /* [n], [n + 1]: p_i, and up to i */
    walk_run *run;
} shared;

typedef struct shared_batch {
    const shared *r;
    walk_starts starts;
    double *later; /* [n][C][s]: power over that of the light */
    double rays;
} shared_batch;

static size_t samples_for(const reuse_estimates *e) {
    size_t samples = SAMPLES_LEAST;
    while (samples < SAMPLES_MOST && 2 * samples * e->n <= 4 * e->paths) samples *= 2;
    return samples;
}

static double brightest(const mesh *m, size_t i) {
    double rho = 0;
    for (size_t c = 0; c < m->n_channels; c++) rho = fmax(rho, (double)m->reflectance[c * m->n + i]);
    return rho;
}

/* False where no direct light is reflected at all. */
static bool choose_shares(const shared *r, double *power) {
    const mesh *m = r->scene->m;
    for (size_t i = 0; i < r->n; i++)
        for (size_t l = 0; l < r->s; l++)
            power[l] += m->area[i] * brightest(m, i) * (double)r->F[i * r->s + l];
    for (size_t i = 0; i < r->n; i++) {
        const double a = m->area[i] * brightest(m, i);
        double sum = 0;
        for (size_t l = 0; l < r->s; l++) {
            const double part = power[l] > 0 ? a * (double)r->F[i * r->s + l] / power[l] : 0;
            sum += part * part;
        }
        r->share[i] = sqrt(sum);
    }
    return walk_accumulate(r->n, r->share, r->before) > 0;
}

/* The weight of a walk that leaves element i has all of its power but the parts of positions, F[i]. Walks end
 * with the first one that carries nothing. */
static size_t start(void *context, size_t n, walker *w) {
    shared_batch *b = context;
    const shared *r = b->r;
    const mesh *m = r->scene->m;
    size_t k = 0, started = 0;
    for (; started < n && walk_starts_next(&b->starts, r->before, r->n, &w[started], &k); started++) {
        walker *const one = &w[started];
        double most = 0;
        const double power =
            m->area[k] * r->before[r->n] / (r->share[k] * (double)r->of_batch * r->problem->light->area);
        one->at = one->path = (uint32_t)k;
        for (size_t c = 0; c < r->C; c++) {
            one->weight[c] = power * (double)m->reflectance[c * m->n + k];
            most = fmax(most, one->weight[c]);
        }
        if (!(most > 0)) break;
    }
    return started;
}

static void arrive(void *context, size_t n, const walk_stream *w, const uint32_t *element) {
    const shared_batch *b = context;
    reuse_deposit(n, b->r->s, b->r->C, w, element, b->r->F, b->later);
}

/* straight [n][s]: the direct light as reuse_sums takes it. */
static lam_status run_batches(const shared *r, const double *straight, reuse_sums *sums, double *rays,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t size = r->n * r->C * r->s;
    bool failed = false;
#pragma omp parallel
    {
        shared_batch b = {.r = r, .later = malloc(size * sizeof *b.later)};
        const walk_batch walks = {.scene = r->scene,
                                  .run = r->run,
                                  .start = start,
                                  .arrive = arrive,
                                  .context = &b,
                                  .rays = &b.rays};
#pragma omp for schedule(static, 1) ordered
        for (size_t k = 0; k < WALK_BATCHES; k++) {
            if (b.later != NULL) {
                memset(b.later, 0, size * sizeof *b.later);
                b.rays = 0;
                walk_starts_init(&b.starts, r->problem->seed, k, r->of_batch);
                walk_batch_go(&walks);
            }
#pragma omp ordered
            {
                if (b.later != NULL)
                    reuse_sums_add(sums, straight, b.later);
                else
                    failed = true;
                *rays += b.rays;
            }
        }
        free(b.later);
    }
    if (failed) FAIL(error, LAM_ERR_MEMORY, "paths: out of memory");
    TRY(walk_run_end(r->run, error));
done:
    return status;
}

/* The error of the direct light comes to that of the walks, independent for every element and position. */
static lam_status add_variance(const shared *r, reuse_estimates *e, lam_error *error) {
    const mesh *m = r->scene->m;
    const bool apart = e->of_groups != NULL;
    black_groups black = {.of = NULL};
    double *area = memory_allocate(m->n_groups, sizeof *area, "paths", error);
    if (area == NULL || black_groups_find(m, &black, error) != LAM_OK) {
        free(area);
        return LAM_ERR_MEMORY;
    }
    for (size_t i = 0; e->of_groups != NULL && i < r->n; i++) area[m->group[i]] += m->area[i];
    for (size_t i = 0; i < r->n; i++)
        for (size_t c = 0; c < r->C; c++) {
            const double power = r->problem->light->emission[c];
            const double rho = reuse_reflectance(m, &black, apart, c, i);
            const bool counts = black.all || !black.of[m->group[i]];
            for (size_t l = 0; l < r->s; l++) {
                const double variance = power * power * (double)r->variance[i * r->s + l];
                float *const at = &e->error[(c * r->s + l) * r->n + i];
                *at = (float)sqrt((double)*at * (double)*at + variance);
                const double square = m->area[i] * rho * rho * variance;
                if (counts) e->covariance[l * r->s + l] += square;
                if (e->of_groups == NULL) continue;
                const size_t at_group = (m->group[i] * r->s + l) * r->s + l;
                e->of_groups[at_group] += square;
                e->of_means[at_group] += square * m->area[i] / (area[m->group[i]] * area[m->group[i]]);
            }
        }
    free(area);
    free(black.of);
    return LAM_OK;
}

static lam_status shared_create(shared *r, lam_error *error) {
    r->F = memory_allocate(r->n, r->s * sizeof *r->F, "paths", error);
    r->variance = memory_allocate(r->n, r->s * sizeof *r->variance, "paths", error);
    r->share = memory_allocate(r->n, sizeof *r->share, "paths", error);
    r->before = memory_allocate(r->n + 1, sizeof *r->before, "paths", error);
    return r->F != NULL && r->variance != NULL && r->share != NULL && r->before != NULL ? LAM_OK
                                                                                        : LAM_ERR_MEMORY;
}

lam_status reuse_elements(const walk_scene *s, const reuse_problem *problem, reuse_estimates *e,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = s->m;
    shared r = {.scene = s, .problem = problem, .n = e->n, .C = e->n_channels, .s = e->n_positions};
    reuse_sums sums = {.s = 0};
    double *straight = NULL, *power = NULL, rays = 0;
    const direct_light_problem direct = {.light = problem->light,
                                         .samples = samples_for(e),
                                         .seed = problem->seed,
                                         .progress = problem->progress,
                                         .stage = "direct light"};
    walk_run run = {
        .progress = problem->progress, .stage = problem->stage, .all = (double)e->paths * (double)r.s};
    r.of_batch = e->paths / WALK_BATCHES * r.s;
    r.run = &run;
    TRY(shared_create(&r, error));
    straight = memory_allocate(r.n, r.s * sizeof *straight, "paths", error);
    power = memory_allocate(r.s, sizeof *power, "paths", error);
    if (straight == NULL || power == NULL) TRY(LAM_ERR_MEMORY);
    double begun = clock_processor_seconds();
    TRY(walk_direct_light(s, &direct, r.F, r.variance, error));
    e->reuse_seconds = clock_processor_seconds() - begun;
    for (size_t k = 0; k < r.n * r.s; k++)
        straight[k] = (double)r.F[k] * m->area[k / r.s] / problem->light->area;
    if (!choose_shares(&r, power)) r.of_batch = 0; /* nothing is reflected */
    TRY(reuse_sums_create(m, problem->light, true, &sums, error));
    begun = clock_processor_seconds();
    TRY(run_batches(&r, straight, &sums, &rays, error));
    e->trace_seconds = clock_processor_seconds() - begun;
    reuse_sums_end(&sums, e);
    TRY(add_variance(&r, e, error));
    e->rays = rays / ((double)e->paths * (double)r.s);
done:
    free(r.F);
    free(r.variance);
    free(r.share);
    free(r.before);
    free(straight);
    free(power);
    reuse_sums_free(&sums);
    return status;
}
