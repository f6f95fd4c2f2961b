#include "solver/formfactor/visibility/shaft.h"

#include "solver/base/cpu.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

typedef double lanes __attribute__((vector_size(8 * SHAFT_LANES), may_alias));
typedef long long mask __attribute__((vector_size(8 * SHAFT_LANES), may_alias));
typedef signed char lane_bytes __attribute__((vector_size(SHAFT_LANES))); /* 0 or -1 */

static inline bool any_lane(lane_bytes cut) {
    uint64_t all;
    memcpy(&all, &cut, sizeof all);
    return all != 0;
}

static void add_plane(shaft *s, const double normal[3], double level) {
    for (int d = 0; d < 3; d++) s->normal[d][s->n_planes] = normal[d];
    s->level[s->n_planes++] = level;
}

/* Adds the planes of the hull that are not planes of the common box. Projected to the axes u and v, the hull
 * of two rectangles has an edge from one to the other in each quadrant where one reaches further along u and
 * the other further along v. */
static void add_hull(shaft *s, const shaft_box *a, const shaft_box *b, int u, int v, double slack) {
    for (int quadrant = 0; quadrant < 4; quadrant++) {
        const double along_u = quadrant & 1 ? 1 : -1, along_v = quadrant & 2 ? 1 : -1;
        const double a_u = along_u > 0 ? a->high[u] : a->low[u], a_v = along_v > 0 ? a->high[v] : a->low[v];
        const double b_u = along_u > 0 ? b->high[u] : b->low[u], b_v = along_v > 0 ? b->high[v] : b->low[v];
        const double du = along_u * (a_u - b_u), dv = along_v * (a_v - b_v);
        if (!(du * dv < 0)) continue;
        const double length = sqrt(du * du + dv * dv);
        double normal[3] = {0};
        normal[u] = along_u * fabs(dv) / length;
        normal[v] = along_v * fabs(du) / length;
        add_plane(s, normal, normal[u] * a_u + normal[v] * a_v - slack);
    }
}

void shaft_of_boxes(shaft *s, const shaft_box *a, const shaft_box *b, double slack) {
    s->n_planes = 0;
    memset(s->normal, 0, sizeof s->normal);
    for (int k = 0; k < SHAFT_PLANES; k++) s->level[k] = INFINITY;
    for (int d = 0; d < 3; d++) {
        s->low[d] = fmin(a->low[d], b->low[d]) + slack;
        s->high[d] = fmax(a->high[d], b->high[d]) - slack;
    }
    add_hull(s, a, b, 0, 1, slack);
    add_hull(s, a, b, 1, 2, slack);
    add_hull(s, a, b, 2, 0, slack);
}

void shaft_cut(shaft *s, const double normal[3], double level) {
    const double back[3] = {-normal[0], -normal[1], -normal[2]};
    add_plane(s, back, -level);
}

#define CPU_KERNELS "solver/formfactor/visibility/shaft_kernels.inc"
#include "solver/base/cpu_kernels.inc"

bool shaft_misses_box(const shaft *s, const double low[3], const double high[3]) {
    typedef bool kernel(const shaft *, const double *, const double *);
    static kernel *const table[] = CPU_TABLE(box_is_cut_portable, box_is_cut_avx2, box_is_cut_avx512);
    for (int d = 0; d < 3; d++)
        if (low[d] >= s->high[d] || high[d] <= s->low[d]) return true;
    return table[cpu_best()](s, low, high);
}

bool shaft_misses_points(const shaft *s, int n, const double (*points)[3]) {
    typedef bool kernel(const shaft *, int, const double(*)[3]);
    static kernel *const table[] =
        CPU_TABLE(points_are_cut_portable, points_are_cut_avx2, points_are_cut_avx512);
    for (int d = 0; d < 3; d++) {
        double low = INFINITY, high = -INFINITY;
        for (int c = 0; c < n; c++) {
            low = points[c][d] < low ? points[c][d] : low;
            high = points[c][d] > high ? points[c][d] : high;
        }
        if (low >= s->high[d] || high <= s->low[d]) return true;
    }
    return table[cpu_best()](s, n, points);
}

bool shaft_misses_element(const shaft *s, const mesh *m, uint32_t element) {
    const uint32_t *corner = m->elements[element];
    const size_t corners = mesh_corners(m, element);
    double points[4][3];
    for (size_t c = 0; c < corners; c++)
        for (int d = 0; d < 3; d++) points[c][d] = m->vertices[corner[c]][d];
    return shaft_misses_points(s, (int)corners, (const double(*)[3])points);
}
