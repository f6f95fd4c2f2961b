#include "solver/formfactor/exchange/pair_factor.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/exchange/pair_contour.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

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
    return far != NULL ? cubature(&seen_a, &seen_b, far)
                       : pair_contour(rules, &seen_a, &seen_b, distance, tolerance);
}
