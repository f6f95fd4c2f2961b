/* Connections that are closed while their clients still send: the answer reaches these, and nobody holds a
 * place for ever. */
#include "server/net/connections.h"
#include "support/suite.h"

#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

static const char answer[] = "HTTP/1.1 401 Unauthorized\r\n\r\n";

static connections *start(size_t most, size_t timeout_s) {
    connections *all = NULL;
    lam_error error;
    const connection_limits limits = {.wanted = most,
                                      .most = most,
                                      .beyond = 8,
                                      .timeout_s = timeout_s,
                                      .keep_alive_s = 3600,
                                      .least_rate = 1};
    ck_assert_int_eq(connections_start(&limits, &all, &error), LAM_OK);
    return all;
}

/* A connection over which the client has sent a byte, that was answered and closed as an HTTP server does it.
 * Returns the client's end. */
static int close_early(connections *all, bool lingers) {
    int fds[2];
    ck_assert_int_eq(socketpair(AF_UNIX, SOCK_STREAM, 0, fds), 0);
    client *c = connections_add(all, fds[0], 0, true);
    ck_assert_ptr_nonnull(c);
    ck_assert_int_eq(send(fds[1], "x", 1, MSG_NOSIGNAL), 1);
    if (lingers) client_linger(all, c);
    ck_assert_int_eq(send(fds[0], answer, sizeof answer, MSG_NOSIGNAL), sizeof answer);
    client_enter(all, c, STAGE_IDLE, 0);
    shutdown(fds[0], SHUT_WR);
    connections_close(all, c);
    close(fds[0]);
    return fds[1];
}

/* Sends so many bytes, or until the connection is lost; returns those that were sent. */
static size_t send_bytes(int fd, size_t bytes) {
    static const char zeros[1 << 16];
    size_t sent = 0;
    while (sent < bytes) {
        const size_t left = bytes - sent;
        const ssize_t got = send(fd, zeros, left < sizeof zeros ? left : sizeof zeros, MSG_NOSIGNAL);
        if (got < 0) break;
        sent += (size_t)got;
    }
    return sent;
}

static void expect_answer(int fd) {
    char got[sizeof answer];
    ck_assert_int_eq(recv(fd, got, sizeof got, MSG_WAITALL), sizeof got);
    ck_assert_str_eq(got, answer);
    ck_assert_int_eq(recv(fd, got, 1, 0), 0);
}

/* Until so many linger. */
static void wait_lingering(connections *all, size_t count) {
    const struct timespec pause = {.tv_nsec = 1000000};
    while (connections_lingering(all) != count) nanosleep(&pause, NULL);
}

/* Until the connection is lost, while a byte is sent now and then. */
static void wait_lost(int fd) {
    const struct timespec pause = {.tv_nsec = 10000000};
    while (send(fd, "x", 1, MSG_NOSIGNAL) == 1) nanosleep(&pause, NULL);
    ck_assert(errno == EPIPE || errno == ECONNRESET);
}

START_TEST(an_answer_is_read_after_the_last_byte_was_sent) {
    connections *all = start(100, 60);
    const int fd = close_early(all, true);
    ck_assert_uint_eq(connections_lingering(all), 1);
    ck_assert_uint_eq(send_bytes(fd, 30 << 20), 30 << 20);
    expect_answer(fd);
    close(fd);
    wait_lingering(all, 0);
    connections_stop(all);
}
END_TEST

START_TEST(others_are_closed_at_once) {
    connections *all = start(100, 60);
    const int fd = close_early(all, false);
    ck_assert_uint_eq(connections_lingering(all), 0);
    ck_assert_int_lt(send(fd, "x", 1, MSG_NOSIGNAL), 0);
    close(fd);
    connections_stop(all);
}
END_TEST

/* A quarter of eight may linger. */
START_TEST(the_one_that_lingers_for_longest_goes_for_another) {
    connections *all = start(8, 60);
    const int first = close_early(all, true), second = close_early(all, true);
    ck_assert_uint_eq(connections_lingering(all), 2);
    const int third = close_early(all, true);
    wait_lost(first);
    ck_assert_uint_eq(send_bytes(second, 1 << 20), 1 << 20);
    ck_assert_uint_eq(send_bytes(third, 1 << 20), 1 << 20);
    wait_lingering(all, 2);
    close(first);
    close(second);
    close(third);
    wait_lingering(all, 0);
    connections_stop(all);
}
END_TEST

/* The lingering connection goes first for a client that has fewer. */
START_TEST(they_give_their_places_away) {
    connections *all = start(4, 60);
    int fds[3][2];
    client *others[3];
    for (int i = 0; i < 3; i++) {
        ck_assert_int_eq(socketpair(AF_UNIX, SOCK_STREAM, 0, fds[i]), 0);
        others[i] = connections_add(all, fds[i][0], 0, true);
        client_enter(all, others[i], i == 0 ? STAGE_IDLE : STAGE_BODY, 0);
    }
    const int fd = close_early(all, true);
    ck_assert(connections_admit(all, 1));
    wait_lost(fd);
    for (int i = 0; i < 3; i++) {
        char byte;
        ck_assert_int_eq(recv(fds[i][1], &byte, 1, MSG_DONTWAIT), -1);
        connections_remove(all, others[i]);
        close(fds[i][0]);
        close(fds[i][1]);
    }
    close(fd);
    connections_stop(all);
}
END_TEST

/* With a time-out of a second one lingers for a second without a byte, and for six in all: the second client
 * sends more than the least rate asks for. */
START_TEST(nobody_holds_a_place_for_ever) {
    connections *all = start(100, 1);
    const int silent = close_early(all, true), slow = close_early(all, true);
    wait_lost(slow);
    ck_assert_uint_eq(connections_lingering(all), 0);
    ck_assert_int_lt(send(silent, "x", 1, MSG_NOSIGNAL), 0);
    close(silent);
    close(slow);
    connections_stop(all);
}
END_TEST

START_TEST(a_body_without_end_is_cut) {
    connections *all = start(100, 60);
    const int fd = close_early(all, true);
    const size_t sent = send_bytes(fd, (size_t)2 << 30);
    ck_assert_uint_ge(sent, (size_t)1 << 30);
    ck_assert_uint_lt(sent, (size_t)2 << 30);
    close(fd);
    connections_stop(all);
}
END_TEST

START_TEST(the_end_does_not_wait_for_them) {
    connections *all = start(100, 60);
    const int silent = close_early(all, true), sending = close_early(all, true);
    ck_assert_uint_eq(send_bytes(sending, 1 << 20), 1 << 20);
    connections_stop(all);
    wait_lost(silent);
    wait_lost(sending);
    close(silent);
    close(sending);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("lingering");
    TCase *all = tcase_create("all");
    tcase_set_timeout(all, 120);
    tcase_add_test(all, an_answer_is_read_after_the_last_byte_was_sent);
    tcase_add_test(all, others_are_closed_at_once);
    tcase_add_test(all, the_one_that_lingers_for_longest_goes_for_another);
    tcase_add_test(all, they_give_their_places_away);
    tcase_add_test(all, nobody_holds_a_place_for_ever);
    tcase_add_test(all, a_body_without_end_is_cut);
    tcase_add_test(all, the_end_does_not_wait_for_them);
    suite_add_tcase(suite, all);
    return suite_run(suite);
}
