/* The ledger of requests: who waits for memory, who goes first, and that nobody waits in vain. */
#include "server/route/request_memory.h"
#include "support/suite.h"

enum { ROOM = 1000, BODIES = 400, MOST = 8 };

static size_t n_woken;
static request_memory *woken[2 * MOST];

static void note(request_memory *m) {
    woken[n_woken++] = m;
}

typedef struct stage {
    request_ledger ledger;
    request_memory m[MOST];
} stage;

static void begin(stage *s) {
    n_woken = 0;
    request_ledger_init(&s->ledger, ROOM, BODIES);
    for (size_t k = 0; k < MOST; k++) s->m[k] = (request_memory){.ledger = &s->ledger, .client = k};
}

static void end(stage *s) {
    for (size_t k = 0; k < MOST; k++) request_memory_leave(&s->m[k]);
    for (size_t k = 0; k < MOST; k++) ck_assert(request_memory_keep(&s->m[k], 0));
    ck_assert_uint_eq(s->ledger.all.taken, 0);
    for (size_t c = 0; c < SHARES_CLIENTS; c++) ck_assert_uint_eq(s->ledger.all.of[c], 0);
    ck_assert_uint_eq(s->ledger.n_waiting, 0);
    request_ledger_destroy(&s->ledger);
}

static bool take(request_memory *m, size_t bytes) {
    problem why;
    return request_memory_take(m, bytes, &why);
}

/* Takes in vain, and waits with what it has. */
static void take_later(request_memory *m, size_t bytes) {
    ck_assert(!take(m, bytes));
    ck_assert_uint_eq(m->wanted, m->held + bytes);
    request_memory_wait(m, note);
}

START_TEST(refusals) {
    stage s;
    problem why;
    begin(&s);
    ck_assert(take(&s.m[0], 600));
    ck_assert_uint_eq(request_ledger_most(&s.ledger), 750);
    ck_assert(!request_memory_take(&s.m[1], 751, &why));
    ck_assert_int_eq(why.kind, PROBLEM_TOO_MUCH);
    ck_assert_uint_eq(s.m[1].wanted, 0);
    ck_assert(!request_memory_take(&s.m[1], SIZE_MAX, &why));
    ck_assert_int_eq(why.kind, PROBLEM_TOO_MUCH);
    ck_assert(!request_memory_take(&s.m[1], 301, &why));
    ck_assert_int_eq(why.kind, PROBLEM_NO_MEMORY);
    ck_assert_uint_eq(s.m[1].wanted, 301);
    ck_assert(take(&s.m[1], 300));
    ck_assert_uint_eq(s.ledger.n_never, 2);
    end(&s);
}
END_TEST

/* Alone three quarters, then three quarters of what is left, and so on; of several requests together. */
START_TEST(shares_of_clients) {
    stage s;
    begin(&s);
    s.m[1].client = s.m[0].client;
    ck_assert(take(&s.m[0], 400));
    ck_assert(take(&s.m[1], 350));
    ck_assert(!take(&s.m[0], 1));
    ck_assert(!take(&s.m[2], 190));
    ck_assert(take(&s.m[2], 180));
    ck_assert(!take(&s.m[1], 1));
    ck_assert(take(&s.m[3], 50));
    /* Bytes that nobody's request has any more count as nobody's, but as taken. */
    request_memory_hand_over(&s.m[2], 180);
    ck_assert(take(&s.m[2], 15));
    request_memory_give_back(&s.m[2], 15);
    ck_assert_uint_eq(s.ledger.all.taken, 980);
    request_ledger_give_back(&s.ledger, 180);
    end(&s);
}
END_TEST

START_TEST(bodies_of_clients) {
    stage s;
    problem why = {0};
    begin(&s);
    s.m[1].client = s.m[0].client;
    /* One body may have all of them, two of a client three quarters. */
    ck_assert(request_memory_take_body(&s.m[0], 200, &why));
    ck_assert(request_memory_allows_body(&s.m[0], 200));
    ck_assert(!request_memory_allows_body(&s.m[1], 104));
    ck_assert(request_memory_take_body(&s.m[1], 100, &why));
    ck_assert(!request_memory_take_body(&s.m[0], 4, &why));
    ck_assert_uint_eq(why.status, 0);
    ck_assert(request_memory_take_body(&s.m[2], 100, &why));
    ck_assert_uint_eq(request_ledger_bodies(&s.ledger), BODIES);
    ck_assert(!request_memory_take_body(&s.m[3], 1, &why));
    request_memory_give_back_body(&s.m[1], 100);
    ck_assert(request_memory_take_body(&s.m[0], 100, &why));
    request_memory_give_back_body(&s.m[0], 300);
    request_memory_give_back_body(&s.m[2], 100);
    ck_assert_uint_eq(request_ledger_bodies(&s.ledger), 0);
    end(&s);
}
END_TEST

START_TEST(keep_gives_back_all_but) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 700));
    ck_assert(request_memory_keep(&s.m[0], 200));
    ck_assert_uint_eq(s.ledger.all.taken, 200);
    ck_assert_uint_eq(s.m[0].held, 200);
    ck_assert(take(&s.m[1], 600));
    /* It takes what it is short of, where there is room. */
    ck_assert(!request_memory_keep(&s.m[0], 351));
    ck_assert_uint_eq(s.m[0].held, 200);
    request_memory_give_back(&s.m[1], 300);
    ck_assert(request_memory_keep(&s.m[0], 351));
    ck_assert_uint_eq(s.ledger.all.taken, 651);
    end(&s);
}
END_TEST

START_TEST(who_waits_is_granted_all_of_it) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 700));
    ck_assert(take(&s.m[1], 50));
    take_later(&s.m[1], 250);
    request_memory_give_back(&s.m[0], 50);
    ck_assert_uint_eq(n_woken, 0);
    request_memory_give_back(&s.m[0], 50);
    ck_assert_uint_eq(n_woken, 1);
    ck_assert(woken[0] == &s.m[1] && !woken[0]->refused);
    /* Nobody else has it, and what it gives back on its way is still its own. */
    ck_assert(!take(&s.m[2], 77));
    ck_assert(take(&s.m[1], 200));
    request_memory_give_back(&s.m[1], 200);
    ck_assert(!take(&s.m[2], 77));
    ck_assert(take(&s.m[1], 250));
    ck_assert_uint_eq(s.ledger.all.taken, 900);
    /* Bytes that it did not need are free once it keeps what it has. */
    request_memory_give_back(&s.m[1], 10);
    ck_assert(!take(&s.m[2], 80));
    ck_assert(request_memory_keep(&s.m[1], s.m[1].held));
    ck_assert(take(&s.m[2], 80));
    end(&s);
}
END_TEST

START_TEST(who_goes_first) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 300));
    ck_assert(take(&s.m[1], 400));
    ck_assert(take(&s.m[2], 100));
    s.m[4].client = 2; /* holds 100 */
    take_later(&s.m[4], 160);
    take_later(&s.m[5], 160);
    take_later(&s.m[6], 500);
    take_later(&s.m[7], 160);
    request_memory_give_back(&s.m[0], 300);
    /* Clients that hold nothing go first, in their order, but for one that has no room yet. */
    ck_assert_uint_eq(n_woken, 2);
    ck_assert(woken[0] == &s.m[5]);
    ck_assert(woken[1] == &s.m[7]);
    request_memory_give_back(&s.m[1], 400);
    ck_assert_uint_eq(n_woken, 3);
    ck_assert(woken[2] == &s.m[4]);
    request_memory_give_back(&s.m[2], 100);
    ck_assert(request_memory_keep(&s.m[5], 0));
    ck_assert_uint_eq(n_woken, 4);
    ck_assert(woken[3] == &s.m[6]);
    end(&s);
}
END_TEST

/* One that was patient is overtaken by small ones, and by clients that hold less, but by no others. */
START_TEST(patience) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 500));
    ck_assert(take(&s.m[1], 50));
    take_later(&s.m[2], 600);
    ck_assert(take(&s.m[1], 60));
    s.m[2].since -= 2 * REQUEST_MEMORY_PATIENCE;
    ck_assert(!take(&s.m[1], 60));
    ck_assert(take(&s.m[3], 60));
    s.m[4].client = 3;
    ck_assert(take(&s.m[4], 600 / 16 - 1));
    ck_assert(!take(&s.m[4], 1));
    s.m[5].client = s.m[2].client;
    take_later(&s.m[5], 60);
    ck_assert_uint_eq(n_woken, 0);
    /* Once it leaves, the one behind it goes on. */
    request_memory_leave(&s.m[2]);
    ck_assert_uint_eq(n_woken, 1);
    ck_assert(woken[0] == &s.m[5] && !woken[0]->refused);
    end(&s);
}
END_TEST

/* The patient one waits for bodies of others that wait: these may go on. */
START_TEST(patience_holds_up_nobody_in_vain) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 310));
    ck_assert(take(&s.m[1], 100));
    ck_assert(take(&s.m[2], 400));
    take_later(&s.m[1], 600);
    take_later(&s.m[2], 50);
    s.m[1].since -= 2 * REQUEST_MEMORY_PATIENCE;
    request_memory_give_back(&s.m[0], 310);
    ck_assert_uint_eq(n_woken, 1);
    ck_assert(woken[0] == &s.m[2] && !woken[0]->refused);
    end(&s);
}
END_TEST

START_TEST(nobody_waits_for_those_that_wait) {
    stage s;
    begin(&s);
    s.m[2].client = s.m[3].client = 1;
    for (size_t k = 0; k < 4; k++) ck_assert(take(&s.m[k], 200));
    for (size_t k = 0; k < 3; k++) take_later(&s.m[k], 150);
    /* The fourth may end. */
    ck_assert_uint_eq(n_woken, 0);
    take_later(&s.m[3], 150);
    ck_assert_uint_eq(n_woken, 1);
    ck_assert(woken[0] == &s.m[3] && woken[0]->refused);
    ck_assert(request_memory_keep(&s.m[3], 0));
    ck_assert_uint_eq(n_woken, 2);
    ck_assert(woken[1] == &s.m[0] && !woken[1]->refused);
    end(&s);
}
END_TEST

START_TEST(those_that_leave) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 700));
    for (size_t k = 1; k < 4; k++) take_later(&s.m[k], 280);
    request_memory_leave(&s.m[2]);
    request_memory_leave(&s.m[2]);
    ck_assert_uint_eq(s.ledger.n_waiting, 2);
    request_memory_give_back(&s.m[0], 700);
    ck_assert_uint_eq(n_woken, 2);
    ck_assert_uint_eq(s.ledger.n_waited, 3);
    end(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("memory of requests");
    TCase *tests = tcase_create("memory of requests");
    tcase_add_test(tests, refusals);
    tcase_add_test(tests, shares_of_clients);
    tcase_add_test(tests, bodies_of_clients);
    tcase_add_test(tests, keep_gives_back_all_but);
    tcase_add_test(tests, who_waits_is_granted_all_of_it);
    tcase_add_test(tests, who_goes_first);
    tcase_add_test(tests, patience);
    tcase_add_test(tests, patience_holds_up_nobody_in_vain);
    tcase_add_test(tests, nobody_waits_for_those_that_wait);
    tcase_add_test(tests, those_that_leave);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
