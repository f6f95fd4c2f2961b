/* Dimmers of a command line, --dim NAME=V, and those of the list of luminaires. */
#include "solver/light/emission.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DIM_TEXT = 240 };

/* The end of the name of an item, and its values, 1 or several. */
static lam_status parse_item(const char *item, size_t *length, double *values, size_t most, size_t *n,
                             lam_error *error) {
    lam_status status = LAM_OK;
    char what[DIM_TEXT];
    const char *equals = strrchr(item, '=');
    if (equals == NULL || equals == item)
        FAIL(error, LAM_ERR_ARGUMENT, "--dim %.200s: must be NAME=V or NAME=V,V,V", item);
    if (equals[1 + strspn(equals + 1, "0123456789+-.,eE")] != '\0')
        FAIL(error, LAM_ERR_ARGUMENT,
             "--dim %.200s: must be numbers between commas, without a unit: 1 is the full light of a "
             "luminaire",
             item);
    *length = (size_t)(equals - item);
    snprintf(what, sizeof what, "--dim %.*s:", (int)(*length < 200 ? *length : 200), item);
    TRY(option_numbers(what, equals + 1, most, false, values, n, error));
    for (size_t c = 0; c < *n; c++)
        if (values[c] < 0 || values[c] > (double)FLT_MAX)
            FAIL(error, LAM_ERR_ARGUMENT, "--dim %.200s: must be from 0 to %g", item, (double)FLT_MAX);
done:
    return status;
}

enum { CHANNELS_MOST = 3 };

lam_status emission_check_dims(const option_list *items, lam_error *error) {
    lam_status status = LAM_OK;
    double values[CHANNELS_MOST];
    size_t length = 0, n = 0;
    for (size_t i = 0; i < items->count; i++)
        TRY(parse_item(items->items[i], &length, values, CHANNELS_MOST, &n, error));
done:
    return status;
}

static lam_status dim_item(const emission_scene *scene, const char *item, float *D, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = scene->m->n_channels, k = lam_luminaires_count(scene->luminaires);
    double values[CHANNELS_MOST];
    const uint32_t *found = NULL;
    size_t length = 0, n = 0;
    char miss[GROUP_MISS];
    TRY(parse_item(item, &length, values, CHANNELS_MOST, &n, error));
    if (n != 1 && n != C)
        FAIL(error, LAM_ERR_ARGUMENT, "--dim %.200s: %zu values, must be 1 or one for each of %zu channels",
             item, n, C);
    const size_t n_found = luminaire_names_find(&scene->names, item, length, &found);
    if (n_found == 0) {
        luminaire_names_miss(&scene->names, item, length, miss);
        FAIL(error, LAM_ERR_ARGUMENT, "--dim %.200s: the store has %s", item, miss);
    }
    for (size_t f = 0; f < n_found; f++)
        for (size_t c = 0; c < C; c++) D[c * k + found[f]] = (float)values[n == 1 ? 0 : c];
done:
    return status;
}

static lam_status reserve(const emission_scene *scene, float **D, lam_error *error) {
    return emission_allocate("dimmers", scene->m->n_channels, lam_luminaires_count(scene->luminaires), 1, D,
                             error);
}

lam_status emission_dim(const emission_scene *scene, const option_list *items, emission *e,
                        lam_error *error) {
    lam_status status = LAM_OK;
    float *D = NULL;
    if (scene->luminaires == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--dim %.200s: the store has no luminaires; precompute it with --luminaires", items->items[0]);
    if (e->D != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "--dim %.200s: the emission has luminaires of its own",
             items->items[0]);
    TRY(reserve(scene, &D, error));
    for (size_t i = 0; i < items->count; i++) TRY(dim_item(scene, items->items[i], D, error));
    if (e->n_vectors > 1 && !e->steady) {
        const size_t row = scene->m->n_channels * lam_luminaires_count(scene->luminaires);
        TRY(emission_allocate("dimmers", scene->m->n_channels, lam_luminaires_count(scene->luminaires),
                              e->n_vectors, &e->D, error));
        for (size_t v = 0; v < e->n_vectors; v++) memcpy(e->D + v * row, D, row * sizeof *D);
    } else {
        e->D = D;
        D = NULL;
    }
    e->luminaires = scene->luminaires;
done:
    free(D);
    return status;
}

lam_status emission_part_luminaires(const emission_scene *scene, emission *e, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t s = scene->n_emitters, k = luminaire_names_count(&scene->names), C = scene->m->n_channels;
    const size_t rows = (e->steady ? 1 : e->n_vectors) * C;
    bool any = false;
    for (size_t w = 0; e->W != NULL && w < rows * s; w++) any = any || (w % s >= s - k && e->W[w] != 0);
    if (!any) return LAM_OK;
    if (e->D == NULL) TRY(emission_allocate("dimmers", C, k, rows / C, &e->D, error));
    for (size_t row = 0; row < rows; row++)
        for (size_t j = 0; j < k; j++) {
            e->D[row * k + j] += e->W[row * s + s - k + j];
            e->W[row * s + s - k + j] = 0;
        }
    e->luminaires = scene->luminaires;
done:
    return status;
}

lam_status emission_dim_as_listed(const emission_scene *scene, emission *e, lam_error *error) {
    lam_status status = LAM_OK;
    if (scene->luminaires == NULL) return LAM_OK;
    const size_t k = lam_luminaires_count(scene->luminaires);
    TRY(reserve(scene, &e->D, error));
    for (size_t c = 0; c < scene->m->n_channels; c++)
        for (size_t j = 0; j < k; j++) e->D[c * k + j] = (float)lam_luminaires_dimmer(scene->luminaires, j);
    e->luminaires = scene->luminaires;
done:
    return status;
}

bool emission_is_dark(const emission *e, size_t n, size_t n_channels, size_t n_vectors) {
    const size_t dimmers = e->D == NULL ? 0 : n_channels * lam_luminaires_count(e->luminaires);
    for (size_t i = 0; i < n_vectors * n_channels * n; i++)
        if (e->E[i] != 0) return false;
    for (size_t k = 0; k < dimmers; k++)
        if (e->D[k] != 0) return false;
    return true;
}
