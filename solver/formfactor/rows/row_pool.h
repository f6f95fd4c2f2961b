/* Rows of form factors that threads find one element at a time and pack. With a scratch folder they go there
 * a block at a time. Knows nothing of how an element looks around. */
#ifndef LAMBERT_FORMFACTOR_ROWS_ROW_POOL_H
#define LAMBERT_FORMFACTOR_ROWS_ROW_POOL_H

#include "solver/base/bitset.h"
#include "solver/base/progress.h"
#include "solver/formfactor/recipe.h"
#include "solver/formfactor/rows/row_code.h"
#include "solver/formfactor/scratch.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/scene/mesh.h"

/* What one thread works with: the sums of the element it is at, and the packed rows of its chunk. */
typedef struct row_pool {
    double *sums; /* [n], all zero between elements */
    marks summed; /* where sums were added to */
    double *sky;  /* [m + 1], likewise zero: of the tiles of a sky and of the ground; NULL: none */
    uint8_t *bytes;
    size_t used, capacity;
} row_pool;

/* The element at hand sees this much more of another one. */
static inline void row_pool_add(row_pool *pool, uint32_t seen, double weight) {
    pool->sums[seen] += weight;
    marks_add(&pool->summed, seen);
}

/* What the element at hand sends out through these rays of a packet leaves the scene. */
static inline void row_pool_leave(row_pool *pool, const sky_bounce *sky, const ray_packet *rays,
                                  unsigned leaving, const double weight[VISIBILITY_PACKET]) {
    if (sky != NULL && leaving != 0) sky_bounce_add(sky, rays->direction, leaving, weight, pool->sky);
}

/* How one row is made: adds all that an element sees to the pool; leaving and absorbed are the shares that
 * met nothing or a back face. Called from many threads at once; must depend on the element alone. */
typedef struct row_maker {
    void (*make)(const void *context, size_t element, row_pool *pool, double *leaving, double *absorbed);
    const void *context;
    row_kind kind;       /* whether what is added are whole numbers */
    size_t rays;         /* of one element */
    double whole;        /* weight of all that it sends out */
    sky_bounce *sky;     /* takes what leaves by direction; NULL: nobody asks */
    const char *cheaper; /* what would need less memory: "fewer --rays" */
    const progress *progress;
    const char *stage;
    const mesh *m;
    const recipe *recipe;
    size_t only_first; /* elements of the order; the others' rows stay empty; 0: all, as with scratch */
    scratch *scratch;  /* NULL: all in memory */
    const char *scratch_name;
} row_maker;

/* Makes the rows of all elements, or of the first of the order; the same for any number of threads, with a
 * scratch folder and without, and whatever of them was there already. order is [n], the sequence in which
 * elements are worked on; leaving and absorbed are [n]. The caller frees rows with packed_rows_free. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_CANCELLED, and those of row_file.h; what is in the scratch folder by then stays
 * there. */
lam_status row_pool_make(const row_maker *maker, const uint32_t *order, packed_rows *rows, double *leaving,
                         double *absorbed, lam_error *error);

#endif
