/* Form factors pair by pair: the magnitude by mathematics, by rays only what of it is hidden. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIRS_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIRS_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/visibility/visibility.h"

typedef struct pairs_options {
    double tolerance; /* of the unoccluded factor, relative */
    double accuracy;  /* of a factor that is partly hidden, absolute */
    size_t segments; /* at least, between the elements of a pair that may be partly hidden; a multiple of 8 */
    /* For all mixed pairs, about: with more each pair is found less accurately, with fewer more so. */
    double segments_least, segments_most;
    double threshold; /* only pairs whose mean factor 2 g / (A_i + A_j) is above; 0: all */
    bool keep_hidden; /* hidden pairs that were looked at stay in the rows, with 0 */
    uint64_t seed;
    const progress *progress;
    const char *stage;
    scratch *scratch; /* where rows are kept as they are found; NULL: in memory only */
    const char *scratch_name;
    const recipe *recipe; /* of the scratch files */
} pairs_options;

/* The exchange areas g_ij = A_i F_ij = g_ji of all pairs, j > i, as sparse rows freed by csr_free.
 * What lies between clusters of elements tells which pairs are surely open, and segments which clusters are
 * plainly hidden from each other. Of the other pairs segments decide: where they disagree, or where the pair
 * of a neighbour came out otherwise, many find the share that is seen, each weighted with the kernel. The
 * result is the same for any number of threads. Memory: 9 bytes a pair that is facing and not hidden, and 8
 * in the rows. kept, which may be NULL, gets how many rows the scratch folder had already. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_CANCELLED, those of row_file.h. */
lam_status pairs_exchange(const mesh *m, const visibility *v, const pairs_options *options, csr *G,
                          pairs_report *report, size_t *kept, lam_error *error);

/* The exchange areas of all pairs whose unoccluded mean factor is above `threshold` as an upper triangle,
 * which the caller frees: of threshold 0 without those that are hidden, else with a 0 for them. Fills
 * f->pairs and rows_kept. Errors: as of form_factors_make. */
lam_status pairs_find(const mesh *m, const visibility *v, const form_factor_options *options,
                      double threshold, form_factors *f, csr *G, lam_error *error);

#endif
