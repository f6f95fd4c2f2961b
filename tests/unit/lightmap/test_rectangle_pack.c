/* Rectangles on shelves: none overlap, all lie within, and little is left over. */
#include "solver/base/random.h"
#include "solver/lightmap/rectangle_pack.h"
#include "support/suite.h"

#include <string.h>

enum { MOST = 512 };

/* Marks the cells of each rectangle, which nothing else may have. */
static double filled(size_t n, const packed_rectangle *r, size_t width, size_t height) {
    static bool taken[MOST * MOST];
    size_t count = 0;
    memset(taken, 0, sizeof taken);
    for (size_t k = 0; k < n; k++)
        for (size_t y = r[k].y; y < r[k].y + r[k].height; y++)
            for (size_t x = r[k].x; x < r[k].x + r[k].width; x++) {
                ck_assert(x < width && y < height && !taken[y * width + x]);
                taken[y * width + x] = true;
                count++;
            }
    return (double)count / (double)(width * height);
}

START_TEST(none_overlap) {
    enum { N = 300 };
    packed_rectangle r[N];
    lam_error error = {0};
    for (uint64_t seed = 0; seed < 20; seed++) {
        size_t width, height;
        for (size_t k = 0; k < N; k++) {
            const uint64_t bits = random_hash(1000 * seed + k);
            r[k] = (packed_rectangle){.width = 5 + bits % 30, .height = 5 + bits / 64 % 12};
        }
        ck_ok(rectangles_pack(N, r, MOST, &width, &height, &error));
        ck_assert(width > 0 && width <= MOST && height <= MOST);
        /* Shelves of falling height waste less than a row of the tallest, 16, and the ends of shelves, 34. */
        ck_assert_double_gt(filled(N, r, width, height), .8);
    }
}
END_TEST

START_TEST(one_and_those_that_do_not_fit) {
    lam_error error = {0};
    size_t width, height;
    packed_rectangle r[3] = {{.width = 40, .height = 3}};
    ck_ok(rectangles_pack(1, r, 40, &width, &height, &error));
    ck_assert(width == 40 && height == 3 && r[0].x == 0 && r[0].y == 0);
    ck_ok(rectangles_pack(1, r, 39, &width, &height, &error));
    ck_assert(width == 0 && height == 0);
    for (int k = 0; k < 3; k++) r[k] = (packed_rectangle){.width = 20, .height = 20};
    ck_ok(rectangles_pack(3, r, 39, &width, &height, &error));
    ck_assert(width == 0 && height == 0);
    ck_ok(rectangles_pack(3, r, 60, &width, &height, &error));
    ck_assert_double_gt(filled(3, r, width, height), .7);
}
END_TEST

int main(void) {
    Suite *s = suite_create("rectangles on shelves");
    TCase *c = tcase_create("all");
    tcase_add_test(c, none_overlap);
    tcase_add_test(c, one_and_those_that_do_not_fit);
    suite_add_tcase(s, c);
    return suite_run(s);
}
