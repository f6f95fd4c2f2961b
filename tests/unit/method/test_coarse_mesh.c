/* The coarse mesh of 2MSC: coherence, splitting, assignment. */
#include "solver/base/random.h"
#include "solver/method/two_mesh/coarse_mesh.h"
#include "support/room.h"
#include "support/suite.h"

#include <omp.h>

static const double hall[3] = {10, 6, 3};
static lam_error error;

static coarse_mesh create(const build_problem *problem, coarse_options options) {
    coarse_mesh c;
    ck_assert_msg(coarse_mesh_create(problem, &options, NULL, &c, &error) == LAM_OK, "%s", error.message);
    /* Every element is in one patch, none is empty. */
    unsigned char *seen = calloc(c.n, 1);
    double area = 0, all = 0;
    ck_assert(c.n == problem->n && c.begin[0] == 0 && c.begin[c.k] == c.n);
    for (size_t p = 0; p < c.k; p++) {
        ck_assert_uint_lt(c.begin[p], c.begin[p + 1]);
        ck_assert(c.coherence[p] >= 0 && c.coherence[p] <= 1);
        ck_assert((double)c.coherence[p] >= c.smallest_coherence - 1e-6 && c.area[p] >= c.smallest_area);
        area += c.area[p];
    }
    for (size_t i = 0; i < c.n; i++) {
        ck_assert(c.element[i] < c.n && !seen[c.element[i]]);
        seen[c.element[i]] = 1;
        all += problem->area[i];
    }
    ck_assert_double_eq_tol(area, all, 1e-12 * all);
    free(seen);
    return c;
}

/* Elements 0 ... 5 see group 0 by a, group 1 by b, each group of area 1. */
static coherence_figures figures_of(const double (*F)[2], const double *area, size_t count) {
    float v[12];
    uint32_t elements[6];
    for (size_t i = 0; i < count; i++) {
        elements[i] = (uint32_t)i;
        v[2 * i] = (float)F[i][0];
        v[2 * i + 1] = (float)F[i][1];
    }
    const group_views all = {.n_groups = 2, .v = v};
    return coherence_measure(&all, area, elements, count);
}

START_TEST(coherence_is_one_where_all_see_the_same) {
    const double same[3][2] = {{.3, .6}, {.3, .6}, {.3, .6}}, area[3] = {1, .25, 7}, nothing[3][2] = {{0}};
    const coherence_figures alike = figures_of(same, area, 3), dark = figures_of(nothing, area, 3);
    ck_assert(alike.coherence == 1 && alike.loss == 0 && alike.area == 8.25);
    ck_assert(dark.coherence == 1 && dark.loss == 0);
}
END_TEST

/* The figures are found by hand. One half of the area sees only group 0, the other only group 1: the mean
 * (.5, .5) keeps half of the squares. Two that see the same way but one twice as much, (1, 2), have the mean
 * 1.5, which keeps 2.25 of 2.5; areas 3 : 1 have the mean 1.25, which keeps 1.5625 of 1.75. All is in double
 * from short binary fractions: some roundings of 1e-16. */
START_TEST(coherence_of_unlike_views) {
    const double apart[2][2] = {{1, 0}, {0, 1}}, twice[2][2] = {{1, 0}, {2, 0}};
    const double even[2] = {1, 1}, uneven[2] = {3, 1};
    ck_assert_double_eq_tol(figures_of(apart, even, 2).coherence, .5, 1e-14);
    ck_assert_double_eq_tol(figures_of(apart, even, 2).loss, 1, 1e-14);
    ck_assert_double_eq_tol(figures_of(twice, even, 2).coherence, .9, 1e-14);
    ck_assert_double_eq_tol(figures_of(twice, uneven, 2).coherence, 1.5625 / 1.75, 1e-14);
    ck_assert_double_eq_tol(figures_of(twice, uneven, 2).loss, 4 * (1.75 - 1.5625), 1e-14);
}
END_TEST

/* A sphere as a matrix: everything sees the same, so that one patch is coherent and is never split. */
START_TEST(a_sphere_is_one_patch) {
    room r = room_create(hall, 4, .5f, 1);
    const size_t n = r.m.n;
    double total = 0;
    r.F.indices = realloc(r.F.indices, n * n * sizeof *r.F.indices);
    r.F.data = realloc(r.F.data, n * n * sizeof *r.F.data);
    for (size_t i = 0; i < n; i++) total += r.m.area[i];
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            r.F.indices[i * n + j] = (uint32_t)j;
            r.F.data[i * n + j] = (float)(r.m.area[j] / total);
        }
        r.F.indptr[i + 1] = (i + 1) * n;
    }
    /* One surface: as if the room's faces were smooth at the edges. */
    memset(r.surface, 0, n * sizeof *r.surface);
    coarse_mesh c = create(room_problem(&r), (coarse_options){.coherence = 1});
    ck_assert_uint_eq(c.k, 1);
    ck_assert_float_eq(c.coherence[0], 1);
    coarse_mesh_free(&c);
    room_free(&r);
}
END_TEST

/* With no more elements than groups, each is its own: coherence is then the share of the squares of S's
 * columns, S = A^1/2 F A^-1/2, that their projection on a patch keeps: S W W^T, W_jp = (A_j / A_p)^1/2. All
 * is in double from the same F, but for views in single precision: 1e-6 of the squares. Patches of one face
 * and patches of several, whose areas differ. */
START_TEST(coherence_is_what_a_patch_keeps_of_S) {
    room r = room_create(hall, 3, .5f, 1);
    const size_t n = r.m.n;
    const double *A = r.m.area;
    double *F = room_dense(&r.F);
    for (size_t k = 4; k <= 16; k += 12) {
        coarse_mesh c = create(room_problem(&r), (coarse_options){.patches = k});
        for (size_t p = 0; p < k; p++) {
            double all = 0, kept = 0;
            for (size_t i = 0; i < n; i++) {
                double along = 0;
                for (uint64_t q = c.begin[p]; q < c.begin[p + 1]; q++) {
                    const size_t j = c.element[q];
                    const double S_ij = sqrt(A[i]) * F[i * n + j] / sqrt(A[j]);
                    all += S_ij * S_ij;
                    along += S_ij * sqrt(A[j] / c.area[p]);
                }
                kept += along * along;
            }
            ck_assert_double_eq_tol((double)c.coherence[p], kept / all, 1e-6);
        }
        coarse_mesh_free(&c);
    }
    free(F);
    room_free(&r);
}
END_TEST

START_TEST(patches_are_as_many_as_asked_for) {
    static const size_t wanted[] = {1, 2, 5, 6, 7, 20, 53, 95, 96, 97, 1000};
    room r = room_create(hall, 4, .5f, 1);
    const size_t k = wanted[_i];
    coarse_mesh c = create(room_problem(&r), (coarse_options){.patches = k});
    ck_assert_uint_eq(c.k, k < 96 ? k : 96);
    /* From the number of faces on, a patch is of one face. */
    for (size_t p = 0; p < c.k && k >= 6; p++)
        for (uint64_t i = c.begin[p]; i < c.begin[p + 1]; i++)
            ck_assert_uint_eq(c.element[i] / 16, c.element[c.begin[p]] / 16);
    coarse_mesh_free(&c);
    room_free(&r);
}
END_TEST

/* A patch of everything sees both ways along each axis. Patches begin as the six directions where surfaces
 * are too many. */
START_TEST(too_many_surfaces_begin_as_directions) {
    room r = room_create(hall, 4, .5f, 1);
    for (size_t i = 0; i < r.m.n; i++) r.surface[i] = (uint32_t)i;
    coarse_mesh c = create(room_problem(&r), (coarse_options){.patches = 6});
    for (size_t p = 0; p < 6; p++)
        for (uint64_t i = c.begin[p]; i < c.begin[p + 1]; i++) ck_assert_uint_eq(c.element[i] / 16, p);
    coarse_mesh_free(&c);
    room_free(&r);
}
END_TEST

START_TEST(splitting_stops_at_the_smallest_area) {
    static const double smallest[] = {100, 30, 5, 1, .3, .01};
    room r = room_create(hall, 8, .5f, 1);
    for (int by_coherence = 0; by_coherence < 2; by_coherence++) {
        const coarse_options options = {.coherence = by_coherence ? .95 : 1, .min_area = smallest[_i]};
        coarse_mesh c = create(room_problem(&r), options);
        for (size_t p = 0; p < c.k; p++) {
            const size_t count = c.begin[p + 1] - c.begin[p];
            ck_assert(count == 1 || c.area[p] <= options.min_area ||
                      (double)c.coherence[p] >= options.coherence - 1e-6);
            /* The patch that it was split from was above: a half is at least 3 / 8 of it (3 of 8 rows, at
             * worst 1 of 3). */
            ck_assert(c.area[p] > options.min_area / 3 || c.area[p] >= 17.9 || count == 1);
        }
        if (smallest[_i] > 60) ck_assert_uint_eq(c.k, 6);
        if (smallest[_i] < .1 && !by_coherence) ck_assert_uint_eq(c.k, r.m.n);
        coarse_mesh_free(&c);
    }
    room_free(&r);
}
END_TEST

START_TEST(splitting_stops_at_the_coherence) {
    static const double coherence[] = {.5, .8, .9, .95};
    room r = room_create(hall, 8, .5f, 1);
    size_t k[4];
    for (int i = 0; i < 4; i++) {
        coarse_mesh c = create(room_problem(&r), (coarse_options){.coherence = coherence[i]});
        k[i] = c.k;
        ck_assert_double_ge(c.smallest_coherence, coherence[i]);
        coarse_mesh_free(&c);
    }
    ck_assert(k[0] <= k[1] && k[1] < k[2] && k[2] < k[3] && k[3] < r.m.n);
    room_free(&r);
}
END_TEST

/* A square of 8 x 8: halves are 8 x 4, then 4 x 4: patches stay compact and are of equal area. */
START_TEST(halves_are_cut_across_the_longest_side) {
    const double cube[3] = {1, 1, 1};
    room r = room_create(cube, 8, .5f, 1);
    coarse_mesh c = create(room_problem(&r), (coarse_options){.coherence = 1, .min_area = 1 / 16. + 1e-9});
    ck_assert_uint_eq(c.k, 6 * 16);
    for (size_t p = 0; p < c.k; p++) {
        ck_assert_double_eq_tol(c.area[p], 1 / 16., 1e-12);
        for (int d = 0; d < 3; d++) {
            double low = 1, high = 0;
            for (uint64_t i = c.begin[p]; i < c.begin[p + 1]; i++) {
                low = fmin(low, r.centre[c.element[i]][d]);
                high = fmax(high, r.centre[c.element[i]][d]);
            }
            ck_assert(high - low < 1 / 8. + 1e-9); /* two cells: centres 1/8 apart */
        }
    }
    coarse_mesh_free(&c);
    room_free(&r);
}
END_TEST

/* Elements at the same place differ only in their number. */
START_TEST(what_lies_in_one_place_is_split_too) {
    room r = room_create(hall, 3, .5f, 1);
    for (size_t i = 0; i < r.m.n; i++)
        for (int d = 0; d < 3; d++) r.centre[i][d] = 0;
    for (size_t k = 7; k <= 54; k += 47) {
        coarse_mesh c = create(room_problem(&r), (coarse_options){.patches = k});
        ck_assert_uint_eq(c.k, k);
        coarse_mesh_free(&c);
    }
    room_free(&r);
}
END_TEST

static double distance(const double a[3], const double b[3]) {
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}

/* Against all distances: the nearest centroid of the same face, or the one that its nearest element keeps.
 * Centres are shaken within their faces: on a grid, halves of halves already are what is nearest. */
START_TEST(proximity_takes_the_nearest) {
    room r = room_create(hall, 8, .5f, 1);
    const size_t n = r.m.n, k = 45;
    uint64_t state = 1;
    for (size_t i = 0; i < n; i++)
        for (int d = 0; d < 3; d++) {
            const double place = random_lcg_unit(&state);
            if (r.m.normal[i][d] == 0) r.centre[i][d] += .6 * (place - .5);
        }
    coarse_mesh a = create(room_problem(&r), (coarse_options){.patches = k});
    coarse_mesh b = create(room_problem(&r), (coarse_options){.patches = k, .proximity = true});
    double(*centre)[3] = calloc(k, sizeof *centre);
    size_t *owner = calloc(n, sizeof *owner), kept = 0, moved = 0;
    for (size_t p = 0; p < k; p++)
        for (uint64_t i = a.begin[p]; i < a.begin[p + 1]; i++) {
            owner[a.element[i]] = p;
            for (int d = 0; d < 3; d++)
                centre[p][d] += r.m.area[a.element[i]] * r.centre[a.element[i]][d] / a.area[p];
        }
    ck_assert_uint_eq(b.k, k);
    for (size_t p = 0; p < k; p++)
        for (uint64_t i = b.begin[p]; i < b.begin[p + 1]; i++) {
            const uint32_t e = b.element[i];
            double nearest = INFINITY;
            ck_assert_uint_eq(a.element[a.begin[p]] / 64, e / 64);
            for (size_t q = 0; q < k; q++)
                if (a.element[a.begin[q]] / 64 == e / 64)
                    nearest = fmin(nearest, distance(r.centre[e], centre[q]));
            const double own = distance(r.centre[e], centre[p]);
            moved += owner[e] != p;
            if (own > nearest * (1 + 1e-9)) { /* stays because it is its patch's nearest */
                ck_assert_uint_eq(owner[e], p);
                for (uint64_t j = a.begin[p]; j < a.begin[p + 1]; j++)
                    ck_assert_double_ge(distance(r.centre[a.element[j]], centre[p]), own * (1 - 1e-9));
                kept++;
            }
        }
    ck_assert_uint_gt(moved, 0);
    ck_assert_uint_lt(kept, k);
    free(centre);
    free(owner);
    coarse_mesh_free(&a);
    coarse_mesh_free(&b);
    room_free(&r);
}
END_TEST

/* Patches of everything face no way: elements stay where they are. */
START_TEST(proximity_leaves_what_faces_no_patch) {
    const double cube[3] = {1, 1, 1};
    room r = room_create(cube, 4, .5f, 1);
    coarse_mesh a = create(room_problem(&r), (coarse_options){.patches = 1});
    coarse_mesh b = create(room_problem(&r), (coarse_options){.patches = 1, .proximity = true});
    ck_assert(a.k == 1 && b.k == 1 && b.begin[1] == 96);
    coarse_mesh_free(&a);
    coarse_mesh_free(&b);
    room_free(&r);
}
END_TEST

/* All in one place, the first patch is the nearest for everything: what stays keeps the others alive. */
START_TEST(proximity_empties_no_patch) {
    room r = room_create(hall, 3, .5f, 1);
    for (size_t i = 0; i < r.m.n; i++)
        for (int d = 0; d < 3; d++) r.centre[i][d] = 1;
    coarse_mesh c = create(room_problem(&r), (coarse_options){.patches = 20, .proximity = true});
    ck_assert_uint_eq(c.k, 20);
    coarse_mesh_free(&c);
    room_free(&r);
}
END_TEST

START_TEST(threads_give_the_same_bits) {
    room r = room_create(hall, 8, .5f, 1);
    const int usual = omp_get_max_threads();
    for (int proximity = 0; proximity < 2; proximity++) {
        const coarse_options options = {.patches = 77, .proximity = proximity};
        omp_set_num_threads(1);
        coarse_mesh a = create(room_problem(&r), options);
        omp_set_num_threads(4);
        coarse_mesh b = create(room_problem(&r), options);
        omp_set_num_threads(usual);
        ck_assert_mem_eq(a.element, b.element, a.n * sizeof *a.element);
        ck_assert_mem_eq(a.begin, b.begin, (a.k + 1) * sizeof *a.begin);
        ck_assert_mem_eq(a.coherence, b.coherence, a.k * sizeof *a.coherence);
        coarse_mesh_free(&a);
        coarse_mesh_free(&b);
    }
    room_free(&r);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("coarse mesh");
    TCase *tests = tcase_create("coarse mesh");
    tcase_set_timeout(tests, 300);
    tcase_add_test(tests, coherence_is_one_where_all_see_the_same);
    tcase_add_test(tests, coherence_of_unlike_views);
    tcase_add_test(tests, a_sphere_is_one_patch);
    tcase_add_test(tests, coherence_is_what_a_patch_keeps_of_S);
    tcase_add_loop_test(tests, patches_are_as_many_as_asked_for, 0, 11);
    tcase_add_test(tests, too_many_surfaces_begin_as_directions);
    tcase_add_loop_test(tests, splitting_stops_at_the_smallest_area, 0, 6);
    tcase_add_test(tests, splitting_stops_at_the_coherence);
    tcase_add_test(tests, halves_are_cut_across_the_longest_side);
    tcase_add_test(tests, what_lies_in_one_place_is_split_too);
    tcase_add_test(tests, proximity_takes_the_nearest);
    tcase_add_test(tests, proximity_empties_no_patch);
    tcase_add_test(tests, proximity_leaves_what_faces_no_patch);
    tcase_add_test(tests, threads_give_the_same_bits);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
