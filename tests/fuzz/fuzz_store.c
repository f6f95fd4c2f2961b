/* Stores with any content: each opens and answers with finite light, or is refused in one line. */
#include "fuzz/fuzz.h"
#include "server/scene/scene.h"
#include "solver/figures/eye_rating.h"
#include "solver/operator/sensor_light.h"

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

/* The answer of a store of few emitters to each of them. */
static void apply_emitters(const scene *s) {
    lam_error error;
    const size_t rows = s->n_channels * s->n_emitters, count = s->n * s->n_channels,
                 bytes = lam_operator_work_bytes(s->op, 1);
    if (s->n_emitters == 0 || count > MOST_VALUES || rows > MOST_VALUES || bytes == 0 ||
        bytes > (size_t)1 << 28)
        return;
    float *W = calloc(rows, sizeof *W), *out = calloc(count, sizeof *out);
    void *work = malloc(bytes);
    FUZZ_CHECK(W != NULL && out != NULL && work != NULL);
    for (size_t k = 0; k < rows; k++) W[k] = 1;
    FUZZ_CHECK(lam_operator_apply_emitters(s->op, 1, LAM_INDIRECT, W, 0, NULL, out, work, bytes, &error) ==
               LAM_OK);
    FUZZ_CHECK(lam_operator_adjoint_emitters(s->op, 1, LAM_INDIRECT, out, W, work, bytes, &error) == LAM_OK);
    free(W);
    free(out);
    free(work);
}

/* The light at sensors, and what eyes see of luminaires. */
static void gather(const scene *s) {
    const size_t values = s->sensors != NULL ? s->n_channels * lam_sensors_count(s->sensors) : 0,
                 q = s->sensors != NULL ? lam_sensors_luminaires(s->sensors) : 0;
    if (s->sensors == NULL || values > MOST_VALUES || s->n * s->n_channels > MOST_VALUES || q > MOST_VALUES)
        return;
    float *B = calloc(s->n, s->n_channels * sizeof *B), *D = calloc(q + 1, s->n_channels * sizeof *D),
          *out = calloc(values + 1, sizeof *out);
    double *dimmer = calloc(q + 1, sizeof *dimmer);
    FUZZ_CHECK(B != NULL && D != NULL && out != NULL && dimmer != NULL);
    for (size_t k = 0; k < q * s->n_channels; k++) D[k] = 1;
    lam_sensors_gather(s->sensors, 1, B, NULL, D, out);
    const sensor_eyes eyes = sensors_eyes(s->sensors);
    eye_dimmers(s->n_channels, q, D, eyes.colours, dimmer);
    for (size_t k = 0; k < lam_sensors_count(s->sensors); k++) {
        const eye_view view = {q, sensors_seen(s->sensors, k), eyes.n * SENSOR_SEEN, dimmer};
        const eye_rating rating = eye_rate(&view, true, 1, sensors_direct(s->sensors, dimmer, k));
        FUZZ_CHECK((rating.reason == UGR_RATED) != isnan(rating.ugr));
    }
    free(B);
    free(D);
    free(out);
    free(dimmer);
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
            apply_emitters(s);
            gather(s);
            refine(s, path);
            scene_release(s);
        } else {
            FUZZ_CHECK(error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
        }
    }
    unlink(path);
    return 0;
}
