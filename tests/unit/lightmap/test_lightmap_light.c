/* Texels that are filled, and the light of a furnace, whose rows sum to 1. */
#include "solver/lightmap/lightmap_light.h"
#include "support/box.h"
#include "support/suite.h"

enum { WIDTH = 10, HEIGHT = 9, CHANNELS = 2 };

/* One chart of 6 x 5 texels in the middle of a map. */
static lightmap_charts one_chart(lightmap_chart *chart) {
    *chart = (lightmap_chart){.width = 6, .height = 5, .x = 2, .y = 2};
    return (lightmap_charts){.n = 1, .width = WIDTH, .height = HEIGHT, .charts = chart};
}

START_TEST(empty_texels_get_the_mean_of_neighbours) {
    lam_error error = {0};
    lightmap_chart chart;
    const lightmap_charts c = one_chart(&chart);
    float values[WIDTH * HEIGHT * CHANNELS] = {0};
    uint8_t state[WIDTH * HEIGHT] = {LIGHTMAP_EMPTY};
    lightmap map = {.width = WIDTH, .height = HEIGHT, .n_channels = CHANNELS, .values = values};
    /* Two lit texels side by side: 3 and 5 of channel 0, 7 of channel 1. */
    for (size_t k = 0; k < 2; k++) {
        const size_t pixel = 4 * WIDTH + 4 + k;
        state[pixel] = LIGHTMAP_LIT;
        values[CHANNELS * pixel] = 3 + 2 * (float)k;
        values[CHANNELS * pixel + 1] = 7;
    }
    ck_ok(lightmap_fill(&c, state, &map, &error));
    for (size_t k = 0; k < WIDTH * HEIGHT; k++) {
        ck_assert_int_eq(state[k], LIGHTMAP_LIT);
        ck_assert(values[CHANNELS * k] >= 3 && values[CHANNELS * k] <= 5 && values[CHANNELS * k + 1] == 7);
    }
    /* The first layer: a neighbour of both has their mean, and of one its value. */
    ck_assert(values[CHANNELS * (3 * WIDTH + 4)] == 4 && values[CHANNELS * (4 * WIDTH + 3)] == 3);
}
END_TEST

START_TEST(dark_texels_stay_dark_but_beside_lit_ones) {
    lam_error error = {0};
    lightmap_chart chart;
    const lightmap_charts c = one_chart(&chart);
    float values[WIDTH * HEIGHT * CHANNELS] = {0};
    uint8_t state[WIDTH * HEIGHT] = {LIGHTMAP_EMPTY};
    lightmap map = {.width = WIDTH, .height = HEIGHT, .n_channels = CHANNELS, .values = values};
    for (size_t y = 2; y < 7; y++)
        for (size_t x = 2; x < 8; x++) {
            state[y * WIDTH + x] = x < 4 ? LIGHTMAP_LIT : LIGHTMAP_DARK;
            if (x < 4) values[CHANNELS * (y * WIDTH + x)] = 1;
        }
    ck_ok(lightmap_fill(&c, state, &map, &error));
    for (size_t x = 0; x < WIDTH; x++) {
        const float value = values[CHANNELS * (4 * WIDTH + x)];
        ck_assert(x < 6 ? value == 1 : value == 0);
    }
    /* Without any lit texel nothing is known. */
    for (size_t k = 0; k < WIDTH * HEIGHT; k++) state[k] = LIGHTMAP_DARK;
    memset(values, 0, sizeof values);
    ck_ok(lightmap_fill(&c, state, &map, &error));
    for (size_t k = 0; k < WIDTH * HEIGHT; k++) ck_assert(values[CHANNELS * k] == 0);
}
END_TEST

/* B = 3 of all elements of a closed box: each texel receives 3, and of E 2 and rho 1/2 has the radiosity 3.5.
 */
START_TEST(a_furnace_is_one_value) {
    const double size[3] = {4, 3, 2};
    lam_error error = {0};
    lightmap_charts c = {.n = 0};
    lightmap_texels t = {.n = 0};
    mesh m = box_mesh(size, 3, .5f);
    ck_ok(lightmap_charts_make(&m, .5, &c, &error));
    ck_ok(lightmap_texels_find(&m, &c, &t, &error));
    float *B = calloc(m.n, sizeof *B), *E = calloc(m.n, sizeof *E);
    ck_assert(B != NULL && E != NULL);
    for (size_t i = 0; i < m.n; i++) {
        B[i] = 3;
        E[i] = 2;
    }
    for (int radiosity = 0; radiosity < 2; radiosity++) {
        const lightmap_light light = {
            .n_channels = 1, .B = B, .E = E, .radiosity = radiosity == 1, .seed = 5};
        const double wanted = radiosity ? 3.5 : 3;
        lightmap map = {.values = NULL};
        ck_ok(lightmap_make(&m, &c, &t, &light, NULL, &map, &error));
        ck_assert_uint_eq(map.hidden, 0);
        ck_assert_double_eq_tol(map.mean, wanted, 1e-4);
        /* Sums of some hundred weights in single precision. */
        for (size_t k = 0; k < t.n; k++)
            ck_assert_double_eq_tol((double)map.values[t.texels[k].pixel], wanted, 1e-4);
        lightmap_free(&map);
    }
    free(B);
    free(E);
    free(t.texels);
    lightmap_charts_free(&c);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("light of lightmaps");
    TCase *c = tcase_create("all");
    tcase_add_test(c, empty_texels_get_the_mean_of_neighbours);
    tcase_add_test(c, dark_texels_stay_dark_but_beside_lit_ones);
    tcase_add_test(c, a_furnace_is_one_value);
    suite_add_tcase(s, c);
    return suite_run_together(s);
}
