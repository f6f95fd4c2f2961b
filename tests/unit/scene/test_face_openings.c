/* Openings that the faces of planes leave, however these are divided, turned and rounded. */
#include "solver/scene/facet/face_openings.h"
#include "support/box.h"
#include "support/suite.h"

static lam_error error;

/* A room of 6 x 8 x 3 m without its south wall. */
static const double room[3] = {6, 8, 3};

static void add_room(mesh *m, bool ceiling) {
    for (int axis = 0; axis < 3; axis++)
        for (int high = 0; high < 2; high++) {
            box_cell c = {.axis = axis, .level = high ? room[axis] : 0};
            if ((axis == 1 && !high) || (axis == 2 && high && !ceiling)) continue;
            memcpy(c.to, room, sizeof c.to);
            c.from[axis] = c.to[axis] = c.level;
            mesh_add_cell(m, &c, !high);
        }
}

/* A part of the plane y = level that looks into the room. */
static void add_wall(mesh *m, double level, double x0, double x1, double z0, double z1) {
    const box_cell c = {.axis = 1, .level = level, .from = {x0, level, z0}, .to = {x1, level, z1}};
    mesh_add_cell(m, &c, true);
}

/* Pillars beside the hole from floor to ceiling, sill and lintel between them. */
static void add_strips(mesh *m, double x0, double x1, double z0, double z1) {
    if (x0 > 0) add_wall(m, 0, 0, x0, 0, room[2]);
    if (x1 < room[0]) add_wall(m, 0, x1, room[0], 0, room[2]);
    if (z0 > 0) add_wall(m, 0, x0, x1, 0, z0);
    if (z1 < room[2]) add_wall(m, 0, x0, x1, z1, room[2]);
}

/* Turns the mesh by no special angle and rounds to six digits after the point. */
static void turn_and_round(mesh *m) {
    const double a = .7, b = 1.1;
    for (size_t v = 0; v < m->n_vertices; v++) {
        double *p = m->vertices[v];
        const double x = cos(a) * p[0] - sin(a) * p[1], y = sin(a) * p[0] + cos(a) * p[1];
        const double turned[3] = {x, cos(b) * y - sin(b) * p[2], sin(b) * y + cos(b) * p[2]};
        for (int d = 0; d < 3; d++) p[d] = round(1e6 * turned[d]) / 1e6;
    }
}

static face_openings find(mesh *m) {
    face_openings o;
    if (m->group == NULL) mesh_finish(m, .5f);
    ck_ok(face_openings_find(m, .01, &o, &error));
    return o;
}

static double area_of(const plane_patch *p) {
    const double *a = p->edge[0], *b = p->edge[1];
    const double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    return sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / (p->triangle ? 2 : 1);
}

/* The areas of the openings, those wanted in any order, to the rounding of corners: 1e-6 m over 6 m. Frees
 * both. */
static void check(mesh *m, size_t n, const double *areas) {
    face_openings o = find(m);
    double *found = calloc(o.n + 1, sizeof *found);
    ck_assert_uint_eq(o.n, n);
    for (size_t k = 0; k < o.n_patches; k++) found[o.patches[k].opening] += area_of(&o.patches[k]);
    for (size_t k = 0; k < n; k++) { /* the largest first */
        if (k > 0) ck_assert_double_le(found[k], found[k - 1] + 1e-5);
        ck_assert_double_eq_tol(found[k], areas[k], 2e-5);
    }
    free(found);
    face_openings_free(&o);
    mesh_free(m);
}

/* Corners of one strip lie on the edges of others: the wall's own outline and the edges between them are none
 * of an opening. Windows at the rim of the wall are closed by edges of floor, ceiling or side walls. */
START_TEST(strips) {
    static const double window[][4] = {{2.5, 3.5, 1, 2}, {2.5, 3.5, 0, 2}, {2.5, 3.5, 1, 3},
                                       {2.5, 3.5, 0, 3}, {5, 6, 1, 2},     {0, 1, 2, 3},
                                       {0, 6, 1, 2},     {1, 5, 2.4, 2.9}};
    for (size_t k = 0; k < sizeof window / sizeof *window; k++)
        for (int turned = 0; turned < 2; turned++) {
            const double *w = window[k], area = (w[1] - w[0]) * (w[3] - w[2]);
            mesh m = {0};
            add_room(&m, true);
            add_strips(&m, w[0], w[1], w[2], w[3]);
            if (turned) turn_and_round(&m);
            check(&m, 1, &area);
        }
}
END_TEST

START_TEST(closed_room_has_none) {
    mesh m = {0};
    add_room(&m, true);
    add_wall(&m, 0, 0, 2, 0, 3);
    add_wall(&m, 0, 2, 6, 0, 1);
    add_wall(&m, 0, 2, 6, 1, 3);
    const box_cell plate = {.axis = 2, .level = 1, .from = {1, 1, 1}, .to = {3, 2, 1}};
    mesh_add_cell(&m, &plate, true); /* a table: nothing is open beside it */
    check(&m, 0, NULL);
}
END_TEST

/* A seam from the outline to the hole is an edge of two faces. */
START_TEST(keyhole) {
    for (int turned = 0; turned < 2; turned++) {
        static const double outer[4][2] = {{0, 0}, {0, 3}, {6, 3}, {6, 0}},
                            inner[4][2] = {{2.5, 1}, {2.5, 2}, {3.5, 2}, {3.5, 1}};
        const double area = 1;
        mesh m = {0};
        add_room(&m, true);
        for (size_t k = 0; k < 4; k++) {
            const double *a = outer[k], *b = outer[(k + 1) % 4], *c = inner[(k + 1) % 4], *d = inner[k];
            mesh_add_quad(
                &m, (const double[4][3]){{a[0], 0, a[1]}, {b[0], 0, b[1]}, {c[0], 0, c[1]}, {d[0], 0, d[1]}});
        }
        if (turned) turn_and_round(&m);
        check(&m, 1, &area);
    }
}
END_TEST

/* A bar divides a window; a panel that hangs in an opening is an island of it; a pane closes it. */
START_TEST(bars_islands_and_panes) {
    mesh bar = {0}, panel = {0}, pane = {0};
    add_room(&bar, true);
    add_strips(&bar, 2.5, 3.5, 1, 2);
    add_wall(&bar, 0, 2.9, 3, 1, 2);
    check(&bar, 2, (const double[]){.5, .4});
    add_room(&panel, true);
    add_strips(&panel, 2, 4, 1, 2);
    add_wall(&panel, 0, 2.1, 3.9, 1.1, 1.9);
    check(&panel, 1, (const double[]){2 - 1.8 * .8});
    add_room(&pane, true);
    add_strips(&pane, 2.5, 3.5, 1, 2);
    add_wall(&pane, 0, 2.5, 3.5, 1, 2);
    check(&pane, 0, NULL);
}
END_TEST

/* A ceiling that is not there is bounded by edges of walls alone, beside the window in one of them. */
START_TEST(missing_face) {
    mesh m = {0};
    add_room(&m, false);
    add_strips(&m, 2.5, 3.5, 1, 2);
    check(&m, 2, (const double[]){48, 1});
}
END_TEST

/* Two walls that leave their common corner open: each opening ends in a straight line there. */
START_TEST(corner_window) {
    mesh m = {0};
    for (int axis = 0; axis < 3; axis++)
        for (int high = 0; high < 2; high++) {
            box_cell c = {.axis = axis, .level = high ? room[axis] : 0};
            if ((axis == 1 && !high) || (axis == 0 && high)) continue;
            memcpy(c.to, room, sizeof c.to);
            c.from[axis] = c.to[axis] = c.level;
            mesh_add_cell(&m, &c, !high);
        }
    add_strips(&m, 5, 6, 1, 2);
    const double east[3][4] = {{1.5, 8, 0, 3}, {0, 1.5, 0, 1}, {0, 1.5, 2, 3}};
    for (size_t k = 0; k < 3; k++) {
        const box_cell c = {
            .axis = 0, .level = 6, .from = {6, east[k][0], east[k][2]}, .to = {6, east[k][1], east[k][3]}};
        mesh_add_cell(&m, &c, false);
    }
    check(&m, 2, (const double[]){1.5, 1});
}
END_TEST

/* A plate with many holes, each corner of a cell on edges of others: all are found. */
START_TEST(many_holes) {
    enum { ACROSS = 40, ALONG = 25 };
    mesh m = {0};
    add_room(&m, true);
    const double a = room[0] / ACROSS, b = room[2] / ALONG;
    for (int i = 0; i < ALONG; i++) {
        add_wall(&m, 0, 0, 6, i * b, (i + .5) * b);
        for (int k = 0; k < ACROSS; k++) add_wall(&m, 0, k * a, (k + .5) * a, (i + .5) * b, (i + 1) * b);
    }
    face_openings o = find(&m);
    ck_assert_uint_eq(o.n, ACROSS * ALONG);
    ck_assert_uint_eq(o.n_patches, ACROSS * ALONG);
    ck_assert_uint_eq(o.n_left, 0);
    face_openings_free(&o);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("face openings");
    TCase *tc = tcase_create("face openings");
    tcase_set_timeout(tc, 60);
    tcase_add_test(tc, strips);
    tcase_add_test(tc, closed_room_has_none);
    tcase_add_test(tc, keyhole);
    tcase_add_test(tc, bars_islands_and_panes);
    tcase_add_test(tc, missing_face);
    tcase_add_test(tc, corner_window);
    tcase_add_test(tc, many_holes);
    suite_add_tcase(suite, tc);
    return suite_run(suite);
}
