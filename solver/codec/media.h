/* Media types of requests and answers (Content-Type, Accept; RFC 9110). No I/O. */
#ifndef LAMBERT_CODEC_MEDIA_H
#define LAMBERT_CODEC_MEDIA_H

#include "solver/codec/npy.h"

#include <stdbool.h>

typedef enum media_type { MEDIA_JSON, MEDIA_NPY, MEDIA_ZIP, MEDIA_OTHER } media_type;

/* The type that a Content-Type header names; JSON without a header (NULL). */
media_type media_content_type(const char *header);

typedef struct media_accept {
    media_type type; /* MEDIA_JSON or MEDIA_NPY; MEDIA_ZIP of media_choose_table */
    npy_type npy;
    bool npy_given; /* with a dtype; else npy is <f4 */
} media_accept;

/* The encoding of the answer to an Accept header: NPY when it is named with a quality not below that of JSON,
 * else JSON. */
media_accept media_choose(const char *header);

/* The same of an answer that can also be application/zip: the one of highest quality, of equal ones that
 * which is named first. */
media_accept media_choose_table(const char *header);

#endif
