/* The products of kind "hierarchical". The order of elements, areas, reflectances and the correction of the
 * mean error are taken along piece by piece of the tree, right before the forward transform of a piece and
 * right after its inverse, while it is in the cache of the thread that transforms it; those of an answer in
 * mesh order are taken along where it is written. */
#include "solver/base/parallel.h"
#include "solver/base/work_area.h"
#include "solver/operator/hierarchical.h"

#include <string.h>

/* Steps, coefficients and flags of some positions. */
static size_t some_bytes(const wavelet_plan *plan) {
    return 4 * WORK_AREA_ALIGN + plan->n_steps * (sizeof(uint32_t) + 1) +
           (plan->n_used + plan->n) * sizeof(uint32_t);
}

size_t hierarchical_work_bytes(const lam_operator *op, size_t n_rhs) {
    const hierarchical *self = (const hierarchical *)op;
    const size_t used = self->plan.n_used;
    size_t product, vectors, coefficients, slots, sums, total = WORK_AREA_ALIGN;
    if (!size_multiply(tiled_work(used, n_rhs), sizeof(float), &product) ||
        !size_multiply(op->n, n_rhs * sizeof(float), &vectors) ||
        !size_multiply(used, n_rhs * sizeof(float), &coefficients) ||
        !size_multiply(wavelet_plan_work(&self->plan), n_rhs * sizeof(float), &slots) ||
        !size_multiply(self->plan.n_pieces, n_rhs * sizeof(double), &sums) ||
        !work_area_add(&total, vectors) || !work_area_add(&total, coefficients) ||
        !work_area_add(&total, coefficients) || !work_area_add(&total, slots) ||
        !work_area_add(&total, sums) || !work_area_add(&total, some_bytes(&self->plan)) ||
        !work_area_add(&total, product))
        return 0;
    return total;
}

/* Vectors side by side take as long as WIDE_WORTH of them one by one, however few they are. From so many
 * elements on, several vectors do not fit into a core's caches together, and each is taken alone through all
 * of a product. */
enum { WIDE_WORTH = 9, ALONE_FROM = 131072 };

/* out_v = K_c in_v: light of few elements by its columns, other vectors together where they are many. */
static void multiply_core(const hierarchical *self, size_t c, size_t m, const float *in, float *out,
                          float *work) {
    const tiled_rows *K = &self->K[self->of_channel[c]];
    for (size_t v = 0, last; v < m; v = last) {
        last = v;
        while (last < m && !tiled_few_columns(K, in + last * K->n)) last++;
        if (last == v)
            tiled_multiply_columns(K, in + v * K->n, out + last++ * K->n, work);
        else if (last - v >= WIDE_WORTH)
            tiled_multiply(K, last - v, in + v * K->n, out + v * K->n, work, self->base.n_threads);
        else
            for (size_t u = v; u < last; u++)
                tiled_multiply(K, 1, in + u * K->n, out + u * K->n, work, self->base.n_threads);
    }
}

/* One channel of a product, out = left W^T K W right in with left = R' A^-1/2 and right = A^1/2, or, adjoint,
 * these two exchanged. */
typedef struct channel {
    const hierarchical *self;
    size_t c, stride; /* from one vector to the next of in, E, H0 and out: C n */
    bool adjoint;
    const float *in;     /* by position, or NULL: */
    const float *E, *H0; /* in mesh order, as of an answer */
    lam_quantity quantity;
    float *X;     /* [m][n] */
    double *sums; /* [m][n_pieces], of areas times light, or, adjoint, of lift times in */
    float *out;   /* by position; with E, the quantity in mesh order */
} channel;

/* X = right in, and the piece's sum of areas times light. */
static void fill(void *context, size_t v, size_t piece, size_t first, size_t last) {
    const channel *h = context;
    const hierarchical *self = h->self;
    const size_t n = self->base.n, c = h->c;
    const float *by = h->adjoint ? self->left + c * n : self->root_area, *in = h->in;
    float *X = h->X + v * n;
    if (in != NULL) {
        in += v * h->stride;
        for (size_t p = first; p < last; p++) X[p] = by[p] * in[p];
    } else {
        const float *rho = self->base.reflectance + c * n, *E = h->E + v * h->stride,
                    *H0 = h->H0 != NULL ? h->H0 + v * h->stride : NULL;
        const uint32_t *order = self->base.order;
        for (size_t p = first; p < last; p++)
            X[p] = by[p] * operator_light(rho, E, H0, order != NULL ? order[p] : p);
    }
    if (self->even.missing == NULL) return;
    /* A_j x_j = A_j^1/2 X_j */
    h->sums[v * self->plan.n_pieces + piece] =
        h->adjoint ? mean_correction_sum(self->even.lift + c * n + first, in + first, last - first)
                   : mean_correction_sum(self->root_area + first, X + first, last - first);
}

/* The factor of a vector's correction, from the sums of its pieces in their order. */
static float mean_factor(const channel *h, size_t v) {
    const hierarchical *self = h->self;
    double sum = 0;
    if (self->even.missing == NULL) return 0;
    for (size_t k = 0; k < self->plan.n_pieces; k++) sum += h->sums[v * self->plan.n_pieces + k];
    return (float)(sum / self->even.light[h->c]);
}

/* P = left X + factor lift of a position. Adding 0 makes -0, which the transforms make of some zeros, one 0:
 * a vector that is dark has the same bits alone, where nothing is transformed. */
static inline float bounced(float left, const float *lift, float factor, const float *X, size_t p) {
    const float found = left * X[p] + 0.0f;
    return factor != 0 ? found + factor * lift[p] : found;
}

/* The quantity of an element from its P. */
static inline float answer_of(const channel *h, const float *E, const float *H0, size_t i, float P) {
    const float *rho = h->self->base.reflectance + h->c * h->self->base.n;
    return operator_finish(h->quantity, rho[i], operator_light(rho, E, H0, i), P, H0 != NULL ? H0[i] : 0.0f);
}

/* Elements that a thread finishes at a time, and those below which one thread does. */
enum { AT_ONCE = 4096, THREADS_WORTH = 65536 };

/* An answer from X. */
typedef struct ending {
    const channel *h;
    size_t v;
} ending;

/* This goes in mesh order, as scattered reads cost less than scattered writes. */
static void finish_elements(const void *job, size_t thread, size_t first, size_t last) {
    const channel *h = ((const ending *)job)->h;
    const hierarchical *self = h->self;
    const size_t v = ((const ending *)job)->v, n = self->base.n, c = h->c;
    const float *left = self->left_of_element + c * n, *rho = self->base.reflectance + c * n,
                *X = h->X + v * n;
    const float *lift = self->even.missing != NULL ? self->even.lift + c * n : NULL;
    const float *E = h->E + v * h->stride, *H0 = h->H0 != NULL ? h->H0 + v * h->stride : NULL;
    const uint32_t *position = self->base.position;
    const float factor = mean_factor(h, v);
    float *out = h->out + v * h->stride;
    (void)thread;
    if (h->quantity == LAM_RADIOSITY && H0 == NULL && position != NULL) /* most answers */
        for (size_t i = first; i < last; i++)
            out[i] = rho[i] > 0.0f ? E[i] + bounced(left[i], lift, factor, X, position[i]) : E[i];
    else
        for (size_t i = first; i < last; i++)
            out[i] =
                answer_of(h, E, H0, i, bounced(left[i], lift, factor, X, operator_position(&self->base, i)));
}

static void finish(const channel *h, size_t v) {
    const size_t n = h->self->base.n;
    const ending e = {h, v};
    parallel_share(n >= THREADS_WORTH ? h->self->base.n_threads : 1, n, AT_ONCE, finish_elements, &e);
}

/* out from X. */
static void use(void *context, size_t v, size_t piece, size_t first, size_t last) {
    const channel *h = context;
    const hierarchical *self = h->self;
    const size_t n = self->base.n, c = h->c;
    const float *left = self->left + c * n, *root = self->root_area, *X = h->X + v * n;
    const float *lift = self->even.missing != NULL ? self->even.lift + c * n : NULL;
    const float factor = mean_factor(h, v);
    float *out = h->out + v * h->stride;
    (void)piece;
    if (h->adjoint) {
        for (size_t p = first; p < last; p++) out[p] = root[p] * X[p] + factor * (root[p] * root[p]) + 0.0f;
        return;
    }
    for (size_t p = first; p < last; p++) out[p] = bounced(left[p], lift, factor, X, p);
}

/* Room for m vectors, of which `in`, E, H0, out and c are still to be set. */
typedef struct areas {
    channel h;
    float *from, *to, *slots;
} areas;

static areas take_areas(const hierarchical *self, size_t m, void **work) {
    const wavelet_plan *plan = &self->plan;
    areas a = {.h = {.self = self, .stride = self->base.n_channels * self->base.n}};
    a.h.X = work_area_take(work, m * self->base.n * sizeof *a.h.X);
    a.from = work_area_take(work, m * plan->n_used * sizeof *a.from);
    a.to = work_area_take(work, m * plan->n_used * sizeof *a.to);
    a.slots = work_area_take(work, m * wavelet_plan_work(plan) * sizeof *a.slots);
    a.h.sums = work_area_take(work, m * plan->n_pieces * sizeof *a.h.sums);
    return a;
}

/* True when all light of a channel is 0, of which nothing bounces. */
static bool is_dark(const channel *h, size_t m) {
    const size_t n = h->self->base.n;
    for (size_t v = 0; v < m; v++) {
        const size_t row = v * h->stride;
        if (!wavelet_is_dark((h->in != NULL ? h->in : h->E) + row, n) ||
            (h->in == NULL && h->H0 != NULL && !wavelet_is_dark(h->H0 + row, n)))
            return false;
    }
    return true;
}

/* X and its coefficients. */
static void analyse(areas *a, size_t m) {
    const hierarchical *self = a->h.self;
    wavelet_plan_forward(&self->plan, m, fill, &a->h, a->h.X, a->from, a->slots, self->base.n_threads);
}

/* Writes what a dark channel gives. */
static void leave_dark(const channel *h, size_t m) {
    const size_t n = h->self->base.n;
    for (size_t v = 0; v < m; v++) {
        const size_t row = v * h->stride;
        if (h->in != NULL) memset(h->out + row, 0, n * sizeof *h->out);
        for (size_t i = 0; h->in == NULL && i < n; i++)
            h->out[row + i] = answer_of(h, h->E + row, h->H0 != NULL ? h->H0 + row : NULL, i, 0);
    }
}

/* m vectors of a channel, together. */
static void apply_together(areas *a, size_t m, void *work) {
    const hierarchical *self = a->h.self;
    if (is_dark(&a->h, m)) {
        leave_dark(&a->h, m);
        return;
    }
    analyse(a, m);
    multiply_core(self, a->h.c, m, a->from, a->to, work);
    wavelet_plan_inverse(&self->plan, m, a->to, a->h.X, a->h.in != NULL ? use : NULL, &a->h, a->slots,
                         self->base.n_threads);
    for (size_t v = 0; a->h.in == NULL && v < m; v++) finish(&a->h, v);
}

bool hierarchical_apart(const lam_operator *op) {
    return op->n >= ALONE_FROM;
}

/* All m vectors of a channel. */
static void apply_channel(const areas *a, size_t m, void *work) {
    const bool alone = hierarchical_apart(&a->h.self->base);
    for (size_t v = 0; v < m; v += alone ? 1 : m) {
        areas some = *a;
        const size_t before = v * a->h.stride;
        if (a->h.in != NULL) some.h.in += before;
        if (a->h.E != NULL) some.h.E += before;
        if (a->h.H0 != NULL) some.h.H0 += before;
        some.h.out += before;
        apply_together(&some, alone ? 1 : m, work);
    }
}

void hierarchical_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    areas a = take_areas((const hierarchical *)op, n_rhs, &work);
    for (size_t c = 0; c < op->n_channels; c++) {
        a.h.c = c;
        a.h.in = E + c * op->n;
        a.h.out = P + c * op->n;
        apply_channel(&a, n_rhs, work);
    }
}

void hierarchical_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    areas a = take_areas((const hierarchical *)op, n_rhs, &work);
    a.h.adjoint = true;
    for (size_t c = 0; c < op->n_channels; c++) {
        a.h.c = c;
        a.h.in = g + c * op->n;
        a.h.out = w + c * op->n;
        apply_channel(&a, n_rhs, work);
    }
}

void hierarchical_answer(const lam_operator *op, size_t n_rhs, lam_quantity quantity, const float *E,
                         const float *H0, float *out, void *work) {
    areas a = take_areas((const hierarchical *)op, n_rhs, &work);
    a.h.quantity = quantity;
    for (size_t c = 0; c < op->n_channels; c++) {
        a.h.c = c;
        a.h.E = E + c * op->n;
        a.h.H0 = H0 != NULL ? H0 + c * op->n : NULL;
        a.h.out = out + c * op->n;
        apply_channel(&a, n_rhs, work);
    }
}

/* Where more than one in so many steps is needed, the whole answer is as quick. */
enum { SOME_STEPS = 4 };

/* For some elements: only their ancestors in the tree and the rows of K of these. */
void hierarchical_apply_selected(const lam_operator *op, size_t n_rhs, const float *E, size_t n_selected,
                                 const uint32_t *selected, float *P, void *work) {
    const hierarchical *self = (const hierarchical *)op;
    const wavelet_plan *plan = &self->plan;
    const size_t n = op->n, C = op->n_channels, used = plan->n_used;
    areas a = take_areas(self, n_rhs, &work);
    uint32_t *steps = work_area_take(&work, plan->n_steps * sizeof *steps);
    uint32_t *rows = work_area_take(&work, used * sizeof *rows);
    uint32_t *positions = work_area_take(&work, n * sizeof *positions);
    uint8_t *flags = work_area_take(&work, plan->n_steps);
    size_t n_steps = plan->n_steps, n_rows = used;
    memset(flags, 0, plan->n_steps);
    const bool few = n_selected <= n;
    for (size_t r = 0; few && r < n_selected; r++)
        positions[r] = (uint32_t)operator_position(op, selected[r]);
    if (few) n_steps = wavelet_plan_paths(plan, n_selected, positions, flags, steps);
    const bool some = few && n_steps * SOME_STEPS < plan->n_steps;
    if (some) n_rows = wavelet_plan_coefficients(plan, n_steps, steps, rows);
    for (size_t c = 0; c < C; c++) {
        const tiled_rows *K = &self->K[self->of_channel[c]];
        const float *lift = self->even.missing != NULL ? self->even.lift + c * n : NULL;
        a.h.c = c;
        a.h.in = E + c * n;
        if (is_dark(&a.h, n_rhs)) {
            for (size_t v = 0; v < n_rhs; v++)
                memset(P + (v * C + c) * n_selected, 0, n_selected * sizeof *P);
            continue;
        }
        analyse(&a, n_rhs);
        if (!some) {
            multiply_core(self, c, n_rhs, a.from, a.to, work);
            wavelet_plan_inverse(plan, n_rhs, a.to, a.h.X, NULL, NULL, a.slots, op->n_threads);
        }
        for (size_t v = 0; v < n_rhs; v++) {
            const float *from = a.from + v * used, factor = mean_factor(&a.h, v);
            float *X = a.h.X + v * n;
            if (some && tiled_few_columns(K, from))
                tiled_multiply_columns(K, from, a.to, work);
            else if (some)
                tiled_multiply_rows(K, n_rows, rows, from, a.to, work);
            if (some) wavelet_plan_inverse_some(plan, n_steps, steps, a.to, X, a.slots);
            for (size_t r = 0; r < n_selected; r++)
                P[(v * C + c) * n_selected + r] = bounced(self->left_of_element[c * n + selected[r]], lift,
                                                          factor, X, operator_position(op, selected[r]));
        }
    }
}
