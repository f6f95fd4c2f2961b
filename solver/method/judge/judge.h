/* The measured error of an operator against converged references in double (contract, /error). */
#ifndef LAMBERT_METHOD_JUDGE_H
#define LAMBERT_METHOD_JUDGE_H

#include "solver/linalg/factor_product.h"
#include "solver/method/method.h"

/* Probes of random emission, and of whole groups, at most. */
enum { JUDGE_RANDOM_PROBES = 8, JUDGE_WHOLE_PROBES = 3 };

/* Single emissions of a round. */
size_t judge_at_once(size_t n);

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

/* The errors in each group of the scene, for answers to any emission E of power P = sum A E (per channel,
 * squares added up) and effective number of emitters N = P^2 / sum A^2 E^2. In double; [n_rows][n_groups]:
 * row 0 is of the elements of a group, or of those that are read, row 1 then of its others. Zeroed: nothing
 * is known.
 *
 * The error of an answer, of the mean of a group or the root of the mean square of its elements, is about
 *     P sqrt(one^2 / N^2 + many^2 (1 - 1/N) / N + even^2),
 * in which errors of the light of single elements are independent: they add up in squares, to many^2 / N,
 * where those of one element of any size are one^2, and even is what whole groups and the scene's own lights
 * are off beyond that. */
enum {
    GROUP_MEAN_ONE,
    GROUP_MEAN_MANY,
    GROUP_MEAN_EVEN,
    GROUP_RMS_ONE,
    GROUP_RMS_MANY,
    GROUP_RMS_EVEN,
    /* For people: errors of the mean of a group over the reflected light in it, over all probes together and
     * the largest, by random emission, by elements that light it at least as much as the whole scene, and by
     * those that light it less. */
    GROUP_UNIFORM,
    GROUP_UNIFORM_LARGEST,
    GROUP_NEAR,
    GROUP_NEAR_LARGEST,
    GROUP_FAR,
    GROUP_FAR_LARGEST,
    GROUP_FIGURES
};

/* The same of skies. With Q_t the power that radiance 1 of tile t sends into the scene after the first
 * bounce, M the mean of radiances L weighted by Q, and f_t the mean first bounce of a group, let P = sum_t
 * L_t Q_t,  S = sum_t Q_t (L_t - M)^2,  D = rho^2 sum_t f_t (L_t - M)^2, their squares and S, D added up over
 * channels, rho the mean reflectance of the group. The error is about sqrt(direct^2 D + tiles^2 S + even^2
 * P^2). Rays that meet a tile, and with them the noise of the direct light, are as many as it is bright, so
 * that squared errors of direct light grow as D; where all of a window is seen, what one tile has too much
 * another has not, and an even sky is off by far less.
 *
 * That is the law of all tiles alike. The errors of single ones are known better (judge_sky_tiles.h): with
 * d_t, or of the mean of a group d'_t, the squared error of the first bounce of a tile there, and w_t that of
 * the power that it sends into the scene, which bounces into the group as the light of single tiles does,
 *     D = rho^2 sum_t d_t (L_t - M)^2,    W = sum_t w_t (L_t - M)^2
 * are the square of the error D + bounced^2 W + tiles^2 S + even^2 P^2. */
enum {
    SKY_MEAN_TILES,
    SKY_MEAN_EVEN,
    SKY_MEAN_BOUNCED,
    SKY_RMS_TILES,
    SKY_RMS_EVEN,
    SKY_RMS_BOUNCED,
    SKY_FIGURES
};
typedef struct group_errors {
    size_t n_groups, n_rows;
    double *of[GROUP_FIGURES];
    /* The part of them that is against the very F of the operator, by its share of the error of those probes
     * that are compared with it. Not stored. */
    double *of_operator[GROUP_FIGURES];
    double *sky[SKY_FIGURES]; /* [n_rows][n_groups]; NULL: no sky was judged */
    double sky_direct;        /* of all groups alike; 0 where sky_first is NULL: tiles have it all */
    size_t n_channels, n_tiles;
    double *sky_power; /* [C][n_tiles], Q_t = sum A rho first_bounce_t, m^2 sr */
    double *sky_first; /* [n_groups][n_tiles], mean first_bounce_t over a group, sr; NULL: too many numbers */
    double *sky_elements_off, *sky_means_off; /* [n_groups][n_tiles], d_t and d'_t, sr^2; NULL: likewise */
    double *sky_power_off;                    /* [C][n_tiles], w_t, m^4 sr^2 */
} group_errors;
void group_errors_free(group_errors *e);

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

typedef struct error_report {
    error_group single, lights, random;
    error_group whole; /* one whole group of the scene emits evenly */
    error_group sky;   /* only a sky shines; against the independent sample alone */
    bool has_total;
    double seconds;
} error_report;

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

/* /error/by_group of a store. */
lam_status judge_save_groups(const group_errors *e, store *s, lam_error *error);

/* /error of a store, without by_group. */
lam_status judge_save(const error_report *report, store *s, lam_error *error);

#endif
