/* Faces that cover the same part of a plane are cut: each place is of one face, of the one that is to have
 * it. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/scene/coincident.h"
#include "solver/scene/plane.h"
#include "support/scene.h"
#include "support/suite.h"

static lam_error error;

enum { FACES = 14, POINTS = 4000 };

/* Convex faces in one plane: triangles, and parallelograms, each a group of its own. */
typedef struct flat_scene {
    double axes[2][3], at[3];
    size_t corners[FACES];
    double corner[FACES][4][2];
} flat_scene;

static void random_axes(uint64_t *seed, double axes[2][3]) {
    for (int k = 0; k < 2; k++)
        for (int d = 0; d < 3; d++) axes[k][d] = random_unit(seed) - .5;
    const double length = sqrt(dot3(axes[0], axes[0]));
    for (int d = 0; d < 3; d++) axes[0][d] /= length;
    const double along = dot3(axes[0], axes[1]);
    for (int d = 0; d < 3; d++) axes[1][d] -= along * axes[0][d];
    const double other = sqrt(dot3(axes[1], axes[1]));
    for (int d = 0; d < 3; d++) axes[1][d] /= other;
}

static flat_scene random_scene(uint64_t seed) {
    flat_scene s;
    random_axes(&seed, s.axes);
    for (int d = 0; d < 3; d++) s.at[d] = 10 * random_unit(&seed);
    for (int f = 0; f < FACES; f++) {
        const double x = 4 * random_unit(&seed), y = 4 * random_unit(&seed);
        double a[2], b[2];
        for (int d = 0; d < 2; d++) a[d] = 4 * (random_unit(&seed) - .5);
        b[0] = -a[1] * (.4 + random_unit(&seed));
        b[1] = a[0] * (.4 + random_unit(&seed));
        s.corners[f] = f % 2 ? 3 : 4;
        const double to[4][2] = {
            {x, y}, {x + a[0], y + a[1]}, {x + a[0] + b[0], y + a[1] + b[1]}, {x + b[0], y + b[1]}};
        memcpy(s.corner[f], to, sizeof to);
    }
    return s;
}

static mesh import_scene(const flat_scene *s, coincident_report *report) {
    static char text[20000];
    char folder[64], path[256];
    size_t at = 0;
    import_report made;
    mesh m;
    for (int f = 0, v = 1; f < FACES; f++) {
        at += (size_t)snprintf(text + at, sizeof text - at, "o g%d\n", f);
        for (size_t c = 0; c < s->corners[f]; c++)
            for (int d = 0; d < 3; d++) {
                const double *x = s->corner[f][c];
                at += (size_t)snprintf(text + at, sizeof text - at, "%s%.17g%s", d == 0 ? "v " : "",
                                       s->at[d] + x[0] * s->axes[0][d] + x[1] * s->axes[1][d],
                                       d == 2 ? "\n" : " ");
            }
        at += (size_t)snprintf(text + at, sizeof text - at, "f");
        for (size_t c = 0; c < s->corners[f]; c++)
            at += (size_t)snprintf(text + at, sizeof text - at, " %d", v++);
        at += (size_t)snprintf(text + at, sizeof text - at, "\n");
    }
    ck_assert_uint_lt(at, sizeof text - 1);
    folder_make(folder);
    file_write(folder, "scene.obj", text, path);
    m = import_good(path, &made);
    folder_remove(folder);
    *report = made.coincident;
    return m;
}

/* Positive inside a convex polygon that is counter-clockwise: the distance from its border, or less. */
static double depth(size_t n, const double (*corner)[2], const double x[2]) {
    double least = HUGE_VAL;
    for (size_t k = 0; k < n; k++) {
        const double *a = corner[k], *b = corner[(k + 1) % n];
        least = fmin(least, plane_turn(a, b, x) / plane_distance(a, b));
    }
    return least;
}

static double area_of(const flat_scene *s, int f) {
    return fabs(plane_turn(s->corner[f][0], s->corner[f][1], s->corner[f][2])) / (s->corners[f] == 3 ? 2 : 1);
}

/* The number of the elements of a mesh around a place, and the group of the last of them; near its border no
 * answer is asked for. */
static int elements_at(const mesh *m, const flat_scene *s, const double x[2], int *group) {
    int n = 0;
    for (size_t i = 0; i < m->n; i++) {
        double flat[4][2];
        for (size_t c = 0; c < mesh_corners(m, i); c++) {
            double to[3];
            subtract3(m->vertices[m->elements[i][c]], s->at, to);
            for (int k = 0; k < 2; k++) flat[c][k] = dot3(to, s->axes[k]);
        }
        const double d = depth(mesh_corners(m, i), (const double(*)[2])flat, x);
        if (fabs(d) < 1e-4) return -1;
        if (d < 0) continue;
        n++;
        *group = atoi(m->group_names[m->group[i]] + 1);
    }
    return n;
}

START_TEST(each_place_is_of_one_face) {
    const flat_scene s = random_scene((uint64_t)_i + 1);
    coincident_report report;
    mesh m = import_scene(&s, &report);
    uint64_t seed = 77;
    int asked = 0;
    ck_assert_uint_gt(report.cut, 2);
    ck_assert_uint_eq(report.overlapping, 0);
    for (int k = 0; k < POINTS; k++) {
        const double x[2] = {8 * random_unit(&seed) - 2, 8 * random_unit(&seed) - 2};
        int covering = 0, best = -1, group = -1;
        for (int f = 0; f < FACES; f++) {
            if (!(depth(s.corners[f], s.corner[f], x) > 0)) continue;
            covering++;
            if (best < 0 || area_of(&s, f) < area_of(&s, best)) best = f;
        }
        const int found = elements_at(&m, &s, x, &group);
        if (found < 0) continue;
        asked += covering > 1;
        ck_assert_int_eq(found, covering > 0);
        if (found == 1) ck_assert_int_eq(group, best);
    }
    ck_assert_int_gt(asked, POINTS / 50);
    mesh_free(&m);
}
END_TEST

/* A floor with so many squares on it that what they leave is more than a thousand parts stays whole, and is
 * named. */
START_TEST(a_thousand_parts_are_named) {
    enum { ALONG = 26 };
    static char text[100000];
    char folder[64], path[256];
    import_report report;
    size_t at = (size_t)snprintf(text, sizeof text,
                                 "o floor\nv 0 0 0\nv %d 0 0\nv %d %d 0\nv 0 %d 0\nf 1 2 3 4\no tiles\n",
                                 ALONG, ALONG, ALONG, ALONG);
    for (int k = 0; k < ALONG * ALONG; k++) {
        const int x = k / ALONG, y = k % ALONG;
        at += (size_t)snprintf(text + at, sizeof text - at,
                               "v %d.2 %d.3 0\nv %d.7 %d.3 0\nv %d.7 %d.8 0\nv %d.2 %d.8 0\nf -4 -3 -2 -1\n",
                               x, y, x, y, x, y, x, y);
    }
    ck_assert_uint_lt(at, sizeof text - 1);
    folder_make(folder);
    file_write(folder, "scene.obj", text, path);
    mesh m = import_good(path, &report);
    folder_remove(folder);
    const double area = .25 * ALONG * ALONG;
    ck_assert_uint_eq(m.n, ALONG * ALONG + 1);
    ck_assert_uint_eq(report.coincident.cut + report.coincident.covered, 0);
    ck_assert_uint_eq(report.coincident.overlapping, m.n);
    ck_assert_double_eq_tol(report.coincident.area, area, 1e-6);
    ck_assert_double_eq_tol(mesh_overlap_area(&m), area, 1e-6);
    ck_assert_double_eq_tol(m.overlap[group_find(&m, "floor")], .25, 1e-9);
    ck_assert_double_eq_tol(m.overlap[group_find(&m, "tiles")], 1, 1e-9);
    ck_assert_ptr_nonnull(strstr(report.coincident.overlap_line, " overlap others in one plane, "));
    ck_assert_ptr_nonnull(strstr(report.coincident.overlap_line, "tiles "));
    /* A refined mesh, and one with both sides, keep the shares. */
    const mesh_refinement fine = {.subdivide_levels = 1};
    ck_ok(mesh_refine(&m, &fine, &error));
    ck_ok(mesh_make_two_sided(&m, &error));
    ck_assert_double_eq_tol(mesh_overlap_area(&m), area, 1e-6);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("coincident_cut");
    TCase *tests = tcase_create("coincident_cut");
    tcase_add_loop_test(tests, each_place_is_of_one_face, 0, 12);
    tcase_add_test(tests, a_thousand_parts_are_named);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
