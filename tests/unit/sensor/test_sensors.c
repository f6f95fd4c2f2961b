/* Lists of sensors: what they become, and the line that each fault ends in. */
#include "solver/base/vector3.h"
#include "solver/sensor/sensors.h"
#include "solver/sensor/sensors_parts.h"
#include "support/box.h"
#include "support/scene.h"

static sensor_list good(const char *name, const char *text, const sensors_options *options) {
    static const sensors_options plain = {.unit = 0};
    lam_error error = {0};
    sensor_list l = {.n = 0};
    ck_assert_msg(
        sensors_read_text(name, text, strlen(text), options != NULL ? options : &plain, &l, &error) == LAM_OK,
        "%s", error.message);
    return l;
}

static void same_point(const double at[3], double x, double y, double z) {
    const double expected[3] = {x, y, z};
    for (int d = 0; d < 3; d++) ck_assert_double_eq_tol(at[d], expected[d], 1e-9);
}

START_TEST(all_kinds) {
    sensor_list l = good("a.json",
                         "{\"unit\":\"cm\",\"points\":[{\"name\":\"desk\",\"at\":[100,200,75]},"
                         "{\"name\":\"two\",\"at\":[[0,0,0],[1,0,0]],\"normal\":[[0,0,2],[3,0,0]]}],"
                         "\"eyes\":[{\"name\":\"seat\",\"at\":[1,1,120],\"view\":[0,5,0]}],"
                         "\"cylinders\":[{\"name\":\"faces\",\"polygon\":[[0,0,0],[400,0,0],[400,200,0],"
                         "[0,200,0]],\"height\":120,\"spacing\":100}],"
                         "\"semicylinders\":[{\"name\":\"street\",\"at\":[0,0,150],\"look\":[1,1,1]}],"
                         "\"spheres\":[{\"name\":\"ball\",\"at\":[[0,0,1]]}],"
                         "\"cubes\":[{\"name\":\"cube\",\"at\":[0,0,1]}]}",
                         NULL);
    ck_assert_uint_eq(l.n_sets, 7);
    ck_assert_uint_eq(l.n, 1 + 2 + 1 + 8 + 1 + 1 + 6);
    ck_assert_str_eq(l.sets[0].name, "desk");
    same_point(l.receivers[0].at, 1, 2, .75);
    same_point(l.receivers[0].axis, 0, 0, 1);
    same_point(l.receivers[2].axis, 1, 0, 0);
    ck_assert_int_eq(l.sets[2].kind, SENSOR_EYES);
    same_point(l.receivers[3].axis, 0, 1, 0);
    const sensor_set *faces = &l.sets[3];
    ck_assert_uint_eq(faces->first, 4);
    ck_assert_uint_eq(faces->columns, 4);
    ck_assert_uint_eq(faces->rows, 2);
    same_point(l.receivers[4].at, .5, .5, 1.2);
    same_point(l.receivers[11].at, 3.5, 1.5, 1.2);
    ck_assert_uint_eq(l.cell[11], 7);
    ck_assert_int_eq(l.receivers[4].kind, RECEIVER_CYLINDER);
    ck_assert_int_eq(l.receivers[12].kind, RECEIVER_SEMICYLINDER);
    same_point(l.receivers[12].look, sqrt(.5), sqrt(.5), 0);
    ck_assert_int_eq(l.receivers[13].kind, RECEIVER_SPHERE);
    same_point(l.receivers[14].axis, 1, 0, 0);
    same_point(l.receivers[19].axis, 0, 0, -1);
    ck_assert_uint_eq(l.cell[0], SENSOR_NO_CELL);
    sensors_free(&l);
}
END_TEST

/* A grid of steps, whose last one is the fastest, and points; in the axes of the scene and with y up. */
START_TEST(probes) {
    const char *text =
        "{\"unit\":\"cm\",\"probes\":[{\"name\":\"hall\",\"from\":[100,0,50],\"steps\":[[0,200,0],"
        "[0,0,150]],\"counts\":[3,2]},{\"name\":\"one\",\"at\":[1,2,3],\"axes\":\"y-up\"},"
        "{\"name\":\"two\",\"at\":[[0,0,0],[100,0,0]],\"axes\":\"scene\"}]}";
    static const double x[] = {1, 0, 0}, z[] = {0, 0, 1}, back[] = {0, -1, 0};
    sensor_list l = good("a.json", text, NULL);
    ck_assert_uint_eq(l.n_sets, 3);
    ck_assert_uint_eq(l.n, 9 * (6 + 1 + 2));
    ck_assert_int_eq(l.sets[0].kind, SENSOR_PROBES);
    ck_assert_uint_eq(l.sets[0].count, 9 * 6);
    for (size_t k = 0; k < l.n; k++) {
        ck_assert_int_eq(l.receivers[k].kind, RECEIVER_HARMONIC + k % 9);
        ck_assert_mem_eq(l.receivers[k].axis, k / 9 == 6 ? back : z, sizeof z);
        ck_assert_mem_eq(l.receivers[k].look, x, sizeof x);
        ck_assert_uint_eq(l.cell[k], SENSOR_NO_CELL);
    }
    same_point(l.receivers[0].at, 1, 0, .5);
    same_point(l.receivers[17].at, 1, 0, 2);
    same_point(l.receivers[18].at, 1, 2, .5);
    same_point(l.receivers[9 * 6].at, .01, .02, .03);
    same_point(l.receivers[9 * 8].at, 1, 0, 0);
    sensors_free(&l);
    /* Where y or x points up, as glTF files are turned. */
    l = good("a.json", text, &(sensors_options){.up = 'y'});
    ck_assert_mem_eq(l.receivers[9 * 6].axis, z, sizeof z);
    sensors_free(&l);
    l = good("a.json", text, &(sensors_options){.up = 'x'});
    ck_assert_mem_eq(l.receivers[9 * 6].axis, z, sizeof z);
    ck_assert_mem_eq(l.receivers[9 * 6].look, back, sizeof back);
    sensors_free(&l);
}
END_TEST

START_TEST(lines) {
    sensor_list l = good(
        "a.csv", "name,x,y,z,nx,ny,nz\r\na,1,2,3,0,0,2\r\na,2,2,3,,,\r\n\r\n\"b\",0,0,1,1,0,0\r\n", NULL);
    ck_assert_uint_eq(l.n_sets, 2);
    ck_assert_uint_eq(l.sets[0].count, 2);
    same_point(l.receivers[1].axis, 0, 0, 1);
    same_point(l.receivers[2].axis, 1, 0, 0);
    sensors_free(&l);
    l = good("x.csv", "x;y;z;name\n1,5;2;3;a\n", &(sensors_options){.up = 'y'});
    same_point(l.receivers[0].at, 1.5, 2, 3);
    same_point(l.receivers[0].axis, 0, 1, 0);
    sensors_free(&l);
    l = good("/tmp/room 1.pts", "# Radiance\n1 2 .8 0 0 1\n\t1.5\t2 .8 0 0 1\n",
             &(sensors_options){.unit = .5});
    ck_assert_uint_eq(l.n_sets, 1);
    ck_assert_str_eq(l.sets[0].name, "room 1");
    ck_assert_uint_eq(l.n, 2);
    same_point(l.receivers[1].at, .75, 1, .4);
    sensors_free(&l);
}
END_TEST

/* Spacings as EN 12464-1 prints them, of a side of d m: rounded to one or two figures. */
START_TEST(spacing_of_the_standard) {
    static const double table[][2] = {{.4, .15}, {.6, .2}, {1, .2}, {2, .3}, {5, .6},
                                      {10, 1},   {25, 2},  {50, 3}, {100, 5}};
    for (size_t k = 0; k < sizeof table / sizeof *table; k++)
        ck_assert_double_eq_tol(sensors_en12464(table[k][0], table[k][0]), table[k][1], .33 * table[k][1]);
    ck_assert_double_eq_tol(sensors_en12464(10, 8), 1, 1e-12);
    ck_assert_double_eq_tol(sensors_en12464(10, 1), .2, 1e-12);
    ck_assert_double_eq(sensors_en12464(1e6, 1e6), 10);
}
END_TEST

/* A room in the form of an L, turned by 30 degrees, whose floor is cut into squares: cells lie along its
 * walls, inside of it and off its rim. */
static mesh turned_floor(char **names) {
    mesh m = {0};
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 4; j++) {
            double corners[4][3];
            if (i >= 3 && j >= 2) continue;
            for (int c = 0; c < 4; c++) {
                const double x = i + (c == 1 || c == 2), y = j + (c > 1);
                corners[c][0] = x * sqrt(.75) - y * .5;
                corners[c][1] = x * .5 + y * sqrt(.75);
                corners[c][2] = .1;
            }
            mesh_add_quad(&m, (const double(*)[3])corners);
        }
    mesh_finish(&m, .5f);
    m.n_groups = 1;
    m.group_names = names;
    return m;
}

START_TEST(grid_over_a_group) {
    char *names[] = {(char[]){"floor"}};
    mesh m = turned_floor(names);
    const sensors_options options = {.m = &m};
    sensor_list l = good("a.json",
                         "{\"grids\":[{\"name\":\"g\",\"over\":\"floor\",\"height\":0.8,\"spacing\":1},"
                         "{\"name\":\"h\",\"over\":\"floor\",\"spacing\":0.5,\"border\":0.5},"
                         "{\"name\":\"e\",\"over\":\"floor\",\"spacing\":\"en12464\",\"border\":0.5}]}",
                         &options);
    const sensor_set *g = &l.sets[0], *h = &l.sets[1], *e = &l.sets[2];
    ck_assert_uint_eq(g->columns, 6);
    ck_assert_uint_eq(g->rows, 4);
    ck_assert_uint_eq(g->count, 18);
    ck_assert_double_eq_tol(g->spacing[0], 1, 1e-9);
    for (size_t k = 0; k < g->count; k++) {
        double c[3];
        mesh_centroid(&m, k, c);
        ck_assert_double_eq_tol(l.receivers[k].at[2], .9, 1e-9);
        same_point(l.receivers[k].axis, 0, 0, 1);
        bool found = false; /* each middle of a cell is that of a square */
        for (size_t j = 0; j < m.n; j++) {
            mesh_centroid(&m, j, c);
            found = found || hypot(c[0] - l.receivers[k].at[0], c[1] - l.receivers[k].at[1]) < 1e-6;
        }
        ck_assert(found);
    }
    /* 5 x 3 m less the re-entrant part: middles from .75 on, every half metre, and .5 m off all walls: of 10
     * x 6 cells those with x < 2.5 or y < 1.5. */
    ck_assert_uint_eq(h->columns, 10);
    ck_assert_uint_eq(h->rows, 6);
    ck_assert_uint_eq(h->count, 4 * 6 + 6 * 2);
    /* d = 5 m: .616 m, 9 columns of .556 m; 3 m: 5 rows of .6 m */
    ck_assert_uint_eq(e->columns, 9);
    ck_assert_uint_eq(e->rows, 5);
    sensors_free(&l);
    m.group_names = NULL;
    mesh_free(&m);
}
END_TEST

typedef struct fault {
    const char *name, *text, *says;
} fault;

START_TEST(faults) {
    static const fault all[] = {
        {"a.json", "{", "a.json: line 1, column 1: "},
        {"a.json", "{}", "a.json: has no sensor, must have 1 to 1000000"},
        {"a.json", "{\"grid\":[]}",
         "a.json: the file has a member \"grid\", which is not known: did you mean grids?"},
        {"a.json", "{\"unit\":\"mile\"}", "a.json: unit = \"mile\", must be one of mm|cm|m|in|ft"},
        {"a.json", "{\"points\":{}}", "a.json: points = {}, must be an array"},
        {"a.json", "{\"points\":[3]}", "a.json: points[0] = 3, must be an object {...}"},
        {"a.json", "{\"points\":[{\"at\":[0,0,0]}]}", "a.json: points[0] has no name: it must have one"},
        {"a.json", "{\"points\":[{\"name\":\"a=b\",\"at\":[0,0,0]}]}",
         "a.json: points[0]: name = \"a=b\", must have no control"},
        {"a.json", "{\"points\":[{\"name\":\"\",\"at\":[0,0,0]}]}",
         "a.json: points[0]: name = \"\", must be a name of 1 to 63 bytes"},
        {"a.json", "{\"points\":[{\"name\":\"a\"}]}", "a.json: points[0] must have at, its points"},
        {"a.json", "{\"points\":[{\"name\":\"a\",\"at\":[0,0]}]}",
         "a.json: points[0]: at = [0,0], must be an array of three numbers"},
        {"a.json", "{\"points\":[{\"name\":\"a\",\"at\":[0,0,1e10]}]}",
         "a.json: points[0]: at = 1e10, must be at most 1000000000"},
        {"a.json", "{\"points\":[{\"name\":\"a\",\"at\":[0,0,1],\"normal\":[0,0,0]}]}",
         "a.json: points[0]: normal = [0,0,0], must have a length above 0"},
        {"a.json", "{\"points\":[{\"name\":\"a\",\"at\":[0,0,1],\"norml\":[0,0,1]}]}",
         "did you mean normal?"},
        {"a.json", "{\"points\":[{\"name\":\"a\",\"at\":[[0,0,1]],\"normal\":[[0,0,1],[0,0,1]]}]}",
         "must be one direction, or 1, as many as points"},
        {"a.json", "{\"points\":[{\"name\":\"a\",\"at\":[]}]}",
         "a.json: points[0]: at = [], must be an array of three numbers"},
        {"a.json", "{\"eyes\":[{\"name\":\"a\",\"at\":[0,0,1]}]}",
         "a.json: eyes[0] has no view: it must have one"},
        {"a.json",
         "{\"points\":[{\"name\":\"a\",\"at\":[0,0,1]}],\"eyes\":[{\"name\":\"a\",\"at\":[0,0,1],\"view\":[1,"
         "0,0]}]}",
         "a.json: eyes[0]: name = a, which points[0] has too"},
        {"a.json", "{\"grids\":[{\"name\":\"a\",\"over\":\"floor\"}]}",
         "a.json: grids[0]: over = floor needs a scene"},
        {"a.json", "{\"grids\":[{\"name\":\"a\",\"over\":\"floor\",\"polygon\":[]}]}",
         "a.json: grids[0] must have over, a group, or polygon, corners, and not several"},
        {"a.json", "{\"grids\":[{\"name\":\"a\",\"polygon\":[[0,0,0],[1,0,0]]}]}",
         "must be an array of 3 to 1000 corners [x, y, z]"},
        {"a.json", "{\"grids\":[{\"name\":\"a\",\"polygon\":[[0,0,0],[1,0,0],[2,0,0]]}]}",
         "a.json: grids[0]: polygon has no area"},
        {"a.json", "{\"grids\":[{\"name\":\"a\",\"polygon\":[[0,0,0],[1,0,0],[1,1,1],[0,1,0]]}]}",
         "off its plane, must be at most"},
        {"a.json", "{\"grids\":[{\"name\":\"a\",\"polygon\":[[0,0,0],[1,0,0],[0,1,0]],\"spacing\":0}]}",
         "a.json: grids[0]: spacing = 0, must be above 0"},
        {"a.json", "{\"grids\":[{\"name\":\"a\",\"polygon\":[[0,0,0],[1,0,0],[0,1,0]],\"spacing\":1e-4}]}",
         "must be at most 1000000"},
        {"a.json", "{\"grids\":[{\"name\":\"a\",\"polygon\":[[0,0,0],[1,0,0],[0,1,0]],\"spacing\":\"en\"}]}",
         "spacing = \"en\", must be a length above 0 or \"en12464\""},
        {"a.json", "{\"grids\":[{\"name\":\"a\",\"polygon\":[[0,0,0],[1,0,0],[1,1,0]],\"border\":0.5}]}",
         "border = 0.5 m leaves nothing of 1"},
        {"a.json", "{\"semicylinders\":[{\"name\":\"a\",\"at\":[0,0,1],\"look\":[0,0,1]}]}",
         "a.json: semicylinders[0]: look = [0,0,1], must not lie along the axis"},
        {"a.json", "{\"semicylinders\":[{\"name\":\"a\",\"at\":[0,0,1]}]}",
         "a.json: semicylinders[0]: look = nothing, must be an array of three numbers"},
        {"a.json", "{\"cubes\":[{\"name\":\"a\",\"at\":[0,0,1],\"spacing\":1}]}",
         "a.json: cubes[0] has at; spacing is for one over a group or polygon"},
        {"a.json", "{\"probes\":[{\"name\":\"a\"}]}",
         "a.json: probes[0] must have at, its points, or from, the first of a row or a grid"},
        {"a.json", "{\"probes\":[{\"name\":\"a\",\"at\":[0,0,1],\"counts\":[2]}]}",
         "a.json: probes[0] has at; steps and counts are for a row, which has from"},
        {"a.json", "{\"probes\":[{\"name\":\"a\",\"from\":[0,0,1],\"counts\":[2]}]}",
         "a.json: probes[0] has from; then it must have steps and counts too"},
        {"a.json", "{\"probes\":[{\"name\":\"a\",\"from\":[0,0,1],\"steps\":[[1,0,0]],\"counts\":[1.5]}]}",
         "a.json: probes[0]: counts = [1.5], must be whole numbers"},
        {"a.json", "{\"probes\":[{\"name\":\"a\",\"from\":[0,0,1],\"steps\":[[0,0,0]],\"counts\":[2]}]}",
         "a.json: probes[0]: steps = [[0,0,0]], must have a length above 0 where there is more than one"},
        {"a.json",
         "{\"probes\":[{\"name\":\"a\",\"from\":[0,0,1],\"steps\":[[1,0,0],[0,1,0]],\"counts\":[999,999]}]}",
         "a.json: probes[0]: counts make 998001 probes, must be at most 111111"},
        {"a.json", "{\"probes\":[{\"name\":\"a\",\"at\":[0,0,1],\"axes\":\"z-up\"}]}",
         "a.json: probes[0]: axes = \"z-up\", must be \"scene\" or \"y-up\""},
        {"a.json", "{\"probes\":[{\"name\":\"a\",\"at\":[0,0,1],\"normal\":[0,0,1]}]}",
         "a.json: probes[0] has a member \"normal\", which is not known"},
        {"a.csv", "name,x,y,q\n", "a.csv: line 1: column 4, \"q\", is not known: "},
        {"a.csv", "name,x,y\na,1,2\n", "a.csv: line 1 has no column z: name, x, y and z must be there"},
        {"a.csv", "name,x,y,z,x\n", "a.csv: line 1 has the column x twice"},
        {"a.csv", "name,x,y,z\na,1,two,3\n", "a.csv: line 2: y = two, must be a number"},
        {"a.csv", "name,x,y,z\na,1,,3\n", "a.csv: line 2 has no y"},
        {"a.csv", "name,x,y,z\na,1,2,3,4\n", "a.csv: line 2 has more cells than the 4 columns of the first"},
        {"a.csv", "name,x,y,z,nx\na,1,2,3,0\n", "a.csv: line 2: the normal 0 0 0 must have a length above 0"},
        {"a.csv", "name,x,y,z\na,1,2,3\nb,1,2,3\na,1,2,3\n",
         "a.csv: line 4: name = a, which the sensors of line 2 have too"},
        {"a.csv", "name,x,y,z\n", "a.csv: has no sensor"},
        {"a.pts", "1 2 3 0 0\n", "a.pts: line 1 has 5 numbers, must have 6: x y z dx dy dz"},
        {"a.pts", "1 2 3 0 0 1\n1 2 x 0 0 1\n", "a.pts: line 2: x must be a number"},
        {"a.pts", "1 2 3 0 0 0\n", "a.pts: line 1: the normal 0 0 0 must have a length above 0"},
        {"a.pts", "1 2 3e12 0 0 1\n", "a.pts: line 1: z = 3e+12, must be at most 1000000000"},
        {"a.pts", "", "a.pts: the file is empty"}};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        lam_error error = {.message = ""};
        sensor_list l = {.n = 7};
        const lam_status status = sensors_read_text(all[k].name, all[k].text, strlen(all[k].text),
                                                    &(sensors_options){.unit = 0}, &l, &error);
        ck_assert_msg(status != LAM_OK, "%s", all[k].text);
        ck_assert_msg(strstr(error.message, all[k].says) != NULL, "%s\nsays %s", all[k].text, error.message);
        ck_assert_uint_eq(l.n, 7);
    }
}
END_TEST

START_TEST(groups_that_are_not_there) {
    char *names[] = {(char[]){"floor"}};
    mesh m = turned_floor(names);
    lam_error error = {.message = ""};
    sensor_list l;
    const char *text = "{\"grids\":[{\"name\":\"g\",\"over\":\"flor\"}]}";
    ck_assert_int_eq(sensors_read_text("a.json", text, strlen(text), &(sensors_options){.m = &m}, &l, &error),
                     LAM_ERR_ARGUMENT);
    ck_assert_str_eq(error.message,
                     "a.json: grids[0]: over = flor, which is no group of the scene: did you mean floor?");
    m.group_names = NULL;
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("lists of sensors");
    TCase *c = tcase_create("all");
    tcase_add_test(c, all_kinds);
    tcase_add_test(c, probes);
    tcase_add_test(c, lines);
    tcase_add_test(c, spacing_of_the_standard);
    tcase_add_test(c, grid_over_a_group);
    tcase_add_test(c, faults);
    tcase_add_test(c, groups_that_are_not_there);
    suite_add_tcase(s, c);
    return suite_run(s);
}
