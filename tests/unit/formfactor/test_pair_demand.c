/* Segments that elements of little light demand: the law, the budget, and the light that is found with them.
 */
#include "solver/formfactor/pairs/pair_demand.h"

#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/sight/occlusion.h"
#include "solver/formfactor/sight/pair_occluders.h"
#include "support/plates.h"
#include "support/suite.h"

enum { ELEMENTS = 200 };

/* Element 0 sees element 1 alone, by .01 m2; all pairs of others are hidden, of .0001 m2 each. */
static pair_rows rows_of(uint32_t order[ELEMENTS], double area[ELEMENTS]) {
    pair_rows rows;
    lam_error error = {0};
    ck_assert_int_eq(pair_rows_create(ELEMENTS, &rows, &error), LAM_OK);
    for (uint32_t i = 0; i < ELEMENTS; i++) {
        pair_block *block = &rows.blocks[i / PAIR_BLOCK_ROWS];
        order[i] = ELEMENTS - 1 - i; /* position to element */
        area[i] = 1;
        block->begin[i % PAIR_BLOCK_ROWS] = block->used;
        ck_assert(pair_block_reserve(block, ELEMENTS));
        for (uint32_t j = i + 1; j < ELEMENTS; j++) {
            const bool seen = i == ELEMENTS - 2;
            pair_block_add(block, j, seen ? .01f : 1e-4f, seen ? PAIR_CERTAIN : PAIR_HIDDEN | PAIR_SETTLED);
        }
        for (uint32_t r = i % PAIR_BLOCK_ROWS + 1; r <= PAIR_BLOCK_ROWS; r++) block->begin[r] = block->used;
    }
    return rows;
}

static pair_demand demand_within(const pair_rows *rows, const uint32_t *order, const double *area,
                                 double budget) {
    pair_demand d = {.level = 0};
    lam_error error = {0};
    ck_assert_int_eq(pair_demand_find(rows, order, area, budget, &d, &error), LAM_OK);
    return d;
}

START_TEST(dark_elements_demand_segments) {
    uint32_t order[ELEMENTS];
    double area[ELEMENTS];
    pair_rows rows = rows_of(order, area);
    pair_demand d = demand_within(&rows, order, area, 1e9);
    ck_assert_double_eq(d.level, 1e-5);
    ck_assert_double_eq_tol(d.light[0], .01, 1e-9);
    ck_assert_double_eq_tol(d.light[1], .01, 1e-9);
    ck_assert_double_eq_tol(d.light[2], 1e-3, 1e-9); /* of its hemisphere */
    /* As the header says. */
    ck_assert_double_eq_tol(pair_demand_of(&d, 0, 1, 1e-5),
                            pow(SEGMENTS_ERROR * 1e-3 / 1e-5, 1 / SEGMENTS_POWER), 1e-3);
    ck_assert_double_eq(pair_demand_of(&d, 2, 0, 1e-2), DEMAND_MOST);
    ck_assert_double_eq(pair_demand_of(&d, 0, 1, 1e-8), 0);
    ck_assert_double_eq(pair_demand_of(&(pair_demand){.level = 0}, 0, 1, 1), 0);
    pair_demand_free(&d);
    pair_rows_free(&rows);
}
END_TEST

START_TEST(demand_keeps_to_its_budget) {
    uint32_t order[ELEMENTS];
    double area[ELEMENTS], most = 0;
    pair_rows rows = rows_of(order, area);
    for (double budget = 1e5; budget < 2e7; budget *= 10) {
        pair_demand d = demand_within(&rows, order, area, budget);
        double sum = 0;
        for (uint32_t i = 0; i < ELEMENTS; i++)
            for (uint32_t j = i + 1; j < ELEMENTS; j++)
                sum += i == 0 && j == 1 ? 0 : pair_demand_of(&d, i, j, 1e-4);
        /* Steps of half an octave in g / L are 1.64 in segments. */
        ck_assert_double_le(sum, 1.7 * budget);
        most = fmax(most, sum);
        pair_demand_free(&d);
    }
    ck_assert_double_ge(most, .1 * 1e7);
    pair_rows_free(&rows);
}
END_TEST

/* Plates far apart, between which a screen leaves a fiftieth of the light: their factor is so small that
 * eight segments suffice, most of which see nothing. The screen is of too many strips to be projected, each
 * behind the edge of the next. The middle of the segment between points x, y of both plates passes beside the
 * last strip where (x + y) / 2 > 1 - h, for a share 2 h^2 of all. */
START_TEST(light_past_a_screen_is_found) {
    enum { SEEDS = 64, STRIPS = UNCUT_OCCLUDERS_MOST + 2 };
    static const double h = .1, apart = 30;
    const box_cell cells[] = {{.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {1, 1, 0}},
                              {.axis = 2, .level = apart, .from = {0, 0, apart}, .to = {1, 1, apart}}};
    mesh m = {0};
    mesh_add_cell(&m, &cells[0], true);
    mesh_add_cell(&m, &cells[1], false);
    for (int k = 0; k < STRIPS; k++) {
        const double to = 1 - h - (1 + h) * k / STRIPS, z = apart / 2 + .02 * k;
        const box_cell strip = {
            .axis = 2, .level = z, .from = {to - (1 + h) / STRIPS - .02, -1, z}, .to = {to, 2, z}};
        mesh_add_cell(&m, &strip, true);
        mesh_add_cell(&m, &strip, false);
    }
    mesh_finish(&m, .5f);
    lam_error error = {0};
    visibility *v = NULL;
    ck_assert_msg(visibility_create(&m, &v, &error) == LAM_OK, "%s", error.message);
    double sum = 0, squares = 0, dark = 0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        const pairs_options options = {.tolerance = 1e-6,
                                       .accuracy = 7e-5,
                                       .segments = 8,
                                       .segments_most = 1e12,
                                       .occluders = UNCUT_OCCLUDERS_MOST,
                                       .seed = seed};
        pairs_report report;
        csr G = {0};
        ck_assert_msg(pairs_exchange(&m, v, &options, &G, &report, NULL, &error) == LAM_OK, "%s",
                      error.message);
        const double truth = 2 * h * h / (3.14159265358979323846 * apart * apart);
        const double off = csr_entry(&G, 0, 1) / truth - 1;
        sum += off;
        squares += off * off;
        dark += off < -.99;
        csr_free(&G);
    }
    const double mean = sum / SEEDS, rms = sqrt(squares / SEEDS);
    /* Independent segments have sqrt((1 - V) / (V N)): 2.5 by eight, .44 by 256. */
    ck_assert_double_le(rms, .44);
    ck_assert_double_le(fabs(mean), 3 * rms / sqrt(SEEDS));
    ck_assert_double_eq(dark, 0);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("pair demand");
    TCase *cases = tcase_create("pair demand");
    tcase_set_timeout(cases, 60);
    tcase_add_test(cases, dark_elements_demand_segments);
    tcase_add_test(cases, demand_keeps_to_its_budget);
    tcase_add_test(cases, light_past_a_screen_is_found);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
