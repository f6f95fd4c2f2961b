#include "solver/base/file_stem.h"

#include <stddef.h>
#include <string.h>

char *file_stem(const char *path) {
    const char *slash = strrchr(path, '/'), *name = slash == NULL ? path : slash + 1,
               *dot = strrchr(name, '.');
    return dot == NULL || dot == name ? strdup(name) : strndup(name, (size_t)(dot - name));
}
