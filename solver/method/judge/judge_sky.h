/* Skies by which an operator and its first bounce are judged. Private to judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_SKY_H
#define LAMBERT_METHOD_JUDGE_SKY_H

#include "solver/method/judge/judge_sky_law.h"

/* Adds an even sky, a cloudy one of random radiances, and tiles drawn by the power that they send into the
 * scene, to the figures, and to sums where these are begun. The answer is the operator's to rho H0 by its own
 * first bounce, and of an operator of few emitters that of the F from which their light was found
 * (judge_lit.h). Nothing is added where no tile sends any light, or where the operator answers no sky.
 * Errors: those of guided_reference_each and of the operator. */
lam_status judge_sky_add(const lam_operator *op, const judge_input *input, figure_group *figures,
                         by_group_sums *bins, sky_law_sums *law, size_t *done, lam_error *error);

/* Tiles of which the first bounce is worth finding closer, for n elements. */
size_t judge_sky_tiles(size_t n);

/* False where the operator answers to few emitters none of which is of the sky. */
bool judge_sky_is_asked(const lam_operator *op);

/* Fills the power of the tiles and, where they are not too many, the means over groups. Errors:
 * LAM_ERR_MEMORY. */
lam_status judge_sky_powers(const judge_input *input, group_errors *out, lam_error *error);

#endif
