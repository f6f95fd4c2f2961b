/* A solution as the daemon answers it. */
#include "solver/output/output.h"

#include <jansson.h>
#include <math.h>

static json_t *row(const solution *s, size_t column) {
    const size_t n = s->m->n;
    json_t *out = json_array();
    for (size_t i = 0; i < n; i++) json_array_append_new(out, json_real(output_value(s, column * n + i)));
    return out;
}

/* [n], or [C][n] for more than one channel. */
static json_t *vector(const solution *s, size_t v) {
    const size_t n_channels = s->m->n_channels;
    if (n_channels == 1) return row(s, v);
    json_t *out = json_array();
    for (size_t c = 0; c < n_channels; c++) json_array_append_new(out, row(s, v * n_channels + c));
    return out;
}

static json_t *number_or_null(double x) {
    return isfinite(x) ? json_real(x) : json_null();
}

/* One group's figures of one vector: a number each, or one per channel. */
static void reduce_into(const solution *s, const reduction *r, size_t v, json_t *groups) {
    const size_t n_channels = s->m->n_channels;
    json_t *out = json_object_get(groups, r->group);
    if (out == NULL) {
        out = json_object();
        json_object_set_new(groups, r->group, out);
    }
    for (int k = 0; k < REDUCE_COUNT; k++)
        if (r->wanted[k]) json_object_set_new(out, reduce_name((reduce_statistic)k), json_array());
    for (size_t c = 0; c < n_channels; c++) {
        double figures[REDUCE_COUNT];
        output_figures(s, r->inside, v * n_channels + c, figures);
        for (int k = 0; k < REDUCE_COUNT; k++) {
            const char *name = reduce_name((reduce_statistic)k);
            if (!r->wanted[k]) continue;
            if (n_channels == 1)
                json_object_set_new(out, name, number_or_null(figures[k]));
            else
                json_array_append_new(json_object_get(out, name), number_or_null(figures[k]));
        }
    }
}

static json_t *groups_of(const solution *s, size_t v) {
    json_t *groups = json_object();
    for (size_t i = 0; i < s->n_reductions; i++) reduce_into(s, &s->reductions[i], v, groups);
    return groups;
}

/* What a refined answer carries: a number, or one for each vector of a batch. */
static void set_figures(const solution *s, json_t *answer) {
    json_t *certificates = json_array(), *iterations = json_array();
    for (size_t v = 0; v < s->n_vectors; v++) {
        json_array_append_new(certificates, json_real(s->certificates[v]));
        json_array_append_new(iterations, json_integer((json_int_t)s->iterations[v]));
    }
    json_object_set(answer, "certificate", s->batch ? certificates : json_array_get(certificates, 0));
    json_object_set(answer, "iterations", s->batch ? iterations : json_array_get(iterations, 0));
    json_decref(certificates);
    json_decref(iterations);
}

lam_status output_json(const solution *s, FILE *stream, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *answer = json_object();
    const bool reduced = s->n_reductions > 0;
    json_object_set_new(answer, "scene", json_string(s->scene));
    json_object_set_new(answer, "elements", json_integer((json_int_t)s->m->n));
    json_object_set_new(answer, "channels", json_integer((json_int_t)s->m->n_channels));
    json_object_set_new(answer, "quantity", json_string(s->quantity));
    json_t *values;
    if (s->names != NULL) {
        values = json_object();
        for (size_t v = 0; v < s->n_vectors; v++)
            json_object_set_new(values, s->names[v], reduced ? groups_of(s, v) : vector(s, v));
    } else if (s->batch) {
        values = json_array();
        for (size_t v = 0; v < s->n_vectors; v++)
            json_array_append_new(values, reduced ? groups_of(s, v) : vector(s, v));
    } else {
        values = reduced ? groups_of(s, 0) : vector(s, 0);
    }
    const char *what = s->names != NULL ? "annual" : reduced ? "groups" : s->quantity;
    json_object_set_new(answer, what, values);
    if (s->certificates != NULL)
        set_figures(s, answer);
    else if (s->relative >= 0)
        json_object_set_new(
            answer, "error",
            json_pack("{s:f, s:f}", "relative_mean", s->relative, "indirect_mean", s->indirect));
    if (json_dumpf(answer, stream, JSON_COMPACT | JSON_REAL_PRECISION((size_t)output_digits(s))) != 0 &&
        !ferror(stream))
        FAIL(error, LAM_ERR_MEMORY, "not enough memory to write the answer as JSON; write .npy");
    fputc('\n', stream);
done:
    json_decref(answer);
    return status;
}
