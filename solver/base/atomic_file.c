#include "solver/base/atomic_file.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The directory of path as fresh text; "." when it names none. */
static char *directory_of(const char *path) {
    const char *slash = strrchr(path, '/');
    if (slash == NULL) return strdup(".");
    return strndup(path, slash == path ? 1 : (size_t)(slash - path));
}

lam_status atomic_file_check(const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    struct stat about;
    char *directory = directory_of(path);
    const char *slash = strrchr(path, '/');
    if (directory == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", path);
    if (path[0] == '\0' || (slash != NULL && slash[1] == '\0'))
        FAIL(error, LAM_ERR_IO, "%s: not the name of a file; give -o a file", path);
    if (stat(path, &about) == 0 && S_ISDIR(about.st_mode))
        FAIL(error, LAM_ERR_IO, "%s: is a directory; give -o a file", path);
    if (stat(directory, &about) != 0)
        FAIL(error, LAM_ERR_IO, "%s: cannot be written: %s: %s; make the directory or choose another", path,
             directory, strerror(errno));
    if (!S_ISDIR(about.st_mode))
        FAIL(error, LAM_ERR_IO, "%s: cannot be written: %s is not a directory", path, directory);
    if (access(directory, W_OK | X_OK) != 0)
        FAIL(error, LAM_ERR_IO, "%s: cannot be written: %s: %s; choose another directory", path, directory,
             strerror(errno));
done:
    free(directory);
    return status;
}

lam_status atomic_file_open(const char *path, atomic_file *out, lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file file = {0};
    int descriptor = -1;
    const char *slash = strrchr(path, '/');
    size_t folder = slash == NULL ? 0 : (size_t)(slash - path) + 1;
    TRY(atomic_file_check(path, error));
    file.path = strdup(path);
    if (file.path == NULL || asprintf(&file.partial, "%.*s.%s.partial-%ld", (int)folder, path, path + folder,
                                      (long)getpid()) < 0) {
        file.partial = NULL;
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", path);
    }
    descriptor = open(file.partial, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor < 0) FAIL(error, LAM_ERR_IO, "%s: cannot be written: %s", file.partial, strerror(errno));
    file.stream = fdopen(descriptor, "wb");
    if (file.stream == NULL) {
        status_fail(error, LAM_ERR_IO, "%s: cannot be written: %s", path, strerror(errno));
        close(descriptor);
        unlink(file.partial);
        status = LAM_ERR_IO;
        goto done;
    }
    *out = file;
    file = (atomic_file){0};
done:
    free(file.path);
    free(file.partial);
    return status;
}

lam_status atomic_file_commit(atomic_file *out, lam_error *error) {
    lam_status status = LAM_OK;
    errno = 0;
    bool failed = ferror(out->stream) != 0;
    /* A write that was refused earlier left no reason behind: one more byte brings it back. */
    if (failed) putc(0, out->stream);
    failed = fflush(out->stream) != 0 || failed;
    failed = fsync(fileno(out->stream)) != 0 || failed;
    int reason = errno;
    failed = fclose(out->stream) != 0 || failed;
    out->stream = NULL;
    if (failed)
        FAIL(error, LAM_ERR_IO, "%s: cannot be written whole: %s; nothing was left behind", out->path,
             reason != 0 ? strerror(reason) : "the disk refused it");
    if (rename(out->partial, out->path) != 0)
        FAIL(error, LAM_ERR_IO, "%s: cannot be put in place: %s", out->path, strerror(errno));
    free(out->partial);
    out->partial = NULL;
done:
    atomic_file_abort(out);
    return status;
}

void atomic_file_abort(atomic_file *out) {
    if (out->stream != NULL) fclose(out->stream);
    if (out->partial != NULL) unlink(out->partial);
    free(out->partial);
    free(out->path);
    *out = (atomic_file){0};
}

void atomic_file_extension(const char *path, char extension[16]) {
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash != NULL ? slash : path, '.');
    extension[0] = '\0';
    if (dot == NULL || strlen(dot + 1) >= 16) return;
    for (size_t i = 0;; i++) {
        extension[i] = (char)tolower((unsigned char)dot[1 + i]);
        if (dot[1 + i] == '\0') break;
    }
}
