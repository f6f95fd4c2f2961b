#include "tests/bench/suites/relaxation.h"

#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/method/reference.h"
#include "tests/bench/suites/stats.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double marks[] = {.1, .01, .001, 1e-4, 1e-6};
enum { MARKS = sizeof marks / sizeof *marks, RAYS_OF_ELEMENT = 16, SOLVES = 15 };

/* A method is given up after so many products with F, or so many seconds. */
static const double most_products = 3000;
static const double most_seconds[] = {[BENCH_QUICK] = 1, [BENCH_DEFAULT] = 20, [BENCH_FULL] = 20};

/* One emission on its way to B; all arrays [n], except those that say otherwise. */
typedef struct relaxation {
    size_t n;
    const csr *F;
    const double *area;
    const float *rho;
    double *E, *B;
    double *r, *p, *Kp; /* work areas of the iterations */
    double *root;       /* sqrt(rho A) */
    double *cumulative; /* [nnz] sums of the rows of F up to each entry */
    double rr;          /* <r, r> of conjugate gradients */
    double entries;     /* of F that were used */
    size_t runs;        /* of stochastic shooting */
    uint64_t state;
} relaxation;

static double row_times(const csr *F, size_t i, const double *x) {
    double sum = 0;
    for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) sum += (double)F->data[e] * x[F->indices[e]];
    return sum;
}

static double dot(size_t n, const double *a, const double *b) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

static void begin_with_emission(relaxation *x) {
    memcpy(x->B, x->E, x->n * sizeof *x->B);
    memcpy(x->r, x->E, x->n * sizeof *x->r);
}

/* B <- E + R F B. */
static void jacobi(relaxation *x) {
    memcpy(x->p, x->B, x->n * sizeof *x->p);
    for (size_t i = 0; i < x->n; i++) x->B[i] = x->E[i] + (double)x->rho[i] * row_times(x->F, i, x->p);
    x->entries += (double)x->F->indptr[x->n];
}

/* The same in place. */
static void gauss_seidel(relaxation *x) {
    for (size_t i = 0; i < x->n; i++) x->B[i] = x->E[i] + (double)x->rho[i] * row_times(x->F, i, x->B);
    x->entries += (double)x->F->indptr[x->n];
}

/* Shots of the largest power that was not shot yet, r_i A_i, until as many entries were used as F has. From
 * reciprocity the column is the row: F_ji = A_i F_ij / A_j. */
static void shoot(relaxation *x) {
    const csr *F = x->F;
    const double until = x->entries + (double)F->indptr[x->n];
    while (x->entries < until) {
        size_t i = 0;
        for (size_t k = 1; k < x->n; k++)
            if (x->r[k] * x->area[k] > x->r[i] * x->area[i]) i = k;
        const double power = x->r[i] * x->area[i];
        x->r[i] = 0;
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) {
            const size_t j = F->indices[e];
            const double more = (double)x->rho[j] * (double)F->data[e] * power / x->area[j];
            x->B[j] += more;
            x->r[j] += more;
        }
        x->entries += fmax(1, (double)(F->indptr[i + 1] - F->indptr[i]));
    }
}

/* With d = sqrt(rho A) and B = E + (rho / d) y: (I - K) y = d F E, K = d F diag(rho / d), which is symmetric.
 * An element that reflects nothing has y = 0. */
static void begin_gradients(relaxation *x) {
    memcpy(x->B, x->E, x->n * sizeof *x->B);
    for (size_t i = 0; i < x->n; i++) {
        x->root[i] = sqrt((double)x->rho[i] * x->area[i]);
        x->r[i] = x->p[i] = x->root[i] * row_times(x->F, i, x->E);
    }
    x->rr = dot(x->n, x->r, x->r);
    x->entries += (double)x->F->indptr[x->n];
}

static double per_root(const relaxation *x, size_t i) {
    return x->root[i] > 0 ? (double)x->rho[i] / x->root[i] : 0;
}

static void conjugate_gradients(relaxation *x) {
    double *scaled = x->cumulative; /* only stochastic shooting has sums there */
    for (size_t i = 0; i < x->n; i++) scaled[i] = per_root(x, i) * x->p[i];
    for (size_t i = 0; i < x->n; i++) x->Kp[i] = x->p[i] - x->root[i] * row_times(x->F, i, scaled);
    const double curvature = dot(x->n, x->p, x->Kp), step = curvature > 0 ? x->rr / curvature : 0;
    for (size_t i = 0; i < x->n; i++) {
        x->B[i] += step * scaled[i];
        x->r[i] -= step * x->Kp[i];
    }
    const double rr = dot(x->n, x->r, x->r), turn = x->rr > 0 ? rr / x->rr : 0;
    for (size_t i = 0; i < x->n; i++) x->p[i] = x->r[i] + turn * x->p[i];
    x->rr = rr;
    x->entries += (double)x->F->indptr[x->n];
}

static void begin_stochastic(relaxation *x) {
    const csr *F = x->F;
    memcpy(x->B, x->E, x->n * sizeof *x->B);
    for (size_t i = 0; i < x->n; i++) {
        double sum = 0;
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++)
            x->cumulative[e] = sum += (double)F->data[e];
    }
    x->runs = 0;
    x->state = 1;
}

/* The element that a ray of a row meets; n where it leaves the scene. */
static size_t target(const relaxation *x, size_t i, double u) {
    uint64_t low = x->F->indptr[i], high = x->F->indptr[i + 1];
    const uint64_t end = high;
    while (low < high) {
        const uint64_t middle = low + (high - low) / 2;
        if (x->cumulative[middle] > u)
            high = middle;
        else
            low = middle + 1;
    }
    return low < end ? x->F->indices[low] : x->n;
}

/* A whole solution by rays that carry equal power, RAYS_OF_ELEMENT n of them for all that is emitted; B is
 * the mean of those so far. The number of rays of an element is rounded at random, so that the mean is right.
 */
static void stochastic(relaxation *x) {
    const size_t n = x->n;
    double emitted = 0, *unshot = x->r, *met = x->p, *whole = x->Kp;
    for (size_t i = 0; i < n; i++) {
        whole[i] = unshot[i] = x->area[i] * x->E[i];
        emitted += unshot[i];
    }
    const double quantum = emitted / (double)(RAYS_OF_ELEMENT * n);
    for (size_t rays = 1; rays > 0;) {
        rays = 0;
        memset(met, 0, n * sizeof *met);
        for (size_t i = 0; i < n; i++) {
            const size_t count = (size_t)(unshot[i] / quantum + random_lcg_unit(&x->state));
            rays += count;
            for (size_t k = 0; k < count; k++) {
                const size_t j = target(x, i, random_lcg_unit(&x->state));
                if (j < n) met[j] += quantum;
            }
        }
        for (size_t i = 0; i < n; i++) {
            unshot[i] = (double)x->rho[i] * met[i];
            whole[i] += unshot[i];
        }
        x->entries += (double)rays;
    }
    x->runs++;
    for (size_t i = 0; i < n; i++) x->B[i] += (whole[i] / x->area[i] - x->B[i]) / (double)x->runs;
}

typedef struct iteration {
    const char *name;
    void (*begin)(relaxation *x);
    void (*step)(relaxation *x);
} iteration;

static const iteration iterations[] = {{"Jacobi", begin_with_emission, jacobi},
                                       {"Gauss-Seidel", begin_with_emission, gauss_seidel},
                                       {"shooting", begin_with_emission, shoot},
                                       {"conjugate gradients", begin_gradients, conjugate_gradients},
                                       {"stochastic shooting", begin_stochastic, stochastic}};

static double error_of(const relaxation *x, const double *exact) {
    double off = 0, all = 0;
    for (size_t i = 0; i < x->n; i++) {
        off += x->area[i] * (x->B[i] - exact[i]) * (x->B[i] - exact[i]);
        all += x->area[i] * exact[i] * exact[i];
    }
    return all > 0 ? sqrt(off / all) : 0;
}

static void add_row(const relaxation_case *of, const char *name, double work, double built, double seconds,
                    double error, table *out) {
    table_text(out, of->scene);
    table_number(out, (double)of->problem->n);
    table_text(out, name);
    table_number(out, work);
    table_number(out, built);
    table_number(out, 1e3 * seconds);
    table_number(out, error);
}

static lam_status relax(const bench_run *run, const relaxation_case *of, const iteration *how, relaxation *x,
                        const double *exact, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const double product = fmax(1, (double)x->F->indptr[x->n]);
    size_t mark = 0;
    x->entries = 0;
    double started = clock_seconds();
    how->begin(x);
    double seconds = clock_seconds() - started;
    while (mark < MARKS && x->entries < most_products * product && seconds < most_seconds[run->scale]) {
        TRY(bench_check(run, error));
        started = clock_seconds();
        how->step(x);
        seconds += clock_seconds() - started;
        const double wrong = error_of(x, exact);
        if (wrong > marks[mark]) continue;
        add_row(of, how->name, x->entries / product, NAN, seconds, wrong, out);
        while (mark < MARKS && wrong <= marks[mark]) mark++;
    }
done:
    return status;
}

static lam_status converged(const relaxation_case *of, const double *E, double *B, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = of->problem;
    reference *r = NULL;
    memcpy(B, E, p->n * sizeof *B);
    TRY(reference_create(p->F, p->area, p->reflectance, REFERENCE_ITERATED, &r, error));
    TRY(reference_solve(r, 1, E, B, 1e-12, NULL, error));
done:
    reference_destroy(r);
    return status;
}

lam_status relaxation_add(const bench_run *run, const relaxation_case *of, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = of->problem;
    const size_t n = p->n, entries = (size_t)p->F->indptr[n];
    double *all = memory_allocate(7 * n, sizeof *all, "relaxation", error), *exact = all;
    double *cumulative = memory_allocate(entries > n ? entries : n, sizeof *cumulative, "relaxation", error);
    if (all == NULL || cumulative == NULL) TRY(LAM_ERR_MEMORY);
    relaxation x = {.n = n,
                    .F = p->F,
                    .area = p->area,
                    .rho = p->reflectance,
                    .E = all + n,
                    .B = all + 2 * n,
                    .r = all + 3 * n,
                    .p = all + 4 * n,
                    .Kp = all + 5 * n,
                    .root = all + 6 * n,
                    .cumulative = cumulative};
    for (size_t i = 0; i < n; i++) x.E[i] = (double)of->E[i];
    TRY(converged(of, x.E, exact, error));
    for (size_t k = 0; k < sizeof iterations / sizeof *iterations; k++)
        TRY(relax(run, of, &iterations[k], &x, exact, out, error));
done:
    free(all);
    free(cumulative);
    return status;
}

lam_status relaxation_add_operator(const bench_run *run, const relaxation_case *of, const char *method,
                                   const char *option, double value, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = of->problem;
    const size_t n = p->n;
    build_options how = build_presets(method);
    build_report built;
    lam_operator *op = NULL;
    double seconds[SOLVES];
    char name[64];
    void *work = NULL;
    double *all = memory_allocate(3 * n, sizeof *all, "relaxation", error);
    float *B = memory_allocate(n, sizeof *B, "relaxation", error);
    if (all == NULL || B == NULL) TRY(LAM_ERR_MEMORY);
    how.seed = run->seed;
    how.progress = run->progress;
    if (option != NULL) TRY(build_set_number(&how, option, value, error));
    const double started = clock_seconds();
    TRY(build_operator(p, &how, &op, &built, error));
    const double building = clock_seconds() - started;
    const size_t bytes = lam_operator_work_bytes(op, 1);
    work = memory_allocate(bytes, 1, "relaxation", error);
    if (work == NULL) TRY(LAM_ERR_MEMORY);
    for (int k = 0; k < SOLVES; k++) {
        const double now = clock_seconds();
        TRY(lam_operator_apply(op, 1, LAM_RADIOSITY, of->E, B, work, bytes, error));
        seconds[k] = clock_seconds() - now;
    }
    const relaxation x = {.n = n, .area = p->area, .B = all + n};
    for (size_t i = 0; i < n; i++) {
        x.B[i] = (double)B[i];
        all[2 * n + i] = (double)of->E[i];
    }
    TRY(converged(of, all + 2 * n, all, error));
    snprintf(name, sizeof name, option != NULL ? "%s %s %g" : "%s", method, option, value);
    add_row(of, name, NAN, building, stats_median(seconds, SOLVES), error_of(&x, all), out);
done:
    lam_operator_close(op);
    free(work);
    free(all);
    free(B);
    return status;
}

table relaxation_table(void) {
    static const table_column columns[] = {
        {"scene", NULL, "name of the scene"},
        {"elements", "", "n"},
        {"method", NULL,
         "iteration, until it first errs by less than .1, .01, .001, 1e-4, 1e-6, or operator"},
        {"products", "", "entries of F that were used, over those that F has"},
        {"build", "s", "of the operator"},
        {"time", "ms", "of one answer: of iterations, in double by one thread; of operators, all threads"},
        {"error", "", "|B~ - B|/|B| against the converged reference on the same form factors"}};
    return (table){.name = "relaxation",
                   .title = "Iterations for one emission: error against time",
                   .columns = columns,
                   .n_columns = sizeof columns / sizeof *columns,
                   .printed = true};
}
