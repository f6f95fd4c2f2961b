#include "server/http/request_log.h"

#include "solver/codec/json_writer.h"

#include <string.h>
#include <time.h>

static bool is_change(const request *r) {
    return strcmp(r->method, "PUT") == 0 || strcmp(r->method, "DELETE") == 0;
}

/* Appends by whose word something was to be changed, and which scene. */
static bool write_holder(const request *r, buffer *b) {
    bool written = true;
    if (r->holder.name[0] != '\0')
        written = buffer_append_text(b, ",\"token\":") && json_write_text(b, r->holder.name);
    if (is_change(r) && r->match.has_name)
        written = written && buffer_append_text(b, ",\"scene\":") && json_write_text(b, r->match.name);
    if (r->call.changed != NULL)
        written = written && buffer_append_text(b, ",\"variant\":") && json_write_text(b, r->call.changed);
    return written;
}

static bool write_time(buffer *b) {
    struct timespec now;
    struct tm utc;
    char stamp[32];
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &utc);
    return buffer_printf(b, "{\"time\":\"%s.%03ldZ\"", stamp, now.tv_nsec / 1000000);
}

void request_log(const request *r, unsigned status, double ms) {
    access_log *log = is_change(r) ? r->service->audit_log : r->service->access_log;
    if (log == NULL) return;
    buffer b = {0};
    bool written =
        write_time(&b) && buffer_append_text(&b, ",\"id\":") && json_write_text(&b, r->id) &&
        buffer_append_text(&b, ",\"client\":") && json_write_text(&b, r->peer.text) &&
        buffer_append_text(&b, ",\"method\":") && json_write_text(&b, r->method) &&
        buffer_append_text(&b, ",\"path\":") && json_write_text(&b, r->path) && write_holder(r, &b) &&
        buffer_printf(&b,
                      ",\"status\":%u,\"received\":%zu,\"sent\":%zu,\"coding\":\"%s\",\"vectors\":%zu,"
                      "\"ms\":%.3f}\n",
                      status, (size_t)r->received, r->sent, coding_name(r->coding), r->call.n_rhs, ms);
    if (written) access_log_add(log, b.bytes, b.length);
    buffer_free(&b);
}

void request_log_unread(access_log *log, const char *who, unsigned status, const char *reason,
                        size_t received) {
    if (log == NULL) return;
    buffer b = {0};
    const bool written = write_time(&b) && buffer_append_text(&b, ",\"client\":") &&
                         json_write_text(&b, who) &&
                         buffer_printf(&b, ",\"status\":%u,\"received\":%zu,\"reason\":", status, received) &&
                         json_write_text(&b, reason) && buffer_append_text(&b, "}\n");
    if (written) access_log_add(log, b.bytes, b.length);
    buffer_free(&b);
}
