/* Light at sensors: partly hidden walls by closed forms, a room with blocks against samples by plain code,
 * and noise as it is stated. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/scene/glass.h"
#include "solver/sensor/sensor_rows.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/scene.h"

#include <omp.h>

static sensor_rows rows_of(const mesh *m, size_t n, const receiver *r, const sensor_rows_options *o) {
    lam_error error = {0};
    sensor_rows rows;
    ck_ok(sensor_rows_make(m, n, r, o, &rows, &error));
    return rows;
}

/* sum weight B, or sum off B. */
static double gathered(const sensor_rows *rows, const float *by, size_t k, const double *B) {
    double sum = 0;
    for (uint64_t i = rows->start[k]; i < rows->start[k + 1]; i++) sum += (double)by[i] * B[rows->element[i]];
    return sum;
}

static void add_face(mesh *m, int axis, double level, const double from[3], const double to[3],
                     bool positive) {
    box_cell cell = {.axis = axis, .level = level};
    memcpy(cell.from, from, sizeof cell.from);
    memcpy(cell.to, to, sizeof cell.to);
    cell.from[axis] = cell.to[axis] = level;
    mesh_add_cell(m, &cell, positive);
}

/* CIE 171:2006, case 5.7: light of a wall over a black box, at a wall and a floor; recomputed, as the printed
 * table is wrong. Rows of elements of the wall, as sources, are partly hidden, .25 m of its 3 m: 256 segments
 * of each are off by 3 % of it at most, all in one direction .3 % of the value, and .02 where little is left.
 */
START_TEST(wall_behind_a_box) {
    enum { N = 11 };
    static const double at[N][3] = {{2, 0, 2.75}, {2, 0, 2.25}, {2, 0, 1.75}, {2, 0, 1.25},
                                    {2, 0, .75},  {2, 0, .25},  {2, .25, 0},  {2, .75, 0},
                                    {2, 1.25, 0}, {2, 1.75, 0}, {2, 2.25, 0}};
    static const double expected[N] = {16.0706, 16.3297, 15.3988, 13.322, 10.3169, 7.07897,
                                       3.38234, 3.62899, 3.01295, 0,      0};
    mesh m = {0};
    receiver r[N] = {{.kind = RECEIVER_PLANE}};
    double B[16 * 12 + 7] = {0};
    for (int i = 0; i < 16; i++)
        for (int j = 0; j < 12; j++) {
            B[m.n] = 100;
            add_face(&m, 1, 4, (double[]){.25 * i, 4, .25 * j}, (double[]){.25 * (i + 1), 4, .25 * (j + 1)},
                     false);
        }
    add_face(&m, 1, 0, (double[]){0, 0, 0}, (double[]){4, 0, 3}, true);
    add_face(&m, 2, 0, (double[]){0, 0, 0}, (double[]){4, 2.5, 0}, true);
    add_face(&m, 1, 2.5, (double[]){0, 2.5, 0}, (double[]){4, 2.5, 1}, false);
    add_face(&m, 1, 2.7, (double[]){0, 2.7, 0}, (double[]){4, 2.7, 1}, true);
    add_face(&m, 2, 1, (double[]){0, 2.5, 1}, (double[]){4, 2.7, 1}, true);
    add_face(&m, 0, 0, (double[]){0, 2.5, 0}, (double[]){0, 2.7, 1}, false);
    add_face(&m, 0, 4, (double[]){4, 2.5, 0}, (double[]){4, 2.7, 1}, true);
    mesh_finish(&m, .5f);
    for (int k = 0; k < N; k++) {
        r[k].axis[k < 6 ? 1 : 2] = 1;
        memcpy(r[k].at, at[k], sizeof r[k].at);
    }
    bool source = true;
    m.n_groups = 1;
    sensor_rows rows = rows_of(&m, N, r, &(sensor_rows_options){.sources = &source});
    for (size_t k = 0; k < N; k++) {
        const double value = gathered(&rows, rows.weight, k, B);
        printf("%zu: %.4f, must be %.4f\n", k, value, expected[k]);
        ck_assert_double_eq_tol(value, expected[k], .003 * expected[k] + .02);
    }
    sensor_rows_free(&rows);
    mesh_free(&m);
}
END_TEST

/* True where a segment crosses a triangle, its ends left out (Moeller and Trumbore 1997). */
static bool crosses(const double from[3], const double to[3], const double *a, const double *b,
                    const double *c) {
    double way[3], u[3], v[3], h[3], s[3], q[3];
    subtract3(to, from, way);
    subtract3(b, a, u);
    subtract3(c, a, v);
    cross3(way, v, h);
    const double det = dot3(u, h);
    if (fabs(det) < 1e-14) return false;
    subtract3(from, a, s);
    const double x = dot3(s, h) / det;
    if (x < 0 || x > 1) return false;
    cross3(s, u, q);
    const double y = dot3(way, q) / det, t = dot3(v, q) / det;
    return y >= 0 && x + y <= 1 && t > 1e-6 && t < 1 - 1e-6;
}

/* True where no face of a scene is between two points. */
static bool is_open(const mesh *faces, const double from[3], const double to[3]) {
    for (size_t f = 0; f < faces->n; f++)
        for (size_t c = 1; c + 1 < mesh_corners(faces, f); c++)
            if (crosses(from, to, faces->vertices[faces->elements[f][0]],
                        faces->vertices[faces->elements[f][c]], faces->vertices[faces->elements[f][c + 1]]))
                return false;
    return true;
}

/* The reference: the kernel at SIDE x SIDE places of parts of an element that are small beside their
 * distance, of those that no face of the scene file hides. */
static double reference(const mesh *faces, const polygon *p, const receiver *r, int halvings) {
    enum { SIDE = 6 };
    double sum = 0, way[3];
    subtract3(p->centre, r->at, way);
    if (halvings > 0 && p->radius > .2 * sqrt(dot3(way, way))) {
        polygon half[2];
        polygon_halve(p, half);
        return reference(faces, &half[0], r, halvings - 1) + reference(faces, &half[1], r, halvings - 1);
    }
    for (int k = 0; k < SIDE * SIDE; k++) {
        double point[3];
        const double area =
            polygon_point(p, (k / SIDE + .5) / SIDE, (k % SIDE + .5) / SIDE, point) / (SIDE * SIDE);
        subtract3(point, r->at, way);
        const double square = dot3(way, way), leaves = dot3(way, r->axis), arrives = -dot3(way, p->normal);
        if (leaves > 0 && arrives > 0 && is_open(faces, r->at, point))
            sum += leaves * arrives / (M_PI * square * square) * area;
    }
    return sum;
}

/* Points of the floor of the Cornell box, lamp on: the mean error is below .5 % of the mean light, and what
 * is stated is its root mean square within a factor 2, over 50 points (a tenth of it by chance). */
START_TEST(room_with_blocks) {
    enum { N = 50, TRIES = 200 };
    lam_error error = {0};
    mesh faces = generate_good(&(generate_options){.kind = "cornell", .elements = 30, .reflectance = -1});
    mesh m = generate_good(&(generate_options){.kind = "cornell", .elements = 30, .reflectance = -1});
    receiver r[N] = {{.kind = RECEIVER_PLANE}};
    double low[3], high[3], mean = 0, off = 0, squares = 0, stated = 0;
    ck_ok(mesh_refine(&m, &(mesh_refinement){.elements = 400}, &error));
    mesh_box(&m, low, high);
    const int up = 2;
    double *B = test_allocate(m.n, sizeof *B);
    uint64_t seed = 3;
    for (size_t j = 0; j < m.n; j++) B[j] = random_between(&seed, .5, 1) + 20 * (double)(m.emission[j] > 0);
    size_t n = 0;
    for (int k = 0; k < TRIES && n < N; k++) {
        receiver one = {.kind = RECEIVER_PLANE};
        for (int d = 0; d < 3; d++)
            one.at[d] = low[d] + (high[d] - low[d]) * (d == up ? 0 : random_between(&seed, .1, .9));
        one.axis[up] = 1;
        if (seen_from(&m, (double[3]){one.at[0] + (up == 0) * 1e-3, one.at[1] + (up == 1) * 1e-3,
                                      one.at[2] + (up == 2) * 1e-3}) > 1)
            r[n++] = one;
    }
    ck_assert_uint_eq(n, N);
    sensor_rows rows = rows_of(&m, N, r, &(sensor_rows_options){.seed = 5});
    for (size_t k = 0; k < N; k++) {
        receiver lifted = r[k];
        lifted.at[up] += 1e-6;
        const double value = gathered(&rows, rows.weight, k, B), noise = gathered(&rows, rows.off, k, B);
        double truth = 0;
        for (size_t j = 0; j < m.n; j++) {
            polygon p;
            polygon_of_element(&m, j, &p);
            truth += B[j] * reference(&faces, &p, &lifted, 12);
        }
        mean += truth / N;
        off += fabs(value - truth) / N;
        squares += (value - truth) * (value - truth) / N;
        stated += noise * noise / N;
    }
    printf("mean %.4f, mean error %.3f %%, stated rms %.3f %%\n", mean, 100 * off / mean,
           100 * sqrt(stated) / mean);
    ck_assert_double_lt(off, .005 * mean);
    ck_assert_double_gt(sqrt(stated), sqrt(squares) / 2);
    ck_assert_double_lt(sqrt(stated), sqrt(squares) * 2);
    sensor_rows_free(&rows);
    free(B);
    mesh_free(&m);
    mesh_free(&faces);
}
END_TEST

/* Floor and walls of a room of 4 x 4 x 3 m, of cells x cells each. */
static void add_walls(mesh *m, int cells) {
    const double size[3] = {4, 4, 3};
    for (int axis = 0; axis < 3; axis++)
        for (int side = 0; side < 2; side++) {
            if (axis == 2 && side == 1) continue;
            for (int i = 0; i < cells; i++)
                for (int j = 0; j < cells; j++) {
                    const int u = (axis + 1) % 3, w = (axis + 2) % 3;
                    double from[3] = {0}, to[3] = {0};
                    from[u] = size[u] * i / cells;
                    to[u] = size[u] * (i + 1) / cells;
                    from[w] = size[w] * j / cells;
                    to[w] = size[w] * (j + 1) / cells;
                    add_face(m, axis, side * size[axis], from, to, side == 0);
                }
        }
}

/* Its ceiling has an opening of 1 m^2 in the middle, or a pane there. */
static mesh room_with_skylight(int cells, bool pane) {
    mesh m = {0};
    add_walls(&m, cells);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            static const double cuts[] = {0, 1.5, 2.5, 4};
            const double from[] = {cuts[i], cuts[j], 3}, to[] = {cuts[i + 1], cuts[j + 1], 3};
            if (i != 1 || j != 1) add_face(&m, 2, 3, from, to, false);
        }
    if (pane) add_face(&m, 2, 3, (double[]){1.5, 1.5, 3}, (double[]){2.5, 2.5, 3}, false);
    mesh_finish(&m, .5f);
    return m;
}

/* The factor of the opening at the points of CIE 171, case 5.3, of which the opening is the lamp: expected
 * values are pi L C with L = 1,000, and below its middle that closed form. Seeds tell the noise: below 4 %,
 * where rays by the cosine alone have 16 % on the floor; what is stated is right within a factor 2 (an
 * estimate of one degree of freedom, 40 of it: off by 22 %). */
START_TEST(skylight) {
    enum { N = 5, SEEDS = 40 };
    static const double at[N][3] = {{2, 2, 0}, {2, .25, 0}, {2, 1.75, 0}, {2, 0, 1.75}, {2, 0, .75}},
                        expected[N] = {107.149, 61.4241, 105.778, 81.3232, 53.4035};
    lam_error error = {0};
    sky_bounce sky;
    mesh m = room_with_skylight(4, false);
    receiver r[N] = {{.kind = RECEIVER_PLANE}};
    double sum[N] = {0}, squares[N] = {0}, stated[N] = {0};
    for (int k = 0; k < N; k++) {
        r[k].axis[k < 3 ? 2 : 1] = 1;
        memcpy(r[k].at, at[k], sizeof r[k].at);
    }
    ck_ok(sky_bounce_create("tregenza", 'z', 0, 1, &sky, &error));
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        sensor_rows rows = rows_of(&m, N, r, &(sensor_rows_options){.seed = seed, .sky = &sky});
        for (size_t k = 0; k < N; k++) {
            double value = 0, off = 0;
            for (size_t t = 0; t < rows.n_tiles; t++) {
                value += (double)rows.sky[t * N + k];
                off += (double)rows.sky_off[t * N + k];
            }
            sum[k] += value / SEEDS;
            squares[k] += value * value / SEEDS;
            stated[k] += off * off / SEEDS;
        }
        sensor_rows_free(&rows);
    }
    for (size_t k = 0; k < N; k++) {
        const double deviation = sqrt(squares[k] - sum[k] * sum[k]);
        printf("%zu: %.5f, must be %.5f; off by %.2f %% at a seed, stated %.2f %%\n", k, sum[k],
               expected[k] / 1000, 100 * deviation / sum[k], 100 * sqrt(stated[k]) / sum[k]);
        ck_assert_double_lt(deviation, .04 * sum[k]);
        ck_assert_double_lt(sqrt(stated[k]), 2 * deviation);
        ck_assert_double_gt(sqrt(stated[k]), deviation / 2);
        /* four standard errors of the mean, and rounding of cases.json */
        ck_assert_double_eq_tol(sum[k], expected[k] / 1000, 4 * deviation / sqrt(SEEDS) + 1e-5);
    }
    sky_bounce_free(&sky);
    mesh_free(&m);
}
END_TEST

/* A room without a ceiling is open, and rays are aimed at its opening all the same: an even sky gives the
 * factor of the opening. Of 4,096 rays there, near points spread over sixteen parts of it, .2 % are left; by
 * the 1,024 of the weight alone, of which the opening gets 130 to 450, up to 3 %. */
START_TEST(open_side) {
    enum { N = 14, ON_WALL = 6, SEEDS = 4 };
    lam_error error = {0};
    sky_bounce sky;
    mesh m = {0};
    receiver r[N] = {{.kind = RECEIVER_PLANE}};
    polygon opening = {.n = 4, .corner = {{0, 0, 3}, {0, 4, 3}, {4, 4, 3}, {4, 0, 3}}};
    polygon_measure(&opening);
    add_walls(&m, 12);
    mesh_finish(&m, .5f);
    for (int k = 0; k < N; k++) { /* The points are those of CIE 171, case 5.9. */
        const bool on_wall = k < ON_WALL;
        r[k].axis[on_wall ? 1 : 2] = 1;
        r[k].at[0] = 2;
        r[k].at[on_wall ? 2 : 1] = on_wall ? 2.75 - .5 * k : .25 + .5 * (k - ON_WALL);
    }
    ck_ok(sky_bounce_create("tregenza", 'z', 0, 1, &sky, &error));
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        sensor_rows rows = rows_of(&m, N, r, &(sensor_rows_options){.seed = seed, .sky = &sky});
        for (size_t k = 0; k < N; k++) {
            const double expected = M_PI * receiver_factor(&r[k], &opening);
            double value = 0;
            for (size_t t = 0; t < rows.n_tiles; t++) value += (double)rows.sky[t * N + k];
            ck_assert_double_gt(expected, .3);
            ck_assert_msg(fabs(value - expected) < .005 * expected, "point %zu: %.5f, must be %.5f", k, value,
                          expected);
        }
        sensor_rows_free(&rows);
    }
    sky_bounce_free(&sky);
    mesh_free(&m);
}
END_TEST

/* A pane in the opening passes its part, the same for all angles here, and rays are aimed at it as at the
 * opening: seeds differ by less than 4 %. The sensor sees the pane too. */
START_TEST(pane_in_a_skylight) {
    enum { SEEDS = 30 };
    const struct group_glass glass = {.transmittance = .6, .faces = 1};
    const receiver r = {.at = {2, .25, 0}, .axis = {0, 0, 1}};
    lam_error error = {0};
    sky_bounce sky;
    mesh m = room_with_skylight(4, true);
    double sum = 0, squares = 0, seen = 0;
    char *names[] = {(char[]){"wall"}, (char[]){"pane"}};
    ck_ok(sky_bounce_create("tregenza", 'z', 0, 1, &sky, &error));
    m.n_groups = 2;
    m.group_names = names;
    m.group[m.n - 1] = 1;
    ck_ok(mesh_set_glass(&m, 1, &glass, &error));
    m.glass_by_angle = false;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        sensor_rows rows = rows_of(&m, 1, &r, &(sensor_rows_options){.seed = seed, .sky = &sky});
        double value = 0;
        for (size_t t = 0; t < rows.n_tiles; t++) value += (double)rows.sky[t];
        for (uint64_t i = rows.start[0]; i < rows.start[1]; i++)
            if (rows.element[i] == m.n - 1) seen = (double)rows.weight[i];
        sum += value / SEEDS;
        squares += value * value / SEEDS;
        sensor_rows_free(&rows);
    }
    const double deviation = sqrt(squares - sum * sum);
    printf("through a pane %.5f, off by %.2f %% at a seed\n", sum, 100 * deviation / sum);
    ck_assert_double_lt(deviation, .04 * sum);
    /* four standard errors of the mean */
    ck_assert_double_eq_tol(sum, .6 * .0614241, 4 * deviation / sqrt(SEEDS) + 1e-6);
    ck_assert_double_eq_tol(seen, .0614241 / M_PI, 1e-6);
    sky_bounce_free(&sky);
    m.group_names = NULL;
    mesh_free(&m);
}
END_TEST

/* A plate seen through a pane, by its front and by its back: its factor times what the pane passes, as a
 * pair; and as one element of many by rays. */
START_TEST(plate_behind_a_pane) {
    const struct group_glass glass = {.transmittance = .6, .faces = 1};
    const receiver r = {.at = {0, 0, 0}, .axis = {0, 0, 1}};
    lam_error error = {0};
    for (int front = 0; front < 2; front++) {
        mesh m = {0};
        polygon plate;
        double by_rays = 0;
        add_face(&m, 2, 2, (double[]){-1, -1, 2}, (double[]){1, 1, 2}, false);
        add_face(&m, 2, 1, (double[]){-2, -2, 1}, (double[]){2, 2, 1}, front == 0);
        for (int i = 0; i < 900; i++) /* a wall of small elements behind the pane, beside the plate */
            add_face(&m, 2, 2, (double[]){1 + .05 * (i % 30), -1 + .05 * (i / 30), 2},
                     (double[]){1.05 + .05 * (i % 30), -.95 + .05 * (i / 30), 2}, false);
        mesh_finish(&m, .5f);
        char *names[] = {(char[]){"wall"}, (char[]){"pane"}};
        m.n_groups = 2;
        m.group_names = names;
        m.group[1] = 1;
        ck_ok(mesh_set_glass(&m, 1, &glass, &error));
        m.glass_by_angle = false;
        polygon_of_element(&m, 0, &plate);
        sensor_rows rows = rows_of(&m, 1, &r, &(sensor_rows_options){.rays = 4096});
        ck_assert_uint_eq(rows.element[0], 0);
        ck_assert_double_eq_tol((double)rows.weight[0], .6 * receiver_factor(&r, &plate), 1e-6);
        for (uint64_t i = rows.start[0]; i < rows.start[1]; i++)
            if (rows.element[i] > 1) by_rays += (double)rows.weight[i];
        polygon wall = {.n = 4, .corner = {{1, -1, 2}, {1, .5, 2}, {2.5, .5, 2}, {2.5, -1, 2}}};
        polygon_measure(&wall);
        const double F = receiver_factor(&r, &wall);
        printf("wall behind a pane %.5f, must be %.5f\n", by_rays, .6 * F);
        /* a binomial of 4,096 rays, four deviations */
        ck_assert_double_eq_tol(by_rays, .6 * F, 4 * .6 * sqrt(F / 4096));
        sensor_rows_free(&rows);
        m.group_names = NULL;
        mesh_free(&m);
    }
}
END_TEST

/* Over seeds, the variance of a value is what its halves state, within a factor 2 of its root: 60 estimates
 * of one degree of freedom are off by 18 %, the variance over 60 seeds likewise. The mean does not depend on
 * the number of rays: no part is lost between pairs and rays. */
START_TEST(variance_is_stated) {
    enum { SEEDS = 60 };
    lam_error error = {0};
    mesh m = generate_good(&(generate_options){.kind = "cornell", .elements = 30, .reflectance = -1});
    double low[3], high[3], mean[2] = {0}, variance[2] = {0};
    ck_ok(mesh_refine(&m, &(mesh_refinement){.elements = 400}, &error));
    mesh_box(&m, low, high);
    const int up = 2;
    double *B = test_allocate(m.n, sizeof *B);
    uint64_t random = 3;
    receiver r = {.kind = RECEIVER_PLANE};
    for (size_t j = 0; j < m.n; j++) B[j] = random_unit(&random);
    for (int d = 0; d < 3; d++) r.at[d] = low[d] + (high[d] - low[d]) * (d == up ? .05 : .35);
    r.axis[up] = 1;
    for (int rays = 0; rays < 2; rays++) {
        double squares = 0, stated = 0;
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            sensor_rows rows =
                rows_of(&m, 1, &r, &(sensor_rows_options){.seed = seed, .rays = rays == 0 ? 64 : 1024});
            const double value = gathered(&rows, rows.weight, 0, B), off = gathered(&rows, rows.off, 0, B);
            mean[rays] += value / SEEDS;
            squares += value * value / SEEDS;
            stated += off * off / SEEDS;
            sensor_rows_free(&rows);
        }
        variance[rays] = squares - mean[rays] * mean[rays];
        printf("%d rays: mean %.5f, deviation %.5f, stated %.5f\n", rays == 0 ? 64 : 1024, mean[rays],
               sqrt(variance[rays]), sqrt(stated));
        ck_assert_double_lt(sqrt(stated), 2 * sqrt(variance[rays]));
        ck_assert_double_gt(sqrt(stated), sqrt(variance[rays]) / 2);
    }
    ck_assert_double_le(fabs(mean[0] - mean[1]), 4 * sqrt((variance[0] + variance[1]) / SEEDS));
    free(B);
    mesh_free(&m);
}
END_TEST

START_TEST(bits_do_not_depend_on_threads) {
    enum { N = 300 };
    mesh m = room_with_skylight(3, false);
    lam_error error = {0};
    sky_bounce sky;
    receiver *r = test_allocate(N, sizeof *r);
    ck_ok(sky_bounce_create("tregenza", 'z', .2, 1, &sky, &error));
    for (size_t k = 0; k < N; k++)
        r[k] = (receiver){.kind = (receiver_kind)(k % 2), .at = {.01 * (double)k, 1, .8}, .axis = {0, 0, 1}};
    const sensor_rows_options o = {.rays = 64, .sky = &sky};
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    sensor_rows one = rows_of(&m, N, r, &o);
    omp_set_num_threads(2);
    sensor_rows two = rows_of(&m, N, r, &o);
    omp_set_num_threads(threads);
    ck_assert_mem_eq(one.start, two.start, (N + 1) * sizeof *one.start);
    ck_assert_mem_eq(one.element, two.element, one.start[N] * sizeof *one.element);
    ck_assert_mem_eq(one.weight, two.weight, one.start[N] * sizeof *one.weight);
    ck_assert_mem_eq(one.off, two.off, one.start[N] * sizeof *one.off);
    ck_assert_mem_eq(one.sky, two.sky, one.n_tiles * N * sizeof *one.sky);
    ck_assert_mem_eq(one.backs, two.backs, N * sizeof *one.backs);
    sensor_rows_free(&one);
    sensor_rows_free(&two);
    sky_bounce_free(&sky);
    mesh_free(&m);
    free(r);
}
END_TEST

int main(void) {
    Suite *s = suite_create("light at sensors");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 300);
    tcase_add_test(c, wall_behind_a_box);
    tcase_add_test(c, room_with_blocks);
    tcase_add_test(c, skylight);
    tcase_add_test(c, open_side);
    tcase_add_test(c, pane_in_a_skylight);
    tcase_add_test(c, plate_behind_a_pane);
    tcase_add_test(c, variance_is_stated);
    tcase_add_test(c, bits_do_not_depend_on_threads);
    suite_add_tcase(s, c);
    return suite_run(s);
}
