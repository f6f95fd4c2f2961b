/* The error of an operator against two new samples of the form factors, or, of blocks, against finer ones:
 * the one procedure of precompute and of verify. */
#ifndef LAMBERT_PRECOMPUTE_JUDGING_H
#define LAMBERT_PRECOMPUTE_JUDGING_H

#include "solver/formfactor/formfactor.h"
#include "solver/method/judge.h"
#include "solver/scene/mesh.h"

typedef struct judging {
    const mesh *m;
    const uint32_t *order;
    const build_problem *problem; /* with the F that the operator was built from */
    const form_factors *f;        /* of problem: its recipe and row sums */
    recipe halves[2];             /* of the two samples; of blocks the first is taken */
    const char *scratch_names[2];
    const char *stages[2]; /* for progress */
    scratch *scratch;      /* NULL: none */
    const large_place *large;
    uint64_t probes_seed, first_light_seed;
    size_t probes, probes_least; /* as in judge_input */
    const progress *progress;
    void (*sampled)(void *context, const form_factors *half); /* after each sample; or NULL */
    void *context;
} judging;

/* Errors: those of form_factors_make, first_light_create and judge_operator. */
lam_status judging_run(const judging *j, const lam_operator *op, error_report *out, lam_error *error);

#endif
