/* Table 3.6 of the thesis: time of the factorization, of Y_k and of a radiosity, and radiosities a second, of
 * a patio and of an atrium of the size of Sponza. */
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/lowrank.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>

enum { ROWS = 8, ANSWERS = 15, RAYS = 4096, PATIO = 21888, SPONZA = 79232 };

/* Seconds of the factorization, of Y_k and of one radiosity, and these a second, as published. */
static const struct {
    size_t n, k;
    double theirs[4];
} cases[ROWS] = {{PATIO, 3920, {97, 7.42, .040, 25.3}},       {PATIO, 3114, {71, 4.70, .031, 32.6}},
                 {PATIO, 2227, {58, 2.45, .024, 41.5}},       {PATIO, 1617, {49, 1.29, .016, 62.1}},
                 {SPONZA, 17857, {19225, 329.42, .921, 1.1}}, {SPONZA, 3483, {2023, 19.66, .128, 7.8}},
                 {SPONZA, 1751, {1987, 5.25, .067, 14.8}},    {SPONZA, 376, {1524, .33, .015, 66.7}}};

static float *made_up(size_t n, size_t k, lam_error *error) {
    float *Y = memory_allocate(n, k * sizeof *Y, "Y", error);
    for (size_t i = 0; Y != NULL && i < n * k; i++) Y[i] = -1e-4f * (float)(1 + i % 13);
    return Y;
}

/* An operator of made-up numbers: a radiosity takes as long whatever they are. */
static lam_status open_made_up(size_t n, size_t k, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    float *reflectance = memory_allocate(n, sizeof *reflectance, "scene", error);
    float *Y = made_up(n, k, error), *V = made_up(n, k, error);
    if (reflectance == NULL || Y == NULL || V == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) reflectance[i] = .5f;
    status = operator_low_rank_create_folded(n, k, reflectance, Y, V, op, error);
    Y = V = NULL;
done:
    free(reflectance);
    free(Y);
    free(V);
    return status;
}

/* A row; built is NULL for made-up numbers, theirs for a size that the thesis has not. */
static lam_status add_row(const char *scene, lam_operator *op, size_t k, const build_report *built,
                          const double *theirs, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    double seconds;
    lam_operator_set_threads(op, (size_t)omp_get_max_threads());
    TRY(lowrank_time_answer(op, ANSWERS, &seconds, error));
    table_text(out, scene);
    table_number(out, (double)lam_operator_elements(op));
    table_number(out, (double)k);
    table_number(out, built != NULL ? built->steps[0].seconds : NAN);
    table_number(out, built != NULL ? built->steps[1].seconds : NAN);
    table_number(out, 1e3 * seconds);
    table_number(out, 1 / seconds);
    table_number(out, 1e-9 * (double)lam_operator_bytes(op) / seconds);
    for (int c = 0; c < 4; c++) table_number(out, theirs != NULL ? theirs[c] : NAN);
done:
    return status;
}

static lam_status add_built(const bench_run *run, const lowrank_scene *s, size_t k, const double *theirs,
                            table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem problem = lowrank_problem(s);
    build_options how = build_presets("low-rank");
    build_report built = {0};
    lam_operator *op = NULL;
    TRY(bench_check(run, error));
    how.seed = run->seed;
    how.progress = run->progress;
    how.memory = run->memory;
    TRY(build_set(&how, "factorizer", "hf", error));
    TRY(build_set_number(&how, "rank", (double)k, error));
    TRY(build_operator(&problem, &how, &op, &built, error));
    TRY(add_row(s->name, op, k, &built, theirs, out, error));
    bench_say(run, "%s, %zu elements, rank %zu: %.1f s, and %.1f s for Y", s->name, s->m.n, k,
              built.steps[0].seconds, built.steps[1].seconds);
done:
    lam_operator_close(op);
    return status;
}

static lam_status open_atrium(const bench_run *run, size_t elements, lowrank_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    const generate_options kind = {.kind = "atrium", .elements = elements, .reflectance = -1, .seed = 1};
    const recipe how = formfactors_rays(RAYS, run->seed);
    mesh m = {0};
    TRY(scene_generated(&kind, &m, error));
    TRY(lowrank_open(run, "atrium", &m, &how, out, error));
done:
    mesh_free(&m);
    return status;
}

/* A scene of a share of the size in the thesis, and ranks of the same share of its elements. */
static lam_status add_scene(const bench_run *run, bool atrium, size_t part, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    lowrank_scene s = {.name = NULL};
    const size_t n = atrium ? SPONZA : PATIO;
    if (atrium)
        TRY(open_atrium(run, n / part, &s, error));
    else
        TRY(lowrank_patio(run, n / part, &s, error));
    for (size_t r = 0; r < ROWS; r++) {
        const size_t k = cases[r].k / part;
        if (cases[r].n != n || cases[r].k > n / 5 || k < 1) continue; /* rank 17,857 takes days */
        TRY(add_built(run, &s, k, part == 1 ? cases[r].theirs : NULL, out, error));
    }
done:
    lowrank_scene_free(&s);
    return status;
}

lam_status lowrank_of_frames(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"scene", NULL, "built from a scene, or made-up factors of the thesis' sizes"},
        {"elements", "", "n"},
        {"rank", "", "k"},
        {"factorize_s", "s", "time of HF"},
        {"invert_s", "s", "time of Y_k"},
        {"answer_ms", "ms", "time of one B, median, all threads"},
        {"fps", "1/s", "B a second"},
        {"gb_s", "GB/s", "rate at which Y and V are read"},
        {"thesis_factorize_s", "s", "as published (21,888 and 79,232 elements)"},
        {"thesis_invert_s", "s", "as published"},
        {"thesis_answer_s", "s", "as published"},
        {"thesis_fps", "1/s", "as published"},
    };
    static const size_t parts[] = {[BENCH_QUICK] = 128, [BENCH_DEFAULT] = 8, [BENCH_FULL] = 1};
    lam_status status = LAM_OK;
    lam_operator *op = NULL;
    table out = {.name = "frames",
                 .title = "Radiosities a second at the sizes of a patio and of Sponza (thesis: table 3.6)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (int atrium = 0; atrium < 2; atrium++)
        TRY(add_scene(run, atrium == 1, parts[run->scale], &out, error));
    for (size_t r = 0; r < ROWS && run->scale != BENCH_QUICK; r++) {
        const double bytes = 8 * (double)cases[r].n * (double)cases[r].k;
        /* Two copies while the operator is made. */
        if (run->memory > 0 && 2 * bytes > (double)run->memory) continue;
        TRY(open_made_up(cases[r].n, cases[r].k, &op, error));
        TRY(add_row("made up", op, cases[r].k, NULL, cases[r].theirs, &out, error));
        lam_operator_close(op);
        op = NULL;
    }
    TRY(bench_table(run, &out, error));
done:
    lam_operator_close(op);
    table_free(&out);
    return status;
}
