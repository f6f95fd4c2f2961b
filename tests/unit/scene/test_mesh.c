#include "support/suite.h"

#include "solver/base/scene/scene_buried.h"
#include "solver/scene/mesh.h"
#include "support/scene.h"
#include "support/solids.h"

START_TEST(areas_and_normals_are_exact) {
    mesh m = make_cube();
    const float normals[6][3] = {{0, 0, -1}, {0, 0, 1}, {-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}};
    for (size_t i = 0; i < 6; i++) {
        ck_assert_double_eq(m.area[i], 1);
        for (int k = 0; k < 3; k++) ck_assert_float_eq(m.normal[i][k], normals[i][k]);
    }
    mesh_free(&m);
    m = make_octahedron();
    for (size_t i = 0; i < 8; i++) ck_assert_double_eq_tol(m.area[i], sqrt(3) / 2, 1e-15);
    mesh_free(&m);
}
END_TEST

START_TEST(measuring_refuses_bad_elements) {
    mesh m = make_cube();
    lam_error error;
    m.elements[4][2] = 8;
    const double *area = m.area;
    ck_assert_int_eq(mesh_measure(&m, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "element 4"));
    ck_assert_ptr_eq(m.area, area);
    memcpy(m.elements[4], (uint32_t[4]){0, 1, 1, MESH_NO_VERTEX}, sizeof m.elements[4]);
    ck_assert_int_eq(mesh_measure(&m, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "element 4: area 0"));
    mesh_free(&m);
}
END_TEST

START_TEST(two_sided_meshes_have_backs) {
    mesh m = make_cube();
    lam_error error;
    m.elements[5][3] = MESH_NO_VERTEX;
    ck_assert_int_eq(mesh_measure(&m, &error), LAM_OK);
    ck_assert_int_eq(mesh_make_two_sided(&m, &error), LAM_OK);
    ck_assert_uint_eq(m.n, 12);
    mesh measured = m;
    measured.area = NULL;
    measured.normal = NULL;
    ck_assert_int_eq(mesh_measure(&measured, &error),
                     LAM_OK); /* the normal of a back follows from its own corners */
    for (size_t i = 0; i < 6; i++) {
        ck_assert_double_eq(m.area[i + 6], m.area[i]);
        ck_assert_uint_eq(m.elements[i + 6][3] == MESH_NO_VERTEX, i == 5);
        for (int k = 0; k < 3; k++) {
            ck_assert_float_eq(measured.normal[i + 6][k], -m.normal[i][k]);
            ck_assert_float_eq(m.normal[i + 6][k], -m.normal[i][k]);
        }
        ck_assert_float_eq(m.emission[i + 6], (float)i);
        ck_assert_float_eq(m.reflectance[i + 6], .5f);
    }
    free(measured.area);
    free(measured.normal);
    mesh_free(&m);
}
END_TEST

static lam_status save_and_load(const mesh *m, mesh *loaded, double **row_sums, lam_error *error) {
    char folder[64], path[256];
    store *s = NULL;
    double *ones = malloc(m->n * sizeof *ones);
    for (size_t i = 0; i < m->n; i++) ones[i] = 1 - (double)i * .01;
    folder_make(folder);
    snprintf(path, sizeof path, "%s/mesh.h5", folder);
    ck_assert_int_eq(store_create(path, &s, error), LAM_OK);
    ck_assert_int_eq(mesh_save(m, ones, s, error), LAM_OK);
    ck_assert_int_eq(store_seal(s, error), LAM_OK);
    ck_assert_int_eq(store_open(path, &s, error), LAM_OK);
    const lam_status status = mesh_load(s, loaded, row_sums, error);
    store_close(s);
    folder_remove(folder);
    free(ones);
    return status;
}

/* A cube of these groups. */
static mesh named_cube(size_t n_groups, const char *const *names, const uint32_t group[6]) {
    mesh m = make_cube();
    free(m.group_names);
    m.group_names = malloc(n_groups * (sizeof *m.group_names + 16));
    m.n_groups = n_groups;
    char *text = (char *)(m.group_names + n_groups);
    for (size_t g = 0; g < n_groups; g++, text += 16) m.group_names[g] = strcpy(text, names[g]);
    memcpy(m.group, group, 6 * sizeof *group);
    return m;
}

/* Buried elements come back; a number that is no element, or that stands twice, is refused. */
START_TEST(buried_elements_are_kept) {
    static const bool buried[6] = {false, true, false, false, true, false};
    static const uint32_t wrong[][2] = {{1, 6}, {4, 4}, {4, 1}};
    lam_error error;
    char folder[64], path[256];
    mesh m = make_cube(), back = {0};
    m.unit = 1, m.up = 'z';
    m.buried = malloc(sizeof buried);
    memcpy(m.buried, buried, sizeof buried);
    ck_assert_msg(save_and_load(&m, &back, NULL, &error) == LAM_OK, "%s", error.message);
    ck_assert_mem_eq(back.buried, buried, sizeof buried);
    folder_make(folder);
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        store *s = NULL;
        bool *read = NULL;
        snprintf(path, sizeof path, "%s/%zu.h5", folder, k);
        ck_ok(store_create(path, &s, &error));
        ck_ok(store_write(s, "/mesh/buried", STORE_U32, 1, (size_t[]){2}, wrong[k], &error));
        ck_ok(store_seal(s, &error));
        ck_ok(store_open(path, &s, &error));
        ck_assert_int_eq(scene_buried_load(s, 6, &read, &error), LAM_ERR_FORMAT);
        ck_assert_ptr_nonnull(strstr(error.message, "/mesh/buried[1] = "));
        ck_assert_ptr_null(read);
        store_close(s);
    }
    folder_remove(folder);
    mesh_free(&back);
    mesh_free(&m);
}
END_TEST

/* Some faces have backs: these lie behind all elements, in groups of their own, whose names are new. */
START_TEST(some_faces_have_backs) {
    static const char *const names[] = {"walls", "lid", "walls.back"};
    static const uint32_t group[6] = {2, 1, 0, 0, 0, 0};
    static const bool marked[6] = {true, false, true, false, true, false};
    static const uint32_t fronts[3] = {0, 2, 4}, groups[3] = {4, 3, 3};
    lam_error error;
    for (int refined = 0; refined < 2; refined++) {
        const size_t parts = refined == 0 ? 1 : 4;
        mesh m = named_cube(3, names, group), back = {0};
        m.has_back = malloc(sizeof marked);
        memcpy(m.has_back, marked, sizeof marked);
        if (refined) ck_ok(mesh_refine(&m, &(mesh_refinement){.subdivide_levels = 1}, &error));
        ck_ok(mesh_make_backs(&m, &error));
        ck_assert_uint_eq(m.n, 9 * parts);
        ck_assert_uint_eq(m.n_backs, 3 * parts);
        ck_assert(!m.two_sided);
        ck_assert_uint_eq(m.n_groups, 5);
        ck_assert_str_eq(m.group_names[3], "walls.back-2");
        ck_assert_str_eq(m.group_names[4], "walls.back.back");
        for (size_t k = 0; k < 3 * parts; k++) {
            const size_t i = 6 * parts + k, front = fronts[k / parts] * parts + k % parts;
            ck_assert_uint_eq(m.group[i], groups[k / parts]);
            ck_assert_uint_eq(m.group[front], group[fronts[k / parts]]);
            ck_assert_float_eq(m.emission[i], m.emission[front]);
            for (int c = 0; c < 4; c++) ck_assert_uint_eq(m.elements[i][c], m.elements[front][3 - c]);
            for (int d = 0; d < 3; d++) ck_assert_float_eq(m.normal[i][d], -m.normal[front][d]);
        }
        ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.subdivide_levels = 1}, &error),
                         LAM_ERR_ARGUMENT);
        ck_ok(mesh_make_backs(&m, &error)); /* nothing is left to be made */
        ck_assert_uint_eq(m.n, 9 * parts);
        m.unit = 1, m.up = 'z';
        ck_assert_msg(save_and_load(&m, &back, NULL, &error) == LAM_OK, "%s", error.message);
        ck_assert_uint_eq(back.n_backs, 3 * parts);
        ck_assert_ptr_null(back.buried);
        ck_assert(!back.two_sided);
        mesh_free(&back);
        mesh_free(&m);
    }
}
END_TEST

/* Marks go with their faces. */
START_TEST(dropped_faces_take_their_backs) {
    static const bool marked[6] = {true, true, false, true, false, false}, dropped[6] = {true, false, true};
    mesh m = make_cube();
    lam_error error;
    m.has_back = malloc(sizeof marked);
    memcpy(m.has_back, marked, sizeof marked);
    ck_ok(mesh_drop(&m, dropped, &error));
    ck_ok(mesh_make_backs(&m, &error));
    ck_assert_uint_eq(m.n, 6);
    ck_assert_float_eq(m.emission[4], 1);
    ck_assert_float_eq(m.emission[5], 3);
    mesh_free(&m);
}
END_TEST

START_TEST(centroid_and_bounds) {
    /* A trapezoid with parallel sides 2 and 1 and height 3: its centroid is 3 (2 + 2 * 1) / (3 (2 + 1)) = 4/3
     * up. */
    const double vertices[4][3] = {{0, 0, 5}, {2, 0, 5}, {1.5, 3, 5}, {.5, 3, 5}};
    const uint32_t quad[1][4] = {{0, 1, 2, 3}};
    mesh m = make_mesh(vertices, 4, quad, 1);
    double c[3], radius;
    mesh_centroid(&m, 0, c);
    ck_assert_double_eq_tol(c[0], 1, 1e-15);
    ck_assert_double_eq_tol(c[1], 4.0 / 3, 1e-15);
    ck_assert_double_eq(c[2], 5);
    mesh_bounds(&m, c, &radius);
    ck_assert_double_eq(c[0], 1);
    ck_assert_double_eq(c[1], 1.5);
    ck_assert_double_eq_tol(radius, sqrt(4 + 9) / 2, 1e-15);
    mesh_free(&m);
}
END_TEST

START_TEST(hash_tells_geometries_apart) {
    mesh m = make_cube(), same = make_cube();
    char first[33], other[33];
    mesh_geometry_hash(&m, first);
    ck_assert_uint_eq(strlen(first), 32);
    same.reflectance[0] = .1f; /* no geometry */
    mesh_geometry_hash(&same, other);
    ck_assert_str_eq(first, other);
    same.vertices[3][1] = nextafter(same.vertices[3][1], 2);
    mesh_geometry_hash(&same, other);
    ck_assert_str_ne(first, other);
    same.vertices[3][1] = m.vertices[3][1];
    same.elements[2][3] = MESH_NO_VERTEX;
    mesh_geometry_hash(&same, other);
    ck_assert_str_ne(first, other);
    same.elements[2][3] = m.elements[2][3];
    same.two_sided = true;
    mesh_geometry_hash(&same, other);
    ck_assert_str_ne(first, other);
    mesh_free(&m);
    mesh_free(&same);
}
END_TEST

START_TEST(z_order_keeps_neighbours_together) {
    mesh m = make_cube();
    lam_error error;
    ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.subdivide_levels = 4}, &error), LAM_OK);
    ck_assert_uint_eq(m.n, 6 * 256);
    uint32_t *order = malloc(m.n * sizeof *order);
    char *seen = calloc(m.n, 1);
    double sum = 0;
    ck_assert_int_eq(mesh_z_order(&m, order, &error), LAM_OK);
    for (size_t p = 0; p < m.n; p++) {
        ck_assert_uint_lt(order[p], m.n);
        ck_assert_int_eq(seen[order[p]]++, 0);
        double a[3], b[3];
        mesh_centroid(&m, order[p], a);
        mesh_centroid(&m, order[p > 0 ? p - 1 : 0], b);
        sum += hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
    }
    /* Cells are 1/16 wide. Two random points on a cube are about .9 apart; a Z-curve steps a few cells. */
    ck_assert_double_lt(sum / (double)m.n, 4.0 / 16);
    /* Each eighth of the order is one octant, x changing first: the cube's surface has 192 elements in each.
     */
    for (size_t p = 0; p < m.n; p++) {
        double a[3];
        mesh_centroid(&m, order[p], a);
        for (int k = 0; k < 3; k++) ck_assert_int_eq(a[k] > .5, (int)(p / (m.n / 8) >> k & 1));
    }
    free(order);
    free(seen);
    mesh_free(&m);
}
END_TEST

START_TEST(subdivision_shares_vertices) {
    /* A closed mesh of quads has as many vertices as quads, plus 2 (Euler); of triangles, half as many,
     * plus 2. */
    for (unsigned levels = 1; levels <= 4; levels++) {
        mesh cube = make_cube(), octahedron = make_octahedron();
        lam_error error;
        const size_t pieces = (size_t)1 << 2 * levels;
        const mesh_refinement how = {.subdivide_levels = levels};
        ck_assert_int_eq(mesh_refine(&cube, &how, &error), LAM_OK);
        ck_assert_int_eq(mesh_refine(&octahedron, &how, &error), LAM_OK);
        ck_assert_uint_eq(cube.n, 6 * pieces);
        ck_assert_uint_eq(cube.n_vertices, cube.n + 2);
        ck_assert_uint_eq(octahedron.n, 8 * pieces);
        ck_assert_uint_eq(octahedron.n_vertices, octahedron.n / 2 + 2);
        for (size_t i = 0; i < cube.n; i++) {
            ck_assert_double_eq(cube.area[i], 1.0 / (double)pieces);
            ck_assert_float_eq(cube.emission[i], (float)(i / pieces)); /* children follow each other */
        }
        for (size_t i = 0; i < octahedron.n; i++) {
            ck_assert_double_eq_tol(octahedron.area[i], sqrt(3) / 2 / (double)pieces, 1e-14);
            ck_assert_float_eq(octahedron.normal[i][0], octahedron.normal[i / pieces * pieces][0]);
        }
        ck_assert_str_eq(cube.source_hash, "00000000000000000000000000000007");
        ck_assert_str_eq(cube.group_names[0], "all");
        mesh_free(&cube);
        mesh_free(&octahedron);
    }
}
END_TEST

START_TEST(shared_edges_divide_alike_at_odd_places) {
    /* Two parallelograms that see their common edge in opposite directions, at coordinates that round. */
    const double vertices[6][3] = {{.1, .2, .3},   {1.7, .9, .3},  {1.4, 2.3, .9},
                                   {-.2, 1.6, .9}, {.4, 3.1, 2.2}, {2.0, 3.8, 2.2}};
    const uint32_t elements[2][4] = {{0, 1, 2, 3}, {2, 5, 4, 3}};
    const double edge = hypot(1.6, .7);
    for (size_t columns = 2; columns < 40; columns++) {
        mesh m = make_mesh(vertices, 6, elements, 2);
        const double before = total_area(&m);
        lam_error error;
        ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.max_edge = edge / (double)columns}, &error),
                         LAM_OK);
        ck_assert_uint_eq(m.n % columns, 0);
        ck_assert_uint_eq(m.n_vertices, (columns + 1) * (m.n / columns + 1));
        ck_assert_double_eq_tol(total_area(&m), before, 1e-12 * before);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(no_edge_is_longer_than_asked) {
    const double limits[] = {.4, .25, .198, .278, .1, .033};
    for (size_t l = 0; l < sizeof limits / sizeof *limits; l++) {
        mesh m = l % 2 == 0 ? make_cube() : make_octahedron();
        const double before = total_area(&m);
        lam_error error;
        ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.max_edge = limits[l]}, &error), LAM_OK);
        for (size_t i = 0; i < m.n; i++) {
            const size_t corners = mesh_corners(&m, i);
            for (size_t k = 0; k < corners; k++) {
                const double *a = m.vertices[m.elements[i][k]],
                             *b = m.vertices[m.elements[i][(k + 1) % corners]];
                ck_assert_double_le(hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]),
                                    limits[l] * (1 + 1e-8));
            }
        }
        ck_assert_double_eq_tol(total_area(&m), before, 1e-12 * before);
        mesh_free(&m);
    }
    mesh m = make_cube(); /* 1 m by .1 m is 10 steps, whatever 1 / .1 rounds to */
    lam_error error;
    ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.max_edge = .1}, &error), LAM_OK);
    ck_assert_uint_eq(m.n, 600);
    mesh_free(&m);
}
END_TEST

START_TEST(elements_come_near_the_number_with_equal_areas) {
    const size_t wanted[] = {24, 150, 1000, 5000, 54321};
    for (size_t w = 0; w < sizeof wanted / sizeof *wanted; w++) {
        /* A box of sides 1, 2 and 3: faces of different areas, as quads and, above, one cut in triangles. */
        double vertices[8][3];
        uint32_t elements[7][4];
        for (int v = 0; v < 8; v++)
            for (int k = 0; k < 3; k++) vertices[v][k] = cube_vertices[v][k] * (k + 1);
        memcpy(elements, cube_elements, sizeof cube_elements);
        memcpy(elements[5], (uint32_t[4]){2, 6, 7, MESH_NO_VERTEX}, sizeof elements[5]);
        memcpy(elements[6], (uint32_t[4]){2, 7, 3, MESH_NO_VERTEX}, sizeof elements[6]);
        mesh m = make_mesh((const double(*)[3])vertices, 8, (const uint32_t(*)[4])elements, 7);
        const double before = total_area(&m);
        lam_error error;
        ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.elements = wanted[w]}, &error), LAM_OK);
        /* A face of p pieces can be off by half a row, about sqrt(p) / 2, and 7 faces partly cancel. */
        const double row = sqrt((double)wanted[w] / 7);
        ck_assert_double_lt(fabs((double)m.n - (double)wanted[w]), 2 * row);
        ck_assert_double_eq_tol(total_area(&m), before, 1e-12 * before);
        double low = HUGE_VAL, high = 0;
        for (size_t i = 0; i < m.n; i++) low = fmin(low, m.area[i]), high = fmax(high, m.area[i]);
        /* Of 22 m^2 the smallest quad has 2, twice as long as wide: sqrt(N / 22) rows, of which half a one is
         * too much or too little; a triangle of 3 m^2, cut m^2-fold, is off by a share of 1 / m = .58 / rows.
         */
        const double rows = sqrt((double)wanted[w] / 22);
        ck_assert_double_lt(high / low, (1 + .6 / rows) / (1 - .6 / rows));
        mesh_free(&m);
    }
}
END_TEST

START_TEST(fewer_elements_than_faces_changes_nothing) {
    mesh m = make_octahedron();
    lam_error error;
    ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.elements = 3}, &error), LAM_OK);
    ck_assert_uint_eq(m.n, 8);
    ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.elements = 3, .max_edge = 1}, &error),
                     LAM_ERR_ARGUMENT);
    ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.max_edge = -1}, &error), LAM_ERR_ARGUMENT);
    ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.max_edge = 1e-9}, &error), LAM_ERR_ARGUMENT);
    ck_assert_int_eq(mesh_refine(&m, &(mesh_refinement){.subdivide_levels = 15}, &error), LAM_ERR_ARGUMENT);
    ck_assert_uint_eq(m.n, 8);
    mesh_free(&m);
}
END_TEST

START_TEST(store_keeps_every_bit) {
    mesh m = make_octahedron(), back = {0};
    double *row_sums = NULL;
    lam_error error = {0};
    ck_assert_int_eq(mesh_make_two_sided(&m, &error), LAM_OK);
    m.unit = .001;
    m.up = 'y';
    ck_assert_msg(save_and_load(&m, &back, &row_sums, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(back.n, 16);
    ck_assert_uint_eq(back.n_vertices, 6);
    ck_assert_uint_eq(back.n_channels, 1);
    ck_assert_mem_eq(back.vertices, m.vertices, 6 * sizeof *m.vertices);
    ck_assert_mem_eq(back.elements, m.elements, 16 * sizeof *m.elements);
    ck_assert_mem_eq(back.area, m.area, 16 * sizeof *m.area);
    ck_assert_mem_eq(back.normal, m.normal, 16 * sizeof *m.normal);
    ck_assert_mem_eq(back.reflectance, m.reflectance, 16 * sizeof *m.reflectance);
    ck_assert_mem_eq(back.emission, m.emission, 16 * sizeof *m.emission);
    ck_assert_mem_eq(back.group, m.group, 16 * sizeof *m.group);
    ck_assert_uint_eq(back.n_groups, 2);
    ck_assert_str_eq(back.group_names[0], "all");
    ck_assert_str_eq(back.group_names[1], "all.back");
    ck_assert(back.two_sided);
    ck_assert_uint_eq(back.n_backs, 8);
    ck_assert_double_eq(back.unit, .001);
    ck_assert_int_eq(back.up, 'y');
    ck_assert_str_eq(back.name, "made");
    ck_assert_str_eq(back.source_hash, m.source_hash);
    ck_assert_double_eq(row_sums[15], 1 - 15 * .01);
    free(row_sums);
    mesh_free(&back);
    mesh_free(&m);
}
END_TEST

/* One defect each, and the text that the message must contain. */
static void spoil(mesh *m, int defect) {
    switch (defect) {
    case 0:
        m->elements[2][1] = 6;
        break;
    case 1:
        m->vertices[3][2] = NAN;
        break;
    case 2:
        m->reflectance[7] = 1;
        break;
    case 3:
        m->reflectance[7] = -.1f;
        break;
    case 4:
        m->emission[1] = NAN;
        break;
    case 5:
        m->group[4] = 1;
        break;
    case 6:
        m->area[0] = 0;
        break;
    case 7:
        m->normal[0][0] = INFINITY;
        break;
    case 8:
        m->up = 'q';
        break;
    case 9:
        m->unit = 0;
        break;
    default:
        m->n = 7, m->two_sided = true;
        break;
    }
}

START_TEST(loading_refuses_bad_values) {
    const char *const names[] = {"elements[2][1] = 6", "vertices[3][2]", "reflectance[0][7] = 1",
                                 "reflectance[0][7]",  "emission[0][1]", "group[4] = 1",
                                 "area[0] = 0",        "normal[0][0]",   "up is 'q'",
                                 "unit is 0",          "7 elements"};
    mesh m = make_octahedron(), back = {0};
    lam_error error = {0};
    spoil(&m, _i);
    const lam_status status = save_and_load(&m, &back, NULL, &error);
    ck_assert_int_eq(status, LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, names[_i]) != NULL, "%s", error.message);
    ck_assert_ptr_null(back.vertices);
    m.n = 8;
    mesh_free(&m);
}
END_TEST

/* Elements of two channels and three groups, of which one group loses all. */
START_TEST(dropped_elements) {
    mesh m = make_cube();
    static const char *const names[] = {"one", "glass", "two"};
    static const bool dropped[] = {false, true, false, false, true, false};
    free(m.group_names);
    m.group_names = malloc(3 * sizeof *m.group_names + 16);
    char *text = (char *)(m.group_names + 3);
    for (size_t g = 0; g < 3; g++) {
        m.group_names[g] = text;
        text = stpcpy(text, names[g]) + 1;
    }
    m.n_groups = 3;
    m.n_channels = 2;
    m.reflectance = realloc(m.reflectance, 12 * sizeof *m.reflectance);
    m.emission = realloc(m.emission, 12 * sizeof *m.emission);
    for (uint32_t i = 0; i < 6; i++) m.group[i] = dropped[i] ? 1 : i < 3 ? 0 : 2;
    for (size_t k = 0; k < 12; k++) m.reflectance[k] = .01f * (float)k, m.emission[k] = (float)k;
    for (size_t i = 0; i < 6; i++) m.area[i] = 1 + (double)i;
    for (size_t i = 0; i < 6; i++) m.normal[i][0] = (float)i;
    lam_error error;
    ck_assert_int_eq(mesh_drop(&m, dropped, &error), LAM_OK);
    static const size_t kept[] = {0, 2, 3, 5};
    ck_assert_uint_eq(m.n, 4);
    ck_assert_uint_eq(m.n_groups, 2);
    ck_assert_str_eq(m.group_names[0], "one");
    ck_assert_str_eq(m.group_names[1], "two");
    for (size_t k = 0; k < 4; k++) {
        ck_assert_mem_eq(m.elements[k], cube_elements[kept[k]], sizeof *m.elements);
        ck_assert_uint_eq(m.group[k], kept[k] < 3 ? 0 : 1);
        ck_assert(m.area[k] == 1 + (double)kept[k] && m.normal[k][0] == (float)kept[k]);
        for (size_t c = 0; c < 2; c++) {
            ck_assert(m.emission[c * 4 + k] == (float)(c * 6 + kept[k]));
            ck_assert(m.reflectance[c * 4 + k] == .01f * (float)(c * 6 + kept[k]));
        }
    }
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("mesh");
    TCase *tests = tcase_create("mesh");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, dropped_elements);
    tcase_add_test(tests, areas_and_normals_are_exact);
    tcase_add_test(tests, measuring_refuses_bad_elements);
    tcase_add_test(tests, two_sided_meshes_have_backs);
    tcase_add_test(tests, some_faces_have_backs);
    tcase_add_test(tests, buried_elements_are_kept);
    tcase_add_test(tests, dropped_faces_take_their_backs);
    tcase_add_test(tests, centroid_and_bounds);
    tcase_add_test(tests, hash_tells_geometries_apart);
    tcase_add_test(tests, z_order_keeps_neighbours_together);
    tcase_add_test(tests, subdivision_shares_vertices);
    tcase_add_test(tests, shared_edges_divide_alike_at_odd_places);
    tcase_add_test(tests, no_edge_is_longer_than_asked);
    tcase_add_test(tests, elements_come_near_the_number_with_equal_areas);
    tcase_add_test(tests, fewer_elements_than_faces_changes_nothing);
    tcase_add_test(tests, store_keeps_every_bit);
    tcase_add_loop_test(tests, loading_refuses_bad_values, 0, 11);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
