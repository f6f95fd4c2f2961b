/* Runs over the nodes of a basis in postorder: subtrees in parallel, then the nodes above them. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_SUBTREES_H
#define LAMBERT_METHOD_HIERARCHICAL_SUBTREES_H

#include "solver/operator/wavelet/wavelets.h"

/* Runs nodes [piece.first, piece.last) in postorder. `thread` < n_threads is a number that no other call has
 * at the same time: the index of a working area. */
typedef lam_status run_subtree(void *context, wavelet_piece piece, size_t thread, lam_error *error);

/* Runs the largest subtrees of at most `most` elements by n_threads threads in any order, then every node
 * above them one by one as thread 0. Stops at the first error, which it returns. Errors: LAM_ERR_MEMORY,
 * those of run. */
lam_status subtrees_run(const wavelets *w, size_t most, size_t n_threads, run_subtree *run, void *context,
                        lam_error *error);

#endif
