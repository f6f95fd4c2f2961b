/* Which clusters see which: the pairs of clusters that together hold every pair of elements which may
 * exchange light, each with what is known of all of its pairs at once. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_CLUSTER_LINKS_H
#define LAMBERT_FORMFACTOR_PAIRS_CLUSTER_LINKS_H

#include "solver/formfactor/pairs/occlusion.h"

/* Every element of a with every element of b, whose positions are greater; a == b: each pair within it. */
typedef struct cluster_link {
    uint32_t a, b;
    bool open; /* nothing is between any two of them */
} cluster_link;

typedef struct cluster_links {
    cluster_link *links; /* those of one a together */
    size_t n;
    size_t *of_cluster;   /* [n_clusters + 1]: where the links of each a begin */
    double hidden_pairs;  /* of elements, in clusters that do not see each other */
    double distant_pairs; /* beyond the threshold */
} cluster_links;

typedef struct cluster_link_options {
    double threshold; /* pairs whose mean factor, 2 g / (A_i + A_j), is surely below it are left out */
    double slack;     /* what rounding may move a point */
    const progress *progress;
} cluster_link_options;

/* Walks down the tree with itself. Skipped are clusters that face away, those beyond the threshold, and,
 * where there is none, those that are plainly hidden from each other. The result is the same for any number
 * of threads. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. Freed by cluster_links_free. */
lam_status cluster_links_find(const mesh *m, const cluster_tree *t, const occlusion *o,
                              const cluster_link_options *options, cluster_links *out, lam_error *error);
void cluster_links_free(cluster_links *l);

#endif
