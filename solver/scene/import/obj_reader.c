/* Reads OBJ + MTL in double precision. libassimp would keep coordinates in single precision, merge the names
 * of `o` and `g`, invent a diffuse colour and only log a missing MTL. Runs in the child. */
#include "solver/base/array_grow.h"
#include "solver/base/file_text.h"
#include "solver/scene/import/imported_faces.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A text cut into lines, each NUL-terminated, without leading or trailing blanks; '\' joins a line to the
 * next.
 */
typedef struct line_cursor {
    char *next, *end;
    uint32_t number; /* of the line given last, from 1 */
    uint32_t following;
} line_cursor;

/* Passes over a byte order mark, which some editors put before UTF-8. */
static lam_status begin_lines(const char *path, char *text, size_t length, line_cursor *cursor,
                              lam_error *error) {
    static const char mark[] = "\xEF\xBB\xBF";
    lam_status status = LAM_OK;
    const size_t skip = length >= 3 && memcmp(text, mark, 3) == 0 ? 3 : 0;
    if (length >= 2 && (memcmp(text, "\xFF\xFE", 2) == 0 || memcmp(text, "\xFE\xFF", 2) == 0))
        FAIL(error, LAM_ERR_FORMAT, "%s: the text is UTF-16; save it as UTF-8", path);
    *cursor = (line_cursor){.next = text + skip, .end = text + length};
done:
    return status;
}

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

static char *next_line(line_cursor *cursor) {
    if (cursor->next >= cursor->end) return NULL;
    char *line = cursor->next, *stop = line;
    cursor->number = ++cursor->following;
    for (; stop < cursor->end && *stop != '\n'; stop++) {
        if (*stop == '\0') *stop = ' ';
        const size_t skip = stop[0] == '\\' ? (stop[1] == '\n'                      ? 1
                                               : stop[1] == '\r' && stop[2] == '\n' ? 2
                                                                                    : 0)
                                            : 0;
        if (skip == 0) continue;
        memset(stop, ' ', skip + 1);
        stop += skip;
        cursor->following++;
    }
    cursor->next = stop + 1;
    *stop = '\0';
    while (stop > line && is_blank(stop[-1])) *--stop = '\0';
    while (is_blank(*line)) line++;
    return line;
}

/* The text behind keyword in line, or NULL where the line does not begin with it. */
static char *after_keyword(char *line, const char *keyword) {
    const size_t length = strlen(keyword);
    if (strncmp(line, keyword, length) != 0) return NULL;
    line += length;
    if (*line != '\0' && !is_blank(*line)) return NULL;
    while (is_blank(*line)) line++;
    return line;
}

/* Reads up to count numbers; returns how many. */
static size_t read_numbers(const char *text, size_t count, double *out) {
    size_t n = 0;
    for (char *stop; n < count; n++, text = stop) {
        out[n] = strtod(text, &stop);
        if (stop == text || (*stop != '\0' && !is_blank(*stop))) break;
    }
    return n;
}

static lam_status read_colour(const char *path, uint32_t line, const char *text, double out[3],
                              lam_error *error) {
    lam_status status = LAM_OK;
    double rgb[3];
    const size_t n = read_numbers(text, 3, rgb);
    if (n != 1 && n != 3) FAIL(error, LAM_ERR_FORMAT, "%s:%u: '%.60s' is not a colour", path, line, text);
    for (size_t k = 0; k < 3; k++) out[k] = rgb[n == 1 ? 0 : k];
done:
    return status;
}

static lam_status read_mtl(const char *path, imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    size_t length = 0;
    uint32_t current = TABLE_NONE;
    char *rest, *text = NULL;
    line_cursor cursor;
    TRY(file_text(path, &text, &length, error));
    TRY(begin_lines(path, text, length, &cursor, error));
    for (char *line; (line = next_line(&cursor)) != NULL;) {
        if ((rest = after_keyword(line, "newmtl")) != NULL) {
            TRY(imported_faces_add_material(s, rest, strlen(rest), &current, error));
            if (s->values[current].defined) {
                import_warn(&s->warnings, "%s:%u: material '%s' is defined again; the first one counts", path,
                            cursor.number, rest);
                current = TABLE_NONE;
            } else
                s->values[current].defined = 1;
        } else if (current == TABLE_NONE) {
            continue;
        } else if ((rest = after_keyword(line, "Kd")) != NULL) {
            TRY(read_colour(path, cursor.number, rest, s->values[current].diffuse, error));
            s->values[current].has_diffuse = 1;
        } else if ((rest = after_keyword(line, "Ke")) != NULL) {
            TRY(read_colour(path, cursor.number, rest, s->values[current].emission, error));
        } else if (after_keyword(line, "map_Kd") != NULL) {
            s->values[current].textured = 1;
        } else if (after_keyword(line, "map_Ke") != NULL) {
            import_warn(&s->warnings, "%s:%u: the texture of material '%s' is ignored; its emission is Ke",
                        path, cursor.number, name_table_get(&s->materials, current));
        }
    }
done:
    free(text);
    return status;
}

/* Reads a material file; *found is false where it does not exist. */
static lam_status read_library(const char *path, uint32_t line, const char *file, imported_faces *s,
                               bool *found, lam_error *error) {
    lam_status status = LAM_OK;
    char full[ASSET_PATH];
    const asset_place place = asset_find(path, s->assets, file, full);
    *found = place == ASSET_FOUND;
    if (place == ASSET_OUTSIDE)
        FAIL(error, LAM_ERR_FORMAT,
             "%s:%u: the material file '%s' lies outside the scene's folder; --assets with its folder lets "
             "it be read",
             path, line, file);
    if (*found) TRY(read_mtl(full, s, error));
done:
    return status;
}

/* One name with blanks in it, or several names; "\ " is a blank inside a name. */
static lam_status read_libraries(const char *path, uint32_t line, char *names, imported_faces *s,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    bool found;
    TRY(read_library(path, line, names, s, &found, error));
    while (!found && *names != '\0') {
        char *file = names, *out = names;
        for (; *names != '\0' && !is_blank(*names); names++) {
            if (names[0] == '\\' && is_blank(names[1])) names++;
            *out++ = *names;
        }
        while (is_blank(*names)) names++;
        const bool more = *names != '\0';
        if (out < names) *out = '\0';
        TRY(read_library(path, line, file, s, &found, error));
        if (!found)
            FAIL(error, LAM_ERR_FORMAT,
                 "%s:%u: the material file '%s' is missing; put it beside the OBJ or remove the mtllib line",
                 path, line, file);
        found = !more;
    }
done:
    return status;
}

typedef struct obj_state {
    const char *path;
    imported_faces *s;
    uint32_t object, group, material;
    uint32_t *corners; /* of the face being read */
    size_t corner_capacity;
} obj_state;

static lam_status read_vertex(obj_state *o, uint32_t line, const char *text, lam_error *error) {
    lam_status status = LAM_OK;
    double vertex[3];
    if (read_numbers(text, 3, vertex) != 3)
        FAIL(error, LAM_ERR_FORMAT, "%s:%u: a vertex needs three numbers, this is '%.80s'", o->path, line,
             text);
    for (int k = 0; k < 3; k++)
        if (!(fabs(vertex[k]) < 1e30))
            FAIL(error, LAM_ERR_FORMAT, "%s:%u: vertex coordinate %g is not a usable number", o->path, line,
                 vertex[k]);
    TRY(imported_faces_add_vertex(o->s, vertex, error));
done:
    return status;
}

static lam_status read_face(obj_state *o, uint32_t line, const char *text, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    while (*text != '\0') {
        char *stop;
        errno = 0;
        const long long given = strtoll(text, &stop, 10);
        if (stop == text || (*stop != '\0' && *stop != '/' && !is_blank(*stop)))
            FAIL(error, LAM_ERR_FORMAT, "%s:%u: '%.40s' is not a vertex of a face", o->path, line, text);
        /* A negative index counts back from the vertex read last. A positive one may refer to a later line.
         */
        const long long index = given < 0 ? (long long)o->s->n_vertices + given : given - 1;
        if (errno != 0 || given == 0 || index < 0 || index >= (long long)TABLE_NONE)
            FAIL(error, LAM_ERR_FORMAT,
                 "%s:%u: vertex index %.*s of a face, must be 1 to %zu or count back from there", o->path,
                 line, (int)(stop - text), text, o->s->n_vertices);
        TRY(array_grow(&o->corners, &o->corner_capacity, n + 1, sizeof *o->corners, "face corners", error));
        o->corners[n++] = (uint32_t)index;
        for (text = stop; *text != '\0' && !is_blank(*text);) text++;
        while (is_blank(*text)) text++;
    }
    if (n > 0)
        TRY(imported_faces_add_polygon(o->s, o->corners, n, o->object != TABLE_NONE ? o->object : o->group,
                                       o->material, line, error));
done:
    return status;
}

/* The index of a name in the table of objects; TABLE_NONE for an empty one. */
static lam_status read_name(imported_faces *s, const char *name, uint32_t *index, lam_error *error) {
    *index = TABLE_NONE;
    return *name == '\0' ? LAM_OK : imported_faces_add_object(s, name, strlen(name), index, error);
}

lam_status obj_read(const char *path, imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    obj_state o = {.path = path, .s = s, .object = TABLE_NONE, .group = TABLE_NONE, .material = TABLE_NONE};
    size_t length = 0;
    char *rest, *text = NULL;
    line_cursor cursor;
    TRY(file_text(path, &text, &length, error));
    TRY(begin_lines(path, text, length, &cursor, error));
    for (char *line; (line = next_line(&cursor)) != NULL;) {
        if ((rest = after_keyword(line, "v")) != NULL)
            TRY(read_vertex(&o, cursor.number, rest, error));
        else if ((rest = after_keyword(line, "f")) != NULL)
            TRY(read_face(&o, cursor.number, rest, error));
        else if ((rest = after_keyword(line, "o")) != NULL)
            TRY(read_name(s, rest, &o.object, error));
        else if ((rest = after_keyword(line, "g")) != NULL)
            TRY(read_name(s, rest, &o.group, error));
        else if ((rest = after_keyword(line, "usemtl")) != NULL) {
            o.material = TABLE_NONE;
            if (*rest != '\0') TRY(imported_faces_add_material(s, rest, strlen(rest), &o.material, error));
        } else if ((rest = after_keyword(line, "mtllib")) != NULL)
            TRY(read_libraries(path, cursor.number, rest, s, error));
    }
done:
    free(o.corners);
    free(text);
    return status;
}
