/* EULUMDAT as people write it: symmetries, openings, lamp sets, odd lines, and each fault with its place. */
#include "solver/luminaire/luminaire.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

/* The parts of a small file, each some lines. */
typedef struct parts {
    const char *head, *body, *sets, *ratios, *planes, *gammas, *values, *tail;
} parts;

/* One plane of 100, 50, 0 cd per 1,000 lm at 0, 45, 90 degrees. */
static const parts usual = {.head = "Maker\n1\n1\n1\n0\n3\n45\nreport 7\nLamp\n42\nfile.ldt\n2026-11-29\n",
                            .body = "600\n600\n80\n580\n580\n0\n0\n0\n0\n100\n22.83\n1\n0\n",
                            .sets = "1\n1\nLED\n500\n4000 K\n80\n10\n",
                            .ratios = "0\n0\n0\n0\n0\n0\n0\n0\n0\n0\n",
                            .planes = "0\n",
                            .gammas = "0\n45\n90\n",
                            .values = "100\n50\n0\n",
                            .tail = ""};

static void join(const parts *p, char out[4096]) {
    snprintf(out, 4096, "%s%s%s%s%s%s%s%s", p->head, p->body, p->sets, p->ratios, p->planes, p->gammas,
             p->values, p->tail);
}

static lam_status read_set(const char *text, size_t set, luminaire *l, lam_error *error) {
    const luminaire_options options = {.set = set};
    return luminaire_read_text("a.ldt", text, strlen(text), &options, l, error);
}

static luminaire must_read(const parts *p) {
    char text[4096];
    lam_error error = {0};
    luminaire l = {0};
    join(p, text);
    ck_assert_msg(read_set(text, 0, &l, &error) == LAM_OK, "%s", error.message);
    return l;
}

static void is_usual(const char *text) {
    lam_error error = {0};
    luminaire l = {0};
    ck_assert_msg(read_set(text, 0, &l, &error) == LAM_OK, "%s: %s", text, error.message);
    ck_assert_int_eq(l.format, EULUMDAT);
    ck_assert_double_eq_tol(luminaire_candela(&l, 123, 22.5), 37.5, 1e-9);
    luminaire_free(&l);
}

static void refused(const parts *p, const char *wanted) {
    char text[4096];
    lam_error error = {0};
    luminaire l = {0};
    join(p, text);
    ck_assert_msg(read_set(text, 0, &l, &error) != LAM_OK, "%s", wanted);
    ck_assert_msg(strstr(error.message, wanted) != NULL, "'%s' does not say '%s'", error.message, wanted);
    ck_assert_ptr_null(l.candela);
}

START_TEST(fields) {
    luminaire l = must_read(&usual);
    ck_assert_str_eq(l.warnings.text, "");
    ck_assert_str_eq(luminaire_find_word(&l, "company"), "Maker");
    ck_assert_str_eq(luminaire_find_word(&l, "report"), "report 7");
    ck_assert_str_eq(luminaire_find_word(&l, "luminaire"), "Lamp");
    ck_assert_str_eq(luminaire_find_word(&l, "number"), "42");
    ck_assert_str_eq(luminaire_find_word(&l, "file"), "file.ldt");
    ck_assert_str_eq(luminaire_find_word(&l, "date"), "2026-11-29");
    ck_assert_str_eq(l.sets[0].type, "LED");
    ck_assert_str_eq(l.sets[0].colour, "4000 K");
    ck_assert_str_eq(l.sets[0].rendering, "80");
    ck_assert(l.sets[0].lumens == 500 && l.sets[0].watts == 10 && !l.absolute);
    ck_assert_double_eq_tol(l.output_ratio, .2283, 1e-12);
    ck_assert_double_eq(l.measured_tilt, 0);
    luminaire_free(&l);
}
END_TEST

START_TEST(texts_as_people_write_them) {
    char text[4096], other[8192];
    join(&usual, text);
    is_usual(text);
    /* CR LF, CR, CR CR LF; a byte order mark; blanks and marks at the end. */
    static const char *const ends[] = {"\r\n", "\r", "\r\r\n", " \t\n"};
    for (int k = 0; k < 4; k++) {
        other[0] = '\0';
        for (const char *c = text; *c != '\0'; c++) strcat(other, *c == '\n' ? ends[k] : (char[]){*c, '\0'});
        is_usual(other);
    }
    snprintf(other, sizeof other, "\xef\xbb\xbf%s\n\n \r\n\x1a", text);
    is_usual(other);
    text[strlen(text) - 1] = '\0';
    is_usual(text);
    parts p = usual;
    p.head = "\n1\n1 \n 1\n0,0\n3\n45,00\n\n\n\n\n\n"; /* no words at all */
    join(&p, text);
    is_usual(text);
    p.head = "1\n0\n1\n1\n\n3\n\n2\n3\n4\n5\n6\n"; /* words that are numbers; gammas that are listed */
    p.body = "\n\n\n\n\n\n\n\n\n\n\n1,0\n\n";
    p.sets = "1\n1 x LED\nLED\n500,0\n\n\n28 W\n";
    p.gammas = "0\n4,5E1\n+90.\n";
    p.values = "1.0E+02\n.5e2\n-0\n";
    join(&p, text);
    is_usual(text);
    p = usual;
    p.sets = "1\n1\nLED\n500\nwarm\n1B\n\n"; /* watts that are not stated */
    luminaire l = must_read(&p);
    ck_assert(isnan(l.sets[0].watts));
    luminaire_free(&l);
    p.sets = "1\n-1\nLED\n500\n\xc3\xa9t\xc3\xa9\n>80\n-\n"; /* a dash is no number */
    refused(&p, "line 32: watts of a lamp set = -, must be one number");
}
END_TEST

START_TEST(lamp_sets) {
    char text[4096];
    lam_error error = {0};
    luminaire l = {0};
    parts p = usual;
    p.sets = "2\n1\nA\n500\nw\n80\n10\n-2\nB\n2000\nw\n80\n20\n";
    join(&p, text);
    ck_ok(read_set(text, 0, &l, &error));
    ck_assert_double_eq(luminaire_candela(&l, 0, 0), 50);
    ck_assert(
        strstr(l.warnings.text,
               "it has 2 lamp sets; the first is taken; --set N, or lamp_set in a list, takes another") !=
        NULL);
    luminaire_free(&l);
    ck_ok(read_set(text, 1, &l, &error));
    ck_assert(strstr(l.warnings.text, "lamp sets") == NULL && !l.absolute && l.set == 0);
    luminaire_free(&l);
    ck_ok(read_set(text, 2, &l, &error));
    ck_assert_double_eq(luminaire_candela(&l, 0, 0), 200);
    ck_assert(l.absolute && l.set == 1 && l.n_sets == 2);
    luminaire_free(&l);
    ck_assert_int_eq(read_set(text, 3, &l, &error), LAM_ERR_ARGUMENT);
    ck_assert(strstr(error.message, "--set 3: it has 2 lamp sets") != NULL);
    p.sets = "0\n";
    refused(&p, "line 26: number of lamp sets = 0, must be at least 1; is a line missing before it, or one "
                "too many?");
    p.sets = "900\n1\n";
    refused(&p, "line 26: number of lamp sets = 900, more than the rest of the file can hold");
    p.sets = "10000000\n1\n";
    refused(&p, "line 26: number of lamp sets = 10000000, must be at most 1000");
    p.sets = "1\nmany\nLED\n500\n\n\n10\n";
    refused(&p, "line 27: number of lamps = many, must be one number");
    p.sets = "1\n1\nLED\n0\n\n\n10\n";
    refused(&p, "line 29: lumens of a lamp set = 0, must be above 0");
}
END_TEST

START_TEST(openings) {
    static const struct {
        const char *body;
        luminaire_shape shape;
        double x, y, z;
    } rows[] = {{"600\n600\n80\n1200\n300\n0\n0\n0\n0\n", OPENING_RECTANGLE, .3, 1.2, 0},
                {"600\n600\n80\n1200\n300\n10\n20\n40\n30\n", OPENING_BOX, .3, 1.2, .04},
                {"600\n0\n80\n200\n0\n0\n0\n0\n0\n", OPENING_DISC, .2, .2, 0},
                {"600\n0\n80\n200\n0\n20\n20\n20\n20\n", OPENING_CYLINDER, .2, .2, .02},
                {"600\n0\n80\n0\n0\n0\n0\n0\n0\n", OPENING_POINT, 0, 0, 0},
                {"600\n0\n80\n0\n300\n0\n0\n0\n0\n", OPENING_RECTANGLE, .3, 0, 0}};
    char body[256];
    parts p = usual;
    p.body = body;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        snprintf(body, sizeof body, "%s100\n22.83\n1\n0\n", rows[k].body);
        luminaire l = must_read(&p);
        ck_assert_msg(l.opening.shape == rows[k].shape, "%zu: %s", k, luminaire_shape_name(l.opening.shape));
        ck_assert_double_eq_tol(l.opening.size[0], rows[k].x, 1e-12);
        ck_assert_double_eq_tol(l.opening.size[1], rows[k].y, 1e-12);
        ck_assert_double_eq_tol(l.opening.size[2], rows[k].z, 1e-12);
        luminaire_free(&l);
    }
    snprintf(body, sizeof body, "600\n600\n80\n1200\n300\n10\n20\n40\n30\n100\n22.83\n1\n15\n");
    luminaire l = must_read(&p);
    ck_assert(l.opening.side[1] == .02 && l.opening.side[3] == .03);
    ck_assert(strstr(l.warnings.text, "measured at a tilt of 15 degrees") != NULL);
    luminaire_free(&l);
}
END_TEST

/* Two gammas; plane k of the file has 10 (k + 1) cd per 1,000 lm. */
static void table(char *head, char *planes, char *values, int symmetry, const char *listed, int n_stored) {
    int n = 0;
    planes[0] = values[0] = '\0';
    for (const char *c = listed; *c != '\0'; c += strspn(c, " ")) {
        const size_t length = strcspn(c, " ");
        snprintf(planes + strlen(planes), 16, "%.*s\n", (int)length, c);
        c += length;
        n++;
    }
    for (int k = 0; k < n_stored; k++)
        snprintf(values + strlen(values), 32, "%d\n%d\n", 10 * (k + 1), 10 * (k + 1));
    snprintf(head, 256, "Maker\n1\n%d\n%d\n0\n2\n0\nreport 7\nLamp\n42\nfile.ldt\n2026-11-29\n", symmetry, n);
}

START_TEST(symmetries) {
    static const struct {
        int symmetry;
        const char *planes;
        int n_stored;
        luminaire_symmetry made;
        double at[4]; /* C 0, 90, 180, 270 */
    } rows[] = {{0, "0 90 180 270", 4, SYMMETRY_NONE, {10, 20, 30, 40}},
                {0, "0 90 180 270 360", 5, SYMMETRY_NONE, {10, 20, 30, 40}},
                {0, "0", 1, SYMMETRY_ROTATIONAL, {10, 10, 10, 10}},
                {1, "0", 1, SYMMETRY_ROTATIONAL, {10, 10, 10, 10}},
                {1, "0 120 240", 1, SYMMETRY_ROTATIONAL, {10, 10, 10, 10}},
                {2, "0 90 180 270", 3, SYMMETRY_C0_C180, {10, 20, 30, 20}},
                {2, "0 180", 2, SYMMETRY_C0_C180, {10, 15, 20, 15}},
                {3, "0 90 180 270", 3, SYMMETRY_C90_C270, {20, 30, 20, 10}},
                {3, "0 45 90 180 225 270", 4, SYMMETRY_C90_C270, {20, 40, 20, 10}},
                {4, "0 90 180 270", 2, SYMMETRY_QUADRANT, {10, 20, 10, 20}},
                {4, "0 30 90 150 180 210 270 330", 3, SYMMETRY_QUADRANT, {10, 30, 10, 30}}};
    char head[256], planes[256], values[256];
    parts p = usual;
    p.head = head, p.planes = planes, p.values = values, p.gammas = "0\n180\n",
    p.sets = "1\n1\nx\n1000\n\n\n1\n";
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        table(head, planes, values, rows[k].symmetry, rows[k].planes, rows[k].n_stored);
        luminaire l = must_read(&p);
        ck_assert_msg(l.symmetry == rows[k].made, "%d: %s", rows[k].symmetry, rows[k].planes);
        for (int q = -4; q < 8; q++)
            ck_assert_msg(fabs(luminaire_candela(&l, 90 * q, 60) - rows[k].at[(q + 4) % 4]) < 1e-9,
                          "symmetry %d of %s at %d: %g", rows[k].symmetry, rows[k].planes, 90 * q,
                          luminaire_candela(&l, 90 * q, 60));
        luminaire_free(&l);
    }
    static const struct {
        int symmetry;
        const char *planes;
        int n_stored;
        const char *wanted;
    } faults[] = {
        {2, "0 90 180", 2, "line 4: number of C-planes = 3, must be an even number for symmetry 2"},
        {4, "0 90 180 270 300 330", 2, "line 4: number of C-planes = 6, must be a multiple of 4"},
        {2, "0 90 170 270", 3,
         "line 3: symmetry 2 of 4 C-planes needs the stored ones to go from 0 to 180, they go from 0 to 170"},
        {2, "10 90 180 270", 3, "they go from 10 to 180"},
        {3, "0 180", 2,
         "symmetry 3 of 2 C-planes needs the stored ones to go from 270 to 90, they go from 180 to 0"},
        {4, "0 80 180 270", 2, "needs the stored ones to go from 0 to 90, they go from 0 to 80"},
        {5, "0 90 180 270", 2, "line 3: symmetry indicator = 5, must be from 0 to 4"},
        {1, "0", 2, "a line after the last intensity = 20, must not be there"},
        {0, "0 90 180 270", 3, "after 6 of 8 intensities (4 by 2"},
        {0, "0 90 90 270", 4, "C-plane (degrees) = 90, must be above 90, the one before (3 of 4)"},
        {0, "0 90 180 370", 4, "C-plane (degrees) = 370, must be at most 360"}};
    for (size_t k = 0; k < sizeof faults / sizeof *faults; k++) {
        table(head, planes, values, faults[k].symmetry, faults[k].planes, faults[k].n_stored);
        refused(&p, faults[k].wanted);
    }
}
END_TEST

START_TEST(faults_have_a_place) {
    static const struct {
        parts p;
        const char *wanted;
    } rows[] = {
        {{.head = "Maker\n1\n1\n1\n0\n3\n45\nreport 7\nLamp\n42\n\nfile.ldt\n2026-11-29\n"},
         "line 13: length or diameter of the luminaire (mm) = 2026-11-29"},
        {{.head = "Maker\n1\n1\n1\n0\n3\n45\nreport 7\nLamp\n42\nfile.ldt\n"},
         "line 24: conversion factor for intensities = 0"},
        {{.head = "Maker\n4\n1\n1\n0\n3\n45\nr\nL\n4\nf\n2\n"},
         "line 2: type indicator = 4, must be from 0 to 3"},
        {{.head = "Maker\n1\n1\n0\n0\n3\n45\nr\nL\n4\nf\n2\n"},
         "line 4: number of C-planes = 0, must be at least 1"},
        {{.head = "Maker\n1\n1\n9000000\n0\n3\n45\nr\nL\n4\nf\n2\n"},
         "line 4: number of C-planes = 9000000, more than"},
        {{.head = "Maker\n1\n1\n1\n0\n1\n45\nr\nL\n4\nf\n2\n"},
         "line 6: number of intensities of a plane = 1, must be at least 2"},
        {{.head = "Maker\n1\n1\n1\n0\n3.5\n45\nr\nL\n4\nf\n2\n"},
         "line 6: number of intensities of a plane = 3.5, must be a whole number"},
        {{.head = "Maker\n1\n1\n1\n0\n900000\n45\nr\nL\n4\nf\n2\n"},
         "line 6: number of intensities of a plane = 900000, more than"},
        {{.body = "600\n600\n80\n580\n580\n0\n0\n0\n0\n100\n100\n0\n0\n"},
         "line 24: conversion factor for intensities = 0, must be above 0; is a line missing before it"},
        {{.body = "600\n600\n80\n580\n580\n0\n0\n0\n0\n100\n100\n\n0\n"},
         "line 24: conversion factor for intensities = nothing, must be one number"},
        {{.body = "600\n600\n80\n-5\n580\n0\n0\n0\n0\n100\n100\n1\n0\n"},
         "line 16: length or diameter of the luminous area (mm) = -5, must not be negative"},
        {{.ratios = "0\n0\n0\n0\nx\n0\n0\n0\n0\n0\n"}, "line 37: direct ratio = x"},
        {{.gammas = "0\n45\n45\n"},
         "line 46: gamma (degrees) = 45, must be above 45, the one before (3 of 3)"},
        {{.gammas = "0\n45\n181\n"}, "line 46: gamma (degrees) = 181, must be at most 180"},
        {{.values = "100\n50\n"}, "ends after line 48, after 2 of 3 intensities"},
        {{.values = "100 50 0\n"}, "line 47: intensity (cd per 1,000 lm) = 100 50 0, must be one number"},
        {{.values = "100\n\n0\n"}, "line 48: intensity (cd per 1,000 lm) = nothing"},
        {{.values = "100\nnan\n0\n"}, "line 48: intensity (cd per 1,000 lm) = nan"},
        {{.values = "100\n-2\n0\n"}, "line 48: intensity (cd per 1,000 lm) = -2, must not be negative"},
        {{.values = "100\n1e14\n0\n", .sets = "1\n1\nx\n1e9\n\n\n1\n"},
         "line 48: intensity (cd per 1,000 lm) = 1e14, too large"},
        {{.tail = "1\n"}, "line 50: a line after the last intensity = 1, must not be there"},
        {{.tail = "the end"}, "line 50: a line after the last intensity = the end"},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        parts p = usual;
        const parts *of = &rows[k].p;
        if (of->head != NULL) p.head = of->head;
        if (of->body != NULL) p.body = of->body;
        if (of->sets != NULL) p.sets = of->sets;
        if (of->ratios != NULL) p.ratios = of->ratios;
        if (of->gammas != NULL) p.gammas = of->gammas;
        if (of->values != NULL) p.values = of->values;
        if (of->tail != NULL) p.tail = of->tail;
        refused(&p, rows[k].wanted);
    }
    /* A file that ends anywhere says so, and never reads on. */
    char text[4096], cut[4096];
    join(&usual, text);
    for (size_t length = 1; length + 2 < strlen(text); length++) {
        lam_error error = {0};
        luminaire l = {0};
        snprintf(cut, sizeof cut, "%.*s", (int)length, text);
        ck_assert_msg(read_set(cut, 0, &l, &error) != LAM_OK && error.message[0] != '\0', "%zu", length);
    }
}
END_TEST

START_TEST(content_says_the_format) {
    const luminaire_options options = {.set = 0};
    static const char *const names[] = {"a.ies", "a.ldt", "a", "a.txt"};
    char text[4096];
    const char other[] = "IESNA91\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 1\n0 45 90\n0\n1 1 1\n",
               neither[] = "a\nb\nc\n";
    lam_error error = {0};
    luminaire l = {0};
    parts p = usual; /* the distance of planes may be left out */
    p.head = "Maker\n1\n1\n1\n\n3\n45\nreport 7\nLamp\n42\nfile.ldt\n2026-11-29\n";
    join(&p, text);
    for (int k = 0; k < 4; k++) {
        ck_ok(luminaire_read_text(names[k], text, strlen(text), &options, &l, &error));
        ck_assert_int_eq(l.format, EULUMDAT);
        luminaire_free(&l);
        ck_ok(luminaire_read_text(names[k], other, strlen(other), &options, &l, &error));
        ck_assert_int_eq(l.format, LM63_1991);
        luminaire_free(&l);
        ck_assert_int_eq(luminaire_read_text(names[k], neither, strlen(neither), &options, &l, &error),
                         LAM_ERR_FORMAT);
        ck_assert_msg(strstr(error.message, k == 0   ? "has no line TILT="
                                            : k == 1 ? "line 2: type indicator = b"
                                                     : "neither IES LM-63") != NULL,
                      "%s", error.message);
    }
}
END_TEST

START_TEST(flux_is_compared_with_the_lamps) {
    parts p = usual;
    p.body = "600\n600\n80\n580\n580\n0\n0\n0\n0\n100\n60\n1\n0\n";
    luminaire l = must_read(&p);
    const double lumens = luminaire_lumens(&l);
    char wanted[160];
    snprintf(wanted, sizeof wanted,
             "its candela add up to %.5g lm, but its lamps (500 lm) and output ratio (60 %%) say 300 lm",
             lumens);
    ck_assert_str_eq(l.warnings.text, wanted);
    luminaire_free(&l);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("eulumdat");
    TCase *tests = tcase_create("all");
    tcase_add_test(tests, fields);
    tcase_add_test(tests, texts_as_people_write_them);
    tcase_add_test(tests, lamp_sets);
    tcase_add_test(tests, openings);
    tcase_add_test(tests, symmetries);
    tcase_add_test(tests, faults_have_a_place);
    tcase_add_test(tests, content_says_the_format);
    tcase_add_test(tests, flux_is_compared_with_the_lamps);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
