/* Polygons joined into larger convex ones: how many are left, and that they cover the same points once. */
#include "solver/base/random.h"
#include "solver/scene/facet/polygon_join.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"

#include <math.h>

static lam_error error;
static const double slack = 1e-6;

/* A grid of cells between corner(i, j) and its neighbours, without those of `left_out`; of triangles: each
 * cell in two, by either diagonal in turn. The cells share vertices. */
enum { SIDE = 6 };
typedef struct grid {
    double axis[2][3], origin[3];
    bool triangles, left_out[SIDE][SIDE];
} grid;

static mesh grid_mesh(const grid *g) {
    enum { POINTS = SIDE + 1 };
    mesh m = {.n = 0};
    m.vertices = test_allocate(POINTS * POINTS, sizeof *m.vertices);
    m.elements = test_allocate(2 * SIDE * SIDE, sizeof *m.elements);
    m.n_vertices = POINTS * POINTS;
    for (uint32_t j = 0; j < POINTS; j++)
        for (uint32_t i = 0; i < POINTS; i++)
            for (int d = 0; d < 3; d++)
                m.vertices[j * POINTS + i][d] =
                    g->origin[d] + (double)(i * i + 3 * i) * g->axis[0][d] + (double)j * g->axis[1][d];
    for (uint32_t j = 0; j < SIDE; j++)
        for (uint32_t i = 0; i < SIDE; i++) {
            const uint32_t a = j * POINTS + i, b = a + 1, c = a + 1 + POINTS, d = a + POINTS;
            if (g->left_out[j][i]) continue;
            if (!g->triangles) {
                memcpy(m.elements[m.n++], (uint32_t[4]){a, b, c, d}, sizeof *m.elements);
                continue;
            }
            const bool turned = (i + j) % 2 == 1;
            memcpy(m.elements[m.n++], (uint32_t[4]){a, b, turned ? d : c, MESH_NO_VERTEX},
                   sizeof *m.elements);
            memcpy(m.elements[m.n++], (uint32_t[4]){turned ? b : a, c, d, MESH_NO_VERTEX},
                   sizeof *m.elements);
        }
    return m;
}

/* Pieces left of those of a mesh, each element of which has a label of its own; the caller frees *out. */
static size_t join(const mesh *m, joined_polygon **out) {
    size_t count = 0;
    uint32_t *label = test_allocate(m->n, sizeof *label);
    for (uint32_t k = 0; k < m->n; k++) label[k] = k;
    const polygon_join_options how = {.n = m->n,
                                      .polygons = (const uint32_t(*)[4])m->elements,
                                      .label = label,
                                      .split = true,
                                      .corners = JOINED_CORNERS,
                                      .slack = slack};
    ck_ok(polygons_join(m, &how, out, &count, &error));
    free(label);
    return count;
}

static size_t count_joined(const grid *g) {
    mesh m = grid_mesh(g);
    joined_polygon *pieces;
    const size_t count = join(&m, &pieces);
    free(pieces);
    free(m.vertices);
    free(m.elements);
    return count;
}

static const grid tilted = {.axis = {{.3, .1, .2}, {-.2, .6, 0}}, .origin = {5, -3, 2}};

START_TEST(a_grid_becomes_one_piece) {
    grid g = tilted;
    ck_assert_uint_eq(count_joined(&g), 1);
    g.triangles = true;
    ck_assert_uint_eq(count_joined(&g), 1);
}
END_TEST

/* A hole within a rectangle takes four rectangles, a door three, a corner two. */
START_TEST(holes_stay_open) {
    grid hole = tilted, door = tilted, notch = tilted;
    hole.left_out[2][3] = hole.left_out[2][2] = hole.left_out[3][3] = hole.left_out[3][2] = true;
    door.left_out[0][1] = door.left_out[1][1] = true;
    notch.left_out[5][5] = true;
    ck_assert_uint_eq(count_joined(&hole), 4);
    ck_assert_uint_eq(count_joined(&door), 3);
    ck_assert_uint_eq(count_joined(&notch), 2);
}
END_TEST

/* True where a point of the plane of axes lies inside a convex piece. */
static bool covers(const mesh *m, uint32_t n, const uint32_t *corner, const double x[3],
                   const double normal[3]) {
    for (uint32_t c = 0; c < n; c++) {
        const double *p = m->vertices[corner[c]], *q = m->vertices[corner[(c + 1) % n]];
        double inward = 0;
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, h = (d + 2) % 3;
            inward += normal[d] * ((q[e] - p[e]) * (x[h] - p[h]) - (q[h] - p[h]) * (x[e] - p[e]));
        }
        if (inward < 0) return false;
    }
    return true;
}

START_TEST(the_same_points_are_covered_once) {
    enum { POINTS = 400, TRIALS = 60 };
    uint64_t state = 3;
    size_t before = 0, after = 0;
    for (int trial = 0; trial < TRIALS; trial++) {
        grid g = tilted;
        double normal[3];
        g.triangles = trial % 2 == 1;
        for (int k = 0; k < SIDE * SIDE; k++) g.left_out[k / SIDE][k % SIDE] = random_unit(&state) < .3;
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, h = (d + 2) % 3;
            normal[d] = g.axis[0][e] * g.axis[1][h] - g.axis[0][h] * g.axis[1][e];
        }
        mesh m = grid_mesh(&g);
        joined_polygon *pieces;
        const size_t count = join(&m, &pieces);
        before += m.n;
        after += count;
        for (int k = 0; k < POINTS; k++) {
            const double u = random_between(&state, 0, SIDE * SIDE + 3 * SIDE);
            const double v = random_between(&state, 0, SIDE);
            double x[3];
            int own = 0, joined = 0;
            for (int d = 0; d < 3; d++) x[d] = g.origin[d] + u * g.axis[0][d] + v * g.axis[1][d];
            for (size_t p = 0; p < m.n; p++)
                own += covers(&m, (uint32_t)corner_count(m.elements[p]), m.elements[p], x, normal);
            for (size_t p = 0; p < count; p++) joined += covers(&m, pieces[p].n, pieces[p].corner, x, normal);
            ck_assert_int_eq(own, joined);
        }
        free(pieces);
        free(m.vertices);
        free(m.elements);
    }
    ck_assert_uint_lt(2 * after, before);
}
END_TEST

/* Two squares that share an edge, the second turned up by `rise` metres at its far side. */
static size_t count_of_two(double rise, bool turned, double aside) {
    double x[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, aside, rise}, {2, 1 + aside, rise}};
    uint32_t elements[2][4] = {{0, 1, 2, 3}, {1, 4, 5, 2}};
    if (turned) memcpy(elements[1], (uint32_t[4]){2, 5, 4, 1}, sizeof elements[1]);
    const mesh m = {.n = 2, .n_vertices = 6, .vertices = x, .elements = elements};
    joined_polygon *pieces;
    const size_t count = join(&m, &pieces);
    free(pieces);
    return count;
}

/* A square, and half of it folded back over it about the shared edge. */
static size_t count_folded(void) {
    double x[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {.5, 0, 0}, {.5, 1, 0}};
    uint32_t elements[2][4] = {{0, 1, 2, 3}, {2, 1, 4, 5}};
    const mesh m = {.n = 2, .n_vertices = 6, .vertices = x, .elements = elements};
    joined_polygon *pieces;
    const size_t count = join(&m, &pieces);
    free(pieces);
    return count;
}

/* Triangles whose union has a corner that points inwards. */
static size_t count_dart(void) {
    double x[4][3] = {{0, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}};
    uint32_t elements[2][4] = {{0, 1, 2, MESH_NO_VERTEX}, {0, 2, 3, MESH_NO_VERTEX}};
    const mesh m = {.n = 2, .n_vertices = 4, .vertices = x, .elements = elements};
    joined_polygon *pieces;
    const size_t count = join(&m, &pieces);
    free(pieces);
    return count;
}

START_TEST(only_plane_convex_unions_are_joined) {
    ck_assert_uint_eq(count_of_two(0, false, 0), 1);
    ck_assert_uint_eq(count_of_two(.3 * slack, false, 0), 1);
    ck_assert_uint_eq(count_of_two(3 * slack, false, 0), 2);
    ck_assert_uint_eq(count_of_two(0, true, 0), 2); /* a front and a back */
    ck_assert_uint_eq(count_folded(), 2);
    ck_assert_uint_eq(count_dart(), 2);
    ck_assert_uint_eq(count_of_two(0, false, .5), 2);         /* a bend */
    ck_assert_uint_eq(count_of_two(0, false, .3 * slack), 1); /* none */
}
END_TEST

/* A strip of many cells, each turned by less than slack against the one before. A chord of n cells lies
 * .4 slack (n/2)^2 from the curve; rounds drop up to slack each, of twice as many cells. */
START_TEST(small_bends_do_not_add_up) {
    enum { CELLS = 200 };
    double x[2 * CELLS + 2][3];
    uint32_t elements[CELLS][4];
    for (uint32_t k = 0; k <= CELLS; k++)
        for (int c = 0; c < 2; c++)
            memcpy(x[2 * k + (uint32_t)c], (double[3]){k, c + .4 * slack * k * k, 0}, sizeof x[0]);
    for (uint32_t k = 0; k < CELLS; k++)
        memcpy(elements[k], (uint32_t[4]){2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1}, sizeof elements[k]);
    const mesh m = {.n = CELLS, .n_vertices = 2 * CELLS + 2, .vertices = x, .elements = elements};
    joined_polygon *pieces;
    const size_t count = join(&m, &pieces);
    ck_assert_uint_gt(count, 10);
    for (size_t p = 0; p < count; p++) {
        const double length = fabs(x[pieces[p].corner[1]][0] - x[pieces[p].corner[0]][0]);
        ck_assert_double_le(.4 * length * length / 4, 2);
    }
    free(pieces);
}
END_TEST

/* A fan of triangles about the first corner of a regular polygon. */
static size_t count_fan(uint32_t sides, uint32_t *corners) {
    double x[16][3];
    uint32_t elements[16][4];
    for (uint32_t k = 0; k < sides; k++)
        memcpy(x[k], (double[3]){cos(2 * M_PI * k / sides), sin(2 * M_PI * k / sides), 0}, sizeof x[k]);
    for (uint32_t k = 0; k + 2 < sides; k++)
        memcpy(elements[k], (uint32_t[4]){0, k + 1, k + 2, MESH_NO_VERTEX}, sizeof elements[k]);
    const mesh m = {.n = sides - 2, .n_vertices = sides, .vertices = x, .elements = elements};
    joined_polygon *pieces;
    const size_t count = join(&m, &pieces);
    *corners = 0;
    for (size_t p = 0; p < count; p++) *corners += pieces[p].n;
    free(pieces);
    return count;
}

/* k pieces that share k - 1 edges have 2 (k - 1) corners more than the polygon. */
START_TEST(wide_pieces_have_eight_corners_at_most) {
    uint32_t corners;
    for (uint32_t sides = 3; sides <= JOINED_CORNERS; sides++) {
        ck_assert_uint_eq(count_fan(sides, &corners), 1);
        ck_assert_uint_eq(corners, sides);
    }
    const size_t count = count_fan(JOINED_CORNERS + 1, &corners);
    ck_assert_uint_eq(count, 2);
    ck_assert_uint_eq(corners, JOINED_CORNERS + 1 + 2 * (count - 1));
}
END_TEST

/* Two squares whose common corners are vertices of their own at the same places, or a little apart. */
START_TEST(vertices_at_one_place_are_one) {
    for (int apart = 0; apart < 2; apart++) {
        double x[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                          {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1 + 1e-3 * apart, 0}};
        uint32_t elements[2][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}};
        const mesh m = {.n = 2, .n_vertices = 8, .vertices = x, .elements = elements};
        joined_polygon *pieces;
        const size_t count = join(&m, &pieces);
        ck_assert_uint_eq(count, 1 + (size_t)apart);
        ck_assert_uint_eq(pieces[0].label, apart ? 0 : MESH_NO_VERTEX);
        free(pieces);
    }
}
END_TEST

/* A quad that is bent along a diagonal, or has a corner that points inwards, is two triangles, and so is not
 * a quad with a straight corner, nor one of which two corners are at one place. */
START_TEST(quads_that_are_not_plane_and_convex_are_triangles) {
    static const struct {
        double third[3];
        size_t count;
        uint32_t corners;
    } cases[] = {
        {{1, 1, 0}, 1, 4}, {{1, 1, .1}, 2, 6}, {{.2, .2, 0}, 2, 6}, {{.5, .5, 0}, 1, 3}, {{0, 1, 0}, 1, 3}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        double x[4][3] = {{0, 0, 0}, {1, 0, 0}, {0}, {0, 1, 0}};
        uint32_t elements[1][4] = {{0, 1, 2, 3}}, corners = 0;
        memcpy(x[2], cases[k].third, sizeof x[2]);
        const mesh m = {.n = 1, .n_vertices = 4, .vertices = x, .elements = elements};
        joined_polygon *pieces;
        const size_t count = join(&m, &pieces);
        for (size_t p = 0; p < count; p++) corners += pieces[p].n;
        ck_assert_uint_eq(count, cases[k].count);
        ck_assert_uint_eq(corners, cases[k].corners);
        free(pieces);
    }
}
END_TEST

/* A bent quad stays one where none is split, and a flat one beside it is not joined with it. */
START_TEST(bent_quads_stay_whole_where_none_is_split) {
    double x[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, .1}, {0, 1, 0}, {-1, 0, 0}, {-1, 1, 0}};
    const uint32_t elements[2][4] = {{0, 1, 2, 3}, {4, 0, 3, 5}}, label[2] = {7, 7};
    const mesh m = {.n_vertices = 6, .vertices = x};
    const polygon_join_options how = {
        .n = 2, .polygons = elements, .label = label, .within_labels = true, .corners = 4, .slack = slack};
    joined_polygon *pieces;
    size_t count = 0;
    ck_ok(polygons_join(&m, &how, &pieces, &count, &error));
    ck_assert_uint_eq(count, 2);
    for (uint32_t p = 0; p < 2; p++) {
        ck_assert_uint_eq(pieces[p].n, 4);
        ck_assert_uint_eq(pieces[p].first, p);
        ck_assert_uint_eq(pieces[p].label, 7);
    }
    free(pieces);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("polygon join");
    TCase *tests = tcase_create("polygon join");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, a_grid_becomes_one_piece);
    tcase_add_test(tests, holes_stay_open);
    tcase_add_test(tests, the_same_points_are_covered_once);
    tcase_add_test(tests, only_plane_convex_unions_are_joined);
    tcase_add_test(tests, small_bends_do_not_add_up);
    tcase_add_test(tests, wide_pieces_have_eight_corners_at_most);
    tcase_add_test(tests, vertices_at_one_place_are_one);
    tcase_add_test(tests, quads_that_are_not_plane_and_convex_are_triangles);
    tcase_add_test(tests, bent_quads_stay_whole_where_none_is_split);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
