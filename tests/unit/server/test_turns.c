/* Turns of clients: who waits, who is let go in which round, and that nobody is forgotten. Times are given.
 */
#include "server/net/turns.h"
#include "support/suite.h"

enum { MOST = 64 };

static turn *gone[4096];
static size_t n_gone;

static void note(turn *t) {
    gone[n_gone++] = t;
}

static turns *create(void) {
    turns *all;
    lam_error error;
    n_gone = 0;
    ck_ok(turns_create(note, &all, &error));
    return all;
}

/* As the thread does: it may go on, or it waits. */
static bool ask(turns *all, turn *t, double now) {
    if (turns_may(all, t, now, now)) return true;
    turns_wait(all, t);
    return false;
}

START_TEST(one_client_alone_never_waits) {
    turns *all = create();
    turn t = {.client = 1};
    for (int k = 0; k < 10000; k++) ck_assert(ask(all, &t, 1));
    turns_destroy(all);
}
END_TEST

/* 32 connections of one client, each of which asks again once it is answered, beside one of another. A round
 * lets go two of a cost of 30 us in 60 us, and one more where a debt is left over. */
START_TEST(rounds_are_shared_by_clients) {
    turns *all = create();
    turn greedy[MOST] = {{0}}, other = {.client = 2};
    size_t served = 0, from = 0;
    for (size_t k = 0; k < MOST; k++) greedy[k].client = 1;
    ck_assert(ask(all, &other, 1));
    for (size_t k = 0; k < MOST; k++) served += ask(all, &greedy[k], 1);
    ck_assert_uint_le(served, 3);
    for (size_t round = 0; round < 1000; round++) {
        const size_t to = n_gone;
        served = 0;
        ck_assert_uint_gt(to, from);
        for (; from < to; from++) {
            ck_assert(ask(all, gone[from], 1));
            served++;
        }
        /* They ask again, behind those that wait. */
        for (size_t k = to - served; k < to; k++) ck_assert(!ask(all, gone[k], 1));
        ck_assert_uint_le(served, 3);
        ck_assert(ask(all, &other, 1 + 1e-3 * (double)round));
        if (n_gone > 4000) break;
    }
    turns_close(all);
    turns_destroy(all);
}
END_TEST

/* Requests are let go in the order in which they came, whichever of them leaves. */
START_TEST(nobody_is_forgotten) {
    turns *all = create();
    turn greedy[MOST] = {{0}}, other = {.client = 2};
    for (size_t k = 0; k < MOST; k++) greedy[k].client = 1;
    (void)ask(all, &other, 1);
    turn *waiting[MOST];
    size_t n = 0;
    for (size_t k = 0; k < MOST; k++)
        if (!ask(all, &greedy[k], 1)) waiting[n++] = &greedy[k];
    ck_assert_uint_gt(n, MOST - 8);
    /* One leaves while it waits, every second one when it was let go. */
    turns_leave(all, waiting[n - 2]);
    waiting[n - 2] = waiting[n - 1];
    for (size_t from = 0; from < n_gone; from++) {
        ck_assert_ptr_eq(gone[from], waiting[from]);
        if (from % 2 == 0)
            turns_leave(all, gone[from]);
        else
            ck_assert(ask(all, gone[from], 1));
    }
    ck_assert_uint_eq(n_gone, n - 1);
    turns_destroy(all);
}
END_TEST

START_TEST(a_debt_is_paid_by_rounds_and_by_time) {
    turns *all = create();
    turn t = {.client = 1}, other = {.client = 2};
    ck_assert(ask(all, &t, 1));
    (void)ask(all, &other, 1);
    turns_charge(all, 1, 1e-3);
    ck_assert(!turns_may(all, &t, 1, 1));
    ck_assert(!turns_may(all, &t, 1, 1 + .9e-3 / TURNS_FREE));
    ck_assert(turns_may(all, &t, 1, 1 + 1e-3 / TURNS_FREE));
    /* Where nobody else goes, rounds pass at once. */
    turns_charge(all, 1, 1);
    ck_assert(!ask(all, &t, 1.01));
    ck_assert_uint_eq(n_gone, 1);
    ck_assert(ask(all, &t, 1.01));
    turns_destroy(all);
}
END_TEST

/* A thread that is always busy, with requests that take ten times what they count for: time itself takes
 * nothing off, so that of many connections of one client most wait. */
START_TEST(a_slow_machine_has_the_same_turns) {
    turns *all = create();
    turn greedy[MOST] = {{0}}, other = {.client = 2};
    double now = 1;
    size_t served = 0;
    for (size_t k = 0; k < MOST; k++) greedy[k].client = 1;
    (void)turns_may(all, &other, now, 0);
    for (size_t k = 0; k < MOST; k++) {
        now += 10 * TURNS_COST_S;
        if (turns_may(all, &greedy[k], now, 0))
            served++;
        else
            turns_wait(all, &greedy[k]);
    }
    ck_assert_uint_le(served, 3);
    turns_close(all);
    turns_destroy(all);
}
END_TEST

START_TEST(all_go_once_the_others_are_away) {
    turns *all = create();
    turn greedy[MOST] = {{0}}, other = {.client = 2};
    for (size_t k = 0; k < MOST; k++) greedy[k].client = 1;
    (void)ask(all, &other, 1);
    for (size_t k = 0; k < MOST - 1; k++) (void)ask(all, &greedy[k], 1);
    ck_assert(ask(all, &greedy[MOST - 1], 1 + 2 * TURNS_SEEN_S));
    for (size_t from = 0; from < n_gone; from++) ck_assert(ask(all, gone[from], 4));
    ck_assert_uint_ge(n_gone, MOST - 4);
    turns_close(all);
    turns_destroy(all);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("turns");
    TCase *tests = tcase_create("turns");
    tcase_add_test(tests, one_client_alone_never_waits);
    tcase_add_test(tests, rounds_are_shared_by_clients);
    tcase_add_test(tests, nobody_is_forgotten);
    tcase_add_test(tests, a_debt_is_paid_by_rounds_and_by_time);
    tcase_add_test(tests, a_slow_machine_has_the_same_turns);
    tcase_add_test(tests, all_go_once_the_others_are_away);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
