#include "solver/luminaire/list_values.h"

#include "solver/base/length_unit.h"
#include "solver/base/nearest.h"
#include "solver/base/vector3.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

lam_status list_open(const luminaire_source *s, json_t **out, lam_error *error) {
    json_error_t where;
    *out = json_loadb(s->text, (size_t)(s->end - s->text), JSON_REJECT_DUPLICATES, &where);
    if (*out != NULL) return LAM_OK;
    const bool memory = json_error_code(&where) == json_error_out_of_memory;
    return status_fail(error, memory ? LAM_ERR_MEMORY : LAM_ERR_FORMAT, "%.200s: line %d, column %d: %.160s",
                       s->name, where.line, where.column, where.text);
}

lam_status list_unit(const char *name, const json_t *value, double *metres, lam_error *error) {
    char shown[LIST_SHOWN];
    if (value == NULL) return LAM_OK;
    const length_unit *unit = json_is_string(value) ? length_unit_find(json_string_value(value)) : NULL;
    if (unit != NULL) {
        *metres = unit->metres;
        return LAM_OK;
    }
    list_shown(value, shown);
    return status_fail(error, LAM_ERR_ARGUMENT, "%.200s: unit = %s, must be one of " LENGTH_UNIT_WORDS, name,
                       shown);
}

void list_shown(const json_t *value, char out[LIST_SHOWN]) {
    char *text =
        value != NULL ? json_dumps(value, JSON_ENCODE_ANY | JSON_COMPACT | JSON_REAL_PRECISION(10)) : NULL;
    const char *begin = text != NULL ? text : "nothing";
    luminaire_clean(begin, begin + strlen(begin), out, LIST_SHOWN);
    free(text);
}

lam_status list_members(json_t *object, size_t n, const char *const *words, const char *place,
                        lam_error *error) {
    lam_status status = LAM_OK;
    char shown[LIST_SHOWN], advice[256];
    if (!json_is_object(object)) {
        list_shown(object, shown);
        FAIL(error, LAM_ERR_ARGUMENT, "%s = %s, must be an object {...}", place, shown);
    }
    for (void *at = json_object_iter(object); at != NULL; at = json_object_iter_next(object, at)) {
        const char *key = json_object_iter_key(at);
        bool known = false;
        for (size_t k = 0; k < n; k++) known = known || strcmp(words[k], key) == 0;
        if (known) continue;
        nearest_advice(key, n, words, advice, sizeof advice);
        luminaire_clean(key, key + strlen(key), shown, sizeof shown);
        FAIL(error, LAM_ERR_ARGUMENT, "%s has a member \"%s\", which is not known: %s", place, shown, advice);
    }
done:
    return status;
}

lam_status list_wrong(const char *place, const char *what, const json_t *value, const char *limit,
                      lam_error *error) {
    char shown[LIST_SHOWN];
    list_shown(value, shown);
    return status_fail(error, LAM_ERR_ARGUMENT, "%s: %s = %s, %s", place, what, shown, limit);
}

lam_status list_number(const char *place, const char *what, const json_t *value, double least, double most,
                       bool above, double *out, lam_error *error) {
    char limit[LUMINAIRE_LIMIT];
    if (!json_is_number(value)) return list_wrong(place, what, value, "must be a number", error);
    const double number = json_number_value(value);
    if (!luminaire_in_limits(number, least, most, above, limit))
        return list_wrong(place, what, value, limit, error);
    *out = number;
    return LAM_OK;
}

lam_status list_vector(const char *place, const char *what, const json_t *value, double out[3],
                       lam_error *error) {
    lam_status status = LAM_OK;
    if (!json_is_array(value) || json_array_size(value) != 3)
        return list_wrong(place, what, value, "must be an array of three numbers", error);
    for (size_t d = 0; d < 3; d++)
        TRY(list_number(place, what, json_array_get(value, d), -LIST_LENGTH_MOST, LIST_LENGTH_MOST, false,
                        &out[d], error));
done:
    return status;
}

lam_status list_direction(const char *place, const char *what, const json_t *value, double out[3],
                          lam_error *error) {
    const lam_status status = list_vector(place, what, value, out, error);
    if (status != LAM_OK) return status;
    return list_normalize(out) ? LAM_OK : list_wrong(place, what, value, "must have a length above 0", error);
}

bool list_normalize(double v[3]) {
    /* The largest component is divided out first, so that no square overflows or vanishes. */
    const double most = fmax(fmax(fabs(v[0]), fabs(v[1])), fabs(v[2]));
    if (!(most > 0) || !isfinite(most)) return false;
    for (int d = 0; d < 3; d++) v[d] /= most;
    const double length = sqrt(dot3(v, v));
    for (int d = 0; d < 3; d++) v[d] /= length;
    return true;
}
