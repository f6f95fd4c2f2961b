#include "solver/verbs/solve_probes.h"

#include "solver/base/atomic_file.h"
#include "solver/base/harmonics.h"
#include "solver/operator/sensor_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool solve_probes_are(const lam_sensors *all, size_t set) {
    return sensors_set_shown(all, set).kind == SENSOR_SET_PROBES;
}

lam_status solve_probes_check(const sensor_choice *c, bool linear, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    char extension[16] = "";
    size_t n_probes = 0, probes = 0, others = 0;
    if (path != NULL) atomic_file_extension(path, extension);
    for (size_t k = 0; k < c->n_sets; k++)
        if (solve_probes_are(c->all, c->sets[k])) {
            probes = c->sets[k];
            n_probes++;
        } else {
            others = c->sets[k];
        }
    if (n_probes == 0) return LAM_OK;
    const char *name = sensors_set_shown(c->all, probes).name;
    if (!linear)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--sensors: %s is a set of probes, whose coefficients have no share of hours: leave it out, or "
             "take --annual sum",
             name);
    if (path == NULL || strcmp(extension, "json") == 0) goto done;
    if (strcmp(extension, "npy") != 0)
        FAIL(error, LAM_ERR_ARGUMENT,
             "-o %.200s: %s is a set of probes, which go into .json or .npy; name other sensors", path, name);
    if (n_probes < c->n_sets)
        FAIL(error, LAM_ERR_ARGUMENT,
             "-o %.200s: %s is a set of probes and %s is not: write them into a file each, or into .json",
             path, name, sensors_set_shown(c->all, others).name);
done:
    return status;
}

/* Coefficient w of a probe in a vector and channel. */
static double coefficient(const sensor_choice *c, const solution *s, size_t row, size_t first, size_t w) {
    return (double)s->values[row * lam_sensors_count(c->all) + first + w];
}

/* The unit of a radiance, by that of an irradiance: lx is lm/m2, and lm/sr is cd. */
static void unit_of(const solution *s, size_t vector, char out[32]) {
    const char *unit = output_unit(s, vector);
    const bool lux = strcmp(unit, "lx") == 0, watts = strcmp(unit, "W/m2") == 0;
    snprintf(out, 32, lux ? "cd/m2" : watts ? "W/(m2 sr)" : unit[0] != '\0' ? "%.24s/sr" : "%.24s", unit);
}

/* The vector of a scene in the axes of a probe; -0 becomes 0. */
static void turn(const sensor_shown *probe, const double v[3], double out[3]) {
    harmonics_turn(probe->axis, probe->look, v, out);
    for (int d = 0; d < 3; d++) out[d] += 0;
}

static const char *axes_of(const sensor_shown *probe, char up) {
    double own[3];
    const double upwards[3] = {up == 'x', up == 'y', up == 'z'};
    turn(probe, upwards, own);
    return own[1] > .5 ? "y-up" : "scene";
}

/* [9][channels] of a vector, or null */
static json_t *probe_json(const sensor_choice *c, const solution *s, size_t vector, size_t first) {
    const size_t C = s->m->n_channels;
    if (!lam_sensors_has_value(c->all, first)) return json_null();
    json_t *out = json_array();
    for (size_t w = 0; w < HARMONICS; w++) {
        json_t *channels = json_array();
        for (size_t k = 0; k < C; k++)
            json_array_append_new(channels, json_real(coefficient(c, s, vector * C + k, first, w)));
        json_array_append_new(out, channels);
    }
    return out;
}

json_t *solve_probes_json(const sensor_choice *c, const solution *s, size_t set) {
    const sensor_set_shown shown = sensors_set_shown(c->all, set);
    const size_t last = shown.first + shown.count;
    json_t *places = json_array(), *vectors = json_array();
    char unit[32];
    unit_of(s, 0, unit);
    for (size_t i = shown.first; i < last; i += HARMONICS) {
        const sensor_shown probe = sensors_shown(c->all, i);
        double at[3];
        turn(&probe, probe.at, at);
        json_array_append_new(places, json_pack("[f, f, f]", at[0], at[1], at[2]));
    }
    for (size_t v = 0; v < s->n_vectors; v++) {
        json_t *probes = json_array();
        for (size_t i = shown.first; i < last; i += HARMONICS)
            json_array_append_new(probes, probe_json(c, s, v, i));
        json_array_append_new(vectors, probes);
    }
    const sensor_shown one = sensors_shown(c->all, shown.first);
    json_t *out = json_pack("{s:s, s:s, s:s, s:s, s:o}", "name", shown.name, "axes", axes_of(&one, s->m->up),
                            "quantity", "radiance", "unit", unit, "at", places);
    json_object_set(out, "coefficients", s->batch ? vectors : json_array_get(vectors, 0));
    json_decref(vectors);
    return out;
}

void solve_probes_print(const sensor_choice *c, const solution *s, size_t set) {
    const sensor_set_shown shown = sensors_set_shown(c->all, set);
    const size_t C = s->m->n_channels;
    const double whole = .5 / sqrt(M_PI); /* Y_0: the mean radiance is its coefficient over 4 pi Y_0 */
    static const char irradiance[] = "irradiance";
    for (size_t row = 0; row < s->n_vectors * C; row++) {
        char name[OUTPUT_COLUMN], unit[32], of[OUTPUT_COLUMN + 64];
        double sum = 0, least = INFINITY, most = -INFINITY;
        size_t n = 0;
        for (size_t i = shown.first; i < shown.first + shown.count; i += HARMONICS) {
            if (!lam_sensors_has_value(c->all, i)) continue;
            const double mean = whole * coefficient(c, s, row, i, 0);
            sum += mean;
            least = fmin(least, mean);
            most = fmax(most, mean);
            n++;
        }
        if (n == 0) sum = least = most = NAN;
        const double mean = sum / (double)(n > 0 ? n : 1);
        unit_of(s, row / C, unit);
        output_column(s, row / C, row % C, name);
        const size_t known =
            strncmp(name, irradiance, (sizeof irradiance - 1)) == 0 ? (sizeof irradiance - 1) : 0;
        snprintf(of, sizeof of, unit[0] != '\0' ? "radiance%s, %s" : "radiance%s", name + known, unit);
        printf("%-24s %8zu %-24s %10.6g %10.6g %10.6g %10.3g\n", shown.name, n, of, mean, least, most,
               mean > 0 ? least / mean : (double)NAN);
    }
}

lam_status solve_probes_npy(const sensor_choice *c, const solution *s, FILE *stream, lam_error *error) {
    size_t shape[4], rank = 0, at = 0;
    const size_t C = s->m->n_channels;
    float *values = memory_allocate(s->n_vectors * C, c->n * sizeof *values, "sensors", error);
    if (values == NULL) return LAM_ERR_MEMORY;
    if (s->batch) shape[rank++] = s->n_vectors;
    shape[rank++] = c->n / HARMONICS;
    shape[rank++] = HARMONICS;
    shape[rank++] = C;
    for (size_t v = 0; v < s->n_vectors; v++)
        for (size_t k = 0; k < c->n_sets; k++) {
            const sensor_set_shown shown = sensors_set_shown(c->all, c->sets[k]);
            for (size_t i = shown.first; i < shown.first + shown.count; i++)
                for (size_t channel = 0; channel < C; channel++)
                    values[at++] = lam_sensors_has_value(c->all, i)
                                       ? (float)coefficient(c, s, v * C + channel, i, 0)
                                       : NAN;
        }
    const lam_status status = output_array(stream, rank, shape, values, NULL, error);
    free(values);
    return status;
}
