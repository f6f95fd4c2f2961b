/* Light at points, the error of a mesh and adaptive meshes, against the closed form of a floor below a lamp.
 */
#include "solver/adapt/adaptive.h"
#include "solver/adapt/cell_look.h"
#include "solver/adapt/gather.h"
#include "solver/adapt/mesh_error.h"
#include "solver/adapt/mesh_single.h"
#include "solver/base/random.h"
#include "support/box.h"
#include "support/floor_lamp.h"
#include "support/scene.h"
#include "support/suite.h"

#include <omp.h>

/* The light of the lamp at points of the floor, near and far from it: the mean over keys is the closed form,
 * the halves are independent, and rays alone, which know of no lamp, say the same. */
START_TEST(light_at_points) {
    enum { KEYS = 400 };
    static const double points[3][3] = {{1.2, 1.5, 0}, {.1, .2, 0}, {2.9, 2.9, 0}};
    mesh m = floor_lamp_mesh(1);
    const float B[2] = {0, 1};
    gather *g = NULL;
    lam_error error = {0};
    ck_ok(gather_create(&m, 1, B, _i == 0 ? B : NULL, NULL, NULL, &g, &error));
    ck_assert_uint_eq(gather_values(g), 1);
    for (int p = 0; p < 3; p++) {
        const double F = floor_lamp_truth(points[p][0], points[p][1]);
        double sum = 0, squares = 0, product = 0;
        for (uint64_t key = 0; key < KEYS; key++) {
            double H[GATHER_HALVES];
            gather_at(g, 0, key, 1, &points[p], H);
            sum += (H[0] + H[1]) / 2;
            squares += ((H[0] - F) * (H[0] - F) + (H[1] - F) * (H[1] - F)) / 2;
            product += (H[0] - F) * (H[1] - F);
        }
        /* four standard errors of means over keys; of a product of independent halves likewise */
        const double variance = squares / KEYS;
        ck_assert_double_le(fabs(sum / KEYS - F), 4 * sqrt(variance / 2 / KEYS) + 1e-6);
        ck_assert_double_le(fabs(product / KEYS), 4 * variance / sqrt(KEYS));
        /* samples of the lamp leave a few hundredths of the light at a key, rays alone about as much as there
         * is */
        if (_i == 0) ck_assert_double_le(sqrt(variance), .1 * F);
    }
    gather_free(g);
    mesh_free(&m);
}
END_TEST

/* A bright plate that turns its back to a point leaves it dark, and another point as bright as it was. */
START_TEST(shadow) {
    static const double points[2][3] = {{1.2, 1.5, 0}, {.1, .2, 0}};
    mesh m = floor_lamp_mesh(1);
    const box_cell plate = {.axis = 2, .level = .1, .from = {.6, .9, .1}, .to = {1.8, 2.1, .1}};
    const float B[3] = {0, 1, 5}, lamps[3] = {0, 1, 0};
    double H[2 * GATHER_HALVES], light = 0;
    gather *g = NULL;
    lam_error error = {0};
    free(m.reflectance);
    free(m.emission);
    free(m.group);
    mesh_add_cell(&m, &plate, true);
    mesh_finish(&m, floor_lamp_rho);
    ck_ok(gather_create(&m, 1, B, lamps, NULL, NULL, &g, &error));
    for (uint64_t key = 0; key < 100; key++) {
        gather_at(g, 0, key, 2, points, H);
        ck_assert(H[0] == 0 && H[1] == 0);
        light += (H[2] + H[3]) / 200;
    }
    ck_assert_double_eq_tol(light, floor_lamp_truth(.1, .2), .02 * floor_lamp_truth(.1, .2));
    gather_free(g);
    mesh_free(&m);
}
END_TEST

/* Below a sky of radiance 1 the lamp of a floor is a dark plate: the rays that miss it bring pi, in both
 * lights; no light of the ground comes from above. */
START_TEST(light_of_skies) {
    enum { KEYS = 400 };
    static const double points[2][3] = {{1.2, 1.5, 0}, {.1, .2, 0}};
    mesh m = floor_lamp_mesh(1);
    const float B[4] = {0};
    sky_tiling tiling = {.n_tiles = 0};
    lam_error error = {0};
    gather *g = NULL;
    ck_ok(sky_tiling_create("tregenza", 'z', &tiling, &error));
    double *L = malloc(2 * (tiling.n_tiles + 1) * sizeof *L);
    for (size_t l = 0; l < 2; l++)
        for (size_t t = 0; t <= tiling.n_tiles; t++)
            L[l * (tiling.n_tiles + 1) + t] = t < tiling.n_tiles ? 1 + (double)l : 1e9;
    const gather_sky sky = {.tiling = &tiling, .L = L};
    ck_ok(gather_create(&m, 2, B, NULL, &sky, NULL, &g, &error));
    for (int p = 0; p < 2; p++) {
        const double seen = M_PI * (1 - floor_lamp_truth(points[p][0], points[p][1]));
        double sum = 0, squares = 0;
        for (uint64_t key = 0; key < KEYS; key++) {
            double H[2 * GATHER_HALVES];
            gather_at(g, 0, key, 1, &points[p], H);
            for (size_t half = 0; half < GATHER_HALVES; half++) {
                ck_assert_double_eq_tol(H[2 * half + 1], 2 * H[2 * half], 1e-9);
                sum += H[2 * half];
                squares += (H[2 * half] - seen) * (H[2 * half] - seen);
            }
        }
        /* four standard errors of the mean */
        const double n = 2 * KEYS;
        ck_assert_double_le(fabs(sum / n - seen), 4 * sqrt(squares / n / n) + 1e-6);
    }
    gather_free(g);
    sky_tiling_free(&tiling);
    free(L);
    mesh_free(&m);
}
END_TEST

/* In a closed box that sends out 1 everywhere, 1 arrives everywhere. */
START_TEST(furnace) {
    static const double size[3] = {1, 2, 3}, points[2][3] = {{.5, 1e-4, 0}, {.99, 1.7, 0}};
    mesh m = box_mesh(size, 2, .5f);
    float *B = malloc(2 * m.n * sizeof *B);
    double H[2 * GATHER_HALVES * 2];
    gather *g = NULL;
    lam_error error = {0};
    for (size_t i = 0; i < m.n; i++) B[i] = 1, B[m.n + i] = 2;
    ck_ok(gather_create(&m, 2, B, NULL, NULL, NULL, &g, &error));
    gather_at(g, 4 * 4, 1, 2, points, H); /* the floor's first element */
    for (size_t k = 0; k < 4; k++) {
        ck_assert_double_eq_tol(H[2 * k], 1, 1e-6);
        ck_assert_double_eq_tol(H[2 * k + 1], 2, 2e-6);
    }
    gather_free(g);
    free(B);
    mesh_free(&m);
}
END_TEST

/* The stated error of a uniform floor is the true one within a tenth: 1,024 looks of a relative spread of 2
 * to 3 have a standard error of the square below .1, of the error half of that. */
START_TEST(error_of_a_uniform_mesh) {
    static const size_t cells[] = {4, 12, 32};
    mesh m = floor_lamp_mesh(cells[_i]);
    float *B = malloc(m.n * sizeof *B);
    double stated = 0;
    lam_error error = {0};
    const double off = floor_lamp_error(&m, B);
    double *numbers = calloc(3 * m.n_groups, sizeof *numbers), *area = calloc(m.n_groups, sizeof *area);
    const mesh_error_groups groups = {numbers, numbers + m.n_groups, numbers + 2 * m.n_groups, 0};
    ck_ok(mesh_error(&m, 1, m.emission, B, true, NULL, NULL, 3, NULL, &stated, &groups, &error));
    /* The lacks of groups add up to that of the scene. */
    double lacks = 0, light2 = 0;
    for (size_t i = 0; i < m.n; i++) area[m.group[i]] += m.area[i];
    for (size_t g = 0; g < m.n_groups; g++) {
        lacks += area[g] * groups.variance[g];
        light2 += area[g] * groups.light2[g];
        ck_assert_double_lt(groups.noise[g], groups.variance[g] + 1e-12);
    }
    ck_assert_double_eq_tol(sqrt(lacks / light2), stated, 1e-6 * stated);
    free(numbers);
    free(area);
    printf("%zu elements: stated %g, true %g\n", m.n, stated, off);
    ck_assert_double_eq_tol(stated, off, .1 * off);
    free(B);
    mesh_free(&m);
}
END_TEST

/* Of all single elements, floor and lamp, only the lamp sends light that is reflected. Means over seeds; each
 * look has 64 rays a half. */
START_TEST(error_of_single_elements) {
    static const size_t cells[] = {1, 4, 12};
    enum { SEEDS = 100 };
    mesh m = floor_lamp_mesh(cells[_i]);
    lam_error error = {0};
    double variance = 0, square = 0, area = 0, off = 0, light = 0, noise = 0;
    for (size_t i = 0; i < m.n; i++) {
        double mean = 0, spread = 0;
        if (i + 1 < m.n) floor_lamp_over(&m, i, &mean, &spread);
        area += m.area[i];
        variance += m.area[i] * .25 * spread;
        square += m.area[i] * .25 * (mean * mean + spread);
    }
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        double numbers[3] = {0};
        const mesh_error_groups groups = {numbers, numbers + 1, numbers + 2, 0};
        ck_ok(mesh_single(&m, seed, NULL, &groups, &error));
        off += numbers[0] / SEEDS;
        noise += numbers[1] / SEEDS;
        light += numbers[2] / SEEDS;
    }
    printf("%zu elements: %g +- %g, true %g; square %g, true %g\n", m.n, off, noise, variance / area, light,
           square / area);
    /* Four points miss a part of a peak in the middle of one element; 64 looks at 16 elements are three or
     * four of each. */
    ck_assert_double_eq_tol(off, variance / area, (_i == 0 ? .2 : .1) * variance / area);
    ck_assert_double_eq_tol(light, square / area, .05 * square / area);
    mesh_free(&m);
}
END_TEST

/* Where nothing is reflected, or all is the same, there is no error. */
START_TEST(no_error) {
    static const double size[3] = {1, 1, 1};
    mesh m = box_mesh(size, 3, .5f);
    m.n_groups = 1;
    float *E = malloc(2 * m.n * sizeof *E), *B = malloc(2 * m.n * sizeof *B);
    double stated[2] = {-1, -1};
    lam_error error = {0};
    for (size_t i = 0; i < m.n; i++) { /* B = E / (1 - floor_lamp_rho) in a furnace; a light that is off */
        E[i] = 1, B[i] = 2;
        E[m.n + i] = B[m.n + i] = 0;
    }
    ck_ok(mesh_error(&m, 2, E, B, false, NULL, NULL, 3, NULL, stated, NULL, &error));
    ck_assert_double_le(stated[0], 1e-6);
    ck_assert(stated[1] == 0);
    free(E);
    free(B);
    mesh_free(&m);
}
END_TEST

/* Looks at a trapezoid of the floor: points in all of it, of equal weight for equal areas in any look, at
 * which the light is that of the closed form; errors are on average those of constants there. */
START_TEST(looks_at_a_cell) {
    enum { KEYS = 300, FINE = 64 };
    mesh m = floor_lamp_mesh(1);
    float E[2] = {0, 1}, B[2] = {0, 1};
    uint32_t first[3] = {0, 1, 2};
    const coarse_light coarse = {.m = m, .first = first, .n_lights = 1, .E = E, .B = B, .lamps = true};
    cell_light light = {.m = &m, .coarse = &coarse, .all = {2, 1}};
    cell_points p = {.n = 0};
    mesh_cell parts[2];
    gather *g = NULL;
    lam_error error = {0};
    const mesh_cell whole = mesh_cell_of(&m, 0);
    ck_ok(gather_create(&m, 1, B, E, NULL, NULL, &g, &error));
    light.g = g;
    ck_assert(mesh_cell_cut(&whole, (mesh_cut){4, 2 * MESH_CELL_STEPS + 4}, parts));
    const mesh_cell *c = &parts[_i];
    /* means by a fine grid of the floor */
    double area = 0, x = 0, y = 0, F = 0, squares = 0;
    for (int k = 0; k < FINE * FINE; k++) {
        const double at[2] = {3 * (k % FINE + .5) / FINE, 3 * (k / FINE + .5) / FINE};
        bool inside = true;
        for (size_t e = 0; e < c->n; e++) {
            const double *a = c->corner[e], *b = c->corner[(e + 1) % c->n];
            inside = inside && (b[0] - a[0]) * (at[1] - a[1]) > (b[1] - a[1]) * (at[0] - a[0]);
        }
        if (!inside) continue;
        area++;
        x += at[0];
        y += at[1];
        F += floor_lamp_truth(at[0], at[1]);
        squares += floor_lamp_truth(at[0], at[1]) * floor_lamp_truth(at[0], at[1]);
    }
    const double variance = squares / area - F / area * F / area;
    const double all =
        mesh_cell_area(c) * (double)floor_lamp_rho * (double)floor_lamp_rho / light.all[0] * variance;
    double sum[3] = {0}, weight = 0, off = 0;
    for (uint64_t key = 0; key < KEYS; key++) {
        float its[COARSE_LIGHTS];
        const size_t steps = key % 2 == 0 ? 6 : 9;
        ck_ok(cell_points_reserve(&p, 1, 0, steps * steps + 36, &error));
        cell_look_at(&light, c, random_hash(key), steps, &p, its);
        off += (double)its[0] / KEYS;
        cell_look_at(&light, c, random_hash(key + KEYS), 6, &p, its);
        ck_assert_uint_eq(p.n, steps * steps + 36);
        double first_look = 0;
        for (size_t k = 0; k < p.n; k++) {
            const double W = (double)p.weight[k];
            first_look += k < steps * steps ? W : 0;
            weight += W;
            sum[0] += W * (double)p.x[k];
            sum[1] += W * (double)p.y[k];
            sum[2] += W * (double)p.H[k] / (double)floor_lamp_rho;
        }
        ck_assert_double_eq_tol(first_look, (double)(steps * steps), 1e-4);
    }
    printf("%g %g %g, %g %g %g; error %g of %g\n", x / area, y / area, F / area, sum[0] / weight,
           sum[1] / weight, sum[2] / weight, off, all);
    const face_plane plane = face_plane_of(&m, 0);
    const double middle[3] = {x / area, y / area, 0};
    double in[2];
    face_plane_at(&plane, middle, in);
    ck_assert_double_eq_tol(sum[0] / weight, in[0], .004);
    ck_assert_double_eq_tol(sum[1] / weight, in[1], .004);
    ck_assert_double_eq_tol(sum[2] / weight, F / area, .01 * F / area);
    ck_assert_double_eq_tol(off, all, .05 * all);
    cell_points_free(&p);
    gather_free(g);
    mesh_free(&m);
}
END_TEST

/* The adaptive floor keeps the error that was asked for, to a fifth, with less than half of the elements of a
 * uniform one of the same error; it covers the floor and keeps group and materials. */
START_TEST(adaptive_floor) {
    mesh m = floor_lamp_mesh(1);
    const adaptive_options how = {.error = .04, .elements = 10000, .seed = 1};
    adaptive_report report;
    lam_error error = {0};
    const double area = total_area(&m);
    ck_ok(adaptive_refine(&m, &how, &report, &error));
    const double off = floor_lamp_error(&m, NULL);
    ck_assert(report.reached && report.left.has_lamps);
    ck_assert_double_le(report.left.lamps, .04);
    ck_assert_double_le(off, 1.2 * .04);
    ck_assert_double_eq_tol(report.left.lamps, off, .2 * off);
    ck_assert_double_eq_tol(total_area(&m), area, 1e-12 * area);
    size_t cells = 1;
    for (double uniform = 1; uniform > off; cells++) {
        mesh even = floor_lamp_mesh(cells);
        uniform = floor_lamp_error(&even, NULL);
        mesh_free(&even);
    }
    printf("%zu elements adaptive of error %g, %zu uniform\n", m.n, off, cells * cells + 1);
    ck_assert_uint_lt(2 * m.n, cells * cells);
    mesh_free(&m);
}
END_TEST

/* No more elements than are asked for, which is told; the same ones for any number of threads. They leave as
 * little as cuts by many points do: by one look at each cell .034 of the lamp's light and .038 of the other.
 */
START_TEST(limit_and_threads) {
    mesh m[2];
    adaptive_report report[2];
    lam_error error = {0};
    for (int k = 0; k < 2; k++) {
        const adaptive_options how = {.error = 1e-4, .elements = 500, .seed = 1};
        omp_set_num_threads(k == 0 ? 1 : 5);
        m[k] = floor_lamp_mesh(1);
        ck_ok(adaptive_refine(&m[k], &how, &report[k], &error));
        ck_assert(!report[k].reached);
        ck_assert_uint_eq(m[k].n, 500);
    }
    ck_assert_uint_eq(m[0].n_vertices, m[1].n_vertices);
    ck_assert_mem_eq(m[0].vertices, m[1].vertices, m[0].n_vertices * sizeof *m[0].vertices);
    ck_assert_mem_eq(m[0].elements, m[1].elements, m[0].n * sizeof *m[0].elements);
    ck_assert(report[0].left.lamps == report[1].left.lamps);
    printf("500 elements leave %g, %g\n", report[0].left.lamps, report[0].left.even);
    ck_assert_double_lt(report[0].left.lamps, .033);
    ck_assert_double_lt(report[0].left.even, .034);
    for (int k = 0; k < 2; k++) mesh_free(&m[k]);
}
END_TEST

/* A floor that looks away from the lamp is divided as one that looks up to it, where both sides will be
 * there, and not at all where its front alone is. */
START_TEST(two_sided) {
    mesh m[3];
    adaptive_report report;
    lam_error error = {0};
    for (int k = 0; k < 3; k++) {
        const adaptive_options how = {.error = .05, .elements = 4000, .seed = 1};
        m[k] = floor_lamp_mesh(1);
        if (k != 2) ck_ok(mesh_mark_two_sided(&m[k], &error));
        if (k > 0) { /* turned */
            const uint32_t swap = m[k].elements[0][1];
            m[k].elements[0][1] = m[k].elements[0][3];
            m[k].elements[0][3] = swap;
            ck_ok(mesh_measure(&m[k], &error));
        }
        ck_ok(adaptive_refine(&m[k], &how, &report, &error));
        ck_assert(report.reached);
    }
    printf("up %zu, down %zu, front alone %zu\n", m[0].n, m[1].n, m[2].n);
    ck_assert_double_gt((double)m[1].n, 1.5 * (double)m[2].n); /* which is what division begins with */
    ck_assert_double_eq_tol((double)m[1].n, (double)m[0].n, .2 * (double)m[0].n);
    for (int k = 0; k < 3; k++) mesh_free(&m[k]);
}
END_TEST

int main(void) {
    Suite *s = suite_create("adapt");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 300);
    tcase_add_loop_test(c, light_at_points, 0, 2);
    tcase_add_test(c, shadow);
    tcase_add_test(c, light_of_skies);
    tcase_add_test(c, furnace);
    tcase_add_loop_test(c, error_of_a_uniform_mesh, 0, 3);
    tcase_add_loop_test(c, error_of_single_elements, 0, 3);
    tcase_add_test(c, no_error);
    tcase_add_loop_test(c, looks_at_a_cell, 0, 2);
    tcase_add_test(c, adaptive_floor);
    tcase_add_test(c, limit_and_threads);
    tcase_add_test(c, two_sided);
    suite_add_tcase(s, c);
    return suite_run(s);
}
