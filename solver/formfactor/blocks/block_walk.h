/* The descent of the trees of two planes: which blocks there are between them, and the work that it takes. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_BLOCK_WALK_H
#define LAMBERT_FORMFACTOR_BLOCKS_BLOCK_WALK_H

#include "solver/formfactor/blocks/block_shade.h"
#include "solver/formfactor/blocks/blocks.h"
#include "solver/formfactor/blocks/joined_kernel.h"
#include "solver/formfactor/sight/occlusion.h"

/* All that the walks of a scene share. */
typedef struct block_finder {
    const block_options *options;
    const plane_tree *tree;
    flat_clusters flat;
    occluders pieces;
    segment_occluder *segment_pieces; /* [pieces.n], for segments between elements */
    polygon *shapes;                  /* [n] of elements; NULL: they are made when they are needed */
    shade_scene shade;
    occlusion occlusion; /* of pairs of elements */
    pair_factor_rules rules;
    size_t n_clusters;
    bool joined;              /* clusters of several planes have blocks too, and nothing hides anything */
    joined_element *elements; /* [n] by position, where clusters are joined */
    joined_kernel kernel;
    double
        spread; /* the share of itself that the kernel of such a block may vary by, if it is of middle size */
    double exact;               /* relative tolerance of single pairs, unoccluded */
    importance_nodes important; /* of the importance of the options */
} block_finder;

/* All that no option changes; begins the nodes of blocks as well (block_factors_begin). out must stay where
 * it is until it is freed, also after an error. Errors: LAM_ERR_MEMORY. */
lam_status block_finder_make(const mesh *m, const visibility *v, const plane_tree *tree, block_factors *nodes,
                             block_finder *out, lam_error *error);
/* Options in place of those before, if there were any; they must outlive their use. Errors: LAM_ERR_MEMORY.
 */
lam_status block_finder_set(block_finder *k, const block_options *options, lam_error *error);
void block_finder_free(block_finder *k);

struct block_scene {
    visibility *v;
    block_factors nodes; /* n is 0 once blocks were found */
    block_finder finder;
};

/* The nodes whose pairs are to be visited: the topmost clusters of all planes, or the root with itself where
 * clusters are joined; the caller frees them. */
lam_status block_finder_planes(const block_finder *k, uint32_t **out, size_t *count, lam_error *error);

/* The elements of a node. */
size_t block_finder_size(const block_finder *k, uint32_t t);

/* The children of a node: two clusters, or the elements of a leaf. */
typedef struct node_children {
    uint32_t of[8];
    int count;
} node_children;
node_children block_finder_children(const block_finder *k, uint32_t t);

/* A sample of the descent (Knuth 1975, estimating the size of a tree): of pairs of nodes with at most
 * limit[k] pairs of elements one of two is visited, for each k anew. The work in stage k, that of pairs below
 * k limits, stands in part[k] and is a 2^-k of all such work; that in stage 0 is in the report of the walk.
 * The limits fall; none: all pairs are visited. */
enum { BLOCK_STAGES_MOST = 8 };
typedef struct block_sampling {
    double limit[BLOCK_STAGES_MOST];
    int n_stages, stage; /* stages: those passed so far */
    block_report part[BLOCK_STAGES_MOST + 1];
} block_sampling;

/* The work of one thread. */
typedef struct block_walk {
    const block_finder *finder;
    block_sampling sampling;
    block_list found;
    block_list through; /* the parts of those that come through panes */
    block_report report;
    lam_error *error;
} block_walk;

/* Adds the blocks of two nodes of different planes, or of a node above planes with itself. Errors:
 * LAM_ERR_MEMORY. */
lam_status block_walk_visit(block_walk *w, uint32_t a, uint32_t b);

void block_report_add(const block_report *from, double times, block_report *to);

#endif
