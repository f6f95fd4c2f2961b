#include "solver/verbs/view_link.h"

#include "solver/base/file_stem.h"
#include "solver/base/photometry.h"
#include "solver/light/emission.h"
#include "store/store.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The scene of a link. */
typedef struct linked_scene {
    char *name;
    mesh m;
    emission_scene of;
} linked_scene;

static void scene_free(linked_scene *s) {
    free(s->name);
    emission_scene_free(&s->of);
    mesh_free(&s->m);
}

/* Opens STORE.h5, or STORE.h5:NAME where no file has that name. */
static lam_status read_scene(const char *argument, linked_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    char *path = strdup(argument), *given = NULL;
    if (path == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", argument);
    char *colon = strrchr(path, ':');
    if (colon != NULL && colon[1] != '\0' && strchr(colon, '/') == NULL && access(path, F_OK) != 0) {
        *colon = '\0';
        given = colon + 1;
    }
    TRY(store_open(path, &s, error));
    TRY(mesh_load(s, &out->m, NULL, error));
    TRY(emission_scene_create(&out->m, &out->of, error));
    out->name = given != NULL ? strdup(given) : file_stem(path);
    if (out->name == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", argument);
done:
    store_close(s);
    free(path);
    return status;
}

/* A light as the page has it: its luminance, and a colour whose luminance is 1. */
static json_t *light_of(size_t n_channels, const double *values) {
    const bool grey = n_channels != 3 || (values[0] == values[1] && values[1] == values[2]);
    const double luminance = grey ? values[0] : luminance_of(values[0], values[1], values[2]);
    double colour[3] = {1, 1, 1};
    for (int c = 0; c < 3 && !grey && luminance > 0; c++) colour[c] = values[c] / luminance;
    return json_pack("{s:b, s:f, s:[f, f, f], s:n}", "on", 1, "power", luminance, "colour", colour[0],
                     colour[1], colour[2], "kelvin");
}

static lam_status add_item(const linked_scene *s, const char *item, json_t *groups, lam_error *error) {
    lam_status status = LAM_OK;
    char *name = NULL;
    double *values = NULL;
    bool converted = false;
    size_t g = 0;
    TRY(emission_read_item(&s->of, item, &name, &values, &converted, error));
    while (g < s->m.n_groups && strcmp(s->m.group_names[g], name) != 0) g++;
    if (g == s->m.n_groups)
        FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: %s has no group '%s'", item, s->name, name);
    json_object_set_new(groups, name, light_of(s->m.n_channels, values));
done:
    free(name);
    free(values);
    return status;
}

/* "#1." and base64url without padding, RFC 4648. */
static lam_status encode(const char *text, char **out, lam_error *error) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    const size_t length = strlen(text);
    char *made = memory_allocate(length / 3 * 4 + 8, 1, "the link", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    char *to = stpcpy(made, "#1.");
    for (size_t at = 0; at < length; at += 3) {
        const size_t now = length - at < 3 ? length - at : 3;
        uint32_t bits = 0;
        for (size_t k = 0; k < 3; k++) bits = bits << 8 | (k < now ? (unsigned char)text[at + k] : 0);
        for (size_t k = 0; k <= now; k++) *to++ = digits[bits >> (18 - 6 * k) & 63];
    }
    *to = '\0';
    *out = made;
    return LAM_OK;
}

lam_status view_link(const char *argument, const option_list *emit, char **out, lam_error *error) {
    lam_status status = LAM_OK;
    linked_scene s = {.name = NULL};
    json_t *groups = json_object(), *state = NULL;
    char *text = NULL;
    if (emit->count == 0) {
        *out = strdup("");
        if (*out == NULL) FAIL(error, LAM_ERR_MEMORY, "not enough memory for the link");
        goto done;
    }
    TRY(read_scene(argument, &s, error));
    for (size_t k = 0; k < emit->count; k++) TRY(add_item(&s, emit->items[k], groups, error));
    state = json_pack("{s:s, s:{s:O}}", "scene", s.name, "lighting", "groups", groups);
    text = state != NULL ? json_dumps(state, JSON_COMPACT) : NULL;
    if (text == NULL) FAIL(error, LAM_ERR_FORMAT, "%s: a name of it is not UTF-8", argument);
    TRY(encode(text, out, error));
done:
    json_decref(groups);
    json_decref(state);
    free(text);
    scene_free(&s);
    return status;
}
