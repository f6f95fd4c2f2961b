/* The errors of probes in each group of the scene (group_errors). Private to judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_BY_GROUP_H
#define LAMBERT_METHOD_JUDGE_BY_GROUP_H

#include "solver/method/judge/judge_figures.h"
#include "solver/method/judge/judge_probes.h"

/* Sums over probes in one bin, a row of one group: of squares of errors and of the noise in them. */
typedef struct bin_sums {
    double area, squares; /* sum A, sum A^2 */
    /* Single elements give e^2 N / P^2, and e^2; these are of the mean of the bin, and of the mean square in
     * it. */
    double mean_one, mean_one_noise, mean_all, mean_all_noise;
    double rms_one, rms_one_noise, rms_all, rms_all_noise;
    /* Means have errors, the noise of these, reflected light, and the largest ratio. */
    double off[3], noise[3], light[3], largest[3];
} bin_sums;

/* A probe in which many elements shine together: e^2 / P^2 in each bin, less the noise where that is small.
 */
typedef struct even_probe {
    double per_number;  /* 1 / N */
    double *mean, *rms; /* [n_bins] */
} even_probe;

typedef struct by_group_sums {
    size_t n, n_groups, n_rows; /* n: elements; 0: nothing is summed */
    const uint32_t *group;
    const float *read;
    size_t n_single;
    double power;     /* sum of P^2 / N of single elements */
    bin_sums *bins;   /* [n_rows][n_groups] */
    double *work;     /* two numbers of all bins, of a channel and of a probe */
    even_probe *even; /* [even_most] */
    size_t n_even, even_most;
} by_group_sums;

/* Numbers of a bin for one probe, channels stacked: the squared error of its mean, the noise in it, and the
 * same noise where that of its elements is independent; the mean square error of its elements, the noise, and
 * the square of what the rest may be off by it; the squared mean of the reflected light, and the mean of its
 * squares. */
enum {
    BIN_MEAN,
    BIN_MEAN_NOISE,
    BIN_MEAN_APART,
    BIN_RMS,
    BIN_RMS_NOISE,
    BIN_RMS_SPREAD,
    BIN_LIGHT,
    BIN_LIGHT_RMS,
    BIN_NUMBERS
};

/* Room for so many probes of whole groups, and for one of the scene's own light. Errors: LAM_ERR_MEMORY. */
lam_status by_group_begin(const judge_input *input, size_t whole, by_group_sums *out, lam_error *error);

/* The number of bins, and that of an element. */
static inline size_t by_group_bins(const by_group_sums *s) {
    return s->n_rows * s->n_groups;
}

static inline size_t by_group_bin(const by_group_sums *s, size_t i) {
    return s->group[i] + (s->read != NULL && !(s->read[i] > 0) ? s->n_groups : 0);
}

/* The square of an error without the noise in it, where that is at most a ninth of the rest. */
double square_without_noise(double e2, double noise);

/* Adds a probe of a group of probes, JUDGE_... Cost: O(C n). */
void by_group_add(const figure_probe *p, int kind, by_group_sums *to);

/* The numbers of a probe that is not added, [n_bins][BIN_NUMBERS]; valid until the next one. Cost: O(C n). */
const double *by_group_numbers(const figure_probe *p, by_group_sums *with);

/* of [GROUP_FIGURES], each [n_rows][n_groups]. Errors: LAM_ERR_MEMORY, after which of is untouched. */
lam_status by_group_finish(const by_group_sums *sums, double **of, lam_error *error);
void by_group_free(by_group_sums *sums);

#endif
