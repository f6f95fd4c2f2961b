#include "server/route/jacobian_matrix.h"

#include "server/scene/adjoint_rows.h"
#include "server/scene/direct_light.h"
#include "server/scene/sensor_answer.h"
#include "server/scene/sensor_columns.h"

#include <math.h>
#include <stdlib.h>

size_t jacobian_lights(const scene *s, lam_by kind, size_t *first) {
    const sensor_lights l = scene_sensor_lights(s);
    if (kind == LAM_BY_EMITTERS) {
        *first = 0;
        return s->n_emitters;
    }
    *first = kind == LAM_BY_GROUPS ? 0 : kind == LAM_BY_LUMINAIRES ? l.groups : l.groups + l.luminaires;
    return kind == LAM_BY_GROUPS ? l.groups : kind == LAM_BY_LUMINAIRES ? l.luminaires : l.tiles;
}

static matrix_question question_of(const jacobian_request *request) {
    return (matrix_question){.quantity = request->of.quantity,
                             .n_by = request->n_by,
                             .n_elements = request->of.n_selected,
                             .by = request->by,
                             .elements = request->of.selected};
}

void jacobian_matrix_keep(const scene *s, const jacobian_matrix *m) {
    if (m->request->kind != JACOBIAN_OF_ELEMENTS || m->known) return;
    const matrix_question asked = question_of(m->request);
    matrix_cache_put(s->matrices, &asked, s->n_channels * m->n_rows * m->n_columns, m->values);
}

bool jacobian_matrix_begin(call *in, const jacobian_request *request, jacobian_matrix *m, problem *why) {
    const scene *s = in->scene;
    size_t first;
    *m = (jacobian_matrix){.request = request, .n_rows = jacobian_rows(request)};
    for (size_t k = 0; k < request->n_by; k++) m->n_columns += jacobian_lights(s, request->by[k], &first);
    m->by_rows = request->kind == JACOBIAN_OF_GROUPS ||
                 (request->kind == JACOBIAN_OF_ELEMENTS && m->n_rows <= m->n_columns);
    const size_t pass = m->n_columns < BATCH_PASS ? m->n_columns : BATCH_PASS;
    const size_t numbers = bytes_times(bytes_times(s->n_channels, m->n_rows), m->n_columns);
    m->values = call_allocate(in, bytes_times(numbers, sizeof *m->values), "a matrix of derivatives", why);
    if (m->values == NULL) return false;
    if (request->kind == JACOBIAN_OF_ELEMENTS) {
        const matrix_question asked = question_of(request);
        m->known = matrix_cache_find(s->matrices, &asked, numbers, m->values);
        if (m->known) return true;
    }
    if (m->by_rows) return request_memory_take(in->memory, adjoint_rows_room(s, m->n_rows), why);
    m->work = call_allocate(in, sensor_columns_work(s, pass) * sizeof *m->work, "solving for lights", why);
    if (m->work == NULL || request->kind != JACOBIAN_AT_SENSORS) return m->work != NULL;
    m->made = call_allocate(in, bytes_times(pass, sensor_column_width(s) * sizeof *m->made), "sensors", why);
    return m->made != NULL;
}

void jacobian_matrix_free(jacobian_matrix *m) {
    free(m->values);
    free(m->made);
    free(m->work);
    *m = (jacobian_matrix){.request = NULL};
}

/* A column of the matrix: its light, and where its number of the first row and channel stands in values;
 * `width` numbers lie between two rows. */
typedef struct column_place {
    uint32_t light;
    size_t at, width;
} column_place;

static column_place place_of(const scene *s, const jacobian_matrix *m, size_t column) {
    size_t begin = 0, first, width = 0;
    for (size_t k = 0; k < m->request->n_by; k++) {
        width = jacobian_lights(s, m->request->by[k], &first);
        if (column < width) return (column_place){(uint32_t)(first + column), begin + column, width};
        column -= width;
        begin += s->n_channels * m->n_rows * width;
    }
    return (column_place){0, 0, width};
}

/* The values of a column at sensors, NAN where one has no value. */
static void put_sensors(const scene *s, jacobian_matrix *m, size_t number, const float *column) {
    const column_place to = place_of(s, m, number);
    const size_t C = s->n_channels, R = m->n_rows, all = scene_sensors(s);
    for (size_t c = 0; c < C; c++)
        for (size_t k = 0; k < R; k++) {
            const uint32_t r = m->request->of.receivers[k];
            m->values[to.at + (c * R + k) * to.width] =
                lam_sensors_has_value(s->sensors, r) ? column[c * all + r] : NAN;
        }
}

/* Columns that the scene keeps, and the others by one pass. */
static bool make_sensors(call *in, jacobian_matrix *m, size_t first, size_t count, batch_workspace *workspace,
                         problem *why) {
    const scene *s = in->scene;
    const size_t width = sensor_column_width(s);
    column_table *table = sensor_columns_acquire(s->columns);
    uint32_t which[BATCH_PASS];
    size_t missing[BATCH_PASS], n_missing = 0;
    bool good = true;
    for (size_t k = first; k < first + count; k++) {
        const uint32_t light = place_of(s, m, k).light;
        const float *kept = column_table_get(table, light);
        if (kept != NULL) {
            put_sensors(s, m, k, kept);
            continue;
        }
        which[n_missing] = light;
        missing[n_missing++] = k;
    }
    if (n_missing > 0) {
        metrics_pass(in->service->metrics, n_missing);
        good = sensor_columns_make(s, n_missing, which, workspace, m->work, m->made, why);
    }
    for (size_t k = 0; good && k < n_missing; k++) {
        put_sensors(s, m, missing[k], m->made + k * width);
        sensor_columns_put(s->columns, table, which[k], m->made + k * width);
    }
    sensor_columns_release(s->columns, table);
    return good;
}

/* Columns at elements. */
static bool make_columns(call *in, jacobian_matrix *m, size_t first, size_t count, batch_workspace *workspace,
                         problem *why) {
    const scene *s = in->scene;
    const size_t C = s->n_channels, R = m->n_rows;
    uint32_t which[BATCH_PASS];
    const float *q;
    for (size_t k = 0; k < count; k++) which[k] = place_of(s, m, first + k).light;
    metrics_pass(in->service->metrics, count);
    if (!light_vectors_make(s, m->request->of.quantity, count, which, workspace, m->work, &q, why))
        return false;
    for (size_t k = 0; k < count; k++) {
        const column_place to = place_of(s, m, first + k);
        for (size_t c = 0; c < C; c++)
            for (size_t r = 0; r < R; r++)
                m->values[to.at + (c * R + r) * to.width] =
                    q[(k * C + c) * s->n + m->request->of.selected[r]];
    }
    return true;
}

static void put_row(const scene *s, jacobian_matrix *m, size_t r, const adjoint_row *row) {
    const linear_scene of = scene_linear(s);
    const size_t C = s->n_channels, R = m->n_rows;
    float *values = m->values;
    for (size_t b = 0; b < m->request->n_by; b++) {
        const lam_by kind = m->request->by[b];
        const size_t width = adjoint_row_width(&of, kind);
        for (size_t c = 0; c < C; c++)
            adjoint_row_derivatives(&of, row, kind, c, values + (c * R + r) * width);
        values += C * R * width;
    }
}

/* Rows of groups, which the scene keeps, or of elements. */
static bool make_rows(call *in, jacobian_matrix *m, size_t first, size_t count, batch_workspace *workspace,
                      problem *why) {
    const scene *s = in->scene;
    const radiosity_request *of = &m->request->of;
    const bool groups = m->request->kind == JACOBIAN_OF_GROUPS;
    adjoint_row *rows[BATCH_PASS];
    if (!groups) metrics_pass(in->service->metrics, count);
    if (!(groups
              ? adjoint_rows_get(s, of, first, count, workspace, rows, why)
              : adjoint_rows_of_elements(s, of->quantity, count, of->selected + first, workspace, rows, why)))
        return false;
    for (size_t k = 0; k < count; k++) put_row(s, m, first + k, rows[k]);
    for (size_t k = 0; !groups && k < count; k++) adjoint_row_free(rows[k]);
    if (groups) adjoint_rows_release(s, count, rows);
    return true;
}

bool jacobian_matrix_make(call *in, jacobian_matrix *m, size_t first, size_t count,
                          batch_workspace *workspace, problem *why) {
    if (m->known) return true;
    if (m->by_rows) return make_rows(in, m, first, count, workspace, why);
    return (m->request->kind == JACOBIAN_AT_SENSORS ? make_sensors : make_columns)(in, m, first, count,
                                                                                   workspace, why);
}
