/* GET /v1/scenes/NAME: what a store holds and how exact it is. */
#include "server/routes.h"

void get_scene(call *in, answer *out) {
    buffer b = {0};
    answer_json(out, &b, buffer_append_text(&b, in->scene->description) && buffer_append_text(&b, "\n"));
    out->cacheable = out->status == 200;
}
