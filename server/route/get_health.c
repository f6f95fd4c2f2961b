/* GET /healthz: 200 while the process answers. GET /readyz: 200 while it serves scenes, with the stores that
 * were refused beside them; 503 while it loads or drains, or has none that is not damaged. */
#include "server/route/routes.h"
#include "solver/codec/json_writer.h"

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
    bool written = buffer_append_text(&b, "{\"status\":\"ready\"");
    for (size_t i = 0; i < refused->count && written; i++) {
        const refused_store *one = &refused->items[i];
        written = buffer_append_text(&b, i == 0 ? ",\"refused\":[{\"name\":" : ",{\"name\":") &&
                  json_write_text(&b, one->name) && buffer_append_text(&b, ",\"reason\":") &&
                  json_write_text(&b, one->reason) &&
                  buffer_printf(&b, ",\"kept\":%s}", one->kept ? "true" : "false");
    }
    written = written && (refused->count == 0 || buffer_append(&b, "]", 1)) && buffer_append(&b, "}\n", 2);
    answer_json(out, &b, written);
}

/* No scene is left: says so, and why the first of those that were refused was. */
static void refuse_ready(const refusals *refused, answer *out) {
    const refused_store *first = refused->count > 0 ? &refused->items[0] : NULL;
    if (first == NULL)
        answer_refuse(out, PROBLEM_UNAVAILABLE,
                      "there is no scene to serve: none is left, or all are damaged");
    else
        answer_refuse(
            out, PROBLEM_UNAVAILABLE,
            "there is no scene to serve: none is left, or all are damaged; %zu store%s refused, the "
            "first of them %.60s: %.240s",
            refused->count, refused->count == 1 ? " was" : "s were", first->name, first->reason);
}

void get_readyz(call *in, answer *out) {
    switch ((service_state)atomic_load(&in->service->state)) {
    case SERVICE_READY:
        if (serves_any(in->snapshot))
            answer_ready(in->snapshot->refused, out);
        else
            refuse_ready(in->snapshot->refused, out);
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
