/* Emissions of one round of the judge against all references. Private to judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_ROUND_H
#define LAMBERT_METHOD_JUDGE_ROUND_H

#include "solver/method/judge/guided_reference.h"
#include "solver/method/judge/judge_by_group.h"
#include "solver/method/judge/judge_figures.h"
#include "solver/method/judge/judge_probes.h"

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

/* The largest ratios of steps so far, of each reference (reference_answers). */
typedef struct step_rates {
    double own, independent, other;
} step_rates;

/* The figures of all rounds so far; begins with input and at_once alone. */
typedef struct judge_rounds {
    const judge_input *input;
    bool at_once; /* the first round has all emissions */
    size_t n;
    size_t tiles_left; /* of emitters that are single tiles of a sky, those to be known closer */
    step_rates rates;
    group_tally of[JUDGE_GROUPS];
    group_sums by_group;
    group_errors *whole; /* gets the figures of whole groups, all of which are in the first round; NULL: none
                            are wanted */
} judge_rounds;

/* Adds the emissions p, one after the other in memory of two corrections of each, [m][C][n] floats, the first
 * light of those where few elements emit among it. The operator's own error is found until it is certain; the
 * noise, where the references are no twins, in the first round. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED,
 * those of the references. */
lam_status judge_rounds_add(const lam_operator *op, const probe_source *source, const probes *p,
                            judge_rounds *r, lam_error *error);

/* Adds an emission of a group of probes, JUDGE_..., to the total errors of the whole scene. */
void judge_rounds_add_total(judge_rounds *r, int group, const figure_probe *one);

/* True where the mean of a figure over probes of `all` (0: endless many) is known well enough. */
bool judge_is_certain(const figure_tally *t, size_t all);

/* I - R F of the judged problem. */
reference_system reference_system_of(const judge_input *input, const factor_product *F);

#endif
