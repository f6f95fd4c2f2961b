#include "solver/codec/problem.h"

#include "solver/codec/json_writer.h"

#include <stdarg.h>
#include <stdio.h>

#define MANUAL "deploy/docs/api.md#"

static const struct {
    unsigned status;
    const char *type, *title;
} kinds[PROBLEM_COUNT] = {
    [PROBLEM_NONE] = {0, "about:blank", "Error"},
    [PROBLEM_MALFORMED_HEAD] = {400, MANUAL "malformed-head", "The head of the request is malformed"},
    [PROBLEM_NOT_JSON] = {400, MANUAL "not-json", "The body is not JSON"},
    [PROBLEM_NOT_NPY] = {400, MANUAL "not-npy", "The body is not an NPY array"},
    [PROBLEM_NO_TOKEN] = {401, MANUAL "no-token", "A bearer token is missing or wrong"},
    [PROBLEM_NO_RIGHT] = {403, MANUAL "no-right", "The token has not this right"},
    [PROBLEM_NOT_ALLOWED] = {403, MANUAL "not-allowed", "The daemon was started without this ability"},
    [PROBLEM_WRONG_HOST] = {403, MANUAL "wrong-host", "The daemon does not answer to this host"},
    [PROBLEM_WRONG_ORIGIN] = {403, MANUAL "wrong-origin", "Pages of this origin may not ask"},
    [PROBLEM_NOT_FOUND] = {404, MANUAL "not-found", "There is no such route, scene or variant"},
    [PROBLEM_WRONG_METHOD] = {405, MANUAL "wrong-method", "The route has other methods"},
    [PROBLEM_CONFLICT] = {409, MANUAL "conflict", "The scene cannot have this variant"},
    [PROBLEM_TOO_LONG] = {413, MANUAL "too-long", "The body is too long"},
    [PROBLEM_MEDIA_TYPE] = {415, MANUAL "media-type", "The body is of another media type"},
    [PROBLEM_WRONG_KIND] = {422, MANUAL "wrong-kind", "A value is of the wrong kind"},
    [PROBLEM_WRONG_MEMBERS] = {422, MANUAL "wrong-members",
                               "Members are missing, unknown or exclude each other"},
    [PROBLEM_WRONG_LENGTH] = {422, MANUAL "wrong-length", "A list or an array has the wrong length or shape"},
    [PROBLEM_BAD_INDEX] = {422, MANUAL "bad-index", "An element index is out of range"},
    [PROBLEM_BAD_VALUE] = {422, MANUAL "bad-value", "A number is out of range"},
    [PROBLEM_UNKNOWN_GROUP] = {422, MANUAL "unknown-group", "The scene has no group of this name"},
    [PROBLEM_UNKNOWN_WORD] = {422, MANUAL "unknown-word", "A word is not among those that can stand here"},
    [PROBLEM_GIVEN_TWICE] = {422, MANUAL "given-twice", "An element, a group or a member is given twice"},
    [PROBLEM_TOO_MUCH] = {422, MANUAL "too-much", "The request asks for more than one request may"},
    [PROBLEM_NOT_IN_STORE] = {422, MANUAL "not-in-store", "The store does not hold what the request needs"},
    [PROBLEM_NOT_IN_ENCODING] = {422, MANUAL "not-in-encoding", "The encoding cannot hold the answer"},
    [PROBLEM_NOT_REFINED] = {422, MANUAL "not-refined", "The answer cannot be refined to this tolerance"},
    [PROBLEM_TOO_MANY_VARIANTS] = {429, MANUAL "too-many-variants", "There are too many variants"},
    [PROBLEM_INTERNAL] = {500, MANUAL "internal", "The daemon failed"},
    [PROBLEM_TRANSFER_CODING] = {501, MANUAL "transfer-coding", "The transfer coding is not known"},
    [PROBLEM_NO_MEMORY] = {503, MANUAL "no-memory", "Memory is short; try again later"},
    [PROBLEM_UNAVAILABLE] = {503, MANUAL "unavailable", "The daemon or the scene is busy; try again later"},
};

unsigned problem_status(problem_kind kind) {
    return kinds[kind].status;
}

const char *problem_title(problem_kind kind) {
    return kinds[kind].title;
}

const char *problem_type(problem_kind kind) {
    return kinds[kind].type;
}

bool problem_set(problem *p, problem_kind kind, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(p->detail, sizeof p->detail, format, arguments);
    va_end(arguments);
    p->kind = kind;
    p->status = kinds[kind].status;
    p->pointer[0] = '\0';
    return false;
}

bool problem_write(const problem *p, buffer *b) {
    bool written = buffer_append_text(b, "{\"type\":") && json_write_text(b, problem_type(p->kind)) &&
                   buffer_append_text(b, ",\"title\":") && json_write_text(b, problem_title(p->kind)) &&
                   buffer_printf(b, ",\"status\":%u,\"detail\":", p->status) && json_write_text(b, p->detail);
    if (p->pointer[0] != '\0')
        written = written && buffer_append_text(b, ",\"pointer\":") && json_write_text(b, p->pointer);
    return written && buffer_append_text(b, "}\n");
}
