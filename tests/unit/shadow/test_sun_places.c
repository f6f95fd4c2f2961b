/* The sun at receivers: closed forms of sun and shadow, faces that receivers lie on, panes, and a room of
 * boxes against every face by itself. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/shadow/sun_places.h"
#include "support/failing_memory.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

enum { MOST = 512 };

/* Quads with their own corners each. */
typedef struct quads {
    size_t n;
    double vertices[4 * MOST][3];
    uint32_t elements[MOST][4], group[MOST];
    float normal[MOST][3];
} quads;

static quads scene;

/* A rectangle across an axis at a level, that faces up or down it. */
static void rectangle(quads *q, int axis, double level, const double from[3], const double to[3], bool up,
                      uint32_t group) {
    const int u = (axis + 1) % 3, w = (axis + 2) % 3;
    for (int c = 0; c < 4; c++) {
        double *at = q->vertices[4 * q->n + (size_t)c];
        const bool far_u = c == 1 || c == 2, far_w = c >= 2;
        at[axis] = level;
        at[u] = (up ? far_u : far_w) ? to[u] : from[u];
        at[w] = (up ? far_w : far_u) ? to[w] : from[w];
        q->elements[q->n][c] = (uint32_t)(4 * q->n) + (uint32_t)c;
    }
    memset(q->normal[q->n], 0, sizeof q->normal[q->n]);
    q->normal[q->n][axis] = up ? 1 : -1;
    q->group[q->n++] = group;
}

/* The faces of a box, which look outwards or inwards. */
static void box(quads *q, const double from[3], const double to[3], bool outwards) {
    for (int axis = 0; axis < 3; axis++)
        for (int side = 0; side < 2; side++)
            rectangle(q, axis, side ? to[axis] : from[axis], from, to, (side == 1) == outwards, 0);
}

static lam_status make(const quads *q, const scene_glass *glass, shadow_tree **out, lam_error *error) {
    const shadow_faces f = {.n = q->n,
                            .n_fronts = q->n,
                            .n_vertices = 4 * q->n,
                            .vertices = (const double(*)[3])q->vertices,
                            .elements = (const uint32_t(*)[4])q->elements,
                            .normal = (const float(*)[3])q->normal,
                            .glass = glass,
                            .group = q->group};
    return shadow_tree_create(&f, out, error);
}

/* seen [n] of receivers in one direction. */
static void see(const quads *q, const scene_glass *glass, size_t n, const placed_receiver *r,
                const double direction[3], float *seen) {
    lam_error error = {0};
    shadow_tree *t = NULL;
    sun_places *p = NULL;
    ck_ok(make(q, glass, &t, &error));
    ck_ok(sun_places_create(t, n, r, &p, &error));
    for (size_t i = 0; i < n; i++) seen[i] = NAN;
    const double one[1][3] = {{direction[0], direction[1], direction[2]}};
    sun_places_find(p, t, 1, 1, one, &seen);
    sun_places_free(p);
    shadow_tree_free(t);
}

static placed_receiver plane(double x, double y, double z, double nx, double ny, double nz) {
    return (placed_receiver){.at = {x, y, z}, .axis = {nx, ny, nz}};
}

static void unit(double x, double y, double z, double out[3]) {
    const double length = sqrt(x * x + y * y + z * z);
    out[0] = x / length;
    out[1] = y / length;
    out[2] = z / length;
}

/* A box of 1 x 1 x 2 m on a floor; the sun 45 degrees high above +x. Its shadow ends 2 m behind it, and all
 * weights in the sun are those of the direction: cos of planes, sin(e) / pi of an upright cylinder, 1/4 of a
 * sphere; a semi-cylinder that looks to the sun has sin(e) (1 + cos 0) / pi. Single precision leaves 1e-6. */
START_TEST(sun_and_shadow) {
    const placed_receiver r[] = {plane(-.51, 0, 0, 0, 0, 1),
                                 plane(-2.49, 0, 0, 0, 0, 1),
                                 plane(-2.51, 0, 0, 0, 0, 1),
                                 plane(-1.5, .51, 0, 0, 0, 1),
                                 plane(-1.5, 0, 1.01, 1, 0, 0),
                                 plane(-1.5, 0, .99, 1, 0, 0),
                                 plane(3, 3, 0, 0, 0, 1),
                                 plane(3, 3, 1, -1, 0, 0),
                                 {.kind = 1, .at = {3, 3, 0}, .axis = {0, 0, 1}},
                                 {.kind = 2, .at = {3, 3, 0}, .axis = {0, 0, 1}, .look = {1, 0, 0}},
                                 {.kind = 2, .at = {3, 3, 0}, .axis = {0, 0, 1}, .look = {-1, 0, 0}},
                                 {.kind = 3, .at = {3, 3, 0}},
                                 {.kind = 3, .at = {-1.5, 0, .5}}};
    enum { N = sizeof r / sizeof r[0] };
    const double half = M_SQRT1_2,
                 expected[N] = {0, 0, half, half, half, 0, half, 0, half / M_PI, 2 * half / M_PI, 0, .25, 0};
    double sun[3];
    float seen[N];
    scene.n = 0;
    rectangle(&scene, 2, 0, (double[]){-9, -9, 0}, (double[]){9, 9, 0}, true, 0);
    box(&scene, (double[]){-.5, -.5, 0}, (double[]){.5, .5, 2}, true);
    unit(1, 0, 1, sun);
    see(&scene, NULL, N, r, sun, seen);
    for (size_t i = 0; i < N; i++)
        ck_assert_msg(fabs((double)seen[i] - expected[i]) < 1e-6, "receiver %zu: %.7f, must be %.7f", i,
                      (double)seen[i], expected[i]);
}
END_TEST

/* A room of 4 x 4 x 3 m without its wall x = 4. Receivers in its faces, at its edges and a little outside of
 * them see the sun where the room is open, and not through the face that they lie in; one that looks into the
 * floor sees what is below it. */
START_TEST(on_faces) {
    const placed_receiver r[] = {
        plane(2, 0, .5, 0, 0, 1),         plane(0, 0, 0, 0, 0, 1),     plane(2, -2e-4, 0, 0, 0, 1),
        plane(2, 4, 1, 0, 0, 1),          plane(2, 2, -2e-4, 0, 0, 1), {.kind = 3, .at = {2, 4, 0}},
        {.kind = 3, .at = {2, 2, -2e-4}}, plane(2, 2, 0, 0, 0, -1),    plane(2, 2, 1e-3, 0, 0, -1)};
    enum { N = sizeof r / sizeof r[0] };
    static const double suns[4][3] = {{.8, .36, .48}, {.8, -.36, .48}, {-.6, .6, .52}, {.2, .2, -.9}};
    static const bool sees[4][N] = {{1, 1, 1, 0, 1, 0, 1, 0, 0},
                                    {0, 0, 0, 1, 1, 1, 1, 0, 0},
                                    {0, 0, 0, 0, 0, 0, 0, 0, 0},
                                    {0, 0, 0, 0, 0, 0, 0, 1, 0}};
    scene.n = 0;
    box(&scene, (double[]){0, 0, 0}, (double[]){4, 4, 3}, false);
    memmove(scene.elements[1], scene.elements[2], 4 * sizeof scene.elements[0]);
    memmove(scene.normal[1], scene.normal[2], 4 * sizeof scene.normal[0]);
    scene.n--;
    for (int k = 0; k < 4; k++) {
        double sun[3];
        float seen[N];
        unit(suns[k][0], suns[k][1], suns[k][2], sun);
        see(&scene, NULL, N, r, sun, seen);
        for (size_t i = 0; i < N; i++) {
            const double weight = r[i].kind == 3 ? .25 : fmax(dot3(r[i].axis, sun), 0);
            ck_assert_msg(fabs((double)seen[i] - (sees[k][i] ? weight : 0)) < 1e-6,
                          "sun %d, receiver %zu: %g", k, i, (double)seen[i]);
        }
    }
}
END_TEST

/* A pane of T = .78 in a horizontal plane, of two faces that pass a root of it each: T g(t), glass by angle,
 * behind it, and nothing lost above it. */
START_TEST(behind_a_pane) {
    const scene_glass glass = {.of = (struct group_glass[]){{0, 0}, {.78, 2}}, .by_angle = true};
    const placed_receiver r[] = {plane(0, 0, 0, 0, 0, 1), plane(0, 0, 2, 0, 0, 1), plane(1, 2, 1, 0, 0, 1),
                                 plane(1, 2, 1.5098, 0, 0, 1)};
    float seen[4];
    scene.n = 0;
    rectangle(&scene, 2, 0, (double[]){-9, -9, 0}, (double[]){9, 9, 0}, true, 0);
    rectangle(&scene, 2, 1.5, (double[]){-9, -9, 0}, (double[]){9, 9, 0}, true, 1);
    rectangle(&scene, 2, 1.51, (double[]){-9, -9, 0}, (double[]){9, 9, 0}, true, 1);
    for (int k = 0; k < 5; k++) {
        double sun[3];
        unit(.3 * k, -.2 * k, 1, sun);
        const double passed = pow(glass_passes(&glass.of[1], true, sun[2]), 2),
                     sine = sqrt(1 - sun[2] * sun[2]),
                     law = .78 * fmin(1, 1.018 * sun[2] * (1 + sine * sine * sine));
        see(&scene, &glass, 4, r, sun, seen);
        ck_assert_double_eq_tol((double)seen[0], sun[2] * passed, 1e-6);
        ck_assert_double_eq_tol((double)seen[1], sun[2], 1e-6);
        ck_assert_double_eq_tol((double)seen[2], sun[2] * passed, 1e-6);
        ck_assert_double_eq_tol((double)seen[3], sun[2], 1e-6); /* on the outer face */
        ck_assert_double_eq_tol(passed, law, 1e-12);
    }
}
END_TEST

/* True where a face blocks a ray, in double. */
static bool is_blocked(const quads *q, const double from[3], const double direction[3], double *margin) {
    bool blocked = false;
    for (size_t j = 0; j < q->n; j++) {
        const double(*corner)[3] = q->vertices + 4 * j;
        double one[3], other[3], normal[3], away[3];
        subtract3(corner[1], corner[0], one);
        subtract3(corner[3], corner[0], other);
        cross3(one, other, normal);
        subtract3(corner[0], from, away);
        const double along = dot3(direction, normal), t = dot3(away, normal) / along;
        if (!(t > 0)) continue;
        for (int d = 0; d < 3; d++) away[d] = t * direction[d] - away[d];
        const double u = dot3(away, one) / dot3(one, one), w = dot3(away, other) / dot3(other, other);
        *margin = fmin(*margin, fmin(fmin(fabs(u), fabs(1 - u)), fmin(fabs(w), fabs(1 - w))));
        blocked = blocked || (u > 0 && u < 1 && w > 0 && w < 1);
    }
    return blocked;
}

/* 40 boxes in the air, receivers between them: the same as by every face; rays past an edge by less than a
 * hundred-thousandth of a face are left out. Some are in the sun, and some are not. */
START_TEST(among_boxes) {
    enum { BOXES = 40, N = 400, SUNS = 20 };
    uint64_t dice = 5;
    placed_receiver r[N];
    size_t sunny = 0, dark = 0;
    static float rows[SUNS][N], again[N];
    double direction[SUNS][3];
    float *seen[SUNS];
    lam_error error = {0};
    shadow_tree *t = NULL;
    sun_places *p = NULL;
    scene.n = 0;
    for (int b = 0; b < BOXES; b++) {
        double from[3], to[3];
        for (int d = 0; d < 3; d++) {
            from[d] = 10 * random_unit(&dice);
            to[d] = from[d] + .5 + random_unit(&dice);
        }
        box(&scene, from, to, true);
    }
    for (int i = 0; i < N; i++)
        r[i] = (placed_receiver){
            .kind = 3, .at = {11 * random_unit(&dice), 11 * random_unit(&dice), 11 * random_unit(&dice)}};
    for (int k = 0; k < SUNS; k++) {
        unit(random_unit(&dice) - .5, random_unit(&dice) - .5, random_unit(&dice), direction[k]);
        seen[k] = rows[k];
    }
    ck_ok(make(&scene, NULL, &t, &error));
    ck_ok(sun_places_create(t, N, r, &p, &error));
    sun_places_find(p, t, 2, SUNS, (const double(*)[3])direction, seen);
    for (int k = 0; k < SUNS; k++) {
        sun_places_find(p, t, 1, 1, (const double(*)[3])(direction + k), (float *[]){again});
        ck_assert(memcmp(again, rows[k], sizeof again) == 0);
        for (int i = 0; i < N; i++) {
            double margin = 1;
            const bool blocked = is_blocked(&scene, r[i].at, direction[k], &margin);
            if (margin < 1e-5) continue;
            ck_assert_float_eq(rows[k][i], blocked ? 0 : .25f);
            sunny += !blocked;
            dark += blocked;
        }
    }
    ck_assert_uint_gt(sunny, 500);
    ck_assert_uint_gt(dark, 500);
    sun_places_free(p);
    shadow_tree_free(t);
}
END_TEST

START_TEST(no_memory) {
    const placed_receiver r = plane(0, 0, 1, 0, 0, 1);
    lam_error error = {0};
    shadow_tree *t = NULL;
    sun_places *p = NULL;
    long failed = 0;
    scene.n = 0;
    box(&scene, (double[]){-.5, -.5, 0}, (double[]){.5, .5, 2}, true);
    ck_ok(make(&scene, NULL, &t, &error));
    for (lam_status status = LAM_ERR_MEMORY; status != LAM_OK; failed++) {
        allocations_left = failed;
        status = sun_places_create(t, 1, &r, &p, &error);
        allocations_left = -1;
        ck_assert(status == LAM_OK || (status == LAM_ERR_MEMORY && p == NULL));
    }
    ck_assert_int_eq(failed, 4);
    sun_places_free(p);
    sun_places_free(NULL);
    shadow_tree_free(t);
}
END_TEST

int main(void) {
    Suite *s = suite_create("sun_places");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, sun_and_shadow);
    tcase_add_test(c, on_faces);
    tcase_add_test(c, behind_a_pane);
    tcase_add_test(c, among_boxes);
    tcase_add_test(c, no_memory);
    suite_add_tcase(s, c);
    return suite_run(s);
}
