/* Creates, seals and closes stores: a new file is written beside the target and renamed onto it. */
#include "store/groups.h"
#include "store/store_private.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Raw data from this many bytes on starts at a multiple of it, so that it can be mapped. */
#define ALIGNMENT 4096

store_mute store_mute_begin(void) {
    store_mute mute = {NULL, NULL};
    /* Without this HDF5 flushes abandoned files at exit, and prints about objects that it leaked over a
     * damaged header. All files are closed here. It takes effect before any other HDF5 call only. */
    H5dont_atexit();
    H5Eget_auto2(H5E_DEFAULT, &mute.print, &mute.context);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return mute;
}

void store_mute_end(const store_mute *mute) {
    H5Eset_auto2(H5E_DEFAULT, mute->print, mute->context);
}

size_t store_type_size(store_type type) {
    switch (type) {
    case STORE_I8:
        return 1;
    case STORE_F16:
    case STORE_U16:
        return 2;
    case STORE_F32:
    case STORE_U32:
        return 4;
    case STORE_F64:
    case STORE_U64:
        return 8;
    }
    return 0;
}

const char *store_path(const store *s) {
    return s->path;
}

/* The message of HDF5 at the place where it found the error. */
typedef struct hdf5_cause {
    bool memory;
    char text[160];
} hdf5_cause;

static herr_t cause_visit(unsigned depth, const H5E_error2_t *entry, void *context) {
    hdf5_cause *cause = context;
    if (depth == 0 && entry->desc != NULL) snprintf(cause->text, sizeof cause->text, "%s", entry->desc);
    if (entry->maj_num == H5E_RESOURCE && (entry->min_num == H5E_NOSPACE || entry->min_num == H5E_CANTALLOC))
        cause->memory = true;
    return 0;
}

lam_status store_hdf5_failure(store *s, const char *name, const char *what, lam_error *error) {
    hdf5_cause cause = {false, "no reason given"};
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, cause_visit, &cause);
    if (s->file.error != 0)
        return status_fail(error, LAM_ERR_IO, "%s: cannot %s %s: %s", s->path, what, name,
                           strerror(s->file.error));
    if (cause.memory)
        return status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory to %s %s", s->path, what, name);
    if (s->file.writable)
        return status_fail(error, LAM_ERR_INTERNAL, "%s: cannot %s %s: %s", s->path, what, name, cause.text);
    return status_fail(error, LAM_ERR_DAMAGED, "%s: %s is damaged (%s); make the store again", s->path, name,
                       cause.text);
}

lam_status store_name_check(const store *s, const char *name, lam_error *error) {
    size_t length = strlen(name), depth = 0;
    bool good = name[0] == '/' && length < STORE_NAME_SIZE - sizeof STORE_CHECKSUM;
    for (size_t i = 0; good && i < length; i++) {
        if (name[i] != '/') continue;
        depth++;
        good = length == 1 || (name[i + 1] != '/' && name[i + 1] != '\0' && name[i + 1] != '.');
    }
    if (!good || depth >= STORE_MAX_DEPTH)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "%s: \"%s\" is no name for the inside of a store: /group/array", s->path, name);
    return LAM_OK;
}

static lam_status text_copy(const char *text, char **copy, lam_error *error) {
    size_t size = strlen(text) + 1;
    *copy = memory_allocate(size, 1, "a path", error);
    if (*copy == NULL) return LAM_ERR_MEMORY;
    memcpy(*copy, text, size);
    return LAM_OK;
}

/* The final path: the target of a symbolic link, so that the link stays. */
static lam_status find_target(store *s, lam_error *error) {
    struct stat info;
    if (stat(s->path, &info) == 0 && !S_ISREG(info.st_mode))
        return status_fail(error, LAM_ERR_IO, "%s: exists and is not a regular file; choose another name",
                           s->path);
    s->target = realpath(s->path, NULL);
    return s->target != NULL ? LAM_OK : text_copy(s->path, &s->target, error);
}

/* Creates the hidden file that becomes the target; mode and owner are those of any new file. */
static lam_status create_partial(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const char *slash = strrchr(s->target, '/');
    const char *name = slash == NULL ? s->target : slash + 1;
    size_t folder = (size_t)(name - s->target), size = strlen(s->target) + 64;
    char *partial = NULL;
    if (name[0] == '\0') FAIL(error, LAM_ERR_IO, "\"%s\" names no file", s->path);
    partial = memory_allocate(size, 1, "a path", error);
    if (partial == NULL) TRY(LAM_ERR_MEMORY);
    /* A killed process of the same number may have left its file, which is not touched. */
    for (unsigned attempt = 0; s->file.fd < 0 && attempt < 10000; attempt++) {
        snprintf(partial, size, "%.*s.%.190s.partial-%ld-%06u", (int)folder, s->target, name, (long)getpid(),
                 attempt);
        s->file.fd = open(partial, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOCTTY, 0666);
        if (s->file.fd < 0 && errno != EEXIST) break;
    }
    if (s->file.fd < 0)
        FAIL(error, LAM_ERR_IO, "%s: cannot create a file there: %s", s->path, strerror(errno));
    s->partial = partial;
    partial = NULL;
done:
    free(partial);
    return status;
}

/* Version 2 of superblock and object headers: those carry checksums of the metadata. */
static lam_status create_hdf5(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    hid_t access = store_driver_properties(&s->file), creation = store_untimed(H5P_FILE_CREATE);
    if (access < 0 || creation < 0 || H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V110) < 0 ||
        H5Pset_alignment(access, ALIGNMENT, ALIGNMENT) < 0)
        TRY(store_hdf5_failure(s, "/", "create", error));
    s->h5 = H5Fcreate(s->partial, H5F_ACC_TRUNC, creation, access);
    if (s->h5 < 0 || s->file.error != 0) TRY(store_hdf5_failure(s, "/", "create", error));
done:
    if (access >= 0) H5Pclose(access);
    if (creation >= 0) H5Pclose(creation);
    return status;
}

lam_status store_new(const char *path, store **out, lam_error *error) {
    store *s = memory_allocate(1, sizeof *s, path, error);
    if (s == NULL) return LAM_ERR_MEMORY;
    s->h5 = -1;
    s->file.fd = -1;
    s->file.driver = -1;
    lam_status status = text_copy(path, &s->path, error);
    if (status == LAM_OK)
        *out = s;
    else
        free(s);
    return status;
}

lam_status store_create(const char *path, store **out, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    store_mute mute = store_mute_begin();
    TRY(store_new(path, &s, error));
    s->file.writable = true;
    TRY(find_target(s, error));
    TRY(create_partial(s, error));
    TRY(create_hdf5(s, error));
    *out = s;
    s = NULL;
done:
    store_close(s);
    store_mute_end(&mute);
    return status;
}

/* Makes a rename in the folder of path survive a power cut. The new file is complete and in place by then,
 * and not every file system supports this, so that failure is ignored. */
static void sync_folder(const char *path) {
    const char *slash = strrchr(path, '/');
    char *folder = slash == NULL ? strdup(".") : strndup(path, slash == path ? 1 : (size_t)(slash - path));
    if (folder == NULL) return;
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
    free(folder);
}

static lam_status write_root(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char created[32];
    struct tm utc;
    time_t now = time(NULL);
    if (gmtime_r(&now, &utc) == NULL || strftime(created, sizeof created, "%Y-%m-%dT%H:%M:%SZ", &utc) == 0)
        FAIL(error, LAM_ERR_INTERNAL, "%s: the clock gives no date", s->path);
    TRY(store_sums_write(s, error));
    TRY(store_set_text(s, "/", "created", created, error));
    TRY(store_set_integer(s, "/", "version", STORE_VERSION, error));
    TRY(store_set_text(s, "/", "format", STORE_FORMAT, error));
done:
    return status;
}

lam_status store_seal(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    store_mute mute = store_mute_begin();
    if (s->broken)
        FAIL(error, s->file.error != 0 ? LAM_ERR_IO : LAM_ERR_INTERNAL,
             "%s: not finished, something in it could not be written%s%s", s->path,
             s->file.error != 0 ? ": " : "", s->file.error != 0 ? strerror(s->file.error) : "");
    TRY(write_root(s, error));
    hid_t h5 = s->h5;
    s->h5 = -1;
    if (H5Fclose(h5) < 0 || s->file.error != 0) TRY(store_hdf5_failure(s, "the file", "finish", error));
    if (fsync(s->file.fd) != 0 || rename(s->partial, s->target) != 0)
        FAIL(error, LAM_ERR_IO, "%s: cannot finish the file: %s", s->path, strerror(errno));
    free(s->partial);
    s->partial = NULL;
    sync_folder(s->target);
done:
    store_close(s);
    store_mute_end(&mute);
    return status;
}

void store_close(store *s) {
    if (s == NULL) return;
    const bool writes = s->file.writable; /* otherwise HDF5 is not called */
    store_mute mute = {NULL, NULL};
    if (writes) mute = store_mute_begin();
    if (s->partial != NULL) {
        unlink(s->partial);
        if (s->file.error == 0) s->file.error = ECANCELED; /* data still in HDF5 need not be written */
    }
    if (s->h5 >= 0) H5Fclose(s->h5);
    store_driver_release(&s->file);
    if (s->file.fd >= 0) close(s->file.fd);
    store_sums_free(&s->sums);
    store_index_free(&s->index);
    store_map_release(s->map);
    free(s->partial);
    free(s->target);
    free(s->path);
    free(s);
    if (writes) store_mute_end(&mute);
}

const store_identity *store_identity_of(const store *s) {
    return &s->identity;
}

bool store_identity_same(const store_identity *a, const store_identity *b) {
    return a->device == b->device && a->inode == b->inode && a->size == b->size &&
           a->modified_s == b->modified_s && a->modified_ns == b->modified_ns &&
           strcmp(a->digest, b->digest) == 0;
}
