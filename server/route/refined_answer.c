#include "server/route/refined_answer.h"

#include "server/route/radiosity_figures.h"
#include "server/route/sun_answer.h"
#include "server/scene/direct_light.h"
#include "server/scene/sensor_answer.h"
#include "solver/base/clock.h"
#include "solver/codec/group_figures.h"
#include "solver/operator/emitters.h"
#include "solver/operator/refine/refine_watch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The longest text of a double, with a comma. */
#define DOUBLE_TEXT ((size_t)25)

/* Vectors of a row that lam_refine takes, at most. */
#define REFINING_VECTORS 8

/* Arrays of a pass; NULL if not needed. */
typedef struct pass_memory {
    double *E, *H0, *out; /* [BATCH_PASS][C][n] */
    double *weights;      /* [BATCH_PASS][C][m] of tiles, or [k] of luminaires: direct_light_work */
    sun_answer sun;       /* of all vectors */
    double *some;         /* [BATCH_PASS][C][selected] */
    double *means;        /* [C][n_values], of faces, of one vector */
    double *gathered;     /* [C][sensor_values_work], work of sensors, whose values are in some */
    float *start; /* [BATCH_PASS][C][n], of a store of emitters: its own answer, the start of the iteration */
    float *W;     /* [BATCH_PASS][C][s], weights of emitters */
    void *work;
    size_t work_bytes;
} pass_memory;

struct refined_solve {
    answer_shape shape;
    media_accept as;
    double *certificates; /* [n_rhs] */
    size_t *iterations;   /* [n_rhs] */
    kept_figures figures; /* of reduce, in place of the values */
    bool made;            /* p is allocated */
    pass_memory p;
};

static void pass_memory_free(pass_memory *p) {
    sun_answer_free(&p->sun);
    free(p->E);
    free(p->H0);
    free(p->out);
    free(p->weights);
    free(p->some);
    free(p->means);
    free(p->gathered);
    free(p->start);
    free(p->W);
    free(p->work);
}

static size_t vectors_of_pass(const radiosity_request *request) {
    return request->n_rhs < BATCH_PASS ? request->n_rhs : BATCH_PASS;
}

/* Elements that are selected, or sensors; 0: all elements. */
static size_t width_of_some(const scene *s, const radiosity_request *request) {
    return request->at_sensors ? sensor_values(s, request) : request->select ? request->n_selected : 0;
}

/* Bytes of the arrays of a pass, and of those that refining takes beside them. */
static size_t pass_memory_bytes(const scene *s, const radiosity_request *request, size_t rows) {
    const bool few = s->n_emitters > 0, lit = request_has_direct(request) || request->n_suns > 0;
    const size_t doubles = (size_t)(REFINING_VECTORS + 2 + (few || lit)) * s->n +
                           direct_light_work(s, request) + width_of_some(s, request);
    const size_t means = request->at_faces ? radiosity_request_values(request, s->n, &s->faces) : 0;
    const size_t gathered = request->at_sensors ? sensor_values_work(s) : 0;
    const size_t floats = few ? s->n + s->n_emitters : 0;
    return bytes_plus(bytes_times(rows, doubles * sizeof(double) + floats * sizeof(float)),
                      bytes_plus(bytes_times(s->n_channels, (means + gathered) * sizeof(double)),
                                 few ? lam_operator_work_bytes(s->op, rows / s->n_channels) : 0));
}

static bool pass_memory_allocate(const scene *s, const radiosity_request *request, pass_memory *p,
                                 problem *why) {
    const size_t vectors = vectors_of_pass(request), rows = vectors * s->n_channels;
    const size_t row = s->n * sizeof(double);
    const bool few = s->n_emitters > 0;
    p->E = memory_allocate(rows, row, "E", NULL);
    p->out = memory_allocate(rows, row, "B", NULL);
    bool good = p->E != NULL && p->out != NULL;
    if (few || request_has_direct(request) || request->n_suns > 0) {
        p->H0 = memory_allocate(rows, row, "H0", NULL);
        good = good && p->H0 != NULL;
    }
    if (request_has_direct(request)) {
        p->weights = memory_allocate(rows, direct_light_work(s, request) * sizeof *p->weights, "L", NULL);
        good = good && p->weights != NULL;
    }
    if (request->select || request->at_sensors) {
        p->some = memory_allocate(rows, width_of_some(s, request) * sizeof *p->some, "B", NULL);
        good = good && p->some != NULL;
    }
    if (request->at_sensors) {
        p->gathered = memory_allocate(s->n_channels, sensor_values_work(s) * sizeof *p->gathered, "B", NULL);
        good = good && p->gathered != NULL;
    }
    if (request->at_faces) {
        const size_t n_values = radiosity_request_values(request, s->n, &s->faces);
        p->means = memory_allocate(s->n_channels, n_values * sizeof *p->means, "B", NULL);
        good = good && p->means != NULL;
    }
    if (few) {
        p->work_bytes = lam_operator_work_bytes(s->op, vectors);
        p->start = memory_allocate(rows, s->n * sizeof *p->start, "B", NULL);
        p->W = memory_allocate(rows, s->n_emitters * sizeof *p->W, "weights", NULL);
        p->work = memory_allocate(p->work_bytes, 1, "work", NULL);
        good = good && p->start != NULL && p->W != NULL && p->work != NULL;
    }
    return good || problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to refine %zu vectors", vectors);
}

/* A store that cannot be read any more is no fault of the daemon's, and its next version may be right. */
static bool refuse(const scene *s, lam_status status, const lam_error *error, problem *why) {
    const problem_kind as = status == LAM_ERR_MEMORY || status == LAM_ERR_IO          ? PROBLEM_NO_MEMORY
                            : status == LAM_ERR_NUMERIC || status == LAM_ERR_ARGUMENT ? PROBLEM_NOT_REFINED
                            : status == LAM_ERR_INTERNAL                              ? PROBLEM_INTERNAL
                                                                                      : PROBLEM_UNAVAILABLE;
    return problem_set(why, as, "%.100s: %s", s->name, scene_message(s, error->message));
}

/* E and H0 of the weights of emitters, and the store's own answer to these as the start of the iteration. */
static bool light_emitters(const scene *s, const radiosity_request *request, size_t first, size_t count,
                           pass_memory *p, problem *why) {
    const size_t C = s->n_channels, weights = C * s->n_emitters;
    const size_t n_tiles = scene_tiles(s);
    const float *L = request->sky.values;
    lam_status status = LAM_OK;
    lam_error error;
    if (L != NULL) L += first * C * n_tiles;
    TRY(lam_operator_weights(s->op, count, request->E + first * C * s->n, n_tiles, L, p->W, &error));
    for (size_t k = 0; request->emitters.values != NULL && k < count * weights; k++)
        p->W[k] += request->emitters.values[first * weights + k];
    if (request->luminaires.values != NULL)
        operator_emitters_dim(s->op, count, request->luminaires.values + first * C * scene_luminaires(s),
                              p->W);
    TRY(operator_emitters_light_double(s->op, count, p->W, p->E, p->H0, &error));
    TRY(lam_operator_apply_emitters(s->op, count, LAM_INDIRECT, p->W, s->n, NULL, p->start, p->work,
                                    p->work_bytes, &error));
done:
    return status == LAM_OK || refuse(s, status, &error, why);
}

/* False where the request is no longer wanted. */
static bool light_any(call *in, const radiosity_request *request, size_t first, size_t count,
                      pass_memory *p) {
    const scene *s = in->scene;
    const size_t C = s->n_channels, E_begin = first * C * s->n;
    for (size_t k = 0; k < count * C * s->n; k++) p->E[k] = (double)request->E[E_begin + k];
    if (p->H0 == NULL) return true;
    direct_light_find_double(s, request, first, count, p->weights, p->H0);
    if (p->sun.shares == NULL) return true;
    if (!sun_answer_find(in, request, first, count, &p->sun)) return false;
    sun_answer_add_double(s, request, &p->sun, first, count, p->H0);
    return true;
}

static bool go_on(void *context) {
    call *in = context;
    return in->is_wanted(in);
}

/* Refines vectors first ... first + count; returns them, or their selected elements, or NULL with *why. */
static double *refine(call *in, const lam_refiner *refiner, const radiosity_request *request, size_t first,
                      size_t count, pass_memory *p, double *certificates, size_t *iterations, problem *why) {
    const scene *s = in->scene;
    const refine_watch watch = {go_on, in};
    lam_error error;
    if (s->n_emitters == 0 ? !light_any(in, request, first, count, p)
                           : !light_emitters(s, request, first, count, p, why))
        return NULL;
    const lam_status status =
        refine_watched(refiner, count, request->quantity, p->E, p->H0, p->start, request->tolerance, p->out,
                       certificates, iterations, &watch, &error);
    if (status != LAM_OK) {
        refuse(s, status, &error, why);
        return NULL;
    }
    if (request->at_sensors) {
        sensor_values_find_double(s, request, first, count, p->out, p->sun.at_sensors, p->gathered, p->some,
                                  certificates);
        return p->some;
    }
    if (!request->select) return p->out;
    for (size_t row = 0; row < count * s->n_channels; row++)
        for (size_t k = 0; k < request->n_selected; k++)
            p->some[row * request->n_selected + k] = p->out[row * s->n + request->selected[k]];
    return p->some;
}

/* Bytes of certificates, and of the answer, at most. */
static size_t bytes_needed(const call *in, const radiosity_request *request, const answer_shape *shape,
                           const media_accept *as) {
    const size_t certificates =
        bytes_times(request->n_rhs, sizeof(double) + sizeof(size_t) + 2 * DOUBLE_TEXT);
    if (request->reduce.on) return bytes_plus(certificates, figures_bytes(in->scene, request));
    /* The text of a double is longer than that of the float that answer_bytes_most counts. */
    return bytes_plus(certificates,
                      bytes_times(as->type == MEDIA_JSON ? 2 : 1, answer_bytes_most(shape, as)));
}

bool refined_begin(call *in, const radiosity_request *request, answer_notes *notes, refined_solve **out,
                   problem *why) {
    const scene *s = in->scene;
    refined_solve *r = calloc(1, sizeof *r);
    if (r == NULL) return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the request");
    r->as = in->accept;
    if (!r->as.npy_given) r->as.npy = NPY_F8;
    r->shape = (answer_shape){.n = s->n,
                              .n_channels = radiosity_request_channels(request, s->n_channels),
                              .n_rhs = request->n_rhs,
                              .batch = request->batch,
                              .n_values = radiosity_request_values(request, s->n, &s->faces),
                              .gaps = request->at_faces || request->at_sensors};
    *out = r;
    /* The memory of the pass is included, as what waits for memory must not have begun. */
    const size_t of_pass = pass_memory_bytes(s, request, vectors_of_pass(request) * s->n_channels);
    if (!request_memory_take(in->memory, bytes_plus(of_pass, bytes_needed(in, request, &r->shape, &r->as)),
                             why) ||
        !sun_answer_begin(in, request, &r->p.sun, why))
        return false;
    r->certificates = memory_allocate(request->n_rhs, sizeof *r->certificates, "certificates", NULL);
    r->iterations = memory_allocate(request->n_rhs, sizeof *r->iterations, "certificates", NULL);
    notes->certificates = r->certificates;
    notes->iterations = r->iterations;
    return (r->certificates != NULL && r->iterations != NULL &&
            (!request->reduce.on || figures_allocate(s, request, &r->figures))) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for %zu certificates", request->n_rhs);
}

/* The refiner of a scene; its first use reads the form factors. */
static bool find_refiner(const scene *s, const lam_refiner **refiner, problem *why) {
    lam_error error;
    const lam_status status = refined_get(s->refined, refiner, &error);
    if (status != LAM_OK) return refuse(s, status, &error, why);
    if (*refiner != NULL) return true;
    problem_set(why, PROBLEM_NOT_IN_STORE,
                "scene %.80s keeps no form factors, which a tolerance needs; precompute it with "
                "--keep-form-factors",
                s->name);
    snprintf(why->pointer, sizeof why->pointer, "/tolerance");
    return false;
}

/* The means of faces of the values of a vector. */
static const double *means_of(const scene *s, const radiosity_request *request, const double *values,
                              pass_memory *p, double *rounding) {
    const face_choice chosen = radiosity_request_faces(request, &s->faces);
    face_means_doubles(&s->faces, &chosen, radiosity_request_channels(request, s->n_channels), values,
                       p->means, rounding);
    return p->means;
}

bool refined_pass(call *in, const radiosity_request *request, size_t first, size_t count, refined_solve *r,
                  answer_notes *notes, buffer *b, problem *why) {
    const scene *s = in->scene;
    const lam_refiner *refiner = NULL;
    const double begin = clock_ms();
    const size_t width = request->select || request->at_sensors ? width_of_some(s, request) : s->n;
    bool good = find_refiner(s, &refiner, why);
    if (good && !r->made) {
        r->made = true;
        good = pass_memory_allocate(s, request, &r->p, why) &&
               (request->reduce.on || answer_begin(b, &r->shape, &r->as, notes, why));
    }
    double *x = good ? refine(in, refiner, request, first, count, &r->p, r->certificates + first,
                              r->iterations + first, why)
                     : NULL;
    const double solved = clock_ms();
    notes->solve_ms += solved - begin;
    good = x != NULL;
    if (good && request->told.luminance) answer_luminance_double(count, width, x, r->certificates + first);
    if (good && request->reduce.on)
        good = figures_reduce(s, request, r->shape.n_channels, first, count, (reduce_values){.doubles = x},
                              &r->figures) ||
               problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to reduce %zu vectors", count);
    for (size_t v = 0; good && !request->reduce.on && v < count; v++) {
        /* One by one: each vector has its own rounding errors, which count in its certificate. */
        double rounding = 0, of_means = 0;
        const double *values = x + v * r->shape.n_channels * width;
        if (request->at_faces) values = means_of(s, request, values, &r->p, &of_means);
        good = answer_add_doubles(b, &r->shape, &r->as, first + v, 1, values, &rounding, why);
        r->certificates[first + v] += rounding + of_means;
    }
    notes->encode_ms += clock_ms() - solved;
    if (good) metrics_pass(in->service->metrics, count);
    return good;
}

bool refined_end(const refined_solve *r, const answer_notes *notes, buffer *b, problem *why) {
    return answer_end(b, &r->shape, &r->as, notes, why);
}

kept_figures *refined_figures(refined_solve *r) {
    return &r->figures;
}

void refined_free(refined_solve *r, answer_notes *notes) {
    notes->certificates = NULL;
    notes->iterations = NULL;
    if (r == NULL) return;
    free(r->certificates);
    free(r->iterations);
    figures_free(&r->figures);
    pass_memory_free(&r->p);
    free(r);
}

void refined_set_headers(const answer_notes *notes, size_t n_rhs, answer *out) {
    out->refined = true;
    for (size_t v = 0; v < n_rhs; v++) {
        out->certificate = fmax(out->certificate, notes->certificates[v]);
        if (notes->iterations[v] > out->iterations) out->iterations = notes->iterations[v];
    }
}
