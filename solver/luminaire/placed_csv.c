/* A list of luminaires as CSV (RFC 4180): the first line names columns, and each other line becomes an object
 * like those of JSON, so that its values are checked in one place. */
#include "solver/luminaire/placed_parts.h"

#include "solver/base/nearest.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { CELL = 1024, CELLS_MOST = 64, WHOLE = 3 };

/* A column: the member that it is, or a part of; part: the place in an array of three, or WHOLE. */
typedef enum column_kind { TEXT, NUMBER, NAMES, TURN } column_kind;
typedef struct column_row {
    const char *name, *member;
    column_kind kind;
    size_t part;
} column_row;

static const column_row columns[] = {{"name", "name", TEXT, 0},
                                     {"group", "group", TEXT, 0},
                                     {"file", "file", TEXT, 0},
                                     {"opening", "opening", TEXT, 0},
                                     {"ignore", "ignore", NAMES, 0},
                                     {"x", "at", NUMBER, 0},
                                     {"y", "at", NUMBER, 1},
                                     {"z", "at", NUMBER, 2},
                                     {"aim_x", "aim", NUMBER, 0},
                                     {"aim_y", "aim", NUMBER, 1},
                                     {"aim_z", "aim", NUMBER, 2},
                                     {"aim_at_x", "aim_at", NUMBER, 0},
                                     {"aim_at_y", "aim_at", NUMBER, 1},
                                     {"aim_at_z", "aim_at", NUMBER, 2},
                                     {"turn_x", "axis", TURN, 0},
                                     {"turn_y", "axis", TURN, 1},
                                     {"turn_z", "axis", TURN, 2},
                                     {"turn_degrees", "degrees", TURN, WHOLE},
                                     {"c0_x", "c0", NUMBER, 0},
                                     {"c0_y", "c0", NUMBER, 1},
                                     {"c0_z", "c0", NUMBER, 2},
                                     {"c0_degrees", "c0", NUMBER, WHOLE},
                                     {"red", "colour", NUMBER, 0},
                                     {"green", "colour", NUMBER, 1},
                                     {"blue", "colour", NUMBER, 2},
                                     {"dim", "dim", NUMBER, WHOLE},
                                     {"maintenance", "maintenance", NUMBER, WHOLE},
                                     {"flux", "flux", NUMBER, WHOLE},
                                     {"cct", "cct", NUMBER, WHOLE},
                                     {"lamp_set", "lamp_set", NUMBER, WHOLE}};
enum { COLUMNS = sizeof columns / sizeof *columns };

/* The table while it is read: a line at a time. */
typedef struct table {
    const luminaire_source *s;
    char mark; /* between cells */
    size_t line, n_cells;
    char cells[CELLS_MOST][CELL];
    size_t n_columns;
    const column_row *of[CELLS_MOST];
} table;

/* The mark between the cells of a line: a comma, or a semicolon or tab where it has no comma. */
static char mark_of(const char *begin, const char *end) {
    const size_t length = (size_t)(end - begin);
    if (memchr(begin, ',', length) != NULL) return ',';
    return memchr(begin, ';', length) != NULL ? ';' : memchr(begin, '\t', length) != NULL ? '\t' : ',';
}

/* One cell from *at on, which then stands at its mark or the end. False where a quote is not closed, or where
 * it is too long. */
static bool read_cell(const char **at, const char *end, char mark, char out[CELL]) {
    char raw[CELL / 2];
    size_t n = 0;
    const char *c = *at;
    while (c < end && *c == ' ') c++;
    const bool quoted = c < end && *c == '"';
    bool closed = !quoted;
    for (c += quoted; c < end && (!closed || *c != mark); c++) {
        if (quoted && !closed && *c == '"') {
            closed = c + 1 >= end || c[1] != '"';
            if (closed) continue;
            c++;
        }
        if (quoted && closed && *c != ' ') return false;
        if (n == CELL / 2 - 1) return false; /* Latin-1 becomes UTF-8 */
        raw[n++] = *c;
    }
    *at = c;
    luminaire_clean(raw, raw + n, out, CELL);
    return closed;
}

/* Reads the cells of a line. Errors: LAM_ERR_FORMAT. */
static lam_status read_line(table *t, const char *begin, const char *end, lam_error *error) {
    lam_status status = LAM_OK;
    const char *at = begin;
    for (t->n_cells = 0;; at++) {
        if (t->n_cells == CELLS_MOST)
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu has more than %d cells", t->s->name, t->line,
                 CELLS_MOST);
        if (!read_cell(&at, end, t->mark, t->cells[t->n_cells++]))
            FAIL(error, LAM_ERR_FORMAT,
                 "%.200s: line %zu: cell %zu has a quote without its other one, or more than %d bytes",
                 t->s->name, t->line, t->n_cells, CELL / 2 - 1);
        if (at >= end) break;
    }
done:
    return status;
}

static const column_row *find_column(const char *name) {
    for (size_t k = 0; k < COLUMNS; k++)
        if (strcasecmp(columns[k].name, name) == 0) return &columns[k];
    return NULL;
}

bool placed_csv_is_it(const luminaire_source *s) {
    const char *at = s->text, *begin, *end;
    char cell[CELL];
    size_t known = 0;
    if (!luminaire_source_line(s, &at, &begin, &end)) return false;
    const char mark = mark_of(begin, end);
    for (at = begin; read_cell(&at, end, mark, cell); at++) {
        known += find_column(cell) != NULL;
        if (at == end) return known >= 3;
    }
    return false;
}

/* The names of the columns; those of name, file, x, y and z must be there. */
static lam_status read_head(table *t, lam_error *error) {
    static const char *const needed[] = {"name", "file", "x", "y", "z"};
    lam_status status = LAM_OK;
    const char *names[COLUMNS];
    char advice[512];
    for (size_t k = 0; k < COLUMNS; k++) names[k] = columns[k].name;
    t->n_columns = t->n_cells;
    for (size_t k = 0; k < t->n_cells; k++) {
        t->of[k] = find_column(t->cells[k]);
        if (t->of[k] == NULL) {
            nearest_advice(t->cells[k], COLUMNS, names, advice, sizeof advice);
            FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu: column %zu, \"%.60s\", is not known: %s",
                 t->s->name, t->line, k + 1, t->cells[k], advice);
        }
        for (size_t j = 0; j < k; j++)
            if (t->of[j] == t->of[k])
                FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu has the column %s twice", t->s->name, t->line,
                     t->of[k]->name);
    }
    for (size_t k = 0; k < sizeof needed / sizeof *needed; k++) {
        bool there = false;
        for (size_t j = 0; j < t->n_columns; j++) there = there || strcmp(t->of[j]->name, needed[k]) == 0;
        if (!there)
            FAIL(error, LAM_ERR_FORMAT,
                 "%.200s: line %zu has no column %s: name, file, x, y and z must be there", t->s->name,
                 t->line, needed[k]);
    }
done:
    return status;
}

/* Names between bars. */
static json_t *names_of(const char *text) {
    json_t *names = json_array();
    for (const char *at = text;; at++) {
        const char *begin = at, *end = at + strcspn(at, "|");
        at = end;
        luminaire_trim(&begin, &end);
        if (json_array_append_new(names, json_stringn(begin, (size_t)(end - begin))) != 0) {
            json_decref(names);
            return NULL;
        }
        if (*at == '\0') return names;
    }
}

/* Puts a number into an object, or into an array of three, or both into the object "turn". */
static bool set_number(json_t *object, const column_row *c, double number) {
    json_t *value = json_real(number);
    if (c->kind == TURN) {
        json_t *turn = json_object_get(object, "turn");
        if (turn == NULL && json_object_set_new(object, "turn", turn = json_object()) != 0) turn = NULL;
        object = turn;
    }
    if (c->part == WHOLE) return json_object_set_new(object, c->member, value) == 0;
    json_t *array = json_object_get(object, c->member);
    if (array == NULL && json_object_set_new(object, c->member, array = json_pack("[n, n, n]")) != 0)
        array = NULL;
    return json_array_set_new(array, c->part, value) == 0;
}

/* A cell as a member of the object. */
static lam_status set_cell(const table *t, size_t k, json_t *object, lam_error *error) {
    lam_status status = LAM_OK;
    const column_row *c = t->of[k];
    const char *text = t->cells[k];
    double number = 0;
    bool set = true;
    if (text[0] == '\0') return LAM_OK;
    const json_t *other = json_object_get(object, c->member);
    if (c->kind == TEXT) {
        set = json_object_set_new(object, c->member, json_string(text)) == 0;
    } else if (c->kind == NAMES) {
        set = json_object_set_new(object, c->member, names_of(text)) == 0;
    } else if (!luminaire_number(text, text + strlen(text), t->mark != ',', &number)) {
        FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu: %s = %.60s, must be a number", t->s->name, t->line,
             c->name, text);
    } else if (other != NULL && (c->part == WHOLE || json_is_number(other))) {
        FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu has c0_degrees beside c0_x, c0_y or c0_z", t->s->name,
             t->line);
    } else {
        set = set_number(object, c, number);
    }
    if (!set) FAIL(error, LAM_ERR_MEMORY, "%.200s: not enough memory for line %zu", t->s->name, t->line);
done:
    return status;
}

static lam_status add_line(const table *t, placed_reading *r, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *object = json_object();
    if (t->n_cells > t->n_columns)
        FAIL(error, LAM_ERR_FORMAT, "%.200s: line %zu has %zu cells, its first line names %zu columns",
             t->s->name, t->line, t->n_cells, t->n_columns);
    if (object == NULL) FAIL(error, LAM_ERR_MEMORY, "%.200s: not enough memory", t->s->name);
    for (size_t k = 0; k < t->n_cells; k++) TRY(set_cell(t, k, object, error));
    if (json_object_size(object) > 0) TRY(placed_entry(r, object, t->line, error));
done:
    json_decref(object);
    return status;
}

lam_status placed_csv(const luminaire_source *s, placed_reading *r, lam_error *error) {
    lam_status status = LAM_OK;
    const char *at = s->text, *begin, *end;
    table *t = memory_allocate(1, sizeof *t, s->name, error);
    if (t == NULL) return LAM_ERR_MEMORY;
    t->s = s;
    while (luminaire_source_line(s, &at, &begin, &end)) {
        t->line++;
        const char *first = begin, *last = end;
        luminaire_trim(&first, &last);
        if (first == last) continue;
        if (t->n_columns == 0) t->mark = mark_of(begin, end);
        TRY(read_line(t, begin, end, error));
        TRY(t->n_columns == 0 ? read_head(t, error) : add_line(t, r, error));
    }
done:
    free(t);
    return status;
}
