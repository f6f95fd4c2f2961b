#include "solver/verbs/view_link.h"

#include "solver/base/file_stem.h"
#include "solver/base/photometry.h"
#include "solver/light/emission.h"
#include "solver/operator/luminaire_light.h"
#include "store/store.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The scene of a link. */
typedef struct linked_scene {
    char *name;
    mesh m;
    lam_luminaires *luminaires; /* NULL: the store has none */
    emission_scene of;
} linked_scene;

static void scene_free(linked_scene *s) {
    free(s->name);
    emission_scene_free(&s->of);
    lam_luminaires_close(s->luminaires);
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
    TRY(luminaires_load(s, out->m.n, out->m.n_channels, &out->luminaires, error));
    TRY(emission_scene_create(&out->m, &out->of, error));
    out->of.luminaires = out->luminaires;
    TRY(luminaire_names_make(out->luminaires, &out->of.names, error));
    out->name = given != NULL ? strdup(given) : file_stem(path);
    if (out->name == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", argument);
done:
    store_close(s);
    free(path);
    return status;
}

/* The luminance of values [C], and their colour, whose luminance is 1. */
static double luminance_and_colour(size_t n_channels, const double *values, double colour[3]) {
    const bool grey = n_channels != 3 || (values[0] == values[1] && values[1] == values[2]);
    const double luminance = grey ? values[0] : luminance_of(values[0], values[1], values[2]);
    for (int c = 0; c < 3; c++) colour[c] = grey || !(luminance > 0) ? 1 : values[c] / luminance;
    return luminance;
}

/* The light of a group as the page has it. */
static json_t *light_of(size_t n_channels, const double *values, bool on) {
    double colour[3];
    const double power = luminance_and_colour(n_channels, values, colour);
    return json_pack("{s:b, s:f, s:[f, f, f], s:n}", "on", (int)on, "power", power, "colour", colour[0],
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
    json_object_set_new(groups, name, light_of(s->m.n_channels, values, true));
done:
    free(name);
    free(values);
    return status;
}

/* The lamps of the scene that no item names: the page lights those that a link leaves out. */
static lam_status add_dark_lamps(const linked_scene *s, json_t *groups, lam_error *error) {
    const mesh *m = &s->m;
    const size_t C = m->n_channels;
    double *power = memory_allocate(m->n_groups, (C + 1) * sizeof *power, "the lamps of the scene", error);
    if (power == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < m->n_groups * (C + 1); k++) power[k] = 0;
    for (size_t i = 0; i < m->n; i++) {
        double *of = power + m->group[i] * (C + 1);
        of[C] += m->area[i];
        for (size_t c = 0; c < C; c++) of[c] += m->area[i] * (double)m->emission[c * m->n + i];
    }
    for (size_t g = 0; g < m->n_groups; g++) {
        double *of = power + g * (C + 1), sum = 0;
        for (size_t c = 0; c < C; c++) sum += of[c];
        for (size_t c = 0; c < C && of[C] > 0; c++) of[c] /= of[C];
        if (sum > 0 && json_object_get(groups, m->group_names[g]) == NULL)
            json_object_set_new(groups, m->group_names[g], light_of(C, of, false));
    }
    free(power);
    return LAM_OK;
}

/* Luminaire j under dimmers D [C][k], as the page has it: one that is dark keeps the dimmer of its list. */
static json_t *luminaire_of(const linked_scene *s, size_t j, const float *D) {
    const size_t C = s->m.n_channels, k = lam_luminaires_count(s->luminaires);
    double values[3] = {0}, tint[3];
    for (size_t c = 0; c < C && c < 3; c++) values[c] = (double)D[c * k + j];
    const bool on = values[0] > 0 || values[1] > 0 || values[2] > 0;
    const double dim = luminance_and_colour(C, values, tint);
    return json_pack("{s:b, s:f, s:[f, f, f], s:n}", "on", (int)on, "dim",
                     on ? dim : lam_luminaires_dimmer(s->luminaires, j), "tint", tint[0], tint[1], tint[2],
                     "kelvin");
}

/* One light in the place of those of its luminaires for each group where they are equal, so that the links of
 * large lists stay short: an argument of a program has at most 128 KiB. O(k). */
static lam_status join_groups(const lam_luminaires *l, json_t *luminaires, lam_error *error) {
    const size_t k = lam_luminaires_count(l), q = luminaires_groups(l);
    json_t **first = memory_allocate(q, sizeof *first, "the link", error);
    bool *differs = memory_allocate(q, sizeof *differs, "the link", error);
    const bool good = first != NULL && differs != NULL;
    for (size_t g = 0; good && g < q; g++) {
        first[g] = NULL;
        differs[g] = false;
    }
    for (size_t j = 0; good && j < k; j++) {
        const uint32_t g = luminaires_group_of(l, j);
        json_t *light = json_object_get(luminaires, lam_luminaires_name(l, j));
        if (g == LUMINAIRE_NO_GROUP) continue;
        if (first[g] == NULL) first[g] = json_incref(light);
        differs[g] = differs[g] || !json_equal(first[g], light);
    }
    for (size_t j = 0; good && j < k; j++) {
        const uint32_t g = luminaires_group_of(l, j);
        if (g != LUMINAIRE_NO_GROUP && !differs[g]) json_object_del(luminaires, lam_luminaires_name(l, j));
    }
    for (size_t g = 0; good && g < q; g++) {
        if (!differs[g] && first[g] != NULL)
            json_object_set(luminaires, luminaires_group_name(l, g), first[g]);
        json_decref(first[g]);
    }
    free(first);
    free(differs);
    return good ? LAM_OK : LAM_ERR_MEMORY;
}

/* The luminaires of the items dimmed, and all others dark; nothing where the store has none. */
static lam_status add_luminaires(const linked_scene *s, const option_list *dim, json_t *luminaires,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    emission e = {.n_vectors = 1};
    if (s->luminaires == NULL && dim->count == 0) return LAM_OK;
    TRY(emission_dim(&s->of, dim, &e, error));
    for (size_t j = 0; j < lam_luminaires_count(s->luminaires); j++)
        json_object_set_new(luminaires, lam_luminaires_name(s->luminaires, j), luminaire_of(s, j, e.D));
    TRY(join_groups(s->luminaires, luminaires, error));
done:
    emission_free(&e);
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

lam_status view_link(const char *argument, const option_list *emit, const option_list *dim, char **out,
                     lam_error *error) {
    lam_status status = LAM_OK;
    linked_scene s = {.name = NULL};
    json_t *groups = json_object(), *luminaires = json_object(), *state = NULL;
    char *text = NULL;
    if (emit->count == 0 && dim->count == 0) {
        *out = strdup("");
        if (*out == NULL) FAIL(error, LAM_ERR_MEMORY, "not enough memory for the link");
        goto done;
    }
    TRY(read_scene(argument, &s, error));
    for (size_t k = 0; k < emit->count; k++) TRY(add_item(&s, emit->items[k], groups, error));
    TRY(add_dark_lamps(&s, groups, error));
    TRY(add_luminaires(&s, dim, luminaires, error));
    state = json_pack("{s:s, s:{s:O, s:O}}", "scene", s.name, "lighting", "groups", groups, "luminaires",
                      luminaires);
    text = state != NULL ? json_dumps(state, JSON_COMPACT) : NULL;
    if (text == NULL) FAIL(error, LAM_ERR_FORMAT, "%s: a name of it is not UTF-8", argument);
    TRY(encode(text, out, error));
done:
    json_decref(groups);
    json_decref(luminaires);
    json_decref(state);
    free(text);
    scene_free(&s);
    return status;
}
