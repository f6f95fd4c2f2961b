/* Attributes: a text (fixed length, UTF-8), a number (f64) or an integer (i64), one value each. */
#include "store/store_private.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

lam_status store_text_type(store *s, size_t width, hid_t *out, lam_error *error) {
    lam_status status = LAM_OK;
    hid_t type = H5Tcopy(H5T_C_S1);
    if (type < 0 || H5Tset_size(type, width) < 0 || H5Tset_strpad(type, H5T_STR_NULLPAD) < 0 ||
        H5Tset_cset(type, H5T_CSET_UTF8) < 0)
        TRY(store_hdf5_failure(s, "a text", "write", error));
    *out = type;
    type = -1;
done:
    if (type >= 0) H5Tclose(type);
    return status;
}

static lam_status attribute_write(store *s, const char *object, const char *name, hid_t type,
                                  const void *value, lam_error *error) {
    assert(s->target != NULL);
    lam_status status = LAM_OK;
    hid_t space = -1, holder = -1, attribute = -1;
    TRY(store_name_check(s, object, error));
    if (store_exists(s, object) == 0) TRY(store_make_groups(s, object, true, error));
    holder = H5Oopen(s->h5, object, H5P_DEFAULT);
    space = H5Screate(H5S_SCALAR);
    if (holder >= 0 && space >= 0 && (H5Aexists(holder, name) == 0 || H5Adelete(holder, name) >= 0))
        attribute = H5Acreate2(holder, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0 || H5Awrite(attribute, type, value) < 0 || s->file.error != 0)
        TRY(store_hdf5_failure(s, object, "write an attribute of", error));
done:
    if (status != LAM_OK) s->broken = true;
    if (attribute >= 0) H5Aclose(attribute);
    if (space >= 0) H5Sclose(space);
    if (holder >= 0) H5Oclose(holder);
    return status;
}

lam_status store_set_text(store *s, const char *object, const char *name, const char *text,
                          lam_error *error) {
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    hid_t type = -1;
    size_t length = strlen(text);
    TRY(store_text_type(s, length == 0 ? 1 : length, &type, error));
    TRY(attribute_write(s, object, name, type, text, error)); /* an empty text is its NUL */
done:
    if (status != LAM_OK) s->broken = true;
    if (type >= 0) H5Tclose(type);
    store_mute_end(&mute);
    return status;
}

lam_status store_set_number(store *s, const char *object, const char *name, double value, lam_error *error) {
    store_mute mute = store_mute_begin();
    lam_status status = attribute_write(s, object, name, H5T_IEEE_F64LE, &value, error);
    store_mute_end(&mute);
    return status;
}

lam_status store_set_integer(store *s, const char *object, const char *name, int64_t value,
                             lam_error *error) {
    store_mute mute = store_mute_begin();
    lam_status status = attribute_write(s, object, name, H5T_STD_I64LE, &value, error);
    store_mute_end(&mute);
    return status;
}

typedef enum attribute_kind {
    ATTRIBUTE_TEXT,
    ATTRIBUTE_NUMBER,
    ATTRIBUTE_INTEGER,
    ATTRIBUTE_OTHER
} attribute_kind;

typedef struct attribute {
    attribute_kind kind;
    char *text; /* owned */
    double number;
    int64_t integer;
} attribute;

static attribute_kind kind_of(hid_t type, hid_t space) {
    if (H5Sget_simple_extent_type(space) != H5S_SCALAR) return ATTRIBUTE_OTHER;
    if (H5Tequal(type, H5T_IEEE_F64LE) > 0) return ATTRIBUTE_NUMBER;
    if (H5Tequal(type, H5T_STD_I64LE) > 0) return ATTRIBUTE_INTEGER;
    if (H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) == 0) return ATTRIBUTE_TEXT;
    return ATTRIBUTE_OTHER;
}

/* Reads an open attribute; the caller frees value->text. */
static lam_status attribute_read(store *s, const char *object, hid_t id, attribute *value, lam_error *error) {
    lam_status status = LAM_OK;
    hid_t type = H5Aget_type(id), space = H5Aget_space(id);
    void *target = NULL;
    *value = (attribute){.kind = ATTRIBUTE_OTHER};
    if (type < 0 || space < 0) TRY(store_hdf5_failure(s, object, "read an attribute of", error));
    value->kind = kind_of(type, space);
    if (value->kind == ATTRIBUTE_NUMBER) target = &value->number;
    if (value->kind == ATTRIBUTE_INTEGER) target = &value->integer;
    if (value->kind == ATTRIBUTE_TEXT) {
        size_t size = H5Tget_size(type);
        if (size == 0 || size > s->file.size)
            FAIL(error, LAM_ERR_FORMAT, "%s: an attribute of %s is longer than the file", s->path, object);
        target = value->text = memory_allocate(size + 1, 1, object, error);
        if (target == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (target != NULL && H5Aread(id, type, target) < 0)
        TRY(store_hdf5_failure(s, object, "read an attribute of", error));
done:
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    if (status != LAM_OK) {
        free(value->text);
        value->text = NULL;
    }
    return status;
}

static lam_status attribute_find(store *s, const char *object, const char *name, attribute *value,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    hid_t holder = -1, id = -1;
    int found = store_exists(s, object);
    if (found == 0) FAIL(error, LAM_ERR_FORMAT, "%s: has no %s", s->path, object);
    if (found > 0) holder = H5Oopen(s->h5, object, H5P_DEFAULT);
    htri_t present = holder >= 0 ? H5Aexists(holder, name) : -1;
    if (present == 0) FAIL(error, LAM_ERR_FORMAT, "%s: %s has no attribute \"%s\"", s->path, object, name);
    if (present > 0) id = H5Aopen(holder, name, H5P_DEFAULT);
    if (id < 0) TRY(store_hdf5_failure(s, object, "read an attribute of", error));
    TRY(attribute_read(s, object, id, value, error));
done:
    if (id >= 0) H5Aclose(id);
    if (holder >= 0) H5Oclose(holder);
    return status;
}

lam_status store_get_text(store *s, const char *object, const char *name, char **text, lam_error *error) {
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    attribute value = {.kind = ATTRIBUTE_OTHER};
    TRY(attribute_find(s, object, name, &value, error));
    if (value.kind != ATTRIBUTE_TEXT)
        FAIL(error, LAM_ERR_FORMAT, "%s: attribute \"%s\" of %s is not a text", s->path, name, object);
    *text = value.text;
    value.text = NULL;
done:
    free(value.text);
    store_mute_end(&mute);
    return status;
}

lam_status store_get_number(store *s, const char *object, const char *name, double *number,
                            lam_error *error) {
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    attribute value = {.kind = ATTRIBUTE_OTHER};
    TRY(attribute_find(s, object, name, &value, error));
    if (value.kind != ATTRIBUTE_NUMBER && value.kind != ATTRIBUTE_INTEGER)
        FAIL(error, LAM_ERR_FORMAT, "%s: attribute \"%s\" of %s is not a number", s->path, name, object);
    *number = value.kind == ATTRIBUTE_NUMBER ? value.number : (double)value.integer;
done:
    free(value.text);
    store_mute_end(&mute);
    return status;
}

lam_status store_get_integer(store *s, const char *object, const char *name, int64_t *integer,
                             lam_error *error) {
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    attribute value = {.kind = ATTRIBUTE_OTHER};
    TRY(attribute_find(s, object, name, &value, error));
    if (value.kind != ATTRIBUTE_INTEGER)
        FAIL(error, LAM_ERR_FORMAT, "%s: attribute \"%s\" of %s is not an integer", s->path, name, object);
    *integer = value.integer;
done:
    free(value.text);
    store_mute_end(&mute);
    return status;
}

bool store_has_attribute(store *s, const char *object, const char *name) {
    store_mute mute = store_mute_begin();
    bool found = store_exists(s, object) > 0 && H5Aexists_by_name(s->h5, object, name, H5P_DEFAULT) > 0;
    store_mute_end(&mute);
    return found;
}

typedef struct attribute_walk {
    store *s;
    const char *object;
    store_visit *visit;
    void *context;
    lam_status status;
    lam_error *error;
} attribute_walk;

static herr_t walk_visit(hid_t holder, const char *name, const H5A_info_t *info, void *context) {
    (void)info;
    attribute_walk *walk = context;
    lam_status status = LAM_OK;
    attribute value = {.kind = ATTRIBUTE_OTHER};
    hid_t id = H5Aopen(holder, name, H5P_DEFAULT);
    if (id < 0) TRY(store_hdf5_failure(walk->s, walk->object, "read an attribute of", walk->error));
    TRY(attribute_read(walk->s, walk->object, id, &value, walk->error));
    if (value.kind == ATTRIBUTE_INTEGER) value.number = (double)value.integer;
    if (value.kind != ATTRIBUTE_OTHER) walk->visit(walk->context, name, value.text, value.number);
done:
    free(value.text);
    if (id >= 0) H5Aclose(id);
    walk->status = status;
    return status == LAM_OK ? 0 : -1;
}

lam_status store_each_attribute(store *s, const char *object, store_visit *visit, void *context,
                                lam_error *error) {
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    attribute_walk walk = {s, object, visit, context, LAM_OK, error};
    hid_t holder = -1;
    hsize_t from = 0;
    int found = store_exists(s, object);
    if (found == 0) FAIL(error, LAM_ERR_FORMAT, "%s: has no %s", s->path, object);
    if (found > 0) holder = H5Oopen(s->h5, object, H5P_DEFAULT);
    if (holder < 0 || H5Aiterate2(holder, H5_INDEX_NAME, H5_ITER_INC, &from, walk_visit, &walk) < 0) {
        TRY(walk.status);
        TRY(store_hdf5_failure(s, object, "read the attributes of", error));
    }
done:
    if (holder >= 0) H5Oclose(holder);
    store_mute_end(&mute);
    return status;
}
