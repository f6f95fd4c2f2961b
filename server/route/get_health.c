/* GET /healthz: 200 while the process answers. GET /readyz: 200 while it serves scenes, with the stores that
 * were refused beside them; 503 while it loads or drains, or has none that is not damaged, or under --strict
 * has not read every store. */
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

/* {"status":"ready"}, and "refused" where a store was. */
static void answer_ready(const refusals *refused, answer *out) {
    buffer b = {0};
    answer_json(out, &b,
                buffer_append_text(&b, "{\"status\":\"ready\"") && refusals_write(refused, &b) &&
                    buffer_append(&b, "}\n", 2));
}

/* Says what is wrong, and why the first of the stores that were refused was. */
static void refuse_ready(const char *wrong, const refusals *refused, answer *out) {
    const refused_store *first = refused->count > 0 ? &refused->items[0] : NULL;
    if (first == NULL)
        answer_refuse(out, PROBLEM_UNAVAILABLE, "%s", wrong);
    else
        answer_refuse(out, PROBLEM_UNAVAILABLE, "%s; %zu store%s refused, the first of them %.60s: %.240s",
                      wrong, refused->count, refused->count == 1 ? " was" : "s were", first->name,
                      first->reason);
}

void get_readyz(call *in, answer *out) {
    switch ((service_state)atomic_load(&in->service->state)) {
    case SERVICE_READY:
        if (!serves_any(in->snapshot))
            refuse_ready("there is no scene to serve: none is left, or all are damaged",
                         in->snapshot->refused, out);
        else if (in->service->config->strict && !catalog_read_all(in->service->catalog))
            refuse_ready("not every store could be read (--strict); the scenes are served",
                         in->snapshot->refused, out);
        else
            answer_ready(in->snapshot->refused, out);
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
