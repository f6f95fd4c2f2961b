/* The groups of a scene as JSON, for clients that light, paint and count them. */
#ifndef LAMBERT_SERVER_SCENE_GROUP_LIST_H
#define LAMBERT_SERVER_SCENE_GROUP_LIST_H

#include "solver/codec/buffer.h"
#include "store/store.h"

typedef struct scene scene;

/* *out [n_groups][C], freed by the caller: the mean by area of the scene's own emission (/mesh/emission) over
 * the elements of each group that figures take in, in W/m^2 or lm/m^2 as the store counts; NaN for a group
 * without such elements. The groups and areas of the scene are there. Takes 4 n C bytes while it reads. O(n
 * C). Errors: those of store_read. */
lam_status group_emission_read(store *s, const scene *of, double **out, lam_error *error);

/* Sets *out (empty before) to the JSON of GET /v1/scenes/NAME/groups, a line with its end. O(n C). Errors:
 * LAM_ERR_MEMORY. */
lam_status group_list_write(const scene *of, buffer *out, lam_error *error);

#endif
