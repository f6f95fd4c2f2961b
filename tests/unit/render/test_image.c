/* Pictures on the disk, the tone curve, false colour, the legend. */
#include "solver/render/image.h"
#include "solver/render/picture.h"
#include "solver/render/tone.h"
#include "support/suite.h"

#include <dirent.h>
#include <math.h>
#include <png.h>
#include <signal.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static char *scratch_folder(void) {
    char *folder = strdup("/tmp/lambert-image-XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
    return folder;
}

static size_t files_in(const char *folder) {
    size_t count = 0;
    DIR *d = opendir(folder);
    ck_assert_ptr_nonnull(d);
    for (struct dirent *e = readdir(d); e != NULL; e = readdir(d))
        count += e->d_name[0] != '.' || strlen(e->d_name) > 2;
    closedir(d);
    return count;
}

static image noise(size_t width, size_t height, size_t channels) {
    image picture;
    lam_error error = {0};
    ck_assert_msg(image_create(width, height, channels, &picture, &error) == LAM_OK, "%s", error.message);
    uint32_t state = 1;
    for (size_t i = 0; i < width * height * channels; i++) {
        state = state * 1664525u + 1013904223u;
        picture.pixels[i] = (uint8_t)(state >> 24);
    }
    return picture;
}

START_TEST(test_round_trip) {
    const size_t channels = _i == 0 ? 1 : 3;
    char *folder = scratch_folder(), path[64];
    lam_error error = {0};
    image picture = noise(37, 11, channels);
    snprintf(path, sizeof path, "%s/a.png", folder);
    ck_assert_msg(image_write_png(&picture, path, &error) == LAM_OK, "%s", error.message);

    png_image back;
    memset(&back, 0, sizeof back);
    back.version = PNG_IMAGE_VERSION;
    ck_assert(png_image_begin_read_from_file(&back, path));
    ck_assert_uint_eq(back.width, 37);
    ck_assert_uint_eq(back.height, 11);
    ck_assert_uint_eq(PNG_IMAGE_SAMPLE_CHANNELS(back.format), channels);
    uint8_t pixels[37 * 11 * 3];
    ck_assert(png_image_finish_read(&back, NULL, pixels, 0, NULL));
    ck_assert_mem_eq(pixels, picture.pixels, 37 * 11 * channels);
    ck_assert_uint_eq(files_in(folder), 1);
    unlink(path);
    rmdir(folder);
    free(folder);
    image_free(&picture);
}
END_TEST

START_TEST(test_full_disk_leaves_the_old_file) {
    char *folder = scratch_folder(), path[64], text[16] = "";
    lam_error error = {0};
    image picture = noise(256, 256, 3);
    snprintf(path, sizeof path, "%s/a.png", folder);
    FILE *old = fopen(path, "w");
    ck_assert_ptr_nonnull(old);
    fputs("older", old);
    fclose(old);

    /* A limit on file size stands for a full disk: the same write fails at the same place. */
    struct rlimit limit, small;
    ck_assert_int_eq(getrlimit(RLIMIT_FSIZE, &limit), 0);
    small = limit;
    small.rlim_cur = 20000;
    signal(SIGXFSZ, SIG_IGN);
    ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &small), 0);
    lam_status status = image_write_png(&picture, path, &error);
    ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &limit), 0);
    ck_assert_int_eq(status, LAM_ERR_IO);
    ck_assert_ptr_nonnull(strstr(error.message, path));
    ck_assert_uint_eq(files_in(folder), 1);
    old = fopen(path, "r");
    ck_assert_ptr_nonnull(old);
    ck_assert_ptr_nonnull(fgets(text, sizeof text, old));
    fclose(old);
    ck_assert_str_eq(text, "older");
    unlink(path);
    rmdir(folder);
    free(folder);
    image_free(&picture);
}
END_TEST

START_TEST(test_no_folder) {
    lam_error error = {0};
    image picture = noise(2, 2, 1);
    ck_assert_int_eq(image_write_png(&picture, "/nonexistent/a.png", &error), LAM_ERR_IO);
    ck_assert_ptr_nonnull(strstr(error.message, "/nonexistent"));
    image_free(&picture);
}
END_TEST

START_TEST(test_sizes) {
    ck_assert_int_eq(image_check_size(1, 1, NULL), LAM_OK);
    ck_assert_int_eq(image_check_size(16384, 4096, NULL), LAM_OK);
    ck_assert_int_eq(image_check_size(16384, 4097, NULL), LAM_ERR_ARGUMENT);
    ck_assert_int_eq(image_check_size(16385, 1, NULL), LAM_ERR_ARGUMENT);
    ck_assert_int_eq(image_check_size(0, 1, NULL), LAM_ERR_ARGUMENT);
    ck_assert_int_eq(image_check_size(1, 0, NULL), LAM_ERR_ARGUMENT);
    ck_assert_int_eq(image_check_size(SIZE_MAX, 2, NULL), LAM_ERR_ARGUMENT);
}
END_TEST

START_TEST(test_srgb) {
    /* Values of IEC 61966-2-1: 255 (1.055 x^(1/2.4) - .055) by hand for .18 and .5, 255 * 12.92 x below. */
    ck_assert_int_eq(tone_encode(0), 0);
    ck_assert_int_eq(tone_encode(.002f), 7);
    ck_assert_int_eq(tone_encode(.18f), 118);
    ck_assert_int_eq(tone_encode(.5f), 188);
    ck_assert_int_eq(tone_encode(1), 255);
    ck_assert_int_eq(tone_encode(7), 255);
    ck_assert_int_eq(tone_encode(-1), 0);
    for (int code = 0; code < 256; code++)
        ck_assert_int_eq(tone_encode(tone_decode((float)code / 255)), code);
}
END_TEST

START_TEST(test_curve) {
    ck_assert_float_eq(tone_curve(-1), 0);
    ck_assert_float_eq(tone_curve(.3f), .3f);
    float before = 0;
    for (float x = .01f; x < 6; x += .01f) {
        const float y = tone_curve(x);
        ck_assert_msg(y >= before && y <= 1 && y <= x, "curve(%g) = %g after %g", x, y, before);
        ck_assert_msg(y - before <= .0101f, "a jump at %g", x);
        before = y;
    }
    ck_assert_float_gt(before, .999f);
}
END_TEST

START_TEST(test_color_keeps_its_hue) {
    float dim[3] = {.5f, .2f, -.1f}, bright[3] = {2, 1, .5f}, lamp[3] = {170, 120, 40};
    tone_color(dim);
    ck_assert_float_eq(dim[0], .5f);
    ck_assert_float_eq(dim[1], .2f);
    ck_assert_float_eq(dim[2], 0);
    tone_color(bright);
    ck_assert_float_le(bright[0], 1);
    ck_assert_float_gt(bright[0], bright[1] + .2f);
    ck_assert_float_gt(bright[1], bright[2] + .1f);
    tone_color(lamp);
    for (int c = 0; c < 3; c++) ck_assert_int_eq(tone_encode(lamp[c]), 255);
}
END_TEST

START_TEST(test_false_color_rises) {
    /* Rec. 709 luminance of the linear colour must rise with every step, or two values look alike. */
    float before = -1;
    for (int i = 0; i <= 200; i++) {
        float rgb[3], linear[3];
        palette_color(palette_find(_i == 0 ? "viridis" : "inferno"), (float)i / 200, rgb);
        for (int c = 0; c < 3; c++) linear[c] = tone_decode(rgb[c]);
        const float now = tone_luminance(linear, 3);
        ck_assert_msg(now > before, "at %d of 200: %g after %g", i, now, before);
        before = now;
    }
}
END_TEST

START_TEST(test_palettes) {
    /* Ends as the tables of viridis, inferno and turbo have them, and colours beyond are those of the ends.
     */
    static const struct {
        const char *name;
        int first[3], last[3];
    } known[] = {{"viridis", {68, 1, 84}, {253, 231, 37}},
                 {"inferno", {0, 0, 4}, {252, 255, 164}},
                 {"turbo", {35, 23, 27}, {144, 12, 0}}};
    for (size_t k = 0; k < sizeof known / sizeof *known; k++) {
        const palette *p = palette_find(known[k].name);
        float low[3], high[3];
        ck_assert_ptr_nonnull(p);
        palette_color(p, -3, low);
        palette_color(p, 7, high);
        for (int c = 0; c < 3; c++) {
            ck_assert_int_eq((int)lrintf(255 * low[c]), known[k].first[c]);
            ck_assert_int_eq((int)lrintf(255 * high[c]), known[k].last[c]);
        }
    }
    ck_assert_ptr_null(palette_find("jet"));
}
END_TEST

START_TEST(test_scales) {
    /* Ticks by hand: steps of 1, 2 or 5 times a power of ten, 4 to 8 of them; decades and their parts. */
    static const struct {
        color_scale scale;
        size_t n;
        double ticks[COLOR_SCALE_TICKS];
    } known[] = {
        {{.high = 1}, 6, {0, .2, .4, .6, .8, 1}},
        {{.high = 2.4}, 5, {0, .5, 1, 1.5, 2}},
        {{.high = 750}, 4, {0, 200, 400, 600}},
        {{.high = 700}, 8, {0, 100, 200, 300, 400, 500, 600, 700}},
        {{.low = 95, .high = 105}, 5, {96, 98, 100, 102, 104}},
        {{.low = 1000, .high = 1000.1}, 6, {1000, 1000.02, 1000.04, 1000.06, 1000.08, 1000.1}},
        {{.low = .1, .high = 100, .logarithmic = true}, 10, {.1, .2, .5, 1, 2, 5, 10, 20, 50, 100}},
        {{.low = 1e-3, .high = 300, .logarithmic = true}, 6, {.001, .01, .1, 1, 10, 100}},
        {{.low = 2, .high = 4, .logarithmic = true}, 5, {2, 2.5, 3, 3.5, 4}},
    };
    for (size_t k = 0; k < sizeof known / sizeof *known; k++) {
        double ticks[COLOR_SCALE_TICKS];
        const size_t n = color_scale_ticks(&known[k].scale, ticks);
        ck_assert_msg(n == known[k].n, "scale %zu: %zu ticks", k, n);
        for (size_t i = 0; i < n; i++)
            ck_assert_double_eq_tol(ticks[i], known[k].ticks[i], 1e-9 * known[k].scale.high);
    }
    ck_assert_double_eq(color_scale_place(&known[1].scale, .6), .25);
    ck_assert_double_eq_tol(color_scale_place(&known[6].scale, 10), 2. / 3, 1e-15);
    ck_assert_double_lt(color_scale_place(&known[6].scale, 0), -1e300);
}
END_TEST

START_TEST(test_exposure) {
    /* 5 % of the room is a lamp 10,000 times as bright: the rest must stay visible, the lamp white. */
    tone_histogram h = {0};
    for (int i = 0; i < 960; i++) tone_histogram_add(&h, .01f + 1e-5f * (float)i);
    for (int i = 0; i < 40; i++) tone_histogram_add(&h, 200);
    const float scale = (float)tone_exposure(&h);
    ck_assert_float_gt(tone_curve(scale * .015f), .2f);
    ck_assert_float_lt(tone_curve(scale * .015f), .8f);
    ck_assert_int_eq(tone_encode(tone_curve(scale * 200)), 255);
    /* The quantile is right to half a bin: 2^(1/40) = 1.75 %. */
    ck_assert_double_eq_tol(tone_histogram_quantile(&h, .5), .015, .015 * .03);
    /* Nothing but darkness, and nothing at all. */
    tone_histogram dark = {0};
    ck_assert_double_eq(tone_exposure(&dark), 1);
    tone_histogram_add(&dark, 0);
    ck_assert_double_eq(tone_exposure(&dark), 1);
}
END_TEST

START_TEST(test_legend) {
    const color_scale scale = {.palette = palette_find("turbo"), .high = 250};
    image picture;
    ck_assert_int_eq(image_create(640, 480, 3, &picture, NULL), LAM_OK);
    picture_legend(&scale, "W/m2", &picture);
    size_t touched = 0;
    for (size_t i = 0; i < 640 * 480 * 3; i++) touched += picture.pixels[i] != 0;
    ck_assert_uint_gt(touched, 1000);
    image_free(&picture);
    /* Too small a picture stays as it is. */
    ck_assert_int_eq(image_create(64, 64, 3, &picture, NULL), LAM_OK);
    picture_legend(&scale, "W/m2", &picture);
    for (size_t i = 0; i < 64 * 64 * 3; i++) ck_assert_uint_eq(picture.pixels[i], 0);
    image_free(&picture);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("image");
    TCase *tests = tcase_create("image");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, test_round_trip, 0, 2);
    tcase_add_test(tests, test_full_disk_leaves_the_old_file);
    tcase_add_test(tests, test_no_folder);
    tcase_add_test(tests, test_sizes);
    tcase_add_test(tests, test_srgb);
    tcase_add_test(tests, test_curve);
    tcase_add_test(tests, test_color_keeps_its_hue);
    tcase_add_loop_test(tests, test_false_color_rises, 0, 2);
    tcase_add_test(tests, test_palettes);
    tcase_add_test(tests, test_scales);
    tcase_add_test(tests, test_exposure);
    tcase_add_test(tests, test_legend);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
