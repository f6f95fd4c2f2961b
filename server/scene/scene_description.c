#include "server/scene/scene_description.h"

#include "solver/codec/describe.h"

#include <stdlib.h>

lam_status scene_describe(store *s, const scene *loaded, char **text, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *made = NULL;
    TRY(describe_store(s, &made, error));
    if (json_object_set_new(made, "name", json_string(loaded->name)) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: its name is not UTF-8; give it one: %s:NAME", loaded->path,
             loaded->path);
    char *written = json_dumps(made, JSON_COMPACT);
    if (written == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory to describe it", loaded->path);
    *text = written;
done:
    json_decref(made);
    return status;
}

lam_status scene_describe_variant(const scene *variant, const char *groups, char **text, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *made = json_loads(variant->base->description, 0, NULL);
    char *written = NULL;
    if (made != NULL && json_object_set_new(made, "name", json_string(variant->name)) == 0 &&
        json_object_set_new(made, "bytes", json_integer((json_int_t)variant->bytes)) == 0 &&
        json_object_set_new(made, "error", json_object()) == 0 &&
        json_object_set_new(made, "variant_of", json_string(variant->base->name)) == 0 &&
        json_object_set_new(made, "reflectance", json_loads(groups, 0, NULL)) == 0)
        written = json_dumps(made, JSON_COMPACT);
    if (written == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory to describe it", variant->name);
    *text = written;
done:
    json_decref(made);
    return status;
}
