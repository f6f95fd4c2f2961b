#include "solver/formfactor/exchange/affine_segments.h"

#include "solver/base/cpu.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/exchange/lane_bits.h"

#include <string.h>

typedef double lanes __attribute__((vector_size(8 * AFFINE_SEGMENTS), may_alias));
typedef long long mask __attribute__((vector_size(8 * AFFINE_SEGMENTS), may_alias));
typedef float floats __attribute__((vector_size(4 * AFFINE_SEGMENTS), may_alias));

/* Twice the area of the triangle at a corner of a quad. */
static double area_at(const polygon *p, int corner) {
    double before[3], after[3], across[3];
    subtract3(p->corner[(corner + 3) % 4], p->corner[corner], before);
    subtract3(p->corner[(corner + 1) % 4], p->corner[corner], after);
    cross3(after, before, across);
    return dot3(across, p->normal);
}

affine_map affine_map_of(const polygon *p) {
    affine_map m = {.folded = p->n == 3, .twisted = p->n == 4 && !p->affine, .jacobian = {1, 0, 0}};
    for (int d = 0; d < 3; d++) {
        m.corner[d] = p->corner[0][d];
        m.side[0][d] = p->corner[1][d] - p->corner[0][d];
        m.side[1][d] = p->corner[m.folded ? 2 : 3][d] - p->corner[0][d];
        m.normal[d] = p->normal[d];
        if (m.twisted) m.twist[d] = p->corner[0][d] - p->corner[1][d] + p->corner[2][d] - p->corner[3][d];
    }
    if (m.twisted) {
        /* Linear in u and in w, as the corners lie in one plane. */
        const double here = area_at(p, 0), of_u = area_at(p, 1), of_w = area_at(p, 3);
        m.jacobian[0] = here / (of_u + of_w);
        m.jacobian[1] = (of_u - here) / (of_u + of_w);
        m.jacobian[2] = (of_w - here) / (of_u + of_w);
    }
    return m;
}

#define CPU_KERNELS "solver/formfactor/exchange/affine_segments_kernels.inc"
#include "solver/base/cpu_kernels.inc"

unsigned affine_segments(const affine_pair *p, const double x[4][AFFINE_SEGMENTS], const double centre[3],
                         float origin[3][AFFINE_SEGMENTS], float direction[3][AFFINE_SEGMENTS],
                         double K[AFFINE_SEGMENTS]) {
    typedef unsigned kernel(const affine_pair *, const double[4][AFFINE_SEGMENTS], const double[3],
                            float[3][AFFINE_SEGMENTS], float[3][AFFINE_SEGMENTS], double[AFFINE_SEGMENTS]);
    static kernel *const table[] =
        CPU_TABLE(affine_segments_portable, affine_segments_avx2, affine_segments_avx512);
    return table[cpu_best()](p, x, centre, origin, direction, K);
}
