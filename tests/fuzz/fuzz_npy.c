/* NPY arrays as a client may send them. */
#include "fuzz/fuzz.h"
#include "solver/codec/request.h"

#include <float.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size == 0) return 0;
    const codec_scene scene = {
        .n = 5, .n_channels = data[size - 1] & 1 ? 3 : 1, .max_batch = 4, .max_bytes = 1 << 20};
    char *bytes = fuzz_text(data, size);
    radiosity_request request = {0};
    problem why = {0};
    if (codec_read_npy(&scene, bytes, size, &request, &why)) {
        const size_t values = request.n_rhs * scene.n_channels * scene.n;
        FUZZ_CHECK(request.n_rhs > 0 && request.n_rhs <= scene.max_batch);
        for (size_t i = 0; i < values; i++) FUZZ_CHECK(request.E[i] >= 0 && request.E[i] <= FLT_MAX);
    } else {
        fuzz_check_problem(&why);
    }
    radiosity_request_free(&request);
    free(bytes);
    return 0;
}
