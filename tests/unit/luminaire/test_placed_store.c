/* Placed luminaires in a store: they come back as a list that gives the same light. */
#include "solver/luminaire/placed_store.h"
#include "support/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

static char *groups[] = {"floor", "housing", "lid"};
enum { GROUPS = 3 };

/* Two files, one with luminous sides; a row in a group, and one that is a point, tilted and coloured. */
static void make_list(placed_luminaires *p) {
    const placed_options options = {.up = 'z'};
    lam_error error = {0};
    char path[256];
    file_write(folder, "a.ies",
               "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 2 1 2 .3 1.2 .1\n1 1 10\n0 45 90\n0 90\n"
               "100 70 0\n100 50 0\n",
               path);
    file_write(folder, "b.ies",
               "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 -.1 -.1 0\n1 1 10\n0 90\n0\n10 0\n", path);
    file_write(folder, "l.json",
               "{\"luminaires\": ["
               "{\"name\": \"r\", \"file\": \"a.ies\", \"from\": [1, 2, 3], \"steps\": [[1, 0, 0]], "
               "\"counts\": [2], "
               "\"flux\": 500, \"dim\": 0.5, \"ignore\": [\"lid\"]},"
               "{\"name\": \"s\", \"file\": \"b.ies\", \"at\": [0, 0, 1], \"aim\": [1, 0, -1], \"opening\": "
               "\"point\", "
               "\"colour\": [2, 1, 0]},"
               "{\"name\": \"t\", \"file\": \"b.ies\", \"at\": [0, 0, 2], \"dim\": 0}]}",
               path);
    ck_ok(placed_read(path, &options, p, &error));
    ck_assert_uint_eq(p->n, 4);
}

static const double scale[4] = {.5, .25, 2, 1};
static const placed_ignoring ignoring[] = {{0, 2}, {1, 1}, {1, 2}, {3, 0}};

static void write_list(const char *path, const placed_luminaires *p) {
    lam_error error = {0};
    store *s = NULL;
    ck_ok(store_create(path, &s, &error));
    ck_ok(placed_save(p, scale, 4, ignoring, s, &error));
    ck_ok(store_seal(s, &error));
}

START_TEST(the_same_light_comes_back) {
    static const size_t n_ignored[] = {1, 2, 0, 1};
    lam_error error = {0};
    char path[128];
    store *s = NULL;
    placed_luminaires p, q = {.n = 0};
    make_list(&p);
    snprintf(path, sizeof path, "%s/l.h5", folder);
    write_list(path, &p);
    ck_ok(store_open(path, &s, &error));
    ck_ok(placed_load(s, GROUPS, groups, &q, &error));
    store_close(s);
    ck_assert_uint_eq(q.n, p.n);
    for (size_t k = 0; k < p.n; k++) {
        const placed_luminaire *l = &p.luminaires[k], *m = &q.luminaires[k];
        const luminaire *of_l = &p.files[l->file].photometry, *of_m = &q.files[m->file].photometry;
        ck_assert_str_eq(m->name, l->name);
        ck_assert_str_eq(m->group, l->group);
        ck_assert(placed_lights_alike(&p, k, &q, k));
        ck_assert(m->dim == l->dim && m->is_point == l->is_point);
        ck_assert_mem_eq(m->colour, l->colour, sizeof l->colour);
        /* Flux and dimmer stand for all factors of the candela. */
        ck_assert_double_eq_tol(m->maintenance * m->flux / q.files[m->file].lumens, scale[k], 1e-12);
        ck_assert_double_eq_tol(m->scale, scale[k] * l->dim, 1e-12);
        for (int C = 0; C < 360; C += 30)
            for (int gamma = 0; gamma <= 180; gamma += 15)
                ck_assert_double_eq(luminaire_candela(of_m, C, gamma), luminaire_candela(of_l, C, gamma));
        ck_assert_uint_eq(m->n_ignored, n_ignored[k]);
    }
    ck_assert_str_eq(q.ignored[q.luminaires[1].ignored].text, "housing");
    ck_assert_str_eq(q.ignored[q.luminaires[3].ignored].text, "floor");
    placed_free(&p);
    placed_free(&q);
}
END_TEST

START_TEST(other_light_is_not_alike) {
    placed_luminaires p, q;
    make_list(&p);
    make_list(&q);
    ck_assert(placed_lights_alike(&p, 0, &q, 0));
    ck_assert(!placed_lights_alike(&p, 0, &q, 1)); /* another place */
    ck_assert(!placed_lights_alike(&p, 2, &q, 3)); /* another aim and opening */
    q.luminaires[0].flux = 700;
    q.luminaires[0].dim = 0;
    ck_assert(placed_lights_alike(&p, 0, &q, 0));
    q.luminaires[0].x[0] = nextafter(q.luminaires[0].x[0], 0);
    ck_assert(!placed_lights_alike(&p, 0, &q, 0));
    q.luminaires[0].x[0] = p.luminaires[0].x[0];
    q.files[0].photometry.candela[4] += 1;
    ck_assert(!placed_lights_alike(&p, 0, &q, 0));
    q.files[0].photometry.candela[4] -= 1;
    q.files[0].photometry.opening.side[2] += .01;
    ck_assert(!placed_lights_alike(&p, 0, &q, 0));
    placed_free(&p);
    placed_free(&q);
}
END_TEST

/* Copies the store with one array replaced. */
typedef struct wrong_array {
    const char *name;
    store_type type;
    int rank;
    size_t dims[2];
    const void *data;
} wrong_array;

static const char *replaced;

static bool skip(const char *object, const char *attribute) {
    return attribute == NULL && strcmp(object, replaced) == 0;
}

START_TEST(wrong_arrays_are_refused) {
    static const uint32_t table[4] = {0, 0, 9, 1}, shape[8] = {0, 0, 7, 3, 0, 1, 1, 2},
                          ignore[4] = {0, 2, 1, 5}, order[4] = {1, 1, 0, 2};
    static const double opening[4 * 8] = {17};
    static const wrong_array wrong[] = {{"/luminaires/table", STORE_U32, 1, {4}, table},
                                        {"/luminaires/tables", STORE_U32, 2, {2, 4}, shape},
                                        {"/luminaires/ignore", STORE_U32, 2, {2, 2}, ignore},
                                        {"/luminaires/ignore", STORE_U32, 2, {2, 2}, order},
                                        {"/luminaires/opening", STORE_F64, 2, {4, 8}, opening}};
    lam_error error = {0};
    char path[128], other[128];
    placed_luminaires p, q = {.n = 0};
    make_list(&p);
    snprintf(path, sizeof path, "%s/l.h5", folder);
    snprintf(other, sizeof other, "%s/m.h5", folder);
    write_list(path, &p);
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        store *s = NULL, *to = NULL;
        replaced = wrong[k].name;
        ck_ok(store_open(path, &s, &error));
        ck_ok(store_create(other, &to, &error));
        ck_ok(store_copy(s, skip, to, &error));
        ck_ok(store_write(to, replaced, wrong[k].type, wrong[k].rank, wrong[k].dims, wrong[k].data, &error));
        ck_ok(store_seal(to, &error));
        store_close(s);
        ck_ok(store_open(other, &s, &error));
        ck_assert_int_eq(placed_load(s, GROUPS, groups, &q, &error), LAM_ERR_FORMAT);
        ck_assert_msg(strstr(error.message, "/luminaires/") != NULL, "%s", error.message);
        ck_assert_uint_eq(q.n, 0);
        store_close(s);
    }
    placed_free(&p);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("placed_store");
    TCase *tests = tcase_create("all");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, the_same_light_comes_back);
    tcase_add_test(tests, other_light_is_not_alike);
    tcase_add_test(tests, wrong_arrays_are_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
