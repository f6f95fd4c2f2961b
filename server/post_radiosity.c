/* POST /v1/scenes/NAME/radiosity: emission in, light out. */
#include "server/codec_answer.h"
#include "server/codec_request.h"
#include "server/refined_answer.h"
#include "server/routes.h"

#include <time.h>

/* Vectors of one pass over the operator: enough to use each row read many times, few enough that they stay in
 * the cache. */
#define PASS 16

/* Emission vectors of one request, in bytes: a short sparse text may ask for many long ones. */
#define LEAST_EMISSION_LIMIT ((size_t)1 << 30)

static double now_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

/* What a pass works with, in the thread's own memory. */
typedef struct pass_memory {
    float *out; /* [n_rhs][C][n], less where elements are selected */
    float *H0;  /* [n_rhs][C][n], what the sky gives; NULL where no vector is under one */
    float *W;   /* [n_rhs][C][s], weights of the store's emitters, in place of H0 */
    void *work;
    size_t work_bytes;
} pass_memory;

static bool get_pass_memory(call *in, size_t n_rhs, bool lit, pass_memory *memory, problem *why) {
    const scene *s = in->scene;
    size_t values, out_bytes, side_bytes, total;
    const size_t side = s->n_emitters > 0 ? s->n_emitters : lit ? s->n : 0;
    memory->work_bytes = lam_operator_work_bytes(s->op, n_rhs);
    if (memory->work_bytes > 0 && size_multiply(n_rhs * s->n_channels, s->n, &values) &&
        size_multiply(values, sizeof(float), &out_bytes)) {
        /* The others come behind the vectors, aligned as malloc does. */
        out_bytes = (out_bytes + 63) / 64 * 64;
        side_bytes = (n_rhs * s->n_channels * side * sizeof(float) + 63) / 64 * 64;
        if (!__builtin_add_overflow(out_bytes, memory->work_bytes, &total) &&
            !__builtin_add_overflow(total, side_bytes, &total)) {
            char *bytes = batch_workspace_get(in->workspace, total);
            if (bytes != NULL) {
                float *beside = (float *)(void *)(bytes + out_bytes);
                memory->out = (float *)(void *)bytes;
                memory->H0 = lit && s->n_emitters == 0 ? beside : NULL;
                memory->W = s->n_emitters > 0 ? beside : NULL;
                memory->work = bytes + out_bytes + side_bytes;
                return true;
            }
        }
    }
    return problem_set(why, 503, "not enough memory to solve %zu vectors", n_rhs);
}

/* The answer of an operator of few emitters: to weights given, and to those told from the emission. */
static bool solve_emitters(const scene *s, const radiosity_request *request, size_t first, size_t count,
                           const pass_memory *memory, problem *why) {
    const size_t C = s->n_channels, weights = C * s->n_emitters;
    lam_error error;
    const float *L = request->sky.values;
    const size_t n_tiles = s->sky != NULL ? lam_sky_tiles(s->sky) : 0;
    if (L != NULL) L += first * C * n_tiles;
    lam_status status =
        lam_operator_weights(s->op, count, request->E + first * C * s->n, n_tiles, L, memory->W, &error);
    if (status != LAM_OK)
        return problem_set(why, status == LAM_ERR_MEMORY ? 503 : 422, "emission %zu or after: %s", first,
                           error.message);
    for (size_t k = 0; request->emitters.values != NULL && k < count * weights; k++)
        memory->W[k] += request->emitters.values[first * weights + k];
    status = lam_operator_apply_emitters(s->op, count, request->quantity, memory->W, request->n_selected,
                                         request->select ? request->selected : NULL, memory->out,
                                         memory->work, memory->work_bytes, &error);
    return status == LAM_OK || problem_set(why, 500, "%s", error.message);
}

/* That of any other. */
static bool solve_any(const scene *s, const radiosity_request *request, size_t first, size_t count,
                      const pass_memory *memory, problem *why) {
    const float *E = request->E + first * s->n_channels * s->n;
    lam_error error;
    if (memory->H0 != NULL)
        lam_sky_irradiance(s->sky, count * s->n_channels,
                           request->sky.values + first * s->n_channels * lam_sky_tiles(s->sky), memory->H0);
    const lam_status status =
        request->select ? lam_operator_apply_selected(s->op, count, request->quantity, E, memory->H0,
                                                      request->n_selected, request->selected, memory->out,
                                                      memory->work, memory->work_bytes, &error)
                        : lam_operator_apply_lit(s->op, count, request->quantity, E, memory->H0, memory->out,
                                                 memory->work, memory->work_bytes, &error);
    return status == LAM_OK || problem_set(why, 500, "%s", error.message);
}

/* Applies the operator pass by pass, each pass's vectors encoded while they are in the cache. */
static bool solve(call *in, const radiosity_request *request, answer_notes *notes, buffer *b, problem *why) {
    const scene *s = in->scene;
    answer_shape shape = {.n = s->n,
                          .n_channels = s->n_channels,
                          .n_rhs = request->n_rhs,
                          .batch = request->batch,
                          .n_values = request->select ? request->n_selected : s->n};
    pass_memory memory = {0};
    if (!get_pass_memory(in, request->n_rhs < PASS ? request->n_rhs : PASS, request->sky.values != NULL,
                         &memory, why) ||
        !answer_begin(b, &shape, &in->accept, notes, why))
        return false;
    for (size_t first = 0; first < request->n_rhs; first += PASS) {
        size_t count = request->n_rhs - first < PASS ? request->n_rhs - first : PASS;
        double start = now_ms();
        const bool good = s->n_emitters > 0 ? solve_emitters(s, request, first, count, &memory, why)
                                            : solve_any(s, request, first, count, &memory, why);
        if (!good) return false;
        double solved = now_ms();
        metrics_pass(in->service->metrics, count);
        notes->solve_ms += solved - start;
        if (!answer_add(b, &shape, &in->accept, first, count, memory.out, why)) return false;
        notes->encode_ms += now_ms() - solved;
    }
    return answer_end(b, &shape, &in->accept, notes, why);
}

void post_radiosity(call *in, answer *out) {
    const scene *s = in->scene;
    const config *c = in->service->config;
    codec_scene about = {.n = s->n,
                         .n_channels = s->n_channels,
                         .groups = &s->groups,
                         .n_tiles = s->sky != NULL ? lam_sky_tiles(s->sky) : 0,
                         .n_emitters = s->n_emitters,
                         .max_batch = c->max_batch,
                         .max_bytes =
                             4 * c->max_body > LEAST_EMISSION_LIMIT ? 4 * c->max_body : LEAST_EMISSION_LIMIT};
    answer_notes notes = {.scene = s->name,
                          .has_error = s->has_error,
                          .relative_mean = s->relative_mean,
                          .indirect_mean = s->indirect_mean};
    radiosity_request request = {0};
    problem why = {0};
    buffer b = {0};
    double start = now_ms();
    bool good = in->body_type == MEDIA_NPY ? codec_read_npy(&about, in->body, in->length, &request, &why)
                                           : codec_read_json(&about, in->body, in->length, &request, &why);
    notes.parse_ms = now_ms() - start;
    notes.quantity = request.quantity;
    in->n_rhs = request.n_rhs;
    const bool refine = request.tolerance > 0;
    if (good && (refine ? refined_answer : solve)(in, &request, &notes, &b, &why)) {
        answer_json(out, &b, true);
        if (in->accept.type == MEDIA_NPY) out->type = "application/x-npy";
        if (refine) refined_answer_tell(&notes, request.n_rhs, out);
    } else {
        answer_problem(out, &why);
    }
    buffer_free(&b);
    refined_answer_free(&notes);
    radiosity_request_free(&request);
}
