/* The elements of a store that lie between a body and the face that it stands on. Both programs read them. */
#ifndef LAMBERT_BASE_SCENE_BURIED_H
#define LAMBERT_BASE_SCENE_BURIED_H

#include "store/store.h"

#include <stdbool.h>

/* Reads /mesh/buried of a mesh of n elements: *buried [n], which the caller frees, or NULL where there is
 * none, as in older stores. Errors: LAM_ERR_FORMAT (an element that is not there, or out of order),
 * LAM_ERR_DAMAGED, LAM_ERR_MEMORY. */
lam_status scene_buried_load(store *s, size_t n, bool **buried, lam_error *error);

/* Writes the numbers of the elements that are marked in buried [n]; NULL: writes nothing. */
lam_status scene_buried_save(const bool *buried, size_t n, store *s, lam_error *error);

#endif
