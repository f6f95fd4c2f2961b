#include "server/scene/adjoint_rows.h"

#include "server/queue/batch.h"
#include "server/scene/emitter_weights.h"
#include "server/scene/gradient.h"
#include "server/scene/scene.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

struct adjoint_rows {
    pthread_mutex_t lock; /* held for a walk over the list, never while anything is computed */
    adjoint_row *first;
    uint64_t uses;
    size_t bytes, max_bytes;
    memory_ledger *ledger;
    emitter_weights *told; /* once made, for good; NULL: not yet, or not worth it */
};

/* --- the list ------------------------------------------------------------------------------------------- */

lam_status adjoint_rows_create(size_t max_bytes, memory_ledger *ledger, adjoint_rows **out,
                               lam_error *error) {
    adjoint_rows *rows = memory_allocate(1, sizeof *rows, "adjoint rows", error);
    if (rows == NULL) return LAM_ERR_MEMORY;
    pthread_mutex_init(&rows->lock, NULL);
    rows->max_bytes = max_bytes;
    rows->ledger = ledger;
    *out = rows;
    return LAM_OK;
}

static void row_free(adjoint_row *row) {
    if (row == NULL) return;
    free(row->w);
    free(row->of_group);
    free(row->tiles);
    free(row->emitters);
    free(row);
}

void adjoint_rows_destroy(adjoint_rows *rows) {
    if (rows == NULL) return;
    for (adjoint_row *row = rows->first, *next; row != NULL; row = next) {
        next = row->next;
        row_free(row);
    }
    memory_ledger_give_back(rows->ledger, rows->bytes);
    emitter_weights_free(rows->told);
    pthread_mutex_destroy(&rows->lock);
    free(rows);
}

size_t adjoint_rows_held(adjoint_rows *rows) {
    pthread_mutex_lock(&rows->lock);
    const size_t held = rows->bytes;
    pthread_mutex_unlock(&rows->lock);
    return held;
}

/* The lock is held. Names that mean the same groups share a row. */
static adjoint_row *find_locked(adjoint_rows *rows, const reduce_name *name, lam_quantity quantity) {
    for (adjoint_row *row = rows->first; row != NULL; row = row->next)
        if (row->groups == name->groups && row->n_groups == name->n_groups && row->quantity == quantity) {
            row->references++;
            row->used = ++rows->uses;
            return row;
        }
    return NULL;
}

/* The lock is held. */
static void release_locked(adjoint_row *row) {
    if (row != NULL && --row->references == 0) row_free(row);
}

/* The lock is held, and there is a row: the one unused for longest goes. Who still uses it frees it. */
static void evict_locked(adjoint_rows *rows) {
    adjoint_row **oldest = &rows->first;
    for (adjoint_row **at = oldest; *at != NULL; at = &(*at)->next)
        if ((*at)->used < (*oldest)->used) oldest = at;
    adjoint_row *gone = *oldest;
    *oldest = gone->next;
    rows->bytes -= gone->bytes;
    memory_ledger_give_back(rows->ledger, gone->bytes);
    release_locked(gone);
}

/* The lock is held: whether there is room for a row, others going for it. The only one may be as large as it
 * likes. */
static bool make_room_locked(adjoint_rows *rows, size_t bytes) {
    while (rows->first != NULL && rows->bytes + bytes > rows->max_bytes) evict_locked(rows);
    while (!memory_ledger_take(rows->ledger, bytes)) {
        if (rows->first == NULL) return false;
        evict_locked(rows);
    }
    return true;
}

/* Puts a new row into the list, where there is room, which holds one reference, the caller another; or gives
 * back the one that somebody else made meanwhile. */
static adjoint_row *publish(adjoint_rows *rows, adjoint_row *made, const reduce_name *name) {
    pthread_mutex_lock(&rows->lock);
    adjoint_row *known = find_locked(rows, name, made->quantity);
    if (known == NULL) {
        const bool kept = make_room_locked(rows, made->bytes);
        made->references = kept ? 2 : 1;
        made->used = ++rows->uses;
        if (kept) {
            made->next = rows->first;
            rows->first = made;
            rows->bytes += made->bytes;
        }
    }
    pthread_mutex_unlock(&rows->lock);
    if (known == NULL) return made;
    row_free(made);
    return known;
}

void adjoint_rows_release(const scene *s, size_t count, adjoint_row **rows) {
    pthread_mutex_lock(&s->rows->lock);
    for (size_t k = 0; k < count; k++) release_locked(rows[k]);
    pthread_mutex_unlock(&s->rows->lock);
}

/* Finds what is there, NULL for the others; whether that is all. */
static bool find_all(const scene *s, const radiosity_request *request, adjoint_row **rows) {
    bool all = true;
    pthread_mutex_lock(&s->rows->lock);
    for (size_t k = 0; k < request->reduce.n_names; k++) {
        rows[k] = find_locked(s->rows, &request->reduce.names[k], request->quantity);
        all = all && rows[k] != NULL;
    }
    pthread_mutex_unlock(&s->rows->lock);
    return all;
}

bool adjoint_rows_find(const scene *s, const radiosity_request *request, adjoint_row **rows) {
    if (find_all(s, request, rows)) return true;
    adjoint_rows_release(s, request->reduce.n_names, rows);
    return false;
}

/* --- new rows ------------------------------------------------------------------------------------------- */

static size_t tiles_of(const scene *s) {
    return s->sky != NULL ? lam_sky_tiles(s->sky) : 0;
}

static size_t row_bytes(const scene *s) {
    return sizeof(adjoint_row) +
           s->n_channels * (s->groups.n_groups * sizeof(double) +
                            (tiles_of(s) + (s->n_emitters > 0 ? s->n_emitters : s->n)) * sizeof(float));
}

size_t adjoint_rows_capacity(const scene *s) {
    const size_t count = s->rows->max_bytes / row_bytes(s);
    return count < ADJOINT_ROWS_OF_REQUEST ? count : ADJOINT_ROWS_OF_REQUEST;
}

static adjoint_row *row_allocate(const scene *s, const reduce_name *name, lam_quantity quantity) {
    const size_t C = s->n_channels;
    adjoint_row *row = memory_allocate(1, sizeof *row, "an adjoint row", NULL);
    if (row == NULL) return NULL;
    row->groups = name->groups;
    row->n_groups = name->n_groups;
    row->quantity = quantity;
    row->bytes = row_bytes(s);
    float **const numbers = s->n_emitters > 0 ? &row->emitters : &row->w;
    *numbers =
        memory_allocate(C, (s->n_emitters > 0 ? s->n_emitters : s->n) * sizeof **numbers, "a row", NULL);
    row->of_group = memory_allocate(C, s->groups.n_groups * sizeof *row->of_group, "a row", NULL);
    row->tiles = memory_allocate(C, tiles_of(s) * sizeof *row->tiles, "a row", NULL);
    const bool good = *numbers != NULL && row->of_group != NULL && row->tiles != NULL;
    if (good) return row;
    row_free(row);
    return NULL;
}

/* g = A 1_group / sum A in every channel, [C][n]; gives sum A. */
static double write_cotangent(const scene *s, const reduce_name *name, float *g) {
    const group_index *groups = &s->groups;
    double total = 0;
    for (size_t m = 0; m < name->n_groups; m++)
        for (size_t e = groups->start[name->groups[m]]; e < groups->start[name->groups[m] + 1]; e++)
            total += s->area[groups->elements[e]];
    memset(g, 0, s->n_channels * s->n * sizeof *g);
    for (size_t m = 0; total > 0 && m < name->n_groups; m++)
        for (size_t e = groups->start[name->groups[m]]; e < groups->start[name->groups[m] + 1]; e++) {
            const size_t i = groups->elements[e];
            for (size_t c = 0; c < s->n_channels; c++) g[c * s->n + i] = (float)(s->area[i] / total);
        }
    return total;
}

/* sum_k a_k x_k */
static double product(const float *a, const float *x, size_t count) {
    double sum = 0;
    for (size_t k = 0; k < count; k++) sum += (double)a[k] * (double)x[k];
    return sum;
}

/* w is [C][n], g becomes dJ/dH0. */
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
    if (s->sky == NULL) return;
    gradient_of_sky_irradiance(row->quantity, C * n, s->reflectance, g, w, g);
    lam_sky_adjoint(s->sky, C, g, row->tiles);
}

/* w is [C][s]; of groups and tiles whose weights are not told it says nothing: NaN. */
static void fill_from_emitters(const scene *s, const emitter_weights *told, const float *w,
                               adjoint_row *row) {
    const size_t n_emitters = s->n_emitters, C = s->n_channels, m = tiles_of(s);
    const size_t n_groups = s->groups.n_groups;
    memcpy(row->emitters, w, C * n_emitters * sizeof *w);
    for (size_t c = 0; c < C; c++) {
        for (size_t h = 0; h < n_groups; h++)
            row->of_group[c * n_groups + h] =
                told == NULL
                    ? NAN
                    : product(told->of_group + (h * C + c) * n_emitters, w + c * n_emitters, n_emitters);
        for (size_t t = 0; t < m; t++)
            row->tiles[c * m + t] = told == NULL ? NAN
                                                 : (float)product(told->of_tile + (t * C + c) * n_emitters,
                                                                  w + c * n_emitters, n_emitters);
    }
}

/* Those of a store of emitters, made by the first who needs them; false when memory is short. */
static bool get_told(const scene *s, const emitter_weights **told) {
    adjoint_rows *rows = s->rows;
    *told = NULL;
    if (s->n_emitters == 0 || !emitter_weights_worth(s)) return true;
    pthread_mutex_lock(&rows->lock);
    *told = rows->told;
    pthread_mutex_unlock(&rows->lock);
    if (*told != NULL) return true;
    emitter_weights *made = emitter_weights_make(s);
    if (made == NULL) return false;
    pthread_mutex_lock(&rows->lock);
    if (rows->told == NULL) {
        rows->told = made;
        made = NULL;
    }
    *told = rows->told;
    pthread_mutex_unlock(&rows->lock);
    emitter_weights_free(made);
    return true;
}

/* Makes the rows of some names by one pass over the operator, and publishes them. */
static bool make_rows(const scene *s, const radiosity_request *request, size_t count, const size_t *which,
                      batch_workspace *workspace, adjoint_row **rows, problem *why) {
    const size_t n = s->n, C = s->n_channels, width = s->n_emitters > 0 ? s->n_emitters : n;
    const size_t work_bytes = lam_operator_work_bytes(s->op, count);
    size_t g_bytes, w_bytes, total;
    lam_error error;
    char *bytes = NULL;
    const emitter_weights *told;
    adjoint_row *made[BATCH_PASS] = {NULL};
    double area[BATCH_PASS];
    bool allocated, good = false;
    if (work_bytes > 0 && size_multiply(count * C * sizeof(float), n, &g_bytes) &&
        size_multiply(count * C * sizeof(float), width, &w_bytes) && g_bytes < SIZE_MAX - 64 &&
        w_bytes < SIZE_MAX - 64) {
        g_bytes = (g_bytes + 63) / 64 * 64;
        w_bytes = (w_bytes + 63) / 64 * 64;
        if (!__builtin_add_overflow(g_bytes, w_bytes, &total) &&
            !__builtin_add_overflow(total, work_bytes, &total))
            bytes = batch_workspace_get(workspace, total);
    }
    allocated = bytes != NULL && get_told(s, &told);
    for (size_t k = 0; allocated && k < count; k++)
        allocated = (made[k] = row_allocate(s, &request->reduce.names[which[k]], request->quantity)) != NULL;
    if (!allocated) {
        problem_set(why, 503, "not enough memory for the adjoint rows of %zu groups", count);
        goto done;
    }
    float *g = (float *)(void *)bytes, *w = (float *)(void *)(bytes + g_bytes);
    for (size_t k = 0; k < count; k++)
        area[k] = write_cotangent(s, &request->reduce.names[which[k]], g + k * C * n);
    void *work = bytes + g_bytes + w_bytes;
    const lam_status status =
        s->n_emitters > 0
            ? lam_operator_adjoint_emitters(s->op, count, request->quantity, g, w, work, work_bytes, &error)
            : lam_operator_apply_adjoint(s->op, count, request->quantity, g, w, work, work_bytes, &error);
    if (status != LAM_OK) {
        problem_set(why, 500, "%s", error.message);
        goto done;
    }
    for (size_t k = 0; k < count; k++) {
        made[k]->area = area[k];
        if (s->n_emitters > 0)
            fill_from_emitters(s, told, w + k * C * width, made[k]);
        else
            fill_from_elements(s, w + k * C * width, g + k * C * n, made[k]);
        rows[which[k]] = publish(s->rows, made[k], &request->reduce.names[which[k]]);
        made[k] = NULL;
    }
    good = true;
done:
    for (size_t k = 0; k < count; k++) row_free(made[k]);
    return good;
}

bool adjoint_rows_get(const scene *s, const radiosity_request *request, batch_workspace *workspace,
                      adjoint_row **rows, problem *why) {
    const size_t n_names = request->reduce.n_names;
    size_t which[BATCH_PASS], count = 0;
    bool good = true;
    find_all(s, request, rows);
    for (size_t k = 0; good && k < n_names; k++) {
        if (rows[k] == NULL) which[count++] = k;
        if (count == BATCH_PASS || (count > 0 && k + 1 == n_names)) {
            good = make_rows(s, request, count, which, workspace, rows, why);
            count = 0;
        }
    }
    if (!good) adjoint_rows_release(s, n_names, rows);
    return good;
}

/* --- products ------------------------------------------------------------------------------------------- */

size_t adjoint_row_work(const scene *s, const radiosity_request *request) {
    return s->n_channels * (request->n_rhs + request->n_spots + request->sky.n * tiles_of(s) +
                            request->emitters.n * s->n_emitters);
}

bool adjoint_row_tells(const scene *s, const adjoint_row *row, const radiosity_request *request) {
    const size_t C = s->n_channels, m = tiles_of(s);
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

/* means += what the spots and the skies give; dark ones nothing, also where the row says NaN. */
static void add_spots(const scene *s, const adjoint_row *row, const radiosity_request *request,
                      double *means) {
    const size_t n = s->n, C = s->n_channels, m = tiles_of(s);
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
    for (size_t v = 0; v < request->sky.n * C; v++) {
        double sum = 0;
        for (size_t t = 0; t < m; t++) {
            const float L = request->sky.values[v * m + t];
            if (L != 0) sum += (double)L * (double)row->tiles[v % C * m + t];
        }
        means[v] += sum;
    }
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
