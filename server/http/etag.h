/* Strong entity tags (RFC 9110, 8.8.3): equal tags, equal bytes. */
#ifndef LAMBERT_SERVER_HTTP_ETAG_H
#define LAMBERT_SERVER_HTTP_ETAG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define ETAG_MAX 40

/* What tells bodies apart. O(length). */
uint64_t etag_hash(const void *bytes, size_t length);

/* The tag of a body in a coding (its name, "identity" for none), quotes included. */
void etag_make(uint64_t hash, const char *coding, char tag[ETAG_MAX]);

/* Whether an If-None-Match header (or NULL) lists the tag, or is a star; W/ before a tag does not matter. */
bool etag_is_listed(const char *header, const char *tag);

#endif
