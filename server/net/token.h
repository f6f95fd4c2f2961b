/* The bearer token that clients must show. */
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

/* Whether an Authorization header (or NULL) shows the token; in a time that does not depend on how much of it
 * is right. True when there is none. */
bool token_matches(const token *expected, const char *authorization);

#endif
