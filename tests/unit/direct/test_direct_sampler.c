/* Samples of the direct light of luminaires: without bias, of two independent halves, as the light at points.
 */
#include "solver/direct/direct_points.h"
#include "solver/direct/direct_sampler.h"
#include "support/placed_list.h"

static lam_error error;

/* A room with a block between the luminaires and some of the points. */
static mesh room_with_a_block(void) {
    const double low[3] = {0, 0, 0}, high[3] = {6, 6, 3}, from[3] = {2, 2, 1}, to[3] = {3, 3, 1.5};
    obj_text o = {.used = 0};
    obj_text_room(&o, low, high, 1);
    obj_text_block(&o, "block", from, to, 1);
    return obj_text_mesh(&o);
}

enum { POINTS = 4, KEYS = 2000 };

/* Means over keys are within 5 standard errors of the light at points, which is within .2 %. The halves do
 * not know each other: the covariance of a point's two is within 5 of its own standard errors of 0. */
START_TEST(samples_have_no_bias) {
    static const double points[POINTS][3] = {{1, 1, 0}, {2.5, 2.5, 0}, {3.3, 2.4, 0}, {5, 4, 0}},
                        up[3] = {0, 0, 1};
    double normals[POINTS][3] = {{0}}, mean[POINTS][2] = {{0}}, square[POINTS][2] = {{0}},
           product[POINTS] = {0};
    double product2[POINTS] = {0};
    direct_point at[POINTS];
    float E[3 * POINTS];
    mesh m = room_with_a_block();
    direct_sampler *s = NULL;
    placed_luminaires p =
        placed_list("{\"name\": \"a\", \"file\": \"" FIXTURES
                    "/luminaires/made/lambertian-1000cd-1x1m.ies\", \"at\": [2.4, 2.6, 2.9]},"
                    "{\"name\": \"b\", \"file\": \"" FIXTURES
                    "/luminaires/made/asymmetric-0-360.ies\", \"at\": [4, 1, 2.8], \"dim\": 2},"
                    "{\"name\": \"c\", \"file\": \"" FIXTURES
                    "/luminaires/made/cos4-2019.ies\", \"at\": [1, 5, 2.8], \"dim\": 0}");
    const direct_options options = {.seed = 1};
    for (size_t k = 0; k < POINTS; k++) {
        normals[k][2] = 1;
        memcpy(at[k].at, points[k], sizeof at[k].at);
        at[k].element = 0;
        while (fabs((double)m.normal[at[k].element][2] - 1) > 1e-6 ||
               m.vertices[m.elements[at[k].element][0]][2] > 0)
            at[k].element++;
    }
    ck_ok(direct_points_irradiance(&m, &p, &options, POINTS, at, (const double(*)[3])normals, E, &error));
    ck_ok(direct_sampler_create(&m, &p, &s, &error));
    for (uint64_t key = 0; key < KEYS; key++) {
        double found[POINTS][DIRECT_HALVES] = {{0}};
        direct_sampler_add(s, up, key, POINTS, points, 1, found[0]);
        for (size_t k = 0; k < POINTS; k++) {
            for (size_t h = 0; h < DIRECT_HALVES; h++) {
                mean[k][h] += found[k][h] / KEYS;
                square[k][h] += found[k][h] * found[k][h] / KEYS;
            }
            product[k] += found[k][0] * found[k][1] / KEYS;
            product2[k] += found[k][0] * found[k][0] * found[k][1] * found[k][1] / KEYS;
        }
    }
    for (size_t k = 0; k < POINTS; k++) {
        const double wanted = (double)E[k] + 2 * (double)E[POINTS + k];
        for (size_t h = 0; h < DIRECT_HALVES; h++) {
            const double noise = sqrt((square[k][h] - mean[k][h] * mean[k][h]) / KEYS);
            ck_assert_msg(fabs(mean[k][h] - wanted) <= 5 * noise + .002 * wanted,
                          "point %zu: %g for %g, noise %g", k, mean[k][h], wanted, noise);
        }
        const double noise = sqrt((product2[k] - product[k] * product[k]) / KEYS);
        ck_assert_double_le(fabs(product[k] - mean[k][0] * mean[k][1]), 5 * noise);
    }
    ck_assert_double_gt((double)E[0], 10);
    direct_sampler_free(s);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

/* Where the list leaves all dark they are sampled in full, as a mesh is to fit them. */
START_TEST(dark_ones_are_sampled_in_full) {
    static const double point[1][3] = {{1, 1, 0}}, up[3] = {0, 0, 1};
    mesh m = room_with_a_block();
    double sum[2] = {0};
    for (int dim = 0; dim < 2; dim++) {
        direct_sampler *s = NULL;
        double found[DIRECT_HALVES] = {0};
        placed_luminaires p = placed_list("{\"name\": \"a\", \"file\": \"" FIXTURES
                                          "/luminaires/made/%s\", \"at\": [1, 1, 2.9], \"dim\": %s}",
                                          "lambertian-1000cd.ies", dim == 0 ? "0" : "1");
        ck_ok(direct_sampler_create(&m, &p, &s, &error));
        direct_sampler_add(s, up, 7, 1, point, 1, found);
        sum[dim] = found[0] + found[1];
        direct_sampler_free(s);
        placed_free(&p);
    }
    ck_assert_double_gt(sum[1], 100);
    ck_assert_double_eq(sum[0], sum[1]);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("direct_sampler");
    TCase *tests = tcase_create("all");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, samples_have_no_bias);
    tcase_add_test(tests, dark_ones_are_sampled_in_full);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
