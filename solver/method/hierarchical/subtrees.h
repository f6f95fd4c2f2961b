/* Whole subtrees of a basis shared out to threads, then what is above them. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_SUBTREES_H
#define LAMBERT_METHOD_HIERARCHICAL_SUBTREES_H

#include "solver/operator/wavelet/wavelets.h"

/* Nodes [piece.first, piece.last) one after the other, in postorder, with what thread `desk` below n_threads
 * has for itself. */
typedef lam_status run_subtree(void *context, wavelet_piece piece, size_t desk, lam_error *error);

/* The largest subtrees of at most `most` elements, any thread any of them; then every node above them, one at
 * a time, on desk 0. Stops at the first error, which it returns. Errors: LAM_ERR_MEMORY, those of run. */
lam_status subtrees_run(const wavelets *w, size_t most, size_t n_threads, run_subtree *run, void *context,
                        lam_error *error);

#endif
