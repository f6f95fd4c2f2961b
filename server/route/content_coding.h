/* Content codings of answers (Accept-Encoding; RFC 9110): the only user of <zlib.h> and <zstd.h>. No I/O. */
#ifndef LAMBERT_SERVER_ROUTE_CONTENT_CODING_H
#define LAMBERT_SERVER_ROUTE_CONTENT_CODING_H

#include "solver/codec/buffer.h"

#include <stdint.h>

typedef enum content_coding { CODING_IDENTITY, CODING_GZIP, CODING_ZSTD } content_coding;

typedef struct coding_choice {
    content_coding coding; /* the one of highest weight; zstd of equal ones */
    bool forced;           /* the client does not accept identity */
} coding_choice;

/* Shorter bodies are not compressed: they fit one packet. */
#define COMPRESS_LEAST ((size_t)1 << 10)

/* The coding that an Accept-Encoding header (or NULL) asks for; identity if it asks for others than these. */
coding_choice coding_choose(const char *header);

/* True if the header accepts a coding, and does not prefer identity to it. */
bool coding_accepts(const char *header, content_coding coding);

/* The name of a coding in Content-Encoding. */
const char *coding_name(content_coding coding);

/* Compresses b if that leaves at most four fifths of its length, or is forced; returns its coding. Identity
 * also if memory is short or b is longer than 64 MiB. Samples of long bodies are compressed first, so that
 * those that do not shrink (raw numbers) cost little. O(length) at about 100 (gzip) or 300 (zstd) MB/s. */
content_coding coding_apply(buffer *b, coding_choice choice);

/* Codes bytes of any length, not by identity, into to, which is empty; false if memory is short. */
bool coding_whole(content_coding coding, const char *bytes, size_t length, buffer *to);

/* Bytes of to, at most. */
size_t coding_bytes_most(size_t length);

/* The CRC-32 of bytes, as archives (ZIP) have it. */
uint32_t coding_crc32(const char *bytes, size_t length);

/* True if bytes, a sample of a longer body, shrink as much as the whole has to. O(length). */
bool coding_pays(content_coding coding, const char *bytes, size_t length);

/* A coding of bytes that come in parts. */
typedef struct coder coder;

/* Memory that a coder takes, at most. */
#define CODER_BYTES ((size_t)2 << 20)

/* NULL if memory is short. */
coder *coder_create(content_coding coding);
void coder_free(coder *c);

/* Codes bytes (*count of them, those that were taken are subtracted and *bytes moved on); behind the last of
 * them, `last`, it ends the coded bytes. *written: bytes written to `to`, at most room. *ended: nothing more
 * comes. False if the coder failed. */
bool coder_run(coder *c, const char **bytes, size_t *count, bool last, char *to, size_t room, size_t *written,
               bool *ended);

#endif
