/* The hierarchical factorization: forecast of ranks and time, and the choice of levels and error bounds by
 * it. */
#ifndef LAMBERT_METHOD_LOW_RANK_HF_H
#define LAMBERT_METHOD_LOW_RANK_HF_H

#include "solver/method/low_rank/factorizer.h"

/* Forecasts the rank of m neighbouring columns of S at a threshold, from the singular values of a few
 * samples. */
typedef struct hf_forecast hf_forecast;

/* Takes samples at a few places of the column order. Freed by hf_forecast_free. Cost: about that of two
 * leaves. */
lam_status hf_forecast_create(const scaled_matrix *S, hf_forecast **out, lam_error *error);
void hf_forecast_free(hf_forecast *f);

/* Forecasts the number of m columns that a truncation at p keeps. */
double hf_forecast_rank(const hf_forecast *f, double m, double p);

typedef struct hf_plan {
    int levels;
    bool every; /* every level has nodes, as a rank is given; else those with an error bound above 0, and the
                   leaves and the root */
    double left[BUDGET_LEVELS_MOST + 1]; /* error bound of a node, by level */
    double kept[BUDGET_LEVELS_MOST + 1]; /* forecast rank of a node, by level */
} hf_plan;

/* Forecast of seconds on one core: Aguerre 2016, eq. 3.16 with the rank of each level in place of rho, and
 * with separate rates of Gram matrices, eigenvectors and products. Sets plan->kept. */
double hf_forecast_seconds(const hf_forecast *f, const factorizer_options *options, hf_plan *plan);

/* The next level below that has nodes: they are the children of those of this level. */
int hf_plan_below(const hf_plan *plan, int level);

/* The way through a tree: above level `alone` nodes are computed one after the other, each by all
 * threads, and from there on siblings at the same time. */
typedef struct hf_walk {
    size_t n;       /* rows of S */
    double entries; /* of a column of S */
    int alone;
    double threads;
} hf_walk;

/* Forecast of the bytes that a node of this level takes at its peak with all that is below it and its result,
 * by plan->kept: results of children that wait for each other, the columns of a leaf, Gram matrices and
 * eigenvectors. */
double hf_plan_bytes(const hf_plan *plan, const hf_walk *walk, int level);

/* The plan with the least forecast time, within what options prescribe, of those that keep to
 * options->memory while nodes are computed one after the other; if none does, the plan of the fewest bytes.
 */
hf_plan hf_forecast_plan(const hf_forecast *f, const factorizer_options *options);

#endif
