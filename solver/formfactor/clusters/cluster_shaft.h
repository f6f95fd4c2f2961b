/* The shaft between two clusters: that of their boxes, in front of the planes of planar ones. An element
 * wholly outside it occludes no pair of the two. */
#ifndef LAMBERT_FORMFACTOR_CLUSTERS_CLUSTER_SHAFT_H
#define LAMBERT_FORMFACTOR_CLUSTERS_CLUSTER_SHAFT_H

#include "solver/formfactor/clusters/clusters.h"
#include "solver/formfactor/visibility/shaft.h"

/* Shrunk by slack, so that an element that only touches it is outside. */
void cluster_shaft_init(shaft *s, const cluster *a, const cluster *b, double slack);

/* Writes to out those of the candidates, the clusters in an enclosing shaft, that reach into this shaft,
 * large ones replaced by their descendants (finest: by leaves), at most SHAFT_CANDIDATES. Returns how many;
 * 0: the shaft is empty. */
enum { SHAFT_CANDIDATES = 96 };
size_t cluster_shaft_filter(const shaft *s, const mesh *m, const cluster_tree *t, const uint32_t *candidates,
                            size_t n_candidates, bool finest, uint32_t out[SHAFT_CANDIDATES]);

#endif
