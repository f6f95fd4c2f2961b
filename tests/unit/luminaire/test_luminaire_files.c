/* Luminaires read from files by the process without rights: what it may open, and what comes back. */
#include "solver/luminaire/luminaire_child.h"
#include "support/scene.h"

#include <math.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define TILT_TABLE "1\n3\n0 45 90\n1 .9 .8\n"
#define NUMBERS "1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 50 0\n"

/* A folder with the folders a and b, in which the files are. */
static char folder[64];

static void setup(void) {
    char path[128];
    folder_make(folder);
    snprintf(path, sizeof path, "%s/a", folder);
    ck_assert_int_eq(mkdir(path, 0700), 0);
    snprintf(path, sizeof path, "%s/b", folder);
    ck_assert_int_eq(mkdir(path, 0700), 0);
}

static void teardown(void) {
    folder_remove(folder);
}

/* The path of a file of the folder, with this content unless that is NULL. */
static const char *file(const char *name, const char *text) {
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (text != NULL) file_write(folder, name, text, path);
    return path;
}

static lam_status read_with(const char *path, const char *assets, luminaire *l, lam_error *error) {
    const luminaire_options options = {.assets = assets};
    return luminaire_read(path, &options, l, error);
}

static void refused(const char *path, lam_status status, const char *wanted) {
    lam_error error = {0};
    luminaire l = {0};
    ck_assert_int_eq(read_with(path, NULL, &l, &error), status);
    ck_assert_msg(strstr(error.message, wanted) != NULL, "'%s' does not say '%s'", error.message, wanted);
    ck_assert_ptr_null(l.candela);
}

START_TEST(all_of_it_comes_back) {
    lam_error error = {0};
    luminaire l = {0}, same = {0};
    const char text[] =
        "IESNA:LM-63-2002\n[MANUFAC] M\xfcller\n[LAMP] T16\nTILT=INCLUDE\n" TILT_TABLE
        "2 1000 2 3 4 1 1 -1 0 0\n1 1 10\n0 45 80\n0 90 180 270\n1 2 3 4 5 6 7 8 9 10 11 12\n";
    const luminaire_options options = {.set = 1};
    ck_ok(luminaire_read(file("all.ies", text), &options, &l, &error));
    ck_ok(luminaire_read_text("all.ies", text, strlen(text), &options, &same, &error));
    ck_assert(l.n_planes == 5 && l.n_angles == 3 && l.tilt.n == 3 && l.n_sets == 1 && l.n_words == 2);
    ck_assert_mem_eq(l.candela, same.candela, 15 * sizeof *l.candela);
    ck_assert_mem_eq(l.planes, same.planes, 5 * sizeof *l.planes);
    ck_assert_mem_eq(l.angles, same.angles, 3 * sizeof *l.angles);
    ck_assert_mem_eq(l.tilt.angles, same.tilt.angles, 3 * sizeof *l.tilt.angles);
    ck_assert_mem_eq(l.tilt.factors, same.tilt.factors, 3 * sizeof *l.tilt.factors);
    ck_assert_str_eq(luminaire_find_word(&l, "MANUFAC"), "M\xc3\xbcller");
    ck_assert_str_eq(l.sets[0].type, "T16");
    ck_assert_str_eq(l.warnings.text, same.warnings.text);
    ck_assert_int_eq(l.opening.shape, OPENING_DISC);
    ck_assert(!l.absolute && l.format == LM63_2002 && isnan(l.output_ratio));
    luminaire_free(&l);
    luminaire_free(&same);
}
END_TEST

START_TEST(files_that_cannot_be_read) {
    char large[256];
    refused(file("none.ies", NULL), LAM_ERR_IO, "none.ies: cannot read: No such file");
    refused(folder, LAM_ERR_IO, "not a file");
    refused("/dev/zero", LAM_ERR_IO, "/dev/zero: not a file");
    refused(file("empty.ies", ""), LAM_ERR_FORMAT, "empty.ies: the file is empty");
    refused(file("bad.ies", "IESNA91\nTILT=NONE\n1 -1 x"), LAM_ERR_FORMAT,
            "bad.ies: line 3, column 6: candela multiplier = x");
    snprintf(large, sizeof large, "%s", file("large.ldt", "a"));
    ck_assert_int_eq(truncate(large, 50000000), 0);
    refused(large, LAM_ERR_FORMAT, "has 50000000 bytes, more than the 16 MiB");
}
END_TEST

START_TEST(files_of_tilt) {
    char path[256], assets[128];
    lam_error error = {0};
    luminaire l = {0};
    snprintf(path, sizeof path, "%s", file("a/l.ies", "IESNA:LM-63-1995\nTILT=t.tlt\n" NUMBERS));
    snprintf(assets, sizeof assets, "%s/b", folder);
    refused(path, LAM_ERR_FORMAT,
            "l.ies: line 2: TILT=t.tlt is not there: put it beside the file, or name its folder by --assets");
    file("b/t.tlt", TILT_TABLE);
    ck_ok(read_with(path, assets, &l, &error));
    ck_assert(l.tilt.n == 3 && l.tilt.geometry == 1 && l.tilt.factors[1] == .9);
    luminaire_free(&l);
    file("a/T.TLT", TILT_TABLE "\r\n");
    ck_ok(read_with(path, NULL, &l, &error)); /* names of other systems differ by capitals */
    luminaire_free(&l);
    file("a/t.tlt", TILT_TABLE "7");
    refused(path, LAM_ERR_FORMAT, "t.tlt: line 5, column 1: a word behind the last tilt factor = 7");
    file("a/t.tlt", "1\n3\n0 45 90\n1 .9");
    refused(path, LAM_ERR_FORMAT, "t.tlt: ends at line 4, before the tilt factor");
    snprintf(path, sizeof path, "%s", file("a/l.ies", "IESNA:LM-63-1995\nTILT=../b/t.tlt\n" NUMBERS));
    refused(path, LAM_ERR_FORMAT,
            "TILT=../b/t.tlt lies outside of the file's folder; --assets with its folder lets it be read");
    ck_ok(read_with(path, assets, &l, &error));
    luminaire_free(&l);
    snprintf(path, sizeof path, "%s", file("a/l.ies", "IESNA:LM-63-1995\nTILT=/etc/passwd\n" NUMBERS));
    refused(path, LAM_ERR_FORMAT, "TILT=/etc/passwd lies outside");
    file("a/U.tlt", TILT_TABLE), file("a/u.TLT", TILT_TABLE);
    snprintf(path, sizeof path, "%s", file("a/l.ies", "IESNA:LM-63-1995\nTILT=u.tlt\n" NUMBERS));
    refused(path, LAM_ERR_FORMAT, "line 2: TILT=u.tlt may be either of");
    snprintf(path, sizeof path, "%s", file("a/l.ies", "IESNA:LM-63-1995\nTILT=d\n" NUMBERS));
    ck_assert_int_eq(mkdir(file("a/d", NULL), 0700), 0);
    refused(path, LAM_ERR_FORMAT, "line 2: TILT=d is not a file");
}
END_TEST

/* Bytes that a child sends in the place of a reply. */
typedef struct sent {
    unsigned char *bytes;
    size_t length;
} sent;

static void send_bytes(void *context) {
    const sent *s = context;
    (void)confined_send(CONFINED_REPLY, s->bytes, s->length);
}

/* A sound reply; the caller frees its bytes. */
static sent make_reply(void) {
    const luminaire_options options = {.set = 0};
    const char text[] = "IESNA91\n[A] b\nTILT=INCLUDE\n" TILT_TABLE NUMBERS;
    lam_error error = {.message = ""};
    luminaire l = {0};
    char path[64];
    ck_ok(luminaire_read_text("a.ies", text, strlen(text), &options, &l, &error));
    snprintf(path, sizeof path, "/tmp/test-XXXXXX");
    const int fd = mkstemp(path);
    ck_assert(luminaire_send(fd, LAM_OK, &error, &l));
    sent s = {.length = (size_t)lseek(fd, 0, SEEK_END)};
    s.bytes = malloc(s.length);
    ck_assert_int_eq(pread(fd, s.bytes, s.length, 0), (ssize_t)s.length);
    close(fd);
    unlink(path);
    luminaire_free(&l);
    return s;
}

START_TEST(replies_that_are_damaged) {
    sent s = make_reply();
    const size_t length = s.length;
    lam_error error = {0};
    luminaire l = {0};
    ck_ok(luminaire_receive(send_bytes, &s, "a", &l, &error));
    ck_assert(l.n_angles == 3 && l.tilt.n == 3 && l.n_words == 1);
    luminaire_free(&l);
    for (s.length = 0; s.length < length; s.length += 97) {
        ck_assert_int_eq(luminaire_receive(send_bytes, &s, "a", &l, &error), LAM_ERR_FORMAT);
        ck_assert_msg(strstr(error.message, "ended without an answer") != NULL, "%s", error.message);
    }
    /* Bytes of ones: counts that are too large, texts without an end, numbers that are none. */
    s.length = length;
    for (size_t at = 0; at + 8 <= length; at += 8) {
        unsigned char kept[8];
        memcpy(kept, s.bytes + at, sizeof kept);
        memset(s.bytes + at, 0xFF, sizeof kept);
        const lam_status status = luminaire_receive(send_bytes, &s, "a", &l, &error);
        if (status == LAM_OK) ck_assert(luminaire_is_sound(&l)); /* a pointer, or a byte that nothing reads */
        if (status == LAM_OK) luminaire_free(&l);
        memcpy(s.bytes + at, kept, sizeof kept);
        if (at > 600 && at + 2400 < length) at += 480; /* long texts */
    }
    free(s.bytes);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("luminaire_files");
    TCase *tests = tcase_create("all");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, all_of_it_comes_back);
    tcase_add_test(tests, files_that_cannot_be_read);
    tcase_add_test(tests, files_of_tilt);
    tcase_add_test(tests, replies_that_are_damaged);
    tcase_set_timeout(tests, 120);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
