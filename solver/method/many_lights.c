/* Up to 32 emissions at a time are solved by conjugate gradients, (I - R^1/2 S R^1/2) u = R^1/2 (h0 + S e)
 * with S = A^1/2 F A^-1/2, e = A^1/2 E, h0 = A^1/2 H0; T = rho' A^-1/2 (h0 + S (e + R^1/2 u)).
 * many_lights_jacobi() sweeps B := E' + R F B instead (Aguerre 2016, eqs. 2.5 and 4.8). */
#include "solver/method/many_lights.h"

#include "solver/linalg/csr_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows that a thread takes at a time; sums over all rows are made of theirs, in their order. */
enum { ROWS = 64 };

/* Multiplications in a product with F below which threads cost more than they bring. */
enum { THREADS_WORTH = 200000 };

/* Starts from the true residual at most, and sweeps of each. A residual that single precision cannot bring
 * below this has not settled. */
enum { MOST_STARTS = 6, MOST_SWEEPS = 2000 };
static const double unsettled = 1e-3;

/* The space of one block: vectors side by side, [n][width]. e, h0: A^1/2 E, A^1/2 H0. */
typedef struct block {
    const many_lights_input *c;
    size_t n, width, first, count; /* columns first ... first + count - 1, then zeros */
    csr_float_row *multiply;
    float *e, *h0, *u, *r, *p, *q, *t;
    float *root_area, *root_rho; /* [n] */
    double *sums;                /* [chunks][width] */
    bool many;                   /* enough for more than one thread */
    size_t products;
} block;

static size_t chunks_of(const block *b) {
    return (b->n + ROWS - 1) / ROWS;
}

static float *vectors(size_t n, size_t width, lam_error *error) {
    float *x = NULL;
    if (posix_memalign((void **)&x, 64, (n + 1) * width * sizeof *x) != 0) {
        (void)status_fail(error, LAM_ERR_MEMORY, "emitters: cannot allocate %zu vectors of %zu elements",
                          width, n);
        return NULL;
    }
    memset(x, 0, (n + 1) * width * sizeof *x);
    return x;
}

static void block_free(block *b) {
    free(b->e);
    free(b->h0);
    free(b->u);
    free(b->r);
    free(b->p);
    free(b->q);
    free(b->t);
    free(b->root_area);
    free(b->root_rho);
    free(b->sums);
}

static lam_status block_make(const many_lights_input *c, size_t width, block *b, lam_error *error) {
    *b = (block){.c = c, .n = c->n, .width = width, .multiply = csr_floats_row(width)};
    b->many = c->F->indptr[c->n] * width > THREADS_WORTH;
    float **const all[] = {&b->e, &b->h0, &b->u, &b->r, &b->p, &b->q, &b->t};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        *all[k] = vectors(c->n, width, error);
        if (*all[k] == NULL) return LAM_ERR_MEMORY;
    }
    b->root_area = memory_allocate(c->n, sizeof *b->root_area, "emitters", error);
    b->root_rho = memory_allocate(c->n, sizeof *b->root_rho, "emitters", error);
    b->sums = memory_allocate(chunks_of(b), width * sizeof *b->sums, "emitters", error);
    if (b->root_area == NULL || b->root_rho == NULL || b->sums == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < c->n; i++) {
        b->root_area[i] = (float)sqrt(c->area[i]);
        b->root_rho[i] = sqrtf(c->rho[i]);
    }
    return LAM_OK;
}

/* x = A^1/2 y for the block's columns of y [m][n]; y NULL: 0. */
static void gather(const block *b, const float *y, float *x) {
    for (size_t i = 0; i < b->n; i++)
        for (size_t v = 0; v < b->width; v++)
            x[i * b->width + v] =
                y != NULL && v < b->count ? b->root_area[i] * y[(b->first + v) * b->n + i] : 0;
}

/* Computes y = S x row by row, S = A^1/2 F A^-1/2. `finish` turns each row of S x into a row of the result,
 * and its sums over all rows go into b->sums. */
typedef void finish_row(block *b, size_t i, const float *S_x, double *sums);

static void multiply_S(block *b, const float *x, finish_row *finish, double *sums) {
    const size_t n = b->n, width = b->width, n_chunks = chunks_of(b);
    const csr *F = b->c->F;
    b->products++;
#pragma omp parallel for schedule(static) if (b->many)
    for (size_t i = 0; i < n; i++) {
        const float by = 1 / b->root_area[i];
        for (size_t v = 0; v < width; v++) b->t[i * width + v] = x[i * width + v] * by;
    }
#pragma omp parallel for schedule(dynamic, 1) if (b->many)
    for (size_t k = 0; k < n_chunks; k++) {
        const size_t last = (k + 1) * ROWS < n ? (k + 1) * ROWS : n;
        float row[CSR_FLOATS_WIDTH];
        double *chunk = b->sums + k * width;
        memset(chunk, 0, width * sizeof *chunk);
        for (size_t i = k * ROWS; i < last; i++) {
            const uint64_t first = F->indptr[i];
            b->multiply(F->indices + first, F->data + first, F->indptr[i + 1] - first, b->t, row);
            for (size_t v = 0; v < width; v++) row[v] *= b->root_area[i];
            finish(b, i, row, chunk);
        }
    }
    memset(sums, 0, width * sizeof *sums);
    for (size_t k = 0; k < n_chunks; k++)
        for (size_t v = 0; v < width; v++) sums[v] += b->sums[k * width + v];
}

/* r = R^1/2 (h0 + S (e + R^1/2 u)) - u, the true residual, which p begins with; |r|^2. */
static void finish_residual(block *b, size_t i, const float *S_x, double *sums) {
    const size_t at = i * b->width;
    for (size_t v = 0; v < b->width; v++) {
        const float r = b->root_rho[i] * (b->h0[at + v] + S_x[v]) - b->u[at + v];
        b->r[at + v] = b->p[at + v] = r;
        sums[v] += (double)r * (double)r;
    }
}

/* q = p - R^1/2 S R^1/2 p; p . q */
static void finish_step(block *b, size_t i, const float *S_x, double *sums) {
    const size_t at = i * b->width;
    for (size_t v = 0; v < b->width; v++) {
        const float q = b->p[at + v] - b->root_rho[i] * S_x[v];
        b->q[at + v] = q;
        sums[v] += (double)b->p[at + v] * (double)q;
    }
}

/* q = rho' A^-1/2 (h0 + S x): the answer. */
static void finish_answer(block *b, size_t i, const float *S_x, double *sums) {
    const float rho = b->c->rho[i] > 0 ? b->c->rho[i] : 1, by = rho / b->root_area[i];
    (void)sums;
    for (size_t v = 0; v < b->width; v++) b->q[i * b->width + v] = by * (b->h0[i * b->width + v] + S_x[v]);
}

/* q = e + R^1/2 u */
static void lit(block *b) {
#pragma omp parallel for schedule(static) if (b->many)
    for (size_t i = 0; i < b->n; i++)
        for (size_t v = 0; v < b->width; v++)
            b->q[i * b->width + v] = b->e[i * b->width + v] + b->root_rho[i] * b->u[i * b->width + v];
}

/* u += alpha p, r -= alpha q; sums of u^2 and r^2 */
static void advance(block *b, const float *alpha, double *uu, double *rr) {
    const size_t width = b->width, n_chunks = chunks_of(b);
    for (int which = 0; which < 2; which++) {
        float *x = which == 0 ? b->u : b->r;
        const float *y = which == 0 ? b->p : b->q;
        double *sums = which == 0 ? uu : rr;
#pragma omp parallel for schedule(static) if (b->many)
        for (size_t k = 0; k < n_chunks; k++) {
            const size_t last = (k + 1) * ROWS < b->n ? (k + 1) * ROWS : b->n;
            double *chunk = b->sums + k * width;
            memset(chunk, 0, width * sizeof *chunk);
            for (size_t i = k * ROWS; i < last; i++)
                for (size_t v = 0; v < width; v++) {
                    const float z = x[i * width + v] + (which == 0 ? alpha[v] : -alpha[v]) * y[i * width + v];
                    x[i * width + v] = z;
                    chunk[v] += (double)z * (double)z;
                }
        }
        memset(sums, 0, width * sizeof *sums);
        for (size_t k = 0; k < n_chunks; k++)
            for (size_t v = 0; v < width; v++) sums[v] += b->sums[k * width + v];
    }
}

static bool all_below(const block *b, const double *rr, const double *uu, double tolerance) {
    for (size_t v = 0; v < b->count; v++)
        if (rr[v] > tolerance * tolerance * uu[v]) return false;
    return true;
}

/* Conjugate gradients from r and p as they are, until the residual they carry along is below tolerance. */
static lam_status descend(block *b, double tolerance, double *rr, double *uu, lam_error *error) {
    double pq[CSR_FLOATS_WIDTH], next[CSR_FLOATS_WIDTH];
    float alpha[CSR_FLOATS_WIDTH], beta[CSR_FLOATS_WIDTH];
    for (size_t sweep = 0; sweep < MOST_SWEEPS && !all_below(b, rr, uu, tolerance); sweep++) {
        if (progress_cancelled(b->c->progress)) return status_fail(error, LAM_ERR_CANCELLED, "cancelled");
        /* q holds R^1/2 p until a row of the product takes its place: rows are read from t alone. */
#pragma omp parallel for schedule(static) if (b->many)
        for (size_t i = 0; i < b->n; i++)
            for (size_t v = 0; v < b->width; v++)
                b->q[i * b->width + v] = b->root_rho[i] * b->p[i * b->width + v];
        multiply_S(b, b->q, finish_step, pq);
        bool any = false;
        for (size_t v = 0; v < b->width; v++) {
            alpha[v] = pq[v] > 0 ? (float)(rr[v] / pq[v]) : 0;
            any = any || alpha[v] > 0;
        }
        if (!any) break;
        advance(b, alpha, uu, next);
        for (size_t v = 0; v < b->width; v++) beta[v] = rr[v] > 0 ? (float)(next[v] / rr[v]) : 0;
        memcpy(rr, next, b->width * sizeof *rr);
#pragma omp parallel for schedule(static) if (b->many)
        for (size_t i = 0; i < b->n; i++)
            for (size_t v = 0; v < b->width; v++)
                b->p[i * b->width + v] = b->r[i * b->width + v] + beta[v] * b->p[i * b->width + v];
    }
    return LAM_OK;
}

static double worst_residual(const block *b, const double *rr, const double *uu) {
    double worst = 0;
    for (size_t v = 0; v < b->count; v++)
        if (uu[v] > 0) worst = fmax(worst, sqrt(rr[v] / uu[v]));
    return worst;
}

/* One block: q becomes T, side by side. */
static lam_status solve_block(block *b, double tolerance, double *residual, lam_error *error) {
    lam_status status = LAM_OK;
    double rr[CSR_FLOATS_WIDTH], uu[CSR_FLOATS_WIDTH] = {0}, before = INFINITY;
    gather(b, b->c->E, b->e);
    gather(b, b->c->H0, b->h0);
    memset(b->u, 0, b->n * b->width * sizeof *b->u);
    for (int start = 0;; start++) {
        lit(b);
        multiply_S(b, b->q, finish_residual, rr);
        *residual = start == 0 ? 1 : worst_residual(b, rr, uu);
        /* Where another start has not halved it single precision has no more to give. */
        if ((start > 0 && all_below(b, rr, uu, tolerance)) || start == MOST_STARTS || *residual > .5 * before)
            break;
        if (start > 0) before = *residual;
        TRY(descend(b, .5 * tolerance, rr, uu, error));
    }
    if (!(*residual <= unsettled))
        FAIL(error, LAM_ERR_NUMERIC,
             "emitters: the light of some does not settle (residual %.2g after %zu sweeps); lower the "
             "largest reflectance",
             *residual, b->products);
    lit(b);
    multiply_S(b, b->q, finish_answer, rr);
done:
    return status;
}

static void scatter(const block *b, const float *x, float *T) {
    for (size_t v = 0; v < b->count; v++)
        for (size_t i = 0; i < b->n; i++) T[(b->first + v) * b->n + i] = x[i * b->width + v];
}

/* Calls `each` for blocks of columns; its result lies in q. */
typedef lam_status each_block(block *b, void *context, lam_error *error);

static lam_status in_blocks(const many_lights_input *c, each_block *each, void *context, float *T,
                            lam_error *error) {
    lam_status status = LAM_OK;
    block b = {.c = NULL};
    for (size_t first = 0; first < c->m; first += CSR_FLOATS_WIDTH) {
        const size_t count = c->m - first < CSR_FLOATS_WIDTH ? c->m - first : CSR_FLOATS_WIDTH;
        const size_t width = csr_floats_width(count);
        progress_report(c->progress, c->stage, (double)first / (double)c->m);
        if (b.width != width) {
            block_free(&b);
            TRY(block_make(c, width, &b, error));
        }
        b.first = first;
        b.count = count;
        b.products = 0;
        TRY(each(&b, context, error));
        scatter(&b, b.q, T);
    }
    progress_report(c->progress, c->stage, 1);
done:
    block_free(&b);
    return status;
}

typedef struct solving {
    double tolerance;
    many_lights_report *report;
} solving;

static lam_status solve_one(block *b, void *context, lam_error *error) {
    const solving *s = context;
    double residual;
    const lam_status status = solve_block(b, s->tolerance, &residual, error);
    if (b->products > s->report->sweeps) s->report->sweeps = b->products;
    if (status == LAM_OK) s->report->residual = fmax(s->report->residual, residual);
    return status;
}

lam_status many_lights_solve(const many_lights_input *c, double tolerance, float *T,
                             many_lights_report *report, lam_error *error) {
    solving s = {tolerance, report};
    *report = (many_lights_report){0};
    return in_blocks(c, solve_one, &s, T, error);
}

/* u = rho (h0 + S x) is the light that leaves again, times A^1/2. */
static void finish_sweep(block *b, size_t i, const float *S_x, double *sums) {
    (void)sums;
    for (size_t v = 0; v < b->width; v++)
        b->u[i * b->width + v] = b->c->rho[i] * (b->h0[i * b->width + v] + S_x[v]);
}

static lam_status jacobi_one(block *b, void *context, lam_error *error) {
    double unused[CSR_FLOATS_WIDTH];
    const size_t sweeps = *(const size_t *)context;
    gather(b, b->c->E, b->e);
    gather(b, b->c->H0, b->h0);
    for (size_t i = 0; i < b->n; i++)
        for (size_t v = 0; v < b->width; v++) b->u[i * b->width + v] = b->c->rho[i] * b->h0[i * b->width + v];
    for (size_t sweep = 0; sweep <= sweeps; sweep++) {
        if (progress_cancelled(b->c->progress)) return status_fail(error, LAM_ERR_CANCELLED, "cancelled");
#pragma omp parallel for schedule(static) if (b->many)
        for (size_t i = 0; i < b->n * b->width; i++) b->q[i] = b->e[i] + b->u[i];
        if (sweep + 1 < sweeps)
            multiply_S(b, b->q, finish_sweep, unused);
        else {
            multiply_S(b, b->q, finish_answer, unused);
            break;
        }
    }
    return LAM_OK;
}

lam_status many_lights_jacobi(const many_lights_input *c, size_t sweeps, float *T, lam_error *error) {
    return in_blocks(c, jacobi_one, &sweeps, T, error);
}
