#include "solver/build/self_check.h"

#include <math.h>
#include <stdlib.h>

/* Random lights that an operator is tried on, rows of a product that a thread takes at once, and elements
 * whose other rows are asked for. */
enum { PROBES = 4, ROWS_AT_ONCE = 1024, OTHER_ROWS = 2048 };

/* Lights and answers; h = F x of `count` elements: elements[k], or k itself where there is no list. */
typedef struct check {
    float *E, *B;
    double *x, *h;
    void *work;
    size_t work_bytes, count;
    uint32_t *elements;
    row_block others;
} check;

static void check_free(check *s) {
    free(s->E);
    free(s->B);
    free(s->x);
    free(s->h);
    free(s->work);
    free(s->elements);
    row_block_free(&s->others);
}

static lam_status check_make(const build_problem *problem, const lam_operator *op, check *s,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels;
    *s = (check){.work_bytes = lam_operator_work_bytes(op, 1), .count = n};
    s->E = memory_allocate(C, n * sizeof *s->E, "self-check", error);
    s->B = memory_allocate(C, n * sizeof *s->B, "self-check", error);
    s->x = memory_allocate(n, sizeof *s->x, "self-check", error);
    s->h = memory_allocate(n, sizeof *s->h, "self-check", error);
    s->work = memory_allocate(1, s->work_bytes, "self-check", error);
    if (s->E == NULL || s->B == NULL || s->x == NULL || s->h == NULL || s->work == NULL) TRY(LAM_ERR_MEMORY);
    if (problem->stream != NULL) {
        s->count = n < OTHER_ROWS ? n : OTHER_ROWS;
        s->elements = memory_allocate(s->count, sizeof *s->elements, "self-check", error);
        if (s->elements == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t k = 0; k < s->count; k++) s->elements[k] = problem->order[k * n / s->count];
        TRY(row_source_get(&problem->stream->others, s->elements, s->count, &s->others, error));
    }
done:
    return status;
}

static void multiply(const build_problem *problem, const check *s) {
    const size_t n = problem->n;
    if (problem->stream == NULL) {
#pragma omp parallel for schedule(dynamic, 1)
        for (size_t first = 0; first < n; first += ROWS_AT_ONCE)
            csr_multiply_rows(problem->F, first, first + ROWS_AT_ONCE < n ? first + ROWS_AT_ONCE : n, 1, s->x,
                              s->h);
        return;
    }
    for (size_t k = 0; k < s->count; k++) {
        double sum = 0;
        for (size_t e = 0; e < s->others.length[k]; e++)
            sum += (double)s->others.data[k][e] * s->x[s->others.indices[k][e]];
        s->h[k] = sum;
    }
}

/* |E - (B~ - rho F B~)| / |E| and |B~ - 1| / |1| of one channel. */
static void check_channel(const build_problem *problem, const check *s, size_t c, double *residual,
                          double *from_one) {
    const size_t n = problem->n;
    const float *rho = problem->reflectance + c * n, *E = s->E + c * n, *B = s->B + c * n;
    double left = 0, all = 0, off = 0, area = 0;
    for (size_t i = 0; i < n; i++) s->x[i] = (double)B[i];
    multiply(problem, s);
    for (size_t k = 0; k < s->count; k++) {
        const size_t i = s->elements != NULL ? s->elements[k] : k;
        const double r = (double)E[i] - (s->x[i] - (double)rho[i] * s->h[k]), a = problem->area[i];
        left += a * r * r;
        all += a * (double)E[i] * (double)E[i];
    }
    for (size_t i = 0; i < n; i++) {
        off += problem->area[i] * (s->x[i] - 1) * (s->x[i] - 1);
        area += problem->area[i];
    }
    *residual = sqrt(left / all);
    *from_one = sqrt(off / area);
}

lam_status self_check(const build_problem *problem, const double *row_sums, const lam_operator *op,
                      uint64_t seed, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels;
    check s;
    TRY(check_make(problem, op, &s, error));
    report->probe_residual = report->uniform_error = 0;
    for (size_t probe = 0; probe <= PROBES; probe++) {
        double worst = 0;
        for (size_t i = 0; i < n; i++) {
            for (size_t c = 0; c < C; c++) {
                seed = seed * 6364136223846793005u + 1442695040888963407u;
                s.E[c * n + i] =
                    probe < PROBES
                        ? (float)(seed >> 40) * 0x1p-24f
                        : (float)fmax(1 - (double)problem->reflectance[c * n + i] * row_sums[i], 0);
            }
        }
        TRY(lam_operator_apply(op, 1, LAM_RADIOSITY, s.E, s.B, s.work, s.work_bytes, error));
        for (size_t c = 0; c < C; c++) {
            double residual, from_one;
            check_channel(problem, &s, c, &residual, &from_one);
            worst = fmax(worst, probe < PROBES ? residual : from_one);
        }
        if (probe < PROBES)
            report->probe_residual += worst / PROBES;
        else
            report->uniform_error = worst;
    }
done:
    check_free(&s);
    return status;
}
