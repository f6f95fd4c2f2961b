/* Adjoint requests as a client may send them. */
#include "fuzz/fuzz.h"
#include "solver/codec/adjoint.h"

#include <float.h>
#include <math.h>

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
            FUZZ_CHECK(request.cotangent.n_rhs == 1 && request.light.n_rhs <= 1 && request.wanted != 0);
            for (size_t i = 0; i < values; i++) FUZZ_CHECK(fabsf(request.cotangent.E[i]) <= FLT_MAX);
            /* Light that no gradient wants stays as it was written. */
            const bool lit = request.light.n_rhs == 1 && adjoint_wants(&request, GRADIENT_REFLECTANCE);
            for (size_t i = 0; i < values && lit; i++)
                FUZZ_CHECK(request.light.E[i] >= 0 && request.light.E[i] <= FLT_MAX);
        } else {
            fuzz_check_problem(&why);
        }
        adjoint_request_free(&request);
    }
    group_index_free(&groups);
    free(text);
    return 0;
}
