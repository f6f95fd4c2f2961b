#include "solver/operator/sensor_light.h"

#include "solver/operator/first_rows.h"
#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Kinds of sets and of receivers (store/FORMAT.md), and the bits of flags. */
enum {
    SET_KINDS = SENSOR_SET_PROBES + 1,
    RECEIVERS = SENSOR_HARMONIC + SENSOR_HARMONICS,
    FLAGS = SENSOR_IN_WALL | SENSOR_IN_LUMINAIRE
};

static const char *const arrays[] = {"kind", "receiver", "cell", "flags"};
enum { ARRAY_KIND, ARRAY_RECEIVER, ARRAY_CELL, ARRAY_FLAGS, ARRAYS };

struct lam_sensors {
    size_t n, C, n_sets, count;
    char **names;            /* [n_sets], one block */
    uint64_t *first;         /* [n_sets + 1] */
    uint32_t *array[ARRAYS]; /* [n_sets], then [count] each */
    bool *is_signed;         /* [count] */
    uint32_t *grid;          /* [n_sets][2] */
    double *spacing;         /* [n_sets][2] */
    double *place;           /* [count][9]: at, axis, look */
    uint64_t *start;         /* [count + 1] */
    uint32_t *element;
    float *weight, *off;
    first_rows sky;        /* [m][count]; m 0: none */
    float *sky_off;        /* [m][count] */
    first_rows luminaires; /* [k][count]; m 0: none */
    double *colour;        /* [C][k] */
    size_t n_eyes;
    uint32_t *eyes; /* [n_eyes] */
    float *seen;    /* [k][n_eyes][SENSOR_SEEN] */
};

void lam_sensors_close(lam_sensors *l) {
    if (l == NULL) return;
    free(l->names);
    free(l->first);
    for (int a = 0; a < ARRAYS; a++) free(l->array[a]);
    free(l->is_signed);
    free(l->grid);
    free(l->spacing);
    free(l->place);
    free(l->start);
    free(l->element);
    free(l->weight);
    free(l->off);
    if (l->sky.m > 0) first_rows_free(&l->sky);
    free(l->sky_off);
    if (l->luminaires.m > 0) first_rows_free(&l->luminaires);
    free(l->colour);
    free(l->eyes);
    free(l->seen);
    free(l);
}

/* Checks that offsets [n + 1] rise from 0 to last. */
static lam_status check_offsets(const store *s, const char *name, const uint64_t *offset, size_t n,
                                uint64_t last, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k <= n; k++) {
        const uint64_t least = k > 0 ? offset[k - 1] : 0;
        if (offset[k] < least || offset[k] > last || (k == 0 && offset[k] != 0) ||
            (k == n && offset[k] != last))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %llu, must rise from 0 to %llu", store_path(s), name,
                 k, (unsigned long long)offset[k], (unsigned long long)last);
    }
done:
    return status;
}

/* Checks that numbers are below a limit, or the mark of none. */
static lam_status check_below(const store *s, const char *name, const uint32_t *x, size_t n, size_t limit,
                              bool or_none, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < n; k++)
        if (x[k] >= limit && !(or_none && x[k] == UINT32_MAX))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %u, must be below %zu", store_path(s), name, k,
                 (unsigned)x[k], limit);
done:
    return status;
}

static lam_status check_finite(const store *s, const char *name, const float *x, size_t n, bool positive,
                               lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < n; k++)
        if (!isfinite(x[k]) || (positive && x[k] < 0))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %g, must be %s", store_path(s), name, k, (double)x[k],
                 positive ? "at least 0" : "a number");
done:
    return status;
}

static lam_status read_sets(store *s, lam_sensors *l, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    TRY(store_read_texts(s, STORE_SENSORS "/names", &l->n_sets, &l->names, error));
    TRY(store_read(s, STORE_SENSORS "/first", STORE_U64, 1, (size_t[]){l->n_sets + 1}, &data, error));
    l->first = data;
    l->count = (size_t)l->first[l->n_sets];
    TRY(check_offsets(s, STORE_SENSORS "/first", l->first, l->n_sets, l->count, error));
    TRY(store_read(s, STORE_SENSORS "/grid", STORE_U32, 2, (size_t[]){l->n_sets, 2}, &data, error));
    l->grid = data;
    TRY(store_read(s, STORE_SENSORS "/spacing", STORE_F64, 2, (size_t[]){l->n_sets, 2}, &data, error));
    l->spacing = data;
    for (size_t k = 0; k < 2 * l->n_sets; k++)
        if (!(l->spacing[k] >= 0 && isfinite(l->spacing[k])))
            FAIL(error, LAM_ERR_FORMAT, "%s: /sensors/spacing[%zu] = %g, must be at least 0", store_path(s),
                 k, l->spacing[k]);
done:
    return status;
}

static lam_status read_receivers(store *s, lam_sensors *l, lam_error *error) {
    static const size_t limits[ARRAYS] = {SET_KINDS, RECEIVERS, UINT32_MAX, FLAGS + 1};
    lam_status status = LAM_OK;
    void *data = NULL;
    for (int a = 0; a < ARRAYS; a++) {
        char name[64];
        const size_t n = a == ARRAY_KIND ? l->n_sets : l->count;
        snprintf(name, sizeof name, STORE_SENSORS "/%s", arrays[a]);
        TRY(store_read(s, name, STORE_U32, 1, (size_t[]){n}, &data, error));
        l->array[a] = data;
        TRY(check_below(s, name, l->array[a], n, limits[a], a == ARRAY_CELL, error));
    }
    TRY(store_read(s, STORE_SENSORS "/place", STORE_F64, 2, (size_t[]){l->count, 9}, &data, error));
    l->place = data;
    for (size_t k = 0; k < 9 * l->count; k++)
        if (!isfinite(l->place[k]))
            FAIL(error, LAM_ERR_FORMAT, "%s: /sensors/place[%zu][%zu] is no number", store_path(s), k / 9,
                 k % 9);
done:
    return status;
}

static lam_status read_rows(store *s, lam_sensors *l, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX};
    void *data = NULL;
    TRY(store_read(s, STORE_SENSORS "/indptr", STORE_U64, 1, (size_t[]){l->count + 1}, &data, error));
    l->start = data;
    TRY(store_read(s, STORE_SENSORS "/indices", STORE_U32, 1, dims, &data, error));
    l->element = data;
    TRY(check_offsets(s, STORE_SENSORS "/indptr", l->start, l->count, dims[0], error));
    TRY(check_below(s, STORE_SENSORS "/indices", l->element, dims[0], l->n, false, error));
    TRY(store_read(s, STORE_SENSORS "/weights", STORE_F32, 1, dims, &data, error));
    l->weight = data;
    TRY(check_finite(s, STORE_SENSORS "/weights", l->weight, dims[0], false, error));
    TRY(store_read(s, STORE_SENSORS "/weights_off", STORE_F32, 1, dims, &data, error));
    l->off = data;
    TRY(check_finite(s, STORE_SENSORS "/weights_off", l->off, dims[0], false, error));
done:
    return status;
}

/* Checks that probes have nine harmonics each, and that weights of other receivers are not negative. */
static lam_status check_kinds(const store *s, lam_sensors *l, lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t *receiver = l->array[ARRAY_RECEIVER];
    l->is_signed = memory_allocate(l->count, sizeof *l->is_signed, "sensors", error);
    if (l->is_signed == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t set = 0; set < l->n_sets; set++) {
        const size_t first = (size_t)l->first[set], last = (size_t)l->first[set + 1];
        const bool probes = l->array[ARRAY_KIND][set] == SENSOR_SET_PROBES;
        if (probes && (last - first) % SENSOR_HARMONICS != 0)
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: /sensors/kind[%zu] is of probes, of %zu receivers, must be of a "
                 "multiple of %d",
                 store_path(s), set, last - first, SENSOR_HARMONICS);
        for (size_t k = first; k < last; k++) {
            const size_t harmonic = SENSOR_HARMONIC + (k - first) % SENSOR_HARMONICS;
            if (probes ? receiver[k] != harmonic : receiver[k] >= SENSOR_HARMONIC)
                FAIL(error, LAM_ERR_FORMAT, "%s: /sensors/receiver[%zu] = %u, must be %s%zu", store_path(s),
                     k, (unsigned)receiver[k], probes ? "" : "below ",
                     probes ? harmonic : (size_t)SENSOR_HARMONIC);
            l->is_signed[k] = receiver[k] > SENSOR_HARMONIC;
        }
    }
    for (size_t k = 0; k < l->count; k++)
        for (uint64_t i = l->start[k]; i < l->start[k + 1] && !l->is_signed[k]; i++)
            if (l->weight[i] < 0)
                FAIL(error, LAM_ERR_FORMAT, "%s: /sensors/weights[%zu] = %g, must be at least 0",
                     store_path(s), (size_t)i, (double)l->weight[i]);
done:
    return status;
}

/* The rows of the sky and of luminaires, where there are any. */
static lam_status read_direct(store *s, lam_sensors *l, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    if (store_has(s, STORE_SENSORS "/sky")) {
        TRY(first_rows_load(s, STORE_SENSORS "/sky", "tile", l->count, l->is_signed, &l->sky, error));
        TRY(store_read(s, STORE_SENSORS "/sky_off", STORE_F32, 2, (size_t[]){l->sky.m, l->count}, &data,
                       error));
        l->sky_off = data;
        TRY(check_finite(s, STORE_SENSORS "/sky_off", l->sky_off, l->sky.m * l->count, false, error));
    }
    if (store_has(s, STORE_SENSORS "/luminaires")) {
        TRY(first_rows_load(s, STORE_SENSORS "/luminaires", "luminaire", l->count, l->is_signed,
                            &l->luminaires, error));
        const size_t k = l->luminaires.m;
        TRY(store_read(s, STORE_LUMINAIRES "/colour", STORE_F64, 2, (size_t[]){k, 3}, &data, error));
        const double *colour = data;
        l->colour = memory_allocate(l->C, k * sizeof *l->colour, "sensors", error);
        for (size_t i = 0; i < l->C * k && l->colour != NULL; i++)
            l->colour[i] = l->C == 1 ? 1 : colour[i % k * 3 + i / k];
        free(data);
        if (l->colour == NULL) TRY(LAM_ERR_MEMORY);
    }
done:
    return status;
}

/* Luminaires that eyes see; none in stores without eyes. */
static lam_status read_eyes(store *s, lam_sensors *l, lam_error *error) {
    static const size_t position = 3, passed = 4;
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX};
    void *data = NULL;
    if (l->luminaires.m == 0 || !store_has(s, STORE_SENSORS "/eyes")) return LAM_OK;
    TRY(store_read(s, STORE_SENSORS "/eyes", STORE_U32, 1, dims, &data, error));
    l->eyes = data;
    TRY(check_below(s, STORE_SENSORS "/eyes", l->eyes, dims[0], l->count, false, error));
    for (size_t k = 1; k < dims[0]; k++)
        if (l->eyes[k] <= l->eyes[k - 1])
            FAIL(error, LAM_ERR_FORMAT, "%s: /sensors/eyes[%zu] = %u, must be above %u", store_path(s), k,
                 (unsigned)l->eyes[k], (unsigned)l->eyes[k - 1]);
    size_t shape[] = {l->luminaires.m, dims[0], SENSOR_SEEN};
    TRY(store_read(s, STORE_SENSORS "/seen", STORE_F32, 3, shape, &data, error));
    l->seen = data;
    const size_t count = shape[0] * shape[1] * SENSOR_SEEN;
    TRY(check_finite(s, STORE_SENSORS "/seen", l->seen, count, true, error));
    for (size_t k = 0; k < count; k += SENSOR_SEEN) {
        const float p = l->seen[k + position], t = l->seen[k + passed];
        if (t > 1 || (p > 0 && p < 1))
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: /sensors/seen[%zu][%zu] has a position of %g, must be 0 or at least 1, and passes %g, "
                 "must be at most 1",
                 store_path(s), k / SENSOR_SEEN / dims[0], k / SENSOR_SEEN % dims[0], (double)p, (double)t);
    }
    l->n_eyes = dims[0];
done:
    return status;
}

lam_status sensors_load(store *s, size_t n, size_t C, lam_sensors **out, lam_error *error) {
    lam_status status = LAM_OK;
    lam_sensors *l = NULL;
    if (!store_has(s, STORE_SENSORS)) {
        *out = NULL;
        return LAM_OK;
    }
    l = memory_allocate(1, sizeof *l, "sensors", error);
    if (l == NULL) TRY(LAM_ERR_MEMORY);
    l->n = n;
    l->C = C;
    TRY(read_sets(s, l, error));
    TRY(read_receivers(s, l, error));
    TRY(read_rows(s, l, error));
    TRY(check_kinds(s, l, error));
    TRY(read_direct(s, l, error));
    TRY(read_eyes(s, l, error));
    *out = l;
    l = NULL;
done:
    lam_sensors_close(l);
    return status;
}

lam_status lam_sensors_open(const char *path, lam_sensors **sensors, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    store_type type;
    int rank;
    size_t dims[STORE_MAX_RANK];
    if (path == NULL || sensors == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "a path and a place for the sensors are needed");
    TRY(store_open(path, &s, error));
    TRY(store_array_info(s, STORE_MESH "/reflectance", &type, &rank, dims, error));
    if (rank != 2)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/reflectance has %d dimensions, must have 2", store_path(s),
             rank);
    TRY(sensors_load(s, dims[1], dims[0], sensors, error));
done:
    store_close(s);
    return status;
}

size_t lam_sensors_count(const lam_sensors *l) {
    return l->count;
}

size_t lam_sensors_channels(const lam_sensors *l) {
    return l->C;
}

size_t lam_sensors_elements(const lam_sensors *l) {
    return l->n;
}

size_t lam_sensors_tiles(const lam_sensors *l) {
    return l->sky.m;
}

size_t lam_sensors_luminaires(const lam_sensors *l) {
    return l->luminaires.m;
}

size_t lam_sensors_sets(const lam_sensors *l) {
    return l->n_sets;
}

const char *lam_sensors_set(const lam_sensors *l, size_t set, size_t *first, size_t *count) {
    *first = (size_t)l->first[set];
    *count = (size_t)(l->first[set + 1] - l->first[set]);
    return l->names[set];
}

int lam_sensors_has_value(const lam_sensors *l, size_t receiver) {
    return l->array[ARRAY_FLAGS][receiver] == 0;
}

bool sensors_is_signed(const lam_sensors *l, size_t receiver) {
    return l->is_signed[receiver];
}

sensor_set_shown sensors_set_shown(const lam_sensors *l, size_t set) {
    sensor_set_shown out = {.kind = l->array[ARRAY_KIND][set],
                            .rows = l->grid[2 * set],
                            .columns = l->grid[2 * set + 1],
                            .spacing = {l->spacing[2 * set], l->spacing[2 * set + 1]}};
    out.name = lam_sensors_set(l, set, &out.first, &out.count);
    return out;
}

sensor_shown sensors_shown(const lam_sensors *l, size_t receiver) {
    const double *place = l->place + 9 * receiver;
    sensor_shown out = {.kind = l->array[ARRAY_RECEIVER][receiver],
                        .cell = l->array[ARRAY_CELL][receiver],
                        .flags = l->array[ARRAY_FLAGS][receiver]};
    memcpy(out.at, place, sizeof out.at);
    memcpy(out.axis, place + 3, sizeof out.axis);
    memcpy(out.look, place + 6, sizeof out.look);
    return out;
}

sensor_weights sensors_weights(const lam_sensors *l) {
    return (sensor_weights){l->start, l->element, l->weight};
}

const float *sensors_sky(const lam_sensors *l) {
    return l->sky.m > 0 ? l->sky.values : NULL;
}

lam_status sensors_receivers(const lam_sensors *l, placed_receiver **out, lam_error *error) {
    placed_receiver *made = memory_allocate(l->count, sizeof *made, "sensors", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < l->count; k++) {
        const double *place = l->place + 9 * k;
        made[k].kind = l->array[ARRAY_RECEIVER][k];
        memcpy(made[k].at, place, sizeof made[k].at);
        memcpy(made[k].axis, place + 3, sizeof made[k].axis);
        memcpy(made[k].look, place + 6, sizeof made[k].look);
    }
    *out = made;
    return LAM_OK;
}

sensor_eyes sensors_eyes(const lam_sensors *l) {
    return (sensor_eyes){l->n_eyes, l->eyes, l->seen, l->colour};
}

static int by_receiver(const void *a, const void *b) {
    const uint32_t p = *(const uint32_t *)a, q = *(const uint32_t *)b;
    return (p > q) - (p < q);
}

const float *sensors_seen(const lam_sensors *l, size_t receiver) {
    const uint32_t key = (uint32_t)receiver;
    const uint32_t *eye = l->n_eyes > 0 ? bsearch(&key, l->eyes, l->n_eyes, sizeof key, by_receiver) : NULL;
    return eye != NULL ? l->seen + (size_t)(eye - l->eyes) * SENSOR_SEEN : NULL;
}

double sensors_direct(const lam_sensors *l, const double *dimmer, size_t receiver) {
    double sum = 0;
    for (size_t k = 0; k < l->luminaires.m; k++)
        sum += dimmer[k] * (double)l->luminaires.values[k * l->count + receiver];
    return sum;
}

void lam_sensors_gather(const lam_sensors *l, size_t n_rhs, const float *B, const float *L, const float *D,
                        float *out) {
    const row_factors colour = {.n_channels = l->C, .values = l->colour};
    const size_t rows = n_rhs * l->C;
    for (size_t q = 0; q < rows; q++)
        for (size_t k = 0; k < l->count; k++) {
            double sum = 0;
            for (uint64_t i = l->start[k]; i < l->start[k + 1]; i++)
                sum += (double)l->weight[i] * (double)B[q * l->n + l->element[i]];
            out[q * l->count + k] = (float)sum;
        }
    if (L != NULL && l->sky.m > 0) first_rows_apply(&l->sky, rows, L, NULL, true, out);
    if (D != NULL && l->luminaires.m > 0) first_rows_apply(&l->luminaires, rows, D, &colour, true, out);
}

void sensors_gather_double(const lam_sensors *l, size_t n_rhs, const double *B, const double *L,
                           const double *D, double *out) {
    const row_factors colour = {.n_channels = l->C, .values = l->colour};
    const size_t rows = n_rhs * l->C;
    for (size_t q = 0; q < rows; q++)
        for (size_t k = 0; k < l->count; k++) {
            double sum = 0;
            for (uint64_t i = l->start[k]; i < l->start[k + 1]; i++)
                sum += (double)l->weight[i] * B[q * l->n + l->element[i]];
            out[q * l->count + k] = sum;
        }
    if (L != NULL && l->sky.m > 0) first_rows_apply_double(&l->sky, rows, L, NULL, out);
    if (D != NULL && l->luminaires.m > 0) first_rows_apply_double(&l->luminaires, rows, D, &colour, out);
}

void lam_sensors_adjoint(const lam_sensors *l, size_t n_rhs, const float *g, float *B, float *L, float *D) {
    const row_factors colour = {.n_channels = l->C, .values = l->colour};
    const size_t rows = n_rhs * l->C;
    for (size_t q = 0; q < rows && B != NULL; q++) {
        float *of = B + q * l->n;
        memset(of, 0, l->n * sizeof *of);
        for (size_t k = 0; k < l->count; k++) {
            const double weight = (double)g[q * l->count + k];
            if (weight == 0) continue;
            for (uint64_t i = l->start[k]; i < l->start[k + 1]; i++)
                of[l->element[i]] = (float)((double)of[l->element[i]] + weight * (double)l->weight[i]);
        }
    }
    if (L != NULL && l->sky.m > 0) first_rows_adjoint(&l->sky, rows, g, NULL, L);
    if (D != NULL && l->luminaires.m > 0) first_rows_adjoint(&l->luminaires, rows, g, &colour, D);
}

void sensors_gather_off(const lam_sensors *l, size_t n_rhs, const float *B, const float *L, float *out) {
    const size_t rows = n_rhs * l->C, m = l->sky.m;
    for (size_t q = 0; q < rows; q++)
        for (size_t k = 0; k < l->count; k++) {
            double sum = 0;
            for (uint64_t i = l->start[k]; i < l->start[k + 1]; i++)
                sum += (double)l->off[i] * (double)B[q * l->n + l->element[i]];
            for (size_t t = 0; L != NULL && t < m; t++)
                sum += (double)l->sky_off[t * l->count + k] * (double)L[q * m + t];
            out[q * l->count + k] = (float)sum;
        }
}

void lam_sensors_variance(const lam_sensors *l, size_t n_rhs, const float *B, const float *L,
                          float *variance) {
    sensors_gather_off(l, n_rhs, B, L, variance);
    for (size_t k = 0; k < n_rhs * l->C * l->count; k++) variance[k] *= variance[k];
}
