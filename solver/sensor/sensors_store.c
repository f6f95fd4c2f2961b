#include "solver/sensor/sensors_store.h"

#include "solver/base/vector3.h"
#include "solver/operator/sensor_light.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GROUP STORE_SENSORS
enum { PLACE = 9 }; /* at, axis, look */

static lam_status save_sets(const sensor_list *l, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = l->n_sets;
    const char **names = memory_allocate(n, sizeof *names, "sensors", error);
    uint64_t *first = memory_allocate(n + 1, sizeof *first, "sensors", error);
    uint32_t *kind = memory_allocate(n, sizeof *kind, "sensors", error);
    uint32_t *grid = memory_allocate(n, 2 * sizeof *grid, "sensors", error);
    double *spacing = memory_allocate(n, 2 * sizeof *spacing, "sensors", error);
    if (names == NULL || first == NULL || kind == NULL || grid == NULL || spacing == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n; k++) {
        const sensor_set *set = &l->sets[k];
        names[k] = set->name;
        kind[k] = (uint32_t)set->kind;
        first[k + 1] = set->first + set->count;
        grid[2 * k] = (uint32_t)set->rows;
        grid[2 * k + 1] = (uint32_t)set->columns;
        memcpy(spacing + 2 * k, set->spacing, sizeof set->spacing);
    }
    TRY(store_write_texts(s, GROUP "/names", n, names, error));
    TRY(store_write(s, GROUP "/kind", STORE_U32, 1, (size_t[]){n}, kind, error));
    TRY(store_write(s, GROUP "/first", STORE_U64, 1, (size_t[]){n + 1}, first, error));
    TRY(store_write(s, GROUP "/grid", STORE_U32, 2, (size_t[]){n, 2}, grid, error));
    TRY(store_write(s, GROUP "/spacing", STORE_F64, 2, (size_t[]){n, 2}, spacing, error));
done:
    free(names);
    free(first);
    free(kind);
    free(grid);
    free(spacing);
    return status;
}

/* [n], freed with free(). */
static lam_status make_flags(size_t n, const float *backs, const bool *inside, uint32_t **out,
                             lam_error *error) {
    uint32_t *flags = memory_allocate(n, sizeof *flags, "sensors", error);
    if (flags == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < n; k++) {
        flags[k] = (double)backs[k] > SENSOR_BACKS_MOST ? SENSOR_IN_WALL : 0;
        if (inside != NULL && inside[k]) flags[k] |= SENSOR_IN_LUMINAIRE;
    }
    *out = flags;
    return LAM_OK;
}

static lam_status save_receivers(const sensor_list *l, const sensor_rows *rows, const bool *inside, store *s,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = l->n;
    uint32_t *kind = memory_allocate(n, sizeof *kind, "sensors", error);
    uint32_t *flags = NULL;
    double *place = memory_allocate(n, PLACE * sizeof *place, "sensors", error);
    if (kind == NULL || place == NULL) TRY(LAM_ERR_MEMORY);
    TRY(make_flags(n, rows->backs, inside, &flags, error));
    for (size_t k = 0; k < n; k++) {
        const receiver *r = &l->receivers[k];
        const double *const parts[] = {r->at, r->axis, r->look};
        kind[k] = (uint32_t)r->kind;
        for (int p = 0; p < 3; p++) memcpy(place + k * PLACE + 3 * p, parts[p], sizeof r->at);
    }
    TRY(store_write(s, GROUP "/receiver", STORE_U32, 1, (size_t[]){n}, kind, error));
    TRY(store_write(s, GROUP "/place", STORE_F64, 2, (size_t[]){n, PLACE}, place, error));
    TRY(store_write(s, GROUP "/cell", STORE_U32, 1, (size_t[]){n}, l->cell, error));
    TRY(store_write(s, GROUP "/flags", STORE_U32, 1, (size_t[]){n}, flags, error));
    TRY(store_write(s, GROUP "/backs", STORE_F32, 1, (size_t[]){n}, rows->backs, error));
done:
    free(kind);
    free(flags);
    free(place);
    return status;
}

/* The light of luminaires, and how eyes see them. */
static lam_status save_luminaires(const sensors_lit *lit, size_t n, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t k = lit->n_luminaires, count = k * lit->n_eyes;
    float *seen = NULL;
    if (k == 0) return LAM_OK;
    TRY(store_write(s, GROUP "/luminaires", STORE_F32, 2, (size_t[]){k, n}, lit->H, error));
    if (lit->n_eyes == 0) return LAM_OK;
    seen = memory_allocate(count, GLARE_NUMBERS * sizeof *seen, "luminaires that eyes see", error);
    if (seen == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < count; i++) {
        const glare_source *one = &lit->seen[i];
        const double numbers[GLARE_NUMBERS] = {one->intensity, one->area, one->distance, one->position,
                                               one->seen};
        for (int d = 0; d < GLARE_NUMBERS; d++) seen[i * GLARE_NUMBERS + d] = (float)numbers[d];
    }
    TRY(store_write(s, GROUP "/eyes", STORE_U32, 1, &lit->n_eyes, lit->eyes, error));
    TRY(store_write(s, GROUP "/seen", STORE_F32, 3, (size_t[]){k, lit->n_eyes, GLARE_NUMBERS}, seen, error));
done:
    free(seen);
    return status;
}

lam_status sensors_save(const sensor_list *l, const sensor_rows *rows, const sensors_lit *lit, store *s,
                        lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = l->n, nnz = (size_t)rows->start[n];
    TRY(save_sets(l, s, error));
    TRY(save_receivers(l, rows, lit != NULL ? lit->inside : NULL, s, error));
    TRY(store_set_integer(s, GROUP, "rays", (int64_t)rows->rays, error));
    TRY(store_write(s, GROUP "/indptr", STORE_U64, 1, (size_t[]){n + 1}, rows->start, error));
    TRY(store_write(s, GROUP "/indices", STORE_U32, 1, (size_t[]){nnz}, rows->element, error));
    TRY(store_write(s, GROUP "/weights", STORE_F32, 1, (size_t[]){nnz}, rows->weight, error));
    TRY(store_write(s, GROUP "/weights_off", STORE_F32, 1, (size_t[]){nnz}, rows->off, error));
    if (rows->n_tiles > 0) {
        const size_t dims[] = {rows->n_tiles, n};
        TRY(store_write(s, GROUP "/sky", STORE_F32, 2, dims, rows->sky, error));
        TRY(store_write(s, GROUP "/sky_off", STORE_F32, 2, dims, rows->sky_off, error));
    }
    if (lit != NULL) TRY(save_luminaires(lit, n, s, error));
done:
    return status;
}

bool sensors_are_lit_by(const char *array) {
    static const char *const arrays[] = {GROUP "/luminaires", GROUP "/flags", GROUP "/eyes", GROUP "/seen"};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        if (strcmp(array, arrays[k]) == 0) return true;
    return false;
}

lam_status sensors_save_lit(store *from, size_t n, const sensors_lit *lit, store *to, lam_error *error) {
    lam_status status = LAM_OK;
    void *backs = NULL;
    uint32_t *flags = NULL;
    TRY(store_read(from, GROUP "/backs", STORE_F32, 1, &n, &backs, error));
    TRY(make_flags(n, backs, lit->inside, &flags, error));
    TRY(store_write(to, GROUP "/flags", STORE_U32, 1, &n, flags, error));
    TRY(save_luminaires(lit, n, to, error));
done:
    free(backs);
    free(flags);
    return status;
}

/* The vectors of a receiver, as its kind needs them; false: they are none. */
static bool set_receiver(const sensor_shown *shown, receiver *out) {
    const bool turned = shown->kind != RECEIVER_SPHERE;
    const double length = dot3(shown->axis, shown->axis), look = dot3(shown->look, shown->look);
    *out = (receiver){.kind = (receiver_kind)shown->kind};
    memcpy(out->at, shown->at, sizeof out->at);
    memcpy(out->axis, shown->axis, sizeof out->axis);
    memcpy(out->look, shown->look, sizeof out->look);
    return fabs(length - turned) < 1e-6 &&
           ((shown->kind != RECEIVER_SEMICYLINDER && shown->kind < RECEIVER_HARMONIC) ||
            (fabs(look - 1) < 1e-6 && fabs(dot3(shown->look, shown->axis)) < 1e-6));
}

lam_status sensors_load_list(store *s, sensor_list *out, lam_error *error) {
    lam_status status = LAM_OK;
    sensor_list l = {.n = 0};
    lam_sensors *loaded = NULL;
    store_type type;
    int rank;
    size_t dims[STORE_MAX_RANK] = {0};
    if (store_has(s, GROUP)) {
        TRY(store_array_info(s, STORE_MESH "/reflectance", &type, &rank, dims, error));
        TRY(sensors_load(s, dims[1], dims[0], &loaded, error));
    }
    if (loaded == NULL) goto done;
    l.n_sets = lam_sensors_sets(loaded);
    l.n = lam_sensors_count(loaded);
    l.sets = memory_allocate(l.n_sets, sizeof *l.sets, "sensors", error);
    l.receivers = memory_allocate(l.n, sizeof *l.receivers, "sensors", error);
    l.cell = memory_allocate(l.n, sizeof *l.cell, "sensors", error);
    if (l.sets == NULL || l.receivers == NULL || l.cell == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < l.n_sets; k++) {
        const sensor_set_shown shown = sensors_set_shown(loaded, k);
        if (strlen(shown.name) >= SENSOR_NAME)
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/names[%zu] has %zu bytes, must have at most %d",
                 store_path(s), k, strlen(shown.name), SENSOR_NAME - 1);
        l.sets[k] = (sensor_set){.kind = (sensor_set_kind)shown.kind,
                                 .first = shown.first,
                                 .count = shown.count,
                                 .rows = shown.rows,
                                 .columns = shown.columns,
                                 .spacing = {shown.spacing[0], shown.spacing[1]}};
        memcpy(l.sets[k].name, shown.name, strlen(shown.name) + 1);
    }
    for (size_t k = 0; k < l.n; k++) {
        const sensor_shown shown = sensors_shown(loaded, k);
        l.cell[k] = shown.cell;
        if (!set_receiver(&shown, &l.receivers[k]))
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/place[%zu] has no unit vectors", store_path(s), k);
    }
    *out = l;
    l = (sensor_list){.n = 0};
done:
    if (status == LAM_OK && loaded == NULL) *out = l;
    lam_sensors_close(loaded);
    sensors_free(&l);
    return status;
}
