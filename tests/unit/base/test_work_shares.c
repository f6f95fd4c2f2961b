/* Pieces of work are taken once each, by the thread whose part they are or by one that has none left. */
#include "solver/base/work_shares.h"
#include "support/suite.h"

#include <omp.h>

enum { PIECES = 1000 };

/* For any numbers of pieces, of threads that the parts are for and of threads that come. */
START_TEST(each_piece_once) {
    static const size_t counts[] = {0, 1, 2, 7, 64, 999, PIECES}, threads[] = {0, 1, 2, 3, 64, 200};
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++)
        for (size_t t = 0; t < sizeof threads / sizeof *threads; t++)
            for (size_t at_once = 1; at_once < 80; at_once += 26) {
                int taken[PIECES] = {0};
                work_shares s;
                work_shares_begin(&s, counts[c], at_once, threads[t]);
#pragma omp parallel num_threads(3)
                {
                    size_t tried = 0, first, last;
                    while (work_shares_take(&s, (size_t)omp_get_thread_num(), &tried, &first, &last))
                        for (size_t k = first; k < last; k++)
                            __atomic_fetch_add(&taken[k], 1, __ATOMIC_RELAXED);
                }
                for (size_t k = 0; k < PIECES; k++) ck_assert_int_eq(taken[k], k < counts[c]);
            }
}
END_TEST

/* A thread takes its own part from the beginning, then the others' in their sequence. */
START_TEST(own_part_first) {
    static const size_t begin[] = {0, 3, 6, 10};
    for (size_t thread = 0; thread < 3; thread++) {
        work_shares s;
        size_t tried = 0, first, last;
        work_shares_begin(&s, 10, 2, 3);
        for (size_t k = 0; k < 3; k++) {
            const size_t part = (thread + k) % 3;
            for (size_t at = begin[part]; at < begin[part + 1]; at = last) {
                ck_assert(work_shares_take(&s, thread, &tried, &first, &last));
                ck_assert_uint_eq(first, at);
                ck_assert_uint_eq(last, at + 2 < begin[part + 1] ? at + 2 : begin[part + 1]);
            }
        }
        ck_assert(!work_shares_take(&s, thread, &tried, &first, &last));
        tried = 0;
        ck_assert(!work_shares_take(&s, 1, &tried, &first, &last));
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("work shares");
    TCase *tests = tcase_create("work shares");
    tcase_add_test(tests, each_piece_once);
    tcase_add_test(tests, own_part_first);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
