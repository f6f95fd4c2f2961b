#include "solver/base/asset_files.h"

#include <ctype.h>
#include <dirent.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* True where file, with links resolved, lies in folder or below it. */
static bool is_within(const char *file, const char *folder) {
    char real_file[PATH_MAX], real_folder[PATH_MAX];
    if (realpath(file, real_file) == NULL || realpath(folder, real_folder) == NULL) return false;
    const size_t length = strcmp(real_folder, "/") == 0 ? 0 : strlen(real_folder);
    return strncmp(real_file, real_folder, length) == 0 && real_file[length] == '/';
}

/* Joins a folder, "" being the current one, and a name; false where that is too long. */
static bool join(const char *folder, const char *name, char out[ASSET_PATH]) {
    const int written = snprintf(out, ASSET_PATH, "%s%s%s", folder, folder[0] == '\0' ? "" : "/", name);
    return written >= 0 && written < ASSET_PATH;
}

static const char *or_here(const char *folder) {
    return folder[0] == '\0' ? "." : folder;
}

/* The names of a folder that differ from a component of a path by capitals alone; the first two are written
 * to out, "a, b". */
static size_t alike_names(const char *folder, const char *name, size_t length, char out[ASSET_PATH]) {
    size_t n = 0, written = 0;
    DIR *entries = opendir(or_here(folder));
    if (entries == NULL) return 0;
    for (const struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        if (strlen(entry->d_name) != length || strncasecmp(entry->d_name, name, length) != 0) continue;
        if (n++ < 2)
            written += (size_t)snprintf(out + written, ASSET_PATH - written, "%s%s", n == 1 ? "" : ", ",
                                        entry->d_name);
    }
    closedir(entries);
    return n;
}

/* Finds a file of a folder whatever the capitals of its name and of the folders on the way. Each part of the
 * path has its own spelling where that exists. */
static asset_place find_alike(const char *folder, const char *name, char out[ASSET_PATH]) {
    char at[ASSET_PATH], next[ASSET_PATH], alike[ASSET_PATH], real[PATH_MAX];
    snprintf(at, sizeof at, "%s", folder);
    for (const char *part = name; *part != '\0';) {
        const size_t length = strcspn(part, "/");
        snprintf(alike, sizeof alike, "%.*s", (int)length, part);
        if (!join(at, alike, next)) return ASSET_MISSING;
        const size_t n = realpath(next, real) != NULL ? 1 : alike_names(at, part, length, alike);
        if (n > 1) memcpy(out, alike, sizeof alike);
        if (n != 1) return n == 0 ? ASSET_MISSING : ASSET_SEVERAL;
        if (!join(at, alike, next)) return ASSET_MISSING;
        memcpy(at, next, sizeof at);
        part += length;
        while (*part == '/') part++;
    }
    memcpy(out, at, sizeof at);
    return ASSET_FOUND;
}

/* The name as this system would have it: slashes, and no drive. */
static void translate(const char *file, char out[ASSET_PATH]) {
    snprintf(out, ASSET_PATH, "%s", file);
    for (char *c = out; *c != '\0'; c++)
        if (*c == '\\') *c = '/';
    const char *last = strrchr(out, '/');
    if (isalpha((unsigned char)out[0]) && out[1] == ':' && last != NULL)
        memmove(out, last + 1, strlen(last + 1) + 1);
}

/* Finds a name, of which out becomes the path, in a folder as it is spelled. */
static bool find_spelled(const char *folder, const char *name, char out[ASSET_PATH]) {
    char real[PATH_MAX];
    return join(folder, name, out) && realpath(out, real) != NULL;
}

asset_place asset_find(const char *scene, const char *assets, const char *file, char out[ASSET_PATH]) {
    const char *slash = strrchr(scene, '/');
    const size_t length = slash == NULL ? 0 : slash == scene ? 1 : (size_t)(slash - scene);
    char beside[ASSET_PATH], name[ASSET_PATH];
    const char *folders[2] = {beside, assets};
    if (file[0] == '\0' || strlen(file) >= ASSET_PATH || length >= ASSET_PATH) return ASSET_MISSING;
    snprintf(beside, sizeof beside, "%.*s", (int)length, scene);
    bool found = file[0] == '/' && find_spelled("", file, out);
    for (int k = 0; k < 2 && file[0] != '/' && !found; k++)
        found = folders[k] != NULL && find_spelled(folders[k], file, out);
    translate(file, name);
    for (int k = 0; k < 2 && name[0] != '/' && name[0] != '\0' && !found; k++) {
        const asset_place place = folders[k] == NULL ? ASSET_MISSING : find_alike(folders[k], name, out);
        if (place == ASSET_SEVERAL) return place;
        found = place == ASSET_FOUND;
    }
    if (!found) return ASSET_MISSING;
    return is_within(out, or_here(beside)) || (assets != NULL && is_within(out, assets)) ? ASSET_FOUND
                                                                                         : ASSET_OUTSIDE;
}
