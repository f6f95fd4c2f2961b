#include "solver/formfactor/exchange/pair_far.h"

#include "solver/base/cpu.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 3 + 3 + 1 + 4 * 3 + (3 + 1) * (4 + 9) };

static void share_out(pair_far_table *t) {
    double *next = t->block;
    const size_t stride = t->stride;
    for (int d = 0; d < 3; d++, next += stride) t->centre[d] = next;
    for (int d = 0; d < 3; d++, next += stride) t->normal[d] = next;
    t->radius = next;
    next += stride;
    for (int c = 0; c < 4; c++)
        for (int d = 0; d < 3; d++, next += stride) t->corner[c][d] = next;
    for (int r = 0; r < PAIR_FAR_RULES; r++)
        for (int p = 0; p < t->rule[r].points; p++) {
            for (int d = 0; d < 3; d++, next += stride) t->rule[r].point[p][d] = next;
            t->rule[r].weight[p] = next;
            next += stride;
        }
}

/* Maps a product rule from the unit square to the polygon: bilinearly, or to a triangle by (u, w) -> u (1 -
 * w), u w. The weights carry the Jacobian. */
static void set_points(pair_far_points *rule, size_t at, const polygon *p, const gauss_rule *g) {
    const double share = 1 / sqrt(3.14159265358979323846); /* half of the kernel's 1/pi */
    const double *first = p->corner[0], *one = p->corner[1], *two = p->corner[2];
    const double twice_area = 2 * polygon_area(p);
    int q = 0;
    for (int i = 0; i < g->n; i++)
        for (int j = 0; j < g->n; j++, q++) {
            const double u = g->node[i], w = g->node[j];
            double x[3], density;
            if (p->n == 3) {
                for (int d = 0; d < 3; d++)
                    x[d] = first[d] + u * (1 - w) * (one[d] - first[d]) + u * w * (two[d] - first[d]);
                density = twice_area * u;
            } else {
                density = polygon_point(p, u, w, x);
            }
            for (int d = 0; d < 3; d++) rule->point[q][d][at] = x[d];
            rule->weight[q][at] = density * share * g->weight[i] * g->weight[j];
        }
}

static void set_element(pair_far_table *t, size_t at, const polygon *p, const pair_factor_rules *rules) {
    const int last = p->n == 3 ? 2 : 3;
    for (int d = 0; d < 3; d++) {
        t->centre[d][at] = p->centre[d];
        t->normal[d][at] = p->normal[d];
        for (int c = 0; c < 4; c++) t->corner[c][d][at] = p->corner[c < last ? c : last][d];
    }
    t->radius[at] = p->radius;
    for (int r = 0; r < PAIR_FAR_RULES; r++) set_points(&t->rule[r], at, p, &rules->gauss[r + 1]);
}

lam_status pair_far_table_build(const polygon *polygons, const cluster_tree *tree,
                                const pair_factor_rules *rules, double tolerance, pair_far_table *out,
                                lam_error *error) {
    pair_far_table t = {.n = tree->n, .stride = tree->n + PAIR_FAR_LANES};
    size_t count;
    if (!size_multiply(t.stride, COLUMNS, &count))
        return status_fail(error, LAM_ERR_MEMORY, "%zu elements are too many", t.n);
    t.block = memory_allocate(count, sizeof *t.block, "pairs", error);
    if (t.block == NULL) return LAM_ERR_MEMORY;
    for (int r = 0; r < PAIR_FAR_RULES; r++) {
        const int nodes = rules->gauss[r + 1].n;
        t.rule[r].points = nodes * nodes;
        t.rule[r].closest = 1 + pair_factor_distance(nodes, tolerance);
    }
    share_out(&t);
    for (size_t at = 0; at < t.n; at++) set_element(&t, at, &polygons[tree->element[at]], rules);
    for (size_t at = t.n; at < t.stride; at++) t.radius[at] = 1e150;
    *out = t;
    return LAM_OK;
}

void pair_far_table_free(pair_far_table *t) {
    free(t->block);
    *t = (pair_far_table){0};
}

#ifdef CPU_AVX2_TARGET
typedef double lane_avx512 __attribute__((vector_size(64)));
typedef long long mask_avx512 __attribute__((vector_size(64)));
#define KERNEL(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
#define lane lane_avx512
#define mask mask_avx512
#include "solver/formfactor/exchange/pair_far_kernels.inc"
#undef KERNEL
#undef TARGET
#undef lane
#undef mask

typedef double lane_avx2 __attribute__((vector_size(32)));
typedef long long mask_avx2 __attribute__((vector_size(32)));
#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#define lane lane_avx2
#define mask mask_avx2
#include "solver/formfactor/exchange/pair_far_kernels.inc"
#undef KERNEL
#undef TARGET
#undef lane
#undef mask
#endif

typedef double lane_plain __attribute__((vector_size(16)));
typedef long long mask_plain __attribute__((vector_size(16)));
#define KERNEL(name) name##_plain
#define TARGET
#define lane lane_plain
#define mask mask_plain
#include "solver/formfactor/exchange/pair_far_kernels.inc"
#undef KERNEL
#undef TARGET
#undef lane
#undef mask

void pair_far_row(const pair_far_table *t, size_t i, size_t first, size_t count, double *g) {
    typedef void row_kernel(const pair_far_table *, size_t, size_t, size_t, double *);
    static row_kernel *const table[] = CPU_TABLE(pair_far_row_plain, pair_far_row_avx2, pair_far_row_avx512);
    table[cpu_best()](t, i, first, count, g);
}
