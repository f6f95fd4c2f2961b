#include "server/scene/log_line.h"

#include <stdarg.h>
#include <stdlib.h>

void log_line(FILE *out, const char *format, ...) {
    char *line = NULL;
    va_list arguments;
    va_start(arguments, format);
    const int length = vasprintf(&line, format, arguments);
    va_end(arguments);
    if (length < 0) return;
    for (unsigned char *c = (unsigned char *)line; *c != '\0'; c++) {
        if (*c < 0x20 || *c == 0x7f) *c = '?';
        /* U+0080 to U+009F are control characters, too. */
        if (*c == 0xc2 && c[1] >= 0x80 && c[1] < 0xa0) c[0] = c[1] = '?';
    }
    fprintf(out, "%s\n", line);
    fflush(out);
    free(line);
}
