#include "server/route/radiosity_figures.h"

#include "server/route/routes.h"
#include "server/scene/sensor_answer.h"
#include "solver/base/clock.h"
#include "solver/codec/answer.h"
#include "solver/codec/group_figures.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool figures_acceptable(const call *in, const radiosity_request *request, problem *why) {
    return !request->reduce.on || in->accept.type == MEDIA_JSON ||
           problem_set(why, PROBLEM_NOT_IN_ENCODING,
                       "reduce is answered in JSON; leave application/x-npy out of Accept");
}

/* The longest text of a double with the brackets and commas around it. */
#define DOUBLE_TEXT ((size_t)32)

size_t figures_bytes(const scene *s, const radiosity_request *request) {
    const reduce_request *r = &request->reduce;
    const size_t n_channels = radiosity_request_channels(request, s->n_channels),
                 of_name = bytes_times(bytes_times(request->n_rhs, n_channels), r->n_with);
    /* A name stands twice in the text, with two figures of its error, in escapes of up to six letters; the
     * last summand is for the means of a name and its errors. */
    /* Each share has its limit beside it. */
    return bytes_plus(
        bytes_plus(
            bytes_plus(bytes_times(bytes_times(r->n_names, of_name), sizeof(double) + DOUBLE_TEXT),
                       bytes_times(12, r->texts.length) + (r->n_names + 4) * (8 + r->n_with) * DOUBLE_TEXT),
            bytes_times(bytes_times(request->n_rhs, n_channels), 8 * sizeof(double))),
        eye_figures_bytes(s, request));
}

bool figures_allocate(const scene *s, const radiosity_request *request, kept_figures *out) {
    out->numbers =
        reduce_figures(&request->reduce, request->n_rhs, radiosity_request_channels(request, s->n_channels));
    return out->numbers != NULL && eye_figures_create(s, request, &out->eyes);
}

void figures_free(kept_figures *f) {
    free(f->numbers);
    eye_figures_free(f->eyes);
    *f = (kept_figures){.numbers = NULL};
}

/* Values of a vector in a channel, of which those of sensors are of all. */
static size_t width_of(const scene *s, const radiosity_request *request) {
    return request->reduce.of_sensors ? scene_sensors(s) : request->n_selected;
}

bool figures_reduce(const scene *s, const radiosity_request *request, size_t n_channels, size_t first,
                    size_t count, reduce_values x, kept_figures *figures) {
    const reduce_request *r = &request->reduce;
    x.whole = r->of_sensors;
    eye_figures_take(figures->eyes, first, count, n_channels, x);
    return reduce_vectors(r, r->of_sensors ? &s->sensor_sets : &s->groups, r->of_sensors ? NULL : s->area,
                          n_channels, request->n_rhs, first, count, x, figures->numbers);
}

/* The vectors one by one, by their luminance. */
static bool add_luminance(const scene *s, const radiosity_request *request, size_t first, size_t count,
                          const float *x, float *one, kept_figures *figures) {
    const size_t width = width_of(s, request), row = s->n_channels * width;
    bool good = true;
    for (size_t v = 0; good && v < count; v++) {
        memcpy(one, x + v * row, row * sizeof *one);
        answer_luminance(1, width, one);
        good = figures_reduce(s, request, 1, first + v, 1, (reduce_values){.floats = one}, figures);
    }
    return good;
}

bool figures_add(const scene *s, const radiosity_request *request, size_t first, size_t count, const float *x,
                 float *one, kept_figures *figures, problem *why) {
    const size_t n_values = count * s->n_channels * width_of(s, request);
    int bad = 0;
    /* A receiver without a value is NaN. */
    for (size_t i = 0; i < n_values; i++)
        bad |= !(fabsf(x[i]) <= FLT_MAX) && !(request->reduce.of_sensors && isnan(x[i]));
    if (bad)
        return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                           "the answer passes the range of single precision (3.4e38); scale the emission");
    return (one != NULL ? add_luminance(s, request, first, count, x, one, figures)
                        : figures_reduce(s, request, s->n_channels, first, count,
                                         (reduce_values){.floats = x}, figures)) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to reduce %zu vectors", count);
}

bool figures_refuse(const reduce_request *r, size_t k, size_t statistic, problem *why) {
    return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                       "the %s of %.200s is not finite, as it passes the range of its precision; scale the "
                       "emission",
                       reduce_statistic_name(r->with[statistic]), reduce_text(r, k));
}

/* NaN stands for a figure that has no value, so that it is no error here. */
static bool check_figures(const radiosity_request *request, size_t C, const double *figures, size_t first,
                          size_t count, problem *why) {
    const reduce_request *r = &request->reduce;
    for (size_t v = first * C; v < (first + count) * C; v++) {
        const size_t at = v / C / request->n_rhs;
        if (isinf(figures[v])) return figures_refuse(r, at / r->n_with, at % r->n_with, why);
    }
    return true;
}

/* Numbers between two looks at the clock, about .1 ms. */
#define BETWEEN_LOOKS ((size_t)64)

/* True of a figure that has ratings of eyes. */
static bool is_ugr(const reduce_request *r, size_t n_rhs, size_t at) {
    return r->with[reduce_place_of(r, n_rhs, at).statistic] == REDUCE_UGR;
}

/* Goes on with the ratings of eyes, or with numbers up to the next of them. */
static bool write_some(const radiosity_request *request, size_t C, kept_figures *figures, bool in_lux,
                       double until, figures_text *at, buffer *b, problem *why) {
    const reduce_request *r = &request->reduce;
    const size_t n_rhs = request->n_rhs, all = reduce_vectors_written(r, n_rhs);
    if (is_ugr(r, n_rhs, at->next)) {
        const reduce_place place = reduce_place_of(r, n_rhs, at->next);
        bool whole = false;
        if (!at->within && !reduce_write_before(r, n_rhs, request->batch, at->next, b)) return false;
        if (!eye_figures_write(figures->eyes, in_lux, place.name, place.vector, until, &whole, b))
            return false;
        at->within = !whole;
        return !whole || reduce_write_after(r, n_rhs, request->batch, at->next++, b);
    }
    size_t count = 1;
    while (count < BETWEEN_LOOKS && at->next + count < all && !is_ugr(r, n_rhs, at->next + count)) count++;
    const size_t first = at->next;
    at->next += count;
    return check_figures(request, C, figures->numbers, first, count, why) &&
           reduce_write_some(r, C, n_rhs, request->batch, figures->numbers, first, count, b);
}

bool figures_write(const scene *s, const radiosity_request *request, kept_figures *figures, double until,
                   figures_text *at, answer_notes *notes, buffer *b, bool *done, problem *why) {
    const reduce_request *r = &request->reduce;
    const size_t all = reduce_vectors_written(r, request->n_rhs);
    const size_t C = radiosity_request_channels(request, s->n_channels);
    const bool in_lux = strcmp(notes->unit, "lx") == 0 && (C == 1 || C == 3);
    const double start = clock_ms();
    bool written = at->begun || (answer_head(b, s->n, C, notes) &&
                                 buffer_append_text(b, r->of_sensors ? ",\"sensors\":{" : ",\"groups\":{"));
    at->begun = true;
    *done = false;
    while (written && at->next < all && clock_ms() < until)
        written = write_some(request, C, figures, in_lux, until, at, b, why);
    notes->encode_ms += clock_ms() - start;
    if (why->status != 0) return false;
    if (written && at->next == all) {
        written = buffer_append(b, "}", 1) && answer_of_vectors(b, request->n_rhs, request->batch, notes) &&
                  answer_tail(b, notes);
        *done = written;
    }
    return written || problem_set(why, PROBLEM_NO_MEMORY,
                                  "not enough memory for the answer; ask for fewer vectors or groups");
}
