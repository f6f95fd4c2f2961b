/* Paths that serve all positions of a light against closed forms and against paths of their own. */
#include "solver/method/reference.h"
#include "solver/walk/reuse.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"

#include <omp.h>

static const double unit[3] = {1, 1, 1};
enum { DIVISIONS = 4, POSITIONS = 4 };

/* A square of a quarter of a side in the plane z = 0, which looks down, and where it is carried: along a line
 * below the ceiling, and turned to look along x. */
static moving_light square_light(void) {
    static const double corners[4][3] = {{0, 0, 0}, {0, .25, 0}, {.25, .25, 0}, {.25, 0, 0}};
    static const double moves[POSITIONS][3] = {
        {.25, .25, .75}, {.375, .25, .75}, {.6, .5, .75}, {.25, .5, .3}};
    moving_light l;
    lam_error error = {.message = ""};
    double(*corner)[3] = test_allocate(4, sizeof *corner);
    memcpy(corner, corners, sizeof corners);
    ck_ok(moving_light_create(4, corner, &l, &error));
    l.n = POSITIONS;
    l.pose = test_allocate(POSITIONS, sizeof *l.pose);
    l.emission[0] = 3;
    for (size_t k = 0; k < POSITIONS; k++) {
        l.pose[k].name = strdup("a position");
        for (int d = 0; d < 3; d++) {
            l.pose[k].move[d] = moves[k][d];
            l.pose[k].turn[d][d] = 1;
        }
    }
    /* Turned about y: (x, y, z) becomes (-z, y, x), and what looks down looks along x. */
    static const double about_y[3][3] = {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}};
    memcpy(l.pose[3].turn, about_y, sizeof about_y);
    return l;
}

/* The cell that a pose of the square covers. */
static box_cell cell_at(const light_pose *p, bool along_x) {
    box_cell c = {.axis = along_x ? 0 : 2, .level = p->move[along_x ? 0 : 2]};
    for (int d = 0; d < 3; d++) {
        c.from[d] = p->move[d];
        c.to[d] = p->move[d] + (d == c.axis ? 0 : .25);
    }
    return c;
}

/* The light that comes straight from the square, exactly, [s][n], of the emission 1. */
static double *exact_direct(const mesh *m, const moving_light *l) {
    double *direct = test_allocate(POSITIONS * m->n, sizeof *direct);
    for (size_t k = 0; k < POSITIONS; k++) {
        const box_cell light = cell_at(&l->pose[k], k == 3);
        for (size_t i = 0; i < m->n; i++) {
            const box_cell cell = box_cell_of(unit, DIVISIONS, i);
            const int a = light.axis;
            /* In front of the light lies what is below it, or beyond it along x. */
            const bool before =
                a == 0 ? cell.from[0] >= light.level - 1e-12 : cell.to[2] <= light.level + 1e-12;
            const bool same = cell.axis == a && fabs(cell.level - light.level) < 1e-12;
            direct[k * m->n + i] = before && !same ? box_exchange(&cell, &light) / m->area[i] : 0;
        }
    }
    return direct;
}

/* Irradiance H [s][n] in the empty box, exactly: first light by closed forms, and all bounces. */
static double *exact_light(const mesh *m, const moving_light *l, const csr *F) {
    const size_t n = m->n;
    double *H = test_allocate(POSITIONS * n, sizeof *H), *E = test_allocate(POSITIONS * n, sizeof *E);
    reference *r = NULL;
    lam_error error = {.message = ""};
    double *direct = exact_direct(m, l);
    for (size_t k = 0; k < POSITIONS * n; k++)
        H[k] = E[k] = (double)m->reflectance[k % n] * l->emission[0] * direct[k];
    ck_ok(reference_create(F, m->area, m->reflectance, REFERENCE_DENSE, &r, &error));
    ck_ok(reference_solve(r, POSITIONS, E, H, 1e-12, NULL, &error));
    for (size_t k = 0; k < POSITIONS * n; k++) H[k] /= (double)m->reflectance[k % n];
    reference_destroy(r);
    free(direct);
    free(E);
    return H;
}

static reuse_estimates solve(const mesh *m, const reuse_problem *problem) {
    walk_scene *s = NULL;
    reuse_estimates e;
    lam_error error = {.message = ""};
    ck_ok(walk_scene_create(m, CLOSURE_MEASURED, &s, &error));
    ck_ok(walk_reuse(s, problem, &e, &error));
    walk_scene_free(s);
    return e;
}

static reuse_estimates reuse(const mesh *m, const moving_light *l, reuse_way way, size_t paths,
                             size_t resolution, uint64_t seed) {
    const reuse_problem problem = {
        .light = l, .way = way, .paths = paths, .resolution = resolution, .seed = seed};
    return solve(m, &problem);
}

/* The mean square of (H~ - H) / error over elements that have an error, of one position. */
static double chi_square(const reuse_estimates *e, size_t position, const double *H) {
    double sum = 0, count = 0;
    for (size_t i = 0; i < e->n; i++) {
        const size_t k = position * e->n + i;
        ck_assert(e->error[k] > 0);
        sum += pow(((double)e->H[k] - H[k]) / (double)e->error[k], 2);
        count++;
    }
    return sum / count;
}

/* Errors from 32 batches are Student's, whose square has the mean 31 / 29; 96 elements of a position, which
 * are not independent. */
START_TEST(agrees_with_closed_forms) {
    const reuse_way way = _i == 0 ? REUSE_NONE : REUSE_EXACT;
    mesh m = box_mesh(unit, DIVISIONS, .6f);
    csr F = box_form_factors(unit, DIVISIONS, m.area);
    moving_light l = square_light();
    double *H = exact_light(&m, &l, &F);
    const reuse_problem problem = {.light = &l, .way = way, .even = _i == 2, .paths = 40000, .seed = 7};
    reuse_estimates e = solve(&m, &problem);
    ck_assert_uint_eq(e.paths % WALK_BATCHES, 0);
    ck_assert_double_ge(e.rays, 1 / (1 - .6) - .1);
    for (size_t k = 0; k < POSITIONS; k++) {
        const double chi = chi_square(&e, k, H);
        ck_assert_msg(chi > .5 && chi < 31. / 29 + 5 * sqrt(2. / 96), "position %zu: %g", k, chi);
    }
    reuse_estimates_free(&e);
    free(H);
    moving_light_free(&l);
    csr_free(&F);
    mesh_free(&m);
}
END_TEST

/* Elements get a part p of the power of the light. No path has a weight above 1 / N, so that the variance of
 * an estimate of p is at most p / N, of which 5 standard deviations of a chi-square of as many elements as
 * get light are allowed. */
START_TEST(direct_light_is_the_form_factor) {
    const reuse_way way = _i == 0 ? REUSE_NONE : REUSE_EXACT;
    mesh m = box_mesh(unit, DIVISIONS, .6f);
    moving_light l = square_light();
    double *exact = exact_direct(&m, &l);
    reuse_estimates e = reuse(&m, &l, way, 40000, 0, 7);
    for (size_t k = 0; k < POSITIONS; k++) {
        double sum = 0, count = 0;
        for (size_t i = 0; i < m.n; i++) {
            const size_t at = k * m.n + i;
            const double part = exact[at] * m.area[i] / l.area, off = (double)e.direct[at] - exact[at];
            if (part == 0) ck_assert_double_eq((double)e.direct[at], 0);
            ck_assert_double_ge((double)e.H[at], l.emission[0] * (double)e.direct[at] * (1 - 1e-6));
            if (part < 1e-4) continue;
            sum += pow(off * m.area[i] / l.area, 2) * (double)e.paths / part;
            count++;
        }
        ck_assert_double_gt(count, 20);
        ck_assert_msg(sum / count < 1 + 5 * sqrt(2 / count), "position %zu: %g of %g", k, sum / count, count);
    }
    reuse_estimates_free(&e);
    free(exact);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

/* w' K w. */
static double quadratic(const double *K, const double w[POSITIONS]) {
    double sum = 0;
    for (size_t j = 0; j < POSITIONS; j++)
        for (size_t k = 0; k < POSITIONS; k++) sum += w[j] * w[k] * K[j * POSITIONS + k];
    return sum;
}

/* The stated error of a mix beside its mean square around the mean of 32 seeds, in the norm that it is stated
 * in. A path meets four elements, so that at least 24 of 96 deviate by themselves: the squares of a mix have
 * the relative standard deviation sqrt(2 / (31 * 24)), of which 4 are allowed. The first two positions share
 * most paths, so that the error of their difference is far below that of independent estimates. */
START_TEST(covariance_is_that_of_seeds) {
    enum { SEEDS = 32, MIXES = 6 };
    static const double mix[MIXES][POSITIONS] = {{1, 0, 0, 0},  {0, 0, 0, 1},  {1, 1, 1, 1},
                                                 {1, -1, 0, 0}, {.5, 0, 2, 0}, {0, 1, -1, 1}};
    static const reuse_way ways[] = {REUSE_NONE, REUSE_EXACT, REUSE_ELEMENTS};
    const reuse_way way = ways[_i];
    mesh m = box_mesh(unit, DIVISIONS, .6f);
    moving_light l = square_light();
    reuse_estimates e[SEEDS];
    double stated[MIXES] = {0}, apart = 0, mean[POSITIONS];
    for (size_t r = 0; r < SEEDS; r++) {
        e[r] = reuse(&m, &l, way, 3200, 0, r + 1);
        for (size_t k = 0; k < MIXES; k++) stated[k] += quadratic(e[r].covariance, mix[k]) / SEEDS;
        for (size_t j = 0; j < 2; j++) apart += e[r].covariance[j * POSITIONS + j] / SEEDS;
        for (size_t j = 0; j < POSITIONS; j++) {
            double sum = 0;
            for (size_t i = 0; i < m.n; i++) sum += m.area[i] * pow(.6 * (double)e[r].error[j * m.n + i], 2);
            ck_assert_double_eq_tol(e[r].covariance[j * POSITIONS + j], sum, 1e-5 * sum);
        }
    }
    for (size_t k = 0; k < MIXES; k++) {
        double found = 0;
        for (size_t i = 0; i < m.n; i++) {
            for (size_t j = 0; j < POSITIONS; j++) {
                mean[j] = 0;
                for (size_t r = 0; r < SEEDS; r++) mean[j] += (double)e[r].H[j * m.n + i] / SEEDS;
            }
            for (size_t r = 0; r < SEEDS; r++) {
                double off = 0;
                for (size_t j = 0; j < POSITIONS; j++)
                    off += mix[k][j] * ((double)e[r].H[j * m.n + i] - mean[j]);
                found += m.area[i] * pow(.6 * off, 2) / (SEEDS - 1);
            }
        }
        ck_assert_msg(fabs(found / stated[k] - 1) < 4 * sqrt(2. / (31 * 24)), "mix %zu: %g for %g", k, found,
                      stated[k]);
    }
    if (way != REUSE_NONE) ck_assert_msg(stated[3] < .5 * apart, "%g of %g", stated[3], apart);
    for (size_t r = 0; r < SEEDS; r++) reuse_estimates_free(&e[r]);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

static double square_error(const reuse_estimates *e, size_t position, const double *H, const mesh *m) {
    double sum = 0;
    for (size_t i = 0; i < e->n; i++)
        sum += m->area[i] * pow((double)e->H[position * e->n + i] - H[position * e->n + i], 2);
    return sum;
}

/* Positions of the line share their paths: their errors fall, though each has as many paths of its own. */
START_TEST(sharing_lowers_the_error) {
    mesh m = box_mesh(unit, DIVISIONS, .6f);
    csr F = box_form_factors(unit, DIVISIONS, m.area);
    moving_light l = square_light();
    double *H = exact_light(&m, &l, &F), own = 0, shared = 0;
    for (uint64_t seed = 1; seed <= 8; seed++) {
        reuse_estimates a = reuse(&m, &l, REUSE_NONE, 6400, 0, seed),
                        b = reuse(&m, &l, REUSE_EXACT, 6400, 0, seed);
        for (size_t k = 0; k < 3; k++) {
            own += square_error(&a, k, H, &m);
            shared += square_error(&b, k, H, &m);
        }
        reuse_estimates_free(&a);
        reuse_estimates_free(&b);
    }
    ck_assert_msg(shared < .6 * own, "%g for %g", shared, own);
    free(H);
    moving_light_free(&l);
    csr_free(&F);
    mesh_free(&m);
}
END_TEST

/* A Cornell box, whose blocks hide the light of some positions from others. */
static mesh cornell(void) {
    const generate_options how = {.kind = "cornell", .elements = 150, .reflectance = .5, .seed = 1};
    return generate_good(&how);
}

/* The pose at these parts of the way from low to high, turned about y. */
static void set_pose(light_pose *p, double angle, const double part[3], const double low[3],
                     const double high[3]) {
    const double turn[3][3] = {{cos(angle), 0, -sin(angle)}, {0, 1, 0}, {sin(angle), 0, cos(angle)}};
    memcpy(p->turn, turn, sizeof turn);
    for (int d = 0; d < 3; d++) p->move[d] = low[d] + part[d] * (high[d] - low[d]);
}

/* A light that goes down between the blocks, turning. */
static moving_light falling_light(const mesh *m) {
    moving_light l = square_light();
    double low[3], high[3];
    mesh_box(m, low, high);
    for (size_t k = 0; k < l.n; k++) {
        const double part[3] = {.5, .5, .9 - .2 * (double)k};
        set_pose(&l.pose[k], .4 * (double)k, part, low, high);
    }
    for (int c = 0; c < MOVING_LIGHT_CHANNELS; c++) l.emission[c] = 1;
    return l;
}

/* The same square at positions on half an ellipse, whose first and last share the fewest paths. */
static moving_light curved_light(const mesh *m) {
    enum { CURVE = 16 };
    moving_light l = square_light();
    double low[3], high[3];
    mesh_box(m, low, high);
    for (size_t k = 0; k < l.n; k++) free(l.pose[k].name);
    free(l.pose);
    l.n = CURVE;
    l.pose = test_allocate(CURVE, sizeof *l.pose);
    for (size_t k = 0; k < CURVE; k++) {
        const double a = M_PI * (double)k / (CURVE - 1);
        const double part[3] = {.5 - .3 * cos(a), .5, .6 + .25 * sin(a)};
        l.pose[k].name = strdup("a position");
        set_pose(&l.pose[k], .5 * (a - M_PI / 2), part, low, high);
    }
    for (int c = 0; c < MOVING_LIGHT_CHANNELS; c++) l.emission[c] = 1;
    return l;
}

/* Walks from elements: the mean square over elements and seeds is what is stated, and the power that all
 * elements receive, whose error is far smaller, is right on average (Student's distribution of 63 degrees).
 */
START_TEST(walks_from_elements_agree_with_closed_forms) {
    enum { SEEDS = 64 };
    mesh m = box_mesh(unit, DIVISIONS, .6f);
    csr F = box_form_factors(unit, DIVISIONS, m.area);
    moving_light l = square_light();
    double *H = exact_light(&m, &l, &F), *direct = exact_direct(&m, &l), off[POSITIONS][SEEDS];
    double found = 0, stated = 0, missed = 0, straight = 0;
    for (size_t r = 0; r < SEEDS; r++) {
        reuse_estimates e = reuse(&m, &l, REUSE_ELEMENTS, 3200, 0, r + 1);
        for (size_t k = 0; k < POSITIONS; k++) {
            found += square_error(&e, k, H, &m);
            off[k][r] = 0;
            for (size_t i = 0; i < m.n; i++) {
                const size_t at = k * m.n + i;
                stated += m.area[i] * pow((double)e.error[at], 2);
                missed += pow((double)e.direct[at] - direct[at], 2);
                straight += pow(direct[at], 2);
                off[k][r] += m.area[i] * ((double)e.H[at] - H[at]);
            }
        }
        reuse_estimates_free(&e);
    }
    ck_assert_msg(found > .7 * stated && found < 1.4 * stated, "%g for %g", found, stated);
    ck_assert_msg(missed < 1e-4 * straight, "%g of %g", missed, straight);
    for (size_t k = 0; k < POSITIONS; k++) {
        double mean = 0, spread = 0;
        for (size_t r = 0; r < SEEDS; r++) mean += off[k][r] / SEEDS;
        for (size_t r = 0; r < SEEDS; r++) spread += pow(off[k][r] - mean, 2) / (SEEDS * (SEEDS - 1.));
        ck_assert_msg(fabs(mean) < 4.5 * sqrt(spread), "position %zu: %g +- %g", k, mean, sqrt(spread));
    }
    free(H);
    free(direct);
    moving_light_free(&l);
    csr_free(&F);
    mesh_free(&m);
}
END_TEST

/* Where something hides, shared paths agree with paths of their own. */
START_TEST(rays_know_what_is_hidden) {
    mesh m = cornell();
    moving_light l = falling_light(&m);
    const bool from_light = _i == 0;
    reuse_estimates a = reuse(&m, &l, REUSE_NONE, 64000, 0, 3),
                    b = reuse(&m, &l, from_light ? REUSE_EXACT : REUSE_ELEMENTS, 16000, 0, 5);
    for (size_t k = 0; k < l.n * m.n_channels; k++) {
        double sum = 0, count = 0;
        for (size_t i = 0; i < m.n; i++) {
            const size_t at = k * m.n + i;
            const double both = hypot((double)a.error[at], (double)b.error[at]);
            if (!(both > 0)) continue;
            sum += pow(((double)a.H[at] - (double)b.H[at]) / both, 2);
            count++;
        }
        ck_assert_double_gt(count, .5 * (double)m.n);
        ck_assert_msg(sum / count < 31. / 29 + 5 * sqrt(2 / count), "row %zu: %g of %g", k, sum / count,
                      count);
    }
    reuse_estimates_free(&a);
    reuse_estimates_free(&b);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

/* Covariances of groups add up to the whole one, and that of their means is the spread of the means over
 * seeds: of 8 groups and 12 positions and channels, many alike, 24 seeds; the mean of the squares is sure to
 * a fifth. */
START_TEST(means_of_groups_scatter_as_stated) {
    enum { SEEDS = 24 };
    const reuse_way way = _i == 0 ? REUSE_EXACT : REUSE_ELEMENTS;
    mesh m = cornell();
    moving_light l = falling_light(&m);
    const size_t s = l.n, C = m.n_channels, G = m.n_groups;
    double *sum = test_allocate(G * s * C, sizeof *sum), *squares = test_allocate(G * s * C, sizeof *squares);
    double *area = test_allocate(G, sizeof *area), stated = 0, found = 0;
    for (size_t i = 0; i < m.n; i++) area[m.group[i]] += m.area[i];
    for (size_t r = 0; r < SEEDS; r++) {
        reuse_estimates e = reuse(&m, &l, way, 1600, 0, r + 1);
        double whole = 0, parts = 0;
        for (size_t g = 0; g < G; g++)
            for (size_t k = 0; k < s; k++) {
                stated += e.of_means[(g * s + k) * s + k] * area[g] * area[g] / SEEDS;
                parts += e.of_groups[(g * s + k) * s + k];
                for (size_t c = 0; c < C; c++) {
                    double mean = 0;
                    for (size_t i = 0; i < m.n; i++)
                        if (m.group[i] == g)
                            mean += m.area[i] * (double)m.reflectance[c * m.n + i] *
                                    (double)e.H[(c * s + k) * m.n + i];
                    sum[(g * s + k) * C + c] += mean / SEEDS;
                    squares[(g * s + k) * C + c] += mean * mean / SEEDS;
                }
            }
        for (size_t k = 0; k < s; k++) whole += e.covariance[k * s + k];
        ck_assert_double_eq_tol(parts, whole, 1e-9 * whole);
        reuse_estimates_free(&e);
    }
    for (size_t k = 0; k < G * s * C; k++) found += (squares[k] - sum[k] * sum[k]) * SEEDS / (SEEDS - 1.);
    ck_assert_msg(found > .7 * stated && found < 1.4 * stated, "%g for %g", found, stated);
    free(sum);
    free(squares);
    free(area);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

/* |H~ - H| / |H| over all positions and elements. */
static double distance(const reuse_estimates *e, const reuse_estimates *of, const mesh *m) {
    double off = 0, all = 0;
    for (size_t k = 0; k < of->n_channels * of->n_positions * of->n; k++) {
        const double a = m->area[k % of->n];
        off += a * pow((double)e->H[k] - (double)of->H[k], 2);
        all += a * pow((double)of->H[k], 2);
    }
    return sqrt(off / all);
}

/* Maps are biased, the less the finer they are and the smaller the light is. */
START_TEST(maps_come_close) {
    const reuse_way way = _i == 0 ? REUSE_MAPS : REUSE_CUBES;
    mesh m = cornell();
    moving_light l = falling_light(&m);
    for (size_t k = 0; k < l.n_corners; k++)
        for (int d = 0; d < 3; d++) l.corner[k][d] *= .02;
    l.area *= .0004;
    reuse_estimates exact = reuse(&m, &l, REUSE_EXACT, 32000, 0, 3), coarse = reuse(&m, &l, way, 32000, 4, 3),
                    fine = reuse(&m, &l, way, 32000, 256, 3);
    const double far = distance(&coarse, &exact, &m), near = distance(&fine, &exact, &m);
    ck_assert_msg(near < .02 && near < .3 * far, "%g at 256 cells, %g at 4", near, far);
    reuse_estimates_free(&exact);
    reuse_estimates_free(&coarse);
    reuse_estimates_free(&fine);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

static double largest(const reuse_estimates *e) {
    double most = 0;
    for (size_t k = 0; k < e->n_positions; k++) most = fmax(most, e->covariance[k * (e->n_positions + 1)]);
    return most;
}

/* Counts of paths by a pilot: as many in all, more of the positions whose errors are largest. The stated
 * squares of errors are sums over elements with a relative standard deviation below .1 each. */
START_TEST(counts_even_out_errors) {
    mesh m = cornell();
    moving_light l = curved_light(&m);
    reuse_problem problem = {.light = &l, .way = REUSE_EXACT, .paths = 6400, .seed = 4};
    reuse_estimates same = solve(&m, &problem);
    problem.even = true;
    reuse_estimates even = solve(&m, &problem);
    size_t sum = 0, most = 0;
    for (size_t k = 0; k < l.n; k++) {
        ck_assert_uint_eq(same.count[k], 6400);
        sum += even.count[k];
        most = even.count[k] > most ? even.count[k] : most;
    }
    ck_assert_double_eq_tol((double)sum, 6400. * (double)l.n, .5 * WALK_BATCHES * (double)l.n);
    ck_assert_uint_gt(most, 6400);
    ck_assert_msg(largest(&even) < .85 * largest(&same), "%g of %g", largest(&even), largest(&same));
    reuse_estimates_free(&same);
    reuse_estimates_free(&even);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

START_TEST(bits_do_not_depend_on_threads) {
    static const reuse_way ways[] = {REUSE_NONE, REUSE_EXACT, REUSE_MAPS, REUSE_CUBES, REUSE_ELEMENTS};
    mesh m = cornell();
    moving_light l = falling_light(&m);
    const int threads = omp_get_max_threads();
    const reuse_problem problem = {
        .light = &l, .way = ways[_i], .even = true, .paths = 3200, .resolution = 32, .seed = 2};
    omp_set_num_threads(1);
    reuse_estimates one = solve(&m, &problem);
    omp_set_num_threads(3);
    reuse_estimates three = solve(&m, &problem);
    omp_set_num_threads(threads);
    const size_t size = m.n * m.n_channels * l.n;
    ck_assert_mem_eq(one.H, three.H, size * sizeof *one.H);
    ck_assert_mem_eq(one.error, three.error, size * sizeof *one.error);
    ck_assert_mem_eq(one.direct, three.direct, m.n * l.n * sizeof *one.direct);
    ck_assert_mem_eq(one.covariance, three.covariance, l.n * l.n * sizeof *one.covariance);
    ck_assert_double_eq(one.rays, three.rays);
    reuse_estimates_free(&one);
    reuse_estimates_free(&three);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

START_TEST(a_position_that_sees_nothing_is_refused) {
    mesh m = box_mesh(unit, DIVISIONS, .6f);
    moving_light l = square_light();
    walk_scene *s = NULL;
    reuse_estimates e;
    lam_error error = {.message = ""};
    const reuse_problem problem = {.light = &l, .way = REUSE_EXACT, .paths = 64, .seed = 1};
    l.pose[2].move[2] = -3; /* below the floor, which it sees nothing of */
    ck_ok(walk_scene_create(&m, CLOSURE_MEASURED, &s, &error));
    ck_assert_int_eq(walk_reuse(s, &problem, &e, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "position 2 (a position)"));
    walk_scene_free(s);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("reuse");
    TCase *tests = tcase_create("reuse");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, agrees_with_closed_forms, 0, 3);
    tcase_add_loop_test(tests, direct_light_is_the_form_factor, 0, 2);
    tcase_add_loop_test(tests, covariance_is_that_of_seeds, 0, 3);
    tcase_add_test(tests, sharing_lowers_the_error);
    tcase_add_test(tests, walks_from_elements_agree_with_closed_forms);
    tcase_add_loop_test(tests, rays_know_what_is_hidden, 0, 2);
    tcase_add_loop_test(tests, means_of_groups_scatter_as_stated, 0, 2);
    tcase_add_loop_test(tests, maps_come_close, 0, 2);
    tcase_add_test(tests, counts_even_out_errors);
    tcase_add_loop_test(tests, bits_do_not_depend_on_threads, 0, 5);
    tcase_add_test(tests, a_position_that_sees_nothing_is_refused);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
