/* Media types of requests and answers (Content-Type, Accept; RFC 9110). No I/O. */
#ifndef LAMBERT_CODEC_MEDIA_H
#define LAMBERT_CODEC_MEDIA_H

#include "solver/codec/npy.h"

#include <stdbool.h>

typedef enum media_type { MEDIA_JSON, MEDIA_NPY, MEDIA_OTHER } media_type;

/* What a Content-Type header says; NULL (no header) is JSON. */
media_type media_content_type(const char *header);

typedef struct media_accept {
    media_type type; /* MEDIA_JSON or MEDIA_NPY */
    npy_type npy;
    bool npy_given; /* with a dtype; else npy is <f4 */
} media_accept;

/* What to answer to an Accept header: NPY when it is named and not liked less than JSON, else JSON. */
media_accept media_choose(const char *header);

#endif
