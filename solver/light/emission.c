#include "solver/light/emission.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void emission_free(emission *e) {
    free(e->E);
    free(e->L);
    free(e->W);
    free(e->D);
    *e = (emission){0};
}

lam_status emission_allocate(const char *path, size_t n_channels, size_t width, size_t n_vectors,
                             float **values, lam_error *error) {
    size_t count = 0;
    if (!size_multiply(width, n_channels, &count) || !size_multiply(count, n_vectors, &count))
        return status_fail(error, LAM_ERR_MEMORY, "%s: too many emissions for memory", path);
    *values = memory_allocate(count, sizeof **values, path, error);
    return *values == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

/* A copy of the mesh's names in one block, as a group_index owns them. */
static char **copy_names(const mesh *m, lam_error *error) {
    size_t bytes = m->n_groups * sizeof(char *);
    for (size_t g = 0; g < m->n_groups; g++) bytes += strlen(m->group_names[g]) + 1;
    char **names = memory_allocate(bytes, 1, "group names", error);
    if (names == NULL) return NULL;
    char *to = (char *)(names + m->n_groups);
    for (size_t g = 0; g < m->n_groups; g++) {
        names[g] = to;
        to = stpcpy(to, m->group_names[g]) + 1;
    }
    return names;
}

lam_status emission_scene_create(const mesh *m, emission_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    emission_scene made = {.m = m};
    char **names = copy_names(m, error);
    if (names == NULL) TRY(LAM_ERR_MEMORY);
    TRY(group_index_make(m->n, m->n_backs, m->group, m->n_groups, names, &made.groups, error));
    if (m->buried != NULL) {
        made.groups.buried = memory_allocate(m->n, sizeof *m->buried, "buried elements", error);
        if (made.groups.buried == NULL) TRY(LAM_ERR_MEMORY);
        memcpy(made.groups.buried, m->buried, m->n * sizeof *m->buried);
    }
    TRY(group_index_measure(&made.groups, m->area, error));
    *out = made;
    made = (emission_scene){.m = NULL};
done:
    emission_scene_free(&made);
    return status;
}

void emission_scene_free(emission_scene *scene) {
    group_index_free(&scene->groups);
    group_index_free(&scene->emitters);
    luminaire_names_free(&scene->names);
    *scene = (emission_scene){0};
}

lam_status emission_scene_sources(emission_scene *scene, const lam_operator *op, const lam_sky *sky,
                                  const lam_luminaires *luminaires, lam_error *error) {
    lam_status status = LAM_OK;
    scene->n_tiles = sky != NULL ? lam_sky_tiles(sky) : 0;
    scene->n_emitters = lam_operator_emitters(op);
    scene->luminaires = luminaires;
    TRY(luminaire_names_make(luminaires, &scene->names, error));
    TRY(group_index_of_emitters(op, &scene->emitters, error));
done:
    return status;
}

lam_status emission_fill_group(const emission_scene *scene, const char *what, const char *name,
                               const double *values, float *E, lam_error *error) {
    const group_index *groups = &scene->groups;
    const size_t n = scene->m->n, length = strlen(name);
    const uint32_t *found = NULL;
    const size_t n_found = group_index_find(groups, name, length, &found);
    char miss[GROUP_MISS];
    if (n_found == 0) {
        group_index_miss(groups, name, length, miss);
        return status_fail(error, LAM_ERR_ARGUMENT, "%.200s: the scene has %s", what, miss);
    }
    for (size_t k = 0; k < n_found; k++)
        for (uint32_t i = groups->start[found[k]]; i < groups->start[found[k] + 1]; i++)
            for (size_t c = 0; c < scene->m->n_channels; c++)
                E[c * n + groups->elements[i]] = values != NULL ? (float)values[c] : 1;
    return LAM_OK;
}

/* An item of --emit: the group's name, and numbers in a unit. */
typedef struct emit_item {
    char *name;
    double *values;
    size_t n;
    given_unit unit;
} emit_item;

static void item_free(emit_item *item) {
    free(item->name);
    free(item->values);
}

/* *out is freed by item_free, also after an error. */
static lam_status item_parse(const char *item, emit_item *out, lam_error *error) {
    lam_status status = LAM_OK;
    char what[128], *text = NULL;
    size_t most = 2;
    const char *equals = strrchr(item, '=');
    *out = (emit_item){.n = 0};
    if (equals == NULL || equals == item)
        FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: must be GROUP=V or GROUP=V,V,V, with or without a unit",
             item);
    for (const char *at = equals; *at != '\0'; at++) most += *at == ',';
    out->name = strndup(item, (size_t)(equals - item));
    text = strndup(equals + 1, given_unit_split(equals + 1, strlen(equals + 1), &out->unit));
    if (out->name == NULL || text == NULL) FAIL(error, LAM_ERR_MEMORY, "--emit %s: not enough memory", item);
    out->values = memory_allocate(most, sizeof *out->values, "--emit", error);
    if (out->values == NULL) TRY(LAM_ERR_MEMORY);
    if (text[strspn(text, "0123456789+-.,eE")] != '\0')
        FAIL(error, LAM_ERR_ARGUMENT,
             "--emit %s: must be numbers between commas, without a unit or in " GIVEN_UNIT_WORDS, item);
    snprintf(what, sizeof what, "--emit %s:", out->name);
    TRY(option_numbers(what, text, most, false, out->values, &out->n, error));
    for (size_t c = 0; c < out->n; c++)
        if (out->values[c] < 0 || out->values[c] > (double)FLT_MAX)
            FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: must be from 0 to %g", item, (double)FLT_MAX);
done:
    free(text);
    return status;
}

lam_status emission_check_items(const option_list *items, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t i = 0; status == LAM_OK && i < items->count; i++) {
        emit_item item;
        status = item_parse(items->items[i], &item, error);
        item_free(&item);
    }
    return status;
}

/* An emitter of this name: its weight in every channel; W is [C][s]. False where there is none. */
static bool fill_emitter(const emission_scene *scene, const char *name, const double *values, float *W) {
    const group_index *emitters = &scene->emitters;
    const uint32_t *found = NULL;
    const size_t n_found = group_index_find(emitters, name, strlen(name), &found);
    for (size_t k = 0; k < n_found; k++)
        for (size_t c = 0; c < scene->m->n_channels; c++)
            W[c * scene->n_emitters + found[k]] = (float)values[c];
    return n_found > 0;
}

/* One value for each channel, as exitances of the store's kind of light. Of a name that the scene does not
 * have the area is 0, and the name is refused later. */
static lam_status settle_values(const emission_scene *scene, const char *text, emit_item *item,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = scene->m->n_channels;
    const uint32_t *found = NULL;
    const size_t n_found = group_index_find(&scene->groups, item->name, strlen(item->name), &found);
    const double area = group_index_area(&scene->groups, n_found, found);
    const double each = given_unit_exitance(item->unit, area > 0 ? area : 1, scene->m->lights);
    double *values = memory_allocate(C, sizeof *values, "--emit", error);
    if (values == NULL) return LAM_ERR_MEMORY;
    if (item->n != 1 && item->n != C)
        FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: %zu values, must be 1 or one for each of %zu channels",
             text, item->n, C);
    for (size_t c = 0; c < C; c++) values[c] = item->values[item->n == 1 ? 0 : c] * each;
    for (size_t c = 0; c < C; c++)
        if (values[c] > (double)FLT_MAX)
            FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: is %g %s/m2, must be at most %g", text, values[c],
                 light_kind_word(scene->m->lights), (double)FLT_MAX);
    free(item->values);
    item->values = values;
    values = NULL;
done:
    free(values);
    return status;
}

lam_status emission_read_item(const emission_scene *scene, const char *text, char **name, double **values,
                              bool *converted, lam_error *error) {
    lam_status status = LAM_OK;
    emit_item item = {.n = 0};
    const uint32_t *found = NULL;
    TRY(item_parse(text, &item, error));
    if (item.unit != GIVEN_PLAIN && scene->n_emitters > 0 &&
        group_index_find(&scene->emitters, item.name, strlen(item.name), &found) > 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--emit %.200s: is an emitter of the store, whose weight has no unit",
             text);
    TRY(settle_values(scene, text, &item, error));
    *converted = *converted || given_unit_kind(item.unit, scene->m->lights) != scene->m->lights;
    *name = item.name;
    *values = item.values;
    item = (emit_item){.n = 0};
done:
    item_free(&item);
    return status;
}

/* Into E, or, of an emitter, into W, which is NULL where the store has none. */
static lam_status fill_item(const emission_scene *scene, const char *item, float *E, float *W,
                            bool *converted, lam_error *error) {
    lam_status status = LAM_OK;
    char what[240], *name = NULL;
    double *values = NULL;
    TRY(emission_read_item(scene, item, &name, &values, converted, error));
    snprintf(what, sizeof what, "--emit %s", item);
    if (W != NULL && fill_emitter(scene, name, values, W)) goto done;
    status = emission_fill_group(scene, what, name, values, E, error);
    if (status != LAM_OK && W != NULL) {
        char miss[GROUP_MISS];
        group_index_miss(&scene->emitters, name, strlen(name), miss);
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: the store has no such group and %s", what, miss);
    }
done:
    free(name);
    free(values);
    return status;
}

static lam_status one_vector(const mesh *m, float **E, lam_error *error) {
    return emission_allocate("emission", m->n_channels, m->n, 1, E, error);
}

lam_status emission_from_groups(const emission_scene *scene, const option_list *items, emission *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    float *E = NULL, *W = NULL;
    bool converted = false;
    TRY(one_vector(scene->m, &E, error));
    if (scene->n_emitters > 0)
        TRY(emission_allocate("emission", scene->m->n_channels, scene->n_emitters, 1, &W, error));
    for (size_t i = 0; i < items->count; i++) TRY(fill_item(scene, items->items[i], E, W, &converted, error));
    *out = (emission){.n_vectors = 1, .E = E, .W = W, .converted = converted};
    E = W = NULL;
done:
    free(E);
    free(W);
    return status;
}

lam_status emission_of_scene(const emission_scene *scene, emission *out, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = scene->m;
    emission made = {.n_vectors = 1};
    TRY(one_vector(m, &made.E, error));
    memcpy(made.E, m->emission, m->n * m->n_channels * sizeof *made.E);
    TRY(emission_dim_as_listed(scene, &made, error));
    *out = made;
    made = (emission){0};
done:
    emission_free(&made);
    return status;
}

lam_status emission_choose(const emission_scene *scene, const emission_options *options, emission *out,
                           bool *own, lam_error *error) {
    lam_status status = LAM_OK;
    emission e = {.n_vectors = 1};
    *own = options->items->count == 0 && options->path == NULL && options->frames == NULL &&
           options->sky == NULL && options->dims->count == 0 && !options->other;
    if (options->frames != NULL)
        TRY(emission_read_frames(options->frames, scene, &e, error));
    else if (*own)
        TRY(emission_of_scene(scene, &e, error));
    else if (options->items->count > 0)
        TRY(emission_from_groups(scene, options->items, &e, error));
    else if (options->path != NULL)
        TRY(emission_read(options->path, scene, options->signs, &e, error));
    else
        TRY(one_vector(scene->m, &e.E, error));
    e.lights = scene->m->lights;
    e.luminaires = scene->luminaires;
    if (options->dims->count > 0) TRY(emission_dim(scene, options->dims, &e, error));
    if (options->sky != NULL) TRY(emission_add_sky(&e, options->sky, scene, options->photometric, error));
    TRY(emission_part_luminaires(scene, &e, error));
    *out = e;
    e = (emission){0};
done:
    emission_free(&e);
    return status;
}
