#include "support/suite.h"

#include "solver/operator/groups/groups.h"

#include <stdlib.h>
#include <string.h>

enum { N = 8, GROUPS = 8 };

/* Fronts 0 ... 4, then backs 5 ... 7: an object of two materials, of which one has the name of backs; a floor
 * with a back, beside an object that is called as its backs would be. */
static const char *const names[GROUPS] = {"lamp.white",      "lamp.back",    "floor",          "floor.back",
                                          "lamp.white.back", "floor.back-2", "lamp.back.back", "wall"};
static const uint32_t group[N] = {0, 1, 2, 3, 7, 4, 6, 5};

static group_index make(size_t n_backs) {
    group_index made = {0};
    char **block = malloc(GROUPS * (sizeof *block + 24)), *to = (char *)(block + GROUPS);
    for (size_t g = 0; g < GROUPS; g++, to += 24) block[g] = strcpy(to, names[g]);
    ck_assert_int_eq(group_index_make(N, n_backs, group, GROUPS, block, &made, NULL), LAM_OK);
    return made;
}

/* The groups that a name means, as the names of these in order with a blank behind each. */
static const char *found(const group_index *index, const char *name) {
    static char text[256];
    const uint32_t *groups = NULL;
    const size_t n = group_index_find(index, name, strlen(name), &groups);
    text[0] = '\0';
    for (size_t k = 0; k < n; k++) strcat(strcat(text, names[groups[k]]), " ");
    return text;
}

START_TEST(an_object_means_its_fronts) {
    group_index index = make(3);
    ck_assert_uint_eq(index.n_backs, 3);
    ck_assert_str_eq(found(&index, "floor"), "floor ");
    ck_assert_str_eq(found(&index, "floor.back"), "floor.back "); /* the object of this name */
    ck_assert_str_eq(found(&index, "floor.back-2"), "floor.back-2 ");
    ck_assert_str_eq(found(&index, "lamp"), "lamp.back lamp.white ");
    ck_assert_str_eq(found(&index, "lamp.white"), "lamp.white ");
    ck_assert_str_eq(found(&index, "lamp.white.back"), "lamp.white.back ");
    ck_assert_str_eq(found(&index, "lamp.back"), "lamp.back "); /* the material of this name */
    ck_assert_str_eq(found(&index, "wall"), "wall ");
    ck_assert_str_eq(found(&index, "wall.back"), "");
    ck_assert_str_eq(found(&index, ".back"), "");
    ck_assert_str_eq(found(&index, ""), "");
    group_index_free(&index);
}
END_TEST

/* Where no element is a back, as in stores without them, names mean what they meant. */
START_TEST(without_backs_names_are_plain) {
    group_index index = make(0);
    ck_assert_uint_eq(index.n_backs, 0);
    ck_assert_str_eq(found(&index, "lamp"), "lamp.back lamp.back.back lamp.white lamp.white.back ");
    ck_assert_str_eq(found(&index, "lamp.white"), "lamp.white ");
    group_index_free(&index);
}
END_TEST

/* `object.back` means the backs of all materials of an object. */
START_TEST(an_object_has_backs) {
    static const char *const made_of[] = {"box.red", "box.blue", "box.red.back", "box.blue.back"};
    static const uint32_t of[] = {0, 1, 2, 3};
    group_index index = {0};
    const uint32_t *groups = NULL;
    char **block = malloc(4 * (sizeof *block + 24)), *to = (char *)(block + 4);
    for (size_t g = 0; g < 4; g++, to += 24) block[g] = strcpy(to, made_of[g]);
    ck_assert_int_eq(group_index_make(4, 2, of, 4, block, &index, NULL), LAM_OK);
    ck_assert_uint_eq(group_index_find(&index, "box", 3, &groups), 2);
    ck_assert_uint_eq(groups[0], 1);
    ck_assert_uint_eq(groups[1], 0);
    ck_assert_uint_eq(group_index_find(&index, "box.back", 8, &groups), 2);
    ck_assert_uint_eq(groups[0], 3);
    ck_assert_uint_eq(groups[1], 2);
    group_index_free(&index);
}
END_TEST

/* A star at the end stands for any rest of a name; a group that is called so is meant first. */
START_TEST(a_star_means_names_that_begin_so) {
    static const char *const made_of[] = {"desk-2", "desk",  "wall",      "desk-1",
                                          "lamp*",  "lamps", "desk.back", "desk-2.back"};
    static const uint32_t of[] = {0, 1, 2, 3, 4, 5, 6, 7};
    static const struct {
        const char *name, *found;
    } cases[] = {{"desk*", "desk desk-1 desk-2 "},
                 {"desk-*", "desk-1 desk-2 "},
                 {"d*", "desk desk-1 desk-2 "},
                 {"*", "desk desk-1 desk-2 lamp* lamps wall "},
                 {"lamp*", "lamp* "},
                 {"lam*", "lamp* lamps "},
                 {"desk*.back", "desk-2.back desk.back "},
                 {"*.back", "desk-2.back desk.back "},
                 {"desk-2.b*", ""},
                 {"x*", ""},
                 {"*desk", ""},
                 {"wall*.back", ""}};
    group_index index = {0};
    char **block = malloc(8 * (sizeof *block + 24)), *to = (char *)(block + 8);
    for (size_t g = 0; g < 8; g++, to += 24) block[g] = strcpy(to, made_of[g]);
    ck_assert_int_eq(group_index_make(8, 2, of, 8, block, &index, NULL), LAM_OK);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const uint32_t *groups = NULL;
        const size_t n = group_index_find(&index, cases[k].name, strlen(cases[k].name), &groups);
        char text[256] = "";
        for (size_t i = 0; i < n; i++) strcat(strcat(text, made_of[groups[i]]), " ");
        ck_assert_str_eq(text, cases[k].found);
    }
    group_index_free(&index);
}
END_TEST

int main(void) {
    Suite *s = suite_create("groups");
    TCase *c = tcase_create("all");
    tcase_add_test(c, an_object_means_its_fronts);
    tcase_add_test(c, without_backs_names_are_plain);
    tcase_add_test(c, an_object_has_backs);
    tcase_add_test(c, a_star_means_names_that_begin_so);
    suite_add_tcase(s, c);
    return suite_run(s);
}
