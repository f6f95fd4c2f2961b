/* Cells of an opening that receivers share against cells of their own. */
#include "solver/direct/opening_cells.h"
#include "support/placed_list.h"

enum { PLACES = 4000, MOST = 144 };

static const luminaire_opening openings[] = {
    {.shape = OPENING_RECTANGLE, .size = {1.2, .3, 0}},
    {.shape = OPENING_RECTANGLE, .size = {.6, 0, 0}},
    {.shape = OPENING_DISC, .size = {.4, .4, 0}},
    {.shape = OPENING_BOX, .size = {.6, .3, .1}, .side = {.1, .1, .1, .1}},
    {.shape = OPENING_SPHERE, .size = {.3, .3, .3}},
    {.shape = OPENING_POINT}};

/* Receivers on a line that leads past the opening, at steps of millimetres, so that most of them share their
 * cells with the last: bit for bit, also of two openings in turn. */
START_TEST(kept_cells_are_those_of_the_receiver) {
    static opening_cell own[OPENING_CELLS];
    static kept_cells kept;
    size_t shared = 0;
    for (size_t k = 0; k < sizeof openings / sizeof *openings; k++) {
        opening_faces faces[2];
        opening_faces_set(&openings[k], false, 1, &faces[0]);
        opening_faces_set(&openings[0], false, 1, &faces[1]);
        kept.of = NULL;
        for (size_t p = 0; p < PLACES; p++) {
            const opening_faces *o = &faces[p % 97 == 0];
            const double x[3] = {-2 + .001 * (double)p, .01 + 1e-4 * (double)p, -.05 - 4e-4 * (double)p};
            const size_t n = opening_cells(o, x, 1, MOST, own);
            shared += kept.of == o;
            ck_assert_uint_eq(opening_cells_keep(o, x, MOST, &kept), n);
            for (size_t c = 0; c < n; c++) {
                ck_assert_mem_eq(kept.cells[c].at, own[c].at, sizeof own[c].at);
                ck_assert_mem_eq(&kept.cells[c].share, &own[c].share, sizeof own[c].share);
                ck_assert_mem_eq(kept.cells[c].area, own[c].area, sizeof own[c].area);
            }
        }
    }
    ck_assert_uint_gt(shared, PLACES);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("opening cells");
    TCase *tests = tcase_create("opening cells");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, kept_cells_are_those_of_the_receiver);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
