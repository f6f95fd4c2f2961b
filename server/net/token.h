/* Bearer tokens that clients must send, each with rights. Any thread. */
#ifndef LAMBERT_SERVER_NET_TOKEN_H
#define LAMBERT_SERVER_NET_TOKEN_H

#include "store/status.h"

#include <stdio.h>

/* Rights: to read scenes and solve, to make and delete variants, to read /metrics. */
typedef enum token_right { TOKEN_READ = 1, TOKEN_VARY = 2, TOKEN_METRICS = 4 } token_right;
#define TOKEN_ALL (TOKEN_READ | TOKEN_VARY | TOKEN_METRICS)

#define TOKEN_NAME_MAX 32

typedef struct tokens tokens;

/* A token that was given: its rights, and its name in logs: name=TEXT of its line, or its number among the
 * tokens of the file. */
typedef struct token_holder {
    unsigned rights;
    char name[TOKEN_NAME_MAX];
} token_holder;

/* Reads a file of tokens, which lines hold:
 *     TOKEN [read] [vary] [metrics] [name=TEXT]
 * A token without a right has all; # begins a line that is passed over. A file that other users can read is
 * named on `problems`. Errors: LAM_ERR_IO; LAM_ERR_ARGUMENT with the number of the line, but never a part of
 * it. path outlives the tokens. */
lam_status tokens_open(const char *path, FILE *problems, tokens **out, lam_error *error);
void tokens_close(tokens *t);

/* Reads the file again. On an error the tokens stay as they were. t may be NULL. */
lam_status tokens_reload(tokens *t, FILE *problems, lam_error *error);

/* True if an Authorization header (or NULL) carries a token. The time depends on the length of the header and
 * the number of tokens alone; what is longer than any token may be (512 characters) is compared with none. */
bool tokens_find(tokens *t, const char *authorization, token_holder *out);

/* True if a line of the file names the right to read /metrics: nobody else may. */
bool tokens_guard_metrics(tokens *t);

#endif
