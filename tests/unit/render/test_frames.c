/* Elements behind pixels, which are found once, against pictures that find them anew; names of frames. */
#include "solver/render/picture.h"
#include "solver/render/video.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/suite.h"

/* The inside of a box with light that differs from element to element and from channel to channel. */
typedef struct scene {
    mesh m;
    visibility *v;
    smooth_nodes nodes;
    camera c;
    shade *light;
    raster_view view;
} scene;

enum { C = 3 };

static void open_scene(bool smooth, size_t width, size_t height, scene *s) {
    static const double size[3] = {1, 2, 1}, eye[3] = {.5, .3, .4}, target[3] = {.6, 2, .5};
    lam_error error = {0};
    *s = (scene){.m = box_mesh(size, 5, .5f)};
    float *values = test_allocate(C * s->m.n, sizeof *values);
    for (size_t k = 0; k < C * s->m.n; k++) values[k] = (float)(k * 7919 % 97) / 50;
    ck_assert_msg(visibility_create(&s->m, &s->v, &error) == LAM_OK, "%s", error.message);
    ck_assert_int_eq(smooth_nodes_create(&s->m, &s->nodes, &error), LAM_OK);
    ck_assert_int_eq(camera_look(eye, target, 100, (double)width / (double)height, 'z', &s->c, &error),
                     LAM_OK);
    ck_assert_int_eq(shade_create(&s->m, C, values, NULL, smooth ? &s->nodes : NULL, &s->light, &error),
                     LAM_OK);
    s->view = (raster_view){.mesh = &s->m,
                            .visibility = s->v,
                            .camera = &s->c,
                            .width = width,
                            .height = height,
                            .samples = RASTER_SAMPLES,
                            .smooth = smooth};
    free(values);
}

static void close_scene(scene *s) {
    shade_destroy(s->light);
    smooth_nodes_free(&s->nodes);
    visibility_destroy(s->v);
    mesh_free(&s->m);
}

START_TEST(test_found_once) {
    /* 70 x 45 pixels: tiles of 32 are cut at both edges. A legend of 8 columns stays black. */
    scene s;
    raster r;
    image one = {0}, other = {0};
    lam_error error = {0};
    const color_scale scale = {.palette = palette_find("viridis"), .high = 2};
    open_scene(_i != 0, 70, 45, &s);
    const picture_options styles[] = {
        {.exposure = 1.5},
        {.scale = scale},
        {.plain = true},
        {.scale = scale, .iso_lines = _i != 0 ? 5 : 0, .nodes = &s.nodes},
    };
    ck_assert_msg(raster_create(&s.view, NULL, &r, &error) == LAM_OK, "%s", error.message);
    for (size_t k = 0; k < sizeof styles / sizeof *styles; k++) {
        ck_assert_int_eq(image_create(78, 45, 3, &one, &error), LAM_OK);
        ck_assert_int_eq(image_create(78, 45, 3, &other, &error), LAM_OK);
        ck_assert_int_eq(picture_draw(&s.view, s.light, &styles[k], NULL, &one, &error), LAM_OK);
        ck_assert_int_eq(picture_fill(&r, s.light, &styles[k], &other, &error), LAM_OK);
        ck_assert_mem_eq(one.pixels, other.pixels, 78 * 45 * 3);
        ck_assert_uint_eq(one.pixels[3 * 75], 0);
        ck_assert_uint_ne(one.pixels[3 * 35], one.pixels[3 * (78 * 40 + 35)]);
        image_free(&one);
        image_free(&other);
    }
    raster_free(&r);
    close_scene(&s);
}
END_TEST

/* A square floor of 10 x 10 tiles, seen from above by a camera whose picture it fills, of two groups: light
 * is x in one and 1 - x in the other, beyond y = .5. */
static void open_floor(scene *s, float *values) {
    static const double eye[3] = {.5, .5, 1}, target[3] = {.5, .5, 0};
    lam_error error = {0};
    *s = (scene){.m = {0}};
    for (int i = 0; i < 100; i++) {
        const double x = i % 10 / 10., y = i / 10 / 10.;
        const double corners[4][3] = {{x, y, 0}, {x + .1, y, 0}, {x + .1, y + .1, 0}, {x, y + .1, 0}};
        mesh_add_quad(&s->m, corners);
    }
    mesh_finish(&s->m, .5f);
    for (int i = 0; i < 100; i++) {
        s->m.group[i] = i >= 50;
        values[i] = (float)(i >= 50 ? .95 - i % 10 / 10. : .05 + i % 10 / 10.);
    }
    ck_assert_msg(visibility_create(&s->m, &s->v, &error) == LAM_OK, "%s", error.message);
    ck_assert_int_eq(smooth_nodes_create(&s->m, &s->nodes, &error), LAM_OK);
    ck_assert_int_eq(camera_look(eye, target, 2 * atan(.5) * 180 / M_PI, 1, 'z', &s->c, &error), LAM_OK);
    ck_assert_int_eq(shade_create(&s->m, 1, values, NULL, &s->nodes, &s->light, &error), LAM_OK);
    s->view = (raster_view){.mesh = &s->m,
                            .visibility = s->v,
                            .camera = &s->c,
                            .width = 200,
                            .height = 200,
                            .samples = RASTER_SAMPLES,
                            .smooth = true};
}

START_TEST(test_iso_lines) {
    /* Lines at a quarter, half and three quarters of the width and at an end, at both groups; none along
     * their border, though light jumps there. A pixel of 200 is darker or brighter by ink alone: beside it
     * the colour is that of the picture without lines. */
    scene s;
    float values[100];
    image plain, lines;
    open_floor(&s, values);
    picture_options how = {.scale = {.palette = palette_find("turbo"), .high = 1}};
    ck_assert_int_eq(image_create(200, 200, 3, &plain, NULL), LAM_OK);
    ck_assert_int_eq(image_create(200, 200, 3, &lines, NULL), LAM_OK);
    ck_assert_int_eq(picture_draw(&s.view, s.light, &how, NULL, &plain, NULL), LAM_OK);
    how.iso_lines = 4;
    how.nodes = &s.nodes;
    ck_assert_int_eq(picture_draw(&s.view, s.light, &how, NULL, &lines, NULL), LAM_OK);
    for (size_t y = 0; y < 200; y++)
        for (size_t x = 0; x < 200; x++) {
            const size_t from_line = (x + 25) % 50; /* a line is between the columns 49 and 0 */
            const bool differs =
                memcmp(plain.pixels + 3 * (200 * y + x), lines.pixels + 3 * (200 * y + x), 3);
            const bool inside = x >= 25 && x < 175;
            if (inside && (from_line == 24 || from_line == 25))
                ck_assert_msg(differs, "no line at %zu, %zu", x, y);
            if (from_line < 22 || from_line > 27) ck_assert_msg(!differs, "a line at %zu, %zu", x, y);
        }
    image_free(&plain);
    image_free(&lines);
    close_scene(&s);
}
END_TEST

START_TEST(test_values) {
    /* The values of a pixel are the mean of its rays, which for light that is linear over the floor is its
     * value at the middle: x of half a pixel, .0025 exact in 16 rays at equal distances, to single precision.
     */
    scene s;
    float values[100];
    raster r;
    picture_values one, other;
    open_floor(&s, values);
    ck_assert_int_eq(picture_values_create(200, 200, 1, &one, NULL), LAM_OK);
    ck_assert_int_eq(picture_values_create(200, 200, 1, &other, NULL), LAM_OK);
    ck_assert_int_eq(picture_values_draw(&s.view, s.light, NULL, &one, NULL), LAM_OK);
    ck_assert_int_eq(raster_create(&s.view, NULL, &r, NULL), LAM_OK);
    picture_values_fill(&r, s.light, &other);
    ck_assert_mem_eq(one.values, other.values, 200 * 200 * sizeof(float));
    for (size_t y = 0; y < 200; y++)
        for (size_t x = 0; x < 200; x++) {
            const double place = ((double)x + .5) / 200, expected = y < 100 ? 1 - place : place;
            ck_assert_double_eq_tol((double)one.values[200 * y + x], expected, 2e-5);
        }
    raster_free(&r);
    picture_values_free(&one);
    picture_values_free(&other);
    close_scene(&s);
}
END_TEST

START_TEST(test_parts) {
    /* From within a closed box every ray meets an element. Each pixel has all of its rays, and the weights of
     * a part give back its middle, which lies in the pixel: 1e-6 of single precision, half a pixel of .02 m.
     */
    scene s;
    raster r;
    size_t pixels = 0, most = 0;
    open_scene(true, 70, 45, &s);
    ck_assert_int_eq(raster_create(&s.view, NULL, &r, NULL), LAM_OK);
    for (size_t t = 0; t < r.n_tiles; t++) {
        const raster_tile *tile = &r.tiles[t];
        const uint32_t *from = tile->from;
        for (size_t y = tile->top; y < tile->bottom; y++)
            for (size_t x = tile->left; x < tile->right; x++, from++, pixels++) {
                uint32_t rays = 0;
                if (from[1] - from[0] > most) most = from[1] - from[0];
                for (uint32_t p = from[0]; p < from[1]; p++) {
                    const uint32_t element = tile->parts[p].element;
                    double at[3] = {0}, sum = 0, direction[3], along = 0, square = 0, apart = 0;
                    ck_assert_uint_ne(element, VISIBILITY_NOTHING);
                    rays += tile->parts[p].rays;
                    for (size_t k = 0; k < 4; k++) {
                        sum += (double)tile->weights[p][k];
                        for (int d = 0; d < 3; d++)
                            at[d] += (double)tile->weights[p][k] * s.m.vertices[s.m.elements[element][k]][d];
                    }
                    ck_assert_double_eq_tol(sum, 1, 1e-6);
                    camera_direction(&s.c, ((double)x + .5) / 70, ((double)y + .5) / 45, direction);
                    for (int d = 0; d < 3; d++) {
                        along += (at[d] - s.c.eye[d]) * direction[d];
                        square += direction[d] * direction[d];
                    }
                    /* The distance to the ray of the pixel's centre, in pixels at that distance. */
                    for (int d = 0; d < 3; d++) {
                        const double off = at[d] - s.c.eye[d] - along / square * direction[d];
                        apart += off * off;
                    }
                    ck_assert_double_lt(sqrt(apart), 1.5 * along / square * 2 * s.c.tan_y / 45);
                }
                ck_assert_uint_eq(rays, RASTER_SAMPLES);
            }
    }
    ck_assert_uint_eq(pixels, 70 * 45);
    ck_assert_uint_gt(most, 2); /* at corners */
    raster_free(&r);
    close_scene(&s);
}
END_TEST

START_TEST(test_exposure_of_a_sequence) {
    /* The light of two pictures is that of one after the other; what glows does not count unless it is alone.
     */
    scene s;
    raster r;
    picture_light *sum = test_allocate(2, sizeof *sum);
    open_scene(false, 70, 45, &s);
    bool *glows = test_allocate(s.m.n, sizeof *glows);
    const raster_view coarse = picture_coarse(&s.view);
    ck_assert_uint_eq(coarse.samples, 1);
    ck_assert_uint_eq(coarse.width, 192);
    ck_assert_int_eq(raster_create(&coarse, NULL, &r, NULL), LAM_OK);
    for (size_t i = 0; i < s.m.n; i++) glows[i] = i % 2;
    picture_measure(&r, s.light, glows, &sum[0]);
    ck_assert_uint_eq(sum[0].all.total, coarse.width * coarse.height);
    ck_assert_uint_lt(sum[0].reflected.total, sum[0].all.total);
    ck_assert_ptr_eq(picture_light_shown(&sum[0]), &sum[0].reflected);
    picture_light_add(&sum[1], &sum[0]);
    picture_light_add(&sum[1], &sum[0]);
    ck_assert_uint_eq(sum[1].reflected.total, 2 * sum[0].reflected.total);
    ck_assert_double_eq(tone_exposure(picture_light_shown(&sum[1])), tone_exposure(&sum[0].reflected));
    sum[0] = (picture_light){{{0}, 0}, {{0}, 0}};
    for (size_t i = 0; i < s.m.n; i++) glows[i] = true;
    picture_measure(&r, s.light, glows, &sum[0]);
    ck_assert_ptr_eq(picture_light_shown(&sum[0]), &sum[0].all);
    free(sum);
    free(glows);
    raster_free(&r);
    close_scene(&s);
}
END_TEST

START_TEST(test_names) {
    static const struct {
        const char *path;
        size_t n, k;
        const char *name;
    } cases[] = {{"a.png", 3, 1, "a-0001.png"},         {"a.b/c.mp4", 9999, 9999, "a.b/c-9999.png"},
                 {"a.png", 10000, 7, "a-00007.png"},    {"x.y.webm", 2, 2, "x.y-0002.png"},
                 {"100%d.gif", 2, 2, "100%d-0002.png"}, {"folder.d/plain", 2, 2, "folder.d/plain-0002.png"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const frame_names names = frame_names_of(cases[i].path, cases[i].n);
        char *name = NULL;
        ck_assert_int_eq(frame_name(&names, cases[i].k, &name, NULL), LAM_OK);
        ck_assert_str_eq(name, cases[i].name);
        free(name);
    }
    ck_assert(video_is_named("a.mp4") && video_is_named("a.WEBM") && video_is_named("a.b.gif"));
    ck_assert(!video_is_named("a.png") && !video_is_named("mp4") && !video_is_named("a.mp4/b"));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("frames");
    TCase *tests = tcase_create("frames");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, test_found_once, 0, 2);
    tcase_add_test(tests, test_iso_lines);
    tcase_add_test(tests, test_values);
    tcase_add_test(tests, test_parts);
    tcase_add_test(tests, test_exposure_of_a_sequence);
    tcase_add_test(tests, test_names);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
