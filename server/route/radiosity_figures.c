#include "server/route/radiosity_figures.h"

#include "server/route/routes.h"
#include "server/scene/adjoint_rows.h"

#include "solver/base/clock.h"
#include "solver/codec/group_figures.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Limits of a request that the I/O thread answers itself, well below a millisecond: bytes of the body,
 * products, bytes of emission, numbers of the answer, each of which takes up to 2.5 us to write. */
#define QUICK_BODY ((size_t)32 << 10)
#define QUICK_WORK ((size_t)100000)
#define QUICK_BYTES ((size_t)1 << 20)
#define QUICK_NUMBERS ((size_t)400)

bool figures_acceptable(const call *in, const radiosity_request *request, problem *why) {
    return !request->reduce.on || in->accept.type == MEDIA_JSON ||
           problem_set(why, PROBLEM_NOT_IN_ENCODING,
                       "reduce is answered in JSON; leave application/x-npy out of Accept");
}

/* The longest text of a double with the brackets and commas around it. */
#define DOUBLE_TEXT ((size_t)32)

size_t figures_bytes(const radiosity_request *request, size_t n_channels) {
    const reduce_request *r = &request->reduce;
    const size_t of_name = bytes_times(bytes_times(request->n_rhs, n_channels), r->n_with);
    /* A name stands twice in the text, with two figures of its error, in escapes of up to six letters; the
     * last summand is for the means of a name and its errors. */
    return bytes_plus(bytes_plus(bytes_times(bytes_times(r->n_names, of_name), sizeof(double) + DOUBLE_TEXT),
                                 bytes_times(12, r->texts.length) + (r->n_names + 4) * 8 * DOUBLE_TEXT),
                      bytes_times(bytes_times(request->n_rhs, n_channels), 8 * sizeof(double)));
}

bool figures_add(const scene *s, const radiosity_request *request, size_t first, size_t count, const float *x,
                 double *figures, problem *why) {
    const size_t n_values = count * s->n_channels * request->n_selected;
    int bad = 0;
    for (size_t i = 0; i < n_values; i++) bad |= !(fabsf(x[i]) <= FLT_MAX);
    if (bad)
        return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                           "the answer passes the range of single precision (3.4e38); scale the emission");
    return reduce_vectors(&request->reduce, &s->groups, s->area, s->n_channels, request->n_rhs, first, count,
                          (reduce_values){.floats = x}, figures) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to reduce %zu vectors", count);
}

/* Refuses the figure of name k that is not finite. */
static bool refuse_figure(const reduce_request *r, size_t k, size_t statistic, problem *why) {
    return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                       "the %s of %.200s is not finite, as it passes the range of its precision; scale the "
                       "emission",
                       reduce_statistic_name(r->with[statistic]), reduce_text(r, k));
}

/* NaN stands for a figure that has no value, so that it is no error here. */
static bool check_figures(const scene *s, const radiosity_request *request, const double *figures,
                          problem *why) {
    const reduce_request *r = &request->reduce;
    const size_t count = request->n_rhs * s->n_channels;
    for (size_t k = 0; k < r->n_names; k++)
        for (size_t statistic = 0; statistic < r->n_with; statistic++, figures += count)
            for (size_t v = 0; v < count; v++)
                if (isinf(figures[v])) return refuse_figure(r, k, statistic, why);
    return true;
}

/* The means [n_rhs][C] of name k over elements that have an area. */
static bool check_means(const scene *s, const radiosity_request *request, size_t k, const double *means,
                        problem *why) {
    for (size_t v = 0; v < request->n_rhs * s->n_channels; v++)
        if (!isfinite(means[v])) return refuse_figure(&request->reduce, k, 0, why);
    return true;
}

bool figures_write(const scene *s, const radiosity_request *request, const double *figures,
                   const answer_notes *notes, buffer *b, problem *why) {
    if (!check_figures(s, request, figures, why)) return false;
    return (answer_head(b, s->n, s->n_channels, notes) && buffer_append_text(b, ",\"groups\":") &&
            reduce_write(&request->reduce, s->n_channels, request->n_rhs, request->batch, figures, b) &&
            answer_certificates(b, request->n_rhs, request->batch, notes) && answer_tail(b, notes)) ||
           problem_set(why, PROBLEM_NO_MEMORY,
                       "not enough memory for the answer; ask for fewer vectors or groups");
}

/* *weights [n_rhs][C][s]: the whole emission of each vector as weights of emitters; NULL if not needed. */
static bool weights_of(const call *in, radiosity_request *request, float **weights, problem *why) {
    const scene *s = in->scene;
    const size_t row = s->n_channels * s->n_emitters;
    const codec_scene about = call_codec_scene(in);
    lam_error error;
    *weights = NULL;
    if (s->n_emitters == 0 || (request->n_spots == 0 && request->n_dense == 0 && request->sky.values == NULL))
        return true;
    if (!radiosity_request_expand(request, &about, why)) return false;
    *weights = call_allocate(in, bytes_times(request->n_rhs, row * sizeof **weights), "weights", why);
    if (*weights == NULL) return false;
    const lam_status status = lam_operator_weights(s->op, request->n_rhs, request->E, about.n_tiles,
                                                   request->sky.values, *weights, &error);
    if (status != LAM_OK)
        return problem_set(why, status == LAM_ERR_MEMORY ? PROBLEM_NO_MEMORY : PROBLEM_NOT_IN_STORE, "%s",
                           error.message);
    for (size_t k = 0; k < request->emitters.n * row; k++) (*weights)[k] += request->emitters.values[k];
    return true;
}

/* Computes and writes the figures from rows, one for each name. */
static bool evaluate(const call *in, radiosity_request *request, adjoint_row *const *rows,
                     answer_notes *notes, buffer *b, problem *why) {
    const scene *s = in->scene;
    const reduce_request *r = &request->reduce;
    double *figures = reduce_figures(r, request->n_rhs, s->n_channels);
    double *means = memory_allocate(request->n_rhs, s->n_channels * sizeof *means, "means", NULL);
    float *weights = NULL;
    mean_errors errors = {.names = NULL};
    bool good = figures != NULL && means != NULL && scene_mean_errors_begin(s, request, notes, &errors);
    if (!good)
        problem_set(why, PROBLEM_NO_MEMORY,
                    "not enough memory for the answer; ask for fewer vectors or groups");
    if (good && !adjoint_row_suffices(s, rows[0], request)) good = weights_of(in, request, &weights, why);
    for (size_t k = 0; good && k < r->n_names; k++) {
        adjoint_row_evaluate(s, rows[k], request, weights, means);
        if (rows[k]->area > 0) good = check_means(s, request, k, means, why);
        if (!scene_mean_errors_add(s, request, k, means, &errors, notes))
            good = problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the error of the answer");
        reduce_means(r, k, s->n_channels, request->n_rhs, rows[k]->area, means, figures);
    }
    const double solved = clock_ms();
    notes->solve_ms += solved;
    good = good && figures_write(s, request, figures, notes, b, why);
    mean_errors_free(&errors);
    free(figures);
    free(means);
    free(weights);
    return good;
}

bool figures_linear(call *in, radiosity_request *request, answer_notes *notes, buffer *b, problem *why) {
    adjoint_row *rows[ADJOINT_ROWS_OF_REQUEST];
    notes->solve_ms = -clock_ms();
    if (!request_memory_take(in->memory, figures_bytes(request, in->scene->n_channels), why)) return false;
    if (!adjoint_rows_find(in->scene, request, rows)) {
        /* Rows that the scene has no room to keep are this request's alone. */
        if (!request_memory_take(in->memory, adjoint_rows_bytes(in->scene, request), why) ||
            !adjoint_rows_get(in->scene, request, in->workspace, rows, why))
            return false;
    }
    const bool good = evaluate(in, request, rows, notes, b, why);
    adjoint_rows_release(in->scene, request->reduce.n_names, rows);
    return good;
}

/* True if the answer has few enough numbers; each name also has an error of two. */
static bool is_short(const scene *s, const radiosity_request *request) {
    const size_t of_name = request->n_rhs * s->n_channels * request->reduce.n_with + 2;
    return of_name <= QUICK_NUMBERS / request->reduce.n_names;
}

bool quick_radiosity(call *in, answer *out) {
    static const char word[] = "\"reduce\"";
    const scene *s = in->scene;
    if (in->body_type != MEDIA_JSON || in->accept.type != MEDIA_JSON || in->length > QUICK_BODY ||
        memmem(in->body, in->length, word, sizeof word - 1) == NULL)
        return false;
    codec_scene about = call_codec_scene(in);
    about.only_linear = true;
    about.max_bytes = QUICK_BYTES;
    about.take = NULL; /* it is taken at once */
    answer_notes notes = call_notes(in);
    radiosity_request request = {0};
    problem why = {0};
    buffer b = {0};
    adjoint_row *rows[ADJOINT_ROWS_OF_REQUEST];
    const size_t held = in->memory->held;
    const double start = clock_ms();
    bool good = request_memory_take(in->memory, QUICK_BYTES, &why) &&
                codec_read_json(&about, in->body, in->length, &request, &why) &&
                adjoint_row_work(s, &request) <= QUICK_WORK / request.reduce.n_names &&
                is_short(s, &request) && adjoint_rows_find(s, &request, rows);
    if (good && !adjoint_row_suffices(s, rows[0], &request)) {
        adjoint_rows_release(s, request.reduce.n_names, rows);
        good = false;
    }
    if (good) {
        const double parsed = clock_ms();
        notes.parse_ms = parsed - start;
        notes.solve_ms = -parsed;
        notes.quantity = request.quantity;
        scene_note_error(s, &request, &notes);
        in->n_rhs = request.n_rhs;
        good = evaluate(in, &request, rows, &notes, &b, &why);
        adjoint_rows_release(s, request.reduce.n_names, rows);
        if (good) {
            answer_json(out, &b, true);
            answer_set_times(out, &notes);
        }
    }
    if (in->memory->held > held) request_memory_give_back(in->memory, in->memory->held - held);
    buffer_free(&b);
    radiosity_request_free(&request);
    return good;
}
