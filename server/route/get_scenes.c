/* GET /v1/scenes: the list of all scenes in service. GET /v1/scenes/NAME: the description of one. */
#include "server/route/routes.h"
#include "solver/codec/json_writer.h"

void get_scenes(call *in, answer *out) {
    buffer b = {0};
    bool written = buffer_append_text(&b, "{\"scenes\":[");
    size_t listed = 0;
    for (size_t i = 0; i < in->snapshot->n_scenes; i++) {
        const scene *s = in->snapshot->scenes[i];
        if (scene_damaged(s, NULL, NULL)) continue;
        written = written && buffer_append_text(&b, listed++ > 0 ? ",{\"name\":" : "{\"name\":") &&
                  json_write_text(&b, s->name) &&
                  buffer_printf(&b, ",\"elements\":%zu,\"channels\":%zu,\"kind\":\"%s\",\"bytes\":%llu}",
                                s->n, s->n_channels, lam_operator_kind(s->op), (unsigned long long)s->bytes);
    }
    answer_json(out, &b, written && buffer_append_text(&b, "]}\n"));
    out->cacheable = out->status == 200;
}

/* A variant that is being built is answered by 202, although an earlier variant of this name may still be
 * served. */
void get_scene(call *in, answer *out) {
    buffer b = {0};
    if (in->variant == VARIANT_FAILED) {
        answer_problem(out, in->variant_why);
        return;
    }
    if (in->variant == VARIANT_BUILDING) {
        answer_json(out, &b, buffer_append_text(&b, "{\"status\":\"building\"}\n"));
        if (out->status == 200) out->status = 202;
        return;
    }
    answer_json(out, &b, buffer_append_text(&b, in->scene->description) && buffer_append_text(&b, "\n"));
    out->cacheable = out->status == 200;
}
