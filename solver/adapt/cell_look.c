#include "solver/adapt/cell_look.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

enum { STEPS = CELL_STEPS, POINTS = CELL_POINTS };

/* The longest side of a cell, squared, is at most this many of its areas, and its shortest at least a share
 * of the longest, unless those of the cell that it was cut from were worse. */
static const double longest = 16, shortest = 1. / 32;

/* Points of a cell, each with its share of the area. */
typedef struct cell_points {
    double place[POINTS][3];
    double share[POINTS];
} cell_points;

/* The normal part of (b - a) x (c - a): above 0 where c is to the left of the way from a to b. */
static double left_of(const double normal[3], const double a[3], const double b[3], const double c[3]) {
    double to[3], from[3], product[3];
    subtract3(b, a, to);
    subtract3(c, a, from);
    cross3(to, from, product);
    return dot3(normal, product);
}

/* Random points in the middle of parts: STEPS x STEPS of a quad's bilinear map, whose areas differ, or as
 * many equal triangles of a triangle. */
static void place_points(const mesh_cell *c, const double normal[3], uint64_t key, cell_points *out) {
    const double(*p)[3] = (const double(*)[3])c->corner;
    size_t n = 0;
    for (size_t j = 0; j < STEPS; j++)
        for (size_t i = 0; i < (c->n == 4 ? STEPS : 2 * (STEPS - j) - 1); i++, n++) {
            double x = random_unit(&key), y = random_unit(&key), weight[4] = {0};
            out->share[n] = 1;
            if (c->n == 4) {
                const double u = ((double)i + x) / STEPS, v = ((double)j + y) / STEPS;
                const double w[4] = {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
                memcpy(weight, w, sizeof weight);
                /* the Jacobian of the map is linear along either edge */
                out->share[n] =
                    w[0] * left_of(normal, p[0], p[1], p[3]) + w[1] * left_of(normal, p[1], p[2], p[0]) +
                    w[2] * left_of(normal, p[2], p[3], p[1]) + w[3] * left_of(normal, p[3], p[0], p[2]);
            } else {
                if (x + y > 1) x = 1 - x, y = 1 - y;
                const double turned = i % 2 == 0 ? 1 : -1;
                weight[1] = ((double)((i + 1) / 2) + turned * x) / STEPS;
                weight[2] = ((double)(j + i % 2) + turned * y) / STEPS;
                weight[0] = 1 - weight[1] - weight[2];
            }
            for (int d = 0; d < 3; d++)
                out->place[n][d] =
                    weight[0] * p[0][d] + weight[1] * p[1][d] + weight[2] * p[2][d] + weight[3] * p[3][d];
        }
    double sum = 0;
    for (size_t k = 0; k < POINTS; k++) sum += out->share[k] = fabs(out->share[k]);
    for (size_t k = 0; k < POINTS; k++) out->share[k] /= sum;
}

/* The variance over a cell by its points, of independent halves, so that noise takes no part on average.
 * Leaves the deviations from their means in h. */
static double measure(double (*h)[POINTS], const double *share) {
    double mean[GATHER_HALVES] = {0}, variance = 0;
    for (size_t k = 0; k < POINTS; k++)
        for (size_t half = 0; half < GATHER_HALVES; half++) mean[half] += share[k] * h[half][k];
    for (size_t k = 0; k < POINTS; k++) {
        const double a = h[0][k] - mean[0], b = h[1][k] - mean[1];
        variance += share[k] * a * b;
        h[0][k] = a;
        h[1][k] = b;
    }
    return variance;
}

/* The square of the longest edge over the area, and the longest edge over the shortest. */
static void shape(const mesh_cell *c, double *slender, double *uneven) {
    double length[4], most = 0, least = INFINITY;
    const double area = mesh_cell_area(c);
    mesh_cell_edges(c, length);
    for (size_t k = 0; k < c->n; k++) most = fmax(most, length[k]), least = fmin(least, length[k]);
    *slender = area > 0 ? most * most / area : INFINITY;
    *uneven = least > 0 ? most / least : INFINITY;
}

/* Finds the cuts that may be made. */
static void find_cuts(const mesh_cell *c, cell_look *out) {
    mesh_cut cuts[MESH_CUTS_MOST];
    const size_t n = mesh_cell_cuts(c->n, cuts);
    double slender, uneven;
    shape(c, &slender, &uneven);
    slender = fmax(slender, longest);
    uneven = fmax(uneven, 1 / shortest);
    for (size_t k = 0; k < n; k++) {
        mesh_cell parts[2];
        bool good = mesh_cell_cut(c, cuts[k], parts);
        for (int side = 0; good && side < 2; side++) {
            double its[2];
            shape(&parts[side], &its[0], &its[1]);
            good = its[0] <= slender && its[1] <= uneven;
        }
        if (good) out->of[out->n_cuts++].cut = cuts[k];
    }
}

/* beyond[k][i]: the share of point i where it is on the side of cut k that its first part is not, else 0. */
static void find_sides(const mesh_cell *c, const double normal[3], const cell_points *points,
                       const cell_look *look, double (*beyond)[POINTS], double *area) {
    for (size_t k = 0; k < look->n_cuts; k++) {
        double a[3], b[3];
        mesh_cell_place(c, look->of[k].cut.from, a);
        mesh_cell_place(c, look->of[k].cut.to, b);
        area[k] = 0;
        for (size_t i = 0; i < POINTS; i++) {
            beyond[k][i] = left_of(normal, a, b, points->place[i]) > 0 ? points->share[i] : 0;
            area[k] += beyond[k][i];
        }
    }
}

/* Adds what the side of a cell that element `at` lies on shows at the points. */
static void look_at_side(const cell_light *light, const mesh_cell *c, uint32_t at, uint64_t key, double area,
                         const cell_points *points, double (*beyond)[POINTS], const double *part,
                         cell_look *out) {
    const mesh *m = light->m;
    const size_t channels = m->n_channels, values = gather_values(light->g);
    double H[POINTS * GATHER_HALVES * GATHER_VALUES_MOST];
    gather_at(light->g, at, key, POINTS, (const double(*)[3])points->place, H);
    for (size_t v = 0; v < values; v++) {
        const size_t l = v / channels;
        const double rho = (double)m->reflectance[v % channels * m->n + c->face];
        const double weight = area * rho * rho / light->all[l];
        double h[GATHER_HALVES][POINTS];
        for (size_t half = 0; half < GATHER_HALVES; half++)
            for (size_t k = 0; k < POINTS; k++) h[half][k] = H[(k * GATHER_HALVES + half) * values + v];
        out->error[l] += (float)(weight * measure(h, points->share));
        for (size_t k = 0; k < out->n_cuts; k++) {
            double sum[GATHER_HALVES] = {0};
            for (size_t i = 0; i < POINTS; i++)
                for (size_t half = 0; half < GATHER_HALVES; half++) sum[half] += beyond[k][i] * h[half][i];
            /* a part of the area w deviates by sum / w from the mean, the other by -sum / (1 - w) */
            const double w = part[k];
            if (w > 0 && w < 1) out->of[k].gain[l] += (float)(weight * sum[0] * sum[1] / (w * (1 - w)));
        }
    }
}

void cell_look_at(const cell_light *light, const mesh_cell *c, uint64_t key, cell_look *out) {
    const coarse_light *coarse = light->coarse;
    const uint32_t front = coarse->first[c->face];
    double normal[3], beyond[MESH_CUTS_MOST][POINTS], part[MESH_CUTS_MOST];
    cell_points points;
    for (int d = 0; d < 3; d++) normal[d] = (double)light->m->normal[c->face][d];
    place_points(c, normal, key, &points);
    const double area = mesh_cell_area(c);
    *out = (cell_look){.n_cuts = 0};
    find_cuts(c, out);
    find_sides(c, normal, &points, out, beyond, part);
    look_at_side(light, c, front, key, area, &points, beyond, part, out);
    if (light->two_sided)
        look_at_side(light, c, front + (uint32_t)(coarse->m.n / 2), random_hash(key), area, &points, beyond,
                     part, out);
}
