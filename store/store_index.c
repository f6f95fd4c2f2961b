/* The names, shapes, places and attributes of an opened store, as a child process sent them (store_reply.h).
 * They are bytes from outside: everything is compared with what a store may have before it is used. */
#include "store/store_private.h"

#include <stdlib.h>
#include <string.h>

/* The rest of the bytes that were received. */
typedef struct cursor {
    const char *at;
    size_t left;
} cursor;

static bool take(cursor *c, void *out, size_t size) {
    if (size > c->left) return false;
    memcpy(out, c->at, size);
    c->at += size;
    c->left -= size;
    return true;
}

/* A text of exactly size bytes with its NUL, in place; NULL if it is none. */
static const char *take_text(cursor *c, size_t size) {
    const char *text = c->at;
    if (size == 0 || size > c->left || text[size - 1] != '\0' || memchr(text, '\0', size - 1) != NULL)
        return NULL;
    c->at += size;
    c->left -= size;
    return text;
}

/* An absolute path of names, which are neither empty nor too many. */
static bool is_path(const char *name) {
    size_t length = strlen(name), depth = 0;
    if (name[0] != '/' || length >= STORE_NAME_SIZE) return false;
    for (size_t i = 0; i < length; i++) {
        if (name[i] != '/') continue;
        depth++;
        if (length > 1 && (name[i + 1] == '/' || name[i + 1] == '\0')) return false;
    }
    return depth <= STORE_MAX_DEPTH;
}

/* A message of ours about this file: one line, which begins as status_fail writes its name. */
static bool is_message(const char *path, const char *text) {
    lam_error begin;
    (void)status_fail(&begin, LAM_ERR_IO, "%s:", path);
    for (const char *c = text; *c != '\0'; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f) return false;
    return strncmp(text, begin.message, strlen(begin.message)) == 0;
}

/* The errors that reading headers can have. */
static bool is_status(uint64_t status) {
    return status == LAM_ERR_MEMORY || status == LAM_ERR_IO || status == LAM_ERR_FORMAT ||
           status == LAM_ERR_DAMAGED;
}

/* Checks a shape against the size of the file, and fills the array. */
static bool read_array(const object_record *record, uint64_t file_size, store_array *array) {
    if (record->is_text > 1 || record->rank < 1 || record->rank > STORE_MAX_RANK || record->value_size == 0)
        return false;
    if (record->is_text == 0 &&
        (record->type > STORE_I8 || record->value_size != store_type_size((store_type)record->type)))
        return false;
    *array = (store_array){.is_text = record->is_text == 1,
                           .type = (store_type)record->type,
                           .value_size = (size_t)record->value_size,
                           .rank = (int)record->rank,
                           .bytes = (size_t)record->value_size,
                           .offset = record->offset};
    for (int i = 0; i < array->rank; i++) {
        array->dims[i] = (size_t)record->dims[i];
        if (!size_multiply(array->bytes, array->dims[i], &array->bytes)) return false;
    }
    return array->bytes == 0 ? array->offset == 0
                             : array->offset <= file_size && array->bytes <= file_size - array->offset;
}

/* before: the one before it of the same object, whose name is smaller; NULL: it is the first. */
static bool read_attribute(cursor *c, const store_attribute *before, store_attribute *out) {
    attribute_record record;
    if (!take(c, &record, sizeof record) || record.kind > ATTRIBUTE_OTHER) return false;
    *out = (store_attribute){.kind = (attribute_kind)record.kind, .name = take_text(c, record.name_bytes)};
    if (out->name == NULL || (before != NULL && strcmp(before->name, out->name) >= 0)) return false;
    if (out->kind != ATTRIBUTE_TEXT) {
        if (record.text_bytes != 0) return false;
        if (out->kind == ATTRIBUTE_NUMBER) memcpy(&out->number, &record.value, sizeof out->number);
        if (out->kind == ATTRIBUTE_INTEGER) {
            memcpy(&out->integer, &record.value, sizeof out->integer);
            out->number = (double)out->integer;
        }
        return true;
    }
    out->text = take_text(c, record.text_bytes);
    return out->text != NULL;
}

/* Reads one object, whose attributes are appended to the index, which has room for as many as were promised.
 */
static bool read_object(store_index *index, uint64_t n_attributes, cursor *c, const char *path,
                        uint64_t file_size) {
    object_record record;
    store_object *object = &index->objects[index->n_objects];
    if (!take(c, &record, sizeof record) || record.kind > OBJECT_FAULTY) return false;
    *object = (store_object){.kind = (object_kind)record.kind,
                             .name = take_text(c, record.name_bytes),
                             .attributes = index->attributes + index->n_attributes};
    if (object->name == NULL || !is_path(object->name)) return false;
    if (object->kind == OBJECT_ARRAY && !read_array(&record, file_size, &object->array)) return false;
    if (object->kind == OBJECT_FAULTY) {
        object->status = (lam_status)record.status;
        object->fault = take_text(c, record.fault_bytes);
        if (!is_status(record.status) || object->fault == NULL) return false;
        /* Memory is short without a word about this file. */
        if (object->status != LAM_ERR_MEMORY && !is_message(path, object->fault)) return false;
    } else if (record.fault_bytes != 0) {
        return false;
    }
    if (record.n_attributes > n_attributes - index->n_attributes) return false;
    while (object->n_attributes < record.n_attributes) {
        store_attribute *next = &index->attributes[index->n_attributes];
        if (!read_attribute(c, object->n_attributes > 0 ? next - 1 : NULL, next)) return false;
        object->n_attributes++;
        index->n_attributes++;
    }
    index->n_objects++;
    return true;
}

static int compare_names(const void *a, const void *b) {
    return strcmp(((const store_object *)a)->name, ((const store_object *)b)->name);
}

static const store_object *find(const store_index *index, const char *name) {
    const store_object key = {.name = name};
    if (index->n_objects == 0) return NULL;
    return bsearch(&key, index->objects, index->n_objects, sizeof key, compare_names);
}

/* Sorts the objects by name. True if each has another name and lies in a group. */
static bool is_tree(store_index *index) {
    char parent[STORE_NAME_SIZE];
    qsort(index->objects, index->n_objects, sizeof *index->objects, compare_names);
    if (index->n_objects > 0 && strcmp(index->objects[0].name, "/") != 0) return false;
    for (size_t i = 1; i < index->n_objects; i++) {
        const char *name = index->objects[i].name;
        const size_t length = (size_t)(strrchr(name, '/') - name);
        if (strcmp(index->objects[i - 1].name, name) == 0) return false;
        memcpy(parent, name, length);
        parent[length] = '\0';
        const store_object *above = find(index, length == 0 ? "/" : parent);
        if (above == NULL || above->kind != OBJECT_GROUP) return false;
    }
    return true;
}

static int compare_places(const void *a, const void *b) {
    const uint64_t first = (*(const store_object *const *)a)->array.offset,
                   second = (*(const store_object *const *)b)->array.offset;
    return (first > second) - (first < second);
}

/* Refuses arrays that share bytes: no store has them. */
static lam_status check_places(const store_index *index, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    const store_object **arrays = memory_allocate(index->n_objects, sizeof *arrays, path, error);
    if (arrays == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < index->n_objects; i++)
        if (index->objects[i].kind == OBJECT_ARRAY && index->objects[i].array.bytes > 0)
            arrays[count++] = &index->objects[i];
    qsort(arrays, count, sizeof *arrays, compare_places);
    for (size_t i = 1; i < count; i++)
        if (arrays[i]->array.offset - arrays[i - 1]->array.offset < arrays[i - 1]->array.bytes)
            FAIL(error, LAM_ERR_FORMAT, "%s: %s and %s share bytes, as in no store", path,
                 arrays[i - 1]->name, arrays[i]->name);
done:
    free(arrays);
    return status;
}

static lam_status damaged_reply(const char *path, lam_error *error) {
    return status_fail(error, LAM_ERR_DAMAGED,
                       "%s: the process that reads its headers answered nonsense; make the store again",
                       path);
}

lam_status store_reply_check(const reply_head *head, const char *path, lam_error *error) {
    const bool sound =
        memcmp(head->magic, REPLY_MAGIC, sizeof head->magic) == 0 &&
        (head->status == LAM_OK || is_status(head->status)) && head->bytes <= REPLY_MOST_BYTES &&
        head->n_objects <= head->bytes / sizeof(object_record) &&
        head->n_attributes <= head->bytes / sizeof(attribute_record) &&
        memchr(head->message, '\0', sizeof head->message) != NULL &&
        (head->status == LAM_OK || head->status == LAM_ERR_MEMORY || is_message(path, head->message));
    return sound ? LAM_OK : damaged_reply(path, error);
}

lam_status store_reply_read(const reply_head *head, const char *path, uint64_t file_size, char *bytes,
                            store_index *out, lam_error *error) {
    lam_status status = LAM_OK;
    store_index index = {.bytes = bytes};
    cursor c = {bytes, (size_t)head->bytes};
    index.objects = memory_allocate((size_t)head->n_objects, sizeof *index.objects, path, error);
    if (index.objects == NULL) TRY(LAM_ERR_MEMORY);
    index.attributes = memory_allocate((size_t)head->n_attributes, sizeof *index.attributes, path, error);
    if (index.attributes == NULL) TRY(LAM_ERR_MEMORY);
    while (index.n_objects < head->n_objects)
        if (!read_object(&index, head->n_attributes, &c, path, file_size)) TRY(damaged_reply(path, error));
    if (c.left > 0 || index.n_attributes != head->n_attributes || !is_tree(&index) ||
        (head->status == LAM_OK && index.n_objects == 0))
        TRY(damaged_reply(path, error));
    TRY(check_places(&index, path, error));
    *out = index;
    index = (store_index){.bytes = NULL};
    bytes = NULL;
done:
    if (bytes != NULL) store_index_free(&index);
    return status;
}

void store_index_free(store_index *index) {
    free(index->objects);
    free(index->attributes);
    free(index->bytes);
    *index = (store_index){.bytes = NULL};
}

const store_object *store_find(const store *s, const char *name) {
    return find(&s->index, name);
}

bool store_has(store *s, const char *name) {
    return store_find(s, name) != NULL;
}

lam_status store_array_find(const store *s, const char *name, const store_array **array, lam_error *error) {
    const store_object *object = store_find(s, name);
    if (object == NULL) return status_fail(error, LAM_ERR_FORMAT, "%s: has no %s", s->path, name);
    if (object->kind == OBJECT_GROUP)
        return status_fail(error, LAM_ERR_FORMAT, "%s: %s is not an array", s->path, name);
    if (object->kind == OBJECT_FAULTY)
        return object->status == LAM_ERR_MEMORY
                   ? status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory to read %s", s->path, name)
                   : status_fail(error, object->status, "%s", object->fault);
    *array = &object->array;
    return LAM_OK;
}
