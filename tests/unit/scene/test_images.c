/* Image files that are whole, damaged at every place, and too large. */
#include "solver/base/file_text.h"
#include "solver/base/random.h"
#include "solver/scene/import/images.h"
#include "solver/scene/import/imported_faces.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static char *fixture(const char *name, size_t *length) {
    char path[512], *bytes = NULL;
    lam_error error = {0};
    snprintf(path, sizeof path, "%s/textures/%s", FIXTURES, name);
    ck_assert_msg(file_text(path, &bytes, length, &error) == LAM_OK, "%s", error.message);
    return bytes;
}

/* Decodes, or checks that one phrase says why not and that nothing is left. */
static bool decode(const void *bytes, size_t length, texture_image *image) {
    char why[IMAGE_WHY] = "";
    memset(image, 0xAA, sizeof *image);
    const bool whole = image_decode(bytes, length, image, why);
    ck_assert(whole == (image->pixels != NULL));
    ck_assert(whole || (why[0] != '\0' && memchr(why, '\0', sizeof why) != NULL));
    return whole;
}

static const char *const names[] = {"tile.jpg", "tile.webp", "tile.jpg.png"};
enum { NAMES = sizeof names / sizeof *names };

/* Every beginning of a file, in memory of just its length; only a JPEG may lack its last bytes, its end mark.
 */
START_TEST(no_beginning_of_an_image_is_one) {
    size_t length = 0;
    char *bytes = fixture(names[_i], &length);
    texture_image image;
    for (size_t n = 0; n < length; n++) {
        char *part = malloc(n == 0 ? 1 : n);
        memcpy(part, bytes, n);
        if (decode(part, n, &image)) {
            ck_assert_msg(_i == 2 || length - n <= 8, "%s is whole with %zu of %zu bytes", names[_i], n,
                          length);
            free(image.pixels);
        }
        free(part);
    }
    ck_assert(decode(bytes, length, &image));
    ck_assert_uint_eq(image.width, 40);
    ck_assert_uint_eq(image.height, 24);
    ck_assert(!image_is_grey(&image));
    free(image.pixels);
    free(bytes);
}
END_TEST

/* Bytes changed by chance: any outcome but a fault. Sizes that a head gets by it are bounded. */
START_TEST(changed_bytes_do_no_harm) {
    size_t length = 0;
    uint64_t seed = 17;
    char *bytes = fixture(names[_i], &length), *changed = malloc(length);
    for (int k = 0; k < 400; k++) {
        texture_image image;
        memcpy(changed, bytes, length);
        for (int c = 0; c < 1 + k % 4; c++)
            changed[4 + random_next(&seed) % (length - 4)] ^= (char)(1 + random_next(&seed) % 255);
        if (decode(changed, length, &image)) free(image.pixels);
    }
    free(changed);
    free(bytes);
}
END_TEST

/* Means of four pixels in linear light, rounded to a level; a last odd row and column counts twice. */
START_TEST(halves_are_means_of_linear_light) {
    static const size_t sizes[][2] = {{8, 6}, {7, 5}, {1, 4}, {5, 1}, {1, 1}};
    double linear[256];
    uint64_t seed = 3;
    texture_linear_levels(linear);
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        const size_t width = sizes[s][0], height = sizes[s][1];
        texture_image image = {.width = width, .height = height};
        uint8_t before[64][3];
        image.pixels = calloc(width * height, sizeof *image.pixels);
        for (size_t k = 0; k < width * height * 3; k++)
            before[k / 3][k % 3] = (uint8_t)(random_next(&seed) >> (k % 5 == 0 ? 60 : 56));
        memcpy(image.pixels, before, width * height * sizeof *before);
        image_halve(&image);
        ck_assert_uint_eq(image.width, (width + 1) / 2);
        ck_assert_uint_eq(image.height, (height + 1) / 2);
        for (size_t y = 0; y < image.height; y++)
            for (size_t x = 0; x < image.width; x++)
                for (int c = 0; c < 3; c++) {
                    double sum = 0;
                    for (size_t k = 0; k < 4; k++) {
                        const size_t u = 2 * x + k % 2 < width ? 2 * x + k % 2 : 2 * x;
                        const size_t v = 2 * y + k / 2 < height ? 2 * y + k / 2 : 2 * y;
                        sum += linear[before[v * width + u][c]] / 4;
                    }
                    /* Between the neighbours of the level: rounding is by steps a sixteenth of a level wide.
                     */
                    const int level = image.pixels[y * image.width + x][c];
                    ck_assert(level == 0 || linear[level - 1] < sum);
                    ck_assert(level == 255 || linear[level + 1] > sum);
                }
        free(image.pixels);
    }
}
END_TEST

/* All images together have few enough pixels in the end, the largest are halved first, and those that were
 * not read stay so. */
START_TEST(images_fit_together) {
    imported_faces s = {0};
    lam_error error = {0};
    char key[16];
    uint32_t image = 7;
    for (int k = 0; k < 12; k++) {
        snprintf(key, sizeof key, "*%d", k);
        ck_assert_int_eq(imported_faces_lack_image(&s, "a.gltf", key, key, "it is a test", &error), LAM_OK);
        if (k == 3) continue;
        texture_image *of = &s.images[s.n_images - 1];
        *of = (texture_image){.width = k == 5 ? 100 : 4096, .height = k == 5 ? 100 : 4096};
        of->pixels = calloc(of->width * of->height, sizeof *of->pixels);
        ck_assert_ptr_nonnull(of->pixels);
    }
    ck_assert_int_eq(imported_faces_add_image(&s, "a.gltf", "*3", "3", "", 0, &image, &error), LAM_OK);
    ck_assert_uint_eq(image, 0);
    ck_assert_int_eq(imported_faces_add_image(&s, "a.gltf", "*4", "4", "", 0, &image, &error), LAM_OK);
    ck_assert_uint_eq(image, 5);
    imported_faces_fit_images(&s);
    size_t total = 0;
    for (size_t k = 0; k < s.n_images; k++) total += s.images[k].width * s.images[k].height;
    ck_assert_uint_le(total, IMAGES_PIXELS_MOST);
    ck_assert_uint_gt(total, IMAGES_PIXELS_MOST / 2);
    ck_assert_uint_eq(s.images[5].width, 100);
    imported_faces_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("images");
    TCase *tests = tcase_create("images");
    tcase_set_timeout(tests, 120);
    tcase_add_loop_test(tests, no_beginning_of_an_image_is_one, 0, NAMES);
    tcase_add_loop_test(tests, changed_bytes_do_no_harm, 0, NAMES);
    tcase_add_test(tests, halves_are_means_of_linear_light);
    tcase_add_test(tests, images_fit_together);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
