#include "solver/adapt/cell_look.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

enum { POINTS = CELL_STEPS_MOST * CELL_STEPS_MOST };

/* Points of a cell, each with its share of the area. */
typedef struct look_points {
    size_t n;
    double place[POINTS][3];
    double share[POINTS];
} look_points;

/* sum A |B - E|^2 of each light; at least a number above 0. */
static void weigh(const coarse_light *c, double all[COARSE_LIGHTS]) {
    const size_t n = c->m.n, vector = n * c->m.n_channels;
    for (size_t l = 0; l < c->n_lights; l++) {
        all[l] = 1e-300;
        for (size_t k = 0; k < vector; k++) {
            const double x = (double)c->B[l * vector + k] - (double)c->E[l * vector + k];
            all[l] += c->m.area[k % n] * x * x;
        }
    }
}

lam_status light_scene_make(const mesh *faces, const coarse_sources *from, uint64_t seed, const progress *p,
                            light_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    *out = (light_scene){.g = NULL};
    coarse_light *const c = &out->coarse;
    TRY(coarse_light_make(faces, from, seed, p, c, error));
    out->sky = (gather_sky){.tiling = &c->bounce.tiling, .L = c->L};
    TRY(gather_create(&c->m, c->n_lights, c->B, c->lamps ? c->E : NULL, c->sky ? &out->sky : NULL,
                      from->direct, &out->g, error));
    out->light = (cell_light){.m = faces, .coarse = c, .g = out->g};
    weigh(c, out->light.all);
done:
    if (status != LAM_OK) light_scene_free(out);
    return status;
}

void light_scene_free(light_scene *s) {
    gather_free(s->g);
    coarse_light_free(&s->coarse);
    *s = (light_scene){.g = NULL};
}

mesh_estimate mesh_estimate_of(const coarse_light *c, const double sum[COARSE_LIGHTS]) {
    mesh_estimate e = {.has_lamps = c->lamps, .has_groups = c->n_lit > 0, .has_sky = c->sky};
    if (c->lamps) e.lamps = sqrt(fmax(0, sum[0]));
    for (size_t l = 0; l < c->n_lit; l++) e.groups = fmax(e.groups, sqrt(fmax(0, sum[l])));
    e.even = sqrt(fmax(0, sum[coarse_light_even(c)]));
    if (c->sky) e.sky = sqrt(fmax(0, sum[c->n_lights - 1]));
    return e;
}

double mesh_estimate_most(const mesh_estimate *e) {
    return fmax(fmax(e->lamps, e->groups), fmax(e->even, e->sky));
}

size_t cell_light_values(const cell_light *light) {
    return gather_values(light->g) * (light->m->has_back != NULL ? 2 : 1);
}

/* |(b - a) x (d - a)| of each corner a of a quad between its neighbours. */
static void corner_areas(const mesh_cell *c, double out[4]) {
    for (size_t k = 0; k < 4; k++) {
        double next[3], last[3], product[3];
        subtract3(c->corner[(k + 1) % 4], c->corner[k], next);
        subtract3(c->corner[(k + 3) % 4], c->corner[k], last);
        cross3(next, last, product);
        out[k] = sqrt(dot3(product, product));
    }
}

/* Random points in the middle of parts: steps x steps of a quad's bilinear map, whose areas differ, or as
 * many equal triangles of a triangle. */
static void place_points(const mesh_cell *c, size_t steps, uint64_t key, look_points *out) {
    const double(*p)[3] = (const double(*)[3])c->corner;
    double areas[4] = {0}, sum = 0;
    size_t n = 0;
    if (c->n == 4) corner_areas(c, areas);
    for (size_t j = 0; j < steps; j++)
        for (size_t i = 0; i < (c->n == 4 ? steps : 2 * (steps - j) - 1); i++, n++) {
            double x = random_unit(&key), y = random_unit(&key), weight[4] = {0};
            out->share[n] = 1;
            if (c->n == 4) {
                const double u = ((double)i + x) / (double)steps, v = ((double)j + y) / (double)steps;
                const double w[4] = {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
                memcpy(weight, w, sizeof weight);
                /* the Jacobian of the map is linear along either edge */
                out->share[n] = w[0] * areas[0] + w[1] * areas[1] + w[2] * areas[2] + w[3] * areas[3];
            } else {
                if (x + y > 1) x = 1 - x, y = 1 - y;
                const double turned = i % 2 == 0 ? 1 : -1;
                weight[1] = ((double)((i + 1) / 2) + turned * x) / (double)steps;
                weight[2] = ((double)(j + i % 2) + turned * y) / (double)steps;
                weight[0] = 1 - weight[1] - weight[2];
            }
            for (int d = 0; d < 3; d++)
                out->place[n][d] =
                    weight[0] * p[0][d] + weight[1] * p[1][d] + weight[2] * p[2][d] + weight[3] * p[3][d];
            sum += out->share[n];
        }
    out->n = n;
    for (size_t k = 0; k < n; k++) out->share[k] /= sum;
}

/* The variance over a cell by its points, of independent halves, so that noise takes no part on average. */
static double variance(const look_points *p, const float *first, const float *second) {
    double mean[GATHER_HALVES] = {0}, sum = 0;
    for (size_t k = 0; k < p->n; k++) {
        mean[0] += p->share[k] * (double)first[k];
        mean[1] += p->share[k] * (double)second[k];
    }
    for (size_t k = 0; k < p->n; k++)
        sum += p->share[k] * ((double)first[k] - mean[0]) * ((double)second[k] - mean[1]);
    return sum;
}

/* Adds rho H of the side of a cell that element `at` lies on, from value `first` on; its errors too. */
static void look_at_side(const cell_light *light, const mesh_cell *c, uint32_t at, uint64_t key, size_t first,
                         const look_points *p, cell_points *points, float *error) {
    const mesh *m = light->m;
    const size_t channels = m->n_channels, values = gather_values(light->g);
    const double area = mesh_cell_area(c);
    double H[POINTS * GATHER_HALVES * GATHER_VALUES_MOST];
    gather_at(light->g, at, key, p->n, (const double(*)[3])p->place, H);
    for (size_t v = 0; v < values; v++) {
        const size_t l = v / channels;
        const double rho = (double)m->reflectance[v % channels * m->n + c->face];
        float *half[GATHER_HALVES];
        for (size_t h = 0; h < GATHER_HALVES; h++) {
            half[h] = points->H + ((first + v) * GATHER_HALVES + h) * points->room + points->n;
            for (size_t k = 0; k < p->n; k++)
                half[h][k] = (float)(rho * H[(k * GATHER_HALVES + h) * values + v]);
        }
        error[l] += (float)(area / light->all[l] * variance(p, half[0], half[1]));
    }
}

/* The values of a back that is not there, behind those of the front. */
static void see_nothing(size_t values, const look_points *p, cell_points *points) {
    for (size_t v = values * GATHER_HALVES; v < 2 * values * GATHER_HALVES; v++)
        memset(points->H + v * points->room + points->n, 0, p->n * sizeof *points->H);
}

void cell_look_at(const cell_light *light, const mesh_cell *c, uint64_t key, size_t steps,
                  cell_points *points, float error[COARSE_LIGHTS]) {
    const coarse_light *coarse = light->coarse;
    const uint32_t front = coarse->first[c->face];
    const face_plane plane = face_plane_of(light->m, c->face);
    look_points p;
    place_points(c, steps, key, &p);
    for (size_t l = 0; l < COARSE_LIGHTS; l++) error[l] = 0;
    look_at_side(light, c, front, key, 0, &p, points, error);
    const size_t values = gather_values(light->g);
    if (light->m->has_back != NULL && light->m->has_back[c->face])
        look_at_side(light, c, coarse->back[c->face], random_hash(key), values, &p, points, error);
    else if (light->m->has_back != NULL)
        see_nothing(values, &p, points);
    for (size_t k = 0; k < p.n; k++) {
        double at[2];
        face_plane_at(&plane, p.place[k], at);
        points->x[points->n + k] = (float)at[0];
        points->y[points->n + k] = (float)at[1];
        points->weight[points->n + k] = (float)(p.share[k] * (double)p.n);
    }
    points->n += p.n;
}
