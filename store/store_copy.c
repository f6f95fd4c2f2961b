/* Copies the objects of an opened store into one that is written. */
#include "store/groups.h"
#include "store/store_private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* True for a group and all below it. */
static bool is_below(const char *name, const char *group) {
    const size_t length = strlen(group);
    return strncmp(name, group, length) == 0 && (name[length] == '\0' || name[length] == '/');
}

/* Attributes of the root that sealing writes. */
static bool is_sealed(const char *name) {
    return strcmp(name, "format") == 0 || strcmp(name, "version") == 0 || strcmp(name, "created") == 0;
}

static lam_status copy_array(store *from, const store_object *object, store *to, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK], count = 0;
    void *data = NULL;
    char **texts = NULL;
    memcpy(dims, object->array.dims, sizeof dims);
    if (object->array.is_text) {
        TRY(store_read_texts(from, object->name, &count, &texts, error));
        TRY(store_write_texts(to, object->name, count, (const char *const *)texts, error));
    } else {
        TRY(store_read(from, object->name, object->array.type, object->array.rank, dims, &data, error));
        TRY(store_write(to, object->name, object->array.type, object->array.rank, dims, data, error));
    }
done:
    free(data);
    free(texts);
    return status;
}

static lam_status copy_attribute(const char *object, const store_attribute *a, store *to, lam_error *error) {
    switch (a->kind) {
    case ATTRIBUTE_TEXT:
        return store_set_text(to, object, a->name, a->text, error);
    case ATTRIBUTE_NUMBER:
        return store_set_number(to, object, a->name, a->number, error);
    case ATTRIBUTE_INTEGER:
        return store_set_integer(to, object, a->name, a->integer, error);
    case ATTRIBUTE_OTHER:
        break;
    }
    return LAM_OK; /* none that a store has */
}

/* True for an object that is left out, or is in a group that is. */
static bool is_left_out(const char *name, store_skip *skip) {
    char group[STORE_NAME_SIZE];
    if (is_below(name, STORE_CHECKSUM)) return true;
    snprintf(group, sizeof group, "%s", name);
    while (group[0] != '\0' && !skip(group, NULL)) *strrchr(group, '/') = '\0';
    return group[0] != '\0';
}

lam_status store_copy(store *from, store_skip *skip, store *to, lam_error *error) {
    lam_status status = LAM_OK;
    /* Objects are sorted by name, so that a group stands before all in it. */
    for (size_t k = 0; k < from->index.n_objects; k++) {
        const store_object *object = &from->index.objects[k];
        const bool root = strcmp(object->name, "/") == 0;
        if (!root && is_left_out(object->name, skip)) continue;
        if (object->kind == OBJECT_FAULTY) FAIL(error, object->status, "%s", object->fault);
        if (object->kind == OBJECT_ARRAY) TRY(copy_array(from, object, to, error));
        for (size_t i = 0; i < object->n_attributes; i++) {
            const store_attribute *a = &object->attributes[i];
            if ((root && is_sealed(a->name)) || skip(object->name, a->name)) continue;
            TRY(copy_attribute(object->name, a, to, error));
        }
    }
done:
    return status;
}
