#include "server/scene/refusals.h"

#include "solver/base/array_grow.h"
#include "solver/codec/json_writer.h"

#include <stdlib.h>
#include <string.h>

refusals *refusals_create(void) {
    refusals *made = memory_allocate(1, sizeof *made, "refusals", NULL);
    if (made != NULL) atomic_init(&made->references, 1);
    return made;
}

/* Takes every `part`, of `length` letters, out of a text. */
static void take_out(char *text, const char *part, size_t length) {
    if (length == 0) return;
    for (char *at = text; (at = memmem(at, strlen(at), part, length)) != NULL;)
        memmove(at, at + length, strlen(at + length) + 1);
}

/* A copy of the message without the path, where it begins with that, and without the folder elsewhere. */
static char *reason_of(const char *path, const char *message) {
    const size_t length = strlen(path);
    const char *slash = strrchr(path, '/');
    const bool named = strncmp(message, path, length) == 0 && strncmp(message + length, ": ", 2) == 0;
    char *reason = strdup(named ? message + length + 2 : message);
    if (reason != NULL && slash != NULL) take_out(reason, path, (size_t)(slash + 1 - path));
    return reason;
}

void refusals_add(refusals *list, const char *path, const char *name, const char *message, bool kept) {
    const refused_store made = {.name = strdup(name), .reason = reason_of(path, message), .kept = kept};
    if (made.name == NULL || made.reason == NULL ||
        array_grow(&list->items, &list->capacity, list->count + 1, sizeof *list->items, "refusals", NULL) !=
            LAM_OK) {
        free(made.name);
        free(made.reason);
        return;
    }
    list->items[list->count++] = made;
}

bool refusals_write(const refusals *list, buffer *b) {
    bool written = true;
    for (size_t i = 0; i < list->count && written; i++) {
        const refused_store *one = &list->items[i];
        written = buffer_append_text(b, i == 0 ? ",\"refused\":[{\"name\":" : ",{\"name\":") &&
                  json_write_text(b, one->name) && buffer_append_text(b, ",\"reason\":") &&
                  json_write_text(b, one->reason) &&
                  buffer_printf(b, ",\"kept\":%s}", one->kept ? "true" : "false");
    }
    return written && (list->count == 0 || buffer_append(b, "]", 1));
}

refusals *refusals_hold(refusals *list) {
    atomic_fetch_add(&list->references, 1);
    return list;
}

void refusals_release(refusals *list) {
    if (list == NULL || atomic_fetch_sub(&list->references, 1) != 1) return;
    for (size_t i = 0; i < list->count; i++) {
        free(list->items[i].name);
        free(list->items[i].reason);
    }
    free(list->items);
    free(list);
}
