/* Files that a scene names: they are read from the scene's own folder, from folders in it, and from --assets.
 */
#include "solver/scene/import/imported_faces.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* True where file, with links resolved, lies in folder or below it. */
static bool is_within(const char *file, const char *folder) {
    char real_file[PATH_MAX], real_folder[PATH_MAX];
    if (realpath(file, real_file) == NULL || realpath(folder, real_folder) == NULL) return false;
    const size_t length = strcmp(real_folder, "/") == 0 ? 0 : strlen(real_folder);
    return strncmp(real_file, real_folder, length) == 0 && real_file[length] == '/';
}

/* Joins a folder, which ends in '/' or is empty, and a name; false where that is too long. */
static bool join(const char *folder, size_t length, const char *gap, const char *name, char out[ASSET_PATH]) {
    const int written = snprintf(out, ASSET_PATH, "%.*s%s%s", (int)length, folder, gap, name);
    return written >= 0 && written < ASSET_PATH;
}

asset_place asset_find(const char *scene, const char *assets, const char *file, char out[ASSET_PATH]) {
    const char *slash = strrchr(scene, '/');
    const size_t length = slash == NULL ? 0 : (size_t)(slash - scene) + 1;
    char folder[ASSET_PATH], real[PATH_MAX];
    if (file[0] == '\0' || !join(scene, length, "", length == 0 ? "." : "", folder)) return ASSET_MISSING;
    if (!join(scene, file[0] == '/' ? 0 : length, "", file, out)) return ASSET_MISSING;
    if (realpath(out, real) == NULL) {
        const bool joined = assets != NULL && file[0] != '/' && join(assets, strlen(assets), "/", file, out);
        if (!joined || realpath(out, real) == NULL) return ASSET_MISSING;
    }
    return is_within(out, folder) || (assets != NULL && is_within(out, assets)) ? ASSET_FOUND : ASSET_OUTSIDE;
}
