/* The transport matrix S = A^1/2 F A^-1/2 in a multiwavelet basis W, in its standard form
 *     W S W^T
 * (Beylkin, Coifman and Rokhlin 1991; for radiosity Gortler et al. 1993), by one pass over the rows of F, of
 * which none is held. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_PASS_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_PASS_H

#include "solver/base/progress.h"
#include "solver/linalg/row_source.h"
#include "solver/method/hierarchical/wavelet_reach.h"

typedef struct wavelet_pass_input {
    const wavelets *basis;
    row_source *rows; /* of F, with A_i F_ij = A_j F_ji; one_sided: of an F1 with A F = A F1 + F1^T A,
                         whose rows may list a column several times and are asked for once */
    bool one_sided;
    const double *area;        /* [n], by element */
    const plane_tree *tree;    /* of the basis */
    float threshold;           /* coefficient (i, j) is kept above threshold weight_i weight_j */
    const float *weight;       /* [n_nodes], of all coefficients of a node */
    const double (*centre)[3]; /* [n], by element */
    double reach; /* coefficients with clusters beyond this many radii of a node are 0; INFINITY: no cut */
    size_t n_threads;
    const progress *progress;
} wavelet_pass_input;

/* out: the upper triangle of W S W^T with its diagonal, freed by the caller with csr_free.
 *
 * Let Phi_a and Psi_a be the scaling functions and wavelets of node a, and Q_a its matrix:
 *     (Phi_a; Psi_a) = Q_a (Phi_left; Phi_right).
 * Nodes run in postorder. Node a forms its rows from those that its children left,
 *     (Phi_a S; Psi_a S) = Q_a (Phi_left S; Phi_right S),
 * on the scaling functions of column clusters, and coarsens the columns level by level by the same Q_b.
 * Psi_a S yields the coefficients Psi_a S Psi_b^T of all b that are no finer than a; they are final. The
 * coefficients of finer b follow from symmetry. Phi_a S stops below the height of the parent and waits for
 * the sibling.
 *
 * Of a one-sided F1, S = S1 + S1^T, and Psi_a S1 Psi_b^T for a finer b is no transpose of what b found. So
 * Phi_a S1 Psi_b^T is carried up beside Phi_a S1 (fine_column in wavelet_entries.h), and the transpose is
 * added at the end.
 *
 * The rows of a leaf begin on clusters that are the coarser the farther away they are (wavelet_reach.h). The
 * bits do not depend on n_threads. Cost: about nnz(F), and a few hundred clusters for each leaf and level.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED, those of rows. */
lam_status wavelet_pass(const wavelet_pass_input *input, csr *out, lam_error *error);

#endif
