/* The number of elements of a store that are the backs of others, its last ones. Both programs read it. */
#ifndef LAMBERT_BASE_SCENE_BACKS_H
#define LAMBERT_BASE_SCENE_BACKS_H

#include "store/store.h"

#include <stdbool.h>

/* The end of the name of a group of backs: `floor.back` beside `floor`. */
#define SCENE_BACK ".back"

/* Reads the attributes for a mesh of n elements; two_sided: every element has its back or is one. Attributes
 * of /mesh that are not there mean that there are none. Errors: LAM_ERR_FORMAT. */
lam_status scene_backs_load(store *s, size_t n, size_t *n_backs, bool *two_sided, lam_error *error);

/* Writes the attributes. */
lam_status scene_backs_save(size_t n_backs, bool two_sided, store *s, lam_error *error);

#endif
