/* The visible share of pairs between which few occluders stand, by projection (projection.h), and clusters
 * that a single occluder hides from each other. Knows no rows. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_FEW_OCCLUDERS_H
#define LAMBERT_FORMFACTOR_PAIRS_FEW_OCCLUDERS_H

#include "solver/formfactor/pairs/cluster_links.h"
#include "solver/formfactor/sight/projection.h"
#include "solver/formfactor/visibility/visibility.h"

typedef struct few_occluders {
    occluders occluders;
    const mesh *m;
    const visibility *v;
    const polygon *polygons; /* [n] */
    const pair_factor_rules *rules;
    uint64_t seed;
    int most; /* occluders of a pair, up to UNCUT_OCCLUDERS_MOST */
} few_occluders;

typedef enum few_verdict { FEW_UNDECIDED, FEW_OPEN, FEW_HIDDEN, FEW_PARTIAL } few_verdict;

/* True where the scene has occluders, and few enough that clusters are compared with them too. */
bool few_occluders_apply(const few_occluders *f);

/* True where pairs of these links are to be projected: where few_occluders_apply, or few stand between most
 * of a sample of the links. Else finding them costs more than projection gains. */
bool few_occluders_pay(const few_occluders *f, const cluster_tree *t, const cluster_links *links);

/* True where segments are to be tested against lists: where up to LINK_OCCLUDERS_MOST stand between most of a
 * sample of the links. */
bool few_occluders_are_listed(const few_occluders *f, const cluster_tree *t, const cluster_links *links);

/* The tolerance of a pair's share that keeps its factor, F_ij or F_ji, to a third of the accuracy that
 * segments would have: projection is fast enough for it. */
double few_occluders_tolerance(const few_occluders *f, uint32_t i, uint32_t j, double g, double accuracy);

/* polygons and rules must outlive it. Freed by few_occluders_free. Errors: LAM_ERR_MEMORY. */
lam_status few_occluders_make(const mesh *m, const visibility *v, const polygon *polygons,
                              const pair_factor_rules *rules, uint64_t seed, int most, few_occluders *out,
                              lam_error *error);
void few_occluders_free(few_occluders *f);

/* The visible share of elements i and j of a link, 0 or 1 where that is proven or where no point says
 * otherwise. g: the unoccluded exchange area; tolerance: of the share. FEW_UNDECIDED: too many occluders,
 * share stays unchanged. Adds to *work as projection_share. */
few_verdict few_occluders_share(const few_occluders *f, const link_occluders *among, uint32_t i, uint32_t j,
                                double g, double tolerance, double *share, double *work);

/* The occluders that may block a segment between elements i and j of a link, or the one that blocks all, or
 * OCCLUDERS_UNCOUNTED. FEW_OPEN and FEW_HIDDEN are proven. */
few_verdict few_occluders_between(const few_occluders *f, const link_occluders *among, uint32_t i, uint32_t j,
                                  pair_occluders *between);

#endif
