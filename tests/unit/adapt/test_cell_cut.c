/* Points of cells and the cuts that they choose, against sums in double by the definition of the gain. */
#include "solver/adapt/cell_cut.h"
#include "solver/base/random.h"
#include "support/box.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = 200, LIGHTS = 2 };

/* One face of 2 x 1 m in the plane z = 1, reflectance 1, or half of it, a triangle. */
static mesh one_face(bool triangle) {
    static const box_cell cell = {.axis = 2, .level = 1, .from = {0, 0, 1}, .to = {2, 1, 1}};
    mesh m = {0};
    lam_error error = {0};
    mesh_add_cell(&m, &cell, true);
    mesh_finish(&m, 1);
    if (triangle) m.elements[0][3] = MESH_NO_VERTEX;
    ck_ok(mesh_measure(&m, &error));
    return m;
}

typedef double light_at(size_t light, double x, double y);

/* Random points of a cell in its plane; of the triangle those of the box that lie in it. Both halves have the
 * light and noise of their own. */
static cell_points points_of(const mesh *m, light_at *light, double noise, uint64_t key) {
    const face_plane plane = face_plane_of(m, 0);
    cell_points p = {.n = 0};
    lam_error error = {0};
    ck_ok(cell_points_reserve(&p, LIGHTS, 0, POINTS, &error));
    while (p.n < POINTS) {
        const double at[3] = {2 * random_unit(&key), random_unit(&key), 1};
        double in[2];
        if (mesh_corners(m, 0) == 3) {
            double inside = INFINITY;
            for (size_t k = 0; k < 3; k++) {
                const double *a = m->vertices[m->elements[0][k]],
                             *b = m->vertices[m->elements[0][(k + 1) % 3]];
                inside = fmin(inside, (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0]));
            }
            if (inside * (double)m->normal[0][2] < 0) continue;
        }
        face_plane_at(&plane, at, in);
        p.x[p.n] = (float)in[0];
        p.y[p.n] = (float)in[1];
        p.weight[p.n] = (float)(.5 + random_unit(&key));
        for (size_t v = 0; v < LIGHTS; v++)
            for (size_t h = 0; h < GATHER_HALVES; h++)
                p.H[(v * GATHER_HALVES + h) * p.room + p.n] =
                    (float)(light(v, at[0], at[1]) + noise * (random_unit(&key) - .5));
        p.n++;
    }
    return p;
}

/* The product of the deviations of both halves from their means, over points on one side of a way. */
static double spread(const cell_points *p, size_t v, const float *from, const float *to, bool left) {
    const float *H = p->H + v * GATHER_HALVES * p->room;
    double w = 0, mean[GATHER_HALVES] = {0}, sum = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (size_t k = 0; k < p->n; k++) {
            const double weight = (double)p->weight[k];
            if (from != NULL && (left_of(from, to, p->x[k], p->y[k]) > 0) != left) continue;
            if (pass == 0) {
                w += weight;
                for (size_t h = 0; h < GATHER_HALVES; h++) mean[h] += weight * (double)H[h * p->room + k];
            } else {
                sum += weight * ((double)H[k] - mean[0] / w) * ((double)H[p->room + k] - mean[1] / w);
            }
        }
    }
    return sum;
}

/* The gain of a cut: A over the sum of weights, times what the spreads of both sides lack of that of all. */
static double gain_of(const cell_light *light, const mesh_cell *c, const cell_points *p, mesh_cut cut,
                      size_t l) {
    float from[2], to[2];
    double all = 0;
    for (size_t k = 0; k < p->n; k++) all += (double)p->weight[k];
    cell_cut_way(light, c, cut, from, to);
    return mesh_cell_area(c) / all / light->all[l] *
           (spread(p, l, NULL, NULL, false) - spread(p, l, from, to, false) - spread(p, l, from, to, true));
}

/* A shadow's edge from (5/16 of 2, 0) to (9/16 of 2, 1), and one along y = 3/4. */
static double edges(size_t light, double x, double y) {
    return light == 0 ? x > .625 + .5 * y : y > .75;
}

static double one(size_t light, double x, double y) {
    (void)light, (void)x, (void)y;
    return 1;
}

static double slope(size_t light, double x, double y) {
    return light == 0 ? x + y : x * y;
}

/* Edges of shadows that run between sixteenths are found as they are, those of each light; parts are where
 * points are. */
START_TEST(edges_of_shadows_are_found) {
    mesh m = one_face(false);
    const coarse_light coarse = {.n_lights = LIGHTS};
    const cell_light light = {.m = &m, .coarse = &coarse, .all = {1, 2}};
    const mesh_cell c = mesh_cell_of(&m, 0);
    cell_points p = points_of(&m, edges, 0, 3 + (uint64_t)_i);
    cell_cut best[COARSE_LIGHTS];
    cell_cut_find(&light, &c, &p, best);
    for (size_t l = 0; l < LIGHTS; l++) {
        float from[2], to[2];
        cell_points left = {.n = 0}, right = {.n = 0};
        lam_error error = {0};
        ck_assert_double_eq_tol((double)best[l].gain[l], gain_of(&light, &c, &p, best[l].cut, l), 1e-5);
        ck_assert_double_gt((double)best[l].gain[l], 0);
        cell_cut_way(&light, &c, best[l].cut, from, to);
        ck_ok(cell_points_part(&p, from, to, &left, &right, &error));
        ck_assert_uint_eq(left.n + right.n, POINTS);
        const double all = spread(&p, l, NULL, NULL, false);
        ck_assert_double_le(spread(&left, l, NULL, NULL, false), .02 * all);
        ck_assert_double_le(spread(&right, l, NULL, NULL, false), .02 * all);
        cell_points_free(&left);
        cell_points_free(&right);
    }
    ck_assert(best[0].gain[0] > 2 * best[1].gain[0] && best[1].gain[1] > 2 * best[0].gain[1]);
    cell_points_free(&p);
    mesh_free(&m);
}
END_TEST

static bool slender(const mesh_cell *c) {
    double length[4], most = 0, least = INFINITY;
    mesh_cell_edges(c, length);
    for (size_t k = 0; k < c->n; k++) most = fmax(most, length[k]), least = fmin(least, length[k]);
    return most * most > 16 * mesh_cell_area(c) || most > 32 * least;
}

/* No cut between eighths whose parts are neither long nor narrow gains more than the one that is found, whose
 * gain is that by definition; of quads and of triangles, noise included. */
START_TEST(no_cut_gains_more) {
    mesh m = one_face(_i % 2 == 1);
    const coarse_light coarse = {.n_lights = LIGHTS};
    const cell_light light = {.m = &m, .coarse = &coarse, .all = {1, 2}};
    const mesh_cell c = mesh_cell_of(&m, 0);
    cell_points p = points_of(&m, slope, .5, 9 + (uint64_t)_i);
    cell_cut best[COARSE_LIGHTS];
    mesh_cut cuts[MESH_CUTS_MOST];
    cell_cut_find(&light, &c, &p, best);
    for (size_t l = 0; l < LIGHTS; l++) {
        mesh_cell parts[2];
        ck_assert_double_gt((double)best[l].gain[l], 0);
        for (size_t of = 0; of < LIGHTS; of++) {
            const double gain = gain_of(&light, &c, &p, best[l].cut, of);
            ck_assert_double_eq_tol((double)best[l].gain[of], gain, 1e-4 * fabs(gain) + 1e-6);
        }
        ck_assert(mesh_cell_cut(&c, best[l].cut, parts) && !slender(&parts[0]) && !slender(&parts[1]));
        const size_t n = mesh_cell_cuts(c.n, MESH_CELL_STEPS / 8, cuts);
        for (size_t k = 0; k < n; k++) {
            ck_assert(mesh_cell_cut(&c, cuts[k], parts));
            if (slender(&parts[0]) || slender(&parts[1])) continue;
            ck_assert_double_le(gain_of(&light, &c, &p, cuts[k], l), (double)best[l].gain[l] + 1e-6);
        }
    }
    cell_points_free(&p);
    mesh_free(&m);
}
END_TEST

/* Light that is the same everywhere, and a single point, have nothing to gain. */
START_TEST(even_light_gains_nothing) {
    mesh m = one_face(false);
    const coarse_light coarse = {.n_lights = LIGHTS};
    const cell_light light = {.m = &m, .coarse = &coarse, .all = {1, 1}};
    const mesh_cell c = mesh_cell_of(&m, 0);
    cell_points p = points_of(&m, one, 0, 1);
    cell_cut best[COARSE_LIGHTS];
    cell_cut_find(&light, &c, &p, best);
    ck_assert(best[0].gain[0] <= 1e-9f && best[1].gain[1] <= 1e-9f);
    p.n = 1;
    cell_cut_find(&light, &c, &p, best);
    ck_assert(best[0].gain[0] == 0 && best[1].gain[1] == 0);
    cell_points_free(&p);
    mesh_free(&m);
}
END_TEST

/* The last points stay, as many as may, and there is room for more. */
START_TEST(room_is_made) {
    mesh m = one_face(false);
    cell_points p = points_of(&m, slope, 0, 1);
    const float x = p.x[POINTS - 1], H = p.H[3 * p.room + POINTS - 1];
    lam_error error = {0};
    ck_ok(cell_points_reserve(&p, LIGHTS, 50, 36, &error));
    ck_assert_uint_eq(p.n, 50);
    ck_assert_uint_eq(p.room, 86);
    ck_assert(p.x[49] == x && p.H[3 * p.room + 49] == H);
    ck_ok(cell_points_reserve(&p, LIGHTS, 0, 36, &error));
    ck_assert_uint_eq(p.n, 0);
    cell_points_free(&p);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("cell cut");
    TCase *c = tcase_create("all");
    tcase_add_loop_test(c, edges_of_shadows_are_found, 0, 8);
    tcase_add_loop_test(c, no_cut_gains_more, 0, 8);
    tcase_add_test(c, even_light_gains_nothing);
    tcase_add_test(c, room_is_made);
    suite_add_tcase(s, c);
    return suite_run(s);
}
