/* Parts of a sparse matrix that no entry joins. */
#ifndef LAMBERT_LINALG_CSR_PARTS_H
#define LAMBERT_LINALG_CSR_PARTS_H

#include "solver/linalg/csr.h"

/* part [n] = the number of each row's connected component of the pattern of entries above 0, which is taken
 * as symmetric; numbered from 0 by their first rows. *count: how many there are. Cost: O(entries), of the
 * rows up to the one that joins the last parts. */
void csr_parts(const csr *A, uint32_t *part, size_t *count);

#endif
