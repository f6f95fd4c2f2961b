/* POST /v1/scenes/NAME/adjoint: gradients of J = g . q by emission, reflectance, sky, emitters, groups and
 * luminaires, of a cotangent g or of a batch of them: begin reads the body, each vector of a pass is a
 * cotangent, end writes. gradient.h has the formulas. */
#include "server/route/array_members.h"
#include "server/route/routes.h"
#include "server/route/sun_answer.h"
#include "server/scene/direct_light.h"
#include "server/scene/sensor_answer.h"
#include "solver/base/clock.h"
#include "solver/codec/adjoint.h"
#include "solver/codec/answer.h"
#include "solver/operator/emitters.h"
#include "solver/operator/groups/gradient.h"

#include <stdlib.h>
#include <string.h>

/* The state from begin to end. Each vector of a pass is a cotangent. */
typedef struct adjoint_solve {
    adjoint_request request;
    answer_notes notes;
    char converted[LIGHT_CONVERSION_TEXT];
    float *gradient[GRADIENT_COUNT]; /* [n_rhs][C][gradient_width] of those wanted */
    float *w, *v;                    /* [BATCH_PASS][C][n], of a pass; w of the first begins what is freed */
    float *narrow;                   /* [BATCH_PASS][C][emitters], of a store of few */
    float *direct;                   /* [BATCH_PASS][C][m] and [C][k]: what comes to sensors directly */
    float *H, *H0;                   /* [C][n], under the emission; H0 is NULL without direct light */
    bool lit;                        /* H is found */
    sun_answer sun;
    problem why;
    bool failed;
} adjoint_solve;

static void solve_free(adjoint_solve *a) {
    free(a->w);
    sun_answer_free(&a->sun);
    adjoint_request_free(&a->request);
    free(a);
}

static size_t narrow_width(const scene *s) {
    return s->n_emitters > 0 ? s->n_emitters : scene_tiles(s);
}

/* The numbers of a gradient for one channel. */
static size_t gradient_width(const scene *s, gradient_kind kind) {
    return kind == GRADIENT_EMISSION || kind == GRADIENT_REFLECTANCE ? s->n
           : kind == GRADIENT_GROUPS                                 ? s->groups.n_groups
           : kind == GRADIENT_LUMINAIRES                             ? scene_luminaires(s)
                                                                     : narrow_width(s);
}

/* Bytes of the answer, at most. */
static size_t answer_most(const call *in, const adjoint_request *request) {
    const scene *s = in->scene;
    size_t bytes = 0;
    for (int kind = 0; kind < GRADIENT_COUNT; kind++) {
        const answer_shape shape = {.n_channels = s->n_channels,
                                    .n_rhs = request->cotangent.n_rhs,
                                    .n_values = gradient_width(s, (gradient_kind)kind)};
        if (adjoint_wants(request, (gradient_kind)kind))
            bytes = bytes_plus(bytes, answer_bytes_most(&shape, &in->accept));
    }
    return bytes;
}

enum { ARRAYS = GRADIENT_COUNT + 6 };

/* Takes the memory of gradients, of passes and of the answer. */
static bool find_room(call *in, adjoint_solve *a, problem *why) {
    const scene *s = in->scene;
    const adjoint_request *r = &a->request;
    const bool by_reflectance = adjoint_wants(r, GRADIENT_REFLECTANCE),
               direct = request_has_direct(&r->light) || r->light.n_suns > 0;
    const size_t C = s->n_channels, vector = C * s->n, n_rhs = r->cotangent.n_rhs,
                 pass = n_rhs < BATCH_PASS ? n_rhs : BATCH_PASS,
                 to_sensors = r->cotangent.at_sensors ? C * (scene_tiles(s) + scene_luminaires(s)) : 0;
    float **places[ARRAYS] = {&a->w, &a->v, &a->narrow, &a->direct, &a->H, &a->H0};
    size_t rows[ARRAYS] = {pass * vector,
                           pass * vector,
                           pass * C * s->n_emitters,
                           pass * to_sensors,
                           by_reflectance ? vector : 0,
                           by_reflectance && direct ? vector : 0};
    size_t total = 0;
    for (int kind = 0; kind < GRADIENT_COUNT; kind++) {
        places[ARRAYS - GRADIENT_COUNT + kind] = &a->gradient[kind];
        rows[ARRAYS - GRADIENT_COUNT + kind] =
            adjoint_wants(r, (gradient_kind)kind)
                ? bytes_times(n_rhs, C * gradient_width(s, (gradient_kind)kind))
                : 0;
    }
    for (size_t k = 0; k < ARRAYS; k++) total = bytes_plus(total, rows[k]);
    float *at = call_allocate(in, bytes_times(total, sizeof *at), "a gradient", why);
    if (at == NULL) return false;
    for (size_t k = 0; k < ARRAYS; at += rows[k++]) *places[k] = at;
    if (!by_reflectance || !direct) a->H0 = NULL;
    return request_memory_take(in->memory, answer_most(in, r), why);
}

/* Irradiance H of the emission, its sky, its luminaires and its sun, whose direct light is H0, once. */
static bool find_irradiance(call *in, adjoint_solve *a, void *work, size_t work_bytes) {
    const scene *s = in->scene;
    const radiosity_request *light = &a->request.light;
    lam_error error;
    if (a->lit) return true;
    if (!sun_answer_find(in, light, 0, 1, &a->sun))
        return problem_set(&a->why, PROBLEM_UNAVAILABLE, "nobody waits for the answer any more");
    if (a->H0 != NULL) direct_light_find(s, light, 0, 1, a->H0);
    if (light->n_suns > 0) sun_answer_add(s, light, &a->sun, 0, 1, a->H0);
    metrics_pass(in->service->metrics, 1);
    a->lit = lam_operator_apply_lit(s->op, 1, LAM_IRRADIANCE, light->E, a->H0, a->H, work, work_bytes,
                                    &error) == LAM_OK;
    return a->lit || problem_set(&a->why, PROBLEM_INTERNAL, "%s", error.message);
}

/* Puts the cotangents of sensors into those of elements, and the gradients by light that comes to sensors
 * directly into `direct`, radiances first. Receivers without a value have no part. */
static void take_sensors(const scene *s, adjoint_solve *a, size_t first, size_t count) {
    const size_t C = s->n_channels, all = scene_sensors(s);
    radiosity_request *cotangent = &a->request.cotangent;
    float *g = cotangent->sensors.values + first * C * all;
    for (size_t row = 0; row < count * C; row++)
        for (size_t k = 0; k < all; k++)
            if (!lam_sensors_has_value(s->sensors, k)) g[row * all + k] = 0;
    /* Sensors without rows of a sky or of luminaires leave these as they are. */
    memset(a->direct, 0, count * C * (scene_tiles(s) + scene_luminaires(s)) * sizeof *a->direct);
    lam_sensors_adjoint(s->sensors, count, g, cotangent->E + first * C * s->n, a->direct,
                        a->direct + count * C * scene_tiles(s));
}

static void add(size_t count, const float *x, float *to) {
    for (size_t k = 0; k < count; k++) to[k] += x[k];
}

/* The place of the gradients of a kind of vectors from this one on; NULL: it is not wanted. */
static float *gradient_at(const scene *s, const adjoint_solve *a, gradient_kind kind, size_t vector) {
    if (!adjoint_wants(&a->request, kind)) return NULL;
    return a->gradient[kind] + vector * s->n_channels * gradient_width(s, kind);
}

/* Of a store of few emitters; luminaires are the last of these. */
static bool solve_emitters(const scene *s, adjoint_solve *a, size_t first, size_t count, void *work,
                           size_t work_bytes) {
    const size_t C = s->n_channels, k = scene_luminaires(s), row = C * s->n_emitters;
    float *const W = gradient_at(s, a, GRADIENT_EMITTERS, first), *const D = gradient_at(
                                                                      s, a, GRADIENT_LUMINAIRES, first);
    lam_error error;
    if (lam_operator_adjoint_emitters(s->op, count, a->request.quantity,
                                      a->request.cotangent.E + first * C * s->n, a->narrow, work, work_bytes,
                                      &error) != LAM_OK)
        return problem_set(&a->why, PROBLEM_INTERNAL, "%s", error.message);
    if (a->request.cotangent.at_sensors) {
        operator_emitters_adjoint_radiances(s->op, count, a->direct, a->narrow);
        if (s->luminaires != NULL)
            operator_emitters_dim(s->op, count, a->direct + count * C * scene_tiles(s), a->narrow);
    }
    if (W != NULL) memcpy(W, a->narrow, count * row * sizeof *W);
    for (size_t c = 0; D != NULL && c < count * C; c++)
        memcpy(D + c * k, a->narrow + (c + 1) * s->n_emitters - k, k * sizeof *D);
    return true;
}

/* By the light of sky and luminaires: v of each vector is the gradient by direct irradiance. */
static void solve_direct(const scene *s, adjoint_solve *a, size_t first, size_t count, const float *g) {
    const size_t C = s->n_channels, vector = C * s->n, tiles = C * scene_tiles(s);
    const bool sensors = a->request.cotangent.at_sensors;
    float *const L = gradient_at(s, a, GRADIENT_SKY, first), *const D = gradient_at(s, a, GRADIENT_LUMINAIRES,
                                                                                    first);
    if (L == NULL && D == NULL) return;
    for (size_t k = 0; k < count; k++)
        gradient_of_direct_irradiance(a->request.quantity, vector, s->reflectance, g + k * vector,
                                      a->w + k * vector, a->v + k * vector);
    if (L != NULL) lam_sky_adjoint(s->sky, count * C, a->v, L);
    if (D != NULL) lam_luminaires_adjoint(s->luminaires, count, a->v, D);
    if (L != NULL && sensors) add(count * tiles, a->direct, L);
    if (D != NULL && sensors) add(count * C * scene_luminaires(s), a->direct + count * tiles, D);
}

static bool solve(call *in, adjoint_solve *a, size_t first, size_t count, batch_workspace *workspace) {
    const scene *s = in->scene;
    const size_t vector = s->n_channels * s->n, work_bytes = lam_operator_work_bytes(s->op, count);
    void *work = work_bytes > 0 ? batch_workspace_get(workspace, work_bytes) : NULL;
    lam_error error;
    if (work == NULL)
        return problem_set(&a->why, PROBLEM_NO_MEMORY, "not enough memory to solve for a gradient");
    metrics_pass(in->service->metrics, count);
    if (a->request.cotangent.at_sensors) take_sensors(s, a, first, count);
    if (s->n_emitters > 0) return solve_emitters(s, a, first, count, work, work_bytes);
    const float *g = a->request.cotangent.E + first * vector;
    float *const E = gradient_at(s, a, GRADIENT_EMISSION, first),
                 *const R = gradient_at(s, a, GRADIENT_REFLECTANCE, first),
                 *const V = gradient_at(s, a, GRADIENT_GROUPS, first);
    if (lam_operator_apply_adjoint(s->op, count, a->request.quantity, g, a->w, work, work_bytes, &error) !=
        LAM_OK)
        return problem_set(&a->why, PROBLEM_INTERNAL, "%s", error.message);
    if (E != NULL) memcpy(E, a->w, count * vector * sizeof *E);
    for (size_t k = 0; V != NULL && k < count; k++)
        gradient_of_groups(s->n_channels, s->n, &s->groups, a->w + k * vector,
                           V + k * s->n_channels * s->groups.n_groups);
    solve_direct(s, a, first, count, g);
    if (R != NULL && !find_irradiance(in, a, work, work_bytes)) return false;
    for (size_t k = 0; R != NULL && k < count; k++)
        gradient_of_reflectance(a->request.quantity, vector, g + k * vector, a->w + k * vector, a->H, a->H0,
                                R + k * vector);
    return true;
}

/* The rows of all vectors of a kind: of a batch one level deeper. */
static bool write_rows(const call *in, const adjoint_solve *a, gradient_kind kind, buffer *b, problem *why) {
    const size_t C = in->scene->n_channels, width = gradient_width(in->scene, kind);
    const bool nested = a->request.cotangent.batch && in->accept.type == MEDIA_JSON;
    bool written = !nested || buffer_append(b, "[", 1);
    for (size_t v = 0; written && v < a->request.cotangent.n_rhs; v++) {
        written = !nested || v == 0 || buffer_append(b, ",", 1);
        if (written && !answer_rows(b, &in->accept, C, width, false, a->gradient[kind] + v * C * width, why))
            return false;
    }
    return (written && (!nested || buffer_append(b, "]", 1))) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
}

/* An array holds one gradient, the one that was named. */
static bool write_npy(const call *in, const adjoint_solve *a, buffer *b, problem *why) {
    const gradient_kind kind = a->request.named[0];
    const size_t C = in->scene->n_channels;
    size_t dims[3], rank = 0;
    if (a->request.cotangent.batch) dims[rank++] = a->request.cotangent.n_rhs;
    if (C > 1) dims[rank++] = C;
    dims[rank++] = gradient_width(in->scene, kind);
    if (!npy_write_header(b, in->accept.npy, rank, dims))
        return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
    return write_rows(in, a, kind, b, why);
}

static bool write_json(const call *in, const adjoint_solve *a, buffer *b, problem *why) {
    const scene *s = in->scene;
    bool written = answer_head(b, s->n, s->n_channels, &a->notes) && buffer_append_text(b, ",\"gradient\":{");
    for (int kind = 0, count = 0; written && kind < GRADIENT_COUNT; kind++) {
        if (!adjoint_wants(&a->request, (gradient_kind)kind)) continue;
        written = buffer_printf(b, "%s\"%s\":", count++ > 0 ? "," : "", gradient_name((gradient_kind)kind));
        if (written && !write_rows(in, a, (gradient_kind)kind, b, why)) return false;
    }
    return (written && buffer_append(b, "}", 1)) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
}

static bool read_body(const call *in, adjoint_request *request, problem *why) {
    const codec_scene about = call_codec_scene(in);
    const size_t lists = call_parse_bytes(in);
    if (!array_members_read(in, &request->quantity, NULL, why)) return false;
    if (!request_memory_take(in->memory, lists, why)) return false;
    if (in->body_type == MEDIA_JSON ? !codec_read_adjoint_json(&about, in->body, in->length, request, why)
                                    : !codec_read_adjoint_npy(&about, in->body, in->length, request, why))
        return false;
    if (in->accept.type == MEDIA_JSON) return true;
    if (request->n_named > 1)
        return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                           "an NPY answer holds one array; ask for one gradient, or for JSON");
    request->wanted = 1u << request->named[0]; /* an NPY answer has none by sky or luminaires */
    return true;
}

static bool begin(call *in, answer *out) {
    problem why = {0};
    adjoint_solve *a = calloc(1, sizeof *a);
    if (a == NULL) {
        answer_refuse(out, PROBLEM_NO_MEMORY, "not enough memory for the request");
        return false;
    }
    const double start = clock_ms();
    const bool good = read_body(in, &a->request, &why) && find_room(in, a, &why) &&
                      sun_answer_begin(in, &a->request.light, &a->sun, &why);
    if (!good) {
        answer_problem(out, &why);
        solve_free(a);
        return false;
    }
    const bool sensors = a->request.cotangent.at_sensors;
    a->notes = call_notes(in);
    a->notes.quantity = sensors ? LAM_IRRADIANCE : a->request.quantity;
    a->notes.at = sensors ? "sensors" : NULL;
    a->notes.by_luminance = a->request.light.by_luminance;
    light_conversion_text(&a->request.light.told, a->converted);
    a->notes.converted_by = a->converted;
    a->notes.parse_ms = clock_ms() - start;
    in->state = a;
    in->n_rhs = in->job.n_vectors = a->request.cotangent.n_rhs;
    in->job.key = (const void *)in;
    return true;
}

static void pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    for (size_t p = 0; p < n_parts; p++) {
        call *in = call_of(parts[p].job);
        adjoint_solve *a = in->state;
        const double start = clock_ms();
        if (!a->failed) a->failed = !solve(in, a, parts[p].first, parts[p].count, workspace);
        a->notes.solve_ms += clock_ms() - start;
    }
}

static void end(call *in, answer *out) {
    adjoint_solve *a = in->state;
    buffer b = {0};
    const bool npy = in->accept.type == MEDIA_NPY;
    const double start = clock_ms();
    bool good = !a->failed && (buffer_reserve(&b, answer_most(in, &a->request)) ||
                               problem_set(&a->why, PROBLEM_NO_MEMORY, "not enough memory for the answer"));
    good = good && (npy ? write_npy : write_json)(in, a, &b, &a->why);
    a->notes.encode_ms = clock_ms() - start;
    good = good && (npy || answer_tail(&b, &a->notes) ||
                    problem_set(&a->why, PROBLEM_NO_MEMORY, "not enough memory for the answer"));
    if (good) {
        answer_json(out, &b, true);
        answer_set_times(out, &a->notes);
        if (npy) out->type = "application/x-npy";
    } else {
        answer_problem(out, &a->why);
        buffer_free(&b);
    }
    in->state = NULL;
    solve_free(a);
}

static void drop(call *in) {
    solve_free(in->state);
    in->state = NULL;
}

const solve_steps post_adjoint = {.begin = begin, .pass = pass, .end = end, .drop = drop};
