/* Matrices of elements: each question has its own, the one asked for longest ago goes, and what is held is
 * counted in the ledger and fits into it. */
#include "server/scene/matrix_cache.h"
#include "support/suite.h"

static const lam_by by[] = {LAM_BY_GROUPS, LAM_BY_SKY};

/* The question for element e by groups, or by groups and sky. */
static matrix_question question(const uint32_t *e, size_t n_by) {
    return (matrix_question){
        .quantity = LAM_RADIOSITY, .n_by = n_by, .n_elements = 1, .by = by, .elements = e};
}

static bool has(matrix_cache *c, uint32_t e, size_t n_by, float value) {
    float found[2] = {0, 0};
    const matrix_question asked = question(&e, n_by);
    return matrix_cache_find(c, &asked, 2, found) && found[0] == value && found[1] == value;
}

static void put(matrix_cache *c, uint32_t e, size_t n_by, float value) {
    const matrix_question asked = question(&e, n_by);
    matrix_cache_put(c, &asked, 2, (float[]){value, value});
}

START_TEST(questions_have_their_own) {
    matrix_cache *c;
    ck_assert_int_eq(matrix_cache_create(NULL, &c, NULL), LAM_OK);
    put(c, 1, 1, 5);
    put(c, 1, 2, 6);
    put(c, 1, 1, 7); /* it is there already */
    ck_assert(has(c, 1, 1, 5) && has(c, 1, 2, 6));
    ck_assert(!has(c, 2, 1, 5));
    const uint32_t e = 1;
    matrix_question other = question(&e, 1);
    float found[2];
    other.quantity = LAM_IRRADIANCE;
    ck_assert(!matrix_cache_find(c, &other, 2, found));
    other = question(&e, 1);
    ck_assert(!matrix_cache_find(c, &other, 1, found));
    matrix_cache_destroy(c);
}
END_TEST

START_TEST(the_oldest_goes) {
    matrix_cache *c;
    ck_assert_int_eq(matrix_cache_create(NULL, &c, NULL), LAM_OK);
    for (uint32_t e = 0; e < MATRICES_KEPT; e++) put(c, e, 1, (float)e);
    ck_assert(has(c, 0, 1, 0)); /* now 1 is the oldest */
    put(c, 100, 1, 100);
    ck_assert(has(c, 0, 1, 0) && has(c, 100, 1, 100) && !has(c, 1, 1, 1));
    const size_t held = matrix_cache_held(c);
    matrix_cache_clear(c);
    ck_assert(held > 0 && matrix_cache_held(c) == 0 && !has(c, 0, 1, 0));
    matrix_cache_destroy(c);
}
END_TEST

START_TEST(the_ledger_has_the_last_word) {
    matrix_cache *c;
    memory_ledger ledger;
    atomic_init(&ledger.taken, 0);
    atomic_init(&ledger.room, SIZE_MAX);
    ck_assert_int_eq(matrix_cache_create(&ledger, &c, NULL), LAM_OK);
    put(c, 0, 1, 5);
    const size_t one = matrix_cache_held(c);
    ck_assert_uint_eq(atomic_load(&ledger.taken), one);
    atomic_store(&ledger.room, 2 * one);
    for (uint32_t e = 1; e < 4; e++) put(c, e, 1, 5);
    ck_assert_uint_eq(atomic_load(&ledger.taken), 2 * one);
    ck_assert(!has(c, 1, 1, 5) && has(c, 2, 1, 5) && has(c, 3, 1, 5));
    atomic_store(&ledger.room, 0); /* another store was read */
    put(c, 4, 1, 5);
    ck_assert(!has(c, 4, 1, 5));
    ck_assert_uint_eq(atomic_load(&ledger.taken), matrix_cache_held(c));
    matrix_cache_destroy(c);
    ck_assert_uint_eq(atomic_load(&ledger.taken), 0);
    matrix_cache_destroy(NULL);
    ck_assert(!has(NULL, 0, 1, 5));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("matrix_cache");
    TCase *tests = tcase_create("matrix_cache");
    tcase_add_test(tests, questions_have_their_own);
    tcase_add_test(tests, the_oldest_goes);
    tcase_add_test(tests, the_ledger_has_the_last_word);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
