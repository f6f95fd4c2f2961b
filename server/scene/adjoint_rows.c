#include "server/scene/adjoint_rows.h"

#include "server/scene/direct_light.h"
#include "server/scene/gradient.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Limits of trying all groups and tiles: numbers read (some tenths of a second) and weights kept. */
#define MOST_WORK ((double)(1u << 28))
#define MOST_WEIGHTS ((double)(1u << 24))

void adjoint_rows_release(const scene *s, size_t count, adjoint_row **rows) {
    row_cache_release(s->rows, count, rows);
}

bool adjoint_rows_find(const scene *s, const radiosity_request *request, adjoint_row **rows) {
    const reduce_request *reduce = &request->reduce;
    if (row_cache_find(s->rows, reduce->n_names, reduce->names, request->quantity, rows)) return true;
    adjoint_rows_release(s, reduce->n_names, rows);
    return false;
}

/* True if there are few enough to try all groups and tiles. */
static bool emitter_weights_worth(const scene *s) {
    const double C = (double)s->n_channels, count = (double)(s->groups.n_groups + scene_tiles(s));
    return count * C * C * (double)(s->n + scene_tiles(s)) <= MOST_WORK &&
           count * C * (double)s->n_emitters <= MOST_WEIGHTS;
}

/* weights [s]: emitters whose sum is this E and L (either NULL) of channel c alone; the first is NaN if there
 * are none. all: [C][s], scratch. */
static void find_weights(const scene *s, size_t c, const float *E, const float *L, float *all,
                         float *weights) {
    const size_t n_emitters = s->n_emitters;
    if (lam_operator_weights(s->op, 1, E, scene_tiles(s), L, all, NULL) == LAM_OK)
        memcpy(weights, all + c * n_emitters, n_emitters * sizeof *weights);
    else
        weights[0] = NAN;
}

static void find_group_weights(const scene *s, float *E, float *all, float *weights) {
    const group_index *groups = &s->groups;
    for (size_t g = 0; g < groups->n_groups; g++)
        for (size_t c = 0; c < s->n_channels; c++, weights += s->n_emitters) {
            for (size_t e = groups->start[g]; e < groups->start[g + 1]; e++)
                E[c * s->n + groups->elements[e]] = 1;
            find_weights(s, c, E, NULL, all, weights);
            for (size_t e = groups->start[g]; e < groups->start[g + 1]; e++)
                E[c * s->n + groups->elements[e]] = 0;
        }
}

static void find_tile_weights(const scene *s, float *L, float *all, float *weights) {
    const size_t m = scene_tiles(s);
    for (size_t t = 0; t < m; t++)
        for (size_t c = 0; c < s->n_channels; c++, weights += s->n_emitters) {
            L[c * m + t] = 1;
            find_weights(s, c, NULL, L, all, weights);
            L[c * m + t] = 0;
        }
}

/* NULL when memory is short. O(n C) for each group and tile. */
static emitter_weights *emitter_weights_make(const scene *s) {
    const size_t C = s->n_channels, row = C * s->n_emitters, m = scene_tiles(s);
    emitter_weights *made = memory_allocate(1, sizeof *made, "weights", NULL);
    float *E = memory_allocate(C, (s->n > m ? s->n : m) * sizeof *E, "weights", NULL);
    float *all = memory_allocate(row, sizeof *all, "weights", NULL);
    if (made != NULL) {
        made->of_group = memory_allocate(s->groups.n_groups, row * sizeof(float), "weights", NULL);
        made->of_tile = memory_allocate(m, row * sizeof(float), "weights", NULL);
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

static size_t row_bytes(const scene *s) {
    return sizeof(adjoint_row) + s->n_channels * (s->groups.n_groups * sizeof(double) +
                                                  (scene_tiles(s) + scene_luminaires(s) +
                                                   (s->n_emitters > 0 ? s->n_emitters : s->n)) *
                                                      sizeof(float));
}

/* Bytes of g and w of a pass for `count` rows. */
static size_t pass_bytes(const scene *s, size_t count) {
    return count * s->n_channels * (s->n + (s->n_emitters > 0 ? s->n_emitters : s->n)) * sizeof(float);
}

size_t adjoint_rows_room(const scene *s, size_t n_rows) {
    const size_t count = n_rows < BATCH_PASS ? n_rows : BATCH_PASS;
    return count * row_bytes(s) + pass_bytes(s, count);
}

size_t adjoint_rows_bytes(const scene *s, const radiosity_request *request) {
    return adjoint_rows_room(s, request->reduce.n_names);
}

size_t adjoint_rows_capacity(const scene *s) {
    const size_t count = row_cache_limit(s->rows) / row_bytes(s);
    return count < ADJOINT_ROWS_OF_REQUEST ? count : ADJOINT_ROWS_OF_REQUEST;
}

/* name: of the groups; NULL: the row is of an element. */
static adjoint_row *row_allocate(const scene *s, const reduce_name *name, lam_quantity quantity) {
    const size_t C = s->n_channels;
    adjoint_row *row = memory_allocate(1, sizeof *row, "an adjoint row", NULL);
    if (row == NULL) return NULL;
    row->groups = name != NULL ? name->groups : NULL;
    row->n_groups = name != NULL ? name->n_groups : 0;
    row->quantity = quantity;
    row->bytes = row_bytes(s);
    float **const numbers = s->n_emitters > 0 ? &row->emitters : &row->w;
    *numbers =
        memory_allocate(C, (s->n_emitters > 0 ? s->n_emitters : s->n) * sizeof **numbers, "a row", NULL);
    row->of_group = memory_allocate(C, s->groups.n_groups * sizeof *row->of_group, "a row", NULL);
    row->tiles = memory_allocate(C, scene_tiles(s) * sizeof *row->tiles, "a row", NULL);
    row->luminaires = memory_allocate(C, scene_luminaires(s) * sizeof *row->luminaires, "a row", NULL);
    const bool good =
        *numbers != NULL && row->of_group != NULL && row->tiles != NULL && row->luminaires != NULL;
    if (good) return row;
    adjoint_row_free(row);
    return NULL;
}

/* g = A 1_group / sum A in every channel, [C][n]; returns sum A. Both are of elements that figures take in;
 * *buried is the share of the area of all that they leave out. */
static double write_cotangent(const scene *s, const reduce_name *name, float *g, double *buried) {
    const group_index *groups = &s->groups;
    double total = 0, all = 0;
    for (size_t m = 0; m < name->n_groups; m++)
        for (size_t e = groups->start[name->groups[m]]; e < groups->start[name->groups[m] + 1]; e++) {
            const double area = s->area[groups->elements[e]];
            all += area;
            if (group_index_counts(groups, groups->elements[e])) total += area;
        }
    *buried = all > 0 ? 1 - total / all : 0;
    memset(g, 0, s->n_channels * s->n * sizeof *g);
    for (size_t m = 0; total > 0 && m < name->n_groups; m++)
        for (size_t e = groups->start[name->groups[m]]; e < groups->start[name->groups[m] + 1]; e++) {
            const size_t i = groups->elements[e];
            const double share = group_index_counts(groups, i) ? s->area[i] / total : 0;
            for (size_t c = 0; c < s->n_channels; c++) g[c * s->n + i] = (float)share;
        }
    return total;
}

/* sum_k a_k x_k */
static double product(const float *a, const float *x, size_t count) {
    double sum = 0;
    for (size_t k = 0; k < count; k++) sum += (double)a[k] * (double)x[k];
    return sum;
}

/* w is [C][n]; g is overwritten by dJ/dH0. */
static void fill_from_elements(const scene *s, const float *w, float *g, adjoint_row *row) {
    const size_t n = s->n, C = s->n_channels, n_groups = s->groups.n_groups;
    memcpy(row->w, w, C * n * sizeof *w);
    for (size_t c = 0; c < C; c++)
        for (size_t h = 0; h < n_groups; h++) {
            double sum = 0;
            for (size_t e = s->groups.start[h]; e < s->groups.start[h + 1]; e++)
                sum += (double)w[c * n + s->groups.elements[e]];
            row->of_group[c * n_groups + h] = sum;
        }
    if (s->sky == NULL && s->luminaires == NULL) return;
    gradient_of_direct_irradiance(row->quantity, C * n, s->reflectance, g, w, g);
    if (s->sky != NULL) lam_sky_adjoint(s->sky, C, g, row->tiles);
    if (s->luminaires != NULL) lam_luminaires_adjoint(s->luminaires, 1, g, row->luminaires);
}

/* w is [C][s]; entries of groups and tiles without weights become NaN. */
static void fill_from_emitters(const scene *s, const emitter_weights *weights, const float *w,
                               adjoint_row *row) {
    const size_t n_emitters = s->n_emitters, C = s->n_channels, m = scene_tiles(s), k = scene_luminaires(s);
    const size_t n_groups = s->groups.n_groups;
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

/* The weights of a store of emitters, made when first needed; NULL where they are not worth their memory or
 * the ledger has no room for them. False when memory is short. */
static bool get_weights(const scene *s, const emitter_weights **weights) {
    *weights = NULL;
    if (s->n_emitters == 0 || !emitter_weights_worth(s)) return true;
    *weights = row_cache_weights(s->rows);
    if (*weights != NULL) return true;
    const size_t bytes = sizeof(emitter_weights) + (s->groups.n_groups + scene_tiles(s)) * s->n_channels *
                                                       s->n_emitters * sizeof(float);
    if (!memory_ledger_take(s->ledger, bytes)) return true;
    emitter_weights *made = emitter_weights_make(s);
    if (made == NULL) {
        memory_ledger_give_back(s->ledger, bytes);
        return false;
    }
    made->bytes = bytes;
    *weights = row_cache_set_weights(s->rows, made);
    return true;
}

/* Fills the rows of `count` cotangents g [count][C][n], behind which is as much room for w, by one pass over
 * the operator. */
static bool fill_rows(const scene *s, lam_quantity quantity, size_t count, float *g,
                      batch_workspace *workspace, adjoint_row *const *rows, problem *why) {
    const size_t n = s->n, C = s->n_channels, width = s->n_emitters > 0 ? s->n_emitters : n;
    const size_t work_bytes = lam_operator_work_bytes(s->op, count);
    float *const w = g + count * C * n;
    lam_error error;
    const emitter_weights *weights;
    void *work = work_bytes > 0 ? batch_workspace_get(workspace, work_bytes) : NULL;
    if (work == NULL || !get_weights(s, &weights))
        return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for %zu adjoint rows", count);
    const lam_status status =
        s->n_emitters > 0
            ? lam_operator_adjoint_emitters(s->op, count, quantity, g, w, work, work_bytes, &error)
            : lam_operator_apply_adjoint(s->op, count, quantity, g, w, work, work_bytes, &error);
    if (status != LAM_OK) return problem_set(why, PROBLEM_INTERNAL, "%s", error.message);
    for (size_t k = 0; k < count; k++)
        if (s->n_emitters > 0)
            fill_from_emitters(s, weights, w + k * C * width, rows[k]);
        else
            fill_from_elements(s, w + k * C * width, g + k * C * n, rows[k]);
    return true;
}

/* Computes the rows of some names, rows[which[k]] that of names[which[k]], by one pass over the operator and
 * adds them to the cache. */
static bool make_rows(const scene *s, const reduce_name *names, lam_quantity quantity, size_t count,
                      const size_t *which, batch_workspace *workspace, adjoint_row **rows, problem *why) {
    const size_t vector = s->n_channels * s->n;
    adjoint_row *made[BATCH_PASS] = {NULL};
    float *const g = memory_allocate(1, pass_bytes(s, count), "rows", NULL);
    bool good = g != NULL;
    for (size_t k = 0; good && k < count; k++)
        good = (made[k] = row_allocate(s, &names[which[k]], quantity)) != NULL;
    if (!good)
        problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the adjoint rows of %zu groups", count);
    for (size_t k = 0; good && k < count; k++)
        made[k]->area = write_cotangent(s, &names[which[k]], g + k * vector, &made[k]->buried);
    good = good && fill_rows(s, quantity, count, g, workspace, made, why);
    for (size_t k = 0; good && k < count; k++) {
        rows[which[k]] = row_cache_publish(s->rows, made[k], &names[which[k]]);
        made[k] = NULL;
    }
    for (size_t k = 0; k < count; k++) adjoint_row_free(made[k]);
    free(g);
    return good;
}

bool adjoint_rows_of_elements(const scene *s, lam_quantity quantity, size_t count, const uint32_t *elements,
                              batch_workspace *workspace, adjoint_row **rows, problem *why) {
    const size_t n = s->n, C = s->n_channels;
    float *const g = memory_allocate(1, pass_bytes(s, count), "rows", NULL);
    bool good = g != NULL;
    for (size_t k = 0; k < count; k++) rows[k] = NULL;
    for (size_t k = 0; good && k < count; k++) good = (rows[k] = row_allocate(s, NULL, quantity)) != NULL;
    if (!good)
        problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the adjoint rows of %zu elements", count);
    if (good) memset(g, 0, count * C * n * sizeof *g);
    for (size_t k = 0; good && k < count; k++) {
        rows[k]->area = s->area[elements[k]];
        for (size_t c = 0; c < C; c++) g[(k * C + c) * n + elements[k]] = 1;
    }
    good = good && fill_rows(s, quantity, count, g, workspace, rows, why);
    for (size_t k = 0; !good && k < count; k++) {
        adjoint_row_free(rows[k]);
        rows[k] = NULL;
    }
    free(g);
    return good;
}

bool adjoint_rows_get(const scene *s, const radiosity_request *request, size_t first, size_t count,
                      batch_workspace *workspace, adjoint_row **rows, problem *why) {
    const reduce_name *const names = request->reduce.names + first;
    size_t which[BATCH_PASS], n_missing = 0;
    (void)row_cache_find(s->rows, count, names, request->quantity, rows);
    for (size_t k = 0; k < count; k++)
        if (rows[k] == NULL) which[n_missing++] = k;
    if (n_missing == 0 || make_rows(s, names, request->quantity, n_missing, which, workspace, rows, why))
        return true;
    adjoint_rows_release(s, count, rows);
    return false;
}

size_t adjoint_row_work(const scene *s, const radiosity_request *request) {
    /* The size of the light of k luminaires takes k^2 of them. */
    const size_t k = scene_luminaires(s);
    return s->n_channels * (request->n_rhs + request->n_spots + request->sky.n * scene_tiles(s) +
                            request->luminaires.n * (k + 1) * k + request->emitters.n * s->n_emitters);
}

bool adjoint_row_suffices(const scene *s, const adjoint_row *row, const radiosity_request *request) {
    const size_t C = s->n_channels, m = scene_tiles(s);
    if (row->emitters == NULL) return true;
    if (request->n_dense > 0) return false;
    for (size_t k = 0; k < request->n_spots; k++)
        for (size_t c = 0; c < C; c++)
            if (request->colours[k * C + c] != 0 &&
                (!request->spots[k].whole_group ||
                 isnan(row->of_group[c * s->groups.n_groups + request->spots[k].where])))
                return false;
    for (size_t v = 0; v < request->sky.n * C; v++)
        for (size_t t = 0; t < m; t++)
            if (request->sky.values[v * m + t] != 0 && isnan(row->tiles[v % C * m + t])) return false;
    return true;
}

/* means += sum_t w_t row_t of the weights of a side and its part [C][width] of a row. */
static void add_side(size_t n_channels, const side_rows *side, size_t width, const float *row,
                     double *means) {
    for (size_t v = 0; v < side->n * n_channels; v++) {
        double sum = 0;
        for (size_t t = 0; t < width; t++) {
            const float weight = side->values[v * width + t];
            if (weight != 0) sum += (double)weight * (double)row[v % n_channels * width + t];
        }
        means[v] += sum;
    }
}

/* means += contributions of spots, skies and luminaires. A contribution of value 0 is skipped, so that NaN of
 * the row does no harm. */
static void add_spots(const scene *s, const adjoint_row *row, const radiosity_request *request,
                      double *means) {
    const size_t n = s->n, C = s->n_channels;
    for (size_t k = 0; k < request->n_spots; k++) {
        const emission_spot *spot = &request->spots[k];
        for (size_t c = 0; c < C; c++) {
            const double value = (double)request->colours[k * C + c];
            if (value != 0)
                means[spot->vector * C + c] +=
                    value * (spot->whole_group ? row->of_group[c * s->groups.n_groups + spot->where]
                                               : (double)row->w[c * n + spot->where]);
        }
    }
    add_side(C, &request->sky, scene_tiles(s), row->tiles, means);
    add_side(C, &request->luminaires, scene_luminaires(s), row->luminaires, means);
}

void adjoint_row_evaluate(const scene *s, const adjoint_row *row, const radiosity_request *request,
                          const float *weights, double *means) {
    const size_t n = s->n, C = s->n_channels, n_emitters = s->n_emitters, count = request->n_rhs * C;
    const float *W = weights != NULL ? weights : request->emitters.values;
    const float *const vectors = row->emitters != NULL ? W : request->E;
    const float *const w = row->emitters != NULL ? row->emitters : row->w;
    const size_t width = row->emitters != NULL ? n_emitters : n;
    for (size_t v = 0; v < count; v++)
        means[v] = vectors != NULL ? product(w + v % C * width, vectors + v * width, width) : 0;
    if (weights == NULL) add_spots(s, row, request, means);
}
