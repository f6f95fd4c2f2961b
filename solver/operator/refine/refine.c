/* lam_refiner and lam_refine: bounds on (I - R F)^-1, batches, quantities. */
#include "solver/operator/refine/refinement.h"

#include "solver/base/random.h"
#include "solver/linalg/csr_rows.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Most bytes of vectors that are refined together, unless it is one. */
#define PASS_BYTES ((size_t)1 << 29)

/* Largest emission, so that answers stay far from the end of double's range. */
#define LARGEST 1e100

/* w = 1, v = 1 - rho s. */
static lam_status bound_by_rows(const lam_refiner *refiner, size_t c, refine_channel *channel,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = refiner->op->n;
    channel->w_most = channel->v_least = 1;
    for (size_t i = 0; i < n; i++) {
        const double taken = (double)channel->rho[i] * refiner->F->row_sums[i];
        channel->v[i] = 1 - taken * (1 + refiner->roundings) - 2 * REFINE_U;
        if (!(channel->v[i] > 0))
            FAIL(error, LAM_ERR_NUMERIC,
                 "element %zu of channel %zu: reflectance times the sum of its form factors is %.17g, of a "
                 "sum of %.9g, "
                 "must be below 1; no error can be certified",
                 i, c, taken, refiner->F->row_sums[i]);
        channel->v_least = fmin(channel->v_least, channel->v[i]);
    }
done:
    return status;
}

/* 1 - r_i less the bound of its rounding. */
static double bounded_v(const refinement *s, size_t c, size_t i) {
    return (1 - s->r[c * s->refiner->op->n + i] - s->columns[c].error) * (1 - 4 * REFINE_U);
}

/* w = E' + P for E' = 1 and v = A w = 1 - r; taken when its bound is sharper than the present one. */
static void bound_by_light(refinement *s, size_t c, refine_channel *channel) {
    const size_t n = s->refiner->op->n;
    const double *P = s->P + c * n;
    double w_least = INFINITY, w_most = 0, v_least = INFINITY;
    for (size_t i = 0; i < n; i++) {
        const double w = 1 + P[i], v = bounded_v(s, c, i);
        w_least = fmin(w_least, w);
        w_most = fmax(w_most, w);
        v_least = fmin(v_least, v);
    }
    w_most *= 1 + 2 * REFINE_U;
    if (!(w_least > 0 && v_least > 0 && w_most / v_least < channel->w_most / channel->v_least)) return;
    channel->w_most = w_most;
    channel->v_least = v_least;
    for (size_t i = 0; i < n; i++) channel->v[i] = bounded_v(s, c, i);
}

static int by_falling_mean(const void *left, const void *right) {
    const refine_row *a = left, *b = right;
    if (a->mean != b->mean) return a->mean < b->mean ? 1 : -1;
    return a->element < b->element ? -1 : 1;
}

static void prepare_judging(const lam_refiner *refiner, refine_channel *channel) {
    const lam_form_factors *F = refiner->F;
    channel->peak = 0;
    for (size_t i = 0; i < refiner->op->n; i++) {
        const double rho = (double)channel->rho[i];
        channel->peak = fmax(channel->peak, rho * F->row_sums[i] / channel->v[i]);
        channel->rows[i] = (refine_row){rho * F->row_norms[i] / channel->v[i], (uint32_t)i};
    }
    qsort(channel->rows, refiner->op->n, sizeof *channel->rows, by_falling_mean);
}

/* An operator in i8 is read in a quarter of the time and reduces r less. The cost of a digit is the bytes of
 * a step, of F and of the operator, over the digits that the step gains; infinite when it gains none. */
static double cost_of_digit(const refinement *s, double left) {
    const lam_refiner *refiner = s->refiner;
    const size_t bytes = lam_form_factors_bytes(refiner->F) + lam_operator_bytes(refiner_help(refiner));
    return left < 1 ? (double)bytes / -log10(fmax(left, DBL_EPSILON)) : INFINITY;
}

/* |r| / |P| after the start by the operator, in the worst channel. */
static double left_by_start(refinement *s) {
    const lam_refiner *refiner = s->refiner;
    const size_t n = refiner->op->n;
    double worst = 0;
    refinement_start(s);
    for (size_t k = 0; k < s->n_columns * n; k++) s->z[k] = s->lit[k] + s->P[k];
    for (size_t c = 0; c < s->n_columns; c++) s->active[c] = true;
    refinement_multiply(s, s->active, s->z, s->q);
    for (size_t c = 0; c < s->n_columns; c++) {
        const refine_channel *channel = s->columns[c].channel;
        double left = 0, all = 0;
        for (size_t i = 0; i < n; i++) {
            const double P = s->P[c * n + i], r = (double)channel->rho[i] * s->q[c * n + i] - P;
            left += channel->scale[i] * r * r;
            all += channel->scale[i] * P * P;
        }
        if (left > 0) worst = fmax(worst, sqrt(left / all));
    }
    return worst;
}

/* x_k independent and uniform in [0, 1). */
static void write_probe(size_t count, double *x) {
    uint64_t state = 1;
    for (size_t k = 0; k < count; k++) x[k] = (double)random_to_float(random_lcg(&state));
}

/* Sets refiner->helper, or leaves it NULL. Cost: two products with F. */
static lam_status find_helper(lam_refiner *refiner, lam_error *error) {
    lam_status status = LAM_OK;
    const lam_operator *op = refiner->op;
    refinement s = {.n_columns = 0};
    operator_description about = {.density = -1};
    lam_operator *helper = NULL;
    operator_describe(op, &about);
    if (op->kind->narrow == NULL || (about.precision != NULL && strcmp(about.precision, "f32") != 0))
        return LAM_OK;
    if (operator_narrow(op, PANEL_I8, &helper, NULL) != LAM_OK) return LAM_OK; /* op is used */
    refiner->helper = helper;
    TRY(refinement_create(refiner, 1, &s, error));
    write_probe(s.n_columns * op->n, s.lit);
    const double by_helper = cost_of_digit(&s, left_by_start(&s));
    refiner->helper = NULL;
    if (by_helper < cost_of_digit(&s, left_by_start(&s))) {
        refiner->helper = helper;
        helper = NULL;
    }
done:
    if (status != LAM_OK) refiner->helper = NULL;
    lam_operator_close(helper);
    refinement_free(&s);
    return status;
}

static lam_status bound_inverse(lam_refiner *refiner, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = refiner->op->n, C = refiner->op->n_channels;
    refinement s = {.n_columns = 0};
    for (size_t c = 0; c < C; c++) {
        refine_channel *channel = &refiner->channels[c];
        channel->rho = refiner->op->reflectance + c * n;
        channel->v = memory_allocate(n, sizeof *channel->v, "refining", error);
        channel->scale = memory_allocate(n, sizeof *channel->scale, "refining", error);
        channel->rows = memory_allocate(n, sizeof *channel->rows, "refining", error);
        if (channel->v == NULL || channel->scale == NULL || channel->rows == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < n; i++)
            channel->scale[i] = channel->rho[i] > 0 ? refiner->F->area[i] / (double)channel->rho[i] : 0;
        TRY(bound_by_rows(refiner, c, channel, error));
    }
    TRY(find_helper(refiner, error));
    TRY(refinement_create(refiner, 1, &s, error));
    s.weights = true;
    for (size_t k = 0; k < C * n; k++) s.lit[k] = 1;
    refinement_start(&s);
    refinement_solve(&s);
    for (size_t c = 0; c < C; c++) {
        bound_by_light(&s, c, &refiner->channels[c]);
        prepare_judging(refiner, &refiner->channels[c]);
    }
done:
    refinement_free(&s);
    return status;
}

lam_status lam_refiner_create(const lam_operator *op, const lam_form_factors *F, lam_refiner **out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    lam_refiner *made = NULL;
    if (op == NULL || F == NULL || out == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "an operator, its form factors and a place for the refiner are needed");
    if (F->n != op->n)
        FAIL(error, LAM_ERR_ARGUMENT, "form factors of %zu elements do not go with an operator of %zu", F->n,
             op->n);
    made = memory_allocate(1, sizeof *made, "refining", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    made->op = op;
    made->F = F;
    /* Roundings of the sum, of E' (2), of E' + P and of the product with rho. */
    const double count = (csr_doubles_roundings(F->longest) + 4) * REFINE_U;
    made->roundings = count / (1 - count);
    for (size_t i = 0; i < op->n; i++)
        made->row_most = fmax(made->row_most, F->row_sums[i] * (1 + (double)F->longest * REFINE_U));
    made->channels = memory_allocate(op->n_channels, sizeof *made->channels, "refining", error);
    if (made->channels == NULL) TRY(LAM_ERR_MEMORY);
    TRY(bound_inverse(made, error));
    *out = made;
    made = NULL;
done:
    lam_refiner_free(made);
    return status;
}

void lam_refiner_free(lam_refiner *refiner) {
    if (refiner == NULL) return;
    for (size_t c = 0; refiner->channels != NULL && c < refiner->op->n_channels; c++) {
        free(refiner->channels[c].v);
        free(refiner->channels[c].scale);
        free(refiner->channels[c].rows);
    }
    free(refiner->channels);
    lam_operator_close(refiner->helper);
    free(refiner);
}

/* The arguments of lam_refine. */
typedef struct request {
    lam_quantity quantity;
    const double *E, *H0;
    const float *start;
    double tolerance;
    double *out, *certificates;
    size_t *iterations;
} request;

static lam_status check(const lam_refiner *refiner, size_t n_rhs, const request *asked, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count, bytes;
    if (refiner == NULL || asked->E == NULL || asked->out == NULL || asked->certificates == NULL ||
        asked->iterations == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "a refiner, emissions and places for the answers, their certificates and iterations are "
             "needed, one is NULL");
    if (asked->quantity != LAM_RADIOSITY && asked->quantity != LAM_IRRADIANCE &&
        asked->quantity != LAM_INDIRECT)
        FAIL(error, LAM_ERR_ARGUMENT, "there is no quantity %d", (int)asked->quantity);
    if (!(asked->tolerance > 0 && asked->tolerance < 1))
        FAIL(error, LAM_ERR_ARGUMENT, "tolerance = %g, must be above 0 and below 1", asked->tolerance);
    const size_t n = refiner->op->n, C = refiner->op->n_channels;
    if (!size_multiply(n_rhs, C, &count) || !size_multiply(count, n, &count) ||
        !size_multiply(count, sizeof(double), &bytes))
        FAIL(error, LAM_ERR_ARGUMENT,
             "n_rhs = %zu vectors of %zu x %zu numbers are more than memory can have", n_rhs, C, n);
    for (size_t k = 0; k < count; k++) {
        if (!(asked->E[k] >= 0 && asked->E[k] <= LARGEST))
            FAIL(error, LAM_ERR_ARGUMENT, "E[%zu][%zu] = %g, must be from 0 to 1e100", k / (C * n),
                 k % (C * n), asked->E[k]);
        if (asked->H0 != NULL && !(asked->H0[k] >= 0 && asked->H0[k] <= LARGEST))
            FAIL(error, LAM_ERR_ARGUMENT, "H0[%zu][%zu] = %g, must be from 0 to 1e100", k / (C * n),
                 k % (C * n), asked->H0[k]);
    }
done:
    return status;
}

/* lit = E' 2^-exponent, the largest from 1/2 to 1; returns the exponent. */
static int light_column(refinement *s, size_t c, const double *E, const double *H0, double *lit) {
    const size_t n = s->refiner->op->n;
    const float *rho = s->columns[c].channel->rho;
    double largest = 0;
    int exponent = 0;
    s->columns[c].lit_rounded = false;
    for (size_t i = 0; i < n; i++) {
        lit[i] = H0 != NULL ? E[i] + (double)rho[i] * H0[i] : E[i];
        largest = lit[i] > largest ? lit[i] : largest;
        if (H0 != NULL && rho[i] > 0 && H0[i] > 0) s->columns[c].lit_rounded = true;
    }
    (void)frexp(largest, &exponent);
    for (size_t i = 0; i < n; i++) lit[i] = ldexp(lit[i], -exponent);
    return exponent;
}

/* H = H0 + F (E' + P), also where rho = 0. |H - H~| <= s |P - P~| plus rounding. */
static void find_irradiance(refinement *s, const int *exponents, const double *H0, double *out,
                            double *certificates) {
    const lam_refiner *refiner = s->refiner;
    const size_t n = refiner->op->n, C = refiner->op->n_channels;
    for (size_t c = 0; c < s->n_columns; c++) {
        double least = 0;
        s->active[c] = true;
        for (size_t i = 0; i < n; i++) {
            const double x = s->lit[c * n + i] + refinement_answer(s, c, i);
            s->z[c * n + i] = x;
            least = fmin(least, x);
        }
        s->columns[c].least = least;
    }
    refinement_multiply(s, s->active, s->z, s->q);
    for (size_t c = 0; c < s->n_columns; c++) {
        const refine_column *col = &s->columns[c];
        double largest = 0, rounded = 0;
        for (size_t i = 0; i < n; i++) {
            const double h = ldexp(s->q[c * n + i], exponents[c]);
            const double H = H0 != NULL ? H0[c * n + i] + h : h;
            out[c * n + i] = H;
            largest = fmax(largest, fabs(s->q[c * n + i]));
            rounded = fmax(rounded, H0 != NULL ? REFINE_U * fabs(H) : 0);
        }
        double moved = refiner->row_most * col->bound +
                       refiner->roundings * (largest - 2 * col->least * refiner->row_most);
        if (!refiner_has_rows(refiner))
            moved += refiner_product_rounding(refiner, refine_most(n, s->z + c * n));
        certificates[c / C] = fmax(certificates[c / C], ldexp(moved, exponents[c]) + rounded);
    }
}

/* B = E' + P, or P. */
static void find_light(const refinement *s, const int *exponents, lam_quantity quantity, double *out,
                       double *certificates) {
    const size_t n = s->refiner->op->n, C = s->refiner->op->n_channels;
    for (size_t c = 0; c < s->n_columns; c++) {
        const bool sum = quantity == LAM_RADIOSITY;
        for (size_t i = 0; i < n; i++) {
            const double P = refinement_answer(s, c, i);
            out[c * n + i] = ldexp(sum ? s->lit[c * n + i] + P : P, exponents[c]);
        }
        certificates[c / C] = fmax(certificates[c / C], ldexp(s->columns[c].bound, exponents[c]));
    }
}

static lam_status refine_pass(refinement *s, size_t first, const request *asked, int *exponents,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->refiner->op->n, C = s->refiner->op->n_channels, begin = first * C * n;
    const double *E = asked->E + begin, *H0 = asked->H0 != NULL ? asked->H0 + begin : NULL;
    s->tolerance = asked->tolerance;
    s->count_sum = asked->quantity == LAM_RADIOSITY;
    for (size_t c = 0; c < s->n_columns; c++)
        exponents[c] = light_column(s, c, E + c * n, H0 != NULL ? H0 + c * n : NULL, s->lit + c * n);
    if (asked->start == NULL) {
        refinement_start(s);
    } else {
        for (size_t k = 0; k < s->n_columns * n; k++) {
            const double P = ldexp((double)asked->start[begin + k], -exponents[k / n]);
            s->P[k] = s->columns[k / n].channel->rho[k % n] > 0 && P > 0 && P < 0x1p100 ? P : 0;
        }
    }
    refinement_solve(s);
    if (s->left) FAIL(error, LAM_ERR_NUMERIC, "the refinement was left before its end");
    for (size_t c = 0; c < s->n_columns; c++) {
        const refine_column *col = &s->columns[c];
        if (col->done) continue;
        FAIL(error, LAM_ERR_NUMERIC,
             "tolerance %g is not reached: vector %zu is certified to %.2g of its indirect light after %zu "
             "products with the form factors; use a larger tolerance",
             asked->tolerance, first + c / C, col->bound / col->P, col->passes);
    }
    for (size_t v = 0; v < s->n_vectors; v++) asked->certificates[first + v] = 0;
    if (asked->quantity == LAM_IRRADIANCE)
        find_irradiance(s, exponents, H0, asked->out + begin, asked->certificates + first);
    else
        find_light(s, exponents, asked->quantity, asked->out + begin, asked->certificates + first);
    for (size_t v = 0; v < s->n_vectors; v++) {
        asked->iterations[first + v] = 0;
        for (size_t c = v * C; c < (v + 1) * C; c++)
            if (s->columns[c].passes > asked->iterations[first + v])
                asked->iterations[first + v] = s->columns[c].passes;
    }
done:
    return status;
}

/* Vectors of a pass: as many as share a product, within PASS_BYTES. */
static size_t vectors_at_once(const lam_refiner *refiner, size_t n_rhs) {
    const size_t C = refiner->op->n_channels, room = PASS_BYTES / refinement_bytes(refiner);
    size_t count = CSR_DOUBLES_WIDTH / C;
    if (count > room) count = room;
    if (count > n_rhs) count = n_rhs;
    return count > 0 ? count : 1;
}

/* Answers go to memory of their own, so that an error leaves the outputs of the caller untouched. */
static lam_status reserve_answers(size_t n_rhs, size_t size, request *made, lam_error *error) {
    made->out = memory_allocate(n_rhs, size * sizeof *made->out, "refined answers", error);
    made->certificates = memory_allocate(n_rhs, sizeof *made->certificates, "refined answers", error);
    made->iterations = memory_allocate(n_rhs, sizeof *made->iterations, "refined answers", error);
    return made->out != NULL && made->certificates != NULL && made->iterations != NULL ? LAM_OK
                                                                                       : LAM_ERR_MEMORY;
}

lam_status refine_watched(const lam_refiner *refiner, size_t n_rhs, lam_quantity quantity, const double *E,
                          const double *H0, const float *start, double tolerance, double *out,
                          double *certificates, size_t *iterations, const refine_watch *watch,
                          lam_error *error) {
    lam_status status = LAM_OK;
    refinement s = {.n_columns = 0};
    int *exponents = NULL;
    const request asked = {quantity, E, H0, start, tolerance, out, certificates, iterations};
    request made = {quantity, E, H0, start, tolerance, NULL, NULL, NULL};
    TRY(check(refiner, n_rhs, &asked, error));
    const size_t size = refiner->op->n_channels * refiner->op->n;
    TRY(reserve_answers(n_rhs, size, &made, error));
    for (size_t first = 0; first < n_rhs; first += s.n_vectors) {
        const size_t count = vectors_at_once(refiner, n_rhs - first);
        if (count != s.n_vectors) {
            refinement_free(&s);
            free(exponents);
            exponents =
                memory_allocate(count * refiner->op->n_channels, sizeof *exponents, "refining", error);
            if (exponents == NULL) TRY(LAM_ERR_MEMORY);
            TRY(refinement_create(refiner, count, &s, error));
            s.watch = watch;
        }
        TRY(refine_pass(&s, first, &made, exponents, error));
    }
    memcpy(out, made.out, n_rhs * size * sizeof *out);
    memcpy(certificates, made.certificates, n_rhs * sizeof *certificates);
    memcpy(iterations, made.iterations, n_rhs * sizeof *iterations);
done:
    refinement_free(&s);
    free(exponents);
    free(made.out);
    free(made.certificates);
    free(made.iterations);
    return status;
}

lam_status lam_refine(const lam_refiner *refiner, size_t n_rhs, lam_quantity quantity, const double *E,
                      const double *H0, const float *start, double tolerance, double *out,
                      double *certificates, size_t *iterations, lam_error *error) {
    return refine_watched(refiner, n_rhs, quantity, E, H0, start, tolerance, out, certificates, iterations,
                          NULL, error);
}
