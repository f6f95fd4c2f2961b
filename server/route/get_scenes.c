/* GET /v1/scenes: what is served. */
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
