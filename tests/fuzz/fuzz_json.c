/* JSON of clients and of files of emissions: any text ends in a request that is in range, or in one problem.
 */
#include "fuzz/fuzz.h"
#include "solver/codec/answer.h"

#include <float.h>

/* Vectors that were read can be written. */
static void write_back(const codec_scene *scene, const radiosity_request *request, const char *name) {
    const answer_shape about = {.n = scene->n,
                                .n_channels = scene->n_channels,
                                .n_rhs = request->n_rhs,
                                .batch = request->batch,
                                .n_values = scene->n};
    const media_accept as = {.type = MEDIA_JSON};
    const answer_notes notes = {.scene = name, .quantity = request->quantity};
    buffer b = {0};
    problem why = {0};
    FUZZ_CHECK(answer_begin(&b, &about, &as, &notes, &why) &&
               answer_add(&b, &about, &as, 0, request->n_rhs, request->E, &why) &&
               answer_end(&b, &about, &as, &notes, &why));
    buffer_free(&b);
}

/* Each vector has its dimmers, or none has any. */
static void check_luminaires(const codec_scene *scene, const radiosity_request *request) {
    const side_rows *side = &request->luminaires;
    FUZZ_CHECK(side->values == NULL || (side->n == request->n_rhs && scene->n_emitters == 0));
    for (size_t i = 0; i < side->n * scene->n_channels * scene->n_luminaires; i++)
        FUZZ_CHECK(side->values[i] >= 0 && side->values[i] <= FLT_MAX);
}

/* Figures or numbers of sensors are gathered from radiosities of all elements. */
static void check_sensors(const codec_scene *scene, const radiosity_request *request) {
    const reduce_request *r = &request->reduce;
    FUZZ_CHECK(request->n_receivers == 0 || request->at_sensors);
    FUZZ_CHECK(r->n_with <= REDUCE_FIGURES_MAX);
    if (!request->at_sensors) return;
    FUZZ_CHECK(scene->sensors != NULL && !request->select && request->quantity == LAM_RADIOSITY);
    FUZZ_CHECK(scene->no_sensors == NULL && r->of_sensors && !(r->linear && request->n_suns > 0));
    for (size_t k = 0; k < request->n_receivers; k++) FUZZ_CHECK(request->receivers[k] < FUZZ_SENSORS);
    double *figures = reduce_figures(r, request->n_rhs, scene->n_channels);
    float *x = calloc(request->n_rhs * scene->n_channels, FUZZ_SENSORS * sizeof *x);
    FUZZ_CHECK(figures != NULL && x != NULL);
    FUZZ_CHECK(!r->on ||
               reduce_vectors(r, scene->sensors, NULL, scene->n_channels, request->n_rhs, 0, request->n_rhs,
                              (reduce_values){.floats = x, .whole = true}, figures));
    buffer b = {0};
    FUZZ_CHECK(reduce_write(r, scene->n_channels, request->n_rhs, request->batch, figures, &b));
    buffer_free(&b);
    free(figures);
    free(x);
}

/* The text as a file of emissions: every vector is then dense. */
static void read_file(const codec_scene *scene, const char *text, size_t size) {
    codec_scene about = *scene;
    radiosity_request request = {0};
    problem why = {0};
    about.only_linear = false;
    about.source = "the file";
    if (codec_read_emissions(&about, text, size, &request, &why)) {
        FUZZ_CHECK(request.n_rhs > 0 && request.n_rhs <= about.max_batch && request.n_dense == request.n_rhs);
        FUZZ_CHECK(!request.select && !request.reduce.on && request.tolerance == 0);
        check_luminaires(&about, &request);
        for (size_t i = 0; i < request.n_rhs * about.n_channels * about.n; i++)
            FUZZ_CHECK(request.E[i] >= 0 && request.E[i] <= FLT_MAX);
    } else {
        fuzz_check_problem(&why);
    }
    radiosity_request_free(&request);
}

/* The last byte, a blank as a rule, says what scene it is. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size == 0) return 0;
    group_index groups = {0};
    const codec_scene scene = fuzz_scene(data[size - 1], &groups);
    char *text = fuzz_text(data, size);
    radiosity_request request = {0};
    problem why = {0};
    if (codec_read_json(&scene, text, size, &request, &why)) {
        const size_t values = request.n_rhs * scene.n_channels * scene.n;
        FUZZ_CHECK(request.n_rhs > 0 && request.n_rhs <= scene.max_batch);
        FUZZ_CHECK(request.E != NULL || request.reduce.linear);
        for (size_t i = 0; i < values && request.E != NULL; i++)
            FUZZ_CHECK(request.E[i] >= 0 && request.E[i] <= FLT_MAX);
        for (size_t k = 0; k < request.n_spots; k++)
            FUZZ_CHECK(request.spots[k].vector < request.n_rhs &&
                       request.spots[k].where < (request.spots[k].whole_group ? groups.n_groups : scene.n));
        for (size_t k = 0; k < request.n_selected; k++) FUZZ_CHECK(request.selected[k] < scene.n);
        FUZZ_CHECK(!request.at_faces || (scene.faces != NULL && !request.reduce.on));
        for (size_t k = 0; k < request.n_faces; k++) FUZZ_CHECK(request.faces[k] < scene.faces->n_faces);
        check_luminaires(&scene, &request);
        check_sensors(&scene, &request);
        if (request.E != NULL) write_back(&scene, &request, text);
    } else {
        fuzz_check_problem(&why);
    }
    radiosity_request_free(&request);
    read_file(&scene, text, size);
    group_index_free(&groups);
    free(text);
    return 0;
}
