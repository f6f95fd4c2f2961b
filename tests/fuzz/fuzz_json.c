/* What a client may send as JSON: whatever it is, it ends in a request that is in range or in one problem. */
#include "fuzz/fuzz.h"
#include "server/codec_answer.h"
#include "server/codec_request.h"

#include <float.h>

/* Scenes of some shapes; the last byte, a blank as a rule, says which. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *names[] = {"lamp", "wall", "wall.red", "\xc3\xa9t\xc3\xa9"};
    static const uint32_t group_of[] = {0, 1, 2, 3, 1, 2, 3};
    enum { N = sizeof group_of / sizeof *group_of, GROUPS = sizeof names / sizeof *names };
    if (size == 0) return 0;
    const unsigned shape = data[size - 1];
    char *text = fuzz_text(data, size),
         **copies = malloc(GROUPS * (sizeof *copies + 16)); /* one block, as a store's names are */
    group_index groups = {0};
    lam_error error;
    FUZZ_CHECK(copies != NULL);
    for (int g = 0; g < GROUPS; g++) copies[g] = strcpy((char *)(copies + GROUPS) + 16 * g, names[g]);
    FUZZ_CHECK(group_index_make(N, group_of, GROUPS, copies, &groups, &error) == LAM_OK);
    const codec_scene scene = {.n = N,
                               .n_channels = shape & 1 ? 3 : 1,
                               .groups = &groups,
                               .n_tiles = shape & 2 ? 5 : 0,
                               .n_emitters = shape & 4 ? 3 : 0,
                               .max_batch = 4,
                               .max_bytes = 1 << 20};
    radiosity_request request = {0};
    problem why = {0};
    if (codec_read_json(&scene, text, size, &request, &why)) {
        const size_t values = request.n_rhs * scene.n_channels * scene.n;
        FUZZ_CHECK(request.n_rhs > 0 && request.n_rhs <= scene.max_batch);
        for (size_t i = 0; i < values; i++) FUZZ_CHECK(request.E[i] >= 0 && request.E[i] <= FLT_MAX);
        for (size_t k = 0; k < request.n_selected; k++) FUZZ_CHECK(request.selected[k] < scene.n);
        /* What was read can be written. */
        const answer_shape about = {.n = scene.n,
                                    .n_channels = scene.n_channels,
                                    .n_rhs = request.n_rhs,
                                    .batch = request.batch,
                                    .n_values = scene.n};
        const media_accept as = {.type = MEDIA_JSON};
        const answer_notes notes = {.scene = text, .quantity = request.quantity};
        buffer b = {0};
        FUZZ_CHECK(answer_begin(&b, &about, &as, &notes, &why) &&
                   answer_add(&b, &about, &as, 0, request.n_rhs, request.E, &why) &&
                   answer_end(&b, &about, &as, &notes, &why));
        buffer_free(&b);
    } else {
        fuzz_check_problem(&why);
    }
    radiosity_request_free(&request);
    group_index_free(&groups);
    free(text);
    return 0;
}
