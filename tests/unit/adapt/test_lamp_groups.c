/* Shares of the samples of lamps: a density for any scene, most of it where light comes from, and no other
 * light by it. */
#include "solver/adapt/gather.h"
#include "solver/adapt/lamp_groups.h"
#include "support/box.h"
#include "support/suite.h"

#include <stdlib.h>

static const float rho = .5f;

/* A floor at 0, and above it a lamp that it sees, at 1 m, one of the 20-fold power that a plate hides, and a
 * third one below the floor. */
enum { FLOOR, PLATE, SEEN, HIDDEN, BELOW, PARTS };

static mesh three_lamps(void) {
    static const box_cell cells[PARTS] = {
        [FLOOR] = {.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {3, 3, 0}},
        [PLATE] = {.axis = 2, .level = .9, .from = {2, .5, .9}, .to = {4, 2.5, .9}},
        [SEEN] = {.axis = 2, .level = 1, .from = {.2, 1, 1}, .to = {1.2, 2, 1}},
        [HIDDEN] = {.axis = 2, .level = 1, .from = {2.5, 1, 1}, .to = {3.5, 2, 1}},
        [BELOW] = {.axis = 2, .level = -3, .from = {.2, 1, -3}, .to = {1.2, 2, -3}}};
    static const float emission[PARTS] = {[SEEN] = 1, [HIDDEN] = 20, [BELOW] = 5};
    mesh m = {0};
    for (int k = 0; k < PARTS; k++) mesh_add_cell(&m, &cells[k], k != SEEN && k != HIDDEN);
    mesh_finish(&m, rho);
    for (int k = 0; k < PARTS; k++) m.emission[k] = emission[k];
    return m;
}

static double share_of(const lamp_groups *l, const lamp_shares *shares, uint32_t element) {
    return lamp_groups_density(l, shares, element) * l->m->area[element];
}

START_TEST(what_lights_a_place_has_the_samples) {
    static const double points[2][3] = {{.7, 1.4, 0}, {.8, 1.6, 0}};
    mesh m = three_lamps();
    visibility *v = NULL;
    lamp_groups l;
    lamp_shares shares;
    lam_error error = {0};
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(lamp_groups_make(&m, v, m.emission, &l, &error));
    ck_assert_uint_eq(l.n_groups, 3);
    lamp_groups_share(&l, FLOOR, 7, 2, points, &shares);
    const double seen = share_of(&l, &shares, SEEN), hidden = share_of(&l, &shares, HIDDEN),
                 below = share_of(&l, &shares, BELOW);
    printf("seen %.3f, hidden %.3f, below %.3f\n", seen, hidden, below);
    ck_assert_double_eq_tol(seen + hidden + below, 1, 1e-12);
    /* Power alone gives .04, .77 and .19; of the hidden one's at most a tenth stays, and a ninth of the
     * rest. */
    ck_assert_double_gt(seen, .5);
    ck_assert_double_lt(hidden, .4);
    ck_assert_double_lt(below, .1 * 5 / 26 + 1e-9);
    ck_assert(hidden > 0 && below > 0);
    lamp_groups_free(&l);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* Means over keys are those of rays alone, which know of no lamp, with less noise. */
START_TEST(shares_change_no_light) {
    enum { KEYS = 400 };
    static const double points[2][3] = {{.7, 1.4, 0}, {2.6, .4, 0}};
    mesh m = three_lamps();
    double mean[2][2] = {{0}}, square[2][2] = {{0}};
    lam_error error = {0};
    for (int by_lamps = 0; by_lamps < 2; by_lamps++) {
        gather *g = NULL;
        ck_ok(gather_create(&m, 1, m.emission, by_lamps ? m.emission : NULL, NULL, NULL, &g, &error));
        for (uint64_t key = 0; key < KEYS; key++) {
            double H[2 * GATHER_HALVES];
            gather_at(g, FLOOR, key, 2, points, H);
            for (int p = 0; p < 2; p++) {
                const double h = (H[2 * p] + H[2 * p + 1]) / 2;
                mean[by_lamps][p] += h / KEYS;
                square[by_lamps][p] += h * h / KEYS;
            }
        }
        gather_free(g);
    }
    for (int p = 0; p < 2; p++) {
        const double variance[2] = {square[0][p] - mean[0][p] * mean[0][p],
                                    square[1][p] - mean[1][p] * mean[1][p]};
        printf("point %d: rays %.4f, %.4f at a key; lamps %.4f, %.4f\n", p, mean[0][p], sqrt(variance[0]),
               mean[1][p], sqrt(variance[1]));
        ck_assert_double_gt(mean[0][p], .01);
        ck_assert_double_le(fabs(mean[0][p] - mean[1][p]), 4 * sqrt((variance[0] + variance[1]) / KEYS));
        ck_assert_double_lt(variance[1], .7 * variance[0]);
    }
    mesh_free(&m);
}
END_TEST

/* 600 lamps of different power are 256 groups; each is found as often as its density says. */
START_TEST(many_lamps) {
    enum { LAMPS = 600, PLACES = 60000 };
    static const double point[1][3] = {{.5, .5, 0}};
    mesh m = {0};
    visibility *v = NULL;
    lamp_groups l;
    lamp_shares shares;
    lam_error error = {0};
    mesh_add_cell(&m, &(box_cell){.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {60, 1, 0}}, true);
    for (int k = 0; k < LAMPS; k++)
        mesh_add_cell(&m,
                      &(box_cell){.axis = 2, .level = 2, .from = {.1 * k, 0, 2}, .to = {.1 * k + .08, 1, 2}},
                      false);
    mesh_finish(&m, rho);
    for (int k = 1; k <= LAMPS; k++) m.emission[k] = (float)(1 + k % 7);
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(lamp_groups_make(&m, v, m.emission, &l, &error));
    ck_assert_uint_eq(l.n, LAMPS);
    ck_assert_uint_eq(l.n_groups, LAMP_GROUPS_MOST);
    lamp_groups_share(&l, 0, 1, 1, point, &shares);
    size_t found[LAMPS + 1] = {0};
    double sum = 0;
    for (size_t k = 0; k < PLACES; k++) found[lamp_groups_at(&l, &shares, ((double)k + .5) / PLACES)]++;
    ck_assert_uint_eq(found[0], 0);
    for (uint32_t k = 1; k <= LAMPS; k++) {
        const double share = share_of(&l, &shares, k);
        sum += share;
        /* the places of a lamp are one interval */
        ck_assert_double_le(fabs((double)found[k] / PLACES - share), 1.01 / PLACES);
    }
    ck_assert_double_eq_tol(sum, 1, 1e-9);
    ck_assert_double_gt(share_of(&l, &shares, 6), 20 * share_of(&l, &shares, 596));
    lamp_groups_free(&l);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("lamp groups");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 300);
    tcase_add_test(c, what_lights_a_place_has_the_samples);
    tcase_add_test(c, shares_change_no_light);
    tcase_add_test(c, many_lamps);
    suite_add_tcase(s, c);
    return suite_run(s);
}
