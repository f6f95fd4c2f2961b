/* The products of kind "hierarchical" with vectors side by side (hierarchical_apply.c has those with one):
 * elements, coefficients and sums have WAVELET_WIDE lanes, a vector each, so that the tree and K are read
 * once for all, and a piece of the tree stays in the second cache of a core from the emissions to its
 * coefficients, and from these to the answers. Elements of a piece are read and written in ascending mesh
 * order, of which long runs lie side by side. */
#include "solver/operator/hierarchical_wide.h"

#include "solver/base/work_area.h"
#include "solver/operator/wavelet/wavelet_wide.h"

#include <stdlib.h>
#include <string.h>

enum { WIDE = WAVELET_WIDE };

_Static_assert(OPERATOR_PASS == WIDE && (int)TILED_WIDE == (int)WIDE, "a pass is as wide as its kernels");

/* piece_of [n], by position. */
static void find_pieces(const wavelet_plan *plan, uint32_t *piece_of) {
    for (size_t k = 0; k < plan->n_pieces; k++)
        for (size_t p = wavelet_piece_begin(plan, &plan->pieces[k]);
             p < wavelet_piece_end(plan, &plan->pieces[k]); p++)
            piece_of[p] = (uint32_t)k;
}

/* The runs of elements in mesh order: their number by piece at first_run[piece + 1], and, unless runs is
 * NULL, themselves, those of a piece from first_run[piece] on, which ends as the first of the next. */
static void cut_runs(const hierarchical *self, const uint32_t *piece_of, uint32_t *first_run,
                     hierarchical_run *runs) {
    const size_t n = self->base.n;
    for (size_t i = 0, last; i < n; i = last) {
        const uint32_t piece = piece_of[operator_position(&self->base, i)];
        for (last = i + 1; last < n && last - i < WIDE;) {
            if (piece_of[operator_position(&self->base, last)] != piece) break;
            last++;
        }
        if (runs != NULL)
            runs[first_run[piece]++] = (hierarchical_run){(uint32_t)i, (uint32_t)(last - i)};
        else
            first_run[piece + 1]++;
    }
}

lam_status hierarchical_wide_prepare(hierarchical *self, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_pieces = self->plan.n_pieces;
    uint32_t *piece_of = memory_allocate(self->base.n, sizeof *piece_of, "operator", error), *next = NULL;
    self->first_run = memory_allocate(n_pieces + 1, sizeof *self->first_run, "operator", error);
    next = memory_allocate(n_pieces + 1, sizeof *next, "operator", error);
    if (piece_of == NULL || self->first_run == NULL || next == NULL) TRY(LAM_ERR_MEMORY);
    find_pieces(&self->plan, piece_of);
    cut_runs(self, piece_of, self->first_run, NULL);
    for (size_t k = 0; k < n_pieces; k++) self->first_run[k + 1] += self->first_run[k];
    memcpy(next, self->first_run, (n_pieces + 1) * sizeof *next);
    self->runs = memory_allocate(self->first_run[n_pieces], sizeof *self->runs, "operator", error);
    if (self->runs == NULL) TRY(LAM_ERR_MEMORY);
    cut_runs(self, piece_of, next, self->runs);
done:
    free(piece_of);
    free(next);
    return status;
}

/* One channel of a product (hierarchical_apply.c). */
typedef struct wide_channel {
    const hierarchical *self;
    size_t c, count;
    bool adjoint;
    bool answers;          /* in, H0 and out are in mesh order, and out is the quantity */
    const float *in[WIDE]; /* E of answers */
    const float *H0[WIDE]; /* NULL: 0 */
    lam_quantity quantity[WIDE];
    float *out[WIDE];
    double (*sums)[WIDE]; /* [n_pieces], of areas times light, or, adjoint, of lift times in */
    float factor[WIDE];   /* of the correction of the mean error */
} wide_channel;

/* Up to WIDE numbers of each vector that lie side by side, from `first` on, and the rows of a piece that they
 * belong to. */
typedef struct block {
    size_t first, count;
    uint32_t row[WIDE];
} block;

/* Block k of a piece that begins with position `begin`. */
static inline void find_block(const wide_channel *h, size_t piece, size_t k, size_t begin, size_t end,
                              block *b) {
    const hierarchical *self = h->self;
    if (h->answers) {
        const hierarchical_run *run = &self->runs[self->first_run[piece] + k];
        b->first = run->element;
        b->count = run->count;
        for (size_t i = 0; i < b->count; i++)
            b->row[i] = (uint32_t)(operator_position(&self->base, b->first + i) - begin);
    } else {
        b->first = begin + k * WIDE;
        b->count = end - b->first < WIDE ? end - b->first : WIDE;
        for (size_t i = 0; i < b->count; i++) b->row[i] = (uint32_t)(k * WIDE + i);
    }
}

static size_t count_blocks(const wide_channel *h, size_t piece, size_t begin, size_t end) {
    const uint32_t *first_run = h->self->first_run + piece;
    return h->answers ? first_run[1] - first_run[0] : (end - begin + WIDE - 1) / WIDE;
}

typedef float four __attribute__((vector_size(16), may_alias));

/* to = from transposed, by squares of four. */
static inline void transpose(const float (*from)[WIDE], float (*to)[WIDE]) {
    for (size_t i = 0; i < WIDE; i += 4)
        for (size_t k = 0; k < WIDE; k += 4) {
            const four a = *(const four *)(from[i] + k), b = *(const four *)(from[i + 1] + k),
                       c = *(const four *)(from[i + 2] + k), d = *(const four *)(from[i + 3] + k);
            const four ab = __builtin_shufflevector(a, b, 0, 4, 1, 5),
                       AB = __builtin_shufflevector(a, b, 2, 6, 3, 7),
                       cd = __builtin_shufflevector(c, d, 0, 4, 1, 5),
                       CD = __builtin_shufflevector(c, d, 2, 6, 3, 7);
            *(four *)(to[k] + i) = __builtin_shufflevector(ab, cd, 0, 1, 4, 5);
            *(four *)(to[k + 1] + i) = __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
            *(four *)(to[k + 2] + i) = __builtin_shufflevector(AB, CD, 0, 1, 4, 5);
            *(four *)(to[k + 3] + i) = __builtin_shufflevector(AB, CD, 2, 3, 6, 7);
        }
}

/* to [count] = E + rho H0 of a vector at the elements of a block. */
static inline void read_light(const wide_channel *h, size_t v, const block *b, float *to) {
    const float *E = h->in[v] + b->first, *H0 = h->H0[v];
    size_t k = 0;
    for (; k + 4 <= b->count; k += 4) memcpy(to + k, E + k, 4 * sizeof *to);
    for (; k < b->count; k++) to[k] = E[k];
    if (H0 == NULL) return;
    const float *rho = h->self->base.reflectance + h->c * h->self->base.n;
    for (k = 0; k < b->count; k++) to[k] = operator_light(rho, h->in[v], H0, b->first + k);
}

/* sums_v = sum_p by_p X_pv, each in the order of mean_correction_sum. */
static void sum_rows(const float *by, const float *X, size_t count, double *sums) {
    enum { PARTS = 8 };
    double parts[PARTS][WIDE] = {{0}};
    for (size_t p = 0; p < count; p++)
        for (size_t v = 0; v < WIDE; v++) parts[p % PARTS][v] += (double)by[p] * (double)X[p * WIDE + v];
    for (size_t v = 0; v < WIDE; v++)
        sums[v] = ((parts[0][v] + parts[1][v]) + (parts[2][v] + parts[3][v])) +
                  ((parts[4][v] + parts[5][v]) + (parts[6][v] + parts[7][v]));
}

/* X = right in of a piece, and its sums. */
static void fill(void *context, size_t piece, size_t first, size_t last, float *X) {
    const wide_channel *h = context;
    const hierarchical *self = h->self;
    const size_t n = self->base.n, count = last - first, n_blocks = count_blocks(h, piece, first, last);
    const float *by = (h->adjoint ? self->left + h->c * n : self->root_area) + first;
    _Alignas(64) float light[WIDE][WIDE] = {{0}}, rows[WIDE][WIDE]; /* by vector, by element */
    block b;
    for (size_t q = 0; q < n_blocks; q++) {
        find_block(h, piece, q, first, last, &b);
        for (size_t v = 0; v < h->count; v++) read_light(h, v, &b, light[v]);
        transpose((const float(*)[WIDE])light, rows);
        for (size_t k = 0; k < b.count; k++) memcpy(X + (size_t)b.row[k] * WIDE, rows[k], sizeof rows[k]);
    }
    const bool corrected = self->even.missing != NULL;
    if (corrected && h->adjoint) sum_rows(self->even.lift + h->c * n + first, X, count, h->sums[piece]);
    for (size_t p = 0; p < count; p++)
        for (size_t v = 0; v < WIDE; v++) X[p * WIDE + v] *= by[p];
    if (corrected && !h->adjoint) sum_rows(by, X, count, h->sums[piece]);
}

/* The factors of the correction, from the sums of pieces in their order. */
static void find_factors(wide_channel *h) {
    const hierarchical *self = h->self;
    for (size_t v = 0; v < WIDE; v++) {
        double sum = 0;
        h->factor[v] = 0;
        if (self->even.missing == NULL) continue;
        for (size_t k = 0; k < self->plan.n_pieces; k++) sum += h->sums[k][v];
        h->factor[v] = (float)(sum / self->even.light[h->c]);
    }
}

/* P of the rows of a block: left X + factor lift, or, adjoint, root X + factor area. The 0 makes -0 one 0, as
 * in a product with one vector, to which a factor of 0 adds nothing. */
static void bounce(const wide_channel *h, const block *b, size_t first, const float *X, float (*P)[WIDE]) {
    const hierarchical *self = h->self;
    const size_t n = self->base.n;
    const float *left = h->adjoint ? self->root_area : self->left + h->c * n;
    const float *lift = self->even.missing != NULL && !h->adjoint ? self->even.lift + h->c * n : NULL;
    for (size_t k = 0; k < b->count; k++) {
        const size_t p = first + b->row[k];
        const float *x = X + (size_t)b->row[k] * WIDE, by = left[p];
        if (h->adjoint)
            for (size_t v = 0; v < WIDE; v++) P[k][v] = by * x[v] + h->factor[v] * (by * by) + 0.0f;
        else if (lift != NULL)
            for (size_t v = 0; v < WIDE; v++) P[k][v] = by * x[v] + 0.0f + h->factor[v] * lift[p];
        else
            for (size_t v = 0; v < WIDE; v++) P[k][v] = by * x[v] + 0.0f;
    }
}

typedef int32_t four_flags __attribute__((vector_size(16), may_alias));

/* out = B = E + P, or E where nothing is reflected; four at a time, as the compiler takes no branch out of a
 * sum that might trap. */
static inline void write_radiosity(size_t count, const float *rho, const float *E, const float *P,
                                   float *out) {
    size_t k = 0;
    for (; k + 4 <= count; k += 4) {
        four r, e, p;
        memcpy(&r, rho + k, sizeof r);
        memcpy(&e, E + k, sizeof e);
        memcpy(&p, P + k, sizeof p);
        const four_flags reflects = r > 0.0f;
        const four sum = e + p;
        const four_flags B = (reflects & (four_flags)sum) | (~reflects & (four_flags)e);
        memcpy(out + k, &B, sizeof B);
    }
    for (; k < count; k++) out[k] = rho[k] > 0.0f ? E[k] + P[k] : E[k];
}

/* Writes P of a vector at the elements of a block, or the quantity that it gives. */
static inline void write_out(const wide_channel *h, size_t v, const block *b, const float *P) {
    const float *rho = h->self->base.reflectance + h->c * h->self->base.n + b->first,
                *E = h->in[v] + b->first, *H0 = h->H0[v] != NULL ? h->H0[v] + b->first : NULL;
    float *out = h->out[v] + b->first;
    if (!h->answers)
        memcpy(out, P, b->count * sizeof *out);
    else if (H0 == NULL && h->quantity[v] == LAM_RADIOSITY) /* most answers */
        write_radiosity(b->count, rho, E, P, out);
    else
        for (size_t k = 0; k < b->count; k++)
            out[k] = operator_finish(h->quantity[v], rho[k], operator_light(rho, E, H0, k), P[k],
                                     H0 != NULL ? H0[k] : 0.0f);
}

static void use(void *context, size_t piece, size_t first, size_t last, float *X) {
    const wide_channel *h = context;
    const size_t n_blocks = count_blocks(h, piece, first, last);
    _Alignas(64) float rows[WIDE][WIDE] = {{0}}, P[WIDE][WIDE]; /* by element, by vector */
    block b;
    for (size_t q = 0; q < n_blocks; q++) {
        find_block(h, piece, q, first, last, &b);
        bounce(h, &b, first, X, rows);
        transpose((const float(*)[WIDE])rows, P);
        for (size_t v = 0; v < h->count; v++) write_out(h, v, &b, P[v]);
    }
}

/* Bytes of rows of so many lanes of coefficients. */
static size_t coefficient_bytes(const hierarchical *self) {
    return (self->plan.n_used + TILED_PAST) * WIDE * sizeof(float);
}

size_t hierarchical_wide_bytes(const hierarchical *self) {
    size_t total = WORK_AREA_ALIGN, transform;
    if (!size_multiply(wavelet_wide_work(&self->plan, self->base.n_threads), sizeof(float), &transform) ||
        !work_area_add(&total, coefficient_bytes(self)) || !work_area_add(&total, coefficient_bytes(self)) ||
        !work_area_add(&total, coefficient_bytes(self)) || !work_area_add(&total, transform) ||
        !work_area_add(&total, self->plan.n_pieces * WIDE * sizeof(double)))
        return 0;
    return total;
}

static void apply(wide_channel *h, void *work) {
    const hierarchical *self = h->self;
    const wavelet_plan *plan = &self->plan;
    const tiled_rows *K = &self->K[self->of_channel[h->c]];
    const size_t n_threads = self->base.n_threads;
    float *from = work_area_take(&work, coefficient_bytes(self)),
          *to = work_area_take(&work, coefficient_bytes(self)),
          *columns = work_area_take(&work, coefficient_bytes(self)),
          *transform = work_area_take(&work, wavelet_wide_work(plan, n_threads) * sizeof *transform);
    h->sums = work_area_take(&work, plan->n_pieces * sizeof *h->sums);
    memset(from + plan->n_used * WIDE, 0, TILED_PAST * WIDE * sizeof *from);
    wavelet_wide_forward(plan, fill, h, K->step, from, transform, n_threads);
    find_factors(h);
    tiled_multiply_lanes(K, h->count, from, to, columns, n_threads);
    wavelet_wide_inverse(plan, to, use, h, transform, n_threads);
}

void hierarchical_wide_answer(const hierarchical *self, size_t c, size_t count,
                              const operator_vector *vectors, void *work) {
    wide_channel h = {.self = self, .c = c, .count = count, .answers = true};
    const size_t at = c * self->base.n;
    for (size_t v = 0; v < count; v++) {
        h.in[v] = vectors[v].E + at;
        h.H0[v] = vectors[v].H0 != NULL ? vectors[v].H0 + at : NULL;
        h.out[v] = vectors[v].out + at;
        h.quantity[v] = vectors[v].quantity;
    }
    apply(&h, work);
}

void hierarchical_wide_product(const hierarchical *self, size_t c, bool adjoint, size_t count,
                               const float *in, float *out, void *work) {
    wide_channel h = {.self = self, .c = c, .count = count, .adjoint = adjoint};
    const size_t stride = self->base.n_channels * self->base.n;
    for (size_t v = 0; v < count; v++) {
        h.in[v] = in + v * stride;
        h.out[v] = out + v * stride;
    }
    apply(&h, work);
}
