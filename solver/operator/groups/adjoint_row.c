#include "solver/operator/groups/adjoint_row.h"

#include "solver/operator/groups/gradient.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Limits of trying all groups and tiles: numbers read (some tenths of a second) and weights kept. */
#define MOST_WORK ((double)(1u << 28))
#define MOST_WEIGHTS ((double)(1u << 24))

size_t linear_scene_tiles(const linear_scene *s) {
    return s->sky != NULL ? lam_sky_tiles(s->sky) : 0;
}

size_t linear_scene_luminaires(const linear_scene *s) {
    return s->luminaires != NULL ? lam_luminaires_count(s->luminaires) : 0;
}

/* Numbers of a row for one channel: elements, or emitters of a store of few. */
static size_t row_width(const linear_scene *s) {
    return s->n_emitters > 0 ? s->n_emitters : s->n;
}

size_t adjoint_row_bytes(const linear_scene *s) {
    return sizeof(adjoint_row) +
           s->n_channels *
               (s->groups->n_groups * sizeof(double) +
                (linear_scene_tiles(s) + linear_scene_luminaires(s) + row_width(s)) * sizeof(float));
}

size_t adjoint_pass_bytes(const linear_scene *s, size_t count) {
    return count * s->n_channels * (s->n + row_width(s)) * sizeof(float);
}

adjoint_row *adjoint_row_create(const linear_scene *s, const uint32_t *groups, size_t n_groups,
                                lam_quantity quantity) {
    const size_t C = s->n_channels;
    adjoint_row *row = memory_allocate(1, sizeof *row, "an adjoint row", NULL);
    if (row == NULL) return NULL;
    row->groups = groups;
    row->n_groups = n_groups;
    row->quantity = quantity;
    row->bytes = adjoint_row_bytes(s);
    float **const numbers = s->n_emitters > 0 ? &row->emitters : &row->w;
    *numbers = memory_allocate(C, row_width(s) * sizeof **numbers, "a row", NULL);
    row->of_group = memory_allocate(C, s->groups->n_groups * sizeof *row->of_group, "a row", NULL);
    row->tiles = memory_allocate(C, linear_scene_tiles(s) * sizeof *row->tiles, "a row", NULL);
    row->luminaires = memory_allocate(C, linear_scene_luminaires(s) * sizeof *row->luminaires, "a row", NULL);
    const bool good =
        *numbers != NULL && row->of_group != NULL && row->tiles != NULL && row->luminaires != NULL;
    if (good) return row;
    adjoint_row_free(row);
    return NULL;
}

void adjoint_row_free(adjoint_row *row) {
    if (row == NULL) return;
    free(row->w);
    free(row->of_group);
    free(row->tiles);
    free(row->luminaires);
    free(row->emitters);
    free(row);
}

/* g = A 1_group / sum A in every channel. A and the sum are of elements that figures take in; buried is the
 * share of the area of all that they leave out. */
void adjoint_row_cotangent(const linear_scene *s, adjoint_row *row, float *g) {
    const group_index *groups = s->groups;
    double total = 0, all = 0;
    for (size_t m = 0; m < row->n_groups; m++)
        for (size_t e = groups->start[row->groups[m]]; e < groups->start[row->groups[m] + 1]; e++) {
            const double area = s->area[groups->elements[e]];
            all += area;
            if (group_index_counts(groups, groups->elements[e])) total += area;
        }
    row->area = total;
    row->buried = all > 0 ? 1 - total / all : 0;
    memset(g, 0, s->n_channels * s->n * sizeof *g);
    for (size_t m = 0; total > 0 && m < row->n_groups; m++)
        for (size_t e = groups->start[row->groups[m]]; e < groups->start[row->groups[m] + 1]; e++) {
            const size_t i = groups->elements[e];
            const double share = group_index_counts(groups, i) ? s->area[i] / total : 0;
            for (size_t c = 0; c < s->n_channels; c++) g[c * s->n + i] = (float)share;
        }
}

size_t emitter_weights_bytes(const linear_scene *s) {
    const size_t m = linear_scene_tiles(s), all = s->groups->n_groups + m;
    const double C = (double)s->n_channels, count = (double)all;
    if (s->n_emitters == 0 || count * C * C * (double)(s->n + m) > MOST_WORK ||
        count * C * (double)s->n_emitters > MOST_WEIGHTS)
        return 0;
    return sizeof(emitter_weights) + all * s->n_channels * s->n_emitters * sizeof(float);
}

/* weights [s]: emitters whose sum is this E and L (either NULL) of channel c alone; the first is NaN if there
 * are none. all: [C][s], scratch. */
static void find_weights(const linear_scene *s, size_t c, const float *E, const float *L, float *all,
                         float *weights) {
    const size_t n_emitters = s->n_emitters;
    if (lam_operator_weights(s->op, 1, E, linear_scene_tiles(s), L, all, NULL) == LAM_OK)
        memcpy(weights, all + c * n_emitters, n_emitters * sizeof *weights);
    else
        weights[0] = NAN;
}

static void find_group_weights(const linear_scene *s, float *E, float *all, float *weights) {
    const group_index *groups = s->groups;
    for (size_t g = 0; g < groups->n_groups; g++)
        for (size_t c = 0; c < s->n_channels; c++, weights += s->n_emitters) {
            for (size_t e = groups->start[g]; e < groups->start[g + 1]; e++)
                E[c * s->n + groups->elements[e]] = 1;
            find_weights(s, c, E, NULL, all, weights);
            for (size_t e = groups->start[g]; e < groups->start[g + 1]; e++)
                E[c * s->n + groups->elements[e]] = 0;
        }
}

static void find_tile_weights(const linear_scene *s, float *L, float *all, float *weights) {
    const size_t m = linear_scene_tiles(s);
    for (size_t t = 0; t < m; t++)
        for (size_t c = 0; c < s->n_channels; c++, weights += s->n_emitters) {
            L[c * m + t] = 1;
            find_weights(s, c, NULL, L, all, weights);
            L[c * m + t] = 0;
        }
}

emitter_weights *emitter_weights_create(const linear_scene *s) {
    const size_t C = s->n_channels, row = C * s->n_emitters, m = linear_scene_tiles(s);
    emitter_weights *made = memory_allocate(1, sizeof *made, "weights", NULL);
    float *E = memory_allocate(C, (s->n > m ? s->n : m) * sizeof *E, "weights", NULL);
    float *all = memory_allocate(row, sizeof *all, "weights", NULL);
    if (made != NULL) {
        made->of_group = memory_allocate(s->groups->n_groups, row * sizeof(float), "weights", NULL);
        made->of_tile = memory_allocate(m, row * sizeof(float), "weights", NULL);
        made->bytes = emitter_weights_bytes(s);
    }
    const bool good =
        made != NULL && made->of_group != NULL && made->of_tile != NULL && E != NULL && all != NULL;
    if (good) {
        find_group_weights(s, E, all, made->of_group);
        find_tile_weights(s, E, all, made->of_tile);
    } else {
        emitter_weights_free(made);
    }
    free(E);
    free(all);
    return good ? made : NULL;
}

void emitter_weights_free(emitter_weights *weights) {
    if (weights == NULL) return;
    free(weights->of_group);
    free(weights->of_tile);
    free(weights);
}

/* sum_k a_k x_k */
static double product(const float *a, const float *x, size_t count) {
    double sum = 0;
    for (size_t k = 0; k < count; k++) sum += (double)a[k] * (double)x[k];
    return sum;
}

/* w is [C][n]; g is overwritten by dJ/dH0. */
static void fill_from_elements(const linear_scene *s, const float *w, float *g, adjoint_row *row) {
    const size_t n = s->n, C = s->n_channels, n_groups = s->groups->n_groups;
    memcpy(row->w, w, C * n * sizeof *w);
    for (size_t c = 0; c < C; c++)
        for (size_t h = 0; h < n_groups; h++) {
            double sum = 0;
            for (size_t e = s->groups->start[h]; e < s->groups->start[h + 1]; e++)
                sum += (double)w[c * n + s->groups->elements[e]];
            row->of_group[c * n_groups + h] = sum;
        }
    if (s->sky == NULL && s->luminaires == NULL) return;
    gradient_of_direct_irradiance(row->quantity, C * n, s->reflectance, g, w, g);
    if (s->sky != NULL) lam_sky_adjoint(s->sky, C, g, row->tiles);
    if (s->luminaires != NULL) lam_luminaires_adjoint(s->luminaires, 1, g, row->luminaires);
}

/* w is [C][s]; entries of groups and tiles without weights become NaN. */
static void fill_from_emitters(const linear_scene *s, const emitter_weights *weights, const float *w,
                               adjoint_row *row) {
    const size_t n_emitters = s->n_emitters, C = s->n_channels, m = linear_scene_tiles(s),
                 k = linear_scene_luminaires(s), n_groups = s->groups->n_groups;
    for (size_t c = 0; c < C; c++) /* which are the last emitters */
        memcpy(row->luminaires + c * k, w + (c + 1) * n_emitters - k, k * sizeof *w);
    memcpy(row->emitters, w, C * n_emitters * sizeof *w);
    for (size_t c = 0; c < C; c++) {
        for (size_t h = 0; h < n_groups; h++)
            row->of_group[c * n_groups + h] =
                weights == NULL
                    ? NAN
                    : product(weights->of_group + (h * C + c) * n_emitters, w + c * n_emitters, n_emitters);
        for (size_t t = 0; t < m; t++)
            row->tiles[c * m + t] = weights == NULL
                                        ? NAN
                                        : (float)product(weights->of_tile + (t * C + c) * n_emitters,
                                                         w + c * n_emitters, n_emitters);
    }
}

lam_status adjoint_rows_fill(const linear_scene *s, const emitter_weights *weights, lam_quantity quantity,
                             size_t count, float *g, void *work, size_t work_bytes, adjoint_row *const *rows,
                             lam_error *error) {
    const size_t n = s->n, C = s->n_channels, width = row_width(s);
    float *const w = g + count * C * n;
    const lam_status status =
        s->n_emitters > 0
            ? lam_operator_adjoint_emitters(s->op, count, quantity, g, w, work, work_bytes, error)
            : lam_operator_apply_adjoint(s->op, count, quantity, g, w, work, work_bytes, error);
    if (status != LAM_OK) return status;
    for (size_t k = 0; k < count; k++)
        if (s->n_emitters > 0)
            fill_from_emitters(s, weights, w + k * C * width, rows[k]);
        else
            fill_from_elements(s, w + k * C * width, g + k * C * n, rows[k]);
    return LAM_OK;
}

bool adjoint_row_suffices(const linear_scene *s, const adjoint_row *row, const source_light *light) {
    const size_t C = s->n_channels, m = linear_scene_tiles(s);
    if (row->emitters == NULL) return true;
    if (light->E != NULL) return false;
    for (size_t k = 0; k < light->n_spots; k++)
        for (size_t c = 0; c < C; c++)
            if (light->colours[k * C + c] != 0 &&
                (!light->spots[k].whole_group ||
                 isnan(row->of_group[c * s->groups->n_groups + light->spots[k].where])))
                return false;
    for (size_t t = 0; light->L != NULL && t < C * m; t++)
        if (light->L[t] != 0 && isnan(row->tiles[t])) return false;
    return true;
}

/* means += sum_t w_t row_t of the weights of a side and its part of a row, both [C][width]. A weight of 0 is
 * skipped, so that NaN of the row does no harm. */
static void add_side(size_t n_channels, const float *values, size_t width, const float *row, double *means) {
    for (size_t c = 0; values != NULL && c < n_channels; c++) {
        double sum = 0;
        for (size_t t = 0; t < width; t++) {
            const float weight = values[c * width + t];
            if (weight != 0) sum += (double)weight * (double)row[c * width + t];
        }
        means[c] += sum;
    }
}

void adjoint_row_evaluate(const linear_scene *s, const adjoint_row *row, const source_light *light,
                          double *means) {
    const size_t n = s->n, C = s->n_channels, width = row_width(s);
    const float *const vector = row->emitters != NULL ? light->W : light->E;
    const float *const w = row->emitters != NULL ? row->emitters : row->w;
    for (size_t c = 0; c < C; c++)
        means[c] = vector != NULL ? product(w + c * width, vector + c * width, width) : 0;
    for (size_t k = 0; k < light->n_spots; k++) {
        const emission_spot *spot = &light->spots[k];
        for (size_t c = 0; c < C; c++) {
            const double value = (double)light->colours[k * C + c];
            if (value != 0)
                means[c] += value * (spot->whole_group ? row->of_group[c * s->groups->n_groups + spot->where]
                                                       : (double)row->w[c * n + spot->where]);
        }
    }
    add_side(C, light->L, linear_scene_tiles(s), row->tiles, means);
    add_side(C, light->D, linear_scene_luminaires(s), row->luminaires, means);
}

size_t adjoint_row_width(const linear_scene *s, lam_by kind) {
    return kind == LAM_BY_GROUPS       ? s->groups->n_groups
           : kind == LAM_BY_LUMINAIRES ? linear_scene_luminaires(s)
           : kind == LAM_BY_EMITTERS   ? s->n_emitters
                                       : linear_scene_tiles(s);
}

void adjoint_row_derivatives(const linear_scene *s, const adjoint_row *row, lam_by kind, size_t c,
                             float *out) {
    const size_t width = adjoint_row_width(s, kind);
    const float *const from = kind == LAM_BY_LUMINAIRES ? row->luminaires
                              : kind == LAM_BY_EMITTERS ? row->emitters
                                                        : row->tiles;
    for (size_t k = 0; k < width; k++)
        out[k] = !(row->area > 0)        ? NAN
                 : kind == LAM_BY_GROUPS ? (float)row->of_group[c * width + k]
                                         : from[c * width + k];
}
