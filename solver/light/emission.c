#include "solver/light/emission.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The command line has three; a store may hold more bands. */
enum { EMISSION_MAX_CHANNELS = 16 };

void emission_free(emission *e) {
    free(e->E);
    free(e->L);
    free(e->W);
    *e = (emission){0};
}

static bool is_material_of(const char *group, const char *object) {
    size_t length = strlen(object);
    return strncmp(group, object, length) == 0 && group[length] == '.';
}

size_t emission_match_groups(const mesh *m, const char *name, void (*visit)(void *context, size_t group),
                             void *context) {
    size_t found = 0;
    for (size_t g = 0; g < m->n_groups; g++)
        if (strcmp(m->group_names[g], name) == 0) {
            visit(context, g);
            found++;
        }
    if (found > 0) return found;
    for (size_t g = 0; g < m->n_groups; g++)
        if (is_material_of(m->group_names[g], name)) {
            visit(context, g);
            found++;
        }
    return found;
}

typedef struct filling {
    const mesh *m;
    const double *values; /* [C] */
    float *E;             /* [C][n] */
} filling;

static void fill_group(void *context, size_t group) {
    const filling *f = context;
    for (size_t c = 0; c < f->m->n_channels; c++)
        for (size_t i = 0; i < f->m->n; i++)
            if (f->m->group[i] == group) f->E[c * f->m->n + i] = (float)f->values[c];
}

/* What an item says: the group's name (the caller frees it) and its values. */
static lam_status item_parse(const char *item, char **name, double values[EMISSION_MAX_CHANNELS],
                             size_t *found, lam_error *error) {
    lam_status status = LAM_OK;
    char what[128];
    char *before = NULL;
    const char *equals = strrchr(item, '=');
    if (equals == NULL || equals == item)
        FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: must be GROUP=V or GROUP=V,V,V", item);
    before = strndup(item, (size_t)(equals - item));
    if (before == NULL) FAIL(error, LAM_ERR_MEMORY, "--emit %s: not enough memory", item);
    snprintf(what, sizeof what, "--emit %s:", before);
    TRY(option_numbers(what, equals + 1, EMISSION_MAX_CHANNELS, false, values, found, error));
    for (size_t c = 0; c < *found; c++)
        if (values[c] < 0 || values[c] > (double)FLT_MAX)
            FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: must be from 0 to %g", item, (double)FLT_MAX);
    *name = before;
    before = NULL;
done:
    free(before);
    return status;
}

lam_status emission_check_items(const option_list *items, lam_error *error) {
    lam_status status = LAM_OK;
    double values[EMISSION_MAX_CHANNELS];
    size_t found = 0;
    for (size_t i = 0; i < items->count; i++) {
        char *name = NULL;
        TRY(item_parse(items->items[i], &name, values, &found, error));
        free(name);
    }
done:
    return status;
}

/* The first group names, for a message. */
static void list_groups(const mesh *m, char *known, size_t size) {
    size_t length = 0;
    known[0] = '\0';
    for (size_t g = 0; g < m->n_groups; g++) {
        const size_t more = strlen(m->group_names[g]) + 1;
        if (length + more + sizeof " ..." > size) {
            strcpy(known + length, " ...");
            return;
        }
        known[length] = ' ';
        strcpy(known + length + 1, m->group_names[g]);
        length += more;
    }
}

static lam_status fill_item(const mesh *m, const char *item, float *E, lam_error *error) {
    lam_status status = LAM_OK;
    double values[EMISSION_MAX_CHANNELS];
    size_t found = 0;
    char known[200];
    char *name = NULL;
    TRY(item_parse(item, &name, values, &found, error));
    if (found != 1 && found != m->n_channels)
        FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: %zu values, must be 1 or one for each of %zu channels",
             item, found, m->n_channels);
    for (size_t c = found; c < m->n_channels; c++) values[c] = values[0];
    filling f = {m, values, E};
    if (emission_match_groups(m, name, fill_group, &f) == 0) {
        list_groups(m, known, sizeof known);
        FAIL(error, LAM_ERR_ARGUMENT, "--emit %s: no group of this name; there are:%s", item, known);
    }
done:
    free(name);
    return status;
}

static lam_status one_vector(const mesh *m, float **E, lam_error *error) {
    size_t count = 0;
    if (!size_multiply(m->n, m->n_channels, &count))
        return status_fail(error, LAM_ERR_MEMORY, "emission: too large");
    *E = memory_allocate(count, sizeof **E, "emission", error);
    return *E == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

lam_status emission_from_groups(const mesh *m, const option_list *items, emission *out, lam_error *error) {
    lam_status status = LAM_OK;
    float *E = NULL;
    if (m->n_channels > EMISSION_MAX_CHANNELS)
        FAIL(error, LAM_ERR_UNSUPPORTED, "--emit: %zu channels, at most %d are supported", m->n_channels,
             EMISSION_MAX_CHANNELS);
    TRY(one_vector(m, &E, error));
    for (size_t i = 0; i < items->count; i++) TRY(fill_item(m, items->items[i], E, error));
    *out = (emission){.n_vectors = 1, .E = E};
    E = NULL;
done:
    free(E);
    return status;
}

lam_status emission_of_scene(const mesh *m, emission *out, lam_error *error) {
    lam_status status = LAM_OK;
    float *E = NULL;
    TRY(one_vector(m, &E, error));
    memcpy(E, m->emission, m->n * m->n_channels * sizeof *E);
    *out = (emission){.n_vectors = 1, .E = E};
done:
    return status;
}

emission_sources emission_sources_of(const lam_operator *op, const lam_sky *sky) {
    return (emission_sources){.n_tiles = sky != NULL ? lam_sky_tiles(sky) : 0,
                              .n_emitters = lam_operator_emitters(op)};
}

lam_status emission_choose(const mesh *m, emission_sources there, const emission_wish *wish, emission *out,
                           bool *own, lam_error *error) {
    lam_status status = LAM_OK;
    emission e = {.n_vectors = 1};
    *own = wish->items->count == 0 && wish->path == NULL && wish->sky == NULL && !wish->other;
    if (*own)
        TRY(emission_of_scene(m, &e, error));
    else if (wish->items->count > 0)
        TRY(emission_from_groups(m, wish->items, &e, error));
    else if (wish->path != NULL)
        TRY(emission_read(wish->path, m, there, &e, error));
    else
        TRY(one_vector(m, &e.E, error));
    if (wish->sky != NULL) TRY(emission_add_sky(&e, wish->sky, m, there.n_tiles, error));
    *out = e;
    e = (emission){0};
done:
    emission_free(&e);
    return status;
}
