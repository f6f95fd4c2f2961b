#include "solver/verbs/solve_sensors.h"

#include "solver/base/atomic_file.h"
#include "solver/base/csv_text.h"
#include "solver/operator/sensor_light.h"
#include "solver/verbs/json_print.h"
#include "solver/verbs/sensor_files.h"
#include "solver/verbs/solve_probes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void sensor_choice_free(sensor_choice *c) {
    lam_sensors_close(c->all);
    free(c->sets);
    *c = (sensor_choice){.all = NULL};
}

/* The set of a name of so many bytes; n_sets: there is none. */
static size_t find_set(const lam_sensors *all, const char *name, size_t length) {
    size_t set = 0, first, count;
    while (set < lam_sensors_sets(all)) {
        const char *known = lam_sensors_set(all, set, &first, &count);
        if (strlen(known) == length && memcmp(known, name, length) == 0) break;
        set++;
    }
    return set;
}

/* Lists some names in text. */
static void list_names(const lam_sensors *all, char *text, size_t room) {
    enum { SHOWN = 8 };
    size_t first, count, length = 0;
    text[0] = '\0';
    for (size_t k = 0; k < lam_sensors_sets(all) && k < SHOWN && length < room; k++)
        length += (size_t)snprintf(text + length, room - length, "%s%s", k > 0 ? ", " : "",
                                   lam_sensors_set(all, k, &first, &count));
}

lam_status sensor_choice_open(store *s, const mesh *m, const char *names, sensor_choice *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    size_t first, count;
    char known[256];
    TRY(sensors_load(s, m->n, m->n_channels, &out->all, error));
    if (out->all == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--sensors %.60s: the store has no sensors; precompute it with --sensors", names);
    const size_t n_sets = lam_sensors_sets(out->all);
    const bool all = strcmp(names, SENSORS_ALL) == 0;
    out->sets = memory_allocate(strlen(names) + n_sets, sizeof *out->sets, "sensors", error);
    if (out->sets == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; all && k < n_sets; k++) out->sets[out->n_sets++] = k;
    for (const char *name = names; !all && *name != '\0';) {
        const size_t length = strcspn(name, ","), set = find_set(out->all, name, length);
        if (set == n_sets) {
            list_names(out->all, known, sizeof known);
            FAIL(error, LAM_ERR_ARGUMENT, "--sensors %.*s: the store has no such set; it has %s",
                 (int)(length < 60 ? length : 60), name, known);
        }
        out->sets[out->n_sets++] = set;
        name += length + (name[length] == ',');
    }
    if (out->n_sets == 0) FAIL(error, LAM_ERR_ARGUMENT, "--sensors: names no set");
    for (size_t k = 0; k < out->n_sets; k++) {
        lam_sensors_set(out->all, out->sets[k], &first, &count);
        out->n += count;
    }
done:
    return status;
}

lam_status solve_sensors_check(const char *path, lam_error *error) {
    char extension[16];
    atomic_file_extension(path, extension);
    static const char *const known[] = {"csv", "json", "npy", "vtu"};
    for (size_t k = 0; k < sizeof known / sizeof *known; k++)
        if (strcmp(extension, known[k]) == 0) return LAM_OK;
    if (sensor_results_named(path)) return LAM_OK;
    return status_fail(error, LAM_ERR_ARGUMENT,
                       "-o %s: --sensors goes into .csv, .json, .npy or .vtu, or into a folder, NAME/, only",
                       path);
}

double sensor_value(const sensor_choice *c, const solution *s, size_t row, size_t receiver) {
    if (!lam_sensors_has_value(c->all, receiver)) return NAN;
    return (double)s->values[row * lam_sensors_count(c->all) + receiver];
}

/* Figures of a set in a vector and channel; all NaN where no receiver has a value. */
typedef struct set_figures {
    size_t n;
    double mean, min, max;
} set_figures;

static set_figures figures_of(const sensor_choice *c, const solution *s, size_t row, size_t first,
                              size_t count) {
    set_figures f = {.mean = 0, .min = INFINITY, .max = -INFINITY};
    for (size_t i = first; i < first + count; i++) {
        const double x = sensor_value(c, s, row, i);
        if (isnan(x)) continue;
        f.n++;
        f.mean += x;
        f.min = fmin(f.min, x);
        f.max = fmax(f.max, x);
    }
    f.mean = f.n > 0 ? f.mean / (double)f.n : (double)NAN;
    if (f.n == 0) f.min = f.max = NAN;
    return f;
}

static void put_csv(const sensor_choice *c, const solution *s, FILE *stream) {
    output_csv_header(s, "sensors,x [m],y [m],z [m],nx,ny,nz", stream);
    for (size_t k = 0; k < c->n_sets; k++) {
        size_t first, count;
        const char *name = lam_sensors_set(c->all, c->sets[k], &first, &count);
        for (size_t i = first; i < first + count; i++) {
            const sensor_shown at = sensors_shown(c->all, i);
            csv_text(name, stream);
            for (int d = 0; d < 3; d++) fprintf(stream, ",%.9g", at.at[d]);
            for (int d = 0; d < 3; d++) fprintf(stream, ",%.9g", at.axis[d]);
            for (size_t row = 0; row < s->n_vectors * s->m->n_channels; row++) {
                const double x = sensor_value(c, s, row, i);
                if (isnan(x))
                    fputc(',', stream);
                else
                    fprintf(stream, ",%.9g", x);
            }
            fputs("\n", stream);
        }
    }
}

static void put_table(const sensor_choice *c, const solution *s) {
    char name[OUTPUT_COLUMN];
    printf("%-24s %8s %-24s %10s %10s %10s %10s\n", "sensors", "points", "of", "mean", "min", "max",
           "min/mean");
    for (size_t k = 0; k < c->n_sets; k++) {
        const bool probes = solve_probes_are(c->all, c->sets[k]);
        if (probes) solve_probes_print(c, s, c->sets[k]);
        for (size_t row = 0; row < s->n_vectors * s->m->n_channels && !probes; row++) {
            size_t first, count;
            const char *set = lam_sensors_set(c->all, c->sets[k], &first, &count);
            const set_figures f = figures_of(c, s, row, first, count);
            const char *unit = output_unit(s, row / s->m->n_channels);
            char of[OUTPUT_COLUMN + 32];
            output_column(s, row / s->m->n_channels, row % s->m->n_channels, name);
            snprintf(of, sizeof of, unit[0] != '\0' ? "%s, %s" : "%s", name, unit);
            printf("%-24s %8zu %-24s %10.6g %10.6g %10.6g %10.3g\n", set, f.n, of, f.mean, f.min, f.max,
                   f.mean > 0 ? f.min / f.mean : (double)NAN);
        }
    }
}

static json_t *number(double x) {
    return isnan(x) ? json_null() : json_real(x);
}

static json_t *vector3_json(const double x[3]) {
    return json_pack("[f, f, f]", x[0], x[1], x[2]);
}

/* {"name", "mean", "min", "max", "at": [[x, y, z], ...], "values": [...]}, figures and values an array of
 * vectors and of channels where there are several. */
static json_t *set_json(const sensor_choice *c, const solution *s, size_t set) {
    size_t first, count;
    const size_t C = s->m->n_channels;
    const char *name = lam_sensors_set(c->all, set, &first, &count);
    json_t *places = json_array(), *vectors = json_array(), *figures = json_array();
    for (size_t i = first; i < first + count; i++)
        json_array_append_new(places, vector3_json(sensors_shown(c->all, i).at));
    for (size_t row = 0; row < s->n_vectors * C; row++) {
        const set_figures f = figures_of(c, s, row, first, count);
        json_t *values = json_array();
        for (size_t i = first; i < first + count; i++)
            json_array_append_new(values, number(sensor_value(c, s, row, i)));
        json_array_append_new(vectors, values);
        json_array_append_new(figures, json_pack("{s:o, s:o, s:o}", "mean", number(f.mean), "min",
                                                 number(f.min), "max", number(f.max)));
    }
    const bool one = !s->batch && C == 1;
    json_t *out = json_pack("{s:s, s:o}", "name", name, "at", places);
    json_object_set(out, "values", one ? json_array_get(vectors, 0) : vectors);
    json_object_set(out, "figures", one ? json_array_get(figures, 0) : figures);
    json_decref(vectors);
    json_decref(figures);
    return out;
}

static json_t *answer_json(const sensor_choice *c, const solution *s) {
    json_t *sets = json_array(), *names = json_array();
    for (size_t k = 0; k < c->n_sets; k++) {
        const size_t set = c->sets[k];
        json_array_append_new(sets, solve_probes_are(c->all, set) ? solve_probes_json(c, s, set)
                                                                  : set_json(c, s, set));
    }
    for (size_t v = 0; s->names != NULL && v < s->n_vectors; v++)
        json_array_append_new(names, json_string(s->names[v]));
    json_t *out = json_pack("{s:s, s:s, s:s, s:o}", "scene", s->scene, "quantity", "irradiance", "unit",
                            output_unit(s, 0), "sensors", sets);
    if (s->names != NULL) json_object_set(out, "vectors", names);
    json_decref(names);
    return out;
}

/* [vectors of a batch][channels where there are several][receivers] */
static lam_status put_npy(const sensor_choice *c, const solution *s, FILE *stream, lam_error *error) {
    size_t shape[3], rank = 0, at = 0;
    const size_t C = s->m->n_channels, rows = s->n_vectors * C;
    float *values = memory_allocate(rows, c->n * sizeof *values, "sensors", error);
    if (values == NULL) return LAM_ERR_MEMORY;
    if (s->batch) shape[rank++] = s->n_vectors;
    if (C > 1) shape[rank++] = C;
    shape[rank++] = c->n;
    for (size_t row = 0; row < rows; row++)
        for (size_t k = 0; k < c->n_sets; k++) {
            size_t first, count;
            lam_sensors_set(c->all, c->sets[k], &first, &count);
            for (size_t i = first; i < first + count; i++) values[at++] = (float)sensor_value(c, s, row, i);
        }
    const lam_status status = output_array(stream, rank, shape, values, NULL, error);
    free(values);
    return status;
}

lam_status solve_sensors_put(const sensor_choice *c, const solution *s, const char *path, bool as_json,
                             lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file file = {0};
    char extension[16] = "";
    json_t *answer = NULL;
    if (path == NULL && !as_json) {
        put_table(c, s);
        return LAM_OK;
    }
    if (path != NULL && sensor_results_named(path)) return sensor_results_write(c, s, path, error);
    if (path != NULL) {
        atomic_file_extension(path, extension);
        TRY(atomic_file_open(path, &file, error));
    }
    if (as_json || strcmp(extension, "json") == 0) {
        answer = answer_json(c, s);
        if (path == NULL)
            TRY(json_print("standard output", answer, 0, error));
        else if (json_dumpf(answer, file.stream, 0) != 0)
            FAIL(error, LAM_ERR_MEMORY, "not enough memory for JSON");
    } else if (strcmp(extension, "csv") == 0) {
        put_csv(c, s, file.stream);
    } else if (strcmp(extension, "vtu") == 0) {
        sensor_points_vtu(c, s, file.stream);
    } else {
        TRY(solve_probes_are(c->all, c->sets[0]) ? solve_probes_npy(c, s, file.stream, error)
                                                 : put_npy(c, s, file.stream, error));
    }
    if (path != NULL) TRY(atomic_file_commit(&file, error));
done:
    json_decref(answer);
    atomic_file_abort(&file);
    return status;
}
