/* The JSON reader against a published suite of cases, and requests that are cut, changed or hostile. */
#include "solver/codec/json_mark.h"
#include "solver/codec/json_reader.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <dirent.h>
#include <string.h>

enum { N = REQUEST_ELEMENTS, N_GROUPS = REQUEST_GROUPS };

typedef request_scene fixture;

static fixture make_scene(size_t n_channels) {
    static const uint32_t group[N] = {2, 0, 1, 3, 1};
    return request_scene_make(group, n_channels);
}

/* The status that a request of this text has: 0 when it is good. */
static unsigned status_of(fixture *f, const char *text, size_t length, radiosity_request *request) {
    radiosity_request own = {0};
    problem why;
    char *exact = request_text_exact(text, length);
    f->scene.groups = &f->groups;
    bool good = codec_read_json(&f->scene, exact, length, request == NULL ? &own : request, &why);
    ck_assert_int_eq(good, why.status == 0);
    ck_assert_msg(good || why.detail[0] != '\0', "a refusal without a word");
    ck_assert_uint_lt(strlen(why.pointer), sizeof why.pointer);
    radiosity_request_free(&own);
    free(exact);
    return why.status;
}

static bool is_json(const char *text, size_t length) {
    json_reader r;
    json_begin(&r, text, length);
    bool good = json_skip(&r) && json_finish(&r);
    json_end(&r);
    return good;
}

/* A byte order mark is passed over, once and at the start; UTF-16 and UTF-32 are named. */
START_TEST(byte_order_marks) {
    static const char marked[] = "\xEF\xBB\xBF{\"emission\":[1,2,3,4,5]}", wide[] = "{\0\"\0e\0",
                      big[] = "\0{\0\"\0e";
    fixture f = make_scene(1);
    radiosity_request request = {0};
    ck_assert_uint_eq(status_of(&f, marked, sizeof marked - 1, &request), 0);
    ck_assert(request.n_rhs == 1 && request.E[4] == 5);
    radiosity_request_free(&request);
    ck_assert(!is_json(marked + 1, sizeof marked - 2) && !is_json(marked, 3));
    ck_assert(!is_json("\xEF\xBB\xBF\xEF\xBB\xBF{}", 8) && !is_json("[\xEF\xBB\xBF]", 5));
    const struct {
        const char *text;
        size_t length;
    } others[] = {{wide, 6},     {big, 6}, {"\xFF\xFE{\0", 4}, {"\xFE\xFF\0{", 4}, {"\xFF\xFE\0\0{\0\0\0", 8},
                  {"{\0\0\0", 4}};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        const char *fault = NULL;
        ck_assert_uint_eq(json_mark_length(others[i].text, others[i].length, &fault), 0);
        ck_assert(fault != NULL && strstr(fault, "UTF-16") != NULL);
        ck_assert_uint_eq(status_of(&f, others[i].text, others[i].length, NULL), 400);
    }
    const char *fault = NULL;
    ck_assert(json_mark_length("{}", 2, &fault) == 0 && json_mark_length("", 0, &fault) == 0 &&
              fault == NULL);
    group_index_free(&f.groups);
}
END_TEST

START_TEST(tolerances) {
    static const struct {
        const char *text;
        unsigned status;
        double value;
    } cases[] = {{"1e-4", 0, 1e-4},    {"0.9999999", 0, .9999999}, {"5e-324", 0, 5e-324}, {"1", 422, 0},
                 {"0", 422, 0},        {"-1e-4", 422, 0},          {"1e400", 422, 0},     {"1e-400", 422, 0},
                 {"\"1e-4\"", 422, 0}, {"null", 422, 0},           {"[0.1]", 422, 0},     {"NaN", 400, 0}};
    fixture f = make_scene(1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[96];
        radiosity_request request = {0};
        const int length =
            snprintf(text, sizeof text, "{\"tolerance\":%s,\"emission\":[1,2,3,4,5]}", cases[i].text);
        ck_assert_msg(status_of(&f, text, (size_t)length, &request) == cases[i].status, "%s", text);
        if (cases[i].status == 0) ck_assert(request.tolerance == cases[i].value && request.n_rhs == 1);
        radiosity_request_free(&request);
    }
    group_index_free(&f.groups);
}
END_TEST

START_TEST(published_cases) {
    fixture f = make_scene(1);
    size_t accepted = 0, rejected = 0;
    DIR *folder = opendir(FIXTURES "/json");
    ck_assert_ptr_nonnull(folder);
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        char path[512], text[65536];
        const char *name = entry->d_name;
        if (strncmp(name, "y_", 2) != 0 && strncmp(name, "n_", 2) != 0) continue;
        snprintf(path, sizeof path, FIXTURES "/json/%s", name);
        FILE *file = fopen(path, "rb");
        ck_assert_ptr_nonnull(file);
        size_t length = fread(text, 1, sizeof text - 1, file);
        ck_assert_msg(feof(file), "%s is longer than this test allows", name);
        fclose(file);
        text[length] = '\0';
        bool good = is_json(text, length);
        ck_assert_msg(good == (name[0] == 'y'), "%s: %s", name, good ? "accepted" : "rejected");
        /* None of them is a request. */
        ck_assert_msg(status_of(&f, text, length, NULL) == (good ? 422u : 400u), "%s", name);
        accepted += good;
        rejected += !good;
    }
    closedir(folder);
    ck_assert_uint_eq(accepted, 41);
    ck_assert_uint_eq(rejected, 80);
    group_index_free(&f.groups);
}
END_TEST

static const char *const good_requests[] = {
    "{\"emission\":[1,2.5,3e0,0.25,5]}",
    " { \"emission\" : [ [1,2,3,4,5 ] ] , \"quantity\" : \"indirect\" } \n",
    "{\"emission\":{\"elements\":[4,0],\"values\":[1,[2]]},\"select\":{\"elements\":[3,1,3]}}",
    "{\"select\":{\"groups\":[\"box\",\"l\\u0061mp\"]},\"emission\":{\"groups\":{\"wall\":7,\"box\":0.5}}}",
    ("{\"emissions\":[[1,2,3,4,5],{\"groups\":{\"lamp\":1}},{\"elements\":[],\"values\":[]}],"
     "\"quantity\":\"irradiance\"}"),
};
#define N_GOOD (sizeof good_requests / sizeof good_requests[0])

/* Skies of three tiles; in a batch a vector without one is under a dark one, wherever it stands. */
START_TEST(skies_are_read) {
    static const char one[] = "{\"emission\":{\"sky\":[1,[2],3],\"groups\":{\"lamp\":5}}}";
    static const char three[] = "{\"emission\":{\"sky\":[1,[2,3,4],5]}}";
    static const char many[] = "{\"emissions\":[[1,2,3,4,5],{\"groups\":{}},{\"sky\":[1,2,3]},[1,2,3,4,5],"
                               "{\"elements\":[1],\"sky\":[4,5,6],\"values\":[2]},[1,2,3,4,5]]}";
    static const char coloured[] = "{\"emission\":{\"sky\":[1,[2,3,4],[3e38,3e38,2.9e38]]}}";
    static const char alike[] = "{\"emission\":{\"sky\":[[0.1,0.1,0.1],[2],3]}}";
    fixture grey = make_scene(1), colour = make_scene(3);
    radiosity_request request = {0};
    ck_assert_uint_eq(status_of(&grey, one, strlen(one), &request), 0);
    ck_assert_mem_eq(request.sky.values, ((float[]){1, 2, 3}), 3 * sizeof(float));
    ck_assert_mem_eq(request.E, ((float[N]){0, 5}), N * sizeof(float));
    radiosity_request_free(&request);
    ck_assert_uint_eq(status_of(&colour, three, strlen(three), &request), 0);
    ck_assert_mem_eq(request.sky.values, ((float[]){1, 2, 5, 1, 3, 5, 1, 4, 5}), 9 * sizeof(float));
    radiosity_request_free(&request);
    ck_assert_uint_eq(status_of(&grey, many, strlen(many), &request), 0);
    ck_assert_uint_eq(request.n_rhs, 6);
    ck_assert_mem_eq(request.sky.values, ((float[18]){[6] = 1, 2, 3, [12] = 4, 5, 6}), 18 * sizeof(float));
    radiosity_request_free(&request);
    ck_assert(!request.by_luminance);
    /* A store of one channel takes a colour by its luminance, and equal numbers as they are. */
    ck_assert_uint_eq(status_of(&grey, coloured, strlen(coloured), &request), 0);
    ck_assert(request.by_luminance);
    ck_assert_float_eq(request.sky.values[0], 1);
    ck_assert_float_eq_tol(request.sky.values[1], .265f * 2 + .67f * 3 + .065f * 4, 1e-6f);
    ck_assert_float_eq_tol(request.sky.values[2], 2.9935e38f, 1e33f);
    radiosity_request_free(&request);
    ck_assert_uint_eq(status_of(&grey, alike, strlen(alike), &request), 0);
    ck_assert(!request.by_luminance);
    ck_assert_mem_eq(request.sky.values, ((float[]){.1f, 2, 3}), 3 * sizeof(float));
    radiosity_request_free(&request);
    ck_assert_uint_eq(status_of(&grey, "{\"emission\":[1,2,3,4,5]}", 24, &request), 0);
    ck_assert_ptr_null(request.sky.values);
    radiosity_request_free(&request);
    /* Skies count for what a request may hold. */
    grey.scene.n_tiles = 300;
    char text[2400], *end = text;
    end += sprintf(end, "{\"emissions\":[");
    for (int v = 0; v < 3; v++, *end++ = v < 3 ? ',' : ']') {
        end += sprintf(end, "{\"sky\":[0");
        for (int t = 1; t < 300; t++) end += sprintf(end, ",0");
        end += sprintf(end, "]}");
    }
    *end++ = '}';
    ck_assert_uint_eq(status_of(&grey, text, (size_t)(end - text), NULL), 0);
    grey.scene.max_bytes = 3000;
    ck_assert_uint_eq(status_of(&grey, text, (size_t)(end - text), NULL), 422);
    group_index_free(&grey.groups);
    group_index_free(&colour.groups);
}
END_TEST

START_TEST(good_requests_are_read) {
    fixture f = make_scene(1);
    static const float wanted[N_GOOD][N] = {
        {1, 2.5f, 3, .25f, 5}, {1, 2, 3, 4, 5}, {2, 0, 0, 0, 1}, {7, 0, .5f, .5f, .5f}, {1, 2, 3, 4, 5}};
    static const lam_quantity quantities[N_GOOD] = {LAM_RADIOSITY, LAM_INDIRECT, LAM_RADIOSITY, LAM_RADIOSITY,
                                                    LAM_IRRADIANCE};
    for (size_t i = 0; i < N_GOOD; i++) {
        radiosity_request request = {0};
        ck_assert_uint_eq(status_of(&f, good_requests[i], strlen(good_requests[i]), &request), 0);
        ck_assert_int_eq(memcmp(request.E, wanted[i], sizeof wanted[i]), 0);
        ck_assert_int_eq(request.quantity, quantities[i]);
        ck_assert_int_eq(request.batch, i == 4);
        ck_assert_uint_eq(request.n_rhs, i == 4 ? 3 : 1);
        if (i == 2) {
            ck_assert_uint_eq(request.n_selected, 3);
            ck_assert_uint_eq(request.selected[0], 3);
            ck_assert_uint_eq(request.selected[1], 1);
        } else if (i == 3) {
            /* box.blue comes before box.red by name. */
            static const uint32_t selected[] = {3, 2, 4, 1};
            ck_assert_uint_eq(request.n_selected, 4);
            ck_assert_int_eq(memcmp(request.selected, selected, sizeof selected), 0);
        } else {
            ck_assert(!request.select);
        }
        radiosity_request_free(&request);
    }
    group_index_free(&f.groups);
}
END_TEST

/* A flux is spread over the elements of its group; the answer's unit scales all light, which is linear. */
START_TEST(units_are_read) {
    static const double area[N] = {9, .5, 1, 9, 3};
    static const char flux[] = "{\"emission\":{\"groups\":{\"lamp\":\"358lm\",\"box\":\"26W\"}}}";
    static const char lit[] = "{\"unit\":\"klx\",\"emission\":{\"groups\":{\"lamp\":2},\"sky\":[1,2,3]}}";
    static const char both[] =
        "{\"emission\":{\"groups\":{\"lamp\":2},\"sky\":[1,2,3]},\"photometric\":true}";
    static const char colour[] = "{\"unit\":\"fc\",\"emission\":{\"groups\":{\"box.red\":\"4,8,12W\"}}}";
    static const char *const bad[] = {"{\"unit\":\"lux\",\"emission\":[1,2,3,4,5]}",
                                      "{\"unit\":1,\"emission\":[1,2,3,4,5]}",
                                      "{\"photometric\":true,\"emission\":[1,2,3,4,5]}",
                                      "{\"emission\":{\"groups\":{\"lamp\":\"3\"}}}",
                                      "{\"emission\":{\"groups\":{\"lamp\":\"3lux\"}}}",
                                      "{\"emission\":{\"groups\":{\"lamp\":\"-3lm\"}}}",
                                      "{\"emission\":{\"groups\":{\"lamp\":\"1,2lm\"}}}",
                                      "{\"emission\":{\"groups\":{\"lamp\":\"1e308lm\"}}}",
                                      "{\"emission\":{\"groups\":{\"lamp\":\"3\\u0000lm\"}}}",
                                      "{\"unit\":\"lx\",\"emission\":[3e38,2,3,4,5]}"};
    fixture f = make_scene(1), three = make_scene(3);
    radiosity_request request = {0};
    ck_assert_uint_eq(status_of(&f, flux, sizeof flux - 1, NULL), 422); /* the groups have no areas */
    ck_assert_int_eq(group_index_measure(&f.groups, area, NULL), LAM_OK);
    ck_assert_int_eq(group_index_measure(&three.groups, area, NULL), LAM_OK);
    ck_assert_uint_eq(status_of(&f, flux, sizeof flux - 1, &request), 0);
    ck_assert_float_eq_tol(request.E[1], 4, 1e-6f); /* 358 lm / .5 m2 / 179 lm/W */
    ck_assert_float_eq_tol(request.E[2], 2, 1e-6f);
    ck_assert_float_eq_tol(request.E[4], 2, 1e-6f);
    ck_assert(request.told.lights && request.told.from == LIGHT_RADIOMETRIC);
    radiosity_request_free(&request);
    ck_assert_uint_eq(status_of(&f, lit, sizeof lit - 1, &request), 0);
    ck_assert_float_eq_tol(request.E[1], .358f, 1e-6f);
    ck_assert_float_eq_tol(request.sky.values[2], .537f, 1e-6f);
    ck_assert(!request.told.lights && request.told.unit == ANSWER_KLX);
    radiosity_request_free(&request);
    ck_assert_uint_eq(status_of(&f, both, sizeof both - 1, &request), 0);
    ck_assert_float_eq_tol(request.E[1], 358, 1e-3f);
    ck_assert_float_eq(request.sky.values[2], 3);
    ck_assert(request.told.lights && request.told.from == LIGHT_PHOTOMETRIC);
    radiosity_request_free(&request);
    three.scene.lights = LIGHT_PHOTOMETRIC;
    ck_assert_uint_eq(status_of(&three, colour, sizeof colour - 1, &request), 0);
    for (int c = 0; c < 3; c++)
        ck_assert_float_eq_tol(request.E[c * N + 4], (float)((c + 1) * 179 * .3048 * .3048), 1e-4f);
    ck_assert(request.told.luminance && radiosity_request_channels(&request, 3) == 1);
    radiosity_request_free(&request);
    f.scene.signs = false;
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++)
        ck_assert_msg(status_of(&f, bad[k], strlen(bad[k]), NULL) == 422, "%s", bad[k]);
    group_index_free(&f.groups);
    group_index_free(&three.groups);
}
END_TEST

START_TEST(a_request_cut_anywhere_is_not_json) {
    fixture f = make_scene(1);
    for (size_t i = 0; i < N_GOOD; i++) {
        size_t length = strlen(good_requests[i]);
        while (good_requests[i][length - 1] != '}') length--;
        for (size_t cut = 0; cut < length; cut++)
            ck_assert_uint_eq(status_of(&f, good_requests[i], cut, NULL), 400);
    }
    group_index_free(&f.groups);
}
END_TEST

START_TEST(changed_requests_never_do_harm) {
    fixture f = make_scene(1);
    uint64_t state = 0x1234567;
    size_t counts[3] = {0};
    for (int round = 0; round < 200000; round++) {
        char text[256];
        const char *from = good_requests[request_text_random(&state) % N_GOOD];
        size_t length = strlen(from);
        memcpy(text, from, length + 1);
        request_text_change(text, length, &state);
        unsigned status = status_of(&f, text, length, NULL);
        ck_assert_msg(status == 0 || status == 400 || status == 422, "%u: %s", status, text);
        ck_assert_int_eq(status == 400, !is_json(text, length));
        counts[status == 0 ? 0 : status == 400 ? 1 : 2]++;
    }
    for (int i = 0; i < 3; i++) ck_assert_uint_gt(counts[i], 1000);
    group_index_free(&f.groups);
}
END_TEST

START_TEST(nesting_has_a_limit) {
    char text[4 * JSON_MAX_DEPTH + 8];
    for (size_t depth = 1; depth <= 2 * JSON_MAX_DEPTH; depth++) {
        memset(text, '[', depth);
        memset(text + depth, ']', depth);
        text[2 * depth] = '\0';
        ck_assert_int_eq(is_json(text, 2 * depth), depth <= JSON_MAX_DEPTH);
    }
}
END_TEST

START_TEST(texts_are_decoded) {
    static const struct {
        const char *json, *bytes;
        size_t length;
    } cases[] = {
        {"\"\"", "", 0},
        {"\"abc\"", "abc", 3},
        {"\"\\\"\\\\\\/\\b\\f\\n\\r\\t\"", "\"\\/\b\f\n\r\t", 8},
        {"\"\\u0041\\u00e9\\u20AC\\ud83d\\uDE00x\"", "A\xC3\xA9\xE2\x82\xAC\xF0\x9F\x98\x80x", 11},
        {"\"a\\u0000b\"", "a\0b", 3},
        {"\"\xC3\xA9\xF4\x8F\xBF\xBF\"", "\xC3\xA9\xF4\x8F\xBF\xBF", 6},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        json_reader r;
        json_slice text;
        json_begin(&r, cases[i].json, strlen(cases[i].json));
        ck_assert(json_read_text(&r, &text) && json_finish(&r));
        ck_assert_uint_eq(text.length, cases[i].length);
        ck_assert_int_eq(memcmp(text.bytes, cases[i].bytes, text.length), 0);
        json_end(&r);
    }
    static const char *const bad[] = {"\"\\ud800\"",
                                      "\"\\ud800x\"",
                                      "\"\\udc00\"",
                                      "\"\\ud800\\u0041\"",
                                      "\"\\u12g4\"",
                                      "\"\\x41\"",
                                      "\"\xC0\x80\"",
                                      "\"\xED\xA0\x80\"",
                                      "\"\xF4\x90\x80\x80\"",
                                      "\"\xE2\x82\"",
                                      "\"\n\"",
                                      "\"abc",
                                      "\"\\",
                                      "\"\\u00"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        ck_assert_msg(!is_json(bad[i], strlen(bad[i])), "%s", bad[i]);
}
END_TEST

START_TEST(limits_of_a_batch) {
    fixture f = make_scene(1);
    const char *three = "{\"emissions\":[{\"groups\":{}},{\"groups\":{}},{\"groups\":{}}]}";
    f.scene.max_batch = 3;
    f.scene.max_bytes = 3 * N * sizeof(float);
    ck_assert_uint_eq(status_of(&f, three, strlen(three), NULL), 0);
    f.scene.max_bytes--;
    ck_assert_uint_eq(status_of(&f, three, strlen(three), NULL), 422);
    f.scene.max_bytes++;
    f.scene.max_batch = 2;
    ck_assert_uint_eq(status_of(&f, three, strlen(three), NULL), 422);
    group_index_free(&f.groups);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("codec_json");
    TCase *tcase = tcase_create("codec_json");
    tcase_set_timeout(tcase, 300);
    tcase_add_test(tcase, published_cases);
    tcase_add_test(tcase, byte_order_marks);
    tcase_add_test(tcase, tolerances);
    tcase_add_test(tcase, good_requests_are_read);
    tcase_add_test(tcase, skies_are_read);
    tcase_add_test(tcase, units_are_read);
    tcase_add_test(tcase, a_request_cut_anywhere_is_not_json);
    tcase_add_test(tcase, changed_requests_never_do_harm);
    tcase_add_test(tcase, nesting_has_a_limit);
    tcase_add_test(tcase, texts_are_decoded);
    tcase_add_test(tcase, limits_of_a_batch);
    suite_add_tcase(suite, tcase);
    return suite_run(suite);
}
