/* The public functions around a kind's product: they check arguments, cut a batch into passes, and lead from
 * emission in mesh order to the quantity asked for and back. */
#include "solver/base/parallel.h"
#include "solver/base/work_area.h"
#include "solver/operator/operator.h"

#include <stdint.h>
#include <stdlib.h>

/* A pass needs the caller's vectors in position order and side by side (the adjoint: g pulled back through
 * the quantity), the answer before it is put into mesh order or handed out, and what the kind needs. */
static size_t pass_bytes(const lam_operator *op, size_t n_rhs, size_t *vectors_bytes) {
    size_t count, vectors, kind_bytes = op->kind->work_bytes(op, n_rhs), total = WORK_AREA_ALIGN;
    if (kind_bytes == 0 || !size_multiply(n_rhs, op->n_channels, &count) ||
        !size_multiply(count, op->n, &count) || !size_multiply(count, sizeof(float), &vectors) ||
        !work_area_add(&total, vectors) || !work_area_add(&total, vectors) ||
        !work_area_add(&total, kind_bytes))
        return 0;
    if (vectors_bytes != NULL) *vectors_bytes = vectors;
    return total;
}

size_t lam_operator_work_bytes(const lam_operator *op, size_t n_rhs) {
    return pass_bytes(op, n_rhs < OPERATOR_PASS ? n_rhs : OPERATOR_PASS, NULL);
}

static bool overlap(const void *a, size_t a_bytes, const void *b, size_t b_bytes) {
    uintptr_t first = (uintptr_t)a, second = (uintptr_t)b;
    return first < second ? second - first < a_bytes : first - second < b_bytes;
}

/* Checks arguments, and makes the operator ready. n_out: numbers of out in a vector and a channel. */
static lam_status check_apply(const lam_operator *op, size_t n_rhs, lam_quantity quantity, const float *in,
                              size_t n_out, const float *out, const void *work, size_t work_bytes,
                              lam_error *error) {
    lam_status status = LAM_OK;
    size_t bytes, out_bytes;
    if (op == NULL || in == NULL || out == NULL || work == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "an operator, its input, its output and a work area are needed, one is NULL");
    if (op->kind->apply == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "an operator of kind %s answers for its own emitters only",
             op->kind->name);
    if (quantity != LAM_RADIOSITY && quantity != LAM_IRRADIANCE && quantity != LAM_INDIRECT)
        FAIL(error, LAM_ERR_ARGUMENT, "there is no quantity %d", (int)quantity);
    if (!size_multiply(n_rhs, op->n_channels, &bytes) || !size_multiply(bytes, op->n, &bytes) ||
        !size_multiply(bytes, sizeof(float), &bytes))
        FAIL(error, LAM_ERR_ARGUMENT,
             "n_rhs = %zu vectors of %zu x %zu numbers are more than memory can have", n_rhs, op->n_channels,
             op->n);
    if (!size_multiply(bytes / op->n, n_out, &out_bytes))
        FAIL(error, LAM_ERR_ARGUMENT,
             "n_rhs = %zu vectors of %zu x %zu numbers are more than memory can have", n_rhs, op->n_channels,
             n_out);
    size_t needed = lam_operator_work_bytes(op, n_rhs);
    if (needed == 0 || work_bytes < needed)
        FAIL(error, LAM_ERR_ARGUMENT, "work area of %zu bytes, %zu are needed for n_rhs = %zu", work_bytes,
             needed, n_rhs);
    if ((uintptr_t)work % _Alignof(max_align_t) != 0)
        FAIL(error, LAM_ERR_ARGUMENT, "work area is not aligned to %zu bytes", _Alignof(max_align_t));
    if (overlap(in, bytes, out, out_bytes) || overlap(in, bytes, work, work_bytes) ||
        overlap(out, out_bytes, work, work_bytes))
        FAIL(error, LAM_ERR_ARGUMENT, "input, output and work area overlap");
    TRY(operator_prepare(op, error));
done:
    return status;
}

/* Rows shorter than this are finished by one thread. */
#define THREADS_WORTH 65536

/* Elements that a thread takes at a time. */
enum { AT_ONCE = 4096 };

/* One row of out from the same row of E and of H0 (NULL: 0), all in mesh order, and of P (position order).
 * out may be P when there is no order. */
typedef struct mesh_row {
    const lam_operator *op;
    lam_quantity quantity;
    const float *rho, *E, *H0, *P;
    float *out;
} mesh_row;

static size_t row_threads(const lam_operator *op) {
    return op->n >= THREADS_WORTH ? op->n_threads : 1;
}

/* Elements are taken in mesh order, as scattered reads cost less than scattered writes. */
static void finish_elements(const void *job, size_t thread, size_t first, size_t last) {
    const mesh_row *r = job;
    const lam_operator *op = r->op;
    const float *rho = r->rho, *E = r->E, *H0 = r->H0, *P = r->P;
    float *out = r->out;
    (void)thread;
    if (r->quantity == LAM_RADIOSITY && H0 == NULL) /* most answers */
        for (size_t i = first; i < last; i++)
            out[i] = rho[i] > 0.0f ? E[i] + P[operator_position(op, i)] : E[i];
    else
        for (size_t i = first; i < last; i++)
            out[i] = operator_finish(r->quantity, rho[i], operator_light(rho, E, H0, i),
                                     P[operator_position(op, i)], H0 != NULL ? H0[i] : 0.0f);
}

static void finish_row(const lam_operator *op, size_t c, lam_quantity quantity, const float *E,
                       const float *H0, const float *P, float *out) {
    const mesh_row r = {op, quantity, op->reflectance + c * op->n, E, H0, P, out};
    parallel_share(row_threads(op), op->n, AT_ONCE, finish_elements, &r);
}

/* The same for some elements: P holds theirs, or (by_position) all. out may be P when it holds theirs. */
static void finish_selected(const lam_operator *op, size_t c, lam_quantity quantity, const float *lit,
                            const float *H0, size_t n_selected, const uint32_t *selected, bool by_position,
                            const float *P, float *out) {
    const float *rho = op->reflectance + c * op->n;
    for (size_t r = 0; r < n_selected; r++) {
        const size_t i = selected[r], p = operator_position(op, i);
        out[r] = operator_finish(quantity, rho[i], lit[p], P[by_position ? p : r], H0 != NULL ? H0[i] : 0.0f);
    }
}

static void light_positions(const void *job, size_t thread, size_t first, size_t last) {
    const mesh_row *r = job;
    const uint32_t *order = r->op->order;
    (void)thread;
    for (size_t p = first; p < last; p++)
        r->out[p] = operator_light(r->rho, r->E, r->H0, order != NULL ? order[p] : p);
}

/* One row of E' = E + rho H0, from mesh order into position order. */
static void light_row(const lam_operator *op, size_t c, const float *E, const float *H0, float *lit) {
    const mesh_row r = {.op = op, .rho = op->reflectance + c * op->n, .E = E, .H0 = H0, .out = lit};
    parallel_share(row_threads(op), op->n, AT_ONCE, light_positions, &r);
}

/* The input of one pass, for all of out or (selected not NULL) some elements. */
typedef struct pass {
    const float *E, *H0;
    size_t count, n_selected;
    const uint16_t *order; /* [count], the vectors of E, H0 and out that it has; NULL: the first ones */
    const uint32_t *selected;
    lam_quantity quantity;
} pass;

/* A pass of a kind that gives answers, n_out numbers in a channel of each. */
static void list_answers(const lam_operator *op, const pass *in, size_t n_out, float *out,
                         operator_vector *vectors) {
    const size_t C = op->n_channels, n = op->n;
    for (size_t k = 0; k < in->count; k++) {
        const size_t v = in->order != NULL ? in->order[k] : k;
        vectors[k] = (operator_vector){in->quantity, in->E + v * C * n,
                                       in->H0 != NULL ? in->H0 + v * C * n : NULL, out + v * C * n_out};
    }
}

/* The answers for some elements; where these are many they are picked out of whole answers. */
static void answer_selected(const lam_operator *op, const pass *in, float *out, void *work) {
    const size_t rows = in->count * op->n_channels, width = in->n_selected;
    operator_vector vectors[OPERATOR_PASS];
    list_answers(op, in, width, out, vectors);
    if (op->kind->answer_selected(op, in->count, vectors, width, in->selected, work)) return;
    float *whole = work_area_take(&work, rows * op->n * sizeof *whole);
    list_answers(op, in, op->n, whole, vectors);
    op->kind->answer(op, in->count, vectors, work);
    for (size_t row = 0; row < rows; row++)
        for (size_t r = 0; r < width; r++) out[row * width + r] = whole[row * op->n + in->selected[r]];
}

static void apply_pass(const lam_operator *op, const pass *in, float *out, void *work) {
    const size_t n = op->n, rows = in->count * op->n_channels, row_bytes = n * sizeof(float);
    const bool choose = in->selected != NULL && op->kind->apply_selected != NULL;
    const bool apart = in->selected != NULL ? !choose : op->order != NULL;
    const float *lit = in->E;
    float *P = out;
    void *rest = work_area_begin(work);
    if (in->selected == NULL && op->kind->answer != NULL) {
        operator_vector vectors[OPERATOR_PASS];
        list_answers(op, in, n, out, vectors);
        op->kind->answer(op, in->count, vectors, rest);
        return;
    }
    if (in->selected != NULL && op->kind->answer_selected != NULL) {
        answer_selected(op, in, out, rest);
        return;
    }
    if (op->order != NULL || in->H0 != NULL) {
        float *positions = work_area_take(&rest, rows * row_bytes);
        for (size_t row = 0; row < rows; row++)
            light_row(op, row % op->n_channels, in->E + row * n, in->H0 != NULL ? in->H0 + row * n : NULL,
                      positions + row * n);
        lit = positions;
    }
    if (apart) P = work_area_take(&rest, rows * row_bytes);
    if (choose)
        op->kind->apply_selected(op, in->count, lit, in->n_selected, in->selected, P, rest);
    else
        op->kind->apply(op, in->count, lit, P, rest);
    for (size_t row = 0; row < rows; row++) {
        const float *H0 = in->H0 != NULL ? in->H0 + row * n : NULL;
        const size_t c = row % op->n_channels;
        if (in->selected == NULL)
            finish_row(op, c, in->quantity, in->E + row * n, H0, P + row * n, out + row * n);
        else
            finish_selected(op, c, in->quantity, lit + row * n, H0, in->n_selected, in->selected, !choose,
                            P + row * (choose ? in->n_selected : n), out + row * in->n_selected);
    }
}

/* Vectors that are put in order together, some passes. */
enum { ORDERED = 16 * OPERATOR_PASS };

/* A vector of a batch and its first number that is not 0. */
typedef struct first_light {
    size_t at;
    uint16_t vector;
} first_light;

static int compare_light(const void *a, const void *b) {
    const first_light *x = a, *y = b;
    if (x->at != y->at) return x->at < y->at ? -1 : 1;
    return x->vector < y->vector ? -1 : 1;
}

/* Orders `count` vectors of `size` numbers by where their light begins: a pass of lamps of one place reads
 * less of an operator than one of lamps of many. */
static void order_by_light(size_t count, size_t size, const float *E, uint16_t *order) {
    first_light first[ORDERED];
    for (size_t v = 0; v < count; v++) {
        size_t at = 0;
        while (at < size && E[v * size + at] == 0) at++;
        first[v] = (first_light){at, (uint16_t)v};
    }
    qsort(first, count, sizeof *first, compare_light);
    for (size_t v = 0; v < count; v++) order[v] = first[v].vector;
}

/* The passes of some vectors, at most ORDERED, where the kind gives answers and several passes are needed. */
static void apply_ordered(const lam_operator *op, size_t count, const pass *all, float *out, void *work) {
    uint16_t order[ORDERED];
    order_by_light(count, op->n_channels * op->n, all->E, order);
    for (size_t r = 0; r < count; r += OPERATOR_PASS) {
        pass one = *all;
        one.count = count - r < OPERATOR_PASS ? count - r : OPERATOR_PASS;
        one.order = order + r;
        apply_pass(op, &one, out, work);
    }
}

static void apply_passes(const lam_operator *op, size_t n_rhs, const pass *all, float *out, void *work) {
    const size_t in_size = op->n_channels * op->n;
    const size_t out_size = all->selected != NULL ? op->n_channels * all->n_selected : in_size;
    const bool ordered = op->kind->answer != NULL && all->selected == NULL && n_rhs > OPERATOR_PASS;
    const size_t step = ordered ? ORDERED : OPERATOR_PASS;
    for (size_t r = 0; r < n_rhs; r += step) {
        pass one = *all;
        one.count = n_rhs - r < step ? n_rhs - r : step;
        one.E += r * in_size;
        if (one.H0 != NULL) one.H0 += r * in_size;
        if (ordered)
            apply_ordered(op, one.count, &one, out + r * out_size, work);
        else
            apply_pass(op, &one, out + r * out_size, work);
    }
}

lam_status lam_operator_apply(const lam_operator *op, size_t n_rhs, lam_quantity quantity, const float *E,
                              float *out, void *work, size_t work_bytes, lam_error *error) {
    return lam_operator_apply_lit(op, n_rhs, quantity, E, NULL, out, work, work_bytes, error);
}

lam_status lam_operator_apply_lit(const lam_operator *op, size_t n_rhs, lam_quantity quantity, const float *E,
                                  const float *H0, float *out, void *work, size_t work_bytes,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = op != NULL ? op->n : 0;
    TRY(check_apply(op, n_rhs, quantity, E, n, out, work, work_bytes, error));
    if (H0 != NULL) TRY(check_apply(op, n_rhs, quantity, H0, n, out, work, work_bytes, error));
    apply_passes(op, n_rhs, &(pass){.E = E, .H0 = H0, .quantity = quantity}, out, work);
done:
    return status;
}

/* The vectors of one pass, first ... first + count of all the parts'. */
static void list_vectors(const lam_operator *op, const lam_part *parts, size_t first, size_t count,
                         operator_vector *out) {
    const size_t size = op->n_channels * op->n;
    size_t k = 0, v = first; /* vector v of part k is next */
    for (size_t found = 0; found < count; v++) {
        for (; v >= parts[k].n_rhs; k++) v -= parts[k].n_rhs;
        const lam_part *part = &parts[k];
        out[found++] = (operator_vector){part->quantity, part->E + v * size,
                                         part->H0 != NULL ? part->H0 + v * size : NULL, part->out + v * size};
    }
}

/* Gathered, computed, handed out. */
static void share_pass(const lam_operator *op, const lam_part *parts, size_t first, size_t count,
                       void *work) {
    const size_t n = op->n, C = op->n_channels, bytes = count * C * n * sizeof(float);
    operator_vector vectors[OPERATOR_PASS];
    void *rest = work_area_begin(work);
    list_vectors(op, parts, first, count, vectors);
    if (op->kind->answer != NULL) {
        op->kind->answer(op, count, vectors, rest);
        return;
    }
    float *lit = work_area_take(&rest, bytes), *P = work_area_take(&rest, bytes);
    for (size_t row = 0; row < count * C; row++) {
        const operator_vector *v = &vectors[row / C];
        const size_t at = row % C * n;
        light_row(op, row % C, v->E + at, v->H0 != NULL ? v->H0 + at : NULL, lit + row * n);
    }
    op->kind->apply(op, count, lit, P, rest);
    for (size_t row = 0; row < count * C; row++) {
        const operator_vector *v = &vectors[row / C];
        const size_t at = row % C * n;
        finish_row(op, row % C, v->quantity, v->E + at, v->H0 != NULL ? v->H0 + at : NULL, P + row * n,
                   v->out + at);
    }
}

lam_status lam_operator_apply_parts(const lam_operator *op, size_t n_parts, const lam_part *parts, void *work,
                                    size_t work_bytes, lam_error *error) {
    lam_status status = LAM_OK;
    size_t total = 0;
    for (size_t k = 0; k < n_parts; k++) {
        const lam_part *part = &parts[k];
        const size_t n = op != NULL ? op->n : 0;
        TRY(check_apply(op, part->n_rhs, part->quantity, part->E, n, part->out, work, work_bytes, error));
        if (part->H0 != NULL)
            TRY(check_apply(op, part->n_rhs, part->quantity, part->H0, n, part->out, work, work_bytes,
                            error));
        if (__builtin_add_overflow(total, part->n_rhs, &total))
            FAIL(error, LAM_ERR_ARGUMENT, "%zu parts have more vectors than memory can", n_parts);
    }
    if (n_parts == 1) {
        const lam_part *part = parts;
        return lam_operator_apply_lit(op, part->n_rhs, part->quantity, part->E, part->H0, part->out, work,
                                      work_bytes, error);
    }
    if (n_parts > 0 && work_bytes < lam_operator_work_bytes(op, total))
        FAIL(error, LAM_ERR_ARGUMENT, "work area of %zu bytes, %zu are needed for %zu vectors", work_bytes,
             lam_operator_work_bytes(op, total), total);
    for (size_t first = 0; first < total; first += OPERATOR_PASS)
        share_pass(op, parts, first, total - first < OPERATOR_PASS ? total - first : OPERATOR_PASS, work);
done:
    return status;
}

lam_status lam_operator_apply_selected(const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                                       const float *E, const float *H0, size_t n_selected,
                                       const uint32_t *selected, float *out, void *work, size_t work_bytes,
                                       lam_error *error) {
    lam_status status = LAM_OK;
    TRY(check_apply(op, n_rhs, quantity, E, n_selected, out, work, work_bytes, error));
    if (H0 != NULL) TRY(check_apply(op, n_rhs, quantity, H0, n_selected, out, work, work_bytes, error));
    if (selected == NULL) FAIL(error, LAM_ERR_ARGUMENT, "a list of the elements selected is needed");
    for (size_t r = 0; r < n_selected; r++)
        if (selected[r] >= op->n)
            FAIL(error, LAM_ERR_ARGUMENT, "selected[%zu] = %u, must be below %zu", r, (unsigned)selected[r],
                 op->n);
    apply_passes(
        op, n_rhs,
        &(pass){.E = E, .H0 = H0, .quantity = quantity, .n_selected = n_selected, .selected = selected}, out,
        work);
done:
    return status;
}

/* One row of g (mesh order) pulled back through the quantity, into position order: what P^T takes. */
static void pull_back_row(const lam_operator *op, size_t c, lam_quantity quantity, const float *g,
                          float *pulled) {
    const float *rho = op->reflectance + c * op->n;
    for (size_t p = 0; p < op->n; p++) {
        size_t i = op->order != NULL ? op->order[p] : p;
        if (quantity == LAM_IRRADIANCE)
            pulled[p] = rho[i] > 0.0f ? g[i] / rho[i] : g[i];
        else
            pulled[p] = rho[i] > 0.0f ? g[i] : 0.0f;
    }
}

lam_status lam_operator_apply_adjoint(const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                                      const float *g, float *w, void *work, size_t work_bytes,
                                      lam_error *error) {
    lam_status status = LAM_OK;
    TRY(check_apply(op, n_rhs, quantity, g, op != NULL ? op->n : 0, w, work, work_bytes, error));
    size_t n = op->n, row_bytes = n * sizeof(float);
    for (size_t r = 0; r < n_rhs; r += OPERATOR_PASS) {
        size_t count = n_rhs - r < OPERATOR_PASS ? n_rhs - r : OPERATOR_PASS, rows = count * op->n_channels;
        const float *g_pass = g + r * op->n_channels * n;
        float *w_pass = w + r * op->n_channels * n, *transposed = w_pass;
        void *rest = work_area_begin(work);
        float *pulled = work_area_take(&rest, rows * row_bytes);
        if (op->order != NULL) transposed = work_area_take(&rest, rows * row_bytes);
        for (size_t row = 0; row < rows; row++)
            pull_back_row(op, row % op->n_channels, quantity, g_pass + row * n, pulled + row * n);
        op->kind->apply_adjoint(op, count, pulled, transposed, rest);
        for (size_t row = 0; row < rows; row++)
            for (size_t p = 0; p < n; p++) {
                size_t i = row * n + (op->order != NULL ? op->order[p] : p);
                float direct = quantity == LAM_RADIOSITY ? g_pass[i] : 0.0f;
                w_pass[i] = direct + transposed[row * n + p];
            }
    }
done:
    return status;
}
