/* Emitters are read from a file of emissions, made of groups that shine evenly, or are the tiles of the sky;
 * luminaires come behind them. */
#include "solver/precompute/emitter_list.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void emitter_list_free(emitter_list *list) {
    free(list->names);
    emission_free(&list->light);
    free(list->luminaires);
    free(list->factors);
    *list = (emitter_list){.s = 0};
}

/* Room for s names of at most `each` bytes. */
static lam_status reserve_names(size_t s, size_t each, emitter_list *list, lam_error *error) {
    list->names = memory_allocate(s, sizeof *list->names + each, "names of emitters", error);
    if (list->names == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < s; k++) list->names[k] = (char *)(list->names + s) + k * each;
    list->s = s;
    return LAM_OK;
}

static lam_status number_names(const char *what, size_t s, emitter_list *list, lam_error *error) {
    enum { EACH = 40 };
    const lam_status status = reserve_names(s, EACH, list, error);
    for (size_t k = 0; status == LAM_OK && k < s; k++) snprintf(list->names[k], EACH, "%s %zu", what, k);
    return status;
}

static lam_status read_sky(const mesh *m, size_t n_tiles, emitter_list *list, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = m->n_channels;
    if (n_tiles == 0)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--emitters sky: there is no sky; give --sky tregenza, reinhart:MF or grid:AxB too");
    TRY(number_names("tile", n_tiles, list, error));
    TRY(emission_allocate("--emitters sky", C, m->n, n_tiles, &list->light.E, error));
    TRY(emission_allocate("--emitters sky", C, n_tiles, n_tiles, &list->light.L, error));
    list->light.n_vectors = n_tiles;
    for (size_t t = 0; t < n_tiles; t++)
        for (size_t c = 0; c < C; c++) list->light.L[(t * C + c) * n_tiles + t] = 1;
done:
    return status;
}

/* names: NAME,NAME,... */
static lam_status read_groups(const char *names, const emission_scene *scene, emitter_list *list,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = scene->m;
    const size_t vector = m->n_channels * m->n;
    char what[240];
    size_t s = 1, longest = strlen(names) + 1, k = 0;
    for (const char *at = names; *at != '\0'; at++) s += *at == ',';
    snprintf(what, sizeof what, "--emitters group=%s", names);
    TRY(reserve_names(s, longest, list, error));
    TRY(emission_allocate("--emitters", m->n_channels, m->n, s, &list->light.E, error));
    list->light.n_vectors = s;
    for (const char *at = names; k < s; k++) {
        const size_t length = strcspn(at, ",");
        memcpy(list->names[k], at, length);
        TRY(emission_fill_group(scene, what, list->names[k], NULL, list->light.E + k * vector, error));
        at += length + 1;
    }
done:
    return status;
}

static bool is_lit(const emission *e, size_t k, size_t vector, size_t tiles) {
    for (size_t i = 0; i < vector; i++)
        if (e->E[k * vector + i] > 0) return true;
    for (size_t t = 0; e->L != NULL && t < tiles; t++)
        if (e->L[k * tiles + t] > 0) return true;
    return false;
}

static lam_status add_luminaires(size_t n_channels, const placed_luminaires *placed, emitter_list *list,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    const size_t k = placed->n;
    if (k == 0) return LAM_OK;
    list->luminaires = memory_allocate(k, sizeof *list->luminaires, "names of emitters", error);
    list->factors = memory_allocate(n_channels, k * sizeof *list->factors, "names of emitters", error);
    if (list->luminaires == NULL || list->factors == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t j = 0; j < k; j++) {
        const placed_luminaire *l = &placed->luminaires[j];
        list->luminaires[j] = l->name;
        for (size_t c = 0; c < n_channels; c++) list->factors[c * k + j] = n_channels == 1 ? 1 : l->colour[c];
        for (size_t e = 0; e < list->s; e++)
            if (strcmp(list->names[e], l->name) == 0)
                FAIL(error, LAM_ERR_ARGUMENT,
                     "--emitters: %.100s is the name of an emitter and of a luminaire, which are emitters "
                     "too; rename one of them, or leave out luminaires by --luminaires none",
                     l->name);
    }
    list->n_luminaires = k;
done:
    return status;
}

lam_status emitter_list_read(const char *text, const mesh *m, size_t n_tiles, const placed_luminaires *placed,
                             emitter_list *out, lam_error *error) {
    lam_status status = LAM_OK;
    emitter_list made = {.s = 0};
    emission_scene scene = {0};
    TRY(emission_scene_create(m, &scene, error));
    scene.n_tiles = n_tiles;
    if (strcmp(text, EMITTERS_LUMINAIRES) == 0) {
        if (placed->n == 0)
            FAIL(error, LAM_ERR_ARGUMENT,
                 "--emitters luminaires: there are none; give --luminaires FILE too");
    } else if (strcmp(text, "sky") == 0) {
        TRY(read_sky(m, n_tiles, &made, error));
    } else if (strncmp(text, "group=", 6) == 0) {
        TRY(read_groups(text + 6, &scene, &made, error));
    } else {
        TRY(emission_read(text, &scene, false, &made.light, error));
        TRY(number_names("emitter", made.light.n_vectors, &made, error));
    }
    for (size_t k = 0; k < made.s; k++)
        if (!is_lit(&made.light, k, m->n * m->n_channels, n_tiles * m->n_channels))
            FAIL(error, LAM_ERR_ARGUMENT, "--emitters %.200s: emitter %zu sends nothing out", text, k);
    TRY(add_luminaires(m->n_channels, placed, &made, error));
    *out = made;
    made = (emitter_list){.s = 0};
done:
    emission_scene_free(&scene);
    emitter_list_free(&made);
    return status;
}
