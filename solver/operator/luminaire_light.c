#include "solver/operator/luminaire_light.h"

#include "solver/operator/first_rows.h"
#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Numbers of an opening: its shape, its size and the heights of its sides. */
enum { OPENING = 8 };

struct lam_luminaires {
    size_t k, C;
    first_rows rows; /* irradiance, lx */
    char **names;    /* [k], one block */
    size_t n_groups;
    char **group_names;               /* [n_groups], one block */
    uint32_t *group;                  /* [k] */
    double *dimmers, *lumens;         /* [k] */
    double *colour;                   /* [k][3] */
    double *factors;                  /* [C][k], of the channels */
    double *place, *opening;          /* [k][12]: at, x, y, z; [k][8]: shape, size, sides */
    size_t n_error_groups;            /* of the scene */
    double *elements_off, *means_off; /* [k][n_error_groups] */
};

void lam_luminaires_close(lam_luminaires *l) {
    if (l == NULL) return;
    first_rows_free(&l->rows);
    free(l->names);
    free(l->group_names);
    free(l->group);
    free(l->dimmers);
    free(l->lumens);
    free(l->colour);
    free(l->factors);
    free(l->place);
    free(l->opening);
    free(l->elements_off);
    free(l->means_off);
    free(l);
}

/* Reads numbers [k], or [k][width] where width is not 0, which are finite, and not negative if so asked. */
static lam_status read_numbers(store *s, const char *name, size_t k, size_t width, bool sign, double **out,
                               lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    size_t dims[STORE_MAX_RANK] = {k, width};
    TRY(store_read(s, name, STORE_F64, width == 0 ? 1 : 2, dims, &data, error));
    *out = data;
    for (size_t i = 0; i < k * (width == 0 ? 1 : width); i++)
        if (!isfinite((*out)[i]) || (!sign && (*out)[i] < 0))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %g, must be %s", store_path(s), name, i, (*out)[i],
                 sign ? "a number" : "at least 0");
done:
    return status;
}

static int by_text(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* A name stands for one luminaire. */
static lam_status check_names(store *s, const lam_luminaires *l, lam_error *error) {
    lam_status status = LAM_OK;
    const char **sorted = memory_allocate(l->k, sizeof *sorted, "luminaires", error);
    if (sorted == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < l->k; k++) sorted[k] = l->names[k];
    qsort(sorted, l->k, sizeof *sorted, by_text);
    for (size_t k = 1; k < l->k; k++)
        if (strcmp(sorted[k - 1], sorted[k]) == 0)
            FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/names has %.60s twice", store_path(s), sorted[k]);
done:
    free(sorted);
    return status;
}

static lam_status read_names(store *s, lam_luminaires *l, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    void *data = NULL;
    TRY(store_read_texts(s, STORE_LUMINAIRES "/names", &count, &l->names, error));
    if (count != l->k)
        FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/names has %zu names, must have %zu, as the irradiance",
             store_path(s), count, l->k);
    TRY(check_names(s, l, error));
    if (!store_has(s, STORE_LUMINAIRES "/group_names")) goto done;
    TRY(store_read_texts(s, STORE_LUMINAIRES "/group_names", &l->n_groups, &l->group_names, error));
    TRY(store_read(s, STORE_LUMINAIRES "/group", STORE_U32, 1, (size_t[]){l->k}, &data, error));
    l->group = data;
    for (size_t k = 0; k < l->k; k++)
        if (l->group[k] >= l->n_groups && l->group[k] != LUMINAIRE_NO_GROUP)
            FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/group[%zu] = %u, must be below %zu", store_path(s),
                 k, (unsigned)l->group[k], l->n_groups);
done:
    return status;
}

/* [k][OPENING], of which the first is a shape. */
static lam_status read_opening(store *s, lam_luminaires *l, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(read_numbers(s, STORE_LUMINAIRES "/opening", l->k, OPENING, false, &l->opening, error));
    for (size_t k = 0; k < l->k; k++) {
        const double shape = l->opening[k * OPENING];
        if (!(shape < LUMINAIRE_SHAPES && shape == floor(shape)))
            FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/opening[%zu][0] = %g, must be an integer below %d",
                 store_path(s), k, shape, LUMINAIRE_SHAPES);
    }
done:
    return status;
}

static lam_status read_errors(store *s, lam_luminaires *l, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK];
    store_type type;
    int rank;
    const char *name = STORE_LUMINAIRES "/elements_off";
    if (!store_has(s, name)) goto done;
    TRY(store_array_info(s, name, &type, &rank, dims, error));
    if (rank != 2 || dims[0] != l->k || dims[1] == 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s must be of %zu rows", store_path(s), name, l->k);
    l->n_error_groups = dims[1];
    TRY(read_numbers(s, name, l->k, dims[1], false, &l->elements_off, error));
    TRY(read_numbers(s, STORE_LUMINAIRES "/means_off", l->k, dims[1], false, &l->means_off, error));
done:
    return status;
}

lam_status luminaires_load(store *s, size_t n, size_t C, lam_luminaires **out, lam_error *error) {
    lam_status status = LAM_OK;
    lam_luminaires *l = NULL;
    if (!store_has(s, STORE_LUMINAIRES)) {
        *out = NULL;
        return LAM_OK;
    }
    l = memory_allocate(1, sizeof *l, "luminaires", error);
    if (l == NULL) TRY(LAM_ERR_MEMORY);
    TRY(first_rows_load(s, STORE_LUMINAIRES "/irradiance", "luminaire", n, NULL, &l->rows, error));
    const size_t k = l->k = l->rows.m;
    l->C = C;
    TRY(read_names(s, l, error));
    TRY(read_numbers(s, STORE_LUMINAIRES "/dimmers", k, 0, false, &l->dimmers, error));
    TRY(read_numbers(s, STORE_LUMINAIRES "/lumens", k, 0, false, &l->lumens, error));
    TRY(read_numbers(s, STORE_LUMINAIRES "/colour", k, 3, false, &l->colour, error));
    TRY(read_numbers(s, STORE_LUMINAIRES "/place", k, 12, true, &l->place, error));
    TRY(read_opening(s, l, error));
    TRY(read_errors(s, l, error));
    l->factors = memory_allocate(C, k * sizeof *l->factors, "luminaires", error);
    if (l->factors == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < C; c++)
        for (size_t j = 0; j < k; j++) l->factors[c * k + j] = C == 1 ? 1 : l->colour[j * 3 + c];
    *out = l;
    l = NULL;
done:
    lam_luminaires_close(l);
    return status;
}

lam_status luminaires_create(size_t k, size_t n, size_t C, const float *irradiance, const double *factors,
                             lam_luminaires **out, lam_error *error) {
    lam_status status = LAM_OK;
    lam_luminaires *l = memory_allocate(1, sizeof *l, "luminaires", error);
    if (l == NULL) TRY(LAM_ERR_MEMORY);
    l->k = k;
    l->C = C;
    TRY(first_rows_copy(k, n, irradiance, &l->rows, error));
    l->factors = memory_allocate(C, k * sizeof *l->factors, "luminaires", error);
    if (l->factors == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(l->factors, factors, C * k * sizeof *factors);
    *out = l;
    l = NULL;
done:
    lam_luminaires_close(l);
    return status;
}

lam_status lam_luminaires_open(const char *path, lam_luminaires **luminaires, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    store_type type;
    int rank;
    size_t dims[STORE_MAX_RANK];
    if (path == NULL || luminaires == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "a path and a place for the luminaires are needed");
    TRY(store_open(path, &s, error));
    TRY(store_array_info(s, STORE_MESH "/reflectance", &type, &rank, dims, error));
    if (rank != 2)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/reflectance has %d dimensions, must have 2", store_path(s),
             rank);
    TRY(luminaires_load(s, dims[1], dims[0], luminaires, error));
done:
    store_close(s);
    return status;
}

size_t lam_luminaires_count(const lam_luminaires *l) {
    return l->k;
}

size_t lam_luminaires_channels(const lam_luminaires *l) {
    return l->C;
}

size_t lam_luminaires_elements(const lam_luminaires *l) {
    return l->rows.n;
}

const char *lam_luminaires_name(const lam_luminaires *l, size_t luminaire) {
    return l->names[luminaire];
}

double lam_luminaires_dimmer(const lam_luminaires *l, size_t luminaire) {
    return l->dimmers[luminaire];
}

luminaire_shown luminaires_shown(const lam_luminaires *l, size_t luminaire) {
    const uint32_t group = luminaires_group_of(l, luminaire);
    const double *place = l->place + luminaire * 12, *opening = l->opening + luminaire * OPENING;
    luminaire_shown out = {.name = l->names[luminaire],
                           .group = group == LUMINAIRE_NO_GROUP ? NULL : l->group_names[group],
                           .dimmer = l->dimmers[luminaire],
                           .lumens = l->lumens[luminaire],
                           .shape = (luminaire_shape)opening[0]};
    memcpy(out.at, place, sizeof out.at);
    memcpy(out.x, place + 3, sizeof out.x);
    memcpy(out.y, place + 6, sizeof out.y);
    memcpy(out.z, place + 9, sizeof out.z);
    memcpy(out.colour, l->colour + luminaire * 3, sizeof out.colour);
    memcpy(out.size, opening + 1, sizeof out.size);
    return out;
}

size_t luminaires_groups(const lam_luminaires *l) {
    return l->n_groups;
}

const char *luminaires_group_name(const lam_luminaires *l, size_t group) {
    return l->group_names[group];
}

uint32_t luminaires_group_of(const lam_luminaires *l, size_t luminaire) {
    return l->group == NULL ? LUMINAIRE_NO_GROUP : l->group[luminaire];
}

static row_factors factors_of(const lam_luminaires *l) {
    return (row_factors){.n_channels = l->C, .values = l->factors};
}

void lam_luminaires_irradiance(const lam_luminaires *l, size_t n_rhs, const float *D, float *H0) {
    const row_factors f = factors_of(l);
    first_rows_apply(&l->rows, n_rhs * l->C, D, &f, true, H0);
}

void luminaires_irradiance_double(const lam_luminaires *l, size_t n_rhs, const double *D, double *H0) {
    const row_factors f = factors_of(l);
    first_rows_apply_double(&l->rows, n_rhs * l->C, D, &f, H0);
}

void lam_luminaires_adjoint(const lam_luminaires *l, size_t n_rhs, const float *g, float *D) {
    const row_factors f = factors_of(l);
    first_rows_adjoint(&l->rows, n_rhs * l->C, g, &f, D);
}

const double *luminaires_factors(const lam_luminaires *l) {
    return l->factors;
}

const float *luminaires_irradiance(const lam_luminaires *l) {
    return l->rows.values;
}

const double *luminaires_lumens(const lam_luminaires *l) {
    return l->lumens;
}

size_t luminaires_error_groups(const lam_luminaires *l) {
    return l->n_error_groups;
}

const double *luminaires_elements_off(const lam_luminaires *l) {
    return l->elements_off;
}

const double *luminaires_means_off(const lam_luminaires *l) {
    return l->means_off;
}
