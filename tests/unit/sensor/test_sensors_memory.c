/* Sensors that are read, rows and grids of probes that are found, with too little memory: all say so and keep
 * nothing. */
#include "solver/sensor/probe_grid.h"
#include "solver/sensor/sensor_rows.h"
#include "solver/sensor/sensors.h"
#include "support/box.h"
#include "support/failing_memory.h"
#include "support/suite.h"

#include <omp.h>

static const char *const lists[] = {
    ("{\"grids\": [{\"name\": \"a\", \"polygon\": [[0,0,0],[1,0,0],[1,1,0]], \"spacing\": 0.3}],"
     "\"cubes\": [{\"name\": \"b\", \"at\": [0,0,0]}],"
     "\"probes\": [{\"name\": \"c\", \"at\": [0,0,0]}]}"),
    "name,x,y,z\na,1,2,3\nb,1,2,3\n", "1 2 3 0 0 1\n",
    "{\"grids\": [{\"name\": \"a\", \"over\": \"floor\"}]}"};

START_TEST(reading) {
    mesh m = {0};
    char *names[] = {(char[]){"floor"}};
    mesh_add_cell(&m, &(box_cell){.axis = 2, .from = {0, 0, 0}, .to = {3, 2, 0}}, true);
    mesh_finish(&m, .5f);
    m.n_groups = 1;
    m.group_names = names;
    lam_error error = {0};
    sensor_list l = {.n = 0};
    long needed = 0;
    for (;; needed++) {
        allocations_left = needed;
        const lam_status status =
            sensors_read_text("a", lists[_i], strlen(lists[_i]), &(sensors_options){.m = &m}, &l, &error);
        allocations_left = -1;
        if (status == LAM_OK) break;
        ck_assert_int_eq(status, LAM_ERR_MEMORY);
        ck_assert(l.sets == NULL && l.receivers == NULL && l.cell == NULL);
    }
    /* array_grow allocates by itself, uncounted; the list of names is counted */
    ck_assert_int_ge(needed, 1);
    sensors_free(&l);
    m.group_names = NULL;
    mesh_free(&m);
}
END_TEST

START_TEST(rows) {
    const double size[3] = {3, 2, 2};
    receiver r[2 + HARMONICS] = {{.at = {1, 1, 1}, .axis = {0, 0, 1}},
                                 {.at = {1, 1, 1}, .kind = RECEIVER_SPHERE}};
    for (int k = 0; k < HARMONICS; k++) {
        r[2 + k] = sensors_probe(false, 'z');
        r[2 + k].kind = (receiver_kind)(RECEIVER_HARMONIC + k);
        r[2 + k].at[0] = r[2 + k].at[1] = r[2 + k].at[2] = 1;
    }
    lam_error error = {0};
    sky_bounce sky;
    mesh m = box_mesh(size, 2, .5f);
    sensor_rows made = {.n = 0};
    long needed = 0;
    omp_set_num_threads(1); /* the count of allocations is no atomic one */
    ck_ok(sky_bounce_create("tregenza", 'z', 0, 1, &sky, &error));
    for (;; needed++) {
        allocations_left = needed;
        const lam_status status = sensor_rows_make(
            &m, 2 + HARMONICS, r, &(sensor_rows_options){.rays = 64, .sky = &sky}, &made, &error);
        allocations_left = -1;
        if (status == LAM_OK) break;
        ck_assert_int_eq(status, LAM_ERR_MEMORY);
        ck_assert_ptr_null(made.start);
    }
    ck_assert_int_ge(needed, 15 + HARMONICS);
    sensor_rows_free(&made);
    sky_bounce_free(&sky);
    mesh_free(&m);
}
END_TEST

START_TEST(probes) {
    const double size[3] = {3, 2, 2};
    lam_error error = {0};
    mesh m = box_mesh(size, 2, .5f);
    sensor_list l = {.n = 0};
    size_t left_out = 0;
    long needed = 0;
    omp_set_num_threads(1);
    for (;; needed++) {
        allocations_left = needed;
        const lam_status status = probe_grid_add(&m, &(probe_grid){.spacing = 1}, &l, &left_out, &error);
        allocations_left = -1;
        if (status == LAM_OK) break;
        ck_assert_int_eq(status, LAM_ERR_MEMORY);
        ck_assert(l.n == 0 && l.n_sets == 0);
    }
    ck_assert_int_ge(needed, 1);
    ck_assert_uint_eq(l.n, 12 * HARMONICS);
    sensors_free(&l);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("sensors_memory");
    TCase *c = tcase_create("all");
    tcase_add_loop_test(c, reading, 0, sizeof lists / sizeof *lists);
    tcase_add_test(c, rows);
    tcase_add_test(c, probes);
    suite_add_tcase(s, c);
    return suite_run(s);
}
