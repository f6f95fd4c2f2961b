#include "support/two_mesh.h"

static lam_error error;

lam_operator *build_as(const build_problem *problem, const build_options *options, build_report *report) {
    lam_operator *op = NULL;
    ck_assert_msg(build_operator(problem, options, &op, report, &error) == LAM_OK, "%s", error.message);
    return op;
}

lam_operator *build_rank(room *r, size_t rank, const char *by, build_report *report) {
    build_options options = build_presets("2msc");
    if (rank > 0) set_number(&options, "rank", (double)rank);
    set_text(&options, "factorizer", by);
    return build_as(room_problem(r), &options, report);
}

double tolerance(size_t k, double rho) {
    return (3 / (1 - rho) + 2 * sum_roundings(k) + 5) * TRANSPORT_U;
}
