/* The peer that asks: sockets, proxies that are believed and those that are not, and texts that nobody should
 * write. */
#include "server/net/peer.h"
#include "support/suite.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <string.h>

static peer_rules rules_of(const char *const *texts) {
    option_list list = {.count = 0};
    peer_rules rules;
    lam_error error;
    while (texts[list.count] != NULL) {
        list.items[list.count] = texts[list.count];
        list.count++;
    }
    ck_ok(peer_rules_read(&list, &rules, &error));
    return rules;
}

/* The peer of a socket address ("unix" for none) with fields of a head: name and value in turn. */
static peer ask(const peer_rules *rules, const char *from, const char *const *fields) {
    struct sockaddr_in four = {.sin_family = AF_INET};
    struct sockaddr_in6 six = {.sin6_family = AF_INET6};
    const struct sockaddr *address = NULL;
    peer_fields found = {.n_forwarded = 0};
    peer who;
    if (inet_pton(AF_INET, from, &four.sin_addr) == 1) address = (const struct sockaddr *)(const void *)&four;
    if (inet_pton(AF_INET6, from, &six.sin6_addr) == 1) address = (const struct sockaddr *)(const void *)&six;
    ck_assert((address == NULL) == (strcmp(from, "unix") == 0));
    for (; fields != NULL && *fields != NULL; fields += 2)
        peer_add_field(&found, fields[0], strlen(fields[0]), fields[1], strlen(fields[1]));
    memset(&who, 'x', sizeof who);
    peer_find(rules, address, &found, &who);
    return who;
}

static void expect(const peer_rules *rules, const char *from, const char *name, const char *value,
                   const char *wanted) {
    const char *const fields[] = {name, value, NULL};
    const peer who = ask(rules, from, fields);
    ck_assert_msg(strcmp(who.text, wanted) == 0, "%s with %s: %s is %s, must be %s", from, name, value,
                  who.text, wanted);
}

/* The paper's appendix A: the key 0 to 15, the text 0 to 14. */
START_TEST(the_hash_is_siphash) {
    const uint64_t seed[2] = {0x0706050403020100u, 0x0f0e0d0c0b0a0908u};
    unsigned char text[15];
    for (size_t i = 0; i < sizeof text; i++) text[i] = (unsigned char)i;
    ck_assert_uint_eq(peer_hash(seed, text, sizeof text), 0xa129ca6149be45e5u);
    ck_assert_uint_eq(peer_hash(seed, text, 0), 0x726fdb47dd0e0e31u);
}
END_TEST

START_TEST(sockets) {
    static const char *const none[] = {NULL};
    const peer_rules rules = rules_of(none), other = rules_of(none);
    const peer four = ask(&rules, "192.0.2.7", NULL), old = ask(&rules, "::ffff:192.0.2.7", NULL),
               six = ask(&rules, "2001:db8:0:1::5", NULL), near = ask(&rules, "2001:db8:0:1:ffff::", NULL),
               far = ask(&rules, "2001:db8:0:2::5", NULL), local = ask(&rules, "unix", NULL);
    ck_assert_str_eq(four.text, "192.0.2.7");
    ck_assert_str_eq(old.text, "192.0.2.7");
    ck_assert_uint_eq(old.key, four.key);
    ck_assert_str_eq(six.text, "2001:db8:0:1::5");
    ck_assert_str_eq(near.text, "2001:db8:0:1:ffff::");
    ck_assert_uint_eq(six.key, near.key);
    ck_assert_uint_ne(six.key, far.key);
    ck_assert_str_eq(local.text, "unix");
    ck_assert_uint_ne(local.key, four.key);
    ck_assert_uint_ne(ask(&rules, "192.0.2.8", NULL).key, four.key);
    /* The seed is another one each time. */
    ck_assert_uint_ne(ask(&other, "192.0.2.7", NULL).key, four.key);
}
END_TEST

START_TEST(nobody_is_believed_unless_trusted) {
    static const char *const none[] = {NULL}, *const one[] = {"192.0.2.1", "2001:db8::/32", "10.0.0.0/9",
                                                              NULL};
    const peer_rules nobody = rules_of(none), rules = rules_of(one);
    expect(&nobody, "192.0.2.1", "X-Forwarded-For", "198.51.100.1", "192.0.2.1");
    expect(&nobody, "unix", "Forwarded", "for=198.51.100.1", "unix");
    expect(&rules, "192.0.2.2", "X-Forwarded-For", "198.51.100.1", "192.0.2.2");
    expect(&rules, "unix", "X-Forwarded-For", "198.51.100.1", "unix");
    expect(&rules, "192.0.2.1", "X-Forwarded-For", "198.51.100.1", "198.51.100.1");
    expect(&rules, "::ffff:192.0.2.1", "x-forwarded-for", "198.51.100.1", "198.51.100.1");
    expect(&rules, "2001:db8:7::1", "Forwarded", "For=198.51.100.1", "198.51.100.1");
    expect(&rules, "10.127.0.1", "X-Forwarded-For", "198.51.100.1", "198.51.100.1");
    expect(&rules, "10.128.0.1", "X-Forwarded-For", "198.51.100.1", "10.128.0.1");
    expect(&rules, "192.0.2.1", "X-Forwarded", "198.51.100.1", "192.0.2.1");
}
END_TEST

START_TEST(the_last_hop_that_is_no_proxy) {
    static const char *const some[] = {"unix", "10.0.0.0/8", NULL};
    const peer_rules rules = rules_of(some);
    const char *const lines[] = {"X-Forwarded-For", "203.0.113.9", "X-Forwarded-For",
                                 "198.51.100.1, 10.0.0.2", NULL};
    /* The client wrote the first one itself. */
    expect(&rules, "unix", "X-Forwarded-For", "203.0.113.9, 198.51.100.1, 10.0.0.2", "198.51.100.1");
    ck_assert_str_eq(ask(&rules, "10.0.0.3", lines).text, "198.51.100.1");
    expect(
        &rules, "unix", "Forwarded",
        "for=203.0.113.9;proto=http, For=\"198.51.100.1:4711\";by=10.0.0.9;host=\"a\\\",b\" , for=10.0.0.2",
        "198.51.100.1");
    /* All are proxies: the first of them asks. */
    expect(&rules, "unix", "X-Forwarded-For", "10.0.0.1,,10.0.0.2", "10.0.0.1");
    expect(&rules, "unix", "X-Forwarded-For", " ", "unix");
    expect(&rules, "10.0.0.1", "Forwarded", "proto=https", "10.0.0.1");
    expect(&rules, "10.0.0.1", "Forwarded", "for=198.51.100.1, for=unknown", "10.0.0.1");
}
END_TEST

START_TEST(nodes) {
    static const char *const some[] = {"unix", NULL};
    const peer_rules rules = rules_of(some);
    expect(&rules, "unix", "Forwarded", "for=\"[2001:db8::17]:80\"", "2001:db8::17");
    expect(&rules, "unix", "Forwarded", "for=\"[2001:db8::17]\"", "2001:db8::17");
    expect(&rules, "unix", "X-Forwarded-For", "2001:db8::17", "2001:db8::17");
    expect(&rules, "unix", "X-Forwarded-For", "192.0.2.4:80", "192.0.2.4");
    expect(&rules, "unix", "Forwarded", "for=_gazonk", "_gazonk");
    ck_assert_uint_ne(ask(&rules, "unix", (const char *[]){"Forwarded", "for=_a", NULL}).key,
                      ask(&rules, "unix", (const char *[]){"Forwarded", "for=_b", NULL}).key);
    static const char *const bad[] = {
        "localhost", "1.2.3", "[192.0.2.1]", "192.0.2.1:", "192.0.2.1:x", "[::1",
        "[::1]x",    "_",     "_a b",        "_\x01",      "::1:::",      "192.0.2.1:123456"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        char text[96];
        snprintf(text, sizeof text, "198.51.100.1, %s", bad[i]);
        expect(&rules, "unix", "X-Forwarded-For", text, "unix");
        snprintf(text, sizeof text, "for=198.51.100.1, for=\"%s\"", bad[i]);
        expect(&rules, "unix", "Forwarded", text, "unix");
    }
    static const char *const broken[] = {
        "for",          "for=\"192.0.2.1",  "for=192.0.2.1;for=192.0.2.2", "for=\"192.0.2.1\\",
        "=192.0.2.1 x", "for=192.0.2.1, \""};
    for (size_t i = 0; i < sizeof broken / sizeof broken[0]; i++)
        expect(&rules, "unix", "Forwarded", broken[i], "unix");
}
END_TEST

/* A proxy writes one of the fields and passes the other one on, which the client may have written. */
START_TEST(fields_that_disagree) {
    static const char *const some[] = {"unix", NULL};
    const peer_rules rules = rules_of(some);
    const char *const two[] = {"Forwarded", "for=192.0.2.1", "X-Forwarded-For", "192.0.2.2", NULL},
                      *const same[] = {"Forwarded", "for=192.0.2.1", "X-Forwarded-For", "192.0.2.1", NULL};
    ck_assert_str_eq(ask(&rules, "unix", two).text, "unix");
    ck_assert_str_eq(ask(&rules, "unix", same).text, "192.0.2.1");
    const char *many[2 * 9 + 1] = {NULL};
    for (size_t i = 0; i < 9; i++) {
        ck_assert_str_eq(ask(&rules, "unix", many).text, i == 0 ? "unix" : "192.0.2.1");
        many[2 * i] = "X-Forwarded-For";
        many[2 * i + 1] = "192.0.2.1";
    }
    ck_assert_str_eq(ask(&rules, "unix", many).text, "unix");
}
END_TEST

/* More hops than are kept: the last ones count. */
START_TEST(a_long_list) {
    static const char *const some[] = {"unix", "10.0.0.0/8", NULL};
    const peer_rules rules = rules_of(some);
    char text[2048] = "192.0.2.1";
    for (size_t i = 0; i < 40; i++) strcat(text, ",10.0.0.1");
    expect(&rules, "unix", "X-Forwarded-For", text, "10.0.0.1");
    strcat(text, ",192.0.2.2,10.0.0.5");
    expect(&rules, "unix", "X-Forwarded-For", text, "192.0.2.2");
}
END_TEST

START_TEST(rules_that_cannot_be_read) {
    static const char *const bad[] = {"",       "x",           "10.0.0.0/33", "10.0.0.0/",
                                      "::/129", "10.0.0.1:80", "unix/3/",     "localhost"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        option_list list = {.items = {bad[i]}, .count = 1};
        peer_rules rules;
        lam_error error;
        ck_assert_int_eq(peer_rules_read(&list, &rules, &error), LAM_ERR_ARGUMENT);
        ck_assert_msg(strncmp(error.message, "--trusted-proxy", 15) == 0, "%s", error.message);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("peer");
    TCase *tests = tcase_create("peer");
    tcase_add_test(tests, the_hash_is_siphash);
    tcase_add_test(tests, sockets);
    tcase_add_test(tests, nobody_is_believed_unless_trusted);
    tcase_add_test(tests, the_last_hop_that_is_no_proxy);
    tcase_add_test(tests, nodes);
    tcase_add_test(tests, fields_that_disagree);
    tcase_add_test(tests, a_long_list);
    tcase_add_test(tests, rules_that_cannot_be_read);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
