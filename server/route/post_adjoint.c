/* POST /v1/scenes/NAME/adjoint: gradients of J = g . q by emission, reflectance, sky, emitters, groups and
 * luminaires. gradient.h has the formulas. */
#include "server/route/routes.h"
#include "server/route/sun_answer.h"
#include "server/scene/direct_light.h"
#include "server/scene/gradient.h"
#include "server/scene/sensor_answer.h"
#include "solver/base/clock.h"
#include "solver/codec/adjoint.h"
#include "solver/codec/answer.h"
#include "solver/operator/emitters.h"

#include <stdlib.h>
#include <string.h>

/* Arrays [C][n], and the work area of the operator in the workspace of the thread. */
typedef struct adjoint_memory {
    float *w, *H, *H0, *v; /* w begins what is freed */
    sun_answer sun;
    float *narrow;    /* [C][m] of tiles, or [C][s] of emitters */
    float *of_groups; /* [C][g] */
    float *dimmers;   /* [C][k] of luminaires */
    float *direct;    /* [C][m] and [C][k]: what comes to sensors directly */
    void *work;
    size_t work_bytes;
} adjoint_memory;

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
        const answer_shape shape = {
            .n_channels = s->n_channels, .n_rhs = 1, .n_values = gradient_width(s, (gradient_kind)kind)};
        if (adjoint_wants(request, (gradient_kind)kind))
            bytes = bytes_plus(bytes, answer_bytes_most(&shape, &in->accept));
    }
    return bytes;
}

static bool get_memory(call *in, const adjoint_request *request, adjoint_memory *memory, buffer *b,
                       problem *why) {
    const scene *s = in->scene;
    const bool by_reflectance = adjoint_wants(request, GRADIENT_REFLECTANCE),
               direct = s->sky != NULL || s->luminaires != NULL;
    const size_t C = s->n_channels, vector = C * s->n;
    float **const places[] = {&memory->w,      &memory->H,         &memory->H0,      &memory->v,
                              &memory->narrow, &memory->of_groups, &memory->dimmers, &memory->direct};
    const size_t rows[] = {vector,
                           by_reflectance ? vector : 0,
                           by_reflectance && direct ? vector : 0,
                           vector,
                           C * narrow_width(s),
                           adjoint_wants(request, GRADIENT_GROUPS) ? C * s->groups.n_groups : 0,
                           C * scene_luminaires(s),
                           request->cotangent.at_sensors ? C * (scene_tiles(s) + scene_luminaires(s)) : 0},
                 n_rows = sizeof rows / sizeof *rows;
    const size_t most = answer_most(in, request);
    size_t total = 0;
    for (size_t k = 0; k < n_rows; k++) total += rows[k];
    memory->work_bytes = lam_operator_work_bytes(s->op, 1);
    memory->work = memory->work_bytes > 0 ? batch_workspace_get(in->workspace, memory->work_bytes) : NULL;
    float *at = call_allocate(in, bytes_times(total, sizeof *at), "a gradient", why);
    memory->w = at;
    if (at == NULL || !request_memory_take(in->memory, most, why)) return false;
    if (memory->work == NULL || !buffer_reserve(b, most))
        return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to solve for a gradient");
    for (size_t k = 0; k < n_rows; at += rows[k++]) *places[k] = at;
    return true;
}

/* Irradiance H of the emission, its sky, its luminaires and its sun; *H0 is that of these three, NULL without
 * them. */
static bool solve_irradiance(const scene *s, const radiosity_request *light, adjoint_memory *memory,
                             const float **H0, problem *why) {
    lam_error error;
    *H0 = NULL;
    if (request_has_direct(light) || light->n_suns > 0) {
        *H0 = memory->H0;
        direct_light_find(s, light, 0, 1, memory->H0);
    }
    if (light->n_suns > 0) sun_answer_add(s, light, &memory->sun, 0, 1, memory->H0);
    return lam_operator_apply_lit(s->op, 1, LAM_IRRADIANCE, light->E, *H0, memory->H, memory->work,
                                  memory->work_bytes, &error) == LAM_OK ||
           problem_set(why, PROBLEM_INTERNAL, "%s", error.message);
}

/* Puts the cotangent of sensors into that of elements, and the gradients by light that comes to sensors
 * directly into `direct`. Receivers without a value have no part. */
static void take_sensors(const scene *s, adjoint_request *request, adjoint_memory *memory) {
    const size_t C = s->n_channels, all = scene_sensors(s);
    float *g = request->cotangent.sensors.values;
    for (size_t c = 0; c < C; c++)
        for (size_t k = 0; k < all; k++)
            if (!lam_sensors_has_value(s->sensors, k)) g[c * all + k] = 0;
    /* Sensors without rows of a sky or of luminaires leave these as they are. */
    memset(memory->direct, 0, C * (scene_tiles(s) + scene_luminaires(s)) * sizeof *memory->direct);
    lam_sensors_adjoint(s->sensors, 1, g, request->cotangent.E, memory->direct,
                        memory->direct + C * scene_tiles(s));
}

static void add(size_t count, const float *x, float *to) {
    for (size_t k = 0; k < count; k++) to[k] += x[k];
}

/* Adds gradients by the light that comes to sensors directly, direct [C][m] and [C][k], to those by weights W
 * [C][s] of few emitters. */
static void add_direct(const scene *s, const float *direct, float *W) {
    operator_emitters_adjoint_radiances(s->op, 1, direct, W);
    if (s->luminaires != NULL) operator_emitters_dim(s->op, 1, direct + s->n_channels * scene_tiles(s), W);
}

/* D [C][k], those of the last of the emitters W [C][s]. */
static void take_luminaires(const scene *s, const float *W, float *D) {
    const size_t k = scene_luminaires(s);
    for (size_t c = 0; c < s->n_channels; c++)
        memcpy(D + c * k, W + (c + 1) * s->n_emitters - k, k * sizeof *D);
}

/* Computes the gradients asked for: by emission in w, by reflectance in H, by tile or emitter in narrow,
 * by group in of_groups, by luminaire in dimmers. */
static bool solve(const scene *s, const adjoint_request *request, adjoint_memory *memory, metrics *m,
                  problem *why) {
    const float *g = request->cotangent.E, *H0;
    const size_t vector = s->n_channels * s->n;
    lam_error error;
    metrics_pass(m, 1);
    if (s->n_emitters > 0) {
        if (lam_operator_adjoint_emitters(s->op, 1, request->quantity, g, memory->narrow, memory->work,
                                          memory->work_bytes, &error) != LAM_OK)
            return problem_set(why, PROBLEM_INTERNAL, "%s", error.message);
        if (request->cotangent.at_sensors) add_direct(s, memory->direct, memory->narrow);
        take_luminaires(s, memory->narrow, memory->dimmers);
        return true;
    }
    if (lam_operator_apply_adjoint(s->op, 1, request->quantity, g, memory->w, memory->work,
                                   memory->work_bytes, &error) != LAM_OK)
        return problem_set(why, PROBLEM_INTERNAL, "%s", error.message);
    if (adjoint_wants(request, GRADIENT_GROUPS))
        gradient_of_groups(s->n_channels, s->n, &s->groups, memory->w, memory->of_groups);
    if (adjoint_wants(request, GRADIENT_SKY) || adjoint_wants(request, GRADIENT_LUMINAIRES))
        gradient_of_direct_irradiance(request->quantity, vector, s->reflectance, g, memory->w, memory->v);
    if (adjoint_wants(request, GRADIENT_SKY))
        lam_sky_adjoint(s->sky, s->n_channels, memory->v, memory->narrow);
    if (adjoint_wants(request, GRADIENT_LUMINAIRES))
        lam_luminaires_adjoint(s->luminaires, 1, memory->v, memory->dimmers);
    if (request->cotangent.at_sensors && adjoint_wants(request, GRADIENT_SKY))
        add(s->n_channels * scene_tiles(s), memory->direct, memory->narrow);
    if (request->cotangent.at_sensors && adjoint_wants(request, GRADIENT_LUMINAIRES))
        add(s->n_channels * scene_luminaires(s), memory->direct + s->n_channels * scene_tiles(s),
            memory->dimmers);
    if (adjoint_wants(request, GRADIENT_REFLECTANCE)) {
        metrics_pass(m, 1);
        if (!solve_irradiance(s, &request->light, memory, &H0, why)) return false;
        gradient_of_reflectance(request->quantity, vector, g, memory->w, memory->H, H0, memory->H);
    }
    return true;
}

static const float *gradient_values(const scene *s, const adjoint_memory *memory, gradient_kind kind,
                                    size_t *width) {
    *width = gradient_width(s, kind);
    switch (kind) {
    case GRADIENT_EMISSION:
        return memory->w;
    case GRADIENT_REFLECTANCE:
        return memory->H;
    case GRADIENT_GROUPS:
        return memory->of_groups;
    case GRADIENT_LUMINAIRES:
        return memory->dimmers;
    default:
        return memory->narrow;
    }
}

/* An array holds one gradient, the one that was named. */
static bool write_npy(const call *in, const adjoint_request *request, const adjoint_memory *memory,
                      answer_notes *notes, buffer *b, problem *why) {
    const size_t C = in->scene->n_channels;
    size_t width;
    const float *values = gradient_values(in->scene, memory, request->named[0], &width);
    const size_t dims[2] = {C, width};
    const double start = clock_ms();
    const bool good = npy_write_header(b, in->accept.npy, C > 1 ? 2 : 1, C > 1 ? dims : &dims[1])
                          ? answer_rows(b, &in->accept, C, width, false, values, why)
                          : problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
    notes->encode_ms = clock_ms() - start;
    return good;
}

static bool write_json(const call *in, const adjoint_request *request, const adjoint_memory *memory,
                       answer_notes *notes, buffer *b, problem *why) {
    const scene *s = in->scene;
    const double start = clock_ms();
    bool written = answer_head(b, s->n, s->n_channels, notes) && buffer_append_text(b, ",\"gradient\":{");
    for (int kind = 0, count = 0; written && kind < GRADIENT_COUNT; kind++) {
        size_t width;
        if (!adjoint_wants(request, (gradient_kind)kind)) continue;
        written = buffer_printf(b, "%s\"%s\":", count++ > 0 ? "," : "", gradient_name((gradient_kind)kind));
        const float *values = gradient_values(s, memory, (gradient_kind)kind, &width);
        if (written && !answer_rows(b, &in->accept, s->n_channels, width, false, values, why)) return false;
    }
    written = written && buffer_append(b, "}", 1);
    notes->encode_ms = clock_ms() - start;
    return (written && answer_tail(b, notes)) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
}

static bool read_body(const call *in, adjoint_request *request, problem *why) {
    const codec_scene about = call_codec_scene(in);
    const size_t lists = call_parse_bytes(in);
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

void post_adjoint(call *in, answer *out) {
    answer_notes notes = call_notes(in);
    char converted[LIGHT_CONVERSION_TEXT];
    adjoint_request request = {0};
    adjoint_memory memory = {0};
    problem why = {0};
    buffer b = {0};
    const double start = clock_ms();
    bool good = read_body(in, &request, &why) && get_memory(in, &request, &memory, &b, &why) &&
                sun_answer_begin(in, &request.light, &memory.sun, &why) &&
                (sun_answer_find(in, &request.light, 0, 1, &memory.sun) ||
                 problem_set(&why, PROBLEM_UNAVAILABLE, "nobody waits for the answer any more"));
    const double parsed = clock_ms();
    notes.parse_ms = parsed - start;
    notes.quantity = request.cotangent.at_sensors ? LAM_IRRADIANCE : request.quantity;
    notes.at = request.cotangent.at_sensors ? "sensors" : NULL;
    notes.by_luminance = request.light.by_luminance;
    light_conversion_text(&request.light.told, converted);
    notes.converted_by = converted;
    in->n_rhs = 1;
    if (good && request.cotangent.at_sensors) take_sensors(in->scene, &request, &memory);
    good = good && solve(in->scene, &request, &memory, in->service->metrics, &why);
    notes.solve_ms = clock_ms() - parsed;
    if (good && (in->accept.type == MEDIA_NPY ? write_npy(in, &request, &memory, &notes, &b, &why)
                                              : write_json(in, &request, &memory, &notes, &b, &why))) {
        answer_json(out, &b, true);
        answer_set_times(out, &notes);
        if (in->accept.type == MEDIA_NPY) out->type = "application/x-npy";
    } else {
        answer_problem(out, &why);
    }
    buffer_free(&b);
    free(memory.w);
    sun_answer_free(&memory.sun);
    adjoint_request_free(&request);
}
