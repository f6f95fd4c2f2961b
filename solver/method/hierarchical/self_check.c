#include "solver/method/hierarchical/self_check.h"

#include "solver/base/random.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Random emissions, then smooth ones, whose residuals are found, and one that gives uniform radiosity; rows
 * of F that a thread multiplies at a time. */
enum { PROBES = 4, SMOOTH = 2, TRIED = PROBES + SMOOTH, EMISSIONS = TRIED + 1, ROWS_AT_ONCE = 1024 };
/* Of streamed F one row in ONE_IN is used, within these limits. */
enum { ONE_IN = 32, OTHERS_LEAST = 64, OTHERS_MOST = 2048 };

/* Below this share of epsilon the residual of smooth light is as it should be. Of rooms, patio, Cornell box,
 * city and canopy of 2,500 elements and more, by pairs and blocks at epsilon .02 to .2, it is .01 to .15 of
 * it. */
static const double share_of_epsilon = .5;

/* Emissions, their answers, and h = F B~ of all but the last. */
typedef struct check {
    float *E, *B; /* [EMISSIONS][C][n] */
    double *h;    /* [TRIED][C][count], at `elements` */
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
    s->h = memory_allocate(TRIED * C, s->count * sizeof *s->h, "self-check", error);
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
    for (size_t v = 0; v < TRIED * problem->n_channels; v++) {
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
    const size_t n = problem->n, m = TRIED * problem->n_channels;
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
        for (size_t v = 0; v < TRIED * problem->n_channels; v++) {
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

/* x that has half of the area on either side. */
static double middle(const build_problem *problem, double low, double high) {
    double all = 0;
    for (size_t i = 0; i < problem->n; i++) all += problem->area[i];
    for (int step = 0; step < 32; step++) {
        const double x = .5 * (low + high);
        double below = 0;
        for (size_t i = 0; i < problem->n; i++) below += problem->centre[i][0] < x ? problem->area[i] : 0;
        *(2 * below < all ? &low : &high) = x;
    }
    return .5 * (low + high);
}

/* Light of half of the area, and light that grows along x from 0 to 1. Neither is made up for: what is
 * imposed on the operator, or corrected afterwards, is the answer to light that gives uniform radiosity. */
static void fill_smooth(const build_problem *problem, float *E) {
    const size_t n = problem->n, C = problem->n_channels;
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < n; i++) {
        low = fmin(low, problem->centre[i][0]);
        high = fmax(high, problem->centre[i][0]);
    }
    const double half = middle(problem, low, high), width = high > low ? high - low : 1;
    for (size_t c = 0; c < C; c++)
        for (size_t i = 0; i < n; i++) {
            const double x = problem->centre[i][0];
            E[c * n + i] = x < half ? 1 : 0;
            E[(C + c) * n + i] = (float)((x - low) / width);
        }
}

/* |E - (B~ - rho F B~)| of one emission and channel over |E|, or over the light |rho F B~| that it reflects.
 */
static double residual(const build_problem *problem, const check *s, size_t e, size_t c, bool of_reflected) {
    const size_t n = problem->n, v = e * problem->n_channels + c;
    const float *rho = problem->reflectance + c * n, *E = s->E + v * n, *B = s->B + v * n;
    double left = 0, all = 0;
    for (size_t k = 0; k < s->count; k++) {
        const size_t i = s->elements != NULL ? s->elements[k] : k;
        const double reflected = (double)rho[i] * s->h[v * s->count + k];
        const double r = (double)E[i] - ((double)B[i] - reflected),
                     d = of_reflected ? reflected : (double)E[i];
        left += problem->area[i] * r * r;
        all += problem->area[i] * d * d;
    }
    return all > 0 ? sqrt(left / all) : 0;
}

/* |B~ - 1| / |1| of the last emission. */
static double uniform_error(const build_problem *problem, const check *s, size_t c) {
    const size_t n = problem->n;
    const float *B = s->B + (TRIED * problem->n_channels + c) * n;
    double off = 0, area = 0;
    for (size_t i = 0; i < n; i++) {
        off += problem->area[i] * ((double)B[i] - 1) * ((double)B[i] - 1);
        area += problem->area[i];
    }
    return sqrt(off / area);
}

lam_status self_check(const build_problem *problem, const double *row_sums, const lam_operator *op,
                      double epsilon, uint64_t seed, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels;
    check s;
    TRY(check_make(problem, op, &s, error));
    for (size_t e = 0; e < PROBES; e++)
        for (size_t i = 0; i < n; i++)
            for (size_t c = 0; c < C; c++) s.E[(e * C + c) * n + i] = random_to_float(random_lcg(&seed));
    fill_smooth(problem, s.E + PROBES * C * n);
    for (size_t c = 0; c < C; c++)
        for (size_t i = 0; i < n; i++)
            s.E[(TRIED * C + c) * n + i] =
                (float)fmax(1 - (double)problem->reflectance[c * n + i] * row_sums[i], 0);
    TRY(lam_operator_apply(op, EMISSIONS, LAM_RADIOSITY, s.E, s.B, s.work, s.work_bytes, error));
    TRY(problem->stream != NULL   ? multiply_others(problem, &s, error)
        : problem->blocks != NULL ? multiply_blocks(problem, &s, error)
                                  : multiply(problem, &s, error));
    double mean_residual = 0, smooth = 0, largest = 0;
    for (size_t e = 0; e < TRIED; e++) {
        double worst = 0;
        for (size_t c = 0; c < C; c++) worst = fmax(worst, residual(problem, &s, e, c, e >= PROBES));
        if (e < PROBES)
            mean_residual += worst / PROBES;
        else
            smooth = fmax(smooth, worst);
    }
    for (size_t c = 0; c < C; c++) largest = fmax(largest, uniform_error(problem, &s, c));
    report_number(report, "probe_residual", mean_residual);
    report_number(report, "smooth_residual", smooth);
    const double limit = share_of_epsilon * epsilon + problem->noise;
    if (smooth > limit && problem->importance == NULL) report->doubtful = limit;
    report_number(report, "uniform_error", largest);
done:
    check_free(&s);
    return status;
}
