/* Adjoint requests as a client may send them. */
#include "fuzz/fuzz.h"
#include "solver/codec/adjoint.h"
#include "solver/codec/jacobian.h"

#include <float.h>
#include <math.h>

/* The text as a request for derivatives. */
static void read_jacobian(const codec_scene *scene, const char *text, size_t size) {
    jacobian_request request = {.n_by = 0};
    problem why = {0};
    if (codec_read_jacobian_json(scene, text, size, &request, &why)) {
        FUZZ_CHECK(request.n_by > 0 && request.n_by <= JACOBIAN_KINDS && jacobian_rows(&request) > 0);
        FUZZ_CHECK(request.kind != JACOBIAN_AT_SENSORS ||
                   (scene->sensors != NULL && request.of.reduce.n_names > 0));
        for (size_t k = 0; k < request.of.n_selected; k++) FUZZ_CHECK(request.of.selected[k] < scene->n);
        for (size_t k = 0; k < request.of.n_receivers; k++)
            FUZZ_CHECK(request.of.receivers[k] < FUZZ_SENSORS);
    } else {
        fuzz_check_problem(&why);
    }
    jacobian_request_free(&request);
}

/* The last byte says what scene it is. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size == 0) return 0;
    group_index groups = {0};
    const codec_scene scene = fuzz_scene(data[size - 1], &groups);
    const size_t values = scene.n_channels * scene.n;
    char *text = fuzz_text(data, size);
    for (int npy = 0; npy < 2; npy++) {
        adjoint_request request = {.n_named = 0};
        problem why = {0};
        if (npy == 0 ? codec_read_adjoint_json(&scene, text, size, &request, &why)
                     : codec_read_adjoint_npy(&scene, text, size, &request, &why)) {
            const size_t n_rhs = request.cotangent.n_rhs;
            FUZZ_CHECK(n_rhs > 0 && (n_rhs == 1 || request.cotangent.batch) && request.light.n_rhs <= 1 &&
                       request.wanted != 0);
            for (size_t i = 0; i < n_rhs * values; i++) FUZZ_CHECK(fabsf(request.cotangent.E[i]) <= FLT_MAX);
            const side_rows *sensors = &request.cotangent.sensors;
            FUZZ_CHECK(sensors->n == (request.cotangent.at_sensors ? n_rhs : 0));
            for (size_t i = 0; i < sensors->n * scene.n_channels * FUZZ_SENSORS; i++)
                FUZZ_CHECK(fabsf(sensors->values[i]) <= FLT_MAX);
            /* Light that no gradient wants stays as it was written. */
            const bool lit = request.light.n_rhs == 1 && adjoint_wants(&request, GRADIENT_REFLECTANCE);
            for (size_t i = 0; i < values && lit; i++)
                FUZZ_CHECK(request.light.E[i] >= 0 && request.light.E[i] <= FLT_MAX);
        } else {
            fuzz_check_problem(&why);
        }
        adjoint_request_free(&request);
    }
    read_jacobian(&scene, text, size);
    group_index_free(&groups);
    free(text);
    return 0;
}
