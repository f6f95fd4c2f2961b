/* Weights, efficacies and units of light: the table of conversions, there and back. */
#include "solver/base/photometry.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

START_TEST(white_has_the_luminance_of_its_channels) {
    /* Both sets of weights sum to 1, to the last of their decimals. */
    ck_assert_double_eq_tol(luminance_of(3, 3, 3), 3, 1e-12);
    ck_assert_double_eq_tol(luminance_of_radiance(3, 3, 3), 3, 1e-12);
    ck_assert_double_eq_tol(luminance_of(1, 10, 100), .2126 + 7.152 + 7.22, 1e-12);
    ck_assert_double_eq_tol(luminance_of_radiance(1, 10, 100), .265 + 6.7 + 6.5, 1e-12);
}
END_TEST

static size_t split(const char *text, given_unit *unit) {
    return given_unit_split(text, strlen(text), unit);
}

START_TEST(units_of_given_light_are_found_behind_the_numbers) {
    static const struct {
        const char *text;
        given_unit unit;
        size_t length;
    } cases[] = {
        {"3600lm", GIVEN_LM, 4},      {"40 W", GIVEN_W, 2},
        {"500cd/m2", GIVEN_CD_M2, 3}, {"500cd/m\u00b2", GIVEN_CD_M2, 3},
        {"12W/m2", GIVEN_W_M2, 2},    {"17,12,4lm/m2", GIVEN_LM_M2, 7},
        {"12", GIVEN_PLAIN, 2},       {"1e3", GIVEN_PLAIN, 3},
        {"lm", GIVEN_PLAIN, 2},       {"5lx", GIVEN_PLAIN, 3},
        {"", GIVEN_PLAIN, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        given_unit unit;
        ck_assert_uint_eq(split(cases[k].text, &unit), cases[k].length);
        ck_assert_int_eq(unit, cases[k].unit);
    }
}
END_TEST

START_TEST(given_light_becomes_an_exitance) {
    /* M = flux / A, M = pi L, and 179 lm/W between the two kinds. */
    ck_assert_double_eq_tol(3600 * given_unit_exitance(GIVEN_LM, 1.44, LIGHT_PHOTOMETRIC), 2500, 1e-9);
    ck_assert_double_eq_tol(3580 * given_unit_exitance(GIVEN_LM, 2, LIGHT_RADIOMETRIC), 10, 1e-12);
    ck_assert_double_eq_tol(40 * given_unit_exitance(GIVEN_W, 4, LIGHT_RADIOMETRIC), 10, 1e-12);
    ck_assert_double_eq_tol(40 * given_unit_exitance(GIVEN_W, 4, LIGHT_PHOTOMETRIC), 1790, 1e-9);
    ck_assert_double_eq_tol(given_unit_exitance(GIVEN_CD_M2, 0, LIGHT_PHOTOMETRIC), M_PI, 1e-12);
    ck_assert_double_eq_tol(given_unit_exitance(GIVEN_CD_M2, 0, LIGHT_RADIOMETRIC), M_PI / 179, 1e-12);
    ck_assert_double_eq_tol(given_unit_exitance(GIVEN_W_M2, 0, LIGHT_PHOTOMETRIC), 179, 1e-12);
    ck_assert_double_eq(given_unit_exitance(GIVEN_LM_M2, 0, LIGHT_PHOTOMETRIC), 1);
    for (int kind = 0; kind < 2; kind++)
        ck_assert_double_eq(given_unit_exitance(GIVEN_PLAIN, 0, (light_kind)kind), 1);
}
END_TEST

/* An answer of 179 W/m2, or of as many lx. */
START_TEST(answers_are_told_in_the_unit_that_is_asked_for) {
    static const struct {
        light_kind from;
        answer_unit unit;
        double factor;
        const char *irradiance, *exitance, *year, *text;
    } cases[] = {
        {LIGHT_RADIOMETRIC, ANSWER_PLAIN, 1, "W/m2", "W/m2", "kWh/m2", ""},
        {LIGHT_RADIOMETRIC, ANSWER_W_M2, 1, "W/m2", "W/m2", "kWh/m2", ""},
        {LIGHT_RADIOMETRIC, ANSWER_LX, 179, "lx", "lm/m2", "klx h", "179 lm/W"},
        {LIGHT_RADIOMETRIC, ANSWER_KLX, .179, "klx", "klm/m2", "Mlx h", "179 lm/W; 1 klx = 1000 lx"},
        {LIGHT_RADIOMETRIC, ANSWER_FC, 179 * .09290304, "fc", "lm/ft2", "kfc h",
         "179 lm/W; 1 fc = 10.7639 lx"},
        {LIGHT_PHOTOMETRIC, ANSWER_PLAIN, 1, "lx", "lm/m2", "klx h", ""},
        {LIGHT_PHOTOMETRIC, ANSWER_LX, 1, "lx", "lm/m2", "klx h", ""},
        {LIGHT_PHOTOMETRIC, ANSWER_FC, .09290304, "fc", "lm/ft2", "kfc h", "1 fc = 10.7639 lx"},
        {LIGHT_PHOTOMETRIC, ANSWER_W_M2, 1 / 179., "W/m2", "W/m2", "kWh/m2", "179 lm/W"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        light_conversion c = {.factor = 0};
        char text[LIGHT_CONVERSION_TEXT];
        ck_assert(light_conversion_make(cases[k].from, cases[k].unit, 1, &c));
        ck_assert_double_eq_tol(c.factor, cases[k].factor, 1e-12 * cases[k].factor);
        ck_assert(!c.luminance);
        ck_assert_str_eq(light_conversion_unit(&c, false), cases[k].irradiance);
        ck_assert_str_eq(light_conversion_unit(&c, true), cases[k].exitance);
        ck_assert_str_eq(light_conversion_year(&c, false), cases[k].year);
        light_conversion_text(&c, text);
        ck_assert_str_eq(text, cases[k].text);
    }
}
END_TEST

START_TEST(three_channels_become_their_luminance) {
    light_conversion c = {.lights = true};
    char text[LIGHT_CONVERSION_TEXT];
    ck_assert(light_conversion_make(LIGHT_PHOTOMETRIC, ANSWER_FC, 3, &c) && c.luminance && c.lights);
    light_conversion_text(&c, text);
    ck_assert_str_eq(text, "179 lm/W; luminance 0.2126 R + 0.7152 G + 0.0722 B; 1 fc = 10.7639 lx");
    /* The longest text has room. */
    c.efficacies = true;
    ck_assert(light_conversion_make(LIGHT_RADIOMETRIC, ANSWER_KLX, 3, &c) && c.efficacies);
    light_conversion_text(&c, text);
    ck_assert_str_eq(text,
                     "luminous efficacies of Perez et al. 1990; 179 lm/W; luminance 0.2126 R + 0.7152 G + "
                     "0.0722 B; 1 klx = 1000 lx");
    c.efficacies = false;
    ck_assert(light_conversion_make(LIGHT_PHOTOMETRIC, ANSWER_PLAIN, 3, &c) && !c.luminance);
    ck_assert(light_conversion_make(LIGHT_PHOTOMETRIC, ANSWER_W_M2, 3, &c) && !c.luminance);
    ck_assert(light_conversion_make(LIGHT_RADIOMETRIC, ANSWER_W_M2, 5, &c));
    ck_assert(!light_conversion_make(LIGHT_RADIOMETRIC, ANSWER_LX, 5, &c));
}
END_TEST

START_TEST(words_are_found_and_others_are_not) {
    light_kind kind;
    answer_unit unit;
    ck_assert(light_kind_find("lm", &kind) && kind == LIGHT_PHOTOMETRIC);
    ck_assert(light_kind_find("W", &kind) && kind == LIGHT_RADIOMETRIC);
    ck_assert(!light_kind_find("w", &kind) && !light_kind_find("", &kind));
    ck_assert(answer_unit_find("klx!", 3, &unit) && unit == ANSWER_KLX);
    ck_assert(!answer_unit_find("lux", 3, &unit) && !answer_unit_find("", 0, &unit));
    ck_assert_double_eq_tol(light_kind_factor(LIGHT_RADIOMETRIC, LIGHT_PHOTOMETRIC) *
                                light_kind_factor(LIGHT_PHOTOMETRIC, LIGHT_RADIOMETRIC),
                            1, 1e-15);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("photometry");
    TCase *tests = tcase_create("photometry");
    tcase_add_test(tests, white_has_the_luminance_of_its_channels);
    tcase_add_test(tests, units_of_given_light_are_found_behind_the_numbers);
    tcase_add_test(tests, given_light_becomes_an_exitance);
    tcase_add_test(tests, answers_are_told_in_the_unit_that_is_asked_for);
    tcase_add_test(tests, three_channels_become_their_luminance);
    tcase_add_test(tests, words_are_found_and_others_are_not);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
