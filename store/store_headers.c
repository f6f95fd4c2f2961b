/* Reads the headers of a store by HDF5, in a child process: 1.10 may crash or hang over a damaged one. Names,
 * shapes, places and attributes are sent to the parent; data is not read here. */
#include "store/store_private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The reply as it grows. */
typedef struct reply {
    store *s;
    reply_buffer out;
    uint64_t n_objects, n_attributes;
    lam_status status; /* of the walk that runs */
    lam_error *error;
} reply;

lam_status reply_add(reply_buffer *b, const char *path, const void *data, size_t size, lam_error *error) {
    if (size > REPLY_MOST_BYTES - b->size)
        return status_fail(error, LAM_ERR_FORMAT, "%s: has more than %llu MiB of names and attributes", path,
                           (unsigned long long)(REPLY_MOST_BYTES >> 20));
    if (size > b->capacity - b->size) {
        const size_t capacity = 2 * (b->size + size) + 4096;
        char *bytes = memory_allocate(capacity, 1, "headers", error);
        if (bytes == NULL) return LAM_ERR_MEMORY;
        if (b->size > 0) memcpy(bytes, b->bytes, b->size);
        free(b->bytes);
        b->bytes = bytes;
        b->capacity = capacity;
    }
    if (size > 0) memcpy(b->bytes + b->size, data, size);
    b->size += size;
    return LAM_OK;
}

static attribute_kind kind_of(hid_t type, hid_t space) {
    if (H5Sget_simple_extent_type(space) != H5S_SCALAR) return ATTRIBUTE_OTHER;
    if (H5Tequal(type, H5T_IEEE_F64LE) > 0) return ATTRIBUTE_NUMBER;
    if (H5Tequal(type, H5T_STD_I64LE) > 0) return ATTRIBUTE_INTEGER;
    if (H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) == 0) return ATTRIBUTE_TEXT;
    return ATTRIBUTE_OTHER;
}

static lam_status send_attribute(reply *r, const char *name, hid_t id, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = r->s;
    const hid_t type = H5Aget_type(id), space = H5Aget_space(id);
    char *text = NULL;
    attribute_record record = {.name_bytes = (uint32_t)strlen(name) + 1};
    if (type < 0 || space < 0) TRY(store_hdf5_failure(s, name, "read the attribute", error));
    record.kind = kind_of(type, space);
    if (record.kind == ATTRIBUTE_TEXT) {
        const size_t size = H5Tget_size(type);
        if (size == 0 || size > s->file.size)
            FAIL(error, LAM_ERR_FORMAT, "%s: the attribute %s is longer than the file", s->path, name);
        text = memory_allocate(size + 1, 1, name, error);
        if (text == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (record.kind != ATTRIBUTE_OTHER && H5Aread(id, type, text != NULL ? (void *)text : &record.value) < 0)
        TRY(store_hdf5_failure(s, name, "read the attribute", error));
    if (text != NULL && strlen(text) < REPLY_MOST_BYTES) record.text_bytes = (uint32_t)strlen(text) + 1;
    TRY(reply_add(&r->out, r->s->path, &record, sizeof record, error));
    TRY(reply_add(&r->out, r->s->path, name, record.name_bytes, error));
    if (text != NULL) TRY(reply_add(&r->out, r->s->path, text, strlen(text) + 1, error));
    r->n_attributes++;
done:
    free(text);
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    return status;
}

static herr_t attribute_visit(hid_t holder, const char *name, const H5A_info_t *info, void *context) {
    (void)info;
    reply *r = context;
    lam_status status = LAM_OK;
    const hid_t id = H5Aopen(holder, name, H5P_DEFAULT);
    if (id < 0) TRY(store_hdf5_failure(r->s, name, "read the attribute", r->error));
    TRY(send_attribute(r, name, id, r->error));
done:
    if (id >= 0) H5Aclose(id);
    r->status = status;
    return status == LAM_OK ? 0 : -1;
}

/* Type of the values; false for a type that no store holds. */
static bool describe_type(hid_t type, object_record *record) {
    static const store_type types[] = {STORE_F32, STORE_F64, STORE_U32, STORE_U64,
                                       STORE_F16, STORE_U16, STORE_I8};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        const hid_t ours = store_file_type(types[i]);
        const bool same = ours >= 0 && H5Tequal(type, ours) > 0;
        if (ours >= 0) H5Tclose(ours);
        if (!same) continue;
        record->type = types[i];
        record->value_size = store_type_size(types[i]);
        return true;
    }
    record->is_text = H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) == 0;
    record->value_size = record->is_text ? H5Tget_size(type) : 0;
    return record->value_size > 0;
}

/* Shape and bytes; false for a shape that no store holds. */
static bool describe_shape(hid_t space, object_record *record, size_t *bytes) {
    hsize_t extent[STORE_MAX_RANK];
    const int rank = H5Sget_simple_extent_ndims(space);
    if (H5Sget_simple_extent_type(space) != H5S_SIMPLE || rank < 1 || rank > STORE_MAX_RANK ||
        H5Sget_simple_extent_dims(space, extent, NULL) != rank)
        return false;
    record->rank = (uint32_t)rank;
    *bytes = record->value_size;
    for (int i = 0; i < rank; i++) {
        record->dims[i] = extent[i];
        if (!size_multiply(*bytes, (size_t)extent[i], bytes)) return false;
    }
    return true;
}

static lam_status describe_array(store *s, const char *name, hid_t id, object_record *record,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    hid_t type = -1, space = -1;
    size_t bytes = 0;
    const hid_t properties = H5Dget_create_plist(id);
    if (properties < 0) TRY(store_hdf5_failure(s, name, "read", error));
    /* First of all: the shape of a virtual array would be read from other files. */
    if (H5Pget_layout(properties) != H5D_CONTIGUOUS || H5Pget_external_count(properties) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is chunked, compressed or in another file, as in no store",
             s->path, name);
    type = H5Dget_type(id);
    space = H5Dget_space(id);
    if (type < 0 || space < 0) TRY(store_hdf5_failure(s, name, "read", error));
    if (!describe_type(type, record))
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is of a type that this program does not read", s->path, name);
    if (!describe_shape(space, record, &bytes))
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has a shape that no store has", s->path, name);
    if (bytes > 0) {
        const haddr_t offset = H5Dget_offset(id);
        if (offset == HADDR_UNDEF || H5Dget_storage_size(id) != bytes || offset > s->file.size ||
            bytes > s->file.size - offset)
            FAIL(error, LAM_ERR_FORMAT, "%s: %s (%zu bytes) does not lie within the file's %llu", s->path,
                 name, bytes, (unsigned long long)s->file.size);
        record->offset = offset;
    }
done:
    if (properties >= 0) H5Pclose(properties);
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    return status;
}

/* Sends one object with its attributes. An array that no store has is sent as such: it may not be needed. */
static lam_status send_object(reply *r, const char *name, hid_t id, lam_error *error) {
    lam_status status = LAM_OK;
    object_record record = {.kind = OBJECT_GROUP, .name_bytes = (uint32_t)strlen(name) + 1};
    lam_error fault = {.message = ""};
    hsize_t from = 0;
    const uint64_t before = r->n_attributes;
    const size_t start = r->out.size;
    if (H5Iget_type(id) == H5I_DATASET) {
        const lam_status found = describe_array(r->s, name, id, &record, &fault);
        record.kind = OBJECT_ARRAY;
        if (found != LAM_OK)
            record = (object_record){.kind = OBJECT_FAULTY,
                                     .status = found,
                                     .name_bytes = record.name_bytes,
                                     .fault_bytes = (uint32_t)strlen(fault.message) + 1};
    }
    TRY(reply_add(&r->out, r->s->path, &record, sizeof record, error));
    TRY(reply_add(&r->out, r->s->path, name, record.name_bytes, error));
    if (record.fault_bytes > 0) TRY(reply_add(&r->out, r->s->path, fault.message, record.fault_bytes, error));
    r->status = LAM_OK;
    if (H5Aiterate2(id, H5_INDEX_NAME, H5_ITER_INC, &from, attribute_visit, r) < 0) {
        TRY(r->status);
        TRY(store_hdf5_failure(r->s, name, "read the attributes of", error));
    }
    record.n_attributes = (uint32_t)(r->n_attributes - before);
    memcpy(r->out.bytes + start, &record, sizeof record);
    r->n_objects++;
done:
    if (status != LAM_OK) { /* half an object is not sent */
        r->out.size = start;
        r->n_attributes = before;
    }
    return status;
}

/* Sends one link: a hard link to a readable group or array. */
static herr_t link_visit(hid_t root, const char *relative, const H5L_info_t *info, void *context) {
    reply *r = context;
    store *s = r->s;
    lam_status status = LAM_OK;
    char name[STORE_NAME_SIZE];
    hid_t object = -1;
    size_t depth = 1;
    for (const char *c = relative; *c != '\0'; c++) depth += *c == '/';
    if (info->type != H5L_TYPE_HARD || strlen(relative) + 2 > sizeof name || depth > STORE_MAX_DEPTH)
        FAIL(r->error, LAM_ERR_FORMAT, "%s: /%.80s is a link or lies too deep, not a Lambert store", s->path,
             relative);
    snprintf(name, sizeof name, "/%s", relative);
    object = H5Oopen(root, relative, H5P_DEFAULT);
    if (object < 0) TRY(store_hdf5_failure(s, name, "read", r->error));
    const H5I_type_t kind = H5Iget_type(object);
    if (kind != H5I_GROUP && kind != H5I_DATASET)
        FAIL(r->error, LAM_ERR_FORMAT, "%s: %s is neither a group nor an array, not a Lambert store", s->path,
             name);
    TRY(send_object(r, name, object, r->error));
done:
    if (object >= 0) H5Oclose(object);
    r->status = status;
    return status == LAM_OK ? 0 : -1;
}

/* The fixed part of a superblock of version 2 or 3: signature [8], version, size of offsets, size of lengths,
 * flags, then four offsets: base, extension, end of file, root; a checksum [4]. */
static lam_status open_hdf5(store *s, lam_error *error) {
    static const unsigned char signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    lam_status status = LAM_OK;
    unsigned char head[48];
    hid_t access = -1;
    if (s->file.size < sizeof head)
        FAIL(error, LAM_ERR_FORMAT, "%s: %llu bytes, too short for a Lambert store", s->path,
             (unsigned long long)s->file.size);
    if (!store_file_read(&s->file, 0, head, sizeof head))
        TRY(store_hdf5_failure(s, "the file", "read", error));
    /* Version 0, of other HDF5 files, has no checksum: it is refused without asking HDF5. */
    if (memcmp(head, signature, sizeof signature) != 0 || head[8] < 2 || head[8] > 3 || head[9] != 8 ||
        head[10] != 8)
        FAIL(error, LAM_ERR_FORMAT, "%s: not a Lambert store; lambert precompute makes one of a scene",
             s->path);
    access = store_driver_properties(&s->file);
    if (access < 0) TRY(store_hdf5_failure(s, "the file", "open", error));
    s->h5 = H5Fopen(s->path, H5F_ACC_RDONLY, access);
    if (s->h5 < 0) {
        status = store_hdf5_failure(s, "the file's head", "read", error);
        uint64_t end = 0;
        for (int i = 7; i >= 0; i--) end = end << 8 | head[28 + i];
        if (status == LAM_ERR_DAMAGED && end > s->file.size)
            FAIL(error, LAM_ERR_FORMAT, "%s: truncated: %llu bytes of %llu; make or copy it again", s->path,
                 (unsigned long long)s->file.size, (unsigned long long)end);
    }
done:
    if (access >= 0) H5Pclose(access);
    return status;
}

static lam_status read_headers(reply *r, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = r->s;
    hid_t root = -1;
    TRY(open_hdf5(s, error));
    root = H5Oopen(s->h5, "/", H5P_DEFAULT);
    if (root < 0) TRY(store_hdf5_failure(s, "/", "read", error));
    TRY(send_object(r, "/", root, error));
    r->status = LAM_OK;
    if (H5Lvisit(s->h5, H5_INDEX_NAME, H5_ITER_INC, link_visit, r) < 0) {
        TRY(r->status);
        TRY(store_hdf5_failure(s, "a group", "read", error));
    }
done:
    if (root >= 0) H5Oclose(root);
    return status;
}

void store_headers_send(store *s, int to) {
    const store_mute mute = store_mute_begin();
    lam_error error = {.message = ""};
    reply r = {.s = s, .error = &error};
    reply_head head = {.magic = REPLY_MAGIC};
    head.status = (uint64_t)read_headers(&r, &error);
    memcpy(head.message, error.message, sizeof head.message);
    head.n_objects = r.n_objects;
    head.n_attributes = r.n_attributes;
    head.bytes = r.out.size;
    if (confined_send(to, &head, sizeof head)) (void)confined_send(to, r.out.bytes, r.out.size);
    free(r.out.bytes);
    store_mute_end(&mute);
}
