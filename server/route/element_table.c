#include "server/route/element_table.h"

#include "server/route/content_coding.h"
#include "server/route/request_memory.h"
#include "solver/codec/json_writer.h"

#include <string.h>

/* Letters of a number in JSON with its comma, at most: of a double, a float and an integer. */
#define DOUBLE_LETTERS 26
#define FLOAT_LETTERS (JSON_FLOAT_MAX + 1)
#define INTEGER_LETTERS 11

/* Letters of JSON beside names and numbers, its members, and room that numbers take while they are written in
 * pieces (json_write_floats). */
#define FRAME_LETTERS 512
#define PIECES_ROOM ((size_t)72 << 10)

static const struct {
    const char *name;
    npy_type type;
    size_t bytes;   /* of a number */
    size_t letters; /* of one in JSON */
    size_t width;   /* numbers of an element; 0: one for each channel */
} fields[ELEMENT_FIELDS] = {
    [FIELD_AREA] = {"area", NPY_F8, sizeof(double), DOUBLE_LETTERS, 1},
    [FIELD_NORMAL] = {"normal", NPY_F4, sizeof(float), FLOAT_LETTERS, 3},
    [FIELD_CENTRE] = {"centre", NPY_F4, sizeof(float), FLOAT_LETTERS, 3},
    [FIELD_GROUP] = {"group", NPY_U4, sizeof(uint32_t), INTEGER_LETTERS, 1},
    [FIELD_FACE] = {"face", NPY_I4, sizeof(int32_t), INTEGER_LETTERS, 1},
    [FIELD_REFLECTANCE] = {"reflectance", NPY_F4, sizeof(float), FLOAT_LETTERS, 0},
};

const char *element_field_name(element_field field) {
    return fields[field].name;
}

static bool has(const element_table *t, element_field field) {
    return (t->fields & FIELD_BIT(field)) != 0;
}

/* Numbers of a field in all. */
static size_t count_of(const scene *of, element_field field) {
    return bytes_times(of->n, fields[field].width > 0 ? fields[field].width : of->n_channels);
}

/* Parts of a ZIP that have one size each, beside names: the head of a member, its entry in the directory, and
 * the end of that. */
enum { ZIP_HEAD = 30, ZIP_ENTRY = 46, ZIP_END = 22, ZIP_NAME_MOST = 24 };

size_t element_table_bytes_most(const element_table *t) {
    const bool json = t->encoding == MEDIA_JSON;
    size_t bytes = json ? FRAME_LETTERS + PIECES_ROOM + t->of->n / 64 + 6 * strlen(t->of->name) : ZIP_END;
    for (size_t g = 0; json && g < t->of->groups.n_groups; g++)
        bytes = bytes_plus(bytes, 6 * strlen(t->of->groups.names[g]) + 3);
    for (element_field f = 0; f < ELEMENT_FIELDS; f++) {
        if (!has(t, f)) continue;
        const size_t numbers = bytes_times(count_of(t->of, f), json ? fields[f].letters : fields[f].bytes),
                     brackets = json && fields[f].width == 3 ? bytes_times(t->of->n, 2)
                                : json                       ? 2 * t->of->n_channels
                                       : NPY_HEADER_MOST + ZIP_HEAD + ZIP_ENTRY + 2 * ZIP_NAME_MOST;
        bytes = bytes_plus(bytes, bytes_plus(numbers, brackets));
    }
    return bytes;
}

static const void *column_of(const element_table *t, element_field field) {
    const element_columns *c = &t->columns;
    const void *const columns[ELEMENT_FIELDS] = {
        [FIELD_AREA] = c->area,   [FIELD_NORMAL] = c->normal, [FIELD_CENTRE] = c->centre,
        [FIELD_GROUP] = c->group, [FIELD_FACE] = c->face,     [FIELD_REFLECTANCE] = c->reflectance};
    return columns[field];
}

static bool write_npy(const element_table *t, element_field field, buffer *out) {
    const size_t n = t->of->n, C = t->of->n_channels;
    const bool by_channel = fields[field].width == 0 && C > 1, vectors = fields[field].width == 3;
    const size_t shape[2] = {by_channel ? C : n, by_channel ? n : 3};
    return npy_write_header(out, fields[field].type, by_channel || vectors ? 2 : 1, shape) &&
           buffer_append(out, column_of(t, field), count_of(t->of, field) * fields[field].bytes);
}

/* A number of 2 or 4 bytes, the lowest first. */
static void put(char *to, size_t bytes, size_t value) {
    for (size_t k = 0; k < bytes; k++) to[k] = (char)(value >> 8 * k & 0xFF);
}

/* A member of the ZIP: what its head and its entry in the directory have in common. */
typedef struct member {
    char name[ZIP_NAME_MOST];
    size_t at; /* of its head */
    size_t length;
    uint32_t crc;
} member;

/* The 26 bytes from "version needed" to "length of extra field", of version 2.0: stored, not coded, of 1
 * January 1980, as the bytes depend on nothing but the scene. */
static void put_common(char *to, const member *m) {
    memset(to, 0, 26);
    put(to, 2, 20);
    put(to + 8, 2, 1 << 5 | 1);
    put(to + 10, 4, m->crc);
    put(to + 14, 4, m->length);
    put(to + 18, 4, m->length);
    put(to + 22, 2, strlen(m->name));
}

/* The head comes before the bytes of which it has the checksum, and is filled after them. */
static bool write_member(const element_table *t, element_field field, member *m, buffer *out) {
    *m = (member){.at = out->length};
    stpcpy(stpcpy(m->name, fields[field].name), ".npy");
    char head[ZIP_HEAD] = {0};
    if (!buffer_append(out, head, sizeof head) || !buffer_append_text(out, m->name)) return false;
    const size_t begin = out->length;
    if (!write_npy(t, field, out)) return false;
    m->length = out->length - begin;
    m->crc = coding_crc32(out->bytes + begin, m->length);
    put(head, 4, 0x04034b50);
    put_common(head + 4, m);
    memcpy(out->bytes + m->at, head, sizeof head);
    return true;
}

static bool write_entry(const member *m, buffer *out) {
    char entry[ZIP_ENTRY] = {0};
    put(entry, 4, 0x02014b50);
    put(entry + 4, 2, 20);
    put_common(entry + 6, m);
    put(entry + 42, 4, m->at);
    return buffer_append(out, entry, sizeof entry) && buffer_append_text(out, m->name);
}

static bool write_zip(const element_table *t, buffer *out) {
    member members[ELEMENT_FIELDS];
    size_t count = 0;
    for (element_field f = 0; f < ELEMENT_FIELDS; f++)
        if (has(t, f) && !write_member(t, f, &members[count++], out)) return false;
    const size_t directory = out->length;
    for (size_t k = 0; k < count; k++)
        if (!write_entry(&members[k], out)) return false;
    char end[ZIP_END] = {0};
    put(end, 4, 0x06054b50);
    put(end + 8, 2, count);
    put(end + 10, 2, count);
    put(end + 12, 4, out->length - directory);
    put(end + 16, 4, directory);
    return buffer_append(out, end, sizeof end);
}

/* [[x,y,z],...] */
static bool write_vectors(const float (*vectors)[3], size_t n, buffer *out) {
    bool written = buffer_append(out, "[", 1);
    for (size_t i = 0; written && i < n; i++)
        written = (i == 0 || buffer_append(out, ",", 1)) && json_write_floats(out, vectors[i], 3);
    return written && buffer_append(out, "]", 1);
}

static bool write_faces(const int32_t *face, size_t n, buffer *out) {
    bool written = buffer_append(out, "[", 1);
    for (size_t i = 0; written && i < n; i++)
        written = (i == 0 || buffer_append(out, ",", 1)) &&
                  (face[i] < 0 ? buffer_append_text(out, "null") : buffer_printf(out, "%d", face[i]));
    return written && buffer_append(out, "]", 1);
}

static bool write_groups(const uint32_t *group, size_t n, buffer *out) {
    bool written = buffer_append(out, "[", 1);
    for (size_t i = 0; written && i < n; i++) written = buffer_printf(out, i > 0 ? ",%u" : "%u", group[i]);
    return written && buffer_append(out, "]", 1);
}

static bool write_channels(const float *values, size_t n, size_t C, buffer *out) {
    if (C == 1) return json_write_floats(out, values, n);
    bool written = buffer_append(out, "[", 1);
    for (size_t c = 0; written && c < C; c++)
        written = (c == 0 || buffer_append(out, ",", 1)) && json_write_floats(out, values + c * n, n);
    return written && buffer_append(out, "]", 1);
}

static bool write_field(const element_table *t, element_field field, buffer *out) {
    const element_columns *c = &t->columns;
    const size_t n = t->of->n;
    if (!buffer_printf(out, ",\"%s\":", fields[field].name)) return false;
    switch (field) {
    case FIELD_AREA:
        return json_write_doubles(out, c->area, n);
    case FIELD_NORMAL:
        return write_vectors((const float(*)[3])c->normal, n, out);
    case FIELD_CENTRE:
        return write_vectors((const float(*)[3])c->centre, n, out);
    case FIELD_GROUP:
        return write_groups(c->group, n, out);
    case FIELD_FACE:
        return write_faces(c->face, n, out);
    default:
        return write_channels(c->reflectance, n, t->of->n_channels, out);
    }
}

static bool write_json(const element_table *t, buffer *out) {
    const scene *of = t->of;
    bool written = buffer_append_text(out, "{\"scene\":") && json_write_text(out, of->name) &&
                   buffer_printf(out, ",\"elements\":%zu,\"channels\":%zu,\"unit\":\"m\",\"groups\":[", of->n,
                                 of->n_channels);
    for (size_t g = 0; written && g < of->groups.n_groups; g++)
        written = (g == 0 || buffer_append(out, ",", 1)) && json_write_text(out, of->groups.names[g]);
    written = written && buffer_append(out, "]", 1);
    for (element_field f = 0; written && f < ELEMENT_FIELDS; f++)
        if (has(t, f)) written = write_field(t, f, out);
    return written && buffer_append_text(out, "}\n");
}

/* The one field of an NPY array. */
static element_field only_field(unsigned set) {
    return (element_field)__builtin_ctz(set);
}

bool element_table_write(const element_table *t, buffer *out) {
    bool written = buffer_reserve(out, element_table_bytes_most(t));
    if (t->encoding == MEDIA_JSON)
        written = written && write_json(t, out);
    else if (t->encoding == MEDIA_NPY)
        written = written && write_npy(t, only_field(t->fields), out);
    else
        written = written && write_zip(t, out);
    if (written)
        buffer_trim(out);
    else
        buffer_free(out);
    return written;
}
