/* Reads arrays: every size in a header is compared with the file before it is used. */
#include "store/store_private.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* Type of the values; false for a type that no store holds. */
static bool describe_type(hid_t type, store_array *array) {
    static const store_type types[] = {STORE_F32, STORE_F64, STORE_U32, STORE_U64,
                                       STORE_F16, STORE_U16, STORE_I8};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        hid_t ours = store_file_type(types[i]);
        const bool same = ours >= 0 && H5Tequal(type, ours) > 0;
        if (ours >= 0) H5Tclose(ours);
        if (!same) continue;
        array->type = types[i];
        array->value_size = store_type_size(types[i]);
        return true;
    }
    array->is_text = H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) == 0;
    array->value_size = array->is_text ? H5Tget_size(type) : 0;
    return array->is_text && array->value_size > 0;
}

/* Shape and bytes; false for a shape that no store holds. */
static bool describe_shape(hid_t space, store_array *array) {
    hsize_t extent[STORE_MAX_RANK];
    array->rank = H5Sget_simple_extent_ndims(space);
    if (H5Sget_simple_extent_type(space) != H5S_SIMPLE || array->rank < 1 || array->rank > STORE_MAX_RANK ||
        H5Sget_simple_extent_dims(space, extent, NULL) != array->rank)
        return false;
    array->bytes = array->value_size;
    for (int i = 0; i < array->rank; i++) {
        array->dims[i] = (size_t)extent[i];
        if (!size_multiply(array->bytes, array->dims[i], &array->bytes)) return false;
    }
    return true;
}

/* True if the array is contiguous and lies within this file. */
static bool locate(store *s, store_array *array) {
    if (array->bytes == 0) return true;
    haddr_t offset = H5Dget_offset(array->id);
    if (offset == HADDR_UNDEF || H5Dget_storage_size(array->id) != array->bytes) return false;
    array->offset = offset;
    return array->offset <= s->file.size && array->bytes <= s->file.size - array->offset;
}

lam_status store_array_open(store *s, const char *name, store_array *array, lam_error *error) {
    lam_status status = LAM_OK;
    hid_t type = -1, space = -1, properties = -1;
    *array = (store_array){.id = -1};
    int found = store_exists(s, name);
    if (found == 0) FAIL(error, LAM_ERR_FORMAT, "%s: has no %s", s->path, name);
    if (found > 0) array->id = H5Oopen(s->h5, name, H5P_DEFAULT);
    if (array->id >= 0 && H5Iget_type(array->id) != H5I_DATASET)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is not an array", s->path, name);
    if (array->id >= 0) properties = H5Dget_create_plist(array->id);
    if (properties < 0) TRY(store_hdf5_failure(s, name, "read", error));
    /* First of all: the shape of a virtual array would be read from other files. */
    if (H5Pget_layout(properties) != H5D_CONTIGUOUS || H5Pget_external_count(properties) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is chunked, compressed or in another file, as in no store",
             s->path, name);
    type = H5Dget_type(array->id);
    space = H5Dget_space(array->id);
    if (type < 0 || space < 0) TRY(store_hdf5_failure(s, name, "read", error));
    if (!describe_type(type, array))
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is of a type that this program does not read", s->path, name);
    if (!describe_shape(space, array))
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has a shape that no store has", s->path, name);
    if (!locate(s, array))
        FAIL(error, LAM_ERR_FORMAT, "%s: %s (%zu bytes) does not lie within the file's %llu", s->path, name,
             array->bytes, (unsigned long long)s->file.size);
done:
    if (properties >= 0) H5Pclose(properties);
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    return status;
}

void store_array_close(store_array *array) {
    if (array->id >= 0) H5Oclose(array->id);
    array->id = -1;
}

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
    store_mute mute = store_mute_begin();
    store_array array = {.id = -1};
    TRY(store_array_open(s, name, &array, error));
    if (array.is_text) FAIL(error, LAM_ERR_FORMAT, "%s: %s holds texts, not numbers", s->path, name);
    *type = array.type;
    *rank = array.rank;
    memcpy(dims, array.dims, (size_t)array.rank * sizeof *dims);
done:
    store_array_close(&array);
    store_mute_end(&mute);
    return status;
}

lam_status store_array_open_as(store *s, const char *name, store_type type, int rank, const size_t *dims,
                               store_array *array, lam_error *error) {
    lam_status status = LAM_OK;
    assert(rank >= 1 && rank <= STORE_MAX_RANK);
    TRY(store_array_open(s, name, array, error));
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
done:
    return status;
}

lam_status store_read(store *s, const char *name, store_type type, int rank, size_t *dims, void **data,
                      lam_error *error) {
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    store_array array = {.id = -1};
    void *values = NULL;
    TRY(store_array_open_as(s, name, type, rank, dims, &array, error));
    values = memory_allocate(array.bytes, 1, name, error);
    if (values == NULL) TRY(LAM_ERR_MEMORY);
    TRY(store_array_load(s, name, &array, values, error));
    memcpy(dims, array.dims, (size_t)rank * sizeof *dims);
    *data = values;
    values = NULL;
done:
    free(values);
    store_array_close(&array);
    store_mute_end(&mute);
    return status;
}

lam_status store_read_into(store *s, const char *name, store_type type, int rank, const size_t *dims,
                           void *data, lam_error *error) {
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    store_array array = {.id = -1};
    TRY(store_array_open_as(s, name, type, rank, dims, &array, error));
    TRY(store_array_load(s, name, &array, data, error));
done:
    store_array_close(&array);
    store_mute_end(&mute);
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
    store_mute mute = store_mute_begin();
    store_array array = {.id = -1};
    char *packed = NULL;
    TRY(store_array_open(s, name, &array, error));
    if (!array.is_text || array.rank != 1)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is not a list of texts", s->path, name);
    packed = memory_allocate(array.bytes, 1, name, error);
    if (packed == NULL) TRY(LAM_ERR_MEMORY);
    TRY(store_array_load(s, name, &array, packed, error));
    TRY(unpack_texts(&array, name, packed, texts, error));
    *count = array.dims[0];
done:
    free(packed);
    store_array_close(&array);
    store_mute_end(&mute);
    return status;
}
