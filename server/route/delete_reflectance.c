/* DELETE /v1/scenes/NAME@VARIANT, the same with /reflectance behind it, or, with {"variant":...},
 * /v1/scenes/NAME/reflectance: a variant is not served any more. */
#include "server/route/routes.h"
#include "solver/codec/reflectance.h"

#include <stdio.h>
#include <stdlib.h>

static void remove_variant(call *in, const char *name, answer *out) {
    problem why = {0};
    if (variants_remove(in->service->variants, name, &why))
        *out = (answer){.status = 204};
    else
        answer_problem(out, &why);
}

/* Of a store, not of a variant, built or not. */
static bool is_of_store(const call *in) {
    return in->scene != NULL && in->scene->base == NULL;
}

void delete_scene(call *in, answer *out) {
    if (is_of_store(in)) {
        answer_refuse(out, 405,
                      "/v1/scenes/%.200s: the method is DELETE, must be GET, HEAD: it is a store, and only "
                      "variants can be deleted",
                      in->scene->name);
        snprintf(out->allow, sizeof out->allow, "GET, HEAD");
        return;
    }
    remove_variant(in, in->name, out);
}

void delete_reflectance(call *in, answer *out) {
    char name[ROUTE_NAME_MAX], *variant = NULL;
    problem why = {0};
    if (!is_of_store(in)) {
        remove_variant(in, in->name, out);
        return;
    }
    if (in->body_type != MEDIA_JSON)
        answer_refuse(out, 415, "Content-Type must be application/json");
    else if (in->length == 0)
        answer_refuse(out, 422,
                      "which variant? DELETE /v1/scenes/%.200s@VARIANT/reflectance, or {\"variant\":...}",
                      in->scene->name);
    else if (!codec_read_variant(in->body, in->length, &variant, &why))
        answer_problem(out, &why);
    else if (snprintf(name, sizeof name, "%s@%s", in->scene->name, variant) >= ROUTE_NAME_MAX)
        answer_refuse(out, 404, "there is no variant %.200s", variant);
    else
        remove_variant(in, name, out);
    free(variant);
}
