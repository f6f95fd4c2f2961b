/* The headline and its words: parts whose squares add up, and the option that lowers the largest. */
#include "solver/codec/headline.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

static void told(const headline *h, const char *json, const char *text) {
    char said[HEADLINE_BYTES];
    buffer b = {0};
    ck_assert(headline_write(&b, h));
    ck_assert_str_eq(b.bytes, json);
    buffer_free(&b);
    if (text == NULL) return;
    headline_text(h, said);
    ck_assert_str_eq(said, text);
}

START_TEST(squares_add_up) {
    const headline h = {.known = true, .parts = {.rest = .05, .mesh = 0}, .share = 0};
    told(&h, "\"stated\":0.05,\"parts\":{\"operator\":0,\"form_factors\":0.05,\"mesh\":0}",
         "0.05, most of it by the form factors");
    const headline split = {.known = true, .parts = {.rest = .05, .mesh = -1}, .share = .36};
    headline_part parts[HEADLINE_PARTS];
    size_t largest;
    ck_assert_uint_eq(headline_parts(&split, parts, &largest), 2);
    ck_assert_double_eq_tol(parts[0].error, .03, 1e-12);
    ck_assert_double_eq_tol(parts[1].error, .04, 1e-12);
    ck_assert_uint_eq(largest, 1);
    const headline with = {.known = true, .parts = {.rest = .03, .mesh = .04}, .share = 0};
    ck_assert_double_eq_tol(headline_stated(&with), .05, 1e-12);
}
END_TEST

START_TEST(coarse_has_an_option) {
    headline h = {.known = true, .parts = {.rest = .3, .mesh = .4}, .share = 1};
    told(&h,
         "\"stated\":0.5,\"coarse\":true,\"advice\":\"precompute with --mesh-error "
         ".05\",\"parts\":{\"operator\":0.3,"
         "\"form_factors\":0,\"mesh\":0.4}",
         "0.5, most of it by the mesh: coarse; precompute with --mesh-error .05");
    h.parts.mesh = -1; /* not measured */
    told(
        &h,
        "\"stated\":0.3,\"coarse\":true,\"advice\":\"precompute with --epsilon\",\"parts\":{\"operator\":0.3,"
        "\"form_factors\":0}",
        NULL);
    h.share = -1;
    told(&h,
         "\"stated\":0.3,\"coarse\":true,\"advice\":\"precompute with --paths\",\"parts\":{\"walks\":0.3}",
         NULL);
    h.parts.rest = .1; /* not above a tenth */
    ck_assert(!headline_is_coarse(&h));
    h = (headline){.known = true, .parts = {.rest = INFINITY, .mesh = 0}, .share = .5}; /* no light */
    told(&h, "\"stated\":null,\"parts\":{\"operator\":null,\"form_factors\":null,\"mesh\":0}", NULL);
    ck_assert(!headline_has_light(&h.parts));
}
END_TEST

START_TEST(unknown_says_what_to_do) {
    const headline h = {.advice = "measure it"};
    told(&h, "\"stated\":null,\"advice\":\"measure it\"", NULL);
}
END_TEST

START_TEST(the_larger_is_kept) {
    headline h = {.known = true, .parts = {.rest = 0, .mesh = -1}};
    headline_raise(&h, &(stated_parts){.rest = .3, .mesh = .1});
    headline_raise(&h, &(stated_parts){.rest = .1, .mesh = .2});
    ck_assert(h.parts.rest == .3 && h.parts.mesh == .1);
    headline_raise(&h, &(stated_parts){.rest = NAN, .mesh = .2});
    headline_raise(&h, &(stated_parts){.rest = INFINITY, .mesh = .2});
    ck_assert(!isfinite(headline_stated(&h)));
}
END_TEST

/* The sun of a year is a part of its own, which solve lowers. */
START_TEST(sun) {
    headline h = {.known = true, .parts = {.rest = .03, .mesh = .04, .sun = .12}, .share = 1};
    headline_part parts[HEADLINE_PARTS];
    size_t largest = 0;
    char text[HEADLINE_BYTES];
    ck_assert_uint_eq(headline_parts(&h, parts, &largest), 4);
    ck_assert_str_eq(parts[largest].name, "sun");
    ck_assert_double_eq_tol(headline_stated(&h), .13, 1e-12);
    headline_text(&h, text);
    ck_assert_str_eq(text, "0.13, most of it by the sun: coarse; solve with --sun exact --sun-points 64");
    h.parts.sun = 0;
    ck_assert_uint_eq(headline_parts(&h, parts, &largest), 3);
}
END_TEST

int main(void) {
    Suite *s = suite_create("headline");
    TCase *c = tcase_create("headline");
    tcase_add_test(c, squares_add_up);
    tcase_add_test(c, coarse_has_an_option);
    tcase_add_test(c, unknown_says_what_to_do);
    tcase_add_test(c, the_larger_is_kept);
    tcase_add_test(c, sun);
    suite_add_tcase(s, c);
    return suite_run(s);
}
