/* GET /v1/scenes/NAME/sky: the tiles of the sky of a store, which pages make skies for.
 * GET /v1/scenes/NAME/weather: the weather file beside the store, as it is. */
#include "server/route/routes.h"

/* Variants have the sky and the weather of their store. */
static const scene *store_of(const call *in) {
    return in->scene->base != NULL ? in->scene->base : in->scene;
}

void get_sky(call *in, answer *out) {
    const scene *s = store_of(in);
    buffer b = {0};
    if (s->tiles.length == 0) {
        answer_refuse(out, PROBLEM_NOT_FOUND, "%.120s: the store has no sky%s", in->scene->name,
                      s->sky != NULL ? " whose tiles it states; precompute it again" : "");
        return;
    }
    answer_json(out, &b,
                buffer_append_text(&b, "{") && buffer_append(&b, s->tiles.bytes, s->tiles.length) &&
                    (s->weather.format != NULL
                         ? buffer_printf(&b, ",\"weather\":\"%s\"}\n", s->weather.format)
                         : buffer_append_text(&b, ",\"weather\":null}\n")));
    out->cacheable = out->status == 200;
}

void get_weather(call *in, answer *out) {
    const weather_file *w = &store_of(in)->weather;
    buffer b = {0};
    if (w->format == NULL) {
        answer_refuse(out, PROBLEM_NOT_FOUND, "%.120s: %s", in->scene->name, w->why);
        return;
    }
    answer_json(out, &b, buffer_append(&b, w->text, w->length));
    if (out->status != 200) return;
    out->type = "text/plain; charset=utf-8";
    out->cacheable = true;
}
