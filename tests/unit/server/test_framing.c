/* The faults of heads, on any bytes: also those that libmicrohttpd does not hand over today. */
#include "server/http/framing.h"
#include "support/suite.h"

#include <string.h>

static void add(framing *f, const char *name, const char *value) {
    framing_add(f, name, strlen(name), value, strlen(value));
}

static unsigned status_of(const framing *f, const char *version) {
    problem why;
    const bool good = framing_check(f, version, &why);
    ck_assert(good == (why.status == 0));
    ck_assert(good || why.detail[0] != '\0');
    return why.status;
}

START_TEST(good_heads_pass) {
    framing f = {0};
    ck_assert_uint_eq(status_of(&f, "HTTP/1.0"), 0);
    ck_assert_uint_eq(status_of(&f, "HTTP/1.1"), 400);
    add(&f, "hOST", "");
    framing_add(&f, "X", 1, NULL, 3);
    add(&f, "X", "a\tb\xc3\xa9");
    ck_assert_uint_eq(status_of(&f, "HTTP/1.1"), 0);
    framing coded = f;
    add(&f, "Content-Length", "7");
    ck_assert_uint_eq(status_of(&f, "HTTP/1.1"), 0);
    add(&coded, "Transfer-Encoding", "CHUNKED");
    ck_assert_uint_eq(status_of(&coded, "HTTP/1.1"), 0);
    ck_assert_uint_eq(status_of(&coded, "HTTP/1.0"), 400);
    add(&coded, "Content-Length", "7");
    ck_assert_uint_eq(status_of(&coded, "HTTP/1.1"), 400);
}
END_TEST

/* Every byte, alone in a name and in a value of its exact length. */
START_TEST(bytes) {
    static const char signs[] = "!#$%&'*+-.^_`|~";
    for (int byte = 0; byte < 256; byte++) {
        const char c = (char)byte;
        const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        framing name = {.n_hosts = 1}, value = {.n_hosts = 1};
        framing_add(&name, &c, 1, "v", 1);
        ck_assert_uint_eq(status_of(&name, "HTTP/1.1"),
                          letter || (byte != 0 && strchr(signs, c) != NULL) ? 0 : 400);
        framing_add(&value, "X", 1, &c, 1);
        ck_assert_uint_eq(status_of(&value, "HTTP/1.1"),
                          (byte < 32 && byte != '\t') || byte == 127 ? 400 : 0);
    }
    framing none = {.n_hosts = 1};
    framing_add(&none, "", 0, "v", 1);
    ck_assert_uint_eq(status_of(&none, "HTTP/1.1"), 400);
}
END_TEST

START_TEST(other_codings) {
    static const char *const codings[] = {"", "identity", "gzip, chunked", "chunked ", "chunke", "chunkedd"};
    for (size_t i = 0; i < sizeof codings / sizeof codings[0]; i++) {
        framing f = {.n_hosts = 1};
        add(&f, "transfer-encoding", codings[i]);
        ck_assert_uint_eq(status_of(&f, "HTTP/1.1"), 501);
    }
}
END_TEST

START_TEST(paths) {
    static const char *const cases[][2] = {{"/a", "/a"},
                                           {"", ""},
                                           {"*", "*"},
                                           {"http://h/a", "/a"},
                                           {"HTTPS://h:1//a", "//a"},
                                           {"http://h", "/"},
                                           {"http:///a", "http:///a"},
                                           {"http:/", "http:/"},
                                           {"ftp://h/a", "ftp://h/a"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        ck_assert_str_eq(framing_path(cases[i][0]), cases[i][1]);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("framing");
    TCase *all = tcase_create("all");
    tcase_add_test(all, good_heads_pass);
    tcase_add_test(all, bytes);
    tcase_add_test(all, other_codings);
    tcase_add_test(all, paths);
    suite_add_tcase(suite, all);
    return suite_run(suite);
}
