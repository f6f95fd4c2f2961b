#include "server/http/http_fields.h"

#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

uint64_t request_id_seed(void) {
    uint64_t seed;
    struct timespec now;
    if (getrandom(&seed, sizeof seed, 0) == sizeof seed) return seed;
    clock_gettime(CLOCK_REALTIME, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

void request_id_choose(const char *own, uint64_t seed, uint64_t count, char id[REQUEST_ID_MAX + 1]) {
    static const char allowed[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.:+/=";
    const size_t length = own == NULL ? 0 : strspn(own, allowed);
    if (length > 0 && length <= REQUEST_ID_MAX && own[length] == '\0')
        memcpy(id, own, length + 1);
    else
        snprintf(id, REQUEST_ID_MAX + 1, "%012llx-%llu", (unsigned long long)(seed >> 16),
                 (unsigned long long)count);
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
        /* A tag ends at its closing quote and may contain commas. */
        const char *end = *header == '"' ? strchr(header + 1, '"') : NULL;
        if (end == NULL) return false;
        const size_t length = (size_t)(end + 1 - header);
        if (length == wanted && memcmp(header, tag, length) == 0) return true;
        header += length;
    }
    return false;
}
