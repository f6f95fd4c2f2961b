#include "server/scene/weather_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

static const struct {
    const char *format, *beginning;
} formats[] = {{"epw", "LOCATION,"}, {"wea", "place "}};
enum { N_FORMATS = sizeof formats / sizeof formats[0] };

void weather_file_free(weather_file *w) {
    free(w->text);
    *w = (weather_file){0};
}

/* Opens the first of the files that may be there; -1 with errno. *which: its format. */
static int open_beside(const char *store_path, size_t *which, lam_error *error, lam_status *status) {
    const size_t length = strlen(store_path);
    const bool named = length > 3 && strcmp(store_path + length - 3, ".h5") == 0;
    int file = -1;
    errno = ENOENT;
    for (size_t k = 0; k < N_FORMATS && file < 0 && errno == ENOENT; k++) {
        char *path = NULL;
        if (asprintf(&path, "%.*s.%s", (int)(named ? length - 3 : length), store_path, formats[k].format) <
            0) {
            *status = status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory", store_path);
            errno = ENOMEM;
            return -1;
        }
        *which = k;
        /* A pipe must not be waited for. */
        file = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
        const int cause = errno;
        free(path);
        errno = cause;
    }
    return file;
}

static void set_identity(weather_file *w, const struct stat *about) {
    w->identity.device = (uint64_t)about->st_dev;
    w->identity.inode = (uint64_t)about->st_ino;
    w->identity.size = (uint64_t)about->st_size;
    w->identity.modified_s = (int64_t)about->st_mtim.tv_sec;
    w->identity.modified_ns = (int64_t)about->st_mtim.tv_nsec;
}

static void leave(weather_file *w, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void leave(weather_file *w, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(w->why, sizeof w->why, format, arguments);
    va_end(arguments);
}

/* True if size bytes are in w->text, and are text that begins as the format does. */
static bool read_text(int file, size_t which, size_t size, weather_file *w) {
    while (w->length < size) {
        const ssize_t got = read(file, w->text + w->length, size - w->length);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) {
            leave(w, "the .%s file beside the store cannot be read: %s", formats[which].format,
                  got < 0 ? strerror(errno) : "it became shorter");
            return false;
        }
        w->length += (size_t)got;
    }
    const char *begin = w->text;
    size_t left = size;
    if (left >= 3 && memcmp(begin, "\xEF\xBB\xBF", 3) == 0) { /* a byte order mark */
        begin += 3;
        left -= 3;
    }
    const size_t word = strlen(formats[which].beginning);
    if (left >= word && strncasecmp(begin, formats[which].beginning, word) == 0 &&
        memchr(w->text, '\0', size) == NULL)
        return true;
    leave(w, "the .%s file beside the store does not begin with \"%s\", or is no text", formats[which].format,
          formats[which].beginning);
    return false;
}

lam_status weather_file_read(const char *store_path, uint64_t room, weather_file *out, lam_error *error) {
    lam_status status = LAM_OK;
    weather_file made = {0};
    struct stat about;
    size_t which = 0;
    const int file = open_beside(store_path, &which, error, &status);
    TRY(status);
    const char *format = formats[which].format;
    if (file < 0 || fstat(file, &about) != 0) {
        if (errno == ENOENT)
            leave(&made, "no .epw or .wea file of its name is beside the store");
        else
            leave(&made, "the .%s file beside the store cannot be opened: %s", format, strerror(errno));
        goto kept;
    }
    set_identity(&made, &about);
    const size_t size = about.st_size < 0 ? 0 : (size_t)about.st_size;
    if (!S_ISREG(about.st_mode)) {
        leave(&made, "the .%s beside the store is not a file", format);
    } else if (size > WEATHER_FILE_MOST) {
        leave(&made, "the .%s file beside the store has %zu bytes, at most %zu are served", format, size,
              WEATHER_FILE_MOST);
    } else if (size > room) {
        leave(&made, "the .%s file beside the store has %zu bytes, --max-memory has no room for it", format,
              size);
    } else {
        made.text = memory_allocate(size + 1, 1, store_path, error);
        if (made.text == NULL) TRY(LAM_ERR_MEMORY);
        if (read_text(file, which, size, &made)) {
            made.format = format;
        } else {
            free(made.text);
            made.text = NULL;
            made.length = 0;
        }
    }
kept:
    *out = made;
    made.text = NULL;
done:
    if (file >= 0) close(file);
    free(made.text);
    return status;
}

bool weather_file_same(const weather_file *w, const char *store_path) {
    weather_file now = {0};
    struct stat about;
    size_t which;
    lam_error unused;
    lam_status status = LAM_OK;
    const int file = open_beside(store_path, &which, &unused, &status);
    if (file >= 0) {
        if (fstat(file, &about) == 0) set_identity(&now, &about);
        close(file);
    }
    return memcmp(&w->identity, &now.identity, sizeof now.identity) == 0;
}
