/* Skies by which an operator and its first bounce are judged. Private to judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_SKY_H
#define LAMBERT_METHOD_JUDGE_SKY_H

#include "solver/method/judge/judge_sky_law.h"

/* Adds an even sky, a cloudy one of random radiances, and tiles drawn by the power that they send into the
 * scene, to the figures, and to sums where these are begun. The answer is the operator's to rho H0 by its own
 * first bounce; twins are lit by one sample each, so that the error of the first bounce is in the
 * figures and its noise is taken out. Where there are no twins the independent reference is lit by both, x is
 * the mean of its corrections, and half of their difference is noise beside that which the other reference
 * shows. Nothing is added where no tile sends any light. Errors:
 * those of guided_reference_each and of the operator. */
lam_status judge_sky_add(const lam_operator *op, const judge_input *input, figure_group *figures,
                         by_group_sums *bins, sky_law_sums *law, size_t *done, lam_error *error);

/* Fills the power of the tiles and, where they are not too many, the means over groups. Errors:
 * LAM_ERR_MEMORY. */
lam_status judge_sky_powers(const judge_input *input, group_errors *out, lam_error *error);

#endif
