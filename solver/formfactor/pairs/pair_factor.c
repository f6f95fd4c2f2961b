#include "solver/formfactor/pairs/pair_factor.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* Gauss and Legendre: Newton's iteration for the roots of P_n. */
static void gauss_init(gauss_rule *g, int n) {
    g->n = n;
    for (int k = 0; k < n; k++) {
        double x = cos(pi * (k + .75) / (n + .5)), derivative = 1;
        for (int sweep = 0; sweep < 100; sweep++) {
            double p = 1, before = 0;
            for (int j = 0; j < n; j++) {
                const double next = ((2 * j + 1) * x * p - j * before) / (j + 1);
                before = p;
                p = next;
            }
            derivative = n * (x * p - before) / (x * x - 1);
            const double step = p / derivative;
            x -= step;
            if (fabs(step) < 1e-15) break;
        }
        g->node[k] = .5 * (1 - x);
        g->weight[k] = 1 / ((1 - x * x) * derivative * derivative);
    }
}

void pair_factor_rules_init(pair_factor_rules *rules) {
    static const int nodes[GAUSS_RULES] = {1, 2, 3, 4, 8, 16, 24};
    for (int r = 0; r < GAUSS_RULES; r++) gauss_init(&rules->gauss[r], nodes[r]);
    /* s = 1/(1 + exp(-pi sinh t)), ds = pi cosh t s (1 - s) dt */
    const double step = 1. / 16;
    for (int k = 0; k < STEEP_NODES; k++) {
        const double t = step * (k - STEEP_NODES / 2);
        const double s = 1 / (1 + exp(-pi * sinh(t))), rest = 1 / (1 + exp(pi * sinh(t)));
        rules->steep_node[k] = s;
        rules->steep_weight[k] = step * pi * cosh(t) * s * rest;
    }
}

typedef struct edge {
    double from[3], along[3]; /* along: unit */
    double length;
} edge;

static void edge_of(const polygon *p, int c, double scale, edge *e) {
    const double *from = p->corner[c], *to = p->corner[(c + 1) % p->n];
    for (int d = 0; d < 3; d++) {
        e->from[d] = scale * from[d];
        e->along[d] = scale * (to[d] - from[d]);
    }
    e->length = sqrt(dot3(e->along, e->along));
    for (int d = 0; d < 3 && e->length > 0; d++) e->along[d] /= e->length;
}

/* K'' = ln(x^2 + h^2):  K = (x^2 - h^2)/2 ln(x^2 + h^2) + 2 h x atan(x/h) - 3/2 x^2 */
static double twice_integrated(double x, double h) {
    const double r2 = x * x + h * h;
    if (r2 == 0) return 0;
    return .5 * (x * x - h * h) * log(r2) + (h > 0 ? 2 * h * x * atan(x / h) : 0) - 1.5 * x * x;
}

/* Double integral of ln r^2 over two parallel edges: with x the distance along them, second differences of K.
 */
static double parallel_edges(const edge *one, const edge *two, double cosine) {
    double v[3];
    subtract3(one->from, two->from, v);
    double x = dot3(v, two->along);
    for (int d = 0; d < 3; d++) v[d] -= x * two->along[d];
    const double h = sqrt(dot3(v, v));
    if (cosine < 0) x -= one->length;
    return twice_integrated(x + one->length, h) - twice_integrated(x, h) -
           twice_integrated(x + one->length - two->length, h) + twice_integrated(x - two->length, h);
}

/* Integral of ln r^2 over edge two from the point at s on edge one: with x along edge two and h the distance
 * from its line, x ln(x^2 + h^2) - 2 x + 2 h atan(x/h) between the ends. The two atan are one atan2, the
 * angle that the edge subtends. */
static double point_to_edge(const edge *one, const edge *two, double s) {
    double v[3];
    for (int d = 0; d < 3; d++) v[d] = one->from[d] + s * one->along[d] - two->from[d];
    const double a = dot3(v, two->along), b = two->length - a;
    for (int d = 0; d < 3; d++) v[d] -= a * two->along[d];
    const double h2 = dot3(v, v), h = sqrt(h2), from2 = a * a + h2, to2 = b * b + h2;
    return (to2 > 0 ? b * log(to2) : 0) + (from2 > 0 ? a * log(from2) : 0) - 2 * two->length +
           2 * h * atan2(h * two->length, h2 - a * b);
}

/* The places on edge one, in (0, length), where the integrand may be steep: the points nearest to the line of
 * edge two and to its two ends. */
static int steep_places(const edge *one, const edge *two, double cosine, double places[3]) {
    double v[3], candidates[3];
    subtract3(two->from, one->from, v);
    const double to_start = dot3(v, one->along), along_two = dot3(v, two->along);
    candidates[0] = to_start;
    candidates[1] = to_start + cosine * two->length;
    const double sine2 = 1 - cosine * cosine;
    candidates[2] = sine2 > 0 ? (to_start - cosine * along_two) / sine2 : 0;
    int n = 0;
    for (int c = 0; c < 3; c++) {
        const double s = candidates[c], least = 1e-12 * one->length;
        if (!(s > least && s < one->length - least)) continue;
        int at = n++;
        for (; at > 0 && places[at - 1] > s; at--) places[at] = places[at - 1];
        places[at] = s;
    }
    return n;
}

static double distance_to_edge(const double point[3], const edge *e) {
    double v[3];
    subtract3(point, e->from, v);
    const double s = fmin(fmax(dot3(v, e->along), 0), e->length);
    for (int d = 0; d < 3; d++) v[d] -= s * e->along[d];
    return sqrt(dot3(v, v));
}

/* Quadrature over edge one, the shorter, of the closed form over edge two. */
static double skew_edges(const pair_factor_rules *rules, const edge *one, const edge *two, double cosine) {
    double places[3], ends[5] = {0};
    const int n_places = steep_places(one, two, cosine, places);
    /* The distance of the edges is attained at one of those places or at an end. */
    double nearest = INFINITY;
    for (int p = -1; p <= n_places; p++) {
        const double s = p < 0 ? 0 : p == n_places ? one->length : places[p];
        double point[3];
        for (int d = 0; d < 3; d++) point[d] = one->from[d] + s * one->along[d];
        nearest = fmin(nearest, distance_to_edge(point, two));
    }
    double sum = 0;
    /* A singularity at distance delta of the unit interval leaves n Gauss nodes an error of
     * (2 delta + sqrt(1 + 4 delta^2))^-2n: below 1e-9 for these. */
    const double delta = nearest / one->length;
    const gauss_rule *gauss = delta > 1 ? &rules->gauss[4] : delta > .4 ? &rules->gauss[5] : &rules->gauss[6];
    if (delta > .25) {
        for (int k = 0; k < gauss->n; k++)
            sum += gauss->weight[k] * point_to_edge(one, two, gauss->node[k] * one->length);
        return sum * one->length;
    }
    for (int p = 0; p < n_places; p++) ends[p + 1] = places[p];
    ends[n_places + 1] = one->length;
    for (int piece = 0; piece <= n_places; piece++) {
        const double length = ends[piece + 1] - ends[piece];
        double part = 0;
        for (int k = 0; k < STEEP_NODES; k++)
            part +=
                rules->steep_weight[k] * point_to_edge(one, two, ends[piece] + rules->steep_node[k] * length);
        sum += part * length;
    }
    return sum;
}

/* Double integral of ln r^2. The closed form for parallel edges loses the ratio of their lengths to rounding.
 */
static double two_edges(const pair_factor_rules *rules, const edge *a, const edge *b, double cosine) {
    const edge *one = a->length <= b->length ? a : b, *two = one == a ? b : a;
    double off[3];
    for (int d = 0; d < 3; d++) off[d] = one->along[d] - cosine * two->along[d];
    if (dot3(off, off) < 1e-24 && one->length > .01 * two->length) return parallel_edges(one, two, cosine);
    return skew_edges(rules, one, two, cosine);
}

/* A F = 1/(4 pi) sum over edges of cos(d, d') integral integral ln r^2 ds dt. The edges of each polygon sum
 * to 0, so that any unit of length gives the same; the one chosen keeps the logarithms small. */
static double contour(const pair_factor_rules *rules, const polygon *a, const polygon *b, double distance) {
    const double scale = 1 / fmax(distance, a->radius + b->radius);
    edge of_a[POLYGON_CORNERS], of_b[POLYGON_CORNERS];
    polygon near_a = *a, near_b = *b;
    for (int c = 0; c < a->n; c++) subtract3(a->corner[c], a->centre, near_a.corner[c]);
    for (int c = 0; c < b->n; c++) subtract3(b->corner[c], a->centre, near_b.corner[c]);
    for (int c = 0; c < a->n; c++) edge_of(&near_a, c, scale, &of_a[c]);
    for (int c = 0; c < b->n; c++) edge_of(&near_b, c, scale, &of_b[c]);
    double sum = 0;
    for (int i = 0; i < a->n; i++)
        for (int j = 0; j < b->n; j++) {
            const double cosine = dot3(of_a[i].along, of_b[j].along);
            if (fabs(cosine) < 1e-15 || of_a[i].length == 0 || of_b[j].length == 0) continue;
            sum += cosine * two_edges(rules, &of_a[i], &of_b[j], cosine);
        }
    return fmax(sum / (4 * pi * scale * scale), 0);
}

enum { POINTS_MOST = (POLYGON_CORNERS - 2) * 16 };

/* One array for each component, for vector instructions. */
typedef struct cubature_points {
    int n;
    double x[3][POINTS_MOST], weight[POINTS_MOST];
} cubature_points;

/* The square (u, w) -> first + u one + w two, weights of sum area. */
static void map_square(const double *first, const double *one, const double *two, double area,
                       const gauss_rule *g, cubature_points *points) {
    for (int i = 0; i < g->n; i++)
        for (int j = 0; j < g->n; j++) {
            const int at = points->n++;
            for (int d = 0; d < 3; d++)
                points->x[d][at] =
                    first[d] + g->node[i] * (one[d] - first[d]) + g->node[j] * (two[d] - first[d]);
            points->weight[at] = area * g->weight[i] * g->weight[j];
        }
}

/* The square folded to a triangle: (u, w) -> u (1 - w), u w, of area 2 A u du dw. */
static void map_triangle(const double *first, const double *one, const double *two, double area,
                         const gauss_rule *g, cubature_points *points) {
    for (int i = 0; i < g->n; i++)
        for (int j = 0; j < g->n; j++) {
            const double u = g->node[i], w = g->node[j];
            const int at = points->n++;
            for (int d = 0; d < 3; d++)
                points->x[d][at] = first[d] + u * (1 - w) * (one[d] - first[d]) + u * w * (two[d] - first[d]);
            points->weight[at] = 2 * area * u * g->weight[i] * g->weight[j];
        }
}

static void set_points(const polygon *p, const gauss_rule *g, cubature_points *points) {
    points->n = 0;
    if (p->n == 4 && p->affine) {
        map_square(p->corner[0], p->corner[1], p->corner[3], polygon_area(p), g, points);
        return;
    }
    for (int c = 1; c + 1 < p->n; c++) {
        polygon triangle = {.n = 3};
        const int corners[3] = {0, c, c + 1};
        for (int k = 0; k < 3; k++)
            memcpy(triangle.corner[k], p->corner[corners[k]], sizeof triangle.corner[k]);
        map_triangle(triangle.corner[0], triangle.corner[1], triangle.corner[2], polygon_area(&triangle), g,
                     points);
    }
}

/* A F = integral integral cos cos' / (pi r^2) */
static double cubature(const polygon *a, const polygon *b, const gauss_rule *g) {
    cubature_points of_a, of_b;
    set_points(a, g, &of_a);
    set_points(b, g, &of_b);
    double sum = 0;
    for (int i = 0; i < of_a.n; i++) {
        double part = 0;
#pragma omp simd reduction(+ : part)
        for (int j = 0; j < of_b.n; j++) {
            const double x = of_b.x[0][j] - of_a.x[0][i], y = of_b.x[1][j] - of_a.x[1][i],
                         z = of_b.x[2][j] - of_a.x[2][i], r2 = x * x + y * y + z * z;
            part -= of_b.weight[j] * (x * a->normal[0] + y * a->normal[1] + z * a->normal[2]) *
                    (x * b->normal[0] + y * b->normal[1] + z * b->normal[2]) / (r2 * r2);
        }
        sum += of_a.weight[i] * part;
    }
    return fmax(sum / pi, 0);
}

/* The error of n Gauss nodes is about (2 q)^-2n in each of the four directions for a singularity q
 * half-widths away. The fourth power of the distance multiplies it by about 1/.03. */
double pair_factor_distance(int nodes, double tolerance) {
    return fmax(2, .5 * pow(.03 * tolerance, -.5 / nodes));
}

/* The cheapest rule that keeps the tolerance at this distance; NULL: the contour integral is cheaper. */
static const gauss_rule *far_rule(const pair_factor_rules *rules, const polygon *a, const polygon *b,
                                  double distance, double tolerance) {
    const double wide = fmax(a->radius, b->radius), q = (distance - wide) / wide;
    for (int r = 0; r < CUBATURE_RULES && q > 2; r++)
        if (q >= pair_factor_distance(rules->gauss[r].n, tolerance)) return &rules->gauss[r];
    return NULL;
}

double pair_factor_exchange(const pair_factor_rules *rules, const polygon *a, const polygon *b,
                            double tolerance) {
    polygon seen_a, seen_b;
    polygon_in_front(b, a, &seen_b);
    if (seen_b.n == 0) return 0;
    polygon_in_front(a, b, &seen_a);
    if (seen_a.n == 0) return 0;
    double r[3];
    subtract3(seen_a.centre, seen_b.centre, r);
    const double distance = sqrt(dot3(r, r));
    const gauss_rule *far = far_rule(rules, &seen_a, &seen_b, distance, tolerance);
    return far != NULL ? cubature(&seen_a, &seen_b, far) : contour(rules, &seen_a, &seen_b, distance);
}
