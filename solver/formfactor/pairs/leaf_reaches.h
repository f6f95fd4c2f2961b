/* The partners of a leaf of the cluster tree, by position, and the occluders between it and each of them. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_LEAF_REACHES_H
#define LAMBERT_FORMFACTOR_PAIRS_LEAF_REACHES_H

#include "solver/formfactor/clusters/link_occluders.h"
#include "solver/formfactor/pairs/cluster_links.h"

/* The positions first ... last-1 of a cluster that a leaf, or an ancestor of it, is linked with. */
typedef struct reach {
    uint32_t first, last, cluster;
    bool open;
    bool searched;
    size_t among; /* where searched is set: its occluders in leaf_reaches */
} reach;

/* All the partners of a leaf; room that is used again for the next one. All zero at first; freed by
 * leaf_reaches_free. */
typedef struct leaf_reaches {
    uint32_t leaf;
    reach *reaches; /* sorted; their positions do not overlap */
    size_t n, capacity;
    link_occluders *among;
    size_t n_among, among_capacity;
} leaf_reaches;

/* Sets the partners of a leaf; parent: of each cluster, [n_clusters]. False: out of memory. */
bool leaf_reaches_find(const cluster_tree *t, const cluster_links *links, const uint32_t *parent,
                       uint32_t leaf, leaf_reaches *out);
void leaf_reaches_free(leaf_reaches *r);

/* The partner that has a position, which one of them must have. Cost: O(log n). */
reach *leaf_reaches_at(leaf_reaches *r, uint32_t position);

/* The occluders between the leaf and a partner, up to `most`, searched for at the first call. Valid until the
 * next call; NULL: out of memory. */
link_occluders *leaf_reaches_among(const cluster_tree *t, const occluders *o, int most, leaf_reaches *r,
                                   reach *partner);

#endif
