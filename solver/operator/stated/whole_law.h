/* The errors of light that whole groups emit evenly, which a store states by themselves and together
 * (error_figures.h, whole_rms), and what else of an emission has the law of its size. */
#ifndef LAMBERT_OPERATOR_STATED_WHOLE_LAW_H
#define LAMBERT_OPERATOR_STATED_WHOLE_LAW_H

#include "solver/operator/stated/error_law.h"

/* Finds the groups that E [C][n] lets shine evenly, in any channel, and the size of the rest. *out is zeroed
 * where no such group is stated. Cost: O(C n). False when memory is short. Freed by whole_light_free. */
bool whole_light_find(const error_by_group *e, const error_scene *scene, const float *E, whole_light *out);
void whole_light_free(whole_light *w);

/* Sets the mesh's part by the weights (mesh_whole_of). */
void whole_light_set_mesh(const error_by_group *e, whole_light *w);

/* The place of a group among those that are stated; WHOLE_NONE: it is none of them. */
#define WHOLE_NONE UINT32_MAX
uint32_t whole_place(const error_by_group *e, size_t group);

/* The squared errors of a bin by weights [C][n_whole], W/m^2: those of different channels are means over
 * them, e^2 = 1/C sum_c w_c' K w_c, at least a quarter of the sum over groups alone, as K has the luck of one
 * operator in it; and that of the mean of a bin at least what independent errors of its elements leave of it.
 * Cost: O(C m^2) of m groups that shine. */
bin_error whole_law(const error_by_group *e, const double *weights, size_t bin);

#endif
