/* Shadows of the sun: what a table in the open shades, whatever the threads and the batch; soups of triangles
 * against every triangle by itself; sheets and boxes on a floor; trees that cannot be even. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/shadow/sun_shares.h"
#include "support/failing_memory.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

enum { SIDE = 24, N = SIDE * SIDE + 1, MOST = 4096 };

/* Faces with their own corners each. */
typedef struct model {
    size_t n;
    double vertices[4 * MOST][3];
    uint32_t elements[MOST][4];
    float normal[MOST][3];
} model;

static void add(model *m, int count, const double corner[][3]) {
    uint32_t *e = m->elements[m->n];
    double one[3], other[3], normal[3];
    for (int c = 0; c < 4; c++) {
        e[c] = c < count ? (uint32_t)(4 * m->n) + (uint32_t)c : SHADOW_NO_VERTEX;
        memcpy(m->vertices[4 * m->n + (size_t)c], corner[c < count ? c : 0], sizeof corner[0]);
    }
    subtract3(corner[1], corner[0], one);
    subtract3(corner[2], corner[0], other);
    cross3(one, other, normal);
    const double length = sqrt(dot3(normal, normal));
    for (int d = 0; d < 3; d++) m->normal[m->n][d] = (float)(normal[d] / length);
    m->n++;
}

static shadow_tree *tree_of(const model *m) {
    const shadow_faces f = {.n = m->n,
                            .n_fronts = m->n,
                            .n_vertices = 4 * m->n,
                            .vertices = (const double(*)[3])m->vertices,
                            .elements = (const uint32_t(*)[4])m->elements,
                            .normal = (const float(*)[3])m->normal};
    shadow_tree *t = NULL;
    lam_error error = {0};
    ck_assert_msg(shadow_tree_create(&f, &t, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_le(shadow_tree_bytes(t), shadow_tree_bytes_most(m->n));
    return t;
}

static void rectangle(model *m, const double at[3], const double one[3], const double other[3]) {
    double corner[4][3];
    for (int d = 0; d < 3; d++) {
        corner[0][d] = at[d];
        corner[1][d] = at[d] + one[d];
        corner[2][d] = at[d] + one[d] + other[d];
        corner[3][d] = at[d] + other[d];
    }
    add(m, 4, (const double(*)[3])corner);
}

/* A floor of 24 x 24 squares of 1 m and, 2 m above its middle, a table of 6 x 6 m that faces up. */
static void make_table(model *m) {
    m->n = 0;
    for (int i = 0; i + 1 < N; i++)
        rectangle(m, (double[]){i % SIDE, i / SIDE, 0}, (double[]){1, 0, 0}, (double[]){0, 1, 0});
    rectangle(m, (double[]){9, 9, 2}, (double[]){6, 0, 0}, (double[]){0, 6, 0});
}

/* The part of unit square i that lies from low to high along one axis. */
static double overlap(double low, double high, double i) {
    return fmax(0, fmin(high, i + 1) - fmax(low, i));
}

static model scene;

/* A point p of the floor is shaded where p + 2 d / d_z is on the table. */
START_TEST(shade) {
    static const double ways[][3] = {{0, 0, 1},     {.6, 0, .8}, {-.48, .36, .8},
                                     {.3, -.9, .2}, {0, 0, -1},  {.8, .6, 0}};
    static float seen[MOST];
    make_table(&scene);
    shadow_tree *t = tree_of(&scene);
    for (size_t w = 0; w < sizeof ways / sizeof ways[0]; w++) {
        const double length = sqrt(dot3(ways[w], ways[w]));
        const double d[3] = {ways[w][0] / length, ways[w][1] / length, ways[w][2] / length};
        double shaded = 0;
        sun_shares_find(t, 1, 1, &d, (float *[]){seen});
        for (size_t i = 0; i + 1 < N; i++) {
            const double dx = 2 * d[0] / d[2], dy = 2 * d[1] / d[2];
            const double part = d[2] <= 0 ? 1
                                          : overlap(9 - dx, 15 - dx, (double)(i % SIDE)) *
                                                overlap(9 - dy, 15 - dy, (double)(i / SIDE));
            const double right = fmax(d[2], 0) * (1 - part);
            /* Sure where all of it is one or the other; else of 16 points, which miss a strip of a 16th, or
             * of 128, of which an edge cuts one strip in 11. */
            const double tolerance = part == 0 || part == 1 ? 1e-6 : .1;
            ck_assert_msg(fabs((double)seen[i] - right) <= tolerance, "way %zu, %zu: %g, is %g", w, i,
                          (double)seen[i], right);
            shaded += d[2] > 0 ? 1 - (double)seen[i] / d[2] : 0;
        }
        if (d[2] > .5) ck_assert_double_eq_tol(shaded, 36, .25); /* the whole shadow, of 24 edges' squares */
        ck_assert_double_eq_tol((double)seen[N - 1], fmax(d[2], 0), 1e-6);
    }
    shadow_tree_free(t);
}
END_TEST

/* The table becomes 36 panes, with a sheet's other faces on 12 of them, and another pane stands above it all:
 * squares in the shadow get what both pass, whatever edges the rays meet. Panes alone are a scene, too. */
START_TEST(panes) {
    static const struct group_glass of[] = {{0, 0}, {.78, 1}, {.5, 2}};
    const scene_glass glass = {.of = (struct group_glass[]){of[0], of[1], of[2]}, .by_angle = true};
    static const double d[3] = {.48, .36, .8};
    static uint32_t group[MOST];
    static float seen[MOST];
    make_table(&scene);
    scene.n--;
    for (size_t i = 0; i < scene.n; i++) group[i] = 0;
    for (int k = 0; k < 48; k++) {
        const int sheet = k >= 36;
        const double at[3] = {9 + k % 6, 9 + k / 6 % 6, 2}, x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
        group[scene.n] = 1;
        rectangle(&scene, at, sheet ? y : x, sheet ? x : y);
    }
    group[scene.n] = 2;
    rectangle(&scene, (double[]){-40, -40, 3}, (double[]){100, 0, 0}, (double[]){0, 100, 0});
    for (int alone = 0; alone < 2; alone++) {
        const shadow_faces f = {.n = scene.n,
                                .n_fronts = scene.n,
                                .n_vertices = 4 * scene.n,
                                .vertices = (const double(*)[3])scene.vertices,
                                .elements = (const uint32_t(*)[4])scene.elements,
                                .normal = (const float(*)[3])scene.normal,
                                .glass = &glass,
                                .group = group};
        shadow_tree *t = NULL;
        lam_error error = {0};
        ck_assert_msg(shadow_tree_create(&f, &t, &error) == LAM_OK, "%s", error.message);
        ck_assert_uint_le(shadow_tree_bytes(t), shadow_tree_bytes_most(scene.n));
        ck_assert(shadow_tree_has_panes(t));
        sun_shares_find(t, 1, 1, &d, (float *[]){seen});
        for (size_t i = 0; i + 1 < N; i++) {
            const double part = overlap(9 - 2 * d[0] / d[2], 15 - 2 * d[0] / d[2], (double)(i % SIDE)) *
                                overlap(9 - 2 * d[1] / d[2], 15 - 2 * d[1] / d[2], (double)(i / SIDE));
            const double above = glass_passes(&of[2], true, d[2]), table = glass_passes(&of[1], true, d[2]);
            const double right = d[2] * above * (1 - part + part * table);
            ck_assert_msg(fabs((double)seen[i] - right) <= (part == 0 || part == 1 ? 1e-6 : .1),
                          "%zu: %g, is %g", i, (double)seen[i], right);
        }
        shadow_tree_free(t);
        /* The floor lets light pass, too; it has none below it. */
        for (size_t i = 0; i < scene.n; i++)
            if (group[i] == 0) group[i] = 1;
    }
}
END_TEST

START_TEST(same_bits) {
    enum { WAYS = 7 };
    static float batch[WAYS][MOST], one[MOST];
    double d[WAYS][3];
    float *rows[WAYS];
    make_table(&scene);
    shadow_tree *t = tree_of(&scene);
    for (size_t k = 0; k < WAYS; k++) {
        const double turn = .9 * (double)k;
        d[k][0] = .6 * cos(turn);
        d[k][1] = .6 * sin(turn);
        d[k][2] = .8;
        rows[k] = batch[k];
    }
    sun_shares_find(t, 3, WAYS, (const double(*)[3])d, rows);
    for (size_t k = 0; k < WAYS; k++) {
        sun_shares_find(t, 1, 1, (const double(*)[3])d[k], (float *[]){one});
        ck_assert_mem_eq(one, batch[k], N * sizeof *one);
    }
    shadow_tree_free(t);
}
END_TEST

/* The least distance by which a ray passes a side of a triangle, as a share of the triangle: above 0 inside;
 * -1 where it runs away from it. */
static double inside(const double at[3], const double way[3], const double a[3], const double b[3],
                     const double c[3]) {
    double one[3], other[3], s[3], normal[3], turned[3];
    subtract3(b, a, one);
    subtract3(c, a, other);
    subtract3(at, a, s);
    cross3(one, other, normal);
    const double D = dot3(way, normal);
    cross3(other, way, turned);
    const double u = dot3(s, turned) / D;
    cross3(way, one, turned);
    const double w = dot3(s, turned) / D;
    if (-dot3(s, normal) / D <= 0) return -1;
    return fmin(fmin(u, w), 1 - u - w);
}

/* Every ray of a soup of triangles and quads meets what it meets by itself; rays that pass an edge closely
 * are not asked. */
START_TEST(soup) {
    enum { FACES = 900, RAYS = 4000 };
    uint64_t state = 7;
    size_t blocked = 0, asked = 0;
    scene.n = 0;
    for (int f = 0; f < FACES; f++) {
        double at[3], one[3], other[3];
        for (int d = 0; d < 3; d++) {
            at[d] = random_between(&state, -10, 10);
            one[d] = random_between(&state, -1, 1);
            other[d] = random_between(&state, -1, 1);
        }
        rectangle(&scene, at, one, other);
        if (f % 2 == 0) scene.elements[f][3] = SHADOW_NO_VERTEX;
    }
    shadow_tree *t = tree_of(&scene);
    uint32_t last = 0;
    for (int r = 0; r < RAYS; r++) {
        const size_t own = (size_t)r % FACES;
        double way[3], from[3], middle[3];
        shadow_shape shape;
        for (int d = 0; d < 3; d++) way[d] = random_between(&state, -1, 1);
        const double length = sqrt(dot3(way, way));
        const float(*corner)[3] = shadow_tree_corners(t, own, &shape), *normal = shadow_tree_normal(t, own);
        double facing = 0;
        for (int d = 0; d < 3; d++) facing += way[d] / length * (double)normal[d];
        float direction[3];
        shadow_rays rays = {.n = 1};
        for (int d = 0; d < 3; d++) {
            way[d] *= (facing < 0 ? -1 : 1) / length;
            direction[d] = (float)way[d];
            rays.at[d][0] = (corner[0][d] + corner[1][d] + corner[2][d]) / 3;
            middle[d] = scene.vertices[0][d] - (double)shadow_tree_corners(t, 0, &shape)[0][d];
            from[d] = (double)rays.at[d][0] + middle[d];
        }
        double most = -1;
        bool sure = true;
        for (size_t f = 0; f < FACES; f++) {
            const double(*c)[3] = (const double(*)[3])scene.vertices + 4 * f;
            if (f == own) continue;
            for (int half = 0; half < (f % 2 == 0 ? 1 : 2); half++) {
                const double in = inside(from, way, c[0], c[1 + half], c[2 + half]);
                most = fmax(most, in);
                sure = sure && fabs(in) > 1e-4;
            }
        }
        if (!sure) continue;
        asked++;
        blocked += most > 0;
        ck_assert_msg(shadow_tree_open(t, own, direction, &rays, &last) == (most > 0 ? 0u : 1u), "ray %d", r);
    }
    ck_assert_uint_gt(asked, RAYS / 2);
    ck_assert_uint_gt(blocked, RAYS / 10);
    shadow_tree_free(t);
}
END_TEST

/* Turns and rounds the model, as files with few decimals do. */
static void turn(model *m, uint64_t seed, double decimals) {
    double axis[3] = {random_between(&seed, -1, 1), random_between(&seed, -1, 1), 1.3};
    const double angle = random_between(&seed, 0, 3), length = sqrt(dot3(axis, axis));
    for (int d = 0; d < 3; d++) axis[d] /= length;
    for (size_t v = 0; v < 4 * m->n; v++) {
        double *x = m->vertices[v], across[3];
        const double along = dot3(axis, x);
        cross3(axis, x, across);
        for (int d = 0; d < 3; d++) {
            x[d] = x[d] * cos(angle) + across[d] * sin(angle) + axis[d] * along * (1 - cos(angle));
            x[d] = round(x[d] * decimals) / decimals;
        }
    }
    for (size_t i = 0; i < m->n; i++) {
        double one[3], other[3], normal[3];
        const double(*c)[3] = (const double(*)[3])m->vertices + 4 * i;
        subtract3(c[1], c[0], one);
        subtract3(c[2], c[0], other);
        cross3(one, other, normal);
        const double size = sqrt(dot3(normal, normal));
        for (int d = 0; d < 3; d++) m->normal[i][d] = (float)(normal[d] / size);
    }
}

/* A sheet of two reversed faces, one larger, sees the sun on the side towards it, at any rotation and
 * decimals.
 */
START_TEST(sheets) {
    for (uint64_t k = 0; k < 60; k++) {
        scene.n = 0;
        rectangle(&scene, (double[]){3, 1, 2}, (double[]){1, 0, 0}, (double[]){0, 1, 0});
        rectangle(&scene, (double[]){2.6, .7, 2}, (double[]){0, 1.9, 0}, (double[]){1.7, 0, 0});
        rectangle(&scene, (double[]){20, 1, 2}, (double[]){1, 0, 0}, (double[]){0, 1, 0}); /* far away */
        turn(&scene, k, k % 2 == 0 ? 1e5 : 1e6);
        shadow_tree *t = tree_of(&scene);
        float seen[3];
        for (int side = 0; side < 2; side++) {
            double d[3];
            for (int c = 0; c < 3; c++) d[c] = (double)scene.normal[side][c];
            sun_shares_find(t, 1, 1, (const double(*)[3])d, (float *[]){seen});
            ck_assert_msg(fabsf(seen[side] - 1) < 1e-5f, "rotation %d, side %d: %g", (int)k, side,
                          (double)seen[side]);
            ck_assert(seen[1 - side] == 0);
        }
        shadow_tree_free(t);
    }
}
END_TEST

/* Faces all in one place, and faces each twice as far as the one before, make trees too. */
START_TEST(uneven) {
    for (int far = 0; far < 2; far++) {
        static float seen[MOST];
        double place = 1e-3;
        scene.n = 0;
        for (int i = 0; i < (far ? 60 : 2000); i++, place *= far ? 2 : 1)
            rectangle(&scene, (double[]){place, 0, 0}, (double[]){place / 8, 0, 0}, (double[]){0, place, 0});
        shadow_tree *t = tree_of(&scene);
        sun_shares_find(t, 1, 1, (const double[][3]){{0, 0, 1}}, (float *[]){seen});
        for (size_t i = 0; i < scene.n; i++) ck_assert(seen[i] == 1);
        shadow_tree_free(t);
    }
}
END_TEST

START_TEST(no_memory) {
    make_table(&scene);
    static const uint32_t group[MOST] = {1};
    const scene_glass glass = {.of = (struct group_glass[]){{0, 0}, {.78, 1}}};
    const shadow_faces f = {.n = scene.n,
                            .n_fronts = scene.n,
                            .n_vertices = 4 * scene.n,
                            .vertices = (const double(*)[3])scene.vertices,
                            .elements = (const uint32_t(*)[4])scene.elements,
                            .normal = (const float(*)[3])scene.normal,
                            .glass = &glass,
                            .group = group};
    shadow_tree *t = NULL;
    lam_error error = {0};
    long failed = 0;
    for (lam_status status = LAM_ERR_MEMORY; status != LAM_OK; failed++) {
        allocations_left = failed;
        status = shadow_tree_create(&f, &t, &error);
        allocations_left = -1;
        ck_assert(status == LAM_OK || (status == LAM_ERR_MEMORY && t == NULL));
    }
    ck_assert_int_gt(failed, 5);
    shadow_tree_free(t);
    shadow_tree_free(NULL);
}
END_TEST

int main(void) {
    Suite *s = suite_create("sun_shares");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, shade);
    tcase_add_test(c, panes);
    tcase_add_test(c, same_bits);
    tcase_add_test(c, soup);
    tcase_add_test(c, sheets);
    tcase_add_test(c, uneven);
    tcase_add_test(c, no_memory);
    suite_add_tcase(s, c);
    return suite_run(s);
}
