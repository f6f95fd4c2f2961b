/* Facets: rays meet the elements of one plane as one facet, and the element is found from the place of the
 * hit. */
#include "solver/base/random.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/scene/facet/facet_grid.h"
#include "support/box.h"
#include "support/suite.h"
#include "support/transport.h"
#include "tests/bench/suites/scenes.h"

static lam_error error;

static double flatness(const mesh *m) {
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    return 0x1p-22 * radius;
}

static facets joined(const mesh *m) {
    facets f;
    ck_assert_msg(facets_join(m, m->n, flatness(m), &f, &error) == LAM_OK, "%s", error.message);
    return f;
}

/* (u, v) of a point in a piece; true if the point is inside. */
static bool in_piece(const mesh *m, const uint32_t piece[4], const double p[3], float *u, float *v) {
    const bool quad = corner_count(piece) == 4;
    const double *o = m->vertices[piece[0]], *a = m->vertices[piece[1]],
                 *b = m->vertices[piece[quad ? 3 : 2]];
    double aa = 0, ab = 0, bb = 0, pa = 0, pb = 0;
    for (int d = 0; d < 3; d++) {
        aa += (a[d] - o[d]) * (a[d] - o[d]);
        ab += (a[d] - o[d]) * (b[d] - o[d]);
        bb += (b[d] - o[d]) * (b[d] - o[d]);
        pa += (p[d] - o[d]) * (a[d] - o[d]);
        pb += (p[d] - o[d]) * (b[d] - o[d]);
    }
    const double det = aa * bb - ab * ab, x = (bb * pa - ab * pb) / det, y = (aa * pb - ab * pa) / det;
    *u = (float)x;
    *v = (float)y;
    return x >= -1e-6 && y >= -1e-6 && (quad ? x <= 1 + 1e-6 && y <= 1 + 1e-6 : x + y <= 1 + 1e-6);
}

/* A point of an element, not on its border. */
static void point_in(const mesh *m, size_t element, uint64_t *state, double p[3]) {
    const size_t corners = mesh_corners(m, element);
    double weight[4], sum = 0;
    for (size_t k = 0; k < corners; k++) sum += weight[k] = .01 + random_lcg_unit(state);
    for (int d = 0; d < 3; d++) {
        p[d] = 0;
        for (size_t k = 0; k < corners; k++)
            p[d] += weight[k] / sum * m->vertices[m->elements[element][k]][d];
    }
}

/* Points of every element lie in a piece of its facet, and are assigned to that element. */
static void check_points(const mesh *m, const facets *f) {
    facet_grids g;
    uint64_t state = 5;
    ck_assert_msg(facet_grids_create(m, f, &g, &error) == LAM_OK, "%s", error.message);
    for (uint32_t i = 0; i < m->n; i++) {
        const uint32_t facet = f->of_element[i];
        const bool alone = f->first[facet + 1] - f->first[facet] == 1;
        for (int repeat = 0; repeat < 4; repeat++) {
            double at[3];
            size_t pieces = 0;
            point_in(m, i, &state, at);
            for (uint32_t p = 0; p < f->n_pieces; p++) {
                float u, v;
                uint32_t found = i;
                if (f->piece_facet[p] != facet || !in_piece(m, f->pieces[p], at, &u, &v)) continue;
                if (!alone) facet_grids_find(&g, 1, &p, &u, &v, &found);
                ck_assert(found == i);
                pieces++;
            }
            ck_assert(pieces > 0);
        }
    }
    facet_grids_free(&g);
}

static double area_of(const mesh *m, const uint32_t piece[4]) {
    double area = 0;
    for (size_t half = 0; half + 2 < corner_count(piece); half++) {
        const double *a = m->vertices[piece[0]], *b = m->vertices[piece[1 + half]],
                     *c = m->vertices[piece[2 + half]];
        double n[3];
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, g = (d + 2) % 3;
            n[d] = (b[e] - a[e]) * (c[g] - a[g]) - (b[g] - a[g]) * (c[e] - a[e]);
        }
        area += .5 * sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    }
    return area;
}

/* Every element has its facet; a facet has the area of its pieces, and its elements face the same way. */
static void check_cover(const mesh *m, const facets *f) {
    size_t elements = 0;
    for (size_t k = 0; k < f->n; k++) {
        double of_elements = 0, of_pieces = 0;
        for (uint32_t i = f->first[k]; i < f->first[k + 1]; i++) {
            const uint32_t element = f->elements[i];
            ck_assert(f->of_element[element] == k);
            of_elements += m->area[element];
            elements++;
            for (int d = 0; d < 3; d++) ck_assert(fabsf(f->normal[k][d] - m->normal[element][d]) < 2e-3f);
        }
        for (size_t p = 0; p < f->n_pieces; p++)
            if (f->piece_facet[p] == k) of_pieces += area_of(m, f->pieces[p]);
        ck_assert_double_eq_tol(of_pieces, of_elements, 1e-6 * of_elements);
    }
    ck_assert_uint_eq(elements, m->n);
}

/* Every side of a piece is the side of another piece in the opposite direction, so that no ray passes between
 * them. */
static void check_closed(const mesh *m, const facets *f) {
    for (size_t p = 0; p < f->n_pieces; p++) {
        const size_t corners = corner_count(f->pieces[p]);
        for (size_t k = 0; k < corners; k++) {
            const double *a = m->vertices[f->pieces[p][k]], *b = m->vertices[f->pieces[p][(k + 1) % corners]];
            size_t mates = 0;
            for (size_t q = 0; q < f->n_pieces; q++) {
                const size_t others = corner_count(f->pieces[q]);
                for (size_t l = 0; l < others; l++)
                    mates += memcmp(m->vertices[f->pieces[q][l]], b, sizeof *m->vertices) == 0 &&
                             memcmp(m->vertices[f->pieces[q][(l + 1) % others]], a, sizeof *m->vertices) == 0;
            }
            ck_assert(mates == 1);
        }
    }
}

/* Every cell of the box has vertices of its own. */
START_TEST(a_box_is_six) {
    const double size[3] = {10, 6, 3};
    mesh m = box_mesh(size, 7, .5f);
    facets f = joined(&m);
    ck_assert_uint_eq(f.n, 6);
    ck_assert_uint_eq(f.n_pieces, 6);
    check_cover(&m, &f);
    check_points(&m, &f);
    check_closed(&m, &f);
    facets_free(&f);
    mesh_free(&m);
}
END_TEST

/* An evenly divided mesh lies in cells that one element fills, so that no search is needed. */
START_TEST(even_divisions_need_no_search) {
    const double size[3] = {10, 6, 3};
    mesh m = box_mesh(size, 7, .5f);
    facets f = joined(&m);
    facet_grids g;
    ck_assert_msg(facet_grids_create(&m, &f, &g, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(g.n_grids, 6);
    ck_assert_uint_eq(g.n_cells, m.n);
    ck_assert_uint_eq(g.n_candidates, 0);
    facet_grids_free(&g);
    facets_free(&f);
    mesh_free(&m);
}
END_TEST

/* Halves every quad, and moves the vertices by a function. */
static mesh bent_box(unsigned divisions, void (*bend)(double p[3])) {
    const double size[3] = {1, 1, 1};
    mesh from = box_mesh(size, divisions, .5f), m = {0};
    for (size_t i = 0; i < from.n; i++) {
        double corner[4][3];
        for (int k = 0; k < 4; k++) {
            memcpy(corner[k], from.vertices[from.elements[i][k]], sizeof corner[k]);
            bend(corner[k]);
        }
        mesh_add_quad(&m, (const double(*)[3])corner);
    }
    m.elements = realloc(m.elements, 2 * m.n * sizeof *m.elements);
    ck_assert_ptr_nonnull(m.elements);
    for (size_t i = 0; i < from.n; i++) {
        const uint32_t *e = m.elements[i], half[4] = {e[2], e[3], e[0], MESH_NO_VERTEX};
        memcpy(m.elements[m.n++], half, sizeof half);
        m.elements[i][3] = MESH_NO_VERTEX;
    }
    mesh_finish(&m, .5f);
    mesh_free(&from);
    return m;
}

static void hills(double p[3]) {
    if (p[2] == 1 && p[0] > 0 && p[0] < 1 && p[1] > 0 && p[1] < 1)
        p[2] += .3 * sin(7 * p[0]) * cos(5 * p[1]) * p[0];
}

/* A rough ceiling stays as it is: walls keep the corners that they share with it, and no other corners. */
START_TEST(walls_keep_the_corners_of_what_is_not_joined) {
    enum { DIVISIONS = 9 };
    mesh m = bent_box(DIVISIONS, hills);
    facets f = joined(&m);
    ck_assert_uint_eq(f.n, 5 + 2 * DIVISIONS * DIVISIONS);
    ck_assert_uint_eq(f.n_pieces, 1 + 4 * (2 + DIVISIONS - 1) + 2 * DIVISIONS * DIVISIONS);
    check_cover(&m, &f);
    check_points(&m, &f);
    check_closed(&m, &f);
    facets_free(&f);
    mesh_free(&m);
}
END_TEST

/* Bends below single precision are ignored, larger ones are kept. */
static double rise;

static void roof(double p[3]) {
    if (p[2] == 1 && p[0] > .4 && p[0] < .6) p[2] += rise;
}

START_TEST(a_bend_parts) {
    static const double rises[] = {0, 1e-9, 1e-4, -1e-4};
    rise = rises[_i];
    mesh m = bent_box(12, roof);
    facets f = joined(&m);
    ck_assert_uint_eq(f.n, _i < 2 ? 6 : 10);
    check_cover(&m, &f);
    check_closed(&m, &f);
    facets_free(&f);
    mesh_free(&m);
}
END_TEST

/* Strips side by side whose tops make a bow: each corner is off its neighbours' line by less than the
 * tolerance `flat`, the bow as a whole is off by more. */
START_TEST(a_bow_is_no_line) {
    enum { STRIPS = 20000 };
    mesh m = {0};
    for (int i = 0; i < STRIPS; i++) {
        const double x = (double)i / STRIPS, y = (double)(i + 1) / STRIPS;
        const double strip[4][3] = {
            {x, 0, 0}, {y, 0, 0}, {y, 1 + .04 * y * (1 - y), 0}, {x, 1 + .04 * x * (1 - x), 0}};
        mesh_add_quad(&m, strip);
    }
    mesh_finish(&m, .5f);
    facets f = joined(&m);
    ck_assert_uint_eq(f.n, 1);
    ck_assert_uint_gt(f.n_pieces, 10);
    ck_assert_uint_lt(f.n_pieces, STRIPS / 16);
    check_cover(&m, &f);
    facets_free(&f);
    mesh_free(&m);
}
END_TEST

/* Points beside a piece, where a facet has holes or ends: each is one of the facet's elements all the same.
 */
static void check_beside(const mesh *m, const facets *f) {
    enum { SIDE = 11 };
    facet_grids g;
    ck_assert_msg(facet_grids_create(m, f, &g, &error) == LAM_OK, "%s", error.message);
    for (size_t p = 0; p < f->n_pieces; p++) {
        const uint32_t facet = f->piece_facet[p];
        uint32_t piece[SIDE * SIDE], found[SIDE * SIDE];
        float u[SIDE * SIDE], v[SIDE * SIDE];
        if (f->first[facet + 1] - f->first[facet] == 1) continue;
        for (size_t i = 0; i < SIDE * SIDE; i++) {
            piece[i] = (uint32_t)p;
            u[i] = (float)(i % SIDE) - SIDE / 2;
            v[i] = (float)(i / SIDE) - SIDE / 2;
        }
        facet_grids_find(&g, SIDE * SIDE, piece, u, v, found);
        for (size_t i = 0; i < SIDE * SIDE; i++) {
            ck_assert_uint_lt(found[i], m->n);
            ck_assert_uint_eq(f->of_element[found[i]], facet);
        }
    }
    facet_grids_free(&g);
}

/* The floor of the Cornell box has two holes, and corners of cells on the sides of others. */
START_TEST(a_floor_with_holes) {
    mesh m = {0};
    ck_assert_msg(scene_cornell(2560, &m, &error) == LAM_OK, "%s", error.message);
    facets f = joined(&m);
    ck_assert_uint_lt(f.n, 20);
    ck_assert_uint_lt(f.n_pieces, 40);
    check_cover(&m, &f);
    check_points(&m, &f);
    check_beside(&m, &f);
    facets_free(&f);
    mesh_free(&m);
}
END_TEST

/* The same rays against facets, with and without the flag that the elements go together, and against
 * elements; none leaves a closed scene. */
static void check_rays(const mesh *m, size_t rays, bool closed) {
    visibility *of_facets, *of_elements;
    size_t other = 0, apart = 0, seen = 0;
    ck_assert_msg(visibility_create(m, &of_facets, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(visibility_create_of_elements(m, &of_elements, &error) == LAM_OK, "%s", error.message);
    for (size_t i = 0; i < m->n; i++) {
        element_sampler sampler;
        uint32_t self[VISIBILITY_PACKET];
        for (int k = 0; k < VISIBILITY_PACKET; k++) self[k] = (uint32_t)i;
        element_sampler_init(&sampler, m, of_facets, i, 3);
        for (size_t ray = 0; ray < rays; ray += VISIBILITY_PACKET) {
            ray_packet packet;
            hit_packet a, b, together;
            element_sampler_packet(&sampler, (uint32_t)ray, &packet);
            visibility_cast(of_facets, &packet, VISIBILITY_PACKET, self, 0, &a);
            visibility_cast(of_elements, &packet, VISIBILITY_PACKET, self, 0, &b);
            visibility_cast(of_facets, &packet, VISIBILITY_PACKET, self, VISIBILITY_TOGETHER, &together);
            for (int k = 0; k < VISIBILITY_PACKET; k++) {
                seen += a.element[k] != VISIBILITY_NOTHING;
                other += a.element[k] != b.element[k] || a.back[k] != b.back[k];
                apart += a.element[k] != together.element[k] || a.back[k] != together.back[k];
                ck_assert(!closed || a.element[k] != VISIBILITY_NOTHING);
            }
        }
    }
    ck_assert_uint_gt(seen, 0);
    ck_assert_msg((double)other <= 1e-5 * (double)(m->n * rays), "%zu of %zu rays met another element", other,
                  m->n * rays);
    ck_assert_msg((double)apart <= 1e-5 * (double)(m->n * rays), "%zu of %zu rays together met another",
                  apart, m->n * rays);
    visibility_destroy(of_facets);
    visibility_destroy(of_elements);
}

/* A square as a fan from its middle, whose triangles come in no order: all its edges within have one place.
 */
START_TEST(a_fan_is_one) {
    enum { OF_SIDE = 50, TRIANGLES = 4 * OF_SIDE };
    static const double corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh m = {.n = TRIANGLES, .n_vertices = TRIANGLES + 1};
    m.vertices = calloc(m.n_vertices, sizeof *m.vertices);
    m.elements = calloc(m.n, sizeof *m.elements);
    ck_assert(m.vertices != NULL && m.elements != NULL);
    m.vertices[0][0] = m.vertices[0][1] = .5;
    for (uint32_t k = 0; k < TRIANGLES; k++) {
        const double *from = corner[k / OF_SIDE], *to = corner[(k / OF_SIDE + 1) % 4];
        const double part = (double)(k % OF_SIDE) / OF_SIDE;
        for (int d = 0; d < 2; d++) m.vertices[k + 1][d] = from[d] + part * (to[d] - from[d]);
        const uint32_t triangle[4] = {0, k + 1, (k + 1) % TRIANGLES + 1, MESH_NO_VERTEX};
        memcpy(m.elements[77 * k % TRIANGLES], triangle, sizeof triangle);
    }
    mesh_finish(&m, .5f);
    facets f = joined(&m);
    ck_assert_uint_eq(f.n, 1);
    ck_assert_uint_le(f.n_pieces, 2);
    check_points(&m, &f);
    facets_free(&f);
    mesh_free(&m);
}
END_TEST

START_TEST(rays_meet_the_same_elements) {
    mesh cornell = {0}, houses = {0}, box = bent_box(9, hills);
    ck_assert_msg(scene_cornell(2560, &cornell, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(scene_houses(3, 1, &houses, &error) == LAM_OK, "%s", error.message);
    ck_assert_int_eq(mesh_refine(&houses, &(mesh_refinement){.subdivide_levels = 1}, &error), LAM_OK);
    check_rays(&cornell, 256, false);
    check_rays(&houses, 256, false);
    check_rays(&box, 4096, true);
    mesh_free(&cornell);
    mesh_free(&houses);
    mesh_free(&box);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("facets");
    TCase *cases = tcase_create("facets");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, a_box_is_six);
    tcase_add_test(cases, even_divisions_need_no_search);
    tcase_add_test(cases, walls_keep_the_corners_of_what_is_not_joined);
    tcase_add_loop_test(cases, a_bend_parts, 0, 4);
    tcase_add_test(cases, a_bow_is_no_line);
    tcase_add_test(cases, a_floor_with_holes);
    tcase_add_test(cases, a_fan_is_one);
    tcase_add_test(cases, rays_meet_the_same_elements);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
