#include "solver/codec/problem.h"

#include "solver/codec/json_writer.h"

#include <stdarg.h>
#include <stdio.h>

bool problem_set(problem *p, unsigned status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(p->detail, sizeof p->detail, format, arguments);
    va_end(arguments);
    p->status = status;
    p->pointer[0] = '\0';
    return false;
}

const char *problem_title(unsigned status) {
    static const struct {
        unsigned status;
        const char *title;
    } titles[] = {
        {400, "Bad Request"},
        {401, "Unauthorized"},
        {403, "Forbidden"},
        {404, "Not Found"},
        {405, "Method Not Allowed"},
        {409, "Conflict"},
        {411, "Length Required"},
        {413, "Content Too Large"},
        {415, "Unsupported Media Type"},
        {422, "Unprocessable Content"},
        {429, "Too Many Requests"},
        {500, "Internal Server Error"},
        {501, "Not Implemented"},
        {503, "Service Unavailable"},
    };
    for (size_t i = 0; i < sizeof titles / sizeof titles[0]; i++)
        if (titles[i].status == status) return titles[i].title;
    return "Error";
}

bool problem_write(const problem *p, buffer *b) {
    bool written = buffer_append_text(b, "{\"type\":\"about:blank\",\"title\":") &&
                   json_write_text(b, problem_title(p->status)) &&
                   buffer_printf(b, ",\"status\":%u,\"detail\":", p->status) && json_write_text(b, p->detail);
    if (p->pointer[0] != '\0')
        written = written && buffer_append_text(b, ",\"pointer\":") && json_write_text(b, p->pointer);
    return written && buffer_append_text(b, "}\n");
}
