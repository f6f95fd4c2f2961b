/* Elements between a body and the face that it stands on: they see nothing, a closed room stays closed, and
 * sheets that see something from both sides are none of them. */
#include "solver/formfactor/buried.h"
#include "solver/formfactor/facing.h"
#include "solver/formfactor/source.h"
#include "support/obj_text.h"

static lam_error error;

/* A face of n x n squares across an axis; `looks` is the side of its normal. */
static void put_face(obj_text *w, int axis, double at, const double low[3], const double high[3], int looks,
                     int n) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int k = 0; k < n * n; k++) {
        static const int corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        for (int c = 0; c < 4; c++) {
            const int *of = corner[looks > 0 ? c : 3 - c];
            double p[3];
            p[axis] = at;
            p[u] = low[u] + (high[u] - low[u]) * (k % n + of[0]) / n;
            p[v] = low[v] + (high[v] - low[v]) * (k / n + of[1]) / n;
            obj_text_put(w, "v %.9g %.9g %.9g\n", p[0], p[1], p[2]);
        }
        obj_text_put(w, "f -4 -3 -2 -1\n");
    }
}

/* The faces of a box, named g0 to g5 after their axes and sides; inward: a room. */
static void put_box(obj_text *w, const char *name, const double low[3], const double high[3], bool inward,
                    int n) {
    for (int face = 0; face < 6; face++) {
        obj_text_put(w, "o %s%d\n", name, face);
        const bool top = face % 2 == 1;
        put_face(w, face / 2, top ? high[face / 2] : low[face / 2], low, high, top == inward ? -1 : 1, n);
    }
}

static const double room_low[3] = {0, 0, 0}, room_high[3] = {4, 4, 4};

static size_t buried_of(mesh *m, const char *group) {
    size_t n = 0;
    for (size_t i = 0; i < m->n; i++)
        n += strcmp(m->group_names[m->group[i]], group) == 0 && mesh_is_buried(m, i);
    return n;
}

static size_t find(mesh *m) {
    size_t n = 77;
    ck_ok(buried_find(m, &n, &error));
    return n;
}

static const recipe recipes[] = {{.source = &source_pairs, .rays = 256, .accuracy = 7e-5, .seed = 1},
                                 {.source = &source_near_pairs, .rays = 256, .accuracy = 7e-5, .seed = 2},
                                 {.source = &source_rays, .rays = 1024, .seed = 3},
                                 {.source = &source_hemicube, .resolution = 64, .seed = 4},
                                 {.source = &source_blocks, .rays = 256, .accuracy = 1e-4, .seed = 5}};
enum { RECIPES = sizeof recipes / sizeof *recipes };

/* A room of squares of 1 m, in which one box stands on four squares of the floor and another one on the
 * first, as large as one of its squares. */
START_TEST(a_closed_room_stays_closed) {
    obj_text w = {.used = 0};
    const recipe *r = &recipes[_i];
    form_factors f = {0};
    block_factors blocks = {.n = 0};
    facing_survey survey;
    put_box(&w, "room", room_low, room_high, true, 4);
    put_box(&w, "box", (const double[3]){1, 1, 0}, (const double[3]){3, 3, 1}, false, 2);
    put_box(&w, "top", (const double[3]){1, 2, 1}, (const double[3]){2, 3, 2}, false, 1);
    mesh m = obj_text_mesh(&w);
    ck_assert_uint_eq(find(&m), 4 + 4 + 1 + 1);
    ck_assert_uint_eq(buried_of(&m, "room4"), 4);
    ck_assert_uint_eq(buried_of(&m, "box4"), 4);
    ck_assert_uint_eq(buried_of(&m, "box5"), 1);
    ck_assert_uint_eq(buried_of(&m, "top4"), 1);
    uint32_t *order = calloc(m.n, sizeof *order);
    for (uint32_t i = 0; i < m.n; i++) order[i] = i;
    const form_factor_options how = {.recipe = *r};
    if (recipe_source(r) == &source_blocks) {
        plane_tree tree;
        ck_ok(form_factors_tree(&m, &tree, &error));
        ck_ok(form_factors_make_blocks(&m, order, &tree, NULL, &how, &f, &blocks, &error));
        plane_tree_free(&tree);
    } else {
        ck_ok(form_factors_make(&m, order, &how, &f, &error));
    }
    ck_assert(f.closed);
    ck_assert_double_eq(f.leaving_share, 0);
    ck_assert_double_eq(f.absorbed_share, 0);
    /* In the first box the floor and the underside of the other one see each other, and nothing else. */
    for (size_t i = 0; i < m.n; i++)
        if (mesh_is_buried(&m, i))
            ck_assert_double_lt(f.row_sums[i], .5);
        else
            ck_assert_double_eq_tol(f.row_sums[i], 1, 1e-4);
    ck_assert_double_lt(f.repair_max, .3);
    ck_ok(facing_survey_make(&m, &survey, &error));
    ck_assert_double_eq(survey.share, 0);
    facing_survey_free(&survey);
    block_factors_free(&blocks);
    form_factors_free(&f);
    free(order);
    mesh_free(&m);
}
END_TEST

/* Light through a crack is followed from elements that are not buried: the crack is one, and what is
 * below the floor is none of it. */
START_TEST(a_crack_is_no_opening) {
    obj_text w = {.used = 0};
    form_factors f = {0};
    put_box(&w, "box", (const double[3]){1, 1, 0}, (const double[3]){3, 3, 1}, false, 2);
    obj_text_put(&w, "o room\n");
    for (int face = 0; face < 6; face++) {
        const double gap = face == 5 ? .003 : 0;
        put_face(&w, face / 2, (face % 2 == 1 ? room_high : room_low)[face / 2] + gap, room_low, room_high,
                 face % 2 == 1 ? -1 : 1, 4);
    }
    mesh m = obj_text_mesh(&w);
    ck_assert_uint_eq(find(&m), 4 + 4);
    uint32_t *order = calloc(m.n, sizeof *order);
    for (uint32_t i = 0; i < m.n; i++) order[i] = i;
    const form_factor_options how = {.recipe = {.source = &source_rays, .rays = 16384, .seed = 3}};
    ck_ok(form_factors_make(&m, order, &how, &f, &error));
    ck_assert_double_gt(f.leaving_share, 0);
    ck_assert_double_lt(f.leaving_share, .002);
    ck_assert_double_eq(f.outlet.openings, 0);
    ck_assert(f.closed);
    form_factors_free(&f);
    free(order);
    mesh_free(&m);
}
END_TEST

/* A leg stands in the middle of a large square of the floor: its underside is buried, the square is not. */
START_TEST(a_leg_on_a_large_square) {
    obj_text w = {.used = 0};
    put_box(&w, "room", room_low, room_high, true, 1);
    put_box(&w, "leg", (const double[3]){1, 1, 0}, (const double[3]){1.05, 1.05, 1}, false, 1);
    mesh m = obj_text_mesh(&w);
    ck_assert_uint_eq(find(&m), 1);
    ck_assert_uint_eq(buried_of(&m, "leg4"), 1);
    mesh_free(&m);
}
END_TEST

/* A leaf in the open, one in a room, and the walls of a house of sheets see something from both sides. A
 * floor that was made two-sided has no other side that covers it. */
START_TEST(sheets_are_not_buried) {
    obj_text open = {.used = 0}, inside = {.used = 0}, house = {.used = 0}, alone = {.used = 0};
    const double low[3] = {1, 1, 1}, high[3] = {2, 2, 1};
    put_face(&open, 2, 1, low, high, 1, 2);
    put_face(&open, 2, 1, low, high, -1, 2);
    put_box(&inside, "room", room_low, room_high, true, 2);
    put_face(&inside, 2, 1, low, high, 1, 2);
    put_face(&inside, 2, 1, low, high, -1, 2);
    put_box(&house, "in", room_low, room_high, true, 2);
    put_box(&house, "out", room_low, room_high, false, 2);
    put_box(&alone, "room", room_low, room_high, true, 2);
    const obj_text *all[] = {&open, &inside, &house, &alone};
    for (int k = 0; k < 4; k++) {
        mesh m = obj_text_mesh(all[k]);
        if (k == 3) ck_ok(mesh_make_two_sided(&m, &error));
        ck_assert_uint_eq(find(&m), 0);
        ck_assert_ptr_null(m.buried);
        mesh_free(&m);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("buried");
    TCase *tests = tcase_create("buried");
    tcase_add_loop_test(tests, a_closed_room_stays_closed, 0, RECIPES);
    tcase_add_test(tests, a_crack_is_no_opening);
    tcase_add_test(tests, a_leg_on_a_large_square);
    tcase_add_test(tests, sheets_are_not_buried);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
