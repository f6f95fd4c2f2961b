/* The occluders between two clusters, and the proof that one of them hides them from each other. */
#ifndef LAMBERT_FORMFACTOR_CLUSTERS_LINK_OCCLUDERS_H
#define LAMBERT_FORMFACTOR_CLUSTERS_LINK_OCCLUDERS_H

#include "solver/formfactor/clusters/cluster_shaft.h"
#include "solver/formfactor/visibility/occluders.h"

/* Occluders that may stand between two clusters, at most. Where more than asked for are between, count is
 * OCCLUDERS_UNCOUNTED. */
enum { LINK_OCCLUDERS_MOST = 512, TESTED_OCCLUDERS_MOST = 128, FEW_OCCLUDERS = 256 };
enum { OCCLUDERS_UNCOUNTED = -1 };
typedef struct link_occluders {
    int count;
    uint32_t of[LINK_OCCLUDERS_MOST];
} link_occluders;

/* As many as pairs of two clusters may have to be projected: fewer in a scene of more than FEW_OCCLUDERS. */
int link_occluders_projected(const occluders *o);

/* Finds the occluders that reach into the shaft s of a and b and have points of both on different sides, up
 * to `most` <= LINK_OCCLUDERS_MOST. Count 0 proves that nothing is between them. */
void link_occluders_find(const occluders *o, const shaft *s, const cluster *a, const cluster *b, int most,
                         link_occluders *out);

/* True where one of those covers each of the clusters from the other. */
bool link_occluders_hide(const occluders *o, const link_occluders *among, const cluster *a, const cluster *b);

#endif
