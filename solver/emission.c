#include "solver/emission.h"

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
    *own = wish->items->count == 0 && wish->path == NULL && wish->sky == NULL;
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

/* Chosen numbers of so many rows to their elements. */
static void scatter(size_t n_rows, size_t n, size_t n_selected, const uint32_t *selected, const float *from,
                    float *to) {
    for (size_t row = 0; row < n_rows; row++)
        for (size_t r = 0; r < n_selected; r++) to[row * n + selected[r]] = from[row * n_selected + r];
}

/* The weights of vectors first ... first + n - 1: those given and those told from E and L. */
static lam_status find_weights(const emission *e, const lam_operator *op, const lam_sky *sky, size_t first,
                               size_t n, float *W, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = lam_operator_channels(op), s = lam_operator_emitters(op);
    const size_t n_tiles = sky != NULL ? lam_sky_tiles(sky) : 0;
    TRY(lam_operator_weights(op, n, e->E + first * C * lam_operator_elements(op), n_tiles,
                             e->L != NULL ? e->L + first * C * n_tiles : NULL, W, error));
    for (size_t k = 0; e->W != NULL && k < n * C * s; k++) W[k] += e->W[first * C * s + k];
done:
    return status;
}

lam_status emission_apply(const emission *e, const lam_operator *op, const lam_sky *sky,
                          lam_quantity quantity, size_t n_selected, const uint32_t *selected,
                          lam_status (*stop)(lam_error *error), float **values, lam_error *error) {
    enum { AT_ONCE = 64 }; /* vectors in one pass */
    lam_status status = LAM_OK;
    const size_t n_channels = lam_operator_channels(op), vector = lam_operator_elements(op) * n_channels;
    const size_t most = e->n_vectors < AT_ONCE ? e->n_vectors : AT_ONCE;
    const size_t bytes = lam_operator_work_bytes(op, most);
    void *work = NULL;
    const size_t s = lam_operator_emitters(op);
    float *made = NULL, *H0 = NULL, *some = NULL, *W = NULL;
    size_t count;
    if (!size_multiply(vector, e->n_vectors, &count))
        FAIL(error, LAM_ERR_MEMORY, "%zu emissions are too many for memory", e->n_vectors);
    made = memory_allocate(count, sizeof *made, "the solution", error);
    work = memory_allocate(bytes, 1, "the work area of a solve", error);
    if (made == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    if (selected != NULL) {
        some = memory_allocate(n_selected * n_channels, most * sizeof *some, "the solution", error);
        if (some == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (s > 0) {
        W = memory_allocate(most * n_channels, s * sizeof *W, "weights of emitters", error);
        if (W == NULL) TRY(LAM_ERR_MEMORY);
    } else if (e->L != NULL) {
        H0 = memory_allocate(vector, most * sizeof *H0, "the light of the sky", error);
        if (H0 == NULL) TRY(LAM_ERR_MEMORY);
    }
    for (size_t first = 0; first < e->n_vectors; first += most) {
        const size_t n = e->n_vectors - first < most ? e->n_vectors - first : most;
        if (s > 0) TRY(find_weights(e, op, sky, first, n, W, error));
        if (H0 != NULL)
            lam_sky_irradiance(sky, n * n_channels, e->L + first * n_channels * lam_sky_tiles(sky), H0);
        if (s > 0) {
            TRY(lam_operator_apply_emitters(op, n, quantity, W, n_selected, selected,
                                            selected != NULL ? some : made + first * vector, work, bytes,
                                            error));
        } else if (selected == NULL) {
            TRY(lam_operator_apply_lit(op, n, quantity, e->E + first * vector, H0, made + first * vector,
                                       work, bytes, error));
        } else {
            TRY(lam_operator_apply_selected(op, n, quantity, e->E + first * vector, H0, n_selected, selected,
                                            some, work, bytes, error));
        }
        if (selected != NULL)
            scatter(n * n_channels, vector / n_channels, n_selected, selected, some, made + first * vector);
        if (stop != NULL) TRY(stop(error));
    }
    *values = made;
    made = NULL;
done:
    free(made);
    free(work);
    free(some);
    free(W);
    free(H0);
    return status;
}
