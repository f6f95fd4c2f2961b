/* Form factors pair by pair: A_i F_ij = g_ij V_ij, with the unoccluded exchange area g by quadrature
 * (pair_factor.h, pair_far.h) and the visible share V by projection where few occluders stand between
 * (few_occluders.h), else by visibility segments (occlusion.h). */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIRS_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIRS_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/visibility/visibility.h"

/* Pairs of a first sample (pairs_twice.h). */
typedef struct known_pairs known_pairs;

typedef struct pairs_options {
    double tolerance; /* of the unoccluded factor, relative */
    double accuracy;  /* standard error of partly occluded factors (occlusion.h); a third by projection */
    size_t segments;  /* the least for a mixed pair; a multiple of 8 */
    /* Bounds for all mixed pairs together: accuracy is relaxed or tightened to meet them. */
    double segments_least, segments_most; /* of segments_least only the share that projection leaves */
    int occluders;    /* pairs with at most so many between them are projected; 0: segments for all */
    double threshold; /* only pairs whose mean factor 2 g / (A_i + A_j) is above; 0: all */
    bool keep_hidden; /* totally occluded pairs stay in the rows as explicit zeros */
    uint64_t seed;
    double coarser;           /* the error of segments is so many times the accuracy; 0: once */
    known_pairs *keep;        /* gets the pairs that are found; NULL: nothing does */
    const known_pairs *known; /* those settled there are taken as they are, but for some; NULL: none */
    const progress *progress;
    const char *stage;
    scratch *scratch; /* where rows are kept as they are found; NULL: in memory only */
    const char *scratch_name;
    const recipe *recipe; /* of the scratch files */
} pairs_options;

/* The exchange areas A_i F_ij = A_j F_ji of all pairs, j > i, as sparse rows freed by csr_free.
 * 1. Pairs of clusters (cluster_links.h): an empty shaft makes all their pairs unoccluded; clusters whose
 * every segment is blocked make them hidden.
 * 2. Of the others, a pair with few occluders is projected, and each other pair gets an occlusion test.
 * 3. A pair is mixed where its segments disagree, or where the pair of a neighbouring element came out
 *    differently, which finds shadow edges that eight segments miss. Mixed pairs get occlusion_estimate.
 * 4. Where pairs are projected, so do others of which eight segments saw nothing or a part, if that is much
 * of the light of one of both elements (pair_demand.h). The result is the same for any number of threads.
 * Memory: 9 bytes for each pair that faces and is not hidden, and 8 in the rows. kept, which may be NULL, is
 * set to the number of rows that the scratch folder already held. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED,
 * those of row_file.h. */
lam_status pairs_exchange(const mesh *m, const visibility *v, const pairs_options *options, csr *G,
                          pairs_report *report, size_t *kept, lam_error *error);

/* The tolerance, accuracy and numbers of segments that a recipe, which must outlive them, asks for with n
 * elements. With a threshold above 0, hidden pairs are kept as zeros, because they replace rays. */
pairs_options pairs_options_of(const recipe *r, size_t n, double threshold);

/* pairs_exchange with pairs_options_of a recipe. Sets f->pairs and
 * f->rows_kept. Errors: as for form_factors_make. */
lam_status pairs_find(const mesh *m, const visibility *v, const form_factor_options *options,
                      double threshold, form_factors *f, csr *G, lam_error *error);

#endif
