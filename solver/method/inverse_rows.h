/* A sample of rows of M - I, exact to single precision, against which operators of unlike kinds are compared
 * before one of them is taken. */
#ifndef LAMBERT_METHOD_INVERSE_ROWS_H
#define LAMBERT_METHOD_INVERSE_ROWS_H

#include "solver/method/method.h"

/* Rows of positions k n / count, [count][n] by position, of the first channel. A row with rho = 0 is as if
 * rho were 1 there. */
typedef struct inverse_rows {
    size_t n, count;
    float *rows;
    double square, sum; /* over all entries of the sample */
} inverse_rows;

void inverse_rows_free(inverse_rows *r);

/* Solves for columns, which are rows by reciprocity: A_i/rho_i (M - I)_ij is symmetric. Cost: a few dozen
 * products of F with a block of vectors. Errors: those of many_lights_solve. */
lam_status inverse_rows_find(const build_problem *problem, const float *rho, const progress *p,
                             inverse_rows *out, lam_error *error);

/* The factor from row k at a position to the column: (M - I)_ji = factor (M - I)_ij. */
double inverse_rows_factor(const inverse_rows *r, const build_problem *problem, const float *rho, size_t k,
                           size_t position);

/* Errors of an operator by the sample: of reflected light, area-weighted, in the 2-norm.
 * single: the mean over the sampled elements, each of which emits alone;
 * groups: the mean over the groups of a problem that has some, each of which emits evenly, as the sampled
 * elements receive it; 0 where the problem has none. */
typedef struct sampled_errors {
    double single, groups;
} sampled_errors;

/* Sums of squares over the sampled elements, of the largest groups of a problem; none where it has no groups.
 */
enum { SAMPLED_GROUPS = 16 };
typedef struct sampled_groups {
    size_t count;
    uint32_t group[SAMPLED_GROUPS];
    double missing[SAMPLED_GROUPS], light[SAMPLED_GROUPS];
} sampled_groups;

/* Errors: LAM_ERR_MEMORY. */
lam_status sampled_groups_find(const build_problem *problem, sampled_groups *g, lam_error *error);
/* The irradiance of a row by each of the groups: sums of its entries, by position, over their elements. */
void sampled_groups_sum(const sampled_groups *g, const build_problem *problem, const float *row,
                        double sums[SAMPLED_GROUPS]);
/* Adds an element of an area, which receives light[k] of group k, of which missing[k] is missing. */
void sampled_groups_add(sampled_groups *g, double area, const double *missing, const double *light);
double sampled_groups_mean(const sampled_groups *g);

/* Errors of an operator that is built, of any kind. Errors: LAM_ERR_MEMORY. */
lam_status operator_sampled_errors(const build_problem *problem, const lam_operator *op,
                                   const inverse_rows *truth, sampled_errors *out, lam_error *error);

#endif
