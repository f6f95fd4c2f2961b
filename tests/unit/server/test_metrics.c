/* The counters of the daemon: every status that it can answer has a label of its own. */
#include "server/queue/metrics.h"
#include "solver/codec/problem.h"
#include "support/suite.h"

#include <string.h>

static const char *const routes[] = {"/one", "/two"};

static metrics *make(void) {
    metrics *m = NULL;
    lam_error error = {0};
    ck_ok(metrics_create(2, routes, &m, &error));
    return m;
}

/* True if the text of the counters has this line. */
static bool says(metrics *m, const char *line) {
    const metrics_gauges none = {0};
    buffer b = {0};
    ck_assert(metrics_write(m, &none, &b));
    const bool there = strstr(b.bytes, line) != NULL;
    buffer_free(&b);
    return there;
}

static void count(metrics *m, unsigned status) {
    metrics_begin(m);
    metrics_end(m, 1, status, .01);
}

START_TEST(every_class_of_problems_has_its_status) {
    for (int kind = PROBLEM_NONE + 1; kind < PROBLEM_COUNT; kind++) {
        metrics *m = make();
        char line[96];
        const unsigned status = problem_status((problem_kind)kind);
        count(m, status);
        count(m, status);
        snprintf(line, sizeof line, "lambertd_requests_total{route=\"/two\",status=\"%u\"} 2\n", status);
        ck_assert_msg(says(m, line), "problem %d: no line %s", kind, line);
        ck_assert(!says(m, "status=\"other\""));
        metrics_destroy(m);
    }
}
END_TEST

START_TEST(every_other_answer_has_its_status) {
    static const unsigned answers[] = {0, 200, 202, 204, 304};
    metrics *m = make();
    for (size_t k = 0; k < sizeof answers / sizeof *answers; k++) {
        char line[96];
        count(m, answers[k]);
        snprintf(line, sizeof line, "lambertd_requests_total{route=\"/two\",status=\"%u\"} 1\n", answers[k]);
        ck_assert_msg(says(m, line), "no line %s", line);
    }
    ck_assert(!says(m, "status=\"other\""));
    count(m, 299);
    ck_assert(says(m, "lambertd_requests_total{route=\"/two\",status=\"other\"} 1\n"));
    ck_assert(metrics_in_flight(m) == 0);
    metrics_destroy(m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("metrics");
    TCase *cases = tcase_create("metrics");
    tcase_add_test(cases, every_class_of_problems_has_its_status);
    tcase_add_test(cases, every_other_answer_has_its_status);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
