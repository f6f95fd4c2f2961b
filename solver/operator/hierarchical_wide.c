/* The products of kind "hierarchical" with vectors side by side (hierarchical_apply.c has those with one):
 * elements, coefficients and sums have WAVELET_WIDE lanes, a vector each, so that the tree and K are read
 * once for all, and a piece of the tree stays in the second cache of a core from the emissions to its
 * coefficients, and from these to the answers. Elements of a piece are read and written in ascending mesh
 * order, of which long runs lie side by side. */
#include "solver/operator/hierarchical_wide.h"

#include "solver/base/work_area.h"
#include "solver/operator/lane_rows.h"
#include "solver/operator/wavelet/wavelet_wide.h"

#include <stdlib.h>
#include <string.h>

enum { WIDE = WAVELET_WIDE };

_Static_assert(OPERATOR_PASS == WIDE && (int)TILED_WIDE == (int)WIDE && (int)LANES == (int)WIDE,
               "a pass is as wide as its kernels");

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
    double (*sums)[WIDE];            /* [n_pieces], of areas times light, or, adjoint, of lift times in */
    _Alignas(64) float factor[WIDE]; /* of the correction of the mean error */
} wide_channel;

/* Block k of a piece that begins with position `begin`. */
static inline void find_block(const wide_channel *h, size_t piece, size_t k, size_t begin, size_t end,
                              lane_block *b) {
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

/* True when WIDE numbers of each vector may be read where a block begins: those behind it are of no use. */
static inline bool is_whole(const wide_channel *h, const lane_block *b) {
    return b->first + WIDE <= h->self->base.n;
}

/* to [count] = E + rho H0 of a vector at the elements of a block. */
static inline void read_light(const wide_channel *h, size_t v, const lane_block *b, float *to) {
    const float *E = h->in[v], *H0 = h->H0[v];
    const float *rho = h->self->base.reflectance + h->c * h->self->base.n;
    for (size_t k = 0; k < b->count; k++)
        to[k] = h->answers ? operator_light(rho, E, H0, b->first + k) : E[b->first + k];
}

/* The sums of a vector's lift times in, which is X over `left`, are taken before X has it. */
static void fill_adjoint(const wide_channel *h, const float *left, size_t first, size_t count, float *X,
                         double *sums) {
    const hierarchical *self = h->self;
    if (self->even.missing != NULL)
        lane_kernels_of(cpu_best())->sum(self->even.lift + h->c * self->base.n + first, X, count, sums);
    for (size_t p = 0; p < count; p++)
        for (size_t v = 0; v < WIDE; v++) X[p * WIDE + v] *= left[p];
}

/* X = right in of a piece, and its sums. */
static void fill(void *context, size_t piece, size_t first, size_t last, float *X) {
    const wide_channel *h = context;
    const hierarchical *self = h->self;
    const lane_kernels *run = lane_kernels_of(cpu_best());
    const size_t count = last - first, n_blocks = count_blocks(h, piece, first, last);
    const float *by = h->adjoint ? NULL : self->root_area + first;
    float light[WIDE][WIDE] = {{0}}; /* of vectors that are not read in place */
    const float *from[WIDE];
    lane_block b;
    for (size_t q = 0; q < n_blocks; q++) {
        find_block(h, piece, q, first, last, &b);
        const bool whole = is_whole(h, &b);
        for (size_t v = 0; v < WIDE; v++) {
            const bool in_place = v < h->count && whole && h->H0[v] == NULL;
            if (v < h->count && !in_place) read_light(h, v, &b, light[v]);
            from[v] = in_place ? h->in[v] + b.first : light[v];
        }
        run->put(&b, from, by, X);
    }
    if (h->adjoint)
        fill_adjoint(h, self->left + h->c * self->base.n + first, first, count, X, h->sums[piece]);
    else if (self->even.missing != NULL) /* A_j x_j = A_j^1/2 X_j */
        run->sum(by, X, count, h->sums[piece]);
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

/* Writes P of a vector at the elements of a block, or the quantity that it gives. */
static inline void write_out(const wide_channel *h, size_t v, const lane_block *b, const float *P) {
    const float *rho = h->self->base.reflectance + h->c * h->self->base.n + b->first,
                *E = h->in[v] + b->first, *H0 = h->H0[v] != NULL ? h->H0[v] + b->first : NULL;
    float *out = h->out[v] + b->first;
    for (size_t k = 0; k < b->count; k++)
        out[k] = h->answers ? operator_finish(h->quantity[v], rho[k], operator_light(rho, E, H0, k), P[k],
                                              H0 != NULL ? H0[k] : 0.0f)
                            : P[k];
}

/* True when all answers are radiosities of emissions alone, as most are. */
static bool is_plain(const wide_channel *h) {
    bool plain = h->answers;
    for (size_t v = 0; v < h->count; v++)
        plain = plain && h->H0[v] == NULL && h->quantity[v] == LAM_RADIOSITY;
    return plain;
}

static void use(void *context, size_t piece, size_t first, size_t last, float *X) {
    const wide_channel *h = context;
    const hierarchical *self = h->self;
    const lane_kernels *run = lane_kernels_of(cpu_best());
    const size_t n_blocks = count_blocks(h, piece, first, last), at = h->c * self->base.n + first;
    const bool lifted = self->even.missing != NULL && !h->adjoint, plain = is_plain(h);
    const float *rho = self->base.reflectance + h->c * self->base.n;
    const lane_bounce bounce = {.adjoint = h->adjoint,
                                .left = h->adjoint ? self->root_area + first : self->left + at,
                                .lift = lifted ? self->even.lift + at : NULL,
                                .factor = h->factor};
    _Alignas(64) float P[WIDE][WIDE]; /* by vector, by element */
    lane_block b;
    for (size_t q = 0; q < n_blocks; q++) {
        find_block(h, piece, q, first, last, &b);
        run->take(&bounce, &b, X, P);
        if (plain && is_whole(h, &b))
            run->radiosity(&b, h->count, rho, h->in, (const float(*)[WIDE])P, h->out);
        else
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
        !work_area_add(&total, tiled_lanes_work(&self->K[0])) || !work_area_add(&total, transform) ||
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
          *columns = work_area_take(&work, tiled_lanes_work(&self->K[0])),
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
