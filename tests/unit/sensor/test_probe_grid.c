/* Grids of probes: points in bodies and outside of rooms are left out, sets of the same name are replaced. */
#include "solver/sensor/probe_grid.h"
#include "support/box.h"
#include "support/suite.h"

/* A room of 4 x 3 x 2.5 m, with a block of 1 x 1 x 1 m in it. */
static mesh room_with_block(void) {
    static const double room[3] = {4, 3, 2.5}, low[3] = {1, 1, .2}, high[3] = {2, 2, 1.2};
    mesh m = {0};
    for (size_t i = 0; i < 6; i++) {
        const box_cell wall = box_cell_of(room, 1, i);
        box_cell side = {.axis = (int)i / 2, .level = i % 2 == 0 ? low[i / 2] : high[i / 2]};
        memcpy(side.from, low, sizeof low);
        memcpy(side.to, high, sizeof high);
        side.from[side.axis] = side.to[side.axis] = side.level;
        mesh_add_cell(&m, &wall, i % 2 == 0);
        mesh_add_cell(&m, &side, i % 2 == 1);
    }
    mesh_finish(&m, .5f);
    m.up = 'z';
    return m;
}

static bool in_block(const double at[3]) {
    return at[0] > 1 && at[0] < 2 && at[1] > 1 && at[1] < 2 && at[2] > .2 && at[2] < 1.2;
}

/* 8 x 6 x 5 points, .25 m off the walls; 2 x 2 x 2 lie in the block. */
START_TEST(free_space) {
    lam_error error = {0};
    mesh m = room_with_block();
    sensor_list l = {.n = 0};
    size_t left_out = 0, k = 0;
    ck_ok(probe_grid_add(&m, &(probe_grid){.spacing = .5}, &l, &left_out, &error));
    ck_assert_uint_eq(left_out, 8);
    ck_assert_uint_eq(l.n, 9 * (8 * 6 * 5 - 8));
    ck_assert_uint_eq(l.n_sets, 1);
    ck_assert_str_eq(l.sets[0].name, "probes");
    ck_assert_int_eq(l.sets[0].kind, SENSOR_PROBES);
    ck_assert_uint_eq(l.sets[0].count, l.n);
    for (size_t i = 0; i < 8 * 6 * 5; i++) {
        const double at[3] = {.25 + .5 * (double)(i % 8), .25 + .5 * (double)(i / 8 % 6),
                              .25 + .5 * (double)(i / 48)};
        if (in_block(at)) continue;
        for (int w = 0; w < 9; w++, k++) {
            for (int d = 0; d < 3; d++) ck_assert_double_eq_tol(l.receivers[k].at[d], at[d], 1e-12);
            ck_assert_int_eq(l.receivers[k].kind, RECEIVER_HARMONIC + w);
            ck_assert_double_eq(l.receivers[k].axis[2], 1);
        }
    }
    /* Another one takes its place, with y up. */
    ck_ok(probe_grid_add(&m, &(probe_grid){.spacing = 100, .y_up = true}, &l, &left_out, &error));
    ck_assert_uint_eq(l.n_sets, 1);
    ck_assert_uint_eq(l.n, 9);
    ck_assert_double_eq(l.receivers[0].at[0], 2);
    ck_assert_double_eq(l.receivers[0].axis[1], -1);
    sensors_free(&l);
    mesh_free(&m);
}
END_TEST

/* A room in the form of an L, whose other quarter is open to above and outside: 3 x 3 of 6 x 6 columns are
 * not in it, and of the 5 points of each none. */
START_TEST(outside_of_a_room) {
    static const double rim[6][2] = {{0, 0}, {3, 0}, {3, 1.5}, {1.5, 1.5}, {1.5, 3}, {0, 3}},
                        floors[2][4] = {{0, 0, 3, 1.5}, {0, 1.5, 1.5, 3}};
    lam_error error = {0};
    mesh m = {0};
    sensor_list l = {.n = 0};
    size_t left_out = 0;
    for (int k = 0; k < 6; k++) {
        const double *a = rim[k], *b = rim[(k + 1) % 6];
        const double wall[4][3] = {{b[0], b[1], 0}, {a[0], a[1], 0}, {a[0], a[1], 2.5}, {b[0], b[1], 2.5}};
        mesh_add_quad(&m, wall);
    }
    for (int k = 0; k < 4; k++) {
        const double *f = floors[k / 2], z = k % 2 == 0 ? 0 : 2.5;
        const box_cell cell = {.axis = 2, .level = z, .from = {f[0], f[1], z}, .to = {f[2], f[3], z}};
        mesh_add_cell(&m, &cell, k % 2 == 0);
    }
    mesh_finish(&m, .5f);
    ck_ok(probe_grid_add(&m, &(probe_grid){.spacing = .5}, &l, &left_out, &error));
    ck_assert_uint_eq(left_out, 3 * 3 * 5);
    for (size_t k = 0; k < l.n; k++) ck_assert(l.receivers[k].at[0] < 1.5 || l.receivers[k].at[1] < 1.5);
    sensors_free(&l);
    mesh_free(&m);
}
END_TEST

/* Sets before and behind it in the list stay as they are. */
START_TEST(beside_other_sets) {
    static const char text[] = "{\"points\":[{\"name\":\"a\",\"at\":[1,2,0.5]}],"
                               "\"probes\":[{\"name\":\"probes\",\"at\":[[1,1,1],[3,1,1]]},"
                               "{\"name\":\"b\",\"at\":[3,2,1]}]}";
    lam_error error = {0};
    mesh m = room_with_block();
    sensor_list l;
    size_t left_out = 0;
    ck_ok(sensors_read_text("a.json", text, sizeof text - 1, &(sensors_options){.unit = 0}, &l, &error));
    ck_ok(probe_grid_add(&m, &(probe_grid){.spacing = 2}, &l, &left_out, &error));
    ck_assert_uint_eq(l.n_sets, 3);
    ck_assert_str_eq(l.sets[1].name, "b");
    ck_assert_uint_eq(l.sets[1].first, 1);
    ck_assert_double_eq(l.receivers[1].at[0], 3);
    ck_assert_uint_eq(l.sets[2].first, 10);
    ck_assert_uint_eq(l.sets[2].count, l.n - 10);
    ck_assert_uint_eq(l.sets[2].count % 9, 0);
    ck_assert_double_eq(l.receivers[10].at[0], 1);
    sensors_free(&l);
    mesh_free(&m);
}
END_TEST

static void refused(const mesh *m, double spacing, sensor_list *l, const char *says) {
    lam_error error = {.message = ""};
    const size_t n = l->n;
    size_t left_out;
    ck_assert_int_eq(probe_grid_add(m, &(probe_grid){.spacing = spacing}, l, &left_out, &error),
                     LAM_ERR_ARGUMENT);
    ck_assert_msg(strstr(error.message, says) != NULL, "%s", error.message);
    ck_assert_uint_eq(l->n, n);
}

START_TEST(refusals) {
    static const char text[] = "{\"points\":[{\"name\":\"probes\",\"at\":[1,2,0.5]}]}";
    lam_error error = {0};
    mesh m = room_with_block(), outwards = {0};
    sensor_list l = {.n = 0};
    refused(&m, .01, &l, "--probes-grid 0.01: the scene of 4 x 3 x 2.5 m has more than 1000000 points");
    refused(&m, 1e-300, &l, "more than 1000000 points");
    sensor_list full = {.n = SENSORS_MOST - 20};
    refused(&m, 1, &full,
            "35 probes beside 999980 sensors are too many, at most 2 fit; take a larger spacing");
    ck_ok(sensors_read_text("a.json", text, sizeof text - 1, &(sensors_options){.unit = 0}, &l, &error));
    refused(&m, 1, &l, "other sensors have the name probes");
    for (size_t i = 0; i < 6; i++) {
        const box_cell wall = box_cell_of((double[3]){1, 1, 1}, 1, i);
        mesh_add_cell(&outwards, &wall, i % 2 == 1);
    }
    mesh_finish(&outwards, .5f);
    refused(&outwards, .5, &l, "none of 8 points is in free space");
    sensors_free(&l);
    mesh_free(&outwards);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("grids of probes");
    TCase *c = tcase_create("all");
    tcase_add_test(c, free_space);
    tcase_add_test(c, outside_of_a_room);
    tcase_add_test(c, beside_other_sets);
    tcase_add_test(c, refusals);
    suite_add_tcase(s, c);
    return suite_run(s);
}
