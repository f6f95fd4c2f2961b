/* The checks of `lambert verify`: they test again the properties that a store states. */
#ifndef LAMBERT_VERIFY_VERIFY_H
#define LAMBERT_VERIFY_VERIFY_H

#include "solver/base/terminal.h"
#include "solver/formfactor/formfactor.h"
#include "solver/operator/operator.h"
#include "solver/operator/refine/form_factor_rows.h"
#include "solver/scene/mesh.h"

typedef enum verdict { VERDICT_OK, VERDICT_BROKEN, VERDICT_SKIPPED } verdict;

#define VERIFY_MAX 8

typedef struct check {
    const char *name;
    verdict verdict;
    char detail[480];
} check;

/* A store under examination; data that a check has loaded stays for the next. */
typedef struct examination {
    store *s;
    const char *scene; /* a scene file to compare with, or NULL */
    size_t probes;     /* 0: the error is not measured again */
    const progress *progress;
    mesh m;
    double *row_sums;
    form_factors f; /* kept ones, or regenerated */
    lam_operator *op;
    bool has_mesh;
} examination;

void examination_free(examination *e);

/* One check: fills verdict and detail, or fails when it could not be made (cancelled, out of memory). */
typedef lam_status verify_check(examination *e, check *c, lam_error *error);

verify_check verify_checksums, verify_mesh, verify_form_factors, verify_sky, verify_operator,
    verify_linearity, verify_energy, verify_error, verify_scene;

/* Sets a verdict with its detail. */
void check_say(check *c, verdict v, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* Turns an error of the examined store into a verdict; a lack of memory and a cancellation stay failures. */
lam_status check_failed(check *c, lam_status status, const lam_error *error);

#endif
