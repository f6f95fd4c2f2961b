/* The room between two clusters: what lies wholly outside it hides nothing of one from the other (Haines and
 * Wallace 1991). */
#ifndef LAMBERT_FORMFACTOR_PAIRS_SHAFT_H
#define LAMBERT_FORMFACTOR_PAIRS_SHAFT_H

#include "solver/formfactor/pairs/clusters.h"

enum { SHAFT_PLANES = 14 };

/* A box and planes that cut it: inside where normal . x < level for each. */
typedef struct shaft {
    double low[3], high[3];
    int n_planes;
    double normal[SHAFT_PLANES][3], level[SHAFT_PLANES];
} shaft;

/* The hull of both boxes, cut by the planes of clusters that have one; shrunk by slack all around, so that
 * what only touches it is outside. */
void shaft_init(shaft *s, const cluster *a, const cluster *b, double slack);

bool shaft_misses_box(const shaft *s, const double low[3], const double high[3]);
bool shaft_misses_element(const shaft *s, const mesh *m, uint32_t element);

/* Clusters that reach into a shaft, from those that reach into one around it: at most SHAFT_CANDIDATES, the
 * larger ones in pieces, with finest down to the leaves. Returns how many; none: nothing is in the way. */
enum { SHAFT_CANDIDATES = 96 };
size_t shaft_filter(const shaft *s, const mesh *m, const cluster_tree *t, const uint32_t *candidates,
                    size_t n_candidates, bool finest, uint32_t out[SHAFT_CANDIDATES]);

#endif
