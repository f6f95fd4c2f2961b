/* The process in which the suite service solves without HTTP: it makes the operator that lambertd serves,
 * stores it, and times solves of it. It reads commands from standard input, and answers each by one line of
 * numbers. */
#include "solver/base/clock.h"
#include "solver/operator/operator.h"
#include "solver/precompute/forecast/forecast.h"
#include "solver/scene/mesh.h"
#include "store/groups.h"
#include "tests/bench/suites/bench.h"
#include "tests/bench/suites/stats.h"

#include <errno.h>
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>

/* Bytes left for everything but operators, in memory and on disk. */
static const double slack = 1 << 30;

/* The operator is held twice, here and by lambertd, and half of it a third time while an array of it is
 * written or read; .1 is for the padding of its panels. */
static const double copies = 2.6;

static const float reflectance = .5f;

/* More times than these say no more about their median. */
enum { TIMES_MOST = 1 << 16 };

typedef struct solver {
    lam_operator *op;
    size_t n;
    float *E, *B; /* [n] */
    double *times;
} solver;

/* The largest k up to the one wanted for which memory and disk are enough, a multiple of 16 where it is less.
 */
static size_t k_that_fits(size_t n, size_t k) {
    const uint64_t memory = memory_available();
    struct statvfs disk;
    double bytes = memory > 0 ? ((double)memory - slack) / copies : INFINITY;
    if (statvfs(".", &disk) == 0) bytes = fmin(bytes, (double)disk.f_bavail * (double)disk.f_frsize - slack);
    const double most = bytes / (2 * sizeof(float) * (double)n);
    if (most >= (double)k) return k;
    return most >= 16 ? (size_t)most / 16 * 16 : 0;
}

/* B = E - Y (V^T E) with numbers in [0, 1) times -1/k in Y and 2/n in V, so that B is about E + mean(E)/2.
 * The speed of a solve does not depend on the numbers. */
static lam_status make_operator(const mesh *m, size_t k, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    const float scale[2] = {-1 / (float)k, 2 / (float)m->n};
    float *factors[2] = {NULL, NULL};
    size_t row;
    if (!size_multiply(k, sizeof **factors, &row)) FAIL(error, LAM_ERR_MEMORY, "k = %zu: too large", k);
    for (int f = 0; f < 2; f++) {
        factors[f] = memory_allocate(m->n, row, "a low-rank operator", error);
        if (factors[f] == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for
        for (size_t i = 0; i < m->n; i++)
            for (size_t p = 0; p < k; p++)
                factors[f][i * k + p] = scale[f] * (float)((i * 31 + p * 17 + (size_t)f) % 64) / 64;
    }
    float *const Y = factors[0], *const V = factors[1];
    factors[0] = factors[1] = NULL;
    TRY(operator_low_rank_create_folded(m->n, k, m->reflectance, Y, V, op, error));
done:
    free(factors[0]);
    free(factors[1]);
    return status;
}

/* A strip of n unit squares, a quarter of them in each of the groups that the suite asks for. */
static lam_status make_mesh(size_t n, mesh *m, double **row_sums, lam_error *error) {
    static const char *const names[] = {"lamp", "desk", "floor", "wall"};
    enum { GROUPS = 4, NAME = 8 };
    lam_status status = LAM_OK;
    *m = (mesh){.n_vertices = 2 * (n + 1), .n = n, .n_groups = GROUPS, .n_channels = 1, .unit = 1, .up = 'z'};
    strcpy(m->name, "bench");
    m->vertices = memory_allocate(m->n_vertices, sizeof *m->vertices, "vertices", error);
    m->elements = memory_allocate(n, sizeof *m->elements, "elements", error);
    m->group = memory_allocate(n, sizeof *m->group, "groups", error);
    m->reflectance = memory_allocate(n, sizeof *m->reflectance, "reflectance", error);
    m->emission = memory_allocate(n, sizeof *m->emission, "emission", error);
    m->group_names = memory_allocate(GROUPS, sizeof *m->group_names + NAME, "groups", error);
    *row_sums = memory_allocate(n, sizeof **row_sums, "row sums", error);
    if (m->vertices == NULL || m->elements == NULL || m->group == NULL || m->reflectance == NULL ||
        m->emission == NULL || m->group_names == NULL || *row_sums == NULL)
        TRY(LAM_ERR_MEMORY);
    char *text = (char *)(m->group_names + GROUPS);
    for (size_t g = 0; g < GROUPS; g++, text += NAME) m->group_names[g] = strcpy(text, names[g]);
    for (size_t v = 0; v <= n; v++) {
        m->vertices[2 * v][0] = m->vertices[2 * v + 1][0] = (double)v;
        m->vertices[2 * v + 1][1] = 1;
    }
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t corners[4] = {2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1};
        memcpy(m->elements[i], corners, sizeof corners);
        m->group[i] = (uint32_t)(i * (size_t)GROUPS / n);
        m->reflectance[i] = reflectance;
        (*row_sums)[i] = 1;
    }
    TRY(mesh_measure(m, error));
done:
    return status;
}

static lam_status save(const mesh *m, const double *row_sums, size_t k, const lam_operator *op,
                       lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    TRY(store_create("store.h5", &s, error));
    TRY(store_set_text(s, "/", "name", m->name, error));
    TRY(store_set_text(s, "/", "tool", "lambert " LAMBERT_VERSION, error));
    TRY(store_set_text(s, "/", "command", "lambert bench service", error));
    TRY(store_set_integer(s, "/", "seed", 0, error));
    TRY(store_set_number(s, "/", "unit", m->unit, error));
    TRY(mesh_save(m, row_sums, s, error));
    TRY(operator_save(op, s, error));
    TRY(store_set_text(s, STORE_OPERATOR, "method", "low-rank", error));
    TRY(store_set_text(s, STORE_OPERATOR, "factorizer", "none", error));
    TRY(store_set_text(s, STORE_OPERATOR, "reason", "made of arbitrary numbers, to be timed", error));
    TRY(store_set_integer(s, STORE_OPERATOR, "rank", (int64_t)k, error));
    store *sealing = s;
    s = NULL;
    TRY(store_seal(sealing, error));
done:
    store_close(s);
    return status;
}

/* n values of a file, or into it. */
static lam_status transfer(const char *path, bool write, float *values, size_t n, lam_error *error) {
    lam_status status = LAM_OK;
    FILE *file = fopen(path, write ? "wbe" : "rbe");
    if (file == NULL || (write ? fwrite(values, sizeof *values, n, file) != n || fflush(file) != 0
                               : fread(values, sizeof *values, n, file) != n))
        FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
done:
    if (file != NULL) fclose(file);
    return status;
}

/* One solve after the other, into B, for that long and at least once; times may be NULL. A first one, which
 * brings pages and caches, is not counted. */
static lam_status solve_on(const solver *s, double seconds, float *B, double *times, size_t *count,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const size_t bytes = lam_operator_work_bytes(s->op, 1);
    void *work = memory_allocate(1, bytes, "work area", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    TRY(lam_operator_apply(s->op, 1, LAM_RADIOSITY, s->E, B, work, bytes, error));
    double now = clock_seconds();
    const double end = now + seconds;
    for (*count = 0; now < end || *count == 0; ++*count) {
        const double before = now;
        TRY(lam_operator_apply(s->op, 1, LAM_RADIOSITY, s->E, B, work, bytes, error));
        now = clock_seconds();
        if (times != NULL) times[*count % TIMES_MOST] = now - before;
    }
done:
    free(work);
    return status;
}

/* Solves one after the other, each by `threads` threads: median, 99 % quantile, solves per second, their
 * number. */
static lam_status solve_alone(solver *s, int threads, double seconds, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    double sum = 0;
    lam_operator_set_threads(s->op, (size_t)threads);
    TRY(solve_on(s, seconds, s->B, s->times, &count, error));
    const size_t kept = count < TIMES_MOST ? count : TIMES_MOST;
    for (size_t i = 0; i < kept; i++) sum += s->times[i];
    const double p50 = stats_quantile(s->times, kept, .5), p99 = stats_quantile(s->times, kept, .99);
    printf("%.9g %.9g %.9g %zu\n", p50, p99, (double)kept / sum, count);
done:
    return status;
}

/* As many threads at once, each solving one vector after the other: nan, nan, solves a second, their number.
 */
static lam_status solve_beside(solver *s, int threads, double seconds, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    lam_operator_set_threads(s->op, 1);
    const double start = clock_seconds();
#pragma omp parallel num_threads(threads) reduction(+ : count)
    {
        lam_error own;
        size_t solved = 0;
        float *B = memory_allocate(s->n, sizeof *B, "radiosity", &own);
        const lam_status mine = B != NULL ? solve_on(s, seconds, B, NULL, &solved, &own) : LAM_ERR_MEMORY;
        count += solved + 1; /* the first too, as the whole time is counted */
        free(B);
        if (mine != LAM_OK)
#pragma omp critical
        {
            status = mine;
            *error = own;
        }
    }
    if (status == LAM_OK) printf("nan nan %.9g %zu\n", (double)count / (clock_seconds() - start), count);
    return status;
}

static void solver_free(solver *s) {
    lam_operator_close(s->op);
    free(s->E);
    free(s->B);
    free(s->times);
    *s = (solver){.op = NULL};
}

/* store.h5 of an operator n x k, or of the largest k that there is room for; emission is read, and the
 * radiosity of it written as `radiosity`. Answers k (0: there is no room), threads, and the bytes that a
 * solve reads. */
static lam_status make(solver *s, size_t n, size_t k, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    double *row_sums = NULL;
    size_t count;
    k = k_that_fits(n, k);
    if (k > 0) {
        s->n = n;
        s->E = memory_allocate(n, sizeof *s->E, "emission", error);
        s->B = memory_allocate(n, sizeof *s->B, "radiosity", error);
        s->times = memory_allocate(TIMES_MOST, sizeof *s->times, "times", error);
        if (s->E == NULL || s->B == NULL || s->times == NULL) TRY(LAM_ERR_MEMORY);
        TRY(transfer("emission", false, s->E, n, error));
        TRY(make_mesh(n, &m, &row_sums, error));
        TRY(make_operator(&m, k, &s->op, error));
        TRY(save(&m, row_sums, k, s->op, error));
        TRY(solve_on(s, 0, s->B, NULL, &count, error));
        TRY(transfer("radiosity", true, s->B, n, error));
    }
    printf("%zu %d %zu\n", k, omp_get_max_threads(), k > 0 ? lam_operator_bytes(s->op) : 0);
done:
    free(row_sums);
    mesh_free(&m);
    return status;
}

int service_solver(void) {
    lam_status status = LAM_OK;
    lam_error error = {0};
    solver s = {.op = NULL};
    char line[128];
    while (status == LAM_OK && fgets(line, sizeof line, stdin) != NULL) {
        size_t n, k;
        int threads;
        double seconds;
        if (sscanf(line, "make %zu %zu", &n, &k) == 2)
            status = make(&s, n, k, &error);
        else if (s.op != NULL && sscanf(line, "alone %d %lf", &threads, &seconds) == 2)
            status = solve_alone(&s, threads, seconds, &error);
        else if (s.op != NULL && sscanf(line, "beside %d %lf", &threads, &seconds) == 2)
            status = solve_beside(&s, threads, seconds, &error);
        else
            status = status_fail(&error, LAM_ERR_ARGUMENT, "no such command: %.100s", line);
        fflush(stdout);
    }
    solver_free(&s);
    if (status != LAM_OK) fprintf(stderr, "%s\n", error.message);
    return status != LAM_OK;
}
