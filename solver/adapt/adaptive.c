#include "solver/adapt/adaptive.h"

#include "solver/adapt/cell_look.h"
#include "solver/base/random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Faces are first halved into cells of at most this share of all area, so that no shadow falls between the
 * points of a cell. */
static const double largest_share = 1. / 128;

/* In a round those cells are cut which gain at least a fraction of the best, an eighth of all at most. */
enum { ROUND_SHARE = 8 };
static const double round_least = 1. / 8;

typedef struct adaptive_cell {
    mesh_cell cell;
    uint64_t key; /* of its samples */
    bool looked;
    cell_look look;
} adaptive_cell;

typedef struct adaptive_run {
    const mesh *m; /* faces */
    const adaptive_options *how;
    const coarse_light *coarse;
    cell_light light;
    adaptive_cell *cells;
    size_t n;
    uint64_t pass; /* the number of times that all cells were looked at afresh */
} adaptive_run;

/* Looks at all cells that are new, and sums the squares of errors. */
static lam_status look_at_new(adaptive_run *r, double *sum, lam_error *error) {
    const progress *p = r->how->progress;
#pragma omp parallel for schedule(dynamic, 4)
    for (size_t i = 0; i < r->n; i++)
        if (!r->cells[i].looked && !progress_cancelled(p)) {
            const uint64_t key = random_hash(r->cells[i].key + r->pass);
            cell_look_at(&r->light, &r->cells[i].cell, key, &r->cells[i].look);
            r->cells[i].looked = true;
        }
    if (progress_cancelled(p)) return status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    for (size_t l = 0; l < r->coarse->n_lights; l++) {
        sum[l] = 0;
        for (size_t i = 0; i < r->n; i++) sum[l] += (double)r->cells[i].look.error[l];
    }
    return LAM_OK;
}

/* The weights of lights: 0 where the error is small enough, and less the farther it is below the largest, as
 * that one decides. */
static void weigh_lights(const adaptive_run *r, const double *sum, double *weight) {
    double most = 0;
    for (size_t l = 0; l < r->coarse->n_lights; l++) most = fmax(most, sum[l]);
    for (size_t l = 0; l < r->coarse->n_lights; l++)
        weight[l] = sum[l] > r->how->error * r->how->error ? pow(sum[l] / most, 4) : 0;
}

/* The most that a cut takes off the square of a cell's error, and that cut; 0 where none can be made. */
static double best_gain(const adaptive_run *r, const cell_look *look, const double *weight, size_t *best) {
    double most = 0;
    for (size_t k = 0; k < look->n_cuts; k++) {
        double gain = 0;
        for (size_t l = 0; l < r->coarse->n_lights; l++) gain += weight[l] * (double)look->of[k].gain[l];
        if (gain > most) most = gain, *best = k;
    }
    return most;
}

typedef struct ranked {
    double gain;
    size_t cell, cut;
} ranked;

static int by_gain(const void *a, const void *b) {
    const ranked *x = a, *y = b;
    if (x->gain != y->gain) return x->gain < y->gain ? 1 : -1;
    return x->cell < y->cell ? -1 : 1;
}

/* Cuts cells i with cut[i] < MESH_CUTS_MOST; the parts take their place. */
static lam_status cut_cells(adaptive_run *r, const uint8_t *cut, lam_error *error) {
    size_t n = 0, at = 0;
    for (size_t i = 0; i < r->n; i++) n += cut[i] < MESH_CUTS_MOST ? 2 : 1;
    adaptive_cell *cells = memory_allocate(n, sizeof *cells, "cells of a mesh", error);
    if (cells == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < r->n; i++) {
        mesh_cell parts[2];
        const adaptive_cell *c = &r->cells[i];
        if (cut[i] < MESH_CUTS_MOST && mesh_cell_cut(&c->cell, c->look.of[cut[i]].cut, parts)) {
            for (int k = 0; k < 2; k++)
                cells[at++] = (adaptive_cell){.cell = parts[k], .key = random_hash(2 * c->key + (uint64_t)k)};
        } else {
            cells[at++] = *c;
        }
    }
    free(r->cells);
    r->cells = cells;
    r->n = at;
    return LAM_OK;
}

/* Cuts the cells of the largest gains; *n_cut is their number. */
static lam_status cut_best(adaptive_run *r, const double *sum, size_t *n_cut, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t sides = r->how->two_sided ? 2 : 1, most = r->how->elements / sides;
    double weight[COARSE_LIGHTS];
    ranked *order = memory_allocate(r->n, sizeof *order, "cells of a mesh", error);
    uint8_t *cut = memory_allocate(r->n, sizeof *cut, "cells of a mesh", error);
    if (order == NULL || cut == NULL) TRY(LAM_ERR_MEMORY);
    weigh_lights(r, sum, weight);
    for (size_t i = 0; i < r->n; i++) {
        order[i] = (ranked){.cell = i};
        order[i].gain = best_gain(r, &r->cells[i].look, weight, &order[i].cut);
        cut[i] = MESH_CUTS_MOST;
    }
    qsort(order, r->n, sizeof *order, by_gain);
    size_t count = r->n / ROUND_SHARE + 1;
    if (most <= r->n) count = 0;
    if (count > 0 && count > most - r->n) count = most - r->n;
    *n_cut = 0;
    for (size_t k = 0; k < count && order[k].gain > round_least * order[0].gain; k++, (*n_cut)++)
        cut[order[k].cell] = (uint8_t)order[k].cut;
    if (*n_cut > 0) TRY(cut_cells(r, cut, error));
done:
    free(order);
    free(cut);
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
    for (size_t i = 0; i < r->n; i++)
        r->cells[i] = (adaptive_cell){.cell = cells[i],
                                      .key = random_hash(random_hash(r->how->seed) ^ random_hash(i + 1))};
done:
    free(cells);
    return status;
}

/* Cuts cells until the errors of all are small enough or there are as many as may be. Cells stay whole
 * where noise makes their errors look small, so that the sum is too small by then: it is found afresh before
 * it is believed. */
static lam_status refine_cells(adaptive_run *r, adaptive_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const double asked = r->how->error * r->how->error;
    double sum[COARSE_LIGHTS] = {0};
    size_t n_cut = 1;
    TRY(begin(r, error));
    for (bool afresh = false; n_cut > 0 || !afresh;) {
        afresh = n_cut == 0 || report->reached;
        r->pass += afresh;
        for (size_t i = 0; afresh && i < r->n; i++) r->cells[i].looked = false;
        TRY(look_at_new(r, sum, error));
        report->reached = true;
        for (size_t l = 0; l < r->coarse->n_lights; l++) report->reached = report->reached && sum[l] <= asked;
        progress_report(r->how->progress, "mesh", fmin(1, (double)r->n / (double)r->how->elements));
        n_cut = 0;
        if (!report->reached) TRY(cut_best(r, sum, &n_cut, error));
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
    TRY(gather_create(&coarse.m, coarse.n_lights, coarse.B, coarse.lamps ? coarse.E : NULL,
                      GATHER_LAMP_SAMPLES_MOST, NULL, &g, error));
    r.light = (cell_light){.m = m, .coarse = &coarse, .g = g, .two_sided = how->two_sided};
    weigh(&coarse, r.light.all);
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
