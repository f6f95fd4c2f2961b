/* Requests for skies as a client may send them. */
#include "fuzz/fuzz.h"
#include "solver/codec/sky_request.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const codec_scene scene = {.n = 1, .n_channels = 1};
    sky_request *skies = malloc(SKY_REQUEST_MOST * sizeof *skies);
    char *text = fuzz_text(data, size);
    size_t n = 0;
    problem why = {0};
    if (skies != NULL && codec_read_skies_json(&scene, text, size, skies, &n, &why)) {
        FUZZ_CHECK(n >= 1 && n <= SKY_REQUEST_MOST);
        for (size_t k = 0; k < n; k++) FUZZ_CHECK(!isinf(skies[k].diffuse) && !isinf(skies[k].hour));
    } else if (skies != NULL) {
        fuzz_check_problem(&why);
    }
    free(skies);
    free(text);
    return 0;
}
