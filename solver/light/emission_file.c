/* Emissions from JSON files; every number is checked before it becomes light. */
#include "solver/base/atomic_file.h"
#include "solver/light/emission.h"

#include <errno.h>
#include <jansson.h>
#include <string.h>

/* What a reader is filling: vector number `vector`. */
typedef struct reading {
    const char *path;
    const mesh *m;
    emission_sources there;
    size_t vector;
    float *E;       /* [C][n] of this vector */
    emission *made; /* all vectors, whose L comes into being with the first sky */
    lam_error *error;
} reading;

static lam_status check_value(const reading *r, size_t index, double value, float *out) {
    return emission_check_value(r->path, r->vector, index, value, out, r->error);
}

/* A number, or one number per channel. */
static lam_status read_channels(const reading *r, size_t index, const json_t *value, float *out) {
    lam_status status = LAM_OK;
    const size_t n_channels = r->m->n_channels;
    const bool many = json_is_array(value);
    if (many && json_array_size(value) != n_channels)
        FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu, value %zu has %zu numbers, needs 1 or %zu",
             r->path, r->vector, index, json_array_size(value), n_channels);
    for (size_t c = 0; c < n_channels; c++) {
        const json_t *number = many ? json_array_get(value, c) : value;
        if (!json_is_number(number))
            FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu, value %zu is no number", r->path, r->vector,
                 index);
        TRY(check_value(r, index, json_number_value(number), &out[c]));
    }
done:
    return status;
}

static lam_status read_row(const reading *r, size_t channel, const json_t *row, float *out) {
    lam_status status = LAM_OK;
    if (json_array_size(row) != r->m->n)
        FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu has %zu values, the store has %zu elements",
             r->path, r->vector, json_array_size(row), r->m->n);
    for (size_t i = 0; i < r->m->n; i++) {
        const json_t *number = json_array_get(row, i);
        if (!json_is_number(number))
            FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu, value %zu is no number", r->path, r->vector,
                 channel * r->m->n + i);
        TRY(check_value(r, channel * r->m->n + i, json_number_value(number), &out[i]));
    }
done:
    return status;
}

/* [e0, e1, ...] or C rows of it. */
static lam_status read_dense(const reading *r, const json_t *array) {
    lam_status status = LAM_OK;
    const size_t n = r->m->n, n_channels = r->m->n_channels;
    const bool rows = json_is_array(json_array_get(array, 0));
    if (rows && json_array_size(array) != n_channels)
        FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu has %zu rows, the store has %zu channels", r->path,
             r->vector, json_array_size(array), n_channels);
    for (size_t c = 0; c < n_channels; c++)
        TRY(read_row(r, c, rows ? json_array_get(array, c) : array, r->E + c * n));
done:
    return status;
}

static lam_status read_elements(const reading *r, const json_t *elements, const json_t *values) {
    lam_status status = LAM_OK;
    const size_t n = r->m->n, n_channels = r->m->n_channels;
    float channels[16];
    if (!json_is_array(elements) || !json_is_array(values) || n_channels > 16 ||
        json_array_size(elements) != json_array_size(values))
        FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu: elements and values must be arrays of one length",
             r->path, r->vector);
    for (size_t k = 0; k < json_array_size(elements); k++) {
        const json_t *index = json_array_get(elements, k);
        if (!json_is_integer(index) || json_integer_value(index) < 0 ||
            (size_t)json_integer_value(index) >= n)
            FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu: elements[%zu] must be from 0 to %zu", r->path,
                 r->vector, k, n - 1);
        TRY(read_channels(r, k, json_array_get(values, k), channels));
        for (size_t c = 0; c < n_channels; c++) r->E[c * n + (size_t)json_integer_value(index)] = channels[c];
    }
done:
    return status;
}

typedef struct group_light {
    const reading *r;
    const float *channels;
} group_light;

static void light_group(void *context, size_t group) {
    const group_light *l = context;
    const mesh *m = l->r->m;
    for (size_t c = 0; c < m->n_channels; c++)
        for (size_t i = 0; i < m->n; i++)
            if (m->group[i] == group) l->r->E[c * m->n + i] = l->channels[c];
}

static lam_status read_groups(const reading *r, json_t *groups) {
    lam_status status = LAM_OK;
    float channels[16];
    size_t k = 0;
    if (!json_is_object(groups) || r->m->n_channels > 16)
        FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu: groups must be an object", r->path, r->vector);
    for (void *at = json_object_iter(groups); at != NULL; at = json_object_iter_next(groups, at), k++) {
        TRY(read_channels(r, k, json_object_iter_value(at), channels));
        group_light light = {r, channels};
        if (emission_match_groups(r->m, json_object_iter_key(at), light_group, &light) == 0)
            FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu: no group \"%.60s\" in the store", r->path,
                 r->vector, json_object_iter_key(at));
    }
done:
    return status;
}

/* One radiance a tile, W/(m^2 sr). */
static lam_status read_sky(const reading *r, const json_t *sky) {
    lam_status status = LAM_OK;
    const size_t m = r->there.n_tiles, n_channels = r->m->n_channels;
    float channels[16];
    if (m == 0)
        FAIL(r->error, LAM_ERR_ARGUMENT,
             "%s: emission %zu asks for a sky, the store has none; precompute with --sky", r->path,
             r->vector);
    if (!json_is_array(sky) || n_channels > 16 || json_array_size(sky) != m)
        FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu: sky must be an array of %zu values, one a tile",
             r->path, r->vector, m);
    if (r->made->L == NULL)
        TRY(emission_allocate(r->path, n_channels, m, r->made->n_vectors, &r->made->L, r->error));
    for (size_t t = 0; t < m; t++) {
        TRY(read_channels(r, t, json_array_get(sky, t), channels));
        for (size_t c = 0; c < n_channels; c++)
            r->made->L[(r->vector * n_channels + c) * m + t] = channels[c];
    }
done:
    return status;
}

/* One weight an emitter. */
static lam_status read_emitters(const reading *r, const json_t *weights) {
    lam_status status = LAM_OK;
    const size_t s = r->there.n_emitters, n_channels = r->m->n_channels;
    float channels[16];
    if (s == 0)
        FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu asks for emitters, the store has none", r->path,
             r->vector);
    if (!json_is_array(weights) || n_channels > 16 || json_array_size(weights) != s)
        FAIL(r->error, LAM_ERR_ARGUMENT,
             "%s: emission %zu: emitters must be an array of %zu values, one for each", r->path, r->vector,
             s);
    if (r->made->W == NULL)
        TRY(emission_allocate(r->path, n_channels, s, r->made->n_vectors, &r->made->W, r->error));
    for (size_t k = 0; k < s; k++) {
        TRY(read_channels(r, k, json_array_get(weights, k), channels));
        for (size_t c = 0; c < n_channels; c++)
            r->made->W[(r->vector * n_channels + c) * s + k] = channels[c];
    }
done:
    return status;
}

/* The contract's EMISSION. */
static lam_status read_one(const reading *r, const json_t *value) {
    lam_status status = LAM_OK;
    if (json_is_array(value)) return read_dense(r, value);
    if (!json_is_object(value))
        FAIL(r->error, LAM_ERR_ARGUMENT, "%s: emission %zu is neither an array nor an object", r->path,
             r->vector);
    json_t *groups = json_object_get(value, "groups");
    const json_t *elements = json_object_get(value, "elements"), *values = json_object_get(value, "values");
    const json_t *sky = json_object_get(value, "sky"), *emitters = json_object_get(value, "emitters");
    const int ways = (groups != NULL) + (elements != NULL) + (emitters != NULL);
    const size_t members = (size_t)ways + (elements != NULL) + (sky != NULL);
    if (ways > 1 || (elements == NULL) != (values == NULL) || members == 0 ||
        json_object_size(value) > members)
        FAIL(r->error, LAM_ERR_ARGUMENT,
             "%s: emission %zu must be an array, or {\"elements\", \"values\"} or {\"groups\"} or "
             "{\"emitters\"} or "
             "{\"sky\"} or the last beside one of them",
             r->path, r->vector);
    if (groups != NULL) TRY(read_groups(r, groups));
    if (elements != NULL) TRY(read_elements(r, elements, values));
    if (sky != NULL) TRY(read_sky(r, sky));
    if (emitters != NULL) TRY(read_emitters(r, emitters));
done:
    return status;
}

/* Whether an array is a batch of dense emissions rather than one. */
static bool is_array_batch(const json_t *value, const mesh *m) {
    const json_t *first = json_array_get(value, 0);
    if (json_is_object(first)) return true;
    if (!json_is_array(first)) return false;
    return json_is_array(json_array_get(first, 0)) || (m->n_channels == 1 && json_array_size(value) > 1);
}

static lam_status json_emission(const char *path, const mesh *m, emission_sources there, emission *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    emission made = {.n_vectors = 1};
    json_error_t place;
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, &place);
    if (root == NULL && place.line < 0) FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
    if (root == NULL)
        FAIL(error, LAM_ERR_FORMAT, "%s: line %d, column %d: not JSON: %s", path, place.line, place.column,
             place.text);
    const json_t *value = root, *one = json_object_get(root, "emission"),
                 *many = json_object_get(root, "emissions");
    if (one != NULL && many != NULL) FAIL(error, LAM_ERR_ARGUMENT, "%s: both emission and emissions", path);
    if (one != NULL) value = one;
    if (many != NULL) value = many;
    made.batch = many != NULL || is_array_batch(value, m);
    if (made.batch) made.n_vectors = json_array_size(value);
    if (made.n_vectors == 0) FAIL(error, LAM_ERR_ARGUMENT, "%s: an empty batch", path);
    TRY(emission_allocate(path, m->n_channels, m->n, made.n_vectors, &made.E, error));
    for (size_t v = 0; v < made.n_vectors; v++) {
        const reading r = {path, m, there, v, made.E + v * m->n * m->n_channels, &made, error};
        TRY(read_one(&r, made.batch ? json_array_get(value, v) : value));
    }
    *out = made;
    made = (emission){0};
done:
    emission_free(&made);
    json_decref(root);
    return status;
}

lam_status emission_read(const char *path, const mesh *m, emission_sources there, emission *out,
                         lam_error *error) {
    char extension[16];
    output_file_extension(path, extension);
    if (strcmp(extension, "npy") == 0) return emission_read_npy(path, m, out, error);
    if (strcmp(extension, "json") == 0) return json_emission(path, m, there, out, error);
    return status_fail(error, LAM_ERR_ARGUMENT, "--emission %s: must end in .npy or .json", path);
}
