/* Requests that ask for figures of groups, and adjoint requests: what is read, what stays sparse, what is
 * refused; cut and changed ones do no harm. The members that both share with others: test_codec_json.c. */
#include "solver/codec/adjoint.h"
#include "solver/codec/json_reader.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <string.h>

enum { N = REQUEST_ELEMENTS, C_MAX = 3 };

typedef request_scene fixture;

/* Elements 1 and 4 are box.red (group 1), 3 box.blue (group 3), 2 lamp (group 0), 0 wall (group 2). */
static fixture make_scene(size_t n_channels) {
    static const uint32_t group[N] = {2, 1, 0, 3, 1};
    fixture f = request_scene_make(group, n_channels);
    f.scene.max_rows = 2;
    return f;
}

static unsigned read_radiosity_of(fixture *f, const char *text, size_t length, radiosity_request *request) {
    problem why;
    char *exact = request_text_exact(text, length);
    f->scene.groups = &f->groups;
    const bool good = codec_read_json(&f->scene, exact, length, request, &why);
    ck_assert_int_eq(good, why.status == 0);
    free(exact);
    return why.status;
}

static unsigned read_radiosity(fixture *f, const char *text, radiosity_request *request) {
    return read_radiosity_of(f, text, strlen(text), request);
}

static unsigned read_adjoint(fixture *f, const char *text, size_t length, adjoint_request *request) {
    problem why;
    char *exact = request_text_exact(text, length);
    f->scene.groups = &f->groups;
    const bool good = codec_read_adjoint_json(&f->scene, exact, length, request, &why);
    ck_assert_int_eq(good, why.status == 0);
    ck_assert(good || why.detail[0] != '\0');
    free(exact);
    return why.status;
}

/* A linear reduction leaves sparse vectors as they were said, in whatever order the members come. */
START_TEST(linear_reductions_stay_sparse) {
    static const char *const texts[] = {
        "{\"emissions\":[{\"groups\":{\"box\":[1,2,3],\"lamp\":4}},{\"elements\":[3],\"values\":[5]}],"
        "\"reduce\":{\"groups\":[\"wall\"],\"with\":[\"sum\",\"mean\"]}}",
        "{\"reduce\":{\"with\":[\"sum\",\"mean\"],\"groups\":[\"wall\"]},"
        "\"emissions\":[{\"groups\":{\"box\":[1,2,3],\"lamp\":4}},{\"values\":[5],\"elements\":[3]}]}"};
    fixture f = make_scene(3);
    for (size_t t = 0; t < 2; t++) {
        radiosity_request request = {0};
        ck_assert_uint_eq(read_radiosity(&f, texts[t], &request), 0);
        ck_assert(request.reduce.on && request.reduce.linear && !request.select);
        ck_assert_ptr_null(request.E);
        ck_assert_uint_eq(request.n_spots, 4);
        /* box.blue comes before box.red by name. */
        static const emission_spot wanted[] = {
            {0, 3, true, 0}, {0, 1, true, 0}, {0, 0, true, 0}, {1, 3, false, 0}};
        static const float colours[] = {1, 2, 3, 1, 2, 3, 4, 4, 4, 5, 5, 5};
        for (size_t k = 0; k < 4; k++) {
            ck_assert_uint_eq(request.spots[k].vector, wanted[k].vector);
            ck_assert_uint_eq(request.spots[k].where, wanted[k].where);
            ck_assert(request.spots[k].whole_group == wanted[k].whole_group);
        }
        ck_assert_mem_eq(request.colours, colours, sizeof colours);
        ck_assert_uint_eq(request.reduce.n_with, 2);
        ck_assert_int_eq(request.reduce.with[0], REDUCE_SUM);
        /* Expanded, they are what they always were. */
        problem why = {0};
        ck_assert(radiosity_request_expand(&request, &f.scene, &why));
        static const float E[2 * 3 * N] = {0, 1, 4, 1, 1, 0, 2, 4, 2, 2, 0, 3, 4, 3, 3,
                                           0, 0, 0, 5, 0, 0, 0, 0, 5, 0, 0, 0, 0, 5, 0};
        ck_assert_mem_eq(request.E, E, sizeof E);
        radiosity_request_free(&request);
    }
    group_index_free(&f.groups);
}
END_TEST

/* Any other has its elements selected, and its vectors whole: other figures, more groups than rows, a dense
 * vector in the batch (whole, but linear). */
START_TEST(others_are_selected) {
    fixture f = make_scene(1);
    radiosity_request request = {0};
    ck_assert_uint_eq(
        read_radiosity(&f,
                       "{\"emission\":{\"groups\":{\"lamp\":2}},\"reduce\":{\"groups\":[\"box.red\",\"wall\","
                       "\"box\"],\"with\":[\"mean\",\"max\"]}}",
                       &request),
        0);
    ck_assert(!request.reduce.linear && request.select);
    ck_assert_mem_eq(request.E, ((float[N]){0, 0, 2}), N * sizeof(float));
    /* Elements of box.red appear once. */
    ck_assert_uint_eq(request.n_selected, 4);
    ck_assert_mem_eq(request.selected, ((uint32_t[]){1, 4, 0, 3}), 4 * sizeof(uint32_t));
    radiosity_request_free(&request);
    ck_assert_uint_eq(
        read_radiosity(&f,
                       "{\"emission\":{\"groups\":{\"lamp\":2}},\"reduce\":{\"groups\":[\"lamp\","
                       "\"wall\",\"box\"],\"with\":[\"mean\"]}}",
                       &request),
        0);
    ck_assert(!request.reduce.linear && request.select && request.E != NULL);
    radiosity_request_free(&request);
    ck_assert_uint_eq(read_radiosity(&f,
                                     "{\"emissions\":[{\"elements\":[1],\"values\":[3]},[1,2,3,4,5],"
                                     "{\"groups\":{\"wall\":6}}],\"reduce\":{\"groups\":[\"lamp\"],\"with\":["
                                     "\"mean\"]}}",
                                     &request),
                      0);
    ck_assert(request.reduce.linear && !request.select);
    ck_assert_uint_eq(request.n_spots, 0);
    ck_assert_mem_eq(request.E, ((float[3 *N]){0, 3, 0, 0, 0, 1, 2, 3, 4, 5, 6}), 3 * N * sizeof(float));
    radiosity_request_free(&request);
    group_index_free(&f.groups);
}
END_TEST

/* A billion elements in 4096 bytes: nothing is as long as a vector. */
START_TEST(linear_reductions_cost_what_they_name) {
    fixture f = make_scene(3);
    f.scene.n = (size_t)1 << 30;
    radiosity_request request = {0};
    ck_assert_uint_eq(read_radiosity(&f,
                                     "{\"emission\":{\"elements\":[1000000000,3],\"values\":[1,[2,3,4]],"
                                     "\"sky\":[1,2,3]},\"reduce\":{\"groups\":[\"wall\"],\"with\":["
                                     "\"sum\"]}}",
                                     &request),
                      0);
    ck_assert_ptr_null(request.E);
    ck_assert_uint_eq(request.spots[0].where, 1000000000);
    radiosity_request_free(&request);
    ck_assert_uint_eq(
        read_radiosity(&f, "{\"emission\":{\"elements\":[1000000000],\"values\":[1]}}", &request), 422);
    radiosity_request_free(&request);
    /* A request that is no linear reduction of sparse vectors is not even tried where nothing else is wanted.
     */
    static const char *const others[] = {
        "{\"emission\":[1", "{\"select\":{\"groups\":[\"wall\"]},\"emission\":{\"groups\":{}}}",
        "{\"emission\":{\"groups\":{}},\"reduce\":{\"groups\":[\"wall\"],\"with\":[\"max\"]}}",
        "{\"emission\":{\"groups\":{}}}"};
    f.scene.only_linear = true;
    for (size_t i = 0; i < 4; i++) {
        ck_assert_uint_eq(read_radiosity(&f, others[i], &request), 503);
        ck_assert(request.E == NULL && request.selected == NULL);
        radiosity_request_free(&request);
    }
    group_index_free(&f.groups);
}
END_TEST

/* However short the text: what its spots take has a limit. */
START_TEST(spots_have_a_limit) {
    fixture f = make_scene(1);
    static const char text[] = "{\"emissions\":[{\"groups\":{\"box\":1,\"lamp\":1,\"wall\":2}},"
                               "{\"groups\":{\"box\":1,\"lamp\":1,\"wall\":2}},{\"elements\":[0,1,2,3,4],"
                               "\"values\":[1,1,1,1,1]},{\"elements\":[0,1,2,3,4],\"values\":[1,1,1,1,1]}],"
                               "\"reduce\":{\"groups\":[\"wall\"],\"with\":[\"mean\"]}}";
    radiosity_request request = {0};
    ck_assert_uint_eq(read_radiosity(&f, text, &request), 0);
    ck_assert_uint_eq(request.n_spots, 18);
    radiosity_request_free(&request);
    f.scene.max_bytes = 17 * (sizeof(emission_spot) + sizeof(float));
    ck_assert_uint_eq(read_radiosity(&f, text, &request), 422);
    radiosity_request_free(&request);
    group_index_free(&f.groups);
}
END_TEST

static const char *const good_requests[] = {
    "{\"cotangent\":[1,-2.5,3,0,5]}",
    "{\"gradient\":[\"reflectance\"],\"emission\":{\"sky\":[1,2,3]},\"quantity\":\"indirect\","
    "\"cotangent\":{\"elements\":[3],\"values\":[-1]}}",
    ("{\"cotangent\":{\"groups\":{\"box\":-2}},\"gradient\":[\"emission\",\"reflectance\"],"
     "\"emission\":{\"elements\":[1],\"values\":[2]}}"),
    "{\"cotangent\":[[1,2,3,4,5]],\"gradient\":[\"sky\"],\"quantity\":\"irradiance\"}",
    "{\"cotangent\":[0,0,1,0,0],\"gradient\":[\"groups\"]}",
};
#define N_GOOD (sizeof good_requests / sizeof good_requests[0])

START_TEST(good_requests_are_read) {
    static const float g[N_GOOD][N] = {
        {1, -2.5f, 3, 0, 5}, {0, 0, 0, -1, 0}, {0, -2, 0, -2, -2}, {1, 2, 3, 4, 5}, {0, 0, 1, 0, 0}};
    static const unsigned wanted[N_GOOD] = {
        1u << GRADIENT_EMISSION | 1u << GRADIENT_SKY, 1u << GRADIENT_REFLECTANCE,
        1u << GRADIENT_EMISSION | 1u << GRADIENT_SKY | 1u << GRADIENT_REFLECTANCE, 1u << GRADIENT_SKY,
        1u << GRADIENT_GROUPS};
    static const lam_quantity quantities[N_GOOD] = {LAM_RADIOSITY, LAM_INDIRECT, LAM_RADIOSITY,
                                                    LAM_IRRADIANCE, LAM_RADIOSITY};
    fixture f = make_scene(1);
    for (size_t i = 0; i < N_GOOD; i++) {
        adjoint_request request = {0};
        ck_assert_uint_eq(read_adjoint(&f, good_requests[i], strlen(good_requests[i]), &request), 0);
        ck_assert_mem_eq(request.cotangent.E, g[i], sizeof g[i]);
        ck_assert_uint_eq(request.wanted, wanted[i]);
        ck_assert_int_eq(request.quantity, quantities[i]);
        if (i == 1) {
            ck_assert_mem_eq(request.light.sky.values, ((float[]){1, 2, 3}), 3 * sizeof(float));
            ck_assert_mem_eq(request.light.E, ((float[N]){0}), N * sizeof(float));
        } else if (i == 2) {
            ck_assert_mem_eq(request.light.E, ((float[N]){0, 2}), N * sizeof(float));
        }
        adjoint_request_free(&request);
    }
    /* A store of emitters: theirs in place of all others. */
    f.scene.n_emitters = 2;
    adjoint_request request = {0};
    ck_assert_uint_eq(read_adjoint(&f, good_requests[0], strlen(good_requests[0]), &request), 0);
    ck_assert_uint_eq(request.wanted, 1u << GRADIENT_EMITTERS);
    adjoint_request_free(&request);
    ck_assert_uint_eq(read_adjoint(&f, good_requests[1], strlen(good_requests[1]), &request), 422);
    adjoint_request_free(&request);
    group_index_free(&f.groups);
}
END_TEST

/* A batch of every shape; areas are 1, 2, 3, 4, 5 and element 4 is buried. */
START_TEST(batches_hold_figures_of_groups) {
    static const char text[] = "{\"cotangents\":[{\"groups\":{\"box\":{\"mean\":12},\"lamp\":{\"sum\":2}}},"
                               "[1,0,0,0,-1],{\"groups\":{\"wall\":3}}]}";
    static const float g[3][N] = {{0, 4, 6, 8, 0}, {1, 0, 0, 0, -1}, {3, 0, 0, 0, 0}};
    static const double area[N] = {1, 2, 3, 4, 5};
    fixture f = make_scene(1);
    lam_error error;
    f.groups.buried = calloc(N, sizeof *f.groups.buried);
    ck_assert_ptr_nonnull(f.groups.buried);
    f.groups.buried[4] = true;
    ck_assert_int_eq(group_index_measure(&f.groups, area, &error), LAM_OK);
    adjoint_request request = {0};
    ck_assert_uint_eq(read_adjoint(&f, text, strlen(text), &request), 422); /* areas are not known */
    adjoint_request_free(&request);
    f.scene.area = area;
    f.scene.max_batch = 3;
    ck_assert_uint_eq(read_adjoint(&f, text, strlen(text), &request), 0);
    ck_assert(request.cotangent.batch);
    ck_assert_uint_eq(request.cotangent.n_rhs, 3);
    ck_assert_mem_eq(request.cotangent.E, g, sizeof g);
    adjoint_request_free(&request);
    static const char large[] = "{\"cotangent\":{\"groups\":{\"box\":{\"sum\":3e38}}}}";
    ck_assert_uint_eq(read_adjoint(&f, large, strlen(large), &request), 422);
    adjoint_request_free(&request);
    group_index_free(&f.groups);
}
END_TEST

START_TEST(a_request_cut_anywhere_is_not_json) {
    fixture f = make_scene(1);
    for (size_t i = 0; i < N_GOOD; i++)
        for (size_t cut = 0; cut < strlen(good_requests[i]); cut++) {
            adjoint_request request = {0};
            ck_assert_uint_eq(read_adjoint(&f, good_requests[i], cut, &request), 400);
            adjoint_request_free(&request);
        }
    group_index_free(&f.groups);
}
END_TEST

START_TEST(changed_requests_never_do_harm) {
    static const char *const radiosities[] = {
        "{\"emission\":{\"groups\":{\"box\":1}},\"reduce\":{\"groups\":[\"box\",\"lamp\"],\"with\":[\"mean\"]"
        "}}",
        "{\"reduce\":{\"with\":[\"max\",\"sum\"],\"groups\":[\"wall\"]},\"emission\":{\"elements\":[1],"
        "\"values\":[2]}}"};
    fixture f = make_scene(1);
    uint64_t state = 0x7654321;
    size_t counts[3] = {0};
    for (int round = 0; round < 200000; round++) {
        char text[256];
        const size_t which = request_text_random(&state) % (N_GOOD + 2);
        const char *from = which < N_GOOD ? good_requests[which] : radiosities[which - N_GOOD];
        const size_t length = strlen(from);
        memcpy(text, from, length + 1);
        request_text_change(text, length, &state);
        adjoint_request adjoint = {0};
        radiosity_request radiosity = {0};
        const unsigned status = which < N_GOOD ? read_adjoint(&f, text, length, &adjoint)
                                               : read_radiosity_of(&f, text, length, &radiosity);
        ck_assert_msg(status == 0 || status == 400 || status == 422, "%u: %s", status, text);
        json_reader r;
        json_begin(&r, text, length);
        ck_assert_int_eq(status == 400, !(json_skip(&r) && json_finish(&r)));
        json_end(&r);
        counts[status == 0 ? 0 : status == 400 ? 1 : 2]++;
        adjoint_request_free(&adjoint);
        radiosity_request_free(&radiosity);
    }
    for (int i = 0; i < 3; i++) ck_assert_uint_gt(counts[i], 1000);
    group_index_free(&f.groups);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("codec_adjoint");
    TCase *tcase = tcase_create("codec_adjoint");
    tcase_set_timeout(tcase, 300);
    tcase_add_test(tcase, linear_reductions_stay_sparse);
    tcase_add_test(tcase, others_are_selected);
    tcase_add_test(tcase, linear_reductions_cost_what_they_name);
    tcase_add_test(tcase, spots_have_a_limit);
    tcase_add_test(tcase, good_requests_are_read);
    tcase_add_test(tcase, batches_hold_figures_of_groups);
    tcase_add_test(tcase, a_request_cut_anywhere_is_not_json);
    tcase_add_test(tcase, changed_requests_never_do_harm);
    suite_add_tcase(suite, tcase);
    return suite_run(suite);
}
