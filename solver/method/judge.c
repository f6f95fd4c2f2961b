#include "solver/method/judge.h"

#include "solver/base/clock.h"
#include "solver/method/guided_reference.h"
#include "solver/method/judge_by_group.h"
#include "solver/method/judge_figures.h"
#include "solver/method/judge_probes.h"
#include "solver/method/judge_sky.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Probes of a group are enough where the standard error of their mean is below this share of it. */
static const double certain = .1;
/* Noise below this share of a figure may be taken out of it. */
static const double noise_most = 1. / 3;
/* Random emissions are all alike. Where the references are no twins the noise is measured by some of the
 * first round: random emission, whole groups, the lights, and some single elements. */
enum { RANDOM_LEAST = 4, NOISE_PROBES = 12 };

/* Figures of a group so far: against the operator's own F, and against the references. */
typedef struct group_tally {
    size_t done, n_operator;
    figure_group own, total;
    receiver_sums own_receivers, total_receivers;
} group_tally;

/* Errors of groups of the scene: against the references, and of the probes whose errors against the
 * operator's own F are found, both. */
typedef struct group_sums {
    by_group_sums total, same, own;
} group_sums;

static void group_sums_free(group_sums *s) {
    by_group_free(&s->total);
    by_group_free(&s->same);
    by_group_free(&s->own);
}

static lam_status group_sums_begin(const judge_input *input, group_sums *out, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(by_group_begin(input, &out->total, error));
    TRY(by_group_begin(input, &out->same, error));
    TRY(by_group_begin(input, &out->own, error));
done:
    return status;
}

static lam_status group_sums_finish(const group_sums *s, group_errors *out, lam_error *error) {
    lam_status status = LAM_OK;
    double *same[GROUP_FIGURES] = {NULL};
    TRY(by_group_finish(&s->total, out->of, error));
    TRY(by_group_finish(&s->own, out->of_operator, error));
    TRY(by_group_finish(&s->same, same, error));
    for (int f = 0; f < GROUP_FIGURES; f++)
        for (size_t k = 0; k < s->total.n_rows * s->total.n_groups; k++)
            out->of_operator[f][k] *= same[f][k] > 0 ? out->of[f][k] / same[f][k] : 1;
    out->n_groups = s->total.n_groups;
    out->n_rows = s->total.n_rows;
done:
    for (int f = 0; f < GROUP_FIGURES; f++) free(same[f]);
    return status;
}

/* The largest ratios of steps so far, of each reference (reference_answers). */
typedef struct step_rates {
    double own, independent, other;
} step_rates;

/* The emissions of a round, their first light H and its spread D, [m][C][n], and corrections by each
 * reference, in single precision, as the answers are that they correct. */
typedef struct measured {
    const judge_input *input;
    step_rates *rates;
    bool at_once; /* these are all */
    probes p;
    double *first, *spread;
    bool *known;
    float *x, *y;          /* y: by the other reference; NULL: of none */
    double *one_x, *one_y; /* [C][n] those of one probe */
} measured;

static void measured_free(measured *m) {
    probes_free(&m->p);
    free(m->first);
    free(m->spread);
    free(m->known);
    free(m->x);
    free(m->y);
    free(m->one_x);
    free(m->one_y);
}

static size_t vector_of(const judge_input *input) {
    return input->problem->n * input->problem->n_channels;
}

/* Computes the first light H of the probes in which few elements emit. */
static lam_status find_first_light(measured *m, lam_error *error) {
    lam_status status = LAM_OK;
    const judge_input *input = m->input;
    const size_t n = input->problem->n, C = input->problem->n_channels;
    if (input->first_light == NULL || m->p.W != NULL) return LAM_OK;
    m->first = memory_allocate(m->p.m, C * n * sizeof *m->first, "probes", error);
    m->spread = memory_allocate(m->p.m, C * n * sizeof *m->spread, "probes", error);
    m->known = memory_allocate(m->p.m, sizeof *m->known, "probes", error);
    if (m->first == NULL || m->spread == NULL || m->known == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = m->p.begin[JUDGE_LIGHTS]; v < m->p.m; v++) {
        if (progress_cancelled(input->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        for (size_t c = 0; c < C; c++) {
            const float *E = m->p.E + v * C * n;
            double *H = m->first + v * C * n, *D = m->spread + v * C * n;
            if (c > 0 && memcmp(E, E + c * n, n * sizeof *E) == 0) {
                memcpy(H + c * n, H, n * sizeof *H);
                memcpy(D + c * n, D, n * sizeof *D);
                continue;
            }
            TRY(input->first_light(input->first_light_context, E + c * n, H + c * n, D + c * n, &m->known[v],
                                   error));
            if (!m->known[v]) break;
        }
    }
done:
    return status;
}

static reference_system system_of(const judge_input *input, const factor_product *F) {
    const build_problem *problem = input->problem;
    return (reference_system){problem->n, problem->n_channels, F, problem->area, problem->reflectance};
}

typedef struct corrections {
    const judge_input *input;
    float *x; /* [m][C][n] */
} corrections;

static void keep(void *context, size_t v, size_t channel, const double *x) {
    const corrections *to = context;
    const size_t n = to->input->problem->n, C = to->input->problem->n_channels;
    float *out = to->x + (v * C + channel) * n;
    for (size_t i = 0; i < n; i++) out[i] = (float)x[i];
}

/* The share of D in the first light H of the independent reference or of the other one: of twins each has an
 * estimate of its own, H + D and H - D, and a disturbed one has as much of that noise as H itself. Their
 * distance then has the noise of the first light, and all that bounces on of it. */
static double share_of_spread(const judge_input *input, bool other) {
    if (input->other.n == 0 || input->relation == REFERENCE_COARSER) return 0;
    return input->relation == REFERENCE_TWIN ? (other ? -1 : 1) : (other ? 1 : 0);
}

/* x [][C][n]: corrections of the answers which[count] by F, the other reference or not; first: with the first
 * light that is known. */
static lam_status solve(const lam_operator *op, const measured *m, const factor_product *F, bool first,
                        bool other, size_t count, const size_t *which, double *rate, float *x,
                        lam_error *error) {
    const reference_system system = system_of(m->input, F);
    const reference_answers answers = {.op = op,
                                       .E = m->p.E,
                                       .B = m->p.B,
                                       .first = first ? m->first : NULL,
                                       .known = m->known,
                                       .spread = m->spread,
                                       .share = share_of_spread(m->input, other),
                                       .rate = rate,
                                       .progress = m->input->progress};
    corrections to = {m->input, x};
    return guided_reference_each(&system, &answers, count, which, keep, &to, error);
}

/* y of the first n_noisy answers, by the other reference. Where that is the operator's own F, x has the
 * corrections by it as long as no first light is taken, which are those of answers whose first light is not
 * known. */
static lam_status prepare_other(measured *m, size_t n_noisy, bool by_own, size_t *which, size_t *count,
                                lam_error *error) {
    const size_t vector = vector_of(m->input);
    *count = 0;
    m->y = memory_allocate(n_noisy, vector * sizeof *m->y, "reference", error);
    if (m->y == NULL) return LAM_ERR_MEMORY;
    for (size_t v = 0; v < n_noisy; v++)
        if (!by_own || (m->known != NULL && m->known[v]))
            which[(*count)++] = v;
        else
            memcpy(m->y + v * vector, m->x + v * vector, vector * sizeof *m->y);
    return LAM_OK;
}

/* The numbers of probe v, of from [][C][n], as to [C][n]. */
static const double *numbers_of(const measured *m, size_t v, const float *from, double *to) {
    const size_t vector = vector_of(m->input);
    for (size_t i = 0; i < vector; i++) to[i] = (double)from[v * vector + i];
    return to;
}

/* Probe v with its corrections x and y (NULL: not known), by the references of the total error or by the
 * operator's own; until the next one. The noise of the first light is a part of y - x or comes beside
 * (share_of_spread). */
static figure_probe probe_of(const measured *m, size_t v, const float *x, const float *y, bool total) {
    const judge_input *input = m->input;
    const size_t first = v * vector_of(input);
    const bool apart = input->other.n == 0 || input->relation == REFERENCE_COARSER;
    const bool spread = total && apart && m->known != NULL && m->known[v];
    return (figure_probe){.problem = input->problem,
                          .E = m->p.E + first,
                          .B = m->p.B + first,
                          .x = numbers_of(m, v, x, m->one_x),
                          .y = y != NULL ? numbers_of(m, v, y, m->one_y) : NULL,
                          .spread = spread ? m->spread + first : NULL,
                          .relation = input->relation,
                          .other_share = input->other_share};
}

/* Negative power over all power, and sum A E against sum A [(1 - rho) H + B (1 - s)], means of each group.
 * Drops H. */
static void add_physics(measured *m, error_group *groups[JUDGE_GROUPS]) {
    const build_problem *problem = m->input->problem;
    const size_t n = problem->n, vector = vector_of(m->input);
    const probes *p = &m->p;
    for (int g = 0; g < JUDGE_GROUPS; g++) {
        const double count = (double)(p->begin[g + 1] - p->begin[g]);
        for (size_t v = p->begin[g]; v < p->begin[g + 1]; v++) {
            double negative = 0, all = 0, emitted = 0, accounted = 0;
            for (size_t i = 0; i < vector; i++) {
                const double a = problem->area[i % n], b = (double)p->B[v * vector + i];
                const double s = m->input->row_sums[i % n],
                             direct = p->H0 != NULL ? (double)p->H0[v * vector + i] : 0;
                const double h = (double)p->H[v * vector + i] - direct;
                negative += a * fmax(-b, 0);
                all += a * fabs(b);
                emitted += a * (double)p->E[v * vector + i];
                accounted += a * ((1 - (double)problem->reflectance[i]) * h + b * (1 - s));
            }
            if (all > 0) groups[g]->negative_share += negative / all / count;
            if (emitted > 0) groups[g]->energy_balance += fabs(emitted - accounted) / emitted / count;
        }
    }
    free(m->p.H);
    m->p.H = NULL;
}

/* Nobody knows how many rounds there will be. */
static void report_round(const judge_input *input, size_t round, double part) {
    progress_report(input->progress, "judge", 1 - 1 / ((double)round + 1 + part));
}

/* The number of emissions of a group, 0 where they are endless. */
static size_t all_of(const probe_source *source, int group) {
    if (group == JUDGE_RANDOM) return 0;
    return group == JUDGE_LIGHTS ? 1 : group == JUDGE_WHOLE ? source->n_whole : source->n_singles;
}

/* True where the mean of a figure over its probes is known well enough. */
static bool is_certain(const figure_tally *t, size_t all) {
    const double spread = figures_spread(t, all);
    return spread >= 0 && spread * (double)t->count <= certain * t->plain.f;
}

static bool are_same(const factor_product *a, const factor_product *b) {
    return a->context == b->context && a->multiply == b->multiply;
}

/* Emissions of one round, against all references. The operator's own error is found until it is certain, the
 * noise where the references are no twins, are found in the first round. */
static lam_status measure(const lam_operator *op, measured *m, const probe_source *source, size_t round,
                          group_tally *t, group_sums *by_group, lam_error *error) {
    lam_status status = LAM_OK;
    const judge_input *input = m->input;
    const probes *p = &m->p;
    const bool first = round == 0;
    const bool each = input->relation != REFERENCE_COARSER;
    const bool total = input->independent.n > 0, noisy = input->other.n > 0 && (first || each);
    const bool own = first || !is_certain(&t[JUDGE_SINGLE].own.indirect, all_of(source, JUDGE_SINGLE));
    const size_t some = NOISE_PROBES + p->begin[JUDGE_LIGHTS] - p->begin[JUDGE_WHOLE];
    const size_t n_noisy = each || m->at_once || p->m < some ? p->m : some;
    size_t *all = memory_allocate(p->m, sizeof *all, "probes", error);
    size_t *others = memory_allocate(p->m, sizeof *others, "probes", error), n_others = 0;
    m->x = memory_allocate(p->m, vector_of(input) * sizeof *m->x, "reference", error);
    m->one_x = memory_allocate(vector_of(input), sizeof *m->one_x, "reference", error);
    m->one_y = memory_allocate(vector_of(input), sizeof *m->one_y, "reference", error);
    if (m->x == NULL || m->one_x == NULL || m->one_y == NULL || all == NULL || others == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < p->m; v++) all[v] = v;
    if (own) {
        TRY(solve(op, m, &input->own, false, false, p->m, all, &m->rates->own, m->x, error));
        for (int g = 0; g < JUDGE_GROUPS; g++)
            for (size_t v = p->begin[g]; v < p->begin[g + 1]; v++) {
                const figure_probe one = probe_of(m, v, m->x, NULL, false);
                figures_add(&one, &t[g].own);
                if (by_group->own.n > 0) by_group_add(&one, g, &by_group->own);
                if (input->read != NULL) receivers_add(&one, input->read, &t[g].own_receivers);
                t[g].n_operator++;
            }
    }
    if (!total) goto done;
    report_round(input, round, .3);
    TRY(find_first_light(m, error));
    const bool by_own = are_same(&input->other, &input->own);
    if (noisy) TRY(prepare_other(m, n_noisy, own && by_own, others, &n_others, error));
    TRY(solve(op, m, &input->independent, true, false, p->m, all, &m->rates->independent, m->x, error));
    report_round(input, round, .6);
    if (n_others > 0)
        TRY(solve(op, m, &input->other, true, true, n_others, others,
                  by_own ? &m->rates->own : &m->rates->other, m->y, error));
    for (int g = 0; g < JUDGE_GROUPS; g++)
        for (size_t v = p->begin[g]; v < p->begin[g + 1]; v++) {
            const figure_probe one = probe_of(m, v, m->x, noisy && v < n_noisy ? m->y : NULL, true);
            figures_add(&one, &t[g].total);
            if (by_group->total.n > 0) by_group_add(&one, g, &by_group->total);
            if (by_group->total.n > 0 && own) by_group_add(&one, g, &by_group->same);
            if (input->read != NULL) receivers_add(&one, input->read, &t[g].total_receivers);
        }
done:
    free(all);
    free(others);
    return status;
}

double judge_total(const error_group *g) {
    return g->receivers.known ? g->receivers.total_indirect : g->total_indirect.mean;
}

double judge_of_operator(const error_group *g) {
    return g->receivers.known ? g->receivers.operator_indirect : g->operator_indirect.mean;
}

size_t judge_at_once(size_t n) {
    return n < REFERENCE_MANY_ELEMENTS ? 16 : 8;
}

/* The probes of the next round; false where there are none. An LU takes all of them at once. */
static bool next_counts(const judge_input *input, const probe_source *source, const group_tally *t,
                        bool at_once, size_t counts[JUDGE_GROUPS]) {
    const size_t least[JUDGE_GROUPS] = {RANDOM_LEAST, 0, 1,
                                        input->probes_least > 0 ? input->probes_least : input->probes};
    size_t all = 0;
    for (int g = 0; g < JUDGE_GROUPS; g++) {
        const size_t left = source->most[g] - source->made[g];
        const size_t step = g == JUDGE_RANDOM ? RANDOM_LEAST : judge_at_once(input->problem->n);
        const figure_group *of = input->independent.n > 0 ? &t[g].total : &t[g].own;
        const bool enough = t[g].done >= least[g] && is_certain(&of->indirect, all_of(source, g));
        counts[g] = enough ? 0 : at_once || left < step ? left : step;
        all += counts[g];
    }
    return all > 0;
}

/* The total errors. repeated: as in figures_noise. */
static void finish_total(const group_tally *t, double repeated, error_group *g) {
    g->reference_noise = figures_noise(&t->total.indirect, repeated, false);
    g->total_relative = figures_mean(&t->total.relative);
    g->total_indirect = figures_mean(&t->total.indirect);
    g->is_bound = !(g->reference_noise <= noise_most * g->total_indirect.mean);
    if (!g->is_bound) return;
    g->reference_noise = figures_noise(&t->total.indirect, repeated, true);
    g->total_relative = figures_bound(&t->total.relative, figures_noise(&t->total.relative, repeated, true));
    g->total_indirect = figures_bound(&t->total.indirect, g->reference_noise);
}

/* The elements that light of single emissions falls on: with sources more than the `all` that emit. */
static size_t elements_of(const judge_input *input, size_t all) {
    return input->emits != NULL ? input->problem->n : all;
}

/* all: the number of emissions of the group; 0: endless. */
static void finish_group(const judge_input *input, const group_tally *t, bool single, size_t all,
                         error_group *g) {
    g->probes = t->done;
    g->operator_probes = t->n_operator;
    if (t->done == 0) return;
    if (input->read != NULL) g->receivers = receivers_of(&t->total_receivers, &t->own_receivers);
    g->operator_relative = figures_mean(&t->own.relative);
    g->operator_indirect = figures_mean(&t->own.indirect);
    if (input->independent.n == 0) return;
    g->probes_noise = figures_spread(&t->total.indirect, all);
    finish_total(t, single ? (double)t->done / (double)elements_of(input, all) : 0, g);
}

/* True where a reference is an LU, of whose probes none is worth leaving out. */
static bool is_dense(const lam_operator *op, const judge_input *input, size_t m) {
    const factor_product *const all[] = {&input->own, &input->independent, &input->other};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        const reference_system s = system_of(input, all[k]);
        if (all[k]->n > 0 && guided_reference_is_dense(&s, op, m)) return true;
    }
    return false;
}

/* The errors of light from a sky, all over and, where by_group was begun, by group. */
static lam_status measure_sky(const lam_operator *op, const judge_input *input, by_group_sums *by_group,
                              error_group *found, group_errors *made, lam_error *error) {
    lam_status status = LAM_OK;
    group_tally t = {.done = 0};
    sky_law_sums law = {.n_bins = 0};
    if (by_group->n > 0) {
        TRY(judge_sky_powers(input, made, error));
        TRY(sky_law_begin(input, made, &law, error));
    }
    TRY(judge_sky_add(op, input, &t.total, by_group, &law, &t.done, error));
    if (t.done == 0) goto done;
    found->probes = t.done;
    found->probes_noise = figures_spread(&t.total.indirect, 0);
    finish_total(&t, 0, found);
    if (by_group->n > 0) TRY(sky_law_finish(&law, made, error));
done:
    if (t.done == 0) { /* of a dark sky nothing is stated */
        free(made->sky_power);
        free(made->sky_first);
        made->sky_power = made->sky_first = NULL;
    }
    sky_law_free(&law);
    return status;
}

lam_status judge_operator(const lam_operator *op, const judge_input *input, error_report *report,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const double start = clock_seconds();
    error_report found = {0};
    error_group *groups[JUDGE_GROUPS] = {&found.random, &found.whole, &found.lights, &found.single};
    group_tally t[JUDGE_GROUPS] = {{.done = 0}};
    size_t counts[JUDGE_GROUPS], rounds = 0;
    step_rates rates = {.own = 0};
    probe_source source;
    measured m = {.input = input};
    group_sums by_group = {.total = {.n = 0}};
    group_errors made = {.n_groups = 0};
    TRY(probe_source_make(input->problem, op, input->emission, input->emits, input->probes,
                          JUDGE_RANDOM_PROBES, input->seed, &source, error));
    if (input->group != NULL)
        TRY(probe_source_add_groups(&source, input->group, input->n_groups, JUDGE_WHOLE_PROBES, error));
    if (input->by_group != NULL && input->group != NULL && input->independent.n > 0)
        TRY(group_sums_begin(input, &by_group, error));
    size_t most = 0;
    for (int g = 0; g < JUDGE_GROUPS; g++) most += source.most[g];
    const bool at_once = is_dense(op, input, most);
    progress_report(input->progress, "judge", 0);
    for (; next_counts(input, &source, t, at_once, counts); rounds++) {
        if (progress_cancelled(input->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        measured_free(&m);
        m = (measured){.input = input, .rates = &rates, .at_once = at_once};
        TRY(probes_next(&source, counts, rounds == 0, &m.p, error));
        if (rounds == 0) add_physics(&m, groups);
        TRY(measure(op, &m, &source, rounds, t, &by_group, error));
        for (int g = 0; g < JUDGE_GROUPS; g++) t[g].done += counts[g];
        report_round(input, rounds, 1);
    }
    for (int g = 0; g < JUDGE_GROUPS; g++)
        finish_group(input, &t[g], g == JUDGE_SINGLE, all_of(&source, g), groups[g]);
    if (by_group.total.n > 0) TRY(group_sums_finish(&by_group, &made, error));
    if (input->sky != NULL) TRY(measure_sky(op, input, &by_group.total, &found.sky, &made, error));
    if (input->by_group != NULL) {
        group_errors_free(input->by_group);
        *input->by_group = made;
        made = (group_errors){.n_groups = 0};
    }
    progress_report(input->progress, "judge", 1);
    found.has_total = input->independent.n > 0;
    found.seconds = clock_seconds() - start;
    *report = found;
done:
    group_sums_free(&by_group);
    group_errors_free(&made);
    probe_source_free(&source);
    measured_free(&m);
    return status;
}
