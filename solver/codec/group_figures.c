#include "solver/codec/group_figures.h"

#include "solver/base/array_grow.h"
#include "solver/codec/json_writer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void reduce_request_free(reduce_request *r) {
    buffer_free(&r->texts);
    free(r->names);
    *r = (reduce_request){0};
}

const char *reduce_statistic_name(reduce_statistic statistic) {
    static const char *const names[] = {"mean",       "sum",      "min",   "max",
                                        "uniformity", "variance", "share", "ugr"};
    return names[statistic];
}

bool reduce_request_with(reduce_request *r, const char *word, size_t length, problem *why) {
    const int shown = length > 80 ? 80 : (int)length;
    for (int s = 0; s < REDUCE_COUNT; s++) {
        const char *name = reduce_statistic_name((reduce_statistic)s);
        if (strlen(name) != length || memcmp(name, word, length) != 0) continue;
        for (size_t k = 0; k < r->n_with; k++)
            if (r->with[k] == (reduce_statistic)s)
                return problem_set(why, PROBLEM_GIVEN_TWICE, "\"%s\" was listed before", name);
        r->with[r->n_with++] = (reduce_statistic)s;
        r->linear = (r->n_with == 1 || r->linear) && (s == REDUCE_MEAN || s == REDUCE_SUM);
        return true;
    }
    return problem_set(why, PROBLEM_UNKNOWN_WORD,
                       "\"%.*s\" must be one of: mean, sum, min, max, uniformity, variance", shown, word);
}

void reduce_request_shares(reduce_request *r, size_t at, size_t n_limits, const double *limits) {
    memmove(r->with + at + n_limits, r->with + at, (r->n_with - at) * sizeof *r->with);
    memmove(r->at_least + at + n_limits, r->at_least + at, (r->n_with - at) * sizeof *r->at_least);
    for (size_t k = 0; k < n_limits; k++) {
        r->with[at + k] = REDUCE_SHARE;
        r->at_least[at + k] = limits[k];
    }
    r->n_with += n_limits;
    r->linear = false;
}

void reduce_request_ugr(reduce_request *r) {
    r->with[r->n_with++] = REDUCE_UGR;
    r->linear = false;
}

bool reduce_has_ugr(const reduce_request *r) {
    size_t s = 0;
    while (s < r->n_with && r->with[s] != REDUCE_UGR) s++;
    return s < r->n_with;
}

const char *reduce_text(const reduce_request *r, size_t k) {
    return r->texts.bytes + r->names[k].text;
}

bool reduce_request_add(reduce_request *r, const char *name, size_t length, const uint32_t *groups,
                        size_t n_groups, problem *why) {
    for (size_t k = 0; k < r->n_names; k++)
        if (strlen(reduce_text(r, k)) == length && memcmp(reduce_text(r, k), name, length) == 0)
            return problem_set(why, PROBLEM_GIVEN_TWICE, "%.80s is given twice", reduce_text(r, k));
    if (r->n_names == REDUCE_NAMES_MAX)
        return problem_set(why, PROBLEM_TOO_MUCH, "more than %d groups; send several requests",
                           REDUCE_NAMES_MAX);
    if (array_grow(&r->names, &r->names_capacity, r->n_names + 1, sizeof *r->names, "names", NULL) != LAM_OK)
        return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the groups of reduce");
    const size_t text = r->texts.length;
    if (!buffer_append(&r->texts, name, length) || !buffer_append(&r->texts, "", 1))
        return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the groups of reduce");
    r->names[r->n_names++] = (reduce_name){.text = text, .groups = groups, .n_groups = n_groups};
    return true;
}

/* begin[g]: where the elements of group g stand among those of all names; UINT32_MAX: they do not. */
static uint32_t *places_of_groups(const reduce_request *r, const group_index *groups, size_t *count) {
    uint32_t *begin = memory_allocate(groups->n_groups, sizeof *begin, "reduce", NULL);
    if (begin == NULL) return NULL;
    memset(begin, 0xff, groups->n_groups * sizeof *begin);
    *count = 0;
    for (size_t k = 0; k < r->n_names; k++)
        for (size_t m = 0; m < r->names[k].n_groups; m++) {
            const uint32_t g = r->names[k].groups[m];
            if (begin[g] != UINT32_MAX) continue;
            begin[g] = (uint32_t)*count;
            *count += groups->start[g + 1] - groups->start[g];
        }
    return begin;
}

bool reduce_elements(const reduce_request *r, const group_index *groups, uint32_t **elements, size_t *count) {
    uint32_t *begin = places_of_groups(r, groups, count);
    uint32_t *all = begin != NULL ? memory_allocate(*count, sizeof *all, "reduce", NULL) : NULL;
    if (all != NULL)
        for (size_t g = 0; g < groups->n_groups; g++)
            if (begin[g] != UINT32_MAX)
                memcpy(all + begin[g], groups->elements + groups->start[g],
                       (groups->start[g + 1] - groups->start[g]) * sizeof *all);
    free(begin);
    *elements = all;
    return all != NULL;
}

double *reduce_figures(const reduce_request *r, size_t n_rhs, size_t n_channels) {
    size_t count;
    if (!size_multiply(r->n_names * r->n_with, n_channels, &count) || !size_multiply(count, n_rhs, &count))
        return NULL;
    return memory_allocate(count, sizeof(double), "reduce", NULL);
}

double *reduce_figure(const reduce_request *r, size_t k, size_t s, size_t n_rhs, size_t v, size_t n_channels,
                      size_t c, double *figures) {
    return figures + (((k * r->n_with + s) * n_rhs + v) * n_channels + c);
}

bool reduce_vectors(const reduce_request *r, const group_index *groups, const double *area, size_t n_channels,
                    size_t n_rhs, size_t first, size_t count, reduce_values x, double *figures) {
    size_t n_values = groups->start[groups->n_groups];
    uint32_t *begin = x.whole ? NULL : places_of_groups(r, groups, &n_values);
    unsigned asked = 0;
    if (begin == NULL && !x.whole) return false;
    for (size_t s = 0; s < r->n_with; s++) asked |= 1u << r->with[s];
    for (size_t v = 0; v < count; v++)
        for (size_t c = 0; c < n_channels; c++)
            for (size_t k = 0; k < r->n_names; k++) {
                double of_name[REDUCE_COUNT];
                const reduce_name *name = &r->names[k];
                const value_row row = {begin, x, (v * n_channels + c) * n_values};
                group_statistics(name->n_groups, name->groups, groups, area, &row, asked, of_name);
                for (size_t s = 0; s < r->n_with; s++)
                    *reduce_figure(r, k, s, n_rhs, first + v, n_channels, c, figures) =
                        r->with[s] == REDUCE_SHARE
                            ? group_share(name->n_groups, name->groups, groups, area, &row, r->at_least[s])
                        : r->with[s] == REDUCE_UGR ? (double)NAN
                                                   : of_name[r->with[s]];
            }
    free(begin);
    return true;
}

void reduce_means(const reduce_request *r, size_t k, size_t n_channels, size_t n_rhs, double area,
                  const double *means, double *figures) {
    for (size_t s = 0; s < r->n_with; s++)
        for (size_t v = 0; v < n_rhs; v++)
            for (size_t c = 0; c < n_channels; c++) {
                const double mean = means[v * n_channels + c];
                *reduce_figure(r, k, s, n_rhs, v, n_channels, c, figures) =
                    area > 0 ? r->with[s] == REDUCE_SUM ? area * mean : mean : NAN;
            }
}

bool reduce_write_channels(buffer *b, const double *values, size_t n_channels) {
    if (n_channels == 1) return json_write_double(b, values[0]);
    bool written = buffer_append(b, "[", 1);
    for (size_t c = 0; written && c < n_channels; c++)
        written = (c == 0 || buffer_append(b, ",", 1)) && json_write_double(b, values[c]);
    return written && buffer_append(b, "]", 1);
}

size_t reduce_vectors_written(const reduce_request *r, size_t n_rhs) {
    return r->n_names * r->n_with * n_rhs;
}

/* "mean":, or of the first share "share":{"300":, of a further one "500":. */
static bool begin_figure(const reduce_request *r, size_t s, buffer *b) {
    const char *name = reduce_statistic_name(r->with[s]);
    if (r->with[s] != REDUCE_SHARE) return buffer_printf(b, "\"%s\":", name);
    return (s > 0 && r->with[s - 1] == REDUCE_SHARE ? buffer_append(b, "\"", 1)
                                                    : buffer_printf(b, "\"%s\":{\"", name)) &&
           json_write_double(b, r->at_least[s]) && buffer_append(b, "\":", 2);
}

/* True of the last share. */
static bool ends_shares(const reduce_request *r, size_t s) {
    return r->with[s] == REDUCE_SHARE && (s + 1 == r->n_with || r->with[s + 1] != REDUCE_SHARE);
}

reduce_place reduce_place_of(const reduce_request *r, size_t n_rhs, size_t at) {
    return (reduce_place){at / n_rhs / r->n_with, at / n_rhs % r->n_with, at % n_rhs};
}

bool reduce_write_before(const reduce_request *r, size_t n_rhs, bool batch, size_t at, buffer *b) {
    const reduce_place p = reduce_place_of(r, n_rhs, at);
    bool written = true;
    if (p.vector > 0) return buffer_append(b, ",", 1);
    if (p.statistic == 0)
        written = (p.name == 0 || buffer_append(b, ",", 1)) && json_write_text(b, reduce_text(r, p.name)) &&
                  buffer_append(b, ":{", 2);
    return written && buffer_append_text(b, p.statistic == 0 ? "" : ",") && begin_figure(r, p.statistic, b) &&
           buffer_append_text(b, batch ? "[" : "");
}

bool reduce_write_after(const reduce_request *r, size_t n_rhs, bool batch, size_t at, buffer *b) {
    const reduce_place p = reduce_place_of(r, n_rhs, at);
    return p.vector + 1 < n_rhs || (buffer_append_text(b, batch ? "]" : "") &&
                                    buffer_append_text(b, ends_shares(r, p.statistic) ? "}" : "") &&
                                    buffer_append_text(b, p.statistic + 1 == r->n_with ? "}" : ""));
}

bool reduce_write_some(const reduce_request *r, size_t n_channels, size_t n_rhs, bool batch,
                       const double *figures, size_t first, size_t count, buffer *b) {
    bool written = true;
    for (size_t at = first; written && at < first + count; at++)
        written = reduce_write_before(r, n_rhs, batch, at, b) &&
                  (r->with[reduce_place_of(r, n_rhs, at).statistic] == REDUCE_UGR
                       ? buffer_append_text(b, "null")
                       : reduce_write_channels(b, figures + at * n_channels, n_channels)) &&
                  reduce_write_after(r, n_rhs, batch, at, b);
    return written;
}

bool reduce_write_names(const reduce_request *r, size_t n_channels, size_t n_rhs, bool batch,
                        const double *figures, buffer *b) {
    return reduce_write_some(r, n_channels, n_rhs, batch, figures, 0, reduce_vectors_written(r, n_rhs), b);
}

bool reduce_write(const reduce_request *r, size_t n_channels, size_t n_rhs, bool batch, const double *figures,
                  buffer *b) {
    return buffer_append(b, "{", 1) && reduce_write_names(r, n_channels, n_rhs, batch, figures, b) &&
           buffer_append(b, "}", 1);
}
