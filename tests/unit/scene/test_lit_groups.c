/* The groups that people light: windows by their names, and the largest. */
#include "solver/scene/lit_groups.h"
#include "support/box.h"
#include "support/suite.h"

START_TEST(names_of_windows) {
    static const char *const windows[] = {"window", "Window_03", "Verglasung-Glass", "PANE", "roofGlazing"};
    static const char *const others[] = {"", "wall", "glas", "wind", "pan", "lamp", "win dow"};
    for (size_t k = 0; k < 5; k++) ck_assert_msg(group_name_is_window(windows[k]), "%s", windows[k]);
    for (size_t k = 0; k < 7; k++) ck_assert_msg(!group_name_is_window(others[k]), "%s", others[k]);
}
END_TEST

/* Five groups of a box of 10 x 6 x 3 m: two walls of 60 m2, three of 30, 18 and 30 + 18. */
static mesh grouped(char **names) {
    static const uint32_t group[6] = {0, 1, 2, 3, 4, 4};
    const double size[3] = {10, 6, 3};
    mesh m = box_mesh(size, 1, .5f);
    ck_assert_uint_eq(m.n, 6);
    for (size_t i = 0; i < 6; i++) {
        m.group[i] = group[i];
        m.area[i] = (double[]){60, 60, 30, 18, 30, 18}[i];
    }
    m.n_groups = 5;
    m.group_names = names;
    return m;
}

static void find(char **names, size_t most, const uint8_t light[5], size_t lights) {
    lam_error error = {0};
    uint8_t found[5];
    size_t count = 0;
    mesh m = grouped(names);
    ck_ok(lit_groups_find(&m, most, found, &count, &error));
    ck_assert_uint_eq(count, lights);
    for (size_t g = 0; g < 5; g++) ck_assert_uint_eq(found[g], light[g]);
    m.group_names = NULL;
    m.n_groups = 0;
    mesh_free(&m);
}

START_TEST(windows_then_the_largest) {
    static char *plain[] = {"floor", "ceiling", "wall", "door", "desks"},
                *with[] = {"floor", "ceiling", "wall", "window-1", "Glass"};
    find(plain, 2, (uint8_t[]){0, 1, LIT_NOT, LIT_NOT, LIT_NOT}, 2);
    find(plain, 3, (uint8_t[]){0, 1, LIT_NOT, LIT_NOT, 2}, 3);
    find(plain, 9, (uint8_t[]){0, 1, 3, 4, 2}, 5);
    find(with, 2, (uint8_t[]){1, LIT_NOT, LIT_NOT, 0, 0}, 2);
    find(with, 1, (uint8_t[]){LIT_NOT, LIT_NOT, LIT_NOT, 0, 0}, 1);
    find(with, 0, (uint8_t[]){LIT_NOT, LIT_NOT, LIT_NOT, LIT_NOT, LIT_NOT}, 0);
}
END_TEST

/* The light of the only group is that of all elements. */
START_TEST(one_group_is_none) {
    static char *names[] = {"window"};
    lam_error error = {0};
    uint8_t found[1];
    size_t count = 7;
    const double size[3] = {10, 6, 3};
    mesh m = box_mesh(size, 1, .5f);
    for (size_t i = 0; i < m.n; i++) m.group[i] = 0;
    char **own = m.group_names;
    const size_t n_own = m.n_groups;
    m.group_names = names;
    m.n_groups = 1;
    ck_ok(lit_groups_find(&m, 2, found, &count, &error));
    ck_assert_uint_eq(count, 0);
    ck_assert_uint_eq(found[0], LIT_NOT);
    m.group_names = own;
    m.n_groups = n_own;
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("lit_groups");
    TCase *c = tcase_create("all");
    tcase_add_test(c, names_of_windows);
    tcase_add_test(c, windows_then_the_largest);
    tcase_add_test(c, one_group_is_none);
    suite_add_tcase(s, c);
    return suite_run(s);
}
