#include "solver/formfactor/sight/visible_lines.h"

#include "solver/base/cpu.h"
#include "solver/formfactor/exchange/lane_bits.h"

#include <math.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))

/* Lines as seen from their points: with r = X - P, the cosines a0 + a1 t and b times the length of r + t D,
 * whose square is Q(t) = p + 2 q t + s t^2; weight is the Jacobian. */
typedef struct seen_lines {
    double a0[VISIBLE_LINES], a1[VISIBLE_LINES], b[VISIBLE_LINES], p[VISIBLE_LINES], q[VISIBLE_LINES],
        s[VISIBLE_LINES], weight[VISIBLE_LINES];
} seen_lines;

/* atan z = z (1 + z^2 (c[0] + z^2 (c[1] + ...))) for 0 <= z <= 1, to 3e-9 of itself: least squares that were
 * weighed until the largest error was least. */
INLINE double arc_tangent(double z) {
    static const double c[] = {-.333332990868,  .19998548213,    -.142642409138,
                               .109521817396,   -.0840343849881, .0579573907712,
                               -.0311776437432, .0109144973075,  -.00179359749226};
    const double z2 = z * z;
    double sum = c[8];
    for (int k = 7; k >= 0; k--) sum = sum * z2 + c[k];
    return z * (1 + z2 * sum);
}

/* The angle of (x, y), y > 0, from 0 to pi. */
INLINE double angle_of(double y, double x) {
    const double along = fabs(x), flat = arc_tangent((y > along ? along : y) / (y > along ? y : along));
    const double acute = y > along ? M_PI / 2 - flat : flat;
    return x < 0 ? M_PI - acute : acute;
}

/* int K dt from t0 to t1, K = b (a0 + a1 t) / Q^2, times the weight. With D = p s - q^2 > 0 it is
 *   [(a0 (s t + q) - a1 (q t + p)) / (2 D Q)] + (a0 s - a1 q) / (2 D^3/2) angle,
 * where the angle is that between both ends as seen from P. Of a line much shorter than it is far away both
 * terms would be differences of equal numbers: there K is that of the middle. */
INLINE double integral(const seen_lines *l, int k, double t0, double t1) {
    static const double shorter = 1e-3;
    const double a0 = l->a0[k], a1 = l->a1[k], p = l->p[k], q = l->q[k], s = l->s[k];
    const double D = p * s - q * q > 1e-300 ? p * s - q * q : 1e-300, root = sqrt(D), length = t1 - t0;
    const double u0 = s * t0 + q, u1 = s * t1 + q, Q0 = p + t0 * (q + u0), Q1 = p + t1 * (q + u1);
    const double angle = angle_of(s * length / root, 1 + u0 * u1 / D);
    const double ends = (a0 * u1 - a1 * (q * t1 + p)) / Q1 - (a0 * u0 - a1 * (q * t0 + p)) / Q0;
    const double near = (ends + (a0 * s - a1 * q) / root * angle) / (2 * D);
    const double middle = .5 * (t0 + t1), Q = p + middle * (2 * q + s * middle);
    const double far = length * (a0 + a1 * middle) / (Q * Q);
    return l->weight[k] * l->b[k] * (s < shorter * shorter * Q ? far : near);
}

typedef float lanes __attribute__((vector_size(4 * VISIBLE_LINES), may_alias));
typedef int mask __attribute__((vector_size(4 * VISIBLE_LINES), may_alias));

/* Points P and lines X + t D, relative to some point near them. */
typedef struct line_packet {
    lanes P[3], X[3], D[3];
    lanes first, last; /* the part of a line in front; equal: none */
    seen_lines seen;
} line_packet;

/* Parts of lines, those of no length left out. */
typedef struct line_parts {
    lanes low, high;
} line_parts;

/* The parts that occluders hide, in ascending order of low, line by line. */
typedef struct line_cuts {
    int count;
    line_parts of[LINE_OCCLUDERS_MOST];
} line_cuts;

/* The form S of an edge at the middle of all segments, how much it changes along each of four coordinates,
 * and half the sum of that, which S must be within where it changes its sign. */
typedef struct edge_form {
    float S, slope[4], most;
} edge_form;

/* Adds to the weights of the coordinates how much the forms of the edges of one occluder depend on each. */
static void weigh_edges(int n, const edge_form *form, float weight[4]) {
    float inside[OCCLUDER_CORNERS]; /* from 0 to 1 where S changes its sign */
    for (int e = 0; e < n; e++) inside[e] = .5f + .5f * form[e].S / form[e].most;
    for (int e = 0; e < n; e++) {
        float share = (1 - fabsf(2 * inside[e] - 1)) / form[e].most;
        if (!(share > 0)) continue;
        for (int other = 0; other < n; other++)
            if (other != e && inside[other] < 1) share *= inside[other];
        for (int k = 0; k < 4; k++) weight[k] += share * form[e].slope[k];
    }
}

#define CPU_KERNELS "solver/formfactor/sight/visible_lines_kernels.inc"
#include "solver/base/cpu_kernels.inc"

void visible_lines_add(const segment_occluder *of, segment_list *list, const line_pair *p,
                       const double centre[3], const double x[3][VISIBLE_LINES], line_sums *sums) {
    typedef void kernel(const segment_occluder *, segment_list *, const line_pair *, const double[3],
                        const double[3][VISIBLE_LINES], line_sums *);
    static kernel *const table[] = CPU_TABLE(add_lines_portable, add_lines_avx2, add_lines_avx512);
    table[cpu_best()](of, list, p, centre, x, sums);
}

bool line_pair_choose(const segment_occluder *of, const segment_list *list, const affine_map *a,
                      const affine_map *b, const double centre[3], line_pair *out) {
    const affine_map *const maps[2] = {a, b};
    typedef void kernel(const segment_occluder *, const segment_list *, const affine_map *const[2],
                        const double[3], float[4]);
    static kernel *const table[] = CPU_TABLE(weigh_sides_portable, weigh_sides_avx2, weigh_sides_avx512);
    float weight[4] = {0};
    int best = -1;
    if ((a->twisted && b->twisted) || list->count > LINE_OCCLUDERS_MOST) return false;
    table[cpu_best()](of, list, maps, centre, weight);
    for (int k = 0; k < 4; k++)
        if (!maps[k / 2]->twisted && (best < 0 || weight[k] > weight[best])) best = k;
    out->maps = best < 2 ? (affine_pair){.from = *b, .to = *a} : (affine_pair){.from = *a, .to = *b};
    out->along = best % 2;
    return true;
}
