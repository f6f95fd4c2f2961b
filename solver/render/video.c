#include "solver/render/video.h"

#include "solver/base/atomic_file.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

enum { LEAST_DIGITS = 4, MOST_ARGUMENTS = 40 };

/* A kind of video: its muxer and the options of its encoder. Sides of most must be even, and the colours of
 * sRGB are those of BT.709. */
#define EVEN "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709,format=yuv420p"
typedef struct video_kind {
    const char *name; /* extension and muxer */
    const char *options[14];
} video_kind;

static const video_kind kinds[] = {
    {"mp4", {"-vf", EVEN, "-colorspace", "bt709", "-movflags", "+faststart"}},
    {"webm", {"-vf", EVEN, "-colorspace", "bt709", "-crf", "24", "-b:v", "0"}},
    {"gif", {"-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse"}},
};

static const video_kind *kind_of(const char *path) {
    char extension[16];
    atomic_file_extension(path, extension);
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        if (strcmp(kinds[k].name, extension) == 0) return &kinds[k];
    return NULL;
}

bool video_is_named(const char *path) {
    return kind_of(path) != NULL;
}

frame_names frame_names_of(const char *path, size_t n) {
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash != NULL ? slash : path, '.');
    frame_names names = {.path = path, .digits = snprintf(NULL, 0, "%zu", n), .n = n};
    names.stem = (int)(dot != NULL ? (size_t)(dot - path) : strlen(path));
    if (names.digits < LEAST_DIGITS) names.digits = LEAST_DIGITS;
    return names;
}

lam_status frame_name(const frame_names *names, size_t k, char **name, lam_error *error) {
    char extension[16];
    atomic_file_extension(names->path, extension);
    if (asprintf(name, "%.*s-%0*zu.%s", names->stem, names->path, names->digits, k,
                 strcmp(extension, "exr") == 0 ? extension : "png") >= 0)
        return LAM_OK;
    *name = NULL;
    return status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory for the name of frame %zu", names->path,
                       k);
}

/* The names of all frames as ffmpeg reads them: a % of the path twice, and no path that could be an option or
 * a protocol. */
static lam_status make_pattern(const frame_names *names, char **out, lam_error *error) {
    lam_status status = LAM_OK;
    char *pattern = memory_allocate((size_t)names->stem * 2 + 32, 1, "the names of frames", error);
    if (pattern == NULL) return LAM_ERR_MEMORY;
    char *to = pattern;
    if (names->path[0] != '/') to = stpcpy(to, "./");
    for (int i = 0; i < names->stem; i++) {
        if (names->path[i] == '%') *to++ = '%';
        *to++ = names->path[i];
    }
    sprintf(to, "-%%0%dd.png", names->digits);
    *out = pattern;
    return status;
}

/* Runs a program with standard error into *reading and nothing else; *there is false where it does not exist.
 */
static lam_status start(char *const *arguments, pid_t *child, int *reading, bool *there, lam_error *error) {
    lam_status status = LAM_OK;
    int ends[2] = {-1, -1};
    posix_spawn_file_actions_t actions;
    if (posix_spawn_file_actions_init(&actions) != 0)
        return status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory to run it", arguments[0]);
    if (pipe2(ends, O_CLOEXEC) != 0)
        FAIL(error, LAM_ERR_IO, "%s: cannot be run: %s", arguments[0], strerror(errno));
    if (posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0) != 0 ||
        posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0) != 0 ||
        posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO) != 0)
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory to run it", arguments[0]);
    const int failed = posix_spawnp(child, arguments[0], &actions, NULL, arguments, environ);
    *there = failed != ENOENT;
    if (failed != 0) FAIL(error, LAM_ERR_IO, "%s: cannot be run: %s", arguments[0], strerror(failed));
    *reading = ends[0];
    ends[0] = -1;
done:
    posix_spawn_file_actions_destroy(&actions);
    for (int k = 0; k < 2; k++)
        if (ends[k] >= 0) close(ends[k]);
    return status;
}

/* Reads to the end and keeps the last line that is not empty. A signal ends the child. */
static void listen_to(int reading, pid_t child, const progress *waiting, char *last, size_t size) {
    char text[512];
    size_t length = 0;
    bool fresh = true; /* the next character begins a line */
    for (;;) {
        const ssize_t got = read(reading, text, sizeof text);
        if (got < 0 && errno == EINTR) {
            if (progress_cancelled(waiting)) kill(child, SIGTERM);
            continue;
        }
        if (got <= 0) break;
        for (ssize_t i = 0; i < got; i++) {
            const bool end = text[i] == '\n' || text[i] == '\r';
            if (!end && fresh) length = 0;
            if (!end && length + 1 < size) last[length++] = text[i];
            fresh = end;
        }
    }
    last[length] = '\0';
}

static lam_status run(char *const *arguments, const char *path, const progress *waiting, lam_error *error) {
    lam_status status = LAM_OK;
    lam_error why = {.message = ""};
    char last[240] = "";
    pid_t child = 0;
    int reading = -1, ended = 0;
    bool there = true;
    status = start(arguments, &child, &reading, &there, &why);
    if (!there)
        FAIL(error, LAM_ERR_UNSUPPORTED,
             "%s: ffmpeg, which makes videos, is not installed; the numbered pictures are there", path);
    if (status != LAM_OK) FAIL(error, status, "%s: %s", path, why.message);
    listen_to(reading, child, waiting, last, sizeof last);
    close(reading);
    while (waitpid(child, &ended, 0) < 0 && errno == EINTR)
        if (progress_cancelled(waiting)) kill(child, SIGTERM);
    if (progress_cancelled(waiting)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    if (WIFEXITED(ended) && WEXITSTATUS(ended) == 0) goto done;
    if (WIFSIGNALED(ended))
        FAIL(error, LAM_ERR_IO, "%s: ffmpeg was ended by signal %d; the numbered pictures are there", path,
             WTERMSIG(ended));
    FAIL(error, LAM_ERR_IO, "%s: ffmpeg failed, the numbered pictures are there: %s", path,
         last[0] != '\0' ? last : "it does not say why");
done:
    return status;
}

lam_status video_write(const frame_names *names, double fps, const progress *waiting, lam_error *error) {
    lam_status status = LAM_OK;
    const video_kind *kind = kind_of(names->path);
    char *pattern = NULL, *target = NULL, rate[32], count[24];
    atomic_file out = {0};
    if (kind == NULL) FAIL(error, LAM_ERR_ARGUMENT, "%s: must end in .mp4, .webm or .gif", names->path);
    TRY(make_pattern(names, &pattern, error));
    TRY(atomic_file_open(names->path, &out, error));
    if (asprintf(&target, "%s%s", out.partial[0] == '/' ? "" : "./", out.partial) < 0) {
        target = NULL;
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", names->path);
    }
    snprintf(rate, sizeof rate, "%.6g", fps);
    snprintf(count, sizeof count, "%zu", names->n);
    const char *const fixed[] = {"ffmpeg",     "-hide_banner", "-nostdin",      "-loglevel", "error", "-y",
                                 "-framerate", rate,           "-start_number", "1",         "-i",    pattern,
                                 "-frames:v",  count};
    char *arguments[MOST_ARGUMENTS];
    size_t n = 0;
    for (size_t k = 0; k < sizeof fixed / sizeof fixed[0]; k++) arguments[n++] = (char *)(uintptr_t)fixed[k];
    for (const char *const *option = kind->options; *option != NULL; option++)
        arguments[n++] = (char *)(uintptr_t)*option;
    arguments[n++] = (char *)(uintptr_t)"-f";
    arguments[n++] = (char *)(uintptr_t)kind->name;
    arguments[n++] = target;
    arguments[n] = NULL;
    TRY(run(arguments, names->path, waiting, error));
    TRY(atomic_file_commit(&out, error));
done:
    atomic_file_abort(&out);
    free(pattern);
    free(target);
    return status;
}
