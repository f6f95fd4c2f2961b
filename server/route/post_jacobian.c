/* POST /v1/scenes/NAME/jacobian: the matrix of derivatives of irradiances at sensors, or of means of groups
 * or values of elements, by dimmers of luminaires, by emissions of groups and by radiances of tiles, or by
 * weights of few emitters. begin reads the body, each vector of a pass is a row or a column of
 * jacobian_matrix.h, end writes. */
#include "server/route/jacobian_matrix.h"
#include "server/route/routes.h"
#include "server/scene/direct_light.h"
#include "solver/base/clock.h"
#include "solver/codec/answer.h"
#include "solver/codec/json_writer.h"
#include "solver/codec/npy.h"
#include "solver/operator/luminaire_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The state from begin to end. */
typedef struct jacobian_solve {
    jacobian_request request;
    jacobian_matrix matrix;
    answer_notes notes;
    problem why;
    bool failed;
} jacobian_solve;

static void solve_free(jacobian_solve *s) {
    jacobian_matrix_free(&s->matrix);
    jacobian_request_free(&s->request);
    free(s);
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
    if (!jacobian_matrix_begin(in, &s->request, &s->matrix, why)) return false;
    const size_t rows = bytes_times(in->scene->n_channels, s->matrix.n_rows);
    const size_t text =
        bytes_plus(bytes_times(bytes_times(rows, s->matrix.n_columns), NUMBER_BYTES),
                   bytes_plus(bytes_times(rows, s->request.n_by * ROW_BYTES),
                              names_bytes(in->scene) + 8 * s->request.of.reduce.texts.length + 4096));
    return request_memory_take(in->memory, text, why);
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
    return request_memory_take(
        in->memory, (s->request.of.n_receivers + s->request.of.n_selected) * sizeof(uint32_t), why);
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
    s->notes = call_notes(in);
    s->notes.quantity = s->request.of.quantity;
    s->notes.at = s->request.kind == JACOBIAN_AT_SENSORS ? "sensors" : NULL;
    s->notes.parse_ms = clock_ms() - start;
    good = good && find_room(in, s, &why);
    if (!good) {
        answer_problem(out, &why);
        solve_free(s);
        return false;
    }
    in->state = s;
    in->n_rhs = in->job.n_vectors = jacobian_matrix_parts(&s->matrix);
    in->n_written = s->matrix.n_columns * in->scene->n_channels * s->matrix.n_rows;
    in->job.key = (const void *)in;
    return true;
}

static void pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    for (size_t p = 0; p < n_parts; p++) {
        call *in = call_of(parts[p].job);
        jacobian_solve *s = in->state;
        const double start = clock_ms();
        if (!s->failed)
            s->failed =
                !jacobian_matrix_make(in, &s->matrix, parts[p].first, parts[p].count, workspace, &s->why);
        s->notes.solve_ms += clock_ms() - start;
    }
}

static const char *name_of(const scene *s, lam_by kind, size_t k) {
    return kind == LAM_BY_GROUPS     ? s->groups.names[k]
           : kind == LAM_BY_EMITTERS ? lam_operator_emitter_name(s->op, k)
                                     : lam_luminaires_name(s->luminaires, k);
}

/* ["desk-1", ...] of luminaires, groups and emitters; the number of tiles. */
static bool write_columns(const scene *s, lam_by kind, buffer *b) {
    size_t first;
    const size_t count = jacobian_lights(s, kind, &first);
    bool written = buffer_printf(b, "\"%s\":", jacobian_name(kind));
    if (kind == LAM_BY_SKY) return written && buffer_printf(b, "%zu", count);
    written = written && buffer_append(b, "[", 1);
    for (size_t k = 0; written && k < count; k++)
        written = (k == 0 || buffer_append(b, ",", 1)) && json_write_text(b, name_of(s, kind, k));
    return written && buffer_append(b, "]", 1);
}

/* "room":342: the rows of a set, in the order asked. */
static bool write_set(const scene *s, const reduce_request *r, size_t k, buffer *b) {
    size_t count = 0;
    for (size_t g = 0; g < r->names[k].n_groups; g++)
        count +=
            s->sensor_sets.start[r->names[k].groups[g] + 1] - s->sensor_sets.start[r->names[k].groups[g]];
    return json_write_text(b, reduce_text(r, k)) && buffer_printf(b, ":%zu", count);
}

/* "sensors":{"room":342},"groups":["desk"],: the rows; those of elements are in the order asked. */
static bool write_rows(const scene *s, const jacobian_request *j, buffer *b) {
    const reduce_request *r = &j->of.reduce;
    const bool sensors = j->kind == JACOBIAN_AT_SENSORS;
    if (j->kind == JACOBIAN_OF_ELEMENTS) return true;
    bool written = buffer_append_text(b, sensors ? "\"sensors\":{" : "\"groups\":[");
    for (size_t k = 0; written && k < r->n_names; k++)
        written = (k == 0 || buffer_append(b, ",", 1)) &&
                  (sensors ? write_set(s, r, k, b) : json_write_text(b, reduce_text(r, k)));
    return written && buffer_append_text(b, sensors ? "}," : "],");
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
    const size_t C = s->n_channels, R = j->matrix.n_rows;
    const float *x = j->matrix.values;
    bool written = answer_head(b, s->n, C, &j->notes) && buffer_append(b, ",", 1) && write_rows(s, r, b) &&
                   buffer_append_text(b, "\"columns\":{");
    for (size_t k = 0; written && k < r->n_by; k++)
        written = (k == 0 || buffer_append(b, ",", 1)) && write_columns(s, r->by[k], b);
    written = written && buffer_append_text(b, "},\"jacobian\":{");
    for (size_t k = 0; written && k < r->n_by; k++) {
        size_t first;
        const size_t width = jacobian_lights(s, r->by[k], &first);
        written = buffer_printf(b, "%s\"%s\":", k > 0 ? "," : "", jacobian_name(r->by[k])) &&
                  write_matrix(x, C, R, width, b);
        x += C * R * width;
    }
    return written && buffer_append(b, "}", 1) && answer_tail(b, &j->notes);
}

static bool write_npy(const call *in, const jacobian_solve *j, buffer *b) {
    const scene *s = in->scene;
    const size_t shape[] = {s->n_channels, j->matrix.n_rows, j->matrix.n_columns};
    const size_t skipped = s->n_channels == 1;
    return npy_write_header(b, in->accept.npy, 3 - skipped, shape + skipped) &&
           npy_write_values(b, in->accept.npy, j->matrix.values, shape[0] * shape[1] * shape[2]);
}

static void end(call *in, answer *out) {
    jacobian_solve *s = in->state;
    buffer b = {0};
    const double start = clock_ms();
    const size_t count = in->scene->n_channels * s->matrix.n_rows * s->matrix.n_columns;
    bool good = !s->failed && answer_check_as(s->matrix.values, count, true, &in->accept, &s->why);
    if (good) {
        jacobian_matrix_keep(in->scene, &s->matrix);
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
