/* Opens a store for reading: the file once, by one descriptor; its headers here where they are as `lambert`
 * writes them (plain.h), else by HDF5 in a child process that has this descriptor and no right to anything
 * else; then checks of all that either gave. */
#include "store/groups.h"
#include "store/plain.h"
#include "store/store_private.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* Far more than the headers of any store need. */
static const confined_limits headers_limits = {
    .cpu_seconds = 20, .all_seconds = 30, .memory_bytes = (size_t)512 << 20, .filtered = true};

/* A damaged file ends every child; other causes (it is killed, memory is short) hardly end three. */
enum { TRIALS = 3 };

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

/* This runs in the child, whose copy of the store has a descriptor of another number. */
static void send_headers(void *context) {
    store *s = context;
    s->file.fd = CONFINED_INPUT;
    store_headers_send(s, CONFINED_REPLY);
}

#ifdef LAMBERT_SANITIZED
#include <dirent.h>

/* A sanitizer's allocator, unlike the C library's, may be locked by another thread when a process forks; the
 * child would then wait for ever. There it starts this program afresh, which is known by its name. */
#define FRESH "lambert: headers of a store"

static bool has_threads(void) {
    struct dirent **threads = NULL;
    const int count = scandir("/proc/self/task", &threads, NULL, NULL);
    for (int i = 0; i < count; i++) free(threads[i]);
    free(threads);
    return count != 3; /* ., .. and this one */
}

static void send_headers_afresh(void *context) {
    const store *s = context;
    char name[] = FRESH, size[32];
    char *arguments[] = {name, s->path, size, NULL};
    snprintf(size, sizeof size, "%llu", (unsigned long long)s->file.size);
    execv("/proc/self/exe", arguments);
}

/* Before main, whose arguments these are. */
__attribute__((constructor)) static void be_fresh(int argc, char **argv) {
    store *s = NULL;
    lam_error error;
    if (argc != 3 || strcmp(argv[0], FRESH) != 0) return;
    if (store_new(argv[1], &s, &error) == LAM_OK) {
        s->file.size = strtoull(argv[2], NULL, 10);
        send_headers(s);
    }
    _exit(0);
}

static confined_main *headers_main(void) {
    return has_threads() ? send_headers_afresh : send_headers;
}
#else
static confined_main *headers_main(void) {
    return send_headers;
}
#endif

/* Receives what a child sends into s->index. *whole is false where the answer ended before. The child's own
 * refusal comes in *head: some checks go before it. */
static lam_status receive(store *s, confined *child, reply_head *head, bool *whole, lam_error *error) {
    lam_status status = LAM_OK;
    char *bytes = NULL;
    *whole = confined_receive(child, head, sizeof *head);
    if (!*whole) goto done;
    TRY(store_reply_check(head, s->path, error));
    bytes = memory_allocate((size_t)head->bytes, 1, s->path, error);
    if (bytes == NULL) TRY(LAM_ERR_MEMORY);
    *whole = confined_receive(child, bytes, (size_t)head->bytes);
    if (!*whole) goto done;
    status = store_reply_read(head, s->path, s->file.size, bytes, &s->index, error);
    bytes = NULL; /* the index owns them, or they are freed */
done:
    free(bytes);
    return status;
}

/* One child. *again: it ended for a reason that may not be the file. */
static lam_status read_once(store *s, confined_main *run, const confined_limits *limits, reply_head *head,
                            bool *again, lam_error *error) {
    lam_status status = LAM_OK;
    confined child;
    bool whole = false;
    int how = 0;
    lam_error ending;
    TRY(confined_start(run, s, s->file.fd, limits, s->path, &child, error));
    status = receive(s, &child, head, &whole, error);
    const lam_status ended = confined_end(&child, whole || status != LAM_OK, s->path, &how, &ending);
    TRY(status);
    if (ended != LAM_OK) FAIL(error, ended, "%s", ending.message);
    if (whole) goto done;
    if (child.stopped) FAIL(error, LAM_ERR_CANCELLED, "%s: not read to its end", s->path);
    *again = !child.late && !(WIFSIGNALED(how) && WTERMSIG(how) == SIGXCPU);
    FAIL(error, LAM_ERR_DAMAGED, "%s: damaged so that HDF5 cannot read its headers; make the store again",
         s->path);
done:
    return status;
}

static lam_status check_root(const store *s, const reply_head *head, lam_error *error) {
    lam_status status = LAM_OK;
    const store_object *root = store_find(s, "/"), *sums = store_find(s, STORE_CHECKSUM);
    if (root == NULL) goto done; /* it could not be read: the child says why */
    const store_attribute *format = store_attribute_find(root, "format"),
                          *version = store_attribute_find(root, "version");
    if (format == NULL || format->kind != ATTRIBUTE_TEXT || strcmp(format->text, STORE_FORMAT) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: HDF5, but not a Lambert store", s->path);
    if (version == NULL) FAIL(error, LAM_ERR_FORMAT, "%s: / has no attribute \"version\"", s->path);
    if (version->kind != ATTRIBUTE_INTEGER)
        FAIL(error, LAM_ERR_FORMAT, "%s: attribute \"version\" of / is not an integer", s->path);
    if (version->integer != STORE_VERSION)
        FAIL(error, LAM_ERR_VERSION, "%s: of format version %lld, this program reads version %d; %s", s->path,
             (long long)version->integer, STORE_VERSION,
             version->integer > STORE_VERSION ? "use a newer lambert or precompute it again"
                                              : "precompute it again");
    if (head->status == LAM_OK && (sums == NULL || sums->kind != OBJECT_GROUP))
        FAIL(error, LAM_ERR_FORMAT, "%s: has no /checksum: it was never finished", s->path);
done:
    if (status == LAM_OK && head->status != LAM_OK)
        status =
            head->status == LAM_ERR_MEMORY
                ? status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory to read its headers", s->path)
                : status_fail(error, (lam_status)head->status, "%s", head->message);
    return status;
}

/* Every array but the checksums themselves has some. */
static lam_status check_sums(const store *s, lam_error *error) {
    for (size_t i = 0; i < s->index.n_objects; i++) {
        const store_object *object = &s->index.objects[i];
        if (object->kind != OBJECT_GROUP && strncmp(object->name, STORE_CHECKSUM "/", 10) != 0 &&
            store_sums_find(&s->sums, object->name) == NULL)
            return status_fail(error, LAM_ERR_DAMAGED, "%s: %s has no checksum; make the store again",
                               s->path, object->name);
    }
    return LAM_OK;
}

/* The headers of a store as `lambert` writes it, without HDF5 and so without a child. False: HDF5 is to say
 * what the file is. */
static bool read_plain(store *s, reply_head *head) {
    char *bytes = NULL;
    lam_error unused;
    if (!plain_headers(s, head, &bytes)) return false;
    if (store_reply_check(head, s->path, &unused) == LAM_OK)
        return store_reply_read(head, s->path, s->file.size, bytes, &s->index, &unused) == LAM_OK;
    free(bytes);
    return false;
}

/* Children until one answers whole, or three did not. */
static lam_status read_by_child(store *s, confined_main *run, const confined_limits *limits, reply_head *head,
                                lam_error *error) {
    for (int trial = 1;; trial++) {
        bool again = false;
        const lam_status status = read_once(s, run, limits, head, &again, error);
        if (status == LAM_OK || !again || trial == TRIALS) return status;
    }
}

/* Bytes of checksums, at most: of 8 TiB of arrays. */
#define SUMS_MOST ((uint64_t)64 << 20)

/* run NULL: a child is only needed where the file is not plain. */
static lam_status open_within(const char *path, uint64_t memory, confined_main *run,
                              const confined_limits *limits, store **out, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    reply_head head = {.status = LAM_OK};
    TRY(store_new(path, &s, error));
    s->stop = limits->stop;
    s->memory = memory;
    TRY(open_file(s, error));
    if (run != NULL || !read_plain(s, &head))
        TRY(read_by_child(s, run != NULL ? run : headers_main(), limits, &head, error));
    TRY(check_root(s, &head, error));
    TRY(store_sums_read(s, error));
    TRY(check_sums(s, error));
    *out = s;
    s = NULL;
done:
    store_close(s);
    return status;
}

lam_status store_open_by(const char *path, confined_main *run, const confined_limits *limits, store **out,
                         lam_error *error) {
    return open_within(path, SUMS_MOST, run, limits, out, error);
}

lam_status store_open_within(const char *path, uint64_t memory, const stop_check *stop, store **out,
                             lam_error *error) {
    confined_limits limits = headers_limits;
    limits.stop = stop;
    return open_within(path, memory < SUMS_MOST ? memory : SUMS_MOST, NULL, &limits, out, error);
}

lam_status store_open(const char *path, store **out, lam_error *error) {
    return store_open_within(path, UINT64_MAX, NULL, out, error);
}
