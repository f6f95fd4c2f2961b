/* Faces cut along the walls that stand on them: no part is on both sides of a wall, whatever stands there.
 * The tests know where they put their walls, and look at points along them. */
#include "solver/base/random.h"
#include "solver/scene/facet/wall_cuts.h"
#include "support/box.h"
#include "support/suite.h"

static lam_error error;

/* A wall stands on a face from one point to another, in the coordinates of the mesh. */
typedef struct wall_foot {
    double from[3], to[3];
} wall_foot;

enum { FEET_MOST = 4096 };
typedef struct scene {
    mesh m;
    size_t n_feet;
    wall_foot feet[FEET_MOST];
} scene;

static void add_foot(scene *s, const double from[3], const double to[3]) {
    ck_assert_uint_lt(s->n_feet, FEET_MOST);
    memcpy(s->feet[s->n_feet].from, from, sizeof s->feet->from);
    memcpy(s->feet[s->n_feet++].to, to, sizeof s->feet->to);
}

/* A room of 6 x 4 x 3 m seen from inside; the floor in n_floor strips, by one diagonal each in triangles. */
static const double room[3] = {6, 4, 3};

static void add_triangle(mesh *m, const double a[3], const double b[3], const double c[3]) {
    double quad[4][3];
    memcpy(quad[0], a, sizeof quad[0]);
    memcpy(quad[1], b, sizeof quad[1]);
    memcpy(quad[2], c, sizeof quad[2]);
    memcpy(quad[3], c, sizeof quad[3]);
    mesh_add_quad(m, (const double(*)[3])quad);
    m->elements[m->n - 1][3] = MESH_NO_VERTEX;
}

static void add_room(mesh *m, int n_strips) {
    for (int axis = 0; axis < 3; axis++)
        for (int high = 0; high < 2; high++) {
            if (axis == 2 && !high && n_strips > 0) continue;
            box_cell c = {.axis = axis, .level = high ? room[axis] : 0};
            memcpy(c.to, room, sizeof c.to);
            c.from[axis] = c.to[axis] = c.level;
            mesh_add_cell(m, &c, !high);
        }
    for (int k = 0; k < n_strips; k++) {
        const double x0 = room[0] * k / n_strips, x1 = room[0] * (k + 1) / n_strips;
        const double p[4][3] = {{x0, 0, 0}, {x1, 0, 0}, {x1, room[1], 0}, {x0, room[1], 0}};
        add_triangle(m, p[0], p[1], p[2]);
        add_triangle(m, p[0], p[2], p[3]);
    }
}

/* An upright quad of n pieces side by side, its front on the left of the way from a to b. */
static void add_sheet(scene *s, const double a[2], const double b[2], double low, double high, int n) {
    for (int k = 0; k < n; k++) {
        double p[2], q[2];
        for (int d = 0; d < 2; d++) {
            p[d] = a[d] + (b[d] - a[d]) * k / n;
            q[d] = a[d] + (b[d] - a[d]) * (k + 1) / n;
        }
        mesh_add_quad(&s->m,
                      (const double[4][3]){
                          {p[0], p[1], low}, {p[0], p[1], high}, {q[0], q[1], high}, {q[0], q[1], low}});
    }
    add_foot(s, (const double[3]){a[0], a[1], 0}, (const double[3]){b[0], b[1], 0});
}

/* A box without a bottom on the floor, turned about the vertical through its middle. */
static void add_box(scene *s, double x, double y, double dx, double dy, double height, double turned) {
    double p[4][2];
    for (int k = 0; k < 4; k++) {
        const double u = (k == 1 || k == 2 ? .5 : -.5) * dx, v = (k >= 2 ? .5 : -.5) * dy;
        p[k][0] = x + cos(turned) * u - sin(turned) * v;
        p[k][1] = y + sin(turned) * u + cos(turned) * v;
    }
    for (int k = 0; k < 4; k++) add_sheet(s, p[(k + 1) % 4], p[k], 0, height, 1);
    mesh_add_quad(&s->m, (const double[4][3]){{p[0][0], p[0][1], height},
                                              {p[1][0], p[1][1], height},
                                              {p[2][0], p[2][1], height},
                                              {p[3][0], p[3][1], height}});
}

/* Turns all by no special angles, which depend on a seed, and rounds to six digits after the point. */
static void turn_and_round(scene *s, uint64_t seed) {
    uint64_t r = random_stream(seed, 1);
    const double a = random_between(&r, 0, 6), b = random_between(&r, 0, 3);
    for (size_t k = 0; k < s->m.n_vertices + 2 * s->n_feet; k++) {
        const size_t f = k - s->m.n_vertices;
        double *p = k < s->m.n_vertices ? s->m.vertices[k]
                    : f % 2 == 0        ? s->feet[f / 2].from
                                        : s->feet[f / 2].to;
        const double x = cos(a) * p[0] - sin(a) * p[1], y = sin(a) * p[0] + cos(a) * p[1];
        const double turned[3] = {x, cos(b) * y - sin(b) * p[2], sin(b) * y + cos(b) * p[2]};
        for (int d = 0; d < 3; d++) p[d] = k < s->m.n_vertices ? round(1e6 * turned[d]) / 1e6 : turned[d];
    }
}

/* Every face has a group, a reflectance and an emission of its own. */
static void finish(scene *s) {
    mesh *m = &s->m;
    mesh_finish(m, .5f);
    m->n_groups = m->n;
    for (size_t i = 0; i < m->n; i++) {
        m->group[i] = (uint32_t)i;
        m->reflectance[i] = .5f + (float)i / (4 * (float)m->n);
        m->emission[i] = (float)i;
    }
}

/* The distance of a point from the border of an element, positive inside; negative where it is off its plane.
 */
static double depth(const mesh *m, size_t i, const double x[3]) {
    double least = HUGE_VAL, height = 0;
    const size_t corners = mesh_corners(m, i);
    for (size_t k = 0; k < corners; k++) {
        const double *a = m->vertices[m->elements[i][k]], *b = m->vertices[m->elements[i][(k + 1) % corners]];
        const float *n = m->normal[i];
        double edge[3], to[3], length = 0, inside = 0;
        height = 0;
        for (int d = 0; d < 3; d++) {
            edge[d] = b[d] - a[d];
            to[d] = x[d] - a[d];
            length += edge[d] * edge[d];
            height += to[d] * (double)n[d];
        }
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            inside += (double)n[d] * (edge[e] * to[f] - edge[f] * to[e]);
        }
        least = fmin(least, inside / sqrt(length));
    }
    return fabs(height) < 1e-3 ? least : -1;
}

/* No foot runs within an element, a millimetre or more from its border. */
static void check_feet(const scene *s) {
    const mesh *m = &s->m;
    for (size_t f = 0; f < s->n_feet; f++)
        for (int step = 1; step < 80; step++) {
            double x[3];
            for (int d = 0; d < 3; d++)
                x[d] = s->feet[f].from[d] + (s->feet[f].to[d] - s->feet[f].from[d]) * step / 80;
            for (size_t i = 0; i < m->n; i++)
                ck_assert_msg(depth(m, i, x) < 1e-3, "element %zu of face %u lies under foot %zu", i,
                              m->group[i], f);
        }
}

/* The parts of each face have its area, materials and front, and come in the order of the faces. */
static void check_parts(const mesh *m, size_t n, const double *area, const float (*normal)[3]) {
    double *sum = calloc(n, sizeof *sum);
    for (size_t i = 0; i < m->n; i++) {
        const size_t face = m->group[i];
        ck_assert(i == 0 || face >= m->group[i - 1]);
        ck_assert_float_eq(m->emission[i], (float)face);
        ck_assert_float_eq(m->reflectance[i], .5f + (float)face / (4 * (float)n));
        for (int d = 0; d < 3; d++) ck_assert_float_eq_tol(m->normal[i][d], normal[face][d], 1e-3f);
        sum[face] += m->area[i];
    }
    for (size_t i = 0; i < n; i++) ck_assert_double_eq_tol(sum[i], area[i], 1e-9 + 1e-6 * area[i]);
    free(sum);
}

/* Cuts, and checks all of it. */
static wall_cuts_report cut(scene *s, double least, size_t most) {
    wall_cuts_report report;
    const size_t n = s->m.n;
    double *area = malloc(n * sizeof *area);
    float(*normal)[3] = malloc(n * sizeof *normal);
    memcpy(area, s->m.area, n * sizeof *area);
    memcpy(normal, s->m.normal, n * sizeof *normal);
    ck_ok(faces_cut_at_walls(&s->m, least, most, &report, &error));
    check_parts(&s->m, n, area, (const float(*)[3])normal);
    ck_assert_uint_eq(s->m.n, n - report.faces + report.parts);
    ck_assert_uint_le(s->m.n, most > n ? most : n);
    free(area);
    free(normal);
    return report;
}

static size_t under(const mesh *m) {
    size_t n;
    ck_ok(elements_under_walls(m, &n, &error));
    return n;
}

/* A wall across the room, 10 cm thick or two sheets without thickness: it cuts floor, ceiling and the two
 * walls that it meets, into three parts each or two. The scene is turned by seeds. */
START_TEST(a_wall_divides_a_room) {
    static scene s;
    for (int thick = 0; thick < 2; thick++)
        for (int pieces = 1; pieces < 60; pieces += 29) {
            s = (scene){.n_feet = 0};
            const double x0 = 2.03, x1 = thick ? 2.13 : 2.03;
            add_room(&s.m, 0);
            add_sheet(&s, (const double[2]){x0, 0}, (const double[2]){x0, 4}, 0, 3, pieces);
            add_sheet(&s, (const double[2]){x1, 4}, (const double[2]){x1, 0}, 0, 3, pieces);
            for (int side = 0; side < 4; side++) {
                const double x = side % 2 ? x1 : x0, y = side < 2 ? 0 : 4;
                add_foot(&s, (const double[3]){x, y, 0}, (const double[3]){x, y, 3});
                add_foot(&s, (const double[3]){x, 0, 3}, (const double[3]){x, 4, 3});
            }
            if (_i > 0) turn_and_round(&s, (uint64_t)_i);
            finish(&s);
            ck_assert_uint_eq(under(&s.m), 4);
            const wall_cuts_report made = cut(&s, .3, 1000);
            ck_assert_uint_eq(made.faces, 4);
            ck_assert_uint_eq(made.parts, thick ? 12 : 8);
            ck_assert_uint_eq(made.left, 0);
            check_feet(&s);
            ck_assert_uint_eq(under(&s.m), 0);
            ck_ok(mesh_refine(&s.m, &(mesh_refinement){.elements = 700}, &error));
            check_feet(&s);
            ck_assert_uint_eq(under(&s.m), 0);
            mesh_free(&s.m);
        }
}
END_TEST

/* A floor of small faces is cut as one of large faces is, although rounding tilts each of them: the far ends
 * of a wall are beside the planes of most. */
START_TEST(small_faces_are_cut) {
    enum { NX = 60, NY = 40 };
    static scene s;
    s = (scene){.n_feet = 0};
    for (int j = 0; j < NY; j++)
        for (int i = 0; i < NX; i++) {
            const double x0 = .1 * i, x1 = .1 * (i + 1), y0 = .1 * j, y1 = .1 * (j + 1);
            mesh_add_quad(&s.m, (const double[4][3]){{x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0}});
        }
    add_sheet(&s, (const double[2]){2.03, 0}, (const double[2]){2.03, 4}, 0, 3, 1);
    add_sheet(&s, (const double[2]){2.5, .33}, (const double[2]){6, 3.77}, 0, 3, 1);
    if (_i > 0) turn_and_round(&s, (uint64_t)_i);
    finish(&s);
    const wall_cuts_report made = cut(&s, .05, 100000);
    ck_assert_uint_ge(made.faces, NY + 35);
    check_feet(&s);
    ck_assert_uint_eq(under(&s.m), 0);
    mesh_free(&s.m);
}
END_TEST

/* A box that stands on a floor in one piece has a part below it, in five; turned boxes on floors of triangles
 * make more. */
START_TEST(boxes_stand_on_floors) {
    static scene s;
    s = (scene){.n_feet = 0};
    add_room(&s.m, 0);
    add_box(&s, 3, 2, 1, .5, .7, 0);
    finish(&s);
    wall_cuts_report made = cut(&s, .3, 1000);
    ck_assert_uint_eq(made.faces, 1);
    ck_assert_uint_eq(made.parts, 5);
    check_feet(&s);
    mesh_free(&s.m);
    uint64_t r = random_stream(_i, 2);
    for (int n = 1; n <= 16; n *= 2) {
        s = (scene){.n_feet = 0};
        add_room(&s.m, 1 + n % 5);
        for (int k = 0; k < n; k++) /* they may overlap */
            add_box(&s, random_between(&r, .5, 5.5), random_between(&r, .5, 3.5), random_between(&r, .3, .9),
                    random_between(&r, .3, .5), 1, random_between(&r, 0, 3));
        turn_and_round(&s, (uint64_t)_i);
        finish(&s);
        const size_t before = s.m.n;
        made = cut(&s, .2, 100000);
        ck_assert_uint_gt(made.faces, 0);
        ck_assert_uint_le(s.m.n, before + 40 * (size_t)n * (size_t)n);
        ck_assert_uint_eq(made.left, 0);
        check_feet(&s);
        ck_assert_uint_eq(under(&s.m), 0);
        mesh_free(&s.m);
    }
}
END_TEST

/* A round column of many narrow pieces is as long as it is wide; legs are too small. */
START_TEST(connected_edges_count_together) {
    static scene s;
    for (int wide = 0; wide < 2; wide++) {
        s = (scene){.n_feet = 0};
        const double radius = wide ? .5 : .02;
        add_room(&s.m, 1);
        for (int k = 0; k < 40; k++) {
            const double a = 2 * M_PI * k / 40, b = 2 * M_PI * (k + 1) / 40;
            add_sheet(&s, (const double[2]){3 + radius * cos(b), 2 + radius * sin(b)},
                      (const double[2]){3 + radius * cos(a), 2 + radius * sin(a)}, 0, 2, 1);
        }
        turn_and_round(&s, 5);
        finish(&s);
        const size_t before = s.m.n;
        const wall_cuts_report made = cut(&s, .3, 100000);
        ck_assert_uint_eq(made.faces, wide ? 2 : 0);
        ck_assert_uint_eq(made.left, 0);
        if (wide) check_feet(&s);
        if (wide) ck_assert_uint_le(s.m.n, before + 5 * 40);
        ck_assert_uint_eq(under(&s.m), 0); /* a leg is narrower than half a floor */
        mesh_free(&s.m);
    }
}
END_TEST

/* Meshes on which nothing stands stay as they are, bit for bit: boxes and the rims of their faces, a table
 * that hangs above the floor, a sheet that hangs below it, and walls along the rim of the floor. */
START_TEST(nothing_is_cut_without_walls) {
    static scene s;
    s = (scene){.n_feet = 0};
    add_room(&s.m, 3);
    mesh_add_quad(&s.m, (const double[4][3]){{1, 1, .7}, {2, 1, .7}, {2, 2, .7}, {1, 2, .7}});
    add_sheet(&s, (const double[2]){3, 1}, (const double[2]){3, 3}, -1, 0, 1);
    add_sheet(&s, (const double[2]){3, 1}, (const double[2]){3, 3}, .01, 1, 1);
    add_sheet(&s, (const double[2]){1, 0}, (const double[2]){5, 0}, 0, 1, 7);
    add_sheet(&s, (const double[2]){2, 4}, (const double[2]){2, 0}, 0, 1, 3); /* between two strips */
    if (_i > 0) turn_and_round(&s, (uint64_t)_i);
    finish(&s);
    s.m.n_groups = s.m.n;
    const mesh before = s.m;
    const wall_cuts_report made = cut(&s, 0, 1000);
    /* The last sheet stands on rims of the floor, but its ends stand on two walls, and on a piece of a sheet.
     */
    ck_assert_uint_eq(made.faces, 3);
    ck_assert_uint_eq(s.m.n, before.n + made.parts - 3);
    mesh_free(&s.m);
    mesh box = box_mesh(room, 4, .5f);
    const mesh same = box;
    wall_cuts_report report;
    ck_ok(faces_cut_at_walls(&box, 0, 1000, &report, &error));
    ck_assert_ptr_eq(box.elements, same.elements);
    ck_assert_ptr_eq(box.vertices, same.vertices);
    ck_assert_uint_eq(report.faces + report.parts + report.left, 0);
    mesh_free(&box);
}
END_TEST

/* A sheet below a floor stands on its back, if it is to have one. A sheet may pass through a floor. */
START_TEST(backs_and_sheets_that_pass_through) {
    static scene s;
    for (int has_back = 0; has_back < 2; has_back++)
        for (int through = 0; through < 2; through++) {
            s = (scene){.n_feet = 0};
            mesh_add_quad(&s.m, (const double[4][3]){{0, 0, 0}, {6, 0, 0}, {6, 4, 0}, {0, 4, 0}});
            add_sheet(&s, (const double[2]){1, 1}, (const double[2]){5, 3}, -1, through ? .5 : 0, 1);
            if (_i > 0) turn_and_round(&s, (uint64_t)_i);
            finish(&s);
            s.m.has_back = calloc(s.m.n, sizeof *s.m.has_back);
            s.m.has_back[0] = has_back;
            const bool stands = has_back || through;
            const wall_cuts_report made = cut(&s, .3, 1000);
            /* The floor cuts the sheet that passes through it, too. */
            ck_assert_uint_eq(made.faces, through ? 2 : stands);
            if (stands) check_feet(&s);
            for (size_t i = 0; i < s.m.n; i++) ck_assert(s.m.has_back[i] == (has_back && s.m.group[i] == 0));
            mesh_free(&s.m);
        }
}
END_TEST

/* However many walls there are, no more faces are made than may be: the longest walls come first. */
START_TEST(the_bound_is_kept) {
    static scene s;
    for (size_t added = 0; added < 200; added = 2 * added + 1) {
        uint64_t r = random_stream(9, 2);
        s = (scene){.n_feet = 0};
        add_room(&s.m, 1);
        add_sheet(&s, (const double[2]){.5, .5}, (const double[2]){5.5, 3}, 0, 1, 9);
        for (int k = 0; k < 30; k++)
            add_box(&s, random_between(&r, .5, 5.5), random_between(&r, .5, 3.5), .5, .3, 1,
                    random_between(&r, 0, 3));
        finish(&s);
        const size_t n = s.m.n;
        const wall_cuts_report made = cut(&s, .3, n + added);
        ck_assert_uint_gt(made.left, 0);
        ck_assert_uint_gt(under(&s.m), 0);
        s.n_feet = 1;
        if (added >= 15) check_feet(&s);
        mesh_free(&s.m);
    }
    mesh m = box_mesh(room, 1, .5f);
    wall_cuts_report report;
    ck_ok(mesh_make_two_sided(&m, &error));
    ck_assert_int_eq(faces_cut_at_walls(&m, 0, 1000, &report, &error), LAM_ERR_ARGUMENT);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wall cuts");
    TCase *tests = tcase_create("wall cuts");
    tcase_set_timeout(tests, 300);
#ifdef LAMBERT_FEW_CASES
    enum { SEEDS = 4 };
#else
    enum { SEEDS = 20 };
#endif
    tcase_add_loop_test(tests, a_wall_divides_a_room, 0, SEEDS);
    tcase_add_loop_test(tests, small_faces_are_cut, 0, SEEDS);
    tcase_add_loop_test(tests, boxes_stand_on_floors, 0, SEEDS);
    tcase_add_test(tests, connected_edges_count_together);
    tcase_add_loop_test(tests, nothing_is_cut_without_walls, 0, SEEDS);
    tcase_add_loop_test(tests, backs_and_sheets_that_pass_through, 0, SEEDS);
    tcase_add_test(tests, the_bound_is_kept);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
