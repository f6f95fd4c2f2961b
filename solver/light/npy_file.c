#include "solver/light/npy_file.h"

#include <ctype.h>
#include <endian.h>
#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define MAGIC "\x93NUMPY"
#define MAX_HEADER 65536

void npy_free(npy *a) {
    free(a->values);
    *a = (npy){0};
}

/* The value of a key in the header's dictionary literal; NULL when it is missing. */
static const char *dictionary_value(const char *header, const char *key) {
    const char *at = strstr(header, key);
    if (at == NULL) return NULL;
    at += strlen(key);
    while (*at == ' ') at++;
    if (*at++ != ':') return NULL;
    while (*at == ' ') at++;
    return at;
}

static lam_status parse_shape(const char *path, const char *text, npy *out, lam_error *error) {
    lam_status status = LAM_OK;
    if (text == NULL || *text++ != '(') FAIL(error, LAM_ERR_FORMAT, "%s: NPY header without a shape", path);
    for (;;) {
        while (*text == ' ') text++;
        if (*text == ')') break;
        if (!isdigit((unsigned char)*text))
            FAIL(error, LAM_ERR_FORMAT, "%s: NPY header with a shape that is no list of sizes", path);
        if (out->rank == NPY_MAX_RANK)
            FAIL(error, LAM_ERR_FORMAT, "%s: more than %d dimensions", path, NPY_MAX_RANK);
        char *end = NULL;
        errno = 0;
        unsigned long long size = strtoull(text, &end, 10);
        if (errno != 0) FAIL(error, LAM_ERR_FORMAT, "%s: NPY header with a size out of range", path);
        out->dims[out->rank++] = size;
        text = end;
        while (*text == ' ') text++;
        if (*text == ',') text++;
    }
    if (out->rank == 0) FAIL(error, LAM_ERR_FORMAT, "%s: holds one number, needs an array", path);
done:
    return status;
}

/* Reads the header: the shape into out, the bytes of one value into *width. */
static lam_status read_header(const char *path, FILE *stream, npy *out, size_t *width, size_t *begin,
                              lam_error *error) {
    lam_status status = LAM_OK;
    unsigned char start[12];
    char *header = NULL;
    if (fread(start, 1, 10, stream) != 10 || memcmp(start, MAGIC, 6) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: not an NPY file", path);
    if (start[6] < 1 || start[6] > 3)
        FAIL(error, LAM_ERR_VERSION, "%s: NPY version %d, must be 1 to 3", path, start[6]);
    size_t length = (size_t)start[8] | (size_t)start[9] << 8;
    *begin = 10;
    if (start[6] > 1) {
        if (fread(start + 10, 1, 2, stream) != 2) FAIL(error, LAM_ERR_FORMAT, "%s: truncated", path);
        length |= (size_t)start[10] << 16 | (size_t)start[11] << 24;
        *begin = 12;
    }
    if (length > MAX_HEADER) FAIL(error, LAM_ERR_FORMAT, "%s: NPY header longer than %d", path, MAX_HEADER);
    *begin += length;
    header = memory_allocate(length + 1, 1, path, error);
    if (header == NULL) TRY(LAM_ERR_MEMORY);
    if (fread(header, 1, length, stream) != length) FAIL(error, LAM_ERR_FORMAT, "%s: truncated", path);
    const char *type = dictionary_value(header, "'descr'");
    const char *fortran = dictionary_value(header, "'fortran_order'");
    if (type == NULL || fortran == NULL)
        FAIL(error, LAM_ERR_FORMAT, "%s: NPY header without descr or fortran_order", path);
    if (strncmp(type, "'<f4'", 5) != 0 && strncmp(type, "'<f8'", 5) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: values of type %.12s, must be '<f4' or '<f8'", path, type);
    if (strncmp(fortran, "False", 5) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: in Fortran order, must be in C order (numpy.ascontiguousarray)",
             path);
    *width = type[3] == '4' ? 4 : 8;
    TRY(parse_shape(path, dictionary_value(header, "'shape'"), out, error));
done:
    free(header);
    return status;
}

static double read_f4(const unsigned char *bytes) {
    uint32_t bits;
    float value;
    memcpy(&bits, bytes, sizeof bits);
    bits = le32toh(bits);
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

static double read_f8(const unsigned char *bytes) {
    uint64_t bits;
    double value;
    memcpy(&bits, bytes, sizeof bits);
    bits = le64toh(bits);
    memcpy(&value, &bits, sizeof value);
    return value;
}

lam_status npy_read(const char *path, npy *out, lam_error *error) {
    lam_status status = LAM_OK;
    npy a = {0};
    struct stat about;
    size_t width = 0, begin = 0, count = 1, bytes = 0;
    FILE *stream = fopen(path, "rb");
    if (stream == NULL || fstat(fileno(stream), &about) != 0)
        FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
    if (!S_ISREG(about.st_mode)) FAIL(error, LAM_ERR_IO, "%s: not a file", path);
    TRY(read_header(path, stream, &a, &width, &begin, error));
    bool fits = true;
    for (int i = 0; i < a.rank; i++) fits = fits && size_multiply(count, a.dims[i], &count);
    fits = fits && size_multiply(count, width, &bytes);
    if (!fits || (uint64_t)about.st_size != (uint64_t)begin + bytes)
        FAIL(error, LAM_ERR_FORMAT, "%s: %lld bytes long, its header asks for another length", path,
             (long long)about.st_size);
    a.values = memory_allocate(count, sizeof *a.values, path, error);
    if (a.values == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < count; i++) {
        unsigned char value[8];
        if (fread(value, 1, width, stream) != width) FAIL(error, LAM_ERR_IO, "%s: cannot be read", path);
        a.values[i] = width == 4 ? read_f4(value) : read_f8(value);
    }
    *out = a;
    a = (npy){0};
done:
    npy_free(&a);
    if (stream != NULL) fclose(stream);
    return status;
}

/* The header of an array of this type; returns how many values follow. */
static size_t write_header(FILE *stream, const char *type, int rank, const size_t *dims) {
    char header[256];
    size_t count = 1, length;
    length = (size_t)sprintf(header, "{'descr': '%s', 'fortran_order': False, 'shape': (", type);
    for (int i = 0; i < rank; i++) {
        length += (size_t)sprintf(header + length, "%zu,", dims[i]);
        count *= dims[i];
    }
    length += (size_t)sprintf(header + length, "), }");
    /* The values begin at a multiple of 64 bytes, as the format asks. */
    while ((10 + length + 1) % 64 != 0) header[length++] = ' ';
    header[length++] = '\n';
    fwrite(MAGIC "\x01\x00", 1, 8, stream);
    fputc((int)(length & 0xFF), stream);
    fputc((int)(length >> 8), stream);
    fwrite(header, 1, length, stream);
    return count;
}

enum { BLOCK = 4096 }; /* a year of a city is gigabytes: number by number takes longer than solving it */

void npy_write(FILE *stream, int rank, const size_t *dims, const float *values) {
    const size_t count = write_header(stream, "<f4", rank, dims);
    for (size_t first = 0; first < count; first += BLOCK) {
        const size_t some = count - first < BLOCK ? count - first : BLOCK;
        uint32_t bits[BLOCK];
        memcpy(bits, values + first, some * sizeof *bits);
        for (size_t k = 0; k < some; k++) bits[k] = htole32(bits[k]);
        fwrite(bits, sizeof *bits, some, stream);
    }
}

void npy_write_double(FILE *stream, int rank, const size_t *dims, const double *values) {
    const size_t count = write_header(stream, "<f8", rank, dims);
    for (size_t first = 0; first < count; first += BLOCK) {
        const size_t some = count - first < BLOCK ? count - first : BLOCK;
        uint64_t bits[BLOCK];
        memcpy(bits, values + first, some * sizeof *bits);
        for (size_t k = 0; k < some; k++) bits[k] = htole64(bits[k]);
        fwrite(bits, sizeof *bits, some, stream);
    }
}
