/* The error of an operator against two new samples of the form factors, or, of blocks, against finer ones:
 * the one procedure of precompute and of verify. */
#ifndef LAMBERT_PRECOMPUTE_JUDGING_H
#define LAMBERT_PRECOMPUTE_JUDGING_H

#include "solver/formfactor/formfactor.h"
#include "solver/method/judge/judge.h"
#include "solver/scene/mesh.h"

/* The references of a judge, which do not depend on the operator: two samples of form factors, or finer
 * blocks, and the first light. Mesh, order and tree of its judging must outlive them. */
typedef struct judge_references judge_references;
void judge_references_free(judge_references *r);
void judge_references_free_samples(judge_references *r); /* the form factors; r may be NULL */

/* Bytes in memory; of NULL 0. */
double judge_references_bytes(const judge_references *r);

typedef struct judging {
    const mesh *m;
    const uint32_t *order;
    const build_problem *problem;  /* with the F that the operator was built from */
    const form_factors *f;         /* of problem: its recipe and row sums */
    const face_openings *openings; /* through which the sky is sampled; NULL: those of the mesh */
    importance *importance;        /* with which blocks were found; NULL: all is read, and emits */
    recipe halves[2];              /* of the two samples; of blocks the first is taken */
    const char *scratch_names[2];
    const char *stages[2]; /* for progress */
    scratch *scratch;      /* NULL: none */
    const large_place *large;
    uint64_t probes_seed, first_light_seed;
    size_t probes, probes_least; /* as in judge_input */
    group_errors *by_group; /* filled with the errors in each group of the mesh, for which whole groups are
                               probes, too; NULL: not asked for */
    const progress *progress;
    void (*sampled)(void *context, const form_factors *half); /* after each sample that was made; or NULL */
    void *context;
    judge_references **kept; /* NULL, or where the references stay for another operator of the same scene:
                                of those of before, NULL at first, the form factors are taken where their
                                recipes are the same, and the first light. Figures are those of new
                                references, bit by bit */
} judging;

/* Errors: those of form_factors_make, first_light_create and judge_operator. */
lam_status judging_run(const judging *j, const lam_operator *op, error_report *out, lam_error *error);

#endif
