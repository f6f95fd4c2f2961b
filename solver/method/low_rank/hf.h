/* The hierarchical factorization's own choice: how many levels. */
#ifndef LAMBERT_METHOD_LOW_RANK_HF_H
#define LAMBERT_METHOD_LOW_RANK_HF_H

#include "solver/method/low_rank/factorizer.h"

/* What some columns of S are expected to keep: the rank of m neighbouring columns at a threshold, from the
 * singular values of a few samples of them. */
typedef struct hf_forecast hf_forecast;

/* Takes the samples, from some places on the curve. Freed by hf_forecast_free. Cost: as a leaf or two. */
lam_status hf_forecast_create(const scaled_matrix *S, hf_forecast **out, lam_error *error);
void hf_forecast_free(hf_forecast *f);

/* How many of m columns a truncation at p keeps, about. */
double hf_forecast_rank(const hf_forecast *f, double m, double p);

typedef struct hf_plan {
    int levels;
    double left[BUDGET_LEVELS_MOST + 1]; /* what a node of each level may leave out */
    double kept[BUDGET_LEVELS_MOST + 1]; /* columns it is expected to keep */
} hf_plan;

/* Seconds, about, on one core: eq. 3.16 with the rank of each level in place of rho, and with what a Gram
 * matrix, eigenvectors and a product each take. Fills in kept. */
double hf_forecast_seconds(const hf_forecast *f, const factorizer_options *options, hf_plan *plan);

/* The plan that is forecast to be fastest; what options give is kept. */
hf_plan hf_forecast_plan(const hf_forecast *f, const factorizer_options *options);

#endif
