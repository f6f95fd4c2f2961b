#include "solver/formfactor/repair.h"

#include "solver/formfactor/rows/upper.h"
#include "solver/linalg/core.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sweeps end when every row sum is this close to its target (single precision cannot hold more), or after the
 * last: the remaining difference goes outside. */
static const double sweep_tolerance = 2e-8;
enum { MAX_SWEEPS = 200 };

/* Of Anderson's extrapolation: previous steps that are kept, sweeps that are tried, and the factor by which
 * the worst row may exceed the best one so far. */
enum { STEPS = 5, MAX_STEPS = 60, GROWTH_MOST = 4 };
/* Added to the unit diagonal of the normal equations, which nearly parallel steps make singular. */
static const double alike = 1e-11;

/* Rows are cut into slices that do not depend on the number of threads. Each slice adds to sums of its own,
 * which are then added in the order of the slices. */
enum { SLICES = 32 };

typedef struct sums {
    size_t n;
    size_t first[SLICES + 1]; /* rows of the slices, about equally many entries in each */
    double *of_slices;        /* [SLICES][n] */
} sums;

static lam_status sums_init(sums *s, const csr *G, lam_error *error) {
    *s = (sums){.n = G->n};
    s->of_slices = memory_allocate(G->n, SLICES * sizeof *s->of_slices, "row sums", error);
    if (s->of_slices == NULL) return LAM_ERR_MEMORY;
    size_t row = 0;
    for (size_t k = 1; k <= SLICES; k++) {
        while (row < G->n && G->indptr[row] < G->indptr[G->n] / SLICES * k) row++;
        s->first[k] = k == SLICES ? G->n : row;
    }
    return LAM_OK;
}

/* total_i = sum over slices; a slice of the upper triangle adds nothing to rows before its first. */
static void sums_add(const sums *s, double *total) {
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < s->n; i++) {
        double sum = 0;
        for (size_t k = 0; k < SLICES && s->first[k] <= i; k++) sum += s->of_slices[k * s->n + i];
        total[i] = sum;
    }
}

/* r_i = d_i (A_i outside_i + sum_j g_ij d_j) */
static void scaled_row_sums(const csr *G, sums *s, const double *area, const double *outside, const double *d,
                            double *r) {
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < SLICES; k++) {
        double *to = s->of_slices + k * s->n;
        memset(to + s->first[k], 0, (s->n - s->first[k]) * sizeof *to);
        for (size_t i = s->first[k]; i < s->first[k + 1]; i++) {
            const double d_i = d[i];
            double sum = 0;
            for (uint64_t p = G->indptr[i]; p < G->indptr[i + 1]; p++) {
                const uint32_t j = G->indices[p];
                const double g = (double)G->data[p];
                sum += g * d[j];
                to[j] += g * d_i;
            }
            to[i] += sum;
        }
    }
    sums_add(s, r);
    for (size_t i = 0; i < s->n; i++) r[i] = d[i] * (area[i] * outside[i] + r[i]);
}

/* A scaling d in progress, its row sums r, and the largest |r_i / A_i - 1|. */
typedef struct scaling {
    const csr *G;
    sums *s;
    const double *area, *outside;
    double *d, *r;
    double worst;
    size_t products; /* with G */
} scaling;

static void measure(scaling *c) {
    scaled_row_sums(c->G, c->s, c->area, c->outside, c->d, c->r);
    c->products++;
    c->worst = 0;
    for (size_t i = 0; i < c->G->n; i++)
        if (c->r[i] > 0) c->worst = fmax(c->worst, fabs(c->r[i] / c->area[i] - 1));
}

/* d_i <- d_i sqrt(A_i / r_i) until r_i = A_i. The root damps the sweep: without it d oscillates where F is
 * bipartite (two facing plates). Leaves r and worst up to date. */
static void sweep(scaling *c) {
    measure(c);
    for (int count = 0; count < MAX_SWEEPS && c->worst > sweep_tolerance; count++) {
        for (size_t i = 0; i < c->G->n; i++)
            if (c->r[i] > 0) c->d[i] *= sqrt(c->area[i] / c->r[i]);
        measure(c);
    }
}

/* The last steps of x = log d and of f = log(A / r) / 2, which a sweep adds to x. */
typedef struct history {
    size_t n, held, next;
    double *x, *f;                 /* [n], before the present step */
    double *dx[STEPS], *df[STEPS]; /* [n] each */
} history;

static lam_status history_create(history *h, size_t n, lam_error *error) {
    double *all = memory_allocate(n, (2 + 2 * STEPS) * sizeof *all, "row scales", error);
    *h = (history){.n = n, .x = all};
    if (all == NULL) return LAM_ERR_MEMORY;
    h->f = all + n;
    for (size_t k = 0; k < STEPS; k++) {
        h->dx[k] = all + (2 + 2 * k) * n;
        h->df[k] = all + (3 + 2 * k) * n;
    }
    return LAM_OK;
}

static double product(const double *a, const double *b, const double *weight, size_t n) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += weight[i] * a[i] * b[i];
    return sum;
}

/* gamma = argmin |f - sum gamma_k df_k|, weighted by areas, by the normal equations of the df_k scaled to
 * length 1; false where these are singular. */
static bool least_squares(const history *h, const double *f, const double *area, double gamma[STEPS]) {
    double A[STEPS * STEPS], b[STEPS], length[STEPS], rcond;
    const size_t held = h->held;
    for (size_t k = 0; k < held; k++) {
        for (size_t l = 0; l <= k; l++)
            A[k * held + l] = A[l * held + k] = product(h->df[k], h->df[l], area, h->n);
        b[k] = product(h->df[k], f, area, h->n);
        length[k] = sqrt(A[k * held + k]);
        if (!(length[k] > 0)) return false;
    }
    for (size_t k = 0; k < held; k++) {
        for (size_t l = 0; l < held; l++) A[k * held + l] /= length[k] * length[l];
        A[k * held + k] += alike; /* the diagonal is 1 */
    }
    if (core_invert(held, A, &rcond, NULL) != LAM_OK) return false;
    for (size_t k = 0; k < held; k++) {
        gamma[k] = 0;
        for (size_t l = 0; l < held; l++) gamma[k] += A[k * held + l] * b[l] / length[l];
        gamma[k] /= length[k];
    }
    return true;
}

/* Finds the scaling of sweep from d = 1 with far fewer sweeps: each is extrapolated from the steps before
 * (Anderson 1965). before receives the row sums of d = 1. settled is false where it does not converge:
 * perhaps no scaling closes every row. */
static lam_status extrapolate(scaling *c, double *before, bool *settled, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->G->n;
    history h = {0};
    double least = INFINITY;
    *settled = false;
    TRY(history_create(&h, n, error));
    for (size_t i = 0; i < n; i++) c->d[i] = 1;
    measure(c);
    memcpy(before, c->r, n * sizeof *before);
    for (int count = 0; count < MAX_STEPS; count++) {
        *settled = c->worst <= sweep_tolerance;
        if (*settled || c->worst > GROWTH_MOST * least) break;
        least = fmin(least, c->worst);
        double *dx = h.dx[h.next], *df = h.df[h.next], gamma[STEPS];
        for (size_t i = 0; i < n; i++) {
            const double x = log(c->d[i]), f = c->r[i] > 0 ? .5 * log(c->area[i] / c->r[i]) : 0;
            dx[i] = x - h.x[i];
            df[i] = f - h.f[i];
            h.x[i] = x;
            h.f[i] = f;
        }
        if (count > 0) {
            h.next = (h.next + 1) % STEPS;
            if (h.held < STEPS) h.held++;
        }
        if (!least_squares(&h, h.f, c->area, gamma)) h.held = 0;
        for (size_t i = 0; i < n; i++) {
            double x = h.x[i] + h.f[i];
            for (size_t k = 0; k < h.held; k++) x -= gamma[k] * (h.dx[k][i] + h.df[k][i]);
            c->d[i] = exp(x);
        }
        measure(c);
    }
done:
    free(h.x);
    return status;
}

/* Finds d with r_i = A_i. Where no scaling closes every row, rows with r_i > A_i are scaled down, and their
 * pairs with them. */
static lam_status settle(scaling *c, double *before, lam_error *error) {
    lam_status status = LAM_OK;
    bool settled;
    TRY(extrapolate(c, before, &settled, error));
    if (!settled) {
        for (size_t i = 0; i < c->G->n; i++) c->d[i] = 1;
        sweep(c);
    }
    for (size_t i = 0; i < c->G->n; i++)
        if (c->r[i] > c->area[i]) c->d[i] *= c->area[i] / c->r[i];
done:
    return status;
}

/* g_ij <- g_ij d_i d_j; sets the row sums of F; returns the largest error of reciprocity. */
static double scale(csr *G, sums *s, const double *area, const double *d, double *row_sums) {
    double worst = 0;
#pragma omp parallel for schedule(dynamic, 1) reduction(max : worst)
    for (size_t k = 0; k < SLICES; k++) {
        double *to = s->of_slices + k * s->n;
        memset(to + s->first[k], 0, (s->n - s->first[k]) * sizeof *to);
        for (size_t i = s->first[k]; i < s->first[k + 1]; i++) {
            double sum = 0;
            for (uint64_t p = G->indptr[i]; p < G->indptr[i + 1]; p++) {
                const uint32_t j = G->indices[p];
                G->data[p] = (float)((double)G->data[p] * d[i] * d[j]);
                const double forward = (double)upper_factor(G->data[p], area[i]),
                             backward = (double)upper_factor(G->data[p], area[j]);
                sum += forward;
                to[j] += backward;
                const double one = area[i] * forward, other = area[j] * backward;
                if (fmax(one, other) > 0) worst = fmax(worst, fabs(one - other) / fmax(one, other));
            }
            to[i] += sum;
        }
    }
    sums_add(s, row_sums);
    return worst;
}

lam_status repair_close(csr *G, const double *area, const double *outside, form_factors *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = G->n;
    sums s = {0};
    double *before = memory_allocate(n, sizeof *before, "row sums", error);
    double *d = memory_allocate(n, sizeof *d, "row scales", error);
    double *r = memory_allocate(n, sizeof *r, "row sums", error);
    double *row_sums = memory_allocate(n, sizeof *row_sums, "row sums", error);
    if (before == NULL || d == NULL || r == NULL || row_sums == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sums_init(&s, G, error));

    scaling c = {.G = G, .s = &s, .area = area, .outside = outside, .d = d, .r = r};
    TRY(settle(&c, before, error));
    out->repair_products = c.products;
    out->reciprocity_error = scale(G, &s, area, d, row_sums);
    out->closure_error = out->repair_max = 0;
    double repair = 0, total_area = 0;
    for (size_t i = 0; i < n; i++) {
        before[i] = before[i] / area[i] - 1;
        const double total = row_sums[i] + d[i] * outside[i], change = fabs(before[i]);
        /* A row that sees nothing at all has nothing to close. */
        if (total > 0) out->closure_error = fmax(out->closure_error, fabs(1 - total));
        out->repair_max = fmax(out->repair_max, change);
        repair += area[i] * change;
        total_area += area[i];
    }
    out->repair_mean = repair / total_area;
    out->row_sums = row_sums;
    out->repair = before;
    row_sums = before = NULL;
done:
    free(s.of_slices);
    free(before);
    free(d);
    free(r);
    free(row_sums);
    return status;
}
