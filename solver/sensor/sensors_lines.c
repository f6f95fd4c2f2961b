/* Lists of sensors that have a line for each: CSV with named columns, and points of Radiance. */
#include "solver/base/nearest.h"
#include "solver/sensor/sensors_parts.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { COLUMNS = 7, CELL = 256, SHOWN = 64 };

static const char *const columns[COLUMNS] = {"name", "x", "y", "z", "nx", "ny", "nz"};

/* The lines while they are read. */
typedef struct lines {
    const luminaire_source *s;
    sensors_reading *r;
    char mark; /* between cells */
    size_t line;
    size_t n_columns, of[COLUMNS]; /* the column of each cell */
} lines;

/* The mark between the cells of a line: a comma, or a semicolon or tab where it has no comma. */
static char mark_of(const char *begin, const char *end) {
    const size_t length = (size_t)(end - begin);
    if (memchr(begin, ',', length) != NULL) return ',';
    return memchr(begin, ';', length) != NULL ? ';' : memchr(begin, '\t', length) != NULL ? '\t' : ',';
}

/* The next cell, from *at on, which then stands behind its mark, or is NULL at the end. Quotes about all of
 * it are left out; a name has no mark in it. */
static void next_cell(const char **at, const char *end, char mark, const char **begin, const char **last) {
    const char *stop = memchr(*at, mark, (size_t)(end - *at));
    *begin = *at;
    *last = stop != NULL ? stop : end;
    *at = stop != NULL ? stop + 1 : NULL;
    luminaire_trim(begin, last);
    if (*last - *begin >= 2 && **begin == '"' && (*last)[-1] == '"') {
        ++*begin;
        --*last;
    }
}

static size_t find_column(const char *begin, const char *end) {
    size_t k = 0;
    for (; k < COLUMNS; k++)
        if (strlen(columns[k]) == (size_t)(end - begin) &&
            strncasecmp(columns[k], begin, (size_t)(end - begin)) == 0)
            break;
    return k;
}

bool sensors_is_csv(const luminaire_source *s) {
    const char *at = s->text, *begin, *end;
    size_t known = 0;
    if (!luminaire_source_line(s, &at, &begin, &end)) return false;
    const char mark = mark_of(begin, end);
    for (at = begin; at != NULL;) {
        const char *first, *last;
        next_cell(&at, end, mark, &first, &last);
        known += find_column(first, last) < COLUMNS;
    }
    return known >= 3;
}

static lam_status read_head(lines *t, const char *at, const char *end, lam_error *error) {
    lam_status status = LAM_OK;
    char cell[CELL], advice[256];
    bool there[COLUMNS] = {false};
    while (at != NULL) {
        const char *begin, *last;
        next_cell(&at, end, t->mark, &begin, &last);
        const size_t column = find_column(begin, last);
        if (column == COLUMNS) {
            luminaire_clean(begin, last, cell, SHOWN);
            nearest_advice(cell, COLUMNS, columns, advice, sizeof advice);
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu: column %zu, \"%s\", is not known: %s", t->s->name,
                 t->line, t->n_columns + 1, cell, advice);
        }
        if (there[column])
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu has the column %s twice", t->s->name, t->line,
                 columns[column]);
        there[column] = true;
        t->of[t->n_columns++] = column;
    }
    for (size_t k = 0; k < 4; k++)
        if (!there[k])
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu has no column %s: name, x, y and z must be there",
                 t->s->name, t->line, columns[k]);
done:
    return status;
}

/* Adds a plane receiver; a length of 0 of its normal is refused. */
static lam_status add_point(lines *t, const double number[6], lam_error *error) {
    lam_status status = LAM_OK;
    char place[SENSORS_PLACE], limit[LUMINAIRE_LIMIT];
    receiver one = {.kind = RECEIVER_PLANE};
    snprintf(place, sizeof place, "%.200s: line %zu", t->s->name, t->line);
    for (int d = 0; d < 6; d++)
        if (!luminaire_in_limits(number[d], -LIST_LENGTH_MOST, LIST_LENGTH_MOST, false, limit))
            FAIL(error, LAM_ERR_ARGUMENT, "%s: %s = %g, %s", place, columns[d + 1], number[d], limit);
    for (int d = 0; d < 3; d++) {
        one.at[d] = number[d] * t->r->unit;
        one.axis[d] = number[3 + d];
    }
    if (!list_normalize(one.axis))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: the normal %g %g %g must have a length above 0", place, number[3],
             number[4], number[5]);
    TRY(sensors_add(t->r, &one, SENSOR_NO_CELL, place, error));
done:
    return status;
}

/* Begins a set unless the last one has this name. */
static lam_status begin_set(lines *t, const char *begin, const char *end, lam_error *error) {
    lam_status status = LAM_OK;
    sensor_list *out = t->r->out;
    sensor_set set = {.kind = SENSOR_POINTS, .entry = t->line};
    char name[CELL], place[SENSORS_PLACE];
    const char *limit;
    luminaire_clean(begin, end, name, sizeof name);
    snprintf(place, sizeof place, "%.200s: line %zu", t->s->name, t->line);
    if (!sensors_is_name(name, strlen(name), &limit))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: name = %.60s, %s", place, name, limit);
    if (out->n_sets > 0 && strcmp(out->sets[out->n_sets - 1].name, name) == 0) goto done;
    memcpy(set.name, name, strlen(name) + 1);
    TRY(sensors_begin(t->r, &set, place, error));
done:
    return status;
}

static lam_status read_line(lines *t, const char *at, const char *end, lam_error *error) {
    lam_status status = LAM_OK;
    double number[6] = {0}, up[3];
    bool there[COLUMNS] = {false};
    const char *name[2] = {at, at};
    size_t k = 0;
    sensors_up(t->r->up, up);
    for (; at != NULL; k++) {
        const char *begin, *last;
        next_cell(&at, end, t->mark, &begin, &last);
        if (k >= t->n_columns)
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu has more cells than the %zu columns of the first",
                 t->s->name, t->line, t->n_columns);
        const size_t column = t->of[k];
        there[column] = begin < last;
        if (column == 0) {
            name[0] = begin;
            name[1] = last;
        } else if (begin < last && !luminaire_number(begin, last, t->mark != ',', &number[column - 1])) {
            char cell[CELL];
            luminaire_clean(begin, last, cell, SHOWN);
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu: %s = %s, must be a number", t->s->name, t->line,
                 columns[column], cell);
        }
    }
    for (size_t c = 0; c < 4; c++)
        if (!there[c])
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu has no %s", t->s->name, t->line, columns[c]);
    if (!there[4] && !there[5] && !there[6]) memcpy(number + 3, up, sizeof up);
    TRY(begin_set(t, name[0], name[1], error));
    TRY(add_point(t, number, error));
done:
    return status;
}

lam_status sensors_csv(const luminaire_source *s, sensors_reading *r, lam_error *error) {
    lam_status status = LAM_OK;
    lines t = {.s = s, .r = r};
    const char *at = s->text, *begin, *end;
    while (luminaire_source_line(s, &at, &begin, &end)) {
        const char *first = begin, *last = end;
        t.line++;
        luminaire_trim(&first, &last);
        if (first == last) continue;
        if (t.n_columns == 0) {
            t.mark = mark_of(begin, end);
            TRY(read_head(&t, begin, end, error));
        } else {
            TRY(read_line(&t, begin, end, error));
        }
    }
done:
    return status;
}

/* The numbers of a line between blanks or commas; how many there are, at most `most`, and SIZE_MAX where a
 * word is none. */
static size_t numbers_of(const char *begin, const char *end, size_t most, double *out, const char *bad[2]) {
    const luminaire_source line = {.text = begin, .end = end};
    const char *at = begin, *first, *last;
    size_t n = 0;
    while (luminaire_source_word(&line, &at, &first, &last)) {
        double value;
        bad[0] = first;
        bad[1] = last;
        if (!luminaire_number(first, last, false, &value)) return SIZE_MAX;
        if (n < most) out[n] = value;
        n++;
    }
    return n;
}

bool sensors_is_pts(const luminaire_source *s) {
    const char *at = s->text, *begin, *end, *bad[2];
    double number[6];
    while (luminaire_source_line(s, &at, &begin, &end)) {
        luminaire_trim(&begin, &end);
        if (begin < end && *begin != '#') return numbers_of(begin, end, 6, number, bad) == 6;
    }
    return false;
}

lam_status sensors_pts(const luminaire_source *s, const char *set_name, sensors_reading *r,
                       lam_error *error) {
    lam_status status = LAM_OK;
    lines t = {.s = s, .r = r};
    sensor_set set = {.kind = SENSOR_POINTS, .entry = 1};
    const char *at = s->text, *begin, *end;
    memcpy(set.name, set_name, strlen(set_name) + 1);
    TRY(sensors_begin(r, &set, s->name, error));
    while (luminaire_source_line(s, &at, &begin, &end)) {
        const char *bad[2] = {begin, begin};
        double number[6];
        t.line++;
        luminaire_trim(&begin, &end);
        if (begin == end || *begin == '#') continue;
        const size_t n = numbers_of(begin, end, 6, number, bad);
        if (n == SIZE_MAX) {
            char cell[CELL];
            luminaire_clean(bad[0], bad[1], cell, SHOWN);
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu: %s must be a number", s->name, t.line, cell);
        }
        if (n != 6)
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu has %zu numbers, must have 6: x y z dx dy dz",
                 s->name, t.line, n);
        TRY(add_point(&t, number, error));
    }
done:
    return status;
}
