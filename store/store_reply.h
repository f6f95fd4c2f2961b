/* The bytes that a reader of headers (store_headers.c, in a child; plain_headers.c) gives to the store
 * (store_index.c): a head, then for each object a record, its name, the words of a fault, and its attributes,
 * each a record, its name and its text. Names and texts end with a NUL. The root comes first. Both ends are
 * one program, so that numbers have its layout. */
#ifndef LAMBERT_STORE_STORE_REPLY_H
#define LAMBERT_STORE_STORE_REPLY_H

#include "store/store.h"

#define REPLY_MAGIC "lamhead"

/* Names and attributes of real stores take some ten thousand bytes. */
#define REPLY_MOST_BYTES ((uint64_t)16 << 20)

typedef enum object_kind {
    OBJECT_GROUP,
    OBJECT_ARRAY,
    OBJECT_FAULTY /* an array that cannot be read: status and words are those of every attempt */
} object_kind;

typedef enum attribute_kind {
    ATTRIBUTE_TEXT,
    ATTRIBUTE_NUMBER,
    ATTRIBUTE_INTEGER,
    ATTRIBUTE_OTHER
} attribute_kind;

typedef struct reply_head {
    char magic[8];
    uint64_t status; /* if it is not LAM_OK the objects found until then follow */
    char message[sizeof((lam_error *)0)->message];
    uint64_t n_objects, n_attributes, bytes; /* bytes: of all that follows */
} reply_head;

/* The bytes behind the head as they grow; freed by the caller. */
typedef struct reply_buffer {
    char *bytes;
    size_t size, capacity;
} reply_buffer;

/* Appends bytes. Errors: LAM_ERR_FORMAT where they would be more than REPLY_MOST_BYTES, LAM_ERR_MEMORY. */
lam_status reply_add(reply_buffer *b, const char *path, const void *data, size_t size, lam_error *error);

typedef struct object_record {
    uint32_t kind, status, name_bytes, fault_bytes, n_attributes;
    uint32_t type, is_text, rank;
    uint64_t value_size, dims[STORE_MAX_RANK], offset;
} object_record;

typedef struct attribute_record {
    uint32_t kind, name_bytes, text_bytes, reserved;
    uint64_t value; /* the bits of a number or an integer */
} attribute_record;

#endif
