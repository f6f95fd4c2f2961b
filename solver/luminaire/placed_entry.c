/* One entry of a list of luminaires: every member is checked, and a row or a grid becomes its luminaires. */
#include "solver/luminaire/placed_parts.h"

#include "solver/base/array_grow.h"
#include "solver/base/photometry.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DIMENSIONS = 3, TEXT_MOST = 1000 }; /* TEXT_MOST: bytes of a path */

/* An entry while it is read. One luminaire is a grid of one. */
typedef struct entry {
    placed_reading *r;
    json_t *value;
    char place[PLACED_PLACE];
    placed_luminaire made; /* but its name, place and frame */
    double from[3], steps[DIMENSIONS][3];
    size_t dimensions, counts[DIMENSIONS], n;
} entry;

void placed_place(const char *name, bool is_csv, size_t k, char out[PLACED_PLACE]) {
    snprintf(out, PLACED_PLACE, is_csv ? "%.200s: line %zu" : "%.200s: luminaires[%zu]", name, k);
}

/* The number of a member that may be left out. */
static lam_status read_number(const entry *e, const char *key, double least, double most, bool above,
                              double *out, lam_error *error) {
    const json_t *value = json_object_get(e->value, key);
    return value == NULL ? LAM_OK : list_number(e->place, key, value, least, most, above, out, error);
}

/* A text of one line without control characters, marks of the direction of writing, blanks at its ends, or
 * one of the marks; *out stays as it is after an error. */
static lam_status read_text(const entry *e, const char *key, const json_t *value, const char *marks,
                            size_t room, char *out, lam_error *error) {
    char limit[96], clean[TEXT_MOST + 1];
    const char *text = json_string_value(value);
    if (text == NULL) return list_wrong(e->place, key, value, "must be a text", error);
    const size_t length = json_string_length(value);
    snprintf(limit, sizeof limit, "must have 1 to %zu bytes, none of them 0", room - 1);
    if (length == 0 || length >= room || strlen(text) != length)
        return list_wrong(e->place, key, value, limit, error);
    luminaire_clean(text, text + length, clean, sizeof clean);
    if (strcmp(clean, text) != 0 || strpbrk(text, marks) != NULL) {
        snprintf(limit, sizeof limit, "must have no control character, no blank at its ends%s",
                 marks[0] != '\0' ? ", no '=' and no ','" : "");
        return list_wrong(e->place, key, value, limit, error);
    }
    memcpy(out, text, length + 1);
    return LAM_OK;
}

/* Commas and equal signs stand between names and weights elsewhere. */
static lam_status read_name(const entry *e, const char *key, char out[PLACED_NAME], lam_error *error) {
    return read_text(e, key, json_object_get(e->value, key), "=,", PLACED_NAME, out, error);
}

static lam_status read_set(const entry *e, size_t *set, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *value = json_object_get(e->value, "lamp_set");
    double number = 0;
    TRY(read_number(e, "lamp_set", 1, LUMINAIRE_SETS_MOST, false, &number, error));
    if (number != floor(number))
        TRY(list_wrong(e->place, "lamp_set", value, "must be a whole number", error));
    *set = (size_t)number;
done:
    return status;
}

/* Finds the file of an entry among those of the list, or adds it. A word of "files" stands for its path. */
static lam_status read_file(entry *e, lam_error *error) {
    lam_status status = LAM_OK;
    placed_luminaires *out = e->r->out;
    const json_t *value = json_object_get(e->value, "file");
    char text[TEXT_MOST + 1];
    size_t set = 0;
    if (value == NULL) FAIL(error, LAM_ERR_ARGUMENT, "%s has no file: it must name one", e->place);
    const char *word = json_string_value(value);
    const json_t *path = word != NULL ? json_object_get(e->r->files, word) : NULL;
    TRY(read_text(e, "file", path != NULL ? path : value, "", sizeof text, text, error));
    TRY(read_set(e, &set, error));
    size_t k = 0;
    while (k < out->n_files && (out->files[k].set != set || strcmp(out->files[k].name, text) != 0)) k++;
    if (k == PLACED_FILES_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: the list names more than %d files", e->place, PLACED_FILES_MOST);
    if (k == out->n_files) {
        const size_t room = strlen(text) + 1;
        TRY(array_grow(&out->files, &e->r->files_capacity, k + 1, sizeof *out->files, e->r->name, error));
        char *name = memory_allocate(room, 1, e->r->name, error);
        if (name == NULL) TRY(LAM_ERR_MEMORY);
        memcpy(name, text, room);
        out->files[k] = (placed_file){.name = name, .set = set, .entry = e->made.entry};
        out->n_files++;
    }
    e->made.file = k;
done:
    return status;
}

static lam_status read_light(entry *e, lam_error *error) {
    lam_status status = LAM_OK;
    placed_luminaire *l = &e->made;
    const json_t *colour = json_object_get(e->value, "colour"), *cct = json_object_get(e->value, "cct");
    double kelvin = 0;
    TRY(read_number(e, "dim", 0, 1000, false, &l->dim, error));
    TRY(read_number(e, "maintenance", 0, 1, true, &l->maintenance, error));
    TRY(read_number(e, "flux", 0, LUMINAIRE_CANDELA_MOST, true, &l->flux, error));
    TRY(read_number(e, "cct", PLACED_KELVIN_LEAST, PLACED_KELVIN_MOST, false, &kelvin, error));
    if (cct != NULL && colour != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s has cct and colour; it must have one of them", e->place);
    if (cct != NULL) placed_planck(kelvin, l->colour);
    if (colour != NULL) {
        TRY(list_vector(e->place, "colour", colour, l->colour, error));
        const double luminance = luminance_of(l->colour[0], l->colour[1], l->colour[2]);
        if (!(fmin(fmin(l->colour[0], l->colour[1]), l->colour[2]) >= 0) || !(luminance > 0))
            TRY(list_wrong(e->place, "colour", colour, "must have no number below 0, and one above", error));
        for (int c = 0; c < 3; c++) l->colour[c] /= luminance;
    }
    l->scale = l->dim * l->maintenance;
done:
    return status;
}

static lam_status read_opening(entry *e, lam_error *error) {
    lam_status status = LAM_OK;
    placed_luminaires *out = e->r->out;
    const json_t *opening = json_object_get(e->value, "opening"),
                 *ignore = json_object_get(e->value, "ignore");
    if (opening != NULL) {
        const char *word = json_is_string(opening) ? json_string_value(opening) : "";
        e->made.is_point = strcmp(word, "point") == 0;
        if (!e->made.is_point && strcmp(word, "file") != 0)
            TRY(list_wrong(e->place, "opening", opening, "must be \"file\" or \"point\"", error));
    }
    if (ignore != NULL && !json_is_array(ignore))
        TRY(list_wrong(e->place, "ignore", ignore, "must be an array of names of groups", error));
    const size_t n = json_array_size(ignore);
    if (n > PLACED_MOST - out->n_ignored)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: with it ignore has %zu names in all, must have at most %d",
             e->place, n + out->n_ignored, PLACED_MOST);
    e->made.ignored = out->n_ignored;
    e->made.n_ignored = n;
    if (n > 0)
        TRY(array_grow(&out->ignored, &e->r->ignored_capacity, out->n_ignored + n, sizeof *out->ignored,
                       e->r->name, error));
    for (size_t k = 0; k < n; k++)
        TRY(read_text(e, "a name of ignore", json_array_get(ignore, k), "", PLACED_IGNORED,
                      out->ignored[out->n_ignored++].text, error));
done:
    return status;
}

/* Steps and counts of a row or a grid. */
static lam_status read_steps(entry *e, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *steps = json_object_get(e->value, "steps"), *counts = json_object_get(e->value, "counts");
    const size_t n = json_array_size(steps);
    double all = 1, count = 0;
    if (steps == NULL || counts == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s has from; then it must have steps and counts too", e->place);
    if (n < 1 || n > DIMENSIONS)
        TRY(list_wrong(e->place, "steps", steps, "must be an array of 1 to 3 steps [x, y, z]", error));
    if (json_array_size(counts) != n)
        TRY(list_wrong(e->place, "counts", counts, "must be an array of a number for each step", error));
    for (size_t k = 0; k < n; k++) {
        TRY(list_vector(e->place, "a step", json_array_get(steps, k), e->steps[k], error));
        TRY(list_number(e->place, "a count", json_array_get(counts, k), 1, PLACED_MOST, false, &count,
                        error));
        if (count != floor(count))
            TRY(list_wrong(e->place, "counts", counts, "must be whole numbers", error));
        const double *step = e->steps[k];
        if (count > 1 && step[0] == 0 && step[1] == 0 && step[2] == 0)
            TRY(list_wrong(e->place, "steps", steps,
                           "must have a length above 0 where there is more than one", error));
        for (int d = 0; d < 3; d++) e->steps[k][d] *= e->r->unit;
        e->counts[k] = (size_t)count;
        all *= count;
    }
    if (all > PLACED_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: counts make %.0f luminaires, must be at most %d", e->place, all,
             PLACED_MOST);
    e->dimensions = n;
    e->n = (size_t)all;
done:
    return status;
}

static lam_status read_place(entry *e, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *at = json_object_get(e->value, "at"), *from = json_object_get(e->value, "from");
    if ((at == NULL) == (from == NULL))
        FAIL(error, LAM_ERR_ARGUMENT, "%s must have at, the place of one, or from, the first of a row",
             e->place);
    TRY(list_vector(e->place, at != NULL ? "at" : "from", at != NULL ? at : from, e->from, error));
    for (int d = 0; d < 3; d++) e->from[d] *= e->r->unit;
    e->n = 1;
    if (from != NULL)
        TRY(read_steps(e, error));
    else if (json_object_get(e->value, "steps") != NULL || json_object_get(e->value, "counts") != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s has at; steps and counts are for a row, which has from", e->place);
done:
    return status;
}

/* The turn of a file of positions: {"axis": [x, y, z], "degrees": d}. */
static lam_status read_turn(const entry *e, json_t *turn, placed_luminaire *l, lam_error *error) {
    static const char *const words[] = {"axis", "degrees"};
    lam_status status = LAM_OK;
    char inside[PLACED_PLACE + 8];
    double axis[3], degrees = 0;
    snprintf(inside, sizeof inside, "%s: turn", e->place);
    TRY(list_members(turn, 2, words, inside, error));
    TRY(list_direction(e->place, "axis of turn", json_object_get(turn, "axis"), axis, error));
    TRY(list_number(e->place, "degrees of turn", json_object_get(turn, "degrees"), -LIST_LENGTH_MOST,
                    LIST_LENGTH_MOST, false, &degrees, error));
    placed_turn(axis, degrees, e->r->up, l);
done:
    return status;
}

/* Turns a luminaire whose place is known. */
static lam_status read_frame(const entry *e, placed_luminaire *l, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *aim = json_object_get(e->value, "aim"), *aim_at = json_object_get(e->value, "aim_at"),
                 *c0 = json_object_get(e->value, "c0");
    json_t *turn = json_object_get(e->value, "turn");
    double direction[3], axis[3] = {0}, degrees = 0;
    placed_hang(e->r->up, l);
    for (int d = 0; d < 3; d++) direction[d] = -l->z[d];
    if ((aim != NULL) + (aim_at != NULL) + (turn != NULL) > 1)
        FAIL(error, LAM_ERR_ARGUMENT, "%s must have one of aim, aim_at and turn, not several", e->place);
    if (turn != NULL && c0 != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s has turn, which turns C0 too; then it must have no c0", e->place);
    if (turn != NULL) return read_turn(e, turn, l, error);
    if (aim != NULL) TRY(list_direction(e->place, "aim", aim, direction, error));
    if (aim_at != NULL) {
        TRY(list_vector(e->place, "aim_at", aim_at, direction, error));
        for (int d = 0; d < 3; d++) direction[d] = direction[d] * e->r->unit - l->at[d];
        if (!list_normalize(direction))
            TRY(list_wrong(e->place, "aim_at", aim_at, "must be another place than its own", error));
    }
    if (json_is_number(c0))
        TRY(list_number(e->place, "c0", c0, -LIST_LENGTH_MOST, LIST_LENGTH_MOST, false, &degrees, error));
    else if (json_is_array(c0))
        TRY(list_direction(e->place, "c0", c0, axis, error));
    else if (c0 != NULL)
        TRY(list_wrong(e->place, "c0", c0, "must be a direction [x, y, z] or a number of degrees", error));
    if (!placed_aim(direction, json_is_array(c0) ? axis : NULL, degrees, e->r->up, l))
        TRY(list_wrong(e->place, "c0", c0, "must not lie along the aim", error));
done:
    return status;
}

/* Adds luminaire k of an entry, counted with the last step first. */
static lam_status add_luminaire(entry *e, const char *name, size_t k, lam_error *error) {
    lam_status status = LAM_OK;
    placed_luminaires *out = e->r->out;
    placed_luminaire l = e->made;
    size_t place[DIMENSIONS] = {0}, rest = k;
    char full[PLACED_NAME + 64];
    int length = snprintf(full, sizeof full, "%s", name);
    for (size_t j = e->dimensions; j-- > 0; rest /= e->counts[j]) place[j] = rest % e->counts[j];
    memcpy(l.at, e->from, sizeof l.at);
    for (size_t j = 0; j < e->dimensions; j++) {
        length += snprintf(full + length, sizeof full - (size_t)length, ".%zu", place[j]);
        for (int d = 0; d < 3; d++) l.at[d] += (double)place[j] * e->steps[j][d];
    }
    if (length >= PLACED_NAME)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: the name %s has %d bytes, must have at most %d", e->place, full,
             length, PLACED_NAME - 1);
    memcpy(l.name, full, (size_t)length + 1);
    TRY(read_frame(e, &l, error));
    out->luminaires[out->n++] = l;
done:
    return status;
}

lam_status placed_entry(placed_reading *r, json_t *value, size_t k, lam_error *error) {
    static const char *const words[] = {
        "name", "group", "file", "at",  "from",   "steps",       "counts",   "aim",     "aim_at", "turn",
        "c0",   "dim",   "flux", "cct", "colour", "maintenance", "lamp_set", "opening", "ignore"};
    lam_status status = LAM_OK;
    entry e = {.r = r, .value = value};
    char name[PLACED_NAME];
    e.made = (placed_luminaire){
        .dim = 1, .maintenance = 1, .flux = NAN, .scale = 1, .colour = {1, 1, 1}, .entry = k};
    placed_place(r->name, r->out->is_csv, k, e.place);
    TRY(list_members(value, sizeof words / sizeof *words, words, e.place, error));
    if (json_object_get(value, "name") == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s has no name: it must have one", e.place);
    TRY(read_name(&e, "name", name, error));
    TRY(read_place(&e, error));
    if (json_object_get(value, "group") != NULL)
        TRY(read_name(&e, "group", e.made.group, error));
    else if (e.dimensions > 0)
        memcpy(e.made.group, name, sizeof name);
    if (e.n > PLACED_MOST - r->out->n)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: with it there are %zu luminaires, must be at most %d", e.place,
             e.n + r->out->n, PLACED_MOST);
    TRY(read_file(&e, error));
    TRY(read_light(&e, error));
    TRY(read_opening(&e, error));
    TRY(array_grow(&r->out->luminaires, &r->capacity, r->out->n + e.n, sizeof *r->out->luminaires, r->name,
                   error));
    for (size_t j = 0; j < e.n; j++) TRY(add_luminaire(&e, name, j, error));
done:
    return status;
}
