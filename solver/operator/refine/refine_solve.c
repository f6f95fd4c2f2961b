/* Flexible conjugate residuals (GCR, a truncated flexible GMRES): directions z = M~ r in single precision, q
 * = A z in double, each q made orthogonal to the last REFINE_WINDOW ones, steps that minimize |r|. r is
 * updated with P, so that an iteration takes one product with F; a bound on the difference from the true
 * residual is updated too. */
#include "solver/base/parallel.h"
#include "solver/linalg/csr_rows.h"
#include "solver/operator/refine/refinement.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS_AT_ONCE = 64 };

/* After a direction that leaves more than this share of |r|^2 the next direction is r itself, along which |r|
 * always falls. */
static const double poor = .81;

void refinement_free(refinement *s) {
    free(s->lit);
    free(s->P);
    free(s->r);
    free(s->z);
    free(s->q);
    free(s->kept_Z);
    free(s->kept_Q);
    free(s->X);
    free(s->Y);
    free(s->narrow_in);
    free(s->narrow_out);
    free(s->work);
    free(s->columns);
    free(s->active);
    free(s->again);
    free(s->helped);
    free(s->product_work);
    *s = (refinement){.n_columns = 0};
}

/* Bytes of work of a product with n_columns vectors by blocks. */
static size_t work_of_product(const lam_refiner *refiner, size_t n_columns) {
    const kept_blocks *b = refiner->F->blocks;
    return b == NULL ? 0 : block_factors_work(&b->f, n_columns < BLOCK_VECTORS ? n_columns : BLOCK_VECTORS);
}

size_t refinement_bytes(const lam_refiner *refiner) {
    const size_t C = refiner->op->n_channels, n = refiner->op->n;
    return C * n * ((5 + 2 * REFINE_WINDOW) * sizeof(double) + 2 * sizeof(float)) +
           work_of_product(refiner, C);
}

static lam_status reserve(size_t rows, size_t row_bytes, void *out, lam_error *error) {
    void *const made = memory_allocate(rows, row_bytes, "refining an answer", error);
    memcpy(out, &made, sizeof made);
    return made == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

lam_status refinement_create(const lam_refiner *refiner, size_t n_vectors, refinement *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const lam_operator *op = refiner->op;
    const size_t n = op->n, m = n_vectors * op->n_channels;
    refinement s = {.refiner = refiner,
                    .n_vectors = n_vectors,
                    .n_columns = m,
                    .help = op->kind->apply != NULL,
                    .work_bytes = lam_operator_work_bytes(op, n_vectors)};
    const size_t helper_bytes = lam_operator_work_bytes(refiner_help(refiner), n_vectors);
    if (helper_bytes > s.work_bytes) s.work_bytes = helper_bytes;
    double **const rows[] = {&s.lit, &s.P, &s.r, &s.z, &s.q};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        TRY(reserve(m, n * sizeof(double), rows[k], error));
    TRY(reserve(REFINE_WINDOW * m, n * sizeof(double), &s.kept_Z, error));
    TRY(reserve(REFINE_WINDOW * m, n * sizeof(double), &s.kept_Q, error));
    if (refiner->F->blocks != NULL) TRY(reserve(work_of_product(refiner, m), 1, &s.product_work, error));
    if (m > 1 && refiner_has_rows(refiner)) { /* one vector is not copied */
        TRY(reserve(n, CSR_DOUBLES_WIDTH * sizeof(double), &s.X, error));
        TRY(reserve(n, CSR_DOUBLES_WIDTH * sizeof(double), &s.Y, error));
    }
    if (s.help) {
        TRY(reserve(m, n * sizeof(float), &s.narrow_in, error));
        TRY(reserve(m, n * sizeof(float), &s.narrow_out, error));
        TRY(reserve(s.work_bytes, 1, &s.work, error));
    }
    TRY(reserve(m, sizeof *s.columns, &s.columns, error));
    TRY(reserve(m, sizeof *s.active, &s.active, error));
    TRY(reserve(m, sizeof *s.again, &s.again, error));
    TRY(reserve(m, sizeof *s.helped, &s.helped, error));
    for (size_t c = 0; c < m; c++)
        s.columns[c].channel = refiner->channels != NULL ? &refiner->channels[c % op->n_channels] : NULL;
    *out = s;
    s = (refinement){.n_columns = 0};
done:
    refinement_free(&s);
    return status;
}

/* sum_i scale_i x_i y_i */
static double dot(size_t n, const double *scale, const double *x, const double *y) {
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (size_t i = 0; i < n; i++) sum += scale[i] * x[i] * y[i];
    return sum;
}

/* x += a y */
static void add(size_t n, double a, const double *y, double *x) {
    for (size_t i = 0; i < n; i++) x[i] += a * y[i];
}

/* Rows of F times columns that stand side by side. */
typedef struct row_products {
    const csr *F;
    csr_double_row *multiply;
    size_t width;
    const double *X;
    double *Y;
} row_products;

static void multiply_rows(const void *job, size_t thread, size_t first, size_t last) {
    const row_products *p = job;
    (void)thread;
    for (size_t i = first; i < last; i++) {
        const uint64_t begin = p->F->indptr[i];
        p->multiply(p->F->indices + begin, p->F->data + begin, p->F->indptr[i + 1] - begin, p->X,
                    p->Y + i * p->width);
    }
}

/* Multiplies m columns, side by side when m > 1. */
static void multiply_some(refinement *s, size_t m, const size_t *columns, const double *from, double *to) {
    const lam_operator *op = s->refiner->op;
    const csr *F = &s->refiner->F->F;
    const size_t n = op->n, width = csr_doubles_width(m);
    const double *X = s->X;
    double *Y = s->Y;
    if (width == 1) {
        X = from + columns[0] * n;
        Y = to + columns[0] * n;
    } else {
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < width; k++) s->X[i * width + k] = k < m ? from[columns[k] * n + i] : 0;
    }
    const row_products p = {F, csr_doubles_row(width), width, X, Y};
    parallel_share(op->n_threads, n, ROWS_AT_ONCE, multiply_rows, &p);
    for (size_t i = 0; width > 1 && i < n; i++)
        for (size_t k = 0; k < m; k++) to[columns[k] * n + i] = Y[i * width + k];
}

/* The same by blocks, as many columns at a time as share a pass. */
static void multiply_by_blocks(refinement *s, const bool *chosen, const double *X, double *Y) {
    const size_t n = s->refiner->op->n;
    const double *from[BLOCK_VECTORS];
    double *to[BLOCK_VECTORS];
    block_vectors some = {.step = 1, .by_element = true, .x = from, .y = to};
    for (size_t c = 0; c < s->n_columns; c++) {
        if (!chosen[c]) continue;
        s->columns[c].passes++;
        from[some.count] = X + c * n;
        to[some.count++] = Y + c * n;
        if (some.count < BLOCK_VECTORS) continue;
        block_factors_apply(&s->refiner->F->blocks->f, &some, s->product_work, s->refiner->op->n_threads);
        some.count = 0;
    }
    if (some.count > 0)
        block_factors_apply(&s->refiner->F->blocks->f, &some, s->product_work, s->refiner->op->n_threads);
}

void refinement_multiply(refinement *s, const bool *chosen, const double *X, double *Y) {
    size_t some[CSR_DOUBLES_WIDTH], m = 0;
    if (s->refiner->F->blocks != NULL) {
        multiply_by_blocks(s, chosen, X, Y);
        return;
    }
    for (size_t c = 0; c < s->n_columns; c++) {
        if (!chosen[c]) continue;
        s->columns[c].passes++;
        some[m++] = c;
        if (m < CSR_DOUBLES_WIDTH) continue;
        multiply_some(s, m, some, X, Y);
        m = 0;
    }
    if (m > 0) multiply_some(s, m, some, X, Y);
}

static bool any_of(const bool *chosen, size_t count) {
    for (size_t c = 0; c < count; c++)
        if (chosen[c]) return true;
    return false;
}

/* The power of two that brings x into the range of single precision. */
static double to_range(size_t n, const double *x) {
    int exponent = 0;
    (void)frexp(refine_most(n, x), &exponent);
    return ldexp(1, exponent < -1000 ? 1000 : -exponent);
}

/* to = the operator's indirect radiosity for `from`, for the chosen columns. */
static void ask_operator(refinement *s, const bool *chosen, const double *from, double *to) {
    const lam_operator *op = refiner_help(s->refiner);
    const size_t n = op->n, C = op->n_channels;
    size_t n_asked = 0;
    for (size_t v = 0; v < s->n_vectors; v++) {
        if (!any_of(chosen + v * C, C)) continue;
        float *in = s->narrow_in + n_asked++ * C * n;
        for (size_t c = 0; c < C; c++) {
            const double *x = from + (v * C + c) * n, factor = chosen[v * C + c] ? to_range(n, x) : 0;
            for (size_t i = 0; i < n; i++) in[c * n + i] = (float)(factor * x[i]);
        }
    }
    if (n_asked == 0) return;
    /* It fails for wrong arguments alone. */
    (void)lam_operator_apply(op, n_asked, LAM_INDIRECT, s->narrow_in, s->narrow_out, s->work, s->work_bytes,
                             NULL);
    n_asked = 0;
    for (size_t v = 0; v < s->n_vectors; v++) {
        if (!any_of(chosen + v * C, C)) continue;
        const float *out = s->narrow_out + n_asked++ * C * n;
        for (size_t c = 0; c < C; c++) {
            if (!chosen[v * C + c]) continue;
            const double back = 1 / to_range(n, from + (v * C + c) * n);
            for (size_t i = 0; i < n; i++) to[(v * C + c) * n + i] = back * (double)out[c * n + i];
        }
    }
}

void refinement_start(refinement *s) {
    const size_t n = s->refiner->op->n;
    memset(s->P, 0, s->n_columns * n * sizeof *s->P);
    if (!s->help) return;
    for (size_t c = 0; c < s->n_columns; c++) s->helped[c] = true;
    ask_operator(s, s->helped, s->lit, s->P);
    for (size_t k = 0; k < s->n_columns * n; k++) s->P[k] = s->P[k] > 0 ? s->P[k] : 0; /* also of NaN */
}

/* r = R F (E' + P) - P from x = E' + P and h = F x, and a bound on its rounding. */
static void restart(refinement *s, size_t c, const double *x, const double *h) {
    refine_column *col = &s->columns[c];
    const lam_refiner *refiner = s->refiner;
    const size_t n = refiner->op->n;
    const float *rho = col->channel->rho;
    const double *P = s->P + c * n;
    double *r = s->r + c * n, largest = 0, rho_most = 0;
    for (size_t i = 0; i < n; i++) {
        const double bounced = (double)rho[i] * h[i];
        r[i] = bounced - P[i];
        /* When E' + P has negative values, F |E' + P| exceeds h. */
        const double all = (double)rho[i] * (fabs(h[i]) - 2 * col->least * refiner->row_most);
        largest = all > largest ? all : largest;
        rho_most = fmax(rho_most, (double)rho[i]);
    }
    const double product = refiner_has_rows(refiner)
                               ? refiner->roundings * largest
                               : rho_most * refiner_product_rounding(refiner, refine_most(n, x));
    col->error = product + 2 * REFINE_U * refine_most(n, r);
    col->n_kept = 0;
}

/* Computes r of the chosen columns from their P; overwrites z and q. */
static void find_residuals(refinement *s, bool *chosen) {
    const size_t n = s->refiner->op->n;
    for (size_t c = 0; c < s->n_columns; c++) {
        if (!chosen[c]) continue;
        double *x = s->z + c * n, least = 0;
        for (size_t i = 0; i < n; i++) {
            x[i] = s->lit[c * n + i] + s->P[c * n + i];
            least = x[i] < least ? x[i] : least;
        }
        s->columns[c].least = least;
    }
    refinement_multiply(s, chosen, s->z, s->q);
    for (size_t c = 0; c < s->n_columns; c++) {
        if (!chosen[c]) continue;
        restart(s, c, s->z + c * n, s->q + c * n);
        s->columns[c].at_restart = INFINITY;
        (void)refinement_judge(s, c);
        s->columns[c].at_restart = s->columns[c].bound;
        /* r is fresh, so that it need not be computed again. */
        chosen[c] = false;
    }
}

/* q = A z = z - R F z, then a step along it. */
static void step(refinement *s, size_t c) {
    refine_column *col = &s->columns[c];
    const refine_channel *channel = col->channel;
    const size_t n = s->refiner->op->n, m = s->n_columns;
    double *z = s->z + c * n, *q = s->q + c * n, *r = s->r + c * n;
    for (size_t i = 0; i < n; i++) q[i] = z[i] - (double)channel->rho[i] * q[i];
    double z_most = refine_most(n, z), q_most = refine_most(n, q);
    double error = refiner_product_rounding(s->refiner, z_most) + REFINE_U * q_most;

    const size_t n_kept = col->n_kept < REFINE_WINDOW ? col->n_kept : REFINE_WINDOW;
    for (size_t k = 0; k < n_kept; k++) {
        const double *Z = s->kept_Z + (k * m + c) * n, *Q = s->kept_Q + (k * m + c) * n;
        const double beta = dot(n, channel->scale, q, Q) / col->kept_norm[k], size = fabs(beta);
        add(n, -beta, Q, q);
        add(n, -beta, Z, z);
        z_most += size * col->kept_z[k];
        q_most += size * col->kept_q[k];
        /* |A| <= 2, so that the two roundings of z count twice. */
        error += size * col->kept_error[k] + 2 * REFINE_U * (2 * z_most + q_most);
    }
    const double norm = dot(n, channel->scale, q, q), before = dot(n, channel->scale, r, r);
    const double along = dot(n, channel->scale, r, q);
    if (!(norm > 0 && isfinite(along / norm))) { /* z is 0 or not finite */
        col->stuck = col->plain;
        col->plain = true;
        return;
    }
    const double alpha = along / norm;
    z_most = refine_most(n, z);
    q_most = refine_most(n, q);
    add(n, alpha, z, s->P + c * n);
    add(n, -alpha, q, r);
    col->error += fabs(alpha) * error + 2 * REFINE_U * (col->r + fabs(alpha) * q_most) +
                  4 * REFINE_U * (col->P + 2 * fabs(alpha) * z_most);
    col->P += fabs(alpha) * z_most;
    col->plain = !col->plain && along * alpha < (1 - poor) * before;

    const size_t slot = col->n_kept++ % REFINE_WINDOW;
    memcpy(s->kept_Z + (slot * m + c) * n, z, n * sizeof *z);
    memcpy(s->kept_Q + (slot * m + c) * n, q, n * sizeof *q);
    col->kept_norm[slot] = norm;
    col->kept_error[slot] = error;
    col->kept_z[slot] = z_most;
    col->kept_q[slot] = q_most;
}

/* z = M~ r, or r. */
static void find_directions(refinement *s, const bool *active) {
    const size_t n = s->refiner->op->n;
    bool *helped = s->helped;
    for (size_t c = 0; c < s->n_columns; c++) helped[c] = active[c] && s->help && !s->columns[c].plain;
    if (s->help) ask_operator(s, helped, s->r, s->z);
    for (size_t c = 0; c < s->n_columns; c++) {
        if (!active[c]) continue;
        const double *r = s->r + c * n;
        double *z = s->z + c * n;
        if (helped[c])
            for (size_t i = 0; i < n; i++) z[i] += r[i];
        else
            memcpy(z, r, n * sizeof *z);
    }
}

/* A step of columns that are active, each judged afterwards. */
static void step_columns(const void *job, size_t thread, size_t first, size_t last) {
    refinement *s = *(refinement *const *)job;
    (void)thread;
    for (size_t c = first; c < last; c++) {
        if (!s->active[c]) continue;
        step(s, c);
        if (!s->columns[c].stuck) s->again[c] = refinement_judge(s, c);
    }
}

void refinement_solve(refinement *s) {
    const size_t m = s->n_columns;
    bool *active = s->active, *again = s->again;
    for (size_t c = 0; c < m; c++) {
        refine_column *col = &s->columns[c];
        *col = (refine_column){.channel = col->channel, .lit_rounded = col->lit_rounded};
        again[c] = true;
    }
    find_residuals(s, again);
    for (size_t c = 0; c < m; c++) s->columns[c].P_first = s->columns[c].P;
    for (;;) {
        for (size_t c = 0; c < m; c++) {
            active[c] = !s->columns[c].done && !s->columns[c].stuck;
            again[c] = false;
        }
        if (!any_of(active, m)) return;
        s->left = s->watch != NULL && !s->watch->go_on(s->watch->context);
        if (s->left) return;
        find_directions(s, active);
        refinement_multiply(s, active, s->z, s->q);
        parallel_share(s->refiner->op->n_threads, m, 1, step_columns, &s);
        if (any_of(again, m)) find_residuals(s, again);
    }
}
