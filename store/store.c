/* Creates, seals and opens stores: a new file is written beside the target and renamed onto it; opening reads
 * all metadata of a sealed one. */
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
    bool good = name[0] == '/' && length < STORE_NAME_SIZE - sizeof "/checksum";
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

static bool is_group(const store *s, const char *name) {
    hid_t object = H5Oopen(s->h5, name, H5P_DEFAULT);
    /* An object that cannot be opened counts as one: reading it will fail with a message. */
    bool group = object < 0 || H5Iget_type(object) == H5I_GROUP;
    if (object >= 0) H5Oclose(object);
    return group;
}

int store_exists(const store *s, const char *name) {
    char prefix[STORE_NAME_SIZE];
    size_t length = strlen(name);
    if (name[0] != '/' || length >= sizeof prefix) return 0;
    if (length == 1) return 1;
    for (size_t i = 1; i <= length; i++) {
        if (name[i] != '/' && name[i] != '\0') continue;
        if (name[i - 1] == '/') return 0;
        memcpy(prefix, name, i);
        prefix[i] = '\0';
        htri_t found = H5Lexists(s->h5, prefix, H5P_DEFAULT);
        if (found <= 0) return found < 0 ? -1 : 0;
        if (name[i] == '/' && !is_group(s, prefix)) return 0; /* an array has no objects within */
    }
    return 1;
}

bool store_has(store *s, const char *name) {
    store_mute mute = store_mute_begin();
    bool found = store_exists(s, name) > 0;
    store_mute_end(&mute);
    return found;
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

static lam_status store_new(const char *path, store **out, lam_error *error) {
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
    store_mute mute = store_mute_begin();
    if (s->partial != NULL) {
        unlink(s->partial);
        if (s->file.error == 0) s->file.error = ECANCELED; /* data still in HDF5 need not be written */
    }
    if (s->h5 >= 0) H5Fclose(s->h5);
    store_driver_release(&s->file);
    if (s->file.fd >= 0) close(s->file.fd);
    store_sums_free(&s->sums);
    store_map_release(s->map);
    free(s->partial);
    free(s->target);
    free(s->path);
    free(s);
    store_mute_end(&mute);
}

static lam_status open_file(store *s, lam_error *error) {
    struct stat info;
    /* O_NONBLOCK: a pipe of that name must not make us wait for its writer. */
    s->file.fd = open(s->path, O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
    if (s->file.fd < 0 || fstat(s->file.fd, &info) != 0)
        return status_fail(error, LAM_ERR_IO, "%s: cannot open: %s", s->path, strerror(errno));
    if (!S_ISREG(info.st_mode))
        return status_fail(error, LAM_ERR_FORMAT, "%s: not a regular file, so not a Lambert store", s->path);
    s->file.size = (uint64_t)info.st_size;
    s->identity = (store_identity){.device = (uint64_t)info.st_dev,
                                   .inode = (uint64_t)info.st_ino,
                                   .size = s->file.size,
                                   .modified_s = (int64_t)info.st_mtim.tv_sec,
                                   .modified_ns = (int64_t)info.st_mtim.tv_nsec};
    return LAM_OK;
}

const store_identity *store_identity_of(const store *s) {
    return &s->identity;
}

bool store_identity_same(const store_identity *a, const store_identity *b) {
    return a->device == b->device && a->inode == b->inode && a->size == b->size &&
           a->modified_s == b->modified_s && a->modified_ns == b->modified_ns &&
           strcmp(a->digest, b->digest) == 0;
}

/* The fixed part of a superblock of version 2 or 3: signature [8], version, size of offsets, size of lengths,
 * flags, then four offsets: base, extension, end of file, root; a checksum [4]. */
static lam_status open_hdf5(store *s, lam_error *error) {
    static const unsigned char signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    lam_status status = LAM_OK;
    unsigned char head[48];
    hid_t access = -1;
    if (s->file.size < sizeof head)
        FAIL(error, LAM_ERR_FORMAT, "%s: %llu bytes, too short for a Lambert store", s->path,
             (unsigned long long)s->file.size);
    if (!store_file_read(&s->file, 0, head, sizeof head))
        TRY(store_hdf5_failure(s, "the file", "read", error));
    /* Version 0, of other HDF5 files, has no checksum: it is refused without asking HDF5. */
    if (memcmp(head, signature, sizeof signature) != 0 || head[8] < 2 || head[8] > 3 || head[9] != 8 ||
        head[10] != 8)
        FAIL(error, LAM_ERR_FORMAT, "%s: not a Lambert store", s->path);
    access = store_driver_properties(&s->file);
    if (access < 0) TRY(store_hdf5_failure(s, "the file", "open", error));
    s->h5 = H5Fopen(s->path, H5F_ACC_RDONLY, access);
    if (s->h5 < 0) {
        status = store_hdf5_failure(s, "the file's head", "read", error);
        uint64_t end = 0;
        for (int i = 7; i >= 0; i--) end = end << 8 | head[28 + i];
        if (status == LAM_ERR_DAMAGED && end > s->file.size)
            FAIL(error, LAM_ERR_FORMAT, "%s: truncated: %llu bytes of %llu; make or copy it again", s->path,
                 (unsigned long long)s->file.size, (unsigned long long)end);
    }
done:
    if (access >= 0) H5Pclose(access);
    return status;
}

static lam_status check_root(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char *format = NULL;
    int64_t version = 0;
    status = store_get_text(s, "/", "format", &format, error);
    if (status == LAM_ERR_FORMAT || (status == LAM_OK && strcmp(format, STORE_FORMAT) != 0))
        FAIL(error, LAM_ERR_FORMAT, "%s: HDF5, but not a Lambert store", s->path);
    TRY(status);
    TRY(store_get_integer(s, "/", "version", &version, error));
    if (version != STORE_VERSION)
        FAIL(error, LAM_ERR_VERSION, "%s: of format version %lld, this program reads version %d; %s", s->path,
             (long long)version, STORE_VERSION,
             version > STORE_VERSION ? "use a newer lambert or precompute it again" : "precompute it again");
    if (store_exists(s, "/checksum") == 0 || !is_group(s, "/checksum"))
        FAIL(error, LAM_ERR_FORMAT, "%s: has no /checksum: it was never finished", s->path);
done:
    free(format);
    return status;
}

typedef struct metadata_walk {
    store *s;
    lam_status status;
    lam_error *error;
} metadata_walk;

static void attribute_ignore(void *context, const char *name, const char *text, double number) {
    (void)context;
    (void)name;
    (void)text;
    (void)number;
}

/* Checks one link: a hard link to a readable group, or to a readable array with checksums. */
static herr_t metadata_visit(hid_t root, const char *relative, const H5L_info_t *info, void *context) {
    metadata_walk *walk = context;
    store *s = walk->s;
    lam_error *error = walk->error;
    lam_status status = LAM_OK;
    char name[STORE_NAME_SIZE];
    hid_t object = -1;
    size_t depth = 1;
    for (const char *c = relative; *c != '\0'; c++) depth += *c == '/';
    if (info->type != H5L_TYPE_HARD || strlen(relative) + 2 > sizeof name || depth >= STORE_MAX_DEPTH + 1)
        FAIL(error, LAM_ERR_FORMAT, "%s: /%.80s is a link or lies too deep, not a Lambert store", s->path,
             relative);
    snprintf(name, sizeof name, "/%s", relative);
    object = H5Oopen(root, relative, H5P_DEFAULT);
    if (object < 0) TRY(store_hdf5_failure(s, name, "read", error));
    H5I_type_t kind = H5Iget_type(object);
    if (kind != H5I_GROUP && kind != H5I_DATASET)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is neither a group nor an array, not a Lambert store", s->path,
             name);
    if (kind == H5I_DATASET && strncmp(name, "/checksum/", 10) != 0 &&
        store_sums_find(&s->sums, name) == NULL)
        FAIL(error, LAM_ERR_DAMAGED, "%s: %s has no checksum; make the store again", s->path, name);
    TRY(store_each_attribute(s, name, attribute_ignore, NULL, error));
done:
    if (object >= 0) H5Oclose(object);
    walk->status = status;
    return status == LAM_OK ? 0 : -1;
}

/* Reads every header once, so that a damaged one is reported here and not taken for a missing one. */
static lam_status check_metadata(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    metadata_walk walk = {s, LAM_OK, error};
    TRY(store_each_attribute(s, "/", attribute_ignore, NULL, error));
    if (H5Lvisit(s->h5, H5_INDEX_NAME, H5_ITER_INC, metadata_visit, &walk) < 0) {
        TRY(walk.status);
        TRY(store_hdf5_failure(s, "a group", "read", error));
    }
done:
    return status;
}

static lam_status open_here(const char *path, store **out, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    store_mute mute = store_mute_begin();
    TRY(store_new(path, &s, error));
    TRY(open_file(s, error));
    TRY(open_hdf5(s, error));
    TRY(check_root(s, error));
    TRY(store_sums_read(s, error));
    TRY(check_metadata(s, error));
    *out = s;
    s = NULL;
done:
    store_close(s);
    store_mute_end(&mute);
    return status;
}

lam_status store_open(const char *path, store **out, lam_error *error) {
    const lam_status status = store_probe(open_here, path, error);
    return status == LAM_OK ? open_here(path, out, error) : status;
}
