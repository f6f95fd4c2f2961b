/* Answers of every kind of operator refined until they are certified. The form factors here are no scene's:
 * without reciprocity, and in part far from what the operator was made from. */
#include "solver/base/random.h"
#include "support/certified.h"
#include "support/transport.h"

/* F of a transport, rounded to single precision, with areas that are all alike. */
static certified subject(int index) {
    const transport *t = transport_kept(index);
    const size_t n = t->n;
    lam_error error = {0};
    lam_form_factors *made = NULL;
    lam_operator *op = NULL;
    csr F = {.n = n,
             .indptr = test_allocate(n + 1, sizeof *F.indptr),
             .indices = test_allocate(n * n, sizeof *F.indices),
             .data = test_allocate(n * n, sizeof *F.data)};
    double *area = test_allocate(n, sizeof *area);
    for (size_t i = 0; i < n; i++) {
        area[i] = 1;
        F.indptr[i + 1] = F.indptr[i];
        for (size_t j = 0; j < n; j++) {
            if (!(t->F[i * n + j] > 0)) continue;
            F.indices[F.indptr[i + 1]] = (uint32_t)j;
            F.data[F.indptr[i + 1]++] = (float)t->F[i * n + j];
        }
    }
    ck_assert(form_factors_of_rows(&F, area, &made, &error) == LAM_OK);
    free(area);
    op = t->op;
    return certified_make(t->name, op, made);
}

/* The operator is kept. */
static void subject_free(certified *s) {
    for (size_t c = 0; c < lam_operator_channels(s->op); c++) reference_destroy(s->truth[c]);
    free(s->truth);
    lam_refiner_free(s->refiner);
    lam_form_factors_close(s->F);
}

/* Random emission, one bright element, a lamp a million times as bright as the rest, in turns. */
static double *light(const lam_operator *op, size_t n_rhs, uint64_t seed) {
    const size_t n = op->n, rows = n_rhs * op->n_channels;
    double *E = test_allocate(rows * n, sizeof *E);
    for (size_t row = 0; row < rows; row++)
        for (size_t i = 0; i < n; i++) {
            const double x = random_lcg_unit(&seed);
            E[row * n + i] = row % 3 == 1                         ? (i == (row * 7) % n ? 3.0 : 0.0)
                             : row % 3 == 2 && i == (row * 5) % n ? 1e6 * x
                                                                  : x;
        }
    return E;
}

enum { BATCH = 7 };

START_TEST(certificates_cover_the_error) {
    static const double tolerances[] = {.3, 1e-3, 1e-6, 1e-10};
    certified s = subject(_i);
    double *E = light(s.op, BATCH, 5), *H0 = light(s.op, BATCH, 6), largest = 0;
    for (size_t k = 0; k < sizeof tolerances / sizeof *tolerances; k++)
        for (lam_quantity q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++)
            for (int lit = 0; lit < 2; lit++)
                largest =
                    fmax(largest, certified_check(&s, BATCH, q, E, lit ? H0 : NULL, NULL, tolerances[k]));
    /* Certificates are bounds, not numbers out of the air: some error takes a hundredth of its own. */
    ck_assert_double_gt(largest, .01);
    free(E);
    free(H0);
    subject_free(&s);
}
END_TEST

/* A vector alone, in a batch of three and of all, on one thread and on three: the same bits. */
START_TEST(bits_do_not_depend_on_the_batch) {
    certified s = subject(_i);
    const size_t size = s.op->n_channels * s.op->n;
    double *E = light(s.op, BATCH, 8), *all = test_allocate(BATCH * size, sizeof *all),
           *some = test_allocate(BATCH * size, sizeof *some), certificates[2][BATCH];
    size_t iterations[2][BATCH];
    lam_error error = {0};
    for (lam_quantity q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++) {
        ck_assert(lam_refine(s.refiner, BATCH, q, E, NULL, NULL, 1e-7, all, certificates[0], iterations[0],
                             &error) == LAM_OK);
        for (size_t count = 1; count <= 4; count += 2) {
            if (count == 3) lam_operator_set_threads(s.op, 3);
            for (size_t first = 0; first + count <= BATCH; first += count) {
                ck_assert(lam_refine(s.refiner, count, q, E + first * size, NULL, NULL, 1e-7, some,
                                     certificates[1], iterations[1], &error) == LAM_OK);
                ck_assert_mem_eq(some, all + first * size, count * size * sizeof *some);
                ck_assert_mem_eq(certificates[1], certificates[0] + first, count * sizeof **certificates);
                ck_assert_mem_eq(iterations[1], iterations[0] + first, count * sizeof **iterations);
            }
            lam_operator_set_threads(s.op, 1);
        }
    }
    free(E);
    free(all);
    free(some);
    subject_free(&s);
}
END_TEST

/* A tolerance below what double certifies ends, says the bound that was reached, and leaves the outputs as
 * they were. */
START_TEST(a_tolerance_too_small_is_refused) {
    certified s = subject(_i);
    const size_t size = s.op->n_channels * s.op->n;
    double *E = light(s.op, BATCH, 9), *out = test_allocate(BATCH * size, sizeof *out), certificates[BATCH];
    size_t iterations[BATCH];
    lam_error error = {0};
    out[0] = certificates[0] = 77;
    ck_assert(lam_refine(s.refiner, BATCH, LAM_RADIOSITY, E, NULL, NULL, 1e-17, out, certificates, iterations,
                         &error) == LAM_ERR_NUMERIC);
    ck_assert_msg(strstr(error.message, "tolerance 1e-17 is not reached: vector 0 is certified to ") != NULL,
                  "%s", error.message);
    ck_assert(strstr(error.message, "nan") == NULL && strstr(error.message, "inf") == NULL);
    ck_assert(out[0] == 77 && certificates[0] == 77);
    free(E);
    free(out);
    subject_free(&s);
}
END_TEST

START_TEST(darkness_and_bad_arguments) {
    certified s = subject(_i);
    const size_t size = s.op->n_channels * s.op->n;
    double *E = test_allocate(size, sizeof *E), *out = test_allocate(size, sizeof *out), certificate = 77;
    size_t iterations = 77;
    lam_error error = {0};
    for (size_t k = 0; k < size; k++) out[k] = NAN;
    ck_assert(lam_refine(s.refiner, 1, LAM_RADIOSITY, E, NULL, NULL, 1e-16, out, &certificate, &iterations,
                         &error) == LAM_OK);
    for (size_t k = 0; k < size; k++) ck_assert(out[k] == 0);
    ck_assert(certificate == 0);
#define check_refused(word, ...)                                                                             \
    do {                                                                                                     \
        ck_assert(lam_refine(__VA_ARGS__, &error) == LAM_ERR_ARGUMENT);                                      \
        ck_assert_msg(strstr(error.message, word) != NULL, "no '%s' in '%s'", word, error.message);          \
    } while (0)
    static const double bad[] = {0, -1e-3, 1, 2, NAN, INFINITY, -INFINITY};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++)
        check_refused("tolerance = ", s.refiner, 1, LAM_RADIOSITY, E, NULL, NULL, bad[k], out, &certificate,
                      &iterations);
    check_refused("NULL", NULL, 1, LAM_RADIOSITY, E, NULL, NULL, .1, out, &certificate, &iterations);
    check_refused("NULL", s.refiner, 1, LAM_RADIOSITY, NULL, NULL, NULL, .1, out, &certificate, &iterations);
    check_refused("NULL", s.refiner, 1, LAM_RADIOSITY, E, NULL, NULL, .1, NULL, &certificate, &iterations);
    check_refused("quantity 3", s.refiner, 1, (lam_quantity)3, E, NULL, NULL, .1, out, &certificate,
                  &iterations);
    check_refused("more than memory", s.refiner, SIZE_MAX / 2, LAM_RADIOSITY, E, NULL, NULL, .1, out,
                  &certificate, &iterations);
    E[2] = -1;
    check_refused("E[0][2] = -1", s.refiner, 1, LAM_RADIOSITY, E, NULL, NULL, .1, out, &certificate,
                  &iterations);
    E[2] = NAN;
    check_refused("E[0][2] = nan", s.refiner, 1, LAM_RADIOSITY, E, NULL, NULL, .1, out, &certificate,
                  &iterations);
    check_refused("H0[0][2] = nan", s.refiner, 1, LAM_RADIOSITY, out, E, NULL, .1, out, &certificate,
                  &iterations);
#undef check_refused
    ck_assert(lam_refine(s.refiner, 0, LAM_RADIOSITY, E, NULL, NULL, .1, out, &certificate, &iterations,
                         &error) == LAM_OK);
    free(E);
    free(out);
    subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("refining contract");
    TCase *tests = tcase_create("every kind");
    tcase_set_timeout(tests, 300);
    tcase_add_unchecked_fixture(tests, transport_keep_all, transport_free_all);
    tcase_add_loop_test(tests, certificates_cover_the_error, 0, TRANSPORTS);
    tcase_add_loop_test(tests, bits_do_not_depend_on_the_batch, 0, TRANSPORTS);
    tcase_add_loop_test(tests, a_tolerance_too_small_is_refused, 0, TRANSPORTS);
    tcase_add_loop_test(tests, darkness_and_bad_arguments, 0, TRANSPORTS);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
