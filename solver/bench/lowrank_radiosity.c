/* Tables 3.6 and 3.7 of the thesis: what an operator costs, and how far its radiosity is off. */
#include "solver/bench/lowrank.h"

#include <math.h>
#include <stdlib.h>

enum { EPSILONS = 5, PROBES = 500, PROBES_OF_LARGE = 64, LARGE = 5000 };

static const double epsilons[EPSILONS] = {.05, .1, .2, .3, .5};

/* k, mean, standard deviation and largest relative error of the thesis. */
static const double patio[EPSILONS][4] = {{3920, .0025, .0013, .0073},
                                          {3114, .0048, .0030, .0170},
                                          {2227, .0096, .0073, .0395},
                                          {1617, .0142, .0124, .0635},
                                          {932, .0232, .0224, .1205}};
static const double cornell[EPSILONS][4] = {{560, .0021, .0017, .0094},
                                            {416, .0045, .0042, .0213},
                                            {328, .0088, .0075, .0448},
                                            {274, .0133, .0122, .0839},
                                            {139, .0255, .0299, .1713}};

static lam_status add_epsilon(const bench_run *run, const lowrank_scene *s, double epsilon,
                              const double theirs[4], table *out, lam_error *error) {
    lam_status status = LAM_OK;
    /* The real error of the thesis is half of its epsilon. */
    const lowrank_case of = {.method = "low-rank",
                             .factorizer = "hf",
                             .epsilon = epsilon / 2,
                             .probes = s->m.n > LARGE ? PROBES_OF_LARGE : PROBES};
    lowrank_verdict v;
    TRY(lowrank_judge(run, s, &of, &v, error));
    table_text(out, s->name);
    table_number(out, (double)s->m.n);
    table_number(out, epsilon);
    table_number(out, (double)v.built.rank);
    table_number(out, v.built.measured_norm_error);
    table_number(out, v.built.factorize_seconds);
    table_number(out, v.built.invert_seconds);
    table_number(out, 1e3 * v.answer_seconds);
    table_number(out, v.judged.single.operator_relative.mean);
    table_number(out, v.judged.single.operator_relative.std);
    table_number(out, v.judged.single.operator_relative.max);
    table_number(out, v.judged.single.operator_indirect.mean);
    for (int k = 0; k < 4; k++) table_number(out, theirs[k]);
done:
    return status;
}

lam_status lowrank_of_radiosity(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"scene", NULL, "which"},
        {"elements", "", "n"},
        {"epsilon", "", "of the thesis, whose real error is half of it; ours is bound to that half"},
        {"rank", "", "k"},
        {"real", "", "|S - Q V^T|_2"},
        {"factorize_s", "s", "of the factorization"},
        {"invert_s", "s", "of Y_k"},
        {"answer_ms", "ms", "of one B, median"},
        {"relative_mean", "", "|B~ - B|/|B| for single emitters"},
        {"relative_std", "", "its standard deviation"},
        {"relative_max", "", "its largest"},
        {"indirect_mean", "", "|B~ - B|/|B - E|"},
        {"thesis_rank", "", "as published (patio of 21,888, Cornell box of 2,560 elements)"},
        {"thesis_mean", "", "as published, relative"},
        {"thesis_std", "", "as published"},
        {"thesis_max", "", "as published"},
    };
    static const size_t sizes[3][2] = {{640, 640}, {2560, 2700}, {2560, 21888}};
    lam_status status = LAM_OK;
    lowrank_scene s = {.name = NULL};
    table out = {.name = "radiosity",
                 .title = "Error of the radiosity at the real error of the thesis (tables 3.6 and 3.7)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (int k = 0; k < 2; k++) {
        TRY(k == 0 ? lowrank_cornell(run, sizes[run->scale][0], &s, error)
                   : lowrank_patio(run, sizes[run->scale][1], &s, error));
        for (int e = 0; e < EPSILONS; e++)
            TRY(add_epsilon(run, &s, epsilons[e], k == 0 ? cornell[e] : patio[e], &out, error));
        lowrank_scene_free(&s);
    }
    TRY(bench_table(run, &out, error));
done:
    lowrank_scene_free(&s);
    table_free(&out);
    return status;
}
