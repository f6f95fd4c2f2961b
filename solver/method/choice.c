#include "solver/method/choice.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool decision_claimed(const decision *so_far) {
    for (size_t k = 0; k < so_far->n_candidates; k++)
        if (so_far->candidates[k].claim > CLAIM_USUAL) return true;
    return false;
}

double decision_rival(const decision *so_far) {
    double cost = INFINITY;
    for (size_t k = 0; k < so_far->n_candidates; k++)
        if (!so_far->candidates[k].outdone) cost = fmin(cost, so_far->candidates[k].cost);
    return cost;
}

const candidate *decision_find(const decision *d, const char *method) {
    for (size_t k = 0; k < d->n_candidates; k++)
        if (strcmp(d->candidates[k].method->name, method) == 0) return &d->candidates[k];
    return NULL;
}

double decision_figure(const decision *d, const char *object, const char *name, double otherwise) {
    for (size_t k = 0; k < d->n_candidates; k++) {
        const candidate *c = &d->candidates[k];
        if (c->object == NULL || strcmp(c->object, object) != 0) continue;
        for (size_t f = 0; f < c->n_figures; f++)
            if (strcmp(c->figures[f].name, name) == 0) return c->figures[f].value;
    }
    return otherwise;
}

void candidate_figure(candidate *c, const char *name, double value) {
    c->figures[c->n_figures].name = name;
    c->figures[c->n_figures++].value = value;
}

void decision_free(decision *d) {
    for (size_t k = 0; k < d->n_candidates; k++) {
        lam_operator_close(d->candidates[k].op);
        inverse_rows_free(&d->candidates[k].truth);
    }
    free(d->candidates);
    *d = (decision){.n_candidates = 0};
}

double candidate_error(const decision *d, const candidate *c) {
    return fmax(CHOICE_WORSE * d->options->epsilon, c->errors.groups);
}

/* The weight of a candidate: the lower, the better. */
static double weight_of(const decision *d, const candidate *c) {
    if (c->claim > CLAIM_COST) return c->cost;
    return candidate_error(d, c) * pow(c->cost, log(CHOICE_WORSE) / log(CHOICE_FASTER));
}

/* The candidate with the highest claim, and of those the one with the lowest weight; the first of equal ones.
 */
static const candidate *best(const decision *d) {
    const candidate *found = NULL;
    for (size_t k = 0; k < d->n_candidates; k++) {
        const candidate *c = &d->candidates[k];
        if (c->claim == CLAIM_COST && (c->outdone || !isfinite(c->cost))) continue;
        if (found == NULL || c->claim > found->claim ||
            (c->claim == found->claim && weight_of(d, c) < weight_of(d, found)))
            found = c;
    }
    return found != NULL ? found : decision_find(d, method_fallback()->name);
}

/* Measures the operators that are built, where another method has found the rows that tell their errors. */
static lam_status compare_errors(decision *d, lam_error *error) {
    lam_status status = LAM_OK;
    const inverse_rows *truth = NULL;
    for (size_t k = 0; k < d->n_candidates; k++)
        if (d->candidates[k].truth.rows != NULL && isfinite(d->candidates[k].cost))
            truth = &d->candidates[k].truth;
    for (size_t k = 0; truth != NULL && k < d->n_candidates; k++) {
        candidate *c = &d->candidates[k];
        if (c->op != NULL) TRY(operator_sampled_errors(d->problem, c->op, truth, &c->errors, error));
    }
done:
    return status;
}

/* Before F is known: true if all others are ruled out already. */
static bool is_final(const decision *d) {
    if (d->taken->claim > CLAIM_USUAL) return true;
    for (size_t k = 0; k < d->n_candidates; k++) {
        const candidate *c = &d->candidates[k];
        if (c != d->taken && !c->outdone && (c->open || isfinite(c->cost))) return false;
    }
    return true;
}

/* Writes the reason: the figures of F, those of the method taken, and the costs of the others. */
static void explain(decision *d) {
    const candidate *own = d->taken;
    size_t length = 0;
    const size_t size = sizeof d->reason;
    if (d->density >= 0) length += (size_t)snprintf(d->reason, size, "F is %.3g %% dense", 100 * d->density);
    if (own->found[0] != '\0')
        length +=
            (size_t)snprintf(d->reason + length, size - length, "%s%s", length > 0 ? ", " : "", own->found);
    for (size_t k = 0; k < d->n_candidates && isfinite(own->cost) && length < size; k++) {
        const candidate *c = &d->candidates[k];
        const double of_c = candidate_error(d, c), of_own = candidate_error(d, own);
        if (c == own || !isfinite(c->cost) || (c->cost < own->cost && !(of_c > of_own))) continue;
        length += (size_t)snprintf(d->reason + length, size - length, "; %s would take %.3g times as long",
                                   c->method->name, c->cost / own->cost);
        if (of_c != of_own && length < size)
            length += (size_t)snprintf(d->reason + length, size - length, " and err by %.2g in place of %.2g",
                                       of_c, of_own);
    }
    if (length == 0) snprintf(d->reason, size, "chosen before the form factors are known");
}

/* The method whose own options were given, of those that auto may take. */
static const build_method *asked_for(const build_options *options) {
    for (size_t k = 0; method_at(k) != NULL; k++) {
        const build_method *m = method_at(k);
        if (m->weigh != NULL && m->is_asked != NULL && m->is_asked(options, method_own_const(options, m)))
            return m;
    }
    return NULL;
}

/* True if the method can build from the form factors of the problem, or if there are none yet. */
static bool can_use(const build_problem *problem, const build_method *m) {
    return (problem->stream == NULL || (m->flags & METHOD_STREAMS)) &&
           (problem->blocks == NULL || (m->flags & METHOD_BLOCKS));
}

static lam_status take_named(const build_problem *problem, const build_options *options, decision *d,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const build_method *m = method_find(options->method);
    if (m == NULL) {
        char words[METHOD_CHOICES_BYTES];
        method_choices(words);
        for (char *c = words; *c != '\0'; c++)
            if (*c == '|') *c = ' ';
        FAIL(error, LAM_ERR_ARGUMENT, "--method %.40s: must be one of: %s", options->method, words);
    }
    d->candidates = memory_allocate(1, sizeof *d->candidates, "choice of a method", error);
    if (d->candidates == NULL) TRY(LAM_ERR_MEMORY);
    d->n_candidates = 1;
    d->candidates[0] = (candidate){.method = m, .claim = CLAIM_OPTIONS, .cost = INFINITY};
    memcpy(&d->candidates[0].own, method_own_const(options, m), sizeof d->candidates[0].own);
    d->taken = d->candidates;
    d->final = true;
    snprintf(d->reason, sizeof d->reason, "asked for by --method");
    if (!can_use(problem, m))
        FAIL(error, LAM_ERR_ARGUMENT, "--method %s: needs rows of form factors that are held", m->name);
done:
    return status;
}

lam_status choose_method(const build_problem *problem, const build_options *options, bool thorough,
                         decision *out, lam_error *error) {
    lam_status status = LAM_OK;
    const double n = (double)problem->n;
    decision d = {.problem = problem,
                  .options = options,
                  .thorough = thorough,
                  .density = problem->F != NULL ? (double)problem->F->indptr[problem->n] / (n * n) : -1,
                  .most = options->memory > 0 ? (double)options->memory / sizeof(float) : INFINITY,
                  .asked = asked_for(options)};
    if (strcmp(options->method, "auto") != 0) {
        TRY(take_named(problem, options, &d, error));
        *out = d;
        d = (decision){.n_candidates = 0};
        goto done;
    }
    if (d.asked != NULL && d.asked->check != NULL)
        TRY(d.asked->check(method_own_const(options, d.asked), error));
    if (d.asked != NULL && !can_use(problem, d.asked))
        FAIL(error, LAM_ERR_ARGUMENT, "options of --method %s: it needs rows of form factors that are held",
             d.asked->name);
    d.candidates = memory_allocate(METHODS_MOST, sizeof *d.candidates, "choice of a method", error);
    if (d.candidates == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; method_at(k) != NULL; k++) {
        const build_method *m = method_at(k);
        if (m->weigh == NULL || !can_use(problem, m)) continue;
        candidate *c = &d.candidates[d.n_candidates];
        *c = (candidate){.method = m, .cost = INFINITY};
        memcpy(&c->own, method_own_const(options, m), sizeof c->own);
        TRY(m->weigh(&d, &c->own, c, error));
        d.n_candidates++;
    }
    TRY(compare_errors(&d, error));
    d.taken = best(&d);
    d.final = problem->F != NULL || problem->stream != NULL || problem->blocks != NULL || is_final(&d);
    explain(&d);
    *out = d;
    d = (decision){.n_candidates = 0};
done:
    decision_free(&d);
    return status;
}
