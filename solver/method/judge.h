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

/* Errors of the light of receivers, |B~ - B|_w / |B|_w with |x|_w^2 = sum over probes, channels and elements
 * of A w x^2, w the weights of what is read: the errors of all probes together, as receivers see next to
 * nothing of many a single element. */
typedef struct receiver_figures {
    bool known; /* false: all is read, or there is no such light */
    double total_relative, total_indirect, operator_indirect;
    double noise; /* error of the reference, likewise; above a third of total_indirect it is in the figures of
                     total, which is_bound then calls upper bounds */
    bool is_bound;
} receiver_figures;

typedef struct error_group {
    size_t probes;                                      /* 0: nothing measured, nothing stored */
    size_t operator_probes;                             /* of them, for the operator's own error */
    error_figures total_relative, total_indirect;       /* against an independent sample of F */
    error_figures operator_relative, operator_indirect; /* against the very F that was factorized */
    double reference_noise; /* standard error of the mean of total_indirect by the noise of the reference */
    double probes_noise;    /* the same by the choice of probes; negative: of one probe nobody knows */
    /* The noise of the reference is more than a third of the mean: it is not taken out, and the figures of
     * total are upper bounds, with twice their standard error added. */
    bool is_bound;
    double negative_share; /* power of negative radiosity over all, mean */
    double energy_balance; /* |emitted - absorbed - left| / emitted, mean */
    receiver_figures receivers;
} error_group;

/* The indirect errors that were asked for: those of receivers where these are known, else the means over all
 * elements. */
double judge_total(const error_group *g);
double judge_of_operator(const error_group *g);

typedef struct error_report {
    error_group single, lights, random;
    bool has_total;
    double seconds;
} error_report;

/* The other reference beside the independent one: a sample of the same quality, that shares nothing with it;
 * the same disturbed by a sample of its own noise; a coarser one, of which other_share of the distance is the
 * error of the independent one. */
typedef enum reference_relation { REFERENCE_TWIN, REFERENCE_DISTURBED, REFERENCE_COARSER } reference_relation;

typedef struct judge_input {
    const build_problem *problem;
    const double *row_sums;     /* [n] of own */
    const float *emission;      /* [C][n], the scene's own */
    const float *read;          /* [n], weights of what is read, by element; NULL: all is read */
    const float *emits;         /* [n], above 0 of the elements that alone emit in probes; NULL: all */
    factor_product own;         /* the very F that the operator was built from */
    factor_product independent; /* an F that shares no sample with it; n = 0: no total error */
    factor_product other;       /* another one; n = 0: the noise of the reference is not measured */
    reference_relation relation;
    double other_share; /* of REFERENCE_COARSER */
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

/* Measures. With x the correction of an answer by the reference, B = B~ + x, a squared error is |x|^2 less
 * the power of the noise in x, by a sample t of it (judge_figures.h). Of twins, x = (x_1 + x_2) / 2 and
 * t = (x_1 - x_2) / 2, which leaves <x_1, x_2>: in this the noise of two independent samples has no part on
 * average. Of a disturbed reference t is the distance of both solutions. To t comes rho D, the noise of the
 * first light. Of a finer and a coarser reference the noise is stated alone. Cost: a converged solve per
 * probe and reference, started from the operator's own answer. */
lam_status judge_operator(const lam_operator *op, const judge_input *input, error_report *report,
                          lam_error *error);

/* /error of a store. */
lam_status judge_save(const error_report *report, store *s, lam_error *error);

#endif
