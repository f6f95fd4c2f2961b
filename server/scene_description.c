#include "server/scene_description.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void add_attribute(void *context, const char *name, const char *text, double number) {
    json_t *value;
    if (text != NULL)
        value = json_string(text);
    else if (!isfinite(number))
        value = json_null();
    else if (number == floor(number) && fabs(number) < 0x1p53)
        value = json_integer((json_int_t)number);
    else
        value = json_real(number);
    json_object_set_new(context, name, value);
}

/* The attributes of a group; an empty object where there is no such group. */
static lam_status read_attributes(store *s, const char *group, json_t **out, lam_error *error) {
    *out = json_object();
    return store_has(s, group) ? store_each_attribute(s, group, add_attribute, *out, error) : LAM_OK;
}

/* to.name = from.name, or null. */
static void copy(json_t *to, const char *name, json_t *from) {
    json_t *value = json_object_get(from, name);
    if (value == NULL)
        json_object_set_new(to, name, json_null());
    else
        json_object_set(to, name, value);
}

/* NULL when a name is not UTF-8. */
static json_t *describe_groups(const group_index *groups) {
    json_t *list = json_array();
    for (size_t g = 0; g < groups->n_groups; g++) {
        json_int_t count = groups->start[g + 1] - groups->start[g];
        if (json_array_append_new(list,
                                  json_pack("{s:s, s:I}", "name", groups->names[g], "elements", count)) == 0)
            continue;
        json_decref(list);
        return NULL;
    }
    return list;
}

lam_status scene_describe(store *s, const scene *loaded, char **text, lam_error *error) {
    static const char *const of_operator[] = {"kind", "method", "reason", "epsilon"};
    static const char *const lights[] = {"single", "lights", "random"};
    static const char *const of_root[] = {"tool", "command", "created", "seed", "unit"};
    lam_status status = LAM_OK;
    json_t *made = json_object(), *root = NULL, *op = NULL, *mesh = NULL, *form_factors = NULL, *all = NULL;
    json_t *provenance = json_object();
    TRY(read_attributes(s, "/", &root, error));
    TRY(read_attributes(s, "/operator", &op, error));
    TRY(read_attributes(s, "/mesh", &mesh, error));
    TRY(read_attributes(s, "/form_factors", &form_factors, error));
    TRY(read_attributes(s, "/error", &all, error));
    if (json_object_set_new(made, "name", json_string(loaded->name)) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: its name is not UTF-8; give it one: %s:NAME", loaded->path,
             loaded->path);
    json_object_set_new(made, "elements", json_integer((json_int_t)loaded->n));
    json_object_set_new(made, "channels", json_integer((json_int_t)loaded->n_channels));
    for (size_t i = 0; i < sizeof of_operator / sizeof *of_operator; i++) copy(made, of_operator[i], op);
    if (json_object_get(op, "rank") != NULL)
        copy(made, "rank", op);
    else if (json_object_get(op, "density") != NULL)
        copy(made, "density", op);
    else if (strcmp(lam_operator_kind(loaded->op), "exact") == 0)
        json_object_set_new(made, "density", json_integer(1));
    json_object_set_new(made, "bytes", json_integer((json_int_t)loaded->bytes));
    if (json_object_set_new(made, "groups", describe_groups(&loaded->groups)) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/group_names holds a name that is not UTF-8", loaded->path);
    json_object_set_new(made, "emitters", json_null());
    json_object_set_new(made, "sky", json_null());
    for (size_t i = 0; i < sizeof lights / sizeof *lights; i++) {
        char path[32] = "/error/";
        json_t *figures;
        strcat(path, lights[i]);
        if (!store_has(s, path)) continue;
        status = read_attributes(s, path, &figures, error);
        json_object_set_new(all, lights[i], figures);
        if (status != LAM_OK) goto done;
    }
    json_object_set(made, "error", all);
    for (size_t i = 0; i < sizeof of_root / sizeof *of_root; i++) copy(provenance, of_root[i], root);
    copy(provenance, "geometry_hash", mesh);
    if (json_object_size(form_factors) > 0) json_object_set(provenance, "form_factors", form_factors);
    json_object_set(made, "provenance", provenance);
    char *written = json_dumps(made, JSON_COMPACT);
    if (written == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory to describe it", loaded->path);
    *text = written;
done:
    json_decref(made);
    json_decref(provenance);
    json_decref(root);
    json_decref(op);
    json_decref(mesh);
    json_decref(form_factors);
    json_decref(all);
    return status;
}
