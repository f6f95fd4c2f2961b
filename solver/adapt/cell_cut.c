#include "solver/adapt/cell_cut.h"

#include <math.h>
#include <string.h>

/* The longest side of a cell, squared, is at most this many of its areas, and its shortest at least a share
 * of the longest, unless those of the cell that it was cut from were worse. */
static const double longest = 16, shortest = 1. / 32;

enum { EIGHTH = MESH_CELL_STEPS / 8, MOST = CELL_POINTS_MOST, VALUES_MOST = 2 * GATHER_VALUES_MOST };

/* A search: the points of a cell, and how far they are from the mean. */
typedef struct cut_search {
    const cell_light *light;
    const mesh_cell *c;
    const cell_points *points;
    face_plane plane;
    double slender, uneven;                      /* no part may be worse */
    double weigh[COARSE_LIGHTS];                 /* of products of deviations */
    double all;                                  /* sum of weights */
    float off[VALUES_MOST][GATHER_HALVES][MOST]; /* weight (H - mean) */
} cut_search;

/* The square of the longest edge over the area, and the longest edge over the shortest. */
static void shape(const mesh_cell *c, double *slender, double *uneven) {
    double length[4], most = 0, least = INFINITY;
    const double area = mesh_cell_area(c);
    mesh_cell_edges(c, length);
    for (size_t k = 0; k < c->n; k++) most = fmax(most, length[k]), least = fmin(least, length[k]);
    *slender = area > 0 ? most * most / area : INFINITY;
    *uneven = least > 0 ? most / least : INFINITY;
}

static bool may_cut(const cut_search *s, mesh_cut cut) {
    mesh_cell parts[2];
    if (!mesh_cell_cut(s->c, cut, parts)) return false;
    for (int side = 0; side < 2; side++) {
        double slender, uneven;
        shape(&parts[side], &slender, &uneven);
        if (slender > s->slender || uneven > s->uneven) return false;
    }
    return true;
}

static void begin(const cell_light *light, const mesh_cell *c, const cell_points *p, cut_search *s) {
    const double area = mesh_cell_area(c);
    s->light = light;
    s->c = c;
    s->points = p;
    s->plane = face_plane_of(light->m, c->face);
    shape(c, &s->slender, &s->uneven);
    s->slender = fmax(s->slender, longest);
    s->uneven = fmax(s->uneven, 1 / shortest);
    s->all = 0;
    for (size_t k = 0; k < p->n; k++) s->all += (double)p->weight[k];
    for (size_t l = 0; l < light->coarse->n_lights; l++) s->weigh[l] = area / light->all[l] / s->all;
    for (size_t v = 0; v < p->values; v++)
        for (size_t h = 0; h < GATHER_HALVES; h++) {
            const float *H = p->H + (v * GATHER_HALVES + h) * p->room;
            double mean = 0;
            for (size_t k = 0; k < p->n; k++) mean += (double)p->weight[k] * (double)H[k];
            const float about = (float)(mean / s->all);
            for (size_t k = 0; k < p->n; k++) s->off[v][h][k] = p->weight[k] * (H[k] - about);
        }
}

static void place_at(const face_plane *plane, const mesh_cell *c, size_t place, float out[2]) {
    double at[3], in[2];
    mesh_cell_place(c, place, at);
    face_plane_at(plane, at, in);
    for (int d = 0; d < 2; d++) out[d] = (float)in[d];
}

/* The gain of a cut, what it takes off the squares of errors: with s the sum of a value's deviations on one
 * side, of weight w of all W, that side deviates by s / w and the other by -s / (W - w), s^2 (1 / w + 1 / (W
 * - w)) in all. */
static void find_gain(const cut_search *s, mesh_cut cut, double gain[COARSE_LIGHTS]) {
    const cell_points *p = s->points;
    const size_t n = p->n, channels = s->light->m->n_channels;
    float from[2], to[2], beyond[MOST], w = 0;
    place_at(&s->plane, s->c, cut.from, from);
    place_at(&s->plane, s->c, cut.to, to);
    for (size_t l = 0; l < COARSE_LIGHTS; l++) gain[l] = 0;
#pragma omp simd reduction(+ : w)
    for (size_t k = 0; k < n; k++) {
        beyond[k] = left_of(from, to, p->x[k], p->y[k]) > 0 ? 1 : 0;
        w += beyond[k] * p->weight[k];
    }
    if (!(w > 0 && (double)w < s->all)) return;
    const double both = 1 / (double)w + 1 / (s->all - (double)w);
    for (size_t v = 0; v < p->values; v++) {
        const float *first = s->off[v][0], *second = s->off[v][1];
        float a = 0, b = 0;
#pragma omp simd reduction(+ : a, b)
        for (size_t k = 0; k < n; k++) {
            a += beyond[k] * first[k];
            b += beyond[k] * second[k];
        }
        const size_t l = v / channels % s->light->coarse->n_lights;
        gain[l] += s->weigh[l] * both * (double)a * (double)b;
    }
}

/* Takes a cut in place of those that gain less. */
static void consider(const cut_search *s, mesh_cut cut, size_t first, size_t end,
                     cell_cut best[COARSE_LIGHTS]) {
    double gain[COARSE_LIGHTS];
    bool may = false;
    find_gain(s, cut, gain);
    for (size_t l = first; l < end; l++) {
        if (!((float)gain[l] > best[l].gain[l])) continue;
        if (!may && !may_cut(s, cut)) return;
        may = true;
        best[l].cut = cut;
        for (size_t of = 0; of < COARSE_LIGHTS; of++) best[l].gain[of] = (float)gain[of];
    }
}

void cell_cut_find(const cell_light *light, const mesh_cell *c, const cell_points *points,
                   cell_cut best[COARSE_LIGHTS]) {
    const size_t lights = light->coarse->n_lights;
    mesh_cut cuts[MESH_CUTS_MOST];
    cut_search s;
    memset(best, 0, COARSE_LIGHTS * sizeof *best);
    if (points->n < 2) return;
    begin(light, c, points, &s);
    const size_t n = mesh_cell_cuts(c->n, EIGHTH, cuts);
    for (size_t k = 0; k < n; k++) consider(&s, cuts[k], 0, lights, best);
    for (size_t l = 0; l < lights; l++) {
        const mesh_cut middle = best[l].cut;
        for (int k = 0; k < 9 && best[l].gain[l] > 0; k++) {
            const int from = middle.from + (k % 3 - 1) * (EIGHTH / 2),
                      to = middle.to + (k / 3 - 1) * (EIGHTH / 2);
            const mesh_cut near = {(uint8_t)from, (uint8_t)to};
            if (from >= 0 && to > from && to < (int)(MESH_CELL_STEPS * c->n) && mesh_cut_divides(c->n, near))
                consider(&s, near, l, l + 1, best);
        }
    }
}

void cell_cut_way(const cell_light *light, const mesh_cell *c, mesh_cut cut, float from[2], float to[2]) {
    const face_plane plane = face_plane_of(light->m, c->face);
    place_at(&plane, c, cut.from, from);
    place_at(&plane, c, cut.to, to);
}
