/* Reads OBJ + MTL in double precision. libassimp would keep coordinates in single precision, merge the names
 * of `o` and `g`, invent a diffuse colour and only log a missing MTL. Runs in the child. */
#include "solver/base/array_grow.h"
#include "solver/base/asset_files.h"
#include "solver/base/file_text.h"
#include "solver/base/photometry.h"
#include "solver/scene/import/imported_faces.h"
#include "solver/scene/import/obj_groups.h"

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

/* A statement of a map: options, then the name of a file, which may have blanks. */
typedef struct map_statement {
    const char *file;
    double scale[2], offset[2];
    bool clamp;
} map_statement;

/* The options of the format with the number of their arguments; -o, -s and -t take one to three numbers. */
static const struct map_option {
    const char *name;
    int least, most;
} map_options[] = {{"-blendu", 1, 1}, {"-blendv", 1, 1}, {"-boost", 1, 1},      {"-bm", 1, 1},
                   {"-cc", 1, 1},     {"-clamp", 1, 1},  {"-colorspace", 1, 1}, {"-imfchan", 1, 1},
                   {"-mm", 2, 2},     {"-o", 1, 3},      {"-s", 1, 3},          {"-t", 1, 3},
                   {"-texres", 1, 1}, {"-type", 1, 1}};

/* The word at *text, cut off; *text is moved to the next one. */
static char *cut_word(char **text) {
    char *word = *text, *end = word;
    while (*end != '\0' && !is_blank(*end)) end++;
    *text = end;
    while (is_blank(**text)) (*text)++;
    *end = '\0';
    return word;
}

static bool is_number(const char *text) {
    char *stop;
    strtod(text, &stop);
    return stop != text && (*stop == '\0' || is_blank(*stop));
}

static map_statement parse_map(char *text) {
    map_statement out = {.scale = {1, 1}};
    for (;;) {
        const struct map_option *option = NULL;
        for (size_t k = 0; k < sizeof map_options / sizeof *map_options; k++)
            if (after_keyword(text, map_options[k].name) != NULL) option = &map_options[k];
        if (option == NULL) break;
        cut_word(&text);
        for (int k = 0; k < option->most && (k < option->least || is_number(text)) && *text != '\0'; k++) {
            const char *word = cut_word(&text);
            if (strcmp(option->name, "-clamp") == 0) out.clamp = strcmp(word, "on") == 0;
            if (k < 2 && strcmp(option->name, "-s") == 0) out.scale[k] = strtod(word, NULL);
            if (k < 2 && strcmp(option->name, "-o") == 0) out.offset[k] = strtod(word, NULL);
        }
    }
    out.file = text;
    return out;
}

/* Reads the image of a material's reflectance or emission, which lies beside its MTL, path. */
static lam_status read_map(const char *path, imported_faces *s, uint32_t material, int quantity, char *text,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const map_statement map = parse_map(text);
    imported_texture t = {.named = 1};
    for (int d = 0; d < 2; d++) {
        t.wrap[d] = map.clamp ? TEXTURE_CLAMP : TEXTURE_REPEAT;
        t.transform[d][d] = map.scale[d];
        t.transform[d][2] = map.offset[d];
    }
    for (int d = 0; d < 3; d++) t.transform[1][d] = (d == 2) - t.transform[1][d]; /* from the top */
    TRY(imported_faces_find_image(s, path, map.file, &t.image, error));
    s->values[material].textures[quantity] = t;
done:
    return status;
}

/* An image is multiplied by the colour; without one it counts alone. Many programs write black beside it. */
static void settle_colours(imported_faces *s) {
    for (size_t i = 0; i < s->materials.n; i++) {
        imported_material *v = &s->values[i];
        double *colours[] = {v->diffuse, v->emission};
        for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
            double *c = colours[q];
            const bool black = c[0] == 0 && c[1] == 0 && c[2] == 0;
            if (v->textures[q].image > 0 && black) c[0] = c[1] = c[2] = 1;
        }
    }
}

/* Counts of statements that are not read. */
typedef struct left_out {
    size_t maps, alpha_maps;
} left_out;

static void count_left_out(char *line, left_out *out) {
    static const char *const maps[] = {"map_Ka", "map_Ks", "map_Ns", "map_Bump", "map_bump", "bump", "norm",
                                       "disp",   "map_Pr", "map_Pm", "map_Ps",   "refl",     "decal"};
    for (size_t k = 0; k < sizeof maps / sizeof *maps; k++) out->maps += after_keyword(line, maps[k]) != NULL;
    out->alpha_maps += after_keyword(line, "map_d") != NULL;
}

/* The light that a material lets pass, by its statements so far. */
typedef struct clearness {
    double opaque;    /* d, or 1 - Tr; 1 */
    double filter[3]; /* Tf; 1 */
    bool glass;       /* illum is one of those of glass, by which a filter counts */
} clearness;

static const clearness opaque = {.opaque = 1, .filter = {1, 1, 1}};

/* Reads d, Tr, Tf or illum; false: the line is none of these. */
static bool read_clearness(char *line, clearness *c) {
    char *rest;
    double number, filter[3];
    if ((rest = after_keyword(line, "d")) != NULL || (rest = after_keyword(line, "Tr")) != NULL) {
        const bool turned = line[0] == 'T';
        if (read_numbers(rest, 1, &number) == 1) c->opaque = fmin(fmax(turned ? 1 - number : number, 0), 1);
        return true;
    }
    if ((rest = after_keyword(line, "Tf")) != NULL) {
        const size_t n = read_numbers(rest, 3, filter);
        for (int k = 0; k < 3 && n > 0; k++) c->filter[k] = fmin(fmax(filter[n == 3 ? k : 0], 0), 1);
        return true;
    }
    if ((rest = after_keyword(line, "illum")) != NULL) {
        c->glass =
            read_numbers(rest, 1, &number) == 1 && (number == 4 || number == 6 || number == 7 || number == 9);
        return true;
    }
    return false;
}

/* A material of d < 1 passes the rest, coloured by its filter, and has its diffuse colour in the share d. A
 * filter below 1 counts by itself where the illum is of glass: many programs write others for opaque
 * materials. Colours become luminance. */
static void end_material(const clearness *c, imported_material *out) {
    const double filter = luminance_of(c->filter[0], c->filter[1], c->filter[2]);
    const bool filters = c->glass && filter > 0 && filter < 1;
    const double share = c->opaque < 1 ? 1 - c->opaque : filters ? 1 : 0;
    out->transmittance = share * (filters ? filter : 1);
    for (int k = 0; k < 3 && c->opaque < 1; k++) out->diffuse[k] *= c->opaque;
}

static lam_status read_mtl(const char *path, imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    size_t length = 0;
    uint32_t current = TABLE_NONE;
    char *rest, *text = NULL;
    line_cursor cursor;
    left_out out = {.maps = 0};
    clearness clear = opaque;
    TRY(file_text(path, &text, &length, error));
    TRY(begin_lines(path, text, length, &cursor, error));
    for (char *line; (line = next_line(&cursor)) != NULL;) {
        if ((rest = after_keyword(line, "newmtl")) != NULL) {
            if (current != TABLE_NONE) end_material(&clear, &s->values[current]);
            clear = opaque;
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
        } else if ((rest = after_keyword(line, "map_Kd")) != NULL) {
            TRY(read_map(path, s, current, TEXTURE_REFLECTANCE, rest, error));
        } else if ((rest = after_keyword(line, "map_Ke")) != NULL) {
            TRY(read_map(path, s, current, TEXTURE_EMISSION, rest, error));
        } else if (!read_clearness(line, &clear))
            count_left_out(line, &out);
    }
    if (current != TABLE_NONE) end_material(&clear, &s->values[current]);
    if (out.maps > 0)
        import_warn(&s->warnings, "%s: %zu map%s of other things than Kd and Ke %s left out", path, out.maps,
                    out.maps == 1 ? "" : "s", out.maps == 1 ? "is" : "are");
    if (out.alpha_maps > 0)
        import_warn(&s->warnings, "%s: images of transparency (map_d) are left out: what has one is opaque",
                    path);
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
    if (place == ASSET_SEVERAL)
        FAIL(error, LAM_ERR_FORMAT,
             "%s:%u: the material file '%s' is missing, and several differ from it by capitals alone "
             "(%.200s); "
             "write the name of one",
             path, line, file, full);
    if (*found) TRY(read_mtl(full, s, error));
done:
    return status;
}

/* One name with blanks in it, or several names; "\ " is a blank inside a name. */
static lam_status read_libraries(const char *path, uint32_t line, char *names, imported_faces *s,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    char whole[256];
    bool found, is_first = true;
    snprintf(whole, sizeof whole, "%s", names);
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
        const bool several = is_first && strcmp(whole, file) != 0;
        is_first = false;
        if (!found)
            FAIL(error, LAM_ERR_FORMAT,
                 "%s:%u: the material file '%s'%s%s%s is missing; put it beside the OBJ or remove the mtllib "
                 "line",
                 path, line, several ? whole : file, several ? ", or '" : "", several ? file : "",
                 several ? "' if these are several names," : "");
        found = !more;
    }
done:
    return status;
}

typedef struct obj_state {
    const char *path;
    imported_faces *s;
    uint32_t object, material;
    const char *group; /* the text of the last `g`, which stays in the file's; NULL: none */
    obj_groups groups; /* of polygons without an object */
    uint32_t *corners; /* of the face being read */
    size_t corner_capacity;
    /* Coordinates of images are kept once a material has one. skipped: some were not. */
    bool keeps, skipped;
    size_t n_surfaces, first_surface; /* free-form ones, and the line of the first */
    double (*uv)[2];
    imported_corner *skin; /* of the face being read */
    size_t n_uv, uv_capacity, skin_capacity;
} obj_state;

static lam_status read_coordinates(obj_state *o, const char *text, lam_error *error) {
    lam_status status = LAM_OK;
    double uv[2] = {0, 0}; /* one number is a place along a line */
    o->skipped = o->skipped || !o->keeps;
    if (!o->keeps) return LAM_OK;
    TRY(array_grow(&o->uv, &o->uv_capacity, o->n_uv + 1, sizeof *o->uv, "texture coordinates", error));
    read_numbers(text, 2, uv);
    memcpy(o->uv[o->n_uv++], uv, sizeof uv);
done:
    return status;
}

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

/* The corner of a skin from the part behind a vertex index, "/vt" or "/vt/vn"; false where it has none that
 * was read before. */
static bool read_corner(const obj_state *o, const char *text, imported_corner *out) {
    if (text[0] != '/' || text[1] == '/') return false;
    const long long given = strtoll(text + 1, NULL, 10);
    const long long index = given < 0 ? (long long)o->n_uv + given : given - 1;
    if (given == 0 || index < 0 || index >= (long long)o->n_uv) return false;
    *out = (imported_corner){.colour = {1, 1, 1}};
    for (int q = 0; q < TEXTURE_QUANTITIES; q++) memcpy(out->uv[q], o->uv[index], sizeof out->uv[q]);
    return true;
}

/* True where the faces that follow may have an image. */
static bool may_have_image(const obj_state *o) {
    if (!o->keeps || o->material == TABLE_NONE) return false;
    const imported_material *v = &o->s->values[o->material];
    return !v->defined || v->textures[0].image > 0 || v->textures[1].image > 0;
}

static lam_status read_face(obj_state *o, uint32_t line, const char *text, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    bool skinned = may_have_image(o);
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
        if (skinned) {
            TRY(array_grow(&o->skin, &o->skin_capacity, n, sizeof *o->skin, "face corners", error));
            skinned = read_corner(o, stop, &o->skin[n - 1]);
        }
        for (text = stop; *text != '\0' && !is_blank(*text);) text++;
        while (is_blank(*text)) text++;
    }
    if (n == 0) goto done;
    TRY(imported_faces_add_polygon(o->s, o->corners, n, o->object, o->material, line, error));
    if (o->object == TABLE_NONE && o->group != NULL)
        TRY(obj_groups_add(&o->groups, o->group, o->s->n_polygons, error));
    if (skinned) TRY(imported_faces_add_skin(o->s, o->skin, error));
done:
    return status;
}

/* The index of a name in the table of objects; TABLE_NONE for an empty one. */
static lam_status read_name(imported_faces *s, const char *name, uint32_t *index, lam_error *error) {
    *index = TABLE_NONE;
    return *name == '\0' ? LAM_OK : imported_faces_add_object(s, name, strlen(name), index, error);
}

static bool has_images(const imported_faces *s) {
    for (size_t k = 0; k < s->n_images; k++)
        if (s->images[k].pixels != NULL) return true;
    return false;
}

/* *again: coordinates of images were skipped before a material had one. */
static lam_status read_all(const char *path, imported_faces *s, bool keeps, bool *again, lam_error *error) {
    lam_status status = LAM_OK;
    obj_state o = {.path = path, .s = s, .object = TABLE_NONE, .material = TABLE_NONE, .keeps = keeps};
    size_t length = 0;
    char *rest, *text = NULL;
    line_cursor cursor;
    TRY(file_text(s->source != NULL ? s->source : path, &text, &length, error));
    TRY(begin_lines(path, text, length, &cursor, error));
    for (char *line; (line = next_line(&cursor)) != NULL;) {
        if ((rest = after_keyword(line, "v")) != NULL)
            TRY(read_vertex(&o, cursor.number, rest, error));
        else if ((rest = after_keyword(line, "f")) != NULL)
            TRY(read_face(&o, cursor.number, rest, error));
        else if ((rest = after_keyword(line, "vt")) != NULL)
            TRY(read_coordinates(&o, rest, error));
        else if ((rest = after_keyword(line, "o")) != NULL)
            TRY(read_name(s, rest, &o.object, error));
        else if ((rest = after_keyword(line, "g")) != NULL)
            o.group = *rest == '\0' ? NULL : rest;
        else if ((rest = after_keyword(line, "usemtl")) != NULL) {
            o.material = TABLE_NONE;
            if (*rest != '\0') TRY(imported_faces_add_material(s, rest, strlen(rest), &o.material, error));
        } else if (after_keyword(line, "surf") != NULL) {
            if (o.n_surfaces++ == 0) o.first_surface = cursor.number;
        } else if ((rest = after_keyword(line, "mtllib")) != NULL) {
            TRY(read_libraries(path, cursor.number, rest, s, error));
            o.keeps = o.keeps || (!o.skipped && has_images(s));
        }
    }
    *again = o.skipped && has_images(s);
    if (o.n_surfaces > 0)
        import_warn(&s->warnings,
                    "%s:%zu: faces are missing: %zu free-form surface%s (surf) %s not read; export polygons",
                    path, o.first_surface, o.n_surfaces, o.n_surfaces == 1 ? "" : "s",
                    o.n_surfaces == 1 ? "is" : "are");
    TRY(obj_groups_settle(&o.groups, path, s, error));
    settle_colours(s);
done:
    free(o.corners);
    free(o.uv);
    free(o.skin);
    obj_groups_free(&o.groups);
    free(text);
    return status;
}

lam_status obj_read(const char *path, imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    const imported_faces asked = {.assets = s->assets, .source = s->source, .format = s->format};
    bool again = false;
    TRY(read_all(path, s, false, &again, error));
    if (!again) goto done;
    imported_faces_free(s);
    *s = asked;
    TRY(read_all(path, s, true, &again, error));
done:
    return status;
}
