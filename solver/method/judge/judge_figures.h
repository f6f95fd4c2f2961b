/* The figures of a group of probes, the noise of the reference in them, and the standard error of their mean
 * by that noise and by the choice of probes. Private to judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_FIGURES_H
#define LAMBERT_METHOD_JUDGE_FIGURES_H

#include "solver/method/judge/judge.h"

/* Elements are taken together in so many parts of the mesh order, within which noise may be correlated. */
enum { FIGURE_PARTS = 64 };

/* An answer, and its corrections. */
typedef struct figure_probe {
    const build_problem *problem;
    const float *E, *B;   /* [C][n] */
    const double *x, *y;  /* [C][n] corrections by the reference and the other one; y: NULL: not known */
    const double *spread; /* [C][n] of the first light; NULL: none */
    const double *noise;  /* [C][n] in x, beside that between x and y; NULL: none */
    const bool *black;    /* [n], true of elements whose B and x are of the irradiance; NULL: none */
    bool all_black;       /* such are all that figures of the whole scene are of; else they have none there */
    const float *direct;  /* [C][n] irradiance of black elements that comes from no element; NULL: 0 */
    reference_relation relation;
    double other_share;
} figure_probe;

/* Element k % n has these numbers in channel k / n: B, B - E, the error x, the noise t in it, that of the
 * first light, and the error of x by the coarser reference. For a black element H stands for B, and H less
 * what is direct for B - E. */
typedef struct figure_number {
    double b, bounced, off, noise, light, apart;
} figure_number;
figure_number figure_number_at(const figure_probe *p, size_t k);

/* Sums over the figures f of one sort: with the noise in them, or without it. */
typedef struct figure_sums {
    double f, f2, most;         /* of f, of f^2; the largest f */
    double noise[FIGURE_PARTS]; /* of df by the noise of each part */
} figure_sums;

typedef struct figure_tally {
    size_t tried, count;         /* probes, those that have such a figure */
    figure_sums plain, less;     /* with the noise, without it */
    double bound;                /* the largest f + 2 df, with the noise */
    double coarse, coarse_plain; /* sums over the probes with y: error by the coarser reference, f */
} figure_tally;

typedef struct figure_group {
    figure_tally relative, indirect; /* of the bright, of the lit probes */
} figure_group;

/* Sums over probes of the squares of receivers' light, of errors and of the noise in them. */
typedef struct receiver_sums {
    double b, bounced, off, noise;
    double apart, apart_bounced; /* over the probes with y, of the coarser reference */
} receiver_sums;

/* Adds a probe by the weights read [n]. Cost: O(C n). */
void receivers_add(const figure_probe *p, const float *read, receiver_sums *to);

/* The total figures, and the operator's own. */
receiver_figures receivers_of(const receiver_sums *total, const receiver_sums *own);

/* Adds a probe. An element that nothing sees has no indirect light to be wrong about, and is not lit. Cost:
 * O(C n). */
void figures_add(const figure_probe *p, figure_group *to);

/* The standard error of the mean figure by the noise of the reference; bound: of the figures with that noise
 * in them.
 *
 * A figure f = |x| / |d| has the noise t of x in both: d = B - E or B has x as a part. To first order
 *     d(f^2) = sum_i z_i,   z_i = 2 A_i (x_i - f^2 d_i) t_i / |d|^2,
 * and df = d(f^2) s / sigma with sigma^2 = sum_k (sum_{i in k} z_i)^2 over parts k of the elements and s the
 * larger distance of f to sqrt(f^2 +- sigma): sigma / (2 f) where that is small, sqrt(sigma) where f is lost
 * in it. So a dark element, all noise, weighs as it does in the mean: f +- about f. The mean of m figures has
 *     variance = sum_k (sum_p df_pk / m)^2 (1 + repeated),
 * whatever part of the noise the probes share, as t is one sample of the noise of all of them, and that of
 * different parts is independent. repeated: of single elements, the share of all that are probes, as
 * A_e F_ei has the noise of A_i F_ie: the light of e at i and, if i is a probe, of i at e; else 0. The
 * coarser reference adds its mean error over mean figure, where it is known, times the mean figure. Measured:
 * .65 to 1.6 times the spread of stated means over seeds, of rooms, soups and cities of 36 to 516 elements,
 * those with dark elements included. */
double figures_noise(const figure_tally *t, double repeated, bool bound);

/* The standard error of the mean by the choice of the probes among `all` (0: endless many), drawn without
 * repetition: that of a mean, times sqrt(1 - tried / all). Negative where a single one was tried. */
double figures_spread(const figure_tally *t, size_t all);

/* The figures without the noise. */
error_figures figures_mean(const figure_tally *t);

/* Upper bounds, with the noise in them and twice their standard error, `noise` of the mean. */
error_figures figures_bound(const figure_tally *t, double noise);

#endif
