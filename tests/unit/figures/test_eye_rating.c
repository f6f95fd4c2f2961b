/* Ratings of an eye by hand, the luminaires that count for it, and the reasons why there is none. */
#include "solver/figures/eye_rating.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

/* Three luminaires as two eyes see them; the second eye is rated. 1,000 cd, .1 m^2 at 5 m and p = 2: each
 * adds 1e5 at dimmer 1. The third one has no opening. */
enum { LUMINAIRES = 3, EYES = 2 };
#define SAME {1000, .1F, 5, 2, 1}
#define OTHER {1, 1, 1, 1, 1}
static const float seen[LUMINAIRES][EYES][GLARE_NUMBERS] = {
    {OTHER, SAME}, {OTHER, SAME}, {OTHER, {10, 0, 5, 2, 1}}};

static eye_view view_of(const double *dimmer) {
    return (eye_view){LUMINAIRES, seen[0][1], EYES * GLARE_NUMBERS, dimmer};
}

START_TEST(rating_and_parts) {
    const double dimmer[LUMINAIRES] = {1, 2, 0};
    const eye_view v = view_of(dimmer);
    glare_part parts[LUMINAIRES];
    /* L_b = 40 cd/m2; the sum is 1e5 + 4e5. */
    const eye_rating r = eye_rate(&v, true, 40 * M_PI + 100, 100);
    ck_assert_int_eq(r.reason, UGR_RATED);
    ck_assert_double_eq_tol(r.background, 40, 1e-12);
    ck_assert_double_eq_tol(r.ugr, 8 * log10(.25 / 40 * 5e5), 1e-6); /* .1 is rounded to single precision */
    ck_assert_uint_eq(eye_parts(&v, parts), 2);
    ck_assert_uint_eq(parts[0].luminaire, 1);
    ck_assert_double_eq_tol(parts[0].part, .8, 1e-12);
    ck_assert_uint_eq(parts[1].luminaire, 0);
    ck_assert_double_eq_tol(parts[1].part, .2, 1e-12);
}
END_TEST

static void has_none(const eye_view *v, bool in_lux, double all, double direct, ugr_reason reason,
                     const char *words) {
    char text[EYE_REASON_TEXT];
    const eye_rating r = eye_rate(v, in_lux, all, direct);
    ck_assert_int_eq(r.reason, reason);
    ck_assert(isnan(r.ugr));
    ck_assert(isnan(r.background) == (reason == UGR_NO_LUX || reason == UGR_NO_VALUE));
    eye_reason_text(v, &r, "bulb", text);
    ck_assert_ptr_nonnull(strstr(text, words));
}

START_TEST(reasons) {
    const double dark[LUMINAIRES] = {0}, lit[LUMINAIRES] = {1, 1, 0}, bulb[LUMINAIRES] = {1, 0, 1};
    const eye_view none = view_of(dark), some = view_of(lit), forbidden = view_of(bulb);
    eye_view unknown = some, hidden = some;
    static const float behind[LUMINAIRES][GLARE_NUMBERS] = {{1000, .1F, 5, 0, 1}, {1000, .1F, 5, 2, 0}};
    unknown.seen = NULL;
    hidden.seen = behind[0];
    hidden.apart = GLARE_NUMBERS;
    has_none(&some, false, 200, 100, UGR_NO_LUX, "not in lx");
    has_none(&some, true, (double)NAN, 100, UGR_NO_VALUE, "in a wall");
    has_none(&none, true, 200, 0, UGR_NO_LUMINAIRE, "no luminaire of the store is lit");
    has_none(&unknown, true, 200, 100, UGR_NOT_SEEN, "precompute its sensors again");
    has_none(&forbidden, true, 200, 100, UGR_FORBIDDEN, "luminaire bulb has no luminous area");
    has_none(&hidden, true, 200, 100, UGR_NONE_COUNTS, "3e-4 sr");
    /* All light is of luminaires but for what single precision leaves. */
    has_none(&some, true, 200, 200 * (1 - 9e-6), UGR_NO_BACKGROUND, "no light comes to the eye but");
    const eye_rating rated = eye_rate(&some, true, 200, 200 * (1 - 1.1e-5));
    ck_assert_int_eq(rated.reason, UGR_RATED);
    /* 1,000 cd of 3 m^2 at 5 m fill .12 sr. */
    float near[LUMINAIRES][GLARE_NUMBERS] = {{1000, 3, 5, 2, 1}};
    const eye_view large = {LUMINAIRES, near[0], GLARE_NUMBERS, lit};
    has_none(&large, true, 200, 100, UGR_FORBIDDEN, "luminaire bulb fills 0.12 sr");
}
END_TEST

START_TEST(dimmers_are_of_luminance) {
    const float D[3 * 2] = {1, 2, 1, 0, 1, 0};
    const double colours[3 * 2] = {2, 1, 1, 1, 0, 1};
    double dimmer[2];
    eye_dimmers(3, 2, D, colours, dimmer);
    ck_assert_double_eq_tol(dimmer[0], .2126 * 2 + .7152, 1e-12);
    ck_assert_double_eq_tol(dimmer[1], .2126 * 2, 1e-12);
    eye_dimmers(1, 2, D, colours, dimmer);
    ck_assert_double_eq(dimmer[0], 2);
    ck_assert_double_eq(dimmer[1], 2);
    eye_dimmers(3, 2, NULL, colours, dimmer);
    ck_assert_double_eq(dimmer[0], 0);
    ck_assert_double_eq(dimmer[1], 0);
}
END_TEST

int main(void) {
    Suite *s = suite_create("eye_rating");
    TCase *c = tcase_create("all");
    tcase_add_test(c, rating_and_parts);
    tcase_add_test(c, reasons);
    tcase_add_test(c, dimmers_are_of_luminance);
    suite_add_tcase(s, c);
    return suite_run(s);
}
