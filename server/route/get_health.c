/* GET /healthz: 200 while the process answers. GET /readyz: 200 while it serves scenes, 503 while it loads or
 * drains, or has none that is not damaged. */
#include "server/route/routes.h"

static void answer_state(answer *out, const char *state) {
    buffer b = {0};
    answer_json(out, &b, buffer_printf(&b, "{\"status\":\"%s\"}\n", state));
}

void get_healthz(call *in, answer *out) {
    (void)in;
    answer_state(out, "ok");
}

static bool serves_any(const catalog_snapshot *snapshot) {
    for (size_t i = 0; i < snapshot->n_scenes; i++)
        if (!scene_damaged(snapshot->scenes[i], NULL, NULL)) return true;
    return false;
}

void get_readyz(call *in, answer *out) {
    switch ((service_state)atomic_load(&in->service->state)) {
    case SERVICE_READY:
        if (serves_any(in->snapshot))
            answer_state(out, "ready");
        else
            answer_refuse(out, PROBLEM_UNAVAILABLE,
                          "there is no scene to serve: none is left, or all are damaged");
        break;
    case SERVICE_LOADING:
        answer_refuse(out, PROBLEM_UNAVAILABLE, "loading stores");
        break;
    case SERVICE_DRAINING:
    case SERVICE_ENDING:
        answer_refuse(out, PROBLEM_UNAVAILABLE, "shutting down");
        break;
    }
}
