/* Columns of elements in the encodings of answers: JSON, NPY, and NPZ, a ZIP of NPY files that are not
 * compressed, as numpy.savez writes it (APPNOTE.TXT of PKWARE, 6.3). */
#ifndef LAMBERT_SERVER_ROUTE_ELEMENT_TABLE_H
#define LAMBERT_SERVER_ROUTE_ELEMENT_TABLE_H

#include "server/scene/scene.h"
#include "solver/codec/media.h"

typedef struct element_table {
    const scene *of;
    unsigned fields;         /* a set of them, not empty; of NPY one */
    media_type encoding;     /* MEDIA_JSON, MEDIA_NPY or MEDIA_ZIP */
    element_columns columns; /* of these fields */
} element_table;

/* The word of a field in queries, members and names of files. */
const char *element_field_name(element_field field);

/* Bytes of the answer, at most; no column is needed. O(groups). */
size_t element_table_bytes_most(const element_table *t);

/* Bytes that a ZIP can have. */
#define ZIP_BYTES_MOST ((size_t)UINT32_MAX)

/* Writes the answer to out, which is empty. O(n). False when memory is short. */
bool element_table_write(const element_table *t, buffer *out);

#endif
