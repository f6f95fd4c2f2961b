/* The measured error of an operator against converged references in double (contract, /error). */
#ifndef LAMBERT_METHOD_JUDGE_H
#define LAMBERT_METHOD_JUDGE_H

#include "solver/linalg/factor_product.h"
#include "solver/method/method.h"

/* Probes of random emission, and those of a group, at most, that the reference's own noise is measured by, as
 * each of them is to be solved with both halves of the sample. */
enum { JUDGE_RANDOM_PROBES = 8, JUDGE_NOISE_PROBES = 8 };

/* Mean, standard deviation and largest value over the probes of a group. */
typedef struct error_figures {
    double mean, std, max;
} error_figures;

typedef struct error_group {
    size_t probes;                                      /* 0: nothing measured, nothing stored */
    error_figures total_relative, total_indirect;       /* against an independent sample of F */
    error_figures operator_relative, operator_indirect; /* against the very F that was factorized */
    double reference_noise; /* indirect: half the spread between the two halves of the independent sample */
    double negative_share;  /* power of negative radiosity over all, mean */
    double energy_balance;  /* |emitted - absorbed - left| / emitted, mean */
} error_group;

typedef struct error_report {
    error_group single, lights, random;
    bool has_total;
    double seconds;
} error_report;

typedef struct judge_input {
    const build_problem *problem;
    const double *row_sums;     /* [n] of own */
    const float *emission;      /* [C][n], the scene's own */
    factor_product own;         /* the very F that the operator was built from */
    factor_product independent; /* a better F that shares no sample with it, the mean of two samples or the
                                   finer of two; n = 0: no total error */
    factor_product halves[2];   /* those two, for the reference's own noise; n = 0: it is not measured */
    /* H = F E, [n], closer than by the independent sample, where few elements shine; *known is false where
     * many do. NULL: there is none. The reference then takes only the further bounces of that light from the
     * sample. */
    lam_status (*first_light)(void *context, const float *E, double *H, bool *known, lam_error *error);
    void *first_light_context;
    size_t probes; /* single elements */
    uint64_t seed;
    const progress *progress;
} judge_input;

/* Measures. Cost: a converged solve per probe and reference, started from the operator's own answer. */
lam_status judge_operator(const lam_operator *op, const judge_input *input, error_report *report,
                          lam_error *error);

/* /error of a store. */
lam_status judge_save(const error_report *report, store *s, lam_error *error);

#endif
