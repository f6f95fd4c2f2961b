/* Form factors pair by pair: exact where nothing is between, the seen share where something is. */
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/sight/occlusion.h"
#include "support/plates.h"
#include "support/suite.h"

#include <omp.h>

static csr exchange(const mesh *m, double accuracy, uint64_t seed, pairs_report *report) {
    const pairs_options options = {
        .tolerance = 1e-6, .accuracy = accuracy, .segments = 8, .segments_most = 1e12, .seed = seed};
    lam_error error = {0};
    visibility *v = NULL;
    csr G = {0};
    pairs_report ignored;
    ck_assert_msg(visibility_create(m, &v, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(pairs_exchange(m, v, &options, &G, report != NULL ? report : &ignored, NULL, &error) ==
                      LAM_OK,
                  "%s", error.message);
    visibility_destroy(v);
    return G;
}

/* G holds the upper triangle. */
static double entry(const csr *G, size_t a, size_t b) {
    return a < b ? csr_entry(G, a, b) : csr_entry(G, b, a);
}

START_TEST(closed_room_is_exact) {
    const double size[3] = {10, 6, 3};
    mesh m = box_mesh(size, 5, .5f);
    pairs_report report;
    csr G = exchange(&m, 1e-4, 1, &report), exact = box_form_factors(size, 5, m.area);
    ck_assert_double_eq(report.hidden, 0);
    ck_assert_double_eq(report.certain, report.facing); /* a convex room */
    for (size_t i = 0; i < m.n; i++) {
        double sum = 0;
        for (size_t j = 0; j < m.n; j++) {
            const double F = entry(&exact, i, j), g = i == j ? 0 : entry(&G, i, j);
            sum += g;
            /* The tolerance, and what single precision rounds; exact is of the smaller index. */
            ck_assert_double_eq_tol(g / m.area[i < j ? i : j], F, 2e-6 * F + 1e-12);
        }
        ck_assert_double_eq_tol(sum / m.area[i], 1, 2e-6);
    }
    csr_free(&G);
    csr_free(&exact);
    mesh_free(&m);
}
END_TEST

START_TEST(occluded_plates_are_right) {
    for (size_t c = 0; c < sizeof plates_cases / sizeof *plates_cases; c++) {
        mesh m = plates(c == 0 ? NULL : plates_cases[c].occluder);
        plates_move(&m, plates_places[_i][0], plates_places[_i][1]);
        for (int high = 0; high < 2; high++) {
            /* Promised: 2e-3 and 2e-4 of the factor. */
            const double accuracy = high ? 7e-6 : 7e-5, allowed = (high ? 2e-4 : 2e-3) * plates_cases[c].F;
            csr G = exchange(&m, accuracy, 1, NULL);
            ck_assert_double_eq_tol(entry(&G, 0, 1) / m.area[0], plates_cases[c].F, c > 0 ? allowed : 1e-6);
            csr_free(&G);
        }
        mesh_free(&m);
    }
    mesh m = plates(plates_hidden);
    plates_move(&m, plates_places[_i][0], plates_places[_i][1]);
    csr G = exchange(&m, 2e-4, 1, NULL);
    ck_assert_double_eq(entry(&G, 0, 1), 0); /* exactly: edges must not leak */
    csr_free(&G);
    mesh_free(&m);
}
END_TEST

/* A floor and a wall that share an edge, and a partition across both: what is left is each half of the floor
 * with its half of the wall, which mathematics knows. The kernel is steep along the edge. */
START_TEST(touching_elements_are_right) {
    const box_cell floor = {.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {1, 1, 0}},
                   side = {.axis = 0, .level = 0, .from = {0, 0, 0}, .to = {0, 1, 1}},
                   partition = {.axis = 1, .level = .5, .from = {0, .5, 0}, .to = {1, .5, 1}},
                   half_floor = {.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {1, .5, 0}},
                   half_side = {.axis = 0, .level = 0, .from = {0, 0, 0}, .to = {0, .5, 1}};
    mesh m = {0}, half = {0};
    mesh_add_cell(&m, &floor, true);
    mesh_add_cell(&m, &side, true);
    mesh_add_cell(&m, &partition, true);
    mesh_add_cell(&m, &partition, false);
    mesh_finish(&m, .5f);
    mesh_add_cell(&half, &half_floor, true);
    mesh_add_cell(&half, &half_side, true);
    mesh_finish(&half, .5f);
    csr of_half = exchange(&half, 1e-4, 1, NULL);
    const double exact = 2 * entry(&of_half, 0, 1), accuracy = 7e-5;
    double square = 0;
    for (uint64_t seed = 1; seed <= 8; seed++) {
        csr G = exchange(&m, accuracy, seed, NULL);
        square += pow(entry(&G, 0, 1) - exact, 2) / 8;
        csr_free(&G);
    }
    /* accuracy is the standard error that is stated. */
    ck_assert_double_le(sqrt(square), accuracy);
    csr_free(&of_half);
    mesh_free(&m);
    mesh_free(&half);
}
END_TEST

/* Two plates of many elements and an occluder between. If shared is set, cells of a plate share their
 * corners, which is what makes them neighbours. */
static mesh divided_plates(bool shared) {
    enum { DIVISIONS = 6 };
    const double w = 1. / DIVISIONS;
    mesh m = {0};
    for (int side = 0; side < 2; side++)
        for (int x = 0; x < DIVISIONS; x++)
            for (int y = 0; y < DIVISIONS; y++) {
                const box_cell cell = {.axis = 2,
                                       .level = side,
                                       .from = {x * w, y * w, side},
                                       .to = {(x + 1) * w, (y + 1) * w, side}};
                mesh_add_cell(&m, &cell, side == 0);
            }
    for (size_t e = 0; shared && e < m.n; e++)
        for (int c = 0; c < 4; c++)
            for (uint32_t v = 0; v < m.elements[e][c]; v++) {
                double off = 0;
                for (int d = 0; d < 3; d++) off += fabs(m.vertices[v][d] - m.vertices[m.elements[e][c]][d]);
                if (off < 1e-12) m.elements[e][c] = v;
            }
    const box_cell plate = {.axis = 2, .level = .5, .from = {.25, .25, .5}, .to = {.75, .75, .5}};
    mesh_add_cell(&m, &plate, true);
    mesh_add_cell(&m, &plate, false);
    mesh_finish(&m, .5f);
    return m;
}

/* The pairs sum to the factor of the whole plates, and pairs beside a border are looked at again where
 * elements know their neighbours. */
START_TEST(borders_are_found) {
    double mixed[2];
    for (int shared = 0; shared < 2; shared++) {
        mesh m = divided_plates(shared);
        const size_t plate = (m.n - 2) / 2;
        pairs_report report;
        csr G = exchange(&m, 7e-5, 1, &report);
        double F = 0;
        for (size_t i = 0; i < plate; i++)
            for (size_t j = plate; j < 2 * plate; j++) F += entry(&G, i, j);
        /* The same promise as for the plates as one pair. */
        ck_assert_double_eq_tol(F, plates_cases[3].F, 2e-3 * plates_cases[3].F);
        mixed[shared] = report.mixed;
        csr_free(&G);
        mesh_free(&m);
    }
    ck_assert_double_gt(mixed[1], mixed[0]);
}
END_TEST

/* A room with a plate in it: whatever a seed and the threads are, the factors are symmetric, never more than
 * without the plate, and the same for any number of threads. */
START_TEST(an_occluder_never_raises_a_factor) {
    const double size[3] = {2, 2, 2};
    mesh empty = box_mesh(size, 4, .5f), full = box_mesh(size, 4, .5f);
    const size_t n = empty.n;
    const box_cell cell = {.axis = 2, .level = 1, .from = {.3, .4, 1}, .to = {1.2, 1.5, 1}};
    mesh_add_cell(&full, &cell, true);
    mesh_add_cell(&full, &cell, false);
    lam_error error = {0};
    free(full.area);
    free(full.normal);
    full.area = NULL;
    full.normal = NULL;
    ck_assert_msg(mesh_measure(&full, &error) == LAM_OK, "%s", error.message);
    pairs_report report;
    csr without = exchange(&empty, 1e-3, 3, NULL), with = exchange(&full, 1e-3, 3, &report);
    size_t lowered = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            const double one = entry(&with, i, j), before = entry(&without, i, j);
            ck_assert_double_le(one, before);
            lowered += one < before;
        }
    ck_assert_uint_gt(lowered, 0);
    ck_assert_double_gt(report.hidden, 0);
    ck_assert_double_eq(report.certain + report.settled + report.open + report.hidden + report.mixed,
                        report.facing);
    omp_set_num_threads(1);
    csr again = exchange(&full, 1e-3, 3, NULL);
    omp_set_num_threads(omp_get_num_procs());
    ck_assert_uint_eq(with.indptr[full.n], again.indptr[full.n]);
    ck_assert_mem_eq(with.indices, again.indices, with.indptr[full.n] * sizeof *with.indices);
    ck_assert_mem_eq(with.data, again.data, with.indptr[full.n] * sizeof *with.data);
    csr_free(&without);
    csr_free(&with);
    csr_free(&again);
    mesh_free(&empty);
    mesh_free(&full);
}
END_TEST

/* With fewer segments than all mixed pairs request, each factor is less accurate, with more it is more
 * accurate, and the accuracy is reported. */
START_TEST(segments_are_shared) {
    static const struct {
        double accuracy, least, most;
    } cases[] = {{7e-6, 0, 1e12}, {7e-6, 0, 20000}, {7e-5, 8e6, 1e12}};
    mesh m = divided_plates(true);
    lam_error error = {0};
    visibility *v = NULL;
    ck_assert_msg(visibility_create(&m, &v, &error) == LAM_OK, "%s", error.message);
    for (size_t k = 0; k < 3; k++) {
        const pairs_options options = {.tolerance = 1e-6,
                                       .accuracy = cases[k].accuracy,
                                       .segments = 8,
                                       .segments_least = cases[k].least,
                                       .segments_most = cases[k].most,
                                       .seed = 1};
        pairs_report report;
        csr G = {0};
        ck_assert_msg(pairs_exchange(&m, v, &options, &G, &report, NULL, &error) == LAM_OK, "%s",
                      error.message);
        const size_t plate = (m.n - 2) / 2;
        double F = 0;
        for (size_t i = 0; i < plate; i++)
            for (size_t j = plate; j < 2 * plate; j++) F += entry(&G, i, j);
        if (k == 0) ck_assert_double_eq(report.accuracy, options.accuracy);
        if (k == 1) ck_assert_double_gt(report.accuracy, 2 * options.accuracy);
        if (k == 2) ck_assert_double_lt(report.accuracy, options.accuracy / 2);
        /* The plate's area is 1: independent errors of its mixed pairs, each g = accuracy / 36 m^2, ten times
         * that for what a first look misses. */
        ck_assert_double_le(fabs(F - plates_cases[3].F), 10 * report.accuracy / 36 * sqrt(report.mixed));
        csr_free(&G);
    }
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* N ~ F r^(1/8) with the accuracy asked for at .005, and from where F^2 is more on, the accuracy again at .1.
 */
START_TEST(segments_are_shared_by_factors) {
    enum { PACKET = 8 };
    const double area[] = {1, 1, 256}, accuracy = 7e-5;
    const occlusion o = {.area = area, .accuracy = accuracy, .segments = PACKET};
    const double middle = pow(SEGMENTS_ERROR * .005 / accuracy, 1 / SEGMENTS_POWER),
                 large = pow(SEGMENTS_ERROR * .1 / accuracy, 1 / SEGMENTS_POWER);
    ck_assert_double_eq_tol(occlusion_segments(&o, 0, 1, .005), middle, PACKET);
    ck_assert_double_eq_tol(occlusion_segments(&o, 0, 1, .02), 4 * middle, PACKET);
    ck_assert_double_eq_tol(occlusion_segments(&o, 0, 2, .01), middle, PACKET);
    ck_assert_double_eq_tol(occlusion_segments(&o, 2, 0, .01), middle, PACKET);
    ck_assert_double_eq_tol(occlusion_segments(&o, 0, 1, .1), large, PACKET);
    ck_assert_double_eq_tol(occlusion_segments(&o, 0, 1, .05), large / 4, PACKET);
    ck_assert_double_eq(occlusion_segments(&o, 0, 1, 1e-6), PACKET);
    /* Above .1 ten times a visible half. */
    ck_assert_double_eq_tol(occlusion_segments(&o, 0, 1, .4),
                            pow(SEGMENTS_ERROR * .4 / (2 * accuracy), 1 / SEGMENTS_POWER), PACKET);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("pairs");
    TCase *cases = tcase_create("pairs");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, closed_room_is_exact);
    tcase_add_loop_test(cases, occluded_plates_are_right, 0, sizeof plates_places / sizeof *plates_places);
    tcase_add_test(cases, touching_elements_are_right);
    tcase_add_test(cases, borders_are_found);
    tcase_add_test(cases, an_occluder_never_raises_a_factor);
    tcase_add_test(cases, segments_are_shared);
    tcase_add_test(cases, segments_are_shared_by_factors);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
