/* Reads arrays: every size in a header is compared with the file before it is used. */
#include "store/store_private.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const char *type_text(store_type type) {
    switch (type) {
    case STORE_F32:
        return "f32";
    case STORE_F64:
        return "f64";
    case STORE_U32:
        return "u32";
    case STORE_U64:
        return "u64";
    case STORE_F16:
        return "f16";
    case STORE_U16:
        return "u16";
    case STORE_I8:
        return "i8";
    }
    return "unknown";
}

lam_status store_array_info(store *s, const char *name, store_type *type, int *rank, size_t *dims,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const store_array *array = NULL;
    TRY(store_array_find(s, name, &array, error));
    if (array->is_text) FAIL(error, LAM_ERR_FORMAT, "%s: %s holds texts, not numbers", s->path, name);
    *type = array->type;
    *rank = array->rank;
    memcpy(dims, array->dims, (size_t)array->rank * sizeof *dims);
done:
    return status;
}

lam_status store_array_find_as(const store *s, const char *name, store_type type, int rank,
                               const size_t *dims, const store_array **out, lam_error *error) {
    lam_status status = LAM_OK;
    const store_array *array = NULL;
    assert(rank >= 1 && rank <= STORE_MAX_RANK);
    TRY(store_array_find(s, name, &array, error));
    if (array->is_text || array->type != type)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is of %s, must be %s", s->path, name,
             array->is_text ? "texts" : type_text(array->type), type_text(type));
    if (array->rank != rank)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has %d dimensions, must have %d", s->path, name, array->rank,
             rank);
    for (int i = 0; i < rank; i++)
        if (dims[i] != SIZE_MAX && dims[i] != array->dims[i])
            FAIL(error, LAM_ERR_FORMAT, "%s: dimension %d of %s is %zu, must be %zu", s->path, i, name,
                 array->dims[i], dims[i]);
    *out = array;
done:
    return status;
}

lam_status store_read(store *s, const char *name, store_type type, int rank, size_t *dims, void **data,
                      lam_error *error) {
    lam_status status = LAM_OK;
    const store_array *array = NULL;
    void *values = NULL;
    TRY(store_array_find_as(s, name, type, rank, dims, &array, error));
    values = memory_allocate(array->bytes, 1, name, error);
    if (values == NULL) TRY(LAM_ERR_MEMORY);
    TRY(store_array_load(s, name, array, values, error));
    memcpy(dims, array->dims, (size_t)rank * sizeof *dims);
    *data = values;
    values = NULL;
done:
    free(values);
    return status;
}

lam_status store_read_into(store *s, const char *name, store_type type, int rank, const size_t *dims,
                           void *data, lam_error *error) {
    lam_status status = LAM_OK;
    const store_array *array = NULL;
    TRY(store_array_find_as(s, name, type, rank, dims, &array, error));
    TRY(store_array_load(s, name, array, data, error));
done:
    return status;
}

/* One block: count pointers, then the texts, each with a NUL. */
static lam_status unpack_texts(const store_array *array, const char *name, const char *packed, char ***texts,
                               lam_error *error) {
    size_t count = array->dims[0], width = array->value_size, size;
    if (!size_multiply(count, sizeof(char *) + width + 1, &size))
        return status_fail(error, LAM_ERR_MEMORY, "%s: %zu texts of %zu bytes are too many", name, count,
                           width);
    char **block = memory_allocate(size, 1, name, error);
    if (block == NULL) return LAM_ERR_MEMORY;
    char *at = (char *)(block + count);
    for (size_t i = 0; i < count; i++, at += width + 1) {
        block[i] = at;
        memcpy(at, packed + i * width, width);
    }
    *texts = block;
    return LAM_OK;
}

lam_status store_read_texts(store *s, const char *name, size_t *count, char ***texts, lam_error *error) {
    lam_status status = LAM_OK;
    const store_array *array = NULL;
    char *packed = NULL;
    TRY(store_array_find(s, name, &array, error));
    if (!array->is_text || array->rank != 1)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is not a list of texts", s->path, name);
    if (array->value_size > STORE_TEXT_MOST)
        FAIL(error, LAM_ERR_FORMAT, "%s: a text of %s takes %zu bytes, at most %zu are read", s->path, name,
             array->value_size, STORE_TEXT_MOST);
    packed = memory_allocate(array->bytes, 1, name, error);
    if (packed == NULL) TRY(LAM_ERR_MEMORY);
    TRY(store_array_load(s, name, array, packed, error));
    TRY(unpack_texts(array, name, packed, texts, error));
    *count = array->dims[0];
done:
    free(packed);
    return status;
}
