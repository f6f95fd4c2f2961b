#include "server/scene/sources.h"

#include "solver/base/array_grow.h"
#include "solver/base/file_stem.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void sources_free(source_list *list) {
    for (size_t i = 0; i < list->count; i++) {
        free(list->items[i].path);
        free(list->items[i].name);
    }
    free(list->items);
}

static lam_status add_source(source_list *list, const char *folder, const char *argument, bool may_name,
                             lam_error *error) {
    lam_status status = LAM_OK;
    char *path = NULL;
    TRY(array_grow(&list->items, &list->capacity, list->count + 1, sizeof *list->items, argument, error));
    if (asprintf(&path, "%s%s%s", folder == NULL ? "" : folder, folder == NULL ? "" : "/", argument) < 0) {
        path = NULL;
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", argument);
    }
    source *added = &list->items[list->count++];
    *added = (source){path, NULL};
    const char *given = NULL;
    /* A file whose own name has a colon is taken as it is. */
    char *colon = may_name ? strrchr(path, ':') : NULL;
    if (colon != NULL && colon[1] != '\0' && access(path, F_OK) != 0) {
        *colon = '\0';
        given = colon + 1;
        /* A slash belongs to a name, which is refused later, where what stands before is a file. */
        if (strchr(given, '/') != NULL && access(path, F_OK) != 0) {
            *colon = ':';
            given = NULL;
        }
    }
    added->name = given != NULL ? strdup(given) : file_stem(path);
    if (added->name == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", argument);
done:
    return status;
}

static int compare_names(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* Every *.h5 of a folder, by name. */
static lam_status add_folder(source_list *list, const char *folder, lam_error *error) {
    lam_status status = LAM_OK;
    struct dirent **entries = NULL;
    char **names = NULL;
    size_t count = 0;
    int found = scandir(folder, &entries, NULL, NULL);
    if (found < 0) FAIL(error, LAM_ERR_IO, "%s: cannot be read: %s", folder, strerror(errno));
    names = memory_allocate((size_t)found, sizeof *names, folder, error);
    if (names == NULL) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    for (int i = 0; i < found; i++) {
        char *name = entries[i]->d_name;
        size_t length = strlen(name);
        if (name[0] != '.' && length > 3 && strcmp(name + length - 3, ".h5") == 0) names[count++] = name;
    }
    qsort(names, count, sizeof *names, compare_names);
    for (size_t i = 0; i < count; i++) TRY(add_source(list, folder, names[i], false, error));
done:
    for (int i = 0; i < found; i++) free(entries[i]);
    free(entries);
    free(names);
    return status;
}

lam_status sources_find(const config *c, source_list *sources, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t i = 0; i < c->n_stores; i++) TRY(add_source(sources, NULL, c->stores[i], true, error));
    if (c->stores_dir != NULL) TRY(add_folder(sources, c->stores_dir, error));
done:
    return status;
}
