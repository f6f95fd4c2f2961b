/* What is hidden of a pair of elements, or of clusters: segments between points of the two. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_OCCLUSION_H
#define LAMBERT_FORMFACTOR_PAIRS_OCCLUSION_H

#include "solver/formfactor/pairs/clusters.h"
#include "solver/formfactor/pairs/pair_factor.h"
#include "solver/formfactor/visibility/visibility.h"

/* What is looked at. */
typedef struct look {
    const visibility *v;
    const double *area;      /* [n] */
    const polygon *polygons; /* [n] */
    const pair_rules *rules;
    double tolerance; /* of the unoccluded factor, relative */
    double accuracy;  /* of a factor that is partly hidden: standard error */
    size_t segments;  /* at least, where it may be partly hidden; a multiple of VISIBILITY_PACKET */
    uint64_t seed;
} look;

typedef enum look_verdict { LOOK_OPEN, LOOK_HIDDEN, LOOK_MIXED } look_verdict;

/* Whether the first look at a pair says as much of it as accuracy asks. */
bool look_suffices(const look *l, uint32_t i, uint32_t j, double g);

/* A first look at the pair i, j whose unoccluded exchange area is g > 0: eight segments, more for a factor
 * that matters more, until two disagree. seen: what of g they say is not hidden. */
look_verdict look_first(const look *l, uint32_t i, uint32_t j, double g, double *seen);

/* About how many segments look_closely will cast. */
double look_segments(const look *l, uint32_t i, uint32_t j, double g);

/* What of g is not hidden, never more than g. The standard error is about accuracy, of a factor F above
 * .1 about 10 F accuracy: of segments enough, each weighted with the kernel. */
double look_closely(const look *l, uint32_t i, uint32_t j, double g);

/* Whether a hundred and more segments between two clusters, the more the larger factor (of a point of one to
 * the other) is, are all blocked: what may be seen all the same is about accuracy. False for a factor that
 * would need very many. */
bool look_is_hidden(const look *l, const cluster_tree *t, const cluster *a, const cluster *b, double factor);

#endif
