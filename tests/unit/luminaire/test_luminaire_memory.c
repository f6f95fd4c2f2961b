/* Luminaires, and lists of them, that are read with too little memory: the reader says so and keeps nothing.
 */
#include "solver/luminaire/luminaire.h"
#include "solver/luminaire/placed.h"
#include "solver/luminaire/polar_curves.h"
#include "support/failing_memory.h"
#include "support/suite.h"

#include <string.h>

static const char *const texts[] = {
    "IESNA91\n[A] b\nTILT=INCLUDE\n1 2 0 90 1 1\n1 -1 1 2 3 1 2 0 0 0\n1 1 1\n0 90\n0 120 240\n1 2 3 4 5 6\n",
    "a\n1\n3\n4\n90\n2\n90\nb\nc\nd\ne\nf\n1\n1\n1\n1\n1\n0\n0\n0\n0\n1\n1\n1\n0\n1\n1\nx\n1000\ny\nz\n1\n"
    "0\n0\n0\n0\n0\n0\n0\n0\n0\n0\n0\n90\n180\n270\n0\n90\n1\n2\n3\n4\n5\n6\n"};

START_TEST(reading) {
    const luminaire_options options = {.set = 0};
    lam_error error = {0};
    luminaire l = {0};
    long needed = 0;
    for (;; needed++) {
        allocations_left = needed;
        const lam_status status =
            luminaire_read_text("a", texts[_i], strlen(texts[_i]), &options, &l, &error);
        allocations_left = -1;
        if (status == LAM_OK) break;
        ck_assert_int_eq(status, LAM_ERR_MEMORY);
        ck_assert_ptr_null(l.candela);
    }
    ck_assert_int_ge(needed, 4);
    for (long left = 0; left < 2; left++) {
        char *text = NULL;
        size_t length = 0;
        FILE *stream = open_memstream(&text, &length);
        allocations_left = left;
        const lam_status csv = polar_curves_csv(&l, stream, &error);
        allocations_left = 0;
        const lam_status svg = polar_curves_svg(&l, "a", stream, &error);
        allocations_left = -1;
        ck_assert(csv == LAM_ERR_MEMORY && svg == LAM_ERR_MEMORY);
        fclose(stream);
        free(text);
    }
    luminaire_free(&l);
}
END_TEST

static const char *const lists[] = {
    "{\"luminaires\": [{\"name\": \"a\", \"file\": \"f\", \"at\": [0, 0, 0], \"ignore\": [\"b\"]}]}",
    "name,file,x,y,z\na,f,1,2,3\nb,g,1,2,3\n"};

START_TEST(lists_of_luminaires) {
    const placed_options options = {.unit = 1};
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    long needed = 0;
    for (;; needed++) {
        allocations_left = needed;
        const lam_status status = placed_read_text("a", lists[_i], strlen(lists[_i]), &options, &p, &error);
        allocations_left = -1;
        if (status == LAM_OK) break;
        ck_assert_int_eq(status, LAM_ERR_MEMORY);
        ck_assert(p.luminaires == NULL && p.files == NULL);
    }
    ck_assert_int_ge(needed, 2);
    placed_free(&p);
}
END_TEST

/* A list with one luminaire stays as it was. */
START_TEST(lights_as_luminaires) {
    const placed_options options = {.unit = 1};
    const punctual_light lights[] = {
        {.name = "l", .kind = PUNCTUAL_POINT, .direction = {0, 0, -1}},
        {.name = "m", .kind = PUNCTUAL_SPOT, .direction = {1, 0, 0}, .outer = 1}};
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    size_t outside = 0;
    long needed = 0;
    ck_ok(placed_read_text("a", lists[0], strlen(lists[0]), &options, &p, &error));
    for (;; needed++) {
        const placed_luminaires kept = p;
        allocations_left = needed;
        const lam_status status = placed_from_lights("s", 2, lights, &p, &outside, &error);
        allocations_left = -1;
        if (status == LAM_OK) break;
        ck_assert_int_eq(status, LAM_ERR_MEMORY);
        ck_assert_mem_eq(&p, &kept, sizeof p);
    }
    ck_assert_int_ge(needed, 10);
    ck_assert(p.n == 3 && p.n_files == 3);
    placed_free(&p);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("luminaire_memory");
    TCase *tests = tcase_create("all");
    tcase_add_loop_test(tests, reading, 0, sizeof texts / sizeof *texts);
    tcase_add_loop_test(tests, lists_of_luminaires, 0, sizeof lists / sizeof *lists);
    tcase_add_test(tests, lights_as_luminaires);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
