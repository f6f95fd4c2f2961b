/* The measured error of an operator against converged references in double (contract, /error). */
#ifndef LAMBERT_METHOD_JUDGE_H
#define LAMBERT_METHOD_JUDGE_H

#include "solver/linalg/factor_product.h"
#include "solver/method/method.h"

/* Probes that are solved together; of random emission at most. */
enum { JUDGE_AT_ONCE = 16, JUDGE_RANDOM_PROBES = 8 };

/* Mean, standard deviation and largest value over the probes of a group. */
typedef struct error_figures {
    double mean, std, max;
} error_figures;

typedef struct error_group {
    size_t probes;                                      /* 0: nothing measured, nothing stored */
    size_t operator_probes;                             /* of them, for the operator's own error */
    error_figures total_relative, total_indirect;       /* against an independent sample of F */
    error_figures operator_relative, operator_indirect; /* against the very F that was factorized */
    double reference_noise; /* indirect: standard error of total_indirect by the noise of the reference */
    bool is_bound; /* that is more than a third: the noise is not taken out, and total_... are bounds */
    double negative_share; /* power of negative radiosity over all, mean */
    double energy_balance; /* |emitted - absorbed - left| / emitted, mean */
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
    factor_product independent; /* an F that shares no sample with it; n = 0: no total error */
    /* Another one; n = 0: the noise of the reference is not measured. twins: both are independent samples of
     * the same quality. Else this one is coarser, and other_share of the distance between the solutions by
     * both is the error of that by `independent`. */
    factor_product other;
    bool twins;
    double other_share;
    /* H = F E, [n], closer than by these, where few elements shine; *known is false where many do. D [n]:
     * half the difference of two independent estimates whose mean is H. NULL: there is none. The reference
     * then takes only the further bounces of that light from the samples. */
    lam_status (*first_light)(void *context, const float *E, double *H, double *D, bool *known,
                              lam_error *error);
    void *first_light_context;
    size_t probes;       /* single elements at most */
    size_t probes_least; /* of them; 0: all. More are taken until the standard error of the mean of their
                            errors is below a tenth of that mean */
    uint64_t seed;
    const progress *progress;
} judge_input;

/* Measures. With x the correction of an answer by the reference, B = B~ + x, the squared error is |x|^2 less
 * the power of the noise in x, which is taken out of a group's mean square, and of its figures in proportion.
 * Of twins, x = (x_1 + x_2) / 2 and the noise is (x_1 - x_2) / 2, which leaves <x_1, x_2>: in this the noise
 * of two independent samples has no part on average. So is rho D, the noise of the first light. Of a finer
 * and a coarser reference the noise is stated alone. reference_noise is the standard error that is left: of
 * |x|^2 it is sqrt(sum 4 (A x t)^2) over all elements, t being the noise that was taken out. Cost: a
 * converged solve per probe and reference, started from the operator's own answer. */
lam_status judge_operator(const lam_operator *op, const judge_input *input, error_report *report,
                          lam_error *error);

/* /error of a store. */
lam_status judge_save(const error_report *report, store *s, lam_error *error);

#endif
