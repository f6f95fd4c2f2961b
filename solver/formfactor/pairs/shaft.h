/* The shaft between two clusters (Haines and Wallace 1991): the convex hull of their boxes. An element wholly
 * outside it occludes no pair of the two. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_SHAFT_H
#define LAMBERT_FORMFACTOR_PAIRS_SHAFT_H

#include "solver/formfactor/pairs/clusters.h"

enum { SHAFT_PLANES = 14 };

/* A box cut by planes: a point x is inside where normal . x < level for each. */
typedef struct shaft {
    double low[3], high[3];
    int n_planes;
    double normal[SHAFT_PLANES][3], level[SHAFT_PLANES];
} shaft;

/* The hull of both boxes, cut by the planes of planar clusters and shrunk by slack, so that an element that
 * only touches it is outside. */
void shaft_init(shaft *s, const cluster *a, const cluster *b, double slack);

/* True where a box, or the hull of n points, is found to lie outside a shaft. */
bool shaft_misses_box(const shaft *s, const double low[3], const double high[3]);
bool shaft_misses_points(const shaft *s, int n, const double (*points)[3]);

/* True where an element lies wholly outside a shaft. */
bool shaft_misses_element(const shaft *s, const mesh *m, uint32_t element);

/* Writes to out those of the candidates, the clusters in an enclosing shaft, that reach into this shaft,
 * large ones replaced by their descendants (finest: by leaves), at most SHAFT_CANDIDATES. Returns how many;
 * 0: the shaft is empty. */
enum { SHAFT_CANDIDATES = 96 };
size_t shaft_filter(const shaft *s, const mesh *m, const cluster_tree *t, const uint32_t *candidates,
                    size_t n_candidates, bool finest, uint32_t out[SHAFT_CANDIDATES]);

#endif
