/* The measured error of an operator against converged references in double (contract, /error). */
#ifndef LAMBERT_METHOD_JUDGE_H
#define LAMBERT_METHOD_JUDGE_H

#include "solver/linalg/factor_product.h"
#include "solver/method/method.h"
#include "solver/operator/stated/error_figures.h"

/* Probes of random emission at most. */
enum { JUDGE_RANDOM_PROBES = 8 };

/* Probes of whole groups at most: held for the whole of a round, every two of them with a figure in each
 * group. */
size_t judge_whole_most(size_t n, size_t n_channels, size_t n_bins);

/* Single emissions of a round. */
size_t judge_at_once(size_t n);

/* The indirect errors that were asked for: those of receivers where these are known, else the means over all
 * elements. */
double judge_total(const error_group *g);
double judge_of_operator(const error_group *g);

/* The largest of uniform, near and far over the groups, of their elements that are read. */
typedef struct worst_group {
    size_t group;       /* n_groups: no such figure is known */
    int figure;         /* GROUP_UNIFORM, GROUP_NEAR or GROUP_FAR */
    double total;       /* against the reference; 0 where none is known */
    double of_operator; /* its part against the operator's own F; where it is not known as much as the rest */
} worst_group;
worst_group judge_worst_group(const group_errors *e);

/* The first bounce of a sky, [m][n], sr: the operator's, and two independent samples by which it is judged.
 */
typedef struct judged_sky {
    size_t n_tiles;
    const float *own, *samples[2];
    double own_share; /* of its variance in that of the mean of both samples; 1: nobody knows */
    /* first [count][n]: rows of a sample, 0 or 1, closer than by that, independent of the other's. NULL:
     * there are none. */
    lam_status (*tiles)(void *context, int sample, size_t count, const size_t *tiles, float *first,
                        lam_error *error);
    /* first [count]: of some elements and tiles, likewise. NULL: they are not known. */
    lam_status (*pairs)(void *context, int sample, size_t count, const size_t *elements, const size_t *tiles,
                        float *first, lam_error *error);
    void *tiles_context; /* of both */
    double own_ray;      /* sr that one of the operator's own rays by the cosine adds; 0: nobody knows */
    /* Of each the part that the ground sends is ground [n] times reflects [m], sr. NULL: there is none. */
    const double *ground, *reflects;
} judged_sky;

/* Skies by which it is judged: two that shine from everywhere, and single tiles. */
enum { JUDGE_EVEN_SKIES = 2, JUDGE_SUNS = 6 };

/* The other reference beside the independent one: a sample of the same quality, that shares nothing with it;
 * the same disturbed by a sample of its own noise; a coarser one, of which other_share of the distance is the
 * error of the independent one. */
typedef enum reference_relation { REFERENCE_TWIN, REFERENCE_DISTURBED, REFERENCE_COARSER } reference_relation;

typedef struct judge_input {
    const build_problem *problem;
    const double *row_sums; /* [n] of own */
    const float *emission;  /* [C][n], the scene's own */
    const float *read;      /* [n], weights of what is read, by element; NULL: all is read */
    const float *emits;     /* [n], above 0 of the elements that alone emit in probes; NULL: all */
    const uint32_t *group;  /* [n], below n_groups: groups of the scene; NULL: none emits as a whole */
    size_t n_groups;
    const bool *people;         /* [n_groups], groups that people light; NULL: those with emission alone */
    const judged_sky *sky;      /* NULL: none, or the scene is closed */
    group_errors *by_group;     /* filled with the errors in each group, if there is an independent F and
                                   `group`; NULL: not asked for */
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
    /* Set by judge_operator: elements that are judged by their irradiance (judge_black.h), and whether all
     * are. */
    bool *black;                /* [n]; NULL: none */
    bool all_black, black_read; /* all elements; all that is read */
} judge_input;

/* Measures. With x the correction of an answer by the reference, B = B~ + x, a squared error is |x|^2 less
 * the power of the noise in x, by a sample t of it (judge_figures.h). Of twins, x = (x_1 + x_2) / 2 and
 * t = (x_1 - x_2) / 2, which leaves <x_1, x_2>: in this the noise of two independent samples has no part on
 * average. Of a disturbed reference t is the distance of both solutions. Each of both has its own
 * first light, so that its noise and what bounces on of it are in t; without another reference of that
 * quality, t is rho D alone. Of a finer and a coarser reference the noise is stated alone. Cost: a converged
 * solve per probe and reference, started from the operator's own answer. */
lam_status judge_operator(const lam_operator *op, const judge_input *given, error_report *report,
                          lam_error *error);

#endif
