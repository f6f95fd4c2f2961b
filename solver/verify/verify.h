/* The checks of `lambert verify`: they test again the properties that a store states. */
#ifndef LAMBERT_VERIFY_VERIFY_H
#define LAMBERT_VERIFY_VERIFY_H

#include "solver/base/terminal.h"
#include "solver/formfactor/formfactor.h"
#include "solver/operator/operator.h"
#include "solver/operator/refine/form_factor_rows.h"
#include "solver/operator/stated/error_figures.h"
#include "solver/scene/mesh.h"

typedef enum verdict { VERDICT_OK, VERDICT_BROKEN, VERDICT_SKIPPED } verdict;

typedef struct check {
    const char *name;
    verdict verdict;
    char detail[480];
} check;

/* The operator's mean irradiance of a group or of one element in a channel, beside that of walks. */
typedef struct walk_comparison {
    const char
        *emission;     /* the name of the group or of the emitter that emits alone; or "uniform", "mixture" */
    bool dark;         /* no walk came from the emission to any element */
    const char *group; /* NULL: a single element */
    size_t element;    /* without a group */
    size_t channel;
    double answer, mean, error; /* the operator's, that of the walks, its standard error */
    double score;               /* (answer - mean) / error, as walk_score says */
    double beyond; /* |score| of the part of the difference beyond the stated error; 0: within it */
} walk_comparison;

/* The name of its group, or "element 17", for which text is. */
const char *walk_comparison_target(const walk_comparison *w, char text[32]);

/* A store under examination; data that a check has loaded stays for the next. */
typedef struct examination {
    store *s;
    const char *scene;  /* a scene file to compare with, or NULL */
    const char *assets; /* folder of files that it names, or NULL */
    size_t probes;      /* 0: the error is not measured again */
    size_t walks;       /* of each emission and from each element; 0: none */
    const progress *progress;
    mesh m;
    double *row_sums;
    form_factors f; /* kept ones, or regenerated: with rows, or blocks in their place */
    plane_tree tree;
    block_factors blocks;
    importance importance; /* n is 0 where all is read, and emits; loaded with the operator */
    error_report stated;   /* by the store; a figure that it does not state is negative */
    lam_operator *op;
    bool has_mesh;
    walk_comparison *compared; /* [n_compared] by verify_walks; the channels of a mean stand together */
    size_t n_compared;
} examination;

void examination_free(examination *e);

/* One check: fills verdict and detail, or fails when it could not be made (cancelled, out of memory). */
typedef lam_status verify_check(examination *e, check *c, lam_error *error);

verify_check verify_checksums, verify_mesh, verify_form_factors, verify_sky, verify_luminaires,
    verify_sensors, verify_operator, verify_linearity, verify_energy, verify_error, verify_walks,
    verify_scene;

/* Numbers of one emission: a channel has one for each element, or, of an operator of emitters, a weight each.
 */
size_t examination_inputs(const examination *e);

/* The operator's answer [m][C][n] to m emissions, which the caller frees. Errors: LAM_ERR_MEMORY. */
lam_status examination_apply(const examination *e, size_t m, lam_quantity quantity, const float *E,
                             float **out, lam_error *error);

/* True where there is no operator to test, which the verdict then says. */
bool examination_skips(const examination *e, check *c);

/* Sets a verdict with its detail. */
void check_say(check *c, verdict v, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* Turns an error of the examined store into a verdict; a lack of memory and a cancellation stay failures. */
lam_status check_failed(check *c, lam_status status, const lam_error *error);

#endif
