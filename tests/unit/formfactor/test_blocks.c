/* Form factors by blocks: closed forms with and without something in between, at several scales and places,
 * and convergence to pairs. */
#include "solver/formfactor/pairs/pairs.h"
#include "support/blocks.h"
#include "support/plates.h"
#include "support/scene.h"
#include "support/suite.h"

/* F from elements [0, half) to [half, 2 half). */
static double factor_between(const mesh *m, const block_factors *f, size_t half) {
    double area = 0;
    for (size_t i = 0; i < half; i++) area += m->area[i];
    return blocks_exchange(m, f, 0, half, half, half) / area;
}

/* Both plates in 64 elements, what is between them in as many. */
static mesh fine_plates(const double *occluder, const double place[2]) {
    lam_error error = {.message = ""};
    const mesh_refinement how = {.subdivide_levels = 3};
    mesh m = plates(occluder);
    plates_move(&m, place[0], place[1]);
    ck_ok(mesh_refine(&m, &how, &error));
    return m;
}

START_TEST(plates_are_right) {
    /* Elsewhere and at another scale two of the cases are enough. */
    const size_t n_cases = _i == 0 ? sizeof plates_cases / sizeof *plates_cases : 2;
    for (size_t c = 0; c < n_cases; c++) {
        mesh m = fine_plates(c == 0 ? NULL : plates_cases[c].occluder, plates_places[_i]);
        plane_tree tree;
        block_factors f = blocks_of(&m, &tree, 1e-5, 3e-4, NULL);
        ck_assert_double_eq_tol(factor_between(&m, &f, 64), plates_cases[c].F,
                                (c == 0 ? 2e-5 : 2e-3) * plates_cases[c].F);
        block_factors_free(&f);
        plane_tree_free(&tree);
        mesh_free(&m);
    }
    mesh m = fine_plates(plates_hidden, plates_places[_i]);
    block_report report;
    plane_tree tree;
    block_factors f = blocks_of(&m, &tree, 1e-5, 3e-4, &report);
    ck_assert_double_eq(factor_between(&m, &f, 64), 0); /* edges must not leak */
    ck_assert_uint_gt(report.hidden, 0);
    block_factors_free(&f);
    plane_tree_free(&tree);
    mesh_free(&m);
}
END_TEST

/* Of a convex room every pair is open by geometry alone, and rows sum to 1. */
START_TEST(rooms_are_proven_open) {
    const double size[3] = {10, 6, 3};
    double off[3];
    for (int k = 0; k < 3; k++) {
        mesh m = box_mesh(size, 12, .5f);
        block_report report;
        plane_tree tree;
        block_factors f = blocks_of(&m, &tree, pow(10, -2 - k), 1e-3, &report);
        double *one = malloc(m.n * sizeof *one), *sums = malloc(m.n * sizeof *sums);
        ck_assert_uint_eq(report.segments, 0);
        ck_assert_uint_eq(report.hidden + report.shaded + report.shaded_pairs, 0);
        for (size_t i = 0; i < m.n; i++) one[i] = 1;
        blocks_multiply(&f, one, sums);
        off[k] = 0;
        for (size_t i = 0; i < m.n; i++) off[k] = fmax(off[k], fabs(sums[i] - 1));
        free(one);
        free(sums);
        block_factors_free(&f);
        plane_tree_free(&tree);
        mesh_free(&m);
    }
    ck_assert_double_lt(off[0], .2);
    ck_assert_double_lt(off[1], .05);
    ck_assert_double_lt(off[2], .012);
}
END_TEST

static mesh closed_cornell(size_t elements) {
    const generate_options how = {.kind = "cornell", .elements = elements, .closed = true, .reflectance = .5};
    return generate_good(&how);
}

/* |F x - F' x| / |F' x| for a random x, F' by pairs. */
static double distance_from_pairs(const mesh *m, const block_factors *f, const csr *G) {
    double *x = calloc(m->n, sizeof *x), *y = malloc(m->n * sizeof *y), wrong = 0, all = 0, *exact;
    exact = calloc(m->n, sizeof *exact);
    for (size_t i = 0; i < m->n; i++) x[i] = (double)(i * 2654435761u % 1000) / 1000;
    blocks_multiply(f, x, y);
    for (size_t i = 0; i < m->n; i++)
        for (uint64_t p = G->indptr[i]; p < G->indptr[i + 1]; p++) {
            const size_t j = G->indices[p];
            exact[i] += (double)G->data[p] * x[j] / m->area[i];
            exact[j] += (double)G->data[p] * x[i] / m->area[j];
        }
    for (size_t i = 0; i < m->n; i++) {
        wrong += m->area[i] * (y[i] - exact[i]) * (y[i] - exact[i]);
        all += m->area[i] * exact[i] * exact[i];
    }
    free(x);
    free(y);
    free(exact);
    return sqrt(wrong / all);
}

START_TEST(errors_fall_with_the_tolerances) {
    lam_error error = {.message = ""};
    const pairs_options exact = {
        .tolerance = 1e-6, .accuracy = 7e-5, .segments = 8, .segments_most = 1e12, .seed = 3};
    mesh m = closed_cornell(800);
    visibility *v = NULL;
    pairs_report ignored;
    csr G;
    double last = 1;
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(pairs_exchange(&m, v, &exact, &G, &ignored, NULL, &error));
    for (int k = 0; k < 3; k++) {
        plane_tree tree;
        block_factors f = blocks_of(&m, &tree, 3e-2 * pow(.1, k), 3e-2 * pow(.1, k), NULL);
        const double now = distance_from_pairs(&m, &f, &G);
        ck_assert_double_lt(now, .6 * last);
        last = now;
        block_factors_free(&f);
        plane_tree_free(&tree);
    }
    ck_assert_double_lt(last, 3e-3);
    csr_free(&G);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

static bool stop_at_once(void *context) {
    (void)context;
    return true;
}

START_TEST(cancelled_work_ends) {
    lam_error error = {.message = ""};
    mesh m = closed_cornell(300);
    const progress stop = {.cancelled = stop_at_once};
    const block_options options = {
        .open = 1e-3, .shadow = 1e-3, .exact = 1e-6, .progress = &stop, .stage = "blocks"};
    visibility *v = NULL;
    plane_tree tree;
    block_factors f;
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(form_factors_tree(&m, &tree, &error));
    ck_assert_int_eq(blocks_find(&m, v, &tree, &options, &f, NULL, &error), LAM_ERR_CANCELLED);
    plane_tree_free(&tree);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("blocks");
    TCase *cases = tcase_create("blocks");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, plates_are_right, 0, sizeof plates_places / sizeof *plates_places);
    tcase_add_test(cases, rooms_are_proven_open);
    tcase_add_test(cases, errors_fall_with_the_tolerances);
    tcase_add_test(cases, cancelled_work_ends);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
