/* Heads of files, before the importing library reads them: chunks of a GLB that are not padded, a PLY's
 * numbers of vertices and faces, and the letters of an STL's text. Runs in the child. */
#include "solver/scene/import/imported_faces.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static uint32_t little_endian(const char *bytes) {
    const unsigned char *b = (const unsigned char *)bytes;
    return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static void put_little_endian(char *bytes, uint32_t x) {
    for (int k = 0; k < 4; k++) bytes[k] = (char)(x >> 8 * k & 255);
}

void gltf_find_json(const char **bytes, size_t *length) {
    if (*length < 20 || memcmp(*bytes, "glTF", 4) != 0) return;
    const size_t size = little_endian(*bytes + 12);
    if (memcmp(*bytes + 16, "JSON", 4) != 0 || size > *length - 20) return;
    *bytes += 20;
    *length = size;
}

lam_status glb_padded(const char *glb, size_t length, char **out, size_t *out_length, lam_error *error) {
    size_t chunks = 0, uneven = 0, to = 12;
    *out = NULL;
    if (length < 12 || length > UINT32_MAX / 2 || memcmp(glb, "glTF", 4) != 0) return LAM_OK;
    for (size_t at = 12; length - at >= 8; chunks++) {
        const size_t size = little_endian(glb + at);
        if (size > length - at - 8) return LAM_OK; /* truncated: the library says so */
        uneven += size % 4 != 0;
        at += 8 + size;
    }
    if (uneven == 0) return LAM_OK;
    char *padded = memory_allocate(length + 3 * chunks, 1, "GLB", error);
    if (padded == NULL) return LAM_ERR_MEMORY;
    for (size_t at = 12; length - at >= 8;) {
        const uint32_t size = little_endian(glb + at), pad = (4 - size % 4) % 4;
        memcpy(padded + to, glb + at, 8 + size);
        put_little_endian(padded + to, size + pad);
        memset(padded + to + 8 + size, memcmp(glb + at + 4, "JSON", 4) == 0 ? ' ' : 0, pad);
        at += 8 + size;
        to += 8 + size + pad;
    }
    memcpy(padded, glb, 12);
    put_little_endian(padded + 8, (uint32_t)to);
    *out = padded;
    *out_length = to;
    return LAM_OK;
}

/* Bytes of one number of a binary PLY; 0 for a type that is not known. */
static double size_of_type(const char *type) {
    static const char *const names[] = {"char",  "uchar",   "int8",   "uint8",  "short", "ushort",
                                        "int16", "uint16",  "int",    "uint",   "int32", "uint32",
                                        "float", "float32", "double", "float64"};
    static const unsigned char bytes[] = {1, 1, 1, 1, 2, 2, 2, 2, 4, 4, 4, 4, 4, 4, 8, 8};
    for (size_t i = 0; i < sizeof bytes; i++)
        if (strcmp(type, names[i]) == 0) return bytes[i];
    return 0;
}

lam_status ply_check_head(const char *path, const char *bytes, size_t length, lam_error *error) {
    lam_status status = LAM_OK;
    static const char last[] = "end_header";
    char first[32], second[32], third[32], element[32] = "";
    double least = 0, count = 0,
           most = 0; /* bytes that all must have; entries of this element, and of the largest */
    char largest[32] = "";
    bool ascii = true;
    const char *end =
        length > 3 && memcmp(bytes, "ply", 3) == 0 ? memmem(bytes, length, last, sizeof last - 1) : NULL;
    if (end == NULL) return LAM_OK;
    for (const char *line = bytes; line < end;) {
        const char *stop = memchr(line, '\n', (size_t)(end - line));
        char text[128];
        if (stop == NULL) return LAM_OK; /* lines that end in carriage returns alone: the library's affair */
        snprintf(text, sizeof text, "%.*s", (int)(stop - line < 127 ? stop - line : 127), line);
        line = stop + 1;
        const int words = sscanf(text, "%31s %31s %31s", first, second, third);
        if (words < 3) continue;
        if (strcmp(first, "format") == 0) {
            ascii = strcmp(second, "ascii") == 0;
        } else if (strcmp(first, "element") == 0) {
            snprintf(element, sizeof element, "%s", second);
            count = strtod(third, NULL);
            if (count > most) {
                most = count;
                memcpy(largest, element, sizeof largest);
            }
        } else if (strcmp(first, "property") == 0) {
            /* A digit and a blank or a line's end each; a list has at least its length. */
            least += count * (ascii ? 2 : size_of_type(strcmp(second, "list") == 0 ? third : second));
        }
    }
    const double room = (double)(length - (size_t)(end - bytes)) - (double)(sizeof last - 1);
    if (least > room + 1) /* the last line may lack its end */
        FAIL(error, LAM_ERR_FORMAT,
             "%s: cut off: its header names %.0f entries of '%s', and %.0f bytes follow, too few for them",
             path, most, largest, room > 0 ? room : 0);
done:
    return status;
}

/* The head of a binary STL and its number of triangles, then bytes of each. */
enum { STL_HEAD = 84, STL_TRIANGLE = 50 };

/* True where a binary STL has all triangles that its head names; *used: bytes of these. */
static bool is_binary_stl(const char *bytes, size_t length, size_t *used) {
    if (length < STL_HEAD) return false;
    const uint64_t need = STL_HEAD + (uint64_t)STL_TRIANGLE * little_endian(bytes + STL_HEAD - 4);
    *used = (size_t)need;
    return need <= length;
}

/* The first letter of a text behind a byte order mark, blanks and empty lines. */
static size_t text_begins(const char *bytes, size_t length) {
    size_t at = length >= 3 && memcmp(bytes, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    while (at < length && isspace((unsigned char)bytes[at])) at++;
    return at;
}

/* True for the lines of a text that name a solid: their letters stay. */
static bool names_solid(const char *line, size_t length) {
    static const char *const words[] = {"solid", "endsolid"};
    for (size_t k = 0; k < sizeof words / sizeof *words; k++) {
        const size_t n = strlen(words[k]);
        if (length >= n && strncasecmp(line, words[k], n) == 0 &&
            (length == n || isspace((unsigned char)line[n])))
            return true;
    }
    return false;
}

lam_status stl_normalised(const char *bytes, size_t length, char **out, size_t *out_length,
                          lam_error *error) {
    const size_t begin = text_begins(bytes, length);
    size_t used = 0;
    *out = NULL;
    *out_length = length;
    if (is_binary_stl(bytes, length, &used)) { /* its head may begin with "solid" */
        *out_length = used;
        return LAM_OK;
    }
    if (length - begin < 6 || !names_solid(bytes + begin, 6)) return LAM_OK;
    char *made = memory_allocate(length - begin + 1, 1, "STL", error); /* and a NUL */
    if (made == NULL) return LAM_ERR_MEMORY;
    memcpy(made, bytes + begin, length - begin);
    for (char *line = made, *end = made + (length - begin); line < end;) {
        while (line < end && isspace((unsigned char)*line)) line++;
        const char *stop = memchr(line, '\n', (size_t)(end - line));
        const size_t n = stop != NULL ? (size_t)(stop - line) : (size_t)(end - line);
        const size_t lowered = names_solid(line, n) ? strcspn(line, " \t\r\n") : n;
        for (size_t k = 0; k < lowered && k < n; k++) line[k] = (char)tolower((unsigned char)line[k]);
        line += n;
    }
    *out = made;
    *out_length = length - begin;
    return LAM_OK;
}
