/* Values of header fields: request ids (X-Request-Id) and strong entity tags (RFC 9110, 8.8.3). */
#ifndef LAMBERT_SERVER_HTTP_HTTP_FIELDS_H
#define LAMBERT_SERVER_HTTP_HTTP_FIELDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define REQUEST_ID_MAX 64

/* A random seed, so that the ids of different runs differ. */
uint64_t request_id_seed(void);

/* The client's own id if it has 1 to REQUEST_ID_MAX letters, digits and any of -_.:+/=; otherwise, and for
 * NULL, an id made of the seed and the count. */
void request_id_choose(const char *own, uint64_t seed, uint64_t count, char id[REQUEST_ID_MAX + 1]);

#define ETAG_MAX 40

/* The tag of a body of this hash (store_checksum) in a coding (its name, "identity" for none), quotes
 * included. */
void etag_make(uint64_t hash, const char *coding, char tag[ETAG_MAX]);

/* True if an If-None-Match header (or NULL) lists the tag, with or without W/, or is a star. */
bool etag_is_listed(const char *header, const char *tag);

#endif
