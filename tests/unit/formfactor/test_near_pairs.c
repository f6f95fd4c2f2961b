/* Near pairs by quadrature and the others by rays: merged without counting anything twice. */
#include "solver/formfactor/exchange/pair_factor.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/source.h"
#include "solver/scene/generate/generate.h"
#include "solver/scene/import/import.h"
#include "support/box.h"
#include "support/suite.h"

enum { DIVISIONS = 8, RAYS = 256 };

/* A room with a plate in it. */
static mesh room(void) {
    mesh m = {0};
    const double size[3] = {2, 2, 2};
    const box_cell plate = {.axis = 2, .level = 1, .from = {.3, .4, 1}, .to = {1.2, 1.5, 1}};
    for (size_t i = 0; i < 6 * DIVISIONS * DIVISIONS; i++) {
        const box_cell cell = box_cell_of(size, DIVISIONS, i);
        mesh_add_cell(&m, &cell, cell.level == 0);
    }
    mesh_add_cell(&m, &plate, true);
    mesh_add_cell(&m, &plate, false);
    mesh_finish(&m, .5f);
    return m;
}

static form_factors make(const mesh *m, const recipe *r) {
    uint32_t *order = malloc(m->n * sizeof *order);
    form_factors f = {0};
    lam_error error = {0};
    const form_factor_options how = {.recipe = *r};
    ck_assert_ptr_nonnull(order);
    for (size_t i = 0; i < m->n; i++) order[i] = (uint32_t)i;
    ck_assert_msg(form_factors_make(m, order, &how, &f, &error) == LAM_OK, "%s", error.message);
    free(order);
    return f;
}

START_TEST(near_pairs_are_exact_and_nothing_is_counted_twice) {
    mesh m = room();
    const recipe all = {.source = &source_pairs, .rays = 256, .accuracy = 1e-5, .seed = 9},
                 near = {.source = &source_near_pairs, .rays = RAYS, .accuracy = 7e-5, .seed = 2},
                 rays = {.source = &source_rays, .rays = RAYS, .seed = 2};
    form_factors exact = make(&m, &all), joined = make(&m, &near), counted = make(&m, &rays);
    double of_joined = 0, of_counted = 0, worst_near = 0;
    size_t n_near = 0;
    for (size_t i = 0; i < m.n; i++)
        for (size_t j = 0; j < m.n; j++) {
            const double F = csr_entry(&exact.F, i, j), one = csr_entry(&joined.F, i, j);
            of_joined += (one - F) * (one - F);
            of_counted += pow(csr_entry(&counted.F, i, j) - F, 2);
            /* Well above the threshold, whatever is hidden. */
            if (2 * F * m.area[i] / (m.area[i] + m.area[j]) < 2 * recipe_near(&near)) continue;
            n_near++;
            worst_near = fmax(worst_near, fabs(one - F) / F);
        }
    ck_assert_uint_gt(n_near, m.n);
    /* Rows are scaled by what the rays' share of their sums was off: about .5/sqrt(rays), three times that at
     * either end. */
    ck_assert_double_le(worst_near, .2);
    ck_assert_double_le(joined.repair_mean, .5 / sqrt(RAYS));
    /* Near pairs are a good part of what rays are off by: their own variance is F/(2 rays) each. */
    ck_assert_double_le(of_joined, .8 * of_counted);
    ck_assert_double_gt(joined.pairs.facing, 0);
    ck_assert_double_eq(counted.pairs.facing, 0);
    form_factors_free(&exact);
    form_factors_free(&joined);
    form_factors_free(&counted);
    mesh_free(&m);
}
END_TEST

/* Near are exactly the pairs whose mean unoccluded factor is above the threshold: the plate, sixteen times as
 * large as a cell, is near to a few of the elements that see it. Partly occluded ones are accurate to half of
 * 1/rays. */
START_TEST(near_pairs_are_those_above_the_threshold) {
    mesh m = room();
    const double threshold = .004 * (1 + _i);
    const form_factor_options how = {
        .recipe = {.source = &source_near_pairs, .rays = RAYS, .accuracy = 7e-5, .seed = 2}};
    form_factors f = {0};
    csr G = {0};
    visibility *v = NULL;
    lam_error error = {0};
    pair_factor_rules rules;
    polygon *polygons = malloc(m.n * sizeof *polygons);
    ck_assert_ptr_nonnull(polygons);
    for (size_t i = 0; i < m.n; i++) polygon_of_element(&m, i, &polygons[i]);
    pair_factor_rules_init(&rules);
    const recipe all = {.source = &source_pairs, .rays = 256, .accuracy = 1e-5, .seed = 9};
    form_factors exact = make(&m, &all);
    ck_assert_int_eq(visibility_create(&m, &v, &error), LAM_OK);
    ck_assert_msg(pairs_find(&m, v, &how, threshold, &f, &G, &error) == LAM_OK, "%s", error.message);
    size_t n_near = 0, n_larger = 0, n_partly = 0;
    double off = 0;
    for (size_t i = 0; i < m.n; i++) {
        uint64_t p = G.indptr[i];
        for (size_t j = i + 1; j < m.n; j++) {
            const double g = pair_factor_exchange(&rules, &polygons[i], &polygons[j], 1e-6);
            const double mean = 2 * g / (m.area[i] + m.area[j]);
            const bool there = p < G.indptr[i + 1] && G.indices[p] == j;
            const double seen = m.area[i] * csr_entry(&exact.F, i, j), smaller = fmin(m.area[i], m.area[j]);
            if (there && seen > .01 * g && seen < .99 * g) {
                off += pow(((double)G.data[p] - seen) / smaller, 2);
                n_partly++;
            }
            p += there;
            if (fabs(mean - threshold) < 1e-4 * threshold) continue; /* to rounding */
            ck_assert_int_eq(there, mean > threshold);
            n_near += there;
            n_larger += g / smaller > threshold;
        }
    }
    ck_assert_uint_gt(n_near, 0);
    ck_assert_uint_gt(n_larger, n_near);
    ck_assert_double_eq_tol(f.pairs.accuracy, .5 / RAYS, 1e-12);
    ck_assert_double_le(off, (double)n_partly * pow(.5 / RAYS, 2));
    ck_assert(n_partly > 0 || _i > 0);
    visibility_destroy(v);
    form_factors_free(&f);
    form_factors_free(&exact);
    csr_free(&G);
    free(polygons);
    mesh_free(&m);
}
END_TEST

/* The mean of many seeds tends to the truth: neither regime is biased where they meet. A sanitizer watches
 * the same code with each seed. */
START_TEST(the_mean_is_right) {
#ifdef LAMBERT_FEW_CASES
    enum { SEEDS = 6 };
#else
    enum { SEEDS = 24 };
#endif
    mesh m = room();
    const recipe all = {.source = &source_pairs, .rays = 256, .accuracy = 1e-5, .seed = 9};
    form_factors exact = make(&m, &all);
    double *mean = calloc(m.n * m.n, sizeof *mean);
    ck_assert_ptr_nonnull(mean);
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        const recipe near = {.source = &source_near_pairs, .rays = RAYS, .accuracy = 7e-5, .seed = seed};
        form_factors f = make(&m, &near);
        for (size_t i = 0; i < m.n; i++)
            for (uint64_t p = f.F.indptr[i]; p < f.F.indptr[i + 1]; p++)
                mean[i * m.n + f.F.indices[p]] += (double)f.F.data[p] / SEEDS;
        form_factors_free(&f);
    }
    double off = 0, expected = 0;
    for (size_t i = 0; i < m.n; i++)
        for (size_t j = 0; j < m.n; j++) {
            const double F = csr_entry(&exact.F, i, j);
            off += pow(mean[i * m.n + j] - F, 2);
            expected += F / (2 * RAYS * SEEDS);
        }
    /* Independent samples: no more than the variance of counting everything. */
    ck_assert_double_le(off, expected);
    free(mean);
    form_factors_free(&exact);
    mesh_free(&m);
}
END_TEST

/* Near pairs against rays in generated scenes with quads of any shape: row sums, and rows. */
START_TEST(pairs_see_what_rays_see) {
    static const generate_options scenes[] = {
        {.kind = "cornell", .elements = 400, .reflectance = -1, .seed = 1},
        {.kind = "city", .elements = 600, .variant = 3, .terrain = "hill", .reflectance = -1, .seed = 1}};
    enum { MANY = 4096 };
    char folder[] = "/tmp/lambert-near-XXXXXX", path[64], command[96];
    mesh m = {0};
    import_report report;
    size_t faces;
    lam_error error = {0};
    const import_options how = {.unit = 1, .reflectance = -1};
    ck_assert_ptr_nonnull(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/scene.obj", folder);
    ck_assert_msg(scene_generate(&scenes[_i], path, &faces, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(scene_import(path, &how, &m, &report, &error) == LAM_OK, "%s", error.message);
    const recipe pairs = {.source = &source_pairs, .rays = 256, .accuracy = 7e-5, .seed = 3},
                 rays = {.source = &source_rays, .rays = MANY, .seed = 4};
    form_factors one = make(&m, &pairs), other = make(&m, &rays);
    double off = 0, all = 0;
    for (size_t i = 0; i < m.n; i++) {
        /* Half a ray in sqrt(rays), five times; low-discrepancy rays do better. */
        ck_assert_double_eq_tol(one.row_sums[i], other.row_sums[i], 5 * .5 / sqrt(MANY));
        for (size_t j = 0; j < m.n; j++) {
            const double F = csr_entry(&one.F, i, j);
            off += pow(csr_entry(&other.F, i, j) - F, 2);
            all += F / (2 * MANY);
        }
    }
    ck_assert_double_le(off, 2 * all); /* the variance of counting, and areas that are not equal */
    form_factors_free(&one);
    form_factors_free(&other);
    mesh_free(&m);
    snprintf(command, sizeof command, "rm -r %s", folder);
    ck_assert_int_eq(system(command), 0);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("near_pairs");
    TCase *cases = tcase_create("near_pairs");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, near_pairs_are_exact_and_nothing_is_counted_twice);
    tcase_add_loop_test(cases, near_pairs_are_those_above_the_threshold, 0, 4);
    tcase_add_test(cases, the_mean_is_right);
    tcase_add_loop_test(cases, pairs_see_what_rays_see, 0, 2);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
