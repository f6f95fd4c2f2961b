/* The bearer token that clients must send. */
#ifndef LAMBERT_SERVER_NET_TOKEN_H
#define LAMBERT_SERVER_NET_TOKEN_H

#include "store/status.h"

#define TOKEN_MAX 512

typedef struct token {
    size_t length; /* 0: none */
    char bytes[TOKEN_MAX];
} token;

/* The first line of a file, without white space at its ends. Errors: LAM_ERR_IO, LAM_ERR_ARGUMENT (empty, too
 * long). */
lam_status token_read(const char *path, token *out, lam_error *error);

/* True if an Authorization header (or NULL) carries the token, or none is expected. The time does not depend
 * on how many characters are right. */
bool token_matches(const token *expected, const char *authorization);

#endif
