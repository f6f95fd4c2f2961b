/* Blocks of a scene of which some elements are read: their rows are as good as where all are, for less work.
 */
#include "solver/base/random.h"
#include "solver/formfactor/blocks/blocks_importance.h"
#include "support/blocks.h"
#include "support/scene.h"

#include <math.h>
#include <omp.h>
#include <string.h>

static lam_error error;

enum { VECTORS = 4 };
#ifdef LAMBERT_FEW_CASES /* watches the same code of fewer elements */
enum { ELEMENTS = 1800 };
#else
enum { ELEMENTS = 3000 };
#endif
/* The side of the corner of the floor that is read, of a box of 1 m. */
static const double side = .3;

/* A box with two blocks, of which a corner of the floor is read: the blocks hide a part of all else from it.
 */
typedef struct subject {
    mesh m;
    importance found;
} subject;

static void subject_make(subject *s) {
    const generate_options how = {.kind = "cornell", .elements = ELEMENTS, .closed = true, .reflectance = .5};
    s->m = generate_good(&how);
    s->found = (importance){.n = s->m.n, .read = calloc(s->m.n, sizeof(float))};
    size_t n_read = 0;
    const size_t group = group_find(&s->m, "floor");
    ck_assert_uint_lt(group, s->m.n_groups);
    for (size_t i = 0; i < s->m.n; i++) {
        double at[3];
        mesh_centroid(&s->m, i, at);
        s->found.read[i] = s->m.group[i] == group && at[0] < side && at[1] < side ? 1 : 0;
        n_read += s->found.read[i] > 0;
    }
    ck_assert_uint_gt(n_read, 20);
    ck_assert_uint_lt(n_read, s->m.n / 20);
}

static void subject_free(subject *s) {
    importance_free(&s->found);
    mesh_free(&s->m);
}

static block_options options_of(const subject *s, bool important, double finer) {
    return (block_options){.open = blocks_open / finer,
                           .shadow = blocks_shadow / finer,
                           .exact = 1e-6,
                           .seed = finer > 1 ? 2 : 1,
                           .importance = important ? &s->found : NULL};
}

static void find_importance(subject *s) {
    const block_options options = options_of(s, false, 1);
    visibility *v = NULL;
    plane_tree tree;
    ck_ok(form_factors_tree(&s->m, &tree, &error));
    ck_ok(visibility_create(&s->m, &v, &error));
    ck_ok(blocks_importance(&s->m, v, &tree, &options, &s->found, &error));
    s->found.share_of_bounds = .5;
    visibility_destroy(v);
    plane_tree_free(&tree);
}

/* Light F x on what is read, or on the others; [VECTORS] of random x that are 0 on half of the elements. */
static void light_of(const subject *s, const block_options *options, double *y, block_report *report) {
    plane_tree tree;
    block_factors f = blocks_with(&s->m, &tree, options, report);
    double *x = malloc(s->m.n * sizeof *x);
    uint64_t seed = 5;
    for (size_t v = 0; v < VECTORS; v++) {
        for (size_t i = 0; i < s->m.n; i++) x[i] = fmax(0, random_lcg_unit(&seed) - .5);
        blocks_multiply(&f, x, y + v * s->m.n);
    }
    free(x);
    block_factors_free(&f);
    plane_tree_free(&tree);
}

/* |y - z| over what is read, or over the others, by area. */
static double distance(const subject *s, const double *y, const double *z, bool read) {
    double square = 0;
    for (size_t v = 0; v < VECTORS; v++)
        for (size_t i = 0; i < s->m.n; i++)
            if ((s->found.read[i] > 0) == read)
                square += s->m.area[i] * pow(y[v * s->m.n + i] - z[v * s->m.n + i], 2);
    return sqrt(square);
}

/* The bounds of blocks of what is read are half of those without importance, and no looser than these where
 * importance is above .38; those of others are up to 3.5 times as large. Errors are sums of independent
 * errors of blocks, each within its bound, so that what is read errs no more than without importance, within
 * the scatter of two samples of segments: a fifth, where each is a sum of hundreds of blocks. */
START_TEST(what_is_read_is_as_good_for_less_work) {
    subject s;
    subject_make(&s);
    find_importance(&s);
    const size_t count = VECTORS * s.m.n;
    double *even = malloc(count * sizeof *even), *steered = malloc(count * sizeof *steered),
           *truth = malloc(count * sizeof *truth);
    block_report of_even, of_steered, of_truth;
    const block_options plain = options_of(&s, false, 1), some = options_of(&s, true, 1),
                        fine = options_of(&s, false, 16);
    light_of(&s, &plain, even, &of_even);
    light_of(&s, &some, steered, &of_steered);
    light_of(&s, &fine, truth, &of_truth);
    ck_assert_double_lt(distance(&s, steered, truth, true), 1.2 * distance(&s, even, truth, true));
    ck_assert_double_gt(distance(&s, steered, truth, false), 1.2 * distance(&s, even, truth, false));
    ck_assert_double_lt(of_steered.segments, .8 * of_even.segments);
    /* With bounds of twice the share there are fewer blocks. */
    block_report of_coarse;
    block_options coarse = some;
    importance looser = s.found;
    looser.share_of_bounds *= 2;
    coarse.importance = &looser;
    light_of(&s, &coarse, even, &of_coarse);
    ck_assert_double_lt(of_coarse.segments, .9 * of_steered.segments);
    free(even);
    free(steered);
    free(truth);
    subject_free(&s);
}
END_TEST

/* An element that is read has more than 1 with what comes back. It is a twentieth of all, so that of its
 * light, reflected by half, the others get a twentieth or less, and further bounces double that at most; or
 * they have the least. The bits do not depend on the number of threads. */
START_TEST(importance_is_found_by_coarse_blocks) {
    const int most = omp_get_max_threads();
    subject one, other;
    double mean[2] = {0, 0}, area[2] = {0, 0};
    subject_make(&one);
    subject_make(&other);
    omp_set_num_threads(1);
    find_importance(&one);
    omp_set_num_threads(3);
    find_importance(&other);
    omp_set_num_threads(most);
    ck_assert_mem_eq(one.found.of, other.found.of, one.m.n * sizeof(float));
    for (size_t i = 0; i < one.m.n; i++) {
        const int k = one.found.read[i] > 0;
        mean[k] += one.m.area[i] * (double)one.found.of[i];
        area[k] += one.m.area[i];
        ck_assert_float_ge(one.found.of[i], (float)importance_least);
    }
    ck_assert_double_eq(mean[1] / area[1], 1);
    ck_assert_double_gt(mean[0] / area[0], 1.05 * importance_least);
    ck_assert_double_lt(mean[0] / area[0], .1);
    subject_free(&one);
    subject_free(&other);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("block importance");
    TCase *cases = tcase_create("block importance");
    tcase_set_timeout(cases, 120);
    tcase_add_test(cases, what_is_read_is_as_good_for_less_work);
    tcase_add_test(cases, importance_is_found_by_coarse_blocks);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
