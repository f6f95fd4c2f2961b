/* Quantiles and tables of the suites of measurements, the scenes that they build, and the figures of cities.
 */
#include "support/suite.h"
#include "tests/bench/suites/bench.h"
#include "tests/bench/suites/cities.h"
#include "tests/bench/suites/scenes.h"
#include "tests/bench/suites/stats.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

START_TEST(quantiles) {
    double x[] = {5, 1, 4, 2, 3}, one[] = {7};
    ck_assert_double_eq(stats_median(x, 5), 3);
    ck_assert_double_eq(stats_quantile(x, 5, 0), 1);
    ck_assert_double_eq(stats_quantile(x, 5, 1), 5);
    ck_assert_double_eq(stats_quantile(x, 5, .125), 1.5);
    ck_assert_double_eq(stats_median(x, 4), 2.5);
    ck_assert_double_eq(stats_quantile(one, 1, .95), 7);
    ck_assert(isnan(stats_median(x, 0)) && isnan(stats_mean(x, 0)));
    ck_assert_double_eq(stats_mean(x, 5), 3);
}
END_TEST

/* Errors fall as 1, .25, .0625 and NaN; costs rise as 1, 4, 16. */
START_TEST(cost_at_an_error) {
    const double error[] = {1, .25, .0625, NAN}, cost[] = {1, 4, 16, 2}, dear[] = {8, 4, 16, 2};
    ck_assert_double_eq(stats_cost_at(4, error, cost, 1), 1);
    ck_assert_double_eq_tol(stats_cost_at(4, error, cost, .5), 2, 1e-14);
    ck_assert_double_eq_tol(stats_cost_at(4, error, cost, .125), 8, 1e-14);
    ck_assert_double_eq(stats_cost_at(4, error, cost, 3), 1);
    ck_assert(isinf(stats_cost_at(4, error, cost, .01)));
    ck_assert(isinf(stats_cost_at(0, error, cost, 1)));
    /* The finer one may be the cheaper one. */
    ck_assert_double_eq(stats_cost_at(4, error, dear, 1), 4);
}
END_TEST

static const table_column columns[] = {
    {"what", NULL, "a text"}, {"much", "s", "a number"}, {"more", "", "another"}};

static table sample(void) {
    table t = {.name = "sample", .title = "A sample", .columns = columns, .n_columns = 3};
    table_text(&t, "plain");
    table_number(&t, .1);
    table_number(&t, 3);
    table_text(&t, "comma, \"quote\"\nline");
    table_number(&t, NAN);
    table_number(&t, -1e-12);
    return t;
}

typedef struct written {
    char *text;
    size_t size;
} written;

static const table_run run_sample = {
    .tool = "lambert", .scale = "quick", .time = "2026-01-01T00:00:00Z", .seed = 1, .threads = 2};

START_TEST(csv_quotes) {
    table t = sample();
    written w = {0};
    FILE *stream = open_memstream(&w.text, &w.size);
    table_csv(&t, stream);
    fclose(stream);
    ck_assert_str_eq(w.text, "what,much,more\r\nplain,0.1,3\r\n\"comma, \"\"quote\"\"\nline\",,-1e-12\r\n");
    free(w.text);
    table_free(&t);
}
END_TEST

START_TEST(json_parses) {
    table t = sample();
    lam_error error = {0};
    written w = {0};
    FILE *stream = open_memstream(&w.text, &w.size);
    ck_assert_int_eq(table_json(&t, &run_sample, stream, &error), LAM_OK);
    fclose(stream);
    json_t *root = json_loadb(w.text, w.size, 0, NULL);
    ck_assert_ptr_nonnull(root);
    const json_t *rows = json_object_get(root, "rows"), *second = json_array_get(rows, 1);
    ck_assert_uint_eq(json_array_size(rows), 2);
    ck_assert_str_eq(json_string_value(json_object_get(second, "what")), "comma, \"quote\"\nline");
    ck_assert(json_is_null(json_object_get(second, "much")));
    ck_assert_double_eq(json_real_value(json_object_get(second, "more")), -1e-12);
    const json_t *names = json_object_get(root, "columns");
    ck_assert(json_is_null(json_object_get(json_array_get(names, 0), "unit")));
    ck_assert_str_eq(json_string_value(json_object_get(json_array_get(names, 1), "unit")), "s");
    ck_assert_int_eq(json_integer_value(json_object_get(json_object_get(root, "run"), "threads")), 2);
    json_decref(root);
    free(w.text);
    table_free(&t);
}
END_TEST

START_TEST(terminal_columns_align) {
    table t = {.name = "sample", .title = "A sample", .columns = columns, .n_columns = 3};
    written w = {0};
    for (int row = 0; row < 2; row++) {
        table_text(&t, row == 0 ? "a" : "a longer text");
        table_number(&t, row == 0 ? NAN : 1234567);
        table_number(&t, 1. / 3);
    }
    FILE *stream = open_memstream(&w.text, &w.size);
    table_print(&t, stream);
    fclose(stream);
    ck_assert_str_eq(w.text, "A sample\n"
                             "what              much   more\n"
                             "a                    -  0.333\n"
                             "a longer text  1234567  0.333\n\n");
    free(w.text);
    table_free(&t);
}
END_TEST

/* Twelve cells of ground and four of roof a lot, and of the walls only fronts that look outwards: seen from
 * outside, all the walls of a storey enclose a 2 x 2 house. */
START_TEST(houses_stand_on_their_lots) {
    mesh m = {0};
    lam_error error = {0};
    ck_assert_msg(scene_houses(3, 1, &m, &error) == LAM_OK, "%s", error.message);
    double up = 0, sum[3] = {0}, outwards = 0;
    size_t walls = 0;
    for (size_t i = 0; i < m.n; i++) {
        double centre[3];
        mesh_centroid(&m, i, centre);
        ck_assert_double_eq_tol(m.area[i], 1, 1e-12);
        up += (double)m.normal[i][2];
        for (int d = 0; d < 3; d++) sum[d] += (double)m.normal[i][d];
        if (m.normal[i][2] > .5f) continue;
        walls++;
        for (int d = 0; d < 2; d++) /* from the middle of the lot */
            outwards += (double)m.normal[i][d] * (fmod(centre[d], 4) - 2);
    }
    ck_assert_double_eq_tol(up, 9 * 16, 1e-6);
    ck_assert_double_eq_tol(sum[0], 0, 1e-6);
    ck_assert_double_eq_tol(sum[1], 0, 1e-6);
    ck_assert_uint_gt(walls, 0);
    ck_assert_uint_eq(walls % 8, 0);
    ck_assert_double_eq_tol(outwards, (double)walls, 1e-6); /* each is 1 m from the middle */
    mesh_free(&m);
}
END_TEST

START_TEST(pieces_become_elements) {
    const scene_piece pieces[] = {{{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, false},
                                  {{0, 0, 1}, {0, 2, 0}, {2, 0, 0}, true}},
                      flat[] = {{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, false}};
    mesh m = {0};
    lam_error error = {0};
    ck_assert_msg(scene_of_pieces(pieces, 2, &m, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(m.n_vertices, 7);
    ck_assert_uint_eq(m.elements[1][3], MESH_NO_VERTEX);
    ck_assert_double_eq_tol(m.area[0], 6, 1e-12);
    ck_assert_double_eq_tol(m.area[1], 2, 1e-12);
    ck_assert_float_eq(m.normal[0][2], 1);
    ck_assert_float_eq(m.normal[1][2], -1);
    mesh_free(&m);
    ck_assert_int_eq(scene_of_pieces(flat, 1, &m, &error), LAM_ERR_ARGUMENT);
}
END_TEST

/* Checks that the tables of a suite have whole rows, and keeps their names. */
typedef struct harvest {
    char tables[512]; /* names, each after a space */
    size_t kind_rows, map_rows;
} harvest;

static lam_status reap_table(void *context, const table *t, lam_error *error) {
    harvest *h = context;
    (void)error;
    ck_assert_msg(t->used > 0 && t->used % t->n_columns == 0, "table %s: %zu cells", t->name, t->used);
    for (size_t c = 0; c < t->n_columns; c++) ck_assert(t->columns[c].doc[0] != '\0');
    strcat(strcat(h->tables, " "), t->name);
    if (strcmp(t->name, "kinds") == 0) h->kind_rows = table_rows(t);
    if (strcmp(t->name, "map") == 0) h->map_rows = table_rows(t);
    /* Each count and measure in the first rows is there and not below 0. */
    for (size_t c = 0; c < t->n_columns && c < 2; c++)
        if (t->columns[c].unit != NULL) ck_assert_double_ge(t->cells[c].number, 0);
    return LAM_OK;
}

static void reap_line(void *context, const char *line) {
    (void)context;
    (void)line;
}

START_TEST(figures_of_cities_are_whole) {
    harvest h = {.kind_rows = 0};
    lam_error error = {0};
    const bench_sink sink = {.table = reap_table, .say = reap_line, .context = &h};
    const bench_run run = {.scale = BENCH_QUICK, .seed = 1, .sink = &sink};
    ck_assert_msg(cities_radiosity(&run, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(cities_figures(&run, &error) == LAM_OK, "%s", error.message);
    ck_assert_str_eq(
        h.tables, " bounces bounces-curves relaxation tiles map kinds singular-values singular-values-curves"
                  " distribution distribution-curves");
    ck_assert_uint_eq(h.map_rows, MAP_SCENES);
    ck_assert_uint_eq(h.kind_rows, 6 * MAP_MAIN);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("bench");
    TCase *cases = tcase_create("bench");
    tcase_add_test(cases, quantiles);
    tcase_add_test(cases, cost_at_an_error);
    tcase_add_test(cases, csv_quotes);
    tcase_add_test(cases, json_parses);
    tcase_add_test(cases, terminal_columns_align);
    tcase_add_test(cases, houses_stand_on_their_lots);
    tcase_add_test(cases, pieces_become_elements);
    tcase_add_test(cases, figures_of_cities_are_whole);
    tcase_set_timeout(cases, 300); /* of the figures, on a busy machine */
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
