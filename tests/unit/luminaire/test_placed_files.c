/* Lists of luminaires and the files that they name. */
#include "solver/luminaire/placed.h"
#include "support/scene.h"

#include <math.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

static const char *file(const char *name, const char *text) {
    static char path[256];
    file_write(folder, name, text, path);
    return path;
}

/* 100 cd below, so 200 pi lm, of an opening of 1 x 1 m. */
#define EVEN "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 1 1 0\n1 1 10\n0 90\n0\n100 100\n"
#define DARK "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n0 0\n"

static void refused_file(const char *text, const char *assets, const char *wanted) {
    const placed_options options = {.assets = assets};
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    ck_assert(placed_read(file("l.json", text), &options, &p, &error) != LAM_OK);
    ck_assert_msg(strstr(error.message, wanted) != NULL, "'%s' does not say '%s'", error.message, wanted);
    ck_assert(p.luminaires == NULL && p.files == NULL);
}

#define ONE(more) "{\"luminaires\": [{\"name\": \"a\", \"at\": [0, 0, 0], " more "}]}"

START_TEST(files_are_read_once) {
    const placed_options options = {.assets = NULL};
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    file("f.ies", EVEN);
    ck_ok(placed_read(
        file("l.json",
             "{\"files\": {\"even\": \"f.ies\", \"other\": \"g.ies\"}, \"luminaires\": ["
             "{\"name\": \"a\", \"file\": \"even\", \"at\": [0, 0, 0], \"flux\": 1000, \"dim\": 0.5},"
             "{\"name\": \"b\", \"file\": \"./f.ies\", \"at\": [0, 0, 0]},"
             "{\"name\": \"c\", \"file\": \"F.IES\", \"lamp_set\": 1, \"at\": [0, 0, 0]},"
             "{\"name\": \"d\", \"file\": \"./f.ies\", \"lamp_set\": 1, \"at\": [0, 0, 0]}]}"),
        &options, &p, &error));
    ck_assert(p.n_files == 2 && p.luminaires[0].file == 0 && p.luminaires[1].file == 0 &&
              p.luminaires[2].file == 1 && p.luminaires[3].file == 1);
    ck_assert_double_eq_tol(p.files[0].lumens, 200 * M_PI, 1e-9);
    ck_assert_double_eq_tol(placed_lumens(&p, &p.luminaires[0]), 500, 1e-9);
    ck_assert_double_eq_tol(placed_lumens(&p, &p.luminaires[1]), 200 * M_PI, 1e-9);
    ck_assert_int_eq(p.files[0].photometry.opening.shape, OPENING_RECTANGLE);
    ck_assert_str_eq(p.warnings.text, "no luminaire has the file other");
    placed_free(&p);
}
END_TEST

START_TEST(files_that_are_wrong) {
    char path[128];
    file("f.ies", EVEN), file("dark.ies", DARK), file("bad.ies", "IESNA91\nTILT=NONE\n1 -1 x");
    refused_file(
        ONE("\"file\": \"none.ies\""), NULL,
        "l.json: luminaires[0]: file none.ies is not there: put it beside the list, or name its folder by");
    refused_file(ONE("\"file\": \"/etc/passwd\""), NULL,
                 "file /etc/passwd lies outside of the list's folder");
    refused_file(ONE("\"file\": \"bad.ies\""), NULL, "bad.ies: line 3, column 6: candela multiplier = x");
    refused_file(ONE("\"file\": \"f.ies\", \"lamp_set\": 2"), NULL,
                 "l.json: luminaires[0]: lamp_set = 2: an IES LM-63 has one lamp set");
    refused_file(ONE("\"file\": \"dark.ies\", \"flux\": 9"), NULL,
                 "luminaires[0]: flux = 9, but all candela of dark.ies are 0");
    file("g.ies", EVEN), file("G.ies", EVEN);
    refused_file(ONE("\"file\": \"g.IES\""), NULL, "file g.IES may be either of");
    snprintf(path, sizeof path, "%s/assets", folder);
    ck_assert_int_eq(mkdir(path, 0700), 0);
    file("assets/h.ies", EVEN);
    refused_file(ONE("\"file\": \"h.ies\""), NULL, "file h.ies is not there");
    const placed_options options = {.assets = path};
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    ck_ok(placed_read(file("l.json", ONE("\"file\": \"h.ies\"")), &options, &p, &error));
    placed_free(&p);
    ck_assert_int_eq(placed_read("/no/such/l.json", &options, &p, &error), LAM_ERR_IO);
}
END_TEST

START_TEST(content_tells_lists_from_luminaires) {
    static const struct {
        const char *name, *text;
        bool is_list;
    } files[] = {{"a.ies", EVEN, false},
                 {"a.json", EVEN, false},
                 {"a.csv", EVEN, false},
                 {"a.ies", " {\"luminaires\": []}", true},
                 {"a", "\xef\xbb\xbf[\n{}]", true},
                 {"a.ies", "[TEST] x\n{\n", false},
                 {"a.ies", "{a company}\nTILT=NONE\n1\n", false},
                 {"a.ldt", "file;name;x;y;z\n", true},
                 {"a.txt", "name, file, X\n", true},
                 {"a.txt", "name, file\n", false},
                 {"a.csv", "name, file\n", true},
                 {"a.json", "luminaires\n", true},
                 {"a.json", "", false},
                 {"a.csv", "a\n1\n1\n1\n0\n2\n90\n", false}};
    for (size_t k = 0; k < sizeof files / sizeof *files; k++)
        ck_assert_msg(placed_is_list(file(files[k].name, files[k].text)) == files[k].is_list, "%s: %s",
                      files[k].name, files[k].text);
    ck_assert(!placed_is_list(folder) && !placed_is_list("/no/such/file"));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("placed_files");
    TCase *tests = tcase_create("all");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, files_are_read_once);
    tcase_add_test(tests, files_that_are_wrong);
    tcase_add_test(tests, content_tells_lists_from_luminaires);
    tcase_set_timeout(tests, 120);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
