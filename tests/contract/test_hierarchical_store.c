/* Hierarchical operators in a store: what the arrays of K mean, of older stores and of those that are written
 * now, with the same bits, and what is refused in one clear line. */
#include "support/operator_file.h"
#include "support/suite.h"

static lam_error error;

/* Eight elements in two leaves under a root, all matrices the identity: the coefficients are the elements
 * 3, 7, 4, 5, 6, 0, 1, 2. */
enum { N = 8, GROUPS = 3, TILES = 5, DIGITS = 8 };
static const uint32_t element_of[N] = {3, 7, 4, 5, 6, 0, 1, 2};

/* A file's differences from a good one: what is 0 or NULL is as it should be. */
typedef struct recipe {
    const char *what;
    bool wide_counts;
    const char *without, *other_type;           /* this dataset is left out, or in double */
    size_t n_groups, n_planes, n_far, n_digits; /* n_far and n_digits: one more than there are */
    uint32_t group, first, size;                /* size > 0: of this group */
    float step;                                 /* of the last group */
    uint16_t tile, code;                        /* code > 0: of this tile */
    uint16_t count, far;                        /* of the first row, of its tile */
    const char *word;                           /* NULL: it is good */
} recipe;

#define CODE(gap, mask) (uint16_t)((gap) << 9 | (mask))

static const recipe recipes[] = {
    {.what = "good"},
    {.what = "good, wide counts", .wide_counts = true},
    {.what = "a step of 0", .step = -0.0f, .word = "groups/step[2] = -0, must be above 0"},
    {.what = "a step too large", .step = 0x1p41f, .word = "groups/step[2] = 2.19902e+12"},
    {.what = "a step of NaN", .step = NAN, .word = "groups/step[2] = nan"},
    {.what = "no groups", .without = "/operator/groups/rows", .word = "/operator/groups/rows"},
    {.what = "no steps", .without = "/operator/groups/step", .word = "/operator/groups/step"},
    {.what = "a group of four", .group = 1, .first = 2, .size = 4, .word = "groups/rows[1] = 2, 4"},
    {.what = "groups that overlap", .group = 1, .first = 1, .size = 3, .word = "groups/rows[1] = 1, 3"},
    {.what = "a group beyond n", .group = 2, .first = 6, .size = 3, .word = "groups/rows[2] = 6, 3"},
    {.what = "a node in part",
     .group = 1,
     .first = 2,
     .size = 2,
     .word = "groups/rows has 7 coefficients, must have all 8"},
    {.what = "no scaling functions",
     .n_groups = 2,
     .word = "groups/rows has 5 coefficients, must have all 8"},
    {.what = "no count", .without = "/operator/K/0/count", .word = "/operator/K/0/count"},
    {.what = "no tiles", .without = "/operator/K/0/tile", .word = "/operator/K/0/tile"},
    {.what = "digits in double", .other_type = "/operator/K/0/digit", .word = "/operator/K/0/digit"},
    {.what = "more planes than digits", .n_planes = 5, .word = "has 5 planes, must have 1 to 4"},
    {.what = "a row of one tile more", .count = 3, .word = "/operator/K/0 has 5 tiles, its rows want 6"},
    {.what = "a tile far beyond", .far = 3, .word = "row 0 steps to column 3, must be ascending and below 3"},
    {.what = "a tile twice", .tile = 1, .code = CODE(0, 1), .word = "row 0 steps to column 0"},
    {.what = "a tile beyond", .tile = 3, .code = CODE(1, 1), .word = "row 2 steps to column 3"},
    {.what = "a row beyond its group",
     .tile = 0,
     .code = CODE(0, 64 + 3),
     .word = "/tile[0] = 67 has a number"},
    {.what = "a column beyond its group", .tile = 0, .code = CODE(0, 7), .word = "/tile[0] = 7 has a number"},
    {.what = "below the diagonal", .tile = 3, .code = CODE(0, 8), .word = "/tile[3] = 8 has a number"},
    {.what = "too few distances", .tile = 2, .code = CODE(127, 256), .word = "K/0/far has 1 numbers"},
    {.what = "too many distances",
     .n_far = 2,
     .word = "has 8 digits and 2 far distances, its tiles want 8 and 1"},
    {.what = "too few digits", .tile = 4, .code = CODE(0, 3), .word = "K/0/digit has 8 numbers"},
    {.what = "too many digits", .n_digits = 9, .word = "has 9 digits and 1 far distances"},
};

/* K by coefficient: the tiles of the good file, in integers and in steps of .5, 1, 2. */
static double K_of(size_t i, size_t j) {
    static const struct {
        size_t i, j;
        double q;
    } numbers[] = {{0, 0, 3}, {0, 1, -2}, {1, 1, 5}, {0, 5, 7}, {1, 7, -128}, {4, 7, -1}, {5, 5, 100 + 256}};
    static const double step[N] = {.5, .5, 1, 1, 1, 2, 2, 2};
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++)
        if ((numbers[k].i == i && numbers[k].j == j) || (numbers[k].i == j && numbers[k].j == i))
            return step[i] * step[j] * numbers[k].q;
    return 0;
}

static void write_array(store *s, const recipe *r, const char *name, store_type type, int rank,
                        const size_t *dims, const void *data) {
    double none[4 * sizeof(tile_four)] = {0};
    if (r->without != NULL && strcmp(r->without, name) == 0) return;
    if (r->other_type != NULL && strcmp(r->other_type, name) == 0)
        ck_ok(store_write(s, name, STORE_F64, rank, dims, none, &error));
    else
        ck_ok(store_write(s, name, type, rank, dims, data, &error));
}

static void write_tiles(store *s, const recipe *r) {
    uint32_t rows[GROUPS][2] = {{0, 2}, {2, 3}, {5, 3}};
    float step[GROUPS] = {.5f, 1, 2};
    uint16_t counts[5 * GROUPS] = {2, 1, 1, 0, 0, 1};
    uint32_t wide[5 * GROUPS], far[2] = {2, 1};
    uint16_t tiles[TILES] = {CODE(0, 1 + 2 + 16), CODE(127, 1 + 32), CODE(1, 256), CODE(0, 1), CODE(0, 1)};
    const int8_t digits[DIGITS + 1] = {3, -2, 5, 7, -128, -1, 100, 1, 9};
    const size_t n_groups = r->n_groups > 0 ? r->n_groups : GROUPS,
                 n_planes = r->n_planes > 0 ? r->n_planes : 2;
    if (r->size > 0) memcpy(rows[r->group], (uint32_t[]){r->first, r->size}, sizeof *rows);
    if (r->step != 0 || signbit(r->step)) step[2] = r->step;
    if (r->code > 0) tiles[r->tile] = r->code;
    if (r->count > 0) counts[0] = r->count;
    if (r->far > 0) far[0] = r->far;
    for (size_t k = 0; k < 5 * GROUPS; k++) wide[k] = counts[k];
    write_array(s, r, "/operator/groups/rows", STORE_U32, 2, (const size_t[]){n_groups, 2}, rows);
    write_array(s, r, "/operator/groups/step", STORE_F32, 1, &n_groups, step);
    write_array(s, r, "/operator/K/0/count", r->wide_counts ? STORE_U32 : STORE_U16, 2,
                (const size_t[]){n_planes, n_groups},
                r->wide_counts ? (const void *)wide : (const void *)counts);
    write_array(s, r, "/operator/K/0/tile", STORE_U16, 1, &(size_t){TILES}, tiles);
    write_array(s, r, "/operator/K/0/far", STORE_U32, 1, &(size_t){r->n_far > 0 ? r->n_far : 1}, far);
    write_array(s, r, "/operator/K/0/digit", STORE_I8, 1, &(size_t){r->n_digits > 0 ? r->n_digits : DIGITS},
                digits);
}

static double area_of(size_t i) {
    return i % 2 == 0 ? 1 : 4;
}

/* All but the tiles; the store is not sealed. */
static store *begin_file(void) {
    store *s = NULL;
    float rho[N], basis[4 * 4 * 2 + 6 * 6] = {0}, *to = basis;
    double area[N];
    const uint32_t shapes[3][3] = {{1, 4, 3}, {1, 4, 3}, {0, 6, 3}}, nodes[] = {0, 1, 2};
    for (size_t i = 0; i < N; i++) {
        rho[i] = .5f;
        area[i] = area_of(i);
    }
    for (size_t k = 0; k < 3; to += shapes[k][1] * shapes[k][1], k++)
        for (size_t i = 0; i < shapes[k][1]; i++) to[i * shapes[k][1] + i] = 1;
    ck_ok(store_create(operator_file_path, &s, &error));
    ck_ok(store_write(s, "/mesh/reflectance", STORE_F32, 2, (const size_t[]){1, N}, rho, &error));
    ck_ok(store_write(s, "/mesh/area", STORE_F64, 1, &(size_t){N}, area, &error));
    ck_ok(store_set_text(s, "/operator", "kind", "hierarchical", &error));
    ck_ok(store_write(s, "/operator/basis/shape", STORE_U32, 2, (const size_t[]){3, 3}, shapes, &error));
    ck_ok(store_write(s, "/operator/basis/basis", STORE_F32, 1, &(size_t){4 * 4 * 2 + 6 * 6}, basis, &error));
    ck_ok(store_write(s, "/operator/basis/node", STORE_U32, 1, &(size_t){3}, nodes, &error));
    return s;
}

static void write_recipe(const recipe *r) {
    store *s = begin_file();
    write_tiles(s, r);
    ck_ok(store_seal(s, &error));
}

/* The file as it is written now: what differs from a good one, as above. */
typedef struct recipe_of_now {
    const char *what, *without, *other_type;
    size_t n_begins, part; /* part > 0: begin[part] is begin */
    uint32_t begin, base;  /* base > 0: of the second four */
    uint16_t beyond;       /* of its second tile */
    int64_t numbers;       /* 0: as there are */
    const char *word;
} recipe_of_now;

static const recipe_of_now recipes_of_now[] = {
    {.what = "good"},
    {.what = "no begin", .without = "/operator/K/0/begin", .word = "has no /operator/K/0/begin"},
    {.what = "no fours", .without = "/operator/K/0/four", .word = "/operator/K/0/four"},
    {.what = "no numbers", .numbers = INT64_MIN, .word = "numbers"},
    {.what = "fewer than no numbers", .numbers = -2, .word = "/operator/K/0 has -2 numbers"},
    {.what = "fours in double", .other_type = "/operator/K/0/four", .word = "/operator/K/0/four"},
    {.what = "a begin too few",
     .n_begins = 2 * GROUPS,
     .word = "begin has 6 numbers, must have one for each"},
    {.what = "begins of five planes", .n_begins = 5 * GROUPS + 1, .word = "begin has 16 numbers"},
    {.what = "begins that fall",
     .part = 2,
     .begin = 3,
     .word = "begin[2] = 3, must not be above the next, 1"},
    {.what = "begins of fewer",
     .part = 6,
     .begin = 3,
     .word = "begin goes from 0 to 3, must go from 0 to the 4"},
    {.what = "a four beyond", .base = N, .word = "four[1] has column 8, must be below 8"},
    {.what = "a tile beyond", .beyond = 4, .word = "four[1] has column 9, must be below 8"},
};

/* The numbers of K_of: rows of fours of the groups 0, 1 and 2, of the planes 1 and 0. */
static void write_fours(store *s, const recipe_of_now *r) {
    uint32_t begin[5 * GROUPS + 1] = {0, 0, 1, 1, 2, 3, 4};
    tile_four fours[4] = {
        {.base = 0, .beyond = {0, 5}, .values = {{3, -2, 0, 7}, {-2, 5, 0, 0, 0, -128}}},
        {.base = 5, .values = {{0}, {0}, {0, 0, -1}}},
        {.base = 5, .values = {{1}}},
        {.base = 0, .beyond = {0, 2, 5}, .values = {{7, 0, 0, 0, 0, 0, 100}, {0}, {0, -128, 0, 0, 0, -1}}}};
    const size_t n_begins = r->n_begins > 0 ? r->n_begins : 2 * GROUPS + 1;
    const recipe plain = {.without = r->without, .other_type = r->other_type};
    if (r->part > 0) begin[r->part] = r->begin;
    if (r->base > 0) fours[1].base = r->base;
    if (r->beyond > 0) fours[1].beyond[1] = r->beyond;
    write_array(s, &plain, "/operator/groups/rows", STORE_U32, 2, (const size_t[]){GROUPS, 2},
                (const uint32_t[GROUPS][2]){{0, 2}, {2, 3}, {5, 3}});
    write_array(s, &plain, "/operator/groups/step", STORE_F32, 1, &(size_t){GROUPS},
                (const float[]){.5f, 1, 2});
    write_array(s, &plain, "/operator/K/0/begin", STORE_U32, 1, &n_begins, begin);
    write_array(s, &plain, "/operator/K/0/four", STORE_I8, 2, (const size_t[]){4, sizeof *fours}, fours);
    if (r->numbers != INT64_MIN)
        ck_ok(store_set_integer(s, "/operator/K/0", "numbers", r->numbers == 0 ? 11 : r->numbers, &error));
}

static void write_recipe_of_now(const recipe_of_now *r) {
    store *s = begin_file();
    write_fours(s, r);
    ck_ok(store_seal(s, &error));
}

static lam_operator *open_file(bool mapped) {
    store *s = NULL;
    lam_operator *op = NULL;
    ck_ok(store_open(operator_file_path, &s, &error));
    if (mapped) ck_ok(store_map_file(s, &error));
    ck_ok(operator_load(s, &op, &error));
    store_close(s);
    return op;
}

START_TEST(files_are_judged) {
    const recipe *r = &recipes[_i];
    write_recipe(r);
    operator_file_judge(r->what, r->word == NULL ? LAM_OK : LAM_ERR_FORMAT, r->word);
}
END_TEST

START_TEST(files_of_now_are_judged) {
    const recipe_of_now *r = &recipes_of_now[_i];
    write_recipe_of_now(r);
    operator_file_judge(r->what, r->word == NULL ? LAM_OK : LAM_ERR_FORMAT, r->word);
}
END_TEST

/* The arrays that are written for an operator of an older store are those of write_fours. */
START_TEST(older_files_become_those_of_now) {
    static const char *const arrays[] = {"/operator/K/0/begin", "/operator/K/0/four"};
    store *s = NULL;
    void *bytes[2][2];
    write_recipe(&recipes[0]);
    lam_operator *op = open_file(false);
    for (int k = 0; k < 2; k++) {
        size_t begins[] = {SIZE_MAX}, fours[] = {4, sizeof(tile_four)};
        int64_t numbers;
        if (k == 0) {
            ck_ok(store_create(operator_file_path, &s, &error));
            ck_ok(operator_save(op, s, &error));
            ck_ok(store_seal(s, &error));
        } else {
            write_recipe_of_now(&recipes_of_now[0]);
        }
        ck_ok(store_open(operator_file_path, &s, &error));
        ck_ok(store_read(s, arrays[0], STORE_U32, 1, begins, &bytes[k][0], &error));
        ck_ok(store_read(s, arrays[1], STORE_I8, 2, fours, &bytes[k][1], &error));
        ck_ok(store_get_integer(s, "/operator/K/0", "numbers", &numbers, &error));
        ck_assert_uint_eq(begins[0], 2 * GROUPS + 1);
        ck_assert_int_eq(numbers, 11);
        store_close(s);
    }
    ck_assert_mem_eq(bytes[0][0], bytes[1][0], (2 * GROUPS + 1) * sizeof(uint32_t));
    ck_assert_mem_eq(bytes[0][1], bytes[1][1], 4 * sizeof(tile_four));
    for (int k = 0; k < 4; k++) free(bytes[k / 2][k % 2]);
    lam_operator_close(op);
}
END_TEST

/* H = A^-1/2 W^T K W A^1/2 E for one element that shines, whose light is made by columns, and for all. */
START_TEST(arrays_mean_what_the_format_says) {
    for (size_t k = 0; k < 4; k++)
        for (size_t from = 0; from <= N; from++) {
            float E[N] = {0};
            if (k < 2)
                write_recipe(&recipes[k]);
            else
                write_recipe_of_now(&recipes_of_now[0]);
            lam_operator *op = open_file(k == 3);
            for (size_t i = 0; i < N; i++) E[i] = from == N ? (float)(i + 1) : i == from;
            float *H = transport_apply(op, false, 1, LAM_IRRADIANCE, E);
            for (size_t i = 0; i < N; i++) {
                double sum = 0, size = 0;
                for (size_t j = 0; j < N; j++) {
                    const double x = K_of(i, j) * sqrt(area_of(element_of[j])) * (double)E[element_of[j]];
                    sum += x;
                    size += 1e-6 * fabs(x);
                }
                const double root = sqrt(area_of(element_of[i]));
                ck_assert_msg(fabs((double)H[element_of[i]] - sum / root) <= 2 * size / root,
                              "file %zu: H[%u] = %g, %g", k, element_of[i], (double)H[element_of[i]],
                              sum / root);
            }
            free(H);
            lam_operator_close(op);
        }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("hierarchical operators in a store");
    TCase *tests = tcase_create("files");
    tcase_set_timeout(tests, 120);
    tcase_add_checked_fixture(tests, operator_file_setup, operator_file_teardown);
    tcase_add_loop_test(tests, files_are_judged, 0, (int)(sizeof recipes / sizeof *recipes));
    tcase_add_loop_test(tests, files_of_now_are_judged, 0,
                        (int)(sizeof recipes_of_now / sizeof *recipes_of_now));
    tcase_add_test(tests, older_files_become_those_of_now);
    tcase_add_test(tests, arrays_mean_what_the_format_says);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
