/* Symmetric matrices in tiles: rounded to the steps of rows and columns, and products with them, against
 * double, and the same bits in any batch and from a store. */
#include "solver/base/random.h"
#include "solver/linalg/tiled.h"
#include "support/dense.h"
#include "support/store_sample.h"
#include "support/suite.h"

#include <float.h>

enum { N = 700, VECTORS = 16, ASKED = 40 };

static lam_error error;

/* The upper triangle of rows of 0 to 20 numbers, some of up to 300, alone or in runs; of `digits` digits. */
static csr random_rows(size_t n, const float *step, int digits, uint64_t *state) {
    csr a = {.n = n,
             .indptr = test_allocate(n + 1, sizeof *a.indptr),
             .indices = test_allocate(n * n, sizeof *a.indices),
             .data = test_allocate(n * n, sizeof *a.data)};
    for (size_t i = 0; i < n; i++) {
        const size_t most = i % 50 == 7 ? 300 : i % 3 == 0 ? 0 : 20;
        const double share = random_lcg_unit(state) * (double)most / (double)n;
        uint64_t last = a.indptr[i];
        for (size_t j = i; j < n && most > 0; j++) {
            const bool follows = last > a.indptr[i] && a.indices[last - 1] + 1 == j;
            if (random_lcg_unit(state) > (follows ? .5 : share) && !(i == 1 && j == n - 1)) continue;
            const double most_steps = exp2(random_lcg_unit(state) * (8 * digits - 3));
            a.indices[last] = (uint32_t)j;
            a.data[last++] =
                (float)((random_lcg_unit(state) - .3) * most_steps * (double)step[i] * (double)step[j]);
        }
        a.indptr[i + 1] = last;
    }
    return a;
}

/* Groups of one to three rows, the last of one; between some of them a row of no group. */
static size_t random_groups(size_t n, tile_group *groups, float *step, float *row_step, uint64_t *state) {
    size_t n_groups = 0, end = 0;
    while (end < n) {
        const size_t most = 1 + (size_t)(3 * random_lcg_unit(state)), left = n - 1 - end;
        const size_t size = left == 0 ? 1 : most < left ? most : left;
        groups[n_groups] = (tile_group){(uint32_t)end, (uint32_t)size};
        step[n_groups] = (float)(.01 + random_lcg_unit(state));
        for (size_t r = 0; r < size; r++) row_step[end + r] = step[n_groups];
        n_groups++;
        end += size;
    }
    return n_groups;
}

/* All of a matrix of tiles, [n][n]. */
static double *dense_of(const tile_matrix *m, size_t n, const tile_group *groups, const float *row_step) {
    double *K = test_allocate(n * n, sizeof *K), digit = 1;
    for (size_t d = 0; d < TILE_PLANES; d++, digit *= 256)
        for (size_t k = 0; k < m->count[d]; k++) {
            const tile_digits *t = &m->tiles[d][k];
            ck_assert_uint_ge(t->column, t->row);
            ck_assert(k == 0 || t[-1].row < t->row || (t[-1].row == t->row && t[-1].column < t->column));
            for (size_t r = 0; r < groups[t->row].size; r++)
                for (size_t c = 0; c < groups[t->column].size; c++) {
                    const size_t i = groups[t->row].first + r, j = groups[t->column].first + c;
                    if (j < i) continue; /* in a tile on the diagonal, which has it twice */
                    K[i * n + j] += digit * t->values[r][c] * (double)row_step[i] * (double)row_step[j];
                    K[j * n + i] = K[i * n + j];
                }
        }
    return K;
}

static void check_rounding(const csr *a, const double *K, const float *row_step) {
    const size_t n = a->n;
    for (size_t i = 0; i < n; i++) {
        uint64_t e = a->indptr[i];
        for (size_t j = i; j < n; j++) {
            const bool there = e < a->indptr[i + 1] && a->indices[e] == j;
            const double wanted = there ? (double)a->data[e++] : 0;
            ck_assert_double_le(fabs(K[i * n + j] - wanted),
                                (there ? .5000001 : 0) * (double)row_step[i] * (double)row_step[j]);
        }
    }
}

static void check_against_double(size_t n, const double *K, const float *X, const float *Y) {
    for (size_t v = 0; v < VECTORS; v++)
        for (size_t i = 0; i < n; i++) {
            double sum = 0, size = 0;
            for (size_t j = 0; j < n; j++) {
                const double product = K[i * n + j] * (double)X[v * n + j];
                sum += product;
                /* The sum of a number's digits is at most 1.02 times the number and half a lower digit. */
                size += 2 * fabs(product);
            }
            /* A product is rounded when the column is scaled, when it is made, with its lane's sum (of at
             * most a fourth of n/3 tiles of each plane that may be left alone), in four sums of lanes, and
             * with the row's step. */
            ck_assert_double_le(fabs((double)Y[v * n + i] - sum),
                                ((double)n / 4 * TILE_PLANES + 8) * (FLT_EPSILON / 2) * size);
        }
}

static size_t count_numbers(size_t n, const double *K) {
    size_t count = 0;
    for (size_t k = 0; k < n * n; k++) count += K[k] != 0;
    return count;
}

/* The bits of a matrix that was saved and read again, in place and not, and of its products. */
static void check_store(const tiled_rows *t, const tile_group *groups, const float *step, const float *scaled,
                        const float *product) {
    char folder[64], path[128];
    store *s = NULL;
    float *y = test_allocate(t->n + TILED_PAST, sizeof *y),
          *x = test_allocate(t->n + TILED_BEYOND, sizeof *x);
    sample_folder(folder);
    snprintf(path, sizeof path, "%s/tiles.h5", folder);
    memcpy(x, scaled, (t->n + TILED_PAST) * sizeof *x);
    ck_ok(store_create(path, &s, &error));
    ck_ok(tiled_save(t, "/K", s, &error));
    ck_ok(store_seal(s, &error));
    for (int mapped = 0; mapped < 2; mapped++) {
        tiled_rows back;
        ck_ok(store_open(path, &s, &error));
        if (mapped) ck_ok(store_map_file(s, &error));
        ck_ok(tiled_load(s, "/K", t->n, t->n_groups, &back, &error));
        store_close(s);
        ck_assert_int_eq(back.values.map != NULL, mapped && t->n_fours * sizeof *t->fours >= STORE_MAP_LEAST);
        ck_ok(tiled_set_rows(&back, groups, step, &error));
        ck_assert_uint_eq(back.n_numbers, t->n_numbers);
        ck_assert_uint_eq(back.n_planes, t->n_planes);
        ck_assert_uint_eq(tiled_bytes(&back), tiled_bytes(t));
        ck_assert_mem_eq(back.fours, t->fours, t->n_fours * sizeof *t->fours);
        ck_assert_mem_eq(back.begin, t->begin, (t->n_groups * t->n_planes + 1) * sizeof *t->begin);
        tiled_multiply(&back, x, y, 1);
        ck_assert_mem_eq(y, product, t->n * sizeof *y);
        tiled_free(&back);
    }
    sample_folder_remove(folder);
    free(x);
    free(y);
}

/* out [m][N + TILED_PAST] = the columns of X [m][N] times their steps. */
static void scale(size_t m, const float *X, const float *step, float *out) {
    for (size_t v = 0; v < m; v++)
        for (size_t i = 0; i < N + TILED_PAST; i++)
            out[v * (N + TILED_PAST) + i] = i < N ? step[i] * X[v * N + i] : 0;
}

/* Floats of three arrays side by side and of what is lit, in whole cache lines. */
enum { LANES_ROOM = 3 * (N + TILED_PAST) * TILED_WIDE + (N + 15) / 16 * 16 };

/* Vectors side by side have the bits that each has alone. */
static void check_lanes(const tiled_rows *t, size_t count, const float *scaled, float *lanes,
                        size_t n_threads) {
    const size_t room = N + TILED_PAST;
    float *Y = lanes + room * TILED_WIDE, *work = Y + room * TILED_WIDE,
          *one = test_allocate(room, sizeof *one);
    for (size_t i = 0; i < room; i++)
        for (size_t v = 0; v < TILED_WIDE; v++) {
            lanes[i * TILED_WIDE + v] = v < count ? scaled[v * room + i] : 0;
            Y[i * TILED_WIDE + v] = NAN;
        }
    tiled_multiply_lanes(t, count, lanes, Y, work, n_threads);
    for (size_t v = 0; v < count; v++) {
        if (tiled_few_columns(t, scaled + v * room))
            tiled_multiply_columns(t, scaled + v * room, one);
        else
            tiled_multiply(t, scaled + v * room, one, 1);
        for (size_t i = 0; i < N; i++) ck_assert_mem_eq(&Y[i * TILED_WIDE + v], &one[i], sizeof *one);
    }
    free(one);
}

/* The rows of groups have the bits that they have among all. */
static void check_groups(const tiled_rows *t, const uint32_t *asked, const float *some, const float *all) {
    for (size_t k = 0; k < ASKED; k++)
        for (size_t i = t->first[asked[k]]; i < t->first[asked[k] + 1]; i++)
            ck_assert_mem_eq(&some[i], &all[i], sizeof *all);
}

/* So have they where only columns that are lit are looked at. */
static void check_columns_of(const tiled_rows *t, const uint32_t *asked, const float *scaled,
                             const float *all) {
    uint8_t *wanted = test_allocate(N + TILED_PAST, sizeof *wanted);
    uint32_t *lit = test_allocate(N, sizeof *lit);
    float *some = test_allocate(N + TILED_PAST, sizeof *some);
    size_t n_lit = 0;
    for (size_t g = 0; g < t->n_groups; g++) {
        bool any = g % 50 == 0; /* one that is dark may be among them */
        for (size_t i = t->first[g]; i < t->first[g + 1]; i++) any = any || scaled[i] != 0;
        if (any) lit[n_lit++] = (uint32_t)g;
    }
    for (size_t k = 0; k < ASKED; k++) wanted[t->first[asked[k]]] = 1;
    for (size_t i = 0; i < N + TILED_PAST; i++) some[i] = NAN;
    ck_assert(tiled_few_columns_of(t, n_lit, lit, scaled) == tiled_few_columns(t, scaled));
    tiled_multiply_columns_of(t, n_lit, lit, ASKED, asked, wanted, scaled, some);
    check_groups(t, asked, some, all);
    free(wanted);
    free(lit);
    free(some);
}

START_TEST(products_are_right_and_do_not_depend_on_the_batch) {
    const int digits = 1 + _i;
    uint64_t state = 3;
    tiled_rows t;
    tile_matrix m;
    tile_group groups[N];
    float step[N], row_step[N];
    uint32_t asked[ASKED];
    float *X = test_allocate(VECTORS * N, sizeof *X), *one = test_allocate(N + TILED_PAST, sizeof *one),
          *Y = test_allocate(VECTORS * N + TILED_PAST, sizeof *Y);
    const size_t room = N + TILED_PAST;
    float *scaled = test_allocate(VECTORS * room, sizeof *scaled),
          *lanes = aligned_alloc(64, LANES_ROOM * sizeof *lanes);
    const size_t n_groups = random_groups(N, groups, step, row_step, &state);
    csr a = random_rows(N, row_step, digits, &state);
    ck_ok(tile_matrix_round(&a, n_groups, groups, step, &m, &error));
    ck_assert_uint_gt(m.count[digits - 1], 0);
    double *K = dense_of(&m, N, groups, row_step);
    check_rounding(&a, K, row_step);
    ck_assert_uint_eq(tile_matrix_numbers(&m), count_numbers(N, K));
    ck_ok(tiled_create(&m, n_groups, groups, step, &t, &error));
    ck_assert_uint_eq(t.n_planes, (size_t)digits);
    ck_assert_uint_eq(t.n_numbers, count_numbers(N, K));
    for (size_t k = 0; k < VECTORS * N; k++) X[k] = (float)(random_lcg_unit(&state) - .4);
    scale(VECTORS, X, t.step, scaled);
    for (size_t count = 1; count <= VECTORS; count += 5)
        for (size_t n_threads = 1; n_threads < 4; n_threads += 2)
            check_lanes(&t, count, scaled, lanes, n_threads);
    for (size_t v = 0; v < VECTORS; v++) tiled_multiply(&t, scaled + v * room, Y + v * N, 1);
    check_against_double(N, K, X, Y);
    check_store(&t, groups, step, scaled, Y);
    for (size_t k = 0; k < ASKED; k++) asked[k] = (uint32_t)(k * n_groups / ASKED);
    tiled_multiply(&t, scaled, one, 1);
    for (size_t i = 0; i < N; i++) Y[i] = NAN;
    tiled_multiply_rows(&t, ASKED, asked, scaled, Y);
    check_groups(&t, asked, Y, one);
    /* The products by columns: one of the vectors has many of them and the others few. */
    for (size_t k = 0; k < VECTORS * N; k++)
        if (k >= N && k % N % 97 != k / N) X[k] = 0;
    scale(VECTORS, X, t.step, scaled);
    ck_assert(!tiled_few_columns(&t, scaled) && tiled_few_columns(&t, scaled + room));
    for (size_t v = 0; v < VECTORS; v++) {
        tiled_multiply_columns(&t, scaled + v * room, one);
        memcpy(Y + v * N, one, N * sizeof *Y);
        check_columns_of(&t, asked, scaled + v * room, one);
    }
    check_against_double(N, K, X, Y);
    check_lanes(&t, VECTORS, scaled, lanes, 3);
    check_lanes(&t, VECTORS - 1, scaled + room, lanes, 1);
    /* They have the same columns, which are taken side by side. */
    for (size_t k = N; k < VECTORS * N; k++)
        X[k] = k % N % 97 == 5 ? (float)(random_lcg_unit(&state) - .4) : 0;
    scale(VECTORS, X, t.step, scaled);
    ck_assert(tiled_few_columns(&t, scaled + room));
    check_lanes(&t, VECTORS, scaled, lanes, 1);
    check_lanes(&t, VECTORS - 1, scaled + room, lanes, 3);
    tiled_free(&t);
    tile_matrix_free(&m);
    csr_free(&a);
    free(K);
    free(X);
    free(Y);
    free(one);
    free(scaled);
    free(lanes);
}
END_TEST

/* Columns beyond 16 bits of distance from the first of a four; rows outside all groups. */
START_TEST(tiles_may_be_far_from_each_other) {
    enum { FAR = 70000 };
    uint64_t *indptr = test_allocate(FAR + 3, sizeof *indptr);
    uint32_t indices[] = {0, 4, FAR - 1, FAR + 1}, *places = test_allocate(FAR, sizeof *places);
    float data[] = {3, -5, 7, 11}, *X = test_allocate(FAR, sizeof *X), *Y = test_allocate(FAR, sizeof *Y);
    tile_group *groups = test_allocate(FAR, sizeof *groups);
    float *step = test_allocate(FAR, sizeof *step), *scaled = test_allocate(FAR + TILED_PAST, sizeof *scaled);
    tiled_rows t;
    tile_matrix m;
    const csr a = {.n = FAR + 2, .indptr = indptr, .indices = indices, .data = data};
    for (size_t i = 1; i <= FAR + 2; i++) indptr[i] = 4;
    /* Rows 1 and 2 are in no group. */
    for (size_t g = 0; g < FAR; g++) {
        groups[g] = (tile_group){(uint32_t)(g == 0 ? 0 : g + 2), 1};
        step[g] = 1;
        X[g] = (float)(g % 7);
    }
    ck_ok(tile_matrix_round(&a, FAR, groups, step, &m, &error));
    ck_ok(tiled_create(&m, FAR, groups, step, &t, &error));
    ck_assert_uint_eq(t.n, FAR);
    ck_assert_uint_eq(t.begin[1], 2);
    for (size_t g = 0; g < FAR; g++) scaled[g] = t.step[g] * X[g];
    tiled_multiply(&t, scaled, Y, 1);
    ck_assert_float_eq(Y[0], 3 * X[0] - 5 * X[2] + 7 * X[FAR - 3] + 11 * X[FAR - 1]);
    ck_assert_float_eq(Y[2], -5 * X[0]);
    ck_assert_float_eq(Y[FAR - 1], 11 * X[0]);
    tiled_free(&t);
    tile_matrix_free(&m);
    free(indptr);
    free(places);
    free(X);
    free(Y);
    free(groups);
    free(step);
    free(scaled);
}
END_TEST

/* Tiles that are changed while they are mapped, as another program may, lead to no memory but that of the
 * vectors: y is between numbers that stay. */
START_TEST(changed_tiles_stay_within_vectors) {
    enum { LANES = TILED_WIDE, GUARD = 64 };
    const float kept = 7;
    uint64_t state = 5;
    tile_group groups[N];
    float step[N], row_step[N];
    tile_matrix m;
    tiled_rows t;
    const size_t n_groups = random_groups(N, groups, step, row_step, &state), room = N + TILED_PAST;
    csr a = random_rows(N, row_step, 2, &state);
    ck_ok(tile_matrix_round(&a, n_groups, groups, step, &m, &error));
    ck_ok(tiled_create(&m, n_groups, groups, step, &t, &error));
    tile_four *fours = t.values.memory;
    uint32_t *begin = t.begins.memory;
    for (size_t f = 0; f < t.n_fours; f++) {
        fours[f].base = f % 3 == 0 ? UINT32_MAX : N - 1;
        for (size_t k = 0; k < TILES_AT_ONCE; k++) fours[f].beyond[k] = (uint16_t)(UINT16_MAX * (f % 2));
    }
    for (size_t k = 0; k < n_groups; k += 7) begin[k] = UINT32_MAX;
    float *x = test_allocate(N + TILED_BEYOND, sizeof *x), *y = test_allocate(room + GUARD, sizeof *y),
          *lanes = aligned_alloc(64, LANES_ROOM * sizeof *lanes);
    for (size_t i = 0; i < room + GUARD; i++) y[i] = kept;
    for (size_t i = 0; i < LANES_ROOM; i++) lanes[i] = 1;
    for (size_t i = 0; i < N; i++) x[i] = 1;
    tiled_multiply(&t, x, y, 3);
    tiled_multiply_columns(&t, x, y);
    tiled_multiply_lanes(&t, LANES, lanes, lanes + room * LANES, lanes + 2 * room * LANES, 1);
    for (size_t i = 0; i < GUARD; i++) ck_assert_float_eq(y[room + i], kept);
    tiled_free(&t);
    tile_matrix_free(&m);
    csr_free(&a);
    free(x);
    free(y);
    free(lanes);
}
END_TEST

START_TEST(rows_are_stored_in_tiles) {
    /* Rows 0 to 2 and 3 to 4; numbers at (1, 1), (1, 2), (0, 4) and (3, 3). */
    uint64_t indptr[] = {0, 1, 3, 3, 4, 4};
    uint32_t indices[] = {4, 1, 2, 3};
    float data[] = {.26f, 128, 32, -127.5f * 4};
    const tile_group groups[] = {{0, 3}, {3, 2}};
    const float step[] = {.5f, 2};
    const csr a = {.n = 5, .indptr = indptr, .indices = indices, .data = data};
    tile_matrix m;
    tiled_rows t;
    ck_ok(tile_matrix_round(&a, 2, groups, step, &m, &error));
    ck_assert_uint_eq(m.count[0], 2);
    ck_assert_uint_eq(m.count[1], 1);
    /* 512 = 2 256 has no lower digit, and 128 = 256 - 128 has two; .26 rounds to 0; -127.5 to the even -128.
     */
    ck_assert_int_eq(m.tiles[0][0].values[1][1], 0);
    ck_assert_int_eq(m.tiles[0][0].values[1][2], -128);
    ck_assert_int_eq(m.tiles[0][0].values[2][1], -128);
    ck_assert_int_eq(m.tiles[1][0].values[1][1], 2);
    ck_assert_int_eq(m.tiles[1][0].values[1][2], 1);
    ck_assert_uint_eq(m.tiles[0][1].row, 1);
    ck_assert_int_eq(m.tiles[0][1].values[0][0], -128);
    ck_assert_uint_eq(tile_matrix_numbers(&m), 4);
    ck_ok(tiled_create(&m, 2, groups, step, &t, &error));
    ck_assert_uint_eq(t.begin[1], 1);
    ck_assert_uint_eq(t.begin[2], 2);
    ck_assert_uint_eq(t.begin[3], 2);
    ck_assert_uint_eq(t.begin[4], 3);
    ck_assert_int_eq(t.fours[0].values[1][1], 2);
    ck_assert_int_eq(t.fours[1].values[2][1], -128);
    ck_assert_uint_eq(t.fours[2].base, 3);
    tiled_free(&t);
    tile_matrix_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("tiles");
    TCase *tests = tcase_create("products");
    tcase_add_loop_test(tests, products_are_right_and_do_not_depend_on_the_batch, 0, TILE_PLANES);
    tcase_add_test(tests, tiles_may_be_far_from_each_other);
    tcase_add_test(tests, changed_tiles_stay_within_vectors);
    tcase_add_test(tests, rows_are_stored_in_tiles);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
