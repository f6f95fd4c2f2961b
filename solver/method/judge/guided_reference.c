/* The solution of (I - R F) x = r is found by X := X + M r, r := r - (I - R F) M r with the judged operator
 * M, until the steps that are left, step (q + q^2 + ...), q = step / step before, sum to at most tolerance
 * |X|. Where q > 1/2 reference_solve() takes over; where an LU is quicker, it is used from the start. */
#include "solver/method/judge/guided_reference.h"

#include "solver/operator/emitters.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A correction is the error that is judged: figures have three digits, of which noise leaves two. */
static const double correction_tolerance = 2e-3;
/* A guide whose steps shrink less than this is of no use. */
static const double rate_most = .5;
/* The second step of a probe serves only to know the rest of it where steps shrink as fast as this: PILOTS
 * probes take theirs, and the others are left with the first one, that is off by the rate: half a unit of the
 * second digit, of which noise leaves two. An operator that is off by .03 for single elements has rates of
 * .001 to .002, which differ between probes by a factor of 1.6. */
static const double rate_trusted = 5e-3;
enum { PILOTS = 8 };
/* Columns that are solved together: panels of blocks. */
enum { COLUMNS = 24, PROBES_LEAST = 8 };
/* The same of one channel without a guide. */
enum { ALONE = 32 };

/* The vectors of some probes, [m][C][n], those of the product, of the caller, [n][m C]. */
typedef struct guided {
    double *d, *x, *y;
    double *last;  /* [m] length of the step before */
    double rate;   /* the largest ratio of a step to the one before */
    size_t *which; /* [m] probes that are not done */
    size_t count;
    bool *unguided; /* [m] */
} guided;

static void guided_free(guided *g) {
    free(g->d);
    free(g->last);
    free(g->which);
    free(g->unguided);
}

static lam_status guided_init(guided *g, const reference_system *s, size_t m, double *x, double *y,
                              lam_error *error) {
    const size_t values = m * s->n_channels * s->n;
    *g = (guided){.d = memory_allocate(values, sizeof *g->d, "reference", error),
                  .x = x,
                  .y = y,
                  .last = memory_allocate(m, sizeof *g->last, "reference", error),
                  .which = memory_allocate(m, sizeof *g->which, "reference", error),
                  .unguided = memory_allocate(m, sizeof *g->unguided, "reference", error)};
    if (g->d == NULL || g->last == NULL || g->which == NULL || g->unguided == NULL) return LAM_ERR_MEMORY;
    return LAM_OK;
}

/* The length of one probe by area, channels stacked. */
static double length(const reference_system *s, const double *x) {
    double sum = 0;
    for (size_t c = 0; c < s->n_channels; c++)
        for (size_t i = 0; i < s->n; i++) sum += s->area[i] * x[c * s->n + i] * x[c * s->n + i];
    return sqrt(sum);
}

/* r_v := r_v - d_v + R F d_v of the probes that are not done; d is [count][C][n]. */
static lam_status reduce_residual(const reference_system *s, guided *g, double *r, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->n, C = s->n_channels, columns = g->count * C;
#pragma omp parallel for schedule(static) if (n >= 2048)
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < columns; k++) g->x[i * columns + k] = g->d[k * n + i];
    TRY(s->F->multiply(s->F->context, columns, g->x, g->y, error));
#pragma omp parallel for schedule(static) if (n >= 2048)
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < columns; k++) {
            const size_t c = k % C, at = (g->which[k / C] * C + c) * n + i;
            r[at] += (double)s->reflectance[c * n + i] * g->y[i * columns + k] - g->d[k * n + i];
        }
done:
    return status;
}

/* Takes the steps d [count][C][n], and keeps the probes that are not done, with their steps, for another one.
 * A step that is not taken is useless: its probe is to be solved without the guide. */
static void take_steps(const reference_system *s, guided *g, double tolerance, bool first, double *X) {
    const size_t vector = s->n_channels * s->n;
    size_t left = 0;
    for (size_t k = 0; k < g->count; k++) {
        const size_t v = g->which[k];
        const double *d = g->d + k * vector, now = length(s, d);
        const double rate = first ? 1 : now > 0 ? now / g->last[v] : 0;
        if (!first && !(rate <= rate_most)) {
            g->unguided[v] = true;
            g->rate = INFINITY;
            continue;
        }
        if (!first) g->rate = fmax(g->rate, rate);
        for (size_t i = 0; i < vector; i++) X[v * vector + i] += d[i];
        g->last[v] = now;
        /* The steps that are left sum to now (rate + rate^2 + ...). */
        if (now == 0 || (!first && now * rate <= tolerance * (1 - rate) * length(s, X + v * vector)))
            continue;
        if (left < k) memcpy(g->d + left * vector, d, vector * sizeof *d);
        g->which[left++] = v;
    }
    g->count = left;
}

/* Adds the solution to what is left of the probes that the guide did not help. */
static lam_status solve_unguided(const reference_system *s, const bool *unguided, size_t m, const double *r,
                                 double *X, double tolerance, const progress *p, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->n, C = s->n_channels;
    reference *one = NULL;
    double *E = NULL, *B = NULL;
    size_t count = 0;
    for (size_t v = 0; v < m; v++) count += unguided[v];
    if (count == 0) return LAM_OK;
    E = memory_allocate(count, n * sizeof *E, "reference", error);
    B = memory_allocate(count, n * sizeof *B, "reference", error);
    if (E == NULL || B == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < C; c++) {
        size_t k = 0;
        for (size_t v = 0; v < m; v++)
            if (unguided[v]) memcpy(E + k++ * n, r + (v * C + c) * n, n * sizeof *E);
        memcpy(B, E, count * n * sizeof *B);
        TRY(reference_create_of(s->F, s->area, s->reflectance + c * n, REFERENCE_ITERATED, &one, error));
        TRY(reference_solve(one, count, E, B, tolerance, p, error));
        reference_destroy(one);
        one = NULL;
        k = 0;
        for (size_t v = 0; v < m; v++) {
            if (!unguided[v]) continue;
            for (size_t i = 0; i < n; i++) X[(v * C + c) * n + i] += B[k * n + i];
            k++;
        }
    }
done:
    reference_destroy(one);
    free(E);
    free(B);
    return status;
}

/* One more step of all probes that are not done. */
static lam_status step(const reference_system *s, guided *g, double tolerance, size_t m, bool first,
                       double *r, double *X, const reference_guide *guide, const progress *p,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = s->n_channels * s->n;
    const double *in = r;
    if (progress_cancelled(p)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    if (!first) TRY(reduce_residual(s, g, r, error));
    if (g->count < m) { /* x is free here */
        for (size_t k = 0; k < g->count; k++)
            memcpy(g->x + k * vector, r + g->which[k] * vector, vector * sizeof *r);
        in = g->x;
    }
    TRY(guide->answer(guide->context, g->count, in, g->d, error));
    take_steps(s, g, tolerance, first, X);
done:
    return status;
}

/* The second step of the first PILOTS probes. Where it tells that the first one was enough, the others are
 * done. */
static lam_status try_pilots(const reference_system *s, guided *g, double tolerance, size_t m, double *r,
                             double *X, const reference_guide *guide, const progress *p, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = s->n_channels * s->n, waiting = g->count - PILOTS;
    g->count = PILOTS;
    TRY(step(s, g, tolerance, m, false, r, X, guide, p, error));
    if (g->rate <= rate_trusted) goto done;
    memmove(g->d + g->count * vector, g->d + PILOTS * vector, waiting * vector * sizeof *g->d);
    memmove(g->which + g->count, g->which + PILOTS, waiting * sizeof *g->which);
    g->count += waiting;
done:
    return status;
}

/* x and y [n][m C] are for products; rate as in reference_answers. */
static lam_status correct(const reference_system *s, size_t m, double *r, double *X, double tolerance,
                          const reference_guide *guide, double *x, double *y, double *rate, const progress *p,
                          lam_error *error) {
    lam_status status = LAM_OK;
    guided g = {.count = 0};
    TRY(guided_init(&g, s, m, x, y, error));
    memset(X, 0, m * s->n_channels * s->n * sizeof *X);
    for (size_t v = 0; v < m; v++) g.which[g.count++] = v;
    TRY(step(s, &g, tolerance, m, true, r, X, guide, p, error));
    if (rate != NULL && *rate > 0 && *rate <= rate_trusted) goto done;
    if (rate != NULL && g.count > PILOTS) TRY(try_pilots(s, &g, tolerance, m, r, X, guide, p, error));
    while (g.count > 0) TRY(step(s, &g, tolerance, m, false, r, X, guide, p, error));
    if (rate != NULL) *rate = fmax(*rate, g.rate);
    TRY(solve_unguided(s, g.unguided, m, r, X, tolerance, p, error));
done:
    guided_free(&g);
    return status;
}

lam_status guided_reference_correct(const reference_system *s, size_t m, double *r, double *X,
                                    double tolerance, const reference_guide *guide, double *rate,
                                    const progress *p, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t values = m * s->n_channels * s->n;
    double *x = memory_allocate(values, sizeof *x, "reference", error);
    double *y = memory_allocate(values, sizeof *y, "reference", error);
    if (x == NULL || y == NULL) TRY(LAM_ERR_MEMORY);
    TRY(correct(s, m, r, X, tolerance, guide, x, y, rate, p, error));
done:
    free(x);
    free(y);
    return status;
}

/* The operator that is judged, as a guide. */
typedef struct operator_guide {
    const lam_operator *op;
    float *in, *out; /* [at_once][C][n] */
    void *work;
    size_t bytes, at_once;
} operator_guide;

static void operator_guide_free(operator_guide *g) {
    free(g->in);
    free(g->out);
    free(g->work);
}

/* For batches of `most` answers: one by one of many elements, as an operator takes them itself. */
static lam_status operator_guide_init(operator_guide *g, const lam_operator *op, size_t most,
                                      lam_error *error) {
    const size_t n = lam_operator_elements(op), vector = n * lam_operator_channels(op);
    const size_t at_once = n < REFERENCE_MANY_ELEMENTS ? most : 1;
    *g = (operator_guide){.op = op, .bytes = lam_operator_work_bytes(op, at_once), .at_once = at_once};
    g->in = memory_allocate(at_once, vector * sizeof *g->in, "reference", error);
    g->out = memory_allocate(at_once, vector * sizeof *g->out, "reference", error);
    g->work = memory_allocate(1, g->bytes, "reference", error);
    return g->in == NULL || g->out == NULL || g->work == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

static lam_status answer_by_operator(void *context, size_t m, const double *r, double *X, lam_error *error) {
    lam_status status = LAM_OK;
    const operator_guide *g = context;
    const size_t vector = lam_operator_elements(g->op) * lam_operator_channels(g->op);
    for (size_t first = 0; first < m; first += g->at_once) {
        const size_t some = m - first < g->at_once ? m - first : g->at_once, count = some * vector;
        const double *in = r + first * vector;
        double *out = X + first * vector;
#pragma omp parallel for schedule(static) if (count >= 65536)
        for (size_t i = 0; i < count; i++) g->in[i] = (float)in[i];
        TRY(lam_operator_apply(g->op, some, LAM_RADIOSITY, g->in, g->out, g->work, g->bytes, error));
#pragma omp parallel for schedule(static) if (count >= 65536)
        for (size_t i = 0; i < count; i++) out[i] = (double)g->out[i];
    }
done:
    return status;
}

/* Columns of answers: all channels of `count` answers, or one channel of them. */
typedef struct columns {
    const size_t *which;
    size_t count, channel, n_channels; /* channels `channel` ... */
} columns;

/* H + share D of a number of a first light that is known. */
static double first_at(const reference_answers *a, size_t at) {
    return a->first[at] + (a->spread != NULL ? a->share * a->spread[at] : 0);
}

static bool is_black(const reference_system *s, size_t i) {
    return s->black != NULL && s->black[i];
}

/* r = E - B~ + R F B~, or, where the first light H is known, E - B~ + R H + R F (B~ - E): what B = B~ + x
 * lacks, (I - R F) x = r. Of black elements, whose radiosity is E, it is what their irradiance H~ lacks by
 * the light B~ of the others: direct - H~ + F B~. x and y are [n][columns], r is [columns][n]. */
static lam_status residual(const reference_system *s, const reference_answers *a, const columns *of,
                           double *x, double *y, double *r, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->n, C = s->n_channels, count = of->count * of->n_channels;
#pragma omp parallel for schedule(static) if (n >= 2048)
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < count; k++) {
            const size_t v = of->which[k / of->n_channels];
            const size_t at = (v * C + of->channel + k % of->n_channels) * n + i;
            const bool known = a->first != NULL && a->known[v];
            const double B = (double)(is_black(s, i) ? a->E : a->B)[at];
            x[i * count + k] = B - (known ? (double)a->E[at] : 0);
        }
    TRY(s->F->multiply(s->F->context, count, x, y, error));
#pragma omp parallel for schedule(static) if (n >= 2048)
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < count; k++) {
            const size_t v = of->which[k / of->n_channels], c = of->channel + k % of->n_channels;
            const size_t at = (v * C + c) * n + i;
            const double H = y[i * count + k] + (a->first != NULL && a->known[v] ? first_at(a, at) : 0);
            const double direct = a->direct != NULL ? (double)a->direct[at] : 0;
            r[k * n + i] = is_black(s, i)
                               ? direct - (double)a->B[at] + H
                               : (double)a->E[at] - (double)a->B[at] + (double)s->reflectance[c * n + i] * H;
        }
done:
    return status;
}

/* The numbers of a batch; dark: r of black elements, of the others 0; NULL: there are none. */
typedef struct batch {
    double *x, *y, *r, *X, *dark;
    bool lit; /* some element is not black */
} batch;

static void batch_free(batch *b) {
    free(b->x);
    free(b->y);
    free(b->r);
    free(b->X);
    free(b->dark);
}

static lam_status batch_init(batch *b, const reference_system *s, size_t count, lam_error *error) {
    double **const all[] = {&b->x, &b->y, &b->r, &b->X, &b->dark};
    *b = (batch){.x = NULL, .lit = s->black == NULL};
    for (size_t k = 0; k < (s->black != NULL ? 5 : 4); k++) {
        *all[k] = memory_allocate(count, s->n * sizeof **all[k], "reference", error);
        if (*all[k] == NULL) return LAM_ERR_MEMORY;
    }
    for (size_t i = 0; s->black != NULL && i < s->n; i++) b->lit = b->lit || !s->black[i];
    return LAM_OK;
}

/* Puts r of black elements aside: they send nothing on. */
static void set_black_aside(const reference_system *s, size_t count, batch *b) {
    const size_t n = s->n;
    for (size_t k = 0; b->dark != NULL && k < count * n; k++) {
        const bool black = s->black[k % n];
        b->dark[k] = black ? b->r[k] : 0;
        if (black) b->r[k] = 0;
    }
}

/* X of black elements is r and the light of what the others lack, F X. */
static lam_status finish_black(const reference_system *s, size_t count, batch *b, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->n;
    if (b->dark == NULL) return LAM_OK;
    for (size_t k = 0; b->lit && k < count * n; k++) b->x[k % n * count + k / n] = b->X[k];
    if (b->lit) TRY(s->F->multiply(s->F->context, count, b->x, b->y, error));
    for (size_t k = 0; k < count * n; k++)
        if (s->black[k % n]) b->X[k] = b->dark[k] + (b->lit ? b->y[k % n * count + k / n] : 0);
done:
    return status;
}

size_t guided_reference_columns(size_t n, size_t n_channels) {
    const size_t most = n < REFERENCE_MANY_ELEMENTS ? COLUMNS / n_channels : PROBES_LEAST;
    return n_channels * (most < PROBES_LEAST ? PROBES_LEAST : most);
}

static lam_status each_guided(const reference_system *s, const reference_answers *a, size_t m,
                              const size_t *which, visit_correction *visit, void *context, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->n, C = s->n_channels;
    const size_t together = guided_reference_columns(n, C) / C, most = together < m ? together : m;
    operator_guide of = {.op = NULL};
    const reference_guide guide = {answer_by_operator, &of};
    batch b = {.x = NULL};
    TRY(batch_init(&b, s, most * C, error));
    TRY(operator_guide_init(&of, a->op, most, error));
    for (size_t first = 0; first < m; first += most) {
        const columns some = {which + first, m - first < most ? m - first : most, 0, C};
        TRY(residual(s, a, &some, b.x, b.y, b.r, error));
        set_black_aside(s, some.count * C, &b);
        TRY(correct(s, some.count, b.r, b.X, correction_tolerance, &guide, b.x, b.y, a->rate, a->progress,
                    error));
        TRY(finish_black(s, some.count * C, &b, error));
        for (size_t k = 0; k < some.count * C; k++) visit(context, which[first + k / C], k % C, b.X + k * n);
    }
done:
    operator_guide_free(&of);
    batch_free(&b);
    return status;
}

/* One channel after the other: an LU takes 8 n^2 bytes. */
static lam_status each_alone(const reference_system *s, const reference_answers *a, reference_way way,
                             size_t m, const size_t *which, visit_correction *visit, void *context,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->n, C = s->n_channels;
    reference *one = NULL;
    batch b = {.x = NULL};
    TRY(batch_init(&b, s, m < ALONE ? m : ALONE, error));
    for (size_t c = 0; c < C; c++) {
        TRY(reference_create_of(s->F, s->area, s->reflectance + c * n, way, &one, error));
        for (size_t first = 0; first < m; first += ALONE) {
            const columns some = {which + first, m - first < ALONE ? m - first : ALONE, c, 1};
            if (progress_cancelled(a->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
            TRY(residual(s, a, &some, b.x, b.y, b.r, error));
            set_black_aside(s, some.count, &b);
            memcpy(b.X, b.r, some.count * n * sizeof *b.X);
            TRY(reference_solve(one, some.count, b.r, b.X, correction_tolerance, a->progress, error));
            TRY(finish_black(s, some.count, &b, error));
            for (size_t k = 0; k < some.count; k++) visit(context, which[first + k], c, b.X + k * n);
        }
        reference_destroy(one);
        one = NULL;
    }
done:
    reference_destroy(one);
    batch_free(&b);
    return status;
}

bool guided_reference_is_dense(const reference_system *s, const lam_operator *op, size_t m) {
    const bool may_guide = lam_operator_emitters(op) == 0;
    return reference_choose(s->F, s->area, s->reflectance, m, may_guide) == REFERENCE_DENSE;
}

lam_status guided_reference_each(const reference_system *s, const reference_answers *a, size_t m,
                                 const size_t *which, visit_correction *visit, void *context,
                                 lam_error *error) {
    const bool may_guide = lam_operator_emitters(a->op) == 0;
    const reference_way way = reference_choose(s->F, s->area, s->reflectance, m, may_guide);
    if (may_guide && way == REFERENCE_ITERATED) return each_guided(s, a, m, which, visit, context, error);
    return each_alone(s, a, way, m, which, visit, context, error);
}
