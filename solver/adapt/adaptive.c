#include "solver/adapt/adaptive.h"

#include "solver/adapt/cell_cut.h"
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

/* A cell is cut by what enough points show, its own and those that it inherited; steps are of its first look.
 * Of many cells fewer points say what all leave. Where the points of all cells would take more than some
 * bytes, none are kept, and a cell is cut by what one look shows. */
typedef struct look_plan {
    size_t steps, enough;
} look_plan;
static const look_plan thorough = {6, 192}, rough = {4, 96};
enum { MANY = 4096, MANY_STEPS = 4 };
static const size_t points_bytes_most = (size_t)256 << 20;

typedef struct adaptive_cell {
    mesh_cell cell;
    uint64_t key; /* of its samples */
    size_t steps; /* of the look that it waits for; 0: none */
    float error[COARSE_LIGHTS];
    cell_cut best[COARSE_LIGHTS];
    cell_points points;
} adaptive_cell;

typedef struct adaptive_run {
    look_plan looks;
    const adaptive_options *how;
    const cell_light *light;
    adaptive_cell *cells;
    size_t n;
    size_t points; /* that were looked at */
    bool keep;     /* the points of cells */
} adaptive_run;

/* Looks at those of the cells first ... end - 1 that wait for it. */
static lam_status look_at_some(adaptive_run *r, size_t first, size_t end, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t values = cell_light_values(r->light);
    for (size_t i = first; i < end; i++) {
        adaptive_cell *c = &r->cells[i];
        const size_t more = c->steps * c->steps;
        r->points += more;
        if (more > 0) TRY(cell_points_reserve(&c->points, values, CELL_POINTS_MOST - more, more, error));
    }
#pragma omp parallel for schedule(dynamic, 4)
    for (size_t i = first; i < end; i++) {
        adaptive_cell *c = &r->cells[i];
        if (c->steps == 0 || progress_cancelled(r->how->progress)) continue;
        cell_look_at(r->light, &c->cell, c->key, c->steps, &c->points, c->error);
        cell_cut_find(r->light, &c->cell, &c->points, c->best);
        c->key = random_hash(c->key);
        c->steps = 0;
    }
    for (size_t i = first; i < end && !r->keep; i++) cell_points_free(&r->cells[i].points);
    if (progress_cancelled(r->how->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
done:
    return status;
}

/* Looks at all cells that wait for it, and sums the squares of errors. */
static lam_status look_at_waiting(adaptive_run *r, double *sum, lam_error *error) {
    enum { BATCH = 4096 };
    lam_status status = LAM_OK;
    const size_t bytes = r->looks.enough * cell_points_bytes(cell_light_values(r->light));
    r->keep = r->keep && r->n * bytes <= points_bytes_most;
    for (size_t i = 0; i < r->n; i += BATCH)
        TRY(look_at_some(r, i, i + BATCH < r->n ? i + BATCH : r->n, error));
    for (size_t l = 0; l < r->light->coarse->n_lights; l++) {
        sum[l] = 0;
        for (size_t i = 0; i < r->n; i++) sum[l] += (double)r->cells[i].error[l];
    }
done:
    return status;
}

/* The largest error of all lights. */
static double largest_error(const adaptive_run *r, const double *sum) {
    double most = 0;
    for (size_t l = 0; l < r->light->coarse->n_lights; l++) most = fmax(most, sum[l]);
    return sqrt(most);
}

/* The weights of lights: 0 where the error is small enough, and less the farther it is below the largest, as
 * that one decides. */
static void weigh_lights(const adaptive_run *r, const double *sum, double *weight) {
    const double most = largest_error(r, sum);
    for (size_t l = 0; l < r->light->coarse->n_lights; l++)
        weight[l] = sum[l] > r->how->error * r->how->error ? pow(sum[l] / (most * most), 4) : 0;
}

/* The most that a cut takes off the square of a cell's error, and the light that it is best for; 0 where none
 * can be made. */
static double best_gain(const adaptive_run *r, const adaptive_cell *c, const double *weight, size_t *best) {
    double most = 0;
    for (size_t k = 0; k < r->light->coarse->n_lights; k++) {
        double gain = 0;
        for (size_t l = 0; l < r->light->coarse->n_lights; l++)
            gain += weight[l] * (double)c->best[k].gain[l];
        if (c->best[k].gain[k] > 0 && gain > most) most = gain, *best = k;
    }
    return most;
}

/* Steps of a look of at least some points. */
static size_t steps_of(const adaptive_run *r, size_t points) {
    size_t steps = r->looks.steps;
    while (steps * steps < points) steps++;
    return steps;
}

typedef struct ranked {
    double gain;
    size_t cell, light;
} ranked;

static int by_gain(const void *a, const void *b) {
    const ranked *x = a, *y = b;
    if (x->gain != y->gain) return x->gain < y->gain ? 1 : -1;
    return x->cell < y->cell ? -1 : 1;
}

/* The parts of a cell by a cut, with the points of theirs. */
static lam_status cut_cell(const adaptive_run *r, const adaptive_cell *c, mesh_cut cut,
                           adaptive_cell parts[2], lam_error *error) {
    mesh_cell cells[2];
    float from[2], to[2];
    for (int k = 0; k < 2; k++) parts[k] = (adaptive_cell){.steps = 0};
    if (!mesh_cell_cut(&c->cell, cut, cells)) return status_fail(error, LAM_ERR_INTERNAL, "a cut of nothing");
    for (int k = 0; k < 2; k++)
        parts[k] = (adaptive_cell){
            .cell = cells[k], .key = random_hash(2 * c->key + (uint64_t)k), .steps = r->looks.steps};
    cell_cut_way(r->light, &c->cell, cut, from, to);
    return cell_points_part(&c->points, from, to, &parts[1].points, &parts[0].points, error);
}

enum { WHOLE = COARSE_LIGHTS };

/* Cuts cells i with light[i] < WHOLE as is best for that light; the parts take their place. */
static lam_status cut_cells(adaptive_run *r, const uint8_t *light, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0, at = 0;
    for (size_t i = 0; i < r->n; i++) n += light[i] < WHOLE ? 2 : 1;
    adaptive_cell *cells = memory_allocate(n, sizeof *cells, "cells of a mesh", error);
    if (cells == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < r->n; i++) {
        adaptive_cell *c = &r->cells[i];
        if (light[i] < WHOLE && status == LAM_OK) {
            status = cut_cell(r, c, c->best[light[i]].cut, cells + at, error);
            cell_points_free(&c->points);
            at += 2;
        } else {
            cells[at++] = *c;
        }
    }
    free(r->cells);
    r->cells = cells;
    r->n = at;
    return status;
}

/* The elements that a cell becomes. */
static size_t sides_of(const adaptive_run *r, const adaptive_cell *c) {
    return r->light->m->has_back != NULL && r->light->m->has_back[c->cell.face] ? 2 : 1;
}

/* Cuts the cells of the largest gains, or has those looked at again that show too few points for it; *n_more
 * is the number of both. */
static lam_status cut_best(adaptive_run *r, const double *sum, size_t *n_more, lam_error *error) {
    lam_status status = LAM_OK;
    double weight[COARSE_LIGHTS];
    ranked *order = memory_allocate(r->n, sizeof *order, "cells of a mesh", error);
    uint8_t *light = memory_allocate(r->n, sizeof *light, "cells of a mesh", error);
    if (order == NULL || light == NULL) TRY(LAM_ERR_MEMORY);
    weigh_lights(r, sum, weight);
    for (size_t i = 0; i < r->n; i++) {
        order[i] = (ranked){.cell = i};
        order[i].gain = best_gain(r, &r->cells[i], weight, &order[i].light);
        light[i] = WHOLE;
    }
    qsort(order, r->n, sizeof *order, by_gain);
    const size_t count = r->n / ROUND_SHARE + 1;
    size_t made = 0;
    for (size_t i = 0; i < r->n; i++) made += sides_of(r, &r->cells[i]);
    *n_more = 0;
    for (size_t k = 0; k < count && order[k].gain > round_least * order[0].gain; k++, (*n_more)++) {
        adaptive_cell *c = &r->cells[order[k].cell];
        made += sides_of(r, c);
        if (made > r->how->elements) break;
        if (r->keep && c->points.n < r->looks.enough)
            c->steps = steps_of(r, r->looks.enough - c->points.n);
        else
            light[order[k].cell] = (uint8_t)order[k].light;
    }
    if (*n_more > 0) TRY(cut_cells(r, light, error));
done:
    free(order);
    free(light);
    return status;
}

/* Steps of a look at all cells: of many of them fewer points say what all leave. */
static size_t steps_of_all(const adaptive_run *r) {
    return r->n < MANY ? r->looks.steps : MANY_STEPS;
}

static bool points_are_left(const adaptive_run *r) {
    return r->how->points == 0 || r->points < r->how->points;
}

/* The cells to begin with. */
static lam_status begin(adaptive_run *r, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_cell *cells = NULL;
    double area = 0;
    for (size_t i = 0; i < r->light->m->n; i++) area += r->light->m->area[i];
    TRY(mesh_cells_even(r->light->m, largest_share * area,
                        r->how->elements / (r->light->m->has_back != NULL ? 2 : 1), &cells, &r->n, error));
    r->cells = memory_allocate(r->n, sizeof *r->cells, "cells of a mesh", error);
    if (r->cells == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < r->n; i++)
        r->cells[i] = (adaptive_cell){.cell = cells[i],
                                      .key = random_hash(random_hash(r->how->seed) ^ random_hash(i + 1)),
                                      .steps = steps_of_all(r)};
done:
    free(cells);
    return status;
}

/* Cuts cells until the errors of all are small enough or there are as many as may be. Cells stay whole
 * where noise makes their errors look small, so that the sum is too small by then: it is found afresh before
 * it is believed. */
static lam_status refine_cells(adaptive_run *r, adaptive_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    double sum[COARSE_LIGHTS] = {0};
    size_t n_more = 1;
    bool chosen = false; /* by their errors, some have been cut or looked at again */
    TRY(begin(r, error));
    for (bool afresh = false; n_more > 0 || !afresh;) {
        afresh = n_more == 0;
        for (size_t i = 0; afresh && chosen && i < r->n; i++) r->cells[i].steps = steps_of_all(r);
        TRY(look_at_waiting(r, sum, error));
        progress_report(r->how->progress, "mesh", fmin(1, (double)r->n / (double)r->how->elements));
        report->reached = largest_error(r, sum) <= r->how->error;
        n_more = 0;
        if (!report->reached && points_are_left(r)) TRY(cut_best(r, sum, &n_more, error));
        chosen = chosen || n_more > 0;
    }
    report->left = mesh_estimate_of(r->light->coarse, sum);
done:
    return status;
}

lam_status adaptive_refine_by(const cell_light *light, const adaptive_options *how, mesh *out,
                              adaptive_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_cell *cells = NULL;
    adaptive_run r = {.looks = how->rough ? rough : thorough, .light = light, .how = how, .keep = true};
    TRY(refine_cells(&r, report, error));
    cells = memory_allocate(r.n, sizeof *cells, "cells of a mesh", error);
    if (cells == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < r.n; i++) cells[i] = r.cells[i].cell;
    TRY(mesh_of_cells(light->m, r.n, cells, out, error));
done:
    free(cells);
    for (size_t i = 0; r.cells != NULL && i < r.n; i++) cell_points_free(&r.cells[i].points);
    free(r.cells);
    return status;
}

lam_status adaptive_refine(mesh *m, const adaptive_options *how, adaptive_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    light_scene by = {.g = NULL};
    mesh fine = {0};
    adaptive_report made = {.reached = false};
    TRY(light_scene_make(m, &how->from, how->seed, how->progress, &by, error));
    TRY(adaptive_refine_by(&by.light, how, &fine, &made, error));
    if (fine.n > m->n) mesh_replace(m, &fine);
    *report = made;
done:
    mesh_free(&fine);
    light_scene_free(&by);
    return status;
}
