#include "solver/verbs/view_link.h"

#include "solver/base/file_stem.h"
#include "solver/base/photometry.h"
#include "store/groups.h"
#include "store/store.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The scene of a link. */
typedef struct linked_scene {
    char *name;
    char **groups;
    size_t n_groups, n_channels;
} linked_scene;

static void scene_free(linked_scene *s) {
    free(s->name);
    free(s->groups);
}

/* Opens STORE.h5, or STORE.h5:NAME where no file has that name. */
static lam_status read_scene(const char *argument, linked_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    size_t dims[STORE_MAX_RANK];
    store_type type;
    int rank;
    char *path = strdup(argument), *given = NULL;
    if (path == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", argument);
    char *colon = strrchr(path, ':');
    if (colon != NULL && colon[1] != '\0' && strchr(colon, '/') == NULL && access(path, F_OK) != 0) {
        *colon = '\0';
        given = colon + 1;
    }
    TRY(store_open(path, &s, error));
    TRY(store_read_texts(s, STORE_MESH "/group_names", &out->n_groups, &out->groups, error));
    TRY(store_array_info(s, STORE_MESH "/reflectance", &type, &rank, dims, error));
    out->n_channels = dims[0];
    out->name = given != NULL ? strdup(given) : file_stem(path);
    if (out->name == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", argument);
done:
    store_close(s);
    free(path);
    return status;
}

/* A light as the page has it: its luminance, and a colour whose luminance is 1. */
static json_t *light_of(size_t count, const double values[3]) {
    const double luminance = count == 3 ? luminance_of(values[0], values[1], values[2]) : values[0];
    double colour[3] = {1, 1, 1};
    for (int c = 0; c < 3 && count == 3 && luminance > 0; c++) colour[c] = values[c] / luminance;
    return json_pack("{s:b, s:f, s:[f, f, f], s:n}", "on", 1, "power", luminance, "colour", colour[0],
                     colour[1], colour[2], "kelvin");
}

static lam_status add_item(const linked_scene *s, const char *item, json_t *groups, lam_error *error) {
    lam_status status = LAM_OK;
    const char *equals = strrchr(item, '=');
    double values[3];
    size_t count = 0, g = 0;
    if (equals == NULL) FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: must be GROUP=V or GROUP=V,V,V", item);
    const size_t length = (size_t)(equals - item);
    while (g < s->n_groups && (strlen(s->groups[g]) != length || memcmp(s->groups[g], item, length) != 0))
        g++;
    if (g == s->n_groups)
        FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: %s has no group '%.*s'", item, s->name, (int)length, item);
    TRY(option_numbers("--emit", equals + 1, 3, false, values, &count, error));
    for (size_t k = 0; k < count; k++)
        if (!(values[k] >= 0)) FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: must not be negative", item);
    if (count == 2 || (count == 3 && s->n_channels != 3))
        FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: %zu values, %s has %zu channel%s", item, count, s->name,
             s->n_channels, s->n_channels == 1 ? "" : "s");
    json_object_set_new(groups, s->groups[g], light_of(count, values));
done:
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
