/* Rays towards openings: no bias, the same sum as by rays alone, and far less noise. */
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/rays/portals.h"
#include "solver/formfactor/sky_sample.h"
#include "solver/formfactor/source.h"
#include "support/box.h"
#include "support/suite.h"

#include <omp.h>

/* A rectangle in cells, but for those whose centre lies in the hole; the same corners everywhere. */
static void add_face(mesh *m, int axis, double level, const double *u, size_t n_u, const double *w,
                     size_t n_w, bool positive, const double hole[4]) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (size_t i = 0; i + 1 < n_u; i++)
        for (size_t j = 0; j + 1 < n_w; j++) {
            box_cell cell = {.axis = axis, .level = level};
            const double x = .5 * (u[i] + u[i + 1]), y = .5 * (w[j] + w[j + 1]);
            if (hole != NULL && x > hole[0] && x < hole[1] && y > hole[2] && y < hole[3]) continue;
            cell.from[axis] = cell.to[axis] = level;
            cell.from[a] = u[i];
            cell.to[a] = u[i + 1];
            cell.from[b] = w[j];
            cell.to[b] = w[j + 1];
            mesh_add_cell(m, &cell, positive);
        }
}

static const double hole[4] = {1.6, 2.4, 1.6, 2.4};

/* A cube of 4 m with a hole of .8 x .8 m in its roof; with a plate beside it, which hides the hole from some
 * elements. */
static mesh room(bool plate) {
    static const double lines[] = {0, .8, 1.6, 2.4, 3.2, 4};
    mesh m = {0};
    for (int axis = 0; axis < 3; axis++) {
        add_face(&m, axis, 0, lines, 6, lines, 6, true, NULL);
        add_face(&m, axis, 4, lines, 6, lines, 6, false, axis == 2 ? hole : NULL);
    }
    static const double side[] = {.5, 2, 3.4};
    if (plate) add_face(&m, 2, 2, side, 3, side, 3, true, NULL);
    mesh_finish(&m, .5f);
    return m;
}

static face_openings give(const plane_rectangle *r) {
    face_openings o = {.n = 0};
    lam_error error = {0};
    ck_ok(face_openings_give(&o, r, &error));
    return o;
}

static form_factors make(const mesh *m, recipe how, const plane_rectangle *given) {
    uint32_t *order = malloc(m->n * sizeof *order);
    lam_error error = {0};
    form_factors f = {0};
    face_openings openings = {.n = 0};
    if (given != NULL) openings = give(given);
    const form_factor_options options = {
        .recipe = how, .sky = "tregenza", .ground_albedo = 0, .openings = given != NULL ? &openings : NULL};
    ck_ok(mesh_z_order(m, order, &error));
    ck_ok(form_factors_make(m, order, &options, &f, &error));
    face_openings_free(&openings);
    free(order);
    return f;
}

/* H0 of an element under an even sky of radiance 1 / pi: what it sees of the sky. */
static double sky_seen(const form_factors *f, size_t i) {
    double sum = 0;
    for (size_t t = 0; t < f->sky.tiling.n_tiles; t++)
        sum += (double)f->sky.first_bounce[t * f->sky.n + i] * M_1_PI;
    return sum;
}

static portals find(const mesh *m) {
    visibility *v = NULL;
    lam_error error = {0};
    portals p = {.n = 0};
    ck_ok(visibility_create(m, &v, &error));
    ck_ok(portals_find(m, v, 1, 1000, NULL, false, &p, &error));
    visibility_destroy(v);
    return p;
}

/* The hole is found, and no other loop: the plate has an outline of 2.9 x 2.9 m through which nothing leaves.
 */
START_TEST(hole_is_found) {
    for (int plate = 0; plate < 2; plate++) {
        mesh m = room(plate == 1);
        portals p = find(&m);
        ck_assert_uint_eq(p.n, 1);
        ck_assert_uint_eq(p.n_openings, 1);
        ck_assert_double_eq_tol(p.portal[0].area, .64, 1e-12);
        ck_assert_double_eq_tol(fabs(p.portal[0].normal[2]), 1, 1e-12);
        ck_assert_uint_eq(p.rays, 1000 / VISIBILITY_PACKET * VISIBILITY_PACKET + VISIBILITY_PACKET);
        portals_free(&p);
        mesh_free(&m);
    }
}
END_TEST

/* Most light leaves: rays find the sky by themselves. A closed box has no hole. */
START_TEST(open_and_closed_scenes_have_none) {
    mesh open = {0}, closed = box_mesh((const double[]){1, 1, 1}, 3, .5f);
    const box_cell floor = {.axis = 2, .to = {1, 1, 0}}, wall = {.axis = 0, .to = {0, 1, 1}};
    mesh_add_cell(&open, &floor, true);
    mesh_add_cell(&open, &wall, true);
    mesh_finish(&open, .5f);
    portals of_open = find(&open), of_closed = find(&closed);
    ck_assert_uint_eq(of_open.n, 0);
    ck_assert_uint_eq(of_closed.n, 0);
    portals_free(&of_open);
    portals_free(&of_closed);
    mesh_free(&open);
    mesh_free(&closed);
}
END_TEST

/* The exact share of the hole, from the closed form of two rectangles of a box without plate. */
static double exact(const mesh *m, size_t i) {
    const box_cell window = {.axis = 2, .level = 4, .from = {1.6, 1.6, 4}, .to = {2.4, 2.4, 4}};
    box_cell own = {.axis = 0};
    for (int d = 0; d < 3; d++) {
        own.from[d] = INFINITY;
        own.to[d] = -INFINITY;
        for (int c = 0; c < 4; c++) {
            own.from[d] = fmin(own.from[d], m->vertices[m->elements[i][c]][d]);
            own.to[d] = fmax(own.to[d], m->vertices[m->elements[i][c]][d]);
        }
        if (own.from[d] == own.to[d]) own.axis = d;
    }
    own.level = own.from[own.axis];
    return fmax(0, box_exchange(&own, &window) / m->area[i]);
}

/* Rays alone, of one recipe, with their own portal and with one that also covers the roof around the hole and
 * beyond, against closed forms. The mean over 64 seeds is within 5 standard errors of the truth for each
 * element: of 290 means of Student's distribution one in 700 runs would have one outside. */
START_TEST(no_bias) {
    mesh m = room(false);
    const plane_rectangle wide = {{1, 1, 4}, {{2, 0, 0}, {0, 2.5, 0}}};
    enum { SEEDS = 64 };
    double *sum = calloc(m.n, sizeof *sum), *squares = calloc(m.n, sizeof *squares);
    for (int given = 0; given < 2; given++) {
        double noise = 0, plain = 0;
        memset(sum, 0, m.n * sizeof *sum);
        memset(squares, 0, m.n * sizeof *squares);
        for (int seed = 0; seed < SEEDS; seed++) {
            const recipe how = {.rays = 256, .seed = (uint64_t)seed};
            form_factors f = make(&m, how, given ? &wide : NULL);
            for (size_t i = 0; i < m.n; i++) {
                sum[i] += f.leaving[i] / SEEDS;
                squares[i] += f.leaving[i] * f.leaving[i] / SEEDS;
            }
            form_factors_free(&f);
        }
        for (size_t i = 0; i < m.n; i++) {
            const double truth = exact(&m, i), variance = fmax(0, squares[i] - sum[i] * sum[i]);
            ck_assert_msg(fabs(sum[i] - truth) <= 5 * sqrt(variance / (SEEDS - 1)) + 1e-7,
                          "element %zu: %g for %g, +- %g", i, sum[i], truth, sqrt(variance / (SEEDS - 1)));
            noise += variance;
            plain += truth * (1 - truth) / 256;
        }
        /* Of independent rays by the cosine alone it would be `plain`. */
        if (!given) ck_assert_double_lt(noise, plain / 20);
    }
    free(sum);
    free(squares);
    mesh_free(&m);
}
END_TEST

/* The sample by which a first bounce is judged is aimed at the hole, too, and at a portal that is given in
 * its place: one that nobody sees the sky through leaves the noise of rays by the cosine. Within 5 standard
 * errors of the truth for each element, as above; of 64 seeds a variance is known to a fifth. */
START_TEST(samples_of_the_judge_are_aimed) {
    mesh m = room(false);
    const plane_rectangle useless = {{0, 0, 0}, {{4, 0, 0}, {0, 4, 0}}};
    enum { SEEDS = 64, RAYS = 512 };
    uint32_t *order = malloc(m.n * sizeof *order);
    double *sum = calloc(m.n, sizeof *sum), *squares = calloc(m.n, sizeof *squares), noise[2] = {0};
    lam_error error = {0};
    face_openings openings = give(&useless);
    sky_bounce like = {.n = 0};
    ck_ok(mesh_z_order(&m, order, &error));
    ck_ok(sky_bounce_create("tregenza", m.up, 0, m.n, &like, &error));
    for (int given = 0; given < 2; given++) {
        memset(sum, 0, m.n * sizeof *sum);
        memset(squares, 0, m.n * sizeof *squares);
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            const form_factor_options how = {.recipe = {.rays = RAYS, .seed = seed},
                                             .openings = given ? &openings : NULL};
            form_factors f = {.row_sums = NULL};
            ck_ok(sky_sample_make(&m, order, &like, &how, &f.sky, &error));
            for (size_t i = 0; i < m.n; i++) {
                const double seen = sky_seen(&f, i);
                sum[i] += seen / SEEDS;
                squares[i] += seen * seen / SEEDS;
            }
            sky_bounce_free(&f.sky);
        }
        for (size_t i = 0; i < m.n; i++) {
            const double truth = exact(&m, i), variance = fmax(0, squares[i] - sum[i] * sum[i]);
            ck_assert_msg(fabs(sum[i] - truth) <= 5 * sqrt(variance / (SEEDS - 1)) + 1e-6,
                          "element %zu: %g for %g, +- %g", i, sum[i], truth, sqrt(variance / (SEEDS - 1)));
            noise[given] += variance;
        }
    }
    printf("noise %g of rays at the hole, %g of others\n", sqrt(noise[0]), sqrt(noise[1]));
    ck_assert_double_lt(noise[0], noise[1] / 20);
    face_openings_free(&openings);
    sky_bounce_free(&like);
    free(order);
    free(sum);
    free(squares);
    mesh_free(&m);
}
END_TEST

/* Pairs behind a plate, whose shadows are sampled: rays take over where they know better, and what the hole
 * lets in, .64, is distributed whole. Against rays in plenty. */
START_TEST(pairs_and_rays_together) {
    mesh m = room(true);
    const recipe few = {.source = &source_pairs, .rays = 4096, .accuracy = 1e-3, .seed = 3},
                 many = {.rays = 1 << 16, .seed = 4};
    form_factors f = make(&m, few, NULL), g = make(&m, many, NULL);
    double off = 0, all = 0, of_tiles = 0;
    for (size_t i = 0; i < m.n; i++) {
        const double seen = sky_seen(&f, i), truth = g.leaving[i]; /* the rest meets the back of the plate */
        off += m.area[i] * (seen - truth) * (seen - truth);
        all += m.area[i] * truth * truth;
        of_tiles += m.area[i] * seen;
    }
    ck_assert_double_le(sqrt(off / all), .01);
    ck_assert_double_eq_tol(of_tiles, .64, .01 * .64);
    form_factors_free(&f);
    form_factors_free(&g);
    mesh_free(&m);
}
END_TEST

START_TEST(same_for_any_threads) {
    mesh m = room(true);
    const recipe how = {.rays = 512, .seed = 1};
    omp_set_num_threads(1);
    form_factors f = make(&m, how, NULL);
    omp_set_num_threads(4);
    form_factors g = make(&m, how, NULL);
    ck_assert_mem_eq(f.leaving, g.leaving, m.n * sizeof *f.leaving);
    ck_assert_mem_eq(f.sky.first_bounce, g.sky.first_bounce,
                     f.sky.tiling.n_tiles * m.n * sizeof *f.sky.first_bounce);
    form_factors_free(&f);
    form_factors_free(&g);
    mesh_free(&m);
}
END_TEST

/* A rectangle is around points of a plane alone. */
START_TEST(rectangles) {
    static const uint32_t edges[][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
    double points[][3] = {{1, 1, 1}, {3, 1, 1}, {2, 2, 1}, {1, 2, 1}};
    plane_rectangle r;
    ck_assert(plane_rectangle_around((const double(*)[3])points, 4, edges, 4, 1e-3, &r));
    ck_assert_double_eq_tol(plane_rectangle_area(&r), 2, 1e-12);
    points[2][2] = 1.01;
    ck_assert(!plane_rectangle_around((const double(*)[3])points, 4, edges, 4, 1e-3, &r));
    points[2][2] = 1;
    points[2][1] = points[3][1] = 1.0005;
    ck_assert(!plane_rectangle_around((const double(*)[3])points, 4, edges, 4, 1e-3, &r));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("portals");
    TCase *tc = tcase_create("portals");
    tcase_set_timeout(tc, 120);
    tcase_add_test(tc, hole_is_found);
    tcase_add_test(tc, open_and_closed_scenes_have_none);
    tcase_add_test(tc, no_bias);
    tcase_add_test(tc, samples_of_the_judge_are_aimed);
    tcase_add_test(tc, pairs_and_rays_together);
    tcase_add_test(tc, same_for_any_threads);
    tcase_add_test(tc, rectangles);
    suite_add_tcase(suite, tc);
    return suite_run(suite);
}
