/* Stores with any content: each opens and answers with finite light, or is refused in one line. */
#include "fuzz/fuzz.h"
#include "server/scene/scene.h"

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
    if (s->luminaires != NULL) {
        float *D = calloc(lam_luminaires_count(s->luminaires), s->n_channels * sizeof *D);
        FUZZ_CHECK(D != NULL);
        lam_luminaires_adjoint(s->luminaires, 1, E, D);
        lam_luminaires_irradiance(s->luminaires, 1, D, out);
        free(D);
    }
    free(E);
    free(out);
    free(work);
}

/* Form factors as they are kept: light refined by them is finite and certified, or refused in one line. */
static void refine(const scene *s, const char *path) {
    lam_error error = {.message = ""};
    lam_form_factors *F = NULL;
    lam_refiner *refiner = NULL;
    const size_t count = s->n * s->n_channels;
    if (s->n_emitters > 0 || count > MOST_VALUES) return;
    const lam_status opened = lam_form_factors_open(path, &F, &error);
    FUZZ_CHECK(opened == LAM_OK || (error.message[0] != '\0' && strchr(error.message, '\n') == NULL));
    if (F == NULL) return;
    double *E = calloc(count, sizeof *E), *out = calloc(count, sizeof *out), certificate = NAN;
    size_t iterations;
    FUZZ_CHECK(E != NULL && out != NULL);
    for (size_t i = 0; i < count; i++) E[i] = 1;
    if (lam_refiner_create(s->op, F, &refiner, &error) == LAM_OK &&
        lam_refine(refiner, 1, LAM_RADIOSITY, E, NULL, NULL, .5, out, &certificate, &iterations, &error) ==
            LAM_OK) {
        FUZZ_CHECK(certificate >= 0 && isfinite(certificate));
        for (size_t i = 0; i < count; i++) FUZZ_CHECK(isfinite(out[i]));
    } else {
        FUZZ_CHECK(error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
    }
    lam_refiner_free(refiner);
    lam_form_factors_close(F);
    free(E);
    free(out);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char path[] = "/dev/shm/lambert-fuzz-XXXXXX";
    const int fd = mkstemp(path);
    FUZZ_CHECK(fd >= 0 && write(fd, data, size) == (ssize_t)size);
    close(fd);
    for (int verify = 0; verify < 2; verify++) {
        scene *s = NULL;
        const scene_options options = {
            .path = path, .name = "fuzz", .verify = verify == 1, .memory = UINT64_MAX, .threads = 1};
        lam_error error = {.message = ""};
        if (scene_open(&options, &s, &error) == LAM_OK) {
            apply(s);
            refine(s, path);
            scene_release(s);
        } else {
            FUZZ_CHECK(error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
        }
    }
    unlink(path);
    return 0;
}
