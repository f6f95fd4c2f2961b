/* Faces turned the wrong way: light that meets backs, and the sides that rays decide. */
#include "support/suite.h"

#include "solver/base/random.h"
#include "solver/formfactor/facing.h"
#include "solver/scene/sides.h"
#include "support/box.h"
#include "support/scene.h"

/* An axis-parallel box of six quads from low to high; inward: its fronts look inside. */
static void add_box(mesh *m, const double low[3], const double high[3], bool inward) {
    for (int axis = 0; axis < 3; axis++)
        for (int end = 0; end < 2; end++) {
            const int u = (axis + 1) % 3, w = (axis + 2) % 3;
            double quad[4][3];
            for (int k = 0; k < 4; k++) {
                quad[k][axis] = end ? high[axis] : low[axis];
                quad[k][u] = k == 1 || k == 2 ? high[u] : low[u];
                quad[k][w] = k >= 2 ? high[w] : low[w];
            }
            if ((end == 0) != inward) /* u x w is the axis: this quad looks upwards */
                for (int d = 0; d < 3; d++) {
                    const double second = quad[1][d];
                    quad[1][d] = quad[3][d];
                    quad[3][d] = second;
                }
            mesh_add_quad(m, (const double(*)[3])quad);
        }
}

/* A room of 4 x 3 x 2 m with two boxes in it that stand free of its walls. */
static mesh furnished_room(void) {
    mesh m = {0};
    add_box(&m, (const double[3]){0, 0, 0}, (const double[3]){4, 3, 2}, true);
    add_box(&m, (const double[3]){1, 1, .1}, (const double[3]){1.5, 1.5, 1}, false);
    add_box(&m, (const double[3]){2.5, 1, .1}, (const double[3]){3, 2, .6}, false);
    mesh_finish(&m, .5f);
    return m;
}

static size_t count_equal(const mesh *a, const mesh *b) {
    size_t n = 0;
    for (size_t i = 0; i < a->n; i++)
        n += a->normal[i][0] * b->normal[i][0] + a->normal[i][1] * b->normal[i][1] +
                 a->normal[i][2] * b->normal[i][2] >
             .99f;
    return n;
}

static double survey_of(mesh *m, size_t *faces) {
    facing_survey s;
    lam_error error = {0};
    double sum = 0;
    m->n_groups = 1;
    ck_assert_msg(facing_survey_make(m, &s, &error) == LAM_OK, "%s", error.message);
    for (size_t g = 0; g < m->n_groups; g++) sum += s.group_shares[g];
    ck_assert_double_eq_tol(sum, s.share, 1e-12);
    const double share = s.share;
    *faces = s.faces;
    facing_survey_free(&s);
    return share;
}

static facing_turned orient(mesh *m) {
    facing_turned turned;
    lam_error error = {0};
    ck_assert_msg(facing_orient(m, NULL, &turned, &error) == LAM_OK, "%s", error.message);
    return turned;
}

START_TEST(light_that_meets_backs_is_counted) {
    mesh m = furnished_room();
    size_t faces;
    ck_assert_double_eq(survey_of(&m, &faces), 0);
    ck_assert_uint_eq(faces, 0);
    mesh_free(&m);
    /* A unit cube whose lid is turned: of the light of five fronts, of six by area, a face of a cube gets
     * .199825 from the one opposite and .200044 from each other one; the lid's own light leaves the scene. */
    add_box(&m, (const double[3]){0, 0, 0}, (const double[3]){1, 1, 1}, true);
    mesh_finish(&m, .5f);
    for (size_t i = 0; i < m.n; i++)
        if (m.normal[i][2] < -.9f) mesh_turn(&m, i);
    /* Three standard errors of 65,536 rays are .004. */
    ck_assert_double_eq_tol(survey_of(&m, &faces), (.199825 + 4 * .200044) / 6, .004);
    ck_assert_uint_eq(faces, 1);
    mesh_free(&m);
}
END_TEST

START_TEST(a_turned_face_keeps_its_corners) {
    mesh m = {0};
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}});
    mesh_finish(&m, .5f);
    lam_error error = {0};
    mesh_turn(&m, 0);
    ck_assert_float_eq(m.normal[0][2], -1);
    ck_assert(mesh_measure(&m, &error) == LAM_OK);
    ck_assert_float_eq(m.normal[0][2], -1);
    ck_assert_double_eq(m.area[0], 2);
    mesh_free(&m);
}
END_TEST

/* Neighbours agree, whatever way they came in; the smaller part is turned. */
START_TEST(neighbours_agree) {
    uint64_t seed = 1;
    for (int round = 0; round < 20; round++) {
        mesh m = furnished_room();
        mesh_sides s;
        lam_error error = {0};
        bool turned[18];
        for (size_t i = 0; i < m.n; i++) {
            turned[i] = random_unit(&seed) < .2;
            if (turned[i]) mesh_turn(&m, i);
        }
        ck_assert_msg(mesh_sides_find(&m, &s, &error) == LAM_OK, "%s", error.message);
        ck_assert_uint_eq(s.n_patches, 3);
        for (size_t p = 0; p < 3; p++) {
            double with = 0, all = 0;
            for (size_t i = 6 * p; i < 6 * p + 6; i++) {
                ck_assert_uint_eq(s.patch[i], p);
                /* All as they were before, or all the other way. */
                ck_assert_int_eq(s.turned[i] != turned[i], s.turned[6 * p] != turned[6 * p]);
                with += s.turned[i] ? m.area[i] : 0;
                all += m.area[i];
            }
            ck_assert_double_le(with, all / 2 + 1e-12);
        }
        mesh_sides_free(&s);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(rays_decide_the_side) {
    mesh right = furnished_room();
    for (unsigned pattern = 0; pattern < 8; pattern += 2) { /* the room itself is most of the area */
        mesh m = furnished_room();
        for (size_t i = 0; i < m.n; i++)
            if ((pattern >> i / 6 & 1) != 0 || i % 6 == 3) mesh_turn(&m, i);
        const facing_turned turned = orient(&m);
        ck_assert_uint_le(turned.undecided, 6); /* the room, from which the boxes are small */
        ck_assert_uint_eq(count_equal(&m, &right), m.n);
        size_t should = 0;
        for (size_t i = 0; i < m.n; i++) should += (pattern >> i / 6 & 1) != 0 || i % 6 == 3;
        ck_assert_uint_eq(turned.turned, should);
        mesh_free(&m);
    }
    mesh_free(&right);
}
END_TEST

/* Three leaves of a book share its spine, and hang together by no edge of two. */
START_TEST(an_edge_of_three_joins_nothing) {
    mesh m = {0};
    mesh_sides s;
    lam_error error = {0};
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 0}, {-1, 0, 0}, {-1, 1, 0}, {0, 1, 0}});
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 0}, {0, 0, 1}, {0, 1, 1}, {0, 1, 0}});
    mesh_finish(&m, .5f);
    ck_assert_msg(mesh_sides_find(&m, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(s.n_patches, 3);
    mesh_sides_free(&s);
    mesh_free(&m);
}
END_TEST

/* A room that looks outward, around a box most of whose area looks the right way, so that the room is
 * brighter inside; if the box came first, it would turn to the dark between both. */
START_TEST(the_largest_patch_is_turned_first) {
    mesh m = {0}, right = {0};
    for (int k = 0; k < 2; k++) {
        mesh *const one = k == 0 ? &m : &right;
        add_box(one, (const double[3]){0, 0, 0}, (const double[3]){4, 3, 2}, k == 1);
        add_box(one, (const double[3]){.3, .3, .2}, (const double[3]){3.7, 2.7, 1.8}, false);
        mesh_finish(one, .5f);
    }
    for (size_t i = 6; i < 12; i++) /* its top and its bottom, 47 % of its area */
        if (fabsf(m.normal[i][2]) > .9f) mesh_turn(&m, i);
    ck_assert_uint_eq(orient(&m).turned, 8);
    ck_assert_uint_eq(count_equal(&m, &right), 12);
    mesh_free(&m);
    mesh_free(&right);
}
END_TEST

/* Faces that share no edge: a soup. */
START_TEST(soups_are_turned_face_by_face) {
    mesh m = {0};
    mesh room = furnished_room();
    for (size_t i = 0; i < room.n; i++) {
        double quad[4][3], middle[3];
        mesh_centroid(&room, i, middle);
        for (int k = 0; k < 4; k++) /* a gap of 1 % between neighbours */
            for (int d = 0; d < 3; d++)
                quad[k][d] = middle[d] +
                             .99 * (room.vertices[room.elements[i][i % 3 == 0 ? 3 - k : k]][d] - middle[d]);
        mesh_add_quad(&m, (const double(*)[3])quad);
    }
    mesh_finish(&m, .5f);
    ck_assert_uint_eq(count_equal(&m, &room), 12);
    ck_assert_uint_eq(orient(&m).turned, 6);
    ck_assert_uint_eq(count_equal(&m, &room), 18);
    mesh_free(&m);
    mesh_free(&room);
}
END_TEST

/* An empty room from outside sees nothing with its fronts, and itself with its backs. */
START_TEST(a_room_from_outside_is_turned_whole) {
    for (int k = 0; k < 5; k++) {
        mesh m = {0};
        lam_error error = {0};
        bool turned = false;
        if (k < 2) {
            add_box(&m, (const double[3]){0, 0, 0}, (const double[3]){4, 3, 2}, k == 1);
            mesh_finish(&m, .5f);
        } else if (k == 2) {
            m = furnished_room();
        } else if (k == 3) { /* two bodies far from each other */
            add_box(&m, (const double[3]){0, 0, 0}, (const double[3]){1, 1, 1}, false);
            add_box(&m, (const double[3]){20, 0, 0}, (const double[3]){21, 1, 1}, false);
            mesh_finish(&m, .5f);
        } else { /* a leaf, whose backs see nothing either */
            mesh_add_quad(&m, (const double[4][3]){{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
            mesh_finish(&m, .5f);
        }
        const float before[3] = {m.normal[0][0], m.normal[0][1], m.normal[0][2]};
        ck_assert_msg(facing_turn_inward(&m, &turned, &error) == LAM_OK, "%s", error.message);
        ck_assert_int_eq(turned, k == 0);
        for (int d = 0; d < 3; d++) ck_assert_float_eq(m.normal[0][d], k == 0 ? -before[d] : before[d]);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(what_is_alone_is_left) {
    mesh m = {0};
    add_box(&m, (const double[3]){0, 0, 0}, (const double[3]){1, 2, 1}, false);
    mesh_finish(&m, .5f);
    mesh_turn(&m, 0);
    const facing_turned turned = orient(&m);
    ck_assert_uint_eq(turned.turned, 1);
    ck_assert_uint_eq(turned.undecided, 6);
    mesh_free(&m);
    /* The two sides of a sheet, as exporters of leaves write them, stay back to back. */
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}});
    mesh_add_quad(&m, (const double[4][3]){{4, 4, 3}, {5, 4, 3}, {5, 5, 3}, {4, 5, 3}});
    mesh_add_quad(&m, (const double[4][3]){{4, 4, 3}, {4, 5, 3}, {5, 5, 3}, {5, 4, 3}});
    mesh_finish(&m, .5f);
    ck_assert_uint_eq(orient(&m).turned, 0);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("facing");
    TCase *tests = tcase_create("facing");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, light_that_meets_backs_is_counted);
    tcase_add_test(tests, a_turned_face_keeps_its_corners);
    tcase_add_test(tests, neighbours_agree);
    tcase_add_test(tests, rays_decide_the_side);
    tcase_add_test(tests, an_edge_of_three_joins_nothing);
    tcase_add_test(tests, the_largest_patch_is_turned_first);
    tcase_add_test(tests, soups_are_turned_face_by_face);
    tcase_add_test(tests, a_room_from_outside_is_turned_whole);
    tcase_add_test(tests, what_is_alone_is_left);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
