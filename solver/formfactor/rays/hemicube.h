/* Hemicubes (Cohen and Greenberg 1985): F_ij = the sum of the delta form factors of the pixels of half a cube
 * around element i's centroid that show j. Deterministic: aliasing in place of sampling noise. */
#ifndef LAMBERT_FORMFACTOR_RAYS_HEMICUBE_H
#define LAMBERT_FORMFACTOR_RAYS_HEMICUBE_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/rows/row_code.h"
#include "solver/formfactor/visibility/visibility.h"

/* The delta form factors, the same for every element. The top spans [-1, 1]^2 at height 1 in resolution x
 * resolution pixels; each side is one half of such a face. Mirror images are stored once. */
typedef struct hemicube {
    size_t resolution; /* even */
    double *top;       /* [resolution/2][resolution/2]: the quarter x > 0, y > 0 */
    double *side;      /* [resolution/2][resolution/2]: rows from the horizon up, the half y > 0 */
} hemicube;

enum { HEMICUBE_TOP, HEMICUBE_FACES = 5 };

/* LAM_ERR_ARGUMENT for a resolution that is odd or out of bounds. Freed by hemicube_free. */
lam_status hemicube_create(size_t resolution, hemicube *out, lam_error *error);
void hemicube_free(hemicube *h);

/* Rows of a face: as many as columns on top, half of that on a side. */
size_t hemicube_rows(const hemicube *h, int face);

/* The delta form factor of one pixel; all together sum to 1. Columns run across a face, rows up a side from
 * the horizon. */
double hemicube_weight(const hemicube *h, int face, size_t row, size_t column);

/* The rows of all elements, F_ij one-sided; leaving and absorbed, [n], are the weights of the pixels that
 * show nothing or a back face. The caller frees rows with packed_rows_free. Cost: 3 resolution^2 rays per
 * element. Errors: those of row_pool_make. */
lam_status hemicube_trace(const hemicube *h, const mesh *m, const visibility *v, const uint32_t *order,
                          const form_factor_options *options, packed_rows *rows, double *leaving,
                          double *absorbed, lam_error *error);

#endif
