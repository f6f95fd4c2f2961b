#include "server/route/call.h"

#include "server/scene/adjoint_rows.h"
#include "server/scene/direct_light.h"
#include "server/scene/sensor_answer.h"
#include "solver/operator/emitters.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

void answer_free(answer *out) {
    buffer_free(&out->body);
    answer_stream_free(out->stream);
    out->stream = NULL;
    kept_bytes_release(out->kept);
    out->kept = NULL;
    free(out->location);
    out->location = NULL;
}

void answer_problem(answer *out, const problem *what) {
    buffer_free(&out->body);
    answer_stream_free(out->stream);
    out->stream = NULL;
    kept_bytes_release(out->kept);
    out->kept = NULL;
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
    return (codec_scene){.n = s->n,
                         .n_channels = s->n_channels,
                         .lights = s->lights,
                         .groups = &s->groups,
                         .faces = &s->faces,
                         .n_tiles = scene_tiles(s),
                         .n_luminaires = scene_luminaires(s),
                         .luminaires = &s->luminaire_names,
                         .area = s->area,
                         .sensors = &s->sensor_sets,
                         .n_emitters = s->n_emitters,
                         .signs = s->n_emitters == 0,
                         .emitters = &s->emitters,
                         .max_batch = in->service->config->max_batch,
                         .max_bytes = SIZE_MAX, /* the memory of the request is the limit */
                         .take = request_memory_take_of,
                         .owner = in->memory,
                         .max_rows = adjoint_rows_capacity(s),
                         .no_sun = scene_sun_why_not(s),
                         .no_sensors = operator_points_why_not(s->op)};
}

size_t call_parse_bytes(const call *in) {
    const scene *s = in->scene;
    if (in->body_type != MEDIA_JSON) return 0;
    /* Indices and values of one sparse vector, the set of those seen, and a list of selected elements,
     * faces or sensors; each takes a letter of the text at least, and there are as many as elements or faces
     * at most. */
    const size_t elements = s->faces.n_faces > s->n ? s->faces.n_faces : s->n, sensors = scene_sensors(s),
                 most = elements > sensors ? elements : sensors;
    const size_t numbers = in->length < most ? in->length : most;
    return bytes_times(numbers, 32 + 6 * s->n_channels);
}

void *call_allocate(const call *in, size_t bytes, const char *what, problem *why) {
    if (!request_memory_take(in->memory, bytes, why)) return NULL;
    void *made = malloc(bytes > 0 ? bytes : 1);
    memory_large_pages(made, bytes);
    if (made == NULL) problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for %s", what);
    return made;
}

bool call_refuse_store(const scene *s, lam_status status, const lam_error *error, problem *why) {
    const problem_kind as =
        status == LAM_ERR_MEMORY || status == LAM_ERR_IO ? PROBLEM_NO_MEMORY : PROBLEM_UNAVAILABLE;
    return problem_set(why, as, "%.100s: %s", s->name, scene_message(s, error->message));
}

void answer_set_times(answer *out, const answer_notes *notes) {
    out->timed = true;
    out->parse_ms = notes->parse_ms;
    out->solve_ms = notes->solve_ms;
    out->encode_ms = notes->encode_ms;
}

void answer_set_unit(answer *out, const answer_notes *notes) {
    out->unit = notes->unit;
    snprintf(out->converted, sizeof out->converted, "%s", notes->converted_by);
}

answer_notes call_notes(const call *in) {
    const scene *s = in->scene;
    return (answer_notes){.scene = s->name, .has_time = true};
}
