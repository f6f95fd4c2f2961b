/* Operators of two meshes in a store: what a file must hold, and what is refused in one clear line. */
#include "solver/operator/two_mesh.h"
#include "support/operator_file.h"
#include "support/suite.h"

static lam_error error;

/* A file's differences from a good one of n = 6, k = 2: a member that is 0 or NULL is as it should be. */
typedef struct recipe {
    const char *what;
    bool factored, no_I, no_form;
    size_t I_size, weight_size, coherence_size, left[2]; /* weight and coherence: 0 leaves them out */
    uint64_t begin[3];
    float weight, coherence, left_value;
    bool whole;         /* Y is of u16 */
    const char *claims; /* /operator's precision; NULL: no such attribute */
    const char *word;   /* NULL: it is good */
} recipe;

static const recipe recipes[] = {
    {.what = "good"},
    {.what = "good, factored", .factored = true},
    {.what = "good, weighted", .weight_size = 6, .weight = .5f},
    {.what = "good, coherence", .coherence_size = 2, .coherence = 1},
    {.what = "a patch without elements", .begin = {0, 6, 6}},
    {.what = "whole numbers", .whole = true, .word = "/operator/Y must be of f32, f16 or i8"},
    {.what = "another precision said", .claims = "i8", .word = "precision 'i8', its arrays are of f32"},
    {.what = "no form", .no_form = true, .word = "form"},
    {.what = "no I", .no_I = true, .word = "/operator/I"},
    {.what = "I short", .I_size = 2, .word = "/operator/I"},
    {.what = "I ends early", .begin = {0, 3, 5}, .word = "I[2] = 5, must be 6"},
    {.what = "I ends late", .begin = {0, 3, 7}, .word = "I[2] = 7, must be at least 3 and at most 6"},
    {.what = "I falls", .begin = {0, 4, 3}, .word = "I[2] = 3"},
    {.what = "I begins late", .begin = {1, 4, 6}, .word = "I[0] = 1"},
    {.what = "weight short", .weight_size = 5, .weight = 1, .word = "/operator/weight"},
    {.what = "weight NaN", .weight_size = 6, .weight = NAN, .word = "weight[5] = nan"},
    {.what = "coherence long", .coherence_size = 3, .word = "/operator/coherence"},
    {.what = "coherence 2", .coherence_size = 2, .coherence = 2, .word = "coherence[1] = 2"},
    {.what = "coherence NaN", .coherence_size = 2, .coherence = NAN, .word = "coherence[1] = nan"},
    {.what = "Y narrow", .left = {6, 1}, .word = "/operator/I"},
    {.what = "Y short", .left = {5, 2}, .word = "/operator/Y"},
    {.what = "no patch", .left = {6, 0}, .I_size = 1, .word = "0 patches"},
    {.what = "more patches than elements", .left = {6, 7}, .word = "7 patches"},
    {.what = "NaN in Y", .left_value = NAN, .word = "/operator/Y"},
    {.what = "NaN in U", .factored = true, .left_value = NAN, .word = "/operator/U"},
};

static void write_floats(store *s, const char *name, int rank, const size_t *dims, float value, float last) {
    size_t count = 1;
    for (int i = 0; i < rank; i++) count *= dims[i];
    float *x = test_allocate(count, sizeof *x);
    for (size_t i = 0; i < count; i++) x[i] = i + 1 < count ? value : last;
    ck_ok(store_write(s, name, STORE_F32, rank, dims, x, &error));
    free(x);
}

static void write_recipe(const recipe *r) {
    static const uint64_t usual[8] = {0, 2, 6};
    store *s = NULL;
    const size_t C = r->factored ? 2 : 1, I_size = r->I_size > 0 ? r->I_size : 3;
    const bool shaped = r->left[0] > 0;
    const size_t left[2] = {shaped ? r->left[0] : 6, shaped ? r->left[1] : 2};
    ck_ok(store_create(operator_file_path, &s, &error));
    write_floats(s, "/mesh/reflectance", 2, (size_t[]){C, 6}, .5f, .5f);
    ck_ok(store_set_text(s, "/operator", "kind", "two_mesh", &error));
    if (!r->no_form)
        ck_ok(store_set_text(s, "/operator", "form", r->factored ? "factored" : "folded", &error));
    if (r->whole)
        ck_ok(store_write(s, "/operator/Y", STORE_U16, 2, left, (uint16_t[12]){0}, &error));
    else
        write_floats(s, r->factored ? "/operator/U" : "/operator/Y", 2, left, .1f,
                     r->left_value != 0 ? r->left_value : .1f);
    if (r->claims != NULL) ck_ok(store_set_text(s, "/operator", "precision", r->claims, &error));
    if (!r->no_I)
        ck_ok(
            store_write(s, "/operator/I", STORE_U64, 1, &I_size, r->begin[2] > 0 ? r->begin : usual, &error));
    if (r->weight_size > 0) write_floats(s, "/operator/weight", 1, &r->weight_size, .1f, r->weight);
    if (r->coherence_size > 0)
        write_floats(s, "/operator/coherence", 1, &r->coherence_size, .5f, r->coherence);
    if (r->factored) write_floats(s, "/operator/core", 3, (size_t[]){C, 2, 2}, .1f, .1f);
    ck_ok(store_seal(s, &error));
}

START_TEST(files_are_judged) {
    const recipe *r = &recipes[_i];
    write_recipe(r);
    operator_file_judge(r->what, r->word == NULL ? LAM_OK : LAM_ERR_FORMAT, r->word);
}
END_TEST

START_TEST(patches_can_be_asked_for) {
    operator_patches patches = {.k = 77};
    lam_operator *op = NULL;
    write_recipe(&recipes[3]);
    ck_ok(lam_operator_open(operator_file_path, &op, &error));
    ck_assert(operator_patches_of(op, &patches));
    ck_assert_uint_eq(patches.k, 2);
    ck_assert_uint_eq(patches.begin[1], 2);
    ck_assert_ptr_null(patches.order);
    ck_assert_float_eq(patches.coherence[0], .5f);
    lam_operator_close(op);
    write_recipe(&recipes[0]);
    ck_ok(lam_operator_open(operator_file_path, &op, &error));
    ck_assert(operator_patches_of(op, &patches) && patches.coherence == NULL);
    lam_operator_close(op);
    transport t = transport_make(TRANSPORT_FOLDED, false);
    patches.k = 77;
    ck_assert(!operator_patches_of(t.op, &patches) && patches.k == 77);
    transport_free(&t);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("two meshes in a store");
    TCase *tests = tcase_create("files");
    tcase_set_timeout(tests, 120);
    tcase_add_checked_fixture(tests, operator_file_setup, operator_file_teardown);
    tcase_add_loop_test(tests, files_are_judged, 0, (int)(sizeof recipes / sizeof *recipes));
    tcase_add_test(tests, patches_can_be_asked_for);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
