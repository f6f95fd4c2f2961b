#include "server/http/etag.h"

#include "store/store.h"

#include <stdio.h>
#include <string.h>

uint64_t etag_hash(const void *bytes, size_t length) {
    return store_checksum(bytes, length);
}

void etag_make(uint64_t hash, const char *coding, char tag[ETAG_MAX]) {
    const bool plain = strcmp(coding, "identity") == 0;
    snprintf(tag, ETAG_MAX, "\"%016llx%s%s\"", (unsigned long long)hash, plain ? "" : "-",
             plain ? "" : coding);
}

bool etag_is_listed(const char *header, const char *tag) {
    static const char between[] = " \t,";
    const size_t wanted = strlen(tag);
    if (header == NULL) return false;
    for (header += strspn(header, between); *header != '\0'; header += strspn(header, between)) {
        if (*header == '*') return true;
        if (strncmp(header, "W/", 2) == 0) header += 2;
        /* Up to the closing quote: a comma may stand between two. */
        const char *end = *header == '"' ? strchr(header + 1, '"') : NULL;
        if (end == NULL) return false;
        const size_t length = (size_t)(end + 1 - header);
        if (length == wanted && memcmp(header, tag, length) == 0) return true;
        header += length;
    }
    return false;
}
