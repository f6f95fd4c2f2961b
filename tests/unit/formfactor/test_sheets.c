/* Sheets of two faces whose decimals are rounded: neither side sees the other by any kind of form factors,
 * neither hides from the other's side what that sees, and what only looks alike is kept. */
#include "solver/base/random.h"
#include "solver/formfactor/exchange/pair_factor.h"
#include "solver/formfactor/exchange/pair_far.h"
#include "solver/formfactor/source.h"
#include "solver/scene/plane.h"
#include "support/blocks.h"
#include "support/box.h"
#include "support/scene.h"

static lam_error error;
static pair_factor_rules rules;

static void set_rules(void) {
    pair_factor_rules_init(&rules);
}

/* A random rotation: frame[k] is where axis k goes. */
static void turn(uint64_t *state, double frame[3][3]) {
    double length, q[4];
    do {
        length = 0;
        for (int k = 0; k < 4; k++) {
            q[k] = 2 * random_lcg_unit(state) - 1;
            length += q[k] * q[k];
        }
    } while (!(length > .01 && length < 1));
    for (int k = 0; k < 4; k++) q[k] /= sqrt(length);
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double of[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
                             {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
                             {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
    memcpy(frame, of, sizeof of);
}

static double rounded(double x, int decimals) {
    return round(x * pow(10, decimals)) / pow(10, decimals);
}

/* The point (x, y, z) half sides from a centre in a frame, with so many decimals. */
static void place(double frame[3][3], const double centre[3], double half, const double at[3], int decimals,
                  double out[3]) {
    for (int d = 0; d < 3; d++)
        out[d] = rounded(centre[d] + half * (at[0] * frame[0][d] + at[1] * frame[1][d] + at[2] * frame[2][d]),
                         decimals);
}

static polygon polygon_of(double corner[4][3], int n, const int *order) {
    polygon p = {.n = n};
    for (int c = 0; c < n; c++) memcpy(p.corner[c], corner[order[c]], sizeof p.corner[c]);
    polygon_measure(&p);
    return p;
}

static void see_nothing(const polygon *a, const polygon *b) {
    ck_assert_double_eq(pair_factor_exchange(&rules, a, b, 1e-6), 0);
    ck_assert_double_eq(pair_factor_exchange(&rules, b, a, 1e-6), 0);
}

/* The back of a quad that the importer takes for plane, as one quad from any of its corners, and as two
 * triangles along either diagonal. */
START_TEST(a_quad_does_not_see_its_back) {
    static const double square[4][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    static const double halves[] = {.01, .2, 3, 50};
    static const double places[][3] = {{0, 0, 0}, {446000, 6085000, 30}};
    static const int front[] = {0, 1, 2, 3};
    uint64_t state = 5;
    size_t tried = 0;
    for (int decimals = 4; decimals <= 9; decimals++)
        for (size_t s = 0; s < sizeof halves / sizeof *halves; s++)
            for (size_t k = 0; k < 60; k++) {
                double frame[3][3], centre[3], corner[4][3];
                turn(&state, frame);
                for (int d = 0; d < 3; d++) centre[d] = places[k % 2][d] + 3.7 * random_lcg_unit(&state);
                for (int c = 0; c < 4; c++) place(frame, centre, halves[s], square[c], decimals, corner[c]);
                const polygon quad = polygon_of(corner, 4, front);
                double most = 0;
                for (int c = 0; c < 4; c++) {
                    double height = 0;
                    for (int d = 0; d < 3; d++)
                        height += (quad.corner[c][d] - quad.centre[d]) * quad.normal[d];
                    most = fmax(most, fabs(height));
                }
                for (int from = 0; from < 4; from++) {
                    const int back[] = {(from + 3) % 4, (from + 2) % 4, (from + 1) % 4, from};
                    const polygon behind = polygon_of(corner, 4, back);
                    if (most <= plane_flatness * 2 * quad.radius) see_nothing(&quad, &behind);
                    const int triangle[] = {(from + 2) % 4, (from + 1) % 4, from},
                              reversed[] = {from, (from + 1) % 4, (from + 2) % 4};
                    const polygon part = polygon_of(corner, 3, triangle),
                                  own = polygon_of(corner, 3, reversed);
                    if (most <= plane_flatness * 2 * quad.radius) see_nothing(&quad, &part);
                    see_nothing(&own, &part);
                    /* The other diagonal. */
                    const int other[] = {(from + 3) % 4, (from + 2) % 4, (from + 1) % 4};
                    const polygon across = polygon_of(corner, 3, other);
                    if (most <= plane_flatness * 2 * quad.radius) see_nothing(&own, &across);
                    tried++;
                }
            }
    ck_assert_uint_eq(tried, 6 * 4 * 60 * 4);
}
END_TEST

/* Faces that are near one another and see each other nevertheless: a gap of 1/500 of two plates, a diode of
 * a millimetre above a large floor, a lath of .2 mm that stands upright on it, and the two sides of a narrow
 * groove. The lath sees the floor by half, as its height is a millionth of that; the plates see each other
 * but for their edges, 4 sides times the gap over the area at most. */
START_TEST(what_is_near_is_seen) {
    static const double floor[4][3] = {{-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}},
                        above[4][3] = {{-10, -10, .04}, {-10, 10, .04}, {10, 10, .04}, {10, -10, .04}},
                        diode[4][3] = {{1, 1, 1e-4},
                                       {1, 1.001, 1e-4},
                                       {1.001, 1.001, 1e-4},
                                       {1.001, 1, 1e-4}},
                        lath[4][3] = {{1, 1, 0}, {3, 1, 0}, {3, 1, 2e-4}, {1, 1, 2e-4}},
                        groove[4][3] = {{-10, -10, 0}, {-10, 10, 0}, {10, 10, .2}, {10, -10, .2}};
    static const int order[] = {0, 1, 2, 3};
    double corner[5][4][3];
    uint64_t state = 9;
    for (int k = 0; k < 20; k++) {
        double frame[3][3];
        const double *const of[5] = {floor[0], above[0], diode[0], lath[0], groove[0]}, centre[3] = {1, 2, 3};
        polygon p[5];
        turn(&state, frame);
        for (int i = 0; i < 5; i++) {
            for (int c = 0; c < 4; c++) place(frame, centre, 1, of[i] + 3 * c, 9, corner[i][c]);
            p[i] = polygon_of(corner[i], 4, order);
        }
        const double least[5] = {0, .99, .99, .4999, .97};
        for (int i = 1; i < 5; i++) {
            const double F = pair_factor_exchange(&rules, &p[i], &p[0], 1e-6) / polygon_area(&p[i]);
            ck_assert_msg(F > least[i] && F < 1 + 1e-6, "face %d: %.9g", i, F);
        }
    }
}
END_TEST

/* Rows of far pairs have no entries within a plane, whatever its decimals: 100 tiles of a wall and, reversed,
 * those of its back that are half a tile beside them. */
START_TEST(rows_of_a_wall_are_empty) {
    enum { SIDE = 10, TILES = SIDE * SIDE };
    uint64_t state = 3;
    double frame[3][3];
    const double centre[3] = {1, 2, 3};
    mesh m = {0};
    cluster_tree tree;
    pair_far_table far;
    polygon polygons[2 * TILES];
    turn(&state, frame);
    for (int k = 0; k < 2 * TILES; k++) {
        const double x = k % SIDE, y = k / SIDE % SIDE + (k < TILES ? 0 : .5);
        const double at[4][3] = {{x, y, 0}, {x + 1, y, 0}, {x + 1, y + 1, 0}, {x, y + 1, 0}};
        double corner[4][3];
        for (int c = 0; c < 4; c++) place(frame, centre, .3, at[k < TILES ? c : 3 - c], 6, corner[c]);
        mesh_add_quad(&m, (const double(*)[3])corner);
    }
    mesh_finish(&m, .5f);
    ck_ok(cluster_tree_build(&m, 1e-9, &tree, &error));
    for (size_t i = 0; i < m.n; i++) polygon_of_element(&m, i, &polygons[i]);
    ck_ok(pair_far_table_build(polygons, &tree, &rules, 1e-5, &far, &error));
    for (size_t i = 0; i < m.n; i++) {
        double g[2 * TILES];
        pair_far_row(&far, i, 0, m.n, g);
        for (size_t j = 0; j < m.n; j++) ck_assert_double_eq(g[j], 0);
    }
    pair_far_table_free(&far);
    cluster_tree_free(&tree);
    mesh_free(&m);
}
END_TEST

/* The kinds of sheets: --two-sided; two quads on the same corners; two on corners of their own, the back
 * beginning elsewhere; a quad before two triangles; two triangles before two of the other diagonal; a quad
 * before one that is turned a little and rounded by itself; a quad before four. */
enum { TWO_SIDED, TWINS, OWN_CORNERS, SPLIT, CROSSED, TURNED, QUARTERED, SHEET_KINDS };
enum { SHEETS = 27, ALONG = 3 };

/* As an OBJ. Coordinates are rounded by at most .5 10^-decimals, .87 as much in space, so that a corner of
 * one side is off the plane of the other by about four times that: within plane_slack, 4e-5 of the diameter
 * of 2.8 half sides, where that is above 3.2e4 of the last decimal. */
static void sheets_write(int kind, double half, int decimals, char *text, size_t size) {
    uint64_t state = 21;
    size_t used = 0, vertices = 0;
    for (int s = 0; s < SHEETS; s++) {
        double frame[3][3], centre[3];
        turn(&state, frame);
        const int index[3] = {s % ALONG, s / ALONG % ALONG, s / ALONG / ALONG};
        for (int d = 0; d < 3; d++) centre[d] = half * (4 * index[d] + random_lcg_unit(&state));
        const double turned = kind == TURNED ? .1 : 0;
        double grid[9][3] = {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {0, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}};
        for (int copy = 0; copy < 2; copy++)
            for (int v = 0; v < 9; v++) {
                const double x = grid[v][0], y = grid[v][1], c = copy * turned;
                const double at[3] = {x * cos(c) - y * sin(c), x * sin(c) + y * cos(c), 0};
                double p[3];
                place(frame, centre, half, at, decimals, p);
                used += (size_t)snprintf(text + used, size - used, "v %.9f %.9f %.9f\n", p[0], p[1], p[2]);
            }
        const size_t b = vertices + 1, e = b + 9; /* corners 0 2 8 6 */
        vertices += 18;
        char *const to = text + used;
        const size_t room = size - used;
        int n = 0;
        if (kind == CROSSED)
            n = snprintf(to, room, "f %zu %zu %zu\nf %zu %zu %zu\nf %zu %zu %zu\nf %zu %zu %zu\n", b, b + 2,
                         b + 8, b, b + 8, b + 6, b + 6, b + 2, b, b + 6, b + 8, b + 2);
        else
            n = snprintf(to, room, "f %zu %zu %zu %zu\n", b, b + 2, b + 8, b + 6);
        used += (size_t)n;
        if (kind == TWINS)
            n = snprintf(text + used, size - used, "f %zu %zu %zu %zu\n", b + 6, b + 8, b + 2, b);
        else if (kind == OWN_CORNERS || kind == TURNED)
            n = snprintf(text + used, size - used, "f %zu %zu %zu %zu\n", e + 2, e, e + 6, e + 8);
        else if (kind == SPLIT)
            n = snprintf(text + used, size - used, "f %zu %zu %zu\nf %zu %zu %zu\n", e + 6, e + 2, e, e + 6,
                         e + 8, e + 2);
        else
            n = 0;
        used += (size_t)n;
        for (size_t q = 0; q < 4 && kind == QUARTERED; q++) {
            const size_t first = e + q % 2 + 3 * (q / 2);
            used += (size_t)snprintf(text + used, size - used, "f %zu %zu %zu %zu\n", first, first + 3,
                                     first + 4, first + 1);
        }
    }
    ck_assert_uint_lt(used, size);
}

static mesh sheets(int kind, double half, int decimals) {
    static char text[1 << 16];
    char folder[64];
    import_report report;
    folder_make(folder);
    sheets_write(kind, half, decimals, text, sizeof text);
    mesh m = obj_good(folder, text, &report);
    if (kind == TWO_SIDED) ck_ok(mesh_make_two_sided(&m, &error));
    folder_remove(folder);
    return m;
}

/* F [n][n] of a mesh by a recipe, by blocks too; *absorbed: the share that meets backs. */
static double *factors_of(const mesh *m, const recipe *r, double *absorbed) {
    double *F = calloc(m->n * m->n, sizeof *F);
    uint32_t *order = calloc(m->n, sizeof *order);
    form_factors f = {0};
    *absorbed = 0;
    for (uint32_t i = 0; i < m->n; i++) order[i] = i;
    if (recipe_source(r) == &source_blocks) {
        plane_tree tree;
        block_factors blocks = blocks_of(m, &tree, blocks_open, blocks_shadow, NULL);
        double *x = calloc(m->n, sizeof *x), *y = calloc(m->n, sizeof *y);
        for (size_t j = 0; j < m->n; j++) {
            x[j] = 1;
            blocks_multiply(&blocks, x, y);
            x[j] = 0;
            for (size_t i = 0; i < m->n; i++) F[i * m->n + j] = y[i];
        }
        free(x);
        free(y);
        block_factors_free(&blocks);
        plane_tree_free(&tree);
    } else {
        const form_factor_options how = {.recipe = *r};
        ck_ok(form_factors_make(m, order, &how, &f, &error));
        for (size_t i = 0; i < m->n; i++)
            for (size_t j = 0; j < m->n; j++) F[i * m->n + j] = csr_entry(&f.F, i, j);
        *absorbed = f.absorbed_share;
        form_factors_free(&f);
    }
    free(order);
    return F;
}

static const recipe recipes[] = {{.source = &source_pairs, .rays = 64, .accuracy = 7e-5, .seed = 1},
                                 {.source = &source_near_pairs, .rays = 128, .accuracy = 7e-5, .seed = 2},
                                 {.source = &source_rays, .rays = 256, .seed = 3},
                                 {.source = &source_hemicube, .resolution = 32, .seed = 4},
                                 {.source = &source_blocks}};
enum { RECIPES = sizeof recipes / sizeof *recipes };

/* The number of the sheet that an element is of. */
static int sheet_of(const mesh *m, size_t i, double half) {
    double at[3];
    int index[3];
    mesh_centroid(m, i, at);
    for (int d = 0; d < 3; d++) index[d] = (int)floor((at[d] / half + 1.5) / 4);
    return index[0] + ALONG * (index[1] + ALONG * index[2]);
}

static void check_sheets(int kind, double half, int decimals, const recipe *r) {
    mesh m = sheets(kind, half, decimals), fine = sheets(kind, half, 9);
    double absorbed, of_fine, sum = 0, wanted = 0;
    double *F = factors_of(&m, r, &absorbed), *G = factors_of(&fine, r, &of_fine);
    for (size_t i = 0; i < m.n; i++)
        for (size_t j = 0; j < m.n; j++) {
            double cosine = 0;
            for (int d = 0; d < 3; d++) cosine += (double)m.normal[i][d] * (double)m.normal[j][d];
            sum += m.area[i] * F[i * m.n + j];
            if (cosine < -.9 && sheet_of(&m, i, half) == sheet_of(&m, j, half))
                ck_assert_msg(F[i * m.n + j] == 0, "kind %d, %d decimals, %s: %zu sees %zu, %g", kind,
                              decimals, recipe_name(r), i, j, F[i * m.n + j]);
        }
    for (size_t k = 0; k < fine.n * fine.n; k++) wanted += fine.area[k / fine.n] * G[k];
    /* Light between sheets, and what meets backs, are those of the same sheets with all decimals. Backs are
     * met through slits at edges that rounding leaves: 4 sides of 2 times 2 units of the last decimal, in
     * areas of 4 half^2. Turned sheets have corners that show their backs. Rays count hits: with a fifth of
     * `rays` an element in both, the ratio errs by (2 / hits)^1/2, of which four times is allowed. */
    const double hits =
        recipe_source(r) == &source_pairs || recipe_source(r) == &source_blocks || r->rays == 0
            ? 1e6
            : .2 * (double)(m.n * r->rays);
    ck_assert_msg(fabs(sum / wanted - 1) <= .01 + 4 * sqrt(2 / hits),
                  "kind %d, half %g, %d decimals, %s: %g of %g", kind, half, decimals, recipe_name(r), sum,
                  wanted);
    ck_assert_double_le(absorbed, of_fine + .001 + (kind == TURNED ? .01 : 0));
    free(F);
    free(G);
    mesh_free(&m);
    mesh_free(&fine);
}

START_TEST(no_sheet_sees_its_back) {
    const recipe *r = &recipes[_i];
    for (int kind = 0; kind < SHEET_KINDS; kind++) {
        check_sheets(kind, .2, 6, r);
        check_sheets(kind, 4, 4, r);
        /* Faces of the same corners are the same faces also where the importer cuts them in two. */
        if (kind <= OWN_CORNERS) check_sheets(kind, .05, 4, r);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("sheets");
    TCase *tcase = tcase_create("sheets");
    tcase_set_timeout(tcase, 120);
    tcase_add_unchecked_fixture(tcase, set_rules, NULL);
    tcase_add_test(tcase, a_quad_does_not_see_its_back);
    tcase_add_test(tcase, what_is_near_is_seen);
    tcase_add_test(tcase, rows_of_a_wall_are_empty);
    tcase_add_loop_test(tcase, no_sheet_sees_its_back, 0, RECIPES);
    suite_add_tcase(suite, tcase);
    return suite_run(suite);
}
