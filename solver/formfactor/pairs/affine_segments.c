#include "solver/formfactor/pairs/affine_segments.h"

#include "solver/base/cpu.h"

#include <string.h>

typedef double lanes __attribute__((vector_size(8 * AFFINE_SEGMENTS), may_alias));
typedef long long mask __attribute__((vector_size(8 * AFFINE_SEGMENTS), may_alias));
typedef float floats __attribute__((vector_size(4 * AFFINE_SEGMENTS), may_alias));

affine_map affine_map_of(const polygon *p) {
    affine_map m = {.folded = p->n == 3};
    for (int d = 0; d < 3; d++) {
        m.corner[d] = p->corner[0][d];
        m.side[0][d] = p->corner[1][d] - p->corner[0][d];
        m.side[1][d] = p->corner[m.folded ? 2 : 3][d] - p->corner[0][d];
        m.normal[d] = p->normal[d];
    }
    return m;
}

#define CPU_KERNELS "solver/formfactor/pairs/affine_segments_kernels.inc"
#include "solver/base/cpu_kernels.inc"

void affine_segments(const affine_pair *p, const double x[4][AFFINE_SEGMENTS], const double centre[3],
                     float origin[3][AFFINE_SEGMENTS], float direction[3][AFFINE_SEGMENTS],
                     double K[AFFINE_SEGMENTS]) {
    typedef void kernel(const affine_pair *, const double[4][AFFINE_SEGMENTS], const double[3],
                        float[3][AFFINE_SEGMENTS], float[3][AFFINE_SEGMENTS], double[AFFINE_SEGMENTS]);
    static kernel *const table[] =
        CPU_TABLE(affine_segments_portable, affine_segments_avx2, affine_segments_avx512);
    table[cpu_best()](p, x, centre, origin, direction, K);
}
