/* NPY arrays (format 1.0 to 3.0): codec_read_npy reads one as emission, npy_write_* write one. */
#include "solver/codec/npy.h"

#include "solver/base/half.h"
#include "solver/codec/request.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "values are copied as they are in memory");

#define MAX_RANK 3

typedef struct npy_header {
    char descr[16];
    bool fortran_order;
    size_t rank;
    size_t shape[MAX_RANK];
    size_t data; /* where the values begin */
} npy_header;

/* The header's text is a Python literal: a dictionary of three keys. */
typedef struct literal {
    const char *at, *end;
} literal;

static void skip_space(literal *l) {
    while (l->at < l->end && (*l->at == ' ' || *l->at == '\n' || *l->at == '\t')) l->at++;
}

static bool take(literal *l, const char *token) {
    skip_space(l);
    size_t length = strlen(token);
    if ((size_t)(l->end - l->at) < length || memcmp(l->at, token, length) != 0) return false;
    l->at += length;
    return true;
}

static bool take_text(literal *l, char *text, size_t size) {
    skip_space(l);
    if (l->at == l->end || (*l->at != '\'' && *l->at != '"')) return false;
    char quote = *l->at++;
    size_t length = 0;
    while (l->at < l->end && *l->at != quote) {
        if (length + 1 == size || *l->at == '\\' || *l->at == '\0') return false;
        text[length++] = *l->at++;
    }
    if (l->at == l->end) return false;
    l->at++;
    text[length] = '\0';
    return true;
}

/* (), (3,), (3, 4) ...; rank MAX_RANK + 1 stands for more. */
static bool take_shape(literal *l, size_t *rank, size_t shape[MAX_RANK]) {
    if (!take(l, "(")) return false;
    for (*rank = 0; !take(l, ")");) {
        size_t value = 0;
        skip_space(l);
        if (l->at == l->end || *l->at < '0' || *l->at > '9') return false;
        for (; l->at < l->end && *l->at >= '0' && *l->at <= '9'; l->at++) {
            if (!size_multiply(value, 10, &value) ||
                __builtin_add_overflow(value, (size_t)(*l->at - '0'), &value))
                return false;
        }
        if (*rank < MAX_RANK) shape[*rank] = value;
        if (*rank <= MAX_RANK) ++*rank;
        if (!take(l, ",")) {
            if (*rank == 1) return false; /* (3) is a number, not a tuple */
            if (!take(l, ")")) return false;
            break;
        }
    }
    return true;
}

static bool take_dictionary(literal *l, npy_header *h) {
    unsigned seen = 0;
    if (!take(l, "{")) return false;
    while (!take(l, "}")) {
        char key[32];
        if (!take_text(l, key, sizeof key) || !take(l, ":")) return false;
        unsigned bit;
        if (strcmp(key, "descr") == 0) {
            bit = 1;
            if (!take_text(l, h->descr, sizeof h->descr)) return false;
        } else if (strcmp(key, "fortran_order") == 0) {
            bit = 2;
            h->fortran_order = take(l, "True");
            if (!h->fortran_order && !take(l, "False")) return false;
        } else if (strcmp(key, "shape") == 0) {
            bit = 4;
            if (!take_shape(l, &h->rank, h->shape)) return false;
        } else {
            return false;
        }
        if (seen & bit) return false;
        seen |= bit;
        if (!take(l, ",")) {
            if (!take(l, "}")) return false;
            break;
        }
    }
    skip_space(l);
    return seen == 7 && l->at == l->end;
}

static bool read_header(const char *source, const char *bytes, size_t length, npy_header *h, problem *why) {
    const unsigned char *b = (const unsigned char *)bytes;
    *h = (npy_header){0};
    if (length < 10 || memcmp(bytes, "\x93NUMPY", 6) != 0)
        return problem_set(why, PROBLEM_NOT_NPY, "%s is not NPY: it does not begin with its magic number",
                           source);
    if (b[6] < 1 || b[6] > 3 || b[7] != 0)
        return problem_set(why, PROBLEM_NOT_NPY, "%s is NPY version %u.%u, must be 1.0, 2.0 or 3.0", source,
                           b[6], b[7]);
    size_t size = (size_t)b[8] | (size_t)b[9] << 8, start = 10;
    if (b[6] > 1) {
        if (length < 12)
            return problem_set(why, PROBLEM_NOT_NPY, "%s is not NPY: it ends in its header", source);
        size |= (size_t)b[10] << 16 | (size_t)b[11] << 24;
        start = 12;
    }
    if (size > length - start)
        return problem_set(why, PROBLEM_NOT_NPY, "%s is not NPY: it ends in its header", source);
    literal l = {bytes + start, bytes + start + size};
    if (!take_dictionary(&l, h))
        return problem_set(why, PROBLEM_NOT_NPY,
                           "%s is not NPY: its header is not {'descr': '<f4', 'fortran_order': False, "
                           "'shape': (...)}",
                           source);
    h->data = start + size;
    return true;
}

/* The meaning of the array's axes. */
typedef struct layout {
    size_t n_rhs;
    size_t rows; /* in one vector: C, or 1 for all channels alike */
    bool batch;
} layout;

static bool read_layout(const npy_header *h, const codec_scene *scene, layout *found, problem *why) {
    size_t n = scene->n, C = scene->n_channels;
    const size_t *shape = h->shape;
    if (h->rank == 1 && shape[0] == n) {
        *found = (layout){1, 1, false};
    } else if (h->rank == 2 && (C == 1 || scene->frames) && shape[1] == n) {
        *found = (layout){shape[0], 1, true};
    } else if (h->rank == 2 && C > 1 && shape[0] == C && shape[1] == n) {
        *found = (layout){1, C, false};
    } else if (h->rank == 3 && shape[1] == C && shape[2] == n) {
        *found = (layout){shape[0], C, true};
    } else {
        char given[96] = "";
        const char *item = scene->item != NULL ? scene->item : "element";
        for (size_t i = 0, at = 0; i < h->rank && i < MAX_RANK; i++)
            at += (size_t)snprintf(given + at, sizeof given - at, "%s%zu", i > 0 ? ", " : "", shape[i]);
        if (h->rank > MAX_RANK)
            return problem_set(why, PROBLEM_WRONG_LENGTH, "the array's shape has more than %d axes",
                               MAX_RANK);
        if (scene->frames)
            return problem_set(why, PROBLEM_WRONG_LENGTH,
                               "the array's shape is (%s), must be (frames, %zu), alike in all channels, or "
                               "(frames, %zu, %zu), one value for each %s",
                               given, n, C, n, item);
        if (C == 1)
            return problem_set(
                why, PROBLEM_WRONG_LENGTH,
                "the array's shape is (%s), must be (%zu) or (vectors, %zu), one value for each %s", given, n,
                n, item);
        return problem_set(why, PROBLEM_WRONG_LENGTH,
                           "the array's shape is (%s), must be (%zu), (%zu, %zu) or (vectors, %zu, %zu), one "
                           "value for each channel and %s",
                           given, n, C, n, C, n, item);
    }
    if (found->n_rhs == 0)
        return problem_set(why, PROBLEM_WRONG_LENGTH, "the batch is empty, must hold a vector");
    if (found->n_rhs > scene->max_batch)
        return problem_set(why, PROBLEM_TOO_MUCH,
                           "the batch holds %zu vectors, at most %zu (--max-batch); send several requests",
                           found->n_rhs, scene->max_batch);
    return true;
}

static bool bad_value(size_t index, double value, bool any_sign, problem *why) {
    if (isnan(value))
        return problem_set(why, PROBLEM_BAD_VALUE, "the array's value %zu is NaN, must be a number", index);
    if (value < 0.0 && !any_sign)
        return problem_set(why, PROBLEM_BAD_VALUE, "the array's value %zu is %.9g, must not be negative",
                           index, value);
    return problem_set(why, PROBLEM_BAD_VALUE,
                       "the array's value %zu is %.9g, must be within single precision (3.4e38)", index,
                       value);
}

/* Values first ... first + count of the array to E. */
static bool read_values(const char *data, bool wide, size_t first, size_t count, bool any_sign, float *E,
                        problem *why) {
    const float least = any_sign ? -FLT_MAX : 0.0f;
    if (!wide) {
        memcpy(E, data + first * sizeof *E, count * sizeof *E);
        /* One branch for all of them; the loop that names the culprit runs only when there is one. */
        int bad = 0;
        for (size_t i = 0; i < count; i++) bad |= !(E[i] >= least) | !(E[i] <= FLT_MAX);
        if (!bad) return true;
    }
    for (size_t i = 0; i < count; i++) {
        double value;
        if (wide)
            memcpy(&value, data + (first + i) * sizeof value, sizeof value);
        else
            value = E[i];
        if (!(value >= least && value <= FLT_MAX)) return bad_value(first + i, value, any_sign, why);
        E[i] = (float)value;
    }
    return true;
}

/* Elements that are read at a time of an array in Fortran order: their values stand together, those of all
 * vectors of an element behind each other. */
enum { ELEMENTS_AT_ONCE = 32 };

/* The value of an array in Fortran order: v + n_rhs (c + rows i). */
static double value_at(const char *data, bool wide, const layout *of, size_t v, size_t c, size_t i) {
    const size_t at = v + of->n_rhs * (c + of->rows * i);
    float narrow;
    double value;
    if (wide)
        memcpy(&value, data + at * sizeof value, sizeof value);
    else
        memcpy(&narrow, data + at * sizeof narrow, sizeof narrow);
    return wide ? value : (double)narrow;
}

/* All values of an array in Fortran order, to vectors of `stride` numbers. False with the first in C order
 * that is none, by its number there. */
static bool read_fortran(const char *data, bool wide, const layout *of, size_t n, size_t stride,
                         bool any_sign, float *E, problem *why) {
    const double least = any_sign ? -FLT_MAX : 0.0;
    size_t bad = SIZE_MAX;
    double culprit = 0;
    for (size_t first = 0; first < n; first += ELEMENTS_AT_ONCE) {
        const size_t end = n - first < ELEMENTS_AT_ONCE ? n : first + ELEMENTS_AT_ONCE;
        for (size_t v = 0; v < of->n_rhs; v++)
            for (size_t c = 0; c < of->rows; c++)
                for (size_t i = first; i < end; i++) {
                    const double value = value_at(data, wide, of, v, c, i);
                    const size_t number = (v * of->rows + c) * n + i;
                    if (value >= least && value <= FLT_MAX) {
                        E[v * stride + c * n + i] = (float)value;
                    } else if (number < bad) {
                        bad = number;
                        culprit = value;
                    }
                }
    }
    return bad == SIZE_MAX || bad_value(bad, culprit, any_sign, why);
}

/* The same in C order. */
static bool read_c(const char *data, bool wide, const layout *of, size_t n, size_t stride, bool any_sign,
                   float *E, problem *why) {
    const size_t count = of->rows * n;
    for (size_t v = 0; v < of->n_rhs; v++)
        if (!read_values(data, wide, v * count, count, any_sign, E + v * stride, why)) return false;
    return true;
}

/* 422 that says why the type of the values is not read. */
static bool refuse_type(const char *descr, problem *why) {
    const char first = descr[0];
    const char *order = first == '>'   ? "big-endian"
                        : first == '<' ? "little-endian"
                        : first == '|' ? "without a byte order"
                                       : "of a byte order that is not stated";
    return problem_set(
        why, PROBLEM_WRONG_KIND,
        "the array's type is %s (%s), must be <f4 or <f8: little-endian numbers of 4 or 8 bytes", descr,
        order);
}

bool codec_read_npy(const codec_scene *scene, const char *bytes, size_t length, radiosity_request *request,
                    problem *why) {
    npy_header h;
    layout found = {0};
    *why = (problem){0};
    if (!read_header(codec_source(scene), bytes, length, &h, why)) return false;
    bool wide = strcmp(h.descr, "<f8") == 0;
    if (!wide && strcmp(h.descr, "<f4") != 0) return refuse_type(h.descr, why);
    if (!read_layout(&h, scene, &found, why)) return false;

    size_t row = scene->n, values, size;
    if (!size_multiply(found.n_rhs, found.rows, &values) || !size_multiply(values, row, &values) ||
        !size_multiply(values, wide ? 8 : 4, &size))
        size = SIZE_MAX;
    if (size != length - h.data)
        return problem_set(why, PROBLEM_WRONG_LENGTH,
                           "the array holds %zu bytes of values, its shape and type need %zu",
                           length - h.data, size);
    request->batch = found.batch;
    request->n_rhs = found.n_rhs;
    request->told.from = scene->lights;
    float *last;
    if (!radiosity_request_dense(request, scene, &last, why)) return false;
    const size_t stride = scene->n_channels * row;
    if (!(h.fortran_order ? read_fortran : read_c)(bytes + h.data, wide, &found, row, stride,
                                                   request->any_sign || scene->signs, request->E, why))
        return false;
    for (size_t r = 0; r < found.n_rhs; r++) {
        float *E = request->E + r * stride;
        for (size_t c = found.rows; c < scene->n_channels; c++) memcpy(E + c * row, E, row * sizeof *E);
    }
    return true;
}

bool npy_write_header(buffer *b, npy_type type, size_t rank, const size_t *shape) {
    static const char *const names[] = {
        [NPY_F2] = "<f2", [NPY_F4] = "<f4", [NPY_F8] = "<f8", [NPY_U4] = "<u4", [NPY_I4] = "<i4"};
    char text[192];
    size_t at = (size_t)snprintf(text, sizeof text, "{'descr': '%s', 'fortran_order': False, 'shape': (",
                                 names[type]);
    for (size_t i = 0; i < rank; i++)
        at += (size_t)snprintf(text + at, sizeof text - at, "%s%zu", i > 0 ? ", " : "", shape[i]);
    at += (size_t)snprintf(text + at, sizeof text - at, "%s), }", rank == 1 ? "," : "");
    /* The values begin at a multiple of 64, behind a line feed. */
    size_t size = (10 + at + 1 + 63) / 64 * 64 - 10;
    const unsigned char head[10] = {
        0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0, (unsigned char)(size & 0xFF), (unsigned char)(size >> 8)};
    if (!buffer_reserve(b, sizeof head + size)) return false;
    buffer_append(b, head, sizeof head);
    buffer_append(b, text, at);
    for (; at + 1 < size; at++) buffer_append(b, " ", 1);
    return buffer_append(b, "\n", 1);
}

size_t npy_size(npy_type type) {
    static const size_t sizes[] = {[NPY_F2] = 2, [NPY_F4] = 4, [NPY_F8] = 8, [NPY_U4] = 4, [NPY_I4] = 4};
    return sizes[type];
}

void npy_convert(npy_type type, const float *values, size_t count, char *to) {
    if (type == NPY_F4) {
        memcpy(to, values, count * sizeof *values);
    } else if (type == NPY_F2) {
        halves_of_floats(values, count, to);
    } else {
        for (size_t i = 0; i < count; i++) {
            const double wide = (double)values[i];
            memcpy(to + i * sizeof wide, &wide, sizeof wide);
        }
    }
}

bool npy_write_values(buffer *b, npy_type type, const float *values, size_t count) {
    size_t bytes;
    if (!size_multiply(count, npy_size(type), &bytes) || !buffer_reserve(b, bytes)) return false;
    npy_convert(type, values, count, b->bytes + b->length);
    b->length += bytes;
    b->bytes[b->length] = '\0';
    return true;
}

bool npy_write_doubles(buffer *b, npy_type type, const double *values, size_t count, double *rounding) {
    const size_t each = npy_size(type);
    size_t bytes;
    if (!size_multiply(count, each, &bytes) || !buffer_reserve(b, bytes)) return false;
    char *to = b->bytes + b->length;
    for (size_t i = 0; i < count; i++) {
        const float single = (float)values[i];
        const uint16_t half = half_of_float(single);
        const double kept =
            type == NPY_F8 ? values[i] : (double)(type == NPY_F4 ? single : float_of_half(half));
        const void *from = type == NPY_F8   ? (const void *)&values[i]
                           : type == NPY_F4 ? (const void *)&single
                                            : (const void *)&half;
        *rounding = fmax(*rounding, fabs(kept - values[i]));
        memcpy(to + i * each, from, each);
    }
    b->length += bytes;
    b->bytes[b->length] = '\0';
    return true;
}
