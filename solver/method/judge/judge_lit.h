/* Light that is partly a sky's: emissions rho H0 by the operator's own first bounce and by both samples of
 * it, and the corrections of answers to them. Private to judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_LIT_H
#define LAMBERT_METHOD_JUDGE_LIT_H

#include "solver/method/judge/guided_reference.h"
#include "solver/method/judge/judge_figures.h"

/* Emissions of which skies are a part, in batches of `most` at most; [count][C][n] each. The caller fills E
 * and, of black elements, direct: by the operator's own first bounce, and by each sample; and B, the answers
 * to the first of them. */
typedef struct lit_probes {
    size_t most, count;
    float *E[3];
    float *direct[3]; /* NULL: no element is black */
    float *B;
    double *x[3]; /* by the independent reference and each sample; by the other one and the mean of both */
    bool twins, apart;
} lit_probes;

/* Errors: LAM_ERR_MEMORY. */
lam_status lit_probes_make(const judge_input *input, size_t most, lit_probes *out, lam_error *error);
void lit_probes_free(lit_probes *s);

/* Adds the light H0 of skies L [count][C][m] to an emission [count][C][n], as rho H0, and sets the direct
 * light of black elements (NULL: there are none). row [count]: the first bounce [n] of single tiles that are
 * known closer, which are then taken in place of first [m][n]; NULL: of none. */
void lit_probes_light(const judge_input *input, size_t count, const float *L, const float *first,
                      const float *const *row, float *E, float *direct);

/* The same for the operator's own first bounce and both samples, E[0 .. 2]. row: of each sample. */
void lit_probes_light_all(const judge_input *input, const float *L, const float *const *row[2],
                          lit_probes *s);

/* Fills B by converged answers with the operator's own F, of which an operator of few emitters has no others.
 * Errors: those of guided_reference_each. */
lam_status lit_probes_answer(const lam_operator *op, const judge_input *input, lit_probes *s,
                             lam_error *error);

/* Fills x: twins are lit by one sample each, so that the error of the first bounce is in the figures and its
 * noise is taken out. Where there are no twins the independent reference is lit by both, x is the mean of its
 * corrections, and half of their difference is noise beside that which the other reference shows. E[1] and
 * direct[1] become the means of both samples. Errors: those of guided_reference_each. */
lam_status lit_probes_solve(const lam_operator *op, const judge_input *input, lit_probes *s,
                            lam_error *error);

/* Probe v with its corrections; a view. */
figure_probe lit_probes_at(const judge_input *input, const lit_probes *s, size_t v);

#endif
