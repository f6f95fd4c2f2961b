#include "server/scene/sensor_places.h"

#include "solver/codec/json_writer.h"
#include "solver/operator/sensor_light.h"
#include "store/status.h"

#include <string.h>

/* The words of sets, as lists of sensors have them, and of weights (store/FORMAT.md). */
static const char *const kinds[] = {"points",        "grids",   "eyes",  "cylinders",
                                    "semicylinders", "spheres", "cubes", "probes"};
static const char *const weights[] = {"plane", "cylinder", "semicylinder", "sphere", "harmonics"};

/* Appends the word of a number; one that has none here as the number. */
static bool write_word(buffer *b, const char *const *words, size_t n_words, unsigned number) {
    return number < n_words ? buffer_printf(b, "\"%s\"", words[number]) : buffer_printf(b, "%u", number);
}

/* Receivers of a place: of a probe all nine harmonics. */
static size_t receivers_of_place(const sensor_set_shown *set) {
    return set->kind == SENSOR_SET_PROBES ? SENSOR_HARMONICS : 1;
}

/* The vectors of a receiver. */
typedef enum place_vector { PLACE_AT, PLACE_AXIS, PLACE_LOOK } place_vector;

static const double *vector_of(const sensor_shown *r, place_vector which) {
    return which == PLACE_AT ? r->at : which == PLACE_AXIS ? r->axis : r->look;
}

/* One vector where the receivers of a set share it, else one each; null where they have none. */
static bool write_vectors(buffer *b, const lam_sensors *l, const sensor_set_shown *set, const char *name,
                          place_vector which) {
    static const double zero[3];
    bool shared = which != PLACE_AT && set->count > 0;
    const sensor_shown one = sensors_shown(l, set->count > 0 ? set->first : 0);
    const double *first = vector_of(&one, which);
    const size_t step = receivers_of_place(set);
    for (size_t k = step; shared && k < set->count; k += step) {
        const sensor_shown r = sensors_shown(l, set->first + k);
        shared = memcmp(vector_of(&r, which), first, sizeof zero) == 0;
    }
    if (!buffer_printf(b, ",\"%s\":", name)) return false;
    if (shared && memcmp(first, zero, sizeof zero) == 0) return buffer_append_text(b, "null");
    if (shared) return json_write_doubles(b, first, 3);
    bool written = buffer_append(b, "[", 1);
    for (size_t k = 0; written && k < set->count; k += step) {
        const sensor_shown r = sensors_shown(l, set->first + k);
        written = (k == 0 || buffer_append(b, ",", 1)) && json_write_doubles(b, vector_of(&r, which), 3);
    }
    return written && buffer_append(b, "]", 1);
}

/* The places in the set of receivers that have this flag. */
static bool write_flagged(buffer *b, const lam_sensors *l, const sensor_set_shown *set, const char *name,
                          unsigned flag) {
    const size_t step = receivers_of_place(set);
    bool written = buffer_printf(b, ",\"%s\":[", name);
    for (size_t k = 0, count = 0; written && k < set->count; k += step)
        if ((sensors_shown(l, set->first + k).flags & flag) != 0)
            written = buffer_printf(b, count++ > 0 ? ",%zu" : "%zu", k / step);
    return written && buffer_append(b, "]", 1);
}

/* Rows and columns of a grid, its spacing, and the cell of each of its receivers. */
static bool write_grid(buffer *b, const lam_sensors *l, const sensor_set_shown *set) {
    if (set->rows == 0) return true;
    bool written = buffer_printf(b, ",\"rows\":%zu,\"columns\":%zu,\"spacing\":", set->rows, set->columns) &&
                   json_write_doubles(b, set->spacing, 2) && buffer_append_text(b, ",\"cells\":[");
    for (size_t k = 0; written && k < set->count; k++)
        written = buffer_printf(b, k > 0 ? ",%u" : "%u", sensors_shown(l, set->first + k).cell);
    return written && buffer_append(b, "]", 1);
}

static bool write_set(buffer *b, const lam_sensors *l, size_t k) {
    const sensor_set_shown set = sensors_set_shown(l, k);
    const unsigned weight = set.count > 0 ? sensors_shown(l, set.first).kind : 0;
    return buffer_append_text(b, "{\"name\":") && json_write_text(b, set.name) &&
           buffer_append_text(b, ",\"kind\":") &&
           write_word(b, kinds, sizeof kinds / sizeof *kinds, set.kind) &&
           buffer_append_text(b, ",\"weight\":") &&
           write_word(b, weights, sizeof weights / sizeof *weights, weight) &&
           buffer_printf(b, ",\"first\":%zu,\"count\":%zu", set.first, set.count) && write_grid(b, l, &set) &&
           write_vectors(b, l, &set, "at", PLACE_AT) && write_vectors(b, l, &set, "axis", PLACE_AXIS) &&
           write_vectors(b, l, &set, "look", PLACE_LOOK) &&
           write_flagged(b, l, &set, "in_walls", SENSOR_IN_WALL) &&
           write_flagged(b, l, &set, "in_luminaires", SENSOR_IN_LUMINAIRE) && buffer_append(b, "}", 1);
}

lam_status sensor_places_write(const lam_sensors *sensors, buffer *out, lam_error *error) {
    buffer b = {0};
    if (sensors == NULL) return LAM_OK;
    bool written = buffer_append_text(&b, "{\"sets\":[");
    for (size_t k = 0; written && k < lam_sensors_sets(sensors); k++)
        written = (k == 0 || buffer_append(&b, ",", 1)) && write_set(&b, sensors, k);
    written = written && buffer_printf(&b, "],\"sensors\":%zu}\n", lam_sensors_count(sensors));
    if (!written) {
        buffer_free(&b);
        return status_fail(error, LAM_ERR_MEMORY, "not enough memory for the sensors of a scene");
    }
    buffer_trim(&b);
    *out = b;
    return LAM_OK;
}
