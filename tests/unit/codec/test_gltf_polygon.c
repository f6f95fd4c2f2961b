/* Triangles of elements with corners inside their edges: each has an area, and together they are the element.
 */
#include "solver/codec/gltf/gltf_polygon.h"
#include "support/suite.h"

#include <math.h>

enum { MOST = 32 };

/* Corners and places inside edges, `within[e]` of edge e. */
static size_t place(size_t n_corners, const double (*corners)[2], const unsigned *within, double (*at)[2],
                    bool *inside) {
    size_t count = 0;
    for (size_t e = 0; e < n_corners; e++)
        for (unsigned k = 0; k <= within[e]; k++, count++) {
            const double t = k / (within[e] + 1.);
            const size_t next = (e + 1) % n_corners;
            for (int d = 0; d < 2; d++) at[count][d] = corners[e][d] + t * (corners[next][d] - corners[e][d]);
            inside[count] = k > 0;
        }
    return count;
}

static double area_of(const double (*at)[2], const uint32_t t[3]) {
    const double *a = at[t[0]], *b = at[t[1]], *c = at[t[2]];
    return ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
}

static void check(size_t n_corners, const double (*corners)[2], const unsigned *within, double area) {
    double at[MOST][2], sum = 0;
    bool inside[MOST], met[MOST] = {false};
    uint32_t next[MOST], triangles[MOST][3];
    const size_t count = place(n_corners, corners, within, at, inside);
    gltf_polygon(count, inside, next, triangles);
    for (size_t t = 0; t + 2 < count; t++) {
        const double own = area_of((const double(*)[2])at, triangles[t]);
        ck_assert_double_gt(own, 1e-3);
        sum += own;
        for (int k = 0; k < 3; k++) met[triangles[t][k]] = true;
    }
    ck_assert_double_eq_tol(sum, area, 1e-12);
    for (size_t k = 0; k < count; k++) ck_assert(met[k]);
}

START_TEST(every_edge_may_have_some) {
    const double square[4][2] = {{0, 0}, {2, 0}, {2, 2}, {0, 2}}, triangle[3][2] = {{0, 0}, {2, 0}, {0, 2}};
    for (unsigned code = 0; code < 256; code++) {
        const unsigned within[4] = {code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6};
        check(4, square, within, 4);
        if (code < 64) check(3, triangle, within, 2);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("gltf_polygon");
    TCase *tests = tcase_create("gltf_polygon");
    tcase_add_test(tests, every_edge_may_have_some);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
