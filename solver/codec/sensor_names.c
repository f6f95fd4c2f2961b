#include "solver/codec/sensor_names.h"

#include <stdlib.h>
#include <string.h>

static const char noun[] = "set of sensors";

/* The names in one block, as group_index_make takes it over. */
static char **copy_names(const lam_sensors *sensors, lam_error *error) {
    const size_t n_sets = lam_sensors_sets(sensors);
    size_t first, count, bytes = n_sets * sizeof(char *);
    for (size_t k = 0; k < n_sets; k++) bytes += strlen(lam_sensors_set(sensors, k, &first, &count)) + 1;
    char **names = memory_allocate(bytes, 1, noun, error);
    if (names == NULL) return NULL;
    char *text = (char *)(names + n_sets);
    for (size_t k = 0; k < n_sets; k++) {
        names[k] = text;
        text = stpcpy(text, lam_sensors_set(sensors, k, &first, &count)) + 1;
    }
    return names;
}

lam_status sensor_names_make(const lam_sensors *sensors, group_index *out, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *set = NULL;
    *out = (group_index){.n_groups = 0};
    if (sensors == NULL) return LAM_OK;
    const size_t n_sets = lam_sensors_sets(sensors), n = lam_sensors_count(sensors);
    set = memory_allocate(n, sizeof *set, noun, error);
    char **names = set != NULL ? copy_names(sensors, error) : NULL;
    if (names == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_sets; k++) {
        size_t first, count;
        lam_sensors_set(sensors, k, &first, &count);
        for (size_t i = first; i < first + count; i++) set[i] = (uint32_t)k;
    }
    TRY(group_index_make(n, 0, set, n_sets, names, out, error));
    out->noun = noun;
    out->buried = memory_allocate(n, sizeof *out->buried, noun, error);
    if (out->buried == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) out->buried[i] = !lam_sensors_has_value(sensors, i);
done:
    free(set);
    if (status != LAM_OK) group_index_free(out);
    return status;
}

size_t sensor_names_bytes(size_t n_receivers) {
    return n_receivers * (sizeof(uint32_t) + sizeof(bool));
}
