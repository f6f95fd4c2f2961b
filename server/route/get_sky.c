/* GET /v1/scenes/NAME/sky: where the tiles of the sky of a store are.
 * GET /v1/scenes/NAME/luminaires: its luminaires, in the order of their dimmers.
 * GET /v1/scenes/NAME/sensors: its sensors, in the order of their values.
 * GET /v1/scenes/NAME/groups: its groups, in their order, with areas and materials.
 * GET /v1/scenes/NAME/weather: the weather file beside the store, as it is. */
#include "server/route/kept_answer.h"

/* Variants have the sky, the luminaires, the sensors and the weather of their store. */
static const scene *store_of(const call *in) {
    return in->scene->base != NULL ? in->scene->base : in->scene;
}

bool keeps_sky(const call *in, kept_source *from, answer *out) {
    const scene *s = store_of(in);
    if (s->texts.sky == NULL) {
        answer_refuse(out, PROBLEM_NOT_FOUND, "%.120s: the store has no sky%s", in->scene->name,
                      s->sky != NULL ? " whose tiles it states; precompute it again" : "");
        return false;
    }
    *from = kept_text(s->texts.sky, "application/json");
    return true;
}

bool keeps_luminaires(const call *in, kept_source *from, answer *out) {
    const scene *s = store_of(in);
    if (s->texts.luminaires == NULL) {
        answer_refuse(out, PROBLEM_NOT_FOUND, "%.120s: the store has no luminaires", in->scene->name);
        return false;
    }
    *from = kept_text(s->texts.luminaires, "application/json");
    return true;
}

bool keeps_sensors(const call *in, kept_source *from, answer *out) {
    const scene *s = store_of(in);
    if (s->texts.sensors == NULL) {
        answer_refuse(out, PROBLEM_NOT_FOUND, "%.120s: the store has no sensors", in->scene->name);
        return false;
    }
    *from = kept_text(s->texts.sensors, "application/json");
    return true;
}

bool keeps_groups(const call *in, kept_source *from, answer *out) {
    (void)out;
    *from = kept_text(in->scene->texts.groups, "application/json");
    return true;
}

bool keeps_weather(const call *in, kept_source *from, answer *out) {
    const scene *s = store_of(in);
    if (s->texts.weather == NULL) {
        answer_refuse(out, PROBLEM_NOT_FOUND, "%.120s: %s", in->scene->name, s->weather.why);
        return false;
    }
    *from = kept_text(s->texts.weather, "text/plain; charset=utf-8");
    return true;
}
