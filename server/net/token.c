#include "server/net/token.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

lam_status token_read(const char *path, token *out, lam_error *error) {
    lam_status status = LAM_OK;
    char line[TOKEN_MAX + 2] = "";
    static const char space[] = " \t\r\n";
    FILE *file = fopen(path, "re");
    if (file == NULL) FAIL(error, LAM_ERR_IO, "%s: cannot be opened: %s", path, strerror(errno));
    if (fgets(line, sizeof line, file) == NULL && ferror(file))
        FAIL(error, LAM_ERR_IO, "%s: cannot be read: %s", path, strerror(errno));
    const char *begin = line + strspn(line, space);
    size_t length = strlen(begin);
    while (length > 0 && strchr(space, begin[length - 1]) != NULL) length--;
    if (length == 0 || length > TOKEN_MAX)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: the token has %s%d characters, must have 1 to %d", path,
             length == 0 ? "" : "more than ", length == 0 ? 0 : TOKEN_MAX, TOKEN_MAX);
    out->length = length;
    memcpy(out->bytes, begin, length);
done:
    if (file != NULL) fclose(file);
    return status;
}

bool token_matches(const token *expected, const char *authorization) {
    static const char scheme[] = "Bearer ";
    if (expected->length == 0) return true;
    if (authorization == NULL || strncasecmp(authorization, scheme, sizeof scheme - 1) != 0) return false;
    const char *given = authorization + sizeof scheme - 1;
    while (*given == ' ') given++;
    size_t length = strlen(given);
    /* The number of steps depends on the given length alone. */
    unsigned char difference = length != expected->length;
    for (size_t i = 0; i < length; i++)
        difference |= (unsigned char)given[i] ^ (unsigned char)expected->bytes[i % expected->length];
    return difference == 0;
}
