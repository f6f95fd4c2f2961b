/* Tables and pictures of intensities. */
#include "solver/luminaire/polar_curves.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

static luminaire must_read(const char *text) {
    const luminaire_options options = {.set = 0};
    lam_error error = {0};
    luminaire l = {0};
    ck_ok(luminaire_read_text("a.ies", text, strlen(text), &options, &l, &error));
    return l;
}

/* The caller frees. */
static char *written(const luminaire *l, const char *title) {
    char *text = NULL;
    size_t length = 0;
    lam_error error = {0};
    FILE *stream = open_memstream(&text, &length);
    if (title != NULL)
        ck_ok(polar_curves_svg(l, title, stream, &error));
    else
        ck_ok(polar_curves_csv(l, stream, &error));
    fclose(stream);
    return text;
}

START_TEST(tables) {
    static const struct {
        const char *text, *wanted;
    } rows[] = {
        {"TILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n8 2\n", "gamma [degrees],C0 [cd]\n0,8\n90,2\n"},
        {"TILT=NONE\n1 -1 1 2 3 1 2 0 0 0\n1 1 1\n0 90\n0 30 90\n1 2 3 4 5 6\n",
         "gamma [degrees],C0 [cd],C30 [cd],C90 [cd],C150 [cd],C180 [cd],C210 [cd],C270 [cd],C330 [cd]\n"
         "0,1,3,5,3,1,3,5,3\n90,2,4,6,4,2,4,6,4\n"},
        {"TILT=NONE\n1 -1 1 2 3 1 2 0 0 0\n1 1 1\n0 90\n0 45 180\n1 2 3 4 5 6\n",
         "gamma [degrees],C0 [cd],C45 [cd],C180 [cd],C315 [cd]\n0,1,3,5,3\n90,2,4,6,4\n"},
        {"TILT=NONE\n1 -1 1 2 3 1 2 0 0 0\n1 1 1\n0 90\n90 100 270\n1 2 3 4 5 6\n",
         "gamma [degrees],C80 [cd],C90 [cd],C100 [cd],C270 [cd]\n0,3,1,3,5\n90,4,2,4,6\n"},
        {"TILT=NONE\n1 -1 1 2 3 1 2 0 0 0\n1 1 1\n0 90\n0 180 360\n1 2 3 4 5 6\n", NULL},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        luminaire l = must_read(rows[k].text);
        char *text = written(&l, NULL);
        if (rows[k].wanted != NULL)
            ck_assert_str_eq(text, rows[k].wanted);
        else
            ck_assert_ptr_nonnull(
                strstr(text, "gamma [degrees],C0 [cd],C180 [cd]\n0,")); /* 360 is 0 once more */
        free(text);
        luminaire_free(&l);
    }
    luminaire l = must_read("TILT=NONE\n1 -1 1 2 2 2 2 0 0 0\n1 1 1\n-90 90\n-90 90\n1 1 1 1\n");
    char *text = written(&l, NULL);
    ck_assert_ptr_nonnull(strstr(text, ",C345 [cd]\n0,1,"));
    ck_assert_ptr_nonnull(strstr(text, "\n180,0,"));
    free(text);
    luminaire_free(&l);
}
END_TEST

static size_t count_of(const char *text, const char *word) {
    size_t n = 0;
    for (const char *at = text; (at = strstr(at, word)) != NULL; at++) n++;
    return n;
}

START_TEST(pictures) {
    luminaire l = must_read("TILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 1\n0 45 90\n0\n100 100 0\n");
    char *text = written(&l, "<a href=\"x\"> & \x1b b \xfc \xc3\xbc \xef\xbf\xbf");
    ck_assert_ptr_nonnull(strstr(text, ">&lt;a href=\"x\"&gt; &amp; ? b ? \xc3\xbc ?</text>"));
    ck_assert_uint_eq(count_of(text, "stroke-dasharray"), 0);
    ck_assert_ptr_nonnull(strstr(text, ">all planes</text>"));
    /* 100 cd straight down, where the largest circle is; the same at 45 degrees to both sides. */
    ck_assert_ptr_nonnull(strstr(text, "124.44,455.56 280.00,520.00 280.00,520.00 435.56,455.56 "));
    ck_assert_ptr_nonnull(strstr(text, "at most 100 cd"));
    free(text);
    luminaire_free(&l);
    l = must_read("TILT=NONE\n1 -1 1 2 2 1 2 0 0 0\n1 1 1\n0 90\n0 90\n0 0 0 0\n"); /* dark */
    text = written(&l, "");
    ck_assert_uint_eq(count_of(text, "stroke-dasharray"), 2);
    ck_assert_uint_eq(count_of(text, "nan") + count_of(text, "inf"), 0);
    free(text);
    luminaire_free(&l);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("polar_curves");
    TCase *tests = tcase_create("all");
    tcase_add_test(tests, tables);
    tcase_add_test(tests, pictures);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
