/* The visible share of pairs with few occluders: the cut of a target against brute subdivision of it, pairs
 * against exact values, and openings between rooms. */
#include "solver/base/random.h"
#include "solver/formfactor/pairs/few_occluders.h"
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/sight/shadow_cut.h"
#include "support/plates_pair.h"
#include "support/suite.h"

#include <math.h>
#include <omp.h>

/* Scenes of occluders by chance, and of rooms with a hole by its size and the thickness of the wall. A
 * sanitizer watches the same code in each, so that a hole in walls with and without a reveal is enough, and
 * over seeds one without. */
#ifdef LAMBERT_FEW_CASES
enum { CUT_SCENES = 1, HOLES_FIRST = 6, HOLES_LAST = 9, SEEN_FIRST = 6, SEEN_LAST = 7 };
#else
enum { CUT_SCENES = 4, HOLES_FIRST = 0, HOLES_LAST = 15, SEEN_FIRST = 3, SEEN_LAST = 9 };
#endif

static double unit(uint64_t *state) {
    return random_lcg_unit(state);
}

/* A triangle or a quad about a place between and around the plates, of any direction: some cross the target's
 * plane, some lie behind it, behind the point's plane, or are slivers. */
static void add_random_occluder(mesh *m, uint64_t *state) {
    double at[3], one[3], two[3], corner[4][3];
    const double size = unit(state) < .2 ? .02 : .1 + .5 * unit(state), thin = unit(state) < .2 ? 1e-3 : 1;
    for (int d = 0; d < 3; d++) {
        at[d] = (d == 2 ? -.1 : -.3) + (d == 2 ? 1.2 : 1.6) * unit(state);
        one[d] = size * (2 * unit(state) - 1);
        two[d] = thin * size * (2 * unit(state) - 1);
    }
    if (unit(state) < .3) one[2] = two[2] = 0;            /* parallel to the plates */
    if (unit(state) < .1) at[2] = one[2] = two[2] = 0;    /* in the plane of the point */
    if (unit(state) < .1) at[2] = 1, one[2] = two[2] = 0; /* in that of the target */
    for (int d = 0; d < 3; d++) {
        corner[0][d] = at[d];
        corner[1][d] = at[d] + one[d];
        corner[2][d] = at[d] + one[d] + two[d];
        corner[3][d] = at[d] + two[d];
    }
    mesh_add_quad(m, (const double(*)[3])corner);
    if (unit(state) < .4) m->elements[m->n - 1][3] = MESH_NO_VERTEX;
}

/* Brute force: does the segment cross the occluder? The signs of volumes of tetrahedra tell it, not
 * planes. */
static double volume(const double a[3], const double b[3], const double c[3], const double d[3]) {
    double u[3], v[3], w[3];
    for (int k = 0; k < 3; k++) u[k] = b[k] - a[k], v[k] = c[k] - a[k], w[k] = d[k] - a[k];
    return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
           u[2] * (v[0] * w[1] - v[1] * w[0]);
}

static bool crosses(const mesh *m, size_t element, const double x[3], const double y[3]) {
    const size_t n = mesh_corners(m, element);
    const double *c[4];
    for (size_t k = 0; k < n; k++) c[k] = m->vertices[m->elements[element][k]];
    for (size_t k = 1; k + 1 < n; k++) {
        const double from = volume(c[0], c[k], c[k + 1], x), to = volume(c[0], c[k], c[k + 1], y);
        if (!(from * to < 0)) continue;
        const double one = volume(x, y, c[0], c[k]), two = volume(x, y, c[k], c[k + 1]),
                     three = volume(x, y, c[k + 1], c[0]);
        if ((one > 0) == (two > 0) && (two > 0) == (three > 0)) return true;
    }
    return false;
}

static bool blocked(const mesh *m, const double x[3], const double y[3]) {
    for (size_t e = 2; e < m->n; e++)
        if (crosses(m, e, x, y)) return true;
    return false;
}

/* F from x = (x, y, 0) to the visible part of the unit square at z = 1 by N x N cells. unsure: that of cells
 * beside one of another state, which bounds the error of cells that a shadow's edge crosses. */
static double brute_factor(const mesh *m, const double x[3], double *unsure) {
    enum { N = 160 };
    static bool dark[N][N];
    static double part[N][N];
    double sum = 0;
    *unsure = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double y[3] = {(i + .5) / N, (j + .5) / N, 1};
            double r2 = 1;
            for (int d = 0; d < 2; d++) r2 += (y[d] - x[d]) * (y[d] - x[d]);
            part[i][j] = 1 / (M_PI * r2 * r2 * N * N);
            dark[i][j] = blocked(m, x, y);
            sum += dark[i][j] ? 0 : part[i][j];
        }
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            bool differs = false;
            for (int p = i - 1; p <= i + 1; p++)
                for (int q = j - 1; q <= j + 1; q++)
                    differs = differs || (p >= 0 && q >= 0 && p < N && q < N && dark[p][q] != dark[i][j]);
            if (differs) *unsure += part[i][j];
        }
    return sum;
}

/* Every way in which an occluder can lie. A sliver thinner than a cell is seen by no neighbour: its shadow is
 * at most .02 x 1e-3 long and wide, or .6 x 6e-4, magnified by 1 over its height, and those near the point
 * are left out by the tolerance's last term for all but points in them, which sums of areas cannot show. */
START_TEST(cut_is_brute_subdivision) {
    uint64_t state = 11 + (uint64_t)_i;
    size_t partial = 0;
    for (int trial = 0; trial < 12; trial++) {
        plates_pair s;
        link_occluders all = {.count = 0};
        const size_t count = 1 + (size_t)(unit(&state) * UNCUT_OCCLUDERS_MOST);
        mesh m = plates(NULL);
        for (size_t k = 0; k < count; k++) add_random_occluder(&m, &state);
        plates_pair_open(&s, m);
        ck_assert_uint_le(s.occluders.n, LINK_OCCLUDERS_MOST);
        for (size_t k = 0; k < s.occluders.n; k++) all.of[all.count++] = (uint32_t)k;
        const projection p = {.occluders = &s.occluders};
        const projected_pair pair = {0, 1, &s.a, &s.b, &s.among, 0};
        for (int point = 0; point < 4; point++) {
            const double x[3] = {unit(&state), unit(&state), 0}, up[3] = {0, 0, 1};
            double full, unsure;
            const double found = projection_point_factor(&p, &pair, x, up, &full);
            const double brute = brute_factor(&s.m, x, &unsure);
            ck_assert_double_ge(found, 0);
            ck_assert_double_le(found, full);
            /* Midpoints of cells err by about 1/N^2 of the whole; lone dark cells are slivers. */
            ck_assert_msg(fabs(found - brute) <= unsure + 1e-4 * full, "trial %d: %.9g, not %.9g within %g",
                          trial, found, brute, unsure);
            partial += found > 0 && found < full - 1e-9;
            /* Occluders that planes throw out block nothing. */
            pair_occluders left;
            const uint32_t none[2] = {MESH_NO_VERTEX - 1, MESH_NO_VERTEX - 1};
            pair_occluders_find(&s.occluders, &all, &s.a, &s.b, none, (const double[2]){0, 0}, &left);
            ck_assert_int_ne(left.count, OCCLUDERS_UNCOUNTED);
            const projected_pair sifted = {0, 1, &s.a, &s.b, &left, 0};
            const double again = left.hidden ? 0 : projection_point_factor(&p, &sifted, x, up, NULL);
            ck_assert_double_eq_tol(again, found, 1e-9);
        }
        plates_pair_close(&s);
    }
    ck_assert_uint_gt(partial, 8);
}
END_TEST

static csr exchange(const mesh *m, double accuracy, uint64_t seed, pairs_report *report) {
    const pairs_options options = {.tolerance = 1e-8,
                                   .accuracy = accuracy,
                                   .segments = 8,
                                   .segments_most = 1e12,
                                   .occluders = UNCUT_OCCLUDERS_MOST,
                                   .seed = seed};
    lam_error error = {0};
    visibility *v = NULL;
    csr G = {0};
    ck_assert_msg(visibility_create(m, &v, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(pairs_exchange(m, v, &options, &G, report, NULL, &error) == LAM_OK, "%s", error.message);
    visibility_destroy(v);
    return G;
}

/* The accuracy is that of a factor; the exact values are far beyond it, also where the places are 1e6 away,
 * where single precision leaves .06 m of the coordinates of segments and joins. */
START_TEST(occluded_plates_are_exact) {
    static const double accuracies[] = {1e-4, 1e-6};
    for (size_t c = 1; c < sizeof plates_cases / sizeof *plates_cases; c++) {
        mesh m = plates(plates_cases[c].occluder);
        plates_move(&m, plates_places[_i][0], plates_places[_i][1]);
        for (int a = 0; a < 2; a++)
            for (uint64_t seed = 1; seed <= 3; seed++) {
                pairs_report report;
                csr G = exchange(&m, accuracies[a], seed, &report);
                ck_assert_double_eq(report.projected, 1);
                ck_assert_double_eq(report.mixed, 0);
                /* And what single precision of an entry rounds. */
                ck_assert_double_eq_tol(csr_entry(&G, 0, 1) / m.area[0], plates_cases[c].F,
                                        accuracies[a] + 1e-7);
                csr_free(&G);
            }
        mesh_free(&m);
    }
    mesh m = plates(plates_hidden);
    plates_move(&m, plates_places[_i][0], plates_places[_i][1]);
    pairs_report report;
    csr G = exchange(&m, 1e-4, 1, &report);
    ck_assert_double_eq(csr_entry(&G, 0, 1), 0); /* exactly: edges must not leak */
    csr_free(&G);
    mesh_free(&m);
}
END_TEST

/* Quarters that together hide all, none of which does alone: the pieces meet without a crack. */
START_TEST(pieces_leave_no_crack) {
    static const double from[4][4] = {{0, .4, 0, .7}, {.4, 1, 0, .7}, {0, .4, .7, 1}, {.4, 1, .7, 1}};
    for (int pieces = 3; pieces <= 4; pieces++) {
        mesh m = plates(NULL);
        for (int k = 0; k < pieces; k++) {
            const double z = .5 + .0 * k;
            const box_cell c = {.axis = 2,
                                .level = z,
                                .from = {from[k][0], from[k][2], z},
                                .to = {from[k][1], from[k][3], z}};
            mesh_add_cell(&m, &c, true);
        }
        lam_error error = {0};
        free(m.area);
        free(m.normal);
        m.area = NULL;
        m.normal = NULL;
        ck_assert(mesh_measure(&m, &error) == LAM_OK);
        pairs_report report;
        csr G = exchange(&m, 1e-5, 1, &report);
        if (pieces == 4) ck_assert_double_eq_tol(csr_entry(&G, 0, 1), 0, 1e-12);
        if (pieces == 3) ck_assert_double_gt(csr_entry(&G, 0, 1), .01);
        csr_free(&G);
        mesh_free(&m);
    }
}
END_TEST

/* A floor and a wall that share an edge with a partition across both leave each half with its half. */
START_TEST(touching_elements_are_exact) {
    const box_cell floor = {.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {1, 1, 0}},
                   side = {.axis = 0, .level = 0, .from = {0, 0, 0}, .to = {0, 1, 1}},
                   partition = {.axis = 1, .level = .5, .from = {0, .5, 0}, .to = {1, .5, 1}},
                   half_floor = {.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {1, .5, 0}},
                   half_side = {.axis = 0, .level = 0, .from = {0, 0, 0}, .to = {0, .5, 1}};
    mesh m = {0}, half = {0};
    mesh_add_cell(&m, &floor, true);
    mesh_add_cell(&m, &side, true);
    mesh_add_cell(&m, &partition, true);
    mesh_add_cell(&m, &partition, false);
    mesh_finish(&m, .5f);
    mesh_add_cell(&half, &half_floor, true);
    mesh_add_cell(&half, &half_side, true);
    mesh_finish(&half, .5f);
    pairs_report report;
    csr of_half = exchange(&half, 1e-5, 1, &report);
    for (int a = 0; a < 2; a++) {
        const double accuracy = a == 0 ? 1e-4 : 1e-5;
        csr G = exchange(&m, accuracy, 1, &report);
        ck_assert_double_eq(report.projected, 1);
        ck_assert_double_eq_tol(csr_entry(&G, 0, 1), 2 * csr_entry(&of_half, 0, 1), accuracy);
        csr_free(&G);
    }
    csr_free(&of_half);
    mesh_free(&m);
    mesh_free(&half);
}
END_TEST

/* A wall with a square hole between two rooms, as cells about the hole. */
static void add_wall(mesh *m, double x, bool positive, double hole) {
    const double lines[6] = {0, .6, 1.5 - hole / 2, 1.5 + hole / 2, 2.4, 3};
    for (int i = 0; i < 5; i++)
        for (int j = 0; j < 5; j++) {
            const box_cell c = {.axis = 0,
                                .level = x,
                                .from = {x, lines[i], lines[j]},
                                .to = {x, lines[i + 1], lines[j + 1]}};
            if (i != 2 || j != 2) mesh_add_cell(m, &c, positive);
        }
}

static void add_other_walls(mesh *m, double from, bool second) {
    const double size[3] = {3, 3, 3};
    for (size_t k = 0; k < 6 * 4 * 4; k++) {
        box_cell c = box_cell_of(size, 4, k);
        if (c.axis == 0 && (c.level == 0) == second) continue;
        const bool inward = c.level == 0;
        c.from[0] += from, c.to[0] += from;
        if (c.axis == 0) c.level += from;
        mesh_add_cell(m, &c, inward);
    }
}

static double opposed_squares(double a, double c) {
    if (!(c > 0)) return 1;
    const double x = a / c, s = sqrt(1 + x * x);
    return 2 / (M_PI * x * x) *
           (log(s * s / sqrt(1 + 2 * x * x)) + 2 * x * s * atan(x / s) - 2 * x * atan(x));
}

/* Two rooms with a hole between them and its reveal: elements up to first are of one, up to second of the
 * other. */
static mesh rooms_with_hole(double hole, double thickness, size_t *first, size_t *second) {
    mesh m = {0};
    add_other_walls(&m, 0, false);
    add_wall(&m, 3, false, hole);
    *first = m.n;
    add_other_walls(&m, 3 + thickness, true);
    add_wall(&m, 3 + thickness, true, hole);
    *second = m.n;
    if (thickness > 0) {
        const double low = 1.5 - hole / 2, high = 1.5 + hole / 2;
        for (int axis = 1; axis < 3; axis++)
            for (int end = 0; end < 2; end++) {
                box_cell c = {.axis = axis,
                              .level = end == 0 ? low : high,
                              .from = {3, low, low},
                              .to = {3 + thickness, high, high}};
                c.from[axis] = c.to[axis] = c.level;
                mesh_add_cell(&m, &c, end == 0);
            }
    }
    mesh_finish(&m, .5f);
    return m;
}

static const double holes[] = {.02, .1, .2, .5, 1}, walls[] = {0, .02, .2};

/* All the light from one room that reaches the other one passes the hole, or both ends of the reveal: the
 * exchange of both rooms is hole^2, times F of two opposed squares. Two bounds hold, on both sides. First,
 * each projected pair errs by a third of accuracy x area at most, independently, so that the sum stays within
 * three times the root of the sum of squares. Second, where that is more than what passes: a window cuts an
 * element to what sees the other one, and F rises from 0 to a plateau at both ends of each of its sides.
 * Cells are cut where it ends, unless that is within .02 of a side; such a ramp is taken as the plateau,
 * which adds .02 / 2 of the side at each of two ends and along both directions: .04 of the light. A break
 * elsewhere moves by half of the largest weight, .16, at most, two of them by a third of the pair's light,
 * independently: three times the root of the sum of their squares is the root of the sum of g^2. */
START_TEST(openings_lose_nothing) {
    const double hole = holes[_i / 3], thickness = walls[_i % 3], accuracy = 7e-6;
    size_t first, second;
    mesh m = rooms_with_hole(hole, thickness, &first, &second);
    pairs_report report;
    csr G = exchange(&m, accuracy, 1, &report);
    double sum = 0, asked = 0, square = 0;
    for (size_t i = 0; i < first; i++)
        for (size_t j = first; j < second; j++) {
            const double g = csr_entry(&G, i, j), bound = accuracy / 3 * fmin(m.area[i], m.area[j]);
            sum += g;
            square += g * g;
            if (g > 0) asked += bound * bound;
        }
    const double truth = hole * hole * opposed_squares(hole, thickness);
    const double within = fmin(3 * sqrt(asked), .04 * truth + sqrt(square));
    ck_assert_double_eq(report.mixed, 0);
    ck_assert_msg(fabs(sum - truth) <= within, "hole %g, wall %g: %g, not %g within %g", hole, thickness, sum,
                  truth, within);
    csr_free(&G);
    mesh_free(&m);
}
END_TEST

/* The same at the accuracy of the preset, over seeds: what passes is right on average, though each pair has
 * less of it than the accuracy. Every pair is found to .01 of its light, independently of others, so that the
 * mean is within two of its standard errors and of the root of the sum of squares of those shares. */
START_TEST(openings_let_no_more_through) {
    enum { SEEDS = 16 };
    const double hole = holes[_i / 3], thickness = walls[_i % 3], accuracy = 7e-5;
    const double truth = hole * hole * opposed_squares(hole, thickness);
    size_t first, second;
    mesh m = rooms_with_hole(hole, thickness, &first, &second);
    double mean = 0, squares = 0, shares = 0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        pairs_report report;
        csr G = exchange(&m, accuracy, seed, &report);
        double sum = 0;
        for (size_t i = 0; i < first; i++)
            for (size_t j = first; j < second; j++) {
                const double g = csr_entry(&G, i, j);
                sum += g;
                shares += g * g / SEEDS;
            }
        mean += sum / SEEDS;
        squares += sum * sum / SEEDS;
        csr_free(&G);
    }
    const double error = sqrt(fmax(squares - mean * mean, 0) / (SEEDS - 1));
    const double within = 2 * hypot(error, .01 * sqrt(shares));
    ck_assert_msg(fabs(mean - truth) <= within, "hole %g, wall %g: %g, not %g within %g", hole, thickness,
                  mean, truth, within);
    mesh_free(&m);
}
END_TEST

/* A closed room with a box in it: rows sum to 1, bits are the same for any number of threads, and two seeds
 * have errors of their own, half of whose distance is about as large as the error of either. */
START_TEST(closed_room_with_a_box) {
    const double size[3] = {3, 3, 2}, box[3] = {.9, 1.1, .8};
    const double accuracy = 1e-4;
    mesh m = box_mesh(size, 4, .5f);
    for (size_t k = 0; k < 6 * 2 * 2; k++) {
        box_cell c = box_cell_of(box, 2, k);
        const bool outward = c.level != 0;
        const double move[3] = {.83, .67, .31};
        for (int d = 0; d < 3; d++) c.from[d] += move[d], c.to[d] += move[d];
        c.level += move[c.axis];
        mesh_add_cell(&m, &c, outward);
    }
    lam_error error = {0};
    free(m.area);
    free(m.normal);
    m.area = NULL;
    m.normal = NULL;
    ck_assert(mesh_measure(&m, &error) == LAM_OK);
    float *grey = realloc(m.reflectance, m.n * sizeof *grey);
    ck_assert_ptr_nonnull(grey);
    for (size_t i = 0; i < m.n; i++) grey[i] = .5f;
    m.reflectance = grey;
    pairs_report report;
    csr G[3], fine = exchange(&m, 1e-6, 9, &report);
    const int threads = omp_get_max_threads();
    for (int k = 0; k < 3; k++) {
        omp_set_num_threads(k == 1 ? 4 : 1);
        G[k] = exchange(&m, accuracy, k == 2 ? 2 : 1, &report);
    }
    omp_set_num_threads(threads);
    ck_assert_double_gt(report.projected, m.n);
    ck_assert_double_eq(report.mixed, 0);
    ck_assert_uint_eq(G[0].indptr[m.n], G[1].indptr[m.n]);
    ck_assert_mem_eq(G[0].data, G[1].data, G[0].indptr[m.n] * sizeof *G[0].data);
    double wrong[2] = {0, 0}, apart = 0, worst = 0;
    for (size_t i = 0; i < m.n; i++)
        for (size_t j = i + 1; j < m.n; j++) {
            const double area = fmin(m.area[i], m.area[j]), exact = csr_entry(&fine, i, j) / area;
            const double one = csr_entry(&G[0], i, j) / area, two = csr_entry(&G[2], i, j) / area;
            wrong[0] += (one - exact) * (one - exact);
            wrong[1] += (two - exact) * (two - exact);
            apart += .25 * (one - two) * (one - two);
            worst = fmax(worst, fabs(one - exact));
        }
    /* The tolerance asked of a pair is a third of the accuracy, by an estimate. */
    ck_assert_double_le(worst, accuracy);
    /* Independent errors would have sqrt(1/2); half of that would still warn. */
    for (int k = 0; k < 2; k++) ck_assert_double_ge(sqrt(apart), .35 * sqrt(wrong[k]));
    for (size_t i = 0; i < m.n; i++) {
        double sum = 0;
        for (size_t j = 0; j < m.n; j++)
            if (j != i) sum += i < j ? csr_entry(&fine, i, j) : csr_entry(&fine, j, i);
        /* Each of its pairs within the accuracy. */
        ck_assert_double_eq_tol(sum / m.area[i], 1, 1e-6 * (double)m.n);
    }
    for (int k = 0; k < 3; k++) csr_free(&G[k]);
    csr_free(&fine);
    mesh_free(&m);
}
END_TEST

/* Plates, half hidden by one square between them, in a scene of more than FEW_OCCLUDERS: `pieces` squares lie
 * aside in one plane, or at different heights between the plates. */
static mesh plates_among_many(bool between, size_t pieces) {
    mesh m = plates(NULL);
    mesh more = {0};
    for (size_t e = 0; e < m.n; e++) {
        double corner[4][3];
        for (int c = 0; c < 4; c++) memcpy(corner[c], m.vertices[m.elements[e][c]], sizeof corner[c]);
        mesh_add_quad(&more, (const double(*)[3])corner);
    }
    mesh_free(&m);
    for (size_t k = 0; k <= pieces; k++) {
        const bool hides = k == pieces;
        const double x = hides ? 0 : (between ? .05 : 3) + .05 * (double)(k % 18),
                     y = hides ? 0 : .05 * (double)(k / 18);
        const double z = hides || !between ? .5 : .2 + .001 * (double)k, width = hides ? .5 : .03,
                     depth = hides ? 1 : .03;
        const double corner[4][3] = {
            {x, y, z}, {x + width, y, z}, {x + width, y + depth, z}, {x, y + depth, z}};
        mesh_add_quad(&more, corner);
    }
    mesh_finish(&more, .5f);
    return more;
}

/* With few candidates between most clusters the pair of plates is projected, and exact as it is alone; with
 * many it gets segments. */
START_TEST(scenes_of_many_occluders_project_where_few_stand_between) {
    enum { PIECES = 300 };
    for (int between = 0; between < 2; between++) {
        pairs_report report;
        mesh m = plates_among_many(between == 1, PIECES);
        csr G = exchange(&m, 1e-4, 1, &report);
        const double F = csr_entry(&G, 0, 1) / m.area[0];
        if (between == 1) ck_assert_double_eq(report.projected, 0);
        if (between == 1) ck_assert_double_lt(F, plates_cases[2].F - 1e-3);
        if (between == 0) ck_assert_double_ge(report.projected, 1);
        if (between == 0) ck_assert_double_eq_tol(F, plates_cases[2].F, 1e-4 + 1e-7);
        csr_free(&G);
        mesh_free(&m);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("projection");
    TCase *cases = tcase_create("projection");
    tcase_set_timeout(cases, 300);
    tcase_add_loop_test(cases, cut_is_brute_subdivision, 0, CUT_SCENES);
    tcase_add_loop_test(cases, occluded_plates_are_exact, 0, sizeof plates_places / sizeof *plates_places);
    tcase_add_test(cases, pieces_leave_no_crack);
    tcase_add_test(cases, touching_elements_are_exact);
    tcase_add_loop_test(cases, openings_lose_nothing, HOLES_FIRST, HOLES_LAST);
    tcase_add_loop_test(cases, openings_let_no_more_through, SEEN_FIRST, SEEN_LAST);
    tcase_add_test(cases, closed_room_with_a_box);
    tcase_add_test(cases, scenes_of_many_occluders_project_where_few_stand_between);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
