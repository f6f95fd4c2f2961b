/* GET /v1/scenes/NAME: what a store holds and how exact it is; of a variant that was asked for last and is
 * not built yet, that it is not, although what it was before may be served. */
#include "server/route/routes.h"

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
