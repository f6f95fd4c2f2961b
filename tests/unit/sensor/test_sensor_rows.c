/* Rows of sensors against closed forms, against many rays by plain code, and their own stated variance. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/sensor/sensor_rows.h"
#include "support/box.h"
#include "support/scene.h"

static const double room[3] = {4, 3, 2.5};

static sensor_rows rows_of(const mesh *m, size_t n, const receiver *r, const sensor_rows_options *o) {
    lam_error error = {0};
    sensor_rows rows;
    ck_ok(sensor_rows_make(m, n, r, o, &rows, &error));
    return rows;
}

static double row_sum(const sensor_rows *rows, size_t k) {
    double sum = 0;
    for (uint64_t i = rows->start[k]; i < rows->start[k + 1]; i++) sum += (double)rows->weight[i];
    return sum;
}

static double row_entry_of(const sensor_rows *rows, size_t k, uint32_t j) {
    for (uint64_t i = rows->start[k]; i < rows->start[k + 1]; i++)
        if (rows->element[i] == j) return (double)rows->weight[i];
    return 0;
}

/* In a closed box every kind has the sum 1, in the open and on faces; only rounding to single precision is
 * left: 2^-24 of each of up to 1,500 weights, whose sum is 1. */
START_TEST(furnace) {
    enum { PLACES = 5, N = PLACES * RECEIVER_DENSITIES };
    static const double places[PLACES][3] = {
        {1.3, 1.1, .8}, {1.3, 1.1, 0}, {0, 1.1, .8}, {0, 0, 0}, {1.3, 1.1, -2e-4}};
    mesh m = box_mesh(room, 12, .5f);
    receiver r[N] = {{.kind = RECEIVER_PLANE}};
    for (size_t k = 0; k < N; k++) {
        r[k] = (receiver){.kind = (receiver_kind)(k % RECEIVER_DENSITIES), .axis = {0, 0, 1}};
        memcpy(r[k].at, places[k / RECEIVER_DENSITIES], sizeof r[k].at);
        if (r[k].kind == RECEIVER_SPHERE) r[k].axis[2] = 0;
        if (r[k].kind == RECEIVER_SEMICYLINDER) r[k].look[0] = 1;
    }
    sensor_rows rows = rows_of(&m, N, r, &(sensor_rows_options){.rays = 256});
    for (size_t k = 0; k < N; k++) {
        ck_assert_msg(fabs(row_sum(&rows, k) - 1) < 1e-6, "receiver %zu: %.9f", k, row_sum(&rows, k));
        ck_assert_double_eq((double)rows.backs[k], 0);
        for (uint64_t i = rows.start[k]; i < rows.start[k + 1]; i++) {
            ck_assert(rows.weight[i] > 0 && rows.element[i] < m.n);
            ck_assert(i == rows.start[k] || rows.element[i] > rows.element[i - 1]);
        }
    }
    sensor_rows_free(&rows);
    mesh_free(&m);
}
END_TEST

/* Nothing is hidden in a box: pairs are exact but for single precision, and nothing of them is stated as
 * noise. */
START_TEST(pairs_are_exact) {
    const receiver r = {.at = {1.3, 1.1, .8}, .axis = {.6, 0, .8}};
    mesh m = box_mesh(room, 4, .5f);
    bool source = true;
    m.n_groups = 1;
    sensor_rows rows = rows_of(&m, 1, &r, &(sensor_rows_options){.sources = &source});
    size_t seen = 0;
    for (size_t j = 0; j < m.n; j++) {
        polygon p;
        polygon_of_element(&m, j, &p);
        const double factor = receiver_factor(&r, &p);
        ck_assert_double_eq_tol(row_entry_of(&rows, 0, (uint32_t)j), factor, 1e-6 * factor + 1e-12);
        seen += factor > 0;
    }
    ck_assert_uint_gt(seen, 40);
    for (uint64_t i = 0; i < rows.start[1]; i++) ck_assert_double_eq((double)rows.off[i], 0);
    sensor_rows_free(&rows);
    mesh_free(&m);
}
END_TEST

/* Of a closed box some elements are no pairs and are met by no ray: what they leave goes to other pairs than
 * the lamp's, whose factor stays exact, but that receivers are lifted off the floor by 1.4e-6 m: a share of
 * 6e-7 of the height of the lamp, of which factors take up to four. */
START_TEST(lamp_keeps_its_factor) {
    enum { ACROSS = 20, N = 20 * ACROSS };
    mesh m = box_mesh(room, 5, .5f);
    receiver r[N] = {{.kind = RECEIVER_PLANE}};
    const bool sources[] = {false, true};
    size_t lamp = 0, left = 0;
    while (!((double)m.normal[lamp][2] < -.5)) lamp++;
    m.n_groups = 2;
    m.group[lamp] = 1;
    for (size_t k = 0; k < N; k++) {
        const double x = ((double)(k % ACROSS) + .5) / ACROSS, y = ((double)(k / ACROSS) + .3) / ACROSS;
        r[k] = (receiver){.at = {x * room[0], y * room[1], 0}, .axis = {0, 0, 1}};
    }
    sensor_rows rows = rows_of(&m, N, r, &(sensor_rows_options){.sources = sources});
    for (size_t k = 0; k < N; k++) {
        double known = 0; /* by the exact factors of the elements of the row */
        polygon p;
        for (uint64_t i = rows.start[k]; i < rows.start[k + 1]; i++) {
            polygon_of_element(&m, rows.element[i], &p);
            known += receiver_factor(&r[k], &p);
        }
        left += known < 1 - 1e-3;
        polygon_of_element(&m, lamp, &p);
        const double factor = receiver_factor(&r[k], &p);
        ck_assert_double_eq_tol(row_entry_of(&rows, k, (uint32_t)lamp), factor, 3e-6 * factor);
        ck_assert_double_eq_tol(row_sum(&rows, k), 1, 1e-6);
    }
    ck_assert_uint_gt(left, 0);
    sensor_rows_free(&rows);
    mesh_free(&m);
}
END_TEST

/* A lamp of 1 m^2, 3 m above and 2 m beside a receiver, of 22 x 22 elements, each far below the share of a
 * ray: its light is exact; of 70 x 70 it is seen by rays, some 17 of 1,024, four deviations of a binomial of
 * them. */
START_TEST(lamps_of_many_elements) {
    static const int cells[] = {22, 70};
    const receiver r = {.at = {2.5, .5, 0}, .axis = {0, 0, 1}};
    polygon whole = {.n = 4, .corner = {{0, 0, 3}, {0, 1, 3}, {1, 1, 3}, {1, 0, 3}}};
    polygon_measure(&whole);
    const double F = receiver_factor(&r, &whole);
    for (int k = 0; k < 2; k++) {
        const int n = cells[k];
        mesh m = {0};
        for (int i = 0; i < n * n; i++) {
            const double x = i % n, y = i / n;
            const box_cell cell = {
                .axis = 2, .level = 3, .from = {x / n, y / n, 3}, .to = {(x + 1) / n, (y + 1) / n, 3}};
            mesh_add_cell(&m, &cell, false);
        }
        mesh_finish(&m, .5f);
        m.n_groups = 1;
        for (size_t j = 0; j < m.n; j++) m.emission[j] = 1;
        sensor_rows rows = rows_of(&m, 1, &r, &(sensor_rows_options){.seed = 1});
        ck_assert_double_eq_tol(row_sum(&rows, 0), F, k == 0 ? 1e-6 * F : 4 * sqrt(F / SENSOR_RAYS));
        for (uint64_t i = 0; i < rows.start[1] && k == 0; i++) ck_assert_double_eq((double)rows.off[i], 0);
        ck_assert_uint_le(rows.start[1], 484);
        sensor_rows_free(&rows);
        mesh_free(&m);
    }
}
END_TEST

/* Faces of a wall of 20 cm: a receiver within it meets backs only. */
START_TEST(in_a_wall) {
    mesh m = {0};
    const box_cell inside = {.axis = 0, .level = 2, .from = {2, 0, 0}, .to = {2, 3, 2.5}},
                   outside = {.axis = 0, .level = 2.2, .from = {2.2, 0, 0}, .to = {2.2, 3, 2.5}};
    mesh_add_cell(&m, &inside, false);
    mesh_add_cell(&m, &outside, true);
    mesh_finish(&m, .5f);
    const receiver r[] = {{.at = {2.1, 1.5, 1.2}, .axis = {1, 0, 0}},
                          {.at = {2.1, 1.5, 1.2}, .kind = RECEIVER_SPHERE},
                          {.at = {1.9, 1.5, 1.2}, .axis = {1, 0, 0}},
                          {.at = {2, 1.5, 1.2}, .axis = {-1, 0, 0}},
                          {.at = {2, 1.5, 1.2}, .axis = {1, 0, 0}}};
    sensor_rows rows = rows_of(&m, 5, r, &(sensor_rows_options){.rays = 256});
    ck_assert_double_gt((double)rows.backs[0], SENSOR_BACKS_MOST);
    ck_assert_double_gt((double)rows.backs[1], SENSOR_BACKS_MOST);
    ck_assert_double_eq((double)rows.backs[2], 0);
    ck_assert_double_eq((double)rows.backs[3], 0);
    ck_assert_double_gt((double)rows.backs[4], SENSOR_BACKS_MOST); /* on the wall, it looks into it */
    ck_assert_uint_eq(rows.start[1], 0);
    ck_assert_double_gt(row_entry_of(&rows, 2, 0), .9);
    ck_assert_uint_eq(rows.start[4], rows.start[3]); /* on the wall, it looks into the open */
    sensor_rows_free(&rows);
    mesh_free(&m);
}
END_TEST

/* A sheet without a back lies a metre above a floor: a receiver in its plane that looks up lies on it, and
 * one that looks down sees the floor, with the factor of a square of 4 x 4 m a metre below its middle. */
START_TEST(on_both_sides_of_a_sheet) {
    mesh m = {0};
    mesh_add_cell(&m, &(box_cell){.axis = 2, .level = 1, .from = {1, 1, 1}, .to = {3, 3, 1}}, true);
    mesh_add_cell(&m, &(box_cell){.axis = 2, .from = {0, 0, 0}, .to = {4, 4, 0}}, true);
    mesh_finish(&m, .5f);
    const receiver r[] = {{.at = {2, 2, 1}, .axis = {0, 0, 1}}, {.at = {2, 2, 1}, .axis = {0, 0, -1}}};
    sensor_rows rows = rows_of(&m, 2, r, &(sensor_rows_options){.rays = 256});
    ck_assert_uint_eq(rows.start[1], 0);
    ck_assert_uint_eq(rows.start[2], 1);
    ck_assert_uint_eq(rows.element[0], 1);
    const double side = 2 / sqrt(5), factor = 4 * side * atan(side) / M_PI;
    ck_assert_double_eq_tol((double)rows.weight[0], factor, 1e-6);
    sensor_rows_free(&rows);
    mesh_free(&m);
}
END_TEST

/* A plane below an open sky: L = 1 gives pi to a plane, half of it to a sphere, and the ground reflects to
 * the lower half. Rays are spread evenly: 1,024 of them miss by less than 1 %. */
START_TEST(even_sky) {
    lam_error error = {0};
    sky_bounce sky;
    mesh m = {0};
    mesh_add_cell(&m, &(box_cell){.axis = 2, .level = -1, .from = {90, 90, -1}, .to = {91, 91, -1}}, true);
    mesh_finish(&m, .5f);
    ck_ok(sky_bounce_create("tregenza", 'z', .3, 1, &sky, &error));
    const receiver r[] = {{.at = {0, 0, 1}, .axis = {0, 0, 1}},
                          {.at = {0, 0, 1}, .axis = {0, 0, -1}},
                          {.at = {0, 0, 1}, .axis = {1, 0, 0}},
                          {.at = {0, 0, 1}, .kind = RECEIVER_SPHERE}};
    const double expected[] = {M_PI, .3 * M_PI, .65 * M_PI, .65 * M_PI};
    sensor_rows rows = rows_of(&m, 4, r, &(sensor_rows_options){.sky = &sky});
    for (size_t k = 0; k < 4; k++) {
        double sum = 0;
        for (size_t t = 0; t < rows.n_tiles; t++) sum += (double)rows.sky[t * 4 + k];
        ck_assert_double_eq_tol(sum, expected[k], .01 * expected[k]);
    }
    sensor_rows_free(&rows);
    sky_bounce_free(&sky);
    mesh_free(&m);
}
END_TEST

static bool always(void *context) {
    (void)context;
    return true;
}

/* No receiver, one that is far away, one in a corner of a cell; and work that is cancelled. */
START_TEST(odd_cases) {
    lam_error error = {0};
    mesh m = box_mesh(room, 2, .5f);
    const receiver r[] = {{.at = {1e9, 0, 0}, .axis = {1, 0, 0}},
                          {.at = {1e9, 0, 0}, .axis = {-1, 0, 0}},
                          {.at = {2, 1.5, 0}, .axis = {0, 0, 1}},
                          {.at = {4, 3, 2.5}, .kind = RECEIVER_SPHERE}};
    sensor_rows rows = rows_of(&m, 0, r, &(sensor_rows_options){.rays = 64});
    ck_assert_uint_eq(rows.start[0], 0);
    sensor_rows_free(&rows);
    rows = rows_of(&m, 4, r, &(sensor_rows_options){.rays = 64});
    ck_assert_uint_eq(rows.start[2], 0);
    for (size_t k = 2; k < 4; k++) ck_assert_double_eq_tol(row_sum(&rows, k), 1, 1e-6);
    sensor_rows_free(&rows);
    const progress p = {.cancelled = always};
    ck_assert_int_eq(sensor_rows_make(&m, 4, r, &(sensor_rows_options){.progress = &p}, &rows, &error),
                     LAM_ERR_CANCELLED);
    ck_assert_ptr_null(rows.start);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("rows of sensors");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 300);
    tcase_add_test(c, furnace);
    tcase_add_test(c, pairs_are_exact);
    tcase_add_test(c, lamp_keeps_its_factor);
    tcase_add_test(c, lamps_of_many_elements);
    tcase_add_test(c, in_a_wall);
    tcase_add_test(c, on_both_sides_of_a_sheet);
    tcase_add_test(c, even_sky);
    tcase_add_test(c, odd_cases);
    suite_add_tcase(s, c);
    return suite_run(s);
}
