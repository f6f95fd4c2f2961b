/* POST /v1/scenes/NAME/radiosity: emission in, radiosity out. begin reads the body, pass computes vectors
 * together with those of other clients, or goes on with figures, end writes the answer; each on any thread.
 */
#include "server/route/array_members.h"
#include "server/route/corner_answer.h"
#include "server/route/light_weights.h"
#include "server/route/limited_answer.h"
#include "server/route/linear_figures.h"
#include "server/route/radiosity_figures.h"
#include "server/route/refined_answer.h"
#include "server/route/routes.h"
#include "server/route/sensor_figures.h"
#include "server/route/sun_answer.h"
#include "server/scene/direct_light.h"
#include "server/scene/sensor_answer.h"
#include "solver/base/clock.h"
#include "solver/codec/answer.h"
#include "solver/codec/request.h"
#include "solver/operator/operator.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The state of a solve from begin to end. */
typedef struct radiosity_solve {
    radiosity_request request;
    answer_notes notes;
    answer_shape shape;
    size_t n_computed; /* elements that passes compute: all, those selected, or those of faces */
    buffer answer;
    float *out;    /* [n_rhs][C][n_computed]: inside `answer` if its encoding allows, else own */
    float *own;    /* or NULL */
    float *places; /* [n_rhs][C][n_values] of faces, corners or sensors, a part of `answer` or allocated; of a
                      reduction of sensors that of a pass; else NULL */
    bool placed;   /* they are inside `answer` */
    float *gathered;       /* [C][receivers], work; else NULL */
    answer_stream *stream; /* of these, until the answer has it */
    bool streams;          /* the values are encoded while the answer is sent */
    float *H0; /* [n_rhs][C][n], direct irradiance of sky, luminaires and sun; NULL if no vector has any */
    sun_answer sun;
    corner_answer corners;
    kept_figures figures; /* of reduce, in place of values */
    float *W;             /* [n_rhs][C][s], weights of a store of emitters; else NULL */
    float *one;           /* [C][n_computed], work: a vector that is reduced by its luminance; else NULL */
    char converted[LIGHT_CONVERSION_TEXT]; /* of notes */
    refined_solve *refined;                /* for a request with a tolerance; else NULL */
    limited_solve limit;                   /* of light below zero */
    linear_figures *linear;                /* for a linear reduction, which computes no vectors; else NULL */
    sensor_figures *columns;               /* likewise of sensors */
    figures_text text;                     /* of figures */
    bool judged;                           /* the error of figures was found */
    name_error *errors;                    /* of names that are reduced, or NULL */
    problem why;                           /* of a pass that failed */
    bool failed;
} radiosity_solve;

static void solve_free(const scene *of, radiosity_solve *s) {
    radiosity_request_free(&s->request);
    buffer_free(&s->answer);
    answer_stream_free(s->stream);
    refined_free(s->refined, &s->notes);
    linear_figures_free(s->linear);
    sensor_figures_free(of, s->columns);
    limited_free(&s->limit);
    sun_answer_free(&s->sun);
    corner_answer_free(&s->corners);
    free(s->own);
    if (!s->placed) free(s->places);
    free(s->gathered);
    figures_free(&s->figures);
    free(s->H0);
    free(s->W);
    free(s->one);
    free(s->errors);
    free(s);
}

/* [n_rhs][C][width] floats of the scene's channels, not cleared; NULL with *why. */
static float *allocate_rows(const call *in, const radiosity_solve *s, size_t width, const char *what,
                            problem *why) {
    return call_allocate(
        in,
        bytes_times(bytes_times(s->shape.n_rhs, in->scene->n_channels), bytes_times(width, sizeof(float))),
        what, why);
}

/* Computes the direct irradiance of skies and luminaires, to which passes add that of suns, or, for a store
 * of emitters, the weights of these. */
static bool find_light(const call *in, radiosity_solve *solve, problem *why) {
    const scene *s = in->scene;
    const radiosity_request *request = &solve->request;
    if (s->n_emitters == 0) {
        if (!request_has_direct(request) && request->n_suns == 0) return true;
        solve->H0 = allocate_rows(in, solve, s->n, "direct light", why);
        if (solve->H0 == NULL) return false;
        direct_light_find(s, request, 0, request->n_rhs, solve->H0);
        return sun_answer_begin(in, request, &solve->sun, why);
    }
    solve->W = light_weights_find(in, request, why);
    return solve->W != NULL;
}

/* Room to gather at sensors, for a reduction that of a pass. */
static bool find_gathered(const call *in, radiosity_solve *s, problem *why) {
    const scene *of = in->scene;
    const radiosity_request *request = &s->request;
    if (!request->at_sensors) return true;
    const size_t work = bytes_times(of->n_channels * sizeof *s->gathered, scene_sensors(of)),
                 pass = request->n_rhs < BATCH_PASS ? request->n_rhs : BATCH_PASS;
    s->gathered = call_allocate(in, work, "sensors", why);
    if (s->gathered == NULL || !request->reduce.on) return s->gathered != NULL;
    s->places = call_allocate(in, bytes_times(pass, work), "sensors to reduce", why);
    return s->places != NULL;
}

/* Allocates the values of the answer, if possible inside the body that is sent. With reduce the values are
 * scratch for the figures. */
static bool find_room(call *in, radiosity_solve *s, problem *why) {
    const reduce_request *reduce = &s->request.reduce;
    if (reduce->on) {
        if (!request_memory_take(in->memory, figures_bytes(in->scene, &s->request), why)) return false;
        const bool allocated = figures_allocate(in->scene, &s->request, &s->figures);
        s->out = s->own = allocate_rows(in, s, s->n_computed, "values to reduce", why);
        if (s->own == NULL || !find_gathered(in, s, why)) return false;
        const size_t width = s->request.at_sensors ? scene_sensors(in->scene) : s->n_computed;
        if (s->request.told.luminance)
            s->one = call_allocate(in, 3 * bytes_times(width, sizeof *s->one), "values to reduce", why);
        return (s->one != NULL || !s->request.told.luminance) &&
               (allocated || problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to reduce %zu vectors",
                                         s->shape.n_rhs));
    }
    const size_t whole = s->request.told.luminance ? 0 : answer_placed_bytes(&s->shape, &in->accept);
    const bool placed = whole > 0;
    const size_t most = placed ? whole : answer_bytes_most(&s->shape, &in->accept);
    s->streams = !placed && most > ANSWER_WHOLE;
    if (!s->streams && (!request_memory_take(in->memory, most, why) ||
                        !(buffer_reserve(&s->answer, most) ||
                          problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the answer"))))
        return false;
    if (!answer_begin(&s->answer, &s->shape, &in->accept, &s->notes, why)) return false;
    float *values = placed ? answer_place(&s->answer, &s->shape) : NULL;
    const bool inside = values != NULL;
    if (!inside) values = allocate_rows(in, s, s->shape.n_values, "values", why);
    if (values == NULL) return false;
    if (!s->request.at_faces && !s->request.at_sensors && !s->request.at_corners) {
        s->out = values;
        s->own = inside ? NULL : values;
        return true;
    }
    s->places = values;
    s->placed = inside;
    s->out = s->own = allocate_rows(in, s, s->n_computed,
                                    s->request.at_faces ? "the elements of faces" : "radiosities", why);
    return s->own != NULL && find_gathered(in, s, why) &&
           (in->accept.type != MEDIA_JSON || corner_answer_keep(in, &s->corners, why));
}

/* Puts the means of faces, or the values of corners or sensors, in the place of the values of elements. */
static void take_places(const call *in, radiosity_solve *s) {
    const face_index *faces = &in->scene->faces;
    const face_choice chosen = radiosity_request_faces(&s->request, faces);
    if (s->places == NULL) return;
    if (s->request.at_faces)
        face_means_floats(faces, &chosen, s->shape.n_rhs * in->scene->n_channels, s->out, s->places);
    free(s->own);
    s->own = s->placed ? NULL : s->places;
    s->places = NULL;
}

/* Takes room for the lists of a text, which are freed before it returns, and reads it. */
static bool read_body(const call *in, radiosity_request *request, problem *why) {
    const codec_scene about = call_codec_scene(in);
    const size_t lists = call_parse_bytes(in);
    bool limit = true;
    if (!array_members_read(in, &request->quantity, &limit, why)) return false;
    request->linear_map = !limit;
    if (!request_memory_take(in->memory, lists, why)) return false;
    const bool good = in->body_type == MEDIA_NPY
                          ? codec_read_npy(&about, in->body, in->length, request, why)
                          : codec_read_json(&about, in->body, in->length, request, why);
    request_memory_give_back(in->memory, lists);
    return good && (!request->select || request_memory_take(in->memory,
                                                            request->n_selected * sizeof *request->selected +
                                                                request->n_faces * sizeof *request->faces,
                                                            why));
}

/* The vectors that passes compute. Figures take one pass more, or several: each a step of their text. */
static size_t vectors_of(const radiosity_solve *s) {
    return s->linear != NULL || s->columns != NULL ? 0 : s->request.n_rhs;
}

/* Columns for a reduction of sensors; where they do not answer it, its vectors are expanded. */
static bool begin_columns(call *in, radiosity_solve *s, problem *why) {
    const codec_scene about = call_codec_scene(in);
    if (!sensor_figures_begin(in, &s->request, &s->notes, &s->columns, why)) return false;
    s->request.reduce.linear = s->columns != NULL;
    return s->columns != NULL || radiosity_request_expand(&s->request, &about, why);
}

/* Begins what the request asks for: figures by columns or by adjoint rows, refined vectors, or vectors. */
static bool begin_kind(call *in, radiosity_solve *s, problem *why) {
    radiosity_request *request = &s->request;
    if (request->reduce.linear && !request->at_sensors)
        return linear_figures_begin(in, request, &s->notes, &s->linear, why);
    if (request->reduce.linear && !begin_columns(in, s, why)) return false;
    if (s->columns != NULL) return true;
    if (request->at_sensors && !light_weights_see_sky(in, request, why)) return false;
    if (request->tolerance > 0) return refined_begin(in, request, &s->notes, &s->refined, why);
    return find_light(in, s, why) && limited_begin(in, request, &s->limit, &s->notes, why) &&
           find_room(in, s, why);
}

static bool begin(call *in, answer *out) {
    const scene *of = in->scene;
    problem why = {0};
    radiosity_solve *s = calloc(1, sizeof *s);
    if (s == NULL) {
        answer_refuse(out, PROBLEM_NO_MEMORY, "not enough memory for the request");
        return false;
    }
    const double start = clock_ms();
    bool good = read_body(in, &s->request, &why);
    const radiosity_request *request = &s->request;
    s->notes = call_notes(in);
    s->notes.quantity = radiosity_request_told(request);
    s->notes.by_luminance = request->by_luminance;
    s->notes.at = request->at_sensors   ? sensor_places_word(request)
                  : request->at_corners ? "corners"
                  : request->at_faces   ? "faces"
                                        : NULL;
    answer_note_unit(&request->told, s->notes.quantity, s->converted, &s->notes);
    good = good && sensor_request_check(of, request, s->notes.unit, &why);
    if (good && request->at_probes) s->notes.unit = probe_unit(s->notes.unit);
    good = good && corner_answer_begin(in, &s->request, &s->corners, &why);
    s->notes.parse_ms = clock_ms() - start;
    s->shape = (answer_shape){.n = of->n,
                              .n_channels = radiosity_request_channels(request, of->n_channels),
                              .n_rhs = request->n_rhs,
                              .batch = request->batch,
                              .n_values = radiosity_request_values(request, of->n, &of->faces),
                              .gaps = request->at_faces || request->at_sensors};
    s->n_computed = request->select ? request->n_selected : of->n;
    in->n_rhs = request->n_rhs;
    if (good) scene_note_error(of, request, &s->notes);
    good = good && figures_acceptable(in, request, &why);
    good = good && begin_kind(in, s, &why);
    if (!good) {
        answer_problem(out, &why);
        solve_free(in->scene, s);
        return false;
    }
    in->state = s;
    in->n_written = request->reduce.on ? 0 : request->n_rhs * s->shape.n_channels * s->shape.n_values;
    in->job.n_vectors = vectors_of(s) + request->reduce.on;
    if (s->sun.shares != NULL) in->cost = fmin((double)request->n_rhs, BATCH_PASS) * sun_answer_cost(of);
    /* Answers for all elements share passes. Answers for selected elements, figures, and answers of emitters
     * have passes of their own. Refined answers take many times as long: one common key lets one such pass
     * run at a time, and leaves the other threads to other requests. */
    in->refines = s->refined != NULL;
    const bool alone = vectors_of(s) == 0 || request->select || of->n_emitters > 0;
    in->job.key = in->refines ? (const void *)in->service->queue : alone ? (const void *)in : of->op;
    return true;
}

/* The work area of a pass and of limiting it; NULL and *why if memory is short. */
static void *get_work(const scene *s, size_t n_rhs, batch_workspace *workspace, size_t *bytes, problem *why) {
    const size_t solving = lam_operator_work_bytes(s->op, n_rhs),
                 limiting = lam_limiter_work_bytes(&s->limiter);
    *bytes = solving > limiting ? solving : limiting;
    void *work = solving > 0 ? batch_workspace_get(workspace, *bytes) : NULL;
    if (work == NULL) problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to solve %zu vectors", n_rhs);
    return work;
}

/* A pass of its own: for selected elements, or of emitters. */
static lam_status pass_alone(const scene *s, const radiosity_solve *solve, const batch_part *part, float *out,
                             void *work, size_t bytes, lam_error *error) {
    const radiosity_request *request = &solve->request;
    const size_t before = part->first * s->n_channels;
    size_t n_selected;
    const uint32_t *selected;
    float *to = limited_place(&solve->limit, request, out, &n_selected, &selected);
    if (s->n_emitters > 0)
        return lam_operator_apply_emitters(s->op, part->count, request->quantity,
                                           solve->W + before * s->n_emitters, n_selected, selected, to, work,
                                           bytes, error);
    return lam_operator_apply_selected(s->op, part->count, request->quantity, request->E + before * s->n,
                                       solve->H0 != NULL ? solve->H0 + before * s->n : NULL, n_selected,
                                       selected, to, work, bytes, error);
}

/* Finds the error of the answer's own emission, which JSON states. */
static bool judge(const call *in, radiosity_solve *s) {
    s->judged = true;
    if (s->request.at_sensors)
        return scene_note_sensor_error(in->scene, &s->request, s->H0, s->sun.shares, s->sun.at_sensors, s->W,
                                       s->out, &s->notes, &s->errors) ||
               problem_set(&s->why, PROBLEM_NO_MEMORY, "not enough memory for the error of the answer");
    return (in->scene->errors.emitters.figures.s > 0
                ? scene_note_emitters_error(in->scene, &s->request, s->W, s->out, &s->notes, &s->errors)
                : scene_note_own_error(in->scene, &s->request, s->H0, s->sun.shares, s->W, s->out, &s->notes,
                                       &s->errors)) ||
           problem_set(&s->why, PROBLEM_NO_MEMORY, "not enough memory for the error of the answer");
}

/* A step of figures whose vectors are computed, the last of `computed`. A further one is asked for as if it
 * were a vector. */
static void pass_figures(call *in, radiosity_solve *s, size_t computed, batch_workspace *workspace) {
    bool done = false;
    if (s->columns != NULL)
        s->failed = s->failed || !sensor_figures_step(in, &s->request, s->columns, workspace, &s->notes,
                                                      &s->answer, &done, &s->why);
    else if (s->linear != NULL)
        s->failed = s->failed || !linear_figures_step(in, &s->request, s->linear, workspace, &s->notes,
                                                      &s->answer, &done, &s->why);
    else if (s->refined == NULL && !s->judged)
        s->failed = s->failed || !judge(in, s);
    else
        s->failed =
            s->failed ||
            !figures_write(in->scene, &s->request,
                           s->refined != NULL ? refined_figures(s->refined) : &s->figures,
                           clock_ms() + FIGURES_STEP_MS, &s->text, &s->notes, &s->answer, &done, &s->why);
    in->job.n_vectors = computed + (!s->failed && !done);
}

static bool add_figures(const scene *of, radiosity_solve *s, const batch_part *part) {
    const float *x =
        s->request.at_sensors ? s->places : s->own + part->first * of->n_channels * s->n_computed;
    return s->figures.numbers == NULL ||
           figures_add(of, &s->request, part->first, part->count, x, s->one, &s->figures, &s->why);
}

/* Gathers the vectors of a part at sensors. */
static void gather(const scene *of, radiosity_solve *s, const batch_part *part) {
    const size_t C = of->n_channels, first = part->first;
    if (!s->request.at_sensors) return;
    float *to = s->figures.numbers != NULL ? s->places : s->places + first * C * s->shape.n_values;
    sensor_values_find(of, &s->request, first, part->count, s->out + first * C * of->n, s->sun.at_sensors,
                       s->gathered, to);
}

static void pass_refined(const batch_part *parts, size_t n_parts) {
    for (size_t p = 0; p < n_parts; p++) {
        call *in = call_of(parts[p].job);
        radiosity_solve *s = in->state;
        s->failed = s->failed || !in->is_wanted(in) ||
                    !refined_pass(in, &s->request, parts[p].first, parts[p].count, s->refined, &s->notes,
                                  &s->answer, &s->why);
        /* The rest of one that failed is not computed. */
        if (s->failed) in->job.n_vectors = parts[p].first + parts[p].count;
    }
}

/* Adds the suns of a part to the direct light. */
static void add_suns(call *in, radiosity_solve *solve, const batch_part *part) {
    const scene *s = in->scene;
    if (solve->sun.shares == NULL || solve->failed) return;
    solve->failed = !sun_answer_find(in, &solve->request, part->first, part->count, &solve->sun);
    if (!solve->failed)
        sun_answer_add(s, &solve->request, &solve->sun, part->first, part->count,
                       solve->H0 + part->first * s->n_channels * s->n);
}

/* Parts are of one scene, or all of them refined. There are several only for answers for all elements. */
static void pass_vectors(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    const call *first = call_of(parts[0].job);
    const scene *s = first->scene;
    lam_part shared[BATCH_PASS];
    lam_error error = {.message = ""};
    problem why = {0};
    size_t count = 0, bytes = 0;
    const double start = clock_ms();
    const radiosity_solve *one = first->state;
    if (one->refined != NULL) {
        pass_refined(parts, n_parts);
        return;
    }
    for (size_t p = 0; p < n_parts; p++) {
        radiosity_solve *solve = call_of(parts[p].job)->state;
        const size_t before = parts[p].first * s->n_channels * s->n;
        add_suns(call_of(parts[p].job), solve, &parts[p]);
        shared[p] = (lam_part){.n_rhs = parts[p].count,
                               .quantity = solve->request.quantity,
                               .E = solve->request.E + before,
                               .H0 = solve->H0 != NULL ? solve->H0 + before : NULL,
                               .out = solve->out + parts[p].first * s->n_channels * solve->n_computed};
        count += parts[p].count;
    }
    void *work = get_work(s, count, workspace, &bytes, &why);
    if (work != NULL) {
        const lam_status status = s->n_emitters > 0 || one->request.select
                                      ? pass_alone(s, one, parts, shared[0].out, work, bytes, &error)
                                      : lam_operator_apply_parts(s->op, n_parts, shared, work, bytes, &error);
        if (status != LAM_OK) problem_set(&why, PROBLEM_INTERNAL, "%s", error.message);
        for (size_t p = 0; p < n_parts && status == LAM_OK; p++) {
            const radiosity_solve *solve = call_of(parts[p].job)->state;
            limited_finish(s, &solve->limit, &solve->request, parts[p].first, parts[p].count, solve->H0,
                           solve->W, shared[p].out, work);
            gather(s, call_of(parts[p].job)->state, &parts[p]);
            corner_answer_find(s, &solve->corners, parts[p].first, parts[p].count, solve->out, solve->places);
        }
    }
    metrics_pass(first->service->metrics, count);
    const double took = clock_ms() - start;
    for (size_t p = 0; p < n_parts; p++) {
        radiosity_solve *solve = call_of(parts[p].job)->state;
        solve->notes.solve_ms += took;
        if (why.status == 0) {
            solve->failed = solve->failed || !add_figures(s, solve, &parts[p]);
            continue;
        }
        solve->failed = true;
        solve->why = why;
    }
}

static void pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    batch_part vectors[BATCH_PASS];
    size_t count = 0;
    for (size_t p = 0; p < n_parts; p++) {
        const size_t first = parts[p].first, all = vectors_of(call_of(parts[p].job)->state);
        if (first >= all) continue;
        vectors[count] = parts[p];
        if (all - first < parts[p].count) vectors[count].count = all - first;
        count++;
    }
    if (count > 0) pass_vectors(vectors, count, workspace);
    for (size_t p = 0; p < n_parts; p++) {
        call *in = call_of(parts[p].job);
        const size_t computed = parts[p].first + parts[p].count;
        if (computed > vectors_of(in->state)) pass_figures(in, in->state, computed, workspace);
    }
}

/* Hands the values over to a stream, all of which can be sent; false with s->why. Of `encode` the answer
 * states what was spent before its end was written. */
static bool make_stream(const call *in, radiosity_solve *s) {
    buffer tail = {0};
    const double start = clock_ms();
    const bool good = answer_check_encoding(&s->shape, &in->accept, s->own, &s->why);
    s->notes.encode_ms = clock_ms() - start;
    if (good && answer_end(&tail, &s->shape, &in->accept, &s->notes, &s->why))
        s->stream = answer_stream_create(&s->shape, &in->accept, &s->answer, s->own, &tail);
    buffer_free(&tail);
    if (s->stream != NULL)
        s->own = NULL;
    else if (s->why.status == 0)
        problem_set(&s->why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
    return s->stream != NULL;
}

/* Writes values into the answer; figures have been written. False with s->why. */
static bool write_answer(call *in, radiosity_solve *s) {
    const double start = clock_ms();
    bool good = !s->failed;
    if (s->request.reduce.on) return good;
    if (s->refined != NULL) return good && refined_end(s->refined, &s->notes, &s->answer, &s->why);
    if (good && in->accept.type == MEDIA_JSON) good = judge(in, s);
    if (good) take_places(in, s);
    if (good && s->request.told.luminance) answer_luminance(s->shape.n_rhs, s->shape.n_values, s->own);
    if (s->streams) return good && make_stream(in, s);
    good = good && (s->own == NULL
                        ? answer_placed(&s->answer, &s->shape, &in->accept, &s->why)
                        : answer_add(&s->answer, &s->shape, &in->accept, 0, s->shape.n_rhs, s->own, &s->why));
    s->notes.encode_ms = clock_ms() - start;
    return good && answer_end(&s->answer, &s->shape, &in->accept, &s->notes, &s->why);
}

static void end(call *in, answer *out) {
    radiosity_solve *s = in->state;
    if (write_answer(in, s)) {
        answer_json(out, &s->answer, true);
        answer_set_times(out, &s->notes);
        out->stream = s->stream;
        s->stream = NULL;
        if (in->accept.type == MEDIA_NPY) {
            out->type = "application/x-npy";
            answer_set_unit(out, &s->notes);
        }
        limited_set_header(&s->limit, s->request.n_rhs, out);
        if (s->refined != NULL) refined_set_headers(&s->notes, s->request.n_rhs, out);
    } else {
        answer_problem(out, &s->why);
    }
    in->state = NULL;
    solve_free(in->scene, s);
}

static void drop(call *in) {
    solve_free(in->scene, in->state);
    in->state = NULL;
}

const solve_steps post_radiosity = {.begin = begin, .pass = pass, .end = end, .drop = drop};
