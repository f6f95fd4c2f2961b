/* The law of the share that the mesh leaves of a light, between the lights that a store states it for. */
#include "solver/operator/stated/mesh_law.h"
#include "support/suite.h"

#include <math.h>

enum { G = 3 };
/* The third group was not looked at. */
static double lamps[] = {.1, .2, 0}, even[] = {.02, .04, 0}, single[] = {.4, .8, 0}, groups[] = {.1, .2, 0},
              sky[] = {.3, .1, 0}, cloudy[] = {.2, .2, 0}, ones[] = {1, 1, 0}, power[] = {0, 5, 0},
              areas[] = {1, 3, 5};
static const mesh_figures figures = {.has_lights = true,
                                     .has_even = true,
                                     .has_skies = true,
                                     .has_single = true,
                                     .has_groups = true,
                                     .lights = .15,
                                     .even = .03,
                                     .sky_even = .25,
                                     .sky_cloudy = .2,
                                     .single = .6,
                                     .groups = .15,
                                     .even_emitters = 256,
                                     .groups_emitters = 16,
                                     .n_groups = G,
                                     .variation = {lamps, even, sky, cloudy, single, groups},
                                     .reflected = {ones, ones, ones, ones, ones, ones},
                                     .lights_power = power};

/* m_g^2 of the share that elements lack, m_g^2 + M^2 s_1^2 / 2, M = max(m_g, m); of older stores s_1 is M. */
static double without_sent(double elements2, double scene2, const double *one2) {
    const double alone = one2 != NULL ? elements2 / (1 + one2[G] / 2) : sqrt(1 + 2 * elements2) - 1;
    if (alone >= scene2) return alone;
    return elements2 - scene2 * (one2 != NULL ? one2[G] : scene2) / 2;
}

static double share2(const mesh_shares *m, const mesh_light *light, size_t group) {
    const double *one2 = m->of[MESH_OF_SINGLE];
    const double scene2 = without_sent(mesh_lack_of(m, light, G).elements2, 0, one2);
    return without_sent(mesh_lack_of(m, light, group).elements2, scene2, one2);
}

static mesh_shares made(const mesh_figures *from) {
    mesh_shares m;
    lam_error error = {0};
    ck_ok(mesh_shares_make(from, G, areas, 100, &m, &error));
    return m;
}

START_TEST(light_of_lamps_has_their_share) {
    mesh_shares m = made(&figures);
    const mesh_light own = {.power = 7, .of_lamps = 7, .emitters = 3};
    ck_assert_double_eq_tol(share2(&m, &own, 0), .01, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &own, 1), .04, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &own, 2), .15 * .15, 1e-12); /* as the scene */
    /* The mean of the group lacks a part of second order: by the light that is sent, of the scene or its own,
     * and by that of the group. */
    const double scene2 = (.01 + 3 * .04) / 4, groups2 = (.01 + 3 * .04) / 4;
    ck_assert_double_eq_tol(mesh_lack_of(&m, &own, 0).mean2, 2 * scene2 * groups2, 1e-12);
    ck_assert_double_eq_tol(mesh_lack_of(&m, &own, 1).mean2, 2 * .04 * groups2, 1e-12);
    mesh_shares_free(&m);
}
END_TEST

/* A group that was not lit alone has the mean light of the others and the share of groups. */
START_TEST(whole_groups_have_their_own_shares) {
    double share[] = {.03, .3, 0}, light[] = {8, 2, 0};
    mesh_figures lit = figures;
    lit.group_share = share;
    lit.group_light = light;
    mesh_shares m = made(&lit), older = made(&figures);
    const double shares2[] = {.0009, .09, .15 * .15}, lights[] = {8, 2, 5};
    for (size_t g = 0; g < G; g++) {
        ck_assert_double_eq_tol(m.group_share2[g], shares2[g], 1e-12);
        ck_assert_double_eq_tol(m.group_light[g], lights[g], 1e-12);
    }
    ck_assert_ptr_null(older.group_light);
    const mesh_light whole = {.power = 7,
                              .of_whole = 7,
                              .emitters = 256,
                              .whole = {.known = true, .alone = .75, .scale = .04, .common = 5}};
    ck_assert_double_eq_tol(share2(&m, &whole, 0), .75 * .04 * .01 + .25 * 5 * .0004, 1e-12);
    /* Groups that even out the light of each other leave no less than all elements do. */
    const mesh_light smooth = {.power = 7,
                               .of_whole = 7,
                               .emitters = 256,
                               .whole = {.known = true, .alone = .5, .scale = 1, .common = -30}};
    ck_assert_double_eq_tol(share2(&m, &smooth, 0), .0004, 1e-12);
    mesh_shares_free(&older);
    mesh_shares_free(&m);
}
END_TEST

/* Older stores do not tell what single elements light in common. */
START_TEST(other_light_follows_its_number) {
    static const struct {
        double emitters, share2;
    } all[] = {{.5, .16}, {1, .16}, {4, .04}, {16, .01}, {64, (.01 + .0004) / 2}, {256, .0004}, {1e4, .0004}};
    mesh_shares m = made(&figures);
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        const mesh_light light = {.power = 1, .emitters = all[k].emitters, .others = all[k].emitters};
        ck_assert_double_eq_tol(share2(&m, &light, 0), all[k].share2, 1e-12);
    }
    mesh_shares_free(&m);
}
END_TEST

/* The light of several in common, q, varies as that of all, and the rest as that of one. */
START_TEST(emitters_share_what_they_light_in_common) {
    enum { SINGLE_LIGHT = 50, EVEN_LIGHT = 10 };
    static const double numbers[] = {.5, 1, 4, 20, 256, 1e5};
    mesh_figures from = figures;
    from.light_of[MESH_OF_SINGLE] = SINGLE_LIGHT;
    from.light_of[MESH_OF_EVEN] = EVEN_LIGHT;
    mesh_shares m = made(&from);
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
        /* N lights of power P / N: N squares of each alone, and what all have in common. */
        const double N = fmin(fmax(numbers[k], 1), 256), s = (1 / N - 1. / 256) / (1 - 1. / 256);
        const double light = s * SINGLE_LIGHT + (1 - s) * EVEN_LIGHT;
        const double off = s * SINGLE_LIGHT * .16 + (1 - s) * EVEN_LIGHT * .0004;
        const mesh_light given = {.power = 1, .emitters = 7, .others = numbers[k]};
        ck_assert_double_eq_tol(share2(&m, &given, 0), off / light, 1e-12);
    }
    /* Whole groups are no others, whatever they are. */
    const mesh_light whole = {.power = 2, .of_whole = 1, .emitters = 16, .others = 1};
    ck_assert_double_eq_tol(share2(&m, &whole, 0), (.01 + .16) / 2, 1e-12);
    const mesh_light mixed = {.power = 4, .of_lamps = 2, .of_whole = 1, .emitters = 16, .others = 1};
    ck_assert_double_eq_tol(share2(&m, &mixed, 1), (2 * .04 + .04 + .64) / 4, 1e-12);
    mesh_shares_free(&m);
}
END_TEST

START_TEST(tiles_share_what_they_light_in_common) {
    static double tile[] = {.6, .9, 0};
    mesh_figures from = figures;
    from.has_tiles = true;
    from.sky_tile = .7;
    from.variation[MESH_OF_SKY_TILE] = tile;
    from.reflected[MESH_OF_SKY_TILE] = ones;
    from.light_of[MESH_OF_SKY_TILE] = 4;
    from.light_of[MESH_OF_SKY_EVEN] = 1;
    mesh_shares m = made(&from);
    const double s = (1. / 4 - 1. / 100) / (1 - 1. / 100), q = .25;
    const mesh_light one = {.sky_power = 1, .sky_tiles = 1}, four = {.sky_power = 1, .sky_tiles = 4},
                     all = {.sky_power = 1, .sky_tiles = 100}, unknown = {.sky_power = 1};
    ck_assert_double_eq_tol(share2(&m, &one, 0), .36, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &one, 2), .49, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &four, 0), (s * .36 + (1 - s) * q * .09) / (s + (1 - s) * q), 1e-12);
    ck_assert_double_eq_tol(share2(&m, &all, 0), .09, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &unknown, 0), .09, 1e-12);
    /* Bounced light comes from where a tile shines, as from a group. */
    const mesh_light bounced = {.sky_power = 1, .sky_tiles = 1, .bounced = true};
    ck_assert_double_eq_tol(share2(&m, &bounced, 0), .01, 1e-12);
    mesh_shares_free(&m);
}
END_TEST

START_TEST(skies_and_emissions_weigh_by_power) {
    mesh_shares m = made(&figures);
    const mesh_light alone = {.sky_power = 2}, bounced = {.sky_power = 2, .bounced = true},
                     both = {.power = 1, .of_lamps = 1, .emitters = 3, .sky_power = 3};
    ck_assert_double_eq_tol(share2(&m, &alone, 0), .09, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &alone, 1), .04, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &bounced, 0), .0004, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &both, 0), .25 * .01 + .75 * .09, 1e-12);
    ck_assert(mesh_lack_of(&m, &(mesh_light){.power = 0}, 0).elements2 == 0);
    mesh_shares_free(&m);
}
END_TEST

START_TEST(scene_without_lamps) {
    mesh_figures from = figures;
    from.has_lights = false;
    from.lights_power = NULL;
    from.variation[MESH_OF_LAMPS] = from.reflected[MESH_OF_LAMPS] = NULL;
    mesh_shares m = made(&from);
    const mesh_light one = {.power = 1, .emitters = 1, .others = 1},
                     whole = {.power = 1, .of_whole = 1, .emitters = 16, .others = 0};
    ck_assert_double_eq_tol(share2(&m, &one, 0), .16, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &whole, 0), .01, 1e-12);
    mesh_shares_free(&m);
}
END_TEST

/* A sky that no figure is stated of counts as an even light, whatever lamps there are. */
START_TEST(sky_without_figures) {
    mesh_figures from = figures;
    from.has_skies = false;
    from.light_of[MESH_OF_SINGLE] = from.light_of[MESH_OF_EVEN] = 1;
    mesh_shares m = made(&from);
    ck_assert_double_eq_tol(share2(&m, &(mesh_light){.sky_power = 1, .sky_tiles = 1}, 1), .0016, 1e-12);
    mesh_shares_free(&m);
}
END_TEST

/* A group that reflects nothing of an even light sends nothing on: it has no part in the share of what is
 * sent. */
START_TEST(roofs_send_nothing) {
    double reached[] = {1, 1, 0};
    mesh_figures from = figures;
    from.reflected[MESH_OF_EVEN] = reached;
    from.reflected[MESH_OF_LAMPS] = from.reflected[MESH_OF_SINGLE] = (double[]){1, 1, 8};
    from.variation[MESH_OF_LAMPS] = (double[]){.1, .2, 8};
    mesh_shares all = made(&figures), roofs = made(&from);
    const mesh_light own = {.power = 1, .of_lamps = 1, .emitters = 3};
    const double groups2 = (.01 + 3 * .04) / 4;
    ck_assert_double_eq_tol(mesh_lack_of(&all, &own, 1).mean2, 2 * .04 * groups2, 1e-12);
    ck_assert_double_eq_tol(mesh_lack_of(&roofs, &own, 1).mean2, 2 * .04 * groups2, 1e-12);
    reached[2] = 1;
    mesh_shares streets = made(&from);
    ck_assert_double_gt(mesh_lack_of(&streets, &own, 0).mean2, 2 * mesh_lack_of(&all, &own, 0).mean2);
    mesh_shares_free(&streets);
    mesh_shares_free(&roofs);
    mesh_shares_free(&all);
}
END_TEST

/* Older stores have the lamps' share for any emission, else that of an even light; or nothing. */
START_TEST(older_stores) {
    const mesh_light light = {.power = 1, .emitters = 3};
    mesh_shares m = made(&(mesh_figures){.has_lights = true, .has_even = true, .lights = .15, .even = .03});
    ck_assert_double_eq_tol(share2(&m, &light, 0), .15 * .15, 1e-12);
    mesh_shares_free(&m);
    m = made(&(mesh_figures){.has_even = true, .even = .03});
    ck_assert_double_eq_tol(share2(&m, &light, 1), .03 * .03, 1e-12);
    ck_assert_double_eq_tol(share2(&m, &(mesh_light){.sky_power = 1}, 1), .03 * .03, 1e-12);
    mesh_shares_free(&m);
    m = made(&(mesh_figures){.has_lights = false});
    ck_assert(!mesh_shares_known(&m));
    mesh_shares_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("mesh_law");
    TCase *c = tcase_create("mesh_law");
    tcase_add_test(c, whole_groups_have_their_own_shares);
    tcase_add_test(c, light_of_lamps_has_their_share);
    tcase_add_test(c, other_light_follows_its_number);
    tcase_add_test(c, emitters_share_what_they_light_in_common);
    tcase_add_test(c, tiles_share_what_they_light_in_common);
    tcase_add_test(c, skies_and_emissions_weigh_by_power);
    tcase_add_test(c, scene_without_lamps);
    tcase_add_test(c, sky_without_figures);
    tcase_add_test(c, roofs_send_nothing);
    tcase_add_test(c, older_stores);
    suite_add_tcase(s, c);
    return suite_run(s);
}
