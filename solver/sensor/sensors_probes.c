/* Sets of probes of a list: at points, or in rows and grids of steps, in the axes of the scene or with y up.
 */
#include "solver/base/vector3.h"
#include "solver/sensor/sensors_parts.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { DIMENSIONS = 3, PROBES_MOST = SENSORS_MOST / HARMONICS };

/* A row or a grid: places are from + sum_k i_k step_k, i_k from 0 to counts_k - 1, the last k the fastest. */
typedef struct probe_steps {
    size_t n, counts[DIMENSIONS], all;
    double step[DIMENSIONS][3];
} probe_steps;

receiver sensors_probe(bool y_up, char up) {
    receiver r = {.kind = RECEIVER_HARMONIC, .axis = {0, 0, 1}, .look = {1, 0, 0}};
    if (!y_up || up == 'y') return r;
    /* As glTF files are turned (codec/gltf): of z up, x, z and -y become x, y and z; of x up, -y, x and z. */
    if (up == 'x') return (receiver){.kind = RECEIVER_HARMONIC, .axis = {0, 0, 1}, .look = {0, -1, 0}};
    return (receiver){.kind = RECEIVER_HARMONIC, .axis = {0, -1, 0}, .look = {1, 0, 0}};
}

static lam_status read_point(const sensors_reading *r, const char *place, const char *what,
                             const json_t *value, double out[3], lam_error *error) {
    const lam_status status = list_vector(place, what, value, out, error);
    for (int d = 0; d < 3 && status == LAM_OK; d++) out[d] *= r->unit;
    return status;
}

static lam_status read_steps(const sensors_reading *r, const char *place, const json_t *steps,
                             const json_t *counts, probe_steps *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = json_array_size(steps);
    double all = 1, count = 0;
    if (steps == NULL || counts == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s has from; then it must have steps and counts too", place);
    if (n < 1 || n > DIMENSIONS)
        TRY(list_wrong(place, "steps", steps, "must be an array of 1 to 3 steps [x, y, z]", error));
    if (json_array_size(counts) != n)
        TRY(list_wrong(place, "counts", counts, "must be an array of a number for each step", error));
    for (size_t k = 0; k < n; k++) {
        double *step = out->step[k];
        TRY(read_point(r, place, "a step", json_array_get(steps, k), step, error));
        TRY(list_number(place, "a count", json_array_get(counts, k), 1, PROBES_MOST, false, &count, error));
        if (count != floor(count)) TRY(list_wrong(place, "counts", counts, "must be whole numbers", error));
        if (count > 1 && dot3(step, step) == 0)
            TRY(list_wrong(place, "steps", steps, "must have a length above 0 where there is more than one",
                           error));
        out->counts[k] = (size_t)count;
        all *= count;
    }
    if (all > PROBES_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: counts make %.0f probes, must be at most %d", place, all,
             PROBES_MOST);
    out->n = n;
    out->all = (size_t)all;
done:
    return status;
}

/* "axes": "scene", the preset, or "y-up" */
static lam_status read_axes(const sensors_reading *r, const char *place, const json_t *value, receiver *out,
                            lam_error *error) {
    const char *word = json_string_value(value);
    const bool y_up = word != NULL && strcmp(word, "y-up") == 0;
    if (value != NULL && !y_up && (word == NULL || strcmp(word, "scene") != 0))
        return list_wrong(place, "axes", value, "must be \"scene\" or \"y-up\"", error);
    *out = sensors_probe(y_up, r->up);
    return LAM_OK;
}

lam_status sensors_probe_set(sensors_reading *r, json_t *value, const char *place, sensor_set *set,
                             lam_error *error) {
    static const char *const members[] = {"name", "at", "from", "steps", "counts", "axes"};
    lam_status status = LAM_OK;
    probe_steps steps = {.n = 0};
    receiver one;
    double from[3] = {0};
    TRY(list_members(value, sizeof members / sizeof *members, members, place, error));
    TRY(sensors_set_name(value, place, set, error));
    TRY(read_axes(r, place, json_object_get(value, "axes"), &one, error));
    const json_t *at = json_object_get(value, "at"), *first = json_object_get(value, "from");
    const bool many = json_is_array(json_array_get(at, 0));
    if ((at == NULL) == (first == NULL))
        FAIL(error, LAM_ERR_ARGUMENT, "%s must have at, its points, or from, the first of a row or a grid",
             place);
    if (first != NULL) {
        TRY(read_point(r, place, "from", first, from, error));
        TRY(read_steps(r, place, json_object_get(value, "steps"), json_object_get(value, "counts"), &steps,
                       error));
    } else if (json_object_get(value, "steps") != NULL || json_object_get(value, "counts") != NULL) {
        FAIL(error, LAM_ERR_ARGUMENT, "%s has at; steps and counts are for a row, which has from", place);
    }
    TRY(sensors_begin(r, set, place, error));
    const size_t n = first != NULL ? steps.all : many ? json_array_size(at) : 1;
    for (size_t k = 0; k < n; k++) {
        size_t rest = k;
        memcpy(one.at, from, sizeof from);
        for (size_t j = steps.n; j-- > 0; rest /= steps.counts[j])
            for (int d = 0; d < 3; d++) one.at[d] += (double)(rest % steps.counts[j]) * steps.step[j][d];
        if (at != NULL)
            TRY(read_point(r, place, many ? "a point of at" : "at", many ? json_array_get(at, k) : at, one.at,
                           error));
        TRY(sensors_add(r, &one, SENSOR_NO_CELL, place, error));
    }
done:
    return status;
}
