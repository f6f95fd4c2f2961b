/* Emissions by group and by file, on a mesh made by hand. */
#include "solver/codec/npy.h"
#include "solver/light/emission.h"
#include "support/suite.h"

#include <string.h>
#include <unistd.h>

enum { N = 4, N_TILES = 2 };

static double area[N] = {1, 2, 3, 4};
static uint32_t group[N] = {0, 1, 1, 2};
static char *names[] = {(char[]){"lamp"}, (char[]){"table.top"}, (char[]){"table.leg"}};
static float dark[3 * N];

static mesh hand_made(size_t n_channels) {
    return (mesh){.n = N,
                  .area = area,
                  .group = group,
                  .n_groups = 3,
                  .group_names = names,
                  .n_channels = n_channels,
                  .emission = dark};
}

static emission_scene scene_of(const mesh *m) {
    emission_scene scene = {0};
    ck_assert_int_eq(emission_scene_create(m, &scene, NULL), LAM_OK);
    scene.n_tiles = N_TILES;
    return scene;
}

static lam_status by_groups(const mesh *m, const char *one, const char *two, emission *e, lam_error *error) {
    option_list items = {.items = {one, two}, .count = two == NULL ? 1 : 2};
    emission_scene scene = scene_of(m);
    const lam_status status = emission_from_groups(&scene, &items, e, error);
    emission_scene_free(&scene);
    return status;
}

START_TEST(test_groups) {
    const mesh m = hand_made(1), colour = hand_made(3);
    emission e = {0};
    lam_error error;
    ck_assert_int_eq(by_groups(&m, "lamp=2", "table=3", &e, &error), LAM_OK);
    ck_assert(e.n_vectors == 1 && !e.batch);
    ck_assert_mem_eq(e.E, ((float[]){2, 3, 3, 3}), 4 * sizeof(float));
    emission_free(&e);
    ck_assert_int_eq(by_groups(&m, "table.leg=1", "table.leg=5", &e, &error), LAM_OK);
    ck_assert_mem_eq(e.E, ((float[]){0, 0, 0, 5}), 4 * sizeof(float));
    emission_free(&e);
    ck_assert_int_eq(by_groups(&colour, "lamp=1,2,3", "table=4", &e, &error), LAM_OK);
    ck_assert_mem_eq(e.E, ((float[]){1, 4, 4, 4, 2, 4, 4, 4, 3, 4, 4, 4}), 12 * sizeof(float));
    emission_free(&e);
    static const char *const bad[] = {"tab=1", "table.=1", "lamp",     "=1",
                                      "lamp=", "lamp=-1",  "lamp=1,2", "lamp=1e39"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        ck_assert_msg(by_groups(&colour, bad[i], NULL, &e, &error) == LAM_ERR_ARGUMENT, "'%s' was read",
                      bad[i]);
        ck_assert_ptr_null(e.E);
    }
    ck_assert_int_eq(by_groups(&m, "lmap=1", NULL, &e, &error), LAM_ERR_ARGUMENT);
    ck_assert_msg(strstr(error.message, "no group \"lmap\"; did you mean \"lamp\"?") != NULL, "%s",
                  error.message);
    ck_assert_int_eq(by_groups(&m, "tabel=1", NULL, &e, &error), LAM_ERR_ARGUMENT);
    ck_assert_msg(strstr(error.message, "did you mean \"table\"?") != NULL, "%s", error.message);
    ck_assert_int_eq(by_groups(&m, "xyz=1", NULL, &e, &error), LAM_ERR_ARGUMENT);
    ck_assert_msg(strstr(error.message, "there are: lamp table.top table.leg") != NULL, "%s", error.message);
}
END_TEST

/* More channels than a command line has colours. */
START_TEST(test_many_channels) {
    enum { C = 20 };
    mesh m = hand_made(C);
    emission e = {0};
    lam_error error;
    ck_assert_int_eq(by_groups(&m, "lamp=2", NULL, &e, &error), LAM_OK);
    for (size_t c = 0; c < C; c++) ck_assert(e.E[c * N] == 2 && e.E[c * N + 1] == 0);
    emission_free(&e);
    ck_assert_int_eq(
        by_groups(&m, "lamp=1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20", NULL, &e, &error), LAM_OK);
    for (size_t c = 0; c < C; c++) ck_assert(e.E[c * N] == (float)c + 1);
    emission_free(&e);
}
END_TEST

static lam_status by_json(const mesh *m, const char *text, emission *e, lam_error *error) {
    char path[] = "/tmp/test-emission-XXXXXX.json";
    int descriptor = mkstemps(path, 5);
    ck_assert_int_ge(descriptor, 0);
    ck_assert_int_eq(write(descriptor, text, strlen(text)), (ssize_t)strlen(text));
    close(descriptor);
    emission_scene scene = scene_of(m);
    lam_status status = emission_read(path, &scene, false, e, error);
    emission_scene_free(&scene);
    unlink(path);
    return status;
}

START_TEST(test_json) {
    static const struct {
        size_t n_channels, n_vectors;
        bool batch;
        const char *text;
        float E[12];
    } good[] = {
        {1, 1, false, "[1,2,3,4]", {1, 2, 3, 4}},
        {1, 1, false, "[[1,2,3,4]]", {1, 2, 3, 4}},
        {1, 2, true, "{\"emissions\":[[1,2,3,4],[[5,6,7,8]]]}", {1, 2, 3, 4, 5, 6, 7, 8}},
        {3, 1, false, "[1,2,3,4]", {1, 2, 3, 4, 1, 2, 3, 4, 1, 2, 3, 4}},
        {3, 1, false, "[[1,2,3,4],[5,6,7,8],[9,1,2,3]]", {1, 2, 3, 4, 5, 6, 7, 8, 9, 1, 2, 3}},
        {1, 1, false, "{\"elements\":[3,0],\"values\":[5,[6]]}", {6, 0, 0, 5}},
        {3, 1, false, "{\"elements\":[1],\"values\":[[1,2,3]]}", {0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0}},
        {1, 1, false, "{\"groups\":{\"table\":2,\"lamp\":1}}", {1, 2, 2, 2}},
        {1, 1, false, "{\"emission\":{\"groups\":{\"lamp\":1}}}", {1}},
        {1, 2, true, "{\"emissions\":[[1,0,0,0],{\"groups\":{\"lamp\":7}}]}", {1, 0, 0, 0, 7}},
        {1, 1, true, "{\"emissions\":[[1,0,0,0]]}", {1}},
    };
    static const char *const bad[] = {
        "", "7", "null", "{}", "[]", "[1,2,3]", "[1,2,3,-4]", "[1,2,3,1e39]", "[1,2,3,\"4\"]",
        "[[1,2],[3,4]]",
        /* Rows are channels: a batch is an object with emissions. */
        "[[1,2,3,4],[5,6,7,8]]", "[{\"groups\":{\"lamp\":1}},{\"groups\":{\"lamp\":2}}]",
        "{\"elements\":[1,1],\"values\":[1,1]}", "{\"groups\":{\"table\":1,\"table.leg\":2}}",
        "{\"emission\":[1,2,3,4],\"quantity\":\"indirect\"}",
        "{\"quantity\":\"indirect\",\"emission\":[1,2,3,4]}", "[1,2,3,NaN]",
        "{\"elements\":[4],\"values\":[1]}", "{\"elements\":[-1],\"values\":[1]}",
        "{\"elements\":[1.5],\"values\":[1]}", "{\"elements\":[1]}", "{\"values\":[1]}",
        "{\"elements\":[1],\"values\":[1,2]}", "{\"elements\":[1],\"values\":[[1,2]]}", "{\"groups\":[1]}",
        "{\"groups\":{\"none\":1}}", "{\"groups\":{\"lamp\":null}}",
        "{\"groups\":{},\"elements\":[],\"values\":[]}", "{\"sky\":[1]}", "{\"sky\":[1,2,3]}",
        "{\"sky\":[1,-2]}", "{\"sky\":[1,null]}", "{\"sky\":[1,[1,2]]}", "{\"sky\":7}",
        "{\"sky\":[1,2],\"emitters\":[1]}", "{\"sky\":[1,2],\"values\":[1]}", "{\"sky\":[1,2],\"other\":1}",
        "{\"emitters\":[1]}", "{\"emissions\":[]}", "{\"emissions\":{}}",
        "{\"emission\":[1,2,3,4],\"emissions\":[[1,2,3,4]]}", "{\"groups\":{\"lamp\":1},\"other\":1}",
        "[1,2,3,4]x"};
    lam_error error;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        const mesh m = hand_made(good[i].n_channels);
        emission e = {0};
        ck_assert_msg(by_json(&m, good[i].text, &e, &error) == LAM_OK, "%s: %s", good[i].text, error.message);
        ck_assert_uint_eq(e.n_vectors, good[i].n_vectors);
        ck_assert_int_eq(e.batch, good[i].batch);
        ck_assert_mem_eq(e.E, good[i].E, e.n_vectors * m.n_channels * N * sizeof(float));
        emission_free(&e);
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        const mesh m = hand_made(1);
        emission e = {0};
        ck_assert_msg(by_json(&m, bad[i], &e, &error) != LAM_OK, "was read: %s", bad[i]);
        ck_assert_ptr_null(e.E);
        ck_assert_ptr_nonnull(strstr(error.message, ".json"));
    }
}
END_TEST

START_TEST(test_json_skies) {
    const mesh m = hand_made(1), colour = hand_made(3);
    emission e = {0};
    lam_error error;
    ck_assert_int_eq(by_json(&m, "[1,2,3,4]", &e, &error), LAM_OK);
    ck_assert_ptr_null(e.L);
    emission_free(&e);
    ck_assert_int_eq(by_json(&m, "{\"sky\":[5,6]}", &e, &error), LAM_OK);
    ck_assert_mem_eq(e.E, ((float[N]){0}), sizeof(float[N]));
    ck_assert_mem_eq(e.L, ((float[]){5, 6}), 2 * sizeof(float));
    emission_free(&e);
    ck_assert_int_eq(by_json(&colour, "{\"sky\":[5,[6,7,8]],\"groups\":{\"lamp\":1}}", &e, &error), LAM_OK);
    ck_assert_mem_eq(e.E, ((float[]){1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}), 12 * sizeof(float));
    ck_assert_mem_eq(e.L, ((float[]){5, 6, 5, 7, 5, 8}), 6 * sizeof(float));
    emission_free(&e);
    /* In a batch one without a sky is under a dark one. */
    ck_assert_int_eq(by_json(&m,
                             "{\"emissions\":[[1,2,3,4],{\"elements\":[1],\"values\":[9],\"sky\":[5,6]},"
                             "{\"groups\":{\"lamp\":7}}]}",
                             &e, &error),
                     LAM_OK);
    ck_assert_mem_eq(e.E, ((float[]){1, 2, 3, 4, 0, 9, 0, 0, 7, 0, 0, 0}), 12 * sizeof(float));
    ck_assert_mem_eq(e.L, ((float[]){0, 0, 5, 6, 0, 0}), 6 * sizeof(float));
    emission_free(&e);
}
END_TEST

/* Writes an NPY file of this shape whose values count from 1. */
static void write_counting(int descriptor, size_t rank, const size_t *shape) {
    float values[64];
    size_t count = 1;
    buffer b = {0};
    for (size_t k = 0; k < rank; k++) count *= shape[k];
    for (size_t i = 0; i < count; i++) values[i] = (float)(i + 1);
    ck_assert(npy_write_header(&b, NPY_F4, rank, shape) && npy_write_values(&b, NPY_F4, values, count));
    ck_assert_int_eq(write(descriptor, b.bytes, b.length), (ssize_t)b.length);
    close(descriptor);
    buffer_free(&b);
}

START_TEST(test_npy) {
    const mesh m = hand_made(1), colour = hand_made(3);
    const struct {
        const mesh *m;
        size_t rank, shape[3], n_vectors;
        bool batch;
    } cases[] = {
        {&m, 1, {4}, 1, false},           {&m, 2, {1, 4}, 1, true},       {&m, 2, {3, 4}, 3, true},
        {&m, 3, {3, 1, 4}, 3, true},      {&colour, 1, {4}, 1, false},    {&colour, 2, {3, 4}, 1, false},
        {&colour, 3, {2, 3, 4}, 2, true}, {&colour, 2, {2, 4}, 0, false}, {&m, 1, {5}, 0, false}};
    lam_error error;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char path[] = "/tmp/test-emission-XXXXXX.npy";
        const mesh *of = cases[k].m;
        emission_scene scene = scene_of(of);
        emission e = {0};
        write_counting(mkstemps(path, 4), cases[k].rank, cases[k].shape);
        const lam_status status = emission_read(path, &scene, false, &e, &error);
        ck_assert_int_eq(status, cases[k].n_vectors > 0 ? LAM_OK : LAM_ERR_ARGUMENT);
        ck_assert(e.n_vectors == cases[k].n_vectors && e.batch == cases[k].batch);
        for (size_t i = 0; i < e.n_vectors * of->n_channels * N; i++)
            ck_assert(e.E[i] == (float)(cases[k].rank == 1 ? i % N : i) + 1);
        if (status != LAM_OK) ck_assert_ptr_nonnull(strstr(error.message, path));
        emission_free(&e);
        emission_scene_free(&scene);
        unlink(path);
    }
    emission_scene scene = scene_of(&m);
    emission e = {0};
    ck_assert_int_eq(emission_read("/nonexistent/a.npy", &scene, false, &e, &error), LAM_ERR_IO);
    ck_assert_int_eq(emission_read("/nonexistent/a.json", &scene, false, &e, &error), LAM_ERR_IO);
    ck_assert_int_eq(emission_read("/tmp", &scene, false, &e, &error), LAM_ERR_ARGUMENT);
    emission_scene_free(&scene);
}
END_TEST

START_TEST(test_frames) {
    /* Two axes are frames by elements, also where a scene has as many channels as there are rows; else
     * weights of its 5 emitters. */
    const mesh m = hand_made(1), colour = hand_made(3);
    const struct {
        const mesh *m;
        size_t rank, shape[3], n_vectors;
        bool weights, alike;
    } cases[] = {{&m, 1, {4}, 1, false, true},
                 {&m, 2, {3, 4}, 3, false, true},
                 {&m, 2, {3, 5}, 3, true, true},
                 {&colour, 2, {3, 4}, 3, false, true},
                 {&colour, 2, {6, 5}, 6, true, true},
                 {&colour, 3, {2, 3, 4}, 2, false, false},
                 {&colour, 3, {2, 3, 5}, 2, true, false},
                 {&colour, 2, {3, 6}, 0, false, false}};
    lam_error error;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char path[] = "/tmp/test-emission-XXXXXX.npy";
        const size_t C = cases[k].m->n_channels, width = cases[k].weights ? 5 : N;
        emission_scene scene = scene_of(cases[k].m);
        emission e = {0};
        scene.n_emitters = 5;
        write_counting(mkstemps(path, 4), cases[k].rank, cases[k].shape);
        const lam_status status = emission_read_frames(path, &scene, &e, &error);
        ck_assert_int_eq(status, cases[k].n_vectors > 0 ? LAM_OK : LAM_ERR_ARGUMENT);
        ck_assert_uint_eq(e.n_vectors, cases[k].n_vectors);
        const float *values = cases[k].weights ? e.W : e.E;
        ck_assert((e.E != NULL) == (status == LAM_OK && !cases[k].weights));
        for (size_t i = 0; i < e.n_vectors * C * width; i++)
            ck_assert_float_eq(values[i],
                               (float)(cases[k].alike ? i / (C * width) * width + i % width : i) + 1);
        if (status != LAM_OK) ck_assert_ptr_nonnull(strstr(error.message, "weights of the 5 emitters"));
        emission_free(&e);
        emission_scene_free(&scene);
        unlink(path);
    }
    emission_scene scene = scene_of(&colour);
    emission e = {0};
    ck_assert_int_eq(emission_read_frames("emitters", &scene, &e, &error), LAM_ERR_ARGUMENT);
    scene.n_emitters = 2;
    ck_assert_int_eq(emission_read_frames("emitters", &scene, &e, &error), LAM_OK);
    ck_assert(e.n_vectors == 2 && e.batch && e.E == NULL);
    ck_assert_mem_eq(e.W, ((float[]){1, 0, 1, 0, 1, 0, 0, 1, 0, 1, 0, 1}), 12 * sizeof(float));
    emission_free(&e);
    ck_assert_int_eq(emission_read_frames("a.txt", &scene, &e, &error), LAM_ERR_ARGUMENT);
    emission_scene_free(&scene);
}
END_TEST

/* Puts three dark emissions, or one, under a sky of this shape whose values count from 1. */
static lam_status under_sky(const mesh *m, size_t n_vectors, size_t rank, const size_t *dims, emission *e,
                            lam_error *error) {
    char path[] = "/tmp/test-emission-XXXXXX.npy";
    emission_scene scene = scene_of(m);
    write_counting(mkstemps(path, 4), rank, dims);
    *e = (emission){.n_vectors = n_vectors};
    ck_assert_int_eq(emission_allocate(path, m->n_channels, N, n_vectors, &e->E, error), LAM_OK);
    e->E[1] = 3;
    const lam_status status = emission_add_sky(e, path, &scene, false, error);
    emission_scene_free(&scene);
    unlink(path);
    return status;
}

START_TEST(test_skies_from_files) {
    const mesh m = hand_made(1), colour = hand_made(3);
    emission e;
    lam_error error;
    ck_assert_int_eq(under_sky(&m, 1, 1, (size_t[]){2}, &e, &error), LAM_OK);
    ck_assert(e.n_vectors == 1 && !e.batch);
    ck_assert_mem_eq(e.L, ((float[]){1, 2}), 2 * sizeof(float));
    emission_free(&e);
    /* Two coloured skies over a grey scene: .265 x 1 + .67 x 3 + .065 x 5 = 2.6, and so on by 1 and 6. */
    ck_assert_int_eq(under_sky(&m, 1, 3, (size_t[]){2, 3, 2}, &e, &error), LAM_OK);
    ck_assert(e.n_vectors == 2 && e.batch && e.by_luminance);
    for (int k = 0; k < 4; k++) ck_assert_float_eq_tol(e.L[k], ((float[]){2.6f, 3.6f, 8.6f, 9.6f})[k], 1e-6f);
    emission_free(&e);
    ck_assert_int_eq(under_sky(&m, 1, 3, (size_t[]){2, 4, 2}, &e, &error), LAM_ERR_ARGUMENT);
    emission_free(&e);
    ck_assert_int_eq(under_sky(&colour, 1, 1, (size_t[]){2}, &e, &error), LAM_OK);
    ck_assert_mem_eq(e.L, ((float[]){1, 2, 1, 2, 1, 2}), 6 * sizeof(float));
    emission_free(&e);
    ck_assert_int_eq(under_sky(&colour, 1, 2, (size_t[]){3, 2}, &e, &error), LAM_OK);
    ck_assert(e.n_vectors == 1 && !e.batch);
    ck_assert_mem_eq(e.L, ((float[]){1, 2, 3, 4, 5, 6}), 6 * sizeof(float));
    emission_free(&e);
    /* One emission under two skies. */
    ck_assert_int_eq(under_sky(&m, 1, 2, (size_t[]){2, 2}, &e, &error), LAM_OK);
    ck_assert(e.n_vectors == 2 && e.batch);
    ck_assert_mem_eq(e.L, ((float[]){1, 2, 3, 4}), 4 * sizeof(float));
    ck_assert(e.steady);
    ck_assert_mem_eq(e.E, ((float[]){0, 3, 0, 0}), 4 * sizeof(float));
    emission_free(&e);
    /* Three emissions under one sky, and under three. */
    ck_assert_int_eq(under_sky(&m, 3, 1, (size_t[]){2}, &e, &error), LAM_OK);
    ck_assert(!e.steady);
    ck_assert_mem_eq(e.L, ((float[]){1, 2, 1, 2, 1, 2}), 6 * sizeof(float));
    emission_free(&e);
    ck_assert_int_eq(under_sky(&colour, 3, 3, (size_t[]){3, 3, 2}, &e, &error), LAM_OK);
    ck_assert_float_eq(e.L[17], 18);
    emission_free(&e);
    static const struct {
        size_t n_channels, n_vectors, rank, dims[3];
        const char *says;
    } bad[] = {{1, 1, 1, {3}, "is (3), must be (2) or (vectors, 2), one value for each tile of the sky"},
               {3, 1, 2, {2, 2}, "shape"},
               {1, 3, 2, {2, 2}, "2 skies beside 3 emissions"},
               {1, 1, 2, {0, 2}, "empty"}};
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        const mesh *of = bad[k].n_channels == 1 ? &m : &colour;
        ck_assert_int_eq(under_sky(of, bad[k].n_vectors, bad[k].rank, bad[k].dims, &e, &error),
                         LAM_ERR_ARGUMENT);
        ck_assert_msg(strstr(error.message, bad[k].says) != NULL, "%s", error.message);
        ck_assert_ptr_null(e.L);
        emission_free(&e);
    }
}
END_TEST

int main(void) {
    Suite *s = suite_create("emission");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, test_groups);
    tcase_add_test(c, test_many_channels);
    tcase_add_test(c, test_npy);
    tcase_add_test(c, test_frames);
    tcase_add_test(c, test_json);
    tcase_add_test(c, test_json_skies);
    tcase_add_test(c, test_skies_from_files);
    suite_add_tcase(s, c);
    return suite_run(s);
}
