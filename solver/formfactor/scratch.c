#include "solver/formfactor/scratch.h"

#include <assert.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

/* Three samples of three files each, and some more. */
enum { MAX_FILES = 16, MAX_NAME = 64 };

struct scratch {
    char *folder;
    large_place place; /* the folder and its descriptor, through which it is locked */
    bool made;
    char files[MAX_FILES][MAX_NAME]; /* their names */
    size_t n_files;
};

lam_status scratch_open(const char *folder, scratch **out, lam_error *error) {
    lam_status status = LAM_OK;
    scratch *s = memory_allocate(1, sizeof *s, "scratch", error);
    if (s == NULL) return LAM_ERR_MEMORY;
    s->place.folder = -1;
    s->folder = strdup(folder);
    if (s->folder == NULL) FAIL(error, LAM_ERR_MEMORY, "scratch: out of memory");
    s->place.name = s->folder;
    s->made = mkdir(folder, 0777) == 0;
    if (!s->made && errno != EEXIST)
        FAIL(error, LAM_ERR_IO, "--scratch %s: cannot be made: %s", folder, strerror(errno));
    s->place.folder = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (s->place.folder < 0) FAIL(error, LAM_ERR_IO, "--scratch %s: %s", folder, strerror(errno));
    if (flock(s->place.folder, LOCK_EX | LOCK_NB) != 0) {
        if (errno == EWOULDBLOCK)
            FAIL(error, LAM_ERR_IO,
                 "--scratch %s: another run works there; wait for it or use another folder", folder);
        FAIL(error, LAM_ERR_IO, "--scratch %s: cannot be locked: %s; use a folder on a local disk", folder,
             strerror(errno));
    }
    if (faccessat(s->place.folder, ".", W_OK | X_OK, 0) != 0)
        FAIL(error, LAM_ERR_IO, "--scratch %s: %s", folder, strerror(errno));
    *out = s;
    s = NULL;
done:
    scratch_close(s, false);
    return status;
}

lam_status scratch_file(scratch *s, const char *name, int *fd, char **path, lam_error *error) {
    char *text = NULL;
    size_t k = 0;
    assert(s->n_files < MAX_FILES && strlen(name) < MAX_NAME);
    if (asprintf(&text, "%s/%s", s->folder, name) < 0)
        return status_fail(error, LAM_ERR_MEMORY, "scratch: out of memory");
    const int opened = openat(s->place.folder, name, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (opened < 0) {
        const lam_status status = status_fail(error, LAM_ERR_IO, "%s: %s", text, strerror(errno));
        free(text);
        return status;
    }
    while (k < s->n_files && strcmp(s->files[k], name) != 0) k++;
    if (k == s->n_files) strcpy(s->files[s->n_files++], name);
    *fd = opened;
    *path = text;
    return LAM_OK;
}

const large_place *scratch_place(const scratch *s) {
    return &s->place;
}

uint64_t scratch_used_bytes(const scratch *s) {
    uint64_t bytes = 0;
    DIR *folder = opendir(s->folder);
    if (folder == NULL) return 0;
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        struct stat about;
        if (fstatat(s->place.folder, entry->d_name, &about, AT_SYMLINK_NOFOLLOW) == 0 &&
            S_ISREG(about.st_mode))
            bytes += (uint64_t)about.st_size;
    }
    closedir(folder);
    return bytes;
}

uint64_t scratch_free_bytes(const scratch *s) {
    struct statvfs about;
    if (fstatvfs(s->place.folder, &about) != 0) return UINT64_MAX;
    return (uint64_t)about.f_bavail * about.f_frsize + scratch_used_bytes(s);
}

void scratch_close(scratch *s, bool done) {
    if (s == NULL) return;
    for (size_t k = 0; done && k < s->n_files; k++) unlinkat(s->place.folder, s->files[k], 0);
    if (s->made) rmdir(s->folder); /* fails where it is not empty */
    if (s->place.folder >= 0) close(s->place.folder);
    free(s->folder);
    free(s);
}
