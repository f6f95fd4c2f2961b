/* Packed rows of form factors, computed by threads one element at a time and, with a scratch folder, written
 * to it a block at a time. Knows nothing of rays or hemicubes: a row_maker computes a row. */
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

/* The work area of one thread: the sums of the present element, and the packed rows of its chunk. */
typedef struct row_pool {
    double *sums;  /* [n], all zero between elements */
    bitset summed; /* where sums were added to */
    double *sky;   /* [m + 1], zero between elements: sums of the tiles and of the ground; NULL: no sky */
    double whole;  /* weight of all rays of the present element: that of the maker unless make changes it */
    uint8_t *bytes;
    size_t used, capacity;
} row_pool;

/* Adds the weight of rays of the present element that hit another one. */
static inline void row_pool_add(row_pool *pool, uint32_t seen, double weight) {
    pool->sums[seen] += weight;
    bitset_add(&pool->summed, seen);
}

/* Adds to the sky the weights of those rays of a packet that leave the scene. */
static inline void row_pool_leave(row_pool *pool, const sky_bounce *sky, const ray_packet *rays,
                                  unsigned leaving, const double weight[VISIBILITY_PACKET]) {
    if (sky != NULL && leaving != 0) sky_bounce_add(sky, rays->direction, leaving, weight, pool->sky);
}

/* Computes a row: make adds the weights of the elements that one element sees to the pool and returns the
 * shares of its rays that leave the scene or hit a back face. It is called from many threads and must depend
 * on the element alone. */
typedef struct row_maker {
    void (*make)(const void *context, size_t element, row_pool *pool, double *leaving, double *absorbed);
    const void *context;
    row_kind kind;       /* ROW_COUNTS where all weights are whole numbers */
    size_t rays;         /* of one element */
    double whole;        /* weight of all rays of one element */
    sky_bounce *sky;     /* bins of the rays that leave; NULL: no sky */
    const char *cheaper; /* advice for the message that memory is out: "fewer --rays" */
    const progress *progress;
    const char *stage;
    const mesh *m;
    const recipe *recipe;
    size_t only_first; /* computes the rows of this many elements of the order, the others stay empty; 0 or
                          with a scratch folder: all */
    scratch *scratch;  /* NULL: all in memory */
    const char *scratch_name;
} row_maker;

/* Computes the rows of all elements, or of the first ones of the order. The result is the same for any number
 * of threads, with and without a scratch folder, and for an interrupted run. order is [n], the sequence in
 * which elements are worked on; leaving and absorbed are [n]. The caller frees rows with packed_rows_free.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED, and those of row_file.h; finished blocks stay in the scratch
 * folder. */
lam_status row_pool_make(const row_maker *maker, const uint32_t *order, packed_rows *rows, double *leaving,
                         double *absorbed, lam_error *error);

#endif
