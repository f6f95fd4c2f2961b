/* A solution as the daemon answers it, by the same writer, a vector at a time. */
#include "solver/codec/answer.h"
#include "solver/codec/json_writer.h"
#include "solver/output/output.h"

/* Sends what b holds to the stream. */
static void flush(buffer *b, FILE *stream) {
    if (b->length > 0) fwrite(b->bytes, 1, b->length, stream);
    b->length = 0;
}

/* "sum":ROWS of every figure of a year. */
static bool write_year(const solution *s, buffer *b, FILE *stream, problem *why) {
    const size_t C = s->m->n_channels, n = output_width(s);
    const media_accept as = {.type = MEDIA_JSON};
    for (size_t v = 0; v < s->n_vectors; v++) {
        const bool written = (v == 0 || buffer_append(b, ",", 1)) && json_write_text(b, s->names[v]) &&
                             buffer_append(b, ":", 1);
        if (!written) return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
        if (!answer_rows(b, &as, C, n, s->faces != NULL, s->values + v * C * n, why)) return false;
        flush(b, stream);
    }
    return true;
}

/* "sum":{"desk":{"mean":...},...} of every figure of a year: each is reduced by itself. */
static bool write_reduced_year(const solution *s, buffer *b) {
    const size_t C = s->m->n_channels;
    bool written = true;
    for (size_t v = 0; written && v < s->n_vectors; v++) {
        written = (v == 0 || buffer_append(b, ",", 1)) && json_write_text(b, s->names[v]) &&
                  buffer_append(b, ":{", 2);
        for (size_t r = 0; written && r < s->n_reductions; r++) {
            const reduction *of = &s->reductions[r];
            written = (r == 0 || buffer_append(b, ",", 1)) && json_write_text(b, of->group) &&
                      buffer_append(b, ":{", 2);
            for (size_t k = 0; written && k < of->request.n_with; k++)
                written = (k == 0 || buffer_append(b, ",", 1)) &&
                          buffer_printf(b, "\"%s\":", reduce_statistic_name(of->request.with[k])) &&
                          reduce_write_channels(
                              b, reduce_figure(&of->request, 0, k, s->n_vectors, v, C, 0, of->figures), C);
            written = written && buffer_append(b, "}", 1);
        }
        written = written && buffer_append(b, "}", 1);
    }
    return written;
}

static bool write_reductions(const solution *s, buffer *b) {
    bool written = true;
    for (size_t r = 0; written && r < s->n_reductions; r++)
        written = (r == 0 || buffer_append(b, ",", 1)) &&
                  reduce_write_names(&s->reductions[r].request, s->m->n_channels, s->n_vectors, s->batch,
                                     s->reductions[r].figures, b);
    return written;
}

/* The mean of a group in every channel of a vector. */
static bool write_mean(const solution *s, uint32_t g, size_t v, buffer *b) {
    const size_t C = s->m->n_channels, n = s->m->n;
    bool written = C == 1 || buffer_append(b, "[", 1);
    for (size_t c = 0; written && c < C; c++) {
        const size_t at = (v * C + c) * n;
        const reduce_values x = {.floats = s->values != NULL ? s->values + at : NULL,
                                 .doubles = s->refined != NULL ? s->refined + at : NULL};
        double figures[REDUCE_COUNT];
        reduce_groups(1, &g, s->groups, s->m->area, x, figures);
        written = (c == 0 || buffer_append(b, ",", 1)) && reduce_write_channels(b, &figures[REDUCE_MEAN], 1);
    }
    return written && (C == 1 || buffer_append(b, "]", 1));
}

/* "floor":{"elements":N,"area":A,"mean":...},..., with "buried" where figures leave some out, of vectors v0
 * to end; a list of means for a batch. */
static bool write_means(const solution *s, size_t v0, size_t end, bool list, buffer *b) {
    bool written = true;
    for (uint32_t g = 0; written && g < s->m->n_groups; g++) {
        group_extent counted, buried;
        group_index_extent(s->groups, g, s->m->area, &counted, &buried);
        written = (g == 0 || buffer_append(b, ",", 1)) && json_write_text(b, s->m->group_names[g]) &&
                  buffer_printf(b, ":{\"elements\":%zu,\"area\":", counted.elements) &&
                  json_write_double(b, counted.area);
        if (buried.elements > 0)
            written = written &&
                      buffer_printf(b, ",\"buried\":{\"elements\":%zu,\"area\":", buried.elements) &&
                      json_write_double(b, buried.area) && buffer_append(b, "}", 1);
        written = written && buffer_printf(b, ",\"mean\":%s", list ? "[" : "");
        for (size_t v = v0; written && v < end; v++)
            written = (v == v0 || buffer_append(b, ",", 1)) && write_mean(s, g, v, b);
        written = written && buffer_printf(b, "%s", list ? "]}" : "}");
    }
    return written;
}

/* "sum":{"floor":{...},...},... of every figure of a year. */
static bool write_year_means(const solution *s, buffer *b) {
    bool written = true;
    for (size_t v = 0; written && v < s->n_vectors; v++)
        written = (v == 0 || buffer_append(b, ",", 1)) && json_write_text(b, s->names[v]) &&
                  buffer_append(b, ":{", 2) && write_means(s, v, v + 1, false, b) && buffer_append(b, "}", 1);
    return written;
}

static bool write_vectors(const solution *s, const answer_shape *shape, const answer_notes *notes, buffer *b,
                          FILE *stream, problem *why) {
    const size_t row = s->m->n_channels * output_width(s);
    const media_accept as = {.type = MEDIA_JSON};
    double rounding = 0;
    if (!answer_begin(b, shape, &as, notes, why)) return false;
    for (size_t v = 0; v < s->n_vectors; v++) {
        if (!(s->values != NULL
                  ? answer_add(b, shape, &as, v, 1, s->values + v * row, why)
                  : answer_add_doubles(b, shape, &as, v, 1, s->refined + v * row, &rounding, why)))
            return false;
        flush(b, stream);
    }
    return answer_end(b, shape, &as, notes, why);
}

static bool write_hours(const solution *s, buffer *b) {
    const weather_hours *h = s->hours;
    return h == NULL ||
           (buffer_printf(b, ",\"hours\":{\"counted\":") && json_write_double(b, h->counted) &&
            buffer_printf(b, ",\"left_out\":") && json_write_double(b, h->left_out) &&
            buffer_printf(b, ",\"filled\":") && json_write_double(b, h->filled) && buffer_append(b, "}", 1));
}

/* An object of figures in place of vectors: means of all groups, figures of a year or reductions. */
static bool write_object(const solution *s, bool means, const answer_notes *notes, buffer *b, FILE *stream,
                         problem *why) {
    const bool year = s->names != NULL, reduced = s->n_reductions > 0;
    bool written = answer_head(b, s->m->n, s->m->n_channels, notes) && write_hours(s, b) &&
                   buffer_printf(b, ",\"%s\":{",
                                 !year                 ? "groups"
                                 : s->named_as != NULL ? s->named_as
                                                       : "annual");
    if (means) {
        written = written && (year ? write_year_means(s, b) : write_means(s, 0, s->n_vectors, s->batch, b));
    } else if (year && !reduced) {
        if (written && !write_year(s, b, stream, why)) return false;
    } else {
        written = written && (year ? write_reduced_year(s, b) : write_reductions(s, b));
    }
    written = written && buffer_append(b, "}", 1) && answer_of_vectors(b, s->n_vectors, s->batch, notes) &&
              answer_tail(b, notes);
    return written || problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
}

static lam_status write_all(const solution *s, bool means, FILE *stream, lam_error *error) {
    lam_status status = LAM_OK;
    buffer b = {0};
    problem why = {0};
    const answer_shape shape = {.n = s->m->n,
                                .n_channels = s->m->n_channels,
                                .n_rhs = s->n_vectors,
                                .batch = s->batch,
                                .n_values = output_width(s),
                                .gaps = s->faces != NULL};
    const answer_notes notes = {.scene = s->scene,
                                .quantity = s->quantity,
                                .unit = s->unit,
                                .sum_unit = s->sum_unit,
                                .converted_by = s->converted_by,
                                .has_error = s->relative >= 0,
                                .relative_mean = s->relative,
                                .indirect_mean = s->indirect,
                                .head = s->head,
                                .error_of = s->error_of,
                                .error_from = s->error_from,
                                .error_light = s->error_light,
                                .at = s->faces != NULL ? "faces" : NULL,
                                .by_luminance = s->by_luminance,
                                .emitters = s->emitters,
                                .n_name_errors = s->name_errors != NULL ? s->n_reductions : 0,
                                .name_errors = s->name_errors,
                                .limited = s->limited,
                                .certificates = s->certificates,
                                .iterations = s->iterations};
    const bool vectors = !means && s->names == NULL && s->n_reductions == 0;
    if (!(vectors ? write_vectors(s, &shape, &notes, &b, stream, &why)
                  : write_object(s, means, &notes, &b, stream, &why)))
        FAIL(error, why.status == 503 ? LAM_ERR_MEMORY : LAM_ERR_ARGUMENT, "%s", why.detail);
    flush(&b, stream);
done:
    buffer_free(&b);
    return status;
}

lam_status output_json(const solution *s, FILE *stream, lam_error *error) {
    return write_all(s, false, stream, error);
}

lam_status output_print_json(const solution *s, lam_error *error) {
    return write_all(s, s->n_reductions == 0 && s->faces == NULL, stdout, error);
}
