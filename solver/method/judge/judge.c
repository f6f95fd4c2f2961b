#include "solver/method/judge/judge.h"

#include "solver/base/clock.h"
#include "solver/method/judge/judge_black.h"
#include "solver/method/judge/judge_round.h"
#include "solver/method/judge/judge_sky.h"
#include "solver/method/judge/judge_whole.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Noise below this share of a figure may be taken out of it. */
static const double noise_most = 1. / 3;
/* Random emissions are all alike. */
enum { RANDOM_LEAST = 4 };

static void group_sums_free(group_sums *s) {
    by_group_free(&s->total);
    by_group_free(&s->same);
    by_group_free(&s->own);
}

/* Room for so many probes of whole groups. */
static lam_status group_sums_begin(const judge_input *input, size_t whole, group_sums *out,
                                   lam_error *error) {
    lam_status status = LAM_OK;
    TRY(by_group_begin(input, whole, &out->total, error));
    TRY(by_group_begin(input, whole, &out->same, error));
    TRY(by_group_begin(input, whole, &out->own, error));
done:
    return status;
}

/* Fills figures of `out`, which has those of whole groups. */
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

/* Negative power over all power, of irradiance where all is black, and sum A E against sum A [(1 - rho) H + B
 * (1 - s)], means of each group. Drops H. */
static void add_physics(const judge_input *input, probes *p, error_group *groups[JUDGE_GROUPS]) {
    const build_problem *problem = input->problem;
    const size_t n = problem->n, vector = n * problem->n_channels;
    for (int g = 0; g < JUDGE_GROUPS; g++) {
        const double count = (double)(p->begin[g + 1] - p->begin[g]);
        for (size_t v = p->begin[g]; v < p->begin[g + 1]; v++) {
            double negative = 0, all = 0, emitted = 0, accounted = 0;
            for (size_t i = 0; i < vector; i++) {
                const bool black = judge_is_black(input, i % n);
                const double a = problem->area[i % n], b = (double)(black ? p->E : p->B)[v * vector + i];
                const double s = input->row_sums[i % n],
                             direct = p->H0 != NULL ? (double)p->H0[v * vector + i] : 0;
                const double h = (double)p->H[v * vector + i] - direct;
                negative += a * fmax(-(input->all_black ? h : b), 0);
                all += a * fabs(input->all_black ? h : b);
                emitted += a * (double)p->E[v * vector + i];
                accounted += a * ((1 - (double)problem->reflectance[i]) * h + b * (1 - s));
            }
            if (all > 0) groups[g]->negative_share += negative / all / count;
            if (emitted > 0) groups[g]->energy_balance += fabs(emitted - accounted) / emitted / count;
        }
    }
    free(p->H);
    p->H = NULL;
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
static bool next_counts(const judge_rounds *r, const probe_source *source, size_t counts[JUDGE_GROUPS]) {
    const judge_input *input = r->input;
    const size_t least[JUDGE_GROUPS] = {RANDOM_LEAST, source->most[JUDGE_WHOLE], 1,
                                        input->probes_least > 0 ? input->probes_least : input->probes};
    size_t all = 0;
    for (int g = 0; g < JUDGE_GROUPS; g++) {
        const group_tally *t = &r->of[g];
        const size_t left = source->most[g] - source->made[g];
        const size_t step = g == JUDGE_RANDOM ? RANDOM_LEAST : judge_at_once(input->problem->n);
        const figure_group *of = input->independent.n > 0 ? &t->total : &t->own;
        const bool enough =
            t->done >= least[g] && judge_is_certain(&of->indirect, probe_source_all(source, g));
        const bool once = r->at_once || g == JUDGE_WHOLE || left < step;
        counts[g] = enough ? 0 : once ? left : step;
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
        const reference_system s = reference_system_of(input, all[k]);
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

lam_status judge_operator(const lam_operator *op, const judge_input *given, error_report *report,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const double start = clock_seconds();
    judge_input with_black = *given;
    const judge_input *const input = &with_black;
    error_report found = {0};
    error_group *groups[JUDGE_GROUPS] = {&found.random, &found.whole, &found.lights, &found.single};
    size_t counts[JUDGE_GROUPS], most = 0;
    probe_source source = {.deck = NULL};
    probes p = {.m = 0};
    judge_rounds rounds = {.input = input};
    group_errors made = {.n_groups = 0};
    TRY(judge_black_find(&with_black, error));
    TRY(probe_source_make(input->problem, op, input->emission, input->emits, input->probes,
                          JUDGE_RANDOM_PROBES, input->seed, &source, error));
    source.black = input->black;
    if (input->group != NULL)
        TRY(probe_source_add_groups(&source, input->group, input->n_groups, input->people, WHOLE_LARGE,
                                    judge_whole_most(input->problem->n, input->problem->n_channels,
                                                     input->n_groups * (input->read != NULL ? 2 : 1)),
                                    error));
    if (input->by_group != NULL && input->group != NULL && input->independent.n > 0) {
        TRY(group_sums_begin(input, source.most[JUDGE_WHOLE], &rounds.by_group, error));
        rounds.whole = &made;
    }
    for (int g = 0; g < JUDGE_GROUPS; g++) most += source.most[g];
    rounds.at_once = is_dense(op, input, most);
    progress_report(input->progress, "judge", 0);
    while (next_counts(&rounds, &source, counts)) {
        if (progress_cancelled(input->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        TRY(probes_next(&source, counts, rounds.n == 0, &p, error));
        if (rounds.n == 0) add_physics(input, &p, groups);
        TRY(judge_rounds_add(op, &source, &p, &rounds, error));
        probes_free(&p);
        p = (probes){.m = 0};
    }
    for (int g = 0; g < JUDGE_GROUPS; g++)
        finish_group(input, &rounds.of[g], g == JUDGE_SINGLE, probe_source_all(&source, g), groups[g]);
    if (rounds.by_group.total.n > 0) TRY(group_sums_finish(&rounds.by_group, &made, error));
    if (input->sky != NULL) TRY(measure_sky(op, input, &rounds.by_group.total, &found.sky, &made, error));
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
    group_sums_free(&rounds.by_group);
    group_errors_free(&made);
    probe_source_free(&source);
    probes_free(&p);
    judge_black_free(&with_black);
    return status;
}
