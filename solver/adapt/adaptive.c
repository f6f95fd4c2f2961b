#include "solver/adapt/adaptive.h"

#include "solver/adapt/coarse_light.h"
#include "solver/adapt/gather.h"
#include "solver/base/random.h"
#include "solver/scene/mesh_cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Faces are first halved into cells of at most this share of all area, so that no shadow falls between the
 * points of a cell. */
static const double largest_share = 1. / 256;

/* A cell is not made longer than this, over its width. */
static const double longest = 16;

/* In a round those cells are halved which gain at least a fraction of the best, an eighth of all at most. */
enum { ROUND_SHARE = 8, SIDES = 3, STEPS = 4, POINTS = STEPS * STEPS };
static const double round_least = 1. / 8;

/* A cell with the square of its error, A |rho (H - mean)|^2 over |B - E|^2, by light. */
typedef struct adaptive_cell {
    mesh_cell cell;
    bool looked, can[SIDES]; /* can: be halved so */
    float error[COARSE_LIGHTS], blurred[COARSE_LIGHTS], rough[COARSE_LIGHTS][SIDES];
} adaptive_cell;

typedef struct adaptive_run {
    const mesh *m; /* faces */
    const adaptive_options *how;
    const coarse_light *coarse;
    const gather *g;
    double all[COARSE_LIGHTS]; /* sum A |B - E|^2 */
    adaptive_cell *cells;
    size_t n;
    uint64_t pass; /* the number of times that all cells were looked at afresh */
} adaptive_run;

/* The points of a cell: the middles of 4 x 4 parts of a quad, of 16 parts of a triangle, of which those that
 * stand as it does come first. Where i + j is above a row of a triangle there is none. */
static size_t upright(size_t i, size_t j) {
    return j * STEPS - j * (j - 1) / 2 + i;
}

static void place_points(const double p[4][3], size_t corners, uint64_t key, double points[POINTS][3]) {
    size_t inverted = upright(0, STEPS);
    for (size_t j = 0; j < STEPS; j++)
        for (size_t i = 0; corners == 4 && i < STEPS; i++) {
            const double u = ((double)i + random_unit(&key)) / STEPS,
                         v = ((double)j + random_unit(&key)) / STEPS;
            for (int d = 0; d < 3; d++)
                points[j * STEPS + i][d] =
                    (1 - v) * ((1 - u) * p[0][d] + u * p[1][d]) + v * ((1 - u) * p[3][d] + u * p[2][d]);
        }
    for (size_t j = 0; j < STEPS; j++)
        for (size_t i = 0; corners == 3 && i + j < STEPS; i++)
            for (int turned = 0; turned < (i + j + 1 < STEPS ? 2 : 1); turned++) {
                const double off = (turned + 1) / 3., u = ((double)i + off) / STEPS,
                             v = ((double)j + off) / STEPS;
                const size_t k = turned ? inverted++ : upright(i, j);
                for (int d = 0; d < 3; d++)
                    points[k][d] = p[0][d] + u * (p[1][d] - p[0][d]) + v * (p[2][d] - p[0][d]);
            }
}

/* The variance over a cell by its points, about whose parts it tells nothing: a linear function has a 16th of
 * it there. Of independent halves, so that noise takes no part on average; blurred: of their mean, whose
 * noise makes it too large where light changes in steps that the samples do not resolve. */
static void measure(double (*h)[POINTS], double *error, double *blurred) {
    static const double lacking = 16. / 15;
    double mean[GATHER_HALVES] = {0};
    *error = *blurred = 0;
    for (size_t k = 0; k < POINTS; k++)
        for (size_t half = 0; half < GATHER_HALVES; half++) mean[half] += h[half][k] / POINTS;
    for (size_t k = 0; k < POINTS; k++) {
        const double a = h[0][k] - mean[0], b = h[1][k] - mean[1];
        *error += lacking * a * b / POINTS;
        *blurred += lacking * (a + b) * (a + b) / (4 * POINTS);
    }
}

/* The sum of squares of differences between neighbours along the edges of a cell: the edge along which it is
 * largest is the one to halve. */
static void measure_sides(double (*h)[POINTS], size_t corners, double rough[SIDES]) {
    for (size_t j = 0; j < STEPS; j++)
        for (size_t i = 0; i < STEPS; i++) {
            const bool quad = corners == 4;
            if (!quad && i + j + 1 >= STEPS) break;
            const size_t here = quad ? j * STEPS + i : upright(i, j),
                         next = quad ? here + 1 : upright(i + 1, j),
                         above = quad ? here + STEPS : upright(i, j + 1);
            const double at = h[0][here] + h[1][here];
            const double along = i + 1 < STEPS ? h[0][next] + h[1][next] - at : 0,
                         across = j + 1 < STEPS ? h[0][above] + h[1][above] - at : 0;
            rough[0] += along * along;
            rough[quad ? 1 : 2] += across * across;
            if (!quad) rough[1] += (along - across) * (along - across);
        }
}

/* False where a half would be too long and narrow, or cannot be made. */
static bool may_halve(const mesh_cell *c, const double p[4][3], size_t side) {
    mesh_cell halves[2];
    double length[4], most = 0;
    mesh_cell_edges(p, c->n, length);
    for (size_t k = 0; k < c->n; k++) most = fmax(most, length[k]);
    const double along = c->n == 4 ? (length[side] + length[side + 2]) / 2 : length[side],
                 across = c->n == 4 ? (length[(side + 1) % 4] + length[(side + 3) % 4]) / 2 : most;
    if (c->n == 4 ? across > longest / 2 * along : along < most / 2) return false;
    return mesh_cell_halve(c, side, halves);
}

/* Adds what the side of a cell that element `at` lies on shows at the points. */
static void look_at_side(const adaptive_run *r, adaptive_cell *c, uint32_t at, uint64_t key, double area,
                         const double points[POINTS][3]) {
    const mesh *m = r->m;
    const size_t channels = m->n_channels, values = gather_values(r->g);
    double H[POINTS * GATHER_HALVES * GATHER_VALUES_MOST];
    gather_at(r->g, at, key, POINTS, points, H);
    for (size_t v = 0; v < values; v++) {
        const size_t light = v / channels;
        const double rho = (double)m->reflectance[v % channels * m->n + c->cell.face];
        const double weight = area * rho * rho / r->all[light];
        double h[GATHER_HALVES][POINTS], error, blurred, rough[SIDES] = {0};
        for (size_t half = 0; half < GATHER_HALVES; half++)
            for (size_t k = 0; k < POINTS; k++) h[half][k] = H[(k * GATHER_HALVES + half) * values + v];
        measure(h, &error, &blurred);
        measure_sides(h, c->cell.n, rough);
        c->error[light] += (float)(weight * error);
        c->blurred[light] += (float)(weight * blurred);
        for (size_t s = 0; s < SIDES; s++) c->rough[light][s] += (float)(weight * rough[s]);
    }
}

static void look(const adaptive_run *r, adaptive_cell *c) {
    const coarse_light *coarse = r->coarse;
    double p[4][3], points[POINTS][3];
    uint64_t key = random_hash(random_hash(r->how->seed) + r->pass);
    mesh_cell_corners(r->m, &c->cell, p);
    key = random_hash(key ^ random_hash((uint64_t)c->cell.face + 1));
    for (size_t k = 0; k < c->cell.n; k++)
        key = random_hash(key ^ ((uint64_t)c->cell.at[k][0] << 16 | c->cell.at[k][1]));
    place_points((const double(*)[3])p, c->cell.n, key, points);
    const double area = mesh_cell_area((const double(*)[3])p, c->cell.n);
    const uint32_t front = coarse->first[c->cell.face];
    *c = (adaptive_cell){.cell = c->cell};
    look_at_side(r, c, front, key, area, (const double(*)[3])points);
    if (r->how->two_sided)
        look_at_side(r, c, front + (uint32_t)(coarse->m.n / 2), random_hash(key), area,
                     (const double(*)[3])points);
    for (size_t s = 0; s < SIDES; s++)
        c->can[s] = s < (c->cell.n == 4 ? 2u : 3u) && may_halve(&c->cell, (const double(*)[3])p, s);
    c->looked = true;
}

/* Looks at all cells that are new, and sums the squares of errors. */
static lam_status look_at_new(adaptive_run *r, double *sum, lam_error *error) {
    const progress *p = r->how->progress;
#pragma omp parallel for schedule(dynamic, 4)
    for (size_t i = 0; i < r->n; i++)
        if (!r->cells[i].looked && !progress_cancelled(p)) look(r, &r->cells[i]);
    if (progress_cancelled(p)) return status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    for (size_t l = 0; l < r->coarse->n_lights; l++) {
        sum[l] = 0;
        for (size_t i = 0; i < r->n; i++) sum[l] += (double)r->cells[i].error[l];
    }
    return LAM_OK;
}

/* True for the lights that count: those whose error is too large, and is not far below that of the other one.
 */
static bool counts(const adaptive_run *r, const double *sum, size_t light) {
    double most = 0;
    for (size_t l = 0; l < r->coarse->n_lights; l++) most = fmax(most, sum[l]);
    return sum[light] > r->how->error * r->how->error && sum[light] >= most / 2;
}

/* The square of the error of a cell that can be halved, over the lights that count; *side is the edge along
 * which these change most. */
static double rank(const adaptive_run *r, const adaptive_cell *c, const double *sum, size_t *side) {
    double all = 0, rough[SIDES] = {0};
    bool can = false;
    for (size_t l = 0; l < r->coarse->n_lights; l++) {
        if (!counts(r, sum, l)) continue;
        all += (double)c->blurred[l];
        for (size_t s = 0; s < SIDES; s++) rough[s] += (double)c->rough[l][s];
    }
    for (size_t s = 0; s < SIDES; s++) {
        if (!c->can[s] || (can && rough[s] <= rough[*side])) continue;
        can = true;
        *side = s;
    }
    return can ? all : 0;
}

typedef struct ranked {
    double gain;
    size_t cell;
} ranked;

static int by_gain(const void *a, const void *b) {
    const ranked *x = a, *y = b;
    if (x->gain != y->gain) return x->gain < y->gain ? 1 : -1;
    return x->cell < y->cell ? -1 : 1;
}

/* Halves cells i with side[i] < SIDES; the halves take their place. */
static lam_status halve(adaptive_run *r, const uint8_t *side, lam_error *error) {
    size_t n = 0, at = 0;
    for (size_t i = 0; i < r->n; i++) n += side[i] < SIDES ? 2 : 1;
    adaptive_cell *cells = memory_allocate(n, sizeof *cells, "cells of a mesh", error);
    if (cells == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < r->n; i++) {
        mesh_cell halves[2];
        if (side[i] < SIDES && mesh_cell_halve(&r->cells[i].cell, side[i], halves)) {
            for (int k = 0; k < 2; k++) cells[at++] = (adaptive_cell){.cell = halves[k]};
        } else {
            cells[at++] = r->cells[i];
        }
    }
    free(r->cells);
    r->cells = cells;
    r->n = at;
    return LAM_OK;
}

/* Halves the cells of the largest gains; *halved is their number. */
static lam_status halve_best(adaptive_run *r, const double *sum, size_t *halved, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t sides = r->how->two_sided ? 2 : 1, most = r->how->elements / sides;
    ranked *order = memory_allocate(r->n, sizeof *order, "cells of a mesh", error);
    uint8_t *side = memory_allocate(r->n, sizeof *side, "cells of a mesh", error);
    if (order == NULL || side == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < r->n; i++) {
        size_t s = SIDES;
        order[i] = (ranked){rank(r, &r->cells[i], sum, &s), i};
        side[i] = SIDES;
    }
    qsort(order, r->n, sizeof *order, by_gain);
    size_t count = r->n / ROUND_SHARE + 1;
    if (most <= r->n) count = 0;
    if (count > 0 && count > most - r->n) count = most - r->n;
    *halved = 0;
    for (size_t k = 0; k < count && order[k].gain > round_least * order[0].gain; k++, (*halved)++) {
        size_t s = SIDES;
        (void)rank(r, &r->cells[order[k].cell], sum, &s);
        side[order[k].cell] = (uint8_t)s;
    }
    if (*halved > 0) TRY(halve(r, side, error));
done:
    free(order);
    free(side);
    return status;
}

/* The cells to begin with. */
static lam_status begin(adaptive_run *r, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_cell *cells = NULL;
    double area = 0;
    for (size_t i = 0; i < r->m->n; i++) area += r->m->area[i];
    TRY(mesh_cells_even(r->m, largest_share * area, r->how->elements / (r->how->two_sided ? 2 : 1), &cells,
                        &r->n, error));
    r->cells = memory_allocate(r->n, sizeof *r->cells, "cells of a mesh", error);
    if (r->cells == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < r->n; i++) r->cells[i] = (adaptive_cell){.cell = cells[i]};
done:
    free(cells);
    return status;
}

/* Halves cells until the errors of all are small enough or there are as many as may be. Cells stay whole
 * where noise makes their errors look small, so that the sum is too small by then: it is found afresh before
 * it is believed. */
static lam_status refine_cells(adaptive_run *r, adaptive_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const double asked = r->how->error * r->how->error;
    double sum[COARSE_LIGHTS] = {0};
    size_t halved = 1;
    TRY(begin(r, error));
    for (bool afresh = false; halved > 0 || !afresh;) {
        afresh = halved == 0 || report->reached;
        r->pass += afresh;
        for (size_t i = 0; afresh && i < r->n; i++) r->cells[i].looked = false;
        TRY(look_at_new(r, sum, error));
        report->reached = true;
        for (size_t l = 0; l < r->coarse->n_lights; l++) report->reached = report->reached && sum[l] <= asked;
        progress_report(r->how->progress, "mesh", fmin(1, (double)r->n / (double)r->how->elements));
        halved = 0;
        if (!report->reached) TRY(halve_best(r, sum, &halved, error));
    }
    report->has_lamps = r->coarse->lamps;
    report->lamps = r->coarse->lamps ? sqrt(fmax(0, sum[0])) : 0;
    report->even = sqrt(fmax(0, sum[r->coarse->n_lights - 1]));
done:
    return status;
}

/* sum A |B - E|^2 of each light; at least a number above 0. */
static void weigh(const coarse_light *c, double *all) {
    const size_t n = c->m.n, vector = n * c->m.n_channels;
    for (size_t l = 0; l < c->n_lights; l++) {
        all[l] = 1e-300;
        for (size_t k = 0; k < vector; k++) {
            const double x = (double)c->B[l * vector + k] - (double)c->E[l * vector + k];
            all[l] += c->m.area[k % n] * x * x;
        }
    }
}

lam_status adaptive_refine(mesh *m, const adaptive_options *how, adaptive_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    coarse_light coarse = {.n_lights = 0};
    gather *g = NULL;
    mesh_cell *cells = NULL;
    mesh fine = {0};
    adaptive_run r = {.m = m, .how = how, .coarse = &coarse};
    adaptive_report made = {.reached = false};
    TRY(coarse_light_make(m, how->two_sided, how->seed, how->progress, &coarse, error));
    TRY(gather_create(&coarse.m, coarse.n_lights, coarse.B, coarse.lamps ? coarse.E : NULL, &g, error));
    r.g = g;
    weigh(&coarse, r.all);
    TRY(refine_cells(&r, &made, error));
    if (r.n > m->n) {
        cells = memory_allocate(r.n, sizeof *cells, "cells of a mesh", error);
        if (cells == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < r.n; i++) cells[i] = r.cells[i].cell;
        TRY(mesh_of_cells(m, r.n, cells, &fine, error));
        mesh_replace(m, &fine);
    }
    *report = made;
done:
    free(cells);
    free(r.cells);
    gather_free(g);
    coarse_light_free(&coarse);
    return status;
}
