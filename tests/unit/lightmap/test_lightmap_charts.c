/* Charts of a box and of slanting triangles: places and points are each other's inverse, areas of texels are
 * those of elements, and texels have their limit. */
#include "solver/base/vector3.h"
#include "solver/lightmap/lightmap_texels.h"
#include "solver/lightmap/plane_parts.h"
#include "support/box.h"
#include "support/suite.h"

/* A right triangle that leans, and a sliver beside it. */
static mesh triangles(void) {
    mesh m = {0};
    static const double corners[2][4][3] = {{{0, 0, 0}, {3, 0, 1}, {3, 0, 1}, {0, 2, 0}},
                                            {{5, 0, 0}, {9, .013, 0}, {9, .013, 0}, {5, .02, 0}}};
    for (int k = 0; k < 2; k++) mesh_add_quad(&m, corners[k]);
    for (int k = 0; k < 2; k++) {
        m.elements[k][2] = m.elements[k][3];
        m.elements[k][3] = MESH_NO_VERTEX;
    }
    mesh_finish(&m, .5f);
    return m;
}

/* All corners lie in the rectangle of their chart, whose map gives them back; sums of areas are those of
 * elements; the point of each texel lies in it, and in the plane of its element. */
static void examine(const mesh *m, const lightmap_charts *c) {
    lam_error error = {0};
    lightmap_texels t = {.n = 0};
    ck_ok(lightmap_texels_find(m, c, &t, &error));
    double *area = calloc(c->n, sizeof *area), *wanted = calloc(c->n, sizeof *wanted);
    ck_assert(area != NULL && wanted != NULL);
    for (size_t i = 0; i < m->n; i++) {
        const lightmap_chart *of = &c->charts[c->chart_of[i]];
        wanted[c->chart_of[i]] += m->area[i];
        for (size_t k = 0; k < mesh_corners(m, i); k++) {
            const double *at = m->vertices[m->elements[i][k]];
            double place[2], again[3];
            lightmap_place(of, at, place);
            lightmap_point(of, place, again);
            ck_assert(place[0] >= (double)of->x - 1e-9 && place[0] <= (double)(of->x + of->width) + 1e-9);
            ck_assert(place[1] >= (double)of->y - 1e-9 && place[1] <= (double)(of->y + of->height) + 1e-9);
            /* Normals are in single precision, and faces some metres large. */
            for (int d = 0; d < 3; d++) ck_assert_double_eq_tol(again[d], at[d], 1e-6);
        }
    }
    for (size_t k = 0; k < t.n; k++) {
        const lightmap_texel *of = &t.texels[k];
        const size_t chart = c->chart_of[of->element];
        const double *corner = m->vertices[m->elements[of->element][0]];
        double place[2], way[3], normal[3];
        ck_assert(k == 0 || of->pixel > t.texels[k - 1].pixel);
        area[chart] += of->area;
        lightmap_place(&c->charts[chart], of->at, place);
        ck_assert_uint_eq((size_t)floor(place[1]) * c->width + (size_t)floor(place[0]), of->pixel);
        for (int d = 0; d < 3; d++) normal[d] = (double)m->normal[of->element][d];
        subtract3(of->at, corner, way);
        ck_assert_double_eq_tol(dot3(way, normal), 0, 1e-6);
    }
    for (size_t k = 0; k < c->n; k++) {
        ck_assert_double_eq_tol(area[k], wanted[k], 1e-6 * wanted[k]);
        ck_assert_double_le(c->charts[k].step[0], c->texel * (1 + 1e-6));
        ck_assert_double_le(c->charts[k].step[1], c->texel * (1 + 1e-6));
    }
    free(area);
    free(wanted);
    free(t.texels);
}

START_TEST(a_box_has_six) {
    const double size[3] = {4, 3, 2};
    lam_error error = {0};
    lightmap_charts c = {.n = 0};
    mesh m = box_mesh(size, 5, .5f);
    ck_ok(lightmap_charts_make(&m, .1, &c, &error));
    ck_assert_uint_eq(c.n, 6);
    for (size_t k = 0; k < c.n; k++) {
        const lightmap_chart *of = &c.charts[k];
        /* 40 x 30, 40 x 20, 30 x 20 texels, the longer side along rows */
        ck_assert(of->width > of->height && (of->width + of->height) % 10 == 0);
    }
    examine(&m, &c);
    lightmap_charts_free(&c);
    /* The preset is half the root of the mean area: 150 elements of 52 m^2. */
    ck_ok(lightmap_charts_make(&m, 0, &c, &error));
    ck_assert_double_eq_tol(c.texel, .5 * sqrt(52. / 150), 1e-9);
    ck_assert(!c.enlarged);
    examine(&m, &c);
    lightmap_charts_free(&c);
    mesh_free(&m);
}
END_TEST

START_TEST(slanting_ones_and_slivers_are_covered) {
    lam_error error = {0};
    lightmap_charts c = {.n = 0};
    lightmap_texels t = {.n = 0};
    mesh m = triangles();
    ck_ok(lightmap_charts_make(&m, .17, &c, &error));
    ck_assert_uint_eq(c.n, 2);
    examine(&m, &c);
    lightmap_charts_free(&c);
    /* A texel larger than both: one each, whose point is a centroid. */
    ck_ok(lightmap_charts_make(&m, 100, &c, &error));
    ck_ok(lightmap_texels_find(&m, &c, &t, &error));
    ck_assert_uint_eq(t.n, 2);
    examine(&m, &c);
    free(t.texels);
    lightmap_charts_free(&c);
    mesh_free(&m);
}
END_TEST

/* A row of strips that turn by less than the flatness of a face each, and by 5 degrees in all, is one part
 * for each; unturned they are one. */
START_TEST(what_bends_is_not_plane) {
    enum { N = 200 };
    lam_error error = {0};
    uint32_t part[N];
    size_t n_parts;
    for (int bends = 0; bends < 2; bends++) {
        mesh m = {0};
        double x = 0, z = 0, angle = 0;
        for (int k = 0; k < N; k++) {
            const double next_x = x + .01 * cos(angle), next_z = z + .01 * sin(angle);
            mesh_add_quad(
                &m, (const double[4][3]){{x, 0, z}, {next_x, 0, next_z}, {next_x, 1, next_z}, {x, 1, z}});
            x = next_x;
            z = next_z;
            if (bends) angle += .0004;
        }
        mesh_finish(&m, .5f);
        ck_ok(plane_parts_find(&m, part, &n_parts, &error));
        ck_assert_uint_eq(n_parts, bends ? N : 1);
        /* Groups are parts of their own. */
        for (int k = 0; k < N; k++) m.group[k] = k % 2;
        ck_ok(plane_parts_find(&m, part, &n_parts, &error));
        ck_assert_uint_eq(n_parts, N);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(texels_have_a_limit) {
    const double size[3] = {4, 3, 2};
    lam_error error = {0};
    lightmap_charts c = {.n = 0};
    mesh m = box_mesh(size, 2, .5f);
    ck_assert_int_eq(lightmap_charts_make(&m, .001, &c, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "--texel 0.001"));
    const char *give = strstr(error.message, "give ");
    ck_assert_ptr_nonnull(give);
    const double fits = strtod(give + 5, NULL);
    /* 52 m^2 in 4 Mi texels are .0035 m, without borders and what shelves leave. */
    ck_assert(fits > .0035 && fits < .005);
    ck_ok(lightmap_charts_make(&m, fits, &c, &error));
    lightmap_charts_free(&c);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("charts of lightmaps");
    TCase *c = tcase_create("all");
    tcase_add_test(c, a_box_has_six);
    tcase_add_test(c, slanting_ones_and_slivers_are_covered);
    tcase_add_test(c, what_bends_is_not_plane);
    tcase_add_test(c, texels_have_a_limit);
    suite_add_tcase(s, c);
    return suite_run(s);
}
