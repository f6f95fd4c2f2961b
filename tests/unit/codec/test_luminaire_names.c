/* Luminaires by name and by group, and emissions that name them. */
#include "store/store.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <string.h>
#include <unistd.h>

enum { K = 7, N = REQUEST_ELEMENTS, C = 3 };

/* The grid "row" is a group of its own; "desk" has the name of a group beside luminaires called
 * desk.something; the group "hall" has no luminaire. */
static const char *const names[K] = {"spot", "row.1", "row.0", "b", "desk.0", "desk.1", "wall"};
static const char *const group_names[] = {"row", "desk", "hall", "lab.left", "lab.right"};
static const uint32_t group[K] = {1, 0, 0, UINT32_MAX, 4, 3, UINT32_MAX};

static void write_numbers(store *s, const char *name, size_t width) {
    static const double ones[K * 12] = {1};
    lam_error error = {0};
    char path[64];
    snprintf(path, sizeof path, "/luminaires/%s", name);
    ck_assert_int_eq(store_write(s, path, STORE_F64, width == 0 ? 1 : 2, (size_t[]){K, width}, ones, &error),
                     LAM_OK);
}

/* Luminaires of a store that is gone again. */
static lam_luminaires *make_luminaires(bool with_groups) {
    static const float zeros[K * N];
    char path[64];
    lam_error error = {0};
    lam_luminaires *l = NULL;
    store *s = NULL;
    snprintf(path, sizeof path, "/tmp/lambert-luminaire-names-%d.h5", (int)getpid());
    ck_assert_int_eq(store_create(path, &s, &error), LAM_OK);
    ck_assert_int_eq(store_write(s, "/mesh/reflectance", STORE_F32, 2, (size_t[]){C, N}, zeros, &error),
                     LAM_OK);
    ck_assert_int_eq(store_write(s, "/luminaires/irradiance", STORE_F32, 2, (size_t[]){K, N}, zeros, &error),
                     LAM_OK);
    ck_assert_int_eq(store_write_texts(s, "/luminaires/names", K, names, &error), LAM_OK);
    if (with_groups) {
        ck_assert_int_eq(store_write_texts(s, "/luminaires/group_names", 5, group_names, &error), LAM_OK);
        ck_assert_int_eq(store_write(s, "/luminaires/group", STORE_U32, 1, (size_t[]){K}, group, &error),
                         LAM_OK);
    }
    write_numbers(s, "dimmers", 0);
    write_numbers(s, "lumens", 0);
    write_numbers(s, "colour", 3);
    write_numbers(s, "place", 12);
    write_numbers(s, "opening", 8);
    ck_assert_int_eq(store_seal(s, &error), LAM_OK);
    ck_assert_msg(lam_luminaires_open(path, &l, &error) == LAM_OK, "%s", error.message);
    unlink(path);
    return l;
}

static luminaire_names make_names(bool with_groups) {
    luminaire_names made;
    lam_error error = {0};
    lam_luminaires *l = make_luminaires(with_groups);
    ck_assert_int_eq(luminaire_names_make(l, &made, &error), LAM_OK);
    lam_luminaires_close(l);
    return made;
}

/* The luminaires that a name means, in order with a blank behind each. */
static const char *found(const luminaire_names *index, const char *name) {
    static char text[256];
    const uint32_t *luminaires = NULL;
    const size_t n = luminaire_names_find(index, name, strlen(name), &luminaires);
    text[0] = '\0';
    for (size_t k = 0; k < n; k++) strcat(strcat(text, names[luminaires[k]]), " ");
    return text;
}

START_TEST(names_mean_luminaires_then_groups) {
    luminaire_names index = make_names(true);
    ck_assert_uint_eq(luminaire_names_count(&index), K);
    ck_assert_str_eq(found(&index, "spot"), "spot ");
    ck_assert_str_eq(found(&index, "row.1"), "row.1 ");
    ck_assert_str_eq(found(&index, "row"), "row.1 row.0 ");
    ck_assert_str_eq(found(&index, "desk"), "spot "); /* the group, not desk.0 and desk.1 */
    ck_assert_str_eq(found(&index, "desk.*"), "desk.0 desk.1 ");
    ck_assert_str_eq(found(&index, "lab"), "desk.1 desk.0 "); /* two groups beside each other */
    ck_assert_str_eq(found(&index, "lab.right"), "desk.0 ");
    ck_assert_str_eq(found(&index, "la*"), "desk.1 desk.0 ");
    ck_assert_str_eq(found(&index, "*"), "b desk.0 desk.1 row.0 row.1 spot wall ");
    ck_assert_str_eq(found(&index, "hall"), "");
    ck_assert_str_eq(found(&index, "ro"), "");
    ck_assert_str_eq(found(&index, ""), "");
    luminaire_names_free(&index);
}
END_TEST

START_TEST(without_groups_names_are_of_luminaires) {
    lam_error error = {0};
    luminaire_names index = make_names(false);
    ck_assert_str_eq(found(&index, "row"), "row.0 row.1 ");
    ck_assert_str_eq(found(&index, "lab"), "");
    luminaire_names_free(&index);
    ck_assert_int_eq(luminaire_names_make(NULL, &index, &error), LAM_OK);
    ck_assert_uint_eq(luminaire_names_count(&index), 0);
    ck_assert_str_eq(found(&index, "row"), "");
    luminaire_names_free(&index);
}
END_TEST

START_TEST(a_miss_names_the_nearest_of_both) {
    char text[GROUP_MISS];
    luminaire_names index = make_names(true);
    luminaire_names_miss(&index, "spto", 4, text);
    ck_assert_str_eq(text, "no luminaire \"spto\"; did you mean \"spot\"?");
    luminaire_names_miss(&index, "lab.lef", 7, text);
    ck_assert_str_eq(text, "no luminaire \"lab.lef\"; did you mean \"lab.left\"?");
    luminaire_names_miss(&index, "chandelier", 10, text);
    ck_assert_str_eq(text, "no luminaire \"chandelier\"; there are: spot row.1 row.0 b desk.0 desk.1 wall");
    luminaire_names_free(&index);
}
END_TEST

/* A scene with these luminaires, that answers nothing but n elements. */
typedef struct fixture {
    request_scene base;
    luminaire_names names;
} fixture;

static fixture make_scene(size_t n_channels) {
    static const uint32_t of[N] = {2, 0, 1, 3, 1};
    fixture f = {.base = request_scene_make(of, n_channels), .names = make_names(true)};
    f.base.scene.n_luminaires = K;
    f.base.scene.lights = LIGHT_PHOTOMETRIC;
    return f;
}

static void free_scene(fixture *f) {
    group_index_free(&f->base.groups);
    luminaire_names_free(&f->names);
}

static bool read_request(fixture *f, const char *text, radiosity_request *request, problem *why) {
    f->base.scene.groups = &f->base.groups;
    f->base.scene.luminaires = &f->names;
    return codec_read_json(&f->base.scene, text, strlen(text), request, why);
}

START_TEST(dimmers_are_read) {
    fixture f = make_scene(C);
    radiosity_request request = {0};
    problem why;
    ck_assert_msg(read_request(&f,
                               "{\"emissions\":[{\"groups\":{\"lamp\":2}},"
                               "{\"luminaires\":{\"row\":0.5,\"wall\":[1,0.25,0]},\"sky\":[1,2,3]},"
                               "{\"luminaires\":{\"*\":1},\"elements\":[4],\"values\":[7]},[1,2,3,4,5]]}",
                               &request, &why),
                  "%s", why.detail);
    ck_assert_uint_eq(request.luminaires.n, 4);
    ck_assert_uint_eq(request.n_rhs, 4);
    const float second[C][K] = {{0, .5f, .5f, 0, 0, 0, 1}, {0, .5f, .5f, 0, 0, 0, .25f}, {0, .5f, .5f}};
    const float *D = request.luminaires.values;
    for (size_t i = 0; i < C * K; i++) {
        ck_assert(D[i] == 0 && D[3 * C * K + i] == 0 && D[2 * C * K + i] == 1);
        ck_assert(D[C * K + i] == second[i / K][i % K]);
    }
    ck_assert(request.E[(2 * C + 1) * N + 4] == 7 && request.sky.values[(1 * C + 2) * 3 + 2] == 3);
    ck_assert(!radiosity_request_has_signs(&request, &f.base.scene, 1, 0));
    request.luminaires.values[C * K + 6] = -1;
    ck_assert(radiosity_request_has_signs(&request, &f.base.scene, 1, 0));
    ck_assert(!radiosity_request_has_signs(&request, &f.base.scene, 1, 1));
    radiosity_request_free(&request);
    free_scene(&f);
}
END_TEST

/* Dimmers stay numbers without a unit, but the light of an answer is in the one asked for. */
START_TEST(units_are_those_of_the_answer) {
    fixture f = make_scene(1);
    radiosity_request request = {0};
    problem why;
    ck_assert_msg(
        read_request(&f, "{\"emission\":{\"luminaires\":{\"spot\":8}},\"unit\":\"klx\"}", &request, &why),
        "%s", why.detail);
    ck_assert_float_eq(request.luminaires.values[0], .008f);
    radiosity_request_free(&request);
    free_scene(&f);
}
END_TEST

START_TEST(faults_of_dimmers) {
    static const struct {
        const char *luminaires, *detail;
    } cases[] = {
        {"{\"spto\":1}",
         "emission/luminaires/spto: the scene has no luminaire \"spto\"; did you mean \"spot\"?"},
        {"{\"spot\":1,\"desk\":1}", "emission/luminaires/desk: the luminaire spot is given twice"},
        {"{\"spot\":1,\"spot\":1}", "emission/luminaires/spot: the luminaire spot is given twice"},
        {"{\"spot\":-0.5}", "emission/luminaires/spot = -0.5, must not be negative"},
        {"{\"spot\":1e39}",
         "emission/luminaires/spot = 1e39, must be within the range of single precision (3.4e38)"},
        {"{\"spot\":\"3600lm\"}", "emission/luminaires/spot must be a number or one for each channel"},
        {"{\"spot\":[1,2]}", "emission/luminaires/spot holds 2 values, must be 3, one for each channel"},
        {"[1,2,3]", "emission/luminaires must be an object of names and dimmers"}};
    fixture f = make_scene(C);
    problem why;
    char text[256];
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        radiosity_request request = {0};
        snprintf(text, sizeof text, "{\"emission\":{\"luminaires\":%s}}", cases[i].luminaires);
        f.base.scene.signs = true; /* which dimmers do not have */
        ck_assert(!read_request(&f, text, &request, &why));
        ck_assert_uint_eq(why.status, 422);
        ck_assert_str_eq(why.detail, cases[i].detail);
        radiosity_request_free(&request);
    }
    free_scene(&f);
}
END_TEST

/* They are the last emitters of a store of few, whose weights are read as dimmers; both add up. */
START_TEST(weights_of_emitters_are_dimmers) {
    static const char text[] = "{\"emissions\":[{\"emitters\":[[5,6,7],0,0,0,0,0,0,0,[1,2,3]],\"luminaires\":"
                               "{\"wall\":0.5,\"b\":4}},"
                               "{\"luminaires\":{\"spot\":1}},{\"emitters\":[0,1,0,0,0,0,0,0,0]}]}";
    fixture f = make_scene(C);
    radiosity_request request = {0};
    problem why;
    f.base.scene.n_emitters = 2 + K;
    ck_assert_msg(read_request(&f, text, &request, &why), "%s", why.detail);
    ck_assert_uint_eq(request.emitters.n, 3);
    ck_assert_uint_eq(request.luminaires.n, 3);
    for (size_t c = 0; c < C; c++) {
        const float *W = request.emitters.values + c * (2 + K), *D = request.luminaires.values + c * K;
        ck_assert(W[0] == (float)(5 + c) && D[6] == (float)(1 + c) + .5f && D[3] == 4);
        for (size_t k = 1; k < 2 + K; k++) ck_assert(W[k] == 0);
        ck_assert(D[C * K] == 1 && W[C * (2 + K)] == 0 && W[2 * C * (2 + K) + 1] == 1);
        for (size_t k = 0; k < K; k++) ck_assert(D[2 * C * K + k] == 0);
    }
    radiosity_request_free(&request);
    free_scene(&f);
}
END_TEST

START_TEST(stores_that_do_not_answer_them) {
    static const char text[] = "{\"emission\":{\"luminaires\":{\"spot\":1}}}";
    fixture f = make_scene(C);
    radiosity_request request = {0};
    problem why;
    f.base.scene.n_emitters = f.base.scene.n_luminaires = 0;
    ck_assert(!read_request(&f, text, &request, &why));
    ck_assert_str_eq(why.detail,
                     "emission/luminaires: the store has no luminaires; precompute it with --luminaires");
    ck_assert_int_eq(why.kind, PROBLEM_NOT_IN_STORE);
    radiosity_request_free(&request);
    free_scene(&f);
}
END_TEST

/* The same of a file of emissions, and of the memory that a request may take. */
START_TEST(files_and_limits) {
    fixture f = make_scene(C);
    radiosity_request request = {0};
    problem why;
    static const char file[] = "{\"luminaires\":{\"b\":2}}";
    f.base.scene.groups = &f.base.groups;
    f.base.scene.luminaires = &f.names;
    ck_assert(codec_read_emissions(&f.base.scene, file, strlen(file), &request, &why));
    ck_assert(request.n_rhs == 1 && request.luminaires.values[3] == 2);
    radiosity_request_free(&request);
    f.base.scene.max_bytes = C * K * sizeof(float) - 1;
    ck_assert(!codec_read_emissions(&f.base.scene, file, strlen(file), &request, &why));
    ck_assert_str_eq(
        why.detail,
        "1 times 3 channels of 7 luminaires pass the 83 bytes that a request may hold; send several "
        "requests");
    radiosity_request_free(&request);
    free_scene(&f);
}
END_TEST

int main(void) {
    Suite *s = suite_create("luminaire_names");
    TCase *c = tcase_create("all");
    tcase_add_test(c, names_mean_luminaires_then_groups);
    tcase_add_test(c, without_groups_names_are_of_luminaires);
    tcase_add_test(c, a_miss_names_the_nearest_of_both);
    tcase_add_test(c, dimmers_are_read);
    tcase_add_test(c, units_are_those_of_the_answer);
    tcase_add_test(c, faults_of_dimmers);
    tcase_add_test(c, weights_of_emitters_are_dimmers);
    tcase_add_test(c, stores_that_do_not_answer_them);
    tcase_add_test(c, files_and_limits);
    suite_add_tcase(s, c);
    return suite_run(s);
}
