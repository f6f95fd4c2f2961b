/* Parts of a scene that exchange no light, such as sealed rooms, as far as rays show. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_PARTS_H
#define LAMBERT_FORMFACTOR_VISIBILITY_PARTS_H

#include "solver/formfactor/visibility/visibility.h"

/* part [n] = the number of each element's part, and *count their number: two elements are in one part if rays
 * lead from one to the other, by way of others if need be. An element whose rays meet nothing, and that no
 * other one meets, is a part that counts, and its number is UNION_FIND_ALONE (union_find.h). An element casts
 * rays, one after the other and PARTS_RAYS at most, until it is in the largest part; so what parts have in
 * common may be missed where it is hardly seen, and no caller may take light between parts for impossible.
 * The same for any number of threads. Cost: two or three rays for each element where there is one part.
 * Errors: LAM_ERR_MEMORY. */
enum { PARTS_RAYS = 64 };
lam_status visibility_parts(const mesh *m, const visibility *v, uint32_t *part, size_t *count,
                            lam_error *error);

#endif
