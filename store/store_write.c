/* Writing: arrays, texts, and the groups they are in. */
#include "store/groups.h"
#include "store/store_private.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

hid_t store_untimed(hid_t class_id) {
    hid_t properties = H5Pcreate(class_id);
    if (properties >= 0 && H5Pset_obj_track_times(properties, false) < 0) {
        H5Pclose(properties);
        properties = -1;
    }
    return properties;
}

static lam_status make_group(store *s, const char *name, lam_error *error) {
    lam_status status = LAM_OK;
    hid_t creation = -1, group = -1;
    htri_t found = H5Lexists(s->h5, name, H5P_DEFAULT);
    if (found > 0) goto done;
    creation = store_untimed(H5P_GROUP_CREATE);
    if (found == 0 && creation >= 0) group = H5Gcreate2(s->h5, name, H5P_DEFAULT, creation, H5P_DEFAULT);
    if (group < 0 || s->file.error != 0) TRY(store_hdf5_failure(s, name, "write", error));
done:
    if (group >= 0) H5Gclose(group);
    if (creation >= 0) H5Pclose(creation);
    return status;
}

lam_status store_make_groups(store *s, const char *name, bool whole, lam_error *error) {
    lam_status status = LAM_OK;
    char prefix[STORE_NAME_SIZE];
    size_t length = strlen(name);
    assert(length < sizeof prefix);
    for (size_t i = 1; i <= length && length > 1; i++) {
        if (name[i] != '/' && (name[i] != '\0' || !whole)) continue;
        memcpy(prefix, name, i);
        prefix[i] = '\0';
        TRY(make_group(s, prefix, error));
    }
done:
    return status;
}

/* Contiguous, allocated at once, without fill values. */
static hid_t array_properties(void) {
    hid_t properties = store_untimed(H5P_DATASET_CREATE);
    if (properties >= 0 && (H5Pset_layout(properties, H5D_CONTIGUOUS) < 0 ||
                            H5Pset_alloc_time(properties, H5D_ALLOC_TIME_EARLY) < 0 ||
                            H5Pset_fill_time(properties, H5D_FILL_TIME_NEVER) < 0)) {
        H5Pclose(properties);
        properties = -1;
    }
    return properties;
}

lam_status store_write_plain(store *s, const char *name, hid_t type, int rank, const size_t *dims,
                             const void *data, lam_error *error) {
    lam_status status = LAM_OK;
    hid_t space = -1, properties = -1, dataset = -1;
    hsize_t extent[STORE_MAX_RANK];
    size_t count = 1;
    for (int i = 0; i < rank; i++) {
        extent[i] = dims[i];
        if (!size_multiply(count, dims[i], &count))
            FAIL(error, LAM_ERR_ARGUMENT, "%s: %s has too many values to count", s->path, name);
    }
    TRY(store_make_groups(s, name, false, error));
    space = H5Screate_simple(rank, extent, NULL);
    properties = array_properties();
    if (space >= 0 && properties >= 0)
        dataset = H5Dcreate2(s->h5, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
    if (dataset < 0 || (count > 0 && H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0) ||
        s->file.error != 0)
        TRY(store_hdf5_failure(s, name, "write", error));
done:
    if (dataset >= 0) H5Dclose(dataset);
    if (properties >= 0) H5Pclose(properties);
    if (space >= 0) H5Sclose(space);
    return status;
}

/* IEEE half precision, which HDF5 1.10 has no name for: 1 sign, 5 exponent, 10 mantissa bits. */
static hid_t half_type(void) {
    hid_t type = H5Tcopy(H5T_IEEE_F32LE);
    if (type >= 0 && (H5Tset_fields(type, 15, 10, 5, 0, 10) < 0 || H5Tset_size(type, 2) < 0 ||
                      H5Tset_ebias(type, 15) < 0)) {
        H5Tclose(type);
        type = -1;
    }
    return type;
}

hid_t store_file_type(store_type type) {
    switch (type) {
    case STORE_F32:
        return H5Tcopy(H5T_IEEE_F32LE);
    case STORE_F64:
        return H5Tcopy(H5T_IEEE_F64LE);
    case STORE_U32:
        return H5Tcopy(H5T_STD_U32LE);
    case STORE_U64:
        return H5Tcopy(H5T_STD_U64LE);
    case STORE_F16:
        return half_type();
    case STORE_U16:
        return H5Tcopy(H5T_STD_U16LE);
    case STORE_I8:
        return H5Tcopy(H5T_STD_I8LE);
    }
    return -1;
}

/* Writes an array and adds its checksums. */
static lam_status write_summed(store *s, const char *name, hid_t type, size_t value_size, int rank,
                               const size_t *dims, const void *data, lam_error *error) {
    lam_status status = LAM_OK;
    size_t bytes = value_size;
    TRY(store_name_check(s, name, error));
    if (strcmp(name, "/") == 0 || strncmp(name, STORE_CHECKSUM, 9) == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: %s is no name for an array", s->path, name);
    for (int i = 0; i < rank; i++)
        if (!size_multiply(bytes, dims[i], &bytes))
            FAIL(error, LAM_ERR_ARGUMENT, "%s: %s has too many bytes to count", s->path, name);
    assert(data != NULL || bytes == 0);
    TRY(store_write_plain(s, name, type, rank, dims, data, error));
    TRY(store_sums_add(&s->sums, name, data, bytes, error));
done:
    if (status != LAM_OK) s->broken = true;
    return status;
}

lam_status store_write(store *s, const char *name, store_type type, int rank, const size_t *dims,
                       const void *data, lam_error *error) {
    assert(s->target != NULL && rank >= 1 && rank <= STORE_MAX_RANK);
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    hid_t made = store_file_type(type);
    if (made < 0) {
        s->broken = true;
        TRY(store_hdf5_failure(s, name, "write", error));
    }
    TRY(write_summed(s, name, made, store_type_size(type), rank, dims, data, error));
done:
    if (made >= 0) H5Tclose(made);
    store_mute_end(&mute);
    return status;
}

lam_status store_write_texts(store *s, const char *name, size_t count, const char *const *texts,
                             lam_error *error) {
    assert(s->target != NULL);
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    char *block = NULL;
    hid_t type = -1;
    size_t width = 1; /* HDF5 has no texts of length 0 */
    for (size_t i = 0; i < count; i++)
        if (strlen(texts[i]) > width) width = strlen(texts[i]);
    block = memory_allocate(count, width, name, error);
    if (block == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < count; i++) memcpy(block + i * width, texts[i], strlen(texts[i]));
    TRY(store_text_type(s, width, &type, error));
    TRY(write_summed(s, name, type, width, 1, &count, block, error));
done:
    if (status != LAM_OK) s->broken = true;
    if (type >= 0) H5Tclose(type);
    free(block);
    store_mute_end(&mute);
    return status;
}
