/* The list of operator kinds, and what all of them share: loading, checks, mesh order, quantities.
 * Knows no kind from inside. */
#include "solver/operator/operator.h"

#include <stdlib.h>
#include <string.h>

static const operator_kind *const operator_kinds[] = {&operator_exact, &operator_low_rank, &operator_two_mesh,
                                                      &operator_sparse, &operator_emitters};

/* Kinds of the format that are still to come. */
static const char *const future_kinds[] = {"hierarchical"};

const operator_kind *operator_kind_find(const char *name) {
    for (size_t i = 0; i < sizeof operator_kinds / sizeof *operator_kinds; i++)
        if (strcmp(operator_kinds[i]->name, name) == 0) return operator_kinds[i];
    return NULL;
}

lam_status operator_init(lam_operator *op, const operator_kind *kind, size_t n, size_t n_channels,
                         const float *reflectance, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count;
    if (n == 0 || n_channels == 0 || n > UINT32_MAX || !size_multiply(n, n_channels, &count))
        FAIL(error, LAM_ERR_ARGUMENT, "an operator of %zu elements and %zu channels cannot be", n,
             n_channels);
    for (size_t i = 0; i < count; i++)
        if (!(reflectance[i] >= 0.0f && reflectance[i] < 1.0f))
            FAIL(error, LAM_ERR_NUMERIC, "reflectance[%zu][%zu] = %g, must be at least 0 and below 1", i / n,
                 i % n, (double)reflectance[i]);
    op->reflectance = memory_allocate(count, sizeof *op->reflectance, "reflectance", error);
    if (op->reflectance == NULL) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    memcpy(op->reflectance, reflectance, count * sizeof *op->reflectance);
    op->kind = kind;
    op->n = n;
    op->n_channels = n_channels;
    op->n_threads = 1;
done:
    return status;
}

lam_status operator_set_order(lam_operator *op, const uint32_t *order, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *copy = NULL, *position = NULL;
    if (order != NULL) {
        copy = memory_allocate(op->n, sizeof *copy, "order", error);
        position = memory_allocate(op->n, sizeof *position, "order", error);
        if (copy == NULL || position == NULL) TRY(LAM_ERR_MEMORY);
        memset(position, 0xff, op->n * sizeof *position);
        for (size_t p = 0; p < op->n; p++) {
            if (order[p] >= op->n)
                FAIL(error, LAM_ERR_NUMERIC, "order[%zu] = %u, must be below %zu", p, (unsigned)order[p],
                     op->n);
            if (position[order[p]] != UINT32_MAX)
                FAIL(error, LAM_ERR_NUMERIC, "order[%zu] = %u, which stands there twice", p,
                     (unsigned)order[p]);
            position[order[p]] = (uint32_t)p;
        }
        memcpy(copy, order, op->n * sizeof *copy);
    }
    free(op->order);
    free(op->position);
    op->order = copy;
    op->position = position;
    copy = position = NULL;
done:
    free(copy);
    free(position);
    return status;
}

/* The kind of an open store; its layout must be the one we know. */
static lam_status load_kind(store *s, const operator_kind **kind, lam_error *error) {
    lam_status status = LAM_OK;
    char *name = NULL, *layout = NULL;
    TRY(store_get_text(s, "/operator", "kind", &name, error));
    *kind = operator_kind_find(name);
    if (*kind == NULL) {
        for (size_t i = 0; i < sizeof future_kinds / sizeof *future_kinds; i++)
            if (strcmp(future_kinds[i], name) == 0)
                FAIL(error, LAM_ERR_UNSUPPORTED, "%s: kind '%s' is not supported yet", store_path(s), name);
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the unknown kind '%s'; precompute it again",
             store_path(s), name);
    }
    if (store_has_attribute(s, "/operator", "layout")) {
        TRY(store_get_text(s, "/operator", "layout", &layout, error));
        if (strcmp(layout, "panel64") == 0)
            FAIL(error, LAM_ERR_UNSUPPORTED, "%s: layout 'panel64' is not supported yet", store_path(s));
        if (strcmp(layout, "rows") != 0)
            FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the unknown layout '%s'", store_path(s), layout);
    }
done:
    free(name);
    free(layout);
    return status;
}

lam_status operator_load(store *s, lam_operator **out, lam_error *error) {
    lam_status status = LAM_OK;
    const operator_kind *kind = NULL;
    lam_operator *op = NULL;
    void *reflectance = NULL, *order = NULL;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX, SIZE_MAX};
    lam_error cause = {.message = ""};
    if (!store_has(s, "/operator"))
        FAIL(error, LAM_ERR_FORMAT, "%s: holds no operator; precompute it again", store_path(s));
    TRY(load_kind(s, &kind, error));
    TRY(store_read(s, "/mesh/reflectance", STORE_F32, 2, dims, &reflectance, error));
    size_t n_channels = dims[0], n = dims[1];
    if (n == 0 || n_channels == 0 || n > UINT32_MAX)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: /mesh/reflectance is %zu x %zu, must be channels x elements, not empty", store_path(s),
             n_channels, n);
    status = kind->load(s, n, n_channels, reflectance, &op, &cause);
    if (status == LAM_OK && store_has(s, "/operator/order")) {
        dims[0] = n;
        status = store_read(s, "/operator/order", STORE_U32, 1, dims, &order, &cause);
        if (status == LAM_OK) status = operator_set_order(op, order, &cause);
    }
    /* Values that cannot be, met in a file, make it a file that is not ours. */
    if (status == LAM_ERR_NUMERIC) FAIL(error, LAM_ERR_FORMAT, "%s: %s", store_path(s), cause.message);
    if (status != LAM_OK) FAIL(error, status, "%s", cause.message);
    *out = op;
    op = NULL;
done:
    free(reflectance);
    free(order);
    lam_operator_close(op);
    return status;
}

lam_status operator_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    operator_description description = {0};
    op->kind->describe(op, &description);
    TRY(store_set_text(s, "/operator", "kind", op->kind->name, error));
    if (description.form != NULL) TRY(store_set_text(s, "/operator", "form", description.form, error));
    TRY(store_set_text(s, "/operator", "layout", "rows", error));
    if (description.precision != NULL)
        TRY(store_set_text(s, "/operator", "precision", description.precision, error));
    if (op->order != NULL) TRY(store_write(s, "/operator/order", STORE_U32, 1, &op->n, op->order, error));
    TRY(op->kind->save(op, s, error));
done:
    return status;
}

void operator_describe(const lam_operator *op, operator_description *description) {
    *description = (operator_description){.density = -1};
    op->kind->describe(op, description);
}

lam_status lam_operator_open(const char *path, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    if (path == NULL || op == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "a path and a place for the operator are needed");
    TRY(store_open(path, &s, error));
    TRY(operator_load(s, op, error));
done:
    store_close(s);
    return status;
}

void lam_operator_close(lam_operator *op) {
    if (op == NULL) return;
    op->kind->destroy(op);
    free(op->reflectance);
    free(op->order);
    free(op->position);
    free(op);
}

size_t lam_operator_elements(const lam_operator *op) {
    return op->n;
}

size_t lam_operator_channels(const lam_operator *op) {
    return op->n_channels;
}

size_t lam_operator_bytes(const lam_operator *op) {
    operator_description description;
    operator_describe(op, &description);
    return description.bytes;
}

const char *lam_operator_kind(const lam_operator *op) {
    return op->kind->name;
}

void lam_operator_set_threads(lam_operator *op, size_t n_threads) {
    op->n_threads = n_threads > 0 ? n_threads : 1;
    if (op->kind->set_threads != NULL) op->kind->set_threads(op, op->n_threads);
}

lam_status operator_narrow(const lam_operator *op, panel_precision precision, lam_operator **out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *made = NULL;
    if (op->kind->narrow == NULL)
        FAIL(error, LAM_ERR_UNSUPPORTED, "an operator of kind '%s' is kept in f32", op->kind->name);
    TRY(op->kind->narrow(op, precision, &made, error));
    TRY(operator_set_order(made, op->order, error));
    lam_operator_set_threads(made, op->n_threads);
    *out = made;
    made = NULL;
done:
    lam_operator_close(made);
    return status;
}

/* A pass needs the caller's vectors in position order (the adjoint: g pulled back through the quantity), with
 * an order also the answer before it is put into mesh order (and where a kind cannot choose rows, in case
 * some are chosen), and what the kind needs. */
static size_t pass_bytes(const lam_operator *op, size_t n_rhs, size_t *vectors_bytes) {
    size_t count, vectors, kind_bytes = op->kind->work_bytes(op, n_rhs), total = PANEL_ALIGN;
    if (kind_bytes == 0 || !size_multiply(n_rhs, op->n_channels, &count) ||
        !size_multiply(count, op->n, &count) || !size_multiply(count, sizeof(float), &vectors) ||
        !work_add(&total, vectors) ||
        ((op->order != NULL || op->kind->apply_selected == NULL) && !work_add(&total, vectors)) ||
        !work_add(&total, kind_bytes))
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

/* n_out: numbers of out in a vector and a channel. */
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
done:
    return status;
}

static void *align_work(void *work) {
    return (char *)work + (PANEL_ALIGN - (uintptr_t)work % PANEL_ALIGN) % PANEL_ALIGN;
}

/* Rows shorter than this are finished by one thread. */
#define THREADS_WORTH 65536

/* One element of the quantity: from E' = E + rho H0, P and H0. */
static inline float finish(lam_quantity quantity, float rho, float lit, float P, float H0) {
    switch (quantity) {
    case LAM_RADIOSITY: /* B = E' + P */
        return rho > 0.0f ? lit + P : lit;
    case LAM_IRRADIANCE: /* H = H0 + P / rho' */
        return (rho > 0.0f ? P / rho : P) + H0;
    case LAM_INDIRECT: /* B - E' */
        return rho > 0.0f ? P : 0.0f;
    }
    return 0.0f;
}

/* One row of out (mesh order) from the same row of E' and of P (position order) and of H0 (mesh order, NULL:
 * 0). out may be P when there is no order. */
static void finish_row(const lam_operator *op, size_t c, lam_quantity quantity, const float *lit,
                       const float *H0, const float *P, float *out) {
    const float *rho = op->reflectance + c * op->n;
#pragma omp parallel for schedule(static)                                                                    \
    num_threads((int)op->n_threads) if (op->n_threads > 1 && op->n >= THREADS_WORTH)
    for (size_t p = 0; p < op->n; p++) {
        const size_t i = op->order != NULL ? op->order[p] : p;
        out[i] = finish(quantity, rho[i], lit[p], P[p], H0 != NULL ? H0[i] : 0.0f);
    }
}

/* The same for some elements: P holds theirs, or (by_position) all. out may be P when it holds theirs. */
static void finish_selected(const lam_operator *op, size_t c, lam_quantity quantity, const float *lit,
                            const float *H0, size_t n_selected, const uint32_t *selected, bool by_position,
                            const float *P, float *out) {
    const float *rho = op->reflectance + c * op->n;
    for (size_t r = 0; r < n_selected; r++) {
        const size_t i = selected[r], p = operator_position(op, i);
        out[r] = finish(quantity, rho[i], lit[p], P[by_position ? p : r], H0 != NULL ? H0[i] : 0.0f);
    }
}

/* One row of E' = E + rho H0, from mesh order into position order. */
static void light_row(const lam_operator *op, size_t c, const float *E, const float *H0, float *lit) {
    const float *rho = op->reflectance + c * op->n;
#pragma omp parallel for schedule(static)                                                                    \
    num_threads((int)op->n_threads) if (op->n_threads > 1 && op->n >= THREADS_WORTH)
    for (size_t p = 0; p < op->n; p++) {
        const size_t i = op->order != NULL ? op->order[p] : p;
        lit[p] = H0 != NULL ? E[i] + rho[i] * H0[i] : E[i];
    }
}

/* What one pass takes in, for all of out or (selected not NULL) some elements. */
typedef struct pass {
    const float *E, *H0;
    size_t count, n_selected;
    const uint32_t *selected;
    lam_quantity quantity;
} pass;

static void apply_pass(const lam_operator *op, const pass *in, float *out, void *work) {
    const size_t n = op->n, rows = in->count * op->n_channels, row_bytes = n * sizeof(float);
    const bool choose = in->selected != NULL && op->kind->apply_selected != NULL;
    const bool apart = in->selected != NULL ? !choose : op->order != NULL;
    const float *lit = in->E;
    float *P = out;
    void *rest = align_work(work);
    if (op->order != NULL || in->H0 != NULL) {
        float *positions = work_take(&rest, rows * row_bytes);
        for (size_t row = 0; row < rows; row++)
            light_row(op, row % op->n_channels, in->E + row * n, in->H0 != NULL ? in->H0 + row * n : NULL,
                      positions + row * n);
        lit = positions;
    }
    if (apart) P = work_take(&rest, rows * row_bytes);
    if (choose)
        op->kind->apply_selected(op, in->count, lit, in->n_selected, in->selected, P, rest);
    else
        op->kind->apply(op, in->count, lit, P, rest);
    for (size_t row = 0; row < rows; row++) {
        const float *H0 = in->H0 != NULL ? in->H0 + row * n : NULL;
        const size_t c = row % op->n_channels;
        if (in->selected == NULL)
            finish_row(op, c, in->quantity, lit + row * n, H0, P + row * n, out + row * n);
        else
            finish_selected(op, c, in->quantity, lit + row * n, H0, in->n_selected, in->selected, !choose,
                            P + row * (choose ? in->n_selected : n), out + row * in->n_selected);
    }
}

static void apply_passes(const lam_operator *op, size_t n_rhs, const pass *all, float *out, void *work) {
    const size_t in_size = op->n_channels * op->n;
    const size_t out_size = all->selected != NULL ? op->n_channels * all->n_selected : in_size;
    for (size_t r = 0; r < n_rhs; r += OPERATOR_PASS) {
        pass one = *all;
        one.count = n_rhs - r < OPERATOR_PASS ? n_rhs - r : OPERATOR_PASS;
        one.E += r * in_size;
        if (one.H0 != NULL) one.H0 += r * in_size;
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
        void *rest = align_work(work);
        float *pulled = work_take(&rest, rows * row_bytes);
        if (op->order != NULL) transposed = work_take(&rest, rows * row_bytes);
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
