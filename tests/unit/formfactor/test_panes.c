/* Panes between two black rooms and in a window: form factors and the light of an even sky by every source,
 * against sums over points in double; sheets, panes of several faces, files and stores. */
#include "solver/formfactor/blocks/block_light.h"
#include "solver/formfactor/glass/pane_light.h"
#include "solver/formfactor/sky_sample.h"
#include "solver/formfactor/source.h"
#include "solver/scene/glass.h"
#include "store/groups.h"
#include "support/obj_text.h"

static lam_error error;

/* n x n squares from a corner along two edges, whose cross product is the normal. */
static void put_group(obj_text *w, const char *name, const double corner[3], const double u[3],
                      const double v[3], int n) {
    obj_text_put(w, "o %s\n", name);
    for (int k = 0; k < n * n; k++) {
        static const int turn[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        for (int c = 0; c < 4; c++) {
            const double a = (k % n + turn[c][0]) / (double)n, b = (k / n + turn[c][1]) / (double)n;
            obj_text_put(w, "v %.9g %.9g %.9g\n", corner[0] + a * u[0] + b * v[0],
                         corner[1] + a * u[1] + b * v[1], corner[2] + a * u[2] + b * v[2]);
        }
        obj_text_put(w, "f -4 -3 -2 -1\n");
    }
}

static const double X[3] = {2, 0, 0}, Y[3] = {0, 2, 0}, Z[3] = {0, 0, 2};

/* The sides of a room from x to x + 2 along x but for those across it. */
static void put_sides(obj_text *w, double x, int n) {
    const double low[3] = {x, 0, 0}, north[3] = {x, 2, 0}, top[3] = {x, 0, 2};
    put_group(w, "floor", low, X, Y, n);
    put_group(w, "ceiling", top, Y, X, n);
    put_group(w, "south", low, Z, X, n);
    put_group(w, "north", north, X, Z, n);
}

/* Two rooms of 2 m, side by side, with `panes` panes .01 m apart between them; sheet: of two faces each. */
static mesh two_rooms(int panes, bool sheet) {
    obj_text w = {.used = 0};
    put_group(&w, "west", (const double[3]){0, 0, 0}, Y, Z, 3);
    put_sides(&w, 0, 3);
    put_sides(&w, 2, 3);
    put_group(&w, "east", (const double[3]){4, 0, 0}, Z, Y, 3);
    for (int k = 0; k < panes; k++) {
        const double corner[3] = {2 + .01 * k, 0, 0};
        put_group(&w, "pane", corner, Y, Z, 2);
        if (sheet) put_group(&w, "pane", corner, Z, Y, 2);
    }
    return obj_text_mesh(&w);
}

static glass_report glaze(mesh *m, double transmittance, double faces, bool by_angle) {
    const struct group_glass glass = {transmittance, faces};
    glass_report report;
    ck_ok(mesh_set_glass(m, group_find(m, "pane"), &glass, &error));
    m->glass_by_angle = by_angle;
    ck_ok(mesh_settle_glass(m, &report, &error));
    ck_ok(mesh_make_backs(m, &error));
    return report;
}

static double law(double c) {
    const double s = sqrt(1 - c * c), g = 1.018 * c * (1 + s * s * s);
    return g < 1 ? g : 1;
}

START_TEST(the_law_of_a_pane) {
    const struct group_glass one = {.78, 1}, two = {.78, 2};
    ck_assert_double_eq(glass_passes(&one, true, 1), .78);
    ck_assert_double_eq_tol(glass_passes(&one, true, .5), .78 * 1.018 * .5 * (1 + pow(.75, 1.5)), 1e-14);
    ck_assert_double_eq(glass_passes(&one, true, 0), 0);
    ck_assert_double_eq(glass_passes(&one, false, .01), .78);
    for (int k = 0; k <= 100; k++) {
        const double c = k / 100., once = glass_passes(&one, true, c), twice = glass_passes(&two, true, c);
        ck_assert_double_le(once, .78);
        ck_assert_double_eq_tol(once, .78 * law(c), 1e-14);
        ck_assert_double_eq_tol(twice * twice, once, 1e-14);
    }
}
END_TEST

/* The mean irradiance of a square across x at 4, or of the floor from x = 2 to 4, by the square at x = 0
 * whose exitance is 1, through a pane at x = 2 of transmittance T. */
static double through(bool floor, double T) {
    enum { N = 20 };
    double sum = 0;
    for (int a = 0; a < N; a++)
        for (int b = 0; b < N; b++)
            for (int c = 0; c < N; c++)
                for (int d = 0; d < N; d++) {
                    const double y = (c + .5) * 2 / N, z = (d + .5) * 2 / N, s = (a + .5) * 2 / N,
                                 t = (b + .5) * 2 / N;
                    const double way[3] = {floor ? 2 + s : 4, (floor ? t : s) - y, (floor ? 0 : t) - z};
                    const double r2 = way[0] * way[0] + way[1] * way[1] + way[2] * way[2], r = sqrt(r2);
                    const double leaves = way[0] / r, arrives = floor ? -way[2] / r : way[0] / r;
                    sum += leaves * arrives / (M_PI * r2) * T * law(leaves);
                }
    return sum * 4 / pow(N, 4);
}

static form_factors make(const mesh *m, const recipe *r, const char *sky) {
    form_factors f;
    uint32_t *order = calloc(m->n, sizeof *order);
    for (uint32_t i = 0; i < m->n; i++) order[i] = i;
    const form_factor_options how = {.recipe = *r, .sky = sky};
    ck_ok(form_factors_make(m, order, &how, &f, &error));
    free(order);
    return f;
}

/* The part of the light of group `from` that reaches the group `to`. */
static double share(const mesh *m, const form_factors *f, const char *from, const char *to) {
    const size_t source = group_find(m, from), target = group_find(m, to);
    double sum = 0, area = 0;
    for (size_t i = 0; i < m->n; i++) {
        if (m->group[i] != source) continue;
        area += m->area[i];
        for (uint64_t p = f->F.indptr[i]; p < f->F.indptr[i + 1]; p++)
            if (m->group[f->F.indices[p]] == target) sum += m->area[i] * (double)f->F.data[p];
    }
    return sum / area;
}

static const recipe recipes[] = {{.source = &source_pairs, .rays = 4096, .accuracy = 7e-5, .seed = 1},
                                 {.source = &source_near_pairs, .rays = 4096, .accuracy = 7e-5, .seed = 2},
                                 {.source = &source_rays, .rays = 4096, .seed = 3},
                                 {.source = &source_hemicube, .rays = 4096, .resolution = 64, .seed = 4}};
enum { RECIPES = sizeof recipes / sizeof *recipes };

/* Rays leave 1 % of noise in the light of a group; quadrature of 20 points a side is good to .5 %. */
static const double noise = .02;

START_TEST(light_passes_from_room_to_room) {
    static const double T = .78;
    mesh m = two_rooms(1, false);
    ck_assert_uint_eq(glaze(&m, T, 1, true).faces, 4);
    ck_assert_uint_eq(m.n_backs, 4);
    const form_factors f = make(&m, &recipes[_i], NULL);
    const double east = through(false, T), direct = share(&m, &f, "west", "pane.back");
    ck_assert_double_eq_tol(share(&m, &f, "west", "east"), east, noise * east);
    ck_assert_double_eq_tol(share(&m, &f, "east", "west"), east, noise * east);
    /* All that meets the pane comes to it: .19982 of the light of the opposite side of a cube; the pixels of
     * a hemicube see .003 more. */
    ck_assert_double_eq_tol(direct, .19982, 4e-3);
    ck_assert_double_eq(share(&m, &f, "west", "pane"), 0);
    for (size_t i = 0; i < m.n; i++) ck_assert_double_le(f.row_sums[i], 1 + T);
    form_factors g = f;
    form_factors_free(&g);
    mesh_free(&m);
}
END_TEST

START_TEST(panes_of_several_faces) {
    static const double T = .78;
    const double one = through(false, T);
    mesh sheet = two_rooms(1, true), two = two_rooms(2, false), plain = two_rooms(1, false);
    ck_assert_uint_eq(glaze(&sheet, T, 1, true).faces, 8);
    ck_assert_uint_eq(sheet.n_backs, 0); /* each face is the back of the other */
    glaze(&two, T, 2, true);
    glaze(&plain, T, 1, false);
    form_factors f = make(&sheet, &recipes[2], NULL), g = make(&two, &recipes[2], NULL),
                 h = make(&plain, &recipes[2], NULL);
    ck_assert_double_eq_tol(share(&sheet, &f, "west", "east"), one, noise * one);
    ck_assert_double_eq_tol(share(&two, &g, "west", "east"), one, noise * one);
    /* Without the law a pane passes T of what an open side passes: .0686 of two squares at twice their side.
     */
    ck_assert_double_eq_tol(share(&plain, &h, "west", "east"), T * .06859, noise * one);
    form_factors_free(&f);
    form_factors_free(&g);
    form_factors_free(&h);
    mesh_free(&sheet);
    mesh_free(&two);
    mesh_free(&plain);
}
END_TEST

/* The mean irradiance of the floor of a room whose east side is a pane, under a sky of radiance 1: N points a
 * side, N - |c| of the pairs of which lie c apart along the pane. */
static double floor_by_sky_of(int N, double T) {
    double sum = 0;
    for (int a = 0; a < N; a++)
        for (int c = 1 - N; c < N; c++)
            for (int d = 0; d < N; d++) {
                const double way[3] = {2 - (a + .5) * 2 / N, c * 2. / N, (d + .5) * 2 / N};
                const double r2 = way[0] * way[0] + way[1] * way[1] + way[2] * way[2], r = sqrt(r2);
                sum += (N - abs(c)) * way[0] / r * way[2] / r / r2 * T * law(way[0] / r);
            }
    return sum * 4 / pow(N, 4);
}

/* The edge that floor and pane share leaves an error of first order in 1 / N, which two sums cancel. */
static double floor_by_sky(double T) {
    return 2 * floor_by_sky_of(120, T) - floor_by_sky_of(60, T);
}

/* The light of single tiles on the floor: by rays towards them, as a judge has it, that of the first bounce.
 */
static void tiles_agree(const mesh *m, const sky_bounce *sky) {
    const size_t n_tiles = sky->tiling.n_tiles, floor_group = group_find(m, "floor");
    size_t *tiles = calloc(n_tiles, sizeof *tiles);
    float *first = calloc(n_tiles * m->n, sizeof *first);
    uint32_t *order = calloc(m->n, sizeof *order);
    sky_bounce sampled;
    double sum = 0, off = 0;
    for (uint32_t i = 0; i < m->n; i++) order[i] = i;
    for (size_t t = 0; t < n_tiles; t++) tiles[t] = t;
    const form_factor_options how = {.recipe = {.source = &source_rays, .rays = 64, .seed = 7}};
    ck_ok(sky_sample_make(m, order, sky, &how, &sampled, &error));
    ck_ok(sky_sample_tiles(m, &sampled, 64, 8, n_tiles, tiles, first, &error));
    for (size_t t = 0; t < n_tiles; t++) {
        double by_rays = 0, by_tile = 0;
        for (size_t i = 0; i < m->n; i++) {
            if (m->group[i] != floor_group) continue;
            by_rays += m->area[i] * (double)sky->first_bounce[t * m->n + i];
            by_tile += m->area[i] * (double)first[t * m->n + i];
        }
        sum += by_rays;
        off += fabs(by_tile - by_rays);
    }
    ck_assert_double_gt(sum, 0);
    ck_assert_double_lt(off, .05 * sum);
    sky_bounce_free(&sampled);
    free(tiles);
    free(first);
    free(order);
}

START_TEST(an_even_sky_shines_through) {
    static const double T = .78;
    static const recipe blocks = {.source = &source_blocks, .rays = 4096, .accuracy = 1e-4, .seed = 5};
    obj_text w = {.used = 0};
    double irradiance = 0, area = 0;
    form_factors f;
    put_group(&w, "west", (const double[3]){0, 0, 0}, Y, Z, 3);
    put_sides(&w, 0, 3);
    put_group(&w, "pane", (const double[3]){2, 0, 0}, Y, Z, 2);
    mesh m = obj_text_mesh(&w);
    glaze(&m, T, 1, true);
    if (_i < RECIPES) {
        f = make(&m, &recipes[_i], "tregenza");
    } else {
        plane_tree tree;
        block_factors made;
        uint32_t *order = calloc(m.n, sizeof *order);
        for (uint32_t i = 0; i < m.n; i++) order[i] = i;
        const form_factor_options how = {.recipe = blocks, .sky = "tregenza"};
        ck_ok(form_factors_tree(&m, &tree, &error));
        ck_ok(form_factors_make_blocks(&m, order, &tree, NULL, &how, &f, &made, &error));
        block_factors_free(&made);
        plane_tree_free(&tree);
        free(order);
    }
    for (size_t i = 0; i < m.n; i++) {
        if (m.group[i] != group_find(&m, "floor")) continue;
        area += m.area[i];
        for (size_t t = 0; t < f.sky.tiling.n_tiles; t++)
            irradiance += m.area[i] * (double)f.sky.first_bounce[t * m.n + i];
    }
    const double wanted = floor_by_sky(T);
    ck_assert_double_eq_tol(irradiance / area, wanted, .01 * wanted);
    if (_i == 2) tiles_agree(&m, &f.sky);
    for (size_t i = 0; i < m.n && _i < RECIPES; i++) ck_assert_double_le(f.row_sums[i], 1 + 1e-6);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* Two rooms and the blocks of them. */
typedef struct blocks_of_rooms {
    mesh m;
    uint32_t *order;
    plane_tree tree;
    block_factors made;
    form_factors f;
} blocks_of_rooms;

static const recipe blocks_recipe = {.source = &source_blocks, .rays = 64, .accuracy = 3e-4, .seed = 5};

static void blocks_find_of(blocks_of_rooms *s, const char *sky) {
    s->order = calloc(s->m.n, sizeof *s->order);
    for (uint32_t i = 0; i < s->m.n; i++) s->order[i] = i;
    recipe r = blocks_recipe;
    if (sky != NULL) r.rays = 4096;
    const form_factor_options how = {.recipe = r, .sky = sky};
    ck_ok(form_factors_tree(&s->m, &s->tree, &error));
    ck_ok(form_factors_make_blocks(&s->m, s->order, &s->tree, NULL, &how, &s->f, &s->made, &error));
}

/* Of squares that are halved so many times. */
static void blocks_setup(int levels, int panes, bool sheet, double T, bool by_angle, blocks_of_rooms *s) {
    const mesh_refinement finer = {.subdivide_levels = levels};
    *s = (blocks_of_rooms){.m = two_rooms(panes, sheet)};
    ck_ok(mesh_refine(&s->m, &finer, &error));
    glaze(&s->m, T, panes, by_angle);
    blocks_find_of(s, NULL);
}

static void blocks_teardown(blocks_of_rooms *s) {
    block_factors_free(&s->made);
    form_factors_free(&s->f);
    plane_tree_free(&s->tree);
    free(s->order);
    mesh_free(&s->m);
}

/* Mean irradiance of the east side by the exitance 1 of the west side. */
static double east_by_west(const mesh *m, const block_factors *blocks) {
    const size_t west = group_find(m, "west"), east = group_find(m, "east");
    const factor_product product = block_factors_product(blocks);
    double *E = calloc(m->n, sizeof *E), *H = calloc(m->n, sizeof *H), sum = 0, area = 0;
    for (size_t i = 0; i < m->n; i++) E[i] = m->group[i] == west ? 1 : 0;
    ck_ok(product.multiply(product.context, 1, E, H, &error));
    for (size_t i = 0; i < m->n; i++) {
        if (m->group[i] != east) continue;
        area += m->area[i];
        sum += m->area[i] * H[i];
    }
    free(E);
    free(H);
    return sum / area;
}

/* By single pairs, by clusters, through a sheet and through two panes; a judge's segments are those of the
 * whole scene. */
START_TEST(blocks_pass_light_from_room_to_room) {
    static const int levels[] = {0, 2, 1, 1, 0}, panes[] = {1, 1, 1, 2, 1};
    const bool clear = _i == 4; /* of all light, as if nothing were there: .0686 of two squares */
    const double wanted = clear ? .06859 : through(false, .78);
    blocks_of_rooms s;
    blocks_setup(levels[_i], panes[_i], _i == 2, clear ? 1 : .78, !clear, &s);
    ck_assert(s.f.closed);
    ck_assert_double_eq_tol(east_by_west(&s.m, &s.made), wanted, noise * wanted);
    ck_assert_ptr_nonnull(s.f.through);
    for (size_t i = 0; i < s.m.n; i++) {
        ck_assert_double_ge(s.f.through[i], 0);
        ck_assert_double_le(s.f.through[i], mesh_row_most(&s.m) - 1);
        ck_assert_double_eq_tol(s.f.row_sums[i], 1 + s.f.through[i], 2e-3);
    }
    form_factors judge;
    block_factors again;
    recipe other = blocks_recipe;
    other.seed = 77;
    const form_factor_options how = {.recipe = other, .row_sums = s.f.row_sums};
    ck_ok(form_factors_make_blocks(&s.m, s.order, &s.tree, &s.f, &how, &judge, &again, &error));
    ck_assert_double_eq_tol(east_by_west(&s.m, &again), wanted, noise * wanted);
    for (size_t i = 0; i < s.m.n; i++) ck_assert_double_eq_tol(judge.row_sums[i], 1 + judge.through[i], 2e-3);
    block_factors_free(&again);
    form_factors_free(&judge);
    blocks_teardown(&s);
}
END_TEST

/* Light of an even sky that comes to a group of elements, W. */
static double sky_of(const mesh *m, const sky_bounce *sky, const char *name) {
    const size_t group = group_find(m, name);
    double sum = 0;
    for (size_t t = 0; t < sky->tiling.n_tiles; t++)
        for (size_t i = 0; i < m->n; i++)
            if (m->group[i] == group) sum += m->area[i] * (double)sky->first_bounce[t * m->n + i];
    return sum;
}

/* A room with an open side before a pane, and one behind it: light that the pane passes to elements takes
 * nothing of the sky's. */
START_TEST(a_sky_beside_a_pane_is_whole) {
    static const char *const groups[] = {"floor", "north", "west", "pane"};
    obj_text w = {.used = 0};
    put_group(&w, "west", (const double[3]){0, 0, 0}, Y, Z, 6);
    put_sides(&w, 0, 6);
    put_sides(&w, 2, 6);
    put_group(&w, "pane", (const double[3]){2, 0, 0}, Y, Z, 4);
    blocks_of_rooms s = {.m = obj_text_mesh(&w)};
    glaze(&s.m, .78, 1, true);
    blocks_find_of(&s, "tregenza");
    const form_factors rays = make(&s.m, &recipes[2], "tregenza");
    for (size_t k = 0; k < sizeof groups / sizeof *groups; k++) {
        const double wanted = sky_of(&s.m, &rays.sky, groups[k]);
        ck_assert_double_gt(wanted, 0);
        ck_assert_double_eq_tol(sky_of(&s.m, &s.f.sky, groups[k]), wanted, noise * wanted);
    }
    form_factors again = rays;
    form_factors_free(&again);
    blocks_teardown(&s);
}
END_TEST

/* Half of the side between the rooms is a pane, the other half a wall in its plane: by blocks as by rays. */
START_TEST(a_wall_in_the_plane_of_a_pane) {
    const mesh_refinement finer = {.subdivide_levels = 3};
    obj_text w = {.used = 0};
    put_group(&w, "west", (const double[3]){0, 0, 0}, Y, Z, 1);
    put_sides(&w, 0, 1);
    put_sides(&w, 2, 1);
    put_group(&w, "east", (const double[3]){4, 0, 0}, Z, Y, 1);
    obj_text_put(&w, "v 2 0 0\nv 2 1 0\nv 2 2 0\nv 2 0 2\nv 2 1 2\nv 2 2 2\n");
    obj_text_put(&w, "o pane\nf -6 -5 -2 -3\no wall\nf -5 -4 -1 -2\nf -2 -1 -4 -5\n");
    blocks_of_rooms s = {.m = obj_text_mesh(&w)};
    ck_ok(mesh_refine(&s.m, &finer, &error));
    glaze(&s.m, .78, 1, true);
    blocks_find_of(&s, NULL);
    form_factors rays = make(&s.m, &recipes[2], NULL);
    const double wanted = share(&s.m, &rays, "west", "east");
    ck_assert_double_gt(wanted, .01);
    ck_assert_double_lt(wanted, .04);
    ck_assert_double_eq_tol(east_by_west(&s.m, &s.made), wanted, noise * wanted);
    form_factors_free(&rays);
    blocks_teardown(&s);
}
END_TEST

/* The first light of a judge of blocks, in two halves. */
START_TEST(light_of_sources_passes_panes) {
    const double wanted = through(false, .78);
    blocks_of_rooms s;
    block_light *l = NULL;
    bool known = false;
    blocks_setup(1, 1, false, .78, true, &s);
    float *E = calloc(s.m.n, sizeof *E);
    double *H = calloc(s.m.n, sizeof *H), *D = calloc(s.m.n, sizeof *D), sum = 0, area = 0;
    for (size_t i = 0; i < s.m.n; i++) E[i] = s.m.group[i] == group_find(&s.m, "west") ? 1 : 0;
    ck_ok(block_light_create(&s.m, &s.tree, 1e-5, 3, &l, &error));
    ck_ok(block_light_of(l, E, H, D, &known, &error));
    ck_assert(known);
    for (size_t i = 0; i < s.m.n; i++) {
        if (s.m.group[i] != group_find(&s.m, "east")) continue;
        area += s.m.area[i];
        sum += s.m.area[i] * H[i];
    }
    ck_assert_double_eq_tol(sum / area, wanted, noise * wanted);
    block_light_destroy(l);
    free(E);
    free(H);
    free(D);
    blocks_teardown(&s);
}
END_TEST

START_TEST(reflectance_leaves_room_for_what_passes) {
    mesh m = two_rooms(1, false); /* of .5 */
    const glass_report report = glaze(&m, .78, 1, true);
    ck_assert_uint_eq(report.limited, 4);
    ck_assert_double_eq(report.limited_most, .5);
    for (size_t i = 0; i < m.n; i++) {
        const double rho = (double)m.reflectance[i];
        if (mesh_is_pane(&m, i))
            ck_assert_double_le(rho + .78, 1 + 1e-7);
        else
            ck_assert_double_eq(rho, .5);
    }
    mesh_free(&m);
}
END_TEST

/* A store keeps panes and their law, and wrong numbers are refused by their place. */
START_TEST(stores_keep_panes) {
    char folder[64], path[256];
    mesh m = two_rooms(1, false), again = {0};
    store *s = NULL;
    glaze(&m, .78, 2, false);
    folder_make(folder);
    for (int wrong = 0; wrong < 3; wrong++) {
        snprintf(path, sizeof path, "%s/panes-%d.h5", folder, wrong);
        ck_ok(store_create(path, &s, &error));
        if (wrong == 1) m.glass[group_find(&m, "pane")].transmittance = 1.5;
        if (wrong == 2) m.glass[group_find(&m, "pane")] = (struct group_glass){.5, 0};
        ck_ok(mesh_save(&m, NULL, s, &error));
        ck_ok(store_seal(s, &error));
        ck_ok(store_open(path, &s, &error));
        if (wrong > 0) {
            ck_assert_int_eq(mesh_load(s, &again, NULL, &error), LAM_ERR_FORMAT);
            ck_assert_ptr_nonnull(strstr(error.message, "/mesh/glass["));
        } else {
            ck_ok(mesh_load(s, &again, NULL, &error));
            ck_assert_uint_eq(again.n_glass, m.n_groups);
            ck_assert_mem_eq(again.glass, m.glass, m.n_groups * sizeof *m.glass);
            ck_assert(!again.glass_by_angle);
            mesh_free(&again);
        }
        store_close(s);
    }
    folder_remove(folder);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("panes");
    TCase *tests = tcase_create("panes");
    tcase_add_test(tests, the_law_of_a_pane);
    tcase_add_loop_test(tests, light_passes_from_room_to_room, 0, RECIPES);
    tcase_add_test(tests, panes_of_several_faces);
    tcase_add_loop_test(tests, an_even_sky_shines_through, 0, RECIPES + 1);
    tcase_add_loop_test(tests, blocks_pass_light_from_room_to_room, 0, 5);
    tcase_add_test(tests, a_sky_beside_a_pane_is_whole);
    tcase_add_test(tests, a_wall_in_the_plane_of_a_pane);
    tcase_add_test(tests, light_of_sources_passes_panes);
    tcase_add_test(tests, reflectance_leaves_room_for_what_passes);
    tcase_add_test(tests, stores_keep_panes);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
