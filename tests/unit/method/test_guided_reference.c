/* References of what only multiplies: with a guide as near as an operator is, with one that is of no use, and
 * cancelled.
 */
#include "solver/method/reference.h"
#include "support/box.h"
#include "support/suite.h"

#include "store/status.h"

enum { SIDE = 5, N = 6 * SIDE * SIDE, M = 3 };

static const double size[3] = {10, 6, 3};

/* A guide: the true answer with an error of its own, counting its calls. */
typedef struct teacher {
    const reference *dense;
    double off; /* of the answer, relative */
    int calls;
} teacher;

static lam_status teach(void *context, size_t m, const double *E, double *B, lam_error *error) {
    lam_status status = LAM_OK;
    teacher *t = context;
    t->calls++;
    TRY(reference_solve(t->dense, m, E, B, 0, NULL, error));
    for (size_t k = 0; k < m * N; k++) B[k] = (1 + t->off * (k % 2 == 0 ? 1 : -1)) * B[k];
done:
    return status;
}

static lam_status multiply(const void *context, size_t m, const double *x, double *y, lam_error *error) {
    (void)error;
    csr_multiply_rows(context, 0, N, m, x, y);
    return LAM_OK;
}

typedef struct subject {
    mesh m;
    csr F;
    float rho[N];
    double E[M * N], exact[M * N];
    reference *dense, *product;
} subject;

static void subject_make(subject *s) {
    lam_error error = {.message = ""};
    s->m = box_mesh(size, SIDE, .5f);
    s->F = box_form_factors(size, SIDE, s->m.area);
    for (size_t i = 0; i < N; i++) s->rho[i] = .2f + .6f * (float)(i % 7) / 7;
    for (size_t k = 0; k < M * N; k++) s->E[k] = k % N == 11 * (k / N) ? 1 : .01 * (double)(k % 5);
    const factor_product product = {.n = N, .multiply = multiply, .context = &s->F};
    ck_ok(reference_create(&s->F, s->m.area, s->rho, REFERENCE_DENSE, &s->dense, &error));
    ck_ok(reference_create_of(&product, s->m.area, s->rho, REFERENCE_ITERATED, &s->product, &error));
    ck_ok(reference_solve(s->dense, M, s->E, s->exact, 0, NULL, &error));
}

static void subject_free(subject *s) {
    reference_destroy(s->dense);
    reference_destroy(s->product);
    csr_free(&s->F);
    mesh_free(&s->m);
}

static double distance(const subject *s, const double *B) {
    double off = 0, all = 0;
    for (size_t k = 0; k < M * N; k++) {
        off += (B[k] - s->exact[k]) * (B[k] - s->exact[k]);
        all += s->exact[k] * s->exact[k];
    }
    return sqrt(off / all);
}

/* An error of .03 leaves .001, .00003 ... of the first guess. */
START_TEST(a_good_guide_needs_few_steps) {
    lam_error error = {.message = ""};
    static const struct {
        double off;
        int most;
    } cases[] = {{.03, 7}, {.001, 4}};
    subject s;
    subject_make(&s);
    for (size_t c = 0; c < 2; c++) {
        teacher t = {s.dense, cases[c].off, 0};
        const reference_guide guide = {teach, &t};
        double B[M * N];
        memcpy(B, s.E, sizeof B);
        ck_ok(reference_solve_guided(s.product, M, s.E, B, 1e-7, &guide, NULL, &error));
        ck_assert_double_lt(distance(&s, B), 1e-7);
        ck_assert_int_le(t.calls, cases[c].most);
    }
    subject_free(&s);
}
END_TEST

/* Where steps do not shrink, the iteration goes on without the guide. */
START_TEST(a_bad_guide_does_no_harm) {
    lam_error error = {.message = ""};
    subject s;
    subject_make(&s);
    for (int k = 0; k < 2; k++) {
        teacher t = {s.dense, k == 0 ? .9 : 30, 0};
        const reference_guide guide = {teach, &t};
        double B[M * N];
        memcpy(B, s.E, sizeof B);
        ck_ok(reference_solve_guided(s.product, M, s.E, B, 1e-7, &guide, NULL, &error));
        ck_assert_double_lt(distance(&s, B), 1e-5);
        ck_assert_int_lt(t.calls, 5);
    }
    subject_free(&s);
}
END_TEST

static bool stop_at_once(void *context) {
    (void)context;
    return true;
}

static lam_status refuse(void *context, size_t m, const double *E, double *B, lam_error *error) {
    (void)context, (void)m, (void)E, (void)B;
    return status_fail(error, LAM_ERR_NUMERIC, "no answer");
}

START_TEST(errors_pass_through) {
    lam_error error = {.message = ""};
    const progress cancelled = {.cancelled = stop_at_once};
    const reference_guide guide = {refuse, NULL};
    subject s;
    double B[M * N];
    subject_make(&s);
    memcpy(B, s.E, sizeof B);
    ck_assert_int_eq(reference_solve_guided(s.product, M, s.E, B, 1e-7, &guide, NULL, &error),
                     LAM_ERR_NUMERIC);
    ck_assert_str_eq(error.message, "no answer");
    ck_assert_int_eq(reference_solve_guided(s.product, M, s.E, B, 1e-7, &guide, &cancelled, &error),
                     LAM_ERR_CANCELLED);
    subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("guided reference");
    TCase *cases = tcase_create("guided reference");
    tcase_add_test(cases, a_good_guide_needs_few_steps);
    tcase_add_test(cases, a_bad_guide_does_no_harm);
    tcase_add_test(cases, errors_pass_through);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
