/* The ledger of requests: who waits for memory, who goes first, and that nobody waits in vain. */
#include "server/route/request_memory.h"
#include "support/suite.h"

enum { ROOM = 1000, MOST = 8 };

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
    request_ledger_init(&s->ledger, ROOM);
    for (size_t k = 0; k < MOST; k++) s->m[k] = (request_memory){.ledger = &s->ledger, .client = k};
}

static void end(stage *s) {
    for (size_t k = 0; k < MOST; k++) request_memory_leave(&s->m[k]);
    for (size_t k = 0; k < MOST; k++) ck_assert(request_memory_keep(&s->m[k], 0));
    ck_assert_uint_eq(s->ledger.taken, 0);
    for (size_t c = 0; c < REQUEST_MEMORY_CLIENTS; c++) ck_assert_uint_eq(s->ledger.by_client[c], 0);
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
    ck_assert(!request_memory_take(&s.m[1], ROOM + 1, &why));
    ck_assert_int_eq(why.kind, PROBLEM_TOO_MUCH);
    ck_assert_uint_eq(s.m[1].wanted, 0);
    ck_assert(!request_memory_take(&s.m[1], SIZE_MAX, &why));
    ck_assert_int_eq(why.kind, PROBLEM_TOO_MUCH);
    ck_assert(!request_memory_take(&s.m[1], 401, &why));
    ck_assert_int_eq(why.kind, PROBLEM_NO_MEMORY);
    ck_assert_uint_eq(s.m[1].wanted, 401);
    ck_assert(take(&s.m[1], 400));
    ck_assert_uint_eq(s.ledger.n_never, 2);
    end(&s);
}
END_TEST

START_TEST(keep_gives_back_all_but) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 700));
    ck_assert(request_memory_keep(&s.m[0], 200));
    ck_assert_uint_eq(s.ledger.taken, 200);
    ck_assert_uint_eq(s.m[0].held, 200);
    ck_assert(take(&s.m[1], 800));
    /* It takes what it is short of, where there is room. */
    ck_assert(!request_memory_keep(&s.m[0], 201));
    ck_assert_uint_eq(s.m[0].held, 200);
    request_memory_give_back(&s.m[1], 1);
    ck_assert(request_memory_keep(&s.m[0], 201));
    ck_assert_uint_eq(s.ledger.taken, ROOM);
    end(&s);
}
END_TEST

START_TEST(who_waits_is_granted_all_of_it) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 900));
    ck_assert(take(&s.m[1], 50));
    take_later(&s.m[1], 300);
    request_memory_give_back(&s.m[0], 200);
    ck_assert_uint_eq(n_woken, 0);
    request_memory_give_back(&s.m[0], 50);
    ck_assert_uint_eq(n_woken, 1);
    ck_assert(woken[0] == &s.m[1] && !woken[0]->refused);
    /* Nobody else has it, and what it gives back on its way is still its own. */
    ck_assert(!take(&s.m[2], 1));
    ck_assert(take(&s.m[1], 200));
    request_memory_give_back(&s.m[1], 200);
    ck_assert(!take(&s.m[2], 1));
    ck_assert(take(&s.m[1], 300));
    ck_assert_uint_eq(s.ledger.taken, ROOM);
    /* Bytes that it did not need are free once it keeps what it has. */
    request_memory_give_back(&s.m[1], 10);
    ck_assert(request_memory_keep(&s.m[1], s.m[1].held));
    ck_assert(take(&s.m[2], 10));
    end(&s);
}
END_TEST

START_TEST(who_goes_first) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 400));
    ck_assert(take(&s.m[1], 500));
    ck_assert(take(&s.m[2], 100));
    s.m[4].client = 2; /* holds 100 */
    take_later(&s.m[4], 100);
    take_later(&s.m[5], 100);
    take_later(&s.m[6], 600);
    take_later(&s.m[7], 100);
    request_memory_give_back(&s.m[0], 400);
    /* Clients that hold nothing go first, but for the one that has no room yet. */
    ck_assert_uint_eq(n_woken, 3);
    ck_assert(woken[0] == &s.m[5]);
    ck_assert(woken[1] == &s.m[7]);
    ck_assert(woken[2] == &s.m[4]);
    request_memory_give_back(&s.m[1], 500);
    ck_assert_uint_eq(n_woken, 4);
    ck_assert(woken[3] == &s.m[6]);
    end(&s);
}
END_TEST

/* One that was patient is overtaken by small ones, and by clients that hold less, but by no others. */
START_TEST(patience) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 600));
    ck_assert(take(&s.m[1], 50));
    take_later(&s.m[2], 800);
    ck_assert(take(&s.m[1], 60));
    s.m[2].since -= 2 * REQUEST_MEMORY_PATIENCE;
    ck_assert(!take(&s.m[1], 60));
    ck_assert(take(&s.m[3], 60));
    s.m[4].client = 3;
    ck_assert(take(&s.m[4], 800 / 16 - 1));
    ck_assert(!take(&s.m[4], 1));
    s.m[5].client = s.m[2].client;
    ck_assert(!take(&s.m[5], 60));
    /* Once it leaves, what waits behind it goes on. */
    request_memory_wait(&s.m[5], note);
    ck_assert_uint_eq(n_woken, 0);
    request_memory_leave(&s.m[2]);
    ck_assert_uint_eq(n_woken, 1);
    ck_assert(woken[0] == &s.m[5] && !woken[0]->refused);
    end(&s);
}
END_TEST

START_TEST(nobody_waits_for_those_that_wait) {
    stage s;
    begin(&s);
    s.m[2].client = s.m[3].client = 1;
    for (size_t k = 0; k < 4; k++) ck_assert(take(&s.m[k], 220));
    for (size_t k = 0; k < 3; k++) take_later(&s.m[k], 200);
    /* The fourth may end. */
    ck_assert_uint_eq(n_woken, 0);
    take_later(&s.m[3], 200);
    ck_assert_uint_eq(n_woken, 1);
    ck_assert(woken[0] == &s.m[3] && woken[0]->refused);
    ck_assert(request_memory_keep(&s.m[3], 0));
    ck_assert_uint_eq(n_woken, 2);
    ck_assert(!woken[1]->refused);
    end(&s);
}
END_TEST

START_TEST(those_that_leave) {
    stage s;
    begin(&s);
    ck_assert(take(&s.m[0], 900));
    for (size_t k = 1; k < 4; k++) take_later(&s.m[k], 200);
    request_memory_leave(&s.m[2]);
    request_memory_leave(&s.m[2]);
    ck_assert_uint_eq(s.ledger.n_waiting, 2);
    request_memory_give_back(&s.m[0], 900);
    ck_assert_uint_eq(n_woken, 2);
    ck_assert_uint_eq(s.ledger.n_waited, 3);
    end(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("memory of requests");
    TCase *tests = tcase_create("memory of requests");
    tcase_add_test(tests, refusals);
    tcase_add_test(tests, keep_gives_back_all_but);
    tcase_add_test(tests, who_waits_is_granted_all_of_it);
    tcase_add_test(tests, who_goes_first);
    tcase_add_test(tests, patience);
    tcase_add_test(tests, nobody_waits_for_those_that_wait);
    tcase_add_test(tests, those_that_leave);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
