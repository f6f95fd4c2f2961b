#include "server/codec_answer.h"

#include "server/codec_json_writer.h"
#include "server/codec_npy.h"
#include "server/codec_request.h"
#include "solver/operator/half.h"

#include <float.h>
#include <math.h>

static bool no_memory(problem *why) {
    return problem_set(why, 503,
                       "not enough memory for the answer; ask for fewer vectors or select elements");
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
    const char *quantity = codec_quantity_name(notes->quantity);
    return (buffer_append_text(b, "{\"scene\":") && json_write_text(b, notes->scene) &&
            buffer_printf(b, ",\"elements\":%zu,\"channels\":%zu,\"quantity\":\"%s\",\"%s\":", shape->n,
                          shape->n_channels, quantity, quantity) &&
            (!shape->batch || buffer_append(b, "[", 1))) ||
           no_memory(why);
}

/* Refuses what would be written as something else than it is. */
static bool refuse_range(double limit, problem *why) {
    if (limit < (double)FLT_MAX)
        return problem_set(why, 422, "the answer passes the range of half precision (%g); ask for dtype=f4",
                           limit);
    return problem_set(why, 422,
                       "the answer passes the range of single precision (3.4e38); scale the emission");
}

static bool check_range(const float *x, size_t count, float limit, problem *why) {
    int bad = 0;
    for (size_t i = 0; i < count; i++) bad |= !(fabsf(x[i]) <= limit);
    return !bad || refuse_range((double)limit, why);
}

/* What stands before, between and behind the numbers of a vector and its channels. */
static bool open_row(buffer *b, const answer_shape *shape, bool json, size_t vector, size_t c) {
    if (!json) return true;
    if (c > 0) return buffer_append(b, ",", 1);
    return (vector == 0 || buffer_append(b, ",", 1)) && (shape->n_channels == 1 || buffer_append(b, "[", 1));
}

static bool close_row(buffer *b, const answer_shape *shape, bool json, size_t c) {
    return !json || shape->n_channels == 1 || c + 1 < shape->n_channels || buffer_append(b, "]", 1);
}

bool answer_add(buffer *b, const answer_shape *shape, const media_accept *as, size_t first, size_t count,
                const float *x, problem *why) {
    const size_t C = shape->n_channels, n = shape->n_values;
    const bool json = as->type == MEDIA_JSON;
    if (!check_range(x, count * C * n, !json && as->npy == NPY_F2 ? HALF_MAX : FLT_MAX, why)) return false;
    for (size_t row = 0; row < count * C; row++) {
        const float *values = x + row * n;
        if (!open_row(b, shape, json, first + row / C, row % C) ||
            !(json ? json_write_floats(b, values, n) : npy_write_values(b, as->npy, values, n)) ||
            !close_row(b, shape, json, row % C))
            return no_memory(why);
    }
    return true;
}

bool answer_add_doubles(buffer *b, const answer_shape *shape, const media_accept *as, size_t first,
                        size_t count, const double *x, double *rounding, problem *why) {
    const size_t C = shape->n_channels, n = shape->n_values;
    const bool json = as->type == MEDIA_JSON;
    const double limit = json || as->npy == NPY_F8 ? DBL_MAX
                         : as->npy == NPY_F4       ? (double)FLT_MAX
                                                   : (double)HALF_MAX;
    for (size_t i = 0; i < count * C * n; i++)
        if (!(fabs(x[i]) <= limit)) return refuse_range(limit, why);
    for (size_t row = 0; row < count * C; row++) {
        const double *values = x + row * n;
        if (!open_row(b, shape, json, first + row / C, row % C) ||
            !(json ? json_write_doubles(b, values, n) : npy_write_doubles(b, as->npy, values, n, rounding)) ||
            !close_row(b, shape, json, row % C))
            return no_memory(why);
    }
    return true;
}

/* A number, or one for each vector of a batch. */
static bool add_figures(buffer *b, const answer_shape *shape, const answer_notes *notes) {
    bool written = buffer_append_text(b, ",\"certificate\":") &&
                   (shape->batch ? json_write_doubles(b, notes->certificates, shape->n_rhs)
                                 : json_write_double(b, notes->certificates[0])) &&
                   buffer_append_text(b, shape->batch ? ",\"iterations\":[" : ",\"iterations\":");
    for (size_t v = 0; written && v < shape->n_rhs; v++)
        written = buffer_printf(b, v > 0 ? ",%zu" : "%zu", notes->iterations[v]);
    return written && (!shape->batch || buffer_append(b, "]", 1));
}

bool answer_end(buffer *b, const answer_shape *shape, const media_accept *as, const answer_notes *notes,
                problem *why) {
    if (as->type == MEDIA_NPY) return true;
    bool written = !shape->batch || buffer_append(b, "]", 1);
    if (notes->certificates != NULL)
        written = written && add_figures(b, shape, notes);
    else if (notes->has_error)
        written = written && buffer_append_text(b, ",\"error\":{\"relative_mean\":") &&
                  json_write_double(b, notes->relative_mean) &&
                  buffer_append_text(b, ",\"indirect_mean\":") &&
                  json_write_double(b, notes->indirect_mean) && buffer_append(b, "}", 1);
    return (written && buffer_printf(b, ",\"time_ms\":{\"parse\":%.3f,\"solve\":%.3f,\"encode\":%.3f}}\n",
                                     notes->parse_ms, notes->solve_ms, notes->encode_ms)) ||
           no_memory(why);
}
