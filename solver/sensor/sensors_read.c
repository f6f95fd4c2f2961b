/* A list of sensors is read: its format is found, and its sets are checked as a whole. */
#include "solver/base/array_grow.h"
#include "solver/base/file_stem.h"
#include "solver/base/file_text.h"
#include "solver/base/utf8.h"
#include "solver/sensor/sensors_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const char *const words[SENSOR_SET_KINDS] = {
    [SENSOR_POINTS] = "points",       [SENSOR_GRIDS] = "grids",     [SENSOR_EYES] = "eyes",
    [SENSOR_CYLINDERS] = "cylinders", [SENSOR_SPHERES] = "spheres", [SENSOR_SEMICYLINDERS] = "semicylinders",
    [SENSOR_CUBES] = "cubes",         [SENSOR_PROBES] = "probes"};

const char *sensor_set_word(sensor_set_kind kind) {
    return words[kind];
}

void sensors_free(sensor_list *l) {
    free(l->sets);
    free(l->receivers);
    free(l->cell);
    *l = (sensor_list){.n = 0};
}

void sensors_up(char up, double out[3]) {
    for (int d = 0; d < 3; d++) out[d] = up - 'x' == d;
}

bool sensors_is_name(const char *text, size_t length, const char **limit) {
    char clean[SENSOR_NAME];
    *limit = "must be a name of 1 to 63 bytes";
    if (length == 0 || length >= SENSOR_NAME || strlen(text) != length) return false;
    luminaire_clean(text, text + length, clean, sizeof clean);
    *limit = "must have no control character, no blank at its ends, no '=' and no ','";
    return strcmp(clean, text) == 0 && strpbrk(text, "=,") == NULL;
}

lam_status sensors_begin(sensors_reading *r, const sensor_set *set, const char *place, lam_error *error) {
    lam_status status = LAM_OK;
    sensor_list *out = r->out;
    if (out->n_sets == SENSOR_SETS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: the file has more than %d sets", place, SENSOR_SETS_MOST);
    TRY(array_grow(&out->sets, &r->sets_capacity, out->n_sets + 1, sizeof *out->sets, r->name, error));
    out->sets[out->n_sets] = *set;
    out->sets[out->n_sets++].first = out->n;
done:
    return status;
}

static lam_status add_one(sensors_reading *r, const receiver *one, uint32_t cell, const char *place,
                          lam_error *error) {
    lam_status status = LAM_OK;
    sensor_list *out = r->out;
    if (out->n == SENSORS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: with it the file has more than %d sensors", place, SENSORS_MOST);
    TRY(array_grow(&out->receivers, &r->receivers_capacity, out->n + 1, sizeof *out->receivers, r->name,
                   error));
    TRY(array_grow(&out->cell, &r->cells_capacity, out->n + 1, sizeof *out->cell, r->name, error));
    out->receivers[out->n] = *one;
    out->cell[out->n++] = cell;
    out->sets[out->n_sets - 1].count++;
done:
    return status;
}

lam_status sensors_add(sensors_reading *r, const receiver *one, uint32_t cell, const char *place,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const sensor_set_kind kind = r->out->sets[r->out->n_sets - 1].kind;
    if (kind != SENSOR_CUBES && kind != SENSOR_PROBES) return add_one(r, one, cell, place, error);
    for (int k = 0; k < HARMONICS && kind == SENSOR_PROBES; k++) {
        receiver harmonic = *one;
        harmonic.kind = (receiver_kind)(RECEIVER_HARMONIC + k);
        TRY(add_one(r, &harmonic, cell, place, error));
    }
    for (int face = 0; face < 6 && kind == SENSOR_CUBES; face++) {
        receiver side = *one;
        for (int d = 0; d < 3; d++) side.axis[d] = d == face / 2 ? (face % 2 == 0 ? 1 : -1) : 0;
        TRY(add_one(r, &side, cell, place, error));
    }
done:
    return status;
}

static lam_status read_json(const luminaire_source *s, sensors_reading *r, lam_error *error) {
    lam_status status = LAM_OK;
    const char *members[SENSOR_SET_KINDS + 1];
    char place[SENSORS_PLACE];
    json_t *root = NULL;
    TRY(list_open(s, &root, error));
    memcpy(members, words, sizeof words);
    members[SENSOR_SET_KINDS] = "unit";
    snprintf(place, sizeof place, "%.200s: the file", s->name);
    TRY(list_members(root, SENSOR_SET_KINDS + 1, members, place, error));
    TRY(list_unit(r->name, json_object_get(root, "unit"), &r->unit, error));
    for (int kind = 0; kind < SENSOR_SET_KINDS; kind++)
        TRY(sensors_array(r, (sensor_set_kind)kind, json_object_get(root, words[kind]), error));
done:
    json_decref(root);
    return status;
}

static int by_name(const void *a, const void *b) {
    const sensor_set *const *first = a, *const *second = b;
    const int order = strcmp((*first)->name, (*second)->name);
    /* Equal names stand as in the list, so that messages do not depend on the sort. */
    return order != 0 ? order : (*first > *second) - (*first < *second);
}

/* A name stands for one set. */
static lam_status check_names(const sensor_list *l, const char *name, bool is_json, lam_error *error) {
    lam_status status = LAM_OK;
    const sensor_set **sorted = memory_allocate(l->n_sets, sizeof *sorted, name, error);
    if (sorted == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < l->n_sets; k++) sorted[k] = &l->sets[k];
    qsort(sorted, l->n_sets, sizeof *sorted, by_name);
    for (size_t k = 1; k < l->n_sets; k++) {
        const sensor_set *one = sorted[k - 1], *other = sorted[k];
        if (strcmp(one->name, other->name) != 0) continue;
        if (is_json)
            FAIL(error, LAM_ERR_ARGUMENT, "%.200s: %s[%zu]: name = %s, which %s[%zu] has too", name,
                 words[other->kind], other->entry, other->name, words[one->kind], one->entry);
        FAIL(error, LAM_ERR_ARGUMENT,
             "%.200s: line %zu: name = %s, which the sensors of line %zu have too; lines of one name must "
             "follow each other",
             name, other->entry, other->name, one->entry);
    }
done:
    free(sorted);
    return status;
}

static bool begins_as_json(const luminaire_source *s) {
    const char *begin = s->text, *end = s->end;
    luminaire_trim(&begin, &end);
    return begin < end && (*begin == '{' || *begin == '[');
}

static lam_status too_large(const char *name, size_t length, lam_error *error) {
    return status_fail(error, LAM_ERR_FORMAT,
                       "%.200s: has %zu bytes, more than the %zu MiB that a list of sensors may have", name,
                       length, SENSORS_BYTES_MOST >> 20);
}

/* The name of the only set of a file: its own, without folder and extension. */
static lam_status stem_of(const char *name, char out[SENSOR_NAME], lam_error *error) {
    char *stem = file_stem(name);
    if (stem == NULL) return status_fail(error, LAM_ERR_MEMORY, "%.200s: not enough memory", name);
    luminaire_clean(stem, stem + strlen(stem), out, SENSOR_NAME);
    for (char *c = out; *c != '\0'; c++)
        if (*c == '=' || *c == ',') *c = '_';
    if (out[0] == '\0') snprintf(out, SENSOR_NAME, "points");
    free(stem);
    return LAM_OK;
}

lam_status sensors_read_text(const char *name, const char *text, size_t length,
                             const sensors_options *options, sensor_list *out, lam_error *error) {
    lam_status status = LAM_OK;
    luminaire_source s;
    sensor_list l = {.n = 0};
    char stem[SENSOR_NAME];
    sensors_reading r = {.name = name,
                         .out = &l,
                         .unit = options->unit > 0 ? options->unit : 1,
                         .up = options->up != 0 ? options->up : 'z',
                         .m = options->m};
    if (length > SENSORS_BYTES_MOST) TRY(too_large(name, length, error));
    TRY(luminaire_source_begin(name, text, length, &s, error));
    const bool is_json = begins_as_json(&s) || (luminaire_is_named(name, ".json") && !sensors_is_csv(&s));
    if (is_json) {
        TRY(read_json(&s, &r, error));
    } else if (!sensors_is_csv(&s) && (luminaire_is_named(name, ".pts") || sensors_is_pts(&s))) {
        TRY(stem_of(name, stem, error));
        TRY(sensors_pts(&s, stem, &r, error));
    } else {
        TRY(sensors_csv(&s, &r, error));
    }
    if (l.n == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: has no sensor, must have 1 to %d", name, SENSORS_MOST);
    TRY(check_names(&l, name, is_json, error));
    *out = l;
    l = (sensor_list){.n = 0};
done:
    sensors_free(&l);
    return status;
}

lam_status sensors_read(const char *path, const sensors_options *options, sensor_list *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    struct stat about;
    char *text = NULL;
    size_t length = 0;
    if (stat(path, &about) == 0 && S_ISREG(about.st_mode) && about.st_size > (off_t)SENSORS_BYTES_MOST)
        TRY(too_large(path, (size_t)about.st_size, error));
    TRY(file_text(path, &text, &length, error));
    TRY(sensors_read_text(path, text, length, options, out, error));
done:
    free(text);
    return status;
}
