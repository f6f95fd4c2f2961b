/* What a store may hold: it opens and answers with finite light, or is refused in one line. */
#include "fuzz/fuzz.h"
#include "server/scene.h"

#include <math.h>
#include <unistd.h>

/* More elements than this are not applied: the input is small, so its operator would be mostly zeros. */
enum { MOST_VALUES = 1 << 20 };

static void apply(const scene *s) {
    lam_error error;
    const size_t count = s->n * s->n_channels, bytes = lam_operator_work_bytes(s->op, 1);
    if (s->n_emitters > 0 || count > MOST_VALUES || bytes == 0 || bytes > (size_t)1 << 28) return;
    float *E = calloc(count, sizeof *E), *out = calloc(count, sizeof *out);
    void *work = malloc(bytes);
    FUZZ_CHECK(E != NULL && out != NULL && work != NULL);
    for (size_t i = 0; i < count; i++) E[i] = 1;
    FUZZ_CHECK(lam_operator_apply(s->op, 1, LAM_RADIOSITY, E, out, work, bytes, &error) == LAM_OK);
    free(E);
    free(out);
    free(work);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char path[] = "/dev/shm/lambert-fuzz-XXXXXX";
    pthread_mutex_t stores = PTHREAD_MUTEX_INITIALIZER;
    const int fd = mkstemp(path);
    FUZZ_CHECK(fd >= 0 && write(fd, data, size) == (ssize_t)size);
    close(fd);
    for (int verify = 0; verify < 2; verify++) {
        scene *s = NULL;
        const scene_wish wish = {
            .path = path, .verify = verify == 1, .memory = UINT64_MAX, .threads = 1, .stores = &stores};
        lam_error error = {.message = ""};
        if (scene_open(&wish, &s, &error) == LAM_OK) {
            apply(s);
            scene_release(s);
        } else {
            FUZZ_CHECK(error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
        }
    }
    unlink(path);
    return 0;
}
