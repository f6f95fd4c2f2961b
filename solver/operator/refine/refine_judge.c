/* The certificate of refinement.h: a bound on the error of a column, and the decision whether it is done. */
#include "solver/base/parallel.h"
#include "solver/linalg/csr_rows.h"
#include "solver/operator/refine/refinement.h"

#include <math.h>
#include <string.h>

/* With |r| below this, w = E' + P makes the certificate at most 1.05 times as wide as A^-1 1. */
static const double weights_good = .02;
enum { WEIGHTS_PASSES_MOST = 300 };

/* Factor for the rounding of the bounds themselves, at most n u = 2^32 2^-53. */
#define BOUND_MARGIN 1.000001

/* A certificate multiplies at most 1/SHARE_OF_ROWS of the entries of F; for more, a whole product would
 * improve the answer instead. */
enum { SHARE_OF_ROWS = 8 };

/* Most threads that judge rows, and rows that one takes at a time. */
enum { SHARES_MOST = 64, ROWS_AT_ONCE = 16 };

double refinement_sum_rounding(const refinement *s, size_t column) {
    /* fl(P + r) is within u of itself, fl(E + fl(rho H0)) within 2u of E', which is at most 1, and fl(E' + P)
     * within u of itself; E' + 0 is E'. */
    const double P = s->columns[column].P;
    return REFINE_U *
           (P + (s->count_sum ? (s->columns[column].lit_rounded ? 2 : 0) + (P > 0 ? 1 + P : 0) : 0));
}

/* (sum A x^2)^1/2 of an x of this maximum norm, scaled against underflow. */
static double area_norm(size_t n, const double *area, const double *x, double largest) {
    if (!(largest > 0)) return 0;
    const double scale = 1 / largest;
    double sum = 0;
    if (!isfinite(scale)) return INFINITY;
#pragma omp simd reduction(+ : sum)
    for (size_t i = 0; i < n; i++) sum += area[i] * (scale * x[i]) * (scale * x[i]);
    return largest * sqrt(sum);
}

/* The number of rows with rho k / v |r|_A above `allowed`, which stand first; 0 when they are too large a
 * share of F, or F is not there as rows. */
static size_t rows_in_question(const lam_refiner *refiner, const refine_channel *channel, double norm,
                               double allowed) {
    const csr *F = &refiner->F->F;
    uint64_t entries = 0;
    size_t count = 0;
    if (!refiner_has_rows(refiner)) return 0;
    const uint64_t room = F->indptr[F->n] / SHARE_OF_ROWS;
    for (; count < F->n && channel->rows[count].mean * norm > allowed; count++) {
        const size_t i = channel->rows[count].element;
        entries += F->indptr[i + 1] - F->indptr[i];
        if (entries > room) return 0;
    }
    return count;
}

/* Rows that are judged, and the largest of each share of them. */
typedef struct judged_rows {
    const lam_refiner *refiner;
    const refine_channel *channel;
    csr_double_row *multiply;
    const double *r;
    double rounded;
    double *largest; /* [SHARES_MOST] */
} judged_rows;

static void judge_rows(const void *job, size_t thread, size_t first, size_t last) {
    const judged_rows *j = job;
    const refine_channel *channel = j->channel;
    const csr *F = &j->refiner->F->F;
    for (size_t k = first; k < last; k++) {
        const size_t i = channel->rows[k].element;
        const uint64_t begin = F->indptr[i];
        double h;
        j->multiply(F->indices + begin, F->data + begin, F->indptr[i + 1] - begin, j->r, &h);
        j->largest[thread] =
            fmax(j->largest[thread], (double)channel->rho[i] * (fabs(h) + j->rounded) / channel->v[i]);
    }
}

/* max_i rho_i |(F r)_i| / v_i over the first rows, plus rounding. */
static double largest_of_rows(const lam_refiner *refiner, const refine_channel *channel, size_t count,
                              const double *r, double r_most) {
    const size_t n_threads = refiner->op->n_threads;
    double of_thread[SHARES_MOST] = {0}, largest = 0;
    const judged_rows j = {
        refiner, channel, csr_doubles_row(1), r, refiner->roundings * refiner->row_most * r_most, of_thread};
    parallel_share(n_threads < SHARES_MOST ? n_threads : SHARES_MOST, count, ROWS_AT_ONCE, judge_rows, &j);
    for (size_t t = 0; t < SHARES_MOST; t++) largest = fmax(largest, of_thread[t]);
    return largest;
}

double refine_left(const lam_refiner *refiner, const refine_channel *channel, const double *r, double r_most,
                   double allowed) {
    const size_t n = refiner->op->n;
    const double scale = BOUND_MARGIN * channel->w_most, peak = channel->peak * r_most;
    const double norm = area_norm(n, refiner->F->area, r, r_most);
    double largest = fmin(channel->rows[0].mean * norm, peak);
    if (!(scale * largest > allowed)) return scale * largest;
    const size_t count = rows_in_question(refiner, channel, norm, allowed / scale);
    if (count > 0) {
        largest = largest_of_rows(refiner, channel, count, r, r_most);
        if (count < n) largest = fmax(largest, fmin(channel->rows[count].mean * norm, peak));
    }
    return scale * largest;
}

bool refinement_judge(refinement *s, size_t c) {
    refine_column *col = &s->columns[c];
    const refine_channel *channel = col->channel;
    const size_t n = s->refiner->op->n;
    const double *P = s->P + c * n, *r = s->r + c * n;
    col->r = refine_most(n, r);
    if (s->weights) {
        col->done = col->r + col->error <= weights_good;
        col->stuck = !col->done && col->passes >= WEIGHTS_PASSES_MOST;
        return false;
    }
    double answer = 0;
    for (size_t i = 0; i < n; i++) {
        const double sum = P[i] + r[i];
        answer = sum > answer ? sum : answer;
    }
    col->P = answer;
    /* The caller's B~ - E' may be below P by the rounding of B~. */
    const double sum = refinement_sum_rounding(s, c), wanted = s->tolerance * (answer - sum);
    const double rounded = BOUND_MARGIN * channel->w_most * col->error / channel->v_least;
    const double left = refine_left(s->refiner, channel, r, col->r, wanted - rounded - sum);
    col->bound = left + rounded + sum;
    col->done = col->bound <= wanted || (answer == 0 && left + rounded == 0);
    if (col->done) return false;
    if (col->passes >= REFINE_PASSES_MOST) col->stuck = true;
    if (left > rounded) return false;
    /* Rounding dominates. Computing r anew from P reduces it, unless it did not the last time. When the
     * answer is far below the P that it began with (0 when E' meets no surface), the rounding is that of the
     * first P, and P begins again with 0. */
    if (!col->from_dark && answer < 1e-6 * col->P_first) {
        col->from_dark = true;
        memset(s->P + c * n, 0, n * sizeof *P);
    } else {
        col->stuck = !(col->bound <= .5 * col->at_restart);
    }
    return !col->stuck;
}
