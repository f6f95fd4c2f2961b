#include "server/http/request_id.h"

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
