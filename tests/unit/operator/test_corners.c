/* Values at the corners that elements share: constant and linear light, creases, groups, T-junctions. */
#include "solver/operator/corners/corner_plan.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 64 };

/* A mesh of planar quads with vertices of their own, which welding joins. */
typedef struct patchwork {
    double vertices[4 * MOST][3];
    uint32_t elements[MOST][4];
    float normal[MOST][3];
    uint32_t group[MOST];
    double centre[MOST][3];
    corner_mesh m;
} patchwork;

/* A parallelogram at `at`, spanned by two edges. */
static void add(patchwork *p, uint32_t group, const double at[3], const double u[3], const double v[3]) {
    const size_t i = p->m.n++;
    double normal[3], length = 0;
    for (int k = 0; k < 4; k++)
        for (int d = 0; d < 3; d++) {
            p->vertices[4 * i + (size_t)k][d] = at[d] + (k == 1 || k == 2) * u[d] + (k >= 2) * v[d];
            p->elements[i][k] = (uint32_t)(4 * i) + (uint32_t)k;
        }
    for (int d = 0; d < 3; d++) {
        normal[d] = u[(d + 1) % 3] * v[(d + 2) % 3] - u[(d + 2) % 3] * v[(d + 1) % 3];
        length += normal[d] * normal[d];
        p->centre[i][d] = at[d] + (u[d] + v[d]) / 2;
    }
    for (int d = 0; d < 3; d++) p->normal[i][d] = (float)(normal[d] / sqrt(length));
    p->group[i] = group;
    p->m = (corner_mesh){.n_vertices = 4 * p->m.n,
                         .n = p->m.n,
                         .vertices = (const double(*)[3])p->vertices,
                         .elements = (const uint32_t(*)[4])p->elements,
                         .normal = (const float(*)[3])p->normal,
                         .group = p->group};
}

static void add_flat(patchwork *p, uint32_t group, double x, double y, double width, double height) {
    add(p, group, (const double[3]){x, y, 0}, (const double[3]){width, 0, 0},
        (const double[3]){0, height, 0});
}

typedef struct made {
    corner_nodes nodes;
    corner_plan plan;
} made;

static made make(const patchwork *p) {
    made out;
    lam_error error = {.message = ""};
    ck_ok(corner_nodes_create(&p->m, &out.nodes, &error));
    ck_ok(corner_plan_create(&p->m, &out.nodes, &out.plan, &error));
    return out;
}

static void made_free(made *s) {
    corner_nodes_free(&s->nodes);
    corner_plan_free(&s->plan);
}

static void apply(const made *s, const float *x, float *out) {
    float lost[MOST];
    for (size_t i = 0; i < s->plan.n; i++) lost[i] = x[i];
    corner_plan_apply(&s->plan, 1, lost, out);
}

/* A floor of 4 by 4 with T-junctions: tiles of 2, 1 and .5. */
static void make_floor(patchwork *p, uint32_t group) {
    add_flat(p, group, 0, 0, 2, 2);
    for (int k = 0; k < 4; k++) add_flat(p, group, 2 + k % 2, k / 2, 1, 1);
    for (int k = 0; k < 16; k++) add_flat(p, group, .5 * (k % 4), 2 + .5 * (k / 4), .5, .5);
    add_flat(p, group, 2, 2, 2, 2);
}

static double linear(const double at[3]) {
    return 40 + 3 * at[0] - 2 * at[1];
}

/* Weights of a row sum to 1 but for their rounding and that of sums of at most 16, each 6e-8. */
START_TEST(constant_light_is_kept) {
    patchwork p = {.m = {.n = 0}};
    make_floor(&p, 0);
    add(&p, 0, (const double[3]){0, 4, 0}, (const double[3]){4, 0, 0}, (const double[3]){0, 0, 3});
    made s = make(&p);
    float x[MOST], out[4 * MOST];
    for (size_t i = 0; i < p.m.n; i++) x[i] = 7;
    apply(&s, x, out);
    for (size_t j = 0; j < s.plan.n_nodes; j++) ck_assert_double_eq_tol((double)out[j], 7, 7e-6);
    made_free(&s);
}
END_TEST

/* Linear light has its value at every corner. */
static void check_linear(const made *s, const patchwork *p, const float *out) {
    for (size_t j = 0; j < s->plan.n_nodes; j++) {
        const double want = linear(p->vertices[s->nodes.vertex[j]]);
        ck_assert_double_eq_tol((double)out[j], want, 1e-5 * want);
    }
}

/* The largest value is 52, of which singles hold 4e-6; sums of up to 96 weights of magnitude 4 in all. */
START_TEST(linear_light_is_reproduced) {
    patchwork p = {.m = {.n = 0}};
    make_floor(&p, 0);
    made s = make(&p);
    float x[MOST], out[4 * MOST];
    for (size_t i = 0; i < p.m.n; i++) x[i] = (float)linear(p.centre[i]);
    apply(&s, x, out);
    check_linear(&s, &p, out);
    made_free(&s);
}
END_TEST

/* The mean over each element of a light that bends is its number, to the order that one pass leaves: the
 * bend of x^2 per element is 1, and the mean of corners that are plain means is off by a half. */
START_TEST(means_are_kept) {
    patchwork p = {.m = {.n = 0}};
    for (int k = 0; k < 64; k++) add_flat(&p, 0, k % 8, k / 8, 1, 1);
    made s = make(&p);
    float x[MOST], out[4 * MOST];
    for (size_t i = 0; i < p.m.n; i++) x[i] = (float)(p.centre[i][0] * p.centre[i][0] + 1. / 12);
    apply(&s, x, out);
    for (size_t i = 0; i < p.m.n; i++) {
        double mean = 0;
        for (int k = 0; k < 4; k++) mean += (double)out[s.nodes.corner[i][k]] / 4;
        if ((i % 8 == 3 || i % 8 == 4) && (i / 8 == 3 || i / 8 == 4))
            ck_assert_double_eq_tol(mean, (double)x[i], 1e-5);
    }
    made_free(&s);
}
END_TEST

/* An edge of 90 degrees, and one between two groups of a plane. */
START_TEST(surfaces_and_groups_do_not_mix) {
    patchwork p = {.m = {.n = 0}};
    const double e[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    add_flat(&p, 0, 0, 0, 1, 1);
    add(&p, 0, e[0], e[1], e[2]);
    add_flat(&p, 1, -1, 0, 1, 1);
    made s = make(&p);
    const float x[3] = {4, 40, 400};
    float out[4 * MOST];
    ck_assert_uint_eq(s.plan.n_nodes, 12);
    apply(&s, x, out);
    for (size_t i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++) ck_assert_float_eq(out[s.nodes.corner[i][k]], x[i]);
    for (size_t j = 0; j < s.plan.n_nodes; j++) /* by group */
        ck_assert_uint_eq(p.group[s.nodes.element[j]], j < 8 ? 0 : 1);
    made_free(&s);
}
END_TEST

static void check_links(const made *s, const float *out) {
    for (size_t k = 0; k < s->plan.n_links; k++) {
        const corner_link *link = &s->plan.links[k];
        ck_assert_float_eq(out[link->node], (1 - link->t) * out[link->a] + link->t * out[link->b]);
    }
}

/* The dark floor below a leg, in a corner of its tile, darkens no corner of what is seen. */
START_TEST(buried_elements_stay_apart) {
    patchwork p = {.m = {.n = 0}};
    bool buried[MOST] = {false};
    make_floor(&p, 0);
    const size_t n_seen = p.m.n;
    add_flat(&p, 0, 4, 0, .1, .1);
    add_flat(&p, 0, 4.1, 0, 1.9, .1);
    add_flat(&p, 0, 4, .1, 2, 1.9);
    buried[n_seen] = true;
    p.m.buried = buried;
    made s = make(&p);
    float x[MOST], out[4 * MOST];
    for (size_t i = 0; i < p.m.n; i++) x[i] = buried[i] ? 0 : 7;
    apply(&s, x, out);
    for (size_t i = 0; i < p.m.n; i++)
        for (int k = 0; k < 4; k++)
            ck_assert_double_eq_tol((double)out[s.nodes.corner[i][k]], (double)x[i], 7e-6);
    made_free(&s);
}
END_TEST

/* Corners that hang are on the line of the edge, also of light that jumps, and polygons have them. */
START_TEST(hanging_corners_are_on_their_edge) {
    patchwork p = {.m = {.n = 0}};
    make_floor(&p, 0);
    made s = make(&p);
    float x[MOST], out[4 * MOST];
    for (size_t i = 0; i < p.m.n; i++) x[i] = (float)((i * 7) % 5);
    apply(&s, x, out);
    /* The tile at 0 has one in its right edge and three above it, that at 2, 2 has one below and three at its
     * left. */
    ck_assert_uint_eq(s.plan.n_links, 8);
    ck_assert_uint_eq(s.nodes.ring_start[1], 8);
    check_links(&s, out);
    for (size_t j = 0; j < s.plan.n_nodes; j++) ck_assert_float_ge(out[j], 0);
    made_free(&s);
}
END_TEST

/* A wall of another group with a corner inside the floor's edge: the floor has a node of its own there. */
START_TEST(corners_of_other_surfaces_are_in_polygons) {
    patchwork p = {.m = {.n = 0}};
    add_flat(&p, 0, 0, 0, 2, 2);
    for (int k = 0; k < 2; k++)
        add(&p, 1, (const double[3]){2, k, 0}, (const double[3]){0, 1, 0}, (const double[3]){0, 0, 1});
    made s = make(&p);
    const float x[3] = {1, 5, 6};
    float out[4 * MOST];
    apply(&s, x, out);
    ck_assert_uint_eq(s.nodes.ring_start[1], 5);
    ck_assert_uint_eq(s.plan.n_nodes, 5 + 6);
    for (size_t k = 0; k < 5; k++) ck_assert_float_eq(out[s.nodes.ring[k]], 1);
    ck_assert(s.nodes.inside[2]);
    made_free(&s);
}
END_TEST

/* Parts of 1/3 meet parts of 1/4: each corner of one side hangs in an edge of the other side, and so on
 * itself; one is made free. All values are means of the elements' then. */
START_TEST(cycles_of_hanging_corners_end) {
    patchwork p = {.m = {.n = 0}};
    for (int k = 0; k < 3; k++) add_flat(&p, 0, 0, 4 * k, 1, 4);
    for (int k = 0; k < 4; k++) add_flat(&p, 0, 1, 3 * k, 1, 3);
    made s = make(&p);
    float x[MOST], out[4 * MOST];
    for (size_t i = 0; i < p.m.n; i++) x[i] = (float)linear(p.centre[i]);
    ck_assert_uint_gt(s.plan.n_links, 2);
    apply(&s, x, out);
    check_links(&s, out);
    check_linear(&s, &p, out);
    made_free(&s);
}
END_TEST

/* A spiral of squares, each half as wide as the one before, whose first corner is in the middle of an edge
 * that begins at the first corner of that one: each hangs one deeper than the last, but for the one beyond
 * CORNER_DEPTH. */
START_TEST(chains_have_an_end) {
    patchwork p = {.m = {.n = 0}};
    double at[3] = {0, 0, 0}, along[3] = {16, 0, 0};
    for (int k = 0; k < 12; k++) {
        add(&p, 0, at, along, (const double[3]){-along[1], along[0], 0});
        for (int d = 0; d < 2; d++) at[d] += along[d] / 2;
        const double next[2] = {along[1] / 2, -along[0] / 2};
        memcpy(along, next, sizeof next);
    }
    made s = make(&p);
    float x[MOST], out[4 * MOST];
    for (size_t i = 0; i < p.m.n; i++) x[i] = (float)i;
    apply(&s, x, out);
    ck_assert_int_eq(CORNER_DEPTH, 6);
    ck_assert_uint_eq(s.plan.n_links, 10);
    check_links(&s, out);
    made_free(&s);
}
END_TEST

/* The values of the matrix, whose parts have a bound at 0 each. */
static void check_matrix(const corner_matrix *m, size_t n, size_t n_nodes, const float *x, const float *out,
                         double tolerance) {
    ck_assert_uint_eq(m->n_nodes, n_nodes);
    for (size_t j = 0; j < n_nodes; j++) {
        double value = 0;
        for (uint32_t p = m->parts[j]; p < m->parts[j + 1]; p++) {
            double sum = 0;
            for (uint32_t k = m->rows.first[p]; k < m->rows.first[p + 1]; k++) {
                ck_assert_uint_lt(m->rows.columns[k], n);
                sum += (double)m->rows.weights[k] * (double)x[m->rows.columns[k]];
            }
            value += fmax(sum, 0);
        }
        ck_assert_double_eq_tol(value, (double)out[j], tolerance);
    }
}

/* <g, S x> = <S^T g, x>, and the matrix as a whole is the product: where light is far above 0 no bound
 * acts. */
START_TEST(transpose_and_matrix_agree) {
    patchwork p = {.m = {.n = 0}};
    make_floor(&p, 0);
    made s = make(&p);
    const size_t n = p.m.n, n_nodes = s.plan.n_nodes;
    float x[MOST], out[4 * MOST], g[4 * MOST] = {0}, lost[4 * MOST], w[MOST] = {0}, work[5 * MOST];
    lam_error error = {.message = ""};
    corner_matrix whole = {.n_nodes = 0};
    for (size_t i = 0; i < n; i++) x[i] = 100 + (float)((i * 7) % 5);
    for (size_t j = 0; j < n_nodes; j++) g[j] = (float)((j * 5) % 7) - 3;
    apply(&s, x, out);
    memcpy(lost, g, n_nodes * sizeof *g);
    corner_plan_transpose(&s.plan, 1, lost, w, work);
    double left = 0, right = 0;
    for (size_t j = 0; j < n_nodes; j++) left += (double)g[j] * (double)out[j];
    for (size_t i = 0; i < n; i++) right += (double)w[i] * (double)x[i];
    ck_assert_double_eq_tol(left, right, 1e-2); /* of sums of some 1e4 */
    ck_ok(corner_plan_expand(&s.plan, 1000000, &whole, &error));
    check_matrix(&whole, n, n_nodes, x, out, 1e-3);
    /* Darkness beside much light: bounds act, also at one end of an edge that corners hang in. */
    size_t bound = 0;
    for (size_t lit = 0; lit < n; lit++) {
        for (size_t i = 0; i < n; i++) x[i] = i == lit ? 100 : 0;
        apply(&s, x, out);
        for (size_t k = 0; k < s.plan.n_links; k++)
            bound += (out[s.plan.links[k].a] > 0) != (out[s.plan.links[k].b] > 0);
        check_matrix(&whole, n, n_nodes, x, out, 1e-3);
    }
    ck_assert_uint_gt(bound, 0);
    corner_matrix_free(&whole);
    made_free(&s);
}
END_TEST

/* Several vectors have the bits of each alone; light below 0 stays, but not below the least number. */
START_TEST(vectors_do_not_depend_on_others) {
    patchwork p = {.m = {.n = 0}};
    make_floor(&p, 0);
    made s = make(&p);
    const size_t n = p.m.n, n_nodes = s.plan.n_nodes;
    static float x[7 * MOST], out[7 * 4 * MOST], one[4 * MOST], lost[7 * MOST];
    for (size_t i = 0; i < 7 * n; i++) x[i] = sinf((float)(i * i)) - (i >= 3 * n);
    for (size_t i = 0; i < n; i++) x[i] = fmaxf(x[i], 0);
    memcpy(lost, x, sizeof x);
    corner_plan_apply(&s.plan, 7, lost, out);
    for (size_t v = 0; v < 7; v++) {
        float least = 0;
        for (size_t i = 0; i < n; i++) least = fminf(least, x[v * n + i]);
        apply(&s, x + v * n, one);
        ck_assert_mem_eq(one, out + v * n_nodes, n_nodes * sizeof *one);
        for (size_t j = 0; j < n_nodes; j++) ck_assert_float_ge(one[j], least);
    }
    made_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("corners");
    TCase *tests = tcase_create("corners");
    tcase_add_test(tests, constant_light_is_kept);
    tcase_add_test(tests, linear_light_is_reproduced);
    tcase_add_test(tests, means_are_kept);
    tcase_add_test(tests, surfaces_and_groups_do_not_mix);
    tcase_add_test(tests, buried_elements_stay_apart);
    tcase_add_test(tests, hanging_corners_are_on_their_edge);
    tcase_add_test(tests, corners_of_other_surfaces_are_in_polygons);
    tcase_add_test(tests, cycles_of_hanging_corners_end);
    tcase_add_test(tests, chains_have_an_end);
    tcase_add_test(tests, transpose_and_matrix_agree);
    tcase_add_test(tests, vectors_do_not_depend_on_others);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
