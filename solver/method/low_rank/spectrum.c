#include "solver/method/low_rank/spectrum.h"

#include "solver/method/low_rank/sketch.h"

#include <lapacke.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VECTORS = 8 };

void spectrum_free(spectrum *s) {
    free(s->value);
    free(s->count);
    *s = (spectrum){0};
}

/* Lanczos with VECTORS starts at once: X is q_s, before q_s-1, Y is S q_s; [n][VECTORS] each. alpha and beta,
 * [VECTORS][steps], become the tridiagonal matrices; taken[v] says how many rows of one there are. Vectors
 * lose their orthogonality in time, which gives some values twice but leaves the sum of their weights. */
typedef struct recurrence {
    size_t n, steps;
    float *X, *before, *Y;
    double *alpha, *beta;
    size_t taken[VECTORS];
    bool ended[VECTORS];
} recurrence;

static void columns_dot(size_t n, const float *X, const float *Y, double sums[VECTORS]) {
    memset(sums, 0, VECTORS * sizeof *sums);
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < VECTORS; v++)
            sums[v] += (double)X[i * VECTORS + v] * (double)Y[i * VECTORS + v];
}

static void columns_scale(size_t n, float *X, const double factor[VECTORS]) {
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < VECTORS; v++)
            X[i * VECTORS + v] = (float)((double)X[i * VECTORS + v] * factor[v]);
}

/* alpha_s = q_s . S q_s;  r = S q_s - alpha_s q_s - beta_s-1 q_s-1;  beta_s = |r|;  q_s+1 = r / beta_s. */
static lam_status step(recurrence *r, const scaled_matrix *S, size_t s, lam_error *error) {
    const size_t n = r->n;
    double alpha[VECTORS], beta[VECTORS], factor[VECTORS];
    const lam_status status = scaled_multiply(S, VECTORS, r->X, r->Y, error);
    if (status != LAM_OK) return status;
    columns_dot(n, r->X, r->Y, alpha);
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < VECTORS; v++) {
            const size_t at = i * VECTORS + v;
            const double last = s > 0 ? r->beta[v * r->steps + s - 1] : 0;
            r->Y[at] = (float)((double)r->Y[at] - alpha[v] * (double)r->X[at] - last * (double)r->before[at]);
        }
    columns_dot(n, r->Y, r->Y, beta);
    for (size_t v = 0; v < VECTORS; v++) {
        beta[v] = sqrt(beta[v]);
        if (!r->ended[v]) {
            r->alpha[v * r->steps + s] = alpha[v];
            r->beta[v * r->steps + s] = beta[v];
            r->taken[v] = s + 1;
        }
        /* Single precision has no more than this to say of where it goes on; zeros do no harm. */
        if (beta[v] <= 1e-6) r->ended[v] = true;
        factor[v] = r->ended[v] ? 0 : 1 / beta[v];
    }
    columns_scale(n, r->Y, factor);
    float *const free_one = r->before;
    r->before = r->X;
    r->X = r->Y;
    r->Y = free_one;
    return LAM_OK;
}

typedef struct node {
    double value, count;
} node;

static int by_falling_value(const void *a, const void *b) {
    const double x = ((const node *)a)->value, y = ((const node *)b)->value;
    return (x < y) - (x > y);
}

/* Eigenvalues of the tridiagonal matrices, each with the square of its eigenvector's first component. */
static lam_status add_nodes(recurrence *r, node *nodes, size_t *n_nodes, lam_error *error) {
    lam_status status = LAM_OK;
    double *vectors = memory_allocate(r->steps, r->steps * sizeof *vectors, "spectrum", error);
    if (vectors == NULL) return LAM_ERR_MEMORY;
    for (size_t v = 0; v < VECTORS; v++) {
        const lapack_int m = (lapack_int)r->taken[v];
        double *const diagonal = r->alpha + v * r->steps;
        const lapack_int info =
            LAPACKE_dstev(LAPACK_ROW_MAJOR, 'V', m, diagonal, r->beta + v * r->steps, vectors, m);
        if (info != 0) FAIL(error, LAM_ERR_NUMERIC, "spectrum: LAPACK dstev returned %d", (int)info);
        for (lapack_int k = 0; k < m; k++)
            nodes[(*n_nodes)++] = (node){fabs(diagonal[k]), vectors[k] * vectors[k] * (double)r->n / VECTORS};
    }
done:
    free(vectors);
    return status;
}

lam_status spectrum_find(const scaled_matrix *S, size_t steps, uint64_t seed, const progress *told,
                         spectrum *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n;
    recurrence r = {.n = n, .steps = steps < n ? steps : n};
    node *nodes = memory_allocate(VECTORS, r.steps * sizeof *nodes, "spectrum", error);
    size_t n_nodes = 0;
    double squares[VECTORS], factor[VECTORS];
    *out = (spectrum){0};
    r.X = memory_allocate(n, VECTORS * sizeof *r.X, "spectrum", error);
    r.before = memory_allocate(n, VECTORS * sizeof *r.before, "spectrum", error);
    r.Y = memory_allocate(n, VECTORS * sizeof *r.Y, "spectrum", error);
    r.alpha = memory_allocate(VECTORS, r.steps * sizeof *r.alpha, "spectrum", error);
    r.beta = memory_allocate(VECTORS, r.steps * sizeof *r.beta, "spectrum", error);
    out->value = memory_allocate(VECTORS, r.steps * sizeof *out->value, "spectrum", error);
    out->count = memory_allocate(VECTORS, r.steps * sizeof *out->count, "spectrum", error);
    if (nodes == NULL || r.X == NULL || r.before == NULL || r.Y == NULL || r.alpha == NULL ||
        r.beta == NULL || out->value == NULL || out->count == NULL)
        TRY(LAM_ERR_MEMORY);

    sketch_gaussian(seed, n, VECTORS, r.X);
    columns_dot(n, r.X, r.X, squares);
    for (size_t v = 0; v < VECTORS; v++) factor[v] = 1 / sqrt(squares[v]);
    columns_scale(n, r.X, factor);
    for (size_t s = 0; s < r.steps; s++) {
        if (progress_cancelled(told)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        progress_report(told, "estimate of singular values", (double)s / (double)r.steps);
        TRY(step(&r, S, s, error));
    }
    TRY(add_nodes(&r, nodes, &n_nodes, error));
    qsort(nodes, n_nodes, sizeof *nodes, by_falling_value);
    out->nodes = n_nodes; /* the weights of a rule are together 1, so counts are n */
    for (size_t k = 0; k < n_nodes; k++) {
        out->value[k] = nodes[k].value;
        out->count[k] = nodes[k].count;
    }
done:
    free(nodes);
    free(r.X);
    free(r.before);
    free(r.Y);
    free(r.alpha);
    free(r.beta);
    if (status != LAM_OK) spectrum_free(out);
    return status;
}

double spectrum_above(const spectrum *s, double x) {
    double above = 0;
    for (size_t k = 0; k < s->nodes; k++) {
        /* Half of a node's count is above it: at it the sum passes through the middle of its step. */
        const double here = above + s->count[k] / 2;
        if (s->value[k] <= x) {
            if (k == 0) return 0;
            const double last = above - s->count[k - 1] / 2, gap = s->value[k - 1] - s->value[k];
            return gap > 0 ? last + (here - last) * (s->value[k - 1] - x) / gap : here;
        }
        above += s->count[k];
    }
    return above;
}

double spectrum_tail(const spectrum *s, double x) {
    double all = 0, tail = 0;
    for (size_t k = 0; k < s->nodes; k++) {
        const double square = s->count[k] * s->value[k] * s->value[k];
        all += square;
        if (s->value[k] <= x) tail += square;
    }
    return all > 0 ? tail / all : 0;
}

static const double bound_reached = .7;

double spectrum_rank(const spectrum *s, double epsilon) {
    return fmax(1, spectrum_above(s, bound_reached * epsilon));
}

double spectrum_left(const spectrum *s, double epsilon) {
    return spectrum_tail(s, bound_reached * epsilon);
}
