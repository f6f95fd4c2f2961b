#include "server/adjoint_rows.h"

#include "server/gradient.h"
#include "server/scene.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define PASS 16 /* rows of one pass over the operator */

struct adjoint_rows {
    pthread_mutex_t lock; /* held for a walk over the list, never while anything is computed */
    adjoint_row *first;
    uint64_t uses;
    size_t bytes;
};

/* --- the list ------------------------------------------------------------------------------------------- */

lam_status adjoint_rows_create(adjoint_rows **out, lam_error *error) {
    adjoint_rows *rows = memory_allocate(1, sizeof *rows, "adjoint rows", error);
    if (rows == NULL) return LAM_ERR_MEMORY;
    pthread_mutex_init(&rows->lock, NULL);
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
    pthread_mutex_destroy(&rows->lock);
    free(rows);
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

/* The lock is held: those unused for longest go, but for the newest, until the others are few enough. Who
 * still uses one frees it. */
static void evict_locked(adjoint_rows *rows) {
    while (rows->bytes > ADJOINT_ROWS_BYTES && rows->first->next != NULL) {
        adjoint_row **oldest = &rows->first->next;
        for (adjoint_row **at = oldest; *at != NULL; at = &(*at)->next)
            if ((*at)->used < (*oldest)->used) oldest = at;
        adjoint_row *gone = *oldest;
        *oldest = gone->next;
        rows->bytes -= gone->bytes;
        release_locked(gone);
    }
}

/* Puts a new row into the list, which holds one reference, the caller another; or gives back the one that
 * somebody else made meanwhile. */
static adjoint_row *publish(adjoint_rows *rows, adjoint_row *made, const reduce_name *name) {
    pthread_mutex_lock(&rows->lock);
    adjoint_row *known = find_locked(rows, name, made->quantity);
    if (known == NULL) {
        made->references = 2;
        made->used = ++rows->uses;
        made->next = rows->first;
        rows->first = made;
        rows->bytes += made->bytes;
        evict_locked(rows);
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

static size_t row_bytes(const scene *s) {
    const size_t C = s->n_channels;
    size_t bytes = sizeof(adjoint_row);
    if (s->n_emitters > 0) return bytes + C * s->n_emitters * sizeof(float);
    if (s->sky != NULL) bytes += C * lam_sky_tiles(s->sky) * sizeof(float);
    return bytes + C * s->n * sizeof(float) + C * s->groups.n_groups * sizeof(double);
}

size_t adjoint_rows_capacity(const scene *s) {
    const size_t count = ADJOINT_ROWS_BYTES / row_bytes(s);
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
    bool good = true;
    if (s->n_emitters > 0) {
        row->emitters = memory_allocate(C * s->n_emitters, sizeof *row->emitters, "an adjoint row", NULL);
        good = row->emitters != NULL;
    } else {
        row->w = memory_allocate(C * s->n, sizeof *row->w, "an adjoint row", NULL);
        row->of_group =
            memory_allocate(C * s->groups.n_groups, sizeof *row->of_group, "an adjoint row", NULL);
        if (s->sky != NULL)
            row->tiles =
                memory_allocate(C * lam_sky_tiles(s->sky), sizeof *row->tiles, "an adjoint row", NULL);
        good = row->w != NULL && row->of_group != NULL && (s->sky == NULL || row->tiles != NULL);
    }
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

/* Fills a row from w [C][n] (or [C][s]) and its g, which becomes dJ/dH0. */
static void fill_row(const scene *s, const float *w, float *g, adjoint_row *row) {
    const size_t n = s->n, C = s->n_channels, n_groups = s->groups.n_groups;
    if (s->n_emitters > 0) {
        memcpy(row->emitters, w, C * s->n_emitters * sizeof *w);
        return;
    }
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

/* Makes the rows of some names by one pass over the operator, and publishes them. */
static bool make_rows(const scene *s, const radiosity_request *request, size_t count, const size_t *which,
                      batch_workspace *workspace, adjoint_row **rows, problem *why) {
    const size_t n = s->n, C = s->n_channels, width = s->n_emitters > 0 ? s->n_emitters : n;
    const size_t work_bytes = lam_operator_work_bytes(s->op, count);
    size_t g_bytes, w_bytes, total;
    lam_error error;
    char *bytes = NULL;
    adjoint_row *made[PASS] = {NULL};
    double area[PASS];
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
    allocated = bytes != NULL;
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
        fill_row(s, w + k * C * width, g + k * C * n, made[k]);
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
    size_t which[PASS], count = 0;
    bool good = true;
    find_all(s, request, rows);
    for (size_t k = 0; good && k < n_names; k++) {
        if (rows[k] == NULL) which[count++] = k;
        if (count == PASS || (count > 0 && k + 1 == n_names)) {
            good = make_rows(s, request, count, which, workspace, rows, why);
            count = 0;
        }
    }
    if (!good) adjoint_rows_release(s, n_names, rows);
    return good;
}

/* --- products ------------------------------------------------------------------------------------------- */

size_t adjoint_row_work(const scene *s, const radiosity_request *request) {
    const size_t tiles = s->sky != NULL ? lam_sky_tiles(s->sky) : 0;
    return s->n_channels *
           (request->n_rhs + request->n_spots + request->sky.n * tiles + request->emitters.n * s->n_emitters);
}

/* sum_k a_k x_k */
static double product(const float *a, const float *x, size_t count) {
    double sum = 0;
    for (size_t k = 0; k < count; k++) sum += (double)a[k] * (double)x[k];
    return sum;
}

void adjoint_row_evaluate(const scene *s, const adjoint_row *row, const radiosity_request *request,
                          const float *weights, double *means) {
    const size_t n = s->n, C = s->n_channels;
    if (row->emitters != NULL) {
        const float *W = weights != NULL ? weights : request->emitters.values;
        const size_t count = weights != NULL ? request->n_rhs : request->emitters.n;
        for (size_t v = 0; v < request->n_rhs * C; v++)
            means[v] = v < count * C ? product(row->emitters + v % C * s->n_emitters, W + v * s->n_emitters,
                                               s->n_emitters)
                                     : 0;
        return;
    }
    for (size_t v = 0; v < request->n_rhs * C; v++)
        means[v] = request->E != NULL ? product(row->w + v % C * n, request->E + v * n, n) : 0;
    for (size_t k = 0; k < request->n_spots; k++) {
        const emission_spot *spot = &request->spots[k];
        for (size_t c = 0; c < C; c++) {
            const double w = spot->whole_group ? row->of_group[c * s->groups.n_groups + spot->where]
                                               : (double)row->w[c * n + spot->where];
            means[spot->vector * C + c] += w * (double)request->colours[k * C + c];
        }
    }
    const size_t tiles = row->tiles != NULL ? lam_sky_tiles(s->sky) : 0;
    for (size_t v = 0; tiles > 0 && v < request->sky.n * C; v++)
        means[v] += product(row->tiles + v % C * tiles, request->sky.values + v * tiles, tiles);
}
