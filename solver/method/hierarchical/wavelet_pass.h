/* S = A^1/2 F A^-1/2 in a basis of wavelets, in one pass over the rows of F, of which none is held. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_PASS_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_PASS_H

#include "solver/base/progress.h"
#include "solver/linalg/row_source.h"
#include "solver/method/hierarchical/wavelet_reach.h"

typedef struct wavelet_pass_input {
    const wavelets *basis;
    row_source *rows; /* of F, in which A_i F_ij = A_j F_ji; one_sided: of F1, A F = A F1 + F1^T A,
                         any entry any number of times, each row asked for once */
    bool one_sided;
    const double *area;        /* [n], by element */
    const plane_tree *tree;    /* that the basis is of */
    float threshold;           /* a coefficient (i, j) is kept from threshold weight_i weight_j on */
    const float *weight;       /* [n_nodes], of the coefficients of a node */
    const double (*centre)[3]; /* [n], by element */
    double reach; /* wavelets of a node see clusters within so many of its radii; INFINITY: all */
    size_t n_threads;
    const progress *progress;
} wavelet_pass_input;

/* The upper triangle of W S W^T, the diagonal included; freed by the caller with csr_free.
 *
 * Rows come leaf by leaf. Of every node the rows of what it hands up meet the columns of clusters of the same
 * height alone; those of its wavelets go on to all coarser columns, and there are final. Finer columns are
 * the transposed of what finer rows find; where rows are one-sided nobody else finds them, and what is handed
 * up takes them along, as far as they look (wavelet_details.h). Rows of a leaf begin on clusters that are the
 * coarser the farther they are (wavelet_reach.h). The bits do not depend on n_threads. Cost: about nnz(F),
 * and a few hundred clusters of each level of a leaf. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED, those of
 * rows. */
lam_status wavelet_pass(const wavelet_pass_input *input, csr *out, lam_error *error);

#endif
