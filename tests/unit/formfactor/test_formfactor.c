/* Sampled form factors against closed forms, and the invariants that repair must keep. */
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/visibility/visibility.h"
#include "support/box.h"
#include "support/plates.h"
#include "support/suite.h"

#include <omp.h>

enum { RAYS = 16384 };

static form_factors trace(const mesh *m, size_t rays, uint64_t seed) {
    uint32_t *order = malloc(m->n * sizeof *order);
    lam_error error = {0};
    form_factors f = {0};
    const form_factor_options options = {.recipe = {.rays = rays, .seed = seed}};
    ck_assert_msg(mesh_z_order(m, order, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(form_factors_make(m, order, &options, &f, &error) == LAM_OK, "%s", error.message);
    free(order);
    return f;
}

/* The invariants: F_ii = 0, 0 <= F <= 1, reciprocity to 1e-6, row sums at most 1. */
static void check_invariants(const mesh *m, const form_factors *f) {
    ck_assert_double_le(f->reciprocity_error, 1e-6);
    for (size_t i = 0; i < m->n; i++) {
        double sum = 0;
        for (uint64_t p = f->F.indptr[i]; p < f->F.indptr[i + 1]; p++) {
            const size_t j = f->F.indices[p];
            const double one = (double)f->F.data[p], other = csr_entry(&f->F, j, i);
            ck_assert_uint_ne(i, j);
            ck_assert(one >= 0 && one <= 1);
            ck_assert_double_le(fabs(m->area[i] * one - m->area[j] * other), 1e-6 * m->area[i] * one);
            sum += one;
        }
        ck_assert_double_eq_tol(sum, f->row_sums[i], 1e-12);
        ck_assert_double_le(sum, 1 + 1e-6);
    }
}

/* Four standard deviations of a count of independent rays; low-discrepancy rays do better. */
static double spread(double F, size_t rays) {
    return 4 * sqrt(F * (1 - F) / (double)rays) + 1e-9;
}

START_TEST(room_closed_forms) {
    const double size[3] = {10, 6, 3};
    mesh m = box_mesh(size, 1, .5f);
    form_factors f = trace(&m, RAYS, 1);
    check_invariants(&m, &f);
    ck_assert(f.closed);
    for (size_t i = 0; i < 6; i++) ck_assert_double_eq_tol(f.row_sums[i], 1, 1e-6);
    ck_assert_double_eq_tol(csr_entry(&f.F, 4, 5), .488700936440, spread(.4887, RAYS));
    ck_assert_double_eq_tol(csr_entry(&f.F, 4, 2), .162387354927, spread(.1624, RAYS));
    ck_assert_double_eq_tol(csr_entry(&f.F, 4, 0), .093262176853, spread(.0933, RAYS));
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

START_TEST(box_against_analytic) {
    const double size[3] = {1, 1, 1};
    mesh m = box_mesh(size, 5, .5f);
    form_factors f = trace(&m, RAYS, 3);
    csr exact = box_form_factors(size, 5, m.area);
    check_invariants(&m, &f);
    double square = 0;
    for (size_t i = 0; i < m.n; i++) {
        ck_assert_double_eq_tol(f.row_sums[i], 1, 1e-6);
        for (size_t j = 0; j < m.n; j++) {
            const double difference = csr_entry(&f.F, i, j) - csr_entry(&exact, i, j);
            square += difference * difference;
            /* Six deviations, because 22,500 pairs are compared. */
            ck_assert_double_le(fabs(difference), 1.5 * spread(csr_entry(&exact, i, j), RAYS) + 1e-6);
        }
    }
    /* House: the 2-norm of merged noise is sqrt(2 / rays); the Frobenius norm is sqrt(n / (2 rays)) for
     * independent rays (variance F/(2 rays), rows summing to 1). */
    ck_assert_double_le(sqrt(square), sqrt((double)m.n / (2. * RAYS)));
    csr_free(&exact);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

START_TEST(occluded_plates) {
    for (size_t c = 0; c < sizeof plates_cases / sizeof *plates_cases; c++) {
        mesh m = plates(c == 0 ? NULL : plates_cases[c].occluder);
        plates_move(&m, plates_places[_i][0], plates_places[_i][1]);
        form_factors f = trace(&m, RAYS, 1);
        check_invariants(&m, &f);
        ck_assert(!f.closed);
        ck_assert_double_eq_tol(csr_entry(&f.F, 0, 1), plates_cases[c].F, spread(plates_cases[c].F, RAYS));
        form_factors_free(&f);
        mesh_free(&m);
    }
    mesh m = plates(plates_hidden);
    plates_move(&m, plates_places[_i][0], plates_places[_i][1]);
    form_factors f = trace(&m, 4 * RAYS, 1);
    ck_assert_double_eq(csr_entry(&f.F, 0, 1), 0); /* exactly: edges must not leak */
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* The L-shaped room of truths.md: 3 x 3 x 3 without the 2 x 2 corner beyond (1, 1). */
START_TEST(l_room_corner_hides) {
    const double walls[][2][2] = {{{3, 0}, {3, 1}}, {{3, 1}, {1, 1}}, {{1, 1}, {1, 3}}, {{1, 3}, {0, 3}}};
    mesh m = {0};
    for (size_t w = 0; w < 4; w++) {
        const double *a = walls[w][0], *b = walls[w][1];
        /* Walking with the room on the left, its inside is the front. */
        const double corners[4][3] = {{a[0], a[1], 0}, {a[0], a[1], 3}, {b[0], b[1], 3}, {b[0], b[1], 0}};
        mesh_add_quad(&m, corners);
    }
    mesh_finish(&m, .5f);
    ck_assert(m.normal[0][0] < 0); /* wall x = 3 looks into the room */
    form_factors f = trace(&m, 4 * RAYS, 1);
    ck_assert_double_eq(csr_entry(&f.F, 0, 3), 0);
    ck_assert_double_eq(csr_entry(&f.F, 3, 0), 0);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

START_TEST(same_for_any_thread_count) {
    const double size[3] = {2, 1, 1};
    mesh m = box_mesh(size, 6, .5f);
    omp_set_num_threads(1);
    form_factors one = trace(&m, 500, 7);
    omp_set_num_threads(5);
    form_factors five = trace(&m, 500, 7);
    const uint64_t nnz = one.F.indptr[m.n];
    ck_assert_mem_eq(one.F.indptr, five.F.indptr, (m.n + 1) * sizeof *one.F.indptr);
    ck_assert_mem_eq(one.F.indices, five.F.indices, nnz * sizeof *one.F.indices);
    ck_assert_mem_eq(one.F.data, five.F.data, nnz * sizeof *one.F.data);
    ck_assert_mem_eq(one.row_sums, five.row_sums, m.n * sizeof *one.row_sums);
    form_factors other = trace(&m, 500, 8);
    ck_assert(other.F.indptr[m.n] != nnz ||
              memcmp(one.F.data, other.F.data, nnz * sizeof *one.F.data) != 0); /* the seed matters */
    form_factors_free(&one);
    form_factors_free(&five);
    form_factors_free(&other);
    mesh_free(&m);
}
END_TEST

/* Plain sweeps take 38 products here, extrapolated ones 15. */
START_TEST(repair_ends_soon) {
    const double size[3] = {4, 1, 1};
    mesh m = box_mesh(size, 8, .5f);
    form_factors f = trace(&m, 500, 3);
    ck_assert_uint_le(f.repair_products, 20);
    check_invariants(&m, &f);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

START_TEST(back_faces_absorb) {
    const double size[3] = {1, 1, 1};
    mesh m = box_mesh(size, 1, .5f);
    const uint32_t corner = m.elements[5][1]; /* the ceiling looks away */
    m.elements[5][1] = m.elements[5][3];
    m.elements[5][3] = corner;
    lam_error error = {0};
    ck_assert_int_eq(mesh_measure(&m, &error), LAM_OK);
    form_factors f = trace(&m, RAYS, 1);
    check_invariants(&m, &f);
    ck_assert_double_eq_tol(f.absorbed[4], .199824895698, spread(.2, RAYS));
    ck_assert_double_eq_tol(f.leaving[5], 1, 1e-12);
    ck_assert_double_eq(csr_entry(&f.F, 4, 5), 0);
    double most = 0;
    for (size_t i = 0; i < m.n; i++) most = fmax(most, fabs(f.repair[i]));
    ck_assert_double_eq(most, f.repair_max);
    /* The repair scales a row with its share outside, o_i, too: d_i (o_i + sum_j F_ij d_j) = 1. With x = log
     * d that is, to first order, x_i + sum_j F_ij x_j = -repair_i, and as sum_j F_ij = 1 - o_i, max |x| <=
     * max |repair| / o: all rows but the ceiling's have the same o by symmetry, .2. The share as the rays
     * found it thus closes the row to o |1 - d_i| <= max |repair|, to second order within a hundredth, as x <
     * .01. */
    const double outside = f.absorbed[4] + f.leaving[4];
    ck_assert_double_le(f.closure_error, 1e-6);
    ck_assert_double_gt(most, 0);
    ck_assert_double_eq_tol(f.row_sums[4] + outside, 1, 1.01 * most + 1e-6);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* A two-sided plate between two plates: its front and its back see different things. */
START_TEST(two_sided_sheet) {
    mesh m = {0};
    const box_cell sheet = {.axis = 2, .level = .5, .from = {0, 0, .5}, .to = {1, 1, .5}};
    const box_cell low = {.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {1, 1, 0}};
    mesh_add_cell(&m, &sheet, true);
    mesh_add_cell(&m, &low, true);
    mesh_finish(&m, .5f);
    lam_error error = {0};
    ck_assert_msg(mesh_make_two_sided(&m, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(m.n, 4); /* sheet, low, back of sheet, back of low */
    form_factors f = trace(&m, RAYS, 1);
    check_invariants(&m, &f);
    ck_assert_double_eq_tol(f.absorbed_share, 0, 1e-12);
    ck_assert_double_eq_tol(f.leaving[0], 1, 1e-12);
    /* Unit squares at distance 1/2: C-11 (2, 2). */
    ck_assert_double_eq_tol(csr_entry(&f.F, 1, 2), .415253283577, spread(.415, RAYS));
    ck_assert_double_eq(csr_entry(&f.F, 1, 0), 0);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* Areas over eight decades: the merge weighs by variance, nothing passes 1, reciprocity holds. */
/* A quad is planar to a millionth of its size only, which is more than rays are lifted by: from either half
 * of one that is bent up or down, no ray may meet the quad itself, nor its back. */
START_TEST(bent_quad_does_not_see_itself) {
    for (int sign = -1; sign <= 1; sign += 2) {
        mesh m = plates(NULL);
        m.vertices[m.elements[0][2]][2] += sign * 2e-6;
        lam_error error = {0};
        ck_assert_msg(mesh_measure(&m, &error) == LAM_OK, "%s", error.message);
        form_factors f = trace(&m, RAYS, 1);
        check_invariants(&m, &f);
        for (size_t i = 0; i < 2; i++) ck_assert_double_eq(f.absorbed[i], 0);
        ck_assert_double_eq_tol(csr_entry(&f.F, 0, 1), .199824895698, spread(.2, RAYS));
        form_factors_free(&f);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(uneven_areas) {
    mesh m = {0};
    const box_cell low = {.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {1, 1, 0}};
    const box_cell high = {.axis = 2, .level = 1, .from = {.5, .5, 1}, .to = {.5001, .5001, 1}};
    mesh_add_cell(&m, &low, true);
    mesh_add_cell(&m, &high, false);
    mesh_finish(&m, .5f);
    form_factors f = trace(&m, RAYS, 1);
    check_invariants(&m, &f);
    /* Seen from the small one: the point form factor under the centre. */
    ck_assert_double_eq_tol(csr_entry(&f.F, 1, 0), .239456470461, spread(.24, RAYS));
    ck_assert_double_eq_tol(csr_entry(&f.F, 0, 1), .239456470461 * 1e-8, 1e-8 * spread(.24, RAYS));
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

START_TEST(auto_rays_follow_the_noise_law) {
    ck_assert_uint_eq(recipe_auto_rays(.1, .25), 4096); /* sqrt(2 / 3200) = .025 */
    ck_assert_uint_eq(recipe_auto_rays(.05, .25), 16384);
    ck_assert_uint_eq(recipe_auto_rays(1, 1), 256);
    ck_assert_uint_eq(recipe_auto_rays(1e-6, .25), 65536);
}
END_TEST

static bool stop_at_once(void *context) {
    (void)context;
    return true;
}

START_TEST(bad_requests_are_refused) {
    const double size[3] = {1, 1, 1};
    mesh m = box_mesh(size, 2, .5f);
    uint32_t order[24];
    for (uint32_t i = 0; i < 24; i++) order[i] = i;
    form_factors f = {0};
    lam_error error = {0};
    form_factor_options options = {.recipe = {.rays = 0, .seed = 1}};
    ck_assert_int_eq(form_factors_make(&m, order, &options, &f, &error), LAM_ERR_ARGUMENT);
    options.recipe.rays = 1000;
    const progress cancelled = {.cancelled = stop_at_once};
    options.progress = &cancelled;
    ck_assert_int_eq(form_factors_make(&m, order, &options, &f, &error), LAM_ERR_CANCELLED);
    ck_assert_ptr_null(f.F.indptr);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("formfactor");
    TCase *cases = tcase_create("formfactor");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, room_closed_forms);
    tcase_add_test(cases, box_against_analytic);
    tcase_add_loop_test(cases, occluded_plates, 0, sizeof plates_places / sizeof *plates_places);
    tcase_add_test(cases, l_room_corner_hides);
    tcase_add_test(cases, same_for_any_thread_count);
    tcase_add_test(cases, repair_ends_soon);
    tcase_add_test(cases, back_faces_absorb);
    tcase_add_test(cases, two_sided_sheet);
    tcase_add_test(cases, bent_quad_does_not_see_itself);
    tcase_add_test(cases, uneven_areas);
    tcase_add_test(cases, auto_rays_follow_the_noise_law);
    tcase_add_test(cases, bad_requests_are_refused);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
