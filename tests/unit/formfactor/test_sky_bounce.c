/* The first bounce of a sky against closed forms, and the balance of every row. */
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/source.h"
#include "support/blocks.h"
#include "support/box.h"
#include "support/plates.h"
#include "support/suite.h"
#include "support/transport.h"

#include <omp.h>
#include <stdio.h>
#include <unistd.h>

enum { RAYS = 16384 };

static const recipe by_rays = {.rays = RAYS, .seed = 1};

static form_factors trace(const mesh *m, const recipe *how, const char *sky, double albedo) {
    uint32_t *order = malloc(m->n * sizeof *order);
    lam_error error = {0};
    form_factors f = {0};
    const form_factor_options options = {.recipe = *how, .sky = sky, .ground_albedo = albedo};
    ck_assert_msg(mesh_z_order(m, order, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(form_factors_make(m, order, &options, &f, &error) == LAM_OK, "%s", error.message);
    free(order);
    return f;
}

/* H0 of an element under a sky of radiance 1. */
static double uniform_sky(const form_factors *f, size_t element) {
    double sum = 0;
    for (size_t t = 0; t < f->sky.tiling.n_tiles; t++)
        sum += (double)f->sky.first_bounce[t * f->sky.n + element];
    return sum;
}

/* Five standard deviations of pi times the share of independent rays; low-discrepancy rays do better. */
static double noise(double F) {
    return 5 * M_PI * sqrt(F * (1 - F) / RAYS);
}

/* A unit square around the origin whose front looks towards (0, -sin tilt, cos tilt). */
static mesh tilted_plate(double tilt) {
    const double c = cos(tilt), s = sin(tilt);
    const double corners[4][3] = {
        {-.5, -.5 * c, -.5 * s}, {.5, -.5 * c, -.5 * s}, {.5, .5 * c, .5 * s}, {-.5, .5 * c, .5 * s}};
    mesh m = {0};
    mesh_add_quad(&m, corners);
    mesh_finish(&m, .5f);
    return m;
}

/* Single precision rounds each of at most 577 tiles by 6e-8 of itself. */
static const double rounded = 4e-7;

START_TEST(level_plate) {
    static const char *const skies[] = {"tregenza", "reinhart:2", "grid:12x11", "grid:1x1"};
    mesh m = tilted_plate(0);
    for (size_t k = 0; k < 4; k++) {
        form_factors f = trace(&m, &by_rays, skies[k], .3); /* it sees no ground */
        ck_assert_double_eq_tol(uniform_sky(&f, 0), M_PI, rounded);
        for (size_t t = 0; t < f.sky.tiling.n_tiles; t++) {
            const double exact = f.sky.tiling.tiles[t].cosine;
            ck_assert_double_eq_tol((double)f.sky.first_bounce[t], exact, noise(exact / M_PI) + rounded);
        }
        ck_assert_ptr_null(f.sky.ground);
        form_factors_free(&f);
    }
    mesh_free(&m);
}
END_TEST

/* The plate stands level in a scene whose y or x is up. */
START_TEST(level_plate_of_other_axes) {
    for (int up = 0; up < 2; up++) {
        mesh m = {0};
        const box_cell cell = {.axis = up, .from = {-1, -1, -1}, .to = {1, 1, 1}};
        mesh_add_cell(&m, &cell, true);
        mesh_finish(&m, .5f);
        m.up = up == 0 ? 'x' : 'y';
        form_factors f = trace(&m, &by_rays, "tregenza", 0);
        ck_assert_double_eq_tol(uniform_sky(&f, 0), M_PI, rounded);
        form_factors_free(&f);
        mesh_free(&m);
    }
}
END_TEST

/* A plate tilted by b sees (1 + cos b)/2 of the sky and the rest of the ground; what it sees of a tile that
 * is wholly before it is the projected solid angle, about Omega n.c. */
START_TEST(tilted_plates) {
    const double albedo = .4;
    for (int degrees = 0; degrees <= 180; degrees += 30) {
        const double tilt = degrees * M_PI / 180, F = .5 * (1 + cos(tilt));
        mesh m = tilted_plate(tilt);
        form_factors dark = trace(&m, &by_rays, "tregenza", 0),
                     light = trace(&m, &by_rays, "tregenza", albedo);
        ck_assert_double_eq_tol(uniform_sky(&dark, 0), M_PI * F, noise(F) + rounded);
        ck_assert_double_eq_tol(uniform_sky(&light, 0), M_PI * (F + albedo * (1 - F)), noise(F) + rounded);
        for (size_t t = 0; t < 145; t++) {
            const sky_tile *tile = &dark.sky.tiling.tiles[t];
            const double towards = -sin(tilt) * tile->centre[1] + cos(tilt) * tile->centre[2];
            const double got = (double)dark.sky.first_bounce[t];
            /* 12 degrees, the radius of all directions of a tile about its centre and a little more, are .21.
             */
            if (towards < -.21) ck_assert_double_eq(got, 0);
            if (towards > .21)
                ck_assert_double_eq_tol(got, tile->solid_angle * towards,
                                        noise(got / M_PI) + .01 * tile->solid_angle);
            /* The ground lights in proportion to what a tile sends down. */
            const double back = albedo * (1 - F) * tile->cosine;
            ck_assert_double_eq_tol((double)light.sky.first_bounce[t] - got, back, back * noise(F) + rounded);
        }
        form_factors_free(&dark);
        form_factors_free(&light);
        mesh_free(&m);
    }
}
END_TEST

/* A small plate before a wall without end whose top stands at the elevation g sees (1 + cos g)/2 of the sky;
 * the wall, 1e4 times as long as it is far, leaves out less than 1e-7. */
START_TEST(plate_before_a_wall) {
    mesh m = {0};
    const box_cell plate = {.axis = 2, .from = {-5e-4, -5e-4, 0}, .to = {5e-4, 5e-4, 0}};
    const box_cell wall = {.axis = 1, .level = -1, .from = {-5e3, -1, 0}, .to = {5e3, -1, 1}};
    mesh_add_cell(&m, &plate, true);
    mesh_add_cell(&m, &wall, true);
    mesh_finish(&m, .5f);
    form_factors f = trace(&m, &by_rays, "tregenza", 0);
    const double F = .5 * (1 + cos(M_PI / 4));
    /* The sky is 1 minus the row sum of F, in which the wall's share was merged and repaired. */
    ck_assert_double_eq_tol(uniform_sky(&f, 0), M_PI * F, noise(F));
    ck_assert_double_eq_tol(uniform_sky(&f, 0), M_PI * (1 - f.row_sums[0]), 1e-6);
    /* South, where the wall is, the lowest band is dark; north it is not. */
    ck_assert_double_eq((double)f.sky.first_bounce[15 * m.n], 0);
    ck_assert_double_eq_tol((double)f.sky.first_bounce[0], f.sky.tiling.tiles[0].cosine,
                            noise(f.sky.tiling.tiles[0].cosine / M_PI));
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* A pixel counts for the tile that its centre meets: a tile is off by at most what lies within half a pixel's
 * diagonal, an angle of sqrt(2)/resolution, of its border. */
START_TEST(hemicube_of_a_level_plate) {
    const recipe how = {.source = &source_hemicube, .resolution = 256};
    mesh m = tilted_plate(0);
    form_factors f = trace(&m, &how, "tregenza", 0);
    ck_assert_double_eq_tol(uniform_sky(&f, 0), M_PI, rounded);
    for (size_t t = 0; t < 145; t++) {
        const sky_tile *tile = &f.sky.tiling.tiles[t];
        const double border = 2 * (tile->altitude[1] - tile->altitude[0]) +
                              2 * (tile->azimuth[1] - tile->azimuth[0]) * cos(tile->altitude[0]);
        ck_assert_double_eq_tol((double)f.sky.first_bounce[t], tile->cosine,
                                border * 2 * sqrt(2) / 256 * sin(tile->altitude[1]));
    }
    form_factors_free(&f);
    mesh_free(&m);
    m = tilted_plate(M_PI / 3);
    f = trace(&m, &how, "tregenza", 0);
    /* The horizon, pi long, cuts pixels likewise. */
    ck_assert_double_eq_tol(uniform_sky(&f, 0), M_PI * .75, M_PI * 2 * sqrt(2) / 256);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* The square before the other one's back: what meets that back is neither sky nor ground. */
START_TEST(back_faces_take_their_share) {
    mesh m = {0};
    const box_cell low = {.axis = 2, .from = {0, 0, 0}, .to = {1, 1, 0}};
    const box_cell high = {.axis = 2, .level = 1, .from = {0, 0, 1}, .to = {1, 1, 1}};
    mesh_add_cell(&m, &low, true);
    mesh_add_cell(&m, &high, true);
    mesh_finish(&m, .5f);
    form_factors f = trace(&m, &by_rays, "tregenza", 1);
    const double hidden = .199824895698;
    ck_assert_double_eq_tol(uniform_sky(&f, 0), M_PI * (1 - hidden), noise(hidden));
    ck_assert_double_eq_tol(uniform_sky(&f, 1), M_PI, rounded);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

static const recipe ways[] = {{.rays = 1024, .seed = 5},
                              {.source = &source_hemicube, .resolution = 32},
                              {.source = &source_pairs, .rays = 1024, .accuracy = 1e-4, .seed = 5}};
enum { N_WAYS = sizeof ways / sizeof ways[0] };

/* A box without a lid, four cells a face, and a slab of two faces in it; and where nobody sees their backs,
 * one face that looks east and one that looks down. */
static mesh open_box(void) {
    const double size[3] = {2, 3, 1};
    mesh m = {0};
    for (size_t i = 0; i < 5 * 4; i++) {
        const box_cell cell = box_cell_of(size, 2, i);
        mesh_add_cell(&m, &cell, cell.level == 0);
    }
    const box_cell slab = {.axis = 2, .level = .6, .from = {.3, .4, .6}, .to = {1.1, 2.2, .6}};
    mesh_add_cell(&m, &slab, true);
    mesh_add_cell(&m, &slab, false);
    const box_cell wall = {.axis = 0, .level = 5, .from = {5, 0, 0}, .to = {5, 1, 1}};
    const box_cell below = {.axis = 2, .level = -2, .from = {-3, 0, -2}, .to = {-2, 1, -2}};
    mesh_add_cell(&m, &wall, true);
    mesh_add_cell(&m, &below, false);
    mesh_finish(&m, .5f);
    return m;
}

/* With a ground that returns everything, all that leaves a row comes in through it: sum_j F_ij + H0_i/pi = 1;
 * so a scene that emits 1 - rho under a sky of 1/pi is a white furnace although it is open: B = 1 everywhere.
 * Off by no more than the row sums are off 1 (rounding of up to 145 tiles and the sweeps' 2e-8), over
 * 1 - rho. */
START_TEST(open_furnace) {
    mesh m = open_box();
    form_factors f = trace(&m, &ways[_i], "tregenza", 1);
    const size_t n = m.n;
    double *M = test_allocate(n * n, sizeof *M);
    for (size_t i = 0; i < n; i++) {
        ck_assert_double_eq_tol(f.row_sums[i] + uniform_sky(&f, i) * M_1_PI, 1, 1e-6);
        M[i * n + i] = 1;
    }
    for (size_t i = 0; i < n; i++)
        for (uint64_t p = f.F.indptr[i]; p < f.F.indptr[i + 1]; p++)
            M[i * n + f.F.indices[p]] -= .5 * (double)f.F.data[p];
    invert(n, M);
    for (size_t i = 0; i < n; i++) {
        double B = 0;
        for (size_t j = 0; j < n; j++) B += M[i * n + j] * (.5 + .5 * uniform_sky(&f, j) * M_1_PI);
        ck_assert_double_eq_tol(B, 1, 2e-6);
    }
    free(M);
    form_factors_free(&f);

    /* Without a ground nothing comes from below, whatever the rest. */
    f = trace(&m, &ways[_i], "grid:12x11", 0);
    for (size_t i = 0; i < n; i++) ck_assert_double_le(f.row_sums[i] + uniform_sky(&f, i) * M_1_PI, 1 + 1e-6);
    ck_assert_double_gt(uniform_sky(&f, 20), 1);
    /* Half the sky, to five deviations of 1,024 rays or the horizon's pixels of a hemicube, and none of it.
     */
    ck_assert_double_eq_tol(uniform_sky(&f, 22), M_PI / 2, fmax(5 * M_PI * .5 / 32, M_PI * 2 * sqrt(2) / 32));
    ck_assert_double_eq(uniform_sky(&f, 23), 0);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* The same bits for any number of threads, and the same form factors with and without a sky. */
START_TEST(threads_and_bystanders) {
    mesh m = open_box();
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    form_factors one = trace(&m, &ways[_i], "reinhart:2", .2);
    omp_set_num_threads(5);
    form_factors five = trace(&m, &ways[_i], "reinhart:2", .2), none = trace(&m, &ways[_i], NULL, 0);
    omp_set_num_threads(threads);
    ck_assert_mem_eq(one.sky.first_bounce, five.sky.first_bounce, 577 * m.n * sizeof(float));
    ck_assert_ptr_null(none.sky.first_bounce);
    ck_assert_uint_eq(one.F.indptr[m.n], none.F.indptr[m.n]);
    ck_assert_mem_eq(one.F.data, none.F.data, one.F.indptr[m.n] * sizeof(float));
    form_factors_free(&one);
    form_factors_free(&five);
    form_factors_free(&none);
    mesh_free(&m);
}
END_TEST

/* The same box by blocks. */
static form_factors trace_blocks(const mesh *m, const char *sky, double albedo, plane_tree *tree,
                                 block_factors *blocks) {
    uint32_t *order = test_allocate(m->n, sizeof *order);
    lam_error error = {0};
    form_factors f = {0};
    const form_factor_options options = {
        .recipe = {.source = &source_blocks, .rays = 1024, .accuracy = 1e-4, .seed = 5},
        .sky = sky,
        .ground_albedo = albedo};
    ck_ok(mesh_z_order(m, order, &error));
    ck_ok(form_factors_tree(m, tree, &error));
    ck_ok(form_factors_make_blocks(m, order, tree, false, &options, &f, blocks, &error));
    free(order);
    return f;
}

/* F as a product with each unit vector. As above: rows sum to 1 with the sky, and the open furnace is white.
 * An element sees as much of the sky as by pairs but for the error of its row sum: some eight of its pairs,
 * with factors of .06 on average, are partly hidden by the slab, each by lines that err by no more than 32
 * segments, at most .5 / 32^1/2. Three standard deviations of all are 3 8^1/2 .06 .088 = .045. */
START_TEST(blocks_and_the_sky_add_up) {
    mesh m = open_box();
    const size_t n = m.n;
    plane_tree tree;
    block_factors blocks;
    form_factors f = trace_blocks(&m, "tregenza", 1, &tree, &blocks),
                 pairs = trace(&m, &ways[2], "tregenza", 1);
    double *M = test_allocate(n * n, sizeof *M), *one = test_allocate(n, sizeof *one);
    double *row = test_allocate(n, sizeof *row);
    ck_assert(!f.closed);
    for (size_t j = 0; j < n; j++) {
        for (size_t i = 0; i < n; i++) one[i] = i == j;
        blocks_multiply(&blocks, one, row);
        for (size_t i = 0; i < n; i++) M[i * n + j] = (i == j) - .5 * row[i];
    }
    invert(n, M);
    for (size_t i = 0; i < n; i++) {
        double B = 0;
        for (size_t j = 0; j < n; j++) B += M[i * n + j] * (.5 + .5 * uniform_sky(&f, j) * M_1_PI);
        ck_assert_double_eq_tol(B, 1, 2e-6);
        ck_assert_double_eq_tol(f.row_sums[i] + uniform_sky(&f, i) * M_1_PI, 1, 1e-6);
        ck_assert_double_eq_tol(uniform_sky(&f, i), uniform_sky(&pairs, i), M_PI * .045);
    }
    const int threads = omp_get_max_threads();
    plane_tree other_tree;
    block_factors other;
    omp_set_num_threads(5);
    form_factors five = trace_blocks(&m, "tregenza", 1, &other_tree, &other);
    omp_set_num_threads(threads);
    ck_assert_mem_eq(f.sky.first_bounce, five.sky.first_bounce, 145 * n * sizeof(float));
    form_factors_free(&five);
    block_factors_free(&other);
    plane_tree_free(&other_tree);
    form_factors_free(&f);
    form_factors_free(&pairs);
    block_factors_free(&blocks);
    plane_tree_free(&tree);
    free(M);
    free(one);
    free(row);
    mesh_free(&m);
}
END_TEST

START_TEST(closed_scenes_are_dark) {
    const double size[3] = {1, 1, 1};
    mesh m = box_mesh(size, 2, .5f);
    form_factors f = trace(&m, &by_rays, "tregenza", 1);
    ck_assert(f.closed);
    for (size_t i = 0; i < m.n; i++) ck_assert_double_eq(uniform_sky(&f, i), 0);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

START_TEST(refusals) {
    mesh m = tilted_plate(0);
    const uint32_t order[1] = {0};
    static const struct {
        const char *sky;
        double albedo;
    } bad[] = {{"tregenza", -.1}, {"tregenza", 1.1}, {"tregenza", NAN}, {"dome", 0}};
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        const form_factor_options options = {
            .recipe = by_rays, .sky = bad[k].sky, .ground_albedo = bad[k].albedo};
        form_factors f = {0};
        lam_error error = {0};
        ck_assert_int_eq(form_factors_make(&m, order, &options, &f, &error), LAM_ERR_ARGUMENT);
        ck_assert(strstr(error.message, "must be") != NULL);
    }
    mesh_free(&m);
}
END_TEST

static void save_as(const sky_bounce *b, const char *path, const char *up, double albedo) {
    lam_error error = {0};
    store *s = NULL;
    ck_assert_int_eq(store_create(path, &s, &error), LAM_OK);
    ck_assert_msg(sky_bounce_save(b, s, &error) == LAM_OK, "%s", error.message);
    ck_assert_int_eq(store_set_text(s, "/sky", "up", up, &error), LAM_OK);
    ck_assert_int_eq(store_set_number(s, "/sky", "ground_albedo", albedo, &error), LAM_OK);
    ck_assert_msg(store_seal(s, &error) == LAM_OK, "%s", error.message);
}

static lam_status load(const char *path, size_t n, sky_bounce *out, lam_error *error) {
    store *s = NULL;
    ck_assert_int_eq(store_open(path, &s, error), LAM_OK);
    const lam_status status = sky_bounce_load(s, n, out, error);
    store_close(s);
    return status;
}

START_TEST(store_and_back) {
    char path[64];
    snprintf(path, sizeof path, "/tmp/lambert-sky-%d.h5", (int)getpid());
    mesh m = open_box();
    form_factors f = trace(&m, &ways[0], "reinhart:2", .25);
    sky_bounce again = {0};
    lam_error error = {0};
    save_as(&f.sky, path, "z", .25);
    ck_assert_msg(load(path, m.n, &again, &error) == LAM_OK, "%s", error.message);
    ck_assert_mem_eq(again.first_bounce, f.sky.first_bounce, 577 * m.n * sizeof(float));
    ck_assert_str_eq(again.tiling.name, "reinhart:2");
    ck_assert_double_eq(again.ground_albedo, .25);
    sky_bounce_free(&again);
    ck_assert_int_eq(load(path, m.n + 1, &again, &error), LAM_ERR_FORMAT);
    save_as(&f.sky, path, "w", .25);
    ck_assert_int_eq(load(path, m.n, &again, &error), LAM_ERR_FORMAT);
    save_as(&f.sky, path, "y", .25); /* its tiles are those of another axis */
    ck_assert_int_eq(load(path, m.n, &again, &error), LAM_ERR_FORMAT);
    save_as(&f.sky, path, "z", 1.5);
    ck_assert_int_eq(load(path, m.n, &again, &error), LAM_ERR_FORMAT);
    static const float wrong[] = {-1, NAN, INFINITY};
    for (size_t k = 0; k < 3; k++) {
        f.sky.first_bounce[100] = wrong[k];
        save_as(&f.sky, path, "z", .25);
        ck_assert_int_eq(load(path, m.n, &again, &error), LAM_ERR_FORMAT);
        ck_assert(strstr(error.message, "must be at least 0") != NULL);
    }
    unlink(path);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("sky_bounce");
    TCase *received = tcase_create("received");
    tcase_set_timeout(received, 120);
    tcase_add_test(received, level_plate);
    tcase_add_test(received, level_plate_of_other_axes);
    tcase_add_test(received, tilted_plates);
    tcase_add_test(received, plate_before_a_wall);
    tcase_add_test(received, hemicube_of_a_level_plate);
    tcase_add_test(received, back_faces_take_their_share);
    suite_add_tcase(suite, received);
    TCase *rows = tcase_create("rows");
    tcase_set_timeout(rows, 120);
    tcase_add_loop_test(rows, open_furnace, 0, N_WAYS);
    tcase_add_loop_test(rows, threads_and_bystanders, 0, N_WAYS);
    tcase_add_test(rows, blocks_and_the_sky_add_up);
    tcase_add_test(rows, closed_scenes_are_dark);
    tcase_add_test(rows, refusals);
    tcase_add_test(rows, store_and_back);
    suite_add_tcase(suite, rows);
    return suite_run(suite);
}
