/* The judge's sample of a first bounce against closed forms: the open hemisphere, a wall beside, the ground.
 * test_portals.c has the one of a window. */
#include "solver/formfactor/sky_sample.h"
#include "support/box.h"
#include "support/suite.h"

enum { RAYS = 4096 };

static sky_bounce sample(const mesh *m, const char *tiling, double albedo, uint64_t seed) {
    uint32_t *order = malloc(m->n * sizeof *order);
    lam_error error = {0};
    sky_bounce like = {.n = 0}, made = {.n = 0};
    const form_factor_options how = {.recipe = {.rays = RAYS, .seed = seed}};
    ck_ok(mesh_z_order(m, order, &error));
    ck_ok(sky_bounce_create(tiling, m->up, albedo, m->n, &like, &error));
    ck_ok(sky_sample_make(m, order, &like, &how, &made, &error));
    ck_assert_str_eq(made.tiling.name, tiling);
    ck_assert_uint_eq(made.n, m->n);
    sky_bounce_free(&like);
    free(order);
    return made;
}

/* H0 of an element under a sky of radiance 1. */
static double even(const sky_bounce *s, size_t element) {
    double sum = 0;
    for (size_t t = 0; t < s->tiling.n_tiles; t++) sum += (double)s->first_bounce[t * s->n + element];
    return sum;
}

/* Five standard deviations of pi times the share of independent rays, and the rounding of 145 tiles. */
static double noise(double F) {
    return 5 * M_PI * sqrt(F * (1 - F) / RAYS) + 145 * M_PI * 6e-8;
}

/* A level plate, and a wall of 1e4 times its distance whose top stands at 45 degrees: the plate sees
 * (1 + cos 45) / 2 of the sky; the wall itself, whose back is turned to nothing, half of it and the ground,
 * of which the plate hides less than 1e-6. */
static mesh plate_and_wall(bool wall) {
    const box_cell plate = {.axis = 2, .from = {-5e-4, -5e-4, 0}, .to = {5e-4, 5e-4, 0}},
                   high = {.axis = 1, .level = -1, .from = {-5e3, -1, 0}, .to = {5e3, -1, 1}};
    mesh m = {0};
    mesh_add_cell(&m, &plate, true);
    if (wall) mesh_add_cell(&m, &high, true);
    mesh_finish(&m, .5f);
    return m;
}

START_TEST(open_hemisphere) {
    mesh m = plate_and_wall(false);
    sky_bounce s = sample(&m, "tregenza", .3, 1);
    ck_assert_double_eq_tol(even(&s, 0), M_PI, noise(1));
    for (size_t t = 0; t < s.tiling.n_tiles; t++) {
        const double exact = s.tiling.tiles[t].cosine;
        ck_assert_double_eq_tol((double)s.first_bounce[t], exact, noise(exact / M_PI));
    }
    ck_assert_double_eq(s.ground[0], 0);
    sky_bounce_free(&s);
    mesh_free(&m);
}
END_TEST

START_TEST(wall_beside_and_ground) {
    const double albedo = .4, F = .5 * (1 + sqrt(.5));
    mesh m = plate_and_wall(true);
    sky_bounce dark = sample(&m, "tregenza", 0, 2), light = sample(&m, "tregenza", albedo, 2);
    ck_assert_double_eq_tol(even(&dark, 0), M_PI * F, noise(F));
    ck_assert_double_eq_tol(even(&light, 0), M_PI * F, noise(F));
    ck_assert_double_eq_tol(even(&dark, 1), M_PI * .5, noise(.5));
    ck_assert_double_eq_tol(even(&light, 1), M_PI * (.5 + albedo * .5), noise(.5));
    /* South, where the wall is, the lowest band is dark. */
    ck_assert_double_eq((double)dark.first_bounce[15 * m.n], 0);
    sky_bounce_free(&dark);
    sky_bounce_free(&light);
    mesh_free(&m);
}
END_TEST

/* Single tiles by rays towards them: cosines of the open hemisphere, a wall that hides the south, and
 * what the ground reflects. The cosine across a tile of 12 degrees varies by .21 of its largest at most, and
 * rays stand evenly in the tile. */
START_TEST(rays_towards_tiles) {
    enum { TOWARDS = 64, SOME = 4 };
    const size_t tiles[SOME] = {0, 15, 60, 144}; /* north and south at the horizon, north above, zenith */
    const double albedo = .4;
    for (int k = 0; k < 2; k++) {
        mesh m = plate_and_wall(k == 1);
        sky_bounce s = sample(&m, "tregenza", albedo, 5);
        float *first = malloc(SOME * m.n * sizeof *first);
        lam_error error = {0};
        ck_assert_ptr_nonnull(first);
        ck_ok(sky_sample_tiles(&m, &s, TOWARDS, 6, SOME, tiles, first, &error));
        for (size_t t = 0; t < SOME; t++) {
            const bool hidden = k == 1 && tiles[t] == 15;
            const double exact = hidden ? 0 : s.tiling.tiles[tiles[t]].cosine;
            ck_assert_double_eq_tol((double)first[t * m.n], exact, .21 * exact / 8 + 1e-9);
        }
        if (k ==
            1) /* The wall looks north. It sees the ground, and of the southern tile what that reflects. */
            ck_assert_double_eq_tol((double)first[m.n + 1], .5 * albedo * s.tiling.tiles[15].cosine,
                                    .1 * s.tiling.tiles[15].cosine);
        free(first);
        sky_bounce_free(&s);
        mesh_free(&m);
    }
}
END_TEST

/* Single elements have the numbers of the rows of their tiles. */
START_TEST(pairs_are_parts_of_rows) {
    enum { SOME = 3, TOWARDS = 32 };
    const size_t tiles[SOME] = {0, 15, 60};
    mesh m = plate_and_wall(true);
    sky_bounce s = sample(&m, "tregenza", .3, 5);
    float rows[SOME * 8], pairs[SOME * 8];
    size_t elements[SOME * 8], of[SOME * 8], count = 0;
    lam_error error = {0};
    ck_assert_uint_le(m.n, 8);
    for (size_t k = 0; k < SOME; k++)
        for (size_t i = 0; i < m.n; i++) {
            elements[count] = i;
            of[count++] = tiles[k];
        }
    ck_ok(sky_sample_tiles(&m, &s, TOWARDS, 6, SOME, tiles, rows, &error));
    ck_ok(sky_sample_pairs(&m, &s, TOWARDS, 6, count, elements, of, pairs, &error));
    ck_assert_mem_eq(rows, pairs, count * sizeof *rows);
    sky_bounce_free(&s);
    mesh_free(&m);
}
END_TEST

/* Two samples by which a bounce is judged must not share their rays. */
START_TEST(seeds_differ) {
    mesh m = plate_and_wall(true);
    sky_bounce one = sample(&m, "tregenza", 0, 3), other = sample(&m, "tregenza", 0, 4),
               again = sample(&m, "tregenza", 0, 3);
    const size_t bytes = one.tiling.n_tiles * m.n * sizeof *one.first_bounce;
    ck_assert_mem_eq(one.first_bounce, again.first_bounce, bytes);
    ck_assert_mem_ne(one.first_bounce, other.first_bounce, bytes);
    sky_bounce_free(&one);
    sky_bounce_free(&other);
    sky_bounce_free(&again);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("sky_sample");
    TCase *tc = tcase_create("closed forms");
    tcase_add_test(tc, open_hemisphere);
    tcase_add_test(tc, wall_beside_and_ground);
    tcase_add_test(tc, rays_towards_tiles);
    tcase_add_test(tc, pairs_are_parts_of_rows);
    tcase_add_test(tc, seeds_differ);
    suite_add_tcase(suite, tc);
    return suite_run(suite);
}
