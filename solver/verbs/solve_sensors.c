#include "solver/verbs/solve_sensors.h"

#include "solver/base/atomic_file.h"
#include "solver/base/csv_text.h"
#include "solver/figures/point_figures.h"
#include "solver/operator/sensor_light.h"
#include "solver/verbs/json_print.h"
#include "solver/verbs/sensor_files.h"
#include "solver/verbs/solve_eyes.h"
#include "solver/verbs/solve_probes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void sensor_choice_free(sensor_choice *c) {
    lam_sensors_close(c->all);
    free(c->sets);
    free(c->stated);
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

lam_status sensor_choice_least(const char *text, sensor_choice *out, lam_error *error) {
    out->n_least = 0;
    for (const char *at = text; *at != '\0' || at == text;) {
        char *end;
        const double least = strtod(at, &end);
        if (end == at || !isfinite(least) || (*end != ',' && *end != '\0') || (*end == ',' && end[1] == '\0'))
            return status_fail(error, LAM_ERR_ARGUMENT, "--at-least %.60s: must be numbers, X,X,...", text);
        if (out->n_least == SENSOR_LEAST_MOST)
            return status_fail(error, LAM_ERR_ARGUMENT, "--at-least %.60s: at most %d numbers", text,
                               SENSOR_LEAST_MOST);
        out->least[out->n_least++] = least;
        at = *end == ',' ? end + 1 : end;
    }
    return LAM_OK;
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

/* The values of a set in a vector and channel, [count]. */
static void set_values(const sensor_choice *c, const solution *s, size_t row, size_t set, double *x) {
    size_t first, count;
    lam_sensors_set(c->all, set, &first, &count);
    for (size_t i = 0; i < count; i++) x[i] = sensor_value(c, s, row, first + i);
}

/* The most receivers of a set of the store. */
static size_t largest_set(const sensor_choice *c) {
    size_t most = 0, first, count;
    for (size_t k = 0; k < lam_sensors_sets(c->all); k++) {
        lam_sensors_set(c->all, k, &first, &count);
        if (count > most) most = count;
    }
    return most;
}

/* The set of planes whose receivers stand, in this order, at the places of a set of cylinders and face along
 * their axes; the number of sets where there is none. */
static size_t planes_beside(const sensor_choice *c, size_t cylinders) {
    const size_t n_sets = lam_sensors_sets(c->all);
    size_t first, count, begin, n, set = 0;
    lam_sensors_set(c->all, cylinders, &first, &count);
    if (count == 0 || sensors_shown(c->all, first).kind != RECEIVER_KIND_CYLINDER) return n_sets;
    for (; set < n_sets; set++) {
        size_t same = 0;
        lam_sensors_set(c->all, set, &begin, &n);
        for (; n == count && same < n; same++) {
            const sensor_shown a = sensors_shown(c->all, first + same),
                               b = sensors_shown(c->all, begin + same);
            if (b.kind != RECEIVER_KIND_PLANE ||
                !point_is_at((faced_point){a.at, a.axis}, (faced_point){b.at, b.axis}))
                break;
        }
        if (same == count) break;
    }
    return set;
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

/* The work of a table or of JSON: values of a set and of one beside it. */
typedef struct figures_work {
    const sensor_choice *c;
    const solution *s;
    bool rated; /* eyes are */
    eyes_asked eyes;
    double *x, *y; /* [largest set] */
} figures_work;

static void work_free(figures_work *w) {
    eyes_free(&w->eyes);
    free(w->x);
    free(w->y);
}

static lam_status work_open(const sensor_choice *c, const solution *s, const emission *light,
                            const double (*suns)[3], figures_work *out, lam_error *error) {
    const size_t most = largest_set(c);
    *out = (figures_work){.c = c, .s = s, .rated = eyes_are_rated(s)};
    out->x = memory_allocate(most, sizeof *out->x, "figures of sensors", error);
    out->y = memory_allocate(most, sizeof *out->y, "figures of sensors", error);
    if (out->x == NULL || out->y == NULL) return LAM_ERR_MEMORY;
    return eyes_open(c->all, s->m, light, out->rated ? suns : NULL, &out->eyes, error);
}

/* "name, unit" of a vector and channel. */
static void row_name(const solution *s, size_t row, char of[OUTPUT_COLUMN + 32]) {
    char name[OUTPUT_COLUMN];
    const char *unit = output_unit(s, row / s->m->n_channels);
    output_column(s, row / s->m->n_channels, row % s->m->n_channels, name);
    snprintf(of, OUTPUT_COLUMN + 32, unit[0] != '\0' ? "%s, %s" : "%s", name, unit);
}

static void print_set(const figures_work *w, size_t set) {
    const sensor_choice *c = w->c;
    size_t first, count;
    const char *name = lam_sensors_set(c->all, set, &first, &count);
    for (size_t row = 0; row < w->s->n_vectors * w->s->m->n_channels; row++) {
        char of[OUTPUT_COLUMN + 32];
        set_values(c, w->s, row, set, w->x);
        const point_figures f = point_figures_of(count, w->x);
        row_name(w->s, row, of);
        printf("%-24s %8zu %-24s %10.6g %10.6g %10.6g %10.3g", name, f.n, of, f.mean, f.min, f.max,
               f.uniformity);
        for (size_t k = 0; k < c->n_least; k++)
            printf(" %8.3g %%", 100 * point_share(count, w->x, c->least[k]));
        printf("\n");
    }
}

/* E_z / E_h of a set of cylinders. */
static void print_modelling(const figures_work *w, size_t set, bool *begun) {
    const size_t planes = planes_beside(w->c, set);
    size_t first, count;
    char of[OUTPUT_COLUMN];
    if (planes == lam_sensors_sets(w->c->all) || w->s->names != NULL) return;
    if (!*begun)
        printf("\n%-24s %8s %-24s %10s %10s %10s  %s\n", "modelling", "points", "of", "mean", "min", "max",
               "cylinders over planes");
    *begun = true;
    for (size_t row = 0; row < w->s->n_vectors * w->s->m->n_channels; row++) {
        set_values(w->c, w->s, row, set, w->x);
        set_values(w->c, w->s, row, planes, w->y);
        const char *beside = lam_sensors_set(w->c->all, planes, &first, &count),
                   *name = lam_sensors_set(w->c->all, set, &first, &count);
        point_ratios(count, w->x, w->y, w->x);
        const point_figures f = point_figures_of(count, w->x);
        output_column(w->s, row / w->s->m->n_channels, row % w->s->m->n_channels, of);
        printf("%-24s %8zu %-24s %10.3g %10.3g %10.3g  %s\n", name, f.n, of, f.mean, f.min, f.max, beside);
    }
}

static void print_eyes(figures_work *w) {
    const char *daylight = w->eyes.light->L == NULL ? "" : "       DGPs";
    bool begun = false;
    for (size_t k = 0; w->rated && k < w->c->n_sets; k++) {
        const sensor_set_shown set = sensors_set_shown(w->c->all, w->c->sets[k]);
        if (set.kind != SENSOR_SET_EYES) continue;
        if (!begun)
            printf("\n%-24s %8s %-24s %10s %10s%s%s  %s\n", "eyes", "place", w->s->batch ? "vector" : "",
                   "UGR", "L_b, cd/m2", daylight, w->eyes.suns != NULL ? "    " : "",
                   "parts of luminaires in UGR");
        begun = true;
        eyes_print(&w->eyes, w->s, set.name, set.first, set.count);
    }
}

static void put_table(figures_work *w) {
    bool begun = false;
    printf("%-24s %8s %-24s %10s %10s %10s %10s", "sensors", "points", "of", "mean", "min", "max",
           "min/mean");
    for (size_t k = 0; k < w->c->n_least; k++) printf("   >= %5.4g", w->c->least[k]);
    printf("\n");
    for (size_t k = 0; k < w->c->n_sets; k++) {
        if (solve_probes_are(w->c->all, w->c->sets[k]))
            solve_probes_print(w->c, w->s, w->c->sets[k]);
        else
            print_set(w, w->c->sets[k]);
    }
    for (size_t k = 0; k < w->c->n_sets; k++) print_modelling(w, w->c->sets[k], &begun);
    print_eyes(w);
}

static json_t *number(double x) {
    return isnan(x) ? json_null() : json_real(x);
}

static json_t *vector3_json(const double x[3]) {
    return json_pack("[f, f, f]", x[0], x[1], x[2]);
}

static json_t *numbers_json(size_t n, const double *x) {
    json_t *out = json_array();
    for (size_t i = 0; i < n; i++) json_array_append_new(out, number(x[i]));
    return out;
}

/* {"mean", "min", "max", "uniformity"}, and "share" of thresholds. */
static json_t *figures_json(const sensor_choice *c, size_t n, const double *x) {
    const point_figures f = point_figures_of(n, x);
    json_t *out = json_pack("{s:o, s:o, s:o, s:o}", "mean", number(f.mean), "min", number(f.min), "max",
                            number(f.max), "uniformity", number(f.uniformity));
    json_t *shares = json_array();
    for (size_t k = 0; k < c->n_least; k++)
        json_array_append_new(shares, number(point_share(n, x, c->least[k])));
    if (c->n_least > 0) json_object_set(out, "share", shares);
    json_decref(shares);
    return out;
}

/* {"beside", "mean", "min", "max", "values"} of a vector and channel. */
static json_t *modelling_json(const figures_work *w, size_t row, size_t planes) {
    size_t first, count;
    set_values(w->c, w->s, row, planes, w->y);
    const char *beside = lam_sensors_set(w->c->all, planes, &first, &count);
    point_ratios(count, w->x, w->y, w->y);
    const point_figures f = point_figures_of(count, w->y);
    return json_pack("{s:s, s:o, s:o, s:o, s:o}", "beside", beside, "mean", number(f.mean), "min",
                     number(f.min), "max", number(f.max), "values", numbers_json(count, w->y));
}

/* [{"ugr", ...}, ...] of the eyes of a set. */
static json_t *eyes_of_set(figures_work *w, size_t vector, size_t first, size_t count) {
    json_t *out = json_array();
    for (size_t i = first; i < first + count; i++)
        json_array_append_new(out, eyes_json(&w->eyes, w->s, vector, i, !w->s->batch));
    return out;
}

/* {"name", "at": [[x, y, z], ...], "values": [...], "figures": {...}}, with "modelling" of cylinders and
 * "eyes"; all but the first two an array of vectors and of channels where there are several, "eyes" one of
 * vectors. */
static json_t *set_json(figures_work *w, size_t set) {
    const sensor_choice *c = w->c;
    const solution *s = w->s;
    const size_t C = s->m->n_channels, planes = planes_beside(c, set);
    const sensor_set_shown shown = sensors_set_shown(c->all, set);
    const bool one = !s->batch && C == 1, models = planes < lam_sensors_sets(c->all) && s->names == NULL,
               rated = w->rated && shown.kind == SENSOR_SET_EYES;
    json_t *places = json_array(), *vectors = json_array(), *figures = json_array(), *ratios = json_array(),
           *eyes = json_array();
    for (size_t i = shown.first; i < shown.first + shown.count; i++)
        json_array_append_new(places, vector3_json(sensors_shown(c->all, i).at));
    for (size_t row = 0; row < s->n_vectors * C; row++) {
        set_values(c, s, row, set, w->x);
        json_array_append_new(vectors, numbers_json(shown.count, w->x));
        json_array_append_new(figures, figures_json(c, shown.count, w->x));
        if (models) json_array_append_new(ratios, modelling_json(w, row, planes));
    }
    for (size_t v = 0; rated && v < s->n_vectors; v++)
        json_array_append_new(eyes, eyes_of_set(w, v, shown.first, shown.count));
    json_t *out = json_pack("{s:s, s:o}", "name", shown.name, "at", places);
    json_object_set(out, "values", one ? json_array_get(vectors, 0) : vectors);
    json_object_set(out, "figures", one ? json_array_get(figures, 0) : figures);
    if (models) json_object_set(out, "modelling", one ? json_array_get(ratios, 0) : ratios);
    if (rated) json_object_set(out, "eyes", s->batch ? eyes : json_array_get(eyes, 0));
    json_decref(vectors);
    json_decref(figures);
    json_decref(ratios);
    json_decref(eyes);
    return out;
}

static json_t *answer_json(figures_work *w) {
    const sensor_choice *c = w->c;
    const solution *s = w->s;
    json_t *sets = json_array(), *names = json_array();
    for (size_t k = 0; k < c->n_sets; k++) {
        const size_t set = c->sets[k];
        json_t *one = solve_probes_are(c->all, set) ? solve_probes_json(c, s, set) : set_json(w, set);
        if (c->stated != NULL) json_object_set_new(one, "error", number(c->stated[k]));
        json_array_append_new(sets, one);
    }
    for (size_t v = 0; s->names != NULL && v < s->n_vectors; v++)
        json_array_append_new(names, json_string(s->names[v]));
    json_t *out = json_pack("{s:s, s:s, s:s, s:o}", "scene", s->scene, "quantity", "irradiance", "unit",
                            output_unit(s, 0), "sensors", sets);
    if (s->names != NULL) json_object_set(out, "vectors", names);
    if (c->stated != NULL) json_object_set_new(out, "error", number(headline_stated(&s->head)));
    if (c->n_least > 0) json_object_set_new(out, "at_least", numbers_json(c->n_least, c->least));
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

lam_status solve_sensors_put(const sensor_choice *c, const solution *s, const emission *light,
                             const double (*suns)[3], const char *path, bool as_json, lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file file = {0};
    char extension[16] = "";
    json_t *answer = NULL;
    figures_work work;
    TRY(work_open(c, s, light, suns, &work, error));
    if (path == NULL && !as_json) {
        put_table(&work);
        output_print_error(s);
        goto done;
    }
    if (path != NULL && sensor_results_named(path)) {
        TRY(sensor_results_write(c, s, path, error));
        goto done;
    }
    if (path != NULL) {
        atomic_file_extension(path, extension);
        TRY(atomic_file_open(path, &file, error));
    }
    if (as_json || strcmp(extension, "json") == 0) {
        answer = answer_json(&work);
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
    work_free(&work);
    json_decref(answer);
    atomic_file_abort(&file);
    return status;
}
