#include "server/route/call.h"

#include "server/scene/adjoint_rows.h"

#include <stdarg.h>
#include <stdio.h>

/* Least limit of the bytes of a request's emission vectors: a short sparse text may ask for many long ones.
 */
#define LEAST_EMISSION_LIMIT ((size_t)1 << 30)

void answer_problem(answer *out, const problem *what) {
    buffer_free(&out->body);
    out->status = what->status;
    out->problem = what->kind;
    out->type = "application/problem+json";
    out->retry_after = what->status == 503 ? 1 : 0;
    if (problem_write(what, &out->body)) return;
    /* Without memory for a body the status must do. */
    buffer_free(&out->body);
    out->status = 503;
    out->retry_after = 1;
}

void answer_refuse(answer *out, problem_kind kind, const char *format, ...) {
    problem what = {.kind = kind, .status = problem_status(kind)};
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(what.detail, sizeof what.detail, format, arguments);
    va_end(arguments);
    answer_problem(out, &what);
}

void answer_json(answer *out, buffer *b, bool written) {
    if (!written) {
        buffer_free(b);
        answer_refuse(out, PROBLEM_NO_MEMORY, "not enough memory for the answer");
        return;
    }
    *out = (answer){.status = 200, .type = "application/json", .body = *b};
    *b = (buffer){0};
}

codec_scene call_codec_scene(const call *in) {
    const scene *s = in->scene;
    const config *c = in->service->config;
    return (codec_scene){.n = s->n,
                         .n_channels = s->n_channels,
                         .groups = &s->groups,
                         .n_tiles = s->sky != NULL ? lam_sky_tiles(s->sky) : 0,
                         .n_emitters = s->n_emitters,
                         .emitters = &s->emitters,
                         .max_batch = c->max_batch,
                         .max_bytes =
                             4 * c->max_body > LEAST_EMISSION_LIMIT ? 4 * c->max_body : LEAST_EMISSION_LIMIT,
                         .max_rows = adjoint_rows_capacity(s)};
}

answer_notes call_notes(const call *in) {
    const scene *s = in->scene;
    return (answer_notes){.scene = s->name, .has_time = true};
}
