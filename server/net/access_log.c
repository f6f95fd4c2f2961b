#include "server/net/access_log.h"

#include "solver/codec/json_writer.h"

#include <time.h>

void access_log_write(FILE *log, const access_entry *entry) {
    buffer b = {0};
    struct timespec now;
    struct tm utc;
    char stamp[32];
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &utc);
    bool written =
        buffer_printf(&b, "{\"time\":\"%s.%03ldZ\",\"id\":", stamp, now.tv_nsec / 1000000) &&
        json_write_text(&b, entry->id) && buffer_append_text(&b, ",\"method\":") &&
        json_write_text(&b, entry->method) && buffer_append_text(&b, ",\"path\":") &&
        json_write_text(&b, entry->path) &&
        buffer_printf(&b,
                      ",\"status\":%u,\"received\":%zu,\"sent\":%zu,\"coding\":\"%s\",\"vectors\":%zu,"
                      "\"ms\":%.3f}\n",
                      entry->status, entry->received, entry->sent, entry->coding, entry->n_rhs, entry->ms);
    if (written) {
        fwrite(b.bytes, 1, b.length, log);
        fflush(log);
    }
    buffer_free(&b);
}
