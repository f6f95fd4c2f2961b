/* Intensities and flux of files whose light is a formula, of each version, symmetry and type. */
#include "solver/base/file_text.h"
#include "solver/luminaire/luminaire.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

static double radians(double degrees) {
    return degrees * M_PI / 180;
}

static double below(double g) {
    return fmax(0, cos(g));
}

static double cosine(double C, double g) {
    (void)C;
    return 1000 * below(g);
}

static double cosine4(double C, double g) {
    (void)C;
    return 2000 * pow(below(g), 4);
}

static double isotropic(double C, double g) {
    (void)C;
    (void)g;
    return 10000 / (4 * M_PI);
}

static double asymmetric(double C, double g) {
    return (800 * (1 + .5 * sin(g) * cos(C) + .3 * sin(g) * sin(C)) + 200 * below(g)) * below(g);
}

static double about_C0(double C, double g) {
    return 800 * (1 + .5 * sin(g) * cos(C)) * below(g);
}

static double about_C90(double C, double g) {
    return 800 * (1 + .5 * sin(g) * sin(C)) * below(g);
}

static double quadrant(double C, double g) {
    return 800 * (1 + .5 * sin(g) * sin(g) * cos(2 * C)) * below(g);
}

static double uplight(double C, double g) {
    (void)C;
    return 1000 * fmax(0, -cos(g));
}

static double type_b(double C, double g) {
    const double V = atan2(sin(g) * cos(C), cos(g)), H = asin(sin(g) * sin(C));
    return fabs(V) > M_PI / 2 ? 0 : 1000 * pow(cos(V), 2) * pow(cos(H), 3);
}

typedef struct formula_row {
    const char *file;
    double (*intensity)(double C, double g);
    double lumens;             /* the integral of the formula */
    double gamma_step, C_step; /* the largest of the table, degrees; 0: one plane */
} formula_row;

/* 800 + 400 sin cos C: the second has no mean. 1 + .5 sin^2 cos 2C neither. */
static const formula_row rows[] = {
    {"lambertian-1000cd.ies", cosine, 1000 * M_PI, 1, 0},
    {"lambertian-1000cd-1x1m.ies", cosine, 1000 * M_PI, 1, 0},
    {"commas.ies", cosine, 1000 * M_PI, 5, 0},
    {"latin1-keywords.ies", cosine, 1000 * M_PI, 5, 0},
    {"bom-cr-only.ies", cosine, 1000 * M_PI, 1, 0},
    {"uneven-steps.ies", cosine, 1000 * M_PI, 18, 0},
    {"tilt-include.ies", cosine, 1000 * M_PI, 5, 0},
    {"isym1-mc1.ldt", cosine, 1000 * M_PI, 2.5, 0},
    {"isym1-mc24.ldt", cosine, 1000 * M_PI, 2.5, 0},
    {"absolute-minus-1.ldt", cosine, 1000 * M_PI, 2.5, 0},
    {"two-lamp-sets.ldt", cosine, 1000 * M_PI, 2.5, 0},
    {"conversion-factor.ldt", cosine, 1000 * M_PI, 2.5, 0},
    {"decimal-commas.ldt", cosine, 1000 * M_PI, 2.5, 0},
    {"round-opening.ldt", cosine, 1000 * M_PI, 2.5, 0},
    {"isotropic-10000lm.ies", isotropic, 10000, 10, 0},
    {"cos4-1986.ies", cosine4, 800 * M_PI, 1, 0},
    {"cos4-1991.ies", cosine4, 800 * M_PI, 1, 0},
    {"cos4-1995.ies", cosine4, 800 * M_PI, 1, 0},
    {"cos4-2019.ies", cosine4, 800 * M_PI, 1, 0},
    {"asymmetric-0-360.ies", asymmetric, (800 + 400. / 3) * M_PI, 1, 10},
    {"asymmetric-0-350.ies", asymmetric, (800 + 400. / 3) * M_PI, 1, 10},
    {"isym0.ldt", asymmetric, (800 + 400. / 3) * M_PI, 2.5, 15},
    {"bilateral-0-180.ies", about_C0, 800 * M_PI, 1, 10},
    {"isym2.ldt", about_C0, 800 * M_PI, 2.5, 10},
    {"bilateral-90-270.ies", about_C90, 800 * M_PI, 1, 10},
    {"isym3.ldt", about_C90, 800 * M_PI, 2.5, 10},
    {"quadrant-0-90.ies", quadrant, 800 * M_PI, 1, 10},
    {"isym4.ldt", quadrant, 800 * M_PI, 2.5, 5},
    {"uneven-planes.ldt", quadrant, 800 * M_PI, 2.5, 45},
    {"uplight-90-180.ies", uplight, 1000 * M_PI, 2.5, 0},
    {"type-b.ies", type_b, 1000 * (M_PI / 2) * (3 * M_PI / 8), 5, 5},
    {"type-b-quarter.ies", type_b, 1000 * (M_PI / 2) * (3 * M_PI / 8), 5, 5},
};
enum { ROWS = sizeof rows / sizeof *rows };

static luminaire must_read(const char *file) {
    char path[512], *text = NULL;
    size_t length = 0;
    lam_error error = {0};
    luminaire l = {0};
    const luminaire_options options = {.set = 0};
    snprintf(path, sizeof path, FIXTURES "/luminaires/made/%s", file);
    ck_ok(file_text(path, &text, &length, &error));
    ck_ok(luminaire_read_text(path, text, length, &options, &l, &error));
    free(text);
    return l;
}

/* A linear interpolation is off by at most step^2 / 8 of the second derivative, in each of the angles; those
 * of the formulas are below 4 times their peak. At the places of the table 7 digits are printed. */
START_TEST(intensities) {
    const formula_row *row = &rows[_i];
    luminaire l = must_read(row->file);
    double C, gamma;
    const double peak = luminaire_peak(&l, &C, &gamma);
    const double between =
        4 * peak * (pow(radians(row->gamma_step), 2) + pow(radians(row->C_step), 2)) / 8 + 1e-6 * peak;
    for (C = -360; C <= 720; C += 7.3)
        for (gamma = 0; gamma <= 180; gamma += 1.7) {
            const double got = luminaire_candela(&l, C, gamma),
                         wanted = row->intensity(radians(C), radians(gamma));
            ck_assert_msg(fabs(got - wanted) <= between, "%s: C %g gamma %g: %g instead of %g", row->file, C,
                          gamma, got, wanted);
        }
    for (size_t p = 0; p < l.n_planes && l.type == LUMINAIRE_C; p++)
        for (size_t a = 0; a < l.n_angles; a++) {
            const double got = luminaire_candela(&l, l.planes[p], l.angles[a]),
                         wanted = row->intensity(radians(l.planes[p]), radians(l.angles[a]));
            ck_assert_msg(fabs(got - wanted) <= 1e-6 * peak, "%s: C %g gamma %g: %g instead of %g", row->file,
                          l.planes[p], l.angles[a], got, wanted);
        }
    luminaire_free(&l);
}
END_TEST

/* The flux of the linear function is off by at most step^2 / 12 of the mean of |second derivative|, which is
 * up to 6.4 times the mean of the intensity: of cos^4, the integral of |12 c^2 - 16 c^4| over that of c^4. */
START_TEST(flux) {
    const formula_row *row = &rows[_i];
    luminaire l = must_read(row->file);
    double C, gamma, sum = 0;
    const double off = (pow(radians(row->gamma_step), 2) + pow(radians(row->C_step), 2)) / 12,
                 lumens = luminaire_lumens(&l);
    ck_assert_msg(fabs(lumens / row->lumens - 1) <= 7 * off + 1e-6, "%s: %.10g lm instead of %.10g",
                  row->file, lumens, row->lumens);
    /* The same by midpoints of half a degree, whose error is step^2 / 24 of the second derivative. */
    for (gamma = .25; gamma < 180; gamma += .5)
        for (C = .25; C < 360; C += .5)
            sum += luminaire_candela(&l, C, gamma) * (cos(radians(gamma - .25)) - cos(radians(gamma + .25))) *
                   radians(.5);
    ck_assert_msg(fabs(sum / lumens - 1) < 1e-4, "%s: %.10g lm, midpoints find %.10g", row->file, lumens,
                  sum);
    luminaire_free(&l);
}
END_TEST

START_TEST(versions_of_one_luminaire) {
    static const char *const files[] = {"cos4-1986.ies", "cos4-1991.ies", "cos4-1995.ies", "cos4-2019.ies"};
    static const luminaire_format formats[] = {LM63_1986, LM63_1991, LM63_1995, LM63_2019};
    luminaire first = must_read(files[0]);
    for (int k = 0; k < 4; k++) {
        luminaire l = must_read(files[k]);
        ck_assert_int_eq(l.format, formats[k]);
        ck_assert_int_eq(l.opening.shape, OPENING_DISC);
        for (int d = 0; d < 3; d++) ck_assert_double_eq_tol(l.opening.size[d], d < 2 ? .1524 : 0, 1e-12);
        for (double gamma = 0; gamma <= 90; gamma += .9)
            ck_assert_double_eq_tol(luminaire_candela(&l, 10, gamma), luminaire_candela(&first, 10, gamma),
                                    2e-3);
        ck_assert_double_eq_tol(luminaire_lumens(&l) / luminaire_lumens(&first), 1, 1e-6);
        luminaire_free(&l);
    }
    luminaire_free(&first);
}
END_TEST

START_TEST(directions_of_the_peak) {
    luminaire l = must_read("bilateral-90-270.ies");
    double C, gamma, peak = luminaire_peak(&l, &C, &gamma);
    ck_assert_double_eq(C, 90);
    ck_assert_double_eq(peak, luminaire_candela(&l, C, gamma));
    luminaire_free(&l);
    l = must_read("isym3.ldt");
    peak = luminaire_peak(&l, &C, &gamma);
    ck_assert_double_eq(C, 90);
    ck_assert_double_eq(peak, luminaire_candela(&l, C, gamma));
    luminaire_free(&l);
    l = must_read("type-b.ies");
    peak = luminaire_peak(&l, &C, &gamma);
    ck_assert_double_eq(gamma, 0);
    ck_assert_double_eq_tol(peak, 1000, 1e-9);
    luminaire_free(&l);
    /* A number that is no direction has no light. */
    l = must_read("isotropic-10000lm.ies");
    ck_assert_double_eq(luminaire_candela(&l, 0, 180), l.candela[0]);
    ck_assert_double_eq(luminaire_candela(&l, 0, 180.1), 0);
    ck_assert_double_eq(luminaire_candela(&l, 0, -1), 0);
    ck_assert_double_eq(luminaire_candela(&l, 0, NAN), 0);
    ck_assert_double_eq(luminaire_candela(&l, INFINITY, 0), 0);
    luminaire_free(&l);
}
END_TEST

/* Type A is type B turned by 90 degrees about the axis, with its angles exchanged. */
START_TEST(type_a) {
    static const char text[] =
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 3 %d 2 0 0 0\n1 1 1\n-60 0 60\n-30 0 30\n"
        "1 2 3 4 9 6 7 8 5\n";
    char file[256];
    lam_error error = {0};
    luminaire a = {0}, b = {0};
    const luminaire_options options = {.set = 0};
    snprintf(file, sizeof file, text, 3);
    ck_ok(luminaire_read_text("a.ies", file, strlen(file), &options, &a, &error));
    snprintf(file, sizeof file, text, 2);
    ck_ok(luminaire_read_text("b.ies", file, strlen(file), &options, &b, &error));
    ck_assert_int_eq(a.type, LUMINAIRE_A);
    ck_assert_int_eq(b.type, LUMINAIRE_B);
    /* H = 30, V = 0 is towards C90 in both, V = 60, H = 0 towards C0; values stand by H, then V. */
    for (int k = 0; k < 2; k++) {
        const luminaire *l = k == 0 ? &a : &b;
        ck_assert_double_eq_tol(luminaire_candela(l, 0, 0), 9, 1e-9);
        ck_assert_double_eq_tol(luminaire_candela(l, 90, 30), 8, 1e-9);
        ck_assert_double_eq_tol(luminaire_candela(l, 270, 30), 2, 1e-9);
        ck_assert_double_eq_tol(luminaire_candela(l, 0, 60), 6, 1e-9);
        ck_assert_double_eq_tol(luminaire_candela(l, 180, 60), 4, 1e-9);
        ck_assert_double_eq(luminaire_candela(l, 90, 31), 0);
        ck_assert_double_eq(luminaire_candela(l, 0, 61), 0);
        ck_assert_double_eq(luminaire_candela(l, 0, 120), 0);
        double sum = 0;
        for (double g = .25; g < 90; g += .5)
            for (double C = .25; C < 360; C += .5)
                sum += luminaire_candela(l, C, g) * (cos(radians(g - .25)) - cos(radians(g + .25))) *
                       radians(.5);
        /* The border of the table, where light ends at once, is .5 degrees of 4 in 60 sides. */
        ck_assert_double_eq_tol(luminaire_lumens(l) / sum, 1, 5e-3);
    }
    /* A corner: tan H = tan g sin C, sin V = sin g cos C of type A; tan V, sin H of type B. */
    const double H = radians(30), V = radians(60);
    double x = sin(V), y = sin(H) * cos(V), down = cos(H) * cos(V);
    ck_assert_double_eq_tol(luminaire_candela(&a, atan2(y, x) / radians(1), acos(down) / radians(1)), 5,
                            1e-9);
    x = sin(V) * cos(H), y = sin(H), down = cos(V) * cos(H);
    ck_assert_double_eq_tol(luminaire_candela(&b, atan2(y, x) / radians(1), acos(down) / radians(1)), 5,
                            1e-9);
    luminaire_free(&a);
    luminaire_free(&b);
}
END_TEST

/* The parent of the reading process takes nothing that is not sound. */
START_TEST(unsound_luminaires_are_known) {
    luminaire l = must_read("isym4.ldt");
    ck_assert(luminaire_is_sound(&l));
    double *const numbers[] = {&l.candela[5],     &l.planes[3], &l.angles[3],     &l.opening.size[1],
                               &l.sets[0].number, &l.planes[0], &l.opening.width, &l.opening.side[3]};
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
        const double kept = *numbers[k];
        *numbers[k] = NAN;
        ck_assert_msg(!luminaire_is_sound(&l), "%zu", k);
        *numbers[k] = 1e30;
        ck_assert_msg(!luminaire_is_sound(&l), "%zu", k);
        *numbers[k] = kept;
    }
    l.candela[7] = -1;
    ck_assert(!luminaire_is_sound(&l));
    l.candela[7] = 0;
    l.words[1].text[0] = '\x80';
    ck_assert(!luminaire_is_sound(&l));
    memset(l.words[1].text, 'x', sizeof l.words[1].text);
    ck_assert(!luminaire_is_sound(&l));
    l.words[1].text[0] = '\0';
    l.set = l.n_sets;
    ck_assert(!luminaire_is_sound(&l));
    l.set = 0;
    l.symmetry = SYMMETRY_ROTATIONAL;
    ck_assert(!luminaire_is_sound(&l));
    l.symmetry = SYMMETRY_QUADRANT;
    ck_assert(luminaire_is_sound(&l));
    luminaire_free(&l);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("luminaire");
    TCase *formulas = tcase_create("formulas"), *rest = tcase_create("rest");
    tcase_add_loop_test(formulas, intensities, 0, ROWS);
    tcase_add_loop_test(formulas, flux, 0, ROWS);
    tcase_set_timeout(formulas, 600);
    tcase_add_test(rest, versions_of_one_luminaire);
    tcase_add_test(rest, directions_of_the_peak);
    tcase_add_test(rest, type_a);
    tcase_add_test(rest, unsound_luminaires_are_known);
    suite_add_tcase(suite, formulas);
    suite_add_tcase(suite, rest);
    return suite_run(suite);
}
