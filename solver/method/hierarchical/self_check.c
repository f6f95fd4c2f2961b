#include "solver/method/hierarchical/self_check.h"

#include "solver/base/random.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Random emissions, all emissions, rows of F that a thread multiplies at a time. */
enum { PROBES = 4, EMISSIONS = PROBES + 1, ROWS_AT_ONCE = 1024 };
/* Of streamed F one row in ONE_IN is used, within these limits. */
enum { ONE_IN = 32, OTHERS_LEAST = 64, OTHERS_MOST = 2048 };

/* Emissions, of which the last gives uniform radiosity, their answers, and h = F B~ of the random ones. */
typedef struct check {
    float *E, *B; /* [EMISSIONS][C][n] */
    double *h;    /* [PROBES][C][count], at `elements` */
    void *work;
    size_t work_bytes, count;
    uint32_t *elements; /* [count]; NULL: all of them in mesh order */
} check;

static void check_free(check *s) {
    free(s->E);
    free(s->B);
    free(s->h);
    free(s->work);
    free(s->elements);
}

static size_t rows_tried(const build_problem *problem) {
    const size_t n = problem->n, some = n / ONE_IN;
    if (problem->stream == NULL) return n;
    const size_t count = some < OTHERS_LEAST ? OTHERS_LEAST : some > OTHERS_MOST ? OTHERS_MOST : some;
    return count < n ? count : n;
}

static lam_status check_make(const build_problem *problem, const lam_operator *op, check *s,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels;
    *s = (check){.work_bytes = lam_operator_work_bytes(op, EMISSIONS), .count = rows_tried(problem)};
    s->E = memory_allocate(EMISSIONS * C, n * sizeof *s->E, "self-check", error);
    s->B = memory_allocate(EMISSIONS * C, n * sizeof *s->B, "self-check", error);
    s->h = memory_allocate(PROBES * C, s->count * sizeof *s->h, "self-check", error);
    s->work = memory_allocate(1, s->work_bytes, "self-check", error);
    if (s->E == NULL || s->B == NULL || s->h == NULL || s->work == NULL) TRY(LAM_ERR_MEMORY);
    if (problem->stream == NULL) goto done;
    s->elements = memory_allocate(s->count, sizeof *s->elements, "self-check", error);
    if (s->elements == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < s->count; k++) s->elements[k] = problem->order[k * n / s->count];
done:
    return status;
}

/* h of all elements. */
static lam_status multiply(const build_problem *problem, const check *s, lam_error *error) {
    const size_t n = problem->n;
    double *x = memory_allocate(n, sizeof *x, "self-check", error);
    if (x == NULL) return LAM_ERR_MEMORY;
    for (size_t v = 0; v < PROBES * problem->n_channels; v++) {
        for (size_t i = 0; i < n; i++) x[i] = (double)s->B[v * n + i];
#pragma omp parallel for schedule(dynamic, 1)
        for (size_t first = 0; first < n; first += ROWS_AT_ONCE)
            csr_multiply_rows(problem->F, first, first + ROWS_AT_ONCE < n ? first + ROWS_AT_ONCE : n, 1, x,
                              s->h + v * n);
    }
    free(x);
    return LAM_OK;
}

/* h of all elements, by blocks. */
static lam_status multiply_blocks(const build_problem *problem, const check *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, m = PROBES * problem->n_channels;
    const uint32_t *order = problem->blocks->order;
    double *x = memory_allocate(n, m * sizeof *x, "self-check", error);
    double *y = memory_allocate(n, m * sizeof *y, "self-check", error);
    if (x == NULL || y == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < n; p++)
        for (size_t v = 0; v < m; v++) x[p * m + v] = (double)s->B[v * n + order[p]];
    TRY(block_factors_multiply(problem->blocks, m, x, y, error));
    for (size_t p = 0; p < n; p++)
        for (size_t v = 0; v < m; v++) s->h[v * n + order[p]] = y[p * m + v];
done:
    free(x);
    free(y);
    return status;
}

/* h of some elements, by rows of the independent sample. */
static lam_status multiply_others(const build_problem *problem, const check *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < s->count; k++) {
        row_block row;
        lam_error why = {.message = ""};
        const lam_status one = row_source_get(&problem->stream->others, &s->elements[k], 1, &row, &why);
        if (one != LAM_OK) {
#pragma omp critical(self_check_failed)
            status = status_fail(error, one, "%s", why.message);
            continue;
        }
        for (size_t v = 0; v < PROBES * problem->n_channels; v++) {
            const float *B = s->B + v * n;
            double sum = 0;
            for (size_t e = 0; e < row.length[0]; e++)
                sum += (double)row.data[0][e] * (double)B[row.indices[0][e]];
            s->h[v * s->count + k] = sum;
        }
        row_block_free(&row);
    }
    return status;
}

/* |E - (B~ - rho F B~)| / |E| of one emission and channel. */
static double residual(const build_problem *problem, const check *s, size_t e, size_t c) {
    const size_t n = problem->n, v = e * problem->n_channels + c;
    const float *rho = problem->reflectance + c * n, *E = s->E + v * n, *B = s->B + v * n;
    double left = 0, all = 0;
    for (size_t k = 0; k < s->count; k++) {
        const size_t i = s->elements != NULL ? s->elements[k] : k;
        const double r = (double)E[i] - ((double)B[i] - (double)rho[i] * s->h[v * s->count + k]);
        left += problem->area[i] * r * r;
        all += problem->area[i] * (double)E[i] * (double)E[i];
    }
    return sqrt(left / all);
}

/* |B~ - 1| / |1| of the last emission. */
static double uniform_error(const build_problem *problem, const check *s, size_t c) {
    const size_t n = problem->n;
    const float *B = s->B + (PROBES * problem->n_channels + c) * n;
    double off = 0, area = 0;
    for (size_t i = 0; i < n; i++) {
        off += problem->area[i] * ((double)B[i] - 1) * ((double)B[i] - 1);
        area += problem->area[i];
    }
    return sqrt(off / area);
}

lam_status self_check(const build_problem *problem, const double *row_sums, const lam_operator *op,
                      uint64_t seed, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels;
    check s;
    TRY(check_make(problem, op, &s, error));
    for (size_t e = 0; e < EMISSIONS; e++)
        for (size_t i = 0; i < n; i++)
            for (size_t c = 0; c < C; c++) {
                const uint64_t bits = random_lcg(&seed);
                s.E[(e * C + c) * n + i] =
                    e < PROBES ? random_to_float(bits)
                               : (float)fmax(1 - (double)problem->reflectance[c * n + i] * row_sums[i], 0);
            }
    TRY(lam_operator_apply(op, EMISSIONS, LAM_RADIOSITY, s.E, s.B, s.work, s.work_bytes, error));
    TRY(problem->stream != NULL   ? multiply_others(problem, &s, error)
        : problem->blocks != NULL ? multiply_blocks(problem, &s, error)
                                  : multiply(problem, &s, error));
    double mean_residual = 0, largest = 0;
    for (size_t e = 0; e < PROBES; e++) {
        double worst = 0;
        for (size_t c = 0; c < C; c++) worst = fmax(worst, residual(problem, &s, e, c));
        mean_residual += worst / PROBES;
    }
    for (size_t c = 0; c < C; c++) largest = fmax(largest, uniform_error(problem, &s, c));
    report_number(report, "probe_residual", mean_residual);
    report_number(report, "uniform_error", largest);
done:
    check_free(&s);
    return status;
}
