#include "solver/codec/json_memory.h"

#include <jansson.h>
#include <stdlib.h>

/* jansson's functions of allocation take no argument of ours. */
static _Thread_local bool failed;

static void *allocate(size_t size) {
    void *memory = malloc(size);
    failed = failed || memory == NULL;
    return memory;
}

void json_memory_install(void) {
    json_set_alloc_funcs(allocate, free);
}

void json_memory_watch(void) {
    failed = false;
}

bool json_memory_failed(void) {
    return failed;
}
