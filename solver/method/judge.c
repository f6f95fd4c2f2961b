#include "solver/method/judge.h"

#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/method/guided_reference.h"
#include "solver/operator/emitters.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Indirect light below this share of all light counts as none: no ray found what the element sees, and the
 * rest is the remainder of the reference's iteration. */
static const double dark = 1e-6;

enum { SINGLE, LIGHTS, RANDOM, N_GROUPS };

/* Emissions E with the operator's radiosity, both [m][C][n], and the sums of each. Group g has
 * probes begin[g] ... begin[g + 1] - 1. */
typedef struct probes {
    size_t m;
    size_t begin[N_GROUPS + 1];
    float *E, *B;
    float *W, *H0; /* [m][C][s], [m][C][n]: of an operator of emitters, else NULL */
    double *B_norm, *indirect_norm, *error_norm; /* [m] squares, area-weighted, channels stacked */
    double *first; /* [m][C][n], the light H that E itself gives, where known; NULL: of none */
    bool *known;   /* [m] */
} probes;

static void probes_free(probes *p) {
    free(p->E);
    free(p->W);
    free(p->H0);
    free(p->B);
    free(p->B_norm);
    free(p->indirect_norm);
    free(p->error_norm);
    free(p->first);
    free(p->known);
    *p = (probes){0};
}

static lam_status probes_init(probes *p, const size_t counts[N_GROUPS], const build_problem *problem,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = problem->n * problem->n_channels;
    *p = (probes){0};
    for (int g = 0; g < N_GROUPS; g++) p->begin[g + 1] = p->begin[g] + counts[g];
    const size_t m = p->m = p->begin[N_GROUPS];
    p->E = memory_allocate(m, vector * sizeof *p->E, "probes", error);
    p->B = memory_allocate(m, vector * sizeof *p->B, "probes", error);
    p->B_norm = memory_allocate(m, sizeof *p->B_norm, "probes", error);
    p->indirect_norm = memory_allocate(m, sizeof *p->indirect_norm, "probes", error);
    p->error_norm = memory_allocate(m, sizeof *p->error_norm, "probes", error);
    if (p->E == NULL || p->B == NULL || p->B_norm == NULL || p->indirect_norm == NULL ||
        p->error_norm == NULL)
        TRY(LAM_ERR_MEMORY);
done:
    if (status != LAM_OK) probes_free(p);
    return status;
}

/* One bright element a probe, drawn without repetition. */
static lam_status single_emissions(const build_problem *problem, uint64_t seed, probes *p, lam_error *error) {
    const size_t n = problem->n;
    uint32_t *deck = memory_allocate(n, sizeof *deck, "probes", error);
    if (deck == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) deck[i] = (uint32_t)i;
    for (size_t v = 0; v < p->begin[LIGHTS]; v++) {
        const size_t other = v + (size_t)(random_unit(&seed) * (double)(n - v));
        const uint32_t element = deck[other];
        deck[other] = deck[v];
        for (size_t c = 0; c < problem->n_channels; c++)
            p->E[(v * problem->n_channels + c) * n + element] = 1;
    }
    free(deck);
    return LAM_OK;
}

static void random_emissions(const build_problem *problem, uint64_t seed, probes *p) {
    const size_t vector = problem->n_channels * problem->n;
    for (size_t i = p->begin[RANDOM] * vector; i < p->m * vector; i++) p->E[i] = (float)random_unit(&seed);
}

/* out = quantity of the operator for every probe, a few at a time. */
static lam_status apply(const lam_operator *op, const probes *p, lam_quantity quantity, float *out,
                        lam_error *error) {
    enum { AT_ONCE = 16 };
    lam_status status = LAM_OK;
    const size_t vector = lam_operator_elements(op) * lam_operator_channels(op);
    const size_t n_batches = (p->m + AT_ONCE - 1) / AT_ONCE;
    const size_t bytes = lam_operator_work_bytes(op, AT_ONCE);
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t b = 0; b < n_batches; b++) {
        const size_t first = b * AT_ONCE, count = p->m - first < AT_ONCE ? p->m - first : AT_ONCE;
        lam_error one = {0};
        void *work = memory_allocate(1, bytes, "work area", &one);
        lam_status result = LAM_ERR_MEMORY;
        if (work != NULL && p->W != NULL)
            result = lam_operator_apply_emitters(
                op, count, quantity, p->W + first * lam_operator_emitters(op) * lam_operator_channels(op), 0,
                NULL, out + first * vector, work, bytes, &one);
        else if (work != NULL)
            result = lam_operator_apply(op, count, quantity, p->E + first * vector, out + first * vector,
                                        work, bytes, &one);
        free(work);
        if (result != LAM_OK) {
#pragma omp critical(judge_apply)
            {
                status = result;
                if (error != NULL) *error = one;
            }
        }
    }
    return status;
}

/* Computes the first light H of the probes in which few elements emit. */
static lam_status find_first_light(const judge_input *input, probes *p, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = input->problem->n, C = input->problem->n_channels;
    if (input->first_light == NULL || p->W != NULL) return LAM_OK;
    p->first = memory_allocate(p->m, C * n * sizeof *p->first, "probes", error);
    p->known = memory_allocate(p->m, sizeof *p->known, "probes", error);
    if (p->first == NULL || p->known == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < p->begin[RANDOM]; v++)
        for (size_t c = 0; c < C; c++) {
            const float *E = p->E + v * C * n;
            double *H = p->first + v * C * n;
            if (c > 0 && memcmp(E, E + c * n, n * sizeof *E) == 0) {
                memcpy(H + c * n, H, n * sizeof *H);
                continue;
            }
            TRY(input->first_light(input->first_light_context, E + c * n, H + c * n, &p->known[v], error));
            if (!p->known[v]) break;
        }
done:
    return status;
}

/* The corrections of some probes, kept: [m][C][n]. */
typedef struct kept_corrections {
    size_t m;
    const size_t *which; /* [m], ascending */
    double *x;           /* NULL: none are kept */
} kept_corrections;

static void keep(const kept_corrections *to, const build_problem *problem, size_t v, size_t channel,
                 const double *x) {
    const size_t n = problem->n;
    if (to->x == NULL) return;
    for (size_t k = 0; k < to->m; k++)
        if (to->which[k] == v) memcpy(to->x + (k * problem->n_channels + channel) * n, x, n * sizeof *x);
}

typedef struct comparison {
    const build_problem *problem;
    probes *p;
    const kept_corrections *kept;
} comparison;

/* Adds one channel to |B|^2, |B - E|^2 and |B~ - B|^2 of a probe. */
static void compare(void *context, size_t v, size_t channel, const double *x) {
    const comparison *c = context;
    const size_t n = c->problem->n, at = (v * c->problem->n_channels + channel) * n;
    for (size_t i = 0; i < n; i++) {
        const double b = (double)c->p->B[at + i] + x[i], a = c->problem->area[i];
        c->p->B_norm[v] += a * b * b;
        c->p->indirect_norm[v] += a * (b - (double)c->p->E[at + i]) * (b - (double)c->p->E[at + i]);
        c->p->error_norm[v] += a * x[i] * x[i];
    }
    keep(c->kept, c->problem, v, channel, x);
}

static void add_figure(error_figures *f, double x) {
    f->mean += x;
    f->std += x * x;
    f->max = fmax(f->max, x);
}

static void finish_figure(error_figures *f, size_t count) {
    if (count == 0) return;
    f->mean /= (double)count;
    f->std = sqrt(fmax(0, f->std / (double)count - f->mean * f->mean));
}

static reference_system system_of(const build_problem *problem, const factor_product *F) {
    return (reference_system){problem->n, problem->n_channels, F, problem->area, problem->reflectance};
}

/* total: with the first light that is known. */
static reference_answers answers_of(const lam_operator *op, const judge_input *input, const probes *p,
                                    bool total, double begin, double end) {
    return (reference_answers){.op = op,
                               .E = p->E,
                               .B = p->B,
                               .first = total ? p->first : NULL,
                               .known = p->known,
                               .progress = input->progress,
                               .begin = begin,
                               .end = end};
}

/* Relative and indirect figures of each group against one F: those of the total error, or of the operator's.
 */
static lam_status figures_against(const lam_operator *op, const judge_input *input, const factor_product *F,
                                  probes *p, bool total, const kept_corrections *kept,
                                  error_group *groups[N_GROUPS], lam_error *error) {
    lam_status status = LAM_OK;
    comparison c = {input->problem, p, kept};
    const double share = input->independent.n == 0 ? 1 : 1. / 3;
    const reference_system system = system_of(input->problem, F);
    const reference_answers answers =
        answers_of(op, input, p, total, total ? share : 0, total ? 2 * share : share);
    size_t *all = memory_allocate(p->m, sizeof *all, "probes", error);
    if (all == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < p->m; v++) all[v] = v;
    memset(p->B_norm, 0, p->m * sizeof *p->B_norm);
    memset(p->indirect_norm, 0, p->m * sizeof *p->indirect_norm);
    memset(p->error_norm, 0, p->m * sizeof *p->error_norm);
    TRY(guided_reference_each(&system, &answers, p->m, all, compare, &c, error));
    for (int g = 0; g < N_GROUPS; g++) {
        error_figures *relative = total ? &groups[g]->total_relative : &groups[g]->operator_relative;
        error_figures *indirect = total ? &groups[g]->total_indirect : &groups[g]->operator_indirect;
        size_t bright = 0, lit = 0;
        for (size_t v = p->begin[g]; v < p->begin[g + 1]; v++) {
            if (p->B_norm[v] > 0) {
                add_figure(relative, sqrt(p->error_norm[v] / p->B_norm[v]));
                bright++;
            }
            /* An element that nothing sees has no indirect light to be wrong about. */
            if (p->indirect_norm[v] > dark * dark * p->B_norm[v]) {
                add_figure(indirect, sqrt(p->error_norm[v] / p->indirect_norm[v]));
                lit++;
            }
        }
        finish_figure(relative, bright);
        finish_figure(indirect, lit);
    }
done:
    free(all);
    return status;
}

typedef struct half_corrections {
    const build_problem *problem;
    kept_corrections kept;
} half_corrections;

static void keep_half(void *context, size_t v, size_t channel, const double *x) {
    const half_corrections *h = context;
    keep(&h->kept, h->problem, v, channel, x);
}

/* Half the distance between the halves' solutions B~ + x, over the indirect light: the standard error of
 * their mean; negative where there is no indirect light. */
static double half_distance(const build_problem *problem, const float *E, const float *B, const double *x,
                            const double *y) {
    double difference = 0, indirect = 0, all = 0;
    for (size_t i = 0; i < problem->n_channels * problem->n; i++) {
        const double a = problem->area[i % problem->n], mean = (double)B[i] + .5 * (x[i] + y[i]);
        difference += a * .25 * (x[i] - y[i]) * (x[i] - y[i]);
        indirect += a * (mean - (double)E[i]) * (mean - (double)E[i]);
        all += a * mean * mean;
    }
    return indirect > dark * dark * all ? sqrt(difference / indirect) : -1;
}

/* Of each group some probes: their numbers, for [N_GROUPS * JUDGE_NOISE_PROBES]. */
static size_t noise_probes(const probes *p, size_t *which) {
    size_t m = 0;
    for (int g = 0; g < N_GROUPS; g++)
        for (size_t v = p->begin[g]; v < p->begin[g + 1] && v < p->begin[g] + JUDGE_NOISE_PROBES; v++)
            which[m++] = v;
    return m;
}

/* known: the corrections of these probes by `independent`. */
static lam_status measure_noise(const lam_operator *op, const judge_input *input, const probes *p,
                                const kept_corrections *known, error_group *groups[N_GROUPS],
                                lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *problem = input->problem;
    const size_t vector = problem->n_channels * problem->n, m = known->m;
    double *x[2] = {NULL, NULL};
    const double *half[2];
    for (int h = 0; h < 2; h++) {
        half[h] = known->x;
        if (input->halves[h].context == input->independent.context) continue;
        half[h] = x[h] = memory_allocate(m, vector * sizeof *x[h], "reference noise", error);
        if (x[h] == NULL) TRY(LAM_ERR_MEMORY);
        half_corrections to = {problem, {m, known->which, x[h]}};
        const reference_system system = system_of(problem, &input->halves[h]);
        const reference_answers answers = answers_of(op, input, p, true, (4. + h) / 6, (5. + h) / 6);
        TRY(guided_reference_each(&system, &answers, m, known->which, keep_half, &to, error));
    }
    size_t k = 0;
    for (int g = 0; g < N_GROUPS; g++) {
        double sum = 0;
        size_t lit = 0;
        for (; k < m && known->which[k] < p->begin[g + 1]; k++) {
            const size_t at = known->which[k] * vector;
            const double noise =
                half_distance(problem, p->E + at, p->B + at, half[0] + k * vector, half[1] + k * vector);
            if (noise < 0) continue;
            sum += noise;
            lit++;
        }
        groups[g]->reference_noise = lit > 0 ? sum / (double)lit : 0;
    }
done:
    free(x[0]);
    free(x[1]);
    return status;
}

/* Negative power over all power, and sum A E against sum A [(1 - rho) H + B (1 - s)], of each group. */
static lam_status physics(const lam_operator *op, const judge_input *input, const probes *p,
                          error_group *groups[N_GROUPS], lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *problem = input->problem;
    const size_t n = problem->n, vector = n * problem->n_channels;
    float *H = memory_allocate(p->m, vector * sizeof *H, "probes", error);
    if (H == NULL) TRY(LAM_ERR_MEMORY);
    TRY(apply(op, p, LAM_IRRADIANCE, H, error));
    for (int g = 0; g < N_GROUPS; g++) {
        const double count = (double)(p->begin[g + 1] - p->begin[g]);
        for (size_t v = p->begin[g]; v < p->begin[g + 1]; v++) {
            double negative = 0, all = 0, emitted = 0, accounted = 0;
            for (size_t i = 0; i < vector; i++) {
                const double a = problem->area[i % n], b = (double)p->B[v * vector + i];
                const double s = input->row_sums[i % n],
                             direct = p->H0 != NULL ? (double)p->H0[v * vector + i] : 0;
                const double h = (double)H[v * vector + i] - direct;
                negative += a * fmax(-b, 0);
                all += a * fabs(b);
                emitted += a * (double)p->E[v * vector + i];
                accounted += a * ((1 - (double)problem->reflectance[i]) * h + b * (1 - s));
            }
            if (all > 0) groups[g]->negative_share += negative / all / count;
            if (emitted > 0) groups[g]->energy_balance += fabs(emitted - accounted) / emitted / count;
        }
    }
done:
    free(H);
    return status;
}

/* Probes of an operator of emitters: single emitters, and random weights of all of them. Their emission for
 * the reference is E + rho H0, with H0 from the sky. */
static lam_status emitter_emissions(const lam_operator *op, const judge_input *input, probes *p,
                                    lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *problem = input->problem;
    const size_t s = lam_operator_emitters(op), C = problem->n_channels, vector = C * problem->n;
    uint64_t seed = input->seed;
    p->W = memory_allocate(p->m, s * C * sizeof *p->W, "probes", error);
    p->H0 = memory_allocate(p->m, vector * sizeof *p->H0, "probes", error);
    if (p->W == NULL || p->H0 == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < p->m; v++)
        for (size_t c = 0; c < C; c++)
            for (size_t k = 0; k < s; k++)
                p->W[(v * C + c) * s + k] = v >= p->begin[RANDOM]           ? (float)random_unit(&seed)
                                            : k == v * s / p->begin[LIGHTS] ? 1
                                                                            : 0;
    if (p->begin[RANDOM] > p->begin[LIGHTS])
        TRY(lam_operator_weights(op, 1, input->emission, 0, NULL, p->W + p->begin[LIGHTS] * C * s, error));
    TRY(operator_emitters_light(op, p->m, p->W, p->E, p->H0, error));
    for (size_t v = 0; v < p->m; v++)
        for (size_t i = 0; i < vector; i++)
            p->E[v * vector + i] += problem->reflectance[i] * p->H0[v * vector + i];
done:
    return status;
}

/* True if the scene has light of its own that the operator can answer. */
static bool any_light(const lam_operator *op, const judge_input *input) {
    if (lam_operator_emitters(op) > 0) {
        const size_t s = lam_operator_emitters(op), C = input->problem->n_channels;
        float *W = memory_allocate(s * C, sizeof *W, "weights", NULL);
        bool any = W != NULL && lam_operator_weights(op, 1, input->emission, 0, NULL, W, NULL) == LAM_OK,
             lit = false;
        for (size_t k = 0; any && k < s * C; k++) lit = lit || W[k] > 0;
        free(W);
        return any && lit;
    }
    for (size_t i = 0; i < input->problem->n * input->problem->n_channels; i++)
        if (input->emission[i] > 0) return true;
    return false;
}

lam_status judge_operator(const lam_operator *op, const judge_input *input, error_report *report,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *problem = input->problem;
    const double start = clock_seconds();
    const size_t vector = problem->n * problem->n_channels;
    error_report found = {0};
    error_group *groups[N_GROUPS] = {&found.single, &found.lights, &found.random};
    probes p = {0};
    size_t which[N_GROUPS * JUDGE_NOISE_PROBES];
    kept_corrections kept = {.m = 0};
    const size_t s = lam_operator_emitters(op), most = s > 0 ? s : problem->n;
    const size_t counts[N_GROUPS] = {input->probes < most ? input->probes : most, any_light(op, input),
                                     JUDGE_RANDOM_PROBES};
    TRY(probes_init(&p, counts, problem, error));
    for (int g = 0; g < N_GROUPS; g++) groups[g]->probes = counts[g];
    if (s > 0)
        TRY(emitter_emissions(op, input, &p, error));
    else
        TRY(single_emissions(problem, input->seed, &p, error));
    if (counts[LIGHTS] > 0 && s == 0)
        memcpy(p.E + p.begin[LIGHTS] * vector, input->emission, vector * sizeof *p.E);
    if (s == 0) random_emissions(problem, input->seed + 1, &p);

    progress_report(input->progress, "judge", 0);
    TRY(apply(op, &p, LAM_RADIOSITY, p.B, error));
    TRY(physics(op, input, &p, groups, error));
    TRY(figures_against(op, input, &input->own, &p, false, &kept, groups, error));
    if (input->independent.n > 0) {
        TRY(find_first_light(input, &p, error));
        if (input->halves[0].n > 0) {
            kept = (kept_corrections){.m = noise_probes(&p, which), .which = which};
            kept.x = memory_allocate(kept.m, vector * sizeof *kept.x, "reference noise", error);
            if (kept.x == NULL) TRY(LAM_ERR_MEMORY);
        }
        TRY(figures_against(op, input, &input->independent, &p, true, &kept, groups, error));
        if (input->halves[0].n > 0) TRY(measure_noise(op, input, &p, &kept, groups, error));
    }
    progress_report(input->progress, "judge", 1);
    found.has_total = input->independent.n > 0;
    found.seconds = clock_seconds() - start;
    *report = found;
done:
    free(kept.x);
    probes_free(&p);
    return status;
}
