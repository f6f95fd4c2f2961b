/* Content codings of answers (Accept-Encoding; RFC 9110): the only user of <zlib.h> and <zstd.h>. No I/O. */
#ifndef LAMBERT_SERVER_HTTP_CONTENT_CODING_H
#define LAMBERT_SERVER_HTTP_CONTENT_CODING_H

#include "solver/codec/buffer.h"

typedef enum content_coding { CODING_IDENTITY, CODING_GZIP, CODING_ZSTD } content_coding;

typedef struct coding_choice {
    content_coding coding; /* the one liked best; zstd of two that are liked alike */
    bool forced;           /* the client does not take the body as it is */
} coding_choice;

/* Shorter bodies do not pay: they fit one packet as they are. */
#define COMPRESS_LEAST ((size_t)1 << 10)

/* What an Accept-Encoding header (or NULL) asks for. Identity where it asks for what we do not have. */
coding_choice coding_choose(const char *header);

/* The name of a coding in Content-Encoding. */
const char *coding_name(content_coding coding);

/* Puts the coded bytes in place of those of b when that leaves at most four fifths of them, or is forced;
 * returns the coding that b then has. Identity also when memory is short or b is longer than 64 MiB. Of long
 * bodies samples are coded first, so that those that do not shrink (raw numbers) cost little. O(length) at
 * about 100 (gzip) or 300 (zstd) MB/s. */
content_coding coding_apply(buffer *b, coding_choice choice);

#endif
