#include "solver/codec/json_mark.h"

#include <stdbool.h>
#include <string.h>

size_t json_mark_length(const char *text, size_t length, const char **fault) {
    static const char mark[] = "\xEF\xBB\xBF";
    if (length >= 3 && memcmp(text, mark, 3) == 0) return 3;
    /* One of the first two bytes is 0 in UTF-16 and UTF-32, as JSON begins with a character of ASCII. */
    const bool wide = length >= 2 && (memcmp(text, "\xFF\xFE", 2) == 0 || memcmp(text, "\xFE\xFF", 2) == 0 ||
                                      text[0] == '\0' || text[1] == '\0');
    if (wide)
        *fault =
            "the text is in UTF-16 or UTF-32 (its byte order mark or a 0 byte says so), must be in UTF-8";
    return 0;
}
