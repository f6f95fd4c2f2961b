/* The products of kind "hierarchical" with one vector, and all its products as operator.h names them; those
 * with several vectors are in hierarchical_wide.c. The order of elements, areas, reflectances and the
 * correction of the mean error are taken along piece by piece of the tree, right before the forward transform
 * of a piece and right after its inverse, while it is in the cache of the thread that transforms it; those of
 * an answer in mesh order are taken along where it is written. */
#include "solver/base/parallel.h"
#include "solver/base/work_area.h"
#include "solver/operator/hierarchical.h"
#include "solver/operator/hierarchical_some.h"
#include "solver/operator/hierarchical_wide.h"

#include <string.h>

/* Vectors side by side take as long as this many of them one by one, however few they are. */
enum { WIDE_WORTH = 8 };

/* Floats of coefficients of a vector. */
static size_t coefficients_of(const hierarchical *self) {
    return self->plan.n_used + TILED_PAST;
}

/* Floats of those that K is multiplied with. */
static size_t scaled_of(const hierarchical *self) {
    return self->plan.n_used + (self->K[0].values.map != NULL ? TILED_BEYOND : TILED_PAST);
}

static size_t one_work_bytes(const hierarchical *self) {
    const wavelet_plan *plan = &self->plan;
    const size_t parts[] = {self->base.n * sizeof(float), scaled_of(self) * sizeof(float),
                            coefficients_of(self) * sizeof(float), wavelet_plan_work(plan) * sizeof(float),
                            plan->n_pieces * sizeof(double)};
    size_t total = WORK_AREA_ALIGN;
    if (!hierarchical_some_add(self, &total)) return 0;
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++)
        if (!work_area_add(&total, parts[k])) return 0;
    return total;
}

size_t hierarchical_work_bytes(const lam_operator *op, size_t n_rhs) {
    const hierarchical *self = (const hierarchical *)op;
    const size_t one = one_work_bytes(self), wide = n_rhs >= WIDE_WORTH ? hierarchical_wide_bytes(self) : one;
    return one == 0 || wide == 0 ? 0 : one > wide ? one : wide;
}

/* K_c of a vector: light of few elements by its columns. */
static void multiply_core(const hierarchical *self, size_t c, const float *in, float *out) {
    const tiled_rows *K = &self->K[self->of_channel[c]];
    if (tiled_few_columns(K, in))
        tiled_multiply_columns(K, in, out);
    else
        tiled_multiply(K, in, out, self->base.n_threads);
}

/* One channel of a product, out = left W^T K W right in with left = R' A^-1/2 and right = A^1/2, or, adjoint,
 * these two exchanged. */
typedef struct channel {
    const hierarchical *self;
    size_t c;
    bool adjoint;
    const float *in;     /* by position, or NULL: */
    const float *E, *H0; /* in mesh order, as of an answer */
    lam_quantity quantity;
    float *X;     /* [n] */
    double *sums; /* [n_pieces], of areas times light, or, adjoint, of lift times in */
    float *out;   /* by position; with E, the quantity in mesh order */
} channel;

/* X = right in, and the piece's sum of areas times light. */
static void fill(void *context, size_t piece, size_t first, size_t last) {
    const channel *h = context;
    const hierarchical *self = h->self;
    const size_t n = self->base.n, c = h->c;
    const float *by = h->adjoint ? self->left + c * n : self->root_area, *in = h->in;
    float *X = h->X;
    if (in != NULL) {
        for (size_t p = first; p < last; p++) X[p] = by[p] * in[p];
    } else {
        const float *rho = self->base.reflectance + c * n, *E = h->E, *H0 = h->H0;
        const uint32_t *order = self->base.order;
        for (size_t p = first; p < last; p++)
            X[p] = by[p] * operator_light(rho, E, H0, order != NULL ? order[p] : p);
    }
    if (self->even.missing == NULL) return;
    /* A_j x_j = A_j^1/2 X_j */
    h->sums[piece] = h->adjoint
                         ? mean_correction_sum(self->even.lift + c * n + first, in + first, last - first)
                         : mean_correction_sum(self->root_area + first, X + first, last - first);
}

/* The factor of a vector's correction, from the sums of its pieces in their order. */
static float mean_factor(const channel *h) {
    const hierarchical *self = h->self;
    double sum = 0;
    if (self->even.missing == NULL) return 0;
    for (size_t k = 0; k < self->plan.n_pieces; k++) sum += h->sums[k];
    return (float)(sum / self->even.light[h->c]);
}

/* P = left X + factor lift of a position. Adding 0 makes -0, which the transforms make of some zeros, one 0:
 * a vector that is dark has the same bits alone, where nothing is transformed. */
static inline float bounced(float left, const float *lift, float factor, const float *X, size_t p) {
    const float found = left * X[p] + 0.0f;
    return factor != 0 ? found + factor * lift[p] : found;
}

/* The quantity of an element from its P. */
static inline float answer_of(const channel *h, size_t i, float P) {
    const float *rho = h->self->base.reflectance + h->c * h->self->base.n, *H0 = h->H0;
    return operator_finish(h->quantity, rho[i], operator_light(rho, h->E, H0, i), P,
                           H0 != NULL ? H0[i] : 0.0f);
}

/* Elements that a thread finishes at a time, and those below which one thread does. */
enum { AT_ONCE = 4096, THREADS_WORTH = 65536 };

/* An answer from X. This goes in mesh order, as scattered reads cost less than scattered writes. */
static void finish_elements(const void *job, size_t thread, size_t first, size_t last) {
    const channel *h = job;
    const hierarchical *self = h->self;
    const size_t n = self->base.n, c = h->c;
    const float *left = self->left_of_element + c * n, *rho = self->base.reflectance + c * n, *X = h->X;
    const float *lift = self->even.missing != NULL ? self->even.lift + c * n : NULL;
    const float *E = h->E;
    const uint32_t *position = self->base.position;
    const float factor = mean_factor(h);
    float *out = h->out;
    (void)thread;
    if (h->quantity == LAM_RADIOSITY && h->H0 == NULL && position != NULL) /* most answers */
        for (size_t i = first; i < last; i++)
            out[i] = rho[i] > 0.0f ? E[i] + bounced(left[i], lift, factor, X, position[i]) : E[i];
    else
        for (size_t i = first; i < last; i++)
            out[i] = answer_of(h, i, bounced(left[i], lift, factor, X, operator_position(&self->base, i)));
}

/* out from X. */
static void use(void *context, size_t piece, size_t first, size_t last) {
    const channel *h = context;
    const hierarchical *self = h->self;
    const size_t n = self->base.n, c = h->c;
    const float *left = self->left + c * n, *root = self->root_area, *X = h->X;
    const float *lift = self->even.missing != NULL ? self->even.lift + c * n : NULL;
    const float factor = mean_factor(h);
    float *out = h->out;
    (void)piece;
    if (h->adjoint) {
        for (size_t p = first; p < last; p++) out[p] = root[p] * X[p] + factor * (root[p] * root[p]) + 0.0f;
        return;
    }
    for (size_t p = first; p < last; p++) out[p] = bounced(left[p], lift, factor, X, p);
}

/* Room for a vector, of which `in`, E, H0, out and c are still to be set. */
typedef struct areas {
    channel h;
    float *from, *to, *slots;
} areas;

static areas take_areas(const hierarchical *self, void **work) {
    const wavelet_plan *plan = &self->plan;
    areas a = {.h = {.self = self}};
    a.h.X = work_area_take(work, self->base.n * sizeof *a.h.X);
    a.from = work_area_take(work, scaled_of(self) * sizeof *a.from);
    a.to = work_area_take(work, coefficients_of(self) * sizeof *a.to);
    a.slots = work_area_take(work, wavelet_plan_work(plan) * sizeof *a.slots);
    a.h.sums = work_area_take(work, plan->n_pieces * sizeof *a.h.sums);
    memset(a.from + plan->n_used, 0, TILED_PAST * sizeof *a.from);
    return a;
}

/* True when all light of a channel is 0, of which nothing bounces. */
static bool is_dark(const channel *h) {
    const size_t n = h->self->base.n;
    return wavelet_is_dark(h->in != NULL ? h->in : h->E, n) &&
           (h->in != NULL || h->H0 == NULL || wavelet_is_dark(h->H0, n));
}

/* X and its coefficients, times their steps. */
static void analyse(areas *a) {
    const hierarchical *self = a->h.self;
    const float *step = self->K[self->of_channel[a->h.c]].step;
    wavelet_plan_forward(&self->plan, fill, &a->h, a->h.X, step, a->from, a->slots, self->base.n_threads);
}

/* Writes what a dark channel gives. */
static void leave_dark(const channel *h) {
    const size_t n = h->self->base.n;
    if (h->in != NULL) memset(h->out, 0, n * sizeof *h->out);
    for (size_t i = 0; h->in == NULL && i < n; i++) h->out[i] = answer_of(h, i, 0);
}

static void apply_channel(areas *a) {
    const hierarchical *self = a->h.self;
    const size_t n = self->base.n, n_threads = self->base.n_threads;
    if (is_dark(&a->h)) {
        leave_dark(&a->h);
        return;
    }
    analyse(a);
    multiply_core(self, a->h.c, a->from, a->to);
    wavelet_plan_inverse(&self->plan, a->to, a->h.X, a->h.in != NULL ? use : NULL, &a->h, a->slots,
                         n_threads);
    if (a->h.in == NULL)
        parallel_share(n >= THREADS_WORTH ? n_threads : 1, n, AT_ONCE, finish_elements, &a->h);
}

/* The products of vectors by position, n_rhs at most OPERATOR_PASS. */
static void apply_by_position(const lam_operator *op, bool adjoint, size_t n_rhs, const float *in, float *out,
                              void *work) {
    const hierarchical *self = (const hierarchical *)op;
    const size_t n = op->n, C = op->n_channels;
    if (n_rhs >= WIDE_WORTH) {
        for (size_t c = 0; c < C; c++)
            hierarchical_wide_product(self, c, adjoint, n_rhs, in + c * n, out + c * n, work);
        return;
    }
    areas a = take_areas(self, &work);
    a.h.adjoint = adjoint;
    for (size_t c = 0; c < C; c++)
        for (size_t v = 0; v < n_rhs; v++) {
            a.h.c = c;
            a.h.in = in + (v * C + c) * n;
            a.h.out = out + (v * C + c) * n;
            apply_channel(&a);
        }
}

void hierarchical_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    apply_by_position(op, false, n_rhs, E, P, work);
}

void hierarchical_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    apply_by_position(op, true, n_rhs, g, w, work);
}

/* The channel of a vector that is answered. */
static void set_vector(channel *h, size_t c, const operator_vector *v) {
    const size_t n = h->self->base.n;
    h->c = c;
    h->quantity = v->quantity;
    h->E = v->E + c * n;
    h->H0 = v->H0 != NULL ? v->H0 + c * n : NULL;
}

void hierarchical_answer(const lam_operator *op, size_t n_rhs, const operator_vector *vectors, void *work) {
    const hierarchical *self = (const hierarchical *)op;
    if (n_rhs >= WIDE_WORTH) {
        for (size_t c = 0; c < op->n_channels; c++) hierarchical_wide_answer(self, c, n_rhs, vectors, work);
        return;
    }
    areas a = take_areas(self, &work);
    for (size_t c = 0; c < op->n_channels; c++)
        for (size_t v = 0; v < n_rhs; v++) {
            set_vector(&a.h, c, &vectors[v]);
            a.h.out = vectors[v].out + c * op->n;
            apply_channel(&a);
        }
}

static void answer_some(areas *a, hierarchical_some *some, size_t n_selected, const uint32_t *selected) {
    const channel *h = &a->h;
    const hierarchical *self = h->self;
    const size_t n = self->base.n, c = h->c;
    const float *left = self->left_of_element + c * n,
                *lift = self->even.missing != NULL ? self->even.lift + c * n : NULL;
    const bool known = hierarchical_some_light(some, h->E, h->H0);
    float factor = 0;
    if (some->extent == LIT_NOWHERE) {
        for (size_t r = 0; r < n_selected; r++) h->out[r] = answer_of(h, selected[r], 0);
        return;
    }
    if (some->extent == LIT_FEW) {
        if (!known) hierarchical_some_forward(some, c, h->E, h->H0, h->X, a->from, a->slots);
        if (lift != NULL) factor = (float)(some->sum / self->even.light[c]);
    } else {
        if (!known) analyse(a);
        factor = mean_factor(h);
    }
    hierarchical_some_multiply(some, c, a->from, a->to);
    wavelet_plan_inverse_some(&self->plan, some->asked.n_steps, some->asked.steps, a->to, h->X, a->slots);
    for (size_t r = 0; r < n_selected; r++) {
        const size_t i = selected[r], p = operator_position(&self->base, i);
        h->out[r] = answer_of(h, i, bounced(left[i], lift, factor, h->X, p));
    }
}

/* Where more than one in so many steps is needed, the whole answer is as quick: of few vectors, of many. */
enum { SOME_STEPS = 2, SOME_STEPS_WIDE = 6 };

bool hierarchical_answer_selected(const lam_operator *op, size_t n_rhs, const operator_vector *vectors,
                                  size_t n_selected, const uint32_t *selected, void *work) {
    const hierarchical *self = (const hierarchical *)op;
    areas a = take_areas(self, &work);
    hierarchical_some some = hierarchical_some_take(self, &work);
    if (!hierarchical_some_ask(&some, n_selected, selected,
                               n_rhs >= WIDE_WORTH ? SOME_STEPS_WIDE : SOME_STEPS))
        return false;
    for (size_t v = 0; v < n_rhs; v++)
        for (size_t c = 0; c < op->n_channels; c++) {
            set_vector(&a.h, c, &vectors[v]);
            a.h.out = vectors[v].out + c * n_selected;
            answer_some(&a, &some, n_selected, selected);
        }
    return true;
}
