/* GET /v1/scenes: the list of all scenes in service, and of stores that were refused. GET /v1/scenes/NAME:
 * the description of one. */
#include "server/route/kept_answer.h"

bool keeps_scenes(const call *in, kept_source *from, answer *out) {
    const catalog_snapshot *all = in->snapshot;
    kept_forms *text = scene_list_get(all->list, all->n_scenes, all->scenes, all->refused);
    if (text == NULL) {
        answer_refuse(out, PROBLEM_NO_MEMORY, "not enough memory for the answer");
        return false;
    }
    *from = kept_text(text, "application/json");
    kept_forms_release(text);
    return true;
}

/* A variant that is being built is answered by 202, although an earlier variant of this name may still be
 * served. */
bool keeps_scene(const call *in, kept_source *from, answer *out) {
    buffer b = {0};
    if (in->variant == VARIANT_FAILED) {
        answer_problem(out, in->variant_why);
        return false;
    }
    if (in->variant == VARIANT_BUILDING) {
        answer_json(out, &b, buffer_append_text(&b, "{\"status\":\"building\"}\n"));
        if (out->status == 200) out->status = 202;
        return false;
    }
    *from = kept_text(in->scene->texts.description, "application/json");
    return true;
}
