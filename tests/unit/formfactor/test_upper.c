/* The upper triangle: merged from packed rows, expanded to rows and gathered again, through a store. */
#include "solver/formfactor/rows/upper.h"
#include "solver/formfactor/source.h"
#include "support/box.h"
#include "support/scene.h"
#include "support/square.h"
#include "support/suite.h"

#include <omp.h>

/* Scaled so that no row of F passes 1. */
enum { RAYS = 100000 };

static csr merge(const square *s, int threads) {
    csr upper = {0};
    lam_error error = {0};
    omp_set_num_threads(threads);
    ck_assert_msg(upper_merge(&s->found, RAYS, s->area, NULL, &upper, &error) == LAM_OK, "%s", error.message);
    return upper;
}

/* g_ij = (c_ij + c_ji)/rays A_i A_j/(A_i + A_j), bit by bit, over more than one panel. */
START_TEST(merged_as_the_definition_says) {
    const size_t n = 700;
    square s = square_make(n, _i == 0 ? ROW_COUNTS : ROW_WEIGHTS, 5);
    csr one = merge(&s, 1), five = merge(&s, 5);
    same_rows(&one, &five);
    size_t p = 0;
    for (size_t i = 0; i < n; i++) {
        for (size_t j = i + 1; j < n; j++) {
            const float sum = s.values[i * n + j] + s.values[j * n + i];
            if (!(sum > 0)) continue;
            const double a = s.area[i], b = s.area[j];
            ck_assert_uint_eq(one.indices[p], j);
            ck_assert(one.data[p] == (float)((double)sum / RAYS * (a * b / (a + b))));
            p++;
        }
        ck_assert_uint_eq(one.indptr[i + 1], p);
    }
    ck_assert_uint_gt(s.n * s.n / 4, 1 << 16); /* entries of a panel */
    csr_free(&one);
    csr_free(&five);
    square_free(&s);
}
END_TEST

START_TEST(expanded_and_gathered_again) {
    const size_t n = 700;
    square s = square_make(n, ROW_COUNTS, 6);
    csr upper = merge(&s, 2), F = merge(&s, 2), again = {0};
    lam_error error = {0};
    double *row_sums = malloc(n * sizeof *row_sums);
    ck_assert_ptr_nonnull(row_sums);
    ck_assert_int_eq(upper_expand(&F, s.area, row_sums, &error), LAM_OK);
    ck_assert_int_eq(csr_check(&F, 2 * upper.indptr[n], "F", &error), LAM_OK);
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (uint64_t p = F.indptr[i]; p < F.indptr[i + 1]; p++) {
            const size_t j = F.indices[p], low = i < j ? i : j, high = i < j ? j : i;
            const uint32_t *first = upper.indices + upper.indptr[low];
            uint64_t q = 0;
            while (first[q] != high) q++;
            ck_assert_uint_lt(upper.indptr[low] + q, upper.indptr[low + 1]);
            ck_assert(F.data[p] == (float)((double)upper.data[upper.indptr[low] + q] / s.area[i]));
            sum += (double)F.data[p];
        }
        ck_assert_double_eq(sum, row_sums[i]);
    }
    /* The gathered triangle may differ from the first one, but expands to the same bits. */
    again = merge(&s, 2);
    ck_assert_int_eq(upper_expand(&again, s.area, row_sums, &error), LAM_OK);
    ck_assert_int_eq(upper_gather(&again, s.area, &error), LAM_OK);
    ck_assert_uint_eq(again.indptr[n], upper.indptr[n]);
    ck_assert_mem_eq(again.indices, upper.indices, upper.indptr[n] * sizeof *upper.indices);
    ck_assert_int_eq(upper_expand(&again, s.area, row_sums, &error), LAM_OK);
    same_rows(&F, &again);
    free(row_sums);
    csr_free(&upper);
    csr_free(&F);
    csr_free(&again);
    square_free(&s);
}
END_TEST

static form_factors make_upper(const mesh *m, bool upper) {
    uint32_t order[96];
    form_factors f = {0};
    lam_error error = {0};
    const form_factor_options how = {.recipe = {.source = &source_rays, .rays = 2000, .seed = 4},
                                     .upper = upper};
    for (uint32_t i = 0; i < 96; i++) order[i] = i;
    ck_assert_msg(form_factors_make(m, order, &how, &f, &error) == LAM_OK, "%s", error.message);
    return f;
}

static lam_status save_and_load(const mesh *m, const form_factors *f, form_factors *out, lam_error *error) {
    char folder[64], path[128];
    store *s = NULL;
    folder_make(folder);
    snprintf(path, sizeof path, "%s/a.h5", folder);
    ck_assert_msg(store_create(path, &s, error) == LAM_OK, "%s", error->message);
    ck_assert_int_eq(store_set_text(s, "/", "name", "a", error), LAM_OK);
    ck_assert_msg(mesh_save(m, f->row_sums, s, error) == LAM_OK, "%s", error->message);
    ck_assert_msg(form_factors_save(f, s, error) == LAM_OK, "%s", error->message);
    ck_assert_msg(store_seal(s, error) == LAM_OK, "%s", error->message);
    ck_assert_int_eq(store_open(path, &s, error), LAM_OK);
    const lam_status status = form_factors_load(s, m, NULL, out, error);
    store_close(s);
    folder_remove(folder);
    return status;
}

START_TEST(upper_through_a_store) {
    const double size[3] = {1, 2, 1};
    mesh m = box_mesh(size, 4, .5f);
    char *groups[1] = {(char[]){"box"}};
    m.n_groups = 1;
    m.group_names = groups;
    form_factors rows = make_upper(&m, false), upper = make_upper(&m, true), back = {0};
    lam_error error = {0};
    ck_assert_ptr_null(upper.F.indptr);
    ck_assert_uint_eq(2 * upper.upper.indptr[m.n], rows.F.indptr[m.n]);
    ck_assert_msg(save_and_load(&m, &upper, &back, &error) == LAM_OK, "%s", error.message);
    same_rows(&upper.upper, &back.upper);
    ck_assert_int_eq(form_factors_expand(&back, m.area, &error), LAM_OK);
    same_form_factors(&rows, &back);
    ck_assert_int_eq(form_factors_gather(&back, m.area, &error), LAM_OK);
    ck_assert_uint_eq(back.upper.indptr[m.n], upper.upper.indptr[m.n]);
    form_factors_free(&back);

    upper.upper.data[3] = (float)m.area[0] * 1.01f;
    ck_assert_int_eq(save_and_load(&m, &upper, &back, &error), LAM_ERR_FORMAT);
    ck_assert_ptr_nonnull(strstr(error.message, "A_i F_ij of elements 0"));
    upper.upper.data[3] = 0;
    const uint64_t first = upper.upper.indptr[40];
    ck_assert_uint_gt(upper.upper.indptr[41], first);
    upper.upper.indices[first] = 7;
    ck_assert_int_eq(save_and_load(&m, &upper, &back, &error), LAM_ERR_FORMAT);
    ck_assert_ptr_nonnull(strstr(error.message, "row 40 has the column 7"));
    ck_assert_ptr_null(back.upper.indptr);
    form_factors_free(&rows);
    form_factors_free(&upper);
    m.group_names = NULL;
    m.n_groups = 0;
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("upper");
    TCase *cases = tcase_create("upper");
    tcase_set_timeout(cases, 300);
    tcase_add_loop_test(cases, merged_as_the_definition_says, 0, 2);
    tcase_add_test(cases, expanded_and_gathered_again);
    tcase_add_test(cases, upper_through_a_store);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
