/* Form factors by blocks of clusters (Hanrahan, Salzman and Aupperle 1991; in wavelets Gortler et al. 1993):
 * the two trees of a pair of clusters are descended until the light between them is smooth enough, or so
 * little that it does not matter how it is distributed. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_BLOCKS_H
#define LAMBERT_FORMFACTOR_BLOCKS_BLOCKS_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/visibility/visibility.h"

typedef struct block_options {
    double
        open; /* of blocks that nothing crosses: bound of the 2-norm of their error in S = A^1/2 F A^-1/2 */
    double shadow;        /* of partly hidden blocks: bound of their own 2-norm */
    double exact;         /* of single pairs, unoccluded: relative tolerance */
    unsigned scene_every; /* segments of one block in so many are cast against the whole scene by Embree, also
                             where few pieces stand between; 0: none */
    uint64_t seed;        /* of visibility segments */
    /* Found: an error of a block counts as often as the importance between its two sides (importance.h), so
     * that both bounds are over it, times the share of bounds. NULL: all are 1. */
    const importance *importance;
    const progress *progress;
    const char *stage;
} block_options;

/* True where clusters in planes are worth having: the planes are few, and have several elements each. */
bool blocks_are_planar(const plane_tree *tree);

/* All pairs of planes of a scene are visited, so that there may be no more than these; where nothing hides
 * anything (unhidden.h), there are blocks of clusters of several planes, and any number is possible. */
enum { BLOCK_PLANES_MOST = 4096 };

/* A scene made ready for blocks on a tree of its elements, for a forecast and then for the blocks. mesh and
 * tree must outlive it. Errors: LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
typedef struct block_scene block_scene;
lam_status block_scene_make(const mesh *m, const plane_tree *tree, block_scene **out, lam_error *error);
void block_scene_destroy(block_scene *s);
const visibility *block_scene_visibility(const block_scene *s);

/* The options of a recipe, without progress. */
block_options block_options_of(const recipe *r);

/* Finds the blocks of all pairs of planes of a tree, which must outlive them. Where the tree is not planar
 * and nothing hides anything, clusters of several planes have blocks of one number. Visible shares come from
 * segments, or lines between elements, against the occluders in between, from Embree where these are many,
 * and from nothing where none is; segments through panes count by what these pass. The bits do not depend on
 * the number of threads: both are seeded by the pair of clusters. report may be NULL. out is freed by
 * block_factors_free.
 *
 * Cost: blocks grow like n^1/2 in rooms of large planes; partly hidden ones do not grow with n (measured).
 * Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status blocks_find(const mesh *m, const visibility *v, const plane_tree *tree,
                       const block_options *options, block_factors *out, block_report *report,
                       lam_error *error);
/* The same in a scene that is ready; it can only be destroyed afterwards, also after an error. *through is
 * set to the part of each row sum that comes through panes, [n] in mesh order, which the caller frees, or to
 * NULL where there are none; NULL: not wanted. */
lam_status blocks_find_in(block_scene *s, const block_options *options, block_factors *out,
                          block_report *report, double **through, lam_error *error);

#endif
