/* POST /v1/scenes/NAME/jacobian: the matrix of derivatives of irradiances at sensors by dimmers of
 * luminaires, by emissions of groups and by radiances of tiles, or by weights of few emitters. Its columns
 * are those of server/scene/sensor_columns.h: begin reads the body, each vector of a pass is a column, end
 * writes. */
#include "server/route/routes.h"
#include "server/scene/direct_light.h"
#include "server/scene/sensor_answer.h"
#include "solver/base/clock.h"
#include "solver/codec/answer.h"
#include "solver/codec/jacobian.h"
#include "solver/codec/json_writer.h"
#include "solver/codec/npy.h"
#include "solver/operator/luminaire_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The state from begin to end. Columns are counted over all kinds asked for. */
typedef struct jacobian_solve {
    jacobian_request request;
    answer_notes notes;
    size_t n_columns;
    float *values; /* of each kind after the other: [C][receivers asked for][columns of the kind] */
    float *made;   /* [BATCH_PASS][sensor_column_width], of a pass */
    float *work;   /* sensor_columns_work */
    problem why;
    bool failed;
} jacobian_solve;

static void solve_free(jacobian_solve *s) {
    jacobian_request_free(&s->request);
    free(s->values);
    free(s->made);
    free(s->work);
    free(s);
}

/* The first light of a kind, and how many it has. */
static size_t lights_of(const scene *s, jacobian_by kind, size_t *first) {
    const sensor_lights l = scene_sensor_lights(s);
    if (kind == JACOBIAN_EMITTERS) {
        *first = 0;
        return s->n_emitters;
    }
    *first = kind == JACOBIAN_GROUPS ? 0 : kind == JACOBIAN_LUMINAIRES ? l.groups : l.groups + l.luminaires;
    return kind == JACOBIAN_GROUPS ? l.groups : kind == JACOBIAN_LUMINAIRES ? l.luminaires : l.tiles;
}

/* A column of the answer: its light, and where its number of the first receiver and channel stands in values;
 * `width` numbers lie between two receivers. */
typedef struct column_place {
    uint32_t light;
    size_t at, width;
} column_place;

static column_place place_of(const scene *s, const jacobian_request *r, size_t column) {
    size_t begin = 0, first, width = 0;
    for (size_t k = 0; k < r->n_by; k++) {
        width = lights_of(s, r->by[k], &first);
        if (column < width) return (column_place){(uint32_t)(first + column), begin + column, width};
        column -= width;
        begin += s->n_channels * r->of.n_receivers * width;
    }
    return (column_place){0, 0, width};
}

/* Bytes of the text of numbers in JSON, at most: of each, and of the brackets of a row. */
#define NUMBER_BYTES ((size_t)JSON_FLOAT_MAX + 1)
#define ROW_BYTES ((size_t)4)

/* The longest name in JSON, with its quotes, in escapes of up to six letters. */
static size_t names_bytes(const scene *s) {
    size_t bytes = 0;
    for (size_t g = 0; g < s->groups.n_groups; g++) bytes += 6 * strlen(s->groups.names[g]) + 3;
    for (size_t k = 0; k < scene_luminaires(s); k++)
        bytes += 6 * strlen(lam_luminaires_name(s->luminaires, k)) + 3;
    for (size_t k = 0; k < s->n_emitters; k++) bytes += 6 * strlen(lam_operator_emitter_name(s->op, k)) + 3;
    return bytes;
}

/* Takes the memory of the answer and of passes. */
static bool find_room(call *in, jacobian_solve *s, problem *why) {
    const scene *of = in->scene;
    const size_t C = of->n_channels, R = s->request.of.n_receivers;
    const size_t pass = s->n_columns < BATCH_PASS ? s->n_columns : BATCH_PASS,
                 numbers = bytes_times(bytes_times(C, R), s->n_columns);
    const size_t text =
        bytes_plus(bytes_times(numbers, NUMBER_BYTES),
                   bytes_plus(bytes_times(bytes_times(C, R), s->request.n_by * ROW_BYTES),
                              names_bytes(of) + 8 * s->request.of.reduce.texts.length + 4096));
    s->values = call_allocate(in, bytes_times(numbers, sizeof *s->values), "a matrix of derivatives", why);
    if (s->values == NULL) return false;
    s->made = call_allocate(in, bytes_times(pass, sensor_column_width(of) * sizeof *s->made), "sensors", why);
    if (s->made == NULL) return false;
    s->work = call_allocate(in, sensor_columns_work(of, pass) * sizeof *s->work, "solving for lights", why);
    return s->work != NULL && request_memory_take(in->memory, text, why);
}

static bool read_body(call *in, jacobian_solve *s, problem *why) {
    const codec_scene about = call_codec_scene(in);
    const size_t lists = call_parse_bytes(in);
    if (in->body_type != MEDIA_JSON)
        return problem_set(why, PROBLEM_MEDIA_TYPE, "a request for derivatives is JSON");
    if (!request_memory_take(in->memory, lists, why)) return false;
    const bool good = codec_read_jacobian_json(&about, in->body, in->length, &s->request, why);
    request_memory_give_back(in->memory, lists);
    if (!good) return false;
    if (in->accept.type == MEDIA_NPY && s->request.n_by > 1)
        return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                           "an NPY answer holds one matrix; name one kind in by, or ask for JSON");
    return request_memory_take(in->memory, s->request.of.n_receivers * sizeof *s->request.of.receivers, why);
}

static bool begin(call *in, answer *out) {
    problem why = {0};
    jacobian_solve *s = calloc(1, sizeof *s);
    if (s == NULL) {
        answer_refuse(out, PROBLEM_NO_MEMORY, "not enough memory for the request");
        return false;
    }
    const double start = clock_ms();
    bool good = read_body(in, s, &why);
    size_t first;
    for (size_t k = 0; k < s->request.n_by; k++)
        s->n_columns += lights_of(in->scene, s->request.by[k], &first);
    s->notes = call_notes(in);
    s->notes.quantity = LAM_IRRADIANCE;
    s->notes.at = "sensors";
    s->notes.parse_ms = clock_ms() - start;
    good = good && find_room(in, s, &why);
    if (!good) {
        answer_problem(out, &why);
        solve_free(s);
        return false;
    }
    in->state = s;
    in->n_rhs = in->job.n_vectors = s->n_columns;
    in->n_written = s->n_columns * in->scene->n_channels * s->request.of.n_receivers;
    in->job.key = (const void *)in;
    return true;
}

/* Puts the values of a column into the matrix; NaN where a receiver has no value. */
static void put(const scene *of, jacobian_solve *s, size_t number, const float *column) {
    const column_place at = place_of(of, &s->request, number);
    const size_t C = of->n_channels, R = s->request.of.n_receivers, all = scene_sensors(of);
    for (size_t c = 0; c < C; c++)
        for (size_t k = 0; k < R; k++) {
            const uint32_t r = s->request.of.receivers[k];
            s->values[at.at + (c * R + k) * at.width] =
                lam_sensors_has_value(of->sensors, r) ? column[c * all + r] : NAN;
        }
}

/* Columns first ... first + count: those that the scene keeps, and the others by one pass. */
static void pass_part(call *in, jacobian_solve *s, size_t first, size_t count, batch_workspace *workspace) {
    const scene *of = in->scene;
    const size_t width = sensor_column_width(of);
    column_table *table = sensor_columns_acquire(of->columns);
    uint32_t which[BATCH_PASS];
    size_t missing[BATCH_PASS], n_missing = 0;
    for (size_t k = first; k < first + count; k++) {
        const uint32_t light = place_of(of, &s->request, k).light;
        const float *kept = column_table_get(table, light);
        if (kept != NULL) {
            put(of, s, k, kept);
            continue;
        }
        which[n_missing] = light;
        missing[n_missing++] = k;
    }
    if (n_missing > 0) {
        metrics_pass(in->service->metrics, n_missing);
        s->failed = !sensor_columns_make(of, n_missing, which, workspace, s->work, s->made, &s->why);
    }
    for (size_t k = 0; !s->failed && k < n_missing; k++) {
        put(of, s, missing[k], s->made + k * width);
        sensor_columns_put(of->columns, table, which[k], s->made + k * width);
    }
    sensor_columns_release(of->columns, table);
}

static void pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    for (size_t p = 0; p < n_parts; p++) {
        call *in = call_of(parts[p].job);
        jacobian_solve *s = in->state;
        const double start = clock_ms();
        if (!s->failed) pass_part(in, s, parts[p].first, parts[p].count, workspace);
        s->notes.solve_ms += clock_ms() - start;
    }
}

static const char *name_of(const scene *s, jacobian_by kind, size_t k) {
    return kind == JACOBIAN_GROUPS     ? s->groups.names[k]
           : kind == JACOBIAN_EMITTERS ? lam_operator_emitter_name(s->op, k)
                                       : lam_luminaires_name(s->luminaires, k);
}

/* ["desk-1", ...] of luminaires, groups and emitters; the number of tiles. */
static bool write_columns(const scene *s, jacobian_by kind, buffer *b) {
    size_t first;
    const size_t count = lights_of(s, kind, &first);
    bool written = buffer_printf(b, "\"%s\":", jacobian_name(kind));
    if (kind == JACOBIAN_SKY) return written && buffer_printf(b, "%zu", count);
    written = written && buffer_append(b, "[", 1);
    for (size_t k = 0; written && k < count; k++)
        written = (k == 0 || buffer_append(b, ",", 1)) && json_write_text(b, name_of(s, kind, k));
    return written && buffer_append(b, "]", 1);
}

/* "room":342: the rows of a name, in the order asked. */
static bool write_rows(const scene *s, const reduce_request *r, size_t k, buffer *b) {
    size_t count = 0;
    for (size_t g = 0; g < r->names[k].n_groups; g++)
        count +=
            s->sensor_sets.start[r->names[k].groups[g] + 1] - s->sensor_sets.start[r->names[k].groups[g]];
    return json_write_text(b, reduce_text(r, k)) && buffer_printf(b, ":%zu", count);
}

/* [[...], ...], one level deeper for several channels. */
static bool write_matrix(const float *x, size_t C, size_t R, size_t width, buffer *b) {
    bool written = buffer_append_text(b, C > 1 ? "[" : "");
    for (size_t c = 0; written && c < C; c++) {
        written = buffer_append_text(b, c > 0 ? ",[" : "[");
        for (size_t k = 0; written && k < R; k++)
            written =
                (k == 0 || buffer_append(b, ",", 1)) && json_write_floats(b, x + (c * R + k) * width, width);
        written = written && buffer_append(b, "]", 1);
    }
    return written && buffer_append_text(b, C > 1 ? "]" : "");
}

static bool write_json(const scene *s, const jacobian_solve *j, buffer *b) {
    const jacobian_request *r = &j->request;
    const size_t C = s->n_channels, R = r->of.n_receivers;
    const float *x = j->values;
    bool written = answer_head(b, s->n, C, &j->notes) && buffer_append_text(b, ",\"sensors\":{");
    for (size_t k = 0; written && k < r->of.reduce.n_names; k++)
        written = (k == 0 || buffer_append(b, ",", 1)) && write_rows(s, &r->of.reduce, k, b);
    written = written && buffer_append_text(b, "},\"columns\":{");
    for (size_t k = 0; written && k < r->n_by; k++)
        written = (k == 0 || buffer_append(b, ",", 1)) && write_columns(s, r->by[k], b);
    written = written && buffer_append_text(b, "},\"jacobian\":{");
    for (size_t k = 0; written && k < r->n_by; k++) {
        size_t first;
        const size_t width = lights_of(s, r->by[k], &first);
        written = buffer_printf(b, "%s\"%s\":", k > 0 ? "," : "", jacobian_name(r->by[k])) &&
                  write_matrix(x, C, R, width, b);
        x += C * R * width;
    }
    return written && buffer_append(b, "}", 1) && answer_tail(b, &j->notes);
}

static bool write_npy(const call *in, const jacobian_solve *j, buffer *b) {
    const scene *s = in->scene;
    const size_t shape[] = {s->n_channels, j->request.of.n_receivers, j->n_columns};
    const size_t skipped = s->n_channels == 1;
    return npy_write_header(b, in->accept.npy, 3 - skipped, shape + skipped) &&
           npy_write_values(b, in->accept.npy, j->values, shape[0] * shape[1] * shape[2]);
}

static void end(call *in, answer *out) {
    jacobian_solve *s = in->state;
    buffer b = {0};
    const double start = clock_ms();
    const size_t count = in->scene->n_channels * s->request.of.n_receivers * s->n_columns;
    bool good = !s->failed && answer_check_as(s->values, count, true, &in->accept, &s->why);
    if (good) {
        const bool npy = in->accept.type == MEDIA_NPY;
        good = (npy ? write_npy(in, s, &b) : write_json(in->scene, s, &b)) ||
               problem_set(&s->why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
        s->notes.encode_ms = clock_ms() - start;
    }
    if (good) {
        answer_json(out, &b, true);
        answer_set_times(out, &s->notes);
        if (in->accept.type == MEDIA_NPY) out->type = "application/x-npy";
    } else {
        answer_problem(out, &s->why);
        buffer_free(&b);
    }
    in->state = NULL;
    solve_free(s);
}

static void drop(call *in) {
    solve_free(in->state);
    in->state = NULL;
}

const solve_steps post_jacobian = {.begin = begin, .pass = pass, .end = end, .drop = drop};
