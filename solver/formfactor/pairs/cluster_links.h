/* Links: pairs of clusters that together cover every pair of elements which may exchange light (Hanrahan et
 * al. 1991), marked open where their shaft is empty. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_CLUSTER_LINKS_H
#define LAMBERT_FORMFACTOR_PAIRS_CLUSTER_LINKS_H

#include "solver/formfactor/clusters/link_occluders.h"
#include "solver/formfactor/sight/occlusion.h"

/* All pairs of an element of a with an element of b, whose positions are greater; a == b: all pairs within
 * it. */
typedef struct cluster_link {
    uint32_t a, b;
    bool open; /* no element occludes any of these pairs */
} cluster_link;

/* The work that finding links took. */
typedef struct cluster_link_work {
    double shafts;     /* built */
    double candidates; /* clusters that shafts were given, and that they kept */
    double occlusion;  /* pairs of clusters that got occlusion_is_total */
    double hidden;     /* of these, those that were */
    double seconds;    /* of all threads: it alone depends on the machine */
} cluster_link_work;

typedef struct cluster_links {
    cluster_link *links; /* sorted by a */
    size_t n;
    size_t *of_cluster;   /* [n_clusters + 1]: where the links of each a begin */
    double hidden_pairs;  /* of elements, in clusters that are totally occluded from each other */
    double distant_pairs; /* of elements, below the threshold */
    cluster_link_work work;
    double share; /* of the descent that was made: 1, or about that of a sample */
} cluster_links;

typedef struct cluster_link_options {
    double threshold; /* leaves out pairs whose mean factor 2 g / (A_i + A_j) is provably below; 0: none */
    double slack;     /* the distance by which rounding may move a point */
    const occluders *occluders; /* NULL: clusters that hide each other are found by segments alone */
    size_t one_of; /* a sample: one of this many parts of the descent, evenly spread; 0: all of it */
    const progress *progress;
} cluster_link_options;

/* Descends through pairs of clusters of the tree. Clusters that face away or are below the threshold get no
 * link, nor, without a threshold, do clusters that one occluder hides, or that occlusion_is_total where too
 * many occluders stand between to know. The result is the same for any number of threads. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_CANCELLED. Freed by cluster_links_free. */
lam_status cluster_links_find(const mesh *m, const cluster_tree *t, const occlusion *o,
                              const cluster_link_options *options, cluster_links *out, lam_error *error);
void cluster_links_free(cluster_links *l);

#endif
