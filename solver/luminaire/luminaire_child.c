/* Reads a luminaire's file in a child process with limits, which sends the table through a pipe. The parent
 * checks all that it receives. */
#include "solver/luminaire/luminaire_child.h"

#include "solver/base/file_text.h"
#include "solver/luminaire/luminaire_source.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>

enum { CHILD_SECONDS = 10 };
static const size_t child_bytes = (size_t)256 << 20;

/* The first bytes that the child sends; planes, angles, candela, the angles and factors of the tilt, lamp
 * sets and words follow. Pointers of the luminaire mean nothing in the parent. */
typedef struct reply_header {
    char magic[8];
    uint64_t status;
    char message[sizeof((lam_error *)0)->message];
    luminaire made;
} reply_header;

static const char reply_magic[8] = "lamlumi";

/* The task of the child. */
typedef struct child_work {
    const char *path;
    const luminaire_options *options;
} child_work;

static lam_status read_file(const child_work *work, luminaire *l, lam_error *error) {
    lam_status status = LAM_OK;
    struct stat about;
    char *text = NULL;
    size_t length = 0;
    if (stat(work->path, &about) != 0)
        FAIL(error, LAM_ERR_IO, "%s: cannot read: %s", work->path, strerror(errno));
    if (!S_ISREG(about.st_mode)) FAIL(error, LAM_ERR_IO, "%s: not a file", work->path);
    if (about.st_size > (off_t)LUMINAIRE_BYTES_MOST)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: has %lld bytes, more than the %zu MiB that a luminaire file may have", work->path,
             (long long)about.st_size, LUMINAIRE_BYTES_MOST >> 20);
    TRY(file_text(work->path, &text, &length, error));
    TRY(luminaire_read_text(work->path, text, length, work->options, l, error));
done:
    free(text);
    return status;
}

bool luminaire_send(int fd, lam_status result, const lam_error *error, const luminaire *l) {
    reply_header header;
    memset(&header, 0, sizeof header);
    memcpy(header.magic, reply_magic, sizeof reply_magic);
    header.status = (uint64_t)result;
    memcpy(header.message, error->message, sizeof header.message);
    header.made = *l;
    if (!confined_send(fd, &header, sizeof header)) return false;
    if (result != LAM_OK) return true;
    return confined_send(fd, l->planes, l->n_planes * sizeof *l->planes) &&
           confined_send(fd, l->angles, l->n_angles * sizeof *l->angles) &&
           confined_send(fd, l->candela, l->n_planes * l->n_angles * sizeof *l->candela) &&
           confined_send(fd, l->tilt.angles, l->tilt.n * sizeof *l->tilt.angles) &&
           confined_send(fd, l->tilt.factors, l->tilt.n * sizeof *l->tilt.factors) &&
           confined_send(fd, l->sets, l->n_sets * sizeof *l->sets) &&
           confined_send(fd, l->words, l->n_words * sizeof *l->words);
}

static void read_in_child(void *context) {
    luminaire l = {.n_planes = 0};
    lam_error error = {.message = ""};
    const lam_status result = read_file(context, &l, &error);
    (void)luminaire_send(CONFINED_REPLY, result, &error, &l);
}

/* Reads an array of count values of size bytes; *whole becomes false where the pipe ends. */
static lam_status receive_array(confined *child, void *array, size_t count, size_t size, const char *path,
                                bool *whole, lam_error *error) {
    void *data = memory_allocate(count, size, path, error);
    if (data == NULL) return LAM_ERR_MEMORY;
    memcpy(array, &data, sizeof data); /* a pointer to any type */
    *whole = *whole && confined_receive(child, data, count * size);
    return LAM_OK;
}

/* Receives a reply into l; *whole is false where the pipe ended before. */
static lam_status receive_reply(confined *child, const char *path, luminaire *l, bool *whole,
                                lam_error *error) {
    lam_status status = LAM_OK;
    reply_header header;
    *whole = confined_receive(child, &header, sizeof header);
    if (!*whole) goto done;
    header.message[sizeof header.message - 1] = '\0';
    bool sound = memcmp(header.magic, reply_magic, sizeof reply_magic) == 0;
    const bool says_why = header.message[0] != '\0' && strpbrk(header.message, "\r\n") == NULL;
    if (sound && says_why && header.status > LAM_OK && header.status <= LAM_ERR_INTERNAL)
        FAIL(error, (lam_status)header.status, "%s", header.message);
    const luminaire *made = &header.made;
    const size_t most =
        LUMINAIRE_BYTES_MOST; /* a value has two bytes of the file, but one plane may be twice */
    sound = sound && header.status == LAM_OK && made->n_planes > 0 && made->n_planes < most &&
            made->n_angles < most && made->n_angles <= most / made->n_planes && made->tilt.n < most &&
            made->n_sets <= LUMINAIRE_SETS_MOST && made->n_words <= LUMINAIRE_WORDS_MOST;
    if (!sound) FAIL(error, LAM_ERR_FORMAT, "%s: its reader sent a damaged reply", path);
    unsigned char absolute; /* a bool that came as any byte */
    memcpy(&absolute, &made->absolute, sizeof absolute);
    *l = *made;
    l->absolute = absolute != 0;
    l->planes = l->angles = l->candela = l->tilt.angles = l->tilt.factors = NULL;
    l->sets = NULL;
    l->words = NULL;
    TRY(receive_array(child, &l->planes, l->n_planes, sizeof *l->planes, path, whole, error));
    TRY(receive_array(child, &l->angles, l->n_angles, sizeof *l->angles, path, whole, error));
    TRY(receive_array(child, &l->candela, l->n_planes * l->n_angles, sizeof *l->candela, path, whole, error));
    TRY(receive_array(child, &l->tilt.angles, l->tilt.n, sizeof *l->tilt.angles, path, whole, error));
    TRY(receive_array(child, &l->tilt.factors, l->tilt.n, sizeof *l->tilt.factors, path, whole, error));
    TRY(receive_array(child, &l->sets, l->n_sets, sizeof *l->sets, path, whole, error));
    TRY(receive_array(child, &l->words, l->n_words, sizeof *l->words, path, whole, error));
    if (*whole && !luminaire_is_sound(l))
        FAIL(error, LAM_ERR_FORMAT, "%s: its reader sent a damaged reply", path);
done:
    return status;
}

lam_status luminaire_receive(confined_main *run, void *context, const char *path, luminaire *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const confined_limits limits = {.cpu_seconds = CHILD_SECONDS,
                                    .all_seconds = 4 * CHILD_SECONDS,
                                    .memory_bytes = child_bytes,
                                    .filtered = true,
                                    .reads_files = true};
    confined child;
    lam_error ending;
    int wait_status = 0;
    bool whole = false;
    luminaire l = {.n_planes = 0};
    TRY(confined_start(run, context, -1, &limits, path, &child, error));
    status = receive_reply(&child, path, &l, &whole, error);
    const lam_status ended = confined_end(&child, whole || status != LAM_OK, path, &wait_status, &ending);
    TRY(status);
    if (ended != LAM_OK) FAIL(error, ended, "%s", ending.message);
    if (!whole) TRY(confined_verdict(&child, &limits, wait_status, path, "its reader", error));
    *out = l;
    l = (luminaire){.n_planes = 0};
done:
    luminaire_free(&l);
    return status;
}

lam_status luminaire_read(const char *path, const luminaire_options *options, luminaire *out,
                          lam_error *error) {
    child_work work = {path, options};
    return luminaire_receive(read_in_child, &work, path, out, error);
}
