#include "solver/codec/answer.h"

#include "solver/base/half.h"
#include "solver/codec/answer_stream.h"
#include "solver/codec/json_writer.h"
#include "solver/codec/npy.h"
#include "solver/codec/request.h"

#include <float.h>
#include <math.h>
#include <string.h>

static bool no_memory(problem *why) {
    return problem_set(why, PROBLEM_NO_MEMORY,
                       "not enough memory for the answer; ask for fewer vectors or select elements");
}

/* The word of the quantity. */
static const char *quantity_of(const answer_notes *notes) {
    return notes->at != NULL && strcmp(notes->at, "probes") == 0 ? "radiance"
                                                                 : codec_quantity_name(notes->quantity);
}

bool answer_head(buffer *b, size_t n, size_t n_channels, const answer_notes *notes) {
    const char *by = notes->converted_by;
    return buffer_append_text(b, "{\"scene\":") && json_write_text(b, notes->scene) &&
           buffer_printf(b, ",\"elements\":%zu,\"channels\":%zu,\"quantity\":\"%s\"", n, n_channels,
                         quantity_of(notes)) &&
           (notes->at == NULL || buffer_printf(b, ",\"at\":\"%s\"", notes->at)) &&
           (notes->unit == NULL || buffer_printf(b, ",\"unit\":\"%s\"", notes->unit)) &&
           (notes->sum_unit == NULL || buffer_printf(b, ",\"sum_unit\":\"%s\"", notes->sum_unit)) &&
           (by == NULL || by[0] == '\0' || buffer_printf(b, ",\"converted_by\":\"%s\"", by));
}

void answer_note_unit(const light_conversion *told, lam_quantity quantity, char text[LIGHT_CONVERSION_TEXT],
                      answer_notes *notes) {
    light_conversion_text(told, text);
    notes->unit = light_conversion_unit(told, quantity != LAM_IRRADIANCE);
    notes->converted_by = text;
}

/* A number is written at or before all that is read later. */
void answer_luminance(size_t n_rows, size_t n, float *x) {
    for (size_t row = 0; row < n_rows; row++) {
        const float *from = x + 3 * row * n;
        for (size_t i = 0; i < n; i++)
            x[row * n + i] =
                (float)luminance_of((double)from[i], (double)from[n + i], (double)from[2 * n + i]);
    }
}

/* Three products and two sums of at most the largest number. */
void answer_luminance_double(size_t n_rows, size_t n, double *x, double *certificates) {
    for (size_t row = 0; row < n_rows; row++) {
        const double *from = x + 3 * row * n;
        double largest = 0;
        for (size_t i = 0; i < 3 * n; i++) largest = fmax(largest, fabs(from[i]));
        if (certificates != NULL) certificates[row] += 5 * 0x1p-53 * largest;
        for (size_t i = 0; i < n; i++) x[row * n + i] = luminance_of(from[i], from[n + i], from[2 * n + i]);
    }
}

/* The light that the figures are of, and those of each name that is reduced. */
static bool write_light(buffer *b, const answer_notes *notes) {
    bool written = true;
    if (notes->error_light == NULL) return true;
    written = buffer_printf(b, ",\"light\":\"%s\"", notes->error_light);
    if (strcmp(notes->error_light, "own") != 0) return written;
    written = written && buffer_append_text(b, ",\"emitters\":") && json_write_double(b, notes->emitters);
    if (notes->n_name_errors == 0) return written;
    written = written && buffer_append_text(b, ",\"groups\":{");
    for (size_t k = 0; written && k < notes->n_name_errors; k++) {
        const name_error *one = &notes->name_errors[k];
        const headline head = {.known = true, .parts = one->parts};
        written = (k == 0 || buffer_append(b, ",", 1)) && json_write_text(b, one->name) &&
                  buffer_append_text(b, ":{\"mean\":") && json_write_double(b, one->mean) &&
                  buffer_append_text(b, ",\"elements\":") && json_write_double(b, one->elements) &&
                  buffer_append_text(b, ",\"stated\":") && json_write_double(b, headline_stated(&head)) &&
                  buffer_append(b, "}", 1);
    }
    return written && buffer_append(b, "}", 1);
}

/* Of sensors there are the headline and its parts, of all together, and the one figure of each name. */
static bool write_sensors_error(buffer *b, const answer_notes *notes) {
    bool written = buffer_append_text(b, ",\"error\":{") && headline_write(b, &notes->head) &&
                   buffer_printf(b, ",\"light\":\"%s\",\"sensors\":{", notes->error_light);
    for (size_t k = 0; written && k < notes->n_name_errors; k++) {
        const name_error *one = &notes->name_errors[k];
        const headline head = {.known = true, .parts = one->parts};
        written = (k == 0 || buffer_append(b, ",", 1)) && json_write_text(b, one->name) &&
                  buffer_append_text(b, ":{\"stated\":") && json_write_double(b, headline_stated(&head)) &&
                  buffer_append(b, "}", 1);
    }
    return written && buffer_append(b, "}}", 2);
}

/* The figures, and the elements that they are of; without figures a word on why there are none. */
static bool write_error(buffer *b, const answer_notes *notes) {
    const char *of = notes->error_of, *from = notes->error_from;
    const headline *head = &notes->head;
    if (!notes->has_error)
        return head->advice == NULL ||
               (buffer_append_text(b, ",\"error\":{") && headline_write(b, head) &&
                (from == NULL || buffer_printf(b, ",\"from\":\"%s\"", from)) && buffer_append(b, "}", 1));
    if (notes->of_sensors) return write_sensors_error(b, notes);
    return buffer_append_text(b, ",\"error\":{") && headline_write(b, head) &&
           buffer_append_text(b, ",\"relative_mean\":") && json_write_double(b, notes->relative_mean) &&
           buffer_append_text(b, ",\"indirect_mean\":") && json_write_double(b, notes->indirect_mean) &&
           (!(head->parts.mesh > 0) ||
            (buffer_append_text(b, ",\"mesh\":") && json_write_double(b, head->parts.mesh))) &&
           write_light(b, notes) && (of == NULL || buffer_printf(b, ",\"of\":\"%s\"", of)) &&
           (from == NULL || buffer_printf(b, ",\"from\":\"%s\"", from)) && buffer_append(b, "}", 1);
}

bool answer_tail(buffer *b, const answer_notes *notes) {
    return (!notes->by_luminance || buffer_append_text(b, ",\"sky\":\"luminance\"")) &&
           (notes->certificates != NULL || write_error(b, notes)) &&
           (!notes->has_time ||
            buffer_printf(b, ",\"time_ms\":{\"parse\":%.3f,\"solve\":%.3f,\"encode\":%.3f}", notes->parse_ms,
                          notes->solve_ms, notes->encode_ms)) &&
           buffer_append(b, "}\n", 2);
}

bool answer_begin(buffer *b, const answer_shape *shape, const media_accept *as, const answer_notes *notes,
                  problem *why) {
    if (as->type == MEDIA_NPY) {
        size_t dims[3], rank = 0;
        if (shape->batch) dims[rank++] = shape->n_rhs;
        if (shape->n_channels > 1) dims[rank++] = shape->n_channels;
        dims[rank++] = shape->n_values;
        return npy_write_header(b, as->npy, rank, dims) || no_memory(why);
    }
    return (answer_head(b, shape->n, shape->n_channels, notes) &&
            buffer_printf(b, ",\"%s\":%s", quantity_of(notes), shape->batch ? "[" : "")) ||
           no_memory(why);
}

/* Refuses an answer that is outside the range of its format. */
static bool refuse_range(double limit, problem *why) {
    if (limit < (double)FLT_MAX)
        return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                           "the answer passes the range of half precision (%g); ask for dtype=f4", limit);
    return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                       "the answer passes the range of single precision (3.4e38); scale the emission");
}

static bool check_range(const float *x, size_t count, bool gaps, float limit, problem *why) {
    int bad = 0, missing = 0;
    for (size_t i = 0; i < count; i++) {
        bad |= fabsf(x[i]) > limit;
        missing |= isnan(x[i]);
    }
    return (!bad && (gaps || !missing)) || refuse_range((double)limit, why);
}

bool answer_check_as(const float *x, size_t count, bool gaps, const media_accept *as, problem *why) {
    return check_range(x, count, gaps, as->type == MEDIA_NPY && as->npy == NPY_F2 ? HALF_MAX : FLT_MAX, why);
}

bool answer_check(const float *x, size_t count, problem *why) {
    return check_range(x, count, false, FLT_MAX, why);
}

static bool add_row(buffer *b, const media_accept *as, const float *row, size_t n) {
    if (as->type == MEDIA_NPY) return npy_write_values(b, as->npy, row, n);
    return json_write_floats(b, row, n);
}

bool answer_rows(buffer *b, const media_accept *as, size_t n_channels, size_t n, bool gaps, const float *x,
                 problem *why) {
    const bool json = as->type == MEDIA_JSON, deep = json && n_channels > 1;
    if (!answer_check_as(x, n_channels * n, gaps, as, why)) return false;
    bool written = !deep || buffer_append(b, "[", 1);
    for (size_t c = 0; written && c < n_channels; c++)
        written = (!json || c == 0 || buffer_append(b, ",", 1)) && add_row(b, as, x + c * n, n);
    return (written && (!deep || buffer_append(b, "]", 1))) || no_memory(why);
}

bool answer_add(buffer *b, const answer_shape *shape, const media_accept *as, size_t first, size_t count,
                const float *x, problem *why) {
    const size_t C = shape->n_channels, n = shape->n_values;
    for (size_t r = 0; r < count; r++) {
        if (as->type == MEDIA_JSON && first + r > 0 && !buffer_append(b, ",", 1)) return no_memory(why);
        if (!answer_rows(b, as, C, n, shape->gaps, x + r * C * n, why)) return false;
    }
    return true;
}

static size_t count_values(const answer_shape *shape) {
    size_t count;
    return size_multiply(shape->n_rhs, shape->n_channels, &count) &&
                   size_multiply(count, shape->n_values, &count)
               ? count
               : SIZE_MAX;
}

size_t answer_placed_bytes(const answer_shape *shape, const media_accept *as) {
    media_accept floats = *as;
    if (as->type != MEDIA_NPY || as->npy == NPY_F8) return 0;
    floats.npy = NPY_F4;
    return answer_bytes_most(shape, &floats);
}

float *answer_place(buffer *b, const answer_shape *shape) {
    size_t bytes;
    if (!size_multiply(count_values(shape), sizeof(float), &bytes) || !buffer_reserve(b, bytes)) return NULL;
    return (float *)(void *)(b->bytes + b->length);
}

bool answer_placed(buffer *b, const answer_shape *shape, const media_accept *as, problem *why) {
    const size_t count = count_values(shape);
    char *const to = b->bytes + b->length;
    const float *x = (const float *)(const void *)to;
    if (!answer_check_as(x, count, shape->gaps, as, why)) return false;
    if (as->npy == NPY_F2) npy_convert(NPY_F2, x, count, to);
    b->length += count * npy_size(as->npy);
    b->bytes[b->length] = '\0';
    return true;
}

/* Appends the separator behind the row before; each vector stands in brackets where there are several. */
static bool before_row(buffer *b, const answer_shape *shape, size_t vector, size_t c) {
    if (c > 0) return buffer_append(b, ",", 1);
    return (vector == 0 || buffer_append(b, ",", 1)) && (shape->n_channels == 1 || buffer_append(b, "[", 1));
}

static bool behind_row(buffer *b, const answer_shape *shape, size_t c) {
    return shape->n_channels == 1 || c + 1 < shape->n_channels || buffer_append(b, "]", 1);
}

bool answer_add_doubles(buffer *b, const answer_shape *shape, const media_accept *as, size_t first,
                        size_t count, const double *x, double *rounding, problem *why) {
    const size_t C = shape->n_channels, n = shape->n_values;
    const bool json = as->type == MEDIA_JSON;
    const double limit = json || as->npy == NPY_F8 ? DBL_MAX
                         : as->npy == NPY_F4       ? (double)FLT_MAX
                                                   : (double)HALF_MAX;
    for (size_t i = 0; i < count * C * n; i++)
        if (!(fabs(x[i]) <= limit) && !(shape->gaps && isnan(x[i]))) return refuse_range(limit, why);
    for (size_t row = 0; row < count * C; row++) {
        const double *values = x + row * n;
        const bool written = json ? before_row(b, shape, first + row / C, row % C) &&
                                        json_write_doubles(b, values, n) && behind_row(b, shape, row % C)
                                  : npy_write_doubles(b, as->npy, values, n, rounding);
        if (!written) return no_memory(why);
    }
    return true;
}

/* ,"iterations":12 or ,"iterations":[12,9,...]. */
static bool write_counts(buffer *b, const char *name, size_t n_rhs, bool batch, const size_t *counts) {
    bool written = buffer_printf(b, ",\"%s\":%s", name, batch ? "[" : "");
    for (size_t v = 0; written && v < n_rhs; v++)
        written = buffer_printf(b, v > 0 ? ",%zu" : "%zu", counts[v]);
    return written && (!batch || buffer_append(b, "]", 1));
}

bool answer_of_vectors(buffer *b, size_t n_rhs, bool batch, const answer_notes *notes) {
    if (notes->limited != NULL && !write_counts(b, "limited", n_rhs, batch, notes->limited)) return false;
    return notes->certificates == NULL || (buffer_append_text(b, ",\"certificate\":") &&
                                           (batch ? json_write_doubles(b, notes->certificates, n_rhs)
                                                  : json_write_double(b, notes->certificates[0])) &&
                                           write_counts(b, "iterations", n_rhs, batch, notes->iterations));
}

bool answer_end(buffer *b, const answer_shape *shape, const media_accept *as, const answer_notes *notes,
                problem *why) {
    if (as->type == MEDIA_NPY) return true;
    return ((!shape->batch || buffer_append(b, "]", 1)) &&
            answer_of_vectors(b, shape->n_rhs, shape->batch, notes) && answer_tail(b, notes)) ||
           no_memory(why);
}
