/* One field of a CSV file, quoted as RFC 4180 says where it has to be. */
#ifndef LAMBERT_BASE_CSV_TEXT_H
#define LAMBERT_BASE_CSV_TEXT_H

#include <stdio.h>
#include <string.h>

/* A failed write is seen by ferror(stream). */
static inline void csv_text(const char *text, FILE *stream) {
    if (strpbrk(text, ",\"\r\n") == NULL) {
        fputs(text, stream);
        return;
    }
    fputc('"', stream);
    for (const char *c = text; *c != '\0'; c++) {
        if (*c == '"') fputc('"', stream);
        fputc(*c, stream);
    }
    fputc('"', stream);
}

#endif
