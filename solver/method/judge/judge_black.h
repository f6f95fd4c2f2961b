/* The elements that are judged by their irradiance. Where nothing is reflected there is no error of the
 * radiosity, and irradiance is what is asked for: in a group of the scene that reflects nothing H stands for
 * B, as if rho were 1 in those rows alone (contract, /operator). Private to judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_BLACK_H
#define LAMBERT_METHOD_JUDGE_BLACK_H

#include "solver/method/judge/judge.h"

/* Fills input->black with a new array [n], of judge_black_free, all_black and black_read: elements of groups
 * that reflect nothing in any channel, without groups all or none. NULL where there are none. Cost: O(C n).
 * Errors: LAM_ERR_MEMORY. */
lam_status judge_black_find(judge_input *input, lam_error *error);
void judge_black_free(judge_input *input);

static inline bool judge_is_black(const judge_input *input, size_t i) {
    return input->black != NULL && input->black[i];
}

/* rho of a channel, and 1 where elements are judged by their irradiance. */
static inline double judge_reflectance(const judge_input *input, size_t c, size_t i) {
    return judge_is_black(input, i) ? 1 : (double)input->problem->reflectance[c * input->problem->n + i];
}

/* The part of the light of an element that is of use to others: rho, and 1 where nothing in the scene
 * reflects, so that powers of skies are those of the irradiance. */
static inline double judge_power_share(const judge_input *input, size_t c, size_t i) {
    return input->all_black ? 1 : (double)input->problem->reflectance[c * input->problem->n + i];
}

#endif
