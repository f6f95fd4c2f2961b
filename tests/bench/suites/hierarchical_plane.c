/* The plane of time and error of hierarchical operators: each way to find form factors, at several epsilons,
 * and how much longer the best other way takes for the errors that blocks of clusters leave. */
#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/formfactor/source.h"
#include "solver/method/reference.h"
#include "tests/bench/suites/hierarchical.h"
#include "tests/bench/suites/stats.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Ways to find form factors; blocks of clusters are the last. */
enum { WAY_RAYS, WAY_NEAR_PAIRS, WAY_PAIRS, WAY_BLOCKS, WAYS };
static const char *const way_names[WAYS] = {"rays", "near pairs", "pairs", "blocks"};

enum { EPSILONS = 3 };
static const double epsilons[EPSILONS] = {.2, .05, .0125};

/* Values of precompute at normal quality: the noise of rays over epsilon, the accuracy of pairs. */
static const double noise_share = 1.25, pair_accuracy = 7e-5;

/* Emissions: single elements, the scene's own, random ones of all elements. */
enum { SINGLE, LIGHTS, RANDOM, GROUPS };
static const char *const group_names[GROUPS] = {"single", "lights", "random"};
enum { SINGLES = 24, SINGLES_QUICK = 4, RANDOMS = 4 };

/* All pairs of more elements, and blocks of more planes, take too long: precompute does not take them either.
 */
enum { PAIRS_MOST = 24000, PLANES_MOST = 4096 };

/* The tolerance of reference solutions, which are far more exact than form factors. */
static const double tolerance = 1e-7;

static const table_column plane_columns[] = {
    {"scene", NULL, "name of the scene"},
    {"elements", "", "n"},
    {"form_factors", NULL, "the way to find them; near pairs: beside rays"},
    {"epsilon", "", "of the operator; rays and bounds of blocks are those that precompute takes for it"},
    {"rays", "", "per element"},
    {"form_factors_s", "s", "time of the form factors"},
    {"build_s", "s", "time of the operator"},
    {"stored_mb", "MB", "size of the operator in a store"},
    {"single", "", "total indirect error, one bright element, mean"},
    {"lights", "", "the scene's own lights"},
    {"random", "", "random emission of all elements, mean"},
};

static const table_column equal_columns[] = {
    {"scene", NULL, "name of the scene"},
    {"elements", "", "n"},
    {"light", NULL, "emission"},
    {"epsilon", "", "of the operator that blocks were made for"},
    {"error", "", "its total indirect error"},
    {"time_s", "s", "its time with its form factors"},
    {"other", NULL, "the other way that takes the least time for that error; -: none reaches it"},
    {"other_s", "s", "its time, between two epsilons by powers"},
    {"ratio", "", "other_s over time_s"},
};

/* Emissions and the light that they give in all bounces, P = B - E, both [m][C][n]; group g has begin[g] ...
 * begin[g + 1] - 1. */
typedef struct truth {
    size_t m, begin[GROUPS + 1];
    float *E;
    double *P;
} truth;

static void truth_free(truth *t) {
    free(t->E);
    free(t->P);
}

static void fill_emissions(const bench_run *run, const lowrank_scene *s, truth *t) {
    const size_t n = s->m.n, C = s->m.n_channels, vector = C * n;
    uint64_t seed = run->seed;
    for (size_t v = t->begin[SINGLE]; v < t->begin[LIGHTS]; v++) {
        const size_t i = (size_t)(random_unit(&seed) * (double)n);
        for (size_t c = 0; c < C; c++) t->E[v * vector + c * n + i] = 1;
    }
    if (t->begin[RANDOM] > t->begin[LIGHTS])
        memcpy(t->E + t->begin[LIGHTS] * vector, s->m.emission, vector * sizeof *t->E);
    for (size_t k = t->begin[RANDOM] * vector; k < t->m * vector; k++) t->E[k] = (float)random_unit(&seed);
}

/* P of one channel: (I - R F) P = R H, H = F E, or, where few elements shine, what first finds. */
static lam_status solve_channel(const bench_run *run, const lowrank_scene *s, const csr *F,
                                first_light *first, size_t c, const truth *t, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n, C = s->m.n_channels;
    const factor_product product = factor_product_of_rows(F);
    reference *of = NULL;
    double *E = memory_allocate(n, 4 * sizeof *E, "a reference", error), *H = E == NULL ? NULL : E + n,
           *P = E == NULL ? NULL : E + 2 * n, *noise = E == NULL ? NULL : E + 3 * n;
    if (E == NULL) TRY(LAM_ERR_MEMORY);
    TRY(reference_create(F, s->m.area, s->m.reflectance + c * n,
                         reference_choose(&product, s->m.area, s->m.reflectance + c * n, t->m, false), &of,
                         error));
    for (size_t v = 0; v < t->m; v++) {
        const size_t at = (v * C + c) * n;
        bool known = false;
        for (size_t i = 0; i < n; i++) E[i] = (double)t->E[at + i];
        if (first != NULL) TRY(first_light_for_judge(first, t->E + at, H, noise, &known, error));
        if (!known) TRY(product.multiply(product.context, 1, E, H, error));
        for (size_t i = 0; i < n; i++) P[i] = H[i] *= (double)s->m.reflectance[c * n + i];
        TRY(reference_solve(of, 1, H, P, tolerance, run->progress, error));
        memcpy(t->P + at, P, n * sizeof *P);
    }
done:
    reference_destroy(of);
    free(E);
    return status;
}

static lam_status truth_make(const bench_run *run, const lowrank_scene *s, const csr *F, first_light *first,
                             truth *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = s->m.n * s->m.n_channels;
    bool lit = false;
    for (size_t k = 0; k < vector; k++) lit = lit || s->m.emission[k] > 0;
    truth t = {.begin = {0, run->scale == BENCH_QUICK ? SINGLES_QUICK : SINGLES}};
    t.begin[RANDOM] = t.begin[LIGHTS] + (lit ? 1 : 0);
    t.m = t.begin[GROUPS] = t.begin[RANDOM] + RANDOMS;
    t.E = memory_allocate(t.m, vector * sizeof *t.E, "emissions", error);
    t.P = memory_allocate(t.m, vector * sizeof *t.P, "a reference", error);
    if (t.E == NULL || t.P == NULL) TRY(LAM_ERR_MEMORY);
    fill_emissions(run, s, &t);
    for (size_t c = 0; c < s->m.n_channels; c++) TRY(solve_channel(run, s, F, first, c, &t, error));
    *out = t;
    t = (truth){.m = 0};
done:
    truth_free(&t);
    return status;
}

/* |P~ - P| / |P| of each group, area-weighted, channels stacked, mean over those that have light; NaN: none.
 */
static lam_status find_errors(const lowrank_scene *s, const truth *t, const lam_operator *op,
                              double out[GROUPS], lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n, vector = n * s->m.n_channels, bytes = lam_operator_work_bytes(op, 1);
    float *P = memory_allocate(vector, sizeof *P, "an answer", error);
    void *work = memory_allocate(1, bytes, "work area", error);
    if (P == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < GROUPS; g++) {
        size_t lit = 0;
        out[g] = 0;
        for (size_t v = t->begin[g]; v < t->begin[g + 1]; v++) {
            double off = 0, all = 0;
            TRY(lam_operator_apply(op, 1, LAM_INDIRECT, t->E + v * vector, P, work, bytes, error));
            for (size_t k = 0; k < vector; k++) {
                const double A = s->m.area[k % n], p = t->P[v * vector + k], d = (double)P[k] - p;
                off += A * d * d;
                all += A * p * p;
            }
            if (!(all > 0)) continue;
            out[g] += sqrt(off / all);
            lit++;
        }
        out[g] = lit > 0 ? out[g] / (double)lit : NAN;
    }
done:
    free(P);
    free(work);
    return status;
}

/* An operator of one way and epsilon. */
typedef struct point {
    double form_factors_s, build_s, error[GROUPS];
} point;

/* The form factors of one way, rows or blocks on a tree. */
typedef struct found {
    form_factors f;
    plane_tree tree;
    block_factors blocks;
} found;

static void found_free(found *x) {
    form_factors_free(&x->f);
    block_factors_free(&x->blocks);
    plane_tree_free(&x->tree);
}

static lam_status find(const bench_run *run, const lowrank_scene *s, const recipe *how, found *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options options = {
        .recipe = *how, .progress = run->progress, .stage = "form factors of the plane"};
    if (recipe_source(how) == &source_blocks) {
        TRY(form_factors_tree(&s->m, &out->tree, error));
        TRY(form_factors_make_blocks(&s->m, s->z_order, &out->tree, false, &options, &out->f, &out->blocks,
                                     error));
        goto done;
    }
    TRY(form_factors_make(&s->m, s->z_order, &options, &out->f, error));
    if (out->f.F.indptr == NULL) TRY(form_factors_expand(&out->f, s->m.area, error));
done:
    return status;
}

static recipe recipe_of(const bench_run *run, const lowrank_scene *s, int way, const build_options *options) {
    const build_method *method = method_find("hierarchical");
    recipe r = {
        .source = &source_rays, .rays = recipe_auto_rays(options->epsilon, noise_share), .seed = run->seed};
    if (way == WAY_RAYS) return r;
    r.accuracy = pair_accuracy;
    r.source = way == WAY_NEAR_PAIRS ? &source_near_pairs : &source_pairs;
    if (way == WAY_PAIRS) r.rays = RAYS_BESIDE_PAIRS;
    if (way == WAY_BLOCKS) {
        r.source = &source_blocks;
        r.rays = recipe_rays_beside_blocks(s->m.n);
        r.accuracy = method->block_accuracy(method_own_const(options, method));
    }
    return r;
}

static lam_status measure(const bench_run *run, const lowrank_scene *s, const truth *t, int way,
                          double epsilon, found *x, point *p, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *op = NULL;
    build_report built;
    double stored;
    build_options options = build_presets("hierarchical");
    build_problem problem = lowrank_problem(s);
    options.seed = run->seed;
    options.progress = run->progress;
    TRY(build_set_number(&options, "epsilon", epsilon, error));
    const recipe how = recipe_of(run, s, way, &options);
    /* All pairs do not depend on epsilon. */
    if (way != WAY_PAIRS || x->f.F.indptr == NULL) {
        const double started = clock_seconds();
        found_free(x);
        *x = (found){.f = {.row_sums = NULL}};
        TRY(find(run, s, &how, x, error));
        p->form_factors_s = clock_seconds() - started;
    }
    const double started = clock_seconds();
    problem.F = way == WAY_BLOCKS ? NULL : &x->f.F;
    problem.blocks = way == WAY_BLOCKS ? &x->blocks : NULL;
    problem.noise = recipe_noise(&x->f.recipe);
    TRY(build_operator(&problem, &options, &op, &built, error));
    p->build_s = clock_seconds() - started;
    TRY(find_errors(s, t, op, p->error, error));
    TRY(lowrank_stored_bytes(op, &stored, error));
    table_text(out, s->name);
    table_number(out, (double)s->m.n);
    table_text(out, way_names[way]);
    table_number(out, epsilon);
    table_number(out, (double)how.rays);
    table_number(out, p->form_factors_s);
    table_number(out, p->build_s);
    table_number(out, 1e-6 * stored);
    for (size_t g = 0; g < GROUPS; g++) table_number(out, p->error[g]);
done:
    lam_operator_close(op);
    return status;
}

/* The curves of all ways, the error of one group and the time of each point. */
typedef struct curve {
    double error[EPSILONS], time[EPSILONS];
} curve;

static void add_equal(const lowrank_scene *s, point points[WAYS][EPSILONS], table *out) {
    for (size_t g = 0; g < GROUPS; g++) {
        curve of[WAYS];
        for (size_t way = 0; way < WAYS; way++)
            for (size_t k = 0; k < EPSILONS; k++) {
                of[way].error[k] = points[way][k].error[g];
                of[way].time[k] = points[way][k].form_factors_s + points[way][k].build_s;
            }
        for (size_t k = 0; k < EPSILONS; k++) {
            const double error = of[WAY_BLOCKS].error[k], time = of[WAY_BLOCKS].time[k];
            double least = INFINITY;
            const char *other = "-";
            if (!isfinite(error)) continue;
            for (size_t way = 0; way < WAY_BLOCKS; way++) {
                const double now = stats_cost_at(EPSILONS, of[way].error, of[way].time, error);
                if (now < least) other = way_names[way];
                least = fmin(least, now);
            }
            table_text(out, s->name);
            table_number(out, (double)s->m.n);
            table_text(out, group_names[g]);
            table_number(out, epsilons[k]);
            table_number(out, error);
            table_number(out, time);
            table_text(out, other);
            table_number(out, least);
            table_number(out, least / time);
        }
    }
}

void hierarchical_plane_begin(hierarchical_plane *p) {
    *p = (hierarchical_plane){.points = {.name = "plane",
                                         .title = "Time and error by the way to find form factors",
                                         .columns = plane_columns,
                                         .n_columns = sizeof plane_columns / sizeof *plane_columns,
                                         .printed = true},
                              .equal = {.name = "plane-equal",
                                        .title = "At equal error: the best other way over blocks of clusters",
                                        .columns = equal_columns,
                                        .n_columns = sizeof equal_columns / sizeof *equal_columns,
                                        .printed = true}};
}

/* Skips the ways that the scene has too many elements or planes for. */
static lam_status is_possible(const lowrank_scene *s, bool possible[WAYS], lam_error *error) {
    plane_tree tree = {.n = 0};
    const lam_status status = form_factors_tree(&s->m, &tree, error);
    for (int way = 0; way < WAYS; way++) possible[way] = true;
    possible[WAY_PAIRS] = s->m.n <= PAIRS_MOST;
    possible[WAY_BLOCKS] = tree.n_frames <= PLANES_MOST;
    plane_tree_free(&tree);
    return status;
}

lam_status hierarchical_plane_add(const bench_run *run, const lowrank_scene *s, const csr *F,
                                  first_light *first, hierarchical_plane *p, lam_error *error) {
    lam_status status = LAM_OK;
    truth t = {.m = 0};
    found x = {.f = {.row_sums = NULL}};
    point points[WAYS][EPSILONS];
    bool possible[WAYS];
    for (int way = 0; way < WAYS; way++)
        for (int k = 0; k < EPSILONS; k++) points[way][k] = (point){.error = {NAN, NAN, NAN}};
    TRY(is_possible(s, possible, error));
    TRY(truth_make(run, s, F, first, &t, error));
    for (int way = 0; way < WAYS; way++) {
        found_free(&x);
        x = (found){.f = {.row_sums = NULL}};
        for (int k = 0; possible[way] && k < EPSILONS; k++) {
            TRY(bench_check(run, error));
            points[way][k].form_factors_s = k > 0 ? points[way][k - 1].form_factors_s : 0;
            TRY(measure(run, s, &t, way, epsilons[k], &x, &points[way][k], &p->points, error));
        }
    }
    add_equal(s, points, &p->equal);
done:
    found_free(&x);
    truth_free(&t);
    return status;
}

lam_status hierarchical_plane_end(const bench_run *run, hierarchical_plane *p, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(bench_table(run, &p->points, error));
    TRY(bench_table(run, &p->equal, error));
done:
    return status;
}

void hierarchical_plane_free(hierarchical_plane *p) {
    table_free(&p->points);
    table_free(&p->equal);
}
