/* Questions about units and axes: rooms, houses and towns in units of other programs, and upright. */
#include "support/suite.h"

#include "solver/scene/size_question.h"
#include "support/scene.h"

/* A folder that each test has to itself. */
static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

/* A closed box of x, y and z, whose faces look inward, or outward; the group of its levels is named. */
static mesh box_of(double x, double y, double z, bool outward, const char *level) {
    static const int sides[6][4] = {{0, 1, 2, 3}, {7, 6, 5, 4}, {0, 4, 5, 1},
                                    {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}};
    char text[1024];
    int n = 0;
    for (int v = 0; v < 8; v++)
        n += snprintf(text + n, sizeof text - (size_t)n, "v %g %g %g\n", (v + 1) / 2 % 2 * x, v / 2 % 2 * y,
                      v / 4 * z);
    for (int s = 0; s < 6; s++) {
        n += snprintf(text + n, sizeof text - (size_t)n, "o %s\nf", s < 2 && level != NULL ? level : "side");
        for (int k = 0; k < 4; k++)
            n += snprintf(text + n, sizeof text - (size_t)n, " %d", sides[s][outward ? 3 - k : k] + 1);
        n += snprintf(text + n, sizeof text - (size_t)n, "\n");
    }
    import_report report;
    return obj_good(folder, text, &report);
}

START_TEST(units_are_told_by_height_and_width) {
    static const struct {
        double x, y, z;
        bool outward;
        const char *word;
    } cases[] = {
        {4000, 3000, 2500, false, "mm"},   {43000, 12000, 9000, true, "mm"}, {400, 300, 250, false, "cm"},
        {1200, 900, 700, true, "cm"},      {13.1, 9.8, 8.2, false, "ft"},    {4, 3, 2.5, false, NULL},
        {13.1, 9.8, 8.2, true, NULL},      {30, 20, 8, false, NULL},         {479, 476, 69, true, NULL},
        {3000, 3000, 200, true, NULL},     {60, 50, 300, true, NULL},        {.4, .3, .25, false, NULL},
        {400000, 300000, 2500, true, NULL}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        mesh m = box_of(cases[k].x, cases[k].y, cases[k].z, cases[k].outward, NULL);
        const length_unit *unit = mesh_likely_unit(&m);
        const char *word = unit == NULL ? "none" : unit->word;
        ck_assert_msg(strcmp(word, cases[k].word == NULL ? "none" : cases[k].word) == 0, "%g x %g x %g: %s",
                      cases[k].x, cases[k].y, cases[k].z, word);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(units_have_names) {
    ck_assert_double_eq(length_unit_find("mm")->metres, .001);
    ck_assert_double_eq(length_unit_find("cm")->metres, .01);
    ck_assert_double_eq(length_unit_find("m")->metres, 1);
    ck_assert_double_eq(length_unit_find("in")->metres, .0254);
    ck_assert_double_eq(length_unit_find("ft")->metres, .3048);
    ck_assert_ptr_null(length_unit_find("km"));
    ck_assert_ptr_null(length_unit_find(""));
}
END_TEST

/* The floor is the first pair of faces, at z = 0 and the height: y up would have them as walls. */
START_TEST(rooms_on_their_side_are_asked_about) {
    static const struct {
        double x, y, z;
        char up;
        const char *level;
        char likely;
    } cases[] = {{4, 3, 2.5, 'z', "floor", 0},     {4, 3, 2.5, 'y', "Ceiling.1", 'z'},
                 {4, 3, 2.5, 'x', "floor", 0},     {3, 4, 9, 'z', "Fussboden", 0},
                 {5.14, 2.6, 4.5, 'z', NULL, 'y'}, {5, 2, 5, 'z', NULL, 'y'},
                 {5, 5, 2, 'y', NULL, 'z'},        {5, 2, 5, 'y', NULL, 0},
                 {20, 2, 3, 'z', NULL, 0},         {9, 9, 30, 'z', NULL, 0}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        mesh m = box_of(cases[k].x, cases[k].y, cases[k].z, false, cases[k].level);
        m.up = cases[k].up;
        const char likely = mesh_likely_up(&m);
        ck_assert_msg(likely == cases[k].likely, "%zu: %d", k, likely);
        mesh_free(&m);
    }
    mesh m = {0};
    import_report report;
    lam_error error = {0};
    ck_assert_msg(import_fixture("room-front/room-front.obj", &m, &report, &error) == LAM_OK, "%s",
                  error.message);
    ck_assert_int_eq(mesh_likely_up(&m), 'y'); /* by its lamp */
    m.up = 'y';
    ck_assert_int_eq(mesh_likely_up(&m), 0);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("size_question");
    TCase *tests = tcase_create("size_question");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, units_are_told_by_height_and_width);
    tcase_add_test(tests, units_have_names);
    tcase_add_test(tests, rooms_on_their_side_are_asked_about);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
