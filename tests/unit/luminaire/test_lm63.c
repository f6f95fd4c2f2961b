/* IES LM-63 as people write it: versions, openings, separators, tilts, and each fault with its place. */
#include "solver/luminaire/luminaire.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>
#include <strings.h>

#define HEAD "IESNA:LM-63-2002\n[TEST] 1\n"
#define TILT "TILT=NONE\n"
#define LAMP "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n"
#define TABLE "0 45 90\n0\n100 50 0\n"

static lam_status read_bytes(const char *text, size_t length, luminaire *l, lam_error *error) {
    const luminaire_options options = {.set = 0};
    return luminaire_read_text("a.ies", text, length, &options, l, error);
}

static luminaire must_read(const char *text) {
    lam_error error = {0};
    luminaire l = {0};
    ck_assert_msg(read_bytes(text, strlen(text), &l, &error) == LAM_OK, "%s: %s", text, error.message);
    return l;
}

static void refused(const char *text, const char *wanted) {
    lam_error error = {0};
    luminaire l = {0};
    ck_assert_msg(read_bytes(text, strlen(text), &l, &error) != LAM_OK, "%s", text);
    ck_assert_msg(strstr(error.message, wanted) != NULL, "%s: '%s' does not say '%s'", text, error.message,
                  wanted);
    ck_assert_ptr_null(l.candela);
}

/* A table of 100, 50 and 0 cd at 0, 45 and 90 degrees. */
static void is_usual(const char *text) {
    luminaire l = must_read(text);
    ck_assert_uint_eq(l.n_planes, 1);
    ck_assert_uint_eq(l.n_angles, 3);
    ck_assert_double_eq_tol(luminaire_candela(&l, 77, 22.5), 75, 1e-9);
    ck_assert_double_eq_tol(luminaire_candela(&l, 77, 45), 50, 1e-9);
    luminaire_free(&l);
}

START_TEST(versions) {
    static const struct {
        const char *line;
        luminaire_format format;
        bool warns;
    } rows[] = {{"IESNA:LM-63-1986", LM63_1986, false},
                {"IESNA86", LM63_1986, false},
                {"IESNA91", LM63_1991, false},
                {"IESNA:LM-63-1991", LM63_1991, false},
                {"IESNA:LM-63-1995", LM63_1995, false},
                {"IESNA95", LM63_1995, false},
                {"iesna:lm-63-1995", LM63_1995, false},
                {"IESNA:LM-63-2002", LM63_2002, false},
                {"  IESNA:LM-63-2002 ", LM63_2002, false},
                {"IES:LM-63-2019", LM63_2019, false},
                {"IESNA:LM-63-2019", LM63_2019, false},
                {"IES:LM-63-2030", LM63_2019, true},
                {"IESNA:LM-63-2008", LM63_2002, true},
                {"IESNA02", LM63_2002, false},
                {"A luminaire of 2002", LM63_1986, false},
                {"IES", LM63_1986, false}};
    char text[512];
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        snprintf(text, sizeof text, "%s\n[TEST] 1\n" TILT "1 1000 2 3 1 1 2 0 0 0\n.5 3 10\n" TABLE,
                 rows[k].line);
        luminaire l = must_read(text);
        ck_assert_msg(l.format == rows[k].format, "%s", rows[k].line);
        /* Two factors count up to 1991, afterwards one. */
        ck_assert_double_eq_tol(luminaire_candela(&l, 0, 0), l.format <= LM63_1991 ? 300 : 100, 1e-9);
        ck_assert_msg((strstr(l.warnings.text, "its version is of") != NULL) == rows[k].warns, "%s",
                      rows[k].line);
        luminaire_free(&l);
    }
}
END_TEST

START_TEST(numbers_as_people_write_them) {
    is_usual(HEAD TILT LAMP TABLE);
    is_usual(HEAD TILT "1,-1,1,3,1,1,2,0,0,0\n1,1,10\n0,45,90,\n0,\n100,50,0,\n");
    is_usual(HEAD TILT "1 -1 1.0E+00 3 1 1 2 .0 0. -0\n+1 1.0D0 1e1\n0 4.5e1 +90.\n0\n1.0E+02 .5e2 0\n");
    is_usual(HEAD TILT "1\n-1\n1\n3\n1\n1\n2\n0\n0\n0\n1\n1\n10\n0\n45\n90\n0\n100\n50\n0");
    is_usual(HEAD TILT "1\t-1\t1\t3\t1\t1\t2\t0\t0\t0\f\n1\v1 10\n" TABLE);
    is_usual(HEAD TILT "1 -1 1 3 1 1 2 0 0 0 1 1 10 0 45 90 0 100 50 0");
    is_usual(HEAD TILT LAMP TABLE "\n\n \t\r\n\x1a");
    is_usual(HEAD TILT LAMP TABLE "\x1a\x1a\x1a rests of a disk");
    is_usual("\xef\xbb\xbf" HEAD TILT LAMP TABLE);
    /* CR LF, CR and LF in one file; a space before the tilt, and in it. */
    is_usual("IESNA:LM-63-2002\r\n[TEST] 1\r[LAMP] x\n  tilt =  none \r\n1 -1 1 3 1 1 2 0 0 0\r1 1 10\n0 45 "
             "90\r\n0\n100 50 0\r");
    is_usual("IESNA:LM-63-2002\r\r\n[TEST] 1\r\r\nTILT=NONE\r\r\n1 -1 1 3 1 1 2 0 0 0\r\r\n1 1 10\r\r\n0 45 "
             "90 0 100 50 0\r\r\n");
    is_usual("IESNA:LM-63-2002\nTILT=\n" LAMP TABLE);
    is_usual("\n\n" TILT LAMP TABLE);
    is_usual(TILT LAMP TABLE);
    /* Lamps are no factor. */
    is_usual(HEAD TILT "4 -1 1 3 1 1 2 0 0 0\n1 1 10\n" TABLE);
    is_usual(HEAD TILT "4 1000 1 3 1 1 2 0 0 0\n1 1 10\n" TABLE);
    is_usual(HEAD TILT "0 0 1 3 1 1 2 0 0 0\n1 1 0\n" TABLE);
    /* One plane is turned about the axis, whatever its angle. */
    is_usual(HEAD TILT LAMP "0 45 90\n90\n100 50 0\n");
}
END_TEST

START_TEST(numbers_keep_their_digits) {
    luminaire l = must_read(
        HEAD TILT "1 -1 1 6 1 1 2 0 0 0\n1 1 1\n0 10 20 30 40 90\n0\n"
                  "123456789012345 1234567890123.456 0.1 3.4028234663852886e5 000000000000000012.5 7e-3\n");
    const double wanted[] = {123456789012345, 1234567890123.456, .1, 340282.34663852886, 12.5, .007};
    for (int k = 0; k < 6; k++) ck_assert_double_eq(l.candela[k], wanted[k]);
    luminaire_free(&l);
}
END_TEST

START_TEST(words) {
    char text[8192];
    luminaire l =
        must_read("IESNA:LM-63-2002\n[MANUFAC] M\xfcller & S\xf6hne\x07\n[LUMINAIRE]One\t\"two\" \n[MORE] "
                  "three\n[more]\n"
                  "no keyword\n[LAMP] TILT=NONE is not here\n[_CCT] 3000 K\n[CRI] 80\n" TILT LAMP TABLE);
    ck_assert_uint_eq(l.n_words, 6);
    ck_assert_str_eq(luminaire_find_word(&l, "manufac"), "M\xc3\xbcller & S\xc3\xb6hne?");
    ck_assert_str_eq(luminaire_find_word(&l, "LUMINAIRE"), "One \"two\" three");
    ck_assert_str_eq(l.words[2].key, "");
    ck_assert_str_eq(l.words[2].text, "no keyword");
    ck_assert_str_eq(l.sets[0].type, "TILT=NONE is not here");
    ck_assert_str_eq(l.sets[0].colour, "3000 K");
    ck_assert_str_eq(l.sets[0].rendering, "80");
    ck_assert_double_eq(l.sets[0].watts, 10);
    ck_assert_str_eq(luminaire_find_word(&l, "ABSENT"), "");
    luminaire_free(&l);
    /* Marks of direction and controls of UTF-8 do not reach a terminal; other letters do. */
    l = must_read(HEAD "[MANUFAC] \xe2\x80\xaeriva \xc2\x9b"
                       "31m \x1b[1m \xe7\x85\xa7\xe6\x98\x8e\n" TILT LAMP TABLE);
    ck_assert_str_eq(luminaire_find_word(&l, "MANUFAC"), "?riva ?31m ?[1m \xe7\x85\xa7\xe6\x98\x8e");
    luminaire_free(&l);
    /* A long line is cut at the end of a letter, and so is what [MORE] adds. */
    snprintf(text, sizeof text, HEAD "[MANUFAC] %02000d\xc3\xbc\n[MORE] x\n[OTHER] a\n[MORE] ", 0);
    for (int k = 0; k < 2000; k++) strcat(text, "\xc3\xbc");
    strcat(text, "\n" TILT LAMP TABLE);
    l = must_read(text);
    ck_assert_uint_eq(strlen(luminaire_find_word(&l, "MANUFAC")), LUMINAIRE_TEXT - 1);
    ck_assert_uint_ge(strlen(luminaire_find_word(&l, "OTHER")), LUMINAIRE_TEXT - 3);
    luminaire_free(&l);
    /* More lines than are kept. */
    char *many = malloc(40000);
    strcpy(many, HEAD);
    for (int k = 0; k < 3000; k++) strcat(many + 8 * k, "[K] wor\n");
    strcat(many, TILT LAMP TABLE);
    l = must_read(many);
    ck_assert_uint_eq(l.n_words, 1000);
    luminaire_free(&l);
    free(many);
}
END_TEST

START_TEST(openings) {
    static const struct {
        const char *version, *stated;
        luminaire_shape shape;
        double x, y, z;
    } rows[] = {{"IESNA:LM-63-2002", "0 0 0", OPENING_POINT, 0, 0, 0},
                {"IESNA:LM-63-2002", ".3 1.2 0", OPENING_RECTANGLE, 1.2, .3, 0},
                {"IESNA:LM-63-2002", "0 1.2 0", OPENING_RECTANGLE, 1.2, 0, 0},
                {"IESNA:LM-63-2002", ".3 1.2 .1", OPENING_BOX, 1.2, .3, .1},
                {"IESNA:LM-63-2002", ".3 0 .1", OPENING_RECTANGLE, 0, .3, .1},
                {"IESNA:LM-63-2002", "-.3 -.3 0", OPENING_DISC, .3, .3, 0},
                {"IESNA:LM-63-2002", "-.3 -.4 0", OPENING_ELLIPSE, .4, .3, 0},
                {"IESNA:LM-63-2002", "-.3 0 0", OPENING_DISC, .3, .3, 0},
                {"IESNA:LM-63-2002", "0 -.3 0", OPENING_DISC, .3, .3, 0},
                {"IESNA:LM-63-2002", "-.3 -.3 .2", OPENING_CYLINDER, .3, .3, .2},
                {"IESNA:LM-63-2002", "-.3 -.4 .2", OPENING_CYLINDER, .4, .3, .2},
                {"IESNA:LM-63-2002", "-.3 0 .2", OPENING_CYLINDER, .3, .3, .2},
                {"IESNA:LM-63-2002", "-.3 -.3 -.3", OPENING_SPHERE, .3, .3, .3},
                {"IESNA:LM-63-2002", "-.3 -.3 -.4", OPENING_ELLIPSOID, .3, .3, .4},
                {"IESNA:LM-63-2002", "1 -.3 -.3", OPENING_CYLINDER_Y, .3, 1, .3},
                {"IESNA:LM-63-2002", "-.3 1 -.3", OPENING_CYLINDER_X, 1, .3, .3},
                {"IESNA:LM-63-2002", "0 -.3 -.3", OPENING_UPRIGHT_DISC, .3, 0, .3},
                {"IES:LM-63-2019", "-.3 0 -.3", OPENING_UPRIGHT_DISC, 0, .3, .3},
                {"IESNA:LM-63-1995", "-.3 0 0", OPENING_DISC, .3, .3, 0},
                {"IESNA:LM-63-1995", "-.3 0 -.3", OPENING_SPHERE, .3, .3, .3},
                {"IESNA:LM-63-1995", "0 1 -.3", OPENING_CYLINDER_X, 1, .3, .3},
                {"IESNA:LM-63-1995", "1 0 -.3", OPENING_CYLINDER_Y, .3, 1, .3},
                {"IESNA:LM-63-1995", "-.3 .4 .5", OPENING_CYLINDER, .4, .3, .5},
                {"IESNA:LM-63-1995", "-.3 .4 -.5", OPENING_ELLIPSOID, .4, .3, .5},
                {"IESNA91", "-.3 .4 .5", OPENING_ELLIPSOID, .4, .3, .5},
                {"IESNA91", "-.3 0 .5", OPENING_CYLINDER, .3, .3, .5},
                {"IESNA91", "-.3 .4 0", OPENING_ELLIPSE, .4, .3, 0},
                {"IESNA91", "-.3 -.3 0", OPENING_DISC, .3, .3, 0},
                {"IESNA:LM-63-1995", "-.3 -.4 .2", OPENING_CYLINDER, .4, .3, .2},
                {"IESNA91", "-.3 0 -.3", OPENING_POINT, 0, 0, 0},
                {"IESNA:LM-63-2002", "-.3 .4 .5", OPENING_POINT, 0, 0, 0},
                {"IESNA:LM-63-1995", ".3 .4 -.5", OPENING_POINT, 0, 0, 0}};
    char text[256];
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        for (int unit = 1; unit <= 2; unit++) {
            const double metres = unit == 1 ? .3048 : 1;
            snprintf(text, sizeof text, "%s\n" TILT "1 -1 1 3 1 1 %d %s\n1 1 10\n" TABLE, rows[k].version,
                     unit, rows[k].stated);
            luminaire l = must_read(text);
            const double wanted[3] = {rows[k].x * metres, rows[k].y * metres, rows[k].z * metres};
            const bool unknown = rows[k].shape == OPENING_POINT && rows[k].stated[0] != '0';
            ck_assert_msg(l.opening.shape == rows[k].shape, "%s %s: %s", rows[k].version, rows[k].stated,
                          luminaire_shape_name(l.opening.shape));
            for (int d = 0; d < 3; d++)
                ck_assert_msg(fabs(l.opening.size[d] - wanted[d]) < 1e-12, "%s %s: size %d = %g",
                              rows[k].version, rows[k].stated, d, l.opening.size[d]);
            ck_assert_int_eq(strstr(l.warnings.text, "no shape") != NULL, unknown);
            luminaire_free(&l);
        }
}
END_TEST

START_TEST(planes) {
    static const struct {
        const char *planes;
        size_t n;
        luminaire_symmetry symmetry;
        double at_0, at_90, at_180, at_270; /* plane k has 10 (k + 1) cd */
    } rows[] = {{"0 45 90", 3, SYMMETRY_QUADRANT, 10, 30, 10, 30},
                {"0 90 180", 3, SYMMETRY_C0_C180, 10, 20, 30, 20},
                {"90 180 270", 3, SYMMETRY_C90_C270, 20, 10, 20, 30},
                {"0 90 180 270 360", 5, SYMMETRY_NONE, 10, 20, 30, 40},
                {"0 90 180 270", 4, SYMMETRY_NONE, 10, 20, 30, 40},
                {"0 120 240", 3, SYMMETRY_NONE, 10, 17.5, 25, 25},
                {"0 180", 2, SYMMETRY_C0_C180, 10, 15, 20, 15},
                {"0 360", 2, SYMMETRY_NONE, 10, 12.5, 15, 17.5}};
    char text[512], values[128];
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        values[0] = '\0';
        for (size_t p = 0; p < rows[k].n; p++)
            snprintf(values + strlen(values), sizeof values - strlen(values), "%zu %zu\n", 10 * (p + 1),
                     10 * (p + 1));
        snprintf(text, sizeof text, HEAD TILT "1 -1 1 2 %zu 1 2 0 0 0\n1 1 10\n0 180\n%s\n%s", rows[k].n,
                 rows[k].planes, values);
        luminaire l = must_read(text);
        const double wanted[4] = {rows[k].at_0, rows[k].at_90, rows[k].at_180, rows[k].at_270};
        ck_assert_msg(l.symmetry == rows[k].symmetry, "%s", rows[k].planes);
        for (int q = -4; q < 8; q++)
            ck_assert_msg(fabs(luminaire_candela(&l, 90 * q, 60) - wanted[(q + 4) % 4]) < 1e-9,
                          "%s at %d: %g", rows[k].planes, 90 * q, luminaire_candela(&l, 90 * q, 60));
        luminaire_free(&l);
    }
    /* The mirrors of the half from 90 to 270. */
    luminaire l =
        must_read(HEAD TILT "1 -1 1 2 4 1 2 0 0 0\n1 1 10\n0 180\n90 100 260 270\n1 1 2 2 3 3 4 4\n");
    ck_assert_double_eq_tol(luminaire_candela(&l, 80, 9), 2, 1e-9);
    ck_assert_double_eq_tol(luminaire_candela(&l, 280, 9), 3, 1e-9);
    ck_assert_double_eq_tol(luminaire_candela(&l, -80, 9), 3, 1e-9);
    luminaire_free(&l);
}
END_TEST

START_TEST(tilts) {
    luminaire l = must_read(HEAD "TILT=include\n2\n3\n0 45 90\n1.0 .9\n.8\n" LAMP TABLE);
    ck_assert_uint_eq(l.tilt.n, 3);
    ck_assert_int_eq(l.tilt.geometry, 2);
    ck_assert_double_eq(l.tilt.angles[1], 45);
    ck_assert_double_eq(l.tilt.factors[2], .8);
    ck_assert_double_eq_tol(luminaire_candela(&l, 0, 0), 100, 1e-9);
    luminaire_free(&l);
    refused(HEAD "TILT=INCLUDE\n4\n1\n0\n1\n" LAMP TABLE,
            "line 4, column 1: lamp to luminaire geometry of TILT = 4, must be at most 3");
    refused(HEAD "TILT=INCLUDE\n1\n0\n" LAMP TABLE, "number of tilt angles = 0, must be at least 1");
    refused(HEAD "TILT=INCLUDE\n1\n90000\n" LAMP TABLE, "number of tilt angles = 90000, more than");
    refused(HEAD "TILT=INCLUDE\n1\n2\n0 0\n1 1\n" LAMP TABLE,
            "line 6, column 3: tilt angle 2 of 2 = 0, must be above 0");
    refused(HEAD "TILT=INCLUDE\n1\n2\n0 90\n1 -1\n" LAMP TABLE, "tilt factor = -1, must not be negative");
    refused("IES:LM-63-2019\nTILT=a.tlt\n" LAMP TABLE,
            "line 2: TILT=a.tlt, must be NONE or INCLUDE in LM-63-2019");
    refused(HEAD "TILT=a.tlt\n" LAMP TABLE, "line 3: TILT=a.tlt is not there");
}
END_TEST

START_TEST(faults_have_a_place) {
    static const struct {
        const char *text, *wanted;
    } rows[] = {
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 50\n",
         "ends at line 8, after 2 of 3 candela values"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n", "ends at line 7, after 0 of 3"},
        {HEAD TILT "1 -1 1 3 9 1 2 0 0 0\n1 1 10\n0 45 90\n0 10",
         "ends at line 7, after 0 of 27 candela values (9 by 3"},
        {HEAD TILT "1 -1 1 3 1 1", "ends at line 4, before the type of units"},
        {HEAD TILT, "ends at line 3, before the number of lamps"},
        {HEAD TILT LAMP TABLE "7", "line 9, column 1: a word after the last candela value = 7"},
        {HEAD TILT LAMP TABLE "END", "a word after the last candela value = END"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 5O 0\n",
         "line 8, column 5: candela value = 5O, must be a number"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 0x1p3 0\n", "candela value = 0x1p3"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 inf 0\n", "candela value = inf"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 1e999 0\n", "candela value = 1e999"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 1e300 0\n",
         "candela value = 1e300, must be at most 1e+15"},
        {HEAD TILT "1 -1 1e9 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n1e9 1 0\n",
         "candela value = 1e9, too large with the factors"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 190\n0\n100 50 0\n",
         "vertical angle = 190, must be at most 180"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n-1 45 90\n0\n100 50 0\n",
         "vertical angle = -1, must not be negative"},
        {HEAD TILT "1 -1 1 3 2 1 2 0 0 0\n1 1 10\n0 45 90\n0 400\n1 1 1 1 1 1\n",
         "horizontal angle = 400, must be at most 360"},
        {HEAD TILT "1 -1 1 3 2 1 2 0 0 0\n1 1 10\n0 45 90\n0 0\n1 1 1 1 1 1\n",
         "horizontal angle 2 of 2 = 0, must be above 0"},
        {HEAD TILT "1 -1 1 2 3 1 2 0 0 0\n1 1 10\n0 90\n0 80 170\n1 1 1 1 1 1\n",
         "line 7, column 6: the last horizontal angle = 170"},
        {HEAD TILT "1 -1 1 2 3 1 2 0 0 0\n1 1 10\n0 90\n90 180 260\n1 1 1 1 1 1\n",
         "the last horizontal angle = 260, must be 270"},
        {HEAD TILT "1 -1 1 2 3 1 2 0 0 0\n1 1 10\n0 90\n45 180 270\n1 1 1 1 1 1\n",
         "line 7, column 1: the first horizontal angle = 45"},
        {HEAD TILT "1 -1 1 1 1 1 2 0 0 0\n1 1 10\n0\n0\n1\n",
         "number of vertical angles = 1, must be at least 2"},
        {HEAD TILT "1 -1 1 3 0 1 2 0 0 0\n1 1 10\n" TABLE,
         "number of horizontal angles = 0, must be at least 1"},
        {HEAD TILT "1 -1 1 3 1.5 1 2 0 0 0\n1 1 10\n" TABLE,
         "number of horizontal angles = 1.5, must be a whole number"},
        {HEAD TILT "1 -1 1 -3 1 1 2 0 0 0\n1 1 10\n" TABLE,
         "number of vertical angles = -3, must be at least 2"},
        {HEAD TILT "1 -1 1 3 1 2 2 0 0 0\n1 1 10\n" TABLE, "1 horizontal angle, type B needs at least 2"},
        {HEAD TILT "1 -1 1 2 2 2 2 0 0 0\n1 1 10\n10 90\n0 90\n1 1 1 1",
         "the vertical angles of type B begin at 10"},
        {HEAD TILT "1 -1 1 2 2 3 2 0 0 0\n1 1 10\n0 90\n10 90\n1 1 1 1",
         "the horizontal angles of type A begin at 10"},
        {HEAD TILT "1 -1 1 2 2 2 2 0 0 0\n1 1 10\n-95 90\n0 90\n1 1 1 1",
         "vertical angle = -95, must be at least -90"},
        {HEAD TILT "1 -1 1 3 1 1 2 9e9 0 0\n1 1 10\n" TABLE, "width = 9e9, must be at most 1000000"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n0 1 10\n" TABLE, "ballast factor = 0, must be above 0"},
        {"IESNA91\n" TILT "1 -1 1 3 1 1 2 0 0 0\n1 0 10\n" TABLE,
         "ballast-lamp photometric factor = 0, must be above 0"},
        {"IES:LM-63-2019\n" TILT "1 -1 1 3 1 1 2 0 0 0\n1 x 10\n" TABLE, "file generation type = x"},
        {"IESNA:LM-63-2002\nno such line\n", "has no line TILT="},
        {"\x1a TILT=NONE", "the file is empty"},
        {" \r\n \x1a", "the file is empty"},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) refused(rows[k].text, rows[k].wanted);
    /* Commas separate numbers; where one stands between digits the file may mean a decimal mark. */
    static const char asked[] = "; commas separate numbers, is one of them a decimal mark?";
    refused(HEAD TILT "1 -1 1,5 3 1 1 2 0 0 0\n1 1 10\n" TABLE, asked);
    refused(HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100,5 50 0\n", asked);
    lam_error error = {0};
    luminaire l = {0};
    const char spaced[] = HEAD TILT "1, -1, 1, 3, 1, 1, 2, 0, 0, 0\n1, 1, 10\n0, 45, 90\n0\n100, 50\n";
    ck_assert_int_eq(read_bytes(spaced, strlen(spaced), &l, &error), LAM_ERR_FORMAT);
    ck_assert_ptr_null(strstr(error.message, asked));
    /* The control characters of a word are not shown. */
    refused(HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 1 \x1b[31m\n" TABLE, "input watts = ?[31m");
}
END_TEST

static void refused_bytes(const char *bytes, size_t length, const char *wanted) {
    lam_error error = {0};
    luminaire l = {0};
    ck_assert_int_eq(read_bytes(bytes, length, &l, &error), LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, wanted) != NULL, "%s", error.message);
}

START_TEST(texts_of_other_kinds) {
    const char text[] = "IESNA91\n" TILT LAMP TABLE;
    char wide[4 * sizeof text + 4];
    for (int big = 0; big < 2; big++)
        for (int mark = 0; mark < 2; mark++) {
            size_t n = 0;
            if (mark) wide[n++] = (char)(big ? 0xfe : 0xff), wide[n++] = (char)(big ? 0xff : 0xfe);
            for (const char *c = text; *c != '\0'; c++) {
                wide[n + (size_t)big] = *c;
                wide[n + (size_t)!big] = '\0';
                n += 2;
            }
            refused_bytes(wide, n, "UTF-16");
        }
    char zero[] = "IESNA91\n[A] b\n" TILT LAMP TABLE;
    zero[10] = '\0';
    refused_bytes(zero, sizeof zero - 1, "line 2 holds a zero byte; not a text file");
    refused_bytes("", 0, "the file is empty");
    refused_bytes("\xef\xbb\xbf", 3, "the file is empty");
    char *large = calloc(17, 1 << 20);
    refused_bytes(large, (size_t)17 << 20, "has 17825792 bytes, more than the 16 MiB");
    free(large);
    /* Zeros behind the end are padding. */
    lam_error error = {0};
    luminaire l = {0};
    ck_ok(read_bytes(text, sizeof text, &l, &error));
    luminaire_free(&l);
}
END_TEST

START_TEST(warnings) {
    static const struct {
        const char *text, *wanted;
    } rows[] = {
        {HEAD TILT LAMP "0 45 80\n0\n1 1 1\n", "the table ends at 80 degrees; light beyond it is 0"},
        {HEAD TILT LAMP "5 45 90\n0\n1 1 1\n", "the table begins at 5 degrees; light before it is 0"},
        {HEAD TILT LAMP "0 45 90\n0\n0 0 0\n", "the luminaire is dark"},
        {HEAD TILT "1 100 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 100 100\n",
         "its candela add up to 628.32 lm, but its lamps give 100 lm"},
        {HEAD TILT "1 -1 1 3 1 1 2 600 600 0\n1 1 10\n" TABLE,
         "its opening is 600 x 600 x 0 m; is its unit right?"},
        {HEAD TILT "1 -1 1 3 1 1 2 0 0 0\n1 .95 10\n" TABLE, "the number after the ballast factor is 0.95"}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        luminaire l = must_read(rows[k].text);
        ck_assert_msg(strcmp(l.warnings.text, rows[k].wanted) == 0 ||
                          strstr(l.warnings.text, rows[k].wanted) != NULL,
                      "'%s' instead of '%s'", l.warnings.text, rows[k].wanted);
        luminaire_free(&l);
    }
    luminaire l = must_read(HEAD TILT LAMP TABLE);
    ck_assert_str_eq(l.warnings.text, "");
    luminaire_free(&l);
}
END_TEST

START_TEST(lamp_sets) {
    const luminaire_options options = {.set = 2};
    const char text[] = HEAD TILT LAMP TABLE;
    lam_error error = {0};
    luminaire l = {0};
    ck_assert_int_eq(luminaire_read_text("a.ies", text, strlen(text), &options, &l, &error),
                     LAM_ERR_ARGUMENT);
    ck_assert_msg(strstr(error.message, "has one lamp set") != NULL, "%s", error.message);
    l = must_read(HEAD TILT "3 -1 1 3 1 1 2 0 0 0\n1 1 10\n" TABLE);
    ck_assert(l.absolute && isnan(l.sets[0].lumens) && l.sets[0].number == 3);
    luminaire_free(&l);
    l = must_read(HEAD TILT "3 200 1 3 1 1 2 0 0 0\n1 1 10\n" TABLE);
    ck_assert(!l.absolute && l.sets[0].lumens == 600);
    luminaire_free(&l);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("lm63");
    TCase *tests = tcase_create("all");
    tcase_add_test(tests, versions);
    tcase_add_test(tests, numbers_as_people_write_them);
    tcase_add_test(tests, numbers_keep_their_digits);
    tcase_add_test(tests, words);
    tcase_add_test(tests, openings);
    tcase_add_test(tests, planes);
    tcase_add_test(tests, tilts);
    tcase_add_test(tests, faults_have_a_place);
    tcase_add_test(tests, texts_of_other_kinds);
    tcase_add_test(tests, warnings);
    tcase_add_test(tests, lamp_sets);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
