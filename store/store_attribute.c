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

/* True if the path leads to an object of a store that is written. */
static bool is_there(const store *s, const char *name) {
    char prefix[STORE_NAME_SIZE];
    const size_t length = strlen(name);
    for (size_t i = 1; i <= length && length > 1; i++) {
        if (name[i] != '/' && name[i] != '\0') continue;
        memcpy(prefix, name, i);
        prefix[i] = '\0';
        if (H5Lexists(s->h5, prefix, H5P_DEFAULT) <= 0) return false;
    }
    return true;
}

static lam_status attribute_write(store *s, const char *object, const char *name, hid_t type,
                                  const void *value, lam_error *error) {
    assert(s->target != NULL);
    lam_status status = LAM_OK;
    hid_t space = -1, holder = -1, attribute = -1;
    TRY(store_name_check(s, object, error));
    if (!is_there(s, object)) TRY(store_make_groups(s, object, true, error));
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

const store_attribute *store_attribute_find(const store_object *object, const char *name) {
    size_t low = 0, high = object->n_attributes;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        const int order = strcmp(object->attributes[middle].name, name);
        if (order == 0) return &object->attributes[middle];
        if (order < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

static lam_status attribute_find(const store *s, const char *object, const char *name,
                                 const store_attribute **value, lam_error *error) {
    const store_object *holder = store_find(s, object);
    if (holder == NULL) return status_fail(error, LAM_ERR_FORMAT, "%s: has no %s", s->path, object);
    *value = store_attribute_find(holder, name);
    if (*value == NULL)
        return status_fail(error, LAM_ERR_FORMAT, "%s: %s has no attribute \"%s\"", s->path, object, name);
    return LAM_OK;
}

lam_status store_get_text(store *s, const char *object, const char *name, char **text, lam_error *error) {
    lam_status status = LAM_OK;
    const store_attribute *value = NULL;
    TRY(attribute_find(s, object, name, &value, error));
    if (value->kind != ATTRIBUTE_TEXT)
        FAIL(error, LAM_ERR_FORMAT, "%s: attribute \"%s\" of %s is not a text", s->path, name, object);
    char *copy = memory_allocate(strlen(value->text) + 1, 1, object, error);
    if (copy == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(copy, value->text, strlen(value->text) + 1);
    *text = copy;
done:
    return status;
}

lam_status store_get_number(store *s, const char *object, const char *name, double *number,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const store_attribute *value = NULL;
    TRY(attribute_find(s, object, name, &value, error));
    if (value->kind != ATTRIBUTE_NUMBER && value->kind != ATTRIBUTE_INTEGER)
        FAIL(error, LAM_ERR_FORMAT, "%s: attribute \"%s\" of %s is not a number", s->path, name, object);
    *number = value->number;
done:
    return status;
}

lam_status store_get_integer(store *s, const char *object, const char *name, int64_t *integer,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const store_attribute *value = NULL;
    TRY(attribute_find(s, object, name, &value, error));
    if (value->kind != ATTRIBUTE_INTEGER)
        FAIL(error, LAM_ERR_FORMAT, "%s: attribute \"%s\" of %s is not an integer", s->path, name, object);
    *integer = value->integer;
done:
    return status;
}

bool store_has_attribute(store *s, const char *object, const char *name) {
    const store_object *holder = store_find(s, object);
    return holder != NULL && store_attribute_find(holder, name) != NULL;
}

lam_status store_each_attribute(store *s, const char *object, store_visit *visit, void *context,
                                lam_error *error) {
    const store_object *holder = store_find(s, object);
    if (holder == NULL) return status_fail(error, LAM_ERR_FORMAT, "%s: has no %s", s->path, object);
    for (size_t i = 0; i < holder->n_attributes; i++) {
        const store_attribute *value = &holder->attributes[i];
        if (value->kind != ATTRIBUTE_OTHER) visit(context, value->name, value->text, value->number);
    }
    return LAM_OK;
}
