/* Means over faces of the scene file, and requests for them. */
#include "solver/codec/face_means.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { N = REQUEST_ELEMENTS, FRONTS = 4, FACES = 5 };
static const double area[N] = {2, 1, 3, .75, 2};

/* Elements 0 and 2 are of face 3, 1 of face 1; 3 is a part of faces 1 and 4, and 4 the back of 0. Faces 0 and
 * 2 have none. */
static face_index index_made(void) {
    face_index made;
    lam_error error;
    scene_faces faces = {.n_faces = FACES, .n_parts = 2};
    faces.of = malloc(N * sizeof *faces.of);
    memcpy(faces.of, (uint32_t[N]){3, 1, 3, SCENE_FACE_NONE, 3}, N * sizeof *faces.of);
    faces.parts = malloc(2 * sizeof *faces.parts);
    faces.parts[0] = (scene_face_part){3, 1, .25};
    faces.parts[1] = (scene_face_part){3, 4, .5};
    ck_ok(face_index_make(N, FRONTS, area, &faces, &made, &error));
    ck_assert_ptr_null(faces.of);
    return made;
}

START_TEST(faces_have_their_elements) {
    static const uint32_t start[FACES + 1] = {0, 0, 2, 2, 4, 5}, element[] = {1, 3, 0, 2, 3};
    static const double common[] = {1, .25, 2, 3, .5};
    face_index f = index_made();
    ck_assert_uint_eq(f.n_entries, 5);
    ck_assert_mem_eq(f.start, start, sizeof start);
    ck_assert_mem_eq(f.element, element, sizeof element);
    for (size_t e = 0; e < 5; e++) ck_assert_double_eq(f.area[e], common[e]);
    const uint32_t asked[] = {4, 0, 1};
    const face_choice some = {3, asked};
    uint32_t *elements = NULL;
    size_t count = 0;
    ck_assert(face_choice_elements(&f, &some, &elements, &count));
    ck_assert_uint_eq(count, 3);
    ck_assert_mem_eq(elements, ((uint32_t[]){3, 1, 3}), 3 * sizeof *elements);
    free(elements);
    uint32_t *faces = NULL;
    ck_assert(face_index_of(&f, 3, (uint32_t[]){4, 3, 0}, &faces, &count)); /* a back has none of its own */
    ck_assert_uint_eq(count, 3);
    ck_assert_mem_eq(faces, ((uint32_t[]){1, 3, 4}), 3 * sizeof *faces);
    free(faces);
    ck_assert(face_index_of(&f, 1, (uint32_t[]){4}, &faces, &count));
    ck_assert_uint_eq(count, 0);
    free(faces);
    face_index_free(&f);
    scene_faces none = {.n_faces = 0};
    lam_error error;
    ck_ok(face_index_make(N, FRONTS, area, &none, &f, &error));
    ck_assert_uint_eq(f.n_faces, 0);
}
END_TEST

START_TEST(means_are_by_area) {
    static const float x[2][N] = {{1, .3f, 6, 5, 1000}, {-1, 2e38f, FLT_MAX, -3, NAN}};
    face_index f = index_made();
    const face_choice all = {.n = FACES}, some = {3, (const uint32_t[]){4, 0, 1}};
    float out[2 * FACES], of_some[3];
    double wide[N], fine[FACES], rounding = 0;
    face_means_floats(&f, &all, 2, x[0], out);
    const double mixed = (1 * (double)x[0][1] + .25 * 5) / 1.25;
    ck_assert(isnan(out[0]) && isnan(out[2]));
    ck_assert_float_eq(out[1], (float)mixed);
    ck_assert_float_eq(out[3], (float)((2 * 1 + 3 * 6) / 5.));
    ck_assert_float_eq(out[4], 5);
    ck_assert_float_eq(out[FACES + 3], (float)((2 * -1. + 3 * (double)FLT_MAX) / 5));
    face_means_floats(&f, &some, 1, (const float[]){5, .3f, 5}, of_some);
    ck_assert_float_eq(of_some[0], out[4]);
    ck_assert(isnan(of_some[1]));
    ck_assert_float_eq(of_some[2], out[1]);
    for (size_t i = 0; i < N; i++) wide[i] = (double)x[0][i] / 3;
    face_means_doubles(&f, &all, 1, wide, fine, &rounding);
    ck_assert_double_eq(fine[4], wide[3]); /* of one element, bit for bit */
    ck_assert(rounding > 0 && rounding < 1e-14);
    ck_assert_double_le(fabs(fine[3] - (double)((2 * (long double)wide[0] + 3 * (long double)wide[2]) / 5)),
                        rounding);
    face_index_free(&f);
}
END_TEST

/* A value that is no number must not pass for a face without an element. */
START_TEST(values_that_are_no_numbers_are_infinite) {
    static const float bad[] = {NAN, INFINITY, -INFINITY};
    face_index f = index_made();
    const face_choice all = {.n = FACES};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++)
        for (uint32_t i = 0; i < FRONTS; i++) {
            float x[N] = {1, 1, 1, 1, 1}, out[FACES];
            x[i] = bad[k];
            face_means_floats(&f, &all, 1, x, out);
            ck_assert(isnan(out[0]) && isnan(out[2]));
            ck_assert(!isnan(out[1]) && !isnan(out[3]) && !isnan(out[4]));
            ck_assert(isinf(out[i == 1 ? 1 : i == 3 ? 4 : 3]));
        }
    face_index_free(&f);
}
END_TEST

typedef struct fixture {
    request_scene s;
    face_index faces;
} fixture;

/* Element i is of group (wall, lamp, box.red, box.red, box.blue)[i]: the last is a back. */
static void setup(fixture *f) {
    static const uint32_t group[N] = {2, 0, 1, 1, 3};
    f->s = request_scene_make(group, 1);
    f->s.scene.groups = &f->s.groups;
    f->faces = index_made();
    f->s.scene.faces = &f->faces;
}

static void teardown(fixture *f) {
    group_index_free(&f->s.groups);
    face_index_free(&f->faces);
}

static unsigned read_text(const fixture *f, const char *text, radiosity_request *request, problem *why) {
    char *exact = request_text_exact(text, strlen(text));
    codec_read_json(&f->s.scene, exact, strlen(text), request, why);
    free(exact);
    return why->status;
}

START_TEST(requests_ask_for_faces) {
    static const struct {
        const char *text;
        bool at_faces, select;
        size_t n_faces, n_selected;
        uint32_t faces[3], selected[5];
    } cases[] = {
        {"{\"emission\":[1,1,1,1,1]}", false, false, 0, 0, {0}, {0}},
        {"{\"emission\":[1,1,1,1,1],\"at\":\"elements\",\"select\":{\"groups\":[\"lamp\"]}}",
         false,
         true,
         0,
         1,
         {0},
         {1}},
        {"{\"at\":\"faces\",\"emission\":[1,1,1,1,1]}", true, false, 0, 0, {0}, {0}},
        {"{\"emission\":[1,1,1,1,1],\"select\":{\"faces\":[4,0,1]}}", true, true, 3, 3, {4, 0, 1}, {3, 1, 3}},
        {"{\"select\":{\"faces\":[]},\"emission\":[1,1,1,1,1],\"at\":\"faces\"}", true, true, 0, 0, {0}, {0}},
        {"{\"select\":{\"groups\":[\"wall\",\"lamp\"]},\"emission\":[1,1,1,1,1],\"at\":\"faces\"}",
         true,
         true,
         2,
         4,
         {3, 1},
         {0, 2, 1, 3}},
    };
    fixture f;
    setup(&f);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        radiosity_request request = {0};
        problem why;
        ck_assert_msg(read_text(&f, cases[k].text, &request, &why) == 0, "%s: %s", cases[k].text, why.detail);
        ck_assert_int_eq(request.at_faces, cases[k].at_faces);
        ck_assert_int_eq(request.select, cases[k].select);
        ck_assert_uint_eq(request.n_faces, cases[k].n_faces);
        ck_assert_uint_eq(request.n_selected, cases[k].n_selected);
        for (size_t i = 0; i < request.n_faces; i++) ck_assert_uint_eq(request.faces[i], cases[k].faces[i]);
        for (size_t i = 0; i < request.n_selected; i++)
            ck_assert_uint_eq(request.selected[i], cases[k].selected[i]);
        const size_t expected = cases[k].at_faces ? (cases[k].select ? cases[k].n_faces : FACES)
                                : cases[k].select ? cases[k].n_selected
                                                  : N;
        ck_assert_uint_eq(radiosity_request_values(&request, N, &f.faces), expected);
        radiosity_request_free(&request);
    }
    teardown(&f);
}
END_TEST

START_TEST(wrong_requests_for_faces_are_refused) {
    static const struct {
        const char *more;
        problem_kind kind;
        const char *pointer, *says;
    } cases[] = {
        {"\"at\":\"corner\"", PROBLEM_UNKNOWN_WORD, "/at", "must be elements, faces or corners"},
        {"\"at\":[]", PROBLEM_WRONG_KIND, "/at", "must be \"elements\", \"faces\" or \"corners\""},
        {"\"at\":\"faces\",\"select\":{\"elements\":[1]}", PROBLEM_WRONG_MEMBERS, "/select", "select faces"},
        {"\"select\":{\"faces\":[1]},\"at\":\"elements\"", PROBLEM_WRONG_MEMBERS, "/select",
         "at is elements"},
        {"\"select\":{\"faces\":[1,5]}", PROBLEM_BAD_INDEX, "/select/faces/1", "from 0 to 4"},
        {"\"select\":{\"faces\":[1,1]}", PROBLEM_GIVEN_TWICE, "/select/faces/1", "a face that was listed"},
        {"\"select\":{\"faces\":[0,1,2,3,4,0]}", PROBLEM_WRONG_LENGTH, "/select/faces/5", "more than the 5"},
        {"\"at\":\"faces\",\"select\":{\"groups\":[\"box.blue\"]}", PROBLEM_UNKNOWN_GROUP, "/select",
         "backs alone"},
        {"\"at\":\"faces\",\"select\":{\"groups\":[\"wall\",\"wall\"]}", PROBLEM_GIVEN_TWICE, "/select",
         "selected twice"},
        {"\"at\":\"faces\",\"reduce\":{\"groups\":[\"wall\"],\"with\":[\"max\"]}", PROBLEM_WRONG_MEMBERS, "",
         "both reduce"},
    };
    fixture f;
    setup(&f);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[256];
        radiosity_request request = {0};
        problem why;
        snprintf(text, sizeof text, "{%s,\"emission\":[1,1,1,1,1]}", cases[k].more);
        ck_assert_uint_eq(read_text(&f, text, &request, &why), 422);
        ck_assert_msg(why.kind == cases[k].kind && strcmp(why.pointer, cases[k].pointer) == 0 &&
                          strstr(why.detail, cases[k].says) != NULL,
                      "%s: %s at '%s'", text, why.detail, why.pointer);
        radiosity_request_free(&request);
    }
    for (int known = 0; known < 2; known++) {
        radiosity_request request = {0};
        problem why;
        face_index empty = {.n_faces = 0};
        f.s.scene.faces = known ? &empty : NULL;
        ck_assert_uint_eq(read_text(&f, "{\"emission\":[1,1,1,1,1],\"at\":\"faces\"}", &request, &why), 422);
        ck_assert_int_eq(why.kind, PROBLEM_NOT_IN_STORE);
        radiosity_request_free(&request);
    }
    teardown(&f);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("face means");
    TCase *tests = tcase_create("face means");
    tcase_add_test(tests, faces_have_their_elements);
    tcase_add_test(tests, means_are_by_area);
    tcase_add_test(tests, values_that_are_no_numbers_are_infinite);
    tcase_add_test(tests, requests_ask_for_faces);
    tcase_add_test(tests, wrong_requests_for_faces_are_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
