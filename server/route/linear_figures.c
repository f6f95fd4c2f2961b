#include "server/route/linear_figures.h"

#include "server/route/light_weights.h"
#include "server/route/radiosity_figures.h"
#include "server/route/routes.h"
#include "server/route/sensor_figures.h"
#include "server/scene/adjoint_rows.h"
#include "server/scene/direct_light.h"
#include "server/scene/sensor_answer.h"
#include "solver/base/clock.h"
#include "solver/codec/group_figures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Limits of a request that the I/O thread answers itself, well below a millisecond: bytes of the body,
 * products, bytes of emission, numbers of the answer, each of which takes up to 2.5 us to write. */
#define QUICK_BODY ((size_t)32 << 10)
#define QUICK_WORK ((size_t)100000)
#define QUICK_BYTES ((size_t)1 << 20)
#define QUICK_NUMBERS ((size_t)400)

struct linear_figures {
    kept_figures figures;
    double *means;  /* [n_rhs][C] of a name, work */
    float *weights; /* [n_rhs][C][s] of a store of emitters that needs them; else NULL */
    mean_errors errors;
    size_t next; /* name to evaluate */
    figures_text text;
};

/* The means [n_rhs][C] of name k over elements that have an area. */
static bool check_means(const scene *s, const radiosity_request *request, size_t k, const double *means,
                        problem *why) {
    for (size_t v = 0; v < request->n_rhs * s->n_channels; v++)
        if (!isfinite(means[v])) return figures_refuse(&request->reduce, k, 0, why);
    return true;
}

/* *weights [n_rhs][C][s]: the whole emission of each vector as weights of emitters; NULL if not needed. */
static bool weights_of(const call *in, radiosity_request *request, float **weights, problem *why) {
    const scene *s = in->scene;
    const codec_scene about = call_codec_scene(in);
    *weights = NULL;
    if (s->n_emitters == 0 || (request->n_spots == 0 && request->n_dense == 0 && request->sky.values == NULL))
        return true;
    if (!radiosity_request_expand(request, &about, why)) return false;
    *weights = light_weights_find(in, request, why);
    return *weights != NULL;
}

/* Allocates; freed by linear_clear, also where it fails. */
static bool linear_allocate(const call *in, radiosity_request *request, linear_figures *f,
                            answer_notes *notes, problem *why) {
    const scene *s = in->scene;
    f->means = memory_allocate(request->n_rhs, s->n_channels * sizeof *f->means, "means", NULL);
    return (figures_allocate(s, request, &f->figures) && f->means != NULL &&
            scene_mean_errors_begin(s, request, notes, &f->errors)) ||
           problem_set(why, PROBLEM_NO_MEMORY,
                       "not enough memory for the answer; ask for fewer vectors or groups");
}

static void linear_clear(linear_figures *f) {
    mean_errors_free(&f->errors);
    figures_free(&f->figures);
    free(f->means);
    free(f->weights);
}

/* The limiter keeps means but for those below zero. */
static void limit_means(const scene *s, const radiosity_request *request, double *means) {
    const size_t C = s->n_channels;
    const codec_scene about = {.n = s->n,
                               .n_channels = C,
                               .n_tiles = scene_tiles(s),
                               .n_emitters = s->n_emitters,
                               .n_luminaires = scene_luminaires(s)};
    for (size_t k = 0; !request->linear_map && k < request->n_rhs * C; k++)
        if (means[k] < 0 && !radiosity_request_has_signs(request, &about, k / C, k % C)) means[k] = 0;
}

/* Computes the figures of names first ... first + count from their rows. */
static bool evaluate(const scene *s, const radiosity_request *request, size_t first, size_t count,
                     adjoint_row *const *rows, linear_figures *f, answer_notes *notes, problem *why) {
    const reduce_request *r = &request->reduce;
    for (size_t k = 0; k < count; k++) {
        const adjoint_row *row = rows[k];
        adjoint_row_means(s, row, request, f->weights, f->means);
        if (row->area > 0 && !check_means(s, request, first + k, f->means, why)) return false;
        limit_means(s, request, f->means);
        if (!scene_mean_errors_add(s, request, first + k, row->buried, f->means, &f->errors, notes))
            return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the error of the answer");
        if (request->told.luminance) answer_luminance_double(request->n_rhs, 1, f->means, NULL);
        reduce_means(r, first + k, radiosity_request_channels(request, s->n_channels), request->n_rhs,
                     row->area, f->means, f->figures.numbers);
    }
    return true;
}

/* A store of emitters tells by one row of a request, whichever, that it needs whole vectors. */
static bool find_weights(call *in, radiosity_request *request, linear_figures *f, problem *why) {
    adjoint_row *row;
    if (in->scene->n_emitters == 0) return true;
    if (!adjoint_rows_get(in->scene, request, 0, 1, in->workspace, &row, why)) return false;
    const bool suffices = adjoint_row_answers(in->scene, row, request);
    adjoint_rows_release(in->scene, 1, &row);
    return suffices || weights_of(in, request, &f->weights, why);
}

bool linear_figures_begin(call *in, radiosity_request *request, answer_notes *notes, linear_figures **out,
                          problem *why) {
    adjoint_row *rows[ADJOINT_ROWS_OF_REQUEST];
    if (!request_memory_take(in->memory, figures_bytes(in->scene, request), why)) return false;
    const bool known = adjoint_rows_find(in->scene, request, rows);
    if (known) adjoint_rows_release(in->scene, request->reduce.n_names, rows);
    /* Rows that the scene has no room to keep are this request's alone. */
    if (!known && !request_memory_take(in->memory, adjoint_rows_bytes(in->scene, request), why)) return false;
    linear_figures *f = memory_allocate(1, sizeof *f, "figures", NULL);
    if (f == NULL) return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the figures");
    if (!linear_allocate(in, request, f, notes, why) || !find_weights(in, request, f, why)) {
        linear_figures_free(f);
        return false;
    }
    if (known) in->cost = 1e-3 * FIGURES_STEP_MS;
    *out = f;
    return true;
}

bool linear_figures_step(call *in, radiosity_request *request, linear_figures *f, batch_workspace *workspace,
                         answer_notes *notes, buffer *b, bool *done, problem *why) {
    const scene *s = in->scene;
    const size_t n_names = request->reduce.n_names;
    const double start = clock_ms(), until = start + FIGURES_STEP_MS;
    bool good = true;
    *done = false;
    /* Rows are held within a step alone: the cache may drop them between two, and counts them while it has
     * them. */
    while (good && f->next < n_names && clock_ms() < until) {
        adjoint_row *rows[BATCH_PASS];
        const size_t left = n_names - f->next, count = left < BATCH_PASS ? left : BATCH_PASS;
        if (!adjoint_rows_get(s, request, f->next, count, workspace, rows, why)) return false;
        good = evaluate(s, request, f->next, count, rows, f, notes, why);
        adjoint_rows_release(s, count, rows);
        f->next += count;
    }
    notes->solve_ms += clock_ms() - start;
    if (!good || f->next < n_names) return good;
    return figures_write(s, request, &f->figures, until, &f->text, notes, b, done, why);
}

void linear_figures_free(linear_figures *f) {
    if (f == NULL) return;
    linear_clear(f);
    free(f);
}

/* True if the answer has few enough numbers; each name also has an error of two. */
static bool is_short(const scene *s, const radiosity_request *request) {
    const size_t of_name = request->n_rhs * s->n_channels * request->reduce.n_with + 2;
    return of_name <= QUICK_NUMBERS / request->reduce.n_names;
}

/* Answers a reduction of groups by rows that are there. */
static bool answer_groups(call *in, radiosity_request *request, answer_notes *notes, buffer *b) {
    const scene *s = in->scene;
    adjoint_row *rows[ADJOINT_ROWS_OF_REQUEST];
    linear_figures f = {.means = NULL};
    problem why = {0};
    bool done = false;
    if (adjoint_row_work(s, request) > QUICK_WORK / request->reduce.n_names ||
        (request->luminaires.values != NULL && !scene_has_luminaire_sums(s)) || !is_short(s, request) ||
        !adjoint_rows_find(s, request, rows))
        return false;
    bool good = adjoint_row_answers(s, rows[0], request);
    if (good) {
        const double start = clock_ms();
        scene_note_error(s, request, notes);
        good = linear_allocate(in, request, &f, notes, &why) &&
               evaluate(s, request, 0, request->reduce.n_names, rows, &f, notes, &why);
        notes->solve_ms = clock_ms() - start;
        good = good && figures_write(s, request, &f.figures, INFINITY, &f.text, notes, b, &done, &why);
        linear_clear(&f);
    }
    adjoint_rows_release(s, request->reduce.n_names, rows);
    return good;
}

bool quick_radiosity(call *in, answer *out) {
    static const char word[] = "\"reduce\"";
    if (in->body_type != MEDIA_JSON || in->accept.type != MEDIA_JSON || in->n_query > 0 ||
        in->length > QUICK_BODY || memmem(in->body, in->length, word, sizeof word - 1) == NULL)
        return false;
    codec_scene about = call_codec_scene(in);
    about.only_linear = true;
    about.max_bytes = QUICK_BYTES;
    about.take = NULL; /* it is taken at once */
    answer_notes notes = call_notes(in);
    radiosity_request request = {0};
    problem why = {0};
    buffer b = {0};
    char converted[LIGHT_CONVERSION_TEXT];
    const size_t held = in->memory->held;
    const double start = clock_ms();
    bool good = request_memory_take(in->memory, QUICK_BYTES, &why) &&
                codec_read_json(&about, in->body, in->length, &request, &why);
    if (good) {
        notes.parse_ms = clock_ms() - start;
        notes.quantity = radiosity_request_told(&request);
        notes.at = request.at_sensors ? sensor_places_word(&request) : NULL;
        answer_note_unit(&request.told, notes.quantity, converted, &notes);
        in->n_rhs = request.n_rhs;
        good = sensor_request_check(in->scene, &request, notes.unit, &why) &&
               (request.at_sensors ? sensor_figures_quick(in, &request, &notes, &b)
                                   : answer_groups(in, &request, &notes, &b));
    }
    if (good) {
        answer_json(out, &b, true);
        answer_set_times(out, &notes);
    }
    if (in->memory->held > held) request_memory_give_back(in->memory, in->memory->held - held);
    buffer_free(&b);
    radiosity_request_free(&request);
    return good;
}
