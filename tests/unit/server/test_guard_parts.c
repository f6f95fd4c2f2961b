/* The rules by which the daemon tells connections, answers and requests apart: who is cut and who is not,
 * entity tags, request ids. */
#include "server/http/http_fields.h"
#include "server/net/descriptors.h"
#include "solver/base/clock.h"
#include "store/store.h"
#include "support/suite.h"

#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

typedef struct pair {
    int ours, theirs;
    client *c;
} pair;

static pair open_pair(connections *all, uint64_t key) {
    int fds[2];
    ck_assert_int_eq(socketpair(AF_UNIX, SOCK_STREAM, 0, fds), 0);
    pair p = {fds[0], fds[1], connections_add(all, fds[0], key, true)};
    ck_assert_ptr_nonnull(p.c);
    return p;
}

/* True where the client sees an end, now. */
static bool is_cut(const pair *p) {
    char byte;
    return recv(p->theirs, &byte, 1, MSG_DONTWAIT) == 0;
}

static void wait_cut(const pair *p) {
    char byte;
    ck_assert_int_eq(recv(p->theirs, &byte, 1, 0), 0);
}

static void close_pair(connections *all, pair *p) {
    connections_remove(all, p->c);
    close(p->ours);
    close(p->theirs);
}

static connections *start_with(size_t most, size_t timeout_s, size_t keep_alive_s, size_t least_rate) {
    connections *all = NULL;
    lam_error error;
    const connection_limits limits = {.wanted = most,
                                      .most = most,
                                      .beyond = 8,
                                      .timeout_s = timeout_s,
                                      .keep_alive_s = keep_alive_s,
                                      .least_rate = least_rate};
    ck_assert_int_eq(connections_start(&limits, &all, &error), LAM_OK);
    return all;
}

static connections *start(size_t most, size_t timeout_s, size_t least_rate) {
    return start_with(most, timeout_s, 3600, least_rate);
}

static void expect_count(connections *all, const char *line) {
    buffer b = {0};
    ck_assert(connections_write(all, &b));
    ck_assert_msg(strstr(b.bytes, line) != NULL, "%s is not in\n%s", line, b.bytes);
    buffer_free(&b);
}

/* The test waits for connections in the order in which they are cut; those that are never cut are looked at
 * when all others are. */
START_TEST(each_stage_has_its_time) {
    connections *all = start(100, 1, 1 << 10);
    pair head = open_pair(all, 0), body = open_pair(all, 0), solve = open_pair(all, 0),
         quick = open_pair(all, 0), large = open_pair(all, 0), next = open_pair(all, 0);
    client_enter(all, body.c, STAGE_BODY, 0);
    client_enter(all, solve.c, STAGE_SOLVE, 0);
    /* A MiB has come, at the least rate the bytes of 1024 seconds: they are worth a time-out all the same. */
    client_enter(all, quick.c, STAGE_BODY, 0);
    client_received(all, quick.c, 1 << 20);
    client_enter(all, large.c, STAGE_ANSWER, 100);
    client_enter(all, next.c, STAGE_SOLVE, 0);
    wait_cut(&head);
    wait_cut(&body);
    wait_cut(&large);
    wait_cut(&quick);
    ck_assert(!is_cut(&solve));
    /* The time of a stage begins with it: this one has just entered. */
    client_enter(all, next.c, STAGE_HEAD, 0);
    ck_assert(!is_cut(&next));
    wait_cut(&next);
    ck_assert(!is_cut(&solve));
    expect_count(all, "\nlambertd_connections 6\n");
    expect_count(all, "_cut_total{why=\"head\"} 2\n");
    expect_count(all, "_cut_total{why=\"body\"} 2\n");
    expect_count(all, "_cut_total{why=\"answer\"} 1\n");
    pair *every[] = {&head, &body, &solve, &quick, &large, &next};
    for (size_t i = 0; i < sizeof every / sizeof every[0]; i++) close_pair(all, every[i]);
    expect_count(all, "\nlambertd_connections 0\n");
    connections_stop(all);
}
END_TEST

/* Between two requests the time is another one than within them. */
START_TEST(idle_connections_have_a_time_of_their_own) {
    connections *patient = start_with(10, 1, 3600, 1), *brief = start_with(10, 3600, 1, 1);
    pair idle = open_pair(patient, 0), begun = open_pair(patient, 0), done = open_pair(brief, 0),
         next = open_pair(brief, 0);
    client_enter(patient, idle.c, STAGE_IDLE, 0);
    client_enter(patient, begun.c, STAGE_IDLE, 0);
    client_enter(patient, begun.c, STAGE_HEAD, 0);
    client_enter(brief, done.c, STAGE_IDLE, 0);
    client_enter(brief, next.c, STAGE_IDLE, 0);
    client_enter(brief, next.c, STAGE_HEAD, 0);
    wait_cut(&begun);
    wait_cut(&done);
    ck_assert(!is_cut(&idle) && !is_cut(&next));
    expect_count(patient, "_cut_total{why=\"head\"} 1\n");
    expect_count(patient, "_cut_total{why=\"idle\"} 0\n");
    expect_count(brief, "_cut_total{why=\"idle\"} 1\n");
    close_pair(patient, &idle);
    close_pair(patient, &begun);
    close_pair(brief, &done);
    close_pair(brief, &next);
    connections_stop(patient);
    connections_stop(brief);
}
END_TEST

START_TEST(a_body_that_moves_is_cut_for_its_rate_alone) {
    connections *all = start(100, 3, 1 << 20);
    pair slow = open_pair(all, 0), fast = open_pair(all, 0);
    client_enter(all, slow.c, STAGE_BODY, 0);
    client_enter(all, fast.c, STAGE_BODY, 0);
    while (!is_cut(&slow)) {
        client_received(all, slow.c, 1);
        client_received(all, fast.c, 1 << 20);
        usleep(1000);
    }
    ck_assert(!is_cut(&fast));
    close_pair(all, &slow);
    close_pair(all, &fast);
    connections_stop(all);
}
END_TEST

START_TEST(idle_clients_make_place_and_no_others) {
    connections *all = start(4, 3600, 1);
    pair solve = open_pair(all, 0), old = open_pair(all, 0), body = open_pair(all, 0);
    client_enter(all, solve.c, STAGE_SOLVE, 0);
    client_enter(all, body.c, STAGE_BODY, 0);
    usleep(2500000);
    ck_assert(!is_cut(&old));
    pair late = open_pair(all, 0);
    /* An idle one would be idle for longer than the grace where the next check comes late. */
    client_enter(all, late.c, STAGE_SOLVE, 0);
    wait_cut(&old);
    ck_assert(!is_cut(&solve) && !is_cut(&body));
    expect_count(all, "_cut_total{why=\"place\"} 1\n");
    close_pair(all, &solve);
    close_pair(all, &old);
    close_pair(all, &body);
    close_pair(all, &late);
    connections_stop(all);
}
END_TEST

/* Ends pass over those who solve, come before the next check of rates, and are gone with the next head. */
START_TEST(an_end_cuts_bodies_and_answers) {
    connections *all = start(10, 3600, 1);
    pair solve = open_pair(all, 0), body = open_pair(all, 0), next = open_pair(all, 0),
         answer = open_pair(all, 0);
    const double end = clock_seconds() + .05;
    client_enter(all, solve.c, STAGE_SOLVE, 0);
    client_end_by(all, solve.c, end);
    client_enter(all, next.c, STAGE_BODY, 0);
    client_end_by(all, next.c, end);
    client_enter(all, next.c, STAGE_HEAD, 0);
    client_enter(all, next.c, STAGE_BODY, 0);
    client_enter(all, body.c, STAGE_BODY, 0);
    client_end_by(all, body.c, end);
    client_enter(all, answer.c, STAGE_SOLVE, 0);
    client_end_by(all, answer.c, end);
    client_enter(all, answer.c, STAGE_ANSWER, 10);
    wait_cut(&body);
    wait_cut(&answer);
    ck_assert_double_ge(clock_seconds(), end);
    ck_assert(!is_cut(&solve) && !is_cut(&next));
    expect_count(all, "_cut_total{why=\"deadline\"} 2\n");
    client_enter(all, solve.c, STAGE_ANSWER, 10);
    wait_cut(&solve);
    close_pair(all, &solve);
    close_pair(all, &body);
    close_pair(all, &next);
    close_pair(all, &answer);
    connections_stop(all);
}
END_TEST

START_TEST(who_is_lost) {
    connections *all = start(10, 1, 1);
    pair half = open_pair(all, 0), gone = open_pair(all, 0);
    ck_assert(!client_is_lost(half.c) && !client_is_lost(gone.c) && !client_is_lost(NULL));
    shutdown(half.theirs, SHUT_WR); /* as one that closes; the two cannot be told apart */
    ck_assert(client_is_lost(half.c));
    close(gone.theirs);
    ck_assert(client_is_lost(gone.c));
    gone.theirs = -1;
    close_pair(all, &half);
    close_pair(all, &gone);
    connections_stop(all);
}
END_TEST

/* A client that comes gets the places of one that has two more than it would: the idle one first, then that
 * of a body; one that has as many as others waits beyond the limit, if few do. */
START_TEST(connections_are_shared) {
    connections *all = start_with(4, 1000, 1000, 1);
    pair theirs[4], mine[6], beside[8];
    for (size_t k = 0; k < 4; k++) theirs[k] = open_pair(all, 0);
    client_enter(all, theirs[0].c, STAGE_SOLVE, 0);
    client_enter(all, theirs[1].c, STAGE_BODY, 0);
    client_enter(all, theirs[2].c, STAGE_IDLE, 0);
    client_enter(all, theirs[3].c, STAGE_ANSWER, 1);
    for (size_t k = 0; k < 6; k++) {
        ck_assert(connections_admit(all, 1));
        mine[k] = open_pair(all, 1);
        ck_assert(is_cut(&theirs[2]));
        ck_assert_int_eq(is_cut(&theirs[1]), k > 0);
        client_enter(all, mine[k].c, STAGE_BODY, 0);
    }
    ck_assert(!connections_admit(all, 1));
    ck_assert(!is_cut(&theirs[0]));
    ck_assert(!is_cut(&theirs[3]));
    for (size_t k = 0; k < 6; k++) ck_assert(!is_cut(&mine[k]));
    /* Now this one has most: others get a place of it, and it itself for one without a request. */
    ck_assert(connections_admit(all, 2));
    ck_assert(is_cut(&mine[0]));
    pair third = open_pair(all, 2);
    client_enter(all, mine[3].c, STAGE_IDLE, 0);
    ck_assert(connections_admit(all, 1));
    ck_assert(is_cut(&mine[3]));
    pair last = open_pair(all, 1);
    client_enter(all, last.c, STAGE_BODY, 0);
    ck_assert(!connections_admit(all, 1));
    close_pair(all, &third);
    close_pair(all, &last);
    for (size_t k = 0; k < 4; k++) close_pair(all, &theirs[k]);
    for (size_t k = 0; k < 6; k++) close_pair(all, &mine[k]);
    /* Connections that were closed for others count no more, and only once. */
    for (size_t k = 0; k < 8; k++) {
        ck_assert(connections_admit(all, 3));
        beside[k] = open_pair(all, 3);
        client_enter(all, beside[k].c, STAGE_BODY, 0);
    }
    ck_assert(!connections_admit(all, 3));
    for (size_t k = 0; k < 8; k++) close_pair(all, &beside[k]);
    connections_stop(all);
}
END_TEST

/* One more than another has is no reason to close one. */
START_TEST(nobody_gives_way_to_an_equal) {
    connections *all = start_with(3, 1000, 1000, 1);
    pair theirs[3], mine;
    for (size_t k = 0; k < 3; k++) theirs[k] = open_pair(all, 0);
    ck_assert(connections_admit(all, 1));
    mine = open_pair(all, 1);
    ck_assert(is_cut(&theirs[0]));
    ck_assert(connections_admit(all, 1));
    ck_assert(!is_cut(&theirs[1]));
    ck_assert(!is_cut(&theirs[2]));
    for (size_t k = 0; k < 3; k++) close_pair(all, &theirs[k]);
    close_pair(all, &mine);
    connections_stop(all);
}
END_TEST

static lam_status afford(size_t wanted, size_t n_stores, size_t *most, lam_error *error) {
    connection_limits limits = {.wanted = wanted};
    const lam_status status = descriptors_afford(&limits, n_stores, error);
    *most = limits.most;
    return status;
}

START_TEST(as_many_as_files_may_be_open) {
    struct rlimit before;
    lam_error error;
    size_t most = 0;
    ck_assert_int_eq(getrlimit(RLIMIT_NOFILE, &before), 0);
    struct rlimit low = {100, before.rlim_max < 300 ? before.rlim_max : 300};
    ck_assert_int_eq(setrlimit(RLIMIT_NOFILE, &low), 0);
    ck_assert_int_eq(afford(10, 5, &most, &error), LAM_OK);
    ck_assert_uint_eq(most, 10);
    /* The soft limit is raised to the hard one. */
    ck_assert_int_eq(getrlimit(RLIMIT_NOFILE, &before), 0);
    ck_assert_uint_eq(before.rlim_cur, low.rlim_max);
    ck_assert_int_eq(afford(1000, 0, &most, &error), LAM_OK);
    ck_assert_uint_eq(most, (size_t)low.rlim_max - 64);
    ck_assert_int_eq(afford(1000, 80, &most, &error), LAM_OK);
    ck_assert_uint_eq(most, (size_t)low.rlim_max - 64 - 80);
    /* Some clients, even where stores take all. */
    ck_assert_int_eq(afford(1000, 5000, &most, &error), LAM_OK);
    ck_assert_uint_eq(most, 8);
    low = (struct rlimit){64, 64};
    ck_assert_int_eq(setrlimit(RLIMIT_NOFILE, &low), 0);
    ck_assert_int_eq(afford(10, 0, &most, &error), LAM_ERR_IO);
    ck_assert_ptr_nonnull(strstr(error.message, "ulimit -n"));
}
END_TEST

START_TEST(tags) {
    char plain[ETAG_MAX], coded[ETAG_MAX], other[ETAG_MAX];
    etag_make(store_checksum("abc", 3), "identity", plain);
    etag_make(store_checksum("abc", 3), "gzip", coded);
    etag_make(store_checksum("abd", 3), "identity", other);
    ck_assert_uint_eq(strlen(plain), 18);
    ck_assert(strcmp(plain, other) != 0 && strcmp(plain, coded) != 0);
    char header[200];
    snprintf(header, sizeof header, "%s , W/%s", other, plain);
    ck_assert(etag_is_listed(header, plain) && etag_is_listed(header, other) &&
              !etag_is_listed(header, coded));
    /* Text inside a quoted tag is no tag. */
    snprintf(header, sizeof header, "\"x, %.17s", plain + 1);
    ck_assert(!etag_is_listed(header, plain));
    static const char *const none[] = {"", ",", "\"", "W/", "W/\"", "\"\"", "a", "x*", " ", NULL};
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++) ck_assert(!etag_is_listed(none[i], plain));
    ck_assert(etag_is_listed("*", plain) && etag_is_listed(" ,\t*", plain));
}
END_TEST

START_TEST(ids) {
    char id[REQUEST_ID_MAX + 1], again[REQUEST_ID_MAX + 1], longest[REQUEST_ID_MAX + 2];
    memset(longest, 'x', sizeof longest);
    longest[REQUEST_ID_MAX + 1] = '\0';
    request_id_choose(longest + 1, 1, 1, id);
    ck_assert_str_eq(id, longest + 1);
    static const char *const bad[] = {NULL, "", "a b", "a\n", "\"", "{}", "\x80", "a\\"};
    request_id_choose(longest, UINT64_MAX, UINT64_MAX, id);
    ck_assert_str_eq(id, "ffffffffffff-18446744073709551615");
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        request_id_choose(bad[i], 7, i, id);
        request_id_choose(bad[i], 7, i + 1, again);
        ck_assert_str_ne(id, again);
        ck_assert_ptr_null(strpbrk(id, " \n\"{}\\"));
    }
    ck_assert(request_id_seed() != request_id_seed());
}
END_TEST

int main(void) {
    Suite *suite = suite_create("guard_parts");
    TCase *all = tcase_create("all");
    tcase_set_timeout(all, 120);
    tcase_add_test(all, each_stage_has_its_time);
    tcase_add_test(all, idle_connections_have_a_time_of_their_own);
    tcase_add_test(all, a_body_that_moves_is_cut_for_its_rate_alone);
    tcase_add_test(all, idle_clients_make_place_and_no_others);
    tcase_add_test(all, an_end_cuts_bodies_and_answers);
    tcase_add_test(all, who_is_lost);
    tcase_add_test(all, tags);
    tcase_add_test(all, ids);
    /* Last: in a process that is not forked the limit stays. */
    tcase_add_test(all, connections_are_shared);
    tcase_add_test(all, nobody_gives_way_to_an_equal);
    tcase_add_test(all, as_many_as_files_may_be_open);
    suite_add_tcase(suite, all);
    return suite_run(suite);
}
